// SPDX-License-Identifier: BSD-3-Clause
// Coefficients are kept with three zeros around them and four numbers each: the 64 around any point of the support can then
// be read without asking whether they exist, and two registers hold one of them.
// Integrals over all space are closed: no basis function is cut, so the Gram matrices of the B-spline and its derivatives
// depend on the offset alone, and those of three dimensions are products of those along the axes.
#include "DisplacementField.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace echorama {

namespace {

constexpr int pad = 3;
constexpr double largestCoefficient = 1e6;

// Integrals of the products of two cubic B-splines, of their first and of their second derivatives, 0 to 3 apart.
constexpr double gram[3][4] = {{2416.0 / 5040.0, 1191.0 / 5040.0, 120.0 / 5040.0, 1.0 / 5040.0},
                               {80.0 / 120.0, -15.0 / 120.0, -24.0 / 120.0, -1.0 / 120.0},
                               {16.0 / 6.0, -9.0 / 6.0, 0.0, 1.0 / 6.0}};

ImageGeometry Checked(const ImageGeometry& lattice)
{
  lattice.Check("the lattice of the displacement");
  if (lattice.VoxelCount() > (std::size_t{1} << 24))
    throw Error(Error::Kind::TooLarge, "the lattice of the displacement has " + std::to_string(lattice.VoxelCount()) +
                                           " control points; 16777216 are allowed");
  return lattice;
}

// Solves c[-1]/6 + 4 c[0]/6 + c[1]/6 = v in place, for values \a stride apart; beyond the ends c is zero.
void SolveAlong(Eigen::Vector3d* v, std::ptrdiff_t stride, int count, std::vector<double>& upper)
{
  upper.resize(static_cast<std::size_t>(count));
  double pivot = 4.0;
  v[0] *= 6.0 / pivot;
  for (int i = 1; i < count; ++i) {
    upper[static_cast<std::size_t>(i)] = 1.0 / pivot;
    pivot = 4.0 - 1.0 / pivot;
    v[i * stride] = (6.0 * v[i * stride] - v[(i - 1) * stride]) / pivot;
  }
  for (int i = count - 2; i >= 0; --i)
    v[i * stride] -= upper[static_cast<std::size_t>(i) + 1] * v[(i + 1) * stride];
}

inline std::array<double, 4> ValueWeights(double t)
{
  const double s = 1.0 - t;
  return {s * s * s / 6.0, (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0, (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0,
          t * t * t / 6.0};
}

// The weighted sum of 4 x 4 x 4 coefficients of four numbers each: row by row, and rows in sums of their own, since one sum
// of all would wait for each addition.
Eigen::Vector3d SumOf64(const double* first, std::ptrdiff_t row, std::ptrdiff_t slice, const std::array<double, 4>& wx,
                        const std::array<double, 4>& wy, const std::array<double, 4>& wz)
{
  using Quad = double __attribute__((vector_size(32), aligned(8), may_alias));
  Quad sum = {};
  for (std::size_t k = 0; k < 4; ++k) {
    Quad inSlice = {};
    for (std::size_t j = 0; j < 4; ++j) {
      const Quad* c =
          reinterpret_cast<const Quad*>(first + static_cast<std::ptrdiff_t>(k) * slice + static_cast<std::ptrdiff_t>(j) * row);
      inSlice += wy[j] * ((wx[0] * c[0] + wx[1] * c[1]) + (wx[2] * c[2] + wx[3] * c[3]));
    }
    sum += wz[k] * inSlice;
  }
  return {sum[0], sum[1], sum[2]};
}

} // namespace

std::array<double, 4> CubicWeights(double t, int derivative)
{
  const double s = 1.0 - t;
  if (derivative == 0)
    return ValueWeights(t);
  if (derivative == 1)
    return {-0.5 * s * s, 1.5 * t * t - 2.0 * t, 2.0 * s - 1.5 * s * s, 0.5 * t * t};
  return {s, 3.0 * t - 2.0, 3.0 * s - 2.0, t};
}

double BendingEntry(const std::array<int, 3>& offset, const Eigen::Vector3d& h)
{
  double entry = 0.0;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) { // the second derivative along a and b
      double product = 1.0;
      for (int axis = 0; axis < 3; ++axis)
        product *= gram[(axis == a) + (axis == b)][std::abs(offset[static_cast<std::size_t>(axis)])];
      entry += product / (h[a] * h[a] * h[b] * h[b]);
    }
  return entry * h.prod();
}

double MassEntry(const std::array<int, 3>& offset, const Eigen::Vector3d& h)
{
  return gram[0][std::abs(offset[0])] * gram[0][std::abs(offset[1])] * gram[0][std::abs(offset[2])] * h.prod();
}

DisplacementField::DisplacementField(const ImageGeometry& lattice)
  : lattice_(Checked(lattice)), worldToIndex_(lattice.WorldToIndex())
{
  for (std::size_t axis = 0; axis < 3; ++axis)
    size_[axis] = lattice.dimensions[axis] + 2 * pad;
  padded_.assign(4 * static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]) * static_cast<std::size_t>(size_[2]),
                 0.0);
}

