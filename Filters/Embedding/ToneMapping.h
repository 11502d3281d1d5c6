// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"
#include "LocalStatistics.h"

namespace echorama {

struct ToneMappingParameters {
  double smoothMm = 3.0;
  bool matchDeviation = true; ///< the grain gets one deviation everywhere, so that it can be given that of its new neighbours
};

ParameterList Describe(ToneMappingParameters& p);

/// Removes what varies slowly from a volume, and leaves its grain; in place is allowed.
///
/// With matchDeviation the result is (I - B) / S, with B and S the local mean and deviation (GrainStatistics): mean 0 and
/// deviation 1 around every voxel. Else it is I / B, of mean 1 (dissertation 6.5). Both are measured once more on the result and
/// corrected, because the mean of a quotient is not the quotient of means: left alone, that is a step in brightness at the seam.
/// Where there is nothing to divide by (B or S below a thousandth of that of the whole) there is no grain: 0, or 1. Outside of
/// the region it is that too. \param region where voxels count (not 0); empty: everywhere
/// \param wanted the part of the region whose grain is asked for (not 0), elsewhere it is that of the first round; empty: all
/// \throws Error(BadInput) for views of different shape, Error(InvalidParameter), Error(Cancelled)
void ExtractGrain(const ToneMappingParameters& parameters, VolumeView<const float> intensity,
                  VolumeView<const unsigned char> region, const Eigen::Vector3d& spacing, VolumeView<float> grain,
                  const Progress& progress = {}, VolumeView<const unsigned char> wanted = {});

///@{ The same for noise that is never there as a whole: from \a sums over the blocks of its whole grid come those of what the
/// first round leaves of it, for slices of blocks [begin, end), and from the statistics of both the grain of any part. Within a
/// block they take local mean and deviation as those of its middle: for noise, which has no slope of its own, that is within
/// a thousandth of its deviation. Where the deviation is 0 there is no grain.
BlockSums SumsOfFirstRound(const ToneMappingParameters& parameters, const BlockSums& sums, const LocalStatistics& first,
                           int begin, int end);
void ExtractGrain(const ToneMappingParameters& parameters, const LocalStatistics& first, const LocalStatistics& second,
                  VolumeView<float> noise, VolumeView<const unsigned char> wanted, const Progress& progress = {});
///@}

/// The reverse, for one voxel: grain on a local mean, and with matchDeviation of a local deviation (dissertation 6.6).
inline float ApplyGrain(bool matchDeviation, float grain, float mean, float deviation)
{
  return matchDeviation ? mean + deviation * grain : mean * grain;
}

} // namespace echorama
