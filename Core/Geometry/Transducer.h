// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"

namespace echorama {

/// How a probe sends and listens: the pulse and the active apertures of its beams.
///
/// Apertures are apodised by a Gaussian whose standard deviation (of amplitudes) is a fifth of the width given here, so that
/// the edges are 27 dB down, much like a Hann window. Sound leaves focused on one way; it is received with the focus on every
/// way (dynamic) along the fan. Along the sweep a lens focuses both.
struct Transducer {
  double frequencyMHz = 3.5, bandwidth = 0.6;
  double lateralApertureMm = 14.0, lateralFocusMm = 70.0;
  bool dynamicReceive = true;
  double smallestFNumber = 1.0;
  double elevationApertureMm = 10.0, elevationFocusMm = 70.0;
  double assumedSoundSpeed = 1540.0;

  static constexpr double sigmasPerAperture = 5.0; ///< of the apodisation, from edge to edge

  double WavelengthMm(double soundSpeed) const { return 1e-3 * soundSpeed / frequencyMHz; } ///< \a soundSpeed in m/s
  double WavelengthMm() const { return WavelengthMm(assumedSoundSpeed); }
  /// Radians per mm of scan depth by which the phase of an echo turns: 4 pi over the wavelength, for the way there and back.
  double PhasePerMm() const { return 12.566370614359172 / WavelengthMm(); }
  /// Standard deviation of the Gaussian envelope of the two-way pulse (amplitudes), mm of scan depth.
  double PulseSigmaMm() const;
};

ParameterList Describe(Transducer& t);

/// The two-way response across a beam, of amplitudes: exp(-x^2 / (2 sigma^2)) along the fan and alike along the sweep. An
/// echo from x beside the axis comes later by curvature x^2 / 2 mm of depth.
struct BeamWidth {
  double lateralSigma = 0.0, elevationSigma = 0.0;         ///< mm
  double lateralCurvature = 0.0, elevationCurvature = 0.0; ///< of the wave front, 1/mm; negative before the focus

  /// Volume of the resolution cell: (integral of the squared response)^2 over that of its fourth power, which for three
  /// Gaussians is (2 pi)^(3/2) times the three sigmas. mm^3.
  double ResolutionCellMm3(double pulseSigmaMm) const
  {
    return 15.749609945722419 * pulseSigmaMm * lateralSigma * elevationSigma;
  }
};

/// The beam at a way (mm along the path of sound) from the face: focused Gaussian beams in closed form, transmit times
/// receive. Closer than four wavelengths the beam is that of four wavelengths.
BeamWidth WidthAt(const Transducer& transducer, double wayMm);

} // namespace echorama
