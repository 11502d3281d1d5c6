// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/TextFile.h"
#include "Filters/Scenes/SynthesisScene.h"
#include <cmath>
#include <filesystem>
#include <gtest/gtest.h>

using namespace echorama;
using Eigen::Vector3d;

namespace {

constexpr double degree = 0.017453292519943295;

SynthesisScene Parse(const std::string& members)
{
  return SceneFromJson(R"({"schema": "echorama-scene-1")" + (members.empty() ? "" : ", " + members) + "}", "scene.json");
}

// The complaint about a scene of these members; empty when there is none.
std::string Complaint(const std::string& members)
{
  try {
    Parse(members);
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::BadFile);
    return error.what();
  }
  return {};
}

void ExpectComplaint(const std::string& members, const std::string& message)
{
  const std::string complaint = Complaint(members);
  EXPECT_EQ(complaint.substr(0, message.size()), message) << "of " << members << ": " << complaint;
}

std::string Tissue(const std::string& item)
{
  return R"("tissue": [)" + item + "]";
}

} // namespace

TEST(SynthesisScene, HasDefaults)
{
  const SynthesisScene scene = Parse("");
  EXPECT_EQ(scene.seed, 1u);
  EXPECT_EQ(scene.background, "water");
  EXPECT_TRUE(scene.tissue.empty());
  EXPECT_EQ(std::get<SceneRow>(scene.views).count, 3);
  const ProbePreset probe = scene.probe.Resolve();
  EXPECT_EQ(probe.elements, ProbePresetOf("mechanical-3d").elements);
  EXPECT_EQ(probe.probe.fanWidth, ProbePresetOf("mechanical-3d").probe.fanWidth);
}

TEST(SynthesisScene, ReadsEveryKindOfTissue)
{
  const SynthesisScene scene = Parse(R"(
    "materials": {"tumour": {"like": "lesion-dark", "density": 1080}, "edge": {"like": "tumour", "backscatterDb": 3}},
    "tissue": [{"name": "organ", "mesh": {"file": "meshes/a.glb", "unit": "m", "axes": "y-up", "material": "liver"}},
               {"sphere": {"centre": [1, 2, 3], "radius": 4.5, "material": "tumour"}},
               {"box": {"size": [10, 20, 30], "rotationDegrees": [0, 0, 90], "material": "edge"}},
               {"cylinder": {"from": [0, 0, 10], "to": [0, 0, 90], "radius": 2, "material": "blood"}}])");
  ASSERT_EQ(scene.tissue.size(), 4u);
  const auto& mesh = std::get<SceneMesh>(scene.tissue[0].what);
  EXPECT_EQ(scene.tissue[0].name, "organ");
  // Metres, y up and z to the front: a metre up is 1000 mm towards the head, a metre to the front 1000 mm against y.
  EXPECT_TRUE((mesh.ToWorld() * Vector3d(1, 2, 3)).isApprox(Vector3d(1000, -3000, 2000)));
  EXPECT_TRUE(std::get<SceneSphere>(scene.tissue[1].what).centre.isApprox(Vector3d(1, 2, 3)));
  EXPECT_EQ(std::get<SceneBox>(scene.tissue[2].what).size.z(), 30.0);
  EXPECT_EQ(std::get<SceneCylinder>(scene.tissue[3].what).to.z(), 90.0);
  const Material& edge = scene.MaterialOf("edge");
  EXPECT_EQ(edge.name, "edge");
  EXPECT_EQ(edge.density, 1080.0);
  EXPECT_EQ(edge.backscatterDb, 3.0);
  EXPECT_EQ(edge.soundSpeed, StandardMaterial("lesion-dark").soundSpeed);
}

