// SPDX-License-Identifier: BSD-3-Clause
// Per volume: faces of the seam tell boundary values (the mean of the voxel's faces), voxels of its own region that touch the
// overlap are 0, and the rest of the overlap is one membrane, in spans of rows. Known values of one side of a seam are known on
// the other side too, where the volume goes on unseen, so that interpolation between voxels of the grid crosses no step.
#include "Filters/Stitching/Benchmarks/StitchOffsets.h"
#include "Core/Base/Error.h"
#include "Filters/Stitching/Benchmarks/SeamCut.h"
#include "Filters/Stitching/Membrane.h"
#include <algorithm>
#include <cmath>
#include <memory>

namespace echorama {

namespace {

using Voxel = std::array<int, 3>;

bool IsInside(const CoarseVolume& volume, const Voxel& at)
{
  const GridBox& box = volume.inside.box;
  return box.HasRow(at[1], at[2]) && at[0] >= box.first[0] && at[0] < box.first[0] + box.size[0] &&
         (volume.inside.Row(at[1], at[2])[at[0] - box.first[0]] & 1);
}

double Low(const CoarseVolume& volume, const Voxel& at)
{
  return volume.low.Row(at[1], at[2])[at[0] - volume.low.box.first[0]];
}

// body(neighbour) for the neighbours of a voxel within a grid.
template <class Body>
void ForNeighbours(const Voxel& at, const std::array<int, 3>& dimensions, const Body& body)
{
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {-1, 1}) {
      Voxel next = at;
      next[axis] += side;
      if (next[axis] >= 0 && next[axis] < dimensions[axis])
        body(next);
    }
}

Boxed<float> OffsetField(int v, const std::vector<CoarseVolume>& volumes, const Volume<unsigned short>& labels,
                         VolumeView<const unsigned char> shared, const Eigen::Vector3d& spacing, const Progress& progress)
{
  const CoarseVolume& volume = volumes[v];
  const GridBox& box = volume.inside.box;
  const std::array<int, 3>& n = labels.Dimensions();
  Boxed<float> field{box, Volume<float>(box.size)};
  Boxed<unsigned char> kinds{box, Volume<unsigned char>(box.size)};
  std::vector<int> first(static_cast<std::size_t>(box.size[1]) * box.size[2]), end(first.size());
  ForRows(box, progress.Part(0.0, 0.3), [&](int j, int k) {
    const std::size_t row = static_cast<std::size_t>(k - box.first[2]) * box.size[1] + (j - box.first[1]);
    first[row] = end[row] = box.first[0];
    for (int i = box.first[0]; i < box.first[0] + box.size[0]; ++i) {
      const Voxel p{i, j, k};
      if (!IsInside(volume, p))
        continue;
      double sum = 0.0;
      int faces = 0;
      bool touchesOverlap = false;
      const int a = labels.View()(i, j, k);
      ForNeighbours(p, n, [&](const Voxel& q) {
        const int b = labels.View()(q[0], q[1], q[2]);
        touchesOverlap = touchesOverlap || (IsInside(volume, q) && shared(q[0], q[1], q[2]));
        // The other volume of a seam between this volume and another.
        if (a == b || a == noVolume || b == noVolume || (a != v && b != v))
          return;
        const CoarseVolume& other = volumes[a == v ? b : a];
        double difference = 0.0;
        int both = 0;
        for (const Voxel& x : {p, q})
          if (IsInside(volume, x) && IsInside(other, x)) {
            const double here = Low(other, x) - Low(volume, x);
            if (std::isfinite(here)) {
              difference += here;
              ++both;
            }
          }
        if (both > 0) {
          sum += 0.5 * difference / both;
          ++faces;
        }
      });
      const bool overlap = shared(i, j, k) != 0;
      if (!overlap && !touchesOverlap)
        continue;
      const bool known = faces > 0 || !overlap;
      kinds.Row(j, k)[i - box.first[0]] = static_cast<unsigned char>(known ? MembraneVoxel::Known : MembraneVoxel::Unknown);
      if (faces > 0)
        field.Row(j, k)[i - box.first[0]] = static_cast<float>(sum / faces);
      if (first[row] == end[row])
        first[row] = i;
      end[row] = i + 1;
    }
  });
  const auto spans = std::make_shared<const RowSpans>(box, std::move(first), std::move(end));
  if (spans->Count() == 0)
    return field;
  RowField<unsigned char> spanKinds(spans);
  RowField<float> values(spans);
  const auto forSpans = [&](const auto& body) {
    ForRows(box, Progress(), [&](int j, int k) {
      if (spans->First(j, k) < spans->End(j, k))
        body(j, k, spans->First(j, k) - box.first[0], spans->End(j, k) - box.first[0]);
    });
  };
  forSpans([&](int j, int k, int from, int to) {
    std::copy(kinds.Row(j, k) + from, kinds.Row(j, k) + to, spanKinds.Row(j, k));
    std::copy(field.Row(j, k) + from, field.Row(j, k) + to, values.Row(j, k));
  });
  SolveMembrane(spanKinds, spacing, values, 0.0f, {}, progress.Part(0.3, 1.0));
  forSpans([&](int j, int k, int from, int to) {
    const float* solved = values.Row(j, k);
    for (int i = from; i < to; ++i)
      if (kinds.Row(j, k)[i] != static_cast<unsigned char>(MembraneVoxel::Void))
        field.Row(j, k)[i] = solved[i - from];
  });
  return field;
}

} // namespace

std::vector<Boxed<float>> OffsetFields(const std::vector<CoarseVolume>& volumes, const Volume<unsigned short>& labels,
                                       const Eigen::Vector3d& spacing, const Progress& progress)
{
  const GridBox grid{{0, 0, 0}, labels.Dimensions()};
  Volume<unsigned char> count(grid.size);
  for (const CoarseVolume& volume : volumes) {
    const GridBox& box = volume.inside.box;
    if (!box.Empty() && box.Intersected(grid).VoxelCount() != box.VoxelCount())
      throw Error(Error::Kind::InvalidParameter, "offsets: the box of a volume must lie within the grid of the labels");
    ForRows(box, Progress(), [&](int j, int k) {
      unsigned char* row = count.View().Row(j, k) + box.first[0];
      for (int i = 0; i < box.size[0]; ++i)
        row[i] = static_cast<unsigned char>(std::min(2, row[i] + (volume.inside.Row(j, k)[i] & 1)));
    });
  }
  for (unsigned char& c : count.View())
    c = c > 1;
  std::vector<Boxed<float>> fields;
  const double all = static_cast<double>(volumes.size());
  for (std::size_t v = 0; v < volumes.size(); ++v)
    fields.push_back(OffsetField(static_cast<int>(v), volumes, labels, count.View(), spacing,
                                 progress.Part(static_cast<double>(v) / all, static_cast<double>(v + 1) / all)));
  return fields;
}

} // namespace echorama
