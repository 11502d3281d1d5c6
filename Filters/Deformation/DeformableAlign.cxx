// SPDX-License-Identifier: BSD-3-Clause
// The lattice of control points and the grid on which differences are summed both lie along the axes of the moving volume.
// That makes everything a product along three axes. A voxel touches 64 control points, so its share of the normal equations
// is a matrix of 192 x 192; but the products of two weights along one axis are only ten numbers, so sums over a row need
// ten times six numbers per cell (six of the outer product of the gradient), those over a slice a hundred times six, and
// only whole cells get all thousand. The cost is then mostly that of reading the moving volume.
//
// The matrix couples control points at most three apart: it is kept as a stencil of 7^3 blocks of 3 x 3 per control point, the
// penalty is added to it, and conjugate gradients solve it (LatticeEquations).
#include "DeformableAlign.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Filters/Registration/Index.h"
#include "Filters/Registration/Metric.h"
#include "Filters/Registration/PlacedVolume.h"
#include "LatticeEquations.h"
#include <algorithm>
#include <cmath>

namespace echorama {

namespace {

constexpr int CoarseOctave = 2; // voxels of about 4 mm tell where volumes overlap
// Coarser levels have an eighth of the voxels per octave. The bending counts less there by as much: it would hold back what the
// finest level then is too near-sighted to find.
constexpr double SofterPerOctave = 1.0 / 8.0;
// Some places resemble each other more than others do: correlations are those of boxes of about this size.
constexpr double BoxMm = 12.0;
// What is seen in all boxes counts in each as much as this share of a mean box: few voxels have no correlation of their own.
constexpr double FromAllBoxes = 0.3;

using Vectors = LatticeEquations::Vectors;

// A value and a weight of every voxel of a grid, side by side.
using Seen = std::vector<float>;

// The level whose voxels are of a size: the finest that is not finer.
const MetricLevel& LevelOf(const MetricPyramid& pyramid, int octave)
{
  for (const MetricLevel& level : pyramid.levels)
    if (level.octave >= octave)
      return level;
  return pyramid.levels.back();
}

// Reads value and weight between voxels; the weight is 0 outside.
void ReadRow(const SeenVoxel* seen, const int* n, const double* positions, int count, float* out)
{
  const std::ptrdiff_t sy = n[0], sz = sy * n[1];
  for (int i = 0; i < count; ++i, positions += 3, out += 2) {
    const double x = positions[0], y = positions[1], z = positions[2];
    out[0] = out[1] = 0.0f;
    if (!(x >= 0.0 && y >= 0.0 && z >= 0.0 && x <= n[0] - 1.0 && y <= n[1] - 1.0 && z <= n[2] - 1.0))
      continue;
    const int ix = std::min(static_cast<int>(x), n[0] - 2), iy = std::min(static_cast<int>(y), n[1] - 2),
              iz = std::min(static_cast<int>(z), n[2] - 2);
    const float tx = static_cast<float>(x - ix), ty = static_cast<float>(y - iy), tz = static_cast<float>(z - iz);
    const SeenVoxel* p = seen + iz * sz + iy * sy + ix;
    const auto between = [&](const auto& of) {
      const auto along = [&](const SeenVoxel* v) { return of(v[0]) + tx * (of(v[1]) - of(v[0])); };
      const float a = along(p), b = along(p + sy), d = along(p + sz), e = along(p + sz + sy);
      const float lower = a + ty * (b - a), upper = d + ty * (e - d);
      return lower + tz * (upper - lower);
    };
    out[0] = between([](const SeenVoxel& v) { return v.Value(); });
    out[1] = between([](const SeenVoxel& v) { return v.Weight(); });
  }
}

// What a placed level shows at the voxels of a grid, read through a field.
void SeeThrough(const MetricLevel& level, const Pose& volumeToWorld, const DisplacementField* field, const ImageGeometry& grid,
                Seen& seen, const Progress& progress)
{
  const Eigen::Affine3d toWorld = grid.IndexToWorld(),
                        toIndex = level.geometry.WorldToIndex() * Eigen::Affine3d(volumeToWorld.inverse());
  const auto& n = grid.dimensions;
  seen.resize(2 * grid.VoxelCount());
  ParallelFor(n[2], progress, [&](std::ptrdiff_t k) {
    Vectors positions(Index(n[0]), Eigen::Vector3d::Zero());
    const Eigen::Vector3d step = toWorld.linear().col(0), indexStep = toIndex.linear() * step;
    for (int j = 0; j < n[1]; ++j) {
      const Eigen::Vector3d start = toWorld * Eigen::Vector3d(0.0, j, static_cast<double>(k)), indexStart = toIndex * start;
      if (field)
        field->Row(start, step, n[0], positions.data());
      for (int i = 0; i < n[0]; ++i) {
        Eigen::Vector3d& p = positions[Index(i)];
        p = field ? Eigen::Vector3d(indexStart + i * indexStep + toIndex.linear() * p)
                  : Eigen::Vector3d(indexStart + i * indexStep);
      }
      ReadRow(level.seen.data(), level.geometry.dimensions.data(), positions.data()->data(), n[0],
              seen.data() + 2 * ((k * n[1] + j) * static_cast<std::ptrdiff_t>(n[0])));
    }
  });
}

// The weights of the control points along one axis of the grid.
struct Axis {
  Axis(const ImageGeometry& grid, const ImageGeometry& lattice, int axis)
  {
    const Eigen::Vector3d from = lattice.WorldToIndex() * grid.origin;
    const double by = grid.spacing[axis] / lattice.spacing[axis];
    cells = lattice.dimensions[Index(axis)] - 3;
    for (int i = 0; i < grid.dimensions[Index(axis)]; ++i) {
      const double x = from[axis] + i * by;
      // The lattice is laid so that only rounding can put a voxel beyond its inner cells.
      const int c = std::clamp(static_cast<int>(std::floor(x)) - 1, 0, cells - 1);
      const auto w = CubicWeights(x - (c + 1));
      cell.push_back(c);
      weights.push_back(w);
      std::array<double, 10> products{};
      for (std::size_t a = 0, p = 0; a < 4; ++a)
        for (std::size_t b = a; b < 4; ++b)
          products[p++] = w[a] * w[b];
      pairs.push_back(products);
    }
  }
  int cells = 0;
  std::vector<int> cell; // whose control points are cell ... cell + 3
  std::vector<std::array<double, 4>> weights;
  std::vector<std::array<double, 10>> pairs; // their products, (0,0) (0,1) (0,2) (0,3) (1,1) ...
};

constexpr int pairOf[4][4] = {{0, 1, 2, 3}, {1, 4, 5, 6}, {2, 5, 7, 8}, {3, 6, 8, 9}};

// Sums of the products of some weights with some sums, those of the first weight first.
template <std::ptrdiff_t Sums, std::size_t Weights>
void AddProducts(const std::array<double, Weights>& weights, const double* sums, double* to)
{
  for (const double weight : weights)
    for (std::ptrdiff_t i = 0; i < Sums; ++i)
      *to++ += weight * sums[i];
}

// What two volumes have in common: weighted sums over the voxels of the grid.
struct Common {
  double weight = 0.0, ff = 0.0, mm = 0.0, fm = 0.0;
  void operator+=(const Common& c)
  {
    weight += c.weight;
    ff += c.ff;
    mm += c.mm;
    fm += c.fm;
  }
  /// Opposites are not alike.
  double Correlation() const { return ff > 0.0 && mm > 0.0 ? std::fmax(0.0, fm / std::sqrt(ff * mm)) : 0.0; }
  // Of the same weight, as if a part of another one had been seen as well.
  Common With(const Common& other, double part) const
  {
    if (!(weight > 0.0))
      return {};
    const double own = weight / (weight + part), shared = own * part / other.weight;
    return {weight, own * ff + shared * other.ff, own * mm + shared * other.mm, own * fm + shared * other.fm};
  }
  // The share of the variance that neither explains of the other. The floor keeps identical volumes finite.
  double Unexplained() const { return std::fmax(0.0, 1.0 - Correlation() * Correlation()) + 1e-3; }
};

// One per box and fixed volume, boxes fastest.
using Commons = std::vector<Common>;

double Similarity(const Commons& commons)
{
  double sum = 0.0, weight = 0.0;
  for (const Common& c : commons) {
    sum += c.weight * c.Correlation();
    weight += c.weight;
  }
  return weight > 0.0 ? sum / weight : 0.0;
}

// What the volumes say of each other, in nats: the negative logarithm of the likelihood, by the weights before anything moved.
double InformationOf(const Commons& commons, const Commons& rigid)
{
  double sum = 0.0;
  for (std::size_t c = 0; c < commons.size(); ++c)
    sum -= 0.5 * rigid[c].weight * std::log(commons[c].Unexplained());
  return sum;
}

// One resolution: a grid, what the fixed volumes show there, and a lattice.
class Level {
public:
  Level(const std::vector<DeformableVolume>& fixed, const DeformableVolume& moving, int octave,
        const Eigen::AlignedBox3d& overlap, double controlSpacing)
    : moving_(LevelOf(*moving.features, octave)), movingToWorld_(moving.volumeToWorld)
  {
    const ImageGeometry whole = moving_.geometry.Moved(movingToWorld_);
    grid_ = whole;
    lattice_ = whole;
    Eigen::Vector3d first;
    for (int axis = 0; axis < 3; ++axis) {
      // The overlap is told along the axes of the moving volume, in mm from its first voxel's centre.
      const int n = whole.dimensions[Index(axis)];
      const Eigen::Vector3d shift = whole.direction.transpose() * (whole.origin - MillimetreFrame(moving).origin);
      const double low = std::floor((overlap.min()[axis] - shift[axis]) / whole.spacing[axis]),
                   high = std::ceil((overlap.max()[axis] - shift[axis]) / whole.spacing[axis]);
      first[axis] = std::clamp(low, 0.0, n - 1.0);
      grid_.dimensions[Index(axis)] = static_cast<int>(std::clamp(high, first[axis], n - 1.0) - first[axis]) + 1;
      const double length = overlap.sizes()[axis];
      const int cells = std::max(1, static_cast<int>(std::ceil(length / controlSpacing - 0.01)));
      lattice_.dimensions[Index(axis)] = cells + 3;
      lattice_.spacing[axis] = controlSpacing;
      boxes_[Index(axis)] =
          std::max(1, static_cast<int>(std::lround(grid_.dimensions[Index(axis)] * grid_.spacing[axis] / BoxMm)));
    }
    grid_.origin = whole.IndexToWorld() * first;
    const Eigen::Vector3d size(lattice_.dimensions[0] - 1, lattice_.dimensions[1] - 1, lattice_.dimensions[2] - 1);
    lattice_.origin =
        MillimetreFrame(moving).origin + whole.direction * (overlap.center() - 0.5 * size.cwiseProduct(lattice_.spacing));
    for (const DeformableVolume& f : fixed) {
      fixed_.emplace_back();
      SeeThrough(LevelOf(*f.features, octave), f.volumeToWorld, f.field, grid_, fixed_.back(), {});
    }
  }

