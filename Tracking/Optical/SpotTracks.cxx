// SPDX-License-Identifier: BSD-3-Clause
// Each track is a Kalman filter of a hand's motion. A spot goes to the track that expects it nearest, in standard deviations, if
// it is near at all.
//
// Lights that are known explain the spots first (SpotTracksTogether.cxx); what is left goes to tracks that are nobody's as yet.
//
// Identity: a track remembers the brightness of one and a half periods, 0 where it was not seen. While the phase is unknown all
// phases are tried; it is taken when two tracks, or one track twice, agree on it, and followed from then on (clocks drift). With
// it only as many hypotheses as lights are left. What goes on speaking against an identity revokes it. When a spot could belong
// to two of them, or one becomes two, their memories are emptied.
//
// No light is off for more than two frames, so one that was not seen in three has gone. Frames that never came do not count.
#include "SpotTracks.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <cmath>
#include <Eigen/LU>
#include <tuple>
#include <utility>

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

constexpr double IdentifyLimit = 0.15;
constexpr double RevokeLimit = 0.4, RevokeMixture = 0.5;
constexpr double LongerBy = 0.08;      // a light's spot does not become longer by this in a frame or two
constexpr double NobodysDoubt = 0.2;   // of the place of a spot that is nobody's, over its size
constexpr double LargestDoubt = 0.5;   // standard deviation of a place that is not seen, over the size: for a claim,
constexpr double NoPlace = 1.0;        // for an identity, which then has to be proven anew,
constexpr double LostPlace = 3.0;      // and to be followed
constexpr double PartReach = 5.0;      // sizes: how far from each other two may be that were one in the frame before
constexpr std::size_t LeastSeen = 5;   // frames before an identity, with the phase known
constexpr std::size_t Established = 3; // times seen
constexpr int SeenForSpeed = 2;        // frames
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
  evidence_.assign(lights_.size() * lights_.size(), HUGE_VAL);
  crosses_.assign(lights_.size() * lights_.size(), HandCovariance::Zero());
  for (std::size_t i = 0; i < lights_.size(); ++i)
    lights_[i].light = static_cast<int>(i);
}

HandCovariance& SpotTracks::Cross(int light, int other)
{
  return crosses_[static_cast<std::size_t>(light * code_.Lights() + other)];
}

HandCovariance SpotTracks::CovarianceOf(const Track& a, const Track& b) const
{
  if (&a == &b)
    return a.covariance;
  if (a.light < 0 || b.light < 0)
    return HandCovariance::Zero();
  return crosses_[static_cast<std::size_t>(a.light * code_.Lights() + b.light)];
}

SpotTracks::Motion SpotTracks::Moved(const Motion& motion, double time) const
{
  const HandMotion hand(time - motion.time, parameters_.acceleration);
  return {hand.step * motion.state, hand.step * motion.covariance * hand.step.transpose() + hand.noise, time};
}

void SpotTracks::Move(Track& track, double time)
{
  const HandMotion hand(time - track.time, parameters_.acceleration);
  track.state = hand.step * track.state;
  track.covariance = hand.step * track.covariance * hand.step.transpose() + hand.noise;
  track.time = time;
  for (int other = 0; track.light >= 0 && other < code_.Lights(); ++other)
    if (other != track.light) {
      Cross(track.light, other) = hand.step * Cross(track.light, other);
      Cross(other, track.light) = Cross(track.light, other).transpose();
    }
}

// Of the mean of the places of parts.
Eigen::Matrix2d SpotTracks::SpreadOf(const std::vector<Part>& parts) const
{
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const Part& a : parts)
    for (const Part& b : parts)
      spread += a.weight * b.weight * CovarianceOf(*a.track, *b.track).topLeftCorner<2, 2>();
  return spread;
}

