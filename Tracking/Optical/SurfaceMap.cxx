// SPDX-License-Identifier: BSD-3-Clause
// A pixel's ray is met with the mesh. Where its pixel may be, by its own covariance and by that of everything the calibration
// found, is one 2 x 2 matrix in the picture; the slope of the skin at the hit makes millimetres of it, the more the more the skin
// is seen aslant. Whether that slope holds as far as the uncertainty reaches, four more rays tell.
//
// Cost of a question: five rays, the distances to all observations of the calibration, and the square of its unknowns.
#include "SurfaceMap.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Percentile.h"
#include "Core/Base/Random.h"
#include "Core/Base/SymmetricMatrix.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>
#include <map>
#include <numeric>

namespace echorama {

using Eigen::Index;
using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;

ParameterList Describe(SurfaceMapParameters& p)
{
  return {
      Parameter("ResidualCentres", p.residualCentres, {0, 400}, "",
                "Of the smooth field by which the lens may differ from its model; 0: none."),
      Parameter("PlacementMm", p.placementMm, {0, 10}, "mm",
                "How well lights were put on their marks: standard deviation, per axis."),
      Parameter("FloorPx", p.floorPx, {1e-6, 10}, "pixels", "No pixel is known better: standard deviation, per axis."),
      Parameter("MountMm", p.mountMm, {1e-4, 100}, "mm",
                "How well shells hold the camera where they are drawn to: standard deviation, per axis.")
          .Advanced(),
      Parameter("MountDegrees", p.mountDegrees, {1e-4, 90}, "degrees", "The same of its direction.").Advanced(),
      Parameter("OutlierSigmas", p.outlierSigmas, {2, 100}, "", "Observations further off, in standard deviations, are left out.")
          .Advanced(),
      Parameter("MostOutliers", p.mostOutliers, {0, 0.5}, "", "With a larger share of outliers the calibration fails.")
          .Advanced(),
      Parameter("MostResidualPx", p.mostResidualPx, {0.01, 100}, "pixels",
                "With more left over, root mean square per axis, the calibration fails.")
          .Advanced(),
      Parameter("MostFromSkinMm", p.mostFromSkinMm, {0.01, 100}, "mm",
                "When half of the marks are further from the mesh, it is not that of this shell.")
          .Advanced(),
      Parameter("LeastCoverage", p.leastCoverage, {0, 1}, "", "Share of the picture within the observations, for a calibration.")
          .Advanced(),
      Parameter("Folds", p.folds, {2, 100}, "", "Parts of the observations that are left out in turns, to measure errors.")
          .Advanced(),
      Parameter("Seed", p.seed, {}, "", "Of what is left out when.").Advanced(),
  };
}

namespace {

std::string NameOf(std::size_t number, int mark)
{
  return "observation " + std::to_string(number) + (mark >= 0 ? " (mark " + std::to_string(mark) + ")" : "");
}

[[noreturn]] void FailInput(const std::string& reason)
{
  throw Error(Error::Kind::BadInput, reason);
}

// What the fit takes; \a skin may be nullptr, when there is none.
void CollectSeen(const std::vector<SurfaceObservation>& observations, const TrackedSkin* skin, const FisheyeLens& lens,
                 const SurfaceMapParameters& p, std::size_t pose, std::vector<SeenPoint>& points)
{
  std::vector<double> distances;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const SurfaceObservation& o = observations[i];
    if (!(o.pixel.allFinite() && o.point.allFinite() && o.covariance.allFinite()))
      FailInput(NameOf(i, o.mark) + " is not finite");
    if (!(o.covariance(0, 0) >= 0.0 && o.covariance(1, 1) >= 0.0 && o.covariance.determinant() >= 0.0 &&
          std::abs(o.covariance(0, 1) - o.covariance(1, 0)) <= 1e-9 * o.covariance.norm()))
      FailInput("the covariance of " + NameOf(i, o.mark) + " is none");
    if (!lens.Covers(o.pixel))
      FailInput(NameOf(i, o.mark) + " is at pixel (" + Format("%g, %g", o.pixel.x(), o.pixel.y()) +
                "), outside of the picture of " + std::to_string(lens.width) + " x " + std::to_string(lens.height));
    SeenPoint point;
    point.pixel = o.pixel;
    point.covariance = o.covariance + p.floorPx * p.floorPx * Matrix2d::Identity();
    point.point = o.point;
    point.pointSigmaMm = p.placementMm;
    point.pose = pose;
    if (skin != nullptr) {
      const auto nearest = skin->NearestTo(o.point);
      if (!nearest)
        FailInput(NameOf(i, o.mark) + " is too far from the skin");
      distances.push_back(nearest->distanceMm);
      point.point += nearest->seen - nearest->point; // through the wall
    }
    points.push_back(point);
  }
  if (!distances.empty() && Median(distances) > p.mostFromSkinMm)
    FailInput("the observations are not on this skin: half of their points are " + Format("%.3g", Median(distances)) +
              " mm or more from it, more than MostFromSkinMm (" + Format("%g", p.mostFromSkinMm) + ")");
}

void CheckEnough(const std::vector<SeenPoint>& points, const FisheyeLens& lens, const SurfaceMapParameters& p)
{
  constexpr std::size_t Fewest = 20; // thirteen unknowns, and some to tell outliers
  if (points.size() < Fewest)
    FailInput("a calibration takes " + std::to_string(Fewest) + " observations at least; there are " +
              std::to_string(points.size()));
  std::vector<Vector2d> pixels;
  for (const SeenPoint& point : points)
    pixels.push_back(point.pixel);
  const double share = PixelCoverage::Of(pixels).HullArea() / (static_cast<double>(lens.width) * lens.height);
  if (!(share >= p.leastCoverage))
    FailInput(Format("all observations lie within %.2g%% of the picture; LeastCoverage is %g%%", 100.0 * share,
                     100.0 * p.leastCoverage));
}

std::vector<Vector2d> InlierPixels(const std::vector<SeenPoint>& points, const std::vector<bool>& isInlier)
{
  std::vector<Vector2d> pixels;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (isInlier[i])
      pixels.push_back(points[i].pixel);
  return pixels;
}

// Angles that the fitted lens does not hold for are none of its.
void LimitLens(CameraFitResult& fit, const std::vector<SeenPoint>& points)
{
  FisheyeLens& lens = fit.optics.lens;
  double seen = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (fit.isInlier[i]) {
      const Vector3d at = fit.poses[points[i].pose].inverse(Eigen::Isometry) * points[i].point;
      seen = std::max(seen, std::atan2(std::hypot(at.x(), at.y()), at.z()) * DegreesPerRadian);
    }
  lens.maximumAngle = std::max(lens.GrowsUpTo(), 5.0);
  if (seen > lens.maximumAngle)
    throw Error(Error::Kind::NotPossible,
                Format("the observations fit no lens: its picture would fold at %.3g degrees from the axis, and they reach %.3g",
                       lens.maximumAngle, seen));
}

SurfaceMapReport Judge(const CameraFitResult& fit, const std::vector<SeenPoint>& points, const std::vector<int>& marks,
                       const SurfaceMapParameters& p)
{
  SurfaceMapReport report;
  report.observations = points.size();
  for (std::size_t i = 0; i < points.size(); ++i)
    if (fit.isInlier[i])
      ++report.inliers;
    else
      report.outliers.push_back({i, marks[i], fit.sigmas[i]});
  std::stable_sort(report.outliers.begin(), report.outliers.end(),
                   [](const SurfaceOutlier& a, const SurfaceOutlier& b) { return a.sigmas > b.sigmas; });
  report.lensPx = fit.lensRms;
  report.residualPx = fit.rms;
  report.residualFreedoms = fit.residualFreedoms;
  report.contradiction = fit.contradiction;
  report.isContradicted = fit.contradiction > p.outlierSigmas;
  // Of the lens alone: a soft residual would explain another mesh, too.
  if (fit.lensRms > p.mostResidualPx)
    throw Error(
        Error::Kind::NotPossible,
        Format("the observations fit no camera inside this shell: a lens leaves %.3g pixels over (MostResidualPx is %g). ",
               fit.lensRms, p.mostResidualPx) +
            WhatMayBeWrong);
  if (static_cast<double>(report.outliers.size()) > p.mostOutliers * static_cast<double>(points.size()))
    throw Error(Error::Kind::NotPossible,
                std::to_string(report.outliers.size()) + " of " + std::to_string(points.size()) +
                    " observations do not fit to the others, more than MostOutliers allows; the worst is " +
                    NameOf(report.outliers[0].observation, report.outliers[0].mark) + ". " + WhatMayBeWrong);
  return report;
}

// Leaves out observations in turns. Those of one mark stay together: they share the hand's error.
void MeasureHeldOut(const std::vector<SeenPoint>& points, const std::vector<int>& marks, const TrackedSkin* skin,
                    const CameraOptics& start, const std::vector<Pose>& startPoses, const CameraFitSettings& settings,
                    const CameraFitResult& fit, const SurfaceMapParameters& p, const Progress& progress, SurfaceMapReport& report)
{
  std::map<std::pair<std::size_t, int>, std::size_t> numbers;
  std::vector<std::size_t> markOf;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::pair<std::size_t, int> key(points[i].pose, marks[i] >= 0 ? marks[i] : -1 - static_cast<int>(i));
    markOf.push_back(numbers.emplace(key, numbers.size()).first->second);
  }
  const auto folds = static_cast<std::size_t>(p.folds);
  if (numbers.size() < 2 * folds)
    return;
  std::vector<std::size_t> order(numbers.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  Random random(p.seed);
  for (std::size_t i = order.size(); i > 1; --i)
    std::swap(order[i - 1], order[random.Below(i)]);

  std::vector<double> errors(points.size(), -1.0); // negative: none
  std::vector<char> refused(points.size(), 0), foldsLost(folds, 0);
  ParallelFor(p.folds, progress, [&](std::ptrdiff_t fold) {
    std::vector<bool> isLeftOut(points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
      isLeftOut[i] = order[markOf[i]] % folds == static_cast<std::size_t>(fold);
    CameraFitResult refit;
    try {
      refit = RefitCamera(points, start, startPoses, settings, fit, isLeftOut);
    } catch (const Error&) { // all others converged, and so did the whole
      foldsLost[static_cast<std::size_t>(fold)] = 1;
      for (std::size_t i = 0; i < points.size(); ++i)
        refused[i] |= static_cast<char>(isLeftOut[i] && fit.isInlier[i]);
      return;
    }
    const PixelCoverage covered = PixelCoverage::Of(InlierPixels(points, refit.isInlier));
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!isLeftOut[i] || !fit.isInlier[i])
        continue;
      const auto direction = refit.optics.DirectionOf(points[i].pixel);
      if (!direction || !covered.Holds(points[i].pixel)) {
        refused[i] = 1;
        continue;
      }
      const Pose& pose = refit.poses[points[i].pose];
      const Vector3d along = pose.linear() * *direction;
      if (skin == nullptr) {
        errors[i] = along.cross(points[i].point - pose.translation()).norm();
      } else if (const auto hit = skin->Along(pose.translation(), along)) {
        errors[i] = (hit->seen - points[i].point).norm();
      } else {
        refused[i] = 1;
      }
    }
  });
  report.foldsLost = static_cast<int>(std::count(foldsLost.begin(), foldsLost.end(), 1));
  report.heldOutRefused = static_cast<std::size_t>(std::count(refused.begin(), refused.end(), 1));
  errors.erase(std::remove_if(errors.begin(), errors.end(), [](double e) { return e < 0.0; }), errors.end());
  report.heldOut = errors.size();
  if (errors.empty())
    return;
  report.heldOutMedianMm = Median(errors);
  report.heldOut95Mm = Percentile(errors, 0.95);
  report.heldOutMostMm = *std::max_element(errors.begin(), errors.end());
}

