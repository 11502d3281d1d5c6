// SPDX-License-Identifier: BSD-3-Clause
// Three passes over the beams, each a parallel loop whose items know nothing of each other:
//
// 1. Rays. The ways of sound of every beam are kept (some 170 bytes a straight piece), because the second pass has to know
//    where sound goes before the third can begin. Where a beam has several rays, what its third pass needs is worked out at
//    once and the rest is dropped.
// 2. Scatterers, only in cells of space that a beam passes.
// 3. Echoes: each beam adds up its own row of samples.
//
// With several rays a beam, the mean amplitude of the direct way is a function of depth; it multiplies the row of the
// direct way, which is summed with amplitude 1. That is right to the length of a pulse, and costs one sum instead of many.
#include "Synthesize.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/ParameterJson.h"
#include "EchoSum.h"
#include "Scatterers.h"
#include "VisitedSpace.h"
#include "WideBeams.h"
#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <limits>

namespace echorama {
namespace {

using Complex = std::complex<float>;
using Eigen::Vector3d;

constexpr double maxSamples = 536870912.0; // 2^29: 4 GiB of baseband
constexpr double visitedCellMm = 4.0;
constexpr std::ptrdiff_t beamsPerRange = 8;
constexpr double samplesPerPulse = 1.25; // of its standard deviation: steps of 0.8

class Stopwatch {
public:
  explicit Stopwatch(double* seconds) : seconds_(seconds), start_(std::chrono::steady_clock::now()) {}
  ~Stopwatch()
  {
    if (seconds_)
      *seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

private:
  double* seconds_;
  std::chrono::steady_clock::time_point start_;
};

// What the third pass needs of a beam.
struct BeamWays {
  struct Lobe {
    std::vector<SoundSegment> segments;
    std::vector<SurfaceEcho> echoes;
  };
  std::vector<SoundSegment> segments;
  std::vector<SurfaceEcho> echoes;
  std::vector<Lobe> lobes;            // beside the main one
  std::vector<float> directAmplitude; // by depth sample, when several rays were averaged; the direct segments are then bare
};

std::size_t BytesOf(const BeamWays& ways)
{
  std::size_t bytes = ways.segments.capacity() * sizeof(SoundSegment) + ways.echoes.capacity() * sizeof(SurfaceEcho) +
                      ways.directAmplitude.capacity() * sizeof(float);
  for (const BeamWays::Lobe& lobe : ways.lobes)
    bytes += lobe.segments.capacity() * sizeof(SoundSegment) + lobe.echoes.capacity() * sizeof(SurfaceEcho);
  return bytes;
}

// Adds the amplitude of the direct way to a function of depth.
void AddDirect(const SoundPath& path, double weight, const DepthAxis& axis, std::vector<float>& amplitude)
{
  for (const SoundSegment& segment : path.segments) {
    if (segment.bounces > 0)
      continue;
    const double perSample = axis.step / segment.scanDepthPerMm; // mm of length
    const double first = (segment.scanDepth - axis.first) / axis.step, last = first + segment.length / perSample;
    for (auto i = static_cast<int>(std::max(std::ceil(first), 0.0)); i < axis.count && i < last; ++i)
      amplitude[static_cast<std::size_t>(i)] +=
          static_cast<float>(weight * segment.amplitude * std::exp(-segment.attenuation * (i - first) * perSample));
  }
}

class Beams {
public:
  Beams(const AcousticScene& scene, const SynthesisParameters& p)
    : scene_(scene), p_(p), n_(p.BeamDimensions()), axis_(InternalAxis(p)), tracer_(scene, p.transport, ConditionsOf(p)),
      lobes_(LobesOf(p.lobes, p.transducer)), brightestDb_(Material::clearDb),
      leastDb_(-p.receiver.dynamicRangeDb * p.receiver.referenceGrey / 255.0 - p.invisibleDb)
  {
    for (const Material& material : scene.Materials())
      brightestDb_ = std::max(brightestDb_, material.backscatterDb);
    double gain = std::max(p.receiver.GainDbAt(p.probe.depthMin), p.receiver.GainDbAt(p.probe.depthMax));
    for (const Receiver::GainPoint& point : p.receiver.tgcPoints)
      gain = std::max(gain, p.receiver.GainDbAt(point.depthMm));
    const double hidden = std::max(leastDb_ - gain, p.receiver.noiseDb - p.invisibleDb);
    leastEcho_ = std::pow(10.0, 0.05 * (hidden - p.mirrorDb));
  }

