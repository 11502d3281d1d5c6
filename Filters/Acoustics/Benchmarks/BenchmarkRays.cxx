// SPDX-License-Identifier: BSD-3-Clause
// Rays in a scene of a million triangles: what transport costs beside the bare tree (which is asked where each piece of a
// way ends), what the scene costs, how fast media are looked up, and how errors fall with the number of rays where chance has a
// part. An argument is the number of triangles of the scene, in millions.
//
// Errors are against other ways to the same: every sphere and each of its triangles tried in double precision; and, for what is
// random, the same rules once more for balls in closed form, with another generator and very many rays (reference_error: the
// standard error of their mean).
#include "Core/Base/Angles.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Acoustics/AcousticScene.h"
#include "Filters/Acoustics/ScatterCounting.h"
#include "Filters/Acoustics/SceneTree.h"
#include "Filters/Acoustics/SoundTransport.h"
#include "Filters/Tissue/Icosphere.h"
#include "Filters/Tissue/PackedTissue.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <Eigen/Geometry>
#include <limits>
#include <numeric>
#include <random>
#include <tbb/info.h>

using namespace echorama;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

constexpr int elements = 128, planes = 128;

constexpr double never = std::numeric_limits<double>::infinity();

const ProbeGeometry probe = ProbeGeometry::Convex(1.2, 50.0, 1.0, 40.0, 0.0, 150.0);

// Spheres that fill three tenths of a block of 130 mm, each of 1280 triangles.
struct Block {
  TissueSurface surface;
  std::vector<Sphere> spheres; // body by body
  std::size_t trianglesOfEach;
};

Block Spheres(double millions)
{
  PackedTissueParameters parameters;
  parameters.packing.boxMin = Vector3d(-65, -65, 5);
  parameters.packing.boxMax = Vector3d(65, 65, 135);
  const double count = millions * 1e6 / 1280.0;
  const double radius = std::cbrt(0.3 * parameters.packing.Volume() / count / 4.18879);
  parameters.packing.radiusMin = 0.6 * radius;
  parameters.packing.radiusMax = 1.5 * radius;
  parameters.packing.fillFraction = 0.5;
  parameters.packing.count = static_cast<std::int64_t>(count);
  const SpherePacking packing = PackSpheres(parameters.packing);
  // One level of detail for all: the deviation that each radius has at that level.
  TissueSurface surface;
  surface.materials = {parameters.background};
  const Icosphere sphere = Icosphere::Make(3);
  Random random(5);
  for (const Sphere& place : packing.spheres) {
    const auto material = random.Below(parameters.materials.size());
    surface.bodies.push_back({"", surface.MaterialIndex(parameters.materials[material].material)});
    const auto first = static_cast<std::uint32_t>(surface.points.size());
    const Eigen::Matrix3d turn = ExpRotation(3.0 * random.Direction());
    for (const Vector3d& point : sphere.points)
      surface.points.push_back((place.centre + place.radius * (turn * point)).cast<float>());
    for (const auto& [a, b, c] : sphere.triangles) {
      surface.triangles.push_back({first + a, first + b, first + c});
      surface.bodyOfTriangle.push_back(static_cast<std::int32_t>(surface.bodies.size()) - 1);
    }
  }
  return {surface, packing.spheres, sphere.triangles.size()};
}

// The two ways along a line to a sphere; never when it passes by. What begins at about the sphere has one of about 0.
std::pair<double, double> MeetSphere(const Sphere& sphere, const Vector3d& origin, const Vector3d& direction)
{
  const Vector3d to = sphere.centre - origin;
  const double middle = to.dot(direction), half = sphere.radius * sphere.radius - (to - middle * direction).squaredNorm();
  return half > 0.0 ? std::pair(middle - std::sqrt(half), middle + std::sqrt(half)) : std::pair(never, never);
}

// The corners of a triangle as seen from a place.
std::array<Vector3d, 3> Corners(const Block& block, std::size_t triangle, const Vector3d& from)
{
  std::array<Vector3d, 3> corners;
  for (std::size_t c = 0; c < 3; ++c)
    corners[c] = block.surface.points[block.surface.triangles[triangle][c]].cast<double>() - from;
  return corners;
}

