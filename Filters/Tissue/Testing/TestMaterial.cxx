// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Tissue/Material.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <set>
#include <string>

using namespace echorama;

namespace {

template <class Function>
std::string MessageOf(const Function& function)
{
  try {
    function();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

} // namespace

TEST(Material, ImpedanceAndAttenuationOfKnownValues)
{
  EXPECT_NEAR(StandardMaterial("water").Impedance(), 1.48, 0.01); // MRayl
  EXPECT_NEAR(StandardMaterial("air").Impedance(), 0.0004, 0.00005);
  Material material;
  material.attenuation = 0.5;
  EXPECT_DOUBLE_EQ(material.AttenuationDbPerMm(1.0), 0.05);
  EXPECT_DOUBLE_EQ(material.AttenuationDbPerMm(4.0), 0.2);
  material.attenuationPower = 2.0;
  EXPECT_DOUBLE_EQ(material.AttenuationDbPerMm(4.0), 0.8);
  material.attenuationPower = 0.0;
  EXPECT_DOUBLE_EQ(material.AttenuationDbPerMm(4.0), 0.05);
}

TEST(Material, StandardMaterialsAreWithinTheirRangesAndHaveNames)
{
  std::set<std::string> names;
  for (const Material& material : StandardMaterials()) {
    EXPECT_NO_THROW(material.Check()) << material.name;
    EXPECT_TRUE(names.insert(material.name).second) << material.name;
    EXPECT_EQ(StandardMaterial(material.name).soundSpeed, material.soundSpeed);
    // What is clear has no scatterers, and the other way round.
    EXPECT_EQ(material.scattererDensity == 0.0, material.backscatterDb == Material::clearDb) << material.name;
  }
  EXPECT_EQ(StandardMaterial("liver").backscatterDb, 0.0); // the reference
}

TEST(Material, AnUnknownNameListsThoseThereAre)
{
  const std::string message = MessageOf([] { StandardMaterial("lever"); });
  EXPECT_NE(message.find("\"lever\""), std::string::npos) << message;
  EXPECT_NE(message.find("liver"), std::string::npos) << message;
  EXPECT_NE(MessageOf([] { StandardMaterial(""); }), "");
}

TEST(Material, EachNumberHasItsRange)
{
  const struct {
    double Material::*value;
    double least, most;
    const char* name;
  } ranges[] = {{&Material::soundSpeed, 100, 10000, "SoundSpeed is "},
                {&Material::density, 0.1, 20000, "Density is "},
                {&Material::attenuation, 0, 200, "Attenuation is "},
                {&Material::attenuationPower, 0, 2, "AttenuationPower is "},
                {&Material::scattererDensity, 0, 1000, "ScattererDensity is "},
                {&Material::backscatterDb, -120, 60, "BackscatterDb is "},
                {&Material::roughness, 0, 1, "Roughness is "},
                {&Material::scatterProbability, 0, 1, "ScatterProbability is "},
                {&Material::youngsModulusKPa, 0, 1e9, "YoungsModulusKPa is "}};
  for (const auto& range : ranges) {
    Material material;
    material.name = "jelly";
    for (const double good : {range.least, range.most}) {
      material.*range.value = good;
      EXPECT_NO_THROW(material.Check()) << range.name;
    }
    for (const double bad : {range.least - 0.01, range.most * 1.001 + 0.001, std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::infinity()}) {
      material.*range.value = bad;
      const std::string message = MessageOf([&material] { material.Check(); });
      EXPECT_NE(message.find("jelly"), std::string::npos) << range.name << " " << bad;
      EXPECT_NE(message.find(range.name), std::string::npos) << message;
    }
  }
}
