// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Tracking/Optical/CameraFit.h"
#include "Tracking/Optical/TrackedSkin.h"
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace echorama {

/// A light was put on a mark of the skin, and seen.
struct SurfaceObservation {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero(); ///< px^2, as spots carry it; 0: as good as FloorPx
  Eigen::Vector3d point = Eigen::Vector3d::Zero();      ///< of the skin, mm
  int mark = -1;                                        ///< its number, for messages; -1: none
};

/// Where on the skin a pixel is.
struct MappedPoint {
  enum class Status {
    Mapped,
    NotCovered, ///< no observation of the calibration is near that pixel, or it is not finite
    NoSkin,     ///< the ray passes by the mesh
  };
  Status status = Status::NotCovered;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();      ///< mm, in the shell's frame
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();     ///< of length 1, away from the camera
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero(); ///< mm^2, along the skin: of the pixel and of the calibration
  double incidenceDegrees = 0.0;                        ///< between ray and normal: 90 is grazing
  bool isAtEdge = false; ///< within its uncertainty there may be other skin, behind a fold or beside the mesh: see covariance as
                         ///< a lower bound

  double SigmaMm() const; ///< the largest standard deviation along the skin
};

/// A camera's optics, known for some part of its picture, and how they sit in the camera's housing. Plain data.
struct LensCalibration {
  CameraOptics optics;
  PixelCoverage covered;
  /// The frame that the optics are known in is that which fits them best; that of the housing, in which drawings of shells have
  /// the camera, may be a degree off.
  Pose cameraToHousing = Pose::Identity();
  Eigen::MatrixXd covariance; ///< of optics.Unknowns(), then of cameraToHousing, as SurfaceMapState's
};

/// All that a SurfaceMap is made of, but for the skin. Plain data.
struct SurfaceMapState {
  CameraOptics optics;
  PixelCoverage covered;
  Pose cameraToShell = Pose::Identity(); ///< the camera looks along +z of its own frame
  /// Of optics.Unknowns(), then of the camera's translation (mm) and rotation vector (radians) in its own frame.
  Eigen::MatrixXd covariance;
};

/// From a pixel to the skin. Questions may come from any number of threads. Copies share the skin.
class SurfaceMap {
public:
  SurfaceMap() = default;
  /// \throws Error(BadInput) that says what of \a state does not belong together
  SurfaceMap(SurfaceMapState state, std::shared_ptr<const TrackedSkin> skin);

  /// \param covariance of the pixel, px^2
  MappedPoint Map(const Eigen::Vector2d& pixel, const Eigen::Matrix2d& covariance = Eigen::Matrix2d::Zero()) const;
  /// The other way, whether or not other skin hides the point. Nothing for what the lens does not see.
  std::optional<Eigen::Vector2d> PixelOf(const Eigen::Vector3d& pointOfSkin) const;

  const SurfaceMapState& State() const { return state_; }
  const std::shared_ptr<const TrackedSkin>& Skin() const { return skin_; }

private:
  SurfaceMapState state_;
  std::shared_ptr<const TrackedSkin> skin_;
};

struct SurfaceMapParameters {
  int residualCentres = 60;
  double placementMm = 0.1, floorPx = 0.01;
  double mountMm = 0.2, mountDegrees = 0.2;
  double outlierSigmas = 5.0, mostOutliers = 0.3;
  double mostResidualPx = 3.0, mostFromSkinMm = 2.0;
  double leastCoverage = 0.05;
  int folds = 10;
  std::uint64_t seed = 1;
};
ParameterList Describe(SurfaceMapParameters& p);

/// An observation that nothing could explain.
struct SurfaceOutlier {
  std::size_t observation = 0; ///< its place in the list
  int mark = -1;
  double sigmas = 0.0; ///< how many standard deviations it is off
};

/// How good a calibration is.
struct SurfaceMapReport {
  std::size_t observations = 0, inliers = 0;
  std::vector<SurfaceOutlier> outliers;  ///< worst first
  double lensPx = 0.0, residualPx = 0.0; ///< root mean square per axis that the lens leaves over, and lens and residual together
  double residualFreedoms = 0.0;         ///< effective number; 0: the residual was of no use
  double coverage = 0.0;                 ///< of the picture, by the hull of the observations
  /// Observations that were left out of the fit, in turns: how far from their marks the map then has them, mm. Without a mesh,
  /// how far their marks are from their rays.
  double heldOutMedianMm = 0.0, heldOut95Mm = 0.0, heldOutMostMm = 0.0;
  std::size_t heldOut = 0, heldOutRefused = 0; ///< measured; without an answer, as most at the border have none
  int foldsLost = 0;                           ///< fits without some observations that did not converge
  /// Of a placed camera: how much less likely than usual the observations are, by what is known of lens and mount; standard
  /// deviations. Beyond OutlierSigmas both cannot be right, and the map's uncertainty is wider by what they differ.
  double contradiction = 0.0;
  bool isContradicted = false;

  std::string Text() const; ///< lines for people
};

struct FittedSurfaceMap {
  SurfaceMap map;
  SurfaceMapReport report;
};

/// Calibrates a camera in its shell, from marks that were seen. \param lens nominal: its width, height and largest angle are kept
/// \param cameraToShell roughly
/// \throws Error(InvalidParameter); Error(BadInput) for observations that are not finite, too few, of one corner alone, or not on
/// this skin; Error(NotPossible) when they fit no camera
FittedSurfaceMap FitSurfaceMap(const std::vector<SurfaceObservation>& observations, std::shared_ptr<const TrackedSkin> skin,
                               const FisheyeLens& lens, const Pose& cameraToShell, const SurfaceMapParameters& parameters = {},
                               const Progress& progress = {});

/// Observations from one place of the camera, on a shape whose points are known: a dome with marks.
struct LensObservations {
  std::vector<SurfaceObservation> observations;
  Pose housingToShape = Pose::Identity(); ///< as the shape is drawn; the fit begins there
};

struct FittedLens {
  LensCalibration lens;
  std::vector<Pose> cameraToShapes;
  SurfaceMapReport report;
};

/// Calibrates a camera for any shell: with shapes of different size, depth does not pass for direction. Where the optics sit in
/// the housing is the mean of what the shapes say, which differ by their mounts (MountMm, MountDegrees). \throws as FitSurfaceMap
FittedLens FitLens(const std::vector<LensObservations>& shapes, const FisheyeLens& lens,
                   const SurfaceMapParameters& parameters = {}, const Progress& progress = {});

/// A calibrated camera in another shell, whose file says where it holds the housing, and by some observations, or none.
/// \throws Error(InvalidParameter); Error(BadInput) for observations as above, but few will do; Error(NotPossible) when they do
/// not fit
FittedSurfaceMap PlaceSurfaceMap(const LensCalibration& lens, std::shared_ptr<const TrackedSkin> skin, const Pose& housingToShell,
                                 const std::vector<SurfaceObservation>& observations = {},
                                 const SurfaceMapParameters& parameters = {}, const Progress& progress = {});

} // namespace echorama
