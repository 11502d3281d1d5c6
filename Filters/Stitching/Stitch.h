// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Imaging/DisplacementField.h"
#include "Core/Imaging/VolumeView.h"
#include <string>
#include <variant>
#include <vector>

namespace echorama {

/// How overlapping volumes are blended.
enum class StitchMethod {
  Distance, ///< by the distances to pure and empty regions (dissertation 5.2, 5.4)
  Feather,  ///< by the distance to the own border (Szeliski 1996)
  Average,  ///< plain mean
  Maximum,  ///< the largest value
};

struct StitchParameters {
  StitchMethod method = StitchMethod::Distance;
  double sharpness = 1.5; ///< the exponent b of eq. 5.10, [0, 1000]; 0 is the plain average, large a hard edge. Distance only
  /// Volumes that say how far their voxels can be trusted count by that (their weight is multiplied), but by no less than this,
  /// (0, 1]: where none can be trusted they are blended as ever. Not for Maximum.
  double reliabilityFloor = 0.01;
  bool allowDisjoint = false;   ///< whether a volume may overlap no other; it is then just put in its place
  double maximumMemoryGb = 0.0; ///< 10^9 bytes; 0: three quarters of this machine's memory
};

/// A volume of any of our voxel types.
using AnyPosedVolume = std::variant<PosedVolume<unsigned char>, PosedVolume<short>, PosedVolume<unsigned short>,
                                    PosedVolume<float>, PosedVolume<double>>;

struct StitchInput {
  AnyPosedVolume volume;
  std::string name;                         ///< for messages
  VolumeView<const float> reliability = {}; ///< how far each voxel can be trusted, in [0, 1] (ReliabilityMap); empty: all alike
  /// What belongs at x is read at x + u(x); none: the volume lies as its geometry says. It must outlive the stitching.
  const DisplacementField* displacement = nullptr;
};

/// The geometry of a volume, grown by how far its displacement can carry voxels: the box to allow memory for.
ImageGeometry ReachOf(const StitchInput& input);

/// Where the result goes: views of the size of the grid.
template <class T>
struct StitchOutput {
  VolumeView<T> intensity;            ///< 0 where no volume is
  VolumeView<unsigned char> valid;    ///< 1 where any volume is
  VolumeView<unsigned char> coverage; ///< how many volumes are there (255: 255 or more)
  std::vector<VolumeView<float>>
      weights; ///< empty, or one per volume: its share of the voxel, in [0, 1]; they sum to 1 where valid
};

/// Bytes that Stitch() needs at most, its output included, for volumes of these geometries on \a grid.
/// \param voxelBytes of the output's type \param weights whether they are wanted too
double StitchMemory(const StitchParameters& parameters, const std::vector<ImageGeometry>& volumes, const ImageGeometry& grid,
                    std::size_t voxelBytes, bool weights = false);

/// Checks all that can be known before anything is allocated.
/// \throws Error(InvalidParameter) for a parameter out of range, Error(BadInput) for fewer than two volumes or a bad geometry,
/// Error(TooLarge), with the numbers and a spacing that would fit, when StitchMemory() is more than allowed.
void CheckStitch(const StitchParameters& parameters, const std::vector<ImageGeometry>& volumes, const ImageGeometry& grid,
                 std::size_t voxelBytes, bool weights = false);

/// Resamples posed volumes onto \a grid (see StitchGrid) and blends them into one, in 2D and 3D.
///
/// Weights are s^b / sum s^b with s = e / (p + e): p and e are the distances, in the grid, to the pure and the empty region
/// of the volume. A volume without a pure region gets a core (RegionMap::GiveCores). Reliabilities multiply s^b. The blend is v0
/// + sum w (v - v0), so a constant stays that constant; integer results are rounded, and clamped to the range of T. Cost: per
/// volume one resampling and two distance maps in boxes around its overlap; memory as StitchMemory() says. \throws what
/// CheckStitch() throws, Error(BadInput) that names a volume with no voxel in the grid, Error(NotPossible) that names a volume
/// which overlaps no other, Error(Cancelled).
template <class T>
void Stitch(const StitchParameters& parameters, const std::vector<StitchInput>& volumes, const ImageGeometry& grid,
            const StitchOutput<T>& output, const Progress& progress = {});

} // namespace echorama
