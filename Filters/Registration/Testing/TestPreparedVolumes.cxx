// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Filters/Registration/Metric.h"
#include "Filters/Registration/PreparedVolumes.h"
#include <algorithm>
#include <array>
#include <atomic>
#include <gtest/gtest.h>
#include <map>

namespace echorama {
namespace {

using Pairs = std::vector<std::pair<int, int>>;

// A volume of so many bytes.
PreparedVolumes::Made OfSize(double bytes)
{
  auto made = std::make_shared<AlignableVolume>();
  auto features = std::make_shared<MetricPyramid>();
  features->levels.emplace_back();
  features->levels.front().descriptors.resize(static_cast<std::size_t>(bytes));
  made->features = features;
  return made;
}

TEST(PreparedVolumes, TheLeastRecentlyUsedGoesFirst)
{
  std::vector<int> made;
  PreparedVolumes volumes(3500.0, [&made](int v, const Progress&) {
    made.push_back(v);
    return OfSize(1000.0);
  });
  for (const int v : {0, 1, 2, 0, 3, 1})
    volumes.Get(v);
  EXPECT_EQ(made, (std::vector<int>{0, 1, 2, 3, 1})); // 3 replaced 1, 1 replaced 2
  volumes.Get(0);
  volumes.Get(3);
  EXPECT_EQ(made.size(), 5u);
  volumes.Get(2);
  EXPECT_EQ(volumes.TimesMade(), 6);
  EXPECT_EQ(volumes.PeakBytes(), 3000.0);
  EXPECT_EQ(volumes.LargestBytes(), 1000.0);
  EXPECT_TRUE(volumes.HasRoomFor({2, 3})); // they are kept
  EXPECT_FALSE(volumes.HasRoomFor({2, 4}));
}

TEST(PreparedVolumes, ALargeOneTakesThePlaceOfSeveral)
{
  PreparedVolumes volumes(3500.0, [](int v, const Progress&) { return OfSize(v == 9 ? 2000.0 : 1000.0); });
  volumes.Get(0);
  volumes.Get(1);
  EXPECT_TRUE(volumes.HasRoomFor({1, 2}));
  EXPECT_FALSE(volumes.HasRoomFor({2, 3}));
  volumes.Get(2);
  volumes.Get(9);
  volumes.Get(2);
  volumes.Get(9);
  EXPECT_EQ(volumes.TimesMade(), 4);
  EXPECT_EQ(volumes.PeakBytes(), 3000.0);
  volumes.Get(1);
  EXPECT_EQ(volumes.TimesMade(), 5);
}

TEST(PreparedVolumes, AreMadeAheadWhereThereIsRoom)
{
  std::array<std::atomic<int>, 6> times{};
  PreparedVolumes volumes(4500.0, [&times](int v, const Progress&) {
    ++times[static_cast<std::size_t>(v)];
    if (v == 2)
      throw Error(Error::Kind::BadInput, "volume 2 is empty");
    return OfSize(1000.0);
  });
  const auto timesMade = [&times] { return std::vector<int>(times.begin(), times.end()); };
  volumes.Get(1);
  volumes.MakeAhead({0, 1, 2, 3}); // 2 cannot be made, which is not asked here
  EXPECT_EQ(timesMade(), (std::vector<int>{1, 1, 1, 1, 0, 0}));
  EXPECT_EQ(volumes.TimesMade(), 3);
  for (const int v : {0, 1, 3})
    volumes.Get(v);
  EXPECT_EQ(volumes.TimesMade(), 3);
  EXPECT_THROW(volumes.Get(2), Error);
  volumes.MakeAhead({4, 5}); // no room for both
  EXPECT_EQ(timesMade(), (std::vector<int>{1, 1, 2, 1, 0, 0}));
  EXPECT_THROW(volumes.MakeAhead({3, 4}, Progress([](double) { return false; })), Error);
}

TEST(PreparedVolumes, TwoAreKeptWhateverTheBudget)
{
  PreparedVolumes volumes(1.0, [](int, const Progress&) { return OfSize(1000.0); });
  const auto first = volumes.Get(0);
  EXPECT_EQ(volumes.Get(0), first);
  volumes.Get(1);
  EXPECT_EQ(volumes.Get(0), first);
  volumes.Get(1);
  EXPECT_EQ(volumes.TimesMade(), 2);
  volumes.Get(2);
  volumes.Get(1);
  EXPECT_EQ(volumes.TimesMade(), 3);
  EXPECT_EQ(volumes.PeakBytes(), 2000.0);
}

// A field of 20 x 20 volumes with numbers at random, each overlapping the eight around it.
Pairs Field()
{
  constexpr int side = 20;
  std::vector<int> numbers(side * side);
  for (int i = 0; i < side * side; ++i)
    numbers[static_cast<std::size_t>(i)] = i;
  Random random(4);
  for (std::size_t i = numbers.size() - 1; i > 0; --i)
    std::swap(numbers[i], numbers[random.Below(static_cast<std::uint32_t>(i + 1))]);
  Pairs pairs;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      for (const auto& [dx, dy] : Pairs{{1, 0}, {-1, 1}, {0, 1}, {1, 1}})
        if (x + dx >= 0 && x + dx < side && y + dy < side)
          pairs.push_back(std::minmax(numbers[static_cast<std::size_t>(y * side + x)],
                                      numbers[static_cast<std::size_t>((y + dy) * side + x + dx)]));
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

TEST(PreparedVolumes, PairsInGoodOrderMakeFewVolumesTwice)
{
  const Pairs pairs = Field();
  Pairs ordered = OrderedForReuse(pairs);
  EXPECT_EQ(TimesMade(ordered, 400), 400);
  EXPECT_EQ(TimesMade(ordered, 80), 400); // two of the corners around a corner, of at most 39 each
  EXPECT_GT(TimesMade(pairs, 80), 1000);  // in the order of their numbers
  EXPECT_LT(TimesMade(ordered, 20), 3 * TimesMade(pairs, 20) / 4);
  Pairs reversed = pairs;
  std::reverse(reversed.begin(), reversed.end());
  EXPECT_EQ(OrderedForReuse(reversed), ordered);
  std::sort(ordered.begin(), ordered.end());
  EXPECT_EQ(ordered, pairs);
}

TEST(PreparedVolumes, PartsThatDoNotMeetFollowEachOther)
{
  const Pairs pairs{{0, 9}, {1, 2}, {4, 9}, {2, 7}, {0, 4}, {7, 1}};
  const Pairs ordered = OrderedForReuse(pairs);
  EXPECT_EQ(TimesMade(ordered, 3), 6);
  EXPECT_TRUE(OrderedForReuse({}).empty());
  EXPECT_EQ(TimesMade({}, 2), 0);
}

TEST(PreparedVolumes, TimesMadeIsWhatHappens)
{
  const Pairs pairs = OrderedForReuse(Field());
  for (const int kept : {2, 5, 21, 60}) {
    PreparedVolumes volumes(1000.0 * kept, [](int, const Progress&) { return OfSize(1000.0); });
    for (const auto& [a, b] : pairs) {
      volumes.Get(a);
      volumes.Get(b);
    }
    EXPECT_EQ(volumes.TimesMade(), TimesMade(pairs, kept)) << kept;
  }
}

} // namespace
} // namespace echorama
