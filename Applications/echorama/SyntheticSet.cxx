// SPDX-License-Identifier: BSD-3-Clause
#include "SyntheticSet.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Random.h"
#include "Core/Base/TextFile.h"
#include "Core/Imaging/ValidPoints.h"
#include "Displacements.h"
#include "Filters/Phantoms/Phantom.h"
#include "Filters/Phantoms/PhantomViews.h"
#include "Volumes.h"
#include <algorithm>
#include <CLI/Validators.hpp>
#include <vtkImageData.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {
namespace {

Eigen::Vector3d CentroidOf(vtkImageData* image)
{
  std::ptrdiff_t count = 0;
  Eigen::Vector3d index = Eigen::Vector3d::Zero();
  vtkDataArray* intensity = vtkUltrasoundVolume::GetIntensity(image);
  vtkUltrasoundVolume::Dispatch(intensity, [&](auto type) {
    using T = decltype(type);
    index = ValidCentroid<T>(vtkUltrasoundVolume::ViewOf<const T>(intensity, image),
                             vtkUltrasoundVolume::ViewOf<const unsigned char>(vtkUltrasoundVolume::GetValidRegion(image), image),
                             count);
  });
  return vtkUltrasoundVolume::GeometryOf(image).IndexToWorld() * index;
}

} // namespace

void AddSetOptions(CLI::App& options, int& landmarks, std::string& format)
{
  options
      .add_option("--landmarks", landmarks, "How many places that two volumes see are listed for each volume, as landmarks_N.csv")
      ->check(CLI::Range(0, 10000))
      ->capture_default_str();
  options.add_option("--format", format, "File format")
      ->check(CLI::IsMember({"mha", "mhd", "nrrd", "nhdr", "vti"}))
      ->capture_default_str();
}

SyntheticSet::SyntheticSet(Session& session, OutputFolder& folder, const std::string& format, const Knock& knock)
  : session_(session), folder_(folder), format_(format), knock_(knock)
{
  session.result["knock"] = {{"mm", knock.mm}, {"degrees", knock.degrees}};
  session.result["truth"] = folder.Final("truth.json");
  session.result["volumes"] = nlohmann::ordered_json::array();
}

Pose SyntheticSet::Add(vtkImageData* image, const nlohmann::ordered_json& more, const std::vector<Landmark>& places,
                       const SeenAt& seenAt, vtkImageData* displacement)
{
  const std::string number = std::to_string(truth_.size() + 1), name = "volume_" + number + "." + format_;
  const Pose knock =
      truth_.empty() ? Pose::Identity() : KnockedPose(knock_.seed, truth_.size(), knock_.mm, knock_.degrees, CentroidOf(image));
  vtkUltrasoundVolume::Move(image, knock);
  const std::string file = folder_.Stage(name);
  SaveVolume(session_, image, file);
  truth_.push_back({file, vtkUltrasoundVolume::GeometryOf(image), knock.inverse()});
  nlohmann::ordered_json told{{"file", folder_.Final(name)}};
  told.update(more);
  told["VolumeToWorld"] = JsonOf(knock.inverse());
  if (displacement) {
    const std::string field = "displacement_" + number + ".vti";
    truth_.back().displacement = folder_.Stage(field);
    WriteDisplacement(displacement, truth_.back().displacement);
    told["displacement"] = folder_.Final(field);
  }
  session_.Say("wrote " + folder_.Final(name));
  if (!places.empty()) {
    const std::string list = "landmarks_" + number + ".csv";
    std::string text = "label,x,y,z\n";
    for (const Landmark& place : places)
      if (const auto seen = seenAt(place.position)) {
        const Eigen::Vector3d point = knock * *seen;
        text += place.label + ',' + NumberText(point.x()) + ',' + NumberText(point.y()) + ',' + NumberText(point.z()) + '\n';
      }
    WriteTextFile(folder_.Stage(list), text);
    told["landmarks"] = folder_.Final(list);
  }
  session_.result["volumes"].push_back(told);
  return knock;
}

void SyntheticSet::Finish()
{
  WritePoses(folder_.Stage("truth.json"), truth_); // relative to the folder, so they stay right when it gets its place
  folder_.Commit();
  session_.Say("wrote " + folder_.Final("truth.json") + ": the poses that put the volumes back, all but the first by " +
               Fixed(knock_.mm, 1) + " mm and " + Fixed(knock_.degrees, 1) + " degrees");
}

std::vector<Landmark> SharedPlaces(std::uint64_t seed, int count, const ProbeGeometry& probe, const std::vector<Pose>& views)
{
  std::vector<Landmark> places;
  Random random(seed, 0x1a4d);
  const Eigen::AlignedBox3d box = BoxAround(probe);
  for (int attempt = 0; attempt < 1000 * count && static_cast<int>(places.size()) < count; ++attempt) {
    const Pose& view = views[random.Below(views.size())];
    const Eigen::Vector3d share(random.Uniform(), random.Uniform(), random.Uniform());
    const Eigen::Vector3d place = view * (box.min() + share.cwiseProduct(box.sizes()));
    const auto sees = [&](const Pose& other) { return BeamPointAt(probe, other.inverse() * place).has_value(); };
    if (sees(view) && std::count_if(views.begin(), views.end(), sees) > 1)
      places.push_back({"L" + std::to_string(places.size() + 1), place});
  }
  return places;
}

} // namespace echorama
