// SPDX-License-Identifier: BSD-3-Clause
// A whole volume of a million triangles, stage by stage, and what rays over the aperture change.
//
// No other program makes such volumes on a processor, so the peer is our own phantom: bodies without interfaces, straight beams,
// the same kind of scatterers.
#include "Core/Base/Parallel.h"
#include "Filters/Acoustics/Synthesize.h"
#include "Filters/Phantoms/Phantom.h"
#include "Filters/Tissue/PackedTissue.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <cstring>
#include <ctime>

using namespace echorama;

namespace {

// Spheres before the probe, of about as many triangles as wanted.
TissueSurface Packed(std::int64_t triangles)
{
  PackedTissueParameters p;
  p.packing.boxMin = Eigen::Vector3d(-120, -100, 3);
  p.packing.boxMax = Eigen::Vector3d(120, 100, 160);
  p.packing.radiusMin = 1.5;
  p.packing.radiusMax = 8.0;
  // A finer cell gives more triangles: halve or double until the number is about right.
  p.cell.mm = 0.6;
  PackedTissue tissue = MakePackedTissue(p);
  for (int i = 0; i < 8; ++i) {
    const double ratio = static_cast<double>(tissue.surface.triangles.size()) / static_cast<double>(triangles);
    if (std::abs(std::log(ratio)) < 0.15)
      break;
    p.cell.mm *= ratio;
    tissue.surface = MeshSpheres(p, tissue.packing.spheres);
  }
  return tissue.surface;
}

SynthesisParameters Volume128()
{
  SynthesisParameters p;
  p.probe = ProbeGeometry::Convex(1.1344640137963142, 40.0, 0.9599310885968813, 30.0, 0.0, 150.0);
  p.elements = p.steps = 128;
  p.samples = 512;
  return p;
}

// Processor seconds so far, of all threads: what counts on a machine that is shared.
double CpuSeconds()
{
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

void ReportRun(const std::string& name, const std::string& method, double seconds, double sceneSeconds, double cpuSeconds,
               const SynthesisCost& cost, const TissueSurface& surface, std::optional<double> error, const char* unit)
{
  const double mb = 1e-6;
  const nlohmann::ordered_json more{{"triangles", surface.triangles.size()},
                                    {"scene_seconds", sceneSeconds},
                                    {"cpu_seconds", cpuSeconds},
                                    {"rays_seconds", cost.raysSeconds},
                                    {"scatterers_seconds", cost.scatterersSeconds},
                                    {"echoes_seconds", cost.echoesSeconds},
                                    {"detection_seconds", cost.detectionSeconds},
                                    {"rays", cost.rays},
                                    {"segments", cost.segments},
                                    {"scatterers", cost.scatterers},
                                    {"held_mb", mb * static_cast<double>(cost.bytes)}};
  if (error)
    benchmark::Report("synthesize", name, method, seconds, *error, unit, more);
  else
    benchmark::ReportTime("synthesize", name, method, seconds, more);
}

// Root of the mean squared difference of two volumes of grey.
double Rms(const Volume<unsigned char>& a, const Volume<unsigned char>& b)
{
  double sum = 0.0;
  const auto x = a.View(), y = b.View();
  for (std::ptrdiff_t i = 0; i < x.Size(); ++i)
    sum += std::pow(static_cast<double>(x[i]) - y[i], 2);
  return std::sqrt(sum / static_cast<double>(x.Size()));
}

void WholeVolume(std::int64_t triangles, const std::string& name)
{
  const TissueSurface surface = Packed(triangles);
  SynthesisParameters p = Volume128();
  std::optional<AcousticScene> scene;
  const double before = CpuSeconds();
  const double sceneSeconds = benchmark::Seconds([&] { scene.emplace(surface); });
  const double sceneCpu = CpuSeconds() - before;
  for (const int rays : {1, 8}) {
    p.subRays = rays;
    SynthesisCost cost;
    Volume<unsigned char> beams;
    const double start = CpuSeconds();
    const double seconds = benchmark::Seconds([&] { beams = SynthesizeBeams(*scene, p, {}, &cost); });
    const double cpu = CpuSeconds() - start + sceneCpu;
    std::optional<double> error;
    if (rays == 1) { // the same on one thread: the difference must be nothing
      const ThreadLimit limit(1);
      error = Rms(beams, SynthesizeBeams(*scene, p));
    }
    ReportRun(name, std::to_string(rays), seconds + sceneSeconds, sceneSeconds, cpu, cost, surface, error,
              "grey, RMS to one thread");
  }
}

// What the deterministic ray along the axis leaves out: the same volume with ever more rays over the aperture.
void RaysOverTheAperture()
{
  const TissueSurface surface = Packed(200000);
  const AcousticScene scene(surface);
  SynthesisParameters p = Volume128();
  p.steps = 8;
  p.receiver.noiseDb = Receiver::noNoiseDb;
  p.subRays = 512;
  p.sampling = Sampling::Sobol;
  const Volume<unsigned char> converged = SynthesizeBeams(scene, p);
  for (const Sampling sampling : {Sampling::Random, Sampling::Sobol})
    for (const int rays : {1, 4, 16, 64}) {
      if (rays == 1 && sampling == Sampling::Sobol)
        continue;
      p.subRays = rays;
      p.sampling = sampling;
      p.seed = 1;
      SynthesisCost cost;
      Volume<unsigned char> beams;
      const double start = CpuSeconds();
      const double seconds = benchmark::Seconds([&] { beams = SynthesizeBeams(scene, p, {}, &cost); });
      const double cpu = CpuSeconds() - start;
      const char* method = rays == 1 ? "axis" : sampling == Sampling::Random ? "random" : "sobol";
      ReportRun(std::to_string(rays) + " rays an element", method, seconds, 0.0, cpu, cost, surface, Rms(beams, converged),
                "grey, RMS to 512 rays");
    }
}

void Modes()
{
  const TissueSurface surface = Packed(200000);
  const AcousticScene scene(surface);
  SynthesisParameters p = Volume128();
  p.steps = 32;
  for (const auto mode : {SynthesisParameters::Mode::Coherent, SynthesisParameters::Mode::Counting}) {
    p.mode = mode;
    p.counting.raysPerElement = 64;
    p.seed = 1;
    SynthesisCost cost;
    Volume<unsigned char> first, second;
    const double start = CpuSeconds();
    const double seconds = benchmark::Seconds([&] { first = SynthesizeBeams(scene, p, {}, &cost); });
    const double cpu = CpuSeconds() - start;
    // Another seed of all that is random but the tissue: an image must not depend on it.
    p.receiver.noiseSeed = 2;
    if (mode == SynthesisParameters::Mode::Counting)
      p.seed = 2;
    second = SynthesizeBeams(scene, p);
    ReportRun("128 x 32 beams", mode == SynthesisParameters::Mode::Coherent ? "coherent" : "counting, 64 rays", seconds, 0.0, cpu,
              cost, surface, Rms(first, second), "grey, RMS to another seed of what is not tissue");
  }
}

void Peer()
{
  PhantomParameters phantom;
  phantom.probe = Volume128().probe;
  phantom.probe.depthMin = 5.0;
  BeamEchoes echoes;
  const double seconds = benchmark::Seconds([&] { echoes = SimulateEchoes(phantom); });
  benchmark::ReportTime("synthesize", "default scene, its own sampling", "phantom (peer)", seconds,
                        {{"samples", echoes.baseband.View().Size()}});
}

} // namespace

int main(int count, char** arguments)
{
  if (benchmark::Smoke()) {
    Modes();
    return 0;
  }
  const bool whole = count < 2 || std::strcmp(arguments[1], "--quick") != 0;
  if (whole) {
    WholeVolume(1000000, "1 million triangles, 128 x 128 x 512");
    Peer();
  }
  RaysOverTheAperture();
  Modes();
}
