// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Widgets/Session/AlignmentHandles.h"
#include <cmath>
#include <gtest/gtest.h>
#include <random>

using namespace echorama;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double Pi = 3.14159265358979323846;

// A view turned any way, its focus off the origin and its middle off the lower left corner.
MouseView View(double eyeDistance = 0.0)
{
  MouseView view;
  const Eigen::Matrix3d turned = ExpRotation(Vector3d(0.4, -0.7, 1.1));
  view.focus = Vector3d(12.0, -30.0, 7.0);
  view.right = turned.col(0);
  view.up = turned.col(1);
  view.towards = turned.col(2);
  view.middle = Vector2d(399.5, 299.5);
  view.mmPerPixel = 0.25;
  view.eyeDistance = eyeDistance;
  return view;
}

DragParameters Parameters(DragKind kind, const Vector3d& axis, const Vector3d& centre)
{
  DragParameters parameters;
  parameters.kind = kind;
  parameters.axis = axis.normalized();
  parameters.centre = centre;
  return parameters;
}

Pose DragOnce(const MouseView& view, const DragParameters& parameters, const Vector2d& from, const Vector2d& to)
{
  return Drag(view, parameters, from).To(to);
}

} // namespace

TEST(MouseView, PixelsAndRaysAgree)
{
  for (const double eye : {0.0, 300.0}) {
    const MouseView view = View(eye);
    for (const Vector2d& pixel : {Vector2d(0, 0), Vector2d(399.5, 299.5), Vector2d(731, 12)}) {
      const Ray ray = view.RayAt(pixel);
      EXPECT_NEAR(ray.direction.norm(), 1.0, 1e-14);
      for (const double distance : {100.0, 250.0}) {
        const auto back = view.PixelOf(ray.origin + distance * ray.direction);
        ASSERT_TRUE(back);
        EXPECT_LT((*back - pixel).norm(), 1e-9);
      }
      const Vector3d point = view.focus + 40.0 * view.towards;
      const auto seen = view.PixelOf(view.PointAtDepthOf(point, pixel));
      EXPECT_LT((*seen - pixel).norm(), 1e-9);
    }
  }
  const MouseView view = View(300.0);
  EXPECT_DOUBLE_EQ(view.MmPerPixelAt(view.focus), 0.25);
  EXPECT_NEAR(view.MmPerPixelAt(view.focus - 300.0 * view.towards), 0.5, 1e-12);
  EXPECT_FALSE(view.PixelOf(view.focus + 301.0 * view.towards));
}

TEST(Drag, InTheViewPlaneItFollowsTheMouse)
{
  const MouseView view = View();
  const auto parameters = Parameters(DragKind::InPlane, view.towards, view.focus + Vector3d(3, 2, 1));
  const Pose motion = DragOnce(view, parameters, Vector2d(100, 200), Vector2d(140, 170));
  EXPECT_LT((motion.translation() - 0.25 * (40.0 * view.right - 30.0 * view.up)).norm(), 1e-12);
  EXPECT_EQ(motion.linear(), Eigen::Matrix3d::Identity());
}

TEST(Drag, AlongAnAxisThePointUnderTheMouseStaysThere)
{
  for (const double eye : {0.0, 400.0}) {
    const MouseView view = View(eye);
    const Vector3d axis = (view.right + 0.5 * view.up + 0.8 * view.towards).normalized();
    const Vector3d centre = view.focus + 5.0 * view.up;
    // The mouse goes from where one point of the line is seen to where another is.
    const Vector2d from = *view.PixelOf(centre + 4.0 * axis), to = *view.PixelOf(centre + 21.0 * axis);
    const Pose motion = DragOnce(view, Parameters(DragKind::AlongAxis, axis, centre), from, to);
    EXPECT_LT((motion.translation() - 17.0 * axis).norm(), 1e-9) << eye;
  }
  // Across the axis the mouse moves nothing in a parallel view.
  const MouseView view = View();
  const Pose still = DragOnce(view, Parameters(DragKind::AlongAxis, view.right, view.focus), Vector2d(10, 10), Vector2d(10, 90));
  EXPECT_LT(still.translation().norm(), 1e-12);
}