TEST(SynthesisScene, ReadsPackedSpheres)
{
  const SynthesisScene scene = Parse(R"("seed": 7, "materials": {"pale": {"like": "liver"}}, "background": "gel", "tissue": [
    {"packing": {"method": "empty-space", "region": "ball", "boxMin": [-9, -9, 0], "boxMax": [9, 9, 18], "radii": "power-law",
                 "exponent": 2.5, "radiusMin": 0.5, "radiusMax": 3, "fillFraction": 0.2, "count": 50, "misses": 100,
                 "materials": {"pale": 1, "cyst": 0.5}, "cellMm": 0.7, "deviation": 0.5, "trueVolume": true}},
    {"packing": {"seed": 9}}])");
  const auto& packing = std::get<ScenePacking>(scene.tissue[0].what);
  const PackedTissueParameters parameters = scene.ParametersOf(packing);
  EXPECT_EQ(parameters.packing.method, SpherePackingParameters::Method::EmptySpace);
  EXPECT_EQ(parameters.packing.region, SpherePackingParameters::Region::Ball);
  EXPECT_EQ(parameters.packing.radii, SpherePackingParameters::Radii::PowerLaw);
  EXPECT_EQ(parameters.packing.seed, 7u); // the scene's
  EXPECT_EQ(parameters.packing.count, 50);
  EXPECT_EQ(parameters.background.name, "gel");
  ASSERT_EQ(parameters.materials.size(), 2u);
  EXPECT_EQ(parameters.materials[0].material.name, "pale");
  EXPECT_EQ(parameters.materials[1].weight, 0.5);
  EXPECT_EQ(parameters.cell.mm, 0.7);
  EXPECT_TRUE(parameters.trueVolume);
  EXPECT_NO_THROW(parameters.Check());
  EXPECT_EQ(std::get<ScenePacking>(scene.tissue[1].what).tissue.packing.seed, 9u);

  ExpectComplaint(Tissue(R"({"packing": {"materials": {"lver": 1}}})"),
                  "scene.json: tissue[0].packing.materials: there is no material \"lver\"");
  ExpectComplaint(Tissue(R"({"packing": {"materials": {"liver": -1}}})"),
                  "scene.json: tissue[0].packing.materials.liver: -1 is out of range");
  ExpectComplaint(Tissue(R"({"packing": {"materials": {}}})"), "scene.json: tissue[0].packing: no material has a weight above 0");
  ExpectComplaint(Tissue(R"({"packing": {"fillFraction": 1.5}})"),
                  "scene.json: tissue[0].packing.fillFraction: 1.5 is out of range; it must be in [0, 1]");
  ExpectComplaint(Tissue(R"({"packing": {"boxMax": [-60, 50, 100]}})"),
                  "scene.json: tissue[0].packing: the packing's box has no volume");
}

TEST(SynthesisScene, ReadsAnatomies)
{
  const SynthesisScene scene = Parse(R"("seed": 3, "tissue": [{"anatomy": {"fatMm": 20, "ribs": 3, "spine": false}}])");
  const auto& anatomy = std::get<AnatomyParameters>(scene.tissue[0].what);
  EXPECT_EQ(anatomy.seed, 3u);
  EXPECT_EQ(anatomy.fatMm, 20.0);
  EXPECT_EQ(anatomy.ribs, 3);
  EXPECT_FALSE(anatomy.spine);
  ExpectComplaint(Tissue(R"({"anatomy": {"ribs": 2.5}})"), "scene.json: tissue[0].anatomy.ribs: a whole number is needed");
  ExpectComplaint(Tissue(R"({"anatomy": {"fatMm": 1e4}})"),
                  "scene.json: tissue[0].anatomy.fatMm: 10000.0 is out of range; it must be in [");
  ExpectComplaint(Tissue(R"({"anatomy": {"spine": 1}})"), "scene.json: tissue[0].anatomy.spine: true or false is needed, not 1");
}

