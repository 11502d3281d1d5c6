// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Core/Base/SymmetricMatrix.h"
#include "Filters/Registration/PoseGraph.h"
#include "Testing/Sanitized.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numeric>
#include <set>

namespace echorama {
namespace {

constexpr double RadiansPerDegree = 0.017453292519943295;
constexpr double NoiseMm = 0.2, NoiseRadians = 0.2 * RadiansPerDegree;

std::size_t Index(int number)
{
  return static_cast<std::size_t>(number);
}

// Volumes at known poses, all over the place and turned by anything, and measurements between them with known noise.
class World {
public:
  World(int count, std::uint64_t seed) : random_(seed, 1)
  {
    for (int v = 0; v < count; ++v) {
      const double angle = 6.283185307179586 * v / count;
      Pose pose = Pose::Identity();
      pose.linear() = ExpRotation(random_.Direction() * random_.Uniform(0.0, 3.14));
      pose.translation() = Eigen::Vector3d(150.0 * std::cos(angle), 150.0 * std::sin(angle), random_.Uniform(-20.0, 20.0));
      truth.push_back(pose);
      Pose start = MotionAbout(pose.translation(), random_.Direction() * 0.1, random_.Direction() * 8.0) * pose;
      starts.push_back(v == 0 ? pose : start);
    }
  }

  PoseEdge Exact(int from, int to)
  {
    PoseEdge edge;
    edge.from = from;
    edge.to = to;
    edge.toInFrom = truth[Index(from)].inverse() * truth[Index(to)];
    edge.centre = 0.5 * edge.toInFrom.translation();
    edge.information.setZero();
    edge.information.diagonal() << Eigen::Vector3d::Constant(1.0 / (NoiseMm * NoiseMm)),
        Eigen::Vector3d::Constant(1.0 / (NoiseRadians * NoiseRadians));
    return edge;
  }

  void Measure(int from, int to)
  {
    PoseEdge edge = Exact(from, to);
    edge.toInFrom = MotionAbout(edge.centre, Normal(NoiseRadians), Normal(NoiseMm)) * edge.toInFrom;
    edges.push_back(edge);
  }

  /// Turns an edge wrong: by mm and degrees in random directions about its centre.
  void Spoil(std::size_t e, double mm = 20.0, double degrees = 15.0)
  {
    PoseEdge& edge = edges[e];
    edge.toInFrom =
        MotionAbout(edge.centre, random_.Direction() * (degrees * RadiansPerDegree), random_.Direction() * mm) * edge.toInFrom;
  }

  /// Each with the next two, around.
  void MeasureRing()
  {
    const int count = static_cast<int>(truth.size());
    for (int step = 1; step <= 2; ++step)
      for (int v = 0; v < count; ++v)
        Measure(v, (v + step) % count);
  }

  /// Mean distance between where two sets of poses put the volumes' origins, the fixed volume's poses made one.
  double Error(const std::vector<Pose>& poses, int fixed = 0) const
  {
    const Pose onto = truth[Index(fixed)] * poses[Index(fixed)].inverse();
    double sum = 0.0;
    for (std::size_t v = 0; v < truth.size(); ++v)
      sum += (onto * poses[v].translation() - truth[v].translation()).norm();
    return sum / static_cast<double>(truth.size() - 1);
  }

  Eigen::Vector3d Normal(double sigma)
  {
    const double x = random_.Normal(), y = random_.Normal(), z = random_.Normal();
    return sigma * Eigen::Vector3d(x, y, z);
  }

