// SPDX-License-Identifier: BSD-3-Clause
// Particle-steps per second of processor time (all threads together), so that other programs on the machine count little: gel
// that is pressed and sheared under a moving plate; and the flow of gel through a channel, with its largest error, in parts of
// the largest speed.
#include "Filters/Physics/Testing/GelScene.h"
#include "Testing/Benchmark.h"
#include <cmath>

namespace {

using namespace echorama;
using testing::Wall;

double CpuSeconds()
{
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

nlohmann::ordered_json RateOf(const GelReport& report, double seconds)
{
  return {{"million_particle_steps_per_cpu_second", 1e-6 * static_cast<double>(report.particleSteps) / seconds},
          {"steps", report.steps}};
}

void Press(int cells)
{
  GelDomain domain;
  domain.cells = {cells + 16, cells + 16, cells / 2 + 16};
  GelSolver solver(domain, GelMaterial());
  const double high = 0.5 * cells;
  solver.Fill([cells, high](const Eigen::Vector3d& at) {
    return at.x() > 8 && at.y() > 8 && at.z() > 4 && at.x() < 8 + cells && at.y() < 8 + cells && at.z() < 4 + high;
  });
  GelCollider plate = Wall({0, 0, 5 + high}, {0, 0, -1}, true);
  plate.end.translation() += Eigen::Vector3d(1, 0, -2);
  const double start = CpuSeconds();
  const GelReport report = solver.Advance(benchmark::Smoke() ? 0.001 : 0.02, {Wall({0, 0, 4}, {0, 0, 1}, true), plate});
  const double seconds = CpuSeconds() - start;
  nlohmann::ordered_json more = RateOf(report, seconds);
  more["particles"] = solver.Particles().size();
  benchmark::ReportTime("gel", "pressed, " + std::to_string(solver.Particles().size()) + " particles", "echorama", seconds, more);
}

void Flow(int cells)
{
  testing::GelChannel channel;
  channel.cells = cells;
  channel.material.yieldStress = 40.0;
  channel.material.shearModulus = 2500.0;
  channel.material.bulkModulus = 50000.0;
  GelSolver solver = channel.Make();
  const double start = CpuSeconds();
  const GelReport report = solver.Advance(benchmark::Smoke() ? 0.001 : 0.12, channel.Plates());
  const double seconds = CpuSeconds() - start;
  double worst = 0.0;
  for (const GelParticle& particle : solver.Particles())
    worst = std::max(worst, std::abs(particle.velocity[0] - channel.Exact(particle.position[2] - 4.0 - 0.5 * cells)));
  benchmark::Report("gel", "channel of " + std::to_string(cells) + " cells", "echorama", seconds, worst / channel.Exact(0.0), "1",
                    RateOf(report, seconds));
}

} // namespace

int main()
{
  for (const int cells : {16, 24, 32})
    Flow(cells);
  for (const int cells : {24, 48})
    Press(cells);
}
