// SPDX-License-Identifier: BSD-3-Clause
// Four passes, each looking closer at less.
// 1. Every rotation of the cover turns the moving volume at a coarse resolution, and one Fourier transform there and one
//    back give, for all translations, the overlap n and the sum of products. Both volumes were locally normalised, so that
//    the sum over sqrt(n) already says how unlikely the likeness is.
// 2. The best tenth of the rotations is correlated again with all six sums (MaskedCorrelator::Normalised): the true
//    normalised correlation, ranked by sqrt(n) atanh(ncc). The best peaks that differ stay.
// 3. Each of these climbs in space, in rotation and translation, by halved steps, at the resolution asked for: a cover of 20
//    degrees leaves the truth up to 16 degrees off a rotation, and here it is met. The best climb to the end.
// 4. What came to the same place is one candidate.
// With all rotations the first pass is most of the cost: per rotation a resampling and two transforms of some 40^3. In a
// narrow cone the climb is.
#include "GlobalSearch.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/Sampling.h"
#include "Core/Imaging/ValidPoints.h"
#include "MaskedCorrelation.h"
#include "Metric.h"
#include <algorithm>
#include <cmath>
#include <optional>

namespace echorama {
namespace {

using Complex = MaskedCorrelator::Complex;

// All measured (BenchmarkGlobalSearch).
constexpr double CoarseVoxels = 2.0;         // edge of the voxels that are correlated, in voxels of the resolution asked for
constexpr double FewestCoarseVoxels = 500.0; // of the smaller volume, where its own resolution allows it
constexpr int MostVoxels = 128;              // along the longest side of the larger volume
constexpr double NeighbourhoodShare = 0.12;  // of the smaller volume's longest side: sigma of what a value is compared with
constexpr double VarianceFloor = 0.05;       // of the variance of all: keeps even places quiet
constexpr double ExactShare = 0.1;           // of the rotations that go to the second pass
constexpr std::size_t FewestExact = 64;
constexpr std::size_t PeaksPerRotation = 4;
constexpr std::size_t RefinedPeaks = 150;
constexpr std::ptrdiff_t RefinedPoints = 3000; // compared while climbing, at most
constexpr std::size_t FinishedPeaks = 30;      // that climb to the end
constexpr int FirstLevels = 2, LastLevels = 2, Sweeps = 3;
constexpr float NoScore = -1e9f;

// The valid region of a volume, in a frame with the axes of the grid and the origin in the centroid.
struct Region {
  explicit Region(const PlacedVolume& volume)
  {
    const PyramidLevel& coarsest = volume.pyramid->back();
    const VolumeView<const float> view = coarsest.intensity.View();
    const Eigen::Affine3d toWorld = coarsest.geometry.IndexToWorld();
    std::ptrdiff_t count = 0;
    toVolume.linear() = coarsest.geometry.direction;
    toVolume.translation() = toWorld * ValidCentroid<float>(view, {}, count);
    const Eigen::Affine3d toRegion = toVolume.inverse() * toWorld;
    const Eigen::Vector3d half = 0.5 * coarsest.geometry.spacing;
    const auto& n = view.Dimensions();
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i)
          if (!std::isnan(view(i, j, k))) {
            const Eigen::Vector3d p = toRegion * Eigen::Vector3d(i, j, k);
            box.extend(Eigen::Vector3d(p - half));
            box.extend(Eigen::Vector3d(p + half));
            spread += p * p.transpose() / static_cast<double>(count);
            radius = std::max(radius, p.norm() + half.norm());
          }
    spread.diagonal() += half.cwiseAbs2() / 3.0;
    volumeMm3 = static_cast<double>(count) * coarsest.geometry.spacing.prod();
    finestMm = volume.pyramid->front().geometry.spacing.minCoeff();
  }

  // How far a turn by an angle moves the region, root mean square, per radian.
  double MmPerRadian() const { return std::sqrt(spread.trace() * 2.0 / 3.0); }
  double Longest() const { return box.sizes().maxCoeff(); }

