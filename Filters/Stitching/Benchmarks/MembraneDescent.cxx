// SPDX-License-Identifier: BSD-3-Clause
// Level l sees every 2^l-th voxel along each axis: regions are sampled, not averaged, so that pure and empty stay what they are.
// A level takes the result of the coarser one by trilinear interpolation, clamped to what lies strictly between the known
// values, puts its own known voxels back, and walks along the gradient with exact steps: for a step of length a along g the
// energy falls by 2 a (g, g) - a^2 (g, A g), most at a = (g, g) / (g, A g). It ends when a step lowers the energy too little.
// Each step is three passes over the box. Smooth errors hardly change: the time to a small error grows with the square of
// the width, which is what the coarse levels are for, and what their sampled borders bring back in.
#include "Filters/Stitching/Benchmarks/MembraneDescent.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Filters/Stitching/MembraneLanes.h"
#include <algorithm>
#include <chrono>
#include <cmath>

namespace echorama {
namespace {

constexpr auto Unknown = static_cast<unsigned char>(MembraneVoxel::Unknown);
constexpr auto Void = static_cast<unsigned char>(MembraneVoxel::Void);

// A box of voxels, x fastest, with a border of one void voxel on all sides.
struct DescentGrid {
  std::array<int, 3> size{0, 0, 0}; // without the border
  std::vector<unsigned char> kinds;
  std::vector<float> values;

