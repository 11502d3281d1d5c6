// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Median.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Percentile.h"
#include "Core/Base/SymmetricMatrix.h"
#include "Tracking/Optical/Testing/SurfaceTruth.h"
#include <algorithm>
#include <gtest/gtest.h>

namespace {

using namespace echorama;
using namespace echorama::truth;
using Eigen::Matrix2d;
using Status = MappedPoint::Status;

using Skin = std::shared_ptr<const TrackedSkin>;

Skin Dome()
{
  static const Skin skin = std::make_shared<TrackedSkin>(Ellipsoid({150.0, 120.0, 110.0}, 6));
  return skin;
}

Pose PoseAt(const Vector3d& place, const Vector3d& turnDegrees)
{
  Pose pose = Pose::Identity();
  pose.linear() = ExpRotation(turnDegrees / DegreesPerRadian);
  pose.translation() = place;
  return pose;
}

// Not the nominal one, and not where it should be.
TrueCamera Camera()
{
  TrueCamera camera;
  camera.lens.focal = 183.0;
  camera.lens.centreX = 327.0;
  camera.lens.centreY = 232.0;
  camera.lens.k1 = -0.035;
  camera.lens.k2 = 0.006;
  camera.lens.k3 = -0.001;
  camera.cameraToShell = PoseAt({6.0, -4.0, 3.0}, {3.0, -5.0, 20.0});
  return camera;
}
const Pose Nominal = PoseAt({0.0, 0.0, 0.0}, {0.0, 0.0, 0.0});

SurfaceMapParameters Exact()
{
  SurfaceMapParameters p;
  p.placementMm = 0.0;
  p.floorPx = 1e-4;
  return p;
}

// How far a map is off, at places between the marks.
std::vector<double> ErrorsOf(const SurfaceMap& map, const TrueCamera& camera, double mostDegrees, int count = 500)
{
  std::vector<double> errors;
  for (int i = 0; i < count; ++i) {
    Random random(99, static_cast<std::uint64_t>(i));
    const double angle = std::sqrt(random.Uniform()) * mostDegrees / DegreesPerRadian, turn = random.Uniform(0.0, 6.2831853);
    const Vector3d direction(std::sin(angle) * std::cos(turn), std::sin(angle) * std::sin(turn), std::cos(angle));
    const auto hit = map.Skin()->Along(camera.cameraToShell.translation(), camera.cameraToShell.linear() * direction);
    const auto pixel = hit ? camera.PixelOf(hit->seen) : std::nullopt;
    if (!pixel || !camera.lens.Covers(*pixel))
      continue;
    const MappedPoint mapped = map.Map(*pixel);
    EXPECT_EQ(static_cast<int>(mapped.status), static_cast<int>(Status::Mapped)) << pixel->transpose();
    errors.push_back((mapped.point - hit->point).norm());
  }
  return errors;
}

TEST(SurfaceMap, ExactObservationsAreReproduced)
{
  const auto observations = Observe(Camera(), *Dome(), 350, 85.0, 0.0, 0.0, 1);
  ASSERT_GT(observations.size(), 250u);
  const auto fitted = FitSurfaceMap(observations, Dome(), FisheyeLens(), Nominal, Exact());
  EXPECT_EQ(fitted.report.inliers, observations.size());
  for (const SurfaceObservation& o : observations) {
    const MappedPoint mapped = fitted.map.Map(o.pixel);
    ASSERT_EQ(static_cast<int>(mapped.status), static_cast<int>(Status::Mapped));
    EXPECT_LT((mapped.point - o.point).norm(), 1e-3);
    EXPECT_GT(mapped.normal.dot(o.point), 0.0);
  }
  const auto errors = ErrorsOf(fitted.map, Camera(), 75.0);
  ASSERT_GT(errors.size(), 400u);
  EXPECT_LT(*std::max_element(errors.begin(), errors.end()), 1e-3);
  const Pose& pose = fitted.map.State().cameraToShell;
  EXPECT_LT((pose.translation() - Camera().cameraToShell.translation()).norm(), 1e-3);
  EXPECT_NEAR(fitted.map.State().optics.lens.focal, 183.0, 1e-2);
}

TEST(SurfaceMap, ResidualRepairsWhatTheLensCannot)
{
  TrueCamera camera = Camera();
  camera.decentringX = 0.004;
  camera.tiltY = 0.01;
  const auto observations = Observe(camera, *Dome(), 350, 85.0, 0.02, 0.0, 1);
  SurfaceMapParameters p;
  p.placementMm = 0.0;
  const auto with = FitSurfaceMap(observations, Dome(), FisheyeLens(), Nominal, p);
  p.residualCentres = 0;
  const auto without = FitSurfaceMap(observations, Dome(), FisheyeLens(), Nominal, p);
  const auto errors = ErrorsOf(with.map, camera, 75.0), plain = ErrorsOf(without.map, camera, 75.0);
  EXPECT_LT(Percentile(errors, 0.95), 0.5 * Percentile(plain, 0.95));
  EXPECT_LT(Percentile(errors, 0.95), 0.02);
}

} // namespace
