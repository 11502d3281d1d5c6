// SPDX-License-Identifier: BSD-3-Clause
// echorama embed: a stitched volume in a background of noise, as one scan of a real machine.
#include "Commands.h"
#include "Filters/Embedding/Feather.h"
#include "Readers/OutputFiles.h"
#include "Volumes.h"
#include <algorithm>
#include <array>
#include <CLI/Validators.hpp>
#include <memory>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkUltrasoundAcquisition.h>
#include <vtkUltrasoundEmbedder.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {
namespace {

struct EmbedOptions {
  std::string file, output, form;
  std::vector<std::string> noise;
  bool match = true, contrast = true;
  double featherMm, marginMm, smoothMm, overlapDegrees, insideExponent, outsideExponent;
  std::int64_t seed;
  int preview;

  EmbedOptions()
  {
    const vtkNew<vtkUltrasoundEmbedder> defaults;
    featherMm = defaults->GetFeatherMm();
    marginMm = defaults->GetMarginMm();
    smoothMm = defaults->GetSmoothMm();
    overlapDegrees = defaults->GetOverlapDegrees();
    insideExponent = defaults->GetInsideExponent();
    outsideExponent = defaults->GetOutsideExponent();
    seed = defaults->GetSeed();
    preview = defaults->GetPreviewFactor();
  }
};

void Embed(Session& session, const EmbedOptions& options)
{
  std::vector<std::string> inputs{options.file};
  inputs.insert(inputs.end(), options.noise.begin(), options.noise.end());
  if (!options.form.empty())
    inputs.push_back(options.form);
  CheckVolumeOutput(options.output, inputs);

  const LoadedVolume volume = LoadVolume(session, options.file);
  const std::vector<LoadedVolume> noise = LoadVolumes(session, WithoutCompanions(session, options.noise));
  LoadedVolume form;
  vtkNew<vtkUltrasoundEmbedder> embedder;
  embedder->SetInputData(0, volume.image);
  if (!noise.empty())
    embedder->SetInputData(1, BlocksOf(noise));
  if (!options.form.empty()) {
    form = LoadVolume(session, options.form);
    embedder->SetInputData(2, form.image);
  }
  embedder->SetMatchGrain(options.match);
  embedder->SetMatchContrast(options.contrast);
  embedder->SetFeatherMm(options.featherMm);
  embedder->SetMarginMm(options.marginMm);
  embedder->SetSmoothMm(options.smoothMm);
  embedder->SetOverlapDegrees(options.overlapDegrees);
  embedder->SetInsideExponent(options.insideExponent);
  embedder->SetOutsideExponent(options.outsideExponent);
  embedder->SetSeed(options.seed);
  embedder->SetPreviewFactor(options.preview);
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
  session.result["report"] = LinesOf(embedder->GetNotes());
  session.Say("wrote " + options.output + ": " + std::to_string(geometry.dimensions[0]) + " x " +
              std::to_string(geometry.dimensions[1]) + " x " + std::to_string(geometry.dimensions[2]) + " voxels of " +
              Triple(geometry.spacing, " x ", 3) + " mm");
  session.Say("  outline     " + ProbeText(*probe));
  const double shown =
      static_cast<double>(count(EmbeddedVoxel::Data) + count(EmbeddedVoxel::Blend) + count(EmbeddedVoxel::Invented));
  const auto share = [&](EmbeddedVoxel kind) { return Fixed(100.0 * static_cast<double>(count(kind)) / shown, 1) + "%"; };
  session.Say("  inside      " + share(EmbeddedVoxel::Data) + " data, " + share(EmbeddedVoxel::Blend) +
              " data mixed with background, " + share(EmbeddedVoxel::Invented) + " invented background");
  for (const std::string& line : LinesOf(embedder->GetNotes()))
    session.Say("  " + line);
}

} // namespace

Command EmbedCommand(CLI::App& program)
{
  auto values = std::make_shared<EmbedOptions>();
  CLI::App* options = program.add_subcommand("embed", "Put a stitched volume into a background, so that it looks as one scan");
  options->add_option("volume", values->file, "Volume of any format")->required();
  options->add_option("-o,--output", values->output, "File to write; its extension names the format")->required();
  options->add_option("--noise", values->noise, "Real noise volumes for the background (default: noise is made)");
  options->add_flag("--match,!--no-match", values->match,
                    "Make noise with the grain of the volume, or (--no-match) with one of its own (default: --match)");
  options->add_flag("--contrast,!--no-contrast", values->contrast,
                    "Give the background the local contrast of the volume, not its brightness alone (default: --contrast)");
  options->add_option("--feather", values->featherMm, "Depth in the volume at which no background shows any more, mm")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  options->add_option("--form", values->form, "Volume whose fan is the outline; it grows until it holds all data");
  options->add_option("--margin", values->marginMm, "How far the outline reaches beyond the volume, at least, mm")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  options->add_option("--smooth", values->smoothMm, "What is smaller than this is grain, mm (standard deviation)")
      ->check(CLI::Range(1e-3, 1e6))
      ->capture_default_str();
  options->add_option("--inside-exponent", values->insideExponent, "How closely values at the border are kept, inside")
      ->check(CLI::Range(1.0, 64.0))
      ->capture_default_str();
  options->add_option("--outside-exponent", values->outsideExponent, "The same, outside")
      ->check(CLI::Range(1.0, 64.0))
      ->capture_default_str();
  options->add_option("--overlap", values->overlapDegrees, "Angle by which noise volumes overlap, degrees")
      ->check(CLI::Range(0.0, 90.0))
      ->capture_default_str();
  options->add_option("--seed", values->seed, "Seed of the noise")->check(CLI::NonNegativeNumber)->capture_default_str();
  options->add_option("--preview", values->preview, "Use every so many voxels only, for a quick look")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  return {options, [values](Session& session) { Embed(session, *values); }};
}

} // namespace echorama