  Pose toVolume = Pose::Identity();
  Eigen::AlignedBox3d box;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero(); // mean p p^T
  double radius = 0.0, volumeMm3 = 0.0, finestMm = 1.0;
};

// Where a volume that is to become cubes of an edge is read: the coarsest resolution with no voxel longer than that, but for
// axes that have no finer one.
std::size_t LevelFor(const std::vector<PyramidLevel>& levels, double edge)
{
  std::size_t chosen = 0;
  while (chosen + 1 < levels.size() &&
         (levels[chosen + 1].geometry.spacing.array() <= levels[0].geometry.spacing.array().max(edge) * 1.0001).all())
    ++chosen;
  return chosen;
}

// A volume at low resolution: cubic voxels, each (weight, weight * value), with a rim of zeros around.
struct LowResolution {
  Volume<Complex> voxels;
  Eigen::Vector3d first = Eigen::Vector3d::Zero(); // centre of the first voxel in the frame of the region, mm
  double edge = 1.0;                               // of a voxel, mm
  double weights = 0.0;                            // the sum of all

  Eigen::Vector3d At(double i, double j, double k) const { return first + edge * Eigen::Vector3d(i, j, k); }
};

// Each voxel is the mean of eight readings around its centre, where at least four of them are real.
LowResolution Read(const PlacedVolume& volume, const Region& region, double edge)
{
  const std::size_t number = LevelFor(*volume.pyramid, edge);
  const PyramidLevel& level = (*volume.pyramid)[number];
  const Sampler<float> intensity(level.intensity.View(), {});
  std::optional<Sampler<float>> reliability;
  if (volume.reliability) {
    if (volume.reliability->size() <= number || (*volume.reliability)[number].geometry.dimensions != level.geometry.dimensions)
      throw Error(Error::Kind::BadInput, volume.name + ": its reliability has other voxels than the volume");
    reliability.emplace((*volume.reliability)[number].intensity.View(), VolumeView<const unsigned char>());
  }
  LowResolution low;
  low.edge = edge;
  std::array<int, 3> n{};
  for (int axis = 0; axis < 3; ++axis) {
    n[axis] = static_cast<int>(std::ceil(region.box.sizes()[axis] / edge - 1e-6)) + 2;
    low.first[axis] = region.box.center()[axis] - 0.5 * edge * (n[axis] - 1);
  }
  low.voxels = Volume<Complex>(n);
  const VolumeView<Complex> out = low.voxels.View();
  const Eigen::Affine3d toIndex = level.geometry.WorldToIndex() * region.toVolume;
  ParallelFor(n[2] - 2, [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice) + 1;
    for (int j = 1; j + 1 < n[1]; ++j)
      for (int i = 1; i + 1 < n[0]; ++i) {
        double sum = 0.0, weights = 0.0;
        int real = 0;
        for (int corner = 0; corner < 8; ++corner) {
          const Eigen::Vector3d p =
              toIndex * low.At(i + (corner & 1 ? 0.25 : -0.25), j + (corner & 2 ? 0.25 : -0.25), k + (corner & 4 ? 0.25 : -0.25));
          double value = 0.0, weight = 1.0;
          if (!intensity.Linear(p.x(), p.y(), p.z(), value))
            continue;
          if (reliability && !reliability->Linear(p.x(), p.y(), p.z(), weight))
            weight = 0.0;
          sum += value;
          weights += std::clamp(weight, 0.0, 1.0);
          ++real;
        }
        if (real >= 4)
          out(i, j, k) = {static_cast<float>(weights / real), static_cast<float>(sum / real * (weights / real))};
      }
  });
  for (const Complex& voxel : out)
    low.weights += static_cast<double>(voxel.real());
  if (low.weights <= 0.0)
    throw Error(Error::Kind::BadInput, volume.name + ": none of it is reliable");
  return low;
}

