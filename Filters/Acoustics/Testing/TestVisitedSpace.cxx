// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Filters/Acoustics/VisitedSpace.h"
#include <gtest/gtest.h>

using echorama::VisitedSpace;
using Eigen::AlignedBox3d;
using Eigen::Vector3d;

namespace {

double DistanceToLine(const Vector3d& point, const Vector3d& from, const Vector3d& direction, double length)
{
  const double along = std::min(std::max((point - from).dot(direction), 0.0), length);
  return (point - from - along * direction).norm();
}

TEST(VisitedSpace, HoldsAllThatIsNearALineAndLittleElse)
{
  const AlignedBox3d box(Vector3d(-50, -40, -10), Vector3d(60, 45, 130));
  const double cell = 4.0, radius = 3.0;
  echorama::Random random(3);
  VisitedSpace space(box, cell);
  const Vector3d from(1, 2, 3), direction = random.Direction();
  const double length = 40.0;
  space.MarkLine(from, direction, length, radius);
  for (int i = 0; i < 20000; ++i) {
    const Vector3d point = box.min() + Vector3d(random.Uniform(), random.Uniform(), random.Uniform()).cwiseProduct(box.sizes());
    const double distance = DistanceToLine(point, from, direction, length);
    const bool touched = space.Touches(AlignedBox3d(point, point));
    if (distance <= radius) {
      EXPECT_TRUE(touched) << point.transpose();
    }
    if (distance > std::sqrt(3.0) * (radius + 2.0 * cell)) {
      EXPECT_FALSE(touched) << point.transpose();
    }
  }
  EXPECT_TRUE(space.Touches(box));
}

TEST(VisitedSpace, NothingIsMarkedAtFirstAndNothingOutside)
{
  const AlignedBox3d box(Vector3d::Zero(), Vector3d::Constant(10.0));
  VisitedSpace space(box, 2.0);
  EXPECT_FALSE(space.Touches(box));
  space.MarkLine(Vector3d(100, 100, 100), Vector3d::UnitX(), 50.0, 1.0);
  EXPECT_FALSE(space.Touches(box));
  space.MarkLine(Vector3d(5, 5, 5), Vector3d::UnitX(), 0.0, 0.0);
  EXPECT_TRUE(space.Touches(box));
  EXPECT_FALSE(space.Touches(AlignedBox3d(Vector3d::Constant(1e30), Vector3d::Constant(2e30))));
  EXPECT_FALSE(space.Touches(AlignedBox3d()));
  EXPECT_FALSE(VisitedSpace(AlignedBox3d(), 1.0).Touches(box));
}

TEST(VisitedSpace, AHugeBoxGetsLargeCells)
{
  VisitedSpace space(AlignedBox3d(Vector3d::Constant(-1e6), Vector3d::Constant(1e6)), 1e-3);
  space.MarkLine(Vector3d::Zero(), Vector3d::UnitZ(), 10.0, 1.0);
  EXPECT_TRUE(space.Touches(AlignedBox3d(Vector3d::Zero(), Vector3d::Ones())));
  EXPECT_FALSE(space.Touches(AlignedBox3d(Vector3d::Constant(5e5), Vector3d::Constant(5.1e5))));
}

} // namespace
