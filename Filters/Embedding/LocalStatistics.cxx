// SPDX-License-Identifier: BSD-3-Clause
//
// Sums of 1, v and v^2 over blocks, a Gaussian over the blocks, and a quotient of linear interpolations. Block, Gaussian and
// interpolation together have the variance that was asked for: a block of n voxels has (n^2 - 1) / 12, the interpolation n^2 / 6.
// Values are taken relative to the mean of the whole, so that a large offset costs the variance no digits.
//
// A slice of blocks is summed and smoothed along x and y before it is written, so the lattice, which may be as fine as the
// voxels, is written once, and read and written once more along z. Rows and columns without a voxel that counts are left out.
#include "LocalStatistics.h"
#include "BlockWindow.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/ZeroedMemory.h"
#include "Core/Imaging/VoxelTypes.h"
#include <cmath>
#include <cstdint>
#include <iterator>
#include <numeric>
#include <optional>
#include <type_traits>
#include <utility>

namespace echorama {

struct LocalStatistics::Lattice {
  Lattice(const Blocks& where, std::size_t kept, Zeroed<double>&& memory)
    : blocks(where), size(static_cast<std::ptrdiff_t>(where.count[0]) * where.count[1] * where.count[2]), channels(kept),
      sums(std::move(memory)), zero(sums.size() < kept * static_cast<std::size_t>(size))
  {
    if (zero) {
      sums = Zeroed<double>(); // before there is another
      sums = Zeroed<double>(kept * static_cast<std::size_t>(size));
    }
    rows.emplace(where, Views());
  }
  Lattice(const Lattice&) = delete;
  Lattice& operator=(const Lattice&) = delete;

  VolumeView<double> Channel(std::size_t c) { return {sums.data() + static_cast<std::ptrdiff_t>(c) * size, blocks.count}; }

  Blocks blocks;
  std::ptrdiff_t size;
  std::size_t channels;
  Zeroed<double> sums; // of 1, v - mean and, with three channels, (v - mean)^2 or (v - trend)^2
  bool zero;           // as they begin, and not what was left there
  std::optional<BlockRows> rows;
  bool fromTrend = false;
  double mean = 0.0, variance = 0.0; // of the whole

private:
  std::vector<VolumeView<const double>> Views()
  {
    std::vector<VolumeView<const double>> views;
    for (std::size_t c = 0; c < channels; ++c)
      views.push_back(Channel(c));
    return views;
  }
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
    return value - value == T(0); // which vector instructions do
  else
    return true;
}

// Of voxels [begin, end) of a row: 1, v - mean and (v - mean)^2, or (v - trend)^2; 0 of those that do not count.
template <class T>
void MomentsOfVoxels(const T* __restrict voxels, const unsigned char* __restrict region, int begin, int end, double mean,
                     const float* __restrict trend, double* const* to)
{
  double* __restrict weight = to[0], * __restrict first = to[1], * __restrict second = to[2];
  for (int i = begin; i < end; ++i)
    weight[i] = IsCounted(voxels[i]) ? 1.0 : 0.0;
  if (region)
    for (int i = begin; i < end; ++i)
      weight[i] = region[i] ? weight[i] : 0.0;
  for (int i = begin; i < end; ++i) {
    const double from = static_cast<double>(voxels[i]) - mean;
    first[i] = weight[i] > 0.0 ? from : 0.0;
    second[i] = weight[i] > 0.0 ? from * from : 0.0;
  }
  if (trend)
    for (int i = begin; i < end; ++i) {
      const double from = static_cast<double>(voxels[i]) - static_cast<double>(trend[i]);
      second[i] = weight[i] > 0.0 ? from * from : 0.0;
    }
}

// The window along one axis, over blocks.
std::vector<double> WindowAlong(std::size_t axis, const Blocks& blocks, const Eigen::Vector3d& spacing, double sigmaMm)
{
  const double size = blocks.size[axis], voxels = sigmaMm / spacing[static_cast<Eigen::Index>(axis)];
  const double variance = voxels * voxels - (size * size - 1.0) / 12.0 - (size > 1.0 ? size * size / 6.0 : 0.0);
  return HalfWindow(variance > 0.0 && blocks.count[axis] > 1 ? std::sqrt(variance) / size : 0.0);
}

// Adds numbers of the voxels [begin, end) of a row to those of their blocks.
void AddToBlocks(const double* numbers, int begin, int end, int size, double* to)
{
  if (size == 1) {
    for (int i = begin; i < end; ++i)
      to[i] += numbers[i];
    return;
  }
  for (int I = begin / size, i = begin; i < end; ++I) {
    double sum = 0.0;
    for (const int next = std::min((I + 1) * size, end); i < next; ++i)
      sum += numbers[i];
    to[I] += sum;
  }
}

// Slices [first, end) of a volume.
template <class T>
VolumeView<const T> SlicesOf(VolumeView<const T> volume, int first, int end)
{
  if (volume.Empty())
    return volume;
  return {volume.Row(0, first), {volume.Dimensions()[0], volume.Dimensions()[1], end - first}};
}

// A row of sums with room for a window before and after it.
struct PaddedRow {
  PaddedRow(int count, int before) : room(before), numbers(static_cast<std::size_t>(count + 2 * before)) {}
  double* First() { return numbers.data() + room; }
  int room;
  std::vector<double> numbers;
};

void Means(const double* __restrict weight, const double* __restrict first, int count, double whole, float* __restrict mean)
{
  for (int i = 0; i < count; ++i) {
    const double scale = weight[i] > 0.0 ? 1.0 / weight[i] : 0.0;
    mean[i] = static_cast<float>(whole + first[i] * scale);
  }
}

void Deviations(const double* __restrict weight, const double* __restrict first, const double* __restrict second, int count,
                double whole, double variance, bool fromTrend, float* __restrict deviation)
{
  const double taken = fromTrend ? 0.0 : 1.0;
  for (int i = 0; i < count; ++i) {
    const bool reached = weight[i] > 0.0;
    const double scale = reached ? 1.0 / weight[i] : 0.0;
    const double m = first[i] * scale, square = second[i] * scale;
    const double v = reached ? square - taken * (m * m) : variance;
    // What rounding leaves of the variance of a constant is no deviation.
    const double root = std::sqrt(v > 0.0 ? v : 0.0);
    deviation[i] = static_cast<float>(v > 1e-14 * (square + whole * whole) ? root : 0.0);
  }
}

} // namespace

