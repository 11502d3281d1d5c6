// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ImageGeometry.h"
#include "Readers/VoxelType.h"
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace echorama {

/// An image that came from a tracker's peer.
struct StreamedImage {
  std::string name;                                          ///< as the sender calls it
  double time = std::numeric_limits<double>::quiet_NaN();    ///< seconds on the sender's clock; NaN: it does not say
  double arrival = std::numeric_limits<double>::quiet_NaN(); ///< seconds on our clock
  ImageGeometry geometry;                                    ///< mm, LPS; where the sender puts it
  VoxelType type = VoxelType::UInt8;
  int components = 1;
  std::shared_ptr<const std::vector<unsigned char>> voxels; ///< x fastest, this machine's byte order
};

/// The newest images of a live source. Safe for use by several threads. Holds no more than \a bound images, so a reader
/// that is too slow sees fewer of them, never old ones.
class ImageStream {
public:
  explicit ImageStream(std::size_t bound = 4);
  ~ImageStream();
  ImageStream(const ImageStream&) = delete;
  ImageStream& operator=(const ImageStream&) = delete;

  void Add(StreamedImage image);
  /// The newest; without voxels when none has come.
  StreamedImage Latest() const;
  /// All that are held, the oldest first.
  std::vector<StreamedImage> Images() const;
  std::uint64_t Version() const; ///< counts up with every image

private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

} // namespace echorama
