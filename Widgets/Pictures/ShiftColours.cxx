// SPDX-License-Identifier: BSD-3-Clause
// Cells of a map are many pixels wide, so a pixel takes the value between cells (trilinear through those that are known) of the
// middle of its square of 3 x 3: at a ninth of the cost nothing is seen of it. Rows of squares are independent.
#include "ShiftColours.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/Sampling.h"
#include <algorithm>
#include <cmath>

namespace echorama {

std::array<double, 3> ShiftColour(double share)
{
  constexpr std::array<std::array<double, 3>, 5> stops{
      {{0.16, 0.10, 0.60}, {0.55, 0.10, 0.65}, {0.85, 0.28, 0.45}, {0.98, 0.60, 0.22}, {0.98, 0.96, 0.25}}};
  const double at = std::clamp(share, 0.0, 1.0) * (stops.size() - 1);
  const auto first = std::min(static_cast<std::size_t>(at), stops.size() - 2);
  const double t = at - static_cast<double>(first);
  std::array<double, 3> colour{};
  for (std::size_t c = 0; c < 3; ++c)
    colour[c] = (1.0 - t) * stops[first][c] + t * stops[first + 1][c];
  return colour;
}

void LayShifts(const PosedVolume<float>& map, double mostMm, double opacity, const SlicePlane& plane, std::uint8_t* rgba)
{
  constexpr int square = 3;
  const Sampler<float> sampler(map.intensity, map.valid);
  const Eigen::Affine3d toIndex = map.geometry.WorldToIndex();
  const Eigen::Vector3d origin = toIndex * plane.origin, right = toIndex.linear() * plane.right, up = toIndex.linear() * plane.up;
  const int over = static_cast<int>(std::lround(256.0 * std::clamp(opacity, 0.0, 1.0)));
  ParallelFor((plane.height + square - 1) / square, [&](std::ptrdiff_t row) {
    const int bottom = static_cast<int>(row) * square, top = std::min(bottom + square, plane.height);
    for (int left = 0; left < plane.width; left += square) {
      const Eigen::Vector3d at = origin + (left + 1) * right + (bottom + 1) * up;
      double mm = 0.0;
      if (!sampler.Linear(at.x(), at.y(), at.z(), mm))
        continue;
      int colour[3];
      const std::array<double, 3> rgb = ShiftColour(mm / mostMm);
      for (std::size_t c = 0; c < 3; ++c)
        colour[c] = static_cast<int>(std::lround(255.0 * rgb[c]));
      for (int y = bottom; y < top; ++y)
        for (int x = left; x < std::min(left + square, plane.width); ++x) {
          std::uint8_t* pixel = rgba + 4 * (static_cast<std::ptrdiff_t>(y) * plane.width + x);
          if (pixel[3] == 0)
            continue;
          for (int c = 0; c < 3; ++c)
            pixel[c] = static_cast<std::uint8_t>(((256 - over) * pixel[c] + over * colour[c]) >> 8);
        }
    }
  });
}

} // namespace echorama
