// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Geometry/ProbePresets.h"
#include "Filters/Live/LiveScene.h"
#include "Filters/Tissue/Icosphere.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

using namespace echorama;
using Eigen::Vector3d;

namespace {

// A ball of blood in liver, below air that begins at z = 0.
TissueSurface Body()
{
  TissueSurface surface;
  surface.materials = {StandardMaterial("air")};
  const auto add = [&](const Material& material, const Vector3d& centre, const Vector3d& radii) {
    surface.bodies.push_back({"", surface.MaterialIndex(material)});
    const Icosphere sphere = Icosphere::Make(4);
    const auto first = static_cast<std::uint32_t>(surface.points.size());
    for (const Vector3d& point : sphere.points)
      surface.points.push_back((centre + radii.cwiseProduct(point)).cast<float>());
    for (const auto& [a, b, c] : sphere.triangles) {
      surface.triangles.push_back({first + a, first + b, first + c});
      surface.bodyOfTriangle.push_back(static_cast<std::int32_t>(surface.bodies.size()) - 1);
    }
  };
  add(StandardMaterial("liver"), Vector3d(0, 0, 80), Vector3d(80, 80, 80));
  add(StandardMaterial("blood"), Vector3d(0, 0, 40), Vector3d(8, 8, 8));
  return surface;
}

LiveImageParameters Small()
{
  LiveImageParameters p;
  p.probe.kind = LiveProbe::Convex;
  p.probe.depthMm = 80.0;
  p.beams = 48;
  p.samples = 200;
  return p;
}

double Mean(const Volume<float>& beams, int beam, double from, double to)
{
  const auto* row = beams.View().Row(beam, 0);
  const auto first = static_cast<int>(from / 80.0 * 199.0), last = static_cast<int>(to / 80.0 * 199.0);
  double sum = 0.0;
  for (int i = first; i < last; ++i)
    sum += row[i];
  return sum / (last - first);
}

} // namespace

// The drawn picture fills a thin gap with gel; the acoustic model has none, and what it shows is black.
TEST(LiveScene, GelFillsThinGapsOfTheDrawnPictureAlone)
{
  LiveScene scene(Body());
  const LiveImageParameters p = Small();
  Pose pose = Pose::Identity();
  pose.translation().z() = -0.5;
  LiveSceneParameters how;
  scene.MakeBeams(SceneSettings(p, pose), how);
  EXPECT_GT(scene.ContactShare(), 0.0);
  how.source = LiveSource::Acoustic;
  const Volume<float> beams = scene.MakeBeams(SceneSettings(p, pose), how);
  EXPECT_EQ(scene.ContactShare(), 0.0);
  EXPECT_LT(Mean(beams, 24, 10.0, 20.0), 20.0);
}

TEST(LiveScene, ShowsTheSameByBothModels)
{
  LiveScene scene(Body());
  LiveImageParameters p = Small();
  Pose pose = Pose::Identity();
  pose.translation().z() = 8.0; // pressed in
  // The fan is wider than what is pressed in: its outermost elements hang in air.
  const SynthesisParameters settings = SceneSettings(p, pose);
  int inContact = 0;
  for (int element = 0; element < p.beams; ++element)
    inContact += (AxisOf(settings, element, 0).origin - Vector3d(0, 0, 80)).norm() < 80.0;
  EXPECT_GT(inContact, 20);
  EXPECT_LT(inContact, 40);
  LiveSceneParameters how;
  how.look.darkeningDb = how.look.gelMm = 0.0;
  for (const auto source : {LiveSource::Scene, LiveSource::Acoustic}) {
    how.source = source;
    const Volume<float> beams = scene.MakeBeams(SceneSettings(p, pose), how);
    EXPECT_EQ(beams.Dimensions(), (std::array<int, 3>{200, 48, 1}));
    EXPECT_NEAR(Mean(beams, 24, 5.0, 20.0), 110.0, 20.0);
    EXPECT_LT(Mean(beams, 24, 27.0, 37.0), 50.0);
    EXPECT_NEAR(Mean(beams, 24, 45.0, 75.0), 110.0, 25.0);       // the gain makes up for attenuation
    EXPECT_NEAR(scene.ContactShare() * p.beams, inContact, 2.0); // facets
    EXPECT_EQ(scene.SeenShare(), 1.0);
  }
}

