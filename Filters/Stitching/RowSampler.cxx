// SPDX-License-Identifier: BSD-3-Clause
// Along a row of the grid the position in the volume is a straight line, so the range of voxels within the volume follows
// from a division per axis, and nothing outside of it is looked at. Where all eight neighbours exist, some voxels at a time are
// done together: positions, then the neighbours, two in a row by one load, then the mixture; the first and the last step are
// vector instructions. When all neighbours are real that is the answer, otherwise (at the rim of a mask, near a NaN) Sampler
// gives it.
// Where the volume lies on the grid's own lattice but for a shift, the fractions are the same along the row: that loop has
// no index arithmetic and runs in vector registers, and a shift by whole voxels copies exactly.
// Through a displacement rows are not straight: every voxel's position is computed, and Sampler reads there.
#include "RowSampler.h"
#include "Core/Imaging/VoxelTypes.h"
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace echorama {

namespace {

// Removes the rounding of the chain of matrices, so that whole and half voxels are just that, on every machine.
double Snapped(double value)
{
  constexpr double unit = 1024.0, slack = 1e-11;
  const double nearest = std::round(value * unit) / unit;
  return std::abs(value - nearest) <= slack * std::max(1.0, std::abs(value)) ? nearest : value;
}

template <class A>
[[gnu::always_inline]] inline A Mixed(A a, A b, A t)
{
  return a + t * (b - a);
}

constexpr int chunkSize = 64;

// Where the voxels of a chunk lie: along each axis the index of the lower neighbour, and the fraction of the way to the next.
template <class A>
struct Places {
  int index[3][chunkSize];
  A fraction[3][chunkSize];
};

// The neighbours of the voxels of a chunk: pairs along x, at the lower and upper y of the lower z, then of the upper z.
template <class T>
struct Corners {
  T pair[4][2 * chunkSize];
};

template <class A>
void Place(const double* start, const double* step, int first, int count, Places<A>& places)
{
  for (int axis = 0; axis < 3; ++axis)
    for (int l = 0; l < count; ++l) {
      const double position = start[axis] + (first + l) * step[axis];
      const int index = static_cast<int>(position);
      places.index[axis][l] = index;
      places.fraction[axis][l] = static_cast<A>(position - index);
    }
}

template <class T, class A>
void Mix(const Corners<T>& corners, const Places<A>& places, int count, A* __restrict values)
{
  for (int l = 0; l < count; ++l) {
    const A tx = places.fraction[0][l], ty = places.fraction[1][l], tz = places.fraction[2][l];
    const A a = Mixed(static_cast<A>(corners.pair[0][2 * l]), static_cast<A>(corners.pair[0][2 * l + 1]), tx);
    const A b = Mixed(static_cast<A>(corners.pair[1][2 * l]), static_cast<A>(corners.pair[1][2 * l + 1]), tx);
    const A c = Mixed(static_cast<A>(corners.pair[2][2 * l]), static_cast<A>(corners.pair[2][2 * l + 1]), tx);
    const A d = Mixed(static_cast<A>(corners.pair[3][2 * l]), static_cast<A>(corners.pair[3][2 * l + 1]), tx);
    values[l] = Mixed(Mixed(a, b, ty), Mixed(c, d, ty), tz);
  }
}

// The mask of a volume; empty where it leaves out nothing.
template <class T>
VolumeView<const unsigned char> MaskOf(const PosedVolume<T>& volume)
{
  const auto& valid = volume.valid;
  if (!valid.Empty() && !std::memchr(valid.Data(), 0, static_cast<std::size_t>(valid.Size())))
    return {};
  return valid;
}

} // namespace

GridBox BoxOf(const ImageGeometry& volume, const ImageGeometry& grid, double marginMm)
{
  const Eigen::Affine3d indexToGrid = grid.WorldToIndex() * volume.IndexToWorld();
  const auto& n = volume.dimensions;
  Eigen::AlignedBox3d hull;
  for (int corner = 0; corner < 8; ++corner)
    hull.extend(indexToGrid *
                Eigen::Vector3d((corner & 1 ? n[0] : 0) - 0.5, (corner & 2 ? n[1] : 0) - 0.5, (corner & 4 ? n[2] : 0) - 0.5));
  GridBox box;
  for (int axis = 0; axis < 3; ++axis) {
    // A little wider than the truth: what is outside is found out later.
    const double margin = marginMm / grid.spacing[axis] + 1e-6;
    const double first = std::clamp(std::ceil(hull.min()[axis] - margin), 0.0, static_cast<double>(grid.dimensions[axis]));
    const double last = std::clamp(std::floor(hull.max()[axis] + margin), -1.0, grid.dimensions[axis] - 1.0);
    box.first[axis] = static_cast<int>(first);
    box.size[axis] = std::max(0, static_cast<int>(last - first) + 1);
  }
  return box;
}

// A row of the grid in the volume: at grid index i the position is start + i * step.
template <class T>
struct RowSampler<T>::Line {
  Eigen::Vector3d start, step;
  int begin = 0, end = 0; // grid indices that can lie within the volume
};

template <class T>
RowSampler<T>::RowSampler(const PosedVolume<T>& volume, const ImageGeometry& grid, const DisplacementField* displacement)
  : intensity_(volume.intensity), valid_(MaskOf(volume)), sampler_(volume.intensity, valid_),
    displacement_(displacement && !displacement->IsZero() ? displacement : nullptr), gridToWorld_(grid.IndexToWorld()),
    worldToIndex_(volume.geometry.WorldToIndex()), gridToIndex_(worldToIndex_ * gridToWorld_),
    box_(BoxOf(volume.geometry, grid, displacement_ ? displacement_->Bound() : 0.0))
{
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row)
      gridToIndex_(row, column) = Snapped(gridToIndex_(row, column));
  shifted_ = gridToIndex_.linear().col(0) == Eigen::Vector3d::UnitX();
}

