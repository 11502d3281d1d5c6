// SPDX-License-Identifier: BSD-3-Clause
// Each track is a Kalman filter of constant velocity; a spot goes to the track that expects it nearest, in standard deviations,
// if it is near at all. A light that is off where its code says so is still followed.
//
// Identity: a track remembers the brightness of one and a half periods, 0 where it was not seen. While the phase is unknown all
// phases are tried; it is taken when two tracks, or one track twice, agree on it, and followed from then on (clocks drift). With
// it only as many hypotheses as lights are left. What goes on speaking against an identity revokes it. When a spot could belong
// to two tracks, neither is anybody's until its blinking since then has told them apart: their memories are emptied.
//
// No light is off for more than two frames, so one that was not seen in three has gone. Frames that never came do not count.
#include "SpotTracks.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <cmath>
#include <Eigen/LU>
#include <tuple>

namespace echorama {

ParameterList Describe(SpotTracksParameters& p)
{
  return {
      Parameter("FrameMs", p.frameMs, {0.1, 1000}, "ms", "From a frame to the next."),
      Parameter("ExposureMs", p.exposureMs, {0.01, 1000}, "ms", "How long a row takes light."),
      Parameter("RowUs", p.rowUs, {0, 1000}, "us", "How much later each row begins: 0 is a global shutter."),
      Parameter("SlotMs", p.slotMs, {0.1, 1000}, "ms", "How long a light stays on or off at least."),
      Parameter("LatencyMs", p.latencyMs, {0, 1000}, "ms", "How far ahead positions are predicted."),
      Parameter("Acceleration", p.acceleration, {1, 1e7}, "px/s^2", "Of a hand, as the camera sees it: its standard deviation.")
          .Advanced(),
      Parameter("MaximumSpeed", p.maximumSpeed, {1, 1e6}, "px/s", "Nothing that is faster is followed.").Advanced(),
      Parameter("Triggered", p.triggered, "The lights' driver triggers the camera: slot 0 begins with the exposure at time 0.")
          .Advanced(),
  };
}

namespace {

constexpr double Gate = 20.0;       // squared standard deviations
constexpr double Doubt = 16.0;      // the same: a second track that is as near as this, and no more further than the first
constexpr double ModelSigma = 0.05; // px: what positions lack beyond their own noise
constexpr double IdentifyLimit = 0.15;
constexpr double RevokeLimit = 0.4;
constexpr double DarkShare = 0.1;      // less than this of the exposure is off
constexpr double Unexpected = 9.0;     // what it costs a track to be given a spot while its light is off
constexpr std::size_t LeastSeen = 5;   // frames before an identity, with the phase known
constexpr std::size_t Established = 3; // times seen
constexpr int LostAfter = 3;           // frames
constexpr std::size_t Remembered = 32; // states, for the statistics
constexpr std::size_t TrackLimit = 64;

double Wrapped(double phase, double period)
{
  return phase - period * std::floor(phase / period);
}

// In (-period / 2, period / 2].
double Between(double a, double b, double period)
{
  return Wrapped(a - b + 0.5 * period, period) - 0.5 * period;
}

} // namespace

SpotTracks::SpotTracks(const SpotTracksParameters& parameters, BlinkCode code)
  : parameters_(parameters), code_(std::move(code)), timing_{parameters.slotMs * 1e-3, parameters.exposureMs * 1e-3},
    rowSeconds_(parameters.rowUs * 1e-6)
{
  CheckRanges(parameters);
  if (code_.NeedsTrigger() && !parameters.triggered)
    throw Error(Error::Kind::InvalidParameter,
                "lights that take turns can only be told apart by a camera that is triggered by their driver; use a blink code");
  if (parameters.exposureMs > parameters.frameMs)
    throw Error(Error::Kind::InvalidParameter, "the exposure, " + NumberText(parameters.exposureMs) +
                                                   " ms, is longer than a frame, " + NumberText(parameters.frameMs) + " ms");
  const double period = code_.Length() * parameters.slotMs / parameters.frameMs; // in frames
  if (!(period > 1.5 && period < 200.0))
    throw Error(Error::Kind::InvalidParameter, "a slot must last about as long as a frame");
  window_ = static_cast<std::size_t>(std::ceil(1.5 * period));
  if (parameters.triggered)
    phase_ = 0.0;
  lights_.resize(static_cast<std::size_t>(code_.Lights()));
  for (std::size_t i = 0; i < lights_.size(); ++i)
    lights_[i].light = static_cast<int>(i);
}

void SpotTracks::Move(Motion& motion, double time) const
{
  const double t = time - motion.time;
  Eigen::Matrix4d step = Eigen::Matrix4d::Identity();
  step(0, 2) = step(1, 3) = t;
  motion.state = step * motion.state;
  motion.covariance = step * motion.covariance * step.transpose();
  const double power = parameters_.acceleration * parameters_.acceleration * parameters_.frameMs * 1e-3; // of white acceleration
  const double a = std::abs(t);
  for (int axis = 0; axis < 2; ++axis) {
    motion.covariance(axis, axis) += power * a * a * a / 3.0;
    motion.covariance(axis, axis + 2) += power * a * a / 2.0;
    motion.covariance(axis + 2, axis) += power * a * a / 2.0;
    motion.covariance(axis + 2, axis + 2) += power * a;
  }
  motion.time = time;
}

SpotTracks::Motion SpotTracks::Moved(const Motion& motion, double time) const
{
  Motion moved = motion;
  Move(moved, time);
  return moved;
}

void SpotTracks::Correct(Track& track, const Spot& spot, double time)
{
  // How well it would have been foretold: from the newest state that the latency would have allowed.
  const double known = time - parameters_.latencyMs * 1e-3;
  for (auto past = track.past.rbegin(); track.light >= 0 && past != track.past.rend(); ++past)
    if (past->first <= known) {
      if (known - past->first > 1e-3 * parameters_.frameMs)
        break; // it was not seen then
      const Eigen::Vector2d from = past->second.head<2>(), ahead = from + (time - past->first) * past->second.tail<2>();
      predictionSquares_ += (ahead - spot.position).squaredNorm();
      holdSquares_ += (from - spot.position).squaredNorm();
      ++statistics_.predictions;
      break;
    }

  Move(track, time);
  const Eigen::Matrix2d noise = spot.covariance + Eigen::Matrix2d::Identity() * ModelSigma * ModelSigma;
  const Eigen::Matrix2d innovation = track.covariance.topLeftCorner<2, 2>() + noise;
  const Eigen::Matrix<double, 4, 2> gain = track.covariance.leftCols<2>() * innovation.inverse();
  track.state += gain * (spot.position - track.state.head<2>());
  const Eigen::Matrix4d rest = track.covariance - gain * track.covariance.topRows<2>();
  track.covariance = 0.5 * (rest + rest.transpose());
  track.spot = spot;
  track.lastSeen = time;
  track.past.emplace_back(time, track.state);
  if (track.past.size() > Remembered)
    track.past.pop_front();
}

double SpotTracks::ExpectedShare(const Track& track, double time, double row) const
{
  if (track.light < 0 || !phase_)
    return 1.0;
  const double from = (RowTime(time, row) - *phase_) / timing_.slot;
  return code_.OnShare(track.light, from, from + timing_.exposure / timing_.slot);
}

void SpotTracks::Assign(double time, const std::vector<Spot>& spots)
{
  struct Pair {
    double cost, distance;
    std::size_t track, spot;
  };
  std::vector<Pair> pairs;
  const double half = 0.5 * timing_.exposure;
  for (std::size_t t = 0; t < tracks_.size(); ++t)
    for (std::size_t s = 0; s < spots.size(); ++s) {
      const double when = RowTime(time, spots[s].position.y()) + half;
      const Motion moved = Moved(tracks_[t], when);
      const Eigen::Vector2d off = spots[s].position - moved.state.head<2>();
      const double reach = parameters_.maximumSpeed * (when - tracks_[t].lastSeen) + 2.0;
      if ((spots[s].position - tracks_[t].spot.position).norm() > reach)
        continue;
      const Eigen::Matrix2d spread =
          moved.covariance.topLeftCorner<2, 2>() + spots[s].covariance + Eigen::Matrix2d::Identity() * 0.25;
      const double distance = off.dot(spread.inverse() * off);
      if (distance > Gate)
        continue;
      const bool isOff = ExpectedShare(tracks_[t], time, spots[s].position.y()) < DarkShare;
      pairs.push_back({distance + (isOff ? Unexpected : 0.0), distance, t, s});
    }
  std::sort(pairs.begin(), pairs.end(),
            [](const Pair& a, const Pair& b) { return std::tie(a.cost, a.track, a.spot) < std::tie(b.cost, b.track, b.spot); });

  std::vector<int> spotOf(tracks_.size(), -1), trackOf(spots.size(), -1);
  for (const Pair& pair : pairs)
    if (spotOf[pair.track] < 0 && trackOf[pair.spot] < 0) {
      spotOf[pair.track] = static_cast<int>(pair.spot);
      trackOf[pair.spot] = static_cast<int>(pair.track);
    }
  // A spot that another track might as well have had.
  std::vector<bool> doubted(tracks_.size(), false);
  for (const Pair& other : pairs) {
    const int taker = trackOf[other.spot];
    if (taker < 0 || taker == static_cast<int>(other.track))
      continue;
    const auto taken = std::find_if(pairs.begin(), pairs.end(),
                                    [&](const Pair& p) { return p.spot == other.spot && static_cast<int>(p.track) == taker; });
    if (tracks_[other.track].light < 0 && tracks_[other.track].past.size() < Established)
      continue; // a sparkle that was here a moment ago
    if (other.distance < taken->distance + Doubt)
      doubted[other.track] = doubted[static_cast<std::size_t>(taker)] = true;
  }

  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    Track& track = tracks_[t];
    if (doubted[t]) {
      statistics_.doubted += track.light >= 0;
      track.light = -1;
      track.seen.clear();
    }
    if (spotOf[t] >= 0) {
      const Spot& spot = spots[static_cast<std::size_t>(spotOf[t])];
      Correct(track, spot, RowTime(time, spot.position.y()) + half);
      track.unseen = 0;
      if (!doubted[t])
        track.seen.push_back({RowTime(time, spot.position.y()), spot.Brightness()});
    } else {
      ++track.unseen;
      const double row = track.state.y();
      Move(track, RowTime(time, row) + half);
      if (!doubted[t])
        track.seen.push_back({RowTime(time, row), 0.0});
    }
    if (track.seen.size() > window_)
      track.seen.erase(track.seen.begin());
  }
  tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(), [](const Track& t) { return t.unseen >= LostAfter; }),
                tracks_.end());

  for (std::size_t s = 0; s < spots.size(); ++s) {
    if (trackOf[s] >= 0 || tracks_.size() >= TrackLimit)
      continue;
    Track track;
    track.state << spots[s].position, 0.0, 0.0;
    track.covariance.topLeftCorner<2, 2>() = spots[s].covariance + Eigen::Matrix2d::Identity() * ModelSigma * ModelSigma;
    const double speed = 0.35 * parameters_.maximumSpeed;
    track.covariance(2, 2) = track.covariance(3, 3) = speed * speed;
    track.time = track.lastSeen = RowTime(time, spots[s].position.y()) + half;
    track.spot = spots[s];
    track.seen.push_back({RowTime(time, spots[s].position.y()), spots[s].Brightness()});
    track.past.emplace_back(track.time, track.state);
    tracks_.push_back(std::move(track));
  }
}

