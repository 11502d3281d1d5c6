// SPDX-License-Identifier: BSD-3-Clause
// Most voxels that were not seen are nowhere near one that was. For each slice, what was seen in the slices around, at most
// "reach" away, is laid over each other: ORs over rows of bytes. Running counts over its rows then say for each row what was seen
// in the rows around, so that a voxel costs 2 reach + 3 such steps. Only near what was seen are the 13 lines tried. Seen voxels
// are read and others written, so slices are independent.
#include "HoleFilling.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/RoundedVoxel.h"
#include "Core/Imaging/VoxelTypes.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace echorama {

namespace {

constexpr int longestReach = 100; // voxels
constexpr int lines[13][3] = {{1, 0, 0}, {0, 1, 0},  {0, 0, 1}, {1, 1, 0},  {1, -1, 0}, {1, 0, 1}, {1, 0, -1},
                              {0, 1, 1}, {0, 1, -1}, {1, 1, 1}, {-1, 1, 1}, {1, -1, 1}, {1, 1, -1}};

// How the narrowest gap at a voxel is bridged.
struct Bridge {
  int gap = 0;      // voxels between the ends, 0: there is none
  double sum = 0.0; // of the values interpolated along the shortest lines
  int count = 0;    // how many lines are as short
};

template <class T>
class Holes {
public:
  Holes(VolumeView<const T> intensity, VolumeView<const unsigned short> coverage, int reach)
    : intensity_(intensity), coverage_(coverage), reach_(reach)
  {
  }

  Bridge At(int i, int j, int k) const
  {
    Bridge bridge;
    double shortest = std::numeric_limits<double>::infinity();
    int narrowest = reach_ + 1;
    for (const auto& line : lines) {
      const int ahead = Walk(i, j, k, line, 1, reach_);
      if (!ahead)
        continue;
      const int back = Walk(i, j, k, line, -1, reach_ + 1 - ahead);
      if (!back)
        continue;
      narrowest = std::min(narrowest, ahead + back - 1);
      const int steps = line[0] * line[0] + line[1] * line[1] + line[2] * line[2];
      // The ends count with one more step, as in Plus: a line of n voxels is n steps long.
      const double length = (ahead + back + 1) * std::sqrt(static_cast<double>(steps));
      if (length > shortest)
        continue;
      if (length < shortest) {
        shortest = length;
        bridge.sum = 0.0;
        bridge.count = 0;
      }
      const double share = (back + 1.0) / (ahead + back + 1.0);
      bridge.sum += share * Value(i, j, k, line, ahead) + (1.0 - share) * Value(i, j, k, line, -back);
      ++bridge.count;
    }
    bridge.gap = bridge.count ? narrowest : 0;
    return bridge;
  }

  double MeanAround(int i, int j, int k, int half) const
  {
    const auto& n = coverage_.Dimensions();
    double sum = 0.0;
    int count = 0;
    for (int z = std::max(0, k - half); z <= std::min(n[2] - 1, k + half); ++z)
      for (int y = std::max(0, j - half); y <= std::min(n[1] - 1, j + half); ++y)
        for (int x = std::max(0, i - half); x <= std::min(n[0] - 1, i + half); ++x)
          if (coverage_(x, y, z)) {
            sum += static_cast<double>(intensity_(x, y, z));
            ++count;
          }
    return sum / count; // the ends of the bridge are in the cube
  }

private:
  // Steps to the first voxel that was seen, 0 when there is none within "most".
  int Walk(int i, int j, int k, const int* line, int sign, int most) const
  {
    const auto& n = coverage_.Dimensions();
    for (int step = 1; step <= most; ++step) {
      const int x = i + sign * step * line[0], y = j + sign * step * line[1], z = k + sign * step * line[2];
      if (x < 0 || y < 0 || z < 0 || x >= n[0] || y >= n[1] || z >= n[2])
        return 0;
      if (coverage_(x, y, z))
        return step;
    }
    return 0;
  }

  double Value(int i, int j, int k, const int* line, int step) const
  {
    return static_cast<double>(intensity_(i + step * line[0], j + step * line[1], k + step * line[2]));
  }

