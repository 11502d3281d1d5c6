// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Geometry/ProbeGeometry.h"

namespace echorama {

/// A probe as people state it, in degrees and mm; Place() makes kernels' ProbeGeometry and pose of it.
struct ProbeSettings {
  double fanAngle = 65.0, fanWidth = 45.0;
  double sweepAngle = 55.0, sweepWidth = 29.0;
  double depthMin = 0.0, depthMax = 100.0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d orientation = Eigen::Vector3d::Zero();

  PlacedProbe Place() const;
};

ParameterList Describe(ProbeSettings& p);

/// The same with the radii of a curved probe, from which the widths follow as its angles change.
struct ConvexProbeSettings : ProbeSettings {
  double fanRadius = 40.0, sweepRadius = 30.0;

  PlacedProbe Place() const;
};

ParameterList Describe(ConvexProbeSettings& p);

} // namespace echorama
