// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Geometry/ProbeFit.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Imaging/VolumeView.h"
#include <optional>
#include <string>
#include <vector>

namespace echorama {

/// What counts as a shadow and what as saturated. Levels are parts of the way from black (a voxel in a hundred or so is as dark)
/// to the grey of ordinary tissue at that depth, so that gain and type do not matter. Lengths are parts of a beam.
struct ReliabilityParameters {
  int resolution = 96;
  double shadowLevel = 0.3, tissueLevel = 0.7;
  double leastEcho = 0.03, leastShadow = 0.2;
  double saturatedShare = 0.5;
  int depthAxis = -1;
  bool depthReversed = false;
};
ParameterList Describe(ReliabilityParameters& p);

/// A map and what was found.
struct Reliability {
  Volume<float> map;
  double shadowShare = 0.0;       ///< of the real voxels, those whose beam ends in the dark there (below one half)
  double saturatedShare = 0.0;    ///< of the real voxels, those in saturated areas (below one half)
  std::vector<std::string> notes; ///< what the user should know: sentences
};

/// How far each voxel can be trusted, in [0, 1]: low in acoustic shadow, low in saturated areas, 0 where not real; never NaN.
///
/// Shadow: below the last depth from which a beam still brings echoes nothing tells that any sound was there. So a voxel is as
/// reliable as the brightest stretch of its beam from there to the end. Cysts and vessels keep their trust, because tissue
/// echoes behind them; what is dark to the end of the beam does not, be it the shadow of a stone or a rib, lost contact, depth
/// beyond penetration, or fluid that reaches the end of the image: the image cannot tell these apart, and nothing can be matched
/// in any. A dark beam alone among bright neighbours is taken for noise.
///
/// Saturated: areas at the largest value that occurs, which carry no texture. Single bright voxels and thin sheets keep trust.
///
/// Beams are those of \a probe, or, without one, lines of voxels along the depth axis. An image that is dark everywhere, or the
/// same everywhere, has reliability 0 everywhere, and a note says so.
///
/// Reliability does not change when all values are multiplied by a positive number or shifted. Gain in dB (a shift of
/// log-compressed values that clips at black and white) changes it little; noise that time-gain compensation lifts counts as
/// dark as long as it stays below shadowLevel of the tissue at its depth.
/// The result does not depend on the number of threads. Cost: a pass that reads all voxels, one that writes the map; between
/// them about \a resolution^3 cells at most.
/// Source: dark tails of beams as shadows after Hellier et al. 2010; what can be trusted as a matter of transmission after
/// Karamalis et al. 2012, by a closed form in place of their random walks.
/// \throws Error(BadInput) for a geometry that is not one, views that do not agree with it, no real voxel, or a pose that is
/// not rigid; Error(InvalidParameter) for parameters out of range, a tissueLevel that is not above shadowLevel, and as the
/// probe's Check(); Error(Cancelled).
template <class T>
Reliability MeasureReliability(const PosedVolume<T>& volume, const std::optional<PlacedProbe>& probe,
                               const ReliabilityParameters& parameters = {}, const Progress& progress = {});

/// The map alone.
template <class T>
Volume<float> ReliabilityMap(const PosedVolume<T>& volume, const std::optional<PlacedProbe>& probe,
                             const ReliabilityParameters& parameters = {}, const Progress& progress = {})
{
  return MeasureReliability(volume, probe, parameters, progress).map;
}

/// The probe that explains where a volume is real (FitProbe), or nothing when none does; \a note then says why.
/// \throws what FitProbe throws, but for NotPossible.
template <class T>
std::optional<PlacedProbe> FindProbe(const PosedVolume<T>& volume, const ProbeFitParameters& parameters = {},
                                     std::string* note = nullptr, const Progress& progress = {});

} // namespace echorama
