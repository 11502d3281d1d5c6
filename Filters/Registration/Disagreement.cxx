// SPDX-License-Identifier: BSD-3-Clause
// Cells. The lattice is cut into cells of half a block's side. Of each cell and each shift six sums are made (of the weights, of
// both values, of their squares and their product, where both are real), and a block is the sum of its 2 x 2 x 2 cells: blocks
// that overlap by half cost nothing more. Shifts along x are the innermost loop, sixteen at a time in registers. Layers of cells
// come one after the other, two are held. Cost: lattice points times shifts times six multiplications.
//
// Peak. The logarithm of the correlation of two images blurred by the same probe is a parabola about its peak (exactly so
// where autocorrelations are Gaussian), so it is fitted by one: gradient and Hessian by differences of the 27 values around the
// best whole shift. Along a flat ridge the nearest to no shift of those that fit as well is taken.
//
// What is known. With correlation r, what one volume does not explain of the other has (1 - r^2) / r^2 of the variance of what
// it does. Least squares then give the shift the covariance (1 - r^2) / (r^2 n) (-H)^-1, H the Hessian of log r, and n the number
// of voxels with independent residuals: voxels over the correlation volume, for which the residuals' own correlation from voxel
// to voxel is continued as a Gaussian. Eigenvectors with a small enough deviation are known.
//
// Chance. Fisher's transform z of a correlation varies by 1 / sqrt(n), whatever the correlation. For two fields that have nothing
// to do with each other, n goes by the product of both autocorrelations; z must exceed that many times, because the best of
// hundreds of shifts is taken. At two places that fit as well, z differs by sqrt(2 / n), n as for the residuals. So along a ridge
// log r goes up and down by (1 - r^2) / (r sqrt(n)), which looks like a peak: how much its second differences are follows from
// the autocorrelation of the residuals, and only directions in which the Hessian is several times larger are known.
#include "Disagreement.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/SymmetricMatrix.h"
#include "Core/Imaging/Sampling.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace echorama {

ParameterList Describe(DisagreementParameters& p)
{
  return {
      Parameter("BlockMm", p.blockMm, {1.0, 1000.0}, "mm",
                "Side of the blocks that are compared, each for itself; they overlap by half. Larger blocks know more, and tell "
                "less of where."),
      Parameter("SearchMm", p.searchMm, {0.1, 100.0}, "mm", "Shifts are looked for so far along each axis."),
      Parameter("StepMm", p.stepMm, {0.0, 100.0}, "mm",
                "Spacing of the lattice on which volumes are compared; shifts are found to a small part of it. 0: the coarsest "
                "volume's voxels, but no finer than a sixth of the search.")
          .Advanced(),
      Parameter("MaximumErrorMm", p.maximumErrorMm, {0.001, 1000.0}, "mm",
                "Directions in which the standard deviation of the shift is larger are not known."),
      Parameter("MinimumSignificance", p.minimumSignificance, {0.0, 100.0}, "",
                "A correlation that is not so many standard deviations above what chance gives says nothing.")
          .Advanced(),
  };
}

