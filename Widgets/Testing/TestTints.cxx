// SPDX-License-Identifier: BSD-3-Clause
// Whether people who see no red (protanopia) or no green (deuteranopia) can tell tints apart. What they see: the matrices of
// Machado, Oliveira, Fernandes, "A physiologically-based model for simulation of color vision deficiency", IEEE TVCG 15(6), 2009,
// for severity 1, on linear RGB. How far colours are apart: CIE 1976 L*a*b* (CIE 15), for the white and primaries of sRGB
// (IEC 61966-2-1).
#include "Core/Base/Error.h"
#include "Widgets/Session/AlignmentSession.h"
#include "Widgets/Session/Tints.h"
#include <cmath>
#include <Eigen/Core>
#include <gtest/gtest.h>

namespace echorama {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;

Matrix3d Rows(std::array<double, 9> numbers)
{
  return Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(numbers.data());
}

const Matrix3d Protanopia = Rows({0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216, -0.003882, -0.048116, 1.051998});
const Matrix3d Deuteranopia = Rows({0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.011820, 0.042940, 0.968881});

Vector3d Linear(const Tint& tint, double grey)
{
  Vector3d linear;
  for (int c = 0; c < 3; ++c) {
    const double value = grey * tint[static_cast<std::size_t>(c)];
    linear[c] = value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
  }
  return linear;
}

Vector3d Lab(const Vector3d& linear)
{
  const Matrix3d toXyz = Rows({0.4124, 0.3576, 0.1805, 0.2126, 0.7152, 0.0722, 0.0193, 0.1192, 0.9505});
  const Vector3d white = toXyz * Vector3d::Ones(), xyz = toXyz * linear.cwiseMax(0.0).cwiseMin(1.0);
  Vector3d f;
  for (int c = 0; c < 3; ++c) {
    const double part = xyz[c] / white[c];
    f[c] = part > 216.0 / 24389.0 ? std::cbrt(part) : (24389.0 / 27.0 * part + 16.0) / 116.0;
  }
  return {116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])};
}

// The two tints of a set that are nearest to each other, for somebody who sees so, in tissue of this grey.
double LeastDistance(const char* set, const Matrix3d& seen, double grey)
{
  const std::vector<Tint>& tints = TintSetOf(set).tints;
  double least = 1e9;
  for (std::size_t a = 0; a < tints.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
      least = std::min(least, (Lab(seen * Linear(tints[a], grey)) - Lab(seen * Linear(tints[b], grey))).norm());
  return least;
}

TEST(Tints, TheColourSpaceIsRight)
{
  EXPECT_NEAR((Lab(Vector3d::Ones()) - Vector3d(100.0, 0.0, 0.0)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((Lab({1.0, 0.0, 0.0}) - Vector3d(53.24, 80.09, 67.20)).norm(), 0.0, 0.1) << "red";
  // What is red and what is green look alike to those who lack one of the two; blue and yellow do not.
  const Tint red{0.8, 0.4, 0.2}, green{0.55, 0.55, 0.1};
  for (const Matrix3d& seen : {Protanopia, Deuteranopia})
    EXPECT_LT((Lab(seen * Linear(red, 1.0)) - Lab(seen * Linear(green, 1.0))).norm(),
              0.5 * (Lab(Linear(red, 1.0)) - Lab(Linear(green, 1.0))).norm());
  EXPECT_NEAR((Protanopia * Vector3d::Ones() - Vector3d::Ones()).norm(), 0.0, 1e-4) << "greys stay";
  EXPECT_NEAR((Deuteranopia * Vector3d::Ones() - Vector3d::Ones()).norm(), 0.0, 1e-4);
}

TEST(Tints, AreToldApartWithoutRedOrGreen)
{
  for (const char* set : {"grey-amber", "blue-orange"})
    for (const Matrix3d& seen : {Matrix3d(Matrix3d::Identity()), Protanopia, Deuteranopia}) {
      EXPECT_GT(LeastDistance(set, seen, 1.0), 30.0) << set;
      EXPECT_GT(LeastDistance(set, seen, 0.5), 20.0) << set;
    }
  // Why there is a choice: seven tints are too many for that.
  EXPECT_GT(LeastDistance("many", Matrix3d::Identity(), 1.0), 30.0);
  EXPECT_LT(LeastDistance("many", Deuteranopia, 1.0), 10.0);
}

TEST(Tints, AreLight)
{
  for (const TintSet& set : TintSets())
    for (const Tint& tint : set.tints)
      EXPECT_GT(Lab(Linear(tint, 1.0))[0], 65.0) << set.name;
}

std::vector<Tint> TintsIn(const AlignmentSession& session)
{
  std::vector<Tint> tints;
  for (const SessionVolume& volume : session.State().volumes)
    tints.push_back(volume.colour);
  return tints;
}

TEST(Tints, ASessionChangesThoseThatItGave)
{
  AlignmentSession session;
  for (int i = 0; i < 4; ++i) {
    SessionVolume volume;
    volume.name = "v";
    volume.geometry.dimensions = {4, 4, 4};
    session.Add(volume);
  }
  const Tint chosen{0.1, 0.2, 0.3};
  session.SetColour(2, chosen);
  const std::vector<Tint> before = TintsIn(session), &many = TintSetOf("many").tints, &few = TintSetOf("blue-orange").tints;
  EXPECT_EQ(before, (std::vector<Tint>{many[0], chosen, many[2], many[3]}));
  const int entries = session.UndoCount();
  session.SetTints("blue-orange");
  EXPECT_EQ(TintsIn(session), (std::vector<Tint>{few[0], chosen, few[2], few[0]}));
  EXPECT_EQ(session.UndoCount(), entries + 1);
  SessionVolume next;
  next.geometry.dimensions = {4, 4, 4};
  session.Add(next);
  EXPECT_EQ(session.State().volumes.back().colour, few[1]) << "which none has";
  session.SetTints("blue-orange");
  EXPECT_EQ(session.UndoCount(), entries + 2) << "nothing to change";
  session.Undo();
  session.Undo();
  EXPECT_EQ(TintsIn(session), before);
  EXPECT_THROW(session.SetTints("red-green"), Error);
}

} // namespace
} // namespace echorama
