// SPDX-License-Identifier: BSD-3-Clause
// Files are copied into a folder beside the place, which takes the place in one step. The project file comes after, as it holds
// absolute paths beside the relative ones: until then the folder is volumes without a project, which no one mistakes for one.
#include "Widgets/Session/ProjectFolder.h"
#include "Core/Base/Error.h"
#include "Core/Base/FileReplacement.h"
#include "Core/Geometry/PoseFile.h"
#include "Readers/OutputFiles.h"
#include "Widgets/Session/ProjectVolumes.h"
#include <algorithm>
#include <filesystem>
#include <set>
#include <system_error>

namespace fs = std::filesystem;

namespace echorama {
namespace {

[[noreturn]] void Refuse(Error::Kind kind, const fs::path& path, const std::string& reason)
{
  throw Error(kind, path.string() + ": " + reason);
}

struct Copy {
  fs::path from, to; ///< to: relative to the folder
};

// "volumes", or a folder in it where none of \a files is taken.
fs::path FreePlace(const std::vector<fs::path>& files, const std::set<fs::path>& taken)
{
  fs::path into = "volumes";
  const auto isTaken = [&] {
    return std::any_of(files.begin(), files.end(), [&](const fs::path& each) { return taken.count(into / each) > 0; });
  };
  for (int number = 2; isTaken(); ++number)
    into = fs::path("volumes") / std::to_string(number);
  return into;
}

// Where a volume that is in no file is written: under its own name.
fs::path PlaceToWrite(const SessionVolume& volume, std::set<fs::path>& taken)
{
  std::string name = volume.name;
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == '/' || c == '\\' || c == '\0'; }, '_');
  std::vector<fs::path> files{name + ".mha"};
  for (const std::string& companion : CompanionPaths(files.front().string()))
    files.emplace_back(companion);
  const fs::path into = FreePlace(files, taken);
  for (const fs::path& each : files)
    taken.insert(into / each);
  return into / files.front();
}

// What is copied for one volume, into a folder of its own when its name is taken.
std::vector<Copy> CopiesOf(const SessionVolume& volume, std::set<fs::path>& taken, fs::path& file)
{
  const fs::path source = ResolvedPath(volume.file), home = source.parent_path();
  const std::vector<std::string> files = FilesOfVolume(source.string());
  if (files.empty())
    Refuse(Error::Kind::FileSystem, volume.file, "it is not there any more");
  std::vector<fs::path> relative;
  for (const std::string& each : files) {
    relative.push_back(fs::path(each).lexically_relative(home));
    if (relative.back().empty() || *relative.back().begin() == "..")
      Refuse(Error::Kind::BadInput, volume.file,
             "its voxels lie in another folder (" + each + "); convert it into one file first (echorama convert)");
  }
  const fs::path into = FreePlace(relative, taken);
  std::vector<Copy> copies;
  for (std::size_t i = 0; i < files.size(); ++i) {
    copies.push_back({files[i], into / relative[i]});
    taken.insert(copies.back().to);
  }
  file = into / source.filename();
  return copies;
}

// Removes what was begun, unless it is finished.
class Stage {
public:
  explicit Stage(const fs::path& place) : path(NewFolderBeside(place.string()))
  {
    std::error_code problem;
    fs::create_directories(path / "volumes", problem);
    if (problem)
      Refuse(Error::Kind::FileSystem, place, "it cannot be made (" + problem.message() + ")");
  }
  ~Stage()
  {
    std::error_code none;
    fs::remove_all(path, none);
  }
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  const fs::path path;
};

void CheckPlace(const fs::path& place)
{
  std::error_code none;
  if (place.filename().empty())
    Refuse(Error::Kind::InvalidParameter, place, "a folder needs a name");
  if (fs::exists(place, none) && !(fs::is_directory(place, none) && fs::is_empty(place, none)))
    Refuse(Error::Kind::NotPossible, place, "it is there and not empty; name a new folder");
}

} // namespace

std::string CopyProject(Project project, const std::string& folder, const Progress& progress, const VolumeWriter& write)
{
  fs::path place = fs::absolute(folder).lexically_normal();
  if (place.filename().empty())
    place = place.parent_path();
  CheckPlace(place);
  std::vector<Copy> copies;
  std::set<fs::path> taken;
  const std::vector<SessionVolume>& volumes = project.state.volumes;
  std::vector<fs::path> files(volumes.size());
  std::vector<std::size_t> toWrite;
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    const SessionVolume& volume = volumes[i];
    if (volume.file.empty()) {
      if (!write)
        throw Error(Error::Kind::InvalidParameter, volume.name + ": it is in no file; export it first, and open the file");
      toWrite.push_back(i);
      continue;
    }
    for (Copy& copy : CopiesOf(volume, taken, files[i]))
      copies.push_back(std::move(copy));
    const fs::path among = place.lexically_relative(ResolvedPath(volume.file));
    if (!among.empty() && *among.begin() != "..")
      Refuse(Error::Kind::NotPossible, place, "it lies among the files of a volume; name a folder elsewhere");
  }
  for (const std::size_t i : toWrite) // files keep their names
    files[i] = PlaceToWrite(volumes[i], taken);
  std::vector<VolumePose> truth;
  if (!project.truth.empty())
    truth = ReadPoses(project.truth);

  const Stage stage(place);
  std::error_code problem;
  const auto steps = static_cast<double>(copies.size() + toWrite.size());
  for (std::size_t i = 0; i < toWrite.size(); ++i) {
    const fs::path to = stage.path / files[toWrite[i]];
    fs::create_directories(to.parent_path(), problem);
    const Progress part = progress.Part(static_cast<double>(i) / steps, static_cast<double>(i + 1) / steps);
    write(volumes[toWrite[i]], to.string(), part);
  }
  for (std::size_t i = 0; i < copies.size(); ++i) {
    progress(static_cast<double>(i + toWrite.size()) / steps);
    const fs::path to = stage.path / copies[i].to;
    fs::create_directories(to.parent_path(), problem);
    if (!fs::copy_file(copies[i].from, to, problem) || problem)
      Refuse(Error::Kind::FileSystem, copies[i].from,
             "it cannot be copied to " + place.string() + " (" + problem.message() + ")");
  }
  fs::rename(stage.path, place, problem);
  if (problem)
    Refuse(Error::Kind::FileSystem, place, "it cannot be made (" + problem.message() + ")");

  std::vector<VolumePose> known;
  for (std::size_t i = 0; i < files.size(); ++i) {
    SessionVolume& volume = project.state.volumes[i];
    if (const auto pose = PoseAmong(truth, volume))
      known.push_back({(place / files[i]).string(), volume.geometry, *pose});
    volume.file = (place / files[i]).string();
  }
  project.truth.clear();
  if (!known.empty()) {
    project.truth = (place / "truth.json").string();
    WritePoses(project.truth, known);
  }
  const std::string path = (place / (place.filename().string() + ".json")).string();
  WriteProject(path, project);
  return path;
}

} // namespace echorama
