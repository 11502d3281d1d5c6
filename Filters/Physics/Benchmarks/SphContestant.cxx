// SPDX-License-Identifier: BSD-3-Clause
// A step: cells, densities (and who is whose neighbour), accelerations, and then all particles move on. Lengths are mm, times s,
// masses g, so that the unit of pressure is Pa and that of viscosity Pa s.
#include "SphContestant.h"
#include "Core/Base/CheckRange.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr std::ptrdiff_t particlesAtOnce = 256;
constexpr double supportInSpacings = 2.0;
constexpr double pi = 3.14159265358979323846;

// The mass with which an endless lattice of particles has the density at rest.
double LatticeMass(const SphKernels& kernels, double spacing, double density)
{
  const int reach = static_cast<int>(kernels.support / spacing) + 1;
  double sum = 0.0;
  for (int k = -reach; k <= reach; ++k)
    for (int j = -reach; j <= reach; ++j)
      for (int i = -reach; i <= reach; ++i)
        sum += kernels.Poly6(spacing * spacing * (i * i + j * j + k * k));
  return density / sum;
}

} // namespace

SphKernels::SphKernels(double h)
  : support(h), poly6_(315.0 / (64.0 * pi * std::pow(h, 9))), spiky_(-45.0 / (pi * std::pow(h, 6))), viscosity_(-spiky_)
{
}

double SphKernels::Poly6(double squaredDistance) const
{
  const double left = support * support - squaredDistance;
  return left > 0.0 ? poly6_ * left * left * left : 0.0;
}

double SphKernels::SpikySlope(double distance) const
{
  const double left = support - distance;
  return left > 0.0 ? spiky_ * left * left : 0.0;
}

double SphKernels::ViscosityLaplacian(double distance) const
{
  return viscosity_ * std::max(support - distance, 0.0);
}

SphContestant::Cells::Cells(const SphParameters& parameters) : low_(parameters.low), periodic_(parameters.periodic)
{
  const Eigen::Vector3d extent = parameters.high - parameters.low;
  for (int axis = 0; axis < 3; ++axis) {
    const int count = std::max(1, static_cast<int>(extent[axis] / (supportInSpacings * parameters.spacingMm) + 1e-9));
    const auto at = static_cast<std::size_t>(axis);
    size_[at] = count;
    perMm_[axis] = count / extent[axis];
    if (periodic_[at] && count < 3) // or a particle would be its own neighbour
      throw Error(Error::Kind::InvalidParameter, "a periodic axis must be at least three kernels' reaches long");
  }
}

// Places beyond the box count as its outermost cells: what is near stays in the same cell, or in one beside it. (And what is no
// number, of a fluid that has become unstable, as the lowest.)
std::array<int, 3> SphContestant::Cells::CellOf(const Eigen::Vector3d& place) const
{
  std::array<int, 3> cell;
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<std::size_t>(axis);
    cell[at] = static_cast<int>(std::fmin(std::fmax((place[axis] - low_[axis]) * perMm_[axis], 0.0), size_[at] - 1.0));
  }
  return cell;
}

template <class Particle>
void SphContestant::Cells::Sort(std::vector<Particle>& particles)
{
  start_.assign(static_cast<std::size_t>(size_[0]) * size_[1] * size_[2] + 1, 0);
  std::vector<std::size_t> cells(particles.size());
  for (std::size_t n = 0; n < particles.size(); ++n) {
    const std::array<int, 3> cell = CellOf(particles[n].position);
    cells[n] = (static_cast<std::size_t>(cell[2]) * size_[1] + cell[1]) * size_[0] + cell[0];
    ++start_[cells[n] + 1];
  }
  for (std::size_t c = 1; c < start_.size(); ++c)
    start_[c] += start_[c - 1];
  std::vector<std::int32_t> next(start_.begin(), start_.end() - 1);
  std::vector<Particle> sorted(particles.size());
  for (std::size_t n = 0; n < particles.size(); ++n)
    sorted[next[cells[n]]++] = particles[n];
  particles.swap(sorted);
}

template <class Visitor>
void SphContestant::Cells::Visit(const Eigen::Vector3d& place, const Visitor& visit) const
{
  const std::array<int, 3> cell = CellOf(place);
  std::array<std::array<int, 3>, 3> around; // by axis, -1 where there is none
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (int by = -1; by <= 1; ++by) {
      const int other = cell[axis] + by, size = size_[axis];
      around[axis][by + 1] = other >= 0 && other < size ? other : periodic_[axis] ? (other + size) % size : -1;
    }
  for (const int k : around[2])
    for (const int j : around[1])
      for (const int i : around[0])
        if (i >= 0 && j >= 0 && k >= 0) {
          const std::size_t c = (static_cast<std::size_t>(k) * size_[1] + j) * size_[0] + i;
          for (std::int32_t n = start_[c]; n < start_[c + 1]; ++n)
            visit(n);
        }
}

