// SPDX-License-Identifier: BSD-3-Clause
//
// In the coordinates of the beams fans are boxes, and boxes can be laid side by side. So the stitcher is given images whose axes
// are depth, fan and sweep, with the lengths of halfway down, on one common lattice: nothing is resampled between the beams of
// the volumes and those of the result.
#include "NoiseTiling.h"
#include "BeamSampling.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/ScanConversion.h"
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

namespace echorama {

namespace {

constexpr double degree = 0.017453292519943295;
constexpr double leastTurn = 0.5 * degree; // what turns by less runs straight

bool Turns(const ProbeArc& arc)
{
  return arc.angle >= leastTurn;
}

// The extent of an arc in its own unit: radians, or mm where it runs straight.
double ExtentOf(const ProbeArc& arc)
{
  return Turns(arc) ? arc.angle : arc.width;
}

std::string Text(const char* format, double a, double b = 0.0)
{
  char text[160];
  std::snprintf(text, sizeof text, format, a, b);
  return text;
}

// The samples of one volume without their rim, and where its first depth lies in steps from depth 0.
struct Beams {
  Volume<float> samples;
  int firstDepth = 0;
};

// What all tiles share: the distances between samples, of the first volume.
struct Lattice {
  double depthStep, fanPitch, sweepPitch; // mm; radians or mm; 0 for a plane
};

Volume<float> WithoutRim(VolumeView<const float> beams, const std::array<int, 3>& rim)
{
  const auto& n = beams.Dimensions();
  Volume<float> inner({n[0] - 2 * rim[0], n[1] - 2 * rim[1], n[2] - 2 * rim[2]});
  const auto view = inner.View();
  for (int k = 0; k < view.Dimensions()[2]; ++k)
    for (int j = 0; j < view.Dimensions()[1]; ++j)
      std::copy_n(beams.Row(j + rim[1], k + rim[2]) + rim[0], view.Dimensions()[0], view.Row(j, k));
  return inner;
}

Beams BeamsOf(const NoiseInput& input, const Lattice& lattice, const Progress& progress)
{
  // Depths are put on the common lattice: the fan is cut to whole steps.
  PlacedProbe fan = input.fan;
  const double first = std::ceil(fan.geometry.depthMin / lattice.depthStep - 1e-6);
  const double last = std::floor(fan.geometry.depthMax / lattice.depthStep + 1e-6);
  if (last < first + 3.0)
    throw Error(Error::Kind::BadInput, input.name + ": it is only a few samples deep");
  fan.geometry.depthMin = first * lattice.depthStep;
  fan.geometry.depthMax = last * lattice.depthStep;
  const auto count = [](double extent, double pitch) { return std::max(2, static_cast<int>(std::lround(extent / pitch)) + 1); };
  std::array<int, 3> dimensions{static_cast<int>(last - first) + 1, count(ExtentOf(fan.geometry.Fan()), lattice.fanPitch), 1};
  if (lattice.sweepPitch > 0.0)
    dimensions[2] = count(ExtentOf(fan.geometry.Sweep()), lattice.sweepPitch);
  return std::visit(
      [&](const auto& volume) {
        const Volume<float> all = SampleBeams(volume, fan, dimensions, progress);
        const auto rim = RimOf(fan.geometry, dimensions, volume.geometry);
        return Beams{WithoutRim(all.View(), rim), static_cast<int>(first) + rim[0]};
      },
      input.volume);
}

// A volume that is used for the n-th time: as it is, turned by half about its middle beam, mirrored in the sweep, in the fan.
Volume<float> UsedAgain(const Volume<float>& samples, int use)
{
  const bool inFan = use % 4 == 1 || use % 4 == 3, inSweep = use % 4 == 1 || use % 4 == 2;
  const auto& n = samples.Dimensions();
  Volume<float> turned(n);
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      std::copy_n(samples.View().Row(inFan ? n[1] - 1 - j : j, inSweep ? n[2] - 1 - k : k), n[0], turned.View().Row(j, k));
  return turned;
}

struct Tile {
  Volume<float> samples;
  Volume<unsigned char> valid;
  std::array<int, 3> first{0, 0, 0}; // of the common lattice
};

int OverlapBeams(const ProbeArc& arc, double pitch, const NoiseTilingParameters& parameters)
{
  return static_cast<int>(std::lround((Turns(arc) ? parameters.overlapDegrees * degree : parameters.overlapMm) / pitch));
}

void RefuseOverlap(const NoiseInput& input, const ProbeArc& arc, const char* what, const NoiseTilingParameters& parameters)
{
  const bool turns = Turns(arc);
  throw Error(Error::Kind::InvalidParameter,
              std::string("noise tiling: ") + (turns ? "overlapDegrees" : "overlapMm") +
                  Text(" is %.4g, but the ", turns ? parameters.overlapDegrees : parameters.overlapMm) + what + " of " +
                  input.name + Text(" is %.4g", turns ? arc.angle / degree : arc.width) + (turns ? " degrees" : " mm") +
                  ": nothing would be left of it beside its neighbour");
}

} // namespace

StitchParameters NoiseTilingParameters::ForNoise()
{
  StitchParameters parameters;
  parameters.equalizeGain = true;
  parameters.allowDisjoint = true;
  return parameters;
}

void NoiseTilingParameters::Check() const
{
  const auto fail = [](const std::string& reason) { throw Error(Error::Kind::InvalidParameter, "noise tiling: " + reason); };
  if (columns < 0)
    fail("columns is " + std::to_string(columns) + "; it must be at least 0");
  if (rows < 1)
    fail("rows is " + std::to_string(rows) + "; it must be at least 1");
  if (columns > 1000 || rows > 1000)
    fail("there are more than 1000 columns or rows");
  const auto notNegative = [&fail](const char* name, double value) {
    if (!(value >= 0.0) || !std::isfinite(value))
      fail(std::string(name) + " is " + std::to_string(value) + "; it must be at least 0");
  };
  notNegative("overlapDegrees", overlapDegrees);
  notNegative("overlapMm", overlapMm);
  notNegative("spacingMm", spacingMm);
}

TiledNoise TileNoise(const NoiseTilingParameters& parameters, const std::vector<NoiseInput>& volumes, const Progress& progress)
{
  parameters.Check();
  if (volumes.empty())
    throw Error(Error::Kind::BadInput, "noise tiling: there is no volume");
  const auto number = static_cast<int>(std::min<std::size_t>(volumes.size(), 1000000));
  const int rows = parameters.rows, columns = parameters.columns > 0 ? parameters.columns : (number + rows - 1) / rows;
  const ProbeGeometry& head = volumes[0].fan.geometry;
  for (const NoiseInput& input : volumes) {
    input.fan.geometry.Check();
    if (input.fan.geometry.IsPlane() != head.IsPlane())
      throw Error(Error::Kind::BadInput, "noise tiling: " + (head.IsPlane() ? volumes[0].name : input.name) +
                                             " is a single plane, but " + (head.IsPlane() ? input.name : volumes[0].name) +
                                             " is a volume");
    if (Turns(input.fan.geometry.Fan()) != Turns(head.Fan()) ||
        (!head.IsPlane() && Turns(input.fan.geometry.Sweep()) != Turns(head.Sweep())))
      throw Error(Error::Kind::BadInput, "noise tiling: of " + volumes[0].name + " and " + input.name +
                                             " one has a fan or a sweep that turns and the other one that runs straight, so they "
                                             "do not fit side by side");
  }
  if (head.IsPlane() && rows > 1)
    throw Error(Error::Kind::InvalidParameter, "noise tiling: rows is " + std::to_string(rows) + ", but planes do not sweep");

  // 1. the beams of all
  const double voxel = std::visit(
      [](const auto& volume) {
        volume.geometry.Check("the first noise volume");
        return VoxelSize(volume.geometry);
      },
      volumes[0].volume);
  const auto full = BeamDimensionsFor(head, voxel);
  const Lattice lattice{(head.depthMax - head.depthMin) / (full[0] - 1), ExtentOf(head.Fan()) / (full[1] - 1),
                        head.IsPlane() ? 0.0 : ExtentOf(head.Sweep()) / (full[2] - 1)};
  const int tileCount = rows * columns, used = std::min(number, tileCount);
  std::vector<Beams> beams;
  for (int i = 0; i < used; ++i)
    beams.push_back(BeamsOf(volumes[static_cast<std::size_t>(i)], lattice, progress.Part(0.3 * i / used, 0.3 * (i + 1) / used)));

  // 2. side by side
  const int fanOverlap = OverlapBeams(head.Fan(), lattice.fanPitch, parameters);
  const int sweepOverlap = head.IsPlane() ? 0 : OverlapBeams(head.Sweep(), lattice.sweepPitch, parameters);
  std::vector<Tile> tiles;
  std::array<int, 3> size{0, 0, 1};
  int firstDepth = std::numeric_limits<int>::max();
  for (const Beams& one : beams)
    firstDepth = std::min(firstDepth, one.firstDepth);
  for (int row = 0, nextSweep = 0; row < rows; ++row) {
    int sweepEnd = 0;
    for (int column = 0, nextFan = 0; column < columns; ++column) {
      const int number_ = row * columns + column, which = number_ % used;
      const NoiseInput& input = volumes[static_cast<std::size_t>(which)];
      const Beams& source = beams[static_cast<std::size_t>(which)];
      const auto& n = source.samples.Dimensions();
      if (columns > 1 && fanOverlap >= n[1] - 1)
        RefuseOverlap(input, input.fan.geometry.Fan(), "fan", parameters);
      if (rows > 1 && sweepOverlap >= n[2] - 1)
        RefuseOverlap(input, input.fan.geometry.Sweep(), "sweep", parameters);
      Tile tile{UsedAgain(source.samples, number_ / used),
                Volume<unsigned char>(n),
                {source.firstDepth - firstDepth, nextFan, nextSweep}};
      std::transform(tile.samples.View().begin(), tile.samples.View().end(), tile.valid.View().begin(),
                     [](float value) { return static_cast<unsigned char>(std::isfinite(value)); });
      for (std::size_t axis = 0; axis < 3; ++axis)
        size[axis] = std::max(size[axis], tile.first[axis] + n[axis]);
      nextFan += n[1] - 1 - fanOverlap;
      sweepEnd = std::max(sweepEnd, nextSweep + n[2] - 1);
      tiles.push_back(std::move(tile));
    }
    nextSweep = sweepEnd - sweepOverlap;
  }

  // 3. the fan that they make together
  TiledNoise tiled;
  tiled.fan = volumes[0].fan;
  ProbeGeometry& fan = tiled.fan.geometry;
  const double wider = static_cast<double>(size[1] - 1) / (full[1] - 1);
  const double longer = head.IsPlane() ? 1.0 : static_cast<double>(size[2] - 1) / (full[2] - 1);
  fan.fanAngle *= wider;
  fan.fanWidth *= wider;
  fan.sweepAngle *= longer;
  fan.sweepWidth *= longer;
  fan.fanOffset /= wider;
  fan.depthMin = firstDepth * lattice.depthStep;
  fan.depthMax = (firstDepth + size[0] - 1) * lattice.depthStep;
  try {
    CheckBeamVolume(size, fan);
  } catch (const Error& error) {
    if (error.GetKind() == Error::Kind::TooLarge)
      throw;
    throw Error(Error::Kind::NotPossible,
                "noise tiling: " + std::to_string(columns) + " columns and " + std::to_string(rows) + " rows make a fan of " +
                    Text("%.1f degrees that sweeps over %.1f degrees", fan.fanAngle / degree, fan.sweepAngle / degree) +
                    ", and no probe has that (" + error.what() + ")");
  }
  const double spacing = parameters.spacingMm > 0.0 ? parameters.spacingMm : voxel;
  tiled.geometry = ScanConversionGrid(fan, tiled.fan.probeToWorld, spacing, parameters.maxVoxels);

  // 4. blended
  Volume<float> whole(size, std::numeric_limits<float>::quiet_NaN());
  if (tiles.size() == 1) {
    whole = std::move(tiles[0].samples);
  } else {
    const double halfway = 0.5 * (head.depthMin + head.depthMax);
    ImageGeometry grid;
    grid.dimensions = size;
    grid.spacing = {lattice.depthStep, head.Fan().Span(halfway) / (full[1] - 1), lattice.depthStep};
    if (!head.IsPlane())
      grid.spacing.z() = std::max(std::abs(head.Sweep().Span(head.Fan().PointOf({head.fanOffset, halfway}).y())) / (full[2] - 1),
                                  1e-3 * lattice.depthStep);
    std::vector<StitchInput> inputs;
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      const Tile& tile = tiles[i];
      ImageGeometry place = grid;
      place.dimensions = tile.samples.Dimensions();
      for (std::size_t axis = 0; axis < 3; ++axis)
        place.origin[static_cast<Eigen::Index>(axis)] = tile.first[axis] * grid.spacing[static_cast<Eigen::Index>(axis)];
      inputs.push_back(
          {PosedVolume<float>{tile.samples.View(), tile.valid.View(), place}, volumes[i % static_cast<std::size_t>(used)].name});
    }
    Volume<unsigned char> valid(size), coverage(size);
    Stitch<float>(parameters.stitch, inputs, grid, {whole.View(), valid.View(), coverage.View(), {}}, progress.Part(0.3, 0.8));
    for (std::ptrdiff_t i = 0; i < whole.View().Size(); ++i)
      if (!valid.View()[i])
        whole.View()[i] = std::numeric_limits<float>::quiet_NaN();
  }
  tiles.clear();

  // 5. voxels
  tiled.intensity = Volume<float>(tiled.geometry.dimensions);
  tiled.valid = Volume<unsigned char>(tiled.geometry.dimensions);
  ScanConvert<float>(std::as_const(whole).View(), fan, tiled.fan.probeToWorld, tiled.geometry, tiled.intensity.View(),
                     tiled.valid.View(), progress.Part(0.8, 1.0));
  return tiled;
}

} // namespace echorama
