// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Geometry/RigidTransform.h"
#include <cstdint>
#include <deque>
#include <optional>

namespace echorama {

/// What is known of both streams, and of how a probe is held.
struct SurfacePoseParameters {
  double surfaceDelay = 0.0, imuDelay = 0.0; ///< seconds, by which the time stamps of each stream are late
  Eigen::Vector3d up{0.0, 0.0, 1.0};         ///< against gravity, in the world; of any length
  double driftDegreesPerMinute = 10.0;       ///< of the IMU's heading: standard deviation of what is possible
  double driftChange = 5.0;                  ///< by how much that changes in a minute, degrees per minute
  double headingNoise = 0.1;                 ///< degrees in a second, of a heading that wanders without a drift
  double normalDegrees = 2.0;                ///< noise of the surface's normal, each of both angles
  double heldDegrees = 12.0;                 ///< how far the probe's axis is held from the normal, each of both angles
  double heldSeconds = 3.0;                  ///< for how long it is held the same way
  double longestGap = 0.25;                  ///< seconds without a sample that are bridged
  double longestPrediction = 0.1;            ///< seconds beyond the newest sample
};

ParameterList Describe(SurfacePoseParameters& p);

/// A probe at a moment.
struct SurfacePose {
  double time = 0.0; ///< seconds, on the clock of the stamps, without delays
  Pose probeToWorld = Pose::Identity();
  bool isPredicted = false;  ///< beyond the newest sample of a stream, at constant velocity
  double headingSigma = 0.0; ///< standard deviation of the heading about "up", radians
};

/// One pose of a probe out of two streams: where it is from a tracker on a surface, how it is turned from an IMU
/// (dissertation 8.2.1).
///
/// An IMU knows its tilt from gravity, but its heading about the vertical drifts. A Kalman filter follows what is wrong with the
/// heading, the rate of that, and the angle about the vertical that the probe is held aside of the surface's normal, which is
/// kept for some seconds. What corrects the heading is
///  * the normal: seen from above, the probe's axis points where the normal does, but for the way it is held. That tells as much
///  as
///    the normal is away from the vertical: on the flank of a body the heading is held, on top of it, within 30 degrees of the
///    vertical, nothing is used, and the uncertainty grows as the drift makes it, which headingSigma says;
///  * Align(): somebody says which way the array points, and AlignBySlide(): somebody was asked to slide along the array. A
///    motion that nobody asked for tells nothing, as probes are slid across the array as well.
/// Not observable: a probe that is always held to the same side looks like a heading that is wrong, for longer than heldSeconds;
/// and before an alignment nothing is known of the heading. The tilt is the IMU's own, as it is.
///
/// Time stamps are corrected by the delay of each stream, and poses interpolated to a common moment. A sample whose stamp is far
/// from the last of its stream (twice LongestGap, at least a second) waits for the next one. When that agrees with it, the stream
/// was silent, or its clock has jumped, and both are taken; if it went back, all that came of the stream before is forgotten.
/// When the next one goes on from where the stream was, the odd one was a mistake, and is dropped.
class SurfacePoseFilter {
public:
  struct Statistics {
    std::uint64_t surface = 0, imu = 0; ///< samples taken
    std::uint64_t updates = 0;          ///< of the heading by a normal
    std::uint64_t gaps = 0;             ///< samples of the surface at which the IMU was silent
    std::uint64_t odd = 0;              ///< samples whose stamp was far from the last one's
    std::uint64_t jumps = 0;            ///< of the clock of a stream, back
    double meanNis = 0.0;               ///< of the updates: mean of the squared, normalised innovations. 1 when all is as the
                                        ///< parameters say; far above, when they are too sure
  };

  /// \param sensorToProbe how the IMU is mounted
  /// \throws Error(InvalidParameter) for parameters, Error(BadInput) when that is no rotation
  explicit SurfacePoseFilter(const SurfacePoseParameters& parameters,
                             const Eigen::Matrix3d& sensorToProbe = Eigen::Matrix3d::Identity());

  /// A place on the surface, mm, and its normal there, outwards, of any length; without a normal it does not correct the heading.
  /// \throws Error(BadInput), and forgets it, when it is not finite, the normal has no length, or the time is not later than the
  /// last of this stream
  void AddSurface(double stamp, const Eigen::Vector3d& point, const std::optional<Eigen::Vector3d>& normal = std::nullopt);
  /// A rotation of the sensor into a frame whose z axis is up. \throws Error(BadInput) likewise
  void AddImu(double stamp, const Eigen::Quaterniond& sensorToImuWorld);

  /// The array (x of the probe) points along \a direction, in the world, at a moment; how well that is known. Only its part
  /// across "up" counts. \returns false, and changes nothing, when the IMU was silent then, or one of both points up or down.
  /// \throws Error(InvalidParameter)
  bool Align(double time, const Eigen::Vector3d& direction, double sigmaDegrees = 3.0);
  /// The probe was slid along its array, towards x, between two moments. \returns false also for less than 10 mm.
  bool AlignBySlide(double from, double to, double sigmaDegrees = 5.0);
  bool IsAligned() const { return aligned_; }

  /// The probe at a moment; nothing before the oldest sample that is kept (10 s), within a gap, and too long after the newest.
  std::optional<SurfacePose> At(double time) const;
  /// At the newest moment that both streams have reached. Without a prediction.
  std::optional<SurfacePose> Newest() const;

  double HeadingSigma() const;                 ///< radians; pi before any alignment
  double Heading() const { return state_[0]; } ///< what is added to the IMU's, radians
  double DriftDegreesPerMinute() const;        ///< as estimated
  const Statistics& Counted() const { return statistics_; }

private:
  struct SurfaceSample {
    double time;
    Eigen::Vector3d point, normal; ///< of length 0: none
  };
  struct ImuSample {
    double time;
    Eigen::Quaterniond probeToLevel; ///< a frame of the world but for the heading
  };
  using State = Eigen::Vector3d; // heading, its rate, angle that the probe is held aside: radians, seconds

  std::optional<Eigen::Quaterniond> ImuAt(double time, bool predict) const;
  std::optional<Eigen::Vector3d> PointAt(double time, bool predict) const;
  Eigen::Quaterniond WithHeading(const Eigen::Quaterniond& probeToLevel, double heading) const;
  template <class Sample>
  std::size_t Take(std::deque<Sample>& samples, std::optional<Sample>& odd, const Sample& sample, const char* stream);
  void Update();
  void Propagate(double time);
  void UseNormal(const Eigen::Quaterniond& probeToLevel, const Eigen::Vector3d& normal);
  double Correct(const Eigen::RowVector3d& model, double innovation, double noise);

  SurfacePoseParameters parameters_;
  Eigen::Quaterniond probeToSensor_, imuWorldToLevel_;
  Eigen::Vector3d up_;
  std::deque<SurfaceSample> surface_;
  std::deque<ImuSample> imu_;
  std::optional<SurfaceSample> oddSurface_; // whose stamp the next one has to confirm
  std::optional<ImuSample> oddImu_;
  std::deque<SurfaceSample> waiting_; // for the IMU
  State state_ = State::Zero();
  Eigen::Matrix3d covariance_ = Eigen::Matrix3d::Zero();
  double held_ = 0.0;          // standard deviation of that angle where we are
  std::optional<double> time_; // of the state
  bool aligned_ = false;
  Statistics statistics_;
};

} // namespace echorama