Eigen::Matrix<double, 6, 6> MountOf(const SurfaceMapParameters& p)
{
  Eigen::Matrix<double, 6, 6> mount = Eigen::Matrix<double, 6, 6>::Zero();
  mount.diagonal().head<3>().setConstant(p.mountMm * p.mountMm);
  mount.diagonal().tail<3>().setConstant(std::pow(p.mountDegrees / DegreesPerRadian, 2));
  return mount;
}

// Two unit vectors that span the plane across \a normal.
Eigen::Matrix<double, 3, 2> Across(const Vector3d& normal)
{
  Eigen::Matrix<double, 3, 2> across;
  across.col(0) = normal.unitOrthogonal();
  across.col(1) = normal.cross(across.col(0));
  return across;
}

std::vector<int> MarksOf(const std::vector<SurfaceObservation>& observations)
{
  std::vector<int> marks;
  for (const SurfaceObservation& o : observations)
    marks.push_back(o.mark);
  return marks;
}

double ShareOfPicture(const PixelCoverage& covered, const FisheyeLens& lens)
{
  return covered.HullArea() / (static_cast<double>(lens.width) * lens.height);
}

} // namespace

double MappedPoint::SigmaMm() const
{
  return std::sqrt(std::max(EigenOfSymmetric(covariance).values[2], 0.0));
}