// Takes off each value the mean around it and divides by the standard deviation around it, by weight. Gain, and what
// changes slowly with depth, are gone afterwards; the variance of all becomes 1.
void Normalise(LowResolution& low, double sigmaMm)
{
  const VolumeView<Complex> voxels = low.voxels.View();
  double sum = 0.0;
  for (const Complex& voxel : voxels)
    sum += static_cast<double>(voxel.imag());
  const float mean = static_cast<float>(sum / std::max(low.weights, 1e-9));
  Volume<float> weights(voxels.Dimensions()), values(voxels.Dimensions()), squares(voxels.Dimensions());
  const VolumeView<float> w = weights.View(), v = values.View(), s = squares.View();
  double variance = 0.0;
  for (std::ptrdiff_t i = 0; i < voxels.Size(); ++i)
    if (voxels[i].real() > 0.0f) {
      w[i] = voxels[i].real();
      v[i] = voxels[i].imag() - mean * w[i];
      s[i] = v[i] * v[i] / w[i];
      variance += static_cast<double>(s[i]);
      voxels[i] = {w[i], v[i]};
    }
  variance /= std::max(low.weights, 1e-9);
  for (const VolumeView<float>& volume : {w, v, s})
    GaussianSum(volume, Eigen::Vector3d::Constant(sigmaMm / low.edge));
  double total = 0.0;
  for (std::ptrdiff_t i = 0; i < voxels.Size(); ++i)
    if (voxels[i].real() > 0.0f) {
      const double around = static_cast<double>(v[i] / w[i]),
                   deviation =
                       std::sqrt(std::max(0.0, static_cast<double>(s[i] / w[i]) - around * around) + VarianceFloor * variance);
      const double value = (static_cast<double>(voxels[i].imag() / voxels[i].real()) - around) / std::max(deviation, 1e-20);
      v[i] = static_cast<float>(value);
      total += static_cast<double>(voxels[i].real()) * value * value;
    }
  const float unit = static_cast<float>(1.0 / std::sqrt(std::max(total / std::max(low.weights, 1e-9), 1e-20)));
  for (std::ptrdiff_t i = 0; i < voxels.Size(); ++i)
    voxels[i] = {voxels[i].real(), voxels[i].real() > 0.0f ? voxels[i].real() * v[i] * unit : 0.0f};
}

LowResolution Reduce(const PlacedVolume& volume, const Region& region, double edge, double sigmaMm)
{
  LowResolution low = Read(volume, region, edge);
  Normalise(low, sigmaMm);
  return low;
}

// Reads low resolution voxels between their centres. The rim is zero: outside is nothing.
class Reader {
public:
  explicit Reader(const LowResolution& low)
    : voxels_(low.voxels.View().Data()), row_(low.voxels.View().RowStride()), slice_(low.voxels.View().SliceStride())
  {
    const auto& n = low.voxels.Dimensions();
    end_ = Eigen::Vector3f(static_cast<float>(n[0] - 1), static_cast<float>(n[1] - 1), static_cast<float>(n[2] - 1));
  }

  Complex operator()(float x, float y, float z) const
  {
    if (!(x >= 0.0f && y >= 0.0f && z >= 0.0f && x < end_.x() && y < end_.y() && z < end_.z()))
      return {};
    const int i = static_cast<int>(x), j = static_cast<int>(y), k = static_cast<int>(z);
    const float tx = x - static_cast<float>(i), ty = y - static_cast<float>(j), tz = z - static_cast<float>(k);
    // Two voxels that lie side by side are four numbers: first between rows and slices, four at once, then between the two.
    const Complex* c = voxels_ + k * slice_ + j * row_ + i;
    const float *first = Numbers(c), *above = Numbers(c + row_), *behind = Numbers(c + slice_),
                *both = Numbers(c + slice_ + row_);
    float sum[4];
    for (int l = 0; l < 4; ++l) {
      const float near = first[l] + ty * (above[l] - first[l]), far = behind[l] + ty * (both[l] - behind[l]);
      sum[l] = near + tz * (far - near);
    }
    return {sum[0] + tx * (sum[2] - sum[0]), sum[1] + tx * (sum[3] - sum[1])};
  }

private:
  // An array of complex numbers is one of twice as many real ones.
  static const float* Numbers(const Complex* c) { return reinterpret_cast<const float*>(c); }

  const Complex* voxels_;
  std::ptrdiff_t row_, slice_;
  Eigen::Vector3f end_;
};

// Turns the moving volume about its centroid, which comes to lie in the middle of \a out. Voxels further away than the
// region reaches are not looked at.
void TurnInto(const LowResolution& low, const Eigen::Matrix3d& turn, double radius, VolumeView<Complex> out)
{
  const Reader reader(low);
  const auto& n = out.Dimensions();
  const double middle = 0.5 * (n[0] - 1), squared = radius * radius / (low.edge * low.edge);
  const Eigen::Matrix3d back = turn.transpose();
  const Eigen::Vector3f step = back.col(0).cast<float>();
  std::fill(out.begin(), out.end(), Complex());
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j) {
      const double left = squared - (k - middle) * (k - middle) - (j - middle) * (j - middle);
      if (left < 0.0)
        continue;
      const int begin = std::max(0, static_cast<int>(std::ceil(middle - std::sqrt(left)))),
                end = std::min(n[0] - 1, static_cast<int>(std::floor(middle + std::sqrt(left))));
      const Eigen::Vector3f row = (back * Eigen::Vector3d(-middle, j - middle, k - middle) - low.first / low.edge).cast<float>();
      for (int i = begin; i <= end; ++i) {
        const Eigen::Vector3f at = row + static_cast<float>(i) * step;
        out(i, j, k) = reader(at.x(), at.y(), at.z());
      }
    }
}

