// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Imaging/VolumeView.h"
#include <complex>
#include <optional>

namespace echorama {

/// The echoes on the beams before detection: complex baseband, depth fastest, then fan, then sweep. Samples lie evenly from
/// the first to the last depth, beam and plane.
struct BeamEchoes {
  ProbeGeometry probe;
  Volume<std::complex<float>> baseband;

  /// Trilinear in the baseband at a point of the probe frame (mm); nothing outside the fan.
  std::optional<std::complex<double>> At(const Eigen::Vector3d& pointInProbe) const;
};

} // namespace echorama
