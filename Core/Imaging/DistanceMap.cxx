// SPDX-License-Identifier: BSD-3-Clause
// One axis after the other: y, x, z. Along y two sweeps count the steps to the mask. After that, each line g along x or z
// becomes min over j of g(j) + (s (i - j))^2, the lower envelope of parabolas.
//
// Vector instructions work on sixteen voxels at a time. Along x these are neighbours of one row; along z they belong to
// sixteen lines, gathered side by side into a tile (strides that are powers of two would otherwise fall into the same few
// cache lines). For every voxel the nearest site is searched outwards, up and down, until no site farther on can win: the
// smallest g beyond is known from a running minimum. Real regions are large and smooth and leave a short search. Where the
// searches of a row or tile take too long together, its lines go one by one through the stack of parabolas (Meijster,
// Roerdink and Hesselink 2000; Felzenszwalb and Huttenlocher 2012): the cost stays linear, whatever the mask.
//
// Equal spacings are worked in voxels: floats hold those integers exactly as long as the square of the diagonal is below
// 2^24. Otherwise lines are worked in double, and a value is rounded to float once per axis.
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

constexpr int Lanes = 16;      // voxels side by side
constexpr int Stride = 8;      // steps of a search between two looks whether it may end
constexpr int MeanSteps = 128; // steps, on average over a line, after which the stack of parabolas is faster
constexpr float Infinity = std::numeric_limits<float>::infinity();

// What vector instructions load at once.
template <class T>
struct alignas(64) Block {
  T value[Lanes];
};

// GCC must not unroll the loops over lanes before it has seen that they are vectors.
#if defined(__GNUC__) && !defined(__clang__)
#define ECHORAMA_FOR_LANES(l) _Pragma("GCC unroll 1") for (int l = 0; l < Lanes; ++l)
#else
#define ECHORAMA_FOR_LANES(l) for (int l = 0; l < Lanes; ++l)
#endif

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

// Whether some value exceeds its limit + offset. Written with integers, because a compiler makes vectors of that.
template <class T>
[[gnu::always_inline]] inline bool SomeAbove(const T* values, const T* limits, T offset)
{
  decltype(Bits(offset)) some = 0;
  ECHORAMA_FOR_LANES(l)
  some |= Bits(limits[l] + offset) - Bits(values[l]);
  return some < 0;
}

template <class T>
[[gnu::always_inline]] inline void TakeSmaller(T* values, const T* others, T offset)
{
  ECHORAMA_FOR_LANES(l)
  {
    const T other = others[l] + offset;
    values[l] = other < values[l] ? other : values[l];
  }
}

// Whether nothing in a block is finite.
template <class T>
[[gnu::always_inline]] inline bool AllInfinite(const T* values)
{
  const auto infinite = Bits(static_cast<T>(Infinity));
  decltype(Bits(T(0))) some = 0;
  ECHORAMA_FOR_LANES(l)
  some |= Bits(values[l]) - infinite;
  return some == 0;
}

// The search. Voxel i of a line and the lanes beside it are at g + Step * i: Step is Lanes in a tile and 1 in a row, where
// the lanes are the next voxels of the same line. No g from voxel i on upwards is smaller than the limit above says, none
// from i on downwards smaller than below says; a tile has one limit for Stride voxels. Only from voxel first to voxel last
// something is finite. squares[d] is the squared length of d steps.
// Returns false when the search has become too long; the result is then not complete.
template <class T, int Step>
[[gnu::always_inline]] inline bool SearchLines(int n, int first, int last, const T* g, const T* above, const T* below,
                                               const T* squares, T* result)
{
  constexpr int wide = Step == 1 ? Lanes : 1; // voxels of a line that are worked on together
  const auto limit = [](const T* limits, int i) { return limits + (Step == 1 ? i : i / Stride * Lanes); };
  std::ptrdiff_t steps = 0;
  const std::ptrdiff_t mostSteps = static_cast<std::ptrdiff_t>(MeanSteps) * n / wide;
  for (int i = 0; i < n; i += wide) {
    Block<T> best;
    std::memcpy(best.value, g + static_cast<std::ptrdiff_t>(Step) * i, sizeof(best.value));
    for (int d = std::max(1, first - (i + wide - 1)); i + d <= last; d += Stride) {
      const std::ptrdiff_t from = static_cast<std::ptrdiff_t>(Step) * (i + d);
      if (!SomeAbove(best.value, limit(above, i + d), squares[d]))
        break;
      for (int e = 0; e < Stride; ++e)
        TakeSmaller(best.value, g + from + Step * e, squares[d + e]);
      steps += Stride;
    }
    for (int d = std::max(1, i - last); i + wide - 1 - d >= first; d += Stride) {
      const std::ptrdiff_t from = static_cast<std::ptrdiff_t>(Step) * (i - d);
      if (!SomeAbove(best.value, limit(below, i - d), squares[d]))
        break;
      for (int e = 0; e < Stride; ++e)
        TakeSmaller(best.value, g + from - Step * e, squares[d + e]);
      steps += Stride;
    }
    std::memcpy(result + static_cast<std::ptrdiff_t>(Step) * i, best.value, sizeof(best.value));
    if (steps > mostSteps)
      return false;
  }
  return true;
}

