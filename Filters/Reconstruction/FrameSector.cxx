// SPDX-License-Identifier: BSD-3-Clause
// Passes over bytes: threshold, erosion and dilation by a square (separable running counts), one flood fill for the largest
// piece, and the closing of gaps that rows and columns enclose. Some 10 ns a pixel, once per sweep; Add() is one pass.
#include "FrameSector.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/Parallel.h"
#include "Core/Geometry/ProbeFit.h"
#include "Core/Imaging/VoxelTypes.h"
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace echorama {

namespace {

constexpr double changingShare = 0.1; // of the steps between frames in which a pixel changes
constexpr double brightShare = 0.5;   // of the frames in which a pixel that changes at all is not 0
constexpr int bridge = 3;             // half the width of the thinnest part of a sector, pixels
constexpr double leastShare = 0.05;   // of the image, that a fan or rectangle of echoes takes
constexpr double leastPiece = 0.25;   // of the image, that a piece takes which is neither

// 1 where all (erode) or any (dilate) of the pixels within "half" along the axis are set. Beyond the image counts as set for an
// erosion: a sector may be cut by the image's border.
void Along(Volume<unsigned char>& mask, int axis, int half, bool erode)
{
  const auto& n = mask.Dimensions();
  const int length = n[static_cast<std::size_t>(axis)], lines = n[static_cast<std::size_t>(1 - axis)];
  const std::ptrdiff_t step = axis == 0 ? 1 : n[0], line = axis == 0 ? n[0] : 1;
  std::vector<int> sums(static_cast<std::size_t>(length) + 1);
  for (int l = 0; l < lines; ++l) {
    unsigned char* first = mask.View().Data() + l * line;
    for (int i = 0; i < length; ++i)
      sums[static_cast<std::size_t>(i) + 1] = sums[static_cast<std::size_t>(i)] + first[i * step];
    for (int i = 0; i < length; ++i) {
      const int from = std::max(0, i - half), to = std::min(length, i + half + 1);
      const int sum = sums[static_cast<std::size_t>(to)] - sums[static_cast<std::size_t>(from)];
      first[i * step] = erode ? sum == to - from : sum > 0;
    }
  }
}

// Keeps the largest piece (4 neighbours). \returns its size.
std::ptrdiff_t KeepLargest(Volume<unsigned char>& mask)
{
  const auto view = mask.View();
  const int width = mask.Dimensions()[0];
  std::vector<int> label(static_cast<std::size_t>(view.Size()), 0);
  std::vector<std::ptrdiff_t> open;
  std::ptrdiff_t largest = 0;
  int labels = 0, best = 0;
  for (std::ptrdiff_t seed = 0; seed < view.Size(); ++seed) {
    if (!view[seed] || label[static_cast<std::size_t>(seed)])
      continue;
    ++labels;
    std::ptrdiff_t count = 0;
    const auto visit = [&](std::ptrdiff_t at) {
      if (view[at] && !label[static_cast<std::size_t>(at)]) {
        label[static_cast<std::size_t>(at)] = labels;
        open.push_back(at);
        ++count;
      }
    };
    visit(seed);
    while (!open.empty()) {
      const std::ptrdiff_t at = open.back();
      open.pop_back();
      if (at % width > 0)
        visit(at - 1);
      if (at % width + 1 < width)
        visit(at + 1);
      if (at >= width)
        visit(at - width);
      if (at + width < view.Size())
        visit(at + width);
    }
    if (count > largest) {
      largest = count;
      best = labels;
    }
  }
  for (std::ptrdiff_t at = 0; at < view.Size(); ++at)
    view[at] = best && label[static_cast<std::size_t>(at)] == best;
  return largest;
}

// Adds 1 to "enclosed" between the first and the last set pixel of each line along the axis.
void Enclose(const Volume<unsigned char>& mask, int axis, Volume<unsigned char>& enclosed)
{
  const auto& n = mask.Dimensions();
  const int length = n[static_cast<std::size_t>(axis)], lines = n[static_cast<std::size_t>(1 - axis)];
  const std::ptrdiff_t step = axis == 0 ? 1 : n[0], line = axis == 0 ? n[0] : 1;
  for (int l = 0; l < lines; ++l) {
    const unsigned char* first = mask.View().Data() + l * line;
    unsigned char* counts = enclosed.View().Data() + l * line;
    int from = 0, to = length - 1;
    while (from < length && !first[from * step])
      ++from;
    while (to > from && !first[to * step])
      --to;
    for (int i = from; i <= to && i < length; ++i)
      ++counts[i * step];
  }
}

} // namespace

template <class T>
void FrameSector::Add(VolumeView<const T> pixels)
{
  if (frames_ == 0) {
    size_ = pixels.Dimensions();
    if (pixels.Empty() || size_[0] < 1 || size_[1] < 1 || size_[2] != 1)
      throw Error(Error::Kind::BadInput, "a frame to find the sector in is not one slice");
    last_.assign(static_cast<std::size_t>(pixels.Size()), 0.0f);
    changes_.assign(last_.size(), 0);
    bright_.assign(last_.size(), 0);
  }
  if (pixels.Dimensions() != size_)
    throw Error(Error::Kind::BadInput, "frames are of different sizes, " + SizeText(size_[0], size_[1]) + " and " +
                                           SizeText(pixels.Dimensions()[0], pixels.Dimensions()[1]) +
                                           "; no one sector is theirs");
  for (std::size_t i = 0; i < last_.size(); ++i) {
    const float value = static_cast<float>(pixels[static_cast<std::ptrdiff_t>(i)]);
    changes_[i] += frames_ > 0 && value != last_[i] && !(std::isnan(value) && std::isnan(last_[i]));
    bright_[i] += value > 0.0f;
    last_[i] = value;
  }
  ++frames_;
}

Volume<unsigned char> FrameSector::Detect() const
{
  if (frames_ == 0)
    throw Error(Error::Kind::BadInput, "there is no frame to find a sector in");
  Volume<unsigned char> alive(size_);
  for (std::size_t i = 0; i < last_.size(); ++i) {
    const bool changing = changes_[i] > 0 && changes_[i] >= changingShare * (frames_ - 1);
    const bool bright = (changes_[i] > 0 || frames_ == 1) && bright_[i] >= brightShare * frames_;
    alive.View()[static_cast<std::ptrdiff_t>(i)] = changing || bright;
  }
  // Speckle leaves gaps in what is alive, and an opening would widen them: close them first.
  for (const bool erode : {false, true})
    for (const int axis : {0, 1})
      Along(alive, axis, 1, erode);
  Volume<unsigned char> sector = alive;
  for (const int axis : {0, 1})
    Along(sector, axis, bridge, true);
  if (KeepLargest(sector) == 0) {
    sector = alive; // an image of a few pixels, or a very thin sector
    if (KeepLargest(sector) == 0)
      throw Error(Error::Kind::NotPossible, "no sector was found: the pixels do not change from frame to frame");
  }
  for (const int axis : {0, 1})
    Along(sector, axis, bridge, false);
  const auto view = sector.View();
  for (std::ptrdiff_t at = 0; at < view.Size(); ++at)
    view[at] = view[at] && alive.View()[at];
  // What its row alone encloses may be the hollow under a curved face.
  Volume<unsigned char> enclosed(size_);
  for (const int axis : {0, 1})
    Enclose(sector, axis, enclosed);
  for (std::ptrdiff_t at = 0; at < view.Size(); ++at)
    view[at] = enclosed.View()[at] == 2;
  return sector;
}

FittedSector FitSector(const Volume<unsigned char>& mask, double spacingX, double spacingY, const Progress& progress)
{
  ImageGeometry image;
  image.dimensions = mask.Dimensions();
  image.spacing = {spacingX, spacingY, 1.0};
  try {
    const ProbeFit fit = FitProbe(mask.View(), image, {}, progress);
    FittedSector fitted{Volume<unsigned char>(mask.Dimensions()), fit.overlap};
    const Eigen::Affine3d toProbe = Eigen::Affine3d(fit.probeToWorld.inverse()) * image.IndexToWorld();
    const double tolerance = 0.5 * std::min(spacingX, spacingY) / fit.geometry.Size(); // centres of pixels lie inside the outline
    ParallelFor(image.dimensions[1], [&](std::ptrdiff_t row) {
      for (int x = 0; x < image.dimensions[0]; ++x) {
        Eigen::Vector3d at = toProbe * Eigen::Vector3d(x, static_cast<double>(row), 0.0);
        at[1] = 0.0; // of a plane
        fitted.mask.View()(x, static_cast<int>(row), 0) = BeamPointAt(fit.geometry, at, tolerance).has_value();
      }
    });
    return fitted;
  } catch (const Error& error) {
    if (error.GetKind() != Error::Kind::NotPossible)
      throw;
    return {mask, 0.0};
  }
}

DetectedSector DetectSector(const FrameSector& frames, double spacingX, double spacingY, const Progress& progress)
{
  const Volume<unsigned char> found = frames.Detect();
  const auto share = [](const Volume<unsigned char>& mask) {
    return static_cast<double>(mask.View().Size() - std::count(mask.View().begin(), mask.View().end(), 0)) /
           static_cast<double>(mask.View().Size());
  };
  const auto percent = [](double part) { return Format("%.1f%%", 100.0 * part); };
  FittedSector fitted = FitSector(found, spacingX, spacingY, progress);
  const double part = std::min(share(found), share(fitted.mask));
  if (part < (fitted.overlap > 0.0 ? leastShare : leastPiece))
    return {Volume<unsigned char>(found.Dimensions(), 1), false,
            "no sector was found: what changes from frame to frame is only " + percent(part) + " of the image" +
                (fitted.overlap > 0.0 ? "" : " and no fan fits it") + ", so all pixels were taken"};
  if (fitted.overlap > 0.0)
    return {std::move(fitted.mask), true,
            "sector found by what changes, a fan fitted to it (overlap " + percent(fitted.overlap) + ")"};
  return {std::move(fitted.mask), true, "sector found by what changes; no fan fits it, so it was taken as it is"};
}

std::array<int, 4> BoxOf(VolumeView<const unsigned char> mask)
{
  const auto& size = mask.Dimensions();
  std::array<int, 4> box{size[0], -1, size[1], -1};
  for (int y = 0; y < size[1]; ++y)
    for (int x = 0; x < size[0]; ++x)
      if (mask(x, y, 0))
        box = {std::min(box[0], x), std::max(box[1], x), std::min(box[2], y), std::max(box[3], y)};
  return box;
}

Volume<unsigned char> FanMask(const ImageFan& fan, int width, int height, double spacingX, double spacingY)
{
  if (!(fan.from >= -180.0 && fan.from < fan.to && fan.to <= 180.0))
    throw Error(Error::Kind::InvalidParameter, "FanAngles are " + std::to_string(fan.from) + " and " + std::to_string(fan.to) +
                                                   "; they must be in [-180, 180] degrees and in order");
  if (!(fan.nearMm >= 0.0 && fan.nearMm < fan.farMm))
    throw Error(Error::Kind::InvalidParameter, "FanDepths are " + std::to_string(fan.nearMm) + " and " +
                                                   std::to_string(fan.farMm) + "; they must not be negative, and in order");
  if (!std::isfinite(fan.apexX) || !std::isfinite(fan.apexY))
    throw Error(Error::Kind::InvalidParameter, "FanApex is not finite");
  Volume<unsigned char> mask({width, height, 1});
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double across = (x - fan.apexX) * spacingX, down = (y - fan.apexY) * spacingY;
      const double depth = std::hypot(across, down), angle = std::atan2(across, down) * DegreesPerRadian;
      mask.View()(x, y, 0) = depth >= fan.nearMm && depth <= fan.farMm && angle >= fan.from && angle <= fan.to;
    }
  return mask;
}

Volume<unsigned char> RectangleMask(int left, int right, int top, int bottom, int width, int height)
{
  left = std::max(left, 0);
  right = std::min(right, width - 1);
  top = std::max(top, 0);
  bottom = std::min(bottom, height - 1);
  if (left > right || top > bottom)
    throw Error(Error::Kind::InvalidParameter, "Rectangle holds no pixel of an image of " + SizeText(width, height));
  Volume<unsigned char> mask({width, height, 1});
  for (int y = top; y <= bottom; ++y)
    std::fill(mask.View().Row(y, 0) + left, mask.View().Row(y, 0) + right + 1, static_cast<unsigned char>(1));
  return mask;
}

#define EchoramaInstantiate(T) template void FrameSector::Add<T>(VolumeView<const T>);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
