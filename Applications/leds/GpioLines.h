// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Optical/LightDriver.h"
#include <memory>
#include <string>
#include <vector>

namespace echorama {

/// Lines of one GPIO chip.
struct GpioPlace {
  std::string chip = "gpiochip0";
  std::vector<std::string> lines; ///< numbers on that chip, or names ("GPIO17"); those of the lights, then the trigger's
  bool activeLow = false;

  std::string Path() const; ///< of the chip's device
  /// \throws Error that says what is wrong, in the words of who has to put it right; \a error is an errno
  [[noreturn]] void FailChip(int error) const;
  [[noreturn]] void FailLines(int error) const;
  [[noreturn]] void FailTaken(const std::string& line, const char* consumer) const;
  /// Where each line is on the chip. \a offsetOf finds a name, or gives -1. \throws Error
  std::vector<unsigned> Offsets(unsigned count, const std::function<int(const char* name)>& offsetOf) const;
};

/// All of them as outputs, off, and off again before they are given back. There is one such function for each version of
/// libgpiod, and one for none. \throws Error
std::unique_ptr<LightLines> OpenGpioLines(const GpioPlace& place);
/// "libgpiod 1.6.3"
std::string GpioLibrary();

} // namespace echorama
