// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"
#include "Filters/Phantoms/BeamEchoes.h"
#include <cstdint>
#include <vector>

namespace echorama {

/// From echoes to grey: noise of the electronics, gain that rises with depth (TGC), envelope, log compression.
///
/// Levels are beside the mean power of speckle in the reference tissue (backscatter 0 dB) without attenuation, which is 1.
struct Receiver {
  /// A slider of the scanner.
  struct GainPoint {
    double depthMm = 0.0, gainDb = 0.0;
  };

  double gainDb = 0.0, tgcDbPerCm = 0.0;
  std::vector<GainPoint> tgcPoints; ///< further gain, linear between points of rising depth, constant beyond; may be empty
  double dynamicRangeDb = 60.0, referenceGrey = 110.0;
  double noiseDb = noNoiseDb;  ///< white, complex Gaussian, on every sample of the beams; added before all gain
  std::uint64_t noiseSeed = 1; ///< every row of samples has its own stream
  static constexpr double noNoiseDb = -200.0;

  /// The ranges, and the order of the points. \throws Error(InvalidParameter)
  void Check() const;

  /// All gain at a scan depth, dB.
  double GainDbAt(double depthMm) const;
};

ParameterList Describe(Receiver::GainPoint& p);
ParameterList Describe(Receiver& r); ///< but the points

/// The envelope after noise and gain, before compression. \a envelope has the beams and planes of the echoes and any number
/// (>= 2) of depth samples over the same range of depth: each is the mean of the finer samples around it, weighted by a
/// triangle of the coarser of both steps to either side, so that an equal number of samples is copied. (1 at reference tissue,
/// root mean square; gains are factors.)
/// \throws Error(InvalidParameter) as Check(), Error(BadInput) when the dimensions do not go together, Error(Cancelled).
void DetectEnvelope(const BeamEchoes& echoes, const Receiver& receiver, VolumeView<float> envelope,
                    const Progress& progress = {});

/// The envelope as grey: linear in its logarithm, clamped to [0, 255], rounded. Mean grey of the reference tissue's speckle at
/// gain 0 is referenceGrey (where nothing is clamped and samples are not averaged).
/// \throws as DetectEnvelope.
void DetectEchoes(const BeamEchoes& echoes, const Receiver& receiver, VolumeView<unsigned char> beams,
                  const Progress& progress = {});

} // namespace echorama
