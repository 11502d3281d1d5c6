// SPDX-License-Identifier: BSD-3-Clause
// The echoes are summed on the beams, where the point spread is a product of three Gaussians.
//
// 1. Scatterers: a slab of lattice cells per task. Each scatterer is taken to beam coordinates (depth, beam, plane, in
//    samples), its amplitude looked up in the scene and turned by its phase. It is listed for every slab of planes of the
//    sweep that its point spread reaches.
// 2. Echoes: a slab of planes per task gathers its scatterers in the order of the lattice, so that every sum has one order,
//    whatever the threads. The innermost loop runs along depth over always eight samples, real and imaginary parts side by
//    side: sixteen floats, for the vector unit. Rows have a margin, so that no sample needs a test.
// 3. Shadows: beams are straight lines, so the way through an ellipsoid is an interval of depth. In tissue that the probe
//    deforms it is looked for in steps along the beam.
// 4. Noise of the receiver, when there is any: each row of samples has its own stream of random numbers.
// 5. Grey: log compression to bytes on the beams, then scan conversion, in the order of a scanner.
//
// The sampling follows the point spread: 0.75 of its standard deviation in depth, 0.8 across, where it is narrowest
// beside the spread of the beams. Cost: one hash (Philox) and one inverse of the geometry per lattice cell in the box, some
// 40 short vector operations per scatterer.
#include "Phantom.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/ParameterJson.h"
#include "Core/Base/Random.h"
#include "Core/Imaging/ScanConversion.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr int depthTaps = 8; // samples in depth that an echo reaches
constexpr int margin = depthTaps - 1;
constexpr float reach = 2.75f; // standard deviations that an echo reaches across: 33 dB down
constexpr int planesPerSlab = 4;
constexpr int layersPerPart = 4;
constexpr double maxBeamSamples = 268435456.0, maxCells = 268435456.0; // 2^28
constexpr std::size_t maxVoxels = 536870912;                           // 2^29

// The samples of beam space.
struct BeamGrid {
  explicit BeamGrid(const PhantomParameters& p);

  double LateralSigma(double depth) const { return p_.lateralSigmaMm + p_.lateralGrowth * std::max(depth, 0.0); }
  double ElevationSigma(double depth) const { return p_.elevationSigmaMm + p_.elevationGrowth * std::max(depth, 0.0); }
  double DepthOf(int sample) const { return p_.probe.depthMin + sample * depthStep; }

  std::array<int, 3> size; // depths, beams, planes
  double depthStep;        // mm
  float stepInSigmas;      // of the pulse

private:
  const PhantomParameters& p_;
};

BeamGrid::BeamGrid(const PhantomParameters& p) : p_(p)
{
  const ProbeGeometry& probe = p.probe;
  const double range = probe.depthMax - probe.depthMin;
  const double depths = std::ceil(range / (0.75 * p.pulseSigmaMm)) + 1.0;
  // Both quotients are monotonous in depth, so the ends suffice.
  double beams = 2.0, planes = 2.0;
  for (const double depth : {probe.depthMin, probe.depthMax}) {
    beams = std::max(beams, std::ceil(probe.Fan().Span(depth) / (0.8 * LateralSigma(depth))) + 1.0);
    planes = std::max(planes, std::ceil(probe.Sweep().Span(depth) / (0.8 * ElevationSigma(depth))) + 1.0);
  }
  if (!(depths * beams * planes <= maxBeamSamples))
    throw Error(Error::Kind::TooLarge, "the phantom would need more than 2^28 samples on its beams; choose a smaller probe "
                                       "geometry or a wider point spread (pulse, lateral and elevation sigma)");
  size = {static_cast<int>(depths), static_cast<int>(beams), static_cast<int>(planes)};
  depthStep = range / (depths - 1.0);
  stepInSigmas = static_cast<float>(depthStep / p.pulseSigmaMm);
}

