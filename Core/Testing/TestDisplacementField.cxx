// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Imaging/DisplacementField.h"
#include <gtest/gtest.h>
#include <limits>

namespace echorama {
namespace {

ImageGeometry ObliqueLattice(std::array<int, 3> dimensions = {6, 5, 7})
{
  ImageGeometry lattice;
  lattice.dimensions = dimensions;
  lattice.spacing = {20.0, 24.0, 17.0};
  lattice.origin = {-31.0, 12.0, 40.0};
  lattice.direction = ExpRotation({0.3, -0.5, 0.8});
  return lattice;
}

DisplacementField RandomField(const ImageGeometry& lattice, double mm, std::uint64_t seed = 5)
{
  Random random(seed);
  std::vector<Eigen::Vector3d> coefficients(lattice.VoxelCount());
  for (auto& c : coefficients)
    c = Eigen::Vector3d(random.Uniform(-mm, mm), random.Uniform(-mm, mm), random.Uniform(-mm, mm));
  return {lattice, coefficients};
}

// A point of the lattice between the given indices.
Eigen::Vector3d PointIn(const ImageGeometry& lattice, Random& random, double margin)
{
  Eigen::Vector3d index;
  for (int axis = 0; axis < 3; ++axis)
    index[axis] = random.Uniform(margin, lattice.dimensions[static_cast<std::size_t>(axis)] - 1.0 - margin);
  return lattice.IndexToWorld() * index;
}

Error::Kind KindOf(const std::function<void()>& call)
{
  try {
    call();
  } catch (const Error& error) {
    return error.GetKind();
  }
  ADD_FAILURE() << "nothing was thrown";
  return Error::Kind::Cancelled;
}

TEST(DisplacementField, WeightsAreAPartitionOfUnityAndDeriveEachOther)
{
  for (double t = 0.0; t <= 1.0; t += 0.125) {
    const auto w = CubicWeights(t), d = CubicWeights(t, 1), dd = CubicWeights(t, 2);
    EXPECT_NEAR(w[0] + w[1] + w[2] + w[3], 1.0, 1e-15);
    EXPECT_NEAR(d[0] + d[1] + d[2] + d[3], 0.0, 1e-15);
    const double e = 1e-5;
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(d[i], (CubicWeights(t + e)[i] - CubicWeights(t - e)[i]) / (2.0 * e), 1e-9);
      EXPECT_NEAR(dd[i], (CubicWeights(t + e, 1)[i] - CubicWeights(t - e, 1)[i]) / (2.0 * e), 1e-9);
    }
  }
}

TEST(DisplacementField, LinearFieldsAreExactInside)
{
  const ImageGeometry lattice = ObliqueLattice();
  Eigen::Matrix3d slope;
  slope << 0.02, -0.05, 0.01, 0.03, 0.04, -0.02, -0.01, 0.02, 0.06;
  const Eigen::Vector3d shift(1.5, -2.0, 0.7);
  std::vector<Eigen::Vector3d> coefficients;
  for (int k = 0; k < 7; ++k)
    for (int j = 0; j < 5; ++j)
      for (int i = 0; i < 6; ++i)
        coefficients.push_back(slope * (lattice.IndexToWorld() * Eigen::Vector3d(i, j, k)) + shift);
  const DisplacementField field(lattice, coefficients);
  Random random(1);
  for (int n = 0; n < 50; ++n) {
    const Eigen::Vector3d x = PointIn(lattice, random, 1.0);
    EXPECT_LT((field.At(x) - (slope * x + shift)).norm(), 1e-12);
    EXPECT_LT((field.Jacobian(x) - (Eigen::Matrix3d::Identity() + slope)).norm(), 1e-13);
  }
}

TEST(DisplacementField, FadesToExactlyZeroOutside)
{
  const ImageGeometry lattice = ObliqueLattice();
  const DisplacementField field = RandomField(lattice, 3.0);
  const Eigen::Affine3d toWorld = lattice.IndexToWorld();
  EXPECT_GT(field.At(toWorld * Eigen::Vector3d(-1.0, 2.0, 3.0)).norm(), 1e-3);
  EXPECT_LT(field.At(toWorld * Eigen::Vector3d(-1.999, 2.0, 3.0)).norm(), 1e-8);
  EXPECT_EQ(field.At(toWorld * Eigen::Vector3d(-2.0001, 2.0, 3.0)).norm(), 0.0);
  EXPECT_EQ(field.At(toWorld * Eigen::Vector3d(2.0, 6.0001, 3.0)).norm(), 0.0);
  EXPECT_EQ(field.At(Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN())).norm(), 0.0);
  EXPECT_EQ(field.At(Eigen::Vector3d::Constant(1e300)).norm(), 0.0);
  EXPECT_EQ(DisplacementField().At(Eigen::Vector3d::Zero()).norm(), 0.0);
  EXPECT_EQ(DisplacementField().Jacobian(Eigen::Vector3d::Zero()), Eigen::Matrix3d::Identity());
  EXPECT_TRUE(DisplacementField().IsZero());
  Random random(2);
  for (int n = 0; n < 200; ++n)
    EXPECT_LE(field.At(PointIn(lattice, random, -2.0)).norm(), field.Bound());
}

