// SPDX-License-Identifier: BSD-3-Clause
// echorama calibrate hand-eye: from volumes of the calibration rig and a tracker's recording to where the volume is in the
// sensor's frame (dissertation 4.1.2).
#include "Calibrate.h"
#include "CalibrationRigFile.h"
#include "Core/Base/Angles.h"
#include "Core/Base/JsonPlace.h"
#include "Core/Geometry/MatrixRows.h"
#include "Core/Geometry/TransformFile.h"
#include "Filters/Calibration/CalibrationJson.h"
#include "Readers/OutputFiles.h"
#include "TrackedVolumes.h"
#include <CLI/Validators.hpp>
#include <cmath>
#include <filesystem>
#include <memory>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkUltrasoundAligner.h>
#include <vtkUltrasoundRigFit.h>

namespace echorama {
namespace {

struct HandEyeOptions {
  std::vector<std::string> volumes;
  TrackerOptions tracker;
  std::string poses, savePoses, output, start;
  std::vector<double> target;
  HandEyeParameters parameters;
  std::string rig = "1", align = "rig";
  double depthScale = 0.0;
  bool noiseGiven = false;
};

// What was found of the rig in the volumes.
struct RigReport {
  double depthScale = 0.0, depthScaleError = 0.0;
  std::vector<int> found;
  std::vector<double> rmsMm;
};

// Finds the rig in each volume and moves the volumes so that it lies in one place: the rig's frame is the world. One bath, one
// speed of sound: the depth scale is found from all volumes, weighted by how well each knows it. \returns in which volumes it was
// found
std::vector<bool> FindRig(Session& session, const HandEyeOptions& options, std::vector<LoadedVolume>& volumes, RigReport& report)
{
  const std::vector<RigBall> balls = RigBallsOf(options.rig);
  std::vector<bool> found(volumes.size(), true);
  report.depthScale = options.depthScale;
  for (const bool last : {false, true}) {
    if (!last && report.depthScale > 0.0)
      continue; // it is given
    double sum = 0.0, weights = 0.0;
    for (std::size_t i = 0; i < volumes.size(); ++i) {
      if (!found[i])
        continue;
      vtkNew<vtkUltrasoundRigFit> fit;
      for (const RigBall& ball : balls)
        fit->AddBall(ball.name.c_str(), ball.centre.data(), ball.radius);
      fit->SetInputData(volumes[i].image);
      fit->SetDepthScale(report.depthScale);
      try {
        session.Update(fit, last ? "find rig" : "measure depth", volumes[i].file);
      } catch (const Error& error) {
        if (error.GetKind() == Error::Kind::Cancelled)
          throw;
        found[i] = false;
        session.Note(volumes[i].file + ": it is left out: " + error.what());
        continue;
      }
      if (last) {
        vtkNew<vtkMatrix4x4> matrix;
        fit->GetRigToWorld(matrix);
        MoveVolume(volumes[i], FromRows<Pose>(matrix->GetData()).inverse());
        report.found.push_back(fit->GetNumberOfFoundBalls());
        report.rmsMm.push_back(fit->GetRmsMm());
        session.Say("  " + volumes[i].file + ": " + std::to_string(fit->GetNumberOfFoundBalls()) + " of " +
                    std::to_string(balls.size()) + " balls, " + Fixed(fit->GetRmsMm(), 2) + " mm");
      } else {
        const double error = std::max(fit->Fit().depthScaleError, 1e-4), weight = 1.0 / (error * error);
        sum += weight * fit->GetFoundDepthScale();
        weights += weight;
      }
    }
    if (!last) {
      if (weights <= 0.0)
        throw Error(Error::Kind::NotPossible, "the rig was found in no volume");
      report.depthScale = sum / weights;
      report.depthScaleError = 1.0 / std::sqrt(weights);
      session.Say("depth scale " + Fixed(report.depthScale, 4) + " (standard error " + Fixed(report.depthScaleError, 4) +
                  "): a bath of " + Fixed(1540.0 / report.depthScale, 0) + " m/s for a scanner that assumes 1540");
    }
  }
  return found;
}

// Moves the volumes to where they agree. \returns which of them are trusted
std::vector<bool> AlignContents(Session& session, const HandEyeOptions& options, std::vector<LoadedVolume>& volumes)
{
  vtkNew<vtkUltrasoundAligner> aligner;
  aligner->SetStart(options.start.c_str());
  aligner->SetInputDataObject(BlocksOf(volumes));
  session.Update(aligner, "align");
  std::vector<bool> trusted;
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    const int number = static_cast<int>(i);
    vtkNew<vtkMatrix4x4> matrix;
    aligner->GetPose(number, matrix);
    MoveVolume(volumes[i], FromRows<Pose>(matrix->GetData()));
    trusted.push_back(aligner->GetVerdict(number) == "aligned");
    if (!trusted.back())
      session.Note(volumes[i].file + ": it is left out: " + aligner->GetVerdict(number) + " (" + aligner->GetReason(number) +
                   ")");
  }
  return trusted;
}

void CalibrateHandEyeFromVolumes(Session& session, HandEyeOptions options)
{
  options.volumes = WithoutCompanions(session, options.volumes);
  std::vector<std::string> inputs = options.volumes;
  inputs.push_back(options.tracker.log);
  if (!options.poses.empty())
    inputs.push_back(options.poses);
  if (std::filesystem::exists(options.rig)) // a table, not the size of the standard rig
    inputs.push_back(options.rig);
  CheckOutput(options.output, inputs);
  if (!options.savePoses.empty()) {
    CheckOutput(options.savePoses, inputs);
    if (std::filesystem::weakly_canonical(options.savePoses) == std::filesystem::weakly_canonical(options.output))
      throw Error(Error::Kind::InvalidParameter, options.savePoses + ": --save-poses and --output name the same file");
  }

  HandEyeParameters& parameters = options.parameters;
  const ToolTrack tool = ReadTool(session, options.tracker.log, options.tracker.tool, options.tracker.reading);
  std::vector<LoadedVolume> volumes = LoadVolumes(session, options.volumes);
  const std::vector<TrackedVolume> tracked = TrackedVolumesOf(options.tracker, volumes);
  const SensorPoses sensor = MatchSensor(tool, tracked, options.tracker.matching);
  const VolumeFrames frames = FindVolumeFrames(tracked);
  for (const auto& notes : {sensor.notes, frames.notes})
    for (const std::string& note : notes)
      session.Note(note);
  session.Say("tracker: " + sensor.how);
  // Where the error counts: the middle of what is seen.
  for (std::size_t i = 0; i < volumes.size(); ++i)
    parameters.target += frames.toWorld[i].inverse() * volumes[i].geometry.Centre() / static_cast<double>(volumes.size());
  if (!options.target.empty())
    parameters.target = Eigen::Vector3d(options.target.data());

  ApplyPoses(session, volumes, options.poses);
  if (!options.savePoses.empty())
    RehearsePoses(session, volumes, options.savePoses);
  std::vector<bool> trusted(volumes.size(), true);
  RigReport rig;
  if (options.poses.empty())
    trusted = options.align == "rig" ? FindRig(session, options, volumes, rig) : AlignContents(session, options, volumes);
  std::vector<HandEyePair> pairs;
  std::vector<VolumePose> poses;
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    poses.push_back({volumes[i].file, volumes[i].geometry, volumes[i].volumeToWorld});
    if (trusted[i])
      pairs.push_back({sensor.poses[i], volumes[i].volumeToWorld * frames.toWorld[i], volumes[i].file});
  }
  parameters.estimateNoise = !options.noiseGiven;

