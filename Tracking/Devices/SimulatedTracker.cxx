// SPDX-License-Identifier: BSD-3-Clause
// Everything but the waiting is a pure function of (parameters, tool, sample): the truth is a closed form of time, the noise
// comes from Random(seed, item) with an item per tool and sample. The thread only sends each sample when it is due. Samples lie
// at multiples of the interval on the sender's clock, wherever it starts.
#include "Tracking/Devices/SimulatedTracker.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Random.h"
#include "Tracking/Devices/RunDevice.h"
#include "Tracking/Stream/Clock.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr double Tau = 6.283185307179586, Radians = Tau / 360.0;

// A tool's own place, to look from towards the transmitter at the origin.
Pose Home(int tool)
{
  const double angle = 0.6 * tool;
  Pose home = Pose::Identity();
  home.translation() = Eigen::Vector3d(220.0 * std::cos(angle), 220.0 * std::sin(angle), 100.0);
  home.linear() = ExpRotation({0.0, 0.0, angle}) * ExpRotation({0.4, -0.3, 0.2});
  return home;
}

double Wave(double time, double seconds, double phase = 0.0)
{
  return std::sin(Tau * (std::fmod(time, seconds) / seconds + phase));
}

// Sums of three waves per coordinate; their lengths and phases are those of a hand, by chance.
Pose Freehand(std::uint64_t seed, int tool, double time)
{
  Random random(seed, 0x46726565ull << 32 | static_cast<std::uint32_t>(tool));
  double sums[6];
  for (double& sum : sums) {
    sum = 0.0;
    for (int i = 0; i < 3; ++i) {
      const double seconds = random.Uniform(3.0, 11.0), phase = random.Uniform(), size = random.Uniform(0.3, 1.0);
      sum += size * Wave(time, seconds, phase);
    }
  }
  Pose move = Pose::Identity();
  move.translation() = 30.0 * Eigen::Vector3d(sums[0], sums[1], sums[2]);
  move.linear() = ExpRotation(20.0 * Radians * Eigen::Vector3d(sums[3], sums[4], sums[5]));
  return move;
}

Pose Moved(const SimulatedTrackerParameters& p, int tool, double time)
{
  Pose move = Pose::Identity();
  switch (p.motion) {
  case SimulatedMotion::Still:
    break;
  case SimulatedMotion::Sweep:
    move.translation().x() = 40.0 * Wave(time, 5.0);
    move.linear() = ExpRotation({20.0 * Radians * Wave(time, 5.0, 0.25), 0.0, 0.0});
    break;
  case SimulatedMotion::Circle: {
    const double angle = Tau * std::fmod(time, 8.0) / 8.0;
    move.translation() = 60.0 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
    move.linear() = ExpRotation({0.0, 0.0, angle});
    break;
  }
  case SimulatedMotion::Freehand:
    return Freehand(p.seed, tool, time);
  case SimulatedMotion::Pivot: {
    const double tilt = 35.0 * Radians * (0.6 + 0.4 * Wave(time, 7.0));
    const double around = Tau * std::fmod(time, 4.0) / 4.0;
    return MotionAbout(SimulatedPivotTip(), tilt * Eigen::Vector3d(std::cos(around), std::sin(around), 0.0),
                       Eigen::Vector3d::Zero());
  }
  }
  return move;
}

} // namespace

std::vector<std::string> SimulatedMotionNames()
{
  return {"still", "sweep", "circle", "freehand", "pivot"};
}

ParameterList Describe(SimulatedTrackerParameters& p)
{
  return {
      Parameter("Rate", p.rateHz, {0.1, 10000}, "Hz", "Poses per second of each tool."),
      Parameter("Tools", p.tools, {1, 64}, "", "How many tools there are."),
      Parameter("Motion", Choice(p.motion, SimulatedMotionNames()), "How the first tool moves."),
      Parameter("NoiseMm", p.noiseMm, {0, 100}, "mm", "Standard deviation of the position, along each axis."),
      Parameter("NoiseDegrees", p.noiseDegrees, {0, 45}, "degrees",
                "Standard deviation of a small turn, about each axis of the tool."),
      Parameter("Dropout", p.dropout, {0, 1}, "", "Share of poses that are missing."),
      Parameter("LatencyMs", p.latencyMs, {0, 10000}, "ms", "From the measurement to when it is sent."),
      Parameter("JitterMs", p.jitterMs, {0, 1000}, "ms",
                "Of the latency: the mean of what is added, exponentially distributed; order is kept."),
      Parameter(
          "DistortionMm", p.distortionMm, {0, 100}, "mm",
          "What metal nearby does to a magnetic field: how far a tool 300 mm from the transmitter is seen from where it is. It "
          "grows with the square of that distance; tools are turned as the field is (half the curl of the displacement)."),
      Parameter("RangeMm", p.rangeMm, {0, 100000}, "mm",
                "Tools further from the transmitter are out of range; 0: there is no border."),
      Parameter("DriftDegreesPerMinute", p.driftDegreesPerMinute, {-1000, 1000}, "degrees/min",
                "How fast orientations turn about z, as the heading of an IMU does; 0 at the time 0 of the sender's clock."),
      Parameter("Seed", p.seed, {0, 9223372036854775807.0}, "", "The same seed makes the same noise."),
      Parameter("UnplugAfter", p.unplugAfter, {0, 1e9}, "s", "After so long the device is lost; 0: never."),
      Parameter("Start", p.start, {-1, 1e10}, "s",
                "The sender's clock at the start; below 0: as ours. With a fixed one each run sends the same."),
  };
}

