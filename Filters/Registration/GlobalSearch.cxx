// SPDX-License-Identifier: BSD-3-Clause
#include "GlobalSearch.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/Sampling.h"
#include "MaskedCorrelation.h"
#include "ValidPoints.h"
#include <algorithm>
#include <cmath>
#include <memory>

namespace echorama {
namespace {

using Complex = std::complex<float>;

constexpr double RadiansPerDegree = 0.017453292519943295;
constexpr int FewestVoxels = 100;

// All measured (BenchmarkGlobalSearch).
constexpr double DefaultStepDegrees = 18.0;
constexpr double CoarseVoxels = 1.6;        // edge of the voxels that are correlated, in voxels of the resolution asked for
constexpr double NeighbourhoodShare = 0.12; // of the larger volume's longest side: sigma of what a value is compared with
constexpr double VarianceFloor = 0.05;      // of the variance of all: keeps even places quiet
constexpr std::size_t PeaksPerRotation = 4;
constexpr std::size_t RefinedPeaks = 200;
constexpr int RefinedShare = 2; // one point of so many is compared while refining
constexpr int RefiningLevels = 4, RefiningSweeps = 3;

void CheckVolume(const PlacedVolume& volume)
{
  if (!volume.pyramid || volume.pyramid->empty())
    throw Error(Error::Kind::BadInput, volume.name + ": it has no voxels");
  const PyramidLevel& finest = volume.pyramid->front();
  const auto& n = finest.geometry.dimensions;
  if (*std::min_element(n.begin(), n.end()) < 2)
    throw Error(Error::Kind::BadInput, volume.name + ": it is not a volume (one voxel thick); the search needs three dimensions");
  if (finest.realVoxels < FewestVoxels)
    throw Error(Error::Kind::BadInput, volume.name + ": only " + std::to_string(finest.realVoxels) +
                                           " of its voxels are real; at least " + std::to_string(FewestVoxels) + " are needed");
  const VolumeView<const float> view = finest.intensity.View();
  const float* first = std::find_if(view.begin(), view.end(), [](float v) { return v == v; });
  if (std::all_of(first, view.end(), [first](float v) { return !(v == v) || v == *first; }))
    throw Error(Error::Kind::BadInput, volume.name + ": it is constant; there is nothing to align on");
}

// The valid region of a volume in a frame of its own: axes of the grid, origin in the centroid, mm.
struct Region {
  explicit Region(const PlacedVolume& volume)
  {
    const PyramidLevel& coarsest = volume.pyramid->back();
    const VolumeView<const float> view = coarsest.intensity.View();
    std::ptrdiff_t count = 0;
    const Eigen::Affine3d toWorld = coarsest.geometry.IndexToWorld();
    toVolume.linear() = coarsest.geometry.direction;
    toVolume.translation() = toWorld * ValidCentroid<float>(view, {}, count);
    const Eigen::Affine3d toRegion = toVolume.inverse() * toWorld;
    const auto& n = view.Dimensions();
    double radiusSquared = 0.0;
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i)
          if (!std::isnan(view(i, j, k))) {
            const Eigen::Vector3d p = toRegion * Eigen::Vector3d(i, j, k);
            box.extend(Eigen::Vector3d(p - 0.5 * coarsest.geometry.spacing));
            box.extend(Eigen::Vector3d(p + 0.5 * coarsest.geometry.spacing));
            spread += p * p.transpose() / static_cast<double>(count);
            radiusSquared = std::max(radiusSquared, p.squaredNorm());
          }
    spread.diagonal() += coarsest.geometry.spacing.cwiseAbs2() / 12.0;
    radius = std::sqrt(radiusSquared) + 0.5 * coarsest.geometry.spacing.norm();
    volumeMm3 = static_cast<double>(count) * coarsest.geometry.spacing.prod();
  }

