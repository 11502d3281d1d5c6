// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Geometry/ImageGeometry.h"
#include "PlacedVolume.h"
#include <cstdint>
#include <vector>

namespace echorama {

/// How finely disagreement is looked for, and when an answer is told.
struct DisagreementParameters {
  double blockMm = 12.0, searchMm = 5.0, stepMm = 0.0;
  double maximumErrorMm = 0.5, minimumSignificance = 4.0;
};

ParameterList Describe(DisagreementParameters& p);

/// What two volumes say of one block of tissue that both show.
struct LocalShift {
  /// Tissue that the fixed volume shows at x is shown by the moving one at x + shift, mm; the known part of it.
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  Eigen::Matrix3d known = Eigen::Matrix3d::Zero(); ///< projects any shift onto what is known of this one
  /// How many directions are known: at an edge one, where two surfaces meet two; 0: nothing is.
  int knownDirections = 0;
  double errorMm = 0.0;     ///< standard deviation in the least sure of the known directions
  double correlation = 0.0; ///< of the block at that shift
  /// Length of the known part less what noise adds to it in the mean, mm.
  double mm = 0.0;
};

/// How far overlapping volumes are from agreeing, place by place.
struct DisagreementMap {
  ImageGeometry geometry;                  ///< of the blocks' middles, along the axes of the world
  std::vector<LocalShift> shifts;          ///< per block: of the pair that disagrees most among those that know
  std::vector<std::int16_t> fixed, moving; ///< per block: that pair; -1: no pair knows
  std::int64_t compared = 0, known = 0;    ///< blocks of all pairs: those with enough of both volumes, and those told
  double stepMm = 0.0;                     ///< of the lattice on which volumes were compared
};

/// All blocks that Disagreement() may tell of, whatever the volumes hold: its map is a part of this grid. \param volumes where
/// they are taken to be. \throws Error(InvalidParameter), and Error(BadInput) for fewer than two volumes, as Disagreement().
ImageGeometry DisagreementGrid(const std::vector<ImageGeometry>& volumes, const DisagreementParameters& parameters = {});

/// Estimates the shift that is left between overlapping volumes, on blocks of the world, block by block for itself.
///
/// Both volumes are read on one lattice, and each block is correlated with the other volume at every whole shift of the search
/// (normalised, through both valid regions); the peak is found between them. Gain and offset do not matter. Told is only what can
/// be known: the covariance of the peak (how sharp it is, how much does not agree, over how many independent voxels) says in
/// which directions; a correlation that chance reaches, a peak at the end of the search, or another one that fits nearly as well
/// and contradicts it, say nothing. So blocks without texture, and of volumes farther apart than the search, stay empty. The
/// result does not depend on the number of threads. \throws Error(InvalidParameter); Error(BadInput) for fewer than two volumes,
/// and as CheckPlacedVolume; Error(TooLarge) beyond 2^28 lattice points of one pair; Error(Cancelled).
DisagreementMap Disagreement(const std::vector<PlacedVolume>& volumes, const DisagreementParameters& parameters = {},
                             const Progress& progress = {});

} // namespace echorama
