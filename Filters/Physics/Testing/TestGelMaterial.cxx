// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Physics/GelMaterial.h"
#include <cmath>
#include <Eigen/LU>
#include <gtest/gtest.h>

using namespace echorama;

namespace {

GelStrainLanes Rest()
{
  GelStrainLanes lanes{};
  for (int l = 0; l < GelLanes; ++l) {
    lanes.b[0][l] = lanes.b[1][l] = lanes.b[2][l] = 1.0;
    lanes.J[l] = 1.0;
  }
  return lanes;
}

GelStrain LaneOf(const GelStrainLanes& lanes, int l)
{
  GelStrain strain;
  for (int c = 0; c < 6; ++c)
    strain.b[c] = lanes.b[c][l];
  strain.J = lanes.J[l];
  return strain;
}

} // namespace

TEST(GelMaterial, FlowsAtTheStressOfHerschelAndBulkley)
{
  // Simple shear at a constant rate, one rate per lane, until the stress no longer changes.
  for (const double exponent : {1.0, 0.7, 0.4, 0.2}) {
    GelMaterial material;
    material.exponent = exponent;
    material.shearModulus = 10000.0; // so that elastic strains are small: the law is that of such gel
    const GelLaw law(material);
    GelStrainLanes lanes = Rest();
    for (int l = 0; l < GelLanes; ++l)
      lanes.C[1][l] = std::pow(2.0, l - 3);
    for (int step = 0; step < 100000; ++step)
      AdvanceGelStrain(law, 2e-4, GelLanes, lanes);
    for (int l = 1; l < GelLanes; ++l) {
      const double expected = material.yieldStress + material.consistency * std::pow(lanes.C[1][l], exponent);
      EXPECT_NEAR(GelShearStress(law, LaneOf(lanes, l)), expected, 0.03 * expected) << exponent << " " << lanes.C[1][l];
      EXPECT_NEAR(lanes.J[l], 1.0, 1e-9);
    }
  }
}

TEST(GelMaterial, IsElasticBelowYield)
{
  const GelMaterial material;
  const GelLaw law(material);
  GelStrainLanes lanes = Rest();
  const double shear = 0.5 * material.yieldStress / material.shearModulus;
  for (const double sign : {1.0, -1.0}) {
    for (int l = 0; l < GelLanes; ++l)
      lanes.C[1][l] = sign * shear;
    for (int step = 0; step < 1000; ++step)
      AdvanceGelStrain(law, 1e-3, GelLanes, lanes);
    if (sign > 0.0) {
      EXPECT_NEAR(GelStress(law, LaneOf(lanes, 0))(0, 1), material.shearModulus * shear, 1e-6 * material.yieldStress);
    }
  }
  EXPECT_LT(GelShearStress(law, LaneOf(lanes, 0)), 1e-9 * material.yieldStress); // and goes back to rest
}

TEST(GelMaterial, StrainFollowsRotation)
{
  GelMaterial material;
  material.yieldStress = 1e6;
  const GelLaw law(material);
  GelStrainLanes lanes = Rest();
  lanes.b[0][0] = 1.2;
  lanes.b[1][0] = 1.0 / 1.2;
  const double before = GelShearStress(law, LaneOf(lanes, 0));
  lanes.C[1][0] = -1.0; // about z
  lanes.C[3][0] = 1.0;
  for (int step = 0; step < 15708; ++step) // a quarter of a turn
    AdvanceGelStrain(law, 1e-4, GelLanes, lanes);
  const GelStrain after = LaneOf(lanes, 0);
  EXPECT_NEAR(after.b[1], 1.2, 1e-3);
  EXPECT_NEAR(GelShearStress(law, after), before, 1e-3 * before);
}

TEST(GelMaterial, RecoversFromInversion)
{
  const GelLaw law{GelMaterial()};
  GelStrainLanes lanes = Rest();
  lanes.C[0][0] = -2e3; // turned inside out by a step of 1 ms
  lanes.C[0][1] = -1e3; // flat
  lanes.C[0][2] = std::nan("");
  EXPECT_EQ(AdvanceGelStrain(law, 1e-3, 3, lanes), 3);
  for (int l = 0; l < 3; ++l) {
    EXPECT_EQ(lanes.b[0][l], 1.0);
    EXPECT_GT(lanes.J[l], 0.0);
    EXPECT_TRUE(GelStress(law, LaneOf(lanes, l)).allFinite());
  }
}

TEST(GelMaterial, PressureResistsCompression)
{
  GelMaterial material;
  material.bulkModulus = 20000.0;
  const GelLaw law(material);
  GelStrain strain;
  strain.J = 0.99;
  EXPECT_NEAR(GelStress(law, strain).trace() / 3.0, -0.01 * material.bulkModulus, 2.0);
}