void SpotTracks::Identify(Track& track)
{
  const double period = code_.Length() * timing_.slot;
  if (track.light >= 0) {
    // Another light explains it better, or nothing does.
    const BlinkMatch match = MatchBlink(code_, timing_, track.seen, phase_, 1.0);
    const double own = BlinkResidual(code_, timing_, track.seen, track.light, *phase_);
    if (own > RevokeLimit || (match.light >= 0 && match.light != track.light)) {
      ++statistics_.revoked;
      track.light = -1;
      track.seen.clear();
    }
    return;
  }
  if (track.unseen > 0 && track.seen.size() < LeastSeen)
    return;
  if (phase_) {
    if (track.seen.size() < std::min<std::size_t>(LeastSeen, window_))
      return;
    const BlinkMatch match = MatchBlink(code_, timing_, track.seen, phase_, IdentifyLimit);
    if (match.light >= 0) {
      for (Track& other : tracks_)
        if (&other != &track && other.light == match.light) { // one of both is a mirror image, or has been exchanged
          other.light = -1;
          other.seen.clear();
          track.seen.clear();
          ++statistics_.revoked;
          return;
        }
      track.light = match.light;
      ++statistics_.identified;
      return;
    }
    if (parameters_.triggered || track.seen.size() < window_ ||
        std::any_of(tracks_.begin(), tracks_.end(), [](const Track& t) { return t.light >= 0; }))
      return;
  }
  // The phase is not known, or no more true.
  if (static_cast<double>(track.seen.size()) * parameters_.frameMs * 1e-3 < period)
    return;
  const BlinkMatch match = MatchBlink(code_, timing_, track.seen, std::nullopt, IdentifyLimit);
  if (match.light < 0)
    return;
  if (phaseVotes_ > 0 && std::abs(Between(match.phase, phaseCandidate_, period)) < 0.6 * timing_.slot)
    ++phaseVotes_;
  else
    phaseVotes_ = 1;
  phaseCandidate_ = match.phase;
  if (phaseVotes_ >= 3) {
    phase_ = match.phase;
    phaseVotes_ = 0;
  }
}

