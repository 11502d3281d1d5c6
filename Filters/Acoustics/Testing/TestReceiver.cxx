// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Acoustics/Receiver.h"
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;

namespace {

// Echoes of which every sample has the same size.
BeamEchoes Constant(float size, std::array<int, 3> dimensions = {101, 3, 2})
{
  BeamEchoes echoes;
  echoes.probe = ProbeGeometry::Linear(20.0, 10.0, 10.0, 110.0);
  echoes.baseband = Volume<std::complex<float>>(dimensions);
  for (auto& value : echoes.baseband.View())
    value = {0.6f * size, -0.8f * size};
  return echoes;
}

// Fully developed speckle of mean power 1, independent in every sample.
BeamEchoes Rayleigh()
{
  BeamEchoes echoes = Constant(0.0f, {400, 20, 20});
  Random random(5);
  for (auto& value : echoes.baseband.View())
    value = {static_cast<float>(std::sqrt(0.5) * random.Normal()), static_cast<float>(std::sqrt(0.5) * random.Normal())};
  return echoes;
}

Volume<unsigned char> Grey(const BeamEchoes& echoes, const Receiver& receiver, int samples = 0)
{
  std::array<int, 3> size = echoes.baseband.Dimensions();
  size[0] = samples > 0 ? samples : size[0];
  Volume<unsigned char> grey(size);
  DetectEchoes(echoes, receiver, grey.View());
  return grey;
}

Volume<float> Envelope(const BeamEchoes& echoes, const Receiver& receiver, int samples = 0)
{
  std::array<int, 3> size = echoes.baseband.Dimensions();
  size[0] = samples > 0 ? samples : size[0];
  Volume<float> envelope(size);
  DetectEnvelope(echoes, receiver, envelope.View());
  return envelope;
}

template <class T>
double Mean(const Volume<T>& volume)
{
  double sum = 0.0;
  for (const T value : volume.View())
    sum += static_cast<double>(value);
  return sum / static_cast<double>(volume.View().Size());
}

Error::Kind KindOf(const std::function<void()>& call, const std::string& part)
{
  try {
    call();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    return error.GetKind();
  }
  ADD_FAILURE() << "nothing was thrown: " << part;
  return Error::Kind::Cancelled;
}

} // namespace

TEST(Receiver, CompressesByTheClosedForm)
{
  Receiver receiver;
  receiver.dynamicRangeDb = 51.0; // 5 grey values per dB
  receiver.referenceGrey = 100.0;
  for (const double db : {-15.0, -3.0, 0.0, 8.0}) {
    const Volume<unsigned char> grey = Grey(Constant(static_cast<float>(std::pow(10.0, db / 20.0))), receiver);
    EXPECT_NEAR(grey.View()[7], 100.0 + 5.0 * (db + 2.5068), 0.51) << db;
  }
  receiver.gainDb = 6.0;
  EXPECT_NEAR(Grey(Constant(1.0f), receiver).View()[7], 100.0 + 5.0 * (6.0 + 2.5068), 0.51);
  receiver.gainDb = 100.0;
  EXPECT_EQ(Grey(Constant(1.0f), receiver).View()[7], 255);
  receiver.gainDb = -100.0;
  EXPECT_EQ(Grey(Constant(1.0f), receiver).View()[7], 0);
  EXPECT_EQ(Grey(Constant(0.0f), Receiver()).View()[7], 0);
  EXPECT_EQ(Grey(Constant(std::numeric_limits<float>::quiet_NaN()), Receiver()).View()[7], 0);
}

TEST(Receiver, ShowsReferenceTissueAtItsGrey)
{
  Receiver receiver;
  receiver.dynamicRangeDb = 80.0;
  EXPECT_NEAR(Mean(Grey(Rayleigh(), receiver)), 110.0, 0.3);
  receiver.referenceGrey = 140.0;
  EXPECT_NEAR(Mean(Grey(Rayleigh(), receiver)), 140.0, 0.3);
}

TEST(Receiver, GainRisesWithDepth)
{
  Receiver receiver;
  receiver.gainDb = 2.0;
  receiver.tgcDbPerCm = 1.5;
  receiver.tgcPoints = {{20.0, -3.0}, {40.0, 5.0}, {80.0, 1.0}};
  EXPECT_NEAR(receiver.GainDbAt(10.0), 2.0 + 1.5 - 3.0, 1e-12);
  EXPECT_NEAR(receiver.GainDbAt(30.0), 2.0 + 4.5 + 1.0, 1e-12);
  EXPECT_NEAR(receiver.GainDbAt(60.0), 2.0 + 9.0 + 3.0, 1e-12);
  EXPECT_NEAR(receiver.GainDbAt(200.0), 2.0 + 30.0 + 1.0, 1e-12);
  EXPECT_NEAR(receiver.GainDbAt(-10.0), 2.0 - 3.0, 1e-12); // nothing is gained above the face
  const Volume<float> envelope = Envelope(Constant(1.0f), receiver);
  for (int i = 0; i < 101; i += 10)
    EXPECT_NEAR(20.0 * std::log10(static_cast<double>(envelope.View()(i, 1, 1))), receiver.GainDbAt(10.0 + i), 1e-4);
}

