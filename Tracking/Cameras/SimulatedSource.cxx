// SPDX-License-Identifier: BSD-3-Clause
// Paths are closed forms of time in the plane across the camera's axis; a light lies where a line along that axis meets the skin,
// seen from within. So the truth of any moment is known, and a frame depends on its number alone.
#include "Tracking/Cameras/SimulatedSource.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Tracking/Cameras/RestUntil.h"
#include "Tracking/Optical/SurfaceFile.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr double Turn = 6.283185307179586, LiftSeconds = 0.5;

// Where along a stroke: 1.5 times the mean speed in the middle, a rest of a fifth of the time at each end.
double Stroke(double share)
{
  const double there = std::clamp((2.0 * (share < 0.5 ? share : 1.0 - share) - 0.1) / 0.8, 0.0, 1.0);
  return 2.0 * there * there * (3.0 - 2.0 * there) - 1.0;
}

Eigen::Vector2d PathPlace(const SimulatedSourceParameters& p, int light, double time)
{
  const double angle = Turn * light / p.lights, r = p.radiusMm;
  const Eigen::Vector2d centre =
      p.lights > 1 ? Eigen::Vector2d(35.0 * std::cos(angle), 35.0 * std::sin(angle)) : Eigen::Vector2d(0.0, 0.0);
  switch (p.path) {
  case SimulatedPath::Still:
    break;
  case SimulatedPath::Circle: {
    const double around = p.speedMmPerS / r * time + angle;
    return centre + r * Eigen::Vector2d(std::cos(around), std::sin(around));
  }
  case SimulatedPath::Strokes: {
    const double cycles = p.speedMmPerS / (4.0 * r) * time + 0.3 * light;
    return centre + r * Stroke(cycles - std::floor(cycles)) * Eigen::Vector2d(std::cos(angle + 0.7), std::sin(angle + 0.7));
  }
  case SimulatedPath::Wander: {
    Random random(p.camera.seed, 0x57616e64ull << 32 | static_cast<std::uint32_t>(light));
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (int i = 0; i < 6; ++i) { // of a length such that the mean speed is about as asked
      const double rate = random.Uniform(0.5, 1.5) * p.speedMmPerS / r, phase = random.Uniform(0.0, Turn);
      sum[i % 2] += 0.55 * r * std::sin(rate * time + phase);
    }
    return centre + sum;
  }
  }
  return centre;
}

std::vector<SimulatedLight> LightsOf(const SimulatedSourceParameters& p, const std::shared_ptr<const SeenSurface>& skin)
{
  std::vector<SimulatedLight> lights;
  for (int i = 0; i < p.lights; ++i)
    lights.push_back(p.Light(i, [p, skin, i, cameraToShell = p.CameraToShell()](double time) {
      LightOnSkin light;
      const Eigen::Vector2d place = PathPlace(p, i, time);
      const auto hit = skin->FirstHit(cameraToShell * Eigen::Vector3d(place.x(), place.y(), 0.0), cameraToShell.linear().col(2));
      light.peak = hit && i + 1 != p.deadLight ? p.peak : 0.0;
      if (hit)
        light.point = hit->point;
      // One after the other they are lifted off.
      if (p.liftEverySeconds > 0.0 &&
          std::fmod(time + p.liftEverySeconds * (1.0 - static_cast<double>(i) / p.lights), p.liftEverySeconds) < LiftSeconds)
        light.peak = 0.0;
      return light;
    }));
  return lights;
}

} // namespace

ParameterList Describe(SimulatedSourceParameters& p)
{
  return Join(
      {{Parameter(
            "Surface", p.surface,
            "A file of echorama calibrate surface, whose camera, skin, lights and times are simulated; what other options say "
            "of these is ignored. None: a dome."),
        Parameter("Calibrated", p.calibrated,
                  "The camera is as that file has it. Off: lens and place are those of other options, so that the calibration is "
                  "compared with a truth that it did not make."),
        Parameter("DomeMm", p.domeMm, {1, 10000}, "mm", "Radii of the skin, a half ellipsoid about the origin."),
        Parameter("CameraMm", p.cameraMm, {-10000, 10000}, "mm", "Where the camera is; it looks along z."),
        Parameter("CameraTurn", p.cameraTurn, {-360, 360}, "degrees", "How it is turned: an axis times an angle."),
        Parameter("Lights", p.lights, {1, 4}, "", "How many lights there are."),
        Parameter("OffSlots", p.offSlots, {1, 2}, "", "In so many slots of the blink code all lights are off."),
        Parameter("Peak", p.peak, {0, 10000}, "grey levels", "At the middle of the spot of a light that touches."),
        Parameter("DeadLight", p.deadLight, {0, 4}, "", "This light, from 1, never shines; 0: all do."),
        Parameter("Path", Choice(p.path, {"still", "circle", "strokes", "wander"}), "How the lights go over the skin."),
        Parameter("RadiusMm", p.radiusMm, {0.1, 1000}, "mm", "Of circles; half of a stroke."),
        Parameter("SpeedMmPerS", p.speedMmPerS, {0, 10000}, "mm/s", "Seen along the camera's axis; of strokes the mean."),
        Parameter("LiftEverySeconds", p.liftEverySeconds, {0, 1000}, "s",
                  "So often each light is taken away for half a second, one after the other; 0: never."),
        Parameter("ClockPpm", p.clockPpm, {-1000, 1000}, "ppm", "How much faster the lights' clock is than the camera's."),
        Parameter("Speed", p.speed, {0, 100}, "",
                  "Of frames; 0: whenever they are asked for. With another, frames come in our time."),
        Parameter("Frames", p.frames, {0, 2000000000}, "", "After so many it ends; 0: never.")},
       Describe(p.camera)});
}

