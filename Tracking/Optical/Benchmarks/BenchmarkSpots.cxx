// SPDX-License-Identifier: BSD-3-Clause
// Lights in the pictures of a camera inside a shell: how well places are found beside the Cramer-Rao bound, eq. 7.1 of the
// dissertation and OpenCV; what slopes and sunlight do to each; time per frame; and the whole chain against the truth of the
// simulated camera: whose light it is, what is claimed without a light, and how far off positions are that are predicted.
#include "Core/Base/Parallel.h"
#include "Core/Base/Percentile.h"
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

// A shell with two lights.
struct Rig {
  SimulatedCameraParameters camera;
  SpotTracksParameters tracks;
  DomeSurface dome{{110.0, 95.0, 90.0}};
  BlinkCode code = BlinkCode::Make(2, 2);
  double phase = 0.0047, slot = Frame;

  explicit Rig(int width, int height)
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
  int frames = 0, reported = 0, wrong = 0, claims = 0, lost = 0;
  double seconds = 0.0;
};

// Lights that meet and part, are lifted off now and then, and lost frames; half of the sensor's rows, so that 10^5 frames take
// minutes.
Tally Identities(Rig& rig, int frames, bool withLights)
{
  const SimulatedCamera camera(rig.camera, rig.dome, Pose::Identity());
  std::vector<SimulatedLight> lights;
  if (withLights) {
    lights.push_back(rig.Light(
        0, [](double t) { return Vector2d(35.0 * std::sin(1.9 * t), 30.0 * std::sin(1.31 * t + 1.0)); },
        [](double t) { return std::fmod(t, 7.0) < 0.5 ? 0.0 : 160.0; }));
    lights.push_back(rig.Light(
        1, [](double t) { return Vector2d(35.0 * std::sin(1.13 * t + 2.0), 30.0 * std::cos(1.73 * t)); },
        [](double t) { return std::fmod(t, 11.0) < 0.5 ? 0.0 : 140.0; }));
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
      if (light.status == TrackedLight::Status::Lost) {
        ++tally.lost;
        continue;
      }
      ++tally.reported;
      if (!withLights) {
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
                         {"lost", tally.lost}});
}

// A tool at 200 mm/s on the skin, which a perfect calibration maps: how far off it is when the position is used.
void Latency()
{
  Rig rig(640, 480);
  const SimulatedCamera camera(rig.camera, rig.dome, Pose::Identity());
  const auto always = [](double) { return 160.0; };
  for (const double radius : {25.0, 50.0}) {
    const double rate = 200.0 / radius;
    const std::vector<SimulatedLight> lights{
        rig.Light(
            0, [=](double t) { return Vector2d(radius * std::cos(rate * t), radius * std::sin(rate * t)); }, always),
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
    const std::string name = "200 mm/s on a circle of " + std::to_string(static_cast<int>(radius)) + " mm";
    const auto report = [&](const char* method, const std::vector<double>& errors) {
      benchmark::Report("spots", name, method, seconds / frames, Percentile(errors, 0.95), "mm",
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
    ReportChain("chain, two lights, 640 x 480", Identities(rig, benchmark::Trials(1500), true));
  }
  for (const bool rolling : {false, true}) {
    Rig rig(320, 240);
    rig.camera.lostFrames = 0.01;
    rig.slot = Frame * (1.0 + 20e-6); // clocks that differ
    if (rolling) {
      rig.camera.rowUs = rig.tracks.rowUs = 45.0;
      rig.camera.exposureMs = rig.tracks.exposureMs = 5.0;
    }
    ReportChain(rolling ? "10^5 frames, rolling shutter" : "10^5 frames", Identities(rig, benchmark::Trials(100000), true));
  }
  Rig dark(320, 240);
  dark.camera.hotPixels = 100;
  ReportChain("10^5 frames without a light", Identities(dark, benchmark::Trials(100000), false));
}
