// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Sharing/IsolatedTask.h"
#include "Testing/Sanitized.h"
#include <chrono>
#include <cstdlib>
#include <gtest/gtest.h>
#include <memory>

using namespace echorama;

namespace {

bool Hang()
{
  for (volatile unsigned i = 0;; i = i + 1) // it wraps around, where an int would be stopped by the sanitizers
    ;
}

} // namespace

TEST(IsolatedTask, SaysWhatTheTaskSays)
{
  EXPECT_EQ(RunIsolated([] { return true; }, {}), TaskOutcome::Succeeded);
  EXPECT_EQ(RunIsolated([] { return false; }, {}), TaskOutcome::Failed);
  EXPECT_EQ(RunIsolated([]() -> bool { throw 3; }, {}), TaskOutcome::Failed);
}

TEST(IsolatedTask, ACrashAndAnExitStayInTheOtherProcess)
{
  EXPECT_EQ(RunIsolated([]() -> bool { std::abort(); }, {}), TaskOutcome::Failed);
  EXPECT_EQ(RunIsolated([]() -> bool { std::_Exit(5); }, {}), TaskOutcome::Failed);
  int changed = 0;
  RunIsolated([&] { return ++changed > 0; }, {});
  EXPECT_EQ(changed, 0);
}

TEST(IsolatedTask, ATaskThatHangsIsEnded)
{
  EXPECT_EQ(RunIsolated(Hang, {1.0, 1 << 20}), TaskOutcome::TimedOut);
}

TEST(IsolatedTask, MemoryIsLimited)
{
  if (IsSanitized())
    GTEST_SKIP() << "the sanitizers' allocator has all the memory that it may ever use from the start";
  const auto takes = [](std::size_t bytes) {
    return [bytes] {
      const std::unique_ptr<char[]> memory(new char[bytes]);
      volatile char* const last = memory.get() + bytes - 1;
      *last = 1;
      return *last == 1;
    };
  };
  EXPECT_EQ(RunIsolated(takes(200 << 20), {60.0, 300 << 20}), TaskOutcome::Succeeded);
  EXPECT_EQ(RunIsolated(takes(400 << 20), {60.0, 300 << 20}), TaskOutcome::Failed);
}

TEST(IsolatedTask, CanBeCancelled)
{
  int asked = 0;
  const Progress stop([&](double fraction) {
    EXPECT_EQ(fraction, 0.25);
    return ++asked < 3;
  });
  try {
    RunIsolated(Hang, {1000.0, 1 << 20}, stop, 0.25);
    FAIL() << "it went on";
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::Cancelled);
  }
  EXPECT_EQ(asked, 3);
}
