// SPDX-License-Identifier: BSD-3-Clause
// echorama probe-fit: which probe made a volume, told from its valid region; or which would have seen all of it.
#include "Commands.h"
#include "ParameterOptions.h"
#include "Readers/OutputFiles.h"
#include "Volumes.h"
#include <memory>
#include <vtkImageData.h>
#include <vtkSmartPointer.h>
#include <vtkUltrasoundAcquisition.h>
#include <vtkUltrasoundProbeFit.h>

namespace echorama {
namespace {

struct ProbeFitOptions {
  std::string file, output;
};

void FitProbe(Session& session, const ProbeFitOptions& options, vtkUltrasoundProbeFit* filter)
{
  if (!options.output.empty())
    CheckVolumeOutput(options.output, {options.file});
  const LoadedVolume volume = LoadVolume(session, options.file);
  filter->SetInputData(volume.image);
  try {
    session.Update(filter, filter->GetEncloseRegion() ? "enclose" : "fit", options.file);
  } catch (const Error& error) { // the filter knows no files
    if (error.GetKind() == Error::Kind::Cancelled)
      throw;
    throw Error(error.GetKind(), options.file + ": " + error.what());
  }

  vtkImageData* fitted = filter->GetOutput();
  const ProbeGeometry probe = vtkUltrasoundAcquisition::ProbeGeometryOf(fitted).value();
  const Pose probeToWorld = vtkUltrasoundAcquisition::ProbeToWorldOf(fitted).value();
  session.Say(options.file);
  session.Say("  probe       " + ProbeText(probe));
  if (const auto known = vtkUltrasoundAcquisition::ProbeGeometryOf(volume.image))
    session.Say("  file says   " + ProbeText(*known));
  session.Say("  probe at    " + Triple(probeToWorld.translation(), ", ", 2) + " mm, looking along " +
              Triple(probeToWorld.linear().col(2), ", ", 3));
  session.result["file"] = options.file;
  session.result["ProbeGeometry"] = JsonOf(probe);
  session.result["ProbeToWorld"] = JsonOf(probeToWorld);
  if (filter->GetEncloseRegion()) {
    session.Say("  filled      " + Fixed(100.0 * filter->GetOverlap(), 2) + "% of it by the region");
    session.result["filled"] = filter->GetOverlap();
  } else {
    session.Say("  residual    " + Fixed(filter->GetResidualMm(), 3) + " mm (root mean square); mean distance " +
                Fixed(100.0 * filter->GetMeanDistance(), 2) + "% of the region's size");
    session.Say("  overlap     " + Fixed(100.0 * filter->GetOverlap(), 2) + "% of region and model together");
    for (const std::string& note : LinesOf(filter->GetNotes()))
      session.Note(options.file + ": " + note);
    session.result["residual_mm"] = filter->GetResidualMm();
    session.result["mean_distance"] = filter->GetMeanDistance();
    session.result["overlap"] = filter->GetOverlap();
  }
  if (options.output.empty())
    return;
  session.result["output"] = options.output;
  session.result["lost"] = SaveVolume(session, fitted, options.output);
  session.Say("wrote " + options.output);
}

} // namespace

void EchoramaCommand(CLI::App* options, Action& action)
{
  auto values = std::make_shared<ProbeFitOptions>();
  const auto filter = vtkSmartPointer<vtkUltrasoundProbeFit>::New();
  options->add_option("volume", values->file, "Volume of any format")->type_name("VOLUME")->required();
  options->add_option("-o,--output", values->output, "Also write the volume with the geometry and pose of the probe")
      ->type_name("VOLUME");
  AddParameters(options, filter, {"MinimumOverlap", "MaximumDistance"});
  CLI::Option* enclose = AddParameter(options, filter, "EncloseRegion", "--enclose");
  AddParameter(options, filter, "MarginMm", "--margin")->needs(enclose);
  AddParameter(options, filter, "Outline")->needs(enclose);
  action = [values, filter](Session& session) { FitProbe(session, *values, filter); };
}

} // namespace echorama
