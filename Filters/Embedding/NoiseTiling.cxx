// SPDX-License-Identifier: BSD-3-Clause
//
// In the coordinates of the beams fans are boxes, and boxes can be laid side by side. So the stitcher is given images whose axes
// are depth, fan and sweep, with the lengths of halfway down, on one common lattice: nothing is resampled between the beams of
// the volumes and those of the result.
#include "NoiseTiling.h"
#include "BeamSampling.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/ScanConversion.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace echorama {

namespace {

constexpr double leastTurn = 0.5 * RadiansPerDegree; // what turns by less runs straight

bool Turns(const ProbeArc& arc)
{
  return arc.angle >= leastTurn;
}

// The extent of an arc in its own unit: radians, or mm where it runs straight.
double ExtentOf(const ProbeArc& arc)
{
  return Turns(arc) ? arc.angle : arc.width;
}

// What all tiles share: the distances between samples, of the first volume.
struct Lattice {
  double depthStep = 1.0, fanPitch = 1.0, sweepPitch = 0.0; // mm; radians or mm; 0 for a plane
};

// How one volume is read: its fan, cut to whole steps of the common depths, and the samples of that.
struct Reading {
  PlacedProbe fan;
  std::array<int, 3> dimensions{0, 0, 0}, rim{0, 0, 0};
  int firstDepth = 0; // of what is used, in steps from depth 0

