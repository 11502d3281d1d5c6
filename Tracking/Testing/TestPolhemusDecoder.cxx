// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "PolhemusEmulator.h"
#include "Tracking/Devices/DeviceClock.h"
#include "Tracking/Devices/PolhemusDecoder.h"
#include <cstdio>
#include <gtest/gtest.h>
#include <map>

using namespace echorama;

namespace {

std::vector<PolhemusRecord> Decode(PolhemusDecoder& decoder, const std::string& bytes)
{
  return decoder.Take(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
}

double DegreesBetween(const Pose& a, const Pose& b)
{
  return RotationAngle(a.inverse() * b) * DegreesPerRadian;
}

PolhemusSpeech Speech(PolhemusFormat format, const PolhemusLayout& layout, PolhemusModel model = PolhemusModel::Patriot)
{
  PolhemusSpeech speech;
  speech.model = model;
  speech.format = format;
  speech.layout = layout;
  return speech;
}

std::vector<PolhemusSpeech> AllSpeeches()
{
  std::vector<PolhemusSpeech> all;
  for (const PolhemusModel model : {PolhemusModel::Patriot, PolhemusModel::Liberty})
    for (const PolhemusFormat format : {PolhemusFormat::Binary, PolhemusFormat::Ascii})
      for (const PolhemusLayout& layout :
           {PolhemusTwofold(true), PolhemusTwofold(false), PolhemusSingle(true), PolhemusSingle(false), PolhemusBare()})
        all.push_back(Speech(format, layout, model));
  return all;
}

EmulatedMoment MomentOf(std::uint32_t frame, double rate = 60.0)
{
  EmulatedMoment moment;
  moment.frame = frame;
  moment.milliseconds = 1000 + static_cast<std::uint32_t>(std::lround(frame * 1000.0 / rate));
  return moment;
}

std::string Frame(const PolhemusSpeech& speech, std::uint32_t frame)
{
  const EmulatedMoment moment = MomentOf(frame);
  std::string bytes;
  for (int station = 1; station <= 2; ++station)
    bytes += EncodePolhemus(speech, station, EmulatedPose(station, moment.milliseconds), moment);
  return bytes;
}

TEST(PolhemusDecoder, EveryLayoutInPiecesOfEverySize)
{
  for (const PolhemusSpeech& speech : AllSpeeches()) {
    std::string bytes;
    for (std::uint32_t frame = 0; frame < 40; ++frame)
      bytes += Frame(speech, frame);
    for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, std::size_t{64}, bytes.size()}) {
      PolhemusDecoder decoder(speech);
      std::vector<PolhemusRecord> records;
      for (std::size_t at = 0; at < bytes.size(); at += piece)
        for (const PolhemusRecord& record : Decode(decoder, bytes.substr(at, piece)))
          records.push_back(record);
      ASSERT_EQ(records.size(), 80u) << decoder.LastComplaint();
      EXPECT_EQ(decoder.Malformed(), 0u);
      for (std::uint32_t i = 0; i < 80; ++i) {
        const EmulatedMoment moment = MomentOf(i / 2);
        EXPECT_EQ(records[i].station, static_cast<int>(i % 2) + 1);
        EXPECT_EQ(records[i].status, TransformStatus::Valid);
        const Pose truth = EmulatedPose(records[i].station, moment.milliseconds);
        EXPECT_LT((records[i].pose.translation() - truth.translation()).norm(), 1e-3); // text has 7 digits, cm
        EXPECT_LT(DegreesBetween(records[i].pose, truth), 1e-3);                       // text has 5 decimals
        EXPECT_EQ(records[i].milliseconds.value_or(moment.milliseconds), moment.milliseconds);
      }
    }
  }
}

