// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Physics/Benchmarks/SphContestant.h"
#include "Testing/Sanitized.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

using namespace echorama;
using Eigen::Vector3d;

namespace {

constexpr double pi = 3.14159265358979323846;

// Of a function of the distance, over the ball of a kernel.
double Integral(const SphKernels& kernels, const std::function<double(double)>& function)
{
  constexpr int parts = 20000;
  double sum = 0.0;
  for (int n = 0; n < parts; ++n) {
    const double r = kernels.support * (n + 0.5) / parts;
    sum += 4.0 * pi * r * r * function(r) * kernels.support / parts;
  }
  return sum;
}

// A box with walls, from 0 to \a size.
SphContestant InBox(SphParameters parameters, double size)
{
  parameters.low.setConstant(-2.5 * parameters.spacingMm);
  parameters.high.setConstant(size + 2.5 * parameters.spacingMm);
  SphContestant fluid(parameters);
  fluid.AddBody([size](const Vector3d& at) { return std::min(at.minCoeff(), (size - at.array()).minCoeff()); }, true);
  return fluid;
}

Vector3d Momentum(const SphContestant& fluid)
{
  Vector3d sum = Vector3d::Zero();
  for (const SphParticle& particle : fluid.Particles())
    sum += fluid.ParticleMass() * particle.velocity;
  return sum;
}

} // namespace

TEST(SphContestant, KernelsAreThoseOfOneFunctionEach)
{
  const SphKernels kernels(1.7);
  EXPECT_NEAR(Integral(kernels, [&](double r) { return kernels.Poly6(r * r); }), 1.0, 1e-6);
  // By parts: of the slope of a kernel times -r / 3, and of the Laplacian of one times r^2 / 6, its own integral is left.
  EXPECT_NEAR(Integral(kernels, [&](double r) { return -r / 3.0 * kernels.SpikySlope(r); }), 1.0, 1e-6);
  EXPECT_NEAR(Integral(kernels, [&](double r) { return r * r / 6.0 * kernels.ViscosityLaplacian(r); }), 1.0, 1e-6);
  for (const double beyond : {1.7000001, 1.8}) {
    EXPECT_EQ(kernels.Poly6(beyond * beyond), 0.0);
    EXPECT_EQ(kernels.SpikySlope(beyond), 0.0);
    EXPECT_EQ(kernels.ViscosityLaplacian(beyond), 0.0);
  }
}

TEST(SphContestant, HydrostaticPressure)
{
  ECHORAMA_SKIP_SANITIZED();
  SphParameters parameters;
  parameters.low = {0.0, 0.0, -2.5};
  parameters.high = {6.0, 6.0, 14.5};
  parameters.periodic = {true, true, false};
  parameters.viscosity = 2.0; // or it would bounce for long
  parameters.soundSpeed = 10.0 * std::sqrt(2.0 * 9810.0 * 12.0);
  SphContestant fluid(parameters);
  fluid.AddBody([](const Vector3d& at) { return at.z(); }, true);
  fluid.Fill([](const Vector3d& at) { return at.z() > 1e-6 && at.z() < 12.2; });
  fluid.Advance(0.2);
  double top = 0.0;
  for (const SphParticle& particle : fluid.Particles())
    top = std::max(top, particle.position.z() + 0.5 * parameters.spacingMm);
  EXPECT_NEAR(top, 12.5, 0.7);
  double slope = 0.0, squares = 0.0;
  int count = 0;
  for (const SphParticle& particle : fluid.Particles()) {
    const double depth = top - particle.position.z(), exact = 9.81 * depth;
    if (particle.position.z() < 2.0 || depth < 5.0) // beside the floor and near the surface kernels are not full
      continue;
    EXPECT_NEAR(fluid.PressureAt(particle.density) / exact, 1.0, 0.1) << depth;
    slope += fluid.PressureAt(particle.density) * exact;
    squares += exact * exact;
    ++count;
  }
  EXPECT_GT(count, 200);
  EXPECT_NEAR(slope / squares, 1.0, 0.03);
}

