// SPDX-License-Identifier: BSD-3-Clause
// Per pair of volumes, from at most some ten thousand shared voxels (x in one, y in the other):
//   1. a robust start: the slope s for which y / sqrt(s) - x sqrt(s) spreads least about its median. Its variance would be
//      least at the ratio of the standard deviations, in either direction alike; its median is not moved by a minority in shadow.
//   2. voxels further than three standard deviations off are left out, slope and centre are found again from moments, and so on.
// Then two small least-squares problems over the graph of pairs: log gains, and, with these, offsets. The mean of each
// connected group is fixed; what is contradicted by more than a hundredth counts by its size, not its square (Huber).
#include "StitchGain.h"
#include "Core/Base/Error.h"
#include "Core/Base/SymmetricMatrix.h"
#include <algorithm>
#include <cmath>
#include <numeric>

namespace echorama {

namespace {

constexpr std::ptrdiff_t samplesOfPair = 40000, samplesOfMedian = 2000, leastShared = 27;
constexpr float leastTrust = 0.05f;
constexpr double leastCorrelation = 0.3, largestLogGain = 1.3862943611198906; // a factor of 4

struct Sample {
  float x, y, weight;
};

// Weighted means, variances and covariance.
struct Moments {
  double weight = 0.0, x = 0.0, y = 0.0, xx = 0.0, yy = 0.0, xy = 0.0;

  template <class Use>
  static Moments Of(const std::vector<Sample>& samples, const Use& use)
  {
    Moments m;
    for (const Sample& s : samples)
      if (use(s)) {
        m.weight += s.weight;
        m.x += double{s.weight} * s.x;
        m.y += double{s.weight} * s.y;
      }
    if (m.weight <= 0.0)
      return m;
    m.x /= m.weight;
    m.y /= m.weight;
    for (const Sample& s : samples)
      if (use(s)) {
        const double dx = s.x - m.x, dy = s.y - m.y;
        m.xx += s.weight * dx * dx;
        m.yy += s.weight * dy * dy;
        m.xy += s.weight * dx * dy;
      }
    m.xx /= m.weight;
    m.yy /= m.weight;
    m.xy /= m.weight;
    return m;
  }
  static Moments Of(const std::vector<Sample>& samples)
  {
    return Of(samples, [](const Sample&) { return true; });
  }