TEST(SynthesisScene, ReadsTheScanner)
{
  const SynthesisScene scene = Parse(R"("probe": {"preset": "linear"}, "transducer": {"bandwidth": 0.5},
    "receiver": {"tgcDbPerCm": 0, "tgcPoints": [{"depthMm": 0, "gainDb": 1}, {"depthMm": 50, "gainDb": 9}], "noiseDb": -30})");
  EXPECT_EQ(scene.transducer.frequencyMHz, ProbePresetOf("linear").transducer.frequencyMHz); // the preset's
  EXPECT_EQ(scene.transducer.bandwidth, 0.5);
  EXPECT_EQ(scene.receiver.tgcPoints.size(), 2u);
  EXPECT_EQ(scene.receiver.GainDbAt(25.0), 5.0);
  EXPECT_EQ(scene.receiver.noiseDb, -30.0);
  ExpectComplaint(R"("transducer": {"frequencyMHz": 200})",
                  "scene.json: transducer.frequencyMHz: 200 is out of range; it must be in [0.5, 60]");
  ExpectComplaint(R"("receiver": {"tgcDbPerCm": 0, "tgcPoints": [{"depthMm": 5}, {"depthMm": 5}]})", "scene.json: receiver: ");
}

TEST(SynthesisScene, ReadsTheTransport)
{
  const SynthesisScene scene = Parse(R"("seed": 5, "transducer": {"assumedSoundSpeed": 1500}, "transport": {"mode": "counting",
    "maxBounces": 2, "refraction": false, "subRays": 16, "sampling": "sobol", "faceRadiusMm": 7,
    "counting": {"clarity": 0, "raysPerElement": 9, "sampling": "random"}}, "probe": {"elements": 33, "sweepSteps": 22})");
  const SynthesisParameters parameters = scene.Parameters();
  EXPECT_NO_THROW(parameters.Check());
  EXPECT_EQ(parameters.mode, SynthesisParameters::Mode::Counting);
  EXPECT_EQ(parameters.transport.maxBounces, 2);
  EXPECT_EQ(parameters.transport.faceRadius, 7.0);
  EXPECT_FALSE(parameters.transport.refraction);
  EXPECT_EQ(parameters.subRays, 16);
  EXPECT_EQ(parameters.sampling, Sampling::Sobol);
  EXPECT_EQ(parameters.counting.clarity, 0.0);
  EXPECT_EQ(parameters.counting.sampling, Sampling::Random);
  EXPECT_EQ(parameters.counting.assumedSoundSpeed, 1500.0);
  EXPECT_EQ(parameters.counting.seed, 5u);
  EXPECT_EQ(parameters.seed, 5u);
  EXPECT_EQ(parameters.BeamDimensions()[1], 33);
  EXPECT_EQ(parameters.BeamDimensions()[2], 22);
  ExpectComplaint(R"("transport": {"mode": "magic"})",
                  "scene.json: transport.mode: \"magic\" is not known; there are \"coherent\", \"counting\"");
  ExpectComplaint(R"("transport": {"counting": {"clarity": 201}})",
                  "scene.json: transport.counting.clarity: 201 is out of range; it must be in [0, 200]");
}

TEST(SynthesisScene, ReadsRigs)
{
  const SynthesisScene scene =
      Parse(Tissue(R"({"rig": {"waterCelsius": 30, "balls": [{"name": "a", "centre": [0, 0, -30], "radius": 5}]}})"));
  const auto& rig = std::get<CalibrationRigParameters>(scene.tissue[0].what);
  EXPECT_EQ(rig.waterCelsius, 30.0);
  ASSERT_EQ(rig.balls.size(), 1u);
  EXPECT_EQ(rig.balls[0].name, "a");
  EXPECT_EQ(std::get<CalibrationRigParameters>(Parse(Tissue(R"({"rig": {}})")).tissue[0].what).balls.size(), 7u);
  ExpectComplaint(Tissue(R"({"rig": {"waterCelsius": 100}})"),
                  "scene.json: tissue[0].rig.waterCelsius: 100 is out of range; it must be in [0, 95]");
  ExpectComplaint(Tissue(R"({"rig": {"balls": [{"radius": 50}]}})"),
                  "scene.json: tissue[0].rig.balls[0].radius: 50 is out of range");
  ExpectComplaint(Tissue(R"({"rig": {"material": "cheese"}})"), "scene.json: tissue[0].rig: ");
}

