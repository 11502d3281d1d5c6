// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include <cstdint>
#include <iosfwd>
#include <string>

namespace echorama {

/// Decompresses zlib or gzip data from \a stream straight into \a bytes bytes at \a out, after dropping the first
/// \a skip; gzip files of several members are read as one. The stream must hold exactly that many bytes.
/// \param name the file, for messages
/// \throws Error(BadFile) when the data end early, are damaged or go on beyond the last byte, Error(Cancelled).
void Decompress(std::istream& stream, const std::string& name, std::uint64_t skip, void* out, std::uint64_t bytes,
                const Progress& progress = {});

enum class CompressedForm { Zlib, Gzip };

/// Compresses \a bytes bytes at \a in to \a stream, in parallel. The result is one ordinary zlib or gzip stream that
/// every reader takes; it does not depend on the number of threads.
/// \returns the bytes written. Whether they arrived is for the caller to ask the stream.
std::uint64_t Compress(std::ostream& stream, CompressedForm form, const void* in, std::uint64_t bytes,
                       const Progress& progress = {});

/// No deflate stream holds more than this many bytes per compressed byte.
constexpr std::uint64_t LargestCompressionRatio = 1032;

} // namespace echorama
