// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parallel.h"
#include "Core/Imaging/VolumeView.h"
#include <algorithm>
#include <cmath>

namespace echorama {

/// Reads a volume between its voxels, through its valid region.
///
/// A position is in continuous index coordinates (voxel centres at whole numbers). It is inside where its nearest voxel
/// exists, is valid and is finite: the mask keeps its shape. The linear value is the trilinear mean of the valid corners
/// alone, as v0 + sum w (v - v0), so that voxels that are not real never bleed in and a constant stays that constant.
template <class T>
class Sampler {
public:
  Sampler(VolumeView<const T> intensity, VolumeView<const unsigned char> valid) : intensity_(intensity), valid_(valid) {}

  /// Whether the voxel at a flat index is real.
  bool IsReal(std::ptrdiff_t index) const
  {
    if constexpr (std::is_floating_point_v<T>)
      if (!std::isfinite(intensity_[index]))
        return false;
    return valid_.Empty() || valid_[index] != 0;
  }

  /// The flat index of the nearest voxel (halves round up), or -1 where that is outside or not real.
  std::ptrdiff_t NearestIndex(double x, double y, double z) const
  {
    const auto& n = intensity_.Dimensions();
    // Written so that NaN is outside.
    if (!(x >= -0.5 && y >= -0.5 && z >= -0.5 && x < n[0] - 0.5 && y < n[1] - 0.5 && z < n[2] - 0.5))
      return -1;
    // The sum of 0.5 and the number just below it rounds to 1, which in a single slice would be a voxel too far.
    const auto whole = [](double position, int count) {
      return std::min(static_cast<std::ptrdiff_t>(position + 0.5), static_cast<std::ptrdiff_t>(count - 1));
    };
    const std::ptrdiff_t index =
        whole(z, n[2]) * intensity_.SliceStride() + whole(y, n[1]) * intensity_.RowStride() + whole(x, n[0]);
    return IsReal(index) ? index : -1;
  }

  /// The value of the nearest voxel. \returns false outside; \a value is then not touched.
  bool Nearest(double x, double y, double z, double& value) const
  {
    const std::ptrdiff_t index = NearestIndex(x, y, z);
    if (index < 0)
      return false;
    value = static_cast<double>(intensity_[index]);
    return true;
  }

  /// The trilinear value. \returns false outside; \a value is then not touched.
  bool Linear(double x, double y, double z, double& value) const
  {
    const std::ptrdiff_t nearest = NearestIndex(x, y, z);
    if (nearest < 0)
      return false;
    const auto& n = intensity_.Dimensions();
    const Axis ax(x, n[0], 1), ay(y, n[1], intensity_.RowStride()), az(z, n[2], intensity_.SliceStride());
    const std::ptrdiff_t first = az.first + ay.first + ax.first;
    const double v0 = static_cast<double>(intensity_[nearest]);
    double sum = 0.0, weights = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      const std::ptrdiff_t index = first + (corner & 1 ? ax.step : 0) + (corner & 2 ? ay.step : 0) + (corner & 4 ? az.step : 0);
      const double w = (corner & 1 ? ax.t : 1.0 - ax.t) * (corner & 2 ? ay.t : 1.0 - ay.t) * (corner & 4 ? az.t : 1.0 - az.t);
      if (w > 0.0 && IsReal(index)) {
        sum += w * (static_cast<double>(intensity_[index]) - v0);
        weights += w;
      }
    }
    value = v0 + sum / weights; // the nearest voxel is real and has a weight of at least 1/8
    return true;
  }

private:
  // The two voxels along one axis that surround a position, the first as an offset; at the rim both are the same voxel.
  struct Axis {
    Axis(double position, int count, std::ptrdiff_t stride)
    {
      const double clamped = std::fmin(std::fmax(position, 0.0), count - 1.0);
      const int below = static_cast<int>(clamped);
      t = clamped - below;
      first = below * stride;
      step = below + 1 < count ? stride : 0;
    }
    std::ptrdiff_t first, step;
    double t;
  };

  VolumeView<const T> intensity_;
  VolumeView<const unsigned char> valid_;
};

/// Which voxels of a volume are real, 1 or 0: valid and finite.
template <class T>
Volume<unsigned char> RealRegionOf(const PosedVolume<T>& volume)
{
  Volume<unsigned char> region(volume.intensity.Dimensions());
  const Sampler<T> sampler(volume.intensity, volume.valid);
  ParallelRanges(volume.intensity.Size(), 1 << 16, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t at = begin; at < end; ++at)
      region.View()[at] = sampler.IsReal(at) ? 1 : 0;
  });
  return region;
}

} // namespace echorama
