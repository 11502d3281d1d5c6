// SPDX-License-Identifier: BSD-3-Clause
// In beam space the grain of speckle has the same shape all over the fan, so one autocorrelation along each axis tells it.
//
// 1. (Volumes) Beams are read from the volume by linear interpolation, as many as its voxels support.
// 2. Developed speckle: of the first window that is used the local mean and deviation decide which samples take part.
// 3. Standardise: local mean and deviation from LocalStatistics, whose window is stretched along the axes by its spacing. Samples
//    are replaced by (value - mean) / deviation, and those by the Rayleigh number of the same rank (a histogram of
//    8192 bins). Flat places take no part.
// 4. Correlate: sums of products at lags 1, 2, ... along each axis and in each band of depth, until all fell below one half.
//
// Steps 3 and 4 are done three times: the window follows the lengths that were found, up to the widest. A window of three
// lengths takes 3% of the variance with it, which shortens the lengths by 2%; one of two lengths shortens them by 10%.
#include "NoiseMatch.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/Sampling.h"
#include "Core/Imaging/ScanConversion.h"
#include "Core/Imaging/VoxelTypes.h"
#include "NoiseScores.h"
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <string>

namespace echorama {

ParameterList Describe(NoiseMatchParameters& p)
{
  return {
      Parameter(
          "WindowMm", p.windowMm, {0, Unlimited, true}, "mm",
          "Of the volume to match, what is smooth over so much along the depth, and twice as much across, is the scene and no "
          "grain.")
          .Advanced(),
      Parameter("DepthBands", p.depthBands, {1, 100}, "", "The depth is cut into so many equal parts for the lengths by depth."),
      Parameter("Quantiles", p.quantiles, {2, 65536}, "", "How many quantiles are given."),
  };
}

Eigen::Vector2d SpansHalfway(const ProbeGeometry& geometry)
{
  const double middle = 0.5 * (geometry.depthMin + geometry.depthMax);
  return {std::abs(geometry.Fan().Span(middle)),
          std::abs(geometry.Sweep().Span(geometry.Fan().PointOf({geometry.fanOffset, middle}).y()))};
}

namespace {

constexpr std::ptrdiff_t leastSamples = 1000;
constexpr double most = 24e6;             // samples that are read from a volume
constexpr double windowLengths = 3.0;     // standard deviation of the window, in lengths
constexpr double grainPerLength = 2.1289; // the integral of a Gaussian autocorrelation over all lags, in lengths
constexpr double cut = 5e-4;              // the brightest and darkest specks are the scene's

// The autocorrelation of a Rayleigh distributed envelope whose power has the autocorrelation \a power: a hypergeometric series.
// Source: Middleton, Introduction to Statistical Communication Theory, 1960, section 9.1.
double EnvelopeCorrelation(double power)
{
  double term = 1.0, sum = 0.0;
  for (int n = 1; n <= 60; ++n) {
    const double factor = (n - 1.5) / n;
    term *= factor * factor * power;
    sum += term;
  }
  return sum / (4.0 / Pi - 1.0);
}

// And back.
double PowerCorrelation(double envelope)
{
  double low = 0.0, high = 1.0;
  for (int step = 0; step < 40; ++step) {
    const double middle = 0.5 * (low + high);
    (EnvelopeCorrelation(middle) < envelope ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

// Autocorrelations of the samples in one band of depth: sums of products and of the squares of both.
struct Products {
  double products = 0.0, squares = 0.0;
  std::ptrdiff_t pairs = 0;
};
struct BandProducts {
  std::vector<Products> bands;
  BandProducts& operator+=(const BandProducts& other)
  {
    bands.resize(std::max(bands.size(), other.bands.size()));
    for (std::size_t b = 0; b < other.bands.size(); ++b) {
      bands[b].products += other.bands[b].products;
      bands[b].squares += other.bands[b].squares;
      bands[b].pairs += other.bands[b].pairs;
    }
    return *this;
  }
};

// The samples of a band.
struct Range {
  int begin = 0, end = 0;
};

BandProducts Correlate(VolumeView<const float> scores, const std::vector<Range>& bands, int axis, int lag)
{
  const auto& n = scores.Dimensions();
  const std::ptrdiff_t shift = lag * (axis == 0 ? 1 : axis == 1 ? scores.RowStride() : scores.SliceStride());
  const std::ptrdiff_t rows = static_cast<std::ptrdiff_t>(n[1]) * n[2];
  return ParallelSum<BandProducts>(rows, 256, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    BandProducts sums;
    sums.bands.resize(bands.size());
    for (std::ptrdiff_t row = begin; row < end; ++row) {
      if ((axis == 1 && row % n[1] + lag >= n[1]) || (axis == 2 && row / n[1] + lag >= n[2]))
        continue;
      const float* a = scores.Data() + row * n[0];
      const float* b = a + shift;
      for (std::size_t band = 0; band < bands.size(); ++band) {
        float products = 0.0f, squares = 0.0f; // of a row: few enough for a float
        int pairs = 0;
        const int last = axis == 0 ? std::min(bands[band].end, n[0] - lag) : bands[band].end;
        for (int i = bands[band].begin; i < last; ++i) {
          const float product = a[i] * b[i];
          const bool real = product == product; // neither is NaN
          products += real ? product : 0.0f;
          squares += real ? a[i] * a[i] + b[i] * b[i] : 0.0f;
          pairs += real ? 1 : 0;
        }
        sums.bands[band].products += static_cast<double>(products);
        sums.bands[band].squares += 0.5 * static_cast<double>(squares);
        sums.bands[band].pairs += pairs;
      }
    }
    return sums;
  });
}

// The lag, in samples, at which the autocorrelation of the power is one half, by band; NaN where there are too few pairs.
std::vector<double> HalfLags(VolumeView<const float> scores, const std::vector<Range>& bands, int axis)
{
  const int longest = scores.Dimensions()[static_cast<std::size_t>(axis)] / 3;
  std::vector<double> lags(bands.size(), std::numeric_limits<double>::quiet_NaN());
  std::vector<double> before(bands.size(), 0.0); // -log2 of the correlation at the lag before
  std::vector<bool> open(bands.size(), true);
  for (int lag = 1; lag <= longest && std::find(open.begin(), open.end(), true) != open.end(); ++lag) {
    const BandProducts sums = Correlate(scores, bands, axis, lag);
    for (std::size_t band = 0; band < bands.size(); ++band) {
      if (!open[band])
        continue;
      const Products& s = sums.bands[band];
      if (s.pairs < leastSamples || !(s.squares > 0.0)) {
        open[band] = false;
        continue;
      }
      const double power = PowerCorrelation(std::max(s.products / s.squares, 0.0));
      const double now = -std::log2(std::max(power, 1e-6)), last = before[band];
      if (now >= 1.0) {
        const double from = static_cast<double>(lag - 1) * (lag - 1), to = static_cast<double>(lag) * lag;
        lags[band] = std::sqrt(from + (1.0 - last) / (now - last) * (to - from));
        open[band] = false;
      } else {
        before[band] = std::max(now, last);
        lags[band] = lag; // the grain is at least as long
      }
    }
  }
  return lags;
}

[[noreturn]] void FailForWantOfTexture(const std::string& reason)
{
  throw Error(Error::Kind::NotPossible, "noise match: " + reason + ", which is too little texture to tell a grain from");
}

double& Along(NoiseMatch::Lengths& lengths, std::size_t axis)
{
  return axis == 0 ? lengths.depthMm : axis == 1 ? lengths.fan : lengths.sweep;
}

// The lower median of the bands that resolve the length, by their samples: edges of the scene can only lengthen it. When none
// does, the least of the bounds.
void SetTypical(NoiseMatch& match, std::size_t axis)
{
  std::vector<std::pair<double, double>> resolved; // length, samples
  double all = 0.0, bound = std::numeric_limits<double>::infinity();
  for (NoiseMatch::Band& band : match.bands) {
    const double length = Along(band.lengths, axis);
    if (length > 0.0 && band.lengths.resolved[axis]) {
      resolved.emplace_back(length, static_cast<double>(band.samples));
      all += resolved.back().second;
    } else if (length > 0.0) {
      bound = std::min(bound, length);
    }
  }
  if (resolved.empty() && std::isinf(bound))
    FailForWantOfTexture("no line along the depth, the fan or the sweep has enough real samples");
  match.lengths.resolved[axis] = !resolved.empty();
  std::sort(resolved.begin(), resolved.end());
  double below = 0.0;
  std::size_t at = 0;
  while (at < resolved.size() && (below += resolved[at].second) < 0.5 * all - 1e-6 * all)
    ++at;
  Along(match.lengths, axis) = resolved.empty() ? bound : resolved[at].first;
}

// Of the numbers that are some.
double MeanOf(const std::vector<double>& numbers)
{
  double sum = 0.0, count = 0.0;
  for (const double number : numbers)
    if (std::isfinite(number)) {
      sum += number;
      count += 1.0;
    }
  return count > 0.0 ? sum / count : 0.0;
}

// How much interpolation between voxels has added along each axis of beam space at a depth: variance in samples squared.
using AddedVariance = std::function<Eigen::Vector3d(double depthMm)>;

// \param plain the same samples as they were before interpolation, which takes some of their deviation: for the quantiles
// \param step of the intensities: 1 of whole numbers
NoiseMatch Match(VolumeView<const float> beams, VolumeView<const float> plain, VolumeView<const unsigned char> valid, double step,
                 const ProbeGeometry& geometry, const Eigen::Vector3d& widest, const NoiseMatchParameters& parameters,
                 const AddedVariance& added, const Progress& progress)
{
  const auto& n = beams.Dimensions();
  const int axes = geometry.IsPlane() ? 2 : 3;
  std::vector<Range> ranges;
  for (int b = 0; b < parameters.depthBands; ++b)
    ranges.push_back({n[0] * b / parameters.depthBands, n[0] * (b + 1) / parameters.depthBands});

  NoiseScores scores(beams, valid);
  Eigen::Vector3d window = 0.5 * widest;
  std::optional<LocalStatistics> local;
  const auto standardise = [&window, &local, &n](NoiseScores& some, const Progress& part) {
    for (int axis = 0; axis < 3; ++axis)
      window[axis] = std::min(std::max(window[axis], 2.0), static_cast<double>(n[static_cast<std::size_t>(axis)]));
    some.Standardise(window, local, part);
    if (some.Used() < leastSamples)
      FailForWantOfTexture("only " + std::to_string(some.Used()) + " samples of the fan are real and not flat");
  };
  const double real = scores.Real();
  constexpr int passes = 3;
  for (int pass = 0; pass < passes; ++pass) {
    standardise(scores, progress.Part(0.25 * pass, 0.25 * (pass + 1)));
    if (pass == 0) {
      scores.KeepSpeckle(*local, step);
      if (scores.Used() < leastSamples)
        FailForWantOfTexture("only " + std::to_string(scores.Used()) + " samples of the fan lie in developed speckle");
    }
    scores.Rank();
    for (int axis = 0; axis < axes && pass + 1 < passes; ++axis) {
      const std::vector<double> whole = HalfLags(scores.View(), {{0, n[0]}}, axis);
      if (std::isfinite(whole[0]))
        window[axis] = std::min(windowLengths * whole[0], widest[axis]);
    }
  }
  std::array<std::vector<double>, 3> lags;
  for (int axis = 0; axis < axes; ++axis)
    lags[static_cast<std::size_t>(axis)] = HalfLags(scores.View(), ranges, axis);

  NoiseMatch match;
  match.speckleShare = static_cast<double>(scores.Used()) / real;
  match.grains = static_cast<double>(scores.Used());
  for (int axis = 0; axis < axes; ++axis)
    match.grains /= std::max(1.0, grainPerLength * MeanOf(lags[static_cast<std::size_t>(axis)]));
  NoiseScores values(plain, scores.Valid());
  standardise(values, progress.Part(0.75, 1.0));
  match.mean = values.Mean();
  match.deviation = values.Deviation();
  for (int q = 0; q < parameters.quantiles; ++q) {
    const double probability = static_cast<double>(q) / (parameters.quantiles - 1);
    const double value = match.mean + match.deviation * values.Quantile(std::min(std::max(probability, cut), 1.0 - cut));
    match.quantiles.push_back(std::min(std::max(static_cast<float>(value), values.Least()), values.Greatest()));
  }

  const double perSample[3] = {(geometry.depthMax - geometry.depthMin) / (n[0] - 1), 1.0 / (n[1] - 1),
                               1.0 / std::max(1, n[2] - 1)};
  for (std::size_t b = 0; b < ranges.size(); ++b) {
    NoiseMatch::Band band;
    band.fromMm = geometry.depthMin + ranges[b].begin * perSample[0];
    band.toMm = geometry.depthMin + ranges[b].end * perSample[0];
    const BandProducts used = Correlate(scores.View(), {ranges[b]}, 0, 0);
    band.samples = used.bands[0].pairs;
    const Eigen::Vector3d variance = added(0.5 * (band.fromMm + band.toMm));
    for (int axis = 0; axis < axes; ++axis) {
      const auto at = static_cast<std::size_t>(axis);
      const double lag = lags[at][b];
      if (!std::isfinite(lag))
        continue;
      const double rest = lag * lag - 2.0 * std::log(2.0) * variance[axis];
      band.lengths.resolved[at] = rest > 0.5 * lag * lag;
      Along(band.lengths, at) = perSample[axis] * (band.lengths.resolved[at] ? std::sqrt(rest) : lag);
    }
    match.bands.push_back(band);
  }
  for (int axis = 0; axis < axes; ++axis)
    SetTypical(match, static_cast<std::size_t>(axis));
  return match;
}

// Standard deviations of the window that is as wide as it may be, in samples.
Eigen::Vector3d WidestWindow(const NoiseMatchParameters& p, const ProbeGeometry& geometry, const std::array<int, 3>& n)
{
  const Eigen::Vector2d spans = SpansHalfway(geometry);
  const Eigen::Vector3d sizes(geometry.depthMax - geometry.depthMin, spans[0], geometry.IsPlane() ? 1.0 : spans[1]);
  return p.windowMm * Eigen::Array3d(1.0, 2.0, 2.0) * (Eigen::Array3d(n[0], n[1], n[2]) - 1.0).max(1.0) / sizes.array();
}

// The beams of a volume.
template <class T>
void ReadBeams(const PosedVolume<T>& volume, const ProbeGeometry& geometry, const Pose& probeToWorld, VolumeView<float> beams,
               VolumeView<float> plain, VolumeView<unsigned char> valid, const Progress& progress)
{
  const Sampler<T> sampler(volume.intensity, volume.valid);
  const Eigen::Affine3d toIndex = volume.geometry.WorldToIndex() * Eigen::Affine3d(probeToWorld.matrix());
  const auto& n = beams.Dimensions();
  ParallelFor(n[2], progress, [&](std::ptrdiff_t k) {
    for (int j = 0; j < n[1]; ++j) {
      BeamPoint point;
      point.fan = static_cast<double>(j) / (n[1] - 1) - 0.5;
      point.sweep = n[2] > 1 ? static_cast<double>(k) / (n[2] - 1) - 0.5 : 0.0;
      point.depth = geometry.depthMin;
      const Eigen::Vector3d first = toIndex * PointOf(geometry, point);
      point.depth = geometry.depthMax;
      const Eigen::Vector3d step = (toIndex * PointOf(geometry, point) - first) / (n[0] - 1);
      float* values = beams.Row(j, static_cast<int>(k));
      float* nearest = plain.Row(j, static_cast<int>(k));
      unsigned char* real = valid.Row(j, static_cast<int>(k));
      for (int i = 0; i < n[0]; ++i) {
        const Eigen::Vector3d at = first + step * i;
        double linear = 0.0, voxel = 0.0;
        real[i] = sampler.Linear(at.x(), at.y(), at.z(), linear) && sampler.Nearest(at.x(), at.y(), at.z(), voxel) ? 1 : 0;
        values[i] = static_cast<float>(linear);
        nearest[i] = static_cast<float>(voxel);
      }
    }
  });
}

} // namespace

NoiseMatch MatchBeams(VolumeView<const float> beams, VolumeView<const unsigned char> valid, const ProbeGeometry& geometry,
                      const NoiseMatchParameters& parameters, const Progress& progress)
{
  CheckRanges(parameters);
  CheckBeamVolume(beams.Dimensions(), geometry);
  if (!valid.Empty() && valid.Dimensions() != beams.Dimensions())
    throw Error(Error::Kind::BadInput, "noise match: the valid region does not have the dimensions of the beams");
  return Match(
      beams, beams, valid, 0.0, geometry, WidestWindow(parameters, geometry, beams.Dimensions()), parameters,
      [](double) { return Eigen::Vector3d::Zero().eval(); }, progress);
}

template <class T>
NoiseMatch MatchNoise(const PosedVolume<T>& volume, const ProbeGeometry& geometry, const Pose& probeToWorld,
                      const NoiseMatchParameters& parameters, const Progress& progress)
{
  CheckRanges(parameters);
  geometry.Check();
  volume.geometry.Check("the volume whose noise is to be matched");
  if (!IsRotation(probeToWorld.linear()) || !probeToWorld.translation().allFinite())
    throw Error(Error::Kind::BadInput, "noise match: the pose of the probe is not a rigid transform");
  if (volume.intensity.Dimensions() != volume.geometry.dimensions ||
      (!volume.valid.Empty() && volume.valid.Dimensions() != volume.geometry.dimensions))
    throw Error(Error::Kind::BadInput, "noise match: voxels, valid region and geometry do not agree");

  // As many samples as voxels along each axis, halfway down.
  const Eigen::Vector3d& spacing = volume.geometry.spacing;
  double apart = std::cbrt(spacing.prod());
  if (volume.geometry.dimensions[2] == 1)
    apart = std::sqrt(spacing.x() * spacing.y());
  const Eigen::Vector2d spans = SpansHalfway(geometry);
  const Eigen::Vector3d sizes(geometry.depthMax - geometry.depthMin, spans[0], geometry.IsPlane() ? 0.0 : spans[1]);
  const double all = (sizes / apart).array().max(1.0).prod();
  if (all > most)
    apart *= std::pow(all / most, geometry.IsPlane() ? 0.5 : 1.0 / 3.0);
  const auto count = [apart](double size) { return std::max(2, static_cast<int>(std::min(size / apart, 1e5)) + 1); };
  const std::array<int, 3> n{count(sizes[0]), count(sizes[1]), geometry.IsPlane() ? 1 : count(sizes[2])};
  CheckBeamVolume(n, geometry);
  Volume<float> beams(n), plain(n);
  Volume<unsigned char> valid(n);
  ReadBeams(volume, geometry, probeToWorld, beams.View(), plain.View(), valid.View(), progress.Part(0.0, 0.3));

  // Linear interpolation between voxels adds h^2 / 3, h being the extent of a voxel in the direction of the axis.
  const Eigen::Matrix3d toVoxels = volume.geometry.direction.transpose() * probeToWorld.linear();
  const auto added = [&](double depth) {
    Eigen::Vector3d variance = Eigen::Vector3d::Zero();
    BeamPoint middle;
    middle.depth = depth;
    const Eigen::Vector3d at = PointOf(geometry, middle);
    const double steps[3] = {sizes[0] / (n[0] - 1), 1.0 / (n[1] - 1), n[2] > 1 ? 1.0 / (n[2] - 1) : 0.0};
    for (int axis = 0; axis < (n[2] > 1 ? 3 : 2); ++axis) {
      BeamPoint next = middle;
      (axis == 0 ? next.depth : axis == 1 ? next.fan : next.sweep) += 0.5 * steps[axis];
      const Eigen::Vector3d step = 2.0 * (PointOf(geometry, next) - at); // mm per sample
      const double length = step.norm();
      if (length > 0.0)
        variance[axis] = (toVoxels * step / length).cwiseProduct(spacing).squaredNorm() / (3.0 * length * length);
    }
    return variance;
  };
  return Match(std::as_const(beams).View(), std::as_const(plain).View(), std::as_const(valid).View(),
               std::is_integral_v<T> ? 1.0 : 0.0, geometry, WidestWindow(parameters, geometry, n), parameters, added,
               progress.Part(0.3, 1.0));
}

double GrainOf(const NoiseMatch& match, const ProbeGeometry& measured)
{
  const Eigen::Vector2d spans = SpansHalfway(measured);
  const double area = match.lengths.depthMm * match.lengths.fan * spans[0];
  return measured.IsPlane() ? std::sqrt(area) : std::cbrt(area * match.lengths.sweep * spans[1]);
}

BeamNoiseParameters NoiseLike(const NoiseMatch& match, const ProbeGeometry& measured, const ProbeGeometry& target)
{
  measured.Check();
  target.Check();
  const Eigen::Vector2d from = SpansHalfway(measured), to = SpansHalfway(target);
  const auto scaled = [](double length, double spanFrom, double spanTo) {
    return spanTo > 0.0 ? std::min(length * spanFrom / spanTo, 0.25) : 0.0;
  };
  BeamNoiseParameters p;
  p.intensity = NoiseIntensity::Histogram;
  p.quantiles = match.quantiles;
  p.mean = match.mean;
  p.depthCorrelationMm = std::min(match.lengths.depthMm, 0.25 * (target.depthMax - target.depthMin));
  p.fanCorrelation = scaled(match.lengths.fan, from[0], to[0]);
  p.sweepCorrelation = target.IsPlane() ? 0.0 : scaled(match.lengths.sweep, from[1], to[1]);
  p = ResolvingCounts(p, target);

  // Linear interpolation between samples that correlate by c leaves (2 + c) / 3 of the variance, in the mean over places.
  double left = 1.0;
  const double apart[3] = {1.0 / (p.samples - 1), 1.0 / (p.elements - 1), target.IsPlane() ? 0.0 : 1.0 / (p.steps - 1)};
  const double lengths[3] = {p.depthCorrelationMm / (target.depthMax - target.depthMin), p.fanCorrelation, p.sweepCorrelation};
  for (int axis = 0; axis < (target.IsPlane() ? 2 : 3); ++axis)
    if (lengths[axis] > 0.0)
      left *= (2.0 + EnvelopeCorrelation(std::pow(0.5, std::pow(apart[axis] / lengths[axis], 2.0)))) / 3.0;
  for (float& value : p.quantiles) {
    const double wider = match.mean + (static_cast<double>(value) - match.mean) / std::sqrt(left);
    value = std::max(static_cast<float>(wider), std::min(match.quantiles.front(), 0.0f)); // never newly below 0
  }
  return p;
}

#define EchoramaInstantiate(T)                                                                                                   \
  template NoiseMatch MatchNoise<T>(const PosedVolume<T>&, const ProbeGeometry&, const Pose&, const NoiseMatchParameters&,       \
                                    const Progress&);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