  DescentGrid() = default;
  explicit DescentGrid(std::array<int, 3> extent) : size(extent)
  {
    const auto voxels = static_cast<std::size_t>(Stride(2) * (size[2] + 2));
    kinds.assign(voxels, Void);
    values.assign(voxels, 0.0f);
  }
  std::ptrdiff_t Stride(int axis) const
  {
    const std::ptrdiff_t row = size[0] + 2;
    return axis == 0 ? 1 : axis == 1 ? row : row * (size[1] + 2);
  }
  std::size_t At(int i, int j, int k) const
  {
    return static_cast<std::size_t>((k + 1) * Stride(2) + (j + 1) * Stride(1) + i + 1);
  }
};

// g := minus half the gradient of the energy at the unknowns of a row; returns its square.
double GradientRow(const float* u, const unsigned char* kinds, std::ptrdiff_t row, std::ptrdiff_t slice, float wx, float wy,
                   float wz, int count, float* __restrict g)
{
  float sums[MembraneByteLanes] = {};
  ForLanes<MembraneByteLanes>(
      0, count, [&](int i, int l, float fresh) __attribute__((always_inline)) {
        const auto pull = [&](std::ptrdiff_t there) __attribute__((always_inline))
        {
          return static_cast<float>(kinds[i + there] != Void ? 1 : 0) * (u[i + there] - u[i]);
        };
        const float sum = wx * (pull(-1) + pull(1)) + wy * (pull(-row) + pull(row)) + wz * (pull(-slice) + pull(slice));
        const float value = static_cast<float>(kinds[i] == Unknown ? 1 : 0) * sum;
        g[i] = value;
        sums[l] += fresh * value * value;
      });
  double sum = 0.0;
  for (const float part : sums)
    sum += static_cast<double>(part);
  return sum;
}

// (g, A g) of a row.
double CurvatureRow(const float* g, const unsigned char* kinds, std::ptrdiff_t row, std::ptrdiff_t slice, float wx, float wy,
                    float wz, int count)
{
  float sums[MembraneByteLanes] = {};
  ForLanes<MembraneByteLanes>(
      0, count, [&](int i, int l, float fresh) __attribute__((always_inline)) {
        const auto push = [&](std::ptrdiff_t there) __attribute__((always_inline))
        {
          return static_cast<float>(kinds[i + there] != Void ? 1 : 0) * (g[i] - g[i + there]);
        };
        const float sum = wx * (push(-1) + push(1)) + wy * (push(-row) + push(row)) + wz * (push(-slice) + push(slice));
        sums[l] += fresh * g[i] * sum;
      });
  double sum = 0.0;
  for (const float part : sums)
    sum += static_cast<double>(part);
  return sum;
}

void StepRow(float* u, const float* g, float length, int count)
{
  for (int i = 0; i < count; ++i)
    u[i] += length * g[i];
}

template <class Map>
double SumOfRows(const DescentGrid& grid, const Map& map)
{
  return ParallelSum<double>(grid.size[2], std::max<std::ptrdiff_t>(1, 32768 / grid.Stride(2)),
                             [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
                               double sum = 0.0;
                               for (int k = static_cast<int>(begin); k < static_cast<int>(end); ++k)
                                 for (int j = 0; j < grid.size[1]; ++j)
                                   sum += map(grid.At(0, j, k));
                               return sum;
                             });
}

// The sum of squared differences over faces that an unknown takes part in.
double Energy(const DescentGrid& grid, const std::array<float, 3>& weights)
{
  return SumOfRows(grid, [&](std::size_t start) {
    double sum = 0.0;
    for (std::size_t at = start; at < start + static_cast<std::size_t>(grid.size[0]); ++at)
      for (int axis = 0; axis < 3; ++axis) {
        const std::size_t other = at - static_cast<std::size_t>(grid.Stride(axis));
        const unsigned char a = grid.kinds[at], b = grid.kinds[other];
        if (a != Void && b != Void && (a == Unknown || b == Unknown)) {
          const double difference = static_cast<double>(grid.values[at]) - static_cast<double>(grid.values[other]);
          sum += static_cast<double>(weights[static_cast<std::size_t>(axis)]) * difference * difference;
        }
      }
    return sum;
  });
}

// Every factor-th voxel.
DescentGrid Sampled(const DescentGrid& grid, int factor)
{
  std::array<int, 3> size;
  for (std::size_t axis = 0; axis < 3; ++axis)
    size[axis] = (grid.size[axis] - 1) / factor + 1;
  DescentGrid coarse(size);
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) {
        const std::size_t to = coarse.At(i, j, k), from = grid.At(i * factor, j * factor, k * factor);
        coarse.kinds[to] = grid.kinds[from];
        coarse.values[to] = grid.values[from];
      }
  return coarse;
}

// The unknowns' first values: those of the coarser level, linearly between its voxels that are not void.
void Interpolate(const DescentGrid& coarse, DescentGrid& fine)
{
  ParallelFor(fine.size[2], [&](std::ptrdiff_t k) {
    for (int j = 0; j < fine.size[1]; ++j)
      for (int i = 0; i < fine.size[0]; ++i) {
        const std::size_t at = fine.At(i, j, static_cast<int>(k));
        if (fine.kinds[at] != Unknown)
          continue;
        float sum = 0.0f, total = 0.0f;
        const int here[3] = {i, j, static_cast<int>(k)};
        for (int corner = 0; corner < 8; ++corner) {
          int cell[3];
          float weight = 1.0f;
          for (int axis = 0; axis < 3; ++axis) {
            const bool upper = (corner >> axis & 1) != 0;
            cell[axis] = here[axis] / 2 + (upper ? 1 : 0);
            weight *= here[axis] % 2 ? 0.5f : upper ? 0.0f : 1.0f;
          }
          const std::size_t from = coarse.At(cell[0], cell[1], cell[2]); // may be in the border, which is void
          if (weight > 0.0f && coarse.kinds[from] != Void) {
            sum += weight * coarse.values[from];
            total += weight;
          }
        }
        fine.values[at] = total > 0.0f ? std::clamp(sum / total, 1e-6f, 1.0f - 1e-6f) : 0.5f;
      }
  });
}

DescentReport Descend(DescentGrid& grid, const std::array<float, 3>& weights, const DescentParameters& parameters)
{
  DescentReport report;
  const auto start = std::chrono::steady_clock::now();
  const auto seconds = [start] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  const auto dimension = std::count_if(grid.size.begin(), grid.size.end(), [](int extent) { return extent > 1; });
  DescentGrid coarser;
  for (int number = parameters.levels - 1; number >= 0; --number) {
    DescentGrid sampled = number > 0 ? Sampled(grid, 1 << number) : DescentGrid();
    DescentGrid& level = number > 0 ? sampled : grid;
    if (coarser.values.empty()) {
      for (std::size_t at = 0; at < level.values.size(); ++at)
        if (level.kinds[at] == Unknown)
          level.values[at] = 0.5f;
    } else {
      Interpolate(coarser, level);
    }
    const std::ptrdiff_t row = level.Stride(1), slice = level.Stride(2);
    const int count = level.size[0];
    const auto gradientOf = [&](std::vector<float>& g) {
      return SumOfRows(level, [&](std::size_t at) {
        return GradientRow(level.values.data() + at, level.kinds.data() + at, row, slice, weights[0], weights[1], weights[2],
                           count, g.data() + at);
      });
    };
    const double scale = std::pow(static_cast<double>(1 << number), static_cast<double>(dimension - 2)); // eq. 5.9
    double energy = scale * Energy(level, weights);
    const double small = 0.01 * energy; // a level whose samples miss one kind of known voxel falls to nothing
    std::vector<float> gradient(level.values.size(), 0.0f);
    while (seconds() < parameters.maximumSeconds) {
      const double square = gradientOf(gradient);
      const double curvature = SumOfRows(level, [&](std::size_t at) {
        return CurvatureRow(gradient.data() + at, level.kinds.data() + at, row, slice, weights[0], weights[1], weights[2], count);
      });
      if (!(curvature > 0.0) || !(square > 0.0))
        break;
      const float length = static_cast<float>(square / curvature);
      SumOfRows(level, [&](std::size_t at) {
        StepRow(level.values.data() + at, gradient.data() + at, length, count);
        return 0.0;
      });
      ++report.steps;
      const double fall = scale * square * square / curvature;
      energy -= fall;
      if (parameters.trace)
        report.trace.push_back({seconds(), energy, number});
      if (!(energy > 0.0) || fall <= parameters.stop * std::max(energy, small))
        break;
    }
    if (number > 0)
      coarser = std::move(sampled);
  }
  return report;
}

} // namespace

