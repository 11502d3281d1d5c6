// SPDX-License-Identifier: BSD-3-Clause
// Diffusion: time and error of the fast sum against the exact one, and the time of vtkShepardMethod.
//
//   BenchmarkDiffusion [128] [256] [sweep]      (all without an argument)
//
// The surface is that of two fan-shaped views joined, some 20,000 voxels at 128^3 and 80,000 at 256^3; its values are a smooth
// pattern with noise of 25 grey levels, cut to 0 ... 255. Errors are grey levels. At 256^3 the exact sum is taken in one tile
// of 8^3 voxels among three hundred, and its time scaled by their number. "sweep" is error against time for accuracies from
// 0.0001 to 0.1.
//
// vtkShepardMethod would take minutes: it runs at 48^3 with every fourth source, and its time is scaled by the number of pairs of
// voxels and sources.
#include "Core/Base/Random.h"
#include "Filters/Embedding/Diffusion.h"
#include "Filters/Embedding/RegionSurface.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <limits>
#include <map>
#include <set>
#ifdef ECHORAMA_WITH_VTK
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkShepardMethod.h>
#endif

using namespace echorama;

namespace {

struct Scene {
  Volume<unsigned char> region;
  DiffusionSources sources;
};

// Two fans with a common apex region, turned against each other.
Scene Fans(int n)
{
  Scene scene;
  scene.region = Volume<unsigned char>({n, n, n});
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const double x = (i + 0.5) / n - 0.5, y = (j + 0.5) / n - 0.5, z = (k + 0.5) / n - 0.5;
        bool inside = false;
        for (const double turn : {-0.3, 0.35}) {
          const double a = 1.75 * (std::cos(turn) * x + std::sin(turn) * z), b = 1.75 * y;
          const double c = 1.75 * (std::cos(turn) * z - std::sin(turn) * x) + 0.75;
          const double depth = std::hypot(a, b, c);
          inside = inside || (depth > 0.3 && depth < 1.05 && std::abs(a) < 0.55 * c && std::abs(b) < 0.4 * c);
        }
        scene.region.View()(i, j, k) = inside ? 1 : 0;
      }
  scene.sources.voxels = SurfaceOf(scene.region.View());
  Random random(1);
  for (const auto& v : scene.sources.voxels) {
    const double smooth = 128.0 + 60.0 * std::sin(12.0 * v[0] / n) * std::cos(9.0 * v[1] / n);
    scene.sources.values.push_back(static_cast<float>(std::clamp(smooth + 25.0 * random.Normal(), 0.0, 255.0)));
  }
  return scene;
}

struct Deviation {
  double largest = 0.0, squares = 0.0;
  std::ptrdiff_t count = 0;
  void Add(float a, float b)
  {
    const double difference = std::abs(static_cast<double>(a) - static_cast<double>(b));
    largest = std::max(largest, difference);
    squares += difference * difference;
    ++count;
  }
  double Rms() const { return std::sqrt(squares / static_cast<double>(std::max<std::ptrdiff_t>(count, 1))); }
};

Deviation Difference(VolumeView<const float> a, VolumeView<const float> b, VolumeView<const unsigned char> where)
{
  Deviation error;
  for (std::ptrdiff_t at = 0; at < a.Size(); ++at)
    if (where.Empty() || where[at])
      error.Add(a[at], b[at]);
  return error;
}

struct Exponents {
  const char* name;
  double inside, outside;
};
const Exponents kExponents[] = {{"d=4", 4, 4}, {"d=6", 6, 6}, {"6 inside 4 outside", 6, 4}};

#ifdef ECHORAMA_WITH_VTK
struct Shepard {
  double nanoseconds = 0.0; // per pair: the least of three runs
  double error = 0.0;       // against our exact sum, at the small size
};

const Shepard& ShepardMethod(double power)
{
  static std::map<double, Shepard> known;
  if (known.count(power))
    return known[power];
  const int n = 48;
  const Scene scene = Fans(n);
  vtkNew<vtkPoints> points;
  vtkNew<vtkFloatArray> values;
  for (std::size_t s = 0; s < scene.sources.voxels.size(); s += 4) {
    const auto& v = scene.sources.voxels[s];
    points->InsertNextPoint(v[0], v[1], v[2]);
    values->InsertNextValue(scene.sources.values[s]);
  }
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  data->GetPointData()->SetScalars(values);
  vtkNew<vtkShepardMethod> shepard;
  shepard->SetInputData(data);
  shepard->SetSampleDimensions(n, n, n);
  shepard->SetModelBounds(0, n - 1, 0, n - 1, 0, n - 1);
  shepard->SetMaximumDistance(1.0);
  shepard->SetPowerParameter(power);
  double seconds = std::numeric_limits<double>::infinity();
  for (int run = 0; run < benchmark::Trials(3); ++run)
    seconds = std::min(seconds, benchmark::Seconds([&] {
                         shepard->Modified();
                         shepard->Update();
                       }));
  Shepard& result = known[power];
  result.nanoseconds = 1e9 * seconds / (static_cast<double>(n) * n * n * static_cast<double>(points->GetNumberOfPoints()));
  DiffusionSources sources;
  for (std::size_t s = 0; s < scene.sources.voxels.size(); s += 4) {
    sources.voxels.push_back(scene.sources.voxels[s]);
    sources.values.push_back(scene.sources.values[s]);
  }
  DiffusionParameters parameters;
  parameters.insideExponent = parameters.outsideExponent = power;
  parameters.exact = true;
  Volume<float> exact({n, n, n});
  Diffuse(parameters, sources, Eigen::Vector3d::Ones(), {}, {}, {exact.View()});
  vtkDataArray* const theirs = shepard->GetOutput()->GetPointData()->GetScalars();
  for (std::ptrdiff_t at = 0; at < exact.View().Size(); ++at)
    result.error = std::max(result.error, std::abs(theirs->GetComponent(at, 0) - static_cast<double>(exact.View()[at])));
  return result;
}
#endif