// Sixteen lines: the smallest of every Stride voxels, running minima of these from both ends, then the search.
template <class T>
[[gnu::always_inline]] inline bool SearchSixteen(int n, const T* g, T* above, T* below, const T* squares, T* result)
{
  const std::ptrdiff_t groups = (n + Stride - 1) / Stride;
  for (std::ptrdiff_t group = 0; group < groups; ++group) { // the margin above the last voxel is infinite
    Block<T> smallest;
    std::memcpy(smallest.value, g + group * Stride * Lanes, sizeof(smallest.value));
    for (int i = 1; i < Stride; ++i)
      TakeSmaller(smallest.value, g + (group * Stride + i) * Lanes, T(0));
    std::memcpy(above + group * Lanes, smallest.value, sizeof(smallest.value));
    if (group > 0)
      TakeSmaller(smallest.value, below + (group - 1) * Lanes, T(0));
    std::memcpy(below + group * Lanes, smallest.value, sizeof(smallest.value));
  }
  for (std::ptrdiff_t group = groups - 2; group >= 0; --group)
    TakeSmaller(above + group * Lanes, above + (group + 1) * Lanes, T(0));
  int first = 0, last = n - 1;
  while (first < n && AllInfinite(g + static_cast<std::ptrdiff_t>(first) * Lanes))
    ++first;
  while (last > first && AllInfinite(g + static_cast<std::ptrdiff_t>(last) * Lanes))
    --last;
  return SearchLines<T, Lanes>(n, first, last, g, above, below, squares, result);
}

// One line: the minima advance by whole blocks, which is a lower bound and costs less.
template <class T>
[[gnu::always_inline]] inline bool SearchOne(int n, const T* g, T* above, T* below, const T* squares, T* result)
{
  using Integer = decltype(Bits(T(0)));
  const auto smallest = [g](int block) {
    Integer bits = Bits(static_cast<T>(Infinity));
    ECHORAMA_FOR_LANES(l)
    {
      const Integer other = Bits(g[block + l]);
      bits = other < bits ? other : bits;
    }
    T number;
    std::memcpy(&number, &bits, sizeof(number));
    return number;
  };
  const int lastBlock = (n - 1) / Lanes * Lanes;
  int first = 0, last = n - 1;
  T running = static_cast<T>(Infinity);
  for (int block = 0; block <= lastBlock; block += Lanes) {
    running = std::min(running, smallest(block));
    if (running == static_cast<T>(Infinity))
      first = block + Lanes;
    ECHORAMA_FOR_LANES(l)
    below[block + l] = running;
  }
  running = static_cast<T>(Infinity);
  for (int block = lastBlock; block >= 0; block -= Lanes) {
    running = std::min(running, smallest(block));
    if (running == static_cast<T>(Infinity))
      last = block - 1;
    ECHORAMA_FOR_LANES(l)
    above[block + l] = running;
  }
  return SearchLines<T, 1>(n, first, last, g, above, below, squares, result);
}

ECHORAMA_HOT bool SearchTile(int n, const float* g, float* above, float* below, const float* squares, float* result)
{
  return SearchSixteen(n, g, above, below, squares, result);
}

ECHORAMA_HOT bool SearchTile(int n, const double* g, double* above, double* below, const double* squares, double* result)
{
  return SearchSixteen(n, g, above, below, squares, result);
}

ECHORAMA_HOT bool SearchRow(int n, const float* g, float* above, float* below, const float* squares, float* result)
{
  return SearchOne(n, g, above, below, squares, result);
}

ECHORAMA_HOT bool SearchRow(int n, const double* g, double* above, double* below, const double* squares, double* result)
{
  return SearchOne(n, g, above, below, squares, result);
}

// Between the volume and a tile; lanes beyond the volume are infinite.
template <class T>
void Gather(const float* voxels, int lanes, T* row)
{
  if (lanes == Lanes) {
    ECHORAMA_FOR_LANES(l)
    row[l] = static_cast<T>(voxels[l]);
  } else {
    std::copy_n(voxels, lanes, row);
    std::fill(row + lanes, row + Lanes, static_cast<T>(Infinity));
  }
}