// A scatterer as the beams see it; positions and standard deviations in samples.
struct Scatterer {
  float depth, beam, plane;
  float beamSigma, planeSigma;
  float re, im;
};

// The scatterers of a few layers of the lattice, and which of them reach which slab of planes.
struct ScattererPart {
  std::vector<Scatterer> scatterers;
  std::vector<std::vector<std::uint32_t>> bySlab;
};

// exp(-u / 2) from a table: the echoes need some hundred million of them.
class GaussTable {
public:
  GaussTable()
  {
    for (int i = 0; i <= steps * range; ++i)
      values_[static_cast<std::size_t>(i)] = static_cast<float>(std::exp(-0.5 * i / steps));
    values_.back() = 0.0f;
  }
  float operator()(float u) const
  {
    const float position = std::min(u * steps, static_cast<float>(steps * range - 1));
    const int i = static_cast<int>(position);
    const float t = position - static_cast<float>(i);
    return values_[static_cast<std::size_t>(i)] +
           t * (values_[static_cast<std::size_t>(i) + 1] - values_[static_cast<std::size_t>(i)]);
  }

private:
  static constexpr int steps = 256, range = 16;
  std::array<float, steps * range + 1> values_{};
};

class ScattererSource {
public:
  ScattererSource(const PhantomParameters& p, const BeamGrid& grid)
    : p_(p), grid_(grid), scene_(p.WholeScene()), worldToProbe_(p.probeToWorld.inverse()),
      cell_(std::cbrt(1.0 / p.scatterersPerMm3))
  {
    far_ = 3.0 * std::max({2.0 * p.pulseSigmaMm, grid.LateralSigma(p.probe.depthMax), grid.ElevationSigma(p.probe.depthMax)});
    const double from = far_ + p.press.mm; // unpressed, what is seen in the fan lies no further from it
    boxInProbe_ = BoxAround(p.probe);
    boxInProbe_.min().array() -= from;
    boxInProbe_.max().array() += from;
    const Eigen::AlignedBox3d box = BoxAround(p.probe, p.probeToWorld);
    const Eigen::Array3d first = ((box.min().array() - from) / cell_).floor(),
                         last = ((box.max().array() + from) / cell_).floor();
    if (!((last - first + 1.0).prod() <= maxCells))
      throw Error(Error::Kind::TooLarge,
                  "the phantom would need more than 2^28 scatterers; choose fewer scatterers per mm^3 or a "
                  "smaller probe geometry");
    first_ = first.cast<int>();
    count_ = (last - first).cast<int>() + 1;
    const auto key =
        Random::Block({static_cast<std::uint32_t>(p.changeSeed), static_cast<std::uint32_t>(p.changeSeed >> 32), 0u, 1u},
                      {static_cast<std::uint32_t>(p.seed), static_cast<std::uint32_t>(p.seed >> 32)});
    changeKey_ = {key[0], key[1]};
  }

  int Layers() const { return count_.z(); }