TEST(SynthesisScene, PlacesMeshes)
{
  const auto meshOf = [](const std::string& transform) {
    const SynthesisScene scene =
        Parse(Tissue(R"({"mesh": {"file": "a.ply", "material": "liver", "transform": )" + transform + "}}"));
    return std::get<SceneMesh>(scene.tissue[0].what).ToWorld();
  };
  EXPECT_TRUE((meshOf(R"({"translation": [1, 2, 3], "rotationDegrees": [0, 0, 90], "scale": 2})") * Vector3d(1, 0, 0))
                  .isApprox(Vector3d(1, 4, 3)));
  EXPECT_TRUE(
      (meshOf("[[0, -2, 0, 1], [2, 0, 0, 2], [0, 0, 2, 3], [0, 0, 0, 1]]") * Vector3d(1, 0, 0)).isApprox(Vector3d(1, 4, 3)));
}

TEST(SynthesisScene, ChangesThePresetOfTheProbe)
{
  const auto probeOf = [](const std::string& members) { return Parse("\"probe\": {" + members + "}").probe.Resolve(); };
  const ProbePreset standard = ProbePresetOf("mechanical-3d");
  const ProbeGeometry narrower = probeOf(R"("fanAngleDegrees": 35)").probe;
  EXPECT_NEAR(narrower.fanAngle, 35 * degree, 1e-15);
  EXPECT_NEAR(narrower.fanWidth, 0.5 * standard.probe.fanWidth, 1e-12); // the radius stays
  EXPECT_NEAR(probeOf(R"("fanRadiusMm": 80)").probe.fanWidth, 2.0 * standard.probe.fanWidth, 1e-12);
  EXPECT_EQ(probeOf(R"("fanWidthMm": 33)").probe.fanWidth, 33.0);
  EXPECT_EQ(probeOf(R"("preset": "linear", "sweepSteps": 64, "sweepWidthMm": 40)").probe.sweepWidth, 40.0);
  const ProbePreset plane = probeOf(R"("sweepSteps": 1)");
  EXPECT_TRUE(plane.probe.IsPlane());
  EXPECT_EQ(plane.probe.fanWidth, standard.probe.fanWidth);
  EXPECT_EQ(probeOf(R"("elements": 64, "samples": 100)").elements, 64);

  ExpectComplaint(R"("probe": {"preset": "linear", "sweepSteps": 64})", "scene.json: probe: sweepSteps is 64, but");
  ExpectComplaint(R"("probe": {"preset": "linear", "sweepAngleDegrees": 40})",
                  "scene.json: probe: the preset is of a single plane");
  ExpectComplaint(R"("probe": {"fanRadiusMm": 10, "fanWidthMm": 10})",
                  "scene.json: probe: fanRadiusMm and fanWidthMm say the same");
  ExpectComplaint(R"("probe": {"depthMinMm": 200})", "scene.json: probe: probe geometry: the depths go from 200");
  ExpectComplaint(R"("probe": {"preset": "curvy"})",
                  "scene.json: probe.preset: \"curvy\" is not known; there are \"curvilinear\"");
}