DisplacementField::DisplacementField(const ImageGeometry& lattice, const std::vector<Eigen::Vector3d>& coefficients)
  : DisplacementField(lattice)
{
  if (coefficients.size() != lattice.VoxelCount())
    throw Error(Error::Kind::BadInput, "a displacement on " + std::to_string(lattice.VoxelCount()) +
                                           " control points was given " + std::to_string(coefficients.size()) + " vectors");
  const auto& n = lattice.dimensions;
  const Eigen::Vector3d* c = coefficients.data();
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i, ++c) {
        const double length = c->norm();
        if (!(length <= largestCoefficient))
          throw Error(Error::Kind::BadInput, "a displacement has a vector that is not finite, or longer than 1e6 mm");
        largest_ = std::max(largest_, length);
        std::copy_n(c->data(), 3, padded_.data() + Place(i + pad, j + pad, k + pad));
      }
}

DisplacementField DisplacementField::Interpolating(const ImageGeometry& lattice, const std::vector<Eigen::Vector3d>& values)
{
  Checked(lattice);
  std::vector<Eigen::Vector3d> c = values;
  std::vector<double> upper;
  const auto& n = lattice.dimensions;
  if (c.size() == lattice.VoxelCount()) {
    const std::ptrdiff_t row = n[0], slice = row * n[1];
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        SolveAlong(c.data() + k * slice + j * row, 1, n[0], upper);
    for (int k = 0; k < n[2]; ++k)
      for (int i = 0; i < n[0]; ++i)
        SolveAlong(c.data() + k * slice + i, row, n[1], upper);
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        SolveAlong(c.data() + j * row + i, slice, n[2], upper);
  }
  return {lattice, c}; // which refuses what has another number of values, or a value that is not finite
}

std::vector<Eigen::Vector3d> DisplacementField::Coefficients() const
{
  const auto& n = lattice_.dimensions;
  std::vector<Eigen::Vector3d> coefficients;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        coefficients.emplace_back(Padded(i + pad, j + pad, k + pad));
  return coefficients;
}

// The first of the 64 control points around a point, counted with the zeros before, and where in its cell the point lies.
// false: the point is outside of the support.
bool DisplacementField::Support(const Eigen::Vector3d& index, int* first, Eigen::Vector3d& fraction) const
{
  for (int axis = 0; axis < 3; ++axis) {
    const double x = index[axis];
    if (!(x > -2.0 && x < size_[static_cast<std::size_t>(axis)] - 2 * pad + 1.0)) // NaN is outside
      return false;
    const double whole = std::floor(x);
    fraction[axis] = x - whole;
    first[axis] = static_cast<int>(whole) - 1 + pad;
  }
  return true;
}

