// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Imaging/VolumeView.h"
#include <cstdint>
#include <vector>

namespace echorama {

/// Finds the sector of a sweep's images: where the scanner shows echoes, and not its text, bars, logos and empty margins.
///
/// Echoes change from frame to frame, what a scanner prints does not, or only here and there. A pixel is alive when it changes in
/// at least a tenth of the steps from one frame to the next, or changes at all and is not 0 in at least half of the frames (of a
/// single frame: when it is not 0); blocks of a lossy compression around the sector do neither. The sector is the largest piece
/// of what is alive, after an opening that cuts off thin bridges, made solid: gaps in a row or a column of it are closed, because
/// anechoic fluid and shadows are real data even where they stay black all along.
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

/// The part of a mask that lies in a rectangle of columns and rows, inclusive.
Volume<unsigned char> Clipped(const Volume<unsigned char>& mask, int left, int right, int top, int bottom);

} // namespace echorama
