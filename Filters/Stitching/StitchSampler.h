// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "RowSampler.h"
#include "Stitch.h"
#include <memory>
#include <vector>

namespace echorama {

const ImageGeometry& GeometryOf(const StitchInput& input);

/// The geometry of a box of a grid.
ImageGeometry Cropped(const ImageGeometry& grid, const GridBox& box);

/// Every \a factor-th voxel of a grid along each axis (which keeps at least one), in phase: voxel I of it is voxel
/// factor I + CoarseStart() of the grid.
ImageGeometry Coarsened(const ImageGeometry& grid, int factor);
inline int CoarseStart(int count, int factor)
{
  return (std::min(count, factor) - 1) / 2;
}

/// A field on a box of a coarse grid, read at the voxels of another.
class CoarseSampler {
public:
  /// \param known where \a values are (bit 0); both must outlive the sampler
  CoarseSampler(const Boxed<float>& values, const Boxed<unsigned char>& known, const ImageGeometry& coarse,
                const ImageGeometry& grid);
  explicit CoarseSampler(RowSampler<float> sampler) : sampler_(std::move(sampler)) {}

  /// Values at the voxels i of [first, end) of a row where wanted[i - first] has bit 0; \a fallback where there is none.
  template <class A>
  void Row(int j, int k, int first, int end, const unsigned char* wanted, float fallback, A* values) const;

private:
  RowSampler<float> sampler_;
};

/// One volume as stitching reads it, row by row of a grid.
class StitchSampler {
public:
  /// \throws Error(BadInput) that names the volume when its views do not fit its geometry
  StitchSampler(const StitchInput& input, const ImageGeometry& grid, double reliabilityFloor);

  const GridBox& Box() const { return box_; }
  bool HasTrust() const { return trust_ != nullptr; }

  /// For the row (j, k) of Box(): as RowSampler's.
  void Inside(int j, int k, unsigned char* inside) const;
  template <class A>
  void Values(int j, int k, const unsigned char* inside, A* values) const;
  template <class A>
  void Read(int j, int k, unsigned char* inside, A* values) const;
  /// How far the voxels can be trusted, in [floor, 1]; only with HasTrust().
  void Trust(int j, int k, const unsigned char* inside, float* trust) const;

private:
  using AnySampler = std::variant<RowSampler<unsigned char>, RowSampler<short>, RowSampler<unsigned short>, RowSampler<float>,
                                  RowSampler<double>>;
  AnySampler sampler_;
  GridBox box_;
  std::shared_ptr<const RowSampler<float>> trust_;
  float floor_;
};

/// The masks of volumes in a grid.
std::vector<Boxed<unsigned char>> MasksOf(const std::vector<StitchSampler>& samplers, const Progress& progress);

/// Whether any voxel of a volume is in the grid, and whether any is in an overlap.
struct Presence {
  bool isInside = false, isShared = false;
};
Presence PresenceOf(const std::vector<StitchSampler>& samplers, std::size_t volume);

} // namespace echorama
