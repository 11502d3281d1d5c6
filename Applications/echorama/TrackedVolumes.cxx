// SPDX-License-Identifier: BSD-3-Clause
#include "TrackedVolumes.h"
#include "ParameterOptions.h"
#include <vtkUltrasoundTrackerPlacement.h>

namespace echorama {

void TrackerOptions::AddTo(CLI::App& options, bool required)
{
  CLI::Option* file = options
                          .add_option("--tracker", log,
                                      "Recording of the tracker: a sequence (.igs.mha), a table (.csv), as echorama track "
                                      "--record writes it")
                          ->type_name("FILE");
  if (required)
    file->required();
  options.add_option("--tool", tool, "The tool that is fixed to the probe, as the recording calls it (default: its only one)")
      ->needs(file);
  options
      .add_option("--at", matching.times,
                  "When each volume was made, in seconds on the recording's clock (default: the volumes' time stamps, else the "
                  "recording's poses one by one)")
      ->needs(file);
  AddParameter(&options, Describe(reading), "UnitMm", "--unit");
  AddParameter(&options, Describe(matching), "WindowSeconds", "--window");
}

ToolTrack ReadTool(Session& session, const std::string& log, const std::string& tool, const PoseLogOptions& reading)
{
  const PoseLog recording = ReadPoseLog(log, reading);
  try {
    const ToolTrack track = ToolTrackOf(recording, tool);
    for (const std::string& note : track.notes)
      session.Note(log + ": " + note);
    return track;
  } catch (const Error& error) {
    if (error.GetKind() != Error::Kind::InvalidParameter)
      throw;
    throw Error(error.GetKind(), std::string(error.what()) + " (--tool)");
  }
}

std::vector<TrackedVolume> TrackedVolumesOf(const TrackerOptions& options, const std::vector<LoadedVolume>& volumes)
{
  const std::vector<double>& times = options.matching.times;
  if (!times.empty() && times.size() != volumes.size())
    throw Error(Error::Kind::InvalidParameter,
                "--at: " + std::to_string(times.size()) + " times for " + std::to_string(volumes.size()) + " volumes");
  std::vector<TrackedVolume> tracked;
  for (const LoadedVolume& volume : volumes)
    tracked.push_back(vtkUltrasoundTrackerPlacement::TrackedVolumeOf(volume.image, volume.file));
  return tracked;
}

} // namespace echorama
