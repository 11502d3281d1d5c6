// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Cameras/CameraSource.h"
#include "Tracking/Devices/TrackerAddress.h"
#include "Tracking/Optical/BlinkCode.h"
#include "Tracking/Optical/SimulatedCamera.h"
#include <memory>
#include <string>
#include <vector>

namespace echorama {

/// How the lights of a simulated source go over the skin.
enum class SimulatedPath {
  Still,
  Circle,  ///< at constant speed, seen along the camera's axis
  Strokes, ///< to and fro, each by its own angle, with a rest at both ends
  Wander,  ///< as a hand that looks for something
};

struct SimulatedSourceParameters {
  SimulatedCameraParameters camera;
  std::string surface;    ///< a calibration: its skin and lights, and its camera as it has it
  bool calibrated = true; ///< off: the camera is as it says here, and only looks at that skin
  Eigen::Vector3d domeMm{110.0, 95.0, 90.0}, cameraMm = Eigen::Vector3d::Zero(), cameraTurn = Eigen::Vector3d::Zero();
  int lights = 2, offSlots = 2;
  double peak = 160.0;
  int deadLight = 0;
  SimulatedPath path = SimulatedPath::Circle;
  double radiusMm = 25.0, speedMmPerS = 100.0, liftEverySeconds = 0.0, clockPpm = 20.0;
  double speed = 1.0;
  int frames = 0;

  /// From the options of "simulated:?lights=2&path=circle&speedMmPerS=200". \throws Error(InvalidParameter)
  static SimulatedSourceParameters Of(const TrackerAddress& address);
  Pose CameraToShell() const;
  /// A light that blinks word \a index of the code from its own phase on, at \a place.
  SimulatedLight Light(int index, std::function<LightOnSkin(double)> place) const;
  BlinkCode Code() const { return BlinkCode::Make(lights, offSlots); }
};
ParameterList Describe(SimulatedSourceParameters& p);

/// Frames of a SimulatedCamera, when a real one would deliver them, or as fast as they are asked for (speed 0).
class SimulatedSource : public CameraSource {
public:
  /// Lights on paths over a dome, or over the skin of a calibration. \throws Error(InvalidParameter), Error(NotPossible) when the
  /// camera sees none of it; as ReadSurface
  explicit SimulatedSource(const SimulatedSourceParameters& parameters);
  /// Any skin, and any lights; their times count from the first frame on. Of the parameters those of the camera, its pose, speed
  /// and the number of frames are used.
  SimulatedSource(const SimulatedSourceParameters& parameters, std::shared_ptr<const SeenSurface> skin,
                  std::vector<SimulatedLight> lights);

  CameraFormat Open() override;
  Outcome Next(CameraFrame& frame, double seconds) override;
  void Close() override {}
  bool IsLive() const override { return parameters_.speed > 0.0; }
  std::int64_t Lost() const override { return lost_; }

  /// What is true of the newest frame: one entry per light. Its times count from the first frame on.
  const std::vector<LightTruth>& Truth() const { return frame_.truth; }
  /// The truth of any moment, seconds from the first frame on.
  LightOnSkin LightAt(int light, double time) const { return lights_[static_cast<std::size_t>(light)].place(time); }
  int Lights() const { return static_cast<int>(lights_.size()); }
  /// The same, of a time on the clock of frames.
  LightOnSkin TruthAt(int light, double time) const
  {
    return LightAt(light, IsLive() ? (time - start_) * parameters_.speed : time);
  }
  /// Of the first frame, on the clock of frames. What is at the time t of theirs is the truth of (t - Start()) * speed (unless
  /// 0).
  double Start() const { return start_; }
  const SeenSurface& Skin() const { return *skin_; }
  const SimulatedCamera& Camera() const { return camera_; }

private:
  struct Scene {
    SimulatedSourceParameters parameters;
    std::shared_ptr<const SeenSurface> skin;
  };
  explicit SimulatedSource(const Scene& scene);
  static Scene SceneOf(SimulatedSourceParameters parameters);
  double Due(std::int64_t number) const; // when it is delivered, on our clock

  SimulatedSourceParameters parameters_;
  std::shared_ptr<const SeenSurface> skin_;
  std::vector<SimulatedLight> lights_;
  SimulatedCamera camera_;
  SimulatedFrame frame_;
  std::int64_t number_ = 0, rendered_ = -1, lost_ = 0;
  double start_ = 0.0;
};

} // namespace echorama
