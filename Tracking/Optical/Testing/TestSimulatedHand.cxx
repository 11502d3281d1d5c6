// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Optical/SimulatedHand.h"
#include <cmath>
#include <gtest/gtest.h>

namespace {

using namespace echorama;
using Eigen::Vector3d;

// Marks 30 mm apart on a sphere of 100 mm.
std::vector<Vector3d> Marks()
{
  std::vector<Vector3d> marks;
  for (int i = 0; i < 8; ++i)
    marks.push_back(100.0 * Vector3d(std::sin(0.3 * i), 0.1 * (i % 2), std::cos(0.3 * i)).normalized());
  return marks;
}

Vector3d ToSphere(const Vector3d& point)
{
  return 100.0 * point.normalized();
}

TEST(SimulatedHand, RestsWhereItIsToldAndLiftsOffOnItsWay)
{
  SimulatedHandParameters p;
  p.tremorMm = 0.0;
  SimulatedHand hand(p, Marks(), ToSphere);
  EXPECT_EQ(hand.At(0.0).peak, 0.0) << "nobody has told it anything";
  for (std::size_t mark = 0; mark < 8; ++mark)
    hand.GoTo(mark, static_cast<double>(mark));
  double squares = 0.0;
  for (std::size_t mark = 0; mark < 8; ++mark) {
    const double begin = static_cast<double>(mark);
    const LightOnSkin first = hand.At(begin + 0.45), last = hand.At(begin + 0.99);
    EXPECT_EQ(first.point, last.point);
    EXPECT_EQ(first.hoverMm, 0.0);
    EXPECT_NEAR(last.point.norm(), 100.0, 1e-9);
    squares += (last.point - Marks()[mark]).squaredNorm();
    if (mark > 0) {
      EXPECT_NEAR(hand.At(begin + 0.2).hoverMm, p.liftMm, 1e-6);
      EXPECT_LT((hand.At(begin + 1e-4).point - hand.At(begin - 1e-4).point).norm(), 0.01) << "it does not jump";
      EXPECT_LT((hand.At(begin + 0.4 + 1e-4).point - hand.At(begin + 0.4 - 1e-4).point).norm(), 0.01);
    }
  }
  EXPECT_NEAR(std::sqrt(squares / 16.0), p.placementMm, 0.06); // two axes of eight marks
  EXPECT_GT(squares, 0.0);
}

TEST(SimulatedHand, AWayThatIsCutShortGoesOnFromWhereItIs)
{
  SimulatedHand hand({}, Marks(), ToSphere);
  hand.GoTo(0, 0.0);
  hand.GoTo(7, 1.0);
  const Vector3d middle = hand.At(1.2).point;
  hand.GoTo(0, 1.2);
  EXPECT_LT((hand.At(1.2 + 1e-4).point - middle).norm(), 0.1);
  EXPECT_GT((middle - Marks()[0]).norm(), 50.0);
  EXPECT_LT((hand.At(2.0).point - Marks()[0]).norm(), 1.0);
  EXPECT_EQ(hand.At(1.2 - 1e-9).point, hand.At(1.2 - 1e-9).point);
  EXPECT_THROW(hand.GoTo(1, 1.0), Error) << "time does not go back";
  EXPECT_THROW(hand.GoTo(8, 3.0), Error);
}

TEST(SimulatedHand, TremblesAsMuchAsItIsTold)
{
  SimulatedHandParameters p;
  p.placementMm = 0.0;
  p.tremorMm = 0.2;
  SimulatedHand hand(p, Marks(), [](const Vector3d& point) { return point; });
  hand.GoTo(2, 0.0);
  Vector3d squares = Vector3d::Zero();
  for (int n = 0; n < 20000; ++n)
    squares += (hand.At(n * 1e-3).point - Marks()[2]).cwiseAbs2() / 20000.0;
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(std::sqrt(squares[axis]), 0.2, 0.02);
}

TEST(SimulatedHand, MistakesAShareOfMarksForTheirNeighbours)
{
  SimulatedHandParameters p;
  p.wrongMarks = 0.25;
  SimulatedHand hand(p, Marks(), ToSphere);
  int wrong = 0;
  for (int n = 0; n < 400; ++n) {
    const auto mark = static_cast<std::size_t>(n % 8);
    hand.GoTo(mark, n);
    if (hand.Mark() != mark) {
      ++wrong;
      EXPECT_LT((Marks()[hand.Mark()] - Marks()[mark]).norm(), 95.0) << "one of the three nearest";
      EXPECT_LT((hand.At(n + 0.9).point - Marks()[hand.Mark()]).norm(), 1.0) << "it says where it went";
    }
  }
  EXPECT_NEAR(wrong, 100, 35); // four standard deviations
}

} // namespace
