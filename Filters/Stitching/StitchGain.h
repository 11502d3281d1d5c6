// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "CoarseVolume.h"
#include <Eigen/Core>
#include <vector>

namespace echorama {

struct StitchGains {
  std::vector<double> gain, offset; ///< volume v is shown as gain[v] * value + offset[v]
  /// Correlation of the details (value - low) of each pair of volumes where they overlap, in [0, 1] (negative ones are 0); 1 on
  /// the diagonal; 0 for pairs that do not overlap enough to tell.
  Eigen::MatrixXd detailCorrelation;
};

/// Marks the voxels at which EstimateStitchGains() will look at a volume: some ten thousand per pair. Only there have the other
/// fields to be filled in. Needs to know where each volume is inside.
void MarkStitchSamples(std::vector<CoarseVolume>& volumes);

/// Gain and offset per volume that make overlapping volumes agree, by least squares over the graph of overlaps.
///
/// Speckle and errors stand in both volumes of a pair, so its gain is the ratio of the standard deviations of their smooth
/// parts (a regression of one on the other would find too small a slope), and its offset what then is between the means.
/// Voxels that differ far more than most do (a shadow in one volume) are left out; as long as they are the minority
/// they do not count at all. Voxels where the product of trusts is below 0.05 are not looked at; others count by that product.
/// Pairs count by how many voxels they share, for the gain also by how closely they agree, and less when they contradict the
/// rest.
///
/// In every group of volumes that overlaps connect the geometric mean of the gains is 1, and the mean of the offsets 0. A pair
/// that shares fewer than 27 voxels says nothing; one whose smooth parts are constant, hardly correlated (below 0.3) or differ
/// by more than a factor of four says nothing of the gain. Volumes of which nothing is said keep gain 1 and offset 0.
/// \param correct false: gains stay 1 and offsets 0; only correlations are measured
/// \throws Error(BadInput) when the boxes of a volume differ
StitchGains EstimateStitchGains(const std::vector<CoarseVolume>& volumes, bool correct);

} // namespace echorama
