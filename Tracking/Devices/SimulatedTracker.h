// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Worker.h"
#include "Tracking/Devices/TrackerAddress.h"
#include "Tracking/Devices/TrackerDevice.h"
#include <cstdint>
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
std::vector<std::string> SimulatedMotionNames(); ///< "still", "sweep" ...

/// A tracker that does not exist, with the faults of those that do.
struct SimulatedTrackerParameters {
  double rateHz = 60.0;
  int tools = 2;
  SimulatedMotion motion = SimulatedMotion::Freehand;
  double noiseMm = 0.0, noiseDegrees = 0.0, dropout = 0.0, latencyMs = 0.0, jitterMs = 0.0, distortionMm = 0.0, rangeMm = 0.0;
  double driftDegreesPerMinute = 0.0;
  std::uint64_t seed = 1;
  double unplugAfter = 0.0, start = -1.0;

  /// From the options of "simulated:?rate=100&tools=3&motion=sweep&noiseMm=0.7&noiseDegrees=0.25&dropout=0.1&latencyMs=20&
  /// jitterMs=5&distortionMm=2&rangeMm=400&driftDegreesPerMinute=10&seed=1&unplugAfter=10&start=0". \throws
  /// Error(InvalidParameter)
  static SimulatedTrackerParameters Of(const TrackerAddress& address);
};
ParameterList Describe(SimulatedTrackerParameters& p);

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
  /// \throws Error(InvalidParameter) for what is out of its range
  explicit SimulatedTracker(const SimulatedTrackerParameters& parameters);
  ~SimulatedTracker() override { Stop(); }

  void Start(PoseStream& poses, ImageStream* images) override;
  void Stop() override { worker_.Stop(); }

private:
  SimulatedTrackerParameters parameters_;
  Worker worker_;
};

} // namespace echorama