DescentReport DescendMembrane(const RowField<unsigned char>& kinds, const Eigen::Vector3d& spacing, RowField<float>& values,
                              const DescentParameters& parameters)
{
  if (parameters.levels < 1 || parameters.levels > 8 || !(parameters.stop > 0.0 && parameters.stop < 1.0))
    throw Error(Error::Kind::InvalidParameter, "descent: 1 to 8 levels, and a stop between 0 and 1");
  const auto start = std::chrono::steady_clock::now();
  const GridBox& box = kinds.spans->Box();
  DescentGrid grid(box.size);
  const auto forRows = [&](const auto& body) {
    for (int k = box.first[2]; k < box.first[2] + box.size[2]; ++k)
      for (int j = box.first[1]; j < box.first[1] + box.size[1]; ++j)
        if (const int first = kinds.spans->First(j, k), count = kinds.spans->End(j, k) - first; count > 0)
          body(grid.At(first - box.first[0], j - box.first[1], k - box.first[2]), kinds.Row(j, k), values.Row(j, k), count);
  };
  forRows([&](std::size_t at, const unsigned char* kind, const float* value, int count) {
    for (int i = 0; i < count; ++i, ++at) {
      grid.kinds[at] = kind[i];
      grid.values[at] = kind[i] == static_cast<unsigned char>(MembraneVoxel::Known) ? value[i] : 0.0f;
    }
  });
  const Eigen::Array3f weights = (spacing.minCoeff() / spacing.array()).square().cast<float>();
  DescentReport report = Descend(grid, {weights[0], weights[1], weights[2]}, parameters);
  forRows([&](std::size_t at, const unsigned char* kind, float* value, int count) {
    for (int i = 0; i < count; ++i, ++at)
      if (kind[i] == Unknown)
        value[i] = grid.values[at];
  });
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return report;
}

} // namespace echorama
