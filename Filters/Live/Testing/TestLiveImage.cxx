// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Geometry/ProbePresets.h"
#include "Filters/Live/LiveImage.h"
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <optional>

namespace {

using namespace echorama;

// A large volume of one grey with a bright ball in it.
struct Scene {
  explicit Scene(const std::optional<Eigen::Vector3d>& ball = {}) : voxels({120, 60, 120}, 80)
  {
    grid.dimensions = voxels.Dimensions();
    grid.spacing.setConstant(1.5);
    grid.origin = {-90, -45, -20};
    for (int k = 0; k < 120 && ball; ++k)
      for (int j = 0; j < 60; ++j)
        for (int i = 0; i < 120; ++i)
          if ((grid.IndexToWorld() * Eigen::Vector3d(i, j, k) - *ball).norm() < 6.0)
            voxels.View()(i, j, k) = 240;
    volumes.Add<unsigned char>({voxels.View(), {}, grid});
  }
  Volume<unsigned char> voxels;
  ImageGeometry grid;
  BeamVolumes volumes;
};

struct Frame {
  Volume<unsigned char> intensity, valid;
  ImageGeometry grid;

  bool operator==(const Frame& o) const
  {
    return std::equal(intensity.View().begin(), intensity.View().end(), o.intensity.View().begin()) &&
           std::equal(valid.View().begin(), valid.View().end(), o.valid.View().begin());
  }
};

Frame Make(LiveImage& live, const BeamVolumes& volumes, const Pose& pose, std::int64_t number = 0)
{
  live.MakeBeams(volumes, pose, number);
  Frame frame;
  frame.grid = live.Grid(pose);
  frame.intensity = frame.valid = Volume<unsigned char>(frame.grid.dimensions);
  live.MakePixels(frame.intensity.View(), frame.valid.View(), {});
  return frame;
}

LiveImageParameters Small(LiveProbe kind = LiveProbe::Linear)
{
  LiveImageParameters p;
  p.probe.kind = kind;
  p.width = 200;
  p.height = 160;
  p.beams = 80;
  p.samples = 160;
  return p;
}

Pose Turned()
{
  return MotionAbout({0, 0, 30}, {0.1, -0.2, 0.4}, {4, -3, 12});
}

TEST(LiveImage, ABallIsSeenWhereItLiesInTheWorld)
{
  const Eigen::Vector3d ball(6, 1, 40);
  const Scene scene(ball);
  for (const LiveProbe kind : {LiveProbe::Convex, LiveProbe::Linear, LiveProbe::Phased, LiveProbe::Endocavity})
    for (const bool flip : {false, true}) {
      LiveImageParameters p = Small(kind);
      p.flip = flip;
      p.thickness.thicknessMm = 1.0;
      LiveImage live;
      live.Set(p);
      // The probe's plane through the ball, turned about the ball.
      const Pose pose = MotionAbout(ball, {0.15, -0.2, 0.4}, Eigen::Vector3d(4, 1, 5));
      const Frame frame = Make(live, scene.volumes, pose);
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      int bright = 0;
      for (int j = 0; j < 160; ++j)
        for (int i = 0; i < 200; ++i)
          if (frame.intensity.View()(i, j, 0) > 160) {
            sum += frame.grid.IndexToWorld() * Eigen::Vector3d(i, j, 0);
            ++bright;
          }
      ASSERT_GT(bright, 20);
      // Where the plane cuts the ball: the ball's centre, projected onto the plane.
      const Eigen::Vector3d normal = pose.linear().col(1);
      const Eigen::Vector3d expected = ball - normal * normal.dot(ball - pose.translation());
      EXPECT_LT((sum / bright - expected).norm(), 0.8) << static_cast<int>(kind) << flip;
    }
}

// Each control that changes reaches an image whose tables were made for other ones.
TEST(LiveImage, KeepsNothingThatIsOld)
{
  const Scene scene(Eigen::Vector3d(6, 1, 40));
  LiveImageParameters p = Small();
  p.controls.noiseDb = -45.0;
  p.controls.shadowDbPerCm = 5.0;
  p.controls.enhancementDbPerCm = 1.0;
  p.controls.darkLevel = 0.5; // lighter than what is there
  p.controls.noiseMoves = true;
  LiveImage kept;
  kept.Set(p);
  Frame before = Make(kept, scene.volumes, Turned(), 3);
  const auto check = [&](const std::string& name) {
    kept.Set(p);
    LiveImage fresh;
    fresh.Set(p);
    const Frame now = Make(kept, scene.volumes, Turned(), 3);
    EXPECT_TRUE(now == Make(fresh, scene.volumes, Turned(), 3)) << name;
    EXPECT_FALSE(now == before) << name;
    before = now;
  };
  const ParameterList controls = Describe(p.controls);
  for (Parameter control : controls) {
    if (control.name == "Seed" || control.name == "NoiseMoves") {
      control.SetNumber(control.name == "Seed" ? 5.0 : 0.0);
    } else {
      const double high = std::min(control.range.high, control.Number() + 30.0);
      control.SetNumber(control.name == "FrequencyMHz" ? 5.0
                        : control.name == "DarkLevel"  ? 0.9
                                                       : 0.7 * control.Number() + 0.3 * high);
    }
    check(control.name);
  }
  p.probe.depthMm = 55.0;
  check("depth");
  p.samples = 170;
  check("samples");
}

TEST(LiveImage, NoiseStaysWithTheBeamsAndIsTheSameForTheSameSeed)
{
  const Scene scene;
  LiveImageParameters p = Small();
  p.controls.noiseDb = -45.0;
  LiveImage live, other;
  live.Set(p);
  other.Set(p);
  const Frame here = Make(live, scene.volumes, Pose::Identity()), there = Make(live, scene.volumes, Turned());
  EXPECT_TRUE(here == there); // all that the probe sees is one grey, wherever it is
  EXPECT_TRUE(here == Make(other, scene.volumes, Pose::Identity(), 7));
  double sum = 0.0, squares = 0.0;
  int count = 0;
  for (std::ptrdiff_t i = 0; i < here.intensity.View().Size(); ++i)
    if (here.valid.View()[i]) {
      sum += here.intensity.View()[i];
      squares += std::pow(here.intensity.View()[i], 2);
      ++count;
    }
  EXPECT_GT(std::sqrt(squares / count - std::pow(sum / count, 2)), 3.0);

  p.controls.seed = 2;
  other.Set(p);
  EXPECT_FALSE(here == Make(other, scene.volumes, Pose::Identity()));
  p.controls.noiseDb = -200.0;
  other.Set(p);
  const Frame silent = Make(other, scene.volumes, Pose::Identity());
  for (std::ptrdiff_t i = 0; i < silent.intensity.View().Size(); ++i)
    ASSERT_EQ(silent.intensity.View()[i], silent.valid.View()[i] ? 80 : 0);
}

TEST(LiveImage, NoiseHasTheMeanPowerThatWasAskedFor)
{
  const Volume<unsigned char> black({120, 60, 120}, 0); // 60 dB below white
  BeamVolumes volumes;
  volumes.Add<unsigned char>({black.View(), {}, Scene().grid});
  LiveImageParameters p = Small();
  p.controls.noiseDb = -20.0;
  p.controls.noiseGrainMm = 0.0;
  p.samples = 400;
  LiveImage live;
  live.Set(p);
  live.MakeBeams(volumes, Pose::Identity());
  double power = 0.0;
  for (const float grey : live.BeamValue())
    power += std::pow(10.0, (grey / 255.0 - 1.0) * 6.0);
  EXPECT_NEAR(power / static_cast<double>(live.BeamValue().Size()), 0.01, 0.0004);
}

TEST(LiveImage, NoiseMovesWithTheFrameOnlyWhenAsked)
{
  const Scene scene;
  LiveImageParameters p = Small();
  p.controls.noiseDb = -45.0;
  p.controls.noiseMoves = true;
  LiveImage live;
  live.Set(p);
  const Frame first = Make(live, scene.volumes, Pose::Identity(), 1), second = Make(live, scene.volumes, Pose::Identity(), 2);
  EXPECT_FALSE(first == second);
  EXPECT_TRUE(first == Make(live, scene.volumes, Turned(), 1));
}

TEST(LiveImage, ThicknessIsThatOfTheProbeWhereNothingIsStated)
{
  const Transducer& lens = ProbePresetOf("curvilinear").transducer;
  LiveImageParameters p = Small(LiveProbe::Convex);
  for (double depth = 5.0; depth <= 150.0; depth += 5.0)
    EXPECT_NEAR(ThicknessOf(p).SigmaMm(depth), WidthAt(lens, depth).elevationSigma, 1e-9) << depth;
  p.thickness.focusMm = 30.0; // a lens that focuses nearer is sharper there
  Transducer nearer = lens;
  nearer.elevationFocusMm = 30.0;
  for (double depth = 5.0; depth <= 150.0; depth += 5.0)
    EXPECT_NEAR(ThicknessOf(p).SigmaMm(depth), WidthAt(nearer, depth).elevationSigma, 1e-9) << depth;
  p.thickness.thicknessMm = 2.0;
  p.thickness.divergence = 0.3;
  EXPECT_EQ(ThicknessOf(p).thicknessMm, 2.0);
  EXPECT_EQ(ThicknessOf(p).divergence, 0.3);
  EXPECT_EQ(ThicknessOf(p).focusMm, 30.0);
  p.thickness.divergence = 0.0;
  EXPECT_EQ(ThicknessOf(p).divergence, 0.0);
  p.thickness.thicknessMm = 0.0;
  EXPECT_EQ(ThicknessOf(p).SigmaMm(50.0), 0.0);
  for (const LiveProbe kind :
       {LiveProbe::Linear, LiveProbe::Phased, LiveProbe::Endocavity, LiveProbe::Radial, LiveProbe::Custom}) {
    const LiveImageParameters other = Small(kind);
    const BeamThickness thickness = ThicknessOf(other);
    EXPECT_LT(thickness.focusMm, GeometryOf(other.probe, 80).depthMax);
    EXPECT_GT(thickness.thicknessMm, 0.2);
    EXPECT_LT(thickness.thicknessMm, 4.0);
  }
}

TEST(LiveImage, ProbesHaveTheDepthAndTheRadiusThatWereAskedFor)
{
  LiveProbeSettings s;
  EXPECT_EQ(GeometryOf(s, 100).depthMax, 150.0);
  s.depthMm = 0.5;
  EXPECT_EQ(GeometryOf(s, 100).depthMax, 0.5);
  s.kind = LiveProbe::Radial;
  const ProbeGeometry radial = GeometryOf(s, 100);
  EXPECT_TRUE(ClosesCircle(radial, 100));
  EXPECT_NEAR(radial.fanWidth / radial.fanAngle, 1.0, 1e-12);
  s = {LiveProbe::Custom, 360.0, 12.0, -1.0, 0.0};
  const ProbeGeometry round = GeometryOf(s, 50);
  EXPECT_TRUE(ClosesCircle(round, 50));
  EXPECT_NEAR(round.fanWidth / round.fanAngle * 2.0 * 3.14159265358979, 12.0, 1e-9);
  EXPECT_EQ(round.depthMin, -1.0);
  s.fanAngle = 90.0;
  const ProbeGeometry quarter = GeometryOf(s, 50);
  EXPECT_NEAR(quarter.fanAngle, 1.5707963267948966, 1e-12);
  EXPECT_EQ(quarter.fanWidth, 12.0);
  EXPECT_TRUE(quarter.IsPlane());
  for (const LiveProbe kind : {LiveProbe::Convex, LiveProbe::Linear, LiveProbe::Phased, LiveProbe::Endocavity})
    EXPECT_TRUE(GeometryOf(Small(kind).probe, 50).IsPlane());
}

TEST(LiveImage, WhatIsKeptFromOtherParametersLeavesNoTrace)
{
  const Scene scene(Eigen::Vector3d(3, 0, 25));
  LiveImage reused;
  std::vector<LiveImageParameters> all(5, Small());
  all[1].probe.depthMm = 80.0;
  all[2].controls.gainDb = 6.0;
  all[3].controls.noiseDb = -40.0;
  all[4] = Small(LiveProbe::Convex);
  all[4].controls.noiseDb = -40.0;
  all[4].beams = 70;
  for (const int which : {0, 1, 0, 2, 3, 4, 3, 0, 4}) {
    LiveImage fresh;
    fresh.Set(all[static_cast<std::size_t>(which)]);
    reused.Set(all[static_cast<std::size_t>(which)]);
    EXPECT_TRUE(Make(reused, scene.volumes, Turned()) == Make(fresh, scene.volumes, Turned())) << which;
  }
}

TEST(LiveImage, WithoutAVolumeUnderTheProbeAllIsEmpty)
{
  const Scene scene;
  LiveImageParameters p = Small();
  p.controls.noiseDb = -20.0;
  p.controls.gainDb = 40.0;
  LiveImage live;
  live.Set(p);
  Pose away = Pose::Identity();
  away.translation().y() = 1000.0;
  const BeamVolumes none;
  for (const BeamVolumes* volumes : {&scene.volumes, &none}) {
    const Frame frame = Make(live, *volumes, away);
    EXPECT_EQ(live.RealShare(), 0.0);
    for (std::ptrdiff_t i = 0; i < frame.intensity.View().Size(); ++i)
      ASSERT_EQ(frame.intensity.View()[i] + frame.valid.View()[i], 0);
  }
  Make(live, scene.volumes, Pose::Identity());
  EXPECT_EQ(live.RealShare(), 1.0);
}

TEST(LiveImage, ThreadsChangeNothing)
{
  const Scene scene(Eigen::Vector3d(3, 0, 25));
  LiveImageParameters p = Small(LiveProbe::Convex);
  p.controls.noiseDb = -40.0;
  p.controls.shadowDbPerCm = 30.0;
  LiveImage live;
  live.Set(p);
  const Frame many = Make(live, scene.volumes, Turned());
  const ThreadLimit limit(1);
  LiveImage alone;
  alone.Set(p);
  EXPECT_TRUE(many == Make(alone, scene.volumes, Turned()));
}

TEST(LiveImage, RefusesPosesAndParametersThatAreNone)
{
  const Scene scene;
  LiveImage live;
  live.Set(Small());
  Pose pose = Pose::Identity();
  pose.translation().z() = std::numeric_limits<double>::infinity();
  EXPECT_THROW(live.MakeBeams(scene.volumes, pose), Error);
  LiveImageParameters thin = Small(), flat = Small(LiveProbe::Custom);
  thin.beams = 1;
  flat.probe.fanAngle = flat.probe.fanWidth = 0.0;
  for (const LiveImageParameters& p : {thin, flat})
    EXPECT_THROW(live.Set(p), Error);
}

} // namespace
