// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Scenes/SceneRun.h"
#include "Testing/Sanitized.h"
#include <gtest/gtest.h>
#include <numeric>

using namespace echorama;
using Eigen::Vector3d;

namespace {

SynthesisScene Parse(const std::string& members)
{
  // What the members say themselves comes in the place of these.
  std::string head = R"("schema": "echorama-scene-1", "receiver": {"noiseDb": -200})";
  if (members.find("\"background\": \"") == std::string::npos)
    head += R"(, "background": "tissue")";
  if (members.find("\"preset\"") == std::string::npos)
    head += R"(, "probe": {"elements": 24, "sweepSteps": 8, "samples": 120, "depthMinMm": 2, "depthMaxMm": 50})";
  return SceneFromJson("{" + head + ", " + members + "}", "scene.json");
}

TriangleSurface NoMesh(const std::string& path)
{
  throw Error(Error::Kind::FileSystem, path + ": not in this test");
}

// No test here looks at gel.
TissueSurface NoSurface(const GelCoat&, const Material& gel, const Material& air)
{
  TissueSurface none;
  none.materials = {air, gel};
  return none;
}

SceneRun RunOf(const std::string& members, int landmarks = 0)
{
  return SceneRun(Parse(members), landmarks, NoMesh, NoSurface);
}

std::vector<std::string> NamesOf(const TissueSurface& tissue)
{
  std::vector<std::string> names;
  for (const TissueSurface::Body& body : tissue.bodies)
    names.push_back(body.name);
  return names;
}

double MeanOf(VolumeView<const unsigned char> beams, int firstElement, int lastElement, int firstSample)
{
  double sum = 0.0, count = 0.0;
  for (int k = 0; k < beams.Dimensions()[2]; ++k)
    for (int j = firstElement; j <= lastElement; ++j)
      for (int i = firstSample; i < beams.Dimensions()[0]; ++i) {
        sum += beams.Row(j, k)[i];
        count += 1.0;
      }
  return sum / count;
}

const std::string still =
    R"("views": {"poses": [{"face": [0, 0, 0], "target": [0, 0, 50]}, {"face": [0, 0, 0], "target": [0, 0, 50]},
                                        {"face": [0, 0, 0], "target": [0, 0, 50]}]})";

} // namespace

TEST(SceneRun, BodiesComeAndGo)
{
  const std::string tissue = R"("tissue": [{"name": "organ", "sphere": {"centre": [0, 0, 25], "radius": 20, "material": "liver"}},
    {"name": "jet", "firstView": 2, "lastView": 2, "sphere": {"centre": [0, 0, 25], "radius": 8, "material": "cyst"}},
    {"name": "late", "firstView": 3, "sphere": {"centre": [0, 0, 40], "radius": 3, "material": "stone"}}], )";
  SceneRun run = RunOf(tissue + still);
  EXPECT_EQ(NamesOf(run.Tissue()), (std::vector<std::string>{"organ", "jet", "late"}));
  const SceneScan first = run.Make(0), second = run.Make(1), third = run.Make(2);
  EXPECT_EQ(NamesOf(first.tissue), (std::vector<std::string>{"organ"}));
  EXPECT_EQ(NamesOf(second.tissue), (std::vector<std::string>{"organ", "jet"}));
  EXPECT_EQ(NamesOf(third.tissue), (std::vector<std::string>{"organ", "late"}));
  // A cyst is dark in the middle, where the organ is bright before and after.
  const auto middle = [](const SceneScan& scan) {
    double sum = 0.0;
    for (int i = 50; i < 64; ++i) // 22 to 28 mm
      sum += scan.beams.View().Row(12, 4)[i];
    return sum / 14.0;
  };
  EXPECT_LT(middle(second), 0.2 * middle(first));
  EXPECT_NEAR(middle(third), middle(first), 1e-9);
}

