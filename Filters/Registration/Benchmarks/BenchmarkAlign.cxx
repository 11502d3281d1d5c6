// SPDX-License-Identifier: BSD-3-Clause
// The whole alignment of pairs, as a user gets it, beside elastix where it is installed. Error: the target registration error,
// the mean distance of points of the moving volume's valid region from where they belong, in voxels of the volumes.
//
// Trials: two views of the phantom, 1 mm voxels, about 152 x 122 x 107, with seeds, places in the scene and gains of their own,
// one start at random for each pair; and the two real liver volumes, whose truth is known, from starts at random. All contestants
// get the same volumes, valid regions and starts, and all their trials count: one without an answer (no_answer) leaves the
// volumes where they were, and has the error of its start. On the lines of elastix, wins and losses are the trials in which it
// ends nearer to the truth than ours, and farther from it.
//
// Each stops as it does by itself. Ours has a test of convergence and no parameter is set. elastix has none: it runs a number of
// iterations on each of its levels. Mutual information, the metric that its manual advises, is shown with two numbers, 250 as in
// the rigid parameter file of its authors and 1000, which that file advises for robustness; normalised correlation with 250. All
// else is in Testing/elastix-rigid.txt. Ours takes volumes in memory, and its time is that of everything from there on (pyramids,
// features, verdict); that of elastix is its program's, which starts, and reads uncompressed files that were just written. Both
// use as many threads as they take by themselves. Seconds and CPU seconds (of all threads) are medians.
//
//   BenchmarkAlign [TRIALS [CASE...]]     default: 8 of each case: near far liver; and on request: anywhere
#include "Core/Base/Random.h"
#include "Core/Imaging/ValidPoints.h"
#include "Core/Sharing/SideBySide.h"
#include "Filters/Phantoms/Phantom.h"
#include "Filters/Phantoms/PhantomViews.h"
#include "Filters/Registration/AlignmentScore.h"
#include "Filters/Registration/AlignPair.h"
#include "Filters/Registration/PreparedVolume.h"
#include "Readers/BorderZeros.h"
#include "Readers/ImageHeader.h"
#include "Readers/VolumeFile.h"
#include "Testing/Benchmark.h"
#include "Testing/ElastixPeer.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>

using namespace echorama;

namespace {

constexpr double RadiansPerDegree = 0.017453292519943295;

struct Seen {
  ImageGeometry geometry; // where it belongs
  Volume<unsigned char> voxels, valid;
  PosedVolume<unsigned char> Posed(const Pose& pose = Pose::Identity()) const
  {
    return {voxels.View(), valid.View(), geometry.Moved(pose)};
  }
};

// A pair with the points of B that speak for it.
struct BenchmarkPair {
  Seen a, b;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> points; // world

