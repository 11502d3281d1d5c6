// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Parallel.h"
#include <atomic>
#include <gtest/gtest.h>
#include <mutex>
#include <set>
#include <thread>

namespace {

using namespace echorama;

TEST(Parallel, EveryItemOnceInRangesOfTheGrain)
{
  for (const std::ptrdiff_t count : {1, 9, 10, 11, 1000})
    for (const std::ptrdiff_t grain : {1, 10, 5000}) {
      std::vector<std::atomic<int>> visits(count);
      ParallelRanges(count, grain, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
        EXPECT_EQ(begin % grain, 0);
        EXPECT_EQ(end, std::min(count, begin + grain));
        for (std::ptrdiff_t i = begin; i < end; ++i)
          ++visits[static_cast<std::size_t>(i)];
      });
      for (const auto& v : visits)
        ASSERT_EQ(v, 1);
    }
}

TEST(Parallel, NothingToDo)
{
  int calls = 0;
  const auto body = [&calls](std::ptrdiff_t, std::ptrdiff_t) { ++calls; };
  ParallelRanges(0, 4, Progress(), body);
  ParallelRanges(-3, 4, Progress(), body);
  EXPECT_EQ(calls, 0);
  EXPECT_EQ(ParallelSum<int>(0, 4, [](std::ptrdiff_t, std::ptrdiff_t) { return 1; }), 0);
  EXPECT_EQ(ParallelSum<int>(-3, 4, [](std::ptrdiff_t, std::ptrdiff_t) { return 1; }), 0);
}

TEST(Parallel, AGrainOfZeroIsOne)
{
  EXPECT_EQ(ParallelSum<std::ptrdiff_t>(5, 0, [](std::ptrdiff_t begin, std::ptrdiff_t end) { return end - begin; }), 5);
}

TEST(Parallel, SumsDoNotDependOnTheThreads)
{
  // Numbers whose sum in doubles depends on the order of adding.
  const auto sum = [] {
    return ParallelSum<double>(100000, 97, [](std::ptrdiff_t begin, std::ptrdiff_t end) {
      double part = 0.0;
      for (std::ptrdiff_t i = begin; i < end; ++i)
        part += 1.0 / static_cast<double>(1 + i * i % 9973);
      return part;
    });
  };
  double one = 0.0;
  {
    const ThreadLimit limit(1);
    one = sum();
  }
  for (int repeat = 0; repeat < 5; ++repeat)
    EXPECT_EQ(sum(), one);
}

TEST(Parallel, ThreadLimitHolds)
{
  const auto threads = [] {
    std::mutex mutex;
    std::set<std::thread::id> ids;
    ParallelFor(200, [&](std::ptrdiff_t) {
      std::this_thread::sleep_for(std::chrono::microseconds(100));
      const std::lock_guard<std::mutex> lock(mutex);
      ids.insert(std::this_thread::get_id());
    });
    return ids.size();
  };
  {
    const ThreadLimit limit(1);
    EXPECT_EQ(threads(), 1u);
    const ThreadLimit inner(0); // no limit of its own; the outer one stays
    EXPECT_EQ(threads(), 1u);
  }
  EXPECT_THROW(ThreadLimit(-1), Error);
}

TEST(Parallel, ErrorsOfTheBodyReachTheCaller)
{
  try {
    ParallelFor(100, [](std::ptrdiff_t i) {
      if (i == 57)
        throw Error(Error::Kind::NotPossible, "item 57");
    });
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::NotPossible);
    EXPECT_STREQ(error.what(), "item 57");
  }
}

TEST(Parallel, ProgressComesFromTheCallingThreadAndGrows)
{
  const auto caller = std::this_thread::get_id();
  std::vector<double> seen;
  ParallelFor(1000, Progress([&](double fraction) {
                EXPECT_EQ(std::this_thread::get_id(), caller);
                seen.push_back(fraction);
                return true;
              }),
              [](std::ptrdiff_t) { std::this_thread::sleep_for(std::chrono::microseconds(10)); });
  ASSERT_GE(seen.size(), 3u);
  EXPECT_EQ(seen.front(), 0.0);
  EXPECT_EQ(seen.back(), 1.0);
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
}

TEST(Parallel, StopsOnRequest)
{
  std::atomic<int> done{0};
  try {
    ParallelFor(100000, Progress([](double fraction) { return fraction < 0.1; }), [&done](std::ptrdiff_t) { ++done; });
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::Cancelled);
  }
  EXPECT_LT(done, 100000);
}

TEST(Progress, PartsOfParts)
{
  std::vector<double> seen;
  const Progress progress([&seen](double fraction) {
    seen.push_back(fraction);
    return true;
  });
  const Progress part = progress.Part(0.5, 1.0), inner = part.Part(0.0, 0.5);
  part(0.0);
  part(1.0);
  inner(1.0);
  EXPECT_EQ(seen, (std::vector<double>{0.5, 1.0, 0.75}));
  EXPECT_NO_THROW(Progress().Part(0.2, 0.3)(0.5)) << "a default progress does nothing";
}

} // namespace
