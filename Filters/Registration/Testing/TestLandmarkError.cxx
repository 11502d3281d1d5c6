// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Filters/Registration/LandmarkError.h"
#include <gtest/gtest.h>

using namespace echorama;
using Eigen::Vector3d;

namespace {

std::string MessageOf(const std::vector<LandmarkList>& lists)
{
  try {
    MeasureLandmarkError(lists);
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::BadInput);
    return error.what();
  }
  return "";
}

LandmarkList List(const std::string& name, std::vector<Landmark> landmarks, const Pose& pose = Pose::Identity())
{
  return {pose, std::move(landmarks), name};
}

} // namespace

TEST(LandmarkError, OfTheTruthIsZeroAndOfAMoveItsLength)
{
  const Pose truth = MotionAbout({10, 20, 30}, {0.3, -0.2, 0.5}, {4, 5, -6});
  Random random(3);
  std::vector<Landmark> first, second;
  for (int i = 0; i < 40; ++i) {
    const Vector3d place = 60.0 * random.Direction();
    first.push_back({std::to_string(i), place});
    second.insert(second.begin(), {std::to_string(i), truth.inverse() * place}); // in another order
  }
  const LandmarkError right = MeasureLandmarkError({List("a", first), List("b", second, truth)});
  ASSERT_EQ(right.distances.size(), 40u);
  EXPECT_LT(right.max, 1e-12);

  Pose moved = truth;
  moved.pretranslate(Vector3d(1, -2, 2));
  const LandmarkError wrong = MeasureLandmarkError({List("a", first), List("b", second, moved)});
  for (const double figure : {wrong.mean, wrong.rms, wrong.median, wrong.percentile95, wrong.max})
    EXPECT_NEAR(figure, 3.0, 1e-12);
  EXPECT_EQ(wrong.distances[7].label, "7");
  EXPECT_TRUE(wrong.distances[7].place.isApprox(first[7].position));
  EXPECT_TRUE(wrong.distances[7].error.isApprox(Vector3d(1, -2, 2), 1e-9));
}

TEST(LandmarkError, DisplacementsAreTakenBack)
{
  ImageGeometry lattice;
  lattice.dimensions = {6, 6, 6};
  lattice.origin.setConstant(-50.0);
  lattice.spacing.setConstant(20.0);
  std::vector<Vector3d> coefficients;
  Random random(5);
  for (int n = 0; n < 216; ++n)
    coefficients.push_back(4.0 * random.Uniform() * random.Direction());
  const DisplacementField field(lattice, coefficients);
  const Pose pose = MotionAbout({10, 20, 30}, {0.3, -0.2, 0.5}, {4, 5, -6});
  LandmarkList first = List("a", {}), second = List("b", {}, pose);
  for (int i = 0; i < 20; ++i) {
    const Vector3d place = 30.0 * random.Direction();
    first.landmarks.push_back({std::to_string(i), place});
    second.landmarks.push_back({std::to_string(i), pose.inverse() * (place + field.At(place))}); // where the volume shows it
  }
  EXPECT_GT(MeasureLandmarkError({first, second}).mean, 0.3);
  second.displacement = field;
  EXPECT_LT(MeasureLandmarkError({first, second}).max, 1e-5);
}

TEST(LandmarkError, FiguresOfKnownLengths)
{
  std::vector<Landmark> first, second;
  for (int i = 1; i <= 20; ++i) { // 1 ... 20 mm apart
    first.push_back({std::to_string(i), Vector3d::Zero()});
    second.push_back({std::to_string(i), Vector3d(0, i, 0)});
  }
  const LandmarkError error = MeasureLandmarkError({List("a", first), List("b", second)});
  EXPECT_DOUBLE_EQ(error.mean, 10.5);
  EXPECT_DOUBLE_EQ(error.rms, std::sqrt(143.5));
  EXPECT_DOUBLE_EQ(error.median, 10.0);
  EXPECT_DOUBLE_EQ(error.percentile95, 19.0);
  EXPECT_DOUBLE_EQ(error.max, 20.0);
}

TEST(LandmarkError, EveryPairOfVolumesCounts)
{
  const LandmarkError error =
      MeasureLandmarkError({List("a", {{"p", {0, 0, 0}}, {"only a", {0, 0, 0}}}), List("b", {{"p", {1, 0, 0}}, {"q", {0, 0, 0}}}),
                            List("c", {{"q", {0, 0, 5}}, {"p", {3, 0, 0}}})});
  ASSERT_EQ(error.distances.size(), 4u); // p: ab, ac, bc; q: bc
  EXPECT_DOUBLE_EQ(error.mean, (1.0 + 3.0 + 2.0 + 5.0) / 4.0);
  EXPECT_EQ(error.distances[1].first, 0);
  EXPECT_EQ(error.distances[1].second, 2);
  ASSERT_EQ(error.unmatched.size(), 1u);
  EXPECT_EQ(error.unmatched[0].label, "only a");
  EXPECT_EQ(error.unmatched[0].list, 0);
}

TEST(LandmarkError, WhatCannotBePairedIsRefused)
{
  EXPECT_NE(MessageOf({List("a", {{"p", {0, 0, 0}}})}).find("at least two"), std::string::npos);
  EXPECT_NE(MessageOf({List("a", {{"p", {0, 0, 0}}}), List("b", {{"q", {0, 0, 0}}})}).find("no label"), std::string::npos);
  EXPECT_NE(MessageOf({List("a", {{"p", {0, 0, 0}}, {"p", {1, 0, 0}}}), List("b", {{"p", {0, 0, 0}}})})
                .find("a: two landmarks have the label \"p\""),
            std::string::npos);
  EXPECT_NE(MessageOf({List("a", {{"p", {0, 0, 0}}}), List("b", {{"", {0, 0, 0}}})}).find("b: a landmark has no label"),
            std::string::npos);
  EXPECT_NE(MessageOf({List("a", {{"p", {0, std::nan(""), 0}}}), List("b", {{"p", {0, 0, 0}}})}).find("not finite"),
            std::string::npos);
  Pose bad = Pose::Identity();
  bad.translation().x() = std::nan("");
  EXPECT_NE(MessageOf({List("a", {{"p", {0, 0, 0}}}, bad), List("b", {{"p", {0, 0, 0}}})}).find("pose"), std::string::npos);
}