  static DepthAxis InternalAxis(const SynthesisParameters& p)
  {
    const double range = p.probe.depthMax - p.probe.depthMin, step = range / (p.samples - 1);
    const double finer = std::max(1.0, std::ceil(step * samplesPerPulse / p.transducer.PulseSigmaMm() - 1e-9));
    return {p.probe.depthMin, step / finer, static_cast<int>(std::min((p.samples - 1) * finer + 1.0, 1e9))};
  }

  const DepthAxis& Axis() const { return axis_; }
  std::ptrdiff_t Count() const { return static_cast<std::ptrdiff_t>(n_[1]) * n_[2]; }

  // \param wide takes what the rays tell of the direct way, if there is one
  BeamWays Trace(std::ptrdiff_t beam, WideBeams* wide, std::int64_t& rays) const
  {
    RayStart axis = AxisOf(p_, static_cast<int>(beam % n_[1]), static_cast<int>(beam / n_[1]));
    axis.inside = scene_.BodiesAt(axis.origin);
    SoundPath path;
    BeamWays ways;
    RaySamples ofAxis(Sampling::Random, p_.seed, static_cast<std::uint64_t>(beam % n_[1]), 0, 1); // however many rays there are
    tracer_.Trace(axis, path, &ofAxis);
    rays += path.rays;
    TraceLobes(axis, static_cast<std::uint64_t>(beam % n_[1]), ways, rays);
    const bool alone = p_.subRays == 1;
    if (!alone)
      MakeBare(axis, path.segments);
    std::copy_if(path.segments.begin(), path.segments.end(), std::back_inserter(ways.segments),
                 [&](const SoundSegment& segment) { return (segment.bounces == 0 && !alone) || IsVisible(segment); });
    ways.segments.shrink_to_fit();
    if (alone) {
      if (wide)
        wide->Add(beam, {axis, 1.0, ofAxis}, path);
      ways.echoes = path.echoes;
      return ways;
    }

    ways.directAmplitude.assign(static_cast<std::size_t>(axis_.count), 0.0f);
    std::vector<ApertureRay> all = RaysOf(p_, static_cast<int>(beam % n_[1]), axis);
    double sum = 0.0;
    for (const ApertureRay& ray : all)
      sum += ray.weight;
    for (ApertureRay& ray : all) {
      ray.start.inside = scene_.BodiesAt(ray.start.origin);
      ray.start.leastReflected = leastEcho_ * sum / ray.weight;
      tracer_.Trace(ray.start, path, &ray.samples);
      rays += path.rays;
      if (wide)
        wide->Add(beam, ray, path);
      else
        AddDirect(path, ray.weight, axis_, ways.directAmplitude);
      for (SurfaceEcho echo : path.echoes) {
        echo.amplitude *= ray.weight;
        ways.echoes.push_back(echo);
      }
    }
    for (SurfaceEcho& echo : ways.echoes)
      echo.amplitude /= sum;
    for (float& amplitude : ways.directAmplitude)
      amplitude /= static_cast<float>(sum);
    return ways;
  }

  // The direct way becomes that of the beam as a whole.
  void Widen(std::ptrdiff_t beam, const WideBeams& wide, BeamWays& ways) const
  {
    WideWay way = wide.Way(beam);
    ways.directAmplitude = wide.AmplitudeAt(way, axis_);
    std::copy_if(ways.segments.begin(), ways.segments.end(), std::back_inserter(way.segments),
                 [](const SoundSegment& segment) { return segment.bounces > 0; });
    ways.segments = std::move(way.segments);
    ways.segments.shrink_to_fit();
  }

