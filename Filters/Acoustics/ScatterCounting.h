// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "AcousticScene.h"
#include "Core/Base/Parameters.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Imaging/VolumeView.h"
#include "RaySamples.h"

namespace echorama {

/// The counting of random scatter events of dissertation 3.4.3-3.4.5 (eqs 3.1-3.4), in a form that is stable for every
/// probability in [0, 1].
struct ScatterCounting {
  int raysPerElement = 256;
  double clarity = 20.0;
  double coneDegrees = 30.0; ///< the dissertation leaves the cone open
  int maxEvents = 1000;
  double assumedSoundSpeed = 1540.0; ///< m/s
  Sampling sampling = Sampling::Sobol;
  std::uint64_t seed = 1;
};

ParameterList Describe(ScatterCounting& c);

/// How far sound goes until it scatters, mm (infinite for p = 0, 0 for p = 1): \a p is the probability within a mm, \a u
/// uniform in [0, 1). One draw for eqs 3.1-3.3.
double ScatterDistance(double p, double u);

/// Eq. 3.4: what an echo from \a point counts for an element at \a element that looks along \a direction; what lies behind
/// counts nothing.
double ReceiverAttenuation(const Eigen::Vector3d& element, const Eigen::Vector3d& direction, const Eigen::Vector3d& point,
                           double clarity);

/// Intensities on the beams, linear, per ray sent: depth fastest, then fan, then sweep; samples lie evenly from the first to
/// the last depth, beam and plane. The same for any number of threads.
/// \throws Error(InvalidParameter) for a number out of its range, for a probe that fails its Check(), and for dimensions below 2
/// x 1 x 1.
Volume<float> CountScatters(const AcousticScene& scene, const ScatterCounting& parameters, const ProbeGeometry& probe,
                            const Pose& probeToWorld, const std::array<int, 3>& dimensions, const Progress& progress = {});

} // namespace echorama
