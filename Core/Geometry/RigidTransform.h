// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Geometry>

namespace echorama {

/// A rigid transform: rotation, then translation. Millimetres.
using Pose = Eigen::Isometry3d;

/// A twist: translational part first, rotation vector (axis times angle, radians) last.
using Twist = Eigen::Matrix<double, 6, 1>;

/// The matrix of the cross product: Hat(v) * x is v x x.
Eigen::Matrix3d Hat(const Eigen::Vector3d& v);

/// The rotation by |v| radians about v; exact to rounding for |v| -> 0.
Eigen::Matrix3d ExpRotation(const Eigen::Vector3d& v);

/// The rotation vector of R, of length in [0, pi]. At pi the axis is one of the two.
Eigen::Vector3d LogRotation(const Eigen::Matrix3d& R);

/// The exponential of SE(3): the screw motion along \a twist.
Pose Exp(const Twist& twist);

/// Its inverse, with a rotation angle in [0, pi].
Twist Log(const Pose& pose);

/// From a (t = 0) to b (t = 1) along the shortest rotation, positions along a straight line.
Pose Interpolate(const Pose& a, const Pose& b, double t);

/// Turns by the rotation vector \a rotation about \a centre, then moves by \a translation.
Pose MotionAbout(const Eigen::Vector3d& centre, const Eigen::Vector3d& rotation, const Eigen::Vector3d& translation);

/// Angle of the rotation of a pose, radians in [0, pi].
double RotationAngle(const Pose& pose);

/// The proper rotation R that is nearest to M: it has the largest trace of R^T M.
Eigen::Matrix3d NearestRotation(const Eigen::Matrix3d& M);

/// Whether M is a proper rotation: orthonormal with determinant +1, to within \a tolerance per entry.
bool IsRotation(const Eigen::Matrix3d& M, double tolerance = 1e-5);

} // namespace echorama
