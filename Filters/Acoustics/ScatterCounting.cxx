// SPDX-License-Identifier: BSD-3-Clause
//
// The dissertation's algorithm, made again from its prose (the listing is not in the text). A ray goes straight on until it
// scatters or meets an interface. At a scatter event an echo is counted and the ray turns within a cone. At an interface an
// echo is counted with the reflected share of the energy; then the ray is mirrored with that probability, else it goes on,
// bent. It ends when no echo could come back within the depth. An echo lies on the element's own beam, at half the way out
// along the path and straight back; not at the length of the path, which would put every second bounce too deep.
//
// Equations 3.1-3.3 in one draw: with mu = -log(1 - p), d = -log(1 - u) / mu is beyond x with the probability (1 - p)^x.
// log1p keeps the digits of small p; p = 0 and p = 1 are their own cases.
//
// Its grain is the noise of counting: it fades as rays are added. Beams are independent and parallel.
#include "ScatterCounting.h"
#include "Core/Base/Angles.h"
#include "Core/Base/CheckRange.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Interface.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>
#include <limits>

namespace echorama {
namespace {

// Uniform in solid angle within a cone.
Eigen::Vector3d WithinCone(const Eigen::Vector3d& axis, double cosOfCone, double u, double v)
{
  const double cosine = 1.0 - u * (1.0 - cosOfCone), sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
  const Eigen::Vector3d first = axis.unitOrthogonal(), second = axis.cross(first);
  const double angle = 2.0 * Pi * v;
  return (sine * std::cos(angle) * first + sine * std::sin(angle) * second + cosine * axis).normalized();
}

// One beam: where it begins, and its row of samples.
struct Beam {
  Eigen::Vector3d element, direction;
  double depthMin, depthStep;
  int samples;
  float* row;

  // Between the two samples next to it.
  void Add(double depth, double weight) const
  {
    const double place = (depth - depthMin) / depthStep;
    if (!(place > -1.0 && place < samples))
      return;
    const double floor = std::floor(place), t = place - floor;
    const int i = static_cast<int>(floor);
    if (i >= 0)
      row[i] += static_cast<float>((1.0 - t) * weight);
    if (i + 1 < samples)
      row[i + 1] += static_cast<float>(t * weight);
  }
};

class Counting {
public:
  Counting(const AcousticScene& scene, const ScatterCounting& parameters, double maxDepth)
    : scene_(scene), p_(parameters), maxDepth_(maxDepth), cosOfCone_(std::cos(parameters.coneDegrees * Pi / 180.0))
  {
    for (const Material& material : scene.Materials())
      media_.push_back({{material.Impedance(), material.soundSpeed},
                        material.scatterProbability,
                        parameters.assumedSoundSpeed / material.soundSpeed});
  }

