// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Imaging/VolumeView.h"
#include "Stroke.h"
#include <memory>

namespace echorama {

/// VoxelEdits of any voxel type.
class AnyVoxelEdits {
public:
  virtual ~AnyVoxelEdits() = default;

  /// The box of blocks in which voxels have changed, to tell views and textures; empty when none has.
  struct Box {
    int begin[3] = {0, 0, 0}, end[3] = {0, 0, 0};
    bool Empty() const { return end[0] <= begin[0]; }
  };

  /// Undoes back to the last stroke that both chains share, then paints forward. A stroke in the making is taken back first.
  virtual Box GoTo(const StrokeChain& chain) = 0;

  /// A stroke in the making, beyond the chain: adds points and paints at once. Distances count from the whole path so far, so
  /// that the voxels are those of the finished stroke at any moment.
  /// \throws Error(InvalidParameter) as Append; Extend throws Error(NotPossible) without Begin().
  virtual void Begin(const Brush& brush) = 0;
  virtual Box Extend(const Eigen::Vector3d& pointMm) = 0;
  /// Ends it, and goes to \a chain: where that is the chain before plus this very stroke, what is painted stays.
  virtual Box End(const StrokeChain& chain) = 0;
};

/// Keeps the voxels of a volume at a chain of strokes: paints forward, and goes back by giving touched voxels their old values.
///
/// A voxel at the distance d from the path of a brush of radius r and hardness h weighs w = 1 for d <= h r, and falls off as
/// w = 1 - s^2 (3 - 2 s), s = (d - h r) / (r - h r), to 0 at d = r. Paint makes v + w opacity (intensity - v) of the value v it
/// had when the stroke began, rounded to the voxel type (a voxel that is not finite counts as 0); what it changes so becomes real
/// unless the brush keeps inside what is. Carve and Restore take or give back all voxels with d <= r, at once.
///
/// The views are the session's own copies and are written to; they must outlive this object. What a stroke replaced is kept in
/// blocks of 8^3 voxels, once per stroke, so that going back is exact to the bit and costs as much as the stroke. Memory grows
/// with the blocks that strokes touch, whatever the size of the volume.
template <class T>
class VoxelEdits : public AnyVoxelEdits {
public:
  /// \param intensity, valid as read from the file; \a valid must not be empty. \param geometry of the file as it stands.
  /// \throws Error(BadInput) when sizes do not agree.
  VoxelEdits(VolumeView<T> intensity, VolumeView<unsigned char> valid, const ImageGeometry& geometry);
  ~VoxelEdits() override;
  Box GoTo(const StrokeChain& chain) override;
  void Begin(const Brush& brush) override;
  Box Extend(const Eigen::Vector3d& pointMm) override;
  Box End(const StrokeChain& chain) override;
  /// What is kept to go back, bytes.
  std::size_t MemoryBytes() const;

private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

} // namespace echorama
