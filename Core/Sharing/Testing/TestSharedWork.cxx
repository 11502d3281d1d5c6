// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Sharing/ShareOut.h"
#include "Testing/ThreadRanks.h"
#include <atomic>
#include <gtest/gtest.h>
#include <limits>
#include <new>

namespace echorama {

struct Square {
  int value = 0;
  std::string text;
};

void Pack(Packed& to, const Square& square)
{
  to(square.value, square.text);
}

void Unpack(Unpacked& from, Square& square)
{
  from(square.value, square.text);
}

namespace {

TEST(SharedWork, EveryRankHearsWhatEachSays)
{
  for (const int ranks : {1, 2, 3, 8})
    for (const std::int64_t mostBytes : {1, 7, 1 << 20}) { // in pieces, too
      std::vector<std::vector<std::string>> heard(static_cast<std::size_t>(ranks));
      const auto errors = ThreadRanks(ranks).Run(
          [&](SharedWork& shared) {
            // The longer the higher the rank; the first says nothing. Bytes may be any.
            std::string mine(static_cast<std::size_t>(5 * shared.Rank()), static_cast<char>(shared.Rank()));
            heard[static_cast<std::size_t>(shared.Rank())] = shared.Exchange(mine + (shared.Rank() > 0 ? "\n" : ""));
          },
          mostBytes);
      for (std::size_t rank = 0; rank < heard.size(); ++rank) {
        EXPECT_EQ(errors[rank], "");
        ASSERT_EQ(heard[rank].size(), heard.size());
        for (std::size_t other = 0; other < heard.size(); ++other)
          EXPECT_EQ(heard[rank][other], std::string(5 * other, static_cast<char>(other)) + (other > 0 ? "\n" : ""));
      }
    }
}

TEST(SharedWork, AnErrorOfOneRankEndsAllWithItsMessage)
{
  // Before, between and after the exchanges of the others.
  for (const int at : {0, 1, 2}) {
    std::atomic<int> after{0};
    const auto errors = ThreadRanks(3).Run([&](SharedWork& shared) {
      for (int exchange = 0; exchange < 2; ++exchange) {
        if (shared.Rank() == 1 && exchange == at)
          throw Error(Error::Kind::FileSystem, "the disk is full");
        shared.Exchange("x");
      }
      if (shared.Rank() == 1 && at == 2)
        throw Error(Error::Kind::FileSystem, "the disk is full");
      ++after;
    });
    for (const std::string& error : errors)
      EXPECT_EQ(error, "rank 1: the disk is full");
    EXPECT_EQ(after, at == 2 ? 2 : 0);
  }
}

TEST(SharedWork, WhatAllSayIsSaidOnceAndOtherErrorsAreHeardToo)
{
  auto errors = ThreadRanks(2).Run([](SharedWork&) { throw Error(Error::Kind::InvalidParameter, "Points is 0"); });
  EXPECT_EQ(errors, std::vector<std::string>(2, "Points is 0"));
  errors = ThreadRanks(2).Run([](SharedWork& shared) {
    if (shared.Rank() == 0)
      throw std::bad_alloc();
  });
  EXPECT_EQ(errors, std::vector<std::string>(2, "rank 0: there is not enough memory for the result"));
  errors = ThreadRanks(2).Run([](SharedWork& shared) {
    if (shared.Rank() == 1)
      throw std::runtime_error("two\nlines");
  });
  EXPECT_EQ(errors, std::vector<std::string>(2, "rank 1: two lines"));
}

TEST(SharedWork, StoppingOneStopsAll)
{
  std::atomic<int> cancelled{0};
  ThreadRanks(3).Run([&](SharedWork& shared) {
    try {
      if (shared.Rank() == 0)
        throw Error(Error::Kind::Cancelled, "stopped on request");
      shared.Exchange("x");
    } catch (const Error& error) {
      cancelled += error.GetKind() == Error::Kind::Cancelled;
      throw;
    }
  });
  EXPECT_EQ(cancelled, 3);
}

TEST(SharedWork, RanksThatAreNotAboutTheSameAreRefused)
{
  const auto errors =
      ThreadRanks(2).Run([](SharedWork& shared) { shared.Exchange("x", shared.Rank() == 0 ? "3 volumes" : "4 volumes"); });
  for (const std::string& error : errors)
    EXPECT_NE(error.find("3 volumes, 4 volumes"), std::string::npos) << error;
}

TEST(SharedWork, AfterAFailureTheNextRunWorks)
{
  const auto errors = ThreadRanks(2).Run([](SharedWork& shared) {
    EXPECT_THROW(shared.Run([&] {
      if (shared.Rank() == 1)
        throw Error(Error::Kind::BadInput, "no");
    }),
                 Error);
    shared.Run([&] { EXPECT_EQ(shared.Exchange("y").size(), 2u); });
  });
  EXPECT_EQ(errors, std::vector<std::string>(2));
}

TEST(SharedWork, AloneItThrowsWhatIsThrown)
{
  SharedWork alone;
  EXPECT_THROW(alone.Run([] { throw std::bad_alloc(); }), std::bad_alloc);
  EXPECT_EQ(alone.Exchange("mine"), std::vector<std::string>{"mine"});
  EXPECT_EQ(alone.Told().messages, 0);
}

TEST(SharedWork, SharesFollowEachOtherAndAreAlike)
{
  const auto errors = ThreadRanks(3).Run([](SharedWork& shared) {
    for (const std::ptrdiff_t count : {0, 1, 2, 3, 7, 100}) {
      std::ptrdiff_t next = 0;
      for (int rank = 0; rank < 3; ++rank) {
        const auto [first, last] = shared.ShareOf(rank, count);
        EXPECT_EQ(first, next);
        EXPECT_LE(std::abs(3 * (last - first) - count), 2);
        next = last;
      }
      EXPECT_EQ(next, count);
    }
  });
}

TEST(SharedWork, ItemsAreSharedOutAndFoundOnce)
{
  for (const int ranks : {1, 2, 5})
    for (const std::size_t count : {0, 1, 4, 11, 23}) {
      std::atomic<int> found{0}, heard{0};
      const auto errors = ThreadRanks(ranks).Run([&](SharedWork& shared) {
        const auto all = ShareOut<Square>(
            shared, count, 4, "squares",
            [&](std::size_t first, std::size_t most, double begin, double end) {
              EXPECT_LT(begin, end);
              EXPECT_LE(end, 1.0);
              EXPECT_LE(most, 4u);
              std::vector<Square> some;
              for (std::size_t i = first; i < first + std::min<std::size_t>(most, 3); ++i, ++found)
                some.push_back({static_cast<int>(i * i), std::string(i, 'a')});
              return some;
            },
            [&](std::size_t i, const Square& square) { heard += square.value == static_cast<int>(i * i); });
        ASSERT_EQ(all.size(), count);
        for (std::size_t i = 0; i < count; ++i) {
          EXPECT_EQ(all[i].value, static_cast<int>(i * i));
          EXPECT_EQ(all[i].text, std::string(i, 'a'));
        }
      });
      EXPECT_EQ(errors, std::vector<std::string>(static_cast<std::size_t>(ranks)));
      EXPECT_EQ(found, static_cast<int>(count));
      EXPECT_EQ(heard, static_cast<int>(count) * ranks);
    }
}

TEST(SharedWork, BytesAndMessagesAreCounted)
{
  const auto errors = ThreadRanks(4).Run([](SharedWork& shared) {
    shared.Exchange(std::string(static_cast<std::size_t>(10 * shared.Rank()), 'x'), "12");
    // To each of three others: a length, and a line "w12" with what follows it.
    EXPECT_EQ(shared.Told().exchanges, 1);
    EXPECT_EQ(shared.Told().messages, 6);
    EXPECT_EQ(shared.Told().bytesSent, 3 * (8 + 4 + 10 * shared.Rank()));
    EXPECT_EQ(shared.Told().bytesReceived, 3 * (8 + 4) + 60 - 10 * shared.Rank());
  });
  EXPECT_EQ(errors, std::vector<std::string>(4));
}

TEST(Packing, GivesBackEveryBit)
{
  ImageGeometry geometry;
  geometry.dimensions = {2, 3, 4};
  geometry.origin = {0.1, -0.0, std::numeric_limits<double>::denorm_min()};
  geometry.direction = ExpRotation({0.1, 0.2, 0.3});
  Volume<float> volume({2, 1, 1}, std::numeric_limits<float>::quiet_NaN());
  volume.View()[1] = 1.0f / 3.0f;
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(1.0 / 3.0, 2.0, std::numeric_limits<double>::infinity());
  Packed packed;
  packed(true, Error::Kind::TooLarge, std::string("a\0b", 3), geometry, volume, pose, std::int64_t{-5});
  bool flag = false;
  auto kind = Error::Kind::BadFile;
  std::string text;
  ImageGeometry geometryBack;
  Volume<float> volumeBack;
  Pose poseBack;
  std::int64_t number = 0;
  Unpacked unpacked(packed.Bytes());
  unpacked(flag, kind, text, geometryBack, volumeBack, poseBack, number);
  EXPECT_TRUE(unpacked.AtEnd());
  EXPECT_TRUE(flag);
  EXPECT_EQ(kind, Error::Kind::TooLarge);
  EXPECT_EQ(text, std::string("a\0b", 3));
  EXPECT_EQ(number, -5);
  EXPECT_EQ(volumeBack.Dimensions(), volume.Dimensions());
  Packed again; // NaN and -0 too
  again(flag, kind, text, geometryBack, volumeBack, poseBack, number);
  EXPECT_EQ(again.Bytes(), packed.Bytes());

  const std::string cut = packed.Bytes().substr(0, packed.Bytes().size() - 1);
  Unpacked shorter(cut);
  EXPECT_THROW(shorter(flag, kind, text, geometryBack, volumeBack, poseBack, number), Error);
  Packed longText;
  longText(~std::size_t{0});
  Unpacked damaged(longText.Bytes());
  EXPECT_THROW(damaged(text), Error);
}

} // namespace
} // namespace echorama