namespace {

constexpr int ShiftSums = 6, ShiftLanes = 16;
constexpr float NotSeen = std::numeric_limits<float>::quiet_NaN();

// The fixed values of a cell and the moving ones that it meets, zero where not real.
struct CellPatch {
  int side = 0, reach = 0; // of the cell and of the search, lattice points
  int wide = 0;            // points of a row of the moving patch, with room for the last lanes
  const float* fixed;      // side^3, NaN: not real
  const float *m, *mm, *w; // (side + 2 reach)^2 rows: values, squares, 1 where real
};

// sums: ShiftSums numbers for each of the (2 reach + 1)^3 shifts, x fastest.
void SumCell(const CellPatch& p, float* sums)
{
  const int count = 2 * p.reach + 1, rows = p.side + 2 * p.reach;
  for (int sz = 0; sz < count; ++sz)
    for (int sy = 0; sy < count; ++sy)
      for (int sx = 0; sx < count; sx += ShiftLanes) {
        float a[ShiftSums][ShiftLanes] = {};
        for (int z = 0; z < p.side; ++z)
          for (int y = 0; y < p.side; ++y) {
            const float* fixed = p.fixed + (static_cast<std::ptrdiff_t>(z) * p.side + y) * p.side;
            const std::ptrdiff_t row = (static_cast<std::ptrdiff_t>(z + sz) * rows + y + sy) * p.wide + sx;
            for (int x = 0; x < p.side; ++x) {
              const float f = fixed[x], ff = f * f;
              if (!(f == f))
                continue;
              const float *m = p.m + row + x, *mm = p.mm + row + x, *w = p.w + row + x;
              for (int l = 0; l < ShiftLanes; ++l) {
                a[0][l] += w[l];
                a[1][l] += f * w[l];
                a[2][l] += ff * w[l];
                a[3][l] += m[l];
                a[4][l] += mm[l];
                a[5][l] += f * m[l];
              }
            }
          }
        float* out = sums + ShiftSums * ((static_cast<std::ptrdiff_t>(sz) * count + sy) * count + sx);
        for (int l = 0; l < std::min(ShiftLanes, count - sx); ++l)
          for (int s = 0; s < ShiftSums; ++s)
            out[ShiftSums * l + s] = a[s][l];
      }
}

// A volume on a part of the world's lattice: point (i, j, k) lies at step * (first + (i, j, k)). NaN: not real.
struct LatticeVolume {
  std::array<int, 3> first{0, 0, 0};
  Volume<float> values;
};

const PyramidLevel& LevelFor(const PlacedVolume& volume, double stepMm)
{
  const auto voxelMm = [](const PyramidLevel& level) { return std::cbrt(level.geometry.spacing.prod()); };
  const PyramidLevel* found = &volume.pyramid->front();
  for (const PyramidLevel& level : *volume.pyramid)
    if (voxelMm(level) <= 1.2 * stepMm && voxelMm(level) > voxelMm(*found) && level.realVoxels >= 100)
      found = &level;
  return *found;
}

// With mean 0 and deviation 1 over what is read.
LatticeVolume ReadOnLattice(const PlacedVolume& volume, double stepMm, const std::array<int, 3>& first,
                            const std::array<int, 3>& dimensions)
{
  const PyramidLevel& level = LevelFor(volume, stepMm);
  const Sampler<float> sampler(level.intensity.View(), {});
  const Eigen::Affine3d toIndex = level.geometry.Moved(volume.volumeToWorld).WorldToIndex();
  LatticeVolume read{first, Volume<float>(dimensions, NotSeen)};
  const VolumeView<float> out = read.values.View();
  struct Moments {
    double count = 0.0, sum = 0.0, squares = 0.0;
    Moments& operator+=(const Moments& other)
    {
      count += other.count;
      sum += other.sum;
      squares += other.squares;
      return *this;
    }
  };
  const Moments all = ParallelSum<Moments>(dimensions[2], 1, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    Moments part;
    for (int k = static_cast<int>(begin); k < end; ++k)
      for (int j = 0; j < dimensions[1]; ++j) {
        const Eigen::Vector3d at = toIndex * Eigen::Vector3d(stepMm * Eigen::Vector3d(first[0], first[1] + j, first[2] + k));
        const Eigen::Vector3d by = toIndex.linear().col(0) * stepMm;
        for (int i = 0; i < dimensions[0]; ++i) {
          double value = 0.0;
          if (!sampler.Linear(at.x() + i * by.x(), at.y() + i * by.y(), at.z() + i * by.z(), value))
            continue;
          out(i, j, k) = static_cast<float>(value);
          part += {1.0, value, value * value};
        }
      }
    return part;
  });
  if (!(all.count > 0.0))
    return read;
  const double mean = all.sum / all.count, deviation = std::sqrt(std::max(0.0, all.squares / all.count - mean * mean));
  const double scale = deviation > 0.0 ? 1.0 / deviation : 0.0;
  ParallelFor(dimensions[2], [&](std::ptrdiff_t k) {
    float* slice = out.Row(0, static_cast<int>(k));
    for (std::ptrdiff_t i = 0; i < out.SliceStride(); ++i)
      slice[i] = static_cast<float>((slice[i] - mean) * scale);
  });
  return read;
}