  /// The axes of the moving volume in the world, mm, from the first voxel of its finest level.
  static ImageGeometry MillimetreFrame(const DeformableVolume& moving)
  {
    return moving.features->levels.front().geometry.Moved(moving.volumeToWorld);
  }

  const ImageGeometry& Grid() const { return grid_; }
  const ImageGeometry& Lattice() const { return lattice_; }
  double VoxelMm() const { return moving_.voxelMm; }
  const std::vector<Seen>& Fixed() const { return fixed_; }

  void Warp(const DisplacementField& field, Seen& seen, const Progress& progress) const
  {
    SeeThrough(moving_, movingToWorld_, field.IsZero() ? nullptr : &field, grid_, seen, progress);
  }

  Commons Compare(const Seen& warped) const
  {
    const auto& n = grid_.dimensions;
    Commons commons;
    for (const Seen& fixed : fixed_) {
      Commons boxes(BoxCount());
      ParallelFor(boxes_[2], [&](std::ptrdiff_t layer) {
        for (int k = 0; k < n[2]; ++k)
          for (int j = 0; BoxAlong(2, k) == layer && j < n[1]; ++j)
            for (int i = 0; i < n[0]; ++i) {
              const std::ptrdiff_t at = 2 * ((static_cast<std::ptrdiff_t>(k) * n[1] + j) * n[0] + i);
              const float *f = fixed.data() + at, *m = warped.data() + at;
              const double w = static_cast<double>(f[1] * m[1]), a = static_cast<double>(f[0]), b = static_cast<double>(m[0]);
              boxes[BoxOf(i, j, k)] += {w, w * a * a, w * b * b, w * a * b};
            }
      });
      Common all;
      for (const Common& box : boxes)
        all += box;
      for (const Common& box : boxes)
        commons.push_back(box.With(all, FromAllBoxes * all.weight / static_cast<double>(boxes.size())));
    }
    return commons;
  }

