// SPDX-License-Identifier: BSD-3-Clause
// One axis after the other: y, x, z. Along y two sweeps count the steps to the mask. After that, each line g along x or z
// becomes min over j of g(j) + (s (i - j))^2, the lower envelope of parabolas.
//
// Vector instructions work on sixteen voxels at a time. Along x these are neighbours of one row; along z they belong to
// sixteen lines, gathered side by side into a tile (strides that are powers of two would otherwise fall into the same few
// cache lines). For every voxel the nearest site is searched outwards, up and down, eight steps between two looks whether
// anything farther on can still win: the smallest g beyond is known. Real regions are large and smooth and leave a short
// search. Where the searches of a row or tile take too long together, its lines go one by one through the stack of parabolas
// (Meijster, Roerdink and Hesselink 2000; Felzenszwalb and Huttenlocher 2012): the cost stays linear, whatever the mask.
//
// Precision: equal spacings are worked in voxels, whose squared distances are integers that floats hold exactly below 2^24.
// With different spacings a value is rounded five times at most: once for each of the three terms, once for each sum.
#include "DistanceMap.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

namespace echorama {
namespace {

constexpr int Lanes = 16;      // voxels side by side
constexpr int Stride = 8;      // steps of a search between two looks whether it may end
constexpr int MeanSteps = 128; // steps, on average over a line, after which the stack of parabolas is faster
constexpr float Infinity = std::numeric_limits<float>::infinity();

// What vector instructions load at once.
struct alignas(64) Block {
  float value[Lanes];
};

// GCC must not unroll the loops over lanes before it has seen that they are vectors.
#if defined(__GNUC__) && !defined(__clang__)
#define ECHORAMA_FOR_LANES(l) _Pragma("GCC unroll 1") for (int l = 0; l < Lanes; ++l)
#else
#define ECHORAMA_FOR_LANES(l) for (int l = 0; l < Lanes; ++l)
#endif

// Numbers that are not negative have the order of their bits as integers, and a compiler makes vectors of sums and extremes
// of integers, but not of those of floats.
[[gnu::always_inline]] inline std::int32_t Bits(float number)
{
  std::int32_t bits;
  std::memcpy(&bits, &number, sizeof(bits));
  return bits;
}

[[gnu::always_inline]] inline float Number(std::int32_t bits)
{
  float number;
  std::memcpy(&number, &bits, sizeof(number));
  return number;
}

// Whether some value exceeds its limit + offset.
[[gnu::always_inline]] inline bool SomeAbove(const float* values, const float* limits, float offset)
{
  std::int32_t some = 0;
  ECHORAMA_FOR_LANES(l)
  some |= Bits(limits[l] + offset) - Bits(values[l]);
  return some < 0;
}

[[gnu::always_inline]] inline bool AllInfinite(const float* values)
{
  std::int32_t some = 0;
  ECHORAMA_FOR_LANES(l)
  some |= Bits(values[l]) - Bits(Infinity);
  return some == 0;
}

[[gnu::always_inline]] inline float Largest(const float* values)
{
  std::int32_t bits = 0;
  ECHORAMA_FOR_LANES(l)
  bits = std::max(bits, Bits(values[l]));
  return Number(bits);
}

[[gnu::always_inline]] inline void TakeSmaller(float* values, const float* others, float offset)
{
  ECHORAMA_FOR_LANES(l)
  {
    const float other = others[l] + offset;
    values[l] = other < values[l] ? other : values[l];
  }
}

// The search in one row. Beyond both ends of g lie 2 Lanes of infinity, and the arrays near, above and below, one number for
// eight voxels, have two elements beyond both ends. squares[d] is the squared length of d steps.
// Returns false when the search has become too long; the result is then not complete.
bool SearchRow(int n, const float* g, float* near, float* above, float* below, const float* squares, float* result)
{
  static_assert(Stride == 8 && Lanes == 16, "a vector, moved by eight steps, meets the voxels of three eights");
  const int eights = (n + 7) / 8;
  // The smallest of eight voxels from each on, by doubling.
  for (int i = 0; i < n + 6; ++i)
    result[i] = std::min(g[i], g[i + 1]);
  for (int i = 0; i < n + 4; ++i)
    result[i] = std::min(result[i], result[i + 2]);
  for (int i = 0; i < n; ++i)
    result[i] = std::min(result[i], result[i + 4]);
  // near: the smallest g of an eight and the two after it; above: of it and all after it; below: of near and all before.
  near[eights] = near[eights + 1] = above[eights] = Infinity;
  for (int b = 0; b < eights; ++b)
    near[b] = result[8 * b];
  near[-2] = near[0];
  near[-1] = std::min(near[0], near[1]);
  for (int b = 0; b < eights; ++b)
    near[b] = std::min(near[b], std::min(near[b + 1], near[b + 2]));
  below[-2] = near[-2];
  for (int b = -1; b < eights; ++b)
    below[b] = std::min(below[b - 1], near[b]);
  for (int b = eights - 1; b >= 0; --b)
    above[b] = std::min(above[b + 1], near[b]);

  std::ptrdiff_t steps = 0;
  const std::ptrdiff_t mostSteps = static_cast<std::ptrdiff_t>(MeanSteps) * (n + Lanes - 1) / Lanes;
  for (int i = 0; i < n; i += Lanes) {
    Block best;
    std::memcpy(best.value, g + i, sizeof(best.value));
    float worst = Largest(best.value);
    for (int d = 1, b = i / 8; i + d < n && worst > above[b] + squares[d]; d += Stride, ++b) {
      ++steps;
      if (!(worst > near[b] + squares[d]))
        continue;
      for (int e = d; e < d + Stride; ++e)
        TakeSmaller(best.value, g + i + e, squares[e]);
      worst = Largest(best.value);
      steps += Stride;
    }
    for (int d = 1, b = i / 8 - 1; i + Lanes - 1 - d >= 0 && worst > below[b] + squares[d]; d += Stride, --b) {
      ++steps;
      if (!(worst > near[b] + squares[d]))
        continue;
      for (int e = d; e < d + Stride; ++e)
        TakeSmaller(best.value, g + i - e, squares[e]);
      worst = Largest(best.value);
      steps += Stride;
    }
    std::memcpy(result + i, best.value, sizeof(best.value));
    if (steps > mostSteps)
      return false;
  }
  return true;
}

// The search in a tile: voxel i of sixteen lines is at g + Lanes * i; beyond both ends lie Stride voxels of infinity. Every
// line has its own limits above and below, one for Stride voxels.
// Returns false when the search has become too long; the result is then not complete.
bool SearchTile(int n, const float* g, float* above, float* below, const float* squares, float* result)
{
  // The smallest of every Stride voxels, and running minima of these from both ends.
  const std::ptrdiff_t groups = (n + Stride - 1) / Stride;
  for (std::ptrdiff_t group = 0; group < groups; ++group) {
    Block smallest;
    std::memcpy(smallest.value, g + group * Stride * Lanes, sizeof(smallest.value));
    for (int i = 1; i < Stride; ++i)
      TakeSmaller(smallest.value, g + (group * Stride + i) * Lanes, 0.0f);
    std::memcpy(above + group * Lanes, smallest.value, sizeof(smallest.value));
    if (group > 0)
      TakeSmaller(smallest.value, below + (group - 1) * Lanes, 0.0f);
    std::memcpy(below + group * Lanes, smallest.value, sizeof(smallest.value));
  }
  for (std::ptrdiff_t group = groups - 2; group >= 0; --group)
    TakeSmaller(above + group * Lanes, above + (group + 1) * Lanes, 0.0f);
  // Nothing is finite before the first and after the last.
  std::ptrdiff_t first = 0, last = n - 1;
  while (first < n && AllInfinite(g + first * Lanes))
    ++first;
  while (last > first && AllInfinite(g + last * Lanes))
    --last;

  std::ptrdiff_t steps = 0;
  const std::ptrdiff_t mostSteps = static_cast<std::ptrdiff_t>(MeanSteps) * n;
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    Block best;
    std::memcpy(best.value, g + i * Lanes, sizeof(best.value));
    for (std::ptrdiff_t d = std::max<std::ptrdiff_t>(1, first - i); i + d <= last; d += Stride) {
      if (!SomeAbove(best.value, above + (i + d) / Stride * Lanes, squares[d]))
        break;
      for (std::ptrdiff_t e = d; e < d + Stride; ++e)
        TakeSmaller(best.value, g + (i + e) * Lanes, squares[e]);
      steps += Stride;
    }
    for (std::ptrdiff_t d = std::max<std::ptrdiff_t>(1, i - last); i - d >= first; d += Stride) {
      if (!SomeAbove(best.value, below + (i - d) / Stride * Lanes, squares[d]))
        break;
      for (std::ptrdiff_t e = d; e < d + Stride; ++e)
        TakeSmaller(best.value, g + (i - e) * Lanes, squares[e]);
      steps += Stride;
    }
    std::memcpy(result + i * Lanes, best.value, sizeof(best.value));
    if (steps > mostSteps)
      return false;
  }
  return true;
}

// The lower envelope of the parabolas of one line, by a stack: site_[k] is lowest from voxel from_[k] on.
class Envelope {
public:
  // n voxels of g, step apart, into result.
  void Work(int n, const float* g, float* result, std::ptrdiff_t step, double spacing)
  {
    site_.resize(static_cast<std::size_t>(n));
    from_.resize(site_.size());
    const double square = spacing * spacing;
    const auto height = [g, step, spacing](int i, int j) {
      return static_cast<double>(g[j * step]) + (spacing * (i - j)) * (spacing * (i - j));
    };
    int top = -1;
    for (int j = 0; j < n; ++j) {
      if (g[j * step] == Infinity)
        continue;
      while (top >= 0 && height(from_[top], site_[top]) > height(from_[top], j))
        --top;
      if (top < 0) {
        top = 0;
        site_[0] = j;
        from_[0] = 0;
        continue;
      }
      // Beyond the crossing j is lower. The quotient of integers (equal spacings) is never rounded across a voxel.
      const int apart = j - site_[top];
      const double rise = static_cast<double>(g[j * step]) - static_cast<double>(g[site_[top] * step]);
      const double crossing = site_[top] + 0.5 * (rise / (square * apart) + apart);
      if (!(crossing < n - 1))
        continue;
      const int from = std::max(static_cast<int>(std::floor(crossing)), from_[top]) + 1; // rounding may not go back
      if (from < n) {
        ++top;
        site_[top] = j;
        from_[top] = from;
      }
    }
    for (int i = n - 1; i >= 0; --i) {
      result[i * step] = top < 0 ? Infinity : static_cast<float>(height(i, site_[top]));
      if (top > 0 && i == from_[top])
        --top;
    }
  }

private:
  std::vector<int> site_, from_;
};

std::vector<float> SquaresOf(int n, double spacing)
{
  std::vector<float> squares(static_cast<std::size_t>(n + 2 * Lanes));
  for (std::size_t d = 0; d < squares.size(); ++d)
    squares[d] = static_cast<float>((spacing * static_cast<double>(d)) * (spacing * static_cast<double>(d)));
  return squares;
}

// A row of n voxels along x.
class Row {
public:
  Row(int n, double spacing)
    : count_(n), spacing_(spacing), g_(static_cast<std::size_t>(n + 4 * Lanes), Infinity), result_(g_.size()),
      near_(static_cast<std::size_t>(n / 8 + 6)), above_(near_.size()), below_(near_.size()), squares_(SquaresOf(n, spacing))
  {
  }