void SpotTracks::RefinePhase()
{
  if (!phase_ || parameters_.triggered)
    return;
  // Where exposures lie within slots, phases that differ by what is left of a slot explain the same: so one looks further than
  // that, too.
  const double period = code_.Length() * timing_.slot;
  const auto residualAt = [&](double phase) {
    double sum = 0.0;
    for (const Track& track : tracks_)
      if (track.light >= 0 && track.seen.size() >= window_)
        sum += BlinkResidual(code_, timing_, track.seen, track.light, phase);
    return sum;
  };
  double least = residualAt(*phase_) - 1e-4, best = 0.0;
  for (const double step : {-0.3, -0.1, 0.1, 0.3}) {
    const double residual = residualAt(*phase_ + step * timing_.slot);
    if (residual < least) {
      least = residual;
      best = step;
    }
  }
  phase_ = Wrapped(*phase_ + 0.2 * best * timing_.slot, period);
}

void SpotTracks::Report(double time)
{
  for (TrackedLight& light : lights_) {
    light.status = TrackedLight::Status::Lost;
    for (const Track& track : tracks_) {
      if (track.light != light.light)
        continue;
      light.status = track.unseen == 0 ? TrackedLight::Status::Seen : TrackedLight::Status::Predicted;
      light.time = track.time;
      light.position = track.state.head<2>();
      light.velocity = track.state.tail<2>();
      light.covariance = track.covariance.topLeftCorner<2, 2>();
      light.spot = track.spot;
      const Motion ahead = Moved(track, RowTime(time, track.state.y()) + 0.5 * timing_.exposure + parameters_.latencyMs * 1e-3);
      light.predicted = ahead.state.head<2>();
      light.predictedCovariance = ahead.covariance.topLeftCorner<2, 2>();
    }
  }
}

