// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Parallel.h"
#include "Core/Sharing/SideBySide.h"
#include <atomic>
#include <cmath>
#include <gtest/gtest.h>
#include <string>
#include <thread>
#include <vector>

namespace echorama {
namespace {

// Some milliseconds of work, with parallel loops.
double Work(int item)
{
  double sum = 0.0;
  for (int turn = 0; turn < 20; ++turn)
    sum += ParallelSum<double>(20000, 1000, [item](std::ptrdiff_t begin, std::ptrdiff_t end) {
      double part = 0.0;
      for (std::ptrdiff_t i = begin; i < end; ++i)
        part += std::sin(static_cast<double>(i + item));
      return part;
    });
  return sum;
}

TEST(SideBySide, EachTaskIsDoneOnceAndFindsWhatItFindsAlone)
{
  constexpr int count = 37;
  std::vector<double> found(count);
  std::vector<std::atomic<int>> times(count);
  SideBySide(count, {}, [&](std::ptrdiff_t task, const Progress&) {
    found[static_cast<std::size_t>(task)] = Work(static_cast<int>(task));
    ++times[static_cast<std::size_t>(task)];
  });
  for (int i = 0; i < count; ++i) {
    EXPECT_EQ(times[static_cast<std::size_t>(i)], 1);
    EXPECT_EQ(found[static_cast<std::size_t>(i)], Work(i));
  }
  SideBySide(0, {}, [](std::ptrdiff_t, const Progress&) { FAIL(); });
}

TEST(SideBySide, ProgressRisesOnTheCallingThreadAlone)
{
  const auto caller = std::this_thread::get_id();
  std::vector<double> told;
  const Progress progress([&](double fraction) {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    told.push_back(fraction);
    return true;
  });
  SideBySide(16, progress.Part(0.5, 1.0), [](std::ptrdiff_t task, const Progress& part) {
    for (int turn = 0; turn <= 10; ++turn) {
      Work(static_cast<int>(task));
      part(turn / 10.0);
    }
  });
  ASSERT_GT(told.size(), 11u);
  for (std::size_t i = 1; i < told.size(); ++i)
    EXPECT_GE(told[i], told[i - 1]);
  EXPECT_GE(told.front(), 0.5);
  EXPECT_LE(told.back(), 1.0);
}

TEST(SideBySide, TheFirstFailureReachesTheCallerAndEndsTheOthers)
{
  for (int trial = 0; trial < 5; ++trial) {
    std::atomic<int> begun{0}, ended{0};
    std::string message;
    try {
      SideBySide(1000, {}, [&](std::ptrdiff_t, const Progress& part) {
        if (++begun == 3)
          throw Error(Error::Kind::BadFile, "the third");
        for (int turn = 0; turn < 20; ++turn) {
          Work(turn);
          part(turn / 20.0);
        }
        ++ended;
      });
    } catch (const Error& error) {
      message = error.what();
    }
    EXPECT_EQ(message, "the third");
    EXPECT_LT(begun, 3 + 2 * TasksAtOnce()); // those that were under way
    EXPECT_LE(ended, 2);
  }
}

TEST(SideBySide, WhoeverWatchesCanStopIt)
{
  const std::ptrdiff_t count = 50 * TasksAtOnce(); // far more than are under way at once, on any machine
  std::atomic<std::ptrdiff_t> ended{0};
  const Progress progress([](double fraction) { return fraction < 0.2; });
  try {
    SideBySide(count, progress, [&](std::ptrdiff_t task, const Progress& part) {
      Work(static_cast<int>(task));
      part(1.0);
      ++ended;
    });
    FAIL() << "it was not stopped";
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::Cancelled);
  }
  EXPECT_LT(ended, count / 2);
}

} // namespace
} // namespace echorama