void BlockSums::Grow(int end)
{
  while (End() < end)
    slices_.emplace_back(3 * static_cast<std::size_t>(grid_.count[0]) * static_cast<std::size_t>(grid_.count[1]), 0.0);
}

void BlockSums::Append(BlockSums&& next)
{
  slices_.insert(slices_.end(), std::make_move_iterator(next.slices_.begin()), std::make_move_iterator(next.slices_.end()));
}

void BlockSums::Forget(int before)
{
  for (; first_ < before && !slices_.empty(); ++first_)
    slices_.pop_front();
}

template <class T>
void BlockSums::AddRow(int first, int j, int k, const T* voxels, const unsigned char* region, int count)
{
  int begin = 0, end = count;
  while (region && begin < end && !region[begin])
    ++begin;
  while (region && begin < end && !region[end - 1])
    --end;
  if (begin >= end)
    return;
  const auto width = static_cast<std::size_t>(grid_.voxels[0]);
  thread_local std::vector<double> ofVoxels;
  ofVoxels.resize(3 * width);
  double* const own[3] = {ofVoxels.data(), ofVoxels.data() + width, ofVoxels.data() + 2 * width};
  MomentsOfVoxels(voxels - first, region ? region - first : nullptr, first + begin, first + end, 0.0, nullptr, own);
  for (std::size_t c = 0; c < 3; ++c)
    AddToBlocks(own[c], first + begin, first + end, grid_.size[0], Row(c, j / grid_.size[1], k / grid_.size[2]));
}

const double* BlockSums::Row(std::size_t channel, int J, int K) const
{
  const auto count = [this](std::size_t axis) { return static_cast<std::size_t>(grid_.count[axis]); };
  return slices_[static_cast<std::size_t>(K - first_)].data() + (channel * count(1) + static_cast<std::size_t>(J)) * count(0);
}

double* BlockSums::Row(std::size_t channel, int J, int K)
{
  return const_cast<double*>(std::as_const(*this).Row(channel, J, K));
}

int LocalStatistics::Reach(const Blocks& blocks, const Eigen::Vector3d& spacing, double sigmaMm)
{
  return static_cast<int>(WindowAlong(2, blocks, spacing, sigmaMm).size()) - 1;
}