// Where the voxels of a row of the box are read, in index coordinates of the volume.
template <class T>
std::vector<Eigen::Vector3d> RowSampler<T>::DisplacedRow(int j, int k) const
{
  std::vector<Eigen::Vector3d> row(static_cast<std::size_t>(box_.size[0]));
  const Eigen::Vector3d start = gridToWorld_ * Eigen::Vector3d(box_.first[0], j, k), step = gridToWorld_.linear().col(0);
  displacement_->Row(start, step, box_.size[0], row.data());
  for (int i = 0; i < box_.size[0]; ++i) {
    Eigen::Vector3d& position = row[static_cast<std::size_t>(i)];
    position = gridToIndex_ * Eigen::Vector3d(box_.first[0] + i, j, k) + worldToIndex_.linear() * position;
  }
  return row;
}

template <class T>
typename RowSampler<T>::Line RowSampler<T>::LineAt(int j, int k) const
{
  Line line;
  line.step = gridToIndex_.linear().col(0);
  line.start = gridToIndex_.translation() + gridToIndex_.linear().col(1) * j + gridToIndex_.linear().col(2) * k;
  line.begin = box_.first[0];
  line.end = box_.first[0] + box_.size[0];
  Narrow(0.5, line);
  return line;
}

// Leaves out where the line is further than a margin outside of the outermost voxels.
template <class T>
void RowSampler<T>::Narrow(double margin, Line& line) const
{
  double begin = line.begin, end = line.end;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = -margin - line.start[axis], high = intensity_.Dimensions()[axis] - 1 + margin - line.start[axis];
    if (line.step[axis] == 0.0) {
      if (!(low <= 0.0 && high > 0.0))
        end = line.begin; // nowhere; begin may lie beyond the end already
      continue;
    }
    const double a = low / line.step[axis], b = high / line.step[axis];
    // One voxel of slack on both sides against rounding.
    begin = std::max(begin, std::ceil(std::min(a, b)) - 1.0);
    end = std::min(end, std::floor(std::max(a, b)) + 2.0);
  }
  begin = std::min(begin, static_cast<double>(line.end));
  line.begin = static_cast<int>(begin);
  line.end = static_cast<int>(std::max(begin, end));
}