// The mean of the places of \a parts was seen at \a place: a step of the filter of all lights.
void SpotTracks::Measure(const std::vector<Part>& parts, const Eigen::Vector2d& place, const Eigen::Matrix2d& noise)
{
  Eigen::Vector2d off = place;
  for (const Part& part : parts)
    off -= part.weight * part.track->state.head<2>();
  const Eigen::Matrix2d precision = (SpreadOf(parts) + noise).inverse();
  struct Gain {
    Track* track;
    Eigen::Matrix<double, 6, 2> shared; // covariance of its state and the mean
  };
  std::vector<Gain> gains;
  for (Track& track : tracks_) {
    const bool isPart = std::any_of(parts.begin(), parts.end(), [&](const Part& part) { return part.track == &track; });
    if (!isPart && (track.light < 0 || parts.front().track->light < 0))
      continue;
    Gain gain{&track, Eigen::Matrix<double, 6, 2>::Zero()};
    for (const Part& part : parts)
      gain.shared += part.weight * CovarianceOf(track, *part.track).leftCols<2>();
    gains.push_back(gain);
  }
  for (const Gain& gain : gains) {
    const Eigen::Matrix<double, 6, 2> step = gain.shared * precision;
    gain.track->state += step * off;
    for (const Gain& other : gains) {
      if (other.track == gain.track) {
        const HandCovariance rest = gain.track->covariance - step * gain.shared.transpose();
        gain.track->covariance = 0.5 * (rest + rest.transpose());
      } else
        Cross(gain.track->light, other.track->light) -= step * other.shared.transpose();
    }
  }
}

// The spot is the track's alone.
void SpotTracks::Correct(Track& track, const Spot& spot, double time)
{
  // How well it would have been foretold: from the newest state that the latency would have allowed.
  const double known = time - parameters_.latencyMs * 1e-3;
  for (auto past = track.past.rbegin(); track.light >= 0 && past != track.past.rend(); ++past)
    if (past->first <= known) {
      if (known - past->first > 1e-3 * parameters_.frameMs)
        break; // it was not seen then
      const HandState ahead = HandMotion(time - past->first, parameters_.acceleration).step * past->second;
      predictionSquares_ += (ahead.head<2>() - spot.position).squaredNorm();
      holdSquares_ += (past->second.head<2>() - spot.position).squaredNorm();
      ++statistics_.predictions;
      break;
    }

  Move(track, time);
  // Of what is nobody's neither is known whether it is one, nor how it was switched meanwhile.
  const double doubt = track.light < 0 ? std::max(LongerThan(track, spot, 0.0), NobodysDoubt) * spot.size : 0.0;
  Measure({{&track, 1.0}}, spot.position,
          spot.covariance + Eigen::Matrix2d::Identity() * (ModelSigma * ModelSigma + doubt * doubt));
  track.spot = spot;
  track.lastSeen = time;
  track.unseen = 0;
  track.isMerged = false;
  ++track.alone;
  track.strange = 0.0;
  track.length = std::min(LengthGrows * track.length, spot.size * std::sqrt(spot.elongation));
  track.past.emplace_back(time, track.state);
  if (track.past.size() > Remembered)
    track.past.pop_front();
}

// How much longer a spot is than the track's have been of late, which two that touch are: the distance between both over the size
// of one, or 0. As many sigmas of its noise do not count.
double SpotTracks::LongerThan(const Track& track, const Spot& spot, double sigmas) const
{
  const double blur = track.state.segment<2>(2).norm() * timing_.exposure / spot.size; // of what moves meanwhile
  const double ratio = spot.size * std::sqrt(spot.elongation) / (track.length * std::sqrt(1.0 + blur * blur / 12.0));
  return ratio > 1.0 + LongerBy + sigmas * spot.peakSigma / spot.peak ? std::sqrt(ratio * ratio - 1.0) : 0.0;
}

// It is nobody's any more, and has to be told anew.
void SpotTracks::Release(Track& track)
{
  for (int other = 0; track.light >= 0 && other < code_.Lights(); ++other) {
    Cross(track.light, other) = Cross(other, track.light) = HandCovariance::Zero();
    // Two that met and were not told apart may have been exchanged: that one of them is gone tells nothing of the other.
    if (std::exchange(Evidence(track.light, other), HUGE_VAL) < HUGE_VAL)
      for (Track& met : tracks_)
        if (met.light == other) {
          met.isProven = false;
          met.seen.clear();
        }
  }
  track.light = -1;
  track.seen.clear();
}

void SpotTracks::Remember(Track& track, double begin, double brightness)
{
  track.seen.push_back({begin, brightness});
  if (track.seen.size() > window_)
    track.seen.erase(track.seen.begin());
}

