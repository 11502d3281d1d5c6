// SPDX-License-Identifier: BSD-3-Clause
// The whole alignment of pairs, as a user gets it: no parameter is set. Error: the target registration error, the mean
// distance of points of the moving volume's valid region from where they belong, in voxels of the volumes.
//
// Pairs: two views of the phantom, 1 mm voxels, about 152 x 122 x 107, with seeds, places in the scene and gains of their own;
// starts drawn at random. And the two real liver volumes, whose truth is known. Peers: elastix (rigid, four levels, mutual
// information and NCC, masks) where it is installed, and the dissertation's search, on the same pairs from the same starts.
//
//   BenchmarkAlign [PAIRS [CASE...]]     default: 12 pairs, all cases: near, far, anywhere, liver
// ECHORAMA_CONTESTANT=elastix leaves out those whose name does not contain that; ECHORAMA_TRACE=1 tells of each pair of ours.
#include "Core/Base/Random.h"
#include "Core/Imaging/ShadowMap.h"
#include "Filters/Registration/AlignmentScore.h"
#include "Filters/Registration/AlignPair.h"
#include "Filters/Registration/AlignSearch.h"
#include "Filters/Registration/ValidPoints.h"
#include "Filters/Synthesis/Phantom.h"
#include "Filters/Synthesis/PhantomViews.h"
#include "Readers/BorderZeros.h"
#include "Readers/ImageHeader.h"
#include "Readers/VolumeFile.h"
#include "Testing/Benchmark.h"
#include "Testing/ElastixPeer.h"
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <optional>

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

// What a contestant says: where B has to be moved from its start, and whether it vouches for that.
struct Answer {
  Pose motion = Pose::Identity();
  bool aligned = true;
  double globalSeconds = 0.0;
};
using Contestant = std::function<Answer(const BenchmarkPair&, const Pose& start)>;

std::vector<PyramidLevel> ReliabilityOf(const PosedVolume<unsigned char>& volume)
{
  const Volume<float> map = ReliabilityMap(volume, FindProbe(volume));
  return BuildPyramid(PosedVolume<float>{map.View(), volume.valid, volume.geometry});
}

Answer Ours(const BenchmarkPair& pair, const Pose& start)
{
  const AlignPairParameters parameters;
  const auto pa = BuildPyramid(pair.a.Posed()), pb = BuildPyramid(pair.b.Posed(start));
  const auto ra = ReliabilityOf(pair.a.Posed()), rb = ReliabilityOf(pair.b.Posed(start));
  const PlacedVolume a{&pa, Pose::Identity(), "A", &ra}, b{&pb, Pose::Identity(), "B", &rb};
  const PairAlignment found =
      AlignPair(a, BuildMetricPyramid(a, parameters.metric), b, BuildMetricPyramid(b, parameters.metric), parameters);
  if (std::getenv("ECHORAMA_TRACE"))
    std::cerr << NameOf(found.verdict) << " error " << pair.Error(found.volumeToWorld * start) << " mm, similarity "
              << found.similarity << ", overlap " << found.overlap << ", ratio " << found.peakRatio << ", split " << found.splitMm
              << ", predicted " << found.errorMm << (found.anywhere ? ", anywhere, " : ", near, ") << found.globalSeconds << " + "
              << found.localSeconds << " + " << found.confidenceSeconds << " s; " << found.reason << "; moved by "
              << ((found.volumeToWorld * start) * pair.centre - pair.centre).transpose() << " mm, turned by "
              << LogRotation((found.volumeToWorld * start).linear()).transpose() / RadiansPerDegree << " degrees\n";
  return {found.volumeToWorld, found.verdict == Verdict::Aligned, found.globalSeconds};
}

Answer Search(const BenchmarkPair& pair, const Pose& start)
{
  const auto pa = BuildPyramid(pair.a.Posed()), pb = BuildPyramid(pair.b.Posed(start));
  try {
    return {AlignSearch({{&pa, Pose::Identity(), "A", nullptr}}, {&pb, Pose::Identity(), "B", nullptr}).volumeToWorld, true, 0.0};
  } catch (const Error&) {
    return {Pose::Identity(), false, 0.0};
  }
}

Contestant ElastixWith(const std::string& metric)
{
  return [metric](const BenchmarkPair& pair, const Pose& start) {
    const benchmark::Elastix elastix;
    const auto pose = elastix.RunRigid(pair.a.Posed(), pair.b.Posed(start), metric);
    return Answer{pose.value_or(Pose::Identity()), pose.has_value(), 0.0};
  };
}

// Of this process and of the peers that it started: what a machine shared with others does not change much.
double CpuSeconds()
{
  double seconds = 0.0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    getrusage(who, &usage);
    for (const timeval& time : {usage.ru_utime, usage.ru_stime})
      seconds += static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  }
  return seconds;
}

double Quantile(std::vector<double> numbers, double q)
{
  std::sort(numbers.begin(), numbers.end());
  return numbers[static_cast<std::size_t>(std::lround(q * static_cast<double>(numbers.size() - 1)))];
}

