// SPDX-License-Identifier: BSD-3-Clause
// The elastic strain is carried as b (Yue 2015), so that nothing needs a singular value decomposition. A step first moves it with
// the flow, b <- f b f^T with f = 1 + dt C, and gives it the determinant 1 again: changes of volume are J's. Then
// flow takes shear from it along the deviator's own direction (Simo 1988): with T the stress in shear,
//   T + mu dt r = T_trial,   T = yield + consistency r^exponent,
// one equation with one unknown for each particle that yields. In x = T - yield it reads x + a x^(1/exponent) = X, which is
// convex and rising: Newton's method comes down to the root from any place above it, and the smaller one of the roots of either
// term alone is such a place. The deviator is scaled by T / T_trial, and the trace follows from the determinant.
//
// Pressure: kappa (J^2 - 1) / 2.
#include "GelMaterial.h"
#include "IndependentLoop.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

using GelOct = double __attribute__((vector_size(64)));
using GelOctBits = long long __attribute__((vector_size(64)));
static_assert(sizeof(GelOct) == GelLanes * sizeof(double));

constexpr double toInteger = 0x1.8p52; // its last bits count ones
constexpr long long toIntegerBits = 0x4338000000000000;

// v^power of positive numbers, to some 1e-12: 2^(power log2(v)).
[[gnu::always_inline]] inline GelOct Power(const GelOct& v, double power)
{
  const GelOctBits bits = reinterpret_cast<GelOctBits>(v);
  const GelOctBits exponent = (bits - 0x3fe6a09e667f3bcd) >> 52, mantissa = bits - (exponent << 52); // from sqrt(1/2) on
  const GelOctBits counted = exponent + toIntegerBits;
  const GelOct whole = reinterpret_cast<GelOct>(counted) - toInteger, m = reinterpret_cast<GelOct>(mantissa);
  const GelOct t = (m - 1.0) / (m + 1.0), q = t * t;
  const GelOct series = 1.0 + q * (1.0 / 3 + q * (1.0 / 5 + q * (1.0 / 7 + q * (1.0 / 9 + q * (1.0 / 11 + q * (1.0 / 13))))));
  GelOct two = power * (whole + 2.8853900817779268 * t * series); // 2 / ln 2
  two = two < -1000.0 ? GelOct{} - 1000.0 : two > 1000.0 ? GelOct{} + 1000.0 : two;
  const GelOct rounded = two + toInteger, x = 0.6931471805599453 * (two - (rounded - toInteger));
  const GelOct e =
      1.0 +
      x * (1.0 +
           x * (1.0 / 2 +
                x * (1.0 / 6 +
                     x * (1.0 / 24 + x * (1.0 / 120 +
                                          x * (1.0 / 720 + x * (1.0 / 5040 + x * (1.0 / 40320 + x * (1.0 / 362880 +
                                                                                                     x * (1.0 / 3628800))))))))));
  const GelOctBits scaled = reinterpret_cast<GelOctBits>(e) + (reinterpret_cast<GelOctBits>(rounded) << 52);
  return reinterpret_cast<GelOct>(scaled);
}

// From the stress T_trial of each lane to T / T_trial, which is 1 up to the yield stress. Flow at the rate r takes away
// stiffness * r.
void FindGelFlow(const GelLaw& law, const double* trial, const double* stiffnesses, double* scale)
{
  const GelOct stress = *reinterpret_cast<const GelOct*>(trial), stiffness = *reinterpret_cast<const GelOct*>(stiffnesses);
  const GelOctBits flows = stress > law.yield;
  const GelOct X = flows ? stress - law.yield : GelOct{} + 1.0;
  GelOct x = {};
  if (law.consistency > 0.0 && law.exponent == 1.0)
    x = X / (1.0 + stiffness / law.consistency);
  else if (law.consistency > 0.0) {
    const double power = 1.0 / law.exponent;
    const GelOct other = law.consistency * Power(X / stiffness, law.exponent);
    x = X < other ? X : other;
    for (int round = 0; round < 30; ++round) {
      const GelOct flow = stiffness * Power(x / law.consistency, power);
      const GelOct change = (x + flow - X) / (1.0 + power * flow / x);
      x -= change;
      const GelOctBits open = (change < 0.0 ? -change : change) > 1e-6 * x; // the error of the next one is its square
      long long any = 0;
      for (int l = 0; l < GelLanes; ++l)
        any |= open[l];
      if (any == 0)
        break;
    }
  }
  *reinterpret_cast<GelOct*>(scale) = flows ? (law.yield + x) / stress : GelOct{} + 1.0;
}

