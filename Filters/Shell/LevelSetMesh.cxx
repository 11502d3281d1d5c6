// SPDX-License-Identifier: BSD-3-Clause
// Marching cubes (Lorensen and Cline, SIGGRAPH 1987) over blocks of cells. The table of cases is not typed in but made, so that
// it can be reasoned about: on each face of a cell, every run of corners that are inside is cut off by a segment of its own. A
// face tells its two cells the same, so surfaces meet; segments, linked, are loops. A loop is divided into triangles such that no
// diagonal lies in a face of the cell: only there could the cell beside it have the same one, and an edge get four triangles.
//
// A point lies on an edge of the lattice and is named by it. Blocks list their triangles by these names; all names, sorted, are
// the points of the mesh. So it does not matter who does which block, and when.
#include "LevelSetMesh.h"
#include "Core/Base/Error.h"
#include "Core/Base/JoinedSets.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>
#include <limits>
#include <map>

namespace echorama {
namespace {

using Eigen::Vector3d;

struct LatticePoint {
  std::uint64_t name;
  Eigen::Vector3f place;
};

struct MeshedBlock {
  std::vector<LatticePoint> points; // by name
  std::vector<std::array<std::uint64_t, 3>> triangles;
};

bool ComesBefore(const LatticePoint& a, const LatticePoint& b)
{
  return a.name < b.name;
}
bool IsSame(const LatticePoint& a, const LatticePoint& b)
{
  return a.name == b.name;
}

int EdgeFrom(int corner, int axis)
{
  for (int edge = 0; edge < 12; ++edge)
    if (CellEdge(edge) == std::make_pair(corner, axis))
      return edge;
  return -1;
}

int EdgeBetween(int a, int b)
{
  const int difference = a ^ b;
  return EdgeFrom(std::min(a, b), difference == 1 ? 0 : difference == 2 ? 1 : 2);
}

bool ShareFace(int a, int b)
{
  const auto [cornerA, axisA] = CellEdge(a);
  const auto [cornerB, axisB] = CellEdge(b);
  for (int axis = 0; axis < 3; ++axis)
    if (axis != axisA && axis != axisB && ((cornerA ^ cornerB) >> axis & 1) == 0)
      return true;
  return false;
}

// Divides a loop with as few diagonals in faces as can be.
void Divide(const std::vector<int>& loop, CellTriangles& triangles)
{
  const auto count = loop.size();
  std::vector<std::vector<int>> cost(count, std::vector<int>(count, 0));
  std::vector<std::vector<std::size_t>> apex(count, std::vector<std::size_t>(count, 0));
  for (std::size_t gap = 2; gap < count; ++gap)
    for (std::size_t i = 0; i + gap < count; ++i) {
      const std::size_t j = i + gap;
      const int own = gap + 1 < count && ShareFace(loop[i], loop[j]) ? 1 : 0; // the last is a side of the loop
      cost[i][j] = std::numeric_limits<int>::max();
      for (std::size_t k = i + 1; k < j; ++k)
        if (cost[i][k] + cost[k][j] + own < cost[i][j]) {
          cost[i][j] = cost[i][k] + cost[k][j] + own;
          apex[i][j] = k;
        }
    }
  std::vector<std::pair<std::size_t, std::size_t>> waiting{{0, count - 1}};
  while (!waiting.empty()) {
    const auto [i, j] = waiting.back();
    waiting.pop_back();
    if (j - i < 2)
      continue;
    const std::size_t k = apex[i][j];
    triangles.push_back(
        {static_cast<std::uint8_t>(loop[i]), static_cast<std::uint8_t>(loop[k]), static_cast<std::uint8_t>(loop[j])});
    waiting.emplace_back(i, k);
    waiting.emplace_back(k, j);
  }
}

CellTriangles TrianglesOf(int inside)
{
  const auto isInside = [inside](int corner) { return (inside >> corner & 1) != 0; };
  std::map<int, int> next; // edge by edge
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3, base = side << axis;
      std::array<int, 4> corner{base, base + u, base + u + v, base + v}; // counter-clockwise as seen from outside
      if (side == 0)
        std::reverse(corner.begin(), corner.end());
      for (std::size_t last = 0; last < 4; ++last) // of a run
        if (isInside(corner[last]) && !isInside(corner[(last + 1) % 4])) {
          std::size_t first = last;
          while (isInside(corner[(first + 3) % 4]))
            first = (first + 3) % 4;
          next[EdgeBetween(corner[(first + 3) % 4], corner[first])] = EdgeBetween(corner[last], corner[(last + 1) % 4]);
        }
    }
  CellTriangles triangles;
  while (!next.empty()) {
    std::vector<int> loop;
    for (int edge = next.begin()->first; next.count(edge);) {
      loop.push_back(edge);
      const int following = next[edge];
      next.erase(edge);
      edge = following;
    }
    Divide(loop, triangles);
  }
  return triangles;
}

MeshedBlock MeshBlock(const LevelSet& levelSet, const Eigen::Array3i& first, const LevelSet::Values& values)
{
  constexpr int nodes = LevelSet::blockNodes;
  const auto node = [](int i, int j, int k) { return static_cast<std::size_t>(i + nodes * (j + nodes * k)); };
  const auto& cases = CellCases();
  const Eigen::Array<std::int64_t, 3, 1> size =
      levelSet.cells.cast<std::int64_t>() + LevelSet::blockNodes; // more than all blocks have
  const float least = static_cast<float>(0.02 * levelSet.cellMm);
  const auto valueAt = [&](std::size_t at) {
    const float value = values[at];
    return std::abs(value) < least ? (value < 0.0f ? -least : least) : value;
  };
  MeshedBlock block;
  for (int k = 0; k < LevelSet::blockCells; ++k)
    for (int j = 0; j < LevelSet::blockCells; ++j)
      for (int i = 0; i < LevelSet::blockCells; ++i) {
        int inside = 0;
        for (int corner = 0; corner < 8; ++corner)
          inside |= static_cast<int>(values[node(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2))] < 0.0f) << corner;
        for (const auto& triangle : cases[static_cast<std::size_t>(inside)]) {
          std::array<std::uint64_t, 3> names{};
          for (std::size_t n = 0; n < 3; ++n) {
            const auto [corner, axis] = CellEdge(triangle[n]);
            const Eigen::Array3i at(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2));
            Eigen::Array3i to = at;
            ++to[axis];
            const float from = valueAt(node(at.x(), at.y(), at.z())), beyond = valueAt(node(to.x(), to.y(), to.z()));
            const Eigen::Array<std::int64_t, 3, 1> place = (first + at).cast<std::int64_t>();
            names[n] = static_cast<std::uint64_t>(3 * (place.x() + size.x() * (place.y() + size.y() * place.z())) + axis);
            Vector3d point = (first + at).cast<double>().matrix();
            point[axis] += static_cast<double>(from) / (static_cast<double>(from) - static_cast<double>(beyond));
            block.points.push_back({names[n], (levelSet.origin + levelSet.cellMm * point).cast<float>()});
          }
          block.triangles.push_back(names);
        }
      }
  std::sort(block.points.begin(), block.points.end(), ComesBefore);
  block.points.erase(std::unique(block.points.begin(), block.points.end(), IsSame), block.points.end());
  return block;
}

