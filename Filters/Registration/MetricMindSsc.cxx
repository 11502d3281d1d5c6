// SPDX-License-Identifier: BSD-3-Clause
// MIND-SSC (Heinrich et al., MICCAI 2013): the self-similarity context. Around each voxel the patches at the six neighbours at
// distance two (of the octave) are compared with each other; the twelve pairs of neighbours that do not lie opposite give twelve
// distances, and the descriptor is exp(-distance / mean distance), scaled so that the largest is 1. It tells the shape of
// what is there, whatever its brightness, sign or gain.
//
// A distance is the smoothed square of the difference of two shifted images: twelve Gaussians over the volume. Descriptors
// are kept as bytes: 16 per voxel with the weight; the error of 1/510 is far below the noise. Because of their size the
// levels of more than 2^22 voxels are left out.
#include "Core/Base/Parallel.h"
#include "Metric.h"
#include "MetricBlock.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace echorama {
namespace {

void SeeMindSsc(const MetricSource& source, MetricLevel& level)
{
  // What the border leaves of the window of a distance lies to one side, and so does what it tells: that pushes borders apart.
  // Voxels count by how much is left of the most cut of their windows, from nothing to all between the last two; at the finest
  // level only, where the answer is made: coarse ones would be left without their wide borders.
  constexpr float LeastKnown = 0.02f, Cut = 0.6f, Whole = 0.95f;
  const auto& n = level.geometry.dimensions;
  const std::ptrdiff_t count = source.intensity.Size();
  const double octaveMm = std::exp2(level.octave);
  std::array<std::array<int, 3>, 6> neighbours{};
  for (int axis = 0; axis < 3; ++axis) {
    const int reach = std::max(1, static_cast<int>(std::lround(2.0 * octaveMm / level.geometry.spacing[axis])));
    neighbours[static_cast<std::size_t>(2 * axis)][static_cast<std::size_t>(axis)] = -reach;
    neighbours[static_cast<std::size_t>(2 * axis + 1)][static_cast<std::size_t>(axis)] = reach;
  }
  const Eigen::Vector3d sigma = (1.0 * octaveMm / level.geometry.spacing.array()).matrix();

  level.descriptors.assign(static_cast<std::size_t>(ChannelStride * count), 0);
  Volume<float> distances(n), weights(n), mean(n), least(n, 1e30f), left(n, 1.0f);
  std::vector<Volume<float>> channels;
  for (std::size_t a = 0; a < 6; ++a)
    for (std::size_t b = a + 1; b < 6; ++b) {
      if (a / 2 == b / 2)
        continue; // opposite
      const auto d = distances.View(), w = weights.View();
      ParallelFor(n[2], [&](std::ptrdiff_t slice) {
        const int k = static_cast<int>(slice);
        const auto value = [&](int i, int j, const std::array<int, 3>& by) {
          const int x = i + by[0], y = j + by[1], z = k + by[2];
          return x >= 0 && y >= 0 && z >= 0 && x < n[0] && y < n[1] && z < n[2] ? source.intensity(x, y, z)
                                                                                : std::numeric_limits<float>::quiet_NaN();
        };
        for (int j = 0; j < n[1]; ++j)
          for (int i = 0; i < n[0]; ++i) {
            const float difference = value(i, j, neighbours[a]) - value(i, j, neighbours[b]);
            const bool real = difference == difference;
            d(i, j, k) = real ? difference * difference : 0.0f;
            w(i, j, k) = real ? 1.0f : 0.0f;
          }
      });
      GaussianSum(d, sigma);
      GaussianSum(w, sigma);
      channels.emplace_back(n);
      const auto out = channels.back().View(), m = mean.View(), l = least.View(), of = left.View();
      ParallelRanges(count, 1 << 16, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
        for (std::ptrdiff_t i = begin; i < end; ++i) {
          const float distance = w[i] > LeastKnown ? d[i] / w[i] : -1.0f; // negative: not known
          out[i] = distance;
          of[i] = std::fmin(of[i], w[i]);
          if (distance >= 0.0f) {
            m[i] += distance * (1.0f / Channels);
            l[i] = std::fmin(l[i], distance);
          }
        }
      });
    }

  // The mean distance sets the scale; it is kept within a factor of its mean over the volume, so that flat regions are flat.
  const auto m = mean.View(), l = least.View();
  struct Sum {
    double value = 0.0, count = 0.0;
    void operator+=(const Sum& s)
    {
      value += s.value;
      count += s.count;
    }
  };
  const Sum all = ParallelSum<Sum>(count, 1 << 16, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    Sum s;
    for (std::ptrdiff_t i = begin; i < end; ++i)
      if (source.intensity[i] == source.intensity[i])
        s += {static_cast<double>(m[i]), 1.0};
    return s;
  });
  const float typical = static_cast<float>(all.count > 0.0 ? all.value / all.count : 1.0);
  ParallelRanges(count, 1 << 14, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; ++i) {
      const bool real = source.intensity[i] == source.intensity[i];
      unsigned char* out = &level.descriptors[static_cast<std::size_t>(ChannelStride * i)];
      const float variance = std::fmin(std::fmax(m[i], 0.05f * typical), 20.0f * typical) + 1e-20f;
      for (std::size_t c = 0; c < Channels; ++c) {
        const float distance = channels[c].View()[i];
        const float similar = distance >= 0.0f ? std::exp(-(distance - l[i]) / variance) : 0.5f;
        out[c] = static_cast<unsigned char>(std::lround(255.0f * similar));
      }
      const float texture = m[i] / (m[i] + 0.1f * typical + 1e-20f);
      const float share = left.View()[i];
      const float whole = source.isFinest ? std::fmin(std::fmax((share - Cut) / (Whole - Cut), 0.0f), 1.0f) : 1.0f;
      const float weight = std::fmax(0.01f, texture) * whole * whole * static_cast<float>(source.Trust(i));
      const bool isSeen = real && share > LeastKnown && source.Trust(i) > 0.0;
      out[Channels] = static_cast<unsigned char>(isSeen ? std::lround(std::fmax(1.0f, 255.0f * weight)) : 0); // 0: not there
    }
  });
}

} // namespace

const Metric MindSscMetric{"mind-ssc", 0.3, false, 1 << 22, SeeMindSsc};

} // namespace echorama
