// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Filters/Registration/LandmarkTerm.h"
#include <gtest/gtest.h>

using namespace echorama;
using Eigen::Vector3d;

namespace {

Vector3d Place(Random& random)
{
  return {random.Uniform(-40.0, 40.0), random.Uniform(-40.0, 40.0), random.Uniform(-40.0, 40.0)};
}

// What belongs together once the moving volume is where the truth says; errors of a standard deviation along each axis.
std::vector<LandmarkPair> Pairs(int count, const Pose& fixedToWorld, const Pose& truth, double sigmaMm, std::uint64_t seed)
{
  Random random(seed);
  std::vector<LandmarkPair> pairs;
  for (int i = 0; i < count; ++i) {
    const Vector3d place = Place(random), error = sigmaMm * Vector3d{random.Normal(), random.Normal(), random.Normal()};
    pairs.push_back({std::to_string(i), fixedToWorld.inverse() * (place + error), truth.inverse() * place});
  }
  return pairs;
}

const Pose Fixed = MotionAbout({1, 2, 3}, {0.3, -0.2, 0.5}, {10, 0, -5});
const Pose Truth = MotionAbout({9, -2, 4}, {-0.4, 0.9, 0.2}, {20, 30, -15});

} // namespace

TEST(LandmarkTerm, PairsByLabel)
{
  const std::vector<Landmark> a{{"p", {1, 0, 0}}, {"only a", {2, 0, 0}}, {"q", {3, 0, 0}}};
  const std::vector<Landmark> b{{"q", {4, 0, 0}}, {"only b", {5, 0, 0}}, {"p", {6, 0, 0}}};
  const auto pairs = PairLandmarks(a, "a", b, "b");
  ASSERT_EQ(pairs.size(), 2u);
  EXPECT_EQ(pairs[0].label, "p");
  EXPECT_EQ(pairs[0].moving.x(), 6.0);
  EXPECT_EQ(pairs[1].fixed.x(), 3.0);
  EXPECT_TRUE(PairLandmarks(a, "a", {}, "b").empty());
  EXPECT_THROW(PairLandmarks({{"p", {0, 0, 0}}, {"p", {0, 0, 0}}}, "a", {}, "b"), Error); // alone or not
}

TEST(LandmarkTerm, GradientAndHessianAreThoseOfTheLoss)
{
  const LandmarkTerm term(Pairs(3, Fixed, Truth, 0.0, 1), Fixed, 2.0);
  const Vector3d centre(5, -3, 8);
  const Pose pose = MotionAbout(centre, {0.05, -0.02, 0.04}, {3, -4, 1}) * Truth; // where some count linearly
  const LandmarkLoss here = term.At(pose, centre);
  EXPECT_GT(here.loss, 1.0);
  constexpr double step = 1e-5;
  for (int d = 0; d < 6; ++d) {
    const auto loss = [&](double by) {
      const Twist twist = by * Twist::Unit(d);
      return term.At(MotionAbout(centre, twist.tail<3>(), twist.head<3>()) * pose, centre).loss;
    };
    EXPECT_NEAR(here.gradient[d], (loss(step) - loss(-step)) / (2.0 * step), 1e-6 * (1.0 + std::abs(here.gradient[d]))) << d;
  }
  // At the truth the Gauss-Newton Hessian is the Hessian.
  const LandmarkLoss there = term.At(Truth, centre);
  EXPECT_NEAR(there.loss, 0.0, 1e-20);
  for (int d = 0; d < 6; ++d) {
    const Twist twist = 1e-4 * Twist::Unit(d);
    const LandmarkLoss by = term.At(MotionAbout(centre, twist.tail<3>(), twist.head<3>()) * Truth, centre);
    EXPECT_NEAR(by.loss, 0.5e-8 * there.hessian(d, d), 1e-10 * there.hessian(d, d)) << d;
  }
  EXPECT_NEAR(there.hessian(0, 0), 3.0 / 4.0, 1e-12); // three landmarks of 2 mm
}

TEST(LandmarkTerm, ThreeAndMoreSayAll)
{
  for (const int count : {3, 4, 10}) {
    const LandmarkTerm term(Pairs(count, Fixed, Truth, 0.0, 2), Fixed, 0.01);
    const Pose found = term.Nearest(Pose::Identity());
    EXPECT_LT((found.matrix() - Truth.matrix()).norm(), 1e-3) << count;
    EXPECT_TRUE(term.Agrees(found));
    EXPECT_FALSE(term.Agrees(Pose::Identity()));
  }
}

