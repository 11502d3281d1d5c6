// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Imaging/VolumeView.h"

namespace echorama {

/// Scan conversion: from samples along beams to voxels of a Cartesian grid.
///
/// A beam volume has the depth samples along x (fastest), the beams across the fan along y and the steps of the sweep along
/// z. Samples are evenly spaced over [depthMin, depthMax], beams and steps over their whole range, first and last included.
/// A single plane (ProbeGeometry::IsPlane) has one step.

/// A part of a beam volume that is not there as a whole: samples, beams and steps of all, and the first that are there.
struct BeamWindow {
  std::array<int, 3> all{}, first{};
};

/// Throws Error(BadInput) when a beam volume of these dimensions does not go with the geometry: fewer than 2 samples or
/// beams, one step where the probe sweeps or several where it does not; Error(TooLarge) for more than 2^31 - 1 samples.
/// Throws what ProbeGeometry::Check throws.
void CheckBeamVolume(const std::array<int, 3>& dimensions, const ProbeGeometry& geometry);

/// The spacing (mm) at which a grid has about as many voxels inside the fan as the beam volume has samples: the mean
/// (geometric) of the distances between samples, beams and steps halfway down the middle beam.
double SampleSpacing(const std::array<int, 3>& dimensions, const ProbeGeometry& geometry);

/// The smallest grid of cubic voxels around the fan, aligned with the probe's axes: x along the array, y along the sweep, z
/// into the tissue. Of a single plane it is a 2D image: index axes along the array and into the tissue.
/// \param spacingMm > 0
/// \throws Error(InvalidParameter) for the spacing or the geometry, Error(BadInput) for a pose that is not rigid,
/// Error(TooLarge) when it exceeds \a maxVoxels.
ImageGeometry ScanConversionGrid(const ProbeGeometry& geometry, const Pose& probeToWorld, double spacingMm,
                                 std::size_t maxVoxels);

/// Fills \a intensity on \a grid by trilinear interpolation between samples, and \a valid with 1 inside the fan. Outside
/// (beyond the first or last sample, beam or step by more than a thousandth of their distance) both are 0.
///
/// Integers are rounded to the nearest, halves up; a constant stays that constant. A voxel between samples of which one is
/// not finite is not real: 0 in both. Of a single plane, voxels within half a voxel of the plane are filled. Nothing is
/// smoothed: where samples are denser than voxels (near the probe) some are skipped.
///
/// Positions are computed in single precision: 1e-4 of the distance between samples or better (up to 1,000 samples a beam).
/// The cost is lowest on grids whose rows run along the array (ScanConversionGrid), where the sweep is worked out once per
/// row. Instantiated for the types in VoxelTypes.h.
/// Source: dissertation 3.4.5 (image formation), by the exact inverse of the geometry in place of scattering samples.
/// \throws what CheckBeamVolume throws; Error(BadInput) for a pose that is not rigid, a grid that is none or views that do
/// not agree with it; Error(Cancelled).
/// \param window what part of a beam volume \a beams are; nullptr: all. Voxels between others are as if outside.
template <class T>
void ScanConvert(VolumeView<const T> beams, const ProbeGeometry& geometry, const Pose& probeToWorld, const ImageGeometry& grid,
                 VolumeView<T> intensity, VolumeView<unsigned char> valid, const Progress& progress = {},
                 const BeamWindow* window = nullptr);

} // namespace echorama
