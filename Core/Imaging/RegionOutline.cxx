// SPDX-License-Identifier: BSD-3-Clause
// 1. Block means: the valid part of each cell, in parallel. All voxels are read once, here.
// 2. Holes: what is outside is flooded from the cells at the border of the grid; cells below one half that it does not reach
//    become 1.
// 3. The largest piece: of the cells that are not at the rim (a line at the border of an image is all rim), regrown by some
//    cells, so that tips are whole again. A region that is nearly all rim keeps it.
// 4. Outline: between each cell of that piece and each of its 6 neighbours below one half, a point; at the end of the grid, a
//    point on the outer face of the cell.
#include "Core/Imaging/RegionOutline.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

using Index3 = std::array<int, 3>;

constexpr float half = 0.5f;
constexpr int regrowth = 3; // cells

// The edge of a cell in voxels along each axis: the shortest edge (mm) grows until there are few enough cells.
Index3 BlockSize(const ImageGeometry& geometry, int maxCells)
{
  Index3 block{1, 1, 1};
  const auto count = [&](int a) { return (geometry.dimensions[a] + block[a] - 1) / block[a]; };
  while (static_cast<double>(count(0)) * count(1) * count(2) > maxCells) {
    int shortest = -1;
    for (int a = 0; a < 3; ++a)
      if (count(a) > 1 && (shortest < 0 || block[a] * geometry.spacing[a] < block[shortest] * geometry.spacing[shortest]))
        shortest = a;
    const int fewer = count(shortest) - 1; // the next size that changes the number of cells
    block[shortest] = (geometry.dimensions[shortest] + fewer - 1) / fewer;
  }
  return block;
}

// Clears all cells that are connected to \a start, through neighbours that are set, and lists them.
void Flood(const Index3& n, std::ptrdiff_t start, std::vector<char>& set, std::vector<std::ptrdiff_t>& cells)
{
  const std::ptrdiff_t strides[3] = {1, n[0], static_cast<std::ptrdiff_t>(n[0]) * n[1]};
  cells.assign(1, start);
  set[start] = 0;
  for (std::size_t done = 0; done < cells.size(); ++done) {
    const std::ptrdiff_t cell = cells[done];
    const std::ptrdiff_t at[3] = {cell % n[0], cell / strides[1] % n[1], cell / strides[2]};
    for (int a = 0; a < 3; ++a)
      for (const int step : {-1, 1})
        if (at[a] + step >= 0 && at[a] + step < n[a] && set[cell + step * strides[a]]) {
          set[cell + step * strides[a]] = 0;
          cells.push_back(cell + step * strides[a]);
        }
  }
}

// Of the cells that are set, the largest connected piece.
std::vector<char> LargestPiece(const Index3& n, std::vector<char> set)
{
  std::vector<std::ptrdiff_t> cells, largest;
  for (std::size_t start = 0; start < set.size(); ++start)
    if (set[start]) {
      Flood(n, static_cast<std::ptrdiff_t>(start), set, cells);
      if (cells.size() > largest.size())
        largest.swap(cells);
    }
  std::vector<char> piece(set.size(), 0);
  for (const std::ptrdiff_t cell : largest)
    piece[cell] = 1;
  return piece;
}

} // namespace

Eigen::Vector3d RegionOutline::CellPosition(int i, int j, int k) const
{
  return geometry.IndexToWorld() * Eigen::Vector3d(centres[0][i], centres[1][j], centres[2][k]);
}