  float* G() { return g_.data() + 2 * Lanes; }
  const float* Result() const { return result_.data(); }

  // Turns G into Result.
  void Work()
  {
    if (!SearchRow(count_, G(), near_.data() + 2, above_.data() + 2, below_.data() + 2, squares_.data(), result_.data()))
      envelope_.Work(count_, G(), result_.data(), 1, spacing_);
  }

private:
  int count_;
  double spacing_;
  std::vector<float> g_, result_, near_, above_, below_, squares_;
  Envelope envelope_;
};

// Sixteen lines of n voxels along z, side by side.
class Tile {
public:
  Tile(int n, double spacing)
    : count_(n), spacing_(spacing), g_(static_cast<std::size_t>(n + 2 * Stride), Infinite()),
      result_(static_cast<std::size_t>(n)), above_(static_cast<std::size_t>(n / Stride + 1)), below_(above_.size()),
      squares_(SquaresOf(n, spacing))
  {
  }

  // Voxel i of as many lines as there are lanes; the rest is infinite.
  void Gather(int i, const float* voxels, int lanes)
  {
    float* row = G() + static_cast<std::ptrdiff_t>(i) * Lanes;
    if (lanes == Lanes) {
      std::memcpy(row, voxels, sizeof(Block));
    } else {
      std::copy_n(voxels, lanes, row);
      std::fill(row + lanes, row + Lanes, Infinity);
    }
  }