  Pose toVolume = Pose::Identity();
  Eigen::AlignedBox3d box;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero(); // mean p p^T
  double radius = 0.0, volumeMm3 = 0.0;
};

// Which resolution to read cubes of an edge from: the coarsest whose voxels are not larger, along any axis that has a choice.
std::size_t LevelFor(const std::vector<PyramidLevel>& levels, double edge)
{
  std::size_t chosen = 0;
  const auto fits = [&](std::size_t l) {
    return (levels[l].geometry.spacing.array() <= levels[0].geometry.spacing.array().max(edge) * 1.0001).all();
  };
  while (chosen + 1 < levels.size() && fits(chosen + 1))
    ++chosen;
  return chosen;
}

// A volume at low resolution: cubic voxels, (weight, weight * value), a rim of zeros around.
struct LowResolution {
  Volume<Complex> voxels;
  Eigen::Vector3d first; // centre of the first voxel in the frame of the region, mm
  double edge = 1.0;     // of a voxel, mm
  Eigen::Vector3d At(double i, double j, double k) const { return first + edge * Eigen::Vector3d(i, j, k); }
};

void BlurAxis(std::vector<float>& data, const std::array<int, 3>& n, int axis, const std::vector<float>& kernel)
{
  const std::ptrdiff_t stride = axis == 0 ? 1 : axis == 1 ? n[0] : static_cast<std::ptrdiff_t>(n[0]) * n[1];
  const int length = n[axis], half = static_cast<int>(kernel.size()) / 2;
  std::vector<float> line(static_cast<std::size_t>(length));
  const std::array<int, 3> lines{axis == 0 ? 1 : n[0], axis == 1 ? 1 : n[1], axis == 2 ? 1 : n[2]};
  for (int k = 0; k < lines[2]; ++k)
    for (int j = 0; j < lines[1]; ++j)
      for (int i = 0; i < lines[0]; ++i) {
        float* at = data.data() + (static_cast<std::ptrdiff_t>(k) * n[1] + j) * n[0] + i;
        for (int p = 0; p < length; ++p) {
          float sum = 0.0f;
          for (int q = std::max(0, p - half); q <= std::min(length - 1, p + half); ++q)
            sum += kernel[static_cast<std::size_t>(q - p + half)] * at[q * stride];
          line[static_cast<std::size_t>(p)] = sum;
        }
        for (int p = 0; p < length; ++p)
          at[p * stride] = line[static_cast<std::size_t>(p)];
      }
}

std::vector<float> Blurred(std::vector<float> data, const std::array<int, 3>& n, double sigma)
{
  const int half = static_cast<int>(std::ceil(3.0 * sigma));
  std::vector<float> kernel;
  for (int i = -half; i <= half; ++i)
    kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma * sigma))));
  for (int axis = 0; axis < 3; ++axis)
    BlurAxis(data, n, axis, kernel);
  return data;
}

