// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Filters/Acoustics/SliceTracer.h"
#include "Filters/Tissue/Testing/SurfacesForTests.h"
#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;
using namespace echorama::testing;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

// Tissue of a brightness that neither attenuates nor differs from others in impedance.
Material Grey(const std::string& name, double backscatterDb)
{
  Material material = Clear(name, 1540.0, 1000.0);
  material.scattererDensity = 100.0;
  material.backscatterDb = backscatterDb;
  return material;
}

// A flat probe, 0.5 mm from beam to beam and 0.1 mm from sample to sample, without any gain.
SynthesisParameters Flat()
{
  SynthesisParameters p;
  p.probe = ProbeGeometry::Linear(40.0, 0.0, 0.0, 60.0);
  p.elements = 81;
  p.samples = 601;
  p.receiver.tgcDbPerCm = 0.0;
  return p;
}

// Materials alone.
SliceLook Bare()
{
  SliceLook look;
  look.darkeningDb = look.speckle = look.reverberationDb = look.gelMm = 0.0;
  look.attenuation = look.surfaceLosses = look.surfaceLines = false;
  return look;
}

float GreyOf(const SynthesisParameters& p, double db)
{
  return static_cast<float>(std::clamp(p.receiver.referenceGrey + db * 255.0 / p.receiver.dynamicRangeDb, 0.0, 255.0));
}

Volume<float> Draw(const TissueSurface& surface, const SynthesisParameters& p, const SliceLook& look,
                   std::vector<SliceBeam>* beams = nullptr)
{
  const AcousticScene scene(surface);
  return SliceTracer(scene).Trace(p, look, beams);
}

// Of pairs of numbers.
class Correlation {
public:
  void Add(double a, double b)
  {
    ++n_;
    a_ += a;
    b_ += b;
    aa_ += a * a;
    bb_ += b * b;
    ab_ += a * b;
  }
  double Value() const { return (ab_ - a_ * b_ / n_) / std::sqrt((aa_ - a_ * a_ / n_) * (bb_ - b_ * b_ / n_)); }
  double Count() const { return n_; }

private:
  double n_ = 0, a_ = 0, b_ = 0, aa_ = 0, bb_ = 0, ab_ = 0;
};

// The picture at a place of the beams, linear between samples.
double At(const Volume<float>& picture, const ProbeGeometry& probe, const BeamPoint& at)
{
  const auto view = picture.View();
  const double x = (at.depth - probe.depthMin) / (probe.depthMax - probe.depthMin) * (view.Dimensions()[0] - 1),
               y = (at.fan + 0.5) * (view.Dimensions()[1] - 1);
  const int i = std::min(static_cast<int>(x), view.Dimensions()[0] - 2),
            j = std::min(static_cast<int>(y), view.Dimensions()[1] - 2);
  const auto row = [&](int beam) { return view(i, beam, 0) + (x - i) * (view(i + 1, beam, 0) - view(i, beam, 0)); };
  return row(j) + (y - j) * (row(j + 1) - row(j));
}

// How far two pictures agree at the same places of the world; or, \a asIfFixedToProbe, at the same places of the beams.
double AgreementInWorld(const Volume<float>& a, const Volume<float>& b, const SynthesisParameters& p, const Pose& poseA,
                        const Pose& poseB, bool asIfFixedToProbe = false)
{
  Correlation correlation;
  for (double x = -15.0; x <= 15.0; x += 0.5)
    for (double z = 10.0; z <= 50.0; z += 0.1) {
      const Vector3d world = poseA * Vector3d(x, 0.0, z);
      const auto inA = BeamPointAt(p.probe, poseA.inverse() * world, 1e-6);
      const auto inB = asIfFixedToProbe ? inA : BeamPointAt(p.probe, poseB.inverse() * world, 1e-6);
      if (inA && inB)
        correlation.Add(At(a, p.probe, *inA), At(b, p.probe, *inB));
    }
  EXPECT_GT(correlation.Count(), 5000);
  return correlation.Value();
}

std::string MessageOf(const std::function<void()>& call)
{
  try {
    call();
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::InvalidParameter);
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

} // namespace

TEST(SliceTracer, ShowsASphereWhereAndAsWideAsItIs)
{
  TissueSurface surface = Background(Grey("tissue", -3.0));
  const Vector3d centre(3.1, 0.0, 30.0);
  AddSphere(surface, Grey("dark", -20.0), centre, 8.0, 5);
  const SynthesisParameters p = Flat();
  const Volume<float> picture = Draw(surface, p, Bare());
  int within = 0;
  for (int beam = 0; beam < p.elements; ++beam)
    for (int i = 0; i < p.samples; ++i) {
      const double away = (Vector3d(-20.0 + 0.5 * beam, 0.0, 0.1 * i) - centre).norm();
      if (std::abs(away - 8.0) < 0.02)
        continue;
      within += away < 8.0;
      ASSERT_NEAR(picture.View()(i, beam, 0), GreyOf(p, away < 8.0 ? -20.0 : -3.0), 1e-3) << beam << " " << i;
    }
  EXPECT_GT(within, 3000);
}

