// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ImageGeometry.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Imaging/VolumeView.h"
#include <cstdint>
#include <vector>

namespace echorama {

/// Whether the fan is a full circle: \a beams of them, evenly spaced, so that the last is as far from the first as from its
/// neighbour. The fan angle is then (beams - 1) / beams of a turn.
bool ClosesCircle(const ProbeGeometry& geometry, int beams);

/// What an image of a plane is made for.
struct FanImage {
  ProbeGeometry probe; ///< that does not sweep
  int beams = 192, samples = 512;
  int width = 640, height = 480; ///< pixels, at least 16 each
  bool flipped = false;          ///< the first pixel of a row lies towards +x of the probe, not -x

  bool operator==(const FanImage& o) const
  {
    return probe == o.probe && beams == o.beams && samples == o.samples && width == o.width && height == o.height &&
           flipped == o.flipped;
  }
};

/// Scan conversion of one plane, again and again: where each pixel lies on the beams is worked out once. The fan is centred in
/// the image, whose pixels are square, as large as it goes; between the beams and along them the image is linear.
/// Where a pixel would be between samples of which one has no content it has none. A fan that closes a circle has no seam.
class FanTable {
public:
  /// \throws Error(InvalidParameter) for a geometry that is none or sweeps, or numbers out of range
  explicit FanTable(const FanImage& image);

  const FanImage& Image() const { return image_; }
  /// Where the pixels lie in the probe's frame: index axes along the array (or against it, flipped) and into the tissue.
  const ImageGeometry& Grid() const { return grid_; }

  /// Fills the pixels. \a value (0 to 255, rounded) and \a content (BeamContent) are samples x beams x 1. \a valid becomes 1
  /// where there is content; \a label, which may be empty, the label of an embedded volume. Elsewhere all three are 0.
  void Convert(VolumeView<const float> value, VolumeView<const unsigned char> content, VolumeView<unsigned char> intensity,
               VolumeView<unsigned char> valid, VolumeView<unsigned char> label) const;

private:
  void PlanRow(int row);

  FanImage image_;
  ImageGeometry grid_;
  bool closes_ = false;
  // Of each pixel: the sample before it on the beam before it (-1: outside of the fan), and how far it is to the next ones.
  std::vector<std::int32_t> offset_;
  std::vector<std::uint16_t> depth_, fan_; // in 1 / 65535
  std::vector<std::int32_t> begin_, end_;  // of each row: all pixels in the fan lie there
};

} // namespace echorama
