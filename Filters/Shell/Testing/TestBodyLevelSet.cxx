// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Shell/Benchmarks/InventedAbdomen.h"
#include "Filters/Shell/BodyLevelSet.h"
#include "Testing/Sanitized.h"
#include <cmath>
#include <gtest/gtest.h>

using namespace echorama;
using Eigen::Vector3d;

namespace {

TEST(BodyLevelSet, DistancesAreThoseOfTheBodyToHalfACell)
{
  ECHORAMA_SKIP_SANITIZED();
  const BodySurface body(InventedAbdomen(40));
  const double cell = 1.0, inside = 6.0, outside = 3.0;
  const Vector3d origin = body.Bounds().min() - Vector3d::Constant(7.3);
  const BodyLevelSet level(body, origin, cell, inside, outside);
  double worst = 0.0;
  int near = 0, far = 0;
  LevelSet::Values values;
  for (int k = 0; k < 200; k += 40)
    for (int j = 0; j < 260; j += 40)
      for (int i = 0; i < 320; i += 8) {
        level.Fill({i, j, k}, values);
        std::size_t at = 0;
        for (int z = 0; z < LevelSet::blockNodes; ++z)
          for (int y = 0; y < LevelSet::blockNodes; ++y)
            for (int x = 0; x < LevelSet::blockNodes; ++x, ++at) {
              const double told = static_cast<double>(values[at]);
              if (at % 5 != 0)
                continue;
              const double exact = body.Distance(origin + cell * Vector3d(i + x, j + y, k + z));
              if (told > -0.99 * inside && told < 0.99 * outside) {
                worst = std::max(worst, std::abs(told - exact));
                ++near;
              } else { // far, and on the right side
                ASSERT_GT(told * exact, 0.0);
                ASSERT_GT(std::abs(exact), 0.9 * std::min(inside, outside));
                ++far;
              }
            }
      }
  EXPECT_GT(near, 1000);
  EXPECT_GT(far, 5000);
  EXPECT_LT(worst, 0.5 * cell); // what is relied on where the tree is not asked
}

} // namespace
