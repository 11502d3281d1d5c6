// SPDX-License-Identifier: BSD-3-Clause
#include "Material.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <cmath>

namespace echorama {

double Material::AttenuationDbPerMm(double frequencyMHz) const
{
  return 0.1 * attenuation * std::pow(frequencyMHz, attenuationPower);
}

void Material::Check() const
{
  CheckRanges(*this, "material \"" + name + "\"");
}

ParameterList Describe(Material& m)
{
  return {
      Parameter("SoundSpeed", m.soundSpeed, {100, 10000}, "m/s", "Speed of sound."),
      Parameter("Density", m.density, {0.1, 20000}, "kg/m^3", "Mass per volume; times the speed of sound it is the impedance."),
      Parameter("Attenuation", m.attenuation, {0, 200}, "dB/cm", "Attenuation at 1 MHz, one way."),
      Parameter("AttenuationPower", m.attenuationPower, {0, 2}, "", "Exponent of the frequency in the attenuation."),
      Parameter(
          "ScattererDensity", m.scattererDensity, {0, 1000}, "per mm^3",
          "Point scatterers; 0: clear. No scanner resolves so many, and a synthesis may make fewer that are as loud together."),
      Parameter("BackscatterDb", m.backscatterDb, {Material::clearDb, 60}, "dB",
                "Power that a volume of it scatters back, beside liver. It does not change with the number of scatterers."),
      Parameter("Roughness", m.roughness, {0, 1}, "",
                "Of its surface: 0 mirrors, 1 sends sound every way alike. Where two materials meet, the rougher counts."),
      Parameter("ScatterProbability", m.scatterProbability, {0, 1}, "per mm",
                "Probability that sound scatters, when random scatter events are counted."),
      Parameter("YoungsModulusKPa", m.youngsModulusKPa, {0, 1e9}, "kPa", "Stiffness."),
  };
}

const std::vector<Material>& StandardMaterials()
{
  // name, m/s, kg/m^3, dB/cm/MHz^n, n, scatterers/mm^3, dB, roughness, p, kPa
  static const std::vector<Material> materials{
      {"water", 1482.0, 998.0, 0.0022, 2.0, 0.0, Material::clearDb, 0.0, 0.0, 0.0},
      {"gel", 1500.0, 1020.0, 0.05, 1.0, 0.0, Material::clearDb, 0.0, 0.0, 0.5},
      {"tissue", 1540.0, 1050.0, 0.5, 1.0, 100.0, -3.0, 0.2, 0.02, 10.0},
      {"skin", 1615.0, 1100.0, 1.8, 1.0, 100.0, 8.0, 0.3, 0.05, 100.0},
      {"fat", 1450.0, 950.0, 0.6, 1.0, 100.0, -6.0, 0.3, 0.02, 3.0},
      {"muscle", 1580.0, 1065.0, 0.7, 1.1, 100.0, -4.0, 0.3, 0.02, 15.0},
      {"liver", 1570.0, 1060.0, 0.5, 1.05, 100.0, 0.0, 0.2, 0.02, 5.0},
      {"kidney", 1560.0, 1050.0, 0.6, 1.1, 100.0, -4.0, 0.2, 0.02, 8.0},
      {"spleen", 1567.0, 1054.0, 0.4, 1.3, 100.0, -1.0, 0.2, 0.02, 15.0},
      {"pancreas", 1580.0, 1045.0, 0.6, 1.0, 100.0, 3.0, 0.3, 0.03, 5.0},
      {"uterus", 1630.0, 1050.0, 0.8, 1.0, 100.0, -4.0, 0.2, 0.02, 20.0},
      {"blood", 1575.0, 1055.0, 0.18, 1.2, 100.0, -32.0, 0.0, 0.001, 0.0},
      {"vessel-wall", 1600.0, 1100.0, 1.0, 1.0, 100.0, 8.0, 0.3, 0.05, 300.0},
      {"capsule", 1620.0, 1100.0, 1.0, 1.0, 100.0, 9.0, 0.3, 0.05, 200.0},
      {"lesion-dark", 1550.0, 1050.0, 0.6, 1.0, 100.0, -10.0, 0.2, 0.01, 30.0},
      {"lesion-bright", 1580.0, 1070.0, 0.7, 1.0, 100.0, 7.0, 0.3, 0.05, 20.0},
      {"cyst", 1520.0, 1010.0, 0.02, 1.5, 0.0, Material::clearDb, 0.0, 0.0, 0.0},
      {"bone", 3500.0, 1900.0, 7.0, 1.0, 100.0, 6.0, 0.6, 0.5, 1e7},
      {"stone", 3200.0, 2000.0, 9.0, 1.0, 100.0, 6.0, 0.6, 0.5, 1e7},
      {"air", 343.0, 1.2, 1.6, 2.0, 0.0, Material::clearDb, 0.4, 0.0, 0.0},
      {"steel", 5900.0, 7800.0, 0.02, 1.0, 0.0, Material::clearDb, 0.1, 0.0, 2e8},
      {"nylon", 2620.0, 1120.0, 2.5, 1.0, 0.0, Material::clearDb, 0.1, 0.1, 3e6},
      {"plastic", 2500.0, 1050.0, 2.0, 1.0, 0.0, Material::clearDb, 0.2, 0.1, 3e6},
  };
  return materials;
}

const Material& StandardMaterial(const std::string& name)
{
  const std::vector<Material>& all = StandardMaterials();
  const auto found = std::find_if(all.begin(), all.end(), [&name](const Material& material) { return material.name == name; });
  if (found != all.end())
    return *found;
  std::string names;
  for (const Material& material : all)
    names += (names.empty() ? "" : ", ") + material.name;
  throw Error(Error::Kind::InvalidParameter, "there is no standard material \"" + name + "\"; there are " + names);
}

} // namespace echorama
