// SPDX-License-Identifier: BSD-3-Clause
// Each row of the grid goes through three passes over short buffers:
//
// 1. Plan: which samples surround each voxel, as an offset into the beam volume and three fractions. On rows along the
//    array (y, z) are constant, so the plane of the sweep is found once, in double precision, and only the fan's map is
//    left for each voxel. Other rows do both maps per voxel. Both are straight-line float code for the vector units: one
//    square root and two or three divisions per map, the arctangent by a polynomial. Fans that reach behind the sweep axis
//    and single planes on grids that do not follow them are planned by the exact inverse, voxel by voxel.
// 2. Fetch: pairs of neighbouring depth samples from four beams, copied to buffers. This is all the random access.
// 3. Blend: seven linear interpolations, rounding and the mask, for the vector units again.
//
// Rows are walked with z innermost, so that consecutive rows read nearly the same planes of the sweep, which then come
// from the cache. No sum is formed and no operation is contracted, so every build gives the same numbers.
#include "Core/Imaging/ScanConversion.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/VoxelTypes.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

namespace echorama {
namespace {

// How far beyond the first and last sample, beam or step is still inside, in distances between them.
constexpr double edge = 1e-3;

// A straight face is given this bend (radians), which no float can tell, so that one formula serves all.
constexpr double leastBend = 1e-12;

// One bend of the probe, ready for single precision: index = middle + indexPerRadian * angle, of \a count beams from the first
// that is there, of all.
struct FloatArc {
  float curvature, unit; // see ProbeArc::Bend
  float indexPerRadian, middle, last;

