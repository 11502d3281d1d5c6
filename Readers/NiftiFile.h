// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Readers/VolumeSource.h"
#include <string>
#include <string_view>

namespace echorama {

/// Whether a file that begins with these bytes (some hundred of them, gzip or not) is NIfTI-1, NIfTI-2 or ANALYZE 7.5.
bool LooksLikeNifti(std::string_view start);

/// Opens a NIfTI-1 or NIfTI-2 file (.nii, .nii.gz, .hdr with its .img): one volume or a time series, every type of number
/// with 8 to 64 bits, either byte order.
///
/// The pose is the sform when its code is positive, else the qform, else the bare axes with a note; RAS becomes LPS, metres
/// and micrometres become millimetres. Left-handed axes, usual in this format, are made right-handed by taking the slices
/// in reverse. An affine that is not a pose: where the nearest pose moves no voxel by more than 0.1 voxel it is taken (with a
/// note from 0.001 voxel on), else the file is refused. Stored numbers are scaled (scl_slope, scl_inter) to Float32, to Float64
/// when they have more than 16 bits. Text that NiftiHeaderText left in the header's extension comes back as fields, and the exact
/// geometry with it, unless another program has since changed the header's. \throws Error as OpenVolume: ANALYZE, colours,
/// complex numbers, several numbers per voxel and spectra are refused.
std::unique_ptr<VolumeSource> OpenNifti(const std::string& path);

} // namespace echorama
