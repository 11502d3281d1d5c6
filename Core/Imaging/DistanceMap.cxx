// SPDX-License-Identifier: BSD-3-Clause
// One axis after the other. Along x, two sweeps find the nearest voxel of the mask on either side. Along y and z each line
// g becomes min over j of g(j) + (s (i - j))^2, the lower envelope of parabolas. Sixteen neighbouring lines
// are gathered side by side into a tile (strides that are powers of two would otherwise fall into the same few cache
// lines), and a vector instruction works on all of them.
//
// Within a tile the nearest site is searched outwards from every voxel, up and down, until no site farther on can win:
// the smallest g beyond is known from a running minimum. Real regions are large and smooth and leave a short search. Where
// the searches of a tile together take too long, its lines go one by one through the envelope by its stack of parabolas
// (Meijster, Roerdink and Hesselink 2000; Felzenszwalb and Huttenlocher 2012): the cost stays linear, whatever the mask.
//
// Equal spacings are worked in voxels: floats hold those integers exactly as long as the square of the diagonal is below
// 2^24. Otherwise a tile computes in double, so that a value is rounded three times at most, once per axis.
#include "DistanceMap.h"
#include "Core/Base/Multiversion.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

namespace echorama {
namespace {

constexpr int Lanes = 16;     // lines side by side
constexpr int Stride = 4;     // steps of a search between two looks whether it may end; also the margin of a tile
constexpr int MeanSteps = 96; // steps per voxel, on average over a tile, after which the stack of parabolas is faster
constexpr float Infinity = std::numeric_limits<float>::infinity();

template <class T>
struct alignas(64) Block {
  T value[Lanes];
};

// Sixteen lines of n voxels and what is needed to work on them.
template <class T>
struct Tile {
  explicit Tile(int n) : count(n), rows(static_cast<std::size_t>(n + 2 * Stride)), up(rows.size()), down(rows.size()), result(rows.size())
  {
    for (Block<T>& block : rows)
      std::fill_n(block.value, Lanes, static_cast<T>(Infinity));
  }

  int count;
  std::vector<Block<T>> rows;     // g, with a margin of infinite rows at both ends
  std::vector<Block<T>> up, down; // the smallest g from a row on upwards, and from a row on downwards
  std::vector<Block<T>> result;

