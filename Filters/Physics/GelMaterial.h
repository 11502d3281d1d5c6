// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include <Eigen/Core>

namespace echorama {

/// Ultrasound gel: an elastic solid below its yield stress, a shear-thinning fluid above it (Herschel-Bulkley). In simple
/// shear at the rate r it flows at the stress yieldStress + consistency r^exponent. A Newtonian fluid has no yield stress and
/// the exponent 1. The defaults are of the order of what is published for carbomer gels.
struct GelMaterial {
  double density = 1000.0;     ///< kg/m^3
  double shearModulus = 400.0; ///< Pa
  /// Pa. Far below water's, or steps would be nanoseconds: some hundred times the pressures that occur.
  double bulkModulus = 60000.0;
  double yieldStress = 60.0; ///< Pa, in shear
  double consistency = 30.0; ///< Pa s^exponent
  double exponent = 0.4;
};
ParameterList Describe(GelMaterial& p);

/// The state of the elastic strain: J, the volume over that at rest, and b, the left Cauchy-Green strain of determinant 1
/// (xx, yy, zz, xy, xz, yz).
struct GelStrain {
  double b[6] = {1, 1, 1, 0, 0, 0};
  double J = 1.0;
};

/// A material as the kernels take it. The unit of stress is g/(mm s^2), which is 1 Pa.
struct GelLaw {
  explicit GelLaw(const GelMaterial& material);
  double shear, bulk, yield, consistency, exponent;
  double density;            ///< g/mm^3
  double SoundSpeed() const; ///< mm/s, of pressure waves
};

/// How many particles the return mapping takes at a time.
constexpr int GelLanes = 8;

/// The strains of up to GelLanes particles, one lane each, and their velocity gradients: C[3 * row + column], 1/s.
struct alignas(64) GelStrainLanes {
  double b[6][GelLanes];
  double J[GelLanes];
  double C[9][GelLanes];
};

/// Advances all lanes by \a seconds: what the velocity gradient adds to the elastic strain, and then what flow takes from it,
/// implicitly, so that no viscosity limits the step. \returns how many of the first \a count were torn or turned inside out by
/// the step and begin anew without shear.
int AdvanceGelStrain(const GelLaw& law, double seconds, int count, GelStrainLanes& lanes);

/// Kirchhoff stress, Pa: symmetric.
Eigen::Matrix3d GelStress(const GelLaw& law, const GelStrain& strain);

/// The stress in shear, Pa, that is compared with the yield stress: |dev| / sqrt(2).
double GelShearStress(const GelLaw& law, const GelStrain& strain);

} // namespace echorama
