// SPDX-License-Identifier: BSD-3-Clause
// The walk costs one pass over the file. What remains: damage within voxels that were compressed with Blosc (behind the header
// of their chunk), or not at all, is not noticed, as in every format without checksums.
#include "Readers/OpenVdb/VdbWalk.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <openvdb/io/Compression.h>
#include <openvdb/version.h>
#include <utility>

namespace echorama {
namespace {

template <class T>
T Read(std::istream& stream)
{
  T value;
  stream.read(reinterpret_cast<char*>(&value), sizeof value);
  return value;
}

class Walk {
public:
  Walk(std::string& bytes, const std::string& path) : bytes_(bytes), stream_(bytes), path_(path) {}

  void File()
  {
    if (Read<std::int64_t>(stream_) != 0x56444220)
      FailFile(path_, "the content is not OpenVDB");
    const std::uint32_t version = Read<std::uint32_t>(stream_);
    if (version < 222 || version > openvdb::OPENVDB_FILE_VERSION)
      FailFile(path_, "it is OpenVDB of file version " + std::to_string(version) + "; versions 222 to " +
                          std::to_string(static_cast<unsigned>(openvdb::OPENVDB_FILE_VERSION)) + " are read");
    Skip(8); // the library that wrote it
    if (Read<char>(stream_) == 0)
      FailFile(path_, "it was written as a stream, without the places of its grids; write it as a file");
    for (int i = 0; i < 36; ++i) { // a unique name
      const char c = Read<char>(stream_);
      const bool dash = i == 8 || i == 13 || i == 18 || i == 23;
      if (dash ? c != '-' : std::isxdigit(static_cast<unsigned char>(c)) == 0)
        FailFile(path_, "its header is damaged");
    }
    Metadata();
    const std::int32_t grids = Read<std::int32_t>(stream_);
    if (grids < 1)
      FailFile(path_, "it holds no grids");
    for (std::int32_t i = 0; i < grids; ++i) {
      for (int name = 0; name < 3; ++name) // name, type, the grid that it shares voxels with
        Skip(Length());
      const std::int64_t begin = Read<std::int64_t>(stream_), blocks = Read<std::int64_t>(stream_),
                         end = Read<std::int64_t>(stream_);
      if (!(begin >= static_cast<std::int64_t>(Position()) && begin <= blocks && blocks <= end))
        FailFile(path_, "the places of its grids are damaged");
      if (static_cast<std::uint64_t>(end) > bytes_.size())
        FailFile(path_, "grid " + std::to_string(i + 1) + " ends at byte " + std::to_string(end) + ", and the file at " +
                            std::to_string(bytes_.size()) + ": it is truncated");
      stream_.seekg(begin);
      Read<std::uint32_t>(stream_); // compression
      Metadata();
      Skip(Length()); // the name of the transform's kind
      stream_.seekg(end);
    }
  }

private:
  std::uint64_t Position() { return static_cast<std::uint64_t>(stream_.tellg()); }
  std::uint32_t Length()
  {
    const std::uint32_t length = Read<std::uint32_t>(stream_);
    if (length > bytes_.size() - Position())
      FailFile(path_, "a text in its header is " + std::to_string(length) + " bytes long, more than the file: it is damaged");
    return length;
  }
  void Skip(std::uint64_t bytes) { stream_.seekg(static_cast<std::streamoff>(bytes), std::ios::cur); }

  // A type of metadata that OpenVDB knows is read by its own size, whatever the length beside it says; one that it does not
  // know, by that length. Types that are not in this list (among them the index for loading voxels later, which holds lengths of
  // its own) are made unknown.
  void Metadata()
  {
    const std::uint32_t count = Read<std::uint32_t>(stream_);
    for (std::uint32_t i = 0; i < count; ++i) {
      Skip(Length()); // name
      const std::uint32_t length = Length();
      const std::uint64_t at = Position();
      const std::string type = bytes_.substr(at, length);
      Skip(length);
      const std::uint32_t size = Length();
      constexpr std::pair<const char*, std::uint32_t> sizes[] = {{"bool", 1},   {"float", 4},  {"double", 8}, {"int32", 4},
                                                                 {"int64", 8},  {"vec2i", 8},  {"vec2s", 8},  {"vec2d", 16},
                                                                 {"vec3i", 12}, {"vec3s", 12}, {"vec3d", 24}, {"vec4i", 16},
                                                                 {"vec4s", 16}, {"vec4d", 32}, {"mat4s", 64}, {"mat4d", 128}};
      const auto* known =
          std::find_if(std::begin(sizes), std::end(sizes), [&](const auto& entry) { return type == entry.first; });
      if (known != std::end(sizes) && known->second != size)
        FailFile(path_, "its metadata are damaged");
      if (known == std::end(sizes) && type != "string" && length > 0)
        bytes_[at] = '?';
      Skip(size);
    }
  }

