// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"
#include "Core/Imaging/VoxelTypes.h"
#include <array>
#include <cstdint>
#include <variant>
#include <vector>

namespace echorama {

/// Where a picture of a plane lies in the world. Pixel (i, j) is at origin + i right + j up.
struct SlicePlane {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero(); ///< centre of the lower left pixel, mm
  Eigen::Vector3d right = Eigen::Vector3d::UnitX(), up = Eigen::Vector3d::UnitY(); ///< from pixel to pixel, mm
  int width = 0, height = 0;
};

enum class SliceMode {
  Blend,        ///< mean of the tinted grey levels by opacity
  Difference,   ///< |selected - others|, grey, where both are; where one is, it is dim
  Checkerboard, ///< squares of the selected and of the others in turn
};

/// One volume of a slice.
struct SliceLayer {
  std::variant<PosedVolume<unsigned char>, PosedVolume<short>, PosedVolume<unsigned short>, PosedVolume<float>, PosedVolume<double>> volume; ///< its geometry: where it lies now
  std::array<double, 3> colour{1.0, 1.0, 1.0};
  double opacity = 1.0;
  double black = 0.0, white = 255.0; ///< grey levels that are drawn black and white
  bool selected = false;
};

struct SliceParameters {
  SliceMode mode = SliceMode::Blend;
  bool linear = true;         ///< trilinear through the valid region, or the nearest voxel
  int squarePixels = 40;      ///< of the checkerboard, [2, 10000]
  int step = 1;               ///< 1: full. 2, 4: level of detail while dragging: every second or fourth pixel is sampled
};

/// Draws volumes on a plane as RGBA bytes (x fastest, lowest row first); transparent where no volume is real.
/// Independent of the number of threads. \throws Error(InvalidParameter).
void DrawSlice(const std::vector<SliceLayer>& layers, const SlicePlane& plane, const SliceParameters& parameters,
               std::uint8_t* rgba);

} // namespace echorama
