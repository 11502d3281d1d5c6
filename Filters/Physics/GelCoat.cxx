// SPDX-License-Identifier: BSD-3-Clause
// A particle counts for the points around it with the spline that it had in the solver; a point lies in gel where they fill three
// tenths of what solids leave free there, so that a thin film counts as much as a thick one, cracks between particles are
// no air, and gel reaches a little way into the solids that it touches.
#include "GelCoat.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

using Eigen::Vector3d;

constexpr int gelBeams = 48;

// All points of a grid of half a cell that particles reach, and one more on all sides.
ImageGeometry GridAround(const GelSolver& solver, const Pose& headToFrame)
{
  Eigen::AlignedBox3d box(headToFrame.translation());
  for (const GelParticle& particle : solver.Particles())
    box.extend(Eigen::Map<const Vector3d>(particle.position));
  const double cell = solver.Domain().cellMm;
  ImageGeometry grid;
  grid.spacing.setConstant(0.5 * cell);
  grid.origin = ((box.min().array() / cell).floor() - 2.0) * cell;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int n = static_cast<int>(axis);
    grid.dimensions[axis] = static_cast<int>(std::lround((box.max()[n] - grid.origin[n]) / (0.5 * cell))) + 5;
  }
  return grid;
}

// The part of a quadratic B-spline, in cells, below x.
double SplineBelow(double x)
{
  const double a = std::abs(x);
  const double above = a >= 1.5 ? 0.0 : a >= 0.5 ? std::pow(1.5 - a, 3) / 6.0 : 0.5 - 0.75 * a + a * a * a / 3.0;
  return x > 0.0 ? 1.0 - above : above;
}

double Spline(double x)
{
  const double a = std::abs(x);
  return a >= 1.5 ? 0.0 : a >= 0.5 ? 0.5 * (1.5 - a) * (1.5 - a) : 0.75 - a * a;
}

// How much of every cell around a point particles fill.
std::vector<float> FilledOn(const ImageGeometry& grid, const GelSolver& solver)
{
  const double cell = solver.Domain().cellMm, perCell = 1.0 / (cell * cell * cell);
  std::vector<float> filled(grid.VoxelCount(), 0.0f);
  const auto rows = static_cast<std::size_t>(grid.dimensions[1]), row = static_cast<std::size_t>(grid.dimensions[0]);
  for (const GelParticle& particle : solver.Particles()) {
    std::array<int, 3> low{}, high{};
    std::array<std::array<double, 8>, 3> weights{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int n = static_cast<int>(axis);
      const double at = (particle.position[axis] - grid.origin[n]) / grid.spacing[n], reach = 1.5 * cell / grid.spacing[n];
      low[axis] = std::max(static_cast<int>(std::ceil(at - reach)), 0);
      high[axis] = std::min({static_cast<int>(std::floor(at + reach)), grid.dimensions[axis] - 1, low[axis] + 7});
      for (int i = low[axis]; i <= high[axis]; ++i)
        weights[axis][static_cast<std::size_t>(i - low[axis])] = Spline((i - at) * grid.spacing[n] / cell);
    }
    const double volume = particle.volume * particle.strain.J * perCell;
    for (int k = low[2]; k <= high[2]; ++k)
      for (int j = low[1]; j <= high[1]; ++j) {
        const double weight =
            volume * weights[2][static_cast<std::size_t>(k - low[2])] * weights[1][static_cast<std::size_t>(j - low[1])];
        float* at = filled.data() + (static_cast<std::size_t>(k) * rows + static_cast<std::size_t>(j)) * row;
        for (int i = low[0]; i <= high[0]; ++i)
          at[i] += static_cast<float>(weight * weights[0][static_cast<std::size_t>(i - low[0])]);
      }
  }
  return filled;
}

