// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Live/PressStates.h"
#include <gtest/gtest.h>

namespace {

using namespace echorama;

constexpr double thick = 60.0; // of a layer on a hard ground, mm

// The layer, squeezed evenly by p: what lies at z at rest, below the skin at z = 0, is then at z + p (1 - z / thick).
LatticeMap Squeezed(double p, const Pose& placed = Pose::Identity())
{
  ImageGeometry g;
  g.dimensions = {17, 11, 21};
  g.spacing.setConstant(5.0);
  g.origin = {-40, -25, -40};
  g = g.Moved(placed);
  std::vector<Eigen::Vector3d> u;
  const Eigen::Affine3d toWorld = g.IndexToWorld();
  for (int k = 0; k < 21; ++k)
    for (int j = 0; j < 11; ++j)
      for (int i = 0; i < 17; ++i) {
        const double z = (placed.inverse() * (toWorld * Eigen::Vector3d(i, j, k))).z();
        u.push_back(placed.linear() * Eigen::Vector3d(0, 0, z < 0.0 ? p : p * (1.0 - z / thick)));
      }
  return LatticeMap(g, u);
}

Pose PressedIn(double p, const Pose& placed = Pose::Identity())
{
  Pose pose = placed;
  pose.translation() += placed.linear() * Eigen::Vector3d(0, 0, p);
  return pose;
}

const ProbeGeometry Flat = ProbeGeometry::Linear(50.0, 0.0, 0.0, 45.0);

// How far what is at a depth lay deeper, seen from the probe.
double Expected(double depth, double p)
{
  return depth / (1.0 - p / thick) - depth - p;
}

TEST(PressStates, GiveEachStateExactly)
{
  const Pose placed = MotionAbout({0, 0, 0}, {0.3, -0.4, 0.2}, {20, -10, 5});
  PressStates states;
  for (const double p : {4.0, 8.0, 12.0})
    states.Add(p, PressedIn(p, placed), Squeezed(p, placed));
  for (const double p : {8.0, 4.0, 12.0, 8.0}) {
    const BeamBend* bend = states.At(Flat, 5.0, p);
    ASSERT_NE(bend, nullptr);
    for (const double fan : {-0.5, -0.1, 0.37})
      for (const float depth : {0.0f, 3.0f, 17.0f, 45.0f})
        for (const float across : {-5.0f, 0.0f, 2.0f}) {
          const Eigen::Vector3f move = bend->Along(fan).At(depth, across);
          EXPECT_LT((move - Eigen::Vector3f(0, 0, static_cast<float>(Expected(depth, p)))).norm(), 1e-4f) << p << " " << depth;
        }
  }
}

TEST(PressStates, LieEvenlyBetweenTwo)
{
  PressStates states;
  states.Add(4.0, PressedIn(4.0), Squeezed(4.0));
  states.Add(12.0, PressedIn(12.0), Squeezed(12.0));
  for (const float depth : {0.0f, 20.0f, 45.0f}) {
    EXPECT_NEAR(states.At(Flat, 5.0, 7.0)->Along(0.0).At(depth, 0.0f).z(),
                0.625 * Expected(depth, 4.0) + 0.375 * Expected(depth, 12.0), 1e-4);
    EXPECT_NEAR(states.At(Flat, 5.0, 1.0)->Along(0.0).At(depth, 0.0f).z(), 0.25 * Expected(depth, 4.0), 1e-4);
  }
  // At the face it is exact whatever the press: what touches the probe lay as deep as it is pressed in.
  EXPECT_NEAR(states.At(Flat, 5.0, 7.0)->Along(0.2).At(0.0f, 0.0f).z(), -7.0, 1e-4);
  EXPECT_EQ(states.At(Flat, 5.0, 0.0), nullptr);
  // Another probe is noticed.
  const ProbeGeometry deeper = ProbeGeometry::Linear(50.0, 0.0, 10.0, 40.0);
  EXPECT_NEAR(states.At(deeper, 5.0, 4.0)->Along(0.0).At(10.0f, 0.0f).z(), Expected(10.0, 4.0), 1e-4);
}

TEST(PressStates, RefuseWhatTheyDoNotKnow)
{
  PressStates states;
  EXPECT_EQ(states.At(Flat, 5.0, 9.0), nullptr); // no states, nothing to go by
  states.Add(4.0, PressedIn(4.0), Squeezed(4.0));
  EXPECT_THROW(states.At(Flat, 5.0, 4.1), Error);
  EXPECT_THROW(states.Add(4.0, PressedIn(4.0), Squeezed(4.0)), Error);
  EXPECT_THROW(states.Add(0.0, PressedIn(0.0), Squeezed(0.0)), Error);
  Pose skew = Pose::Identity();
  skew.linear()(0, 0) = 2.0;
  EXPECT_THROW(states.Add(5.0, skew, Squeezed(5.0)), Error);
}

} // namespace
