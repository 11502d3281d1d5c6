// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Physics/GelSolver.h"

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

} // namespace echorama::testing