TEST(SynthesisScene, ReadsViews)
{
  const SynthesisScene poses = Parse(R"("views": {"poses": [
    [[0, -1, 0, 5], [1, 0, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]], {"face": [0, 0, 10], "target": [0, 30, 10], "fan": [1, 1, 0]}]})");
  const auto& views = std::get<SceneViews>(poses.views).poses;
  ASSERT_EQ(views.size(), 2u);
  EXPECT_TRUE((views[0].ProbeToWorld() * Vector3d(1, 0, 0)).isApprox(Vector3d(5, 7, 7)));
  const Pose second = views[1].ProbeToWorld();
  EXPECT_TRUE(IsRotation(second.linear(), 1e-12));
  EXPECT_TRUE((second * Vector3d(0, 0, 30)).isApprox(Vector3d(0, 30, 10)));
  EXPECT_TRUE((second.linear() * Vector3d::UnitX()).isApprox(Vector3d::UnitX()));

  const SynthesisScene recorded = Parse(
      R"("views": {"recording": {"file": "a.igs.mha", "smoothSeconds": 0.2, "count": 7}}, "sweep": {"alongRecording": true})");
  EXPECT_EQ(std::get<SceneRecording>(recorded.views).count, 7);
  EXPECT_TRUE(recorded.sweep.alongRecording);

  ExpectComplaint(R"("sweep": {"alongRecording": true})",
                  "scene.json: sweep.alongRecording: the views are neither those of a recording nor of keys");
  ExpectComplaint(R"("views": {"count": 0})", "scene.json: views.count: 0 is out of range; it must be in [1, 1000]");
  ExpectComplaint(R"("views": {"count": 2.5})", "scene.json: views.count: a whole number is needed, not 2.5");
  ExpectComplaint(R"("views": {"poses": []})", "scene.json: views.poses: a list");
  ExpectComplaint(R"("views": {"poses": [[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]]]})",
                  "scene.json: views.poses[0]: the matrix is not rigid");
  ExpectComplaint(R"("views": {"poses": [[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1]]]})",
                  "scene.json: views.poses[0]: 4 rows of 4 numbers");
  ExpectComplaint(R"("views": {"poses": [{"face": [0, 0, 0], "target": [0, 0, 0]}]})",
                  "scene.json: views.poses[0]: face and target are the same point");
  ExpectComplaint(R"("views": {"poses": [{"fan": [0, 0, 1]}]})", "scene.json: views.poses[0]: the fan lies along the beam");
  ExpectComplaint(R"("views": {"poses": [{}], "count": 3})", "scene.json: views.count: there is no such key; there are poses");
  ExpectComplaint(R"("views": {"recording": {"file": "a", "trackerToWorld": {"scale": 2}}})",
                  "scene.json: views.recording: trackerToWorld is not rigid");
}

TEST(SynthesisScene, MovesTheProbeDuringTheSweep)
{
  SceneSweep sweep;
  sweep.seconds = 2.0;
  sweep.velocityMmPerSecond = {10, 0, 0};
  sweep.turnDegreesPerSecond = {0, 0, 90};
  Pose middle = Pose::Identity();
  middle.translation() = Vector3d(5, 0, 0);
  EXPECT_LT(Log(middle.inverse() * sweep.ProbeToWorldAt(middle, 0.0)).norm(), 1e-12);
  EXPECT_TRUE((sweep.ProbeToWorldAt(middle, 1.0) * Vector3d(1, 0, 0)).isApprox(Vector3d(15, 1, 0)));
}

