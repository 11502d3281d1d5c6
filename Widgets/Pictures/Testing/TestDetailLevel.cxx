// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Widgets/Pictures/DetailLevel.h"
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

// After a drag each step draws the next finer level, down to the full picture.
TEST(FrameDetail, RefinesStepByStep)
{
  const Machine machine{1.0, 3.0};
  FrameDetail detail;
  EXPECT_TRUE(detail.Full());
  EXPECT_FALSE(detail.SetInteractive(false, 1.0));
  EXPECT_TRUE(detail.SetInteractive(true, machine.full));
  EXPECT_TRUE(detail.Dragging() && detail.Level() > 1);
  detail.restSeconds = 1.5;
  for (int level = detail.Level(); level > 0; --level) {
    detail.Measure(0.01, machine.Frame(level), true);
    ASSERT_TRUE(detail.Refine(0.0));
    EXPECT_EQ(detail.Level(), level - 1);
    EXPECT_FALSE(detail.Dragging());
    EXPECT_EQ(detail.Full(), level == 1);
  }
  EXPECT_FALSE(detail.Refine(0.0));
  EXPECT_TRUE(detail.SetInteractive(true, machine.full)); // anew
  EXPECT_GT(detail.Level(), 1);
}

// Steps are for pictures that a person would wait for: one that is known to be quick comes at once, whatever was between.
TEST(FrameDetail, RefinesAtOnceWhatIsKnownToBeQuick)
{
  FrameDetail detail;
  detail.SetBudget(0.01);
  for (const double full : {FrameDetail::AtOnceSeconds, 1.01 * FrameDetail::AtOnceSeconds}) {
    detail.SetInteractive(true, full);
    const int level = detail.Level();
    ASSERT_GT(level, 1);
    detail.Measure(0.005, 0.005, true);
    ASSERT_TRUE(detail.Refine(full));
    EXPECT_EQ(detail.Level(), full > FrameDetail::AtOnceSeconds ? level - 1 : 0);
    detail.SetInteractive(false, full);
  }
}

// A step is taken when going by the last one, or by what the full picture took, it will not take too long.
TEST(FrameDetail, RefinesNoFurtherThanTheTimeAllows)
{
  FrameDetail detail;
  detail.SetInteractive(true, 10.0);
  const int first = detail.Level();
  detail.Measure(0.1, 0.1, true);
  detail.restSeconds = 0.29; // of the first step three times as much is expected
  EXPECT_FALSE(detail.Refine(0.0));
  EXPECT_EQ(detail.Level(), first);
  detail.restSeconds = 0.31;
  ASSERT_TRUE(detail.Refine(0.0));
  detail.Measure(0.2, 0.2, true);
  detail.restSeconds = 0.39; // it took twice as much: the next one will, too
  EXPECT_FALSE(detail.Refine(0.0));
  detail.restSeconds = 0.41;
  ASSERT_TRUE(detail.Refine(0.0));
  while (detail.Level() > 1) {
    detail.Measure(0.01, 0.01, true);
    ASSERT_TRUE(detail.Refine(0.0));
  }
  detail.Measure(0.01, 0.01, true);
  EXPECT_FALSE(detail.Refine(0.5)); // what the full picture took is known
  EXPECT_TRUE(detail.Refine(0.4));
}

// Only typical frames of the drag decide on its level.
TEST(FrameDetail, MeasuresTheDragAlone)
{
  FrameDetail detail;
  EXPECT_FALSE(detail.Measure(9.0, 9.0, true));
  detail.SetInteractive(true, 0.0);
  EXPECT_EQ(detail.Level(), 0);
  EXPECT_FALSE(detail.Measure(9.0, 9.0, false));
  EXPECT_EQ(detail.Level(), 0);
  EXPECT_TRUE(detail.Measure(9.0, 9.0, true));
  const int coarse = detail.Level();
  EXPECT_GT(coarse, 0);
  detail.Stay();
  EXPECT_FALSE(detail.Dragging());
  EXPECT_FALSE(detail.Measure(9.0, 9.0, true));
  EXPECT_EQ(detail.Level(), coarse);
}

} // namespace
} // namespace echorama