LowResolution Reduce(const PlacedVolume& volume, const Region& region, double edge, double sigma)
{
  const std::size_t number = LevelFor(*volume.pyramid, edge);
  const PyramidLevel& level = (*volume.pyramid)[number];
  const Sampler<float> sampler(level.intensity.View(), {});
  const Sampler<float>* trust = nullptr;
  std::unique_ptr<Sampler<float>> reliability;
  if (volume.reliability) {
    if (volume.reliability->size() <= number || (*volume.reliability)[number].geometry.dimensions != level.geometry.dimensions)
      throw Error(Error::Kind::BadInput, volume.name + ": its reliability has not the voxels of the volume");
    reliability =
        std::make_unique<Sampler<float>>((*volume.reliability)[number].intensity.View(), VolumeView<const unsigned char>());
    trust = reliability.get();
  }
  LowResolution low;
  low.edge = edge;
  std::array<int, 3> n{};
  for (int axis = 0; axis < 3; ++axis) {
    n[axis] = static_cast<int>(std::ceil(region.box.sizes()[axis] / edge - 1e-6)) + 2;
    low.first[axis] = region.box.center()[axis] - 0.5 * edge * (n[axis] - 1);
  }
  low.voxels = Volume<Complex>(n);
  const auto out = low.voxels.View();
  const Eigen::Affine3d toIndex = level.geometry.WorldToIndex() * region.toVolume;
  ParallelFor(n[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        double value = 0.0, weight = 0.0;
        int real = 0;
        for (int c = 0; c < 8; ++c) {
          const Eigen::Vector3d p =
              toIndex * low.At(i + (c & 1 ? 0.25 : -0.25), j + (c & 2 ? 0.25 : -0.25), k + (c & 4 ? 0.25 : -0.25));
          double v = 0.0, w = 1.0;
          if (!sampler.Linear(p.x(), p.y(), p.z(), v))
            continue;
          if (trust && !trust->Linear(p.x(), p.y(), p.z(), w))
            w = 0.0;
          w = std::clamp(w, 0.0, 1.0);
          value += v;
          weight += w;
          ++real;
        }
        const bool inside = i > 0 && j > 0 && k > 0 && i + 1 < n[0] && j + 1 < n[1] && k + 1 < n[2];
        if (real >= 4 && inside)
          out(i, j, k) = {static_cast<float>(weight / real), static_cast<float>(value / real)};
      }
  });
  // values -> locally normalised
  const std::size_t count = static_cast<std::size_t>(out.Size());
  std::vector<float> w(count), wf(count), wff(count);
  double sum = 0.0, sumW = 0.0, sumSq = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const Complex c = out[static_cast<std::ptrdiff_t>(i)];
    sum += static_cast<double>(c.real() * c.imag());
    sumW += static_cast<double>(c.real());
  }
  const float mean = static_cast<float>(sum / std::max(sumW, 1e-9));
  for (std::size_t i = 0; i < count; ++i) {
    const Complex c = out[static_cast<std::ptrdiff_t>(i)];
    const float v = c.imag() - mean;
    w[i] = c.real();
    wf[i] = c.real() * v;
    wff[i] = c.real() * v * v;
    sumSq += static_cast<double>(wff[i]);
  }
  const double global = sumSq / std::max(sumW, 1e-9);
  const std::vector<float> bw = Blurred(w, n, sigma), bf = Blurred(wf, n, sigma), bff = Blurred(wff, n, sigma);
  const double floor = VarianceFloor * global;
  double total = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    float v = 0.0f;
    if (w[i] > 0.0f) {
      v = wf[i] / w[i];
      const float m = bf[i] / bw[i];
      v -= m;
      v /= static_cast<float>(std::sqrt(std::max(0.0, static_cast<double>(bff[i] / bw[i] - m * m)) + floor));
    }
    wf[i] = v;
    total += static_cast<double>(w[i] * v * v);
  }
  const float unit = static_cast<float>(1.0 / std::sqrt(std::max(total / std::max(sumW, 1e-9), 1e-30)));
  for (std::size_t i = 0; i < count; ++i)
    out[static_cast<std::ptrdiff_t>(i)] = {w[i], w[i] * wf[i] * unit};
  return low;
}

// Turns the moving volume onto a grid of its own: cube of n^3 voxels, centroid in the middle.
void Turn(const LowResolution& low, const Eigen::Matrix3d& rotation, double radius, VolumeView<Complex> out)
{
  const auto& n = out.Dimensions();
  const auto& m = low.voxels.Dimensions();
  const Complex* from = low.voxels.View().Data();
  const double middle = 0.5 * (n[0] - 1), r2 = radius * radius / (low.edge * low.edge);
  const Eigen::Matrix3d back = rotation.transpose();
  const Eigen::Vector3d offset = -low.first / low.edge;
  const std::ptrdiff_t sx = 1, sy = m[0], sz = static_cast<std::ptrdiff_t>(m[0]) * m[1];
  std::fill(out.begin(), out.end(), Complex());
  const float hx = static_cast<float>(m[0] - 1), hy = static_cast<float>(m[1] - 1), hz = static_cast<float>(m[2] - 1);
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j) {
      const double left = r2 - (k - middle) * (k - middle) - (j - middle) * (j - middle);
      if (left < 0.0)
        continue;
      const int begin = std::max(0, static_cast<int>(std::ceil(middle - std::sqrt(left)))),
                end = std::min(n[0] - 1, static_cast<int>(std::floor(middle + std::sqrt(left))));
      const Eigen::Vector3f start = (back * Eigen::Vector3d(-middle, j - middle, k - middle) + offset).cast<float>();
      const Eigen::Vector3f step = back.col(0).cast<float>();
      Complex* row = out.Row(j, k);
      for (int i = begin; i <= end; ++i) {
        const float x = start.x() + step.x() * i, y = start.y() + step.y() * i, z = start.z() + step.z() * i;
        if (!(x >= 0.0f && y >= 0.0f && z >= 0.0f && x < hx && y < hy && z < hz))
          continue;
        const int a = static_cast<int>(x), b = static_cast<int>(y), c = static_cast<int>(z);
        const float tx = x - a, ty = y - b, tz = z - c;
        const Complex* p = from + c * sz + b * sy + a;
        const auto mix = [](Complex u, Complex v, float t) { return u + (v - u) * t; };
        row[i] = mix(mix(mix(p[0], p[sx], tx), mix(p[sy], p[sy + sx], tx), ty),
                     mix(mix(p[sz], p[sz + sx], tx), mix(p[sz + sy], p[sz + sy + sx], tx), ty), tz);
      }
    }
}

