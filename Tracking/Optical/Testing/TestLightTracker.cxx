// SPDX-License-Identifier: BSD-3-Clause
// Whose light it is, from spots alone and through the whole chain from the simulated camera, against its truth.
#include "Core/Base/Random.h"
#include "Testing/Sanitized.h"
#include "Tracking/Optical/LightTracker.h"
#include "Tracking/Optical/SimulatedCamera.h"
#include <cmath>
#include <gtest/gtest.h>

namespace {

using namespace echorama;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Status = TrackedLight::Status;

const double Frame = 1.0 / 90.0;

// Lights in the plane of the picture, without a camera.
struct Flat {
  explicit Flat(const BlinkCode& theCode) : code(theCode) {}

  BlinkCode code;
  double phase = 0.0, slot = Frame, exposure = 0.008, noise = 0.03;
  std::vector<std::function<std::optional<Vector2d>(double)>> paths; // nothing: hidden
  std::vector<double> brightness{150.0, 150.0, 150.0, 150.0};

  std::vector<Spot> At(double time, std::uint64_t seed) const
  {
    std::vector<Spot> spots;
    for (std::size_t i = 0; i < paths.size(); ++i) {
      const auto place = paths[i](time + 0.5 * exposure);
      const double from = (time - phase) / slot, share = code.OnShare(static_cast<int>(i), from, from + exposure / slot);
      if (!place || share < 0.07)
        continue;
      Random random(seed, i);
      Spot spot;
      spot.position = *place + noise * Vector2d(random.Normal(), random.Normal());
      spot.covariance = noise * noise * Eigen::Matrix2d::Identity();
      spot.peak = brightness[i] * share;
      spot.size = 2.0;
      spots.push_back(spot);
    }
    return spots;
  }
};

struct Outcome {
  int right = 0, wrong = 0, lost = 0;
};

// Runs and counts, from \a from on, reports of lights that are nearer than 3 px to their own place, or further.
Outcome Follow(SpotTracks& tracks, const Flat& flat, int frames, int from, const std::function<bool(int)>& isLost = {})
{
  Outcome outcome;
  for (int n = 0; n < frames; ++n) {
    if (isLost && isLost(n))
      continue;
    const double time = n * Frame;
    for (const TrackedLight& light : tracks.Update(time, flat.At(time, static_cast<std::uint64_t>(n)))) {
      const auto truth = flat.paths[static_cast<std::size_t>(light.light)](light.time);
      if (n < from && light.status == Status::Lost)
        continue;
      if (light.status == Status::Lost)
        ++outcome.lost;
      else if (truth && (light.position - *truth).norm() < 3.0)
        ++outcome.right;
      else
        ++outcome.wrong;
    }
  }
  return outcome;
}

std::function<std::optional<Vector2d>(double)> Circle(Vector2d centre, double radius, double rate, double start)
{
  return [=](double t) { return Vector2d(centre + radius * Vector2d(std::cos(rate * t + start), std::sin(rate * t + start))); };
}

TEST(SpotTracks, TwoToFourLightsAreToldApartAtAnyPhase)
{
  for (int lights = 2; lights <= 4; ++lights)
    for (std::uint64_t trial = 0; trial < 8; ++trial) {
      Random random(3, trial);
      const BlinkCode code = BlinkCode::Make(lights, 2);
      Flat flat(code);
      flat.phase = random.Uniform(0.0, 1.0);
      for (int i = 0; i < lights; ++i)
        flat.paths.push_back(Circle({120.0 + 130.0 * i, 200.0}, 50.0, random.Uniform(-6.0, 6.0), i));
      SpotTracks tracks({}, code);
      const Outcome outcome = Follow(tracks, flat, 360, 60);
      EXPECT_EQ(outcome.wrong, 0) << lights << " " << trial;
      EXPECT_LT(outcome.lost, 4) << lights << " " << trial;
      EXPECT_GT(outcome.right, lights * 290);
      ASSERT_TRUE(tracks.Phase());
      const double period = code.Length() * Frame;
      EXPECT_LT(std::abs(std::remainder(*tracks.Phase() - flat.phase, period)), 0.3 * Frame);
    }
}

TEST(SpotTracks, LostFramesChangeNothing)
{
  const BlinkCode code = BlinkCode::Make(2, 2);
  Flat flat(code);
  flat.phase = 0.0123;
  flat.paths = {Circle({200, 200}, 60, 4.0, 0.0), Circle({400, 200}, 60, -3.0, 1.0)};
  SpotTracks tracks({}, code);
  const Outcome outcome =
      Follow(tracks, flat, 1500, 60, [](int n) { return Random(8, static_cast<std::uint64_t>(n)).Uniform() < 0.05; });
  EXPECT_EQ(outcome.wrong, 0);
  EXPECT_LT(outcome.lost, 30);
}

TEST(SpotTracks, WhatCrossesIsNeverTakenForTheOther)
{
  const BlinkCode code = BlinkCode::Make(2, 2);
  for (std::uint64_t trial = 0; trial < 20; ++trial) {
    Random random(31, trial);
    Flat flat(code);
    flat.phase = random.Uniform(0.0, 1.0);
    const double speed = random.Uniform(60.0, 300.0), miss = random.Uniform(-3.0, 3.0);
    // One crosses the other, or turns back where they meet, which looks the same.
    const bool turns = trial % 2 == 1;
    flat.paths = {
        [=](double t) { return Vector2d(300.0 + (turns ? -std::abs(speed * (t - 1.5)) : speed * (t - 1.5)), 200.0); },
        [=](double t) { return Vector2d(300.0 + (turns ? std::abs(speed * (t - 1.5)) : -speed * (t - 1.5)), 200.0 + miss); }};
    SpotTracks tracks({}, code);
    const Outcome outcome = Follow(tracks, flat, 270, 60);
    EXPECT_EQ(outcome.wrong, 0) << trial;
    EXPECT_GT(tracks.Statistics().met, 0) << trial;
    EXPECT_GT(outcome.right, 300) << trial;
    EXPECT_EQ(tracks.Lights()[0].status == Status::Lost || tracks.Lights()[1].status == Status::Lost, false)
        << trial; // found again
  }
}

TEST(SpotTracks, ALightThatGoesIsLostWithinThreeFramesAndFoundAgain)
{
  const BlinkCode code = BlinkCode::Make(2, 2);
  for (int start = 0; start < code.Length(); ++start) {
    Flat flat(code);
    flat.phase = 0.4 * Frame;
    const double gone = (100 + start) * Frame, back = gone + 1.0;
    flat.paths = {[=](double t) {
                    return t > gone && t < back ? std::nullopt : std::optional<Vector2d>({200.0, 100.0 + 50.0 * t});
                  },
                  Circle({400, 200}, 60, -3.0, 1.0)};
    SpotTracks tracks({}, code);
    for (int n = 0; n < 240; ++n) {
      const double time = n * Frame;
      const auto& lights = tracks.Update(time, flat.At(time, static_cast<std::uint64_t>(n)));
      if (n == 99 + start || n == 239) {
        EXPECT_NE(lights[0].status, Status::Lost) << start << " " << n;
      }
      if (n >= 103 + start && time < back) {
        EXPECT_EQ(lights[0].status, Status::Lost) << start << " " << n;
      }
      if (n > 60) {
        EXPECT_NE(lights[1].status, Status::Lost);
      }
    }
  }
}

TEST(SpotTracks, LampsAndSparklesAreNobody)
{
  const BlinkCode code = BlinkCode::Make(2, 2);
  Flat flat(code);
  flat.phase = 0.02;
  flat.paths = {Circle({200, 200}, 60, 4.0, 0.0), Circle({400, 200}, 60, -3.0, 1.0)};
  SpotTracks tracks({}, code);
  for (int n = 0; n < 600; ++n) {
    const double time = n * Frame;
    std::vector<Spot> spots = flat.At(time, static_cast<std::uint64_t>(n));
    Spot lamp;
    lamp.position = {50.0, 50.0};
    lamp.covariance = 1e-3 * Eigen::Matrix2d::Identity();
    lamp.peak = 200.0;
    lamp.size = 2.0;
    spots.push_back(lamp);
    Random random(4, static_cast<std::uint64_t>(n));
    if (random.Uniform() < 0.3) { // sparkles
      lamp.position = {random.Uniform(0, 640), random.Uniform(0, 480)};
      spots.push_back(lamp);
    }
    for (const TrackedLight& light : tracks.Update(time, spots)) {
      if (light.status == Status::Lost) {
        EXPECT_LT(n, 60);
        continue;
      }
      EXPECT_LT((light.position - *flat.paths[static_cast<std::size_t>(light.light)](light.time)).norm(), 3.0) << n;
    }
  }
}

// A second spot that blinks the same word: nobody knows which of both is the light, so neither is.
TEST(SpotTracks, ALightAndItsMirrorImageAreNobody)
{
  const BlinkCode code = BlinkCode::Make(2, 2);
  Flat flat(code);
  flat.phase = 0.02;
  flat.paths = {Circle({200, 200}, 60, 4.0, 0.0), Circle({400, 200}, 60, -3.0, 1.0)};
  SpotTracks tracks({}, code);
  constexpr int begin = 200, end = 500; // of the image
  int bothSeen = 0;
  for (int n = 0; n < 600; ++n) {
    const double time = n * Frame;
    std::vector<Spot> spots = flat.At(time, static_cast<std::uint64_t>(n));
    if (const auto place = flat.paths[0](time + 0.5 * flat.exposure); n >= begin && n < end)
      for (const Spot& spot : std::vector<Spot>(spots))
        if ((spot.position - *place).norm() < 1.0) {
          Spot image = spot; // half as bright, in a mirror along x
          image.position.y() = 620.0 - spot.position.y();
          image.peak *= 0.5;
          spots.push_back(image);
          bothSeen += n >= begin + 60;
        }
    const auto& lights = tracks.Update(time, spots);
    for (const TrackedLight& light : lights)
      if (light.status != Status::Lost) {
        EXPECT_LT((light.position - *flat.paths[static_cast<std::size_t>(light.light)](light.time)).norm(), 3.0) << n;
      }
    const bool isMirrored = n >= begin + 60 && n < end, isPlain = (n >= 60 && n < begin) || n >= end + 60;
    if (isMirrored) {
      EXPECT_EQ(lights[0].status, Status::Lost) << n;
    }
    if (isPlain) {
      EXPECT_NE(lights[0].status, Status::Lost) << n;
    }
    if (isMirrored || isPlain) {
      EXPECT_NE(lights[1].status, Status::Lost) << n;
    }
  }
  EXPECT_GT(bothSeen, 60);
  EXPECT_GT(tracks.Statistics().revoked, 0);
}

TEST(SpotTracks, ClocksThatDriftAreFollowed)
{
  const BlinkCode code = BlinkCode::Make(2, 2);
  Flat flat(code);
  flat.slot = Frame * (1.0 + 100e-6); // in 100 s a whole slot
  flat.paths = {Circle({200, 200}, 60, 4.0, 0.0), Circle({400, 200}, 60, -3.0, 1.0)};
  SpotTracks tracks({}, code);
  const Outcome outcome = Follow(tracks, flat, 18000, 60);
  EXPECT_EQ(outcome.wrong, 0);
  EXPECT_LT(outcome.lost, 40);
}

TEST(HandMotion, IsTheIntegralOfAForgettingAcceleration)
{
  // Many small steps are one large one, at any length; and nothing is negative.
  for (const double seconds : {1e-5, 0.011, 0.2}) {
    const HandMotion whole(seconds, 3000.0), small(seconds / 64.0, 3000.0);
    HandCovariance step = HandCovariance::Identity(), noise = HandCovariance::Zero();
    for (int i = 0; i < 64; ++i) {
      noise = (small.step * noise * small.step.transpose() + small.noise).eval();
      step = (small.step * step).eval();
    }
    EXPECT_LT((whole.step - step).norm(), 1e-9 * step.norm());
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j)
        EXPECT_NEAR(whole.noise(i, j), noise(i, j), 2e-2 * std::sqrt(noise(i, i) * noise(j, j)))
            << seconds << " " << i << " " << j;
    EXPECT_GT(noise(0, 2), 0.5 * std::sqrt(noise(0, 0) * noise(2, 2))); // a place that was pushed is on its way
    EXPECT_GT(small.noise(0, 2), 0.5 * std::sqrt(small.noise(0, 0) * small.noise(2, 2)));
    EXPECT_GE((noise.block<2, 2>(0, 0)).determinant(), 0.0);
  }
  // Half a tenth of a second later exp(-0.5) of it is left.
  EXPECT_NEAR(HandMotion(0.05, 1.0).step(4, 4), std::exp(-0.5), 1e-12);
  EXPECT_EQ(HandMotion(0.05, 1.0).step(0, 1), 0.0);
}

