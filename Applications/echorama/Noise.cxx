// SPDX-License-Identifier: BSD-3-Clause
// echorama noise: what an ultrasound machine shows of nothing, in the fan of a probe.
#include "Commands.h"
#include "Core/Base/NumberText.h"
#include "Outputs.h"
#include "Volumes.h"
#include <CLI/Validators.hpp>
#include <memory>
#include <optional>
#include <vtkImageData.h>
#include <vtkSmartPointer.h>
#include <vtkUltrasoundAcquisition.h>
#include <vtkUltrasoundNoiseSource.h>

namespace echorama {
namespace {

struct NoiseOptions {
  std::string output, match, form, kind = "beams", intensity = "log";
  std::uint64_t seed = 1;
  bool onGrid = false, floats = false;
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
  if (options.onGrid && inputs.empty())
    throw Error(Error::Kind::InvalidParameter, "--on-grid takes the grid of --form or --match, and neither is given");
  source->SetKind(options.kind == "white"    ? vtkUltrasoundNoiseSource::WHITE
                  : options.kind == "perlin" ? vtkUltrasoundNoiseSource::PERLIN
                                             : vtkUltrasoundNoiseSource::BEAMS);
  source->SetIntensityModel(options.intensity == "rayleigh" ? vtkUltrasoundNoiseSource::RAYLEIGH
                                                            : vtkUltrasoundNoiseSource::LOG_COMPRESSED);
  source->SetSeed(static_cast<vtkTypeInt64>(options.seed));
  source->SetOnInputGrid(options.onGrid);
  source->SetFloatOutput(options.floats);
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
  session.result["seed"] = options.seed;
  session.result["kind"] = options.kind;
  if (options.kind == "beams") {
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

Command NoiseCommand(CLI::App& program)
{
  auto values = std::make_shared<NoiseOptions>();
  const Source source = vtkSmartPointer<vtkUltrasoundNoiseSource>::New();
  CLI::App* options = program.add_subcommand("noise", "Make noise as an ultrasound machine does, in the fan of a probe");
  options->add_option("-o,--output", values->output, "Volume to write")->required();
  options->add_option("--match", values->match, "Volume whose grain and intensities the noise shall have");
  options->add_option("--form", values->form,
                      "Volume whose fan the noise shall fill (else that of --match, else the options below)");
  options->add_flag("--on-grid", values->onGrid, "On the grid of the volume that gives the fan");
  options->add_option("--seed", values->seed, "Seed")
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 62))
      ->capture_default_str();
  options->add_option("--kind", values->kind, "Noise along beams; the others are there to compare with")
      ->check(CLI::IsMember({"beams", "white", "perlin"}))
      ->capture_default_str();
  options->add_option("--intensity", values->intensity, "Distribution of the intensities, without --match")
      ->check(CLI::IsMember({"log", "rayleigh"}))
      ->capture_default_str();
  options->add_flag("--float", values->floats, "Write float, neither rounded nor cut");

  const auto number = [options](const std::string& name, const std::string& text, double low, double high, double preset,
                                const std::function<void(double)>& set) {
    options->add_option_function<double>(name, set, text + " [" + NumberText(preset) + "]")->check(CLI::Range(low, high));
  };
  vtkUltrasoundNoiseSource* s = source;
  const std::string automatic = "; 0: three to each length of the grain";
  number("--samples", "Samples along a beam" + automatic, 0, 100000, 0,
         [source](double n) { source->SetSamples(static_cast<int>(n)); });
  number("--elements", "Beams across the fan" + automatic, 0, 100000, 0,
         [source](double n) { source->SetElements(static_cast<int>(n)); });
  number("--steps", "Planes of the sweep" + automatic, 0, 100000, 0,
         [source](double n) { source->SetSteps(static_cast<int>(n)); });
  number("--depth-correlation", "Size of the grain along the depth, mm", 0, 1000, s->GetDepthCorrelationMm(),
         [source](double n) { source->SetDepthCorrelationMm(n); });
  number("--fan-correlation", "Size of the grain across the fan, whole fans", 0, 0.25, s->GetFanCorrelation(),
         [source](double n) { source->SetFanCorrelation(n); });
  number("--sweep-correlation", "Size of the grain along the sweep, whole sweeps", 0, 0.25, s->GetSweepCorrelation(),
         [source](double n) { source->SetSweepCorrelation(n); });
  number("--mean", "Mean intensity", 1e-6, 1e6, s->GetMean(), [source](double n) { source->SetMean(n); });
  number("--window", "What is smooth over so many mm of --match is no grain", 0.01, 1000, s->GetWindowMm(),
         [source](double n) { source->SetWindowMm(n); });
  number("--spacing", "Edge of the voxels, mm", 0.01, 100, s->GetSpacingMm(), [source](double n) { source->SetSpacingMm(n); });
  number("--fan-angle", "Fan, degrees", 0, 359.9, s->GetFanAngle(), [source](double n) { source->SetFanAngle(n); });
  number("--fan-width", "Length of the array's arc, mm", 0, 10000, s->GetFanWidth(),
         [source](double n) { source->SetFanWidth(n); });
  number("--sweep-angle", "Sweep, degrees", 0, 359.9, s->GetSweepAngle(), [source](double n) { source->SetSweepAngle(n); });
  number("--sweep-width", "Length of the arc that the array travels, mm", 0, 10000, s->GetSweepWidth(),
         [source](double n) { source->SetSweepWidth(n); });
  number("--depth-min", "First depth, mm", -1000, 10000, s->GetDepthMin(), [source](double n) { source->SetDepthMin(n); });
  number("--depth-max", "Last depth, mm", -1000, 10000, s->GetDepthMax(), [source](double n) { source->SetDepthMax(n); });
  return {options, [values, source](Session& session) { MakeNoise(session, *values, source); }};
}

} // namespace echorama
