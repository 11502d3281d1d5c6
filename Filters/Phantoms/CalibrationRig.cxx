// SPDX-License-Identifier: BSD-3-Clause
// Glass plate first, then the base on it, the stems from the plate into the balls, and the balls: later bodies count where they
// overlap.
#include "CalibrationRig.h"
#include "BodyShapes.h"
#include "Core/Base/CheckRange.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

using Eigen::Vector3d;

[[noreturn]] void RefuseRig(const std::string& reason)
{
  throw Error(Error::Kind::InvalidParameter, "calibration rig: " + reason);
}

Vector3d InWorld(const CalibrationRigParameters& p, const Vector3d& inRig)
{
  return p.scale * inRig + Vector3d(0.0, 0.0, p.plateDepthMm);
}

Material Water(double celsius)
{
  Material water = StandardMaterial("water");
  water.soundSpeed = WaterSoundSpeed(celsius);
  return water;
}

Material Glass()
{
  Material glass = StandardMaterial("steel"); // clear and hard like it
  glass.name = "glass";
  glass.soundSpeed = 5640.0;
  glass.density = 2240.0;
  glass.attenuation = 0.05;
  glass.youngsModulusKPa = 6.2e7;
  return glass;
}

} // namespace

std::vector<CalibrationRigParameters::Ball> CalibrationRigParameters::DefaultBalls()
{
  return {{"A", {-27.0, -22.0, -19.0}, 4.0}, {"B", {-30.0, 23.0, -45.0}, 5.0}, {"C", {-5.0, -20.0, -49.0}, 3.0},
          {"D", {-2.0, 18.0, -28.0}, 6.0},   {"E", {27.0, 21.0, -20.0}, 7.0},  {"F", {12.0, -14.0, -58.0}, 3.5},
          {"G", {30.0, -1.0, -47.0}, 4.5}};
}

ParameterList Describe(CalibrationRigParameters& p)
{
  return {
      Parameter("Scale", p.scale, {0.2, 5}, "", "Size of the rig: places and radii of the balls are multiplied by it."),
      Parameter("PlateDepthMm", p.plateDepthMm, {10, 500}, "mm", "z of the glass plate's upper side in the world."),
      Parameter("PlateMm", p.plateMm, {0, 50}, "mm", "Thickness of the plate; 0: no plate, base and stems."),
      Parameter("BaseMm", p.baseMm, {0, 20}, "mm", "Thickness of the slab on the glass that the pins stand on; 0: none."),
      Parameter("StemRadiusMm", p.stemRadiusMm, {0, 5}, "mm", "Radius of the pins that carry the balls; 0: none."),
      Parameter("WaterCelsius", p.waterCelsius, {0, 95}, "degrees Celsius",
                "Temperature of the bath; the water's speed of sound follows."),
      Parameter("DetailMm", p.detailMm, {0.1, 5}, "mm", "Edge of the triangles of the balls."),
      Parameter("Material", p.material, "What balls and stems are made of: the name of a standard material."),
  };
}

ParameterList Describe(CalibrationRigParameters::Ball& ball)
{
  return {
      Parameter("Name", ball.name, "Of the landmark."),
      Parameter("Centre", ball.centre, {-1000, 1000}, "mm",
                "In the rig: z = 0 is the plate's upper side, -z is up to the probe."),
      Parameter("Radius", ball.radius, {0.5, 30}, "mm", "Before the rig is scaled."),
  };
}

void CalibrationRigParameters::Check() const
{
  CheckRanges(*this);
  CheckRange("the number of balls", static_cast<double>(balls.size()), 1.0, 1000.0);
  StandardMaterial(material);
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const Ball& ball = balls[i];
    const std::string name = "ball " + std::to_string(i + 1) + (ball.name.empty() ? "" : " (" + ball.name + ")");
    CheckRanges(ball, name);
    if (ball.centre.z() + ball.radius >= -baseMm / scale)
      RefuseRig(name + " touches the plate or the base; its centre's z must be below " +
                NumberText(-ball.radius - baseMm / scale));
    for (std::size_t j = 0; j < i; ++j)
      if ((ball.centre - balls[j].centre).norm() <= ball.radius + balls[j].radius)
        RefuseRig(name + " touches ball " + std::to_string(j + 1));
  }
}

