// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Filters/Tissue/SurfaceCheck.h"
#include <array>
#include <cstdint>
#include <Eigen/Core>
#include <functional>
#include <utility>
#include <vector>

namespace echorama {

/// A function on a lattice of points, negative inside a solid, which is looked at in blocks.
struct LevelSet {
  static constexpr int blockCells = 8, blockNodes = blockCells + 1; ///< along an axis
  using Values = std::array<float, blockNodes * blockNodes * blockNodes>;

  Eigen::Vector3d origin = Eigen::Vector3d::Zero(); ///< of node (0, 0, 0), mm
  double cellMm = 1.0;
  Eigen::Array3i cells{0, 0, 0}; ///< the solid lies within them

  /// Whether the surface may run through a block, of which \a first is the lowest node. Called from several threads, as sample
  /// is.
  std::function<bool(const Eigen::Array3i& first)> mayCross;
  /// Sets the values at the nodes of a block, x fastest, of which \a first is the lowest.
  std::function<void(const Eigen::Array3i& first, Values& values)> sample;
};

/// The surface on which the function is 0: closed, without an edge of more than two triangles, and facing outwards, whatever the
/// values are; as long as the lattice reaches beyond the solid, and mayCross never says no where the surface is. Values nearer to
/// 0 than 0.02 of a cell count as that, so that no triangle is without area.
///
/// Cost: what mayCross costs per block, 729 samples per block that the surface may cross, and a sort of the points. The result
/// does not depend on the number of threads. \throws Error(TooLarge) beyond 2^31 triangles, Error(Cancelled)
TriangleSurface MeshLevelSet(const LevelSet& levelSet, const Progress& progress = {});

/// Moves each point to where \a target says, unless that would turn a triangle over, or flatten it: then all points of that
/// triangle stay. \returns how many stayed
std::size_t MovePoints(TriangleSurface& surface, const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& target,
                       const Progress& progress = {});

/// Takes away pieces of surface that are smaller than that along every axis: where a solid has an edge sharper than the lattice
/// can show, a node may lie in it all alone. \returns how many
std::size_t DropCrumbs(TriangleSurface& surface, double smallerThanMm);

/// The ways in which a surface runs through a cell, by which of its corners are inside (bit x + 2 y + 4 z): triangles whose
/// corners lie on edges of the cell. For tests.
using CellTriangles = std::vector<std::array<std::uint8_t, 3>>;
const std::array<CellTriangles, 256>& CellCases();
/// The lower corner and the axis of an edge of a cell.
std::pair<int, int> CellEdge(int edge);

} // namespace echorama
