// SPDX-License-Identifier: BSD-3-Clause
#include "ReconstructionFrame.h"
#include "Core/Imaging/VoxelTypes.h"
#include <cmath>
#include <type_traits>

namespace echorama {

constexpr double singular = 1e-9; // sine of the angle between the axes of an image

const char* FrameUseText(FrameUse use)
{
  switch (use) {
  case FrameUse::Used:
    return "it was used";
  case FrameUse::PoseNotFinite:
    return "its pose holds a number that is not finite";
  case FrameUse::PoseSingular:
    return "its pose is singular";
  case FrameUse::NoPixels:
    return "none of its pixels is real";
  default:
    return "it lies outside the grid";
  }
}

FrameUse CheckPose(const Eigen::Affine3d& imageToWorld)
{
  if (!imageToWorld.matrix().allFinite())
    return FrameUse::PoseNotFinite;
  const Eigen::Vector3d u = imageToWorld.linear().col(0), v = imageToWorld.linear().col(1);
  return u.cross(v).norm() > singular * u.norm() * v.norm() ? FrameUse::Used : FrameUse::PoseSingular;
}

template <class T>
void ReconstructionFrame<T>::Load(const TrackedFrame<T>& frame)
{
  size = frame.pixels.Dimensions();
  pixels.assign(frame.pixels.begin(), frame.pixels.end());
  imageToWorld = frame.imageToWorld;
  if (frame.mask.Empty())
    mask.clear();
  else
    mask.assign(frame.mask.begin(), frame.mask.end());
  if constexpr (std::is_floating_point_v<T>) {
    const auto finite = [](T value) { return std::isfinite(static_cast<float>(value)); };
    if (!std::all_of(pixels.begin(), pixels.end(), finite)) {
      mask.resize(pixels.size(), 1);
      for (std::size_t i = 0; i < pixels.size(); ++i)
        mask[i] = static_cast<unsigned char>(mask[i] && finite(pixels[i]));
    }
  }
  if (mask.empty()) {
    spans.clear();
    for (int row = 0; row < size[1]; ++row)
      spans.push_back({row, 0, size[0]});
  } else {
    spans = PixelSpansOf(size, [this](std::ptrdiff_t at) { return mask[static_cast<std::size_t>(at)] != 0; });
  }
  if (spans.empty())
    return;
  top = spans.front().row;
  bottom = spans.back().row;
  left = size[0];
  right = 0;
  for (const PixelSpan& span : spans) {
    left = std::min(left, span.begin);
    right = std::max(right, span.end - 1);
  }
}

// The difference of two affine maps is affine, so it is largest at a corner.
template <class T>
double LargestStep(const ReconstructionFrame<T>& a, const ReconstructionFrame<T>& b)
{
  double step = 0.0;
  for (int corner = 0; corner < 4; ++corner) {
    const Eigen::Vector3d pixel(corner & 1 ? std::max(a.right, b.right) : std::min(a.left, b.left),
                                corner & 2 ? std::max(a.bottom, b.bottom) : std::min(a.top, b.top), 0.0);
    step = std::max(step, (b.imageToWorld * pixel - a.imageToWorld * pixel).norm());
  }
  return step;
}

#define EchoramaInstantiate(T)                                                                                                   \
  template struct ReconstructionFrame<T>;                                                                                        \
  template double LargestStep<T>(const ReconstructionFrame<T>&, const ReconstructionFrame<T>&);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
