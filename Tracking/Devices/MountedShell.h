// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Optical/BlinkCode.h"
#include "Tracking/Optical/ShellMarker.h"
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace echorama {

/// Which shell a camera is in, by the marker that its frames show, while lights of tools may move and blink: of every pixel the
/// darkest moment of a turn of their code counts, in which each of them was off, and the mean of some turns.
class MountedShell {
public:
  static constexpr int Tries = 8; ///< then it is given up

  /// \param lens as well as it is known: to a few percent \param turnFrames in so many frames each light is off at least once
  /// \throws Error(InvalidParameter)
  MountedShell(const FisheyeLens& lens, int turnFrames);

  static int TurnFrames(const BlinkCode& code, double slotMs, double frameMs);

  /// The next frame; one of another size than the lens's begins anew. \returns once, the marker as soon as it is read; or, after
  /// all tries, what was seen instead: nothing, or one that cannot be read.
  std::optional<ShellMarkerReading> Add(const GreyFrame& frame);

private:
  void Begin();
  ShellMarkerReading Read() const;

  FisheyeLens lens_;
  int turnFrames_, turns_;
  int frames_ = 0, tries_ = 0;
  std::vector<std::uint8_t> darkest_; // of this turn
  std::vector<std::uint32_t> sum_;    // of those before
  bool isUnclear_ = false;            // a marker was seen in one of the tries
};

/// What the marker says, as it is written in a calibration: "0A1B2C". For one that was read.
std::string ShellNameOf(const ShellMarkerReading& marker);
/// Whether a name, in capitals or not, is that of the marker.
bool IsNameOf(const std::string& name, const ShellMarkerReading& marker);

} // namespace echorama