// How many voxels of an axis one counts for, whose correlation from voxel to voxel is r: the sum of a Gaussian autocorrelation,
// at most all of them.
double CorrelatedVoxels(double r, int all)
{
  constexpr double pi = 3.14159265358979323846;
  return r <= 0.0 ? 1.0 : r < 1.0 ? std::clamp(std::sqrt(pi / -std::log(r)), 1.0, static_cast<double>(all)) : all;
}

class PairShifts {
public:
  PairShifts(const PlacedVolume& fixed, const PlacedVolume& moving, const DisagreementParameters& p, double stepMm, int side,
             int reach, const Eigen::AlignedBox3d& box)
    : p_(p), stepMm_(stepMm), side_(side), reach_(reach), count_(2 * reach + 1)
  {
    // Whole cells that hold the box.
    double points = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      const double cell = side * stepMm;
      firstCell_[a] = static_cast<int>(std::floor(box.min()[axis] / cell));
      cells_[a] = static_cast<int>(std::floor(box.max()[axis] / cell)) - firstCell_[a] + 1;
      fixedFirst_[a] = firstCell_[a] * side;
      fixedSize_[a] = cells_[a] * side;
      movingFirst_[a] = fixedFirst_[a] - reach;
      movingSize_[a] = fixedSize_[a] + 2 * reach;
      points *= movingSize_[a];
    }
    if (points > static_cast<double>(std::ptrdiff_t{1} << 28))
      throw Error(Error::Kind::TooLarge, fixed.name + " and " + moving.name +
                                             ": their overlap has too many points to compare; a larger StepMm has fewer");
    fixed_ = ReadOnLattice(fixed, stepMm, fixedFirst_, fixedSize_);
    moving_ = ReadOnLattice(moving, stepMm, movingFirst_, movingSize_);
  }

  // Blocks are named by the cell of their highest corner: cell (i, j, k) and those before it. tell(first cell of the block,
  // shift).
  template <class Tell>
  void ForEachBlock(const Progress& progress, const Tell& tell)
  {
    std::vector<std::vector<float>> below, above;
    const std::ptrdiff_t layer = static_cast<std::ptrdiff_t>(cells_[0]) * cells_[1];
    const std::ptrdiff_t blocks = static_cast<std::ptrdiff_t>(cells_[0] - 1) * (cells_[1] - 1);
    std::vector<LocalShift> shifts(static_cast<std::size_t>(std::max<std::ptrdiff_t>(blocks, 0)));
    std::vector<char> compared(shifts.size());
    for (int k = 0; k < cells_[2]; ++k) {
      above.assign(static_cast<std::size_t>(layer), {});
      ParallelFor(layer, progress.Part(static_cast<double>(k) / cells_[2], (k + 0.9) / cells_[2]), [&](std::ptrdiff_t cell) {
        above[static_cast<std::size_t>(cell)] = SumsOf(static_cast<int>(cell % cells_[0]), static_cast<int>(cell / cells_[0]), k);
      });
      if (k > 0 && blocks > 0) {
        ParallelFor(blocks, [&](std::ptrdiff_t block) {
          const int i = static_cast<int>(block % (cells_[0] - 1)), j = static_cast<int>(block / (cells_[0] - 1));
          const auto b = static_cast<std::size_t>(block);
          compared[b] = ShiftOf(i, j, k - 1, below, above, shifts[b]);
        });
        for (std::ptrdiff_t block = 0; block < blocks; ++block)
          if (compared[static_cast<std::size_t>(block)])
            tell(std::array<int, 3>{firstCell_[0] + static_cast<int>(block % (cells_[0] - 1)),
                                    firstCell_[1] + static_cast<int>(block / (cells_[0] - 1)), firstCell_[2] + k - 1},
                 shifts[static_cast<std::size_t>(block)]);
      }
      std::swap(below, above);
    }
  }

