// SPDX-License-Identifier: BSD-3-Clause
// echorama synthesize: overlapping volumes of a scene, from several poses of a probe, with everything that is known of them.
#include "Commands.h"
#include "Core/Base/TextFile.h"
#include "Filters/Acoustics/SceneTissue.h"
#include "Filters/Phantoms/PhantomViews.h"
#include "Meshes.h"
#include "ParameterOptions.h"
#include "RecordedMotion.h"
#include "SyntheticSet.h"
#include "Volumes.h"
#include <algorithm>
#include <CLI/Validators.hpp>
#include <filesystem>
#include <memory>
#include <vtkFieldData.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkUltrasoundAcquisition.h>
#include <vtkUltrasoundDeformGeometry.h>
#include <vtkUltrasoundDisplacement.h>
#include <vtkUltrasoundGel.h>
#include <vtkUltrasoundSynthesizer.h>
#include <vtkUltrasoundTissue.h>
#include <vtkUltrasoundTissuePress.h>
#include <vtkUltrasoundVolume.h>
#include <vtkXMLPolyDataWriter.h>

namespace echorama {
namespace {

struct SynthesizeOptions {
  std::string scene, folder, data, format = "mha";
  std::optional<std::uint64_t> seed;
  SceneVolume volume;
  CLI::Option* spacing = nullptr;
  int landmarks = 0;
};

// A view: where the probe is, and at each step of its sweep if it moves meanwhile.
struct SceneView {
  Pose probeToWorld;
  std::vector<Pose> steps;
};

std::vector<SceneView> ViewsOf(const SynthesisScene& scene, const SynthesisParameters& parameters)
{
  std::vector<SceneView> views;
  if (const auto* row = std::get_if<SceneRow>(&scene.views)) {
    for (const PhantomView& view : PhantomViews(parameters.probe, row->count, row->overlap)) {
      const Pose pose = row->middle.ProbeToWorld() * view.probeToWorld;
      views.push_back({pose, StepPoses(scene, pose)});
    }
  } else if (const auto* listed = std::get_if<SceneViews>(&scene.views)) {
    for (const ScenePose& pose : listed->poses)
      views.push_back({pose.ProbeToWorld(), StepPoses(scene, pose.ProbeToWorld())});
  } else {
    const auto& recording = std::get<SceneRecording>(scene.views);
    const RecordedMotion motion(scene.PathOf(recording.file), recording);
    const int steps = parameters.BeamDimensions()[2];
    const double seconds = scene.sweep.alongRecording && steps > 1 ? scene.sweep.seconds : 0.0;
    for (const double time : motion.Times(recording.count, seconds)) {
      const Pose pose = motion.At(time);
      views.push_back({pose, seconds > 0.0 ? motion.Around(time, seconds, steps) : StepPoses(scene, pose)});
    }
  }
  return views;
}

void WriteTissue(Session& session, vtkPolyData* tissue, const std::string& path)
{
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetInputData(tissue);
  writer->SetFileName(path.c_str());
  writer->SetDataModeToAppended();
  writer->EncodeAppendedDataOff();
  session.Watch(writer, "write", path, [&] {
    if (!writer->Write())
      throw Error(Error::Kind::FileSystem, path + ": it cannot be written (is the disk full?)");
  });
}

nlohmann::ordered_json JsonOf(const SynthesisCost& cost)
{
  return {{"rays_seconds", cost.raysSeconds},
          {"scatterers_seconds", cost.scatterersSeconds},
          {"echoes_seconds", cost.echoesSeconds},
          {"detection_seconds", cost.detectionSeconds},
          {"rays", cost.rays},
          {"segments", cost.segments},
          {"surface_echoes", cost.surfaceEchoes},
          {"scatterers", cost.scatterers},
          {"held_mb", 1e-6 * static_cast<double>(cost.bytes)}};
}

// Where the balls of rigs are, or places at random.
std::vector<Landmark> PlacesOf(const SynthesisScene& scene, int count, const ProbeGeometry& probe,
                               const std::vector<SceneView>& views)
{
  std::vector<Landmark> places;
  for (const SceneItem& item : scene.tissue)
    if (const auto* rig = std::get_if<CalibrationRigParameters>(&item.what))
      for (const Landmark& ball : CalibrationLandmarks(*rig))
        places.push_back(ball);
  std::vector<Pose> poses;
  for (const SceneView& view : views)
    poses.push_back(view.probeToWorld);
  const auto more = SharedPlaces(scene.seed, count, probe, poses);
  places.insert(places.end(), more.begin(), more.end());
  return places;
}

// Tissue under the probe of a view: where it went, and its surfaces there.
struct PressedTissue {
  vtkNew<vtkImageData> displacement;
  vtkNew<vtkPolyData> tissue;
  nlohmann::ordered_json told;
};

void Press(Session& session, ScenePress press, vtkPolyData* tissue, vtkPolyData* probe, const std::string& name,
           PressedTissue& pressed)
{
  vtkNew<vtkUltrasoundTissuePress> filter;
  for (const Parameter& parameter : Describe(press))
    filter->SetParameterAsText(parameter.name.c_str(), parameter.Text().c_str());
  filter->SetInputData(tissue);
  filter->AddProbeData(probe);
  session.Update(filter, "press", name);
  pressed.displacement->ShallowCopy(filter->GetOutput());
  vtkNew<vtkUltrasoundDeformGeometry> surfaces;
  surfaces->SetInputData(tissue);
  surfaces->SetDisplacementData(pressed.displacement);
  surfaces->SetOutsideToNearest(); // a surface ends beside its cells
  surfaces->SetMaskFolds(true);    // where there is no tissue
  session.Update(surfaces, "deform", name);
  pressed.tissue->ShallowCopy(surfaces->GetOutput());
  pressed.tissue->GetPointData()->RemoveArray(vtkUltrasoundVolume::ValidRegionName());
  const auto numbers = [&pressed](const char* field) {
    vtkDataArray* array = pressed.displacement->GetFieldData()->GetArray(field);
    nlohmann::ordered_json list;
    for (int i = 0; i < array->GetNumberOfComponents(); ++i)
      list.push_back(array->GetComponent(0, i));
    return list;
  };
  pressed.told = {{"force_n", numbers(vtkUltrasoundTissuePress::ProbeForceName())},
                  {"relative_volume", numbers(vtkUltrasoundTissuePress::RelativeVolumeName())}};
}

// Gel between the probe and tissue, which is pressed or not: what sound meets, gel alone, and the face.
struct SpreadGelOn {
  vtkNew<vtkPolyData> tissue, gel, face;
  nlohmann::ordered_json told;
};

void Spread(Session& session, const SynthesisScene& scene, vtkPolyData* rest, vtkPolyData* pressed, vtkPolyData* probe,
            const std::string& name, SpreadGelOn& spread)
{
  vtkNew<vtkUltrasoundGel> filter;
  SceneGel gel = *scene.gel;
  ProbeHead head = scene.press ? scene.press->head : ProbeHead();
  for (const Parameter& parameter : Join({Describe(gel), Describe(head)}))
    filter->SetParameterAsText(parameter.name.c_str(), parameter.Text().c_str());
  filter->SetInputData(rest);
  filter->AddProbeData(probe);
  filter->SetPressedData(pressed);
  session.Update(filter, "gel", name);
  spread.tissue->ShallowCopy(filter->GetOutput(0));
  spread.face->ShallowCopy(filter->GetOutput(1));
  // Gel is one body more, the first.
  const TissueSurface all = vtkUltrasoundTissue::Of(spread.tissue);
  const auto bodies = static_cast<std::size_t>(
      rest->GetFieldData()->GetAbstractArray(vtkUltrasoundTissue::BodyMaterialName())->GetNumberOfTuples());
  vtkUltrasoundTissue::Set(spread.gel, all.Only(all.bodies.size() > bodies ? 0 : -1));
  const auto number = [&spread](const char* field) { return spread.face->GetFieldData()->GetArray(field)->GetComponent(0, 0); };
  spread.told = {{"coupled", number(vtkUltrasoundGel::CoupledName())}, {"volume_mm3", number(vtkUltrasoundGel::GelVolumeName())}};
}

void Synthesize(Session& session, const SynthesizeOptions& options)
{
  SynthesisScene scene = ReadScene(options.scene, options.seed);
  scene.dataFolder = options.data;
  if (options.spacing->count() > 0)
    scene.volume.spacingMm = options.volume.spacingMm;
  SynthesisParameters parameters = scene.Parameters();
  const std::vector<SceneView> views = ViewsOf(scene, parameters);
  std::vector<Landmark> places = PlacesOf(scene, options.landmarks, parameters.probe, views);
  if (!places.empty() && std::any_of(views.begin(), views.end(), [](const SceneView& view) { return !view.steps.empty(); })) {
    session.Note("no landmarks are listed: the probe moves while it sweeps, so that a place is not seen where it lies");
    places.clear();
  }

  // Files by their full names from here on: so they stay what they are in the scene that is written.
  std::vector<std::string> inputs{options.scene};
  const auto resolve = [&](std::string& file) {
    file = std::filesystem::absolute(scene.PathOf(file)).lexically_normal().string();
    inputs.push_back(file);
  };
  for (SceneItem& item : scene.tissue)
    if (auto* mesh = std::get_if<SceneMesh>(&item.what))
      resolve(mesh->file);
  if (auto* recording = std::get_if<SceneRecording>(&scene.views))
    resolve(recording->file);
  scene.dataFolder.clear();
  OutputFolder folder(options.folder, inputs);
  session.ShowAs(folder.StageFolder(), options.folder);
  session.result["folder"] = options.folder;
  vtkNew<vtkPolyData> tissue;
  std::vector<std::string> notes;
  session.Work("tissue", options.scene,
               [&](const Progress& progress) { vtkUltrasoundTissue::Set(tissue, TissueOf(scene, LoadMesh, notes, progress)); });
  for (const std::string& note : notes)
    session.Note(note);
  session.result["triangles"] = tissue->GetNumberOfPolys();
  session.result["seed"] = scene.seed;
  WriteTextFile(folder.Stage("scene.json"), SceneToJson(scene) + "\n");
  WriteTissue(session, tissue, folder.Stage("geometry.vtp"));

  vtkNew<vtkUltrasoundSynthesizer> synthesizer;
  synthesizer->SetInputData(tissue);
  synthesizer->SetSpacingMm(scene.volume.spacingMm);
  SyntheticSet set(session, folder, options.format, {scene.volume.knockMm, scene.volume.knockDegrees, scene.seed});
  for (std::size_t i = 0; i < views.size(); ++i) {
    // The probe comes by its input, since the filter's own parameters are those of a curved one.
    vtkNew<vtkPolyData> probe;
    vtkUltrasoundAcquisition::SetProbeGeometry(probe, parameters.probe);
    vtkUltrasoundAcquisition::SetProbeToWorld(probe, views[i].probeToWorld);
    synthesizer->SetInputData(1, probe);
    const std::string number = std::to_string(i + 1);
    nlohmann::ordered_json told;
    DisplacementField moved;
    PressedTissue pressed;
    if (scene.press) {
      Press(session, *scene.press, tissue, probe, "volume_" + number, pressed);
      synthesizer->SetInputData(pressed.tissue);
      synthesizer->SetInputData(2, pressed.displacement);
      moved = vtkUltrasoundDisplacement::FieldOf(pressed.displacement, "the displacement of the tissue");
      told["press"] = pressed.told;
    }
    if (scene.gel) {
      SpreadGelOn spread;
      Spread(session, scene, tissue, scene.press ? pressed.tissue.Get() : nullptr, probe, "volume_" + number, spread);
      synthesizer->SetInputData(spread.tissue);
      told["gel"] = spread.told;
      for (const auto& [key, data] : {std::pair<std::string, vtkPolyData*>{"surface", spread.gel}, {"face", spread.face}}) {
        const std::string file = (key == "face" ? "face_" : "gel_") + number + ".vtp";
        WriteTissue(session, data, folder.Stage(file));
        told["gel"][key] = folder.Final(file);
      }
    }
    parameters.stepPoses = views[i].steps;
    parameters.receiver.noiseSeed = scene.receiver.noiseSeed + i;
    synthesizer->SetParameters(parameters);
    session.Update(synthesizer, "synthesize", "volume_" + number);
    vtkNew<vtkImageData> image, beams;
    image->ShallowCopy(synthesizer->GetOutput(0));
    beams->ShallowCopy(synthesizer->GetOutput(1));
    const std::string name = "beams_" + number + "." + options.format;
    told["beams"] = folder.Final(name);
    told["cost"] = JsonOf(synthesizer->Cost());
    const auto seenAt = [&](const Eigen::Vector3d& place) -> std::optional<Eigen::Vector3d> {
      const Eigen::Vector3d now = place + moved.At(place);
      if (!BeamPointAt(parameters.probe, views[i].probeToWorld.inverse() * now))
        return {};
      return now;
    };
    const Pose knock = set.Add(image, told, places, seenAt, scene.press ? pressed.displacement.Get() : nullptr);
    // The beams say where the probe was as the volume does.
    vtkUltrasoundAcquisition::SetProbeToWorld(beams, knock * views[i].probeToWorld);
    SaveVolume(session, beams, folder.Stage(name));
  }
  set.Finish();
}

} // namespace

Command SynthesizeCommand(CLI::App& program)
{
  auto values = std::make_shared<SynthesizeOptions>();
  CLI::App* options = program.add_subcommand(
      "synthesize", "Make overlapping volumes of a scene by simulating ultrasound, out of place by a known amount");
  options->add_option("scene", values->scene, "The scene, JSON (see Documentation/scenes.md)")->required();
  options
      ->add_option("-o,--output", values->folder,
                   "Folder for the volumes, their beams, the geometry, the scene, and truth.json, the poses that put them back")
      ->required();
  options->add_option("--seed", values->seed, "Seed instead of the scene's")
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 62));
  values->spacing = AddParameter(options, Describe(values->volume), "SpacingMm", "--spacing")->default_str("the scene's");
  options->add_option("--data", values->data,
                      "Folder of the meshes and recordings that the scene names, whatever folder it says");
  AddSetOptions(*options, values->landmarks, values->format);
  return {options, [values](Session& session) { Synthesize(session, *values); }};
}

} // namespace echorama
