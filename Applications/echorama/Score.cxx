// SPDX-License-Identifier: BSD-3-Clause
// echorama score: how far poses are from the truth, and landmarks from each other.
#include "Commands.h"
#include "Displacements.h"
#include "Landmarks.h"
#include "ParameterOptions.h"
#include "Volumes.h"
#include <CLI/Validators.hpp>
#include <filesystem>
#include <memory>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkUltrasoundAlignmentScore.h>

namespace echorama {
namespace {

struct ScoreOptions {
  std::string poses, truth;
  std::vector<std::string> landmarks;
  int fixed = 1; // from 1
};

void ScoreWithTruth(Session& session, const ScoreOptions& options, vtkUltrasoundAlignmentScore* score,
                    const std::vector<VolumePose>& poses)
{
  const std::vector<VolumePose> truth = ReadPoses(options.truth);
  if (options.fixed > static_cast<int>(poses.size()))
    throw Error(Error::Kind::InvalidParameter,
                "--fixed: " + options.poses + " has only " + std::to_string(poses.size()) + " volumes");
  std::vector<LoadedVolume> aligned, belonging;
  for (const VolumePose& pose : poses) {
    LoadedVolume volume = LoadVolume(session, pose.file), twin = volume;
    twin.image = vtkSmartPointer<vtkImageData>::New();
    twin.image->ShallowCopy(volume.image);
    MoveVolume(volume, PoseIn(poses, options.poses, volume).volumeToWorld);
    MoveVolume(twin, PoseIn(truth, options.truth, twin).volumeToWorld);
    aligned.push_back(volume);
    belonging.push_back(twin);
  }
  score->SetInputDataObject(BlocksOf(aligned));
  score->AddTruthData(BlocksOf(belonging));
  score->SetFixedVolume(options.fixed - 1);
  session.Update(score, "score");

  session.result["score_mm"] = score->GetScore();
  session.result["fixed"] = options.fixed;
  session.result["volumes"] = nlohmann::ordered_json::array();
  session.Say("score " + Fixed(score->GetScore(), 3) +
              " mm (mean distance of points of the valid regions from where they belong)");
  vtkFieldData* figures = score->GetOutput()->GetFieldData();
  for (int i = 0; i < static_cast<int>(aligned.size()); ++i) {
    const auto figure = [figures, i](const char* name) {
      vtkDataArray* array = figures->GetArray(name);
      return array->GetComponent(i / array->GetNumberOfComponents(), i % array->GetNumberOfComponents());
    };
    session.result["volumes"].push_back({{"file", aligned[i].file},
                                         {"mean_mm", figure("VolumeScore")},
                                         {"median_mm", figure("VolumeMedian")},
                                         {"rms_mm", figure("VolumeRms")},
                                         {"percentile95_mm", figure("VolumePercentile95")},
                                         {"max_mm", figure("VolumeMax")}});
    session.Say("  " + std::filesystem::path(aligned[i].file).filename().string() + ": " +
                (i + 1 == options.fixed
                     ? "fixed"
                     : "mean " + Fixed(figure("VolumeScore"), 3) + ", 95% within " + Fixed(figure("VolumePercentile95"), 3) +
                           ", at most " + Fixed(figure("VolumeMax"), 3) + " mm"));
  }
}

void ScoreWithLandmarks(Session& session, const ScoreOptions& options, const std::vector<VolumePose>& poses)
{
  std::vector<LandmarkList> lists = ReadLandmarkLists(options.landmarks, poses.size(), options.poses + " has ");
  std::vector<std::string> files;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    lists[i].volumeToWorld = poses[i].volumeToWorld;
    lists[i].displacement = DisplacementOf(session, poses[i]);
    files.push_back(poses[i].file);
  }
  TellLandmarkError(session, lists, files);
}

void Score(Session& session, const ScoreOptions& options, vtkUltrasoundAlignmentScore* score)
{
  const std::vector<VolumePose> poses = ReadPoses(options.poses);
  if (options.truth.empty() && options.landmarks.empty())
    throw Error(Error::Kind::InvalidParameter, "give --truth or --landmarks to compare the poses with");
  if (!options.truth.empty())
    ScoreWithTruth(session, options, score, poses);
  if (!options.landmarks.empty())
    ScoreWithLandmarks(session, options, poses);
}

} // namespace

void EchoramaCommand(CLI::App* options, Action& action)
{
  auto values = std::make_shared<ScoreOptions>();
  const auto score = vtkSmartPointer<vtkUltrasoundAlignmentScore>::New();
  options->add_option("poses", values->poses, "Pose file to score; with --truth its volumes are read")
      ->type_name("FILE")
      ->required();
  options->add_option("--truth", values->truth, "Pose file that says where the volumes belong")->type_name("FILE");
  AddLandmarksOption(options, values->landmarks, "Landmarks to compare the poses with");
  options->add_option("--fixed", values->fixed, "The volume (from 1) that both pose files are taken to agree on")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  AddParameter(options, score, "Points");
  action = [values, score](Session& session) { Score(session, *values, score); };
}

} // namespace echorama
