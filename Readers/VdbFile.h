// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/FileReplacement.h"
#include "Readers/VolumeSource.h"
#include <string>
#include <string_view>

namespace echorama {

/// Whether a file begins like OpenVDB.
bool LooksLikeVdb(std::string_view start);

/// Opens an OpenVDB file (.vdb): the grid `Intensity`, else the first grid of numbers (float, double, int32, int64).
///
/// Active voxels are the valid region. A file of WriteVdb comes back as it was, its type of voxel included. Of other files
/// the volume is the box of the active voxels, index space is taken to be mm (LPS), and spacing and direction come from the
/// grid's transform, which must be affine, by the rules of PlaceAffine. Unlike other formats the tree of voxels is read when
/// the file is opened: nothing else in the file tells the box reliably. That is as much memory as the file justifies; the
/// dense volume comes afterwards.
/// \throws Error as OpenVolume: level sets, vectors, points, frustums and grids without active voxels are refused.
std::unique_ptr<VolumeSource> OpenVdb(const std::string& path);

/// Writes a volume as a sparse OpenVDB grid named `Intensity` with a double precision transform. Active voxels are those
/// with \a valid != 0 (nullptr: all); what the others hold is kept too, and takes no room where it is zero. Numbers of 8 and
/// 16 bits become float, unsigned ones of 32 and 64 bits int64; the grid's metadata hold the type, with dimensions and fields,
/// so that all of it comes back.
/// \throws Error as WriteVolume.
void WriteVdb(const std::string& path, const ImageHeader& header, const void* voxels, const unsigned char* valid, bool compress,
              FileReplacement& files, const Progress& progress = {});

/// What Readers/OpenVdb does for these two.
struct VdbLibrary {
  decltype(&OpenVdb) open;
  decltype(&WriteVdb) write;
};

} // namespace echorama

extern "C" const echorama::VdbLibrary* EchoramaVdbLibrary();
