// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Live/BeamThickness.h"
#include <cmath>
#include <gtest/gtest.h>

namespace {

using namespace echorama;

TEST(BeamThickness, WidthIsSmallestAtTheFocusAndGrowsAsAHyperbola)
{
  const BeamThickness thickness{4.0, 50.0, 0.2, 5};
  const double widthPerSigma = 2.0 * std::sqrt(2.0 * std::log(2.0));
  EXPECT_NEAR(thickness.SigmaMm(50.0) * widthPerSigma, 4.0, 1e-12);
  EXPECT_NEAR(thickness.SigmaMm(65.0) * widthPerSigma, 5.0, 1e-12); // 4, 3 and 5
  EXPECT_DOUBLE_EQ(thickness.SigmaMm(35.0), thickness.SigmaMm(65.0));
}

TEST(BeamThickness, NoThicknessIsOnePlaneOnTheAxisAtAnyDepth)
{
  const BeamThickness razor{0.0, 50.0, 0.2, 5};
  const auto planes = PlanesOf(razor);
  ASSERT_EQ(planes.size(), 1u);
  EXPECT_EQ(planes[0].offset, 0.0f);
  EXPECT_EQ(planes[0].weight, 1.0f);
  EXPECT_EQ(razor.SigmaMm(90.0), 0.0);
}

TEST(BeamThickness, PlanesHaveTheMomentsOfTheGaussian)
{
  for (const int count : {1, 2, 3, 5, 8, 33, 65}) {
    const auto planes = PlanesOf({4.0, 50.0, 0.2, count});
    ASSERT_EQ(planes.size(), static_cast<std::size_t>(count));
    double sum = 0.0, mean = 0.0, square = 0.0;
    for (const auto& plane : planes) {
      sum += plane.weight;
      mean += static_cast<double>(plane.weight) * plane.offset;
      square += static_cast<double>(plane.weight) * plane.offset * plane.offset;
    }
    EXPECT_NEAR(sum, 1.0, 1e-6) << count;
    EXPECT_NEAR(mean, 0.0, 1e-6) << count;
    // A Gaussian that is cut at 2.5 standard deviations has 0.911 of its variance.
    if (count >= 5) {
      EXPECT_NEAR(square, 0.911, count >= 33 ? 0.005 : 0.09) << count;
    }
  }
}

TEST(BeamThickness, RefusesWhatIsOutOfRange)
{
  EXPECT_THROW(PlanesOf({-1.0, 50.0, 0.2, 5}), Error);
  EXPECT_THROW(PlanesOf({4.0, 50.0, 0.2, 0}), Error);
  EXPECT_THROW(PlanesOf({4.0, std::nan(""), 0.2, 5}), Error);
}

} // namespace
