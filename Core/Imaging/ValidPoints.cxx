// SPDX-License-Identifier: BSD-3-Clause
// A point is drawn by its rank among the real voxels: real voxels are counted per row once, a rank then leads to its row
// by binary search and to its voxel by a walk along that row. No list of voxels is kept. Ranks are sorted before the
// walk; the position within the cell comes from the point's own stream of random numbers.
#include "Core/Imaging/ValidPoints.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Imaging/Sampling.h"
#include "Core/Imaging/VoxelTypes.h"
#include <algorithm>

namespace echorama {

template <class T>
std::vector<Eigen::Vector3d> ValidPoints(VolumeView<const T> intensity, VolumeView<const unsigned char> valid, int count,
                                         std::uint64_t seed)
{
  const Sampler<T> sampler(intensity, valid);
  const auto& n = intensity.Dimensions();
  const std::ptrdiff_t rows = static_cast<std::ptrdiff_t>(n[1]) * n[2];
  std::vector<std::uint64_t> before(static_cast<std::size_t>(rows) + 1, 0); // real voxels in the rows before this one
  ParallelFor(n[2], [&](std::ptrdiff_t k) {
    for (std::ptrdiff_t row = k * n[1]; row < (k + 1) * n[1]; ++row) {
      std::uint64_t real = 0;
      for (std::ptrdiff_t i = row * n[0]; i < (row + 1) * n[0]; ++i)
        real += sampler.IsReal(i);
      before[static_cast<std::size_t>(row) + 1] = real;
    }
  });
  for (std::size_t row = 1; row < before.size(); ++row)
    before[row] += before[row - 1];
  if (before.back() == 0 || count <= 0)
    return {};

  std::vector<std::uint64_t> ranks(static_cast<std::size_t>(count));
  Random random(seed);
  for (std::uint64_t& rank : ranks)
    rank = random.Below(before.back());
  std::sort(ranks.begin(), ranks.end());

  std::vector<Eigen::Vector3d> points(ranks.size());
  for (std::size_t p = 0; p < ranks.size(); ++p) {
    const auto row = std::upper_bound(before.begin(), before.end(), ranks[p]) - before.begin() - 1;
    std::uint64_t left = ranks[p] - before[static_cast<std::size_t>(row)];
    std::ptrdiff_t i = 0;
    while (!sampler.IsReal(row * n[0] + i) || left-- > 0)
      ++i;
    Random within(seed, p + 1);
    points[p] = Eigen::Vector3d(static_cast<double>(i), static_cast<double>(row % n[1]), static_cast<double>(row / n[1]));
    for (int axis = 0; axis < 3; ++axis)
      if (n[axis] > 1) // in [-1/2, 1/2): the cell of the voxel, whose upper faces belong to the next
        points[p][axis] += within.Uniform() - 0.5;
  }
  return points;
}

template <class T>
Eigen::Vector3d ValidCentroid(VolumeView<const T> intensity, VolumeView<const unsigned char> valid, std::ptrdiff_t& count)
{
  struct Sums {
    double x = 0.0, y = 0.0, z = 0.0;
    std::ptrdiff_t count = 0;
    void operator+=(const Sums& s)
    {
      x += s.x;
      y += s.y;
      z += s.z;
      count += s.count;
    }
  };
  const Sampler<T> sampler(intensity, valid);
  const auto& n = intensity.Dimensions();
  const Sums sums =
      ParallelSum<Sums>(static_cast<std::ptrdiff_t>(n[1]) * n[2], n[1], [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
        Sums part;
        for (std::ptrdiff_t row = begin; row < end; ++row) {
          Sums line;
          for (int i = 0; i < n[0]; ++i)
            if (sampler.IsReal(row * n[0] + i)) {
              line.x += i;
              ++line.count;
            }
          line.y = static_cast<double>(row % n[1]) * static_cast<double>(line.count);
          line.z = static_cast<double>(row / n[1]) * static_cast<double>(line.count);
          part += line;
        }
        return part;
      });
  count = sums.count;
  return sums.count > 0 ? Eigen::Vector3d(Eigen::Vector3d(sums.x, sums.y, sums.z) / static_cast<double>(sums.count))
                        : Eigen::Vector3d(Eigen::Vector3d::Zero());
}

#define EchoramaInstantiate(T)                                                                                                   \
  template std::vector<Eigen::Vector3d> ValidPoints<T>(VolumeView<const T>, VolumeView<const unsigned char>, int,                \
                                                       std::uint64_t);                                                           \
  template Eigen::Vector3d ValidCentroid<T>(VolumeView<const T>, VolumeView<const unsigned char>, std::ptrdiff_t&);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
