// SPDX-License-Identifier: BSD-3-Clause
// The local alignment, metric by metric, on pairs with truth: neighbouring views of the phantom (1 mm voxels, 55% overlap,
// turned against each other so that the speckle is partly different, different gain), and two real volumes of a liver. The moving
// volume is turned about its centroid and moved, in seeded random directions, and sought from there. Error: mean distance
// of points of its valid region from where they belong, the median over trials. Peer: the search of the dissertation.
// Arguments: metrics to run (default: all); --trials N.
#include "Core/Base/Random.h"
#include "Core/Imaging/ValidPoints.h"
#include "Filters/Registration/Benchmarks/AlignSearch.h"
#include "Filters/Registration/Benchmarks/SeenVolumes.h"
#include "Filters/Registration/LocalAlign.h"
#include "Testing/Benchmark.h"
#include <algorithm>
#include <filesystem>
#include <limits>

using namespace echorama;

namespace {

struct Seen : SeenVolume {
  Eigen::Vector3d centre;
  std::vector<Eigen::Vector3d> points; // of the valid region, in the world

  explicit Seen(SeenVolume volume) : SeenVolume(std::move(volume))
  {
    std::ptrdiff_t count = 0;
    const Eigen::Affine3d toWorld = geometry.IndexToWorld();
    centre = toWorld * ValidCentroid<unsigned char>(voxels.View(), valid.View(), count);
    points = ValidPoints<unsigned char>(voxels.View(), valid.View(), 2000, 1);
    for (auto& p : points)
      p = toWorld * p;
  }
  double Error(const Pose& found) const
  {
    double sum = 0.0;
    for (const auto& p : points)
      sum += (found * p - p).norm();
    return sum / static_cast<double>(points.size());
  }
};

double Quantile(std::vector<double> numbers, double q)
{
  std::sort(numbers.begin(), numbers.end());
  return numbers[std::min(numbers.size() - 1, static_cast<std::size_t>(q * static_cast<double>(numbers.size())))];
}

struct Start {
  double degrees, voxels;
};

using Pairs = std::vector<std::pair<const Seen*, const Seen*>>;

// Aligns all pairs from all starts with find(pair, start pose) and writes a row. voxelMm: what errors are given in.
template <class Find>
void Run(const std::string& name, const std::string& method, const Pairs& pairs, const Start& start, int trials, double voxelMm,
         double featureSeconds, const Find& find)
{
  std::vector<double> errors, seconds, similarities;
  int success = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const std::size_t pair = static_cast<std::size_t>(trial) % pairs.size();
    const Seen& moving = *pairs[pair].second;
    const Pose pose = KnockedPose(2026, static_cast<std::uint64_t>(trial), start.voxels * voxelMm, start.degrees, moving.centre);
    double error = std::numeric_limits<double>::infinity();
    seconds.push_back(benchmark::Seconds([&] {
      try {
        error = moving.Error(find(pair, pose)) / voxelMm;
      } catch (const Error&) {
      }
    }));
    errors.push_back(error);
    success += error <= 1.0;
  }
  nlohmann::ordered_json more{{"trials", trials}, {"success", success}, {"p95", Quantile(errors, 0.95)}};
  more["pyramids_seconds"] = featureSeconds;
  benchmark::Report("local_align", name, method, Quantile(seconds, 0.5), Quantile(errors, 0.5), "voxel", more);
}

void RunAll(const std::string& name, const Pairs& pairs, const std::vector<std::string>& metrics,
            const std::vector<Start>& starts, int trials, double voxelMm, bool isPeer)
{
  for (const std::string& metric : metrics) {
    std::vector<std::pair<std::shared_ptr<const MetricPyramid>, std::shared_ptr<const MetricPyramid>>> features;
    const double building = benchmark::Seconds([&] {
      for (const auto& [fixed, moving] : pairs)
        features.emplace_back(BuildMetricPyramid({&fixed->pyramid, Pose::Identity(), "fixed"}, metric),
                              BuildMetricPyramid({&moving->pyramid, Pose::Identity(), "moving"}, metric));
    });
    for (const Start& start : starts)
      Run(name + ", " + std::to_string(static_cast<int>(start.degrees)) + " degrees, " +
              std::to_string(static_cast<int>(start.voxels)) + " voxels",
          metric, pairs, start, trials, voxelMm, building / static_cast<double>(pairs.size()),
          [&](std::size_t pair, const Pose& pose) {
            return LocalAlign(*features[pair].first, Pose::Identity(), *features[pair].second, pose).volumeToWorld;
          });
  }
  if (isPeer)
    for (const Start& start : starts)
      Run(name + ", " + std::to_string(static_cast<int>(start.degrees)) + " degrees, " +
              std::to_string(static_cast<int>(start.voxels)) + " voxels",
          "dissertation's search", pairs, start, trials, voxelMm, 0.0, [&](std::size_t pair, const Pose& pose) {
            return AlignSearch({{&pairs[pair].first->pyramid, Pose::Identity(), "fixed"}},
                               {&pairs[pair].second->pyramid, pose, "moving"})
                .volumeToWorld;
          });
}

} // namespace

int main(int argc, char** argv)
{
  std::vector<std::string> metrics;
  int trials = benchmark::Trials(20);
  for (int i = 1; i < argc; ++i)
    if (std::string(argv[i]) == "--trials" && i + 1 < argc)
      trials = std::stoi(argv[++i]);
    else
      metrics.emplace_back(argv[i]);
  const bool isAll = metrics.empty();
  if (isAll)
    metrics = MetricNames();

  const std::vector<PhantomView> views = PhantomViews(PhantomParameters().probe, 3, 0.55);
  const std::vector<Seen> phantom{Seen(SeenPhantom(views[0])), Seen(SeenPhantom(views[1])), Seen(SeenPhantom(views[2]))};
  RunAll("phantom", {{&phantom[0], &phantom[1]}, {&phantom[1], &phantom[2]}}, metrics, {{5, 5}, {10, 15}, {15, 20}}, trials, 1.0,
         isAll);

  const std::filesystem::path folder = std::filesystem::path(ECHORAMA_SOURCE_DIR) / ".." / "shared" / "data" / "liver";
  if (!std::filesystem::exists(folder / "liver_volume_A.mha")) {
    std::cerr << "skipped: there are no liver volumes in " << folder << "\n";
    return 0;
  }
  const Seen a(SeenFile((folder / "liver_volume_A.mha").string())), b(SeenFile((folder / "liver_volume_B.mha").string()));
  RunAll("liver", {{&a, &b}}, metrics, {{6, 10}, {10, 15}}, std::max(trials / 2, 1), a.geometry.spacing.x(), isAll);
  return 0;
}
