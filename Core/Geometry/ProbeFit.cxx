// SPDX-License-Identifier: BSD-3-Clause
// 1. Outline: a few ten thousand points between blocks of voxels (OutlineRegion), thinned evenly.
// 2. Starts: a fan is symmetric about two planes, so the axes of inertia of the region are those of the probe, unless two
//    moments agree or a part is missing. They, and they turned by 45 degrees about each, with depth along any of them, times
//    a few fan and sweep angles, widths from the extent: some 1,700 models, rated by the distance of 300 points.
// 3. The best 24 are fitted to 600 points by Levenberg-Marquardt with Tukey's weights, whose reach shrinks from a part of the
//    region's size to about two cells: what no model explains (a missing corner, a ragged edge) is outvoted. The Jacobian is
//    analytic: a face moves under a parameter by minus its normal times the derivative of its point. Unknowns: the pose (6), fan
//    angle and width, sweep angle and width, length of the beams; in the last fit of a volume also the offset of the fan, when
//    that explains clearly more. None is infinite for flat faces or points.
// 4. The best, by overlap less misfit, is fitted anew with its axes exchanged and reversed in all ways, for a solid may be the
//    fan of several probes. Those that explain the region alike are fitted with all points, and the axes of the grid choose.
// 5. Blocks of voxels blunt the tip of a fan; how far it goes is counted in the voxels themselves.
// 6. Overlap, distance and how much of each face is seen decide whether the fit is put out, and what its notes say.
//
// A point at the end of the grid must not lie outside the model; when it lies inside, the model goes on beyond the grid, which
// costs next to nothing.
#include "Core/Geometry/ProbeFit.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/Parallel.h"
#include "Core/Geometry/FanRefinement.h"
#include "Core/Imaging/RegionOutline.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Eigenvalues>
#include <limits>
#include <utility>

namespace echorama {
namespace {

constexpr int mostCells = 1 << 18;
// Ratings (overlap less misfit) that differ by less say the same, and nearly so.
constexpr double asGood = 0.004, nearlyAsGood = 0.02;
constexpr double worthAnUnknown = 0.01;                    // gain of a rating by an offset of the fan
constexpr double mostHoles = 1.0 / 3.0;                    // of the region but for its rim
constexpr double leastSeenSide = 0.15, leastSeenEnd = 0.4; // of each side, and of the near or the far end

// Every n-th of a list, n chosen for at most \a count.
template <class T>
std::vector<T> Thinned(const std::vector<T>& all, std::size_t count)
{
  if (all.size() <= count)
    return all;
  std::vector<T> some;
  some.reserve(count);
  const double step = static_cast<double>(all.size()) / static_cast<double>(count);
  for (std::size_t i = 0; i < count; ++i)
    some.push_back(all[static_cast<std::size_t>((static_cast<double>(i) + 0.5) * step)]);
  return some;
}

// The voxel in the middle of a cell, and whether it belongs to the region (holes do).
struct Cell {
  Eigen::Vector3d position;
  bool inside = false;
};

// Intersection over union of region and model. Voxels that the surface cuts agree with the region.
double OverlapOf(const FanModel& model, const std::vector<Cell>& cells, double voxelMm)
{
  const Pose worldToProbe = model.probeToWorld.inverse();
  std::ptrdiff_t both = 0, either = 0;
  for (const Cell& cell : cells) {
    const double distance = LocateInFan(model.shape, worldToProbe * cell.position).distance;
    const bool inside = std::abs(distance) <= 0.5 * voxelMm ? cell.inside : distance < 0.0;
    both += inside && cell.inside;
    either += inside || cell.inside;
  }
  return either > 0 ? static_cast<double>(both) / static_cast<double>(either) : 0.0;
}

// Mean distance of the outline, each at most \a cap, as a part of it: 0 ... 1. Ends of the grid count when they are outside.
double MisfitOf(const FanModel& model, const OutlinePoints& points, double cap)
{
  const Pose worldToProbe = model.probeToWorld.inverse();
  double sum = 0.0, weights = 0.0;
  for (const RegionOutline::Point& point : points) {
    const double distance = LocateInFan(model.shape, worldToProbe * point.position).distance;
    const double weight = point.atGrid && distance < 0.0 ? leastFanWeight : 1.0;
    sum += weight * std::min(std::abs(distance), cap);
    weights += weight;
  }
  return sum / (weights * cap);
}

// All that the search needs to know of a region.
struct Region {
  RegionOutline outline;
  bool plane = false;
  double size = 0.0, voxelMm = 0.0;
  Eigen::Vector3d centroid;        // mm
  Eigen::Matrix3d axes;            // of inertia; of a slice the last is its normal
  std::vector<Cell> cells, sample; // many; some of them
  OutlinePoints few, some, many;

