// SPDX-License-Identifier: BSD-3-Clause
//
// One way at a time: from where it starts to where it fades, leaves the depth of the scan, or is reflected totally. At each
// interface a reflected way is put aside; when a way is done, its reflections are followed in order, each with all of its own
// before the next. Nothing is drawn at random but the reflections of rough surfaces.
//
// Cost: two questions to the scene's tree per surface (the nearest hit, and what lies at the same place), one at the end of
// each way.
#include "SoundTransport.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>
#include <limits>

namespace echorama {
namespace {

constexpr double pi = 3.14159265358979323846;

void Check(const char* name, double value, double from, double to)
{
  if (!(value >= from && value <= to))
    throw Error(Error::Kind::InvalidParameter, std::string(name) + " is " + NumberText(value) + "; it must be in [" +
                                                   NumberText(from) + ", " + NumberText(to) + "]");
}

// A direction about the normal, as likely as the cosine of the angle between them.
Eigen::Vector3d LambertDirection(const Eigen::Vector3d& normal, double u, double v)
{
  const Eigen::Vector3d first = normal.unitOrthogonal(), second = normal.cross(first);
  const double radius = std::sqrt(u), angle = 2.0 * pi * v;
  return (radius * std::cos(angle) * first + radius * std::sin(angle) * second + std::sqrt(1.0 - u) * normal).normalized();
}

} // namespace

void SoundTransport::Check() const
{
  echorama::Check("maxBounces", maxBounces, 0, 100);
  echorama::Check("dynamicRangeDb", dynamicRangeDb, 10.0, 300.0);
  echorama::Check("faceReflection", faceReflection, 0.0, 1.0);
  echorama::Check("faceRadius (mm)", faceRadius, 0.0, 1000.0);
  echorama::Check("acceptanceDegrees", acceptanceDegrees, 0.1, 90.0);
  echorama::Check("maxSegments", maxSegments, 1, 1e8);
}

void SoundConditions::Check() const
{
  echorama::Check("frequencyMHz", frequencyMHz, 0.1, 100.0);
  echorama::Check("assumedSoundSpeed (m/s)", assumedSoundSpeed, 100.0, 10000.0);
  echorama::Check("maxScanDepth (mm)", maxScanDepth, std::numeric_limits<double>::min(), 1e5);
}

// A way that is still to be followed.
struct SoundTracer::Way {
  SceneRay ray;
  Eigen::Vector3d across;
  double way, scanDepth, amplitude;
  int medium, bounces;
  bool towardsFace = false; // may meet the probe's face
};

SoundTracer::SoundTracer(const AcousticScene& scene, const SoundTransport& transport, const SoundConditions& conditions)
  : scene_(scene), transport_(transport), conditions_(conditions)
{
  transport.Check();
  conditions.Check();
  const double neperPerDb = std::log(10.0) / 20.0;
  for (const Material& material : scene.Materials())
    media_.push_back({{material.Impedance(), material.soundSpeed},
                      2.0 * neperPerDb * material.AttenuationDbPerMm(conditions.frequencyMHz),
                      conditions.assumedSoundSpeed / material.soundSpeed,
                      material.roughness});
  leastAmplitude_ = std::pow(10.0, -transport.dynamicRangeDb / 20.0);
  const double acceptance = transport.acceptanceDegrees * pi / 180.0;
  mirrorFactor_ = 0.5 / (acceptance * acceptance);
  caught_ = std::min(1.0, acceptance * acceptance);
}

// How much of the pressure that a surface reflects turns back to where it came from.
double SoundTracer::Returned(double cosine, double roughness) const
{
  const double angle = std::acos(std::min(1.0, cosine));
  const double mirror = std::exp(-2.0 * mirrorFactor_ * angle * angle); // energies
  return std::sqrt((1.0 - roughness) * mirror + roughness * caught_ * cosine);
}

void SoundTracer::Trace(const RayStart& start, SoundPath& path, RaySamples* samples,
                        std::vector<SceneRay::Question>* record) const
{
  path.segments.clear();
  path.echoes.clear();
  path.rays = 0;
  thread_local std::vector<Way> waiting;
  thread_local std::vector<Way> reflections;
  waiting.clear();
  Way way;
  way.ray.origin = start.origin;
  way.ray.direction = start.direction;
  way.ray.inside = start.inside;
  way.ray.record = record;
  way.across = start.across;
  way.way = 0.0;
  way.scanDepth = start.scanDepth;
  way.amplitude = start.amplitude;
  way.bounces = 0;
  waiting.push_back(std::move(way));
  while (!waiting.empty() && path.segments.size() < static_cast<std::size_t>(transport_.maxSegments)) {
    Way next = std::move(waiting.back());
    waiting.pop_back();
    reflections.clear();
    Follow(next, start, path, samples, reflections);
    for (auto reflection = reflections.rbegin(); reflection != reflections.rend(); ++reflection)
      waiting.push_back(std::move(*reflection));
  }
}

void SoundTracer::Follow(Way& way, const RayStart& start, SoundPath& path, RaySamples* samples,
                         std::vector<Way>& reflections) const
{
  SceneRay& ray = way.ray;
  way.medium = scene_.MediumOf(ray.inside);
  double begin = 0.0; // along the ray
  for (;;) {
    const Medium& medium = media_[static_cast<std::size_t>(way.medium)];
    const double level = std::abs(way.amplitude);
    if (!(level > leastAmplitude_) || path.segments.size() >= static_cast<std::size_t>(transport_.maxSegments))
      break;
    double length = (conditions_.maxScanDepth - way.scanDepth) / medium.depthPerMm;
    if (medium.attenuation > 0.0)
      length = std::min(length, std::log(level / leastAmplitude_) / medium.attenuation);
    if (!(length > 0.0))
      break;

    // The probe's face: a disc in the element's plane, met from the front.
    double toFace = std::numeric_limits<double>::infinity();
    const double approach = -ray.direction.dot(start.direction);
    if (way.towardsFace && approach > 0.0) {
      const double distance = (ray.origin + begin * ray.direction - start.origin).dot(start.direction) / approach;
      const Eigen::Vector3d place = ray.origin + (begin + distance) * ray.direction;
      if (distance > scene_.Tolerance() && (place - start.origin).norm() <= transport_.faceRadius)
        toFace = distance;
    }

    Crossing crossing;
    const double limit = begin + std::min(length, toFace);
    const bool meets = scene_.NextCrossing(ray, limit, crossing);
    const bool atFace = !meets && toFace <= length;
    const double passed = meets ? std::max(0.0, crossing.distance - begin) : std::min(length, toFace);

    SoundSegment segment;
    segment.from = ray.origin + begin * ray.direction;
    segment.direction = ray.direction;
    segment.across = way.across;
    segment.length = passed;
    segment.way = way.way;
    segment.scanDepth = way.scanDepth;
    segment.scanDepthPerMm = medium.depthPerMm;
    segment.medium = way.medium;
    segment.amplitude = way.amplitude;
    segment.attenuation = medium.attenuation;
    segment.bounces = way.bounces;
    if (passed > 0.0)
      path.segments.push_back(segment);
    way.way += passed;
    way.scanDepth += passed * medium.depthPerMm;
    way.amplitude *= std::exp(-medium.attenuation * passed);
    begin = meets ? crossing.behind : begin + passed;
    if (!meets && !atFace)
      break;

    if (atFace) { // a mirror that lets nothing pass
      const double cosine = std::min(1.0, approach), reflected = transport_.faceReflection;
      path.echoes.push_back({way.scanDepth, way.amplitude * reflected * Returned(cosine, 0.0), way.way, way.bounces});
      if (way.bounces < transport_.maxBounces) {
        Way back = way;
        back.ray = SceneRay();
        back.ray.origin = ray.origin + begin * ray.direction;
        back.ray.direction = Mirrored(ray.direction, start.direction);
        back.ray.inside = ray.inside;
        back.ray.fromSurface = true;
        back.ray.record = ray.record;
        back.across = (way.across - 2.0 * way.across.dot(start.direction) * start.direction).normalized();
        back.amplitude = way.amplitude * reflected * reflected;
        ++back.bounces;
        back.towardsFace = false;
        reflections.push_back(std::move(back));
      }
      break;
    }

    const bool sheet = crossing.sheet >= 0;
    const Medium& behind = media_[static_cast<std::size_t>(sheet ? crossing.sheet : crossing.after)];
    const bool bends = transport_.refraction && !sheet && behind.fluid.soundSpeed != medium.fluid.soundSpeed;
    // Without refraction the interface reflects as the impedances say, at every angle alike.
    const Fluid there = transport_.refraction ? behind.fluid : Fluid{behind.fluid.impedance, medium.fluid.soundSpeed};
    const double ratio = there.soundSpeed / medium.fluid.soundSpeed;
    Eigen::Vector3d normal = crossing.normal;
    double cosine = std::min(1.0, -ray.direction.dot(normal));
    InterfaceResponse response = MeetInterface(medium.fluid, there, cosine);
    if (bends && !response.total && Refracted(ray.direction, normal, ratio, response.cosTransmitted).dot(crossing.facet) >= 0.0) {
      normal = crossing.facet; // at grazing angles the curved one may bend the ray back out of the triangle
      cosine = std::min(1.0, -ray.direction.dot(normal));
      response = MeetInterface(medium.fluid, there, cosine);
    }
    const double roughness = std::max(medium.roughness, behind.roughness);
    if (response.reflected != 0.0)
      path.echoes.push_back(
          {way.scanDepth, way.amplitude * response.reflected * Returned(cosine, roughness), way.way, way.bounces});

    if (way.bounces < transport_.maxBounces && std::abs(way.amplitude) * response.reflectedEnergy > leastAmplitude_) {
      Eigen::Vector3d direction = Mirrored(ray.direction, normal);
      Eigen::Vector3d across = (way.across - 2.0 * way.across.dot(normal) * normal).normalized();
      double amplitude = way.amplitude * response.reflectedEnergy;
      if (samples && roughness > 0.0) {
        const double choice = samples->Next(), u = samples->Next(), v = samples->Next();
        if (choice < roughness) {
          const Eigen::Vector3d mirrored = direction;
          direction = LambertDirection(crossing.facet, u, v);
          across = CarriedThroughBend(across, mirrored, direction);
          amplitude *= std::sqrt(caught_ * cosine); // on the way back it is turned to the element by a Lambert lobe too
        }
      }
      if (std::abs(amplitude) > leastAmplitude_) {
        Way reflection = way;
        reflection.ray = SceneRay();
        reflection.ray.origin = ray.origin + crossing.distance * ray.direction;
        reflection.ray.direction = direction;
        reflection.ray.inside = ray.came;
        reflection.ray.fromSurface = true;
        reflection.ray.record = ray.record;
        reflection.across = across;
        reflection.amplitude = amplitude;
        ++reflection.bounces;
        reflection.towardsFace = transport_.faceReflection > 0.0;
        reflections.push_back(std::move(reflection));
      }
    }

    if (response.total)
      break;
    way.amplitude *= response.transmittedEnergy;
    if (sheet)
      continue;
    way.medium = crossing.after;
    if (bends && behind.fluid.soundSpeed != medium.fluid.soundSpeed) {
      const Eigen::Vector3d direction =
          Refracted(ray.direction, crossing.normal, behind.fluid.soundSpeed / medium.fluid.soundSpeed, response.cosTransmitted);
      way.across = CarriedThroughBend(way.across, ray.direction, direction);
      ray.origin += begin * ray.direction;
      ray.direction = direction;
      ray.fromSurface = true;
      ray.passed = 0.0;
      begin = 0.0;
    }
  }
  path.rays += ray.asked;
}

SoundPath TracePath(const AcousticScene& scene, const SoundTransport& transport, const SoundConditions& conditions,
                    const RayStart& start, RaySamples* samples)
{
  SoundPath path;
  SoundTracer(scene, transport, conditions).Trace(start, path, samples);
  return path;
}

} // namespace echorama