TEST(SceneRun, ViewsOfOneBodyAreTheSameButForWhatSetsThemApart)
{
  const std::string tissue = R"("tissue": [{"sphere": {"centre": [0, 0, 25], "radius": 12, "material": "liver"}}], )";
  SceneRun same = RunOf(tissue + still);
  const SceneScan a = same.Make(0), b = same.Make(1);
  EXPECT_TRUE(std::equal(a.beams.View().begin(), a.beams.View().end(), b.beams.View().begin()));

  SceneRun gained = RunOf(R"("change": {"gainDb": 6}, )" + tissue + still);
  const SceneScan quiet = gained.Make(0), loud = gained.Make(1), third = gained.Make(2);
  EXPECT_TRUE(std::equal(a.beams.View().begin(), a.beams.View().end(), quiet.beams.View().begin()));
  EXPECT_TRUE(std::equal(a.beams.View().begin(), a.beams.View().end(), third.beams.View().begin()));
  EXPECT_NEAR(MeanOf(loud.beams.View(), 0, 23, 20) - MeanOf(quiet.beams.View(), 0, 23, 20), 6.0 * 255.0 / 60.0, 2.0);

  // What has changed correlates less the more it has; the grey of tissue stays what it is.
  const auto correlation = [](const SceneScan& one, const SceneScan& other) {
    const double m = MeanOf(one.beams.View(), 0, 23, 20), n = MeanOf(other.beams.View(), 0, 23, 20);
    double ab = 0.0, aa = 0.0, bb = 0.0;
    for (int k = 0; k < 8; ++k)
      for (int j = 0; j < 24; ++j)
        for (int i = 20; i < 120; ++i) {
          const double x = one.beams.View().Row(j, k)[i] - m, y = other.beams.View().Row(j, k)[i] - n;
          ab += x * y;
          aa += x * x;
          bb += y * y;
        }
    return ab / std::sqrt(aa * bb);
  };
  SceneRun changed = RunOf(R"("change": {"decorrelation": 0.3}, )" + tissue + still);
  const SceneScan one = changed.Make(0), two = changed.Make(1), again = changed.Make(0);
  EXPECT_TRUE(std::equal(one.beams.View().begin(), one.beams.View().end(), again.beams.View().begin()));
  EXPECT_GT(correlation(one, two), 0.2);
  EXPECT_LT(correlation(one, two), 0.75);
  EXPECT_NEAR(MeanOf(one.beams.View(), 0, 23, 20), MeanOf(a.beams.View(), 0, 23, 20), 2.0);
}

TEST(SceneRun, ARibShadowsItsShareOfTheFanInAllViewsButTheFirst)
{
  SceneRun run = RunOf(R"("change": {"ribShare": 0.5}, )" + still);
  const SceneScan open = run.Make(0), shadowed = run.Make(1);
  EXPECT_TRUE(open.tissue.bodies.empty());
  EXPECT_EQ(NamesOf(shadowed.tissue), (std::vector<std::string>{"rib"}));
  // Its middle lies at 0.15 of the fan, on the +x side: it takes the beams 9 to 20, but at its edges only a part of the aperture.
  // Where the beams 15 and 16 meet it squarely, sound goes to and fro between it and the face.
  for (const int first : {13, 17})
    EXPECT_LT(MeanOf(shadowed.beams.View(), first, first + 1, 60), 0.1 * MeanOf(open.beams.View(), first, first + 1, 60));
  EXPECT_NEAR(MeanOf(shadowed.beams.View(), 0, 4, 60), MeanOf(open.beams.View(), 0, 4, 60), 3.0);
}

TEST(SceneRun, ThePhantomIsABodyToo)
{
  SceneRun run = RunOf(R"("tissue": [{"phantom": {"inclusions": [
      {"name": "cyst", "ellipsoid": {"centre": [1, 2, 25], "radii": [6, 5, 4], "rotation": [0, 0, 1.5707963267948966]},
       "echogenicityDb": -120, "wallMm": 1, "wallDb": 9},
      {"name": "vessel", "tube": {"path": [[-20, 0, 12], [0, 1, 12], [20, 0, 13]], "radius": 2}, "echogenicityDb": -20}]}},
    {"phantom": {"bodies": "jets"}, "firstView": 2}], )" +
                       still);
  const TissueSurface tissue = run.Make(0).tissue;
  EXPECT_EQ(NamesOf(tissue), (std::vector<std::string>{"cyst", "cyst", "vessel"}));
  const auto box = [&tissue](int body) {
    Eigen::AlignedBox3d around;
    const TissueSurface only = tissue.Only(body);
    for (const Eigen::Vector3f& point : only.points)
      around.extend(point.cast<double>());
    return around;
  };
  EXPECT_TRUE(box(0).sizes().isApprox(Vector3d(10, 12, 8), 0.02)) << box(0).sizes().transpose(); // turned by a right angle
  EXPECT_TRUE(box(1).sizes().isApprox(Vector3d(8, 10, 6), 0.02));
  EXPECT_TRUE(box(0).center().isApprox(Vector3d(1, 2, 25), 1e-3));
  const auto material = [&tissue](int body) {
    return tissue.materials[static_cast<std::size_t>(tissue.bodies[static_cast<std::size_t>(body)].material)];
  };
  const double background = StandardMaterial("tissue").backscatterDb;
  EXPECT_EQ(material(0).backscatterDb, background + 9.0);
  EXPECT_EQ(material(1).backscatterDb, Material::clearDb);
  EXPECT_EQ(material(2).backscatterDb, background - 20.0);
  EXPECT_EQ(run.Make(1).tissue.bodies.size(), 3u + Jets().size());
  // Without a list it is the phantom's own body.
  SceneRun whole = RunOf(R"("tissue": [{"phantom": {}}], )" + still);
  std::size_t walls = 0;
  for (const Inclusion& inclusion : DefaultScene().inclusions)
    walls += inclusion.wallMm > 0.0 ? 1 : 0;
  EXPECT_EQ(whole.Tissue().bodies.size(), DefaultScene().inclusions.size() + walls);
}

