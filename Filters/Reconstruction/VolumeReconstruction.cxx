// SPDX-License-Identifier: BSD-3-Clause
// Every voxel has a cell: a sum (or maximum, or blend) and a weight. A frame, or a frame in between, is a plane of pixels whose
// voxel coordinates are linear in column and row, kept in 32.32 fixed point, so that the voxel of a pixel is a matter of
// integers: additions and a shift.
//
// Threads share the work by owning slabs of the grid, along y or z, whichever the frame extends further. A slab goes through
// all frames of one call and all their rows; the columns of a row that fall into the slab are an interval, solved in integers
// and therefore without gap or overlap between slabs. A voxel so gets its pixels in the order of the frames, rows and columns
// whatever the number of threads: sums of floats come out the same, and no cell needs a lock.
//
// While it splats a slab notes for each row of voxels the range it has touched. These ranges alone are then written to the
// output. That makes an Add() cost the pixels of the frame and those in between (some ns each), whatever the size of the grid.
//
// The backward blend works on voxels: along a row of voxels the distances from both planes are linear, so the voxels between
// the planes are one or two intervals between their roots.
#include "VolumeReconstruction.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/ZeroedMemory.h"
#include "Core/Imaging/RoundedVoxel.h"
#include "Core/Imaging/VoxelTypes.h"
#include "ReconstructionFrame.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace echorama {

namespace {

using Fixed = std::int64_t;
constexpr double one = 4294967296.0;     // 1 in fixed point
constexpr double farthest = 268435456.0; // voxels from the grid, beyond which fixed point could overflow
constexpr int longestAxis = 1 << 26;     // voxels, for the same reason
constexpr float mostPixels = 65535.0f;   // of a voxel, before its mean moves on
constexpr float leastWeight = 0.125f;    // of a pixel in the middle of eight voxels
constexpr int mostParts = 1000;          // from one frame to the next
constexpr int slabs = 24;                // enough to keep threads busy, few enough to keep the rows' overhead low

struct Cell {
  float value = 0.0f;
  float weight = 0.0f;
};

// The columns of a row whose fixed-point coordinate first + i * step is in [lower, upper), cut to [begin, end).
void Narrow(Fixed first, Fixed step, Fixed lower, Fixed upper, int& begin, int& end)
{
  if (begin >= end)
    return;
  const Fixed at = first + begin * step, last = first + (end - 1) * step;
  if (at >= lower && at < upper && last >= lower && last < upper)
    return;
  if ((at < lower && last < lower) || (at >= upper && last >= upper)) {
    end = begin;
    return;
  }
  // One end at least is inside or they lie on both sides, so step is not 0 and all quotients fit.
  const auto ceiling = [](Fixed a, Fixed b) { return a / b + (a % b > 0); }; // b > 0
  const auto floor = [](Fixed a, Fixed b) { return a / b - (a % b < 0); };   // b > 0
  Fixed from, to;
  if (step > 0) {
    from = ceiling(lower - first, step);
    to = ceiling(upper - first, step);
  } else {
    from = floor(first - upper, -step) + 1;
    to = floor(first - lower, -step) + 1;
  }
  begin = static_cast<int>(std::max<Fixed>(from, begin));
  end = static_cast<int>(std::min<Fixed>(to, end));
}

// Index coordinates of pixel (0, 0), and the steps along columns and rows.
struct PixelMap {
  Eigen::Vector3d first, column, row;
};

PixelMap MapOf(const Eigen::Affine3d& imageToIndex)
{
  return {imageToIndex.translation(), imageToIndex.linear().col(0), imageToIndex.linear().col(1)};
}

// One plane of pixels to splat: a frame (next alone), or one in between.
template <class T>
struct Plane {
  const ReconstructionFrame<T>* previous = nullptr;
  const ReconstructionFrame<T>* next = nullptr;
  const std::vector<PixelSpan>* spans = nullptr;
  float share = 1.0f; // of next
  PixelMap map;
};

// The values of columns [begin, end) of a row, to the same places of \a values.
template <class T>
void ReadRow(const Plane<T>& plane, int row, int begin, int end, float* values)
{
  const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(row) * plane.next->size[0];
  const T* next = plane.next->pixels.data() + first;
  if (!plane.previous) {
    for (int i = begin; i < end; ++i)
      values[i] = static_cast<float>(next[i]);
    return;
  }
  const T* before = plane.previous->pixels.data() + first;
  for (int i = begin; i < end; ++i) {
    const float value = static_cast<float>(before[i]);
    values[i] = value + plane.share * (static_cast<float>(next[i]) - value);
  }
}

Fixed ToFixed(double coordinate)
{
  return static_cast<Fixed>(std::llround(coordinate * one));
}

} // namespace