  FloatArc(ProbeArc arc, int all, int first, int count, double offset = 0.0)
  {
    if (arc.width > 0.0)
      arc.angle = std::max(arc.angle, leastBend);
    const ProbeArc::Bend bend = arc.GetBend();
    curvature = static_cast<float>(bend.curvature);
    unit = static_cast<float>(bend.unit);
    indexPerRadian = arc.angle > 0.0 ? static_cast<float>((all - 1) / arc.angle) : 0.0f;
    last = static_cast<float>(count - 1);
    middle = static_cast<float>((0.5 - offset) * (all - 1) - first);
  }
};

// The depth samples along a beam: index = (depth - first) * perMm.
struct FloatDepth {
  float first, perMm, last;
};

// Where the voxels of a row read, and whether they are inside (1 or 0).
struct RowPlan {
  explicit RowPlan(int count) : offset(count), inside(count), depth(count), fan(count), sweep(count) {}
  std::vector<int> offset, inside;
  std::vector<float> depth, fan, sweep; // fractions
};

// atan2 for the vector units, to 2e-7: the smaller coordinate over the larger, turned by 45 degrees where that brings it
// below tan(22.5 degrees), then an odd polynomial with least relative error (2e-8).
inline __attribute__((always_inline)) float ArcTangent(float y, float x)
{
  const float ay = std::fabs(y), ax = std::fabs(x);
  const float small = ay < ax ? ay : ax, large = ay < ax ? ax : ay;
  const bool turned = small > 0.41421356f * large;
  const float n = turned ? small - large : small, d = turned ? small + large : large;
  const float t = n / (d > 1e-30f ? d : 1e-30f), z = t * t;
  float a = t + t * z * (-0.3333295525f + z * (0.1997792608f + z * (-0.1387984995f + z * 0.0806030884f)));
  a = turned ? a + 0.78539816f : a;
  a = ay < ax ? a : 1.57079633f - a;
  a = x < 0.0f ? 3.14159265f - a : a;
  return y < 0.0f ? -a : a;
}

inline __attribute__((always_inline)) float Clamped(float index, float last)
{
  index = index > 0.0f ? index : 0.0f; // NaN becomes 0
  return index < last ? index : last;
}

// The sample before a clamped index; the next one exists too.
inline __attribute__((always_inline)) int Before(float clamped, float last)
{
  return static_cast<int>(clamped < last - 1.0f ? clamped : last - 1.0f);
}

inline __attribute__((always_inline)) bool Within(float index, float last)
{
  return (index >= static_cast<float>(-edge)) & (index <= last + static_cast<float>(edge)); // no branch
}

// Pass 1 for a row along the array, in the plane of the sweep that it lies in, at a distance rho from the face there.
void PlanAlongArray(const FloatArc fan, const FloatDepth range, const float x0, const float dx, const float rho,
                    const int samples, const int begin, const int end, int* __restrict offset, int* __restrict inside,
                    float* __restrict depthFraction, float* __restrict fanFraction)
{
  const float b = fan.unit + fan.curvature * rho, bb = b * b, alongMiddle = (fan.unit + b) * rho;
  for (int i = begin; i < end; ++i) {
    const float x = x0 + dx * static_cast<float>(i);
    const float a = fan.curvature * x;
    const float sum = std::sqrt(a * a + bb) + fan.unit;
    const float depth = (a * x + alongMiddle) / (sum > 1e-30f ? sum : 1e-30f);
    const float d = (depth - range.first) * range.perMm;
    const float f = fan.middle + fan.indexPerRadian * ArcTangent(a, b);
    inside[i] = Within(d, range.last) & Within(f, fan.last) ? 1 : 0;
    const float df = Clamped(d, range.last), ff = Clamped(f, fan.last);
    const int id = Before(df, range.last), jf = Before(ff, fan.last);
    offset[i] = jf * samples + id;
    depthFraction[i] = df - static_cast<float>(id);
    fanFraction[i] = ff - static_cast<float>(jf);
  }
}

// Pass 1 for any other row, whose voxels lie at start + step * i in the probe frame: both bends per voxel.
void PlanOblique(const FloatArc fan, const FloatArc sweep, const FloatDepth range, const Eigen::Vector3f& start,
                 const Eigen::Vector3f& step, const int samples, const int planeSamples, const int begin, const int end,
                 int* __restrict offset, int* __restrict inside, float* __restrict depthFraction, float* __restrict fanFraction,
                 float* __restrict sweepFraction)
{
  const float x0 = start[0], y0 = start[1], z0 = start[2], dx = step[0], dy = step[1], dz = step[2];
  for (int i = begin; i < end; ++i) {
    const float n = static_cast<float>(i), x = x0 + dx * n, y = y0 + dy * n, z = z0 + dz * n;
    const float sa = sweep.curvature * y, sb = sweep.unit + sweep.curvature * z;
    const float sweepSum = std::sqrt(sa * sa + sb * sb) + sweep.unit;
    const float rho = (sa * y + (sweep.unit + sb) * z) / (sweepSum > 1e-30f ? sweepSum : 1e-30f);
    const float s = sweep.middle + sweep.indexPerRadian * ArcTangent(sa, sb);
    const float a = fan.curvature * x, b = fan.unit + fan.curvature * rho;
    const float sum = std::sqrt(a * a + b * b) + fan.unit;
    const float depth = (a * x + (fan.unit + b) * rho) / (sum > 1e-30f ? sum : 1e-30f);
    const float d = (depth - range.first) * range.perMm;
    const float f = fan.middle + fan.indexPerRadian * ArcTangent(a, b);
    inside[i] = Within(d, range.last) & Within(f, fan.last) & Within(s, sweep.last) ? 1 : 0;
    const float df = Clamped(d, range.last), ff = Clamped(f, fan.last), sf = Clamped(s, sweep.last);
    const int id = Before(df, range.last), jf = Before(ff, fan.last), ks = Before(sf, sweep.last);
    offset[i] = ks * planeSamples + jf * samples + id;
    depthFraction[i] = df - static_cast<float>(id);
    fanFraction[i] = ff - static_cast<float>(jf);
    sweepFraction[i] = sf - static_cast<float>(ks);
  }
}

template <class T>
struct Pair {
  T first, second;
};

// What the voxels of a row lie between: pairs along depth of this beam and the next, in this plane and the next.
template <class T>
struct RowSamples {
  explicit RowSamples(int count) : here(count), beam(count), plane(count), both(count) {}
  std::vector<Pair<T>> here, beam, plane, both;
};

// Pass 2.
template <class T>
void Fetch(const T* base, std::ptrdiff_t nextBeam, std::ptrdiff_t nextPlane, const RowPlan& plan, int begin, int end,
           RowSamples<T>& samples)
{
  for (int i = begin; i < end; ++i) {
    const T* at = base + plan.offset[i];
    std::memcpy(&samples.here[i], at, sizeof(Pair<T>));
    std::memcpy(&samples.beam[i], at + nextBeam, sizeof(Pair<T>));
    std::memcpy(&samples.plane[i], at + nextPlane, sizeof(Pair<T>));
    std::memcpy(&samples.both[i], at + nextPlane + nextBeam, sizeof(Pair<T>));
  }
}

// Floats hold every value of the integer types exactly, with room for the fraction.
template <class T>
using Real = std::conditional_t<std::is_same_v<T, double>, double, float>;

template <class R>
inline __attribute__((always_inline)) R Mix(R a, R b, R t)
{
  return a + t * (b - a);
}

// The value as a voxel, and whether it is one.
template <class T>
inline __attribute__((always_inline)) T VoxelOf(Real<T> value, int& inside)
{
  if constexpr (std::is_integral_v<T>) {
    // Rounds halves up: a cast rounds towards zero, so signed values are lifted above it.
    constexpr int lift = std::is_signed_v<T> ? 32768 : 0;
    const int rounded = static_cast<int>(value + (0.5f + static_cast<float>(lift))) - lift;
    return static_cast<T>(inside ? rounded : 0);
  } else {
    inside = inside & static_cast<int>(value - value == Real<T>(0)); // neither NaN nor infinite
    return inside ? value : T(0);
  }
}

// Pass 3.
template <class T>
void Blend(const Pair<T>* __restrict here, const Pair<T>* __restrict beam, const Pair<T>* __restrict plane,
           const Pair<T>* __restrict both, const float* __restrict depth, const float* __restrict fan,
           const float* __restrict sweep, const int* __restrict insideRow, int count, T* __restrict intensity,
           unsigned char* __restrict valid)
{
  using R = Real<T>;
  for (int i = 0; i < count; ++i) {
    const R d = depth[i], f = fan[i], s = sweep[i];
    const R a = Mix<R>(here[i].first, here[i].second, d), b = Mix<R>(beam[i].first, beam[i].second, d);
    const R c = Mix<R>(plane[i].first, plane[i].second, d), e = Mix<R>(both[i].first, both[i].second, d);
    int inside = insideRow[i];
    intensity[i] = VoxelOf<T>(Mix(Mix(a, b, f), Mix(c, e, f), s), inside);
    valid[i] = static_cast<unsigned char>(inside);
  }
}

// The box around all samples, in the probe frame. Between these angles each coordinate is monotonic, and it is linear in
// depth, so its extremes are among these points.
Eigen::AlignedBox3d BoxOf(const ProbeGeometry& g)
{
  constexpr double quarter = 1.5707963267948966;
  const auto places = [](double angle, double offset) {
    std::vector<double> along{-0.5, 0.5};
    for (const double turn : {-quarter, 0.0, quarter})
      if (const double place = turn == 0.0 ? -offset : turn / angle - offset; std::abs(place) < 0.5)
        along.push_back(place);
    return along;
  };
  Eigen::AlignedBox3d box;
  for (const double fan : places(g.fanAngle, g.fanOffset))
    for (const double sweep : places(g.sweepAngle, 0.0))
      for (const double depth : {g.depthMin, g.depthMax})
        box.extend(PointOf(g, {depth, fan, sweep}));
  return box;
}

void CheckPose(const Pose& probeToWorld)
{
  if (!IsRotation(probeToWorld.linear()) || !probeToWorld.translation().allFinite())
    throw Error(Error::Kind::BadInput, "scan conversion: the pose of the probe is not rigid");
}

double MeanSpacing(const std::array<int, 3>& n, const ProbeGeometry& g)
{
  const double middle = 0.5 * (g.depthMin + g.depthMax);
  const double depth = (g.depthMax - g.depthMin) / (n[0] - 1), fan = g.Fan().Span(middle) / (n[1] - 1);
  if (g.IsPlane())
    return std::sqrt(depth * fan);
  const double rho = g.Fan().PointOf({g.fanOffset, middle}).y();
  return std::cbrt(depth * fan * std::abs(g.Sweep().Span(rho)) / (n[2] - 1));
}

// The beam volume, the grid and how one lies in the other: all that the rows share.
class Converter {
public:
  Converter(const std::array<int, 3>& beams, const BeamWindow& of, const ProbeGeometry& geometry, const Pose& probeToWorld,
            const ImageGeometry& grid)
    : geometry_(geometry), beams_(beams), of_(of), gridToProbe_(probeToWorld.inverse() * grid.IndexToWorld()),
      fan_(geometry.Fan(), of.all[1], of.first[1], beams[1], geometry.fanOffset),
      sweep_(geometry.Sweep(), of.all[2], of.first[2], beams[2]), box_(BoxOf(geometry)), count_(grid.dimensions[0])
  {
    const double samplesPerMm = (of.all[0] - 1) / (geometry.depthMax - geometry.depthMin);
    range_ = {static_cast<float>(geometry.depthMin + of.first[0] / samplesPerMm), static_cast<float>(samplesPerMm),
              static_cast<float>(beams[0] - 1)};
    const Eigen::Vector3d step = gridToProbe_.linear().col(0);
    alongArray_ = std::hypot(step.y(), step.z()) * count_ <= 1e-6;
    // Half a voxel's extent across a single plane.
    halfVoxel_ = 0.5 * gridToProbe_.linear().row(1).cwiseAbs().sum();
    reachesBehind_ = geometry.ReachesBehindAxis();
    // The outermost beams lie at x = slope * (u + c rho) for fans up to about a half-plane.
    const auto slope = [&geometry](double along, double otherwise) {
      if (geometry.fanAngle < leastBend)
        return geometry.fanWidth * along;
      const double angle = geometry.fanAngle * along;
      return std::abs(angle) < 1.5 ? std::tan(angle) / geometry.Fan().GetBend().curvature : otherwise;
    };
    const double halfFan = 0.5 + edge / (of.all[1] - 1);
    firstSlope_ = slope(geometry.fanOffset - halfFan, firstSlope_);
    lastSlope_ = slope(geometry.fanOffset + halfFan, lastSlope_);
    // The edge as a fraction of the geometry, for the exact inverse.
    tolerance_ = edge * std::min(1.0 / samplesPerMm, MeanSpacing(of.all, geometry)) / geometry.Size();
    // Voxels beyond the samples by less than this are still looked at.
    const double slack = edge * box_.sizes().maxCoeff() + (geometry.IsPlane() ? halfVoxel_ : 0.0);
    box_ = Eigen::AlignedBox3d(box_.min().array() - slack, box_.max().array() + slack);
  }

