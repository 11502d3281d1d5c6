// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/Transducer.h"
#include <vector>

namespace echorama {

/// How loud the elements of an aperture are from its middle to its edges.
enum class Apodisation { Rectangular, Hann, Gaussian };

/// What a beam hears beside its main lobe: of the active aperture along the fan.
struct BeamLobes {
  int sideLobes = 0; ///< on either side
  Apodisation apodisation = Apodisation::Hann;
  double pitchMm = 0.0; ///< between elements; 0: too small for grating lobes
  double elementWidth = 0.9;
};

ParameterList Describe(BeamLobes& l);

/// How loud the echo of a point far beside the axis is, at the peak of its envelope, beside one on the axis: both ways through an
/// array of elements in the focus, at an angle of this \a sine from the axis along the fan. Each frequency f of the pulse counts
/// by the square of
///   sum over elements of w(x) cos(2 pi x f sine / c) / sum of w(x)   times   sinc(element's width f sine / c)   times   cosine.
/// For a long pulse and a full aperture L that is sinc^2(L sine / wavelength): -26.5 dB at the first side lobe.
double TwoWayPattern(const BeamLobes& lobes, const Transducer& transducer, double sine);

struct BeamLobe {
  double sine = 0.0;      ///< of its angle from the axis
  double amplitude = 0.0; ///< TwoWayPattern there
  Transducer transducer;  ///< whose main lobe is as wide, and its pulse as long, as those of the lobe
};

/// The lobes on both sides: side lobes where the pattern of the centre frequency has its peaks, before half the way to the first
/// grating lobe; grating lobes at sines of m wavelengths / pitch, m = 1, 2 ... while those are below 1. There the echoes of all
/// elements are whole periods apart, so that the shorter the pulse the fewer of them meet: the lobe is weak and its pulse long.
std::vector<BeamLobe> LobesOf(const BeamLobes& lobes, const Transducer& transducer);

} // namespace echorama