  std::vector<Pose> truth, starts;
  std::vector<PoseEdge> edges;

private:
  Random random_;
};

std::vector<std::size_t> Named(const std::vector<bool>& flags)
{
  std::vector<std::size_t> named;
  for (std::size_t i = 0; i < flags.size(); ++i)
    if (flags[i])
      named.push_back(i);
  return named;
}

void ExpectSame(const Pose& a, const Pose& b, double tolerance)
{
  EXPECT_LT((a.matrix() - b.matrix()).cwiseAbs().maxCoeff(), tolerance);
}

bool AllFinite(const PoseGraphResult& result)
{
  bool isFinite = true;
  for (const Pose& pose : result.volumeToWorld)
    isFinite = isFinite && pose.matrix().allFinite();
  for (const Information& information : result.information)
    isFinite = isFinite && information.allFinite();
  for (const double mm : result.residualMm)
    isFinite = isFinite && std::isfinite(mm);
  return isFinite;
}

using Edges = std::vector<std::size_t>;

TEST(PoseGraph, TwoVolumesGetWhatWasMeasured)
{
  World world(2, 1);
  world.Measure(0, 1);
  PoseGraphParameters p;
  p.floorMm = 0.0;
  const PoseGraphResult result = SolvePoseGraph(world.starts, world.edges, 0, p);
  ExpectSame(result.volumeToWorld[0], world.starts[0], 1e-15);
  ExpectSame(result.volumeToWorld[1], world.starts[0] * world.edges[0].toInFrom, 1e-12);
  EXPECT_TRUE(result.isPlaced[1] && result.isDetermined[1] && result.isBridge[0]);
  EXPECT_FALSE(result.isWrong[0] || result.isDoubtful[1]);
  EXPECT_LT(result.residualMm[0], 1e-10);
  // The covariance is the edge's, turned into the world.
  EXPECT_LT((result.centre[1] - world.starts[0] * world.edges[0].centre).norm(), 1e-10);
  const Information expected = world.edges[0].information; // isotropic
  EXPECT_LT((result.information[1] - expected).cwiseAbs().maxCoeff(), 1e-4 * expected.maxCoeff());

  // The other one fixed: the inverse.
  const PoseGraphResult other = SolvePoseGraph(world.starts, world.edges, 1, p);
  ExpectSame(other.volumeToWorld[0], world.starts[1] * world.edges[0].toInFrom.inverse(), 1e-12);
  EXPECT_LT((other.information[0] - expected).cwiseAbs().maxCoeff(), 1e-4 * expected.maxCoeff());
}

TEST(PoseGraph, TheCovarianceTurnsWithTheWorld)
{
  World world(2, 3);
  PoseEdge edge = world.Exact(0, 1);
  Twist weights;
  weights << 1.0, 4.0, 9.0, 100.0, 400.0, 900.0;
  edge.information = weights.asDiagonal();
  PoseGraphParameters p;
  p.floorMm = 0.0;
  const PoseGraphResult result = SolvePoseGraph(world.starts, {edge}, 0, p);
  Information turn = Information::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = world.starts[0].linear();
  const Information expected = turn * edge.information * turn.transpose();
  EXPECT_LT((result.information[1] - expected).cwiseAbs().maxCoeff(), 0.02);

  // Walked against its direction the edge says as much of the other volume.
  const PoseGraphResult other = SolvePoseGraph(world.starts, {edge}, 1, p);
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = other.volumeToWorld[0].linear();
  const Information back = turn * edge.information * turn.transpose();
  EXPECT_LT((other.information[0] - back).cwiseAbs().maxCoeff(), 0.02);
}

TEST(PoseGraph, ParallelEdgesAreAveragedByTheirWeights)
{
  World world(2, 2);
  PoseEdge a = world.Exact(0, 1), b = a;
  b.toInFrom = Eigen::Translation3d(0.9, 0.0, 0.0) * a.toInFrom;
  b.information *= 0.5;
  PoseGraphParameters p;
  p.floorMm = 0.0;
  const PoseGraphResult result = SolvePoseGraph(world.starts, {a, b}, 0, p);
  const Pose found = result.volumeToWorld[0].inverse() * result.volumeToWorld[1];
  EXPECT_NEAR(found.translation().x() - a.toInFrom.translation().x(), 0.3, 1e-6);
  EXPECT_FALSE(result.isWrong[0] || result.isWrong[1] || result.isBridge[0]);

  // One against one: both cannot be right, and nobody knows which.
  b.toInFrom = Eigen::Translation3d(20.0, 0.0, 0.0) * a.toInFrom;
  const PoseGraphResult torn = SolvePoseGraph(world.starts, {a, b}, 0, p);
  EXPECT_EQ(Named(torn.isWrong).size(), 1u);
  EXPECT_EQ(torn.isContested, torn.isWrong);
  EXPECT_TRUE(torn.isPlaced[1] && torn.isDoubtful[1]);
  // Two against one: named.
  const PoseGraphResult judged = SolvePoseGraph(world.starts, {a, b, a}, 0, p);
  EXPECT_EQ(Named(judged.isWrong), Edges{1});
  EXPECT_FALSE(judged.isContested[1] || judged.isDoubtful[1]);
  EXPECT_NEAR(judged.residualMm[1], 20.0, 1e-6);
}

TEST(PoseGraph, LoopsAreBetterThanATree)
{
  double graph = 0.0, tree = 0.0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    World world(10, seed);
    world.MeasureRing();
    const PoseGraphResult result = SolvePoseGraph(world.starts, world.edges, 0);
    EXPECT_TRUE(Named(result.isWrong).empty() && Named(result.isBridge).empty());
    graph += world.Error(result.volumeToWorld) / 20.0;
    tree += world.Error(SolvePoseGraph(world.starts, {world.edges.begin(), world.edges.begin() + 9}, 0).volumeToWorld) / 20.0;
  }
  EXPECT_LT(graph, 0.6 * tree);
}

TEST(PoseGraph, IdenticalPosesAndHalfTurns)
{
  World world(4, 5);
  for (std::size_t v = 0; v < 4; ++v) {
    world.truth[v] = Pose::Identity();
    // Half turns about different axes, to the last digit, seen from each other.
    if (v > 0)
      world.truth[v].linear() = ExpRotation(3.141592653589793 * Eigen::Vector3d::Unit(static_cast<int>(v) - 1));
    world.starts[v] = Pose::Identity();
  }
  world.MeasureRing();
  PoseGraphResult result = SolvePoseGraph(world.starts, world.edges, 0);
  EXPECT_TRUE(Named(result.isWrong).empty());
  for (std::size_t v = 0; v < 4; ++v)
    EXPECT_LT(RotationAngle(world.truth[v].inverse() * result.volumeToWorld[v]), 0.02);

  for (Pose& pose : world.truth)
    pose = Pose::Identity();
  world.edges = {world.Exact(0, 1), world.Exact(1, 2), world.Exact(2, 3), world.Exact(3, 0)};
  result = SolvePoseGraph(world.starts, world.edges, 0);
  for (const Pose& pose : result.volumeToWorld)
    ExpectSame(pose, Pose::Identity(), 1e-12);
  EXPECT_EQ(result.consistency, 0.0);
}

TEST(PoseGraph, TwoWrongPairsOfARingAreNamedAndNothingElse)
{
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    World world(10, seed);
    world.MeasureRing();
    Random random(seed, 99);
    const std::size_t first = random.Below(20), second = (first + 1 + random.Below(19)) % 20;
    world.Spoil(first);
    world.Spoil(second);
    const PoseGraphResult result = SolvePoseGraph(world.starts, world.edges, 0);
    const Edges expected{std::min(first, second), std::max(first, second)};
    EXPECT_EQ(Named(result.isWrong), expected) << "seed " << seed;
    EXPECT_TRUE(Named(result.isContested).empty() && Named(result.isDoubtful).empty()) << "seed " << seed;
    EXPECT_LT(world.Error(result.volumeToWorld), 1.5) << "seed " << seed;
    EXPECT_GT(result.residualMm[first], 15.0);
  }
}