TEST(Drag, InAnyPlaneThePointUnderTheMouseStaysThere)
{
  for (const double eye : {0.0, 400.0}) {
    const MouseView view = View(eye);
    const Vector3d normal = (view.towards + 0.7 * view.right).normalized(), u = normal.unitOrthogonal(), v = normal.cross(u);
    const Vector2d from = *view.PixelOf(view.focus + 6.0 * u), to = *view.PixelOf(view.focus - 3.0 * u + 11.0 * v);
    const Pose motion = DragOnce(view, Parameters(DragKind::InPlane, normal, view.focus), from, to);
    EXPECT_LT((motion.translation() - (-9.0 * u + 11.0 * v)).norm(), 1e-9) << eye;
  }
}

TEST(Drag, ARingFollowsTheAngleOfTheMouse)
{
  for (const double eye : {0.0, 400.0}) {
    const MouseView view = View(eye);
    const Vector3d axis = (view.towards - 0.9 * view.up).normalized(), u = axis.unitOrthogonal();
    const Vector3d centre = view.focus + Vector3d(2, -3, 4);
    const auto at = [&](double radius, double degrees) {
      return *view.PixelOf(centre + ExpRotation(axis * degrees * Pi / 180.0) * (radius * u));
    };
    Drag drag(view, Parameters(DragKind::AboutAxis, axis, centre), at(20.0, 10.0));
    const Pose motion = drag.To(at(35.0, 40.0)); // at any radius
    EXPECT_LT((motion.linear() - ExpRotation(axis * Pi / 6.0)).norm(), 1e-9) << eye;
    EXPECT_LT((motion * centre - centre).norm(), 1e-12);
    // Twice around, and back.
    for (int degrees = 40; degrees <= 760; degrees += 30)
      drag.To(at(20.0, degrees));
    EXPECT_NEAR(drag.Angle(), 750.0 * Pi / 180.0, 1e-9);
    for (int degrees = 760; degrees >= 10; degrees -= 30)
      drag.To(at(20.0, degrees));
    EXPECT_NEAR(drag.Angle(), 0.0, 1e-9);
  }
}

TEST(Drag, ARingSeenEdgeOnTurnsAlongItself)
{
  const MouseView view = View();
  auto parameters = Parameters(DragKind::AboutAxis, view.up, view.focus);
  parameters.radiusPixels = 80.0;
  // The near side of a ring about the upward axis runs to the right when it turns by a positive angle.
  const Pose motion = DragOnce(view, parameters, Vector2d(399.5, 299.5), Vector2d(439.5, 320.0));
  EXPECT_LT((LogRotation(motion.linear()) - 0.5 * view.up).norm(), 1e-9);
  EXPECT_GT((motion * (view.focus + view.towards) - view.focus).dot(view.right), 0.4);
}

TEST(Drag, ABallFollowsTheMouse)
{
  const MouseView view = View();
  auto parameters = Parameters(DragKind::Trackball, view.towards, view.focus);
  parameters.radiusPixels = 50.0;
  const Pose motion = DragOnce(view, parameters, Vector2d(10, 10), Vector2d(10 + 30, 10 + 40));
  EXPECT_NEAR(RotationAngle(motion), 1.0, 1e-12);
  const Vector3d front = motion.linear() * view.towards;
  EXPECT_NEAR(front.dot(view.right), 0.6 * std::sin(1.0), 1e-12);
  EXPECT_NEAR(front.dot(view.up), 0.8 * std::sin(1.0), 1e-12);
}

TEST(Drag, WhatPointsAtTheViewerMovesWithTheMouseUp)
{
  for (const double eye : {0.0, 400.0}) {
    const MouseView view = View(eye);
    for (const double sign : {1.0, -1.0}) {
      const Pose motion = DragOnce(view, Parameters(DragKind::AlongAxis, sign * view.towards, view.focus), Vector2d(399.5, 299.5),
                                   Vector2d(350, 319.5));
      EXPECT_LT((motion.translation() + 20.0 * 0.25 * view.towards).norm(), 1e-9);
    }
    // A plane edge-on moves along the line that is seen of it.
    const Pose motion =
        DragOnce(view, Parameters(DragKind::InPlane, view.up, view.focus), Vector2d(399.5, 299.5), Vector2d(419.5, 390.0));
    EXPECT_LT((motion.translation() - 20.0 * 0.25 * view.right).norm(), 1e-9);
  }
}

