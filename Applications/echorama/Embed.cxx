// SPDX-License-Identifier: BSD-3-Clause
// echorama embed: a stitched volume in a background of noise, as one scan of a real machine.
#include "Commands.h"
#include "Core/Base/FormatText.h"
#include "Filters/Embedding/Feather.h"
#include "ParameterOptions.h"
#include "Readers/OutputFiles.h"
#include "Volumes.h"
#include <algorithm>
#include <array>
#include <memory>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkUltrasoundAcquisition.h>
#include <vtkUltrasoundEmbedder.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {
namespace {

struct EmbedOptions {
  std::string file, output, form;
  std::vector<std::string> noise;
};

void Embed(Session& session, const EmbedOptions& options, vtkUltrasoundEmbedder* embedder)
{
  std::vector<std::string> inputs{options.file};
  inputs.insert(inputs.end(), options.noise.begin(), options.noise.end());
  if (!options.form.empty())
    inputs.push_back(options.form);
  CheckVolumeOutput(options.output, inputs);

  const LoadedVolume volume = LoadVolume(session, options.file);
  const std::vector<LoadedVolume> noise = LoadVolumes(session, WithoutCompanions(session, options.noise));
  LoadedVolume form;
  embedder->SetInputData(0, volume.image);
  if (!noise.empty())
    embedder->SetInputData(1, BlocksOf(noise));
  if (!options.form.empty()) {
    form = LoadVolume(session, options.form);
    embedder->SetInputData(2, form.image);
  }
  try {
    session.Update(embedder, "embed", options.file);
  } catch (const Error& error) { // the filter knows no files, but for the names of noise volumes
    const std::string reason = error.what(), subject = "the form";
    const bool named = std::any_of(noise.begin(), noise.end(),
                                   [&reason](const LoadedVolume& each) { return reason.find(each.file) != std::string::npos; });
    if (error.GetKind() == Error::Kind::Cancelled || named)
      throw;
    if (reason.rfind(subject, 0) == 0)
      throw Error(error.GetKind(), options.form + reason.substr(subject.size()));
    throw Error(error.GetKind(), options.file + ": " + reason);
  }
  vtkImageData* result = embedder->GetOutput();

  std::array<std::ptrdiff_t, 4> voxels{};
  for (const unsigned char label : vtkUltrasoundVolume::ViewOf<const unsigned char>(
           result->GetPointData()->GetArray(vtkUltrasoundVolume::EmbeddingName()), result))
    ++voxels[label];
  const auto count = [&voxels](EmbeddedVoxel kind) { return voxels[static_cast<std::size_t>(kind)]; };
  const std::vector<std::string> lost = SaveVolume(session, result, options.output);

  const ImageGeometry geometry = vtkUltrasoundVolume::GeometryOf(result);
  const auto probe = vtkUltrasoundAcquisition::ProbeGeometryOf(result);
  const auto pose = vtkUltrasoundAcquisition::ProbeToWorldOf(result);
  session.result["file"] = options.file;
  session.result["output"] = options.output;
  session.result["lost"] = lost;
  session.result["dimensions"] = geometry.dimensions;
  session.result["spacing"] = JsonOf(geometry.spacing);
  session.result["origin"] = JsonOf(geometry.origin);
  session.result["ProbeGeometry"] = JsonOf(*probe);
  session.result["ProbeToWorld"] = JsonOf(*pose);
  session.result["voxels_data"] = count(EmbeddedVoxel::Data);
  session.result["voxels_blend"] = count(EmbeddedVoxel::Blend);
  session.result["voxels_invented"] = count(EmbeddedVoxel::Invented);
  session.result["feather_mm"] = embedder->GetUsedFeatherMm();
  if (embedder->GetSpeckleGrains() >= 0.0) {
    session.result["speckle_grains"] = embedder->GetSpeckleGrains();
    session.result["speckle_share"] = embedder->GetSpeckleShare();
  }
  session.result["enough_speckle"] = embedder->GetEnoughSpeckle();
  session.result["report"] = LinesOf(embedder->GetNotes());
  session.Say("wrote " + options.output + ": " + SizeText(geometry.dimensions) + " voxels of " +
              Triple(geometry.spacing, " x ", 3) + " mm");
  session.Say("  outline     " + ProbeText(*probe));
  const double shown =
      static_cast<double>(count(EmbeddedVoxel::Data) + count(EmbeddedVoxel::Blend) + count(EmbeddedVoxel::Invented));
  const auto share = [&](EmbeddedVoxel kind) { return Fixed(100.0 * static_cast<double>(count(kind)) / shown, 1) + "%"; };
  session.Say("  inside      " + share(EmbeddedVoxel::Data) + " data, " + share(EmbeddedVoxel::Blend) +
              " data mixed with background, " + share(EmbeddedVoxel::Invented) + " invented background");
  session.Say("  feather     " + Fixed(embedder->GetUsedFeatherMm(), 2) + " mm");
  for (const std::string& line : LinesOf(embedder->GetNotes()))
    session.Say("  " + line);
}

} // namespace

void EchoramaCommand(CLI::App* options, Action& action)
{
  auto values = std::make_shared<EmbedOptions>();
  const auto embedder = vtkSmartPointer<vtkUltrasoundEmbedder>::New();
  options->add_option("volume", values->file, "Volume of any format")->type_name("VOLUME")->required();
  options->add_option("-o,--output", values->output, "File to write; its extension names the format")
      ->type_name("VOLUME")
      ->required();
  options->add_option("--noise", values->noise, "Real noise volumes for the background (default: noise is made)")
      ->type_name("VOLUME");
  options->add_option("--form", values->form, "Volume whose fan is the outline; it grows until it holds all data")
      ->type_name("VOLUME");
  AddParameter(options, embedder, "MatchGrain", "--match");
  AddParameter(options, embedder, "MatchContrast", "--contrast");
  for (const char* asItIs : {"--match", "--contrast"})
    options->add_flag(asItIs)->group(""); // accepted, and not listed
  AddParameter(options, embedder, "FeatherMm", "--feather");
  AddParameter(options, embedder, "MarginMm", "--margin");
  AddParameter(options, embedder, "Outline");
  AddParameter(options, embedder, "SmoothMm", "--smooth");
  AddParameters(options, embedder, {"InsideExponent", "OutsideExponent"});
  AddParameter(options, embedder, "OverlapDegrees", "--overlap");
  AddParameter(options, embedder, "Seed");
  AddParameter(options, embedder, "PreviewFactor", "--preview");
  action = [values, embedder](Session& session) { Embed(session, *values, embedder); };
}

} // namespace echorama