  // How residuals and slopes follow from what is seen, per box and fixed volume: the residual is scale * (f / deviation of f -
  // correlation * m / deviation of m), and its derivative -slope times that of m.
  struct Weighing {
    double weight, f, m;
  };

  // The data's share of the normal equations at what was warped.
  LatticeEquations Equations(const Seen& warped, const std::vector<Weighing>& weighing) const
  {
    const Axis x(grid_, lattice_, 0), y(grid_, lattice_, 1), z(grid_, lattice_, 2);
    LatticeEquations normal(lattice_.dimensions);
    const std::ptrdiff_t cells = static_cast<std::ptrdiff_t>(x.cells) * y.cells;
    constexpr std::ptrdiff_t squareSize = 600, rightSquare = 48;
    constexpr int atOnce = 16;
    std::vector<std::vector<double>> squares(atOnce), rights(atOnce);
    std::vector<double> cubes(Index(cells * 10 * squareSize)), rightCubes(Index(cells * 4 * rightSquare));
    for (int from = 0; from < grid_.dimensions[2];) {
      int to = from;
      while (to < grid_.dimensions[2] && to < from + atOnce && z.cell[Index(to)] == z.cell[Index(from)])
        ++to;
      if (from == 0 || z.cell[Index(from)] != z.cell[Index(from) - 1]) {
        std::fill(cubes.begin(), cubes.end(), 0.0);
        std::fill(rightCubes.begin(), rightCubes.end(), 0.0);
      }
      ParallelFor(to - from, [&](std::ptrdiff_t s) {
        auto &square = squares[Index(s)], &right = rights[Index(s)];
        square.assign(Index(cells * squareSize), 0.0);
        right.assign(Index(cells * rightSquare), 0.0);
        SumSlice(warped, from + static_cast<int>(s), weighing, x, y, square.data(), right.data());
      });
      ParallelFor(cells, [&](std::ptrdiff_t cell) {
        for (int k = from; k < to; ++k) {
          const std::size_t slice = Index(k - from);
          AddProducts<squareSize>(z.pairs[Index(k)], squares[slice].data() + cell * squareSize,
                                  cubes.data() + cell * 10 * squareSize);
          AddProducts<rightSquare>(z.weights[Index(k)], rights[slice].data() + cell * rightSquare,
                                   rightCubes.data() + cell * 4 * rightSquare);
        }
      });
      const int zCell = z.cell[Index(from)];
      if (to == grid_.dimensions[2] || z.cell[Index(to)] != zCell)
        for (std::ptrdiff_t cell = 0; cell < cells; ++cell)
          Scatter(normal, static_cast<int>(cell % x.cells), static_cast<int>(cell / x.cells), zCell,
                  cubes.data() + cell * 10 * squareSize, rightCubes.data() + cell * 4 * rightSquare);
      from = to;
    }
    return normal;
  }

private:
  void SumSlice(const Seen& warped, int k, const std::vector<Weighing>& weighing, const Axis& x, const Axis& y, double* squares,
                double* rights) const
  {
    const auto& n = grid_.dimensions;
    const Eigen::Matrix3d toWorld = grid_.direction * grid_.spacing.cwiseInverse().asDiagonal() * 0.5; // central
    const std::ptrdiff_t steps[3] = {2, 2 * static_cast<std::ptrdiff_t>(n[0]), 2 * static_cast<std::ptrdiff_t>(n[0]) * n[1]};
    std::vector<double> line(Index(x.cells) * 60), right(Index(x.cells) * 12);
    for (int j = 0; j < n[1]; ++j) {
      std::fill(line.begin(), line.end(), 0.0);
      std::fill(right.begin(), right.end(), 0.0);
      bool any = false;
      for (int i = 0; i < n[0]; ++i) {
        const std::ptrdiff_t at = i * steps[0] + j * steps[1] + k * steps[2];
        const float* m = warped.data() + at;
        if (!(m[1] > 0.0f))
          continue;
        const bool inner[3] = {i > 0 && i + 1 < n[0], j > 0 && j + 1 < n[1], k > 0 && k + 1 < n[2]};
        Eigen::Vector3d slope = Eigen::Vector3d::Zero();
        for (int axis = 0; axis < 3; ++axis)
          if (inner[axis] && m[1 + steps[axis]] > 0.0f && m[1 - steps[axis]] > 0.0f)
            slope[axis] = static_cast<double>(m[steps[axis]] - m[-steps[axis]]);
        const Eigen::Vector3d g = toWorld * slope;
        double square = 0.0, residual = 0.0;
        const std::size_t box = BoxOf(i, j, k);
        for (std::size_t v = 0; v < fixed_.size(); ++v) {
          const float* f = fixed_[v].data() + at;
          const Weighing& by = weighing[v * BoxCount() + box];
          const double w = by.weight * static_cast<double>(f[1] * m[1]);
          square += w * by.m * by.m;
          residual += w * by.m * (by.f * static_cast<double>(f[0]) - by.m * static_cast<double>(m[0]));
        }
        if (!(square > 0.0))
          continue;
        any = true;
        const double outer[6] = {square * g[0] * g[0], square * g[0] * g[1], square * g[0] * g[2],
                                 square * g[1] * g[1], square * g[1] * g[2], square * g[2] * g[2]};
        const double pull[3] = {residual * g[0], residual * g[1], residual * g[2]};
        const std::size_t column = Index(i);
        AddProducts<6>(x.pairs[column], outer, line.data() + 60 * static_cast<std::ptrdiff_t>(x.cell[column]));
        AddProducts<3>(x.weights[column], pull, right.data() + 12 * static_cast<std::ptrdiff_t>(x.cell[column]));
      }
      if (!any)
        continue;
      const std::size_t row = Index(j);
      for (int cell = 0; cell < x.cells; ++cell) {
        const std::ptrdiff_t place = static_cast<std::ptrdiff_t>(y.cell[row]) * x.cells + cell;
        AddProducts<60>(y.pairs[row], line.data() + 60 * cell, squares + place * 600);
        AddProducts<12>(y.weights[row], right.data() + 12 * cell, rights + place * 48);
      }
    }
  }

