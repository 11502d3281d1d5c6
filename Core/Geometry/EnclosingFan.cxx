// SPDX-License-Identifier: BSD-3-Clause
// Where a probe stands, where it looks and how much its array and its sweep bend decide everything else: in its beam coordinates
// the least fan around a region is a box, given by the extremes over the voxels. So the search is over the head alone, and what
// it finds encloses the region by construction.
//
// 1. Surface: the voxels with a neighbour outside. Depth, fan and sweep have no extreme within a solid, so they suffice. They are
//    found anew in each pass, never stored.
// 2. Some hundreds of them stand for all in the search: of each block of voxels the one furthest from the middle.
// 3. Starts: the shape that is given or the fit of the region, and plain fans along the same axes, from flat to well bent. A flat
//    one can enclose anything, so that there is always an answer. The given one and the best two plain ones are improved by the
//    simplex method of Nelder and Mead: the volume of the fan has kinks, where the outermost voxel changes.
// 4. Boxes, from the axes of the fit and of the grid, and phased fans, from where the beams of the fit meet, are searched in the
//    same way with their bends held at 0 and at 1.
// 5. The extremes over all voxels of the surface make the fan.
//
// A bend is written as b in [0, 1], 0 flat and 1 a point: (1 - b) of the width halfway down is there at the face, and b comes
// with depth. Neither end is infinite, and across the beams the unit is a millimetre at that depth.
#include "Core/Geometry/EnclosingFan.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Geometry/ProbeFit.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace echorama {
namespace {

constexpr double widestTurn = 85.0 * Pi / 180.0; // of a beam, from the middle one
constexpr int blocksAlong = 16;                  // the longest side of the region, for the points of the search
constexpr std::size_t mostPoints = 700;
constexpr double asGoodAsInside = 0.01; // voxels
constexpr double asSmall = 0.05;        // of the volume: a simpler family may be so much larger than another
constexpr double mostMargin = 5.0, marginParts = 40.0;
constexpr double flatBend = 1e-9; // less is flat
constexpr double slack = 1e-7;    // that extremes are widened by, as a part of the fan's size: rounding

// Calls body(i, j, k) for the voxels of slice k that are on the surface of the region.
template <class Body>
void ForSurfaceOfSlice(VolumeView<const unsigned char> valid, int k, const Body& body)
{
  const auto& n = valid.Dimensions();
  const std::ptrdiff_t row = valid.RowStride(), slice = valid.SliceStride();
  for (int j = 0; j < n[1]; ++j) {
    const unsigned char* line = valid.Row(j, k);
    const bool atEnd = j == 0 || j == n[1] - 1 || (n[2] > 1 && (k == 0 || k == n[2] - 1));
    for (int i = 0; i < n[0]; ++i) {
      if (!line[i])
        continue;
      const unsigned char* at = line + i;
      if (atEnd || i == 0 || i == n[0] - 1 || !at[-1] || !at[1] || !at[-row] || !at[row] ||
          (n[2] > 1 && (!at[-slice] || !at[slice])))
        body(i, j, k);
    }
  }
}

// Least and greatest, of what is held.
struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
  void Hold(double value, double beyond = 0.0)
  {
    low = std::min(low, value - beyond);
    high = std::max(high, value + beyond);
  }
  void Hold(const Range& other)
  {
    low = std::min(low, other.low);
    high = std::max(high, other.high);
  }
  double Middle() const { return 0.5 * (low + high); }
  double Length() const { return high - low; }
};

// The region as the search sees it.
struct ValidVoxels {
  VolumeView<const unsigned char> valid;
  ImageGeometry geometry;
  bool plane = false;
  double margin = 0.0; // mm
  double beyond = 0.0; // mm around each voxel centre that are enclosed too
  std::vector<Eigen::Vector3d> points;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double size = 0.0; // mm, of the box around it
};