// The way to the first triangle that is further than \a from (Moeller and Trumbore 1997).
double FirstHit(const Block& block, const Vector3d& origin, const Vector3d& direction, double from)
{
  double nearest = never;
  for (std::size_t s = 0; s < block.spheres.size(); ++s) {
    const auto [in, out] = MeetSphere({block.spheres[s].centre, 1.0001 * block.spheres[s].radius}, origin, direction);
    if (in > nearest || out < from || in == never)
      continue;
    for (std::size_t t = s * block.trianglesOfEach; t < (s + 1) * block.trianglesOfEach; ++t) {
      const auto [a, b, c] = Corners(block, t, origin);
      const Vector3d p = direction.cross(c - a), q = (b - a).cross(a);
      const double determinant = (b - a).dot(p), u = -a.dot(p) / determinant, v = direction.dot(q) / determinant;
      const double distance = (c - a).dot(q) / determinant;
      if (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > from)
        nearest = std::min(nearest, distance);
    }
  }
  return nearest;
}

// The material at a place: within a body the solid angles of its triangles sum up to 4 pi (van Oosterom and Strackee 1983).
int MaterialAt(const Block& block, const Vector3d& place)
{
  for (std::size_t s = 0; s < block.spheres.size(); ++s) {
    const double distance = (place - block.spheres[s].centre).norm() / block.spheres[s].radius;
    if (distance > 1.0001)
      continue;
    double angle = distance < 0.98 ? 4.0 * Pi : 0.0; // triangles lie between the two
    for (std::size_t t = s * block.trianglesOfEach; distance >= 0.98 && t < (s + 1) * block.trianglesOfEach; ++t) {
      const auto [a, b, c] = Corners(block, t, place);
      const double la = a.norm(), lb = b.norm(), lc = c.norm();
      angle += 2.0 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    if (angle > 2.0 * Pi)
      return block.surface.bodies[s].material;
  }
  return 0;
}

RayStart StartOf(int j, int k, const AcousticScene& scene)
{
  const BeamPoint at{0.0, j / (elements - 1.0) - 0.5, k / (planes - 1.0) - 0.5};
  RayStart start;
  start.origin = PointOf(probe, at);
  start.direction = DirectionOf(probe, at);
  start.across = Vector3d::UnitX().cross(start.direction).cross(start.direction).normalized();
  start.inside = scene.BodiesAt(start.origin);
  return start;
}

// The block's triangles in bare Embree, and what it is asked.
SceneTree TreeOf(const TissueSurface& surface)
{
  std::vector<std::uint32_t> all(surface.triangles.size());
  std::iota(all.begin(), all.end(), 0u);
  return SceneTree(surface.points, surface.triangles, all);
}

struct Question {
  SceneTree::Line line;
  float far; // mm
};

Question QuestionOf(const Vector3d& from, const Vector3d& direction, double far)
{
  Question question;
  question.line.origin = from.cast<float>();
  question.line.direction = direction.cast<float>();
  question.far = static_cast<float>(far);
  return question;
}

void Transport(const AcousticScene& scene, const Block& block, const std::string& name)
{
  std::vector<RayStart> starts(elements * planes);
  ParallelFor(planes, [&](std::ptrdiff_t k) {
    for (int j = 0; j < elements; ++j)
      starts[static_cast<std::size_t>(k * elements + j)] = StartOf(j, static_cast<int>(k), scene);
  });
  const SoundTracer tracer(scene, SoundTransport(), SoundConditions());
  const SceneTree tree = TreeOf(block.surface);
  const auto tolerance = static_cast<float>(scene.Tolerance());
  std::vector<std::vector<Question>> ends(planes); // of all pieces of the ways
  std::vector<Question> primary;
  double segments = 0.0, questions = 0.0;
  std::vector<SoundSegment> some; // the paths of one beam in 61
  for (std::size_t k = 0; k < planes; ++k)
    for (std::size_t j = 0; j < elements; ++j) {
      SoundPath path;
      const RayStart& start = starts[k * elements + j];
      tracer.Trace(start, path);
      primary.push_back(QuestionOf(start.origin, start.direction, probe.depthMax));
      for (const SoundSegment& segment : path.segments)
        ends[k].push_back(QuestionOf(segment.from, segment.direction, segment.length + scene.Tolerance()));
      segments += static_cast<double>(path.segments.size());
      if ((k * elements + j) % 61 == 0)
        some.insert(some.end(), path.segments.begin(), path.segments.end());
      questions += static_cast<double>(path.rays);
    }
  const auto transport = [&] {
    ParallelFor(planes, [&](std::ptrdiff_t k) {
      SoundPath path;
      for (std::size_t j = 0; j < elements; ++j)
        tracer.Trace(starts[static_cast<std::size_t>(k) * elements + j], path);
    });
  };
  const auto replay = [&] {
    ParallelFor(planes, [&](std::ptrdiff_t k) {
      std::vector<SceneTree::Hit> mine;
      for (const Question& end : ends[static_cast<std::size_t>(k)])
        tree.FirstHits(end.line, tolerance, end.far, tolerance, mine);
    });
  };
  // In turn, and by the processor's time beside the clock's: machines are shared.
  std::vector<double> clocks[2], processor[2];
  for (int run = 0; run < 8; ++run)
    for (int which = 0; which < 2; ++which) {
      const std::clock_t before = std::clock();
      const double seconds = which == 0 ? benchmark::Seconds(transport) : benchmark::Seconds(replay);
      if (run == 0)
        continue; // warms up
      clocks[which].push_back(seconds);
      processor[which].push_back(static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC);
    }
  const auto median = [](std::vector<double>& values) {
    std::nth_element(values.begin(), values.begin() + 3, values.end());
    return values[3];
  };
  const double ours = median(clocks[0]), bare = median(clocks[1]);
  const double oursProcessor = median(processor[0]), bareProcessor = median(processor[1]);

  // Segments that end at a surface, which is where the next goes on, must end at the first triangle; all others before it. And
  // each must lie in its medium.
  constexpr double same = 0.01; // mm, that ends of segments may be apart
  std::vector<double> differences(some.size(), 0.0);
  std::vector<char> wrong(some.size(), 0);
  ParallelRanges(static_cast<std::ptrdiff_t>(some.size()), 64, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (auto n = static_cast<std::size_t>(begin); n < static_cast<std::size_t>(end); ++n) {
      const SoundSegment& segment = some[n];
      const Vector3d last = segment.from + segment.length * segment.direction;
      const bool goesOn =
          n + 1 < some.size() && some[n + 1].bounces == segment.bounces && (some[n + 1].from - last).norm() < same;
      const double hit = FirstHit(block, segment.from, segment.direction, std::min(same, 0.5 * segment.length));
      differences[n] = goesOn || hit < segment.length ? std::abs(hit - segment.length) : 0.0;
      wrong[n] = MaterialAt(block, segment.from + 0.5 * segment.length * segment.direction) != segment.medium;
    }
  });
  const auto contradicted = std::count_if(differences.begin(), differences.end(), [](double mm) { return !(mm <= same); });
  const auto inOtherMedium = std::count(wrong.begin(), wrong.end(), 1);
  const auto numbers = [&](double clock, double processorSeconds, double rays) {
    return nlohmann::ordered_json{{"cpu_seconds", processorSeconds},
                                  {"questions", rays},
                                  {"segments", segments},
                                  {"rays_per_second", rays / clock},
                                  {"share_of_bare_rate", rays / processorSeconds * bareProcessor / segments},
                                  {"runs", 7},
                                  {"threads", tbb::info::default_concurrency()}};
  };
  nlohmann::ordered_json more = numbers(ours, oursProcessor, questions);
  more.update({{"reference", "all triangles, double precision"},
               {"segments_compared", some.size()},
               {"off_by_more_than_mm", same},
               {"in_other_medium", inOtherMedium},
               {"largest_mm", *std::max_element(differences.begin(), differences.end())}});
  benchmark::Report("rays", name + ", 128 x 128 beams", "transport", ours,
                    static_cast<double>(contradicted) / static_cast<double>(some.size()), "share of segments with another end",
                    more);
  benchmark::ReportTime("rays", name + ", 128 x 128 beams", "the ends of its ways by bare Embree (peer)", bare,
                        numbers(bare, bareProcessor, segments));

  const double seconds = benchmark::MedianSeconds([&] {
    ParallelRanges(static_cast<std::ptrdiff_t>(primary.size()), 1024, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
      std::vector<SceneTree::Hit> hits;
      for (auto n = static_cast<std::size_t>(begin); n < static_cast<std::size_t>(end); ++n)
        tree.FirstHits(primary[n].line, 0.0f, primary[n].far, tolerance, hits);
    });
  });
  benchmark::ReportTime("rays", name + ", first rays alone", "Embree, one by one", seconds,
                        {{"rays_per_second", static_cast<double>(primary.size()) / seconds}});
}

