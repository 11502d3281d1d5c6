// SPDX-License-Identifier: BSD-3-Clause
#include "ReconstructionPlan.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Imaging/VoxelTypes.h"
#include "Filters/Reconstruction/VolumeReconstruction.h"
#include <algorithm>

namespace echorama {
namespace {

// The size of a pixel, mm.
Eigen::Vector2d PixelSize(const Eigen::Affine3d& imageToWorld)
{
  return {imageToWorld.linear().col(0).norm(), imageToWorld.linear().col(1).norm()};
}

} // namespace

std::optional<Volume<unsigned char>> GivenSector(const SectorParameters& parameters, const std::array<int, 3>& size,
                                                 const Eigen::Affine3d& imageToWorld)
{
  const auto& [left, right, top, bottom] = parameters.rectangle;
  const Eigen::Vector2d pixel = PixelSize(imageToWorld);
  if (parameters.choice == SectorChoice::Rectangle)
    return RectangleMask(left, right, top, bottom, size[0], size[1]);
  if (parameters.choice == SectorChoice::Fan)
    return FanMask(parameters.fan, size[0], size[1], pixel[0], pixel[1]);
  return std::nullopt;
}

VolumeView<const unsigned char> BothMasks(VolumeView<const unsigned char> own, VolumeView<const unsigned char> sector,
                                          Volume<unsigned char>& store)
{
  if (own.Empty() || sector.Empty())
    return own.Empty() ? sector : own;
  if (own.Dimensions() != sector.Dimensions())
    throw Error(Error::Kind::BadInput, "the mask of a frame has another size than the sector");
  if (store.Dimensions() != sector.Dimensions())
    store = Volume<unsigned char>(sector.Dimensions());
  std::transform(own.begin(), own.end(), sector.begin(), store.View().begin(),
                 [](unsigned char a, unsigned char b) { return static_cast<unsigned char>(a && b); });
  return static_cast<const Volume<unsigned char>&>(store).View();
}

template <class T>
bool ReconstructionSurvey::Add(VolumeView<const T> pixels, VolumeView<const unsigned char> valid,
                               const std::optional<Eigen::Affine3d>& imageToWorld)
{
  ++seen_;
  if (!imageToWorld || CheckPose(*imageToWorld) != FrameUse::Used)
    return false;
  const bool first = !first_;
  if (first) {
    first_ = imageToWorld;
    size_ = pixels.Dimensions();
    type_ = typeid(T);
  }
  if (*type_ == typeid(T) && (valid.Empty() || std::find(valid.begin(), valid.end(), 1) != valid.end())) {
    if (parameters_.choice == SectorChoice::Detected)
      changes_.Add<T>(pixels);
    places_.push_back({*imageToWorld, {0, pixels.Dimensions()[0] - 1, 0, pixels.Dimensions()[1] - 1}});
  }
  return first;
}

ReconstructionPlan ReconstructionSurvey::Finish(const std::optional<ImageGeometry>& given, GridDirections directions,
                                                double spacingMm, const Progress& progress)
{
  if (places_.empty())
    throw Error(Error::Kind::BadInput, "none of the " + std::to_string(seen_) + " frames has a " +
                                           (first_ ? "real pixel (ValidRegion)" : "valid pose (ImageToWorld)"));
  ReconstructionPlan plan;
  if (parameters_.choice == SectorChoice::Detected) {
    const Eigen::Vector2d pixel = PixelSize(*first_);
    DetectedSector sector = DetectSector(changes_, pixel[0], pixel[1], progress);
    plan.sector = std::move(sector.mask);
    plan.sectorText = sector.text;
    plan.sectorFound = sector.found;
  } else {
    plan.sector = GivenSector(parameters_, size_, *first_);
    plan.sectorText = !plan.sector                                    ? "all pixels"
                      : parameters_.choice == SectorChoice::Rectangle ? "the given rectangle"
                                                                      : "the given fan";
  }
  if (plan.sector) {
    // The grid is that of the pixels that count.
    const auto mask = plan.sector->View();
    const std::array<int, 4> box = BoxOf(mask);
    const std::ptrdiff_t inside = mask.Size() - std::count(mask.begin(), mask.end(), 0);
    plan.sectorText += ", " + std::to_string(inside) + " of " + std::to_string(mask.Size()) + " pixels";
    for (FramePlace& place : places_)
      place.pixels = inside > 0 ? box : place.pixels;
  }
  plan.grid = given ? *given : ReconstructionGrid(places_, directions, spacingMm);
  return plan;
}

#define EchoramaInstantiate(T)                                                                                                   \
  template bool ReconstructionSurvey::Add<T>(VolumeView<const T>, VolumeView<const unsigned char>,                               \
                                             const std::optional<Eigen::Affine3d>&);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
