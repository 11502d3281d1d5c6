// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ProbeGeometry.h"
#include <Eigen/Core>

namespace echorama {

/// A fan in the world, as a model of a region.
struct FanModel {
  /// The unknowns: a twist of the probe frame (6), then the shape.
  enum Unknown { FanAngle = 6, FanWidth, SweepAngle, SweepWidth, Length, FanOffset, unknowns };
  Pose probeToWorld = Pose::Identity();
  ProbeGeometry shape; ///< depthMin = 0

  double& operator[](int unknown) { return shape.*NumberOf(unknown); }
  double operator[](int unknown) const { return shape.*NumberOf(unknown); }

private:
  static double ProbeGeometry::*NumberOf(int unknown)
  {
    static constexpr double ProbeGeometry::*numbers[] = {&ProbeGeometry::fanAngle,   &ProbeGeometry::fanWidth,
                                                         &ProbeGeometry::sweepAngle, &ProbeGeometry::sweepWidth,
                                                         &ProbeGeometry::depthMax,   &ProbeGeometry::fanOffset};
    return numbers[unknown - FanAngle];
  }
};

/// A point in the coordinates of the beams, with the face that is nearest when it is inside, or that it is furthest beyond.
struct FanPlace {
  enum Face { FanSide, SweepSide, Near, Far, faces };
  ProbeArc::Place sweep, fan; ///< sweep.depth is the distance from the face in the fan's plane; fan.along from the fan's middle
  double distance = 0.0;      ///< mm, negative inside
  Face face = FanSide;
};

using FanVector = Eigen::Matrix<double, FanModel::unknowns, 1>;

/// The signed distance of a point (in the probe frame) from a fan, near its surface: the greatest of its distances from the
/// faces.
FanPlace LocateInFan(const ProbeGeometry& shape, const Eigen::Vector3d& inProbe);

/// How that distance changes with the unknowns. \param at LocateInFan of the point
FanVector FanGradient(const ProbeGeometry& shape, const Eigen::Vector3d& inProbe, FanPlace at);

/// How much space the beams of a probe fill: mm^3; of a single plane mm^2.
double FanVolume(const ProbeGeometry& geometry);

} // namespace echorama