// Two wrong pairs that tell the same lie: the ring is closed 20 mm beside itself. The third pair across is right.
TEST(PoseGraph, WrongPairsThatAgreeAreOutvoted)
{
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    World world(10, seed);
    world.MeasureRing();
    const Pose lie = MotionAbout({150.0, 0.0, 0.0}, {0.1, -0.2, 0.1}, {10.0, 15.0, 8.0});
    const auto tell = [&](std::size_t e) {
      PoseEdge& edge = world.edges[e];
      edge.toInFrom = world.truth[Index(edge.from)].inverse() * lie * world.truth[Index(edge.to)];
    };
    ASSERT_EQ(world.edges[18].from, 8);
    ASSERT_EQ(world.edges[19].from, 9);
    tell(18); // 8-0
    tell(19); // 9-1
    const PoseGraphResult result = SolvePoseGraph(world.starts, world.edges, 3);
    EXPECT_EQ(Named(result.isWrong), (Edges{18, 19})) << "seed " << seed;
    EXPECT_TRUE(Named(result.isDoubtful).empty());
  }
}

// Both pairs that hold volume 0 on one side tell the same lie: two against two, and only volume 0 is in doubt.
TEST(PoseGraph, ATieIsATie)
{
  World world(10, 4);
  world.MeasureRing();
  const Pose lie = MotionAbout({150.0, 0.0, 0.0}, {0.1, -0.2, 0.1}, {10.0, 15.0, 8.0});
  for (const std::size_t e : {9u, 18u}) // 9-0 and 8-0
    world.edges[e].toInFrom = world.truth[Index(world.edges[e].from)].inverse() * lie * world.truth[0];
  const PoseGraphResult result = SolvePoseGraph(world.starts, world.edges, 4);
  EXPECT_EQ(Named(result.isWrong).size(), 2u);
  EXPECT_EQ(result.isContested, result.isWrong);
  EXPECT_EQ(Named(result.isDoubtful), Edges{0});
}

