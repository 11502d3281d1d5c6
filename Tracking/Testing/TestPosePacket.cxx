// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Tracking/Devices/PosePacket.h"
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;

namespace {

PosePacket SomePacket(std::uint64_t seed, int poses)
{
  Random random(seed);
  PosePacket packet;
  packet.session = 0x0123456789abcdefull;
  packet.sequence = 41;
  packet.time = 1.7e9 + random.Uniform();
  for (int i = 0; i < poses; ++i) {
    ToolPose pose;
    pose.name = "Tool" + std::to_string(i) + "ToTracker";
    pose.pose.linear() = ExpRotation(3.0 * random.Uniform() * random.Direction());
    pose.pose.translation() = 500.0 * random.Uniform() * random.Direction();
    packet.poses.push_back(pose);
  }
  return packet;
}

std::string Decode(const std::vector<unsigned char>& bytes, PosePacket& packet)
{
  return DecodePosePacket(bytes.data(), bytes.size(), packet);
}

/// CRC-32 as it is defined, bit by bit.
std::uint32_t PlainCrc(const unsigned char* bytes, std::size_t count)
{
  std::uint32_t crc = 0xffffffffu;
  for (std::size_t i = 0; i < count; ++i) {
    crc ^= bytes[i];
    for (int bit = 0; bit < 8; ++bit)
      crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0);
  }
  return ~crc;
}

/// With the sum made right, so that what else is wrong is found.
std::vector<unsigned char> Summed(std::vector<unsigned char> bytes)
{
  const std::uint32_t crc = PlainCrc(bytes.data(), bytes.size() - 4);
  for (std::size_t i = 0; i < 4; ++i)
    bytes[bytes.size() - 4 + i] = static_cast<unsigned char>(crc >> (8 * i));
  return bytes;
}

TEST(PosePacket, ComesBackAsItWas)
{
  for (const bool doubles : {true, false})
    for (const int count : {1, 2, 12}) {
      PosePacket packet = SomePacket(static_cast<std::uint64_t>(count), count), back;
      packet.poses[0].status = TransformStatus::OutOfRange;
      if (count > 1)
        packet.poses[1].status = TransformStatus::Missing;
      ASSERT_EQ(Decode(EncodePosePacket(packet, doubles), back), "");
      EXPECT_EQ(back.session, packet.session);
      EXPECT_EQ(back.sequence, packet.sequence);
      EXPECT_EQ(back.time, packet.time);
      ASSERT_EQ(back.poses.size(), packet.poses.size());
      for (std::size_t i = 0; i < packet.poses.size(); ++i) {
        EXPECT_EQ(back.poses[i].name, packet.poses[i].name);
        EXPECT_EQ(back.poses[i].time, packet.time);
        EXPECT_EQ(back.poses[i].status, packet.poses[i].status);
        if (packet.poses[i].status != TransformStatus::Missing) {
          const Pose &a = back.poses[i].pose, &b = packet.poses[i].pose;
          EXPECT_LT((a.translation() - b.translation()).norm(), doubles ? 1e-300 : 5e-5);
          EXPECT_LT(RotationAngle(a.inverse() * b), doubles ? 1e-7 : 1e-6);
        }
      }
    }
}

// The layout is a promise to other programs: one packet, byte by byte.
TEST(PosePacket, TheLayoutAsItIsDocumented)
{
  PosePacket packet;
  packet.session = 0x0807060504030201ull;
  packet.sequence = 258;
  packet.time = 1.0;
  packet.poses.resize(1);
  packet.poses[0].name = "Probe";
  packet.poses[0].status = TransformStatus::OutOfRange;
  packet.poses[0].pose.translation() = Eigen::Vector3d(1.0, -2.0, 0.5);
  const std::vector<unsigned char> expected = {
      'E', 'P', 'P',  'K',  1,   0,   0,    0,                                // version 1, floats
      1,   2,   3,    4,    5,   6,   7,    8,    2, 1, 0, 0,    0, 0, 0, 0,  // session, sequence
      0,   0,   0,    0,    0,   0,   0xf0, 0x3f, 1, 0,                       // time 1.0, one pose
      5,   'P', 'r',  'o',  'b', 'e', 2,                                      // name, out of range
      0,   0,   0x80, 0x3f, 0,   0,   0,    0xc0, 0, 0, 0, 0x3f,              // 1, -2, 0.5
      0,   0,   0x80, 0x3f, 0,   0,   0,    0,    0, 0, 0, 0,    0, 0, 0, 0}; // 1, 0, 0, 0
  std::vector<unsigned char> bytes = EncodePosePacket(packet, false);
  ASSERT_EQ(bytes.size(), expected.size() + 4);
  EXPECT_TRUE(std::equal(expected.begin(), expected.end(), bytes.begin()));
  EXPECT_EQ(bytes, Summed(bytes)); // the sum, against its definition
}

TEST(PosePacket, EveryDamagedByteIsNoticed)
{
  const std::vector<unsigned char> good = EncodePosePacket(SomePacket(3, 2));
  PosePacket packet;
  for (std::size_t at = 0; at < good.size(); ++at)
    for (int value = 1; value < 256; ++value) {
      std::vector<unsigned char> bytes = good;
      bytes[at] = static_cast<unsigned char>(bytes[at] + value);
      EXPECT_NE(Decode(bytes, packet), "") << at;
    }
  for (std::size_t size = 0; size < good.size(); ++size)
    EXPECT_NE(DecodePosePacket(good.data(), size, packet), "") << size;
}