double ReconstructionMemory(const ReconstructionParameters& parameters, const ImageGeometry& grid, std::size_t voxelBytes)
{
  const bool twoCells = parameters.compounding == Compounding::Latest || parameters.compounding == Compounding::Alpha;
  const double rows = static_cast<double>(grid.dimensions[1]) * grid.dimensions[2];
  const double voxel = static_cast<double>(voxelBytes) + 1.0 + 2.0 + (twoCells ? 2.0 : 1.0) * sizeof(Cell);
  return rows * (grid.dimensions[0] * voxel + 2.0 * sizeof(int));
}

template <class T>
struct VolumeReconstruction<T>::Body {
  ReconstructionParameters parameters;
  ImageGeometry grid;
  ReconstructionOutput<T> output;
  Eigen::Affine3d worldToIndex;
  Zeroed<Cell> cells, latest;              // latest: of the frame at hand (Latest, Alpha)
  std::vector<int> touchedFrom, touchedTo; // per row of voxels
  ReconstructionFrame<T> previous, current;
  bool hasPrevious = false;
  int used = 0, between = 0;

  std::ptrdiff_t RowOf(int j, int k) const { return static_cast<std::ptrdiff_t>(k) * grid.dimensions[1] + j; }
  void Touch(std::ptrdiff_t row, int first, int last)
  {
    int& from = touchedFrom[static_cast<std::size_t>(row)];
    int& to = touchedTo[static_cast<std::size_t>(row)];
    from = std::min(from, first);
    to = std::max(to, last);
  }

  // One or several pixels of mean value "mean" and total weight "weight" reach a voxel.
  template <Compounding how>
  static void Put(Cell& cell, float sum, float most, float weight)
  {
    if constexpr (how == Compounding::Maximum) {
      cell.value = cell.weight == 0.0f ? most : std::max(cell.value, most);
      cell.weight = std::min(cell.weight + weight, mostPixels);
    } else if constexpr (how == Compounding::RunningMean) {
      const float total = cell.weight + weight;
      cell.value = static_cast<float>(RoundedVoxel<T>((sum + cell.weight * cell.value) / total));
      cell.weight = std::min(std::floor(total * 256.0f + 0.5f), mostPixels) / 256.0f;
    } else if (cell.weight + weight <= mostPixels) {
      cell.value += sum;
      cell.weight += weight;
    } else {
      cell.value = (cell.value + sum) / (cell.weight + weight) * mostPixels;
      cell.weight = mostPixels;
    }
  }

  bool Splat(const std::vector<Plane<T>>& planes);
  template <Compounding how, SplatMethod splat>
  bool SplatSlab(const std::vector<Plane<T>>& planes, int axis, int lower, int upper);
  template <bool flush, Compounding how>
  bool NearestRow(const Plane<T>& plane, const PixelSpan& span, int axis, int lower, int upper, float* values,
                  Zeroed<Cell>& target);
  template <bool flush, Compounding how>
  bool LinearRow(const Plane<T>& plane, const PixelSpan& span, int axis, int lower, int upper, float* values,
                 Zeroed<Cell>& target);
  void LayOver(Cell& cell, Cell& fresh) const;
  /// \returns whether voxels between them were reached; nothing where both lie beside the grid
  std::optional<bool> Blend(const ReconstructionFrame<T>& a, const ReconstructionFrame<T>& b);
  void Write(int axis, int lower, int upper, const int* from, const int* to);
};