  // Pass 1 of row (j, k): the voxels [begin, end) that may be inside, and the plane of the sweep that offsets count from.
  void Plan(int j, int k, RowPlan& plan, int& begin, int& end, int& plane) const
  {
    const Eigen::Vector3d start = gridToProbe_ * Eigen::Vector3d(0, j, k), step = gridToProbe_.linear().col(0);
    plane = 0;
    Clip(start, step, begin, end);
    if (begin >= end)
      return;
    if (alongArray_)
      PlanStraight(start, step, plan, begin, end, plane);
    else if (reachesBehind_ || geometry_.IsPlane())
      PlanExactly(start, step, plan, begin, end);
    else
      PlanOblique(fan_, sweep_, range_, start.cast<float>(), step.cast<float>(), beams_[0], beams_[0] * beams_[1], begin, end,
                  plan.offset.data(), plan.inside.data(), plan.depth.data(), plan.fan.data(), plan.sweep.data());
  }

  std::ptrdiff_t PlaneSamples() const { return static_cast<std::ptrdiff_t>(beams_[0]) * beams_[1]; }

private:
  // The part of a row inside the box around the fan.
  void Clip(const Eigen::Vector3d& start, const Eigen::Vector3d& step, int& begin, int& end) const
  {
    double from = 0.0, to = count_ - 1.0;
    for (int axis = 0; axis < 3; ++axis) {
      double low = (box_.min()[axis] - start[axis]) / step[axis], high = (box_.max()[axis] - start[axis]) / step[axis];
      if (std::abs(step[axis]) * count_ < 1e-9) { // parallel
        if (start[axis] < box_.min()[axis] || start[axis] > box_.max()[axis])
          to = -1.0;
        continue;
      }
      if (low > high)
        std::swap(low, high);
      from = std::max(from, std::ceil(low));
      to = std::min(to, std::floor(high));
    }
    begin = from <= to ? static_cast<int>(from) : 0;
    end = from <= to ? static_cast<int>(to) + 1 : 0;
  }