TEST(SpotTracks, PredictionBeatsWaiting)
{
  const BlinkCode code = BlinkCode::Make(2, 2);
  Flat flat(code);
  flat.paths = {Circle({200, 200}, 100, 5.0, 0.0), Circle({440, 200}, 100, -5.0, 1.0)}; // 500 px/s
  SpotTracks tracks({}, code);
  double squares = 0.0;
  int count = 0;
  for (int n = 0; n < 900; ++n) {
    const double time = n * Frame;
    for (const TrackedLight& light : tracks.Update(time, flat.At(time, static_cast<std::uint64_t>(n))))
      if (n > 60 && light.status == Status::Seen) {
        const double ahead = time + 0.004 + 0.022;
        squares += (light.predicted - *flat.paths[static_cast<std::size_t>(light.light)](ahead)).squaredNorm();
        EXPECT_LT((*tracks.Predict(light.light, ahead) - light.predicted).norm(), 1e-6);
        ++count;
      }
  }
  const double rms = std::sqrt(squares / count);
  EXPECT_LT(rms, 2.0); // of 11 px that it moves meanwhile; 0.6 px are its turn
  EXPECT_NEAR(tracks.Statistics().predictionRms, rms, 0.5 * rms);
  EXPECT_GT(tracks.Statistics().holdRms, 8.0);
  EXPECT_GT(tracks.Statistics().predictions, 500);
}