  // The scatterers of the layers [begin, end) of the lattice.
  ScattererPart Make(int begin, int end) const
  {
    ScattererPart part;
    part.bySlab.resize(static_cast<std::size_t>((grid_.size[2] + planesPerSlab - 1) / planesPerSlab));
    for (int k = begin; k < end; ++k)
      for (int j = 0; j < count_.y(); ++j)
        for (int i = 0; i < count_.x(); ++i)
          Add(first_ + Eigen::Array3i(i, j, k), part);
    return part;
  }

private:
  void Add(const Eigen::Array3i& cell, ScattererPart& part) const
  {
    const auto bits = Random::Block(
        {static_cast<std::uint32_t>(cell.x()), static_cast<std::uint32_t>(cell.y()), static_cast<std::uint32_t>(cell.z()), 0u},
        {static_cast<std::uint32_t>(p_.seed), static_cast<std::uint32_t>(p_.seed >> 32)});
    const auto uniform = [&bits](int n) { return (bits[static_cast<std::size_t>(n)] + 0.5) * (1.0 / 4294967296.0); };
    const Eigen::Vector3d world = cell_ * (cell.cast<double>() + Eigen::Array3d(uniform(0), uniform(1), uniform(2))).matrix();
    const Eigen::Vector3d unpressed = worldToProbe_ * world;
    if (!boxInProbe_.contains(unpressed))
      return;
    const Eigen::Vector3d point = p_.press.mm > 0.0 ? p_.press.Seen(unpressed) : unpressed;
    // Beam coordinates that go on beyond the edges of the fan: echoes from just outside reach in.
    const ProbeArc fan = p_.probe.Fan(), sweep = p_.probe.Sweep();
    const ProbeArc::Place plane = sweep.PlaceOf(point.y(), point.z());
    if ((std::abs(plane.along) - 0.5) * sweep.Span(plane.depth) > far_)
      return;
    const ProbeArc::Place beam = fan.PlaceOf(point.x(), plane.depth);
    const double fanSpan = fan.Span(beam.depth), sweepSpan = sweep.Span(plane.depth);
    if (!(fanSpan > 0.0 && sweepSpan > 0.0))
      return;
    const double depth = (beam.depth - p_.probe.depthMin) / grid_.depthStep;
    if (!(depth >= -4.0 && depth < grid_.size[0] + 3.0))
      return;
    const double lateral = grid_.LateralSigma(beam.depth), elevation = grid_.ElevationSigma(beam.depth);
    const double beams = grid_.size[1] - 1.0, planes = grid_.size[2] - 1.0;
    Scatterer s;
    s.depth = static_cast<float>(depth);
    s.beam = static_cast<float>((beam.along + 0.5) * beams);
    s.plane = static_cast<float>((plane.along + 0.5) * planes);
    s.beamSigma = static_cast<float>(lateral * beams / fanSpan);
    s.planeSigma = static_cast<float>(elevation * planes / sweepSpan);
    const float beamReach = reach * s.beamSigma, planeReach = reach * s.planeSigma;
    if (s.beam + beamReach < 0.0f || s.beam - beamReach > beams || s.plane + planeReach < 0.0f || s.plane - planeReach > planes)
      return;
    // A uniform strength of variance 1 needs fewer scatterers for full speckle than a Gaussian one. The mean power of
    // uniform tissue is the density times the integral of the squared point spread.
    const double power = p_.scatterersPerMm3 * std::pow(Pi, 1.5) * p_.pulseSigmaMm * lateral * elevation;
    const double strength = Strength(cell, uniform(3)) * scene_.AmplitudeAt(world) / std::sqrt(power);
    const double phase = -4.0 * Pi / p_.wavelengthMm * beam.depth;
    s.re = static_cast<float>(strength * std::cos(phase));
    s.im = static_cast<float>(strength * std::sin(phase));
    const auto index = static_cast<std::uint32_t>(part.scatterers.size());
    part.scatterers.push_back(s);
    const int firstPlane = std::max(0, static_cast<int>(std::ceil(s.plane - planeReach)));
    const int lastPlane = std::min(grid_.size[2] - 1, static_cast<int>(std::floor(s.plane + planeReach)));
    for (int slab = firstPlane / planesPerSlab; slab <= lastPlane / planesPerSlab && firstPlane <= lastPlane; ++slab)
      part.bySlab[static_cast<std::size_t>(slab)].push_back(index);
  }

  // Of variance 1 and mean 0: the tissue's own, of which the change replaces a part. Echoes are linear in it, so those of two
  // changes correlate as their strengths do, by 1 - decorrelation.
  double Strength(const Eigen::Array3i& cell, double own) const
  {
    const double strength = std::sqrt(12.0) * (own - 0.5);
    if (p_.decorrelation == 0.0)
      return strength;
    const auto bits = Random::Block(
        {static_cast<std::uint32_t>(cell.x()), static_cast<std::uint32_t>(cell.y()), static_cast<std::uint32_t>(cell.z()), 2u},
        changeKey_);
    const double other = std::sqrt(12.0) * ((bits[0] + 0.5) * (1.0 / 4294967296.0) - 0.5);
    return std::sqrt(1.0 - p_.decorrelation) * strength + std::sqrt(p_.decorrelation) * other;
  }