// How unlikely a correlation over an overlap is by chance, up to a factor: Fisher's z over its standard deviation.
double Significance(double ncc, double weight)
{
  return std::atanh(std::clamp(ncc, -0.999, 0.999)) * std::sqrt(weight);
}

// A pose in the frames of the regions, and how good it is.
struct Peak {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero(); // of the centroid, mm
  double score = 0.0, ncc = 0.0, weight = 0.0, sharpness = 0.0;
};

bool IsBetter(const Peak& a, const Peak& b)
{
  return a.score > b.score;
}

// The masked normalised cross-correlation at one pose, in space.
class Comparer {
public:
  Comparer(const LowResolution& fixed, const LowResolution& moving) : fixed_(fixed), reader_(fixed)
  {
    const auto view = moving.voxels.View();
    const auto& n = view.Dimensions();
    const std::ptrdiff_t real = std::count_if(view.begin(), view.end(), [](const Complex& voxel) { return voxel.real() > 0.0f; });
    every_ = (real + RefinedPoints - 1) / RefinedPoints;
    std::ptrdiff_t number = 0;
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i)
          if (view(i, j, k).real() > 0.0f && number++ % every_ == 0)
            points_.push_back(
                {moving.At(i, j, k).cast<float>(), view(i, j, k).real(), view(i, j, k).imag() / view(i, j, k).real()});
  }

  /// Fills in the peak's correlation, weight and score.
  void Evaluate(Peak& peak, double leastWeight) const
  {
    const Eigen::Matrix3f turn = (peak.turn / fixed_.edge).cast<float>();
    const Eigen::Vector3f shift = ((peak.shift - fixed_.first) / fixed_.edge).cast<float>();
    double n = 0.0, f = 0.0, m = 0.0, ff = 0.0, mm = 0.0, fm = 0.0;
    for (const Point& point : points_) {
      const Eigen::Vector3f at = turn * point.position + shift;
      const Complex fixed = reader_(at.x(), at.y(), at.z());
      if (fixed.real() <= 0.0f)
        continue;
      const float weight = fixed.real() * point.weight, value = fixed.imag() * point.weight; // the fixed value times the weight
      n += static_cast<double>(weight);
      f += static_cast<double>(value);
      m += static_cast<double>(weight * point.value);
      ff += static_cast<double>(value * fixed.imag() / fixed.real());
      mm += static_cast<double>(weight * point.value * point.value);
      fm += static_cast<double>(value * point.value);
    }
    peak.weight = n * static_cast<double>(every_);
    peak.ncc = 0.0;
    peak.score = static_cast<double>(NoScore);
    if (n <= 0.0 || peak.weight < leastWeight)
      return;
    const double varianceF = ff / n - f / n * f / n, varianceM = mm / n - m / n * m / n;
    if (varianceF > 1e-6 && varianceM > 1e-6)
      peak.ncc = std::clamp((fm / n - f / n * m / n) / std::sqrt(varianceF * varianceM), -1.0, 1.0);
    peak.score = Significance(peak.ncc, peak.weight);
  }

private:
  struct Point {
    Eigen::Vector3f position;
    float weight, value;
  };
  const LowResolution& fixed_;
  Reader reader_;
  std::ptrdiff_t every_ = 1; // voxels per point
  std::vector<Point> points_;
};

// How far a pose puts the moving region from where another puts it, root mean square.
double Apart(const Peak& a, const Peak& b, const Eigen::Matrix3d& spread)
{
  const Eigen::Matrix3d d = a.turn - b.turn;
  return std::sqrt(std::max(0.0, (d * spread * d.transpose()).trace() + (a.shift - b.shift).squaredNorm()));
}

