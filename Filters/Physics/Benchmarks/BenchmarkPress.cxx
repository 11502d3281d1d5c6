// SPDX-License-Identifier: BSD-3-Clause
// A block of nearly incompressible tissue, pressed by 10 mm with a curved probe: time, steps, and how far the displacements are
// from the same problem solved to a thousandth of the tolerance ("error"), on lattices of 10^4 nodes and more.
#include "Filters/Physics/TissuePress.h"
#include "Testing/Benchmark.h"
#include <ctime>

namespace {

using namespace echorama;

struct Run {
  std::vector<Eigen::Vector3d> displacements;
  TissueWork work, finest;
  double cpuSeconds = 0.0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
};

Run Press(const std::array<int, 3>& nodes, double poisson, double toleranceMm, double boneKPa)
{
  TissueBody body;
  body.nodes.dimensions = nodes;
  const Eigen::Vector3d size(126.0, 126.0, 78.0);
  for (int axis = 0; axis < 3; ++axis)
    body.nodes.spacing[axis] = size[axis] / (nodes[static_cast<std::size_t>(axis)] - 1);
  body.materials = {{20.0, poisson, 1.0, false}, {boneKPa, 0.3, 1.8, false}};
  for (int k = 0; k + 1 < nodes[2]; ++k)
    for (int j = 0; j + 1 < nodes[1]; ++j)
      for (int i = 0; i + 1 < nodes[0]; ++i) {
        const Eigen::Vector3d at = body.nodes.spacing.cwiseProduct(Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5));
        const bool isRib = boneKPa > 0.0 && std::abs(at.z() - 40.0) < 5.0 && std::fmod(at.y(), 30.0) < 10.0;
        body.cells.push_back(isRib ? 1 : 0);
      }
  body.materials[1].youngKPa = std::max(boneKPa, 1.0);
  TissuePressParameters parameters;
  parameters.toleranceMm = toleranceMm;
  const auto probe = std::make_shared<const ProbeShape>(ProbeGeometry::Convex(1.2, 40.0, 0.6, 30.0, 0.0, 100.0));
  Run run;
  const std::clock_t start = std::clock();
  TissuePress press(body, parameters);
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(63.0, 63.0, 10.0);
  press.Move(probe, pose);
  run.cpuSeconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  run.displacements = press.Displacements();
  run.work = press.Work();
  run.finest = press.FinestWork();
  run.force = press.Force();
  return run;
}

} // namespace

int main()
{
  using namespace echorama::benchmark;
  struct Case {
    const char* name;
    std::array<int, 3> nodes;
    double poisson, boneKPa;
  };
  const Case cases[] = {{"32x32x20", {32, 32, 20}, 0.49, 0.0},
                        {"64x64x40", {64, 64, 40}, 0.49, 0.0},
                        {"64x64x40, nu 0.45", {64, 64, 40}, 0.45, 0.0},
                        {"64x64x40, ribs of 10^4 times the modulus", {64, 64, 40}, 0.49, 2e5},
                        {"120x120x70", {120, 120, 70}, 0.49, 0.0}};
  for (const Case& entry : cases) {
    Run run;
    const double seconds = Seconds([&] { run = Press(entry.nodes, entry.poisson, 0.01, entry.boneKPa); });
    const bool isLarge = entry.nodes[0] > 64;
    double worst = 0.0;
    if (!isLarge) {
      const Run exact = Press(entry.nodes, entry.poisson, 1e-5, entry.boneKPa);
      for (std::size_t n = 0; n < run.displacements.size(); ++n)
        worst = std::max(worst, (run.displacements[n] - exact.displacements[n]).norm());
    }
    const double count = static_cast<double>(run.displacements.size());
    const nlohmann::ordered_json more{{"cpu_seconds", run.cpuSeconds},
                                      {"cpu_us_per_node", 1e6 * run.cpuSeconds / count},
                                      {"load_steps", run.work.loadSteps},
                                      {"newton_steps", run.work.newtonSteps},
                                      {"linear_steps", run.work.linearSteps},
                                      {"newton_steps_finest", run.finest.newtonSteps},
                                      {"linear_steps_finest", run.finest.linearSteps},
                                      {"force_n", run.force.norm()}};
    if (isLarge)
      ReportTime("press", entry.name, "echorama", seconds, more);
    else
      Report("press", entry.name, "echorama", seconds, worst, "mm", more);
  }
}
