// SPDX-License-Identifier: BSD-3-Clause
// All is addition in dB but for the noise, whose power adds to that of the signal: 10 lg(10^(s/10) + 10^(n/10)) is the greater of
// both, and up to 3 dB that a table of their difference gives.
#include "Filters/Live/MachineControls.h"
#include "Core/Base/CheckRange.h"
#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>

namespace echorama {
namespace {

constexpr float farthestDb = 40.0f; // beyond, the weaker power adds less than 0.0005 dB
constexpr int tableSteps = 1024;
constexpr float mostShadowDb = 60.0f, mostEnhancementDb = 20.0f;

// What two powers are together above the greater one, by their distance in dB.
const std::vector<float>& PowerSumTable()
{
  static const std::vector<float> table = [] {
    std::vector<float> made(tableSteps + 1);
    for (int step = 0; step <= tableSteps; ++step)
      made[static_cast<std::size_t>(step)] =
          static_cast<float>(10.0 * std::log10(1.0 + std::pow(10.0, -0.1 * step * farthestDb / tableSteps)));
    return made;
  }();
  return table;
}

void ToDb(float* __restrict value, int count, float black, float dbPerGrey, float rangeDb)
{
  for (int i = 0; i < count; ++i)
    value[i] = (value[i] - black) * dbPerGrey - rangeDb;
}

void AddNoise(float* __restrict db, const float* __restrict noise, int count, float mean, const float* __restrict table)
{
  for (int i = 0; i < count; ++i) {
    const float n = noise[i] + mean, larger = db[i] > n ? db[i] : n, apart = std::fabs(db[i] - n);
    const float step = (apart < farthestDb ? apart : farthestDb) * (tableSteps / farthestDb);
    db[i] = larger + table[static_cast<int>(step + 0.5f)];
  }
}

void ToGrey(float* __restrict db, const float* __restrict gain, const unsigned char* __restrict content, int count,
            float greyPerDb)
{
  for (int i = 0; i < count; ++i) {
    float grey = 255.0f + (db[i] + gain[i]) * greyPerDb;
    grey = grey > 0.0f ? grey : 0.0f;
    grey = grey < 255.0f ? grey : 255.0f;
    db[i] = content[i] ? grey : 0.0f;
  }
}

} // namespace

ParameterList Describe(MachineControls& c)
{
  ParameterList list{
      Parameter("GainDb", c.gainDb, {-100, 100}, "dB", "Gain of everything."),
      Parameter("DynamicRangeDb", c.dynamicRangeDb, {10, 200}, "dB",
                "How much the 255 steps of grey span: less gives more contrast."),
      Parameter(
          "FrequencyMHz", c.frequencyMHz, {0, 60}, "MHz",
          "Frequency of the probe, from 0.5 on. 0: the usual one of the probe for scenes, that of the recording for volumes, "
          "which are then as they were recorded; above it deeper tissue is darker, below it brighter."),
  };
  for (std::size_t slider = 0; slider < c.tgcDb.size(); ++slider)
    list.push_back(
        Parameter("Tgc" + std::to_string(slider + 1) + "Db", c.tgcDb[slider], {-40, 40}, "dB",
                  "Time-gain curve, slider " + std::to_string(slider + 1) +
                      " of 8: further gain at its depth. The first stands for the first depth, the last for the last."));
  const ParameterList rest{
      Parameter("NoiseDb", c.noiseDb, {-200, 0}, "dB",
                "Mean power of the noise of electronics, beside white, before all gain. -200: none."),
      Parameter("NoiseMoves", c.noiseMoves, "Whether each frame has noise of its own; else it is fixed to the beams."),
      Parameter("NoiseGrainMm", c.noiseGrainMm, {0, 10}, "mm", "Size of the grain of the noise along the beam.").Advanced(),
      Parameter("Seed", c.seed, {0, 9223372036854775807.0}, "", "The same seed makes the same noise."),
      Parameter("ShadowDbPerCm", c.shadowDbPerCm, {0, 200}, "dB/cm",
                "For the eye: how much darker it becomes behind a cm of white. 0: the volume as it is."),
      Parameter("EnhancementDbPerCm", c.enhancementDbPerCm, {0, 20}, "dB/cm",
                "For the eye: how much brighter it becomes behind a cm of black. 0: the volume as it is."),
      Parameter("BrightLevel", c.brightLevel, {0, 0.99}, "", "Shadow is cast by what is brighter: 0 is black, 1 white.")
          .Advanced(),
      Parameter("DarkLevel", c.darkLevel, {0.01, 1}, "", "Enhancement follows what is darker: 0 is black, 1 white.").Advanced(),
      Parameter("Attenuation", c.attenuation, {0, 10}, "dB/cm/MHz", "Of tissue, one way: what a change of the frequency goes by.")
          .Advanced(),
      Parameter("RecordedFrequencyMHz", c.recordedFrequencyMHz, {0.5, 60}, "MHz",
                "The frequency at which the volume was recorded.")
          .Advanced(),
      Parameter("RecordedDynamicRangeDb", c.recordedDynamicRangeDb, {10, 200}, "dB",
                "What the greys of the volume span, from Black to White.")
          .Advanced(),
      Parameter("Black", c.black, {}, "", "The intensity of the volume that is black.").Advanced(),
      Parameter("White", c.white, {}, "", "The intensity of the volume that is white; above Black.").Advanced(),
  };
  list.insert(list.end(), rest.begin(), rest.end());
  return list;
}

bool operator==(const MachineControls& a, const MachineControls& b)
{
  const auto tie = [](const MachineControls& c) {
    return std::tie(c.gainDb, c.tgcDb, c.dynamicRangeDb, c.frequencyMHz, c.black, c.white, c.recordedDynamicRangeDb,
                    c.recordedFrequencyMHz, c.attenuation, c.noiseDb, c.noiseMoves, c.noiseGrainMm, c.seed, c.shadowDbPerCm,
                    c.enhancementDbPerCm, c.brightLevel, c.darkLevel);
  };
  return tie(a) == tie(b);
}

double FrequencyOf(const MachineControls& c, double usualMHz)
{
  if (c.frequencyMHz == 0.0)
    return usualMHz;
  CheckRange("FrequencyMHz, which is not 0,", c.frequencyMHz, 0.5, 60.0);
  return c.frequencyMHz;
}

Receiver GainOf(const MachineControls& c, double firstDepth, double lastDepth)
{
  Receiver receiver;
  receiver.gainDb = c.gainDb;
  const double step = (lastDepth - firstDepth) / static_cast<double>(c.tgcDb.size() - 1);
  for (std::size_t slider = 0; slider < c.tgcDb.size(); ++slider)
    receiver.tgcPoints.push_back({firstDepth + step * static_cast<double>(slider), c.tgcDb[slider]});
  return receiver;
}

BeamDevelopment::BeamDevelopment(const MachineControls& c, double depthMin, double depthMax, int samples)
{
  CheckRanges(c);
  if (!(c.white > c.black))
    throw Error(Error::Kind::InvalidParameter, "White must be above Black");
  greyToDb_ = static_cast<float>(c.recordedDynamicRangeDb / (c.white - c.black));
  black_ = static_cast<float>(c.black);
  rangeDb_ = static_cast<float>(c.recordedDynamicRangeDb);
  greyPerDb_ = static_cast<float>(255.0 / c.dynamicRangeDb);
  noiseMean_ = static_cast<float>(c.noiseDb);
  const double stepCm = 0.1 * (depthMax - depthMin) / (samples - 1);
  shadowPerSample_ = static_cast<float>(c.shadowDbPerCm * stepCm);
  enhancementPerSample_ = static_cast<float>(c.enhancementDbPerCm * stepCm);
  bright_ = static_cast<float>(c.brightLevel);
  dark_ = static_cast<float>(c.darkLevel);
  const double aboveMHz = FrequencyOf(c, c.recordedFrequencyMHz) - c.recordedFrequencyMHz;
  const Receiver curve = GainOf(c, 0.0, samples - 1.0);
  for (int i = 0; i < samples; ++i) {
    gain_.push_back(static_cast<float>(curve.GainDbAt(i)));
    const double wayCm = std::max(0.0, 0.1 * depthMin + i * stepCm); // there, and as long back
    lossDb_.push_back(static_cast<float>(2.0 * wayCm * c.attenuation * aboveMHz));
  }
}

void BeamDevelopment::Apply(const float* noiseDb, const unsigned char* content, float* value) const
{
  const int count = static_cast<int>(gain_.size());
  ToDb(value, count, black_, greyToDb_, rangeDb_);
  if (shadowPerSample_ > 0.0f || enhancementPerSample_ > 0.0f) {
    float change = 0.0f; // dB, by what the beam has passed
    for (int i = 0; i < count; ++i) {
      if (!content[i])
        continue;
      const float level = 1.0f + value[i] / rangeDb_; // 0 black, 1 white
      value[i] += change;
      change -= shadowPerSample_ * std::max(0.0f, std::min(1.0f, (level - bright_) / (1.0f - bright_)));
      change += enhancementPerSample_ * std::max(0.0f, std::min(1.0f, (dark_ - level) / dark_));
      change = std::max(-mostShadowDb, std::min(mostEnhancementDb, change));
    }
  }
  for (int i = 0; i < count; ++i)
    value[i] -= lossDb_[static_cast<std::size_t>(i)];
  if (noiseDb)
    AddNoise(value, noiseDb, count, noiseMean_, PowerSumTable().data());
  ToGrey(value, gain_.data(), content, count, greyPerDb_);
}

} // namespace echorama