TEST(LiveScene, TellsOfContactLost)
{
  LiveScene scene(Body());
  const LiveImageParameters p = Small();
  Pose pose = Pose::Identity();
  pose.translation() = Vector3d(0.0, 0.0, -20.0);
  LiveSceneParameters how;
  for (const auto source : {LiveSource::Scene, LiveSource::Acoustic}) {
    how.source = source;
    const Volume<float> beams = scene.MakeBeams(SceneSettings(p, pose), how);
    EXPECT_EQ(scene.ContactShare(), 0.0);
    EXPECT_GT(scene.SeenShare(), 0.5); // it still looks at the body
    EXPECT_LT(Mean(beams, 24, 40.0, 80.0), 1.0);
  }
}

TEST(LiveScene, SettingsAreThoseOfTheMachine)
{
  LiveImageParameters p = Small();
  p.controls.gainDb = 3.0;
  p.controls.frequencyMHz = 5.0;
  p.controls.attenuation = 0.4;
  p.controls.dynamicRangeDb = 50.0;
  p.controls.tgcDb[7] = 6.0;
  p.controls.noiseDb = -40.0;
  p.thickness.focusMm = 33.0;
  SynthesisParameters s = SceneSettings(p, Pose::Identity());
  EXPECT_NO_THROW(s.Check());
  EXPECT_EQ(s.transducer.frequencyMHz, 5.0);
  EXPECT_EQ(s.transducer.lateralFocusMm, 33.0);
  EXPECT_EQ(s.receiver.dynamicRangeDb, 50.0);
  EXPECT_NEAR(s.receiver.GainDbAt(0.0), 3.0, 1e-9);
  EXPECT_NEAR(s.receiver.GainDbAt(80.0), 3.0 + 2.0 * 0.4 * 5.0 * 8.0 + 6.0, 1e-9);
  EXPECT_NEAR(s.receiver.noiseDb, -40.0 + 145.0 * 50.0 / 255.0, 1e-9); // beside liver, not white
  p.controls.noiseMoves = true;
  EXPECT_NE(SceneSettings(p, Pose::Identity(), 1).receiver.noiseSeed, SceneSettings(p, Pose::Identity(), 2).receiver.noiseSeed);
  for (const auto kind : {LiveProbe::Linear, LiveProbe::Phased, LiveProbe::Endocavity, LiveProbe::Radial}) {
    p.probe.kind = kind;
    EXPECT_NO_THROW(SceneSettings(p, Pose::Identity()).Check());
  }
}

TEST(LiveScene, WithoutAFrequencyItIsThatOfTheProbe)
{
  LiveImageParameters p = Small();
  EXPECT_EQ(SceneSettings(p, Pose::Identity()).transducer.frequencyMHz, ProbePresetOf("curvilinear").transducer.frequencyMHz);
  p.probe.kind = LiveProbe::Radial;
  EXPECT_EQ(SceneSettings(p, Pose::Identity()).transducer.frequencyMHz, 20.0);
  EXPECT_NEAR(SceneSettings(p, Pose::Identity()).receiver.tgcDbPerCm, 2.0 * 0.5 * 20.0, 1e-12); // and gain for it
  p.controls.frequencyMHz = 60.0;
  EXPECT_NO_THROW(SceneSettings(p, Pose::Identity()).Check());
  EXPECT_EQ(SceneSettings(p, Pose::Identity()).transducer.frequencyMHz, 60.0);
  p.controls.frequencyMHz = 0.1;
  EXPECT_THROW(SceneSettings(p, Pose::Identity()), Error);
}