LocalStatistics::LocalStatistics(const BlockSums& sums, int first, int end, const Eigen::Vector3d& spacing, double sigmaMm)
{
  Blocks blocks = sums.Grid();
  std::array<std::vector<double>, 3> windows;
  for (std::size_t axis = 0; axis < 3; ++axis)
    windows[axis] = WindowAlong(axis, blocks, spacing, sigmaMm);
  origin_[2] = -first * blocks.size[2];
  blocks.voxels[2] = std::min(end * blocks.size[2], blocks.voxels[2]) + origin_[2];
  blocks.count[2] = end - first;
  const auto& count = blocks.count;
  const auto lattice = std::make_shared<Lattice>(blocks, 3, Zeroed<double>());
  std::vector<SliceExtent> extents(static_cast<std::size_t>(count[2]));
  ParallelFor(count[2], [&](std::ptrdiff_t slice) {
    const int K = static_cast<int>(slice);
    if (first + K < sums.First() || first + K >= sums.End())
      return;
    PaddedRow raw(count[0], static_cast<int>(windows[0].size()) - 1);
    PaddedRow smoothed(count[0] * count[1], count[0] * (static_cast<int>(windows[1].size()) - 1));
    for (std::size_t c = 0; c < 3; ++c) {
      for (int J = 0; J < count[1]; ++J) {
        std::copy_n(sums.Row(c, J, first + K), count[0], raw.First());
        SumWindow(windows[0], raw.First(), 1, count[0], smoothed.First() + static_cast<std::ptrdiff_t>(J) * count[0]);
      }
      SumWindow(windows[1], smoothed.First(), count[0], count[0] * count[1], lattice->Channel(c).Row(0, K));
    }
    extents[static_cast<std::size_t>(K)].end = {count[0], count[1]};
  });
  ParallelFor(count[1], [&](std::ptrdiff_t J) {
    for (std::size_t c = 0; c < 3; ++c)
      SumWindowAlongZ(windows[2], count, extents, static_cast<int>(J), lattice->Channel(c).Data());
  });
  lattice_ = lattice;
}

LocalStatistics::LocalStatistics(const Blocks& blocks, VolumeView<const double> means)
{
  const auto lattice = std::make_shared<Lattice>(blocks, 2, Zeroed<double>());
  std::fill(lattice->Channel(0).begin(), lattice->Channel(0).end(), 1.0);
  std::copy(means.begin(), means.end(), lattice->Channel(1).begin());
  lattice_ = lattice;
}

LocalStatistics LocalStatistics::From(const std::array<int, 3>& voxel) const
{
  LocalStatistics part = *this;
  for (std::size_t axis = 0; axis < 3; ++axis)
    part.origin_[axis] += voxel[axis];
  return part;
}

