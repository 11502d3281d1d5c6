// SPDX-License-Identifier: BSD-3-Clause
// 1. Each stream becomes a speed on an even grid: MotionPath smooths the poses (both with the same window, so that neither is
//    delayed against the other) and knows the gaps; the speed is that of a step, centred.
// 2. The correlation of all pairs of samples that are known on both sides, for every offset on the grid.
// 3. The highest peak must stand out. How much evidence a correlation is depends on how many independent samples there are:
//    their number follows from the autocorrelations (Bartlett 1946). Two peaks are compared by the likelihoods of their
//    residuals, which grow as (1 - rho^2)^(-n/2).
// 4. Gauss-Newton on the offset, between the samples; mean and ratio of the speeds are fitted along. Residuals of smoothed
//    noise depend on their neighbours, so the standard error is that of a jackknife over blocks.
//
// Cost: poses times neighbours for 1, samples times offsets for 2.
#include "Filters/Calibration/TemporalCalibration.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/SymmetricMatrix.h"
#include "Filters/Calibration/CalibrationText.h"
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <Eigen/Dense>

namespace echorama {
namespace {

constexpr double NaN = std::numeric_limits<double>::quiet_NaN();
constexpr double LeastSpeed = 1.0;           // degrees or mm per second, standard deviation
constexpr double LeastStructure = 0.1;       // standard deviation of the speed over its mean
constexpr double LeastEvidence = 8.0;        // logarithm of the likelihood, against no common motion
constexpr double LeastLead = 5.0;            // and against the next best peak
constexpr double BestResidual = 1e-3;        // 1 - rho^2: no recording agrees better
constexpr double MostProducts = 4e8;         // of the correlation
constexpr double LongestMemorySeconds = 5.0; // of the autocorrelations
constexpr double SamplesPerWindow = 4.0;     // of the grid
constexpr double MostSamples = 2e7;          // of the grid: three days
constexpr double ManySamples = 1e6;          // and three hours, of which at least this share must be covered
constexpr double LeastCovered = 0.01;

[[noreturn]] void RefuseTemporal(const std::string& reason)
{
  throw Error(Error::Kind::NotPossible, "temporal calibration: " + reason);
}

const char* UnitOf(SpeedSignal signal)
{
  return signal == SpeedSignal::Rotation ? "degrees/s" : "mm/s";
}

// Sorted, and without repetitions of a time.
std::vector<TimedPose> Sorted(std::vector<TimedPose> poses, const char* which)
{
  for (const TimedPose& pose : poses)
    if (!std::isfinite(pose.time))
      throw Error(Error::Kind::BadInput, std::string("temporal calibration: a time of the ") + which + " stream is not finite");
  const auto before = [](const TimedPose& a, const TimedPose& b) { return a.time < b.time; };
  if (!std::is_sorted(poses.begin(), poses.end(), before))
    std::stable_sort(poses.begin(), poses.end(), before);
  poses.erase(std::unique(poses.begin(), poses.end(), [](const TimedPose& a, const TimedPose& b) { return a.time == b.time; }),
              poses.end());
  if (poses.size() < 10)
    RefuseTemporal(std::string("the ") + which + " stream has only " + std::to_string(poses.size()) +
                   " poses at different times");
  return poses;
}

double MedianInterval(const std::vector<TimedPose>& poses)
{
  std::vector<double> intervals;
  for (std::size_t i = 1; i < poses.size(); ++i)
    intervals.push_back(poses[i].time - poses[i - 1].time);
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  return *middle;
}

// A speed on an even grid; NaN where it is not known.
struct SpeedTrack {
  double start = 0.0, step = 1.0;
  std::vector<double> values;

  double TimeOf(std::size_t index) const { return start + step * static_cast<double>(index); }

