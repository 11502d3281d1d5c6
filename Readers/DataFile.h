// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Geometry/ImageGeometry.h"
#include <cstdint>
#include <fstream>
#include <string>

namespace echorama {

// What the readers of all formats ask of a file and of the voxels in it.

/// \throws Error(FileSystem) when the file cannot be opened.
std::ifstream OpenToRead(const std::string& path);

/// Its length. \throws Error(FileSystem) when it is no plain file.
std::uint64_t FileSize(const std::string& path);

/// Reads \a bytes bytes from where \a stream stands. \returns how many there were.
std::uint64_t ReadPieces(std::istream& stream, void* out, std::uint64_t bytes, const Progress& progress = {});

/// Compares the bytes that a header needs with those that its data file has, before anything is allocated for them.
/// \param says what needs them, "its dimensions (2 x 3 x 4)"
/// \param exactly whether more bytes are a fault too; of compressed ones nobody can tell
/// \throws Error(BadFile) that names the file and both numbers.
void CheckBytes(const std::string& path, const std::string& says, double needed, double there, bool compressed, bool exactly);

/// Throws Error(TooLarge) when \a bytes are more than the memory that this machine has free.
void CheckMemory(const std::string& path, double bytes);

/// ImageGeometry::Check of what a file says: \throws Error(BadFile)
void CheckGeometry(const std::string& path, const ImageGeometry& geometry);

} // namespace echorama