  // The sums of one cell go to its 64 control points.
  static void Scatter(LatticeEquations& normal, int ci, int cj, int ck, const double* cube, const double* right)
  {
    for (int k = 0; k < 4; ++k)
      for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) {
          const std::ptrdiff_t node = normal.Node(ci + i, cj + j, ck + k);
          normal.Right()[Index(node)] += Eigen::Map<const Eigen::Vector3d>(right + ((k * 4 + j) * 4 + i) * 3);
          for (int c = 0; c < 4; ++c)
            for (int b = 0; b < 4; ++b)
              for (int a = 0; a < 4; ++a) {
                const double* sum = cube + ((pairOf[k][c] * 10 + pairOf[j][b]) * 10 + pairOf[i][a]) * 6;
                double* block = normal.Block(node, a - i, b - j, c - k);
                for (int e = 0; e < 6; ++e)
                  block[e] += sum[e];
              }
        }
  }

  int BoxAlong(std::size_t axis, int i) const { return i * boxes_[axis] / grid_.dimensions[axis]; }
  std::size_t BoxOf(int i, int j, int k) const
  {
    return Index((static_cast<std::ptrdiff_t>(BoxAlong(2, k)) * boxes_[1] + BoxAlong(1, j)) * boxes_[0] + BoxAlong(0, i));
  }
  std::size_t BoxCount() const { return Index(static_cast<std::ptrdiff_t>(boxes_[0]) * boxes_[1] * boxes_[2]); }

