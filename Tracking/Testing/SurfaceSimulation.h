// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Angles.h"
#include "Core/Base/Random.h"
#include "Tracking/Stream/SurfacePoseFilter.h"
#include <algorithm>
#include <cmath>
#include <vector>

namespace echorama {

/// A probe that a hand moves over a ball of 150 mm, and both of its streams. The world's z is up.
struct SurfaceSimulation {
  double seconds = 120.0;
  double latitudeDegrees = 30.0; // of the place, about which it wanders by +-20 degrees: 90 is the top
  double surfaceHz = 90.0, imuHz = 100.0, surfaceDelay = 0.04, imuDelay = 0.015;
  double noiseMm = 0.3, normalDegrees = 2.0, imuDegrees = 0.3;
  double driftDegreesPerMinute = 10.0, driftChange = 5.0, headingNoise = 0.1;
  double heldDegrees = 12.0, heldSeconds = 3.0;
  double dropped = 0.0;
  std::uint64_t seed = 1;
  Eigen::Matrix3d sensorToProbe = ExpRotation({0.3, -0.2, 1.0});

  struct Moment {
    Pose probeToWorld;
    Eigen::Vector3d normal;
    double drift; // of the heading, radians
  };
  std::vector<Moment> truth; // every millisecond

  Moment At(double time) const { return truth[static_cast<std::size_t>(std::lround(time * 1000.0))]; }

  void Run()
  {
    Random random(seed, 1);
    double rate = driftDegreesPerMinute * RadiansPerDegree / 60.0 * random.Normal(), drift = 0.0;
    const double held = heldDegrees * RadiansPerDegree, dt = 1e-3, kept = std::exp(-dt / heldSeconds);
    double a = held * random.Normal(), b = held * random.Normal();
    for (int n = 0; n <= static_cast<int>(seconds * 1000.0); ++n) {
      const double t = n * dt;
      const double latitude = (latitudeDegrees + 12.0 * std::sin(0.9 * t) + 8.0 * std::sin(0.37 * t + 1.0)) * RadiansPerDegree;
      const double longitude = 0.5 * std::sin(0.6 * t) + 0.3 * std::sin(0.23 * t + 2.0);
      Moment m;
      m.normal = {std::cos(latitude) * std::cos(longitude), std::cos(latitude) * std::sin(longitude), std::sin(latitude)};
      const double turned = 0.8 * std::sin(0.5 * t + 0.4);
      const Eigen::Vector3d east(-std::sin(longitude), std::cos(longitude), 0), z = -m.normal;
      Eigen::Matrix3d upright;
      const Eigen::Vector3d x = Eigen::AngleAxisd(turned, z) * east;
      upright << x, z.cross(x), z;
      // The inner normal is (a, b, .) as the probe sees it.
      const Eigen::Vector3d seen(a, b, std::sqrt(1.0 - a * a - b * b));
      m.probeToWorld.linear() = upright * Eigen::Quaterniond::FromTwoVectors(seen, Eigen::Vector3d::UnitZ()).toRotationMatrix();
      m.probeToWorld.translation() = 150.0 * m.normal;
      m.drift = drift;
      truth.push_back(m);
      drift += rate * dt + headingNoise * RadiansPerDegree * std::sqrt(dt) * random.Normal();
      rate += driftChange * RadiansPerDegree / 60.0 / std::sqrt(60.0) * std::sqrt(dt) * random.Normal();
      a = kept * a + held * std::sqrt(1 - kept * kept) * random.Normal();
      b = kept * b + held * std::sqrt(1 - kept * kept) * random.Normal();
      a = std::clamp(a, -0.6, 0.6);
      b = std::clamp(b, -0.6, 0.6);
    }
  }

  // What comes, in the order in which it comes; at(stamp, surface's or IMU's).
  template <class Surface, class Imu>
  void Send(Surface&& onSurface, Imu&& onImu) const
  {
    Random random(seed, 2);
    const auto vector = [&random](double sigma) -> Eigen::Vector3d {
      const double x = random.Normal(), y = random.Normal(), z = random.Normal();
      return sigma * Eigen::Vector3d(x, y, z);
    };
    double nextSurface = 0.0, nextImu = 0.0;
    while (std::max(nextSurface, nextImu) < seconds - 0.1) {
      const bool surface = nextSurface + surfaceDelay <= nextImu + imuDelay;
      const bool lost = random.Uniform() < dropped;
      if (surface) {
        const Moment m = At(nextSurface);
        const Eigen::Vector3d normal = ExpRotation(vector(normalDegrees * RadiansPerDegree)) * m.normal;
        const Eigen::Vector3d point = m.probeToWorld.translation() + vector(noiseMm);
        if (!lost)
          onSurface(nextSurface + surfaceDelay, point, normal);
        nextSurface = std::lround((nextSurface + 1.0 / surfaceHz) * 1000.0) / 1000.0;
      } else {
        const Moment m = At(nextImu);
        const Eigen::Matrix3d rotation = Eigen::AngleAxisd(m.drift, Eigen::Vector3d::UnitZ()) * m.probeToWorld.linear() *
                                         sensorToProbe * ExpRotation(vector(imuDegrees * RadiansPerDegree));
        if (!lost)
          onImu(nextImu + imuDelay, Eigen::Quaterniond(rotation));
        nextImu = std::lround((nextImu + 1.0 / imuHz) * 1000.0) / 1000.0;
      }
    }
  }

  SurfacePoseParameters Parameters() const
  {
    SurfacePoseParameters p;
    p.surfaceDelay = surfaceDelay;
    p.imuDelay = imuDelay;
    p.driftDegreesPerMinute = driftDegreesPerMinute;
    p.driftChange = driftChange;
    p.headingNoise = headingNoise;
    p.normalDegrees = normalDegrees;
    p.heldDegrees = heldDegrees;
    p.heldSeconds = heldSeconds;
    return p;
  }
};

} // namespace echorama
