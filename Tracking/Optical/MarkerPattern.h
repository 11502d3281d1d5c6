// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace echorama {

/// A number of 24 bits as light and dark cells that a camera inside a printed skin sees around its foot. Cells are directions,
/// not places: azimuth about the camera's axis, and elevation above the plane across it. So a reader need not know the skin.
///
/// Two cells, one above the other, are one bit, told by which of both is darker: whatever lights the skin lights both alike.
/// The columns at both ends are always the same; of those between, half the bits are a checksum.
struct MarkerPattern {
  static constexpr int rows = 6, columns = 19; ///< rows from below, columns counter-clockwise about the camera's axis
  static constexpr int pairs = rows / 2;
  static constexpr double cellDegrees = 2.0, lowestDegrees = 6.0;

  using Bits = std::array<std::array<bool, columns>, pairs>;
  Bits bits{}; ///< true: the lower cell of the two is dark

  /// \param id below 2^24 \throws Error(InvalidParameter)
  static MarkerPattern Of(std::uint32_t id);
  /// Whether a column is one of those that are always the same.
  static bool IsFixed(int column) { return column < 2 || column == columns - 1; }
  bool IsDark(int row, int column) const;
  /// The number, unless the checksum or a fixed column is wrong.
  std::optional<std::uint32_t> Id() const;
};

/// The cyclic redundancy check of 24 bits of RFC 4880, 6.1.
std::uint32_t Crc24(std::string_view bytes);

} // namespace echorama
