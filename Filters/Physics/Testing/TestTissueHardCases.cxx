// SPDX-License-Identifier: BSD-3-Clause
// What breaks solvers of tissue: cells inside out, cells without volume, edges, a probe that moves on in small steps, bodies that
// meet; and the patch test.
#include "Filters/Physics/TissuePress.h"
#include "Testing/Sanitized.h"
#include <gtest/gtest.h>

using namespace echorama;

namespace {

TissueBody Block(const std::array<int, 3>& nodes, double spacing, double poisson)
{
  TissueBody body;
  body.nodes.dimensions = nodes;
  body.nodes.spacing.setConstant(spacing);
  body.materials = {{20.0, poisson, 1.0, false}};
  body.cells.assign(static_cast<std::size_t>((nodes[0] - 1) * (nodes[1] - 1) * (nodes[2] - 1)), 0);
  return body;
}

Pose At(double x, double y, double z)
{
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(x, y, z);
  return pose;
}

std::shared_ptr<const ProbeShape> Convex()
{
  return std::make_shared<const ProbeShape>(ProbeGeometry::Convex(0.8, 25.0, 0.5, 20.0, 0.0, 100.0));
}

double Farthest(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b)
{
  double farthest = 0.0;
  for (std::size_t n = 0; n < a.size(); ++n)
    farthest = std::max(farthest, (a[n] - b[n]).norm());
  return farthest;
}

// Of the nodes of the skin, how deep the deepest lies in the probe. (Contact is theirs alone: where a face bends sharply over the
// rim of a head, the node below it can lie a tenth of a cell inside.)
double Depth(const TissueBody& body, const TissuePress& press, const ProbeShape& probe, const Pose& pose)
{
  const auto& size = body.nodes.dimensions;
  const auto isSkin = [&size](int i, int j, int k) {
    return i == 0 || j == 0 || k == 0 || i + 1 == size[0] || j + 1 == size[1] || k + 1 == size[2];
  };
  const std::vector<Eigen::Vector3d> u = press.Displacements();
  double depth = 0.0;
  std::size_t n = 0;
  ForNodes(body.nodes.dimensions, [&](int i, int j, int k) {
    const Eigen::Vector3d place = body.nodes.origin + body.nodes.spacing.cwiseProduct(Eigen::Vector3d(i, j, k)) + u[n++];
    if (isSkin(i, j, k))
      depth = std::max(depth, -probe.Distance(pose.inverse() * place));
  });
  return depth;
}

// A solver whose outermost nodes are held; \a displacement of the others is where it starts.
class HeldBlock {
public:
  static constexpr std::array<int, 3> Nodes{9, 8, 7};

  HeldBlock() : shape_(Nodes), cells_(Nodes), live_(static_cast<std::size_t>(shape_.size), 0.0f)
  {
    for (int k = 0; k < cells_.cells[2]; ++k)
      for (int j = 0; j < cells_.cells[1]; ++j)
        for (int i = 0; i < cells_.cells[0]; ++i) {
          // Of uneven stiffness there would be no uniform strain; of uneven resistance to volume neither.
          cells_.shear[cells_.At(i, j, k)] = 7.0f;
          cells_.bulk[cells_.At(i, j, k)] = 200.0f;
        }
    ForNodes(Nodes,
             [&](int i, int j, int k) { live_[static_cast<std::size_t>(shape_.At(i, j, k))] = IsInner(i, j, k) ? 1.0f : 0.0f; });
  }