  HandEyeResult result;
  session.Work("calibrate", "", [&](const Progress& progress) { result = CalibrateHandEye(pairs, parameters, progress); });
  for (const std::string& note : result.notes)
    session.Note(note);

  NamedTransform calibration, world;
  calibration.from = "Volume";
  calibration.to = tool.from;
  calibration.matrix = result.solution.volumeToSensor;
  calibration.errorMm = result.targetRmsMm;
  world.from = "World";
  world.to = tool.to;
  world.matrix = result.solution.worldToTracker;
  nlohmann::ordered_json report = ToJson(result, parameters.With(result.noise));
  report["volume_frame"] = frames.Name();
  if (rig.depthScale > 0.0)
    report["rig"] = {{"rig", options.rig},
                     {"depth_scale", rig.depthScale},
                     {"depth_scale_error", rig.depthScaleError},
                     {"balls", rig.found},
                     {"rms_mm", rig.rmsMm}};
  session.result["output"] = options.output;
  session.result[calibration.Name()] = JsonOf(result.solution.volumeToSensor);
  session.result[world.Name()] = JsonOf(result.solution.worldToTracker);
  session.result["report"] = report;
  const Eigen::Vector3d offset = result.solution.volumeToSensor.translation();
  session.Say(calibration.Name() + ": " + Triple(offset, ", ", 2) + " mm, turned by " +
              Fixed(RotationAngle(result.solution.volumeToSensor) * DegreesPerRadian, 2) + " degrees, from " +
              std::to_string(result.inliers) + " of " + std::to_string(options.volumes.size()) + " scans");
  session.Say("error at the middle of the volume: " + Fixed(result.targetRmsMm, 2) + " mm RMS, within " +
              Fixed(result.targetRadius95Mm, 2) + " mm with 95%" + (result.noiseEstimated ? " (noise from the residuals)" : ""));
  for (const HandEyeResidual& residual : result.residuals)
    session.Say("  " + residual.name + ": " + Fixed(residual.mm, 2) + " mm, " + Fixed(residual.degrees, 2) + " degrees" +
                (residual.inlier ? "" : ", not used: " + residual.reason));
  if (!result.advice.empty())
    session.Say("what would help most: " + result.advice.front().text);
  if (2 * result.inliers < static_cast<int>(options.volumes.size())) {
    session.status = Session::Doubtful;
    session.Note("more than half of the scans could not be used: check the calibration before using it");
  }
  FileReplacement files; // both, or none
  if (!options.savePoses.empty())
    WritePoses(session.Stage(files, options.savePoses), poses);
  WriteTransforms(session.Stage(files, options.output), {calibration, world}, JsonPlace::Print(report));
  files.Commit();
  session.Say("wrote " + options.output);
}

} // namespace