TEST(SynthesisScene, SaysWhichKeyIsWrong)
{
  ExpectComplaint(Tissue(R"({"mesh": {"file": "a", "material": "liver"}}, {"sphere": {"material": "water"}},
                            {"mesh": {"file": "b", "material": "lver"}})"),
                  "scene.json: tissue[2].mesh.material: there is no material \"lver\"; there are water, gel, ");
  ExpectComplaint(Tissue(R"({"mesh": {"file": "a"}})"), "scene.json: tissue[0].mesh: \"material\" is missing");
  ExpectComplaint(Tissue(R"({"mesh": {"material": "liver"}})"), "scene.json: tissue[0].mesh: \"file\" is missing");
  ExpectComplaint(Tissue(R"({"mesh": {"file": 3, "material": "liver"}})"),
                  "scene.json: tissue[0].mesh.file: a text is needed, not 3");
  ExpectComplaint(Tissue(R"({"mesh": {"file": "a", "material": "liver", "unit": "cm"}})"),
                  "scene.json: tissue[0].mesh.unit: \"cm\" is not known; there are \"mm\", \"m\"");
  ExpectComplaint(Tissue(R"({"mesh": {"file": "a", "material": "liver", "transform": {"scale": 0}}})"),
                  "scene.json: tissue[0].mesh.transform.scale: 0 is out of range; it must be in [1e-06, 1000000]");
  ExpectComplaint(
      Tissue(
          R"({"mesh": {"file": "a", "material": "liver", "transform": [[-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}})"),
      "scene.json: tissue[0].mesh.transform: the matrix mirrors or flattens");
  ExpectComplaint(Tissue(R"({"name": "x"})"), "scene.json: tissue[0]: one of ");
  ExpectComplaint(Tissue(R"({"sphere": {"material": "liver"}, "box": {"material": "liver"}})"),
                  "scene.json: tissue[0]: just one of ");
  ExpectComplaint(Tissue(R"({"sphere": {"material": "liver", "radius": 0}})"),
                  "scene.json: tissue[0].sphere.radius: 0 is out of range; it must be in (0, 10000]");
  ExpectComplaint(Tissue(R"({"sphere": {"material": "liver", "centre": [0, 1]}})"),
                  "scene.json: tissue[0].sphere.centre: a list of 3 numbers is needed");
  ExpectComplaint(Tissue(R"({"sphere": {"material": "liver", "centre": [0, 1, "a"]}})"),
                  "scene.json: tissue[0].sphere.centre[2]: a number is needed, not \"a\"");
  ExpectComplaint(Tissue(R"({"cylinder": {"material": "liver", "from": [0, 0, 1], "to": [0, 0, 1]}})"),
                  "scene.json: tissue[0].cylinder: from and to are the same point");
  ExpectComplaint(Tissue(R"({"sphere": {"material": "liver", "colour": "red"}})"),
                  "scene.json: tissue[0].sphere.colour: there is no such key; there are centre, radius, material");
  ExpectComplaint(Tissue("3"), "scene.json: tissue[0]: an object is needed, not 3");
  ExpectComplaint(R"("tissue": {})", "scene.json: tissue: a list");
  ExpectComplaint(R"("background": "aether")", "scene.json: background: there is no material \"aether\"");
  ExpectComplaint(R"("seed": -1)", "scene.json: seed: a whole number in [0, 2^63) is needed, not -1");
  ExpectComplaint(R"("seed": 1.5)", "scene.json: seed: a whole number");
  ExpectComplaint(R"("materials": {"x": {"soundSpeed": 99}})",
                  "scene.json: materials.x.soundSpeed: 99 is out of range; it must be in [100, 10000]");
  ExpectComplaint(R"("materials": {"x": {"like": "y"}})", "scene.json: materials.x.like: there is no material \"y\"");
  ExpectComplaint(R"("materials": {"": {}})", "scene.json: materials: the name of a material");
  ExpectComplaint(R"("volume": {"spacingMm": 1e9})",
                  "scene.json: volume.spacingMm: 1000000000.0 is out of range; it must be in [0.05, 20]");
  ExpectComplaint(R"("press": {"poisson": 0.5})", "scene.json: press.poisson: 0.5 is out of range; it must be in [0, 0.499]");
  ExpectComplaint(R"("background": "air", "gel": {"cellMm": 0})",
                  "scene.json: gel.cellMm: 0 is out of range; it must be in [0.1, 20]");
  ExpectComplaint(R"("background": "water", "gel": {})", "scene.json: background: around gel there is air, not \"water\"");
  ExpectComplaint(R"("sede": 3)", "scene.json: sede: there is no such key; there are schema, name, ");
  ExpectComplaint(R"("seed": 1, "seed": 2)", "scene.json: the key \"seed\" is there twice");
  ExpectComplaint(R"("seed": )", "scene.json: it is not JSON");
  ExpectComplaint(R"("volume": {"spacingMm": 1e999})", "scene.json: it is not JSON");
  ExpectComplaint(R"("name": )" + std::string(100, '[') + std::string(100, ']'),
                  "scene.json: its lists are nested more than 32 deep");
  for (const char* text : {"", "[]", "3", "{}", R"({"schema": "echorama-scene-2"})", R"({"schema": 1})"})
    EXPECT_THROW(SceneFromJson(text, "x"), Error) << text;
}