  static bool IsInner(int i, int j, int k)
  {
    return i > 0 && j > 0 && k > 0 && i + 1 < Nodes[0] && j + 1 < Nodes[1] && k + 1 < Nodes[2];
  }
  TissueSolver Solver() const { return TissueSolver(cells_, shape_, spacing_, live_, Eigen::Vector3d::Zero()); }
  Eigen::Vector3d Place(int i, int j, int k) const { return spacing_.cwiseProduct(Eigen::Vector3d(i, j, k)); }
  const LatticeShape& Shape() const { return shape_; }

private:
  LatticeShape shape_;
  TissueCells cells_;
  Eigen::Vector3d spacing_{2.0, 3.0, 2.5};
  std::vector<float> live_;
};

TEST(TissueHardCases, PatchTestIsExact)
{
  const HeldBlock block;
  TissueSolver solver = block.Solver();
  Eigen::Matrix3d strain;
  strain << 0.2, 0.1, -0.05, 0.3, -0.15, 0.1, 0.05, -0.1, 0.12;
  ForNodes(HeldBlock::Nodes, [&](int i, int j, int k) {
    if (!HeldBlock::IsInner(i, j, k))
      solver.Displacement().Set(block.Shape().At(i, j, k), strain * block.Place(i, j, k));
  });
  TissueWork work;
  ASSERT_TRUE(solver.Solve(false, 1e-7, 40, work, {}));
  EXPECT_FALSE(work.energyGrew);
  double worst = 0.0;
  ForNodes(HeldBlock::Nodes, [&](int i, int j, int k) {
    worst = std::max(worst, (solver.Displacement().Get(block.Shape().At(i, j, k)) - strain * block.Place(i, j, k)).norm());
  });
  EXPECT_LT(worst, 1e-6);
}

TEST(TissueHardCases, CellsThatAreInsideOutRecover)
{
  const HeldBlock block;
  TissueSolver solver = block.Solver();
  // The inner nodes are turned about the middle by half a turn, and two of them are thrown far out.
  const Eigen::Vector3d middle = 0.5 * block.Place(HeldBlock::Nodes[0] - 1, HeldBlock::Nodes[1] - 1, HeldBlock::Nodes[2] - 1);
  ForNodes(HeldBlock::Nodes, [&](int i, int j, int k) {
    if (HeldBlock::IsInner(i, j, k))
      solver.Displacement().Set(block.Shape().At(i, j, k),
                                2.0 * (middle - block.Place(i, j, k)).cwiseProduct(Eigen::Vector3d(1, 1, 0)));
  });
  solver.Displacement().Set(block.Shape().At(2, 2, 2), {30.0, -20.0, 10.0});
  solver.Displacement().Set(block.Shape().At(5, 4, 4), {-25.0, 5.0, -40.0});
  ASSERT_LT(solver.LeastVolume(), -1.0);
  TissueWork work;
  ASSERT_TRUE(solver.Solve(true, 1e-6, 100, work, {}));
  EXPECT_FALSE(work.energyGrew);
  EXPECT_GT(solver.LeastVolume(), 0.999);
  double worst = 0.0;
  for (const double value : solver.Displacement().Data())
    worst = std::max(worst, std::abs(value));
  EXPECT_LT(worst, 1e-5);
}

// A layer on bone, pressed until it has no place to go: whatever is not refused has volume everywhere and is not entered.
TEST(TissueHardCases, CellsNearlyWithoutVolumeAreReachedOrRefused)
{
  const TissueBody body = Block({13, 13, 5}, 3.0, 0.45);
  TissuePress press(body, {});
  const auto probe = Convex();
  bool isRefused = false;
  double least = 1.0;
  for (double depth = 3.0; depth < 12.0 && !isRefused; depth += 0.75) {
    const std::vector<Eigen::Vector3d> before = press.Displacements();
    try {
      press.Move(probe, At(18.0, 18.0, depth));
      EXPECT_LT(Depth(body, press, *probe, At(18.0, 18.0, depth)), 0.01);
      EXPECT_LT(press.LeastVolume(), least);
      least = press.LeastVolume();
    } catch (const Error& error) {
      isRefused = true;
      EXPECT_NE(std::string(error.what()).find("cannot go all the way"), std::string::npos) << error.what();
      EXPECT_EQ(Farthest(before, press.Displacements()), 0.0);
    }
    EXPECT_GT(press.LeastVolume(), 0.0);
  }
  EXPECT_TRUE(isRefused);
  EXPECT_LT(least, 0.5);
  press.Move(probe, At(18.0, 18.0, -2.0));
  EXPECT_LT(Farthest(press.Displacements(), std::vector<Eigen::Vector3d>(body.nodes.VoxelCount(), Eigen::Vector3d::Zero())),
            0.01);
}

TEST(TissueHardCases, ProbeOverAnEdgeIsNotEntered)
{
  const TissueBody body = Block({15, 15, 10}, 4.0, 0.45);
  for (const Eigen::Vector2d& place : {Eigen::Vector2d(1.0, 28.0), Eigen::Vector2d(3.0, 2.0)}) {
    TissuePress press(body, {});
    const auto probe = Convex();
    press.Move(probe, At(place.x(), place.y(), 6.0));
    EXPECT_LT(Depth(body, press, *probe, At(place.x(), place.y(), 6.0)), 0.01);
    EXPECT_GT(press.Force().z(), 0.05);
    EXPECT_GT(press.Force().x(), 0.05); // it is on that side of the probe
    EXPECT_GT(press.LeastVolume(), 0.2);
    EXPECT_FALSE(press.Work().energyGrew);
  }
}

// Down, and along the skin: without friction only where the probe is counts. Each move takes a handful of steps.
TEST(TissueHardCases, ManySmallMovesEndWhereOneLongMoveDoes)
{
  ECHORAMA_SKIP_SANITIZED();
  const TissueBody body = Block({20, 20, 12}, 5.0, 0.45);
  TissuePress little(body, {}), straight(body, {});
  const auto probe = Convex();
  int moves = 0;
  for (double depth = 0.5; depth <= 6.0; depth += 0.5, ++moves)
    little.Move(probe, At(40.0, 47.0, depth));
  for (double x = 40.5; x <= 48.0; x += 0.5, ++moves)
    little.Move(probe, At(x, 47.0, 6.0));
  straight.Move(probe, At(48.0, 47.0, 6.0));
  EXPECT_LT(Farthest(little.Displacements(), straight.Displacements()), 0.02);
  EXPECT_NEAR((little.Force() - straight.Force()).norm() / straight.Force().norm(), 0.0, 1e-3);
  EXPECT_FALSE(little.Work().energyGrew);
  EXPECT_LT(little.FinestWork().newtonSteps, 6 * moves);
}

// A soft plate, held all around, and a head that comes 12 mm in one move: the coarser lattice
// that is asked first lets it through between two nodes.
TEST(TissueHardCases, HeadDoesNotPassBetweenNodes)
{
  TissueBody body = Block({17, 17, 11}, 4.0, 0.4);
  std::fill(body.cells.begin() + 3 * 16 * 16, body.cells.end(), -1);
  TissuePressParameters parameters;
  parameters.fixXMin = parameters.fixXMax = parameters.fixYMin = parameters.fixYMax = true;
  TissuePress press(body, parameters);
  press.Move(Convex(), At(32.0, 32.0, 2.0));
  press.Move(Convex(), At(32.0, 32.0, 12.0));
  const Eigen::Vector3d middle = press.Displacements()[8 * 17 + 8];
  EXPECT_NEAR(middle.z(), 12.0, 0.05);
  EXPECT_LT(middle.head<2>().norm(), 0.1);
}

// A plate that hangs over a block with a gap of one or of two cells, held all around: it comes to lie on the block, which gives
// way.
TEST(TissueHardCases, PlateThatMeetsABlockPressesIt)
{
  for (const int gap : {1, 2}) {
    TissueBody body = Block({17, 17, 11}, 4.0, 0.4);
    const std::size_t layer = 16 * 16;
    for (int k = 3; k < 3 + gap; ++k)
      std::fill_n(body.cells.begin() + static_cast<std::ptrdiff_t>(layer) * k, layer, -1);
    TissuePressParameters parameters;
    parameters.fixXMin = parameters.fixXMax = parameters.fixYMin = parameters.fixYMax = true;
    TissuePress press(body, parameters);
    const auto probe = Convex();
    press.Move(probe, At(32.0, 32.0, 2.0));
    const auto middle = [&](int k) { return press.Displacements()[static_cast<std::size_t>((k * 17 + 8) * 17 + 8)].z(); };
    EXPECT_GT(middle(3), 1.0);
    EXPECT_LT(std::abs(middle(3 + gap)), 1e-4);
    press.Move(probe, At(32.0, 32.0, 4.0 * gap + 6.0));
    EXPECT_GT(middle(3 + gap), 1.0);
    EXPECT_NEAR(middle(3) - middle(3 + gap), 4.0 * gap, 0.05);
    EXPECT_LT(Depth(body, press, *probe, At(32.0, 32.0, 4.0 * gap + 6.0)), 0.01);
    EXPECT_FALSE(press.Work().energyGrew);
    press.Move(probe, At(32.0, 32.0, -2.0));
    EXPECT_LT(Farthest(press.Displacements(), std::vector<Eigen::Vector3d>(body.nodes.VoxelCount(), Eigen::Vector3d::Zero())),
              0.01);
  }
}

} // namespace
