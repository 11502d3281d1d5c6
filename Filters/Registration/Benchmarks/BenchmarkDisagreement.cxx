// SPDX-License-Identifier: BSD-3-Clause
// How far volumes are from agreeing, block by block. With truth: neighbouring views of the phantom (1 mm voxels, 55% overlap,
// turned against each other so that the speckle is partly different, different gain), where they belong and with one of them
// moved by a known way. Error: of the known part of each block's shift, the median over blocks, and how many are off by more than
// three of the deviations that are told. The same with two volumes of a liver that were made from one sweep, so that they share
// their speckle.
#include "Core/Base/Percentile.h"
#include "Filters/Registration/Benchmarks/SeenVolumes.h"
#include "Filters/Registration/Disagreement.h"
#include "Testing/Benchmark.h"
#include <filesystem>
#include <limits>

using namespace echorama;

namespace {

// The moving volume lies where it belongs, but for a known way.
void Run(const std::string& name, const SeenVolume& fixed, const SeenVolume& moving, const Eigen::Vector3d& by)
{
  Pose moved = Pose::Identity();
  moved.translation() = by;
  const std::vector<PlacedVolume> volumes{{&fixed.pyramid, Pose::Identity(), "fixed"}, {&moving.pyramid, moved, "moving"}};
  DisagreementMap map;
  const double seconds = benchmark::MedianSeconds([&] { map = Disagreement(volumes); }, 3);
  std::vector<double> errors, lengths;
  int off = 0, whole = 0;
  for (const LocalShift& each : map.shifts) {
    if (each.knownDirections == 0)
      continue;
    lengths.push_back(each.mm);
    whole += each.knownDirections == 3;
    errors.push_back((each.shift - each.known * by).norm());
    off += errors.back() > 3.0 * std::sqrt(static_cast<double>(each.knownDirections)) * each.errorMm;
  }
  const double none = std::numeric_limits<double>::quiet_NaN();
  nlohmann::ordered_json more{{"compared", map.compared}, {"known", map.known}, {"whole", whole}};
  more["median_mm"] = lengths.empty() ? none : Percentile(lengths, 0.5);
  more["p95_mm"] = lengths.empty() ? none : Percentile(lengths, 0.95);
  more["off"] = errors.empty() ? none : static_cast<double>(off) / static_cast<double>(errors.size());
  more["step_mm"] = map.stepMm;
  benchmark::Report("disagreement", name, "echorama", seconds, errors.empty() ? none : Percentile(errors, 0.5), "mm", more);
}

} // namespace

int main()
{
  const std::vector<PhantomView> views = PhantomViews(PhantomParameters().probe, 2, 0.55);
  const SeenVolume one = SeenPhantom(views[0]), two = SeenPhantom(views[1]);
  for (const Eigen::Vector3d& by : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1.2, -0.8, 0.6), Eigen::Vector3d(-2.5, 1.5, 2.0)})
    Run("phantom, moved by " + std::to_string(by.norm()).substr(0, 3) + " mm", one, two, by);
  const std::filesystem::path folder = std::filesystem::path(ECHORAMA_SOURCE_DIR) / ".." / "shared" / "data" / "liver";
  if (!std::filesystem::exists(folder / "liver_volume_A.mha")) {
    std::cerr << "skipped: there are no liver volumes in " << folder << "\n";
    return 0;
  }
  const SeenVolume a = SeenFile((folder / "liver_volume_A.mha").string()), b = SeenFile((folder / "liver_volume_B.mha").string());
  for (const double mm : {0.0, 2.0})
    Run("liver, moved by " + std::to_string(static_cast<int>(mm)) + " mm", a, b, {mm, 0, 0});
  return 0;
}
