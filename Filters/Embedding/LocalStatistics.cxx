// SPDX-License-Identifier: BSD-3-Clause
//
// Sums of 1, v and v^2 over blocks, a Gaussian over the blocks, and a quotient of linear interpolations. Block, Gaussian and
// interpolation together have the variance that was asked for: a block of n voxels has (n^2 - 1) / 12, the interpolation n^2 / 6.
// Values are taken relative to the mean of the whole, so that a large offset costs the variance no digits.
#include "LocalStatistics.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/VoxelTypes.h"
#include <cmath>

namespace echorama {

struct LocalStatistics::Lattice {
  Lattice(const Blocks& where)
    : blocks(where), weight(where.count), first(where.count), second(where.count),
      rows(where, {weight.View(), first.View(), second.View()})
  {
  }
  Lattice(const Lattice&) = delete;
  Lattice& operator=(const Lattice&) = delete;

  Blocks blocks;
  Volume<double> weight, first, second; // sums of 1, v - mean and (v - mean)^2, or (v - trend)^2
  BlockRows rows;
  bool fromTrend = false;
  double mean = 0.0, variance = 0.0; // of the whole
};

namespace {

struct Moments {
  double weight = 0.0, first = 0.0, second = 0.0;
  Moments& operator+=(const Moments& other)
  {
    weight += other.weight;
    first += other.first;
    second += other.second;
    return *this;
  }
};

template <class T>
bool IsCounted(T value)
{
  if constexpr (std::is_floating_point_v<T>)
    return std::isfinite(value);
  else
    return true;
}

// A Gaussian along one axis, over all lines of it. Beyond the ends there is nothing.
void Smooth(VolumeView<double> values, std::size_t axis, double sigma)
{
  const auto& n = values.Dimensions();
  const int count = n[axis];
  if (count == 1 || !(sigma > 0.0))
    return;
  std::vector<double> kernel(static_cast<std::size_t>(std::ceil(3.0 * sigma)) + 1);
  for (std::size_t i = 0; i < kernel.size(); ++i)
    kernel[i] = std::exp(-0.5 * static_cast<double>(i * i) / (sigma * sigma));
  const std::ptrdiff_t stride = axis == 0 ? 1 : axis == 1 ? values.RowStride() : values.SliceStride();
  const int across = axis == 0 ? n[1] : n[0], slices = axis == 2 ? n[1] : n[2];
  const std::ptrdiff_t acrossStride = axis == 0 ? values.RowStride() : 1;
  const std::ptrdiff_t sliceStride = axis == 2 ? values.RowStride() : values.SliceStride();
  ParallelFor(slices, [&](std::ptrdiff_t slice) {
    std::vector<double> line(static_cast<std::size_t>(count));
    for (int a = 0; a < across; ++a) {
      double* at = values.Data() + slice * sliceStride + a * acrossStride;
      for (int i = 0; i < count; ++i)
        line[static_cast<std::size_t>(i)] = at[i * stride];
      for (int i = 0; i < count; ++i) {
        double sum = kernel[0] * line[static_cast<std::size_t>(i)];
        const int reach = static_cast<int>(kernel.size()) - 1;
        for (int d = 1; d <= reach; ++d) {
          const double before = i - d >= 0 ? line[static_cast<std::size_t>(i - d)] : 0.0;
          const double after = i + d < count ? line[static_cast<std::size_t>(i + d)] : 0.0;
          sum += kernel[static_cast<std::size_t>(d)] * (before + after);
        }
        at[i * stride] = sum;
      }
    }
  });
}

} // namespace

template <class T>
LocalStatistics::LocalStatistics(VolumeView<const T> intensity, VolumeView<const unsigned char> region,
                                 const Eigen::Vector3d& spacing, double sigmaMm, const Progress& progress,
                                 const LocalStatistics* trend)
{
  if (intensity.Empty() || (!region.Empty() && region.Dimensions() != intensity.Dimensions()))
    throw Error(Error::Kind::BadInput, "local statistics: the region does not have the size of the volume");
  if (!(sigmaMm >= 0.0) || !std::isfinite(sigmaMm))
    throw Error(Error::Kind::InvalidParameter, "sigmaMm must be a number from 0 on");
  const auto lattice = std::make_shared<Lattice>(Blocks(intensity.Dimensions(), spacing, sigmaMm / 1.5));
  lattice->fromTrend = trend != nullptr;
  const Blocks& blocks = lattice->blocks;
  const auto real = [&](std::ptrdiff_t at) { return (region.Empty() || region[at]) && IsCounted(intensity[at]); };

  // 1. the whole
  const auto whole = ParallelSum<Moments>(intensity.Size(), 1 << 16, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    Moments sum;
    for (std::ptrdiff_t at = begin; at < end; ++at)
      if (real(at)) {
        sum.weight += 1.0;
        sum.first += static_cast<double>(intensity[at]);
      }
    return sum;
  });
  lattice->mean = whole.weight > 0.0 ? whole.first / whole.weight : 0.0;