  std::array<int, 3> boxes_{1, 1, 1};
  const MetricLevel& moving_;
  Pose movingToWorld_;
  ImageGeometry grid_, lattice_;
  std::vector<Seen> fixed_;
};

// Where, along the axes of the moving volume, it lies in others, and how much of it.
Eigen::AlignedBox3d OverlapBox(const std::vector<DeformableVolume>& fixed, const DeformableVolume& moving, int octave,
                               double& share)
{
  const MetricLevel& level = LevelOf(*moving.features, octave);
  const ImageGeometry grid = level.geometry.Moved(moving.volumeToWorld);
  std::vector<Seen> seen(fixed.size());
  for (std::size_t f = 0; f < fixed.size(); ++f)
    SeeThrough(LevelOf(*fixed[f].features, octave), fixed[f].volumeToWorld, fixed[f].field, grid, seen[f], {});
  const Eigen::Vector3d shift = grid.direction.transpose() * (grid.origin - Level::MillimetreFrame(moving).origin);
  Eigen::AlignedBox3d box;
  double own = 0.0, common = 0.0;
  const auto& n = grid.dimensions;
  std::size_t at = 1;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i, at += 2) {
        const double w = static_cast<double>(level.seen[at / 2].Weight());
        own += w;
        if (!(w > 0.0) || std::none_of(seen.begin(), seen.end(), [at](const Seen& s) { return s[at] > 0.0f; }))
          continue;
        common += w;
        box.extend(shift + grid.spacing.cwiseProduct(Eigen::Vector3d(i, j, k)));
      }
  share = own > 0.0 ? common / own : 0.0;
  if (!box.isEmpty()) { // voxels have a size, and finer levels reach a little farther
    box.min() -= grid.spacing;
    box.max() += grid.spacing;
  }
  return box;
}