  std::string& bytes_;
  MemoryStream stream_;
  const std::string& path_;
};

class TreeWalk {
public:
  TreeWalk(std::istream& stream, const std::string& path, std::size_t valueBytes, std::size_t dataBytes,
           std::uint32_t compression)
    : stream_(stream), path_(path), valueBytes_(valueBytes), dataBytes_(dataBytes), compression_(compression)
  {
  }
  void Tree()
  {
    if (Read<std::int32_t>(stream_) != 1)
      Fail();
    Skip(valueBytes_); // background
    const std::uint32_t tiles = Read<std::uint32_t>(stream_), children = Read<std::uint32_t>(stream_);
    for (std::uint32_t i = 0; i < tiles; ++i) {
      Corner();
      Skip(valueBytes_);
      if (Read<unsigned char>(stream_) > 1)
        Fail();
    }
    for (std::uint32_t i = 0; i < children; ++i) {
      Corner();
      Node<5>();
    }
    for (std::uint64_t i = 0; i < leaves_; ++i)
      Values<3>(Mask<3>());
  }

private:
  template <int Log2>
  static constexpr std::size_t Count = std::size_t{1} << (3 * Log2);

  void Skip(std::uint64_t bytes) { stream_.ignore(static_cast<std::streamsize>(bytes)); }
  [[noreturn]] void Fail() const { FailFile(path_, "its tree of voxels is damaged"); }
  void Corner()
  {
    for (int axis = 0; axis < 3; ++axis)
      if (Read<std::int32_t>(stream_) % 4096 != 0)
        Fail();
  }
  // Reads a mask. \returns how many of its bits are set.
  template <int Log2>
  std::size_t Mask()
  {
    std::array<std::uint64_t, Count<Log2> / 64> words;
    stream_.read(reinterpret_cast<char*>(words.data()), sizeof words);
    std::size_t on = 0;
    for (const std::uint64_t word : words)
      on += static_cast<std::size_t>(__builtin_popcountll(word));
    return on;
  }
  template <int Log2>
  void Node()
  {
    const std::size_t children = Mask<Log2>();
    Values<Log2>(Mask<Log2>());
    for (std::size_t i = 0; i < children; ++i)
      if constexpr (Log2 == 5)
        Node<4>();
      else {
        Mask<3>();
        ++leaves_;
      }
  }
  // The values of a node of which \a active are on, as io::readCompressedValues takes them.
  template <int Log2>
  void Values(std::size_t active)
  {
    namespace io = openvdb::io;
    const int form = Read<std::int8_t>(stream_);
    if (form < io::NO_MASK_OR_INACTIVE_VALS || form > io::NO_MASK_AND_ALL_VALS)
      Fail();
    const bool two = form == io::MASK_AND_TWO_INACTIVE_VALS;
    if (two || form == io::NO_MASK_AND_ONE_INACTIVE_VAL || form == io::MASK_AND_ONE_INACTIVE_VAL)
      Skip((two ? 2 : 1) * valueBytes_);
    if (two || form == io::MASK_AND_NO_INACTIVE_VALS || form == io::MASK_AND_ONE_INACTIVE_VAL)
      Skip(Count<Log2> / 8);
    const bool activeAlone = (compression_ & io::COMPRESS_ACTIVE_MASK) && form != io::NO_MASK_AND_ALL_VALS;
    const std::int64_t bytes = static_cast<std::int64_t>((activeAlone ? active : Count<Log2>)*dataBytes_);
    if (!(compression_ & (io::COMPRESS_BLOSC | io::COMPRESS_ZIP)))
      return Skip(static_cast<std::uint64_t>(bytes));
    // Positive: bytes of compressed values. Else they are as they are, and it counts them.
    const std::int64_t length = Read<std::int64_t>(stream_);
    if (length > 2 * bytes + 1024 || (length <= 0 && length != -bytes))
      Fail();
    const std::istream::pos_type begin = stream_.tellg();
    if (length > 0 && (compression_ & io::COMPRESS_BLOSC))
      BloscHeader(length, bytes);
    stream_.seekg(begin + static_cast<std::streamoff>(std::abs(length)));
  }
  // Blosc is not told how many bytes it is given: it believes the header in them.
  // Format: https://github.com/Blosc/c-blosc/blob/main/README_CHUNK_FORMAT.rst
  void BloscHeader(std::int64_t compressedBytes, std::int64_t bytes)
  {
    if (compressedBytes < 16)
      Fail();
    Skip(4); // versions, flags, the size of a value
    const std::int32_t nbytes = Read<std::int32_t>(stream_), blocksize = Read<std::int32_t>(stream_),
                       cbytes = Read<std::int32_t>(stream_);
    const bool blocks = nbytes == 0 || (blocksize > 0 && blocksize <= nbytes);
    if (nbytes != bytes || cbytes != compressedBytes || !blocks)
      Fail();
  }

  std::istream& stream_;
  const std::string& path_;
  std::size_t valueBytes_, dataBytes_;
  std::uint32_t compression_;
  std::uint64_t leaves_ = 0;
};

} // namespace

MemoryBuffer::pos_type MemoryBuffer::seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode)
{
  const off_type at = offset + (from == std::ios_base::beg ? 0 : (from == std::ios_base::cur ? gptr() : egptr()) - eback());
  if (at < 0 || at > egptr() - eback())
    return pos_type(off_type(-1));
  setg(eback(), eback() + at, egptr());
  return pos_type(at);
}

void CheckVdbHeader(std::string& bytes, const std::string& path)
{
  Walk(bytes, path).File();
}

void CheckVdbTree(std::istream& stream, const std::string& path, std::size_t valueBytes, std::size_t dataBytes,
                  std::uint32_t compression)
{
  TreeWalk(stream, path, valueBytes, dataBytes, compression).Tree();
}

} // namespace echorama
