// SPDX-License-Identifier: BSD-3-Clause
// echorama info: what a file holds.
#include "Commands.h"
#include "Core/Geometry/PoseFile.h"
#include "Volumes.h"
#include <filesystem>
#include <limits>
#include <memory>
#include <vtkDataArray.h>
#include <vtkPointData.h>
#include <vtkUltrasoundAcquisition.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {
namespace {

using Json = nlohmann::ordered_json;

struct Statistics {
  std::ptrdiff_t real = 0, notFinite = 0;
  double smallest = std::numeric_limits<double>::infinity(), largest = -smallest, sum = 0.0;
};

template <class T>
Statistics StatisticsOf(VolumeView<const T> intensity, VolumeView<const unsigned char> valid)
{
  Statistics s;
  for (std::ptrdiff_t i = 0; i < intensity.Size(); ++i) {
    const double value = static_cast<double>(intensity[i]);
    if (!std::isfinite(value))
      ++s.notFinite;
    else if (valid.Empty() || valid[i]) {
      ++s.real;
      s.smallest = std::min(s.smallest, value);
      s.largest = std::max(s.largest, value);
      s.sum += value;
    }
  }
  return s;
}

void DescribeAcquisition(Session& session, vtkImageData* image, Json& json)
{
  Json known = Json::object();
  constexpr double degrees = 57.29577951308232;
  if (const auto g = vtkUltrasoundAcquisition::ProbeGeometryOf(image)) {
    known[vtkUltrasoundAcquisition::ProbeGeometryName()] = {{"fan_degrees", g->fanAngle * degrees},
                                                            {"fan_mm", g->fanWidth},
                                                            {"sweep_degrees", g->sweepAngle * degrees},
                                                            {"sweep_mm", g->sweepWidth},
                                                            {"depth_mm", {g->depthMin, g->depthMax}}};
    session.Say("  probe       fan " + Fixed(g->fanAngle * degrees, 1) + " degrees, " + Fixed(g->fanWidth, 1) + " mm; sweep " +
                Fixed(g->sweepAngle * degrees, 1) + " degrees, " + Fixed(g->sweepWidth, 1) + " mm; depth " +
                Fixed(g->depthMin, 1) + " to " + Fixed(g->depthMax, 1) + " mm");
  }
  if (const auto pose = vtkUltrasoundAcquisition::ProbeToWorldOf(image)) {
    known[vtkUltrasoundAcquisition::ProbeToWorldName()] = JsonOf(*pose);
    session.Say("  probe at    " + Triple(pose->translation(), ", ", 2) + " mm, looking along " +
                Triple(pose->linear().col(2), ", ", 3));
  }
  if (const auto seconds = vtkUltrasoundAcquisition::TimeStampOf(image)) {
    known[vtkUltrasoundAcquisition::TimeStampName()] = *seconds;
    session.Say("  time stamp  " + Fixed(*seconds, 3) + " s");
  }
  if (const auto seed = vtkUltrasoundAcquisition::SeedOf(image)) {
    known[vtkUltrasoundAcquisition::SeedName()] = *seed;
    session.Say("  seed        " + std::to_string(*seed));
  }
  if (const auto scene = vtkUltrasoundAcquisition::SceneOf(image)) {
    known[vtkUltrasoundAcquisition::SceneName()] = *scene;
    session.Say("  scene       " + scene->substr(0, 60) + (scene->size() > 60 ? " ... (all of it with --json)" : ""));
  }
  json["acquisition"] = known;
}

Json DescribeVolume(Session& session, const std::string& file)
{
  const LoadedVolume volume = LoadVolume(session, file);
  const ImageGeometry& g = volume.geometry;
  vtkDataArray* intensity = vtkUltrasoundVolume::GetIntensity(volume.image);
  vtkDataArray* valid = vtkUltrasoundVolume::GetValidRegion(volume.image);
  Statistics s;
  session.Time("measure", [&] {
    const auto validView = vtkUltrasoundVolume::ViewOf<const unsigned char>(valid, volume.image);
    switch (intensity->GetDataType()) { // every type that a file can hold, not only those that filters work on
      vtkTemplateMacro(s = StatisticsOf<VTK_TT>(vtkUltrasoundVolume::ViewOf<const VTK_TT>(intensity, volume.image), validView));
    }
  });
  const double voxels = static_cast<double>(g.VoxelCount());
  const Eigen::Vector3d size(g.dimensions[0] * g.spacing[0], g.dimensions[1] * g.spacing[1], g.dimensions[2] * g.spacing[2]);

  Json json{{"file", file}, {"dimensions", g.dimensions}, {"spacing", JsonOf(g.spacing)}, {"origin", JsonOf(g.origin)}};
  json["direction"] = {JsonOf(g.direction.row(0).transpose()), JsonOf(g.direction.row(1).transpose()),
                       JsonOf(g.direction.row(2).transpose())};
  json["size_mm"] = JsonOf(size);
  json["centre"] = JsonOf(g.Centre());
  json["type"] = intensity->GetDataTypeAsString();
  json["has_valid_region"] = valid != nullptr;
  json["valid_fraction"] = static_cast<double>(s.real) / voxels;
  json["not_finite"] = s.notFinite;
  json["range"] = s.real ? Json{s.smallest, s.largest} : Json();
  json["mean"] = s.real ? Json(s.sum / static_cast<double>(s.real)) : Json();
  json["arrays"] = Json::array();
  for (int i = 0; i < volume.image->GetPointData()->GetNumberOfArrays(); ++i)
    json["arrays"].push_back(volume.image->GetPointData()->GetArrayName(i) ? volume.image->GetPointData()->GetArrayName(i) : "");

  session.Say(file);
  session.Say("  voxels      " + std::to_string(g.dimensions[0]) + " x " + std::to_string(g.dimensions[1]) + " x " +
              std::to_string(g.dimensions[2]) + ", " + intensity->GetDataTypeAsString());
  session.Say("  spacing     " + Triple(g.spacing, " x ", 4) + " mm");
  session.Say("  size        " + Triple(size, " x ", 1) + " mm");
  session.Say("  origin      " + Triple(g.origin, ", ", 3) + " mm");
  for (int axis = 0; axis < 3; ++axis)
    session.Say((axis == 0 ? "  direction   " : "              ") + std::string(1, "ijk"[axis]) + " = " +
                Triple(g.direction.col(axis), ", ", 4));
  session.Say("  intensity   " + (s.real
                                      ? Fixed(s.smallest, 2) + " to " + Fixed(s.largest, 2) + ", mean " + Fixed(s.sum / s.real, 2)
                                      : std::string("no voxel is real")));
  session.Say("  valid       " + Fixed(100.0 * s.real / voxels, 1) + "% of the voxels" +
              (valid ? "" : " (the volume has no valid region)"));
  if (s.notFinite)
    session.Say("  not finite  " + std::to_string(s.notFinite) + " voxels");
  DescribeAcquisition(session, volume.image, json);
  return json;
}

Json DescribePoses(Session& session, const std::string& file)
{
  Json json{{"file", file}, {"poses", Json::array()}};
  session.Say(file);
  for (const VolumePose& pose : ReadPoses(file)) {
    const double degrees = RotationAngle(pose.volumeToWorld) * 57.29577951308232;
    json["poses"].push_back({{"file", pose.file}, {"rotation_degrees", degrees}, {"VolumeToWorld", JsonOf(pose.volumeToWorld)}});
    session.Say("  " + pose.file + ": turned by " + Fixed(degrees, 3) + " degrees, translation " +
                Triple(pose.volumeToWorld.translation(), ", ", 3) + " mm");
  }
  return json;
}

void Info(Session& session, const std::vector<std::string>& files)
{
  session.result["files"] = Json::array();
  for (const std::string& file : files)
    session.result["files"].push_back(std::filesystem::path(file).extension() == ".json" ? DescribePoses(session, file)
                                                                                         : DescribeVolume(session, file));
}

} // namespace

Command InfoCommand(CLI::App& program)
{
  auto files = std::make_shared<std::vector<std::string>>();
  CLI::App* options = program.add_subcommand("info", "Tell what volumes and pose files hold");
  options->add_option("file", *files, "Volumes (.mha .mhd .nrrd .nhdr .vti) and pose files (.json)")->required();
  return {options, [files](Session& session) { Info(session, *files); }};
}

} // namespace echorama