TEST(PoseGraph, InAChainNobodyVotes)
{
  World world(10, 6);
  for (int v = 0; v < 9; ++v)
    world.Measure(v, v + 1);
  world.Spoil(4);
  const PoseGraphResult result = SolvePoseGraph(world.starts, world.edges, 0);
  EXPECT_TRUE(Named(result.isWrong).empty());
  EXPECT_EQ(Named(result.isBridge).size(), 9u);
  EXPECT_EQ(Named(result.isPlaced).size(), 10u);
  EXPECT_EQ(result.consistency, 0.0);
}

// One loop: that something is wrong is certain, what it is is not.
TEST(PoseGraph, OneLoopKnowsOnlyThatSomethingIsWrong)
{
  World world(6, 7);
  for (int v = 0; v < 6; ++v)
    world.Measure(v, (v + 1) % 6);
  world.Spoil(2);
  const PoseGraphResult result = SolvePoseGraph(world.starts, world.edges, 0);
  EXPECT_EQ(Named(result.isWrong).size(), 1u);
  EXPECT_EQ(result.isContested, result.isWrong);
  EXPECT_EQ(Named(result.isDoubtful), (Edges{1, 2, 3, 4, 5}));
}

// What the covariance says of the end of a chain is what many chains do.
TEST(PoseGraph, DriftIsPredicted)
{
  double square = 0.0, predicted = 0.0, turn = 0.0, predictedTurn = 0.0;
  const int seeds = 400;
  PoseGraphParameters p;
  p.floorMm = 0.0;
  for (std::uint64_t seed = 0; seed < seeds; ++seed) {
    World world(10, 8); // the same poses,
    World noise(10, 1000 + seed);
    for (int v = 0; v < 9; ++v) {
      PoseEdge edge = world.Exact(v, v + 1);
      edge.toInFrom = MotionAbout(edge.centre, noise.Normal(NoiseRadians), noise.Normal(NoiseMm)) * edge.toInFrom;
      world.edges.push_back(edge);
    }
    const PoseGraphResult result = SolvePoseGraph(world.starts, world.edges, 0, p);
    const Pose error = result.volumeToWorld[9] * world.truth[9].inverse();
    square += (error * result.centre[9] - result.centre[9]).squaredNorm() / seeds;
    turn += LogRotation(error.linear()).squaredNorm() / seeds;
    const Information covariance = result.information[9].inverse();
    predicted += covariance.topLeftCorner<3, 3>().trace() / seeds;
    predictedTurn += covariance.bottomRightCorner<3, 3>().trace() / seeds;
  }
  EXPECT_NEAR(std::sqrt(square / predicted), 1.0, 0.1);
  EXPECT_NEAR(std::sqrt(turn / predictedTurn), 1.0, 0.1);
  EXPECT_NEAR(std::sqrt(predictedTurn), std::sqrt(27.0) * NoiseRadians, 0.01 * NoiseRadians);
}