private:
  // Empty: nothing of the cell is real in one of both volumes.
  std::vector<float> SumsOf(int i, int j, int k) const
  {
    const int rows = side_ + 2 * reach_, wide = rows + ShiftLanes;
    const std::size_t patch = static_cast<std::size_t>(rows) * static_cast<std::size_t>(rows) * static_cast<std::size_t>(wide);
    std::vector<float> fixed, moving(3 * patch, 0.0f);
    bool isFixed = false, isMoving = false;
    for (int z = 0; z < side_; ++z)
      for (int y = 0; y < side_; ++y) {
        const float* row = fixed_.values.View().Row(j * side_ + y, k * side_ + z) + i * side_;
        fixed.insert(fixed.end(), row, row + side_);
      }
    for (const float f : fixed)
      isFixed = isFixed || f == f;
    if (!isFixed)
      return {};
    for (int z = 0; z < rows; ++z)
      for (int y = 0; y < rows; ++y) {
        const float* row = moving_.values.View().Row(j * side_ + y, k * side_ + z) + i * side_;
        const std::size_t at = (static_cast<std::size_t>(z) * static_cast<std::size_t>(rows) + static_cast<std::size_t>(y)) *
                               static_cast<std::size_t>(wide);
        for (std::size_t x = 0; x < static_cast<std::size_t>(rows); ++x)
          if (row[x] == row[x]) {
            moving[at + x] = row[x];
            moving[patch + at + x] = row[x] * row[x];
            moving[2 * patch + at + x] = 1.0f;
            isMoving = true;
          }
      }
    if (!isMoving)
      return {};
    std::vector<float> sums(static_cast<std::size_t>(ShiftSums) * static_cast<std::size_t>(count_ * count_ * count_));
    SumCell({side_, reach_, wide, fixed.data(), moving.data(), moving.data() + patch, moving.data() + 2 * patch}, sums.data());
    return sums;
  }

  int Place(const Eigen::Vector3i& shift) const
  {
    return ((shift.z() + reach_) * count_ + shift.y() + reach_) * count_ + shift.x() + reach_;
  }
  Eigen::Vector3i ShiftAt(int place) const
  {
    return {place % count_ - reach_, place / count_ % count_ - reach_, place / (count_ * count_) - reach_};
  }

  // What is left at a shift, by correlations from voxel to voxel along the axes: of the residuals, and the product of both
  // volumes' own.
  struct Independent {
    double residuals = 1.0, chance = 1.0; ///< voxels
    double roughness =
        1.0; ///< second differences of what noise adds to the correlation, from shift to shift, in its own deviations
  };

  // The moving volume between lattice points, where all eight are real; else NaN.
  float MovingAt(const Eigen::Vector3d& at) const
  {
    const auto& n = movingSize_;
    const Eigen::Vector3i first = at.array().floor().cast<int>().matrix();
    if (first.minCoeff() < 0 || first.x() + 1 >= n[0] || first.y() + 1 >= n[1] || first.z() + 1 >= n[2])
      return NotSeen;
    const Eigen::Vector3f t = (at - first.cast<double>()).cast<float>();
    const VolumeView<const float> m = moving_.values.View();
    float value = 0.0f;
    for (int corner = 0; corner < 8; ++corner) {
      const int x = corner & 1, y = corner >> 1 & 1, z = corner >> 2;
      value += (x ? t.x() : 1.0f - t.x()) * (y ? t.y() : 1.0f - t.y()) * (z ? t.z() : 1.0f - t.z()) *
               m(first.x() + x, first.y() + y, first.z() + z);
    }
    return value;
  }

  Independent IndependentAt(int i, int j, int k, const Eigen::Vector3d& shift) const
  {
    const int block = 2 * side_;
    const auto place = [block](int x, int y, int z) { return static_cast<std::size_t>((z * block + y) * block + x); };
    std::vector<float> f(place(0, 0, block), NotSeen), m(f);
    double count = 0.0, fixedMean = 0.0, movingMean = 0.0, product = 0.0, square = 0.0;
    for (int z = 0; z < block; ++z)
      for (int y = 0; y < block; ++y)
        for (int x = 0; x < block; ++x) {
          const Eigen::Vector3i at(i * side_ + x, j * side_ + y, k * side_ + z);
          const float a = fixed_.values.View()(at.x(), at.y(), at.z());
          const float b = MovingAt((at.array() + reach_).matrix().cast<double>() + shift);
          if (!(a == a && b == b))
            continue;
          f[place(x, y, z)] = a;
          m[place(x, y, z)] = b;
          count += 1.0;
          fixedMean += a;
          movingMean += b;
        }
    if (!(count > 0.0))
      return {};
    fixedMean /= count;
    movingMean /= count;
    for (std::size_t n = 0; n < f.size(); ++n)
      if (f[n] == f[n]) {
        f[n] -= static_cast<float>(fixedMean);
        m[n] -= static_cast<float>(movingMean);
        product += static_cast<double>(f[n]) * m[n];
        square += static_cast<double>(f[n]) * f[n];
      }
    const double slope = square > 0.0 ? product / square : 0.0;
    Independent found{count, count};
    double correlated = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      const int dx = axis == 0, dy = axis == 1, dz = axis == 2;
      double ff = 0.0, mm = 0.0, ee = 0.0, f0 = 0.0, m0 = 0.0, e0 = 0.0;
      for (int z = 0; z < block - dz; ++z)
        for (int y = 0; y < block - dy; ++y)
          for (int x = 0; x < block - dx; ++x) {
            const double a = f[place(x, y, z)], b = f[place(x + dx, y + dy, z + dz)];
            const double c = m[place(x, y, z)], d = m[place(x + dx, y + dy, z + dz)];
            if (!(a == a && b == b))
              continue;
            const double e = c - slope * a, g = d - slope * b;
            ff += a * b;
            mm += c * d;
            ee += e * g;
            f0 += 0.5 * (a * a + b * b);
            m0 += 0.5 * (c * c + d * d);
            e0 += 0.5 * (e * e + g * g);
          }
      const auto ratio = [](double part, double whole) { return whole > 0.0 ? std::max(0.0, part / whole) : 1.0; };
      found.residuals /= CorrelatedVoxels(ratio(ee, e0), block);
      correlated += ratio(ee, e0) / 3.0;
      found.chance /= CorrelatedVoxels(ratio(ff, f0) * ratio(mm, m0), block);
    }
    // What two such fields correlate by is a field whose autocorrelation is as a Gaussian sqrt(2) times as wide.
    found.roughness = std::sqrt(std::max(0.0, 6.0 - 8.0 * std::sqrt(correlated) + 2.0 * correlated * correlated));
    found.residuals = std::max(1.0, found.residuals);
    found.chance = std::max(1.0, found.chance);
    return found;
  }

  // Of the block of eight cells from (i, j, k); whether there was enough of both volumes to compare.
  bool ShiftOf(int i, int j, int k, const std::vector<std::vector<float>>& below, const std::vector<std::vector<float>>& above,
               LocalShift& result) const
  {
    constexpr double leastShare = 0.5, leastVariance = 1e-4; // of the block; of the volume's own
    result = LocalShift();
    const int all = count_ * count_ * count_;
    std::vector<double> sums(static_cast<std::size_t>(ShiftSums * all), 0.0);
    for (int corner = 0; corner < 8; ++corner) {
      const auto& layer = corner & 4 ? above : below;
      const std::vector<float>& cell = layer[static_cast<std::size_t>((j + (corner >> 1 & 1)) * cells_[0] + i + (corner & 1))];
      for (std::size_t s = 0; s < cell.size(); ++s)
        sums[s] += static_cast<double>(cell[s]);
    }
    const double least = leastShare * 8.0 * side_ * side_ * side_;
    if (sums[static_cast<std::size_t>(ShiftSums * Place({0, 0, 0}))] < least)
      return false;
    // Correlations; below -1: too little of both is real, or one of them is flat.
    std::vector<double> r(static_cast<std::size_t>(all), -2.0);
    for (int place = 0; place < all; ++place) {
      const double* s = &sums[static_cast<std::size_t>(ShiftSums * place)];
      const double f2 = s[2] - s[1] * s[1] / s[0], m2 = s[4] - s[3] * s[3] / s[0];
      if (s[0] >= least && f2 > leastVariance * s[0] && m2 > leastVariance * s[0])
        r[static_cast<std::size_t>(place)] = std::clamp((s[5] - s[1] * s[3] / s[0]) / std::sqrt(f2 * m2), -1.0, 1.0);
    }
    const int best = static_cast<int>(std::max_element(r.begin(), r.end()) - r.begin());
    if (r[static_cast<std::size_t>(best)] > 0.0)
      Know(i, j, k, r, best, result);
    return true;
  }

  // Whether all around a whole shift was compared.
  bool IsInside(const std::vector<double>& r, const Eigen::Vector3i& shift) const
  {
    if (shift.cwiseAbs().maxCoeff() >= reach_)
      return false;
    for (int n = 0; n < 27; ++n)
      if (r[static_cast<std::size_t>(Place(shift + Eigen::Vector3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1)))] < -1.0)
        return false;
    return true;
  }

  // Of the logarithm of the correlation about a whole shift, by steps.
  struct Peak {
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    Eigen::Matrix3d bend = Eigen::Matrix3d::Zero(); ///< minus the Hessian
    /// How far the top is, at most half a step along each axis; only axis by axis, which is enough for residuals.
    Eigen::Vector3d Beyond() const
    {
      Eigen::Vector3d beyond = Eigen::Vector3d::Zero();
      for (int a = 0; a < 3; ++a)
        if (bend(a, a) > 0.0)
          beyond[a] = std::clamp(gradient[a] / bend(a, a), -0.5, 0.5);
      return beyond;
    }
  };

  Peak PeakAt(const std::vector<double>& r, int place) const
  {
    Peak peak;
    const Eigen::Vector3i at = ShiftAt(place);
    if (!IsInside(r, at))
      return peak;
    const double least = 0.01 * r[static_cast<std::size_t>(place)];
    const auto value = [&](const Eigen::Vector3i& away) {
      return std::log(std::max(r[static_cast<std::size_t>(Place(at + away))], least));
    };
    const double v = value(Eigen::Vector3i::Zero());
    for (int a = 0; a < 3; ++a) {
      const Eigen::Vector3i x = Eigen::Vector3i::Unit(a);
      peak.gradient[a] = 0.5 * (value(x) - value(-x));
      peak.bend(a, a) = 2.0 * v - value(x) - value(-x);
      for (int b = 0; b < a; ++b) {
        const Eigen::Vector3i y = Eigen::Vector3i::Unit(b);
        peak.bend(a, b) = peak.bend(b, a) = -0.25 * (value(x + y) + value(-x - y) - value(x - y) - value(y - x));
      }
    }
    return peak;
  }

  void Know(int i, int j, int k, const std::vector<double>& r, int best, LocalShift& result) const
  {
    constexpr double asGood = 0.7, nearlyAsGood = 3.0, clearlyWorse = 7.0; // by z, in its deviations
    constexpr double clearPeak = 4.0;                                      // in deviations of its second differences
    const double top = std::min(r[static_cast<std::size_t>(best)], 1.0 - 1e-6);
    result.correlation = top;
    const Independent independent = IndependentAt(i, j, k, ShiftAt(best).cast<double>() + PeakAt(r, best).Beyond());
    if (std::atanh(top) * std::sqrt(independent.chance) < p_.minimumSignificance)
      return;
    const auto score = [&](double correlation) {
      return std::atanh(std::clamp(correlation, 0.0, top)) * std::sqrt(independent.residuals);
    };
    const double topScore = score(top);
    if (topScore < clearlyWorse) // no other place could be told to be worse
      return;
    const auto worse = [&](int place) { return topScore - score(r[static_cast<std::size_t>(place)]); };
    // The nearest to no shift of those as good; ties go to the first.
    int chosen = -1;
    for (int place = 0; place < static_cast<int>(r.size()); ++place)
      if (worse(place) < asGood && IsInside(r, ShiftAt(place)) &&
          (chosen < 0 || ShiftAt(place).squaredNorm() < ShiftAt(chosen).squaredNorm()))
        chosen = place;
    if (chosen < 0)
      return;
    const Eigen::Vector3i at = ShiftAt(chosen);
    const auto [gradient, bend] = PeakAt(r, chosen);
    const SymmetricEigen eigen = EigenOfSymmetric(bend);
    constexpr double readingSteps = 0.05; // what reading between voxels alone may be off
    const double noise = (1.0 - top * top) / (top * top * independent.residuals);
    const double leastBend = clearPeak * independent.roughness * std::sqrt(noise * (1.0 - top * top));
    Eigen::Matrix3d knownBend = Eigen::Matrix3d::Zero();
    double variances = 0.0, largest = 0.0;
    for (int a = 0; a < 3; ++a) {
      if (!(eigen.values[a] > leastBend))
        continue;
      const double variance = noise / eigen.values[a] + readingSteps * readingSteps;
      if (std::sqrt(variance) * stepMm_ > p_.maximumErrorMm)
        continue;
      const Eigen::Vector3d way = eigen.vectors.col(a);
      const double beyond = std::clamp(gradient.dot(way) / eigen.values[a], -1.0, 1.0);
      result.shift += (at.cast<double>().dot(way) + beyond) * stepMm_ * way;
      result.known += way * way.transpose();
      knownBend += eigen.values[a] * way * way.transpose();
      variances += variance * stepMm_ * stepMm_;
      largest = std::max(largest, variance);
      ++result.knownDirections;
    }
    // Another place that fits nearly as well, where by this peak it should not: nothing is known.
    for (int place = 0; place < static_cast<int>(r.size()) && result.knownDirections > 0; ++place) {
      const Eigen::Vector3d away = (ShiftAt(place) - at).cast<double>();
      if (worse(place) < nearlyAsGood && topScore - score(top * std::exp(-0.5 * away.dot(knownBend * away))) > clearlyWorse)
        result.knownDirections = 0;
    }
    if (result.knownDirections == 0) {
      result.shift.setZero();
      result.known.setZero();
      return;
    }
    result.errorMm = std::sqrt(largest) * stepMm_;
    result.mm = std::sqrt(std::max(0.0, result.shift.squaredNorm() - variances));
  }

  const DisagreementParameters& p_;
  double stepMm_;
  int side_, reach_, count_;
  std::array<int, 3> firstCell_{}, cells_{}, fixedFirst_{}, fixedSize_{}, movingFirst_{}, movingSize_{};
  LatticeVolume fixed_, moving_;
};

