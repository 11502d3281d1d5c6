// SPDX-License-Identifier: BSD-3-Clause
// echorama reconstruct: a tracked sequence of 2D images becomes a volume.
#include "Commands.h"
#include "Core/Base/NumberText.h"
#include "Core/Geometry/TransformFile.h"
#include "Core/Geometry/TransformGraph.h"
#include "FrameList.h"
#include "ParameterOptions.h"
#include "Readers/OutputFiles.h"
#include "Readers/SequencePoses.h"
#include "Volumes.h"
#include <algorithm>
#include <array>
#include <CLI/Validators.hpp>
#include <memory>
#include <sstream>
#include <tuple>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkUltrasoundSequenceReader.h>
#include <vtkUltrasoundVolume.h>
#include <vtkUltrasoundVolumeReconstructor.h>

namespace echorama {
namespace {

using Reconstructor = vtkUltrasoundVolumeReconstructor;

struct ReconstructOptions {
  std::string sequence, output, transforms, transform, frames, clip = "auto", grid = "oriented";
  double memoryGb = 0.0;
};

// "FROM:TO:STEP", checked against what is there.
void SetFrames(Reconstructor* reconstructor, const std::string& text, const SequenceContent& content)
{
  if (text.find(',') != std::string::npos)
    Misused("--frames " + text + ": one FROM:TO:STEP is needed; echorama convert --frames cuts out anything else");
  const std::vector<int> frames = FramesInList(text, content.frames);
  reconstructor->SetFirstFrame(frames.front());
  reconstructor->SetLastFrame(frames.back());
  reconstructor->SetFrameStep(frames.size() > 1 ? frames[1] - frames[0] : 1);
}

// "auto", "none" or "X,Y,WIDTH,HEIGHT".
void SetClip(Reconstructor* reconstructor, const std::string& text, const SequenceContent& content)
{
  if (text == "auto" || text == "none") {
    reconstructor->SetSector(text == "auto" ? Reconstructor::DETECTED : Reconstructor::ALL);
    return;
  }
  std::istringstream stream(text);
  std::vector<int> numbers;
  for (std::string word; std::getline(stream, word, ',');) {
    numbers.push_back(-1);
    if (!ParseNumber(word, numbers.back()))
      break;
  }
  if (numbers.size() != 4 || std::count(text.begin(), text.end(), ',') != 3 ||
      std::any_of(numbers.begin(), numbers.end(), [](int number) { return number < 0; }))
    Misused("--clip " + text + ": auto, none or X,Y,WIDTH,HEIGHT in pixels is needed");
  const auto [x, y, width, height] = std::array<int, 4>{numbers[0], numbers[1], numbers[2], numbers[3]};
  if (width < 1 || height < 1 || x > content.dimensions[0] - width || y > content.dimensions[1] - height)
    Misused("--clip " + text + ": the rectangle does not lie in the images of " + std::to_string(content.dimensions[0]) + " x " +
            std::to_string(content.dimensions[1]) + " pixels");
  reconstructor->SetSector(Reconstructor::RECTANGLE);
  reconstructor->SetRectangle(x, x + width - 1, y, y + height - 1);
}

// Which transforms place the images, so that a calibration that is missing is told before any image is read.
SequencePoses PlaceOf(const SequenceContent& content, const ReconstructOptions& options)
{
  std::vector<NamedTransform> fixed;
  if (!options.transforms.empty())
    fixed = ReadTransforms(options.transforms);
  std::string image = "Image", world;
  if (!options.transform.empty()) {
    const auto frames = FramesOf(options.transform);
    if (!frames)
      Misused("--transform " + options.transform + ": a name such as ImageToReference is needed");
    std::tie(image, world) = *frames;
  }
  const auto fail = [&](const std::string& reason) {
    throw Error(Error::Kind::NotPossible,
                options.sequence + ": " + reason + (options.transforms.empty() ? "; --transforms FILE gives a calibration" : ""));
  };
  if (content.transforms.empty() && fixed.empty())
    fail("it has no transforms that could place its images");
  try {
    const SequencePoses place(content, fixed, image, world);
    if (!place.ImageIsPlaced())
      fail("no transforms lead from " + image + " to " + place.World());
    return place;
  } catch (const Error& error) {
    if (error.GetKind() == Error::Kind::NotPossible && std::string(error.what()).find(options.sequence) == std::string::npos)
      fail(error.what());
    throw;
  }
}

void Reconstruct(Session& session, const ReconstructOptions& options, Reconstructor* reconstructor)
{
  std::vector<std::string> inputs{options.sequence};
  if (!options.transforms.empty())
    inputs.push_back(options.transforms);
  const bool gridIsGiven = options.grid != "oriented" && options.grid != "axis";
  if (gridIsGiven)
    inputs.push_back(options.grid);
  CheckVolumeOutput(options.output, inputs);
  if (gridIsGiven && reconstructor->GetSpacingMm() > 0.0)
    Misused("--spacing: the grid of " + options.grid + " has its own");

  const SequenceContent content = SequenceFile(options.sequence).Content();
  if (!content.HasImages())
    throw Error(Error::Kind::BadInput, options.sequence + ": it holds poses of trackers alone, no images");
  const SequencePoses place = PlaceOf(content, options);
  for (const std::string& note : content.notes)
    session.Note(options.sequence + ": " + note);
  SetFrames(reconstructor, options.frames, content);
  SetClip(reconstructor, options.clip, content);
  reconstructor->SetGrid(options.grid == "axis" ? Reconstructor::WORLD : Reconstructor::FITTED);
  reconstructor->SetMemoryLimitMb(1000.0 * options.memoryGb);
  LoadedVolume grid;
  if (gridIsGiven) {
    grid = LoadVolume(session, options.grid);
    reconstructor->SetReferenceData(grid.image);
  }

  vtkNew<vtkUltrasoundSequenceReader> reader;
  reader->SetFileName(options.sequence.c_str());
  reader->SetTransformFile(options.transforms.empty() ? nullptr : options.transforms.c_str());
  reader->SetImageFrame(place.Image().c_str());
  reader->SetWorldFrame(place.World().c_str());
  reconstructor->SetInputConnection(reader->GetOutputPort());
  session.Update(reconstructor, "reconstruct", options.sequence);
  vtkImageData* volume = reconstructor->GetOutput();

  double pixels = 0.0;
  vtkDataArray* coverage = volume->GetPointData()->GetArray(Reconstructor::CoverageName());
  for (const unsigned short count : vtkUltrasoundVolume::ViewOf<const unsigned short>(coverage, volume))
    pixels += count;
  // Formats that hold one array would only complain about what was not asked for.
  if (FormatOfName(options.output) != FileFormat::VtkXmlImage) {
    volume->GetPointData()->RemoveArray(Reconstructor::CoverageName());
    volume->GetFieldData()->RemoveArray(Reconstructor::ReportName());
  }
  const std::vector<std::string> lost = SaveVolume(session, volume, options.output);

  const ImageGeometry geometry = vtkUltrasoundVolume::GeometryOf(volume);
  const double voxels = static_cast<double>(geometry.VoxelCount());
  const double seen = static_cast<double>(reconstructor->GetVoxelsSeen()),
               filled = static_cast<double>(reconstructor->GetVoxelsFilled());
  const double coverageMean = seen > 0.0 ? pixels / seen : 0.0;
  session.result["sequence"] = options.sequence;
  session.result["output"] = options.output;
  session.result["lost"] = lost;
  session.result["transform"] = place.Image() + "To" + place.World();
  session.result["path"] = place.Find(place.Image()).path;
  session.result["frames"] = content.frames;
  session.result["frames_used"] = reconstructor->GetFramesUsed();
  session.result["frames_refused"] = reconstructor->GetFramesRefused();
  session.result["frames_between"] = reconstructor->GetFramesBetween();
  session.result["dimensions"] = geometry.dimensions;
  session.result["spacing"] = JsonOf(geometry.spacing);
  session.result["origin"] = JsonOf(geometry.origin);
  session.result["voxels_seen"] = reconstructor->GetVoxelsSeen();
  session.result["voxels_filled"] = reconstructor->GetVoxelsFilled();
  session.result["mean_coverage"] = coverageMean;
  session.result["memory_mb"] = reconstructor->GetMemoryMb();
  session.result["report"] = LinesOf(reconstructor->GetReport());
  session.Say("wrote " + options.output + ": " + std::to_string(geometry.dimensions[0]) + " x " +
              std::to_string(geometry.dimensions[1]) + " x " + std::to_string(geometry.dimensions[2]) + " voxels of " +
              Triple(geometry.spacing, " x ", 3) + " mm");
  const std::string placing = place.Image() + "To" + place.World(), path = place.Find(place.Image()).PathText();
  session.Say("  images placed by " + placing + (path == placing ? "" : ", composed of " + path));
  for (const std::string& line : LinesOf(reconstructor->GetReport()))
    session.Say("  " + line);
  session.Say("  " + Fixed(100.0 * (seen + filled) / voxels, 1) + "% of the voxels are real; those that were seen got " +
              Fixed(coverageMean, 1) + " pixels each");
}

} // namespace

void EchoramaCommand(CLI::App* options, Action& action)
{
  auto values = std::make_shared<ReconstructOptions>();
  const auto reconstructor = vtkSmartPointer<Reconstructor>::New();
  options->add_option("sequence", values->sequence, "Tracked sequence (.igs.mha .seq.mha .mhd .seq.nrrd .nhdr)")
      ->type_name("FILE")
      ->required();
  options->add_option("-o,--output", values->output, "File to write; its extension names the format")
      ->type_name("VOLUME")
      ->required();
  options
      ->add_option(
          "--transforms", values->transforms,
          "Transforms that hold for all frames, such as the probe's calibration: a configuration of Plus (.xml) or .json")
      ->type_name("FILE");
  options->add_option(
      "--transform", values->transform,
      "Name of the transform that places the images, such as ImageToReference (default: from Image to the first of "
      "Reference, World and Tracker that is there)");
  options->add_option("--frames", values->frames, "Frames to use, FROM:TO:STEP, from 0, both included (default: all)");
  AddParameter(options, reconstructor, "SpacingMm", "--spacing");
  options
      ->add_option("--grid", values->grid,
                   "oriented (to the sweep), axis (along the world's axes), or a volume whose grid is taken")
      ->capture_default_str();
  options
      ->add_option("--clip", values->clip, "Part of the images: auto (the sector is found), none, or X,Y,WIDTH,HEIGHT in pixels")
      ->capture_default_str();
  AddParameter(options, reconstructor, "Compounding", "--mode");
  AddParameter(options, reconstructor, "Alpha");
  AddParameter(options, reconstructor, "Splat", "--interpolation");
  AddParameter(options, reconstructor, "Between");
  AddParameter(options, reconstructor, "MaximumGapMm", "--maximum-gap");
  AddParameter(options, reconstructor, "Holes", "--fill");
  AddParameter(options, reconstructor, "HoleReach", "--reach");
  options->add_option("--memory", values->memoryGb, "Refuse what needs more memory than this, GB (0: what is free)")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  action = [values, reconstructor](Session& session) { Reconstruct(session, *values, reconstructor); };
}

} // namespace echorama