SurfaceMap::SurfaceMap(SurfaceMapState state, std::shared_ptr<const TrackedSkin> skin)
  : state_(std::move(state)), skin_(std::move(skin))
{
  const auto fail = [](const std::string& reason) { FailInput("the calibration of the surface map: " + reason); };
  if (!skin_)
    fail("there is no skin");
  state_.optics.lens.Check();
  const ThinPlate& plate = state_.optics.residual;
  if (plate.weights.size() != (plate.centres.empty() ? 0 : plate.centres.size() + 3))
    fail("its residual has " + std::to_string(plate.centres.size()) + " centres and " + std::to_string(plate.weights.size()) +
         " weights");
  const auto isFinite = [](const std::vector<Vector2d>& values) {
    return std::all_of(values.begin(), values.end(), [](const Vector2d& v) { return v.allFinite(); });
  };
  if (!(isFinite(plate.centres) && isFinite(plate.weights) && plate.middle.allFinite() && plate.scale > 0.0))
    fail("its residual is not finite");
  if (state_.covered.pixels.size() != state_.covered.reach.size() || state_.covered.hull.size() < 3 ||
      !isFinite(state_.covered.pixels) || !isFinite(state_.covered.hull))
    fail("the part of the picture that it covers is none");
  if (!state_.cameraToShell.matrix().allFinite() || !IsRotation(state_.cameraToShell.linear()))
    fail("the pose of its camera is none");
  const Index count = state_.optics.Unknowns() + 6;
  if (state_.covariance.rows() != count || state_.covariance.cols() != count || !state_.covariance.allFinite() ||
      !(state_.covariance.diagonal().minCoeff() >= 0.0))
    fail("its covariance is not one of " + std::to_string(count) + " unknowns");
}

