// SPDX-License-Identifier: BSD-3-Clause
// The tissue solver beside CalculiX, on the same cells and with small strains, where both are linear elasticity.
#include "Filters/Physics/Benchmarks/CalculixPeer.h"
#include <gtest/gtest.h>

using namespace echorama;
using namespace echorama::benchmark;

namespace {

// Soft tissue with a stiffer layer and a corner that is nearly incompressible: nothing about it is symmetric.
TissueBody LayeredBlock(const std::array<int, 3>& nodes, double spacing)
{
  TissueBody body;
  body.nodes.dimensions = nodes;
  body.nodes.spacing.setConstant(spacing);
  body.materials = {{20.0, 0.45, 1.0, false}, {100.0, 0.3, 1.4, false}, {10.0, 0.48, 0.9, false}};
  ForNodes({nodes[0] - 1, nodes[1] - 1, nodes[2] - 1}, [&](int i, int j, int k) {
    body.cells.push_back(k == nodes[2] / 2 && j > 3 ? 1 : i < 4 && k < 4 ? 2 : 0);
  });
  return body;
}

double Longest(const std::vector<Eigen::Vector3d>& vectors)
{
  double longest = 0.0;
  for (const Eigen::Vector3d& vector : vectors)
    longest = std::max(longest, vector.norm());
  return longest;
}

double WorstDifference(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b)
{
  std::vector<Eigen::Vector3d> differences;
  for (std::size_t n = 0; n < a.size(); ++n)
    differences.emplace_back(a[n] - b[n]);
  return Longest(differences);
}

TEST(TissuePeer, BlockUnderItsWeightIsThatOfCalculix)
{
  if (!HasCalculix())
    GTEST_SKIP() << "CalculiX (ccx) is not installed";
  const TissueBody body = LayeredBlock({17, 15, 13}, 4.0);
  TissuePressParameters parameters;
  parameters.gravity = Eigen::Vector3d(0.05, -0.08, 0.04);
  parameters.toleranceMm = 1e-6;
  const TissuePress press(body, parameters);
  const auto answer = SolveWithCalculix(body, parameters.gravity, {});
  ASSERT_TRUE(answer);
  const double longest = Longest(answer->displacements);
  EXPECT_GT(longest, 5e-3);
  EXPECT_LT(WorstDifference(press.Displacements(), answer->displacements), 0.02 * longest);
}

// Where the probe touches, CalculiX is told how far; the rest of the block and the force are its own.
TEST(TissuePeer, PressedBlockIsThatOfCalculix)
{
  if (!HasCalculix())
    GTEST_SKIP() << "CalculiX (ccx) is not installed";
  const TissueBody body = LayeredBlock({17, 17, 13}, 4.0);
  TissuePressParameters parameters;
  parameters.toleranceMm = 1e-5;
  TissuePress press(body, parameters);
  const double depth = 0.2; // linear elasticity, which CalculiX is asked for, holds for small strains
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(30.0, 32.0, depth);
  press.Move(std::make_shared<const ProbeShape>(ProbeGeometry::Convex(0.2, 150.0, 0.1, 150.0, 0.0, 100.0)), pose);
  const std::vector<Eigen::Vector3d> displacements = press.Displacements();
  const std::vector<unsigned char> touched = press.ContactNodes();
  std::map<std::size_t, Eigen::Vector3d> moved;
  for (std::size_t n = 0; n < touched.size(); ++n)
    if (touched[n])
      moved[n] = displacements[n];
  ASSERT_GT(moved.size(), 4u);
  const auto answer = SolveWithCalculix(body, Eigen::Vector3d::Zero(), moved);
  ASSERT_TRUE(answer);
  EXPECT_LT(WorstDifference(displacements, answer->displacements), 0.02 * depth);
  EXPECT_LT((press.Force() - answer->force).norm(), 0.02 * answer->force.norm());
}

} // namespace
