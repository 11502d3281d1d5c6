// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Stitch.h"
#include <limits>
#include <vector>

namespace echorama {

/// How visible the borders of one kind are: 1 is not at all. NaN where there are none wide enough to measure.
struct SeamVisibility {
  double mean = std::numeric_limits<double>::quiet_NaN();     ///< of the jump of local means
  double gradient = std::numeric_limits<double>::quiet_NaN(); ///< of the jump of gradient energy
  std::ptrdiff_t faces = 0;                                   ///< measured
};

/// What MeasureStitch() tells. Numbers that could not be measured (no border, no overlap as wide as a window) are NaN.
struct StitchQualityReport {
  SeamVisibility borders; ///< where a volume begins or ends
  SeamVisibility cuts;    ///< within overlaps, where the result changes from one volume to another
  double seamMean = std::numeric_limits<double>::quiet_NaN();     ///< the larger of the two
  double seamGradient = std::numeric_limits<double>::quiet_NaN(); ///< the larger of the two

  double textureKept = std::numeric_limits<double>::quiet_NaN(); ///< 1: all; 0.71: what a mean of two leaves of their speckle
  double snr = std::numeric_limits<double>::quiet_NaN();         ///< of the result inside overlaps
  double snrSources = std::numeric_limits<double>::quiet_NaN();  ///< of the volumes at the same places
  std::ptrdiff_t overlapWindows = 0;                             ///< measured

  ///@{
  /// Against a reference: mean absolute difference, grey levels, inside and outside overlaps.
  double errorOverlap = std::numeric_limits<double>::quiet_NaN();
  double errorOutside = std::numeric_limits<double>::quiet_NaN();
  ///@}
  std::ptrdiff_t overlapVoxels = 0; ///< voxels of the result where two volumes or more are
};

struct StitchQualityParameters {
  int stride = 3; ///< the volumes of a scan have plenty of windows
};

ParameterList Describe(StitchQualityParameters& p);

/// Measures what stitching did: how visible its seams are, how much of the texture it kept, and how far it is from a reference.
///
/// Windows are 5 x 5 x 5 voxels (5 x 5 in 2D, less where the grid has fewer), and lie wholly where the result is valid. Volumes
/// are seen as the grid sees them, through RowSampler: what resampling smooths is not held against the blend.
///
/// * Seams. On either side of a border is a window. The jump of their means, averaged over all borders, is divided by the same
///   jump in the volumes that are shown on either side, where they cover both windows; the same for gradient energy (mean
///   squared difference of neighbours within a window), whose jump is the absolute log of the ratio. So anatomy and speckle at
///   that place are in both, and a perfect stitch gives 1. Where hardly any volume reaches across (overlaps thinner than a
///   window), the jumps between windows within single volumes are the measure. Borders are faces between voxels where the set of
///   volumes changes. Cuts are faces within one overlap where the volume changes that the result follows most closely (the
///   difference to it varies least within a window), clearly so on either side: four times less than the difference to the other.
///   They are found from the result itself, whatever the method says of its weights. If fewer than a third of such changes are
///   that clear, the blend is smooth and has no cuts.
/// * Texture. The median, over windows that two volumes or more cover wholly, of the local standard deviation of the result
///   over the mean of the volumes' (weighted by their reliability at the middle, at least 0.01). Speckle SNR is the mean over
///   the standard deviation in the same windows, its median. Windows in which the volumes do not vary are left out.
/// * Reference. Another volume, such as the full reconstruction, sampled like the others; its errors count as those of the
/// result.
///
/// Cost: volumes are resampled in tiles with their margins (about twice each); memory is that of some tiles per thread.
/// \param stitched, valid of the size of \a grid; an empty \a valid means every voxel where a volume is
/// \param reference nullptr: none
/// \throws Error(BadInput) without volumes or when sizes do not fit, Error(InvalidParameter), Error(Cancelled)
template <class T>
StitchQualityReport MeasureStitch(const std::vector<StitchInput>& volumes, const ImageGeometry& grid,
                                  VolumeView<const T> stitched, VolumeView<const unsigned char> valid,
                                  const AnyPosedVolume* reference = nullptr, const StitchQualityParameters& parameters = {},
                                  const Progress& progress = {});

} // namespace echorama
