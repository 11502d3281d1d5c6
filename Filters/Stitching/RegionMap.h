// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "CoverageMap.h"
#include <vector>

namespace echorama {

/// What a voxel of the output is to one of the volumes (dissertation 5.1).
enum class Region {
  Pure,    ///< this volume alone is there (eq. 5.1); see RegionMap::GiveCores
  Overlap, ///< this volume and others
  Empty,   ///< others alone (eq. 5.2); what no volume covers belongs to no region
};

/// The regions of n volumes in the output grid, and the distances between them.
///
/// It keeps two bytes at most per voxel of each volume's own box, nothing of where no box is; regions and distances are made for
/// one volume at a time, in the smallest box that certainly holds the answer. Grids of one slice are treated as 2D.
class RegionMap {
public:
  /// \param masks where each volume lies: 1 inside, 0 outside, in a box within the grid
  /// \param dimensions, spacing of the grid, mm
  RegionMap(std::vector<Boxed<unsigned char>> masks, const std::array<int, 3>& dimensions, const Eigen::Vector3d& spacing,
            const Progress& progress = {});

  int Count() const { return static_cast<int>(masks_.size()); }
  const CoverageMap& Coverage() const { return coverage_; } ///< how many volumes cover each voxel
  const GridBox& Box(int volume) const { return masks_[volume].box; }

  ///@{
  /// Voxels of a volume, and of its regions.
  std::ptrdiff_t InsideCount(int volume) const { return counts_[volume].inside; }
  std::ptrdiff_t PureCount(int volume) const { return counts_[volume].pure; }
  std::ptrdiff_t OverlapCount(int volume) const { return counts_[volume].inside - counts_[volume].pure; }
  ///@}

  /// Voxels that more than one volume covers.
  std::ptrdiff_t OverlapCount() const { return overlapBefore_.back(); }
  /// How many of these lie before (i, j, k): a dense numbering of the overlap.
  std::ptrdiff_t OverlapBefore(int i, int j, int k) const;

  /// How thick the overlap of a volume is on the average, in voxels: twice its voxels over the faces at which it meets where this
  /// volume or others are alone. Infinite where it meets no such place; 0: there is no overlap.
  double OverlapThickness(int volume) const;

  /// Whether a volume covers each voxel of its row (bit 0 of the bytes), from Box(volume).first[0] on.
  const unsigned char* MaskRow(int volume, int j, int k) const { return masks_[volume].Row(j, k); }
  const Boxed<unsigned char>& Mask(int volume) const { return masks_[volume]; }

  /// Gives every volume that is wholly covered by others a core, which stands for its pure region: the voxels that lie at
  /// least as far from its empty region (as deep inside the border that others reach beyond) as any other volume's voxels
  /// there lie from theirs. Where others are deeper everywhere (a small volume within a large one), the core is where the
  /// volume is deepest. So every volume keeps a say, and its weight falls to nothing at its own border; without a pure
  /// region it would have none, or end in a seam. Borders to where nothing is do not count: the result ends there anyway.
  void GiveCores(const Progress& progress = {});
  bool HasCore(int volume) const { return counts_[volume].core; }

  /// Writes 1 where a region is and 0 elsewhere, for \a count voxels of a row from (first, j, k). A core is a pure region.
  void RegionRow(Region region, int volume, int first, int j, int k, int count, unsigned char* out) const;

  /// The squared distance (mm^2) to a region of a volume, exact in the overlap region of that volume; the box holds all of
  /// that. An empty box when the region or the overlap is empty.
  Boxed<float> SquaredDistanceTo(Region region, int volume, const Progress& progress = {}) const;

  /// How deep a volume's voxels lie inside its border: the squared distance (mm^2) to the nearest voxel outside of it,
  /// whatever is there. The box is that of the volume and one voxel around it, which may reach beyond the grid.
  Boxed<float> SquaredDepth(int volume, const Progress& progress = {}) const;

private:
  struct Counts {
    std::ptrdiff_t inside = 0, pure = 0;
    bool core = false;
  };
  GridBox SearchBox(Region region, int volume, const Progress& progress) const;
  bool SearchWithin(const GridBox& scan, Region region, int volume, GridBox& found, const Progress& progress) const;

  std::vector<Boxed<unsigned char>> masks_; // bit 0: inside, bit 1: core
  std::vector<Counts> counts_;
  Eigen::Vector3d spacing_;
  CoverageMap coverage_;
  std::vector<std::ptrdiff_t> overlapBefore_; // per row of the grid, and the whole at the end
};

} // namespace echorama
