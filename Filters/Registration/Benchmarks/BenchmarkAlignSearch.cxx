// SPDX-License-Identifier: BSD-3-Clause
// The alignment search on two real volumes of a liver, whose true alignment is known: volume B is turned by 6 degrees about
// the centroid of its valid region and moved by 8 mm, in seeded random directions, and searched for. The error is the
// score (mean distance of points of the valid region from where they belong).
// Success against the minimum overlap t; error against seconds for different numbers of points; without repeats.
// VTK has no registration by intensities, so there is no peer in this run.
//
//   BenchmarkAlignSearch FIXED.mha MOVING.mha [t]    aligns two volumes of files, as the study asks: one line of JSON
#include "Core/Base/Random.h"
#include "Core/Imaging/ValidPoints.h"
#include "Filters/Registration/AlignmentScore.h"
#include "Filters/Registration/Benchmarks/AlignSearch.h"
#include "Readers/BorderZeros.h"
#include "Readers/ImageHeader.h"
#include "Readers/VolumeFile.h"
#include "Readers/VoxelType.h"
#include "Testing/Benchmark.h"
#include <algorithm>
#include <ctime>
#include <filesystem>
#include <limits>

using namespace echorama;

namespace {

constexpr double RadiansPerDegree = 0.017453292519943295;

struct LiverVolume {
  explicit LiverVolume(const std::string& path)
  {
    const ImageHeader header = ReadImageHeader(path);
    CheckVolume(header);
    geometry = header.geometry;
    voxels = Volume<unsigned char>(geometry.dimensions);
    valid = Volume<unsigned char>(geometry.dimensions);
    ReadVoxels(header, voxels.View().Data());
    ValidFromBorderZeros<unsigned char>(voxels.View(), valid.View());
  }
  PosedVolume<unsigned char> Posed() const { return {voxels.View(), valid.View(), geometry}; }

