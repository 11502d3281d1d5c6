// SPDX-License-Identifier: BSD-3-Clause
// A drag is a question to geometry: the ray of a pixel meets a plane, or comes nearest to a line, at the press and now; the
// difference is the motion. Everything is measured from the press, never from step to step, so that a mouse that comes back
// brings the volume back, however it went. The one thing that is carried along is the angle of a turn, to count whole turns.
//
// Such questions have no good answer where the line or plane is seen nearly end-on or edge-on: a pixel then means a long way, or
// any way. This is decided once, at the press, as the view stands still during a drag. Cost: a few operations per mouse event.
#include "DragMotion.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include <cmath>

namespace echorama {
namespace {

// The sine of the angle between ray and axis or plane below which a pixel would be magnified more than tenfold.
constexpr double Oblique = 0.1;

bool IsUnit(const Eigen::Vector3d& v)
{
  return v.allFinite() && std::abs(v.norm() - 1.0) < 1e-6;
}

void CheckTool(const Pose& pose)
{
  if (!IsRotation(pose.linear(), 1e-4) || !pose.translation().allFinite())
    throw Error(Error::Kind::InvalidParameter, "the pose of the tool is not rigid");
}

} // namespace

bool MouseView::Usable() const
{
  return focus.allFinite() && middle.allFinite() && IsUnit(right) && IsUnit(up) && IsUnit(towards) &&
         (right.cross(up) - towards).norm() < 1e-6 && std::isfinite(mmPerPixel) && mmPerPixel > 0.0 &&
         std::isfinite(eyeDistance) && eyeDistance >= 0.0;
}

Ray MouseView::RayAt(const Eigen::Vector2d& pixel) const
{
  const Eigen::Vector2d mm = (pixel - middle) * mmPerPixel;
  const Eigen::Vector3d seen = focus + mm.x() * right + mm.y() * up;
  if (eyeDistance == 0.0)
    return {seen, -towards};
  const Eigen::Vector3d eye = focus + eyeDistance * towards;
  return {eye, (seen - eye).normalized()};
}

std::optional<Eigen::Vector2d> MouseView::PixelOf(const Eigen::Vector3d& point) const
{
  const Eigen::Vector3d away = point - focus;
  const double mm = MmPerPixelAt(point);
  if (eyeDistance > 0.0 && away.dot(towards) >= eyeDistance * (1.0 - 1e-9))
    return std::nullopt;
  return Eigen::Vector2d(middle + Eigen::Vector2d(away.dot(right), away.dot(up)) / mm);
}

double MouseView::MmPerPixelAt(const Eigen::Vector3d& point) const
{
  if (eyeDistance == 0.0)
    return mmPerPixel;
  const double share = 1.0 - (point - focus).dot(towards) / eyeDistance;
  return share > 1e-9 ? mmPerPixel * share : mmPerPixel;
}

Eigen::Vector3d MouseView::PointAtDepthOf(const Eigen::Vector3d& point, const Eigen::Vector2d& pixel) const
{
  const Eigen::Vector2d mm = (pixel - middle) * MmPerPixelAt(point);
  return focus + (point - focus).dot(towards) * towards + mm.x() * right + mm.y() * up;
}

Eigen::Vector3d MotionConstraint::Translation(const Eigen::Vector3d& v) const
{
  switch (kind) {
  case Kind::Axis:
    return v.dot(axis) * axis;
  case Kind::Plane:
    return v - v.dot(axis) * axis;
  default:
    return v;
  }
}

Eigen::Vector3d MotionConstraint::Rotation(const Eigen::Vector3d& v) const
{
  return kind == Kind::Free ? v : Eigen::Vector3d(v.dot(axis) * axis);
}

std::optional<MotionConstraint> ConstraintNamed(const std::string& name)
{
  const char* const axes[] = {"x", "y", "z"};
  const char* const planes[] = {"yz", "xz", "xy"};
  for (int axis = 0; axis < 3; ++axis) {
    if (name == axes[axis])
      return MotionConstraint{MotionConstraint::Kind::Axis, Eigen::Vector3d::Unit(axis)};
    if (name == planes[axis])
      return MotionConstraint{MotionConstraint::Kind::Plane, Eigen::Vector3d::Unit(axis)};
  }
  return name == "free" ? std::optional<MotionConstraint>(MotionConstraint()) : std::nullopt;
}

Drag::Drag(const MouseView& view, const DragParameters& parameters, const Eigen::Vector2d& pressed)
  : view_(view), parameters_(parameters), pressed_(pressed), last_(pressed)
{
  // Nothing that is dragged lies at the viewer, who would see nothing else.
  if (!view_.PixelOf(parameters_.centre))
    view_.mmPerPixel = 0.0;
  if (!view_.Usable() || !pressed.allFinite() || !parameters_.centre.allFinite() || !(parameters_.radiusPixels > 0.0) ||
      (parameters_.kind != DragKind::Trackball && !IsUnit(parameters_.axis))) {
    view_.mmPerPixel = 0.0; // not usable: To() stays at the identity
    return;
  }
  const Eigen::Vector3d sight = view_.RayAt(*view_.PixelOf(parameters_.centre)).direction;
  const double along = std::abs(sight.dot(parameters_.axis));
  switch (parameters_.kind) {
  case DragKind::AlongAxis: {
    oblique_ = parameters_.axis.cross(sight).norm() < Oblique;
    const auto start = AlongAxis(pressed);
    oblique_ = oblique_ || !start;
    startAlong_ = start.value_or(0.0);
    break;
  }
  case DragKind::InPlane:
  case DragKind::AboutAxis: {
    start_ = Hit(pressed);
    oblique_ = along < Oblique || !start_;
    // Seen edge-on, plane and ring are a line on the screen: along it the plane moves and the ring's near side runs.
    if (oblique_) {
      Eigen::Vector3d line = parameters_.axis.cross(-sight);
      if (line.norm() < Oblique) // the plane was missed although it is seen well: beyond the horizon
        line = view_.right;
      line.normalize();
      tangent_ = Eigen::Vector2d(line.dot(view_.right), line.dot(view_.up));
      if (tangent_.norm() > 0.0)
        tangent_.normalize();
      if (parameters_.kind == DragKind::InPlane)
        start_ = line; // the direction of the motion
    }
    break;
  }
  case DragKind::Trackball:
    break;
  }
}

std::optional<Eigen::Vector3d> Drag::Hit(const Eigen::Vector2d& pixel) const
{
  const Ray ray = view_.RayAt(pixel);
  const double slope = ray.direction.dot(parameters_.axis);
  if (std::abs(slope) < 1e-6)
    return std::nullopt;
  const double distance = (parameters_.centre - ray.origin).dot(parameters_.axis) / slope;
  // A parallel ray starts anywhere; one from an eye does not look backwards.
  if (!std::isfinite(distance) || (view_.eyeDistance > 0.0 && distance <= 0.0))
    return std::nullopt;
  return Eigen::Vector3d(ray.origin + distance * ray.direction);
}

std::optional<double> Drag::AlongAxis(const Eigen::Vector2d& pixel) const
{
  const Ray ray = view_.RayAt(pixel);
  const double cosine = ray.direction.dot(parameters_.axis), sine2 = 1.0 - cosine * cosine;
  if (sine2 < 0.25 * Oblique * Oblique)
    return std::nullopt;
  const Eigen::Vector3d away = ray.origin - parameters_.centre;
  const double along = (away.dot(parameters_.axis) - cosine * away.dot(ray.direction)) / sine2;
  const double distance = along * cosine - away.dot(ray.direction);
  if (!std::isfinite(along) || (view_.eyeDistance > 0.0 && distance <= 0.0))
    return std::nullopt;
  return along;
}

double Drag::AngleBetween(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const
{
  const auto a = Hit(from), b = Hit(to);
  if (!a || !b)
    return 0.0;
  const Eigen::Vector3d u = *a - parameters_.centre, v = *b - parameters_.centre;
  return std::atan2(parameters_.axis.dot(u.cross(v)), u.dot(v));
}

const Pose& Drag::To(const Eigen::Vector2d& pixel)
{
  if (!(view_.mmPerPixel > 0.0) || !pixel.allFinite())
    return motion_;
  const Eigen::Vector2d moved = pixel - pressed_;
  Eigen::Vector3d translation = Eigen::Vector3d::Zero(), rotation = Eigen::Vector3d::Zero();
  switch (parameters_.kind) {
  case DragKind::AlongAxis:
    if (oblique_) {
      const double away = parameters_.axis.dot(view_.towards) < 0.0 ? 1.0 : -1.0;
      translation = away * moved.y() * view_.MmPerPixelAt(parameters_.centre) * parameters_.axis;
    } else if (const auto along = AlongAxis(pixel)) {
      translation = (*along - startAlong_) * parameters_.axis;
    } else {
      return motion_;
    }
    break;
  case DragKind::InPlane:
    if (oblique_) {
      translation = moved.dot(tangent_) * view_.MmPerPixelAt(parameters_.centre) * *start_;
    } else if (const auto hit = Hit(pixel)) {
      translation = *hit - *start_;
    } else {
      return motion_;
    }
    break;
  case DragKind::AboutAxis:
    if (oblique_) {
      angle_ = moved.dot(tangent_) / parameters_.radiusPixels;
    } else {
      // At the centre itself there is no angle: half a pixel around it nothing turns. The angle since the press is exact; the
      // steps only tell which whole turn it belongs to.
      const auto hit = Hit(pixel);
      const double least = 0.5 * view_.MmPerPixelAt(parameters_.centre);
      if (!hit || (*hit - parameters_.centre).norm() < least)
        return motion_;
      const double guess = angle_ + AngleBetween(last_, pixel);
      last_ = pixel;
      if ((*start_ - parameters_.centre).norm() < least) { // pressed on the centre: the turn begins where the mouse has left it
        start_ = hit;
        pressed_ = pixel;
        return motion_;
      }
      const double exact = AngleBetween(pressed_, pixel);
      angle_ = exact + 2.0 * Pi * std::round((guess - exact) / (2.0 * Pi));
    }
    rotation = angle_ * parameters_.axis;
    break;
  case DragKind::Trackball: {
    const Eigen::Vector3d along = moved.x() * view_.right + moved.y() * view_.up;
    rotation = view_.towards.cross(along) / parameters_.radiusPixels;
    break;
  }
  }
  const Pose motion = MotionAbout(parameters_.centre, parameters_.rotationSensitivity * rotation,
                                  parameters_.translationSensitivity * translation);
  if (motion.matrix().allFinite())
    motion_ = motion;
  return motion_;
}

ToolDrag::ToolDrag(const Pose& toolToWorld, const MotionConstraint& constraint, double translationSensitivity,
                   double rotationSensitivity)
  : start_(toolToWorld), constraint_(constraint), translationSensitivity_(translationSensitivity),
    rotationSensitivity_(rotationSensitivity)
{
  CheckTool(toolToWorld);
}

const Pose& ToolDrag::To(const Pose& toolToWorld)
{
  CheckTool(toolToWorld);
  // A rotation vector is one of many, whole turns apart: the one nearest to the last is meant.
  Eigen::Vector3d turned = LogRotation(toolToWorld.linear() * start_.linear().transpose());
  const double angle = turned.norm();
  if (angle > 1e-9) {
    const Eigen::Vector3d axis = turned / angle;
    turned = (angle + 2.0 * Pi * std::round((turned_.dot(axis) - angle) / (2.0 * Pi))) * axis;
  } else if (turned_.norm() > Pi) {
    turned = turned_.normalized() * (2.0 * Pi * std::round(turned_.norm() / (2.0 * Pi)));
  }
  turned_ = turned;
  motion_ = MotionAbout(start_.translation(), rotationSensitivity_ * constraint_.Rotation(turned),
                        translationSensitivity_ * constraint_.Translation(toolToWorld.translation() - start_.translation()));
  return motion_;
}

} // namespace echorama