void Media(const AcousticScene& scene, const Block& block, const std::string& name)
{
  // As scatterers ask: brick by brick, and at random.
  constexpr std::size_t count = 2000000, brick = 64;
  Random random(11);
  for (const bool together : {true, false}) {
    std::vector<Vector3f> points(count);
    Vector3d corner = Vector3d::Zero();
    for (std::size_t i = 0; i < count; ++i) {
      if (!together || i % brick == 0)
        corner = Vector3d(random.Uniform(-65, 65), random.Uniform(-65, 65), random.Uniform(5, 135));
      points[i] = (corner + 2.0 * Vector3d(random.Uniform(), random.Uniform(), random.Uniform())).cast<float>();
    }
    std::vector<std::int32_t> media(count);
    const double seconds = benchmark::MedianSeconds(
        [&] {
          ParallelRanges(count, 4096, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
            scene.MediumAt(points.data() + begin, static_cast<std::size_t>(end - begin), media.data() + begin);
          });
        },
        3);
    constexpr std::ptrdiff_t apart = 10;
    const auto wrong = ParallelSum<std::ptrdiff_t>(count / apart, 4096, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
      std::ptrdiff_t sum = 0;
      for (std::ptrdiff_t n = begin; n < end; ++n) {
        const auto i = static_cast<std::size_t>(apart * n);
        sum += MaterialAt(block, points[i].cast<double>()) != media[i];
      }
      return sum;
    });
    benchmark::Report("rays", name + ", media of two million points", together ? "in bricks of 2 mm" : "at random", seconds,
                      static_cast<double>(wrong * apart) / count, "share of points in another medium",
                      {{"points_per_second", count / seconds},
                       {"reference", "spheres and solid angles of triangles, double precision"},
                       {"points_compared", count / apart}});
  }
}

