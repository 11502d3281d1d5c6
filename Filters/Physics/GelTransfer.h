// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Physics/GelGrid.h"

namespace echorama {

/// What both transfers need to know.
struct GelTransferFrame {
  double origin[3]; ///< mm, of the tile's lowest node
  double cellMm;
  double seconds; ///< the step
  /// mm, of the tile's nodes from what gel sticks to, where a film of it stays; nullptr: far
  const double* walls = nullptr;
};

/// Momenta, with what stress adds to them in a step, and masses of \a count particles, numbered by \a order, onto a tile
/// (APIC: Jiang 2015; MLS-MPM: Hu 2018).
void ScatterGel(const GelLaw& law, const GelTransferFrame& frame, const GelParticle* particles, const std::int32_t* order,
                int count, GelNode* tile);

/// The velocities of a tile back to its particles: their velocities, gradients, positions and strains. Instead of its mass a node
/// holds which part of its cell is filled, as if gel went on behind walls.
/// \returns how many strains began anew (AdvanceGelStrain).
int GatherGel(const GelLaw& law, const GelTransferFrame& frame, GelParticle* particles, const std::int32_t* order, int count,
              const GelNode* tile);

} // namespace echorama
