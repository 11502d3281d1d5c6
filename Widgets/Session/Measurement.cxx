// SPDX-License-Identifier: BSD-3-Clause
#include "Widgets/Session/Measurement.h"
#include "Core/Base/Angles.h"
#include <cmath>
#include <Eigen/Geometry>
#include <limits>

namespace echorama {

double Measurement::Value() const
{
  if (!IsAngle())
    return points.size() == 2 ? (points[1] - points[0]).norm() : std::numeric_limits<double>::quiet_NaN();
  const Eigen::Vector3d a = points[0] - points[1], b = points[2] - points[1];
  if (!(a.norm() > 0.0 && b.norm() > 0.0))
    return std::numeric_limits<double>::quiet_NaN();
  return DegreesPerRadian * std::atan2(a.cross(b).norm(), a.dot(b)); // exact near 0 and 180, where acos is not
}

} // namespace echorama