// The slope of log error over log rays.
double Slope(const std::vector<std::pair<double, double>>& errors)
{
  double x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  for (const auto& [rays, error] : errors) {
    const double a = std::log(rays), b = std::log(error);
    x += a;
    y += b;
    xx += a * a;
    xy += a * b;
  }
  const auto n = static_cast<double>(errors.size());
  return (n * xy - x * y) / (n * xx - x * x);
}

double Rms(const std::vector<double>& a, const std::vector<double>& b)
{
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

struct Ball {
  Sphere sphere;
  Material material;
};

// A ray among balls of which none overlap, in closed form: where it is, and within which ball (-1: in the background).
struct PlainRay {
  const std::vector<Ball>& balls;
  const Material& background;
  std::mt19937_64& generator;
  Vector3d place, direction = Vector3d::UnitZ();
  int inside = -1;

  double Chance() { return std::uniform_real_distribution<double>()(generator); }
  const Material& MaterialOf(int ball) const { return ball < 0 ? background : balls[static_cast<std::size_t>(ball)].material; }

  // The way to the next surface, and whose it is.
  std::pair<double, int> Next() const
  {
    if (inside >= 0)
      return {MeetSphere(balls[static_cast<std::size_t>(inside)].sphere, place, direction).second, inside};
    std::pair<double, int> next(never, -1);
    for (std::size_t b = 0; b < balls.size(); ++b)
      if (const double in = MeetSphere(balls[b].sphere, place, direction).first; in > 1e-9)
        next = std::min(next, {in, static_cast<int>(b)});
    return next;
  }

  // At the surface of a ball: the reflected pressure by Fresnel; the normal against the ray, the cosines before and behind, and
  // the ratio of the speeds of sound.
  struct Surface {
    double reflected;
    Vector3d normal;
    double before, behind, ratio;
  };
  Surface Meet(int ball) const
  {
    const Sphere& sphere = balls[static_cast<std::size_t>(ball)].sphere;
    const Vector3d normal = (inside < 0 ? 1.0 : -1.0) * (place - sphere.centre).normalized();
    const Material &here = MaterialOf(inside), &there = MaterialOf(inside < 0 ? ball : -1);
    const double before = -direction.dot(normal), ratio = there.soundSpeed / here.soundSpeed;
    const double behind = std::sqrt(std::max(0.0, 1.0 - ratio * ratio * (1.0 - before * before)));
    const double a = there.Impedance() * before, b = here.Impedance() * behind;
    return {(a - b) / (a + b), normal, before, behind, ratio};
  }

  // Turned away from an axis: to a cosine, and any way round.
  void Turn(const Vector3d& axis, double cosine)
  {
    const Vector3d first = axis.unitOrthogonal();
    const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine)), angle = 2.0 * Pi * Chance();
    direction = cosine * axis + sine * (std::cos(angle) * first + std::sin(angle) * axis.cross(first));
  }
};