TEST(PosePacket, WhatIsWrongIsSaid)
{
  const std::vector<unsigned char> good = EncodePosePacket(SomePacket(4, 2)); // names of 14 bytes: poses begin at 34 and 106
  const auto expect = [](std::vector<unsigned char> bytes, const std::string& words) {
    PosePacket packet;
    const std::string complaint = Decode(bytes, packet);
    EXPECT_NE(complaint.find(words), std::string::npos) << "\"" << complaint << "\" lacks " << words;
  };
  const auto with = [&good](std::size_t at, std::vector<unsigned char> bytes) {
    std::vector<unsigned char> changed = good;
    std::copy(bytes.begin(), bytes.end(), changed.begin() + static_cast<std::ptrdiff_t>(at));
    return Summed(changed);
  };
  expect({}, "too short");
  expect(std::vector<unsigned char>(37, 'E'), "too short");
  expect(std::vector<unsigned char>(1401, 'E'), "too long");
  expect(with(0, {'I'}), "no pose packet");
  std::vector<unsigned char> unsummed = good;
  unsummed[40] ^= 1;
  expect(unsummed, "check sum");
  expect(with(4, {2}), "version 2");
  expect(with(6, {3}), "flags");
  expect(with(8, {0, 0, 0, 0, 0, 0, 0, 0}), "session is 0");
  expect(with(24, {0, 0, 0, 0, 0, 0, 0xf8, 0x7f}), "time is not finite");
  expect(with(32, {0, 0}), "holds 0 poses");
  expect(with(32, {33, 0}), "holds 33 poses");
  expect(with(32, {3, 0}), "middle of a pose");
  expect(with(32, {1, 0}), "left over");
  expect(with(34, {255}), "middle of a pose");
  expect(with(49, {3}), "status of 3");
  expect(with(50, {0, 0, 0, 0, 0, 0, 0xf0, 0x7f}), "is none");    // x infinite
  expect(with(74, {0, 0, 0, 0, 0, 0, 0xf8, 0x7f}), "is none");    // qw not a number
  expect(with(74, {0, 0, 0, 0, 0, 0, 0, 0x40}), "is none");       // qw 2
  expect(with(110 + 1, {'0'}), "two of its poses have one name"); // Tool1 becomes Tool0
  for (const unsigned char byte : {0x00, 0x0a, 0x1b, 0x7f, 0x80, 0xc3, 0xff})
    expect(with(110 + 1, {byte}), "printable");
  std::vector<unsigned char> nameless = good;
  nameless.erase(nameless.begin() + 35, nameless.begin() + 49);
  nameless[34] = 0;
  expect(Summed(nameless), "1 to 64 bytes");
}

TEST(PosePacket, RefusesToWriteWhatItWouldNotRead)
{
  const auto refused = [](const PosePacket& packet, const std::string& words) {
    try {
      EncodePosePacket(packet);
      ADD_FAILURE() << "written; expected: " << words;
    } catch (const Error& error) {
      EXPECT_EQ(error.GetKind(), Error::Kind::InvalidParameter);
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  PosePacket packet = SomePacket(1, 1);
  packet.session = 0;
  refused(packet, "session");
  refused(SomePacket(1, 0), "1 to 32 poses");
  refused(SomePacket(1, 33), "1 to 32 poses");
  refused(SomePacket(1, 32), "bytes");
  packet = SomePacket(1, 2);
  packet.poses[1].name = packet.poses[0].name;
  refused(packet, "one name");
  packet.poses[1].name = std::string(65, 'a');
  refused(packet, "1 to 64");
  packet.poses[1].name = "Probe\n";
  refused(packet, "printable");
  packet = SomePacket(1, 1);
  packet.time = std::numeric_limits<double>::quiet_NaN();
  refused(packet, "time");
  packet = SomePacket(1, 1);
  packet.poses[0].pose.linear() *= 1.5;
  refused(packet, "not rigid");
}

TEST(PosePacketOrder, KeepsOneSessionInRisingOrder)
{
  using Verdict = PosePacketOrder::Verdict;
  PosePacketOrder order(2.0);
  const auto judge = [&order](std::uint64_t session, std::uint64_t sequence, double arrival) {
    PosePacket packet;
    packet.session = session;
    packet.sequence = sequence;
    return order.Judge(packet, arrival);
  };
  EXPECT_EQ(judge(7, 0, 10.0), Verdict::New); // a sender may begin with 0
  EXPECT_EQ(judge(7, 0, 10.1), Verdict::Replayed);
  EXPECT_EQ(judge(7, 5, 10.2), Verdict::New);
  EXPECT_EQ(judge(7, 4, 10.3), Verdict::Replayed); // overtaken, or played back: too late in either case
  EXPECT_EQ(judge(8, 100, 10.4), Verdict::Foreign);
  EXPECT_EQ(judge(8, 101, 12.1), Verdict::Foreign); // foreign and old packets do not keep a session alive or end it
  EXPECT_EQ(judge(7, 6, 12.19), Verdict::New);
  EXPECT_EQ(judge(7, 6, 14.0), Verdict::Replayed);
  EXPECT_EQ(judge(8, 50, 14.2), Verdict::New); // 2 s of silence
  EXPECT_EQ(judge(7, 7, 14.3), Verdict::Foreign);
  EXPECT_EQ(judge(7, 8, 99.0), Verdict::Foreign); // what is over stays over
  EXPECT_EQ(judge(9, 1, 99.0), Verdict::New);
  EXPECT_EQ(judge(9, std::numeric_limits<std::uint64_t>::max(), 99.1), Verdict::New);
  EXPECT_EQ(judge(9, 2, 99.2), Verdict::Replayed);
}

} // namespace
