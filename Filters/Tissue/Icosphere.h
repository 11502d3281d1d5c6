// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <cstdint>
#include <Eigen/Core>
#include <vector>

namespace echorama {

/// A sphere of radius 1 about the origin as triangles of nearly one size: an icosahedron, subdivided. Closed; triangles are
/// counter-clockwise as seen from outside; corners lie on the sphere.
/// Source: dissertation 3.1.2 and figures 3.3, 3.4.
struct Icosphere {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  static constexpr int maxLevel = 8; ///< 1.3 million triangles

  /// 10 * 4^level + 2 points and 20 * 4^level triangles. \throws Error(InvalidParameter) for a level outside [0, maxLevel].
  static Icosphere Make(int level);

  /// Within the triangles; below that of the sphere, 4 pi / 3. A mesh scaled by cbrt(4 pi / 3 / Volume()) has the volume of the
  /// sphere, with corners that lie outside of it by about 0.6 of Deviation() and triangles within it by the rest.
  double Volume() const;

  /// How far into the sphere the middle of a triangle lies at most, per radius.
  static double Deviation(int level);

  /// The lowest level whose triangles stay within \a deviationMm of a sphere of \a radiusMm with their corners on it; maxLevel
  /// when none does. \throws Error(InvalidParameter) when either is not above 0.
  static int LevelFor(double radiusMm, double deviationMm);
};

} // namespace echorama