constexpr int samples = 64, beams = 32;
constexpr double width = 60.0, depth = 100.0; // mm, of a linear probe

Vector3d ElementOf(std::ptrdiff_t beam)
{
  return {width * (static_cast<double>(beam) / (beams - 1) - 0.5), 0.0, 0.0};
}

// What CountScatters counts, by its rules.
std::vector<double> PlainCounting(const std::vector<Ball>& balls, const Material& background, const ScatterCounting& p,
                                  std::uint64_t seed, int rays)
{
  std::vector<double> image(beams * samples, 0.0);
  ParallelFor(beams, [&](std::ptrdiff_t beam) {
    std::mt19937_64 generator(seed * beams + static_cast<std::uint64_t>(beam));
    const Vector3d element = ElementOf(beam);
    for (int n = 0; n < rays; ++n) {
      PlainRay ray{balls, background, generator, element};
      double path = 0.0; // in scan depth
      for (int event = 0; event < p.maxEvents; ++event) {
        const Material& here = ray.MaterialOf(ray.inside);
        const double perMm = p.assumedSoundSpeed / here.soundSpeed;
        const double scatter = std::log(1.0 - ray.Chance()) / std::log1p(-here.scatterProbability);
        const auto [surface, ball] = ray.Next();
        const double way = std::min(scatter, surface);
        path += way * perMm;
        if (path > 2.0 * depth)
          break;
        ray.place += way * ray.direction;
        const Vector3d back = ray.place - element;
        const auto count = [&](double weight) {
          const double at = 0.5 * (path + back.norm() * perMm) / depth * (samples - 1), t = at - std::floor(at);
          const double value = weight * std::pow(std::max(0.0, back.z() / back.norm()), p.clarity) / rays;
          const auto i = static_cast<std::size_t>(at);
          if (i < samples)
            image[static_cast<std::size_t>(beam) * samples + i] += (1.0 - t) * value;
          if (i + 1 < samples)
            image[static_cast<std::size_t>(beam) * samples + i + 1] += t * value;
        };
        if (scatter < surface) {
          count(1.0);
          ray.Turn(ray.direction, 1.0 - ray.Chance() * (1.0 - std::cos(p.coneDegrees * RadiansPerDegree)));
          continue;
        }
        const PlainRay::Surface met = ray.Meet(ball);
        count(met.reflected * met.reflected);
        if (ray.Chance() < met.reflected * met.reflected) {
          ray.direction += 2.0 * met.before * met.normal;
        } else {
          ray.direction = met.ratio * ray.direction + (met.ratio * met.before - met.behind) * met.normal;
          ray.inside = ray.inside < 0 ? ball : -1;
        }
        ray.direction.normalize();
      }
    }
  });
  return image;
}

constexpr double binMm = 2.0;
constexpr std::size_t bins = 100; // per beam