  // Gives the direct way amplitude 1, and lets it go straight on from where it ends: rays beside it may get further.
  void MakeBare(const RayStart& start, std::vector<SoundSegment>& segments) const
  {
    const auto end =
        std::find_if(segments.begin(), segments.end(), [](const SoundSegment& segment) { return segment.bounces > 0; });
    SoundSegment on;
    on.from = start.origin;
    on.direction = start.direction;
    on.across = start.across;
    if (end != segments.begin()) {
      on = *(end - 1);
      on.from += on.length * on.direction;
      on.way += on.length;
      on.scanDepth += on.length * on.scanDepthPerMm;
    }
    on.length = (ConditionsOf(p_).maxScanDepth - on.scanDepth) / on.scanDepthPerMm;
    for (auto segment = segments.begin(); segment != end; ++segment) {
      segment->amplitude = 1.0;
      segment->attenuation = 0.0;
    }
    on.amplitude = 1.0;
    on.attenuation = 0.0;
    if (on.length > 0.0)
      segments.insert(end, on);
  }

  const std::vector<BeamLobe>& Lobes() const { return lobes_; }

  // Of the main lobe, and of each other.
  std::vector<EchoSum> Summers(const Scatterers& scatterers) const
  {
    std::vector<EchoSum> sums;
    sums.emplace_back(scatterers, p_.transducer, axis_);
    for (const BeamLobe& lobe : lobes_)
      sums.emplace_back(scatterers, lobe.transducer, axis_);
    return sums;
  }

  void Sum(const BeamWays& ways, std::vector<EchoSum>& sums, Complex* row) const
  {
    EchoSum& echoes = sums.front();
    // The direct way comes first.
    auto segment = ways.segments.begin();
    for (; segment != ways.segments.end() && segment->bounces == 0; ++segment)
      echoes.Add(*segment);
    if (!ways.directAmplitude.empty()) {
      echoes.MoveTo(row);
      for (std::size_t i = 0; i < ways.directAmplitude.size(); ++i)
        row[i] *= ways.directAmplitude[i];
    }
    for (; segment != ways.segments.end(); ++segment)
      echoes.Add(*segment);
    echoes.MoveTo(row);
    const double mirror = std::pow(10.0, p_.mirrorDb / 20.0);
    for (const SurfaceEcho& echo : ways.echoes)
      AddSurfaceEcho(echo, p_.transducer, axis_, row, mirror);
    for (std::size_t i = 0; i < ways.lobes.size(); ++i) {
      for (const SoundSegment& each : ways.lobes[i].segments)
        sums[i + 1].Add(each);
      sums[i + 1].MoveTo(row);
      for (const SurfaceEcho& echo : ways.lobes[i].echoes)
        AddSurfaceEcho(echo, lobes_[i].transducer, axis_, row, mirror);
    }
  }

private:
  // One ray of every lobe. An EchoSum's speckle is as loud whatever the beam's width and its pulse's length; that of a lobe shall
  // be as loud as its pattern, its width and its length beside those of the main lobe make it.
  void TraceLobes(const RayStart& axis, std::uint64_t element, BeamWays& ways, std::int64_t& rays) const
  {
    SoundPath path;
    for (std::size_t i = 0; i < lobes_.size(); ++i) {
      const BeamLobe& lobe = lobes_[i];
      RayStart start = axis;
      const double cosine = std::sqrt(1.0 - lobe.sine * lobe.sine);
      start.direction = cosine * axis.direction + lobe.sine * axis.across;
      start.across = cosine * axis.across - lobe.sine * axis.direction;
      start.amplitude = lobe.amplitude;
      RaySamples samples(Sampling::Random, p_.seed, element, static_cast<std::uint32_t>(i + 1),
                         static_cast<std::uint32_t>(lobes_.size() + 1));
      tracer_.Trace(start, path, &samples);
      rays += path.rays;
      BeamWays::Lobe& of = ways.lobes.emplace_back();
      of.echoes = path.echoes;
      const double longer = lobe.transducer.PulseSigmaMm() / p_.transducer.PulseSigmaMm();
      for (SoundSegment segment : path.segments) {
        const double way = segment.way + 0.5 * segment.length;
        segment.amplitude *=
            std::sqrt(longer * WidthAt(lobe.transducer, way).lateralSigma / WidthAt(p_.transducer, way).lateralSigma);
        if (IsVisible(segment))
          of.segments.push_back(segment);
      }
      of.segments.shrink_to_fit();
    }
  }