  const PhantomParameters& p_;
  const BeamGrid& grid_;
  SceneLookup scene_;
  Pose worldToProbe_;
  double cell_;
  double far_; // no echo reaches further across, mm
  Eigen::AlignedBox3d boxInProbe_;
  Eigen::Array3i first_, count_;
  std::array<std::uint32_t, 2> changeKey_;
};

// Adds the echoes of all scatterers of a slab of planes to \a rows: [plane][beam][depth with margins][re, im].
void AddEchoes(const std::vector<ScattererPart>& parts, std::size_t slab, const BeamGrid& grid, const GaussTable& gauss,
               float* rows)
{
  const std::ptrdiff_t rowLength = 2 * (grid.size[0] + 2 * margin);
  const int slabBegin = static_cast<int>(slab) * planesPerSlab;
  const int slabEnd = std::min(grid.size[2], slabBegin + planesPerSlab);
  for (const ScattererPart& part : parts)
    for (const std::uint32_t index : part.bySlab[slab]) {
      const Scatterer& s = part.scatterers[index];
      const int firstDepth = static_cast<int>(std::floor(s.depth)) - depthTaps / 2 + 1;
      float pulse[2 * depthTaps];
      for (int t = 0; t < depthTaps; ++t) {
        const float x = (static_cast<float>(firstDepth + t) - s.depth) * grid.stepInSigmas;
        const float g = gauss(x * x);
        pulse[2 * t] = g * s.re;
        pulse[2 * t + 1] = g * s.im;
      }
      const float beamReach = reach * s.beamSigma, planeReach = reach * s.planeSigma;
      const int beamBegin = std::max(0, static_cast<int>(std::ceil(s.beam - beamReach)));
      const int beamEnd = std::min(grid.size[1], static_cast<int>(std::floor(s.beam + beamReach)) + 1);
      const int planeBegin = std::max(slabBegin, static_cast<int>(std::ceil(s.plane - planeReach)));
      const int planeEnd = std::min(slabEnd, static_cast<int>(std::floor(s.plane + planeReach)) + 1);
      for (int plane = planeBegin; plane < planeEnd; ++plane) {
        const float y = (static_cast<float>(plane) - s.plane) / s.planeSigma;
        float* row = rows + (static_cast<std::ptrdiff_t>(plane - slabBegin) * grid.size[1] + beamBegin) * rowLength +
                     2 * (firstDepth + margin);
        for (int beam = beamBegin; beam < beamEnd; ++beam, row += rowLength) {
          const float x = (static_cast<float>(beam) - s.beam) / s.beamSigma;
          const float weight = gauss(x * x + y * y);
          for (int t = 0; t < 2 * depthTaps; ++t)
            row[t] += weight * pulse[t];
        }
      }
    }
}

// Where a beam runs through a body, in mm of depth, and what each mm there takes.
struct Passage {
  double begin, end, dbPerMm;
};

// The bodies of a scene that attenuate, and where beams cross them.
class Attenuation {
public:
  Attenuation(const PhantomParameters& p, const PhantomScene& scene) : p_(p)
  {
    for (const Inclusion& inclusion : scene.inclusions) {
      const auto* ellipsoid = std::get_if<Ellipsoid>(&inclusion.shape);
      if (ellipsoid && inclusion.attenuationDbPerMm > 0.0) {
        const Eigen::Matrix3d turn = ExpRotation(-ellipsoid->rotation);
        const Eigen::Vector3d wide = ellipsoid->radii.array() + p.press.mm;
        bodies_.push_back({ellipsoid->centre, ellipsoid->radii.cwiseInverse().asDiagonal() * turn,
                           wide.cwiseInverse().asDiagonal() * turn, inclusion.attenuationDbPerMm});
      }
    }
  }