  void Work(int lanes)
  {
    float* result = result_.front().value;
    if (!SearchTile(count_, G(), above_.front().value, below_.front().value, squares_.data(), result))
      for (int l = 0; l < lanes; ++l)
        envelope_.Work(count_, G() + l, result + l, Lanes, spacing_);
  }

  void Scatter(int i, double scale, float* voxels, int lanes) const
  {
    const float* row = result_[static_cast<std::size_t>(i)].value;
    if (lanes == Lanes && scale == 1.0)
      std::memcpy(voxels, row, sizeof(Block));
    else
      for (int l = 0; l < lanes; ++l)
        voxels[l] = static_cast<float>(scale * row[l]);
  }

private:
  static Block Infinite()
  {
    Block block;
    std::fill_n(block.value, Lanes, Infinity);
    return block;
  }
  float* G() { return g_[Stride].value; }

  int count_;
  double spacing_;
  std::vector<Block> g_, result_, above_, below_;
  std::vector<float> squares_;
  Envelope envelope_;
};

// The sweep along +y: steps since the mask, kept in steps from row to row.
void CountSteps(const unsigned char* mask, int n, float* steps, float* out)
{
  for (int i = 0; i < n; ++i)
    out[i] = steps[i] = mask[i] != 0 ? 0.0f : steps[i] + 1.0f;
}

// The sweep along -y over what the first one left: the squared distance along y.
void SweepBack(const float* out, int n, double squaredSpacing, float* steps, float* g)
{
  for (int i = 0; i < n; ++i) {
    const float back = steps[i] + 1.0f, nearest = out[i] < back ? out[i] : back;
    steps[i] = nearest;
    g[i] = static_cast<float>(squaredSpacing * (static_cast<double>(nearest) * nearest));
  }
}

// Along y and x in one slice.
void MapSlice(const unsigned char* mask, int nx, int ny, double squaredSpacingY, Row& row, float* out)
{
  std::vector<float> steps(static_cast<std::size_t>(nx), Infinity);
  for (std::ptrdiff_t j = 0; j < ny; ++j)
    CountSteps(mask + nx * j, nx, steps.data(), out + nx * j);
  std::fill(steps.begin(), steps.end(), Infinity);
  for (std::ptrdiff_t j = ny - 1; j >= 0; --j) {
    SweepBack(out + nx * j, nx, squaredSpacingY, steps.data(), row.G());
    row.Work();
    std::copy_n(row.Result(), nx, out + nx * j);
  }
}

void Map(const unsigned char* mask, const std::array<int, 3>& n, const Eigen::Vector3d& spacing, double scale, float* out,
         const Progress& progress)
{
  const std::ptrdiff_t sliceStride = static_cast<std::ptrdiff_t>(n[0]) * n[1];
  const std::ptrdiff_t slices = std::max<std::ptrdiff_t>(1, 65536 / sliceStride);
  ParallelRanges(n[2], slices, progress.Part(0.0, 0.5), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    Row row(n[0], spacing.x());
    for (std::ptrdiff_t k = begin; k < end; ++k)
      MapSlice(mask + k * sliceStride, n[0], n[1], spacing.y() * spacing.y(), row, out + k * sliceStride);
  });

