// SPDX-License-Identifier: BSD-3-Clause
// The whole optical tracker, from frames to poses on a printed skin: its CPU time per frame, and how far tools are from where
// they are told, at the moment they are told for, with a camera that was calibrated by marks as a person would touch them.
#include "Core/Base/Percentile.h"
#include "Testing/Benchmark.h"
#include "Tracking/Cameras/SimulatedSource.h"
#include "Tracking/Devices/OpticalTracker.h"
#include "Tracking/Optical/Testing/SurfaceTruth.h"
#include <ctime>

using namespace echorama;
using Eigen::Vector3d;

namespace {

// Frames that were rendered before, so that rendering is not measured.
struct Film {
  CameraFormat format;
  struct Frame {
    std::vector<std::uint8_t> pixels;
    double begin, arrival;
    std::int64_t number;
  };
  std::vector<Frame> frames;
};

class FilmSource : public CameraSource {
public:
  explicit FilmSource(const Film& film) : film_(film) {}
  CameraFormat Open() override
  {
    next_ = 0;
    return film_.format;
  }
  Outcome Next(CameraFrame& frame, double) override
  {
    if (next_ == film_.frames.size())
      return Outcome::Ended;
    const Film::Frame& f = film_.frames[next_++];
    frame = {GreyFrame::Mono(f.pixels.data(), film_.format.width, film_.format.height), f.begin, f.arrival, f.number};
    return Outcome::Frame;
  }
  void Close() override {}
  bool IsLive() const override { return false; }
  std::int64_t Lost() const override { return 0; }

private:
  const Film& film_;
  std::size_t next_ = 0;
};

CalibratedSurface Calibrate(const SimulatedSourceParameters& p, const std::shared_ptr<const TrackedSkin>& skin)
{
  truth::TrueCamera camera;
  camera.lens = p.camera.lens;
  camera.cameraToShell = p.CameraToShell();
  FisheyeLens nominal = p.camera.lens;
  nominal.focal *= 1.03;
  Pose roughly = p.CameraToShell();
  roughly.translation() += Vector3d(2.0, -1.0, 1.5);
  CalibratedSurface made;
  made.map = FitSurfaceMap(truth::Observe(camera, *skin, 150, 75.0, 0.02, 0.15, 5), skin, nominal, roughly).map;
  made.lights.lights = p.lights;
  made.tracks.frameMs = made.tracks.slotMs = 1000.0 / p.camera.frameRate;
  made.tracks.exposureMs = p.camera.exposureMs;
  return made;
}

void Follow(const std::string& name, const std::string& options, const std::shared_ptr<const TrackedSkin>& skin)
{
  SimulatedSourceParameters p =
      SimulatedSourceParameters::Of(TrackerAddress::Parse("simulated:?speed=0&cameraTurn=0 0 20&" + options));
  p.frames = benchmark::Trials(900) + 120;
  const SimulatedSource paths(p); // over a dome of the same size
  std::vector<SimulatedLight> lights;
  for (int i = 0; i < p.lights; ++i)
    lights.push_back(p.Light(i, [&paths, &skin, i](double time) {
      LightOnSkin light = paths.LightAt(i, time);
      light.point = skin->NearestTo(light.point)->point;
      return light;
    }));
  SimulatedSource source(p, skin, lights);
  Film film;
  film.format = source.Open();
  for (CameraFrame frame; source.Next(frame, 0.0) == CameraSource::Outcome::Frame;)
    film.frames.push_back({{frame.grey.data, frame.grey.data + static_cast<std::ptrdiff_t>(frame.grey.width) * frame.grey.height},
                           frame.begin,
                           frame.arrival,
                           frame.number});

  std::vector<OpticalView> views;
  views.push_back({std::make_unique<FilmSource>(film), Calibrate(p, skin), "bench"});
  OpticalTrackerParameters parameters;
  OpticalTracker tracker(parameters, std::move(views));
  PoseStream stream;
  const auto all = stream.Subscribe(1 << 20);
  const std::clock_t begun = std::clock();
  tracker.Start(stream, nullptr);
  stream.WaitForPoses(~0ull, 600.0); // until it has ended
  const double cpu = static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC / static_cast<double>(film.frames.size());
  tracker.Stop();

  std::vector<double> errors;
  std::size_t poses = 0, valid = 0;
  for (const ToolPose& pose : all->Take()) {
    const int light = pose.name == "ProbeToTracker"    ? 0
                      : pose.name == "NeedleToTracker" ? 1
                      : pose.name == "Tool3ToTracker"  ? 2
                                                       : 3;
    if (pose.time < 1.0)
      continue;
    ++poses;
    if (pose.status != TransformStatus::Valid)
      continue;
    ++valid;
    errors.push_back((pose.pose.translation() - source.LightAt(light, pose.time).point).norm());
  }
  if (errors.empty())
    return;
  benchmark::Report("optical_tracker", name, "optical", cpu, Percentile(errors, 0.95), "mm",
                    {{"median", Percentile(errors, 0.5)},
                     {"largest", Percentile(errors, 1.0)},
                     {"core_share", cpu * p.camera.frameRate},
                     {"valid_share", static_cast<double>(valid) / static_cast<double>(poses)},
                     {"frames", film.frames.size()},
                     {"message", stream.State().second}});
}

} // namespace

int main()
{
  const auto skin = std::make_shared<const TrackedSkin>(truth::Ellipsoid({110.0, 95.0, 90.0}, 7));
  Follow("two lights at rest", "path=still", skin);
  Follow("two lights, strokes of 50 mm, 100 mm/s", "path=strokes&speedMmPerS=100", skin);
  Follow("two lights, circles of 25 mm, 200 mm/s", "path=circle&speedMmPerS=200", skin);
  Follow("two lights, wandering", "path=wander&speedMmPerS=60", skin);
  Follow("four lights, wandering", "path=wander&speedMmPerS=60&lights=4&radiusMm=15", skin);
  return 0;
}
