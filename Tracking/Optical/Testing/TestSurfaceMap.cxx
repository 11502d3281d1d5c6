// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Parallel.h"
#include "Core/Base/Percentile.h"
#include "Core/Base/SymmetricMatrix.h"
#include "Testing/Sanitized.h"
#include "Tracking/Optical/ProxyMap.h"
#include "Tracking/Optical/Testing/SurfaceTruth.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>

namespace {

using namespace echorama;
using namespace echorama::truth;
using Eigen::Matrix2d;
using Status = MappedPoint::Status;

using Skin = std::shared_ptr<const TrackedSkin>;

Skin Dome()
{
  static const Skin skin = std::make_shared<TrackedSkin>(Ellipsoid({150.0, 120.0, 110.0}, 6));
  return skin;
}

Pose PoseAt(const Vector3d& place, const Vector3d& turnDegrees)
{
  Pose pose = Pose::Identity();
  pose.linear() = ExpRotation(turnDegrees / DegreesPerRadian);
  pose.translation() = place;
  return pose;
}

// Not the nominal one, and not where it should be.
TrueCamera Camera()
{
  TrueCamera camera;
  camera.lens.focal = 183.0;
  camera.lens.centreX = 327.0;
  camera.lens.centreY = 232.0;
  camera.lens.k1 = -0.035;
  camera.lens.k2 = 0.006;
  camera.lens.k3 = -0.001;
  camera.cameraToShell = PoseAt({6.0, -4.0, 3.0}, {3.0, -5.0, 20.0});
  return camera;
}
const Pose Nominal = PoseAt({0.0, 0.0, 0.0}, {0.0, 0.0, 0.0});

SurfaceMapParameters Exact()
{
  SurfaceMapParameters p;
  p.placementMm = 0.0;
  p.floorPx = 1e-4;
  return p;
}

// How far a map is off, at places between the marks.
std::vector<double> ErrorsOf(const SurfaceMap& map, const TrueCamera& camera, double mostDegrees, int count = 500)
{
  std::vector<double> errors;
  for (int i = 0; i < count; ++i) {
    Random random(99, static_cast<std::uint64_t>(i));
    const double angle = std::sqrt(random.Uniform()) * mostDegrees / DegreesPerRadian, turn = random.Uniform(0.0, 6.2831853);
    const Vector3d direction(std::sin(angle) * std::cos(turn), std::sin(angle) * std::sin(turn), std::cos(angle));
    const auto hit = map.Skin()->Along(camera.cameraToShell.translation(), camera.cameraToShell.linear() * direction);
    const auto pixel = hit ? camera.PixelOf(hit->seen) : std::nullopt;
    if (!pixel || !camera.lens.Covers(*pixel))
      continue;
    const MappedPoint mapped = map.Map(*pixel);
    EXPECT_EQ(static_cast<int>(mapped.status), static_cast<int>(Status::Mapped)) << pixel->transpose();
    errors.push_back((mapped.point - hit->point).norm());
  }
  return errors;
}

Skin SkinOf(TriangleSurface surface, double wallMm = 0.0)
{
  return std::make_shared<TrackedSkin>(std::move(surface), wallMm);
}

// What a lens of Kannala and Brandt cannot do.
TrueCamera WarpedCamera()
{
  TrueCamera camera = Camera();
  camera.decentringX = 0.004;
  camera.tiltY = 0.01;
  return camera;
}

SurfaceMapParameters WithoutHand(int folds = 10)
{
  SurfaceMapParameters p;
  p.placementMm = 0.0;
  p.folds = folds;
  return p;
}

int StatusOf(const SurfaceMap& map, const Vector2d& pixel)
{
  return static_cast<int>(map.Map(pixel).status);
}
constexpr int Mapped = static_cast<int>(Status::Mapped), NotCovered = static_cast<int>(Status::NotCovered),
              NoSkin = static_cast<int>(Status::NoSkin);

// The message of the error that a function ends with.
template <class Function>
std::string Complaint(const Function& function, Error::Kind kind)
{
  try {
    function();
  } catch (const Error& error) {
    EXPECT_EQ(static_cast<int>(error.GetKind()), static_cast<int>(kind)) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "no error";
  return {};
}

TEST(FisheyeLens, DerivativesAreDifferences)
{
  FisheyeLens lens = Camera().lens;
  lens.k4 = 3e-4;
  for (std::uint64_t trial = 0; trial < 60; ++trial) {
    Random random(3, trial);
    Vector3d direction = 50.0 * random.Direction();
    if (trial % 3 == 0)
      direction = Vector3d(1e-3 * random.Normal(), 1e-3 * random.Normal(), 40.0); // beside the axis
    const auto p = lens.Differentiate(direction);
    ASSERT_TRUE(p);
    if (const auto pixel = lens.Project(direction)) {
      EXPECT_LT((p->pixel - *pixel).norm(), 1e-9);
    }
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = 1e-4 * Vector3d::Unit(axis);
      const Vector2d difference =
          (lens.Differentiate(direction + step)->pixel - lens.Differentiate(direction - step)->pixel) / 2e-4;
      EXPECT_LT((p->byDirection.col(axis) - difference).norm(), 1e-4 * (1.0 + difference.norm())) << trial << " " << axis;
    }
    for (int k = 0; k < 7; ++k) {
      const auto moved = [&](double by) {
        FisheyeLens other = lens;
        *std::array<double*, 7>{
            &other.focal, &other.centreX, &other.centreY, &other.k1, &other.k2, &other.k3, &other.k4}[static_cast<std::size_t>(
            k)] += by;
        return other.Differentiate(direction)->pixel;
      };
      EXPECT_LT((p->byLens.col(k) - (moved(1e-4) - moved(-1e-4)) / 2e-4).norm(), 1e-6 * (1.0 + p->byLens.col(k).norm()));
    }
  }
  EXPECT_FALSE(lens.Differentiate({0.0, 0.0, -1.0}));
  EXPECT_FALSE(lens.Differentiate({0.0, 0.0, 0.0}));
}

TEST(ThinPlate, FreedomsAreAlikeAndGradientIsADifference)
{
  std::vector<Vector2d> pixels;
  for (std::uint64_t i = 0; i < 200; ++i) {
    Random random(4, i);
    pixels.emplace_back(random.Uniform(50.0, 600.0), random.Uniform(20.0, 450.0));
  }
  pixels.insert(pixels.end(), 20, pixels[3]); // repeated places are none
  ThinPlate plate = ThinPlate::Over(pixels, 40);
  ASSERT_EQ(plate.centres.size(), 40u);
  for (std::size_t i = 0; i < 40; ++i)
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_GT((plate.centres[i] - plate.centres[j]).norm(), 30.0);
  EXPECT_EQ(ThinPlate::Over({{1.0, 1.0}, {2.0, 5.0}, {1.0, 1.0}}, 40).centres.size(), 2u);
  const Eigen::MatrixXd freedoms = plate.Freedoms();
  ASSERT_EQ(freedoms.cols(), 40);
  Eigen::MatrixXd kernel(40, 43), sides(3, 40);
  for (Eigen::Index i = 0; i < 40; ++i) {
    kernel.row(i) = plate.Basis(plate.centres[static_cast<std::size_t>(i)]).transpose();
    sides.col(i) = kernel.row(i).tail(3).transpose();
  }
  const Eigen::MatrixXd bends = freedoms.topLeftCorner(40, 37);
  EXPECT_LT((sides * bends).norm(), 1e-8); // nothing that the affine part does
  EXPECT_LT((bends.transpose() * kernel.leftCols(40) * bends - Eigen::MatrixXd::Identity(37, 37)).norm(), 1e-8);

  const Eigen::VectorXd x = freedoms * Eigen::VectorXd::LinSpaced(40, -1.0, 2.0),
                        y = freedoms * Eigen::VectorXd::LinSpaced(40, 1.0, 0.5);
  for (std::size_t i = 0; i < plate.weights.size(); ++i)
    plate.weights[i] = {x[static_cast<Eigen::Index>(i)], y[static_cast<Eigen::Index>(i)]};
  const Vector2d at(222.3, 111.4);
  const Eigen::Matrix2d gradient = plate.Gradient(at);
  for (int axis = 0; axis < 2; ++axis) {
    const Vector2d step = 1e-3 * Vector2d::Unit(axis);
    EXPECT_LT((gradient.col(axis) - (plate.At(at + step) - plate.At(at - step)) / 2e-3).norm(), 1e-7);
  }
  EXPECT_GT(gradient.norm(), 1e-4);
}

TEST(ThinPlate, LastFreedomsAreTheLowestOrdersAndFewCentresBendNothing)
{
  std::vector<Vector2d> pixels;
  for (int i = 0; i < 40; ++i)
    pixels.emplace_back(100.0 + 10.0 * (i * 7 % 40), 50.0 + 9.0 * (i * 11 % 40));
  const ThinPlate plate = ThinPlate::Over(pixels, 30);
  ASSERT_EQ(plate.centres.size(), 30u);
  ASSERT_EQ(plate.LowOrders(), 6);
  Eigen::MatrixXd basis(30, 33), squares(30, 3);
  for (Eigen::Index i = 0; i < 30; ++i) {
    basis.row(i) = plate.Basis(plate.centres[static_cast<std::size_t>(i)]).transpose();
    const double x = basis(i, 31), y = basis(i, 32);
    squares.row(i) << x * x, x * y, y * y;
  }
  const Eigen::MatrixXd low = basis * plate.Freedoms().rightCols(6);
  EXPECT_LT((low * low.householderQr().solve(squares) - squares).norm(), 1e-8);
  EXPECT_EQ(ThinPlate().Freedoms().cols(), 0);
  EXPECT_EQ(ThinPlate().LowOrders(), 0);
  for (const int count : {1, 3, 4, 5}) {
    const ThinPlate few = ThinPlate::Over(pixels, count);
    EXPECT_EQ(few.Freedoms().cols(), std::max(count, 3)) << count;
    EXPECT_EQ(few.LowOrders(), std::max(count, 3)) << count;
    EXPECT_EQ(few.Freedoms().bottomRightCorner(3, 3), Eigen::MatrixXd::Identity(3, 3));
    EXPECT_TRUE(count > 3 || few.Freedoms().topRows(count).isZero());
  }
}

TEST(PixelCoverage, MarksThatWereSeenAgainAreNoNeighbours)
{
  std::vector<Vector2d> once, often;
  for (int i = 0; i < 100; ++i) {
    once.emplace_back(100.0 + 20.0 * (i % 10), 100.0 + 20.0 * (i / 10));
    for (std::uint64_t k = 0; k < 8; ++k) {
      Random random(6, 8 * static_cast<std::uint64_t>(i) + k);
      often.push_back(once.back() + 0.05 * Vector2d(random.Normal(), random.Normal()));
    }
  }
  const PixelCoverage a = PixelCoverage::Of(once), b = PixelCoverage::Of(often);
  ASSERT_EQ(b.pixels.size(), 100u);
  for (std::size_t i = 0; i < 100; ++i)
    EXPECT_NEAR(a.reach[i], b.reach[i], 0.5);
  EXPECT_TRUE(b.Holds({110.0, 110.0}));
}

TEST(PixelCoverage, EndsHalfAReachBeyondTheOutermost)
{
  std::vector<Vector2d> pixels;
  for (int y = 0; y < 10; ++y)
    for (int x = 0; x < 10; ++x)
      if (!(x >= 3 && x <= 6 && y >= 3 && y <= 6)) // nothing was seen there
        pixels.emplace_back(100.0 + 20.0 * x, 100.0 + 20.0 * y);
  const PixelCoverage covered = PixelCoverage::Of(pixels);
  EXPECT_NEAR(covered.HullArea(), 180.0 * 180.0, 1e-9);
  EXPECT_TRUE(covered.Holds({110.0, 110.0}));
  EXPECT_TRUE(covered.Holds({289.0, 233.0}));
  EXPECT_TRUE(covered.Holds({288.0, 130.0}));
  EXPECT_FALSE(covered.Holds({310.0, 130.0}));
  EXPECT_FALSE(covered.Holds({190.0, 190.0})); // 42 px from all of them
  EXPECT_FALSE(covered.Holds({70.0, 70.0}));
  EXPECT_FALSE(covered.Holds({std::nan(""), 110.0}));
  EXPECT_FALSE(PixelCoverage().Holds({0.0, 0.0}));
}

TEST(SurfaceMap, ExactObservationsAreReproduced)
{
  const auto observations = Observe(Camera(), *Dome(), 350, 85.0, 0.0, 0.0, 1);
  ASSERT_GT(observations.size(), 250u);
  const auto fitted = FitSurfaceMap(observations, Dome(), FisheyeLens(), Nominal, Exact());
  EXPECT_EQ(fitted.report.inliers, observations.size());
  for (const SurfaceObservation& o : observations) {
    const MappedPoint mapped = fitted.map.Map(o.pixel);
    ASSERT_EQ(static_cast<int>(mapped.status), static_cast<int>(Status::Mapped));
    EXPECT_LT((mapped.point - o.point).norm(), 1e-3);
    EXPECT_GT(mapped.normal.dot(o.point), 0.0);
  }
  const auto errors = ErrorsOf(fitted.map, Camera(), 75.0);
  ASSERT_GT(errors.size(), 400u);
  EXPECT_LT(*std::max_element(errors.begin(), errors.end()), 1e-3);
  const Pose& pose = fitted.map.State().cameraToShell;
  EXPECT_LT((pose.translation() - Camera().cameraToShell.translation()).norm(), 1e-3);
  EXPECT_NEAR(fitted.map.State().optics.lens.focal, 183.0, 1e-2);
}

TEST(SurfaceMap, ResidualRepairsWhatTheLensCannot)
{
  const auto observations = Observe(WarpedCamera(), *Dome(), 350, 85.0, 0.02, 0.0, 1);
  SurfaceMapParameters p = WithoutHand();
  const auto with = FitSurfaceMap(observations, Dome(), FisheyeLens(), Nominal, p);
  p.residualCentres = 0;
  const auto without = FitSurfaceMap(observations, Dome(), FisheyeLens(), Nominal, p);
  const auto errors = ErrorsOf(with.map, WarpedCamera(), 75.0), plain = ErrorsOf(without.map, WarpedCamera(), 75.0);
  EXPECT_LT(Percentile(errors, 0.95), 0.5 * Percentile(plain, 0.95));
  EXPECT_LT(Percentile(errors, 0.95), 0.02);
  EXPECT_NEAR(with.report.residualPx, 0.02, 0.002); // the noise and nothing else
  EXPECT_GT(with.report.lensPx, 0.026);
  EXPECT_LT(with.report.heldOut95Mm, without.report.heldOut95Mm);
  EXPECT_GT(with.report.heldOut, 300u);
}

TEST(SurfaceMap, ResidualDoesNoHarmWhereThereIsNothingToRepair)
{
  double with = 0.0, without = 0.0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const auto observations = Observe(Camera(), *Dome(), 200, 85.0, 0.05, 0.1, seed);
    SurfaceMapParameters p;
    p.folds = 2;
    with += Percentile(ErrorsOf(FitSurfaceMap(observations, Dome(), FisheyeLens(), Nominal, p).map, Camera(), 70.0), 0.95);
    p.residualCentres = 0;
    without += Percentile(ErrorsOf(FitSurfaceMap(observations, Dome(), FisheyeLens(), Nominal, p).map, Camera(), 70.0), 0.95);
  }
  EXPECT_LT(with, 1.1 * without);
}