  // Several tiles side by side share the pages of memory that they touch.
  const int together = std::max(1, std::min(8, 4096 / n[2]));
  const std::ptrdiff_t pieces = (n[0] + together * Lanes - 1) / (together * Lanes), count = n[1] * pieces;
  const std::ptrdiff_t grain = std::max<std::ptrdiff_t>(1, count / 64);
  ParallelRanges(count, grain, progress.Part(0.5, 1.0), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::vector<Tile> tiles(static_cast<std::size_t>(together), Tile(n[2], spacing.z()));
    for (std::ptrdiff_t item = begin; item < end; ++item) {
      const int first = static_cast<int>(item % pieces) * together * Lanes;
      const int used = std::min(together, (n[0] - first + Lanes - 1) / Lanes);
      float* const voxels = out + item / pieces * n[0] + first;
      const auto lanes = [&n, first](int tile) { return std::min(Lanes, n[0] - first - tile * Lanes); };
      for (int k = 0; k < n[2]; ++k)
        for (int t = 0; t < used; ++t)
          tiles[static_cast<std::size_t>(t)].Gather(k, voxels + k * sliceStride + t * Lanes, lanes(t));
      for (int t = 0; t < used; ++t)
        tiles[static_cast<std::size_t>(t)].Work(lanes(t));
      for (int k = 0; k < n[2]; ++k)
        for (int t = 0; t < used; ++t)
          tiles[static_cast<std::size_t>(t)].Scatter(k, scale, voxels + k * sliceStride + t * Lanes, lanes(t));
    }
  });
}

} // namespace