  void PlanStraight(const Eigen::Vector3d& start, const Eigen::Vector3d& step, RowPlan& plan, int& begin, int& end,
                    int& plane) const
  {
    const ProbeArc sweep = geometry_.Sweep();
    const int last = beams_[2] - 1;
    ProbeArc::Place place = sweep.PlaceOf(start.y(), start.z());
    double index = 0.0;
    if (geometry_.IsPlane()) {
      if (std::abs(start.y()) > halfVoxel_)
        end = begin;
    } else {
      const auto outside = [this, last, &index](const ProbeArc::Place& p) {
        index = (p.along + 0.5) * (of_.all[2] - 1) - of_.first[2];
        return !(index >= -edge && index <= last + edge);
      };
      if (outside(place)) {
        place = sweep.PlaceOf(start.y(), start.z(), true);
        if (!reachesBehind_ || outside(place))
          end = begin;
      }
    }
    // Only a part of the row lies above the last samples and between the outermost beams.
    const auto [c, u] = geometry_.Fan().GetBend();
    const double rho = place.depth, b = u + c * rho;
    const double deepest = geometry_.depthMax + edge / range_.perMm;
    constexpr double infinity = std::numeric_limits<double>::infinity();
    double from = b > 0.0 ? firstSlope_ * b : -infinity, to = b > 0.0 ? lastSlope_ * b : infinity;
    if (c > 0.0) {
      const double reach = std::sqrt(std::max(0.0, (deepest - rho) * (2.0 * u + c * (deepest + rho)) / c));
      from = std::max(from, -reach);
      to = std::min(to, reach);
    }
    from = (from - 1e-3 - start.x()) / step.x();
    to = (to + 1e-3 - start.x()) / step.x();
    begin = static_cast<int>(std::max<double>(begin, std::ceil(std::min(from, to))));
    end = static_cast<int>(std::min<double>(end, std::floor(std::max(from, to)) + 1.0));
    if (begin >= end) {
      begin = end = 0;
      return;
    }
    index = std::min(std::max(index, 0.0), static_cast<double>(last));
    plane = std::min(static_cast<int>(index), std::max(last - 1, 0));
    std::fill(plan.sweep.begin() + begin, plan.sweep.begin() + end, static_cast<float>(index - plane));
    PlanAlongArray(fan_, range_, static_cast<float>(start.x()), static_cast<float>(step.x()), static_cast<float>(rho), beams_[0],
                   begin, end, plan.offset.data(), plan.inside.data(), plan.depth.data(), plan.fan.data());
  }