ValidVoxels RegionOf(VolumeView<const unsigned char> valid, const ImageGeometry& geometry, double marginMm,
                     const Progress& progress)
{
  ValidVoxels region{valid, geometry, geometry.dimensions[2] == 1, marginMm, 0.0, {}, Eigen::Vector3d::Zero(), 0.0};
  const Eigen::Vector3d& spacing = geometry.spacing;

  const auto& n = geometry.dimensions;
  std::vector<std::array<Range, 3>> boxes(static_cast<std::size_t>(n[2]));
  ParallelFor(n[2], progress.Part(0.0, 0.5), [&](std::ptrdiff_t k) {
    ForSurfaceOfSlice(valid, static_cast<int>(k), [&box = boxes[static_cast<std::size_t>(k)]](int i, int j, int slice) {
      box[0].Hold(i);
      box[1].Hold(j);
      box[2].Hold(slice);
    });
  });
  std::array<Range, 3> box;
  for (const auto& more : boxes)
    for (std::size_t axis = 0; axis < 3; ++axis)
      box[axis].Hold(more[axis]);
  if (!(box[0].Length() >= 0.0))
    throw Error(Error::Kind::BadInput, "the valid region is empty");

  const Eigen::Vector3d low(box[0].low, box[1].low, box[2].low), high(box[0].high, box[1].high, box[2].high);
  const Eigen::Vector3d extent = (high - low).cwiseProduct(spacing), middle = 0.5 * (low + high);
  if (marginMm < 0.0)
    region.margin = std::min(mostMargin, extent.maxCoeff() / marginParts);
  region.beyond = region.margin + 0.5 * (region.plane ? std::sqrt(spacing.x() * spacing.y()) : std::cbrt(spacing.prod()));
  region.middle = geometry.IndexToWorld() * middle;
  region.size = extent.norm() + 2.0 * region.beyond;

  // Of each block the voxel furthest from the middle, block by block in layers of slices.
  const double block = std::max(extent.maxCoeff() / blocksAlong, 1e-12);
  std::array<int, 3> step{}, blocks{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    step[axis] = std::max(1, static_cast<int>(std::ceil(block / spacing[a])));
    blocks[axis] = static_cast<int>(high[a] - low[a]) / step[axis] + 1;
  }
  struct Furthest {
    double distance = -1.0;
    Eigen::Vector3d index = Eigen::Vector3d::Zero();
  };
  const auto perLayer = static_cast<std::size_t>(blocks[0]) * static_cast<std::size_t>(blocks[1]);
  std::vector<Furthest> furthest(perLayer * static_cast<std::size_t>(blocks[2]));
  const int first[3] = {static_cast<int>(low[0]), static_cast<int>(low[1]), static_cast<int>(low[2])};
  ParallelFor(blocks[2], progress.Part(0.5, 1.0), [&](std::ptrdiff_t layer) {
    const int from = first[2] + static_cast<int>(layer) * step[2], to = std::min(from + step[2], static_cast<int>(high[2]) + 1);
    for (int k = from; k < to; ++k)
      ForSurfaceOfSlice(valid, k, [&](int i, int j, int slice) {
        const Eigen::Vector3d index(i, j, slice);
        const double distance = (index - middle).cwiseProduct(spacing).squaredNorm();
        Furthest& best = furthest[static_cast<std::size_t>(layer) * perLayer +
                                  static_cast<std::size_t>((j - first[1]) / step[1]) * static_cast<std::size_t>(blocks[0]) +
                                  static_cast<std::size_t>((i - first[0]) / step[0])];
        if (distance > best.distance)
          best = {distance, index};
      });
  });
  const Eigen::Affine3d toWorld = geometry.IndexToWorld();
  for (const Furthest& best : furthest)
    if (best.distance >= 0.0)
      region.points.push_back(toWorld * best.index);
  const std::size_t count = region.points.size();
  if (count > mostPoints) {
    for (std::size_t i = 0; i < mostPoints; ++i)
      region.points[i] = region.points[i * count / mostPoints];
    region.points.resize(mostPoints);
  }
  return region;
}

// What the fan is made of but for its extent.
struct Head {
  Pose probeToWorld = Pose::Identity();
  double fanBend = 0.0, sweepBend = 0.0;
  double fanMiddle = 0.0; // where the middle beam leaves, mm halfway down from the middle of the array
};

// The fan that is not to become less, and the unit of bends.
struct Least {
  OutlineFamily family = OutlineFamily::Curved;
  double halfway = 1.0;                  // mm of depth
  double fanBend = 1.0, sweepBend = 1.0; // the greatest that are allowed
  double fanTurn = widestTurn, sweepTurn = widestTurn;
  bool offset = false; // whether the fan may be off the middle of its array: only where the start is
  const ProbeGeometry* shape = nullptr;