int MoveGelStrain(double shear, double seconds, int count, GelStrainLanes& lanes, double* stress, double* stiffness)
{
  double torn[GelLanes];
  ECHORAMA_INDEPENDENT
  for (int l = 0; l < GelLanes; ++l) {
    const double f0 = 1.0 + seconds * lanes.C[0][l], f1 = seconds * lanes.C[1][l], f2 = seconds * lanes.C[2][l];
    const double f3 = seconds * lanes.C[3][l], f4 = 1.0 + seconds * lanes.C[4][l], f5 = seconds * lanes.C[5][l];
    const double f6 = seconds * lanes.C[6][l], f7 = seconds * lanes.C[7][l], f8 = 1.0 + seconds * lanes.C[8][l];
    const double xx = lanes.b[0][l], yy = lanes.b[1][l], zz = lanes.b[2][l];
    const double xy = lanes.b[3][l], xz = lanes.b[4][l], yz = lanes.b[5][l];
    const double determinant = f0 * (f4 * f8 - f5 * f7) - f1 * (f3 * f8 - f5 * f6) + f2 * (f3 * f7 - f4 * f6);
    // f b
    const double m0 = f0 * xx + f1 * xy + f2 * xz, m1 = f0 * xy + f1 * yy + f2 * yz, m2 = f0 * xz + f1 * yz + f2 * zz;
    const double m3 = f3 * xx + f4 * xy + f5 * xz, m4 = f3 * xy + f4 * yy + f5 * yz, m5 = f3 * xz + f4 * yz + f5 * zz;
    const double m6 = f6 * xx + f7 * xy + f8 * xz, m7 = f6 * xy + f7 * yy + f8 * yz, m8 = f6 * xz + f7 * yz + f8 * zz;
    // f b f^T
    double a = m0 * f0 + m1 * f1 + m2 * f2, b = m3 * f3 + m4 * f4 + m5 * f5, c = m6 * f6 + m7 * f7 + m8 * f8;
    double d = m0 * f3 + m1 * f4 + m2 * f5, e = m0 * f6 + m1 * f7 + m2 * f8, g = m3 * f6 + m4 * f7 + m5 * f8;
    const double volume = a * (b * c - g * g) - d * (d * c - g * e) + e * (d * g - b * e);
    const bool bad = !((determinant > 0.1) & (determinant < 10.0) & (volume > 0.01) & (volume < 100.0));
    const double v = bad ? 1.0 : volume;
    // v^(-1/3): Newton's method from below.
    double y = 3.0 / (2.0 + v);
    for (int round = 0; round < 6; ++round)
      y *= (4.0 - v * y * y * y) * (1.0 / 3.0);
    a = bad ? 1.0 : a * y;
    b = bad ? 1.0 : b * y;
    c = bad ? 1.0 : c * y;
    d = bad ? 0.0 : d * y;
    e = bad ? 0.0 : e * y;
    g = bad ? 0.0 : g * y;
    const double third = (a + b + c) * (1.0 / 3.0);
    const double a0 = a - third, b0 = b - third, c0 = c - third;
    const double square = a0 * a0 + b0 * b0 + c0 * c0 + 2.0 * (d * d + e * e + g * g);
    stress[l] = shear * std::sqrt(0.5 * square);
    stiffness[l] = shear * third * seconds;
    lanes.b[0][l] = a;
    lanes.b[1][l] = b;
    lanes.b[2][l] = c;
    lanes.b[3][l] = d;
    lanes.b[4][l] = e;
    lanes.b[5][l] = g;
    const double J = lanes.J[l] * (bad ? 1.0 : determinant);
    lanes.J[l] = J < 0.05 ? 0.05 : J > 20.0 ? 20.0 : J;
    torn[l] = bad ? 1.0 : 0.0;
  }
  int sum = 0;
  for (int l = 0; l < count; ++l)
    sum += torn[l] > 0.5 ? 1 : 0;
  return sum;
}

