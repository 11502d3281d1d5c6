// SPDX-License-Identifier: BSD-3-Clause
// Reliability of phantoms whose shadows are known: voxels whose beam has lost 12 dB or more on its way. The error is 1 less the
// balanced accuracy (the mean of sensitivity and specificity) of "reliability below 0.5". Beside it, on the same beams:
// confidence by random walks (Karamalis et al. 2012, 3D with 6 neighbours, alpha 2, beta 90, gamma 0.05) by Eigen's sparse
// conjugate gradients; its threshold is the best there is for each volume, as its authors give none.
#include "Core/Imaging/Sampling.h"
#include "Core/Imaging/ScanConversion.h"
#include "Core/Imaging/ShadowMap.h"
#include "Filters/Phantoms/Phantom.h"
#include "Testing/Benchmark.h"
#include <algorithm>
#include <cmath>
#include <ctime>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/Sparse>
#include <oneapi/tbb/info.h>

using namespace echorama;

namespace {

// dB that a beam has lost to bodies before it reaches a point of the probe frame, which is that of the world here.
double LossAt(const PhantomParameters& p, const Eigen::Vector3d& point)
{
  const auto at = BeamPointAt(p.probe, point, 1e-3);
  if (!at)
    return 0.0;
  const Eigen::Vector3d along = DirectionOf(p.probe, *at);
  double loss = 0.0;
  for (const Inclusion& body : p.scene.inclusions) {
    const auto* ellipsoid = std::get_if<Ellipsoid>(&body.shape);
    if (!ellipsoid || body.attenuationDbPerMm <= 0.0)
      continue;
    // The chord between here and depth 0, in the unit ball of the body.
    const Eigen::Matrix3d toBall = ellipsoid->radii.cwiseInverse().asDiagonal() * ExpRotation(-ellipsoid->rotation);
    const Eigen::Vector3d a = toBall * (point - ellipsoid->centre), d = toBall * along;
    const double half = a.dot(d) / d.squaredNorm(), root = half * half - (a.squaredNorm() - 1.0) / d.squaredNorm();
    if (root <= 0.0)
      continue;
    const double first = std::max(-at->depth, -half - std::sqrt(root)), last = std::min(0.0, -half + std::sqrt(root));
    loss += body.attenuationDbPerMm * std::max(0.0, last - first);
  }
  return loss;
}

struct Case {
  std::string name;
  PhantomParameters parameters;
  ImageGeometry geometry;
  Volume<unsigned char> intensity, valid, truth;
  PlacedProbe Probe() const { return {parameters.probe, parameters.probeToWorld}; }
};

Case MakeCase(const std::string& name, const PhantomParameters& parameters)
{
  Case made{name, parameters, PhantomGeometry(parameters), {}, {}, {}};
  const auto& n = made.geometry.dimensions;
  made.intensity = made.valid = made.truth = Volume<unsigned char>(n);
  MakePhantom(parameters, made.intensity.View(), made.valid.View());
  const Eigen::Affine3d toWorld = made.geometry.IndexToWorld();
  for (int k = 0; k < n[2] && parameters.shadows; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        made.truth.View()(i, j, k) =
            made.valid.View()(i, j, k) && LossAt(parameters, toWorld * Eigen::Vector3d(i, j, k)) > 12.0 ? 1 : 0;
  return made;
}

struct Quality {
  double error = 0.0, sensitivity = 0.0, falseAlarms = 0.0, precision = 0.0, area = 0.0, bestError = 1.0;
};

// Of calling shadow what is below 0.5, over the real voxels; the area under the curve of all thresholds, and the best of them.
Quality QualityOf(const Case& truth, VolumeView<const float> map)
{
  constexpr int bins = 2000;
  std::vector<double> shadow(bins + 1, 0.0), clear(bins + 1, 0.0);
  for (std::ptrdiff_t i = 0; i < map.Size(); ++i)
    if (truth.valid.View()[i])
      ++(truth.truth.View()[i] ? shadow : clear)[static_cast<std::size_t>(std::clamp(map[i], 0.0f, 1.0f) * bins)];
  double shadows = 0.0, clears = 0.0, hits = 0.0, alarms = 0.0;
  for (int bin = 0; bin <= bins; ++bin) {
    shadows += shadow[static_cast<std::size_t>(bin)];
    clears += clear[static_cast<std::size_t>(bin)];
  }
  Quality quality;
  for (int bin = 0; bin <= bins; ++bin) {
    if (bin == bins / 2) {
      quality.sensitivity = shadows > 0.0 ? hits / shadows : 1.0;
      quality.falseAlarms = alarms / clears;
      quality.precision = hits + alarms > 0.0 ? hits / (hits + alarms) : 1.0;
      quality.error = 0.5 * (1.0 - quality.sensitivity + quality.falseAlarms);
    }
    const double hitsHere = shadow[static_cast<std::size_t>(bin)], alarmsHere = clear[static_cast<std::size_t>(bin)];
    quality.area += shadows > 0.0 ? alarmsHere / clears * (hits + 0.5 * hitsHere) / shadows : 0.0;
    hits += hitsHere;
    alarms += alarmsHere;
    if (shadows > 0.0)
      quality.bestError = std::min(quality.bestError, 0.5 * (1.0 - hits / shadows + alarms / clears));
  }
  return quality;
}

// Random walks from each sample of the beams: the probability to come to the probe before the far end.
Volume<float> RandomWalks(const Case& volume, const std::array<int, 3>& n)
{
  constexpr double alpha = 2.0, beta = 90.0, gamma = 0.05;
  const ProbeGeometry& probe = volume.parameters.probe;
  const Eigen::Affine3d toIndex = volume.geometry.WorldToIndex();
  const Sampler<unsigned char> sampler(volume.intensity.View(), {});
  Volume<float> beams(n);
  for (int s = 0; s < n[2]; ++s)
    for (int f = 0; f < n[1]; ++f)
      for (int d = 0; d < n[0]; ++d) {
        const double depth = d / (n[0] - 1.0);
        const Eigen::Vector3d at = toIndex * PointOf(probe, {probe.depthMin + depth * (probe.depthMax - probe.depthMin),
                                                             f / (n[1] - 1.0) - 0.5, s / (n[2] - 1.0) - 0.5});
        double value = 0.0;
        sampler.Linear(at.x(), at.y(), at.z(), value);
        beams.View()(d, f, s) = static_cast<float>(value / 255.0 * std::exp(-alpha * depth));
      }
  // Unknown are all but the first and the last sample of each beam.
  const int inner = n[0] - 2;
  const auto unknown = [&](int d, int f, int s) { return (s * n[1] + f) * inner + d - 1; };
  const int size = inner * n[1] * n[2];
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd right = Eigen::VectorXd::Zero(size), diagonal = Eigen::VectorXd::Zero(size);
  const auto edge = [&](int d, int f, int s, int e, int g, int t, double penalty) {
    const double w =
        std::exp(-beta * (std::abs(static_cast<double>(beams.View()(d, f, s) - beams.View()(e, g, t))) + penalty)) + 1e-5;
    const bool a = d > 0 && d<n[0] - 1, b = e> 0 && e < n[0] - 1;
    if (a)
      diagonal[unknown(d, f, s)] += w;
    if (b)
      diagonal[unknown(e, g, t)] += w;
    if (a && b) {
      entries.emplace_back(unknown(d, f, s), unknown(e, g, t), -w);
      entries.emplace_back(unknown(e, g, t), unknown(d, f, s), -w);
    } else if (b && d == 0) {
      right[unknown(e, g, t)] += w;
    }
  };
  for (int s = 0; s < n[2]; ++s)
    for (int f = 0; f < n[1]; ++f)
      for (int d = 0; d < n[0]; ++d) {
        if (d + 1 < n[0])
          edge(d, f, s, d + 1, f, s, 0.0);
        if (f + 1 < n[1])
          edge(d, f, s, d, f + 1, s, gamma);
        if (s + 1 < n[2])
          edge(d, f, s, d, f, s + 1, gamma);
      }
  for (int i = 0; i < size; ++i)
    entries.emplace_back(i, i, diagonal[i]);
  Eigen::SparseMatrix<double> matrix(size, size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::IncompleteCholesky<double>> solver;
  solver.setTolerance(1e-6);
  solver.compute(matrix);
  const Eigen::VectorXd probability = solver.solve(right);
  for (int s = 0; s < n[2]; ++s)
    for (int f = 0; f < n[1]; ++f)
      for (int d = 0; d < n[0]; ++d)
        beams.View()(d, f, s) = d == 0 ? 1.0f : d == n[0] - 1 ? 0.0f : static_cast<float>(probability[unknown(d, f, s)]);

  Volume<float> map(volume.geometry.dimensions);
  Volume<unsigned char> inside(volume.geometry.dimensions);
  ScanConvert<float>(beams.View(), probe, volume.parameters.probeToWorld, volume.geometry, map.View(), inside.View());
  return map;
}

void Run(const Case& volume, bool withPeer)
{
  const PosedVolume<unsigned char> posed{volume.intensity.View(), volume.valid.View(), volume.geometry};
  Volume<float> map, peerMap;
  const auto ours = [&] { map = ReliabilityMap(posed, volume.Probe()); };
  const auto peer = [&] { peerMap = RandomWalks(volume, {64, 48, 40}); };
  double seconds = 0.0, peerSeconds = 0.0;
  if (withPeer)
    std::tie(seconds, peerSeconds) = benchmark::Duel(ours, peer, 3);
  else
    seconds = benchmark::MedianSeconds(ours, 3);
  const double voxels = static_cast<double>(map.View().Size());
  // Of all threads together, which other work on the machine does not change much.
  const auto processorSeconds = [](const auto& function) {
    const std::clock_t start = std::clock();
    function();
    return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  };
  const auto report = [&](const char* method, double time, double work, VolumeView<const float> result, bool best, int threads) {
    const Quality q = QualityOf(volume, result);
    benchmark::Report("shadow_map", volume.name, method, time, best ? q.bestError : q.error, "1 - balanced accuracy",
                      {{"sensitivity", q.sensitivity},
                       {"precision", q.precision},
                       {"false_alarms", q.falseAlarms},
                       {"area_under_curve", q.area},
                       {"best_error", q.bestError},
                       {"mvoxels_per_second", voxels * 1e-6 / time},
                       {"processor_seconds", work},
                       {"threads", threads}});
  };
  const double processor = processorSeconds(ours);
  report("echorama", seconds, processor, map.View(), false, tbb::info::default_concurrency());
  if (withPeer) {
    const double peerProcessor = processorSeconds(peer);
    report("random walks 64x48x40, best threshold", peerSeconds, peerProcessor, peerMap.View(), true, 1);
  }
}

} // namespace

int main()
{
  PhantomParameters parameters;
  Run(MakeCase("phantom, one stone", parameters), true);

  // Two more stones at other depths, and a piece of rib.
  const auto add = [&parameters](const Eigen::Vector3d& centre, const Eigen::Vector3d& radii, double loss) {
    parameters.scene.inclusions.push_back({"stone", Ellipsoid{centre, radii, {0.1, 0.3, 0.2}}, 20.0, 0.0, 0.0, loss});
  };
  add({-25, -12, 50}, {4, 5, 3}, 7.0);
  add({-40, 20, 62}, {3, 3, 3}, 5.0);
  add({30, -12, 12}, {5, 14, 3}, 8.0);
  Run(MakeCase("phantom, three stones and a rib", parameters), true);

  parameters.shadows = false;
  Run(MakeCase("phantom without shadows (error: half the false alarms)", parameters), false);

  parameters.shadows = true;
  parameters.spacingMm = 0.5;
  Run(MakeCase("phantom at 0.5 mm", parameters), false);
}