CalibrateKind CalibrateHandEyeCommand(CLI::App& calibrate)
{
  auto values = std::make_shared<HandEyeOptions>();
  CLI::App* options = calibrate.add_subcommand("hand-eye", "Where a volume is in the frame of the sensor on its probe");
  options->add_option("--volumes", values->volumes, "Three or more volumes of the calibration rig (8 to 20 are better)")
      ->type_name("VOLUME")
      ->required();
  values->tracker.AddTo(*options, true);
  options->add_option("-o,--output", values->output, "Calibration to write (JSON)")->type_name("FILE")->required();
  options
      ->add_option("--poses", values->poses,
                   "Pose file with the volumes' alignment, a person's for instance (default: they are aligned)")
      ->type_name("FILE");
  options->add_option("--save-poses", values->savePoses, "Pose file to write the alignment to")->type_name("FILE");
  options
      ->add_option("--align", values->align,
                   "How the volumes are aligned without --poses: rig finds the balls of the rig in each, contents aligns "
                   "whatever they show")
      ->check(CLI::IsMember({"rig", "contents"}))
      ->capture_default_str();
  options
      ->add_option("--rig", values->rig,
                   "The rig: the size of the standard one, or a table of its balls (label,x,y,z,radius in mm)")
      ->capture_default_str();
  options
      ->add_option(
          "--depth-scale", values->depthScale,
          "The scanner's speed of sound over the bath's, 1540 / 1482 in water at 20 degrees Celsius (default: from the rig)")
      ->check(CLI::Range(0.9, 1.1));
  const vtkNew<vtkUltrasoundAligner> defaults;
  values->start = defaults->GetStart();
  options
      ->add_option("--start", values->start,
                   "What is known about where the volumes belong, for --align contents; as for echorama align")
      ->check(CLI::IsMember(AlignStartNames()))
      ->capture_default_str();
  options
      ->add_option("--target", values->target,
                   "Where the error counts, mm, in the volume's frame (default: the middle of the volumes)")
      ->expected(3);
  for (const char* name : {"--align", "--rig", "--depth-scale", "--start"})
    options->get_option(name)->excludes("--poses");
  const auto noise = [values](PoseNoise& side) {
    return [values, &side](const std::vector<double>& given) {
      side = {given[0], given[1]};
      values->noiseGiven = true;
    };
  };
  options
      ->add_option_function<std::vector<double>>("--sensor-noise", noise(values->parameters.sensorNoise),
                                                 "Noise of the tracker: degrees and mm per axis (default: from the residuals, "
                                                 "with five scans or more)")
      ->expected(2);
  options
      ->add_option_function<std::vector<double>>("--volume-noise", noise(values->parameters.volumeNoise),
                                                 "Noise of the alignment, likewise")
      ->expected(2);
  options->add_flag_callback(
      "--keep-all", [values] { values->parameters.rejectOutliers = false; }, "Use every aligned scan, however badly it fits");
  return {options, [values, options](Session& session) {
            const bool byRig = values->align == "rig";
            for (const char* name : {"--rig", "--depth-scale", "--start"})
              if (options->get_option(name)->count() > 0 && byRig == (std::string_view(name) == "--start"))
                Misused(std::string(name) + ": it says nothing with --align " + values->align);
            CalibrateHandEyeFromVolumes(session, *values);
          }};
}

} // namespace echorama
