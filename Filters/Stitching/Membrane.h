// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Filters/Stitching/RowField.h"
#include <Eigen/Core>
#include <vector>

namespace echorama {

/// What a voxel is to a membrane.
enum class MembraneVoxel : unsigned char {
  Void = 0,    ///< not there: faces towards it are dropped (natural boundary)
  Unknown = 1, ///< to be found
  Known = 2,   ///< a boundary value
};

struct MembraneParameters {
  /// Largest error of any value, relative to the span of the known values that unknowns lie between; > 0
  double tolerance = 1.0 / 512;
  int maximumCycles = 50; ///< >= 0; then the best so far is returned, with the bound it has (report.certified = false)
};

struct MembraneReport {
  std::ptrdiff_t unknowns = 0;
  int cycles = 0;
  double bound = 0.0;     ///< no value is further than this from the exact solution, in the unit of the values (may be infinite)
  bool certified = false; ///< bound <= tolerance times the span
  double setupSeconds = 0.0, solveSeconds = 0.0;
};

/// Minimises the sum over faces of w_axis (u_p - u_q)^2 (dissertation 5.6, 5.7; w_axis = (least spacing / spacing)^2) over the
/// unknown voxels, with known ones fixed and faces to the void dropped, in 2D (grids of one slice) and 3D.
///
/// A connected component of unknowns (across faces) that touches no known voxel gets \a isolated; one that touches only one
/// value gets exactly that value. All others lie within the range of the known values that their component touches.
/// The bound holds for the floats that are returned: it includes their rounding, so it cannot fall below 6e-8 times the
/// largest known value. Same result on any number of threads. Cost: one cycle is about fifteen sweeps over the unknowns, and
/// the number of cycles hardly depends on theirs; the bound is about one cycle more; 25 to 30 bytes per stored voxel (a row is
/// stored from its first to its last unknown, and a little around).
/// \param kinds MembraneVoxel per voxel of the spans; voxels outside of the spans are void
/// \param values of the same spans: boundary values at known voxels; receives the solution at unknown ones
/// \throws Error InvalidParameter: a parameter out of range, spans that differ, or a spacing that is not positive;
/// BadInput: a known value next to an unknown is not finite; Cancelled
MembraneReport SolveMembrane(const RowField<unsigned char>& kinds, const Eigen::Vector3d& spacing, RowField<float>& values,
                             float isolated, const MembraneParameters& parameters = {}, const Progress& progress = {});

} // namespace echorama
