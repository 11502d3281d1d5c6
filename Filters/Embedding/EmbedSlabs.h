// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "BackgroundNoise.h"
#include "Core/Geometry/EnclosingFan.h"
#include "Embed.h"
#include <memory>
#include <utility>

namespace echorama {

/// Embeds a volume that is larger than the memory, slab by slab: first all its slices are looked at, then parts of the result can
/// be made, each from the slices near it.
///
/// The outline, and the levels that the background takes from the data, come from every so-many-th voxel along each axis (every
/// second one at least, else at most a third of smoothMm apart): those of the whole but for what speckle makes of fewer voxels.
/// The grain is measured on the part of one slab that holds most data. All else (noise, feather, labels) is worked out for every
/// voxel. Local statistics are those of the whole grid, so how the result is cut shows at most where rounding decides a grey
/// level of the background, or whether a voxel at the border of the form is inside.
class EmbedSlabs {
public:
  struct Settings {
    EmbedParameters embed; ///< featherMm below 0: FeatherDepth of the grain
    EnclosingFanParameters enclosing;
    bool matchGrain = true;
    std::uint64_t seed = 1;
    double bytes = 0.0; ///< of memory that may be used, the output of a slab included
  };

  /// For voxels of type T (see VoxelTypes.h). \throws Error(InvalidParameter); Error(BadInput) for a single slice;
  /// Error(TooLarge) when \a bytes do not even hold what is looked at
  template <class T>
  static std::unique_ptr<EmbedSlabs> Make(const Settings& settings, const ImageGeometry& data);
  virtual ~EmbedSlabs() = default;

  /// How many slices of the data are best looked at, or taken, at a time.
  int SlicesAtATime() const { return slicesAtATime_; }
  /// All slices of the data, in order: \a count of them from \a first on. \param region which voxels are real (not 0)
  virtual void Look(int first, int count, const void* intensity, const unsigned char* region) = 0;
  /// After all were looked at. \throws Error(BadInput) when there were no data, Error(TooLarge) when bytes do not hold a slab of
  /// a few slices, and what EncloseRegion, MatchNoise and Embed throw
  virtual void Plan(const Progress& progress = {}) = 0;

  ///@{ As planned.
  const ImageGeometry& Grid() const { return grid_; }
  const PlacedProbe& Form() const { return form_; }
  const BackgroundNoise& Noise() const { return noise_; }
  double FeatherMm() const { return settings_.embed.featherMm; }
  int Slabs() const { return slabs_; } ///< in which the result fits into the memory
  ///@}

  /// Of the slices [first, end) of the data that Render of slices [\a first, \a end) of the grid needs, those that are not there.
  virtual std::pair<int, int> Missing(int first, int end) const = 0;
  virtual void Take(int first, int count, const void* intensity, const unsigned char* region) = 0;
  /// Makes \a count slices of the grid from \a first on. \throws Error(InvalidParameter) when slices are missing,
  /// Error(Cancelled)
  virtual void Render(int first, int count, void* intensity, unsigned char* region, unsigned char* labels,
                      const Progress& progress = {}) = 0;

protected:
  EmbedSlabs(const Settings& settings, const ImageGeometry& data) : settings_(settings), data_(data) {}

  Settings settings_;
  ImageGeometry data_, grid_;
  PlacedProbe form_;
  BackgroundNoise noise_;
  int slabs_ = 1, slicesAtATime_ = 1;
};

} // namespace echorama
