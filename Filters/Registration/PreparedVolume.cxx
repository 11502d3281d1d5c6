// SPDX-License-Identifier: BSD-3-Clause
#include "PreparedVolume.h"
#include "Core/Imaging/ShadowMap.h"
#include "Core/Imaging/VoxelTypes.h"

namespace echorama {
namespace {

// Shadows are told by cells, some ninety along the volume: where beams run need not be known better than that.
constexpr int EnoughOutlinePoints = 1000;

} // namespace

template <class T>
PreparedVolume PrepareVolume(const PosedVolume<T>& volume, bool withReliability, const std::optional<PlacedProbe>& probe,
                             const Progress& progress)
{
  PreparedVolume prepared;
  prepared.pyramid = BuildPyramid(volume, {}, progress.Part(0.0, 0.3));
  if (withReliability && prepared.pyramid.front().realVoxels > 0) {
    ProbeFitParameters fit;
    fit.outlinePoints = EnoughOutlinePoints;
    const Volume<float> map = ReliabilityMap(volume, probe ? probe : FindProbe(volume, fit), {}, progress.Part(0.3, 0.8));
    prepared.reliability =
        BuildPyramid(PosedVolume<float>{map.View(), volume.valid, volume.geometry}, {}, progress.Part(0.8, 1.0));
  }
  return prepared;
}

#define EchoramaInstantiate(T)                                                                                                   \
  template PreparedVolume PrepareVolume<T>(const PosedVolume<T>&, bool, const std::optional<PlacedProbe>&, const Progress&);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