const std::vector<TrackedLight>& SpotTracks::Update(double time, const std::vector<Spot>& spots, bool isBlind)
{
  if (!std::isfinite(time) || (lastTime_ && time <= *lastTime_))
    throw Error(Error::Kind::BadInput, "the time of a frame, " + NumberText(time) + " s, is not after that of the one before");
  // After a long pause nothing is where it was.
  if (lastTime_ && time - *lastTime_ > 5e-3 * parameters_.frameMs)
    tracks_.clear();
  lastTime_ = time;
  ++statistics_.frames;
  if (isBlind) {
    ++statistics_.blindFrames;
    for (Track& track : tracks_)
      ++track.unseen;
    tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(), [](const Track& t) { return t.unseen >= LostAfter; }),
                  tracks_.end());
  } else {
    Assign(time, spots);
    for (Track& track : tracks_)
      Identify(track);
    RefinePhase();
  }
  Report(time);
  if (statistics_.predictions > 0) {
    statistics_.predictionRms = std::sqrt(predictionSquares_ / static_cast<double>(statistics_.predictions));
    statistics_.holdRms = std::sqrt(holdSquares_ / static_cast<double>(statistics_.predictions));
  }
  return lights_;
}

std::optional<Eigen::Vector2d> SpotTracks::Predict(int light, double time) const
{
  for (const Track& track : tracks_)
    if (track.light == light && light >= 0)
      return Eigen::Vector2d(track.state.head<2>() + (time - track.time) * track.state.tail<2>());
  return std::nullopt;
}

std::vector<std::pair<int, int>> SpotTracks::DarkRows(double time, int height) const
{
  std::vector<std::pair<int, int>> rows;
  if (!phase_ || code_.OffSlots() == 0)
    return rows;
  // Edges of slots are only known to a tenth of a slot.
  const double margin = parameters_.triggered ? 0.0 : 0.1;
  const double exposure = timing_.exposure / timing_.slot;
  const auto isDark = [&](int row) {
    const double from = (RowTime(time, row) - *phase_) / timing_.slot;
    for (int light = 0; light < code_.Lights(); ++light)
      if (code_.OnShare(light, from - margin, from + exposure + margin) > 1e-9)
        return false;
    return true;
  };
  if (rowSeconds_ == 0.0) {
    if (isDark(0))
      rows.emplace_back(0, height);
    return rows;
  }
  for (int row = 0; row < height; ++row) {
    if (!isDark(row))
      continue;
    if (rows.empty() || rows.back().second != row)
      rows.emplace_back(row, row);
    rows.back().second = row + 1;
  }
  return rows;
}

} // namespace echorama
