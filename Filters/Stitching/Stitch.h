// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Imaging/DisplacementField.h"
#include "Core/Imaging/VolumeView.h"
#include "GridBox.h"
#include "Membrane.h"
#include <memory>
#include <string>
#include <variant>
#include <vector>

namespace echorama {

/// What decides how much each of the overlapping volumes counts at a voxel.
enum class StitchMethod {
  Distance, ///< the distances to pure and empty regions (dissertation 5.2, 5.4)
  Feather,  ///< the distance to the own border (Szeliski 1996)
  Average,  ///< plain mean
  Maximum,  ///< the largest value is shown
  Membrane, ///< the smoothest surface from pure to empty regions (dissertation 5.3, 5.4)
};

/// What becomes of speckle and edges where volumes overlap. A weighted mean of two speckle patterns has less texture than either,
/// so Split blends the smooth part of the volumes by the weights and the rest, the detail, in another way.
enum class StitchTexture {
  Mix,   ///< the weighted mean of all
  Split, ///< details change over in a narrow transition, amplified by as much as their mixture has lost
};

struct StitchParameters {
  StitchMethod method = StitchMethod::Membrane;
  StitchTexture texture = StitchTexture::Split; ///< for Distance, Feather and Membrane
  double sharpness = 1.5;                       ///< the exponent b of eq. 5.10
  double detailSharpness = 32.0;
  double detailScale = 2.0;
  bool equalizeGain = false;
  double reliabilityFloor = 0.01;
  bool allowDisjoint = false;
  double maximumMemoryGb = 0.0;
  /// Voxels of the output between those of the grid that membranes are found on; 0: 2 where that is fine enough.
  int planStep = 0;
  /// Largest error of the weights of two volumes that comes from their membrane on its grid, certified for exponents from 1
  /// to 32.
  double membraneTolerance = 1.0 / 512;
};

ParameterList Describe(StitchParameters& p);

/// A volume of any of our voxel types.
using AnyPosedVolume = std::variant<PosedVolume<unsigned char>, PosedVolume<short>, PosedVolume<unsigned short>,
                                    PosedVolume<float>, PosedVolume<double>>;

struct StitchInput {
  AnyPosedVolume volume;
  std::string name;                         ///< for messages
  VolumeView<const float> reliability = {}; ///< how far each voxel can be trusted, in [0, 1] (ReliabilityMap); empty: all alike
  /// What belongs at x is now, in the volume as it lies, at x + u(x), and is read there; none: the volume lies as its geometry
  /// says. It must outlive the stitching.
  const DisplacementField* displacement = nullptr;
};

/// The geometry of a volume, grown by how far its displacement can carry voxels: the box to allow memory for.
ImageGeometry ReachOf(const StitchInput& input);

/// Where the result goes: views of the size of the box that is made.
template <class T>
struct StitchOutput {
  VolumeView<T> intensity;            ///< 0 where no volume is
  VolumeView<unsigned char> valid;    ///< 1 where any volume is
  VolumeView<unsigned char> coverage; ///< how many volumes are there (255: 255 or more)
  std::vector<VolumeView<float>>
      weights; ///< empty, or one per volume: its share of the voxel (of its smooth part), in [0, 1]; they sum to 1 where valid
  VolumeView<float> spread = {}; ///< empty, or the largest minus the smallest of the volumes' values there; 0 where one is alone
};

/// What is wanted of the output; memory depends on it.
struct StitchOutputs {
  std::size_t voxelBytes = 1; ///< of the output's type
  bool weights = false, spread = false;
};

/// Stitching in two steps: what is global is found once (where volumes overlap, how they share each voxel of it, gains),
/// and then any box of the output is made from it, voxel by voxel, whatever the other boxes are. So slabs that are
/// written one after the other, or pieces that several processes make, are those of the whole to the last bit.
///
/// Weights are s^b / sum s^b times reliability. s is that of StitchMethod; a volume without a pure region gets a core
/// (RegionMap::GiveCores). The blend is v0 + sum w (v - v0), so a constant stays that constant; integer results are rounded, and
/// clamped to their range. With a texture but Mix the result is sum w L + D with L the smooth part of a volume (LowPass), H = v -
/// L, D = sum h H / sqrt(sum h_i h_j rho_ij), h the weights of the details and rho the measured correlation of two volumes'
/// details: what a mixture of independent textures loses is given back, and what they share is not doubled.
///
/// Membranes are so smooth that every other voxel tells them where overlaps are thick, and when memory is short any global part
/// is found on a grid that is coarser by a whole factor (StitchCost): it is interpolated; where volumes are is always known
/// exactly.
class StitchPlan {
public:
  /// Volumes and displacements must outlive the plan.
  /// \throws what CheckStitch() throws but for the size of the output, Error(BadInput) that names a volume with no voxel in the
  /// grid, Error(NotPossible) that names a volume which overlaps no other, Error(Cancelled).
  StitchPlan(const StitchParameters& parameters, const std::vector<StitchInput>& volumes, const ImageGeometry& grid,
             const StitchOutputs& outputs, const Progress& progress = {});
  ~StitchPlan();
  StitchPlan(StitchPlan&&) noexcept;
  StitchPlan& operator=(StitchPlan&&) noexcept;

  const ImageGeometry& Grid() const;
  int Factor() const;           ///< of the grid that the global part was found on
  double MembraneBound() const; ///< no scale of a membrane is further from the exact one than this; 0 without membranes
  ///@{
  /// What was applied to each volume: gain * value + offset.
  const std::vector<double>& Gain() const;
  const std::vector<double>& Offset() const;
  ///@}

  /// Makes a box of the output; views are of its size.
  template <class T>
  void Render(const GridBox& box, const StitchOutput<T>& output, const Progress& progress = {}) const;

private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Resamples posed volumes onto \a grid (see StitchGrid) and blends them into one, in 2D and 3D: StitchPlan, and the whole of it.
template <class T>
void Stitch(const StitchParameters& parameters, const std::vector<StitchInput>& volumes, const ImageGeometry& grid,
            const StitchOutput<T>& output, const Progress& progress = {});

} // namespace echorama