TEST(SliceTracer, DarkensByTheNumberOfSurfaces)
{
  // Boxes within boxes: the ray down the middle crosses eight surfaces, those at the side fewer.
  TissueSurface surface = Background(Grey("0", 0.0));
  for (int i = 1; i <= 4; ++i)
    AddBox(surface, Grey(std::to_string(i), -1.0 * i), Vector3f(-20.3f + 4.0f * i, -20, 5.07f * i),
           Vector3f(20.3f - 4.0f * i, 20, 55.05f - 5.0f * i));
  const SynthesisParameters p = Flat();
  SliceLook look = Bare();
  look.darkeningDb = 1.7;
  std::vector<SliceBeam> beams;
  const Volume<float> picture = Draw(surface, p, look, &beams);
  for (int beam = 0; beam < p.elements; ++beam) {
    const double x = std::abs(-20.0 + 0.5 * beam);
    int all = 0;
    for (int i = 0; i < p.samples; ++i) {
      const double z = 0.1 * i;
      int inside = 0;
      all = 0;
      for (int box = 1; box <= 4; ++box)
        if (x < 20.3 - 4.0 * box) {
          all += (z > 5.07 * box) + (z > 55.05 - 5.0 * box);
          if (z > 5.07 * box && z < 55.05 - 5.0 * box)
            inside = box;
        }
      ASSERT_NEAR(picture.View()(i, beam, 0), GreyOf(p, -1.0 * inside - 1.7 * all), 1e-3) << beam << " " << i;
    }
    EXPECT_EQ(beams[static_cast<std::size_t>(beam)].surfaces, all);
  }
  EXPECT_EQ(beams[40].surfaces, 8);
}

TEST(SliceTracer, AttenuatesAsTheMaterialSaysAndGainMakesUpForIt)
{
  Material tissue = Grey("tissue", 0.0);
  tissue.attenuation = 0.5;
  SynthesisParameters p = Flat();
  p.transducer.frequencyMHz = 4.0;
  SliceLook look = Bare();
  look.attenuation = true;
  const Volume<float> falling = Draw(Background(tissue), p, look);
  for (const int i : {0, 200, 600})
    EXPECT_NEAR(falling.View()(i, 7, 0), GreyOf(p, -0.4 * 0.1 * i), 1e-3); // 0.5 x 4 MHz x 2 ways, per cm
  p.receiver.tgcDbPerCm = 4.0;
  const Volume<float> even = Draw(Background(tissue), p, look);
  for (const int i : {0, 200, 600})
    EXPECT_NEAR(even.View()(i, 7, 0), GreyOf(p, 0.0), 1e-3);
}

TEST(SliceTracer, DrawsSurfacesByImpedanceAndAngle)
{
  // Two plates, one behind the other, that give nothing but lines.
  TissueSurface surface = Background(Clear("water", 1500.0, 1000.0));
  AddBox(surface, Clear("plate", 1500.0, 1400.0), Vector3f(-100, -100, 20), Vector3f(100, 100, 40));
  SynthesisParameters p = Flat();
  p.mirrorDb = 20.0;
  SliceLook look = Bare();
  look.surfaceLines = true;
  const double degree = 3.141592653589793 / 180.0, reflected = 20.0 * std::log10(0.4 / 2.4),
               passed = 20.0 * std::log10(1.0 - std::pow(0.4 / 2.4, 2));
  const Volume<float> lines = Draw(surface, p, look);
  EXPECT_NEAR(lines.View()(200, 40, 0), GreyOf(p, 20.0 + reflected), 0.01);
  EXPECT_NEAR(lines.View()(400, 40, 0), GreyOf(p, 20.0 + reflected), 0.01);
  EXPECT_EQ(lines.View()(300, 40, 0), 0.0f);
  look.surfaceLosses = true;
  const Volume<float> losing = Draw(surface, p, look);
  EXPECT_NEAR(losing.View()(200, 40, 0), GreyOf(p, 20.0 + reflected), 0.01);
  EXPECT_NEAR(losing.View()(400, 40, 0), GreyOf(p, 20.0 + reflected + passed), 0.01);
  // Aslant they are weaker: a Gaussian of the angle.
  p.transport.acceptanceDegrees = 5.0;
  p.probeToWorld.linear() = ExpRotation(Vector3d(4.0 * degree, 0.0, 0.0));
  const Volume<float> aslant = Draw(surface, p, look);
  const auto* row = aslant.View().Row(40, 0);
  const auto* peak = std::max_element(row, row + 300);
  const double place = 200.0 / std::cos(4.0 * degree);
  EXPECT_NEAR(static_cast<double>(peak - row), place, 0.51);
  const double beside = 0.1 * (place - std::round(place)) / p.transducer.PulseSigmaMm(); // of the nearest sample
  EXPECT_NEAR(*peak, GreyOf(p, 20.0 + reflected - 4.342944819 * (std::pow(4.0 / 5.0, 2) + beside * beside)), 0.01);
}