TEST(DisplacementField, JacobianIsTheDerivative)
{
  const ImageGeometry lattice = ObliqueLattice();
  const DisplacementField field = RandomField(lattice, 4.0);
  Random random(3);
  for (int n = 0; n < 30; ++n) {
    const Eigen::Vector3d x = PointIn(lattice, random, -1.5);
    const Eigen::Matrix3d jacobian = field.Jacobian(x);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d e = 1e-4 * Eigen::Vector3d::Unit(axis);
      const Eigen::Vector3d slope = (field.At(x + e) - field.At(x - e)) / 2e-4 + Eigen::Vector3d::Unit(axis);
      EXPECT_LT((jacobian.col(axis) - slope).norm(), 1e-8);
    }
  }
}

TEST(DisplacementField, RowsAreThePoints)
{
  const ImageGeometry lattice = ObliqueLattice();
  const DisplacementField field = RandomField(lattice, 4.0);
  const Eigen::Vector3d start = lattice.IndexToWorld() * Eigen::Vector3d(-3.0, 1.3, 2.6);
  std::vector<Eigen::Vector3d> row(90);
  for (const Eigen::Vector3d& step :
       {Eigen::Vector3d(2.1 * lattice.direction.col(0)), Eigen::Vector3d(-1.7 * lattice.direction.col(1)),
        Eigen::Vector3d(1.1 * lattice.direction.col(2)), Eigen::Vector3d(1.0, 0.5, -0.3), Eigen::Vector3d(0.0, 0.0, 0.0)}) {
    field.Row(start, step, 90, row.data());
    for (int i = 0; i < 90; ++i)
      EXPECT_LT((row[static_cast<std::size_t>(i)] - field.At(start + i * step)).norm(), 1e-12);
  }
  field.Row(lattice.IndexToWorld() * Eigen::Vector3d(0.0, -9.0, 0.0), lattice.direction.col(0), 90, row.data());
  for (const auto& u : row)
    EXPECT_EQ(u.norm(), 0.0);
  const ThreadLimit one(1);
  const auto alone = field.SampledOn(lattice);
  const ThreadLimit two(2);
  const auto both = field.SampledOn(lattice);
  EXPECT_TRUE(std::equal(alone.View().begin(), alone.View().end(), both.View().begin()));
}

TEST(DisplacementField, AnImageOfDisplacementsIsAField)
{
  const ImageGeometry lattice = ObliqueLattice();
  Random random(4);
  std::vector<Eigen::Vector3d> values(lattice.VoxelCount());
  for (auto& v : values)
    v = 3.0 * random.Direction();
  const DisplacementField field = DisplacementField::Interpolating(lattice, values);
  const auto sampled = field.SampledOn(lattice);
  for (std::size_t i = 0; i < values.size(); ++i)
    EXPECT_LT((sampled.View()[static_cast<std::ptrdiff_t>(i)] - values[i]).norm(), 1e-12);

  // a field made of coefficients is the one that its own values give
  const DisplacementField made = RandomField(lattice, 2.0), again = made.SeenOn(lattice);
  const auto a = made.Coefficients(), b = again.Coefficients();
  for (std::size_t i = 0; i < a.size(); ++i)
    EXPECT_LT((a[i] - b[i]).norm(), 1e-12);

  // a lattice of one slice, as a 2D image has it
  const DisplacementField flat =
      DisplacementField::Interpolating(ObliqueLattice({4, 3, 1}), std::vector<Eigen::Vector3d>(12, {1.0, 2.0, 0.0}));
  EXPECT_LT((flat.At(flat.Lattice().Centre() - flat.Lattice().direction.col(0) * 10.0) - Eigen::Vector3d(1.0, 2.0, 0.0)).norm(),
            0.2);
}

TEST(DisplacementField, ARefinedLatticeHoldsTheSameField)
{
  const ImageGeometry coarse = ObliqueLattice({4, 4, 4});
  const DisplacementField field = RandomField(coarse, 3.0);
  ImageGeometry fine = coarse;
  fine.spacing *= 0.5;
  fine.origin = coarse.IndexToWorld() * Eigen::Vector3d::Constant(-1.5);
  fine.dimensions = {13, 13, 13}; // beyond the support on every side
  const DisplacementField refined = field.SeenOn(fine);
  Random random(6);
  for (int n = 0; n < 100; ++n) {
    const Eigen::Vector3d x = PointIn(coarse, random, -2.2);
    EXPECT_LT((refined.At(x) - field.At(x)).norm(), 1e-11);
  }
  EXPECT_NEAR(refined.BendingEnergy(), field.BendingEnergy(), 1e-9 * field.BendingEnergy());
}