template <class T>
void Scatter(const T* row, double scale, int lanes, float* voxels)
{
  if (lanes == Lanes && scale == 1.0) {
    ECHORAMA_FOR_LANES(l)
    voxels[l] = static_cast<float>(row[l]);
  } else {
    for (int l = 0; l < lanes; ++l)
      voxels[l] = static_cast<float>(scale * row[l]);
  }
}

// Lines of n voxels to work on: a row along x (step 1) or a tile of sixteen lines along z (step Lanes).
template <class T>
class Lines {
public:
  Lines(int n, int step, double spacing)
    : count_(n), step_(step), spacing_(spacing), g_(Blocks(n + 2 * Margin())), result_(g_.size()),
      above_(step == 1 ? g_.size() : g_.size() / Stride), below_(above_.size())
  {
    for (std::vector<Block<T>>* array : {&g_, &above_, &below_})
      for (Block<T>& block : *array)
        std::fill_n(block.value, Lanes, static_cast<T>(Infinity));
    for (int d = 0; d < n + 2 * Lanes; ++d)
      squares_.push_back(static_cast<T>((spacing * d) * (spacing * d)));
  }

  // The lanes at voxel i.
  T* G(int i) { return At(g_, i); }
  T* Result(int i) { return At(result_, i); }

  // Turns g into the result, in the first \a lanes lanes.
  void Work(int lanes)
  {
    const bool finished = step_ == 1
                              ? SearchRow(count_, G(0), At(above_, 0), At(below_, 0), squares_.data(), Result(0))
                              : SearchTile(count_, G(0), above_.front().value, below_.front().value, squares_.data(), Result(0));
    for (int l = 0; !finished && l < (step_ == 1 ? 1 : lanes); ++l)
      Envelope(l);
  }

private:
  // A search looks beyond both ends of a line, where everything is infinite.
  int Margin() const { return step_ == 1 ? 2 * Lanes : Stride; }
  std::size_t Blocks(int voxels) const
  {
    return (static_cast<std::size_t>(voxels) * static_cast<std::size_t>(step_) + Lanes - 1) / Lanes;
  }
  T* At(std::vector<Block<T>>& array, int i) { return array.front().value + static_cast<std::ptrdiff_t>(step_) * (i + Margin()); }

  // The lower envelope of the parabolas of one line, by a stack: site_[k] is lowest from voxel from_[k] on.
  void Envelope(int lane)
  {
    site_.resize(static_cast<std::size_t>(count_));
    from_.resize(site_.size());
    const double square = spacing_ * spacing_;
    const auto g = [this, lane](int i) { return static_cast<double>(G(i)[lane]); };
    const auto height = [&g, this](int i, int j) { return g(j) + (spacing_ * (i - j)) * (spacing_ * (i - j)); };
    int top = -1;
    for (int j = 0; j < count_; ++j) {
      if (g(j) == static_cast<double>(Infinity))
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
      const double crossing = site_[top] + 0.5 * ((g(j) - g(site_[top])) / (square * apart) + apart);
      if (!(crossing < count_ - 1))
        continue;
      const int from = std::max(static_cast<int>(std::floor(crossing)), from_[top]) + 1; // rounding may not go back
      if (from < count_) {
        ++top;
        site_[top] = j;
        from_[top] = from;
      }
    }
    for (int i = count_ - 1; i >= 0; --i) {
      Result(i)[lane] = static_cast<T>(top < 0 ? static_cast<double>(Infinity) : height(i, site_[top]));
      if (top > 0 && i == from_[top])
        --top;
    }
  }

  int count_, step_;
  double spacing_;
  std::vector<Block<T>> g_, result_, above_, below_;
  std::vector<T> squares_;
  std::vector<int> site_, from_;
};

// The sweep along +y: steps since the mask, kept in steps from row to row.
ECHORAMA_HOT void CountSteps(const unsigned char* mask, int n, float* steps, float* out)
{
  for (int i = 0; i < n; ++i)
    out[i] = steps[i] = mask[i] != 0 ? 0.0f : steps[i] + 1.0f;
}

// The sweep along -y over what the first one left: the squared distance along y.
template <class T>
[[gnu::always_inline]] inline void SquareSteps(const float* out, int n, T squaredSpacing, float* steps, T* g)
{
  for (int i = 0; i < n; ++i) {
    const float back = steps[i] + 1.0f, nearest = out[i] < back ? out[i] : back;
    steps[i] = nearest;
    g[i] = squaredSpacing * (static_cast<T>(nearest) * static_cast<T>(nearest));
  }
}

