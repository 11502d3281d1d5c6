// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Worker.h"
#include "Tracking/Devices/TrackerAddress.h"
#include "Tracking/Devices/TrackerDevice.h"
#include "Tracking/Stream/SurfacePoseFilter.h"
#include <functional>
#include <memory>
#include <mutex>
#include <string>

namespace echorama {

struct FusedTrackerParameters {
  std::string positionLine, orientationLine; ///< without the first, the probe is where SetPlace says, at first the origin
  std::string positionTool, orientationTool; ///< "": the one that is heard of first
  enum class Clock { Sender, Arrival };
  Clock clock = Clock::Sender; ///< what the poses of both lines are put in order by
  enum class Normals { None, Tool };
  Normals normals = Normals::None;                    ///< Tool: z of the tool of the position looks into the surface
  Eigen::Vector3d mounting = Eigen::Vector3d::Zero(); ///< how the IMU is turned in the probe: axis times angle, degrees
  Eigen::Vector3d alignTo = Eigen::Vector3d::Zero();  ///< where the array points at first; of length 0: nobody says
  double alignDegrees = 3.0;                          ///< how well that is known
  SurfacePoseParameters filter;

  /// From "fused:POSITION-LINE|ORIENTATION-LINE|imuDelay=0.015&up=0 -1 0". \throws Error(InvalidParameter)
  static FusedTrackerParameters Of(const TrackerAddress& address);
};
ParameterList Describe(FusedTrackerParameters& p);

/// Where a probe is by one tracker, how it is turned by another (an IMU, whose z axis is up): one tool, by SurfacePoseFilter. It
/// bears the name of the position's tool, and is out of range (not to be trusted) until somebody has said its heading.
///
/// Images come from the line of the position. Recordings are fused in the order of their times, however fast they are replayed.
class FusedTracker : public TrackerDevice {
public:
  static constexpr const char* Scheme = "fused";
  /// The normal of the surface at a place, outwards; nothing where there is none. Called from the device's thread.
  using NormalOf = std::function<std::optional<Eigen::Vector3d>(const Eigen::Vector3d& place)>;

  /// \throws Error(InvalidParameter) for what is out of its range, and lines that are none
  explicit FusedTracker(const FusedTrackerParameters& parameters);
  ~FusedTracker() override;

  /// \throws as the devices of both lines
  void Start(PoseStream& poses, ImageStream* images) override;
  void Stop() override;

  // Each of these may be called from any thread.

  /// Where the probe is from now on, if there is no line of positions, and the normal there, outwards.
  /// \throws Error(InvalidParameter) for what is not finite, or a normal without a length
  void SetPlace(const Eigen::Vector3d& place, const std::optional<Eigen::Vector3d>& normal);
  /// Where normals come from, unless Normals::Tool says it. nullptr: from nowhere else.
  void SetNormals(NormalOf normals);
  /// At the newest moment that both lines have reached, as SurfacePoseFilter::Align.
  /// \throws Error(NotPossible) with the reason; Error(InvalidParameter)
  void Align(const Eigen::Vector3d& direction, double sigmaDegrees);
  /// The probe was slid along its array, towards x, in the last seconds. \throws as Align
  void AlignBySlide(double seconds, double sigmaDegrees);
  /// Of the heading: standard deviation, radians; pi before any alignment.
  double HeadingSigma() const;

private:
  struct Line;
  void Run(const Worker::Signal& signal, PoseStream& poses);
  void Use(Line& line, const ToolPose& pose, PoseStream& poses);
  double StampOf(const ToolPose& pose) const;
  std::pair<DeviceState, std::string> StateNow() const;

  FusedTrackerParameters parameters_;
  std::unique_ptr<Line> position_, orientation_; ///< no position_: places are told
  Worker worker_;
  bool isLive_ = true;

  mutable std::mutex mutex_; ///< of all below
  SurfacePoseFilter filter_;
  NormalOf normals_;
  Eigen::Vector3d place_ = Eigen::Vector3d::Zero();
  std::optional<Eigen::Vector3d> placeNormal_;
  std::string name_;
  double sent_; ///< time of the last pose; NaN: none
};

} // namespace echorama