// Calibrations of other noise, asked for the same pixels: the mean square of their errors, each in units of what it claims.
double ClaimedSpread(const TrueCamera& camera, double queryNoise, double placementMm)
{
  std::vector<Vector3d> places;
  std::vector<Vector2d> pixels;
  for (int i = 0; i < 40; ++i) {
    const double angle = 0.03 * i, turn = 2.4 * i; // to 69 degrees
    const auto hit = Dome()->Along(camera.cameraToShell.translation(),
                                   camera.cameraToShell.linear() * Vector3d(std::sin(angle) * std::cos(turn),
                                                                            std::sin(angle) * std::sin(turn), std::cos(angle)));
    places.push_back(hit->point);
    pixels.push_back(*camera.PixelOf(hit->point));
  }
  double sum = 0.0;
  int count = 0;
  SurfaceMapParameters p;
  p.placementMm = placementMm;
  p.folds = 2;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const auto observations = Observe(camera, *Dome(), 150, 85.0, 0.05, placementMm, seed);
    const SurfaceMap map = FitSurfaceMap(observations, Dome(), FisheyeLens(), Nominal, p).map;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      Random random(seed, 5000 + i);
      const MappedPoint mapped = map.Map(pixels[i] + queryNoise * Vector2d(random.Normal(), random.Normal()),
                                         queryNoise * queryNoise * Matrix2d::Identity());
      EXPECT_EQ(static_cast<int>(mapped.status), Mapped);
      // Within the skin: two directions, each of one unit.
      const SymmetricEigen axes = EigenOfSymmetric(mapped.covariance);
      for (const Eigen::Index axis : {1, 2})
        sum += std::pow(axes.vectors.col(axis).dot(mapped.point - places[i]), 2) / axes.values[axis];
      EXPECT_LT(axes.values[0], 1e-6 * axes.values[1]); // nothing across it
      count += 2;
    }
  }
  return sum / count;
}

