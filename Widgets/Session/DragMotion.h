// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/RigidTransform.h"
#include <optional>
#include <string>

namespace echorama {

/// A half line. \a direction is a unit vector.
struct Ray {
  Eigen::Vector3d origin, direction;
};

/// How a view shows the world, as far as a mouse needs to know. Pixels count from the lower left; (i, j) is the middle of one.
struct MouseView {
  Eigen::Vector3d focus = Eigen::Vector3d::Zero(); ///< the point of the world in the middle of the view; of a slice: in its plane
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();   ///< unit vector
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();      ///< unit vector across \a right
  Eigen::Vector3d towards = Eigen::Vector3d::UnitZ(); ///< towards the viewer: right x up
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();   ///< where the focus is seen, pixels
  double mmPerPixel = 1.0;                            ///< at the focus, > 0
  double eyeDistance = 0.0;                           ///< from the viewer to the focus, mm; 0: parallel projection

  /// Whether a mouse can mean anything here: numbers are finite, pixels have a size, axes are a right-handed frame.
  bool Usable() const;
  /// What a pixel shows.
  Ray RayAt(const Eigen::Vector2d& pixel) const;
  /// Where a point is seen; none behind the viewer.
  std::optional<Eigen::Vector2d> PixelOf(const Eigen::Vector3d& point) const;
  /// How large a pixel is at the depth of a point, mm; of a point behind the viewer as at the focus.
  double MmPerPixelAt(const Eigen::Vector3d& point) const;
  /// Where the ray of a pixel meets the plane through \a point across the view.
  Eigen::Vector3d PointAtDepthOf(const Eigen::Vector3d& point, const Eigen::Vector2d& pixel) const;
};

/// What motions are held to.
struct MotionConstraint {
  enum class Kind {
    Free,
    Axis,  ///< along the axis, and about it
    Plane, ///< in the plane across the axis, and about the axis
  };
  Kind kind = Kind::Free;
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ(); ///< unit vector

  Eigen::Vector3d Translation(const Eigen::Vector3d& v) const; ///< the part that is allowed
  Eigen::Vector3d Rotation(const Eigen::Vector3d& v) const;    ///< the part of a rotation vector that is allowed
};

/// "free", an axis of the world ("x", "y", "z") or a plane across one ("yz", "xz", "xy"). None: there is none of this name.
std::optional<MotionConstraint> ConstraintNamed(const std::string& name);

/// How the mouse moves what it drags.
enum class DragKind {
  AlongAxis, ///< translation: the point of the line through the centre that is nearest to the mouse
  InPlane,   ///< translation: the point of the plane through the centre, across the axis, under the mouse
  AboutAxis, ///< rotation: the angle of the mouse around the centre, in the plane across the axis
  Trackball, ///< rotation: the front of a ball around the centre follows the mouse
};

struct DragParameters {
  DragKind kind = DragKind::InPlane;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero(); ///< of rotation; translations measure there
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< unit vector; not used by Trackball
  double radiusPixels = 80.0;          ///< of the ball, and of rings that are seen edge-on: so many pixels turn by one radian
  double translationSensitivity = 1.0; ///< 1: follows the mouse
  double rotationSensitivity = 1.0;    ///< 1: follows the mouse
};

/// A drag from its press on: turns where the mouse is into the motion of the world since the press.
///
/// What is seen so obliquely that the mouse would be magnified more than tenfold is done otherwise: along an axis that points at
/// the viewer things move as the mouse moves up (away from the viewer) and down; in a plane that is seen edge-on along its line
/// of sight alone; a ring that is seen edge-on turns as the mouse moves along it. Angles are followed through whole turns.
/// Motions are always finite: where a mouse position means nothing (beyond the horizon, a view that is not usable), the last one
/// stands. At the place of the press the motion is the identity to the bit.
class Drag {
public:
  Drag(const MouseView& view, const DragParameters& parameters, const Eigen::Vector2d& pressed);
  const Pose& To(const Eigen::Vector2d& pixel);
  /// The angle turned so far by AboutAxis, radians.
  double Angle() const { return angle_; }

private:
  std::optional<Eigen::Vector3d> Hit(const Eigen::Vector2d& pixel) const;
  std::optional<double> AlongAxis(const Eigen::Vector2d& pixel) const;
  double AngleBetween(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const;

  MouseView view_;
  DragParameters parameters_;
  Eigen::Vector2d pressed_, last_;
  bool oblique_ = false;                              ///< seen too obliquely for the usual way
  Eigen::Vector2d tangent_ = Eigen::Vector2d::Zero(); ///< of a ring seen edge-on: pixels per pixel
  std::optional<Eigen::Vector3d> start_;              ///< where the press meets the plane
  double startAlong_ = 0.0, angle_ = 0.0;
  Pose motion_ = Pose::Identity();
};

/// What is held follows a tool of a six-degree tracker: turns about where the tool was when it took hold, and moves with it.
class ToolDrag {
public:
  /// \throws Error(InvalidParameter) when the pose of the tool is not rigid.
  ToolDrag(const Pose& toolToWorld, const MotionConstraint& constraint, double translationSensitivity,
           double rotationSensitivity);
  /// The motion of the world since the start. Rotations beyond half a turn are followed as long as the tool is seen often enough.
  /// \throws Error(InvalidParameter) when the pose of the tool is not rigid.
  const Pose& To(const Pose& toolToWorld);

private:
  Pose start_;
  MotionConstraint constraint_;
  double translationSensitivity_, rotationSensitivity_;
  Eigen::Vector3d turned_ = Eigen::Vector3d::Zero();
  Pose motion_ = Pose::Identity();
};

} // namespace echorama
