// SPDX-License-Identifier: BSD-3-Clause
// One row of samples (a beam) after the other, in parallel: noise, envelope, gain and decimation in a buffer of the row,
// then compression. Cost: two logarithms and a sine per sample with noise, one logarithm per grey value.
#include "Receiver.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include <algorithm>
#include <cmath>
#include <string>

namespace echorama {
namespace {

// The mean of 20 log10 of a Rayleigh envelope lies 10 gamma / ln 10 dB (Euler's gamma) below the dB of its mean power.
constexpr double meanLogDb = -2.5068155;

// One output sample: which input samples it weighs.
struct Window {
  int first = 0;
  std::vector<float> weights;
};

class RowDetector {
public:
  RowDetector(const BeamEchoes& echoes, const Receiver& receiver, int samples)
    : echoes_(echoes), receiver_(receiver), count_(echoes.baseband.Dimensions()[0]),
      noise_(receiver.noiseDb > Receiver::noNoiseDb ? std::pow(10.0, 0.05 * receiver.noiseDb) : 0.0)
  {
    const double step = (echoes.probe.depthMax - echoes.probe.depthMin) / (count_ - 1.0);
    for (int i = 0; i < count_; ++i)
      gains_.push_back(static_cast<float>(std::pow(10.0, 0.05 * receiver.GainDbAt(echoes.probe.depthMin + i * step))));
    if (samples == count_)
      return;
    const double stride = (count_ - 1.0) / (samples - 1.0), reach = std::max(stride, 1.0);
    for (int j = 0; j < samples; ++j) {
      const double centre = j * stride;
      Window window;
      window.first = std::max(0, static_cast<int>(std::floor(centre - reach)));
      const int last = std::min(count_ - 1, static_cast<int>(std::ceil(centre + reach)));
      double sum = 0.0;
      for (int i = window.first; i <= last; ++i)
        sum += std::max(0.0, 1.0 - std::abs(i - centre) / reach);
      for (int i = window.first; i <= last; ++i)
        window.weights.push_back(static_cast<float>(std::max(0.0, 1.0 - std::abs(i - centre) / reach) / sum));
      windows_.push_back(window);
    }
  }

  // The envelope of one row; \a fine is a buffer.
  void Detect(int beam, int plane, std::vector<float>& fine, float* envelope) const
  {
    const auto baseband = echoes_.baseband.View();
    const std::complex<float>* samples = baseband.Row(beam, plane);
    const auto row = static_cast<std::uint64_t>(plane) * static_cast<std::uint64_t>(baseband.Dimensions()[1]) +
                     static_cast<std::uint64_t>(beam);
    Random random(receiver_.noiseSeed, row);
    fine.resize(static_cast<std::size_t>(count_));
    for (int i = 0; i < count_; ++i) {
      std::complex<double> value = samples[i];
      if (noise_ > 0.0) {
        // Of a complex Gaussian number, the square of the size is exponentially distributed and the angle uniformly.
        const double size = noise_ * std::sqrt(-std::log1p(-random.Uniform())), angle = 2.0 * Pi * random.Uniform();
        value += std::complex<double>(size * std::cos(angle), size * std::sin(angle));
      }
      const auto k = static_cast<std::size_t>(i);
      fine[k] = gains_[k] * static_cast<float>(std::sqrt(std::norm(value)));
    }
    if (windows_.empty()) {
      std::copy(fine.begin(), fine.end(), envelope);
      return;
    }
    for (std::size_t j = 0; j < windows_.size(); ++j) {
      float sum = 0.0f;
      for (std::size_t i = 0; i < windows_[j].weights.size(); ++i)
        sum += windows_[j].weights[i] * fine[static_cast<std::size_t>(windows_[j].first) + i];
      envelope[j] = sum;
    }
  }

private:
  const BeamEchoes& echoes_;
  const Receiver& receiver_;
  int count_;
  double noise_;
  std::vector<float> gains_;
  std::vector<Window> windows_; // empty: as many samples out as in
};

void CheckViews(const BeamEchoes& echoes, const Receiver& receiver, const std::array<int, 3>& out)
{
  receiver.Check();
  const std::array<int, 3>& in = echoes.baseband.Dimensions();
  if (in[0] < 2 || out[0] < 2 || in[1] != out[1] || in[2] != out[2])
    throw Error(Error::Kind::BadInput, "receiver: " + std::to_string(out[0]) + " x " + std::to_string(out[1]) + " x " +
                                           std::to_string(out[2]) + " grey values do not go with " + std::to_string(in[0]) +
                                           " x " + std::to_string(in[1]) + " x " + std::to_string(in[2]) +
                                           " echoes; beams and planes must agree, and 2 samples of depth are the least");
}

// Calls store(row of envelopes, beam, plane) for every row.
template <class Store>
void DetectRows(const BeamEchoes& echoes, const Receiver& receiver, int samples, const Progress& progress, const Store& store)
{
  const RowDetector detector(echoes, receiver, samples);
  const auto& size = echoes.baseband.Dimensions();
  ParallelRanges(static_cast<std::ptrdiff_t>(size[1]) * size[2], 16, progress, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::vector<float> fine, envelope(static_cast<std::size_t>(samples));
    for (std::ptrdiff_t row = begin; row < end; ++row) {
      const int beam = static_cast<int>(row % size[1]), plane = static_cast<int>(row / size[1]);
      detector.Detect(beam, plane, fine, envelope.data());
      store(envelope, beam, plane);
    }
  });
}

} // namespace