TEST(SurfaceMap, CovarianceIsThatOfManyCalibrations)
{
  ECHORAMA_SKIP_SANITIZED();
  // The calibration's own part first, then mostly the pixel's.
  EXPECT_NEAR(std::sqrt(ClaimedSpread(Camera(), 0.0, 0.0)), 1.0, 0.2);
  EXPECT_NEAR(std::sqrt(ClaimedSpread(Camera(), 0.0, 0.15)), 1.0, 0.2);
  EXPECT_NEAR(std::sqrt(ClaimedSpread(WarpedCamera(), 0.0, 0.0)), 1.0, 0.2);
  EXPECT_NEAR(std::sqrt(ClaimedSpread(Camera(), 0.3, 0.0)), 1.0, 0.1);
}

TEST(SurfaceMap, SaysHowWellPointsWerePlacedWhenThatWasAGuess)
{
  // Ten times better than said: the uncertainty is that of what was seen.
  const auto observations = Observe(Camera(), *Dome(), 350, 85.0, 0.02, 0.0, 1);
  SurfaceMapParameters p;
  p.folds = 2;
  p.placementMm = 0.0;
  const double told = FitSurfaceMap(observations, Dome(), FisheyeLens(), Nominal, p).map.Map({400.0, 300.0}).SigmaMm();
  p.placementMm = 0.2;
  const double guessed = FitSurfaceMap(observations, Dome(), FisheyeLens(), Nominal, p).map.Map({400.0, 300.0}).SigmaMm();
  EXPECT_NEAR(guessed / told, 1.0, 0.3);
}

