// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Acoustics/Interface.h"
#include "Filters/Tissue/Material.h"
#include <cmath>
#include <complex>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

using namespace echorama;
using Eigen::Vector3d;

namespace {

Fluid FluidOf(const Material& material)
{
  return {material.Impedance(), material.soundSpeed};
}

// Every pair of the standard materials, at every angle from the normal to grazing.
template <class F>
void ForPairs(F&& f)
{
  for (const Material& from : StandardMaterials())
    for (const Material& to : StandardMaterials())
      for (int i = 0; i <= 1000; ++i)
        f(FluidOf(from), FluidOf(to), std::cos(i * 1e-3 * 1.5707963267948966));
}

} // namespace

TEST(Interface, ReflectedAndTransmittedEnergyAddUpToOne)
{
  ForPairs([](const Fluid& from, const Fluid& to, double cosine) {
    const InterfaceResponse r = MeetInterface(from, to, cosine);
    EXPECT_NEAR(r.reflectedEnergy + r.transmittedEnergy, 1.0, 1e-12);
    EXPECT_GE(r.reflectedEnergy, 0.0);
    EXPECT_GE(r.transmittedEnergy, 0.0);
    EXPECT_LE(std::abs(r.reflected), 1.0);
    if (!r.total) {
      EXPECT_NEAR(r.reflected * r.reflected, r.reflectedEnergy, 1e-12);
    }
  });
}

TEST(Interface, AgreesWithTheComplexFormula)
{
  // Beyond the critical angle the transmitted cosine is imaginary, and the formula holds in complex numbers.
  ForPairs([](const Fluid& from, const Fluid& to, double cosine) {
    if (from.soundSpeed == to.soundSpeed || cosine < 1e-9)
      return;
    const double ratio = to.soundSpeed / from.soundSpeed;
    const std::complex<double> cosTransmitted =
        std::sqrt(std::complex<double>(1.0 - ratio * ratio * (1.0 - cosine * cosine), 0.0));
    const std::complex<double> a = to.impedance * cosine, b = from.impedance * cosTransmitted;
    const std::complex<double> reflected = (a - b) / (a + b);
    const InterfaceResponse r = MeetInterface(from, to, cosine);
    EXPECT_NEAR(r.reflectedEnergy, std::norm(reflected), 1e-9);
    if (std::abs(reflected.real()) > 1e-9) {
      EXPECT_EQ(r.reflected > 0.0, reflected.real() > 0.0);
    }
  });
}

TEST(Interface, SnellHolds)
{
  ForPairs([](const Fluid& from, const Fluid& to, double cosine) {
    const InterfaceResponse r = MeetInterface(from, to, cosine);
    const double sine = std::sqrt(1.0 - cosine * cosine), ratio = to.soundSpeed / from.soundSpeed;
    if (r.total) {
      EXPECT_GE(sine * ratio, 1.0 - 1e-12);
      return;
    }
    const Vector3d normal = Vector3d(0.2, -0.5, 0.7).normalized(), along = normal.unitOrthogonal();
    const Vector3d direction = sine * along - cosine * normal;
    const Vector3d bent = Refracted(direction, normal, ratio, r.cosTransmitted);
    EXPECT_NEAR(bent.norm(), 1.0, 1e-12);
    EXPECT_NEAR(bent.dot(along), ratio * sine, 1e-9); // sin t / c2 = sin i / c1
    EXPECT_NEAR(bent.dot(normal.cross(along)), 0.0, 1e-12);
    EXPECT_LE(bent.dot(normal), 1e-9);
    const Vector3d mirrored = Mirrored(direction, normal);
    EXPECT_NEAR(mirrored.dot(normal), cosine, 1e-12);
    EXPECT_NEAR(mirrored.dot(along), sine, 1e-12);
  });
}

TEST(Interface, KnownNumbers)
{
  const Fluid tissue{1.63, 1540.0}, bone{6.65, 3500.0}, air{0.00041, 343.0};
  const double r = (6.65 - 1.63) / (6.65 + 1.63);
  EXPECT_NEAR(MeetInterface(tissue, bone, 1.0).reflected, r, 1e-12);
  EXPECT_NEAR(MeetInterface(bone, tissue, 1.0).reflected, -r, 1e-12);
  EXPECT_LT(MeetInterface(tissue, air, 1.0).reflected, -0.999);
  EXPECT_GT(MeetInterface(tissue, air, 1.0).reflectedEnergy, 0.998);
  EXPECT_FALSE(MeetInterface(tissue, air, 1e-6).total); // into the slower medium there is always a way

  const double critical = std::asin(1540.0 / 3500.0);
  EXPECT_FALSE(MeetInterface(tissue, bone, std::cos(critical - 1e-6)).total);
  EXPECT_TRUE(MeetInterface(tissue, bone, std::cos(critical + 1e-6)).total);
  EXPECT_EQ(MeetInterface(tissue, bone, std::cos(critical + 1e-6)).reflectedEnergy, 1.0);

  for (const double cosine : {0.0, 1e-12, 0.5, 1.0}) { // nothing there
    EXPECT_EQ(MeetInterface(tissue, tissue, cosine).reflected, 0.0);
    EXPECT_EQ(MeetInterface(tissue, tissue, cosine).transmittedEnergy, 1.0);
    EXPECT_EQ(MeetInterface(tissue, tissue, cosine).cosTransmitted, cosine);
  }
  EXPECT_EQ(MeetInterface(tissue, {1.7, 1500.0}, 0.0).reflectedEnergy, 1.0); // grazing
  EXPECT_EQ(MeetInterface(tissue, {1.7, 1600.0}, 0.0).reflectedEnergy, 1.0);
}

TEST(Interface, AcrossStaysAcross)
{
  const Vector3d from = Vector3d(0.1, 0.2, 1.0).normalized(), across = Vector3d(1.0, 0.3, 0.0).cross(from).normalized();
  for (const Vector3d& to :
       {from, Vector3d(-from), Vector3d(0.0, 0.0, 1.0), Vector3d(1.0, 0.0, 0.0), Vector3d(-0.6, 0.0, -0.8)}) {
    const Vector3d carried = CarriedThroughBend(across, from, to);
    EXPECT_NEAR(carried.norm(), 1.0, 1e-12);
    EXPECT_NEAR(carried.dot(to), 0.0, 1e-12);
  }
  // What is perpendicular to the plane of the bend stays as it is.
  EXPECT_NEAR((CarriedThroughBend(Vector3d::UnitY(), Vector3d::UnitZ(), Vector3d::UnitX()) - Vector3d::UnitY()).norm(), 0.0,
              1e-12);
}