// \param later how much later than the phase has it everything begins, slots
double SpotTracks::ExpectedShare(const Track& track, double time, double row, double later) const
{
  if (track.light < 0 || !phase_)
    return 1.0;
  const double from = (RowTime(time, row) - *phase_) / timing_.slot - later;
  return code_.OnShare(track.light, from, from + timing_.exposure / timing_.slot);
}

// Squared standard deviations of a spot from where a track expects it; HUGE_VAL when it cannot be there.
double SpotTracks::DistanceFrom(const Track& track, const Spot& spot, double time) const
{
  const double when = MiddleOf(time, spot.position.y());
  if ((spot.position - track.spot.position).norm() > parameters_.maximumSpeed * (when - track.lastSeen) + 2.0)
    return HUGE_VAL;
  const Motion moved = Moved(track, when);
  const Eigen::Vector2d off = spot.position - moved.state.head<2>();
  const Eigen::Matrix2d spread = moved.covariance.topLeftCorner<2, 2>() + spot.covariance + Eigen::Matrix2d::Identity() * 0.25;
  const double distance = off.dot(spread.inverse() * off);
  return distance > Gate ? HUGE_VAL : distance;
}

void SpotTracks::Assign(double time, const std::vector<Spot>& spots)
{
  std::vector<bool> taken(spots.size(), false);
  ExplainByLights(time, spots, taken);
  TellApart();
  for (Track& track : tracks_)
    if (track.light >= 0 && DoubtOf(track) > LostPlace)
      Release(track);
    else if (track.light >= 0 && track.isProven && DoubtOf(track) > NoPlace) {
      track.isProven = false;
      track.seen.clear();
    }

  struct Pair {
    double distance;
    std::size_t track, spot;
  };
  std::vector<Pair> pairs;
  std::vector<bool> isHidden(tracks_.size(), false); // behind a light: what there is to see may be its own, too
  for (std::size_t t = 0; t < tracks_.size(); ++t)
    for (std::size_t s = 0; s < spots.size() && tracks_[t].light < 0; ++s) {
      const double distance = DistanceFrom(tracks_[t], spots[s], time);
      if (distance > Gate)
        continue;
      if (taken[s])
        isHidden[t] = true;
      else
        pairs.push_back({distance, t, s});
    }
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    return std::tie(a.distance, a.track, a.spot) < std::tie(b.distance, b.track, b.spot);
  });

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
    const auto its = std::find_if(pairs.begin(), pairs.end(),
                                  [&](const Pair& p) { return p.spot == other.spot && static_cast<int>(p.track) == taker; });
    if (tracks_[other.track].past.size() < Established)
      continue; // a sparkle that was here a moment ago
    if (other.distance < its->distance + Doubt)
      doubted[other.track] = doubted[static_cast<std::size_t>(taker)] = true;
  }

  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    Track& track = tracks_[t];
    if (track.light >= 0)
      continue;
    if (doubted[t])
      track.seen.clear();
    if (spotOf[t] >= 0) {
      const Spot& spot = spots[static_cast<std::size_t>(spotOf[t])];
      const bool isLonger = LongerThan(track, spot, 2.0) > 0.0;
      Correct(track, spot, MiddleOf(time, spot.position.y()));
      if (!doubted[t] && !isLonger)
        Remember(track, RowTime(time, spot.position.y()), spot.Brightness());
    } else {
      ++track.unseen;
      const double row = track.state.y();
      Move(track, MiddleOf(time, row));
      if (!doubted[t] && !isHidden[t])
        Remember(track, RowTime(time, row), 0.0);
    }
  }
  RemoveLost();

  for (std::size_t s = 0; s < spots.size(); ++s) {
    if (taken[s] || trackOf[s] >= 0 || tracks_.size() >= TrackLimit)
      continue;
    Track track;
    track.state << spots[s].position, Eigen::Vector4d::Zero();
    track.covariance.topLeftCorner<2, 2>() = spots[s].covariance + Eigen::Matrix2d::Identity() * ModelSigma * ModelSigma;
    track.covariance.diagonal().segment<2>(2).setConstant(std::pow(0.35 * parameters_.maximumSpeed, 2));
    track.covariance.diagonal().tail<2>().setConstant(std::pow(parameters_.acceleration, 2));
    track.time = track.lastSeen = MiddleOf(time, spots[s].position.y());
    track.spot = spots[s];
    track.length = spots[s].size * std::sqrt(spots[s].elongation);
    Remember(track, RowTime(time, spots[s].position.y()), spots[s].Brightness());
    track.past.emplace_back(track.time, track.state);
    // Where one becomes two, nobody knows which of both it was before, nor whose its light was.
    for (Track& other : tracks_)
      if (other.light < 0 && other.unseen == 0 &&
          (other.spot.position - track.spot.position).norm() < PartReach * std::max(other.spot.size, track.spot.size))
        other.seen.clear();
    tracks_.push_back(std::move(track));
  }
}