TEST(SurfaceMap, UncertaintyGrowsWithSlantAndHeldBackAtFolds)
{
  // A plate with a step: above x = 20 it is 30 mm nearer to the camera, and hides a strip behind it.
  TriangleSurface steps;
  const auto sheet = [&steps](float fromX, float toX, float z) {
    const auto first = static_cast<std::uint32_t>(steps.points.size());
    for (int y = 0; y <= 40; ++y)
      for (int x = 0; x <= 40; ++x)
        steps.points.emplace_back(fromX + (toX - fromX) * static_cast<float>(x) / 40.0f, -150.0f + 7.5f * static_cast<float>(y),
                                  z);
    for (std::uint32_t y = 0; y < 40; ++y)
      for (std::uint32_t x = 0; x < 40; ++x) {
        const std::uint32_t a = first + 41 * y + x;
        steps.triangles.push_back({a, a + 1, a + 42});
        steps.triangles.push_back({a, a + 42, a + 41});
      }
  };
  sheet(-150.0f, 150.0f, 100.0f);
  sheet(20.0f, 150.0f, 70.0f);
  const Skin skin = SkinOf(steps);
  TrueCamera camera = Camera();
  const auto observations = Observe(camera, *skin, 350, 60.0, 0.02, 0.0, 1);
  ASSERT_GT(observations.size(), 300u);
  const SurfaceMap map = FitSurfaceMap(observations, skin, FisheyeLens(), Nominal, WithoutHand()).map;
  const auto at = [&](const Vector3d& point) { return map.Map(*camera.PixelOf(point), 0.01 * Matrix2d::Identity()); };
  const MappedPoint edge = at({20.05, 10.0, 70.0}), beside = at({24.0, 10.0, 70.0}), behind = at({10.0, 10.0, 100.0});
  EXPECT_TRUE(edge.isAtEdge);
  EXPECT_FALSE(beside.isAtEdge);
  EXPECT_FALSE(behind.isAtEdge);
  EXPECT_LT((beside.point - Vector3d(24.0, 10.0, 70.0)).norm(), 0.05);
  EXPECT_LT((behind.point - Vector3d(10.0, 10.0, 100.0)).norm(), 0.05);
  // What is hidden is not claimed: the nearer sheet is in front of it.
  const MappedPoint hidden = at({32.0, 10.0, 100.0});
  EXPECT_NEAR(hidden.point.z(), 70.0, 1e-3);

  const MappedPoint steep = at({-110.0, 0.0, 100.0});
  EXPECT_GT(steep.incidenceDegrees, 45.0);
  const double ratio = steep.SigmaMm() / behind.SigmaMm();
  EXPECT_GT(ratio, 2.0); // by the distance, and by the cosine once more
  EXPECT_LT(ratio, 5.0);
  EXPECT_NEAR(steep.normal.z(), 1.0, 1e-6);
}

TEST(SurfaceMap, RefusesWhatWasNotSeen)
{
  auto observations = Observe(Camera(), *Dome(), 350, 70.0, 0.0, 0.0, 1);
  const Vector2d hole(400.0, 280.0);
  observations.erase(std::remove_if(observations.begin(), observations.end(),
                                    [&](const SurfaceObservation& o) { return (o.pixel - hole).norm() < 45.0; }),
                     observations.end());
  const SurfaceMap map = FitSurfaceMap(observations, Dome(), FisheyeLens(), Nominal, Exact()).map;
  EXPECT_EQ(StatusOf(map, hole), NotCovered);
  EXPECT_EQ(StatusOf(map, {300.0, 200.0}), Mapped);
  EXPECT_EQ(StatusOf(map, {620.0, 20.0}), NotCovered);
  EXPECT_EQ(StatusOf(map, {1e9, 20.0}), NotCovered);
  EXPECT_EQ(StatusOf(map, {std::nan(""), 20.0}), NotCovered);
  EXPECT_EQ(static_cast<int>(map.Map({300.0, 200.0}, Matrix2d::Constant(INFINITY)).status), NotCovered);
  EXPECT_EQ(StatusOf(SurfaceMap(), {300.0, 200.0}), NotCovered);

  // The same camera in a shell that ends higher up.
  const SurfaceMap open(map.State(), SkinOf(Ellipsoid({150.0, 120.0, 110.0}, 6, 0.6)));
  EXPECT_EQ(StatusOf(open, {300.0, 200.0}), Mapped);
  EXPECT_EQ(StatusOf(open, {320.0, 60.0}), NoSkin);
}

TEST(SurfaceMap, PixelsOfPointsComeBack)
{
  const auto observations = Observe(WarpedCamera(), *Dome(), 350, 85.0, 0.0, 0.0, 1);
  const SurfaceMap map = FitSurfaceMap(observations, Dome(), FisheyeLens(), Nominal, WithoutHand()).map;
  ASSERT_FALSE(map.State().optics.residual.IsNone());
  for (const SurfaceObservation& o : observations) {
    const auto pixel = map.PixelOf(o.point);
    ASSERT_TRUE(pixel);
    EXPECT_LT((map.Map(*pixel).point - o.point).norm(), 1e-4);
  }
}