TEST(SliceTracer, RoughSurfacesShineWeaklyFromEverySide)
{
  Material rough = Clear("rough", 1500.0, 1400.0);
  rough.roughness = 1.0;
  TissueSurface surface = Background(Clear("water", 1500.0, 1000.0));
  AddBox(surface, rough, Vector3f(-100, -100, 20), Vector3f(100, 100, 100));
  SynthesisParameters p = Flat();
  SliceLook look = Bare();
  look.surfaceLines = true;
  const double degree = 3.141592653589793 / 180.0;
  const double lobe = 20.0 * std::log10(0.4 / 2.4 * p.transport.acceptanceDegrees * degree); // of energy, the square is caught
  for (const double angle : {0.0, 30.0}) {
    p.probeToWorld.linear() = ExpRotation(Vector3d(angle * degree, 0.0, 0.0));
    const Volume<float> picture = Draw(surface, p, look);
    const double cosine = std::cos(angle * degree), place = 200.0 / cosine;
    const double beside = 0.1 * (place - std::round(place)) / p.transducer.PulseSigmaMm();
    EXPECT_NEAR(picture.View()(static_cast<int>(std::lround(place)), 40, 0),
                GreyOf(p, p.mirrorDb + lobe + 10.0 * std::log10(cosine) - 4.342944819 * beside * beside), 0.02);
  }
}

TEST(SliceTracer, OpenSurfacesCountButNothingLiesInThem)
{
  TissueSurface surface = Background(Grey("tissue", 0.0));
  const int sheet = AddBody(surface, StandardMaterial("bone"));
  surface.points = {{-100, -100, 25}, {100, -100, 25}, {-100, 100, 25}, {100, 100, 25}};
  AddTriangle(surface, sheet, 0, 1, 2);
  AddTriangle(surface, sheet, 1, 3, 2);
  const SynthesisParameters p = Flat();
  SliceLook look = Bare();
  look.darkeningDb = 4.0;
  look.attenuation = true; // which bone would show
  std::vector<SliceBeam> beams;
  const Volume<float> picture = Draw(surface, p, look, &beams);
  EXPECT_NEAR(picture.View()(240, 11, 0), GreyOf(p, 0.0), 1e-3);
  EXPECT_NEAR(picture.View()(260, 11, 0), GreyOf(p, -4.0), 1e-3);
  EXPECT_NEAR(picture.View()(600, 11, 0), GreyOf(p, -4.0), 1e-3);
  EXPECT_EQ(beams[11].surfaces, 1);
  EXPECT_NEAR(beams[11].toBodyMm, 25.0, 1e-4);
}

TEST(SliceTracer, PressureCountsLessForBeamsThatLookAside)
{
  TissueSurface surface = Background(Grey("tissue", 0.0));
  AddBox(surface, Grey("plate", -20.0), Vector3f(-200, -200, 30), Vector3f(200, 200, 300));
  SynthesisParameters p = Flat();
  p.probe = ProbeGeometry::Convex(1.4, 40.0, 0.0, 0.0, 0.0, 60.0);
  SliceLook look = Bare();
  look.pressMm = 8.0;
  const Volume<float> picture = Draw(surface, p, look);
  for (const int beam : {0, 20, 40, 80}) {
    const double angle = 1.4 * (beam / 80.0 - 0.5);
    const double rest = (70.0 - 40.0 * std::cos(angle)) / std::cos(angle); // from the element to z = 30
    const double now = PressWarp{8.0 * std::cos(angle), 25.0}.PressedDepth(rest);
    const auto* row = picture.View().Row(beam, 0);
    const auto* first = std::find_if(row, row + p.samples, [&](float grey) { return grey < GreyOf(p, -10.0); });
    EXPECT_NEAR(0.1 * static_cast<double>(first - row), now, 0.11) << beam;
  }
}

