// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Deformation/DeformableAlign.h"
#include "Testing/Sanitized.h"
#include <cmath>
#include <functional>
#include <gtest/gtest.h>

namespace echorama {
namespace {

// A random field of the world with waves of 6 mm and longer. Known everywhere, so that what a bent volume shows is exact.
double SceneAt(const Eigen::Vector3d& p)
{
  static const auto waves = [] {
    std::vector<std::pair<Eigen::Vector3d, double>> list;
    for (std::uint64_t w = 0; w < 40; ++w) {
      Random random(3, w);
      list.push_back(
          {random.Direction() * (6.283185307179586 / random.Uniform(6.0, 25.0)), random.Uniform(0.0, 6.283185307179586)});
    }
    return list;
  }();
  double sum = 0.0;
  for (const auto& [k, phase] : waves)
    sum += std::cos(k.dot(p) + phase);
  return 100.0 + 6.0 * sum;
}

// A bump under a probe at the top of the moving volume.
Eigen::Vector3d Bump(const Eigen::Vector3d& x, double mm)
{
  const Eigen::Vector3d d = x - Eigen::Vector3d(40.0, 32.0, 20.0);
  return mm * std::exp(-0.5 * d.squaredNorm() / 400.0) * Eigen::Vector3d(0.3, -0.2, 0.93);
}

struct Seen {
  ImageGeometry geometry;
  std::vector<PyramidLevel> pyramid;
  std::shared_ptr<const MetricPyramid> features;
};

// What a volume shows of the scene: at y, what lies at placeOf(y); times a gain, with noise of its own.
Seen See(const std::string& name, const Eigen::Vector3d& origin, double noise, double gain,
         const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& placeOf, const Pose& turn = Pose::Identity())
{
  Seen seen;
  seen.geometry.dimensions = {40, 36, 34};
  seen.geometry.spacing.setConstant(2.0);
  seen.geometry.origin = origin;
  Volume<float> volume(seen.geometry.dimensions);
  Volume<unsigned char> valid(seen.geometry.dimensions, 1);
  const Eigen::Affine3d toWorld = seen.geometry.IndexToWorld();
  ParallelFor(volume.View().Slices(), [&](std::ptrdiff_t k) {
    Random random(std::hash<std::string>()(name) % 1000, static_cast<std::uint64_t>(k));
    for (int j = 0; j < 36; ++j)
      for (int i = 0; i < 40; ++i) {
        const Eigen::Vector3d y = toWorld * Eigen::Vector3d(i, j, static_cast<double>(k));
        volume.View()(i, j, static_cast<int>(k)) = static_cast<float>(gain * (SceneAt(placeOf(y)) + noise * random.Normal()));
        valid.View()(i, j, static_cast<int>(k)) = (Eigen::Vector2d(i - 20, j - 18).norm() < 19.0); // a round valid region
      }
  });
  seen.pyramid = BuildPyramid<float>({volume.View(), valid.View(), seen.geometry.Moved(turn)});
  seen.features = BuildMetricPyramid({&seen.pyramid, Pose::Identity(), name}, "local-ncc");
  return seen;
}

Eigen::Vector3d Itself(const Eigen::Vector3d& y)
{
  return y;
}

DeformableAlignParameters Quick()
{
  DeformableAlignParameters p;
  p.levels = 2;
  p.finestMm = 2.0;
  p.bendingWeight = 200.0; // there are few voxels, and the bump is narrow
  return p;
}

// Mean distance between where points of the moving volume belong and where the field says they do; before: without it.
struct Errors {
  double before = 0.0, after = 0.0;
};
Errors ErrorsOf(const DisplacementField& field, double mm, const Pose& turn = Pose::Identity())
{
  Errors errors;
  int count = 0;
  for (double z = 10.0; z < 60.0; z += 8.0)
    for (double y = 20.0; y < 50.0; y += 8.0)
      for (double x = 24.0; x < 60.0; x += 8.0, ++count) {
        const Eigen::Vector3d read(x, y, z), belongs = read + Bump(read, mm);
        errors.before += (belongs - read).norm();
        errors.after += (turn.inverse() * field.Inverse(turn * read) - belongs).norm();
      }
  errors.before /= count;
  errors.after /= count;
  return errors;
}

std::string MessageOf(const std::function<void()>& call, Error::Kind kind)
{
  try {
    call();
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), kind) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

class DeformableAlignTest : public testing::Test {
protected:
  static void SetUpTestSuite()
  {
    fixed = new Seen(See("fixed", {14.0, 4.0, 0.0}, 8.0, 1.0, Itself));
    bent = new Seen(
        See("bent", {0.0, 0.0, 0.0}, 8.0, 0.6, [](const Eigen::Vector3d& y) -> Eigen::Vector3d { return y + Bump(y, 3.0); }));
    straight = new Seen(See("straight", {0.0, 0.0, 0.0}, 8.0, 0.6, Itself));
  }
  static void TearDownTestSuite()
  {
    delete fixed;
    delete bent;
    delete straight;
  }
  static DeformableVolume Volume(const Seen* seen) { return {seen->features.get(), Pose::Identity(), nullptr}; }