TEST(DisplacementField, InverseUndoes)
{
  const ImageGeometry lattice = ObliqueLattice();
  const DisplacementField field = RandomField(lattice, 6.0);
  ASSERT_GT(field.SmallestDeterminant(), 0.2);
  Random random(7);
  for (int n = 0; n < 50; ++n) {
    const Eigen::Vector3d x = PointIn(lattice, random, -2.0);
    EXPECT_LT((field.Inverse(x + field.At(x), 1e-9) - x).norm(), 1e-8);
  }
  std::vector<Eigen::Vector3d> wild(1, Eigen::Vector3d(500.0, 0.0, 0.0));
  const DisplacementField folded(ObliqueLattice({1, 1, 1}), wild);
  EXPECT_LT(folded.SmallestDeterminant(), 0.0);
  EXPECT_EQ(KindOf([&] { folded.Inverse(folded.Lattice().origin + Eigen::Vector3d(5.0, 0.0, 0.0)); }), Error::Kind::NotPossible);
}

TEST(DisplacementField, DeterminantOfOneBump)
{
  // One control point: u = c B(x) B(y) B(z), steepest where B' = -2/3, in the middle of the other axes where B = 2/3.
  ImageGeometry lattice;
  lattice.dimensions = {1, 1, 1};
  lattice.spacing.setConstant(10.0);
  for (const double c : {4.0, 20.0, 40.0}) {
    const DisplacementField field(lattice, {Eigen::Vector3d(c, 0.0, 0.0)});
    EXPECT_NEAR(field.SmallestDeterminant(3), 1.0 - c / 10.0 * 2.0 / 3.0 * 4.0 / 9.0, 1e-12);
  }
  EXPECT_EQ(DisplacementField(lattice).SmallestDeterminant(), 1.0);
}

TEST(DisplacementField, EntriesAreTheIntegrals)
{
  // Against Gauss points in every cell, four along each axis: exact for these polynomials.
  const ImageGeometry lattice = ObliqueLattice({2, 3, 2});
  const DisplacementField field = RandomField(lattice, 2.0);
  const Eigen::Affine3d toWorld = lattice.IndexToWorld();
  const double places[4] = {-0.861136311594053, -0.339981043584856, 0.339981043584856, 0.861136311594053};
  const double weights[4] = {0.347854845137454, 0.652145154862546, 0.652145154862546, 0.347854845137454};
  double bending = 0.0, mass = 0.0;
  const int cells[3] = {5, 6, 5};
  for (int z = 0; z < 4 * cells[2]; ++z)
    for (int y = 0; y < 4 * cells[1]; ++y)
      for (int x = 0; x < 4 * cells[0]; ++x) {
        const auto at = [&places](int n) { return n / 4 - 2 + 0.5 + 0.5 * places[n % 4]; };
        const Eigen::Vector3d p = toWorld * Eigen::Vector3d(at(x), at(y), at(z));
        const double w = weights[x % 4] * weights[y % 4] * weights[z % 4] / 8.0 * lattice.spacing.prod();
        mass += w * field.At(p).squaredNorm();
        for (int axis = 0; axis < 3; ++axis) {
          const Eigen::Vector3d step = 0.01 * Eigen::Vector3d::Unit(axis);
          bending += w * ((field.Jacobian(p + step) - field.Jacobian(p - step)) / 0.02).squaredNorm();
        }
      }
  EXPECT_NEAR(field.BendingEnergy() / bending, 1.0, 1e-5);
  const auto c = field.Coefficients();
  double product = 0.0;
  for (int a = 0; a < 12; ++a)
    for (int b = 0; b < 12; ++b)
      product += c[static_cast<std::size_t>(a)].dot(c[static_cast<std::size_t>(b)]) *
                 MassEntry({b % 2 - a % 2, b / 2 % 3 - a / 2 % 3, b / 6 - a / 6}, lattice.spacing);
  EXPECT_NEAR(product / mass, 1.0, 1e-9);
}

TEST(DisplacementField, RefusesWhatIsNoField)
{
  ImageGeometry lattice = ObliqueLattice({2, 2, 2});
  EXPECT_EQ(KindOf([&] { DisplacementField(lattice, std::vector<Eigen::Vector3d>(7, Eigen::Vector3d::Zero())); }),
            Error::Kind::BadInput);
  EXPECT_EQ(KindOf([&] { DisplacementField::Interpolating(lattice, std::vector<Eigen::Vector3d>(9, Eigen::Vector3d::Zero())); }),
            Error::Kind::BadInput);
  std::vector<Eigen::Vector3d> values(8, Eigen::Vector3d::Zero());
  values[3][1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(KindOf([&] { DisplacementField(lattice, values); }), Error::Kind::BadInput);
  EXPECT_EQ(KindOf([&] { DisplacementField::Interpolating(lattice, values); }), Error::Kind::BadInput);
  lattice.spacing[2] = 0.0;
  EXPECT_EQ(KindOf([&] { DisplacementField{lattice}; }), Error::Kind::BadInput);
  lattice = ObliqueLattice({1024, 1024, 1024});
  EXPECT_EQ(KindOf([&] { DisplacementField{lattice}; }), Error::Kind::TooLarge);
}

} // namespace
} // namespace echorama