// Two ways in parallel, of v edges and of 20 - v edges: never worse than rotations alone would be, and the translations tell
// little more.
TEST(PoseGraph, CovarianceOfALoop)
{
  World world(20, 9);
  for (int v = 0; v < 20; ++v)
    world.edges.push_back(world.Exact(v, (v + 1) % 20));
  PoseGraphParameters p;
  p.floorMm = 0.0;
  const PoseGraphResult result = SolvePoseGraph(world.starts, world.edges, 0, p);
  for (int v = 1; v < 20; ++v) {
    const Information covariance = result.information[Index(v)].inverse();
    const double turn = covariance.diagonal().tail(3).sum();
    const double parallel = 3.0 * v * (20.0 - v) / 20.0 * NoiseRadians * NoiseRadians;
    EXPECT_LE(turn, 1.001 * parallel);
    EXPECT_GT(turn, 0.2 * parallel);
  }
}

// Volumes that are turned alike, with edges about one place of the world: each component of the twist is a network of its own,
// in which variances are resistances. Along a chain they add up; around a loop two ways are parallel.
TEST(PoseGraph, CovariancesFollowTheRulesOfResistances)
{
  constexpr int count = 7;
  World world(count, 21);
  const Eigen::Matrix3d turn = ExpRotation({0.5, -0.3, 0.8});
  const Eigen::Vector3d common(30.0, -20.0, 10.0);
  for (std::size_t v = 0; v < count; ++v) {
    world.truth[v].linear() = turn;
    world.starts[v] = world.truth[v];
  }
  Twist variances; // of an edge of weight one, in the frame of the volumes
  variances << 0.04, 0.09, 0.16, 1e-6, 4e-6, 9e-6;
  std::vector<PoseEdge> loop;
  std::vector<double> resistance;
  for (int v = 0; v < count; ++v) {
    resistance.push_back(1.0 + 0.5 * v);
    PoseEdge edge = world.Exact(v, (v + 1) % count);
    edge.centre = world.truth[Index(v)].inverse() * common;
    edge.information.setZero();
    edge.information.diagonal() = (resistance.back() * variances).cwiseInverse();
    loop.push_back(edge);
  }
  const std::vector<PoseEdge> chain(loop.begin(), loop.end() - 1);
  Information toWorld = Information::Zero();
  toWorld.topLeftCorner<3, 3>() = toWorld.bottomRightCorner<3, 3>() = turn;
  PoseGraphParameters p;
  p.floorMm = 0.0;
  const PoseGraphResult open = SolvePoseGraph(world.starts, chain, 0, p), closed = SolvePoseGraph(world.starts, loop, 0, p);
  const double around = std::accumulate(resistance.begin(), resistance.end(), 0.0);
  double sum = 0.0;
  for (int v = 1; v < count; ++v) {
    sum += resistance[Index(v) - 1];
    EXPECT_LT((open.centre[Index(v)] - common).norm(), 1e-9);
    const auto expectCovariance = [&](const PoseGraphResult& result, double factor) {
      const Information covariance = toWorld.transpose() * result.information[Index(v)].inverse() * toWorld;
      for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j)
          EXPECT_NEAR(covariance(i, j) / std::sqrt(variances[i] * variances[j]), i == j ? factor : 0.0, 1e-4 * factor)
              << v << " " << i << " " << j;
    };
    expectCovariance(open, sum);
    expectCovariance(closed, sum * (around - sum) / around);
  }
}

TEST(PoseGraph, SaysWhatIsNotDetermined)
{
  World world(3, 10);
  PoseEdge sphere = world.Exact(0, 1); // a sphere: no rotation about its centre can be seen
  sphere.information.bottomRightCorner<3, 3>().setZero();
  PoseGraphResult result = SolvePoseGraph(world.starts, {sphere, world.Exact(0, 2)}, 0);
  EXPECT_TRUE(AllFinite(result));
  EXPECT_TRUE(result.isPlaced[1] && result.isDetermined[2]);
  EXPECT_FALSE(result.isDetermined[1]);
  ExpectSame(result.volumeToWorld[1], world.starts[0] * sphere.toInFrom, 1e-12);

  // Nothing at all is known.
  PoseEdge nothing = world.Exact(0, 1);
  nothing.information.setZero();
  result = SolvePoseGraph(world.starts, {nothing, nothing, world.Exact(1, 2)}, 0);
  EXPECT_TRUE(AllFinite(result));
  EXPECT_FALSE(result.isDetermined[1] || result.isDetermined[2]);
  EXPECT_TRUE(result.isDetermined[0]);

  // Two spheres at different places leave one rotation open, three leave none.
  std::vector<PoseEdge> spheres(3, sphere);
  spheres[1].centre += Eigen::Vector3d(80.0, 0.0, 0.0);
  spheres[2].centre += Eigen::Vector3d(0.0, 80.0, 0.0);
  EXPECT_FALSE(SolvePoseGraph(world.starts, {spheres[0], spheres[1]}, 0).isDetermined[1]);
  EXPECT_TRUE(SolvePoseGraph(world.starts, spheres, 0).isDetermined[1]);

  // Information that rounding made slightly negative.
  sphere.information(5, 5) = -1e-9;
  EXPECT_TRUE(AllFinite(SolvePoseGraph(world.starts, {sphere, sphere}, 0)));
}

