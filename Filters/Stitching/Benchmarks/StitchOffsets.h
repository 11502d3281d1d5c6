// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Filters/Stitching/CoarseVolume.h"
#include <Eigen/Core>
#include <vector>

namespace echorama {

/// Offsets that make volumes meet at the seams between their labels (Peleg 1981): one smooth field per volume, to be added to it.
/// At voxels on either side of a seam it is half of what the smooth parts (CoarseVolume::low) differ there, so that both meet
/// half-way; 0 where the volume is alone, unless a seam passes there; a membrane (SolveMembrane) in the overlap between. Faces
/// where only one volume is on both sides, and the other on none, are no seams: there is nothing to compare.
/// \param labels which volume is shown at each voxel of the grid (CutSeams, LargestScale)
/// \param spacing of the grid, mm
/// \return a field per volume, in the box of its inside; 0 where the volume is not. The same on any number of threads.
/// \throws Error(InvalidParameter) for boxes beyond the grid of the labels; Error(Cancelled)
std::vector<Boxed<float>> OffsetFields(const std::vector<CoarseVolume>& volumes, const Volume<unsigned short>& labels,
                                       const Eigen::Vector3d& spacing, const Progress& progress = {});

} // namespace echorama