  VolumeView<const T> intensity_;
  VolumeView<const unsigned short> coverage_;
  int reach_;
};

} // namespace

ParameterList Describe(HoleFillingParameters& p)
{
  return {
      Parameter("Holes", Choice(p.method, {"none", "mean-around", "stick"}),
                "How voxels are filled that were not seen but lie between others that were: not at all; by the mean of the "
                "smallest cube that reaches across; or by linear interpolation along the shortest line across."),
      Parameter("HoleReach", p.reach, {1, longestReach}, "voxels",
                "The widest gap that is filled, along one of 13 lines. 1: single voxels.")
          .When("Holes", "mean-around")
          .When("Holes", "stick"),
  };
}

template <class T>
std::size_t FillHoles(const HoleFillingParameters& parameters, VolumeView<T> intensity, VolumeView<unsigned char> valid,
                      VolumeView<const unsigned short> coverage, const Progress& progress)
{
  CheckRanges(parameters);
  const int reach = parameters.reach;
  const auto& n = coverage.Dimensions();
  const Holes<T> holes(intensity, coverage, reach);
  std::vector<std::size_t> filled(static_cast<std::size_t>(n[2]), 0);
  ParallelFor(n[2], progress, [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    const std::size_t width = static_cast<std::size_t>(n[0]);
    std::vector<unsigned char> layers; // whether any slice around has seen a voxel
    std::vector<int> around(width, 0); // of how many rows around in "layers"
    const auto count = [&](int row, int sign) {
      const unsigned char* layer = layers.data() + static_cast<std::size_t>(row) * width;
      for (std::size_t i = 0; i < width; ++i)
        around[i] += sign * layer[i];
    };
    if (parameters.method != HoleFilling::Nothing) {
      layers.assign(width * static_cast<std::size_t>(n[1]), 0);
      for (int z = std::max(0, k - reach); z <= std::min(n[2] - 1, k + reach); ++z) {
        for (int y = 0; y < n[1]; ++y) {
          const unsigned short* seen = coverage.Row(y, z);
          unsigned char* layer = layers.data() + static_cast<std::size_t>(y) * width;
          for (std::size_t i = 0; i < width; ++i)
            layer[i] = static_cast<unsigned char>(layer[i] | (seen[i] != 0));
        }
      }
      for (int y = 0; y < std::min(reach, n[1]); ++y)
        count(y, 1);
    }
    for (int j = 0; j < n[1]; ++j) {
      const unsigned short* own = coverage.Row(j, k);
      T* values = intensity.Row(j, k);
      unsigned char* real = valid.Row(j, k);
      for (int i = 0; i < n[0]; ++i) {
        if (!own[i]) { // others may read what was seen at this moment
          real[i] = 0;
          values[i] = T(0);
        }
      }
      if (parameters.method == HoleFilling::Nothing)
        continue;
      if (j + reach < n[1])
        count(j + reach, 1);
      if (j - reach > 0)
        count(j - reach - 1, -1);
      int last = std::numeric_limits<int>::min() / 2, next = 0; // voxels of "around" that are set, at or before and at or after i
      for (int i = 0; i < n[0]; ++i) {
        if (around[static_cast<std::size_t>(i)])
          last = i;
        next = std::max(next, i);
        while (next < n[0] && !around[static_cast<std::size_t>(next)])
          ++next;
        if (own[i] || (i - last > reach && (next == n[0] || next - i > reach)))
          continue;
        const Bridge bridge = holes.At(i, j, k);
        if (!bridge.gap)
          continue;
        values[i] = RoundedVoxel<T>(parameters.method == HoleFilling::Stick ? bridge.sum / bridge.count
                                                                            : holes.MeanAround(i, j, k, (bridge.gap + 2) / 2));
        real[i] = 1;
        ++filled[static_cast<std::size_t>(k)];
      }
    }
  });
  std::size_t sum = 0;
  for (const std::size_t count : filled)
    sum += count;
  return sum;
}

#define EchoramaInstantiate(T)                                                                                                   \
  template std::size_t FillHoles<T>(const HoleFillingParameters&, VolumeView<T>, VolumeView<unsigned char>,                      \
                                    VolumeView<const unsigned short>, const Progress&);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
