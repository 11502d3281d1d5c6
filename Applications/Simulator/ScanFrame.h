// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/RigidTransform.h"
#include "Filters/Live/Needle.h"
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace echorama {

/// The controls of the scanner, by name, as text that gives them back to the last bit.
using ScanSettings = std::vector<std::pair<std::string, std::string>>;

/// Everything that an image of a given body depends on: the image can be made again from it, to the last bit. So nothing keeps
/// pixels.
struct ScanFrame {
  double seconds = 0.0; ///< since the scan began
  Pose probeToWorld = Pose::Identity();
  std::int64_t number = 0; ///< chooses the noise, where that moves
  bool isInAir = false;
  bool isFlipped = false; ///< left and right are exchanged
  std::optional<Needle> needle;
  std::shared_ptr<const ScanSettings> settings;
};

/// The frames of the last seconds, the oldest first.
class CineLoop {
public:
  explicit CineLoop(double seconds = 30.0, std::size_t mostFrames = 4000) : seconds_(seconds), mostFrames_(mostFrames) {}

  void Add(const ScanFrame& frame)
  {
    frames_.push_back(frame);
    while (frames_.size() > mostFrames_ || frames_.front().seconds < frame.seconds - seconds_)
      frames_.pop_front();
  }
  void Clear() { frames_.clear(); }
  int Count() const { return static_cast<int>(frames_.size()); }
  const ScanFrame& At(int i) const { return frames_[static_cast<std::size_t>(i)]; }

private:
  double seconds_;
  std::size_t mostFrames_;
  std::deque<ScanFrame> frames_;
};

} // namespace echorama
