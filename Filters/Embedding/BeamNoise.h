// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Imaging/VolumeView.h"
#include <array>
#include <cstdint>
#include <vector>

namespace echorama {

/// How the intensities of noise are distributed.
enum class NoiseIntensity {
  Rayleigh,      ///< the envelope of fully developed speckle, as it is: mean / deviation is 1.913
  LogCompressed, ///< the same after log compression to greys, 0 to 255: what a machine shows
  Histogram,     ///< given quantiles, for instance those of a real volume
};

/// Noise that is made along beams; the defaults are those of an abdominal probe. All lengths are those of the speckle before
/// compression: the lag at which the autocorrelation of its power (the squared envelope) has fallen to one half. (That of
/// log-compressed greys has fallen to 0.35 there, and to one half at 0.77 of the length.) A length of 0 leaves neighbours
/// independent, so that the grain is as large as the samples are apart, as in dissertation 6.2.
struct BeamNoiseParameters {
  int samples = 400;  ///< along each beam, >= 2
  int elements = 240; ///< beams across the fan, >= 2
  int steps = 120;    ///< planes of the sweep, >= 2; not used where the probe does not sweep (one plane)
  NoiseIntensity intensity = NoiseIntensity::LogCompressed;
  double mean = 40.0; ///< for LogCompressed below 255; not used for Histogram
  double dynamicRangeDb = 60.0;
  std::vector<float> quantiles; ///< for Histogram: at least 2 ascending values at evenly spaced probabilities 0 ... 1
  double depthCorrelationMm = 0.6;
  double fanCorrelation = 0.0125;
  double sweepCorrelation = 0.025;
  std::uint64_t seed = 1;
};

ParameterList Describe(BeamNoiseParameters& p);

/// Noise as a machine makes it: random intensities evenly spaced along beams, a beam volume for ScanConvert. Scan conversion
/// curves its grain about the probe and widens it with depth, as that of speckle. It is the envelope of a complex Gaussian
/// field that a separable Gaussian (the point spread) has filtered in beam space, so that every sample has the same
/// distribution, the first and the last included, and then a curve that gives the intensities.
///
/// Interpolation between samples that are independent lowers the deviation halfway between them (to 0.35 of it in the middle
/// of eight), and their lattice shows; where a length is two or three samples long it does not (see ResolvingCounts).
///
/// The samples depend on the seed and on the dimensions, not on threads. Cost: about 80 ns of one core per sample; memory of four
/// floats per sample. \throws Error(InvalidParameter) that names the parameter, what ProbeGeometry::Check throws, Error(TooLarge)
/// for more than 2^31 - 1 samples, Error(Cancelled). Source: dissertation 6.2; Wagner, Smith, Sandrik, Lopez, IEEE Trans. Sonics
/// Ultrason. 1983 (statistics of speckle).
Volume<float> MakeBeamNoise(const BeamNoiseParameters& parameters, const ProbeGeometry& geometry, const Progress& progress = {});

/// A part of the same: \a size samples, beams and steps from \a first on. There may be any number of samples in all.
/// \throws as the whole, and Error(BadInput) for a part that is not one
Volume<float> MakeBeamNoise(const BeamNoiseParameters& parameters, const ProbeGeometry& geometry, const std::array<int, 3>& first,
                            const std::array<int, 3>& size, const Progress& progress = {});

/// How many samples, beams and steps the whole has.
std::array<int, 3> BeamNoiseSize(const BeamNoiseParameters& parameters, const ProbeGeometry& geometry);

/// How many samples, beams and steps beyond a part of it are made on either side to make that part.
std::array<int, 3> BeamNoiseReach(const BeamNoiseParameters& parameters, const ProbeGeometry& geometry);

/// The parameters with as many samples, elements and steps as the correlation lengths need, \a perLength to each: with 3 the
/// deviation after scan conversion is nowhere more than 6% lower (12% of log-compressed greys) than that of the samples. Where a
/// length is 0 the count stays. Counts are at most those that make \a maximumSamples of them together: beyond, all three are
/// lowered by one factor.
BeamNoiseParameters ResolvingCounts(BeamNoiseParameters parameters, const ProbeGeometry& geometry, double perLength = 3.0,
                                    double maximumSamples = 16e6);

} // namespace echorama
