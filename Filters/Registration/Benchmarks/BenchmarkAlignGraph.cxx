// SPDX-License-Identifier: BSD-3-Clause
// Many volumes at once. Ten views of one invented tissue, from a probe that slides around a ring on its surface: each overlaps
// the next two on either side, the last ones the first. Every volume but the first starts 8 mm and 6 degrees off. Two pairs
// are made wrong by 20 mm and 15 degrees, and stay wrong when they are asked again. Errors are scores (mean distance of points
// of the valid region from where they belong), in voxels.
//
// Peers: the dissertation's search, one volume after the other; a spanning tree of the same pairs; least squares of the same
// pairs without a vote. Then the pose graph alone, on rings of 10, 100 and 1000 measured poses of which one in twenty is wrong.
//
//   BenchmarkAlignGraph [graph|volumes|both [START]]     default: both, tracked
#include "Core/Base/Random.h"
#include "Core/Imaging/ValidPoints.h"
#include "Filters/Phantoms/Phantom.h"
#include "Filters/Phantoms/PhantomViews.h"
#include "Filters/Registration/AlignmentScore.h"
#include "Filters/Registration/AlignVolumes.h"
#include "Filters/Registration/Benchmarks/AlignInTurn.h"
#include "Filters/Registration/PoseGraph.h"
#include "Testing/Benchmark.h"
#include <algorithm>
#include <cmath>
#include <ctime>
#include <tuple>

using namespace echorama;

