// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Geometry/ProbeGeometry.h"
#include <array>
#include <cstdint>
#include <vector>

namespace echorama {

/// What is around the face of a probe. Lengths in mm.
struct ProbeHousing {
  double rimMm = 4.0;
  double skirtMm = 10.0;
  double neckMm = 30.0;
  double handleMm = 80.0, handleWidthMm = 30.0, handleThicknessMm = 22.0;
  double faceWidthMm = 22.0, faceThicknessMm = 13.0;
  double resolutionMm = 1.5;
};
ParameterList Describe(ProbeHousing& p);

/// A handle's outline is a superellipse, a rectangle with round sides: (|x| / a)^n + (|y| / b)^n = 1 with this n.
inline constexpr double handleRoundness = 2.6;

/// A probe as a solid in its own frame: the face that meets the skin (dissertation 3.1.1), a rounded edge, walls, and a neck that
/// leads to a handle. Closed, outward, free of self-intersections, and so fit for printing and for physics.
struct ProbeMesh {
  enum Part : unsigned char { Face, Housing, Handle };

  std::vector<Eigen::Vector3d> points;                 ///< mm; those of the face come first
  std::vector<std::array<std::uint32_t, 3>> triangles; ///< counter-clockwise as seen from outside; those of the face come first
  std::vector<unsigned char> part;                     ///< of each triangle
  std::size_t facePoints = 0;
  /// The geometry at whose depth 0 the points of the face lie: the probe's own, but for faces that have no size
  /// (ProbeHousing::faceWidthMm, faceThicknessMm) and for fans that are a part of their array, which is shown whole.
  ProbeGeometry face;

  /// mm^3.
  double Volume() const;
};

/// Builds the solid.
/// \throws Error(InvalidParameter) as ProbeGeometry::Check(), for a housing out of its ranges, and when it cannot be built, with
/// the reason: a fan of more than half a turn, a sweep of 178 degrees or more, a fan that reaches the sweep axis, where the face
/// would cut itself; Error(TooLarge) beyond 5 million triangles.
ProbeMesh MakeProbeMesh(const ProbeGeometry& geometry, const ProbeHousing& housing = {});

/// Where the beams begin, in the probe's frame, fan fastest: origin on the face (depth 0), +x along the array, +z along the beam.
/// \throws Error(InvalidParameter) as ProbeGeometry::Check() and for counts outside [1, 65536]; Error(TooLarge) beyond 2^24.
std::vector<Pose> ElementPoses(const ProbeGeometry& geometry, int elements, int sweepSteps);

/// Where element \a index of \a count lies, -0.5 ... 0.5; the middle when there is one.
inline double PositionOf(int index, int count)
{
  return count > 1 ? static_cast<double>(index) / (count - 1) - 0.5 : 0.0;
}

} // namespace echorama