template <class T>
void RowSampler<T>::Inside(int j, int k, unsigned char* inside) const
{
  if (displacement_) {
    for (const Eigen::Vector3d& p : DisplacedRow(j, k))
      *inside++ = static_cast<unsigned char>(sampler_.NearestIndex(p[0], p[1], p[2]) >= 0);
    return;
  }
  const Line line = LineAt(j, k);
  std::fill_n(inside, box_.size[0], static_cast<unsigned char>(0));
  inside -= box_.first[0];
  const auto& n = intensity_.Dimensions();
  const auto at = [&line](int i) { return Eigen::Vector3d(line.start + i * line.step); };
  const auto exact = [&](int i) {
    const Eigen::Vector3d p = at(i);
    return static_cast<unsigned char>(sampler_.NearestIndex(p[0], p[1], p[2]) >= 0);
  };
  // The first and the last two are looked at closely (see LineAt); those between lie within the grid of the volume.
  const int begin = std::min(line.begin + 2, line.end), end = std::max(line.end - 2, begin);
  for (int i = line.begin; i < begin; ++i)
    inside[i] = exact(i);
  for (int i = end; i < line.end; ++i)
    inside[i] = exact(i);
  if (std::is_integral_v<T> && valid_.Empty()) {
    std::fill(inside + begin, inside + end, static_cast<unsigned char>(1));
    return;
  }
  if (shifted_ && begin < end) {
    const Eigen::Vector3d p = at(begin);
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(p[2] + 0.5) * intensity_.SliceStride() +
                                 static_cast<std::ptrdiff_t>(p[1] + 0.5) * intensity_.RowStride() +
                                 static_cast<std::ptrdiff_t>(p[0] + 0.5) - begin;
    for (int i = begin; i < end; ++i)
      inside[i] = sampler_.IsReal(first + i);
    return;
  }
  if (line.step[1] == 0.0 && line.step[2] == 0.0 && begin < end) {
    const std::ptrdiff_t row = std::min(static_cast<int>(line.start[2] + 0.5), n[2] - 1) * intensity_.SliceStride() +
                               std::min(static_cast<int>(line.start[1] + 0.5), n[1] - 1) * intensity_.RowStride();
    for (int i = begin; i < end; ++i)
      inside[i] = sampler_.IsReal(row + std::min(static_cast<int>(line.start[0] + i * line.step[0] + 0.5), n[0] - 1));
    return;
  }
  for (int i = begin; i < end; ++i) {
    const double x = line.start[0] + i * line.step[0], y = line.start[1] + i * line.step[1], z = line.start[2] + i * line.step[2];
    // Where a step is all but zero, rounding could reach the next voxel.
    const std::ptrdiff_t nearest = std::min(static_cast<int>(z + 0.5), n[2] - 1) * intensity_.SliceStride() +
                                   std::min(static_cast<int>(y + 0.5), n[1] - 1) * intensity_.RowStride() +
                                   std::min(static_cast<int>(x + 0.5), n[0] - 1);
    inside[i] = sampler_.IsReal(nearest);
  }
}

template <class T>
template <class A>
void RowSampler<T>::Values(int j, int k, const unsigned char* inside, A* values) const
{
  if (!displacement_) {
    Row<false>(j, k, inside, values);
    return;
  }
  for (const Eigen::Vector3d& p : DisplacedRow(j, k)) {
    double value = 0.0;
    if (*inside++ & 1)
      sampler_.Linear(p[0], p[1], p[2], value);
    *values++ = static_cast<A>(value);
  }
}

template <class T>
template <class A>
void RowSampler<T>::Read(int j, int k, unsigned char* inside, A* values) const
{
  if (displacement_ || shifted_ || !valid_.Empty()) { // where a mask leaves out much, it is well to know that first
    Inside(j, k, inside);
    Values(j, k, inside, values);
  } else {
    std::fill_n(inside, box_.size[0], static_cast<unsigned char>(0));
    Row<true>(j, k, inside, values);
  }
}

