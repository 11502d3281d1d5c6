// SPDX-License-Identifier: BSD-3-Clause
// Beams behind many small spheres: mean power of speckle along their axes and as wide beams, beside that of a wave; and how far
// few rays of wide beams are from many.
#include "Core/Base/Parallel.h"
#include "Filters/Acoustics/WideBeams.h"
#include "Filters/Tissue/PackedTissue.h"
#include "SplitStepWave.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <iterator>

using namespace echorama;

namespace {

constexpr int elements = 96, seeds = 48;

AcousticScene Spheres()
{
  PackedTissueParameters packed;
  packed.packing.boxMin = Eigen::Vector3d(-50, -50, 0);
  packed.packing.boxMax = Eigen::Vector3d(50, 50, 100);
  packed.packing.radiusMin = 1.0;
  packed.packing.radiusMax = 8.0;
  return AcousticScene(MakePackedTissue(packed).surface);
}

// One plane, speckle of the direct way alone.
SynthesisParameters Plane()
{
  SynthesisParameters p;
  p.probe = ProbeGeometry::Convex(0.65, 40.0, 0.0, 0.0, 5.0, 105.0);
  p.elements = elements;
  p.samples = 512;
  p.transducer.dynamicReceive = false;
  p.transport.faceReflection = 0.0;
  p.transport.maxBounces = 0;
  p.mirrorDb = 0.0;
  return p;
}

using Power = std::vector<std::vector<double>>; // by beam and sample

// A running mean over a millimetre and a half, in dB, not below black.
Power Decibels(const Power& power, double step)
{
  Power db;
  const auto reach = static_cast<std::ptrdiff_t>(0.75 / step);
  for (const std::vector<double>& row : power) {
    std::vector<double>& out = db.emplace_back();
    const auto count = static_cast<std::ptrdiff_t>(row.size());
    for (std::ptrdiff_t i = reach; i + reach < count; ++i) {
      double sum = 0.0;
      for (std::ptrdiff_t j = i - reach; j <= i + reach; ++j)
        sum += row[static_cast<std::size_t>(j)];
      out.push_back(std::max(-40.0, 10.0 * std::log10(sum / (2.0 * static_cast<double>(reach) + 1.0) + 1e-9)));
    }
  }
  return db;
}

// How far each beam is off the mean of its neighbours, dB RMS: stripes.
double Stripes(const Power& db)
{
  double sum = 0.0;
  for (std::size_t beam = 1; beam + 1 < db.size(); ++beam)
    for (std::size_t i = 0; i < db[beam].size(); ++i)
      sum += std::pow(db[beam][i] - 0.5 * (db[beam - 1][i] + db[beam + 1][i]), 2);
  return std::sqrt(sum / static_cast<double>((db.size() - 2) * db[0].size()));
}

double Difference(const Power& a, const Power& b)
{
  double sum = 0.0;
  for (std::size_t beam = 0; beam < a.size(); ++beam)
    for (std::size_t i = 0; i < a[beam].size(); ++i)
      sum += std::pow(a[beam][i] - b[beam][i], 2);
  return std::sqrt(sum / static_cast<double>(a.size() * a[0].size()));
}

} // namespace

int main()
{
  const AcousticScene scene = Spheres();
  SynthesisParameters p = Plane();
  BeamEchoes echoes;
  const auto synthesize = [&] { echoes = SynthesizeEchoes(scene, p); };

  Power ofWave(elements);
  DepthAxis axis;
  const auto wave = [&] {
    const benchmark::SplitStepWave steps(scene, p);
    const int these = benchmark::Smoke() ? 2 : elements;
    ParallelFor(these, [&](std::ptrdiff_t beam) {
      ofWave[static_cast<std::size_t>(beam)] = steps.MeanPower(AxisOf(p, static_cast<int>(beam), 0), axis);
    });
  };
  synthesize();
  axis = {p.probe.depthMin, (p.probe.depthMax - p.probe.depthMin) / (echoes.baseband.Dimensions()[0] - 1),
          echoes.baseband.Dimensions()[0]};
  const double waveSeconds = benchmark::Seconds(wave);
  if (benchmark::Smoke())
    ofWave.resize(elements, ofWave[0]);
  for (std::vector<double>& row : ofWave)
    if (row.empty())
      row = ofWave[0];
  const Power reference = Decibels(ofWave, axis.step);
  benchmark::ReportTime("wide_beams", "a plane behind spheres", "wave", waveSeconds, {{"stripes_db", Stripes(reference)}});

  struct Kind {
    const char* method;
    int rays;
    bool wide;
  };
  for (const Kind& kind : {Kind{"axes, 1 ray", 1, false}, Kind{"axes, 8 rays", 8, false}, Kind{"wide, 1 ray", 1, true},
                           Kind{"wide, 4 rays", 4, true}, Kind{"wide, 8 rays", 8, true}, Kind{"wide, 256 rays", 256, true}}) {
    p.subRays = kind.rays;
    p.wideBeams = kind.wide;
    p.seed = 1;
    const double seconds = benchmark::MedianSeconds(synthesize);
    Power power(elements, std::vector<double>(static_cast<std::size_t>(axis.count), 0.0));
    for (int seed = 1; seed <= benchmark::Trials(seeds); ++seed) {
      p.seed = static_cast<std::uint64_t>(seed);
      synthesize();
      for (int beam = 0; beam < elements; ++beam)
        for (int i = 0; i < axis.count; ++i)
          power[static_cast<std::size_t>(beam)][static_cast<std::size_t>(i)] +=
              std::norm(std::complex<double>(echoes.baseband.View().Row(beam, 0)[i])) / benchmark::Trials(seeds);
    }
    const Power db = Decibels(power, axis.step);
    benchmark::Report("wide_beams", "a plane behind spheres", kind.method, seconds, Difference(db, reference),
                      "dB of mean speckle, RMS to a wave", {{"stripes_db", Stripes(db)}});
  }
}