TEST(SphContestant, ADropKeepsItsMomentum)
{
  SphParameters parameters;
  parameters.gravity.setZero();
  parameters.viscosity = 0.1;
  parameters.high.setConstant(20.0);
  SphContestant fluid(parameters);
  fluid.Fill([](const Vector3d& at) { return (at - Vector3d::Constant(10.0)).norm() < 4.0; });
  Random random(3);
  fluid.SetVelocity([&random](const Vector3d& at) {
    const double part = random.Uniform(-20.0, 20.0);
    return Vector3d(30.0 + part, at.x() - 10.0, -part);
  });
  const Vector3d before = Momentum(fluid);
  double first = 0.0, last = 0.0;
  for (const SphParticle& particle : fluid.Particles())
    first += particle.velocity.squaredNorm();
  EXPECT_GT(fluid.Advance(0.1), 100);
  for (const SphParticle& particle : fluid.Particles())
    last += particle.velocity.squaredNorm();
  EXPECT_LT((Momentum(fluid) - before).norm(), 1e-10 * before.norm());
  EXPECT_LT(last, 0.95 * first); // it did something meanwhile
}

TEST(SphContestant, ViscosityIsThatOfTheLaw)
{
  // A wave of shear without walls decays by its closed form.
  SphParameters parameters;
  parameters.spacingMm = 0.5;
  parameters.viscosity = 1.0;
  parameters.soundSpeed = 100.0;
  parameters.gravity.setZero();
  parameters.high = {3.0, 3.0, 8.0};
  parameters.periodic = {true, true, true};
  SphContestant fluid(parameters);
  fluid.Fill([](const Vector3d&) { return true; });
  const double wave = 2.0 * pi / 8.0, time = 1e-3;
  fluid.SetVelocity([wave](const Vector3d& at) { return Vector3d(10.0 * std::sin(wave * at.z()), 0.0, 0.0); });
  fluid.Advance(time);
  double amplitude = 0.0;
  for (const SphParticle& particle : fluid.Particles())
    amplitude +=
        2.0 * particle.velocity.x() * std::sin(wave * particle.position.z()) / static_cast<double>(fluid.Particles().size());
  const double decay = wave * wave * 1e3 * time; // of 1000 mm^2/s
  EXPECT_NEAR(-std::log(amplitude / 10.0) / decay, 1.0, 0.05);
}

TEST(SphContestant, BodiesHoldAndDrag)
{
  ECHORAMA_SKIP_SANITIZED();
  // Water is thrown about in a closed box.
  SphParameters parameters;
  parameters.soundSpeed = 5000.0;
  SphContestant fluid = InBox(parameters, 12.0);
  fluid.Fill([](const Vector3d& at) { return at.minCoeff() > 1e-6 && at.x() < 6.0 && std::max(at.y(), at.z()) < 12.0 - 1e-6; });
  fluid.SetVelocity([](const Vector3d&) { return Vector3d(400.0, 150.0, -100.0); });
  fluid.Advance(0.05);
  double furthest = 0.0;
  for (const SphParticle& particle : fluid.Particles()) {
    EXPECT_GT(particle.position.minCoeff(), 0.0);
    EXPECT_LT(particle.position.maxCoeff(), 12.0);
    furthest = std::max(furthest, particle.position.x());
  }
  EXPECT_GT(furthest, 10.0);

  // A plate that moves takes along what lies between it and one at rest, evenly.
  SphParameters thick;
  thick.viscosity = 1.0;
  thick.gravity.setZero();
  thick.low = {0.0, 0.0, -2.5};
  thick.high = {6.0, 6.0, 12.5};
  thick.periodic = {true, true, false};
  SphContestant film(thick);
  film.AddBody([](const Vector3d& at) { return at.z(); }, true);
  film.SetBodyVelocity(film.AddBody([](const Vector3d& at) { return 10.0 - at.z(); }, true), {20.0, 0.0, 0.0});
  film.Fill([](const Vector3d& at) { return at.z() > 1e-6 && at.z() < 10.0 - 1e-6; });
  film.Advance(0.2);
  for (const SphParticle& particle : film.Particles())
    EXPECT_NEAR(particle.velocity.x(), 2.0 * particle.position.z(), 0.05 * 20.0);
}