// The mixtures of voxels whose neighbours all exist, and which of them are real.
template <class T>
template <class A>
void RowSampler<T>::Chunk(const Line& line, int first, int count, A* values, unsigned char* real) const
{
  Places<A> places;
  Corners<T> corners;
  Place(line.start.data(), line.step.data(), first, count, places);
  const std::ptrdiff_t row = intensity_.RowStride(), slice = intensity_.SliceStride();
  std::ptrdiff_t at[chunkSize];
  for (int l = 0; l < count; ++l) {
    at[l] = places.index[2][l] * slice + places.index[1][l] * row + places.index[0][l];
    const T* const lowest = intensity_.Data() + at[l];
    const T* const rows[4] = {lowest, lowest + row, lowest + slice, lowest + slice + row};
    for (int n = 0; n < 4; ++n)
      std::memcpy(&corners.pair[n][2 * l], rows[n], 2 * sizeof(T));
  }
  Mix(corners, places, count, values);
  std::fill_n(real, count, static_cast<unsigned char>(1));
  for (int l = 0; l < count && !valid_.Empty(); ++l) {
    const unsigned char* const lowest = valid_.Data() + at[l];
    std::uint16_t pairs[4];
    std::memcpy(&pairs[0], lowest, 2);
    std::memcpy(&pairs[1], lowest + row, 2);
    std::memcpy(&pairs[2], lowest + slice, 2);
    std::memcpy(&pairs[3], lowest + slice + row, 2);
    const int all = pairs[0] & pairs[1] & pairs[2] & pairs[3];
    real[l] = (all & (all >> 8) & 0xff) != 0;
  }
  if constexpr (std::is_floating_point_v<T>)
    for (int l = 0; l < count; ++l)
      real[l] &= std::isfinite(values[l]) ? 1 : 0; // a neighbour that is not finite shows in the mixture
}