  ProbeArc Unit(double bend) const { return {bend / halfway, 1.0 - bend}; }
};

// Extremes over voxels.
struct Extent {
  Range depth, fan, sweep;
  void Hold(const Extent& other)
  {
    depth.Hold(other.depth);
    fan.Hold(other.fan);
    sweep.Hold(other.sweep);
  }
};

class Measure {
public:
  Measure(const Head& head, const Least& least, const ValidVoxels& region)
    : worldToProbe_(head.probeToWorld.inverse()), fan_(least.Unit(head.fanBend)), sweep_(least.Unit(head.sweepBend)),
      beyond_(region.beyond), plane_(region.plane && !(least.shape && !least.shape->IsPlane()))
  {
  }

  void Hold(const Eigen::Vector3d& inWorld, Extent& extent) const
  {
    const Eigen::Vector3d point = worldToProbe_ * inWorld;
    const ProbeArc::Place sweep = plane_ ? ProbeArc::Place{0.0, point.z()} : sweep_.PlaceOf(point.y(), point.z());
    const ProbeArc::Place fan = fan_.PlaceOf(point.x(), sweep.depth);
    extent.depth.Hold(fan.depth, beyond_);
    extent.fan.Hold(fan.along, beyond_ / std::max(fan_.Span(fan.depth), 1e-6));
    if (!plane_)
      extent.sweep.Hold(sweep.along, beyond_ / std::max(sweep_.Span(sweep.depth), 1e-6));
  }

  Extent OfPoints(const ValidVoxels& region) const
  {
    Extent extent;
    for (const Eigen::Vector3d& point : region.points)
      Hold(point, extent);
    return extent;
  }

  bool IsPlane() const { return plane_; }

private:
  Pose worldToProbe_;
  ProbeArc fan_, sweep_;
  double beyond_;
  bool plane_;
};

// Half of what is wide enough on both sides of \a middle, and nowhere less than the shape that is given.
double HalfWidth(const Range& range, double middle, const ProbeArc& unit, const ProbeArc* shape, double shapeDepth)
{
  double half = std::max(range.high - middle, middle - range.low);
  if (shape) {
    if (unit.width > 0.0)
      half = std::max(half, 0.5 * shape->width / unit.width);
    if (unit.Span(shapeDepth) > 0.0)
      half = std::max(half, 0.5 * shape->Span(shapeDepth) / unit.Span(shapeDepth));
  }
  return half;
}

// Where nothing bends a head may be moved sideways with its beams: into the middle of what they hold.
Head Centred(Head head, Extent& extent)
{
  Eigen::Vector3d aside = Eigen::Vector3d::Zero();
  if (head.fanBend == 0.0 && head.fanMiddle == 0.0 && extent.fan.Length() >= 0.0) {
    aside.x() = extent.fan.Middle();
    extent.fan = {-0.5 * extent.fan.Length(), 0.5 * extent.fan.Length()};
  }
  if (head.sweepBend == 0.0 && extent.sweep.Length() >= 0.0) {
    aside.y() = extent.sweep.Middle();
    extent.sweep = {-0.5 * extent.sweep.Length(), 0.5 * extent.sweep.Length()};
  }
  head.probeToWorld.translation() += head.probeToWorld.linear() * aside;
  return head;
}

