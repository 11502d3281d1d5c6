// SPDX-License-Identifier: BSD-3-Clause
// echorama convert: from one file format to another. Volumes go through VTK's reader and writer; sequences go frame by frame from
// kernel to kernel, so that they need no memory; transforms become our JSON, poses transforms of ITK.
#include "Commands.h"
#include "Core/Geometry/TransformFile.h"
#include "Filters/Calibration/ItkTransform.h"
#include "FrameList.h"
#include "ParameterOptions.h"
#include "Readers/FileKind.h"
#include "Readers/ImageHeader.h"
#include "Readers/OutputFiles.h"
#include "Readers/SequenceWriter.h"
#include "Volumes.h"
#include <algorithm>
#include <cctype>
#include <CLI/Validators.hpp>
#include <filesystem>
#include <iterator>
#include <memory>
#include <set>

namespace echorama {
namespace {

struct ConvertOptions {
  std::string input, output, frames;
  VolumeReading reading;
};

void ConvertVolume(Session& session, const ConvertOptions& options)
{
  CheckVolumeOutput(options.output, {options.input});
  const LoadedVolume volume = LoadVolume(session, options.input, options.reading);
  if (options.reading.parameters.spacingMm > 0.0 && (!volume.content.beams || options.reading.beams))
    Misused("--spacing: " + options.input + " is not scan-converted, so there is nothing to choose");
  if (!options.reading.parameters.stackSpacingMm.isZero(0.0) && volume.content.format != FileFormat::ImageStack)
    Misused("--stack-spacing: " + options.input + " is no stack of pictures; it says itself what its spacing is");
  const std::vector<std::string> lost = SaveVolume(session, volume.image, options.output);
  const std::size_t steps = volume.content.Volumes();
  if (steps > 1)
    session.Note(options.input + ": step " + std::to_string(options.reading.step) + " of " + std::to_string(steps) +
                 " was written; --time names another");
  session.result["lost"] = lost;
  session.Say("wrote " + options.output);
}

void ConvertSequence(Session& session, const ConvertOptions& options)
{
  CheckOutput(options.output, {options.input});
  const FileFormat format = FormatOfName(options.output);
  if (format != FileFormat::MetaImage && format != FileFormat::Nrrd)
    Misused(options.output +
            ": a tracked sequence becomes .mha, .mhd, .nrrd or .nhdr; echorama reconstruct makes a volume of it");
  SequenceFile sequence(options.input);
  SequenceContent content = sequence.Content();
  for (const std::string& note : content.notes)
    session.Note(options.input + ": " + note);
  const std::vector<int> frames = FramesInList(options.frames, content.frames);
  std::set<std::string> lost;
  const auto drop = [&lost](std::vector<HeaderField>& fields) {
    const auto last = std::stable_partition(fields.begin(), fields.end(), CanHold);
    std::transform(last, fields.end(), std::inserter(lost, lost.end()), [](const HeaderField& field) { return field.first; });
    fields.erase(last, fields.end());
  };
  drop(content.fields);
  FileReplacement files;
  session.Work("convert", options.input, [&](const Progress& progress) {
    SequenceWriter writer(options.output, content, true, files);
    std::vector<char> pixels(content.FrameBytes());
    for (std::size_t i = 0; i < frames.size(); ++i) {
      progress(static_cast<double>(i) / static_cast<double>(frames.size()));
      SequenceFrame frame = sequence.Frame(frames[i]);
      drop(frame.fields);
      if (content.HasImages())
        sequence.ReadFrame(frames[i], pixels.data());
      writer.Append(frame, content.HasImages() ? pixels.data() : nullptr);
    }
    writer.Finish();
  });
  files.Commit();
  for (const std::string& name : lost)
    session.Note(options.output + ": the format cannot hold the field " + name);
  session.result["frames"] = frames.size();
  session.result["lost"] = std::vector<std::string>(lost.begin(), lost.end());
  session.Say("wrote " + options.output + ": " + std::to_string(frames.size()) + " frames");
}

void ConvertTransforms(Session& session, const ConvertOptions& options)
{
  CheckOutput(options.output, {options.input});
  if (std::filesystem::path(options.output).extension() != ".json")
    Misused(options.output + ": transforms become .json");
  const std::vector<NamedTransform> transforms = ReadTransforms(options.input);
  WriteTransforms(options.output, transforms);
  session.result["lost"] = nlohmann::ordered_json::array();
  session.Say("wrote " + options.output + ": " + std::to_string(transforms.size()) + " transforms");
}

// One file per volume: of "to.tfm" and the volume "a.mha" it is "to.a.tfm"; of a single volume "to.tfm".
void ConvertPoses(Session& session, const ConvertOptions& options)
{
  namespace fs = std::filesystem;
  const fs::path output(options.output);
  if (output.extension() != ".tfm")
    Misused(options.output + ": poses become .tfm, a transform of ITK for each volume");
  const std::vector<VolumePose> poses = ReadPoses(options.input);
  std::vector<std::string> names;
  for (const VolumePose& pose : poses) {
    fs::path name = output;
    if (poses.size() > 1)
      name.replace_extension(fs::path(pose.file).stem().string() + ".tfm");
    CheckOutput(name.string(), {options.input});
    if (std::find(names.begin(), names.end(), name.string()) != names.end())
      throw Error(Error::Kind::NotPossible, name.string() + ": two volumes of " + options.input + " have this name");
    if (!pose.displacement.empty())
      session.Note(name.string() + ": how " + pose.file + " is bent is not in it");
    names.push_back(name.string());
  }
  FileReplacement files; // all of them, or none
  for (std::size_t i = 0; i < poses.size(); ++i)
    WriteItkTransform(session.Stage(files, names[i]), poses[i].volumeToWorld);
  files.Commit();
  session.result["files"] = names;
  session.result["lost"] = nlohmann::ordered_json::array();
  for (const std::string& name : names)
    session.Say("wrote " + name);
}

void Convert(Session& session, const ConvertOptions& options)
{
  session.result["input"] = options.input;
  session.result["output"] = options.output;
  const FileKind kind = KindOf(options.input);
  if (kind != FileKind::Sequence && !options.frames.empty())
    Misused("--frames: " + options.input + " is no tracked sequence");
  if (kind != FileKind::Volume &&
      (options.reading.parameters.spacingMm > 0.0 || options.reading.step > 0 || options.reading.beams ||
       !options.reading.parameters.stackSpacingMm.isZero(0.0) || options.reading.parameters.stride != 1))
    Misused("--time, --beams, --spacing, --stack-spacing and --stride: " + options.input + " is no volume");
  switch (kind) {
  case FileKind::Volume:
    return ConvertVolume(session, options);
  case FileKind::Sequence:
    return ConvertSequence(session, options);
  case FileKind::Transforms:
    return ConvertTransforms(session, options);
  case FileKind::Poses:
    return ConvertPoses(session, options);
  }
}

} // namespace

void EchoramaCommand(CLI::App* options, Action& action)
{
  auto values = std::make_shared<ConvertOptions>();
  options
      ->add_option("input", values->input, "Volume of any format (a file, or a folder of slices), sequence, transforms or poses")
      ->type_name("FILE")
      ->required();
  options->add_option("output", values->output, "File to write; its extension names the format")->type_name("FILE")->required();
  options->add_option("--time", values->reading.step, "Which volume of a time series, from 0")
      ->check(CLI::Range(0, 2147483647))
      ->capture_default_str();
  options->add_flag("--beams", values->reading.beams,
                    "Write the samples along beams that the file holds, not their scan conversion");
  AddParameter(options, Describe(values->reading.parameters), "SpacingMm", "--spacing");
  AddParameter(options, Describe(values->reading.parameters), "StackSpacingMm", "--stack-spacing");
  AddParameter(options, Describe(values->reading.parameters), "Stride", "--stride");
  options->add_option("--frames", values->frames,
                      "Frames of a sequence, from 0: a list of single ones and FROM:TO:STEP, both included");
  action = [values](Session& session) { Convert(session, *values); };
}

} // namespace echorama
