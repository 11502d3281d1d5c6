// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include <string>
#include <vector>

namespace echorama {

/// What a body is made of, as sound meets it.
struct Material {
  std::string name;
  double soundSpeed = 1540.0;
  double density = 1000.0;
  double attenuation = 0.5;
  double attenuationPower = 1.0;
  double scattererDensity = 100.0;
  double backscatterDb = 0.0;
  double roughness = 0.0;
  double scatterProbability = 0.02; ///< the parameter p of dissertation eq. 3.1
  double youngsModulusKPa = 10.0;   ///< for simulators of tissue under the probe

  /// Acoustic impedance: sound speed times density, MRayl.
  double Impedance() const { return 1e-6 * soundSpeed * density; }
  /// Whether it is so light that sound and pressure do not get into it.
  bool IsGas() const { return density < 100.0; }
  /// dB/mm, one way, at a frequency.
  double AttenuationDbPerMm(double frequencyMHz) const;

  /// Throws Error(InvalidParameter) that names the material and the number that is out of its range.
  void Check() const;

  static constexpr double clearDb = -120.0; ///< backscatter of clear fluid: none
};

/// All but the name.
ParameterList Describe(Material& m);

/// Materials of the body and of the laboratory, by name: water, gel, fat, skin, muscle, liver, kidney, spleen, blood,
/// vessel wall, capsule, lesion-dark, lesion-bright, cyst, bone, stone, air, steel, nylon ...
/// Speeds, densities and attenuations after the tables of Duck, Physical Properties of Tissue (1990), and of Szabo, Diagnostic
/// Ultrasound Imaging (2nd ed. 2014, appendix B); backscatter and scatterers are chosen for the look of a scan.
const std::vector<Material>& StandardMaterials();

/// The standard material of that name.
/// \throws Error(InvalidParameter) that lists the names there are.
const Material& StandardMaterial(const std::string& name);

} // namespace echorama