LatticeEquations::Penalty PenaltyEntries(double bending, double reachMm, const Eigen::Vector3d& spacing)
{
  LatticeEquations::Penalty entries{};
  const double mass = bending / (reachMm * reachMm * reachMm * reachMm);
  std::size_t at = 0;
  for (int c = -3; c <= 3; ++c)
    for (int b = -3; b <= 3; ++b)
      for (int a = -3; a <= 3; ++a)
        entries[at++] = bending * BendingEntry({a, b, c}, spacing) + mass * MassEntry({a, b, c}, spacing);
  return entries;
}

// The cost of a box of a fixed volume is W/2 log(1 - r^2), W being its weight before anything moved: the likelihood of two
// signals of correlation r. Its gradient and Gauss-Newton matrix are those of the residual (f - r m) / sqrt(1 - r^2) of signals
// of variance one. So what does not agree lends no weight, and blur that comes from reading between voxels wins nothing.
std::vector<Level::Weighing> WeighingOf(const Commons& now, const Commons& rigid)
{
  std::vector<Level::Weighing> weighing;
  for (std::size_t v = 0; v < now.size(); ++v) {
    const Common& c = now[v];
    const double r = c.Correlation(), scale = 1.0 / std::sqrt(c.Unexplained());
    if (c.ff > 0.0 && c.mm > 0.0) // a box that has almost left the overlap is not made up for by what is left of it
      weighing.push_back({std::fmin(2.0, rigid[v].weight / c.weight), scale * std::sqrt(c.weight / c.ff),
                          scale * r * std::sqrt(c.weight / c.mm)});
    else
      weighing.push_back({0.0, 0.0, 0.0});
  }
  return weighing;
}

void CheckVolume(const DeformableVolume& volume)
{
  if (!volume.features || volume.features->levels.empty())
    throw Error(Error::Kind::BadInput, "a volume without features cannot be deformed");
  if (volume.features->levels.front().seen.empty())
    throw Error(Error::Kind::BadInput, volume.features->name + ": the metric " + volume.features->metric +
                                           " compares descriptors; deforming needs one that compares values, as local-ncc");
}

} // namespace

