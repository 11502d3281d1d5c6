// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Imaging/VolumeView.h"
#include <array>

namespace echorama {

/// The dimensions of a beam volume (see ScanConversion.h) of these beams whose samples lie about \a spacingMm apart: along the
/// beams, and between beams and steps where they are furthest apart, at the last depth.
/// \throws what CheckBeamVolume throws.
std::array<int, 3> BeamDimensionsFor(const ProbeGeometry& geometry, double spacingMm);

/// The voxel size of a grid: the cube root of a voxel's volume (of a single slice the square root of its area), mm.
double VoxelSize(const ImageGeometry& geometry);

/// Scan conversion backwards: samples along the beams of a probe from a posed volume, NaN where that is not real. Trilinear; the
/// nearest voxel decides what is real (Sampler).
/// \param dimensions samples along a beam, beams, steps of the sweep
/// \throws what CheckBeamVolume throws; Error(BadInput) for a pose that is not rigid or a volume that does not agree with its
/// geometry; Error(Cancelled).
template <class T>
Volume<float> SampleBeams(const PosedVolume<T>& volume, const PlacedProbe& probe, const std::array<int, 3>& dimensions,
                          const Progress& progress = {});

/// How many samples, beams and steps at either end of a beam volume may lie within a voxel of the border of what was sampled, so
/// that the mask may hide them: a voxel's depth, and of beams and steps as many as lie within a voxel at the first depth, but at
/// most a twentieth of all.
std::array<int, 3> RimOf(const ProbeGeometry& geometry, const std::array<int, 3>& dimensions, const ImageGeometry& sampled);

} // namespace echorama
