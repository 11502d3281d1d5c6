// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Readers/VolumeSource.h"
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace echorama {

/// Whether a file that begins with these bytes is a GE Kretz file.
bool LooksLikeKretz(std::string_view start);

/// Opens a GE Kretz file (.vol of Voluson scanners, KRETZFILE 1.0): samples along the beams of a mechanically swept convex
/// array. The content has beams (unsigned char); the volume is their scan conversion on the smallest grid of cubic voxels
/// around the fan (ScanConversionGrid), with the edge VolumeReadParameters::spacingMm or, at 0, SampleSpacing.
///
/// The world is the Cartesian frame of the file's own angles, because the format knows neither patient nor tracker: origin at
/// the centre of the array's arc, +x along the array towards greater fan angles, +z into the tissue along 90 degrees of fan
/// and sweep, and y, right-handed, against the sweep's angles. The planes of the sweep come in reverse, so that the beams
/// have the right hand of the probe frame. Where the angles of the fan are not centred on 90 degrees the probe has a
/// fanOffset; a sweep that is not becomes part of probeToWorld.
///
/// Angles that deviate from even spacing by more than a hundredth of a step are resampled, linearly, with a note. Uncompressed
/// movies are a time series. Files without angles hold Cartesian voxels. What names a patient, an institution or a date is
/// not kept.
///
/// \throws Error(BadFile) that names what is missing or wrong: items that end early or reach beyond the file, dimensions,
/// angles or the resolution that are missing or out of range, compressed voxels; Error(InvalidParameter) for the spacing,
/// Error(TooLarge), Error(FileSystem).
std::unique_ptr<VolumeSource> OpenKretz(const std::string& path, const VolumeReadParameters& parameters = {});

/// The same for a Kretz file of \a bytes bytes at \a offset inside another file, as DICOM holds them.
std::unique_ptr<VolumeSource> OpenKretzWithin(const std::string& path, std::uint64_t offset, std::uint64_t bytes,
                                              const VolumeReadParameters& parameters = {});

} // namespace echorama
