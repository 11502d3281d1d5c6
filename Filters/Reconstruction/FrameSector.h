// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace echorama {

/// Finds the sector of a sweep's images: where the scanner shows echoes, and not its text, bars, logos and empty margins.
///
/// Echoes change from frame to frame, what a scanner prints does not, or only here and there. A pixel is alive when it changes in
/// at least a tenth of the steps from one frame to the next, or changes at all and is not 0 in at least half of the frames (of a
/// single frame: when it is not 0); blocks of a lossy compression around the sector do neither. The sector is the largest piece
/// of what is alive, after an opening that cuts off thin bridges, made solid: what both its rows and its columns enclose
/// belongs to it, because anechoic fluid is real data even where it stays black all along. The hollow under a curved face does
/// not, its columns leave it open.
class FrameSector {
public:
  /// Frames must be of one size, but may be of any of our voxel types. \throws Error(BadInput) otherwise.
  template <class T>
  void Add(VolumeView<const T> pixels);

  int Frames() const { return frames_; }

  /// 1 inside the sector. \throws Error(BadInput) when no frame was added, Error(NotPossible) when nothing is alive.
  Volume<unsigned char> Detect() const;

private:
  std::array<int, 3> size_{0, 0, 0};
  int frames_ = 0;
  std::vector<float> last_;
  std::vector<std::uint32_t> changes_, bright_; // how often a pixel changed, and was not 0
};

/// A sector that was found and made regular.
struct FittedSector {
  Volume<unsigned char> mask;
  double overlap = 0.0; ///< intersection over union of what was found and of the fan that was fitted to it; 0: none fits
};

/// The fan, or rectangle, that is fitted to a mask (FitProbe): with smooth edges, and without the hollow under a curved face. A
/// mask that no fan explains is given back as it is. \param spacingX, spacingY size of a pixel, mm
FittedSector FitSector(const Volume<unsigned char>& mask, double spacingX, double spacingY, const Progress& progress = {});

/// What is to be taken of the images of a sweep.
struct DetectedSector {
  Volume<unsigned char> mask;
  bool found = false; ///< false: what was found is too small for a sector, and the mask is 1 everywhere
  std::string text;   ///< what was done, for people
};

/// The sector of a sweep, with a fan fitted to it. Where little but noise moves, in a water bath for example, what changes is not
/// the sector: a fan below 5% of the image, or a piece that no fan fits below 25% of it, is not believed, and all pixels are
/// taken. \param spacingX, spacingY size of a pixel, mm \throws Error as FrameSector::Detect()
DetectedSector DetectSector(const FrameSector& frames, double spacingX, double spacingY, const Progress& progress = {});

/// First and last column, first and last row that hold a pixel of a mask; the last ones are -1 when none does.
std::array<int, 4> BoxOf(VolumeView<const unsigned char> mask);

/// A fan in an image, as scanners and the Plus toolkit describe it.
struct ImageFan {
  double apexX = 0.0, apexY = 0.0; ///< where all beams meet, pixels; may lie outside the image
  double from = -30.0, to = 30.0;  ///< angles from the direction down the image, degrees, positive to the right, in [-180, 180]
  double nearMm = 0.0, farMm = 100.0; ///< distances from the apex
};

/// 1 inside the fan. \throws Error(InvalidParameter) for angles or distances that are not in order or out of range.
Volume<unsigned char> FanMask(const ImageFan& fan, int width, int height, double spacingX, double spacingY);

/// 1 inside a rectangle of columns and rows, inclusive. \throws Error(InvalidParameter) when none of it is in the image.
Volume<unsigned char> RectangleMask(int left, int right, int top, int bottom, int width, int height);

} // namespace echorama
