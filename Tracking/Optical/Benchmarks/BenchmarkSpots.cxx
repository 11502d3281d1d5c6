// SPDX-License-Identifier: BSD-3-Clause
// Lights in the pictures of a camera inside a shell: how well places are found beside the Cramer-Rao bound, eq. 7.1 of the
// dissertation and OpenCV; what slopes and sunlight do to each; time per frame; and the whole chain against the truth of the
// simulated camera: whose light it is, what is claimed without a light, and how far off positions are that are predicted.
#include "Core/Base/Parallel.h"
#include "Core/Base/Percentile.h"
#include "Core/Base/Random.h"
#include "Testing/Benchmark.h"
#include "Tracking/Optical/LightTracker.h"
#include "Tracking/Optical/SimulatedCamera.h"
#include "Tracking/Optical/Testing/SpotPictures.h"
#include <cmath>
#include <memory>

#ifdef ECHORAMA_WITH_OPENCV
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#endif

using namespace echorama;
using namespace echorama::pictures;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

const double Frame = 1.0 / 90.0;

// A method: places of spots in a frame.
struct Method {
  std::string name;
  std::function<std::vector<Vector2d>(const Picture& picture, const LightsOffBackground* background)> find;
};

std::vector<Vector2d> PlacesOf(const SpotFrame& frame)
{
  std::vector<Vector2d> places;
  for (const Spot& spot : frame.spots)
    places.push_back(spot.position);
  return places;
}

#ifdef ECHORAMA_WITH_OPENCV
// The frame, less its background where there is one.
cv::Mat Difference(const Picture& picture, const LightsOffBackground* background)
{
  const cv::Mat image(picture.height, picture.width, CV_8UC1, const_cast<std::uint8_t*>(picture.pixels.data()));
  if (background == nullptr)
    return image;
  cv::Mat difference;
  cv::subtract(image, cv::Mat(picture.height, picture.width, CV_8UC1, const_cast<std::uint8_t*>(background->RoundedRow(0))),
               difference);
  return difference;
}
#endif

