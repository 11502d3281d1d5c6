// SPDX-License-Identifier: BSD-3-Clause
// A Gaussian along each axis in turn. Every pass is a weighted sum of rows, whether they lie beside, above or behind each
// other, so one loop serves all three and runs along memory. x and y are done slice by slice, z row by row of a slice, each
// with a copy that fits in the cache. Cost: about 5 standard deviations of multiplications per voxel and axis.
#include "Core/Base/Parallel.h"
#include "Metric.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr int Many = 64, Some = 16;

template <int Lanes>
[[gnu::always_inline]] inline void SumColumns(const float* const* rows, const float* taps, int count, int first, float* out)
{
  float sum[Lanes] = {};
  for (int t = 0; t < count; ++t) {
    const float* const row = rows[t] + first;
    for (int lane = 0; lane < Lanes; ++lane)
      sum[lane] += taps[t] * row[lane];
  }
  std::copy_n(sum, Lanes, out + first);
}

// out[i] = sum over t of taps[t] * rows[t][i].
void SumRows(const float* const* rows, const float* taps, int count, int width, float* out)
{
  int i = 0;
  for (; i + Many <= width; i += Many)
    SumColumns<Many>(rows, taps, count, i, out);
  for (; width >= Some && i < width; i += Some) // the last partly once more
    SumColumns<Some>(rows, taps, count, std::min(i, width - Some), out);
  for (; i < width; ++i)
    SumColumns<1>(rows, taps, count, i, out);
}

struct Kernel {
  explicit Kernel(double sigma)
  {
    if (sigma < 0.2)
      return;
    reach = std::max(1, static_cast<int>(std::lround(2.5 * sigma)));
    double sum = 0.0;
    std::vector<double> w;
    for (int i = -reach; i <= reach; ++i) {
      w.push_back(std::exp(-0.5 * i * i / (sigma * sigma)));
      sum += w.back();
    }
    for (const double v : w)
      taps.push_back(static_cast<float>(v / sum));
  }
  int reach = 0;
  std::vector<float> taps; // 2 * reach + 1, none: nothing to do
};

// Replaces n rows (row i at first + i * stride) by their weighted sums; copy holds n rows of the width.
void Across(float* first, std::ptrdiff_t stride, int n, int width, const Kernel& kernel, std::vector<float>& copy)
{
  copy.resize(static_cast<std::size_t>(n) * static_cast<std::size_t>(width));
  for (int i = 0; i < n; ++i)
    std::copy_n(first + i * stride, width, copy.data() + static_cast<std::ptrdiff_t>(i) * width);
  std::vector<const float*> rows(kernel.taps.size());
  for (int i = 0; i < n; ++i) {
    const int from = std::max(0, i - kernel.reach), to = std::min(n - 1, i + kernel.reach);
    for (int r = from; r <= to; ++r)
      rows[static_cast<std::size_t>(r - from)] = copy.data() + static_cast<std::ptrdiff_t>(r) * width;
    SumRows(rows.data(), kernel.taps.data() + (from - i + kernel.reach), to - from + 1, width, first + i * stride);
  }
}

void AlongRow(float* row, int n, const Kernel& kernel, std::vector<float>& padded)
{
  padded.assign(static_cast<std::size_t>(n + 2 * kernel.reach), 0.0f);
  std::copy_n(row, n, padded.data() + kernel.reach);
  std::vector<const float*> rows(kernel.taps.size());
  for (std::size_t t = 0; t < rows.size(); ++t)
    rows[t] = padded.data() + t;
  SumRows(rows.data(), kernel.taps.data(), static_cast<int>(rows.size()), n, row);
}

void SmoothAlongXAndY(VolumeView<float> volume, int k, const Kernel& x, const Kernel& y)
{
  const auto& n = volume.Dimensions();
  std::vector<float> copy;
  if (!x.taps.empty())
    for (int j = 0; j < n[1]; ++j)
      AlongRow(volume.Row(j, k), n[0], x, copy);
  if (!y.taps.empty())
    Across(volume.Row(0, k), volume.RowStride(), n[1], n[0], y, copy);
}

} // namespace

