// SPDX-License-Identifier: BSD-3-Clause
// The order of work: check the poses; refuse motions that cannot answer; find what the scans agree on, and who does not
// (HandEyeSearch); ask what the residuals say of the noise (HandEyeComponents), and again who agrees; when they disagree, look
// for the mistake (HandEyeDiagnosis), with the noise estimated, which a mistake makes large, so that noise in another ratio than
// stated is none; refuse again, for the scans that are left; then state how well the target is known (HandEyeModel) and what
// would help (HandEyeAdvice).
//
// The covariance is the inverse of Fisher's information at the optimum, with the noise as stated, scaled to the inliers'
// residuals, or estimated from them in its parts.
#include "Filters/Calibration/HandEye.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Percentile.h"
#include "Core/Base/SymmetricMatrix.h"
#include "Filters/Calibration/CalibrationText.h"
#include "Filters/Calibration/ConfidenceRadius.h"
#include "Filters/Calibration/HandEyeAdvice.h"
#include "Filters/Calibration/HandEyeComponents.h"
#include "Filters/Calibration/HandEyeDiagnosis.h"
#include "Filters/Calibration/HandEyeSearch.h"
#include <algorithm>
#include <cmath>
#include <cstdio>

namespace echorama {
namespace {

constexpr std::size_t LeastForNoise = 5, LeastForRatio = 8; // scans
constexpr int RatioRounds = 5;                              // until the same scans agree
// Residuals of so many times the noise may come from a mistake; are no noise; are no noise either when it is to be estimated.
constexpr double SuspectScale = 1.3, HopelessScale = 10.0, HopelessEstimatedScale = 40.0;
// Three scans agree by chance too easily to outvote another.
constexpr std::size_t LeastMajority = 4, ManyScans = 8;

HandEyeNoise Scaled(HandEyeNoise noise, double scale)
{
  for (PoseNoise* side : {&noise.sensor, &noise.volume}) {
    side->degrees *= scale;
    side->mm *= scale;
  }
  return noise;
}

// Which parts were estimated, and what they are.
std::string TextOf(const HandEyeNoise& noise, const HandEyeNoise& stated, bool withCentre)
{
  std::string text =
      Format("The residuals contradict the ratio of the noises stated; as estimated they are %.2g mm and %.2g degrees of "
             "the sensor, %.2g mm and %.2g degrees of the alignments",
             noise.sensor.mm, noise.sensor.degrees, noise.volume.mm, noise.volume.degrees);
  if (withCentre)
    text += Format(", which turn about (%.1f, %.1f, %.1f) of the volume, %.0f mm from the target", noise.centre.x(),
                   noise.centre.y(), noise.centre.z(), (noise.centre - stated.centre).norm());
  return text + ".";
}

// A sensor pose that comes again with another alignment was not read anew, or the scan was aligned twice.
void NoteStalePoses(const std::vector<HandEyePair>& pairs, std::vector<std::string>& notes)
{
  for (std::size_t i = 0; i < pairs.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (pairs[i].sensorToTracker.isApprox(pairs[j].sensorToTracker, 1e-12)) {
        notes.push_back("The sensor poses of " + pairs[j].name + " and " + pairs[i].name +
                        " are the same, their alignments are not: was the tracker read anew?");
        break;
      }
}

// The typical residual, for messages.
std::string TypicalResidual(const HandEyeModel& model, const HandEyeSolution& solution)
{
  std::vector<double> mm, degrees;
  for (int i = 0; i < model.Count(); ++i) {
    const Twist residual = model.Residual(i, solution);
    mm.push_back(Exp(residual).translation().norm());
    degrees.push_back(residual.tail<3>().norm() * DegreesPerRadian);
  }
  return Format("%.3g mm and %.3g degrees", Median(std::move(mm)), Median(std::move(degrees)));
}

} // namespace

ParameterList Describe(HandEyeParameters& p)
{
  const ParameterRange degrees{0, 45}, mm{0, 100};
  return {
      Parameter("Target", p.target, {}, "mm", "Where in the volume the error counts, in the volume's frame: usually its centre."),
      Parameter("SensorNoiseDegrees", p.sensorNoise.degrees, degrees, "degrees",
                "Standard deviation of the sensor's turns by the tracker, about each of its own axes."),
      Parameter("SensorNoiseMm", p.sensorNoise.mm, mm, "mm",
                "Standard deviation of the sensor's position by the tracker, along each of its own axes."),
      Parameter("VolumeNoiseDegrees", p.volumeNoise.degrees, degrees, "degrees",
                "Standard deviation of the turns of the alignments, about each axis of the volume."),
      Parameter("VolumeNoiseMm", p.volumeNoise.mm, mm, "mm",
                "Standard deviation of the target's place by the alignments, along each axis of the volume."),
      Parameter(
          "EstimateNoise", p.estimateNoise,
          "Whether the noise is estimated from the residuals: its size from five scans that agree; from eight also the ratio "
          "of its parts, and about which point of the volume alignments err, where residuals contradict what is stated. "
          "Otherwise it stays as stated. Notes say which."),
      Parameter("RejectOutliers", p.rejectOutliers, "Whether scans that do not agree with the others are left out, and named."),
      Parameter("Seed", p.seed, {0, 9223372036854775807.0}, "", "Seed of the search for scans that agree.").Advanced(),
  };
}

HandEyeParameters HandEyeParameters::With(const HandEyeNoise& noise) const
{
  HandEyeParameters changed = *this;
  changed.sensorNoise = noise.sensor;
  changed.volumeNoise = noise.volume;
  return changed;
}

void HandEyeParameters::Check() const
{
  CheckRanges(*this);
  if (!(std::max(sensorNoise.degrees, volumeNoise.degrees) >= 1e-6 && std::max(sensorNoise.mm, volumeNoise.mm) >= 1e-6))
    throw Error(Error::Kind::InvalidParameter,
                "hand-eye calibration: the noise of one side at least must not be zero (1e-6 degrees and mm)");
}

HandEyeResult CalibrateHandEye(const std::vector<HandEyePair>& given, const HandEyeParameters& parameters,
                               const Progress& progress)
{
  parameters.Check();
  const std::vector<HandEyePair> named = CheckedHandEyePairs(given);

  // Each scan once.
  HandEyeResult result;
  const std::vector<int> repeats = HandEyeRepeats(named);
  std::vector<HandEyePair> pairs;
  std::vector<std::size_t> numbers; // in the order given
  std::string repeatText;
  for (std::size_t i = 0; i < named.size(); ++i)
    if (repeats[i] < 0) {
      pairs.push_back(named[i]);
      numbers.push_back(i);
    } else
      repeatText +=
          (repeatText.empty() ? "" : "; ") + named[i].name + " repeats " + named[static_cast<std::size_t>(repeats[i])].name;
  if (pairs.size() < 3 && !repeatText.empty())
    RefuseHandEye(Format("three different scans are needed at least, and there %s %d (", pairs.size() == 1 ? "is" : "are",
                         static_cast<int>(pairs.size())) +
                  repeatText + ")");
  RefuseTooLittleMotion(pairs, parameters.sensorNoise, parameters.volumeNoise);
  if (!repeatText.empty())
    result.notes.push_back("Counted once: " + repeatText + ".");
  NoteStalePoses(pairs, result.notes);

  // The solution.
  const std::size_t count = pairs.size();
  const HandEyeNoise stated = parameters.Noise();
  HandEyeModel model(pairs, stated, parameters.target);
  const auto search = [&](bool estimate, const Progress& part) {
    return FindHandEyeConsensus(pairs, model, parameters.rejectOutliers, parameters.target, estimate, parameters.seed, part);
  };
  const auto inliersOf = [](const HandEyeConsensus& found) {
    return static_cast<std::size_t>(std::count(found.inlier.begin(), found.inlier.end(), 1));
  };
  result.noiseEstimated = parameters.estimateNoise && count >= LeastForNoise;
  HandEyeConsensus consensus = search(result.noiseEstimated, progress.Part(0.0, 0.4));
  if (result.noiseEstimated && inliersOf(consensus) < LeastForNoise) {
    result.noiseEstimated = false;
    consensus = search(false, progress.Part(0.4, 0.7));
  }
  if (parameters.estimateNoise && !result.noiseEstimated)
    result.notes.push_back(Format("The noise was taken as stated: it cannot be estimated from fewer than %d scans that agree.",
                                  static_cast<int>(LeastForNoise)));

  // Do they agree at all?
  const auto refuseMistake = [&](const HandEyeNoise& noise) {
    const std::string explanation = ExplainDisagreement(pairs, parameters, noise, consensus, progress.Part(0.8, 0.9));
    if (!explanation.empty())
      RefuseHandEye("the scans do not agree with each other: typically " + TypicalResidual(model, consensus.fit.solution) +
                    " are left. " + explanation);
  };
  const auto tooFew = [count](std::size_t inliers) {
    return inliers < count && (inliers < LeastMajority || 2 * inliers < count);
  };
  const auto refuseTooFew = [&] {
    RefuseHandEye(Format("no more than %d of %d scans agree with each other, which may be chance. Check that every sensor pose "
                         "belongs to its volume, or add scans",
                         static_cast<int>(inliersOf(consensus)), static_cast<int>(count)));
  };
  const double scale = consensus.scale; // of the noise as stated
  if (tooFew(inliersOf(consensus)) || scale > (result.noiseEstimated ? HopelessEstimatedScale : HopelessScale)) {
    refuseMistake(stated);
    if (tooFew(inliersOf(consensus)))
      refuseTooFew();
    RefuseHandEye("the scans do not agree with each other: typically " + TypicalResidual(model, consensus.fit.solution) +
                  Format(" are left, %.3g times the noise stated. Check that every sensor pose belongs to its volume", scale));
  }

  // What residuals say of the noise, and who agrees when they are weighed by it.
  HandEyeComponents components;
  for (int round = 0; result.noiseEstimated && round < RatioRounds && inliersOf(consensus) >= LeastForRatio; ++round) {
    const HandEyeComponents found = EstimateHandEyeComponents(model, stated, consensus.fit.solution, consensus.inlier);
    if (!found.ratio)
      break;
    components = found;
    model.SetNoise(found.noise);
    const std::vector<char> before = consensus.inlier;
    consensus = HandEyeConsensusNear(found.solution, 1.0, model, parameters.rejectOutliers, true);
    progress(0.7 + 0.02 * round);
    if (consensus.inlier == before)
      break;
  }
  const std::size_t inliers = inliersOf(consensus);
  if (scale > SuspectScale || (inliers < count && (count < ManyScans || 4 * inliers < 3 * count)))
    refuseMistake(components.ratio ? components.noise : stated);
  if (tooFew(inliers))
    refuseTooFew();
  result.ratioEstimated = components.ratio;
  result.centreEstimated = components.centre;
  result.noise = components.ratio ? components.noise : stated;
  result.solution = consensus.fit.solution;
  progress(0.9);

  // How every scan fits.
  double sumMm = 0.0, sumDegrees = 0.0, chiSquare = 0.0;
  result.residuals.resize(named.size());
  const Eigen::Matrix<double, 6, 6> weight = InverseOfSymmetric(model.Covariance(result.solution.volumeToSensor));
  std::string outliers;
  for (std::size_t i = 0; i < count; ++i) {
    HandEyeResidual& residual = result.residuals[numbers[i]];
    const Twist twist = model.Residual(static_cast<int>(i), result.solution);
    residual.name = pairs[i].name;
    residual.mm = Exp(twist).translation().norm();
    residual.degrees = twist.tail<3>().norm() * DegreesPerRadian;
    residual.inlier = consensus.inlier[i] != 0;
    if (residual.inlier) {
      ++result.inliers;
      sumMm += residual.mm * residual.mm;
      sumDegrees += residual.degrees * residual.degrees;
      chiSquare += twist.dot(weight * twist);
    } else {
      residual.reason = Format("%.1f mm and %.1f degrees from where the others place it, %.0f times what the noise explains",
                               residual.mm, residual.degrees, std::sqrt(consensus.square[i] / 6.0));
      outliers += (outliers.empty() ? "" : ", ") + residual.name;
    }
  }
  result.rmsMm = std::sqrt(sumMm / result.inliers);
  result.rmsDegrees = std::sqrt(sumDegrees / result.inliers);
  for (std::size_t i = 0; i < named.size(); ++i)
    if (repeats[i] >= 0) {
      result.residuals[i] = result.residuals[numbers[static_cast<std::size_t>(
          std::find(numbers.begin(), numbers.end(), static_cast<std::size_t>(repeats[i])) - numbers.begin())]];
      result.residuals[i].name = named[i].name;
      result.residuals[i].inlier = false;
      result.residuals[i].reason = "repeats " + named[static_cast<std::size_t>(repeats[i])].name;
    }
  if (!outliers.empty())
    result.notes.push_back("Left out, because they do not agree with the others: " + outliers + ".");

  // The noise that the residuals show.
  const int degreesOfFreedom = 6 * result.inliers - 12;
  const double shown = degreesOfFreedom > 0 ? std::sqrt(chiSquare / degreesOfFreedom) : 1.0;
  if (result.ratioEstimated)
    result.notes.push_back(TextOf(result.noise, stated, result.centreEstimated));
  else if (result.noiseEstimated)
    result.noiseScale = std::max(shown, 1e-6);
  else if (chiSquare > degreesOfFreedom + 4.0 * std::sqrt(2.0 * degreesOfFreedom))
    result.notes.push_back(
        Format("The residuals are %.1f times what the noise stated explains, so the 95%% region is too small: let the "
               "noise be estimated, or state more.",
               shown));
  else if (degreesOfFreedom >= 18 && shown < 0.5)
    result.notes.push_back(
        Format("The residuals are %.2g times what the noise stated explains, so the 95%% region is too large: let the "
               "noise be estimated, or state less.",
               shown));

  // Are those that are left enough?
  std::vector<HandEyePair> agreed;
  for (std::size_t i = 0; i < count; ++i)
    if (consensus.inlier[i])
      agreed.push_back(pairs[i]);
  const HandEyeNoise used = Scaled(result.noise, result.noiseScale);
  RefuseTooLittleMotion(agreed, used.sensor, used.volume);

  RefuseTwoAnswers(pairs, consensus.inlier, model, result.solution, parameters.target, result.noiseScale);

  // How well it is known.
  const HandEyeMatrix covariance =
      result.ratioEstimated
          ? components.covariance
          : HandEyeMatrix(result.noiseScale * result.noiseScale * model.CovarianceOfStep(result.solution, consensus.inlier));
  if (!covariance.allFinite() || covariance.diagonal().minCoeff() <= 0.0)
    RefuseHandEye("the motions do not determine the calibration; add scans that turn about other axes");
  result.covariance = model.CovarianceOfPoses(covariance);
  const Eigen::Matrix3d& R = result.solution.volumeToSensor.linear();
  result.targetCovariance = R * covariance.topLeftCorner<3, 3>() * R.transpose();
  result.targetRmsMm = std::sqrt(result.targetCovariance.trace());
  const int residualFreedom = result.ratioEstimated   ? static_cast<int>(components.degreesOfFreedom)
                              : result.noiseEstimated ? degreesOfFreedom
                                                      : 0;
  result.targetRadius95Mm = ConfidenceRadius(result.targetCovariance, residualFreedom);

  result.advice = AdviseHandEye(pairs, consensus.inlier, result.solution, covariance, used, parameters.target, residualFreedom);
  for (const std::string& note : HandEyeSuspicions(agreed, result.solution, parameters))
    result.notes.push_back(note);
  progress(1.0);
  return result;
}

} // namespace echorama
