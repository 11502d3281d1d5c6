// SPDX-License-Identifier: BSD-3-Clause
// The minimum cut through the overlap of two volumes: from coarse to fine, as it is for large overlaps, beside the exact cut of
// all voxels at once (Boykov and Kolmogorov's, of Boost, under both; one thread). The volumes are noise, smoothed so often with
// a mean of 3^3, and their overlap is a cube. The error is what the seam costs more than the exact one, counted face by face as
// SeamCut.h defines it, as a share of that.
#include "Core/Base/Random.h"
#include "Filters/Stitching/Benchmarks/SeamCut.h"
#include "Testing/Benchmark.h"
#include <algorithm>
#include <cmath>

using namespace echorama;

namespace {

// A box of noise with unit deviation before it is smoothed.
CoarseVolume Noise(const GridBox& box, int smoothed, std::uint64_t seed)
{
  Random random(seed);
  Volume<float> values(box.size);
  for (float& value : values.View())
    value = static_cast<float>(random.Normal());
  for (int time = 0; time < smoothed; ++time)
    for (const std::array<int, 3>& step : {std::array{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}) {
      const Volume<float> before = values;
      const auto at = [&](int i, int j, int k) {
        return before.View()(std::clamp(i, 0, box.size[0] - 1), std::clamp(j, 0, box.size[1] - 1),
                             std::clamp(k, 0, box.size[2] - 1));
      };
      for (int k = 0; k < box.size[2]; ++k)
        for (int j = 0; j < box.size[1]; ++j)
          for (int i = 0; i < box.size[0]; ++i)
            values.View()(i, j, k) =
                (at(i - step[0], j - step[1], k - step[2]) + at(i, j, k) + at(i + step[0], j + step[1], k + step[2])) / 3;
    }
  CoarseVolume volume;
  volume.inside = {box, Volume<unsigned char>(box.size, 1)};
  volume.value = {box, std::move(values)};
  volume.low = volume.value;
  return volume;
}

// What the seam costs in the overlap, where both volumes are.
double Cost(const std::vector<CoarseVolume>& volumes, const GridBox& overlap, const Volume<unsigned short>& labels,
            const SeamParameters& parameters)
{
  const auto difference = [&](int i, int j, int k) {
    const auto value = [&](const CoarseVolume& volume) {
      return static_cast<double>(volume.value.Row(j, k)[i - volume.value.box.first[0]]);
    };
    return std::abs(value(volumes[0]) - value(volumes[1]));
  };
  std::vector<double> all;
  for (int k = 0; k < overlap.size[2]; ++k)
    for (int j = 0; j < overlap.size[1]; ++j)
      for (int i = 0; i < overlap.size[0]; ++i)
        all.push_back(difference(overlap.first[0] + i, overlap.first[1] + j, overlap.first[2] + k));
  std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2), all.end());
  const double unit = all[all.size() / 2];

  double cost = 0.0;
  for (int k = 0; k < overlap.size[2]; ++k)
    for (int j = 0; j < overlap.size[1]; ++j)
      for (int i = 0; i < overlap.size[0]; ++i)
        for (int axis = 0; axis < 3; ++axis) {
          const std::array<int, 3> p{overlap.first[0] + i, overlap.first[1] + j, overlap.first[2] + k};
          std::array<int, 3> q = p;
          if (++q[axis] >= overlap.first[axis] + overlap.size[axis] ||
              labels.View()(p[0], p[1], p[2]) == labels.View()(q[0], q[1], q[2]))
            continue;
          cost += parameters.length;
          for (const auto& x : {p, q})
            cost += std::min(difference(x[0], x[1], x[2]) / unit, parameters.ceiling);
        }
  return cost;
}

void Measure(int side, int smoothed, bool exact)
{
  const int alone = side / 3; // how far each volume is alone on its side
  const std::array<int, 3> n{side + 2 * alone, side, side};
  const std::vector<CoarseVolume> volumes{Noise({{0, 0, 0}, {side + alone, side, side}}, smoothed, 1),
                                          Noise({{alone, 0, 0}, {side + alone, side, side}}, smoothed, 2)};
  const GridBox overlap{{alone, 0, 0}, {side, side, side}};
  const std::string name = std::to_string(side) + "^3, smoothed " + std::to_string(smoothed) + " times";
  SeamParameters fine, whole;
  whole.atOnce = side * side * side;
  Volume<unsigned short> labels, best;
  const auto quickly = [&] { labels = CutSeams(volumes, n, fine); };
  if (!exact) {
    benchmark::ReportTime("seam_cut", name, "coarse to fine", benchmark::MedianSeconds(quickly, 3));
    return;
  }
  const auto [seconds, exactSeconds] = benchmark::Duel(
      quickly, [&] { best = CutSeams(volumes, n, whole); }, 3);
  const double cost = Cost(volumes, overlap, best, whole);
  benchmark::Report("seam_cut", name, "coarse to fine", seconds, Cost(volumes, overlap, labels, fine) / cost - 1.0,
                    "of the cost of the exact seam");
  benchmark::ReportTime("seam_cut", name, "at once", exactSeconds, {{"cost", cost}});
}

} // namespace

int main()
{
  if (benchmark::Smoke()) {
    Measure(24, 1, true);
    return 0;
  }
  for (const int smoothed : {0, 1, 3})
    Measure(32, smoothed, true);
  Measure(48, 3, true);
  Measure(100, 1, false);
}
