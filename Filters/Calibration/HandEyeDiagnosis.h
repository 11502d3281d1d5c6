// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Calibration/HandEyeSearch.h"
#include <string>
#include <vector>

namespace echorama {

/// The name of a scan for messages: its own, or "scan 3".
std::string HandEyeScanName(const std::vector<HandEyePair>& pairs, std::size_t scan);

/// The pairs with rotations that are orthonormal to the last bit. \throws Error(BadInput) that names the scan and the side when a
/// pose is not finite, not rigid (NearestPose) or a reflection.
std::vector<HandEyePair> CheckedHandEyePairs(const std::vector<HandEyePair>& pairs);

/// For every pair the first one that it repeats, both sides to 1e-9, or -1: the same scan entered twice is no evidence.
std::vector<int> HandEyeRepeats(const std::vector<HandEyePair>& pairs);

/// \throws Error(NotPossible) with the reason when the motions cannot determine C: fewer than three scans; no turns, or no more
/// than the noise; turns about parallel axes only.
void RefuseTooLittleMotion(const std::vector<HandEyePair>& pairs, const PoseNoise& sensorNoise, const PoseNoise& volumeNoise);

/// \throws Error(NotPossible) when another calibration fits the inliers nearly as well as \a solution, the best: one turned by
/// half a turn about an axis that all turns keep or reverse (HandEyeRivalAxes). Says which axis, and what scan would decide.
void RefuseTwoAnswers(const std::vector<HandEyePair>& pairs, const std::vector<char>& inlier, const HandEyeModel& model,
                      const HandEyeSolution& solution, const Eigen::Vector3d& target, double noiseScale);

/// When the scans do not agree well: what would make them, as a sentence. Tried are lengths in metres, centimetres and inches on
/// either side, and one side given the wrong way round, alone and with a side in metres. Empty when nothing explains the scans a
/// thousand times better than \a consensus, by their likelihoods with this \a noise. Of more than 60 scans 60 are asked, evenly
/// chosen. \throws Error(Cancelled).
std::string ExplainDisagreement(const std::vector<HandEyePair>& pairs, const HandEyeParameters& parameters,
                                const HandEyeNoise& noise, const HandEyeConsensus& consensus, const Progress& progress = {});

/// What looks strange although the scans agree: both sides in metres, a lever that suggests both inverted. Sentences.
std::vector<std::string> HandEyeSuspicions(const std::vector<HandEyePair>& pairs, const HandEyeSolution& solution,
                                           const HandEyeParameters& parameters);

} // namespace echorama