struct Peak {
  int rotation = 0;
  Eigen::Matrix3d turn;  // from the moving region's frame to the fixed one's
  Eigen::Vector3d shift; // mm, of the centroid, in the fixed region's frame
  double score = 0.0, ncc = 0.0, weight = 0.0, sharpness = 0.0;
};

double Score(double ncc, double weight)
{
  return std::atanh(std::clamp(ncc, -0.999, 0.999)) * std::sqrt(weight);
}

// The masked NCC of two low resolution volumes at one pose.
class Comparer {
public:
  Comparer(const LowResolution& fixed, const LowResolution& moving, int every) : fixed_(fixed)
  {
    const auto view = moving.voxels.View();
    const auto& n = view.Dimensions();
    int number = 0;
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i)
          if (view(i, j, k).real() > 0.0f && number++ % every == 0) {
            points_.push_back(moving.At(i, j, k).cast<float>());
            values_.push_back(view(i, j, k));
          }
    scale_ = every;
  }

  void At(const Eigen::Matrix3d& turn, const Eigen::Vector3d& shift, double& ncc, double& weight) const
  {
    const Eigen::Matrix3f r = (turn / fixed_.edge).cast<float>();
    const Eigen::Vector3f t = ((shift - fixed_.first) / fixed_.edge).cast<float>();
    const auto& m = fixed_.voxels.Dimensions();
    const Complex* from = fixed_.voxels.View().Data();
    const float hx = static_cast<float>(m[0] - 1), hy = static_cast<float>(m[1] - 1), hz = static_cast<float>(m[2] - 1);
    const std::ptrdiff_t sx = 1, sy = m[0], sz = static_cast<std::ptrdiff_t>(m[0]) * m[1];
    double n = 0, f = 0, g = 0, ff = 0, gg = 0, fg = 0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Eigen::Vector3f q = r * points_[i] + t;
      const float x = q.x(), y = q.y(), z = q.z();
      if (!(x >= 0.0f && y >= 0.0f && z >= 0.0f && x < hx && y < hy && z < hz))
        continue;
      const int a = static_cast<int>(x), b = static_cast<int>(y), c = static_cast<int>(z);
      const float tx = x - a, ty = y - b, tz = z - c;
      const Complex* p = from + c * sz + b * sy + a;
      const auto mix = [](Complex u, Complex v, float s) { return u + (v - u) * s; };
      const Complex at = mix(mix(mix(p[0], p[sx], tx), mix(p[sy], p[sy + sx], tx), ty),
                             mix(mix(p[sz], p[sz + sx], tx), mix(p[sz + sy], p[sz + sy + sx], tx), ty), tz);
      if (at.real() <= 0.0f)
        continue;
      const float fv = at.imag() / at.real(), gv = values_[i].imag() / values_[i].real(), w = at.real() * values_[i].real();
      n += w;
      f += w * fv;
      g += w * gv;
      ff += w * fv * fv;
      gg += w * gv * gv;
      fg += w * fv * gv;
    }
    weight = n * scale_;
    ncc = 0.0;
    if (n <= 0.0)
      return;
    const double vf = ff / n - f / n * f / n, vg = gg / n - g / n * g / n;
    if (vf > 1e-9 && vg > 1e-9)
      ncc = std::clamp((fg / n - f / n * g / n) / std::sqrt(vf * vg), -1.0, 1.0);
  }