// The least fan with this head, and by how much its beams turn too far (radians).
std::pair<ProbeGeometry, double> FanOf(const Head& head, const Least& least, Extent extent, bool plane)
{
  const double rounding = slack * (extent.depth.Length() + 1e-6);
  if (least.shape) {
    extent.depth.Hold(least.shape->depthMin);
    extent.depth.Hold(least.shape->depthMax);
  } else {
    extent.depth = {extent.depth.low - rounding, extent.depth.high + rounding};
  }
  const ProbeArc fan = least.Unit(head.fanBend), sweep = least.Unit(head.sweepBend);
  const ProbeArc fanOfShape = least.shape ? least.shape->Fan() : ProbeArc(),
                 sweepOfShape = least.shape ? least.shape->Sweep() : ProbeArc();
  const double far = least.shape ? least.shape->depthMax : 0.0;
  ProbeGeometry found;
  found.depthMin = extent.depth.low;
  found.depthMax = extent.depth.high;
  if (least.family == OutlineFamily::Phased) // to the tip, which must not lie within what is held
    found.depthMin = std::min(found.depthMin, 0.0);
  const double behind = std::max(0.0, -found.depthMin / least.halfway);
  if (fan.angle > 0.0) // no further than the centre of the fan's arc
    found.depthMin = std::max(found.depthMin, -fan.width / fan.angle);
  const double half = (1.0 + slack) * HalfWidth(extent.fan, head.fanMiddle, fan, least.shape ? &fanOfShape : nullptr, far);
  found.fanAngle = 2.0 * half * fan.angle;
  found.fanWidth = 2.0 * half * fan.width;
  found.fanOffset = head.fanMiddle / (2.0 * half);
  double excess = std::max(0.0, fan.angle * (half + std::abs(head.fanMiddle)) - least.fanTurn);
  if (least.family == OutlineFamily::Phased)
    excess += behind;
  if (!plane) {
    const double across = (1.0 + slack) * HalfWidth(extent.sweep, 0.0, sweep, least.shape ? &sweepOfShape : nullptr, far);
    found.sweepAngle = 2.0 * across * sweep.angle;
    found.sweepWidth = 2.0 * across * sweep.width;
    excess += std::max(0.0, sweep.angle * across - least.sweepTurn);
    if (found.sweepAngle >= Pi && found.ReachesBehindAxis())
      excess += 1.0;
  }
  return {found, excess};
}

double CostOf(const Head& head, const Least& least, const ValidVoxels& region)
{
  const Measure measure(head, least, region);
  Extent extent = measure.OfPoints(region);
  const Head centred = Centred(head, extent);
  const auto [fan, excess] = FanOf(centred, least, extent, measure.IsPlane());
  return std::log(std::max(FanVolume(fan), 1e-300)) + 1e3 * excess;
}

// The numbers that the search turns, each in steps of about equal effect.
class Knobs {
public:
  Knobs(const Head& start, const Least& least, const ValidVoxels& region, bool plane)
    : start_(start), least_(least), region_(region)
  {
    const bool curved = least.family == OutlineFamily::Curved, linear = least.family == OutlineFamily::Linear;
    for (int knob = 0; knob < Count; ++knob) {
      const bool along = knob == AlongX || knob == AlongY || knob == AlongZ, bend = knob == FanBend || knob == SweepBend;
      if ((!plane || knob == AlongX || knob == AlongZ || knob == AboutY || knob == FanBend) && (curved || !bend) &&
          !(linear && along) && (least.offset || knob != FanMiddle))
        used_.push_back(knob);
    }
  }

  std::size_t Size() const { return used_.size(); }

  Head At(const std::vector<double>& values) const
  {
    double all[Count] = {};
    for (std::size_t i = 0; i < used_.size(); ++i)
      all[used_[i]] = values[i];
    const double length = 0.05 * region_.size, turn = 0.1, bend = 0.15;
    const Eigen::Matrix3d& axes = start_.probeToWorld.linear();
    Head head = start_;
    head.probeToWorld =
        MotionAbout(region_.middle, axes * Eigen::Vector3d(turn * all[AboutX], turn * all[AboutY], turn * all[AboutZ]),
                    axes * Eigen::Vector3d(length * all[AlongX], length * all[AlongY], length * all[AlongZ])) *
        start_.probeToWorld;
    head.fanBend = std::clamp(start_.fanBend + bend * all[FanBend], 0.0, least_.fanBend);
    head.sweepBend = std::clamp(start_.sweepBend + bend * all[SweepBend], 0.0, least_.sweepBend);
    if (head.fanBend < flatBend)
      head.fanBend = 0.0;
    if (head.sweepBend < flatBend)
      head.sweepBend = 0.0;
    head.fanMiddle += length * all[FanMiddle];
    return head;
  }

private:
  enum Knob { AlongX, AlongY, AlongZ, AboutX, AboutY, AboutZ, FanBend, SweepBend, FanMiddle, Count };
  const Head& start_;
  const Least& least_;
  const ValidVoxels& region_;
  std::vector<int> used_;
};

struct Priced {
  Head head;
  double cost = 0.0;
};

// Where a search begins, and within what limits.
struct Start {
  Least least;
  Priced rated;
};