MappedPoint SurfaceMap::Map(const Vector2d& pixel, const Matrix2d& covariance) const
{
  MappedPoint mapped;
  if (!skin_ || !pixel.allFinite() || !covariance.allFinite() || !state_.covered.Holds(pixel))
    return mapped;
  const CameraOptics& optics = state_.optics;
  const auto direction = optics.DirectionOf(pixel);
  if (!direction)
    return mapped;
  const Eigen::Matrix3d& turn = state_.cameraToShell.linear();
  const Vector3d eye = state_.cameraToShell.translation(), along = turn * *direction;
  const auto hit = skin_->Along(eye, along);
  if (!hit) {
    mapped.status = MappedPoint::Status::NoSkin;
    return mapped;
  }
  mapped.status = MappedPoint::Status::Mapped;
  mapped.point = hit->point;
  mapped.normal = hit->normal.dot(along) >= 0.0 ? hit->normal : Vector3d(-hit->normal);
  mapped.incidenceDegrees = std::acos(std::clamp(mapped.normal.dot(along), 0.0, 1.0)) * DegreesPerRadian;

  const Vector3d inCamera = hit->distanceMm * *direction;
  const auto derivatives = optics.Differentiate(inCamera);
  if (!derivatives)
    return mapped;
  MatrixXd by(2, optics.Unknowns() + 6);
  by << derivatives->byUnknowns, -derivatives->byDirection, derivatives->byDirection * Hat(inCamera);
  const Matrix2d inPicture = covariance + by * state_.covariance.selfadjointView<Eigen::Lower>() * by.transpose();
  const Eigen::Matrix<double, 3, 2> across = Across(mapped.normal);
  const Matrix2d slope = derivatives->byDirection * turn.transpose() * across; // pixels per mm of skin
  // Skin that is seen edge-on has no slope; what it is there is at the edge anyway.
  const double least = 1e-6 * slope.squaredNorm();
  const double determinant =
      std::abs(slope.determinant()) > least ? slope.determinant() : std::copysign(least, slope.determinant());
  Matrix2d back;
  back << slope(1, 1), -slope(0, 1), -slope(1, 0), slope(0, 0);
  const Eigen::Matrix<double, 3, 2> perPixel = across * back / determinant;
  mapped.covariance = perPixel * inPicture * perPixel.transpose();

  const SymmetricEigen axes = EigenOfSymmetric(inPicture);
  for (int axis = 0; axis < 2 && !mapped.isAtEdge; ++axis)
    for (const double sign : {-2.0, 2.0}) {
      const Vector2d aside = sign * std::sqrt(std::max(axes.values[axis], 0.0)) * axes.vectors.col(axis);
      const auto there = optics.DirectionOf(pixel + aside);
      const auto other = there ? skin_->Along(eye, turn * *there) : std::nullopt;
      const Vector3d step = perPixel * aside;
      if (!other || (other->point - mapped.point - step).norm() > 0.5 * step.norm() + 0.1)
        mapped.isAtEdge = true;
    }
  return mapped;
}