  // The crossings of one beam with all of them.
  std::vector<Passage> Of(double fan, double sweep) const
  {
    std::vector<Passage> crossings;
    const BeamPoint start{0.0, fan, sweep};
    const Eigen::Vector3d origin = p_.probeToWorld * PointOf(p_.probe, start);
    const Eigen::Vector3d along = p_.probeToWorld.linear() * DirectionOf(p_.probe, start);
    for (const Body& body : bodies_) {
      // |a + t b| = 1 in the ellipsoid's own axes and radii.
      const Eigen::Vector3d a = body.toWideUnit * (origin - body.centre), b = body.toWideUnit * along;
      const double bb = b.squaredNorm(), ab = a.dot(b), discriminant = ab * ab - bb * (a.squaredNorm() - 1.0);
      if (!(discriminant > 0.0))
        continue;
      Passage crossing{std::max(0.0, (-ab - std::sqrt(discriminant)) / bb), (-ab + std::sqrt(discriminant)) / bb, body.dbPerMm};
      if (p_.press.mm == 0.0 || Narrow(body, origin, along, crossing))
        crossings.push_back(crossing);
    }
    return crossings;
  }

private:
  struct Body {
    Eigen::Vector3d centre;
    Eigen::Matrix3d toUnit, toWideUnit; // wide: it holds the body wherever the probe presses it
    double dbPerMm;
  };

  // From where the beam may cross a body to where it crosses what the probe has made of it; false when it does not.
  bool Narrow(const Body& body, const Eigen::Vector3d& origin, const Eigen::Vector3d& along, Passage& crossing) const
  {
    constexpr int steps = 64;
    const Pose worldToProbe = p_.probeToWorld.inverse();
    const auto outside = [&](double t) { // < 0 inside
      const Eigen::Vector3d tissue = p_.probeToWorld * p_.press.Unpressed(worldToProbe * (origin + t * along));
      return (body.toUnit * (tissue - body.centre)).squaredNorm() - 1.0;
    };
    const double begin = crossing.begin, step = (crossing.end - crossing.begin) / steps;
    bool found = false;
    double before = outside(begin);
    if (before < 0.0)
      found = true;
    for (int i = 1; i <= steps; ++i) {
      const double now = outside(begin + i * step);
      const double edge = begin + (i - 1 + (before != now ? before / (before - now) : 0.0)) * step;
      if (before >= 0.0 && now < 0.0 && !found) {
        crossing.begin = edge;
        found = true;
      }
      if (before < 0.0 && now >= 0.0)
        crossing.end = edge;
      before = now;
    }
    return found;
  }

  const PhantomParameters& p_;
  std::vector<Body> bodies_;
};

// Adds complex Gaussian noise of the given amplitude to one row of samples.
void AddNoise(const PhantomParameters& p, float amplitude, std::uint64_t row, std::complex<float>* samples, int count)
{
  Random random(p.changeSeed, row);
  for (int i = 0; i < count; ++i) {
    // Of a complex Gaussian number, the square of the size is exponentially distributed and the angle uniformly.
    const auto size = amplitude * static_cast<float>(std::sqrt(-std::log1p(-random.Uniform())));
    const auto angle = static_cast<float>(2.0 * Pi * random.Uniform());
    samples[i] += std::complex<float>(size * std::cos(angle), size * std::sin(angle));
  }
}

} // namespace

