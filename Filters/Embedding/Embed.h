// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "BlockRows.h"
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"
#include "Diffusion.h"
#include "Feather.h"
#include "Filters/Stitching/GridBox.h"
#include "LocalStatistics.h"

namespace echorama {

struct EmbedParameters : FeatherParameters { // smoothMm is that of all steps
  bool matchContrast = true;
  DiffusionParameters diffusion; ///< how values at the surface of the data spread
  int diffusionVoxels = 2000000;
};

ParameterList Describe(EmbedParameters& p);

/// Bytes of memory that embedding on a grid takes beside its arrays of intensities: noise, masks, weights, and the lattices of
/// local statistics, which are as fine as the voxels where these are large.
double EmbedMemory(const EmbedParameters& parameters, const ImageGeometry& grid);

/// Puts data into a background of noise that looks as if it had been seen with them (dissertation 6.3 to 6.5).
///
/// The local mean and deviation of the data at their surface, without single bright echoes (SpeckleLevel), spread outwards and
/// inwards (Diffuse); the noise loses its own and
/// gets these (ExtractGrain); the data are laid over it with a soft border (Feather). Data deeper than featherMm are not touched.
/// \param region where the data are (not 0), finite numbers all
/// \param noise in: any noise, where \a form is; out: the background where it shows, and not a number below the data. Voxels
/// that are not finite, and those where it does not vary, get no grain.
/// \param form the outline of the result (not 0); empty: the whole grid. Data outside of it stay.
/// \param intensity in: the data where \a region is; out: the result, 0 outside of form and region
/// \param labels out: EmbeddedVoxel of every voxel
/// \throws Error(BadInput) when the region is empty or shapes differ, Error(InvalidParameter), Error(Cancelled)
template <class T>
void Embed(const EmbedParameters& parameters, VolumeView<const unsigned char> region, const Eigen::Vector3d& spacing,
           VolumeView<float> noise, VolumeView<const unsigned char> form, VolumeView<T> intensity,
           VolumeView<unsigned char> labels, const Progress& progress = {});

/// The local mean and deviation of the data at their surface, spread to wherever background shows: a number per block of voxels.
struct EmbedLevels {
  Blocks blocks;
  Volume<double> mean, deviation;
};

/// The first half of Embed: what a part of the result depends on beyond its neighbourhood.
/// \throws as Embed
template <class T>
EmbedLevels LevelsAround(const EmbedParameters& parameters, VolumeView<const unsigned char> region,
                         const Eigen::Vector3d& spacing, VolumeView<const unsigned char> form, VolumeView<const T> intensity,
                         const Progress& progress = {});

/// Local statistics of the whole grid, wherever a part of it is read: of the noise as it is and after the first round of
/// ExtractGrain, of the data, and the means of the background.
struct EmbedStatistics {
  LocalStatistics noise, grain, data, background;
};

/// The second half, for a part of the grid of the levels that begins at voxel \a first. Only its box \a wanted is made; region
/// and form must be there as far around it as the feather reaches, and where the grid does not end.
/// \throws as Embed, but a part may be without data
template <class T>
void EmbedPart(const EmbedParameters& parameters, const EmbedLevels& levels, const EmbedStatistics& statistics,
               const std::array<int, 3>& first, const GridBox& wanted, VolumeView<const unsigned char> region,
               const Eigen::Vector3d& spacing, VolumeView<float> noise, VolumeView<const unsigned char> form,
               VolumeView<T> intensity, VolumeView<unsigned char> labels, const Progress& progress = {});

} // namespace echorama
