// SPDX-License-Identifier: BSD-3-Clause
//
// The extremes of a fan lie on its outside: on the faces of its first and last depth (a fan that bends over more than it is wide
// has them on the sides, which these faces bound). They are found on a lattice of beams that is so fine that between its points a
// surface bulges by far less than the hundredth of a voxel that is added.
#include "EmbedGrid.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>

namespace echorama {

EmbedGrid EmbedGridOf(const ImageGeometry& data, const std::array<int, 3>& first, const std::array<int, 3>& last,
                      const PlacedProbe& form, int factor)
{
  if (factor < 1)
    throw Error(Error::Kind::InvalidParameter, "factor must be 1 or more");
  EmbedGrid grid;
  grid.factor = factor;
  for (std::size_t axis = 0; axis < 3; ++axis)
    grid.start[axis] = (std::min(data.dimensions[axis], factor) - 1) / 2;

  // 1. the coarse lattice, as an image of one voxel at the data's first
  ImageGeometry lattice = data;
  lattice.origin = data.IndexToWorld() * Eigen::Vector3d(grid.start[0], grid.start[1], grid.start[2]);
  lattice.spacing = data.spacing * factor;
  const Eigen::Affine3d probeToLattice = lattice.IndexToWorld().inverse() * form.probeToWorld;

  // 2. what has to be in it
  Eigen::AlignedBox3d box;
  constexpr int beams = 96;
  for (int f = 0; f <= beams; ++f)
    for (int s = 0; s <= beams; ++s)
      for (const double depth : {form.geometry.depthMin, form.geometry.depthMax})
        box.extend(probeToLattice *
                   PointOf(form.geometry, {depth, f / static_cast<double>(beams) - 0.5, s / static_cast<double>(beams) - 0.5}));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Eigen::Index a = static_cast<Eigen::Index>(axis);
    double from = std::floor(box.min()[a] - 0.01), to = std::ceil(box.max()[a] + 0.01);
    // Of data in a single slice the result is one, too.
    if (data.dimensions[axis] == 1)
      from = to = 0.0;
    const double firstData = std::ceil((first[axis] - grid.start[axis]) / static_cast<double>(factor));
    const double lastData = std::floor((last[axis] - grid.start[axis]) / static_cast<double>(factor));
    from = std::min(from, std::min(firstData, lastData));
    to = std::max(to, std::max(firstData, lastData));
    if (!(to - from < 100000.0))
      throw Error(Error::Kind::TooLarge,
                  "the fan would need more than 100,000 voxels along one axis; is its margin, or its depth, too large?");
    grid.offset[axis] = static_cast<int>(-from);
    lattice.dimensions[axis] = static_cast<int>(to - from) + 1;
  }
  lattice.origin = lattice.IndexToWorld() * Eigen::Vector3d(-grid.offset[0], -grid.offset[1], -grid.offset[2]);
  grid.geometry = lattice;
  return grid;
}

EmbedGrid EmbedGridOf(const ImageGeometry& data, VolumeView<const unsigned char> region, const PlacedProbe& form, int factor)
{
  std::array<int, 3> first = data.dimensions, last{-1, -1, -1};
  for (int k = 0; k < data.dimensions[2]; ++k)
    for (int j = 0; j < data.dimensions[1]; ++j) {
      const unsigned char *begin = region.Row(j, k), *end = begin + data.dimensions[0];
      const unsigned char* found = std::find_if(begin, end, [](unsigned char real) { return real != 0; });
      if (found == end)
        continue;
      const unsigned char* lastFound = end - 1;
      while (!*lastFound)
        --lastFound;
      first = {std::min(first[0], static_cast<int>(found - begin)), std::min(first[1], j), std::min(first[2], k)};
      last = {std::max(last[0], static_cast<int>(lastFound - begin)), std::max(last[1], j), std::max(last[2], k)};
    }
  return EmbedGridOf(data, first, last, form, factor);
}

void CopyToGrid(const EmbedGrid& grid, const std::array<int, 3>& size, std::size_t bytes, const void* data, void* onGrid)
{
  const auto& n = grid.geometry.dimensions;
  const std::size_t rowBytes = bytes * static_cast<std::size_t>(n[0]);
  ParallelFor(n[2], [&](std::ptrdiff_t slice) {
    const int k = grid.DataIndex(static_cast<int>(slice), 2);
    for (int J = 0; J < n[1]; ++J) {
      char* row = static_cast<char*>(onGrid) + rowBytes * static_cast<std::size_t>(slice * n[1] + J);
      const int j = grid.DataIndex(J, 1);
      std::fill(row, row + rowBytes, char(0));
      if (k < 0 || k >= size[2] || j < 0 || j >= size[1])
        continue;
      const char* source = static_cast<const char*>(data) +
                           bytes * static_cast<std::size_t>((static_cast<std::ptrdiff_t>(k) * size[1] + j) * size[0]);
      if (grid.factor == 1) { // a row as it is
        const int first = std::max(0, -grid.DataIndex(0, 0)), i = grid.DataIndex(first, 0);
        if (const int count = std::min(n[0] - first, size[0] - i); count > 0)
          std::copy_n(source + bytes * static_cast<std::size_t>(i), bytes * static_cast<std::size_t>(count),
                      row + bytes * static_cast<std::size_t>(first));
        continue;
      }
      for (int I = 0; I < n[0]; ++I) {
        const int i = grid.DataIndex(I, 0);
        if (i >= 0 && i < size[0])
          std::copy_n(source + bytes * static_cast<std::size_t>(i), bytes, row + bytes * static_cast<std::size_t>(I));
      }
    }
  });
}

} // namespace echorama
