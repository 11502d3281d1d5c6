// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Stitching/CoarseVolume.h"
#include "Filters/Stitching/Stitch.h"

namespace echorama {

struct ContestantStitch {
  Volume<float> values;           ///< 0 where no volume is
  Volume<unsigned char> coverage; ///< how many volumes are there
};

///@{
/// Volumes of one gain, stitched onto a grid by what is known from others: Burt and Adelson 1983 (BlendMultiband, five octaves),
/// and Peleg 1981 (OffsetFields). At each voxel the volume is shown that has the largest scale by distance (dissertation
/// eq. 5.3); by seams, the one that a minimum cut chooses (CutSeams), with offsets.
ContestantStitch StitchByMultiband(const std::vector<StitchInput>& volumes, const ImageGeometry& grid);
ContestantStitch StitchByOffsets(const std::vector<StitchInput>& volumes, const ImageGeometry& grid);
ContestantStitch StitchBySeams(const std::vector<StitchInput>& volumes, const ImageGeometry& grid);
///@}

/// The volume with the largest scale * trust, the first of equals: the seam without regard to what is there.
/// \return label per voxel of the grid, noVolume where nothing is
Volume<unsigned short> LargestScale(const std::vector<CoarseVolume>& volumes, const std::array<int, 3>& dimensions);

} // namespace echorama