  ImageGeometry geometry;
  Volume<unsigned char> voxels, valid;
};

// A volume of a file; what is real of it, its companion says.
std::vector<PyramidLevel> PyramidOf(const std::string& path)
{
  const ImageHeader header = ReadImageHeader(path);
  CheckVolume(header);
  Volume<float> voxels(header.geometry.dimensions);
  Volume<unsigned char> valid(header.geometry.dimensions, 1);
  DispatchVoxelType(header.type, [&](auto type) {
    Volume<decltype(type)> read(header.geometry.dimensions);
    ReadVoxels(header, read.View().Data());
    std::transform(read.View().begin(), read.View().end(), voxels.View().begin(), [](auto v) { return static_cast<float>(v); });
  });
  const std::string mask = CompanionPath(path, "ValidRegion");
  if (std::filesystem::exists(mask))
    ReadVoxels(ReadImageHeader(mask), valid.View().Data());
  return BuildPyramid(PosedVolume<float>{voxels.View(), valid.View(), header.geometry});
}

int AlignFiles(int count, char** words)
{
  try {
    AlignSearchParameters p;
    if (count > 3)
      p.minimumOverlap = std::stod(words[3]);
    AlignSearchResult found;
    const double seconds = benchmark::Seconds([&] {
      const auto fixed = PyramidOf(words[1]), moving = PyramidOf(words[2]);
      found = AlignSearch({{&fixed, Pose::Identity(), words[1]}}, {&moving, Pose::Identity(), words[2]}, p);
    });
    auto rows = nlohmann::ordered_json::array();
    for (int r = 0; r < 4; ++r) {
      const Eigen::RowVector4d row = found.volumeToWorld.matrix().row(r);
      rows.push_back(std::vector<double>(row.data(), row.data() + 4));
    }
    std::cout << nlohmann::ordered_json{{"VolumeToWorld", rows}, {"overlap", found.overlap}, {"seconds", seconds}}.dump() << "\n";
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
  return 0;
}

double Median(std::vector<double> numbers)
{
  std::sort(numbers.begin(), numbers.end());
  const std::size_t half = numbers.size() / 2;
  return numbers.size() % 2 ? numbers[half] : 0.5 * (numbers[half - 1] + numbers[half]);
}

class Trials {
public:
  Trials(const LiverVolume& a, const LiverVolume& b) : a_(a), b_(b)
  {
    std::ptrdiff_t count = 0;
    centre_ = b.geometry.IndexToWorld() * ValidCentroid<unsigned char>(b.voxels.View(), b.valid.View(), count);
    points_ = ValidPoints<unsigned char>(b.voxels.View(), b.valid.View(), 5000, 1);
  }

  void Run(const std::string& method, const AlignSearchParameters& p, int trials, bool isOverT = false) const
  {
    trials = benchmark::Trials(trials);
    std::vector<double> scores, seconds;
    const std::clock_t started = std::clock();
    int within = 0, refused = 0;
    double largest = 0.0;
    for (int trial = 0; trial < trials; ++trial) {
      Random random(2026, static_cast<std::uint64_t>(trial));
      const Eigen::Vector3d axis = random.Direction(), way = random.Direction();
      const Pose start = MotionAbout(centre_, 6.0 * RadiansPerDegree * axis, 8.0 * way);
      double score = std::numeric_limits<double>::infinity();
      seconds.push_back(benchmark::Seconds([&] {
        try {
          const auto pa = BuildPyramid(a_.Posed()), pb = BuildPyramid(b_.Posed());
          const Pose found = AlignSearch({{&pa, Pose::Identity(), "A"}}, {&pb, start, "B"}, p).volumeToWorld;
          score = ScoreAlignment({{a_.geometry, a_.geometry, {Eigen::Vector3d::Zero()}, "A"},
                                  {b_.geometry.Moved(found), b_.geometry, points_, "B"}})
                      .mean;
        } catch (const Error&) {
          ++refused;
        }
      }));
      within += score <= 1.0;
      if (score < std::numeric_limits<double>::infinity()) {
        largest = std::max(largest, score);
        scores.push_back(score);
      }
    }
    nlohmann::ordered_json more{{"points", p.points}, {"repeats", p.repeats}, {"trials", trials}};
    more["within_1mm"] = within;
    more["refused"] = refused;
    more["cpu_seconds"] = static_cast<double>(std::clock() - started) / CLOCKS_PER_SEC / trials; // of both cores, per trial
    if (isOverT)
      more["t"] = p.minimumOverlap;
    more["largest"] = scores.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(largest);
    benchmark::Report("align_search", isOverT ? "liver, minimum overlap" : "liver, 8 mm and 6 degrees", method, Median(seconds),
                      scores.empty() ? std::numeric_limits<double>::infinity() : Median(scores), "mm", more);
  }

private:
  const LiverVolume &a_, &b_;
  Eigen::Vector3d centre_;
  std::vector<Eigen::Vector3d> points_; // of B's valid region, for the score
};

} // namespace

int main(int argc, char** argv)
{
  if (argc > 2)
    return AlignFiles(argc, argv);
  const std::filesystem::path folder = std::filesystem::path(ECHORAMA_SOURCE_DIR) / ".." / "shared" / "data" / "liver";
  if (!std::filesystem::exists(folder / "liver_volume_A.mha")) {
    std::cerr << "skipped: there are no liver volumes in " << folder << "\n";
    return 0;
  }
  const LiverVolume a((folder / "liver_volume_A.mha").string()), b((folder / "liver_volume_B.mha").string());
  const Trials trials(a, b);
  const AlignSearchParameters defaults;
  trials.Run("search", defaults, 20);
  for (const double t : {0.1, 0.2, 0.3, 0.4, 0.5}) {
    AlignSearchParameters p;
    p.minimumOverlap = t;
    trials.Run("search", p, 10, true);
  }
  for (const int points : {1000, 3000, 10000, 40000}) {
    AlignSearchParameters p;
    p.points = points;
    trials.Run("search, " + std::to_string(points) + " points", p, 10);
  }
  AlignSearchParameters once;
  once.repeats = 0;
  trials.Run("search without repeats", once, 10);
  return 0;
}