ParameterList Describe(Receiver::GainPoint& p)
{
  return {Parameter("DepthMm", p.depthMm, {-1000, 10000}, "mm", "Scan depth; it rises from point to point."),
          Parameter("GainDb", p.gainDb, {-200, 200}, "dB", "Further gain at that depth.")};
}

ParameterList Describe(Receiver& r)
{
  return {
      Parameter("GainDb", r.gainDb, {-200, 200}, "dB", "Gain of everything."),
      Parameter("TgcDbPerCm", r.tgcDbPerCm, {-20, 100}, "dB/cm", "Time-gain compensation: further gain by the depth."),
      Parameter("DynamicRangeDb", r.dynamicRangeDb, {10, 200}, "dB", "How much the 255 steps of grey span."),
      Parameter("ReferenceGrey", r.referenceGrey, {0, 255}, "", "Mean grey of the reference tissue, liver, at a gain of 0 dB."),
      Parameter("NoiseDb", r.noiseDb, {Receiver::noNoiseDb, 100}, "dB",
                "Mean power of the noise of the electronics beside the reference tissue, before all gain; -200: none."),
      Parameter("NoiseSeed", r.noiseSeed, {0, 9223372036854775807.0}, "",
                "Seed of the noise. Volumes of one scan have different ones."),
  };
}

void Receiver::Check() const
{
  CheckRanges(*this);
  for (std::size_t i = 0; i < tgcPoints.size(); ++i) {
    const std::string name = "TgcPoints[" + std::to_string(i) + "]";
    CheckRanges(tgcPoints[i], name);
    if (i > 0 && !(tgcPoints[i].depthMm > tgcPoints[i - 1].depthMm))
      throw Error(Error::Kind::InvalidParameter, name + ": DepthMm is " + NumberText(tgcPoints[i].depthMm) +
                                                     " mm; it must be greater than that of the point before it");
  }
}

double Receiver::GainDbAt(double depthMm) const
{
  double gain = gainDb + 0.1 * tgcDbPerCm * std::max(depthMm, 0.0);
  if (tgcPoints.empty())
    return gain;
  const auto next = std::upper_bound(tgcPoints.begin(), tgcPoints.end(), depthMm,
                                     [](double depth, const GainPoint& point) { return depth < point.depthMm; });
  if (next == tgcPoints.begin())
    return gain + tgcPoints.front().gainDb;
  if (next == tgcPoints.end())
    return gain + tgcPoints.back().gainDb;
  const GainPoint &a = *(next - 1), &b = *next;
  return gain + a.gainDb + (b.gainDb - a.gainDb) * (depthMm - a.depthMm) / (b.depthMm - a.depthMm);
}

void DetectEnvelope(const BeamEchoes& echoes, const Receiver& receiver, VolumeView<float> envelope, const Progress& progress)
{
  CheckViews(echoes, receiver, envelope.Dimensions());
  DetectRows(echoes, receiver, envelope.Dimensions()[0], progress, [&](const std::vector<float>& row, int beam, int plane) {
    std::copy(row.begin(), row.end(), envelope.Row(beam, plane));
  });
}

void DetectEchoes(const BeamEchoes& echoes, const Receiver& receiver, VolumeView<unsigned char> beams, const Progress& progress)
{
  CheckViews(echoes, receiver, beams.Dimensions());
  const double greyPerDb = 255.0 / receiver.dynamicRangeDb;
  const double offset = receiver.referenceGrey - greyPerDb * meanLogDb;
  DetectRows(echoes, receiver, beams.Dimensions()[0], progress, [&](const std::vector<float>& row, int beam, int plane) {
    unsigned char* out = beams.Row(beam, plane);
    for (const float envelope : row) {
      const double grey = envelope > 0.0f ? offset + greyPerDb * 20.0 * std::log10(static_cast<double>(envelope)) : 0.0;
      *out++ = static_cast<unsigned char>(std::clamp(grey, 0.0, 255.0) + 0.5);
    }
  });
}

} // namespace echorama
