// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Geometry/RigidTransform.h"
#include "Tracking/Optical/FisheyeLens.h"
#include "Tracking/Optical/ThinPlate.h"
#include <limits>
#include <optional>
#include <vector>

namespace echorama {

/// What all that is known of a camera's optics comes to: a direction is seen at the lens's pixel for it, plus the residual there.
struct CameraOptics {
  FisheyeLens lens;
  ThinPlate residual; ///< over the lens's pixels

  /// The direction, of length 1, that a pixel looks into; nothing beyond the lens's largest angle.
  std::optional<Eigen::Vector3d> DirectionOf(const Eigen::Vector2d& pixel) const;
  /// The pixel of a direction, also beyond the picture's border; nothing beyond the largest angle.
  std::optional<Eigen::Vector2d> PixelOf(const Eigen::Vector3d& direction) const;

  static constexpr Eigen::Index LensUnknowns = 7; ///< focal, centreX, centreY, k1 to k4
  /// Numbers that covariances are of: those of the lens, then the residual's weights of x, then those of y.
  Eigen::Index Unknowns() const { return LensUnknowns + 2 * static_cast<Eigen::Index>(residual.weights.size()); }
  /// How the pixel of a direction follows the direction, and them. Nothing as FisheyeLens::Differentiate().
  struct Derivatives {
    Eigen::Matrix<double, 2, 3> byDirection;
    Eigen::MatrixXd byUnknowns; ///< two rows
  };
  std::optional<Derivatives> Differentiate(const Eigen::Vector3d& direction) const;
};

/// For messages of fits that fail.
constexpr const char* WhatMayBeWrong = "Another mesh, another order of the marks, or a lens or pose that starts too far off?";

/// A point that a camera saw.
struct SeenPoint {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero(); ///< px^2
  Eigen::Vector3d point = Eigen::Vector3d::Zero();      ///< in the frame of its pose, mm
  double pointSigmaMm = 0.0;                            ///< per axis
  std::size_t pose = 0;                                 ///< which of the camera's it was seen from
};

struct CameraFitSettings {
  int residualCentres = 60; ///< at most; 0: none
  double outlierSigmas = 5.0;
  /// Of the start, as far as it is known, in the order of CameraFitResult::covariance. Empty: nearly nothing is known of the lens
  /// and nothing of the poses, and the residual is chosen anew.
  Eigen::MatrixXd covariance;
  /// How well each pose's mount holds the camera where it holds it in the mean of all, from where they start: the same covariance
  /// of each, in the order of a pose's numbers. Empty: poses have nothing to do with each other. Only without \a covariance.
  Eigen::MatrixXd mount;
};

struct CameraFitResult {
  CameraOptics optics;
  std::vector<Pose> poses;
  /// Of CameraOptics::Unknowns(), then of each pose its translation (mm) and rotation vector (radians) in the camera's frame.
  Eigen::MatrixXd covariance;
  std::vector<double> sigmas;      ///< of each point: how many standard deviations it is off
  std::vector<bool> isInlier;      ///< of each point
  double lensRms = 0.0, rms = 0.0; ///< of what is left over by the lens alone, and by all; px per axis, inliers
  double noiseScale = 1.0;         ///< what is left over per what the covariances say; standard deviations
  double contradiction = 0.0;      ///< how much less likely than usual the points are by what was known, in standard deviations
  double smoothness = std::numeric_limits<double>::infinity(); ///< weight of the residual's energy; infinite: no residual
  double residualFreedoms = 0.0;                               ///< effective number
  double misfit = 1.0; ///< what a fit without residual leaves over per what the covariances say, by which priors count more
};

/// The camera that saw \a points, from \a start. Those that nothing can explain are left out.
/// \throws Error(NotPossible) when it does not converge
CameraFitResult FitCamera(const std::vector<SeenPoint>& points, const CameraOptics& start,
                          const std::vector<Pose>& cameraToPoints, const CameraFitSettings& settings);

/// As FitCamera(), from the same arguments, with the residual, its smoothness and the choice of points of its \a result, less the
/// points of which \a isLeftOut: what the camera would be without them.
CameraFitResult RefitCamera(const std::vector<SeenPoint>& points, const CameraOptics& start,
                            const std::vector<Pose>& cameraToPoints, const CameraFitSettings& settings,
                            const CameraFitResult& result, const std::vector<bool>& isLeftOut);

} // namespace echorama