template <class T>
LocalStatistics::LocalStatistics(VolumeView<const T> intensity, VolumeView<const unsigned char> region,
                                 const Eigen::Vector3d& spacing, double sigmaMm, const Progress& progress, double trendMm,
                                 bool meansAlone, LocalStatistics* spent, const double* mean)
{
  if (intensity.Empty() || (!region.Empty() && region.Dimensions() != intensity.Dimensions()))
    throw Error(Error::Kind::BadInput, "local statistics: the region does not have the size of the volume");
  if (!(sigmaMm >= 0.0) || !std::isfinite(sigmaMm) || !(trendMm >= 0.0) || !std::isfinite(trendMm))
    throw Error(Error::Kind::InvalidParameter, "sigmaMm and trendMm must be numbers from 0 on");
  Zeroed<double> memory;
  if (spent && spent->lattice_ && spent->lattice_.use_count() == 1)
    memory.swap(spent->lattice_->sums);
  if (spent)
    spent->lattice_.reset();
  const auto lattice =
      std::make_shared<Lattice>(Blocks(intensity.Dimensions(), spacing, sigmaMm / 1.5), meansAlone ? 2 : 3, std::move(memory));
  lattice->fromTrend = trendMm > 0.0;
  const Blocks& blocks = lattice->blocks;
  const auto& count = blocks.count;
  const auto real = [&](std::ptrdiff_t at) { return (region.Empty() || region[at]) && IsCounted(intensity[at]); };

  // 1. the whole
  // Whole numbers are summed as such, which vector instructions do; of bytes and shorts no sum is rounded, so it is the same.
  using Sum = std::conditional_t<std::is_integral_v<T>, std::int64_t, double>;
  const Moments whole =
      mean ? Moments{} : ParallelSum<Moments>(intensity.Size(), 1 << 16, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
        Sum weight = 0, first = 0;
        for (std::ptrdiff_t at = begin; at < end; ++at) {
          const bool counts = real(at);
          weight += counts ? Sum(1) : Sum(0);
          first += counts ? static_cast<Sum>(intensity[at]) : Sum(0);
        }
        return Moments{static_cast<double>(weight), static_cast<double>(first), 0.0};
      });
  lattice->mean = mean ? *mean : whole.weight > 0.0 ? whole.first / whole.weight : 0.0;

  // 2. blocks, and the window along x and y
  std::array<std::vector<double>, 3> windows;
  std::array<int, 3> reach{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    windows[axis] = WindowAlong(axis, blocks, spacing, sigmaMm);
    reach[axis] = static_cast<int>(windows[axis].size()) - 1;
  }
  const std::size_t channels = lattice->channels;
  std::vector<SliceExtent> extents(static_cast<std::size_t>(count[2]));
  std::vector<double> squares(extents.size(), 0.0);
  std::optional<LocalStatistics> trend;
  int trendFirst = 0; // the slice that it begins with
  const auto sumSlice = [&](int K) {
    const int kEnd = std::min((K + 1) * blocks.size[2], blocks.voxels[2]);
    std::vector<float> around(trend ? static_cast<std::size_t>(blocks.voxels[0]) : 0);
    std::vector<double> ofVoxels(3 * static_cast<std::size_t>(blocks.voxels[0]));
    double* const own[3] = {ofVoxels.data(), ofVoxels.data() + blocks.voxels[0], ofVoxels.data() + 2 * blocks.voxels[0]};
    std::vector<PaddedRow> raw(3, PaddedRow(count[0], reach[0]));
    const std::size_t rowSize = static_cast<std::size_t>(count[0]);
    const std::size_t rows = static_cast<std::size_t>(count[1] + 2 * reach[1]);
    thread_local std::vector<double> smoothed; // along x, with room for a window along y
    smoothed.resize(channels * rows * rowSize);
    const auto row = [&](std::size_t c, int J) {
      return smoothed.data() + (c * rows + static_cast<std::size_t>(J + reach[1])) * rowSize;
    };
    const auto clear = [&](int J, int begin, int end) {
      for (std::size_t c = 0; c < channels; ++c)
        std::fill(row(c, J) + begin, row(c, J) + end, 0.0);
    };
    for (int J = 1; J <= reach[1]; ++J) {
      clear(-J, 0, count[0]);
      clear(count[1] - 1 + J, 0, count[0]);
    }
    SliceExtent extent;
    extent.begin = {count[0], count[1]};
    for (int J = 0; J < count[1]; ++J) {
      int first = count[0], last = -1;
      for (int k = K * blocks.size[2]; k < kEnd; ++k)
        for (int j = J * blocks.size[1]; j < std::min((J + 1) * blocks.size[1], blocks.voxels[1]); ++j) {
          const std::ptrdiff_t voxels = intensity.SliceStride() * k + intensity.RowStride() * j;
          int begin = 0, end = blocks.voxels[0];
          while (begin < end && !real(voxels + begin))
            ++begin;
          while (begin < end && !real(voxels + end - 1))
            --end;
          if (begin == end)
            continue;
          if (last < 0)
            for (PaddedRow& sums : raw)
              std::fill(sums.numbers.begin(), sums.numbers.end(), 0.0);
          if (trend)
            trend->Row(j, k - trendFirst, begin, end, around.data() + begin, nullptr);
          first = std::min(first, begin / blocks.size[0]);
          last = std::max(last, (end - 1) / blocks.size[0]);
          MomentsOfVoxels(intensity.Data() + voxels, region.Empty() ? nullptr : region.Data() + voxels, begin, end, lattice->mean,
                          trend ? around.data() : nullptr, own);
          for (std::size_t c = 0; c < 3; ++c)
            AddToBlocks(own[c], begin, end, blocks.size[0], raw[c].First());
        }
      if (last < 0) {
        clear(J, 0, count[0]);
        continue;
      }
      for (int I = first; I <= last; ++I)
        squares[static_cast<std::size_t>(K)] += raw[2].First()[I];
      const int from = std::max(0, first - reach[0]), to = std::min(count[0], last + 1 + reach[0]);
      clear(J, 0, from);
      clear(J, to, count[0]);
      for (std::size_t c = 0; c < channels; ++c)
        SumWindow(windows[0], raw[c].First() + from, 1, to - from, row(c, J) + from);
      extent.begin = {std::min(extent.begin[0], from), std::min(extent.begin[1], J)};
      extent.end = {std::max(extent.end[0], to), J + 1};
    }
    const int from = std::max(0, extent.begin[1] - reach[1]), to = std::min(count[1], extent.end[1] + reach[1]);
    for (std::size_t c = 0; c < channels; ++c) {
      const VolumeView<double> sums = lattice->Channel(c);
      if (!lattice->zero)
        std::fill(sums.Row(0, K), sums.Row(0, K) + sums.SliceStride(), 0.0);
      if (!extent.Empty())
        for (int J = from; J < to; ++J)
          SumWindow(windows[1], row(c, J) + extent.begin[0], count[0], extent.end[0] - extent.begin[0],
                    sums.Row(J, K) + extent.begin[0]);
    }
    if (!extent.Empty()) {
      extent.begin[1] = from;
      extent.end[1] = to;
      extents[static_cast<std::size_t>(K)] = extent;
    }
  };
  // The trend may be as fine as the voxels: it is worked out for some slices at a time, with as many beyond as they depend on.
  const Blocks fine(blocks.voxels, spacing, trendMm / 1.5);
  const int beyond = (static_cast<int>(WindowAlong(2, fine, spacing, trendMm).size()) + 1) * fine.size[2];
  const int together = trendMm > 0.0 ? std::max(1, 8 * beyond / blocks.size[2]) : count[2];
  for (int first = 0; first < count[2]; first += together) {
    const int end = std::min(first + together, count[2]);
    const Progress part = progress.Part(0.2 + 0.6 * first / count[2], 0.2 + 0.6 * end / count[2]);
    if (trendMm > 0.0) {
      trendFirst = std::max(0, first * blocks.size[2] - beyond) / fine.size[2] * fine.size[2];
      const int after = end * blocks.size[2] + beyond;
      const int trendEnd = std::min((after + fine.size[2] - 1) / fine.size[2] * fine.size[2], blocks.voxels[2]);
      trend = LocalStatistics(SlicesOf(intensity, trendFirst, trendEnd), SlicesOf(region, trendFirst, trendEnd), spacing, trendMm,
                              part.Part(0.0, 0.5), 0.0, true, trend ? &*trend : nullptr, &lattice->mean);
    }
    ParallelFor(end - first, part.Part(trendMm > 0.0 ? 0.5 : 0.0, 1.0),
                [&](std::ptrdiff_t block) { sumSlice(first + static_cast<int>(block)); });
  }
  const double all = std::accumulate(squares.begin(), squares.end(), 0.0);
  lattice->variance = whole.weight > 0.0 ? all / whole.weight : 0.0; // not asked for where the mean was given

  // 3. the window along z
  ParallelFor(count[1], progress.Part(0.8, 1.0), [&](std::ptrdiff_t J) {
    for (std::size_t c = 0; c < channels; ++c)
      SumWindowAlongZ(windows[2], count, extents, static_cast<int>(J), lattice->Channel(c).Data());
  });
  lattice_ = lattice;
}