void SquaredDistanceMap(VolumeView<const unsigned char> mask, const Eigen::Vector3d& spacing, VolumeView<float> squaredDistance,
                        const Progress& progress)
{
  if (mask.Dimensions() != squaredDistance.Dimensions())
    throw Error(Error::Kind::InvalidParameter, "mask and distance map differ in shape");
  if (mask.Size() == 0)
    return;
  // Axes of one voxel are left out: a 2D image is laid out as x and z, so that all threads find work.
  std::array<int, 3> n{1, 1, 1};
  Eigen::Vector3d s = Eigen::Vector3d::Ones();
  double squaredDiagonal = 0.0;
  int axes = 0;
  bool equal = true;
  for (int axis = 0; axis < 3; ++axis) {
    const int count = mask.Dimensions()[static_cast<std::size_t>(axis)];
    if (!(spacing[axis] > 0.0 && spacing[axis] * spacing[axis] >= std::numeric_limits<float>::min()))
      throw Error(Error::Kind::InvalidParameter, "the spacing of a distance map must be positive, and its square a float");
    if (count == 1)
      continue;
    n[static_cast<std::size_t>(axes)] = count;
    s[axes] = spacing[axis];
    equal = equal && s[axes] == s[0];
    squaredDiagonal += (count - 1.0) * (count - 1.0) * spacing[axis] * spacing[axis];
    ++axes;
  }
  if (!(squaredDiagonal <= std::numeric_limits<float>::max()))
    throw Error(Error::Kind::InvalidParameter, "the spacing is too large: squared distances do not fit a float");
  if (axes == 2) {
    std::swap(n[1], n[2]);
    std::swap(s[1], s[2]);
  }
  if (equal)
    Map(mask.Data(), n, Eigen::Vector3d::Ones(), s[0] * s[0], squaredDistance.Data(), progress);
  else
    Map(mask.Data(), n, s, 1.0, squaredDistance.Data(), progress);
}

void SquaredDepthMap(VolumeView<const unsigned char> region, const Eigen::Vector3d& spacing, VolumeView<float> squaredDepth,
                     const Progress& progress)
{
  const auto& n = region.Dimensions();
  Volume<unsigned char> outside(n);
  std::transform(region.begin(), region.end(), outside.View().begin(), [](unsigned char r) { return r == 0 ? 1 : 0; });
  SquaredDistanceMap(outside.View(), spacing, squaredDepth, progress.Part(0.0, 0.9));
  // The nearest voxel beyond the grid lies straight along one of the axes.
  const auto toRim = [&n, &spacing](int axis, int i) {
    const int count = n[static_cast<std::size_t>(axis)];
    const double distance = spacing[axis] * std::min(i + 1, count - i);
    return count == 1 ? Infinity : static_cast<float>(distance * distance);
  };
  ParallelFor(n[2], progress.Part(0.9, 1.0), [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < n[1]; ++j) {
      float* const row = squaredDepth.Row(j, k);
      const float rim = std::min(toRim(1, j), toRim(2, k));
      for (int i = 0; i < n[0]; ++i)
        row[i] = std::min({row[i], rim, toRim(0, i)});
    }
  });
}

} // namespace echorama