TEST(Drag, SensitivityScalesTheMotion)
{
  const MouseView view = View();
  auto parameters = Parameters(DragKind::InPlane, view.towards, view.focus);
  parameters.translationSensitivity = 0.1;
  EXPECT_LT((DragOnce(view, parameters, Vector2d(0, 0), Vector2d(100, 0)).translation() - 2.5 * view.right).norm(), 1e-12);
  parameters = Parameters(DragKind::AboutAxis, view.towards, view.focus);
  parameters.rotationSensitivity = 0.5;
  Drag drag(view, parameters, view.middle + Vector2d(100, 0));
  drag.To(view.middle + Vector2d(0, 100));
  drag.To(view.middle + Vector2d(-100, 0));
  const Pose motion = drag.To(view.middle + Vector2d(0, -100)); // 270 degrees of the mouse: a turn is not lost by halving
  EXPECT_LT((motion.linear() - ExpRotation(view.towards * 0.75 * Pi)).norm(), 1e-9);
}

TEST(Drag, BackAtThePressNothingHasMoved)
{
  for (const double eye : {0.0, 400.0}) {
    const MouseView view = View(eye);
    for (const DragKind kind : {DragKind::AlongAxis, DragKind::InPlane, DragKind::AboutAxis, DragKind::Trackball}) {
      for (const Vector3d& axis : {view.towards, view.right, Vector3d(0.3, 0.5, -0.8).normalized()}) {
        Drag drag(view, Parameters(kind, axis, view.focus + Vector3d(1, 2, 3)), Vector2d(300, 200));
        drag.To(Vector2d(420, 111));
        EXPECT_EQ(drag.To(Vector2d(300, 200)).matrix(), Eigen::Matrix4d::Identity());
      }
    }
  }
}

TEST(Drag, IsAlwaysFiniteAndRigid)
{
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto direction = [&] { return Vector3d(uniform(generator), uniform(generator), uniform(generator)).normalized(); };
  for (int i = 0; i < 20000; ++i) {
    MouseView view = View(i % 2 ? 300.0 : 0.0);
    // Axes that are, or nearly are, along, across or in no relation to the view; centres anywhere, also behind the viewer.
    const Vector3d axes[] = {view.towards, view.right, (view.towards + 1e-9 * view.up).normalized(), direction(),
                             (view.right + 0.1 * uniform(generator) * view.towards).normalized()};
    const auto kind = static_cast<DragKind>(i % 4);
    Drag drag(view, Parameters(kind, axes[(i / 4) % 5], view.focus + 400.0 * direction()),
              view.middle + 3000.0 * Vector2d(uniform(generator), uniform(generator)));
    for (int step = 0; step < 5; ++step) {
      const Pose motion = drag.To(view.middle + 3000.0 * Vector2d(uniform(generator), uniform(generator)));
      ASSERT_TRUE(motion.matrix().allFinite()) << i;
      ASSERT_TRUE(IsRotation(motion.linear(), 1e-9)) << i;
    }
  }
  // What no mouse and no view should say.
  const double nan = std::nan("");
  MouseView view = View();
  Drag drag(view, Parameters(DragKind::InPlane, view.towards, view.focus), Vector2d(0, 0));
  drag.To(Vector2d(10, 0));
  EXPECT_NEAR(drag.To(Vector2d(nan, 0)).translation().norm(), 2.5, 1e-12) << "the last motion stands";
  view.mmPerPixel = 0.0;
  EXPECT_FALSE(view.Usable());
  EXPECT_EQ(DragOnce(view, Parameters(DragKind::InPlane, View().towards, view.focus), {0, 0}, {9, 9}).matrix(),
            Eigen::Matrix4d::Identity());
  auto parameters = Parameters(DragKind::AboutAxis, Vector3d::UnitX(), Vector3d::Zero());
  parameters.axis = Vector3d::Zero();
  EXPECT_EQ(DragOnce(View(), parameters, {0, 0}, {9, 9}).matrix(), Eigen::Matrix4d::Identity());
}

