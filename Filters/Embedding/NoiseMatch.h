// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "BeamNoise.h"
#include "Core/Imaging/VolumeView.h"
#include <array>
#include <vector>

namespace echorama {

/// How the grain of a volume is measured.
struct NoiseMatchParameters {
  /// What is smooth over so many mm along the depth and twice as many across, halfway down (standard deviations of a Gaussian),
  /// is the scene; what is finer is grain, > 0. Longer lengths than half of it come out too short (1.8 mm as 1.55 by default).
  double windowMm = 1.5;
  int depthBands = 4;
  int quantiles = 257;
};

ParameterList Describe(NoiseMatchParameters& p);

/// The grain of a volume, in beam space. Lengths are those of BeamNoiseParameters, in its units.
struct NoiseMatch {
  /// One number along each axis of beam space.
  struct Lengths {
    double depthMm = 0.0, fan = 0.0, sweep = 0.0; ///< mm, whole fans, whole sweeps (0 for a single plane)
    /// Whether each is longer than what the grid adds to it. If not, it is a bound: the grain is at most that long.
    std::array<bool, 3> resolved{true, true, true};
  };
  /// A part of the depth.
  struct Band {
    double fromMm = 0.0, toMm = 0.0;
    std::ptrdiff_t samples = 0; ///< that took part; lengths of bands with less than 1000 are not measured (0)
    Lengths lengths;
  };
  Lengths lengths; ///< the lower median over the bands that resolve them: edges of the scene can only lengthen them
  std::vector<Band> bands;
  /// At evenly spaced probabilities 0 ... 1: intensities less their local mean, over their local deviation, brought to the
  /// mean and deviation below and to the range of the volume. The last 0.05% at both ends are left out.
  std::vector<float> quantiles;
  double mean = 0.0;      ///< of the intensities
  double deviation = 0.0; ///< of the intensities about their local means (root mean square)
  ///@{
  /// What all this rests on: the part of the real samples that lies in developed speckle, and how many grains, each independent
  /// of the others, there are in it.
  double speckleShare = 0.0;
  double grains = 0.0;
  ///@}

  /// Below it a length of the grain is off by more than a tenth in one of three volumes.
  static constexpr double leastGrains = 400.0;
};

/// Measures the grain of a beam volume (see ScanConversion.h): the lag at which the autocorrelation of the speckle's power has
/// fallen to one half, along each axis. \param valid 1 or 0; empty: every sample is real (samples that are not finite are not)
///
/// Developed speckle alone takes part: places whose local mean and deviation are those of many echoes. Left out are walls and
/// wires (a deviation of more than three quarters of the mean), what is smooth, what a grey level does not resolve, what is cut
/// off at the ends of the range, and what is six times darker than the speckle that holds most of the power: water and shadows.
///
/// Local mean and deviation (in a Gaussian window that three passes fit to the grain) are taken off, and ranks put in
/// place of the values, so that neither the scene's brightness nor the machine's compression matters: the ranks
/// are given the Rayleigh distribution that speckle has, whose autocorrelation is a known function of the power's. Its half is
/// found between lags as that of a Gaussian. What is smooth over the window is no grain; edges of the scene that are as sharp as
/// the grain are taken for it.
/// Cost: proportional to the samples, with the lattices of local statistics; `./run bench noise` measures it.
/// \throws Error(NotPossible) when there are less than 1000 samples of developed speckle, Error(BadInput) for
/// views that do not agree or are no beam volume, Error(InvalidParameter), Error(Cancelled)
NoiseMatch MatchBeams(VolumeView<const float> beams, VolumeView<const unsigned char> valid, const ProbeGeometry& geometry,
                      const NoiseMatchParameters& parameters = {}, const Progress& progress = {});

/// The same of a scan-converted volume, read along the beams of \a geometry at the distance of its voxels, halfway down. What the
/// linear interpolation between voxels adds to the lengths is taken off again (h^2 / 3 of variance in the autocorrelation, h
/// the spacing). Instantiated for the types in VoxelTypes.h.
/// \throws as MatchBeams, and Error(BadInput) for a pose that is not rigid; Error(NotPossible) also when the fan and
/// the volume's valid region do not meet
template <class T>
NoiseMatch MatchNoise(const PosedVolume<T>& volume, const ProbeGeometry& geometry, const Pose& probeToWorld,
                      const NoiseMatchParameters& parameters = {}, const Progress& progress = {});

/// mm per whole fan and per whole sweep halfway down the middle beam.
Eigen::Vector2d SpansHalfway(const ProbeGeometry& geometry);

/// The length of the grain in mm halfway down, the geometric mean over the axes.
double GrainOf(const NoiseMatch& match, const ProbeGeometry& measured);

/// Noise like what was measured in the fan \a measured, for the fan \a target (which may be the same): lengths across fan and
/// sweep are as many mm halfway down the target as they were halfway down the other. Counts resolve the lengths
/// (ResolvingCounts); where a length was too short to resolve it is the bound. Lengths are cut to what BeamNoiseParameters allow.
/// Intensities are those of the quantiles, spread a little so that they are so after scan conversion.
BeamNoiseParameters NoiseLike(const NoiseMatch& match, const ProbeGeometry& measured, const ProbeGeometry& target);

} // namespace echorama
