// SPDX-License-Identifier: BSD-3-Clause
// JSON prints the shortest digits that give a double back, so poses survive any number of rounds unchanged. All checks
// are made on reading, with the place in the file in the message: a pose file is written by people and scripts too.
#include "Core/Geometry/PoseFile.h"
#include "Core/Base/TextFile.h"
#include "Core/Geometry/CoarseGrid.h"
#include "Core/Geometry/PoseJson.h"
#include <filesystem>
#include <set>

namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace echorama {
namespace {

constexpr const char* Schema = "echorama-poses-1";
constexpr const char* ProjectSchema = "echorama-project-1"; // of an alignment session: a pose file with more in it

fs::path Resolved(const fs::path& path)
{
  std::error_code error;
  const fs::path resolved = fs::weakly_canonical(fs::absolute(path), error);
  return error ? fs::absolute(path).lexically_normal() : resolved;
}

} // namespace

std::vector<VolumePose> ReadPoses(const std::string& path)
{
  const JsonPlace file(path);
  const ordered_json root = file.Parse(ReadTextFile(path));
  if (file.Member(root, "schema") != ProjectSchema)
    file.Need(root, "schema", Schema);
  file.Need(root, "unit", "mm");
  file.Need(root, "frame", "LPS");
  const ordered_json& volumes = file.Member(root, "volumes");
  if (!volumes.is_array())
    file.Fail("\"volumes\" is not a list");

  const fs::path folder = Resolved(path).parent_path(), beside = fs::absolute(path).parent_path();
  const auto fileOf = [&](const ordered_json& volume, const char* key, const JsonPlace& place) {
    const ordered_json& name = place.Member(volume, key);
    if (!name.is_string() || name.get<std::string>().empty())
      place.Fail("\"" + std::string(key) + "\" is not a file name");
    const fs::path found = (folder / name.get<std::string>()).lexically_normal(); // an absolute name replaces the folder
    std::error_code error;
    const bool isBeside = !fs::exists(found, error) && fs::exists(beside / name.get<std::string>(), error);
    return (isBeside ? beside / name.get<std::string>() : found).string(); // beside a link to the pose file
  };
  std::vector<VolumePose> poses;
  std::set<std::string> seen;
  for (const ordered_json& volume : volumes) {
    const JsonPlace place = file.In("volume " + std::to_string(poses.size() + 1));
    VolumePose pose;
    pose.file = fileOf(volume, "file", place);
    if (!seen.insert(Resolved(pose.file).string()).second)
      place.Fail(volume["file"].get<std::string>() + " is named twice");
    if (volume.contains("displacement"))
      pose.displacement = fileOf(volume, "displacement", place);
    if (volume.contains("geometry"))
      pose.geometry = PoseJson::ToGeometry(volume["geometry"], place.In("geometry"));
    pose.volumeToWorld = PoseJson::ToPose(place.Member(volume, "VolumeToWorld"), place.In("VolumeToWorld"));
    poses.push_back(pose);
  }
  return poses;
}

void WritePoses(const std::string& path, const std::vector<VolumePose>& poses)
{
  const fs::path folder = Resolved(fs::absolute(path)).parent_path();
  const auto nameOf = [&folder](const std::string& file) {
    const fs::path relative = Resolved(file).lexically_relative(folder);
    return (relative.empty() ? Resolved(file) : relative).generic_string();
  };
  ordered_json volumes = ordered_json::array();
  for (const VolumePose& pose : poses) {
    const auto fail = [&](const std::string& reason) {
      throw Error(Error::Kind::InvalidParameter, path + ", volume " + std::to_string(volumes.size() + 1) + ": " + reason);
    };
    if (pose.file.empty())
      fail("it has no file name");
    if (!pose.geometry)
      fail("its geometry is not given");
    if (!IsRotation(pose.volumeToWorld.linear()) || !pose.volumeToWorld.translation().allFinite())
      fail("its pose is not rigid");
    volumes.push_back({{"file", nameOf(pose.file)},
                       {"geometry", PoseJson::Of(*pose.geometry)},
                       {"VolumeToWorld", JsonPlace::RowsOf(pose.volumeToWorld.matrix())}});
    if (!pose.displacement.empty())
      volumes.back()["displacement"] = nameOf(pose.displacement);
  }
  const ordered_json root{{"schema", Schema}, {"unit", "mm"}, {"frame", "LPS"}, {"volumes", volumes}};

  std::string text;
  try {
    text = root.dump(2);
  } catch (const nlohmann::json::exception&) {
    throw Error(Error::Kind::InvalidParameter, path + ": a file name is not UTF-8");
  }
  WriteTextFile(path, text + '\n');
}

const VolumePose& PoseFor(const std::vector<VolumePose>& poses, const std::string& file, const ImageGeometry& geometry)
{
  const VolumePose* found = nullptr;
  const fs::path resolved = Resolved(file);
  // To resolve a path asks the file system for each of its folders, so first without: as a rule poses are as ReadPoses made them.
  for (const bool asWritten : {true, false})
    for (std::size_t i = 0; i < poses.size() && !found; ++i)
      if (asWritten ? poses[i].file == resolved.native() : Resolved(poses[i].file) == resolved)
        found = &poses[i];
  const bool isThere = found != nullptr;
  for (std::size_t i = 0; i < poses.size() && !isThere; ++i)
    if (fs::path(poses[i].file).filename() == resolved.filename()) {
      if (found)
        throw Error(Error::Kind::BadInput,
                    file + ": the poses name several files " + resolved.filename().string() + ", and none in this folder");
      found = &poses[i];
    }
  if (!found)
    throw Error(Error::Kind::BadInput, file + ": the poses do not name this volume");
  if (found->geometry && !AreGridsOfOneVolume(*found->geometry, geometry))
    throw Error(Error::Kind::BadInput, file + ": its geometry is not the one that the poses were found for "
                                              "(has it been moved or resampled since?)");
  return *found;
}

} // namespace echorama