private:
  const LowResolution& fixed_;
  std::vector<Eigen::Vector3f> points_;
  std::vector<Complex> values_;
  double scale_ = 1.0;
};

// Root mean square displacement of the moving region between two poses.
double Apart(const Peak& a, const Peak& b, const Eigen::Matrix3d& spread)
{
  const Eigen::Matrix3d d = a.turn - b.turn;
  return std::sqrt(std::max(0.0, (d * spread * d.transpose()).trace() + (a.shift - b.shift).squaredNorm()));
}

// The best of the peaks, none closer than \a distance to a better one.
std::vector<Peak> Distinct(std::vector<Peak> peaks, const Eigen::Matrix3d& spread, double distance, std::size_t most)
{
  std::stable_sort(peaks.begin(), peaks.end(), [](const Peak& a, const Peak& b) { return a.score > b.score; });
  std::vector<Peak> kept;
  for (const Peak& peak : peaks) {
    if (kept.size() >= most)
      break;
    if (std::none_of(kept.begin(), kept.end(), [&](const Peak& k) { return Apart(k, peak, spread) < distance; }))
      kept.push_back(peak);
  }
  return kept;
}

} // namespace

void GlobalSearchParameters::Check() const
{
  const auto check = [](bool good, const char* message) {
    if (!good)
      throw Error(Error::Kind::InvalidParameter, message);
  };
  check(coneDegrees >= 0.0 && coneDegrees <= 180.0, "the cone of rotations must be in [0, 180] degrees");
  check(reachMm > 0.0, "the reach must be more than 0 mm");
  check(minimumOverlap > 0.0 && minimumOverlap <= 1.0, "the minimum overlap must be in (0, 1]");
  check(resolution >= 16 && resolution <= 96, "the resolution must be in [16, 96] voxels");
  check(stepDegrees == 0.0 || (stepDegrees >= 2.0 && stepDegrees <= 45.0),
        "the step between rotations must be in [2, 45] degrees, or 0");
  check(candidates >= 1 && candidates <= 1000, "the number of candidates must be in [1, 1000]");
}

