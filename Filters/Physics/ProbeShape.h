// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Geometry/ProbeGeometry.h"

namespace echorama {

/// What holds the face of a probe.
struct ProbeHead {
  double marginMm = 5.0, edgeMm = 4.0, lengthMm = 80.0;
};
ParameterList Describe(ProbeHead& head);

/// The head of a probe as a solid: what lies behind its face, up to a margin around the outermost beams, with rounded edges.
/// The frame is that of ProbeGeometry. A face that is a point (phased beams) is taken to be flat.
class ProbeShape {
public:
  /// \throws Error(InvalidParameter)
  explicit ProbeShape(const ProbeGeometry& geometry, const ProbeHead& head = {});

  /// mm to the surface, negative inside. Exact in front of the face; never too long elsewhere.
  double Distance(const Eigen::Vector3d& point) const;
  /// Its derivative: away from the probe, a unit vector but for the rounded edges, where faces may meet at other than right
  /// angles.
  Eigen::Vector3d Slope(const Eigen::Vector3d& point) const;
  /// Its second derivative: how the probe bends.
  Eigen::Matrix3d Bend(const Eigen::Vector3d& point) const;
  /// Its sides along x and y, mm.
  const Eigen::Vector2d& Low() const { return low_; }
  const Eigen::Vector2d& High() const { return high_; }

private:
  ProbeGeometry geometry_;
  Eigen::Vector2d low_, high_;
  double edge_, length_;
};

} // namespace echorama
