// SPDX-License-Identifier: BSD-3-Clause
// The state is small: heading, its rate, and how the probe is held aside, h. Seen from above, normal and axis of the probe point
// somewhere; the angle between them is what is wrong with the heading, plus h. The probe's axis being within so many degrees of
// the normal, h has a standard deviation of that over the sine of the angle to the vertical. So the equation is linear in the
// state, with constant factors.
//
// Two ways that seem to say more are traps. To take both angles between normal and axis, in the probe's frame: the derivative by
// the heading then turns with the heading that is estimated, and a filter that believes it takes its own errors for motion; it
// ran away by 100 degrees in a minute of the tests. And to let h keep its distance instead of its angle while the sine changes:
// that weighs the same error with two factors, and claims twice the accuracy that is there. Near the top, nothing is used: the
// direction of what points up is noise.
//
// Samples of the surface wait until the IMU has passed their time, so that both are of one moment.
#include "Tracking/Stream/SurfacePoseFilter.h"
#include "Core/Base/Angles.h"
#include "Core/Base/CheckRange.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

using Eigen::Quaterniond, Eigen::Vector3d;

constexpr double keptSeconds = 10.0, velocitySeconds = 0.05, shortestSlideMm = 10.0;
constexpr double leastJumpSeconds = 1.0; // of a clock
constexpr double leastLying = 0.5;       // sine of the angle to the vertical

double Squared(double x)
{
  return x * x;
}

// The samples around a moment, and where between them it lies: beyond 1 after the newest. \returns whether it is covered.
template <class Samples>
bool FindSamples(const Samples& samples, double time, double gap, double prediction, std::size_t& a, std::size_t& b, double& part)
{
  if (samples.empty() || !(time >= samples.front().time) || !(time <= samples.back().time + prediction))
    return false;
  const auto later =
      std::lower_bound(samples.begin(), samples.end(), time, [](const auto& sample, double t) { return sample.time < t; });
  if (later != samples.end()) {
    b = static_cast<std::size_t>(later - samples.begin());
    a = samples[b].time == time ? b : b - 1;
    if (samples[b].time - samples[a].time > gap)
      return false;
  } else {
    // Velocity from some time back: that between neighbours is mostly noise.
    b = a = samples.size() - 1;
    while (a > 0 && samples[b].time - samples[a].time < velocitySeconds && samples[a].time - samples[a - 1].time <= gap)
      --a;
  }
  part = a == b ? 0.0 : (time - samples[a].time) / (samples[b].time - samples[a].time);
  return true;
}

template <class Samples>
void Forget(Samples& samples)
{
  while (samples.back().time - samples.front().time > keptSeconds)
    samples.pop_front();
}

} // namespace

ParameterList Describe(SurfacePoseParameters& p)
{
  return {
      Parameter("SurfaceDelay", p.surfaceDelay, {-10, 10}, "s", "How late the surface tracker's time stamps are."),
      Parameter("ImuDelay", p.imuDelay, {-10, 10}, "s", "How late the IMU's time stamps are."),
      Parameter("Up", p.up, {-1e6, 1e6}, "", "Direction against gravity, in the world."),
      Parameter("DriftDegreesPerMinute", p.driftDegreesPerMinute, {0, 1000}, "degrees/min",
                "Standard deviation of the drift of the IMU's heading."),
      Parameter("DriftChange", p.driftChange, {0, 1000}, "degrees/min", "By how much that drift changes in a minute.").Advanced(),
      Parameter("HeadingNoise", p.headingNoise, {0, 100}, "degrees", "By how much the heading wanders in a second.").Advanced(),
      Parameter("NormalDegrees", p.normalDegrees, {0.01, 45}, "degrees", "Noise of the surface's normal.").Advanced(),
      Parameter("HeldDegrees", p.heldDegrees, {0.1, 60}, "degrees", "How far the probe is held from the surface's normal."),
      Parameter("HeldSeconds", p.heldSeconds, {0.01, 1000}, "s", "For how long it is held the same way.").Advanced(),
      Parameter("LongestGap", p.longestGap, {0.001, 10}, "s", "Silence of a stream that is bridged.").Advanced(),
      Parameter("LongestPrediction", p.longestPrediction, {0, 1}, "s", "How far poses are predicted at constant velocity.")
          .Advanced(),
  };
}

