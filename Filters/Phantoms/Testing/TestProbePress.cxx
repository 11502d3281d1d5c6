// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Phantoms/ProbePress.h"
#include <cmath>
#include <Eigen/LU>
#include <gtest/gtest.h>

using namespace echorama;
using Eigen::Vector3d;

namespace {

// By central differences.
Eigen::Matrix3d Gradient(const ProbePress& press, const Vector3d& point)
{
  constexpr double h = 1e-4;
  Eigen::Matrix3d gradient;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d step = h * Vector3d::Unit(axis);
    gradient.col(axis) = (press.DisplacementAt(point + step) - press.DisplacementAt(point - step)) / (2.0 * h);
  }
  return gradient;
}

template <class F>
void ForPoints(F&& f)
{
  for (double z = -30.0; z <= 130.0; z += 8.0)
    for (double y = -90.0; y <= 90.0; y += 12.0)
      for (double x = -90.0; x <= 90.0; x += 12.0)
        f(Vector3d(x, y, z));
}

} // namespace

TEST(ProbePress, PushesAlongTheAxisAndFadesWithDepthAndSideways)
{
  const ProbePress press{3.0};
  EXPECT_TRUE(press.DisplacementAt(Vector3d::Zero()).isApprox(Vector3d(0, 0, 3)));
  EXPECT_TRUE(press.DisplacementAt({0, 0, 35}).isApprox(Vector3d(0, 0, 3 * std::exp(-0.5)), 1e-12));
  EXPECT_NEAR(press.DisplacementAt({45, 0, 0}).z(), 3 * std::exp(-0.5), 1e-12);
  EXPECT_GT(press.DisplacementAt({20, 0, 35}).x(), 0.1); // bulges outwards
  EXPECT_GT(press.DisplacementAt({0, -20, 35}).z(), 1.0);
  EXPECT_LT(press.DisplacementAt({0, -20, 35}).y(), -0.1);
  EXPECT_LT(press.DisplacementAt({0, 0, 150}).norm(), 1e-3);
  EXPECT_EQ(ProbePress{}.DisplacementAt({1, 2, 3}), Vector3d::Zero());
  ForPoints([&press](const Vector3d& point) { EXPECT_LE(press.DisplacementAt(point).norm(), 3.0 + 1e-12); });
}

TEST(ProbePress, KeepsVolumesAndNeverFolds)
{
  const ProbePress press{ProbePress::maxMm};
  ForPoints([&press](const Vector3d& point) {
    const Eigen::Matrix3d gradient = Gradient(press, point);
    EXPECT_NEAR(gradient.trace(), 0.0, 1e-7) << point.transpose();
    const double volume = (Eigen::Matrix3d::Identity() + gradient).determinant();
    EXPECT_GT(volume, 0.9) << point.transpose();
    EXPECT_LT(volume, 1.1) << point.transpose();
    EXPECT_LT(gradient.norm(), 0.35) << point.transpose(); // what the inverse's convergence needs
  });
}

TEST(ProbePress, TheInverseComesBack)
{
  for (const double mm : {0.0, 1.0, ProbePress::maxMm}) {
    const ProbePress press{mm};
    ForPoints([&press](const Vector3d& point) {
      EXPECT_LT((press.Unpressed(press.Seen(point)) - point).norm(), 1e-9);
      EXPECT_LT((press.Seen(press.Unpressed(point)) - point).norm(), 1e-9);
    });
  }
}