SphContestant::SphContestant(const SphParameters& parameters)
  : parameters_(parameters), kernels_(supportInSpacings * parameters.spacingMm), cells_(parameters), boundaryCells_(parameters),
    restDensity_(1e-6 * parameters.density)
{
  CheckRange("the spacing of particles", parameters.spacingMm, 1e-3, 1e3);
  CheckRange("the density", parameters.density, 1.0, 1e5);
  CheckRange("the viscosity", parameters.viscosity, 0.0, 1e9);
  CheckRange("the speed of sound", parameters.soundSpeed, 1e-3, 1e9);
  for (int axis = 0; axis < 3; ++axis)
    period_[axis] = parameters.periodic[axis] ? parameters.high[axis] - parameters.low[axis] : 1e300;
  halfPeriod_ = 0.5 * period_;
  viscosity_ =
      std::max(parameters.viscosity, parameters.artificial * restDensity_ * parameters.soundSpeed * parameters.spacingMm / 10.0);
  mass_ = LatticeMass(kernels_, parameters.spacingMm, restDensity_);
  boundaryCells_.Sort(boundary_);
}

std::vector<Eigen::Vector3d> SphContestant::Lattice(const std::function<bool(const Eigen::Vector3d&)>& inside) const
{
  std::vector<Eigen::Vector3d> places;
  const Eigen::Vector3d extent = parameters_.high - parameters_.low;
  const double spacing = parameters_.spacingMm;
  for (double z = 0.5 * spacing; z < extent.z(); z += spacing)
    for (double y = 0.5 * spacing; y < extent.y(); y += spacing)
      for (double x = 0.5 * spacing; x < extent.x(); x += spacing)
        if (inside(parameters_.low + Eigen::Vector3d(x, y, z)))
          places.push_back(parameters_.low + Eigen::Vector3d(x, y, z));
  return places;
}

void SphContestant::Fill(const std::function<bool(const Eigen::Vector3d&)>& inside)
{
  for (const Eigen::Vector3d& place : Lattice(inside))
    particles_.push_back({place, Eigen::Vector3d::Zero(), restDensity_, 0.0, static_cast<std::int32_t>(particles_.size())});
}

void SphContestant::SetVelocity(const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& velocity)
{
  for (SphParticle& particle : particles_)
    particle.velocity = velocity(particle.position);
}

int SphContestant::AddBody(const std::function<double(const Eigen::Vector3d&)>& distance, bool stick)
{
  const auto body = static_cast<std::int32_t>(bodies_.size());
  bodies_.push_back({stick, Eigen::Vector3d::Zero()});
  const auto isShell = [&](const Eigen::Vector3d& place) {
    const double depth = -distance(place);
    return depth > -1e-6 && depth < kernels_.support - 1e-6;
  };
  for (const Eigen::Vector3d& place : Lattice(isShell))
    boundary_.push_back({place, 0.0, body});
  boundaryCells_.Sort(boundary_);
  for (SphBoundaryParticle& particle : boundary_) {
    if (particle.body != body)
      continue;
    double sum = 0.0;
    boundaryCells_.Visit(particle.position, [&](std::int32_t n) {
      if (boundary_[n].body == body)
        sum += kernels_.Poly6(Apart(particle.position, boundary_[n].position).squaredNorm());
    });
    particle.psi = restDensity_ / sum;
  }
  return body;
}

void SphContestant::SetBodyVelocity(int body, const Eigen::Vector3d& velocity)
{
  bodies_[body].velocity = velocity;
}

void SphContestant::RemoveBody(int body)
{
  const auto isOfIt = [body](const SphBoundaryParticle& particle) { return particle.body == body; };
  boundary_.erase(std::remove_if(boundary_.begin(), boundary_.end(), isOfIt), boundary_.end());
  boundaryCells_.Sort(boundary_);
}

double SphContestant::LongestStep() const
{
  return kernels_.support * std::min(0.4 / parameters_.soundSpeed, kernels_.support * restDensity_ / (16.0 * viscosity_));
}

double SphContestant::PressureAt(double density) const
{
  const double stiffness = restDensity_ * parameters_.soundSpeed * parameters_.soundSpeed / 7.0;
  return std::max(0.0, stiffness * (std::pow(density / restDensity_, 7.0) - 1.0));
}

double SphContestant::LargestSpeed() const
{
  double square = 0.0;
  for (const SphParticle& particle : particles_) {
    const double own = particle.velocity.squaredNorm();
    if (!(own <= square)) // also when it is not a number, which then stays
      square = own;
  }
  return std::sqrt(square);
}

Eigen::Vector3d SphContestant::Apart(const Eigen::Vector3d& to, const Eigen::Vector3d& from) const
{
  Eigen::Vector3d apart = to - from;
  for (int axis = 0; axis < 3; ++axis) {
    if (apart[axis] > halfPeriod_[axis])
      apart[axis] -= period_[axis];
    else if (apart[axis] < -halfPeriod_[axis])
      apart[axis] += period_[axis];
  }
  return apart;
}