ParameterList Describe(PhantomParameters& p)
{
  const ParameterRange sigmas{0.05, 20}, growths{0, 1}, seeds{0, 9223372036854775807.0};
  return {
      Parameter(
          "Seed", p.seed, seeds, "",
          "Seed of the tissue: where the scatterers lie and how strong they are. Volumes with one seed show the same tissue."),
      Parameter("SpacingMm", p.spacingMm, {0, Unlimited, true}, "mm", "Edge of the cubic voxels."),
      Parameter("GainDb", p.gainDb, {-200, 200}, "dB", "Gain of this volume."),
      Parameter("DynamicRangeDb", p.dynamicRangeDb, {10, 200}, "dB", "How much the 255 steps of grey span."),
      Parameter("BackgroundGrey", p.backgroundGrey, {0, 255}, "", "Mean grey of the background at a gain of 0 dB."),
      Parameter("Shadows", p.shadows, "Whether attenuating bodies (the stone of the default scene) cast shadows."),
      Parameter("Decorrelation", p.decorrelation, {0, 1}, "",
                "How far the speckle has changed: complex echoes of volumes of one Seed and different ChangeSeeds that are seen "
                "alike correlate by 1 less this. Bodies stay where and as loud as they are."),
      Parameter("ChangeSeed", p.changeSeed, seeds, "",
                "Seed of the change and of the noise: volumes with the same one have changed alike."),
      Parameter("DeformationMm", p.press.mm, {0, ProbePress::maxMm}, "mm",
                "How far the pressed probe moves the tissue below the middle of its face. It fades with depth and sideways."),
      Parameter("NoiseDb", p.noiseDb, {PhantomParameters::noNoiseDb, 60}, "dB",
                "Power of the receiver's noise beside that of the background; -120: none."),
      Parameter("RibShare", p.ribShare, {0, 0.6}, "", "Share of the fan in the shadow of a rib close below the face; 0: no rib."),
      Parameter("Jets", p.jets, "Whether bodies that come and go (jets and puffs at places of the default scene) are there."),
      Parameter("WavelengthMm", p.wavelengthMm, {0.05, 10}, "mm",
                "Wavelength in tissue. The longer, the longer speckle stays alike as the probe turns.")
          .Advanced(),
      Parameter("PulseSigmaMm", p.pulseSigmaMm, sigmas, "mm",
                "Standard deviation of the Gaussian pulse in depth, of amplitudes."),
      Parameter("LateralSigmaMm", p.lateralSigmaMm, sigmas, "mm", "That of the beam along the fan at depth 0."),
      Parameter("LateralGrowth", p.lateralGrowth, growths, "", "Its growth per mm of depth."),
      Parameter("ElevationSigmaMm", p.elevationSigmaMm, sigmas, "mm", "That of the beam along the sweep at depth 0."),
      Parameter("ElevationGrowth", p.elevationGrowth, growths, "", "Its growth per mm of depth."),
      Parameter("ScatterersPerMm3", p.scatterersPerMm3, {0.01, 100}, "per mm^3", "Scatterers, one in each cell of a lattice."),
  };
}

void PhantomParameters::Check() const
{
  const auto fail = [](const std::string& reason) { throw Error(Error::Kind::InvalidParameter, "phantom: " + reason); };
  CheckRanges(*this);
  scene.Check();
  probe.Check();
  if (probe.IsPlane())
    fail("the sweep of the probe is a single plane; a volume needs an angle or a width of the sweep");
  if (probe.fanOffset != 0.0)
    fail("the fan of the probe must be centred on its array");
  // Beams of a fan of half a turn or more, or planes that meet, would show one scatterer twice.
  if (!(probe.fanAngle < Pi && probe.sweepAngle < Pi))
    fail("fan and sweep must be below 180 degrees");
  for (const double depth : {probe.depthMin, probe.depthMax})
    if (!(probe.Sweep().Span(probe.Fan().PointOf({0.5, depth}).y()) > 0.0))
      fail("the edge of the fan reaches the axis of the sweep; choose a larger sweep radius or a narrower fan");
  if (!IsRotation(probeToWorld.linear()) || !probeToWorld.translation().allFinite())
    fail("ProbeToWorld is not a finite rigid transform");
  if (!(probeToWorld.translation().cwiseAbs().maxCoeff() <= 1e6))
    fail("ProbeToWorld lies more than 1e6 mm away");
}

