// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Readers/ImageHeader.h"

namespace echorama {

/// Makes the geometry of \a header, whose dimensions are set, from an affine map of indices to mm (LPS), as formats with a
/// matrix hold it: spacing, direction and origin, slices in reverse where the axes are left-handed (as PlaceAxes does).
/// A map that is not a pose: where the nearest pose moves no voxel by more than 0.1 voxel it is taken (with a note from 0.001
/// voxel on).
/// \throws Error(BadFile) that names the file when the map is singular, sheared or not finite.
void PlaceAffine(ImageHeader& header, const Eigen::Matrix<double, 3, 4>& affine);

} // namespace echorama
