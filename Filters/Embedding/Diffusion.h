// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"
#include <array>
#include <vector>

namespace echorama {

struct DiffusionParameters {
  double insideExponent = 6.0;  ///< d where the region is
  double outsideExponent = 4.0; ///< d elsewhere
  bool exact = false;
  double accuracy = 0.002; ///< no bound: see Documentation/filters/SurfaceDiffuser.md for what was measured
};

ParameterList Describe(DiffusionParameters& p);

/// The values that are spread: where they lie and what they are.
struct DiffusionSources {
  std::vector<std::array<int, 3>> voxels; ///< indices in the grid, each but once
  std::vector<float> values;              ///< values[c * voxels.size() + s]: channel c of source s, finite
  int channels = 1;                       ///< 1 ... 4: spread with the same weights, at little more than the cost of one
};

/// D(x) = sum_s |x - s|^-d v_s / sum_s |x - s|^-d, distances in mm; on a source voxel its own value.
///
/// Small d: every source is heard everywhere; large d: the nearest one alone. Never overflows or underflows for any d. A
/// constant comes out as that constant, to the last bit; no result lies outside the range of its channel's values. The same
/// for any number of threads. Source: dissertation 6.3, equations 6.2 to 6.4.
/// \param spacing mm, > 0
/// \param region which exponent a voxel has (not 0: insideExponent); empty: outside everywhere
/// \param wanted empty: all voxels; else only where not 0 (others are not touched, and their time is saved)
/// \param result one view per channel, all of the grid's size
/// \throws Error(BadInput) without sources, for sources that are not in the grid, not finite or twice on one voxel, and for
///   views of different shape; Error(InvalidParameter), Error(Cancelled)
void Diffuse(const DiffusionParameters& parameters, const DiffusionSources& sources, const Eigen::Vector3d& spacing,
             VolumeView<const unsigned char> region, VolumeView<const unsigned char> wanted,
             const std::vector<VolumeView<float>>& result, const Progress& progress = {});

} // namespace echorama
