// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>

namespace echorama {

/// A sample of beam space: how deep along its beam, and which beam.
struct BeamPoint {
  double depth = 0.0; ///< mm from the face along the beam
  double fan = 0.0;   ///< across the array, -0.5 (first element) ... 0.5 (last)
  double sweep = 0.0; ///< along the sweep, -0.5 ... 0.5
};

/// The face of a 3D probe and the beams that leave it: one geometry for the head, for scan conversion and for synthesis.
///
/// Probe frame: origin at the centre of the face, +x along the array (the fan), +y along the sweep, +z into the tissue.
/// The array is an arc of length fanWidth whose beams spread over fanAngle, so its radius is fanWidth / fanAngle: an angle
/// of 0 is a flat array, a width of 0 a point (phased array). The sweep turns the fan about a line parallel to x, likewise
/// by an arc length and an angle. Both limits are exact: nothing in here becomes infinite.
/// Source: dissertation 3.1.1 (head parameters), with the toroidal face of mechanical 3D probes.
struct ProbeGeometry {
  double fanAngle = 0.0;   ///< radians, whole fan, [0, 2 pi)
  double fanWidth = 0.0;   ///< mm, arc length of the array, >= 0
  double sweepAngle = 0.0; ///< radians, whole sweep, [0, 2 pi)
  double sweepWidth = 0.0; ///< mm, arc length that the middle of the array travels, >= 0
  double depthMin = 0.0;   ///< mm, first sample
  double depthMax = 100.0; ///< mm, last sample, > depthMin

  /// A curved array swept about an axis: angles in radians, radii in mm (the head parameters of dissertation 3.1.1).
  static ProbeGeometry Convex(double fanAngle, double fanRadius, double sweepAngle, double sweepRadius, double depthMin, double depthMax);
  /// A flat array moved along a straight line.
  static ProbeGeometry Linear(double fanWidth, double sweepWidth, double depthMin, double depthMax);
  /// All beams from one point.
  static ProbeGeometry Phased(double fanAngle, double sweepAngle, double depthMin, double depthMax);

  /// Throws Error(InvalidParameter) naming the field that is out of range; also when neither angle nor width of the fan
  /// (or both of the sweep, unless it is a single plane) leaves any beam, and when two beams reach the same point on
  /// opposite sides of the sweep axis, so that the inverse has no single answer.
  void Check() const;
};

/// Where the sample lies in the probe frame, mm.
Eigen::Vector3d PointOf(const ProbeGeometry&, const BeamPoint&);

/// Unit vector along the beam through the sample (\a depth is not used).
Eigen::Vector3d DirectionOf(const ProbeGeometry&, const BeamPoint&);

/// The exact inverse of PointOf: the beam point of a position in the probe frame (mm), or nothing where no beam of the
/// geometry passes (outside the angular range, or outside [depthMin, depthMax]), to within a relative \a tolerance at the
/// edges (1e-9 by default, so that the images of edge samples are inside).
std::optional<BeamPoint> BeamPointAt(const ProbeGeometry&, const Eigen::Vector3d& point, double tolerance = 1e-9);

} // namespace echorama
