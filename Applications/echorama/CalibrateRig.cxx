// SPDX-License-Identifier: BSD-3-Clause
// echorama calibrate rig: the rig of balls and the clip for the sensor, for a 3D printer, and scenes of the same rigs.
#include "Calibrate.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/TextFile.h"
#include "ParameterOptions.h"
#include "Readers/OutputFiles.h"
#include "Volumes.h"
#include <CLI/Validators.hpp>
#include <memory>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkSTLWriter.h>
#include <vtkUltrasoundPrintableSource.h>

namespace echorama {
namespace {

struct RigOptions {
  std::string folder;
  std::vector<double> scales = {1.0, 0.6}, handle, sensor;
  CalibrationRigParameters rig;
};

void WriteStl(Session& session, vtkUltrasoundPrintableSource* source, const std::string& path, const std::string& name)
{
  session.Update(source, "make", name);
  vtkNew<vtkSTLWriter> writer;
  writer->SetInputData(source->GetOutput());
  writer->SetFileName(path.c_str());
  writer->SetFileTypeToBinary();
  session.Watch(writer, "write", name, [&] { writer->Write(); });
  const double* bounds = source->GetOutput()->GetBounds();
  session.Say(name + ": " + Triple({bounds[1] - bounds[0], bounds[3] - bounds[2], bounds[5] - bounds[4]}, " x ", 1) + " mm, " +
              std::to_string(source->GetOutput()->GetNumberOfCells()) + " triangles");
}

// Three views of the rig, the first from straight above.
nlohmann::ordered_json SceneOf(const CalibrationRigParameters& rig, const std::string& name)
{
  const double depth = rig.plateDepthMm;
  const auto pose = [&](Eigen::Vector3d face, Eigen::Vector3d target, double tilt) {
    return nlohmann::ordered_json{
        {"face", JsonOf(face)}, {"target", JsonOf(target)}, {"fan", JsonOf(Eigen::Vector3d(1.0, tilt, 0.0))}};
  };
  return {{"schema", "echorama-scene-1"},
          {"name", name},
          {"about", "The calibration rig at scale " + NumberText(rig.scale) + " in a bath of water."},
          {"seed", 1},
          {"probe",
           {{"preset", "mechanical-3d"}, {"depthMaxMm", depth + 10.0}, {"elements", 96}, {"sweepSteps", 64}, {"samples", 512}}},
          {"receiver", {{"tgcDbPerCm", 0}, {"noiseDb", -45}, {"dynamicRangeDb", 70}}},
          {"background", "water"},
          {"tissue", {{{"rig", {{"scale", rig.scale}, {"waterCelsius", rig.waterCelsius}, {"plateDepthMm", depth}}}}}},
          {"views",
           {{"poses",
             {pose({0, 0, 0}, {0, 0, depth}, 0.0), pose({12, 4, 2}, {-4, -2, depth - 5.0}, 0.3),
              pose({-10, -8, 1}, {5, 3, depth - 5.0}, -0.4)}}}},
          {"volume", {{"spacingMm", 0.8}, {"knockMm", 8}, {"knockDegrees", 6}}}};
}

void MakeRig(Session& session, const RigOptions& options, vtkUltrasoundPrintableSource* clip)
{
  OutputFolder folder(options.folder, {});
  session.ShowAs(folder.StageFolder(), options.folder);
  session.result["output"] = options.folder;
  session.result["rigs"] = nlohmann::ordered_json::array();
  for (const double scale : options.scales) {
    const std::string name = "rig_" + NumberText(scale);
    vtkNew<vtkUltrasoundPrintableSource> source;
    source->SetScale(scale);
    source->SetResolution(clip->GetResolution());
    WriteStl(session, source, folder.Stage(name + ".stl"), name + ".stl");
    CalibrationRigParameters rig = options.rig;
    rig.scale = scale;
    rig.plateDepthMm = std::min(rig.plateDepthMm * std::max(scale, 0.5), 490.0); // so that a small rig is near the probe
    WriteTextFile(folder.Stage(name + ".json"), SceneOf(rig, name).dump(2) + "\n");
    std::string table = "label,x,y,z,radius\n"; // in the world of the scene
    const std::vector<Landmark> centres = CalibrationLandmarks(rig);
    for (std::size_t i = 0; i < centres.size(); ++i) {
      const Eigen::Vector3d& p = centres[i].position;
      table += centres[i].label + "," + NumberText(p.x()) + "," + NumberText(p.y()) + "," + NumberText(p.z()) + "," +
               NumberText(scale * rig.balls[i].radius) + "\n";
    }
    WriteTextFile(folder.Stage(name + ".csv"), table);
    session.result["rigs"].push_back(
        {{"scale", scale}, {"stl", name + ".stl"}, {"scene", name + ".json"}, {"balls", name + ".csv"}});
  }
  clip->SetKindToClip();
  if (!options.handle.empty()) {
    clip->SetHandleWidthMm(options.handle[0]);
    clip->SetHandleThicknessMm(options.handle[1]);
    clip->SetOpeningMm(std::min(clip->GetOpeningMm(), 0.4 * options.handle[0]));
  }
  if (!options.sensor.empty())
    clip->SetSensorMm(options.sensor.data());
  WriteStl(session, clip, folder.Stage("clip.stl"), "clip.stl");
  session.result["clip"] = "clip.stl";
  folder.Commit();
  session.Say("wrote them to " + options.folder + "; each .json is a scene of its rig for echorama synthesize");
}

} // namespace

CalibrateKind CalibrateRigCommand(CLI::App& calibrate)
{
  auto values = std::make_shared<RigOptions>();
  const auto clip = vtkSmartPointer<vtkUltrasoundPrintableSource>::New();
  CLI::App* options = calibrate.add_subcommand("rig", "Make the calibration rig and the sensor's clip for a 3D printer (STL)");
  options->add_option("-o,--output", values->folder, "Folder for the files")->type_name("FOLDER")->required();
  options->add_option("--scale", values->scales, "Sizes of the rig; again for each")
      ->check(CLI::Range(0.2, 5.0))
      ->capture_default_str();
  options
      ->add_option("--handle", values->handle, "Width (along the fan) and thickness of the probe's handle, mm (default: 30 22)")
      ->expected(2);
  options->add_option("--sensor", values->sensor, "The sensor across, sideways and along the handle, mm (default: 8.2 8.2 20)")
      ->expected(3);
  AddParameter(options, clip, "ClearanceMm", "--clearance");
  AddParameter(options, clip, "ArmMm", "--arm");
  AddParameter(options, Describe(values->rig), "WaterCelsius", "--water");
  AddParameter(options, clip, "Resolution");
  return {options, [values, clip](Session& session) { MakeRig(session, *values, clip); }};
}

} // namespace echorama