TEST(LiveScene, HasTheThicknessOfTheImage)
{
  LiveImageParameters p = Small();
  const SliceThickness scene = SceneThickness(p);
  const BeamThickness image = ThicknessOf(p);
  for (const double depth : {0.0, 40.0, 90.0})
    EXPECT_NEAR(std::hypot(scene.waistMm, scene.spread * (depth - scene.focusMm)), image.SigmaMm(depth), 1e-9);
  p.thickness.thicknessMm = 0.0;
  EXPECT_EQ(SceneThickness(p).waistMm, 0.0);
}

TEST(LiveScene, ParametersHaveNamesOfTheirOwn)
{
  LiveSceneParameters scene;
  LiveImageParameters image;
  std::vector<std::string> names;
  for (const Parameter& parameter : Join({Describe(scene), Describe(image)}))
    names.push_back(parameter.name);
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::adjacent_find(names.begin(), names.end()), names.end());
  scene.refinement = 4;
  EXPECT_THROW(LiveScene(Body()).MakeBeams(SceneSettings(image, Pose::Identity()), scene), Error);
}

TEST(LiveImage, TakesBeamsFromElsewhere)
{
  LiveImage image;
  image.Set(Small());
  Volume<float> beams({200, 48, 1}, 77.4f);
  image.SetBeams(beams);
  EXPECT_EQ(image.RealShare(), 1.0);
  Volume<unsigned char> grey({640, 480, 1}), valid({640, 480, 1});
  image.MakePixels(grey.View(), valid.View(), {});
  std::ptrdiff_t count = 0;
  for (std::ptrdiff_t i = 0; i < grey.View().Size(); ++i) {
    count += valid.View()[i];
    ASSERT_EQ(grey.View()[i], valid.View()[i] ? 77 : 0);
  }
  EXPECT_GT(count, 50000);
  EXPECT_THROW(image.SetBeams(Volume<float>({200, 47, 1})), Error);
}

// Bone and its like are hard, whatever they are called, and so are plastics; soft tissue and air are not.
TEST(LiveScene, TellsWhereNoProbeCanBe)
{
  TissueSurface body = Body();
  const LiveScene soft(body);
  for (const Vector3d& at : {Vector3d(0, 0, -5), Vector3d(0, 0, 5), Vector3d(0, 0, 40)})
    EXPECT_EQ(soft.HardMaterialAt(at), nullptr) << at.transpose();
  for (const char* hard : {"bone", "stone", "steel", "plastic"}) {
    Material material = StandardMaterial(hard);
    material.name = "thing";
    body.materials[static_cast<std::size_t>(body.bodies.back().material)] = material;
    const LiveScene scene(body);
    ASSERT_NE(scene.HardMaterialAt({0, 0, 40}), nullptr) << hard;
    EXPECT_EQ(scene.HardMaterialAt({0, 0, 40})->name, "thing");
    EXPECT_EQ(scene.HardMaterialAt({0, 0, 20}), nullptr);
  }
  for (const char* other : {"vessel-wall", "skin", "blood", "air"}) {
    body.materials[static_cast<std::size_t>(body.bodies.back().material)] = StandardMaterial(other);
    EXPECT_EQ(LiveScene(body).HardMaterialAt({0, 0, 40}), nullptr) << other;
  }
}

TEST(LiveScene, ANeedleStopsAtBoneAndGoesThroughSoftTissue)
{
  TissueSurface surface = Body();
  surface.bodies.back().material = surface.MaterialIndex(StandardMaterial("bone")); // the ball: 32 mm to 48 mm below the skin
  const LiveScene scene(surface), soft(Body());
  const NeedleAdvance advance = AdvanceTip({0, 0, -5}, {0, 0, 60}, scene.Hard());
  EXPECT_TRUE(advance.stopped);
  EXPECT_NEAR(advance.freeMm, 37.0, 0.1);
  EXPECT_FALSE(AdvanceTip({12, 0, -5}, {12, 0, 60}, scene.Hard()).stopped);
  EXPECT_FALSE(AdvanceTip({0, 0, -5}, {0, 0, 60}, soft.Hard()).stopped);
}
