// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Imaging/VolumeView.h"
#include "Filters/Stitching/Stitch.h"
#include <string>
#include <vector>

namespace echorama {

/// A volume of nothing but noise, and the fan that it fills.
struct NoiseInput {
  AnyPosedVolume volume;
  PlacedProbe fan;
  std::string name; ///< for messages
};

struct NoiseTilingParameters {
  int columns = 0;
  int rows = 1;
  double overlapDegrees = 10.0;
  double overlapMm = 8.0;
  double spacingMm = 0.0;
  std::size_t maxVoxels = std::size_t{1} << 30; ///< of the result
  StitchParameters stitch = ForNoise();         ///< how they are blended; gains are equalized, and nothing need overlap

  static StitchParameters ForNoise();
};

ParameterList Describe(NoiseTilingParameters& p); ///< but for how they are blended

/// Noise volumes as one.
struct TiledNoise {
  Volume<float> intensity;
  Volume<unsigned char> valid;
  ImageGeometry geometry; ///< along the axes of the first volume's probe
  PlacedProbe fan;        ///< at the pose of the first volume's probe
};

/// Where the result will lie.
struct NoiseTiling {
  ImageGeometry geometry;
  PlacedProbe fan;
};

/// Noise volumes side by side, as one of a machine with a larger fan (dissertation 6.1).
///
/// Each is read along its beams, laid beside the last with the overlap that is asked for, and blended with it (Stitch), all in
/// the coordinates of the beams: so that neighbours fit exactly, also where the array bends about another line than the sweep.
/// Then the whole is scan converted once. Tiles go across the fan first, then along the sweep. When there are fewer volumes than
/// tiles they are used again, turned by half about their middle beam, then mirrored in either direction. The outermost voxel of
/// each is not used, so the fan of one volume alone is a little smaller than its own.
///
/// The result has the radii of the first volume, and the distances between beams. Others with another fan are laid by their
/// angles (by their widths, where the first runs straight), and by their depths; where one ends before its neighbours the result
/// has a hole.
/// \throws Error(BadInput) for no volume, fans of which some turn and some run straight, or planes among volumes;
/// Error(InvalidParameter) for a parameter out of range, for a probe that does not pass its Check(), and for an overlap that
/// leaves nothing of a volume beside its neighbour (named); Error(NotPossible) when no probe has a fan as large as they make
/// together; Error(TooLarge); what Stitch throws; Error(Cancelled).
TiledNoise TileNoise(const NoiseTilingParameters& parameters, const std::vector<NoiseInput>& volumes,
                     const Progress& progress = {});

/// The same along beams, which FillFanFromBeams takes without a detour through voxels: a beam volume of the fan, NaN where no
/// volume is.
struct TiledBeams {
  Volume<float> samples;
  PlacedProbe fan;
};
TiledBeams TileNoiseBeams(const NoiseTilingParameters& parameters, const std::vector<NoiseInput>& volumes,
                          const Progress& progress = {});

/// What TileNoise will make, without making it. Throws the same, but for what comes from the voxels.
NoiseTiling PlanNoiseTiling(const NoiseTilingParameters& parameters, const std::vector<NoiseInput>& volumes);

} // namespace echorama