GlobalSearchResult GlobalSearch(const PlacedVolume& fixed, const PlacedVolume& moving, const GlobalSearchParameters& p,
                                const Progress& progress)
{
  p.Check();
  CheckVolume(fixed);
  CheckVolume(moving);
  const Region fixedRegion(fixed), movingRegion(moving);
  const double extent = std::max(fixedRegion.box.sizes().maxCoeff(), movingRegion.box.sizes().maxCoeff());
  const double fineEdge = extent / p.resolution, coarseEdge = fineEdge * CoarseVoxels;
  const double sigmaMm = NeighbourhoodShare * extent;
  const LowResolution f = Reduce(fixed, fixedRegion, coarseEdge, sigmaMm / coarseEdge),
                      m = Reduce(moving, movingRegion, coarseEdge, sigmaMm / coarseEdge);

  // World and frames.
  const Pose fixedToWorld = fixed.volumeToWorld * fixedRegion.toVolume,
             movingToWorld = moving.volumeToWorld * movingRegion.toVolume;
  const Eigen::Vector3d startShift = fixedToWorld.inverse() * movingToWorld.translation();

  const double step = p.stepDegrees > 0.0 ? p.stepDegrees : DefaultStepDegrees;
  const std::vector<Eigen::Matrix3d> cover = RotationCover(p.coneDegrees, step);

  const int side = 2 * static_cast<int>(std::ceil(movingRegion.radius / coarseEdge)) + 1;
  const std::array<int, 3> movingDimensions{side, side, side};
  const double least = p.minimumOverlap * std::min(fixedRegion.volumeMm3, movingRegion.volumeMm3) / std::pow(coarseEdge, 3);
  // shift s of the grid: moving voxel i at fixed voxel i + s
  const Eigen::Vector3d fixedFirst = f.first / coarseEdge;
  const double middle = 0.5 * (side - 1);
  ShiftRange range;
  for (int axis = 0; axis < 3; ++axis) {
    range.first[axis] = 1 - side + 2;
    range.last[axis] = f.voxels.Dimensions()[axis] - 1 - 2;
    // centroid at fixed index s + middle -> mm: (s + middle) * edge + first
    if (std::isfinite(p.reachMm)) {
      const double at = startShift[axis] / coarseEdge - fixedFirst[axis] - middle, reach = p.reachMm / coarseEdge;
      range.first[axis] = std::max<int>(range.first[axis], static_cast<int>(std::max(-1e6, std::floor(at - reach))));
      range.last[axis] = std::min<int>(range.last[axis], static_cast<int>(std::min(1e6, std::ceil(at + reach))));
    }
    if (range.last[axis] < range.first[axis])
      range.last[axis] = range.first[axis];
  }
  const MaskedCorrelator correlator(f.voxels.View(), movingDimensions, range);
  const auto counts = range.Counts();
  std::vector<std::vector<Peak>> found(cover.size());
  const std::ptrdiff_t grain = 8;
  ParallelRanges(
      static_cast<std::ptrdiff_t>(cover.size()), grain, progress.Part(0.0, 0.7), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
        MaskedCorrelator::Work work;
        Volume<Complex> turned(movingDimensions), sums(counts);
        Volume<float> scores(counts);
        for (std::ptrdiff_t r = begin; r < end; ++r) {
          const Eigen::Matrix3d turn =
              fixedToWorld.linear().transpose() * cover[static_cast<std::size_t>(r)] * movingToWorld.linear();
          Turn(m, turn, movingRegion.radius, turned.View());
          correlator.Products(turned.View(), sums.View(), work);
          const auto s = sums.View();
          const auto score = scores.View();
          double mean = 0.0, square = 0.0;
          std::ptrdiff_t allowed = 0;
          for (std::ptrdiff_t i = 0; i < s.Size(); ++i) {
            const double n = static_cast<double>(s[i].real());
            float value = -1e9f;
            if (n >= least) {
              value = static_cast<float>(Score(static_cast<double>(s[i].imag()) / n, n));
              mean += static_cast<double>(value);
              square += static_cast<double>(value) * static_cast<double>(value);
              ++allowed;
            }
            score[i] = value;
          }
          if (allowed == 0)
            continue;
          mean /= static_cast<double>(allowed);
          const double deviation = std::sqrt(std::max(1e-12, square / static_cast<double>(allowed) - mean * mean));
          auto& peaks = found[static_cast<std::size_t>(r)];
          for (int k = 0; k < counts[2]; ++k)
            for (int j = 0; j < counts[1]; ++j)
              for (int i = 0; i < counts[0]; ++i) {
                const float here = score(i, j, k);
                if (here <= 0.0f || (peaks.size() == PeaksPerRotation && static_cast<double>(here) <= peaks.back().score))
                  continue;
                bool top = true;
                for (int c = std::max(0, k - 1); top && c <= std::min(counts[2] - 1, k + 1); ++c)
                  for (int b = std::max(0, j - 1); top && b <= std::min(counts[1] - 1, j + 1); ++b)
                    for (int a = std::max(0, i - 1); a <= std::min(counts[0] - 1, i + 1); ++a)
                      if (score(a, b, c) > here) {
                        top = false;
                        break;
                      }
                if (!top)
                  continue;
                const auto fit = [&](int d, int at, int count) {
                  if (at == 0 || at + 1 == count)
                    return 0.0;
                  const double low = static_cast<double>(score(i - (d == 0), j - (d == 1), k - (d == 2))),
                               high = static_cast<double>(score(i + (d == 0), j + (d == 1), k + (d == 2))),
                               bend = low + high - 2.0 * static_cast<double>(here);
                  return low < -1e8 || high < -1e8 || bend >= 0.0 ? 0.0 : std::clamp(0.5 * (low - high) / bend, -0.5, 0.5);
                };
                Peak peak;
                peak.rotation = static_cast<int>(r);
                peak.turn = turn;
                peak.shift = coarseEdge * (Eigen::Vector3d(range.first[0] + i + fit(0, i, counts[0]),
                                                           range.first[1] + j + fit(1, j, counts[1]),
                                                           range.first[2] + k + fit(2, k, counts[2])) +
                                           Eigen::Vector3d::Constant(middle) + fixedFirst);
                if ((peak.shift - startShift).norm() > p.reachMm)
                  continue;
                peak.score = static_cast<double>(here);
                peak.sharpness = (peak.score - mean) / deviation;
                peak.weight = static_cast<double>(s(i, j, k).real());
                peak.ncc = static_cast<double>(s(i, j, k).imag()) / peak.weight;
                peaks.insert(std::upper_bound(peaks.begin(), peaks.end(), peak,
                                              [](const Peak& x, const Peak& y) { return x.score > y.score; }),
                             peak);
                if (peaks.size() > PeaksPerRotation)
                  peaks.pop_back();
              }
        }
      });
  std::vector<Peak> all;
  for (const auto& peaks : found)
    all.insert(all.end(), peaks.begin(), peaks.end());

  const double near = step * RadiansPerDegree * std::sqrt(movingRegion.spread.trace() * 2.0 / 3.0);
  std::vector<Peak> kept = Distinct(all, movingRegion.spread, 0.5 * near, RefinedPeaks);

  {
    const LowResolution fineFixed = Reduce(fixed, fixedRegion, fineEdge, sigmaMm / fineEdge),
                        fineMoving = Reduce(moving, movingRegion, fineEdge, sigmaMm / fineEdge);
    const Comparer comparer(fineFixed, fineMoving, RefinedShare);
    const double unit = std::pow(fineEdge / coarseEdge, 3.0);
    const double rms = std::sqrt(movingRegion.spread.trace() * 2.0 / 3.0);
    ParallelFor(static_cast<std::ptrdiff_t>(kept.size()), progress.Part(0.7, 1.0), [&](std::ptrdiff_t number) {
      Peak& peak = kept[static_cast<std::size_t>(number)];
      const auto evaluate = [&](Peak& at) {
        comparer.At(at.turn, at.shift, at.ncc, at.weight);
        at.weight *= unit; // in coarse voxels
        at.score = at.weight < least ? -1e9 : Score(at.ncc, at.weight);
      };
      evaluate(peak);
      double mm = coarseEdge;
      for (int level = 0; level < RefiningLevels; ++level, mm *= 0.5)
        for (int sweep = 0; sweep < RefiningSweeps; ++sweep) {
          const double before = peak.score;
          for (int d = 0; d < 6; ++d)
            for (const double sign : {1.0, -1.0}) {
              Peak trial = peak;
              if (d < 3)
                trial.shift[d] += sign * mm;
              else
                trial.turn = ExpRotation(sign * mm / rms * Eigen::Vector3d::Unit(d - 3)) * peak.turn;
              evaluate(trial);
              if (trial.score > peak.score) {
                peak = trial;
                break;
              }
            }
          if (peak.score <= before)
            break;
        }
    });
    kept = Distinct(kept, movingRegion.spread, 0.7 * near, static_cast<std::size_t>(p.candidates));
  }
  if (kept.size() > static_cast<std::size_t>(p.candidates))
    kept.resize(static_cast<std::size_t>(p.candidates));

  GlobalSearchResult result;
  result.rotations = static_cast<int>(cover.size());
  result.voxelMm = fineEdge;
  const double smaller = least / p.minimumOverlap;
  for (const Peak& peak : kept) {
    GlobalCandidate c;
    Pose regionToRegion = Pose::Identity();
    regionToRegion.linear() = peak.turn;
    regionToRegion.translation() = peak.shift;
    c.volumeToWorld = fixedToWorld * regionToRegion * movingRegion.toVolume.inverse();
    c.volumeToWorld.linear() = Eigen::Quaterniond(c.volumeToWorld.linear()).normalized().toRotationMatrix();
    c.ncc = peak.ncc;
    c.overlap = std::min(1.0, peak.weight / smaller);
    c.sharpness = peak.sharpness;
    result.candidates.push_back(c);
  }
  progress(1.0);
  return result;
}

} // namespace echorama