  static inline Seen *fixed = nullptr, *bent = nullptr, *straight = nullptr;
};

TEST_F(DeformableAlignTest, FindsABumpUnderTheProbe)
{
  const auto result = DeformableAlign({Volume(fixed)}, Volume(bent), Quick());
  const Errors errors = ErrorsOf(result.field, 3.0);
  EXPECT_TRUE(result.isApplied) << result.reason;
  EXPECT_GT(errors.before, 0.7);
  EXPECT_LT(errors.after, 0.25 * errors.before);
  EXPECT_GT(result.similarityAfter, result.similarityBefore + 0.05);
  EXPECT_GT(result.overlap, 0.5);
  EXPECT_LT(result.overlap, 0.95);
  EXPECT_GT(result.smallestDeterminant, 0.5);
  EXPECT_NEAR(result.largestMm, 3.0, 1.0);
  EXPECT_GT(result.gain, 0.2);
  Random random(5, 0);
  for (int i = 0; i < 2000; ++i) { // it folds nowhere, in the overlap and around it
    const Eigen::Vector3d at(random.Uniform(-60.0, 140.0), random.Uniform(-60.0, 140.0), random.Uniform(-60.0, 130.0));
    EXPECT_GT(result.field.Jacobian(at).determinant(), 0.4) << at.transpose();
  }
  EXPECT_DOUBLE_EQ(result.bendingEnergy, result.field.BendingEnergy());
  EXPECT_DOUBLE_EQ(result.voxelMm, 2.0);
  // beyond the overlap it fades to exactly nothing, and never grows on the way
  EXPECT_EQ(result.field.At({-150.0, 32.0, 30.0}).norm(), 0.0);
  for (double x = -140.0; x < 14.0; x += 5.0)
    EXPECT_LT(result.field.At({x, 32.0, 20.0}).norm(), result.largestMm + 0.1);
}

TEST_F(DeformableAlignTest, LeavesStraightVolumesAlone)
{
  // noise of their own must not bend them: less than a tenth of a voxel on the average
  const auto result = DeformableAlign({Volume(fixed)}, Volume(straight), Quick());
  EXPECT_LT(ErrorsOf(result.field, 0.0).after, 0.2);
}

TEST_F(DeformableAlignTest, WhatAddsLittleIsNotApplied)
{
  DeformableAlignParameters p = Quick();
  p.minimumGain = 0.2;
  const auto left = DeformableAlign({Volume(fixed)}, Volume(straight), p);
  EXPECT_FALSE(left.isApplied);
  EXPECT_TRUE(left.field.IsZero());
  EXPECT_NE(left.reason.find("MinimumGain"), std::string::npos) << left.reason;
  EXPECT_GE(left.gain, 0.0);
  EXPECT_LT(left.gain, p.minimumGain);
  p.minimumGain = 0.0;
  EXPECT_TRUE(DeformableAlign({Volume(fixed)}, Volume(straight), p).isApplied) << "what it found is what was left out";
  p.minimumGain = 1.0;
  EXPECT_FALSE(DeformableAlign({Volume(fixed)}, Volume(bent), p).isApplied) << "nothing is as much alike as that";
}

TEST_F(DeformableAlignTest, IdenticalVolumesStayAsTheyAre)
{
  const auto result = DeformableAlign({Volume(bent)}, Volume(bent), Quick());
  EXPECT_LT(ErrorsOf(result.field, 0.0).after, 1e-3);
  EXPECT_NEAR(result.similarityBefore, 1.0, 1e-9);
  EXPECT_NEAR(result.overlap, 1.0, 1e-6);
}

TEST_F(DeformableAlignTest, ThreadsDoNotChangeIt)
{
  DeformableAlignParameters p = Quick();
  p.iterations = 2;
  const auto on = [&](int threads) {
    const ThreadLimit limit(threads);
    const auto result = DeformableAlign({Volume(fixed)}, Volume(bent), p);
    EXPECT_TRUE(result.isApplied) << result.reason;
    return result.field.Coefficients();
  };
  EXPECT_TRUE(on(1) == on(2));
}

TEST_F(DeformableAlignTest, TheWorldHasNoDirection)
{
  // both volumes turned and moved, once by their poses and once by their geometry
  DeformableAlignParameters p = Quick();
  p.iterations = 4;
  const Pose turn = MotionAbout({20.0, 30.0, 40.0}, {0.4, -0.9, 0.3}, {100.0, -50.0, 20.0});
  const auto plain = DeformableAlign({Volume(fixed)}, Volume(bent), p);
  const auto posed = DeformableAlign({{fixed->features.get(), turn, nullptr}}, {bent->features.get(), turn, nullptr}, p);
  for (double x = 20.0; x < 70.0; x += 10.0) {
    const Eigen::Vector3d at(x, 30.0, 25.0);
    EXPECT_LT((turn.linear() * plain.field.At(at) - posed.field.At(turn * at)).norm(), 0.05);
  }
  EXPECT_LT(ErrorsOf(posed.field, 3.0, turn).after, 0.3);
}

TEST_F(DeformableAlignTest, AFixedVolumeIsReadThroughItsOwnField)
{
  // The bent volume with the field that straightens it stands for the straight one.
  const auto first = DeformableAlign({Volume(fixed)}, Volume(bent), Quick());
  const DeformableVolume straightened{bent->features.get(), Pose::Identity(), &first.field};
  const auto second = DeformableAlign({straightened, Volume(fixed)}, Volume(straight), Quick());
  EXPECT_LT(ErrorsOf(second.field, 0.0).after, 0.25);
  EXPECT_GT(second.similarityBefore, DeformableAlign({Volume(bent)}, Volume(straight), Quick()).similarityBefore);
}

TEST_F(DeformableAlignTest, ManyComeInTurn)
{
  const Pose away = MotionAbout({0, 0, 0}, {0, 0, 0}, {900.0, 0.0, 0.0});
  const std::vector<DeformableVolume> volumes{
      {straight->features.get(), away, nullptr}, Volume(bent), Volume(fixed), Volume(straight)};
  const auto results = DeformInTurn(volumes, 2, Quick());
  ASSERT_EQ(results.size(), 4u);
  EXPECT_FALSE(results[0].isApplied);
  EXPECT_NE(results[0].reason.find("straight"), std::string::npos) << results[0].reason;
  EXPECT_TRUE(results[1].isApplied) << results[1].reason;
  EXPECT_TRUE(results[2].field.IsZero());
  EXPECT_LT(ErrorsOf(results[1].field, 3.0).after, 0.5);
  EXPECT_LT(ErrorsOf(results[3].field, 0.0).after, 0.25);
  EXPECT_NE(MessageOf([&] { DeformInTurn(volumes, 4, Quick()); }, Error::Kind::InvalidParameter).find("fixed volume"),
            std::string::npos);
  EXPECT_NE(MessageOf([&] { DeformInTurn({Volume(fixed)}, 0, Quick()); }, Error::Kind::BadInput).find("two volumes"),
            std::string::npos);
}

TEST_F(DeformableAlignTest, AFieldThatFoldsIsNotApplied)
{
  ECHORAMA_SKIP_SANITIZED();
  // More noise than tissue, and all but nothing against bending.
  const Seen other = See("other", {0.0, 0.0, 0.0}, 60.0, 1.0, Itself);
  DeformableAlignParameters p = Quick();
  p.bendingWeight = 1e-6;
  p.controlSpacingMm = 12.0;
  p.levels = 1;
  p.iterations = 2;
  const auto result = DeformableAlign({Volume(fixed)}, Volume(&other), p);
  EXPECT_FALSE(result.isApplied);
  EXPECT_LE(result.smallestDeterminant, 0.0);
  EXPECT_NE(result.reason.find("folds"), std::string::npos) << result.reason;
  EXPECT_TRUE(result.field.IsZero());
}

TEST_F(DeformableAlignTest, RefusesAndStops)
{
  const auto p = Quick();
  EXPECT_NE(MessageOf([&] { DeformableAlign({}, Volume(bent), p); }, Error::Kind::BadInput).find("at least one fixed volume"),
            std::string::npos);
  MessageOf([&] { DeformableAlign({Volume(fixed)}, {}, p); }, Error::Kind::BadInput);
  const Pose away = MotionAbout({0, 0, 0}, {0, 0, 0}, {900.0, 0.0, 0.0});
  EXPECT_NE(MessageOf(
                [&] {
                  DeformableAlign({Volume(fixed)}, {bent->features.get(), away, nullptr}, p);
                },
                Error::Kind::NotPossible)
                .find("bent"),
            std::string::npos);
  const auto refuse = [&](const char* name, double DeformableAlignParameters::*real, int DeformableAlignParameters::*whole,
                          double value) {
    DeformableAlignParameters bad;
    if (real)
      bad.*real = value;
    else
      bad.*whole = static_cast<int>(value);
    EXPECT_NE(MessageOf([&] { CheckRanges(bad); }, Error::Kind::InvalidParameter).find(name), std::string::npos);
  };
  refuse("ControlSpacingMm", &DeformableAlignParameters::controlSpacingMm, nullptr, 1.0);
  refuse("BendingWeight", &DeformableAlignParameters::bendingWeight, nullptr, std::nan(""));
  refuse("MinimumGain", &DeformableAlignParameters::minimumGain, nullptr, 1.5);
  refuse("FinestMm", &DeformableAlignParameters::finestMm, nullptr, 0.0);
  refuse("MinimumOverlap", &DeformableAlignParameters::minimumOverlap, nullptr, 1.5);
  refuse("Levels", nullptr, &DeformableAlignParameters::levels, 0);
  refuse("Iterations", nullptr, &DeformableAlignParameters::iterations, 0);

  int calls = 0;
  const Progress stop([&calls](double) { return ++calls < 3; });
  MessageOf([&] { DeformableAlign({Volume(fixed)}, Volume(bent), p, stop); }, Error::Kind::Cancelled);
  double last = 0.0;
  const Progress watch([&last](double fraction) {
    EXPECT_GE(fraction, last);
    last = fraction;
    return true;
  });
  DeformableAlign({Volume(fixed)}, Volume(bent), p, watch);
  EXPECT_EQ(last, 1.0);
}

} // namespace
} // namespace echorama