void GaussianSum(VolumeView<float> volume, const Eigen::Vector3d& sigmaVoxels)
{
  const Kernel x(sigmaVoxels.x()), y(sigmaVoxels.y()), z(sigmaVoxels.z());
  const auto& n = volume.Dimensions();
  if (!x.taps.empty() || !y.taps.empty())
    ParallelFor(n[2], [&](std::ptrdiff_t k) { SmoothAlongXAndY(volume, static_cast<int>(k), x, y); });
  if (!z.taps.empty())
    ParallelFor(n[1], [&](std::ptrdiff_t j) {
      std::vector<float> copy;
      Across(volume.Row(static_cast<int>(j), 0), volume.SliceStride(), n[2], n[0], z, copy);
    });
}

void SmoothSlices(const std::array<int, 3>& n, int volumes, const Eigen::Vector3d& sigmaVoxels, const RowSpans& spans,
                  const std::function<void(int k, VolumeView<float> slices)>& make,
                  const std::function<void(int k, VolumeView<const float> smoothed)>& use)
{
  constexpr std::ptrdiff_t chunk = 16;
  const Kernel x(sigmaVoxels.x()), y(sigmaVoxels.y()), z(sigmaVoxels.z());
  const std::array<int, 3> size{n[0], n[1], volumes};
  // Where a row is not nothing, before and after it was smoothed along x, and after its neighbours along y were added.
  const auto wider = [&](int j, int k) {
    const RowSpan span = spans.At(j, k);
    return span.Empty() ? span : RowSpan{std::max(0, span.first - x.reach), std::min(n[0], span.end + x.reach)};
  };
  ParallelRanges(n[2], chunk, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::vector<Volume<float>> ring(static_cast<std::size_t>(2 * z.reach + 1), Volume<float>(size));
    const auto at = [&ring](int k) { return ring[static_cast<std::size_t>(k) % ring.size()].View(); };
    Volume<float> alongX(size), smoothed(size);
    std::vector<float> padded;
    std::vector<const float*> rows(std::max(ring.size(), y.taps.size()));
    const auto fill = [&](int k) {
      const VolumeView<float> in = y.taps.empty() ? at(k) : alongX.View(), out = at(k);
      std::fill(in.begin(), in.end(), 0.0f);
      make(k, in);
      for (int volume = 0; volume < volumes; ++volume)
        for (int j = 0; j < n[1] && !x.taps.empty(); ++j)
          if (const RowSpan span = wider(j, k); !span.Empty())
            AlongRow(in.Row(j, volume) + span.first, span.Size(), x, padded);
      for (int j = 0; j < n[1] && !y.taps.empty(); ++j) {
        const int from = std::max(0, j - y.reach), to = std::min(n[1] - 1, j + y.reach);
        RowSpan reached;
        for (int r = from; r <= to; ++r)
          reached.Add(wider(r, k));
        for (int volume = 0; volume < volumes; ++volume) {
          std::fill_n(out.Row(j, volume), n[0], 0.0f);
          if (reached.Empty())
            continue;
          for (int r = from; r <= to; ++r)
            rows[static_cast<std::size_t>(r - from)] = in.Row(r, volume) + reached.first;
          SumRows(rows.data(), y.taps.data() + (from - j + y.reach), to - from + 1, reached.Size(),
                  out.Row(j, volume) + reached.first);
        }
      }
    };
    int made = std::max(0, static_cast<int>(begin) - z.reach);
    for (int k = static_cast<int>(begin); k < static_cast<int>(end); ++k) {
      const int from = std::max(0, k - z.reach), to = std::min(n[2] - 1, k + z.reach);
      for (; made <= to; ++made)
        fill(made);
      if (z.taps.empty()) {
        use(k, at(k));
        continue;
      }
      for (int j = 0; j < n[1]; ++j)
        if (const RowSpan span = spans.At(j, k); !span.Empty())
          for (int volume = 0; volume < volumes; ++volume) {
            for (int r = from; r <= to; ++r)
              rows[static_cast<std::size_t>(r - from)] = at(r).Row(j, volume) + span.first;
            SumRows(rows.data(), z.taps.data() + (from - k + z.reach), to - from + 1, span.Size(),
                    smoothed.View().Row(j, volume) + span.first);
          }
      use(k, smoothed.View());
    }
  });
}

} // namespace echorama