SurfacePoseFilter::SurfacePoseFilter(const SurfacePoseParameters& parameters, const Eigen::Matrix3d& sensorToProbe)
  : parameters_(parameters)
{
  CheckRanges(parameters);
  if (!(parameters.up.norm() > 1e-9))
    throw Error(Error::Kind::InvalidParameter, "Up has no length");
  if (!sensorToProbe.allFinite() || !IsRotation(sensorToProbe))
    throw Error(Error::Kind::BadInput, "how the IMU is mounted is no rotation");
  up_ = parameters.up.normalized();
  probeToSensor_ = Quaterniond(sensorToProbe).inverse();
  imuWorldToLevel_ = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), up_);
  const double drift = parameters.driftDegreesPerMinute * RadiansPerDegree / 60.0;
  covariance_.diagonal() << Squared(Pi), Squared(drift), 0.0;
}

// Puts what can be believed to the end of what has come. \returns how many samples that are
template <class Sample>
std::size_t SurfacePoseFilter::Take(std::deque<Sample>& samples, std::optional<Sample>& odd, const Sample& sample,
                                    const char* stream)
{
  const auto refuse = [stream](const char* why) {
    throw Error(Error::Kind::BadInput, std::string(stream) + ": the time stamp is " + why);
  };
  if (!std::isfinite(sample.time))
    refuse("not finite");
  const double far = std::max(leastJumpSeconds, 2.0 * parameters_.longestGap);
  std::size_t taken = 1;
  if (!samples.empty() && std::abs(sample.time - samples.back().time) > far) {
    if (!odd || !(sample.time > odd->time) || sample.time - odd->time > far) {
      odd = sample;
      ++statistics_.odd;
      return 0;
    }
    if (odd->time < samples.back().time) {
      // How long it is since then, nobody knows: the state goes on from here.
      samples.clear();
      time_.reset();
      ++statistics_.jumps;
    }
    samples.push_back(*odd);
    taken = 2;
  } else if (!samples.empty() && !(sample.time > samples.back().time)) {
    refuse("not later than the last");
  }
  odd.reset();
  samples.push_back(sample);
  Forget(samples);
  return std::min(taken, samples.size());
}

void SurfacePoseFilter::AddSurface(double stamp, const Vector3d& point, const std::optional<Vector3d>& normal)
{
  if (!point.allFinite() || (normal && (!normal->allFinite() || !(normal->norm() > 1e-9))))
    throw Error(Error::Kind::BadInput, "the surface tracker: the place or the normal is not finite, or the normal has no length");
  const SurfaceSample sample{stamp - parameters_.surfaceDelay, point, normal ? normal->normalized() : Vector3d(Vector3d::Zero())};
  const std::uint64_t jumps = statistics_.jumps;
  const std::size_t taken = Take(surface_, oddSurface_, sample, "the surface tracker");
  if (taken == 0)
    return;
  if (statistics_.jumps != jumps)
    waiting_.clear();
  waiting_.insert(waiting_.end(), surface_.end() - static_cast<std::ptrdiff_t>(taken), surface_.end());
  Forget(waiting_); // when the IMU has died
  statistics_.surface += taken;
  Update();
}

void SurfacePoseFilter::AddImu(double stamp, const Quaterniond& sensorToImuWorld)
{
  if (!sensorToImuWorld.coeffs().allFinite() || std::abs(sensorToImuWorld.norm() - 1.0) > 1e-3)
    throw Error(Error::Kind::BadInput, "the IMU: the quaternion is not finite, or not of length 1");
  const ImuSample sample{stamp - parameters_.imuDelay, imuWorldToLevel_ * sensorToImuWorld.normalized() * probeToSensor_};
  statistics_.imu += Take(imu_, oddImu_, sample, "the IMU");
  Update();
}