namespace {

constexpr double RadiansPerDegree = 0.017453292519943295;
constexpr int Views = 10;
constexpr double SpacingMm = 1.5;
constexpr double RadiusMm = 45.0; // of the ring: neighbours overlap by some 70%, the next but one by some 35%
const std::vector<std::pair<int, int>> WrongPairs{{2, 4}, {6, 7}};

std::size_t Index(int number)
{
  return static_cast<std::size_t>(number);
}

// Of all threads: what is left to go by on a machine that others use too.
template <class Function>
double CpuSeconds(const Function& function)
{
  const std::clock_t start = std::clock();
  function();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

// Bodies of all sizes, everywhere below the surface that the probe slides on.
PhantomScene WideScene()
{
  PhantomScene scene;
  Random random(41);
  const auto place = [&random] {
    const double x = random.Uniform(-160.0, 160.0), y = random.Uniform(-150.0, 150.0), z = random.Uniform(8.0, 105.0);
    return Eigen::Vector3d(x, y, z);
  };
  for (int i = 0; i < 130; ++i) {
    Ellipsoid body;
    body.centre = place();
    body.radii = Eigen::Vector3d(random.Uniform(4.0, 20.0), random.Uniform(4.0, 16.0), random.Uniform(4.0, 14.0));
    body.rotation = random.Direction() * random.Uniform(0.0, 1.5);
    const double kind = random.Uniform();
    const double db = kind < 0.2 ? Inclusion::anechoicDb : kind < 0.6 ? random.Uniform(-10.0, -4.0) : random.Uniform(4.0, 14.0);
    scene.inclusions.push_back({"body " + std::to_string(i), body, db, kind < 0.4 ? 1.3 : 0.0, 9.0, 0.0});
  }
  for (int i = 0; i < 24; ++i) {
    Tube vessel;
    vessel.path.push_back(place());
    Eigen::Vector3d way = random.Direction() * 25.0;
    for (int step = 0; step < 5; ++step) {
      vessel.path.push_back(vessel.path.back() + way);
      way = 25.0 * (way / 25.0 + 0.5 * random.Direction()).normalized();
    }
    vessel.radius = random.Uniform(2.5, 6.0);
    scene.inclusions.push_back({"vessel " + std::to_string(i), vessel, Inclusion::anechoicDb, i % 2 == 0 ? 1.2 : 0.0, 10.0, 0.0});
  }
  return scene;
}

// The volumes of the ring, and how far an answer is from the truth.
class Ring {
public:
  Ring()
  {
    PhantomParameters parameters;
    parameters.scene = WideScene();
    parameters.spacingMm = SpacingMm;
    const double gains[] = {0.0, 2.5, -1.5};
    for (int v = 0; v < Views; ++v) {
      // Around the ring, tilted outwards a little and turned in its own plane as it goes.
      const double angle = 6.283185307179586 * v / Views;
      Pose pose = Pose::Identity();
      pose.linear() = ExpRotation(0.12 * Eigen::Vector3d(-std::sin(angle), std::cos(angle), 0.0)) *
                      ExpRotation({0.0, 0.0, 0.35 * std::sin(angle)});
      pose.translation() = Eigen::Vector3d(RadiusMm * std::cos(angle), RadiusMm * std::sin(angle), 0.0);
      parameters.probeToWorld = pose;
      parameters.gainDb = gains[v % 3];
      geometries.push_back(PhantomGeometry(parameters));
      Volume<unsigned char> voxels(geometries.back().dimensions), valid(geometries.back().dimensions);
      MakePhantom(parameters, voxels.View(), valid.View());
      pyramids.push_back(BuildPyramid<unsigned char>({voxels.View(), valid.View(), geometries.back()}));
      points.push_back(ValidPoints<unsigned char>(voxels.View(), valid.View(), 2000, 1));
      std::ptrdiff_t real = 0;
      centres.push_back(geometries.back().IndexToWorld() * ValidCentroid<unsigned char>(voxels.View(), valid.View(), real));
      starts.push_back(v == 0 ? Pose::Identity() : KnockedPose(2026, Index(v), 8.0, 6.0, centres.back()));
    }
  }

  std::vector<PlacedVolume> Volumes() const
  {
    std::vector<PlacedVolume> volumes;
    for (std::size_t v = 0; v < Index(Views); ++v)
      volumes.push_back({&pyramids[v], starts[v], "volume " + std::to_string(v)});
    return volumes;
  }

  AlignmentScore Score(const std::vector<Pose>& poses) const
  {
    std::vector<ScoredVolume> scored;
    for (std::size_t v = 0; v < Index(Views); ++v)
      scored.push_back({geometries[v].Moved(poses[v]), geometries[v], points[v], "volume " + std::to_string(v)});
    return ScoreAlignment(scored);
  }

  /// How far volume b is from where it belongs beside volume a, voxels.
  double PairError(int a, int b, const Pose& poseOfB, const Pose& poseOfA) const
  {
    return ScoreAlignment({{geometries[Index(a)].Moved(poseOfA), geometries[Index(a)], points[Index(a)], "a"},
                           {geometries[Index(b)].Moved(poseOfB), geometries[Index(b)], points[Index(b)], "b"}})
               .mean /
           SpacingMm;
  }

  std::vector<ImageGeometry> geometries; // where they belong
  std::vector<std::vector<PyramidLevel>> pyramids;
  std::vector<std::vector<Eigen::Vector3d>> points;
  std::vector<Eigen::Vector3d> centres;
  std::vector<Pose> starts; // motions from there
};

bool IsWrong(int a, int b)
{
  return std::find(WrongPairs.begin(), WrongPairs.end(), std::make_pair(std::min(a, b), std::max(a, b))) != WrongPairs.end();
}

void ReportPoses(const Ring& ring, const std::string& testCase, const std::string& method, const std::vector<Pose>& poses,
                 double seconds, nlohmann::ordered_json more = nlohmann::ordered_json::object())
{
  const AlignmentScore score = ring.Score(poses);
  double worst = 0.0;
  for (const VolumeScore& volume : score.volumes)
    worst = std::max(worst, volume.mean / SpacingMm);
  nlohmann::ordered_json line{{"worst_volume", worst},
                              {"first_to_last", ring.PairError(0, Views - 1, poses[Views - 1], poses[0])}};
  line.update(more);
  benchmark::Report("align_graph", testCase, method, seconds, score.mean / SpacingMm, "voxel", line);
}

PoseEdge EdgeOf(const PairOfVolumes& pair, const AlignVolumesResult& result)
{
  const Pose back = result.volumes[Index(pair.fixed)].volumeToWorld.inverse(Eigen::Isometry);
  PoseEdge edge;
  edge.from = pair.fixed;
  edge.to = pair.moving;
  edge.toInFrom = back * pair.alignment.volumeToWorld;
  edge.centre = back * pair.alignment.centre;
  Information turn = Information::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = back.linear();
  edge.information = turn * pair.alignment.information * turn.transpose();
  return edge;
}

void BenchmarkVolumes(const AlignVolumesParameters& parameters)
{
  const Ring ring;
  const auto volumes = ring.Volumes();
  ReportPoses(ring, "ten volumes", "start", ring.starts, 0.0);

  const auto number = [](const PlacedVolume& volume) { return std::stoi(volume.name.substr(7)); };
  // Wrong pairs are right ones that are moved afterwards, so that their verdicts and information are what they would be.
  const PairAligner planted = [&](const PlacedVolume& fixed, const std::shared_ptr<const MetricPyramid>& fixedFeatures,
                                  const PlacedVolume& moving, const std::shared_ptr<const MetricPyramid>& movingFeatures,
                                  const AlignPairParameters& p, const Progress& progress) {
    PairAlignment answer = AlignPair(fixed, fixedFeatures, moving, movingFeatures, p, progress);
    const int a = number(fixed), b = number(moving);
    if (IsWrong(a, b))
      answer.volumeToWorld = KnockedPose(7, Index(10 * a + b), 20.0, 15.0, answer.centre) * answer.volumeToWorld;
    return answer;
  };

  for (const bool isPlanted : {false, true}) {
    const std::string testCase = isPlanted ? "ten volumes, two wrong pairs" : "ten volumes";
    AlignVolumesResult result;
    double cpuSeconds = 0.0;
    const double seconds = benchmark::Seconds([&] {
      cpuSeconds =
          CpuSeconds([&] { result = AlignVolumes(volumes, 0, parameters, {}, isPlanted ? planted : PairAligner(AlignPair)); });
    });
    std::vector<Pose> poses;
    int aligned = 0;
    for (const VolumeAlignment& volume : result.volumes) {
      poses.push_back(volume.volumeToWorld);
      aligned += volume.verdict == Verdict::Aligned;
    }
    int named = 0, others = 0, standing = 0, tries = 0;
    double worstPair = 0.0;
    std::vector<PoseEdge> edges, chain;
    for (const PairOfVolumes& pair : result.pairs) {
      const bool isWrong = isPlanted && IsWrong(pair.fixed, pair.moving);
      named += isWrong && pair.votedDown;
      others += !isWrong && pair.votedDown;
      standing += pair.stands;
      tries += pair.attempts;
      if (pair.alignment.verdict == Verdict::Failed)
        continue;
      if (!isWrong)
        worstPair = std::max(worstPair, ring.PairError(pair.fixed, pair.moving, pair.alignment.volumeToWorld,
                                                       result.volumes[Index(pair.fixed)].volumeToWorld));
      edges.push_back(EdgeOf(pair, result));
      if (pair.moving == pair.fixed + 1)
        chain.push_back(edges.back());
    }
    ReportPoses(ring, testCase, "AlignVolumes", poses, seconds,
                {{"cpu_seconds", cpuSeconds},
                 {"volumes_aligned", aligned},
                 {"pairs", result.pairs.size()},
                 {"pairs_aligned_again", tries - static_cast<int>(result.pairs.size())},
                 {"pairs_standing", standing},
                 {"wrong_named", named},
                 {"right_named", others},
                 {"worst_right_pair", worstPair},
                 {"consistency", result.consistency},
                 {"pair_seconds", result.pairSeconds},
                 {"graph_seconds", result.graphSeconds}});

    PoseGraphParameters p;
    p.floorMm = 0.3 * SpacingMm;
    PoseGraphResult graph;
    double graphSeconds = benchmark::Seconds([&] { graph = SolvePoseGraph(ring.starts, chain, 0, p); });
    const double predicted = std::sqrt((graph.information[Views - 1].inverse()).topLeftCorner<3, 3>().trace()) / SpacingMm;
    ReportPoses(ring, testCase, "chain of neighbours", graph.volumeToWorld, graphSeconds,
                {{"placed", std::count(graph.isPlaced.begin(), graph.isPlaced.end(), true)},
                 {"last_predicted", std::isfinite(predicted) ? predicted : -1.0}});
    p.outlierMm = 1000.0;
    p.lossSigmas = 1000.0;
    p.trees = 1;
    graphSeconds = benchmark::Seconds([&] { graph = SolvePoseGraph(ring.starts, edges, 0, p); });
    ReportPoses(ring, testCase, "least squares, no vote", graph.volumeToWorld, graphSeconds);
  }

  std::vector<Pose> poses;
  const double seconds = benchmark::Seconds([&] {
    AlignSearchParameters p;
    p.minimumOverlap = 0.3;
    try {
      for (const AlignSearchResult& result : AlignInTurn(volumes, 0, p))
        poses.push_back(result.volumeToWorld);
    } catch (const Error& error) {
      std::cerr << "AlignInTurn: " << error.what() << "\n";
      poses.clear();
    }
  });
  if (!poses.empty())
    ReportPoses(ring, "ten volumes", "dissertation's search, in turn", poses, seconds);
}

// Rings in which each pose is measured from the three before it: 0.1 mm and 0.1 degrees of noise, one edge in twenty wrong.
void BenchmarkGraph(int count)
{
  Random random(11, Index(count));
  const auto normal = [&random](double sigma) -> Eigen::Vector3d {
    const double x = random.Normal(), y = random.Normal(), z = random.Normal();
    return sigma * Eigen::Vector3d(x, y, z);
  };
  std::vector<Pose> truth;
  for (int v = 0; v < count; ++v) {
    const double angle = 6.283185307179586 * v / count;
    truth.push_back(MotionAbout(Eigen::Vector3d::Zero(), random.Direction() * random.Uniform(0.0, 3.0),
                                Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0) * (7.0 * count)));
  }
  std::vector<PoseEdge> edges;
  int wrong = 0;
  std::vector<bool> isWrong;
  for (int step = 1; step <= 3; ++step)
    for (int v = 0; v < count; ++v) {
      PoseEdge edge;
      edge.from = v;
      edge.to = (v + step) % count;
      edge.toInFrom = truth[Index(edge.from)].inverse() * truth[Index(edge.to)];
      edge.centre = 0.5 * edge.toInFrom.translation();
      const double sigma = 0.1 * RadiansPerDegree;
      edge.information.setZero();
      edge.information.diagonal() << Eigen::Vector3d::Constant(100.0), Eigen::Vector3d::Constant(1.0 / (sigma * sigma));
      edge.toInFrom = MotionAbout(edge.centre, normal(sigma), normal(0.1)) * edge.toInFrom;
      isWrong.push_back(random.Below(20) == 0);
      if (isWrong.back()) {
        edge.toInFrom = MotionAbout(edge.centre, 0.26 * random.Direction(), 20.0 * random.Direction()) * edge.toInFrom;
        ++wrong;
      }
      edges.push_back(edge);
    }
  std::vector<Pose> start(truth.size(), Pose::Identity());
  start[0] = truth[0];
  const auto error = [&](const PoseGraphResult& result) {
    double sum = 0.0;
    for (std::size_t v = 0; v < truth.size(); ++v)
      sum += (result.volumeToWorld[v].translation() - truth[v].translation()).norm();
    return sum / static_cast<double>(count - 1);
  };
  PoseGraphParameters p, plain;
  p.floorMm = plain.floorMm = 0.0;
  plain.outlierMm = plain.lossSigmas = 1000.0;
  plain.trees = 1;
  PoseGraphResult voted, squares;
  const auto vote = [&] { voted = SolvePoseGraph(start, edges, 0, p); };
  const auto fit = [&] { squares = SolvePoseGraph(start, edges, 0, plain); };
  double ours = 0.0, theirs = 0.0;
  if (count > 500) {
    ours = benchmark::Seconds(vote);
    theirs = benchmark::Seconds(fit);
  } else {
    std::tie(ours, theirs) = benchmark::Duel(vote, fit);
  }
  const double oursCpu = CpuSeconds(vote), theirsCpu = CpuSeconds(fit);
  int named = 0, others = 0;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    named += isWrong[e] && voted.isWrong[e];
    others += !isWrong[e] && voted.isWrong[e];
  }
  const std::string testCase = "graph of " + std::to_string(count);
  benchmark::Report(
      "align_graph", testCase, "SolvePoseGraph", ours, error(voted), "mm",
      {{"cpu_seconds", oursCpu}, {"edges", edges.size()}, {"wrong", wrong}, {"wrong_named", named}, {"right_named", others}});
  benchmark::Report("align_graph", testCase, "least squares, no vote", theirs, error(squares), "mm",
                    {{"cpu_seconds", theirsCpu}});
}

} // namespace

int main(int argc, char** argv)
{
  const std::string which = argc > 1 ? argv[1] : "";
  if (which != "volumes")
    for (const int count : {10, 100, 1000})
      BenchmarkGraph(count);
  if (which != "graph") {
    AlignVolumesParameters parameters;
    parameters.pair.soundSpeedError = 0.0; // the phantom's is what its probe takes it for
    ParameterList list = Describe(parameters);
    Named(list, "Start").Set(argc > 2 ? argv[2] : "tracked");
    BenchmarkVolumes(parameters);
  }
  return 0;
}