// The best, at most so many, none closer than \a distance to a better one; that one takes over the sharpness if it is larger.
std::vector<Peak> Distinct(std::vector<Peak> peaks, const Eigen::Matrix3d& spread, double distance, std::size_t most)
{
  std::stable_sort(peaks.begin(), peaks.end(), IsBetter);
  std::vector<Peak> kept;
  for (const Peak& peak : peaks) {
    const auto alike = std::find_if(kept.begin(), kept.end(), [&](const Peak& k) { return Apart(k, peak, spread) < distance; });
    if (alike != kept.end())
      alike->sharpness = std::max(alike->sharpness, peak.sharpness);
    else if (kept.size() < most)
      kept.push_back(peak);
  }
  return kept;
}

// Correlates rotations over all translations that the reach and the minimum overlap allow.
class Translations {
public:
  Translations(const LowResolution& fixed, const LowResolution& moving, double movingRadius, double leastWeight,
               const Eigen::Vector3d& start, double reachMm)
    : fixed_(fixed), moving_(moving), radius_(movingRadius), least_(leastWeight), start_(start), reachMm_(reachMm),
      side_(2 * static_cast<int>(std::ceil(movingRadius / fixed.edge)) + 1), shifts_(Allowed()),
      correlator_(fixed.voxels.View(), {side_, side_, side_}, shifts_)
  {
  }

  struct Work {
    MaskedCorrelator::Work transforms;
    Volume<Complex> turned, sums;
    Volume<float> scores;
  };
  Work MakeWork() const
  {
    return {{}, Volume<Complex>({side_, side_, side_}), Volume<Complex>(shifts_.Counts()), Volume<float>(shifts_.Counts())};
  }

  /// The largest sum of products over sqrt(n).
  float Best(const Eigen::Matrix3d& turn, Work& work) const
  {
    TurnInto(moving_, turn, radius_, work.turned.View());
    correlator_.Products(work.turned.View(), work.sums.View(), work.transforms);
    const float least = static_cast<float>(least_);
    float best = NoScore;
    for (const Complex& sum : std::as_const(work.sums).View())
      if (sum.real() >= least)
        best = std::max(best, sum.imag() / std::sqrt(sum.real()));
    return best;
  }

