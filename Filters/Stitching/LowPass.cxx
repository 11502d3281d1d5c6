// SPDX-License-Identifier: BSD-3-Clause
// Where two speckle patterns meet, what is smooth and what is texture are blended apart. The smooth part needs no fine
// lattice. All volumes are averaged over the same blocks of the output: a lattice of each volume's own would be cheaper, but
// what aliases would differ from volume to volume, and a place that all see alike would not come out as it is.
#include "LowPass.h"
#include "Core/Base/Multiversion.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace echorama {

namespace {

// Binomial filters over the squares: so many that the deviation of a texture is known to some per cent.
constexpr int deviationRounds = 4;

constexpr float nothing = std::numeric_limits<float>::quiet_NaN();

// (1 2 1) / 4; a neighbour that is not there is taken to be as the block itself, and a block that is not there becomes the
// mean of those of its neighbours that are.
ECHORAMA_HOT void SmoothRow(const float* before, const float* at, const float* behind, int count, float* __restrict to)
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

SmoothPart LowPass(const StitchSampler& volume, const BlockLattice& blocks, VolumeView<const unsigned char> coverage, int step,
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
    const std::size_t count = static_cast<std::size_t>(own.size[0]), across = static_cast<std::size_t>(low.box.size[0]);
    std::vector<unsigned char> inside(count);
    std::vector<float> values(count);
    std::vector<double> sums(across), squares(across), bases(across);
    std::vector<int> counts(across), blockOf(count);
    for (int i = 0; i < own.size[0]; ++i)
      blockOf[static_cast<std::size_t>(i)] = (own.first[0] + i) / blocks.size[0] - low.box.first[0];
    for (std::ptrdiff_t row = begin; row < end; ++row) {
      const int bj = low.box.first[1] + static_cast<int>(row % low.box.size[1]);
      const int bk = low.box.first[2] + static_cast<int>(row / low.box.size[1]);
      std::fill(sums.begin(), sums.end(), 0.0);
      std::fill(squares.begin(), squares.end(), 0.0);
      std::fill(counts.begin(), counts.end(), 0);
      const auto last = [&](int block, int axis) {
        return std::min((block + 1) * blocks.size[axis], own.first[axis] + own.size[axis]);
      };
      for (int k = std::max(bk * blocks.size[2], own.first[2]); k < last(bk, 2); ++k)
        for (int j = std::max(bj * blocks.size[1], own.first[1]); j < last(bj, 1); ++j) {
          const unsigned char* covered =
              coverage.Row(std::min(j / step, coverage.Dimensions()[1] - 1), std::min(k / step, coverage.Dimensions()[2] - 1));
          const auto shared = [&](int i) {
            return covered[step == 1 ? i : std::min(i / step, coverage.Dimensions()[0] - 1)] > 1;
          };
          int from = 0, to = own.size[0];
          while (from < to && !shared(own.first[0] + from))
            ++from;
          while (to > from && !shared(own.first[0] + to - 1))
            --to;
          if (from == to)
            continue;
          if (mask)
            std::copy_n(mask->Row(j, k), count, inside.begin());
          else
            volume.Inside(j, k, inside.data());
          for (int i = 0; i < own.size[0]; ++i)
            inside[i] = static_cast<unsigned char>(inside[i] & 1 & (i >= from && i < to && shared(own.first[0] + i)));
          volume.Values(j, k, inside.data(), values.data());
          for (int i = from; i < to; ++i) {
            if (!inside[i])
              continue;
            const int b = blockOf[static_cast<std::size_t>(i)];
            // Differences from the first: the mean of equal values is that value.
            if (counts[b]++ == 0)
              bases[b] = static_cast<double>(values[i]);
            const double above = static_cast<double>(values[i]) - bases[b];
            sums[b] += above;
            squares[b] += above * above;
          }
        }
      float *const mean = low.Row(bj, bk), *const square = part.deviation.Row(bj, bk);
      for (std::size_t b = 0; b < across; ++b)
        if (counts[b] > 0) {
          const double above = sums[b] / counts[b];
          mean[b] = static_cast<float>(bases[b] + above);
          square[b] = static_cast<float>(std::max(0.0, squares[b] / counts[b] - above * above));
        }
    }
  });
  const Volume<float> means = low.values;
  Smooth(low.values);
  // Around the smooth part, not around the means: what the filter took from these belongs to the details.
  auto square = part.deviation.values.View();
  for (std::ptrdiff_t block = 0; block < square.Size(); ++block) {
    const float beside = means.View()[block] - low.values.View()[block];
    square[block] += beside * beside;
  }
  for (int round = 0; round < deviationRounds; ++round)
    Smooth(part.deviation.values);
  for (float& value : square)
    value = std::sqrt(value);
  return part;
}

} // namespace echorama
