// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "AlignmentHandles.h"
#include <array>
#include <vector>

namespace echorama {

/// Coloured polygons in pixels, painted one over the other.
struct HandlePicture {
  using Colour = std::array<unsigned char, 4>; ///< red, green, blue, opacity
  std::vector<Eigen::Vector2d> points;
  std::vector<Colour> colours; ///< one per point
  std::vector<std::vector<int>> polygons;

  void AddPolygon(const std::vector<Eigen::Vector2d>& corners, const Colour& colour);
  void AddDisc(const Eigen::Vector2d& centre, double radius, const Colour& colour);
  /// A line of some width, pixels; \a lineColours one per point.
  void AddLine(const std::vector<Eigen::Vector2d>& line, const std::vector<Colour>& lineColours, double width, bool closed);
};

/// The handles; \a marked: the one (by its index) that is under the mouse or held, -1: none. \a alongWorld: they lie along the
/// world's axes and have their colours, else those of the view.
void DrawHandles(const std::vector<Handle>& handles, int marked, bool alongWorld, const HandleSizes& sizes,
                 HandlePicture& picture);

/// What drags are held to: the axis, or those of the plane, as long thin lines through the centre.
void DrawConstraint(const MouseView& view, const MotionConstraint& constraint, const Eigen::Vector3d& centre,
                    HandlePicture& picture);

} // namespace echorama