  // Between the samples, by a cubic through four of them, with its slope. \returns false where one is not known
  bool At(double time, double& value, double& slope) const
  {
    const double place = (time - start) / step, cell = std::floor(place), x = place - cell;
    if (!(cell >= 1.0 && cell + 2.0 < static_cast<double>(values.size())))
      return false;
    const double* v = values.data() + static_cast<std::size_t>(cell) - 1;
    const double a = 0.5 * (v[2] - v[0]), b = v[0] - 2.5 * v[1] + 2.0 * v[2] - 0.5 * v[3],
                 c = 0.5 * (v[3] - v[0]) + 1.5 * (v[1] - v[2]);
    value = v[1] + x * (a + x * (b + x * c));
    slope = (a + x * (2.0 * b + x * 3.0 * c)) / step;
    return std::isfinite(value);
  }
};

// A clock that jumps would make a grid without an end, and nothing on it.
void RefuseJump(const MotionPath& path, double step, const char* which)
{
  const double seconds = path.LastTime() - path.FirstTime(), samples = seconds / step;
  double covered = seconds;
  MotionPath::Gap longest;
  for (const MotionPath::Gap& gap : path.Gaps()) {
    covered -= gap.to - gap.from;
    if (gap.to - gap.from > longest.to - longest.from)
      longest = gap;
  }
  if (samples <= ManySamples || (samples <= MostSamples && covered >= LeastCovered * seconds))
    return;
  if (longest.to - longest.from > 0.5 * seconds)
    RefuseTemporal(
        Format("the times of the %s stream jump from %.9g s to %.9g s, and its poses cover %.3g s in all: leave out what lies "
               "beyond the jump",
               which, longest.from, longest.to, covered));
  RefuseTemporal(Format("the %s stream lasts for %.3g s, of which its poses cover %.3g s: compare a shorter piece", which,
                        seconds, covered));
}

SpeedTrack SpeedOf(const MotionPath& path, SpeedSignal signal, double step, double baseline)
{
  SpeedTrack track;
  track.step = step;
  track.start = path.FirstTime();
  const double count = std::floor((path.LastTime() - track.start) / step) + 1.0;
  track.values.assign(static_cast<std::size_t>(std::max(0.0, count)), NaN);
  for (std::size_t i = 0; i < track.values.size(); ++i) {
    const double before = track.TimeOf(i) - 0.5 * baseline, after = before + baseline;
    if (!path.Covers(before) || !path.Covers(track.TimeOf(i)) || !path.Covers(after))
      continue;
    const Pose a = path.At(before), b = path.At(after);
    track.values[i] = signal == SpeedSignal::Rotation
                          ? LogRotation(a.linear().transpose() * b.linear()).norm() * DegreesPerRadian / baseline
                          : (b.translation() - a.translation()).norm() / baseline;
  }
  return track;
}

struct Moments {
  double count = 0.0, mean = 0.0, deviation = 0.0;
};

Moments MomentsOf(const std::vector<double>& values)
{
  Moments m;
  double sum = 0.0, squares = 0.0;
  for (const double value : values)
    if (std::isfinite(value)) {
      m.count += 1.0;
      sum += value;
    }
  m.mean = m.count > 0.0 ? sum / m.count : 0.0;
  for (const double value : values)
    if (std::isfinite(value))
      squares += (value - m.mean) * (value - m.mean);
  m.deviation = m.count > 0.0 ? std::sqrt(squares / m.count) : 0.0;
  return m;
}

void RefuseTooLittleMotion(const SpeedTrack& track, SpeedSignal signal, const char* which)
{
  const Moments m = MomentsOf(track.values);
  const char* kind = signal == SpeedSignal::Rotation ? "turns" : "moves";
  if (m.mean < LeastSpeed)
    RefuseTemporal(Format("the %s stream hardly %s: %.2g %s in the mean", which, kind, m.mean, UnitOf(signal)));
  if (m.deviation < LeastStructure * m.mean)
    RefuseTemporal(
        Format("the speed of the %s stream hardly changes (%.3g +- %.2g %s), so that every offset fits; move it back and forth, "
               "with pauses",
               which, m.mean, m.deviation, UnitOf(signal)));
  if (m.deviation < LeastSpeed)
    RefuseTemporal(Format("the %s stream hardly %s: its speed varies by %.2g %s", which, kind, m.deviation, UnitOf(signal)));
}

// Of the samples first[i] and second[i - lag] that are both known; NaN when there are fewer than \a least. \a pairs: their
// number.
double Correlation(const std::vector<double>& first, const std::vector<double>& second, std::ptrdiff_t lag, double least,
                   double* pairs = nullptr)
{
  double n = 0.0, a1 = 0.0, b1 = 0.0, a2 = 0.0, b2 = 0.0, ab = 0.0;
  const std::ptrdiff_t begin = std::max<std::ptrdiff_t>(0, lag), end = std::min(static_cast<std::ptrdiff_t>(first.size()),
                                                                                static_cast<std::ptrdiff_t>(second.size()) + lag);
  for (std::ptrdiff_t i = begin; i < end; ++i) {
    const double a = first[static_cast<std::size_t>(i)], b = second[static_cast<std::size_t>(i - lag)];
    if (std::isnan(a + b))
      continue;
    n += 1.0;
    a1 += a;
    b1 += b;
    a2 += a * a;
    b2 += b * b;
    ab += a * b;
  }
  if (pairs)
    *pairs = n;
  const double va = a2 - a1 * a1 / n, vb = b2 - b1 * b1 / n;
  if (n < least || n < 3.0 || !(va > 1e-9 * a2) || !(vb > 1e-9 * b2))
    return NaN;
  return (ab - a1 * b1 / n) / std::sqrt(va * vb);
}

std::vector<double> EverySample(const std::vector<double>& values, std::size_t stride)
{
  std::vector<double> some;
  for (std::size_t i = 0; i < values.size(); i += stride)
    some.push_back(values[i]);
  return some;
}

// How many of \a pairs samples are independent of each other.
double IndependentPairs(const std::vector<double>& first, const std::vector<double>& second, double step, double pairs)
{
  const std::ptrdiff_t memory = static_cast<std::ptrdiff_t>(std::min(LongestMemorySeconds / step, 0.25 * pairs));
  double sum = 1.0;
  for (std::ptrdiff_t lag = 1; lag <= memory; ++lag) {
    const double product = Correlation(first, first, lag, 3.0) * Correlation(second, second, lag, 3.0);
    if (std::isfinite(product))
      sum += 2.0 * std::max(0.0, product);
  }
  return std::max(1.0, pairs / sum);
}

double LogResidual(double correlation)
{
  return std::log(std::max(BestResidual, 1.0 - correlation * correlation));
}

// Finds the peak, refuses where there is none to rely on. \returns its index among the offsets
std::size_t FindPeak(const SpeedTrack& first, const SpeedTrack& second, double centre, const TemporalParameters& parameters,
                     TemporalResult& result, const Progress& progress)
{
  const double products = static_cast<double>(first.values.size()) * 2.0 * parameters.largestOffsetSeconds / first.step;
  const std::size_t stride = static_cast<std::size_t>(std::ceil(std::sqrt(std::max(1.0, products / MostProducts))));
  const std::vector<double> a = EverySample(first.values, stride), b = EverySample(second.values, stride);
  const double step = first.step * static_cast<double>(stride);
  const double zero = first.start - second.start; // the offset of lag 0
  const std::ptrdiff_t low = static_cast<std::ptrdiff_t>(std::ceil((centre - parameters.largestOffsetSeconds - zero) / step)),
                       high = static_cast<std::ptrdiff_t>(std::floor((centre + parameters.largestOffsetSeconds - zero) / step));
  const double least = parameters.leastOverlapSeconds / step;
  result.correlations.assign(static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, high - low + 1)), NaN);
  result.offsets.resize(result.correlations.size());
  ParallelFor(static_cast<int>(result.correlations.size()), progress, [&](int i) {
    const std::size_t index = static_cast<std::size_t>(i);
    result.offsets[index] = zero + step * static_cast<double>(low + i);
    result.correlations[index] = Correlation(a, b, low + i, least);
  });
  const std::vector<double>& rho = result.correlations;
  std::size_t peak = rho.size();
  for (std::size_t i = 0; i < rho.size(); ++i)
    if (std::isfinite(rho[i]) && (peak == rho.size() || rho[i] > rho[peak]))
      peak = i;
  if (peak == rho.size())
    RefuseTemporal(Format("the streams overlap for less than %.3g s at every offset within %.3g s",
                          parameters.leastOverlapSeconds, parameters.largestOffsetSeconds));
  double pairs = 0.0;
  Correlation(a, b, low + static_cast<std::ptrdiff_t>(peak), least, &pairs);
  const double independent = IndependentPairs(a, b, step, pairs);
  result.correlation = rho[peak];
  if (!(rho[peak] > 0.0) || -0.5 * independent * LogResidual(rho[peak]) < LeastEvidence)
    RefuseTemporal(
        Format("the speeds agree at no offset within %.3g s (the correlation is %.2f at the best): did both see the same motion, "
               "or is the offset larger?",
               parameters.largestOffsetSeconds, rho[peak]));