Eigen::Vector3d DisplacementField::At(const Eigen::Vector3d& world) const
{
  int first[3];
  Eigen::Vector3d fraction;
  if (padded_.empty() || !Support(worldToIndex_ * world, first, fraction))
    return Eigen::Vector3d::Zero();
  const auto wx = ValueWeights(fraction[0]), wy = ValueWeights(fraction[1]), wz = ValueWeights(fraction[2]);
  return SumOf64(Padded(first[0], first[1], first[2]), 4 * static_cast<std::ptrdiff_t>(size_[0]),
                 4 * static_cast<std::ptrdiff_t>(size_[0]) * size_[1], wx, wy, wz);
}

void DisplacementField::Row(const Eigen::Vector3d& start, const Eigen::Vector3d& step, int count,
                            Eigen::Vector3d* displacements) const
{
  if (IsZero()) {
    std::fill_n(displacements, count, Eigen::Vector3d::Zero());
    return;
  }
  const Eigen::Vector3d from = worldToIndex_ * start, by = worldToIndex_.linear() * step;
  Eigen::Index along = 0;
  const double length = by.cwiseAbs().maxCoeff(&along);
  const Eigen::Index second = (along + 1) % 3, third = (along + 2) % 3;
  if (std::max(std::abs(by[second]), std::abs(by[third])) * count > 1e-9 || length == 0.0) {
    for (int n = 0; n < count; ++n)
      displacements[n] = At(start + n * step);
    return;
  }
  // Along an axis of the lattice: the sum over the other two axes is the same for the whole row, a spline in one dimension.
  int first[3];
  Eigen::Vector3d fraction, inside = from;
  inside[along] = 0.0;
  if (!Support(inside, first, fraction)) {
    std::fill_n(displacements, count, Eigen::Vector3d::Zero());
    return;
  }
  const auto wb = CubicWeights(fraction[second]), wc = CubicWeights(fraction[third]);
  const int nodes = size_[static_cast<std::size_t>(along)];
  std::vector<double> line(4 * static_cast<std::size_t>(nodes), 0.0);
  int at[3];
  for (int c = 0; c < 4; ++c)
    for (int b = 0; b < 4; ++b) {
      const double w = wb[static_cast<std::size_t>(b)] * wc[static_cast<std::size_t>(c)];
      at[second] = first[second] + b;
      at[third] = first[third] + c;
      for (int a = 0; a < nodes; ++a) {
        at[along] = a;
        const double* coefficient = Padded(at[0], at[1], at[2]);
        for (int component = 0; component < 4; ++component)
          line[static_cast<std::size_t>(4 * a + component)] += w * coefficient[component];
      }
    }
  for (int n = 0; n < count; ++n) {
    const double x = from[along] + n * by[along];
    double sum[4] = {0.0, 0.0, 0.0, 0.0};
    if (x > -2.0 && x < nodes - 2 * pad + 1.0) {
      const double whole = std::floor(x);
      const auto w = CubicWeights(x - whole);
      const double* c = line.data() + 4 * (static_cast<std::ptrdiff_t>(whole) - 1 + pad);
      for (std::size_t a = 0; a < 4; ++a, c += 4)
        for (int component = 0; component < 4; ++component)
          sum[component] += w[a] * c[component];
    }
    displacements[n] = {sum[0], sum[1], sum[2]};
  }
}

Volume<Eigen::Vector3d> DisplacementField::SampledOn(const ImageGeometry& grid, const Progress& progress) const
{
  grid.Check("the grid of the displacement");
  Volume<Eigen::Vector3d> sampled(grid.dimensions, Eigen::Vector3d::Zero());
  const auto view = sampled.View();
  const Eigen::Affine3d toWorld = grid.IndexToWorld();
  ParallelFor(grid.dimensions[2], progress, [&](std::ptrdiff_t k) {
    for (int j = 0; j < grid.dimensions[1]; ++j)
      Row(toWorld * Eigen::Vector3d(0.0, j, static_cast<double>(k)), toWorld.linear().col(0), grid.dimensions[0],
          view.Row(j, static_cast<int>(k)));
  });
  return sampled;
}

std::vector<Eigen::Vector3d> DisplacementField::ValuesOn(const ImageGeometry& lattice) const
{
  const auto values = SampledOn(Checked(lattice));
  return {values.View().begin(), values.View().end()};
}

