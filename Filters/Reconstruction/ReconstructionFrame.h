// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Reconstruction/VolumeReconstruction.h"
#include <algorithm>
#include <array>
#include <vector>

namespace echorama {

/// Columns [begin, end) of a row that are real.
struct PixelSpan {
  int row, begin, end;
};

/// A frame as a reconstruction keeps it until the next one comes.
template <class T>
struct ReconstructionFrame {
  std::vector<T> pixels;
  std::vector<unsigned char> mask; ///< empty: all real
  std::array<int, 3> size{0, 0, 0};
  std::vector<PixelSpan> spans;
  Eigen::Affine3d imageToWorld;
  int left = 0, right = 0, top = 0, bottom = 0; ///< of the real pixels, inclusive

  /// Pixels that are not finite are not real.
  void Load(const TrackedFrame<T>& frame);
  bool Real(std::ptrdiff_t at) const { return mask.empty() || mask[static_cast<std::size_t>(at)]; }
  /// The value at (x, y): its nearest pixel, or bilinear over the pixels that are real. \returns false where the nearest is not.
  bool Sample(double x, double y, bool linear, float& value) const;
};

/// How far a pixel moves at most between two frames, mm.
template <class T>
double LargestStep(const ReconstructionFrame<T>& a, const ReconstructionFrame<T>& b);

/// The spans of the pixels that are \a real(position).
template <class Real>
std::vector<PixelSpan> PixelSpansOf(const std::array<int, 3>& size, const Real& real)
{
  std::vector<PixelSpan> spans;
  for (int row = 0; row < size[1]; ++row) {
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(row) * size[0];
    for (int i = 0; i < size[0]; ++i) {
      if (!real(first + i))
        continue;
      const int begin = i;
      while (i < size[0] && real(first + i))
        ++i;
      spans.push_back({row, begin, i});
    }
  }
  return spans;
}

template <class T>
bool ReconstructionFrame<T>::Sample(double x, double y, bool linear, float& value) const
{
  if (!(x >= -0.5 && y >= -0.5 && x < size[0] - 0.5 && y < size[1] - 0.5))
    return false;
  const int nearX = std::min(static_cast<int>(x + 0.5), size[0] - 1), nearY = std::min(static_cast<int>(y + 0.5), size[1] - 1);
  const std::ptrdiff_t width = size[0], nearest = nearY * width + nearX;
  if (!Real(nearest))
    return false;
  value = static_cast<float>(pixels[static_cast<std::size_t>(nearest)]);
  if (!linear)
    return true;
  const double left = std::clamp(x, 0.0, size[0] - 1.0), top = std::clamp(y, 0.0, size[1] - 1.0);
  const int x0 = static_cast<int>(left), y0 = static_cast<int>(top);
  const float s = static_cast<float>(left - x0), t = static_cast<float>(top - y0);
  float sum = 0.0f, weights = 0.0f;
  for (int corner = 0; corner < 4; ++corner) {
    const float w = (corner & 1 ? s : 1.0f - s) * (corner & 2 ? t : 1.0f - t);
    const std::ptrdiff_t at = (y0 + (corner >> 1)) * width + x0 + (corner & 1);
    if (w > 0.0f && Real(at)) {
      sum += w * (static_cast<float>(pixels[static_cast<std::size_t>(at)]) - value);
      weights += w;
    }
  }
  value += sum / weights; // the nearest pixel has a weight of at least 1/4
  return true;
}

} // namespace echorama