  // Whether the speckle of the brightest material would show. Amplitude and gain change by constant numbers of dB per mm
  // between the points of the gain, so one of those or an end is the brightest place.
  bool IsVisible(const SoundSegment& segment) const
  {
    const auto isVisibleAt = [&](double scanDepth) {
      const double along = (scanDepth - segment.scanDepth) / segment.scanDepthPerMm;
      const double db = 8.685889638065035 * (std::log(std::abs(segment.amplitude)) - segment.attenuation * along);
      return db + brightestDb_ + p_.receiver.GainDbAt(scanDepth) >= leastDb_;
    };
    const double end = segment.scanDepth + segment.length * segment.scanDepthPerMm;
    const auto& points = p_.receiver.tgcPoints;
    return isVisibleAt(segment.scanDepth) || isVisibleAt(end) ||
           std::any_of(points.begin(), points.end(), [&](const auto& point) {
             return point.depthMm > segment.scanDepth && point.depthMm < end && isVisibleAt(point.depthMm);
           });
  }

  const AcousticScene& scene_;
  const SynthesisParameters& p_;
  std::array<int, 3> n_;
  DepthAxis axis_;
  SoundTracer tracer_;
  std::vector<BeamLobe> lobes_;
  double brightestDb_; // of all materials
  double leastDb_;     // below this nothing shows
  double leastEcho_;   // amplitude of which a perfect mirror's echo is hidden: in the noise, or below black after all gain
};

// How far from a way of sound scatterers are heard, mm.
double Reach(const SoundSegment& segment, const Transducer& transducer)
{
  const BeamWidth from = WidthAt(transducer, segment.way), to = WidthAt(transducer, segment.way + segment.length);
  return beamReach * std::max({from.lateralSigma, from.elevationSigma, to.lateralSigma, to.elevationSigma});
}

VisitedSpace SpaceOf(const std::vector<BeamWays>& beams, const Transducer& transducer, const std::vector<BeamLobe>& lobes,
                     const Progress& progress)
{
  const auto eachOf = [&](const BeamWays& ways, const auto& visit) {
    for (const SoundSegment& segment : ways.segments)
      visit(segment, Reach(segment, transducer));
    for (std::size_t i = 0; i < ways.lobes.size(); ++i)
      for (const SoundSegment& segment : ways.lobes[i].segments)
        visit(segment, Reach(segment, lobes[i].transducer));
  };
  Eigen::AlignedBox3d box;
  double reach = 0.0;
  for (const BeamWays& ways : beams)
    eachOf(ways, [&](const SoundSegment& segment, double itsReach) {
      box.extend(segment.from);
      box.extend(segment.from + segment.length * segment.direction);
      reach = std::max(reach, itsReach);
    });
  if (!box.isEmpty()) {
    box.min().array() -= reach;
    box.max().array() += reach;
  }
  VisitedSpace space(box, visitedCellMm);
  ParallelRanges(static_cast<std::ptrdiff_t>(beams.size()), beamsPerRange, progress,
                 [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
                   for (std::ptrdiff_t beam = begin; beam < end; ++beam)
                     eachOf(beams[static_cast<std::size_t>(beam)], [&](const SoundSegment& segment, double itsReach) {
                       space.MarkLine(segment.from, segment.direction, segment.length, itsReach);
                     });
                 });
  return space;
}

} // namespace

Receiver SynthesisParameters::DefaultReceiver()
{
  Receiver receiver;
  receiver.tgcDbPerCm = 3.5;
  receiver.noiseDb = -65.0;
  return receiver;
}

double SynthesisParameters::ScatterersPerMm3() const
{
  if (scatterersPerMm3 > 0.0)
    return scatterersPerMm3;
  const double cell = WidthAt(transducer, transducer.lateralFocusMm).ResolutionCellMm3(transducer.PulseSigmaMm());
  return std::min(scatterersPerCell / cell, 1000.0);
}

std::array<int, 3> SynthesisParameters::BeamDimensions() const
{
  return {samples, elements, probe.IsPlane() ? 1 : steps};
}

BeamPoint BeamOf(const SynthesisParameters& p, int element, int step)
{
  const auto n = p.BeamDimensions();
  BeamPoint at;
  at.fan = static_cast<double>(element) / (n[1] - 1) - 0.5;
  at.sweep = n[2] > 1 ? static_cast<double>(step) / (n[2] - 1) - 0.5 : 0.0;
  return at;
}

RayStart AxisOf(const SynthesisParameters& p, int element, int step)
{
  const BeamPoint at = BeamOf(p, element, step);
  const Pose& pose = p.stepPoses.empty() ? p.probeToWorld : p.stepPoses[static_cast<std::size_t>(step)];
  const Vector3d direction = DirectionOf(p.probe, at);
  const double turn = p.probe.sweepAngle * at.sweep;
  const Vector3d outOfPlane(0.0, std::cos(turn), -std::sin(turn));
  RayStart axis;
  axis.origin = pose * PointOf(p.probe, at);
  axis.direction = pose.linear() * direction;
  axis.across = pose.linear() * outOfPlane.cross(direction).normalized();
  return axis;
}

SoundConditions ConditionsOf(const SynthesisParameters& p)
{
  return {p.transducer.frequencyMHz, p.transducer.assumedSoundSpeed, p.probe.depthMax + 4.0 * p.transducer.PulseSigmaMm()};
}

ParameterList Describe(EchoModel& m)
{
  return Join({{Parameter("Mode", Choice(m.mode, {"coherent", "counting"}),
                          "Coherent: the echoes of scatterers are summed with their phases. Counting: random scatter events of "
                          "rays are counted (dissertation 3.4).")},
               Describe(m.transport),
               Describe(m.lobes),
               {Parameter("SubRays", m.subRays, {1, 4096}, "",
                          "Rays of an element, spread over its aperture. 1: the axis alone, fast and hard-edged.")
                    .Advanced(),
                Parameter("Sampling", Choice(m.sampling, SamplingNames), "How the rays of an element are spread.").Advanced(),
                Parameter("WideBeams", m.wideBeams,
                          "Whether a beam is bent and shaded as a whole, by the mean of its rays and of those of its neighbours "
                          "within its width; off: bent along its axis alone. Used when Mode is coherent."),
                Parameter("MirrorDb", m.mirrorDb, {0, 120}, "dB",
                          "Level of the echo of a perfect mirror, square to the beam, beside the mean speckle of the reference "
                          "tissue.")
                    .Advanced()}});
}

ParameterList Describe(SynthesisParameters& p)
{
  return Join(
      {{Parameter(
            "Seed", p.seed, {0, 9223372036854775807.0}, "",
            "Seed of the scatterers of the tissue, and of all else that is random but the noise. Volumes of one seed see the "
            "same."),
        Parameter(
            "Decorrelation", p.decorrelation, {0, 1}, "",
            "How far the speckle has changed: complex echoes of volumes of one Seed and different ChangeSeeds that are seen "
            "alike correlate by 1 less this. Bodies stay where and as loud as they are.")
            .When("Mode", "coherent"),
        Parameter("ChangeSeed", p.changeSeed, {0, 9223372036854775807.0}, "",
                  "Seed of the change: volumes with the same one have changed alike.")
            .When("Mode", "coherent"),
        Parameter("Elements", p.elements, {2, 4096}, "", "Beams of a plane."),
        Parameter("Steps", p.steps, {1, 4096}, "", "Planes of the sweep, at least 2 of a probe that sweeps."),
        Parameter("Samples", p.samples, {2, 16384}, "", "Samples along a beam.")},
       Describe(p.transducer),
       Describe(p.receiver),
       Without(Describe(static_cast<EchoModel&>(p)), {"DynamicRangeDb"}),
       {Parameter(
            "ScatterersPerMm3", p.scatterersPerMm3, {0, 1000}, "per mm^3",
            "The most scatterers that are made of any material; fewer are faster. 0: " +
                NumberText(SynthesisParameters::scatterersPerCell) +
                " in every resolution cell at the transmit focus. Volumes share their speckle when they have the same number.")
            .Advanced(),
        Parameter("InvisibleDb", p.invisibleDb, {0, 300}, "dB",
                  "Ways of sound whose speckle would stay this far below black, after all gain, are not summed.")
            .Advanced()},
       Without(Describe(p.counting), {"AssumedSoundSpeed", "Sampling", "Seed"})});
}

void SynthesisParameters::Check() const
{
  CheckRanges(*this);
  CheckRanges(transport);
  CheckRanges(counting);
  receiver.Check();
  if (mode == Mode::Counting && !stepPoses.empty())
    throw Error(Error::Kind::InvalidParameter, "stepPoses: events are counted for a probe at rest alone");
  if (!probe.IsPlane() && steps < 2)
    throw Error(Error::Kind::InvalidParameter, "Steps is " + std::to_string(steps) + "; a probe that sweeps needs at least 2");
  probe.Check();
  const auto checkPose = [](const Pose& pose, const std::string& name) {
    if (!IsRotation(pose.linear()) || !(pose.translation().array().abs() <= 1e6).all()) // maxCoeff may pass over NaN
      throw Error(Error::Kind::InvalidParameter, name + " is not a rigid transform of at most 1e6 mm");
  };
  checkPose(probeToWorld, "probeToWorld");
  for (std::size_t i = 0; i < stepPoses.size(); ++i)
    checkPose(stepPoses[i], "stepPoses[" + std::to_string(i) + "]");
  const auto planes = static_cast<std::size_t>(BeamDimensions()[2]);
  if (firstStep < 0 || lastStep < -1 || firstStep > LastStep() || LastStep() >= BeamDimensions()[2])
    throw Error(Error::Kind::InvalidParameter, "the steps " + std::to_string(firstStep) + " to " + std::to_string(lastStep) +
                                                   " are not among the " + std::to_string(planes) + " of the sweep");
  if (!stepPoses.empty() && stepPoses.size() != planes)
    throw Error(Error::Kind::InvalidParameter, "stepPoses has " + std::to_string(stepPoses.size()) + " poses for " +
                                                   std::to_string(planes) + " steps of the sweep");
}

SynthesisCost& SynthesisCost::operator+=(const SynthesisCost& other)
{
  raysSeconds += other.raysSeconds;
  scatterersSeconds += other.scatterersSeconds;
  echoesSeconds += other.echoesSeconds;
  detectionSeconds += other.detectionSeconds;
  rays += other.rays;
  segments += other.segments;
  surfaceEchoes += other.surfaceEchoes;
  scatterers += other.scatterers;
  bytes = std::max(bytes, other.bytes);
  return *this;
}

BeamEchoes SynthesizeEchoes(const AcousticScene& scene, const SynthesisParameters& p, const Progress& progress,
                            SynthesisCost* cost, ScattererCache* cache)
{
  p.Check();
  SynthesisCost spent;
  const Beams beams(scene, p);
  const auto n = p.BeamDimensions();
  const double samples = static_cast<double>(beams.Axis().count) * n[1] * n[2];
  if (!(samples <= maxSamples))
    throw Error(Error::Kind::TooLarge,
                "the beams would hold " + NumberText(samples) +
                    " samples of a pulse this short, beyond 2^29; choose fewer elements, steps or samples, a "
                    "smaller depth or a lower frequency or bandwidth");

  const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(n[1]) * p.firstStep,
                       wanted = static_cast<std::ptrdiff_t>(n[1]) * (p.LastStep() + 1) - first;
  std::vector<BeamWays> ways(static_cast<std::size_t>(beams.Count()));
  {
    const Stopwatch watch(&spent.raysSeconds);
    std::vector<std::int64_t> rays(ways.size(), 0);
    std::optional<WideBeams> wide;
    if (p.wideBeams)
      wide.emplace(p);
    ParallelRanges(wanted, beamsPerRange, progress.Part(0.0, 0.19), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
      for (std::ptrdiff_t i = first + begin; i < first + end; ++i)
        ways[static_cast<std::size_t>(i)] = beams.Trace(i, wide ? &*wide : nullptr, rays[static_cast<std::size_t>(i)]);
    });
    if (wide)
      ParallelRanges(wanted, beamsPerRange, progress.Part(0.19, 0.2), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
        for (std::ptrdiff_t i = first + begin; i < first + end; ++i)
          beams.Widen(i, *wide, ways[static_cast<std::size_t>(i)]);
      });
    for (const std::int64_t each : rays)
      spent.rays += each;
  }
  std::size_t bytes = scene.MemoryBytes();
  for (const BeamWays& each : ways) {
    spent.segments += static_cast<std::int64_t>(each.segments.size());
    spent.surfaceEchoes += static_cast<std::int64_t>(each.echoes.size());
    bytes += BytesOf(each);
  }

