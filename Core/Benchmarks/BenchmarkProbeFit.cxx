// SPDX-License-Identifier: BSD-3-Clause
// Fits to masks of known fans: time and error against the number of points of the outline, the size of the mask, the shape of
// the probe and what is wrong with the mask. The error is the greatest distance (mm) between the same places of the true fan and
// the fitted one: corners, edges and middles. "voxel_mm" is the scale to judge it by.
#include "Core/Base/Angles.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Geometry/ProbeFit.h"
#include "Testing/Benchmark.h"
#include <algorithm>
#include <cmath>
#include <ctime>
#include <tbb/info.h>

namespace {

using namespace echorama;

constexpr double degree = RadiansPerDegree;

struct Case {
  ProbeGeometry probe;
  Pose pose = Pose::Identity();
  ImageGeometry grid;
  Volume<unsigned char> mask;
};

// A cube of voxels (or a square of pixels) around the fan, turned against it.
Case CaseOf(const ProbeGeometry& probe, int size, bool damaged = false)
{
  Case c;
  c.probe = probe;
  const bool plane = probe.IsPlane();
  c.pose.linear() = plane ? Eigen::Matrix3d(Eigen::Vector3d(std::cos(0.3), std::sin(0.3), 0.0) * Eigen::RowVector3d(1, 0, 0) -
                                            Eigen::Vector3d(0, 0, 1) * Eigen::RowVector3d(0, 1, 0) +
                                            Eigen::Vector3d(-std::sin(0.3), std::cos(0.3), 0.0) * Eigen::RowVector3d(0, 0, 1))
                          : ExpRotation(Eigen::Vector3d(0.4, -0.3, 0.8));
  Eigen::AlignedBox3d box;
  for (double fan = -0.5; fan <= 0.5; fan += 0.1)
    for (double sweep = -0.5; sweep <= 0.5; sweep += 0.1)
      for (const double depth : {probe.depthMin, probe.depthMax})
        box.extend(c.pose * PointOf(probe, {depth, fan, sweep}));
  const double voxel = 1.05 * box.sizes().maxCoeff() / size;
  c.grid.dimensions = {size, size, plane ? 1 : size};
  c.grid.spacing.setConstant(voxel);
  c.grid.origin = box.center() - 0.5 * voxel * Eigen::Vector3d(size - 1, size - 1, plane ? 0 : size - 1);
  c.mask = Volume<unsigned char>(c.grid.dimensions);
  const Eigen::Affine3d toProbe = c.pose.inverse() * c.grid.IndexToWorld();
  ParallelFor(static_cast<std::ptrdiff_t>(size) * c.grid.dimensions[2], [&](std::ptrdiff_t row) {
    const int j = static_cast<int>(row % size), k = static_cast<int>(row / size);
    Random random(7, static_cast<std::uint64_t>(row));
    for (int i = 0; i < size; ++i) {
      const auto beam = BeamPointAt(probe, toProbe * Eigen::Vector3d(i, j, k), 1e-6);
      bool valid = beam.has_value();
      if (valid && damaged) {
        // Speckle that dropped out, mostly at the rim, and a fifth of the far end gone.
        const double deep = (beam->depth - probe.depthMin) / (probe.depthMax - probe.depthMin);
        const double rim = std::max({std::abs(beam->fan), std::abs(beam->sweep), deep - 0.5});
        valid = random.Uniform() >= (rim > 0.46 ? 0.35 : 0.04) && deep + beam->fan + 0.8 * beam->sweep <= 1.15;
      }
      c.mask.View()(i, j, k) = valid ? 1 : 0;
    }
  });
  return c;
}

double FarthestApart(const Case& c, const ProbeFit& fit)
{
  const double side = c.pose.linear().col(0).dot(fit.probeToWorld.linear().col(0)) < 0.0 ? -1.0 : 1.0;
  double farthest = 0.0;
  for (const double depth : {0.0, 0.5, 1.0})
    for (const double fan : {-0.5, 0.0, 0.5})
      for (const double sweep : {-0.5, 0.0, 0.5}) {
        const auto at = [&](const ProbeGeometry& g, double sign) {
          return PointOf(g, {g.depthMin + depth * (g.depthMax - g.depthMin), sign * fan, sign * sweep});
        };
        farthest = std::max(farthest, (c.pose * at(c.probe, 1.0) - fit.probeToWorld * at(fit.geometry, side)).norm());
      }
  return farthest;
}

void Run(const std::string& name, const Case& c, int points = ProbeFitParameters().outlinePoints)
{
  ProbeFitParameters parameters;
  parameters.outlinePoints = points;
  ProbeFit fit;
  constexpr int runs = 3;
  const std::clock_t start = std::clock();
  const double seconds = benchmark::MedianSeconds([&] { fit = FitProbe(c.mask.View(), c.grid, parameters); }, runs);
  const double processor = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC / (runs + 1);
  benchmark::Report("probe_fit", name, "echorama", seconds, FarthestApart(c, fit), "mm",
                    {{"processor_seconds", processor}, // of all threads together: what a busy machine does not blur
                     {"voxel_mm", c.grid.spacing.x()},
                     {"fan_error_degrees", std::abs(fit.geometry.fanAngle - c.probe.fanAngle) / degree},
                     {"sweep_error_degrees", std::abs(fit.geometry.sweepAngle - c.probe.sweepAngle) / degree},
                     {"residual_mm", fit.residualMm},
                     {"overlap", fit.overlap},
                     {"points", points},
                     {"threads", tbb::info::default_concurrency()}});
}

} // namespace

int main()
{
  const ProbeGeometry convex = ProbeGeometry::Convex(65 * degree, 40, 60 * degree, 30, 2, 120);
  const Case whole = CaseOf(convex, 256), damaged = CaseOf(convex, 256, true);
  for (const int points : {500, 1000, 2000, 4000, 8000, 16000}) {
    Run("convex 256^3, " + std::to_string(points) + " points", whole, points);
    Run("convex 256^3, damaged, " + std::to_string(points) + " points", damaged, points);
  }
  for (const int size : {48, 64, 96, 128, 192})
    Run("convex " + std::to_string(size) + "^3", CaseOf(convex, size));
  Run("convex, small sweep radius 128^3", CaseOf(ProbeGeometry::Convex(60 * degree, 60, 70 * degree, 10, 2, 120), 128));
  Run("mechanical, as a Kretz phantom 128^3", CaseOf(ProbeGeometry::Convex(34 * degree, 24.67, 39.8 * degree, 18, 0, 43.1), 128));
  Run("endocavity 128^3", CaseOf(ProbeGeometry::Convex(150 * degree, 10, 90 * degree, 6, 2, 70), 128));
  Run("phased 128^3", CaseOf(ProbeGeometry::Phased(80 * degree, 50 * degree, 0, 150), 128));
  const ProbeGeometry sector = ProbeGeometry::Convex(65 * degree, 60, 0, 0, 2, 150);
  Run("convex sector 800^2", CaseOf(sector, 800));
  Run("convex sector 800^2, damaged", CaseOf(sector, 800, true));
  Run("phased sector 800^2", CaseOf(ProbeGeometry::Phased(90 * degree, 0, 0, 160), 800));
}
