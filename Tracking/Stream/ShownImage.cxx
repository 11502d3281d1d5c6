// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Stream/ShownImage.h"
#include "Core/Base/Error.h"
#include "Readers/SequencePoses.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace echorama {
namespace {

// An image without a time is further away than any other.
double DistanceInTime(const StreamedImage& image, double time)
{
  return std::isnan(image.time) ? std::numeric_limits<double>::infinity() : std::abs(image.time - time);
}

// Whether its numbers agree with its bytes, and we can show it.
bool IsShowable(const StreamedImage& image)
{
  if (!image.voxels || (image.components != 1 && image.components != 3 && image.components != 4)) {
    return false;
  }
  try {
    image.geometry.Check(image.name);
  } catch (const Error&) {
    return false;
  }
  return image.voxels->size() == image.geometry.VoxelCount() * static_cast<std::size_t>(image.components) * SizeOf(image.type);
}
} // namespace

std::string UsualWorld(const std::vector<std::string>& tools)
{
  std::map<std::string, int> counts;
  for (const std::string& tool : tools) {
    if (const auto frames = FramesOf(tool)) {
      ++counts[frames->second];
    }
  }
  const auto most = std::max_element(counts.begin(), counts.end(), [](auto& a, auto& b) { return a.second < b.second; });
  return most == counts.end() ? "" : most->first;
}

std::optional<ShownImage> ChooseImage(std::vector<StreamedImage> images, const LiveTransforms& transforms,
                                      const std::string& imageFrame, const std::string& world, double time)
{
  images.erase(std::remove_if(images.begin(), images.end(), [](const StreamedImage& image) { return !IsShowable(image); }),
               images.end());
  std::reverse(images.begin(), images.end());
  if (!std::isnan(time))
    std::stable_sort(images.begin(), images.end(), [time](const StreamedImage& a, const StreamedImage& b) {
      return DistanceInTime(a, time) < DistanceInTime(b, time);
    });
  std::optional<ShownImage> chosen;
  for (const StreamedImage& image : images) {
    const LiveTransform found = transforms.Find(imageFrame, world, image.time);
    const bool placed = !std::isnan(image.time) && found.Status() == TransformStatus::Valid &&
                        std::abs(found.transform.matrix.linear().determinant()) > 1e-12 &&
                        AreAxesOfGrid(found.transform.matrix, image.geometry.dimensions);
    if (placed)
      return ShownImage{image, found.transform.matrix, FrameGeometry(found.transform.matrix, image.geometry.dimensions)};
    if (!chosen)
      chosen = ShownImage{image, {}, image.geometry};
    if (!std::isnan(time))
      break; // the one of that moment
  }
  return chosen;
}

} // namespace echorama