// What a frame brought to a voxel is laid over what was there.
template <class T>
void VolumeReconstruction<T>::Body::LayOver(Cell& cell, Cell& fresh) const
{
  const float value = fresh.value / fresh.weight;
  const float opacity =
      cell.weight == 0.0f || parameters.compounding == Compounding::Latest ? 1.0f : static_cast<float>(parameters.alpha);
  cell.value += opacity * (value - cell.value);
  cell.weight = std::min(cell.weight + fresh.weight, mostPixels);
  fresh = Cell();
}

// With "flush", visits the same voxels again to lay the frame over them.
template <class T>
template <bool flush, Compounding how>
bool VolumeReconstruction<T>::Body::NearestRow(const Plane<T>& plane, const PixelSpan& span, int axis, int lower, int upper,
                                               float* values, Zeroed<Cell>& target)
{
  Fixed first[3], step[3];
  int begin = span.begin, end = span.end;
  for (const int a : {axis, axis == 1 ? 2 : 1, 0}) {
    first[a] = ToFixed(plane.map.first[a] + plane.map.row[a] * span.row + 0.5);
    step[a] = ToFixed(plane.map.column[a]);
    const Fixed from = a == axis ? lower : 0, to = a == axis ? upper : grid.dimensions[static_cast<std::size_t>(a)];
    Narrow(first[a], step[a], from << 32, to << 32, begin, end);
  }
  if (begin >= end)
    return false;
  if constexpr (!flush)
    ReadRow(plane, span.row, begin, end, values);
  const std::ptrdiff_t nx = grid.dimensions[0];
  Fixed x = first[0] + begin * step[0], y = first[1] + begin * step[1], z = first[2] + begin * step[2];
  // Neighbours along the row that share a voxel are put in together.
  for (int i = begin; i < end;) {
    const Fixed xi = x >> 32, yi = y >> 32, zi = z >> 32;
    float sum = 0.0f, most = std::numeric_limits<float>::lowest();
    int count = 0;
    do {
      if constexpr (!flush) {
        const float value = values[i];
        sum += value;
        most = std::max(most, value);
      }
      ++count;
      ++i;
      x += step[0];
      y += step[1];
      z += step[2];
    } while (i < end && x >> 32 == xi && y >> 32 == yi && z >> 32 == zi);
    const std::ptrdiff_t row = RowOf(static_cast<int>(yi), static_cast<int>(zi));
    const std::size_t at = static_cast<std::size_t>(row * nx + xi);
    if constexpr (flush) {
      if (latest[at].weight > 0.0f)
        LayOver(cells[at], latest[at]);
    } else {
      if constexpr (how == Compounding::RunningMean) {
        for (int n = i - count; n < i; ++n)
          Put<how>(target[at], values[n], values[n], 1.0f);
      } else {
        Put<how>(target[at], sum, most, static_cast<float>(count));
      }
      Touch(row, static_cast<int>(xi), static_cast<int>(xi));
    }
  }
  return true;
}

