// SPDX-License-Identifier: BSD-3-Clause
// Points are drawn once per level, at random places in random voxels of both volumes, one in each stratum of voxels in the
// order of memory: neighbouring points read neighbouring voxels. They lie between voxels on purpose: then both volumes are
// read with the same blur, and no pose is better only because the grids fall together. At a pose each point is read in the other
// volume, value, weight and gradient from the same eight voxels; the gradient is that of the interpolation itself.
//
// What is read goes into small arrays of one block, and sums run over these in lanes: no branches, and the order of additions
// depends neither on how wide the machine is nor on the threads.
//
// Loss of a difference r: 2 d^2 (sqrt(1 + r^2 / d^2) - 1), which is r^2 for small and 2 d |r| for large differences. What points
// differ by chance is measured on random pairs of points; similarity is 1 less loss over chance.
//
// Cost: per point and pose 8 reads and some 100 multiplications.
#include "Core/Base/Multiversion.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Metric.h"
#include <algorithm>
#include <cmath>
#include <map>

namespace echorama {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr int BlockSize = 256, Lanes = 16;
constexpr std::ptrdiff_t Grain = 8 * BlockSize; // points of one task
constexpr int ChancePairs = 30000;

struct Map {
  float xx, xy, xz, x0, yx, yy, yz, y0, zx, zy, zz, z0;
};

Map MapOf(const Eigen::Affine3d& a)
{
  const Eigen::Matrix<float, 3, 4> m = a.matrix().topRows<3>().cast<float>();
  return {m(0, 0), m(0, 1), m(0, 2), m(0, 3), m(1, 0), m(1, 1), m(1, 2), m(1, 3), m(2, 0), m(2, 1), m(2, 2), m(2, 3)};
}

// The voxels of the volume that is read: value, weight, value, weight ...; at least two along each axis.
struct Field {
  const float* seen;
  int nx, ny, nz;
};

// What a block of points reads, one array per quantity. Beyond the last point weights are 0.
struct Terms {
  float r[BlockSize], w[BlockSize], covered[BlockSize];
  float jacobian[6][BlockSize]; // of r by the twist, without the direction's sign
  float x[BlockSize], y[BlockSize], z[BlockSize];
  float curved[BlockSize];     // w times the loss's weight of r
  float curvedJ[6][BlockSize]; // times the Jacobian
};

// Values are brought to a common scale: ours * valueScale + valueOffset, theirs * readScale + readOffset.
struct Fit {
  float readScale = 1.0f, readOffset = 0.0f, valueScale = 1.0f, valueOffset = 0.0f;
};

// Reads the field at moved points: index gradients in g, differences in t.r, weights in t.w.
ECHORAMA_HOT void Read(const Field& field, const Map& m, const Fit& fit, const float* px, const float* py, const float* pz,
                       const float* value, const float* weight, int count, float* r, float* w, float* covered, float* gx,
                       float* gy, float* gz)
{
  const float* seen = field.seen;
  const int row = 2 * field.nx, slice = row * field.ny;
  const int lastX = field.nx - 2, lastY = field.ny - 2, lastZ = field.nz - 2;
  const float endX = static_cast<float>(field.nx - 1), endY = static_cast<float>(field.ny - 1),
              endZ = static_cast<float>(field.nz - 1);
  for (int p = 0; p < count; ++p) {
    const float x = m.xx * px[p] + m.xy * py[p] + m.xz * pz[p] + m.x0;
    const float y = m.yx * px[p] + m.yy * py[p] + m.yz * pz[p] + m.y0;
    const float z = m.zx * px[p] + m.zy * py[p] + m.zz * pz[p] + m.z0;
    const float cx = x > 0.0f ? (x < endX ? x : endX) : 0.0f;
    const float cy = y > 0.0f ? (y < endY ? y : endY) : 0.0f;
    const float cz = z > 0.0f ? (z < endZ ? z : endZ) : 0.0f;
    const int ix = static_cast<int>(cx), iy = static_cast<int>(cy), iz = static_cast<int>(cz);
    const int i = ix < lastX ? ix : lastX, j = iy < lastY ? iy : lastY, k = iz < lastZ ? iz : lastZ;
    const float tx = cx - static_cast<float>(i), ty = cy - static_cast<float>(j), tz = cz - static_cast<float>(k);
    const int c = k * slice + j * row + 2 * i;
    const float inside = (x >= 0.0f) & (y >= 0.0f) & (z >= 0.0f) & (x <= endX) & (y <= endY) & (z <= endZ) ? 1.0f : 0.0f;
    const float a0 = seen[c], a1 = seen[c + 2], b0 = seen[c + row], b1 = seen[c + row + 2];
    const float c0 = seen[c + slice], c1 = seen[c + slice + 2], d0 = seen[c + slice + row], d1 = seen[c + slice + row + 2];
    const float da = a1 - a0, db = b1 - b0, dc = c1 - c0, dd = d1 - d0;
    const float a = a0 + tx * da, b = b0 + tx * db, cc = c0 + tx * dc, d = d0 + tx * dd;
    const float ab = a + ty * (b - a), cd = cc + ty * (d - cc);
    const float dab = da + ty * (db - da), dcd = dc + ty * (dd - dc);
    const float v = ab + tz * (cd - ab);
    gx[p] = fit.readScale * (dab + tz * (dcd - dab));
    gy[p] = fit.readScale * ((b - a) + tz * ((d - cc) - (b - a)));
    gz[p] = fit.readScale * (cd - ab);
    const float ux = 1.0f - tx, uy = 1.0f - ty, uz = 1.0f - tz;
    const float u = uz * (uy * (ux * seen[c + 1] + tx * seen[c + 3]) + ty * (ux * seen[c + row + 1] + tx * seen[c + row + 3])) +
                    tz * (uy * (ux * seen[c + slice + 1] + tx * seen[c + slice + 3]) +
                          ty * (ux * seen[c + slice + row + 1] + tx * seen[c + slice + row + 3]));
    r[p] = fit.readScale * v + fit.readOffset - (fit.valueScale * value[p] + fit.valueOffset);
    w[p] = inside * weight[p] * u;
    covered[p] = u > 1e-6f ? inside * weight[p] : 0.0f;
  }
}

// From index gradients (in jacobian[0..2]) to the Jacobian by the twist, and the loss's weights.
ECHORAMA_HOT void Twist6(const Map& toCentre, const Map& toWorld, float inverseScale2, const float* px, const float* py,
                         const float* pz, int count, Terms& t)
{
  for (int p = 0; p < count; ++p) {
    const float x = toCentre.xx * px[p] + toCentre.xy * py[p] + toCentre.xz * pz[p] + toCentre.x0;
    const float y = toCentre.yx * px[p] + toCentre.yy * py[p] + toCentre.yz * pz[p] + toCentre.y0;
    const float z = toCentre.zx * px[p] + toCentre.zy * py[p] + toCentre.zz * pz[p] + toCentre.z0;
    const float i = t.jacobian[0][p], j = t.jacobian[1][p], k = t.jacobian[2][p];
    const float gx = toWorld.xx * i + toWorld.xy * j + toWorld.xz * k;
    const float gy = toWorld.yx * i + toWorld.yy * j + toWorld.yz * k;
    const float gz = toWorld.zx * i + toWorld.zy * j + toWorld.zz * k;
    t.x[p] = x;
    t.y[p] = y;
    t.z[p] = z;
    t.jacobian[0][p] = gx;
    t.jacobian[1][p] = gy;
    t.jacobian[2][p] = gz;
    t.jacobian[3][p] = y * gz - z * gy;
    t.jacobian[4][p] = z * gx - x * gz;
    t.jacobian[5][p] = x * gy - y * gx;
    const float q = t.w[p] / std::sqrt(1.0f + t.r[p] * t.r[p] * inverseScale2);
    t.curved[p] = q;
    for (int d = 0; d < 6; ++d)
      t.curvedJ[d][p] = q * t.jacobian[d][p];
  }
}

inline double Fold(const float* lanes)
{
  double sum = 0.0;
  for (int lane = 0; lane < Lanes; ++lane)
    sum += static_cast<double>(lanes[lane]);
  return sum;
}

inline double Sum(const float* a)
{
  float lanes[Lanes] = {};
  for (int p = 0; p < BlockSize; p += Lanes)
    for (int lane = 0; lane < Lanes; ++lane)
      lanes[lane] += a[p + lane];
  return Fold(lanes);
}

inline double Dot(const float* a, const float* b)
{
  float lanes[Lanes] = {};
  for (int p = 0; p < BlockSize; p += Lanes)
    for (int lane = 0; lane < Lanes; ++lane)
      lanes[lane] += a[p + lane] * b[p + lane];
  return Fold(lanes);
}

// Sums of one direction.
struct Raw {
  double weight = 0.0, loss = 0.0, covered = 0.0;
  double moment[3] = {}, gradient[6] = {}, hessian[21] = {};
  double values[5] = {}; // of theirs t and ours o: t, o, tt, oo, to, weighted (for the fit)
  double slopes[6] = {}, theirSlopes[6] = {}, residualTheirs = 0.0; // J, t J, r t, weighted (with a fit)

