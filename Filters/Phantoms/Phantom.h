// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Imaging/VolumeView.h"
#include "Filters/Phantoms/BeamEchoes.h"
#include "PhantomScene.h"
#include "ProbePress.h"
#include <cstdint>
#include <string>

namespace echorama {

/// What the phantom's scanner sees, from where, and how it is set.
struct PhantomParameters {
  PhantomScene scene = DefaultScene();
  /// A curved 3D probe: 65 degrees of fan at a radius of 40 mm, 55 degrees of sweep at 30 mm, 5 to 100 mm deep.
  ProbeGeometry probe = ProbeGeometry::Convex(1.1344640137963142, 40.0, 0.9599310885968813, 30.0, 5.0, 100.0);
  Pose probeToWorld = Pose::Identity(); ///< rigid, at most 1e6 mm away
  std::uint64_t seed = 1;
  double spacingMm = 1.0;
  double gainDb = 0.0;
  double dynamicRangeDb = 60.0;
  double backgroundGrey = 100.0;
  bool shadows = true;

  // What sets one volume apart from another of the same tissue.
  double decorrelation = 0.0; ///< powers of echoes correlate by about (1 - d)^2
  std::uint64_t changeSeed = 1;
  ProbePress press;           ///< moves scatterers and bodies together
  double noiseDb = noNoiseDb; ///< white, complex Gaussian, on every sample of the beams, behind all shadows
  static constexpr double noNoiseDb = -120.0;
  double ribShare = 0.0; ///< RibBelow
  bool jets = false;     ///< whether the short-lived bodies Jets() are there

  double wavelengthMm = 0.6; ///< 2.6 MHz
  double pulseSigmaMm = 0.5;
  double lateralSigmaMm = 0.7;
  double lateralGrowth = 0.008;
  double elevationSigmaMm = 0.9;
  double elevationGrowth = 0.012;
  double scatterersPerMm3 = 1.5;

  /// Throws Error(InvalidParameter) that names the number that is out of its range; also for a probe whose sweep is a single
  /// plane, or whose beams start at or behind the sweep axis.
  void Check() const;

  /// The scene with the rib and the jets of this volume.
  PhantomScene WholeScene() const;
};

/// All but the scene and the probe.
ParameterList Describe(PhantomParameters& p);

/// A rib below the face of one view: a long bright body across the sweep, 6 mm behind the first depth, on the +x side of the
/// fan, that takes all echoes behind it over about \a share (in (0, 0.6]) of the fan. World coordinates.
Inclusion RibBelow(const ProbeGeometry& probe, const Pose& probeToWorld, double share);

/// Sums the echoes of scatterers that are fixed to the material. Uniform background has mean power 1.
///
/// One scatterer lies at random in each cell of a lattice in the world; place and strength are hashed from the seed and the
/// cell. Its echo has the phase exp(-i 4 pi r / wavelength) of its depth r and a Gaussian envelope in depth, along the fan
/// and along the sweep. So the speckle of a point stays when the probe slides past it, and decorrelates as the probe turns
/// about it: by exp(-(2 pi sigma sin(angle) / wavelength)^2) in amplitude for a beam of standard deviation sigma.
/// Not simulated: reverberation, refraction, multiple scattering, side lobes, mirror echoes at smooth walls,
/// frequency-dependent attenuation, and tissue that moves during the sweep.
/// \throws Error(InvalidParameter) as Check(), Error(TooLarge) when beams or scatterers would not fit, Error(Cancelled).
BeamEchoes SimulateEchoes(const PhantomParameters& parameters, const Progress& progress = {});

/// The box around all beams of a probe after \a pose.
Eigen::AlignedBox3d BoxAround(const ProbeGeometry& probe, const Pose& pose = Pose::Identity());

/// The voxel grid of the volume in the world: its axes are those of the probe, it covers all beams.
/// \throws Error(InvalidParameter) as Check(), Error(TooLarge) beyond 2^29 voxels.
ImageGeometry PhantomGeometry(const PhantomParameters& parameters);

/// Makes the volume: echoes, envelope, log compression on the beams, scan conversion. Both views have the dimensions of
/// PhantomGeometry(); \a valid becomes 1 inside the fan and 0 outside, where the intensity is 0.
/// Same result for any number of threads.
/// \throws as SimulateEchoes, and Error(InvalidParameter) for views of other dimensions.
void MakePhantom(const PhantomParameters& parameters, VolumeView<unsigned char> intensity, VolumeView<unsigned char> valid,
                 const Progress& progress = {});

/// The scene and every parameter as one JSON text: PhantomFromJson reads the scene back from it.
std::string DescribePhantom(const PhantomParameters& parameters);

} // namespace echorama