TEST(SynthesisScene, ComesBackBitByBit)
{
  SynthesisScene scene;
  scene.name = "all of it";
  scene.about = "with \"quotes\" and \xc3\xa4";
  scene.seed = 9223372036854775807u;
  scene.probe = {"linear", 1.0 / 3.0, {}, 38.1, 0.1 + 0.2, {}, std::nextafter(40.0, 41.0), -1e-7, 50.0, 77, 9, 1001};
  scene.materials.push_back(StandardMaterial("liver"));
  scene.materials[0].name = "odd";
  scene.materials[0].density = std::nextafter(1060.0, 1061.0);
  scene.background = "odd";
  SceneMesh mesh;
  mesh.file = "a b.glb";
  mesh.unit = SceneMesh::Unit::Metres;
  mesh.axes = SceneMesh::Axes::YUp;
  mesh.transform.rotationDegrees = {0.1, 1e-300, -7.0 / 3.0};
  scene.tissue.push_back({"first", mesh});
  mesh.transform.rows = Eigen::Matrix4d::Identity() * (1.0 / 3.0);
  (*mesh.transform.rows)(3, 3) = 1.0;
  scene.tissue.push_back({"", mesh});
  scene.tissue.push_back({"", SceneSphere{{0.1, 0.2, 0.3}, 1.0 / 7.0, "odd"}});
  scene.tissue.push_back({"", SceneBox{}});
  scene.tissue.push_back({"", SceneCylinder{}});
  ScenePacking packing;
  packing.tissue.packing.seed = 1ull << 62;
  packing.tissue.packing.radiusMin = 0.1 + 0.2;
  packing.tissue.packing.radii = SpherePackingParameters::Radii::PowerLaw;
  packing.materials = {{"odd", 1.0 / 3.0}, {"cyst", 1e-9}};
  scene.tissue.push_back({"balls", packing});
  AnatomyParameters anatomy;
  anatomy.fatMm = 12.3456789012345678;
  anatomy.trunkDepthMm = 200.0;
  anatomy.ribs = 1;
  anatomy.liver = false;
  scene.tissue.push_back({"", anatomy});
  CalibrationRigParameters rig;
  rig.balls[0].centre.x() += 1.0 / 3.0;
  scene.tissue.push_back({"", rig});
  scene.echoes.transport.acceptanceDegrees = 5.0 / 3.0;
  scene.echoes.counting.coneDegrees = 0.1 + 0.2;
  scene.transducer.bandwidth = 1.0 / 3.0;
  scene.receiver.tgcPoints = {{0.1, 0.2}, {1.0 / 3.0, 4.0}};
  SceneRecording recording;
  recording.file = "r.mha";
  recording.smoothSeconds = 0.1 + 0.7;
  scene.views = recording;
  scene.sweep = {1.0 / 3.0, {0.1, 0.2, 0.3}, {1, 2, 3}, true};
  scene.press.emplace();
  scene.press->lattice.heldMaterials = ""; // none, which is not the default
  scene.press->tissue.friction = 1.0 / 3.0;
  scene.press->head.edgeMm = 0.1 + 0.2;
  scene.background = "air";
  scene.gel.emplace();
  scene.gel->coat.amountMl = 1.0 / 3.0;
  scene.gel->material.exponent = 0.3 + 0.4;
  scene.volume = {0.7, 0.1, 179.99999999999997};
  const std::string text = SceneToJson(scene);
  const SynthesisScene back = SceneFromJson(text, "back");
  EXPECT_EQ(SceneToJson(back), text);
  EXPECT_EQ(back.seed, scene.seed);
  EXPECT_EQ(back.about, scene.about);
  EXPECT_EQ(back.probe.fanAngleDegrees, scene.probe.fanAngleDegrees);
  EXPECT_EQ(back.probe.sweepWidthMm, scene.probe.sweepWidthMm);
  EXPECT_FALSE(back.probe.fanRadiusMm.has_value());
  EXPECT_EQ(back.MaterialOf("odd").density, scene.materials[0].density);
  EXPECT_EQ(std::get<SceneMesh>(back.tissue[0].what).transform.rotationDegrees,
            std::get<SceneMesh>(scene.tissue[0].what).transform.rotationDegrees);
  EXPECT_EQ(*std::get<SceneMesh>(back.tissue[1].what).transform.rows, *mesh.transform.rows);
  EXPECT_EQ(std::get<SceneSphere>(back.tissue[2].what).radius, 1.0 / 7.0);
  EXPECT_EQ(std::get<ScenePacking>(back.tissue[5].what).tissue.packing.radiusMin, packing.tissue.packing.radiusMin);
  EXPECT_EQ(std::get<ScenePacking>(back.tissue[5].what).materials[0].weight, 1.0 / 3.0);
  EXPECT_EQ(std::get<AnatomyParameters>(back.tissue[6].what).fatMm, anatomy.fatMm);
  EXPECT_EQ(std::get<CalibrationRigParameters>(back.tissue[7].what).balls[0].centre, rig.balls[0].centre);
  EXPECT_EQ(back.echoes.transport.acceptanceDegrees, scene.echoes.transport.acceptanceDegrees);
  EXPECT_EQ(back.echoes.counting.coneDegrees, scene.echoes.counting.coneDegrees);
  EXPECT_EQ(back.transducer.bandwidth, scene.transducer.bandwidth);
  EXPECT_EQ(back.receiver.tgcPoints[1].depthMm, scene.receiver.tgcPoints[1].depthMm);
  EXPECT_EQ(std::get<SceneRecording>(back.views).smoothSeconds, recording.smoothSeconds);
  ASSERT_TRUE(back.press.has_value());
  EXPECT_EQ(back.press->lattice.heldMaterials, "");
  EXPECT_EQ(back.press->tissue.friction, scene.press->tissue.friction);
  EXPECT_EQ(back.press->head.edgeMm, scene.press->head.edgeMm);
  ASSERT_TRUE(back.gel.has_value());
  EXPECT_EQ(back.gel->coat.amountMl, scene.gel->coat.amountMl);
  EXPECT_EQ(back.gel->material.exponent, scene.gel->material.exponent);
  EXPECT_EQ(back.volume.knockDegrees, scene.volume.knockDegrees);
  // Views of other kinds.
  scene.sweep.alongRecording = false;
  SceneViews views;
  views.poses.resize(2);
  views.poses[0].rows = Eigen::Matrix4d::Identity();
  scene.views = views;
  EXPECT_EQ(SceneToJson(SceneFromJson(SceneToJson(scene), "back")), SceneToJson(scene));
  scene.views = SceneRow{};
  EXPECT_EQ(SceneToJson(SceneFromJson(SceneToJson(scene), "back")), SceneToJson(scene));
}

