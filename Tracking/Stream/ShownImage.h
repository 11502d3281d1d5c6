// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Stream/ImageStream.h"
#include "Tracking/Stream/LiveTransforms.h"
#include <optional>
#include <string>
#include <vector>

namespace echorama {

/// The frame of coordinates that most tools are seen in; of equals the first in the order of bytes, of no tools "".
std::string UsualWorld(const std::vector<std::string>& tools);

/// An image, and its place in the world where that is known.
struct ShownImage {
  StreamedImage image;
  std::optional<Eigen::Affine3d> imageToWorld;
  ImageGeometry geometry; ///< in the world, or where the sender puts it
};

/// Of the images of a stream (the oldest first) the newest that can be placed in the world, else the newest; with a \a time, the
/// nearest to it. Images whose numbers disagree with their bytes, or that are neither grey nor coloured, are passed over.
/// \param imageFrame, world the frames of coordinates of the image and of the world
std::optional<ShownImage> ChooseImage(std::vector<StreamedImage> images, const LiveTransforms& transforms,
                                      const std::string& imageFrame, const std::string& world, double time);

} // namespace echorama
