// SPDX-License-Identifier: BSD-3-Clause
// Levels halve every axis that has more than one voxel: voxel q of a level lies over voxel 2q of the finer one. One volume after
// the other goes through its pyramid, in its own box grown by as far as coarse voxels reach and aligned to the coarsest level,
// and adds share * band to a sum per level; sums are divided by what shares came together, and collapsed once at the end.
//
// Normalised means that the mean of the five (weights 1 4 6 4 1) takes only the voxels that are there, and a coarse voxel counts
// by how much of it was. Expanding reads the same pairs of voxels the other way, so it never meets a coarse voxel that has
// nothing. Both are separable in the sums, not in the quotients: value * weight and weight go through the passes side by side.
#include "Filters/Stitching/Benchmarks/Multiband.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <array>
#include <cmath>

namespace echorama {

namespace {

using Field = Volume<float>;

Field Product(const Field& a, const Field& b)
{
  Field product(a.Dimensions());
  const float *first = a.View().Data(), *second = b.View().Data();
  float* out = product.View().Data();
  ParallelRanges(product.View().Size(), 1 << 16, Progress(), [=](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t n = begin; n < end; ++n)
      out[n] = first[n] * second[n];
  });
  return product;
}

// Where the denominator is 0, so is the quotient.
void Divide(Field& numerator, const Field& denominator)
{
  float* value = numerator.View().Data();
  const float* by = denominator.View().Data();
  ParallelRanges(numerator.View().Size(), 1 << 16, Progress(), [=](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t n = begin; n < end; ++n)
      value[n] = by[n] > 0.0f ? value[n] / by[n] : 0.0f;
  });
}

// Where one place along an axis reads, and with which weights.
struct Taps {
  int count = 0;
  std::array<int, 5> place{};
  std::array<float, 5> weight{};
  void Add(int at, float by)
  {
    place[count] = at;
    weight[count++] = by;
  }
};

// A field with another size along one axis: weighted sums along it.
Field Filter(const Field& field, int axis, const std::vector<Taps>& taps)
{
  std::array<int, 3> n = field.Dimensions();
  n[axis] = static_cast<int>(taps.size());
  Field out(n);
  ForRows({{0, 0, 0}, n}, Progress(), [&](int j, int k) {
    float* to = out.View().Row(j, k);
    if (axis == 0) {
      const float* from = field.View().Row(j, k);
      for (int i = 0; i < n[0]; ++i) {
        float sum = 0.0f;
        for (int t = 0; t < taps[i].count; ++t)
          sum += taps[i].weight[t] * from[taps[i].place[t]];
        to[i] = sum;
      }
      return;
    }
    const Taps& row = taps[axis == 1 ? j : k];
    for (int t = 0; t < row.count; ++t) {
      const float* from = axis == 1 ? field.View().Row(row.place[t], k) : field.View().Row(j, row.place[t]);
      for (int i = 0; i < n[0]; ++i)
        to[i] += row.weight[t] * from[i];
    }
  });
  return out;
}

int Halved(int size)
{
  return (size + 1) / 2;
}

constexpr std::array<float, 5> kernel{1.0f / 16, 4.0f / 16, 6.0f / 16, 4.0f / 16, 1.0f / 16};

// Sums of what lies around every other voxel; what lies beyond the border counts nothing.
Field Reduced(Field field)
{
  for (int axis = 0; axis < 3; ++axis) {
    const int size = field.Dimensions()[axis];
    if (size == 1)
      continue;
    std::vector<Taps> taps(Halved(size));
    for (int q = 0; q < static_cast<int>(taps.size()); ++q)
      for (int t = -2; t <= 2; ++t)
        if (2 * q + t >= 0 && 2 * q + t < size)
          taps[q].Add(2 * q + t, kernel[t + 2]);
    field = Filter(field, axis, taps);
  }
  return field;
}

// The transpose of Reduced.
Field Expanded(Field field, const std::array<int, 3>& dimensions)
{
  for (int axis = 0; axis < 3; ++axis) {
    if (dimensions[axis] == 1)
      continue;
    std::vector<Taps> taps(dimensions[axis]);
    for (int p = 0; p < dimensions[axis]; ++p)
      for (int q = (p - 1) / 2; q <= (p + 2) / 2; ++q)
        if (std::abs(2 * q - p) <= 2 && q < field.Dimensions()[axis])
          taps[p].Add(q, kernel[p - 2 * q + 2]);
    field = Filter(field, axis, taps);
  }
  return field;
}

// A field at the next coarser level, and how much of each voxel is there. The weight is kept away from underflow: only ratios of
// neighbours matter.
std::pair<Field, Field> Coarser(const Field& field, const Field& weight)
{
  Field coarse = Reduced(Product(field, weight)), there = Reduced(weight);
  Divide(coarse, there);
  for (float& w : there.View())
    w = w > 0.0f ? std::max(w, 1e-6f) : 0.0f;
  return {std::move(coarse), std::move(there)};
}

// A field at the next finer level, from voxels that are there.
Field Finer(const Field& field, const Field& there, const std::array<int, 3>& dimensions)
{
  Field known(there.Dimensions());
  std::transform(there.View().begin(), there.View().end(), known.View().begin(), [](float w) { return w > 0.0f ? 1.0f : 0.0f; });
  Field fine = Expanded(Product(field, known), dimensions);
  Divide(fine, Expanded(std::move(known), dimensions));
  return fine;
}