TEST(SpotTracks, ATriggeredCameraNeedsNoSearch)
{
  SpotTracksParameters parameters;
  EXPECT_THROW(SpotTracks(parameters, BlinkCode::Alternating()), Error);
  parameters.triggered = true;
  const BlinkCode code = BlinkCode::Alternating();
  Flat flat(code);
  flat.exposure = 0.008;
  flat.paths = {Circle({200, 200}, 60, 4.0, 0.0), Circle({400, 200}, 60, -3.0, 1.0)};
  SpotTracks tracks(parameters, code);
  const Outcome outcome = Follow(tracks, flat, 300, 8);
  EXPECT_EQ(outcome.wrong, 0);
  EXPECT_EQ(outcome.lost, 0);
}

TEST(SpotTracks, BadInputIsRefused)
{
  const BlinkCode code = BlinkCode::Make(2, 2);
  SpotTracksParameters parameters;
  parameters.exposureMs = 20.0;
  EXPECT_THROW(SpotTracks(parameters, code), Error);
  parameters = {};
  parameters.slotMs = 0.2; // a tenth of a frame
  EXPECT_THROW(SpotTracks(parameters, code), Error);
  SpotTracks tracks({}, code);
  tracks.Update(1.0, {});
  EXPECT_THROW(tracks.Update(1.0, {}), Error);
  EXPECT_THROW(tracks.Update(std::nan(""), {}), Error);
  tracks.Update(50.0, {}); // a long pause is no error
  EXPECT_FALSE(tracks.Predict(0, 51.0));
}