  /// The highest peaks of the significance of the normalised correlation, the best first.
  std::vector<Peak> Peaks(const Eigen::Matrix3d& turn, Work& work) const
  {
    TurnInto(moving_, turn, radius_, work.turned.View());
    correlator_.Normalised(work.turned.View(), least_, work.sums.View(), work.transforms);
    const VolumeView<const Complex> sums = std::as_const(work.sums).View();
    const VolumeView<float> scores = work.scores.View();
    double mean = 0.0, square = 0.0, allowed = 0.0;
    for (std::ptrdiff_t i = 0; i < sums.Size(); ++i) {
      const double weight = static_cast<double>(sums[i].real());
      scores[i] = NoScore;
      if (weight >= least_) {
        const double score = Significance(static_cast<double>(sums[i].imag()), weight);
        scores[i] = static_cast<float>(score);
        mean += score;
        square += score * score;
        allowed += 1.0;
      }
    }
    std::vector<Peak> peaks;
    const auto counts = shifts_.Counts();
    for (int k = 0; k < counts[2]; ++k)
      for (int j = 0; j < counts[1]; ++j)
        for (int i = 0; i < counts[0]; ++i) {
          const double score = static_cast<double>(scores(i, j, k));
          if (score <= 0.0 || (peaks.size() == PeaksPerRotation && score <= peaks.back().score) || !IsPeak(scores, i, j, k))
            continue;
          Peak peak;
          peak.turn = turn;
          peak.shift = Centroid(Eigen::Vector3d(i, j, k) + Vertex(scores, i, j, k));
          if ((peak.shift - start_).norm() > reachMm_)
            continue;
          peak.score = score;
          peak.ncc = static_cast<double>(sums(i, j, k).imag());
          peak.weight = static_cast<double>(sums(i, j, k).real());
          peaks.insert(std::upper_bound(peaks.begin(), peaks.end(), peak, IsBetter), peak);
          if (peaks.size() > PeaksPerRotation)
            peaks.pop_back();
        }
    mean /= std::max(allowed, 1.0);
    const double deviation = std::sqrt(std::max(1e-12, square / std::max(allowed, 1.0) - mean * mean));
    for (Peak& peak : peaks)
      peak.sharpness = (peak.score - mean) / deviation;
    return peaks;
  }

private:
  // From the first shifts to the last that can have enough overlap along each axis: an overlap of m planes holds no more than
  // the outermost m planes of the fixed volume, and than a cap of that height of the ball around the moving one.
  ShiftRange Allowed() const
  {
    const auto& n = fixed_.voxels.Dimensions();
    ShiftRange range;
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> planes(static_cast<std::size_t>(n[axis]), 0.0);
      const VolumeView<const Complex> view = fixed_.voxels.View();
      for (int k = 0; k < n[2]; ++k)
        for (int j = 0; j < n[1]; ++j)
          for (int i = 0; i < n[0]; ++i)
            planes[static_cast<std::size_t>(axis == 0 ? i : axis == 1 ? j : k)] += static_cast<double>(view(i, j, k).real());
      const auto fewest = [&](bool fromEnd) {
        const double radius = radius_ / fixed_.edge;
        double weight = 0.0;
        for (int m = 1; m <= n[axis]; ++m) {
          weight += planes[static_cast<std::size_t>(fromEnd ? n[axis] - m : m - 1)];
          const double height = std::min(m + 1.0, 2.0 * radius); // one more: voxels are read between their centres
          const double cap = 3.141592653589793 * height * height * (radius - height / 3.0);
          if (std::min(weight, cap) >= least_ || m == side_)
            return m;
        }
        return n[axis];
      };
      range.first[axis] = fewest(false) - side_;
      range.last[axis] = n[axis] - fewest(true);
      if (std::isfinite(reachMm_)) {
        const double at = (start_[axis] - fixed_.first[axis]) / fixed_.edge - 0.5 * (side_ - 1), reach = reachMm_ / fixed_.edge;
        range.first[axis] = static_cast<int>(std::clamp<double>(std::floor(at - reach), range.first[axis], range.last[axis]));
        range.last[axis] = static_cast<int>(std::clamp<double>(std::ceil(at + reach), range.first[axis], range.last[axis]));
      }
    }
    return range;
  }

  // Where the moving centroid lies at a shift, counted from the first one.
  Eigen::Vector3d Centroid(const Eigen::Vector3d& number) const
  {
    const Eigen::Vector3d shift = number + Eigen::Vector3d(shifts_.first[0], shifts_.first[1], shifts_.first[2]);
    return fixed_.first + fixed_.edge * (shift + Eigen::Vector3d::Constant(0.5 * (side_ - 1)));
  }

  bool IsPeak(VolumeView<const float> scores, int i, int j, int k) const
  {
    const auto counts = shifts_.Counts();
    for (int c = std::max(0, k - 1); c <= std::min(counts[2] - 1, k + 1); ++c)
      for (int b = std::max(0, j - 1); b <= std::min(counts[1] - 1, j + 1); ++b)
        for (int a = std::max(0, i - 1); a <= std::min(counts[0] - 1, i + 1); ++a)
          if (scores(a, b, c) > scores(i, j, k))
            return false;
    return true;
  }

  // The top of the parabola through a peak and its neighbours along each axis, from the peak.
  Eigen::Vector3d Vertex(VolumeView<const float> scores, int i, int j, int k) const
  {
    const std::array<int, 3> at{i, j, k}, counts = shifts_.Counts();
    const std::array<std::ptrdiff_t, 3> strides{1, scores.RowStride(), scores.SliceStride()};
    const float* peak = scores.Row(j, k) + i;
    Eigen::Vector3d vertex = Eigen::Vector3d::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      if (at[axis] == 0 || at[axis] + 1 == counts[axis])
        continue;
      const double before = static_cast<double>(peak[-strides[axis]]), after = static_cast<double>(peak[strides[axis]]),
                   bend = before + after - 2.0 * static_cast<double>(*peak);
      if (before > static_cast<double>(NoScore) && after > static_cast<double>(NoScore) && bend < 0.0)
        vertex[axis] = std::clamp(0.5 * (before - after) / bend, -0.5, 0.5);
    }
    return vertex;
  }

  const LowResolution &fixed_, &moving_;
  double radius_, least_;
  Eigen::Vector3d start_;
  double reachMm_;
  int side_; // of the turned volume
  ShiftRange shifts_;
  MaskedCorrelator correlator_;
};