TEST(SurfaceMap, NamesOutliers)
{
  const auto clean = Observe(WarpedCamera(), *Dome(), 350, 85.0, 0.02, 0.1, 1);
  auto observations = clean;
  std::vector<int> wrong;
  for (std::size_t k = 0; k < 12; ++k) { // from 4 to 40 px; at the border, too
    SurfaceObservation& o = observations[5 + 28 * k];
    const double angle = 1.0 + 2.0 * static_cast<double>(k);
    o.pixel += (4.0 + 3.0 * static_cast<double>(k)) * Vector2d(std::cos(angle), std::sin(angle));
    o.pixel = o.pixel.cwiseMax(0.0).cwiseMin(Vector2d(639.0, 479.0));
    wrong.push_back(o.mark);
  }
  std::swap(observations[100].pixel, observations[101].pixel); // two marks taken for each other
  wrong.push_back(observations[100].mark);
  wrong.push_back(observations[101].mark);
  const auto fitted = FitSurfaceMap(observations, Dome(), FisheyeLens(), Nominal);
  std::vector<int> named;
  for (const SurfaceOutlier& outlier : fitted.report.outliers) {
    named.push_back(outlier.mark);
    EXPECT_EQ(observations[outlier.observation].mark, outlier.mark);
    EXPECT_GT(outlier.sigmas, 5.0);
  }
  std::sort(named.begin(), named.end());
  std::sort(wrong.begin(), wrong.end());
  EXPECT_EQ(named, wrong);
  EXPECT_NE(fitted.report.Text().find("mark " + std::to_string(wrong[0])), std::string::npos);
  const auto without = FitSurfaceMap(clean, Dome(), FisheyeLens(), Nominal);
  EXPECT_TRUE(without.report.outliers.empty());
  EXPECT_LT(Percentile(ErrorsOf(fitted.map, WarpedCamera(), 70.0), 0.95),
            1.3 * Percentile(ErrorsOf(without.map, WarpedCamera(), 70.0), 0.95));
}

TEST(SurfaceMap, SaysWhatIsWrongWithItsInput)
{
  const auto observations = Observe(Camera(), *Dome(), 150, 85.0, 0.02, 0.0, 1);
  const auto fit = [](const std::vector<SurfaceObservation>& seen, const Skin& skin) {
    return FitSurfaceMap(seen, skin, FisheyeLens(), Nominal);
  };
  const auto complaint = [&](const auto& change, Error::Kind kind = Error::Kind::BadInput) {
    auto changed = observations;
    change(changed);
    return Complaint([&] { fit(changed, Dome()); }, kind);
  };
  using All = std::vector<SurfaceObservation>;
  EXPECT_NE(complaint([](All& o) { o[7].pixel.x() = std::nan(""); }).find("observation 7 (mark 8) is not finite"),
            std::string::npos);
  EXPECT_NE(complaint([](All& o) { o[7].point.x() = INFINITY; }).find("observation 7"), std::string::npos);
  EXPECT_NE(complaint([](All& o) { o[7].covariance(0, 0) = -1.0; }).find("covariance of observation 7"), std::string::npos);
  EXPECT_NE(complaint([](All& o) { o[7].pixel.x() = 700.0; }).find("outside of the picture"), std::string::npos);
  EXPECT_NE(complaint([](All& o) { o.resize(19); }).find("20 observations at least"), std::string::npos);
  EXPECT_NE(complaint([](All& o) { o.clear(); }).find("there are 0"), std::string::npos);
  EXPECT_NE(complaint([&](All& o) {
              o.erase(std::remove_if(o.begin(), o.end(),
                                     [](const auto& x) { return (x.pixel - Vector2d(420.0, 330.0)).norm() > 70.0; }),
                      o.end());
              const All once = o;
              while (o.size() < 30)
                o.insert(o.end(), once.begin(), once.end());
            }).find("of the picture; LeastCoverage"),
            std::string::npos);
  // Marks were counted from the wrong end.
  EXPECT_NE(complaint(
                [](All& o) {
                  for (std::size_t i = 0; i < o.size() / 2; ++i)
                    std::swap(o[i].pixel, o[o.size() - 1 - i].pixel);
                },
                Error::Kind::NotPossible)
                .find("another order of the marks"),
            std::string::npos);
  // Another shell's mesh; points that are none of this one.
  const Skin larger = SkinOf(Ellipsoid({170.0, 130.0, 120.0}, 5));
  EXPECT_NE(Complaint([&] { fit(observations, larger); }, Error::Kind::BadInput).find("not on this skin"), std::string::npos);
  // The camera is in another shell than the one whose marks were counted: no lens explains that, though a smooth field would.
  auto stretched = observations;
  for (SurfaceObservation& o : stretched)
    o.point.y() *= 1.25;
  const Skin wide = SkinOf(Ellipsoid({150.0, 150.0, 110.0}, 5));
  EXPECT_NE(Complaint([&] { fit(stretched, wide); }, Error::Kind::NotPossible).find("Another mesh"), std::string::npos);
  EXPECT_NE(Complaint([&] { fit(observations, nullptr); }, Error::Kind::BadInput).find("no skin"), std::string::npos);
  Complaint([] { SkinOf({}); }, Error::Kind::BadInput);
  Complaint([] { SkinOf({{{0, 0, 0}}, {{0, 0, 1}}}); }, Error::Kind::BadInput);
  SurfaceMapParameters bad;
  bad.folds = 1;
  EXPECT_NE(Complaint([&] { FitSurfaceMap(observations, Dome(), FisheyeLens(), Nominal, bad); }, Error::Kind::InvalidParameter)
                .find("Folds"),
            std::string::npos);
}