// The whole chain.
struct Rig {
  SimulatedCameraParameters camera;
  SpotTracksParameters tracks;
  DomeSurface dome{{110.0, 95.0, 90.0}};
  BlinkCode code = BlinkCode::Make(2, 2);
  double phase = 0.037;
  std::vector<SimulatedLight> lights;

  Rig()
  {
    camera.lens.width = 320;
    camera.lens.height = 240;
    camera.lens.centreX = 159.5;
    camera.lens.centreY = 119.5;
    camera.lens.focal = 95.0;
    camera.spotMm = 2.0;
    lights = {Walker(0, -30.0, 25.0, 4.0), Walker(1, 35.0, 25.0, -3.0)};
  }
  SimulatedLight Walker(int index, double x, double radius, double rate) const
  {
    return {[=](double t) {
              return LightOnSkin{*dome.Above(x + radius * std::cos(rate * t), radius * std::sin(rate * t)), 0.0, 160.0};
            },
            [=](double from, double to) { return code.OnShare(index, (from - phase) / Frame, (to - phase) / Frame); }};
  }
  Outcome Play(int frames, int settle, LightTracker& tracker, double* rms = nullptr) const
  {
    const SimulatedCamera seen(camera, dome, Pose::Identity());
    SimulatedFrame frame;
    Outcome outcome;
    double squares = 0.0;
    for (int n = 0; n < frames; ++n) {
      seen.Render(n, lights, frame);
      if (frame.isLost)
        continue;
      for (const TrackedLight& light : tracker.Update(frame.Grey(), frame.begin)) {
        if (n < settle && light.status == Status::Lost)
          continue;
        const LightTruth& truth = frame.truth[static_cast<std::size_t>(light.light)];
        if (light.status == Status::Lost)
          ++outcome.lost;
        else if ((light.position - truth.pixel).norm() < 3.0) {
          ++outcome.right;
          if (light.status == Status::Seen)
            squares += (light.spot.position - truth.pixel).squaredNorm();
        } else
          ++outcome.wrong;
      }
    }
    if (rms)
      *rms = std::sqrt(0.5 * squares / std::max(outcome.right, 1));
    return outcome;
  }
};