template <class T>
template <bool flush, Compounding how>
bool VolumeReconstruction<T>::Body::LinearRow(const Plane<T>& plane, const PixelSpan& span, int axis, int lower, int upper,
                                              float* values, Zeroed<Cell>& target)
{
  Fixed first[3], step[3];
  int begin = span.begin, end = span.end;
  for (const int a : {axis, axis == 1 ? 2 : 1, 0}) {
    first[a] = ToFixed(plane.map.first[a] + plane.map.row[a] * span.row);
    step[a] = ToFixed(plane.map.column[a]);
    // The voxel below may lie one before the slab, the voxel above is then in it.
    const Fixed from = a == axis ? lower - 1 : -1, to = a == axis ? upper : grid.dimensions[static_cast<std::size_t>(a)];
    Narrow(first[a], step[a], from * (Fixed(1) << 32), to << 32, begin, end);
  }
  if (begin >= end)
    return false;
  if constexpr (!flush)
    ReadRow(plane, span.row, begin, end, values);
  bool any = false;
  const std::ptrdiff_t nx = grid.dimensions[0];
  const int from[3] = {0, axis == 1 ? lower : 0, axis == 2 ? lower : 0};
  const int to[3] = {grid.dimensions[0], axis == 1 ? upper : grid.dimensions[1], axis == 2 ? upper : grid.dimensions[2]};
  constexpr float scale = 1.0f / 4294967296.0f;
  for (int i = begin; i < end; ++i) {
    int below[3];
    float share[3];
    for (int a = 0; a < 3; ++a) {
      const Fixed at = first[a] + i * step[a];
      below[a] = static_cast<int>(at >> 32);
      share[a] = static_cast<float>(static_cast<std::uint32_t>(at)) * scale;
    }
    if constexpr (!flush && how == Compounding::Mean) {
      // Nearly always all eight are there: two neighbours along x at a time, without a branch for each.
      if (below[0] >= from[0] && below[0] + 1 < to[0] && below[1] >= from[1] && below[1] + 1 < to[1] && below[2] >= from[2] &&
          below[2] + 1 < to[2]) {
        for (int pair = 0; pair < 4; ++pair) {
          const int dy = pair & 1, dz = pair >> 1;
          const float w = (dy ? share[1] : 1.0f - share[1]) * (dz ? share[2] : 1.0f - share[2]);
          const float w0 = w * (1.0f - share[0]), w1 = w * share[0];
          const std::ptrdiff_t row = RowOf(below[1] + dy, below[2] + dz);
          Cell* cell = &target[static_cast<std::size_t>(row * nx + below[0])];
          if (std::max(cell[0].weight, cell[1].weight) < mostPixels - 1.0f) {
            cell[0].value += w0 * values[i];
            cell[0].weight += w0;
            cell[1].value += w1 * values[i];
            cell[1].weight += w1;
          } else {
            Put<how>(cell[0], w0 * values[i], values[i], w0);
            Put<how>(cell[1], w1 * values[i], values[i], w1);
          }
          Touch(row, below[0], below[0] + 1);
        }
        any = true;
        continue;
      }
    }
    for (int dz = 0; dz < 2; ++dz) {
      const int z = below[2] + dz;
      const float wz = dz ? share[2] : 1.0f - share[2];
      if (z < from[2] || z >= to[2] || !(wz > 0.0f))
        continue;
      for (int dy = 0; dy < 2; ++dy) {
        const int y = below[1] + dy;
        const float wy = wz * (dy ? share[1] : 1.0f - share[1]);
        if (y < from[1] || y >= to[1] || !(wy > 0.0f))
          continue;
        const std::ptrdiff_t row = RowOf(y, z);
        for (int dx = 0; dx < 2; ++dx) {
          const int x = below[0] + dx;
          const float w = wy * (dx ? share[0] : 1.0f - share[0]);
          if (x < from[0] || x >= to[0] || !(w > 0.0f))
            continue;
          const std::size_t at = static_cast<std::size_t>(row * nx + x);
          if constexpr (flush) {
            if (latest[at].weight > 0.0f)
              LayOver(cells[at], latest[at]);
          } else {
            if (how == Compounding::Maximum && w < leastWeight)
              continue;
            Put<how>(target[at], w * values[i], values[i], w);
            Touch(row, x, x);
            any = true;
          }
        }
      }
    }
  }
  return any;
}

template <class T>
template <Compounding how, SplatMethod splat>
bool VolumeReconstruction<T>::Body::SplatSlab(const std::vector<Plane<T>>& planes, int axis, int lower, int upper)
{
  constexpr bool byFrame = how == Compounding::Latest || how == Compounding::Alpha;
  constexpr Compounding put = byFrame ? Compounding::Mean : how;
  std::vector<float> values(static_cast<std::size_t>(planes.front().next->size[0]));
  bool any = false;
  for (const Plane<T>& plane : planes) {
    for (const PixelSpan& span : *plane.spans) {
      // Most rows of most slabs end here.
      const double edge = plane.map.first[axis] + plane.map.row[axis] * span.row;
      const double begin = edge + plane.map.column[axis] * span.begin, end = edge + plane.map.column[axis] * (span.end - 1);
      if (std::max(begin, end) < lower - 1.5 || std::min(begin, end) > upper + 0.5)
        continue;
      Zeroed<Cell>& target = byFrame ? latest : cells;
      if constexpr (splat == SplatMethod::Nearest)
        any |= NearestRow<false, put>(plane, span, axis, lower, upper, values.data(), target);
      else
        any |= LinearRow<false, put>(plane, span, axis, lower, upper, values.data(), target);
    }
    if constexpr (byFrame) {
      for (const PixelSpan& span : *plane.spans) {
        if constexpr (splat == SplatMethod::Nearest)
          NearestRow<true, put>(plane, span, axis, lower, upper, nullptr, latest);
        else
          LinearRow<true, put>(plane, span, axis, lower, upper, nullptr, latest);
      }
    }
  }
  return any;
}

