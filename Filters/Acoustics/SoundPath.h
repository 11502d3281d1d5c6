// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstdint>
#include <Eigen/Core>
#include <vector>

namespace echorama {

/// How the way of sound along one ray is written down: straight pieces, each within one medium, and the echoes of surfaces.
///
/// Echoes come back the way they went (reciprocity), so an amplitude counts both ways. *Scan depth* is where a scanner puts an
/// echo: the time there and back times half the sound speed that it assumes, mm. A receiver does not know of bends and bounces.
struct SoundSegment {
  Eigen::Vector3d from = Eigen::Vector3d::Zero();       ///< mm, world
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ(); ///< unit vector
  Eigen::Vector3d across =
      Eigen::Vector3d::UnitX(); ///< unit vector along the fan, perpendicular to the direction, carried through bends
  double length = 0.0;          ///< mm
  double way = 0.0;             ///< mm from the element to the beginning, along the path: what the width of the beam depends on
  double scanDepth = 0.0;       ///< mm, of the beginning
  double scanDepthPerMm = 1.0;  ///< assumed speed of sound / the medium's
  int medium = 0;               ///< material
  double amplitude = 1.0;       ///< of an echo from the beginning, there and back; negative after reflections that turn the phase
  double attenuation = 0.0;     ///< nepers per mm of length, there and back: amplitude falls as exp(-attenuation * s)
  int bounces = 0;              ///< reflections so far; 0: the direct way (bent, perhaps)
};

/// The echo of a surface that the path meets.
struct SurfaceEcho {
  double scanDepth = 0.0; ///< mm
  double amplitude = 0.0; ///< there and back, signed, with the reflection and how much of it turns back to the element
  double way = 0.0;       ///< mm from the element along the path
  int bounces = 0;
};

/// Everything that one ray met.
struct SoundPath {
  std::vector<SoundSegment> segments; ///< the direct way in order first, then that of each reflection, depth first
  std::vector<SurfaceEcho> echoes;
  std::int64_t rays = 0; ///< how often the scene was asked
};

} // namespace echorama
