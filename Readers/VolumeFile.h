// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Readers/ImageHeader.h"
#include "Readers/VolumeSource.h"
#include <array>
#include <memory>
#include <string>

namespace echorama {

/// Checks, before anything is allocated, that the file can be read as one volume: numbers, one per voxel, a geometry that
/// is a pose (ImageGeometry::Check), as many bytes as its dimensions say (for compressed data: as many as could decompress to
/// that), and memory enough for them.
/// \throws Error(BadFile) or Error(TooLarge) that names the file, Error(FileSystem) when a detached data file is missing.
void CheckVolume(const ImageHeader& header);

/// Reads the voxels into ByteCount() bytes at \a voxels, in this machine's byte order and the header's geometry.
/// CheckVolume must have passed.
/// \throws Error(BadFile) that names the file when the data end early, go on too long or are damaged, Error(Cancelled).
void ReadVoxels(const ImageHeader& header, void* voxels, const Progress& progress = {});

/// The volume in a MetaImage or NRRD file. \throws what ReadImageHeader and CheckVolume throw.
std::unique_ptr<VolumeSource> OpenHeaderVolume(const std::string& path);

/// Puts voxels that were read as they lie in the file into this machine's byte order and the header's order of slices.
void ArrangeVoxels(const ImageHeader& header, void* voxels);

/// The arrays that a companion can hold besides `ValidRegion`: which volume each voxel of a stitched one came from, how many
/// volumes are there, and how far these disagree.
constexpr std::array<const char*, 4> CompanionArrays{"Provenance", "Coverage", "Spread", "Embedding"};

/// The path of a file's companion that holds another array of the same voxels: NAME.ValidRegion.mha beside NAME.mha,
/// NAME.ValidRegion.nii.gz beside NAME.nii.gz.
std::string CompanionPath(const std::string& path, const std::string& array);

} // namespace echorama
