// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ProbeGeometry.h"
#include "Filters/Physics/GelSolver.h"
#include "Filters/Tissue/TissueSurface.h"

namespace echorama::testing {

using Eigen::Vector3d;

/// What lies behind a plane through \a point; \a normal points into the gel.
inline GelCollider Wall(const Vector3d& point, const Vector3d& normal, bool stick)
{
  GelCollider wall;
  wall.shape = std::make_shared<GelPlane>();
  wall.contact.stick = stick;
  wall.begin.linear() = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), normal).toRotationMatrix();
  wall.begin.translation() = point;
  wall.end = wall.begin;
  return wall;
}

inline Vector3d PositionOf(const GelParticle& particle)
{
  return Eigen::Map<const Vector3d>(particle.position);
}

/// Gel between two plates at z = 4 and z = 4 + cells (mm), that gravity along x drives: the steady profile is known.
struct GelChannel {
  GelMaterial material;
  double wallStress = 100.0; ///< Pa
  int cells = 24;

  double Slope() const { return wallStress / (0.5 * cells); } ///< of the stress, Pa/mm
  /// mm/s, \a y mm from the middle
  double Exact(double y) const
  {
    const double power = 1.0 / material.exponent + 1.0;
    const auto term = [&](double stress) {
      return stress > material.yieldStress ? std::pow(stress - material.yieldStress, power) : 0.0;
    };
    return (term(wallStress) - term(Slope() * std::abs(y))) / (power * std::pow(material.consistency, power - 1.0) * Slope());
  }
  GelSolver Make() const
  {
    GelDomain domain;
    domain.cells = {4, 4, cells + 8};
    domain.periodic = {true, true, false};
    GelStepping stepping;
    stepping.gravity = Vector3d(Slope() / (material.density * 1e-6), 0.0, 0.0);
    GelSolver solver(domain, material, stepping);
    const double top = 4.0 + cells;
    solver.Fill([top](const Vector3d& at) { return at.z() > 4.0 && at.z() < top; });
    return solver;
  }
  std::vector<GelCollider> Plates() const
  {
    return {Wall({0, 0, 4}, {0, 0, 1}, true), Wall({0, 0, 4.0 + cells}, {0, 0, -1}, true)};
  }
};

/// A block whose skin is at \a skinZ, in the frame of \a pose.
inline TissueSurface SkinBlock(double skinZ, const Pose& pose = Pose::Identity())
{
  TissueSurface surface;
  surface.materials = {StandardMaterial("air"), StandardMaterial("muscle")};
  surface.bodies = {{"block", 1}};
  for (int corner = 0; corner < 8; ++corner)
    surface.points.push_back(
        (pose * Vector3d(corner & 1 ? 90 : -90, corner & 2 ? 80 : -80, corner & 4 ? 90 : skinZ)).cast<float>());
  surface.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                       {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  surface.bodyOfTriangle.assign(surface.triangles.size(), 0);
  return surface;
}

inline PlacedProbe LinearProbe(const Pose& pose = Pose::Identity())
{
  return {ProbeGeometry::Linear(16.0, 12.0, 0.0, 80.0), pose};
}

} // namespace echorama::testing
