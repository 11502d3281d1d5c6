// SPDX-License-Identifier: BSD-3-Clause
// Where two speckle patterns meet, what is smooth and what is texture are blended apart. The smooth part needs no fine
// lattice. All volumes are averaged over the same blocks of the output: a lattice of each volume's own would be cheaper, but
// what aliases would differ from volume to volume, and a place that all see alike would not come out as it is.
#include "LowPass.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace echorama {

namespace {

// Binomial filters over the squares: so many that the deviation of a texture is known to some per cent.
constexpr int deviationRounds = 4;

// A variance that is less, relative to the square of the mean, is rounding: the voxels are floats.
constexpr double noDeviation = 1e-13;

constexpr float nothing = std::numeric_limits<float>::quiet_NaN();

// (1 2 1) / 4; a neighbour that is not there is taken to be as the block itself, and a block that is not there becomes the
// mean of those of its neighbours that are.
void SmoothRow(const float* before, const float* at, const float* behind, int count, float* __restrict to)
{
  for (int i = 0; i < count; ++i) {
    const float below = before[i], own = at[i], above = behind[i];
    const float beside = std::isnan(below) ? above : below, here = std::isnan(own) ? beside : own;
    const float a = std::isnan(below) ? here : below, b = std::isnan(above) ? here : above;
    to[i] = std::isnan(own) ? here + 0.5f * (b - here) : here + 0.25f * ((a - here) + (b - here));
  }
}

// The same in place along rows that lie \a stride apart, \a steps of them.
class RowSmoother {
public:
  explicit RowSmoother(int count) : none_(static_cast<std::size_t>(count), nothing), before_(none_), own_(none_) {}
  void Along(float* row, std::ptrdiff_t stride, int steps)
  {
    const std::size_t count = none_.size();
    std::copy(none_.begin(), none_.end(), before_.begin());
    for (int step = 0; step < steps; ++step, row += stride) {
      std::copy(row, row + count, own_.begin());
      SmoothRow(before_.data(), own_.data(), step + 1 < steps ? row + stride : none_.data(), static_cast<int>(count), row);
      std::swap(before_, own_);
    }
  }

private:
  std::vector<float> none_, before_, own_;
};

void Smooth(Volume<float>& volume)
{
  const auto to = volume.View();
  const auto& n = to.Dimensions();
  ParallelFor(n[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    std::vector<float> padded(static_cast<std::size_t>(n[0]) + 2, nothing);
    for (int j = 0; j < n[1] && n[0] > 1; ++j) {
      std::copy(to.Row(j, k), to.Row(j, k) + n[0], padded.begin() + 1);
      SmoothRow(padded.data(), padded.data() + 1, padded.data() + 2, n[0], to.Row(j, k));
    }
    if (n[1] > 1)
      RowSmoother(n[0]).Along(to.Row(0, k), to.RowStride(), n[1]);
  });
  if (n[2] > 1)
    ParallelFor(n[1],
                [&](std::ptrdiff_t row) { RowSmoother(n[0]).Along(to.Row(static_cast<int>(row), 0), to.SliceStride(), n[2]); });
}

// Whether each voxel of a row is shared, told by every \a step-th. \returns whether any is.
bool SharedRow(const std::vector<unsigned char>& covered, int first, int step, std::vector<unsigned char>& shared)
{
  int any = 0;
  std::size_t i = 0, left = static_cast<std::size_t>(step - first % step); // until the next that is told
  for (const unsigned char count : covered) {
    const unsigned char here = count > 1 ? 1 : 0;
    any |= here;
    for (const std::size_t end = std::min(shared.size(), i + left); i < end; ++i)
      shared[i] = here;
    left = static_cast<std::size_t>(step);
  }
  std::fill(shared.begin() + static_cast<std::ptrdiff_t>(i), shared.end(), covered.back() > 1 ? 1 : 0);
  return any != 0;
}

// Of where the volume is (bit 0), what it shares.
void KeepShared(const unsigned char* shared, int count, unsigned char* __restrict inside)
{
  for (int i = 0; i < count; ++i)
    inside[i] &= shared[i];
}

void AddSquaredDifferences(const float* a, const float* b, std::ptrdiff_t count, float* __restrict to)
{
  for (std::ptrdiff_t i = 0; i < count; ++i)
    to[i] += (a[i] - b[i]) * (a[i] - b[i]);
}

constexpr std::ptrdiff_t blocksOfOneTask = 1 << 15;

// Adds a row of voxels to the sums of its columns, in double: the mean of equal floats is that float.
void AddColumns(const float* value, const unsigned char* inside, int count, double* __restrict sum, double* __restrict square,
                double* __restrict counted)
{
  for (int i = 0; i < count; ++i) {
    const double here = inside[i] != 0 ? 1.0 : 0.0, own = static_cast<double>(inside[i] != 0 ? value[i] : 0.0f);
    sum[i] += own;
    square[i] += own * own;
    counted[i] += here;
  }
}

} // namespace