Vector3d AreaOf(const std::vector<Eigen::Vector3f>& points, const std::array<std::uint32_t, 3>& triangle)
{
  const Vector3d a = points[triangle[0]].cast<double>();
  return (points[triangle[1]].cast<double>() - a).cross(points[triangle[2]].cast<double>() - a);
}

} // namespace

std::pair<int, int> CellEdge(int edge)
{
  static constexpr std::array<int, 12> corners{0, 2, 4, 6, 0, 1, 4, 5, 0, 1, 2, 3};
  return {corners[static_cast<std::size_t>(edge)], edge / 4};
}

const std::array<CellTriangles, 256>& CellCases()
{
  static const std::array<CellTriangles, 256> cases = [] {
    std::array<CellTriangles, 256> all;
    for (int inside = 0; inside < 256; ++inside)
      all[static_cast<std::size_t>(inside)] = TrianglesOf(inside);
    return all;
  }();
  return cases;
}

TriangleSurface MeshLevelSet(const LevelSet& levelSet, const Progress& progress)
{
  constexpr int edge = LevelSet::blockCells;
  const Eigen::Array3i count = (levelSet.cells + edge - 1) / edge;
  const std::ptrdiff_t rows = static_cast<std::ptrdiff_t>(count.y()) * count.z();
  std::vector<MeshedBlock> blocks(static_cast<std::size_t>(rows));
  // A row of blocks is one task; what it found is put together in the order of its blocks.
  ParallelFor(rows, progress.Part(0.0, 0.85), [&](std::ptrdiff_t row) {
    LevelSet::Values values;
    MeshedBlock& all = blocks[static_cast<std::size_t>(row)];
    for (int i = 0; i < count.x(); ++i) {
      const Eigen::Array3i first = edge * Eigen::Array3i(i, static_cast<int>(row % count.y()), static_cast<int>(row / count.y()));
      if (!levelSet.mayCross(first))
        continue;
      levelSet.sample(first, values);
      const MeshedBlock block = MeshBlock(levelSet, first, values);
      all.points.insert(all.points.end(), block.points.begin(), block.points.end());
      all.triangles.insert(all.triangles.end(), block.triangles.begin(), block.triangles.end());
    }
  });

  std::vector<LatticePoint> points;
  std::vector<std::size_t> start{0};
  for (MeshedBlock& block : blocks) {
    points.insert(points.end(), block.points.begin(), block.points.end());
    start.push_back(start.back() + block.triangles.size());
    block.points = {};
  }
  if (start.back() > std::numeric_limits<std::int32_t>::max())
    throw Error(Error::Kind::TooLarge, "the surface would have " + std::to_string(start.back()) +
                                           " triangles, more than 2^31; ask for a coarser resolution");
  std::sort(points.begin(), points.end(), ComesBefore);
  points.erase(std::unique(points.begin(), points.end(), IsSame), points.end());
  TriangleSurface surface;
  surface.points.reserve(points.size());
  for (const LatticePoint& point : points)
    surface.points.push_back(point.place);
  surface.triangles.resize(start.back());
  ParallelFor(static_cast<std::ptrdiff_t>(blocks.size()), progress.Part(0.85, 1.0), [&](std::ptrdiff_t which) {
    const auto at = static_cast<std::size_t>(which);
    for (std::size_t t = 0; t < blocks[at].triangles.size(); ++t)
      for (std::size_t n = 0; n < 3; ++n) {
        const LatticePoint sought{blocks[at].triangles[t][n], {}};
        surface.triangles[start[at] + t][n] =
            static_cast<std::uint32_t>(std::lower_bound(points.begin(), points.end(), sought, ComesBefore) - points.begin());
      }
  });
  return surface;
}

