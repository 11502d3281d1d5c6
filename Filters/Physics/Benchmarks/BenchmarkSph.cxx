// SPDX-License-Identifier: BSD-3-Clause
// Smoothed particle hydrodynamics, which the dissertation tried for gel and gave up (3.3.1), beside our gel on the same cases
// with particles as dense: a column of water that breaks, against experiment; a viscous channel, against the closed form; and the
// longest step at which a sheared flow stays stable, by viscosity. "cpu_seconds" is processor time of all threads together.
//
//   BenchmarkSph --frames FOLDER [--quick]   writes the particles of three scenes instead, for Examples/python/sph_figures.py
#include "Core/Base/NumberText.h"
#include "Core/Base/Random.h"
#include "Filters/Physics/Benchmarks/SphContestant.h"
#include "Filters/Physics/Testing/DamBreak.h"
#include "Filters/Physics/Testing/GelScene.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <fstream>

namespace {

using namespace echorama;
using Eigen::Vector3d;
using testing::DamBreak;
using testing::Wall;

constexpr double gravity = 9810.0;

double CpuSeconds()
{
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

struct Work {
  double begin = CpuSeconds();
  std::int64_t steps = 0, particleSteps = 0;
  double seconds = 0.0; // that were simulated

  nlohmann::ordered_json Told(std::size_t particles) const
  {
    const double used = CpuSeconds() - begin;
    return {{"cpu_seconds", used},
            {"particles", particles},
            {"steps", steps},
            {"mean_step", seconds / static_cast<double>(steps)},
            {"cpu_us_per_particle_step", 1e6 * used / static_cast<double>(particleSteps)}};
  }
};

void Count(Work& work, SphContestant& fluid, double seconds)
{
  const std::int64_t steps = fluid.Advance(seconds);
  work.steps += steps;
  work.particleSteps += steps * static_cast<std::int64_t>(fluid.Particles().size());
  work.seconds += seconds;
}

void Count(Work& work, GelSolver& gel, double seconds, const std::vector<GelCollider>& colliders)
{
  const GelReport report = gel.Advance(seconds, colliders);
  work.steps += report.steps;
  work.particleSteps += report.particleSteps;
  work.seconds += seconds;
}

double Furthest(const std::vector<SphParticle>& particles)
{
  double furthest = 0.0;
  for (const SphParticle& particle : particles)
    furthest = std::max(furthest, particle.position.x());
  return furthest;
}

std::string ParticlesAcross(const char* what, int count)
{
  return what + (", " + std::to_string(count)) + " particles across";
}

void SettleBehindGate(SphContestant& fluid, double place)
{
  const int gate = fluid.AddBody([place](const Vector3d& at) { return place - at.x(); }, false);
  fluid.Settle(0.02);
  fluid.RemoveBody(gate);
}

// Half a millimetre from particle to particle, so that the width of the column tells how finely it is resolved.
void BreakSph(int across)
{
  SphParameters water;
  water.spacingMm = 0.5;
  const double spacing = water.spacingMm, width = (across + 0.5) * spacing; // a half lies between the wall and the first
  water.low = Vector3d::Constant(-2.5 * spacing);
  water.high = {5.0 * width, 0.0, 2.5 * width};
  water.high.y() = water.low.y() + 8.0 * spacing; // as many as ours has
  water.periodic = {false, true, false};
  water.soundSpeed = 10.0 * std::sqrt(2.0 * gravity * 2.0 * width);
  SphContestant fluid(water);
  fluid.AddBody([](const Vector3d& at) { return std::min(at.x(), at.z()); }, false);
  fluid.Fill([&](const Vector3d& at) {
    return std::min(at.x(), at.z()) > 1e-6 && at.x() < width && at.z() < 2.0 * width - 0.25 * spacing;
  });
  SettleBehindGate(fluid, width + 0.5 * spacing);
  DamBreak front;
  Work work;
  const double unit = DamBreak::TimeUnit(width);
  const double seconds = benchmark::Seconds([&] {
    for (double time = 0.05; time < DamBreak::end; time += 0.05) {
      Count(work, fluid, 0.05 * unit);
      front.Pass(time, (Furthest(fluid.Particles()) + 0.5 * spacing) / width);
    }
  });
  nlohmann::ordered_json more = work.Told(fluid.Particles().size());
  more["lead"] = front.Lead();
  benchmark::Report("sph", ParticlesAcross("column of water", across), "SPH", seconds, front.Error(), "1", more);
}

void BreakGel(int across)
{
  const int width = across / 2; // in cells
  GelDomain domain;
  domain.cells = {5 * width + 8, 4, 2 * width + 16};
  domain.periodic = {false, true, false};
  GelMaterial water;
  const double sound = 8.0 * std::sqrt(2.0 * gravity * 2 * width);
  water.bulkModulus = sound * sound * 1e-3;
  water.shearModulus = 1.0;
  water.yieldStress = 0.0;
  water.consistency = 1e-3;
  water.exponent = 1.0;
  GelSolver gel(domain, water);
  gel.Fill([width](const Vector3d& at) { return at.x() > 4 && at.x() < 4 + width && at.z() > 4 && at.z() < 4 + 2 * width; });
  const std::vector<GelCollider> walls{Wall({4, 0, 0}, {1, 0, 0}, false), Wall({0, 0, 4}, {0, 0, 1}, false)};
  DamBreak front;
  Work work;
  const double unit = DamBreak::TimeUnit(width);
  const double seconds = benchmark::Seconds([&] {
    for (double time = 0.05; time < DamBreak::end; time += 0.05) {
      Count(work, gel, 0.05 * unit, walls);
      double furthest = 0.0;
      for (const GelParticle& particle : gel.Particles())
        furthest = std::max(furthest, particle.position[0]);
      front.Pass(time, (furthest + 0.25 - 4.0) / width);
    }
  });
  nlohmann::ordered_json more = work.Told(gel.Particles().size());
  more["lead"] = front.Lead();
  benchmark::Report("sph", ParticlesAcross("column of water", across), "echorama", seconds, front.Error(), "1", more);
}

testing::GelChannel Channel(double viscosity, int cells)
{
  testing::GelChannel channel;
  channel.cells = cells;
  channel.material.yieldStress = 0.0;
  channel.material.exponent = 1.0;
  channel.material.consistency = viscosity;
  channel.material.shearModulus = 12000.0;
  channel.material.bulkModulus = 24000.0;
  return channel;
}

// Fluid between two plates that it sticks to, at z = 0 and \a height.
SphContestant Plates(SphParameters parameters, double height)
{
  const double spacing = parameters.spacingMm;
  parameters.low = Vector3d::Constant(-2.5 * spacing);
  parameters.high = {5.5 * spacing, 5.5 * spacing, height + 2.5 * spacing};
  parameters.periodic = {true, true, false};
  SphContestant fluid(parameters);
  fluid.AddBody([](const Vector3d& at) { return at.z(); }, true);
  fluid.AddBody([height](const Vector3d& at) { return height - at.z(); }, true);
  fluid.Fill([height](const Vector3d& at) { return at.z() > 1e-6 && at.z() < height - 1e-6; });
  return fluid;
}

void Flow(double viscosity, int cells)
{
  const testing::GelChannel channel = Channel(viscosity, cells);
  const double fastest = channel.Exact(0.0);
  // Until a sixtieth is left of what differs from the steady flow.
  const double half = 0.5 * cells, duration = (benchmark::Smoke() ? 0.1 : 1.7) * half * half * 1e-3 / viscosity;
  const std::string name = "channel of " + NumberText(viscosity) + " Pa s, " + std::to_string(2 * cells) + " particles across";

  SphParameters parameters;
  parameters.viscosity = viscosity;
  parameters.spacingMm = 0.5;
  parameters.soundSpeed = 10.0 * fastest;
  parameters.gravity = {channel.Slope() / 1e-3, 0.0, 0.0};
  SphContestant fluid = Plates(parameters, cells);
  Work work;
  double seconds = benchmark::Seconds([&] { Count(work, fluid, duration); }), worst = 0.0;
  for (const SphParticle& particle : fluid.Particles())
    worst = std::max(worst, std::abs(particle.velocity.x() - channel.Exact(particle.position.z() - half)));
  benchmark::Report("sph", name, "SPH", seconds, worst / fastest, "1", work.Told(fluid.Particles().size()));

  GelSolver gel = channel.Make();
  Work ours;
  seconds = benchmark::Seconds([&] { Count(ours, gel, duration, channel.Plates()); });
  worst = 0.0;
  for (const GelParticle& particle : gel.Particles())
    worst = std::max(worst, std::abs(particle.velocity[0] - channel.Exact(particle.position[2] - 4.0 - half)));
  benchmark::Report("sph", name, "echorama", seconds, worst / fastest, "1", ours.Told(gel.Particles().size()));
}

// A flow without walls that begins with a wave of 50 mm/s, 8 mm long, and up to 25 mm/s of disorder. It is stable when it never
// has more kinetic energy than at first, in 300 steps.
constexpr int shearSteps = 300;
constexpr double shearSize = 8.0;

std::function<Vector3d(const Vector3d&)> ShearVelocity()
{
  return [random = Random(1)](const Vector3d& at) mutable {
    const auto part = [&random] { return random.Uniform(-25.0, 25.0); };
    const double wave = 50.0 * std::sin(2.0 * 3.14159265 * at.z() / shearSize), x = part(), y = part();
    return Vector3d(wave + x, y, part());
  };
}

double Energy(const std::vector<SphParticle>& particles)
{
  double sum = 0.0;
  for (const SphParticle& particle : particles)
    sum += particle.velocity.squaredNorm();
  return sum;
}

double Energy(const std::vector<GelParticle>& particles)
{
  double sum = 0.0;
  for (const GelParticle& particle : particles)
    sum += Eigen::Map<const Vector3d>(particle.velocity).squaredNorm();
  return sum;
}

SphContestant ShearSph(double viscosity)
{
  SphParameters parameters;
  parameters.viscosity = viscosity;
  parameters.artificial = 0.0;
  parameters.spacingMm = 0.5;
  parameters.soundSpeed = GelLaw(GelMaterial()).SoundSpeed();
  parameters.gravity.setZero();
  parameters.high = {3.0, 3.0, shearSize};
  parameters.periodic = {true, true, true};
  SphContestant fluid(parameters);
  fluid.Fill([](const Vector3d&) { return true; });
  fluid.SetVelocity(ShearVelocity());
  return fluid;
}

bool IsStable(SphContestant fluid, double step, Work& work)
{
  const double first = Energy(fluid.Particles());
  for (int n = 0; n < (benchmark::Smoke() ? 30 : shearSteps); ++n) {
    fluid.Step(step);
    ++work.steps;
    work.particleSteps += static_cast<std::int64_t>(fluid.Particles().size());
    if (!(Energy(fluid.Particles()) <= first))
      return false;
  }
  return true;
}

// All but the viscosity is that of our default gel.
GelSolver ShearGel(double viscosity)
{
  GelMaterial material;
  material.yieldStress = 0.0;
  material.exponent = 1.0;
  material.consistency = viscosity;
  GelStepping stepping;
  stepping.gravity.setZero();
  GelDomain domain;
  domain.cells = {4, 4, static_cast<int>(shearSize)};
  domain.periodic = {true, true, true};
  GelSolver gel(domain, material, stepping);
  gel.Fill([](const Vector3d&) { return true; });
  gel.SetVelocity(ShearVelocity(), Eigen::Matrix3d::Zero());
  return gel;
}

void LongestSteps(double viscosity)
{
  const std::string name = NumberText(viscosity) + " Pa s";
  // For 10 ml, with particles as far apart as these.
  const auto report = [&](const char* method, double seconds, double step, const Work& work, nlohmann::ordered_json more) {
    const double perStep = (CpuSeconds() - work.begin) / static_cast<double>(work.particleSteps);
    more["viscosity"] = viscosity;
    more["step"] = step;
    more["cpu_hours_per_second"] = 10000.0 / 0.125 * perStep / step / 3600.0;
    benchmark::ReportTime("sph", name, method, seconds, more);
  };

  const SphContestant fluid = ShearSph(viscosity);
  Work work;
  const double rule = fluid.LongestStep();
  double low = 0.1 * rule, high = 10.0 * rule;
  const double seconds = benchmark::Seconds([&] {
    while (high > (benchmark::Smoke() ? 3.0 : 1.03) * low) {
      const double middle = std::sqrt(low * high);
      (IsStable(fluid, middle, work) ? low : high) = middle;
    }
  });
  report("SPH", seconds, low, work, {{"rule", rule}});

  GelSolver gel = ShearGel(viscosity);
  const double first = Energy(gel.Particles());
  bool stable = true;
  Work ours;
  const double oursSeconds = benchmark::Seconds([&] {
    while (ours.steps < (benchmark::Smoke() ? 30 : shearSteps)) {
      Count(ours, gel, 0.002, {});
      stable = stable && Energy(gel.Particles()) <= first;
    }
  });
  if (!stable) // the figure would be no answer
    throw Error(Error::Kind::NotPossible, "our own gel is not stable at " + name);
  report("echorama", oursSeconds, ours.seconds / static_cast<double>(ours.steps), ours, {});
}

// What the default gel resists with, sheared at some rates: viscosities to compare those above with.
void ReportGel()
{
  const GelMaterial gel;
  for (const double rate : {0.1, 1.0, 10.0, 100.0})
    std::cout << nlohmann::ordered_json{{"bench", "sph"},
                                        {"shear_rate", rate},
                                        {"viscosity", (gel.yieldStress + gel.consistency * std::pow(rate, gel.exponent)) / rate}}
                     .dump()
              << std::endl;
}

// ---- frames ----

void Write(const std::string& path, const SphContestant& fluid, int firstShown)
{
  std::ofstream file(path);
  file << "x,y,z,speed,body\n";
  for (const SphParticle& particle : fluid.Particles())
    file << particle.position.x() << ',' << particle.position.y() << ',' << particle.position.z() << ','
         << particle.velocity.norm() << ",-1\n";
  for (const SphBoundaryParticle& particle : fluid.Boundary())
    if (particle.body >= firstShown)
      file << particle.position.x() << ',' << particle.position.y() << ',' << particle.position.z() << ",0," << particle.body
           << '\n';
  if (!file.flush())
    throw Error(Error::Kind::FileSystem, path + " cannot be written");
}

// A tank open above, from 0 to \a size: body 0, which is not shown.
SphContestant Tank(SphParameters parameters, const Vector3d& size, bool stick)
{
  parameters.low = Vector3d::Constant(-2.5 * parameters.spacingMm);
  parameters.high = size.array() + 2.5 * parameters.spacingMm;
  SphContestant fluid(parameters);
  fluid.AddBody(
      [size](const Vector3d& at) {
        return std::min({at.x(), size.x() - at.x(), at.y(), size.y() - at.y(), at.z()});
      },
      stick);
  return fluid;
}

void Frames(const std::string& path, SphContestant& fluid, const std::vector<double>& times)
{
  double now = 0.0;
  for (std::size_t n = 0; n < times.size(); ++n) {
    fluid.Advance(times[n] - now);
    now = times[n];
    Write(path + "_" + std::to_string(n + 1) + ".csv", fluid, 1);
    std::cout << path << '_' << n + 1 << ".csv: " << now << " s\n";
  }
}

std::function<bool(const Vector3d&)> Box(const Vector3d& low, const Vector3d& high)
{
  return [low, high](const Vector3d& at) { return (at.array() > low.array()).all() && (at.array() < high.array()).all(); };
}

// The head of a small convex probe that looks down, the middle of its face at \a face.
std::function<double(const Vector3d&)> Head(const Vector3d& face)
{
  const auto shape =
      std::make_shared<const ProbeShape>(ProbeGeometry::Convex(1.0, 30.0, 0.5, 20.0, 0.0, 60.0), ProbeHead{4.0, 4.0, 60.0});
  return [shape, face](const Vector3d& at) {
    const Vector3d from = at - face;
    return shape->Distance({from.x(), -from.y(), -from.z()});
  };
}

double Rounded(const Vector3d& at, const Vector3d& middle, const Vector3d& half, double edge)
{
  const Eigen::Array3d over = (at - middle).array().abs() - half.array() + edge;
  return over.max(0.0).matrix().norm() + std::min(over.maxCoeff(), 0.0) - edge;
}

void WriteScenes(const std::string& folder, bool quick)
{
  const double coarser = quick ? 2.5 : 1.0;
  {
    SphParameters water;
    water.spacingMm = 1.0 * coarser;
    water.artificial = 0.08;
    water.soundSpeed = 10.0 * std::sqrt(2.0 * gravity * 36.0);
    SphContestant fluid = Tank(water, {72.0, 24.0, 50.0}, false);
    fluid.Fill(Box(Vector3d::Constant(1e-6), {24.0 - 1e-6, 24.0 - 1e-6, 36.0}));
    SettleBehindGate(fluid, 24.0);
    Frames(folder + "/block", fluid, {0.06, 0.12, 0.24});
  }
  {
    SphParameters water;
    water.spacingMm = 1.25 * coarser;
    water.artificial = 0.08;
    water.soundSpeed = 10.0 * std::sqrt(2.0 * gravity * 45.0);
    SphContestant fluid = Tank(water, {110.0, 50.0, 60.0}, false);
    fluid.AddBody([](const Vector3d& at) { return Rounded(at, {70.0, 25.0, 2.0}, {28.0, 16.0, 10.0}, 5.0); }, true);
    fluid.AddBody(Head({70.0, 25.0, 18.0}), true);
    fluid.Fill(Box(Vector3d::Constant(1e-6), {25.0 - 1e-6, 50.0 - 1e-6, 45.0}));
    SettleBehindGate(fluid, 25.0);
    Frames(folder + "/bodies", fluid, {0.08, 0.14, 0.26});
  }
  {
    SphParameters gel;
    gel.spacingMm = 1.25 * coarser;
    gel.viscosity = 20.0;
    gel.soundSpeed = 1e4; // so that it does not yield to the pressure under the probe; viscosity limits the step far below
    SphContestant fluid = Tank(gel, {90.0, 60.0, 60.0}, true);
    const Vector3d middle(45.0, 30.0, 0.0);
    fluid.AddBody([&](const Vector3d& at) { return at.z() - 6.0; }, true);
    const double from = 26.0, to = 11.0, speed = 40.0;
    const auto head = Head(middle + Vector3d(0.0, 0.0, from));
    const int probe = fluid.AddBody(head, true);
    fluid.Fill([&](const Vector3d& at) {
      return at.z() > 6.0 + 1e-6 && head(at) > 1e-6 &&
             Rounded(at, middle + Vector3d(0.0, 0.0, 14.0), {20.0, 12.0, 7.3}, 5.0) < 0.0;
    });
    fluid.SetBodyVelocity(probe, {0.0, 0.0, -speed});
    Frames(folder + "/gel", fluid, {0.0, 0.5 * (from - to) / speed, (from - to) / speed});
  }
}

} // namespace

int main(int argc, char** argv)
{
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (!words.empty()) {
    if (words[0] != "--frames" || words.size() < 2 || words.size() > 3 || (words.size() == 3 && words[2] != "--quick")) {
      std::cerr << "usage: BenchmarkSph [--frames FOLDER [--quick]]\n";
      return 2;
    }
    WriteScenes(words[1], words.size() == 3);
    return 0;
  }
  ReportGel();
  for (const double viscosity : {1.0, 10.0})
    Flow(viscosity, benchmark::Smoke() ? 4 : 12);
  for (const double viscosity : {1e-3, 1e-2, 0.1, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0})
    LongestSteps(viscosity);
  for (const int across : {16, 24}) {
    BreakSph(across);
    BreakGel(across);
  }
  return 0;
}