Quaterniond SurfacePoseFilter::WithHeading(const Quaterniond& probeToLevel, double heading) const
{
  return Eigen::AngleAxisd(heading, up_) * probeToLevel;
}

std::optional<Quaterniond> SurfacePoseFilter::ImuAt(double time, bool predict) const
{
  std::size_t a = 0, b = 0;
  double part = 0.0;
  if (!FindSamples(imu_, time, parameters_.longestGap, predict ? parameters_.longestPrediction : 0.0, a, b, part))
    return std::nullopt;
  Quaterniond turn = imu_[a].probeToLevel.inverse() * imu_[b].probeToLevel;
  if (turn.w() < 0.0)
    turn.coeffs() = -turn.coeffs();
  return imu_[a].probeToLevel * Quaterniond(ExpRotation(part * LogRotation(turn.toRotationMatrix())));
}

std::optional<Vector3d> SurfacePoseFilter::PointAt(double time, bool predict) const
{
  std::size_t a = 0, b = 0;
  double part = 0.0;
  if (!FindSamples(surface_, time, parameters_.longestGap, predict ? parameters_.longestPrediction : 0.0, a, b, part))
    return std::nullopt;
  return Vector3d((1.0 - part) * surface_[a].point + part * surface_[b].point);
}

void SurfacePoseFilter::Update()
{
  while (!waiting_.empty() && !imu_.empty() && waiting_.front().time <= imu_.back().time) {
    const SurfaceSample sample = waiting_.front();
    waiting_.pop_front();
    const auto turned = ImuAt(sample.time, false);
    if (!turned) {
      ++statistics_.gaps;
      continue;
    }
    Propagate(sample.time);
    // Before an alignment, the heading may be anything, and a linear filter knows nothing of that.
    if (aligned_)
      UseNormal(*turned, sample.normal);
  }
}

void SurfacePoseFilter::Propagate(double time)
{
  const double seconds = time_ ? time - *time_ : 0.0;
  if (time_ && !(seconds > 0.0))
    return;
  time_ = time;
  const double kept = std::exp(-seconds / parameters_.heldSeconds), degree = RadiansPerDegree;
  Eigen::Matrix3d change = Eigen::Matrix3d::Identity();
  change(0, 1) = seconds;
  change(2, 2) = kept;
  state_ = change * state_;
  covariance_ = change * covariance_ * change.transpose();
  const double rate = Squared(parameters_.driftChange * degree / 60.0) / 60.0; // per second
  const double held = Squared(held_) * (1.0 - kept * kept);
  covariance_(0, 0) += Squared(parameters_.headingNoise * degree) * seconds + rate * std::pow(seconds, 3) / 3.0;
  covariance_(0, 1) += 0.5 * rate * Squared(seconds);
  covariance_(1, 0) = covariance_(0, 1);
  covariance_(1, 1) += rate * seconds;
  covariance_(2, 2) += held;
  if (!aligned_)
    covariance_(0, 0) = Squared(Pi);
}

void SurfacePoseFilter::UseNormal(const Quaterniond& probeToLevel, const Vector3d& normal)
{
  const Vector3d axis = WithHeading(probeToLevel, state_[0]) * Vector3d::UnitZ();
  const Vector3d is = axis - axis.dot(up_) * up_, wanted = normal.dot(up_) * up_ - normal; // both lie level
  const double axisLying = is.norm(), normalLying = wanted.norm();
  if (std::min(axisLying, normalLying) < leastLying)
    return;
  // How far aside the probe may be held, as an angle about the vertical. Where that grows, what was known of it is no more.
  const double held = parameters_.heldDegrees * RadiansPerDegree / std::min(axisLying, normalLying);
  covariance_(2, 2) += std::max(Squared(held) - Squared(held_), 0.0);
  held_ = held;
  const double turn = std::atan2(is.cross(wanted).dot(up_), is.dot(wanted));
  const double noise = Squared(parameters_.normalDegrees * RadiansPerDegree / normalLying);
  const double nis = Correct(Eigen::RowVector3d(1.0, 0.0, 1.0), turn - state_[2], noise);
  ++statistics_.updates;
  statistics_.meanNis += (nis - statistics_.meanNis) / static_cast<double>(statistics_.updates);
}