  void operator+=(const Raw& o)
  {
    weight += o.weight;
    loss += o.loss;
    covered += o.covered;
    const auto add = [](double* a, const double* b, int n) {
      for (int i = 0; i < n; ++i)
        a[i] += b[i];
    };
    add(moment, o.moment, 3);
    add(gradient, o.gradient, 6);
    add(hessian, o.hessian, 21);
    add(values, o.values, 5);
    add(slopes, o.slopes, 6);
    add(theirSlopes, o.theirSlopes, 6);
    residualTheirs += o.residualTheirs;
  }
};

ECHORAMA_HOT void Accumulate(const Terms& t, float scale2, Raw& raw)
{
  float lanes[Lanes] = {};
  for (int p = 0; p < BlockSize; p += Lanes)
    for (int lane = 0; lane < Lanes; ++lane) {
      const float r2 = t.r[p + lane] * t.r[p + lane];
      lanes[lane] += t.w[p + lane] * (2.0f * r2 / (1.0f + std::sqrt(1.0f + r2 / scale2)));
    }
  raw.loss += Fold(lanes);
  raw.weight += Sum(t.w);
  raw.covered += Sum(t.covered);
  raw.moment[0] += Dot(t.w, t.x);
  raw.moment[1] += Dot(t.w, t.y);
  raw.moment[2] += Dot(t.w, t.z);
  int k = 0;
  for (int i = 0; i < 6; ++i) {
    raw.gradient[i] += Dot(t.r, t.curvedJ[i]);
    for (int j = 0; j <= i; ++j)
      raw.hessian[k++] += Dot(t.jacobian[j], t.curvedJ[i]);
  }
}

// With a fit: how the fit itself moves with the pose.
ECHORAMA_HOT void AccumulateFit(const Terms& t, const float* theirs, Raw& raw)
{
  float weighted[BlockSize];
  for (int p = 0; p < BlockSize; ++p)
    weighted[p] = t.curved[p] * theirs[p];
  for (int i = 0; i < 6; ++i) {
    raw.slopes[i] += Sum(t.curvedJ[i]);
    raw.theirSlopes[i] += Dot(weighted, t.jacobian[i]);
  }
  raw.residualTheirs += Dot(weighted, t.r);
}

ECHORAMA_HOT void AccumulateValues(const Terms& t, const float* ours, Raw& raw)
{
  float wt[BlockSize], wo[BlockSize];
  for (int p = 0; p < BlockSize; ++p) {
    wt[p] = t.w[p] * t.r[p];
    wo[p] = t.w[p] * ours[p];
  }
  raw.weight += Sum(t.w);
  raw.values[0] += Sum(wt);
  raw.values[1] += Sum(wo);
  raw.values[2] += Dot(wt, t.r);
  raw.values[3] += Dot(wo, ours);
  raw.values[4] += Dot(wt, ours);
}

// Points of one volume: where (mm, from the volume's centre, as its geometry stands), what it shows there, and how much
// that counts.
struct Points {
  std::vector<float> x, y, z, value, weight;
  std::vector<int> block; // of tissue
  double mm3 = 0.0;       // that one of them stands for
  double weights = 0.0, squares = 0.0;
  std::ptrdiff_t Count() const { return static_cast<std::ptrdiff_t>(x.size()); }
};

double Uniform(std::uint32_t bits)
{
  return static_cast<double>(bits) * (1.0 / 4294967296.0);
}

// Where points fall, in continuous index coordinates.
std::vector<Eigen::Vector3f> Draw(const MetricLevel& level, int points, std::uint64_t seed, std::ptrdiff_t& eligible)
{
  const auto& n = level.geometry.dimensions;
  const std::ptrdiff_t slice = static_cast<std::ptrdiff_t>(n[0]) * n[1];
  const float* seen = level.seen.data();
  std::vector<std::ptrdiff_t> before(static_cast<std::size_t>(n[2] + 1), 0);
  ParallelFor(n[2], [&](std::ptrdiff_t k) {
    std::ptrdiff_t real = 0;
    for (std::ptrdiff_t i = k * slice; i < (k + 1) * slice; ++i)
      real += seen[2 * i + 1] > 0.0f;
    before[static_cast<std::size_t>(k + 1)] = real;
  });
  for (std::size_t k = 1; k < before.size(); ++k)
    before[k] += before[k - 1];
  eligible = before.back();
  const std::ptrdiff_t count = std::min<std::ptrdiff_t>(points, eligible);
  std::vector<Eigen::Vector3f> drawn(static_cast<std::size_t>(count));
  if (count == 0)
    return drawn;
  const auto first = [&](std::ptrdiff_t s) { return eligible / count * s + eligible % count * s / count; };
  ParallelFor(n[2], [&](std::ptrdiff_t k) {
    std::ptrdiff_t rank = before[static_cast<std::size_t>(k)];
    const std::ptrdiff_t end = before[static_cast<std::size_t>(k + 1)];
    if (rank == end)
      return;
    std::ptrdiff_t stratum = std::max<std::ptrdiff_t>(
        0,
        static_cast<std::ptrdiff_t>(static_cast<double>(rank) / static_cast<double>(eligible) * static_cast<double>(count)) - 2);
    std::array<std::uint32_t, 4> bits{};
    const auto pick = [&](std::ptrdiff_t s) {
      Random random(seed, static_cast<std::uint64_t>(s));
      for (auto& b : bits)
        b = random.Bits();
      return first(s) + static_cast<std::ptrdiff_t>(Uniform(bits[0]) * static_cast<double>(first(s + 1) - first(s)));
    };
    std::ptrdiff_t wanted = pick(stratum);
    while (wanted < rank && ++stratum < count)
      wanted = pick(stratum);
    for (std::ptrdiff_t i = k * slice; i < (k + 1) * slice && stratum < count && wanted < end; ++i) {
      if (!(seen[2 * i + 1] > 0.0f))
        continue;
      if (rank++ != wanted)
        continue;
      const std::ptrdiff_t inSlice = i - k * slice;
      drawn[static_cast<std::size_t>(stratum)] = {
          static_cast<float>(static_cast<double>(inSlice % n[0]) + Uniform(bits[1]) - 0.5),
          static_cast<float>(static_cast<double>(inSlice / n[0]) + Uniform(bits[2]) - 0.5),
          static_cast<float>(static_cast<double>(k) + Uniform(bits[3]) - 0.5)};
      if (++stratum < count)
        wanted = pick(stratum);
    }
  });
  return drawn;
}

class PointComparison : public LevelComparison {
public:
  explicit PointComparison(const ComparisonSetup& setup) : setup_(setup)
  {
    scale_ = static_cast<float>(setup.metric->lossScale);
    for (int side = 0; side < 2; ++side) {
      const MetricLevel& level = side == 0 ? *setup.fixed : *setup.moving;
      centres_[side] = level.geometry.Centre();
      worldToIndex_[side] = level.geometry.WorldToIndex();
      const auto& n = level.geometry.dimensions;
      fields_[side] = {level.seen.data(), n[0], n[1], n[2]};
      points_[side] = Take(level, side);
    }
    smallerWeight_ = std::min(points_[0].mm3 * points_[0].squares, points_[1].mm3 * points_[1].squares);
    chance_ = setup.metric->fitsOverlap ? 2.0 : Chance();
  }