Eigen::AlignedBox3d WorldBoxOf(const ImageGeometry& geometry)
{
  Eigen::AlignedBox3d box;
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d index;
    for (int axis = 0; axis < 3; ++axis)
      index[axis] = corner >> axis & 1 ? geometry.dimensions[static_cast<std::size_t>(axis)] - 0.5 : -0.5;
    box.extend(geometry.IndexToWorld() * index);
  }
  return box;
}

// On what lattice which volumes are compared.
struct ComparedPairs {
  struct Pair {
    int fixed, moving;
    Eigen::AlignedBox3d overlap;
  };
  double stepMm = 0.0;
  int reach = 0, side = 0; // of the search and of a cell, lattice points
  std::vector<Pair> pairs;

  ComparedPairs(const std::vector<ImageGeometry>& volumes, const DisagreementParameters& p)
  {
    if (volumes.size() < 2)
      throw Error(Error::Kind::BadInput, "volumes that disagree are at least two");
    std::vector<Eigen::AlignedBox3d> boxes;
    double coarsest = 0.0;
    for (const ImageGeometry& volume : volumes) {
      boxes.push_back(WorldBoxOf(volume));
      coarsest = std::max(coarsest, std::cbrt(volume.spacing.prod()));
    }
    stepMm = p.stepMm > 0.0 ? p.stepMm : std::max(coarsest, p.searchMm / 6.0);
    reach = std::max(2, static_cast<int>(std::ceil(p.searchMm / stepMm - 1e-9)) + 1);
    side = std::max(2, static_cast<int>(std::lround(0.5 * p.blockMm / stepMm)));
    if (reach > 24 || side > 24)
      throw Error(Error::Kind::InvalidParameter,
                  "StepMm is too small beside SearchMm or BlockMm: a search goes 23 steps at most, and "
                  "a block has 48 at most");
    for (std::size_t a = 0; a < boxes.size(); ++a)
      for (std::size_t b = a + 1; b < boxes.size(); ++b)
        if (const Eigen::AlignedBox3d box = boxes[a].intersection(boxes[b]); !box.isEmpty())
          pairs.push_back({static_cast<int>(a), static_cast<int>(b), box});
  }