// Echoes of the tracer among rough balls that swallow what enters them, by its rules: mean amplitude after a bounce.
std::vector<double> PlainBounces(const std::vector<Ball>& balls, const Material& background, const SoundTransport& transport,
                                 const SoundConditions& conditions, std::uint64_t seed, int rays)
{
  std::vector<double> image(beams * bins, 0.0);
  const double caught = std::pow(transport.acceptanceDegrees * RadiansPerDegree, 2);
  const double neperPerMm = std::log(10.0) / 10.0 * background.AttenuationDbPerMm(conditions.frequencyMHz); // there and back
  ParallelFor(beams, [&](std::ptrdiff_t beam) {
    std::mt19937_64 generator(seed * beams + static_cast<std::uint64_t>(beam));
    for (int n = 0; n < rays; ++n) {
      PlainRay ray{balls, background, generator, ElementOf(beam)};
      double path = 0.0, amplitude = 1.0;
      for (int bounce = 0; bounce <= transport.maxBounces; ++bounce) {
        const auto [way, ball] = ray.Next();
        path += way * conditions.assumedSoundSpeed / background.soundSpeed;
        if (path > conditions.maxScanDepth)
          break;
        ray.place += way * ray.direction;
        amplitude *= std::exp(-neperPerMm * way);
        const PlainRay::Surface met = ray.Meet(ball);
        const double returned = std::sqrt(caught * met.before);
        if (bounce > 0)
          image[static_cast<std::size_t>(beam) * bins + static_cast<std::size_t>(path / binMm)] +=
              std::abs(amplitude * met.reflected * returned) / rays;
        amplitude *= met.reflected * met.reflected * returned;
        ray.Turn(met.normal, std::sqrt(1.0 - ray.Chance()));
      }
    }
  });
  return image;
}

// Runs image(sampling, seed, rays) for growing numbers of rays and some seeds, against plain(seed, rays) of very many rays.
template <class Image, class Plain>
void Convergence(const std::string& name, const std::string& unit, const Image& image, const Plain& plain)
{
  constexpr int most = 4096;
  const int trials = benchmark::Trials(4), many = benchmark::Smoke() ? most : 32 * most;
  std::vector<double> truth = plain(1, many);
  const std::vector<double> other = plain(2, many);
  const double referenceError = 0.5 * Rms(truth, other);
  for (std::size_t i = 0; i < truth.size(); ++i)
    truth[i] = 0.5 * (truth[i] + other[i]);
  for (const auto& [sampling, method] : {std::pair(Sampling::Random, "random"), std::pair(Sampling::Stratified, "stratified"),
                                         std::pair(Sampling::Sobol, "Sobol")}) {
    std::vector<std::pair<double, double>> errors;
    std::vector<double> seconds;
    for (int rays = 16; rays <= most; rays *= 4) {
      double squares = 0.0, all = 0.0;
      for (int trial = 1; trial <= trials; ++trial) {
        std::vector<double> result;
        all += benchmark::Seconds([&, s = sampling] { result = image(s, static_cast<std::uint64_t>(trial), rays); });
        const double error = Rms(result, truth);
        squares += error * error;
      }
      seconds.push_back(all / trials);
      errors.emplace_back(rays, std::sqrt(squares / trials));
    }
    const double slope = Slope(errors);
    for (std::size_t i = 0; i < errors.size(); ++i)
      benchmark::Report("rays", name, method, seconds[i], errors[i].second, unit,
                        {{"rays", errors[i].first},
                         {"slope", slope},
                         {"trials", trials},
                         {"reference", "the same rules for balls in closed form"},
                         {"reference_rays", 2 * many},
                         {"reference_error", referenceError}});
  }
}

AcousticScene SceneOf(const std::vector<Ball>& balls, const Material& background)
{
  TissueSurface surface;
  surface.materials = {background};
  const Icosphere sphere = Icosphere::Make(6); // within 0.001 mm of the balls
  for (const Ball& ball : balls) {
    surface.bodies.push_back({"", surface.MaterialIndex(ball.material)});
    const auto first = static_cast<std::uint32_t>(surface.points.size());
    for (const Vector3d& point : sphere.points)
      surface.points.push_back((ball.sphere.centre + ball.sphere.radius * point).cast<float>());
    for (const auto& [a, b, c] : sphere.triangles) {
      surface.triangles.push_back({first + a, first + b, first + c});
      surface.bodyOfTriangle.push_back(static_cast<std::int32_t>(surface.bodies.size()) - 1);
    }
  }
  return AcousticScene(surface);
}

