// SPDX-License-Identifier: BSD-3-Clause
// echorama align: where do overlapping volumes belong?
#include "Commands.h"
#include "Outputs.h"
#include "Volumes.h"
#include <CLI/Validators.hpp>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkUltrasoundAligner.h>

namespace echorama {
namespace {

struct AlignOptions {
  std::vector<std::string> files, settings;
  std::string output, start, apply, method = "search";
  int fixed = 1;
};

// "name=value"
void Set(vtkUltrasoundAligner* aligner, const std::string& setting)
{
  const std::size_t equals = setting.find('=');
  const std::string name = setting.substr(0, equals), text = equals == std::string::npos ? "" : setting.substr(equals + 1);
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0')
    throw Error(Error::Kind::InvalidParameter, "--set " + setting + ": name=number is needed");
  if (!aligner->SetParameter(name.c_str(), value))
    throw Error(Error::Kind::InvalidParameter, "--set " + setting + ": " + Session::TakeReportedError());
}

Pose PoseOf(vtkUltrasoundAligner* aligner, int volume)
{
  vtkNew<vtkMatrix4x4> matrix;
  aligner->GetPose(volume, matrix);
  Pose pose;
  pose.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(matrix->GetData());
  return pose;
}

void Align(Session& session, AlignOptions options)
{
  options.files = WithoutCompanions(session, options.files);
  std::vector<std::string> inputs = options.files;
  if (!options.start.empty())
    inputs.push_back(options.start);
  CheckOutput(options.output, inputs);
  if (options.fixed > static_cast<int>(options.files.size()))
    throw Error(Error::Kind::InvalidParameter, "--fixed: there are only " + std::to_string(options.files.size()) + " volumes");
  vtkNew<vtkUltrasoundAligner> aligner;
  aligner->SetFixedVolume(options.fixed - 1);
  aligner->SetMethod(options.method.c_str());
  for (const std::string& setting : options.settings)
    Set(aligner, setting);
  // Places for the moved volumes are looked for first, so that nothing is refused after all the work.
  std::unique_ptr<OutputFolder> folder;
  std::vector<std::string> places;
  if (!options.apply.empty()) {
    folder = std::make_unique<OutputFolder>(session, options.apply, inputs);
    for (const std::string& file : options.files)
      places.push_back(folder->Stage(std::filesystem::path(file).filename().string()));
  }

  std::vector<LoadedVolume> volumes = LoadVolumes(session, options.files);
  ApplyPoses(volumes, options.start);
  aligner->SetInputDataObject(BlocksOf(volumes));
  session.Update(aligner, "align");

  session.result["output"] = options.output;
  session.result["fixed"] = options.fixed;
  session.result["volumes"] = nlohmann::ordered_json::array();
  std::vector<VolumePose> poses;
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    LoadedVolume& volume = volumes[i];
    const Pose pose = PoseOf(aligner, static_cast<int>(i));
    const ImageGeometry start = volume.geometry.Moved(volume.volumeToWorld);
    const double degrees = RotationAngle(pose) * 57.29577951308232, mm = (pose * start.Centre() - start.Centre()).norm();
    MoveVolume(volume, pose);
    poses.push_back({volume.file, volume.geometry, volume.volumeToWorld});
    const int number = static_cast<int>(i);
    session.result["volumes"].push_back({{"file", volume.file},
                                         {"turned_degrees", degrees},
                                         {"moved_mm", mm},
                                         {"error_grey", aligner->GetError(number)},
                                         {"overlap", aligner->GetOverlap(number)},
                                         {"VolumeToWorld", JsonOf(volume.volumeToWorld)}});
    session.Say(volume.file + ": " +
                (number + 1 == options.fixed
                     ? "fixed"
                     : "turned by " + Fixed(degrees, 2) + " degrees, its middle moved by " + Fixed(mm, 2) + " mm, overlap " +
                           Fixed(100.0 * aligner->GetOverlap(number), 0) + "%"));
  }

  for (std::size_t i = 0; i < places.size(); ++i)
    SaveVolume(session, volumes[i].image, places[i]);
  WritePoses(options.output, poses);
  session.Say("wrote " + options.output);
  if (folder) { // the volumes have waited for the poses: both are there, or none
    folder->Commit();
    session.result["applied"] = options.apply;
    session.Say("wrote " + std::to_string(volumes.size()) + " volumes with their new geometry to " + options.apply);
  }
}

} // namespace

Command AlignCommand(CLI::App& program)
{
  auto values = std::make_shared<AlignOptions>();
  CLI::App* options = program.add_subcommand("align", "Find where overlapping volumes belong");
  options->add_option("volume", values->files, "Two or more volumes")->required();
  options->add_option("-o,--output", values->output, "Pose file to write")->required();
  options->add_option("--poses", values->start, "Pose file to start from (default: where the volumes say)");
  options->add_option("--fixed", values->fixed, "The volume (from 1) that stays where it is")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  options->add_option("--method", values->method, "How poses are found: search goes through six dimensions from coarse to fine")
      ->check(CLI::IsMember({"search"}))
      ->capture_default_str();
  const AlignSearchParameters defaults;
  options->add_option(
      "--set", values->settings,
      "A parameter of the method, as NAME=VALUE; again for each. MinimumOverlap=" + Fixed(defaults.minimumOverlap, 1) +
          " (share of a volume that must lie in others, 0.01 to 1), Samples=" + std::to_string(defaults.samples) +
          " (along each dimension: 3, 5 or 7), Levels=" + std::to_string(defaults.levels) + " (1 to 20), FirstStepMm=" +
          Fixed(defaults.firstStepMm, 0) + " (up to 1000), FirstStepDegrees=" + Fixed(defaults.firstStepDegrees, 0) +
          " (up to 60), Repeats=" + std::to_string(defaults.repeats) + " (of a level, 0 to 100), Points=" +
          std::to_string(defaults.points) + " (compared, 100 to 10000000), Seed=" + std::to_string(defaults.seed) +
          ", Pyramid=" + std::to_string(defaults.pyramid) + " (0 or 1)");
  options->add_option("--apply", values->apply, "Folder for the volumes with their new geometry");
  return {options, [values](Session& session) { Align(session, *values); }};
}

} // namespace echorama
