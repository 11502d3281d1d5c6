// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Tracking/Optical/GreyFrame.h"
#include "Tracking/Optical/LightsOffBackground.h"
#include "Tracking/Optical/SpotFit.h"
#include <cstdint>
#include <string>
#include <vector>

namespace echorama {

/// How the place of a spot is found.
enum class SpotMethod {
  Gaussian, ///< a fit of elliptic Gaussians over a plane, without saturated pixels; spots that touch are fitted together
  Centroid, ///< eq. 7.1 of the dissertation: the centre of mass of what exceeds the threshold
};

struct SpotDetectorParameters {
  SpotMethod method = SpotMethod::Gaussian;
  double threshold = 10.0;   ///< grey levels above the background
  double significance = 6.0; ///< and this many standard deviations of the noise
  int minimumPixels = 3;     ///< above the threshold, connected
  double minimumSize = 0.7, maximumSize = 20.0;
  double readNoise = 1.0, greyPerElectron = 0.05;
  int saturation = 255;
  int maximumSpots = 16;
  double maximumChange = 0.1;
};
ParameterList Describe(SpotDetectorParameters& p);

/// A light, as a camera sees it.
struct Spot {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();   ///< pixels; (0, 0) is the centre of the first
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero(); ///< of the position, px^2
  double peak = 0.0;                                    ///< grey levels above the background, of saturated ones as fitted
  double peakSigma = 0.0;                               ///< its standard deviation
  double size = 0.0;                                    ///< standard deviation of the light, px: geometric mean of both axes
  double elongation = 1.0;                              ///< long over short axis
  double chiSquared = 0.0;                              ///< of the fit, per degree of freedom; 0 for centroids
  int saturatedPixels = 0;

  double Brightness() const { return 6.283185307179586 * peak * size * size; } ///< grey levels, summed over all pixels
};

enum class FrameState {
  Good,
  TooBright, ///< much of the picture is saturated: no light can be seen there
  Changed,   ///< much of it is brighter than the background: that is of another time
};

struct SpotFrame {
  std::vector<Spot> spots; ///< the brightest first
  FrameState state = FrameState::Good;
  double saturatedShare = 0.0; ///< of all pixels
  double changedShare = 0.0;   ///< of all pixels: those above the threshold
  int refused = 0;             ///< candidates that are no spots: too small, too large, too weak, or no fit
  std::string message;         ///< of a state that is not good: what it is and what helps
};

/// Finds lights in the frames of one camera (dissertation 7.5).
///
/// With a background (frames with all lights off) the difference is searched. Without one, what stands out of its surroundings
/// is, which a shadow's edge may do as well.
class SpotDetector {
public:
  /// \throws Error(InvalidParameter)
  explicit SpotDetector(const SpotDetectorParameters& parameters = {});

  /// \param background as large as the frame and complete, or nullptr.
  /// \throws Error(BadInput) for an empty frame, or a background that does not fit
  SpotFrame Detect(const GreyFrame& frame, const LightsOffBackground* background = nullptr);

private:
  struct Candidate;
  struct Run {
    int y, begin, end;
  };
  struct Source { // what is being searched
    const std::uint8_t* frame;
    const std::uint8_t* floor; // what is subtracted before the threshold
    const LightsOffBackground* background;
    int width, height;
    double Value(int x, int y) const;      // above the background, as the fit sees it
    double Background(int x, int y) const; // what was subtracted
    bool Covers(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height; }
  };

  void MakeSurroundings(const Source& source);
  void FindRuns(const Source& source, SpotFrame& out);
  std::vector<Candidate> Join(const Source& source);
  void AddCentroid(const Source& source, const Candidate& candidate, SpotFrame& out) const;
  void FitGroup(const Source& source, const std::vector<const Candidate*>& group, SpotFrame& out);
  bool Accept(const Source& source, const SpotFitResult& fit, SpotFrame& out) const;
  std::vector<SpotSample> Samples(const Source& source, const std::vector<GaussianSpot>& spots, int bin,
                                  double& noiseShare) const;

  SpotDetectorParameters parameters_;
  PixelNoise noise_;
  std::uint8_t thresholds_[256]; // by what is subtracted
  std::vector<std::uint8_t> mono_, surroundings_;
  std::vector<Run> runs_;
};

} // namespace echorama