// From what particles fill to what is positive in gel.
void MakeLevels(const GelSight& sight, GelCoat& coat)
{
  constexpr double share = 0.3, least = 0.02; // of what solids leave free, of a cell
  const Eigen::Affine3d toPoint = coat.grid.IndexToWorld();
  const Pose toHead = sight.headToFrame.inverse();
  const double cell = sight.solver.Domain().cellMm;
  const std::ptrdiff_t row = coat.grid.dimensions[0], rows = coat.grid.dimensions[1], slabs = coat.grid.dimensions[2];
  ParallelFor(slabs, [&](std::ptrdiff_t k) {
    for (std::ptrdiff_t j = 0; j < rows; ++j)
      for (std::ptrdiff_t i = 0; i < row; ++i) {
        float& level = coat.level[static_cast<std::size_t>((k * rows + j) * row + i)];
        const bool isBorder = i == 0 || j == 0 || k == 0 || i == row - 1 || j == rows - 1 || k == slabs - 1;
        if (isBorder || level <= least) {
          level = isBorder ? -1.0f : static_cast<float>(level - share - least); // surfaces are closed
          continue;
        }
        const Vector3d point = toPoint * Vector3d(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k));
        const double open =
            SplineBelow(sight.skin.Distance(point, 0.0) / cell) + SplineBelow(sight.head.Distance(toHead * point) / cell) - 1.0;
        level = static_cast<float>(level - share * std::max(open, 0.0) - least);
      }
  });
}

// From the face along a beam to the skin, or out of reach.
GelBeam Follow(const GelSight& sight, BeamPoint at, const GelShape& levels)
{
  GelBeam beam;
  beam.start = sight.headToFrame * PointOf(sight.geometry, at);
  const double cell = sight.solver.Domain().cellMm, step = 0.125 * cell;
  for (at.depth = 0.5 * step; !beam.meetsSkin; at.depth += step) {
    const Vector3d inHead = PointOf(sight.geometry, at), point = sight.headToFrame * inHead;
    if (!sight.reach.contains(inHead))
      break;
    beam.meetsSkin = sight.skin.Distance(point, 0.0) <= 0.0;
    if (!beam.meetsSkin)
      (levels.Distance(point, 0.0) > 0.0 ? beam.gelMm : beam.airMm) += step;
  }
  beam.couples = beam.meetsSkin && beam.airMm < 0.5 * cell;
  return beam;
}

} // namespace

ParameterList Describe(GelCoatParameters& p)
{
  return {
      Parameter("AmountMl", p.amountMl, {0.0, 1000.0}, "ml", "How much gel is put on the face of the probe."),
      Parameter("Coverage", p.coverage, {0.05, 1.0}, "",
                "Which part of the head's width and of its length the cap of gel covers at first."),
      Parameter("CellMm", p.cellMm, {0.1, 20.0}, "mm",
                "Edge of the cells that gel is computed with: thinner layers of air are not seen. Half of it takes sixteen times "
                "as long."),
      Parameter("SpeedMmPerS", p.speedMmPerS, {1.0, 1000.0}, "mm/s", "How fast the probe moves."),
      Parameter("SettleS", p.settleS, {0.0, 100.0}, "s", "How long gel goes on flowing when the probe has stopped."),
  };
}

GelCoat CoatOf(const GelSight& sight)
{
  GelCoat coat;
  coat.grid = GridAround(sight.solver, sight.headToFrame);
  coat.level = FilledOn(coat.grid, sight.solver);
  MakeLevels(sight, coat);
  const GelDistanceGrid levels(coat.grid, coat.level);
  coat.beams = gelBeams;
  coat.planes = sight.geometry.IsPlane() ? 1 : gelBeams;
  coat.face.resize(static_cast<std::size_t>(coat.beams * coat.planes));
  ParallelFor(coat.planes, [&](std::ptrdiff_t plane) {
    for (int n = 0; n < coat.beams; ++n) {
      const BeamPoint at{0.0, (n + 0.5) / coat.beams - 0.5, (static_cast<double>(plane) + 0.5) / coat.planes - 0.5};
      coat.face[static_cast<std::size_t>(plane * coat.beams + n)] = Follow(sight, at, levels);
    }
  });
  const auto coupled = std::count_if(coat.face.begin(), coat.face.end(), [](const GelBeam& beam) { return beam.couples; });
  coat.coupled = static_cast<double>(coupled) / static_cast<double>(coat.face.size());
  return coat;
}

} // namespace echorama
