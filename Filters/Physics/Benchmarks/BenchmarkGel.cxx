// SPDX-License-Identifier: BSD-3-Clause
// Particle-steps per second, on one thread and on two: gel that is pressed and sheared under a moving plate, with the change of
// its volume; and the flow of gel through a channel, with its largest error, in parts of the largest speed. And gel of a
// centimetre's height that a probe drags over skin for three seconds.
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include "Filters/Physics/GelMotion.h"
#include "Filters/Physics/Testing/GelScene.h"
#include "Testing/Benchmark.h"
#include <cmath>

namespace {

using namespace echorama;
using testing::Wall;

nlohmann::ordered_json RateOf(const GelReport& report, double seconds)
{
  return {{"million_particle_steps_per_second", 1e-6 * static_cast<double>(report.particleSteps) / seconds},
          {"steps", report.steps}};
}

std::string Threads(int threads)
{
  return threads == 1 ? ", one thread" : ", two threads";
}

void Press(int cells, int threads)
{
  const ThreadLimit limit(threads);
  GelDomain domain;
  domain.cells = {cells + 16, cells + 16, cells / 2 + 16};
  GelSolver solver(domain, GelMaterial());
  const double high = 0.5 * cells;
  solver.Fill([cells, high](const Eigen::Vector3d& at) {
    return at.x() > 8 && at.y() > 8 && at.z() > 4 && at.x() < 8 + cells && at.y() < 8 + cells && at.z() < 4 + high;
  });
  GelCollider plate = Wall({0, 0, 5 + high}, {0, 0, -1}, true);
  plate.end.translation() += Eigen::Vector3d(1, 0, -2);
  GelReport report;
  const double seconds = benchmark::Seconds([&] {
    report = solver.Advance(benchmark::Smoke() ? 0.001 : 0.02, {Wall({0, 0, 4}, {0, 0, 1}, true), plate});
  });
  nlohmann::ordered_json more = RateOf(report, seconds);
  more["particles"] = solver.Particles().size();
  const GelTotals totals = solver.Totals();
  benchmark::Report("gel", "pressed, " + std::to_string(solver.Particles().size()) + " particles" + Threads(threads), "echorama",
                    seconds, std::abs(totals.volume / totals.restVolume - 1.0), "1", more);
}

void Flow(int cells, int threads)
{
  const ThreadLimit limit(threads);
  testing::GelChannel channel;
  channel.cells = cells;
  channel.material.yieldStress = 40.0;
  channel.material.shearModulus = 2500.0;
  channel.material.bulkModulus = 50000.0;
  GelSolver solver = channel.Make();
  GelReport report;
  const double seconds =
      benchmark::Seconds([&] { report = solver.Advance(benchmark::Smoke() ? 0.001 : 0.12, channel.Plates()); });
  double worst = 0.0;
  for (const GelParticle& particle : solver.Particles())
    worst = std::max(worst, std::abs(particle.velocity[0] - channel.Exact(particle.position[2] - 4.0 - 0.5 * cells)));
  benchmark::Report("gel", "channel of " + std::to_string(cells) + " cells" + Threads(threads), "echorama", seconds,
                    worst / channel.Exact(0.0), "1", RateOf(report, seconds));
}

// A face of 40 mm by 12 mm with 6 ml in a cap that is 1 cm high; it comes down to 5 mm above the skin and slides on along it.
void Drag()
{
  const auto at = [](double x) {
    Pose pose = Pose::Identity();
    pose.translation() = Eigen::Vector3d(x, 0.0, -5.0);
    return pose;
  };
  GelCoatParameters coat;
  coat.amountMl = 4.0;
  GelMotion motion(testing::SkinBlock(0.0), {ProbeGeometry::Linear(40.0, 12.0, 0.0, 80.0), at(-45.0)}, {}, {}, coat);
  motion.Move(at(-45.0), 0.0);
  const GelCoat before = motion.Look(false);
  const double simulated = benchmark::Smoke() ? 0.01 : 3.0;
  const double seconds = benchmark::Seconds([&] { motion.Move(at(45.0), simulated); });
  const GelCoat after = motion.Look(false);
  benchmark::Report("gel", "dragged for " + NumberText(simulated) + " s", "echorama", seconds,
                    std::abs(after.volumeMm3 / after.leftMm3 - 1.0), "1",
                    {{"steps", after.report.steps - before.report.steps},
                     {"put_on_mm3", after.putOnMm3},
                     {"gone_mm3", after.goneMm3},
                     {"coupled", after.coupled}});
}

} // namespace

int main()
{
  for (const int threads : {1, 2}) {
    for (const int cells : {24, 32})
      Flow(cells, threads);
    for (const int cells : {24, 48})
      Press(cells, threads);
  }
  Drag();
}