  const auto scatterers = [&] {
    const Stopwatch watch(&spent.scatterersSeconds);
    const VisitedSpace space = SpaceOf(ways, p.transducer, beams.Lobes(), progress.Part(0.2, 0.22));
    ScattererParameters parameters;
    parameters.seed = p.seed;
    parameters.densityPerMm3 = p.ScatterersPerMm3();
    parameters.displacement = &p.displacement;
    parameters.decorrelation = p.decorrelation;
    parameters.changeSeed = p.changeSeed;
    return Scatterers::Make(
        parameters, scene.Materials(),
        [&scene](const Eigen::Vector3f* points, std::size_t count, std::int32_t* media) { scene.MediumAt(points, count, media); },
        space.Box(), [&space](const Eigen::AlignedBox3d& box) { return space.Touches(box); }, progress.Part(0.22, 0.4), cache);
  }();
  spent.scatterers = static_cast<std::int64_t>(scatterers.Count());
  bytes += scatterers.MemoryBytes();

  BeamEchoes echoes{p.probe, Volume<Complex>({beams.Axis().count, n[1], n[2]})};
  {
    const Stopwatch watch(&spent.echoesSeconds);
    const VolumeView<Complex> rows = echoes.baseband.View();
    ParallelRanges(wanted, beamsPerRange, progress.Part(0.4, 1.0), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
      std::vector<EchoSum> sums = beams.Summers(scatterers);
      for (std::ptrdiff_t i = first + begin; i < first + end; ++i)
        beams.Sum(ways[static_cast<std::size_t>(i)], sums, rows.Row(static_cast<int>(i % n[1]), static_cast<int>(i / n[1])));
    });
  }
  spent.bytes = bytes + static_cast<std::size_t>(samples) * sizeof(Complex);
  if (cost)
    *cost = spent;
  return echoes;
}