struct Start {
  const BenchmarkPair* pair;
  Pose pose;
};

void Compete(const std::string& name, const std::vector<Start>& starts, double withinVoxels,
             const std::vector<std::pair<std::string, Contestant>>& contestants)
{
  for (const auto& [method, contestant] : contestants) {
    std::vector<double> errors, seconds;
    int within = 0, aligned = 0, wrong = 0;
    const double begin = CpuSeconds();
    for (const Start& start : starts) {
      Answer answer;
      seconds.push_back(benchmark::Seconds([&, &contestant = contestant] { answer = contestant(*start.pair, start.pose); }));
      const double error = start.pair->Error(answer.motion * start.pose) / start.pair->b.geometry.spacing.maxCoeff();
      errors.push_back(error);
      within += error <= withinVoxels;
      aligned += answer.aligned;
      wrong += answer.aligned && error > withinVoxels;
    }
    benchmark::Report("align", name, method, Quantile(seconds, 0.5), Quantile(errors, 0.5), "voxels",
                      {{"percentile95", Quantile(errors, 0.95)},
                       {"trials", starts.size()},
                       {"within", within},
                       {"within_voxels", withinVoxels},
                       {"called_aligned", aligned},
                       {"called_aligned_but_wrong", wrong},
                       {"cpu_seconds", (CpuSeconds() - begin) / static_cast<double>(starts.size())},
                       {"slowest_seconds", Quantile(seconds, 1.0)}});
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

} // namespace

int main(int argc, char** argv)
{
  const int count = argc > 1 ? std::atoi(argv[1]) : benchmark::Trials(12);
  const std::vector<std::string> names(argv + std::min(argc, 2), argv + argc);
  const auto wanted = [&names](const char* name) {
    return names.empty() || std::find(names.begin(), names.end(), name) != names.end();
  };
  if (count < 1) {
    std::cerr << "usage: BenchmarkAlign [PAIRS [near] [far] [anywhere] [liver]]\n";
    return 2;
  }
  std::vector<std::pair<std::string, Contestant>> contestants{{"global", Ours}, {"search (dissertation)", Search}};
  if (benchmark::Elastix::IsInstalled()) {
    contestants.emplace_back("elastix, mutual information", ElastixWith("AdvancedMattesMutualInformation"));
    contestants.emplace_back("elastix, NCC", ElastixWith("AdvancedNormalizedCorrelation"));
  } else {
    std::cerr << "elastix is not installed: no rows of it\n";
  }
  if (const char* only = std::getenv("ECHORAMA_CONTESTANT"))
    contestants.erase(std::remove_if(contestants.begin(), contestants.end(),
                                     [only](const auto& one) { return one.first.find(only) == std::string::npos; }),
                      contestants.end());

  if (wanted("near")) {
    std::vector<BenchmarkPair> pairs;
    for (int i = 0; i < count; ++i)
      pairs.push_back(PhantomPair(2000 + i, 0.75));
    Compete("phantom, overlap 75%, from 10 degrees and 15 voxels", Knocked(pairs, 5, 10.0, 15.0), 1.0, contestants);
  }
  if (wanted("near") || wanted("far")) {
    std::vector<BenchmarkPair> pairs;
    for (int i = 0; i < count; ++i)
      pairs.push_back(PhantomPair(i, 0.5));
    if (wanted("near"))
      Compete("phantom, overlap 50%, from 10 degrees and 15 voxels", Knocked(pairs, 1, 10.0, 15.0), 1.0, contestants);
    if (wanted("far"))
      Compete("phantom, overlap 50%, from 20 degrees and 25 voxels", Knocked(pairs, 2, 20.0, 25.0), 1.0, contestants);
  }
  if (wanted("anywhere")) {
    std::vector<BenchmarkPair> pairs;
    for (int i = 0; i < count; ++i)
      pairs.push_back(PhantomPair(1000 + i, 0.4));
    Compete("phantom, overlap 40%, from any rotation", Anywhere(pairs, 3), 1.0, {contestants.begin(), contestants.begin() + 1});
  }
  if (wanted("liver")) {
    const std::filesystem::path folder = std::filesystem::path(ECHORAMA_SOURCE_DIR) / ".." / "shared" / "data" / "liver";
    if (!std::filesystem::exists(folder / "liver_volume_A.mha")) {
      std::cerr << "skipped: there are no liver volumes in " << folder << "\n";
      return 0;
    }
    std::vector<BenchmarkPair> liver(1);
    liver[0].a = LiverVolume((folder / "liver_volume_A.mha").string());
    liver[0].b = LiverVolume((folder / "liver_volume_B.mha").string());
    liver[0].Finish();
    Compete("liver, from 25 degrees and 40 mm", Knocked(liver, 4, 25.0, 40.0, 20), 0.5 / 0.8,
            {contestants.begin(),
             contestants.begin() + std::min<std::ptrdiff_t>(2, static_cast<std::ptrdiff_t>(contestants.size()))});
  }
  return 0;
}
