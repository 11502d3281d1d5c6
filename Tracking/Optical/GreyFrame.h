// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstddef>
#include <cstdint>

namespace echorama {

/// One picture of a camera, 8 bits, that lies somewhere else: a monochrome one, or one channel of a coloured one. Pixel (x, y)
/// has its centre at these coordinates.
struct GreyFrame {
  const std::uint8_t* data = nullptr;
  int width = 0, height = 0;
  std::ptrdiff_t rowStep = 0; ///< bytes from a row to the next
  int pixelStep = 1;          ///< bytes from a pixel to the next

  static GreyFrame Mono(const std::uint8_t* data, int width, int height) { return {data, width, height, width, 1}; }
  /// Of three interleaved channels, RGB or BGR; the green one, as in dissertation 7.5.
  static GreyFrame Green(const std::uint8_t* rgb, int width, int height)
  {
    return {rgb + 1, width, height, static_cast<std::ptrdiff_t>(width) * 3, 3};
  }

  std::uint8_t operator()(int x, int y) const { return data[y * rowStep + static_cast<std::ptrdiff_t>(x) * pixelStep]; }
};

} // namespace echorama