  T* Row(int i) { return rows[static_cast<std::size_t>(i + Stride)].value; }
  const T* Result(int i) const { return result[static_cast<std::size_t>(i + Stride)].value; }
};

// Numbers that are not negative have the order of their bits as integers.
[[gnu::always_inline]] inline std::int32_t Bits(float number)
{
  std::int32_t bits;
  std::memcpy(&bits, &number, sizeof(bits));
  return bits;
}

[[gnu::always_inline]] inline std::int64_t Bits(double number)
{
  std::int64_t bits;
  std::memcpy(&bits, &number, sizeof(bits));
  return bits;
}

// Whether some value exceeds its limit + offset. Written with integers, because a compiler makes vectors of it.
template <class T>
[[gnu::always_inline]] inline bool SomeAbove(const Block<T>& values, const Block<T>& limits, T offset)
{
  decltype(Bits(offset)) some = 0;
#pragma GCC unroll 1
  for (int l = 0; l < Lanes; ++l)
    some |= Bits(limits.value[l] + offset) - Bits(values.value[l]);
  return some < 0;
}

template <class T>
[[gnu::always_inline]] inline void TakeSmaller(Block<T>& values, const Block<T>& others, T offset)
{
#pragma GCC unroll 1
  for (int l = 0; l < Lanes; ++l) {
    const T other = others.value[l] + offset;
    values.value[l] = other < values.value[l] ? other : values.value[l];
  }
}

// The search of every voxel of a tile. squares[d] is the squared length of d steps.
// Returns false when it has become too long; the result is then not complete.
template <class T>
[[gnu::always_inline]] inline bool SearchTile(int n, const Block<T>* rows, Block<T>* up, Block<T>* down, const T* squares, Block<T>* result)
{
  rows += Stride;
  up += Stride;
  down += Stride;
  result += Stride;
  down[0] = rows[0];
  for (int i = 1; i < n; ++i) {
    down[i] = rows[i];
    TakeSmaller(down[i], down[i - 1], T(0));
  }
  up[n - 1] = rows[n - 1];
  for (int i = n - 2; i >= 0; --i) {
    up[i] = rows[i];
    TakeSmaller(up[i], up[i + 1], T(0));
  }
  std::ptrdiff_t steps = 0;
  const std::ptrdiff_t mostSteps = static_cast<std::ptrdiff_t>(MeanSteps) * n;
  for (int i = 0; i < n; ++i) {
    Block<T> best = rows[i];
    for (int d = 1; i + d < n && SomeAbove(best, up[i + d], squares[d]); d += Stride) {
      for (int e = d; e < d + Stride; ++e)
        TakeSmaller(best, rows[i + e], squares[e]);
      steps += Stride;
    }
    for (int d = 1; i - d >= 0 && SomeAbove(best, down[i - d], squares[d]); d += Stride) {
      for (int e = d; e < d + Stride; ++e)
        TakeSmaller(best, rows[i - e], squares[e]);
      steps += Stride;
    }
    result[i] = best;
    if (steps > mostSteps)
      return false;
  }
  return true;
}

ECHORAMA_HOT bool Search(int n, const Block<float>* rows, Block<float>* up, Block<float>* down, const float* squares, Block<float>* result)
{
  return SearchTile(n, rows, up, down, squares, result);
}

ECHORAMA_HOT bool Search(int n, const Block<double>* rows, Block<double>* up, Block<double>* down, const double* squares, Block<double>* result)
{
  return SearchTile(n, rows, up, down, squares, result);
}

// The lower envelope of the parabolas of one line, by a stack: site[k] is lowest from voxel from[k] on.
struct Parabolas {
  explicit Parabolas(int n) : g(static_cast<std::size_t>(n)), site(g.size()), from(g.size()) {}
  std::vector<double> g;
  std::vector<int> site, from;
};

// Works on lane l of the tile.
template <class T>
void Envelope(Tile<T>& tile, int l, double spacing, Parabolas& p)
{
  const int n = tile.count;
  const double square = spacing * spacing;
  const auto height = [&p, spacing](int i, int j) {
    const double across = spacing * (i - j);
    return p.g[static_cast<std::size_t>(j)] + across * across;
  };
  std::ptrdiff_t top = -1;
  for (int j = 0; j < n; ++j) {
    const double g = p.g[static_cast<std::size_t>(j)] = tile.Row(j)[l];
    if (g == static_cast<double>(Infinity))
      continue;
    while (top >= 0 && height(p.from[top], p.site[top]) > height(p.from[top], j))
      --top;
    if (top < 0) {
      p.site[0] = j;
      p.from[top = 0] = 0;
      continue;
    }
    // The first voxel where j is lower. The quotient of the integers of equal spacings is never rounded across a voxel.
    const int below = p.site[top], apart = j - below;
    const double crossing = below + 0.5 * ((g - p.g[static_cast<std::size_t>(below)]) / (square * apart) + apart);
    if (crossing < n - 1) {
      ++top;
      p.site[top] = j;
      p.from[top] = static_cast<int>(std::floor(crossing)) + 1;
    }
  }
  Block<T>* result = tile.result.data() + Stride;
  for (int i = n - 1; i >= 0; --i) {
    result[i].value[l] = top < 0 ? static_cast<T>(Infinity) : static_cast<T>(height(i, p.site[top]));
    if (top > 0 && i == p.from[top])
      --top;
  }
}

// Copies between a volume and a tile: n rows of sixteen voxels (or \a lines, fewer) that lie side by side.
template <class T>
[[gnu::always_inline]] inline void GatherRows(int n, const float* voxels, std::ptrdiff_t step, int lines, Block<T>* rows)
{
  if (lines == Lanes) {
    for (int i = 0; i < n; ++i, voxels += step)
#pragma GCC unroll 1
      for (int l = 0; l < Lanes; ++l)
        rows[i].value[l] = static_cast<T>(voxels[l]);
  } else {
    for (int i = 0; i < n; ++i, voxels += step)
      for (int l = 0; l < Lanes; ++l)
        rows[i].value[l] = l < lines ? static_cast<T>(voxels[l]) : static_cast<T>(Infinity);
  }
}

template <class T>
[[gnu::always_inline]] inline void ScatterRows(int n, const Block<T>* rows, double scale, float* voxels, std::ptrdiff_t step, int lines)
{
  for (int i = 0; i < n; ++i, voxels += step) {
    Block<float> row;
#pragma GCC unroll 1
    for (int l = 0; l < Lanes; ++l)
      row.value[l] = static_cast<float>(scale * rows[i].value[l]);
    if (lines == Lanes)
      std::memcpy(voxels, row.value, sizeof(row.value));
    else
      std::copy_n(row.value, lines, voxels);
  }
}

ECHORAMA_HOT void Gather(int n, const float* voxels, std::ptrdiff_t step, int lines, Block<float>* rows)
{
  GatherRows(n, voxels, step, lines, rows);
}

ECHORAMA_HOT void Gather(int n, const float* voxels, std::ptrdiff_t step, int lines, Block<double>* rows)
{
  GatherRows(n, voxels, step, lines, rows);
}

ECHORAMA_HOT void Scatter(int n, const Block<float>* rows, double scale, float* voxels, std::ptrdiff_t step, int lines)
{
  ScatterRows(n, rows, scale, voxels, step, lines);
}

ECHORAMA_HOT void Scatter(int n, const Block<double>* rows, double scale, float* voxels, std::ptrdiff_t step, int lines)
{
  ScatterRows(n, rows, scale, voxels, step, lines);
}

// Passes over the lines of one axis, after the squared distances within the axes before lie in the output.
template <class T>
class AxisPass {
public:
  // \a scale multiplies what is written.
  AxisPass(int n, double spacing, double scale) : spacing_(spacing), scale_(scale), tile_(n), parabolas_(n)
  {
    for (int d = 0; d < n + Stride; ++d)
      squares_.push_back(static_cast<T>((spacing * d) * (spacing * d)));
  }

