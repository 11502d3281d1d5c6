// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/RigidTransform.h"
#include <optional>
#include <string>
#include <tuple>

namespace echorama {

/// A sample of beam space: how deep along its beam, and which beam.
struct BeamPoint {
  double depth = 0.0; ///< mm from the face along the beam
  double fan = 0.0;   ///< across the array, -0.5 (first element) ... 0.5 (last)
  double sweep = 0.0; ///< along the sweep, -0.5 ... 0.5
};

/// One bend of a probe, in the plane of the bend: a face of length \a width (mm) that bends over \a angle (radians). The
/// face passes through the origin, its centre of curvature lies at (0, -width / angle), and depth is measured along its
/// normals. An angle of 0 is a straight face, a width of 0 a point. Fan and sweep are one each.
struct ProbeArc {
  double angle = 0.0;
  double width = 0.0;

  /// A place by its position along the face (-0.5 ... 0.5) and its depth.
  struct Place {
    double along = 0.0;
    double depth = 0.0;
  };

  /// (across, outward) in mm of a place: the face runs along "across" and looks along "outward" in its middle.
  Eigen::Vector2d PointOf(const Place& place) const;

  /// The exact inverse. A point is met twice: by the normal that comes to it straight from the centre of curvature, and
  /// (\a behind, for a bent face) by the opposite one at a depth below -width / angle. The centre itself is given to the
  /// middle of the face. \a along is not limited to [-0.5, 0.5].
  Place PlaceOf(double across, double outward, bool behind = false) const;

  /// The curvature angle / width as a quotient of two numbers of which the greater is 1: (curvature, 1) of a face with a
  /// radius above 1 mm, (1, radius) of one below, so that neither a flat face nor a point is infinite.
  struct Bend {
    double curvature = 0.0, unit = 1.0;
  };
  Bend GetBend() const;

  /// How many mm a whole unit of \a along is at this depth; negative behind the centre of curvature.
  double Span(double depth) const { return width + angle * depth; }
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
  double depthMin = 0.0;   ///< mm, first sample; negative (in the housing) down to the centre of the fan's arc
  double depthMax = 100.0; ///< mm, last sample, > depthMin
  /// How far the middle of the fan lies from the middle of the array's arc, towards +x, in whole fans: 0 for a fan that is
  /// used from end to end. A scanner that looks with a part of a wider array still turns it about the line below the
  /// array's middle, so that no pose of a centred fan has the same beams.
  double fanOffset = 0.0;

  /// A curved array swept about an axis: angles in radians, radii in mm (the head parameters of dissertation 3.1.1).
  static ProbeGeometry Convex(double fanAngle, double fanRadius, double sweepAngle, double sweepRadius, double depthMin,
                              double depthMax);
  /// A flat array moved along a straight line.
  static ProbeGeometry Linear(double fanWidth, double sweepWidth, double depthMin, double depthMax);
  /// All beams from one point.
  static ProbeGeometry Phased(double fanAngle, double sweepAngle, double depthMin, double depthMax);

  ProbeArc Fan() const { return {fanAngle, fanWidth}; }
  ProbeArc Sweep() const { return {sweepAngle, sweepWidth}; }

  /// Whether the sweep is a single plane (angle and width 0): a 2D image in the plane y = 0.
  bool IsPlane() const;

  /// Whether the fan reaches behind the sweep axis, so that a plane of the sweep finds some of its samples on the other side.
  bool ReachesBehindAxis() const;

  /// The sum of depths and widths, mm: what tolerances are relative to.
  double Size() const;

  /// Throws Error(InvalidParameter) naming the field that is out of range; also when angle and width of the fan are both
  /// 0, when the offset turns a beam beyond half a turn, and when two beams could reach one point from opposite sides of the
  /// sweep axis, so that the inverse has no single answer: that takes a sweep of half a turn or more whose fan reaches behind the
  /// axis.
  void Check() const;

  bool operator==(const ProbeGeometry& other) const
  {
    const auto tie = [](const ProbeGeometry& p) {
      return std::tie(p.fanAngle, p.fanWidth, p.sweepAngle, p.sweepWidth, p.depthMin, p.depthMax, p.fanOffset);
    };
    return tie(*this) == tie(other);
  }
};

/// A probe and where it was.
struct PlacedProbe {
  ProbeGeometry geometry;
  Pose probeToWorld = Pose::Identity(); ///< rigid
};

/// Where the sample lies in the probe frame, mm.
Eigen::Vector3d PointOf(const ProbeGeometry&, const BeamPoint&);

/// Unit vector along the beam through the sample (\a depth is not used).
Eigen::Vector3d DirectionOf(const ProbeGeometry&, const BeamPoint&);

/// The exact inverse of PointOf: the beam point of a position in the probe frame (mm), or nothing where no beam of the
/// geometry passes (outside the angular range, or outside [depthMin, depthMax]), to within a relative \a tolerance at the
/// edges (1e-9 by default, so that the images of edge samples are inside; relative to the size of the geometry, and the
/// beam point is clamped to the range). Where all planes of the sweep meet (on the sweep axis, reached for instance at
/// +-90 degrees of the fan when both radii are equal) the answer is the middle plane, and at the common start of phased
/// beams the middle beam. A point reached from beyond the sweep axis (wide fans with a small sweep radius) is found too.
/// The geometry must pass Check().
std::optional<BeamPoint> BeamPointAt(const ProbeGeometry&, const Eigen::Vector3d& point, double tolerance = 1e-9);

} // namespace echorama