void SpotTracks::RemoveLost()
{
  for (Track& track : tracks_)
    if (track.unseen >= LostAfter)
      Release(track);
  tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(), [](const Track& t) { return t.unseen >= LostAfter; }),
                tracks_.end());
}

void SpotTracks::Identify(Track& track)
{
  const double period = code_.Length() * timing_.slot;
  if (track.light >= 0) {
    // Another light explains it better, or nothing does.
    const BlinkMatch match = MatchBlink(code_, timing_, track.seen, phase_, 1.0);
    const double own = BlinkResidual(code_, timing_, track.seen, track.light, *phase_);
    bool isMixed = false;
    for (int other = 0; other < code_.Lights(); ++other)
      isMixed = isMixed || (other != track.light && track.seen.size() >= LeastSeen &&
                            BlinkMixture(code_, timing_, track.seen, track.light, other, *phase_) > RevokeMixture);
    if (!track.isProven && track.seen.size() >= LeastSeen)
      track.isProven = MatchBlink(code_, timing_, track.seen, phase_, IdentifyLimit).light == track.light;
    if (isMixed || own > RevokeLimit || (match.light >= 0 && match.light != track.light)) {
      ++statistics_.revoked;
      Release(track);
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
          Release(other);
          track.seen.clear();
          ++statistics_.revoked;
          return;
        }
      track.light = match.light;
      track.isProven = true;
      track.alone = 0;
      track.amplitude = BlinkAmplitude(code_, timing_, track.seen, track.light, *phase_);
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

// Of the place of a light that was last seen together with others, over the size of its spot.
double SpotTracks::DoubtOf(const Track& track)
{
  const double sigma = std::sqrt(0.5 * track.covariance.topLeftCorner<2, 2>().trace());
  return track.isMerged ? std::hypot(sigma / track.spot.size, track.strange) : 0.0;
}

// Where it is when it is not seen is only known of a light that was seen alone several times before.
bool SpotTracks::IsSpeedUnknown(const Track& track)
{
  return track.unseen > 0 && !track.isMerged && track.alone < SeenForSpeed;
}

void SpotTracks::Report(double time)
{
  for (TrackedLight& light : lights_) {
    light.status = TrackedLight::Status::Lost;
    for (const Track& track : tracks_) {
      if (track.light != light.light || !track.isProven || !IsToldApart(track) || IsSpeedUnknown(track) ||
          DoubtOf(track) > LargestDoubt)
        continue;
      light.status = track.unseen == 0 && !track.isMerged ? TrackedLight::Status::Seen : TrackedLight::Status::Predicted;
      light.time = track.time;
      light.position = track.state.head<2>();
      light.velocity = track.state.segment<2>(2);
      light.covariance = track.covariance.topLeftCorner<2, 2>();
      light.spot = track.spot;
      const Motion ahead = Moved(track, MiddleOf(time, track.state.y()) + parameters_.latencyMs * 1e-3);
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
    for (Track& track : tracks_)
      track.unseen = LostAfter;
  RemoveLost();
  lastTime_ = time;
  ++statistics_.frames;
  if (isBlind) {
    ++statistics_.blindFrames;
    for (Track& track : tracks_)
      ++track.unseen;
    RemoveLost();
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
      return Eigen::Vector2d(Moved(track, time).state.head<2>());
  return std::nullopt;
}

std::vector<std::pair<int, int>> SpotTracks::DarkRows(double time, int height) const
{
  std::vector<std::pair<int, int>> rows;
  if (!phase_ || code_.OffSlots() == 0)
    return rows;
  const double margin = parameters_.triggered ? 0.0 : PhaseError;
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
