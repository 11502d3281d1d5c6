// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "LatticeMap.h"
#include <functional>

namespace echorama {

/// What a voxel of a grid shows.
enum class SourceKind : unsigned char {
  Outside, ///< what no tetrahedron of the lattice holds
  Found,   ///< what lies at its source
  Folded,  ///< something that folds over: more than one place has come here, or one turned inside out
};

/// Some slices of a grid, as a visitor gets them.
struct SourceSlab {
  int firstSlice, slices;
  const Eigen::Vector3d*
      sources; ///< a voxel each, x fastest: in index coordinates of the lattice. The voxel's own place where nothing is found
  const SourceKind* kinds; ///< a voxel each
};

struct SourceCounts {
  std::size_t outside = 0, folded = 0; ///< voxels
};

/// Called for each slab once, from several threads at a time.
using SourceVisitor = std::function<void(const SourceSlab&)>;

/// For every voxel of a grid where what has come to it lay at rest: the inverse of the map, exact to rounding.
/// \param nearest beyond the lattice its outermost displacements hold
/// \throws Error(Cancelled)
SourceCounts VisitRestPlaces(const LatticeMap& map, bool nearest, const ImageGeometry& grid, const SourceVisitor& visitor,
                             const Progress& progress = {});

/// For every voxel of a grid where what lies there at rest has gone: the map itself.
SourceCounts VisitDeformedPlaces(const LatticeMap& map, bool nearest, const ImageGeometry& grid, const SourceVisitor& visitor,
                                 const Progress& progress = {});

} // namespace echorama
