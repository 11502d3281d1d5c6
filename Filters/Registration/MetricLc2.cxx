// SPDX-License-Identifier: BSD-3-Clause
// Linear correlation of linear combinations (Wein et al. 2008; Fuerst et al. 2014), in its symmetric form for two ultrasound
// volumes: in each patch, what one volume shows is explained by a linear combination of the other's value, the magnitude of its
// gradient, and 1. What is left over, as a share of the patch's variance, is the loss. Inverted contrast and edges that show on
// one side only are explained; flat patches do not count. Here are values and gradients; patches are in MetricPoints.cxx.
#include "Core/Base/Parallel.h"
#include "Metric.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

void SeeLc2(const MetricSource& source, MetricLevel& level)
{
  SeeIntensity(source, level);
  const auto& n = level.geometry.dimensions;
  const std::ptrdiff_t strides[3] = {1, n[0], static_cast<std::ptrdiff_t>(n[0]) * n[1]};
  level.edges.assign(level.seen.size(), {});
  const SeenVoxel* seen = level.seen.data();
  const double octaveMm = std::exp2(level.octave);
  ParallelFor(n[2], [&](std::ptrdiff_t k) {
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const std::ptrdiff_t at = k * strides[2] + j * strides[1] + i;
        if (!seen[at].IsReal())
          continue;
        // Central differences, one-sided where a neighbour is not real; per voxel of the octave.
        const int index[3] = {i, j, static_cast<int>(k)};
        double squared = 0.0;
        for (int axis = 0; axis < 3; ++axis) {
          const std::ptrdiff_t back = index[axis] > 0 && seen[at - strides[axis]].IsReal() ? at - strides[axis] : at;
          const std::ptrdiff_t next = index[axis] + 1 < n[axis] && seen[at + strides[axis]].IsReal() ? at + strides[axis] : at;
          const double steps = (next != at ? 1.0 : 0.0) + (back != at ? 1.0 : 0.0);
          if (steps > 0.0) {
            const double slope =
                static_cast<double>(seen[next].Value() - seen[back].Value()) * octaveMm / (steps * level.geometry.spacing[axis]);
            squared += slope * slope;
          }
        }
        level.edges[static_cast<std::size_t>(at)] = {static_cast<float>(std::sqrt(squared)), seen[at].Weight()};
      }
  });
}

} // namespace

const Metric Lc2Metric{"lc2", 1e3, false, NoLimit, SeeLc2};

} // namespace echorama