ParameterList Describe(DeformableAlignParameters& p)
{
  return {
      Parameter("ControlSpacingMm", p.controlSpacingMm, {5, 500}, "mm",
                "Distance of the control points: about the size of what can bend by itself."),
      Parameter("BendingWeight", p.bendingWeight, {1e-6, 1e12}, "per mm",
                "How stiff tissue is taken to be. A lower one follows larger deformations and more noise."),
      Parameter("MinimumGain", p.minimumGain, {0, 1}, "",
                "The share of what volumes then say of each other that a displacement must add to be applied. Views of the same "
                "tissue under different angles seem to differ by some 0.1."),
      Parameter("Levels", p.levels, {1, 6}, "", "Resolutions, each half as fine as the next.").Advanced(),
      Parameter("Iterations", p.iterations, {1, 1000}, "", "Steps per resolution, at most.").Advanced(),
      Parameter("FinestMm", p.finestMm, {0.01, 100}, "mm",
                "Voxels of the last resolution are about this large. Finer is slower and more exact.")
          .Advanced(),
      Parameter("MinimumOverlap", p.minimumOverlap, {0.001, 1}, "",
                "The share of a volume that must lie in others for it to be bent.")
          .Advanced(),
  };
}

DeformableAlignResult DeformableAlign(const std::vector<DeformableVolume>& fixed, const DeformableVolume& moving,
                                      const DeformableAlignParameters& parameters, const Progress& progress)
{
  CheckRanges(parameters);
  if (fixed.empty())
    throw Error(Error::Kind::BadInput, "deformable alignment needs at least one fixed volume");
  CheckVolume(moving);
  for (const DeformableVolume& f : fixed) {
    CheckVolume(f);
    if (f.features->metric != moving.features->metric)
      throw Error(Error::Kind::BadInput,
                  f.features->name + " and " + moving.features->name + " were prepared for different metrics");
  }
  const int finest = static_cast<int>(std::lround(std::log2(parameters.finestMm))), first = finest + parameters.levels - 1;

  DeformableAlignResult result;
  const Eigen::AlignedBox3d overlap = OverlapBox(fixed, moving, std::max(first, CoarseOctave), result.overlap);
  if (result.overlap < parameters.minimumOverlap)
    throw Error(Error::Kind::NotPossible, std::to_string(100.0 * result.overlap) + "% of " + moving.features->name +
                                              " overlaps the fixed volumes; at least " +
                                              std::to_string(100.0 * parameters.minimumOverlap) +
                                              "% is required (MinimumOverlap)");

  DisplacementField field;
  Seen warped, tried;
  for (int l = 0; l < parameters.levels; ++l) {
    const Progress part = progress.Part(l == 0 ? 0.0 : std::pow(0.3, parameters.levels - l),
                                        std::pow(0.3, parameters.levels - 1 - l)); // finer levels take longer
    const bool isLast = l + 1 == parameters.levels;
    const double spacing = parameters.controlSpacingMm * (l == 0 && !isLast ? 2.0 : 1.0);
    const Level level(fixed, moving, first - l, overlap, spacing);
    result.voxelMm = level.VoxelMm();
    const double bending = parameters.bendingWeight * std::pow(SofterPerOctave, parameters.levels - 1 - l);
    const auto penalty = PenaltyEntries(bending, 3.0 * parameters.controlSpacingMm, level.Lattice().spacing);

    level.Warp(DisplacementField(), warped, {});
    const Commons rigid = level.Compare(warped);
    if (std::all_of(rigid.begin(), rigid.end(), [](const Common& c) { return !(c.weight > 0.0); }))
      throw Error(Error::Kind::NotPossible, moving.features->name + " has no features in the overlap");
    field = field.IsZero() ? DisplacementField(level.Lattice()) : field.SeenOn(level.Lattice());
    Vectors c = field.Coefficients();
    level.Warp(field, warped, {});
    Commons now = level.Compare(warped);
    const LatticeEquations shape(level.Lattice().dimensions);
    const auto costOf = [&](const Commons& commons, const Vectors& coefficients) {
      return shape.PenaltyOf(penalty, coefficients) - InformationOf(commons, rigid);
    };
    double cost = costOf(now, c), damping = 0.0;
    for (int iteration = 0; iteration < parameters.iterations; ++iteration, ++result.iterations) {
      part(static_cast<double>(iteration) / parameters.iterations);
      LatticeEquations normal = level.Equations(warped, WeighingOf(now, rigid));
      normal.AddPenalty(penalty, c);
      double step = 0.0;
      bool isBetter = false;
      const double before = cost;
      for (int attempt = 0; attempt < 5 && !isBetter; ++attempt) {
        const Vectors by = normal.Solve(damping);
        Vectors moved = c;
        step = 0.0;
        for (std::size_t i = 0; i < c.size(); ++i) {
          moved[i] += by[i];
          step = std::fmax(step, by[i].norm());
        }
        const DisplacementField trial(level.Lattice(), moved);
        level.Warp(trial, tried, {});
        const Commons there = level.Compare(tried);
        const double costThere = costOf(there, moved);
        isBetter = costThere < cost;
        if (isBetter) {
          field = trial;
          c = moved;
          now = there;
          cost = costThere;
          warped.swap(tried);
          damping = damping > 1e-2 ? damping * 0.1 : 0.0;
        } else {
          damping = std::fmax(1e-1, 10.0 * damping);
        }
        if (step < 0.01 * level.VoxelMm())
          break;
      }
      if (!isBetter || step < 0.01 * level.VoxelMm() || before - cost < 1e-5 * std::abs(before))
        break;
    }
    result.similarityBefore = Similarity(rigid);
    result.similarityAfter = Similarity(now);
    const double information = InformationOf(now, rigid);
    result.gain = information > 0.0 ? 1.0 - InformationOf(rigid, rigid) / information : 0.0;
    if (isLast) {
      const auto displacements = field.SampledOn(level.Grid());
      for (std::size_t i = 0; i < level.Grid().VoxelCount(); ++i)
        if (warped[2 * i + 1] > 0.0f)
          result.largestMm = std::fmax(result.largestMm, displacements.View()[static_cast<std::ptrdiff_t>(i)].norm());
    }
  }
  result.bendingEnergy = field.BendingEnergy();
  result.smallestDeterminant = field.SmallestDeterminant();
  if (!(result.smallestDeterminant > 0.0))
    result.reason = "the displacement folds space; increase BendingWeight or ControlSpacingMm";
  else if (!(result.gain >= parameters.minimumGain))
    result.reason = "no displacement makes the volumes clearly more alike (MinimumGain)";
  else {
    result.isApplied = true;
    result.field = field;
  }
  progress(1.0);
  return result;
}