  double Reach() const { return 1.75 * outline.cellMm; }
};

Region RegionOf(RegionOutline outline, VolumeView<const unsigned char> valid, int outlinePoints)
{
  Region region;
  const auto& n = outline.filled.Dimensions();
  region.plane = outline.geometry.dimensions[2] == 1;
  region.size = std::pow(outline.validMm, region.plane ? 1.0 / 2.0 : 1.0 / 3.0);
  const Eigen::Vector3d& spacing = outline.geometry.spacing;
  region.voxelMm = region.plane ? std::sqrt(spacing.x() * spacing.y()) : std::cbrt(spacing.prod());
  region.cells.reserve(static_cast<std::size_t>(outline.filled.View().Size()));
  const Eigen::Affine3d toWorld = outline.geometry.IndexToWorld();
  const Eigen::Vector3d middle = outline.geometry.Centre();
  double sum = 0.0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const double filled = outline.filled.View()(i, j, k);
        const Eigen::Vector3d at = outline.CellPosition(i, j, k) - middle;
        const Eigen::Vector3i voxel =
            Eigen::Vector3d(outline.centres[0][i], outline.centres[1][j], outline.centres[2][k]).cast<int>();
        region.cells.push_back({toWorld * voxel.cast<double>(), filled == 1.0 || valid(voxel[0], voxel[1], voxel[2]) != 0});
        sum += filled;
        first += filled * at;
        second += filled * at * at.transpose();
      }
  first /= sum;
  region.centroid = middle + first;
  if (region.plane) {
    region.axes = outline.geometry.direction; // the starts turn all around
  } else {
    region.axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(second / sum - first * first.transpose()).eigenvectors();
    if (region.axes.determinant() < 0.0)
      region.axes.col(2) = -region.axes.col(2);
  }
  region.cells = Thinned(region.cells, static_cast<std::size_t>(16.384 * outlinePoints));
  region.sample = Thinned(region.cells, 2000);
  region.few = Thinned(outline.points, 300);
  region.some = Thinned(outline.points, static_cast<std::size_t>(std::min(600, outlinePoints)));
  region.many = Thinned(outline.points, static_cast<std::size_t>(outlinePoints));
  region.outline = std::move(outline);
  return region;
}

using Frames = std::vector<Eigen::Matrix3d>; // columns: x, y and z of the probe

// All ways to lay depth, array and sweep along three axes; of a slice, depth and array along the first two.
Frames FramesAlong(const Eigen::Matrix3d& axes, bool plane)
{
  Frames frames;
  for (int depth = 0; depth < (plane ? 2 : 3); ++depth)
    for (const double sign : {1.0, -1.0})
      for (int array = 0; array < (plane ? 2 : 3); ++array)
        if (array != depth) {
          const Eigen::Vector3d z = sign * axes.col(depth), x = axes.col(array);
          frames.emplace_back();
          frames.back() << x, z.cross(x), z;
        }
  return frames;
}

Frames StartFrames(const Region& region)
{
  std::vector<Eigen::Vector3d> turns;
  if (region.plane)
    for (int turn = 0; turn < 4; ++turn)
      turns.emplace_back(0.0, 0.0, turn * Pi / 8.0);
  else
    for (int axis = -1; axis < 3; ++axis)
      turns.push_back(axis < 0 ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                               : Eigen::Vector3d(0.25 * Pi * Eigen::Vector3d::Unit(axis)));
  Frames frames;
  for (const Eigen::Vector3d& turn : turns) {
    const Frames more = FramesAlong(region.axes * ExpRotation(turn), region.plane);
    frames.insert(frames.end(), more.begin(), more.end());
  }
  return frames;
}

// The arc of \a angle whose last samples, \a length beyond the first, span \a extent across.
double WidthFor(double angle, double extent, double length)
{
  if (angle == 0.0)
    return extent;
  return angle * std::max(0.0, 0.5 * extent / std::sin(std::min(0.5 * angle, 0.5 * Pi)) - length);
}

struct Rated {
  FanModel model;
  double rating = -std::numeric_limits<double>::infinity(); // overlap less misfit
};

// The starts of one frame: a few fan and sweep angles.
std::vector<Rated> StartsOf(const Region& region, const Eigen::Matrix3d& frame)
{
  const Eigen::Matrix3d toFrame = frame.transpose();
  std::array<std::vector<double>, 3> along;
  for (const RegionOutline::Point& point : region.few) {
    const Eigen::Vector3d at = toFrame * (point.position - region.centroid);
    for (int a = 0; a < 3; ++a)
      along[a].push_back(at[a]);
  }
  Eigen::Vector3d low, high; // all but a few points lie between
  for (int a = 0; a < 3; ++a) {
    const auto quantile = [&values = along[a]](double q) {
      const auto at = values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
      std::nth_element(values.begin(), at, values.end());
      return *at;
    };
    low[a] = quantile(0.01);
    high[a] = quantile(0.99);
  }
  const Eigen::Vector3d extent = high - low;

  // Where the middle beam, through the centroid, comes in: of the points near it the first. The near edge of a fan is hollow.
  double top = high.z();
  for (const RegionOutline::Point& point : region.some) {
    const Eigen::Vector3d at = toFrame * (point.position - region.centroid);
    if (std::abs(at.x()) < 0.15 * extent.x() && (region.plane || std::abs(at.y()) < 0.15 * extent.y() + region.outline.cellMm))
      top = std::min(top, at.z());
  }
  if (top > high.z() - 0.1 * extent.z())
    top = low.z();
  const double length = high.z() - top;

  static constexpr double angles[] = {0.0, 0.35, 0.7, 1.2, 1.9, 2.8};
  std::vector<Rated> starts;
  for (const double fan : angles)
    for (const double sweep : angles) {
      if (region.plane && sweep > 0.0)
        continue;
      Rated start;
      start.model.shape = {
          fan, WidthFor(fan, extent.x(), length), sweep, region.plane ? 0.0 : WidthFor(sweep, extent.y(), length), 0.0, length};
      start.model.probeToWorld.linear() = frame;
      start.model.probeToWorld.translation() = region.centroid + frame.col(2) * top;
      start.rating = -MisfitOf(start.model, region.few, 0.1 * region.size);
      starts.push_back(start);
    }
  return starts;
}

void SortByRating(std::vector<Rated>& list)
{
  std::stable_sort(list.begin(), list.end(), [](const Rated& a, const Rated& b) { return a.rating > b.rating; });
}

// Whether two models are one, to within what a fit leaves.
bool IsAlike(const FanModel& a, const FanModel& b, double size)
{
  const Eigen::Matrix3d turn = a.probeToWorld.linear().transpose() * b.probeToWorld.linear();
  // Turned by half about the middle beam a fan is the same.
  return turn(2, 2) > std::cos(5.0 * RadiansPerDegree) && std::abs(turn(0, 0)) > std::cos(5.0 * RadiansPerDegree) &&
         (a.probeToWorld.translation() - b.probeToWorld.translation()).norm() < 0.05 * size &&
         std::abs(a.shape.fanAngle - b.shape.fanAngle) < 5.0 * RadiansPerDegree &&
         std::abs(a.shape.sweepAngle - b.shape.sweepAngle) < 5.0 * RadiansPerDegree;
}

std::vector<Rated> Distinct(const std::vector<Rated>& sorted, std::size_t most, double size)
{
  std::vector<Rated> kept;
  for (const Rated& candidate : sorted)
    if (kept.size() < most &&
        std::none_of(kept.begin(), kept.end(), [&](const Rated& other) { return IsAlike(candidate.model, other.model, size); }))
      kept.push_back(candidate);
  return kept;
}

// Overlap less misfit, of all cells or of some.
double RatingOf(const FanModel& model, const Region& region, const std::vector<Cell>& cells, const OutlinePoints& points)
{
  const double cellMm = region.outline.cellMm;
  return OverlapOf(model, cells, region.voxelMm) - 0.5 * MisfitOf(model, points, std::max(0.05 * region.size, 2.0 * cellMm));
}

// The best model, and those that explain the region as well, or nearly so.
struct FitChoice {
  FanModel best;
  std::vector<Rated> others; // distinct from it, with their ratings less its own
};

// Whether an extent (mm) is too small to tell the angle from the width.
bool IsThin(double extent, const Region& region)
{
  return extent < 4.0 * region.outline.cellMm;
}

// How well a model follows the axes of the grid, where the region leaves the choice.
double ConventionOf(const FanModel& model, const Region& region)
{
  const Eigen::Matrix3d& axes = region.outline.geometry.direction;
  const Eigen::Matrix3d turn = model.probeToWorld.linear();
  // A slab is a plane that was hardly swept.
  const double middle = 0.5 * model.shape.depthMax;
  const bool isThin = !region.plane && IsThin(model.shape.Fan().Span(middle), region) &&
                      model.shape.Fan().Span(middle) < model.shape.Sweep().Span(middle);
  return (isThin ? -10.0 : 0.0) + turn.col(2).dot(axes.col(region.plane ? 1 : 2)) + 0.3 * std::abs(turn.col(0).dot(axes.col(0)));
}

FitChoice Choose(const Region& region, const Progress& progress)
{
  const FanFreedom freedom = region.plane ? FanFreedom::Plane : FanFreedom::Centred;
  // 2. starts
  const Frames frames = StartFrames(region);
  std::vector<std::vector<Rated>> perFrame(frames.size());
  ParallelFor(static_cast<std::ptrdiff_t>(frames.size()), progress.Part(0.0, 0.15),
              [&](std::ptrdiff_t i) { perFrame[i] = StartsOf(region, frames[i]); });
  std::vector<Rated> candidates;
  for (const std::vector<Rated>& starts : perFrame)
    candidates.insert(candidates.end(), starts.begin(), starts.end());
  SortByRating(candidates);
  candidates = Distinct(candidates, region.plane ? 12 : 24, region.size);

  // 3. each to its optimum
  const auto refineAll = [&](const Progress& part) {
    ParallelFor(static_cast<std::ptrdiff_t>(candidates.size()), part, [&](std::ptrdiff_t i) {
      RefineFan(candidates[i].model, region.some, freedom, 0.2 * region.size, region.Reach(), 10);
      candidates[i].rating = RatingOf(candidates[i].model, region, region.sample, region.some);
    });
    SortByRating(candidates);
  };
  refineAll(progress.Part(0.15, 0.6));

  // The same solid may be a fan seen from elsewhere: all ways to lay the axes of the best.
  const Rated best = candidates.front();
  candidates.clear();
  Eigen::Matrix3d axes = best.model.probeToWorld.linear();
  if (region.plane)
    axes.col(1).swap(axes.col(2)); // the normal last
  for (const Eigen::Matrix3d& frame : FramesAlong(axes, region.plane)) {
    std::vector<Rated> starts = StartsOf(region, frame);
    SortByRating(starts);
    candidates.push_back(starts.front());
  }
  refineAll(progress.Part(0.6, 0.8));
  candidates.insert(candidates.begin(), best);
  SortByRating(candidates);
  candidates = Distinct(candidates, candidates.size(), region.size);
  const double bestRating = candidates.front().rating;
  const auto tied = std::find_if(candidates.begin(), candidates.end(),
                                 [&](const Rated& candidate) { return candidate.rating < bestRating - asGood; });
  std::stable_sort(candidates.begin(), tied,
                   [&](const Rated& a, const Rated& b) { return ConventionOf(a.model, region) > ConventionOf(b.model, region); });
  candidates.resize(std::min<std::size_t>(candidates.size(), 4));
  candidates.erase(std::find_if(candidates.begin(), candidates.end(),
                                [&](const Rated& candidate) { return candidate.rating < bestRating - 2.0 * nearlyAsGood; }),
                   candidates.end());

  // 4. the best with all points
  ParallelFor(static_cast<std::ptrdiff_t>(candidates.size()), progress.Part(0.8, 1.0), [&](std::ptrdiff_t i) {
    RefineFan(candidates[i].model, region.many, freedom, 4.0 * region.Reach(), region.Reach(), 30);
    candidates[i].rating = RatingOf(candidates[i].model, region, region.cells, region.many);
    // A fan that is not centred on its array is a solid of its own only when the array bends and turns.
    if (region.plane ||
        std::min(candidates[i].model.shape.fanAngle, candidates[i].model.shape.sweepAngle) < 5.0 * RadiansPerDegree)
      return;
    Rated offset = candidates[i];
    RefineFan(offset.model, region.many, FanFreedom::Offset, 0.1 * region.size, region.Reach(), 40);
    offset.rating = RatingOf(offset.model, region, region.cells, region.many);
    if (offset.rating > candidates[i].rating + worthAnUnknown)
      candidates[i] = offset;
  });
  SortByRating(candidates);
  auto chosen = candidates.begin();
  for (auto other = chosen; other != candidates.end(); ++other)
    if (other->rating > candidates.front().rating - asGood &&
        ConventionOf(other->model, region) > ConventionOf(chosen->model, region) + 0.05)
      chosen = other;
  FitChoice choice{chosen->model, {}};
  for (auto other = candidates.begin(); other != candidates.end(); ++other)
    if (other != chosen && other->rating > chosen->rating - nearlyAsGood)
      choice.others.push_back({other->model, other->rating - chosen->rating});
  return choice;
}

// How well the outline lies on the model.
struct Residual {
  double rms = 0.0, mean = 0.0; // mm
  double beyond = 0.0;          // the part of the outline that is further off than what voxels and rounding explain
};

Residual ResidualOf(const FanModel& model, const Region& region)
{
  const OutlinePoints& points = region.outline.points;
  const Pose worldToProbe = model.probeToWorld.inverse();
  const bool onlyGrid = std::all_of(points.begin(), points.end(), [](const auto& point) { return point.atGrid; });
  const double near = std::max(0.015 * region.size, region.outline.cellMm);
  Residual residual;
  double count = 0.0;
  for (const RegionOutline::Point& point : points) {
    const double distance = LocateInFan(model.shape, worldToProbe * point.position).distance;
    if (point.atGrid && !onlyGrid && distance < 0.0)
      continue;
    residual.rms += distance * distance;
    residual.mean += std::abs(distance);
    residual.beyond += std::abs(distance) > near;
    count += 1.0;
  }
  count = std::max(count, 1.0);
  return {std::sqrt(residual.rms / count), residual.mean / count, residual.beyond / count};
}

// The near end of a fan that begins in a tip, from the voxels themselves: blocks of voxels blunt it. The face moves along the
// beams to where it puts the fewest voxels on the wrong side; not beyond the point where beams or planes of the sweep meet.
void SharpenTip(FanModel& model, VolumeView<const unsigned char> valid, const Region& region)
{
  ProbeGeometry& shape = model.shape;
  const double cell = region.outline.cellMm, inside = 4.0 * cell;
  const auto isTip = [&](const ProbeArc& arc) { return arc.angle > 5.0 * RadiansPerDegree && arc.width < 8.0 * cell; };
  if (!(isTip(shape.Fan()) || (!region.plane && isTip(shape.Sweep()))) || shape.depthMax < 2.0 * inside)
    return;
  double behind = 10.0 * cell;
  for (const ProbeArc& arc : {shape.Fan(), shape.Sweep()})
    if (arc.angle > 0.0 && arc.width > 0.0)
      behind = std::min(behind, arc.width / arc.angle);

  ProbeGeometry longer = shape;
  longer.depthMin = -behind;
  const Eigen::Affine3d probeToIndex = region.outline.geometry.WorldToIndex() * model.probeToWorld;
  const Eigen::Affine3d indexToProbe = probeToIndex.inverse();
  Eigen::AlignedBox3d box;
  for (const double depth : {-behind, inside})
    for (const double fan : {-0.5, 0.0, 0.5})
      for (const double sweep : {-0.5, 0.0, 0.5})
        box.extend(probeToIndex * PointOf(longer, {depth, fan, sweep}));
  std::array<int, 3> first, last;
  for (int a = 0; a < 3; ++a) {
    first[a] = std::max(0, static_cast<int>(std::floor(box.min()[a])));
    last[a] = std::min(valid.Dimensions()[a] - 1, static_cast<int>(std::ceil(box.max()[a])));
  }
  std::vector<std::pair<double, int>> voxels; // depth; 1: valid, -1: not
  for (int k = first[2]; k <= last[2]; ++k)
    for (int j = first[1]; j <= last[1]; ++j)
      for (int i = first[0]; i <= last[0]; ++i) {
        const FanPlace at = LocateInFan(longer, indexToProbe * Eigen::Vector3d(i, j, k));
        if (at.distance <= 0.0 && at.fan.depth < inside)
          voxels.emplace_back(at.fan.depth, valid(i, j, k) ? 1 : -1);
      }
  std::sort(voxels.begin(), voxels.end());
  // With the face before voxel i, the valid ones before it are wrong, and the others from it on.
  int wrong = 0, least = 0;
  double face = inside;
  for (std::size_t i = voxels.size(); i-- > 0;) {
    wrong -= voxels[i].second;
    if (wrong < least) {
      least = wrong;
      face = i > 0 ? 0.5 * (voxels[i].first + voxels[i - 1].first) : voxels[i].first;
    }
  }
  if (least == 0)
    return; // nothing is valid there: not a tip after all
  shape.fanWidth = std::max(0.0, shape.Fan().Span(face));
  shape.sweepWidth = std::max(0.0, shape.Sweep().Span(face));
  shape.depthMax -= face;
  model.probeToWorld.translation() += face * model.probeToWorld.linear().col(2);
}

// Turned by half about the middle beam a fan is the same: +x is the side towards which the indices grow.
void FaceTheGrid(FanModel& model, const Region& region)
{
  const Eigen::Vector3d along = region.outline.geometry.direction.transpose() * model.probeToWorld.linear().col(0);
  Eigen::Index most = 0;
  along.cwiseAbs().maxCoeff(&most);
  if (along[most] < 0.0) {
    model.probeToWorld.linear().col(0) *= -1.0;
    model.probeToWorld.linear().col(1) *= -1.0;
    model.shape.fanOffset *= -1.0;
  }
}

// How much of each face of the model the outline touches, of FanSide and SweepSide the lesser of both sides, [0, 1].
std::array<double, FanPlace::faces> SeenParts(const FanModel& model, const Region& region)
{
  const ProbeGeometry& shape = model.shape;
  // A face is looked at in up to 6 x 6 parts, none smaller than two cells.
  constexpr int most = 6;
  const auto partsOf = [&](double extent) { return std::clamp(static_cast<int>(0.5 * extent / region.outline.cellMm), 1, most); };
  const auto partsOfFace = [&](int face) -> std::array<int, 2> {
    const double depth = face == FanPlace::Near ? 0.0 : face == FanPlace::Far ? shape.depthMax : 0.5 * shape.depthMax;
    const int fan = partsOf(shape.Fan().Span(depth)), sweep = region.plane ? 1 : partsOf(shape.Sweep().Span(depth));
    const int deep = partsOf(shape.depthMax);
    return {face == FanPlace::FanSide ? deep : fan, face == FanPlace::SweepSide ? deep : sweep};
  };
  bool touched[FanPlace::faces][2][most][most] = {};
  const Pose worldToProbe = model.probeToWorld.inverse();
  for (const RegionOutline::Point& point : region.outline.points) {
    const FanPlace at = LocateInFan(shape, worldToProbe * point.position);
    if (std::abs(at.distance) > region.Reach())
      continue;
    const double fan = at.fan.along + 0.5, sweep = at.sweep.along + 0.5, deep = at.fan.depth / shape.depthMax;
    const double place[2] = {at.face == FanPlace::FanSide ? deep : fan, at.face == FanPlace::SweepSide ? deep : sweep};
    const bool positive = at.face == FanPlace::FanSide ? fan > 0.5 : at.face == FanPlace::SweepSide && sweep > 0.5;
    int part[2];
    for (int a = 0; a < 2; ++a) {
      const int parts = partsOfFace(at.face)[a];
      part[a] = std::clamp(static_cast<int>(place[a] * parts), 0, parts - 1);
    }
    touched[at.face][positive][part[0]][part[1]] = true;
  }
  std::array<double, FanPlace::faces> seen{};
  for (int face = 0; face < FanPlace::faces; ++face) {
    int count[2] = {0, 0};
    for (int side = 0; side < 2; ++side)
      for (const auto& row : touched[face][side])
        count[side] += static_cast<int>(std::count(std::begin(row), std::end(row), true));
    const auto [first, second] = partsOfFace(face);
    seen[face] = static_cast<double>(face < FanPlace::Near ? std::min(count[0], count[1]) : count[0]) / (first * second);
  }
  if (region.plane)
    seen[FanPlace::SweepSide] = 1.0;
  return seen;
}

// What the region leaves open, in sentences.
std::vector<std::string> NotesOn(const FitChoice& choice, const Region& region, const std::array<double, FanPlace::faces>& seen,
                                 double beyond)
{
  const ProbeGeometry& shape = choice.best.shape;
  const double cell = region.outline.cellMm;
  std::vector<std::string> notes;
  if (region.outline.coversGrid)
    notes.push_back("Every voxel is valid: the fan is the grid, which need not be what the probe saw.");
  if (region.outline.holesPart > 0.01)
    notes.push_back(Format("Holes (%.0f%% of the region) were taken as part of it.", 100.0 * region.outline.holesPart));
  if (beyond > 0.1)
    notes.push_back(
        Format("%.0f%% of the outline do not lie on the model: corners are missing, edges are ragged, or the region is not "
               "quite a fan.",
               100.0 * beyond));
  if (region.outline.largestPart < 0.99)
    notes.push_back(Format("%.0f%% of the region does not hang together with the rest and was left out of the fit.",
                           100.0 * (1.0 - region.outline.largestPart)));

  const auto unseen = [&](FanPlace::Face face, const char* sentence) {
    if (seen[face] < 0.5)
      notes.push_back(Format(sentence, 100.0 * seen[face]));
  };
  unseen(FanPlace::Far, "Only %.0f%% of the far end is seen in the outline: the depth may be greater.");
  unseen(FanPlace::Near, "Only %.0f%% of the near end is seen in the outline: the first depth and the widths are uncertain.");
  unseen(FanPlace::FanSide, "Only %.0f%% of one side of the fan is seen in the outline: the fan may be wider.");
  unseen(FanPlace::SweepSide, "Only %.0f%% of one side of the sweep is seen in the outline: the sweep may be wider.");

  bool otherAxis = false, exchanged = false;
  double exchangedRating = 0.0;
  for (const Rated& other : choice.others) {
    const Eigen::Matrix3d turn = choice.best.probeToWorld.linear().transpose() * other.model.probeToWorld.linear();
    if (turn(2, 2) < std::cos(20.0 * RadiansPerDegree)) {
      otherAxis = true;
    } else if (std::abs(turn(0, 0)) < 0.7 && !exchanged) {
      exchanged = true;
      exchangedRating = other.rating;
    }
  }
  if (otherAxis)
    notes.push_back("The probe could as well look along another axis of the region; the axes of the grid decided.");
  if (exchanged)
    notes.push_back(exchangedRating > -asGood ? "Fan and sweep could as well be exchanged; the axes of the grid decided."
                                              : "Fan and sweep could be exchanged: that explains the region nearly as well.");

  if (shape.fanOffset != 0.0)
    notes.push_back(
        Format("The fan is not centred (fanOffset): its middle beam is turned by %.1f degrees from where the sweep looks.",
               shape.fanAngle * shape.fanOffset / RadiansPerDegree));
  if (!region.plane && IsThin(shape.Sweep().Span(0.5 * shape.depthMax), region))
    notes.push_back(Format("The region is only %.3g mm thick along the sweep, too little to tell its angle from its width.",
                           shape.Sweep().Span(0.5 * shape.depthMax)));
  if (shape.fanAngle * shape.depthMax < cell)
    notes.push_back("The beams are parallel, as far as the voxels tell: nothing is known of a radius of the array.");
  else if (shape.fanWidth < cell)
    notes.push_back("The beams begin in a point, as far as the voxels tell.");
  if (!region.plane && shape.fanWidth < cell && shape.sweepWidth < cell)
    notes.push_back("Fan and sweep begin in one point: their radii cannot be told apart.");
  notes.push_back("Depth 0 is the near edge of the region: how far the face of the probe lies behind it is not known.");
  return notes;
}

} // namespace