// Climbs from a peak, one of six directions after the other, by steps that are halved.
class Climber {
public:
  Climber(const Comparer& comparer, double leastWeight, const Eigen::Vector3d& start, double reachMm)
    : comparer_(comparer), least_(leastWeight), start_(start), reachMm_(reachMm)
  {
  }

  void operator()(Peak& peak, double stepMm, double mmPerRadian, int levels) const
  {
    comparer_.Evaluate(peak, least_);
    for (int level = 0; level < levels; ++level, stepMm *= 0.5)
      for (int sweep = 0; sweep < Sweeps; ++sweep) {
        const double before = peak.score;
        for (int direction = 0; direction < 6; ++direction)
          if (!Try(peak, direction, stepMm, mmPerRadian))
            Try(peak, direction, -stepMm, mmPerRadian);
        if (peak.score <= before)
          break;
      }
  }

private:
  bool Try(Peak& peak, int direction, double stepMm, double mmPerRadian) const
  {
    Peak trial = peak;
    if (direction < 3)
      trial.shift[direction] += stepMm;
    else
      trial.turn = ExpRotation(stepMm / mmPerRadian * Eigen::Vector3d::Unit(direction - 3)) * peak.turn;
    if ((trial.shift - start_).norm() > reachMm_)
      return false;
    comparer_.Evaluate(trial, least_);
    if (trial.score <= peak.score)
      return false;
    peak = trial;
    return true;
  }

  const Comparer& comparer_;
  double least_;
  Eigen::Vector3d start_;
  double reachMm_;
};

// The edge of the voxels that are correlated: from the larger volume's size, but the smaller one keeps enough of them.
double CoarseEdge(const Region& fixed, const Region& moving, int resolution)
{
  const double longest = std::max(fixed.Longest(), moving.Longest());
  const double wanted = CoarseVoxels * longest / resolution,
               smaller = std::cbrt(std::min(fixed.volumeMm3, moving.volumeMm3) / FewestCoarseVoxels);
  return std::max({std::min(wanted, smaller), longest / MostVoxels, std::min({wanted, fixed.finestMm, moving.finestMm})});
}

} // namespace

ParameterList Describe(GlobalSearchParameters& p)
{
  return {
      Parameter("ConeDegrees", p.coneDegrees, {0, 180}, "degrees", "Rotations about the start by more are not tried."),
      Parameter("MinimumOverlap", p.minimumOverlap, {0, 1, true}, "",
                "The least share of the smaller valid region in the other."),
      Parameter("Resolution", p.resolution, {16, 96}, "voxels", "Voxels along the longest side of the larger valid region."),
      Parameter("StepDegrees", p.stepDegrees, {2, 45}, "degrees", "Between neighbouring rotations."),
      Parameter("Candidates", p.candidates, {1, 1000}, "", "How many distinct poses are kept."),
  };
}

void GlobalSearchParameters::Check() const
{
  CheckRanges(*this);
  if (!(reachMm > 0.0))
    throw Error(Error::Kind::InvalidParameter, "the reach must be more than 0 mm");
}