  // 2. blocks
  ParallelFor(blocks.count[2], progress.Part(0.2, 0.8), [&](std::ptrdiff_t block) {
    const int K = static_cast<int>(block), kEnd = std::min((K + 1) * blocks.size[2], blocks.voxels[2]);
    std::vector<float> around(trend ? static_cast<std::size_t>(blocks.voxels[0]) : 0), unused(around.size());
    for (int k = K * blocks.size[2]; k < kEnd; ++k)
      for (int j = 0; j < blocks.voxels[1]; ++j) {
        if (trend)
          trend->Row(j, k, 0, blocks.voxels[0], around.data(), unused.data());
        const std::ptrdiff_t row = intensity.SliceStride() * k + intensity.RowStride() * j;
        const int J = j / blocks.size[1];
        double *weight = lattice->weight.View().Row(J, K), *first = lattice->first.View().Row(J, K),
               *second = lattice->second.View().Row(J, K);
        for (int I = 0, i = 0; I < blocks.count[0]; ++I) {
          Moments sum;
          for (const int end = std::min((I + 1) * blocks.size[0], blocks.voxels[0]); i < end; ++i)
            if (real(row + i)) {
              const double value = static_cast<double>(intensity[row + i]);
              const double from = value - (trend ? static_cast<double>(around[static_cast<std::size_t>(i)]) : lattice->mean);
              sum += {1.0, value - lattice->mean, from * from};
            }
          weight[I] += sum.weight;
          first[I] += sum.first;
          second[I] += sum.second;
        }
      }
  });
  const double squares = ParallelSum<double>(lattice->second.View().Size(), 4096, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    double sum = 0.0;
    for (std::ptrdiff_t at = begin; at < end; ++at)
      sum += lattice->second.View()[at];
    return sum;
  });
  lattice->variance = whole.weight > 0.0 ? squares / whole.weight : 0.0;

  // 3. the window
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double size = blocks.size[axis], voxels = sigmaMm / spacing[static_cast<Eigen::Index>(axis)];
    const double variance = voxels * voxels - (size * size - 1.0) / 12.0 - (size > 1.0 ? size * size / 6.0 : 0.0);
    const double sigma = variance > 0.0 ? std::sqrt(variance) / size : 0.0;
    for (Volume<double>* sums : {&lattice->weight, &lattice->first, &lattice->second})
      Smooth(sums->View(), axis, sigma);
    progress(0.8 + 0.2 * static_cast<double>(axis + 1) / 3.0);
  }
  lattice_ = lattice;
}

void LocalStatistics::Row(int j, int k, int first, int end, float* mean, float* deviation) const
{
  if (first >= end)
    return;
  const std::size_t count = static_cast<std::size_t>(end - first);
  thread_local std::vector<double> sums;
  sums.resize(3 * count);
  double* const rows[3] = {sums.data(), sums.data() + count, sums.data() + 2 * count};
  lattice_->rows.Row(j, k, first, end, rows);
  const double whole = lattice_->mean, variance = lattice_->variance;
  for (std::size_t i = 0; i < count; ++i) {
    const bool reached = rows[0][i] > 0.0;
    const double scale = reached ? 1.0 / rows[0][i] : 0.0;
    const double m = rows[1][i] * scale, square = rows[2][i] * scale;
    const double v = !reached ? variance : lattice_->fromTrend ? square : square - m * m;
    mean[i] = static_cast<float>(whole + m);
    // What rounding leaves of the variance of a constant is no deviation.
    deviation[i] = static_cast<float>(v > 1e-14 * (square + whole * whole) ? std::sqrt(v) : 0.0);
  }
}

#define EchoramaInstantiate(T)                                                                                                   \
  template LocalStatistics::LocalStatistics(VolumeView<const T>, VolumeView<const unsigned char>, const Eigen::Vector3d&,        \
                                            double, const Progress&, const LocalStatistics*);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
