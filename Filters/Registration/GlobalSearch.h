// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "PlacedVolume.h"
#include "RotationCover.h"
#include <limits>
#include <string>
#include <vector>

namespace echorama {

/// Which poses the global search looks at, and how closely.
struct GlobalSearchParameters {
  double coneDegrees = 180.0;
  double reachMm = std::numeric_limits<double>::infinity(); ///< the valid centroid moves at most so far from the start, > 0
  double minimumOverlap = 0.1;
  int resolution = 40;
  double stepDegrees = 20.0;
  int candidates = 12;

  /// \throws Error(InvalidParameter)
  void Check() const;
};

/// All but the reach, which may be infinite.
ParameterList Describe(GlobalSearchParameters& p);

/// A pose that looks right at low resolution.
struct GlobalCandidate {
  Pose volumeToWorld = Pose::Identity(); ///< of the moving volume
  double ncc = 0.0;     ///< masked normalised cross-correlation there, of locally normalised intensities, [-1, 1]
  double overlap = 0.0; ///< share of the smaller volume's valid region that lies in the other, [0, 1]
  /// How far the peak stood above the other translations of its rotation, in their standard deviations, before it was refined.
  double sharpness = 0.0;
};

struct GlobalSearchResult {
  std::vector<GlobalCandidate> candidates; ///< best first, no two alike (a step or more apart, as the mean over the volume)
  int rotations = 0;                       ///< tried
  double voxelMm = 0.0;                    ///< of the low resolution
};

/// Looks for the pose of \a moving beside \a fixed from far off, at low resolution.
///
/// For each of a cover of rotations (RotationCover) the masked normalised cross-correlation is worked out over all
/// translations at once in Fourier space (Padfield, IEEE TIP 21(5), 2012), on intensities of which the local mean is taken off
/// and which are divided by the local standard deviation: gain and slow changes of brightness do not count. Poses are ranked
/// by sqrt(overlap) atanh(correlation), so that small overlaps do not win by chance. The best peaks are then refined in space
/// at the resolution asked for (they may turn a little beyond the cone, but do not leave the reach), and the best that differ
/// are kept. Voxels count by their reliability where there is one. Contrast must not be inverted. A small volume beside a
/// large one raises the resolution. When no pose within cone and reach has the overlap there are no candidates.
/// The answer does not depend on the threads. \throws Error(InvalidParameter); Error(BadInput) that names the volume when it
/// is constant, has fewer than 100 real voxels, is not three-dimensional, or is nowhere reliable; Error(Cancelled).
GlobalSearchResult GlobalSearch(const PlacedVolume& fixed, const PlacedVolume& moving,
                                const GlobalSearchParameters& parameters = {}, const Progress& progress = {});

} // namespace echorama
