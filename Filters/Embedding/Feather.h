// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"

namespace echorama {

/// What a voxel of an embedded volume is.
enum class EmbeddedVoxel : unsigned char {
  Outside = 0,  ///< nothing is there
  Data = 1,     ///< a voxel of the volume that was embedded, to the last bit
  Blend = 2,    ///< such a voxel, mixed with background
  Invented = 3, ///< background alone
};

class LocalStatistics;

struct FeatherParameters {
  double featherMm = 3.0;
  bool keepTexture = true;
  double smoothMm = 3.0;
};

ParameterList Describe(FeatherParameters& p);

/// How deep a feather is that is as fine as the data: twice the length of their grain (mm; 0: not known, as much as four voxels
/// are), at least three voxels, and at most the 3 mm of the default.
double FeatherDepth(double grainMm, const Eigen::Vector3d& spacing);

/// How much of the data a voxel shows: 0 outside the region, 1 at depths of featherMm or more, linear in between. Depth is the
/// distance to the nearest voxel that shows background: outside of the region, but in \a backgroundRegion (empty: everywhere). So
/// data do not fade where the background ends as well, nor at the ends of the grid.
/// Source: dissertation 6.5.
void FeatherWeights(const FeatherParameters& parameters, VolumeView<const unsigned char> region,
                    VolumeView<const unsigned char> backgroundRegion, const Eigen::Vector3d& spacing, VolumeView<float> weights,
                    const Progress& progress = {});

/// Overlays data on a background: \a intensity holds the data and gets the result. Data of weight 1, and data without a
/// background below them, are not touched. With keepTexture the local means are mixed by the weights w and 1 - w, and deviations
/// from them by w / n and (1 - w) / n with n^2 = w^2 + (1 - w)^2: the mixture has the deviation of its parts, which are
/// independent. Integers are rounded to the nearest and clamped to their range. \param weights of FeatherWeights(); \param region
/// of the data; \param backgroundRegion where there is a background (empty: everywhere) \param labels EmbeddedVoxel of every
/// voxel \param own, others the local means of the data, and of the background, with smoothMm, where they are known already
/// \throws Error(BadInput) for views of different shape, Error(InvalidParameter), Error(Cancelled)
template <class T>
void Feather(const FeatherParameters& parameters, VolumeView<const float> weights, VolumeView<const unsigned char> region,
             VolumeView<const float> background, VolumeView<const unsigned char> backgroundRegion, const Eigen::Vector3d& spacing,
             VolumeView<T> intensity, VolumeView<unsigned char> labels, const Progress& progress = {},
             const LocalStatistics* own = nullptr, const LocalStatistics* others = nullptr);

} // namespace echorama
