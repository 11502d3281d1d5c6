// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <string>
#include <vector>

namespace echorama {

/// What a body is made of, as sound meets it.
struct Material {
  std::string name;
  double soundSpeed = 1540.0;    ///< m/s, in [100, 10000]
  double density = 1000.0;       ///< kg/m^3, in [0.1, 20000]
  double attenuation = 0.5;      ///< dB/cm at 1 MHz, one way, in [0, 200]
  double attenuationPower = 1.0; ///< exponent of the frequency (MHz), in [0, 2]
  /// Point scatterers per mm^3, in [0, 1000]; 0: clear. Of so many no scanner sees single ones; a synthesis may make fewer, as
  /// loud together.
  double scattererDensity = 100.0;
  /// Power that a volume of it scatters back, dB beside the reference tissue (liver: 0), in [-120, 60]. It does not change with
  /// the number of scatterers.
  double backscatterDb = 0.0;
  /// How rough its surface is, in [0, 1]: 0 mirrors, 1 sends sound every way alike (Lambert). Where two materials meet, the
  /// rougher counts.
  double roughness = 0.0;
  /// Probability that sound scatters within a mm, in [0, 1]: the parameter p of dissertation eq. 3.1, for its counting of random
  /// scatter events alone.
  double scatterProbability = 0.02;
  double youngsModulusKPa = 10.0; ///< stiffness, for simulators of tissue under the probe, in [0, 1e9]

  /// Acoustic impedance: sound speed times density, MRayl.
  double Impedance() const { return 1e-6 * soundSpeed * density; }
  /// dB/mm, one way, at a frequency.
  double AttenuationDbPerMm(double frequencyMHz) const;

  /// Throws Error(InvalidParameter) that names the material and the number that is out of its range or not finite.
  void Check() const;

  static constexpr double clearDb = -120.0; ///< backscatter of clear fluid: none
};

/// Materials of the body and of the laboratory, by name: water, gel, fat, skin, muscle, liver, kidney, spleen, blood,
/// vessel wall, capsule, lesion-dark, lesion-bright, cyst, bone, stone, air, steel, nylon ...
/// Speeds, densities and attenuations after the tables of Duck, Physical Properties of Tissue (1990), and of Szabo, Diagnostic
/// Ultrasound Imaging (2nd ed. 2014, appendix B); backscatter and scatterers are chosen for the look of a scan.
const std::vector<Material>& StandardMaterials();

/// The standard material of that name.
/// \throws Error(InvalidParameter) that lists the names there are.
const Material& StandardMaterial(const std::string& name);

} // namespace echorama