// What small errors add up to along many sure edges may be more than what is left of an open direction.
TEST(PoseGraph, ALongWayOfSureEdgesLeavesNoDirectionOpen)
{
  constexpr int count = 400;
  World world(count, 10);
  std::vector<PoseEdge> edges;
  for (int v = 1; v < count; ++v)
    edges.push_back(world.Exact(v - 1, v));
  edges.back().information.bottomRightCorner<3, 3>().setZero(); // as of a sphere
  const PoseGraphResult result = SolvePoseGraph(world.starts, edges, 0);
  const Information covariance = result.information[count - 2].inverse();
  EXPECT_GT(std::sqrt(covariance.topLeftCorner<3, 3>().trace()), 3.0 * PoseGraphParameters().undeterminedMm);
  EXPECT_EQ(std::count(result.isDetermined.begin(), result.isDetermined.end(), true), count - 1);
  EXPECT_FALSE(result.isDetermined[count - 1]);
}

// A sweep in rows of 32, back and forth, each view with the six that it overlaps most.
TEST(PoseGraph, FarVolumesOfManyRowsAreDetermined)
{
  ECHORAMA_SKIP_SANITIZED();
  constexpr int count = 1000, row = 32;
  std::vector<Pose> poses(count, Pose::Identity());
  for (int v = 0; v < count; ++v)
    poses[Index(v)].translation() =
        Eigen::Vector3d(15.0 * (v / row % 2 == 0 ? v % row : row - 1 - v % row), 30.0 * (v / row), 0.0);
  std::set<std::pair<int, int>> pairs;
  for (int v = 0; v < count; ++v) {
    std::vector<std::pair<double, int>> overlaps;
    for (int other = 0; other < count; ++other) {
      const Eigen::Vector3d apart = (poses[Index(other)].translation() - poses[Index(v)].translation()).cwiseAbs();
      if (other != v && apart.maxCoeff() < 64.0)
        overlaps.push_back({-(64.0 - apart[0]) * (64.0 - apart[1]), other});
    }
    std::sort(overlaps.begin(), overlaps.end());
    for (std::size_t n = 0; n < std::min<std::size_t>(6, overlaps.size()); ++n)
      pairs.insert({std::min(v, overlaps[n].second), std::max(v, overlaps[n].second)});
  }
  std::vector<PoseEdge> edges;
  for (const auto& [from, to] : pairs) {
    PoseEdge edge;
    edge.from = from;
    edge.to = to;
    edge.toInFrom = poses[Index(from)].inverse() * poses[Index(to)];
    edge.centre = 0.5 * edge.toInFrom.translation() + Eigen::Vector3d::Constant(32.0);
    edge.information.setZero();
    edge.information.diagonal() << Eigen::Vector3d::Constant(25.0), Eigen::Vector3d::Constant(25000.0);
    edges.push_back(edge);
  }
  PoseGraphParameters p;
  p.floorMm = 0.6; // 0.3 voxels of 2 mm
  p.radiusMm = 32.0;
  const PoseGraphResult result = SolvePoseGraph(poses, edges, 0, p);
  Twist scale;
  scale << 1.0, 1.0, 1.0, p.radiusMm, p.radiusMm, p.radiusMm;
  int far = 0; // beside the first volume
  for (int v = 1; v < count; ++v) {
    const Information covariance = scale.asDiagonal() * result.information[Index(v)].inverse() * scale.asDiagonal();
    far += std::sqrt(EigenOfSymmetric(covariance).values.maxCoeff()) > p.undeterminedMm;
  }
  EXPECT_NEAR(far, 281, 15);
  EXPECT_EQ(std::count(result.isDetermined.begin(), result.isDetermined.end(), true), count);
}

