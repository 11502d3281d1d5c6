// SPDX-License-Identifier: BSD-3-Clause
//
// One axis after the other, as the distance map of Core: y by counting steps, then the least sum of what a row has and the square
// of some steps along x, then along z. No more steps are taken than the radius is long, so nothing is searched. Equal spacings
// are worked in voxels.
#include "NearDistance.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/DistanceMap.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace echorama {

namespace {

constexpr int farthest = 12; // steps; where the radius is more a search is faster
constexpr float beyondReach = std::numeric_limits<float>::infinity();

void CountUp(const unsigned char* __restrict mask, int count, float* __restrict steps)
{
  for (int i = 0; i < count; ++i)
    steps[i] = mask[i] != 0 ? 0.0f : steps[i] + 1.0f;
}

void CountDown(const float* __restrict forth, int count, double square, float* __restrict steps, float* __restrict out)
{
  for (int i = 0; i < count; ++i) {
    const float back = steps[i] + 1.0f, nearest = forth[i] < back ? forth[i] : back;
    steps[i] = nearest;
    out[i] = static_cast<float>(square * (static_cast<double>(nearest) * static_cast<double>(nearest)));
  }
}

// The least of what lies up to \a reach rows of \a step numbers before and after, each with the square of its distance.
void TakeNearest(const float* middle, std::ptrdiff_t step, const float* squares, int reach, int count, float* __restrict out)
{
  for (int i = 0; i < count; ++i)
    out[i] = middle[i];
  for (int d = 1; d <= reach; ++d) {
    const float *before = middle - d * step, *after = middle + d * step, square = squares[d];
    for (int i = 0; i < count; ++i) {
      const float nearer = (before[i] < after[i] ? before[i] : after[i]) + square;
      out[i] = nearer < out[i] ? nearer : out[i];
    }
  }
}

} // namespace

void NearSquaredDistances(VolumeView<const unsigned char> mask, const Eigen::Vector3d& spacing, double radiusMm,
                          VolumeView<float> squaredDistance, const Progress& progress)
{
  const auto& n = mask.Dimensions();
  Eigen::Vector3d s = Eigen::Vector3d::Ones();
  bool equal = true, few = true;
  double first = 0.0;
  std::array<int, 3> reach{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double mm = spacing[static_cast<Eigen::Index>(axis)];
    few = few && radiusMm < (farthest - 1) * mm; // not so either where the spacing is no number
    if (!few)
      break;
    if (n[axis] == 1)
      continue;
    equal = equal && (first == 0.0 || mm == first);
    first = first == 0.0 ? mm : first;
    reach[axis] = std::min(static_cast<int>(radiusMm / mm) + 1, n[axis] - 1);
  }
  if (!few || mask.Size() == 0 || squaredDistance.Dimensions() != n) {
    SquaredDistanceMap(mask, spacing, squaredDistance, progress);
    return;
  }
  if (!equal)
    s = spacing;
  const double scale = equal && first > 0.0 ? first * first : 1.0;
  const auto squaresOf = [&](Eigen::Index axis) {
    std::vector<float> squares(farthest + 1);
    for (std::size_t d = 0; d < squares.size(); ++d)
      squares[d] = static_cast<float>((s[axis] * static_cast<double>(d)) * (s[axis] * static_cast<double>(d)));
    return squares;
  };

  const std::vector<float> alongX = squaresOf(0), alongZ = squaresOf(2);
  ParallelFor(n[2], progress.Part(0.0, 0.5), [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    const std::size_t row = static_cast<std::size_t>(n[0]);
    std::vector<float> forth(row * static_cast<std::size_t>(n[1])), steps(row, beyondReach);
    std::vector<float> padded(row + 2 * static_cast<std::size_t>(reach[0]), beyondReach);
    for (int j = 0; j < n[1]; ++j) {
      CountUp(mask.Row(j, k), n[0], steps.data());
      std::copy(steps.begin(), steps.end(), forth.begin() + static_cast<std::ptrdiff_t>(row) * j);
    }
    std::fill(steps.begin(), steps.end(), beyondReach);
    float* const along = padded.data() + reach[0];
    for (int j = n[1] - 1; j >= 0; --j) {
      CountDown(forth.data() + static_cast<std::ptrdiff_t>(row) * j, n[0], s[1] * s[1], steps.data(), along);
      TakeNearest(along, 1, alongX.data(), reach[0], n[0], squaredDistance.Row(j, k));
    }
  });

  constexpr int width = 128;
  ParallelFor(n[1], progress.Part(0.5, 1.0), [&](std::ptrdiff_t row) {
    const int j = static_cast<int>(row);
    std::vector<float> strip(static_cast<std::size_t>(n[2] + 2 * reach[2]) * width, beyondReach);
    float* const middle = strip.data() + static_cast<std::ptrdiff_t>(reach[2]) * width;
    for (int i = 0; i < n[0]; i += width) {
      const int count = std::min(width, n[0] - i);
      for (int k = 0; k < n[2]; ++k)
        std::copy_n(squaredDistance.Row(j, k) + i, count, middle + static_cast<std::ptrdiff_t>(k) * width);
      for (int k = 0; k < n[2]; ++k) {
        float* const out = squaredDistance.Row(j, k) + i;
        TakeNearest(middle + static_cast<std::ptrdiff_t>(k) * width, width, alongZ.data(), reach[2], count, out);
        if (scale != 1.0)
          for (int l = 0; l < count; ++l)
            out[l] = static_cast<float>(scale * static_cast<double>(out[l]));
      }
    }
  });
}

} // namespace echorama
