// SPDX-License-Identifier: BSD-3-Clause
// One row of samples (a beam) after the other, in parallel: noise, envelope, gain and decimation in a buffer of the row,
// then compression. Noise is made in vectors of single precision (3e-7 of itself; the numbers are those of Random). Cost: a
// logarithm per grey value, and some 10 ns per sample with noise.
#include "Receiver.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include "RandomBlocks.h"
#include "VectorMath.h"
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

constexpr int noiseBatch = 64;

// The envelope of samples with noise of power noise^2, which is that of a row's samples from \a first on.
void DetectWithNoise(const std::complex<float>* samples, std::uint64_t seed, std::uint64_t row, std::uint32_t first, int count,
                     float noise, float* envelope)
{
  std::uint32_t bits[4][noiseBatch];
  for (int i = 0; i < noiseBatch; ++i) { // Random(seed, row): a block of four words for every sample
    bits[0][i] = first + static_cast<std::uint32_t>(i);
    bits[1][i] = 0;
    bits[2][i] = static_cast<std::uint32_t>(row);
    bits[3][i] = static_cast<std::uint32_t>(row >> 32);
  }
  RandomBlocks(bits, {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)});
  float re[noiseBatch], im[noiseBatch];
  const auto uniform = [](std::uint32_t high, std::uint32_t low) { // as Random::Uniform()
    return (static_cast<std::int32_t>(high >> 5) * 67108864.0 + static_cast<std::int32_t>(low >> 6)) / 9007199254740992.0;
  };
  for (int i = 0; i < noiseBatch; ++i) {
    // Of a complex Gaussian number, the square of the size is exponentially distributed and the angle uniformly.
    const float size = noise * std::sqrt(MinusLogOfRest(uniform(bits[0][i], bits[1][i])));
    float cosine, sine;
    CosineAndSine(static_cast<float>(uniform(bits[2][i], bits[3][i])), cosine, sine);
    re[i] = size * cosine;
    im[i] = size * sine;
  }
  for (int i = 0; i < count; ++i) {
    const float x = samples[i].real() + re[i], y = samples[i].imag() + im[i];
    envelope[i] = std::sqrt(x * x + y * y);
  }
}

class RowDetector {
public:
  RowDetector(const BeamEchoes& echoes, const Receiver& receiver, int samples)
    : echoes_(echoes), receiver_(receiver), count_(echoes.baseband.Dimensions()[0]),
      noise_(receiver.noiseDb > Receiver::noNoiseDb ? static_cast<float>(std::pow(10.0, 0.05 * receiver.noiseDb)) : 0.0f)
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
    fine.resize(static_cast<std::size_t>(count_));
    if (noise_ > 0.0f)
      for (int i = 0; i < count_; i += noiseBatch)
        DetectWithNoise(samples + i, receiver_.noiseSeed, row, static_cast<std::uint32_t>(i), std::min(noiseBatch, count_ - i),
                        noise_, fine.data() + i);
    else
      for (int i = 0; i < count_; ++i)
        fine[static_cast<std::size_t>(i)] = static_cast<float>(std::sqrt(std::norm(std::complex<double>(samples[i]))));
    for (std::size_t i = 0; i < fine.size(); ++i)
      fine[i] *= gains_[i];
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
  float noise_;
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