PhantomScene PhantomParameters::WholeScene() const
{
  PhantomScene whole = scene;
  if (jets) {
    const std::vector<Inclusion> list = Jets();
    whole.inclusions.insert(whole.inclusions.end(), list.begin(), list.end());
  }
  if (ribShare > 0.0)
    whole.inclusions.push_back(RibBelow(probe, probeToWorld, ribShare));
  return whole;
}

Inclusion RibBelow(const ProbeGeometry& probe, const Pose& probeToWorld, double share)
{
  constexpr double thickness = 2.5, length = 400.0, place = 0.15; // mm, mm, of the fan
  const double depth = probe.depthMin + 6.0;
  // The tangents from the apex of the fan to an ellipse across a beam: tan(half angle) = width / sqrt(distance^2 -
  // thickness^2). Beams of a flat array are parallel.
  const double distance = probe.fanAngle > 0.0 ? probe.fanWidth / probe.fanAngle + depth : 0.0;
  const double width = probe.fanAngle > 0.0
                           ? std::tan(0.5 * share * probe.fanAngle) *
                                 std::sqrt(std::max(distance * distance - thickness * thickness, thickness * thickness))
                           : 0.5 * share * probe.fanWidth;
  Ellipsoid rib;
  rib.centre = probeToWorld * PointOf(probe, {depth, place, 0.0});
  rib.radii = {std::max(width, 0.1), length, thickness};
  rib.rotation = LogRotation(probeToWorld.linear() * ExpRotation({0.0, place * probe.fanAngle, 0.0}));
  return {"rib", rib, 15.0, 0.0, 0.0, 20.0};
}

BeamEchoes SimulateEchoes(const PhantomParameters& p, const Progress& progress)
{
  p.Check();
  const BeamGrid grid(p);
  const ScattererSource source(p, grid);
  const int layers = source.Layers();
  std::vector<ScattererPart> parts(static_cast<std::size_t>((layers + layersPerPart - 1) / layersPerPart));
  ParallelFor(static_cast<std::ptrdiff_t>(parts.size()), progress.Part(0.0, 0.5), [&](std::ptrdiff_t i) {
    const int begin = static_cast<int>(i) * layersPerPart;
    parts[static_cast<std::size_t>(i)] = source.Make(begin, std::min(layers, begin + layersPerPart));
  });

  BeamEchoes echoes{p.probe, Volume<std::complex<float>>(grid.size)};
  const VolumeView<std::complex<float>> baseband = echoes.baseband.View();
  const GaussTable gauss;
  const Attenuation attenuation(p, p.WholeScene());
  const auto noise = static_cast<float>(p.noiseDb > PhantomParameters::noNoiseDb ? std::pow(10.0, p.noiseDb / 20.0) : 0.0);
  const int slabs = (grid.size[2] + planesPerSlab - 1) / planesPerSlab;
  ParallelFor(slabs, progress.Part(0.5, 1.0), [&](std::ptrdiff_t slab) {
    const std::ptrdiff_t rowLength = 2 * (grid.size[0] + 2 * margin);
    std::vector<float> rows(static_cast<std::size_t>(rowLength) * static_cast<std::size_t>(grid.size[1]) * planesPerSlab);
    AddEchoes(parts, static_cast<std::size_t>(slab), grid, gauss, rows.data());
    const int begin = static_cast<int>(slab) * planesPerSlab, end = std::min(grid.size[2], begin + planesPerSlab);
    for (int plane = begin; plane < end; ++plane)
      for (int beam = 0; beam < grid.size[1]; ++beam) {
        const float* row =
            rows.data() + (static_cast<std::ptrdiff_t>(plane - begin) * grid.size[1] + beam) * rowLength + 2 * margin;
        std::complex<float>* out = baseband.Row(beam, plane);
        for (int d = 0; d < grid.size[0]; ++d)
          out[d] = {row[2 * d], row[2 * d + 1]};
        if (p.shadows)
          for (const Passage& crossing : attenuation.Of(beam / (grid.size[1] - 1.0) - 0.5, plane / (grid.size[2] - 1.0) - 0.5))
            for (int d = 0; d < grid.size[0]; ++d) {
              const double way = std::min(grid.DepthOf(d), crossing.end) - crossing.begin;
              if (way > 0.0)
                out[d] *= static_cast<float>(std::pow(10.0, -crossing.dbPerMm * way / 20.0));
            }
        if (noise > 0.0f)
          AddNoise(p, noise,
                   static_cast<std::uint64_t>(plane) * static_cast<std::uint64_t>(grid.size[1]) +
                       static_cast<std::uint64_t>(beam),
                   out, grid.size[0]);
      }
  });
  return echoes;
}

