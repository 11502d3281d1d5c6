// SPDX-License-Identifier: BSD-3-Clause
// Files are copied into a folder beside the place, which takes the place in one step. The project file comes after, as it holds
// absolute paths beside the relative ones: until then the folder is volumes without a project, which no one mistakes for one.
#include "Widgets/Session/ProjectFolder.h"
#include "Core/Base/Error.h"
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

// What is copied for one volume, into a folder of its own when its name is taken.
std::vector<Copy> CopiesOf(const SessionVolume& volume, std::set<fs::path>& taken, fs::path& file)
{
  const fs::path source = ResolvedPath(volume.file), home = source.parent_path();
  const std::vector<std::string> files = FilesOfVolume(source.string());
  if (files.empty())
    Refuse(Error::Kind::FileSystem, volume.file, "it is not there any more");
  fs::path into = "volumes";
  const auto isTaken = [&] {
    return std::any_of(files.begin(), files.end(),
                       [&](const std::string& each) { return taken.count(into / fs::path(each).lexically_relative(home)) > 0; });
  };
  for (int number = 2; isTaken(); ++number)
    into = fs::path("volumes") / std::to_string(number);
  std::vector<Copy> copies;
  for (const std::string& each : files) {
    const fs::path relative = fs::path(each).lexically_relative(home);
    if (relative.empty() || *relative.begin() == "..")
      Refuse(Error::Kind::BadInput, volume.file,
             "its voxels lie in another folder (" + each + "); convert it into one file first (echorama convert)");
    copies.push_back({each, into / relative});
    taken.insert(copies.back().to);
  }
  file = into / source.filename();
  return copies;
}

// Removes what was begun, unless it is finished.
class Stage {
public:
  explicit Stage(const fs::path& place) : path(place.parent_path() / ("." + place.filename().string() + ".part"))
  {
    std::error_code problem;
    fs::remove_all(path, problem);
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

std::string CopyProject(Project project, const std::string& folder, const Progress& progress)
{
  fs::path place = fs::absolute(folder).lexically_normal();
  if (place.filename().empty())
    place = place.parent_path();
  CheckPlace(place);
  std::vector<Copy> copies;
  std::set<fs::path> taken;
  std::vector<fs::path> files;
  for (const SessionVolume& volume : project.state.volumes) {
    if (volume.file.empty())
      throw Error(Error::Kind::InvalidParameter, volume.name + ": it is in no file; export it first, and open the file");
    files.emplace_back();
    for (Copy& copy : CopiesOf(volume, taken, files.back()))
      copies.push_back(std::move(copy));
    const fs::path among = place.lexically_relative(ResolvedPath(volume.file));
    if (!among.empty() && *among.begin() != "..")
      Refuse(Error::Kind::NotPossible, place, "it lies among the files of a volume; name a folder elsewhere");
  }
  std::vector<VolumePose> truth;
  if (!project.truth.empty())
    truth = ReadPoses(project.truth);

  const Stage stage(place);
  std::error_code problem;
  for (std::size_t i = 0; i < copies.size(); ++i) {
    progress(static_cast<double>(i) / static_cast<double>(copies.size()));
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
