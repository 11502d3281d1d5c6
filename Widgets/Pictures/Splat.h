// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/RigidTransform.h"
#include "Widgets/Pictures/Particles.h"
#include <array>

namespace echorama {

/// The particles of one volume, as they are to be seen.
struct SplatSet {
  const Particles* particles = nullptr;
  std::array<double, 3> colour{1.0, 1.0, 1.0}; ///< RGB in [0, 1]
  double opacity = 1.0;                        ///< times that of the particles, [0, 1]
  Pose volumeToWorld = Pose::Identity();
};

/// What grey levels and opacities of particles become.
class SplatTints {
public:
  explicit SplatTints(const SplatSet& set);
  /// RGBA, not multiplied by alpha.
  std::array<std::uint8_t, 4> Of(std::uint8_t value, std::uint8_t alpha) const
  {
    return {tints_[0][value], tints_[1][value], tints_[2][value], tints_[3][alpha]};
  }

private:
  std::array<std::array<std::uint8_t, 256>, 4> tints_;
};

/// From where, as OpenGL has it.
struct SplatView {
  int width = 0, height = 0;                                 ///< pixels; both positive
  Eigen::Matrix4d worldToClip = Eigen::Matrix4d::Identity(); ///< camera and projection
  double pixels = 1.0;                                       ///< that 1 mm is wide where the clip coordinate w is 1
  double sides = 1.25;                                       ///< width of a particle, in sides of its block
};

/// Draws particles as squares of pixels, blended over each other in the order of their depth: what OpenGL makes of points that
/// are sorted from back to front, but for the rounding to bytes after each of them. Cost: one reading of the particles, and of
/// each pixel as often as particles lie on it until it is opaque. \param depth of what is opaque already: OpenGL's, [0, 1], one
/// number a pixel, the lowest row first; null: nothing is. \returns RGBA, multiplied by alpha, one pixel after the other, the
/// lowest row first. The order within one of 65536 steps of depth is that of the sets. Particles whose middles are outside of
/// what the camera sees are left out. Independent of the number of threads.
std::vector<std::uint8_t> DrawParticles(const std::vector<SplatSet>& sets, const SplatView& view, const float* depth = nullptr);

} // namespace echorama
