// SPDX-License-Identifier: BSD-3-Clause
#include "Landmarks.h"
#include "Core/Geometry/LandmarkFile.h"
#include "Volumes.h"
#include <CLI/App.hpp>

namespace echorama {

CLI::Option* AddLandmarksOption(CLI::App* options, std::vector<std::string>& files, const std::string& use)
{
  return options
      ->add_option("--landmarks", files,
                   use + ": a list (.fcsv, .mrk.json, .csv; -: none) for each volume, in their order, each in the frame "
                         "of its volume's file")
      ->type_name("FILE");
}

std::vector<LandmarkList> ReadLandmarkLists(const std::vector<std::string>& files, std::size_t volumes, const std::string& whose)
{
  if (files.size() != volumes)
    throw Error(Error::Kind::InvalidParameter,
                "--landmarks: " + whose + std::to_string(volumes) +
                    " volumes, so that as many files of landmarks are needed, in their order; there are " +
                    std::to_string(files.size()));
  std::vector<LandmarkList> lists;
  for (const std::string& file : files)
    lists.push_back({Pose::Identity(), file == "-" ? std::vector<Landmark>() : ReadLandmarks(file), file});
  return lists;
}

void TellLandmarkError(Session& session, const std::vector<LandmarkList>& lists, const std::vector<std::string>& volumes)
{
  const LandmarkError error = MeasureLandmarkError(lists);
  nlohmann::ordered_json& result = session.result["landmarks"];
  result = {{"pairs", error.distances.size()},
            {"mean_mm", error.mean},
            {"median_mm", error.median},
            {"rms_mm", error.rms},
            {"percentile95_mm", error.percentile95},
            {"max_mm", error.max},
            {"errors", nlohmann::ordered_json::array()},
            {"unmatched", nlohmann::ordered_json::array()}};
  session.Say("landmarks: " + std::to_string(error.distances.size()) + " pairs, mean " + Fixed(error.mean, 3) + ", median " +
              Fixed(error.median, 3) + ", 95% within " + Fixed(error.percentile95, 3) + ", at most " + Fixed(error.max, 3) +
              " mm");
  for (const LandmarkDistance& distance : error.distances)
    result["errors"].push_back({{"label", distance.label},
                                {"from", volumes[static_cast<std::size_t>(distance.first)]},
                                {"to", volumes[static_cast<std::size_t>(distance.second)]},
                                {"mm", distance.error.norm()},
                                {"vector_mm", JsonOf(distance.error)}});
  for (const LoneLandmark& lone : error.unmatched) {
    const LandmarkList& list = lists[static_cast<std::size_t>(lone.list)];
    result["unmatched"].push_back({{"label", lone.label}, {"file", list.name}});
    session.Note(list.name + ": no other list has the landmark \"" + lone.label + "\"; it is not counted");
  }
}

} // namespace echorama
