// SPDX-License-Identifier: BSD-3-Clause
// A probe that slides over an abdomen of a million triangles: how many images a second each model gives, and how far its coarse
// pictures are from the full one.
//
// The full acoustic picture, made from nothing, is the reference. The probe moves by half a millimetre from image to image, so
// that what is kept counts for what it is worth. The drawn picture (SliceTracer) is another model: its difference to the full
// one tells how alike they look, with its speckle and that of the reference smoothed away; that of the pressed one is to the
// drawn picture of the scene deformed.
#include "Core/Geometry/ProbePresets.h"
#include "Filters/Acoustics/ProgressiveSlice.h"
#include "Filters/Acoustics/SliceTracer.h"
#include "Filters/Phantoms/Anatomy.h"
#include "Testing/Benchmark.h"
#include <algorithm>
#include <cmath>
#include <ctime>
#include <optional>

using namespace echorama;

namespace {

double CpuSeconds()
{
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

double Rms(const Volume<float>& a, const Volume<float>& b)
{
  double sum = 0.0;
  for (std::ptrdiff_t i = 0; i < a.View().Size(); ++i)
    sum += std::pow(static_cast<double>(a.View()[i]) - b.View()[i], 2);
  return std::sqrt(sum / static_cast<double>(a.View().Size()));
}

template <class T>
Volume<float> AsFloat(const Volume<T>& picture)
{
  Volume<float> result(picture.Dimensions());
  std::copy(picture.View().begin(), picture.View().end(), result.View().begin());
  return result;
}

// Means over 9 x 25 samples: what is left of speckle is small beside what materials differ by.
Volume<float> Smoothed(const Volume<float>& picture)
{
  const auto from = picture.View();
  Volume<float> result(picture.Dimensions());
  const int samples = from.Dimensions()[0], beams = from.Dimensions()[1];
  for (int beam = 0; beam < beams; ++beam)
    for (int i = 0; i < samples; ++i) {
      double sum = 0.0;
      int n = 0;
      for (int b = std::max(0, beam - 4); b <= std::min(beams - 1, beam + 4); ++b)
        for (int s = std::max(0, i - 12); s <= std::min(samples - 1, i + 12); ++s, ++n)
          sum += from(s, b, 0);
      result.View()(i, beam, 0) = static_cast<float>(sum / n);
    }
  return result;
}

// Median of the seconds and mean of the processor's seconds of one image, with the probe on its way.
template <class Image>
void Slide(const std::string& method, SynthesisParameters p, int images, const nlohmann::ordered_json& known,
           const std::optional<double>& error, const char* unit, const Image& image)
{
  std::vector<double> seconds;
  double cpu = 0.0;
  image(p);
  for (int i = 0; i < images; ++i) {
    p.probeToWorld.translation() += Eigen::Vector3d(0.3, 0.4, 0.0);
    const double before = CpuSeconds();
    seconds.push_back(benchmark::Seconds([&] { image(p); }));
    cpu += CpuSeconds() - before;
  }
  std::nth_element(seconds.begin(), seconds.begin() + images / 2, seconds.end());
  const double median = seconds[static_cast<std::size_t>(images / 2)];
  nlohmann::ordered_json more{{"images_per_second", 1.0 / median}, {"cpu_seconds", cpu / images}};
  more.update(known);
  if (error)
    benchmark::Report("live_scene", "abdomen, 192 x 512", method, median, *error, unit, more);
  else
    benchmark::ReportTime("live_scene", "abdomen, 192 x 512", method, median, more);
}

} // namespace

int main()
{
  AnatomyParameters anatomy;
  if (benchmark::Smoke())
    anatomy.detailMm = 4.0;
  const TissueSurface surface = MakeAnatomy(anatomy);
  const AcousticScene scene(surface);
  const ProbePreset& preset = ProbePresetOf("curvilinear");
  SynthesisParameters p;
  p.probe = preset.probe;
  p.transducer = preset.transducer;
  p.elements = 192;
  p.samples = 512;
  p.receiver.noiseDb = Receiver::noNoiseDb;
  const nlohmann::ordered_json known{{"triangles", surface.triangles.size()}};

  Volume<float> full;
  SynthesisCost cost;
  double cpu = -CpuSeconds();
  const double seconds = benchmark::Seconds([&] { full = AsFloat(SynthesizeBeams(scene, p, {}, &cost)); });
  cpu += CpuSeconds();
  nlohmann::ordered_json more{{"images_per_second", 1.0 / seconds}, {"cpu_seconds", cpu}, {"scatterers", cost.scatterers}};
  more.update(known);
  benchmark::ReportTime("live_scene", "abdomen, 192 x 512", "acoustic, full, nothing kept", seconds, more);

  SliceTracer tracer(scene);
  const Transducer& t = p.transducer;
  const double faceSigma = t.elevationApertureMm / Transducer::sigmasPerAperture / std::sqrt(2.0);
  const SliceThickness thickness{WidthAt(t, t.elevationFocusMm).elevationSigma, faceSigma / t.elevationFocusMm,
                                 t.elevationFocusMm};
  for (const bool darkens : {true, false})
    for (const int rays : {1, 5, 9}) {
      SliceLook look;
      look.darkeningDb *= darkens;
      look.rays = rays;
      const double alike = Rms(Smoothed(tracer.Trace(p, look, nullptr, thickness)), Smoothed(full));
      Slide("drawn, " + std::to_string(rays) + (rays > 1 ? " rays" : " ray") + (darkens ? "" : ", DarkeningDb 0"), p,
            benchmark::Trials(60), known, alike, "grey, RMS of smoothed pictures to the full acoustic one",
            [&](const SynthesisParameters& now) { tracer.Trace(now, look, nullptr, thickness); });
    }
  // Pressed tissue, beside the scene whose points went where they then are, both without speckle.
  const PressWarp warp{5.0, 25.0};
  BeamBend bend(p.probe, 97, 33, 10.0);
  for (std::size_t node = 0; node < bend.Count(); ++node) {
    const double z = bend.NodePoint(node).z();
    bend.SetMove(node, {0.0, 0.0, warp.RestDepth(z) - z});
  }
  TissueSurface moved = surface;
  for (Eigen::Vector3f& point : moved.points)
    point.z() = static_cast<float>(warp.PressedDepth(point.z()));
  const AcousticScene movedScene(moved);
  SliceLook bare;
  bare.speckle = 0.0;
  const double different =
      Rms(tracer.Trace(p, bare, nullptr, thickness, &bend), SliceTracer(movedScene).Trace(p, bare, nullptr, thickness));
  Slide("drawn, 5 rays, pressed", p, benchmark::Trials(60), known, different, "grey, RMS to the deformed scene, without speckle",
        [&](const SynthesisParameters& now) { tracer.Trace(now, SliceLook(), nullptr, thickness, &bend); });

  SynthesisParameters other = p;
  other.seed = 2;
  const double strange = Rms(AsFloat(SynthesizeBeams(scene, other)), full);
  ProgressiveSlice slice(scene);
  for (int level = 0; level < ProgressiveSlice::levels; ++level) {
    nlohmann::ordered_json about = known;
    const double error = Rms(AsFloat(slice.Make(p, level)), full);
    about["error_of_other_speckle"] = strange;
    Slide("acoustic, level " + std::to_string(level), p, benchmark::Trials(level < 3 ? 15 : 5), about, error,
          "grey, RMS to the full picture", [&](const SynthesisParameters& now) { slice.Make(now, level); });
  }
}
