// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Geometry/MotionPath.h"
#include <string>
#include <vector>

namespace echorama {

/// Which speed is compared. It does not depend on the frames of coordinates.
enum class SpeedSignal {
  Automatic,   ///< of rotation, and where that does not tell, of translation
  Rotation,    ///< degrees per second: the same for everything that is fixed to one body
  Translation, ///< mm per second: the same for two that follow one point
};

struct TemporalParameters {
  SpeedSignal signal = SpeedSignal::Automatic;
  double largestOffsetSeconds = 5.0, smoothingSeconds = 0.05, longestGapSeconds = 0.5, leastOverlapSeconds = 3.0;
};
ParameterList Describe(TemporalParameters& p);

struct TemporalResult {
  double offsetSeconds = 0.0; ///< what is to be added to the times of the second stream to have those of the first
  double standardErrorSeconds = 0.0;
  SpeedSignal signal = SpeedSignal::Rotation;            ///< that was compared
  double correlation = 0.0;                              ///< of the speeds at the offset, in [-1, 1]
  double confidence = 0.0;                               ///< that it is this peak and not the next best, in [0, 1]
  double nextCorrelation = 0.0, nextOffsetSeconds = 0.0; ///< of the next best peak; 0 when there is none
  double speedRatio = 1.0;                               ///< speeds of the first over those of the second
  double overlapSeconds = 0.0;                           ///< in which both streams are known
  double middleSeconds = 0.0;                            ///< of the overlap, on the first's clock: where the offset holds
  double driftPpm = 0.0, driftErrorPpm = 0.0;            ///< by which the offset grows, and its standard error; parts per million
  bool drifts = false;                       ///< whether that is more than chance; the offset then is that in the middle
  std::vector<double> offsets, correlations; ///< all that were looked at, for a plot; NaN where the overlap is too short
  std::vector<std::string> notes;            ///< sentences for people
};

/// The offset between the clocks of two streams that saw the same motion, from their speeds alone.
///
/// Both are smoothed alike and resampled; the normalised cross-correlation is searched for its highest peak, and that refined by
/// least squares on offset, ratio and mean of the speeds. The standard error allows for residuals that depend on their
/// neighbours. Streams may have different rates, lengths and gaps. Where their times do not overlap at all, the search is about
/// the offset that makes both begin together.
///
/// \param first, second valid poses; they are sorted by time, and of equal times the first counts
/// \throws Error(InvalidParameter) for what is out of its range; Error(BadInput) when a pose or time is not finite or not rigid;
/// Error(NotPossible) with the reason: streams too short, no or too little motion, a speed that hardly changes, speeds that agree
/// at no offset, a motion that repeats itself so that several offsets fit, a peak at the end of the range. Error(Cancelled).
TemporalResult CalibrateTime(const std::vector<TimedPose>& first, const std::vector<TimedPose>& second,
                             const TemporalParameters& parameters = {}, const Progress& progress = {});

} // namespace echorama
