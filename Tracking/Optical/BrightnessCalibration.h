// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Optical/SpotDetector.h"
#include <vector>

namespace echorama {

/// A light that touched the skin, as it was seen there.
struct ContactSample {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  double peak = 0.0, size = 0.0;
};

/// How bright and how large a touching light looks everywhere in the picture (dissertation 7.3): lenses darken towards the
/// border, and what is far or seen aslant is smaller. Nodes lie on a grid over the picture, bilinear between them.
struct BrightnessCalibration {
  int columns = 0, rows = 0;      ///< nodes; none: nothing is calibrated
  int width = 0, height = 0;      ///< of the picture, pixels
  std::vector<double> peak, size; ///< of the nodes, rows of columns

  /// From lights that touched: local means of the logarithms, by Gaussian weights as wide as a cell of the grid or as the nearest
  /// sample is far. \throws Error(BadInput) without samples, or with one that is not above 0
  static BrightnessCalibration Fit(const std::vector<ContactSample>& samples, int width, int height, int columns = 9,
                                   int rows = 7);

  bool Empty() const { return peak.empty(); }
  /// What a touching light would be there.
  ContactSample At(const Eigen::Vector2d& position) const;
};

enum class Touch {
  Unknown, ///< not calibrated
  Contact,
  Hover, ///< its light reaches the skin, it does not
};

/// Clearly darker or larger than a touching light it hovers; it touches again when it is nearer to one in both, so that noise
/// does not make it blink between both.
Touch JudgeTouch(const Spot& spot, const BrightnessCalibration& calibration, Touch before);

} // namespace echorama