// Of the slab, what lies in the box of the frames, \a from and \a to: of all the other rows none was touched.
template <class T>
void VolumeReconstruction<T>::Body::Write(int axis, int lower, int upper, const int* from, const int* to)
{
  const int nx = grid.dimensions[0];
  const bool mean = parameters.compounding == Compounding::Mean;
  for (int k = axis == 2 ? lower : from[2]; k < (axis == 2 ? upper : to[2]); ++k)
    for (int j = axis == 1 ? lower : from[1]; j < (axis == 1 ? upper : to[1]); ++j) {
      const std::size_t row = static_cast<std::size_t>(RowOf(j, k));
      for (int i = touchedFrom[row]; i <= touchedTo[row]; ++i) {
        const std::size_t at = row * static_cast<std::size_t>(nx) + static_cast<std::size_t>(i);
        const Cell& cell = cells[at];
        if (!(cell.weight > 0.0f))
          continue;
        output.intensity.Data()[at] = RoundedVoxel<T>(mean ? cell.value / cell.weight : cell.value);
        output.valid.Data()[at] = 1;
        output.coverage.Data()[at] = static_cast<unsigned short>(std::max(1.0f, std::floor(cell.weight + 0.5f)));
      }
      touchedFrom[row] = nx;
      touchedTo[row] = -1;
    }
}

template <class T>
bool VolumeReconstruction<T>::Body::Splat(const std::vector<Plane<T>>& planes)
{
  // The range of the grid that is reached, along y and z; the longer one is cut into slabs.
  Eigen::AlignedBox3d box;
  for (const Plane<T>& plane : planes)
    for (int corner = 0; corner < 4; ++corner)
      box.extend(plane.map.first + plane.map.column * (corner & 1 ? plane.next->size[0] - 1 : 0) +
                 plane.map.row * (corner & 2 ? plane.next->size[1] - 1 : 0));
  if (!(box.min().minCoeff() > -farthest && box.max().maxCoeff() < farthest))
    return false;
  int from[3], to[3];
  for (int a = 0; a < 3; ++a) {
    from[a] = static_cast<int>(std::max(0.0, std::floor(box.min()[a]) - 1.0));
    to[a] = static_cast<int>(std::min<double>(grid.dimensions[static_cast<std::size_t>(a)], std::ceil(box.max()[a]) + 2.0));
    if (from[a] >= to[a])
      return false;
  }
  const int axis = to[2] - from[2] >= to[1] - from[1] ? 2 : 1;
  const int length = to[axis] - from[axis], thickness = std::max(2, (length + slabs - 1) / slabs);
  const int count = (length + thickness - 1) / thickness;
  std::vector<unsigned char> reached(static_cast<std::size_t>(count), 0);
  ParallelFor(count, [&](std::ptrdiff_t slab) {
    const int lower = from[axis] + static_cast<int>(slab) * thickness, upper = std::min(lower + thickness, to[axis]);
    const auto run = [&](auto splat) {
      constexpr SplatMethod method = decltype(splat)::value;
      switch (parameters.compounding) {
      case Compounding::Mean:
        return SplatSlab<Compounding::Mean, method>(planes, axis, lower, upper);
      case Compounding::Maximum:
        return SplatSlab<Compounding::Maximum, method>(planes, axis, lower, upper);
      case Compounding::RunningMean:
        return SplatSlab<Compounding::RunningMean, method>(planes, axis, lower, upper);
      default:
        return SplatSlab<Compounding::Latest, method>(planes, axis, lower, upper);
      }
    };
    const bool any = parameters.splat == SplatMethod::Nearest ? run(std::integral_constant<SplatMethod, SplatMethod::Nearest>())
                                                              : run(std::integral_constant<SplatMethod, SplatMethod::Linear>());
    Write(axis, lower, upper, from, to);
    reached[static_cast<std::size_t>(slab)] = any;
  });
  return std::find(reached.begin(), reached.end(), 1) != reached.end();
}

