// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Geometry/RigidTransform.h"

namespace echorama {

/// A motion as a person gives it in numbers: turned about the world's y, then x, then z (as vtkProp3D::SetOrientation has it)
/// about a centre, then moved.
struct PoseEdit {
  Eigen::Vector3d translationMm = Eigen::Vector3d::Zero(), degrees = Eigen::Vector3d::Zero(), centreMm = Eigen::Vector3d::Zero();

  /// Whole quarter turns are exact: a turn by 90 degrees leaves no dust of rounding.
  /// \throws Error(InvalidParameter) when something is not a number.
  Pose Motion() const;
};

ParameterList Describe(PoseEdit& p);

} // namespace echorama
