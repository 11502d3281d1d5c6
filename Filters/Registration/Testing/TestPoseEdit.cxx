// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Registration/PoseEdit.h"
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;
using Eigen::Vector3d;

namespace {

Pose Turned(double x, double y, double z)
{
  PoseEdit edit;
  edit.degrees = Vector3d(x, y, z);
  return edit.Motion();
}

} // namespace

TEST(PoseEdit, QuarterTurnsAreExactInAnyNumber)
{
  const Vector3d point(1, 2, 3);
  for (const double degrees : {90.0, -270.0, 450.0, 36000090.0}) {
    EXPECT_EQ(Turned(0, 0, degrees) * point, Vector3d(-2, 1, 3)) << degrees;
    EXPECT_EQ(Turned(degrees, 0, 0) * point, Vector3d(1, -3, 2)) << degrees;
    EXPECT_EQ(Turned(0, degrees, 0) * point, Vector3d(3, 2, -1)) << degrees;
  }
}

TEST(PoseEdit, TurnsAboutYThenXThenZ)
{
  const Pose inTurn = Turned(0, 0, -30) * Turned(10, 0, 0) * Turned(0, 20, 0);
  EXPECT_LT((Turned(10, 20, -30).matrix() - inTurn.matrix()).norm(), 1e-15);
}

TEST(PoseEdit, TheCentreStaysAndThenEverythingMoves)
{
  PoseEdit edit;
  EXPECT_EQ(edit.Motion().matrix(), Eigen::Matrix4d::Identity());
  edit.translationMm = Vector3d(1, 2, 3);
  edit.degrees = Vector3d(10, 20, -30);
  edit.centreMm = Vector3d(40, -7, 12);
  EXPECT_LT((edit.Motion() * edit.centreMm - edit.centreMm - edit.translationMm).norm(), 1e-12);
}

TEST(PoseEdit, NumbersAreNeeded)
{
  for (Vector3d PoseEdit::*what : {&PoseEdit::translationMm, &PoseEdit::degrees, &PoseEdit::centreMm})
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      PoseEdit edit;
      (edit.*what)[1] = bad;
      EXPECT_THROW(edit.Motion(), Error);
    }
}