// Deviators scaled, and the trace that gives the determinant 1: the largest root of t^3 - |dev|^2 t / 2 + det(dev) - 1.
void RelaxGelStrain(const double* scale, GelStrainLanes& lanes)
{
  ECHORAMA_INDEPENDENT
  for (int l = 0; l < GelLanes; ++l) {
    double third = (lanes.b[0][l] + lanes.b[1][l] + lanes.b[2][l]) * (1.0 / 3.0);
    const double a = scale[l] * (lanes.b[0][l] - third), b = scale[l] * (lanes.b[1][l] - third),
                 c = scale[l] * (lanes.b[2][l] - third);
    const double d = scale[l] * lanes.b[3][l], e = scale[l] * lanes.b[4][l], g = scale[l] * lanes.b[5][l];
    const double half = 0.5 * (a * a + b * b + c * c) + d * d + e * e + g * g;
    const double rest = a * (b * c - g * g) - d * (d * c - g * e) + e * (d * g - b * e) - 1.0;
    for (int round = 0; round < 5; ++round) {
      const double square = third * third;
      third -= ((square - half) * third + rest) / (3.0 * square - half);
    }
    lanes.b[0][l] = a + third;
    lanes.b[1][l] = b + third;
    lanes.b[2][l] = c + third;
    lanes.b[3][l] = d;
    lanes.b[4][l] = e;
    lanes.b[5][l] = g;
  }
}

} // namespace

ParameterList Describe(GelMaterial& p)
{
  return {
      Parameter("Density", p.density, {1, 20000}, "kg/m^3", "Mass of the gel per volume."),
      Parameter("ShearModulus", p.shearModulus, {0, 1e7, true}, "Pa", "How stiff the gel is below its yield stress."),
      Parameter("BulkModulus", p.bulkModulus, {1, 1e9}, "Pa",
                "How much the gel resists a change of its volume: some hundred times the pressures that occur. Steps become "
                "shorter with its root."),
      Parameter("YieldStress", p.yieldStress, {0, 1e6}, "Pa", "The stress in shear from which on the gel flows."),
      Parameter("Consistency", p.consistency, {0, 1e6}, "Pa s^n",
                "The stress above the yield stress at a rate of shear of 1/s; the viscosity of a fluid whose exponent is 1."),
      Parameter("Exponent", p.exponent, {0.1, 1}, "",
                "How that stress grows with the rate: below 1, gel thins as it is sheared."),
  };
}

GelLaw::GelLaw(const GelMaterial& material)
  : shear(material.shearModulus), bulk(material.bulkModulus), yield(material.yieldStress), consistency(material.consistency),
    exponent(material.exponent), density(material.density * 1e-6)
{
  CheckRanges(material);
}

double GelLaw::SoundSpeed() const
{
  return std::sqrt((bulk + 4.0 / 3.0 * shear) / density);
}

int AdvanceGelStrain(const GelLaw& law, double seconds, int count, GelStrainLanes& lanes)
{
  alignas(64) double stress[GelLanes], stiffness[GelLanes], scale[GelLanes];
  const int torn = MoveGelStrain(law.shear, seconds, count, lanes, stress, stiffness);
  bool flows = false;
  for (int l = 0; l < GelLanes; ++l) {
    stress[l] = l < count ? stress[l] : 0.0;
    flows = flows || stress[l] > law.yield;
  }
  if (flows)
    FindGelFlow(law, stress, stiffness, scale);
  if (flows)
    RelaxGelStrain(scale, lanes);
  return torn;
}

Eigen::Matrix3d GelStress(const GelLaw& law, const GelStrain& strain)
{
  const double* b = strain.b;
  Eigen::Matrix3d stress;
  stress << b[0], b[3], b[4], b[3], b[1], b[5], b[4], b[5], b[2];
  stress *= law.shear;
  const double mean = stress.trace() / 3.0;
  stress.diagonal().array() += 0.5 * law.bulk * (strain.J * strain.J - 1.0) - mean;
  return stress;
}

double GelShearStress(const GelLaw& law, const GelStrain& strain)
{
  const Eigen::Matrix3d stress = GelStress(law, strain);
  const Eigen::Matrix3d deviator = stress - stress.trace() / 3.0 * Eigen::Matrix3d::Identity();
  return deviator.norm() / std::sqrt(2.0);
}

} // namespace echorama
