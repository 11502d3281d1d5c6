// SPDX-License-Identifier: BSD-3-Clause
// echorama probe-fit: which probe made a volume, told from its valid region; or which would have seen all of it.
#include "Core/Geometry/ProbeFit.h"
#include "Commands.h"
#include "Core/Geometry/EnclosingFan.h"
#include "Core/Imaging/Sampling.h"
#include "Readers/OutputFiles.h"
#include "Volumes.h"
#include <algorithm>
#include <CLI/Validators.hpp>
#include <memory>
#include <vtkUltrasoundAcquisition.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {
namespace {

struct ProbeFitOptions {
  std::string file, output;
  ProbeFitParameters parameters;
  bool enclose = false;
  double marginMm = EnclosingFanParameters().marginMm;
};

// What both ways find, told and written.
void TellProbe(Session& session, const ProbeFitOptions& options, const PlacedProbe& probe,
               const std::optional<ProbeGeometry>& known)
{
  session.Say(options.file);
  session.Say("  probe       " + ProbeText(probe.geometry));
  if (known)
    session.Say("  file says   " + ProbeText(*known));
  session.Say("  probe at    " + Triple(probe.probeToWorld.translation(), ", ", 2) + " mm, looking along " +
              Triple(probe.probeToWorld.linear().col(2), ", ", 3));
  session.result["file"] = options.file;
  session.result["ProbeGeometry"] = JsonOf(probe.geometry);
  session.result["ProbeToWorld"] = JsonOf(probe.probeToWorld);
}

void WriteProbe(Session& session, const ProbeFitOptions& options, vtkImageData* image, const PlacedProbe& probe)
{
  if (options.output.empty())
    return;
  vtkUltrasoundAcquisition::SetProbeGeometry(image, probe.geometry);
  vtkUltrasoundAcquisition::SetProbeToWorld(image, probe.probeToWorld);
  session.result["output"] = options.output;
  session.result["lost"] = SaveVolume(session, image, options.output);
  session.Say("wrote " + options.output);
}

// The fan that holds the whole region.
PlacedProbe EncloseRegionOf(Session& session, const ProbeFitOptions& options, const LoadedVolume& volume,
                            VolumeView<const unsigned char> valid, const std::optional<ProbeGeometry>& known)
{
  EnclosingFanParameters parameters;
  parameters.marginMm = options.marginMm;
  if (const auto pose = vtkUltrasoundAcquisition::ProbeToWorldOf(volume.image); known && pose)
    parameters.shape = PlacedProbe{*known, *pose};
  PlacedProbe fan;
  session.Work("enclose", options.file, [&](const Progress& progress) {
    try {
      fan = EncloseRegion(valid, volume.geometry, parameters, progress);
    } catch (const Error& error) {
      throw Error(error.GetKind(), options.file + ": " + error.what());
    }
  });
  TellProbe(session, options, fan, known);
  const double voxel = volume.geometry.spacing.head(volume.geometry.dimensions[2] == 1 ? 2 : 3).prod();
  const double voxels = valid.Empty()
                            ? static_cast<double>(volume.geometry.VoxelCount())
                            : static_cast<double>(std::count_if(valid.begin(), valid.end(), [](auto v) { return v != 0; }));
  const double filled = std::min(1.0, voxels * voxel / FanVolume(fan.geometry));
  session.Say("  filled      " + Fixed(100.0 * filled, 2) + "% of it by the region");
  session.result["filled"] = filled;
  return fan;
}

void FitProbe(Session& session, const ProbeFitOptions& options)
{
  if (!options.output.empty())
    CheckVolumeOutput(options.output, {options.file});
  const LoadedVolume volume = LoadVolume(session, options.file);
  Volume<unsigned char> real; // valid, and a number
  vtkDataArray* intensity = vtkUltrasoundVolume::GetIntensity(volume.image);
  vtkUltrasoundVolume::Dispatch(intensity, [&](auto type) {
    using T = decltype(type);
    real = RealRegionOf<T>(
        {vtkUltrasoundVolume::ViewOf<const T>(intensity, volume.image),
         vtkUltrasoundVolume::ViewOf<const unsigned char>(vtkUltrasoundVolume::GetValidRegion(volume.image), volume.image),
         volume.geometry});
  });
  const VolumeView<const unsigned char> valid = real.View();
  const std::optional<ProbeGeometry> known = vtkUltrasoundAcquisition::ProbeGeometryOf(volume.image);
  if (options.enclose) {
    WriteProbe(session, options, volume.image, EncloseRegionOf(session, options, volume, valid, known));
    return;
  }
  ProbeFit fit;
  session.Work("fit", options.file, [&](const Progress& progress) {
    try {
      fit = FitProbe(valid, volume.geometry, options.parameters, progress);
    } catch (const Error& error) {
      throw Error(error.GetKind(), options.file + ": " + error.what());
    }
  });

  const PlacedProbe probe{fit.geometry, fit.probeToWorld};
  TellProbe(session, options, probe, known);
  session.Say("  residual    " + Fixed(fit.residualMm, 3) + " mm (root mean square); mean distance " +
              Fixed(100.0 * fit.meanDistance, 2) + "% of the region's size");
  session.Say("  overlap     " + Fixed(100.0 * fit.overlap, 2) + "% of region and model together");
  for (const std::string& note : fit.notes)
    session.Note(options.file + ": " + note);
  session.result["residual_mm"] = fit.residualMm;
  session.result["mean_distance"] = fit.meanDistance;
  session.result["overlap"] = fit.overlap;
  WriteProbe(session, options, volume.image, probe);
}

} // namespace

Command ProbeFitCommand(CLI::App& program)
{
  auto values = std::make_shared<ProbeFitOptions>();
  CLI::App* options = program.add_subcommand("probe-fit", "Find the geometry of the probe from a volume's valid region");
  options->add_option("volume", values->file, "Volume of any format")->required();
  options->add_option("-o,--output", values->output, "Also write the volume with the geometry and pose of the probe");
  options
      ->add_option("--minimum-overlap", values->parameters.minimumOverlap,
                   "Refuse a fit with less overlap of region and model (intersection over union)")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  options
      ->add_option("--maximum-distance", values->parameters.maximumDistance,
                   "Refuse a fit whose outline is further off in the mean, as a part of the region's size")
      ->check(CLI::Range(1e-6, 1e6))
      ->capture_default_str();
  CLI::Option* enclose = options->add_flag("--enclose", values->enclose,
                                           "Instead the least fan that holds the whole region, enlarged from the probe of the "
                                           "file if it has one: for stitched volumes");
  options->add_option("--margin", values->marginMm, "With --enclose: how far the fan reaches beyond the region at least, mm")
      ->check(CLI::Range(0.0, 1000.0))
      ->needs(enclose)
      ->capture_default_str();
  return {options, [values](Session& session) { FitProbe(session, *values); }};
}

} // namespace echorama
