// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Widgets/Pictures/SlicePicture.h"
#include <optional>

namespace echorama {

/// How a view along one axis of the world is seen, as in radiology.
struct SliceAxis {
  const char* name;
  Eigen::Vector3d right, up, along; ///< along: what the position of the plane counts along
  std::array<const char*, 4> sides; ///< of the body: at the left, right, lower and upper side of the picture
  std::array<double, 3> colour;     ///< RGB in [0, 1]
};

/// x, y, z and oblique, which is seen as z at first.
const std::array<SliceAxis, 4>& SliceAxes();

/// Where a slice view looks: a plane of the world, and the part of it that is seen. Pixels count from the middle of the lower
/// left one; lengths in mm.
struct SliceFrame {
  static constexpr std::size_t Oblique = 3;

  std::size_t axis = 2; ///< place in SliceAxes()
  Eigen::Vector3d right = SliceAxes()[2].right, up = SliceAxes()[2].up, along = SliceAxes()[2].along;
  Eigen::Vector3d focus = Eigen::Vector3d::Zero();  ///< the middle of the picture
  Eigen::Vector3d cursor = Eigen::Vector3d::Zero(); ///< the plane goes through it
  double mmPerPixel = 0.5;
  int width = 400, height = 400;

  Eigen::Vector3d Towards() const { return right.cross(up); } ///< the viewer
  double Position() const { return focus.dot(along); }
  Eigen::Vector3d WorldOf(double x, double y) const;
  Eigen::Vector2d PixelOf(const Eigen::Vector3d& world) const; ///< a point off the plane goes to where it is seen
  double DepthOf(const Eigen::Vector3d& world) const { return (world - focus).dot(Towards()); } ///< mm above the plane
  std::array<Eigen::Vector3d, 4> Corners() const; ///< outer ones: lower left, lower right, upper right, upper left
  SlicePlane Plane() const;

  /// Moves the plane, not the view, so that it goes through the cursor.
  void FollowCursor() { focus += (cursor - focus).dot(Towards()) * Towards(); }
  void SetAxis(std::size_t place);
  /// An oblique plane. \a wantedUp is made perpendicular. \returns false for directions that are none or parallel.
  bool SetNormalAndUp(const Eigen::Vector3d& normal, const Eigen::Vector3d& wantedUp);
  /// Turns about the picture's own axes through the cursor.
  void Turn(double degreesAboutRight, double degreesAboutUp);

  /// Where the plane of \a other, which goes through the cursor too, cuts this one: from end to end of the picture, in pixels.
  /// Nothing for a parallel plane, or when the line is not seen.
  std::optional<std::array<Eigen::Vector2d, 2>> CutBy(const SliceFrame& other) const;
  /// The part of a line that lies within \a depthMm of the plane, in pixels; nothing when none does.
  std::optional<std::array<Eigen::Vector2d, 2>> PartNear(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                                         double depthMm) const;
  /// Where the plane cuts a sphere: a closed path, in pixels; empty when it does not.
  std::vector<Eigen::Vector2d> CutOf(const Eigen::Vector3d& middle, double radiusMm) const;
  /// 1, 2 or 5 times a power of ten, at most a quarter of the width.
  double ScaleBarMm() const;
};

} // namespace echorama