// With one number that is measured. In Joseph's form, which keeps the covariance symmetric.
double SurfacePoseFilter::Correct(const Eigen::RowVector3d& model, double innovation, double noise)
{
  const Eigen::Vector3d cross = covariance_ * model.transpose();
  const double expected = model.dot(cross) + noise;
  const Eigen::Vector3d gain = cross / expected;
  state_ += gain * innovation;
  const Eigen::Matrix3d rest = Eigen::Matrix3d::Identity() - gain * model;
  covariance_ = (rest * covariance_ * rest.transpose() + noise * gain * gain.transpose()).eval();
  return Squared(innovation) / expected;
}

bool SurfacePoseFilter::Align(double time, const Vector3d& direction, double sigmaDegrees)
{
  CheckRange("SigmaDegrees", sigmaDegrees, 0.01, 90.0);
  if (!std::isfinite(time) || !direction.allFinite())
    throw Error(Error::Kind::InvalidParameter, "the time or the direction of an alignment is not finite");
  const auto turned = ImuAt(time, false);
  if (!turned)
    return false;
  const Vector3d wanted = direction - direction.dot(up_) * up_;
  const auto lying = [this](const Vector3d& array) -> Vector3d { return array - array.dot(up_) * up_; };
  if (!(lying(*turned * Vector3d::UnitX()).norm() > 0.2) || !(wanted.norm() > 0.2 * direction.norm()))
    return false;
  Propagate(time);
  const Vector3d is = lying(WithHeading(*turned, state_[0]) * Vector3d::UnitX());
  const double error = std::atan2(is.cross(wanted).dot(up_), is.dot(wanted));
  const double noise = Squared(sigmaDegrees * RadiansPerDegree);
  if (!aligned_) {
    // Nothing was known: the answer is taken as it is.
    state_[0] += error;
    covariance_.row(0).setZero();
    covariance_.col(0).setZero();
    covariance_(0, 0) = noise;
    aligned_ = true;
    return true;
  }
  Correct(Eigen::RowVector3d(1.0, 0.0, 0.0), error, noise);
  return true;
}

bool SurfacePoseFilter::AlignBySlide(double from, double to, double sigmaDegrees)
{
  const auto begin = PointAt(from, false), end = PointAt(to, false);
  return begin && end && (*end - *begin).norm() >= shortestSlideMm && Align(to, *end - *begin, sigmaDegrees);
}

std::optional<SurfacePose> SurfacePoseFilter::At(double time) const
{
  const auto turned = ImuAt(time, true);
  const auto point = PointAt(time, true);
  if (!turned || !point)
    return std::nullopt;
  SurfacePose pose;
  pose.time = time;
  pose.isPredicted = time > imu_.back().time || time > surface_.back().time;
  pose.headingSigma = HeadingSigma();
  // The heading goes on at its rate from the moment of the state, also backwards.
  const double heading = state_[0] + (time_ ? state_[1] * (time - *time_) : 0.0);
  pose.probeToWorld.linear() = WithHeading(*turned, heading).toRotationMatrix();
  pose.probeToWorld.translation() = *point;
  return pose;
}

std::optional<SurfacePose> SurfacePoseFilter::Newest() const
{
  if (imu_.empty() || surface_.empty())
    return std::nullopt;
  return At(std::min(imu_.back().time, surface_.back().time));
}

double SurfacePoseFilter::HeadingSigma() const
{
  return std::min(std::sqrt(covariance_(0, 0)), Pi);
}

double SurfacePoseFilter::DriftDegreesPerMinute() const
{
  return state_[1] * 60.0 * DegreesPerRadian;
}

} // namespace echorama