// The bytes of one record, put down by hand from the published layouts: the emulator could share a mistake with the decoder.
TEST(PolhemusDecoder, ARecordPutDownByHand)
{
  PolhemusSpeech speech = Speech(PolhemusFormat::Binary, PolhemusBare());
  const unsigned char binary[] = {'P',  'A',  2,    'C',  0,    0,    30,   0,             // header, 30 bytes follow
                                  0x00, 0x00, 0x20, 0x41, 0x00, 0x00, 0xa0, 0xc0,          // 10, -5
                                  0x00, 0x00, 0x00, 0x3f,                                  // 0.5
                                  0xf3, 0x04, 0x35, 0x3f, 0,    0,    0,    0,             // sqrt(1/2), 0
                                  0,    0,    0,    0,    0xf3, 0x04, 0x35, 0x3f, 13, 10}; // 0, sqrt(1/2)
  PolhemusDecoder decoder(speech);
  const auto records = decoder.Take(binary, sizeof binary);
  ASSERT_EQ(records.size(), 1u) << decoder.LastComplaint();
  EXPECT_EQ(records[0].station, 2);
  EXPECT_LT((records[0].pose.translation() - Eigen::Vector3d(100.0, -50.0, 5.0)).norm(), 1e-9);
  // A quarter of a turn about z: the sensor's x axis points along the source's y axis.
  EXPECT_LT((records[0].pose.linear() * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-6);

  speech = Speech(PolhemusFormat::Ascii, PolhemusTwofold(false));
  PolhemusDecoder lines(speech);
  // Columns filled to the brim; azimuth 90 degrees; and a frame later.
  EXPECT_TRUE(Decode(lines,
                     "01 5000 77  1.000000E+01 -1.000000E+02 -5.000000E-01  0.70711 0.00000 0.00000 0.70711   10.00-100.00  "
                     "-0.50  9.000000E+01 0.000000E+00 0.000000E+00 \r\n")
                  .empty());
  const auto pair = Decode(lines, " 2 5017 78  1.000000E+01 -1.000000E+02 -5.000000E-01  0.70711 0.00000 0.00000 0.70711   "
                                  "10.00-100.00  -0.50  9.000000E+01 0.000000E+00 0.000000E+00 \r\n");
  ASSERT_EQ(pair.size(), 2u) << lines.LastComplaint();
  EXPECT_EQ(pair[0].station, 1);
  EXPECT_EQ(pair[1].station, 2);
  EXPECT_LT((pair[1].pose.translation() - Eigen::Vector3d(100.0, -1000.0, -5.0)).norm(), 1e-9);
  EXPECT_LT((pair[1].pose.linear() * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-5);
}

TEST(PolhemusDecoder, ErrorsAndDistortionBecomeStatus)
{
  for (const PolhemusFormat format : {PolhemusFormat::Binary, PolhemusFormat::Ascii}) {
    PolhemusSpeech speech = Speech(format, PolhemusTwofold(true));
    speech.stations = 1;
    speech.distortion = 100.0;
    speech.rangeMm = 120.0;
    PolhemusDecoder decoder(speech);
    struct {
      char error;
      int distortion;
      double x;
      TransformStatus expected;
    } const cases[] = {{' ', 0, 100.0, TransformStatus::Valid},        {' ', 99, 100.0, TransformStatus::Valid},
                       {' ', 100, 100.0, TransformStatus::OutOfRange}, {'I', 0, 100.0, TransformStatus::OutOfRange},
                       {'u', 0, 100.0, TransformStatus::OutOfRange},   {'a', 0, 100.0, TransformStatus::Missing},
                       {'G', 0, 100.0, TransformStatus::Missing},      {' ', 0, 130.0, TransformStatus::OutOfRange},
                       {' ', 0, 100.0, TransformStatus::Valid}};
    std::vector<PolhemusRecord> records;
    std::uint32_t frame = 0;
    for (const auto& test : cases) {
      EmulatedMoment moment = MomentOf(frame++);
      moment.error = test.error;
      moment.distortion = test.distortion;
      Pose pose = EmulatedPose(1, moment.milliseconds);
      pose.translation() = Eigen::Vector3d(test.x, 0.0, 0.0);
      for (const PolhemusRecord& record : Decode(decoder, EncodePolhemus(speech, 1, pose, moment)))
        records.push_back(record);
    }
    ASSERT_EQ(records.size(), std::size(cases)) << decoder.LastComplaint();
    for (std::size_t i = 0; i < records.size(); ++i)
      EXPECT_EQ(records[i].status, cases[i].expected) << i;
  }
}

TEST(PolhemusDecoder, WhatIsImplausibleIsNoPose)
{
  const PolhemusSpeech speech = Speech(PolhemusFormat::Binary, PolhemusBare());
  const std::string good = EncodePolhemus(speech, 1, EmulatedPose(1, 0), MomentOf(0));
  const auto with = [&good](std::size_t at, const std::string& bytes) {
    std::string changed = good;
    return changed.replace(at, bytes.size(), bytes);
  };
  const auto number = [](float value) {
    std::string bytes(4, '\0');
    std::memcpy(bytes.data(), &value, 4);
    return bytes;
  };
  const std::map<std::string, std::string> cases = {{with(2, "\x03"), "station"},
                                                    {with(2, std::string(1, '\0')), "station"},
                                                    {with(3, "U"), "command"},
                                                    {with(4, "\x7f"), "error"},
                                                    {with(6, "\x1d"), "size"},
                                                    {with(8, number(NAN)), "number"},
                                                    {with(8, number(600.0f)), "range"},
                                                    {with(20, number(INFINITY)), "number"},
                                                    {with(20, number(1.1f)), "unit length"},
                                                    {with(36, "\n\r"), "end"}};
  for (const auto& [bytes, words] : cases) {
    PolhemusDecoder decoder(speech);
    const auto records = Decode(decoder, bytes + good);
    EXPECT_EQ(records.size(), 1u) << words; // the good one behind it
    EXPECT_EQ(decoder.Malformed(), 1u) << words;
    EXPECT_NE(decoder.LastComplaint().find(words), std::string::npos) << decoder.LastComplaint() << " lacks " << words;
  }
}

TEST(PolhemusDecoder, ACopyThatIsNoNumberIsNoCopy)
{
  PolhemusSpeech speech = Speech(PolhemusFormat::Binary, PolhemusTwofold(false));
  speech.stations = 1;
  const std::string good = EncodePolhemus(speech, 1, EmulatedPose(1, 0), MomentOf(0));
  PolhemusDecoder whole(speech);
  Decode(whole, good);
  EXPECT_EQ(whole.Malformed(), 0u) << whole.LastComplaint();
  const float nan = NAN;
  // Header, time, frame, position and quaternion come before the copy of the position, three angles after it.
  constexpr std::size_t position = 8 + 4 + 4 + 12 + 16, angles = position + 12;
  for (const auto& [first, words] : {std::pair(position, "a position that differs from its copy"),
                                     std::pair(angles, "an orientation that differs from its copy")})
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::string changed = good;
      std::memcpy(changed.data() + first + 4 * axis, &nan, 4);
      PolhemusDecoder decoder(speech);
      Decode(decoder, changed);
      EXPECT_EQ(decoder.Malformed(), 1u) << words << ", number " << axis + 1;
      EXPECT_NE(decoder.LastComplaint().find(words), std::string::npos) << decoder.LastComplaint();
    }
}

TEST(PolhemusDecoder, GarbageBeforeBetweenAndInPlaceOfRecords)
{
  Random random(5);
  for (const PolhemusSpeech& speech : AllSpeeches()) {
    PolhemusDecoder decoder(speech);
    std::size_t good = 0;
    for (std::uint32_t frame = 0; frame < 50; ++frame) {
      std::string garbage;
      for (int i = 0; i < 30; ++i)
        garbage += static_cast<char>(random.Below(256));
      garbage += speech.format == PolhemusFormat::Ascii ? "\n" : "PALY";
      good += Decode(decoder, garbage + Frame(speech, frame)).size();
    }
    EXPECT_EQ(good, 100u) << decoder.LastComplaint();
    EXPECT_GE(decoder.Malformed(), 50u);
    EXPECT_LE(decoder.Malformed(), 100u);
  }
  // A line that never ends takes no memory, and the next one is read.
  const PolhemusSpeech speech = Speech(PolhemusFormat::Ascii, PolhemusBare());
  PolhemusDecoder decoder(speech);
  for (int i = 0; i < 1000; ++i)
    Decode(decoder, std::string(1000, '7'));
  EXPECT_EQ(decoder.Malformed(), 1u);
  EXPECT_EQ(Decode(decoder, "\r\n" + Frame(speech, 1)).size(), 2u);
}

TEST(PolhemusDecoder, ClockWrapsAndJumps)
{
  PolhemusSpeech speech = Speech(PolhemusFormat::Binary, PolhemusTwofold(true));
  speech.stations = 1;
  PolhemusDecoder decoder(speech);
  std::vector<std::uint32_t> times;
  const auto send = [&](std::uint32_t milliseconds, std::uint32_t frame) {
    EmulatedMoment moment;
    moment.milliseconds = milliseconds;
    moment.frame = frame;
    std::size_t count = 0;
    for (const PolhemusRecord& r : Decode(decoder, EncodePolhemus(speech, 1, EmulatedPose(1, 0), moment))) {
      times.push_back(*r.milliseconds);
      ++count;
    }
    return count;
  };
  EXPECT_EQ(send(4294967270u, 4294967294u), 0u); // nothing confirms the first one yet
  EXPECT_EQ(send(4294967287u, 4294967295u), 2u);
  EXPECT_EQ(send(8u, 0u), 1u); // through 2^32, both
  EXPECT_EQ(send(25u, 1u), 1u);
  EXPECT_EQ(send(900025u, 2u), 0u); // a single damaged time
  EXPECT_EQ(send(58u, 3u), 1u);
  EXPECT_EQ(decoder.Malformed(), 1u);
  EXPECT_EQ(send(500000u, 4u), 0u); // the clock is set
  EXPECT_EQ(send(500017u, 5u), 2u);
  EXPECT_EQ(send(10u, 0u), 0u); // and starts again
  EXPECT_EQ(send(27u, 1u), 2u);
  EXPECT_EQ(decoder.Malformed(), 1u);
  EXPECT_EQ(times.size(), 9u);
}

TEST(PolhemusDecoder, ALeapIsBelievedWhenItIsConfirmed)
{
  for (const PolhemusLayout& layout : {PolhemusSingle(true), PolhemusBare()}) {
    PolhemusSpeech speech = Speech(PolhemusFormat::Binary, layout);
    PolhemusDecoder decoder(speech);
    std::uint32_t frame = 0;
    const auto send = [&](int station, double x, double turn = 0.0) {
      Pose pose = Pose::Identity();
      pose.translation() = Eigen::Vector3d(x, 0.0, 0.0);
      pose.linear() = ExpRotation(Eigen::Vector3d(0.0, 0.0, turn));
      return Decode(decoder, EncodePolhemus(speech, station, pose, MomentOf(frame++))).size();
    };
    send(1, 100.0);
    send(1, 110.0);
    EXPECT_EQ(send(1, 300.0), 0u); // a damaged number
    EXPECT_EQ(send(2, 700.0), 1u); // another station is another matter
    EXPECT_EQ(send(1, 120.0), 1u);
    EXPECT_EQ(decoder.Malformed(), 1u);
    EXPECT_EQ(send(1, 120.0, 2.0), 0u);
    EXPECT_EQ(send(1, 125.0, 0.1), 1u);
    EXPECT_EQ(decoder.Malformed(), 2u);
    EXPECT_EQ(send(1, -130.0), 0u); // the sensor has gone to the other hemisphere
    EXPECT_EQ(send(1, -135.0), 2u);
    EXPECT_EQ(send(1, -140.0), 1u);
    EXPECT_EQ(decoder.Malformed(), 2u);
  }
}

// With one byte in a thousand damaged, or lost: what of it becomes a pose. The figures are in Documentation/trackers/polhemus.md.
TEST(PolhemusDecoder, FewWrongPosesGetThroughANoisyLine)
{
  struct Case {
    const char* name;
    PolhemusModel model;
    PolhemusFormat format;
    PolhemusLayout layout;
    LineNoise noise;
    double wrong; // at most, of a hundred thousand
  };
  const LineNoise damage{1e-3, 0.0, 0.0}, loss{0.0, 1e-3, 0.0};
  constexpr auto Patriot = PolhemusModel::Patriot;
  const Case cases[] = {
      {"binary twofold, damaged", Patriot, PolhemusFormat::Binary, PolhemusTwofold(true), damage, 10.0},
      {"binary single, damaged", Patriot, PolhemusFormat::Binary, PolhemusSingle(true), damage, 1000.0},
      {"ascii twofold, damaged", Patriot, PolhemusFormat::Ascii, PolhemusTwofold(true), damage, 10.0},
      {"ascii single, damaged", Patriot, PolhemusFormat::Ascii, PolhemusSingle(true), damage, 200.0},
      {"binary twofold, lost", Patriot, PolhemusFormat::Binary, PolhemusTwofold(true), loss, 3.0},
      {"binary single, lost", Patriot, PolhemusFormat::Binary, PolhemusSingle(true), loss, 3.0},
      {"ascii twofold, lost", Patriot, PolhemusFormat::Ascii, PolhemusTwofold(true), loss, 10.0},
      {"ascii single, lost", Patriot, PolhemusFormat::Ascii, PolhemusSingle(true), loss, 10.0},
      {"Liberty single, damaged", PolhemusModel::Liberty, PolhemusFormat::Binary, PolhemusSingle(true), damage, 1000.0}};
  constexpr std::uint32_t Frames = 10000; // 20000 records of two stations
  for (const Case& test : cases) {
    const PolhemusSpeech speech = Speech(test.format, test.layout, test.model);
    PolhemusDecoder decoder(speech);
    Random random(11);
    std::map<std::pair<int, std::uint32_t>, bool> sent; // whether it went out whole
    std::size_t whole = 0, taken = 0, wrong = 0, wrongTime = 0;
    double largest = 0.0, farthest = 0.0; // ms, mm
    std::map<std::pair<int, std::uint32_t>, bool> came;
    for (std::uint32_t frame = 0; frame < Frames; ++frame) {
      const EmulatedMoment moment = MomentOf(frame, test.model == Patriot ? 60.0 : 240.0);
      for (int station = 1; station <= 2; ++station) {
        const std::string clean = EncodePolhemus(speech, station, EmulatedPose(station, moment.milliseconds), moment);
        const std::string bytes = test.noise.Over(clean, random);
        sent[{station, moment.milliseconds}] = bytes == clean;
        whole += bytes == clean;
        for (const PolhemusRecord& record : Decode(decoder, bytes)) {
          ++taken;
          const auto key = std::make_pair(record.station, *record.milliseconds);
          const Pose truth = EmulatedPose(record.station, *record.milliseconds);
          if (sent.count(key) == 0) {
            ++wrongTime;
            const auto after = sent.lower_bound(key);
            double nearest = 1e9;
            if (after != sent.end() && after->first.first == key.first)
              nearest = after->first.second - key.second;
            if (after != sent.begin() && std::prev(after)->first.first == key.first)
              nearest = std::min(nearest, static_cast<double>(key.second - std::prev(after)->first.second));
            largest = std::max(largest, nearest);
          } else if (record.status == TransformStatus::Valid) {
            const double off = (record.pose.translation() - truth.translation()).norm();
            wrong += off > 0.1 || DegreesBetween(record.pose, truth) > 0.2;
            farthest = std::max(farthest, off);
          }
          came[key] = true;
        }
      }
    }
    std::size_t lost = 0;
    for (const auto& [key, intact] : sent)
      lost += intact && came.count(key) == 0;
    const double scale = 1e5 / (2.0 * Frames);
    std::printf("%-24s of 100000: %6.0f whole, %6.0f taken, %5.1f wrong (by %.1f mm), %5.1f wrong times (by %.0f ms), "
                "%5.1f whole ones lost\n",
                test.name, whole * scale, taken * scale, wrong * scale, farthest, wrongTime * scale, largest, lost * scale);
    EXPECT_LE((wrong + wrongTime) * scale, test.wrong) << test.name;
    EXPECT_LE(farthest, 150.0) << test.name;      // twice what a hand may move it in a frame
    EXPECT_LE(lost * scale, 1000.0) << test.name; // what is whole is taken, but for neighbours of what is not
    EXPECT_GE(taken, whole - lost) << test.name;
  }
}

TEST(PolhemusDecoder, RefusesSpeechThatItCannotCheck)
{
  const auto refused = [](PolhemusSpeech speech, const std::string& words) {
    try {
      PolhemusDecoder decoder(speech);
      ADD_FAILURE() << "accepted; expected: " << words;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  PolhemusSpeech speech;
  speech.layout = {PolhemusItem::Position, PolhemusItem::EulerExtended, PolhemusItem::LineEnd};
  refused(speech, "quaternion");
  speech.layout = {PolhemusItem::Position, PolhemusItem::Quaternion};
  refused(speech, "line end");
  speech.layout = {PolhemusItem::Position, PolhemusItem::Position, PolhemusItem::Quaternion, PolhemusItem::LineEnd};
  refused(speech, "twice");
  speech = {};
  speech.stations = 4;
  refused(speech, "stations 1 to 2");
  speech.stations = 0;
  refused(speech, "at least one");
  speech = {};
  speech.rangeMm = NAN;
  refused(speech, "Range is nan mm; it must be in (0, 20000]");
  speech = {};
  speech.unitMm = -1.0;
  refused(speech, "UnitMm is -1 mm; it must be in (0, 1000]");
}

TEST(PolhemusReply, IsFoundAmongOtherThings)
{
  const std::string reply = std::string("LY\x01\x15\0\0\x04\0", 8) + std::string("\x03\0\x01\0", 4);
  std::string bytes = "xLYPA" + reply.substr(0, 9);
  EXPECT_FALSE(TakePolhemusReply(bytes, 0x15));
  bytes += reply.substr(9) + "rest";
  EXPECT_FALSE(TakePolhemusReply(bytes, 'V'));
  const auto found = TakePolhemusReply(bytes, 0x15);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->model, PolhemusModel::Liberty);
  EXPECT_EQ(found->data, std::string("\x03\0\x01\0", 4));
  EXPECT_EQ(bytes, "rest");
}

TEST(DeviceClock, FollowsTheSmallestDelayWithoutLeaps)
{
  DeviceClock clock;
  Random random(3);
  double before = 0.0, worst = 0.0;
  for (int i = 0; i < 60000; ++i) { // 1000 s at 60 Hz; the counter is 50 ppm slow; messages take 4 ms and up to 30 ms more
    const double sent = i / 60.0;
    const auto milliseconds =
        static_cast<std::uint32_t>(static_cast<std::uint64_t>(4294960000.0 + 1000.0 * sent * (1.0 - 50e-6))); // wraps after 7 s
    const double mapped = clock.Map(milliseconds, 1e9 + sent + 0.004 + 0.03 * std::pow(random.Uniform(), 3.0));
    EXPECT_GE(mapped, before);
    before = mapped;
    if (i > 600)
      worst = std::max(worst, std::fabs(mapped - 1e9 - sent - 0.004));
  }
  EXPECT_EQ(clock.Jumps(), 0u);
  EXPECT_LT(worst, 0.003); // the counter itself has whole milliseconds
}

TEST(DeviceClock, JumpsAreMappedAnew)
{
  DeviceClock clock;
  EXPECT_EQ(clock.Map(1000, 50.0), 50.0);
  EXPECT_NEAR(clock.Map(1100, 50.1), 50.1, 1e-12);
  EXPECT_NEAR(clock.Map(901200, 50.2), 50.2, 1e-9);
  EXPECT_EQ(clock.Jumps(), 1u);
  EXPECT_NEAR(clock.LastJump(), 900.0, 1e-9);
  EXPECT_NEAR(clock.Map(5, 50.3), 50.3, 1e-9); // back
  EXPECT_EQ(clock.Jumps(), 2u);
  EXPECT_NEAR(clock.Map(105, 50.9), 50.4, 1e-3); // half a second late, no jump
  EXPECT_EQ(clock.Jumps(), 2u);
}

} // namespace