TEST(SceneRun, PressedBodiesThatComeAndGoMoveWithTheTissue)
{
  // The probe's face lies 5 mm within the block; a body that is there in the second view alone is not felt, but moves.
  SceneRun run = RunOf(R"("background": "air", "press": {"spacingMm": 6}, "tissue": [
      {"name": "block", "box": {"centre": [0, 0, 30], "size": [80, 80, 60], "material": "muscle"}},
      {"name": "stone", "firstView": 2, "sphere": {"centre": [0, 0, 14], "radius": 2, "material": "stone"}}],
    "views": {"poses": [{"face": [0, 0, 5], "target": [0, 0, 50]}, {"face": [0, 0, 5], "target": [0, 0, 50]}]})",
                       6);
  const SceneScan first = run.Make(0), second = run.Make(1);
  ASSERT_TRUE(first.pressed && second.pressed);
  EXPECT_EQ(first.pressed->displacements, second.pressed->displacements);
  const TissueSurface stone = second.tissue.Only(1);
  Vector3d middle = Vector3d::Zero();
  for (const Eigen::Vector3f& point : stone.points)
    middle += point.cast<double>() / static_cast<double>(stone.points.size());
  EXPECT_GT(middle.z(), 14.0 + 1.5);
  EXPECT_LT(middle.z(), 14.0 + 5.0);
  const DisplacementField moved = DisplacementField::Interpolating(second.pressed->nodes, second.pressed->displacements);
  EXPECT_TRUE(middle.isApprox(Vector3d(0, 0, 14) + moved.At(Vector3d(0, 0, 14)), 0.02)) << middle.transpose();
  ASSERT_EQ(first.landmarks.size(), second.landmarks.size());
  EXPECT_GT(first.pressSeconds, 0.0);
}

TEST(SceneRun, PlanesOfASweepThatMovesSeeTheTissueOfTheirMoment)
{
  ECHORAMA_SKIP_SANITIZED();
  const auto scene = [](int states) {
    return R"("background": "gel", "press": {"spacingMm": 5}, "materials": {"dense": {"like": "muscle", "density": 2500}}, "probe": {"preset": "linear", "elements": 24, "sweepSteps": 8,
        "sweepWidthMm": 20, "samples": 240, "depthMinMm": 2, "depthMaxMm": 50}, "tissue": [
        {"name": "block", "box": {"centre": [0, 0, 30], "size": [80, 80, 60], "material": "muscle"}},
        {"name": "plate", "box": {"centre": [0, 0, 25], "size": [70, 70, 1], "material": "dense"}}],
      "sweep": {"seconds": 1, "velocityMmPerSecond": [0, 0, 6], "states": )" +
           std::to_string(states) + R"(}, "views": {"poses": [{"face": [0, 0, 6], "target": [0, 0, 50]}]})";
  };
  // The probe goes from 3 to 9 mm below where the skin was. Where the scanner shows the plate tells how far it has yielded.
  SceneRun fine = RunOf(scene(8)), coarse = RunOf(scene(1));
  const SceneScan eight = fine.Make(0), one = coarse.Make(0);
  const auto depthMm = [](const SceneScan& scan, int step) {
    std::vector<double> mean(240, 0.0);
    for (int beam = 0; beam < 24; ++beam)
      for (int i = 0; i < 240; ++i)
        mean[static_cast<std::size_t>(i)] += scan.beams.View().Row(beam, step)[i];
    const auto peak = std::max_element(mean.begin() + 40, mean.begin() + 150);
    return 2.0 + static_cast<double>(peak - mean.begin()) * 48.0 / 239.0;
  };
  // From a probe that comes 6 mm nearer a plate that rests is seen to come as much nearer, one that yields by less: here some 3
  // mm.
  const double resting = depthMm(one, 0) - depthMm(one, 7), yielding = depthMm(eight, 0) - depthMm(eight, 7);
  EXPECT_NEAR(resting, 6.0 * 1540.0 / 1580.0, 0.4);
  EXPECT_NEAR(yielding, 3.0, 0.8);
  EXPECT_NEAR(depthMm(eight, 4), depthMm(one, 4), 0.4);
}

