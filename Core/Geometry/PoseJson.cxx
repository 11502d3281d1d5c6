// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Geometry/PoseJson.h"
#include <cmath>

namespace echorama::PoseJson {
namespace {

JsonPlace::Json ListOf(const Eigen::Vector3d& v)
{
  return {v.x(), v.y(), v.z()};
}

} // namespace

JsonPlace::Json Of(const ImageGeometry& geometry)
{
  return {{"origin", ListOf(geometry.origin)},
          {"spacing", ListOf(geometry.spacing)},
          {"direction", JsonPlace::RowsOf(geometry.direction)},
          {"dimensions", geometry.dimensions}};
}

ImageGeometry ToGeometry(const JsonPlace::Json& value, const JsonPlace& place)
{
  ImageGeometry geometry;
  geometry.origin = place.In("origin").Vector<3>(place.Member(value, "origin"));
  geometry.spacing = place.In("spacing").Vector<3>(place.Member(value, "spacing"));
  geometry.direction = place.In("direction").Rows<3>(place.Member(value, "direction"));
  const Eigen::Vector3d dimensions = place.In("dimensions").Vector<3>(place.Member(value, "dimensions"));
  for (int axis = 0; axis < 3; ++axis) {
    if (!(dimensions[axis] >= 1.0 && dimensions[axis] <= 2147483647.0 && dimensions[axis] == std::floor(dimensions[axis])))
      place.In("dimensions").Fail("positive whole numbers are needed");
    geometry.dimensions[static_cast<std::size_t>(axis)] = static_cast<int>(dimensions[axis]);
  }
  try {
    geometry.Check("geometry");
  } catch (const Error& error) {
    place.Fail(error.what());
  }
  return geometry;
}

Pose ToPose(const JsonPlace::Json& value, const JsonPlace& place)
{
  const Eigen::Matrix4d matrix = place.Rows<4>(value);
  if (!IsRotation(matrix.topLeftCorner<3, 3>()) || matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    place.Fail("the matrix is not rigid (a rotation, a translation, and 0 0 0 1 below)");
  Pose pose;
  pose.matrix() = matrix;
  return pose;
}

} // namespace echorama::PoseJson
