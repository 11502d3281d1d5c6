// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Core>
#include <vector>

namespace echorama {

/// Rotations that cover a cone evenly: every rotation by at most \a coneDegrees is within 0.8 steps of one of them, half of a
/// step on average. None turns by more than the cone; the identity comes first, the others in the order of their angles.
///
/// Neighbours are \a stepDegrees apart. The rotation vectors form a body-centred cubic lattice, the thinnest lattice cover of
/// space. A lattice in the whole ball of rotation vectors would be twice as dense as needed near 180 degrees; so beyond 60
/// degrees the lattice is laid around each of the 24 rotations of a cube, and each point kept by the nearest of these only.
/// A full cover has 2544 rotations at 20 degrees, 648 at 30.
/// \param coneDegrees in [0, 180]; 180 is all rotations
/// \param stepDegrees in [2, 90]
/// \throws Error(InvalidParameter) for anything else.
std::vector<Eigen::Matrix3d> RotationCover(double coneDegrees, double stepDegrees);

} // namespace echorama