void SphContestant::FindDensities(std::ptrdiff_t begin, std::ptrdiff_t end, Neighbours& neighbours)
{
  const double reach = kernels_.support * kernels_.support;
  neighbours.list.clear();
  neighbours.end.clear();
  for (auto i = static_cast<std::int32_t>(begin); i < end; ++i) {
    SphParticle& own = particles_[i];
    double sum = 0.0;
    cells_.Visit(own.position, [&](std::int32_t j) {
      const double square = Apart(own.position, particles_[j].position).squaredNorm();
      if (square < reach) {
        sum += mass_ * kernels_.Poly6(square);
        if (j != i)
          neighbours.list.push_back(j);
      }
    });
    boundaryCells_.Visit(own.position, [&](std::int32_t b) {
      const double square = Apart(own.position, boundary_[b].position).squaredNorm();
      if (square < reach) {
        sum += boundary_[b].psi * kernels_.Poly6(square);
        neighbours.list.push_back(~b);
      }
    });
    own.density = sum;
    own.push = PressureAt(sum) / (sum * sum);
    neighbours.end.push_back(static_cast<std::int32_t>(neighbours.list.size()));
  }
}

Eigen::Vector3d SphContestant::Acceleration(std::size_t i, const std::int32_t* neighbour, const std::int32_t* last) const
{
  const SphParticle& own = particles_[i];
  Eigen::Vector3d sum = parameters_.gravity;
  for (; neighbour != last; ++neighbour) {
    const bool isFluid = *neighbour >= 0;
    const Eigen::Vector3d& place = isFluid ? particles_[*neighbour].position : boundary_[~*neighbour].position;
    const Eigen::Vector3d apart = Apart(own.position, place);
    const double distance = apart.norm();
    // A body's particle presses as the fluid before it does (Akinci's pressure, mirrored), and drags by its own velocity.
    double otherPush = own.push, otherMass = mass_, otherDensity = restDensity_, drag = 1.0;
    Eigen::Vector3d velocity;
    if (isFluid) {
      const SphParticle& other = particles_[*neighbour];
      otherPush = other.push;
      otherDensity = other.density;
      velocity = other.velocity;
    } else {
      const SphBoundaryParticle& other = boundary_[~*neighbour];
      otherMass = other.psi;
      velocity = bodies_[other.body].velocity;
      drag = bodies_[other.body].stick ? 1.0 : 0.0;
    }
    if (distance > 0.0)
      sum -= otherMass * (own.push + otherPush) * kernels_.SpikySlope(distance) / distance * apart;
    sum += drag * viscosity_ * otherMass / (own.density * otherDensity) * kernels_.ViscosityLaplacian(distance) *
           (velocity - own.velocity);
  }
  return sum;
}

void SphContestant::Step(double seconds)
{
  cells_.Sort(particles_);
  const auto count = static_cast<std::ptrdiff_t>(particles_.size());
  neighbours_.resize(static_cast<std::size_t>((count + particlesAtOnce - 1) / particlesAtOnce));
  accelerations_.resize(particles_.size());
  ParallelRanges(count, particlesAtOnce, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    FindDensities(begin, end, neighbours_[begin / particlesAtOnce]);
  });
  ParallelRanges(count, particlesAtOnce, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    const Neighbours& neighbours = neighbours_[begin / particlesAtOnce];
    const std::int32_t* first = neighbours.list.data();
    for (std::ptrdiff_t i = begin; i < end; ++i) {
      const std::int32_t* last = neighbours.list.data() + neighbours.end[i - begin];
      accelerations_[i] = Acceleration(i, first, last);
      first = last;
    }
  });
  for (std::size_t i = 0; i < particles_.size(); ++i) {
    SphParticle& particle = particles_[i];
    particle.velocity += seconds * accelerations_[i];
    particle.position += seconds * particle.velocity;
    for (int axis = 0; axis < 3; ++axis)
      if (parameters_.periodic[axis])
        particle.position[axis] -= period_[axis] * std::floor((particle.position[axis] - parameters_.low[axis]) / period_[axis]);
  }
  for (SphBoundaryParticle& particle : boundary_)
    particle.position += seconds * bodies_[particle.body].velocity;
  boundaryCells_.Sort(boundary_);
}

std::int64_t SphContestant::Advance(double seconds)
{
  std::int64_t steps = 0;
  for (double done = 0.0; done < seconds; ++steps) {
    const double step = std::min(LongestStep(), seconds - done);
    Step(step);
    done += step;
  }
  return steps;
}

void SphContestant::Settle(double seconds)
{
  const double viscosity = viscosity_, thick = 0.1 * kernels_.support * restDensity_ * parameters_.soundSpeed;
  viscosity_ = std::max(viscosity, thick);
  Advance(seconds);
  viscosity_ = viscosity;
  SetVelocity([](const Eigen::Vector3d&) { return Eigen::Vector3d::Zero(); });
}

} // namespace echorama