TEST(SphContestant, SettlesBehindAGateAndRunsOutOnASmoothFloor)
{
  SphParameters parameters;
  parameters.soundSpeed = 5000.0;
  parameters.low = {-2.5, 0.0, -2.5};
  parameters.high = {30.0, 6.0, 15.0};
  parameters.periodic = {false, true, false};
  SphContestant fluid(parameters);
  fluid.AddBody([](const Vector3d& at) { return std::min(at.x(), at.z()); }, false);
  const int gate = fluid.AddBody([](const Vector3d& at) { return 6.5 - at.x(); }, false);
  fluid.Fill([](const Vector3d& at) { return std::min(at.x(), at.z()) > 1e-6 && at.x() < 6.5 && at.z() < 10.5; });
  const auto front = [&fluid] {
    double furthest = 0.0;
    for (const SphParticle& particle : fluid.Particles())
      furthest = std::max(furthest, particle.position.x());
    return furthest;
  };
  fluid.Settle(0.02);
  EXPECT_LT(front(), 6.5);
  EXPECT_EQ(fluid.LargestSpeed(), 0.0);
  fluid.RemoveBody(gate);
  fluid.Advance(0.03);
  EXPECT_GT(front(), 12.0);

  // What slides keeps its momentum, and is as thin as before it settled.
  parameters.gravity.setZero();
  parameters.low.x() = 0.0;
  parameters.high.x() = 6.0;
  parameters.periodic[0] = true;
  SphContestant film(parameters);
  film.AddBody([](const Vector3d& at) { return at.z(); }, false);
  film.Fill([](const Vector3d& at) { return at.z() > 1e-6 && at.z() < 6.5; });
  film.Settle(0.01);
  film.SetVelocity([](const Vector3d& at) { return Vector3d(60.0 - 8.0 * at.z(), 0.0, 0.0); });
  const auto shear = [&film] {
    const double mean = Momentum(film).x() / (film.ParticleMass() * static_cast<double>(film.Particles().size()));
    double sum = 0.0;
    for (const SphParticle& particle : film.Particles())
      sum += std::pow(particle.velocity.x() - mean, 2);
    return std::sqrt(sum);
  };
  const double momentum = Momentum(film).x(), before = shear();
  film.Advance(0.02);
  EXPECT_NEAR(Momentum(film).x() / momentum, 1.0, 0.03);
  EXPECT_GT(shear(), 0.8 * before);
}

TEST(SphContestant, StepsAreHalfOfWhatViscosityAllows)
{
  SphParameters parameters;
  parameters.viscosity = 10.0;
  parameters.gravity.setZero();
  parameters.high.setConstant(6.0);
  parameters.periodic = {true, true, true};
  const auto speedAfter = [&](double part) {
    SphContestant fluid(parameters);
    fluid.Fill([](const Vector3d&) { return true; });
    Random random(5);
    fluid.SetVelocity([&random](const Vector3d&) { return Vector3d(random.Uniform(-9.0, 9.0), 0.0, 0.0); });
    const double step = part * fluid.LongestStep();
    for (int n = 0; n < 100; ++n)
      fluid.Step(step);
    return fluid.LargestSpeed();
  };
  EXPECT_LT(speedAfter(1.9), 9.0);
  EXPECT_FALSE(speedAfter(2.4) < 90.0);
}

TEST(SphContestant, SameForAnyNumberOfThreads)
{
  const auto run = [](int threads) {
    ThreadLimit limit(threads);
    SphContestant fluid = InBox(SphParameters(), 12.0);
    fluid.Fill([](const Vector3d& at) { return at.minCoeff() > 1e-6 && at.maxCoeff() < 10.0; });
    fluid.Advance(0.02);
    return fluid.Particles();
  };
  const std::vector<SphParticle> one = run(1), two = run(2);
  ASSERT_EQ(one.size(), two.size());
  for (std::size_t n = 0; n < one.size(); ++n) {
    ASSERT_EQ(one[n].id, two[n].id);
    ASSERT_EQ(one[n].position, two[n].position);
  }
}

TEST(SphContestant, RefusesAPeriodThatIsTooShort)
{
  SphParameters parameters;
  parameters.high.setConstant(5.0);
  parameters.periodic = {true, false, false};
  EXPECT_THROW(SphContestant{parameters}, Error);
}