TEST(SliceTracer, SpeckleIsFullyDevelopedAndAsBrightAsItsMaterial)
{
  SynthesisParameters p = Flat();
  p.receiver.dynamicRangeDb = 150.0; // nothing is cut off
  SliceLook look = Bare();
  look.speckle = 1.0;
  for (const bool convex : {false, true}) {
    if (convex)
      p.probe = ProbeGeometry::Convex(1.0, 40.0, 0.0, 0.0, 0.0, 100.0);
    double sum = 0.0, squares = 0.0, edge = 0.0;
    const int seeds = 4;
    for (p.seed = 1; p.seed <= seeds; ++p.seed) {
      const Volume<float> picture = Draw(Background(Grey("tissue", -2.0)), p, look);
      for (const float grey : picture.View()) {
        const double db = (grey - p.receiver.referenceGrey) * p.receiver.dynamicRangeDb / 255.0;
        sum += db;
        squares += db * db;
      }
      for (int i = 0; i < p.samples; ++i)
        edge += (picture.View()(i, 0, 0) - p.receiver.referenceGrey) * p.receiver.dynamicRangeDb / 255.0;
    }
    const double n = 1.0 * seeds * p.samples * p.elements, mean = sum / n;
    EXPECT_NEAR(mean, -2.0, 0.25) << convex;
    EXPECT_NEAR(std::sqrt(squares / n - mean * mean), 5.57, 0.25) << convex; // of the logarithm of Rayleigh's distribution
    EXPECT_NEAR(edge / (1.0 * seeds * p.samples), -2.0, 0.8) << convex;
  }
}

TEST(SliceTracer, SpeckleStaysWithTheTissueWhenTheProbeMoves)
{
  const AcousticScene scene(Background(Grey("tissue", 0.0)));
  SliceTracer tracer(scene);
  SynthesisParameters p = Flat();
  SliceLook look = Bare();
  look.speckle = 1.0;
  const Pose first = p.probeToWorld;
  const Volume<float> before = tracer.Trace(p, look);

  p.probeToWorld.translation() = Vector3d(3.0, 0.0, 2.0); // whole beams and samples
  EXPECT_GT(AgreementInWorld(before, tracer.Trace(p, look), p, first, p.probeToWorld), 0.97);
  EXPECT_LT(AgreementInWorld(before, tracer.Trace(p, look), p, first, p.probeToWorld, true), 0.1);

  p.probeToWorld.linear() = ExpRotation(Vector3d(0.0, 0.08, 0.0));
  EXPECT_GT(AgreementInWorld(before, tracer.Trace(p, look), p, first, p.probeToWorld), 0.6);
  EXPECT_LT(AgreementInWorld(before, tracer.Trace(p, look), p, first, p.probeToWorld, true), 0.1);

  p.probeToWorld = first; // the noise is a volume: a few mm beside there is another slice of it
  p.probeToWorld.translation().y() = 4.0;
  EXPECT_LT(AgreementInWorld(before, tracer.Trace(p, look), p, first, p.probeToWorld, true), 0.1);

  p.probeToWorld = first;
  p.seed = 2;
  EXPECT_LT(AgreementInWorld(before, tracer.Trace(p, look), p, first, first), 0.1);
  p.seed = 1;
  EXPECT_EQ(AgreementInWorld(before, tracer.Trace(p, look), p, first, first) > 0.999999, true);
}

TEST(SliceTracer, WarpIsTheIdentityWithoutPressureAndNeverFolds)
{
  for (const double depth : {-3.0, 0.0, 1.0, 77.7}) {
    EXPECT_EQ((PressWarp{0.0, 25.0}.RestDepth(depth)), depth);
    EXPECT_EQ((PressWarp{0.0, 25.0}.PressedDepth(depth)), depth);
  }
  for (const double press : {0.1, 5.0, 30.0, 100.0})
    for (const double reach : {1.0, 25.0, 1000.0}) {
      const PressWarp warp{press, reach};
      EXPECT_NEAR(warp.PressedDepth(-press - 3.0), -3.0, 1e-12);
      EXPECT_DOUBLE_EQ(warp.RestDepth(0.0), -press); // what touched the face then does so now
      EXPECT_NEAR(warp.RestDepth(40.0 * reach), 40.0 * reach, 1e-9);
      for (double depth = 0.0; depth < 200.0; depth += 0.37) {
        EXPECT_GE(warp.RestDepth(depth + 0.37) - warp.RestDepth(depth), 0.37 - 1e-9);
        EXPECT_NEAR(warp.PressedDepth(warp.RestDepth(depth)), depth, 1e-6) << press << " " << reach;
      }
    }
}