RegionOutline OutlineRegion(VolumeView<const unsigned char> valid, const ImageGeometry& geometry, int maxCells,
                            const Progress& progress)
{
  geometry.Check("the valid region");
  if (valid.Dimensions() != geometry.dimensions || valid.Empty())
    throw Error(Error::Kind::BadInput, "the valid region has another number of voxels than its geometry says");

  RegionOutline outline;
  outline.geometry = geometry;
  const Index3 block = BlockSize(geometry, maxCells);
  Index3 n;
  double cellMm = 1.0;
  int axes = 0;
  for (int a = 0; a < 3; ++a) {
    n[a] = (geometry.dimensions[a] + block[a] - 1) / block[a];
    for (int cell = 0; cell < n[a]; ++cell)
      outline.centres[a].push_back(0.5 * (cell * block[a] + std::min((cell + 1) * block[a], geometry.dimensions[a]) - 1));
    if (geometry.dimensions[a] > 1) {
      cellMm *= block[a] * geometry.spacing[a];
      ++axes;
    }
  }
  outline.cellMm = axes > 0 ? std::pow(cellMm, 1.0 / axes) : geometry.spacing.maxCoeff();
  const auto voxelsOf = [&](int a, int cell) { return std::min(block[a], geometry.dimensions[a] - cell * block[a]); };

  // 1. block means
  outline.filled = Volume<float>(n);
  const VolumeView<float> filled = outline.filled.View();
  ParallelFor(n[2], progress, [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    std::vector<int> sums(n[0]);
    for (int j = 0; j < n[1]; ++j) {
      std::fill(sums.begin(), sums.end(), 0);
      for (int z = 0; z < voxelsOf(2, k); ++z)
        for (int y = 0; y < voxelsOf(1, j); ++y) {
          const unsigned char* row = valid.Row(j * block[1] + y, k * block[2] + z);
          for (int i = 0, x = 0; i < n[0]; ++i)
            for (const int end = x + voxelsOf(0, i); x < end; ++x)
              sums[i] += row[x] != 0;
        }
      for (int i = 0; i < n[0]; ++i)
        filled(i, j, k) = static_cast<float>(sums[i]) / static_cast<float>(voxelsOf(0, i) * voxelsOf(1, j) * voxelsOf(2, k));
    }
  });

  // 2. holes
  const auto forEachCell = [&](const auto& body) {
    std::ptrdiff_t cell = 0;
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i, ++cell)
          body(cell, Index3{i, j, k});
  };
  std::vector<char> empty(static_cast<std::size_t>(filled.Size())); // what is left of it in the end are holes
  std::vector<std::ptrdiff_t> cells;
  for (std::ptrdiff_t cell = 0; cell < filled.Size(); ++cell)
    empty[cell] = filled[cell] < half;
  forEachCell([&](std::ptrdiff_t cell, const Index3& at) {
    bool atBorder = false;
    for (int a = 0; a < 3; ++a)
      atBorder |= n[a] > 1 && (at[a] == 0 || at[a] == n[a] - 1);
    if (atBorder && empty[cell])
      Flood(n, cell, empty, cells);
  });
  const Volume<float> before = outline.filled;
  double sum = 0.0, valids = 0.0;
  forEachCell([&](std::ptrdiff_t cell, const Index3& at) {
    const double voxels = static_cast<double>(voxelsOf(0, at[0])) * voxelsOf(1, at[1]) * voxelsOf(2, at[2]);
    valids += filled[cell] * voxels;
    if (empty[cell])
      filled[cell] = 1.0f;
    sum += filled[cell] * voxels;
  });
  if (!(valids > 0.0))
    throw Error(Error::Kind::BadInput, "the valid region is empty");
  outline.coversGrid = valids == static_cast<double>(valid.Size());
  outline.validMm = sum;
  for (int a = 0; a < 3; ++a)
    if (geometry.dimensions[a] > 1)
      outline.validMm *= geometry.spacing[a];

  // 3. the largest piece
  const std::ptrdiff_t strides[3] = {1, n[0], static_cast<std::ptrdiff_t>(n[0]) * n[1]};
  std::vector<char> inside(static_cast<std::size_t>(filled.Size())), core = inside;
  std::ptrdiff_t insideCount = 0, coreCount = 0;
  double invalid = 0.0;
  forEachCell([&](std::ptrdiff_t cell, const Index3& at) {
    inside[cell] = filled[cell] >= half;
    bool deep = inside[cell];
    for (int a = 0; a < 3; ++a)
      deep =
          deep && (at[a] == 0 || filled[cell - strides[a]] >= half) && (at[a] == n[a] - 1 || filled[cell + strides[a]] >= half);
    core[cell] = deep;
    insideCount += inside[cell];
    coreCount += deep;
    invalid += deep ? 1.0 - before.View()[cell] : 0.0;
  });
  for (std::ptrdiff_t cell = 0; cell < filled.Size(); ++cell)
    if (core[cell])
      filled[cell] = 1.0f;
  if (insideCount == 0)
    throw Error(Error::Kind::NotPossible, "the valid region is scattered: no block of it is half full");
  outline.holesPart = coreCount > 0 ? invalid / static_cast<double>(coreCount) : 0.0;
  const bool isThick = coreCount > insideCount / 4;
  std::vector<char> piece = LargestPiece(n, isThick ? core : inside);
  for (int step = 0; isThick && step < regrowth; ++step) {
    const std::vector<char> smaller = piece;
    forEachCell([&](std::ptrdiff_t cell, const Index3& at) {
      if (!inside[cell] || smaller[cell])
        return;
      for (int z = std::max(at[2] - 1, 0); z <= std::min(at[2] + 1, n[2] - 1); ++z)
        for (int y = std::max(at[1] - 1, 0); y <= std::min(at[1] + 1, n[1] - 1); ++y)
          for (int x = std::max(at[0] - 1, 0); x <= std::min(at[0] + 1, n[0] - 1); ++x)
            piece[cell] |= smaller[z * strides[2] + y * strides[1] + x];
    });
  }
  outline.largestPart = static_cast<double>(std::count(piece.begin(), piece.end(), char(1))) / static_cast<double>(insideCount);

  // 4. outline
  const Eigen::Affine3d toWorld = geometry.IndexToWorld();
  forEachCell([&](std::ptrdiff_t cell, const Index3& at) {
    if (!piece[cell])
      return;
    for (int a = 0; a < 3; ++a) {
      if (n[a] == 1 && geometry.dimensions[a] == 1)
        continue;
      for (const int step : {-1, 1}) {
        Eigen::Vector3d index(outline.centres[0][at[0]], outline.centres[1][at[1]], outline.centres[2][at[2]]);
        const int next = at[a] + step;
        if (next < 0 || next >= n[a]) {
          index[a] = step < 0 ? -0.5 : geometry.dimensions[a] - 0.5;
          outline.points.push_back({toWorld * index, true});
        } else if (const float here = filled[cell], there = filled[cell + step * strides[a]]; there < half) {
          index[a] += (outline.centres[a][next] - index[a]) * (here - half) / (here - there);
          outline.points.push_back({toWorld * index, false});
        }
      }
    }
  });
  return outline;
}

} // namespace echorama
