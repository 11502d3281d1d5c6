// SPDX-License-Identifier: BSD-3-Clause
// Noise in the fan of an abdominal probe, about 350 x 300 x 200 voxels: along beams (made and scan-converted), beside white and
// Perlin noise on the same grid. The error is that of the grain: how far the lengths that are measured in the result lie from
// those that were asked for, the worst of three (Perlin and white noise have none to ask for; what they have is given). The
// quotient of mean and deviation of the samples, 1.913 for speckle before compression, is given as well.
#include "Core/Imaging/ScanConversion.h"
#include "Filters/Embedding/LatticeNoise.h"
#include "Filters/Embedding/NoiseMatch.h"
#include "Testing/Benchmark.h"
#include <algorithm>
#include <cmath>
#include <utility>

namespace {

using namespace echorama;

double MeanOverDeviation(VolumeView<const float> values)
{
  double sum = 0.0, squares = 0.0;
  for (const float value : values) {
    sum += static_cast<double>(value);
    squares += static_cast<double>(value) * static_cast<double>(value);
  }
  const double mean = sum / static_cast<double>(values.Size());
  return mean / std::sqrt(squares / static_cast<double>(values.Size()) - mean * mean);
}

nlohmann::ordered_json LengthsOf(const NoiseMatch::Lengths& lengths)
{
  return {lengths.depthMm, lengths.fan, lengths.sweep};
}

} // namespace

int main()
{
  const ProbeGeometry probe = ProbeGeometry::Convex(1.15, 40.0, 0.85, 40.0, 0.0, 100.0);
  const ImageGeometry grid = ScanConversionGrid(probe, Pose::Identity(), 0.45, std::size_t{1} << 28);
  const std::string name =
      std::to_string(grid.dimensions[0]) + "x" + std::to_string(grid.dimensions[1]) + "x" + std::to_string(grid.dimensions[2]);
  Volume<float> voxels(grid.dimensions);
  Volume<unsigned char> valid(grid.dimensions);
  const auto match = [&](const Volume<float>& noise) {
    return MatchNoise<float>({noise.View(), std::as_const(valid).View(), grid}, probe, Pose::Identity());
  };

  BeamNoiseParameters p = ResolvingCounts({}, probe);
  p.intensity = NoiseIntensity::Rayleigh;
  Volume<float> beams;
  const auto make = [&] { beams = MakeBeamNoise(p, probe); };
  const auto convert = [&] {
    ScanConvert<float>(std::as_const(beams).View(), probe, Pose::Identity(), grid, voxels.View(), valid.View());
  };
  const double making = benchmark::MedianSeconds(make, 3), converting = benchmark::MedianSeconds(convert, 3);
  NoiseMatch found;
  const double matching = benchmark::MedianSeconds([&] { found = match(voxels); }, 1);
  const double error = 100.0 * std::max({std::abs(found.lengths.depthMm / p.depthCorrelationMm - 1.0),
                                         std::abs(found.lengths.fan / p.fanCorrelation - 1.0),
                                         std::abs(found.lengths.sweep / p.sweepCorrelation - 1.0)});
  benchmark::Report("noise", name, "beams", making + converting, error, "% of a length",
                    {{"seconds_beams", making},
                     {"seconds_conversion", converting},
                     {"samples", {p.samples, p.elements, p.steps}},
                     {"mean_over_deviation", MeanOverDeviation(std::as_const(beams).View())},
                     {"lengths", LengthsOf(found.lengths)}});
  benchmark::Report("noise", name, "match", matching, error, "% of a length");

  // Neighbours that are independent: nothing to filter.
  BeamNoiseParameters rough = p;
  rough.depthCorrelationMm = rough.fanCorrelation = rough.sweepCorrelation = 0.0;
  const double roughSeconds = benchmark::MedianSeconds([&] { beams = MakeBeamNoise(rough, probe); }, 3);
  benchmark::Report("noise", name, "beams, independent samples", roughSeconds + converting,
                    std::abs(MeanOverDeviation(std::as_const(beams).View()) - 1.9131), "of mean / deviation (1.913)",
                    {{"seconds_beams", roughSeconds}});

  const LatticeNoiseParameters lattice;
  Volume<float> other;
  const double white = benchmark::MedianSeconds([&] { other = MakeWhiteNoise(lattice, grid.dimensions); }, 3);
  benchmark::Report("noise", name, "white", white, std::abs(MeanOverDeviation(other.View()) - 2.0), "of mean / deviation (2)",
                    {{"lengths", LengthsOf(match(other).lengths)}});
  const double perlin = benchmark::MedianSeconds([&] { other = MakePerlinNoise(lattice, grid); }, 3);
  benchmark::Report("noise", name, "Perlin", perlin, std::abs(MeanOverDeviation(other.View()) - 2.0), "of mean / deviation (2)",
                    {{"lengths", LengthsOf(match(other).lengths)}});
  return 0;
}
