// SPDX-License-Identifier: BSD-3-Clause
// Four numbers a node and beam, depth fastest, so that neighbours are added up row by row. Costs four multiplications and
// additions per node, neighbour and beam: some hundredths of what the rays cost that are shared.
#include "WideBeams.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Parallel.h"
#include "Interface.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>

namespace echorama {
namespace {

using Eigen::Vector3d;

constexpr double nodesApartMm = 0.5;
constexpr double reachOfNeighbours = 2.5; // standard deviations
constexpr double cornerMm = 0.02;         // what leaves a straight line by less lies on it
constexpr std::ptrdiff_t tracedTogether = 8;

// The ray of a beam's axis turned into one of several over the aperture, which meet at the focus at one time.
RayStart SubRayOf(const RayStart& axis, const Transducer& transducer, RaySamples& samples)
{
  RayStart start = axis;
  const double lateral = (samples.Next() - 0.5) * transducer.lateralApertureMm,
               elevation = (samples.Next() - 0.5) * transducer.elevationApertureMm;
  const Vector3d out = axis.direction.cross(axis.across);
  const Vector3d focus = axis.origin + transducer.lateralFocusMm * axis.direction;
  start.origin += lateral * axis.across + elevation * out;
  const double way = (focus - start.origin).norm();
  start.direction = (focus - start.origin) / way;
  start.across = (axis.across - axis.across.dot(start.direction) * start.direction).normalized();
  start.scanDepth = transducer.lateralFocusMm - way; // the same time at the focus
  return start;
}

// How much a ray from that part of the aperture counts: its apodisation.
double WeightOf(const RayStart& start, const RayStart& axis, const Transducer& transducer)
{
  const Vector3d offset = start.origin - axis.origin;
  const double lateral = offset.dot(axis.across) / (transducer.lateralApertureMm / Transducer::sigmasPerAperture),
               elevation = offset.dot(axis.direction.cross(axis.across)) /
                           (transducer.elevationApertureMm / Transducer::sigmasPerAperture);
  return std::exp(-0.5 * (lateral * lateral + elevation * elevation));
}

void AddProducts(const float* __restrict weight, const float* __restrict value, int count, float* __restrict sum)
{
  for (int i = 0; i < count; ++i)
    sum[i] += weight[i] * value[i];
}

// The points that a chain of straight pieces between the first and the last needs, to cornerMm at the same scan depth.
void MarkCorners(const std::vector<Vector3d>& points, std::size_t first, std::size_t last, std::vector<char>& isCorner)
{
  double farthest = cornerMm * cornerMm;
  std::size_t corner = first;
  const Vector3d step = (points[last] - points[first]) / static_cast<double>(last - first);
  for (std::size_t i = first + 1; i < last; ++i) {
    const double away = (points[i] - points[first] - static_cast<double>(i - first) * step).squaredNorm();
    if (away > farthest) {
      farthest = away;
      corner = i;
    }
  }
  if (corner == first)
    return;
  isCorner[corner] = 1;
  MarkCorners(points, first, corner, isCorner);
  MarkCorners(points, corner, last, isCorner);
}

} // namespace

std::vector<ApertureRay> RaysOf(const SynthesisParameters& p, int element, const RayStart& axis)
{
  std::vector<ApertureRay> rays;
  for (int ray = 0; ray < p.subRays; ++ray) {
    // By element alone, so that one plane has the same rays by itself and within its sweep.
    RaySamples samples(p.sampling, p.seed, static_cast<std::uint64_t>(element), static_cast<std::uint32_t>(ray),
                       static_cast<std::uint32_t>(p.subRays));
    const RayStart start = p.subRays > 1 ? SubRayOf(axis, p.transducer, samples) : axis;
    rays.push_back({start, WeightOf(start, axis, p.transducer), samples});
  }
  return rays;
}

void WideBeams::Weights::Set(const std::vector<double>& sigmas, int elements)
{
  for (int offset = 0; offset < elements; ++offset) {
    std::vector<float> weights;
    bool counts = false;
    for (const double sigma : sigmas) {
      const bool isNear = offset <= reachOfNeighbours * sigma;
      weights.push_back(offset == 0 ? 1.0f : isNear ? static_cast<float>(std::exp(-0.5 * std::pow(offset / sigma, 2))) : 0.0f);
      counts = counts || offset == 0 || isNear;
    }
    if (!counts)
      break;
    byOffset.push_back(std::move(weights));
  }
}

WideBeams::WideBeams(const SynthesisParameters& p) : p_(p), elements_(p.elements), lastDepth_(ConditionsOf(p).maxScanDepth)
{
  nodes_ = static_cast<int>(std::ceil(lastDepth_ / nodesApartMm)) + 1; // two at least
  stepMm_ = lastDepth_ / (nodes_ - 1);
  const RayStart one = AxisOf(p, 0, 0), next = AxisOf(p, 1, 0);
  const double aperture = p.transducer.lateralApertureMm / Transducer::sigmasPerAperture;
  const double perWave = p.transducer.WavelengthMm() / (2.0 * Pi * aperture);
  std::vector<double> here, sinceFace;
  double sum = 0.0;
  for (int node = 0; node < nodes_; ++node) {
    const double depth = DepthOf(node), cone = aperture * (1.0 - depth / p.transducer.lateralFocusMm);
    const double apart = (next.origin + depth * next.direction - one.origin - depth * one.direction).norm();
    const double beams = std::sqrt(cone * cone / p.subRays + std::pow(depth * perWave, 2)) / std::max(apart, 1e-3);
    here.push_back(beams);
    sum += beams * beams;
    sinceFace.push_back(std::sqrt(sum / (node + 1)));
  }
  here_.Set(here, elements_);
  sinceFace_.Set(sinceFace, elements_);
  fields_.assign(static_cast<std::size_t>(elements_) * static_cast<std::size_t>(p.BeamDimensions()[2]) *
                     static_cast<std::size_t>(fieldsPerBeam) * static_cast<std::size_t>(nodes_),
                 0.0f);
  weightOfBeams_.assign(static_cast<std::size_t>(elements_) * static_cast<std::size_t>(p.BeamDimensions()[2]), 0.0);
}

void WideBeams::Add(std::ptrdiff_t beam, const ApertureRay& ray, const SoundPath& path)
{
  weightOfBeams_[static_cast<std::size_t>(beam)] += ray.weight;
  float* const amplitudes = FieldsOf(beam);
  const RayStart& start = ray.start;
  const Vector3d up = start.direction.cross(start.across);
  Vector3d before = Vector3d::Zero();
  int node = 0;
  for (const SoundSegment& segment : path.segments) {
    if (segment.bounces > 0)
      break;
    const double end = segment.scanDepth + segment.length * segment.scanDepthPerMm + 1e-9; // the last node lies at the end of all
    for (; node < nodes_ && DepthOf(node) <= end; ++node) {
      const double along = (DepthOf(node) - segment.scanDepth) / segment.scanDepthPerMm;
      const Vector3d place = segment.from + along * segment.direction;
      const auto amplitude = static_cast<float>(ray.weight * segment.amplitude * std::exp(-segment.attenuation * along));
      amplitudes[node] += amplitude;
      if (node > 0) {
        const Vector3d moved = place - before - stepMm_ * start.direction;
        amplitudes[nodes_ + node] += amplitude * static_cast<float>(moved.dot(start.across));
        amplitudes[2 * nodes_ + node] += amplitude * static_cast<float>(moved.dot(up));
        amplitudes[3 * nodes_ + node] += amplitude * static_cast<float>(moved.dot(start.direction));
      }
      before = place;
    }
  }
}

// Sums a field over the neighbours: at each node by its weights, of that node's numbers or of those of the node \a late before
// it.
void WideBeams::Share(std::ptrdiff_t beam, const Weights& weights, int field, int late, std::vector<float>& sum) const
{
  sum.assign(static_cast<std::size_t>(nodes_), 0.0f);
  const int element = static_cast<int>(beam % elements_);
  const auto add = [&](int offset, std::ptrdiff_t neighbour) {
    AddProducts(weights.byOffset[static_cast<std::size_t>(offset)].data() + late,
                FieldsOf(neighbour) + static_cast<std::ptrdiff_t>(field) * nodes_, nodes_ - late, sum.data() + late);
  };
  add(0, beam);
  for (int offset = 1; offset < static_cast<int>(weights.byOffset.size()); ++offset) {
    if (element >= offset)
      add(offset, beam - offset);
    if (element + offset < elements_)
      add(offset, beam + offset);
  }
}

WideWay WideBeams::Way(std::ptrdiff_t beam) const
{
  const RayStart axis = AxisOf(p_, static_cast<int>(beam % elements_), static_cast<int>(beam / elements_));
  const Vector3d up = axis.direction.cross(axis.across);
  std::vector<float> kept, before, heard, moved[3];
  Share(beam, here_, 0, 0, kept);
  Share(beam, here_, 0, 1, before);
  Share(beam, sinceFace_, 0, 0, heard);
  for (int i = 0; i < 3; ++i)
    Share(beam, sinceFace_, 1 + i, 0, moved[i]);

  const std::ptrdiff_t element = beam % elements_;
  double all = 0.0; // what comes to the face if nothing is in the way
  for (std::ptrdiff_t other = 0; other < elements_; ++other) {
    const auto offset = static_cast<std::size_t>(std::abs(other - element));
    if (offset < here_.byOffset.size())
      all += here_.byOffset[offset][0] * weightOfBeams_[static_cast<std::size_t>(beam - element + other)];
  }

  WideWay way;
  std::vector<Vector3d> points{axis.origin};
  double amplitude = kept[0] / all;
  way.amplitude.push_back(static_cast<float>(amplitude));
  Vector3d step = stepMm_ * axis.direction;
  for (int node = 1; node < nodes_; ++node) {
    const auto i = static_cast<std::size_t>(node);
    amplitude *= before[i] > 0.0f ? std::min(1.0, static_cast<double>(kept[i]) / before[i]) : 0.0;
    way.amplitude.push_back(static_cast<float>(amplitude));
    if (heard[i] > 0.0f)
      step = (stepMm_ + moved[2][i] / heard[i]) * axis.direction +
             (moved[0][i] * axis.across + moved[1][i] * up) / static_cast<double>(heard[i]);
    points.push_back(points.back() + step);
  }

  std::vector<char> isCorner(points.size(), 0);
  MarkCorners(points, 0, points.size() - 1, isCorner);
  isCorner.back() = 1;
  SoundSegment segment;
  segment.direction = axis.direction;
  segment.across = axis.across;
  std::size_t from = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (!isCorner[i])
      continue;
    const Vector3d along = points[i] - points[from];
    segment.from = points[from];
    segment.length = along.norm();
    const Vector3d direction = along / segment.length;
    segment.across = CarriedThroughBend(segment.across, segment.direction, direction);
    segment.direction = direction;
    segment.scanDepth = DepthOf(static_cast<int>(from));
    segment.scanDepthPerMm = (DepthOf(static_cast<int>(i)) - segment.scanDepth) / segment.length;
    way.segments.push_back(segment);
    segment.way += segment.length;
    from = i;
  }
  return way;
}

