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
#include <vtkInformation.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkUltrasoundAcquisition.h>
#include <vtkUltrasoundEmbedder.h>
#include <vtkUltrasoundReader.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {
namespace {

struct EmbedOptions {
  std::string file, output, form;
  std::vector<std::string> noise;
};

using LabelCounts = std::array<std::ptrdiff_t, 4>;

void CountLabels(vtkImageData* image, LabelCounts& voxels)
{
  if (vtkDataArray* labels = image->GetPointData()->GetArray(vtkUltrasoundVolume::EmbeddingName()))
    for (const unsigned char label : vtkUltrasoundVolume::ViewOf<const unsigned char>(labels, image))
      ++voxels[label];
}

// To be called where \a error was caught: the filter knows no files, but for the names of noise volumes.
[[noreturn]] void Fail(const Error& error, const EmbedOptions& options, const std::vector<LoadedVolume>& noise)
{
  const std::string reason = error.what(), subject = "the form";
  const bool named = std::any_of(noise.begin(), noise.end(),
                                 [&reason](const LoadedVolume& each) { return reason.find(each.file) != std::string::npos; });
  if (error.GetKind() == Error::Kind::Cancelled || named || reason.find(options.file) != std::string::npos)
    throw;
  if (reason.rfind(subject, 0) == 0)
    throw Error(error.GetKind(), options.form + reason.substr(subject.size()));
  throw Error(error.GetKind(), options.file + ": " + reason);
}

// What came out, of which \a image is all or a part.
void Tell(Session& session, const EmbedOptions& options, vtkUltrasoundEmbedder* embedder, vtkImageData* image,
          const ImageGeometry& geometry, const LabelCounts& voxels, const std::vector<std::string>& lost)
{
  const auto count = [&voxels](EmbeddedVoxel kind) { return voxels[static_cast<std::size_t>(kind)]; };
  const auto probe = vtkUltrasoundAcquisition::ProbeGeometryOf(image);
  const auto pose = vtkUltrasoundAcquisition::ProbeToWorldOf(image);
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

// A volume that is larger than the memory: read, embedded and written slab by slab.
void EmbedLarge(Session& session, const EmbedOptions& options, vtkUltrasoundEmbedder* embedder)
{
  if (!IsWrittenBySlabs(options.output))
    throw Error(Error::Kind::TooLarge,
                options.output + ": embedding " + options.file +
                    " needs more memory than is free or allowed (--memory), and its format is written whole; "
                    "as .mha, .nrrd or .nii it would be made slab by slab");
  session.Watch(embedder, "plan", options.file, [&] { embedder->UpdateInformation(); });
  const int slabs = embedder->GetSlabs();
  session.Note("the result is larger than the memory that is allowed: it is made and written in " + std::to_string(slabs) +
               " slabs");
  LabelCounts voxels{};
  vtkSmartPointer<vtkImageData> last;
  WriteBySlabs(session, embedder, slabs, options.output, "embed", [&](vtkImageData* slab) {
    CountLabels(slab, voxels);
    last = slab;
  });
  ImageGeometry geometry = vtkUltrasoundVolume::GeometryOf(last);
  int whole[6];
  embedder->GetOutputInformation(0)->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), whole);
  embedder->GetOutputInformation(0)->Get(vtkDataObject::ORIGIN(), geometry.origin.data());
  geometry.dimensions = {whole[1] + 1, whole[3] + 1, whole[5] + 1};
  session.result["slabs"] = slabs;
  Tell(session, options, embedder, last, geometry, voxels, {});
}

void Embed(Session& session, const EmbedOptions& options, vtkUltrasoundEmbedder* embedder)
{
  std::vector<std::string> inputs{options.file};
  inputs.insert(inputs.end(), options.noise.begin(), options.noise.end());
  if (!options.form.empty())
    inputs.push_back(options.form);
  CheckVolumeOutput(options.output, inputs);

  const std::vector<LoadedVolume> noise = LoadVolumes(session, WithoutCompanions(session, options.noise));
  LoadedVolume form;
  if (!noise.empty())
    embedder->SetInputData(1, BlocksOf(noise));
  if (!options.form.empty()) {
    form = LoadVolume(session, options.form);
    embedder->SetInputData(2, form.image);
  }
  vtkNew<vtkUltrasoundReader> reader;
  reader->SetFileName(options.file.c_str());
  embedder->SetInputConnection(reader->GetOutputPort());
  const bool isLarge = embedder->IsLargerThanMemory();
  Session::TakeReportedError(); // who reads the volume tells it
  try {
    if (isLarge) {
      EmbedLarge(session, options, embedder);
      for (const std::string& note : LinesOf(reader->GetNotes()))
        session.Note(options.file + ": " + note);
      return;
    }
    const LoadedVolume volume = LoadVolume(session, options.file);
    embedder->SetInputData(0, volume.image);
    session.Watch(embedder, "plan", options.file, [&] { embedder->UpdateInformation(); });
    if (embedder->GetSlabs() > 1) // the fan is so much larger than the data
      return EmbedLarge(session, options, embedder);
    session.Update(embedder, "embed", options.file);
  } catch (const Error& error) {
    Fail(error, options, noise);
  }
  vtkImageData* result = embedder->GetOutput();
  LabelCounts voxels{};
  CountLabels(result, voxels);
  const std::vector<std::string> lost = SaveVolume(session, result, options.output);
  Tell(session, options, embedder, result, vtkUltrasoundVolume::GeometryOf(result), voxels, lost);
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
  AddParameter(options, embedder, "MaximumMemoryGb", "--memory")
      ->description("Memory that may be used, GB (0: what is free); a larger volume is embedded slab by slab");
  action = [values, embedder](Session& session) { Embed(session, *values, embedder); };
}

} // namespace echorama