TEST(LightTracker, FollowsTwoLightsInNoiseHotPixelsAndSunlight)
{
  Rig rig;
  rig.camera.sunShare = 0.1;
  rig.lights = {rig.Walker(0, -55.0, 22.0, 4.0), rig.Walker(1, -5.0, 22.0, -3.0)}; // where the sun is, nothing is seen
  rig.camera.lostFrames = 0.01;
  LightTracker tracker({}, rig.tracks, rig.code);
  double rms = 0.0;
  const Outcome outcome = rig.Play(450, 90, tracker, &rms);
  EXPECT_EQ(outcome.wrong, 0);
  EXPECT_LT(outcome.lost, 20);
  EXPECT_GT(outcome.right, 650);
  EXPECT_LT(rms, 0.12);
  EXPECT_TRUE(tracker.HasBackground());
  EXPECT_GT(tracker.Spots().saturatedShare, 0.05);
}

TEST(LightTracker, FollowsThroughARollingShutter)
{
  for (const double phase : {0.001, 0.0047, 0.0093}) {
    Rig rig;
    rig.phase = phase;
    rig.lights = {rig.Walker(0, -30.0, 25.0, 4.0), rig.Walker(1, 35.0, 25.0, -3.0)};
    rig.camera.rowUs = rig.tracks.rowUs = 45.0; // all of a frame's time
    rig.camera.exposureMs = rig.tracks.exposureMs = 5.0;
    LightTracker tracker({}, rig.tracks, rig.code);
    const Outcome outcome = rig.Play(360, 90, tracker);
    EXPECT_EQ(outcome.wrong, 0) << phase;
    EXPECT_LT(outcome.lost, 20) << phase;
    EXPECT_TRUE(tracker.HasBackground()) << phase;
  }
}

