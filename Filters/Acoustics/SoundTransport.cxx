// SPDX-License-Identifier: BSD-3-Clause
//
// One way at a time: from where it starts to where it fades, leaves the depth of the scan, or is reflected totally. At each
// interface a reflected way is put aside; when a way is done, its reflections are followed in order, each with all of its own
// before the next. Nothing is drawn at random but the reflections of rough surfaces.
//
// Cost: one question to the scene's tree per surface, and one at the end of each way.
#include "SoundTransport.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>
#include <limits>

namespace echorama {
namespace {

Eigen::Vector3d MirroredAcross(const Eigen::Vector3d& across, const Eigen::Vector3d& normal)
{
  return (across - 2.0 * across.dot(normal) * normal).normalized();
}

// A direction about the normal, as likely as the cosine of the angle between them.
Eigen::Vector3d LambertDirection(const Eigen::Vector3d& normal, double u, double v)
{
  const Eigen::Vector3d first = normal.unitOrthogonal(), second = normal.cross(first);
  const double radius = std::sqrt(u), angle = 2.0 * Pi * v;
  return (radius * std::cos(angle) * first + radius * std::sin(angle) * second + std::sqrt(1.0 - u) * normal).normalized();
}

} // namespace

ParameterList Describe(SoundTransport& t)
{
  return {
      Parameter("MaxBounces", t.maxBounces, {0, 100}, "", "Reflections that are followed.").Advanced(),
      Parameter("DynamicRangeDb", t.dynamicRangeDb, {10, 300}, "dB",
                "A way of sound ends where its echoes are this far below those of a perfect mirror at the face."),
      Parameter("Refraction", t.refraction, "Whether rays bend where the speed of sound changes.").Advanced(),
      Parameter("FaceReflection", t.faceReflection, {0, 1}, "",
                "Share of the pressure that the face of the probe turns back; 0: no reverberation between probe and tissue.")
          .Advanced(),
      Parameter("FaceRadiusMm", t.faceRadius, {0, 1000}, "mm", "The face turns sound back up to this far from its middle.")
          .Advanced(),
      Parameter("AcceptanceDegrees", t.acceptanceDegrees, {0.1, 90}, "degrees",
                "How far from the normal of a surface its mirror echo is still received: standard deviation of a Gaussian, about "
                "the angle of half the aperture as seen from the focus.")
          .Advanced(),
      Parameter("MaxSegments", t.maxSegments, {1, 1e8}, "",
                "The most straight pieces of one ray's way: a stop for scenes of many mirrors.")
          .Advanced(),
  };
}

ParameterList Describe(SoundConditions& c)
{
  return {Parameter("FrequencyMHz", c.frequencyMHz, {0.1, 100}, "MHz", "Centre frequency."),
          Parameter("AssumedSoundSpeed", c.assumedSoundSpeed, {100, 10000}, "m/s", "How the scanner turns time into depth."),
          Parameter("MaxScanDepth", c.maxScanDepth, {0, 1e5, true}, "mm", "Later echoes are not waited for.")};
}

// A way that is still to be followed.
struct SoundTracer::Way {
  SceneRay ray;
  Eigen::Vector3d across = Eigen::Vector3d::UnitX();
  double way = 0.0, scanDepth = 0.0, amplitude = 1.0; // where it begins
  int bounces = 0;
  bool mayMeetFace = false;
};

SoundTracer::SoundTracer(const AcousticScene& scene, const SoundTransport& transport, const SoundConditions& conditions)
  : scene_(scene), transport_(transport), conditions_(conditions)
{
  CheckRanges(transport);
  CheckRanges(conditions);
  const double neperPerDb = std::log(10.0) / 20.0;
  const Fluid lens{1.5, 1000.0}; // about that of silicone rubber
  for (const Material& material : scene.Materials())
    media_.push_back(
        {{material.Impedance(), material.soundSpeed},
         2.0 * neperPerDb * material.AttenuationDbPerMm(conditions.frequencyMHz),
         conditions.assumedSoundSpeed / material.soundSpeed,
         material.roughness,
         material.IsGas() ? MeetInterface(lens, {material.Impedance(), lens.soundSpeed}, 1.0).transmittedEnergy : 1.0});
  leastAmplitude_ = std::pow(10.0, -transport.dynamicRangeDb / 20.0);
  acceptance_ = transport.acceptanceDegrees * Pi / 180.0;
  caught_ = std::min(1.0, acceptance_ * acceptance_);
}

// How far along the ray, from a place on it, the probe's face is met from its front.
double SoundTracer::WayToFace(const RayStart& start, const Eigen::Vector3d& place, const Eigen::Vector3d& direction) const
{
  const double approach = -direction.dot(start.direction);
  if (approach > 0.0) {
    const double distance = (place - start.origin).dot(start.direction) / approach;
    if (distance > scene_.Tolerance() && (place + distance * direction - start.origin).norm() <= transport_.faceRadius)
      return distance;
  }
  return std::numeric_limits<double>::infinity();
}

void SoundTracer::Trace(const RayStart& start, SoundPath& path, RaySamples* samples) const
{
  path.segments.clear();
  path.echoes.clear();
  path.rays = 0;
  thread_local std::vector<Way> waiting, reflections;
  waiting.clear();
  waiting.emplace_back();
  Way& direct = waiting.back();
  direct.ray.origin = start.origin;
  direct.ray.direction = start.direction;
  direct.ray.inside = start.inside;
  direct.across = start.across;
  direct.scanDepth = start.scanDepth;
  direct.amplitude = start.amplitude * media_[static_cast<std::size_t>(scene_.MediumOf(start.inside))].taken;
  while (!waiting.empty() && path.segments.size() < static_cast<std::size_t>(transport_.maxSegments)) {
    Way next = std::move(waiting.back());
    waiting.pop_back();
    reflections.clear();
    Follow(next, start, path, samples, reflections);
    for (auto reflection = reflections.rbegin(); reflection != reflections.rend(); ++reflection)
      waiting.push_back(std::move(*reflection));
  }
}

// Follows a way to its end. What it reflects is put aside.
void SoundTracer::Follow(Way& way, const RayStart& start, SoundPath& path, RaySamples* samples,
                         std::vector<Way>& reflections) const
{
  SceneRay& ray = way.ray;
  int inMaterial = scene_.MediumOf(ray.inside);
  const double leastReflected = std::max(leastAmplitude_, start.leastReflected);
  const double least = way.bounces > 0 ? leastReflected : leastAmplitude_;
  double begin = 0.0; // of the next segment, along the ray
  const auto echo = [&](double pressure) {
    if (std::abs(way.amplitude * pressure) > least)
      path.echoes.push_back({way.scanDepth, way.amplitude * pressure, way.way, way.bounces});
  };
  const auto reflect = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& direction, const Eigen::Vector3d& across,
                           const BodySet& inside, double amplitude, bool mayMeetFace) {
    if (!(std::abs(amplitude) > leastReflected) || way.bounces >= transport_.maxBounces)
      return;
    Way& reflection = reflections.emplace_back();
    reflection.ray.origin = from;
    reflection.ray.direction = direction;
    reflection.ray.inside = inside;
    reflection.ray.fromSurface = true;
    reflection.across = across;
    reflection.way = way.way;
    reflection.scanDepth = way.scanDepth;
    reflection.amplitude = amplitude;
    reflection.bounces = way.bounces + 1;
    reflection.mayMeetFace = mayMeetFace;
  };