std::vector<DeformableAlignResult> DeformInTurn(const std::vector<DeformableVolume>& volumes, int fixed,
                                                const DeformableAlignParameters& parameters, const Progress& progress)
{
  CheckRanges(parameters);
  const int count = static_cast<int>(volumes.size());
  if (count < 2)
    throw Error(Error::Kind::BadInput, "deformable alignment needs at least two volumes, got " + std::to_string(count));
  CheckFixedVolume(fixed, volumes.size());
  for (const DeformableVolume& volume : volumes)
    CheckVolume(volume);
  std::vector<DeformableAlignResult> results(volumes.size());
  std::vector<bool> isPlaced(volumes.size(), false);
  std::vector<DeformableVolume> placed{volumes[Index(fixed)]};
  placed.front().field = nullptr;
  isPlaced[Index(fixed)] = true;
  for (int turn = 1; turn < count; ++turn) {
    std::size_t next = 0;
    double most = -1.0;
    for (std::size_t v = 0; v < volumes.size(); ++v) {
      double share = 0.0;
      if (isPlaced[v])
        continue;
      OverlapBox(placed, volumes[v], CoarseOctave, share);
      if (share > most) {
        most = share;
        next = v;
      }
    }
    try {
      results[next] =
          DeformableAlign(placed, volumes[next], parameters, progress.Part((turn - 1.0) / (count - 1.0), turn / (count - 1.0)));
    } catch (const Error& error) {
      if (error.GetKind() != Error::Kind::NotPossible)
        throw;
      results[next].overlap = std::fmax(most, 0.0);
      results[next].reason = error.what();
    }
    isPlaced[next] = true;
    placed.push_back(volumes[next]);
    placed.back().field = &results[next].field;
  }
  progress(1.0);
  return results;
}

} // namespace echorama
