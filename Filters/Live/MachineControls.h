// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Imaging/VolumeView.h"
#include "Filters/Acoustics/Receiver.h"
#include <array>
#include <cstdint>
#include <vector>

namespace echorama {

/// The knobs of a machine, for beams that were read from volumes of log-compressed greys.
///
/// A grey between \a black and \a white is taken for a level in dB: white is 0 dB, black -recordedDynamicRangeDb. Gain, the
/// time-gain curve and the dynamic range are then what they are on a machine, but for what the volume has lost: what was cut at
/// black or at white when it was recorded stays flat. Noise is added before any gain, as that of electronics. The change of
/// attenuation with the frequency is real for tissue with the coefficient that is given, but resolution and penetration stay
/// those of the recording. Shadow and enhancement are for the eye: they follow from brightness along the beam, and the volume
/// already has those of the direction from which it was recorded.
struct MachineControls {
  double gainDb = 0.0;
  std::array<double, 8> tgcDb{}; ///< at evenly spaced depths, the first and the last included; linear between
  double dynamicRangeDb = 60.0;
  double frequencyMHz = 0.0; ///< 0: as usual for the probe, and of volumes as recorded

  double black = 0.0, white = 255.0;
  double recordedDynamicRangeDb = 60.0, recordedFrequencyMHz = 3.5;
  double attenuation = 0.5; ///< dB per cm and MHz, one way

  double noiseDb = -200.0; ///< mean power of the noise, of white; -200: none
  bool noiseMoves = false; ///< with the number of the frame, else it is fixed to the beams
  double noiseGrainMm = 0.6;
  std::int64_t seed = 1;

  double shadowDbPerCm = 0.0, enhancementDbPerCm = 0.0;
  double brightLevel = 0.75, darkLevel = 0.1; ///< parts of the way from black to white
};

ParameterList Describe(MachineControls& c);
bool operator==(const MachineControls& a, const MachineControls& b);

/// The frequency, or where it is 0 the usual one. \throws Error(InvalidParameter) for one between 0 and 0.5 MHz
double FrequencyOf(const MachineControls& controls, double usualMHz);

/// A receiver with the gain and the time-gain curve of the controls, whose sliders lie evenly between two depths.
Receiver GainOf(const MachineControls& controls, double firstDepth, double lastDepth);

/// The controls for beams of one kind, worked out once: turns what was read into greys, beam by beam.
class BeamDevelopment {
public:
  /// \param samples along a beam, the first at \a depthMin and the last at \a depthMax (mm)
  BeamDevelopment(const MachineControls& controls, double depthMin, double depthMax, int samples);

  /// Turns the values of one beam into greys, 0 to 255, in place. Samples without content become 0.
  /// \param noiseDb levels of noise along the beam, in dB about its mean power; nullptr: none
  void Apply(const float* noiseDb, const unsigned char* content, float* value) const;

private:
  float greyToDb_, black_, rangeDb_, greyPerDb_, noiseMean_;
  float shadowPerSample_, enhancementPerSample_, bright_, dark_;
  std::vector<float> gain_;   // dB, of each sample
  std::vector<float> lossDb_; // of the signal alone: attenuation
};

} // namespace echorama
