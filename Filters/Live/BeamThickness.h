// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include <vector>

namespace echorama {

/// How thick the plane is that a 2D probe sees. Across it (in elevation) the weight is a Gaussian whose full width at half of its
/// height, -6 dB of amplitudes, is smallest at the focus:
///   width(depth)^2 = thicknessMm^2 + (divergence (depth - focusMm))^2
/// The Gaussian is cut at 2.5 standard deviations, beyond which lie 1.2% of it.
struct BeamThickness {
  double thicknessMm = 3.0; ///< 0: one plane, as thin as a razor, at any depth
  double focusMm = 60.0;
  double divergence = 0.1; ///< mm of width per mm of distance from the focus
  int planes = 9;          ///< that stand for the Gaussian

  /// Standard deviation of the Gaussian at a depth, mm.
  double SigmaMm(double depthMm) const;
  /// How far from the middle the outermost planes may be between two depths, mm.
  double ReachMm(double depthMin, double depthMax) const;
};

ParameterList Describe(BeamThickness& t);

/// One plane out of those that stand for the thickness.
struct ThicknessPlane {
  float offset = 0.0f; ///< in standard deviations, along the probe's y axis
  float weight = 1.0f; ///< all of them add up to 1
};

/// As many evenly spaced planes as are asked for, each with the share of the Gaussian that is nearest to it; one plane when
/// there is no thickness. \throws Error(InvalidParameter)
std::vector<ThicknessPlane> PlanesOf(const BeamThickness& thickness);

} // namespace echorama
