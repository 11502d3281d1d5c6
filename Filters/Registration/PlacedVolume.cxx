// SPDX-License-Identifier: BSD-3-Clause
#include "PlacedVolume.h"
#include "Core/Base/Error.h"
#include <algorithm>

namespace echorama {

void CheckPlacedVolume(const PlacedVolume& volume)
{
  constexpr std::ptrdiff_t FewestVoxels = 100;
  const auto refuse = [&volume](const std::string& why) { throw Error(Error::Kind::BadInput, volume.name + ": " + why); };
  if (!volume.pyramid || volume.pyramid->empty())
    refuse("it has no voxels");
  const PyramidLevel& finest = volume.pyramid->front();
  const auto& n = finest.geometry.dimensions;
  if (*std::min_element(n.begin(), n.end()) < 2)
    refuse("it is not a volume (one voxel thick); aligning needs three dimensions");
  if (finest.realVoxels < FewestVoxels)
    refuse("only " + std::to_string(finest.realVoxels) + " of its voxels are real; at least " + std::to_string(FewestVoxels) +
           " are needed");
  const VolumeView<const float> view = finest.intensity.View();
  const float* first = std::find_if(view.begin(), view.end(), [](float v) { return v == v; });
  if (std::all_of(first, view.end(), [first](float v) { return !(v == v) || v == *first; }))
    refuse("it is constant; there is nothing to align on");
}

void CheckFixedVolume(int fixed, std::size_t count)
{
  if (fixed < 0 || static_cast<std::size_t>(fixed) >= count)
    throw Error(Error::Kind::InvalidParameter, "the fixed volume must be one of the " + std::to_string(count) +
                                                   ", numbered from 0; it is " + std::to_string(fixed));
}

} // namespace echorama
