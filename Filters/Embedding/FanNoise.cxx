// SPDX-License-Identifier: BSD-3-Clause
//
// A part of the grid lies between the beams that pass near a lattice of points in it. The parts are halved until these are few
// enough; close to where all beams meet that may take parts of a few voxels. They are halved further where that saves samples: a
// box of voxels that lies oblique to the beams is between few of those in the box of samples around it.
#include "FanNoise.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/ScanConversion.h"
#include "Filters/Stitching/StitchSampler.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>
#include <vector>

namespace echorama {

namespace {

constexpr int leastPart = 4;                // voxels along an edge
constexpr int fewSteps = 4, manySteps = 16; // of the lattice: for a comparison, and for what is made
constexpr double saving = 0.9;              // of the samples that are made: a part is halved where it is left with less

// The samples that a part of the grid lies between, and the fewer beyond them the more \a steps are looked at along each edge;
// none where it is beside the fan.
GridBox BeamsAround(const PlacedProbe& fan, const std::array<int, 3>& all, const ImageGeometry& part, int steps)
{
  const ProbeGeometry& g = fan.geometry;
  GridBox box{{0, 0, 0}, all};
  const Eigen::Affine3d toProbe = fan.probeToWorld.inverse() * part.IndexToWorld();
  Eigen::AlignedBox3d range;
  for (int c = 0; c <= steps; ++c)
    for (int b = 0; b <= steps; ++b)
      for (int a = 0; a <= steps; ++a) {
        const Eigen::Vector3d share = Eigen::Vector3d(a, b, c) / steps;
        const Eigen::Vector3d last(part.dimensions[0] - 1, part.dimensions[1] - 1, part.dimensions[2] - 1);
        const Eigen::Vector3d point = toProbe * share.cwiseProduct(last);
        for (const bool behind : {false, g.ReachesBehindAxis()}) {
          const ProbeArc::Place plane =
              g.IsPlane() ? ProbeArc::Place{0.0, point.z()} : g.Sweep().PlaceOf(point.y(), point.z(), behind);
          const ProbeArc::Place beam = g.Fan().PlaceOf(point.x(), plane.depth);
          range.extend(Eigen::Vector3d((beam.depth - g.depthMin) / (g.depthMax - g.depthMin), beam.along - g.fanOffset + 0.5,
                                       plane.along + 0.5));
        }
      }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<Eigen::Index>(axis);
    const double last = all[axis] - 1, margin = 2.0 + 0.5 / steps * range.sizes()[at] * last;
    const double low = std::clamp(std::floor(range.min()[at] * last - margin), 0.0, last);
    const double high = std::clamp(std::ceil(range.max()[at] * last + margin), 0.0, last);
    if (range.max()[at] * last + margin < 0.0 || range.min()[at] * last - margin > last)
      return {};
    box.first[axis] = static_cast<int>(low);
    box.size[axis] = static_cast<int>(high - low) + 1;
    if (box.size[axis] < 2 && all[axis] > 1) { // between two at least
      box.size[axis] = 2;
      box.first[axis] = std::min(box.first[axis], all[axis] - 2);
    }
  }
  return box;
}

std::array<GridBox, 2> Halved(const GridBox& part, std::size_t axis)
{
  std::array<GridBox, 2> halves{part, part};
  halves[0].size[axis] /= 2;
  halves[1].first[axis] += halves[0].size[axis];
  halves[1].size[axis] -= halves[0].size[axis];
  return halves;
}

} // namespace

BeamNoiseParameters ForGrid(BeamNoiseParameters parameters, const PlacedProbe& fan, const ImageGeometry& grid, std::uint64_t seed)
{
  parameters.seed = seed;
  parameters.depthCorrelationMm = std::min(parameters.depthCorrelationMm, 0.25 * (fan.geometry.depthMax - fan.geometry.depthMin));
  return ResolvingCounts(parameters, fan.geometry, 3.0, std::max(16e6, static_cast<double>(grid.VoxelCount())));
}

void FillFanWithNoise(const BeamNoiseParameters& parameters, const PlacedProbe& fan, const ImageGeometry& grid,
                      VolumeView<float> noise, VolumeView<unsigned char> inside, const Progress& progress, double most)
{
  const std::array<int, 3> all = BeamNoiseSize(parameters, fan.geometry);
  const auto count = [](const GridBox& box) { return static_cast<double>(box.VoxelCount()); };
  const double whole = count({{0, 0, 0}, all});
  if (whole <= most && count(BeamsAround(fan, all, grid, manySteps)) > 0.5 * whole) {
    const Volume<float> beams = MakeBeamNoise(parameters, fan.geometry, progress.Part(0.0, 0.5));
    ScanConvert<float>(beams.View(), fan.geometry, fan.probeToWorld, grid, noise, inside, progress.Part(0.5, 1.0));
    return;
  }
  std::fill(noise.begin(), noise.end(), 0.0f);
  std::fill(inside.begin(), inside.end(), static_cast<unsigned char>(0));
  // How many samples are made for a part, those beyond it included.
  const std::array<int, 3> reach = BeamNoiseReach(parameters, fan.geometry);
  const auto madeFor = [&](const GridBox& part) {
    const GridBox beams = BeamsAround(fan, all, Cropped(grid, part), fewSteps);
    double made = beams.Empty() ? 0.0 : 1.0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      made *= beams.size[axis] + 2.0 * reach[axis];
    return made;
  };
  std::vector<GridBox> parts{{{0, 0, 0}, grid.dimensions}};
  const double voxels = count(parts[0]);
  double done = 0.0;
  while (!parts.empty()) {
    progress(done / voxels);
    const GridBox part = parts.back();
    parts.pop_back();
    const ImageGeometry its = Cropped(grid, part);
    const GridBox beams = BeamsAround(fan, all, its, manySteps);
    auto along = static_cast<std::size_t>(std::max_element(part.size.begin(), part.size.end()) - part.size.begin());
    bool isHalved = count(beams) > most && part.size[along] > leastPart;
    if (!isHalved && !beams.Empty()) {
      double least = saving * madeFor(part);
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (part.size[axis] > leastPart) {
          const std::array<GridBox, 2> halves = Halved(part, axis);
          if (const double made = madeFor(halves[0]) + madeFor(halves[1]); made < least) {
            least = made;
            along = axis;
            isHalved = true;
          }
        }
    }
    if (isHalved) {
      const std::array<GridBox, 2> halves = Halved(part, along);
      parts.insert(parts.end(), halves.begin(), halves.end());
      continue;
    }
    if (!beams.Empty()) {
      const Volume<float> samples = MakeBeamNoise(parameters, fan.geometry, beams.first, beams.size);
      Volume<float> values(part.size);
      Volume<unsigned char> there(part.size);
      const BeamWindow window{all, beams.first};
      ScanConvert<float>(samples.View(), fan.geometry, fan.probeToWorld, its, values.View(), there.View(), {}, &window);
      ParallelFor(part.size[2], [&](std::ptrdiff_t slice) {
        const int k = static_cast<int>(slice);
        for (int j = 0; j < part.size[1]; ++j) {
          std::copy_n(values.View().Row(j, k), part.size[0], noise.Row(j + part.first[1], k + part.first[2]) + part.first[0]);
          std::copy_n(there.View().Row(j, k), part.size[0], inside.Row(j + part.first[1], k + part.first[2]) + part.first[0]);
        }
      });
    }
    done += count(part);
  }
  progress(1.0);
}

} // namespace echorama
