// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace echorama {

enum class PictureKind { None, Png, Jpeg, Tiff };

/// Told from the first bytes of a file; eight are enough.
PictureKind PictureKindOf(std::string_view start);

/// What the header of an image says. Plain data: it is filled in between setjmp and longjmp.
struct PictureInfo {
  std::uint32_t width, height;
  int channels; ///< 1 grey, 2 grey with alpha, 3 colour, 4 colour with alpha
  int bytes;    ///< of a sample
  bool isFloat, isSigned, inverted;
  double dotsPerMm[2];   ///< 0: not said
  unsigned char* pixels; ///< where they go; nullptr: the header alone
  std::size_t room;      ///< bytes there
  char message[200];

  std::size_t Size() const
  {
    return static_cast<std::size_t>(width) * height * static_cast<std::size_t>(channels) * static_cast<std::size_t>(bytes);
  }
  bool SameShape(const PictureInfo& other) const
  {
    return width == other.width && height == other.height && channels == other.channels && bytes == other.bytes &&
           isFloat == other.isFloat && isSigned == other.isSigned;
  }
};

struct Picture {
  std::string path;
  PictureKind kind = PictureKind::None;
  std::uint64_t page = 0; ///< TIFF: where its directory is, 0 for the first
  PictureInfo info{};
};

/// What is wrong with a file whose pixels no longer fit its header.
constexpr const char* PictureChanged = "it has changed since it was opened";

/// Reads the header of a picture into its info, and the pixels where they are wanted.
/// \throws Error(FileSystem), Error(BadFile) that names the file and what is wrong.
void ReadPicture(Picture& picture);

/// The pages of a TIFF, and what it says of all of them.
struct TiffPages {
  std::vector<std::uint64_t> pages; ///< as Picture::page; without thumbnails
  std::string description;
  std::array<float, 2> resolution{0.f, 0.f};
};

/// \throws Error(BadFile) when the file cannot be opened or its pages are damaged.
TiffPages ReadTiffPages(const std::string& path);

} // namespace echorama
