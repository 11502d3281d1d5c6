// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "NoiseMatch.h"
#include <string>

namespace echorama {

/// Noise for the background of data, and what it rests on.
struct BackgroundNoise {
  BeamNoiseParameters parameters;
  double speckleShare = 0.0, grains = 0.0; ///< as of the match; 0 where there was none
  double grainMm = 0.0;                    ///< GrainOf() the match; 0: there is too little speckle to rely on
  std::string reason;                      ///< why there was no match
};

/// Noise with the grain of \a volume for the fan \a form around it. Where there is less speckle than leastGrains, grains are two
/// voxels long and three wide halfway down, as volumes are sampled that lose nothing.
/// \param along the beams along which it is measured, where \a volume is a small part of what the form is around; nullptr: the
/// form \throws as MatchNoise, but for Error(NotPossible)
template <class T>
BackgroundNoise NoiseBehind(const PosedVolume<T>& volume, const PlacedProbe& form, const Progress& progress = {},
                            const PlacedProbe* along = nullptr);

} // namespace echorama
