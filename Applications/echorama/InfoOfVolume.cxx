// SPDX-License-Identifier: BSD-3-Clause
// echorama info of a volume, of any format.
#include "Info.h"
#include "Readers/FileKind.h"
#include "Readers/VolumeSource.h"
#include "Volumes.h"
#include <limits>
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

// What the file is, and what it holds beside the one volume that was read.
void DescribeFormat(Session& session, const LoadedVolume& volume, Json& json)
{
  const FileFormat format = volume.content.format;
  json["format"] = FormatText(format);
  session.Say(Entry("format", FormatText(format)));
  if (!volume.content.times.empty()) {
    json["times"] = volume.content.times;
    session.Say(Entry("time steps", std::to_string(volume.content.times.size()) + ", from " +
                                        Fixed(volume.content.times.front(), 3) + " to " + Fixed(volume.content.times.back(), 3) +
                                        " s; the first is described"));
  }
  if (const auto& beams = volume.content.beams) {
    json["beams"] = {{"dimensions", beams->dimensions}, {"type", TypeText(beams->type)}, {"probe", JsonOf(beams->probe)}};
    session.Say(Entry("beams", std::to_string(beams->dimensions[0]) + " samples x " + std::to_string(beams->dimensions[1]) +
                                   " beams x " + std::to_string(beams->dimensions[2]) + " planes, " + TypeText(beams->type) +
                                   "; scan-converted here"));
  }
}

void DescribeHeader(Session& session, const LoadedVolume& volume, Json& json)
{
  std::vector<HeaderField> fields;
  for (const HeaderField& field : volume.content.fields)
    if (field.first.compare(0, 9, "Echorama_") != 0) // the acquisition, which is told already
      fields.push_back(field);
  json["fields"] = DescribeFields(session, fields);
}

void DescribeAcquisition(Session& session, vtkImageData* image, Json& json)
{
  Json known = Json::object();
  if (const auto g = vtkUltrasoundAcquisition::ProbeGeometryOf(image)) {
    known[vtkUltrasoundAcquisition::ProbeGeometryName()] = JsonOf(*g);
    session.Say(Entry("probe", ProbeText(*g)));
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

} // namespace

Json DescribeVolume(Session& session, const std::string& file)
{
  const LoadedVolume volume = LoadVolume(session, file);
  Json json{{"file", file}, {"kind", "volume"}};
  DescribeFormat(session, volume, json);
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

  json["dimensions"] = g.dimensions;
  json["spacing"] = JsonOf(g.spacing);
  json["origin"] = JsonOf(g.origin);
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
  DescribeHeader(session, volume, json);
  return json;
}

} // namespace echorama