  void Finish()
  {
    std::ptrdiff_t count = 0;
    centre = b.geometry.IndexToWorld() * ValidCentroid<unsigned char>(b.voxels.View(), b.valid.View(), count);
    for (const Eigen::Vector3d& p : ValidPoints<unsigned char>(b.voxels.View(), b.valid.View(), 2000, 1))
      points.push_back(b.geometry.IndexToWorld() * p);
  }
  // mm, when B is where it belongs but for this motion
  double Error(const Pose& motion) const
  {
    double sum = 0.0;
    for (const Eigen::Vector3d& p : points)
      sum += (motion * p - p).norm();
    return sum / static_cast<double>(points.size());
  }
};

BenchmarkPair PhantomPair(int number, double overlap)
{
  BenchmarkPair pair;
  Random random(77, static_cast<std::uint64_t>(number));
  PhantomParameters parameters;
  const auto views = PhantomViews(parameters.probe, 2, overlap);
  const Pose place = MotionAbout({0.0, 0.0, 50.0}, 15.0 * RadiansPerDegree * random.Uniform() * random.Direction(),
                                 15.0 * random.Uniform() * random.Direction());
  for (int i = 0; i < 2; ++i) {
    Seen& seen = i == 0 ? pair.a : pair.b;
    parameters.seed = static_cast<std::uint64_t>(100 + number);
    parameters.probeToWorld = place * views[static_cast<std::size_t>(i)].probeToWorld;
    parameters.gainDb = random.Uniform(-3.0, 3.0);
    seen.geometry = PhantomGeometry(parameters);
    seen.voxels = Volume<unsigned char>(seen.geometry.dimensions);
    seen.valid = Volume<unsigned char>(seen.geometry.dimensions);
    MakePhantom(parameters, seen.voxels.View(), seen.valid.View());
  }
  pair.Finish();
  return pair;
}

Seen LiverVolume(const std::string& path)
{
  const ImageHeader header = ReadImageHeader(path);
  CheckVolume(header);
  Seen seen{header.geometry, Volume<unsigned char>(header.geometry.dimensions),
            Volume<unsigned char>(header.geometry.dimensions)};
  ReadVoxels(header, seen.voxels.View().Data());
  ValidFromBorderZeros<unsigned char>(seen.voxels.View(), seen.valid.View());
  return seen;
}

// What a contestant says: where B has to be moved from its start, whether it vouches for that, and what it took.
struct Answer {
  std::optional<Pose> motion;
  bool aligned = false;
  double seconds = 0.0, cpuSeconds = 0.0;
};
using Contestant = std::function<Answer(const BenchmarkPair&, const Pose& start)>;

Answer Ours(const BenchmarkPair& pair, const Pose& start)
{
  PairAlignment found;
  const double before = benchmark::CpuSeconds();
  const double seconds = benchmark::Seconds([&] {
    const AlignPairParameters parameters;
    std::array<PreparedVolume, 2> prepared;
    std::array<PlacedVolume, 2> placed;
    std::array<std::shared_ptr<const MetricPyramid>, 2> features;
    SideBySide(2, {}, [&](std::ptrdiff_t i, const Progress&) { // as AlignVolumes does
      const auto v = static_cast<std::size_t>(i);
      prepared[v] = PrepareVolume(v == 0 ? pair.a.Posed() : pair.b.Posed(start), true);
      placed[v] = {&prepared[v].pyramid, Pose::Identity(), v == 0 ? "A" : "B", &prepared[v].reliability};
      features[v] = BuildMetricPyramid(placed[v], parameters.metric);
    });
    found = AlignPair(placed[0], features[0], placed[1], features[1], parameters);
  });
  return {found.volumeToWorld, found.verdict == Verdict::Aligned, seconds, benchmark::CpuSeconds() - before};
}

Contestant ElastixWith(const std::string& metric, int iterations)
{
  return [metric, iterations](const BenchmarkPair& pair, const Pose& start) {
    benchmark::Elastix elastix(pair.a.Posed(), pair.b.Posed(start));
    Answer answer;
    answer.motion = elastix.RunRigid(metric, iterations);
    answer.seconds = elastix.Seconds();
    answer.cpuSeconds = elastix.CpuSeconds();
    return answer;
  };
}

std::vector<std::pair<std::string, Contestant>> Contestants()
{
  std::vector<std::pair<std::string, Contestant>> contestants{{"echorama", Ours}};
  if (!benchmark::Elastix::IsInstalled()) {
    std::cerr << "elastix is not installed: no rows of it\n";
    return contestants;
  }
  contestants.emplace_back("elastix_mi_250", ElastixWith("AdvancedMattesMutualInformation", 250));
  contestants.emplace_back("elastix_mi_1000", ElastixWith("AdvancedMattesMutualInformation", 1000));
  contestants.emplace_back("elastix_ncc_250", ElastixWith("AdvancedNormalizedCorrelation", 250));
  return contestants;
}

double Quantile(std::vector<double> numbers, double q)
{
  std::sort(numbers.begin(), numbers.end());
  const double at = q * static_cast<double>(numbers.size() - 1);
  const std::size_t below = static_cast<std::size_t>(at), above = std::min(below + 1, numbers.size() - 1);
  return numbers[below] + (at - static_cast<double>(below)) * (numbers[above] - numbers[below]);
}

struct Start {
  const BenchmarkPair* pair;
  Pose pose;
};

// In each trial all take their turn, so that what else the machine does meets all alike.
void Compete(const std::string& name, const std::vector<Start>& starts)
{
  struct Tally {
    std::vector<double> errors, seconds, cpuSeconds;
    int within = 0, noAnswer = 0, aligned = 0, wrong = 0;
  };
  const auto contestants = Contestants();
  std::map<std::string, Tally> tallies;
  for (const Start& start : starts)
    for (const auto& [method, contestant] : contestants) {
      const Answer answer = contestant(*start.pair, start.pose);
      const double error =
          start.pair->Error(answer.motion.value_or(Pose::Identity()) * start.pose) / start.pair->b.geometry.spacing.maxCoeff();
      Tally& tally = tallies[method];
      tally.errors.push_back(error);
      tally.seconds.push_back(answer.seconds);
      tally.cpuSeconds.push_back(answer.cpuSeconds);
      tally.within += error < 1.0;
      tally.noAnswer += !answer.motion;
      tally.aligned += answer.aligned;
      tally.wrong += answer.aligned && error >= 1.0;
    }
  const Tally& ours = tallies["echorama"];
  for (const auto& [method, contestant] : contestants) {
    const Tally& tally = tallies[method];
    nlohmann::ordered_json more{{"trials", starts.size()},
                                {"within_voxel", tally.within},
                                {"no_answer", tally.noAnswer},
                                {"largest", Quantile(tally.errors, 1.0)},
                                {"cpu_seconds", Quantile(tally.cpuSeconds, 0.5)}};
    if (&tally == &ours) {
      more["called_aligned"] = tally.aligned;
      more["called_aligned_but_wrong"] = tally.wrong;
    } else {
      int wins = 0, losses = 0;
      for (std::size_t i = 0; i < starts.size(); ++i) {
        wins += tally.errors[i] < ours.errors[i];
        losses += tally.errors[i] > ours.errors[i];
      }
      more["wins"] = wins;
      more["losses"] = losses;
    }
    benchmark::Report("align", name, method, Quantile(tally.seconds, 0.5), Quantile(tally.errors, 0.5), "voxels", more);
  }
}

// Starts off by exactly so much in random directions.
std::vector<Start> Knocked(const std::vector<BenchmarkPair>& pairs, std::uint64_t seed, double degrees, double mm, int each = 1)
{
  std::vector<Start> starts;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    for (int k = 0; k < each; ++k)
      starts.push_back({&pairs[i], KnockedPose(seed, i * 100 + static_cast<std::size_t>(k), mm, degrees, pairs[i].centre)});
  return starts;
}

// Starts turned by rotations uniform over all.
std::vector<Start> Anywhere(const std::vector<BenchmarkPair>& pairs, std::uint64_t seed)
{
  std::vector<Start> starts;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    Random random(seed, i);
    Eigen::Quaterniond q(random.Normal(), random.Normal(), random.Normal(), random.Normal());
    q.normalize();
    starts.push_back({&pairs[i], MotionAbout(pairs[i].centre, LogRotation(q.toRotationMatrix()), 60.0 * random.Direction())});
  }
  return starts;
}