  // Its slopes end where the correlation rises again.
  std::size_t left = peak, right = peak;
  while (left > 0 && rho[left - 1] <= rho[left])
    --left;
  while (right + 1 < rho.size() && rho[right + 1] <= rho[right])
    ++right;
  if (left == peak || right == peak)
    RefuseTemporal(
        Format("the best offset, %.3g s, lies at the end of what was looked at; allow larger ones, or record for longer",
               result.offsets[peak]));
  std::size_t next = rho.size();
  for (std::size_t i = 0; i < rho.size(); ++i)
    if ((i < left || i > right) && std::isfinite(rho[i]) && (next == rho.size() || rho[i] > rho[next]))
      next = i;
  double lead = -0.5 * independent * LogResidual(rho[peak]);
  if (next < rho.size() && rho[next] > 0.0) {
    result.nextCorrelation = rho[next];
    result.nextOffsetSeconds = result.offsets[next];
    lead += 0.5 * independent * LogResidual(rho[next]);
  }
  result.confidence = 1.0 / (1.0 + std::exp(-lead));
  if (lead < LeastLead)
    RefuseTemporal(Format(
        "the offsets %.3g s and %.3g s fit nearly alike (correlations %.3f and %.3f): the motion repeats itself; move without "
        "a rhythm",
        result.offsets[peak], result.nextOffsetSeconds, rho[peak], rho[next]));
  return peak;
}

