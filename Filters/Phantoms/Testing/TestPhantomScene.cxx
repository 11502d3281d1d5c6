// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Phantoms/Phantom.h"
#include "Filters/Phantoms/PhantomScene.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;
using Eigen::Vector3d;

namespace {

std::string MessageOf(const std::string& text)
{
  try {
    PhantomFromJson(text);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

} // namespace

TEST(PhantomScene, DistancesOfSimpleShapes)
{
  const Ellipsoid ball{{1, 2, 3}, {4, 4, 4}, {0.3, 0.2, 0.1}};
  EXPECT_NEAR(SignedDistance(ball, {1, 2, 10}), 3.0, 1e-12);
  EXPECT_NEAR(SignedDistance(ball, {3, 2, 3}), -2.0, 1e-12);
  EXPECT_LT(SignedDistance(ball, {1, 2, 3}), 0.0);
  // Turned by 90 degrees about z: its long axis x lies along y.
  const Ellipsoid turned{{0, 0, 0}, {8, 2, 2}, {0, 0, 1.5707963267948966}};
  EXPECT_NEAR(SignedDistance(turned, {0, 8, 0}), 0.0, 1e-12);
  EXPECT_NEAR(SignedDistance(turned, {2, 0, 0}), 0.0, 1e-12);
  const Ellipsoid leaning{{0, 0, 0}, {8, 2, 2}, {0, 0, 0.5}};
  EXPECT_NEAR(SignedDistance(leaning, {8 * std::cos(0.5), 8 * std::sin(0.5), 0}), 0.0, 1e-9);
  EXPECT_GT(SignedDistance(leaning, {8 * std::cos(0.5), -8 * std::sin(0.5), 0}), 1.0);
  PhantomScene scene;
  scene.inclusions.push_back({"leaning", leaning, 5.0, 0.0, 0.0, 0.0});
  EXPECT_EQ(SceneLookup(scene).EchogenicityAt({7 * std::cos(0.5), 7 * std::sin(0.5), 0}), 5.0);
  EXPECT_EQ(SceneLookup(scene).EchogenicityAt({7 * std::cos(0.5), -7 * std::sin(0.5), 0}), 0.0);
  const Tube tube{{{0, 0, 0}, {10, 0, 0}, {10, 10, 0}}, 2.0};
  EXPECT_NEAR(SignedDistance(tube, {5, -3, 0}), 1.0, 1e-12);
  EXPECT_NEAR(SignedDistance(tube, {10, 5, 1}), -1.0, 1e-12);
  EXPECT_NEAR(SignedDistance(tube, {-5, 0, 0}), 3.0, 1e-12);
}

TEST(PhantomScene, LaterBodiesCountAndWallsLieWithin)
{
  PhantomScene scene;
  scene.inclusions.push_back({"large", Ellipsoid{{0, 0, 0}, {10, 10, 10}, {0, 0, 0}}, 5.0, 1.0, 12.0, 0.0});
  scene.inclusions.push_back({"small", Ellipsoid{{4, 0, 0}, {2, 2, 2}, {0, 0, 0}}, -20.0, 0.0, 0.0, 0.0});
  const SceneLookup lookup(scene);
  EXPECT_EQ(lookup.EchogenicityAt({20, 0, 0}), 0.0);
  EXPECT_EQ(lookup.EchogenicityAt({-5, 0, 0}), 5.0);
  EXPECT_EQ(lookup.EchogenicityAt({-9.5, 0, 0}), 12.0);
  EXPECT_EQ(lookup.EchogenicityAt({4, 1, 0}), -20.0);
  EXPECT_NEAR(lookup.AmplitudeAt({4, 1, 0}), 0.1, 1e-12);
  EXPECT_EQ(lookup.AmplitudeAt({0, 0, 20}), 1.0);
}

TEST(PhantomScene, LookupAgreesWithTheDistances)
{
  // The look-up's boxes and matrices against the plain definition, for turned bodies and curved vessels.
  const PhantomScene scene = DefaultScene();
  scene.Check();
  const SceneLookup lookup(scene);
  int inside = 0;
  for (double z = 0; z < 110; z += 3.7)
    for (double y = -60; y < 60; y += 3.1)
      for (double x = -100; x < 100; x += 3.3) {
        double expected = 0.0;
        for (const Inclusion& inclusion : scene.inclusions) {
          const double d = std::visit([&](const auto& shape) { return SignedDistance(shape, {x, y, z}); }, inclusion.shape);
          if (d < 0.0)
            expected = d > -inclusion.wallMm ? inclusion.wallDb : inclusion.echogenicityDb;
        }
        inside += expected != 0.0 ? 1 : 0;
        ASSERT_EQ(lookup.EchogenicityAt({x, y, z}), expected);
      }
  EXPECT_GT(inside, 1000);
}

TEST(PhantomScene, ComesBackFromJsonBitByBit)
{
  const PhantomScene scene = DefaultScene();
  const std::string text = PhantomToJson(scene);
  EXPECT_EQ(PhantomToJson(PhantomFromJson(text)), text);
  PhantomParameters parameters;
  parameters.gainDb = 3.25;
  const std::string description = DescribePhantom(parameters);
  EXPECT_EQ(PhantomToJson(PhantomFromJson(description)), text);
  EXPECT_NE(description.find("\"gainDb\":3.25"), std::string::npos);
}

TEST(PhantomScene, BadTextIsRefusedWithItsPlace)
{
  const auto with = [](const std::string& inclusion) {
    return MessageOf(R"({"schema":"echorama-phantom-1","inclusions":[)" + inclusion + "]}");
  };
  EXPECT_EQ(with(R"({"ellipsoid":{"centre":[0,0,0],"radii":[1,1,1]}})"), "");
  EXPECT_NE(MessageOf("").find("JSON"), std::string::npos);
  EXPECT_NE(MessageOf("[1,2").find("JSON"), std::string::npos);
  EXPECT_NE(MessageOf("{}").find("schema"), std::string::npos);
  EXPECT_NE(MessageOf(R"({"schema":"other","inclusions":[]})").find("schema"), std::string::npos);
  EXPECT_NE(MessageOf(R"({"schema":"echorama-phantom-1"})").find("inclusions"), std::string::npos);
  EXPECT_EQ(with("3"), "phantom scene: inclusions[0]: an object is needed, not 3");
  EXPECT_NE(with("{}").find("one of ellipsoid, tube is needed"), std::string::npos);
  EXPECT_NE(with(R"({"ellipsoid":[]})").find("object"), std::string::npos);
  EXPECT_NE(with(R"({"ellipsoid":{"centre":[0,0],"radii":[1,1,1]}})").find("centre"), std::string::npos);
  EXPECT_NE(with(R"({"ellipsoid":{"centre":[0,0,"x"],"radii":[1,1,1]}})").find("centre"), std::string::npos);
  EXPECT_NE(
      with(R"({"ellipsoid":{"centre":[0,0,0],"radii":[1,0,1]}})").find("inclusions[0].ellipsoid.radii[1]: 0 is out of range"),
      std::string::npos);
  EXPECT_NE(with(R"({"ellipsoid":{"centre":[0,0,0],"radii":[1,1,1]},"echogenicityDb":99})").find("[-120, 60]"),
            std::string::npos);
  EXPECT_NE(with(R"({"tube":{"path":[[0,0,0]],"radius":1}})").find("two points"), std::string::npos);
  EXPECT_NE(with(R"({"tube":{"path":[[0,0,0],[1,0,0]],"radius":-1}})").find("inclusions[0].tube.radius: -1 is out of range"),
            std::string::npos);
  EXPECT_NE(with(R"({"ellipsoid":{"centre":[0,0,0],"radii":[1,1,1]},"wallmm":1})").find("wallmm: there is no such key"),
            std::string::npos);
  EXPECT_NE(with(R"({"name":"rod","tube":{"path":[[0,0,0],[1,0,0]],"radius":1},"attenuationDbPerMm":2})").find("rod"),
            std::string::npos);
}
