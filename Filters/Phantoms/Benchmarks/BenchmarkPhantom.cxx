// SPDX-License-Identifier: BSD-3-Clause
// How long a volume takes, and how far its speckle is from fully developed: the signal-to-noise ratio of the envelope in
// uniform tissue is 1.9131 for a Rayleigh distribution.
#include "Core/Base/Parallel.h"
#include "Filters/Phantoms/Phantom.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <ctime>

using namespace echorama;

namespace {

// |SNR - 1.9131| over samples four steps apart, which are nearly independent.
double SpeckleError(PhantomParameters p)
{
  p.scene = UniformScene();
  const BeamEchoes echoes = SimulateEchoes(p);
  const auto baseband = echoes.baseband.View();
  const auto& n = baseband.Dimensions();
  double sum = 0.0, squares = 0.0, count = 0.0;
  for (int k = 2; k < n[2] - 2; k += 4)
    for (int j = 2; j < n[1] - 2; j += 4)
      for (int i = 4; i < n[0] - 4; i += 4) {
        const double envelope = std::abs(baseband(i, j, k));
        sum += envelope;
        squares += envelope * envelope;
        count += 1.0;
      }
  const double mean = sum / count;
  return std::abs(mean / std::sqrt(squares / count - mean * mean) - 1.9131);
}

void Measure(const std::string& name, const PhantomParameters& p, int threads)
{
  const ThreadLimit limit(threads);
  const ImageGeometry geometry = PhantomGeometry(p);
  Volume<unsigned char> intensity(geometry.dimensions), valid(geometry.dimensions);
  const std::clock_t before = std::clock();
  const double seconds = benchmark::MedianSeconds([&] { MakePhantom(p, intensity.View(), valid.View()); }, 3);
  const double cpuSeconds = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC / 4; // three runs and a warm-up
  const auto& n = geometry.dimensions;
  benchmark::Report("phantom", name, "lattice scatterers", seconds, SpeckleError(p), "|speckle SNR - 1.91|",
                    {{"cpu_seconds", cpuSeconds}, {"threads", threads}, {"dimensions", {n[0], n[1], n[2]}}});
}

} // namespace

int main()
{
  PhantomParameters p;
  Measure("default, 2 million voxels", p, 2);
  Measure("default, 2 million voxels", p, 1);
  PhantomParameters fine = p;
  fine.spacingMm = 0.6;
  Measure("0.6 mm, 9 million voxels", fine, 2);
  PhantomParameters dense = p;
  dense.scatterersPerMm3 = 6.0;
  Measure("four times the scatterers", dense, 2);
}