  void PlanExactly(const Eigen::Vector3d& start, const Eigen::Vector3d& step, RowPlan& plan, int begin, int end) const
  {
    for (int i = begin; i < end; ++i) {
      Eigen::Vector3d point = start + step * i;
      if (geometry_.IsPlane() && std::abs(point.y()) <= halfVoxel_)
        point.y() = 0.0;
      const auto beam = BeamPointAt(geometry_, point, tolerance_);
      const auto split = [this, &plan, i](double share, std::size_t axis, float& fraction) {
        const double index = share * (of_.all[axis] - 1) - of_.first[axis];
        plan.inside[i] =
            plan.inside[i] && index > -0.5 && index < beams_[axis] - 0.5; // of a part; what is inside of all is known
        const int before = std::max(0, std::min(static_cast<int>(index), beams_[axis] - 2));
        fraction = static_cast<float>(index - before);
        return before;
      };
      plan.inside[i] = beam ? 1 : 0;
      plan.offset[i] = 0;
      plan.depth[i] = plan.fan[i] = plan.sweep[i] = 0.0f;
      if (beam)
        plan.offset[i] =
            beams_[0] * (beams_[1] * split(beam->sweep + 0.5, 2, plan.sweep[i]) + split(beam->fan + 0.5, 1, plan.fan[i])) +
            split((beam->depth - geometry_.depthMin) / (geometry_.depthMax - geometry_.depthMin), 0, plan.depth[i]);
    }
  }