TEST(Receiver, NoiseHasItsPowerBeforeAllGain)
{
  Receiver receiver;
  receiver.noiseDb = -20.0;
  receiver.tgcDbPerCm = 2.0;
  const Volume<float> envelope = Envelope(Constant(0.0f, {101, 60, 20}), receiver);
  for (const int i : {0, 50, 100}) {
    double power = 0.0, sum = 0.0, count = 0.0;
    for (int k = 0; k < 20; ++k)
      for (int j = 0; j < 60; ++j, count += 1.0) {
        const auto value = static_cast<double>(envelope.View()(i, j, k));
        sum += value;
        power += value * value;
      }
    EXPECT_NEAR(10.0 * std::log10(power / count), -20.0 + 0.2 * (10.0 + i), 0.5);         // 1,200 values
    EXPECT_NEAR(sum / count / std::sqrt(power / count), std::sqrt(0.25 * 3.14159), 0.03); // Rayleigh
  }
  // Rows differ, runs and threads do not.
  EXPECT_NE(envelope.View()(3, 0, 0), envelope.View()(3, 1, 0));
  const ThreadLimit one(1);
  const Volume<float> again = Envelope(Constant(0.0f, {101, 60, 20}), receiver);
  EXPECT_TRUE(std::equal(again.View().begin(), again.View().end(), envelope.View().begin()));
  receiver.noiseSeed = 2;
  const Volume<float> other = Envelope(Constant(0.0f, {101, 60, 20}), receiver);
  EXPECT_NE(other.View()(3, 0, 0), envelope.View()(3, 0, 0));
}

TEST(Receiver, NoiseIsMadeOfTheNumbersOfItsRow)
{
  Receiver receiver;
  receiver.noiseDb = -6.0;
  receiver.noiseSeed = 0x123456789abcu;
  const double noise = std::pow(10.0, 0.05 * receiver.noiseDb);
  const BeamEchoes echoes = Constant(0.25f);
  const Volume<float> envelope = Envelope(echoes, receiver);
  for (int plane = 0; plane < 2; ++plane)
    for (int beam = 0; beam < 3; ++beam) {
      Random random(receiver.noiseSeed, static_cast<std::uint64_t>(3 * plane + beam));
      for (int i = 0; i < 101; ++i) {
        const double size = noise * std::sqrt(-std::log1p(-random.Uniform())), angle = 6.283185307179586 * random.Uniform();
        const double expected = std::hypot(0.15 + size * std::cos(angle), -0.2 + size * std::sin(angle));
        ASSERT_NEAR(static_cast<double>(envelope.View()(i, beam, plane)), expected, 2e-6) << i;
      }
    }
}

TEST(Receiver, FewerSamplesAreMeansOfTheFiner)
{
  BeamEchoes echoes = Constant(0.0f);
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 101; ++i)
        echoes.baseband.View()(i, j, k) = static_cast<float>(10 + i + j);
  // A line keeps its values, inside of the ends.
  const Volume<float> coarse = Envelope(echoes, Receiver(), 21);
  for (int i = 1; i < 20; ++i)
    EXPECT_NEAR(coarse.View()(i, 2, 1), 12.0f + 5.0f * static_cast<float>(i), 1e-3f);
  const Volume<float> finer = Envelope(echoes, Receiver(), 201);
  for (int i = 2; i < 199; ++i)
    EXPECT_NEAR(finer.View()(i, 2, 1), 12.0f + 0.5f * static_cast<float>(i), 1e-3f);
  // A single bright sample is spread by the triangle, its sum kept.
  for (auto& value : echoes.baseband.View())
    value = 0.0f;
  echoes.baseband.View()(53, 0, 0) = 1.0f;
  const Volume<float> spread = Envelope(echoes, Receiver(), 21);
  EXPECT_NEAR(spread.View()(10, 0, 0), 0.4f / 5.0f, 1e-6f);
  EXPECT_NEAR(spread.View()(11, 0, 0), 0.6f / 5.0f, 1e-6f);
}

TEST(Receiver, RefusesWhatIsOutOfRange)
{
  const auto refuses = [](const std::function<void(Receiver&)>& change, const std::string& name) {
    Receiver receiver;
    change(receiver);
    EXPECT_EQ(KindOf([&] { receiver.Check(); }, name), Error::Kind::InvalidParameter);
  };
  EXPECT_NO_THROW(Receiver().Check());
  refuses([](Receiver& r) { r.gainDb = 201.0; }, "GainDb");
  refuses([](Receiver& r) { r.tgcDbPerCm = std::nan(""); }, "TgcDbPerCm");
  refuses([](Receiver& r) { r.dynamicRangeDb = 5.0; }, "DynamicRangeDb");
  refuses([](Receiver& r) { r.referenceGrey = 256.0; }, "ReferenceGrey");
  refuses([](Receiver& r) { r.noiseDb = -201.0; }, "NoiseDb");
  refuses([](Receiver& r) { r.tgcPoints = {{10.0, 300.0}}; }, "TgcPoints[0]: GainDb");
  refuses([](Receiver& r) { r.tgcPoints = {{10.0, 0.0}, {10.0, 1.0}}; }, "TgcPoints[1]: DepthMm");

  const BeamEchoes echoes = Constant(1.0f);
  Volume<unsigned char> wrong({101, 4, 2}), thin({1, 3, 2});
  EXPECT_EQ(KindOf([&] { DetectEchoes(echoes, Receiver(), wrong.View()); }, "101 x 4 x 2"), Error::Kind::BadInput);
  EXPECT_EQ(KindOf([&] { DetectEchoes(echoes, Receiver(), thin.View()); }, "1 x 3 x 2"), Error::Kind::BadInput);
  Volume<unsigned char> right({101, 3, 2});
  EXPECT_EQ(KindOf([&] { DetectEchoes(echoes, Receiver(), right.View(), Progress([](double) { return false; })); }, "stopped"),
            Error::Kind::Cancelled);
}