TEST(SliceTracer, PressureMovesSurfacesAndSpeckleAlike)
{
  TissueSurface surface = Background(Grey("tissue", 0.0));
  AddBox(surface, Grey("plate", -20.0), Vector3f(-100, -100, 20), Vector3f(100, 100, 30));
  const AcousticScene scene(surface);
  SliceTracer tracer(scene);
  const SynthesisParameters p = Flat();
  SliceLook look = Bare();
  const Volume<float> rest = tracer.Trace(p, look);
  look.pressReachMm = 40.0; // counts for nothing without pressure
  const Volume<float> same = tracer.Trace(p, look);
  EXPECT_TRUE(std::equal(rest.View().begin(), rest.View().end(), same.View().begin()));

  look.pressMm = 6.0;
  const PressWarp warp{6.0, 40.0};
  const Volume<float> pressed = tracer.Trace(p, look);
  for (int i = 0; i < p.samples; ++i) {
    const double at = warp.RestDepth(0.1 * i);
    if (std::abs(at - 20.0) > 0.01 && std::abs(at - 30.0) > 0.01) {
      ASSERT_NEAR(pressed.View()(i, 33, 0), GreyOf(p, at > 20.0 && at < 30.0 ? -20.0 : 0.0), 1e-3) << i;
    }
  }
  look.speckle = 1.0;
  const Volume<float> pressedSpeckle = tracer.Trace(p, look);
  look.pressMm = 0.0;
  const Volume<float> restSpeckle = tracer.Trace(p, look);
  Correlation moved, unmoved;
  for (int beam = 0; beam < p.elements; ++beam)
    for (int i = 200; i < p.samples; ++i) {
      const double at = warp.RestDepth(0.1 * i);
      if (at < 32.0)
        continue;
      moved.Add(pressedSpeckle.View()(i, beam, 0), At(restSpeckle, p.probe, {at, beam / 80.0 - 0.5, 0.0}));
      unmoved.Add(pressedSpeckle.View()(i, beam, 0), restSpeckle.View()(i, beam, 0));
    }
  EXPECT_GT(moved.Value(), 0.9);
  EXPECT_LT(unmoved.Value(), 0.2);
}

TEST(SliceTracer, RaysHaveTheMomentsOfTheThickness)
{
  const SliceThickness thickness{1.2, 0.08, 55.0};
  for (const int count : {5, 7, 9, 33}) {
    const std::vector<SkewRay> rays = RaysOf(thickness, count);
    ASSERT_EQ(rays.size(), static_cast<std::size_t>(count));
    EXPECT_EQ(rays[0].shiftMm, 0.0);
    EXPECT_EQ(rays[0].slope, 0.0);
    for (const double depth : {0.0, 20.0, 55.0, 130.0}) {
      double sum = 0.0, squares = 0.0;
      for (const SkewRay& ray : rays) {
        const double away = ray.shiftMm + ray.slope * depth;
        sum += away;
        squares += away * away;
      }
      EXPECT_NEAR(sum / count, 0.0, 1e-9);
      EXPECT_NEAR(squares / count, 1.2 * 1.2 + std::pow(0.08 * (depth - 55.0), 2), 1e-9) << count << " " << depth;
    }
  }
  EXPECT_EQ(RaysOf({}, 9).size(), 1u);
  EXPECT_EQ(RaysOf(thickness, 1).size(), 1u);
  for (const int count : {2, 3, 4, 6})
    EXPECT_THROW(RaysOf(thickness, count), Error);
}

// A wall beside the plane, parallel to it: as much of the power is its own as rays run in it.
TEST(SliceTracer, AThickPlaneSeesWhatLiesBesideIt)
{
  TissueSurface surface = Background(Grey("tissue", 0.0));
  const SynthesisParameters p = Flat();
  const SliceThickness thickness{2.0, 0.0, 30.0};
  AddBox(surface, Grey("wall", -15.0), Vector3f(-100, 1, -10), Vector3f(100, 50, 100));
  const AcousticScene scene(surface);
  SliceTracer tracer(scene);
  for (const int count : {1, 5, 9}) {
    SliceLook look = Bare();
    look.rays = count;
    int inWall = 0;
    for (const SkewRay& ray : RaysOf(thickness, count))
      inWall += ray.shiftMm > 1.0;
    const double power = (count - inWall + inWall * std::pow(10.0, -1.5)) / count;
    const Volume<float> picture = tracer.Trace(p, look, nullptr, thickness);
    for (const int i : {5, 300, 595})
      EXPECT_NEAR(picture.View()(i, 40, 0), GreyOf(p, 10.0 * std::log10(power)), 0.01) << count << " " << i;
    if (count > 1) {
      EXPECT_GT(inWall, 0);
    }
    look.speckle = 1.0; // fully developed about the same mean power
    const Volume<float> speckled = tracer.Trace(p, look, nullptr, thickness);
    double mean = 0.0;
    for (const float grey : speckled.View())
      mean += std::pow(10.0, 0.1 * (grey - p.receiver.referenceGrey) * p.receiver.dynamicRangeDb / 255.0);
    // Grey is cut at black and white, far from here; the mean of what is left has some error.
    EXPECT_NEAR(10.0 * std::log10(mean / static_cast<double>(speckled.View().Size())), 10.0 * std::log10(power) + 2.5, 0.5);
  }
}

