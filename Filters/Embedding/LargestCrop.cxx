// SPDX-License-Identifier: BSD-3-Clause
//
// The largest box of allowed cells: for every first layer, layers are added one after the other, and the cells that are allowed
// in all of them are a mask in the plane. The rectangles of a mask that cannot grow are those that a stack of rising bars yields,
// row by row; their weights are read from a table of running sums. A box of the greatest weight cannot grow (weights are
// positive), so that it is among them.
#include "LargestCrop.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace echorama {

namespace {

using Size = std::size_t;

// Sums over boxes that begin at the first cell, with a border of zeros.
class RunningSums {
public:
  explicit RunningSums(VolumeView<const float> weights) : n_(weights.Dimensions())
  {
    sums_.assign(static_cast<Size>(n_[0] + 1) * static_cast<Size>(n_[1] + 1) * static_cast<Size>(n_[2] + 1), 0.0);
    for (int k = 0; k < n_[2]; ++k)
      for (int j = 0; j < n_[1]; ++j) {
        double row = 0.0;
        for (int i = 0; i < n_[0]; ++i) {
          const float weight = weights(i, j, k);
          row += weight > 0.0f ? weight : 0.0f;
          sums_[At(i + 1, j + 1, k + 1)] = row + sums_[At(i + 1, j, k + 1)] + sums_[At(i + 1, j + 1, k)] - sums_[At(i + 1, j, k)];
        }
      }
  }

  double Of(const std::array<int, 3>& a, const std::array<int, 3>& b) const // cells [a, b)
  {
    const auto layer = [&](int k) {
      return sums_[At(b[0], b[1], k)] - sums_[At(a[0], b[1], k)] - sums_[At(b[0], a[1], k)] + sums_[At(a[0], a[1], k)];
    };
    return layer(b[2]) - layer(a[2]);
  }

private:
  Size At(int i, int j, int k) const
  {
    return (static_cast<Size>(k) * static_cast<Size>(n_[1] + 1) + static_cast<Size>(j)) * static_cast<Size>(n_[0] + 1) +
           static_cast<Size>(i);
  }
  std::array<int, 3> n_;
  std::vector<double> sums_;
};

// The best box whose first layer is k.
CellBox BestFrom(int k, VolumeView<const float> weights, const RunningSums& sums)
{
  const auto& n = weights.Dimensions();
  CellBox best;
  std::vector<char> allowed(static_cast<Size>(n[0]) * static_cast<Size>(n[1]), 1);
  struct Bar {
    int begin, height;
  };
  std::vector<Bar> bars;
  std::vector<int> heights(static_cast<Size>(n[0]));
  for (int last = k; last < n[2]; ++last) {
    bool any = false;
    std::fill(heights.begin(), heights.end(), 0);
    for (int j = 0; j < n[1]; ++j) {
      const float* row = weights.Row(j, last);
      char* mask = allowed.data() + static_cast<Size>(j) * static_cast<Size>(n[0]);
      bars.clear();
      for (int i = 0; i <= n[0]; ++i) {
        int height = 0;
        if (i < n[0]) {
          mask[i] = mask[i] && row[i] > 0.0f;
          any = any || mask[i];
          height = heights[static_cast<Size>(i)] = mask[i] ? heights[static_cast<Size>(i)] + 1 : 0;
        }
        int begin = i;
        while (!bars.empty() && bars.back().height >= height) {
          const Bar bar = bars.back();
          bars.pop_back();
          begin = bar.begin;
          if (bar.height == 0)
            continue;
          const std::array<int, 3> first{bar.begin, j + 1 - bar.height, k}, end{i, j + 1, last + 1};
          const double weight = sums.Of(first, end);
          if (weight > best.weight)
            best = {first, {end[0] - first[0], end[1] - first[1], end[2] - first[2]}, weight};
        }
        bars.push_back({begin, height});
      }
    }
    if (!any)
      break;
  }
  return best;
}

} // namespace

CellBox LargestBox(VolumeView<const float> weights, const Progress& progress)
{
  const int layers = weights.Dimensions()[2];
  const RunningSums sums(weights);
  std::vector<CellBox> bests(static_cast<Size>(std::max(0, layers)));
  ParallelFor(layers, progress,
              [&](std::ptrdiff_t k) { bests[static_cast<Size>(k)] = BestFrom(static_cast<int>(k), weights, sums); });
  CellBox best;
  for (const CellBox& box : bests)
    if (box.weight > best.weight)
      best = box;
  return best;
}