BlockLattice BlocksOf(const ImageGeometry& grid, double scale)
{
  BlockLattice blocks;
  blocks.geometry = grid;
  Eigen::Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    const int count = grid.dimensions[axis];
    const double voxels = scale * grid.spacing.minCoeff() / grid.spacing[axis];
    blocks.size[axis] = std::min(count, std::max(1, static_cast<int>(std::round(voxels))));
    blocks.geometry.dimensions[axis] = (count + blocks.size[axis] - 1) / blocks.size[axis];
    blocks.geometry.spacing[axis] *= blocks.size[axis];
    middle[axis] = 0.5 * (blocks.size[axis] - 1);
  }
  blocks.geometry.origin = grid.IndexToWorld() * middle;
  return blocks;
}

SmoothPart LowPass(const StitchSampler& volume, const BlockLattice& blocks, const CoverageMap& coverage, int step,
                   const Progress& progress, const Boxed<unsigned char>* mask)
{
  const GridBox& own = volume.Box();
  SmoothPart part;
  Boxed<float>& low = part.low;
  if (own.Empty())
    return part;
  for (int axis = 0; axis < 3; ++axis) {
    low.box.first[axis] = std::max(0, own.first[axis] / blocks.size[axis] - 1);
    const int last = (own.first[axis] + own.size[axis] - 1) / blocks.size[axis];
    low.box.size[axis] = std::min(blocks.geometry.dimensions[axis], last + 2) - low.box.first[axis];
  }
  low.values = Volume<float>(low.box.size, nothing);
  part.deviation = low;
  const std::ptrdiff_t rows = static_cast<std::ptrdiff_t>(low.box.size[1]) * low.box.size[2];
  ParallelRanges(rows, 1, progress, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    const std::size_t count = static_cast<std::size_t>(own.size[0]);
    std::vector<unsigned char> inside(count), shared(count);
    const auto column = [&](int i) { return std::min(i / step, coverage.Dimensions()[0] - 1); };
    const int start = column(own.first[0]);
    std::vector<unsigned char> covered(static_cast<std::size_t>(column(own.first[0] + own.size[0] - 1) - start + 1));
    std::vector<float> values(count);
    std::vector<double> sums(count), squares(count), counts(count); // of the columns of a row of blocks
    for (std::ptrdiff_t row = begin; row < end; ++row) {
      const int bj = low.box.first[1] + static_cast<int>(row % low.box.size[1]);
      const int bk = low.box.first[2] + static_cast<int>(row / low.box.size[1]);
      std::fill(sums.begin(), sums.end(), 0.0);
      std::fill(squares.begin(), squares.end(), 0.0);
      std::fill(counts.begin(), counts.end(), 0.0);
      bool any = false;
      const auto last = [&](int block, int axis) {
        return std::min((block + 1) * blocks.size[axis], own.first[axis] + own.size[axis]);
      };
      for (int k = std::max(bk * blocks.size[2], own.first[2]); k < last(bk, 2); ++k)
        for (int j = std::max(bj * blocks.size[1], own.first[1]); j < last(bj, 1); ++j) {
          coverage.Copy(start, std::min(j / step, coverage.Dimensions()[1] - 1), std::min(k / step, coverage.Dimensions()[2] - 1),
                        static_cast<int>(covered.size()), covered.data());
          if (!SharedRow(covered, own.first[0], step, shared))
            continue;
          if (mask)
            std::copy_n(mask->Row(j, k), count, inside.begin());
          else
            volume.Inside(j, k, inside.data());
          KeepShared(shared.data(), own.size[0], inside.data());
          if (!std::memchr(inside.data(), 1, count))
            continue;
          any = true;
          volume.Values(j, k, inside.data(), values.data());
          AddColumns(values.data(), inside.data(), own.size[0], sums.data(), squares.data(), counts.data());
        }
      if (!any)
        continue;
      float *const mean = low.Row(bj, bk), *const square = part.deviation.Row(bj, bk);
      for (int b = 0; b < low.box.size[0]; ++b) {
        const int block = low.box.first[0] + b;
        double sum = 0.0, ofSquares = 0.0, voxels = 0.0;
        for (int i = std::max(block * blocks.size[0], own.first[0]) - own.first[0]; i < last(block, 0) - own.first[0]; ++i) {
          sum += sums[i];
          ofSquares += squares[i];
          voxels += counts[i];
        }
        if (voxels > 0.0) {
          const double average = sum / voxels, variance = ofSquares / voxels - average * average;
          mean[b] = static_cast<float>(average);
          square[b] = static_cast<float>(variance > noDeviation * average * average ? variance : 0.0);
        }
      }
    }
  });
  const Volume<float> means = low.values;
  Smooth(low.values);
  // Around the smooth part, not around the means: what the filter took from these belongs to the details.
  const auto square = part.deviation.values.View();
  ParallelRanges(square.Size(), blocksOfOneTask, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    AddSquaredDifferences(&means.View()[begin], &low.values.View()[begin], end - begin, &square[begin]);
  });
  for (int round = 0; round < deviationRounds; ++round)
    Smooth(part.deviation.values);
  ParallelRanges(square.Size(), blocksOfOneTask, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::transform(&square[begin], &square[begin] + (end - begin), &square[begin], [](float value) { return std::sqrt(value); });
  });
  return part;
}

} // namespace echorama