  double CellMm() const { return side * stepMm; }

  // Of blocks named by their first cells; of one block when there is none.
  ImageGeometry GridOf(const Eigen::AlignedBox3i& cells) const
  {
    const Eigen::Vector3i first = cells.isEmpty() ? Eigen::Vector3i(0, 0, 0) : cells.min();
    const Eigen::Vector3i size =
        cells.isEmpty() ? Eigen::Vector3i(1, 1, 1) : Eigen::Vector3i((cells.max() - cells.min()).array() + 1);
    ImageGeometry grid;
    grid.dimensions = {size[0], size[1], size[2]};
    grid.spacing.setConstant(CellMm());
    // The middle of the block: between its two cells.
    grid.origin = CellMm() * (first.cast<double>() + Eigen::Vector3d::Ones()) - Eigen::Vector3d::Constant(0.5 * stepMm);
    return grid;
  }
};

} // namespace

ImageGeometry DisagreementGrid(const std::vector<ImageGeometry>& volumes, const DisagreementParameters& parameters)
{
  CheckRanges(parameters);
  const ComparedPairs compared(volumes, parameters);
  Eigen::AlignedBox3i cells;
  for (const ComparedPairs::Pair& pair : compared.pairs) {
    // As PairShifts has them: whole cells that hold the overlap, and blocks of two along each axis.
    const Eigen::Vector3i first = (pair.overlap.min() / compared.CellMm()).array().floor().cast<int>();
    const Eigen::Vector3i last = (pair.overlap.max() / compared.CellMm()).array().floor().cast<int>() - 1;
    if ((last.array() >= first.array()).all())
      cells.extend(Eigen::AlignedBox3i(first, last));
  }
  return compared.GridOf(cells);
}