std::size_t DropCrumbs(TriangleSurface& surface, double smallerThanMm)
{
  JoinedSets<std::uint32_t> pieces(surface.points.size()); // points that hang together
  for (const auto& [a, b, c] : surface.triangles) {
    pieces.Join(a, b);
    pieces.Join(a, c);
  }
  std::vector<Eigen::AlignedBox3f> boxes(surface.points.size());
  for (std::uint32_t i = 0; i < surface.points.size(); ++i)
    boxes[pieces.Of(i)].extend(surface.points[i]);
  const auto isCrumb = [&](std::uint32_t point) {
    return static_cast<double>(boxes[pieces.Of(point)].sizes().maxCoeff()) < smallerThanMm;
  };
  std::size_t crumbs = 0;
  std::uint32_t kept = 0;
  std::vector<std::uint32_t> renamed(surface.points.size());
  for (std::uint32_t i = 0; i < surface.points.size(); ++i) {
    crumbs += pieces.Of(i) == i && isCrumb(i);
    renamed[i] = kept;
    if (!isCrumb(i))
      surface.points[kept++] = surface.points[i];
  }
  surface.points.resize(kept);
  auto& triangles = surface.triangles;
  triangles.erase(std::remove_if(triangles.begin(), triangles.end(), [&](const auto& triangle) { return isCrumb(triangle[0]); }),
                  triangles.end());
  for (auto& triangle : triangles)
    for (std::uint32_t& corner : triangle)
      corner = renamed[corner];
  return crumbs;
}

std::size_t MovePoints(TriangleSurface& surface, const std::function<Vector3d(const Vector3d&)>& target, const Progress& progress)
{
  const std::vector<Eigen::Vector3f> before = surface.points;
  ParallelRanges(static_cast<std::ptrdiff_t>(before.size()), 4096, progress, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
      surface.points[i] = target(before[i].cast<double>()).cast<float>();
  });
  // A point that stays may spoil a triangle beside it: again, until none is spoilt; at worst all stay.
  std::vector<unsigned char> stays(before.size(), 0);
  for (bool isSpoilt = true; isSpoilt;) {
    isSpoilt = false;
    for (const auto& triangle : surface.triangles) {
      const Vector3d old = AreaOf(before, triangle), now = AreaOf(surface.points, triangle);
      if (now.dot(old) >= 0.2 * now.norm() * old.norm() && now.norm() >= 0.2 * old.norm())
        continue;
      for (const std::uint32_t corner : triangle) {
        isSpoilt = isSpoilt || !stays[corner];
        stays[corner] = 1;
      }
    }
    for (std::size_t i = 0; i < before.size(); ++i)
      if (stays[i])
        surface.points[i] = before[i];
  }
  return static_cast<std::size_t>(std::count(stays.begin(), stays.end(), 1));
}

} // namespace echorama