TEST(PoseGraph, LimitsOfTheLoss)
{
  World world(10, 11);
  world.MeasureRing();
  world.Spoil(3, 2000.0, 179.0); // as wrong as can be
  world.Spoil(13, 8.0, 0.0);     // a little
  for (const double lossSigmas : {1e-3, 2.0, 1000.0}) {
    PoseGraphParameters p;
    p.lossSigmas = lossSigmas;
    EXPECT_EQ(Named(SolvePoseGraph(world.starts, world.edges, 0, p).isWrong), (Edges{3, 13})) << lossSigmas;
  }
  // Within the gate in mm nothing is wrong, whatever the standard deviations say.
  PoseGraphParameters p;
  p.outlierMm = 10.0;
  EXPECT_EQ(Named(SolvePoseGraph(world.starts, world.edges, 0, p).isWrong), (Edges{3}));
  // Nor what claims to know little.
  world.edges[13].information *= 1e-3;
  EXPECT_EQ(Named(SolvePoseGraph(world.starts, world.edges, 0).isWrong), (Edges{3}));
}

TEST(PoseGraph, UnverifiedEdgesJoinWhereTheyAgree)
{
  World world(5, 12);
  for (int v = 0; v < 3; ++v)
    world.Measure(v, (v + 1) % 3);
  world.Measure(0, 3); // 3: right
  world.Measure(1, 3); // 4: right
  world.Measure(2, 3); // 5: wrong
  world.Measure(1, 2); // 6: wrong, against verified ones
  world.Measure(2, 4); // 7: nothing else joins 4
  world.Spoil(5);
  world.Spoil(6);
  for (std::size_t e = 3; e < world.edges.size(); ++e)
    world.edges[e].verified = false;
  const PoseGraphResult result = SolvePoseGraph(world.starts, world.edges, 0);
  EXPECT_EQ(Named(result.isWrong), (Edges{5, 6}));
  EXPECT_TRUE(Named(result.isContested).empty());
  EXPECT_EQ(Named(result.isPlaced).size(), 5u);
  EXPECT_EQ(Named(result.isDoubtful), Edges{4});
  EXPECT_EQ(Named(result.isBridge), Edges{7});
}

TEST(PoseGraph, VolumesThatNothingJoinsStay)
{
  World world(6, 13);
  world.Measure(0, 1);
  world.Measure(1, 2);
  world.Measure(0, 2);
  world.Measure(3, 4);
  world.Measure(4, 5);
  world.Measure(3, 5);
  const PoseGraphResult result = SolvePoseGraph(world.starts, world.edges, 1);
  EXPECT_EQ(Named(result.isPlaced), (Edges{0, 1, 2}));
  for (std::size_t v : {1u, 3u, 4u, 5u})
    EXPECT_EQ(result.volumeToWorld[v].matrix(), world.starts[v].matrix());
  EXPECT_TRUE(Named(result.isWrong).empty());
  EXPECT_TRUE(AllFinite(result));
  const PoseGraphResult alone = SolvePoseGraph({world.starts[0]}, {}, 0);
  EXPECT_EQ(Named(alone.isPlaced), Edges{0});
}

