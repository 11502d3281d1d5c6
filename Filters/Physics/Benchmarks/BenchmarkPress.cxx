// SPDX-License-Identifier: BSD-3-Clause
// A block of nearly incompressible tissue, pressed by 10 mm with a curved probe: time, steps, and how far the displacements are
// from the same problem solved to a thousandth of the tolerance ("error"), on lattices of 10^4 nodes and more; then the tissue
// given way little by little, as along a motion, and a block under its weight beside CalculiX, where it is installed: there the
// error is how far one is from the other, in percent of the longest displacement.
#include "CalculixPeer.h"
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

TissueBody Block(const std::array<int, 3>& nodes, double poisson, double boneKPa)
{
  TissueBody body;
  body.nodes.dimensions = nodes;
  const Eigen::Vector3d size(126.0, 126.0, 78.0);
  for (int axis = 0; axis < 3; ++axis)
    body.nodes.spacing[axis] = size[axis] / (nodes[static_cast<std::size_t>(axis)] - 1);
  body.materials = {{20.0, poisson, 1.0, false}, {std::max(boneKPa, 1.0), 0.3, 1.8, false}};
  for (int k = 0; k + 1 < nodes[2]; ++k)
    for (int j = 0; j + 1 < nodes[1]; ++j)
      for (int i = 0; i + 1 < nodes[0]; ++i) {
        const Eigen::Vector3d at = body.nodes.spacing.cwiseProduct(Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5));
        const bool isRib = boneKPa > 0.0 && std::abs(at.z() - 40.0) < 5.0 && std::fmod(at.y(), 30.0) < 10.0;
        body.cells.push_back(isRib ? 1 : 0);
      }
  return body;
}

std::shared_ptr<const ProbeShape> Probe(double edgeMm = ProbeHead().edgeMm)
{
  ProbeHead head;
  head.edgeMm = edgeMm;
  head.marginMm = std::max(head.marginMm, edgeMm);
  return std::make_shared<const ProbeShape>(ProbeGeometry::Convex(1.2, 40.0, 0.6, 30.0, 0.0, 100.0), head);
}

Pose At(double x, double z)
{
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(x, 63.0, z);
  return pose;
}

double CpuNow()
{
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

Run Press(const std::array<int, 3>& nodes, double poisson, double toleranceMm, double boneKPa, double edgeMm)
{
  const TissueBody body = Block(nodes, poisson, boneKPa);
  TissuePressParameters parameters;
  parameters.toleranceMm = toleranceMm;
  Run run;
  const double start = CpuNow();
  TissuePress press(body, parameters);
  press.Move(Probe(edgeMm), At(63.0, 10.0));
  run.cpuSeconds = CpuNow() - start;
  run.displacements = press.Displacements();
  run.work = press.Work();
  run.finest = press.FinestWork();
  run.force = press.Force();
  return run;
}

// Down by 8 mm in moves of half a millimetre, then 10 mm along the skin.
void MoveOn()
{
  using namespace echorama::benchmark;
  TissuePress press(Block({32, 32, 20}, 0.49, 0.0), {});
  const auto probe = Probe();
  for (const bool isSlide : {false, true}) {
    const int moves = isSlide ? 20 : 16;
    const TissueWork before = press.FinestWork();
    const double cpu = CpuNow(), seconds = Seconds([&] {
                                   for (int n = 1; n <= moves; ++n)
                                     press.Move(probe, isSlide ? At(53.0 + 0.5 * n, 8.0) : At(53.0, 0.5 * n));
                                 });
    ReportTime("press", isSlide ? "32x32x20, a move of 0.5 mm along the skin" : "32x32x20, a move of 0.5 mm into the tissue",
               "echorama", seconds / moves,
               {{"cpu_seconds", (CpuNow() - cpu) / moves},
                {"newton_steps_finest", static_cast<double>(press.FinestWork().newtonSteps - before.newtonSteps) / moves},
                {"linear_steps_finest", static_cast<double>(press.FinestWork().linearSteps - before.linearSteps) / moves}});
  }
}

void BesideCalculix()
{
  using namespace echorama::benchmark;
  const TissueBody body = Block({32, 32, 20}, 0.45, 200.0);
  TissuePressParameters parameters;
  parameters.gravity = Eigen::Vector3d(0.02, 0.05, 0.03); // so little that the block stays linear
  parameters.toleranceMm = 1e-4;
  std::vector<Eigen::Vector3d> displacements;
  const double seconds = Seconds([&] { displacements = TissuePress(body, parameters).Displacements(); });
  const auto peer = HasCalculix() ? SolveWithCalculix(body, parameters.gravity, {}) : std::nullopt;
  if (!peer) {
    std::cerr << "CalculiX (ccx) is not installed, or failed: no peer\n";
    return;
  }
  double longest = 0.0, worst = 0.0;
  for (std::size_t n = 0; n < displacements.size(); ++n) {
    longest = std::max(longest, peer->displacements[n].norm());
    worst = std::max(worst, (peer->displacements[n] - displacements[n]).norm());
  }
  const std::string name = "32x32x20 under its weight, nu 0.45, ribs of 10 times the modulus";
  Report("press", name, "echorama", seconds, 100.0 * worst / longest, "% of the longest displacement", {{"longest_mm", longest}});
  ReportTime("press", name, "calculix", peer->seconds);
}

} // namespace

int main()
{
  using namespace echorama::benchmark;
  struct Case {
    const char* name;
    std::array<int, 3> nodes;
    double poisson, boneKPa;
    double edgeMm = ProbeHead().edgeMm;
  };
  // An edge as narrow as a cell, which takes more steps, and one of one and a half.
  const Case cases[] = {{"32x32x20", {32, 32, 20}, 0.49, 0.0},
                        {"32x32x20, edges of 6 mm", {32, 32, 20}, 0.49, 0.0, 6.0},
                        {"64x64x40", {64, 64, 40}, 0.49, 0.0},
                        {"64x64x40, nu 0.45", {64, 64, 40}, 0.45, 0.0},
                        {"64x64x40, ribs of 10^4 times the modulus", {64, 64, 40}, 0.49, 2e5},
                        {"120x120x70", {120, 120, 70}, 0.49, 0.0}};
  for (const Case& entry : cases) {
    Run run;
    const double seconds = Seconds([&] { run = Press(entry.nodes, entry.poisson, 0.01, entry.boneKPa, entry.edgeMm); });
    const bool isLarge = entry.nodes[0] > 64;
    double worst = 0.0;
    if (!isLarge) {
      const Run exact = Press(entry.nodes, entry.poisson, 1e-5, entry.boneKPa, entry.edgeMm);
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
  MoveOn();
  BesideCalculix();
}