// Where voxels are inside is found, or known.
template <class T>
template <bool Finds, class A>
void RowSampler<T>::Row(int j, int k, std::conditional_t<Finds, unsigned char, const unsigned char>* inside, A* values) const
{
  const Line line = LineAt(j, k);
  inside -= box_.first[0];
  values -= box_.first[0];
  const auto& n = intensity_.Dimensions();
  const T* const data = intensity_.Data();
  const unsigned char* const valid = valid_.Data();

  // The voxel below a position on one axis, the step to the next one and the fraction of the way; beyond the rim the rim's
  // value goes on.
  struct Neighbours {
    Neighbours(double position, int count, std::ptrdiff_t stride)
    {
      const double last = count - 1.0;
      const double clamped = position > 0.0 ? (position < last ? position : last) : 0.0;
      const int index = static_cast<int>(clamped);
      fraction = static_cast<A>(clamped - index);
      first = index * stride;
      step = index + 1 < count ? stride : 0;
    }
    std::ptrdiff_t first, step;
    A fraction;
  };
  const auto mixed = [data](std::ptrdiff_t first, std::ptrdiff_t sx, A tx, const Neighbours& y, const Neighbours& z) {
    const T *const a = data + first, *const b = a + y.step, *const c = a + z.step, *const d = b + z.step;
    const A lower = Mixed(Mixed(static_cast<A>(a[0]), static_cast<A>(a[sx]), tx),
                          Mixed(static_cast<A>(b[0]), static_cast<A>(b[sx]), tx), y.fraction);
    const A upper = Mixed(Mixed(static_cast<A>(c[0]), static_cast<A>(c[sx]), tx),
                          Mixed(static_cast<A>(d[0]), static_cast<A>(d[sx]), tx), y.fraction);
    return Mixed(lower, upper, z.fraction);
  };
  const auto allReal = [valid](std::ptrdiff_t first, std::ptrdiff_t sx, const Neighbours& y, const Neighbours& z, A value) {
    if constexpr (std::is_floating_point_v<T>)
      if (!std::isfinite(value)) // a neighbour that is not finite shows in the mixture
        return false;
    if (!valid)
      return true;
    const unsigned char *const a = valid + first, *const b = a + y.step, *const c = a + z.step, *const d = b + z.step;
    return (a[0] & a[sx] & b[0] & b[sx] & c[0] & c[sx] & d[0] & d[sx]) != 0;
  };
  const auto precise = [&](int i) {
    double value = 0.0;
    sampler_.Linear(line.start[0] + i * line.step[0], line.start[1] + i * line.step[1], line.start[2] + i * line.step[2], value);
    return static_cast<A>(value);
  };

  const auto isInside = [&](int i) {
    if constexpr (Finds)
      inside[i] = sampler_.NearestIndex(line.start[0] + i * line.step[0], line.start[1] + i * line.step[1],
                                        line.start[2] + i * line.step[2]) >= 0;
    return (inside[i] & 1) != 0;
  };
  const auto oneByOne = [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      if (!isInside(i))
        continue;
      const Neighbours x(line.start[0] + i * line.step[0], n[0], 1),
          y(line.start[1] + i * line.step[1], n[1], intensity_.RowStride()),
          z(line.start[2] + i * line.step[2], n[2], intensity_.SliceStride());
      const std::ptrdiff_t first = x.first + y.first + z.first;
      values[i] = mixed(first, x.step, x.fraction, y, z);
      if (!allReal(first, x.step, y, z, values[i]))
        values[i] = precise(i);
    }
  };

  int begin = line.begin;
  const int end = line.end;
  if (shifted_) {
    const Neighbours y(line.start[1], n[1], intensity_.RowStride()), z(line.start[2], n[2], intensity_.SliceStride());
    const double whole = std::floor(line.start[0]);
    const A tx = static_cast<A>(line.start[0] - whole);
    // Voxels whose two neighbours along x exist; those before and after are left to the loop above.
    const std::ptrdiff_t shift = static_cast<std::ptrdiff_t>(whole), rows = y.first + z.first + shift;
    const int from = static_cast<int>(std::max<std::ptrdiff_t>(begin, -shift));
    const int to = static_cast<int>(std::min<std::ptrdiff_t>(end, n[0] - 1 - shift));
    if (from < to) {
      for (int i = from; i < to; ++i)
        values[i] = mixed(rows + i, 1, tx, y, z);
      for (int i = from; i < to; ++i)
        if (isInside(i) && !allReal(rows + i, 1, y, z, values[i]))
          values[i] = precise(i);
      for (int i = begin; i < from; ++i)
        if (isInside(i))
          values[i] = precise(i);
      begin = to;
    }
    oneByOne(begin, end);
    return;
  }
  // Voxels all of whose neighbours exist. Positions go up or down along the row, so that it is enough to look at both ends.
  Line inner = line;
  Narrow(0.0, inner);
  const auto surrounded = [&](int i) {
    bool is = true;
    for (int axis = 0; axis < 3; ++axis) {
      const double position = line.start[axis] + i * line.step[axis];
      is = is && position >= 0.0 && position < n[axis] - 1.0;
    }
    return is;
  };
  while (inner.begin < inner.end && !surrounded(inner.begin))
    ++inner.begin;
  while (inner.begin < inner.end && !surrounded(inner.end - 1))
    --inner.end;
  oneByOne(begin, inner.begin);
  for (int i = inner.begin; i < inner.end; i += chunkSize) {
    const int count = std::min(chunkSize, inner.end - i);
    if (!Finds && std::none_of(inside + i, inside + i + count, [](unsigned char in) { return (in & 1) != 0; }))
      continue;
    unsigned char real[chunkSize];
    Chunk(line, i, count, values + i, real);
    if constexpr (Finds)
      std::copy_n(real, count, inside + i);
    if (std::memchr(real, 0, static_cast<std::size_t>(count)))
      for (int l = 0; l < count; ++l)
        if (!real[l] && isInside(i + l))
          values[i + l] = precise(i + l);
  }
  oneByOne(inner.end, end);
}

#define EchoramaInstantiate(T)                                                                                                   \
  template class RowSampler<T>;                                                                                                  \
  template void RowSampler<T>::Values<float>(int, int, const unsigned char*, float*) const;                                      \
  template void RowSampler<T>::Values<double>(int, int, const unsigned char*, double*) const;                                    \
  template void RowSampler<T>::Read<float>(int, int, unsigned char*, float*) const;                                              \
  template void RowSampler<T>::Read<double>(int, int, unsigned char*, double*) const;
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