// One run of the simplex method from a corner at the start; \a steps evaluations at most.
Priced Simplex(const Priced& start, const Least& least, const ValidVoxels& region, bool plane, double step, int steps)
{
  const Knobs knobs(start.head, least, region, plane);
  struct Corner {
    std::vector<double> at;
    double cost;
  };
  const auto corner = [&](std::vector<double> at) {
    const double cost = CostOf(knobs.At(at), least, region);
    return Corner{std::move(at), cost};
  };
  const std::size_t n = knobs.Size();
  std::vector<Corner> simplex{{std::vector<double>(n, 0.0), start.cost}};
  for (std::size_t i = 0; i < n; ++i) {
    std::vector<double> at(n, 0.0);
    at[i] = step;
    simplex.push_back(corner(std::move(at)));
  }
  for (int done = static_cast<int>(n); done < steps;) {
    std::stable_sort(simplex.begin(), simplex.end(), [](const Corner& a, const Corner& b) { return a.cost < b.cost; });
    if (simplex.back().cost - simplex.front().cost < 1e-4)
      break;
    std::vector<double> middle(n, 0.0);
    for (std::size_t c = 0; c < n; ++c)
      for (std::size_t i = 0; i < n; ++i)
        middle[i] += simplex[c].at[i] / static_cast<double>(n);
    const auto along = [&](double t) {
      std::vector<double> at(n);
      for (std::size_t i = 0; i < n; ++i)
        at[i] = middle[i] + t * (simplex.back().at[i] - middle[i]);
      ++done;
      return corner(std::move(at));
    };
    Corner reflected = along(-1.0);
    if (reflected.cost < simplex.front().cost) {
      Corner further = along(-2.0);
      simplex.back() = further.cost < reflected.cost ? std::move(further) : std::move(reflected);
    } else if (reflected.cost < simplex[n - 1].cost) {
      simplex.back() = std::move(reflected);
    } else {
      Corner nearer = along(reflected.cost < simplex.back().cost ? -0.5 : 0.5);
      if (nearer.cost < std::min(reflected.cost, simplex.back().cost)) {
        simplex.back() = std::move(nearer);
      } else {
        for (std::size_t c = 1; c <= n; ++c) {
          for (std::size_t i = 0; i < n; ++i)
            simplex[c].at[i] = 0.5 * (simplex[c].at[i] + simplex[0].at[i]);
          simplex[c] = corner(std::move(simplex[c].at));
          ++done;
        }
      }
    }
  }
  const auto best =
      std::min_element(simplex.begin(), simplex.end(), [](const Corner& a, const Corner& b) { return a.cost < b.cost; });
  return {knobs.At(best->at), best->cost};
}

// A plain fan that looks along the axes of \a pose, its face at the near end of the region, across its middle.
Head PlainHead(const Pose& pose, double fanBend, double sweepBend, const ValidVoxels& region)
{
  Range x, y, z;
  for (const Eigen::Vector3d& point : region.points) {
    const Eigen::Vector3d at = pose.linear().transpose() * point;
    x.Hold(at.x());
    y.Hold(at.y());
    z.Hold(at.z(), region.beyond);
  }
  Head head{pose, fanBend, sweepBend, 0.0};
  head.probeToWorld.translation() = pose.linear() * Eigen::Vector3d(x.Middle(), y.Middle(), z.low);
  return head;
}

// A box that looks along the axes of \a pose.
Start BoxStart(const Pose& pose, const ValidVoxels& region)
{
  return {{OutlineFamily::Linear, 1.0, 0.0, 0.0}, {PlainHead(pose, 0.0, 0.0, region), 0.0}};
}

// Beams along the axes of \a pose from a point \a back mm before the near end of the region.
Start PhasedStart(const Pose& pose, double back, const ValidVoxels& region)
{
  Start start;
  start.least.family = OutlineFamily::Phased;
  Head& head = start.rated.head = PlainHead(pose, 1.0, 1.0, region);
  const Eigen::Vector3d depth = head.probeToWorld.linear().col(2);
  start.least.halfway = std::max(back + depth.dot(region.middle - head.probeToWorld.translation()), 1e-3 * region.size);
  head.probeToWorld.translation() -= back * depth;
  return start;
}

double BendOf(const ProbeArc& arc, double halfway)
{
  return arc.angle > 0.0 ? arc.angle * halfway / arc.Span(halfway) : 0.0;
}