SynthesisParameters SliceOf(const SynthesisParameters& p, double sweep)
{
  if (!(sweep >= -0.5 && sweep <= 0.5))
    throw Error(Error::Kind::InvalidParameter,
                "the slice lies at " + NumberText(sweep) + " of the sweep; it must be in [-0.5, 0.5]");
  // The plane's own frame: turned about the sweep's axis, or moved along it, to where its middle lies.
  const ProbeArc arc = p.probe.Sweep();
  const Eigen::Vector2d middle = arc.PointOf({sweep, 0.0});
  Pose plane = Pose::Identity();
  plane.linear() = ExpRotation(-arc.angle * sweep * Vector3d::UnitX());
  plane.translation() = Vector3d(0.0, middle.x(), middle.y());
  SynthesisParameters slice = p;
  slice.probe.sweepAngle = slice.probe.sweepWidth = 0.0;
  if (!p.stepPoses.empty()) {
    const auto nearest = static_cast<std::size_t>(std::lround((sweep + 0.5) * static_cast<double>(p.stepPoses.size() - 1)));
    slice.stepPoses = {p.stepPoses[nearest] * plane};
  }
  slice.probeToWorld = p.probeToWorld * plane;
  return slice;
}

Volume<unsigned char> SynthesizeBeams(const AcousticScene& scene, const SynthesisParameters& p, const Progress& progress,
                                      SynthesisCost* cost, ScattererCache* cache)
{
  p.Check();
  SynthesisCost spent;
  BeamEchoes echoes;
  if (p.mode == SynthesisParameters::Mode::Coherent) {
    echoes = SynthesizeEchoes(scene, p, progress.Part(0.0, 0.95), &spent, cache);
  } else {
    const Stopwatch watch(&spent.raysSeconds);
    ScatterCounting counting = p.counting;
    counting.seed = p.seed;
    counting.assumedSoundSpeed = p.transducer.assumedSoundSpeed;
    const Volume<float> counted =
        CountScatters(scene, counting, p.probe, p.probeToWorld, p.BeamDimensions(), progress.Part(0.0, 0.95));
    echoes = {p.probe, Volume<Complex>(counted.Dimensions())};
    const auto from = counted.View();
    const auto to = echoes.baseband.View();
    // Beside what goes straight out and back of the reference tissue, close to the face.
    const double step = (p.probe.depthMax - p.probe.depthMin) / (p.samples - 1);
    const auto reference = static_cast<float>(StandardMaterial("liver").scatterProbability * step);
    for (std::ptrdiff_t i = 0; i < from.Size(); ++i)
      to[i] = std::sqrt(from[i] / reference);
    spent.bytes = scene.MemoryBytes() + static_cast<std::size_t>(from.Size()) * (sizeof(float) + sizeof(Complex));
  }
  Volume<unsigned char> beams(p.BeamDimensions());
  {
    const Stopwatch watch(&spent.detectionSeconds);
    DetectEchoes(echoes, p.receiver, beams.View(), progress.Part(0.95, 1.0));
  }
  if (cost)
    *cost = spent;
  return beams;
}