std::vector<SoundSegment> WideBeams::HeardWay(std::ptrdiff_t beam) const
{
  WideWay way = Way(beam);
  const auto least = static_cast<float>(std::pow(10.0, -0.05 * p_.transport.dynamicRangeDb));
  const auto silent =
      std::find_if(way.amplitude.begin(), way.amplitude.end(), [least](float amplitude) { return !(amplitude > least); });
  const double end = DepthOf(static_cast<int>(silent - way.amplitude.begin()) - 1);
  while (!way.segments.empty() && !(way.segments.back().scanDepth < end))
    way.segments.pop_back();
  if (!way.segments.empty()) {
    SoundSegment& last = way.segments.back();
    last.length = std::min(last.length, (end - last.scanDepth) / last.scanDepthPerMm);
  }
  return way.segments;
}

std::vector<float> WideBeams::AmplitudeAt(const WideWay& way, const DepthAxis& axis) const
{
  std::vector<float> amplitudes;
  for (int i = 0; i < axis.count; ++i) {
    const double place = std::clamp((axis.first + i * axis.step) / stepMm_, 0.0, nodes_ - 1.0);
    const int node = std::min(static_cast<int>(place), nodes_ - 2);
    const auto share = static_cast<float>(place - node);
    const float* const at = way.amplitude.data() + node;
    amplitudes.push_back((1.0f - share) * at[0] + share * at[1]);
  }
  return amplitudes;
}

WideBeams TraceWideBeams(const AcousticScene& scene, const SynthesisParameters& p, const Progress& progress)
{
  SoundTransport direct = p.transport;
  direct.maxBounces = 0;
  const SoundTracer tracer(scene, direct, ConditionsOf(p));
  WideBeams beams(p);
  ParallelRanges(static_cast<std::ptrdiff_t>(p.elements) * p.BeamDimensions()[2], tracedTogether, progress,
                 [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
                   SoundPath path;
                   for (std::ptrdiff_t beam = begin; beam < end; ++beam) {
                     const int element = static_cast<int>(beam % p.elements), step = static_cast<int>(beam / p.elements);
                     for (ApertureRay& ray : RaysOf(p, element, AxisOf(p, element, step))) {
                       ray.start.inside = scene.BodiesAt(ray.start.origin);
                       tracer.Trace(ray.start, path);
                       beams.Add(beam, ray, path);
                     }
                   }
                 });
  return beams;
}

} // namespace echorama
