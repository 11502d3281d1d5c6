// SPDX-License-Identifier: BSD-3-Clause
// echorama align: where do overlapping volumes belong?
#include "Commands.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Memory.h"
#include "Displacements.h"
#include "Filters/Calibration/ItkTransform.h"
#include "Filters/Registration/AlignmentJson.h"
#include "Landmarks.h"
#include "ParameterOptions.h"
#include "Readers/OutputFiles.h"
#include "TrackedVolumes.h"
#include "Volumes.h"
#include <CLI/Validators.hpp>
#include <filesystem>
#include <memory>
#include <vtkSmartPointer.h>
#include <vtkUltrasoundAligner.h>
#include <vtkUltrasoundDeformableAligner.h>

namespace echorama {
namespace {

constexpr const char* DefaultOutput = "poses.json";

struct AlignOptions {
  std::vector<std::string> files;
  VolumeReading reading;
  std::string output, poses, apply;
  int fixed = 1;
  std::vector<int> held; // from 1
  std::vector<std::string> landmarks, transforms;
  TrackerOptions tracker;
  std::string calibration;
  bool trackerOnly = false, transformsOnly = false, deformable = false;
};

// Puts each volume where the tracker says, as seen from the fixed one.
void PlaceVolumes(Session& session, AlignOptions& options, std::vector<LoadedVolume>& volumes)
{
  const ToolTrack tool = ReadTool(session, options.tracker.log, options.tracker.tool, options.tracker.reading);
  const VolumeCalibration calibration = ReadVolumeCalibration(options.calibration, tool.from);
  options.tracker.matching.fixed = options.fixed - 1;
  const TrackerPlacement placement =
      PlaceByTracker(tool, TrackedVolumesOf(options.tracker, volumes), calibration, options.tracker.matching);
  for (const std::string& note : placement.notes)
    session.Note(note);
  session.Say("tracker: " + placement.how);
  for (std::size_t i = 0; i < volumes.size(); ++i)
    if (i != static_cast<std::size_t>(options.tracker.matching.fixed))
      MoveVolume(volumes[i], placement.volumeToWorld[i]);
  session.result["tracker"] = {{"recording", options.tracker.log}, {"tool", tool.name}, {"calibration", options.calibration}};
  if (calibration.errorMm)
    session.Say("tracker: the calibration states an error of " + Fixed(*calibration.errorMm, 2) + " mm");
}

// What each transform says of its volume; "-" says nothing.
std::vector<Pose> ReadTransformsOf(const AlignOptions& options)
{
  if (!options.transforms.empty() && options.transforms.size() != options.files.size())
    throw Error(Error::Kind::InvalidParameter,
                "--transforms: there are " + std::to_string(options.files.size()) +
                    " volumes, so that as many transforms are needed, in their order (-: the volume stays); there are " +
                    std::to_string(options.transforms.size()));
  std::vector<Pose> poses;
  for (const std::string& file : options.transforms)
    poses.push_back(file == "-" ? Pose::Identity() : ReadItkTransform(file));
  return poses;
}

// Each list goes where its volume is, which may have left the place that its file says.
void GiveLandmarks(const std::vector<LandmarkList>& lists, const std::vector<LoadedVolume>& volumes,
                   vtkUltrasoundAligner* aligner)
{
  for (std::size_t i = 0; i < lists.size(); ++i)
    for (const Landmark& landmark : lists[i].landmarks) {
      const Eigen::Vector3d place = volumes[i].volumeToWorld * landmark.position;
      aligner->AddLandmark(static_cast<int>(i), landmark.label.c_str(), place.x(), place.y(), place.z());
    }
}

void TellPlan(Session& session, std::size_t volumes, const AlignVolumesPlan& plan)
{
  session.result["plan"] = ToJson(plan, 1);
  session.Say(std::to_string(volumes) + " volumes, " + std::to_string(plan.pairs.size()) + " pairs, " +
              std::to_string(plan.pairsFinishedBefore) + " of them finished before");
  session.Say("memory beside the volumes themselves: " + GigabytesText(plan.bytesOfAll) + " for all, " +
              GigabytesText(plan.bytesPerVolume) + " for one; " + GigabytesText(plan.budgetBytes) +
              " may be used, so volumes are prepared " + std::to_string(plan.timesPrepared) + " times");
  session.Say("time: some " + Fixed(plan.seconds, 0) + " s (" + Fixed(plan.secondsPerPair, 2) + " s for a pair, " +
              Fixed(plan.secondsPerVolume, 2) + " s to prepare a volume), and more for pairs that are tried again");
}

// Nobody asked for what another run has written meanwhile to be replaced.
void KeepWhatCameMeanwhile(Session& session, std::string& output)
{
  const std::string wanted = output;
  const std::filesystem::path name(wanted);
  for (int number = 2; std::filesystem::exists(output); ++number)
    output = name.stem().string() + "-" + std::to_string(number) + name.extension().string();
  if (output != wanted)
    session.Note(wanted + ": it has appeared while the volumes were aligned; their poses go to " + output);
}

// Poses, what they name and the moved volumes: all take their places, or none does.
void Write(Session& session, const AlignOptions& options, const std::vector<LoadedVolume>& volumes,
           const std::vector<std::string>& places, std::vector<VolumePose> poses, FileReplacement& files, OutputFolder* folder)
{
  for (std::size_t i = 0; i < places.size(); ++i)
    SaveVolume(session, volumes[i].image, places[i]);
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (!poses[i].displacement.empty()) // as it will be named
      poses[i].displacement = DisplacementPath(options.output, i);
  WritePoses(session.Stage(files, options.output), poses);
  if (folder)
    folder->Commit(files);
  else
    files.Commit();
}

void Align(Session& session, AlignOptions options, vtkUltrasoundAligner* aligner, vtkUltrasoundDeformableAligner* deformer)
{
  options.files = WithoutCompanions(session, options.files);
  std::vector<std::string> inputs = options.files;
  for (const std::string& input : {options.tracker.log, options.calibration})
    if (!input.empty())
      inputs.push_back(input);
  for (const auto& files : {options.landmarks, options.transforms})
    inputs.insert(inputs.end(), files.begin(), files.end());
  if (!options.poses.empty())
    inputs.push_back(options.poses);
  bool isDefault = options.output.empty();
  if (isDefault) {
    options.output = DefaultOutput;
    if (!aligner->GetDryRun() && std::filesystem::exists(options.output))
      throw Error(Error::Kind::FileSystem, options.output + ": it is there already; name it with -o to replace it");
  }
  CheckOutput(options.output, inputs);
  if (const std::string finished = aligner->GetFinishedPairs(); !finished.empty()) {
    CheckOutput(finished, inputs);
    if (std::filesystem::weakly_canonical(finished) == std::filesystem::weakly_canonical(options.output))
      throw Error(Error::Kind::InvalidParameter,
                  "--finished-pairs: " + finished + " is the file of poses, too; each needs its own");
  }
  for (std::size_t i = 0; options.deformable && i < options.files.size(); ++i)
    CheckOutput(DisplacementPath(options.output, i), inputs);
  if (options.fixed > static_cast<int>(options.files.size()))
    throw Error(Error::Kind::InvalidParameter, "--fixed: there are only " + std::to_string(options.files.size()) + " volumes");
  aligner->SetFixedVolume(options.fixed - 1);
  for (const int number : options.held) {
    if (number > static_cast<int>(options.files.size()))
      throw Error(Error::Kind::InvalidParameter, "--hold: there are only " + std::to_string(options.files.size()) + " volumes");
    aligner->AddHeldVolume(number - 1);
  }
  std::vector<LandmarkList> landmarks;
  if (!options.landmarks.empty()) {
    landmarks = ReadLandmarkLists(options.landmarks, options.files.size(), "there are ");
    MeasureLandmarkError(landmarks); // whether they can be compared at all
  }
  const std::vector<Pose> transforms = ReadTransformsOf(options);
  // Places for the moved volumes are looked for first, so that nothing is refused after all the work.
  std::unique_ptr<OutputFolder> folder;
  std::vector<std::string> places;
  if (!options.apply.empty()) {
    folder = std::make_unique<OutputFolder>(options.apply, inputs);
    session.ShowAs(folder->StageFolder(), options.apply);
    for (const std::string& file : options.files) {
      const std::string name = std::filesystem::path(file).filename().string();
      CheckVolumeOutput(folder->Final(name), inputs);
      places.push_back(folder->Stage(name));
    }
  }
  FileReplacement files; // all that is written takes its place together

  std::vector<LoadedVolume> volumes = LoadVolumes(session, options.files, options.reading);
  ApplyPoses(session, volumes, options.poses);
  if (!options.tracker.log.empty())
    PlaceVolumes(session, options, volumes);
  for (std::size_t i = 0; i < transforms.size(); ++i)
    MoveVolume(volumes[i], transforms[i]);
  if (options.trackerOnly || options.transformsOnly) {
    std::vector<VolumePose> poses;
    session.result["output"] = options.output;
    session.result["fixed"] = options.fixed;
    session.result["volumes"] = nlohmann::ordered_json::array();
    for (const LoadedVolume& volume : volumes) {
      poses.push_back({volume.file, volume.geometry, volume.volumeToWorld});
      session.result["volumes"].push_back({{"file", volume.file}, {"VolumeToWorld", JsonOf(volume.volumeToWorld)}});
    }
    Write(session, options, volumes, places, poses, files, folder.get());
    session.Say("wrote " + options.output + (options.trackerOnly ? ", as the tracker says" : ", as the transforms say"));
    return;
  }
  GiveLandmarks(landmarks, volumes, aligner);
  if (!aligner->GetDryRun())
    RehearsePoses(session, volumes, options.output);
  aligner->SetInputDataObject(BlocksOf(volumes));
  session.Update(aligner, "align");
  if (aligner->GetDryRun()) {
    TellPlan(session, volumes.size(), aligner->Plan());
    return;
  }

  nlohmann::ordered_json report = ToJson(aligner->Result(), 1); // from 1, as --fixed counts
  session.result["fixed"] = options.fixed;
  session.result["volumes"] = nlohmann::ordered_json::array();
  std::vector<VolumePose> poses;
  std::vector<bool> isPlaced;
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    LoadedVolume& volume = volumes[i];
    const VolumeAlignment& found = aligner->Result().volumes[i];
    const Pose& pose = found.volumeToWorld;
    const ImageGeometry start = volume.geometry.Moved(volume.volumeToWorld);
    const double degrees = RotationAngle(pose) * DegreesPerRadian, mm = (pose * start.Centre() - start.Centre()).norm();
    MoveVolume(volume, pose);
    poses.push_back({volume.file, volume.geometry, volume.volumeToWorld});
    isPlaced.push_back(found.verdict != Verdict::Failed);
    nlohmann::ordered_json entry{{"file", volume.file}, {"turned_degrees", degrees}, {"moved_mm", mm}};
    report["volumes"][i].erase("name");
    entry.update(report["volumes"][i]);
    entry["VolumeToWorld"] = JsonOf(volume.volumeToWorld);
    session.result["volumes"].push_back(entry);
    session.Say(volume.file + ": " +
                (static_cast<int>(i) + 1 == options.fixed
                     ? "fixed"
                     : std::string(NameOf(found.verdict)) + (found.reason.empty() ? "" : " (" + found.reason + ")") +
                           "; turned by " + Fixed(degrees, 2) + " degrees, its middle moved by " + Fixed(mm, 2) +
                           " mm, overlap " + Fixed(100.0 * found.overlap, 0) + "%"));
  }
  session.result["pairs"] = report["pairs"];
  session.result["align_seconds"] = report["seconds"];
  for (const char* key : {"pairs_finished_before", "times_prepared", "prepared_bytes"})
    session.result[key] = report[key];
  session.result["verdict"] = aligner->GetAllAligned() ? "aligned" : "doubtful";
  if (!aligner->GetAllAligned()) {
    session.status = Session::Doubtful;
    session.Note("not every volume is aligned: check the poses before using them");
  }