  MetricSums At(const Pose& movingToWorld, const Eigen::Vector3d& centre, BlockGradients* blocks) const override
  {
    MetricSums sums;
    if (blocks)
      blocks->assign(static_cast<std::size_t>(blockCount_), Vector6::Zero());
    for (int side = 0; side < 2; ++side) {
      const Points& points = points_[side];
      if (points.Count() == 0)
        continue;
      const Pose& from = side == 0 ? setup_.fixedToWorld : movingToWorld;
      const Pose to = (side == 0 ? movingToWorld : setup_.fixedToWorld).inverse(Eigen::Isometry);
      Eigen::Affine3d pointToWorld = Eigen::Affine3d(from) * Eigen::Translation3d(centres_[side]);
      const Eigen::Affine3d worldToIndex = worldToIndex_[1 - side] * to;
      const Map toIndex = MapOf(worldToIndex * pointToWorld);
      pointToWorld.translation() -= centre;
      const Map toCentre = MapOf(pointToWorld), toWorld = MapOf(Eigen::Affine3d(worldToIndex.linear().transpose()));
      const Field& field = fields_[1 - side];

      Fit fit;
      if (setup_.metric->fitsOverlap)
        fit = FitOf(field, toIndex, points);
      const Raw raw = ParallelSum<Raw>(points.Count(), Grain, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
        Raw part;
        for (std::ptrdiff_t b = begin; b < end; b += BlockSize) {
          Terms t;
          Fill(field, toIndex, fit, points, b, end, t);
          Twist6(toCentre, toWorld, 1.0f / (scale_ * scale_), &points.x[b], &points.y[b], &points.z[b],
                 static_cast<int>(std::min<std::ptrdiff_t>(BlockSize, end - b)), t);
          Accumulate(t, scale_ * scale_, part);
          if (setup_.metric->fitsOverlap)
            AddFit(fit, points, b, end, t, part);
        }
        return part;
      });
      const double share = 0.5 * points.mm3, sign = side == 0 ? -1.0 : 1.0;
      AddTo(sums, raw, share, sign);
      sums.moment += share * raw.weight * centre;
      if (points_[side].mm3 * points_[side].weights <= points_[1 - side].mm3 * points_[1 - side].weights)
        sums.share = points.weights > 0.0 ? raw.covered / points.weights : 0.0;
      if (blocks)
        AddBlocks(field, toIndex, toCentre, toWorld, fit, raw, points, share * sign, *blocks);
    }
    sums.similar = sums.weight - sums.loss / chance_;
    return sums;
  }

private:
  static void Fill(const Field& field, const Map& toIndex, const Fit& fit, const Points& points, std::ptrdiff_t begin,
                   std::ptrdiff_t end, Terms& t)
  {
    const int count = static_cast<int>(std::min<std::ptrdiff_t>(BlockSize, end - begin));
    if (count < BlockSize)
      t = Terms{};
    Read(field, toIndex, fit, &points.x[begin], &points.y[begin], &points.z[begin], &points.value[begin], &points.weight[begin],
         count, t.r, t.w, t.covered, t.jacobian[0], t.jacobian[1], t.jacobian[2]);
  }