std::string DescribeSynthesis(const SynthesisParameters& parameters)
{
  using Json = nlohmann::ordered_json;
  SynthesisParameters p = parameters;
  const auto rows = [](const Pose& pose) {
    Json list = Json::array();
    for (int i = 0; i < 4; ++i) {
      const Eigen::Vector4d row = pose.matrix().row(i);
      list.push_back({row[0], row[1], row[2], row[3]});
    }
    return list;
  };
  Json stepPoses = Json::array();
  for (const Pose& pose : p.stepPoses)
    stepPoses.push_back(rows(pose));
  Json tgc = Json::array();
  for (const Receiver::GainPoint& point : p.receiver.tgcPoints)
    tgc.push_back({point.depthMm, point.gainDb});
  const std::array<int, 3> n = p.BeamDimensions();
  Json text{{"schema", "echorama-synthesis-1"},
            {"mode", JsonOf(Describe(static_cast<EchoModel&>(p)).front())},
            {"seed", p.seed},
            {"scatterersPerMm3", p.ScatterersPerMm3()},
            {"samples", n[0]},
            {"elements", n[1]},
            {"steps", n[2]},
            {"probe",
             {{"fanAngleDegrees", p.probe.fanAngle * DegreesPerRadian},
              {"fanWidthMm", p.probe.fanWidth},
              {"fanOffset", p.probe.fanOffset},
              {"sweepAngleDegrees", p.probe.sweepAngle * DegreesPerRadian},
              {"sweepWidthMm", p.probe.sweepWidth},
              {"depthMinMm", p.probe.depthMin},
              {"depthMaxMm", p.probe.depthMax}}},
            {"ProbeToWorld", rows(p.probeToWorld)},
            {"transducer", JsonOf(Describe(p.transducer))},
            {"receiver", JsonOf(Describe(p.receiver))}};
  text["receiver"]["tgcPoints"] = tgc;
  if (p.decorrelation > 0.0) {
    text["decorrelation"] = p.decorrelation;
    text["changeSeed"] = p.changeSeed;
  }
  if (!stepPoses.empty())
    text["stepPoses"] = stepPoses;
  if (p.mode == SynthesisParameters::Mode::Coherent) {
    text["transport"] = JsonOf(Without(Describe(static_cast<EchoModel&>(p)), {"Mode"}));
    text["transport"]["displaced"] = !p.displacement.IsZero();
    text["transport"]["invisibleDb"] = p.invisibleDb;
  } else {
    text["counting"] = JsonOf(Without(Describe(p.counting), {"AssumedSoundSpeed", "Seed"}));
  }
  return text.dump();
}

} // namespace echorama
