// SPDX-License-Identifier: BSD-3-Clause
// A tracked sweep of a liver (140 frames of 739 x 593 pixels) into the grid of a volume that others made of it (321 x 254 x 199
// voxels of 0.8 mm: nearest voxel, mean, frames in between, single holes filled). Frames per second and the difference from that
// volume, of each way to reconstruct, beside the straightforward loop: one thread, every pixel of every frame into its nearest
// voxel in doubles. All use the same sector. "seconds" is the median; "cpu_seconds" adds up all threads, and says more on a
// machine that others use too. Then the latency of single frames, live, and filling holes alone.
#include "Core/Base/Parallel.h"
#include "Filters/Reconstruction/FrameSector.h"
#include "Filters/Reconstruction/HoleFilling.h"
#include "Filters/Reconstruction/VolumeReconstruction.h"
#include "Readers/ImageHeader.h"
#include "Readers/SequenceFile.h"
#include "Readers/VolumeFile.h"
#include "Testing/Benchmark.h"
#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <functional>
#include <string>

using namespace echorama;

namespace {

using Byte = unsigned char;

struct Sweep {
  std::vector<Volume<Byte>> frames;
  std::vector<Eigen::Affine3d> poses;
  Volume<Byte> sector;
  ImageGeometry grid;
  Volume<Byte> reference;
};

struct Result {
  explicit Result(const ImageGeometry& grid) : intensity(grid.dimensions), valid(grid.dimensions), coverage(grid.dimensions) {}
  ReconstructionOutput<Byte> Output() { return {intensity.View(), valid.View(), coverage.View()}; }
  Volume<Byte> intensity, valid;
  Volume<unsigned short> coverage;
};

Sweep Load(const std::filesystem::path& folder)
{
  Sweep sweep;
  SequenceFile file((folder / "liver_sweep.igs.mha").string());
  FrameSector found;
  for (int k = 0; k < file.Content().frames; ++k) {
    sweep.frames.emplace_back(file.Content().dimensions);
    file.ReadFrame(k, sweep.frames.back().View().Data());
    sweep.poses.push_back(file.Frame(k).Find("ImageToReference")->matrix);
    found.Add<Byte>(sweep.frames.back().View());
  }
  sweep.sector = FitSector(found.Detect(), 0.315, 0.315).mask;
  const ImageHeader header = ReadImageHeader((folder / "liver_volume_full.mha").string());
  CheckVolume(header);
  sweep.grid = header.geometry;
  sweep.reference = Volume<Byte>(sweep.grid.dimensions);
  ReadVoxels(header, sweep.reference.View().Data());
  return sweep;
}

// What anyone would write first.
void Straightforward(const Sweep& sweep, Result& result)
{
  Volume<double> sum(sweep.grid.dimensions);
  Volume<int> count(sweep.grid.dimensions);
  const auto& n = sweep.grid.dimensions;
  for (std::size_t k = 0; k < sweep.frames.size(); ++k) {
    const Eigen::Affine3d map = sweep.grid.WorldToIndex() * sweep.poses[k];
    const auto pixels = sweep.frames[k].View();
    for (int y = 0; y < pixels.Dimensions()[1]; ++y)
      for (int x = 0; x < pixels.Dimensions()[0]; ++x) {
        if (!sweep.sector.View()(x, y, 0))
          continue;
        const Eigen::Vector3d at = map * Eigen::Vector3d(x, y, 0.0);
        const int i = static_cast<int>(std::floor(at[0] + 0.5)), j = static_cast<int>(std::floor(at[1] + 0.5)),
                  l = static_cast<int>(std::floor(at[2] + 0.5));
        if (i < 0 || j < 0 || l < 0 || i >= n[0] || j >= n[1] || l >= n[2])
          continue;
        sum.View()(i, j, l) += pixels(x, y, 0);
        ++count.View()(i, j, l);
      }
  }
  for (std::ptrdiff_t at = 0; at < sum.View().Size(); ++at) {
    const int times = count.View()[at];
    result.intensity.View()[at] = times ? static_cast<Byte>(sum.View()[at] / times + 0.5) : 0;
    result.valid.View()[at] = times > 0;
    result.coverage.View()[at] = static_cast<unsigned short>(std::min(times, 65535));
  }
}

struct Latency {
  std::vector<double> seconds;   // of each frame, in ascending order
  double processorSeconds = 0.0; // of a frame, the mean
};

Latency Reconstruct(const Sweep& sweep, const ReconstructionParameters& parameters, Result& result, bool fill)
{
  VolumeReconstruction<Byte> reconstruction(parameters, sweep.grid, result.Output());
  Latency latency;
  const std::clock_t start = std::clock();
  for (std::size_t k = 0; k < sweep.frames.size(); ++k)
    latency.seconds.push_back(benchmark::Seconds([&] {
      reconstruction.Add({sweep.frames[k].View(), sweep.sector.View(), sweep.poses[k]});
    }));
  latency.processorSeconds =
      static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC / static_cast<double>(sweep.frames.size());
  if (fill)
    FillHoles<Byte>({}, result.intensity.View(), result.valid.View(), result.coverage.View());
  std::sort(latency.seconds.begin(), latency.seconds.end());
  return latency;
}

void ReportErrors(const Sweep& sweep, const std::string& method, double seconds, double processor, const Result& result)
{
  double sum = 0.0;
  std::ptrdiff_t both = 0, within = 0, there = 0;
  for (std::ptrdiff_t at = 0; at < sweep.reference.View().Size(); ++at) {
    if (sweep.reference.View()[at] == 0) // the reference has no data there
      continue;
    ++there;
    if (!result.valid.View()[at])
      continue;
    const int error = std::abs(static_cast<int>(result.intensity.View()[at]) - sweep.reference.View()[at]);
    ++both;
    sum += error;
    within += error <= 12;
  }
  benchmark::Report("reconstruct", "liver sweep", method, seconds, sum / static_cast<double>(both),
                    "mean absolute difference, grey levels",
                    {{"cpu_seconds", processor},
                     {"frames_per_second", static_cast<double>(sweep.frames.size()) / seconds},
                     {"within_12", static_cast<double>(within) / static_cast<double>(both)},
                     {"reference_covered", static_cast<double>(both) / static_cast<double>(there)}});
}

double ProcessorSeconds(const std::function<void()>& work)
{
  const std::clock_t start = std::clock();
  work();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

} // namespace

int main()
{
  const std::filesystem::path folder = std::filesystem::path(ECHORAMA_SOURCE_DIR) / "../shared/data/liver";
  if (!std::filesystem::exists(folder / "liver_sweep.igs.mha")) {
    std::cerr << "no liver sweep beside the project: nothing to measure\n";
    return 0;
  }
  const Sweep sweep = Load(folder);
  Result result(sweep.grid);
  struct Way {
    const char* name;
    SplatMethod splat;
    BetweenFrames between;
    bool fill;
  };
  for (const Way& way : {Way{"nearest, frames alone", SplatMethod::Nearest, BetweenFrames::Nothing, false},
                         Way{"linear, frames alone", SplatMethod::Linear, BetweenFrames::Nothing, false},
                         Way{"nearest, forward, holes filled", SplatMethod::Nearest, BetweenFrames::Forward, true},
                         Way{"linear, forward, holes filled", SplatMethod::Linear, BetweenFrames::Forward, true},
                         Way{"nearest, backward, holes filled", SplatMethod::Nearest, BetweenFrames::Backward, true},
                         Way{"linear, backward, holes filled", SplatMethod::Linear, BetweenFrames::Backward, true}}) {
    ReconstructionParameters parameters;
    parameters.splat = way.splat;
    parameters.between = way.between;
    const bool first = way.splat == SplatMethod::Nearest && way.between == BetweenFrames::Nothing;
    Latency latency;
    const auto ours = [&] { latency = Reconstruct(sweep, parameters, result, way.fill); };
    double seconds;
    if (first) {
      Result theirs(sweep.grid);
      const auto loop = [&] { Straightforward(sweep, theirs); };
      const auto [own, other] = benchmark::Duel(ours, loop, 3);
      ReportErrors(sweep, "straightforward loop", other, ProcessorSeconds(loop), theirs);
      seconds = own;
    } else {
      seconds = benchmark::MedianSeconds(ours, 3);
    }
    const double processor = ProcessorSeconds(ours);
    ReportErrors(sweep, way.name, seconds, processor, result);
    const std::vector<double>& each = latency.seconds;
    benchmark::ReportTime(
        "reconstruct", "one live frame", way.name, each[each.size() / 2],
        {{"cpu_seconds", latency.processorSeconds}, {"slowest_of_20", each[each.size() * 19 / 20]}, {"slowest", each.back()}});
  }
  for (const auto& [method, name] : {std::pair{HoleFilling::Mean, "mean"}, std::pair{HoleFilling::Stick, "stick"}}) {
    ReconstructionParameters parameters;
    parameters.between = BetweenFrames::Nothing;
    Reconstruct(sweep, parameters, result, false);
    std::size_t filled = 0;
    const HoleFillingParameters holes{method, 3};
    const auto fill = [&] {
      filled = FillHoles<Byte>(holes, result.intensity.View(), result.valid.View(), result.coverage.View());
    };
    const double seconds = benchmark::MedianSeconds(fill, 3);
    ReportErrors(sweep, std::string("frames alone, then holes up to 3 voxels: ") + name, seconds, ProcessorSeconds(fill), result);
  }
  return 0;
}
