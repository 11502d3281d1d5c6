// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Filters/Physics/GelColliders.h"
#include "Filters/Physics/GelGrid.h"
#include <functional>

namespace echorama {

/// How gel advances.
struct GelStepping {
  Eigen::Vector3d gravity{0.0, 0.0, -9810.0}; ///< mm/s^2
  /// Steps are this part of the time in which pressure crosses a cell.
  double courant = 0.6;
};
ParameterList Describe(GelStepping& p);

/// Sums over all gel that is left.
struct GelTotals {
  double mass = 0.0;                                         ///< g
  double volume = 0.0;                                       ///< mm^3, as it is compressed now
  double restVolume = 0.0;                                   ///< mm^3, without pressure
  Eigen::Vector3d momentum = Eigen::Vector3d::Zero();        ///< g mm/s
  Eigen::Vector3d angularMomentum = Eigen::Vector3d::Zero(); ///< g mm^2/s, about the origin of the world
};

struct GelReport {
  std::int64_t steps = 0, particleSteps = 0;
  std::int64_t gone = 0;     ///< particles that left the domain
  double goneMm3 = 0.0;      ///< their volume at rest
  std::int64_t torn = 0;     ///< strains that began anew: a sign of steps that are too long
  double shortestStep = 0.0; ///< s
  double largestSpeed = 0.0; ///< mm/s, at the end
  GelReport& operator+=(const GelReport& later);
};

/// Gel by the material point method (MLS-MPM with APIC, Herschel-Bulkley after Yue 2015 and Ram 2015), as METHODS 4 says why.
///
/// Particles carry mass, velocity, its gradient, and elastic strain; a sparse grid that lives for one step carries momentum.
/// Results do not depend on the number of threads.
class GelSolver {
public:
  /// \throws Error(InvalidParameter), Error(TooLarge)
  GelSolver(const GelDomain& domain, const GelMaterial& material, const GelStepping& stepping = {});

  /// Fills what is \a inside with gel at rest: \a perCell particles along each axis of a cell, at even places.
  void Fill(const std::function<bool(const Eigen::Vector3d&)>& inside, const std::array<int, 3>& perCell = {2, 2, 2});
  /// Makes the domain larger where a box needs it (GelDomain::With). What gel does does not depend on it, but for what leaves.
  void Include(const Eigen::AlignedBox3d& box);
  /// Gives every particle a velocity (and its gradient), by place.
  void SetVelocity(const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& velocity, const Eigen::Matrix3d& gradient);

  /// \a seconds in as many steps as it takes, while colliders move evenly from begin to end.
  /// \throws Error(InvalidParameter) for the time or a collider, Error(NotPossible) when the gel becomes unstable,
  /// Error(Cancelled): the gel then is as it was after some step
  GelReport Advance(double seconds, const std::vector<GelCollider>& colliders = {}, const Progress& progress = {});

  /// Those that are left. They are put in another order now and then; ids stay.
  const std::vector<GelParticle>& Particles() const { return particles_; }
  const GelDomain& Domain() const { return grid_.Domain(); }
  const GelLaw& Law() const { return law_; }
  GelTotals Totals() const;

private:
  struct Extremes {
    double speed = 0.0, gradient = 0.0;
    std::int64_t torn = 0, gone = 0, infinite = 0;
    Extremes& operator+=(const Extremes& other);
  };
  void Scatter(double seconds);
  void MoveNodes(double seconds, const GelColliders& colliders);
  void Mirror(double seconds);
  Extremes Gather(double seconds);

  GelLaw law_;
  GelStepping stepping_;
  GelGrid grid_;
  std::vector<GelParticle> particles_;
  Extremes extremes_;
  /// A node in a solid to which gel sticks, and the place on the other side of the wall.
  struct Ghost {
    GelNode* node;
    double raw[4];            ///< momentum and mass that particles gave it
    Eigen::Vector3d velocity; ///< of the solid
    std::array<int, 3> place; ///< of the lowest of the eight nodes around the mirror's image
    std::array<double, 8> weight;
    double fill;
  };
  GelNode* NodeOf(const Ghost& ghost, int corner); ///< nullptr where there is no gel, or a solid
  std::vector<std::vector<Ghost>> ghosts_;         ///< for every range of blocks
  std::vector<double> walls_;                      ///< mm, of every node from what gel sticks to
  std::int64_t steps_ = 0;
  std::int32_t made_ = 0;
};

} // namespace echorama
