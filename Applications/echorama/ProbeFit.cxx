// SPDX-License-Identifier: BSD-3-Clause
// echorama probe-fit: which probe made a volume, told from its valid region.
#include "Core/Geometry/ProbeFit.h"
#include "Commands.h"
#include "Outputs.h"
#include "Volumes.h"
#include <CLI/Validators.hpp>
#include <memory>
#include <vtkUltrasoundAcquisition.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {
namespace {

struct ProbeFitOptions {
  std::string file, output;
  ProbeFitParameters parameters;
};

void FitProbe(Session& session, const ProbeFitOptions& options)
{
  if (!options.output.empty())
    CheckVolumeOutput(options.output, {options.file});
  const LoadedVolume volume = LoadVolume(session, options.file);
  const auto valid =
      vtkUltrasoundVolume::ViewOf<const unsigned char>(vtkUltrasoundVolume::GetValidRegion(volume.image), volume.image);
  ProbeFit fit;
  session.Work("fit", options.file, [&](const Progress& progress) {
    try {
      fit = FitProbe(valid, volume.geometry, options.parameters, progress);
    } catch (const Error& error) {
      throw Error(error.GetKind(), options.file + ": " + error.what());
    }
  });

  const std::optional<ProbeGeometry> known = vtkUltrasoundAcquisition::ProbeGeometryOf(volume.image);
  session.Say(options.file);
  session.Say("  probe       " + ProbeText(fit.geometry));
  if (known)
    session.Say("  file says   " + ProbeText(*known));
  session.Say("  probe at    " + Triple(fit.probeToWorld.translation(), ", ", 2) + " mm, looking along " +
              Triple(fit.probeToWorld.linear().col(2), ", ", 3));
  session.Say("  residual    " + Fixed(fit.residualMm, 3) + " mm (root mean square); mean distance " +
              Fixed(100.0 * fit.meanDistance, 2) + "% of the region's size");
  session.Say("  overlap     " + Fixed(100.0 * fit.overlap, 2) + "% of region and model together");
  for (const std::string& note : fit.notes)
    session.Note(options.file + ": " + note);
  session.result["file"] = options.file;
  session.result["ProbeGeometry"] = JsonOf(fit.geometry);
  session.result["ProbeToWorld"] = JsonOf(fit.probeToWorld);
  session.result["residual_mm"] = fit.residualMm;
  session.result["mean_distance"] = fit.meanDistance;
  session.result["overlap"] = fit.overlap;

  if (options.output.empty())
    return;
  vtkUltrasoundAcquisition::SetProbeGeometry(volume.image, fit.geometry);
  vtkUltrasoundAcquisition::SetProbeToWorld(volume.image, fit.probeToWorld);
  session.result["output"] = options.output;
  session.result["lost"] = SaveVolume(session, volume.image, options.output);
  session.Say("wrote " + options.output);
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
  return {options, [values](Session& session) { FitProbe(session, *values); }};
}

} // namespace echorama
