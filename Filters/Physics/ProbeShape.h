// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ProbeGeometry.h"

namespace echorama {

/// The head of a probe as a solid: what lies behind its face, up to a margin around the outermost beams, with rounded edges.
/// The frame is that of ProbeGeometry. A face that is a point (phased beams) is taken to be flat.
class ProbeShape {
public:
  /// \param marginMm how far the head reaches beyond the face, \param edgeMm the radius of its edges, \param lengthMm how far
  /// back \throws Error(InvalidParameter)
  explicit ProbeShape(const ProbeGeometry& geometry, double marginMm = 5.0, double edgeMm = 4.0, double lengthMm = 80.0);

  /// mm to the surface, negative inside. Exact in front of the face; never too long elsewhere.
  double Distance(const Eigen::Vector3d& point) const;
  /// Its derivative: away from the probe, a unit vector but for the rounded edges, where faces may meet at other than right
  /// angles.
  Eigen::Vector3d Slope(const Eigen::Vector3d& point) const;
  /// Its second derivative: how the probe bends.
  Eigen::Matrix3d Bend(const Eigen::Vector3d& point) const;

private:
  ProbeGeometry geometry_;
  Eigen::Vector2d low_, high_; ///< of the head across
  double edge_, length_;
};

} // namespace echorama