// \a threshold: of the methods that have but one, absolute where there is no background.
std::vector<Method> Methods(double threshold)
{
  SpotDetectorParameters centroid;
  centroid.method = SpotMethod::Centroid;
  centroid.threshold = threshold;
  const auto fit = std::make_shared<SpotDetector>();
  const auto mass = std::make_shared<SpotDetector>(centroid);
  std::vector<Method> methods{
      {"fit", [fit](const Picture& p, const LightsOffBackground* b) { return PlacesOf(fit->Detect(p.Frame(), b)); }},
      {"centroid (eq. 7.1)",
       [mass](const Picture& p, const LightsOffBackground* b) { return PlacesOf(mass->Detect(p.Frame(), b)); }}};
#ifdef ECHORAMA_WITH_OPENCV
  methods.push_back({"moments (OpenCV)", [threshold](const Picture& p, const LightsOffBackground* b) {
                       const cv::Mat difference = Difference(p, b);
                       cv::Mat mask, kept;
                       cv::threshold(difference, mask, threshold, 255, cv::THRESH_BINARY);
                       std::vector<std::vector<cv::Point>> contours;
                       cv::findContours(mask, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
                       std::vector<Vector2d> places;
                       for (const auto& contour : contours) {
                         if (contour.size() < 3)
                           continue;
                         const cv::Rect box = cv::boundingRect(contour);
                         const cv::Moments m = cv::moments(difference(box));
                         places.emplace_back(box.x + m.m10 / m.m00, box.y + m.m01 / m.m00);
                       }
                       return places;
                     }});
  cv::SimpleBlobDetector::Params blob;
  blob.blobColor = 255;
  blob.minThreshold = static_cast<float>(threshold);
  blob.maxThreshold = 250.0f;
  blob.thresholdStep = 20.0f;
  blob.minArea = 3.0f;
  blob.maxArea = 5000.0f;
  blob.filterByCircularity = blob.filterByConvexity = blob.filterByInertia = false;
  blob.minRepeatability = 1;
  const cv::Ptr<cv::SimpleBlobDetector> detector = cv::SimpleBlobDetector::create(blob);
  methods.push_back({"SimpleBlobDetector (OpenCV)", [detector](const Picture& p, const LightsOffBackground* b) {
                       std::vector<cv::KeyPoint> points;
                       detector->detect(Difference(p, b), points);
                       std::vector<Vector2d> places;
                       for (const cv::KeyPoint& point : points)
                         places.emplace_back(static_cast<double>(point.pt.x), static_cast<double>(point.pt.y));
                       return places;
                     }});
#endif
  return methods;
}

// Places of one spot, near \a spot's but between the pixels, in many pictures; the background, if any, is the mean of eight.
void Places(const std::string& name, int width, int height, const std::function<double(int, int)>& ground, PaintedSpot spot,
            double threshold, bool withBackground, double groundAtSpot)
{
  const int trials = benchmark::Trials(2000);
  std::vector<LightsOffBackground> backgrounds; // several: the noise of one would look like a bias
  for (std::uint64_t i = 0; withBackground && i < 20; ++i)
    backgrounds.push_back(Background(width, height, ground, 8, 100 * i + 1));
  std::vector<Picture> pictures;
  std::vector<Vector2d> truth;
  for (int trial = 0; trial < trials; ++trial) {
    Random random(77, static_cast<std::uint64_t>(trial));
    PaintedSpot here = spot;
    here.x += random.Uniform(-0.5, 0.5);
    here.y += random.Uniform(-0.5, 0.5);
    pictures.push_back(Paint(width, height, ground, {here}, 1000 + static_cast<std::uint64_t>(trial)));
    truth.emplace_back(here.x, here.y);
  }
  const double bound = CramerRao(spot, groundAtSpot, {});
  for (const Method& method : Methods(threshold)) {
    Vector2d bias = Vector2d::Zero();
    double squares = 0.0;
    int found = 0, others = 0;
    const double seconds = benchmark::Seconds([&] {
      for (std::size_t i = 0; i < pictures.size(); ++i)
        for (const Vector2d& place : method.find(pictures[i], withBackground ? &backgrounds[i % backgrounds.size()] : nullptr)) {
          const Vector2d error = place - truth[i];
          if (error.norm() > 4.0) {
            ++others;
            continue;
          }
          ++found;
          bias += error;
          squares += error.squaredNorm();
        }
    });
    if (found == 0)
      continue; // it says nothing of this case
    bias /= found;
    const double error = std::sqrt(0.5 * squares / found);
    benchmark::Report("spots", name, method.name, seconds / trials, error, "px",
                      {{"group", "places"},
                       {"bound", bound},
                       {"ratio", error / bound},
                       {"bias", bias.norm()},
                       {"found", found / static_cast<double>(trials)},
                       {"others", others / static_cast<double>(trials)}});
  }
}

void Times()
{
  const auto ground = [](int x, int y) { return 12.0 + 0.01 * x + 0.02 * y; };
  const LightsOffBackground background = Background(640, 480, ground, 8, 1);
  for (const int count : {0, 1, 4}) {
    std::vector<PaintedSpot> spots;
    for (int i = 0; i < count; ++i)
      spots.push_back({120.3 + 110.0 * i, 100.6 + 80.0 * i, 150.0, 2.0});
    const Picture picture = Paint(640, 480, ground, spots, 3);
    for (const Method& method : Methods(20.0)) {
      std::size_t found = 0;
      const double seconds = benchmark::MedianSeconds([&] { found = method.find(picture, &background).size(); }, 201);
      benchmark::ReportTime("spots", std::to_string(count) + " spots in 640 x 480", method.name, seconds,
                            {{"group", "times"}, {"found", found}});
    }
    if (count == 1) {
      SpotDetector fit;
      const double seconds = benchmark::MedianSeconds([&] { fit.Detect(picture.Frame()); }, 201);
      benchmark::ReportTime("spots", "1 spot in 640 x 480, no background", "fit", seconds, {{"group", "times"}, {"found", 1}});
    }
  }
}

// A shell with lights.
struct Rig {
  SimulatedCameraParameters camera;
  SpotTracksParameters tracks;
  DomeSurface dome{{110.0, 95.0, 90.0}};
  BlinkCode code;
  double phase = 0.0047, slot = Frame;

  Rig(int width, int height, int lights = 2) : code(BlinkCode::Make(lights, 2))
  {
    const double scale = width / 640.0;
    camera.lens.width = width;
    camera.lens.height = height;
    camera.lens.centreX = 0.5 * (width - 1);
    camera.lens.centreY = 0.5 * (height - 1);
    camera.lens.focal = 190.0 * scale;
    camera.spotMm = 1.2 / scale;
  }
  SimulatedLight Light(int index, const std::function<Vector2d(double)>& path, const std::function<double(double)>& peak) const
  {
    return {[this, path, peak](double t) {
              const Vector2d at = path(t);
              return LightOnSkin{*dome.Above(at.x(), at.y()), 0.0, peak(t)};
            },
            [this, index](double from, double to) { return code.OnShare(index, (from - phase) / slot, (to - phase) / slot); }};
  }
};

struct Tally {
  int frames = 0, visible = 0, reported = 0, wrong = 0, claims = 0, lost = 0;
  double seconds = 0.0;
};

// Lights that meet and part, are lifted off now and then, and lost frames; half of the sensor's rows, so that 10^5 frames take
// minutes.
// \param seed of the camera, and above 1 of paths and brightness
Tally Identities(Rig& rig, int frames, int count, std::uint64_t seed = 1)
{
  rig.camera.seed = seed;
  const SimulatedCamera camera(rig.camera, rig.dome, Pose::Identity());
  struct Way {
    double rateX, startX, rateY, startY, liftEvery, peak;
  };
  std::vector<Way> ways{{1.9, 0.0, 1.31, 1.0, 7.0, 160.0},
                        {1.13, 2.0, 1.73, 0.5 * M_PI, 11.0, 140.0},
                        {1.51, 0.3, 1.07, 2.2, 9.0, 150.0},
                        {1.27, 4.0, 1.83, 0.7, 13.0, 120.0}};
  Random random(99, seed);
  std::vector<SimulatedLight> lights;
  for (int i = 0; i < count; ++i) {
    Way& w = ways[static_cast<std::size_t>(i)];
    if (seed > 1)
      w = {random.Uniform(1.0, 2.0),  random.Uniform(0.0, 6.28), random.Uniform(1.0, 2.0),
           random.Uniform(0.0, 6.28), random.Uniform(6.0, 14.0), random.Uniform(110.0, 170.0)};
    lights.push_back(rig.Light(
        i, [w](double t) { return Vector2d(35.0 * std::sin(w.rateX * t + w.startX), 30.0 * std::sin(w.rateY * t + w.startY)); },
        [w](double t) { return std::fmod(t, w.liftEvery) < 0.5 ? 0.0 : w.peak; }));
  }
  LightTracker tracker({}, rig.tracks, rig.code);
  SimulatedFrame frame;
  Tally tally;
  const double near = 4.0 * rig.camera.lens.width / 640.0 + 2.0; // px: nearer than that it is no other's
  for (int n = 0; n < frames; ++n) {
    camera.Render(n, lights, frame);
    if (frame.isLost)
      continue;
    ++tally.frames;
    tally.seconds += benchmark::Seconds([&] { tracker.Update(frame.Grey(), frame.begin); });
    for (const TrackedLight& light : tracker.Lights()) {
      if (count > 0)
        tally.visible += frame.truth[static_cast<std::size_t>(light.light)].isVisible;
      if (light.status == TrackedLight::Status::Lost) {
        ++tally.lost;
        continue;
      }
      ++tally.reported;
      if (count == 0) {
        ++tally.claims;
        continue;
      }
      const LightTruth& truth = frame.truth[static_cast<std::size_t>(light.light)];
      if (light.status == TrackedLight::Status::Seen && !truth.isVisible)
        ++tally.claims;
      if (truth.isVisible && (light.position - truth.pixel).norm() > near)
        ++tally.wrong;
    }
  }
  return tally;
}

void ReportChain(const std::string& name, const Tally& tally)
{
  benchmark::ReportTime("spots", name, "chain", tally.seconds / std::max(tally.frames, 1),
                        {{"group", "chain"},
                         {"frames", tally.frames},
                         {"wrong", tally.wrong},
                         {"claims", tally.claims},
                         {"reported", tally.reported},
                         {"visible", tally.visible},
                         {"lost", tally.lost}});
}

// A tool at 200 mm/s on the skin, which a perfect calibration maps: how far off it is when the position is used.
void Latency()
{
  Rig rig(640, 480);
  const SimulatedCamera camera(rig.camera, rig.dome, Pose::Identity());
  const auto always = [](double) { return 160.0; };
  struct Path {
    std::string name;
    std::function<Vector2d(double)> at;
  };
  const auto circle = [](double radius) {
    return [=](double t) { return Vector2d(radius * std::cos(200.0 / radius * t), radius * std::sin(200.0 / radius * t)); };
  };
  // Of hands: a hand's tremor over strokes of least jerk with rests between, back and forth, braked within 30 ms, at rest.
  const auto tremor = [](double t) { return Vector2d(0.1 * std::sin(56.5 * t), 0.1 * std::cos(60.5 * t)); };
  const auto stroke = [](double t) {
    const auto corner = [](double n) { return Vector2d(35.0 * std::sin(2.4 * n), 30.0 * std::sin(1.7 * n + 1.0)); };
    const double n = std::floor(t / 0.9), s = std::min((t - 0.9 * n) / 0.65, 1.0);
    return Vector2d(corner(n) + (corner(n + 1.0) - corner(n)) * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s));
  };
  const auto braked = [](double t) {
    const double n = std::floor(t), u = t - n, w = std::clamp(u - 0.5, 0.0, 0.03);
    const double way = u < 0.1 ? 1000.0 * u * u : u < 0.5 ? 10.0 + 200.0 * (u - 0.1) : 90.0 + 200.0 * w - 3333.3 * w * w;
    return Vector2d(-46.0 + (std::fmod(n, 2.0) == 0.0 ? way : 93.0 - way), 10.0);
  };
  for (const Path& path :
       {Path{"200 mm/s on a circle of 25 mm", circle(25.0)}, Path{"200 mm/s on a circle of 50 mm", circle(50.0)},
        Path{"strokes and rests", [=](double t) { return Vector2d(stroke(t) + tremor(t)); }},
        Path{"back and forth, 2 Hz, 16 mm",
             [=](double t) { return Vector2d(Vector2d(16.0 * std::sin(12.57 * t), 0.0) + tremor(t)); }},
        Path{"back and forth, 4 Hz, 8 mm",
             [=](double t) { return Vector2d(Vector2d(8.0 * std::sin(25.13 * t), 0.0) + tremor(t)); }},
        Path{"200 mm/s, braked in 30 ms", [=](double t) { return Vector2d(braked(t) + tremor(t)); }},
        Path{"at rest", [=](double t) { return tremor(t); }}}) {
    const std::vector<SimulatedLight> lights{
        rig.Light(0, path.at, always),
        rig.Light(
            1, [=](double t) { return Vector2d(15.0 * std::cos(1.5 * t) + 60.0, -50.0 + 15.0 * std::sin(1.5 * t)); }, always)};
    LightTracker tracker({}, rig.tracks, rig.code);
    SimulatedFrame frame;
    std::vector<double> predicted, held, measured;
    double seconds = 0.0;
    const int frames = benchmark::Trials(2000) + 60;
    for (int n = 0; n < frames; ++n) {
      camera.Render(n, lights, frame);
      seconds += benchmark::Seconds([&] { tracker.Update(frame.Grey(), frame.begin); });
      const TrackedLight& light = tracker.Lights()[0];
      if (n < 60 || light.status == TrackedLight::Status::Lost)
        continue;
      const double used = frame.truth[0].time + rig.tracks.latencyMs * 1e-3;
      const Vector3d then = lights[0].place(used).point;
      const auto ahead = camera.SkinAt(rig.dome, light.predicted), now = camera.SkinAt(rig.dome, light.position);
      if (!ahead || !now)
        continue;
      predicted.push_back((ahead->point - then).norm());
      held.push_back((now->point - then).norm());
      if (light.status == TrackedLight::Status::Seen)
        measured.push_back((camera.SkinAt(rig.dome, light.spot.position)->point - frame.truth[0].light.point).norm());
    }
    if (predicted.empty())
      continue;
    const auto report = [&](const char* method, const std::vector<double>& errors) {
      benchmark::Report("spots", path.name, method, seconds / frames, Percentile(errors, 0.95), "mm",
                        {{"group", "latency"},
                         {"median", Percentile(errors, 0.5)},
                         {"largest", Percentile(errors, 1.0)},
                         {"said_rms_px", tracker.Tracks().Statistics().predictionRms},
                         {"positions", errors.size()}});
    };
    report("predicted", predicted);
    report("held", held);
    report("measured", measured);
  }
}

} // namespace

