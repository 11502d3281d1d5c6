// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A belly with marks, a camera in it that differs from the nominal one, and a person who puts a light on marks: what is seen,
// without pictures.
#include "Core/Base/Angles.h"
#include "Core/Base/Percentile.h"
#include "Core/Base/Random.h"
#include "Core/Geometry/RigidTransform.h"
#include "Tracking/Optical/SurfaceCalibration.h"
#include <cmath>
#include <gtest/gtest.h>
#include <memory>
#include <vector>

namespace echorama::calibration_stage {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Half of an ellipsoid. (In a sphere, from its middle, nobody can tell a camera that is higher from a lens that is longer.)
inline Vector3d OnBelly(double up, double around)
{
  return {130.0 * std::cos(up) * std::cos(around), 110.0 * std::cos(up) * std::sin(around), 90.0 * std::sin(up)};
}

inline std::shared_ptr<const TrackedSkin> BellySkin()
{
  TriangleSurface belly;
  const int rings = 60, steps = 120;
  for (int ring = 0; ring <= rings; ++ring)
    for (int step = 0; step < steps; ++step)
      belly.points.push_back(OnBelly(Pi / 2.0 * ring / rings, 2.0 * Pi * step / steps).cast<float>());
  const auto at = [&](int ring, int step) { return static_cast<std::uint32_t>(ring * steps + step % steps); };
  for (int ring = 0; ring < rings; ++ring)
    for (int step = 0; step < steps; ++step) {
      belly.triangles.push_back({at(ring, step), at(ring, step + 1), at(ring + 1, step + 1)});
      if (ring + 1 < rings)
        belly.triangles.push_back({at(ring, step), at(ring + 1, step + 1), at(ring + 1, step)});
    }
  return std::make_shared<const TrackedSkin>(std::move(belly));
}

// Along a spiral from the top down, on the mesh.
inline std::vector<Vector3d> MarksOnBelly(const TrackedSkin& skin, int count)
{
  std::vector<Vector3d> marks;
  for (int i = 0; i < count; ++i)
    marks.push_back(skin.NearestTo(OnBelly(std::asin(1.0 - 0.9 * (i + 0.5) / count), 2.399963 * i))->point);
  return marks;
}

// The camera as it is: not as it is believed to be, and turned about its axis by what nobody knows.
struct Stage {
  explicit Stage(int markCount = 120, double turn = 2.2) : skin(BellySkin()), marks(MarksOnBelly(*skin, markCount))
  {
    nominalPlace.translation() = Vector3d(0.0, 0.0, -20.0);
    nominal.focal = 145.0;
    lens.focal = 150.0;
    lens.centreX = 325.0;
    lens.centreY = 236.0;
    lens.k1 = -0.026;
    lens.k2 = 0.002;
    place = nominalPlace;
    place.translation() += Vector3d(2.0, -3.0, 1.5);
    place.rotate(Eigen::AngleAxisd(turn, Vector3d::UnitZ()));
    place.rotate(Eigen::AngleAxisd(0.03, Vector3d::UnitX()));
  }

  std::optional<Vector2d> PixelOf(const Vector3d& point) const { return lens.Project(place.inverse() * point); }

  // What a person who is told to go to a mark makes the session see: the light rests there, a little off, then moves away.
  // \returns what came of the rest
  CalibrationStep Visit(SurfaceCalibration& session, const Vector3d& point, double size = 2.0, double peak = 100.0)
  {
    Random random(seed, static_cast<std::uint64_t>(++visits));
    const Vector3d error = placementMm * Vector3d(random.Normal(), random.Normal(), random.Normal());
    const Vector2d pixel = *PixelOf(skin->NearestTo(point + error)->point);
    TrackedLight light;
    light.light = 0;
    light.status = TrackedLight::Status::Seen;
    light.spot.covariance = 0.02 * 0.02 * Eigen::Matrix2d::Identity();
    light.spot.size = size;
    light.spot.peak = peak;
    CalibrationStep step;
    for (int n = 0; n < 25; ++n) {
      light.spot.position = pixel + 0.02 * Vector2d(random.Normal(), random.Normal());
      const CalibrationStep now = session.Update(light);
      if (now.event != CalibrationStep::Event::None)
        step = now;
    }
    TrackedLight none;
    for (int n = 0; n < 30; ++n) // lifted
      session.Update(none);
    return step;
  }
  CalibrationStep VisitNext(SurfaceCalibration& session) { return Visit(session, session.PlaceOf(session.Next())); }
  void VisitAll(SurfaceCalibration& session)
  {
    while (session.Next() > 0)
      ASSERT_EQ(VisitNext(session).event, CalibrationStep::Event::Taken);
  }

  // How far the map is off at places between the marks: 95%.
  double Error95(const SurfaceMap& map) const
  {
    std::vector<double> errors;
    for (const Vector3d& place3 : MarksOnBelly(*skin, 333)) {
      const auto pixel = PixelOf(place3);
      if (!pixel)
        continue;
      const MappedPoint mapped = map.Map(*pixel);
      if (mapped.status == MappedPoint::Status::Mapped)
        errors.push_back((mapped.point - place3).norm());
    }
    EXPECT_GT(errors.size(), 280u);
    return errors.empty() ? HUGE_VAL : Percentile(errors, 0.95);
  }

  std::shared_ptr<const TrackedSkin> skin;
  std::vector<Vector3d> marks;
  FisheyeLens nominal, lens;
  Pose nominalPlace = Pose::Identity(), place = Pose::Identity();
  double placementMm = 0.1;
  std::uint64_t seed = 1;
  int visits = 0;
};

} // namespace echorama::calibration_stage
