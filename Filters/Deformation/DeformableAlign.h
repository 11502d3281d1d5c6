// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Imaging/DisplacementField.h"
#include "Filters/Registration/LocalAlign.h"

namespace echorama {

/// A volume that lies where it belongs as well as a rigid motion can tell.
struct DeformableVolume {
  const MetricPyramid* features = nullptr; ///< of "local-ncc" or "ncc": metrics that compare values
  Pose volumeToWorld = Pose::Identity();
  const DisplacementField* field = nullptr; ///< its own displacement, when that is known already; none: rigid
};

struct DeformableAlignParameters {
  double controlSpacingMm = 30.0; ///< twice as much on the first level
  double bendingWeight = 200.0;   ///< of the bending energy, in voxels of the last level that agree as little as they do
  double minimumGain = 0.2;       ///< of what they then say of each other
  int levels = 2;
  int iterations = 15;
  double finestMm = 1.0;
  double minimumOverlap = 0.02; ///< by weight
};

ParameterList Describe(DeformableAlignParameters& p);

struct DeformableAlignResult {
  DisplacementField field;          ///< where the moving volume shows what belongs at x: at x + u(x); zero when it is not applied
  bool isApplied = false;           ///< false: the rigid result stands
  std::string reason;               ///< why not; empty when applied
  double similarityBefore = 0.0;    ///< local correlation of what is seen, by weight, on the last level: 1 identical, 0 chance
  double similarityAfter = 0.0;     ///< of the field that was found, applied or not
  double gain = 0.0;                ///< share of the information (-log(1 - r^2)), on the last level, that the field adds
  double overlap = 0.0;             ///< share of the moving volume that lies in others, by weight
  double bendingEnergy = 0.0;       ///< DisplacementField::BendingEnergy() of the field that was found
  double largestMm = 0.0;           ///< its longest displacement in the overlap
  double smallestDeterminant = 1.0; ///< DisplacementField::SmallestDeterminant() of it
  double voxelMm = 0.0;             ///< of the last level
  int iterations = 0;               ///< over all levels
};

/// What a rigid motion leaves over: finds the smooth displacement that makes a moving volume agree with others.
///
/// Free-form deformation (Rueckert et al. 1999): cubic B-splines on a lattice along the axes of the moving volume over the
/// overlap, whose coefficients minimise the sum of W / 2 log(1 - r^2) over boxes of 12 mm, r the correlation of what the metric
/// sees (weighted by both volumes, W in all, over the overlap alone), plus bendingWeight times the bending energy, by
/// Levenberg-Marquardt, coarse to fine. Beyond the overlap nothing but the bending counts, and the field goes smoothly to zero
/// within three spacings of the lattice. What is left of a rigid motion becomes part of the field.
///
/// Structures look a little different from everywhere, which a field can follow as well. So one that adds less than minimumGain
/// is not applied, nor one that folds anywhere: the result says why and holds a zero field.
/// The result does not depend on the number of threads.
/// \throws Error(InvalidParameter); Error(BadInput) without a fixed volume or for pyramids of descriptors;
/// Error(NotPossible) when they overlap by less than minimumOverlap; Error(Cancelled).
DeformableAlignResult DeformableAlign(const std::vector<DeformableVolume>& fixed, const DeformableVolume& moving,
                                      const DeformableAlignParameters& parameters = {}, const Progress& progress = {});

/// The same for many volumes, in turn: the one that lies in the placed ones most comes next, and agrees with all of them as
/// their fields have it. The volume number \a fixed keeps a zero field. One that overlaps too little is left as it is, with the
/// reason. Ties go to the first.
/// \returns one result per volume
/// \throws Error(InvalidParameter) also when \a fixed is not a volume, Error(BadInput) for fewer than two volumes.
std::vector<DeformableAlignResult> DeformInTurn(const std::vector<DeformableVolume>& volumes, int fixed,
                                                const DeformableAlignParameters& parameters = {}, const Progress& progress = {});

} // namespace echorama