int main()
{
  const auto flat = [](int, int) { return 10.0; };
  for (const double peak : {20.0, 60.0, 120.0, 240.0})
    Places("peak " + std::to_string(static_cast<int>(peak)), 96, 96, flat, {48, 48, peak, 2.0}, 10.0, true, 10.0);
  Places("peak 900, saturated", 96, 96, flat, {48, 48, 900.0, 2.5}, 10.0, true, 10.0);
  // Without a background: the slope ends beside the spot, so that a threshold above it exists.
  const auto slope = [](int x, int) { return 20.0 + 1.5 * std::min(x, 58); };
  Places("slope 1.5 per pixel, no background", 96, 96, slope, {45, 45, 90.0, 2.5}, 110.0, false, 87.5);
  Places("slope 1.5 per pixel, background", 96, 96, slope, {45, 45, 90.0, 2.5}, 15.0, true, 87.5);
  const auto sun = [](int x, int) { return 15.0 + 330.0 / (1.0 + std::exp(-(x - 110.0) / 9.0)); };
  for (const double x : {84.0, 96.0, 104.0})
    Places("sunlight, " + std::to_string(static_cast<int>(118.5 - x)) + " px from where it saturates", 160, 96, sun,
           {x, 48, 150.0, 2.5}, 20.0, true, sun(static_cast<int>(x), 0));
  Times();
  Latency();

  {
    const ThreadLimit one(1); // the chain at full size, on one core
    Rig rig(640, 480);
    ReportChain("chain, two lights, 640 x 480", Identities(rig, benchmark::Trials(1500), 2));
  }
  struct Run {
    std::string name;
    int lights, frames;
    bool rolling;
    std::uint64_t seed;
  };
  for (const Run& run :
       {Run{"10^5 frames", 2, 100000, false, 1}, Run{"10^5 frames, rolling shutter", 2, 100000, true, 1},
        Run{"10^5 frames, other paths", 2, 100000, false, 2},
        Run{"10^5 frames, other paths, rolling shutter", 2, 100000, true, 3}, Run{"10^4 frames, four lights", 4, 10000, false, 1},
        Run{"10^4 frames, four lights, rolling shutter", 4, 10000, true, 2}}) {
    Rig rig(320, 240, run.lights);
    rig.camera.lostFrames = 0.01;
    rig.slot = Frame * (1.0 + 20e-6); // clocks that differ
    if (run.rolling) {
      rig.camera.rowUs = rig.tracks.rowUs = 45.0;
      rig.camera.exposureMs = rig.tracks.exposureMs = 5.0;
    }
    ReportChain(run.name, Identities(rig, benchmark::Trials(run.frames), run.lights, run.seed));
  }
  Rig dark(320, 240);
  dark.camera.hotPixels = 100;
  ReportChain("10^5 frames without a light", Identities(dark, benchmark::Trials(100000), 0));
}