TEST(PoseGraph, OrderDoesNotMatter)
{
  World world(10, 14);
  world.MeasureRing();
  world.Spoil(7);
  world.Spoil(12);
  const PoseGraphResult one = SolvePoseGraph(world.starts, world.edges, 2), again = SolvePoseGraph(world.starts, world.edges, 2);
  for (std::size_t v = 0; v < 10; ++v)
    EXPECT_EQ(one.volumeToWorld[v].matrix(), again.volumeToWorld[v].matrix());

  const std::vector<int> names{3, 8, 0, 9, 5, 1, 7, 2, 6, 4}; // volume v is now called names[v]
  std::vector<Pose> starts(10);
  for (std::size_t v = 0; v < 10; ++v)
    starts[Index(names[v])] = world.starts[v];
  std::vector<PoseEdge> edges(world.edges.rbegin(), world.edges.rend());
  for (PoseEdge& edge : edges) {
    edge.from = names[Index(edge.from)];
    edge.to = names[Index(edge.to)];
  }
  const PoseGraphResult other = SolvePoseGraph(starts, edges, names[2]);
  for (std::size_t v = 0; v < 10; ++v) {
    ExpectSame(other.volumeToWorld[Index(names[v])], one.volumeToWorld[v], 1e-9);
    const Information& information = one.information[v];
    EXPECT_LE((other.information[Index(names[v])] - information).cwiseAbs().maxCoeff(), 1e-6 * information.maxCoeff());
  }
  EXPECT_EQ(Named(other.isWrong), (Edges{7, 12})); // 19 - 12 and 19 - 7
}

// Far from the origin of coordinates, as volumes in a scanner's frame are.
TEST(PoseGraph, FarFromTheOrigin)
{
  World world(10, 15);
  world.MeasureRing();
  const PoseGraphResult near = SolvePoseGraph(world.starts, world.edges, 0);
  const Pose away = MotionAbout(Eigen::Vector3d::Zero(), {0.3, 0.2, 0.1}, {1e5, -2e5, 3e5});
  std::vector<Pose> starts;
  for (const Pose& pose : world.starts)
    starts.push_back(away * pose);
  const PoseGraphResult far = SolvePoseGraph(starts, world.edges, 0);
  for (std::size_t v = 0; v < 10; ++v)
    EXPECT_LT((far.volumeToWorld[v].translation() - away * near.volumeToWorld[v].translation()).norm(), 1e-6);
}

TEST(PoseGraph, RefusesWhatIsNoGraph)
{
  World world(3, 16);
  world.Measure(0, 1);
  const auto refused = [&](const std::vector<Pose>& starts, const PoseEdge& edge, int fixed, const char* part) {
    try {
      SolvePoseGraph(starts, {edge}, fixed);
      ADD_FAILURE() << "nothing was thrown for " << part;
    } catch (const Error& error) {
      EXPECT_EQ(error.GetKind(), Error::Kind::InvalidParameter);
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  };
  const PoseEdge good = world.edges[0];
  refused(world.starts, good, 3, "fixed volume");
  refused(world.starts, good, -1, "fixed volume");
  refused({}, good, 0, "fixed volume");
  PoseEdge edge = good;
  edge.to = 3;
  refused(world.starts, edge, 0, "0-3");
  edge.to = 0;
  refused(world.starts, edge, 0, "0-0");
  edge = good;
  edge.toInFrom.linear() *= 1.1;
  refused(world.starts, edge, 0, "not a rotation");
  edge = good;
  edge.information(2, 2) = std::numeric_limits<double>::quiet_NaN();
  refused(world.starts, edge, 0, "finite");
  std::vector<Pose> starts = world.starts;
  starts[1].translation().x() = std::numeric_limits<double>::infinity();
  refused(starts, good, 0, "start pose of volume 1");

  const auto wrong = [](void (*change)(PoseGraphParameters&)) {
    PoseGraphParameters p;
    change(p);
    EXPECT_THROW(CheckRanges(p), Error);
  };
  wrong([](PoseGraphParameters& p) { p.radiusMm = 0.0; });
  wrong([](PoseGraphParameters& p) { p.floorMm = -1.0; });
  wrong([](PoseGraphParameters& p) { p.outlierMm = std::nan(""); });
  wrong([](PoseGraphParameters& p) { p.outlierSigmas = 0.0; });
  wrong([](PoseGraphParameters& p) { p.lossSigmas = 0.0; });
  wrong([](PoseGraphParameters& p) { p.undeterminedMm = 0.0; });
  wrong([](PoseGraphParameters& p) { p.trees = 0; });
}

TEST(PoseGraph, StopsWhenAsked)
{
  World world(10, 17);
  world.MeasureRing();
  try {
    SolvePoseGraph(world.starts, world.edges, 0, {}, Progress([](double fraction) { return fraction < 0.1; }));
    ADD_FAILURE() << "nothing was thrown";
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::Cancelled);
  }
}

} // namespace
} // namespace echorama
