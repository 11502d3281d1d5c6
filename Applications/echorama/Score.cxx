// SPDX-License-Identifier: BSD-3-Clause
// echorama score: how far poses are from the truth.
#include "Commands.h"
#include "Volumes.h"
#include <CLI/Validators.hpp>
#include <filesystem>
#include <memory>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkUltrasoundAlignmentScore.h>

namespace echorama {
namespace {

struct ScoreOptions {
  std::string poses, truth;
  int fixed = 1, points = vtkNew<vtkUltrasoundAlignmentScore>()->GetPoints();
};

void Score(Session& session, const ScoreOptions& options)
{
  const std::vector<VolumePose> poses = ReadPoses(options.poses), truth = ReadPoses(options.truth);
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
  vtkNew<vtkUltrasoundAlignmentScore> score;
  score->SetInputDataObject(BlocksOf(aligned));
  score->AddTruthData(BlocksOf(belonging));
  score->SetFixedVolume(options.fixed - 1);
  score->SetPoints(options.points);
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

} // namespace

Command ScoreCommand(CLI::App& program)
{
  auto values = std::make_shared<ScoreOptions>();
  CLI::App* options = program.add_subcommand("score", "Tell how far poses are from the truth");
  options->add_option("poses", values->poses, "Pose file to score; its volumes are read")->required();
  options->add_option("--truth", values->truth, "Pose file that says where the volumes belong")->required();
  options->add_option("--fixed", values->fixed, "The volume (from 1) that both pose files are taken to agree on")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  options->add_option("--points", values->points, "Points drawn in each valid region")
      ->check(CLI::Range(1, 10000000))
      ->capture_default_str();
  return {options, [values](Session& session) { Score(session, *values); }};
}

} // namespace echorama