  void Follow(const Beam& beam, const BodySet& inside, RaySamples samples) const
  {
    SceneRay ray;
    ray.origin = beam.element;
    ray.direction = beam.direction;
    ray.inside = inside;
    double path = 0.0;  // in scan depth, twice over: as the time says
    double begin = 0.0; // along the ray
    const double weight = 1.0 / p_.raysPerElement;
    for (int event = 0; event < p_.maxEvents; ++event) {
      int medium = scene_.MediumOf(ray.inside);
      const Medium& here = media_[static_cast<std::size_t>(medium)];
      const double limit = begin + (2.0 * maxDepth_ - path) / here.depthPerMm;
      // Three numbers each time, so that a dimension means the same on every ray: how far, and which way.
      const double far = samples.Next(), u = samples.Next(), v = samples.Next();
      const double scatter = begin + ScatterDistance(here.p, far);
      Crossing crossing;
      const double end = std::min(limit, scatter);
      const bool meets = scene_.NextCrossing(ray, end, crossing);
      if (!meets && scatter >= limit)
        return;
      const double at = meets ? std::max(begin, crossing.distance) : scatter;
      path += (at - begin) * here.depthPerMm;
      const Eigen::Vector3d place = ray.origin + at * ray.direction;
      const double back = (place - beam.element).norm() * here.depthPerMm;
      const double heard = weight * ReceiverAttenuation(beam.element, beam.direction, place, p_.clarity);
      if (!meets) {
        beam.Add(0.5 * (path + back), heard);
        if (here.p >= 1.0)
          return; // a solid: every further event would be here
        const Eigen::Vector3d direction = WithinCone(ray.direction, cosOfCone_, u, v);
        const BodySet held = ray.inside;
        ray = SceneRay();
        ray.origin = place;
        ray.direction = direction;
        ray.inside = held;
        begin = 0.0;
        continue;
      }

      const Medium& behind = media_[static_cast<std::size_t>(crossing.sheet >= 0 ? crossing.sheet : crossing.after)];
      const double cosine = std::min(1.0, -ray.direction.dot(crossing.normal));
      const InterfaceResponse response = MeetInterface(here.fluid, behind.fluid, cosine);
      beam.Add(0.5 * (path + back), heard * response.reflectedEnergy);
      begin = crossing.behind;
      if (response.reflectedEnergy > 0.0 && u < response.reflectedEnergy) {
        const Eigen::Vector3d direction = Mirrored(ray.direction, crossing.normal);
        const BodySet came = ray.came;
        ray = SceneRay();
        ray.origin = place;
        ray.direction = direction;
        ray.inside = came;
        ray.fromSurface = true;
        begin = 0.0;
      } else if (crossing.sheet < 0 && here.fluid.soundSpeed != behind.fluid.soundSpeed && !response.total) {
        const Eigen::Vector3d direction =
            Refracted(ray.direction, crossing.normal, behind.fluid.soundSpeed / here.fluid.soundSpeed, response.cosTransmitted);
        const BodySet after = ray.inside;
        const Eigen::Vector3d start = ray.origin + crossing.behind * ray.direction;
        ray = SceneRay();
        ray.origin = start;
        ray.direction = direction;
        ray.inside = after;
        ray.fromSurface = true;
        begin = 0.0;
      }
    }
  }

private:
  struct Medium {
    Fluid fluid;
    double p;
    double depthPerMm;
  };
  const AcousticScene& scene_;
  const ScatterCounting& p_;
  double maxDepth_, cosOfCone_;
  std::vector<Medium> media_;
};

} // namespace

ParameterList Describe(ScatterCounting& c)
{
  return {
      Parameter("RaysPerElement", c.raysPerElement, {1, 1e7}, "", "Rays that each element sends.")
          .When("Mode", "counting")
          .Advanced(),
      Parameter("Clarity", c.clarity, {0, 200}, "",
                "Exponent of the angle at which an echo comes in (dissertation, eq. 3.4): the larger, the clearer.")
          .When("Mode", "counting")
          .Advanced(),
      Parameter("ConeDegrees", c.coneDegrees, {0, 180}, "degrees",
                "A ray that was scattered goes on within this half angle of its old direction.")
          .When("Mode", "counting")
          .Advanced(),
      Parameter("MaxEvents", c.maxEvents, {1, 1e6}, "", "The most scatter events of one ray.")
          .When("Mode", "counting")
          .Advanced(),
      Parameter("AssumedSoundSpeed", c.assumedSoundSpeed, {100, 10000}, "m/s", "How the scanner turns time into depth."),
      Parameter("Sampling", Choice(c.sampling, SamplingNames), "How the rays of an element are drawn."),
      Parameter("Seed", c.seed, {0, 9223372036854775807.0}, "", "Seed of the rays."),
  };
}

double ScatterDistance(double p, double u)
{
  if (!(p > 0.0))
    return std::numeric_limits<double>::infinity();
  if (p >= 1.0)
    return 0.0;
  return std::log1p(-u) / std::log1p(-p);
}

double ReceiverAttenuation(const Eigen::Vector3d& element, const Eigen::Vector3d& direction, const Eigen::Vector3d& point,
                           double clarity)
{
  const Eigen::Vector3d way = point - element;
  const double length = way.norm() * direction.norm();
  if (!(length > 0.0))
    return 1.0; // at the element itself
  return std::pow(std::clamp(direction.dot(way) / length, 0.0, 1.0), clarity);
}

Volume<float> CountScatters(const AcousticScene& scene, const ScatterCounting& parameters, const ProbeGeometry& probe,
                            const Pose& probeToWorld, const std::array<int, 3>& dimensions, const Progress& progress)
{
  CheckRanges(parameters);
  probe.Check();
  CheckRange("number of samples", dimensions[0], 2, 1e6);
  CheckRange("number of elements", dimensions[1], 1, 1e6);
  CheckRange("number of planes", dimensions[2], 1, 1e6);
  Volume<float> intensities(dimensions, 0.0f);
  const VolumeView<float> rows = intensities.View();
  const Counting counting(scene, parameters, probe.depthMax);
  const auto place = [](std::ptrdiff_t i, int count) { return count > 1 ? static_cast<double>(i) / (count - 1) - 0.5 : 0.0; };
  const std::ptrdiff_t beams = static_cast<std::ptrdiff_t>(dimensions[1]) * dimensions[2];
  ParallelFor(beams, progress, [&](std::ptrdiff_t b) {
    const std::ptrdiff_t j = b % dimensions[1], k = b / dimensions[1];
    const BeamPoint at{0.0, place(j, dimensions[1]), place(k, dimensions[2])};
    Beam beam{probeToWorld * PointOf(probe, at),
              probeToWorld.linear() * DirectionOf(probe, at),
              probe.depthMin,
              (probe.depthMax - probe.depthMin) / (dimensions[0] - 1),
              dimensions[0],
              rows.Row(static_cast<int>(j), static_cast<int>(k))};
    const BodySet inside = scene.BodiesAt(beam.element);
    for (int ray = 0; ray < parameters.raysPerElement; ++ray)
      counting.Follow(beam, inside,
                      RaySamples(parameters.sampling, parameters.seed, static_cast<std::uint64_t>(b),
                                 static_cast<std::uint32_t>(ray), static_cast<std::uint32_t>(parameters.raysPerElement)));
  });
  return intensities;
}

} // namespace echorama
