// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Geometry/RigidTransform.h"
#include "Tracking/Optical/FisheyeLens.h"
#include "Tracking/Optical/GreyFrame.h"
#include "Tracking/Optical/SeenSurface.h"
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace echorama {

/// A camera inside a shell that does not exist, with the faults of those that do.
struct SimulatedCameraParameters {
  FisheyeLens lens;
  double frameRate = 90.0, exposureMs = 8.0;
  double rowUs = 0.0;
  double latencyMs = 11.0;
  double lostFrames = 0.0;
  double readNoise = 1.0, greyPerElectron = 0.05;
  double dark = 4.0, ambient = 12.0, slope = 0.0;
  double sunShare = 0.0, sunEdge = 0.05;
  int hotPixels = 30;
  double vignetting = 0.5;
  std::string marker;
  double spotMm = 1.2, spreadPerMm = 0.6, fadeMm = 4.0, halo = 0.05;
  std::uint64_t seed = 1;
};
ParameterList Describe(SimulatedCameraParameters& p);

/// A tool's light at the skin.
struct LightOnSkin {
  Eigen::Vector3d point = Eigen::Vector3d::Zero(); ///< of the skin, that it touches or is nearest to, mm
  double hoverMm = 0.0;                            ///< how far it is from the skin
  double peak =
      150.0; ///< grey levels at the middle of its spot when it touches, seen along the axis, on for the whole exposure; 0: away
};

/// A light that moves and blinks; both functions must answer the same to the same question.
struct SimulatedLight {
  std::function<LightOnSkin(double time)> place;
  std::function<double(double from, double to)> onShare; ///< of that time in which it is on; empty: always
};

/// What is true of one light in one frame.
struct LightTruth {
  bool isVisible = false;                          ///< the camera sees that part of the skin
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero(); ///< where the middle of its spot is
  double onShare = 0.0;                            ///< of the exposure of its row
  double time = 0.0;                               ///< the middle of that exposure, s
  LightOnSkin light;                               ///< then
};

struct SimulatedFrame {
  std::vector<std::uint8_t> pixels;
  int width = 0, height = 0;
  double begin = 0.0;     ///< of the exposure of its first row, on the camera's clock, s
  double delivered = 0.0; ///< when the host has it, s
  bool isLost = false;    ///< the host never gets it
  std::vector<LightTruth> truth;

  GreyFrame Grey() const { return GreyFrame::Mono(pixels.data(), width, height); }
};

/// Renders what it sees: skin in the light of the room and of the sun, and lights through the skin, which diffuses them the more
/// the further they are from it. A frame depends on parameters, lights and its number alone, not on the number of threads.
class SimulatedCamera {
public:
  /// The camera looks along +z of its own frame; the skin is where \a cameraToShell has it.
  /// \throws Error(InvalidParameter), Error(NotPossible) when it sees nothing of the skin
  SimulatedCamera(const SimulatedCameraParameters& parameters, const SeenSurface& skin, const Pose& cameraToShell);

  void Render(std::int64_t number, const std::vector<SimulatedLight>& lights, SimulatedFrame& frame) const;

  /// The place of the skin that a pixel shows: what a perfect calibration would say. \a skin must be the same.
  std::optional<SeenSurface::Hit> SkinAt(const SeenSurface& skin, const Eigen::Vector2d& pixel) const;
  double FrameSeconds() const { return 1.0 / parameters_.frameRate; }
  /// Mean grey level without lights or noise.
  float Ambient(int x, int y) const { return ambient_[Index(x, y)]; }

private:
  std::size_t Index(int x, int y) const
  {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(parameters_.lens.width) + static_cast<std::size_t>(x);
  }
  double RowBegin(std::int64_t number, double row) const;
  // Where a point of the shell is in the picture, whether or not skin hides it.
  std::optional<Eigen::Vector2d> PixelOf(const Eigen::Vector3d& point) const;
  LightTruth TruthOf(std::int64_t number, const SimulatedLight& light) const;
  void AddLight(std::int64_t number, const SimulatedLight& light, const LightTruth& truth, std::vector<float>& grey) const;

  SimulatedCameraParameters parameters_;
  Pose shellToCamera_;
  std::vector<Eigen::Vector3f> points_; // of the skin, by pixel, in the shell's frame; not finite: none
  std::vector<float> falloff_, ambient_;
  struct HotPixel {
    std::size_t index;
    float level;
    bool blinks;
  };
  std::vector<HotPixel> hotPixels_;
};

} // namespace echorama
