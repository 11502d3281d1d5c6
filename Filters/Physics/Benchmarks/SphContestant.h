// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <cstdint>
#include <Eigen/Core>
#include <functional>
#include <vector>

namespace echorama {

/// Smoothing kernels of Mueller, Charypar and Gross 2003, which vanish at \a support (mm).
struct SphKernels {
  explicit SphKernels(double support);
  double Poly6(double squaredDistance) const;       ///< 1/mm^3
  double SpikySlope(double distance) const;         ///< 1/mm^4, negative
  double ViscosityLaplacian(double distance) const; ///< 1/mm^5
  double support;

private:
  double poly6_, spiky_, viscosity_;
};

struct SphParameters {
  double density = 1000.0;  ///< kg/m^3
  double viscosity = 1e-3;  ///< Pa s
  double soundSpeed = 1e3;  ///< mm/s: ten times the largest speed (Monaghan 2005), so that density varies by a percent
  double spacingMm = 1.0;   ///< of particles at rest; kernels reach twice as far
  double artificial = 0.02; ///< Monaghan's alpha: a least viscosity, of alpha density c spacing / 10
  Eigen::Vector3d gravity{0.0, 0.0, -9810.0}; ///< mm/s^2
  /// The box in which cells are laid out, mm. Particles may leave it, which only costs time, except across a periodic face.
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Constant(100.0);
  std::array<bool, 3> periodic{false, false, false};
};

struct SphParticle {
  Eigen::Vector3d position, velocity; ///< mm, mm/s
  double density = 0.0;               ///< g/mm^3, of the last step's begin
  double push = 0.0;                  ///< its pressure over the square of its density
  std::int32_t id = 0;
};

struct SphBoundaryParticle {
  Eigen::Vector3d position;
  double psi = 0.0; ///< g: the mass of fluid that it stands for
  std::int32_t body = 0;
};

/// Weakly compressible smoothed particle hydrodynamics of a Newtonian fluid, as the dissertation tried it for gel (3.3.1):
/// kernels of Mueller et al. 2003, pressure by the equation of state of Batchelor (2000) with the constants and the pairwise form
/// of Monaghan 2005, rigid bodies as particles after Akinci et al. 2012, which move fluid and are not moved by it. Pressure is
/// never negative, and a body's particle has that of the fluid before it.
///
/// Every particle gathers from its neighbours in the order of cells: one result for any number of threads.
class SphContestant {
public:
  /// \throws Error(InvalidParameter)
  explicit SphContestant(const SphParameters& parameters);

  /// Fluid at rest, on a lattice of the box, where it is \a inside.
  void Fill(const std::function<bool(const Eigen::Vector3d&)>& inside);
  void SetVelocity(const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& velocity);

  /// A rigid body by its signed distance, negative inside: of the box's lattice that which lies below its surface by up to a
  /// kernel's reach becomes particles of the body. Fluid keeps to it (no slip) when it is to \a stick. \returns its number
  int AddBody(const std::function<double(const Eigen::Vector3d&)>& distance, bool stick);
  void SetBodyVelocity(int body, const Eigen::Vector3d& velocity);
  void RemoveBody(int body);

  /// The step that Advance takes: 0.4 support / c, or less for what is viscous: support^2 density / (16 viscosity), which is half
  /// of what goes well amid fluid, for at a free surface, where densities are low, viscosity brakes twice as hard.
  double LongestStep() const;
  void Step(double seconds);
  /// Steps of LongestStep, the last one shorter. \returns how many
  std::int64_t Advance(double seconds);
  /// Lets all come to rest, as thick as it may well be without shorter steps: particles beside bodies begin too close to these.
  void Settle(double seconds);

  const std::vector<SphParticle>& Particles() const { return particles_; }
  const std::vector<SphBoundaryParticle>& Boundary() const { return boundary_; }
  double ParticleMass() const { return mass_; } ///< g
  double PressureAt(double density) const;      ///< Pa, of g/mm^3; never negative
  double LargestSpeed() const;                  ///< mm/s; not finite when the fluid has become unstable

private:
  // Particles by cells of at least a support's width, and in the order of these.
  class Cells {
  public:
    explicit Cells(const SphParameters& parameters);
    template <class Particle>
    void Sort(std::vector<Particle>& particles);
    template <class Visitor>
    void Visit(const Eigen::Vector3d& place, const Visitor& visit) const; // the numbers of all that may be near

  private:
    std::array<int, 3> CellOf(const Eigen::Vector3d& place) const;
    Eigen::Vector3d low_, perMm_;
    std::array<int, 3> size_;
    std::array<bool, 3> periodic_;
    std::vector<std::int32_t> start_;
  };
  struct Body {
    bool stick;
    Eigen::Vector3d velocity;
  };
  struct Neighbours { // of a range of particles; bodies' particles as ~number
    std::vector<std::int32_t> end, list;
  };

  std::vector<Eigen::Vector3d> Lattice(const std::function<bool(const Eigen::Vector3d&)>& inside) const;
  Eigen::Vector3d Apart(const Eigen::Vector3d& to, const Eigen::Vector3d& from) const;
  void FindDensities(std::ptrdiff_t begin, std::ptrdiff_t end, Neighbours& neighbours);
  Eigen::Vector3d Acceleration(std::size_t i, const std::int32_t* neighbour, const std::int32_t* last) const;

  SphParameters parameters_;
  SphKernels kernels_;
  Eigen::Array3d period_, halfPeriod_; // endless where there is none
  Cells cells_, boundaryCells_;
  double restDensity_, viscosity_, mass_; // g/mm^3, Pa s, g
  std::vector<SphParticle> particles_;
  std::vector<Eigen::Vector3d> accelerations_;
  std::vector<SphBoundaryParticle> boundary_;
  std::vector<Body> bodies_;
  std::vector<Neighbours> neighbours_;
};

} // namespace echorama
