// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Filters/Acoustics/WideBeams.h"
#include "Filters/Tissue/PackedTissue.h"
#include "Filters/Tissue/Testing/SurfacesForTests.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

using namespace echorama;
using namespace echorama::testing;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

const Material tissue = Clear("tissue", 1540.0, 1000), fat = Clear("fat", 1450, 950), fast = Clear("fast", 1620, 1000);

SynthesisParameters Flat(int elements, double width)
{
  SynthesisParameters p;
  p.probe = ProbeGeometry::Linear(width, 0.0, 0.0, 60.0);
  p.elements = elements;
  p.subRays = 1;
  p.wideBeams = true;
  p.transport.faceReflection = 0.0;
  p.transducer.lateralFocusMm = 30.0;
  return p;
}

// Where the middle of a way is at a scan depth.
Vector3d PlaceAt(const std::vector<SoundSegment>& way, double scanDepth)
{
  for (const SoundSegment& segment : way)
    if (segment.bounces == 0 && scanDepth <= segment.scanDepth + segment.length * segment.scanDepthPerMm)
      return segment.from + (scanDepth - segment.scanDepth) / segment.scanDepthPerMm * segment.direction;
  return Vector3d::Constant(std::nan(""));
}

double AmplitudeAt(const WideBeams& beams, const WideWay& way, double scanDepth)
{
  return static_cast<double>(beams.AmplitudeAt(way, {scanDepth, 0.1, 1}).front());
}

// Beams through a pack of spheres: of each at a depth, how far beside its straight line it lies along the fan, and its
// amplitude in dB.
struct Seen {
  std::vector<double> beside, db;
};
Seen SeenAt(const AcousticScene& scene, const SynthesisParameters& p, double scanDepth)
{
  Seen seen;
  const WideBeams beams = TraceWideBeams(scene, p);
  for (int element = 0; element < p.elements; ++element) {
    const RayStart axis = AxisOf(p, element, 0);
    const WideWay way = beams.Way(element);
    seen.beside.push_back((PlaceAt(way.segments, scanDepth) - axis.origin).dot(axis.across));
    seen.db.push_back(20.0 * std::log10(AmplitudeAt(beams, way, scanDepth)));
  }
  return seen;
}

// How far each is off the mean of its neighbours, root mean square.
double Jumps(const std::vector<double>& values)
{
  double sum = 0.0;
  for (std::size_t i = 1; i + 1 < values.size(); ++i)
    sum += std::pow(values[i] - 0.5 * (values[i - 1] + values[i + 1]), 2);
  return std::sqrt(sum / static_cast<double>(values.size() - 2));
}

double Rms(const std::vector<double>& a, const std::vector<double>& b)
{
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    sum += std::pow(a[i] - b[i], 2);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

} // namespace

// Through a layer all rays fare alike: the beam goes where its axis goes, at the same time, and comes out as loud.
TEST(WideBeams, WhereAllRaysAreAlikeTheBeamIsItsAxis)
{
  Material layer = fat;
  layer.attenuation = 2.0;
  TissueSurface surface = Background(tissue);
  AddBox(surface, layer, Vector3f(-100, -100, 10.2f), Vector3f(100, 100, 22.7f));
  const AcousticScene scene(surface);
  for (const int subRays : {1, 16}) {
    SynthesisParameters p = Flat(33, 16.0);
    p.subRays = subRays;
    const WideBeams beams = TraceWideBeams(scene, p);
    for (const int element : {0, 7, 16}) {
      RayStart axis = AxisOf(p, element, 0);
      axis.inside = scene.BodiesAt(axis.origin);
      const SoundPath exact = TracePath(scene, p.transport, ConditionsOf(p), axis);
      const WideWay way = beams.Way(element);
      for (const double depth : {5.0, 16.0, 23.2, 40.0, 59.0}) {
        EXPECT_LT((PlaceAt(way.segments, depth) - PlaceAt(exact.segments, depth)).norm(), subRays == 1 ? 0.03 : 0.1) << depth;
        const auto segment = std::find_if(exact.segments.begin(), exact.segments.end(), [depth](const SoundSegment& each) {
          return each.bounces == 0 && depth <= each.scanDepth + each.length * each.scanDepthPerMm;
        });
        const double amplitude =
            segment->amplitude * std::exp(-segment->attenuation * (depth - segment->scanDepth) / segment->scanDepthPerMm);
        EXPECT_NEAR(AmplitudeAt(beams, way, depth) / amplitude, 1.0, subRays == 1 ? 0.02 : 0.04) << depth << " " << subRays;
      }
    }
  }
}