  const auto output = [&] {
    if (isDefault)
      KeepWhatCameMeanwhile(session, options.output);
    isDefault = false; // once: displacements are named after it
    return options.output;
  };
  if (options.deformable)
    DeformVolumes(session, deformer, volumes, isPlaced, options.fixed - 1, output, files, poses);
  session.result["output"] = output();
  if (!landmarks.empty()) {
    for (std::size_t i = 0; i < volumes.size(); ++i) {
      landmarks[i].volumeToWorld = volumes[i].volumeToWorld;
      landmarks[i].displacement = DisplacementOf(session, poses[i]);
    }
    TellLandmarkError(session, landmarks, options.files);
  }
  Write(session, options, volumes, places, poses, files, folder.get());
  session.Say("wrote " + options.output);
  if (folder) {
    session.result["applied"] = options.apply;
    session.Say("wrote " + std::to_string(volumes.size()) + " volumes with their new geometry to " + options.apply);
  }
}

} // namespace

void EchoramaCommand(CLI::App* options, Action& action)
{
  auto values = std::make_shared<AlignOptions>();
  const auto aligner = vtkSmartPointer<vtkUltrasoundAligner>::New();
  const auto deformer = vtkSmartPointer<vtkUltrasoundDeformableAligner>::New();
  options->add_option("volume", values->files, "Two or more volumes")->type_name("VOLUME")->required();
  options
      ->add_option("-o,--output", values->output,
                   std::string("Pose file to write (default: ") + DefaultOutput + ", unless it is there)")
      ->type_name("FILE");
  options->add_option("--hold", values->held,
                      "A volume (from 1) that stays where it is beside the fixed one; again for each")
      ->allow_extra_args(false) // volumes may follow
      ->check(CLI::Range(1, 1000000));
  options->add_option("--poses", values->poses, "Pose file to start from (default: where the volumes say)")->type_name("FILE");
  options
      ->add_option("--transforms", values->transforms,
                   "Rigid transforms of ITK, 3D Slicer (.tfm) or elastix (TransformParameters.0.txt) to start from, one for each "
                   "volume as the moving one, in their order (-: it stays)")
      ->type_name("FILE")
      ->excludes("--poses");
  options->add_flag("--transforms-only", values->transformsOnly, "Leave the volumes where the transforms put them")
      ->needs("--transforms");
  options->add_option("--fixed", values->fixed, "The volume (from 1) that stays where it is")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  AddParametersBut(options, aligner, {"FixedVolume"}); // --fixed counts from 1
  CLI::Option* landmarks = AddLandmarksOption(
      options, values->landmarks, "Places that were found in the volumes; those with one label in two volumes belong together");
  values->tracker.AddTo(*options, false);
  options
      ->add_option("--calibration", values->calibration,
                   "Calibration of the tracked probe, as echorama calibrate hand-eye writes it")
      ->type_name("FILE");
  options->add_flag("--tracker-only", values->trackerOnly, "Leave the volumes where the tracker says");
  options->get_option("--tracker")->needs("--calibration")->excludes("--poses")->excludes("--transforms");
  options->get_option("--calibration")->needs("--tracker");
  options->get_option("--tracker-only")->needs("--tracker")->excludes(landmarks);
  options->get_option("--transforms-only")->excludes(landmarks);
  for (const char* only : {"--tracker-only", "--transforms-only"}) // they do next to nothing, and write it
    options->get_option("--dry-run")->excludes(only);
  options->add_option("--apply", values->apply, "Folder for the volumes with their new geometry")->type_name("FOLDER");
  AddParameter(options, Describe(values->reading.parameters), "Stride", "--stride")->excludes("--apply"); // of all voxels
  CLI::Option* deformable =
      options
          ->add_flag("--deformable", values->deformable,
                     "Also find how tissue was deformed; the displacements are written beside the pose file, which names them")
          ->excludes("--tracker-only")
          ->excludes("--transforms-only");
  for (const char* name : {"ControlSpacingMm", "BendingWeight", "MinimumGain"})
    AddParameter(options, deformer, name)->needs(deformable);
  action = [values, aligner, deformer](Session& session) { Align(session, *values, aligner, deformer); };
}

} // namespace echorama
