// SPDX-License-Identifier: BSD-3-Clause
#include "SyntheticSet.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/TextFile.h"
#include "Displacements.h"
#include "Volumes.h"
#include <CLI/Validators.hpp>
#include <vtkImageData.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {
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

SyntheticSet::SyntheticSet(Session& session, OutputFolder& folder, const std::string& format, double knockMm, double knockDegrees)
  : session_(session), folder_(folder), format_(format), knockMm_(knockMm), knockDegrees_(knockDegrees)
{
  session.result["knock"] = {{"mm", knockMm}, {"degrees", knockDegrees}};
  session.result["truth"] = folder.Final("truth.json");
  session.result["volumes"] = nlohmann::ordered_json::array();
}

void SyntheticSet::Add(vtkImageData* image, const Pose& knock, const nlohmann::ordered_json& more,
                       const std::vector<Landmark>& landmarks, vtkImageData* displacement)
{
  const std::string number = std::to_string(truth_.size() + 1), name = "volume_" + number + "." + format_;
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
  if (!landmarks.empty()) {
    const std::string list = "landmarks_" + number + ".csv";
    std::string text = "label,x,y,z\n";
    for (const auto& [label, point] : landmarks)
      text += label + ',' + NumberText(point.x()) + ',' + NumberText(point.y()) + ',' + NumberText(point.z()) + '\n';
    WriteTextFile(folder_.Stage(list), text);
    told["landmarks"] = folder_.Final(list);
  }
  session_.result["volumes"].push_back(told);
}

void SyntheticSet::Finish()
{
  WritePoses(folder_.Stage("truth.json"), truth_); // relative to the folder, so they stay right when it gets its place
  folder_.Commit();
  session_.Say("wrote " + folder_.Final("truth.json") + ": the poses that put the volumes back, all but the first by " +
               Fixed(knockMm_, 1) + " mm and " + Fixed(knockDegrees_, 1) + " degrees");
}

} // namespace echorama