  ProbeGeometry geometry_;
  std::array<int, 3> beams_;
  BeamWindow of_;
  Eigen::Affine3d gridToProbe_;
  FloatArc fan_, sweep_;
  FloatDepth range_{};
  Eigen::AlignedBox3d box_;
  int count_;
  bool alongArray_ = false, reachesBehind_ = false;
  double halfVoxel_ = 0.0, tolerance_ = 0.0;
  double firstSlope_ = -std::numeric_limits<double>::infinity(), lastSlope_ = std::numeric_limits<double>::infinity();
};

} // namespace

void CheckBeamVolume(const std::array<int, 3>& n, const ProbeGeometry& geometry)
{
  geometry.Check();
  const auto fail = [](const std::string& reason) { throw Error(Error::Kind::BadInput, "beam volume: " + reason); };
  if (n[0] < 2 || n[1] < 2 || n[2] < 1)
    fail("it has " + std::to_string(n[0]) + " samples along a beam, " + std::to_string(n[1]) + " beams and " +
         std::to_string(n[2]) + " steps; at least 2, 2 and 1 are needed");
  if (geometry.IsPlane() && n[2] != 1)
    fail("it has " + std::to_string(n[2]) + " steps, but its probe geometry does not sweep");
  if (!geometry.IsPlane() && n[2] == 1)
    fail("it has a single step, but its probe geometry sweeps");
  if (static_cast<double>(n[0]) * n[1] * n[2] > std::numeric_limits<int>::max())
    throw Error(Error::Kind::TooLarge, "beam volume: it has more than 2^31 - 1 samples");
}

double SampleSpacing(const std::array<int, 3>& n, const ProbeGeometry& g)
{
  CheckBeamVolume(n, g);
  return MeanSpacing(n, g);
}

ImageGeometry ScanConversionGrid(const ProbeGeometry& geometry, const Pose& probeToWorld, double spacingMm, std::size_t maxVoxels)
{
  geometry.Check();
  CheckPose(probeToWorld);
  if (!(spacingMm > 0.0) || !std::isfinite(spacingMm))
    throw Error(Error::Kind::InvalidParameter, "scan conversion: the spacing must be positive");
  const Eigen::AlignedBox3d box = BoxOf(geometry);
  ImageGeometry grid;
  grid.spacing.setConstant(spacingMm);
  Eigen::Vector3d cells;
  for (int axis = 0; axis < 3; ++axis) // with a thousandth of a voxel of slack, so that rounding adds no empty layer
    cells[axis] = std::max(0.0, std::ceil(box.sizes()[axis] / spacingMm - 1e-3));
  const double voxels = (cells.array() + 1.0).prod();
  if (!(voxels <= static_cast<double>(maxVoxels)) || !(cells.maxCoeff() < std::numeric_limits<int>::max()))
    throw Error(Error::Kind::TooLarge, "scan conversion: a grid of " + std::to_string(spacingMm) + " mm would have " +
                                           std::to_string(voxels * 1e-6) + " million voxels, more than the " +
                                           std::to_string(static_cast<double>(maxVoxels) * 1e-6) +
                                           " million that are allowed; choose a larger spacing");
  grid.origin = box.center() - 0.5 * spacingMm * cells;
  const Eigen::Vector3i size = cells.cast<int>() + Eigen::Vector3i::Ones();
  grid.dimensions = {size[0], size[1], size[2]};
  if (geometry.IsPlane()) {
    grid.dimensions = {size[0], size[2], 1};
    grid.direction << 1, 0, 0, 0, 0, -1, 0, 1, 0; // index axes along x, z, -y
  }
  return grid.Moved(probeToWorld);
}

template <class T>
void ScanConvert(VolumeView<const T> beams, const ProbeGeometry& geometry, const Pose& probeToWorld, const ImageGeometry& grid,
                 VolumeView<T> intensity, VolumeView<unsigned char> valid, const Progress& progress, const BeamWindow* window)
{
  const BeamWindow of = window ? *window : BeamWindow{beams.Dimensions(), {0, 0, 0}};
  CheckBeamVolume(beams.Dimensions(), geometry);
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (of.first[axis] < 0 || of.first[axis] > of.all[axis] - beams.Dimensions()[axis])
      throw Error(Error::Kind::BadInput, "scan conversion: the beams are not among those that there are in all");
  grid.Check("the grid of the scan conversion");
  CheckPose(probeToWorld);
  if (intensity.Dimensions() != grid.dimensions || valid.Dimensions() != grid.dimensions)
    throw Error(Error::Kind::BadInput, "scan conversion: the output does not have the dimensions of its grid");

  const Converter converter(beams.Dimensions(), of, geometry, probeToWorld, grid);
  const int count = grid.dimensions[0], slices = grid.dimensions[2];
  const std::ptrdiff_t rows = static_cast<std::ptrdiff_t>(grid.dimensions[1]) * slices;
  const std::ptrdiff_t nextPlane = beams.Slices() > 1 ? converter.PlaneSamples() : 0;
  ParallelRanges(rows, 64, progress, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
    RowPlan plan(count);
    RowSamples<T> samples(count);
    for (std::ptrdiff_t row = first; row < last; ++row) {
      const int j = static_cast<int>(row / slices), k = static_cast<int>(row % slices);
      int begin = 0, end = 0, plane = 0;
      converter.Plan(j, k, plan, begin, end, plane);
      T* out = intensity.Row(j, k);
      unsigned char* mask = valid.Row(j, k);
      std::fill(out, out + begin, T(0));
      std::fill(out + end, out + count, T(0));
      std::fill(mask, mask + begin, static_cast<unsigned char>(0));
      std::fill(mask + end, mask + count, static_cast<unsigned char>(0));
      Fetch(beams.Data() + plane * converter.PlaneSamples(), beams.RowStride(), nextPlane, plan, begin, end, samples);
      Blend(samples.here.data() + begin, samples.beam.data() + begin, samples.plane.data() + begin, samples.both.data() + begin,
            plan.depth.data() + begin, plan.fan.data() + begin, plan.sweep.data() + begin, plan.inside.data() + begin,
            end - begin, out + begin, mask + begin);
    }
  });
}

#define EchoramaInstantiate(T)                                                                                                   \
  template void ScanConvert<T>(VolumeView<const T>, const ProbeGeometry&, const Pose&, const ImageGeometry&, VolumeView<T>,      \
                               VolumeView<unsigned char>, const Progress&, const BeamWindow*);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