TEST(Drag, ATurnThatIsPressedOnTheCentreBeginsOutsideIt)
{
  const MouseView view = View();
  Drag drag(view, Parameters(DragKind::AboutAxis, view.towards, view.focus), view.middle);
  EXPECT_EQ(drag.To(view.middle + Vector2d(0, 10)).matrix(), Eigen::Matrix4d::Identity());
  drag.To(view.middle + Vector2d(-10, 0));
  EXPECT_NEAR(drag.Angle(), 0.5 * Pi, 1e-9);
}

TEST(ToolDrag, WhatIsHeldFollowsTheTool)
{
  const Pose start = MotionAbout(Vector3d(1, 2, 3), Vector3d(0.2, -0.4, 0.9), Vector3d(40, 50, 60));
  const Pose end = MotionAbout(Vector3d(3, 2, 1), Vector3d(1.1, 0.6, -0.3), Vector3d(-5, 8, 20));
  ToolDrag drag(start, {}, 1.0, 1.0);
  EXPECT_LT((drag.To(end).matrix() - (end * start.inverse()).matrix()).norm(), 1e-10);
  EXPECT_LT((drag.To(start).matrix() - Eigen::Matrix4d::Identity()).norm(), 1e-12);

  ToolDrag fine(start, {}, 0.5, 0.25);
  const Pose motion = fine.To(end);
  EXPECT_LT((motion * start.translation() - start.translation() - 0.5 * (end.translation() - start.translation())).norm(), 1e-10);
  EXPECT_NEAR(RotationAngle(motion), 0.25 * RotationAngle(end * start.inverse()), 1e-10);
}

TEST(ToolDrag, TurnsBeyondHalfATurnAreFollowed)
{
  const Vector3d axis = Vector3d(1, 1, 0).normalized();
  ToolDrag drag(Pose::Identity(), {}, 1.0, 0.5);
  Pose motion;
  for (int degrees = 0; degrees <= 300; degrees += 20)
    motion = drag.To(MotionAbout(Vector3d::Zero(), axis * degrees * Pi / 180.0, Vector3d::Zero()));
  EXPECT_LT((motion.linear() - ExpRotation(axis * 150.0 * Pi / 180.0)).norm(), 1e-9);
  for (int degrees = 300; degrees <= 360; degrees += 20)
    motion = drag.To(MotionAbout(Vector3d::Zero(), axis * degrees * Pi / 180.0, Vector3d::Zero()));
  EXPECT_LT((motion.linear() - ExpRotation(axis * Pi)).norm(), 1e-6) << "a whole turn of the tool";
}

TEST(ToolDrag, IsHeldToAnAxisOrPlane)
{
  const Pose end = MotionAbout(Vector3d::Zero(), Vector3d(0.3, 0.2, 0.5), Vector3d(4, 5, 6));
  MotionConstraint constraint;
  constraint.kind = MotionConstraint::Kind::Axis;
  const Pose along = ToolDrag(Pose::Identity(), constraint, 1.0, 1.0).To(end);
  EXPECT_LT((along.translation() - Vector3d(0, 0, 6)).norm(), 1e-12);
  EXPECT_LT((along.linear() - ExpRotation(Vector3d(0, 0, 0.5))).norm(), 1e-9);
  constraint.kind = MotionConstraint::Kind::Plane;
  EXPECT_LT((ToolDrag(Pose::Identity(), constraint, 1.0, 1.0).To(end).translation() - Vector3d(4, 5, 0)).norm(), 1e-12);
}

TEST(ToolDrag, RefusesWhatIsNotRigid)
{
  Pose bad = Pose::Identity();
  bad.linear() *= 2.0;
  EXPECT_THROW(ToolDrag(bad, {}, 1.0, 1.0), Error);
  ToolDrag drag(Pose::Identity(), {}, 1.0, 1.0);
  bad = Pose::Identity();
  bad.translation().x() = std::nan("");
  EXPECT_THROW(drag.To(bad), Error);
}

