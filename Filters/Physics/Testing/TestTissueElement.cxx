// SPDX-License-Identifier: BSD-3-Clause
// The element against differences of its energy and against linear elasticity, the matrix and its coarse images against sums that
// are written out, the solver of linear systems against the product with what it found.
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Physics/LatticeMultigrid.h"
#include "Filters/Physics/TissueElement.h"
#include <gtest/gtest.h>

using namespace echorama;

namespace {

const std::array<int, 3> Nodes{5, 4, 4};
const Eigen::Vector3d Spacing(1.0, 1.3, 0.8);

TissueCells Block(const std::array<int, 3>& nodes, float shear, float bulk)
{
  TissueCells cells(nodes);
  for (int k = 0; k < cells.cells[2]; ++k)
    for (int j = 0; j < cells.cells[1]; ++j)
      for (int i = 0; i < cells.cells[0]; ++i) {
        cells.shear[cells.At(i, j, k)] = shear;
        cells.bulk[cells.At(i, j, k)] = bulk;
      }
  return cells;
}

template <class T>
LatticeField<T> RandomField(const LatticeShape& shape, double size, std::uint64_t seed)
{
  LatticeField<T> field(shape);
  Random random(seed);
  ForNodes(shape.nodes, [&](int i, int j, int k) {
    for (int c = 0; c < 3; ++c)
      field.Component(c)[shape.At(i, j, k)] = static_cast<T>(random.Uniform(-size, size));
  });
  return field;
}

template <class T>
double Dot(const LatticeField<T>& a, const LatticeField<T>& b)
{
  double sum = 0.0;
  for (std::size_t n = 0; n < a.Data().size(); ++n)
    sum += static_cast<double>(a.Data()[n]) * static_cast<double>(b.Data()[n]);
  return sum;
}

LatticeField<float> Times(const LatticeMatrix& matrix, const LatticeField<float>& x)
{
  const LatticeShape& shape = matrix.Shape();
  LatticeField<double> y(shape);
  ForNodes(shape.nodes, [&](int i, int j, int k) {
    for (int offset = LatticeMatrix::Own; offset < 27; ++offset) {
      const int there[3] = {i + offset % 3 - 1, j + offset / 3 % 3 - 1, k + offset / 9 - 1};
      if (there[0] < 0 || there[1] < 0 || there[0] >= shape.nodes[0] || there[1] >= shape.nodes[1] || there[2] >= shape.nodes[2])
        continue;
      const std::ptrdiff_t from = shape.At(i, j, k), to = shape.At(there[0], there[1], there[2]);
      Eigen::Matrix3d block;
      for (int entry = 0; entry < 9; ++entry)
        block(entry / 3, entry % 3) = static_cast<double>(matrix.At(i, j, k, offset, entry / 3, entry % 3));
      y.Set(from, y.Get(from) + block * x.Get(to).cast<double>());
      if (to != from)
        y.Set(to, y.Get(to) + block.transpose() * x.Get(from).cast<double>());
    }
  });
  LatticeField<float> rounded(shape);
  std::transform(y.Data().begin(), y.Data().end(), rounded.Data().begin(),
                 [](double value) { return static_cast<float>(value); });
  return rounded;
}

// squeezed: by which part along z.
void ExpectDerivatives(double squeezed)
{
  const LatticeShape shape(Nodes);
  const TissueCells cells = Block(Nodes, 7.0f, 300.0f);
  LatticeField<double> u = RandomField<double>(shape, 0.1 * (1.0 - squeezed), 1);
  const LatticeField<double> v = RandomField<double>(shape, 1.0, 2);
  ForNodes(Nodes, [&](int i, int j, int k) { u.Component(2)[shape.At(i, j, k)] -= squeezed * Spacing.z() * k; });
  const auto moved = [&](double by) {
    LatticeField<double> field = u;
    for (std::size_t n = 0; n < field.Data().size(); ++n)
      field.Data()[n] += by * v.Data()[n];
    return field;
  };
  LatticeField<double> force(shape), plus(shape), minus(shape);
  const double energy = TissueForce(cells, Spacing, u, force), h = 1e-5;
  EXPECT_EQ(energy, TissueEnergy(cells, Spacing, u));
  const double difference = (TissueEnergy(cells, Spacing, moved(h)) - TissueEnergy(cells, Spacing, moved(-h))) / (2 * h);
  EXPECT_NEAR(Dot(force, v) / difference, 1.0, 1e-7);
  TissueForce(cells, Spacing, moved(h), plus);
  TissueForce(cells, Spacing, moved(-h), minus);
  LatticeMatrix matrix(shape);
  TissueStiffness(cells, Spacing, u, matrix, false);
  LatticeField<float> w(shape);
  for (std::size_t n = 0; n < w.Data().size(); ++n)
    w.Data()[n] = static_cast<float>(v.Data()[n]);
  const LatticeField<float> product = Times(matrix, w);
  double worst = 0.0, size = 0.0;
  for (std::size_t n = 0; n < w.Data().size(); ++n) {
    const double exact = (plus.Data()[n] - minus.Data()[n]) / (2 * h);
    worst = std::max(worst, std::abs(exact - static_cast<double>(product.Data()[n])));
    size = std::max(size, std::abs(exact));
  }
  EXPECT_LT(worst, 1e-5 * size);
}

TEST(TissueElement, ForceIsTheDerivativeOfTheEnergyAndStiffnessThatOfTheForce)
{
  ExpectDerivatives(0.0);
}

TEST(TissueElement, SoItIsOfCellsThatHaveLostMostOfTheirVolume)
{
  ExpectDerivatives(0.7);
}

// Of a cube whose height shrinks by a part: the pressure on it must grow without an end that a finite load reaches. The law
// without its resistance to collapse bears at most some m (here 4/3 of 7 kPa and 0.3 of it) before the cell vanishes.
TEST(TissueElement, ACellThatVanishesResistsMoreAndMore)
{
  const LatticeShape shape({2, 2, 2});
  const TissueCells cells = Block(shape.nodes, 7.0f, 7.0f);
  const auto pressure = [&](double height) {
    LatticeField<double> u(shape), force(shape);
    ForNodes(shape.nodes, [&](int i, int j, int k) { u.Component(2)[shape.At(i, j, k)] = (height - 1.0) * k; });
    TissueForce(cells, Eigen::Vector3d::Ones(), u, force);
    double sum = 0.0;
    ForNodes(shape.nodes, [&](int i, int j, int k) { sum -= k * force.Component(2)[shape.At(i, j, k)]; });
    return sum; // kPa: the face is 1 mm^2
  };
  const double m = 4.0 / 3.0 * 7.0;
  EXPECT_GT(pressure(0.25), 5.0 * m);
  EXPECT_GT(pressure(0.01), 20.0 * m);
  EXPECT_GT(pressure(-0.1), pressure(0.01));
}

// A uniform strain: energy of linear elasticity, no force on inner nodes. Rotations cost nothing.
TEST(TissueElement, SmallStrainsAreLinearElasticityAndRotationsAreFree)
{
  const LatticeShape shape(Nodes);
  const double mu = 7.0, lambda = 300.0, size = 1e-4;
  const TissueCells cells = Block(Nodes, static_cast<float>(mu), static_cast<float>(lambda));
  const double volume = Spacing.cwiseProduct(Eigen::Vector3d(4, 3, 3)).prod();
  Eigen::Matrix3d gradient;
  gradient << 1.0, 0.4, -0.3, 0.2, -0.5, 0.7, 0.6, 0.1, 0.3;
  const auto field = [&](const Eigen::Matrix3d& g) {
    LatticeField<double> u(shape);
    ForNodes(shape.nodes,
             [&](int i, int j, int k) { u.Set(shape.At(i, j, k), g * Spacing.cwiseProduct(Eigen::Vector3d(i, j, k))); });
    return u;
  };
  const Eigen::Matrix3d strain = 0.5 * size * (gradient + gradient.transpose());
  const double exact = volume * (mu * strain.squaredNorm() + 0.5 * lambda * strain.trace() * strain.trace());
  LatticeField<double> force(shape);
  EXPECT_NEAR(TissueForce(cells, Spacing, field(size * gradient), force) / exact, 1.0, 2e-3);
  EXPECT_LT(force.Get(shape.At(2, 1, 1)).norm(), 1e-12 * lambda);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(1.0, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix() - Eigen::Matrix3d::Identity();
  EXPECT_LT(TissueForce(cells, Spacing, field(turn), force), 1e-9);
  EXPECT_LT(force.Get(shape.At(0, 0, 0)).norm(), 1e-9);
}

TEST(TissueElement, TurnedInsideOutIsSeenAndIsPushedBack)
{
  const std::array<int, 3> nodes{2, 2, 2};
  const LatticeShape shape(nodes);
  const TissueCells cells = Block(nodes, 7.0f, 300.0f);
  LatticeField<double> u(shape), force(shape);
  EXPECT_EQ(LeastTissueVolume(cells, Eigen::Vector3d::Ones(), u), 1.0);
  for (int corner = 0; corner < 4; ++corner) // the top face goes through the bottom
    u.Component(2)[shape.At(corner & 1, corner >> 1, 1)] = -1.5;
  EXPECT_LT(LeastTissueVolume(cells, Eigen::Vector3d::Ones(), u), 0.0);
  EXPECT_NEAR(TissueVolumeRatio(cells, Eigen::Vector3d::Ones(), u), -0.5, 1e-12);
  TissueForce(cells, Eigen::Vector3d::Ones(), u, force);
  for (int corner = 0; corner < 4; ++corner)
    EXPECT_LT(force.Component(2)[shape.At(corner & 1, corner >> 1, 1)], 0.0);
}

TEST(LatticeMatrix, CoarseMatrixIsTheGalerkinProduct)
{
  for (const std::array<int, 3>& nodes : {std::array<int, 3>{6, 5, 4}, std::array<int, 3>{9, 4, 7}})
    for (int axis = 0; axis < 3; ++axis) {
      const LatticeShape shape(nodes);
      LatticeMatrix fine(shape);
      TissueStiffness(Block(nodes, 7.0f, 30.0f), Spacing, RandomField<double>(shape, 0.1, 5), fine, false);
      std::vector<float> live(static_cast<std::size_t>(shape.size), 1.0f);
      live[static_cast<std::size_t>(shape.At(1, 2, 1))] = live[static_cast<std::size_t>(shape.At(2, 1, 3))] = 0.0f;
      fine.KeepOnly(live);
      std::array<int, 3> coarseNodes = nodes;
      coarseNodes[static_cast<std::size_t>(axis)] = LatticeMatrix::CoarseCount(nodes[static_cast<std::size_t>(axis)]);
      LatticeMatrix coarse{LatticeShape(coarseNodes)};
      fine.Coarsen(axis, coarse);
      // a . P^T M A M P b, with P written out.
      const auto a = RandomField<float>(coarse.Shape(), 1.0, 6), b = RandomField<float>(coarse.Shape(), 1.0, 7);
      const auto prolong = [&](const LatticeField<float>& x) {
        LatticeField<float> y(shape);
        ForNodes(nodes, [&](int i, int j, int k) {
          std::array<int, 3> low{i, j, k}, high = low;
          low[static_cast<std::size_t>(axis)] /= 2;
          high[static_cast<std::size_t>(axis)] = (high[static_cast<std::size_t>(axis)] + 1) / 2;
          const auto at = shape.At(i, j, k);
          const Eigen::Vector3f mean =
              0.5f * (x.Get(coarse.Shape().At(low[0], low[1], low[2])) + x.Get(coarse.Shape().At(high[0], high[1], high[2])));
          y.Set(at, live[static_cast<std::size_t>(at)] * mean);
        });
        return y;
      };
      EXPECT_NEAR(Dot(a, Times(coarse, b)) / Dot(prolong(a), Times(fine, prolong(b))), 1.0, 1e-4);
    }
}

// Tissue and stone side by side, one node fixed, some of the lattice empty: entries of 16 bits, and forces on what moves as a
// whole.
TEST(LatticeMatrix, PackedMatrixIsNearlyTheSame)
{
  const std::array<int, 3> nodes{9, 6, 5};
  const LatticeShape shape(nodes);
  TissueCells cells = Block(nodes, 7.0f, 330.0f);
  for (int i = 3; i < 5; ++i)
    cells.shear[cells.At(i, 2, 1)] = cells.bulk[cells.At(i, 2, 1)] = 7e4f;
  for (int j = 0; j < 5; ++j)
    for (int k = 0; k < 4; ++k)
      cells.shear[cells.At(7, j, k)] = cells.bulk[cells.At(7, j, k)] = 0.0f;
  LatticeMatrix matrix(shape);
  TissueStiffness(cells, Spacing, RandomField<double>(shape, 0.05, 5), matrix, false);
  std::vector<float> live(static_cast<std::size_t>(shape.size), 1.0f);
  live[static_cast<std::size_t>(shape.At(2, 2, 1))] = 0.0f;
  matrix.KeepOnly(live);
  PackedLatticeMatrix packed(shape);
  packed.Pack(matrix);
  const LatticeField<float> moved = RandomField<float>(shape, 1.0, 9);
  LatticeField<float> whole(shape);
  ForNodes(nodes, [&](int i, int j, int k) { whole.Set(shape.At(i, j, k), {1.0f, -2.0f, 0.5f}); });
  for (const bool isWhole : {false, true}) {
    const LatticeField<float>& x = isWhole ? whole : moved;
    const LatticeField<float> exact = Times(matrix, x);
    LatticeField<float> scaled(shape), product(shape);
    ForNodes(nodes, [&](int i, int j, int k) {
      const std::ptrdiff_t at = shape.At(i, j, k);
      EXPECT_EQ(packed.Scale()[static_cast<std::size_t>(at)] > 0.0f, i != 8 && at != shape.At(2, 2, 1));
      scaled.Set(at, packed.Scale()[static_cast<std::size_t>(at)] * x.Get(at));
    });
    std::vector<float> row(static_cast<std::size_t>(3 * shape.Padded()));
    for (int k = 0; k < nodes[2]; ++k)
      for (int j = 0; j < nodes[1]; ++j) {
        packed.MultiplyRow(j, k, scaled, row.data());
        for (int i = 0; i < nodes[0]; ++i) {
          const std::ptrdiff_t at = shape.At(i, j, k);
          const float scale = packed.Scale()[static_cast<std::size_t>(at)];
          float around = 0.0f;
          for (int offset = 0; offset < 27; ++offset)
            around += scaled.Get(shape.At(i + offset % 3 - 1, j + offset / 3 % 3 - 1, k + offset / 9 - 1)).lpNorm<1>();
          for (int c = 0; c < 3; ++c) {
            product.Component(c)[at] = scale * row[static_cast<std::size_t>(c * shape.Padded() + i)];
            EXPECT_NEAR(product.Component(c)[at], exact.Component(c)[at], 1.6e-5f * scale * around) << i << " " << j << " " << k;
          }
        }
      }
    if (isWhole) {
      EXPECT_NEAR(Dot(product, x), Dot(exact, x), 1e-7 * Dot(scaled, scaled));
    }
  }
}

// Nearly incompressible tissue with inclusions of 10^4 times its modulus, some of it missing.
TEST(LatticeMultigrid, SolvesHardSystemsInFewSteps)
{
  const std::array<int, 3> nodes{18, 17, 13};
  const LatticeShape shape(nodes);
  TissueCells cells = Block(nodes, 7.0f, 330.0f);
  for (int k = 5; k < 8; ++k)
    for (int j = 0; j < cells.cells[1]; ++j)
      for (int i = 0; i < cells.cells[0]; ++i)
        if (j % 6 < 2)
          cells.shear[cells.At(i, j, k)] = cells.bulk[cells.At(i, j, k)] = 7e4f;
  for (int i = 0; i < 4; ++i)
    cells.shear[cells.At(i, 3, 0)] = cells.bulk[cells.At(i, 3, 0)] = 0.0f;
  std::vector<float> live(static_cast<std::size_t>(shape.size), 0.0f);
  ForNodes(nodes,
           [&](int i, int j, int k) { live[static_cast<std::size_t>(shape.At(i, j, k))] = k + 1 < nodes[2] ? 1.0f : 0.0f; });
  LatticeField<float> right = RandomField<float>(shape, 1.0, 8);
  ForNodes(nodes, [&](int i, int j, int k) {
    const auto at = shape.At(i, j, k);
    right.Set(at, live[static_cast<std::size_t>(at)] * right.Get(at));
  });
  LatticeField<float> solutions[2];
  for (int threads = 1; threads <= 2; ++threads) {
    const ThreadLimit limit(threads);
    LatticeMultigrid multigrid(nodes, Eigen::Vector3d::Constant(2.0), live);
    TissueStiffness(cells, Eigen::Vector3d::Constant(2.0), LatticeField<double>(shape), multigrid.Matrix(), false);
    multigrid.Prepare();
    auto& x = solutions[threads - 1];
    const auto result = multigrid.Solve(right, x, 1e-3, 100);
    EXPECT_TRUE(result.isConvex);
    EXPECT_LE(result.reduction, 1e-3);
    EXPECT_LE(result.steps, 45);
    LatticeField<float> product = Times(multigrid.Matrix(), x);
    double left = 0.0;
    ForNodes(nodes, [&](int i, int j, int k) {
      const auto at = shape.At(i, j, k);
      if (live[static_cast<std::size_t>(at)] != 0.0f)
        left += static_cast<double>((product.Get(at) - right.Get(at)).squaredNorm());
      else
        EXPECT_TRUE(x.Get(at).isZero());
    });
    EXPECT_LT(std::sqrt(left / Dot(right, right)), 0.02);
  }
  EXPECT_EQ(solutions[0].Data(), solutions[1].Data());
}

// Two plates that only links hold together, some of them between neighbours, most of them not.
TEST(LatticeMultigrid, LinksCountInSolutions)
{
  const std::array<int, 3> nodes{14, 13, 12};
  const LatticeShape shape(nodes);
  TissueCells cells = Block(nodes, 7.0f, 60.0f);
  const auto isEmpty = [](int k) { return k >= 5 && k < 7; };
  for (int k = 0; k < cells.cells[2]; ++k)
    for (int j = 0; j < cells.cells[1]; ++j)
      for (int i = 0; i < cells.cells[0]; ++i)
        if (isEmpty(k))
          cells.shear[cells.At(i, j, k)] = cells.bulk[cells.At(i, j, k)] = 0.0f;
  std::vector<float> live(static_cast<std::size_t>(shape.size), 0.0f);
  ForNodes(nodes, [&](int i, int j, int k) { live[static_cast<std::size_t>(shape.At(i, j, k))] = k == 11 ? 0.0f : 1.0f; });
  LatticeField<float> right = RandomField<float>(shape, 1.0, 8);
  ForNodes(nodes, [&](int i, int j, int k) {
    if (k == 6 || k == 11)
      right.Set(shape.At(i, j, k), Eigen::Vector3f::Zero());
  });
  std::vector<LatticeLink> links;
  for (int j = 0; j + 1 < nodes[1]; ++j)
    for (int i = 0; i + 1 < nodes[0]; ++i) {
      LatticeLink link;
      link.nodes = {{{i, j, 5}, 1.0}, {{i, j, 7}, -0.4}, {{i + 1, j, 7}, -0.3}, {{i, j + 1, 7}, -0.3}};
      const Eigen::Vector3d normal = Eigen::Vector3d(0.1, -0.2, 1.0).normalized();
      link.stiffness = 500.0 * normal * normal.transpose() + 5.0 * Eigen::Matrix3d::Identity();
      links.push_back(link);
    }
  LatticeMultigrid multigrid(nodes, Eigen::Vector3d::Constant(2.0), live);
  TissueStiffness(cells, Eigen::Vector3d::Constant(2.0), LatticeField<double>(shape), multigrid.Matrix(), false);
  LatticeMatrix plain = multigrid.Matrix();
  multigrid.SetLinks(links);
  multigrid.Prepare();
  LatticeField<float> x;
  const auto result = multigrid.Solve(right, x, 1e-4, 200);
  EXPECT_TRUE(result.isConvex);
  EXPECT_LE(result.reduction, 1e-4);
  EXPECT_LE(result.steps, 80);
  plain.KeepOnly(live);
  LatticeField<float> product = Times(plain, x);
  for (const LatticeLink& link : links) {
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();
    for (const auto& [node, weight] : link.nodes)
      moved += weight * x.Get(shape.At(node[0], node[1], node[2])).cast<double>();
    for (const auto& [node, weight] : link.nodes) {
      const std::ptrdiff_t at = shape.At(node[0], node[1], node[2]);
      product.Set(at, product.Get(at) + (weight * link.stiffness * moved).cast<float>());
    }
  }
  double left = 0.0;
  ForNodes(nodes, [&](int i, int j, int k) {
    const auto at = shape.At(i, j, k);
    if (live[static_cast<std::size_t>(at)] != 0.0f)
      left += static_cast<double>((product.Get(at) - right.Get(at)).squaredNorm());
  });
  EXPECT_LT(std::sqrt(left / Dot(right, right)), 2e-3);
}

} // namespace