SimulatedSourceParameters SimulatedSourceParameters::Of(const TrackerAddress& address)
{
  if (!address.place.empty())
    throw Error(Error::Kind::InvalidParameter, address.text + ": a simulated camera has no place; its options follow a ?");
  SimulatedSourceParameters p;
  address.Set(Describe(p));
  return p;
}

Pose SimulatedSourceParameters::CameraToShell() const
{
  Pose pose = Pose::Identity();
  pose.translation() = cameraMm;
  pose.linear() = ExpRotation(RadiansPerDegree * cameraTurn);
  return pose;
}

SimulatedLight SimulatedSourceParameters::Light(int index, std::function<LightOnSkin(double)> place) const
{
  const double rate = camera.frameRate * (1.0 + 1e-6 * clockPpm);
  const double phase = Random(camera.seed, 0x5068617365).Uniform(0.0, 20.0); // slots
  return {std::move(place), [index, rate, phase, code = Code()](double from, double to) {
            return code.OnShare(index, from * rate + phase, to * rate + phase);
          }};
}

SimulatedSource::SimulatedSource(const SimulatedSourceParameters& parameters, std::shared_ptr<const SeenSurface> skin,
                                 std::vector<SimulatedLight> lights)
  : parameters_(parameters), skin_(std::move(skin)), lights_(std::move(lights)),
    camera_(parameters.camera, *skin_, parameters.CameraToShell())
{
  CheckRanges(parameters_);
}

SimulatedSource::SimulatedSource(const SimulatedSourceParameters& parameters) : SimulatedSource(SceneOf(parameters)) {}

SimulatedSource::SimulatedSource(const Scene& scene)
  : SimulatedSource(scene.parameters, scene.skin, LightsOf(scene.parameters, scene.skin))
{
}

// The residual of the lens is left out: a camera like that one, not that one.
SimulatedSource::Scene SimulatedSource::SceneOf(SimulatedSourceParameters p)
{
  CheckRanges(p);
  if (p.surface.empty())
    return {p, std::make_shared<DomeSurface>(p.domeMm)};
  const CalibratedSurface surface = ReadSurface(p.surface);
  if (surface.lights.alternating)
    throw Error(Error::Kind::InvalidParameter, p.surface + ": its lights take turns, which is not simulated");
  const SurfaceMapState& state = surface.map.State();
  if (p.calibrated) {
    p.camera.lens = state.optics.lens;
    p.cameraMm = state.cameraToShell.translation();
    p.cameraTurn = DegreesPerRadian * LogRotation(state.cameraToShell.linear());
  }
  p.lights = surface.lights.lights;
  p.offSlots = surface.lights.offSlots;
  p.camera.frameRate = 1000.0 / surface.tracks.slotMs;
  p.camera.exposureMs = surface.tracks.exposureMs;
  p.camera.rowUs = surface.tracks.rowUs;
  return {p, surface.map.Skin()};
}

CameraFormat SimulatedSource::Open()
{
  number_ = lost_ = 0;
  rendered_ = -1;
  start_ = IsLive() ? ClockNow() : 0.0;
  const SimulatedCameraParameters& c = parameters_.camera;
  const double speed = IsLive() ? parameters_.speed : 1.0;
  return {c.lens.width,    c.lens.height, c.frameRate * speed,           c.exposureMs / speed,
          c.rowUs / speed, "GREY",        "a camera that does not exist"};
}

double SimulatedSource::Due(std::int64_t number) const
{
  const SimulatedCameraParameters& c = parameters_.camera;
  return start_ + (static_cast<double>(number) / c.frameRate + 1e-6 * c.rowUs * (c.lens.height - 1) +
                   1e-3 * (c.exposureMs + c.latencyMs)) /
                      parameters_.speed;
}

CameraSource::Outcome SimulatedSource::Next(CameraFrame& frame, double seconds)
{
  const double until = IsLive() ? ClockNow() + seconds : 0.0;
  for (;;) {
    if (parameters_.frames > 0 && number_ >= parameters_.frames)
      return Outcome::Ended;
    if (rendered_ != number_) {
      camera_.Render(number_, lights_, frame_);
      rendered_ = number_;
    }
    if (IsLive()) {
      if (!RestUntil(Due(number_), until - ClockNow()))
        return Outcome::Nothing;
      // Whoever asks too late gets the newest, as of a camera.
      while (ClockNow() > Due(number_ + 2) && (parameters_.frames == 0 || number_ + 1 < parameters_.frames)) {
        ++number_;
        ++lost_;
      }
      if (rendered_ != number_)
        continue;
    }
    frame.number = number_++;
    if (frame_.isLost) {
      ++lost_;
      continue;
    }
    frame.grey = frame_.Grey();
    const double scale = IsLive() ? 1.0 / parameters_.speed : 1.0;
    frame.begin = start_ + scale * frame_.begin;
    frame.arrival = IsLive() ? ClockNow() : frame_.delivered;
    return Outcome::Frame;
  }
}

} // namespace echorama
