// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Pictures of Gaussian spots over a background, with noise, and how well their places can be known at best.
#include "Core/Base/Random.h"
#include "Tracking/Optical/BrightnessCalibration.h"
#include "Tracking/Optical/SpotDetector.h"
#include <algorithm>
#include <cmath>
#include <Eigen/LU>
#include <functional>
#include <vector>

namespace echorama::pictures {

struct Picture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
  GreyFrame Frame() const { return GreyFrame::Mono(pixels.data(), width, height); }
};

struct PaintedSpot {
  double x = 0.0, y = 0.0, peak = 0.0, size = 2.0, sizeY = 0.0; // sizeY 0: round
  double At(double px, double py) const
  {
    const double dx = (px - x) / size, dy = (py - y) / (sizeY > 0.0 ? sizeY : size);
    return peak * std::exp(-0.5 * (dx * dx + dy * dy));
  }
};

inline Picture Paint(int width, int height, const std::function<double(int, int)>& background,
                     const std::vector<PaintedSpot>& spots, std::uint64_t seed, const PixelNoise& noise = {})
{
  Picture picture{width, height, std::vector<std::uint8_t>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height))};
  for (int y = 0; y < height; ++y) {
    Random random(seed, static_cast<std::uint64_t>(y));
    for (int x = 0; x < width; ++x) {
      double grey = background(x, y);
      for (const PaintedSpot& spot : spots)
        grey += spot.At(x, y);
      grey += std::sqrt(noise.readNoise * noise.readNoise + noise.greyPerElectron * std::max(grey, 0.0)) * random.Normal();
      picture.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] =
          static_cast<std::uint8_t>(std::clamp(std::lround(grey), 0L, 255L));
    }
  }
  return picture;
}

/// The least standard deviation (root mean of both axes) of any unbiased estimate of a round spot's place in one frame, whose
/// background is known, with peak and size unknown; pixels that would be above \a saturation tell nothing.
inline double CramerRao(const PaintedSpot& spot, double background, const PixelNoise& noise, double saturation = 255.0)
{
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  const int reach = static_cast<int>(std::ceil(8.0 * spot.size));
  const int middleX = static_cast<int>(spot.x), middleY = static_cast<int>(spot.y);
  for (int y = middleY - reach; y <= middleY + reach; ++y)
    for (int x = middleX - reach; x <= middleX + reach; ++x) {
      const double light = spot.At(x, y), dx = x - spot.x, dy = y - spot.y, squared = spot.size * spot.size;
      if (light + background >= saturation)
        continue;
      const Eigen::Vector4d derivative(light * dx / squared, light * dy / squared, light / spot.peak,
                                       light * (dx * dx + dy * dy) / (squared * spot.size));
      information += derivative * derivative.transpose() / noise.Variance(light + background);
    }
  const Eigen::Matrix4d covariance = information.inverse();
  return std::sqrt(0.5 * (covariance(0, 0) + covariance(1, 1)));
}

/// The mean of \a frames pictures without spots.
inline LightsOffBackground Background(int width, int height, const std::function<double(int, int)>& background, int frames,
                                      std::uint64_t seed, const PixelNoise& noise = {})
{
  LightsOffBackground mean(1.0 / frames);
  for (int i = 0; i < frames; ++i)
    mean.Add(Paint(width, height, background, {}, seed + static_cast<std::uint64_t>(i), noise).Frame());
  return mean;
}

} // namespace echorama::pictures