DisagreementMap Disagreement(const std::vector<PlacedVolume>& volumes, const DisagreementParameters& parameters,
                             const Progress& progress)
{
  CheckRanges(parameters);
  std::vector<ImageGeometry> geometries;
  for (const PlacedVolume& volume : volumes) {
    CheckPlacedVolume(volume);
    geometries.push_back(volume.pyramid->front().geometry.Moved(volume.volumeToWorld));
  }
  const ComparedPairs compared(geometries, parameters);
  DisagreementMap map;
  map.stepMm = compared.stepMm;
  struct Told {
    std::array<int, 3> cell;
    LocalShift shift;
    int fixed, moving;
  };
  std::vector<Told> told;
  double work = 0.0, done = 0.0;
  for (const ComparedPairs::Pair& pair : compared.pairs)
    work += pair.overlap.volume();
  for (const auto& [a, b, overlap] : compared.pairs) {
    const double share = overlap.volume() / std::max(work, 1e-300);
    const Progress part = progress.Part(done, std::min(1.0, done + share));
    part(0.0);
    PairShifts pair(volumes[static_cast<std::size_t>(a)], volumes[static_cast<std::size_t>(b)], parameters, map.stepMm,
                    compared.side, compared.reach, overlap);
    pair.ForEachBlock(part, [&, a = a, b = b](const std::array<int, 3>& cell, const LocalShift& shift) {
      ++map.compared;
      map.known += shift.knownDirections > 0;
      if (shift.knownDirections > 0)
        told.push_back({cell, shift, a, b});
    });
    done += share;
  }
  // The box of what is known.
  Eigen::AlignedBox3i cells;
  for (const Told& each : told)
    cells.extend(Eigen::Vector3i(each.cell[0], each.cell[1], each.cell[2]));
  map.geometry = compared.GridOf(cells);
  const std::size_t count = map.geometry.VoxelCount();
  map.shifts.assign(count, {});
  map.fixed.assign(count, -1);
  map.moving.assign(count, -1);
  for (const Told& each : told) {
    const Eigen::Vector3i at = Eigen::Vector3i(each.cell[0], each.cell[1], each.cell[2]) - cells.min();
    const auto& n = map.geometry.dimensions;
    const std::size_t place = static_cast<std::size_t>((at[2] * n[1] + at[1]) * n[0] + at[0]);
    if (map.fixed[place] < 0 || each.shift.mm > map.shifts[place].mm) {
      map.shifts[place] = each.shift;
      map.fixed[place] = static_cast<std::int16_t>(each.fixed);
      map.moving[place] = static_cast<std::int16_t>(each.moving);
    }
  }
  progress(1.0);
  return map;
}

} // namespace echorama
