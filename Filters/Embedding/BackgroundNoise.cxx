// SPDX-License-Identifier: BSD-3-Clause
#include "BackgroundNoise.h"
#include "BeamSampling.h"
#include "Core/Base/Error.h"
#include "Core/Imaging/VoxelTypes.h"
#include <algorithm>

namespace echorama {

template <class T>
BackgroundNoise NoiseBehind(const PosedVolume<T>& volume, const PlacedProbe& form, const Progress& progress,
                            const PlacedProbe* along)
{
  BackgroundNoise noise;
  const PlacedProbe& beams = along ? *along : form;
  try {
    const NoiseMatch match = MatchNoise(volume, beams.geometry, beams.probeToWorld, {}, progress);
    noise.speckleShare = match.speckleShare;
    noise.grains = match.grains;
    if (match.grains >= NoiseMatch::leastGrains) {
      noise.parameters = NoiseLike(match, beams.geometry, form.geometry);
      noise.grainMm = GrainOf(match, beams.geometry);
      return noise;
    }
  } catch (const Error& error) {
    if (error.GetKind() != Error::Kind::NotPossible)
      throw;
    noise.reason = error.what();
  }
  const double voxel = VoxelSize(volume.geometry);
  const Eigen::Vector2d spans = SpansHalfway(form.geometry);
  const auto part = [](double mm, double span) { return span > 0.0 ? std::min(mm / span, 0.25) : 0.0; };
  noise.parameters.depthCorrelationMm = std::min(2.0 * voxel, 0.25 * (form.geometry.depthMax - form.geometry.depthMin));
  noise.parameters.fanCorrelation = part(3.0 * voxel, spans[0]);
  noise.parameters.sweepCorrelation = part(3.0 * voxel, spans[1]);
  noise.parameters = ResolvingCounts(noise.parameters, form.geometry);
  return noise;
}

#define EchoramaInstantiate(T)                                                                                                   \
  template BackgroundNoise NoiseBehind<T>(const PosedVolume<T>&, const PlacedProbe&, const Progress&, const PlacedProbe*);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