  std::array<int, 3> Used() const { return {dimensions[0] - 2 * rim[0], dimensions[1] - 2 * rim[1], dimensions[2] - 2 * rim[2]}; }
};

ImageGeometry GeometryOf(const NoiseInput& input)
{
  return std::visit([](const auto& volume) { return volume.geometry; }, input.volume);
}

Reading ReadingOf(const NoiseInput& input, const Lattice& lattice)
{
  Reading reading;
  reading.fan = input.fan;
  ProbeGeometry& fan = reading.fan.geometry;
  const double first = std::ceil(fan.depthMin / lattice.depthStep - 1e-6);
  const double last = std::floor(fan.depthMax / lattice.depthStep + 1e-6);
  if (last < first + 3.0)
    throw Error(Error::Kind::BadInput, "noise tiling: " + input.name + " is only a few samples deep");
  fan.depthMin = first * lattice.depthStep;
  fan.depthMax = last * lattice.depthStep;
  const auto count = [](double extent, double pitch) { return std::max(2, static_cast<int>(std::lround(extent / pitch)) + 1); };
  reading.dimensions = {static_cast<int>(last - first) + 1, count(ExtentOf(fan.Fan()), lattice.fanPitch), 1};
  if (lattice.sweepPitch > 0.0)
    reading.dimensions[2] = count(ExtentOf(fan.Sweep()), lattice.sweepPitch);
  reading.rim = RimOf(fan, reading.dimensions, GeometryOf(input));
  reading.firstDepth = static_cast<int>(first) + reading.rim[0];
  return reading;
}

// The samples of one volume without their rim.
Volume<float> BeamsOf(const NoiseInput& input, const Reading& reading, const Progress& progress)
{
  const Volume<float> all = std::visit(
      [&](const auto& volume) { return SampleBeams(volume, reading.fan, reading.dimensions, progress); }, input.volume);
  const auto& rim = reading.rim;
  Volume<float> inner(reading.Used());
  const auto view = inner.View();
  for (int k = 0; k < view.Dimensions()[2]; ++k)
    for (int j = 0; j < view.Dimensions()[1]; ++j)
      std::copy_n(all.View().Row(j + rim[1], k + rim[2]) + rim[0], view.Dimensions()[0], view.Row(j, k));
  return inner;
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

int OverlapBeams(const ProbeArc& arc, double pitch, const NoiseTilingParameters& parameters)
{
  return static_cast<int>(
      std::lround((Turns(arc) ? parameters.overlapDegrees * RadiansPerDegree : parameters.overlapMm) / pitch));
}

void RefuseOverlap(const NoiseInput& input, const ProbeArc& arc, const char* what, const NoiseTilingParameters& parameters)
{
  const bool turns = Turns(arc);
  throw Error(Error::Kind::InvalidParameter,
              std::string("noise tiling: ") + (turns ? "OverlapDegrees" : "OverlapMm") +
                  Format(" is %.4g, but the ", turns ? parameters.overlapDegrees : parameters.overlapMm) + what + " of " +
                  input.name + Format(" is %.4g", turns ? arc.angle / RadiansPerDegree : arc.width) +
                  (turns ? " degrees" : " mm") + ": nothing would be left of it beside its neighbour");
}

// Which volume lies where on the common lattice, for the how many-th time.
struct Tile {
  std::size_t which = 0;
  int use = 0;
  std::array<int, 3> first{0, 0, 0};
};

// All but the voxels.
struct Plan {
  std::vector<Reading> readings; // of the volumes that are used
  std::vector<Tile> tiles;
  std::array<int, 3> size{0, 0, 1};
  Eigen::Vector3d pitchMm = Eigen::Vector3d::Ones(); // between samples, beams and steps, halfway down
  PlacedProbe fan;
  ImageGeometry geometry;
};

void CheckInputs(const NoiseTilingParameters& parameters, const std::vector<NoiseInput>& volumes)
{
  CheckRanges(parameters);
  if (volumes.empty())
    throw Error(Error::Kind::BadInput, "noise tiling: there is no volume");
  const NoiseInput& first = volumes[0];
  const ProbeGeometry& head = first.fan.geometry;
  for (const NoiseInput& input : volumes) {
    const ProbeGeometry& fan = input.fan.geometry;
    fan.Check();
    GeometryOf(input).Check("noise tiling: " + input.name);
    if (fan.IsPlane() != head.IsPlane())
      throw Error(Error::Kind::BadInput, "noise tiling: " + (head.IsPlane() ? first.name : input.name) +
                                             " is a single plane, but " + (head.IsPlane() ? input.name : first.name) +
                                             " is a volume");
    if (Turns(fan.Fan()) != Turns(head.Fan()) || (!head.IsPlane() && Turns(fan.Sweep()) != Turns(head.Sweep())))
      throw Error(Error::Kind::BadInput, "noise tiling: of " + first.name + " and " + input.name +
                                             " one has a fan or a sweep that turns and the other one that runs straight, so they "
                                             "do not fit side by side");
  }
  if (head.IsPlane() && parameters.rows > 1)
    throw Error(Error::Kind::InvalidParameter,
                "noise tiling: Rows is " + std::to_string(parameters.rows) + ", but planes do not sweep");
}

Plan PlanOf(const NoiseTilingParameters& parameters, const std::vector<NoiseInput>& volumes)
{
  CheckInputs(parameters, volumes);
  const int number = static_cast<int>(std::min<std::size_t>(volumes.size(), 1000000));
  const int rows = parameters.rows, columns = parameters.columns > 0 ? parameters.columns : (number + rows - 1) / rows;
  const int used = std::min(number, rows * columns);
  const ProbeGeometry& head = volumes[0].fan.geometry;
  const bool plane = head.IsPlane();
  const double voxel = VoxelSize(GeometryOf(volumes[0]));
  const auto full = BeamDimensionsFor(head, voxel);
  Lattice lattice;
  lattice.depthStep = (head.depthMax - head.depthMin) / (full[0] - 1);
  lattice.fanPitch = ExtentOf(head.Fan()) / (full[1] - 1);
  if (!plane)
    lattice.sweepPitch = ExtentOf(head.Sweep()) / (full[2] - 1);

  Plan plan;
  int firstDepth = std::numeric_limits<int>::max();
  for (int i = 0; i < used; ++i) {
    plan.readings.push_back(ReadingOf(volumes[static_cast<std::size_t>(i)], lattice));
    firstDepth = std::min(firstDepth, plan.readings.back().firstDepth);
  }
  const int fanOverlap = OverlapBeams(head.Fan(), lattice.fanPitch, parameters);
  const int sweepOverlap = plane ? 0 : OverlapBeams(head.Sweep(), lattice.sweepPitch, parameters);
  for (int row = 0, nextSweep = 0; row < rows; ++row) {
    int sweepEnd = 0;
    for (int column = 0, nextFan = 0; column < columns; ++column) {
      const int place = row * columns + column;
      Tile tile;
      tile.which = static_cast<std::size_t>(place % used);
      tile.use = place / used;
      const Reading& reading = plan.readings[tile.which];
      const auto n = reading.Used();
      if (columns > 1 && fanOverlap >= n[1] - 1)
        RefuseOverlap(volumes[tile.which], reading.fan.geometry.Fan(), "fan", parameters);
      if (rows > 1 && sweepOverlap >= n[2] - 1)
        RefuseOverlap(volumes[tile.which], reading.fan.geometry.Sweep(), "sweep", parameters);
      tile.first = {reading.firstDepth - firstDepth, nextFan, nextSweep};
      for (std::size_t axis = 0; axis < 3; ++axis)
        plan.size[axis] = std::max(plan.size[axis], tile.first[axis] + n[axis]);
      nextFan += n[1] - 1 - fanOverlap;
      sweepEnd = std::max(sweepEnd, nextSweep + n[2] - 1);
      plan.tiles.push_back(tile);
    }
    nextSweep = sweepEnd - sweepOverlap;
  }

  plan.fan = volumes[0].fan;
  ProbeGeometry& fan = plan.fan.geometry;
  const double wider = static_cast<double>(plan.size[1] - 1) / (full[1] - 1);
  const double longer = plane ? 1.0 : static_cast<double>(plan.size[2] - 1) / (full[2] - 1);
  fan.fanAngle *= wider;
  fan.fanWidth *= wider;
  fan.sweepAngle *= longer;
  fan.sweepWidth *= longer;
  fan.fanOffset /= wider;
  fan.depthMin = firstDepth * lattice.depthStep;
  fan.depthMax = (firstDepth + plan.size[0] - 1) * lattice.depthStep;
  try {
    CheckBeamVolume(plan.size, fan);
  } catch (const Error& error) {
    if (error.GetKind() == Error::Kind::TooLarge)
      throw;
    throw Error(Error::Kind::NotPossible, "noise tiling: " + std::to_string(columns) + " columns and " + std::to_string(rows) +
                                              " rows make a fan of " +
                                              Format("%.1f degrees that sweeps over %.1f degrees",
                                                     fan.fanAngle / RadiansPerDegree, fan.sweepAngle / RadiansPerDegree) +
                                              ", and no probe has that (" + error.what() + ")");
  }
  const double halfway = 0.5 * (head.depthMin + head.depthMax);
  plan.pitchMm = {lattice.depthStep, head.Fan().Span(halfway) / (full[1] - 1), lattice.depthStep};
  if (!plane) {
    const double span = std::abs(head.Sweep().Span(head.Fan().PointOf({head.fanOffset, halfway}).y()));
    plan.pitchMm.z() = std::max(span / (full[2] - 1), 1e-3 * lattice.depthStep); // the axis of the sweep may lie there
  }
  plan.geometry = ScanConversionGrid(fan, plan.fan.probeToWorld, parameters.spacingMm > 0.0 ? parameters.spacingMm : voxel,
                                     parameters.maxVoxels);
  return plan;
}

// The tiles as one beam volume, NaN where none is.
Volume<float> Blended(const NoiseTilingParameters& parameters, const std::vector<NoiseInput>& volumes, const Plan& plan,
                      const Progress& progress)
{
  std::vector<Volume<float>> beams;
  const double count = static_cast<double>(plan.readings.size());
  for (std::size_t i = 0; i < plan.readings.size(); ++i) {
    const double done = static_cast<double>(i);
    beams.push_back(BeamsOf(volumes[i], plan.readings[i], progress.Part(0.4 * done / count, 0.4 * (done + 1.0) / count)));
  }
  if (plan.tiles.size() == 1)
    return std::move(beams[0]);

  ImageGeometry grid;
  grid.dimensions = plan.size;
  grid.spacing = plan.pitchMm;
  std::vector<Volume<float>> turned;
  std::vector<Volume<unsigned char>> real;
  std::vector<StitchInput> inputs;
  turned.reserve(plan.tiles.size());
  real.reserve(plan.tiles.size());
  for (const Tile& tile : plan.tiles) {
    if (tile.use > 0)
      turned.push_back(UsedAgain(beams[tile.which], tile.use));
    const Volume<float>& samples = tile.use > 0 ? turned.back() : beams[tile.which];
    real.emplace_back(samples.Dimensions());
    std::transform(samples.View().begin(), samples.View().end(), real.back().View().begin(),
                   [](float value) { return static_cast<unsigned char>(std::isfinite(value)); });
    ImageGeometry place = grid;
    place.dimensions = samples.Dimensions();
    place.origin = Eigen::Vector3d(tile.first[0], tile.first[1], tile.first[2]).cwiseProduct(grid.spacing);
    inputs.push_back({PosedVolume<float>{samples.View(), std::as_const(real.back()).View(), place}, volumes[tile.which].name});
  }
  Volume<float> whole(plan.size);
  Volume<unsigned char> valid(plan.size), coverage(plan.size);
  Stitch<float>(parameters.stitch, inputs, grid, {whole.View(), valid.View(), coverage.View(), {}}, progress.Part(0.4, 1.0));
  for (std::ptrdiff_t i = 0; i < whole.View().Size(); ++i)
    if (!valid.View()[i])
      whole.View()[i] = std::numeric_limits<float>::quiet_NaN();
  return whole;
}

} // namespace

StitchParameters NoiseTilingParameters::ForNoise()
{
  StitchParameters parameters;
  parameters.equalizeGain = true;
  parameters.allowDisjoint = true;
  return parameters;
}

ParameterList Describe(NoiseTilingParameters& p)
{
  return {
      Parameter(
          "Columns", p.columns, {0, 1000}, "",
          "Volumes side by side across the fan; 0: as many as there are for the rows. When there are fewer volumes than places "
          "they are used again, turned or mirrored."),
      Parameter("Rows", p.rows, {1, 1000}, "", "Rows of volumes along the sweep."),
      Parameter("OverlapDegrees", p.overlapDegrees, {0, 360}, "degrees",
                "By how much neighbouring noise volumes overlap where fan or sweep turn. It sets the angle of the whole."),
      Parameter("OverlapMm", p.overlapMm, {0, 10000}, "mm",
                "The same where fan or sweep run straight (turn by less than half a degree in all)."),
      Parameter("SpacingMm", p.spacingMm, {0, Unlimited}, "mm",
                "Edge of the cubic voxels of the output. 0: the voxel size of the first volume."),
  };
}

TiledBeams TileNoiseBeams(const NoiseTilingParameters& parameters, const std::vector<NoiseInput>& volumes,
                          const Progress& progress)
{
  const Plan plan = PlanOf(parameters, volumes);
  return {Blended(parameters, volumes, plan, progress), plan.fan};
}

NoiseTiling PlanNoiseTiling(const NoiseTilingParameters& parameters, const std::vector<NoiseInput>& volumes)
{
  const Plan plan = PlanOf(parameters, volumes);
  return {plan.geometry, plan.fan};
}

TiledNoise TileNoise(const NoiseTilingParameters& parameters, const std::vector<NoiseInput>& volumes, const Progress& progress)
{
  const Plan plan = PlanOf(parameters, volumes);
  const Volume<float> beams = Blended(parameters, volumes, plan, progress.Part(0.0, 0.8));
  TiledNoise tiled{Volume<float>(plan.geometry.dimensions), Volume<unsigned char>(plan.geometry.dimensions), plan.geometry,
                   plan.fan};
  ScanConvert<float>(beams.View(), plan.fan.geometry, plan.fan.probeToWorld, plan.geometry, tiled.intensity.View(),
                     tiled.valid.View(), progress.Part(0.8, 1.0));
  return tiled;
}

} // namespace echorama