SimulatedTrackerParameters SimulatedTrackerParameters::Of(const TrackerAddress& address)
{
  if (!address.place.empty())
    throw Error(Error::Kind::InvalidParameter, address.text + ": a simulated tracker has no place; its options follow a ?");
  SimulatedTrackerParameters p;
  address.Set(Describe(p));
  return p;
}

std::string SimulatedToolName(int tool)
{
  static const char* const names[] = {"ProbeToTracker", "ReferenceToTracker", "StylusToTracker"};
  return tool < 3 ? names[tool] : "Tool" + std::to_string(tool + 1) + "ToTracker";
}

Eigen::Vector3d SimulatedPivotTip()
{
  return {2.0, -3.0, 140.0};
}

Pose SimulatedTruth(const SimulatedTrackerParameters& p, int tool, double time)
{
  if (tool != 1)
    return Home(tool) * Moved(p, tool, time);
  Pose breath = Pose::Identity();
  if (p.motion != SimulatedMotion::Still) {
    breath.translation().z() = 3.0 * Wave(time, 4.0);
    breath.linear() = ExpRotation({2.0 * Radians * Wave(time, 4.0), 0.0, 0.0});
  }
  return Home(tool) * breath;
}

Pose SimulatedDistortion(const SimulatedTrackerParameters& p, const Pose& truth)
{
  if (p.distortionMm == 0.0)
    return truth;
  // d(x) = a |x|^2 e, curl d = 2 a x cross e.
  const Eigen::Vector3d e(0.48, -0.64, 0.6), x = truth.translation();
  const double a = p.distortionMm / (300.0 * 300.0);
  Pose seen = truth;
  seen.linear() = ExpRotation(a * x.cross(e)) * truth.linear();
  seen.translation() += a * x.squaredNorm() * e;
  return seen;
}

ToolPose SimulatedMeasurement(const SimulatedTrackerParameters& p, int tool, std::uint64_t sample)
{
  ToolPose measured;
  measured.name = SimulatedToolName(tool);
  measured.time = static_cast<double>(sample) / p.rateHz;
  // Every number is drawn whether it is needed or not, so that each fault stays the same when another one is changed.
  Random random(p.seed, sample * 64 + static_cast<std::uint64_t>(tool));
  Eigen::Vector3d move, turn;
  for (int i = 0; i < 3; ++i) {
    move[i] = random.Normal();
    turn[i] = random.Normal();
  }
  const double luck = random.Uniform();
  // One message holds all tools of a moment, so its delay is that of the first.
  const double delay = -std::log1p(-Random(p.seed, sample * 64 | 0x8000000000000000ull).Uniform());
  measured.arrival = measured.time + 1e-3 * (p.latencyMs + p.jitterMs * delay);
  if (luck < p.dropout) {
    measured.status = TransformStatus::Missing;
    return measured;
  }
  const Pose truth = SimulatedTruth(p, tool, measured.time);
  measured.pose = SimulatedDistortion(p, truth);
  measured.pose.translation() += p.noiseMm * move;
  measured.pose.linear() = measured.pose.linear() * ExpRotation(p.noiseDegrees * Radians * turn);
  if (p.driftDegreesPerMinute != 0.0)
    measured.pose.linear() =
        ExpRotation({0.0, 0.0, std::remainder(p.driftDegreesPerMinute * measured.time / 60.0 * Radians, Tau)}) *
        measured.pose.linear();
  if (p.rangeMm > 0.0 && truth.translation().norm() > p.rangeMm)
    measured.status = TransformStatus::OutOfRange;
  return measured;
}

SimulatedTracker::SimulatedTracker(const SimulatedTrackerParameters& parameters) : parameters_(parameters)
{
  CheckRanges(parameters_);
}

void SimulatedTracker::Start(PoseStream& poses, ImageStream*)
{
  Stop();
  poses.SetLive(true);
  poses.SetState(DeviceState::Running, "simulated: " + std::to_string(parameters_.tools) + " tools at " +
                                           NumberText(parameters_.rateHz) + " Hz, " +
                                           SimulatedMotionNames()[static_cast<std::size_t>(parameters_.motion)]);
  RunDevice(worker_, poses, [&poses, p = parameters_](const Worker::Signal& signal) {
    const double begun = ClockNow();
    const double start = p.start < 0.0 ? begun : p.start; // the sender's clock, when ours says begun
    double sent = 0.0;
    for (auto sample = static_cast<std::uint64_t>(std::ceil(start * p.rateHz));; ++sample) {
      const double time = static_cast<double>(sample) / p.rateHz;
      if (p.unplugAfter > 0.0 && time - start >= p.unplugAfter) {
        while (ClockNow() - begun < p.unplugAfter)
          if (!signal.Sleep(begun + p.unplugAfter - ClockNow()))
            return;
        poses.SetState(DeviceState::Lost, "simulated: unplugged after " + NumberText(p.unplugAfter) + " s");
        while (signal.Sleep(3600.0)) { // lost until it is stopped
        }
        return;
      }
      std::vector<ToolPose> set;
      for (int tool = 0; tool < p.tools; ++tool)
        set.push_back(SimulatedMeasurement(p, tool, sample));
      sent = std::max(sent, set.front().arrival - start); // messages do not overtake one another
      for (double wait = begun + sent - ClockNow(); wait > 0.0; wait = begun + sent - ClockNow())
        if (!signal.Sleep(wait))
          return;
      if (signal.Stopped())
        return;
      for (ToolPose& pose : set) {
        pose.arrival = std::numeric_limits<double>::quiet_NaN(); // when it really comes
        poses.Add(std::move(pose));
      }
    }
  });
}

} // namespace echorama
