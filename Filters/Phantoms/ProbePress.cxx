// SPDX-License-Identifier: BSD-3-Clause
// A flow about the probe's axis that is free of divergence has a stream function psi: u_z = (1/r) dpsi/dr and u_r = -(1/r)
// dpsi/dz. With u_z = mm g(z) h(r), both Gaussian, psi = mm g(z) S^2 (1 - h(r)), which gives u_r in closed form. The
// greatest stretch of the field at 10 mm is below 0.3, so the inverse by fixed-point iteration gains a digit every other step.
#include "ProbePress.h"
#include <cmath>

namespace echorama {

Eigen::Vector3d ProbePress::DisplacementAt(const Eigen::Vector3d& point) const
{
  const double t = (point.x() * point.x() + point.y() * point.y()) / (2.0 * sideSigmaMm * sideSigmaMm);
  const double depth = mm * std::exp(-point.z() * point.z() / (2.0 * depthSigmaMm * depthSigmaMm));
  // (1 - exp(-t)) / t, which is 1 on the axis.
  const double mean = t > 0.0 ? -std::expm1(-t) / t : 1.0;
  const double outwards = 0.5 * depth * point.z() / (depthSigmaMm * depthSigmaMm) * mean;
  return {outwards * point.x(), outwards * point.y(), depth * std::exp(-t)};
}

Eigen::Vector3d ProbePress::Unpressed(const Eigen::Vector3d& point) const
{
  Eigen::Vector3d unpressed = point;
  for (int step = 0; step < 60; ++step) {
    const Eigen::Vector3d next = point - DisplacementAt(unpressed);
    const double change = (next - unpressed).squaredNorm();
    unpressed = next;
    if (change < 1e-20)
      break;
  }
  return unpressed;
}

} // namespace echorama
