// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include <cstdint>
#include <iosfwd>
#include <memory>
#include <string>

namespace echorama {

/// Reads zlib or gzip data piece by piece; gzip files of several members are read as one.
class Inflater {
public:
  /// \param stream outlives this; \param name the file, for messages
  Inflater(std::istream& stream, std::string name);
  ~Inflater();
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  /// Writes the next \a bytes bytes to \a out. \returns how many there were: fewer only where the data end.
  /// \throws Error(BadFile) when they are damaged, Error(Cancelled).
  std::uint64_t Read(void* out, std::uint64_t bytes, const Progress& progress = {});

  /// Drops the next \a bytes bytes. \returns and throws as Read.
  std::uint64_t Skip(std::uint64_t bytes);

  enum class Ending { Complete, Truncated, MoreFollows };
  /// What comes after the last byte that was read, to be asked once: the checksum and the end of its stream, nothing, or
  /// another byte (which is lost). Bytes after the end of a stream are not looked at.
  Ending Finish();

private:
  struct State;
  std::unique_ptr<State> state_;
};

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

/// The same for \a start followed by the \a bytes bytes at \a in: a header and its voxels.
std::uint64_t Compress(std::ostream& stream, CompressedForm form, const std::string& start, const void* in, std::uint64_t bytes,
                       const Progress& progress = {});

/// No deflate stream holds more than this many bytes per compressed byte.
constexpr std::uint64_t LargestCompressionRatio = 1032;

} // namespace echorama
