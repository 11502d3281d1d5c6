// SPDX-License-Identifier: BSD-3-Clause
// Files are moved, and projects are opened on other machines; a volume is never mistaken for another all the same. So a name
// alone counts only when nothing else could be meant, and geometries are compared before anything is taken over.
#include "Widgets/Session/ProjectVolumes.h"
#include "Core/Base/Error.h"
#include "Core/Base/TextFile.h"
#include "Core/Geometry/CoarseGrid.h"
#include "Widgets/Session/ProjectFile.h"
#include <algorithm>
#include <filesystem>
#include <set>

namespace fs = std::filesystem;

namespace echorama {
namespace {

std::string FileNameOf(const SessionVolume& volume)
{
  return fs::path(volume.file).filename().string();
}

bool SameVoxels(const SessionVolume& a, const SessionVolume& b)
{
  return a.geometry.AgreesWith(b.geometry) && !a.madeOf == !b.madeOf &&
         (!a.madeOf || FingerprintOf(*a.madeOf) == FingerprintOf(*b.madeOf));
}

} // namespace

std::optional<Pose> PoseAmong(const std::vector<VolumePose>& poses, const SessionVolume& volume)
{
  const std::string file = volume.file.empty() ? volume.name : volume.file;
  const bool named = std::any_of(poses.begin(), poses.end(), [&](const VolumePose& pose) {
    return fs::path(pose.file).filename() == fs::path(file).filename();
  });
  return named ? std::optional<Pose>(PoseFor(poses, file, volume.geometry).volumeToWorld) : std::nullopt;
}

std::map<int, Pose> ReadPosesOf(const SessionState& state, const std::string& path)
{
  const std::vector<VolumePose> poses = ReadPoses(path);
  std::map<int, Pose> found;
  for (const SessionVolume& volume : state.volumes)
    if (const std::optional<Pose> pose = PoseAmong(poses, volume))
      found[volume.id] = *pose;
  if (found.empty())
    throw Error(Error::Kind::BadInput, path + ": it names none of the volumes");
  return found;
}

void WritePosesOf(const SessionState& state, const std::string& path, const std::string& truth)
{
  std::vector<VolumePose> poses;
  for (const SessionVolume& volume : state.volumes) {
    if (volume.madeOf)
      continue; // whoever stitches by these poses makes one anew
    if (volume.file.empty())
      throw Error(Error::Kind::InvalidParameter, volume.name + ": it is in no file; poses are written of files");
    poses.push_back({volume.file, volume.geometry, volume.volumeToWorld});
  }
  CheckMayBeReplaced(ResolvedPath(path), state, truth);
  WritePoses(path, poses);
}

void CheckMayBeReplaced(const std::string& path, const SessionState& state, const std::string& truth)
{
  std::error_code error;
  const auto isThis = [&](const std::string& file) {
    return !file.empty() && (file == path || fs::equivalent(file, path, error));
  };
  for (const SessionVolume& volume : state.volumes)
    if (isThis(volume.file))
      throw Error(Error::Kind::InvalidParameter, path + ": it is the file of the volume " + volume.name + " and stays");
  if (isThis(truth))
    throw Error(Error::Kind::InvalidParameter, path + ": it is the file of the true poses and stays");
  if (const std::string note = DisplacementNote(path); !note.empty())
    throw Error(Error::Kind::NotPossible, note + "; choose another name");
}

std::string DisplacementNote(const std::string& path)
{
  std::string names;
  bool isNamed = false; // most have none
  try {
    isNamed = ReadTextFile(path).find("\"displacement\"") != std::string::npos;
    if (isNamed)
      for (const VolumePose& pose : ReadPoses(path))
        if (!pose.displacement.empty())
          names += (names.empty() ? "" : ", ") + fs::path(pose.file).filename().string();
  } catch (const Error&) {
    if (isNamed) // else it is something else, or not there
      names = "volumes that cannot be read";
  }
  return names.empty() ? names : path + ": its displacements (of " + names + ") are neither shown here nor kept";
}

bool SameWork(const SessionState& a, const SessionState& b)
{
  const auto same = [](const SessionVolume& left, SessionVolume right) {
    if (left.geometry.AgreesWith(right.geometry))
      right.geometry = left.geometry;
    right.id = left.id;
    right.edition = left.edition;
    return left == right;
  };
  return a.centre == b.centre && a.measurements == b.measurements &&
         std::equal(a.volumes.begin(), a.volumes.end(), b.volumes.begin(), b.volumes.end(), same);
}

void Recognize(std::vector<SessionVolume>& volumes, const std::vector<SessionVolume>& known,
               const std::function<bool(int id)>& shown)
{
  std::set<int> taken;
  const auto take = [&](SessionVolume& volume, const std::function<bool(const SessionVolume&)>& same) {
    const SessionVolume* found = nullptr;
    for (const SessionVolume& each : known)
      if (taken.count(each.id) == 0 && same(each) && SameVoxels(each, volume) && (!found || shown(each.id)))
        found = &each;
    volume.id = found ? found->id : 0;
    volume.edition = found ? found->edition : 0;
    if (found) {
      taken.insert(found->id);
      volume.file = found->file;
      volume.geometry = found->geometry;
    }
  };
  for (SessionVolume& volume : volumes)
    take(volume, [&](const SessionVolume& each) {
      return each.file == volume.file && (!volume.file.empty() || each.name == volume.name);
    });
  std::map<std::string, std::set<std::string>> here, wanted; // which files have a name
  for (const SessionVolume& each : known)
    here[FileNameOf(each)].insert(each.file);
  for (const SessionVolume& volume : volumes)
    wanted[FileNameOf(volume)].insert(volume.file);
  std::error_code error;
  for (SessionVolume& volume : volumes) {
    const std::string name = FileNameOf(volume);
    if (volume.id == 0 && !name.empty() && here[name].size() == 1 && wanted[name].size() == 1 && !fs::exists(volume.file, error))
      take(volume, [&](const SessionVolume& each) { return FileNameOf(each) == name; });
  }
}

std::string LeaveOutFileless(const std::string& path, std::vector<SessionVolume>& volumes)
{
  const auto end = std::stable_partition(volumes.begin(), volumes.end(),
                                         [](const SessionVolume& each) { return each.id != 0 || !each.file.empty(); });
  std::string names;
  for (auto each = end; each != volumes.end(); ++each)
    names += (names.empty() ? "" : ", ") + each->name;
  volumes.erase(end, volumes.end());
  if (volumes.empty() && !names.empty())
    throw Error(Error::Kind::BadInput, path + ": its volumes were in no file: " + names);
  return names.empty() ? names : path + ": it opens without what was in no file: " + names;
}

void FindVolumes(const std::string& path, std::vector<SessionVolume>& volumes, const std::vector<std::string>& folders)
{
  std::string missing;
  int count = 0;
  for (SessionVolume& volume : volumes) {
    if (volume.id != 0)
      continue;
    const std::string found = FindVolume(path, volume.file, folders);
    if (found.empty())
      missing += (count++ > 0 ? ", " : "") + (volume.file.empty() ? volume.name + " (it was in no file)" : volume.file);
    else
      volume.file = ResolvedPath(found);
  }
  if (count > 0)
    throw Error(Error::Kind::FileSystem, path + ": " + std::to_string(count) + " of its volumes are not there: " + missing +
                                             " (they are also looked for beside the project and in the search folders)");
  // Where a name was looked for, two may have been found in the same place.
  std::set<std::string> files;
  for (const SessionVolume& volume : volumes)
    if (!volume.file.empty() && !files.insert(volume.file).second)
      throw Error(Error::Kind::BadInput, path + ": two of its volumes are the file " + volume.file + " (" + volume.name +
                                             " is the second); put each where the project names it");
}

void TakeGeometry(SessionVolume& volume, const ImageGeometry& found)
{
  if (volume.geometry.VoxelCount() > 0 && !AreGridsOfOneVolume(volume.geometry, found))
    throw Error(Error::Kind::BadInput, volume.file + ": its geometry is not the one that the project was saved with "
                                                     "(has it been moved or resampled since?)");
  volume.geometry = found;
}

} // namespace echorama