  // Rounding of the values themselves is no contrast.
  bool Constant() const { return xx <= 1e-10 * (x * x + 1e-20) || yy <= 1e-10 * (y * y + 1e-20); }
  double Correlation() const { return Constant() ? 0.0 : xy / std::sqrt(xx * yy); }
};

// What a pair shares: smooth parts, and details (value - low).
struct Shared {
  std::vector<Sample> smooth, details;
};

bool Finite(const Sample& s)
{
  return std::isfinite(s.x) && std::isfinite(s.y);
}

// Runs body(ia, ib, j, k) for the voxels of a pair that are looked at, ia and ib counted within the rows of a and b: of those
// that both share every so many, another phase in every row, so that no row, plane or box loses more than its share.
template <class Body>
void ForSamples(const CoarseVolume& a, const CoarseVolume& b, const Body& body)
{
  const GridBox both = a.inside.box.Intersected(b.inside.box);
  if (both.Empty())
    return;
  const int shiftA = both.first[0] - a.inside.box.first[0], shiftB = both.first[0] - b.inside.box.first[0];
  const auto forRows = [&](const auto& row) {
    for (int k = both.first[2]; k < both.first[2] + both.size[2]; ++k)
      for (int j = both.first[1]; j < both.first[1] + both.size[1]; ++j)
        row(j, k, a.inside.Row(j, k) + shiftA, b.inside.Row(j, k) + shiftB);
  };
  std::ptrdiff_t count = 0;
  forRows([&](int, int, const unsigned char* insideA, const unsigned char* insideB) {
    int shared = 0;
    for (int i = 0; i < both.size[0]; ++i)
      shared += insideA[i] & insideB[i] & 1;
    count += shared;
  });
  const std::ptrdiff_t every = std::max<std::ptrdiff_t>(1, count / samplesOfPair);
  forRows([&](int j, int k, const unsigned char* insideA, const unsigned char* insideB) {
    const std::ptrdiff_t phase = (41 * static_cast<std::ptrdiff_t>(j) + 1009 * static_cast<std::ptrdiff_t>(k)) % every;
    for (std::ptrdiff_t i = phase == 0 ? 0 : every - phase; i < both.size[0]; i += every)
      if (insideA[i] & insideB[i] & 1)
        body(shiftA + i, shiftB + i, j, k);
  });
}

Shared SharedVoxels(const CoarseVolume& a, const CoarseVolume& b)
{
  Shared shared;
  ForSamples(a, b, [&](std::ptrdiff_t ia, std::ptrdiff_t ib, int j, int k) {
    const float trust =
        (a.trust.box.Empty() ? 1.0f : a.trust.Row(j, k)[ia]) * (b.trust.box.Empty() ? 1.0f : b.trust.Row(j, k)[ib]);
    if (!(trust >= leastTrust))
      return;
    const float lowA = a.low.Row(j, k)[ia], lowB = b.low.Row(j, k)[ib];
    const Sample smooth{lowA, lowB, trust}, detail{a.value.Row(j, k)[ia] - lowA, b.value.Row(j, k)[ib] - lowB, trust};
    if (Finite(smooth) && Finite(detail)) {
      shared.smooth.push_back(smooth);
      shared.details.push_back(detail);
    }
  });
  return shared;
}

// The weighted median of (value, weight); sorts them.
double Median(std::vector<std::pair<float, float>>& values)
{
  std::sort(values.begin(), values.end());
  double half = 0.0;
  for (const auto& value : values)
    half += 0.5 * value.second;
  for (const auto& value : values) {
    half -= value.second;
    if (half <= 0.0)
      return value.first;
  }
  return values.back().first;
}

// Differences of the two volumes with a slope between them, in the mean of their units.
struct Difference {
  explicit Difference(double logSlope)
    : ofX(static_cast<float>(std::exp(0.5 * logSlope))), ofY(static_cast<float>(std::exp(-0.5 * logSlope)))
  {
  }
  float operator()(const Sample& s) const { return ofY * s.y - ofX * s.x; }
  float ofX, ofY;
};

struct Spread {
  double centre, deviation; // median, and median distance from it
};

Spread SpreadOf(const std::vector<Sample>& samples, const Difference& difference)
{
  std::vector<std::pair<float, float>> values;
  const std::size_t every = std::max<std::size_t>(1, samples.size() / samplesOfMedian);
  for (std::size_t i = 0; i < samples.size(); i += every)
    values.emplace_back(difference(samples[i]), samples[i].weight);
  const double centre = Median(values);
  for (auto& value : values)
    value.first = static_cast<float>(std::abs(value.first - centre));
  return {centre, Median(values)};
}

// What a pair says: y = slope x + const, where trusted and not in shadow.
struct Relation {
  double gainWeight = 0.0, logSlope = 0.0; // weight 0: nothing
  double offsetWeight = 0.0, meanX = 0.0, meanY = 0.0;
};

Moments WithoutOutliers(const std::vector<Sample>& samples, double logSlope)
{
  const Difference difference(logSlope);
  const Spread spread = SpreadOf(samples, difference);
  // Three standard deviations; the second term is rounding.
  const double limit = 3.0 * 1.4826 * spread.deviation + 1e-6 * (std::abs(spread.centre) + 1e-20);
  return Moments::Of(samples, [&](const Sample& s) { return std::abs(difference(s) - spread.centre) <= limit; });
}

double LogSlope(const Moments& m)
{
  return 0.5 * (std::log(m.yy) - std::log(m.xx));
}

Relation RelationOf(const std::vector<Sample>& samples)
{
  Relation relation;
  if (static_cast<std::ptrdiff_t>(samples.size()) < leastShared)
    return relation;
  // 1. the start, from 1 outwards: of equally good ones the nearest to 1
  double logSlope = 0.0, least = SpreadOf(samples, Difference(0.0)).deviation;
  if (!Moments::Of(samples).Constant())
    for (int step = 1; step <= 10; ++step)
      for (const int sign : {-1, 1}) {
        const double candidate = sign * step * 0.1 * largestLogGain;
        const double deviation = SpreadOf(samples, Difference(candidate)).deviation;
        if (deviation < least) {
          least = deviation;
          logSlope = candidate;
        }
      }
  // 2. without outliers
  Moments moments = WithoutOutliers(samples, logSlope);
  for (int pass = 0; pass < 30 && !moments.Constant() && moments.Correlation() >= leastCorrelation; ++pass) {
    const double before = logSlope;
    logSlope = LogSlope(moments);
    moments = WithoutOutliers(samples, logSlope);
    if (std::abs(logSlope - before) < 1e-6)
      break;
  }
  const double correlation = moments.Correlation();
  if (!moments.Constant() && correlation >= leastCorrelation && std::abs(LogSlope(moments)) <= largestLogGain) {
    relation.logSlope = LogSlope(moments);
    // The variance of the logarithm of a ratio of standard deviations goes with 1 - correlation^2; at most 20 times.
    relation.gainWeight = moments.weight / (1.05 - correlation * correlation);
  } else {
    moments = WithoutOutliers(samples, 0.0);
  }
  relation.offsetWeight = moments.weight;
  relation.meanX = moments.x;
  relation.meanY = moments.y;
  return relation;
}

struct Pair {
  int a = 0, b = 0;
  Relation relation;
  double detailCorrelation = 0.0;
};

struct Equation {
  int a, b;
  double weight, difference; // x[a] - x[b] = difference
};

// Least squares over a graph; the mean of every connected group is 0. Residuals beyond the tolerance count by their size.
std::vector<double> SolveGraph(int count, const std::vector<Equation>& equations, double tolerance)
{
  std::vector<int> group(count);
  std::iota(group.begin(), group.end(), 0);
  for (const Equation& e : equations)
    if (group[e.a] != group[e.b])
      std::replace(group.begin(), group.end(), std::max(group[e.a], group[e.b]), std::min(group[e.a], group[e.b]));
  double largest = 0.0;
  for (const Equation& e : equations)
    largest = std::max(largest, e.weight);

  Eigen::VectorXd x = Eigen::VectorXd::Zero(count);
  std::vector<double> residuals(equations.size(), 0.0);
  constexpr int passes = 30;
  for (int pass = 0; pass < passes && !equations.empty(); ++pass) {
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(count, count);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
    for (int u = 0; u < count; ++u)
      for (int v = 0; v < count; ++v)
        if (group[u] == group[v])
          matrix(u, v) += 1.0;
    for (std::size_t i = 0; i < equations.size(); ++i) {
      const Equation& e = equations[i];
      const double weight = e.weight / largest * (residuals[i] > tolerance ? tolerance / residuals[i] : 1.0);
      matrix(e.a, e.a) += weight;
      matrix(e.b, e.b) += weight;
      matrix(e.a, e.b) -= weight;
      matrix(e.b, e.a) -= weight;
      right[e.a] += weight * e.difference;
      right[e.b] -= weight * e.difference;
    }
    x = SolveSymmetric(matrix, right);
    for (std::size_t i = 0; i < equations.size(); ++i)
      residuals[i] = std::abs(x[equations[i].a] - x[equations[i].b] - equations[i].difference);
  }
  return {x.data(), x.data() + count};
}

void CheckBoxes(const CoarseVolume& volume, std::size_t number)
{
  const GridBox& box = volume.inside.box;
  const auto fits = [&box](const Boxed<float>& field, bool optional) {
    return (optional && field.box.Empty()) || (field.box.first == box.first && field.box.size == box.size);
  };
  if (!fits(volume.value, false) || !fits(volume.low, false) || !fits(volume.trust, true))
    throw Error(Error::Kind::BadInput, "volume " + std::to_string(number + 1) + ": its coarse copies are not of one box");
}

} // namespace

void MarkStitchSamples(std::vector<CoarseVolume>& volumes)
{
  ParallelFor(static_cast<std::ptrdiff_t>(volumes.size()), [&](std::ptrdiff_t v) {
    CoarseVolume& own = volumes[v];
    own.wanted = {own.inside.box, Volume<unsigned char>(own.inside.box.size)};
    for (const CoarseVolume& other : volumes)
      if (&other != &own)
        ForSamples(own, other, [&own](std::ptrdiff_t i, std::ptrdiff_t, int j, int k) { own.wanted.Row(j, k)[i] = 1; });
  });
}

StitchGains EstimateStitchGains(const std::vector<CoarseVolume>& volumes, bool correct)
{
  const int count = static_cast<int>(volumes.size());
  for (std::size_t v = 0; v < volumes.size(); ++v)
    CheckBoxes(volumes[v], v);
  std::vector<Pair> pairs;
  for (int a = 0; a < count; ++a)
    for (int b = a + 1; b < count; ++b)
      if (!volumes[a].inside.box.Intersected(volumes[b].inside.box).Empty())
        pairs.push_back({a, b, {}, 0.0});
  ParallelFor(static_cast<std::ptrdiff_t>(pairs.size()), [&](std::ptrdiff_t p) {
    Pair& pair = pairs[p];
    const Shared shared = SharedVoxels(volumes[pair.a], volumes[pair.b]);
    if (static_cast<std::ptrdiff_t>(shared.details.size()) >= leastShared)
      pair.detailCorrelation = std::clamp(Moments::Of(shared.details).Correlation(), 0.0, 1.0);
    if (correct)
      pair.relation = RelationOf(shared.smooth);
  });

  StitchGains gains{std::vector<double>(volumes.size(), 1.0), std::vector<double>(volumes.size(), 0.0),
                    Eigen::MatrixXd::Identity(count, count)};
  for (const Pair& pair : pairs)
    gains.detailCorrelation(pair.a, pair.b) = gains.detailCorrelation(pair.b, pair.a) = pair.detailCorrelation;
  if (!correct)
    return gains;

  // gain[a] sd[a] = gain[b] sd[b]
  std::vector<Equation> equations;
  for (const Pair& pair : pairs)
    if (pair.relation.gainWeight > 0.0)
      equations.push_back({pair.a, pair.b, pair.relation.gainWeight, pair.relation.logSlope});
  const std::vector<double> logGains = SolveGraph(count, equations, 0.01);
  for (int v = 0; v < count; ++v)
    gains.gain[v] = std::exp(logGains[v]);

  // gain[a] mean[a] + offset[a] = gain[b] mean[b] + offset[b]
  equations.clear();
  double contrast = 0.0;
  for (const Pair& pair : pairs)
    if (pair.relation.offsetWeight > 0.0) {
      equations.push_back({pair.a, pair.b, pair.relation.offsetWeight,
                           gains.gain[pair.b] * pair.relation.meanY - gains.gain[pair.a] * pair.relation.meanX});
      contrast = std::max(contrast, std::abs(pair.relation.meanX));
    }
  gains.offset = SolveGraph(count, equations, 0.01 * contrast);
  return gains;
}

} // namespace echorama