double CalibrationRigParameters::StemRadius(const Ball& ball) const
{
  return std::min(stemRadiusMm, 0.6 * scale * ball.radius);
}

Eigen::AlignedBox2d CalibrationRigParameters::BaseOutline() const
{
  Eigen::AlignedBox2d outline;
  for (const Ball& ball : balls)
    outline.extend(scale * ball.centre.head<2>());
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(std::min(6.0, 20.0 * scale)); // the plate's is 25 at scale 1
  return {outline.min() - margin, outline.max() + margin};
}

double WaterSoundSpeed(double celsius)
{
  constexpr double c[]{1.402385e3, 5.038813, -5.799136e-2, 3.287156e-4, -1.398845e-6, 2.787860e-9};
  double speed = 0.0;
  for (int i = 5; i >= 0; --i)
    speed = speed * celsius + c[i];
  return speed;
}

TissueSurface MakeCalibrationRig(const CalibrationRigParameters& p, const Progress& progress)
{
  p.Check();
  progress(0.0);
  TissueSurface rig;
  rig.MaterialIndex(Water(p.waterCelsius));
  const Material& stuff = StandardMaterial(p.material);
  if (p.plateMm > 0.0) {
    Eigen::Vector2d low = p.balls.front().centre.head<2>(), high = low;
    for (const auto& ball : p.balls) {
      low = low.cwiseMin(ball.centre.head<2>());
      high = high.cwiseMax(ball.centre.head<2>());
    }
    const Eigen::Vector2d margin(25.0, 25.0);
    AddBlock(
        rig, "plate", Glass(), p.scale * (low - margin), p.scale * (high + margin),
        [&p](double, double) { return p.plateDepthMm; }, p.plateDepthMm + p.plateMm, 1e6);
    if (p.baseMm > 0.0) {
      const Eigen::AlignedBox2d outline = p.BaseOutline();
      AddBlock(
          rig, "base", stuff, outline.min(), outline.max(), [&p](double, double) { return p.plateDepthMm - p.baseMm; },
          p.plateDepthMm, 1e6);
    }
    if (p.stemRadiusMm > 0.0)
      for (const auto& ball : p.balls) {
        // From half inside the plate, which holds it, to the ball's centre.
        const double radius = p.StemRadius(ball);
        const double inPlate = std::min(0.5 * p.plateMm, radius);
        const Vector3d foot = InWorld(p, {ball.centre.x(), ball.centre.y(), 0.0}) + Vector3d(0.0, 0.0, inPlate - radius);
        const Vector3d top = InWorld(p, ball.centre);
        std::vector<Vector3d> path;
        constexpr int pieces = 8;
        for (int k = 0; k <= pieces; ++k)
          path.push_back(foot + (top - foot) * k / pieces);
        AddTube(rig, "stem of " + ball.name, stuff, path, std::vector<double>(path.size(), radius), p.detailMm);
      }
  }
  progress(0.5);
  for (const auto& ball : p.balls) {
    const double radius = p.scale * ball.radius;
    AddBlob(
        rig, ball.name, stuff, InWorld(p, ball.centre), [radius](const Vector3d&) { return radius; }, p.detailMm);
  }
  progress(1.0);
  return rig;
}

std::vector<Landmark> CalibrationLandmarks(const CalibrationRigParameters& p)
{
  p.Check();
  std::vector<Landmark> landmarks;
  for (const auto& ball : p.balls)
    landmarks.push_back({ball.name, InWorld(p, ball.centre)});
  return landmarks;
}

} // namespace echorama