// Whether the fan as it is holds every voxel, with the margin, to within a part of a voxel.
bool Holds(const PlacedProbe& fan, const ValidVoxels& region, double marginMm, const Progress& progress)
{
  const Pose worldToProbe = fan.probeToWorld.inverse();
  const Eigen::Affine3d toProbe = worldToProbe * region.geometry.IndexToWorld();
  const ProbeGeometry& g = fan.geometry;
  const double off = asGoodAsInside * region.geometry.spacing.head(region.plane ? 2 : 3).minCoeff();
  std::vector<char> outside(static_cast<std::size_t>(region.geometry.dimensions[2]), 0);
  ParallelFor(region.geometry.dimensions[2], progress, [&](std::ptrdiff_t slice) {
    char& out = outside[static_cast<std::size_t>(slice)];
    ForSurfaceOfSlice(region.valid, static_cast<int>(slice), [&](int i, int j, int k) {
      if (out)
        return;
      const auto beam = BeamPointAt(g, toProbe * Eigen::Vector3d(i, j, k), off / g.Size());
      out = !beam;
      if (out || marginMm == 0.0)
        return;
      const double rho = g.Fan().PointOf({beam->fan + g.fanOffset, beam->depth}).y();
      const double least =
          std::min({beam->depth - g.depthMin, g.depthMax - beam->depth, (0.5 - std::abs(beam->fan)) * g.Fan().Span(beam->depth),
                    g.IsPlane() ? marginMm : (0.5 - std::abs(beam->sweep)) * std::abs(g.Sweep().Span(rho))});
      out = least < marginMm - off;
    });
  });
  return std::none_of(outside.begin(), outside.end(), [](char out) { return out != 0; });
}

Extent ExtentOf(const Measure& measure, const ValidVoxels& region, const Progress& progress)
{
  const Eigen::Affine3d toWorld = region.geometry.IndexToWorld();
  std::vector<Extent> extents(static_cast<std::size_t>(region.geometry.dimensions[2]));
  ParallelFor(region.geometry.dimensions[2], progress, [&](std::ptrdiff_t slice) {
    ForSurfaceOfSlice(region.valid, static_cast<int>(slice), [&](int i, int j, int k) {
      measure.Hold(toWorld * Eigen::Vector3d(i, j, k), extents[static_cast<std::size_t>(slice)]);
    });
  });
  Extent extent;
  for (const Extent& more : extents)
    extent.Hold(more);
  return extent;
}

// Depth 0 is put at the near edge, as a fit does.
void BeginAtNearEdge(PlacedProbe& fan)
{
  ProbeGeometry& g = fan.geometry;
  const double face = g.depthMin;
  if (g.Sweep().Span(face) < 0.0)
    return; // the sweep axis lies within the region: no face there has a width
  g.fanWidth = std::max(0.0, g.Fan().Span(face));
  g.sweepWidth = std::max(0.0, g.Sweep().Span(face));
  g.depthMax -= face;
  g.depthMin = 0.0;
  fan.probeToWorld.translation() += face * fan.probeToWorld.linear().col(2);
}

// Where the search starts from when no shape is given: the fit, however bad, or a box along the axes of the grid.
PlacedProbe FoundFrom(const ValidVoxels& region, const Progress& progress)
{
  ProbeFitParameters anything;
  anything.minimumOverlap = 0.0;
  anything.maximumDistance = std::numeric_limits<double>::max();
  anything.outlinePoints = 1000; // a start need not be exact
  try {
    const ProbeFit fit = FitProbe(region.valid, region.geometry, anything, progress);
    return {fit.geometry, fit.probeToWorld};
  } catch (const Error& error) {
    if (error.GetKind() != Error::Kind::NotPossible)
      throw;
  }
  const Eigen::Matrix3d& axes = region.geometry.direction;
  PlacedProbe box{ProbeGeometry::Linear(region.size, region.plane ? 0.0 : region.size, 0.0, region.size), Pose::Identity()};
  const Eigen::Vector3d depth = axes.col(region.plane ? 1 : 2);
  box.probeToWorld.linear() << axes.col(0), depth.cross(axes.col(0)), depth;
  box.probeToWorld.translation() = region.middle - 0.5 * region.size * depth;
  return box;
}

