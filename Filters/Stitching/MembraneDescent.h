// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Stitching/Membrane.h"
#include <array>

namespace echorama {

/// A box of voxels, x fastest, with a border of one void voxel on all sides.
struct DescentGrid {
  std::array<int, 3> size{0, 0, 0}; ///< without the border
  std::vector<unsigned char> kinds; ///< MembraneVoxel
  std::vector<float> values;        ///< known values, in [0, 1]; 0 at void voxels

  DescentGrid() = default;
  explicit DescentGrid(std::array<int, 3> extent);
  std::ptrdiff_t Stride(int axis) const
  {
    const std::ptrdiff_t row = size[0] + 2;
    return axis == 0 ? 1 : axis == 1 ? row : row * (size[1] + 2);
  }
  std::size_t At(int i, int j, int k) const
  {
    return static_cast<std::size_t>((k + 1) * Stride(2) + (j + 1) * Stride(1) + i + 1);
  }
};

/// Minimises the membrane's energy by steepest descent from coarse to fine (dissertation 5.3.2) and writes the unknown values
/// of \a grid. Adds to report.cycles the steps of all levels, to report.trace what parameters.trace asks for.
/// \param weights of differences along each axis
void DescendMembrane(DescentGrid& grid, const std::array<float, 3>& weights, const MembraneParameters& parameters,
                     const Progress& progress, MembraneReport& report);

} // namespace echorama