  while (path.segments.size() < static_cast<std::size_t>(transport_.maxSegments)) {
    const Medium& medium = media_[static_cast<std::size_t>(inMaterial)];
    const Eigen::Vector3d from = ray.origin + begin * ray.direction;
    const double toFace = way.mayMeetFace ? WayToFace(start, from, ray.direction) : std::numeric_limits<double>::infinity();
    double length = std::min((conditions_.maxScanDepth - way.scanDepth) / medium.depthPerMm, toFace);
    if (!(length > 0.0))
      break;
    Crossing crossing;
    const bool meets = scene_.NextCrossing(ray, begin + length, crossing);
    if (meets)
      length = std::clamp(crossing.distance - begin, 0.0, length);
    const double atEnd = way.amplitude * std::exp(-medium.attenuation * length);
    const bool fades = !(std::abs(atEnd) > least);
    if (fades) // the segment ends where it does
      length = medium.attenuation > 0.0 ? std::clamp(std::log(std::abs(way.amplitude) / least) / medium.attenuation, 0.0, length)
                                        : 0.0;
    if (length > 0.0) {
      SoundSegment& segment = path.segments.emplace_back();
      segment.from = from;
      segment.direction = ray.direction;
      segment.across = way.across;
      segment.length = length;
      segment.way = way.way;
      segment.scanDepth = way.scanDepth;
      segment.scanDepthPerMm = medium.depthPerMm;
      segment.medium = inMaterial;
      segment.amplitude = way.amplitude;
      segment.attenuation = medium.attenuation;
      segment.bounces = way.bounces;
    }
    if (fades)
      break;
    way.way += length;
    way.scanDepth += length * medium.depthPerMm;
    way.amplitude = atEnd;

    if (!meets) {
      if (length == toFace) { // a mirror that lets nothing pass
        const double reflected = transport_.faceReflection;
        echo(reflected * TurnedBack(-ray.direction.dot(start.direction), 0.0, acceptance_));
        reflect(from + length * ray.direction, Mirrored(ray.direction, start.direction),
                MirroredAcross(way.across, start.direction), ray.inside, way.amplitude * reflected * reflected, false);
      }
      break;
    }

    const bool sheet = crossing.sheet >= 0;
    const Medium& behind = media_[static_cast<std::size_t>(sheet ? crossing.sheet : crossing.after)];
    // Without refraction the interface reflects as the impedances say, at every angle alike.
    const Fluid there = transport_.refraction ? behind.fluid : Fluid{behind.fluid.impedance, medium.fluid.soundSpeed};
    const double ratio = there.soundSpeed / medium.fluid.soundSpeed;
    const bool bends = !sheet && ratio != 1.0;
    Eigen::Vector3d normal = crossing.normal, onward = ray.direction;
    double cosine = -ray.direction.dot(normal);
    InterfaceResponse response = MeetInterface(medium.fluid, there, cosine);
    if (bends && !response.total) {
      onward = Refracted(ray.direction, normal, ratio, response.cosTransmitted);
      if (onward.dot(crossing.facet) >= 0.0) { // at grazing angles the curved normal may bend it back out of the triangle
        normal = crossing.facet;
        cosine = -ray.direction.dot(normal);
        response = MeetInterface(medium.fluid, there, cosine);
        if (!response.total)
          onward = Refracted(ray.direction, normal, ratio, response.cosTransmitted);
      }
    }

    if (response.reflected != 0.0) {
      const double roughness = std::max(medium.roughness, behind.roughness);
      echo(response.reflected * TurnedBack(cosine, roughness, acceptance_));
      const double reflected = way.amplitude * response.reflectedEnergy;
      const Eigen::Vector3d place = ray.origin + crossing.distance * ray.direction;
      const Eigen::Vector3d mirrored = Mirrored(ray.direction, normal), across = MirroredAcross(way.across, normal);
      const bool mayMeetFace = transport_.faceReflection > 0.0;
      bool diffuse = false;
      if (samples && roughness > 0.0) {
        const double choice = samples->Next(), u = samples->Next(), v = samples->Next();
        diffuse = choice < roughness;
        if (diffuse) { // and on the way back a Lambert lobe turns it to the element
          const Eigen::Vector3d direction = LambertDirection(crossing.facet, u, v);
          reflect(place, direction, CarriedThroughBend(across, mirrored, direction), ray.came,
                  reflected * std::sqrt(caught_ * cosine), mayMeetFace);
        }
      }
      if (!diffuse)
        reflect(place, mirrored, across, ray.came, reflected, mayMeetFace);
    }

    if (response.total)
      break;
    way.amplitude *= response.transmittedEnergy;
    begin = crossing.behind;
    if (!sheet)
      inMaterial = crossing.after;
    if (bends) {
      way.across = CarriedThroughBend(way.across, ray.direction, onward);
      ray.origin += begin * ray.direction;
      ray.direction = onward;
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
