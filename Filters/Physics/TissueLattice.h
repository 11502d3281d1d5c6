// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Physics/TissuePress.h"
#include "Filters/Tissue/TissueSurface.h"

namespace echorama {

/// How surfaces of tissue become cells of a lattice.
struct TissueLatticeParameters {
  double spacingMm = 4.0;
  double poisson = 0.45;
  std::string heldMaterials = "bone";
};
ParameterList Describe(TissueLatticeParameters& p);

/// The lattice whose cells cover all bodies, along the axes of the world.
/// \throws Error(BadInput) when there is no body, Error(InvalidParameter) when it takes too many nodes
ImageGeometry TissueLatticeOf(const TissueSurface& surface, const TissueLatticeParameters& parameters);

/// A cell is of the mean of what lies in 64 of its points, and empty where fewer than half of these are in tissue; what they have
/// goes to the fullest cell beside it, so that no layer is lost that is thinner than a cell: stiffness along a layer and weight
/// are kept. The background is none, nor is gas. Fluids, which have no stiffness, are taken as the softest tissue, since they
/// keep their volume; very stiff bodies that nothing holds, as stones, are taken as stiff as the solver bears well. Cells are
/// held where half of their points are. \throws as TissueLatticeOf and BodiesOn; Error(InvalidParameter) for a held material that
/// is none of the surface's or of the standard ones
TissueBody TissueBodyOf(const TissueSurface& surface, const TissueLatticeParameters& parameters, const Progress& progress = {});

} // namespace echorama
