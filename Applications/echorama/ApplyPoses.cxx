// SPDX-License-Identifier: BSD-3-Clause
// A file of its own: painted strokes need the widgets, and most that reads a volume does not.
#include "Volumes.h"
#include "Widgets/Session/ProjectFile.h"
#include "Widgets/vtkUltrasoundSessionVoxels.h"

namespace echorama {

void ApplyPoses(Session& session, std::vector<LoadedVolume>& volumes, const std::string& path)
{
  if (path.empty())
    return;
  const std::vector<VolumePose> poses = ReadPoses(path);
  const std::vector<SessionVolume> known = ReadProject(path).state.volumes; // the same ones, in the same order
  for (LoadedVolume& volume : volumes) {
    const VolumePose& pose = PoseIn(poses, path, volume);
    const StrokeChain strokes = known[static_cast<std::size_t>(&pose - poses.data())].strokes;
    if (strokes) {
      SessionVolume asRead;
      asRead.geometry = volume.geometry;
      SessionVoxels voxels(asRead, volume.image);
      voxels.GoTo(strokes);
      volume.image = voxels.GetBase();
      session.Note(volume.file + ": painted and carved with the " + std::to_string(strokes->count) + " strokes of " + path);
    }
    MoveVolume(volume, pose.volumeToWorld);
  }
}

} // namespace echorama
