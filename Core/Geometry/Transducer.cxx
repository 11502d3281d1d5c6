// SPDX-License-Identifier: BSD-3-Clause
// A Gaussian aperture of standard deviation s, focused at F, makes a Gaussian beam (Fresnel's integral of a Gaussian is a
// Gaussian; Kogelnik & Li, Laser beams and resonators, 1966). With g = 1 - z / F and r = z / (k s^2) at the way z
//   sigma^2 = s^2 (g^2 + r^2),   curvature = (z / (k^2 s^4) - g / F) / (g^2 + r^2),
// which at the focus are z / (k s) and 1 / z. Two ways multiply: the inverse squares of the widths add up, and the delay of
// the echo is the mean of both fronts'.
#include "Core/Geometry/Transducer.h"
#include "Core/Base/Angles.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

// Of one way: 1 / sigma^2 and the curvature.
struct OneWay {
  double inverseSquare, curvature;
};

OneWay FocusedBeam(double sigma, double focus, double way, double waveNumber)
{
  const double g = 1.0 - way / focus, r = way / (waveNumber * sigma * sigma);
  const double spread = g * g + r * r;
  return {1.0 / (sigma * sigma * spread), (r * r / way - g / focus) / spread};
}

} // namespace

double Transducer::PulseSigmaMm() const
{
  // A Gaussian of standard deviation t has the spectrum exp(-2 (pi t f)^2): one half at half the bandwidth.
  const double sigmaMicroseconds = std::sqrt(2.0 * std::log(2.0)) / (Pi * bandwidth * frequencyMHz);
  return 0.5e-3 * assumedSoundSpeed * sigmaMicroseconds;
}

ParameterList Describe(Transducer& t)
{
  return {
      Parameter("FrequencyMHz", t.frequencyMHz, {0.5, 60}, "MHz", "Centre frequency of the pulse."),
      Parameter("Bandwidth", t.bandwidth, {0.05, 1.5}, "",
                "Width of the two-way spectrum at -6 dB, as a share of the centre frequency."),
      Parameter("LateralApertureMm", t.lateralApertureMm, {0.1, 100}, "mm", "Width of the active aperture along the fan."),
      Parameter("LateralFocusMm", t.lateralFocusMm, {1, 1000}, "mm", "Way from the face to the transmit focus along the fan."),
      Parameter("DynamicReceive", t.dynamicReceive,
                "Whether receiving is focused at every depth along the fan; else at the transmit focus.")
          .Advanced(),
      Parameter("SmallestFNumber", t.smallestFNumber, {0.5, 10}, "",
                "Dynamic receiving uses no more of the aperture than the depth divided by this.")
          .When("DynamicReceive", "on")
          .Advanced(),
      Parameter("ElevationApertureMm", t.elevationApertureMm, {0.1, 100}, "mm", "Width of the lens along the sweep."),
      Parameter("ElevationFocusMm", t.elevationFocusMm, {1, 1000}, "mm",
                "Way from the face to the focus of the lens, for sending and receiving."),
      Parameter("AssumedSoundSpeed", t.assumedSoundSpeed, {500, 5000}, "m/s", "How the scanner turns time into depth.")
          .Advanced(),
  };
}

BeamWidth WidthAt(const Transducer& transducer, double wayMm)
{
  const double waveNumber = 2.0 * Pi / transducer.WavelengthMm();
  const double way = std::max(wayMm, 4.0 * transducer.WavelengthMm());
  const double lateral = transducer.lateralApertureMm / Transducer::sigmasPerAperture;
  const double elevation = transducer.elevationApertureMm / Transducer::sigmasPerAperture;

  const OneWay send = FocusedBeam(lateral, transducer.lateralFocusMm, way, waveNumber);
  const double open = way / (transducer.smallestFNumber * Transducer::sigmasPerAperture);
  const OneWay listen = transducer.dynamicReceive ? FocusedBeam(std::min(lateral, open), way, way, waveNumber) : send;
  const OneWay lens = FocusedBeam(elevation, transducer.elevationFocusMm, way, waveNumber);

  return {1.0 / std::sqrt(send.inverseSquare + listen.inverseSquare), 1.0 / std::sqrt(2.0 * lens.inverseSquare),
          0.5 * (send.curvature + listen.curvature), lens.curvature};
}

} // namespace echorama
