// SPDX-License-Identifier: BSD-3-Clause
// White complex Gaussian noise is made and filtered in two passes over the sweep:
//
// 1. Per plane: each row of white noise (Philox words through Box-Muller in float, logarithm and sine by polynomials, so
//    that the vector units do all of it) is filtered along the depth as soon as it is made, and then the plane across the fan.
// 2. Per element: the planes are filtered along the sweep, and the envelope goes through a table to intensities.
//
// The white noise goes on beyond the volume by the radius of the filter, whose taps have the sum of squares 1: the field has
// unit variance everywhere and no edge. A word's place in the random stream is given by the place of its sample alone, so the
// same seed with other lengths is the same noise, smoother. Every distribution is one increasing curve over the Rayleigh
// distributed envelope, tabulated at 16384 nodes.
#include "BeamNoise.h"
#include "Core/Base/CheckRange.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Base/ZeroedMemory.h"
#include "Core/Imaging/ScanConversion.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

namespace echorama {

ParameterList Describe(BeamNoiseParameters& p)
{
  return {
      Parameter(
          "IntensityModel", Choice(p.intensity, {"rayleigh", "log-compressed"}),
          "How intensities are distributed: as the envelope of speckle, or as the greys of a machine. A volume to match brings "
          "its own distribution."),
      Parameter("Mean", p.mean, {0, Unlimited, true}, "", "Mean of the intensities; below 255 when they are log-compressed."),
      Parameter("DynamicRangeDb", p.dynamicRangeDb, {10, 200}, "dB",
                "How much 255 greys span. With 60 dB the deviation is 24 greys where nothing is cut.")
          .When("IntensityModel", "log-compressed"),
      Parameter("Seed", p.seed, {0, 9223372036854775807.0}, "", "The same seed makes the same noise."),
      Parameter("Samples", p.samples, {2, 100000}, "", "Samples along each beam."),
      Parameter("Elements", p.elements, {2, 100000}, "", "Beams across the fan."),
      Parameter("Steps", p.steps, {2, 100000}, "", "Planes of the sweep."),
      Parameter(
          "DepthCorrelationMm", p.depthCorrelationMm, {0, 10000}, "mm",
          "Size of the grain along the depth, at most a quarter of the depth range: the lag at which the autocorrelation of the "
          "speckle's power is one half. 0: neighbouring samples are independent. A volume to match brings its own."),
      Parameter("FanCorrelation", p.fanCorrelation, {0, 0.25}, "whole fans", "The same across the fan."),
      Parameter("SweepCorrelation", p.sweepCorrelation, {0, 0.25}, "whole sweeps", "The same along the sweep."),
  };
}

namespace {

// From the length at which the power's correlation exp(-lag^2 / (2 sigma^2)) is one half to the deviation of the filter.
constexpr double sigmaPerLength = 0.8493218002880191; // 1 / sqrt(2 ln 2)

// Where sample 0 lies in the random stream of its row, and row 0 among the rows: beyond any radius.
constexpr std::int64_t streamOrigin = std::int64_t{1} << 30;

// ln(x) for positive normal x, to 2e-7: the exponent, and the series of artanh for the rest.
inline __attribute__((always_inline)) float Logarithm(float x)
{
  std::int32_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  const std::int32_t exponent = (bits - 0x3f3504f3) >> 23; // so that the rest lies between sqrt(1/2) and sqrt(2)
  bits -= exponent * (1 << 23);
  float rest;
  std::memcpy(&rest, &bits, sizeof rest);
  const float s = (rest - 1.0f) / (rest + 1.0f), z = s * s;
  const float series = 2.0f * s * (1.0f + z * (0.333333333f + z * (0.2f + z * (0.142857143f + z * 0.111111111f))));
  return series + 0.69314718f * static_cast<float>(exponent);
}

// sin(2 pi x) for |x| <= 1/4, to 2e-7.
inline __attribute__((always_inline)) float SineOfTurn(float x)
{
  const float y = 6.28318531f * x, z = y * y;
  return y * (1.0f +
              z * (-1.66666667e-1f + z * (8.33333333e-3f + z * (-1.98412698e-4f + z * (2.75573192e-6f + z * -2.50521084e-8f)))));
}

// The words of the samples from 2 * first on: radius and turn of each.
void Words(std::uint64_t seed, std::uint64_t item, std::uint64_t first, int blocks, std::int32_t* __restrict radius,
           std::int32_t* __restrict turn)
{
  const std::array<std::uint32_t, 2> key{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)};
  const auto low = static_cast<std::uint32_t>(item), high = static_cast<std::uint32_t>(item >> 32);
  for (int b = 0; b < blocks; ++b) {
    const auto words = Random::Block({static_cast<std::uint32_t>(first) + static_cast<std::uint32_t>(b), 0u, low, high}, key);
    radius[2 * b] = static_cast<std::int32_t>(words[0] >> 1);
    turn[2 * b] = static_cast<std::int32_t>(words[1]);
    radius[2 * b + 1] = static_cast<std::int32_t>(words[2] >> 1);
    turn[2 * b + 1] = static_cast<std::int32_t>(words[3]);
  }
}

// Box-Muller: two independent standard normals from each pair of words.
void Normals(const std::int32_t* __restrict radius, const std::int32_t* __restrict turn, int count, float* __restrict real,
             float* __restrict imaginary)
{
  for (int i = 0; i < count; ++i) {
    const float uniform = (static_cast<float>(radius[i]) + 0.5f) * 4.6566129e-10f; // (0, 1]
    const float power = -2.0f * Logarithm(uniform);
    const float length = std::sqrt(power > 0.0f ? power : 0.0f);
    const float t = static_cast<float>(turn[i]) * 2.3283064e-10f, at = std::fabs(t); // -1/2 ... 1/2 of a turn
    const float sine = SineOfTurn(at < 0.25f ? at : 0.5f - at);
    real[i] = length * SineOfTurn(0.25f - at);
    imaginary[i] = t < 0.0f ? -length * sine : length * sine;
  }
}

// Eight floats, from anywhere in memory.
using Lane = float __attribute__((vector_size(32)));

// sum += weight * (a + b), and the reverse. (By reference: how eight floats are passed by value depends on the instruction set.)
[[gnu::always_inline]] inline void Add(Lane& sum, float weight, const float* a, const float* b)
{
  Lane first, second;
  std::memcpy(&first, a, sizeof first);
  std::memcpy(&second, b, sizeof second);
  sum += weight * (first + second);
}

[[gnu::always_inline]] inline void Store(const Lane& lane, float* to)
{
  std::memcpy(to, &lane, sizeof lane);
}

// out = sum of weights[t] * rows[t], the weights being symmetric: 32 numbers at a time, whose sums stay in registers.
void WeightedSum(const float* const* rows, const float* weights, int taps, int count, float* __restrict out)
{
  constexpr int piece = 32;
  const int middle = taps / 2;
  if (count < piece) {
    for (int i = 0; i < count; ++i) {
      float sum = weights[middle] * rows[middle][i];
      for (int t = 0; t < middle; ++t)
        sum += weights[t] * (rows[t][i] + rows[taps - 1 - t][i]);
      out[i] = sum;
    }
    return;
  }
  for (int next = 0; next < count; next += piece) {
    const int begin = next + piece <= count ? next : count - piece; // the last piece may overlap the one before
    const float* m = rows[middle] + begin;
    Lane s0{}, s1{}, s2{}, s3{};
    Add(s0, 0.5f * weights[middle], m, m);
    Add(s1, 0.5f * weights[middle], m + 8, m + 8);
    Add(s2, 0.5f * weights[middle], m + 16, m + 16);
    Add(s3, 0.5f * weights[middle], m + 24, m + 24);
    for (int t = 0; t < middle; ++t) {
      const float *a = rows[t] + begin, *b = rows[taps - 1 - t] + begin;
      Add(s0, weights[t], a, b);
      Add(s1, weights[t], a + 8, b + 8);
      Add(s2, weights[t], a + 16, b + 16);
      Add(s3, weights[t], a + 24, b + 24);
    }
    Store(s0, out + begin);
    Store(s1, out + begin + 8);
    Store(s2, out + begin + 16);
    Store(s3, out + begin + 24);
  }
}

// The intensities of a row of complex samples.
void Develop(const float* __restrict real, const float* __restrict imaginary, int count, const float* __restrict table,
             float nodesPerUnit, int last, float* __restrict out)
{
  for (int i = 0; i < count; ++i) {
    const float at = std::sqrt(real[i] * real[i] + imaginary[i] * imaginary[i]) * nodesPerUnit;
    const int before = static_cast<int>(at < static_cast<float>(last - 1) ? at : static_cast<float>(last - 1));
    const float rest = at - static_cast<float>(before), share = rest < 1.0f ? rest : 1.0f;
    out[i] = table[before] + share * (table[before + 1] - table[before]);
  }
}

// A Gaussian filter for white noise: odd, symmetric, the sum of squares is 1.
std::vector<float> PointSpread(double length)
{
  const double sigma = sigmaPerLength * length;
  const int radius = static_cast<int>(std::ceil(3.5 * sigma));
  std::vector<double> taps(static_cast<std::size_t>(2 * radius + 1), 1.0);
  double squares = 0.0;
  for (int t = -radius; t <= radius; ++t) {
    double& tap = taps[static_cast<std::size_t>(t + radius)];
    tap = t == 0 ? 1.0 : std::exp(-0.5 * t * t / (sigma * sigma));
    squares += tap * tap;
  }
  std::vector<float> weights;
  for (double tap : taps)
    weights.push_back(static_cast<float>(tap / std::sqrt(squares)));
  return weights;
}

// The filters along depth, fan and sweep, for \a all samples, beams and steps.
std::array<std::vector<float>, 3> PointSpreads(const BeamNoiseParameters& parameters, const ProbeGeometry& geometry,
                                               const std::array<int, 3>& all)
{
  return {PointSpread(parameters.depthCorrelationMm / (geometry.depthMax - geometry.depthMin) * (all[0] - 1)),
          PointSpread(parameters.fanCorrelation * (all[1] - 1)), PointSpread(parameters.sweepCorrelation * (all[2] - 1))};
}

int RadiusOf(const std::vector<float>& taps)
{
  return static_cast<int>(taps.size() / 2);
}

// What stands for an envelope: a table of the increasing curve from the envelope of unit normals to intensities.
class Development {
public:
  explicit Development(const BeamNoiseParameters& parameters) : table_(nodes)
  {
    const double offset = parameters.intensity == NoiseIntensity::LogCompressed ? LogOffset(parameters) : 0.0;
    for (int node = 0; node < nodes; ++node)
      table_[static_cast<std::size_t>(node)] = static_cast<float>(Curve(parameters, offset, node * largest / (nodes - 1)));
  }