// Of unknown \a k of least squares whose residuals depend on their neighbours: the jackknife over blocks of samples, without
// solving again. What a block says counts against what the others know: a motion may tell its offset in a few moments.
double StandardError(const Eigen::MatrixXd& rows, const Eigen::VectorXd& residuals, Eigen::Index k, Eigen::Index block)
{
  Eigen::MatrixXd others(rows.rows(), rows.cols() - 1);
  others << rows.leftCols(k), rows.rightCols(rows.cols() - k - 1);
  const Eigen::MatrixXd normal = others.transpose() * others;
  const Eigen::VectorXd own = rows.col(k) - others * SolveSymmetric(normal, others.transpose() * rows.col(k));
  const double information = own.squaredNorm();
  double sum = 0.0;
  for (Eigen::Index begin = 0; begin < rows.rows(); begin += block) {
    const Eigen::Index size = std::min(block, rows.rows() - begin);
    const double share = own.segment(begin, size).squaredNorm() / information;
    const double score = own.segment(begin, size).dot(residuals.segment(begin, size)) / std::max(0.05, 1.0 - share);
    sum += score * score;
  }
  return std::sqrt(sum) / information;
}

// Least squares on the offset and, with \a drift, its growth: first(t) = mean + ratio second(t - offset - growth (t - middle)).
struct Refined {
  double offset = 0.0, growth = 0.0, ratio = 1.0;
  double middle = 0.0, seconds = 0.0;
  double offsetError = 0.0, growthError = 0.0;
};