// The axes of the grid, in the order and the directions in which they come next to those of \a pose.
Pose AlongGrid(const Pose& pose, const ImageGeometry& geometry)
{
  const Eigen::Matrix3d& axes = geometry.direction;
  Eigen::Index depth = 0, across = 0;
  (axes.transpose() * pose.linear().col(2)).cwiseAbs().maxCoeff(&depth);
  Eigen::Vector3d shares = (axes.transpose() * pose.linear().col(0)).cwiseAbs();
  shares[depth] = -1.0;
  shares.maxCoeff(&across);
  const auto towards = [&axes](Eigen::Index axis, const Eigen::Vector3d& wanted) {
    return Eigen::Vector3d(axes.col(axis) * (axes.col(axis).dot(wanted) < 0.0 ? -1.0 : 1.0));
  };
  const Eigen::Vector3d z = towards(depth, pose.linear().col(2)), x = towards(across, pose.linear().col(0));
  Pose along = pose;
  along.linear() << x, z.cross(x), z;
  return along;
}

// The base, and the two best of plain fans along its axes.
std::vector<Start> CurvedStarts(const PlacedProbe& base, const EnclosingFanParameters& parameters, const ValidVoxels& region)
{
  Least least;
  least.halfway =
      std::max(0.5 * (base.geometry.depthMin + base.geometry.depthMax), 0.25 * (base.geometry.depthMax - base.geometry.depthMin));
  const ProbeArc fan = base.geometry.Fan(), sweep = base.geometry.Sweep();
  Head start{base.probeToWorld, BendOf(fan, least.halfway), BendOf(sweep, least.halfway), 0.0};
  start.fanMiddle = base.geometry.fanOffset * fan.Span(least.halfway);
  least.offset = start.fanMiddle != 0.0;
  least.fanTurn = std::max(least.fanTurn, fan.angle * (0.5 + std::abs(base.geometry.fanOffset)));
  least.sweepTurn = std::max(least.sweepTurn, 0.5 * sweep.angle);
  if (parameters.shape) {
    least.shape = &parameters.shape->geometry;
    least.fanBend = start.fanBend;
    if (!base.geometry.IsPlane())
      least.sweepBend = start.sweepBend;
  }
  std::vector<Start> starts;
  for (const double part : {0.0, 0.3, 0.6, 1.0}) {
    const Head plain =
        PlainHead(base.probeToWorld, part * std::min(least.fanBend, 0.6), part * std::min(least.sweepBend, 0.6), region);
    starts.push_back({least, {plain, CostOf(plain, least, region)}});
  }
  std::stable_sort(starts.begin(), starts.end(), [](const Start& a, const Start& b) { return a.rated.cost < b.rated.cost; });
  starts.resize(2);
  starts.push_back({least, {start, 0.0}});
  return starts;
}

// Whether the data begin where phased beams do: no wider there than what the margin and a voxel make of a point, and a twentieth
// of what they are at the other end.
bool BeginsAtAPoint(const Start& start, const ValidVoxels& region)
{
  const Measure measure(start.rated.head, start.least, region);
  const Extent extent = measure.OfPoints(region);
  const ProbeGeometry fan = FanOf(start.rated.head, start.least, extent, measure.IsPlane()).first;
  const double angle = std::max(fan.fanAngle, fan.sweepAngle), near = extent.depth.low + region.beyond;
  return angle * near <= 3.0 * region.beyond / std::max(std::cos(0.5 * angle), 0.1) + 0.05 * angle * fan.depthMax;
}

// The best start of the simplest family that is about as small as any.
const Start& SimplestOf(std::vector<Start>& starts)
{
  std::stable_sort(starts.begin(), starts.end(), [](const Start& a, const Start& b) { return a.rated.cost < b.rated.cost; });
  const double limit = starts.front().rated.cost + std::log1p(asSmall);
  return *std::min_element(starts.begin(), starts.end(), [limit](const Start& a, const Start& b) {
    const bool aCounts = a.rated.cost <= limit, bCounts = b.rated.cost <= limit;
    return aCounts != bCounts ? aCounts : aCounts && a.least.family < b.least.family;
  });
}

} // namespace

ParameterList Describe(EnclosingFanParameters& p)
{
  return {
      Parameter("MarginMm", p.marginMm, {-1, Unlimited}, "mm",
                "How far the fan reaches beyond the centres of the voxels at least, in depth and to all sides. Below 0: by a "
                "fortieth of the longest side of the data, at most 5 mm."),
      Parameter("Outline", Choice(p.outline, {"automatic", "linear", "phased", "curved"}),
                "The kind of probe whose beams give the outline, where no fan is given: linear makes a box, phased a fan from "
                "a single point, curved one that bends as it must. Automatic: the simplest that is at most 5% larger than "
                "the smallest, phased only where the data begin at a point.")};
}