  // Up to sixteen lines that begin at first, first + 1, ...; voxels of a line are step apart.
  void Work(float* first, int lines, std::ptrdiff_t step)
  {
    const int n = tile_.count;
    Gather(n, first, step, lines, tile_.rows.data() + Stride);
    if (!Search(n, tile_.rows.data(), tile_.up.data(), tile_.down.data(), squares_.data(), tile_.result.data()))
      for (int l = 0; l < lines; ++l)
        Envelope(tile_, l, spacing_, parabolas_);
    Scatter(n, tile_.result.data() + Stride, scale_, first, step, lines);
  }

private:
  double spacing_, scale_;
  Tile<T> tile_;
  Parabolas parabolas_;
  std::vector<T> squares_;
};

// The squared distance to the mask within one row. scratch holds 2 n numbers.
ECHORAMA_HOT void MapRow(const unsigned char* mask, int n, double squaredSpacing, int* scratch, float* out)
{
  const int far = 1 << 30;
  int* const before = scratch; // the nearest site on the left
  int* const after = scratch + n;
  for (int i = 0; i < n; ++i) {
    before[i] = mask[i] != 0 ? i : -far;
    after[i] = mask[i] != 0 ? i : far;
  }
  // Minimum and maximum, not branches: random masks would mislead every one of them.
  int last = -far, next = far;
  for (int i = 0; i < n; ++i) {
    before[i] = last = std::max(last, before[i]);
    after[n - 1 - i] = next = std::min(next, after[n - 1 - i]);
  }
  for (int i = 0; i < n; ++i) {
    const int steps = std::min(i - before[i], after[i] - i);
    out[i] = steps < n ? static_cast<float>(squaredSpacing * (static_cast<double>(steps) * steps)) : Infinity;
  }
}

template <class T>
void Map(VolumeView<const unsigned char> mask, const Eigen::Vector3d& spacing, double scale, VolumeView<float> out,
         const Progress& progress)
{
  const auto& n = mask.Dimensions();
  ParallelFor(n[2], progress.Part(0.0, 0.5), [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    std::vector<int> scratch(2 * static_cast<std::size_t>(n[0]));
    for (int j = 0; j < n[1]; ++j)
      MapRow(mask.Row(j, k), n[0], spacing.x() * spacing.x(), scratch.data(), out.Row(j, k));
    AxisPass<T> pass(n[1], spacing.y(), 1.0);
    for (int i = 0; i < n[0]; i += Lanes)
      pass.Work(&out(i, 0, k), std::min(Lanes, n[0] - i), out.RowStride());
  });
  ParallelFor(n[1], progress.Part(0.5, 1.0), [&](std::ptrdiff_t row) {
    AxisPass<T> pass(n[2], spacing.z(), scale);
    for (int i = 0; i < n[0]; i += Lanes)
      pass.Work(&out(i, static_cast<int>(row), 0), std::min(Lanes, n[0] - i), out.SliceStride());
  });
}

} // namespace

void SquaredDistanceMap(VolumeView<const unsigned char> mask, const Eigen::Vector3d& spacing, VolumeView<float> squaredDistance,
                        const Progress& progress)
{
  const auto& n = mask.Dimensions();
  if (n != squaredDistance.Dimensions())
    throw Error(Error::Kind::InvalidParameter, "mask and distance map differ in shape");
  if (mask.Size() == 0)
    return;
  double diagonal = 0.0, squaredDiagonal = 0.0; // in voxels, in mm
  for (int axis = 0; axis < 3; ++axis) {
    const double length = n[static_cast<std::size_t>(axis)] - 1.0, s = spacing[axis];
    diagonal += length * length;
    squaredDiagonal += length * s * length * s;
    if (!(s > 0.0 && s * s >= std::numeric_limits<float>::min()))
      throw Error(Error::Kind::InvalidParameter, "the spacing of a distance map must be positive, and its square a float");
  }
  if (!(squaredDiagonal <= std::numeric_limits<float>::max()))
    throw Error(Error::Kind::InvalidParameter, "the spacing is too large: squared distances do not fit a float");

  const auto same = [&](int a, int b) { return spacing[a] == spacing[b]; };
  if (same(0, 1) && (same(0, 2) || n[2] == 1)) {
    const double scale = spacing.x() * spacing.x();
    if (diagonal < 16777216.0)
      Map<float>(mask, Eigen::Vector3d::Ones(), scale, squaredDistance, progress);
    else
      Map<double>(mask, Eigen::Vector3d::Ones(), scale, squaredDistance, progress);
  } else {
    Map<double>(mask, spacing, 1.0, squaredDistance, progress);
  }
}

} // namespace echorama