TEST(AlignmentHandles, HaveTheirSizeAtAnyZoom)
{
  const HandleSizes sizes;
  for (const double eye : {0.0, 500.0})
    for (const double zoom : {0.01, 0.3, 5.0}) {
      MouseView view = View(eye * zoom);
      view.mmPerPixel = zoom;
      // The frame of the view: its first arrow is seen across.
      Eigen::Matrix3d frame;
      frame << view.right, view.up, view.towards;
      for (const Handle& handle : MakeHandles(view, view.focus, frame, true, sizes)) {
        if (handle.kind == Handle::Kind::Arrow) {
          EXPECT_NEAR((handle.line[1] - view.middle).norm(), sizes.arrowEnd, 1e-6);
        } else if (handle.kind == Handle::Kind::Ring) {
          for (const Vector2d& point : handle.line)
            EXPECT_NEAR((point - view.middle).norm(), sizes.ring, 1e-6);
        }
      }
    }
}

TEST(AlignmentHandles, AreFoundWhereTheyAreSeen)
{
  const MouseView view = View(600.0);
  const Eigen::Matrix3d frame = Eigen::Matrix3d::Identity();
  const HandleSizes sizes;
  const Vector3d centre = view.focus + Vector3d(8, 3, -9);
  const auto handles = MakeHandles(view, centre, frame, false, sizes);
  ASSERT_EQ(handles.size(), 11u) << "three arrows, squares and rings, the view's ring and the centre";
  for (std::size_t i = 0; i < handles.size(); ++i) {
    const Handle& handle = handles[i];
    Vector2d at = handle.line[0];
    if (handle.kind == Handle::Kind::Arrow)
      at = handle.line[1];
    else if (handle.kind == Handle::Kind::Square)
      at = 0.25 * (handle.line[0] + handle.line[1] + handle.line[2] + handle.line[3]);
    else if (handle.kind == Handle::Kind::Ring)
      continue; // they cross each other: below
    EXPECT_EQ(HandleAt(handles, at, sizes), static_cast<int>(i));
  }
  // Of each ring some point is taken as this ring.
  for (std::size_t i = 0; i < handles.size(); ++i) {
    int found = 0;
    if (handles[i].kind != Handle::Kind::Ring)
      continue;
    for (const Vector2d& point : handles[i].line)
      found += HandleAt(handles, point, sizes) == static_cast<int>(i);
    EXPECT_GT(found, 30) << i;
  }
  EXPECT_EQ(HandleAt(handles, *view.PixelOf(centre) + Vector2d(300, 0), sizes), -1);
}

TEST(AlignmentHandles, InASliceTheyLieInItsPlane)
{
  MouseView view; // an axial slice
  bool alongWorld = false;
  const Eigen::Matrix3d frame = SliceFrame(view, alongWorld);
  EXPECT_TRUE(alongWorld);
  EXPECT_EQ(frame, Eigen::Matrix3d::Identity());
  EXPECT_EQ(MakeHandles(view, Vector3d::Zero(), frame, true, {}).size(), 5u);
  view = View();
  SliceFrame(view, alongWorld);
  EXPECT_FALSE(alongWorld);
  // Of a view that looks along x, the frame's third column is x.
  view.right = Vector3d::UnitY();
  view.up = Vector3d::UnitZ();
  view.towards = Vector3d::UnitX();
  EXPECT_EQ(Vector3d(SliceFrame(view, alongWorld).col(2)), Vector3d::UnitX());
  EXPECT_GT(SliceFrame(view, alongWorld).determinant(), 0.0);
}

TEST(AlignmentHandles, AreNotShownWhereTheyCouldNotBeUsed)
{
  MouseView view = View();
  Eigen::Matrix3d frame;
  frame << view.right, view.up, view.towards; // the third arrow points at the viewer, two squares are seen edge-on
  int arrows = 0, squares = 0, rings = 0;
  for (const Handle& handle : MakeHandles(view, view.focus, frame, false, {})) {
    arrows += handle.kind == Handle::Kind::Arrow;
    squares += handle.kind == Handle::Kind::Square;
    rings += handle.kind == Handle::Kind::Ring;
  }
  EXPECT_EQ(arrows, 2);
  EXPECT_EQ(squares, 1);
  EXPECT_EQ(rings, 4);
  view = View(100.0);
  EXPECT_TRUE(MakeHandles(view, view.focus + 200.0 * view.towards, frame, false, {}).empty()) << "behind the viewer";
  view.mmPerPixel = std::nan("");
  EXPECT_TRUE(MakeHandles(view, view.focus, frame, false, {}).empty());
}
