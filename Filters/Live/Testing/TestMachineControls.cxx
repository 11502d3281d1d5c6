// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Live/MachineControls.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

namespace {

using namespace echorama;

constexpr int samples = 101; // over 100 mm

std::vector<float> Developed(const MachineControls& controls, std::vector<float> values, const std::vector<float>& noiseDb = {})
{
  const std::vector<unsigned char> content(values.size(), 1);
  BeamDevelopment(controls, 0.0, 100.0, static_cast<int>(values.size()))
      .Apply(noiseDb.empty() ? nullptr : noiseDb.data(), content.data(), values.data());
  return values;
}

std::vector<float> Developed(const MachineControls& controls, float value)
{
  return Developed(controls, std::vector<float>(samples, value));
}

TEST(MachineControls, LeaveGreysAloneByDefault)
{
  std::vector<float> ramp;
  for (int i = 0; i < 256; ++i)
    ramp.push_back(static_cast<float>(i));
  const std::vector<float> made = Developed(MachineControls(), ramp);
  for (std::size_t i = 0; i < ramp.size(); ++i)
    EXPECT_NEAR(made[i], ramp[i], 1e-3);
}

TEST(MachineControls, NoFrequencyIsThatOfTheRecording)
{
  MachineControls usual;
  usual.recordedFrequencyMHz = 7.0;
  const std::vector<float> made = Developed(usual, 100.0f);
  for (const float grey : made)
    EXPECT_NEAR(grey, 100.0f, 1e-3);
  usual.frequencyMHz = 3.0;
  EXPECT_GT(Developed(usual, 100.0f)[100], 110.0f);
  EXPECT_EQ(FrequencyOf(usual, 20.0), 3.0);
  usual.frequencyMHz = 0.0;
  EXPECT_EQ(FrequencyOf(usual, 20.0), 20.0);
  usual.frequencyMHz = 0.2;
  EXPECT_THROW(Developed(usual, 100.0f), Error);
}

TEST(MachineControls, GainShiftsGreysByTheDynamicRange)
{
  MachineControls c;
  c.gainDb = 6.0;
  EXPECT_NEAR(Developed(c, 100.0f)[50], 125.5, 1e-3); // 6 of 60 dB
  EXPECT_NEAR(Developed(c, 250.0f)[50], 255.0, 1e-3);
  c.gainDb = -30.0;
  EXPECT_NEAR(Developed(c, 100.0f)[50], 0.0, 1e-3);
}

TEST(MachineControls, ASmallerDynamicRangeIsMoreContrast)
{
  MachineControls c;
  c.dynamicRangeDb = 30.0;
  EXPECT_NEAR(Developed(c, 255.0f)[50], 255.0, 1e-3);
  EXPECT_NEAR(Developed(c, 204.0f)[50], 153.0, 1e-3); // -12 dB
  EXPECT_NEAR(Developed(c, 100.0f)[50], 0.0, 1e-3);
}

TEST(MachineControls, OtherScalesOfIntensitiesAreMapped)
{
  MachineControls c;
  c.black = -1000.0;
  c.white = 3000.0;
  EXPECT_NEAR(Developed(c, 0.0f)[50], 63.75, 1e-3);
  EXPECT_NEAR(Developed(c, 3000.0f)[50], 255.0, 1e-3);
}

TEST(MachineControls, EachSliderOfTheTimeGainCurveHasItsDepth)
{
  MachineControls c;
  for (std::size_t slider = 0; slider < 8; ++slider) {
    c.tgcDb.fill(0.0);
    c.tgcDb[slider] = 6.0;
    const std::vector<float> made = Developed(c, std::vector<float>(8 * 10 - 9, 100.0f));
    for (std::size_t i = 0; i < made.size(); ++i) {
      const double apart = std::abs(static_cast<double>(i) - 10.0 * static_cast<double>(slider)) / 10.0;
      EXPECT_NEAR(made[i], 100.0 + 25.5 * std::max(0.0, 1.0 - apart), 1e-3) << slider << " " << i;
    }
  }
}

TEST(MachineControls, AHigherFrequencyLosesMoreOnTheWayThereAndBack)
{
  MachineControls c;
  c.frequencyMHz = 4.5; // one above that of the recording
  const std::vector<float> made = Developed(c, 200.0f);
  EXPECT_NEAR(made[0], 200.0, 1e-3);
  EXPECT_NEAR(made[60], 200.0 - 6.0 * 4.25, 1e-2); // 6 cm, 1 dB/cm both ways
  c.frequencyMHz = 2.5;
  EXPECT_NEAR(Developed(c, 100.0f)[60], 100.0 + 6.0 * 4.25, 1e-2);
}

TEST(MachineControls, PowersOfNoiseAndSignalAdd)
{
  MachineControls c;
  c.noiseDb = -30.0;
  c.gainDb = 3.0;
  std::vector<float> noise, signal;
  for (int i = 0; i < samples; ++i) {
    noise.push_back(static_cast<float>(-20.0 + 0.3 * i)); // about its mean
    signal.push_back(static_cast<float>(2 * i));
  }
  const std::vector<float> made = Developed(c, signal, noise);
  for (std::size_t i = 0; i < made.size(); ++i) {
    const double s = (signal[i] / 255.0 - 1.0) * 60.0, n = noise[i] - 30.0;
    const double both = 10.0 * std::log10(std::pow(10.0, s / 10.0) + std::pow(10.0, n / 10.0)) + 3.0;
    EXPECT_NEAR(made[i], std::min(255.0, std::max(0.0, 255.0 * (1.0 + both / 60.0))), 0.06) << i;
  }
}

TEST(MachineControls, ShadowFallsBehindWhatIsBrightAlone)
{
  MachineControls c;
  c.shadowDbPerCm = 20.0;
  std::vector<float> values(samples, 120.0f);
  std::fill(values.begin() + 30, values.begin() + 40, 255.0f); // 1 cm of white
  const std::vector<float> made = Developed(c, values);
  for (int i = 0; i < 30; ++i)
    EXPECT_NEAR(made[static_cast<std::size_t>(i)], 120.0, 1e-3);
  for (int i = 41; i < samples; ++i)
    EXPECT_NEAR(made[static_cast<std::size_t>(i)], 120.0 - 20.0 * 4.25, 1e-2);
  EXPECT_NEAR(made[30], 255.0, 1e-3);
}

TEST(MachineControls, EnhancementFollowsWhatIsBlackAlone)
{
  MachineControls c;
  c.enhancementDbPerCm = 3.0;
  std::vector<float> values(samples, 120.0f);
  std::fill(values.begin() + 30, values.begin() + 50, 0.0f);
  const std::vector<float> made = Developed(c, values);
  EXPECT_NEAR(made[29], 120.0, 1e-3);
  EXPECT_NEAR(made[60], 120.0 + 6.0 * 4.25, 1e-2);
  EXPECT_NEAR(made[100], made[60], 1e-3);
}

TEST(MachineControls, SamplesWithoutContentAreBlackAndCastNothing)
{
  MachineControls c;
  c.shadowDbPerCm = 20.0;
  c.gainDb = 10.0;
  std::vector<float> values(samples, 255.0f);
  std::fill(values.begin() + 50, values.end(), 120.0f);
  std::vector<unsigned char> content(samples, 1);
  std::fill(content.begin(), content.begin() + 50, static_cast<unsigned char>(0));
  BeamDevelopment(c, 0.0, 100.0, samples).Apply(nullptr, content.data(), values.data());
  for (int i = 0; i < samples; ++i)
    EXPECT_NEAR(values[static_cast<std::size_t>(i)], i < 50 ? 0.0 : 162.5, 1e-2);
}

TEST(MachineControls, RefuseWhatIsOutOfRange)
{
  MachineControls none, upsideDown, notFinite;
  none.dynamicRangeDb = 0.0;
  upsideDown.white = -1.0;
  notFinite.gainDb = std::numeric_limits<double>::quiet_NaN();
  for (const MachineControls& c : {none, upsideDown, notFinite})
    EXPECT_THROW(BeamDevelopment(c, 0.0, 100.0, samples), Error);
}

} // namespace
