// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <cstddef>
#include <string>

namespace echorama {

/// How the axes of a file's frames lie in MF orientation.
///
/// An orientation code names, axis by axis of the file, the direction in which it runs: M towards the marked side of the
/// probe, U away from it, F away from the probe, N towards it, A and D along the sweep. Every code is a permutation with
/// signs. A code of two letters leaves the third axis to be right-handed.
struct FrameOrientation {
  std::array<int, 3> axis{0, 1, 2}; ///< of the file, for each axis in memory
  std::array<bool, 3> flip{};       ///< for each axis in memory

  bool IsIdentity() const { return axis == std::array<int, 3>{0, 1, 2} && flip == std::array<bool, 3>{}; }

  /// Takes a code in capitals; an empty one and XX are MF. \returns false for one that is none.
  bool Parse(const std::string& code);

  /// Turns a frame of \a size (in memory) with pixels of \a pixelBytes: 1 to 4 numbers of 1, 2, 4 or 8 bytes.
  void Turn(std::size_t pixelBytes, const std::array<int, 3>& size, const char* in, char* out) const;
};

} // namespace echorama