std::vector<BenchmarkPair> PhantomPairs(int count, int firstNumber, double overlap)
{
  std::vector<BenchmarkPair> pairs;
  for (int i = 0; i < count; ++i)
    pairs.push_back(PhantomPair(firstNumber + i, overlap));
  return pairs;
}

} // namespace

int main(int argc, char** argv)
{
  const int count = argc > 1 ? std::atoi(argv[1]) : benchmark::Trials(8);
  std::vector<std::string> cases(argv + std::min(argc, 2), argv + argc);
  if (cases.empty())
    cases = {"near", "far", "liver"};
  if (count < 1) {
    std::cerr << "usage: BenchmarkAlign [TRIALS [near] [far] [liver] [anywhere]]\n";
    return 2;
  }
  const auto wanted = [&cases](const char* name) { return std::find(cases.begin(), cases.end(), name) != cases.end(); };

  if (wanted("near")) {
    const auto pairs = PhantomPairs(count, 2000, 0.75);
    Compete("phantom, overlap 75%, from 10 degrees and 15 voxels", Knocked(pairs, 5, 10.0, 15.0));
  }
  if (wanted("far")) {
    const auto pairs = PhantomPairs(count, 0, 0.5);
    Compete("phantom, overlap 50%, from 20 degrees and 25 voxels", Knocked(pairs, 2, 20.0, 25.0));
  }
  if (wanted("liver")) {
    const std::filesystem::path folder = std::filesystem::path(ECHORAMA_SOURCE_DIR) / ".." / "shared" / "data" / "liver";
    if (std::filesystem::exists(folder / "liver_volume_A.mha")) {
      std::vector<BenchmarkPair> liver(1);
      liver[0].a = LiverVolume((folder / "liver_volume_A.mha").string());
      liver[0].b = LiverVolume((folder / "liver_volume_B.mha").string());
      liver[0].Finish();
      Compete("liver, from 6 degrees and 8 mm", Knocked(liver, 6, 6.0, 8.0, count));
      Compete("liver, from 25 degrees and 40 mm", Knocked(liver, 4, 25.0, 40.0, count));
    } else {
      std::cerr << "skipped: there are no liver volumes in " << folder << "\n";
    }
  }
  if (wanted("anywhere")) {
    const auto pairs = PhantomPairs(count, 1000, 0.4);
    Compete("phantom, overlap 40%, from any rotation", Anywhere(pairs, 3));
  }
  return 0;
}