Eigen::AlignedBox3d BoxAround(const ProbeGeometry& probe, const Pose& pose)
{
  // The first and the last samples of beams this close leave a few micrometres of arc outside.
  constexpr int steps = 64;
  Eigen::AlignedBox3d box;
  for (int i = 0; i <= steps; ++i)
    for (int j = 0; j <= steps; ++j)
      for (const double depth : {probe.depthMin, probe.depthMax})
        box.extend(pose * PointOf(probe, {depth, static_cast<double>(i) / steps - 0.5, static_cast<double>(j) / steps - 0.5}));
  return box;
}

ImageGeometry PhantomGeometry(const PhantomParameters& p)
{
  p.Check();
  return ScanConversionGrid(p.probe, p.probeToWorld, p.spacingMm, maxVoxels);
}

void MakePhantom(const PhantomParameters& p, VolumeView<unsigned char> intensity, VolumeView<unsigned char> valid,
                 const Progress& progress)
{
  const ImageGeometry geometry = PhantomGeometry(p);
  if (intensity.Dimensions() != geometry.dimensions || valid.Dimensions() != geometry.dimensions)
    throw Error(Error::Kind::InvalidParameter, "phantom: the volumes do not have the dimensions of the phantom's geometry");
  const BeamEchoes echoes = SimulateEchoes(p, progress.Part(0.0, 0.85));
  const VolumeView<const std::complex<float>> baseband = echoes.baseband.View();

  // The mean of 20 log10 of a Rayleigh envelope lies 10 gamma / ln 10 = 2.507 dB below that of its mean power.
  const double greyPerDb = 255.0 / p.dynamicRangeDb;
  const double offset = p.backgroundGrey + greyPerDb * (p.gainDb + 2.5068);
  Volume<unsigned char> greys(baseband.Dimensions());
  const VolumeView<unsigned char> grey = greys.View();
  ParallelFor(baseband.Slices(), progress.Part(0.85, 0.9), [&](std::ptrdiff_t plane) {
    for (std::ptrdiff_t i = plane * baseband.SliceStride(); i < (plane + 1) * baseband.SliceStride(); ++i) {
      const float power = std::norm(baseband[i]);
      const double value = power > 0.0f ? offset + greyPerDb * 10.0 * std::log10(static_cast<double>(power)) : 0.0;
      grey[i] = static_cast<unsigned char>(std::clamp(value, 0.0, 255.0) + 0.5);
    }
  });
  ScanConvert<unsigned char>(grey, p.probe, p.probeToWorld, geometry, intensity, valid, progress.Part(0.9, 1.0));
}

std::string DescribePhantom(const PhantomParameters& p)
{
  nlohmann::ordered_json text =
      nlohmann::ordered_json::parse(PhantomToJson(p.scene)); // without rib and jets: they are parameters
  PhantomParameters readable = p;
  text["parameters"] = JsonOf(Without(Describe(readable), {"Seed"})); // which has its own array
  return text.dump();
}

} // namespace echorama
