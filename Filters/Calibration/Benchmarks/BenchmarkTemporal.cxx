// SPDX-License-Identifier: BSD-3-Clause
// Temporal calibration: time, error of the offset and how often 1.96 standard errors hold it, beside what is usually written by
// hand: speeds by differences of neighbouring poses, put onto the faster stream's rate, and the highest sample of their
// correlation.
#include "Core/Base/Angles.h"
#include "Core/Base/Random.h"
#include "Filters/Calibration/TemporalCalibration.h"
#include "Testing/Benchmark.h"
#include <array>
#include <cmath>

using namespace echorama;
using Eigen::Vector3d;

namespace {

constexpr double Offset = -0.4137;
const int Trials = benchmark::Trials(100);

struct Case {
  const char* name;
  double seconds, firstHz, secondHz, degrees;
};

struct Wave {
  double size, frequency, phase;
};

// One motion, seen by two sensors on it.
std::array<std::vector<TimedPose>, 2> Recorded(const Case& c, std::uint64_t seed)
{
  Random random(seed);
  std::array<std::array<Wave, 5>, 3> waves;
  for (auto& axis : waves)
    for (Wave& wave : axis)
      wave = {0.35 * random.Uniform(0.1, 1.0), random.Uniform(0.05, 0.8), random.Uniform(0.0, 6.28)};
  std::array<std::vector<TimedPose>, 2> streams;
  for (std::size_t which = 0; which < 2; ++which) {
    const double rate = which == 0 ? c.firstHz : c.secondHz;
    const Eigen::Matrix3d mount = ExpRotation(static_cast<double>(which) * Vector3d(0.3, 2.0, -0.7));
    for (double time = 0.0; time < c.seconds; time += 1.0 / rate) {
      const double jittered = time + random.Uniform(-0.2, 0.2) / rate;
      Vector3d turn = Vector3d::Zero();
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (const Wave& wave : waves[axis])
          turn[static_cast<Eigen::Index>(axis)] +=
              wave.size * std::sin(6.283185307179586 * wave.frequency * jittered + wave.phase);
      Pose pose = Pose::Identity();
      pose.linear() = ExpRotation(turn) * mount *
                      ExpRotation(c.degrees / DegreesPerRadian * Vector3d(random.Normal(), random.Normal(), random.Normal()));
      streams[which].push_back({jittered - (which == 0 ? 0.0 : Offset), pose});
    }
  }
  return streams;
}

// Speeds at the middles between poses, then on an even grid by straight lines.
std::vector<double> PlainSpeed(const std::vector<TimedPose>& poses, double start, double step, std::size_t count)
{
  std::vector<double> times, speeds, even(count, 0.0);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    times.push_back(0.5 * (poses[i - 1].time + poses[i].time));
    speeds.push_back(LogRotation(poses[i - 1].pose.linear().transpose() * poses[i].pose.linear()).norm() /
                     (poses[i].time - poses[i - 1].time));
  }
  std::size_t k = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double time = start + step * static_cast<double>(i);
    while (k + 2 < times.size() && times[k + 1] < time)
      ++k;
    const double t = std::min(1.0, std::max(0.0, (time - times[k]) / (times[k + 1] - times[k])));
    even[i] = (1.0 - t) * speeds[k] + t * speeds[k + 1];
  }
  return even;
}

double PlainOffset(const std::vector<TimedPose>& first, const std::vector<TimedPose>& second, double rate)
{
  const double start = std::max(first.front().time, second.front().time), end = std::min(first.back().time, second.back().time);
  const std::size_t count = static_cast<std::size_t>((end - start) * rate);
  std::vector<double> a = PlainSpeed(first, start, 1.0 / rate, count), b = PlainSpeed(second, start, 1.0 / rate, count);
  for (std::vector<double>* values : {&a, &b}) {
    double mean = 0.0;
    for (const double value : *values)
      mean += value / static_cast<double>(count);
    for (double& value : *values)
      value -= mean;
  }
  const int most = static_cast<int>(5.0 * rate);
  double best = -1.0, offset = 0.0;
  for (int lag = -most; lag <= most; ++lag) {
    double sum = 0.0;
    for (int i = std::max(0, lag); i < static_cast<int>(count) + std::min(0, lag); ++i)
      sum += a[static_cast<std::size_t>(i)] * b[static_cast<std::size_t>(i - lag)];
    if (sum > best) {
      best = sum;
      offset = lag / rate;
    }
  }
  return offset;
}

} // namespace

int main()
{
  for (const Case& c : {Case{"30 s at 60 and 37 Hz, noise 0.05 deg", 30.0, 60.0, 37.0, 0.05},
                        Case{"30 s at 60 and 37 Hz, noise 0.25 deg", 30.0, 60.0, 37.0, 0.25},
                        Case{"120 s at 60 and 37 Hz, noise 0.25 deg", 120.0, 60.0, 37.0, 0.25},
                        Case{"30 s at 20 and 15 Hz, noise 0.25 deg", 30.0, 20.0, 15.0, 0.25}}) {
    double ours = 0.0, stated = 0.0, plain = 0.0;
    int held = 0, answered = 0;
    for (int trial = 0; trial < Trials; ++trial) {
      const auto streams = Recorded(c, static_cast<std::uint64_t>(trial));
      plain += std::pow(PlainOffset(streams[0], streams[1], std::max(c.firstHz, c.secondHz)) - Offset, 2);
      try {
        const TemporalResult result = CalibrateTime(streams[0], streams[1]);
        const double error = result.offsetSeconds - Offset;
        ours += error * error;
        stated += result.standardErrorSeconds * result.standardErrorSeconds;
        held += std::fabs(error) <= 1.96 * result.standardErrorSeconds;
        ++answered;
      } catch (const Error&) { // counted below
      }
    }
    const auto streams = Recorded(c, 1);
    const auto [oursSeconds, plainSeconds] =
        benchmark::Duel([&] { CalibrateTime(streams[0], streams[1]); },
                        [&] { PlainOffset(streams[0], streams[1], std::max(c.firstHz, c.secondHz)); }, 5);
    const double count = std::max(1, answered);
    benchmark::Report(
        "temporal", c.name, "ours", oursSeconds, 1e3 * std::sqrt(ours / count), "ms",
        {{"trials", Trials}, {"stated", 1e3 * std::sqrt(stated / count)}, {"held", held / count}, {"answered", answered}});
    benchmark::Report("temporal", c.name, "differences and correlation", plainSeconds, 1e3 * std::sqrt(plain / Trials), "ms",
                      {{"trials", Trials}});
  }
}