Refined Refine(const SpeedTrack& first, const SpeedTrack& second, Refined fit, bool drift, double memorySeconds)
{
  const Eigen::Index unknowns = drift ? 4 : 3;
  Eigen::MatrixXd rows;
  Eigen::VectorXd residuals;
  double mean = 0.0;
  for (int iteration = 0; iteration < 12; ++iteration) {
    std::vector<double> times, a, b, slopes;
    for (std::size_t i = 0; i < first.values.size(); ++i) {
      const double time = first.TimeOf(i);
      double value = 0.0, slope = 0.0;
      if (!std::isfinite(first.values[i]) || !second.At(time - fit.offset - fit.growth * (time - fit.middle), value, slope))
        continue;
      times.push_back(time);
      a.push_back(first.values[i]);
      b.push_back(value);
      slopes.push_back(slope);
    }
    const Eigen::Index count = static_cast<Eigen::Index>(times.size());
    if (count < 10) {
      if (iteration == 0)
        RefuseTemporal(
            Format("the streams overlap in too few moments (%d of the grid, %.3g s apart); record for longer, or smooth less",
                   static_cast<int>(count), first.step));
      break;
    }
    if (iteration == 0)
      fit.middle = 0.5 * (times.front() + times.back());
    fit.seconds = static_cast<double>(count) * first.step;
    rows.resize(count, unknowns);
    residuals.resize(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const std::size_t k = static_cast<std::size_t>(i);
      rows(i, 0) = 1.0;
      rows(i, 1) = b[k];
      rows(i, 2) = -fit.ratio * slopes[k];
      if (drift)
        rows(i, 3) = rows(i, 2) * (times[k] - fit.middle);
      residuals[i] = a[k] - mean - fit.ratio * b[k];
    }
    const Eigen::MatrixXd normal = rows.transpose() * rows;
    const Eigen::VectorXd step = SolveSymmetric(normal, rows.transpose() * residuals);
    if (!step.allFinite())
      break;
    mean += step[0];
    fit.ratio += step[1];
    fit.offset += step[2];
    fit.growth += drift ? step[3] : 0.0;
    if (iteration > 1 && std::fabs(step[2]) < 1e-9)
      break;
  }
  fit.offsetError = StandardError(rows, residuals, 2, static_cast<Eigen::Index>(memorySeconds / first.step) + 1);
  if (drift)
    fit.growthError = StandardError(rows, residuals, 3, static_cast<Eigen::Index>(memorySeconds / first.step) + 1);
  return fit;
}

TemporalResult Compare(const MotionPath& first, const MotionPath& second, SpeedSignal signal, double sigma,
                       const TemporalParameters& parameters, const Progress& progress)
{
  TemporalResult result;
  result.signal = signal;
  const double step = sigma / SamplesPerWindow;
  const SpeedTrack a = SpeedOf(first, signal, step, sigma), b = SpeedOf(second, signal, step, sigma);
  RefuseTooLittleMotion(a, signal, "first");
  RefuseTooLittleMotion(b, signal, "second");
  const double together = std::min(first.LastTime(), second.LastTime()) - std::max(first.FirstTime(), second.FirstTime());
  double centre = 0.0;
  if (together < parameters.leastOverlapSeconds) {
    centre = first.FirstTime() - second.FirstTime();
    result.notes.push_back(Format("the times of the streams do not overlap: offsets about %.6g s were looked at, with which both "
                                  "begin together",
                                  centre));
  }
  const std::size_t peak = FindPeak(a, b, centre, parameters, result, progress);

  // From the grid to between: the vertex of a parabola, then least squares.
  Refined start;
  const double before = result.correlations[peak - 1], here = result.correlations[peak], after = result.correlations[peak + 1];
  const double bend = before - 2.0 * here + after;
  const double shift = bend < 0.0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0.0;
  start.offset = result.offsets[peak] + shift * (result.offsets[1] - result.offsets[0]);
  const double memory = 8.0 * sigma; // beyond that smoothed noise is independent
  Refined fit = Refine(a, b, start, false, memory);
  const Refined drifting = Refine(a, b, fit, true, memory);
  result.driftPpm = 1e6 * drifting.growth;
  result.driftErrorPpm = 1e6 * drifting.growthError;
  const double atTheEnds = 0.5 * std::fabs(drifting.growth) * drifting.seconds;
  result.drifts = std::fabs(drifting.growth) > 5.0 * drifting.growthError && atTheEnds > 2.0 * drifting.offsetError;
  if (result.drifts) {
    fit = drifting;
    result.notes.push_back(
        Format("one clock drifts by %.0f +- %.0f ppm against the other: the offset is that in the middle, and %.1f ms "
               "off at the ends",
               result.driftPpm, result.driftErrorPpm, 1e3 * atTheEnds));
  }
  if (!std::isfinite(fit.offset) || std::fabs(fit.offset - start.offset) > 4.0 * sigma)
    RefuseTemporal("the peak of the correlation is too blunt for an offset; move faster, with pauses");
  result.offsetSeconds = fit.offset;
  result.standardErrorSeconds = fit.offsetError;
  result.speedRatio = fit.ratio;
  result.overlapSeconds = fit.seconds;
  result.middleSeconds = fit.middle;
  if (signal == SpeedSignal::Rotation && !(fit.ratio > 0.5 && fit.ratio < 2.0))
    result.notes.push_back(
        Format("the first stream turns %.2g times as fast as the second: are they fixed to each other?", fit.ratio));
  if (signal == SpeedSignal::Translation)
    result.notes.push_back("speeds of translation were compared: they agree as far as both streams follow the same point");
  return result;
}

} // namespace

