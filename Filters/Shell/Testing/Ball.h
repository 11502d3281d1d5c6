// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Tissue/Icosphere.h"
#include "Filters/Tissue/SurfaceCheck.h"

namespace echorama {

/// About the origin.
inline TriangleSurface Ball(double radius, int level)
{
  const Icosphere sphere = Icosphere::Make(level);
  TriangleSurface surface;
  for (const Eigen::Vector3d& point : sphere.points)
    surface.points.push_back((radius * point).cast<float>());
  surface.triangles = sphere.triangles;
  return surface;
}

} // namespace echorama