void LocalStatistics::Row(int j, int k, int first, int end, float* mean, float* deviation) const
{
  if (first >= end)
    return;
  if (deviation && lattice_->channels < 3)
    throw Error(Error::Kind::InvalidParameter, "local statistics: deviations of means alone");
  const std::size_t count = static_cast<std::size_t>(end - first);
  thread_local std::vector<double> sums;
  sums.resize(3 * count);
  double* const rows[3] = {sums.data(), sums.data() + count, deviation ? sums.data() + 2 * count : nullptr};
  lattice_->rows->Row(j + origin_[1], k + origin_[2], first + origin_[0], end + origin_[0], rows);
  Means(rows[0], rows[1], static_cast<int>(count), lattice_->mean, mean);
  if (deviation)
    Deviations(rows[0], rows[1], rows[2], static_cast<int>(count), lattice_->mean, lattice_->variance, lattice_->fromTrend,
               deviation);
}

void LocalStatistics::RowOfBlocks(int J, int K, float* mean, float* deviation) const
{
  const int slice = K + origin_[2] / lattice_->blocks.size[2], count = lattice_->blocks.count[0];
  const double* rows[3]{};
  for (std::size_t c = 0; c < lattice_->channels; ++c)
    rows[c] = lattice_->Channel(c).Row(J, slice);
  Means(rows[0], rows[1], count, lattice_->mean, mean);
  Deviations(rows[0], rows[1], rows[2], count, lattice_->mean, lattice_->variance, lattice_->fromTrend, deviation);
}

#define EchoramaInstantiate(T)                                                                                                   \
  template void BlockSums::AddRow(int, int, int, const T*, const unsigned char*, int);                                           \
  template LocalStatistics::LocalStatistics(VolumeView<const T>, VolumeView<const unsigned char>, const Eigen::Vector3d&,        \
                                            double, const Progress&, double, bool, LocalStatistics*, const double*);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
