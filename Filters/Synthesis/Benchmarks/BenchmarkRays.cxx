// SPDX-License-Identifier: BSD-3-Clause
// Rays in a scene of a million triangles: what transport costs beside the bare tree (the very questions of a run are asked
// again), what the scene costs, how fast media are looked up, and how errors fall with the number of rays where chance has a
// part. An argument is the number of triangles of the scene, in millions.
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Synthesis/AcousticScene.h"
#include "Filters/Synthesis/Icosphere.h"
#include "Filters/Synthesis/PackedTissue.h"
#include "Filters/Synthesis/ScatterCounting.h"
#include "Filters/Synthesis/SoundTransport.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <Eigen/Geometry>
#include <numeric>

using namespace echorama;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

constexpr int elements = 128, planes = 128;

const ProbeGeometry probe = ProbeGeometry::Convex(1.2, 50.0, 1.0, 40.0, 0.0, 150.0);

// Spheres that fill three tenths of a block of 130 mm, each of 1280 triangles.
TissueSurface Spheres(double millions)
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
  return surface;
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

void Transport(const AcousticScene& scene, const std::string& name)
{
  std::vector<RayStart> starts(elements * planes);
  ParallelFor(planes, [&](std::ptrdiff_t k) {
    for (int j = 0; j < elements; ++j)
      starts[static_cast<std::size_t>(k * elements + j)] = StartOf(j, static_cast<int>(k), scene);
  });
  const SoundTracer tracer(scene, SoundTransport(), SoundConditions());
  using Questions = std::vector<SceneRay::Question>;
  std::vector<Questions> asked(planes);
  Questions primary;
  double segments = 0.0, questions = 0.0;
  for (std::size_t k = 0; k < planes; ++k)
    for (std::size_t j = 0; j < elements; ++j) {
      SoundPath path;
      const std::size_t before = asked[k].size();
      tracer.Trace(starts[k * elements + j], path, nullptr, &asked[k]);
      if (asked[k].size() > before)
        primary.push_back(asked[k][before]);
      segments += static_cast<double>(path.segments.size());
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
      const Questions& mine = asked[static_cast<std::size_t>(k)];
      scene.Ask(mine.data(), mine.size());
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
  const auto report = [&](const std::string& method, double seconds, double processorSeconds) {
    benchmark::Report("rays", name + ", 128 x 128 beams", method, seconds, std::nan(""), "",
                      {{"cpu_seconds", processorSeconds},
                       {"questions", questions},
                       {"segments", segments},
                       {"rays_per_second", questions / seconds},
                       {"share_of_bare_rate", bareProcessor / processorSeconds}});
  };
  report("transport", ours, oursProcessor);
  report("the same questions to Embree (peer)", bare, bareProcessor);

  const double seconds = benchmark::MedianSeconds([&] {
    ParallelRanges(static_cast<std::ptrdiff_t>(primary.size()), 1024, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
      scene.Ask(primary.data() + begin, static_cast<std::size_t>(end - begin));
    });
  });
  benchmark::Report("rays", name + ", first rays alone", "Embree, one by one", seconds, std::nan(""), "",
                    {{"rays_per_second", static_cast<double>(primary.size()) / seconds}});
}

void Media(const AcousticScene& scene, const std::string& name)
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
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < 20000; ++i)
      wrong += scene.MediumOf(scene.BodiesAt(points[i].cast<double>())) != media[i];
    benchmark::Report("rays", name + ", media of two million points", together ? "in bricks of 2 mm" : "at random", seconds,
                      static_cast<double>(wrong) / 20000, "share that long rays contradict",
                      {{"points_per_second", count / seconds}});
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

// Runs image(sampling, seed, rays) for growing numbers of rays and some seeds, against one of very many rays.
template <class Image>
void Convergence(const std::string& name, const std::string& unit, const Image& image)
{
  constexpr int most = 4096, seeds = 4;
  const std::vector<double> truth = image(Sampling::Sobol, 1000, 32 * most);
  for (const auto& [sampling, method] : {std::pair(Sampling::Random, "random"), std::pair(Sampling::Stratified, "stratified"),
                                         std::pair(Sampling::Sobol, "Sobol")}) {
    std::vector<std::pair<double, double>> errors;
    std::vector<double> seconds;
    for (int rays = 16; rays <= most; rays *= 4) {
      double squares = 0.0, all = 0.0;
      for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
        std::vector<double> result;
        all += benchmark::Seconds([&, s = sampling] { result = image(s, seed, rays); });
        const double error = Rms(result, truth);
        squares += error * error;
      }
      seconds.push_back(all / seeds);
      errors.emplace_back(rays, std::sqrt(squares / seeds));
    }
    const double slope = Slope(errors);
    for (std::size_t i = 0; i < errors.size(); ++i)
      benchmark::Report("rays", name, method, seconds[i], errors[i].second, unit, {{"rays", errors[i].first}, {"slope", slope}});
  }
}