namespace {

// From voxel indices to the column, row and signed distance (mm) of a frame.
Eigen::Affine3d IndexToFoot(const Eigen::Affine3d& imageToWorld, const Eigen::Affine3d& indexToWorld)
{
  Eigen::Affine3d frame = imageToWorld;
  frame.linear().col(2) = imageToWorld.linear().col(0).cross(imageToWorld.linear().col(1)).normalized();
  return frame.inverse() * indexToWorld;
}

} // namespace

template <class T>
std::optional<bool> VolumeReconstruction<T>::Body::Blend(const ReconstructionFrame<T>& a, const ReconstructionFrame<T>& b)
{
  Eigen::AlignedBox3d box;
  for (const ReconstructionFrame<T>* frame : {&a, &b})
    for (int corner = 0; corner < 4; ++corner)
      box.extend(worldToIndex * (frame->imageToWorld * Eigen::Vector3d(corner & 1 ? frame->right : frame->left,
                                                                       corner & 2 ? frame->bottom : frame->top, 0.0)));
  int from[3], to[3];
  for (int axis = 0; axis < 3; ++axis) {
    from[axis] = static_cast<int>(std::clamp(std::floor(box.min()[axis]), 0.0, farthest));
    to[axis] = static_cast<int>(
        std::clamp(std::ceil(box.max()[axis]) + 1.0, 0.0, static_cast<double>(grid.dimensions[static_cast<std::size_t>(axis)])));
    if (from[axis] >= to[axis])
      return std::nullopt;
  }
  const Eigen::Affine3d footA = IndexToFoot(a.imageToWorld, grid.IndexToWorld());
  Eigen::Affine3d footB = IndexToFoot(b.imageToWorld, grid.IndexToWorld());
  if (footA.linear().row(2).dot(footB.linear().row(2)) < 0.0) // the probe's image was turned over: count from the same side
    footB.matrix().row(2) *= -1.0;
  const bool linear = parameters.splat == SplatMethod::Linear;
  const int axis = to[2] - from[2] >= to[1] - from[1] ? 2 : 1, other = 3 - axis;
  std::vector<unsigned char> reached(static_cast<std::size_t>(to[axis] - from[axis]), 0);
  ParallelFor(to[axis] - from[axis], [&](std::ptrdiff_t slab) {
    const int lower = from[axis] + static_cast<int>(slab);
    for (int across = from[other]; across < to[other]; ++across) {
      const int j = axis == 1 ? lower : across, k = axis == 1 ? across : lower;
      const Eigen::Vector3d startA = footA * Eigen::Vector3d(0.0, j, k), startB = footB * Eigen::Vector3d(0.0, j, k);
      const Eigen::Vector3d stepA = footA.linear().col(0), stepB = footB.linear().col(0);
      double stops[4] = {static_cast<double>(from[0]), static_cast<double>(from[0]), static_cast<double>(from[0]),
                         static_cast<double>(to[0])};
      const double rootA = -startA[2] / stepA[2], rootB = -startB[2] / stepB[2];
      if (rootA > from[0] && rootA < to[0]) // false for NaN
        stops[1] = rootA;
      if (rootB > from[0] && rootB < to[0])
        stops[2] = rootB;
      if (stops[1] > stops[2])
        std::swap(stops[1], stops[2]);
      int done = from[0];
      for (int segment = 0; segment < 3; ++segment) {
        const double middle = 0.5 * (stops[segment] + stops[segment + 1]);
        if ((startA[2] + middle * stepA[2]) * (startB[2] + middle * stepB[2]) > 0.0)
          continue;
        const int end = std::min(to[0], static_cast<int>(std::ceil(stops[segment + 1])) + 1);
        for (int x = std::max(done, static_cast<int>(stops[segment]) - 1); x < end; ++x) {
          const double distanceA = startA[2] + x * stepA[2], distanceB = startB[2] + x * stepB[2];
          if ((distanceA >= 0.0) == (distanceB >= 0.0)) // a voxel on a plane belongs to one of its two neighbours alone
            continue;
          float valueA, valueB;
          if (!a.Sample(startA[0] + x * stepA[0], startA[1] + x * stepA[1], linear, valueA) ||
              !b.Sample(startB[0] + x * stepB[0], startB[1] + x * stepB[1], linear, valueB))
            continue;
          const double share = std::abs(distanceA) / (std::abs(distanceA) + std::abs(distanceB));
          const float value = valueA + static_cast<float>(share) * (valueB - valueA);
          const std::ptrdiff_t row = RowOf(j, k);
          Cell& cell = cells[static_cast<std::size_t>(row * grid.dimensions[0] + x)];
          Cell fresh{value, 1.0f};
          switch (parameters.compounding) {
          case Compounding::Mean:
            Put<Compounding::Mean>(cell, value, value, 1.0f);
            break;
          case Compounding::Maximum:
            Put<Compounding::Maximum>(cell, value, value, 1.0f);
            break;
          case Compounding::RunningMean:
            Put<Compounding::RunningMean>(cell, value, value, 1.0f);
            break;
          default:
            LayOver(cell, fresh);
          }
          Touch(row, x, x);
          reached[static_cast<std::size_t>(slab)] = 1;
        }
        done = std::max(done, end);
      }
    }
    Write(axis, lower, lower + 1, from, to);
  });
  return std::find(reached.begin(), reached.end(), 1) != reached.end();
}

