// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstddef>
#include <cstdint>
#include <istream>
#include <streambuf>
#include <string>

namespace echorama {

// OpenVDB trusts its files: it allocates what a length says, does not ask whether reading succeeded, and reads as many bytes
// into a node as a damaged length says. Here a file is walked through before the library sees it.

/// A buffer over bytes in memory.
class MemoryBuffer : public std::streambuf {
public:
  explicit MemoryBuffer(std::string& bytes) { setg(bytes.data(), bytes.data(), bytes.data() + bytes.size()); }

private:
  pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode) override;
  pos_type seekpos(pos_type position, std::ios_base::openmode mode) override
  {
    return seekoff(position, std::ios_base::beg, mode);
  }
};

/// A stream over bytes in memory that throws std::ios_base::failure at their end.
class MemoryStream : private MemoryBuffer, public std::istream {
public:
  explicit MemoryStream(std::string& bytes) : MemoryBuffer(bytes), std::istream(static_cast<MemoryBuffer*>(this))
  {
    exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
  }
};

/// Compares the lengths in a file's header and in the metadata of each grid with what is there. Metadata of types that OpenVDB
/// would read by lengths of their own are made unknown to it, in \a bytes.
/// \throws Error(BadFile) that names the file and what is wrong, std::ios_base::failure when the bytes end early.
void CheckVdbHeader(std::string& bytes, const std::string& path);

/// Compares the lengths in a tree of Tree_..._5_4_3, from its topology (where \a stream stands) on: whether OpenVDB can read it
/// without leaving its buffers.
/// \param valueBytes of a value in the nodes' tables, \param dataBytes of one among the voxels (halves are shorter)
/// \param compression openvdb::io::COMPRESS_...
/// \throws as CheckVdbHeader
void CheckVdbTree(std::istream& stream, const std::string& path, std::size_t valueBytes, std::size_t dataBytes,
                  std::uint32_t compression);

} // namespace echorama