TEST(SurfaceMap, LooksThroughTheWall)
{
  const Skin wall = SkinOf(Ellipsoid({150.0, 120.0, 110.0}, 6), 2.0);
  const auto observations = Observe(Camera(), *wall, 350, 85.0, 0.0, 0.0, 1);
  const SurfaceMap map = FitSurfaceMap(observations, wall, FisheyeLens(), Nominal, Exact()).map;
  double apart = 0.0;
  for (const SurfaceObservation& o : observations) {
    const MappedPoint mapped = map.Map(o.pixel);
    EXPECT_LT((mapped.point - o.point).norm(), 2e-3);
    EXPECT_NEAR(Dome()->NearestTo(mapped.point)->distanceMm, 0.0, 1e-3); // on the outside
    // Where the ray, straight on, would leave the wall.
    const auto straight = Dome()->Along(Camera().cameraToShell.translation(),
                                        wall->NearestTo(o.point)->seen - Camera().cameraToShell.translation());
    apart = std::max(apart, (straight->point - o.point).norm());
  }
  EXPECT_GT(apart, 0.5);
  // Triangles that face inwards change nothing, of a whole body or of its upper part; some that do are refused.
  for (const double above : {-2.0, 0.2}) {
    TriangleSurface turned = Ellipsoid({150.0, 120.0, 110.0}, 4, above);
    for (auto& triangle : turned.triangles)
      std::swap(triangle[0], triangle[1]);
    const Vector3d top(20.0, 10.0, 100.0);
    const auto place = SkinOf(turned, 2.0)->NearestTo(top),
               plain = SkinOf(Ellipsoid({150.0, 120.0, 110.0}, 4, above), 2.0)->NearestTo(top);
    EXPECT_LT((place->seen - plain->seen).norm(), 1e-4);
    EXPECT_NEAR(place->seen.norm() - place->point.norm(), -2.0, 0.3);
    std::swap(turned.triangles[7][0], turned.triangles[7][1]);
    EXPECT_NE(Complaint([&] { SkinOf(turned, 2.0); }, Error::Kind::BadInput).find("face different sides"), std::string::npos);
    SkinOf(turned); // without a wall it does not matter
  }
}

TEST(SurfaceMap, TwoDomesCalibrateForAnyShell)
{
  // The housing is where the drawings have it; the optics are warped, so that no frame of theirs is that of the housing.
  TrueCamera camera = Camera();
  camera.decentringX = 0.01;
  camera.tiltY = 0.02;
  const auto dome = [](double radius) { return SkinOf(Ellipsoid(Vector3d::Constant(radius), 6)); };
  const Pose inDome = PoseAt({1.0, -2.0, 6.0}, {0.0, 0.0, 15.0});
  SurfaceMapParameters exact = WithoutHand(3);
  exact.mountMm = exact.mountDegrees = 1e-3;
  const auto lensOf = [&](const std::vector<double>& radii) {
    std::vector<LensObservations> shapes;
    std::uint64_t seed = 1;
    for (const double radius : radii) {
      TrueCamera there = camera;
      there.cameraToShell = inDome;
      shapes.push_back({Observe(there, *dome(radius), 250, 85.0, 0.02, 0.0, seed++), inDome});
    }
    return FitLens(shapes, FisheyeLens(), exact);
  };
  const FittedLens lens = lensOf({70.0, 130.0});
  EXPECT_NEAR(lens.report.residualPx, 0.02, 0.003);
  EXPECT_LT(lens.report.heldOut95Mm, 0.1);
  EXPECT_LT((lens.cameraToShapes[0].inverse() * lens.cameraToShapes[1]).translation().norm(), 0.01); // what MountMm says

  // A third shell, in which the camera is known to be.
  const auto errorsIn = [&](const LensCalibration& calibration) {
    return Percentile(ErrorsOf(PlaceSurfaceMap(calibration, Dome(), camera.cameraToShell, {}, exact).map, camera, 70.0), 0.95);
  };
  const double error = errorsIn(lens.lens);
  EXPECT_LT(error, 0.1);
  // Neither the lens alone is enough, nor the frame of the housing.
  LensCalibration bare = lens.lens, unturned = lens.lens;
  bare.optics.residual = {};
  bare.covariance = Eigen::MatrixXd::Zero(13, 13);
  unturned.cameraToHousing = Pose::Identity();
  EXPECT_GT(errorsIn(bare), 2.0 * error);
  EXPECT_GT(errorsIn(unturned), 3.0 * error);
  // Mounted half a millimetre and half a degree off: the map says so, and six points mend it.
  SurfaceMapParameters loose = WithoutHand();
  loose.mountMm = loose.mountDegrees = 0.5;
  const Pose off = camera.cameraToShell * PoseAt({0.5, -0.4, 0.3}, {0.4, -0.5, 0.3});
  const SurfaceMap rough = PlaceSurfaceMap(lens.lens, Dome(), off, {}, loose).map;
  EXPECT_GT(Median(ErrorsOf(rough, camera, 70.0)), 0.5);
  // Place and direction of the mount, as they come to the skin, the more the more it is seen aslant.
  const MappedPoint middle = rough.Map({330.0, 240.0});
  const double far = (middle.point - rough.State().cameraToShell.translation()).norm();
  EXPECT_NEAR(middle.SigmaMm(),
              std::hypot(0.5, 0.5 / DegreesPerRadian * far) / std::cos(middle.incidenceDegrees / DegreesPerRadian), 0.03);
  auto few = Observe(camera, *Dome(), 12, 70.0, 0.02, 0.0, 9);
  few.erase(few.begin() + 6, few.end());
  const SurfaceMap mended = PlaceSurfaceMap(lens.lens, Dome(), off, few, loose).map;
  EXPECT_LT(Percentile(ErrorsOf(mended, camera, 70.0), 0.95), 0.2);
  EXPECT_LT(mended.Map({330.0, 240.0}).SigmaMm(), 0.1);
}