ParameterList Describe(ReconstructionParameters& p)
{
  return {
      Parameter("Splat", Choice(p.splat, {"nearest", "linear"}),
                "How a pixel goes into the volume: into its nearest voxel, or by linear weights into the eight around it."),
      Parameter(
          "Compounding", Choice(p.compounding, {"mean", "maximum", "latest", "alpha", "running-mean"}),
          "What becomes of a voxel that several pixels reach: their mean, the maximum, the mean of the latest frame's, each "
          "frame laid over the others, or the rounded mean that the Plus toolkit keeps, for comparison."),
      Parameter("Alpha", p.alpha, {0, 1, true}, "", "Opacity of a frame that is laid over the others.")
          .When("Compounding", "alpha"),
      Parameter("Between", Choice(p.between, {"nothing", "forward", "backward"}),
                "What lies between frames that follow each other: nothing; frames with pixels and matrices interpolated; or, "
                "backward, at each voxel a blend of what both frames show at its perpendicular feet."),
      Parameter("StepMm", p.stepMm, {0, Unlimited}, "mm",
                "No pixel moves further than this from one interpolated frame to the next. 0: 0.7 of the smallest spacing.")
          .When("Between", "forward")
          .Advanced(),
      Parameter("MaximumGapMm", p.maximumGapMm, {0, Unlimited, true}, "mm",
                "Frames between which a pixel moves further than this are not joined: the probe was lifted.")
          .When("Between", "forward")
          .When("Between", "backward")
          .Advanced(),
  };
}

template <class T>
VolumeReconstruction<T>::VolumeReconstruction(const ReconstructionParameters& parameters, const ImageGeometry& grid,
                                              const ReconstructionOutput<T>& output)
{
  CheckRanges(parameters);
  grid.Check("the output grid");
  for (const int n : grid.dimensions)
    if (n > longestAxis)
      throw Error(Error::Kind::TooLarge, "the output grid has " + std::to_string(n) + " voxels along an axis; 2^26 are the most");
  if (output.intensity.Dimensions() != grid.dimensions || output.valid.Dimensions() != grid.dimensions ||
      output.coverage.Dimensions() != grid.dimensions)
    throw Error(Error::Kind::BadInput, "an output of the reconstruction is not of the size of the grid");
  body_ = std::make_unique<Body>();
  Body& body = *body_;
  body.parameters = parameters;
  body.grid = grid;
  body.output = output;
  body.worldToIndex = grid.WorldToIndex();
  if (parameters.stepMm == 0.0)
    body.parameters.stepMm = 0.7 * grid.spacing.minCoeff();
  const std::size_t voxels = grid.VoxelCount(), rows = static_cast<std::size_t>(body.RowOf(0, grid.dimensions[2]));
  body.cells = Zeroed<Cell>(voxels);
  if (parameters.compounding == Compounding::Latest || parameters.compounding == Compounding::Alpha)
    body.latest = Zeroed<Cell>(voxels);
  body.touchedFrom.assign(rows, grid.dimensions[0]);
  body.touchedTo.assign(rows, -1);
  std::fill(output.intensity.begin(), output.intensity.end(), T(0));
  std::fill(output.valid.begin(), output.valid.end(), static_cast<unsigned char>(0));
  std::fill(output.coverage.begin(), output.coverage.end(), static_cast<unsigned short>(0));
}