std::optional<Vector2d> SurfaceMap::PixelOf(const Vector3d& pointOfSkin) const
{
  const auto place = skin_ ? skin_->NearestTo(pointOfSkin) : std::nullopt;
  if (!place)
    return std::nullopt;
  return state_.optics.PixelOf(state_.cameraToShell.inverse(Eigen::Isometry) * (pointOfSkin + place->seen - place->point));
}

std::string SurfaceMapReport::Text() const
{
  std::string text = Format("%zu of %zu observations fit, over %.0f%% of the picture\n", inliers, observations, 100.0 * coverage);
  text += Format("left over: %.3f px by the lens alone, %.3f px with its residual (%.0f freedoms)\n", lensPx, residualPx,
                 residualFreedoms);
  if (heldOut > 0)
    text += Format("observations left out of the fit: median %.3f mm, 95%% %.3f mm, most %.3f mm (%zu; without an answer: %zu)\n",
                   heldOutMedianMm, heldOut95Mm, heldOutMostMm, heldOut, heldOutRefused);
  if (foldsLost > 0)
    text += std::to_string(foldsLost) + " of the fits that left some out did not converge\n";
  if (isContradicted)
    text += Format("the observations contradict what is known of lens and mount, by %.1f standard deviations: another lens or "
                   "shell, or a mount that is further off than MountMm and MountDegrees say?\n",
                   contradiction);
  for (const SurfaceOutlier& outlier : outliers)
    text += NameOf(outlier.observation, outlier.mark) + Format(" does not fit: %.1f standard deviations\n", outlier.sigmas);
  return text;
}

FittedSurfaceMap FitSurfaceMap(const std::vector<SurfaceObservation>& observations, std::shared_ptr<const TrackedSkin> skin,
                               const FisheyeLens& lens, const Pose& cameraToShell, const SurfaceMapParameters& parameters,
                               const Progress& progress)
{
  CheckRanges(parameters);
  lens.Check();
  if (!skin)
    FailInput("there is no skin to map to");
  std::vector<SeenPoint> points;
  CollectSeen(observations, skin.get(), lens, parameters, 0, points);
  CheckEnough(points, lens, parameters);
  CameraFitSettings settings;
  settings.residualCentres = parameters.residualCentres;
  settings.outlierSigmas = parameters.outlierSigmas;
  const CameraOptics start{lens, {}};
  const std::vector<int> marks = MarksOf(observations);
  CameraFitResult fit = FitCamera(points, start, {cameraToShell}, settings);
  FittedSurfaceMap fitted;
  fitted.report = Judge(fit, points, marks, parameters);
  LimitLens(fit, points);
  SurfaceMapState state{fit.optics, PixelCoverage::Of(InlierPixels(points, fit.isInlier)), fit.poses[0], fit.covariance};
  fitted.report.coverage = ShareOfPicture(state.covered, lens);
  MeasureHeldOut(points, marks, skin.get(), start, {cameraToShell}, settings, fit, parameters, progress, fitted.report);
  fitted.map = SurfaceMap(std::move(state), std::move(skin));
  return fitted;
}