  void Row(const float* real, const float* imaginary, int count, float* out) const
  {
    Develop(real, imaginary, count, table_.data(), static_cast<float>((nodes - 1) / largest), nodes - 1, out);
  }

private:
  static constexpr int nodes = 16384;
  static constexpr double largest = 7.0; // exceeded by 2e-11 of all samples, which become the greatest intensity

  static double Curve(const BeamNoiseParameters& p, double offset, double envelope)
  {
    if (p.intensity == NoiseIntensity::Rayleigh)
      return p.mean * envelope / 1.2533141373155003; // sqrt(pi / 2)
    if (p.intensity == NoiseIntensity::LogCompressed)
      return LogGrey(p, offset, envelope);
    const double at = -std::expm1(-0.5 * envelope * envelope) * static_cast<double>(p.quantiles.size() - 1);
    const std::size_t before = std::min(static_cast<std::size_t>(at), p.quantiles.size() - 2);
    const double low = p.quantiles[before], high = p.quantiles[before + 1];
    return low + (at - static_cast<double>(before)) * (high - low);
  }

  static double LogGrey(const BeamNoiseParameters& p, double offset, double envelope)
  {
    const double grey = offset + 255.0 / p.dynamicRangeDb * 20.0 * std::log10(std::max(envelope, 1e-9));
    return std::min(std::max(grey, 0.0), 255.0);
  }