// Beside a bright spot its own wide bell, with noise or a hot pixel on it, exceeds the threshold, too.
TEST(LightTracker, TwoLightsNearEachOtherAreBothFound)
{
  Rig rig;
  const SimulatedCamera seen(rig.camera, rig.dome, Pose::Identity());
  SimulatedFrame frame;
  LightsOffBackground background;
  for (int n = 0; n < 8; ++n) {
    seen.Render(1000 + n, {}, frame);
    background.Add(frame.Grey());
  }
  SpotDetector detector;
  for (double apart = 8.0; apart < 24.0; apart += 1.0)
    for (int n = 0; n < 20; ++n) {
      const Vector2d half = 0.5 * apart * Vector2d(std::cos(0.7 * n), std::sin(0.7 * n)), middle(-10.0 + 1.3 * n, 20.0);
      std::vector<SimulatedLight> pair;
      for (const Vector2d& at : {Vector2d(middle + half), Vector2d(middle - half)})
        pair.push_back({[&, at](double) { return LightOnSkin{*rig.dome.Above(at.x(), at.y()), 0.0, 150.0}; }, {}});
      seen.Render(n, pair, frame);
      const SpotFrame spots = detector.Detect(frame.Grey(), &background);
      ASSERT_EQ(spots.spots.size(), 2u) << apart << " " << n;
      for (const LightTruth& truth : frame.truth)
        EXPECT_LT(std::min((spots.spots[0].position - truth.pixel).norm(), (spots.spots[1].position - truth.pixel).norm()), 0.6)
            << apart << " " << n;
    }
}

// They touch for seconds, so near that most frames show one spot: no place is claimed that is not theirs, and both are still told
// apart when they part.
TEST(LightTracker, TwoThatStayTogetherAreNeverTakenForEachOther)
{
  Rig rig;
  const auto beside = [&](double sign) {
    return [&rig, sign](double t) {
      // From 30 mm to 4 mm, of bells 2 mm wide, and back.
      const double apart = 17.0 + 13.0 * std::cos(3.14159 * std::min(std::clamp((t - 1.5) / 0.7, 0.0, 1.0),
                                                                     std::clamp((6.5 - t) / 0.7, 0.0, 1.0)));
      return LightOnSkin{*rig.dome.Above(sign * 0.5 * apart + 12.0 * std::sin(2.0 * t), 10.0 * std::cos(1.7 * t)), 0.0, 160.0};
    };
  };
  rig.lights[0].place = beside(-1.0);
  rig.lights[1].place = beside(1.0);
  LightTracker tracker({}, rig.tracks, rig.code);
  const SimulatedCamera seen(rig.camera, rig.dome, Pose::Identity());
  SimulatedFrame frame;
  int apart = 0; // reports
  for (int n = 0; n < 720; ++n) {
    seen.Render(n, rig.lights, frame);
    for (const TrackedLight& light : tracker.Update(frame.Grey(), frame.begin))
      if (const LightTruth& truth = frame.truth[static_cast<std::size_t>(light.light)]; light.status != Status::Lost) {
        EXPECT_LT((light.position - truth.pixel).norm(), 3.0) << n;
        apart += n < 200 || n > 520;
      }
  }
  EXPECT_GT(apart, 600);
  EXPECT_NE(tracker.Lights()[0].status, Status::Lost);
  EXPECT_NE(tracker.Lights()[1].status, Status::Lost);
}

TEST(LightTracker, FourLightsThatMeetAreToldApart)
{
  ECHORAMA_SKIP_SANITIZED();
  Rig rig;
  rig.code = BlinkCode::Make(4, 2);
  rig.camera.lostFrames = 0.01;
  rig.lights.clear();
  for (int i = 0; i < 4; ++i) {
    SimulatedLight light = rig.Walker(i, 0.0, 0.0, 0.0); // its code
    light.place = [&rig, i](double t) {
      return LightOnSkin{
          *rig.dome.Above(35.0 * std::sin((1.1 + 0.23 * i) * t + i), 30.0 * std::sin((1.7 - 0.19 * i) * t + 2.0 * i)), 0.0,
          std::fmod(t + 2.0 * i, 9.0) < 0.5 ? 0.0 : 130.0 + 10.0 * i}; // and lifted off now and then
    };
    rig.lights.push_back(light);
  }
  LightTracker tracker({}, rig.tracks, rig.code);
  const SimulatedCamera seen(rig.camera, rig.dome, Pose::Identity());
  SimulatedFrame frame;
  int right = 0, visible = 0;
  for (int n = 0; n < 10000; ++n) {
    seen.Render(n, rig.lights, frame);
    if (frame.isLost)
      continue;
    for (const TrackedLight& light : tracker.Update(frame.Grey(), frame.begin)) {
      const LightTruth& truth = frame.truth[static_cast<std::size_t>(light.light)];
      visible += truth.isVisible;
      if (light.status == Status::Lost)
        continue;
      if (truth.isVisible) {
        EXPECT_LT((light.position - truth.pixel).norm(), 4.0) << n << " " << light.light;
        ++right;
      } else
        EXPECT_NE(light.status, Status::Seen) << n << " " << light.light;
    }
  }
  EXPECT_GT(right, visible * 3 / 4);
}

