// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Filters/Stitching/RowField.h"
#include <Eigen/Core>

namespace echorama {

/// What a voxel is to a membrane.
enum class MembraneVoxel : unsigned char {
  Void = 0,    ///< not there: faces towards it are dropped (natural boundary)
  Unknown = 1, ///< to be found
  Known = 2,   ///< a boundary value
};

enum class MembraneSolver {
  Multigrid,       ///< full multigrid / multigrid-preconditioned, stopped on the certificate
  SteepestDescent, ///< the dissertation's coarse-to-fine descent (5.3.2), stopped as it is there; kept to compare with
};

struct MembraneParameters {
  MembraneSolver solver = MembraneSolver::Multigrid;
  double tolerance = 1.0 / 512; ///< largest error of any value, relative to the span of known values; multigrid only
  int maximumCycles = 50;       ///< then the best so far is returned, with the bound it has (report.certified = false)
  int levels = 6;               ///< SteepestDescent
  double descentStop = 1e-4;    ///< SteepestDescent: relative fall of the energy at which a level ends (choose, document)
};

struct MembraneReport {
  std::ptrdiff_t unknowns = 0;
  int cycles = 0;
  double bound = 0.0;                            ///< no value is further than this from the exact solution (infinity: not known)
  bool certified = false;                        ///< bound <= tolerance
  double setupSeconds = 0.0, solveSeconds = 0.0; ///< for the benchmark
};

/// Minimises the sum over faces of w_axis (u_p - u_q)^2 (dissertation 5.6, 5.7; w_axis = (least spacing / spacing)^2) over the
/// unknown voxels, with known ones fixed and faces to the void dropped, in 2D (grids of one slice) and 3D.
/// \param kinds MembraneVoxel per voxel of the spans; voxels outside of the spans are void
/// \param values of the same spans: boundary values at known voxels (any finite numbers); receives the solution at unknown ones,
/// which lies within the range of the known values of its component. A connected component of unknowns that touches no known
/// voxel gets \a isolated.
/// Same result on any number of threads.
MembraneReport SolveMembrane(const RowField<unsigned char>& kinds, const Eigen::Vector3d& spacing, RowField<float>& values,
                             float isolated, const MembraneParameters& parameters = {}, const Progress& progress = {});

} // namespace echorama