FittedLens FitLens(const std::vector<LensObservations>& shapes, const FisheyeLens& lens, const SurfaceMapParameters& parameters,
                   const Progress& progress)
{
  CheckRanges(parameters);
  lens.Check();
  std::vector<SeenPoint> points;
  std::vector<Pose> poses;
  std::vector<int> marks;
  for (const LensObservations& shape : shapes) {
    CollectSeen(shape.observations, nullptr, lens, parameters, poses.size(), points);
    poses.push_back(shape.housingToShape);
    const std::vector<int> more = MarksOf(shape.observations);
    marks.insert(marks.end(), more.begin(), more.end());
  }
  CheckEnough(points, lens, parameters);
  CameraFitSettings settings;
  settings.residualCentres = parameters.residualCentres;
  settings.outlierSigmas = parameters.outlierSigmas;
  settings.mount = MountOf(parameters);
  const CameraOptics start{lens, {}};
  CameraFitResult fit = FitCamera(points, start, poses, settings);
  FittedLens fitted;
  fitted.report = Judge(fit, points, marks, parameters);
  LimitLens(fit, points);
  fitted.lens = {fit.optics, PixelCoverage::Of(InlierPixels(points, fit.isInlier)), Pose::Identity(), {}};
  const Index count = fit.optics.Unknowns();
  const double share = 1.0 / static_cast<double>(poses.size());
  MatrixXd mean = MatrixXd::Zero(count + 6, fit.covariance.cols());
  mean.topLeftCorner(count, count).setIdentity();
  Twist twist = Twist::Zero();
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Pose inHousing = poses[k].inverse(Eigen::Isometry) * fit.poses[k];
    twist.head<3>() += share * inHousing.translation();
    twist.tail<3>() += share * LogRotation(inHousing.linear());
    mean.block<6, 6>(count, count + 6 * static_cast<Index>(k)) = share * Eigen::Matrix<double, 6, 6>::Identity();
  }
  fitted.lens.cameraToHousing.linear() = ExpRotation(twist.tail<3>());
  fitted.lens.cameraToHousing.translation() = twist.head<3>();
  fitted.lens.covariance = mean * fit.covariance * mean.transpose();
  fitted.lens.covariance.bottomRightCorner<6, 6>() += share * MountOf(parameters);
  fitted.cameraToShapes = fit.poses;
  fitted.report.coverage = ShareOfPicture(fitted.lens.covered, lens);
  MeasureHeldOut(points, marks, nullptr, start, poses, settings, fit, parameters, progress, fitted.report);
  return fitted;
}

FittedSurfaceMap PlaceSurfaceMap(const LensCalibration& lens, std::shared_ptr<const TrackedSkin> skin, const Pose& housingToShell,
                                 const std::vector<SurfaceObservation>& observations, const SurfaceMapParameters& parameters,
                                 const Progress& progress)
{
  CheckRanges(parameters);
  const Index count = lens.optics.Unknowns();
  if (lens.covariance.rows() != count + 6 || lens.covariance.cols() != count + 6)
    FailInput("the covariance of the lens is not one of " + std::to_string(count + 6) + " unknowns");
  SurfaceMapState state{lens.optics, lens.covered, housingToShell * lens.cameraToHousing, lens.covariance};
  state.covariance.bottomRightCorner<6, 6>() += MountOf(parameters);
  FittedSurfaceMap fitted{SurfaceMap(state, skin), {}}; // checks all of it

  if (!observations.empty()) {
    std::vector<SeenPoint> points;
    CollectSeen(observations, skin.get(), lens.optics.lens, parameters, 0, points);
    CameraFitSettings settings;
    settings.outlierSigmas = parameters.outlierSigmas;
    settings.covariance = state.covariance;
    const Pose start = state.cameraToShell;
    const std::vector<int> marks = MarksOf(observations);
    CameraFitResult fit = FitCamera(points, lens.optics, {start}, settings);
    fitted.report = Judge(fit, points, marks, parameters);
    LimitLens(fit, points);
    MeasureHeldOut(points, marks, skin.get(), lens.optics, {start}, settings, fit, parameters, progress, fitted.report);
    state.optics = fit.optics;
    state.cameraToShell = fit.poses[0];
    state.covariance = fit.covariance;
    fitted.map = SurfaceMap(std::move(state), std::move(skin));
  }
  fitted.report.coverage = ShareOfPicture(lens.covered, lens.optics.lens);
  return fitted;
}

} // namespace echorama