// One level of the output: sums over volumes, in the whole grid of that level.
struct Level {
  Field sum, shares;
};

// Adds share * band of a piece of a level that begins at a voxel of it.
void Add(Level& level, const std::array<int, 3>& first, const Field& band, const Field& share)
{
  ForRows({first, band.Dimensions()}, Progress(), [&](int j, int k) {
    const float *values = band.View().Row(j - first[1], k - first[2]), *weights = share.View().Row(j - first[1], k - first[2]);
    float *sum = level.sum.View().Row(j, k) + first[0], *shares = level.shares.View().Row(j, k) + first[0];
    for (int i = 0; i < band.Dimensions()[0]; ++i) {
      sum[i] += weights[i] * values[i];
      shares[i] += weights[i];
    }
  });
}

// The box of a volume, grown by as far as its coarsest voxels reach, and aligned to them.
GridBox Grown(const GridBox& box, const std::array<int, 3>& dimensions, int levels)
{
  const long cell = 1L << levels, reach = 2 * cell;
  GridBox grown;
  for (int axis = 0; axis < 3; ++axis) {
    grown.first[axis] = static_cast<int>(std::max(0L, (box.first[axis] - reach) / cell * cell));
    const long end = std::min<long>(dimensions[axis], box.first[axis] + box.size[axis] + reach);
    grown.size[axis] = static_cast<int>(end) - grown.first[axis];
  }
  return grown;
}

} // namespace

Volume<float> BlendMultiband(const std::vector<ResampledVolume>& volumes, const std::array<int, 3>& dimensions, int levels,
                             const Progress& progress)
{
  if (levels < 0 || levels > 16)
    throw Error(Error::Kind::InvalidParameter, "multiband: levels must be in [0, 16]");
  const GridBox grid{{0, 0, 0}, dimensions};
  for (const ResampledVolume& volume : volumes)
    if (!volume.inside.box.Empty() && volume.inside.box.Intersected(grid).VoxelCount() != volume.inside.box.VoxelCount())
      throw Error(Error::Kind::InvalidParameter, "multiband: the box of a volume must lie within the grid");
  while (levels > 0 && (1 << levels) > 2 * *std::max_element(dimensions.begin(), dimensions.end()))
    --levels;
  std::vector<Level> output;
  for (std::array<int, 3> n = dimensions; static_cast<int>(output.size()) <= levels;
       n = {Halved(n[0]), Halved(n[1]), Halved(n[2])})
    output.push_back({Field(n), Field(n)});
  const double steps = static_cast<double>(volumes.size() * (levels + 1) + levels + 1);
  double step = 0.0;
  Volume<unsigned char> covered(dimensions);
  for (const ResampledVolume& volume : volumes) {
    const GridBox& own = volume.inside.box;
    if (own.Empty()) {
      step += levels + 1;
      continue;
    }
    GridBox box = Grown(own, dimensions, levels);
    Field value(box.size), weight(box.size), share(box.size);
    ForRows(own, Progress(), [&](int j, int k) {
      const std::ptrdiff_t shift = own.first[0] - box.first[0];
      float* v = value.View().Row(j - box.first[1], k - box.first[2]) + shift;
      float* w = weight.View().Row(j - box.first[1], k - box.first[2]) + shift;
      float* s = share.View().Row(j - box.first[1], k - box.first[2]) + shift;
      unsigned char* c = covered.View().Row(j, k) + own.first[0];
      const unsigned char* inside = volume.inside.Row(j, k);
      for (int i = 0; i < own.size[0]; ++i)
        if ((inside[i] & 1) && std::isfinite(volume.values.Row(j, k)[i])) {
          v[i] = volume.values.Row(j, k)[i];
          w[i] = 1.0f;
          s[i] = std::max(0.0f, volume.share.Row(j, k)[i]);
          c[i] = 1;
        }
    });
    for (int level = 0; level <= levels; ++level) {
      progress(step++ / steps);
      if (level == levels) {
        Add(output[level], box.first, value, share);
        break;
      }
      auto [coarse, there] = Coarser(value, weight);
      const Field smooth = Finer(coarse, there, value.Dimensions());
      for (std::ptrdiff_t n = 0; n < value.View().Size(); ++n)
        value.View()[n] -= smooth.View()[n];
      Add(output[level], box.first, value, share);
      value = std::move(coarse);
      weight = std::move(there);
      share = Reduced(std::move(share));
      for (int& first : box.first)
        first /= 2;
    }
  }
  for (int level = levels; level >= 0; --level) {
    progress(step++ / steps);
    Divide(output[level].sum, output[level].shares);
    if (level == levels)
      continue;
    const Field smooth = Finer(output[level + 1].sum, output[level + 1].shares, output[level].sum.Dimensions());
    for (std::ptrdiff_t n = 0; n < smooth.View().Size(); ++n)
      output[level].sum.View()[n] += smooth.View()[n];
    output[level + 1] = {};
  }
  Field result = std::move(output.front().sum);
  for (std::ptrdiff_t n = 0; n < result.View().Size(); ++n)
    if (!covered.View()[n])
      result.View()[n] = 0.0f;
  progress(1.0);
  return result;
}

} // namespace echorama
