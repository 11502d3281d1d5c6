// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Tissue/TissueSurface.h"
#include <gtest/gtest.h>
#include <limits>
#include <string>

using namespace echorama;

namespace {

// One tetrahedron of a material.
TissueSurface Tetrahedron(const char* material, const char* background = "water")
{
  TissueSurface surface;
  surface.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  surface.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  surface.bodyOfTriangle = {0, 0, 0, 0};
  surface.MaterialIndex(StandardMaterial(background));
  surface.bodies = {{material, surface.MaterialIndex(StandardMaterial(material))}};
  return surface;
}

std::string MessageOf(const TissueSurface& surface)
{
  try {
    surface.Check();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()), "");
    return error.what();
  }
  return "";
}

} // namespace

TEST(TissueSurface, EqualMaterialsAreOne)
{
  TissueSurface surface;
  EXPECT_EQ(surface.MaterialIndex(StandardMaterial("water")), 0);
  EXPECT_EQ(surface.MaterialIndex(StandardMaterial("liver")), 1);
  EXPECT_EQ(surface.MaterialIndex(StandardMaterial("water")), 0);
  Material other = StandardMaterial("water"); // any number makes it another
  for (double Material::*value : {&Material::soundSpeed, &Material::density, &Material::attenuation, &Material::attenuationPower,
                                  &Material::scattererDensity, &Material::backscatterDb, &Material::roughness,
                                  &Material::scatterProbability, &Material::youngsModulusKPa}) {
    const int before = static_cast<int>(surface.materials.size());
    other.*value += 0.25;
    EXPECT_EQ(surface.MaterialIndex(other), before);
  }
  other.name = "other";
  EXPECT_EQ(surface.MaterialIndex(other), 11);
}

TEST(TissueSurface, AppendKeepsBodiesAndShiftsIndices)
{
  TissueSurface surface = Tetrahedron("liver");
  surface.Append(Tetrahedron("bone", "gel"));
  surface.Append(Tetrahedron("liver", "gel"));
  surface.Check();
  ASSERT_EQ(surface.bodies.size(), 3u);
  EXPECT_EQ(surface.triangles.size(), 12u);
  EXPECT_EQ(surface.points.size(), 12u);
  EXPECT_EQ(surface.triangles[11], (std::array<std::uint32_t, 3>{9, 10, 11}));
  EXPECT_EQ(surface.bodyOfTriangle[11], 2);
  ASSERT_EQ(surface.materials.size(), 3u); // the other's background stays away
  EXPECT_EQ(surface.materials[0].name, "water");
  EXPECT_EQ(surface.materials[2].name, "bone");
  EXPECT_EQ(surface.bodies[1].material, 2);
  EXPECT_EQ(surface.bodies[2].material, 1);
}

TEST(TissueSurface, OneBodyAloneHasItsPointsOnly)
{
  TissueSurface surface = Tetrahedron("liver");
  TissueSurface bone = Tetrahedron("bone");
  bone.points[3] = {0, 0, 5};
  surface.Append(bone);
  const TissueSurface only = surface.Only(1);
  only.Check();
  ASSERT_EQ(only.points.size(), 4u);
  ASSERT_EQ(only.triangles.size(), 4u);
  for (std::size_t n = 0; n < 4; ++n)
    for (std::size_t corner = 0; corner < 3; ++corner)
      EXPECT_EQ(only.points[only.triangles[n][corner]], surface.points[surface.triangles[n + 4][corner]]);
  EXPECT_EQ(only.bodies.front().name, "bone");
  EXPECT_EQ(only.materials.size(), surface.materials.size());
  EXPECT_TRUE(surface.Only(-1).triangles.empty());
}

TEST(TissueSurface, NothingButABackgroundIsSound)
{
  TissueSurface surface;
  surface.materials.push_back(StandardMaterial("water"));
  EXPECT_EQ(MessageOf(surface), "");
}

TEST(TissueSurface, CheckSaysWhatIsWrong)
{
  const auto expect = [](const char* words, const auto& spoil) {
    TissueSurface surface = Tetrahedron("liver");
    EXPECT_EQ(MessageOf(surface), "");
    spoil(surface);
    EXPECT_NE(MessageOf(surface).find(words), std::string::npos) << MessageOf(surface);
  };
  expect("no material", [](TissueSurface& s) { s.materials.clear(); });
  expect("SoundSpeed is -1 m/s", [](TissueSurface& s) { s.materials[1].soundSpeed = -1.0; });
  expect("body \"liver\"", [](TissueSurface& s) { s.bodies[0].material = 2; });
  expect("body \"liver\"", [](TissueSurface& s) { s.bodies[0].material = -1; });
  expect("names the body of 3", [](TissueSurface& s) { s.bodyOfTriangle.pop_back(); });
  expect("triangle (2) whose body (1)", [](TissueSurface& s) { s.bodyOfTriangle[2] = 1; });
  expect("triangle (1) whose body (-1)", [](TissueSurface& s) { s.bodyOfTriangle[1] = -1; });
  expect("triangle (3) with a corner (4)", [](TissueSurface& s) { s.triangles[3][1] = 4; });
  expect("point (2)", [](TissueSurface& s) { s.points[2].y() = std::numeric_limits<float>::infinity(); });
  expect("point (0)", [](TissueSurface& s) { s.points[0].x() = std::numeric_limits<float>::quiet_NaN(); });
}