Eigen::Matrix3d DisplacementField::Jacobian(const Eigen::Vector3d& world) const
{
  int first[3];
  Eigen::Vector3d fraction;
  if (padded_.empty() || !Support(worldToIndex_ * world, first, fraction))
    return Eigen::Matrix3d::Identity();
  std::array<double, 4> w[3], d[3];
  for (int axis = 0; axis < 3; ++axis) {
    w[axis] = CubicWeights(fraction[axis]);
    d[axis] = CubicWeights(fraction[axis], 1);
  }
  Eigen::Matrix3d byIndex = Eigen::Matrix3d::Zero();
  for (std::size_t k = 0; k < 4; ++k)
    for (std::size_t j = 0; j < 4; ++j)
      for (std::size_t i = 0; i < 4; ++i) {
        const Eigen::Map<const Eigen::Vector3d> c(
            Padded(first[0] + static_cast<int>(i), first[1] + static_cast<int>(j), first[2] + static_cast<int>(k)));
        byIndex.col(0) += d[0][i] * w[1][j] * w[2][k] * c;
        byIndex.col(1) += w[0][i] * d[1][j] * w[2][k] * c;
        byIndex.col(2) += w[0][i] * w[1][j] * d[2][k] * c;
      }
  return Eigen::Matrix3d::Identity() + byIndex * worldToIndex_.linear();
}

Eigen::Vector3d DisplacementField::Inverse(const Eigen::Vector3d& read, double tolerance) const
{
  Eigen::Vector3d x = read;
  for (int step = 0; step < 200; ++step) {
    const Eigen::Vector3d off = read - x - At(x);
    x += off;
    if (off.norm() <= tolerance)
      return x;
  }
  throw Error(Error::Kind::NotPossible, "a displacement could not be inverted: it turns over or stretches too much");
}

double DisplacementField::SmallestDeterminant(int perCell) const
{
  if (IsZero())
    return 1.0;
  const Eigen::Affine3d toWorld = lattice_.IndexToWorld();
  std::array<int, 3> count;
  for (std::size_t axis = 0; axis < 3; ++axis)
    count[axis] = (lattice_.dimensions[axis] + 3) * perCell;
  std::vector<double> smallest(static_cast<std::size_t>(count[2]), 1.0);
  ParallelFor(count[2], [&](std::ptrdiff_t k) {
    for (int j = 0; j < count[1]; ++j)
      for (int i = 0; i < count[0]; ++i) {
        const Eigen::Vector3d index = Eigen::Vector3d(i, j, static_cast<double>(k)) / perCell - Eigen::Vector3d::Constant(2.0);
        double& so = smallest[static_cast<std::size_t>(k)];
        so = std::min(so, Jacobian(toWorld * index).determinant());
      }
  });
  return *std::min_element(smallest.begin(), smallest.end());
}

double DisplacementField::BendingEnergy() const
{
  if (IsZero())
    return 0.0;
  double entries[4][4][4];
  for (int c = 0; c < 4; ++c)
    for (int b = 0; b < 4; ++b)
      for (int a = 0; a < 4; ++a)
        entries[c][b][a] = BendingEntry({a, b, c}, lattice_.spacing);
  const auto& n = lattice_.dimensions;
  return ParallelSum<double>(n[2], 1, [&](std::ptrdiff_t k, std::ptrdiff_t) {
    double energy = 0.0;
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const Eigen::Map<const Eigen::Vector3d> own(Padded(i + pad, j + pad, static_cast<int>(k) + pad));
        Eigen::Vector3d force = Eigen::Vector3d::Zero();
        for (int c = -3; c <= 3; ++c)
          for (int b = -3; b <= 3; ++b)
            for (int a = -3; a <= 3; ++a)
              force += entries[std::abs(c)][std::abs(b)][std::abs(a)] *
                       Eigen::Map<const Eigen::Vector3d>(Padded(i + a + pad, j + b + pad, static_cast<int>(k) + c + pad));
        energy += own.dot(force);
      }
    return energy;
  });
}

} // namespace echorama
