// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Imaging/VolumeView.h"
#include "Core/Imaging/VoxelTypes.h"
#include <array>
#include <cstdint>
#include <variant>
#include <vector>

namespace echorama {

/// Where a picture of a plane lies in the world. The middle of pixel (i, j) is at origin + i right + j up.
struct SlicePlane {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero(); ///< centre of the lower left pixel, mm
  Eigen::Vector3d right = Eigen::Vector3d::UnitX(); ///< from a pixel to the next of its row, mm
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();    ///< from a row to the next, mm
  int width = 0, height = 0;                        ///< pixels
};

/// Which of the volumes are drawn.
enum class SliceShown { All, Selected, Others };

/// How the volumes on a plane become one picture. Grey levels go through each volume's window first.
enum class SliceMode {
  Blend,        ///< mean of the tinted grey levels, by opacity; as opaque as the most opaque volume there
  Difference,   ///< |mean of the selected - mean of the others| in grey; where only one of both is real it shows at a quarter
  Checkerboard, ///< blends of the selected and of the others in squares by turns; where only one of both is real it shows
};

/// A posed volume of any voxel type.
using AnyPosedVolume = std::variant<PosedVolume<unsigned char>, PosedVolume<short>, PosedVolume<unsigned short>,
                                    PosedVolume<float>, PosedVolume<double>>;

/// One volume of a slice.
struct SliceLayer {
  AnyPosedVolume volume;                       ///< its geometry is where it lies now
  std::array<double, 3> colour{1.0, 1.0, 1.0}; ///< RGB in [0, 1]
  double opacity = 1.0;                        ///< [0, 1]; at 0 the volume is not drawn at all
  double black = 0.0, white = 255.0;           ///< the grey levels that are drawn black and white; black < white
  bool selected = false;
};

struct SliceParameters {
  SliceMode mode = SliceMode::Blend;
  bool linear = true;    ///< trilinear through the valid region, or the nearest voxel
  int squarePixels = 40; ///< side of the squares of the checkerboard, [2, 10000]; they start at the lower left pixel
  int step = 1;          ///< [1, 16]: only pixels of every so many columns and rows are sampled; those between are interpolated
};

/// Draws volumes on a plane as RGBA bytes (x fastest, lowest row first); transparent black where no volume is real. What is
/// real, and how it is read between voxels, is as Sampler (Core/Imaging/Sampling.h) has it; values differ from its by rounding
/// in single precision (in double for volumes of doubles). Independent of the number of threads.
/// \param rgba room for 4 width height bytes.
/// \throws Error(InvalidParameter) that names the parameter and its range; Error(BadInput) for a geometry that is none.
void DrawSlice(const std::vector<SliceLayer>& layers, const SlicePlane& plane, const SliceParameters& parameters,
               std::uint8_t* rgba);

} // namespace echorama