// Where tissue lay is where the picture is taken from: surfaces, materials and speckle.
TEST(SliceTracer, BentBeamsSeeWhereTissueLay)
{
  TissueSurface surface = Background(Grey("tissue", 0.0));
  AddBox(surface, Grey("plate", -20.0), Vector3f(-100, -100, 20), Vector3f(100, 100, 30));
  AddSphere(surface, Grey("ball", -8.0), Vector3d(4, 0, 42), 6.0);
  const AcousticScene scene(surface);
  SliceTracer tracer(scene);
  const SynthesisParameters p = Flat();
  SliceLook look = Bare();
  BeamBend bend(p.probe, 61, 11, 5.0);
  // Everywhere alike: as if the probe had gone there.
  const Vector3d move(2.3, -0.4, 3.1);
  for (std::size_t node = 0; node < bend.Count(); ++node)
    bend.SetMove(node, move);
  SynthesisParameters moved = p;
  moved.probeToWorld.translation() = move;
  look.speckle = 1.0;
  const SliceThickness thickness{1.0, 0.05, 30.0};
  const Volume<float> bent = tracer.Trace(p, look, nullptr, thickness, &bend),
                      there = tracer.Trace(moved, look, nullptr, thickness);
  int different = 0;
  for (std::ptrdiff_t i = 0; i < bent.View().Size(); ++i)
    different += std::abs(bent.View()[i] - there.View()[i]) > 0.5f;
  EXPECT_LT(different, 200); // of 48681: samples at surfaces

  // Tissue that is squeezed along the beams, the more the deeper: depth d lay at 1.25 d, and aside on a curve.
  look.speckle = 0.0;
  for (std::size_t node = 0; node < bend.Count(); ++node) {
    const Vector3d at = bend.NodePoint(node);
    bend.SetMove(node, {0.002 * at.z() * at.z(), 0.0, 0.25 * at.z()});
  }
  std::vector<SliceBeam> beams;
  const Volume<float> squeezed = tracer.Trace(p, look, &beams, {}, &bend);
  for (int i = 0; i < p.samples; ++i)
    for (const int beam : {20, 40, 44, 70}) {
      const double depth = 0.1 * i, x = 0.5 * beam - 20.0 + 0.002 * depth * depth, z = 1.25 * depth;
      const double toBall = std::hypot(x - 4.0, z - 42.0);
      if (std::abs(z - 20.0) < 0.1 || std::abs(z - 30.0) < 0.1 || std::abs(toBall - 6.0) < 0.15)
        continue;
      ASSERT_NEAR(squeezed.View()(i, beam, 0),
                  GreyOf(p, z > 20.0 && z < 30.0 ? -20.0
                            : toBall < 6.0       ? -8.0
                                                 : 0.0),
                  1e-3)
          << i << " " << beam;
    }
  EXPECT_NEAR(beams[40].toBodyMm, 16.0, 0.02);
}

// A plate that was slanted at rest, and that pressure has brought to lie across the beams, shines as one that always did.
TEST(SliceTracer, SurfacesShineByTheirAngleUnderPressure)
{
  const auto shine = [](double slant, bool isBent) {
    TissueSurface surface = Background(Clear("soft", 1540.0, 1000.0));
    AddBox(surface, Clear("hard", 1540.0, 1100.0), Vector3f(-100, -100, 20), Vector3f(100, 100, 60));
    for (Vector3f& point : surface.points)
      point.z() += static_cast<float>(slant) * point.x();
    const SynthesisParameters p = Flat();
    BeamBend bend(p.probe, 61, 3, 5.0);
    for (std::size_t node = 0; node < bend.Count(); ++node)
      bend.SetMove(node, {0.0, 0.0, slant * bend.NodePoint(node).x()}); // what is at z now lay at z + slant x
    SliceLook look = Bare();
    look.surfaceLines = true;
    const AcousticScene scene(surface);
    const Volume<float> picture = SliceTracer(scene).Trace(p, look, nullptr, {}, isBent ? &bend : nullptr);
    return *std::max_element(picture.View().Row(50, 0), picture.View().Row(50, 0) + p.samples);
  };
  const float flat = shine(0.0, false);
  EXPECT_GT(flat, 50.0f);
  EXPECT_NEAR(shine(0.2, true), flat, 0.1f);
  EXPECT_LT(shine(0.2, false), flat - 20.0f);
}