TEST(SynthesisScene, ChecksWhatWasNotRead)
{
  SynthesisScene scene;
  EXPECT_NO_THROW(scene.Check());
  scene.volume.spacingMm = std::nan("");
  try {
    scene.Check("this scene");
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "this scene: volume.spacingMm: a number is needed, not null");
  }
  EXPECT_THROW(SceneToJson(scene), Error);
  scene.volume.spacingMm = 1.0;
  scene.materials = {StandardMaterial("liver"), StandardMaterial("liver")};
  EXPECT_THROW(scene.Check(), Error);
  scene.materials.clear();
  scene.probe.preset = "none";
  EXPECT_THROW(scene.Check(), Error);
}

TEST(SynthesisScene, FindsFilesFromItsFolder)
{
  SynthesisScene scene;
  EXPECT_EQ(scene.PathOf("a/b.ply"), "a/b.ply");
  scene.folder = "/data/scenes";
  EXPECT_EQ(scene.PathOf("../meshes/b.ply"), "/data/meshes/b.ply");
  EXPECT_EQ(scene.PathOf("/b.ply"), "/b.ply");
  scene.dataFolder = "/elsewhere";
  EXPECT_EQ(scene.PathOf("../meshes/b.ply"), "/elsewhere/b.ply");
}
TEST(SynthesisScene, ExamplesAreSoundAndTheirSchemaIsOurs)
{
  const std::filesystem::path folder = std::filesystem::path(ECHORAMA_SOURCE_DIR) / "Examples/scenes";
  int scenes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name == "echorama-scene-1.schema.json")
      EXPECT_EQ(ReadTextFile(entry.path().string()), SceneSchema()) << "the schema file is not that of the reader";
    else if (entry.path().extension() == ".json") {
      SCOPED_TRACE(name);
      EXPECT_NO_THROW(ReadScene(entry.path().string()));
      ++scenes;
    }
  }
  EXPECT_GE(scenes, 4);
}