  // Scales both sides to mean 0 and deviation 1 over the overlap.
  static Fit FitOf(const Field& field, const Map& toIndex, const Points& points)
  {
    const Raw raw = ParallelSum<Raw>(points.Count(), Grain, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
      Raw part;
      const Fit bare{1.0f, 0.0f, 0.0f, 0.0f};
      for (std::ptrdiff_t b = begin; b < end; b += BlockSize) {
        Terms t;
        Fill(field, toIndex, bare, points, b, end, t);
        float ours[BlockSize] = {};
        std::copy_n(&points.value[b], std::min<std::ptrdiff_t>(BlockSize, end - b), ours);
        AccumulateValues(t, ours, part);
      }
      return part;
    });
    Fit fit;
    if (!(raw.weight > 0.0))
      return fit;
    const double w = raw.weight, t = raw.values[0] / w, o = raw.values[1] / w;
    const double tt = std::fmax(raw.values[2] / w - t * t, 1e-12), oo = std::fmax(raw.values[3] / w - o * o, 1e-12);
    fit.readScale = static_cast<float>(1.0 / std::sqrt(tt));
    fit.readOffset = static_cast<float>(-t / std::sqrt(tt));
    fit.valueScale = static_cast<float>(1.0 / std::sqrt(oo));
    fit.valueOffset = static_cast<float>(-o / std::sqrt(oo));
    return fit;
  }

  static void AddFit(const Fit& fit, const Points& points, std::ptrdiff_t begin, std::ptrdiff_t end, const Terms& t, Raw& part)
  {
    float theirs[BlockSize] = {};
    for (std::ptrdiff_t p = begin; p < std::min(end, begin + BlockSize); ++p)
      theirs[p - begin] = t.r[p - begin] + fit.valueScale * points.value[static_cast<std::size_t>(p)] + fit.valueOffset;
    AccumulateFit(t, theirs, part);
  }

  void AddTo(MetricSums& sums, const Raw& raw, double share, double sign) const
  {
    Vector6 gradient, slopes, theirs;
    Matrix6 hessian;
    int k = 0;
    for (int i = 0; i < 6; ++i) {
      gradient[i] = raw.gradient[i];
      slopes[i] = raw.slopes[i];
      theirs[i] = raw.theirSlopes[i];
      for (int j = 0; j <= i; ++j)
        hessian(i, j) = hessian(j, i) = raw.hessian[k++];
    }
    if (setup_.metric->fitsOverlap && raw.weight > 0.0) {
      gradient -= raw.residualTheirs / raw.weight * theirs;
      hessian -= (slopes * slopes.transpose() + theirs * theirs.transpose()) / raw.weight;
    }
    sums.weight += share * raw.weight;
    sums.loss += share * raw.loss;
    sums.moment += share * Eigen::Vector3d(raw.moment[0], raw.moment[1], raw.moment[2]);
    sums.gradient += share * sign * gradient;
    sums.hessian += share * hessian;
  }

  // The gradient's parts by blocks of tissue, one point after the other.
  void AddBlocks(const Field& field, const Map& toIndex, const Map& toCentre, const Map& toWorld, const Fit& fit, const Raw& raw,
                 const Points& points, double factor, BlockGradients& blocks) const
  {
    Vector6 slopes = Vector6::Zero(), theirSlopes = Vector6::Zero();
    if (setup_.metric->fitsOverlap && raw.weight > 0.0) {
      slopes = Eigen::Map<const Vector6>(raw.slopes) / raw.weight;
      theirSlopes = Eigen::Map<const Vector6>(raw.theirSlopes) / raw.weight;
    }
    for (std::ptrdiff_t b = 0; b < points.Count(); b += BlockSize) {
      Terms t;
      Fill(field, toIndex, fit, points, b, points.Count(), t);
      const int count = static_cast<int>(std::min<std::ptrdiff_t>(BlockSize, points.Count() - b));
      Twist6(toCentre, toWorld, 1.0f / (scale_ * scale_), &points.x[b], &points.y[b], &points.z[b], count, t);
      for (int p = 0; p < count; ++p) {
        const double r = factor * static_cast<double>(t.r[p]), w = static_cast<double>(t.curved[p]);
        if (w == 0.0)
          continue;
        const std::size_t at = static_cast<std::size_t>(b + p);
        const double theirs = static_cast<double>(t.r[p] + fit.valueScale * points.value[at] + fit.valueOffset);
        Vector6& block = blocks[static_cast<std::size_t>(points.block[at])];
        for (int d = 0; d < 6; ++d)
          block[d] += r * (static_cast<double>(t.curvedJ[d][p]) - w * (slopes[d] + theirs * theirSlopes[d]));
      }
    }
  }

  Points Take(const MetricLevel& level, int side)
  {
    std::ptrdiff_t eligible = 0;
    const std::vector<Eigen::Vector3f> drawn = Draw(level, setup_.points, setup_.seed, eligible);
    Points points;
    if (drawn.empty())
      return points;
    points.mm3 = level.geometry.spacing.prod() * static_cast<double>(eligible) / static_cast<double>(drawn.size());
    const Eigen::Affine3d toWorld = level.geometry.IndexToWorld();
    const Eigen::Affine3d toFixed =
        side == 0 ? toWorld : Eigen::Affine3d(setup_.fixedToWorld.inverse(Eigen::Isometry) * setup_.startToWorld) * toWorld;
    const double blockMm = setup_.blockMm;
    const std::size_t count = drawn.size();
    std::vector<float> r(count), w(count), covered(count), g(3 * count), x(count), y(count), z(count);
    for (std::size_t p = 0; p < count; ++p) {
      x[p] = drawn[p].x();
      y[p] = drawn[p].y();
      z[p] = drawn[p].z();
    }
    // Its own value there: read as the other volume is.
    const std::vector<float> zero(count, 0.0f), one(count, 1.0f);
    const Map same = MapOf(Eigen::Affine3d::Identity());
    ParallelRanges(static_cast<std::ptrdiff_t>(count), Grain, {}, [&](std::ptrdiff_t b, std::ptrdiff_t e) {
      Read(fields_[side], same, {}, &x[b], &y[b], &z[b], &zero[b], &one[b], static_cast<int>(e - b), &r[b], &w[b], &covered[b],
           &g[b], &g[count + b], &g[2 * count + b]);
    });
    for (std::size_t p = 0; p < count; ++p) {
      if (!(w[p] > 0.0f))
        continue;
      const Eigen::Vector3d at = drawn[p].cast<double>(), inFixed = toFixed * at / blockMm;
      const Eigen::Vector3i block = inFixed.array().floor().cast<int>();
      if (setup_.part != 0 && ((block.sum() % 2 + 2) % 2) + 1 != setup_.part)
        continue;
      const Eigen::Vector3f own = (toWorld * at - centres_[side]).cast<float>();
      points.x.push_back(own.x());
      points.y.push_back(own.y());
      points.z.push_back(own.z());
      points.value.push_back(r[p]);
      points.weight.push_back(w[p]);
      points.block.push_back(BlockNumber(block));
      points.weights += static_cast<double>(w[p]);
      points.squares += static_cast<double>(w[p]) * static_cast<double>(w[p]);
    }
    return points;
  }

  int BlockNumber(const Eigen::Vector3i& block)
  {
    const auto [at, isNew] = numbers_.try_emplace({block.x(), block.y(), block.z()}, blockCount_);
    blockCount_ += isNew;
    return at->second;
  }

  // The mean loss of points that have nothing to do with each other.
  double Chance() const
  {
    const Points &a = points_[0], &b = points_[1];
    if (a.Count() == 0 || b.Count() == 0)
      return 1.0;
    double loss = 0.0, weight = 0.0;
    const double scale2 = setup_.metric->lossScale * setup_.metric->lossScale;
    for (std::uint64_t pair = 0; pair < ChancePairs; ++pair) {
      Random random(setup_.seed ^ 0x5bd1e995u, pair);
      const std::size_t i = random.Below(static_cast<std::uint64_t>(a.Count())),
                        j = random.Below(static_cast<std::uint64_t>(b.Count()));
      const double w = static_cast<double>(a.weight[i]) * static_cast<double>(b.weight[j]);
      const double d = static_cast<double>(a.value[i]) - static_cast<double>(b.value[j]), r2 = d * d;
      loss += w * 2.0 * r2 / (1.0 + std::sqrt(1.0 + r2 / scale2));
      weight += w;
    }
    return loss > 0.0 ? loss / weight : 1.0;
  }

  ComparisonSetup setup_;
  float scale_ = 1.0f;
  std::array<Eigen::Vector3d, 2> centres_;
  std::array<Eigen::Affine3d, 2> worldToIndex_;
  std::array<Field, 2> fields_;
  std::array<Points, 2> points_;
  std::map<std::array<int, 3>, int> numbers_;
  int blockCount_ = 0;
  double chance_ = 2.0;
};

} // namespace

std::unique_ptr<LevelComparison> ComparePoints(const ComparisonSetup& setup)
{
  return std::make_unique<PointComparison>(setup);
}

} // namespace echorama