ParameterList Describe(TemporalParameters& p)
{
  return {
      Parameter(
          "Signal", Choice(p.signal, {"automatic", "rotation", "translation"}),
          "Which speed is compared: of rotation, the same for all that is fixed to one body; of translation, the same for two "
          "that follow one point; or of rotation, and where that does not tell, of translation."),
      Parameter("LargestOffset", p.largestOffsetSeconds, {0, 3600, true}, "s", "How far the search goes either way."),
      Parameter("Smoothing", p.smoothingSeconds, {0.005, 2}, "s",
                "Standard deviation of the window that poses are smoothed with, made at least the time between two poses.")
          .Advanced(),
      Parameter("LongestGap", p.longestGapSeconds, {0, 600, true}, "s", "Poses further apart are not connected.").Advanced(),
      Parameter("LeastOverlap", p.leastOverlapSeconds, {0.5, 3600}, "s",
                "What both streams must have in common at every offset that is looked at.")
          .Advanced(),
  };
}

TemporalResult CalibrateTime(const std::vector<TimedPose>& first, const std::vector<TimedPose>& second,
                             const TemporalParameters& parameters, const Progress& progress)
{
  CheckRanges(parameters);
  std::vector<TimedPose> a = Sorted(first, "first"), b = Sorted(second, "second");
  const double sigma = std::max({parameters.smoothingSeconds, MedianInterval(a), MedianInterval(b)});
  const MotionSmoothing smoothing{sigma, std::max(parameters.longestGapSeconds, 3.0 * sigma)};
  const auto pathOf = [&smoothing](std::vector<TimedPose> poses, const char* which, const Progress& part) {
    try {
      return MotionPath(std::move(poses), smoothing, part);
    } catch (const Error& error) {
      throw Error(error.GetKind(), std::string("temporal calibration, the ") + which + " stream: " + error.what());
    }
  };
  const MotionPath firstPath = pathOf(std::move(a), "first", progress.Part(0.0, 0.3)),
                   secondPath = pathOf(std::move(b), "second", progress.Part(0.3, 0.6));
  RefuseJump(firstPath, sigma / SamplesPerWindow, "first");
  RefuseJump(secondPath, sigma / SamplesPerWindow, "second");
  if (parameters.signal != SpeedSignal::Automatic)
    return Compare(firstPath, secondPath, parameters.signal, sigma, parameters, progress.Part(0.6, 1.0));
  try {
    return Compare(firstPath, secondPath, SpeedSignal::Rotation, sigma, parameters, progress.Part(0.6, 0.8));
  } catch (const Error& byRotation) {
    if (byRotation.GetKind() != Error::Kind::NotPossible)
      throw;
    try {
      TemporalResult result =
          Compare(firstPath, secondPath, SpeedSignal::Translation, sigma, parameters, progress.Part(0.8, 1.0));
      result.notes.push_back(std::string("speeds of rotation did not tell: ") + byRotation.what());
      return result;
    } catch (const Error& byTranslation) {
      if (byTranslation.GetKind() != Error::Kind::NotPossible)
        throw;
      throw Error(Error::Kind::NotPossible,
                  std::string(byRotation.what()) + "; by their speeds of translation neither: " + byTranslation.what());
    }
  }
}

} // namespace echorama
