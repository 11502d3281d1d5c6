// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Stitching/Benchmarks/MembraneDescent.h"
#include <cmath>
#include <gtest/gtest.h>

using namespace echorama;

namespace {

// A disc of which one side is 0, the other 1, with a hole that is nothing.
struct Disc {
  static constexpr int size = 64;
  RowField<unsigned char> kinds;
  RowField<float> values;

  Disc()
  {
    const auto spans = std::make_shared<const RowSpans>(GridBox{{3, -2, 5}, {size, size, 1}}, std::vector<int>(size, 3),
                                                        std::vector<int>(size, 3 + size));
    kinds = RowField<unsigned char>(spans);
    values = RowField<float>(spans);
    for (int j = 0; j < size; ++j)
      for (int i = 0; i < size; ++i) {
        const double radius = std::hypot(i - 31.5, j - 31.5);
        const bool there = radius < 31.0 && std::hypot(i - 38.0, j - 25.0) > 6.0;
        const auto at = static_cast<std::size_t>(j * size + i);
        kinds.values[at] = static_cast<unsigned char>(!there          ? MembraneVoxel::Void
                                                      : radius > 29.0 ? MembraneVoxel::Known
                                                                      : MembraneVoxel::Unknown);
        values.values[at] = there && radius > 29.0 && i > 31 ? 1.0f : 0.0f;
      }
  }
};

TEST(MembraneDescent, ComesNear)
{
  MembraneParameters sharp;
  sharp.tolerance = 1e-6;
  Disc exact;
  SolveMembrane(exact.kinds, {1.0, 2.0, 1.0}, exact.values, 0.5f, sharp);
  for (const int levels : {1, 4, 6}) {
    DescentParameters parameters;
    parameters.levels = levels;
    parameters.stop = 1e-7;
    parameters.trace = true;
    Disc disc;
    const DescentReport report = DescendMembrane(disc.kinds, {1.0, 2.0, 1.0}, disc.values, parameters);
    float error = 0.0f;
    for (std::size_t at = 0; at < disc.values.values.size(); ++at)
      error = std::max(error, std::abs(disc.values.values[at] - exact.values.values[at]));
    EXPECT_LT(error, 0.03f) << levels;
    ASSERT_EQ(report.trace.size(), static_cast<std::size_t>(report.steps));
    EXPECT_GE(report.trace.front().level, std::min(levels - 1, 3)); // coarser ones may have nothing to do
    EXPECT_EQ(report.trace.back().level, 0);
    for (std::size_t n = 1; n < report.trace.size(); ++n) // within a level the energy falls
      if (report.trace[n].level == report.trace[n - 1].level) {
        EXPECT_LE(report.trace[n].energy, report.trace[n - 1].energy);
      }
  }
}

TEST(MembraneDescent, ChecksItsParameters)
{
  Disc disc;
  DescentParameters parameters;
  parameters.levels = 9;
  EXPECT_THROW(DescendMembrane(disc.kinds, Eigen::Vector3d::Ones(), disc.values, parameters), Error);
  parameters = {};
  parameters.stop = 0.0;
  EXPECT_THROW(DescendMembrane(disc.kinds, Eigen::Vector3d::Ones(), disc.values, parameters), Error);
}

} // namespace
