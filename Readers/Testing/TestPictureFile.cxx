// SPDX-License-Identifier: BSD-3-Clause
// Single pages of TIFF, and files that are made to cost time. What pictures hold is tested with the stacks that they make.
#include "Readers/PictureFile.h"
#include "Readers/Testing/Effort.h"
#include "Testing/TemporaryFolder.h"
#include <cstdio>
#include <tiffio.h>

using namespace echorama;
using namespace echorama::testing;

namespace {

class PictureFile : public TemporaryFolder {
protected:
  // Pages of 3 x 2 bytes, all of them the number of the page; thumbnails are every third from the second on.
  std::string Pages(const char* mode, int count, bool thumbnails = false) const
  {
    TIFF* tiff = TIFFOpen(Path("pages.tif").c_str(), mode);
    for (int page = 0; page < count; ++page) {
      if (thumbnails && page % 3 == 1)
        TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, FILETYPE_REDUCEDIMAGE);
      TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, 3);
      TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 2);
      TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 8);
      TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
      TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
      unsigned char row[3];
      std::fill_n(row, 3, static_cast<unsigned char>(page));
      for (std::uint32_t y = 0; y < 2; ++y)
        TIFFWriteScanline(tiff, row, y, 0);
      TIFFWriteDirectory(tiff);
    }
    TIFFClose(tiff);
    return Path("pages.tif");
  }
};

// A progressive JPEG of one grey block, whose frequencies come again and again: all zero.
std::string ManyScans(int scans)
{
  const auto bytes = [](std::initializer_list<int> list) { return std::string(list.begin(), list.end()); };
  std::string file = bytes({0xFF, 0xD8, 0xFF, 0xDB, 0, 67, 0}) + std::string(64, '\1');
  file += bytes({0xFF, 0xC2, 0, 11, 8, 0, 8, 0, 8, 1, 1, 0x11, 0});
  for (const int table : {0x00, 0x10}) // one code of one bit: no difference, and no more frequencies
    file += bytes({0xFF, 0xC4, 0, 20, table, 1}) + std::string(16, '\0');
  file += bytes({0xFF, 0xDA, 0, 8, 1, 1, 0, 0, 0, 0, 0x7F});
  for (int scan = 1; scan < scans; ++scan)
    file += bytes({0xFF, 0xDA, 0, 8, 1, 1, 0, 1, 63, 0, 0x7F});
  return file + bytes({0xFF, 0xD9});
}

} // namespace

TEST_F(PictureFile, PagesAreFoundInEveryKindOfTiff)
{
  for (const char* mode : {"wl", "wb", "w8l", "w8b"}) { // little-endian and big-endian, TIFF and BigTIFF
    SCOPED_TRACE(mode);
    const std::string path = Pages(mode, 7, true);
    const TiffPages found = ReadTiffPages(path);
    ASSERT_EQ(found.pages.size(), 5u); // 0, 2, 3, 5, 6
    for (const std::size_t i : {4, 0, 2}) {
      unsigned char pixels[6] = {};
      Picture picture{path, PictureKind::Tiff, found.pages[i]};
      picture.info.pixels = pixels;
      picture.info.room = sizeof pixels;
      ReadPicture(picture);
      EXPECT_EQ(picture.info.width, 3u);
      EXPECT_EQ(picture.info.height, 2u);
      EXPECT_EQ(pixels[0], i * 3 / 2);
      EXPECT_EQ(pixels[5], i * 3 / 2);
    }
    Picture beyond{path, PictureKind::Tiff, 1u << 30};
    ExpectRefused([&] { ReadPicture(beyond); }, Error::Kind::BadFile, path, "cannot be read");
  }
}

TEST_F(PictureFile, NoPageIsSoughtThroughAllOthers)
{
  const std::string path = Pages("w", 2000);
  const std::vector<std::uint64_t> pages = ReadTiffPages(path).pages;
  ASSERT_EQ(pages.size(), 2000u);
  const std::uint64_t read = BytesRead([&] {
    for (const std::uint64_t page : pages) {
      Picture picture{path, PictureKind::Tiff, page};
      ReadPicture(picture);
    }
  });
  EXPECT_LT(read, 4 * std::filesystem::file_size(path));
}

TEST_F(PictureFile, JpegOfTooManyScansIsRefused)
{
  unsigned char pixels[64];
  const auto read = [&](int scans) {
    Picture picture{Put("a.jpg", ManyScans(scans)), PictureKind::Jpeg};
    picture.info.pixels = pixels;
    picture.info.room = sizeof pixels;
    ReadPicture(picture);
  };
  std::fill_n(pixels, 64, static_cast<unsigned char>(0));
  read(500);
  for (const unsigned char pixel : pixels)
    EXPECT_EQ(pixel, 128);
  ExpectRefused([&] { read(501); }, Error::Kind::BadFile, Path("a.jpg"), "more than 500 scans");
}