TEST(SurfaceMap, APlacedCameraKnowsHowWellItIsKnown)
{
  ECHORAMA_SKIP_SANITIZED();
  const auto dome = [](double radius) { return SkinOf(Ellipsoid(Vector3d::Constant(radius), 5)); };
  const Skin small = dome(70.0), large = dome(130.0);
  SurfaceMapParameters p;
  p.folds = 2;
  p.mountMm = p.mountDegrees = 0.05;
  std::vector<double> relative[2], apart; // without marks, and with some
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    p.mountMm = p.mountDegrees = seed <= 12 ? 0.05 : 0.2;
    const auto mounted = [&](const Pose& pose, std::uint64_t item) {
      Random random(seed, item);
      Twist off;
      for (Eigen::Index k = 0; k < 6; ++k)
        off[k] = random.Normal() * (k < 3 ? p.mountMm : p.mountDegrees / DegreesPerRadian);
      return Pose(pose * Exp(off));
    };
    std::vector<LensObservations> shapes;
    for (const Skin& skin : {small, large}) {
      TrueCamera there = WarpedCamera();
      const Pose drawn = PoseAt({1.0, -2.0, 6.0}, {0.0, 0.0, 15.0});
      there.cameraToShell = mounted(drawn, 900 + shapes.size());
      shapes.push_back({Observe(there, *skin, 150, 85.0, 0.02, 0.1, 10 * seed + shapes.size()), drawn});
    }
    const FittedLens fitted = FitLens(shapes, FisheyeLens(), p);
    const LensCalibration& lens = fitted.lens;
    apart.push_back((fitted.cameraToShapes[0].translation() - fitted.cameraToShapes[1].translation()).norm() / p.mountMm);
    TrueCamera here = WarpedCamera();
    here.cameraToShell = mounted(WarpedCamera().cameraToShell, 950);
    const auto some = Observe(here, *Dome(), seed % 2 == 0 ? 20 : 7, 70.0, 0.02, 0.1, 10 * seed + 5);
    for (int withSome = 0; withSome < 2; ++withSome) {
      const SurfaceMap map =
          PlaceSurfaceMap(lens, Dome(), WarpedCamera().cameraToShell, withSome == 1 ? some : decltype(some)(), p).map;
      for (const SurfaceObservation& o : Observe(here, *Dome(), 40, 65.0, 0.0, 0.0, 1)) {
        const MappedPoint mapped = map.Map(o.pixel);
        const SymmetricEigen axes = EigenOfSymmetric(mapped.covariance);
        for (const Eigen::Index axis : {1, 2})
          relative[withSome].push_back(std::pow(axes.vectors.col(axis).dot(mapped.point - o.point), 2) / axes.values[axis]);
      }
    }
  }
  for (const auto& squares : relative) {
    double sum = 0.0;
    for (const double square : squares)
      sum += square;
    // All places of one calibration share its error, so that twenty-four are not many.
    EXPECT_NEAR(std::sqrt(sum / static_cast<double>(squares.size())), 1.0, 0.3);
  }
  // The tilt of a sensor is not blamed on the mounts: of two of them the difference is seldom beyond four of their sigmas.
  EXPECT_LT(*std::max_element(apart.begin(), apart.end()), 5.0);
}

// A lens that is known to the last digit, its optics where the housing is.
LensCalibration ExactLens()
{
  LensCalibration lens;
  lens.optics.lens = Camera().lens;
  std::vector<Vector2d> pixels;
  for (int i = 0; i < 300; ++i)
    pixels.emplace_back(32.0 * (i % 20) + 15.0, 32.0 * (i / 20) + 15.0);
  lens.covered = PixelCoverage::Of(pixels);
  lens.covariance = Eigen::MatrixXd::Zero(13, 13);
  return lens;
}

TEST(SurfaceMap, WhatIsKnownExactlyStaysAsItIs)
{
  const auto few = Observe(Camera(), *Dome(), 8, 70.0, 0.02, 0.0, 9);
  SurfaceMapParameters p = WithoutHand();
  p.mountMm = p.mountDegrees = 0.5;
  const Pose off = Camera().cameraToShell * PoseAt({0.5, -0.4, 0.3}, {0.4, -0.5, 0.3});
  const SurfaceMap map = PlaceSurfaceMap(ExactLens(), Dome(), off, few, p).map;
  EXPECT_NEAR(map.State().optics.lens.focal, 183.0, 1e-3);
  EXPECT_NEAR(map.State().optics.lens.k1, -0.035, 1e-5);
  EXPECT_LT(Percentile(ErrorsOf(map, Camera(), 70.0), 0.95), 0.05);
  // A residual of so few centres that it bends nothing: the picture is 2 px further to the right.
  LensCalibration shifted = ExactLens();
  shifted.optics.residual = ThinPlate::Over({{100.0, 100.0}, {500.0, 200.0}, {300.0, 400.0}}, 3);
  shifted.optics.residual.weights[3].x() = 2.0;
  shifted.covariance = Eigen::MatrixXd::Zero(25, 25);
  auto seen = few;
  for (SurfaceObservation& o : seen)
    o.pixel.x() += 2.0;
  const SurfaceMap moved = PlaceSurfaceMap(shifted, Dome(), off, seen, p).map;
  EXPECT_NEAR(moved.State().optics.residual.At({320.0, 240.0}).x(), 2.0, 1e-3);
  EXPECT_LT((moved.Map(few[3].pixel + Vector2d(2.0, 0.0)).point - map.Map(few[3].pixel).point).norm(), 0.01);
}

TEST(SurfaceMap, SaysWhenMarksContradictWhatIsKnownOfTheMount)
{
  SurfaceMapParameters p;
  p.folds = 2;
  for (const int count : {1, 2, 3, 6, 20})
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      auto marks = Observe(Camera(), *Dome(), 30, 60.0, 0.02, 0.1, seed);
      marks.resize(static_cast<std::size_t>(count));
      Random random(seed, 77);
      Twist off;
      for (Eigen::Index k = 0; k < 6; ++k)
        off[k] = random.Normal() * (k < 3 ? p.mountMm : p.mountDegrees / DegreesPerRadian);
      const auto within = PlaceSurfaceMap(ExactLens(), Dome(), Camera().cameraToShell * Exp(off), marks, p);
      EXPECT_FALSE(within.report.isContradicted) << count << " " << within.report.contradiction;
      EXPECT_EQ(within.report.outliers.size(), 0u) << count << " " << within.report.Text();
      const Pose far = Camera().cameraToShell * PoseAt({4.0, -3.0, 0.0}, {0.0, 0.0, 0.0});
      const auto wrong = PlaceSurfaceMap(ExactLens(), Dome(), far, marks, p);
      EXPECT_TRUE(wrong.report.isContradicted) << count << " " << wrong.report.contradiction;
      EXPECT_NE(wrong.report.Text().find("contradict what is known of lens and mount"), std::string::npos);
      EXPECT_GT(wrong.map.Map({500.0, 240.0}).SigmaMm(), 1.5 * within.map.Map({500.0, 240.0}).SigmaMm()) << count;
    }
}