OutlineFamily FamilyOf(const ProbeGeometry& geometry)
{
  if (geometry.fanAngle == 0.0 && geometry.sweepAngle == 0.0)
    return OutlineFamily::Linear;
  return geometry.fanWidth == 0.0 && geometry.sweepWidth == 0.0 ? OutlineFamily::Phased : OutlineFamily::Curved;
}

PlacedProbe EncloseRegion(VolumeView<const unsigned char> valid, const ImageGeometry& geometry,
                          const EnclosingFanParameters& parameters, const Progress& progress)
{
  CheckRanges(parameters);
  geometry.Check("the volume");
  if (parameters.shape) {
    parameters.shape->geometry.Check();
    if (!IsRotation(parameters.shape->probeToWorld.linear()) || !parameters.shape->probeToWorld.translation().allFinite())
      throw Error(Error::Kind::BadInput, "enclosing fan: the pose of the shape is not rigid");
  }
  Volume<unsigned char> all;
  if (valid.Empty()) {
    all = Volume<unsigned char>(geometry.dimensions, 1);
    valid = std::as_const(all).View();
  }
  if (valid.Dimensions() != geometry.dimensions)
    throw Error(Error::Kind::BadInput, "enclosing fan: the valid region has other dimensions than the volume");

  const ValidVoxels region = RegionOf(valid, geometry, parameters.marginMm, progress.Part(0.0, 0.2));
  if (parameters.shape && Holds(*parameters.shape, region, region.margin, progress.Part(0.2, 0.3)))
    return *parameters.shape;

  const PlacedProbe base = parameters.shape ? *parameters.shape : FoundFrom(region, progress.Part(0.2, 0.5));
  const bool plane = region.plane && base.geometry.IsPlane();
  const auto isWanted = [&parameters](OutlineFamily family) {
    return parameters.shape ? family == OutlineFamily::Curved
                            : parameters.outline == OutlineFamily::Automatic || parameters.outline == family;
  };
  std::vector<Start> starts;
  if (isWanted(OutlineFamily::Linear)) {
    starts.push_back(BoxStart(base.probeToWorld, region));
    starts.push_back(BoxStart(AlongGrid(base.probeToWorld, geometry), region));
  }
  if (isWanted(OutlineFamily::Phased)) {
    const ProbeArc fan = base.geometry.Fan();
    const double most = 4.0 * region.size;
    starts.push_back(PhasedStart(base.probeToWorld, fan.angle > 0.0 ? std::min(fan.width / fan.angle, most) : most, region));
    starts.push_back(PhasedStart(base.probeToWorld, 0.1 * region.size, region));
  }
  if (isWanted(OutlineFamily::Curved))
    for (const Start& start : CurvedStarts(base, parameters, region))
      starts.push_back(start);
  for (Start& start : starts)
    start.rated.cost = CostOf(start.rated.head, start.least, region);
  ParallelFor(static_cast<std::ptrdiff_t>(starts.size()), progress.Part(0.5, 0.9), [&](std::ptrdiff_t i) {
    auto& [least, rated] = starts[static_cast<std::size_t>(i)];
    rated = Simplex(rated, least, region, plane, 1.0, 600);
    rated = Simplex(rated, least, region, plane, 0.4, 600); // a simplex may have become flat
  });
  if (parameters.outline == OutlineFamily::Automatic)
    starts.erase(std::remove_if(starts.begin(), starts.end(),
                                [&region](const Start& start) {
                                  return start.least.family == OutlineFamily::Phased && !BeginsAtAPoint(start, region);
                                }),
                 starts.end());
  const Start& best = SimplestOf(starts);

  const Measure measure(best.rated.head, best.least, region);
  Extent extent = ExtentOf(measure, region, progress.Part(0.9, 1.0));
  const Head head = Centred(best.rated.head, extent);
  PlacedProbe found{FanOf(head, best.least, extent, plane).first, head.probeToWorld};
  if (!parameters.shape && best.least.family != OutlineFamily::Phased)
    BeginAtNearEdge(found);
  return found;
}

} // namespace echorama
