// SPDX-License-Identifier: BSD-3-Clause
// Bounds from the boxes of the volumes in the grid: how full they are is known only when they have been read. An overlap is
// no larger than the boxes that meet in it.
#include "StitchMemory.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/Memory.h"
#include "RowSampler.h"
#include "StitchGrid.h"
#include <algorithm>
#include <cmath>
#include <unistd.h>

namespace echorama {

namespace {

// Bytes per unknown that a membrane takes while it is found: solution and residual in double, corrections and the
// certificate in float, kinds, on all levels.
constexpr double membraneBytes = 32.0;

// Bytes per row of the grid: where its counts, its overlap and the pieces of that begin.
constexpr double rowBytes = 24.0;

double AllowedMemory(const StitchParameters& parameters)
{
  if (parameters.maximumMemoryGb > 0.0)
    return parameters.maximumMemoryGb * 1e9;
  return 0.75 * static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

// Of a plan on the grid itself; a coarser one takes less by its voxels.
double PlanBytes(const StitchParameters& parameters, const std::vector<GridBox>& boxes, const ImageGeometry& grid)
{
  const double voxels = static_cast<double>(grid.VoxelCount());
  double sum = 0.0, largest = 0.0, overlaps = 0.0, largestOverlap = 0.0;
  for (std::size_t v = 0; v < boxes.size(); ++v) {
    const double box = static_cast<double>(boxes[v].VoxelCount());
    double overlap = 0.0;
    for (std::size_t u = 0; u < boxes.size(); ++u)
      if (u != v)
        overlap += static_cast<double>(boxes[v].Intersected(boxes[u]).VoxelCount());
    overlap = std::min(overlap, box);
    sum += box;
    largest = std::max(largest, box);
    overlaps += overlap;
    largestOverlap = std::max(largestOverlap, overlap);
  }
  const double regions = sum + std::min(sum, voxels) + rowBytes * grid.dimensions[1] * grid.dimensions[2];
  switch (parameters.method) {
  case StitchMethod::Membrane:
    return regions + 4.0 * overlaps + membraneBytes * largestOverlap;
  case StitchMethod::Distance:
    return regions + 4.0 * overlaps + 4.0 * largest + 5.0 * voxels;
  case StitchMethod::Feather:
    return regions + 4.0 * overlaps + 5.0 * largest;
  case StitchMethod::Average:
  case StitchMethod::Maximum:
    break;
  }
  return regions;
}

} // namespace

StitchCost CostOfStitch(const StitchParameters& parameters, const std::vector<ImageGeometry>& volumes, const ImageGeometry& grid,
                        const StitchOutputs& outputs)
{
  const double voxels = static_cast<double>(grid.VoxelCount());
  std::vector<GridBox> boxes;
  for (const ImageGeometry& volume : volumes)
    boxes.push_back(BoxOf(volume, grid));
  StitchCost cost;
  cost.volumes = volumes.size();
  cost.grid = grid;
  cost.voxelBytes = static_cast<double>(outputs.voxelBytes) + 2.0 + (outputs.spread ? 4.0 : 0.0) +
                    (outputs.weights ? 4.0 * static_cast<double>(volumes.size()) : 0.0);
  cost.outputBytes = cost.voxelBytes * voxels;
  cost.allowedBytes = AllowedMemory(parameters);
  const double full = PlanBytes(parameters, boxes, grid);
  const auto plan = [&](int factor) {
    cost.planFactor = factor;
    cost.planBytes = full;
    for (int axis = 0; axis < 3; ++axis)
      cost.planBytes /= std::min(factor, grid.dimensions[axis]);
  };
  plan(parameters.method == StitchMethod::Membrane ? std::max(1, parameters.planStep) : 1);
  const auto fits = [&] { return cost.planBytes <= (cost.planFactor == 1 ? 0.75 : 0.5) * cost.allowedBytes; };
  if (cost.WholeBytes() > cost.allowedBytes)
    while (!fits() && cost.planFactor < 64)
      plan(cost.planFactor + 1);
  const double slice = cost.voxelBytes * grid.dimensions[0] * grid.dimensions[1];
  const double slices = std::floor((cost.allowedBytes - cost.planBytes) / slice);
  cost.slabs = slices >= 1.0 ? static_cast<int>(std::ceil(grid.dimensions[2] / std::min<double>(slices, grid.dimensions[2]))) : 0;
  return cost;
}

void CheckStitch(const StitchParameters& parameters, const std::vector<ImageGeometry>& volumes, const ImageGeometry& grid,
                 const StitchOutputs& outputs, const GridBox& box)
{
  CheckRanges(parameters);
  grid.Check("the output grid");
  const StitchCost cost = CostOfStitch(parameters, volumes, grid, outputs);
  const double needed = cost.planBytes + cost.voxelBytes * static_cast<double>(box.VoxelCount());
  if (needed <= cost.allowedBytes)
    return;
  // A grid whose whole fits; a grid of few voxels always does, unless the limit is absurd.
  double spacing = std::cbrt(grid.spacing.prod());
  StitchCost coarser = cost;
  for (int trial = 0; trial < 100 && coarser.WholeBytes() > coarser.allowedBytes; ++trial) {
    spacing *= std::max(1.01, std::cbrt(coarser.WholeBytes() / coarser.allowedBytes));
    const double digit = std::pow(10.0, std::floor(std::log10(spacing)) - 1.0);
    spacing = std::ceil(spacing / digit) * digit; // two digits, rounded up
    coarser = CostOfStitch(parameters, volumes, StitchGrid(volumes, spacing), outputs);
  }
  throw Error(Error::Kind::TooLarge,
              "stitching " + std::to_string(volumes.size()) + " volumes onto " + SizeText(grid.dimensions) + " voxels needs " +
                  GigabytesText(needed) + ", more than the " + GigabytesText(cost.allowedBytes) + " allowed (MaximumMemoryGb); " +
                  (cost.slabs > 1 ? "written in " + std::to_string(cost.slabs) + " slabs it fits, or " : "") +
                  Format("SpacingMm = %.2g would fit", spacing));
}

} // namespace echorama
