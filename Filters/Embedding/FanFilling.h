// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Imaging/VolumeView.h"

namespace echorama {

/// Fills the fan of a probe, on any grid, with the noise of another: any depths, angles and radii, larger or smaller.
///
/// Depth and the middles of fan and sweep stay where they are; lengths stay what they are along the beams, and halfway down
/// also across them. So speckle keeps its scale, and what the scanner does with depth its depth. Where the noise ends it goes on
/// mirrored, as often as it takes: nothing is stretched and no hole is left. A hole in the noise's own mask is one in the
/// result, and so are its mirror images. The outermost voxel of the noise is not used. When \a target is \a noiseFan, what
/// comes out within it is the noise, resampled.
///
/// The noise is read along its beams (SampleBeams) at its voxel size; the samples of the target are those, mirrored, and are
/// then scan converted (ScanConvert says what is inside). Both steps interpolate linearly.
/// \param intensity, valid views of the size of \a grid, overwritten: 0 in both outside of the target and in holes
/// \throws Error(BadInput) for noise of a single plane when the target sweeps, a pose that is not rigid, or a grid, views
/// and a volume that do not agree; Error(InvalidParameter) for a probe that does not pass Check(); Error(TooLarge) when the
/// target would take more than 2^31 - 1 samples; Error(Cancelled).
template <class T>
void FillFan(const PosedVolume<T>& noise, const PlacedProbe& noiseFan, const PlacedProbe& target, const ImageGeometry& grid,
             VolumeView<float> intensity, VolumeView<unsigned char> valid, const Progress& progress = {});

/// The same from samples that are there already: a beam volume of \a noiseFan, NaN where not real, of which \a rim samples, beams
/// and steps at either end are not used.
void FillFanFromBeams(VolumeView<const float> beams, const ProbeGeometry& noiseFan, const std::array<int, 3>& rim,
                      const PlacedProbe& target, const ImageGeometry& grid, VolumeView<float> intensity,
                      VolumeView<unsigned char> valid, const Progress& progress = {});

/// Puts \a real noise in the place of \a noise where it is \a there. \returns how many voxels of \a form have none.
std::ptrdiff_t PutRealNoise(VolumeView<const float> real, VolumeView<const unsigned char> there,
                            VolumeView<const unsigned char> form, VolumeView<float> noise);

} // namespace echorama
