// SPDX-License-Identifier: BSD-3-Clause
// echorama noise: what an ultrasound machine shows of nothing, in the fan of a probe.
#include "Commands.h"
#include "ParameterOptions.h"
#include "Readers/OutputFiles.h"
#include "Volumes.h"
#include <memory>
#include <optional>
#include <vtkImageData.h>
#include <vtkSmartPointer.h>
#include <vtkUltrasoundAcquisition.h>
#include <vtkUltrasoundNoiseSource.h>

namespace echorama {
namespace {

struct NoiseOptions {
  std::string output, match, form;
};

// Options whose defaults are those of the filter, by which they are set.
using Source = vtkSmartPointer<vtkUltrasoundNoiseSource>;

void MakeNoise(Session& session, const NoiseOptions& options, vtkUltrasoundNoiseSource* source)
{
  std::vector<std::string> inputs;
  for (const std::string* file : {&options.match, &options.form})
    if (!file->empty())
      inputs.push_back(*file);
  CheckVolumeOutput(options.output, inputs);
  if (source->GetOnInputGrid() && inputs.empty())
    throw Error(Error::Kind::InvalidParameter, "--on-grid takes the grid of --form or --match, and neither is given");
  std::optional<LoadedVolume> form, match;
  if (!options.form.empty()) {
    form = LoadVolume(session, options.form);
    source->SetInputData(form->image);
  }
  if (!options.match.empty()) {
    match = LoadVolume(session, options.match);
    source->SetMatchData(match->image);
  }
  try {
    session.Update(source, "make", "noise");
  } catch (const Error& error) { // the filter knows no files
    const bool ofForm = options.match.empty() || std::string(error.what()).rfind("the volume with the fan", 0) == 0;
    const std::string& file = ofForm ? options.form : options.match;
    if (error.GetKind() == Error::Kind::Cancelled || file.empty())
      throw;
    throw Error(error.GetKind(), file + ": " + error.what());
  }

  vtkImageData* noise = source->GetOutput();
  const ProbeGeometry probe = vtkUltrasoundAcquisition::ProbeGeometryOf(noise).value();
  session.Say("probe    " + ProbeText(probe));
  session.result["ProbeGeometry"] = JsonOf(probe);
  session.result["ProbeToWorld"] = JsonOf(vtkUltrasoundAcquisition::ProbeToWorldOf(noise).value());
  session.result["seed"] = source->GetSeed();
  session.result["kind"] = source->GetKindAsString();
  if (source->GetKind() == vtkUltrasoundNoiseSource::BEAMS) {
    const int* counts = source->GetMadeCounts();
    const double* lengths = source->GetMadeCorrelation();
    session.Say("beams    " + std::to_string(counts[0]) + " samples, " + std::to_string(counts[1]) + " elements, " +
                std::to_string(counts[2]) + " steps");
    session.Say("grain    " + Fixed(lengths[0], 3) + " mm along the depth, " + Fixed(100.0 * lengths[1], 2) + "% of the fan, " +
                Fixed(100.0 * lengths[2], 2) + "% of the sweep");
    session.result["counts"] = {{"samples", counts[0]}, {"elements", counts[1]}, {"steps", counts[2]}};
    session.result["correlation"] = {{"depth_mm", lengths[0]}, {"fan", lengths[1]}, {"sweep", lengths[2]}};
  }
  if (match) {
    const int* resolved = source->GetMatchResolved();
    session.result["resolved"] = {resolved[0] != 0, resolved[1] != 0, resolved[2] != 0};
    const char* names[3] = {"along the depth", "across the fan", "along the sweep"};
    for (int axis = 0; axis < (probe.IsPlane() ? 2 : 3); ++axis)
      if (!resolved[axis])
        session.Note(options.match + ": its voxels are too coarse to tell the grain " + names[axis] +
                     "; the length is the most that it can be");
  }
  session.result["output"] = options.output;
  session.result["lost"] = SaveVolume(session, noise, options.output);
  session.Say("wrote " + options.output);
}

} // namespace

void EchoramaCommand(CLI::App* options, Action& action)
{
  auto values = std::make_shared<NoiseOptions>();
  const Source source = vtkSmartPointer<vtkUltrasoundNoiseSource>::New();
  options->add_option("-o,--output", values->output, "Volume to write")->type_name("VOLUME")->required();
  options->add_option("--match", values->match, "Volume whose grain and intensities the noise shall have")->type_name("VOLUME");
  options
      ->add_option("--form", values->form, "Volume whose fan the noise shall fill (else that of --match, else the options below)")
      ->type_name("VOLUME");
  AddParameter(options, source, "OnInputGrid", "--on-grid");
  AddParameters(options, source, {"Seed", "Kind"});
  AddParameter(options, source, "IntensityModel", "--intensity");
  AddParameter(options, source, "FloatOutput", "--float");
  AddParameters(options, source, {"Mean", "Samples", "Elements", "Steps", "FanCorrelation", "SweepCorrelation"});
  AddParameter(options, source, "DepthCorrelationMm", "--depth-correlation");
  AddParameter(options, source, "WindowMm", "--window");
  AddParameter(options, source, "SpacingMm", "--spacing");
  AddParameters(options, source, {"FanAngle", "FanWidth", "SweepAngle", "SweepWidth", "DepthMin", "DepthMax"});
  action = [values, source](Session& session) { MakeNoise(session, *values, source); };
}

} // namespace echorama