// What is kept from picture to picture is made anew when anything that it depends on changes.
TEST(SliceTracer, KeepsNothingThatIsOld)
{
  const TissueSurface surface = Background(Grey("tissue", 0.0));
  const AcousticScene scene(surface);
  SliceTracer kept(scene);
  SynthesisParameters p = Flat();
  p.elements = 40;
  p.samples = 150;
  const auto matches = [&] {
    const Volume<float> picture = kept.Trace(p, SliceLook()), fresh = SliceTracer(scene).Trace(p, SliceLook());
    return std::equal(picture.View().begin(), picture.View().end(), fresh.View().begin());
  };
  EXPECT_TRUE(matches());
  Transducer& t = p.transducer;
  const std::function<void()> changes[] = {
      [&] { t.frequencyMHz = 5.0; },
      [&] { t.bandwidth = 0.8; },
      [&] { t.lateralApertureMm = 12.0; },
      [&] { t.lateralFocusMm = 33.0; },
      [&] { t.dynamicReceive = false; },
      [&] { t.dynamicReceive = true, t.smallestFNumber = 4.0; },
      [&] { t.assumedSoundSpeed = 1450; },
      [&] { p.probe.fanWidth = 30.0; },
      [&] { p.probe.fanAngle = 0.5; },
      [&] { p.probe.depthMin = 5.0; },
      [&] { p.probe.depthMax = 50.0; },
      [&] { p.seed = 9; },
      [&] { p.elements = 41; },
      [&] { p.samples = 151; },
  };
  for (const auto& change : changes) {
    change();
    EXPECT_TRUE(matches()) << &change - changes;
  }
}

TEST(SliceTracer, DoesNotDependOnThreads)
{
  TissueSurface surface = Background(StandardMaterial("liver"));
  AddSphere(surface, StandardMaterial("blood"), Vector3d(0, 0, 25), 9.0);
  AddSphere(surface, StandardMaterial("bone"), Vector3d(12, 0, 25), 3.0);
  const AcousticScene scene(surface);
  SliceLook look;
  look.pressMm = 3.0;
  std::vector<Volume<float>> pictures;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    pictures.push_back(SliceTracer(scene).Trace(Flat(), look));
  }
  for (const auto& picture : pictures)
    EXPECT_TRUE(std::equal(picture.View().begin(), picture.View().end(), pictures[0].View().begin()));
  const auto [least, most] = std::minmax_element(pictures[0].View().begin(), pictures[0].View().end());
  EXPECT_LT(*least, 10.0f);
  EXPECT_GT(*most, 100.0f);
}

TEST(SliceTracer, BeginsWithinABody)
{
  TissueSurface surface = Background(Grey("tissue", 0.0));
  AddSphere(surface, Grey("dark", -15.0), Vector3d(0, 0, 0), 18.0, 5);
  AddSphere(surface, Grey("darker", -18.0), Vector3d(0, 0, 45), 5.0, 5);
  const SynthesisParameters p = Flat();
  std::vector<SliceBeam> beams;
  const Volume<float> picture = Draw(surface, p, Bare(), &beams);
  EXPECT_NEAR(picture.View()(0, 40, 0), GreyOf(p, -15.0), 1e-3);
  EXPECT_NEAR(picture.View()(178, 40, 0), GreyOf(p, -15.0), 1e-3);
  EXPECT_NEAR(picture.View()(182, 40, 0), GreyOf(p, 0.0), 1e-3);
  EXPECT_NEAR(picture.View()(450, 40, 0), GreyOf(p, -18.0), 1e-3);
  EXPECT_EQ(beams[40].toBodyMm, 0.0);
  EXPECT_EQ(beams[40].surfaces, 3);
  EXPECT_TRUE(std::isinf(beams[80].toBodyMm)); // the outermost beams pass the sphere by its side
}

TEST(SliceTracer, ShowsTheBackgroundOfAnEmptyScene)
{
  const SynthesisParameters p = Flat();
  std::vector<SliceBeam> beams;
  const Volume<float> tissue = Draw(Background(Grey("tissue", -4.0)), p, Bare(), &beams);
  EXPECT_EQ(tissue.Dimensions(), (std::array<int, 3>{601, 81, 1}));
  for (const float grey : tissue.View())
    ASSERT_NEAR(grey, GreyOf(p, -4.0), 1e-3);
  ASSERT_EQ(beams.size(), 81u);
  for (const SliceBeam& beam : beams)
    EXPECT_TRUE(beam.contact && beam.surfaces == 0 && std::isinf(beam.toBodyMm));
  const Volume<float> water = Draw(Background(StandardMaterial("water")), p, SliceLook());
  for (const float grey : water.View())
    ASSERT_EQ(grey, 0.0f);
}