ParameterList Describe(ProbeFitParameters& p)
{
  return {
      Parameter("MinimumOverlap", p.minimumOverlap, {0, 1}, "",
                "Fits are refused when intersection over union of region and fan is less."),
      Parameter("MaximumDistance", p.maximumDistance, {0, Unlimited, true}, "",
                "Fits are refused when the outline of the region lies further from the fan's surface in the mean: a part of the "
                "region's size, which is the cube root of its volume (of an image the square root of its area)."),
      Parameter("OutlinePoints", p.outlinePoints, {100, Unlimited}, "",
                "How many points of the outline take part in the last fit.")
          .Advanced(),
  };
}

ProbeFit FitProbe(VolumeView<const unsigned char> valid, const ImageGeometry& geometry, const ProbeFitParameters& parameters,
                  const Progress& progress)
{
  CheckRanges(parameters);

  Volume<unsigned char> all;
  if (valid.Empty()) {
    geometry.Check("the volume");
    all = Volume<unsigned char>(geometry.dimensions, 1);
    valid = std::as_const(all).View();
  }
  const Region region =
      RegionOf(OutlineRegion(valid, geometry, mostCells, progress.Part(0.0, 0.3)), valid, parameters.outlinePoints);
  if (region.outline.points.size() < (region.plane ? 40 : 150))
    throw Error(Error::Kind::NotPossible, "the valid region is too small for a fit: its outline is " +
                                              std::to_string(region.outline.points.size()) + " voxels long");
  FitChoice choice = Choose(region, progress.Part(0.3, 1.0));
  SharpenTip(choice.best, valid, region);
  FaceTheGrid(choice.best, region);
  const FanModel& best = choice.best;

  ProbeFit fit;
  fit.geometry = best.shape;
  fit.probeToWorld = best.probeToWorld;
  fit.overlap = OverlapOf(best, region.cells, region.voxelMm);
  const Residual residual = ResidualOf(best, region);
  fit.residualMm = residual.rms;
  fit.meanDistance = residual.mean / region.size;
  const std::string refusal = "no fan explains the valid region: ";
  if (region.outline.holesPart > mostHoles)
    throw Error(Error::Kind::NotPossible, refusal + Format("%.0f%% of it are holes", 100.0 * region.outline.holesPart));
  if (fit.overlap < parameters.minimumOverlap || fit.meanDistance > parameters.maximumDistance)
    throw Error(Error::Kind::NotPossible,
                refusal +
                    Format("the best one overlaps it by %.3f (at least %.3g is asked for), and its surface lies %.3g mm off the "
                           "outline in the mean (at most %.3g mm)",
                           fit.overlap, parameters.minimumOverlap, residual.mean, parameters.maximumDistance * region.size));
  const std::array<double, FanPlace::faces> seen = SeenParts(best, region);
  if (std::max(seen[FanPlace::Near], seen[FanPlace::Far]) < leastSeenEnd ||
      std::min(seen[FanPlace::FanSide], seen[FanPlace::SweepSide]) < leastSeenSide)
    throw Error(Error::Kind::NotPossible, refusal + "the grid cuts off so much of it that its sides are not seen");
  try {
    fit.geometry.Check();
  } catch (const Error& error) {
    throw Error(Error::Kind::NotPossible, refusal + "the best one is no probe (" + error.what() + ")");
  }
  fit.notes = NotesOn(choice, region, seen, residual.beyond);
  return fit;
}

} // namespace echorama