TEST(CameraFit, ARefitOfAllIsTheFit)
{
  // Observations are a hundred times worse than they say: what is known of a lens counts as much less in both.
  std::vector<SeenPoint> points;
  for (const SurfaceObservation& o : Observe(Camera(), *Dome(), 60, 85.0, 2.0, 0.0, 1)) {
    points.push_back({o.pixel, 4e-4 * Matrix2d::Identity(), o.point, 0.0, 0});
  }
  CameraFitSettings settings;
  settings.residualCentres = 0;
  const CameraOptics start{FisheyeLens(), {}};
  const CameraFitResult fit = FitCamera(points, start, {Nominal}, settings);
  EXPECT_GT(fit.misfit, 50.0);
  const CameraFitResult again = RefitCamera(points, start, {Nominal}, settings, fit, std::vector<bool>(points.size(), false));
  EXPECT_NEAR(again.optics.lens.focal, fit.optics.lens.focal, 1e-3);
  EXPECT_NEAR(again.optics.lens.k3, fit.optics.lens.k3, 1e-4);
  EXPECT_NEAR(again.optics.lens.k4, fit.optics.lens.k4, 1e-4);
}

TEST(SurfaceMap, IsItsStateAndDoesNotDependOnThreads)
{
  const auto observations = Observe(WarpedCamera(), *Dome(), 200, 85.0, 0.05, 0.1, 1);
  const auto fit = [&](int threads) {
    const ThreadLimit limit(threads);
    return FitSurfaceMap(observations, Dome(), FisheyeLens(), Nominal);
  };
  const auto one = fit(1), many = fit(4);
  EXPECT_EQ(one.report.Text(), many.report.Text());
  const SurfaceMap again(one.map.State(), Dome()), copy = many.map;
  for (const SurfaceObservation& o : observations) {
    const MappedPoint a = one.map.Map(o.pixel, o.covariance);
    for (const SurfaceMap* other : {&again, &copy}) {
      const MappedPoint b = other->Map(o.pixel, o.covariance);
      EXPECT_TRUE(a.point == b.point && a.covariance == b.covariance && a.normal == b.normal);
    }
  }
  const auto complaint = [&](const auto& change) {
    SurfaceMapState state = one.map.State();
    change(state);
    return Complaint([&] { SurfaceMap(state, Dome()); }, Error::Kind::BadInput);
  };
  EXPECT_NE(complaint([](SurfaceMapState& s) { s.covariance.conservativeResize(5, 5); }).find("covariance"), std::string::npos);
  EXPECT_NE(complaint([](SurfaceMapState& s) { s.optics.residual.weights.resize(9); }).find("9 weights"), std::string::npos);
  EXPECT_NE(complaint([](SurfaceMapState& s) { s.covered.reach.pop_back(); }).find("covers"), std::string::npos);
  EXPECT_NE(complaint([](SurfaceMapState& s) { s.cameraToShell.linear() *= 2.0; }).find("pose"), std::string::npos);
  EXPECT_NE(complaint([](SurfaceMapState& s) { s.optics.residual.scale = 0.0; }).find("residual"), std::string::npos);
}

TEST(ProxyMap, IsAffineInItsTrianglesAndExactAtItsMarks)
{
  const TriangleSurface proxy = Ellipsoid({150.0, 120.0, 110.0}, 3);
  const TrueCamera camera = Camera();
  const Vector3d eye = camera.cameraToShell.translation();
  std::vector<Vector2d> pixels;
  for (const Eigen::Vector3f& point : proxy.points) {
    const auto pixel = camera.PixelOf(point.cast<double>());
    pixels.push_back(pixel && camera.lens.Covers(*pixel) ? *pixel : Vector2d::Constant(std::nan("")));
  }
  const ProxyMap map(proxy, pixels, eye, Dome());
  int inside = 0;
  double worst = 0.0;
  for (const auto& [a, b, c] : proxy.triangles) {
    if (!(pixels[a].allFinite() && pixels[b].allFinite() && pixels[c].allFinite()))
      continue;
    ++inside;
    EXPECT_LT((map.Map(pixels[a]).point - proxy.points[a].cast<double>()).norm(), 1e-3);
    const Vector2d pixel = 0.5 * pixels[a] + 0.3 * pixels[b] + 0.2 * pixels[c];
    const Vector3d flat =
        0.5 * proxy.points[a].cast<double>() + 0.3 * proxy.points[b].cast<double>() + 0.2 * proxy.points[c].cast<double>();
    const MappedPoint mapped = map.Map(pixel, 0.01 * Matrix2d::Identity());
    ASSERT_EQ(static_cast<int>(mapped.status), Mapped);
    EXPECT_LT((mapped.point - eye).cross(flat - eye).norm() / (flat - eye).norm(), 1e-6);
    EXPECT_LT(Dome()->NearestTo(mapped.point)->distanceMm, 1e-4);
    worst = std::max(worst, (*camera.PixelOf(mapped.point) - pixel).norm());
    // Its covariance is the difference of neighbours.
    const Vector3d right = map.Map(pixel + Vector2d(1e-3, 0.0)).point, up = map.Map(pixel + Vector2d(0.0, 1e-3)).point;
    const double spread = std::sqrt(((right - mapped.point).squaredNorm() + (up - mapped.point).squaredNorm()) * 1e6);
    EXPECT_NEAR(std::sqrt(mapped.covariance.trace()), 0.1 * spread, 0.02 * spread);
  }
  EXPECT_GT(inside, 200);
  EXPECT_GT(worst, 0.5); // pixels: what the camera's map does not do
  EXPECT_EQ(static_cast<int>(map.Map({-50.0, 0.0}).status), NotCovered);
  Complaint([&] { ProxyMap(proxy, {}, eye, Dome()); }, Error::Kind::BadInput);
  Complaint([&] { ProxyMap(proxy, std::vector<Vector2d>(proxy.points.size(), Vector2d::Constant(NAN)), eye, Dome()); },
            Error::Kind::BadInput);
}

} // namespace
