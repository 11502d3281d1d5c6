// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Worker.h"
#include "Tracking/Cameras/CameraSource.h"
#include "Tracking/Devices/TrackerAddress.h"
#include "Tracking/Devices/TrackerDevice.h"
#include "Tracking/Optical/SurfaceFile.h"
#include <memory>
#include <string>
#include <vector>

namespace echorama {

struct OpticalTrackerParameters {
  std::vector<TrackerAddress> cameras;
  std::string shell, mounted, tools = "Probe,Needle", film;
  double predictMs = -1.0, pictureRate = 0.0;
  bool truth = false; ///< also where simulated lights truly are

  /// From "optical:CAMERA?shell=FILE&OPTION=VALUE", with the options of the camera among them, or "optical:CAMERA,CAMERA?shell=
  /// FILE,FILE". \throws Error(InvalidParameter)
  static OpticalTrackerParameters Of(const TrackerAddress& address);
};
ParameterList Describe(OpticalTrackerParameters& p);

/// A camera, and the skin that it was calibrated with.
struct OpticalView {
  std::unique_ptr<CameraSource> camera;
  CalibratedSurface surface;
  std::string name; ///< for messages
};

/// Tools with blinking lights in their tips on a printed skin, seen by a camera inside it (dissertation chapter 7): each light is
/// a tool. Its place is that of the skin where the light is, its z axis looks into the skin, along the normal; how it is turned
/// about that axis is not known.
///
/// A light that hovers is out of range; one that is not seen, or where the calibration does not reach, is missing. With several
/// cameras, places that agree are averaged by their variances; of those that do not, the surest counts.
class OpticalTracker : public TrackerDevice {
public:
  static constexpr const char* Scheme = "optical";

  /// \throws Error(InvalidParameter)
  explicit OpticalTracker(const OpticalTrackerParameters& parameters);
  /// The same with views that are there; of the parameters those of cameras and shell are not used.
  OpticalTracker(const OpticalTrackerParameters& parameters, std::vector<OpticalView> views);
  ~OpticalTracker() override;

  /// \throws as ReadSurface and CameraSource::Open; Error(BadInput) for another size of pictures, or another shell, than
  /// calibrated
  void Start(PoseStream& poses, ImageStream* images) override;
  void Stop() override;

private:
  struct View;
  struct Tool;
  struct Filming;
  void OpenViews();
  void Run(const Worker::Signal& signal, PoseStream& poses);
  void Use(View& view, const CameraFrame& frame, PoseStream& poses);
  void TellTruth(const View& view, double time, PoseStream& poses) const;
  MappedPoint PlaceOf(std::size_t light, double time, Touch& touch);
  void Measure(View& view, const TrackedLight& light);
  std::pair<DeviceState, std::string> StateNow() const;
  std::string Complaint() const;

  OpticalTrackerParameters parameters_;
  std::vector<OpticalView> given_;
  std::vector<std::unique_ptr<View>> views_;
  std::vector<Tool> tools_;
  std::unique_ptr<Filming> film_;
  Worker worker_;
  bool isLive_ = true;
  double sent_ = 0.0; // time of the newest poses
  std::int64_t disagreements_ = 0;
  ImageStream* images_ = nullptr;
  double shown_ = 0.0; // begin of the newest frame that went to them
};

} // namespace echorama
