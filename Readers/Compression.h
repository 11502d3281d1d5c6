// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include <cstdint>
#include <iosfwd>
#include <memory>
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

/// Decompresses zlib or gzip data piece by piece; gzip files of several members are read as one. Its state can be kept, and
/// reading gone on from there later, which makes long streams passable backwards.
class Inflater {
public:
  /// The data begin at byte \a begin of \a stream, which must outlive this. \a total: the bytes that they should hold;
  /// it and \a name, the file, are for messages.
  Inflater(std::istream& stream, std::int64_t begin, std::string name, std::uint64_t total);
  ~Inflater();
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  /// The next \a bytes bytes go to \a out (nullptr: they are dropped).
  /// \throws Error(BadFile) when the data end early or are damaged, after which only Restore() is possible.
  void Read(void* out, std::uint64_t bytes, const Progress& progress = {});

  /// Checks that nothing is left and that the checksum is right. \throws Error(BadFile) otherwise.
  void Finish();

  /// Bytes given out (or dropped) so far.
  std::uint64_t Position() const;

  /// A moment of the stream, about 40 kB.
  struct State;
  std::shared_ptr<const State> Save() const;
  void Restore(const State& state);

private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Compresses piece by piece, in parallel, with the result of Compress() on the whole. Holds 32 MB.
class Deflater {
public:
  /// \a stream must outlive this.
  Deflater(std::ostream& stream, CompressedForm form);
  ~Deflater();
  Deflater(const Deflater&) = delete;
  Deflater& operator=(const Deflater&) = delete;

  void Append(const void* in, std::uint64_t bytes, const Progress& progress = {});
  /// \returns the bytes written in all.
  std::uint64_t Finish(const Progress& progress = {});

private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// No deflate stream holds more than this many bytes per compressed byte.
constexpr std::uint64_t LargestCompressionRatio = 1032;

} // namespace echorama