TEST(WideBeams, BehindAnObliquePlaneSnellsLawHolds)
{
  const double tilt = 0.3, ratio = fast.soundSpeed / tissue.soundSpeed;
  TissueSurface surface = Background(tissue);
  AddBox(surface, fast, Vector3f(-200, -200, 0), Vector3f(200, 200, 300));
  const Eigen::Affine3d place = Eigen::Translation3d(0, 0, 20.0) * Eigen::AngleAxisd(tilt, Vector3d::UnitY());
  for (auto point = surface.points.end() - 8; point != surface.points.end(); ++point)
    *point = (place * point->cast<double>()).cast<float>();
  const SynthesisParameters p = Flat(65, 32.0);
  const WideBeams beams = TraceWideBeams(AcousticScene(surface), p);
  const double turn = tilt - std::asin(ratio * std::sin(tilt)); // about y
  const SoundSegment last = beams.Way(32).segments.back();
  EXPECT_LT((last.direction - Vector3d(std::sin(turn), 0.0, std::cos(turn))).norm(), 1e-4);
  EXPECT_NEAR(last.scanDepthPerMm, 1.0 / ratio, 5e-4); // corners are left out to 0.02 mm
  EXPECT_LT((PlaceAt({last}, 58.0) - Vector3d(38.0 * ratio * std::sin(turn), 0.0, 20.0 + 38.0 * ratio * std::cos(turn))).norm(),
            0.05);
}

// Behind the edge of an absorber a beam keeps the share of its width there that looks past it: an error function of the width by
// cone and diffraction, however many rays tell of it.
TEST(WideBeams, ShadowsAreAsSoftAsTheBeamIsWide)
{
  Material absorber = tissue;
  absorber.attenuation = 200.0;
  for (const double depth : {9.0, 25.0, 45.0})
    for (const int subRays : {1, 64}) {
      TissueSurface surface = Background(tissue);
      AddBox(surface, absorber, Vector3f(0.1f, -100, static_cast<float>(depth)),
             Vector3f(100, 100, static_cast<float>(depth) + 0.4f));
      SynthesisParameters p = Flat(121, 24.0);
      p.subRays = subRays;
      p.sampling = Sampling::Sobol;
      p.transport.refraction = false;
      p.transducer.lateralApertureMm = 8.0;
      const WideBeams beams = TraceWideBeams(AcousticScene(surface), p);
      const double s = 8.0 / Transducer::sigmasPerAperture, cone = s * (1.0 - depth / 30.0);
      const double wave = depth * p.transducer.WavelengthMm() / (2.0 * 3.14159265358979 * s);
      for (int element = 24; element <= 96; element += 6) {
        const double x = AxisOf(p, element, 0).origin.x() - 0.1; // the edge lies between two axes
        const double share = 0.5 * std::erfc(x / std::sqrt(2.0 * (cone * cone + wave * wave)));
        EXPECT_NEAR(AmplitudeAt(beams, beams.Way(element), depth + 3.0), share, 0.03) << depth << " " << subRays << " " << x;
      }
    }
}

// Single axes are thrown apart by the spheres that they pass; beams share most of these.
TEST(WideBeams, NeighboursBehindManySpheresLookTheSameWay)
{
  PackedTissueParameters packed;
  packed.packing.boxMin = Vector3d(-30, -12, 4);
  packed.packing.boxMax = Vector3d(30, 12, 56);
  packed.packing.radiusMin = 1.5;
  packed.packing.radiusMax = 5.0;
  const AcousticScene scene(MakePackedTissue(packed).surface);
  SynthesisParameters p = Flat(97, 36.0);
  const double depth = 55.0;
  std::vector<double> ofAxes;
  const SoundTracer tracer(scene, p.transport, ConditionsOf(p));
  for (int element = 0; element < p.elements; ++element) {
    RayStart axis = AxisOf(p, element, 0);
    axis.inside = scene.BodiesAt(axis.origin);
    SoundPath path;
    tracer.Trace(axis, path);
    const Vector3d place = PlaceAt(path.segments, depth);
    ofAxes.push_back(place.allFinite() ? (place - axis.origin).dot(axis.across) : 0.0);
  }
  const Seen one = SeenAt(scene, p, depth);
  p.sampling = Sampling::Sobol;
  p.subRays = 256;
  const Seen many = SeenAt(scene, p, depth);
  EXPECT_LT(Jumps(one.beside), 0.1 * Jumps(ofAxes));
  EXPECT_LT(Jumps(many.beside), 0.05 * Jumps(ofAxes));
  EXPECT_LT(Rms(one.beside, many.beside), 0.5 * Rms(ofAxes, many.beside));
  EXPECT_LT(Rms(one.db, many.db), 1.5);
  p.subRays = 8;
  const Seen some = SeenAt(scene, p, depth);
  EXPECT_LT(Rms(some.beside, many.beside), Rms(one.beside, many.beside));
  EXPECT_LT(Rms(some.db, many.db), 0.7);
}

// No sound gets through a plate that is wider than all beams.
TEST(WideBeams, NothingIsHeardBehindWhatLetsNothingThrough)
{
  Material absorber = tissue;
  absorber.attenuation = 200.0;
  TissueSurface surface = Background(tissue);
  AddBox(surface, absorber, Vector3f(-100, -100, 20), Vector3f(100, 100, 25));
  const AcousticScene scene(surface);
  const SynthesisParameters p = Flat(33, 16.0);
  const WideBeams beams = TraceWideBeams(scene, p);
  const WideWay way = beams.Way(10);
  EXPECT_NEAR(AmplitudeAt(beams, way, 19.0), 1.0, 1e-6);
  EXPECT_EQ(AmplitudeAt(beams, way, 26.0), 0.0);
  const SoundSegment last = beams.HeardWay(10).back();
  EXPECT_GT(last.scanDepth + last.length * last.scanDepthPerMm, 19.0);
  EXPECT_LT(last.scanDepth + last.length * last.scanDepthPerMm, 21.0);
}
