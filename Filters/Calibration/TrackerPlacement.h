// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Calibration/ToolTrack.h"
#include <optional>
#include <string>
#include <vector>

namespace echorama {

/// What has to be known of a volume that a tracker is to place.
struct TrackedVolume {
  std::string name;                                        ///< for messages
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity(); ///< of its axes
  std::optional<double> time;                              ///< when it was made: seconds on the recording's clock
  std::optional<Pose> probeToWorld;                        ///< where its probe is, as the volume lies now
};

/// What fixes volumes to the sensor on their probe: C of dissertation eq. 4.1.
struct VolumeCalibration {
  Pose volumeToSensor = Pose::Identity();
  std::optional<double> errorMm; ///< at the middle of the volumes, as its maker stated it
  /// Which frame "Volume" is: "probe" (ProbeToWorld of the volumes), "file" (volumes that lie as they were acquired), or empty,
  /// not known: probe where all volumes know it.
  std::string frame;
};

/// Reads VolumeTo\a sensor from a calibration, as ReadTransforms. \throws also Error(BadInput) that names the file when it is not
/// there or not a rigid, valid pose
VolumeCalibration ReadVolumeCalibration(const std::string& path, const std::string& sensor);

struct TrackerPlacementParameters {
  std::vector<double> times; ///< when each volume was made, instead of what the volumes say
  MotionSmoothing smoothing{0.2, 0.5};
  int fixed = 0;
};
ParameterList Describe(TrackerPlacementParameters& p);

/// Where the sensor was when each volume was made.
struct SensorPoses {
  std::vector<Pose> poses; ///< one per volume
  std::string how;         ///< a sentence: what belonged together, and by what
  std::vector<std::string> notes;
};

/// Matches volumes and poses: by the times that are given, else by the volumes' time stamps; volumes without any are matched
/// with the poses one by one, when there are as many.
/// \throws Error(InvalidParameter) for times that are not one per volume; Error(BadInput) when some volumes have no time stamp,
/// or none has and poses are not as many; Error(NotPossible) that names the volume which was made before or after the recording,
/// or in one of its gaps
SensorPoses MatchSensor(const ToolTrack& track, const std::vector<TrackedVolume>& volumes,
                        const TrackerPlacementParameters& parameters = {});

/// The frame that is fixed to the probe, as each volume lies now: that of the probe (ProbeToWorld), else the identity.
struct VolumeFrames {
  bool ofProbe = false;
  std::vector<Pose> toWorld; ///< one per volume
  std::vector<std::string> notes;

  const char* Name() const { return ofProbe ? "probe" : "file"; }
};

/// \param frame as VolumeCalibration::frame. \throws Error(BadInput) that names the volume without a probe, when that is needed
VolumeFrames FindVolumeFrames(const std::vector<TrackedVolume>& volumes, const std::string& frame = "");

/// Where a tracker says that volumes belong.
struct TrackerPlacement {
  std::vector<Pose> volumeToWorld; ///< one per volume, from where it lies now; identity for the fixed one
  std::string how;
  std::vector<std::string> notes;
};

/// As seen from the fixed volume: with S the sensor's poses and C the calibration, the probe of a volume lies at
/// C^-1 S_fixed^-1 S C of the fixed one's (dissertation eq. 4.4).
/// \throws as MatchSensor and FindVolumeFrames, Error(InvalidParameter) when there is no fixed volume
TrackerPlacement PlaceByTracker(const ToolTrack& track, const std::vector<TrackedVolume>& volumes,
                                const VolumeCalibration& calibration, const TrackerPlacementParameters& parameters = {});

} // namespace echorama