  // The grey of an envelope of 1 for which the mean, after greys are cut at 0 and 255, is the one that was asked for.
  static double LogOffset(const BeamNoiseParameters& p)
  {
    constexpr int quantiles = 2000;
    std::vector<double> envelopes(quantiles);
    for (int i = 0; i < quantiles; ++i)
      envelopes[static_cast<std::size_t>(i)] = std::sqrt(-2.0 * std::log1p(-(i + 0.5) / quantiles));
    double low = -1e4, high = 1e4;
    for (int step = 0; step < 50; ++step) {
      const double middle = 0.5 * (low + high);
      double sum = 0.0;
      for (double envelope : envelopes)
        sum += LogGrey(p, middle, envelope);
      (sum < p.mean * quantiles ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }

  std::vector<float> table_;
};

void Check(const BeamNoiseParameters& p, const ProbeGeometry& geometry)
{
  geometry.Check();
  const auto fail = [](const std::string& reason) { throw Error(Error::Kind::InvalidParameter, "noise: " + reason); };
  BeamNoiseParameters described = p;
  if (geometry.IsPlane())
    described.steps = 2;                          // it has one, whatever is said
  if (p.intensity == NoiseIntensity::Histogram) { // the quantiles say it
    described.intensity = NoiseIntensity::Rayleigh;
    described.mean = described.dynamicRangeDb = 100.0;
  }
  CheckRanges(described);
  CheckRange("DepthCorrelationMm", p.depthCorrelationMm, 0.0, 0.25 * (geometry.depthMax - geometry.depthMin));
  if (p.intensity == NoiseIntensity::LogCompressed && !(p.mean < 255.0))
    fail("Mean is " + NumberText(p.mean) + "; that of greys must be below 255");
  if (p.intensity == NoiseIntensity::Histogram) {
    if (p.quantiles.size() < 2)
      fail("quantiles has " + std::to_string(p.quantiles.size()) + " values; at least 2 are needed");
    for (std::size_t i = 0; i < p.quantiles.size(); ++i)
      if (!std::isfinite(p.quantiles[i]) || (i > 0 && p.quantiles[i] < p.quantiles[i - 1]))
        fail("quantiles are not finite numbers in ascending order");
  }
}

// The real and the imaginary part of a row or of many.
struct Field {
  explicit Field(std::size_t count) : real(count), imaginary(count) {}
  Zeroed<float> real, imaginary;
};

// Filters across rows that lie \a stride apart, the first of the taps at \a first.
void FilterRows(const Field& in, std::ptrdiff_t first, std::ptrdiff_t stride, const std::vector<float>& weights, int count,
                float* real, float* imaginary)
{
  const int taps = static_cast<int>(weights.size());
  std::vector<const float*> rows(weights.size());
  for (const auto& [from, to] : {std::pair{in.real.data(), real}, std::pair{in.imaginary.data(), imaginary}}) {
    for (int t = 0; t < taps; ++t)
      rows[static_cast<std::size_t>(t)] = from + first + t * stride;
    WeightedSum(rows.data(), weights.data(), taps, count, to);
  }
}

} // namespace

std::array<int, 3> BeamNoiseSize(const BeamNoiseParameters& parameters, const ProbeGeometry& geometry)
{
  return {parameters.samples, parameters.elements, geometry.IsPlane() ? 1 : parameters.steps};
}

std::array<int, 3> BeamNoiseReach(const BeamNoiseParameters& parameters, const ProbeGeometry& geometry)
{
  const auto spreads = PointSpreads(parameters, geometry, BeamNoiseSize(parameters, geometry));
  return {RadiusOf(spreads[0]), RadiusOf(spreads[1]), RadiusOf(spreads[2])};
}

Volume<float> MakeBeamNoise(const BeamNoiseParameters& parameters, const ProbeGeometry& geometry, const Progress& progress)
{
  Check(parameters, geometry);
  const std::array<int, 3> size = BeamNoiseSize(parameters, geometry);
  CheckBeamVolume(size, geometry);
  return MakeBeamNoise(parameters, geometry, {0, 0, 0}, size, progress);
}

Volume<float> MakeBeamNoise(const BeamNoiseParameters& parameters, const ProbeGeometry& geometry, const std::array<int, 3>& first,
                            const std::array<int, 3>& size, const Progress& progress)
{
  Check(parameters, geometry);
  const std::array<int, 3> all = BeamNoiseSize(parameters, geometry);
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (first[axis] < 0 || size[axis] < 1 || first[axis] > all[axis] - size[axis])
      throw Error(Error::Kind::BadInput, "noise: the part that is asked for is not one of the whole");
  const int samples = size[0], elements = size[1], steps = size[2];
  const auto spreads = PointSpreads(parameters, geometry, all);
  const std::vector<float>&alongDepth = spreads[0], &acrossFan = spreads[1], &alongSweep = spreads[2];
  const int depthRadius = RadiusOf(alongDepth), fanRadius = RadiusOf(acrossFan), sweepRadius = RadiusOf(alongSweep);
  const Development development(parameters);

  const std::ptrdiff_t planeSize = static_cast<std::ptrdiff_t>(samples) * elements;
  const int planes = steps + 2 * sweepRadius;
  Field field(static_cast<std::size_t>(planeSize) * static_cast<std::size_t>(planes));
  ParallelFor(planes, progress.Part(0.0, 0.7), [&](std::ptrdiff_t plane) {
    // Blocks of random numbers serve two samples, so the row begins at an even one.
    const int before = depthRadius + std::abs(first[0] - depthRadius) % 2;
    const int blocks = (before + samples + depthRadius + 1) / 2;
    const int rows = elements + 2 * fanRadius;
    std::vector<std::int32_t> radiusWords(static_cast<std::size_t>(2 * blocks)), turnWords(radiusWords.size());
    Field white(radiusWords.size());
    Field filtered(static_cast<std::size_t>(rows) * static_cast<std::size_t>(samples));
    for (int row = 0; row < rows; ++row) {
      const std::uint64_t item = static_cast<std::uint64_t>(plane + first[2] - sweepRadius + streamOrigin) << 32 |
                                 static_cast<std::uint64_t>(row + first[1] - fanRadius + streamOrigin);
      Words(parameters.seed, item, static_cast<std::uint64_t>((streamOrigin + first[0] - before) / 2), blocks, radiusWords.data(),
            turnWords.data());
      Normals(radiusWords.data(), turnWords.data(), 2 * blocks, white.real.data(), white.imaginary.data());
      const std::ptrdiff_t to = static_cast<std::ptrdiff_t>(row) * samples;
      FilterRows(white, before - depthRadius, 1, alongDepth, samples, filtered.real.data() + to, filtered.imaginary.data() + to);
    }
    for (int element = 0; element < elements; ++element) {
      const std::ptrdiff_t from = static_cast<std::ptrdiff_t>(element) * samples, to = planeSize * plane + from;
      FilterRows(filtered, from, samples, acrossFan, samples, field.real.data() + to, field.imaginary.data() + to);
    }
  });

  Volume<float> noise({samples, elements, steps});
  const VolumeView<float> view = noise.View();
  ParallelFor(elements, progress.Part(0.7, 1.0), [&](std::ptrdiff_t element) {
    Field row(static_cast<std::size_t>(samples));
    for (int step = 0; step < steps; ++step) {
      FilterRows(field, planeSize * step + element * samples, planeSize, alongSweep, samples, row.real.data(),
                 row.imaginary.data());
      development.Row(row.real.data(), row.imaginary.data(), samples, view.Row(static_cast<int>(element), step));
    }
  });
  return noise;
}

BeamNoiseParameters ResolvingCounts(BeamNoiseParameters parameters, const ProbeGeometry& geometry, double perLength,
                                    double maximumSamples)
{
  geometry.Check();
  if (geometry.IsPlane())
    parameters.steps = 1;
  const auto resolve = [perLength](double length, int& count) {
    if (length > 0.0)
      count = static_cast<int>(std::min(std::ceil(perLength / length) + 1.0, 1e6));
  };
  resolve(parameters.depthCorrelationMm / (geometry.depthMax - geometry.depthMin), parameters.samples);
  resolve(parameters.fanCorrelation, parameters.elements);
  if (!geometry.IsPlane())
    resolve(parameters.sweepCorrelation, parameters.steps);
  const double all = static_cast<double>(parameters.samples) * parameters.elements * parameters.steps;
  if (all > maximumSamples) {
    const double factor = geometry.IsPlane() ? std::sqrt(maximumSamples / all) : std::cbrt(maximumSamples / all);
    for (int* count : {&parameters.samples, &parameters.elements, &parameters.steps})
      *count = std::max(2, static_cast<int>(*count * factor));
  }
  if (geometry.IsPlane())
    parameters.steps = 1;
  return parameters;
}

} // namespace echorama