TEST(LandmarkTerm, FewerLeaveTheRestAsItIs)
{
  const Pose start = MotionAbout({0, 0, 0}, {0.1, 0.2, 0.3}, {4, 5, 6});
  EXPECT_EQ(LandmarkTerm().Nearest(start).matrix(), start.matrix());
  EXPECT_TRUE(LandmarkTerm().Agrees(start));

  const auto one = Pairs(1, Fixed, Truth, 0.0, 3);
  const Pose moved = LandmarkTerm(one, Fixed, 1.0).Nearest(start);
  EXPECT_TRUE(moved.linear().isApprox(start.linear(), 1e-12));
  EXPECT_LT((moved * one[0].moving - Fixed * one[0].fixed).norm(), 1e-9);

  // Two: the line is turned by the angle between both, about what is perpendicular to them.
  const auto two = Pairs(2, Fixed, Truth, 0.0, 4);
  const Pose turned = LandmarkTerm(two, Fixed, 0.01).Nearest(start);
  for (const LandmarkPair& pair : two)
    EXPECT_LT((turned * pair.moving - Fixed * pair.fixed).norm(), 1e-3);
  const Vector3d from = (start * two[1].moving - start * two[0].moving).normalized();
  const Vector3d to = (Fixed * two[1].fixed - Fixed * two[0].fixed).normalized();
  EXPECT_NEAR(RotationAngle(turned * start.inverse()), std::acos(from.dot(to)), 1e-4);
}

TEST(LandmarkTerm, ANearlyStraightLineIsNotTurnedByItsErrors)
{
  // Along x, 1 mm off it, and found 1 mm wrong: nothing is known of a turn about x.
  const std::vector<LandmarkPair> pairs{
      {"a", {0, 0, 0}, {0, 0, 0.5}}, {"b", {20, 0, 0.1}, {20, 0.1, 0}}, {"c", {40, 0, 0}, {40, -0.5, 0}}};
  const Pose found = LandmarkTerm(pairs, Pose::Identity(), 2.0).Nearest(Pose::Identity());
  EXPECT_LT(RotationAngle(found), 0.05);
}

TEST(LandmarkTerm, ChanceAgreesAndMistakesDoNot)
{
  constexpr int Trials = 4000;
  for (const int count : {1, 2, 3, 8}) {
    int refused = 0;
    for (int trial = 0; trial < Trials; ++trial)
      refused +=
          !LandmarkTerm(Pairs(count, Fixed, Truth, 2.0, 100 + static_cast<std::uint64_t>(trial)), Fixed, 2.0).Agrees(Truth);
    // The tail of one landmark beyond 4 standard deviations, 0.11%, for each and for all.
    EXPECT_LT(refused, 0.0011 * (count + 1) * Trials + 3.0 * std::sqrt(0.0011 * (count + 1) * Trials)) << count;
  }
  const auto shifted = [](int count, double mm) {
    Pose pose = Truth;
    pose.pretranslate(Vector3d(mm, 0, 0));
    return LandmarkTerm(Pairs(count, Fixed, Truth, 0.0, 7), Fixed, 2.0).Agrees(pose);
  };
  EXPECT_TRUE(shifted(1, 7.99));
  EXPECT_FALSE(shifted(1, 8.01));
  EXPECT_TRUE(shifted(3, 6.0)); // 27 of a sum of 9 squares, which 0.1% exceed at 27.9
  EXPECT_FALSE(shifted(3, 6.2));
  // The pose itself may be less sure.
  Pose pose = Truth;
  pose.pretranslate(Vector3d(9.0, 0, 0));
  EXPECT_TRUE(LandmarkTerm(Pairs(1, Fixed, Truth, 0.0, 7), Fixed, 2.0).Agrees(pose, 1.5)); // 4 times 2.5
}

TEST(LandmarkTerm, TwoThatAreMixedUpFitNowhere)
{
  auto pairs = Pairs(4, Fixed, Truth, 0.0, 9);
  std::swap(pairs[1].moving, pairs[2].moving);
  const LandmarkTerm term(pairs, Fixed, 2.0);
  const Pose best = term.Nearest(Truth);
  EXPECT_FALSE(term.Agrees(best));
  EXPECT_FALSE(term.Agrees(Truth));
  const std::string worst = term.Worst(Truth);
  EXPECT_TRUE(worst.rfind("\"1\" is ", 0) == 0 || worst.rfind("\"2\" is ", 0) == 0) << worst;
}