template <class T>
VolumeReconstruction<T>::~VolumeReconstruction() = default;
template <class T>
VolumeReconstruction<T>::VolumeReconstruction(VolumeReconstruction&&) noexcept = default;
template <class T>
VolumeReconstruction<T>& VolumeReconstruction<T>::operator=(VolumeReconstruction&&) noexcept = default;

template <class T>
FrameUse VolumeReconstruction<T>::Add(const TrackedFrame<T>& frame)
{
  Body& body = *body_;
  const auto& size = frame.pixels.Dimensions();
  if (frame.pixels.Empty() || size[0] < 1 || size[1] < 1 || size[2] != 1)
    throw Error(Error::Kind::BadInput, "a frame is " + SizeText(size) + " pixels; it must be one slice");
  if (!frame.mask.Empty() && frame.mask.Dimensions() != size)
    throw Error(Error::Kind::BadInput, "the mask of a frame has another size than its pixels");
  const FrameUse placed = CheckPose(frame.imageToWorld);
  if (placed != FrameUse::Used)
    return placed;
  body.current.Load(frame);
  if (body.current.spans.empty())
    return FrameUse::NoPixels;

  const BetweenFrames between = body.parameters.between;
  const bool neighbours = body.hasPrevious && body.previous.size == body.current.size;
  const double step = neighbours ? LargestStep(body.previous, body.current) : 0.0;
  const bool joined = neighbours && between != BetweenFrames::Nothing && step <= body.parameters.maximumGapMm &&
                      (between == BetweenFrames::Backward || step <= mostParts * body.parameters.stepMm);
  bool reached = false, used = false;
  if (joined && between == BetweenFrames::Backward) {
    const std::optional<bool> blended = body.Blend(body.previous, body.current);
    reached = blended.value_or(false);
    // Two frames in one place have nothing between them, and are none the worse for that.
    used = blended.has_value();
    body.between += reached;
  } else {
    // Those in between first, then the frame itself.
    const Eigen::Affine3d& toIndex = body.worldToIndex;
    std::vector<PixelSpan> common;
    std::vector<Plane<T>> planes;
    const int parts = joined ? std::max(1, static_cast<int>(std::ceil(step / body.parameters.stepMm))) : 1;
    if (parts > 1) {
      const bool everywhere = body.previous.mask.empty() && body.current.mask.empty();
      common = everywhere
                   ? body.current.spans
                   : PixelSpansOf(size, [&body](std::ptrdiff_t at) { return body.previous.Real(at) && body.current.Real(at); });
    }
    for (int part = 1; part <= parts; ++part) {
      Plane<T> plane;
      plane.next = &body.current;
      Eigen::Affine3d pose = body.current.imageToWorld;
      plane.spans = &body.current.spans;
      if (part < parts) {
        const double share = static_cast<double>(part) / parts;
        plane.previous = &body.previous;
        plane.share = static_cast<float>(share);
        plane.spans = &common;
        pose.matrix() = (1.0 - share) * body.previous.imageToWorld.matrix() + share * body.current.imageToWorld.matrix();
      }
      plane.map = MapOf(toIndex * pose);
      planes.push_back(plane);
    }
    reached = used = body.Splat(planes);
    body.between += reached ? parts - 1 : 0;
  }
  std::swap(body.previous, body.current);
  body.hasPrevious = true;
  body.used += used;
  return used ? FrameUse::Used : FrameUse::Outside;
}

template <class T>
void VolumeReconstruction<T>::Break()
{
  body_->hasPrevious = false;
}

template <class T>
int VolumeReconstruction<T>::FramesUsed() const
{
  return body_->used;
}

template <class T>
int VolumeReconstruction<T>::FramesBetween() const
{
  return body_->between;
}

#define EchoramaInstantiate(T) template class VolumeReconstruction<T>;
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