Crop LargestCrop(VolumeView<const unsigned char> region, const ImageGeometry& grid, const PlacedProbe& fan, int resolution,
                 const Progress& progress)
{
  grid.Check("the grid");
  if (region.Dimensions() != grid.dimensions)
    throw Error(Error::Kind::BadInput, "the region: its voxels are not of the size that its geometry says");
  if (resolution < 2 || resolution > 256)
    throw Error(Error::Kind::InvalidParameter, "Resolution is " + std::to_string(resolution) + "; it must be 2 to 256");
  fan.geometry.Check();

  // 1. the cells of beam space: their volumes where they are region, 0 elsewhere
  const ProbeGeometry& probe = fan.geometry;
  const std::array<int, 3> n{resolution, resolution, probe.IsPlane() ? 1 : resolution};
  const double step[3] = {(probe.depthMax - probe.depthMin) / n[0], 1.0 / n[1], 1.0 / n[2]};
  const Eigen::Affine3d toIndex = grid.WorldToIndex() * Eigen::Affine3d(fan.probeToWorld);
  const auto sample = [&](double i, double j, double k) {
    return BeamPoint{probe.depthMin + (i + 0.5) * step[0], -0.5 + (j + 0.5) * step[1], -0.5 + (k + 0.5) * step[2]};
  };
  Volume<float> weights(n, 0.0f);
  ParallelFor(n[2], progress.Part(0.0, 0.2), [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const Eigen::Vector3d at = toIndex * PointOf(probe, sample(i, j, k));
        const auto p = at.array().round().cast<int>().eval();
        if ((p < 0).any() || p[0] >= grid.dimensions[0] || p[1] >= grid.dimensions[1] || p[2] >= grid.dimensions[2] ||
            !region(p[0], p[1], p[2]))
          continue;
        const auto edge = [&](double di, double dj, double dk) -> Eigen::Vector3d {
          return PointOf(probe, sample(i + di, j + dj, k + dk)) - PointOf(probe, sample(i - di, j - dj, k - dk));
        };
        const Eigen::Vector3d a = edge(0.5, 0.0, 0.0), b = edge(0.0, 0.5, 0.0), c = edge(0.0, 0.0, 0.5);
        const double volume = n[2] == 1 ? a.cross(b).norm() : std::abs(a.cross(b).dot(c));
        weights.View()(i, j, k) = static_cast<float>(volume);
      }
  });

  // 2. the largest box, and the voxels in it
  const CellBox box = LargestBox(weights.View(), progress.Part(0.2, 0.6));
  Crop crop;
  crop.first = sample(box.first[0] - 0.5, box.first[1] - 0.5, box.first[2] - 0.5);
  crop.last = sample(box.first[0] + box.size[0] - 0.5, box.first[1] + box.size[1] - 0.5, box.first[2] + box.size[2] - 0.5);
  const Eigen::Affine3d toProbe = Eigen::Affine3d(fan.probeToWorld.inverse()) * grid.IndexToWorld();
  std::vector<std::array<std::ptrdiff_t, 2>> counts(static_cast<Size>(grid.dimensions[2]), {0, 0});
  ParallelFor(grid.dimensions[2], progress.Part(0.6, 1.0), [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < grid.dimensions[1]; ++j)
      for (int i = 0; i < grid.dimensions[0]; ++i) {
        if (!region(i, j, k))
          continue;
        ++counts[static_cast<Size>(k)][0];
        const auto beam = box.weight > 0.0 ? BeamPointAt(probe, toProbe * Eigen::Vector3d(i, j, k)) : std::nullopt;
        counts[static_cast<Size>(k)][1] += beam && beam->depth >= crop.first.depth && beam->depth <= crop.last.depth &&
                                           beam->fan >= crop.first.fan && beam->fan <= crop.last.fan &&
                                           beam->sweep >= crop.first.sweep && beam->sweep <= crop.last.sweep;
      }
  });
  std::array<std::ptrdiff_t, 2> count{0, 0};
  for (const auto& slice : counts) {
    count[0] += slice[0];
    count[1] += slice[1];
  }
  if (count[0])
    crop.share = static_cast<double>(count[1]) / static_cast<double>(count[0]);
  return crop;
}

} // namespace echorama