TEST(LightTracker, ClaimsNothingWithoutALight)
{
  Rig rig;
  rig.lights.clear();
  rig.camera.hotPixels = 200;
  LightTracker tracker({}, rig.tracks, rig.code);
  const SimulatedCamera seen(rig.camera, rig.dome, Pose::Identity());
  SimulatedFrame frame;
  for (int n = 0; n < 400; ++n) {
    seen.Render(n, {}, frame);
    for (const TrackedLight& light : tracker.Update(frame.Grey(), frame.begin))
      EXPECT_EQ(light.status, Status::Lost) << n;
  }
}

TEST(LightTracker, ALampThatIsSwitchedOnIsForgottenAgain)
{
  Rig rig;
  LightTracker tracker({}, rig.tracks, rig.code);
  rig.Play(120, 120, tracker);
  ASSERT_TRUE(tracker.HasBackground());
  // The same scene, brighter by 40 levels.
  Rig bright;
  bright.camera.ambient += 40.0;
  const SimulatedCamera seen(bright.camera, bright.dome, Pose::Identity());
  SimulatedFrame frame;
  int lost = 0;
  for (int n = 120; n < 300; ++n) {
    seen.Render(n, bright.lights, frame);
    for (const TrackedLight& light : tracker.Update(frame.Grey(), frame.begin)) {
      if (light.status == Status::Lost) {
        ++lost;
        continue;
      }
      EXPECT_LT((light.position - frame.truth[static_cast<std::size_t>(light.light)].pixel).norm(), 3.0);
    }
  }
  EXPECT_LT(lost, 20);
  EXPECT_TRUE(tracker.HasBackground());
}

TEST(LightTracker, TellsContactFromHover)
{
  Rig rig;
  const Vector3d place = *rig.dome.Above(10.0, 15.0);
  SpotDetector detector;
  const SimulatedCamera seen(rig.camera, rig.dome, Pose::Identity());
  SimulatedFrame frame;
  std::vector<ContactSample> samples; // of lights that touched
  for (const double x : {-40.0, 0.0, 40.0})
    for (const double y : {-40.0, 0.0, 40.0}) {
      seen.Render(0, {{[&](double) { return LightOnSkin{*rig.dome.Above(x, y), 0.0, 160.0}; }, {}}}, frame);
      const SpotFrame spots = detector.Detect(frame.Grey());
      ASSERT_EQ(spots.spots.size(), 1u);
      samples.push_back({spots.spots[0].position, spots.spots[0].peak, spots.spots[0].size});
    }
  LightTracker tracker({}, rig.tracks, rig.code, BrightnessCalibration::Fit(samples, 320, 240));
  rig.lights[0].place = [=](double t) { return LightOnSkin{place, t < 1.5 ? 0.0 : t < 3.0 ? 2.5 : 0.0, 160.0}; };
  EXPECT_EQ(tracker.TouchOf(0), Touch::Unknown);
  int contacts = 0, hovers = 0; // how often it was asked
  for (int n = 0; n < 400; ++n) {
    seen.Render(n, rig.lights, frame);
    const auto& lights = tracker.Update(frame.Grey(), frame.begin);
    const bool isFull = lights[0].status == Status::Seen && frame.truth[0].onShare > 0.99;
    if (n > 60 && isFull && n != 135 && n != 270) {
      const bool isContact = n < 135 || n > 275;
      EXPECT_EQ(tracker.TouchOf(0), isContact ? Touch::Contact : Touch::Hover) << n;
      ++(isContact ? contacts : hovers);
    }
  }
  EXPECT_GT(contacts, 40);
  EXPECT_GT(hovers, 20);
}

} // namespace
