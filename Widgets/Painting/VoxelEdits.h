// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Imaging/VolumeView.h"
#include "Stroke.h"
#include <memory>

namespace echorama {

/// Keeps the voxels of a volume at a chain of strokes: paints forward, and goes back by giving touched voxels their old values.
///
/// The views are the session's own copies and are written to; they must outlive this object. What a stroke replaced is kept in
/// small blocks, once per stroke, so that going back is exact to the bit and costs as much as the stroke.
template <class T>
class VoxelEdits {
public:
  /// \param intensity, valid as read from the file; \a valid must not be empty. \param geometry of the file as it stands.
  VoxelEdits(VolumeView<T> intensity, VolumeView<unsigned char> valid, const ImageGeometry& geometry);
  ~VoxelEdits();

  /// A box of voxels that has changed, to tell views and textures; empty when nothing has.
  struct Box {
    int begin[3] = {0, 0, 0}, end[3] = {0, 0, 0};
  };

  /// Undoes back to the last stroke that both chains share, then paints forward.
  Box GoTo(const StrokeChain& chain);

  /// A stroke in the making, beyond the chain: adds points and paints at once. End() takes it back, as the finished stroke is
  /// then painted by GoTo(), or (\a keep) keeps it as what \a chain added.
  void Begin(const Brush& brush);
  Box Extend(const Eigen::Vector3d& pointMm);
  Box End(const StrokeChain& chain); ///< chain == where Begin() was plus this stroke; nullptr-like (unchanged) to take it back

private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

} // namespace echorama
