// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Optical/BlinkCode.h"
#include "Tracking/Optical/HandMotion.h"
#include "Tracking/Optical/SpotDetector.h"
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

namespace echorama {

struct SpotTracksParameters {
  double frameMs = 1000.0 / 90.0, exposureMs = 8.0, rowUs = 0.0;
  double slotMs = 1000.0 / 90.0;
  double latencyMs = 22.0;
  double acceleration = 5000.0;
  double maximumSpeed = 2000.0;
  bool triggered = false;
};
ParameterList Describe(SpotTracksParameters& p);

/// Where a light is, or was last.
struct TrackedLight {
  enum class Status {
    Seen,      ///< in the newest frame
    Predicted, ///< not in the newest frame or two: it is off, hidden, or has gone; or only seen together with others
    Lost,      ///< in none of the last three
  };
  int light = -1; ///< of the code
  Status status = Status::Lost;
  double time = 0.0; ///< of position: for one that is seen the middle of its exposure, on the camera's clock
  Eigen::Vector2d position = Eigen::Vector2d::Zero(), velocity = Eigen::Vector2d::Zero(); ///< px, px/s
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();                                   ///< of the position, px^2
  Eigen::Vector2d predicted = Eigen::Vector2d::Zero(); ///< latencyMs after the exposure of the newest frame
  Eigen::Matrix2d predictedCovariance = Eigen::Matrix2d::Zero();
  Spot spot; ///< as last seen
};

struct SpotTracksStatistics {
  std::int64_t frames = 0, blindFrames = 0;
  std::int64_t identified = 0; ///< times that a track was found to be a light's
  std::int64_t revoked = 0;    ///< times that its blinking spoke against it later
  std::int64_t met = 0;        ///< times that two came so near each other that they had to be told apart anew
  std::int64_t predictions = 0;
  double predictionRms = 0.0; ///< px, of where a light was said to be latencyMs ahead
  double holdRms = 0.0;       ///< px, the same without prediction: the last position
};

/// Whose spots they are, over time. Who is who is told by the code alone, never by brightness or place. Lights that are known
/// are followed together: where their spots are one, or might be exchanged, its middle is where the light of all of them is,
/// each as bright as its code says.
class SpotTracks {
public:
  /// \throws Error(InvalidParameter): out of range, or a code that needs a trigger without one
  SpotTracks(const SpotTracksParameters& parameters, BlinkCode code);

  /// One frame whose first row began to be exposed at \a time, on the camera's clock. Frames that were lost are those that do not
  /// come. \a isBlind: the frame says nothing of where lights are not (too bright, or changed).
  /// \throws Error(BadInput) when time does not go on
  const std::vector<TrackedLight>& Update(double time, const std::vector<Spot>& spots, bool isBlind = false);

  /// One entry per light of the code.
  const std::vector<TrackedLight>& Lights() const { return lights_; }
  /// Where \a light will be at \a time, if it goes on as it does.
  std::optional<Eigen::Vector2d> Predict(int light, double time) const;

  /// When slot 0 began, once it is known. With a trigger: with the exposure of frames whose time is a multiple of all slots.
  std::optional<double> Phase() const { return phase_; }
  /// Rows [begin, end) of a frame in which all lights were off, by the phase. None while it is not known.
  std::vector<std::pair<int, int>> DarkRows(double time, int height) const;
  const SpotTracksStatistics& Statistics() const { return statistics_; }

private:
  static constexpr double Gate = 20.0;        // squared standard deviations
  static constexpr double Doubt = 16.0;       // the same: what explains a spot worse by less than this may be true
  static constexpr double ModelSigma = 0.05;  // px: what positions lack beyond their own noise
  static constexpr double PhaseError = 0.2;   // slots, which is as much as drifting clocks leave unknown
  static constexpr double LengthGrows = 1.02; // of a light's spot, in each frame at most

  struct Motion {
    HandState state = HandState::Zero();
    HandCovariance covariance = HandCovariance::Zero();
    double time = 0.0;
  };
  struct Track : Motion {
    double lastSeen = 0.0;
    int unseen = 0; // frames on end
    int alone = 0;  // times seen since it was identified, or seen together with others
    int light = -1;
    bool isProven = false;                // that it is that light: since its place was known
    bool isMerged = false;                // in the newest frame: only seen together with others
    double length = 0.0;                  // standard deviation of its light along its longer axis, the least of late, px
    double strange = 0.0;                 // the share of the light there that is nobody's
    double share = 0.0, shareError = 0.0; // of the newest exposure in which its light is on, by its code
    double newest = 0.0;                  // its brightness then; not finite: unknown
    double amplitude = 0.0;               // of its light, on for the whole exposure: grey levels, summed over all pixels
    Spot spot;
    std::vector<BlinkObservation> seen;
    std::deque<std::pair<double, HandState>> past; // after each time that it was seen
  };
  struct Part { // of a spot: a track, and its share of the spot's light
    Track* track;
    double weight;
  };
  struct Company;

  double RowTime(double time, double row) const { return time + row * rowSeconds_; }
  double MiddleOf(double time, double row) const { return RowTime(time, row) + 0.5 * timing_.exposure; }
  void Move(Track& track, double time);
  Motion Moved(const Motion& motion, double time) const;
  HandCovariance& Cross(int light, int other);
  HandCovariance CovarianceOf(const Track& a, const Track& b) const;
  Eigen::Matrix2d SpreadOf(const std::vector<Part>& parts) const;
  void Measure(const std::vector<Part>& parts, const Eigen::Vector2d& place, const Eigen::Matrix2d& noise);
  void Correct(Track& track, const Spot& spot, double time);
  double LongerThan(const Track& track, const Spot& spot, double sigmas) const;
  void Release(Track& track);
  void RemoveLost();
  void Remember(Track& track, double begin, double brightness);
  double DistanceFrom(const Track& track, const Spot& spot, double time) const;
  static double VarianceOf(const Track& light);
  double& Evidence(int light, int other);
  void TellApart();
  bool IsToldApart(const Track& track) const;
  void ExplainByLights(double time, const std::vector<Spot>& spots, std::vector<bool>& taken);
  void ExplainBy(Company& company, double time, const std::vector<Spot>& spots, std::vector<bool>& taken);
  void Assign(double time, const std::vector<Spot>& spots);
  void Identify(Track& track);
  void RefinePhase();
  static bool IsSpeedUnknown(const Track& track);
  static double DoubtOf(const Track& track);
  void Report(double time);
  double ExpectedShare(const Track& track, double time, double row, double later = 0.0) const;

  SpotTracksParameters parameters_;
  BlinkCode code_;
  BlinkTiming timing_;
  double rowSeconds_;
  std::size_t window_;
  std::optional<double> phase_;
  int phaseVotes_ = 0;
  double phaseCandidate_ = 0.0;
  std::optional<double> lastTime_;
  std::vector<Track> tracks_;
  std::vector<double> evidence_;        // that two lights were not exchanged since they met; HUGE_VAL: no doubt
  std::vector<HandCovariance> crosses_; // of the states of two lights, by light and other light
  std::vector<TrackedLight> lights_;
  SpotTracksStatistics statistics_;
  double predictionSquares_ = 0.0, holdSquares_ = 0.0;
};

} // namespace echorama