void Compare(int n)
{
  const Scene scene = Fans(n);
  const auto pairs = static_cast<double>(scene.region.View().Size()) * static_cast<double>(scene.sources.voxels.size());
  // Large grids: the exact sum in few tiles only.
  Volume<unsigned char> some;
  double share = 1.0;
  if (n > 128) {
    some = Volume<unsigned char>({n, n, n});
    const int tiles = n / 8;
    for (int k = 0; k < n; ++k)
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i)
          some.View()(i, j, k) = Random(2, static_cast<std::uint64_t>((k / 8 * tiles + j / 8) * tiles + i / 8)).Below(300) == 0;
    share = static_cast<double>(std::count(some.View().begin(), some.View().end(), 1)) / static_cast<double>(some.View().Size());
  }
  for (const Exponents& exponents : kExponents) {
    const std::string name = std::to_string(n) + ", " + exponents.name;
    Volume<float> fast({n, n, n}), exact({n, n, n});
    DiffusionParameters parameters;
    parameters.insideExponent = exponents.inside;
    parameters.outsideExponent = exponents.outside;
    const auto runFast = [&] {
      parameters.exact = false;
      Diffuse(parameters, scene.sources, Eigen::Vector3d::Ones(), scene.region.View(), {}, {fast.View()});
    };
    const auto runExact = [&] {
      parameters.exact = true;
      Diffuse(parameters, scene.sources, Eigen::Vector3d::Ones(), scene.region.View(), some.View(), {exact.View()});
    };
    runFast();
    std::vector<double> fastSeconds, exactSeconds; // in turn
    for (int run = 0; run < 3; ++run) {
      for (int repeat = 0; repeat < 3; ++repeat)
        fastSeconds.push_back(benchmark::Seconds(runFast));
      if (run == 0 || share < 1.0)
        exactSeconds.push_back(benchmark::Seconds(runExact) / share);
    }
    std::sort(fastSeconds.begin(), fastSeconds.end());
    std::sort(exactSeconds.begin(), exactSeconds.end());
    const double seconds = fastSeconds[fastSeconds.size() / 2], slow = exactSeconds[exactSeconds.size() / 2];
    const Deviation error = Difference(fast.View(), exact.View(), some.View());
    nlohmann::ordered_json more{{"sources", scene.sources.voxels.size()},
                                {"rms", error.Rms()},
                                {"least_seconds", fastSeconds.front()},
                                {"times_exact", slow / seconds}};
#ifdef ECHORAMA_WITH_VTK
    const double inside = static_cast<double>(std::count(scene.region.View().begin(), scene.region.View().end(), 1)) /
                          static_cast<double>(scene.region.View().Size());
    const Shepard &shepardInside = ShepardMethod(exponents.inside), &shepardOutside = ShepardMethod(exponents.outside);
    const double shepard = 1e-9 * pairs * (inside * shepardInside.nanoseconds + (1.0 - inside) * shepardOutside.nanoseconds);
    more["times_vtk_shepard"] = shepard / seconds;
#endif
    benchmark::Report("diffusion", name, "fast", seconds, error.largest, "grey", more);
    benchmark::ReportTime("diffusion", name, "exact", slow,
                          {{"gpairs_per_second", 1e-9 * pairs / slow}, {"measured_share", share}});
#ifdef ECHORAMA_WITH_VTK
    benchmark::Report("diffusion", name, "vtk_shepard", shepard, std::max(shepardInside.error, shepardOutside.error), "grey",
                      {{"scaled_from", "48^3, a quarter of the sources"}, {"gpairs_per_second", 1e-9 * pairs / shepard}});
#endif
  }
}

void Sweep(int n)
{
  const Scene scene = Fans(n);
  for (const double d : {4.0, 6.0}) {
    Volume<float> fast({n, n, n}), exact({n, n, n});
    DiffusionParameters parameters;
    parameters.insideExponent = parameters.outsideExponent = d;
    parameters.exact = true;
    Diffuse(parameters, scene.sources, Eigen::Vector3d::Ones(), {}, {}, {exact.View()});
    parameters.exact = false;
    for (const double accuracy : {1e-4, 3e-4, 1e-3, 2e-3, 5e-3, 1e-2, 3e-2, 1e-1}) {
      parameters.accuracy = accuracy;
      double seconds = std::numeric_limits<double>::infinity(); // the least of three: machines are shared
      for (int run = 0; run < 3; ++run)
        seconds = std::min(seconds, benchmark::Seconds([&] {
                             Diffuse(parameters, scene.sources, Eigen::Vector3d::Ones(), {}, {}, {fast.View()});
                           }));
      const Deviation error = Difference(fast.View(), exact.View(), {});
      benchmark::Report("diffusion", "accuracy at " + std::to_string(n), d == 4.0 ? "fast, d=4" : "fast, d=6", seconds,
                        error.largest, "grey", {{"accuracy", accuracy}, {"rms", error.Rms()}});
    }
  }
}

} // namespace

int main(int count, char** arguments)
{
  if (benchmark::Smoke()) {
    Compare(48);
    return 0;
  }
  std::set<std::string> chosen(arguments + 1, arguments + count);
  if (chosen.empty())
    chosen = {"128", "256", "sweep"};
  if (chosen.count("128"))
    Compare(128);
  if (chosen.count("256"))
    Compare(256);
  if (chosen.count("sweep"))
    Sweep(128);
  return 0;
}