void ScatterErrors()
{
  TissueSurface surface;
  surface.materials = {StandardMaterial("tissue")};
  const Icosphere sphere = Icosphere::Make(4);
  const auto add = [&](const Material& material, const Vector3d& centre, double radius) {
    surface.bodies.push_back({"", surface.MaterialIndex(material)});
    const auto first = static_cast<std::uint32_t>(surface.points.size());
    for (const Vector3d& point : sphere.points)
      surface.points.push_back((centre + radius * point).cast<float>());
    for (const auto& [a, b, c] : sphere.triangles) {
      surface.triangles.push_back({first + a, first + b, first + c});
      surface.bodyOfTriangle.push_back(static_cast<std::int32_t>(surface.bodies.size()) - 1);
    }
  };
  add(StandardMaterial("lesion-bright"), {-15, 0, 40}, 12);
  add(StandardMaterial("cyst"), {18, 0, 55}, 14);
  const ProbeGeometry flat = ProbeGeometry::Linear(60, 0, 0, 100);
  constexpr int samples = 64, beams = 32;
  for (const bool withBone : {false, true}) { // where rays scatter every mm or two
    if (withBone)
      add(StandardMaterial("bone"), {0, 0, 80}, 8);
    const AcousticScene scene(surface);
    Convergence(withBone ? "scatter counting, with bone" : "scatter counting, soft tissue",
                "RMS to converged, events per ray and sample", [&](Sampling sampling, std::uint64_t seed, int rays) {
                  ScatterCounting parameters;
                  parameters.sampling = sampling;
                  parameters.seed = seed;
                  parameters.raysPerElement = rays;
                  const auto volume = CountScatters(scene, parameters, flat, Pose::Identity(), {samples, beams, 1});
                  return std::vector<double>(volume.View().begin(), volume.View().end());
                });
  }

  // Echoes that a rough bone sends on to a second one: the mean amplitude in each 2 mm, over the rays of each beam.
  Material rough = StandardMaterial("bone");
  rough.roughness = 1.0;
  surface.triangles.clear();
  surface.bodyOfTriangle.clear();
  surface.bodies.clear();
  add(rough, {-12, 0, 40}, 14);
  add(rough, {18, 0, 42}, 13);
  const AcousticScene bones(surface);
  SoundTransport transport;
  transport.maxBounces = 2;
  transport.dynamicRangeDb = 160.0;
  const SoundTracer tracer(bones, transport, SoundConditions());
  Convergence("rough bones, echoes after a bounce", "RMS to converged, amplitude in 2 mm",
              [&](Sampling sampling, std::uint64_t seed, int rays) {
                std::vector<double> image(beams * 100, 0.0);
                ParallelFor(beams, [&](std::ptrdiff_t beam) {
                  RayStart start;
                  start.origin = Vector3d(60.0 * static_cast<double>(beam) / (beams - 1) - 30.0, 0.1, 0.0);
                  SoundPath path;
                  for (int ray = 0; ray < rays; ++ray) {
                    RaySamples numbers(sampling, seed, static_cast<std::uint64_t>(beam), static_cast<std::uint32_t>(ray),
                                       static_cast<std::uint32_t>(rays));
                    tracer.Trace(start, path, &numbers);
                    for (const SurfaceEcho& echo : path.echoes)
                      if (echo.bounces > 0 && echo.scanDepth < 200.0)
                        image[static_cast<std::size_t>(beam * 100 + static_cast<int>(echo.scanDepth / 2.0))] +=
                            std::abs(echo.amplitude) / rays;
                  }
                });
                return image;
              });
}

} // namespace

int main(int argc, char** argv)
{
  const double millions = argc > 1 ? std::atof(argv[1]) : benchmark::Smoke() ? 0.05 : 1.0;
  const TissueSurface surface = Spheres(millions);
  const std::string name =
      argc > 1 || benchmark::Smoke() ? std::to_string(surface.triangles.size()) + " triangles" : "a million triangles";
  std::unique_ptr<AcousticScene> scene;
  const double seconds = benchmark::MedianSeconds([&] { scene = std::make_unique<AcousticScene>(surface); }, 3);
  benchmark::Report("rays", name + ", scene", "built", seconds, std::nan(""), "",
                    {{"triangles", surface.triangles.size()},
                     {"shells", scene->GetNotes().shells},
                     {"scene_mb", static_cast<double>(scene->MemoryBytes()) / 1048576.0}});
  Transport(*scene, name);
  Media(*scene, name);
  if (argc <= 1)
    ScatterErrors();
}
