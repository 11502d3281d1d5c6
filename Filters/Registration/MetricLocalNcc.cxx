// SPDX-License-Identifier: BSD-3-Clause
// Local normalised cross-correlation as a difference of images: each voxel less the mean around it, over the deviation around
// it. For two images so normalised the mean of (a - b)^2 / 2 is 1 - NCC, averaged over windows: what costs a sum over a window
// per point and pose elsewhere is done once per volume here, and the rest is a least squares problem. Gain, offset and
// what attenuation leaves of them along the depth fall out.
//
// Means and deviations are Gaussian and count real voxels alone, by how far they can be trusted. A floor under the deviation
// keeps fluid and saturated tissue from being amplified to noise; there the weight is low as well.
#include "Core/Base/Parallel.h"
#include "Metric.h"
#include <cmath>

namespace echorama {
namespace {

constexpr double WindowVoxels = 2.0; // standard deviation of the window, in voxels of the octave
constexpr double SmoothVoxels = 0.6; // of what is compared
// A window that the border cuts has a mean of its own: a pattern that moves with the volume and pulls the borders of both onto
// each other. Voxels count by how much of their window is real, from nothing to all between these two.
constexpr float CutWindow = 0.6f, WholeWindow = 0.95f;
constexpr double FloorShare = 0.6; // of the level's own standard deviation: the floor under the local one

void SeeLocalNcc(const MetricSource& source, MetricLevel& level)
{
  const auto& n = level.geometry.dimensions;
  const std::ptrdiff_t count = source.intensity.Size();
  const double octaveMm = std::exp2(level.octave);
  const Eigen::Vector3d window = (WindowVoxels * octaveMm / level.geometry.spacing.array()).matrix();
  const Eigen::Vector3d smooth = (SmoothVoxels * octaveMm / level.geometry.spacing.array()).matrix();

  const MeanAndDeviation global = MeanAndDeviationOf(source);
  const float mean = static_cast<float>(global.mean);
  Volume<float> weights(n), sums(n), squares(n);
  const auto w = weights.View(), s = sums.View(), q = squares.View();
  ParallelRanges(count, 1 << 16, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; ++i) {
      const float v = source.intensity[i];
      if (!(v == v))
        continue;
      const float trust = std::fmax(0.01f, static_cast<float>(source.Trust(i))), d = v - mean;
      w[i] = trust;
      s[i] = trust * d;
      q[i] = trust * d * d;
    }
  });
  Volume<float> fineWeights = weights, fineSums = sums;
  const auto fw = fineWeights.View(), fs = fineSums.View();
  GaussianSum(w, window);
  GaussianSum(s, window);
  GaussianSum(q, window);
  GaussianSum(fw, smooth);
  GaussianSum(fs, smooth);

  level.seen.assign(static_cast<std::size_t>(2 * count), 0.0f);
  const float floor = static_cast<float>(FloorShare * FloorShare * global.deviation * global.deviation) + 1e-30f;
  ParallelRanges(count, 1 << 16, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; ++i) {
      if (!(source.intensity[i] == source.intensity[i]))
        continue;
      const float m = s[i] / w[i], variance = std::fmax(0.0f, q[i] / w[i] - m * m);
      const float texture = variance / (variance + floor);
      const float whole = std::fmin(1.0f, std::fmax(0.0f, (w[i] - CutWindow) / (WholeWindow - CutWindow))), full = whole * whole;
      level.seen[static_cast<std::size_t>(2 * i)] = (fs[i] / fw[i] - m) / std::sqrt(variance + floor);
      level.seen[static_cast<std::size_t>(2 * i + 1)] = static_cast<float>(source.Trust(i)) * std::fmax(1e-3f, texture * full);
    }
  });
}

} // namespace

const Metric LocalNccMetric{"local-ncc", 0.25, false, NoLimit, SeeLocalNcc};

} // namespace echorama
