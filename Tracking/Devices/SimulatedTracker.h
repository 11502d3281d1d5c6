// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Worker.h"
#include "Tracking/Devices/TrackerAddress.h"
#include "Tracking/Devices/TrackerDevice.h"
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace echorama {

/// How the first tool of a simulated tracker moves. The second, ReferenceToTracker, moves a little, as a patient who breathes
/// does; the others move as the first does, elsewhere.
enum class SimulatedMotion {
  Still,    ///< it does not; nor does the second
  Sweep,    ///< to and fro along x, 80 mm in 5 s, tilting by 20 degrees about it
  Circle,   ///< around a circle of 60 mm radius in 8 s, turning with it
  Freehand, ///< a hand that looks for something: sums of slow waves in all six ways
  Pivot,    ///< about its tip, which rests: within a cone of 35 degrees
};
const char* SimulatedMotionName(SimulatedMotion motion); ///< "still", "sweep" ...
std::vector<std::string> SimulatedMotionNames();

/// A tracker that does not exist, with the faults of those that do.
struct SimulatedTrackerParameters {
  double rateHz = 60.0; ///< poses per second of each tool, in [0.1, 10000]
  int tools = 2;        ///< in [1, 64]
  SimulatedMotion motion = SimulatedMotion::Freehand;
  double noiseMm = 0.0;      ///< standard deviation per axis, in [0, 100]
  double noiseDegrees = 0.0; ///< standard deviation per axis of a small turn in the tool's own frame, in [0, 45]
  double dropout = 0.0;      ///< share of poses that are Missing, in [0, 1]
  double latencyMs = 0.0;    ///< from the measurement to when it is sent, in [0, 10000]
  double jitterMs = 0.0; ///< of the latency: the mean of what is added, exponentially distributed, in [0, 1000]; order is kept
  /// What metal nearby does to a magnetic field: how far a tool 300 mm from the transmitter is seen from where it is, mm, in
  /// [0, 100]. It grows with the square of that distance; tools are turned as the field is (half the curl of the displacement).
  double distortionMm = 0.0;
  double rangeMm = 0.0; ///< tools further from the transmitter are OutOfRange, in [0, 100000]; 0: there is no border
  std::uint64_t seed = 1;
  double unplugAfter = 0.0; ///< seconds, in [0, 1e9]: then the device is Lost; 0: never
  /// The sender's clock at the start, seconds, in [0, 1e10]. NaN: as ours. With a fixed one each run sends the same.
  double start = std::numeric_limits<double>::quiet_NaN();

  void Check() const; ///< Throws Error(InvalidParameter) that names what is out of its range.
  /// From the options of "simulated:?rate=100&tools=3&motion=sweep&noiseMm=0.7&noiseDegrees=0.25&dropout=0.1&latencyMs=20&
  /// jitterMs=5&distortionMm=2&rangeMm=400&seed=1&unplugAfter=10&start=0". \throws Error(InvalidParameter)
  static SimulatedTrackerParameters Of(const TrackerAddress& address);
};

/// ProbeToTracker, ReferenceToTracker, StylusToTracker, Tool4ToTracker ...; \a tool from 0.
std::string SimulatedToolName(int tool);

/// Where the tip of a tool that moves by Pivot rests, in the tool's frame, mm.
Eigen::Vector3d SimulatedPivotTip();

/// Where a tool really is: a smooth function of the sender's clock, in closed form.
Pose SimulatedTruth(const SimulatedTrackerParameters& parameters, int tool, double time);

/// Where a distorted field shows what is really at \a truth.
Pose SimulatedDistortion(const SimulatedTrackerParameters& parameters, const Pose& truth);

/// What the tracker says of a tool: its sample number \a sample, of the time sample / rateHz on its clock. Depends on nothing
/// else, so that a test knows every pose. Its arrival is when it is sent, on the sender's clock, before order is kept.
ToolPose SimulatedMeasurement(const SimulatedTrackerParameters& parameters, int tool, std::uint64_t sample);

/// Sends them.
class SimulatedTracker : public TrackerDevice {
public:
  /// \throws Error(InvalidParameter) as Check()
  explicit SimulatedTracker(const SimulatedTrackerParameters& parameters);
  ~SimulatedTracker() override { Stop(); }

  void Start(PoseStream& poses, ImageStream* images) override;
  void Stop() override { worker_.Stop(); }

private:
  SimulatedTrackerParameters parameters_;
  Worker worker_;
};

/// The line of MakeTracker.
std::unique_ptr<TrackerDevice> MakeSimulatedTracker(const TrackerAddress& address);

} // namespace echorama