void ScatterErrors()
{
  const Material& tissue = StandardMaterial("tissue");
  const ProbeGeometry flat = ProbeGeometry::Linear(width, 0, 0, depth);
  std::vector<Ball> balls{{{{-15, 0, 40}, 12}, StandardMaterial("lesion-bright")}, {{{18, 0, 55}, 14}, StandardMaterial("cyst")}};
  for (const bool withBone : {false, true}) { // where rays scatter every mm or two
    if (withBone)
      balls.push_back({{{0, 0, 80}, 8}, StandardMaterial("bone")});
    const AcousticScene scene = SceneOf(balls, tissue);
    Convergence(
        withBone ? "scatter counting, with bone" : "scatter counting, soft tissue", "RMS, events per ray and sample",
        [&](Sampling sampling, std::uint64_t seed, int rays) {
          ScatterCounting parameters;
          parameters.sampling = sampling;
          parameters.seed = seed;
          parameters.raysPerElement = rays;
          const auto volume = CountScatters(scene, parameters, flat, Pose::Identity(), {samples, beams, 1});
          return std::vector<double>(volume.View().begin(), volume.View().end());
        },
        [&](std::uint64_t seed, int rays) { return PlainCounting(balls, tissue, ScatterCounting(), seed, rays); });
  }

  // Echoes that a rough ball sends on to a second one: the mean amplitude in each 2 mm, over the rays of each beam. All that
  // counts happens outside of them and away from the probe.
  Material rough = StandardMaterial("bone");
  rough.roughness = 1.0;
  rough.attenuation = 200.0;
  balls = {{{{-12, 0, 40}, 14}, rough}, {{{18, 0, 42}, 13}, rough}};
  const AcousticScene bones = SceneOf(balls, tissue);
  SoundTransport transport;
  transport.maxBounces = 2;
  transport.dynamicRangeDb = 300.0;
  transport.faceReflection = 0.0;
  const SoundConditions conditions;
  const SoundTracer tracer(bones, transport, conditions);
  Convergence(
      "rough bones, echoes after a bounce", "RMS, amplitude in 2 mm",
      [&](Sampling sampling, std::uint64_t seed, int rays) {
        std::vector<double> image(beams * bins, 0.0);
        ParallelFor(beams, [&](std::ptrdiff_t beam) {
          RayStart start;
          start.origin = ElementOf(beam);
          SoundPath path;
          for (int ray = 0; ray < rays; ++ray) {
            RaySamples numbers(sampling, seed, static_cast<std::uint64_t>(beam), static_cast<std::uint32_t>(ray),
                               static_cast<std::uint32_t>(rays));
            tracer.Trace(start, path, &numbers);
            for (const SurfaceEcho& echo : path.echoes)
              if (echo.bounces > 0)
                image[static_cast<std::size_t>(beam) * bins + static_cast<std::size_t>(echo.scanDepth / binMm)] +=
                    std::abs(echo.amplitude) / rays;
          }
        });
        return image;
      },
      [&](std::uint64_t seed, int rays) { return PlainBounces(balls, tissue, transport, conditions, seed, rays); });
}

} // namespace

int main(int argc, char** argv)
{
  const double millions = argc > 1 ? std::atof(argv[1]) : benchmark::Smoke() ? 0.05 : 1.0;
  const Block block = Spheres(millions);
  const TissueSurface& surface = block.surface;
  const std::string name =
      argc > 1 || benchmark::Smoke() ? std::to_string(surface.triangles.size()) + " triangles" : "a million triangles";
  std::unique_ptr<AcousticScene> scene;
  const double seconds = benchmark::MedianSeconds([&] { scene = std::make_unique<AcousticScene>(surface); }, 3);
  benchmark::ReportTime("rays", name + ", scene", "built", seconds,
                        {{"triangles", surface.triangles.size()},
                         {"shells", scene->GetNotes().shells},
                         {"scene_mb", static_cast<double>(scene->MemoryBytes()) / 1048576.0}});
  Transport(*scene, block, name);
  Media(*scene, block, name);
  if (argc <= 1)
    ScatterErrors();
}