TEST(SceneRun, OnAPathGelGoesWithTheProbeAndStaysOnTheSkin)
{
  ECHORAMA_SKIP_SANITIZED();
  // Down to 1 mm above the skin, up again, 45 mm on, and down again.
  const std::string members = R"("background": "air", "gel": {"amountMl": 8, "cellMm": 4}, "tissue": [
      {"name": "block", "box": {"centre": [20, 0, 32], "size": [150, 70, 60], "material": "muscle"}}],
    "views": {"times": [0.4, 1.6], "stepMm": 20, "keys": [
      {"seconds": 0, "pose": {"face": [0, 0, -10], "target": [0, 0, 50]}}, {"seconds": 0.4, "pose": {"face": [0, 0, 1], "target": [0, 0, 50]}},
      {"seconds": 0.8, "pose": {"face": [0, 0, -20], "target": [0, 0, 50]}}, {"seconds": 1.2, "pose": {"face": [45, 0, -20], "target": [45, 0, 50]}},
      {"seconds": 1.6, "pose": {"face": [45, 0, 1], "target": [45, 0, 50]}}]})";
  SceneRun run = RunOf(members);
  const SceneScan first = run.Make(0), second = run.Make(1);
  ASSERT_TRUE(first.gel && second.gel);
  EXPECT_GT(first.gel->coupled, 0.5);
  // What stayed on the skin is missing at the next site, but it is still gel.
  EXPECT_LT(second.gel->coupled, 0.9 * first.gel->coupled);
  EXPECT_NEAR(second.gel->volumeMm3, first.gel->volumeMm3, 0.05 * first.gel->volumeMm3);

  // The second view alone is the same, and so is the first again.
  SceneRun other = RunOf(members);
  const SceneScan alone = other.Make(1), again = other.Make(0);
  EXPECT_EQ(alone.gel->coupled, second.gel->coupled);
  EXPECT_EQ(alone.gel->level, second.gel->level);
  EXPECT_EQ(again.gel->level, first.gel->level);

  // Fresh gel at the second site couples as at the first: listed views have gel of their own.
  SceneRun fresh = RunOf(R"("background": "air", "gel": {"amountMl": 8, "cellMm": 4}, "tissue": [
      {"name": "block", "box": {"centre": [20, 0, 32], "size": [150, 70, 60], "material": "muscle"}}],
    "views": {"poses": [{"face": [45, 0, 1], "target": [45, 0, 50]}]})");
  EXPECT_GT(fresh.Make(0).gel->coupled, 1.05 * second.gel->coupled);
}

TEST(SceneRun, RefusesWithTheNumberOfTheView)
{
  SceneRun run = RunOf(still);
  EXPECT_THROW(run.Make(3), Error);
  SceneRun bony = RunOf(R"("background": "air", "press": {"spacingMm": 6}, "tissue": [
      {"box": {"centre": [0, 0, 30], "size": [80, 80, 60], "material": "muscle"}},
      {"sphere": {"centre": [0, 0, 10], "radius": 8, "material": "bone"}}],
    "views": {"poses": [{"face": [0, 0, -1], "target": [0, 0, 50]}, {"face": [0, 0, 9], "target": [0, 0, 50]}]})");
  bony.Make(0);
  try {
    bony.Make(1);
    ADD_FAILURE() << "a probe went through bone";
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).rfind("view 2: ", 0), 0u) << error.what();
    EXPECT_EQ(error.GetKind(), Error::Kind::NotPossible);
  }
  bony.Make(0); // which works as before
}