GlobalSearchResult GlobalSearch(const PlacedVolume& fixed, const PlacedVolume& moving, const GlobalSearchParameters& p,
                                const Progress& progress)
{
  p.Check();
  CheckPlacedVolume(fixed);
  CheckPlacedVolume(moving);
  progress(0.0);

  // 1. The volumes at low resolution, and the frames they are compared in.
  const Region fixedRegion(fixed), movingRegion(moving);
  const double coarseEdge = CoarseEdge(fixedRegion, movingRegion, p.resolution), fineEdge = coarseEdge / CoarseVoxels;
  const double sigmaMm = NeighbourhoodShare * std::min(fixedRegion.Longest(), movingRegion.Longest());
  const LowResolution coarseFixed = Reduce(fixed, fixedRegion, coarseEdge, sigmaMm),
                      coarseMoving = Reduce(moving, movingRegion, coarseEdge, sigmaMm);
  const Pose fixedToWorld = fixed.volumeToWorld * fixedRegion.toVolume,
             movingToWorld = moving.volumeToWorld * movingRegion.toVolume;
  const Eigen::Vector3d start = fixedToWorld.inverse() * movingToWorld.translation();
  const double stepMm = p.stepDegrees * RadiansPerDegree * movingRegion.MmPerRadian();
  std::vector<Eigen::Matrix3d> turns = RotationCover(p.coneDegrees, p.stepDegrees);
  for (Eigen::Matrix3d& turn : turns)
    turn = fixedToWorld.linear().transpose() * turn * movingToWorld.linear();
  const std::ptrdiff_t rotations = static_cast<std::ptrdiff_t>(turns.size());

  // 2. All rotations and translations, by the sum of products.
  const double leastCoarse = p.minimumOverlap * std::min(coarseFixed.weights, coarseMoving.weights);
  const Translations translations(coarseFixed, coarseMoving, movingRegion.radius, leastCoarse, start, p.reachMm);
  constexpr std::ptrdiff_t grain = 8; // rotations that share their working memory
  std::vector<float> best(turns.size());
  ParallelRanges(rotations, grain, progress.Part(0.02, 0.7), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    Translations::Work work = translations.MakeWork();
    for (std::ptrdiff_t r = begin; r < end; ++r)
      best[static_cast<std::size_t>(r)] = translations.Best(turns[static_cast<std::size_t>(r)], work);
  });

  // 3. The best rotations, by the normalised correlation.
  std::vector<std::size_t> order(turns.size());
  for (std::size_t r = 0; r < order.size(); ++r)
    order[r] = r;
  std::stable_sort(order.begin(), order.end(), [&best](std::size_t a, std::size_t b) { return best[a] > best[b]; });
  const std::size_t share = static_cast<std::size_t>(ExactShare * static_cast<double>(turns.size()));
  order.resize(std::min(order.size(), std::max(FewestExact, share)));
  std::vector<std::vector<Peak>> found(order.size());
  ParallelRanges(static_cast<std::ptrdiff_t>(order.size()), grain, progress.Part(0.7, 0.8),
                 [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
                   Translations::Work work = translations.MakeWork();
                   for (std::ptrdiff_t i = begin; i < end; ++i)
                     found[static_cast<std::size_t>(i)] = translations.Peaks(turns[order[static_cast<std::size_t>(i)]], work);
                 });
  std::vector<Peak> peaks;
  for (const std::vector<Peak>& ofRotation : found)
    peaks.insert(peaks.end(), ofRotation.begin(), ofRotation.end());
  peaks = Distinct(std::move(peaks), movingRegion.spread, 0.5 * stepMm, RefinedPeaks);

  // 4. Closer, and which of them differ.
  const LowResolution fineFixed = Reduce(fixed, fixedRegion, fineEdge, sigmaMm),
                      fineMoving = Reduce(moving, movingRegion, fineEdge, sigmaMm);
  const double smaller = std::min(fineFixed.weights, fineMoving.weights), leastFine = p.minimumOverlap * smaller;
  const Comparer comparer(fineFixed, fineMoving);
  const Climber climb(comparer, leastFine, start, p.reachMm);
  const auto climbAll = [&](double firstStepMm, int levels, const Progress& part) {
    ParallelFor(static_cast<std::ptrdiff_t>(peaks.size()), part, [&](std::ptrdiff_t i) {
      climb(peaks[static_cast<std::size_t>(i)], firstStepMm, movingRegion.MmPerRadian(), levels);
    });
  };
  climbAll(coarseEdge, FirstLevels, progress.Part(0.8, 0.95));
  peaks = Distinct(std::move(peaks), movingRegion.spread, 0.5 * stepMm,
                   std::max(FinishedPeaks, 2 * static_cast<std::size_t>(p.candidates)));
  climbAll(std::ldexp(coarseEdge, -FirstLevels), LastLevels, progress.Part(0.95, 1.0));
  peaks.erase(std::remove_if(peaks.begin(), peaks.end(), [](const Peak& peak) { return peak.score <= 0.0; }), peaks.end());
  peaks = Distinct(std::move(peaks), movingRegion.spread, stepMm, static_cast<std::size_t>(p.candidates));

  GlobalSearchResult result;
  result.rotations = static_cast<int>(rotations);
  result.voxelMm = fineEdge;
  for (const Peak& peak : peaks) {
    Pose pose = Pose::Identity();
    pose.linear() = peak.turn;
    pose.translation() = peak.shift;
    pose = fixedToWorld * pose * movingRegion.toVolume.inverse();
    pose.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
    result.candidates.push_back({pose, peak.ncc, std::min(1.0, peak.weight / smaller), peak.sharpness});
  }
  return result;
}

} // namespace echorama