TEST(SliceTracer, ShowsReverberationAloneWithoutContact)
{
  TissueSurface surface = Background(StandardMaterial("air"));
  AddBox(surface, StandardMaterial("liver"), Vector3f(-10, -100, 0), Vector3f(100, 100, 100)); // but not left of x = -10
  SynthesisParameters p = Flat();
  SliceLook look;
  look.gelMm = 0.5;
  std::vector<SliceBeam> beams;
  const auto brightest = [&](const Volume<float>& picture, int beam, int from, int to) {
    const auto* row = picture.View().Row(beam, 0);
    return *std::max_element(row + from, row + to);
  };
  p.probeToWorld.translation().z() = -3.0;
  const Volume<float> off = Draw(surface, p, look, &beams);
  for (const int beam : {5, 60}) {
    EXPECT_FALSE(beams[static_cast<std::size_t>(beam)].contact);
    EXPECT_GT(brightest(off, beam, 0, 100), 100.0f);
    EXPECT_EQ(brightest(off, beam, 300, 601), 0.0f);
  }
  EXPECT_NEAR(beams[60].toBodyMm, 3.0, 1e-4);
  EXPECT_TRUE(std::isinf(beams[5].toBodyMm));

  p.probeToWorld.translation().z() = -0.4; // gel fills the gap
  const Volume<float> on = Draw(surface, p, look, &beams);
  EXPECT_TRUE(beams[60].contact);
  EXPECT_FALSE(beams[5].contact);
  EXPECT_GT(brightest(on, 60, 300, 601), 30.0f);
  EXPECT_EQ(brightest(on, 5, 300, 601), 0.0f);
  look.reverberationDb = 0.0;
  EXPECT_EQ(brightest(Draw(surface, p, look), 5, 0, 601), 0.0f);
}

TEST(SliceTracer, RefusesWhatIsWrong)
{
  const AcousticScene scene(Background(StandardMaterial("liver")));
  SliceTracer tracer(scene);
  SynthesisParameters p = Flat();
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    p.probeToWorld.translation().y() = bad;
    EXPECT_NE(MessageOf([&] { tracer.Trace(p, {}); }).find("probeToWorld"), std::string::npos);
    p.probeToWorld = Pose::Identity();
    p.probeToWorld.linear()(1, 2) = bad;
    EXPECT_NE(MessageOf([&] { tracer.Trace(p, {}); }).find("probeToWorld"), std::string::npos);
    p.probeToWorld = Pose::Identity();
    SliceLook look;
    look.pressMm = bad;
    EXPECT_NE(MessageOf([&] { tracer.Trace(p, look); }).find("PressMm"), std::string::npos);
  }
  p.probe = ProbeGeometry::Linear(40.0, 20.0, 0.0, 60.0);
  EXPECT_NE(MessageOf([&] { tracer.Trace(p, {}); }).find("sweeps"), std::string::npos);
  EXPECT_NE(MessageOf([] { SpeckleTexture(1, 0.0); }).find("grainMm"), std::string::npos);
}

TEST(SpeckleTexture, HasPowerOneAndItsGrainEverywhereAlsoAcrossTheSeams)
{
  const SpeckleTexture texture(3, 0.4), other(4, 0.4);
  const Eigen::Matrix3d axes = SpeckleTexture::Axes();
  EXPECT_TRUE(IsRotation(axes));
  const double period = texture.PeriodMm();
  for (int axis = 0; axis < 3; ++axis) {
    // Along lines that cross the seam at 0 again and again, beside lines within a block.
    for (const double start : {-0.2, 0.5 * period}) {
      double power = 0.0, beside = 0.0, strange = 0.0;
      int n = 0;
      for (double u = 0.05; u < 60.0; u += 1.3)
        for (double v = 0.05; v < 60.0; v += 1.3) {
          const Vector3d origin =
              axes * (start * Vector3d::Unit(axis) + u * Vector3d::Unit((axis + 1) % 3) + v * Vector3d::Unit((axis + 2) % 3));
          std::complex<float> here[3], there[3];
          texture.Along(origin, axes.col(axis), {0.0, 0.4, 0.4 + period}, here);
          other.Along(origin, axes.col(axis), {0.0, 0.4, 0.4 + period}, there);
          power += 0.5 * static_cast<double>(std::norm(here[0]) + std::norm(here[1]));
          beside += static_cast<double>(std::real(here[0] * std::conj(here[1])));
          strange += static_cast<double>(std::real(here[0] * std::conj(there[0])));
          EXPECT_LT(std::abs(here[1] - here[2]), 1e-3f); // it repeats itself
          ++n;
        }
      EXPECT_NEAR(power / n, 1.0, 0.12) << axis << " " << start;
      EXPECT_NEAR(beside / power, std::exp(-0.25), 0.05) << axis << " " << start;
      EXPECT_NEAR(strange / n, 0.0, 0.1);
    }
  }
}
