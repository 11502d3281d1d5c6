// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Core>
#include <vector>

namespace echorama {

/// How noisy a pixel is: variance = readNoise^2 + greyPerElectron * grey level, and that of rounding to whole levels.
struct PixelNoise {
  double readNoise = 1.0;        ///< grey levels
  double greyPerElectron = 0.05; ///< the camera's conversion gain
  double Variance(double grey) const { return readNoise * readNoise + 1.0 / 12.0 + greyPerElectron * (grey > 0.0 ? grey : 0.0); }
};

/// One value to be fitted: a pixel, or the mean of a square of them.
struct SpotSample {
  double x = 0.0, y = 0.0; ///< pixels
  double value = 0.0;      ///< grey levels above \a background
  double background = 0.0; ///< what was subtracted; only the noise depends on it
};

/// peak * exp(-d^T precision d / 2), d = place - centre.
struct GaussianSpot {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double peak = 0.0;
  Eigen::Matrix2d precision = Eigen::Matrix2d::Identity(); ///< inverse of the covariance of the light, 1 / px^2
};

struct SpotFitSettings {
  PixelNoise noise;
  double backgroundNoise = 0.0; ///< variance of the background over that of one frame: 1/n for the mean of n
  double pixelsPerSample = 1.0; ///< what each value is the mean of
  double saturation = 255.0;    ///< values that this or more is expected of are left out
};

struct SpotFitResult {
  bool converged = false;
  std::vector<GaussianSpot> spots;
  std::vector<Eigen::Matrix2d> covariances; ///< of the centres, px^2
  std::vector<double> peakSigmas;           ///< standard deviations of the peaks
  double chiSquared = 0.0;                  ///< per degree of freedom
};

/// Fits Gaussian spots over a common plane to samples by maximum likelihood (Gaussian noise of a variance that depends on the
/// model), from \a start.
SpotFitResult FitSpots(const std::vector<SpotSample>& samples, const std::vector<GaussianSpot>& start,
                       const SpotFitSettings& settings);

} // namespace echorama
