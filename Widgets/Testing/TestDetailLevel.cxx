// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Widgets/Particles/DetailLevel.h"
#include <gtest/gtest.h>

namespace echorama {
namespace {

// A machine on which a frame of a level takes so long.
struct Machine {
  double full, step;
  double Frame(int level) const { return full / std::pow(step, level); }
};

TEST(DetailLevel, StaysFullOnAFastMachine)
{
  DetailLevel detail(0.1);
  detail.Begin(0.02);
  for (int frame = 0; frame < 20; ++frame) {
    EXPECT_EQ(detail.Level(), 0);
    detail.Measure(0.02);
  }
}

// Whatever a level really costs, soon no frame is too slow, the level no longer changes, and it is not much coarser than need be.
TEST(DetailLevel, FindsItsLevelAndStays)
{
  for (const double full : {0.05, 0.2, 1.0, 3.0, 10.0})
    for (const double step : {2.0, 3.0, 4.5})
      for (const double known : {0.0, 1.0, 0.1}) {
        const Machine machine{full, step};
        DetailLevel detail(0.1);
        detail.Begin(known * full);
        for (int frame = 0; frame < 40; ++frame)
          detail.Measure(machine.Frame(detail.Level()));
        const int level = detail.Level();
        EXPECT_TRUE(level == DetailLevel::Coarsest || machine.Frame(level) <= 0.1) << full << " " << step;
        EXPECT_TRUE(level == 0 || machine.Frame(level - 1) * 3.0 > 0.05) << full << " " << step;
        for (int frame = 0; frame < 40; ++frame) {
          detail.Measure(machine.Frame(detail.Level()));
          EXPECT_EQ(detail.Level(), level);
        }
      }
}

TEST(DetailLevel, OneSlowFrameIsForgottenByTheNextDrag)
{
  DetailLevel detail(0.1);
  detail.Begin(0.02);
  EXPECT_TRUE(detail.Measure(0.5));
  EXPECT_GT(detail.Level(), 0);
  detail.Begin(0.02);
  EXPECT_EQ(detail.Level(), 0);
  detail.Begin(1e9);
  EXPECT_EQ(detail.Level(), DetailLevel::Coarsest);
}

TEST(DetailLevel, DoesNotFlicker)
{
  DetailLevel detail(0.1);
  Random random(3);
  const Machine machine{0.5, 3.0};
  detail.Begin(0.5);
  int changes = 0;
  for (int frame = 0; frame < 300; ++frame)
    changes += detail.Measure(machine.Frame(detail.Level()) * (0.7 + 0.6 * random.Uniform()));
  EXPECT_LE(changes, 3);
}

} // namespace
} // namespace echorama
