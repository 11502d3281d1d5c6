// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Optical/GreyFrame.h"
#include <vector>

namespace echorama {

/// What a camera sees while all lights are off: a running mean, row by row, because with a rolling shutter not all rows of a
/// frame see the same moment.
class LightsOffBackground {
public:
  /// A new frame counts for \a newest once there are 1 / newest of them: 1 keeps the last alone. \throws Error(InvalidParameter)
  explicit LightsOffBackground(double newest = 0.2);

  /// Takes the rows [\a beginRow, \a endRow) of a frame. One of another size starts anew. \throws Error(InvalidParameter) for
  /// rows that it does not have
  void Add(const GreyFrame& frame, int beginRow, int endRow);
  void Add(const GreyFrame& frame) { Add(frame, 0, frame.height); }
  void Clear();

  /// Whether every row has been seen.
  bool IsComplete() const { return unseenRows_ == 0 && height_ > 0; }
  bool Fits(const GreyFrame& frame) const { return frame.width == width_ && frame.height == height_; }
  float At(int x, int y) const { return mean_[Index(x, y)]; }
  const std::uint8_t* RoundedRow(int y) const { return rounded_.data() + Index(0, y); }
  /// Variance of a row's mean over that of one frame.
  double NoiseShare(int y) const { return noiseShare_[static_cast<std::size_t>(y)]; }

private:
  std::size_t Index(int x, int y) const
  {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }

  double newest_;
  int width_ = 0, height_ = 0, unseenRows_ = 0;
  std::vector<float> mean_;
  std::vector<std::uint8_t> rounded_;
  std::vector<int> counts_; // of frames, per row
  std::vector<double> noiseShare_;
};

} // namespace echorama