ECHORAMA_HOT void SweepBack(const float* out, int n, float squaredSpacing, float* steps, float* g)
{
  SquareSteps(out, n, squaredSpacing, steps, g);
}

ECHORAMA_HOT void SweepBack(const float* out, int n, double squaredSpacing, float* steps, double* g)
{
  SquareSteps(out, n, squaredSpacing, steps, g);
}

// Along y and x in one slice.
template <class T>
void MapSlice(const unsigned char* mask, int nx, int ny, double squaredSpacingY, Lines<T>& row, float* out)
{
  std::vector<float> steps(static_cast<std::size_t>(nx), Infinity);
  for (int j = 0; j < ny; ++j)
    CountSteps(mask + static_cast<std::ptrdiff_t>(nx) * j, nx, steps.data(), out + static_cast<std::ptrdiff_t>(nx) * j);
  std::fill(steps.begin(), steps.end(), Infinity);
  for (int j = ny - 1; j >= 0; --j) {
    float* line = out + static_cast<std::ptrdiff_t>(nx) * j;
    SweepBack(line, nx, static_cast<T>(squaredSpacingY), steps.data(), row.G(0));
    row.Work(1);
    std::copy_n(row.Result(0), nx, line);
  }
}

template <class T>
void Map(const unsigned char* mask, const std::array<int, 3>& n, const Eigen::Vector3d& spacing, double scale, float* out,
         const Progress& progress)
{
  const std::ptrdiff_t sliceStride = static_cast<std::ptrdiff_t>(n[0]) * n[1];
  const std::ptrdiff_t slices = std::max<std::ptrdiff_t>(1, 65536 / sliceStride);
  ParallelRanges(n[2], slices, progress.Part(0.0, 0.5), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    Lines<T> row(n[0], 1, spacing.x());
    for (std::ptrdiff_t k = begin; k < end; ++k)
      MapSlice(mask + k * sliceStride, n[0], n[1], spacing.y() * spacing.y(), row, out + k * sliceStride);
  });
  // Several tiles side by side share the pages of memory that they touch.
  const int together = std::max(1, std::min(8, 4096 / n[2]));
  const std::ptrdiff_t pieces = (n[0] + together * Lanes - 1) / (together * Lanes), count = n[1] * pieces;
  ParallelRanges(
      count, std::max<std::ptrdiff_t>(1, count / 64), progress.Part(0.5, 1.0), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
        std::vector<Lines<T>> lines(static_cast<std::size_t>(together), Lines<T>(n[2], Lanes, spacing.z()));
        for (std::ptrdiff_t item = begin; item < end; ++item) {
          const int first = static_cast<int>(item % pieces) * together * Lanes;
          const int tiles = std::min(together, (n[0] - first + Lanes - 1) / Lanes);
          float* const voxels = out + item / pieces * n[0] + first;
          const auto lanes = [&](int tile) { return std::min(Lanes, n[0] - first - tile * Lanes); };
          for (int k = 0; k < n[2]; ++k)
            for (int t = 0; t < tiles; ++t)
              Gather(voxels + k * sliceStride + t * Lanes, lanes(t), lines[static_cast<std::size_t>(t)].G(k));
          for (int t = 0; t < tiles; ++t)
            lines[static_cast<std::size_t>(t)].Work(lanes(t));
          for (int k = 0; k < n[2]; ++k)
            for (int t = 0; t < tiles; ++t)
              Scatter(lines[static_cast<std::size_t>(t)].Result(k), scale, lanes(t), voxels + k * sliceStride + t * Lanes);
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
  // Axes of one voxel are left out: a 2D image, or a column, is laid out as x and z.
  std::array<int, 3> n{1, 1, 1};
  Eigen::Vector3d s = Eigen::Vector3d::Ones();
  double diagonal = 0.0, diagonalMm = 0.0; // squared
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
    diagonal += (count - 1.0) * (count - 1.0);
    diagonalMm += (count - 1.0) * (count - 1.0) * spacing[axis] * spacing[axis];
    ++axes;
  }
  if (!(diagonalMm <= std::numeric_limits<float>::max()))
    throw Error(Error::Kind::InvalidParameter, "the spacing is too large: squared distances do not fit a float");
  if (axes == 2) {
    std::swap(n[1], n[2]);
    std::swap(s[1], s[2]);
  }

  if (!equal)
    Map<double>(mask.Data(), n, s, 1.0, squaredDistance.Data(), progress);
  else if (diagonal < 16777216.0)
    Map<float>(mask.Data(), n, Eigen::Vector3d::Ones(), s[0] * s[0], squaredDistance.Data(), progress);
  else
    Map<double>(mask.Data(), n, Eigen::Vector3d::Ones(), s[0] * s[0], squaredDistance.Data(), progress);
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
