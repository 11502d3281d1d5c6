// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "LargestCrop.h"
#include <cstdint>
#include <limits>

namespace echorama {

struct EmbedQualityParameters {
  double shellMm = 5.0;
  double leastJump = 2.0;
  double mostDeviation = 0.15;
  double featherMm = 3.0;
  int randomSurfaces = 24;
  std::uint64_t seed = 1;
};

ParameterList Describe(EmbedQualityParameters& p);

/// How much changes from one side of a surface to the other. Numbers that could not be measured are NaN.
struct SurfaceJumps {
  std::ptrdiff_t patches = 0; ///< measured
  ///@{
  /// Over patches, by their area, of the size of the jump of the mean: grey levels.
  double mean = std::numeric_limits<double>::quiet_NaN();
  double median = std::numeric_limits<double>::quiet_NaN();
  double percentile95 = std::numeric_limits<double>::quiet_NaN();
  ///@}
  double bias = std::numeric_limits<double>::quiet_NaN(); ///< mean of (outside - inside) with its sign, grey levels
  ///@{
  /// Over patches, by their area, of the standard deviation outside over that inside.
  double deviationRatio = std::numeric_limits<double>::quiet_NaN(); ///< median
  double deviationRatio5 = std::numeric_limits<double>::quiet_NaN();
  double deviationRatio95 = std::numeric_limits<double>::quiet_NaN();
  ///@}
};

/// What MeasureEmbedding() tells.
struct EmbedQualityReport {
  SurfaceJumps border;                                              ///< of the data to what was invented
  SurfaceJumps reference;                                           ///< surfaces at random inside the data
  double borderMeasured = std::numeric_limits<double>::quiet_NaN(); ///< how much of the border had two sides to measure, [0, 1]
  double jumpLimit = std::numeric_limits<double>::quiet_NaN();      ///< the larger of leastJump and reference.percentile95
  bool jumpPasses = false;      ///< border.percentile95 <= jumpLimit; false where there was no border to measure
  bool deviationPasses = false; ///< border.deviationRatio within mostDeviation of 1; false where it was not measured

  std::ptrdiff_t data = 0, blend = 0, invented = 0; ///< voxels, as labelled

  ///@{
  /// Voxels of which the labels or the feather say what is not so; all 0 in a true embedding. -1: no original was given.
  std::ptrdiff_t altered = -1;   ///< labelled as data, but not those of the original to the last bit
  std::ptrdiff_t pretended = -1; ///< labelled as data or blend where the original has none
  std::ptrdiff_t lost = -1;      ///< deeper in the original than the feather reaches, but not labelled as data
  ///@}

  Crop crop; ///< what cropping would have left of data and blend; its share is NaN without a fan
};

/// Measures how visible the border of embedded data is, whether the data are untouched, and what embedding gained.
///
/// * The seam. The border lies between voxels that are labelled as seen (data, blend) and invented ones. It is cut into patches,
///   the border voxels within one cube of an even lattice, shellMm wide. A voxel within shellMm of the border belongs to the
///   patch whose middle is nearest. The jump of a patch is its mean outside (invented) minus its mean inside (seen), without the
///   sign but for the bias; its ratio the standard deviation outside over that inside, both of what is left when the slope that
///   fits the side best is taken off: anatomy has slopes, the deviation is to be that of the texture. Patches with less than a
///   tenth of a full shell (or less than eight voxels) on either side are left out; borderMeasured tells how much is left. Each
///   patch counts by its border voxels, so that what a corner of a cube cuts off counts little.
/// * The reference. The same, with the same patches and shells, at surfaces inside the data (label data on both sides), each
///   through a random voxel: planes, spheres of 2 to 10 shells, and the border moved inwards, in turn. So natural edges and
///   speckle are in it.
/// * The verdict. Like is held against like: 95 % of the border's area must jump no more than 95 % of that inside the anatomy
///   does (or than leastJump). The median ratio of deviations must be within mostDeviation of 1.
/// * Truth. Compared with the original bit by bit, where one is given: see the report's fields.
/// * Gain. LargestCrop() of what is seen, where a fan is given.
///
/// Values that are not finite do not count. The result does not depend on the number of threads. Cost: two distance maps, and two
/// passes over the labels for the border and each random surface; memory is eight bytes per voxel.
/// \param labels of EmbeddedVoxel, of the size of \a grid
/// \param original on voxels of the same lattice (shifted by whole voxels) or nullptr; \param fan the outline or nullptr
/// \throws Error(BadInput) when sizes or lattices do not agree, Error(InvalidParameter), Error(Cancelled)
template <class T>
EmbedQualityReport MeasureEmbedding(VolumeView<const T> embedded, VolumeView<const unsigned char> labels,
                                    const ImageGeometry& grid, const PosedVolume<T>* original = nullptr,
                                    const PlacedProbe* fan = nullptr, const EmbedQualityParameters& parameters = {},
                                    const Progress& progress = {});

} // namespace echorama
