// SPDX-License-Identifier: BSD-3-Clause
// The images are made here with the libraries' writers.
#include "Core/Base/Random.h"
#include "Readers/ImageStackFile.h"
#include "Testing/TemporaryFolder.h"
#include <algorithm>
#include <cstring>

#include <cstdio>
#include <jpeglib.h>
#include <png.h>
#include <tiffio.h>
#include <zlib.h>

using namespace echorama;
using namespace echorama::testing;

namespace {

template <class T>
std::vector<T> Pattern(int width, int height, int channels = 1, int seed = 0)
{
  Random random(9, static_cast<std::uint64_t>(seed));
  std::vector<T> pixels(static_cast<std::size_t>(width * height * channels));
  for (T& pixel : pixels)
    pixel = static_cast<T>(random.Bits());
  return pixels;
}

struct Tiff {
  int width = 5, height = 4, channels = 1, bits = 8, format = SAMPLEFORMAT_UINT, compression = COMPRESSION_NONE;
  int photometric = PHOTOMETRIC_MINISBLACK, tile = 0, unit = RESUNIT_NONE, orientation = ORIENTATION_TOPLEFT;
  double resolution = 0.0;
  std::string description;
};

class ImageStackFile : public TemporaryFolder {
protected:
  template <class T>
  std::string Png(const std::string& name, const std::vector<T>& pixels, int width, int height, int channels = 1,
                  unsigned dotsPerMetre = 0, bool interlaced = false) const
  {
    FILE* file = std::fopen(Path(name).c_str(), "wb");
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    png_init_io(png, file);
    const int colors[] = {0, PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB, PNG_COLOR_TYPE_RGB_ALPHA};
    png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), 8 * sizeof(T), colors[channels],
                 interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    if (dotsPerMetre > 0)
      png_set_pHYs(png, info, dotsPerMetre, dotsPerMetre, PNG_RESOLUTION_METER);
    std::vector<T> copy = pixels;
    std::vector<png_bytep> rows;
    for (int row = 0; row < height; ++row)
      rows.push_back(reinterpret_cast<png_bytep>(copy.data() + row * width * channels));
    png_set_rows(png, info, rows.data());
    png_write_png(png, info, PNG_TRANSFORM_SWAP_ENDIAN, nullptr);
    png_destroy_write_struct(&png, &info);
    std::fclose(file);
    return Path(name);
  }

  std::string Jpeg(const std::string& name, const std::vector<unsigned char>& pixels, int width, int height, int channels = 1,
                   const std::string& exif = "") const
  {
    FILE* file = std::fopen(Path(name).c_str(), "wb");
    jpeg_compress_struct jpeg;
    jpeg_error_mgr errors;
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    jpeg_stdio_dest(&jpeg, file);
    jpeg.image_width = static_cast<JDIMENSION>(width);
    jpeg.image_height = static_cast<JDIMENSION>(height);
    jpeg.input_components = channels;
    jpeg.in_color_space = channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, 100, TRUE);
    jpeg.density_unit = 2; // per cm
    jpeg.X_density = 20;
    jpeg.Y_density = 40;
    jpeg_start_compress(&jpeg, TRUE);
    jpeg_write_marker(&jpeg, JPEG_APP0 + 1, reinterpret_cast<const JOCTET*>("http://ns.adobe.com/xap/1.0/"), 29);
    if (!exif.empty())
      jpeg_write_marker(&jpeg, JPEG_APP0 + 1, reinterpret_cast<const JOCTET*>(exif.data()), static_cast<unsigned>(exif.size()));
    while (jpeg.next_scanline < jpeg.image_height) {
      JSAMPROW row = const_cast<unsigned char*>(pixels.data()) + jpeg.next_scanline * static_cast<unsigned>(width * channels);
      jpeg_write_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    std::fclose(file);
    return Path(name);
  }

  template <class T>
  std::string WriteTiff(const std::string& name, const std::vector<std::vector<T>>& pages, const Tiff& t) const
  {
    TIFF* tiff = TIFFOpen(Path(name).c_str(), "w");
    for (const std::vector<T>& pixels : pages) {
      TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, t.width);
      TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, t.height);
      TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, t.channels);
      TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, t.bits);
      TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, t.format);
      if (t.photometric >= 0)
        TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, t.photometric);
      TIFFSetField(tiff, TIFFTAG_ORIENTATION, t.orientation);
      TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
      TIFFSetField(tiff, TIFFTAG_COMPRESSION, t.compression);
      if (t.resolution > 0.0) {
        TIFFSetField(tiff, TIFFTAG_XRESOLUTION, t.resolution);
        TIFFSetField(tiff, TIFFTAG_YRESOLUTION, 2.0 * t.resolution);
        TIFFSetField(tiff, TIFFTAG_RESOLUTIONUNIT, t.unit);
      }
      if (!t.description.empty())
        TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, t.description.c_str());
      std::vector<T> copy = pixels;
      if (t.tile > 0) {
        TIFFSetField(tiff, TIFFTAG_TILEWIDTH, t.tile);
        TIFFSetField(tiff, TIFFTAG_TILELENGTH, t.tile);
        for (int y = 0; y < t.height; y += t.tile)
          for (int x = 0; x < t.width; x += t.tile) {
            std::vector<T> tile(static_cast<std::size_t>(t.tile * t.tile));
            for (int v = 0; v < std::min(t.tile, t.height - y); ++v)
              for (int u = 0; u < std::min(t.tile, t.width - x); ++u)
                tile[static_cast<std::size_t>(v * t.tile + u)] = copy[static_cast<std::size_t>((y + v) * t.width + x + u)];
            TIFFWriteTile(tiff, tile.data(), static_cast<unsigned>(x), static_cast<unsigned>(y), 0, 0);
          }
      } else
        for (int row = 0; row < t.height; ++row)
          TIFFWriteScanline(tiff, copy.data() + row * t.width * t.channels, static_cast<unsigned>(row), 0);
      TIFFWriteDirectory(tiff);
    }
    TIFFClose(tiff);
    return Path(name);
  }

  std::string Bytes(const std::string& path) const
  {
    std::ifstream stream(path, std::ios::binary);
    return std::string((std::istreambuf_iterator<char>(stream)), {});
  }
  void Refused(const std::string& path, const std::string& words, const std::string& named = "",
               Error::Kind kind = Error::Kind::BadFile) const
  {
    ExpectRefused(
        [&] {
          const auto source = OpenImageStack(path);
          std::vector<double> voxels(source->Content().geometry.VoxelCount());
          source->Read(0, voxels.data(), nullptr);
        },
        kind, named.empty() ? path : named, words);
  }
  void Clear()
  {
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
  }
};

template <class T>
std::vector<T> Read(VolumeSource& source)
{
  EXPECT_EQ(sizeof(T), SizeOf(source.Content().type));
  std::vector<T> voxels(source.Content().geometry.VoxelCount());
  source.Read(0, voxels.data(), nullptr);
  return voxels;
}

bool HasNote(const VolumeContent& content, const std::string& words)
{
  return std::any_of(content.notes.begin(), content.notes.end(),
                     [&](const std::string& note) { return note.find(words) != std::string::npos; });
}

} // namespace

TEST_F(ImageStackFile, AFolderInTheNaturalOrderOfItsNames)
{
  std::vector<unsigned char> wanted;
  for (const int number : {1, 2, 9, 10, 11, 100}) {
    const std::vector<unsigned char> pixels = Pattern<unsigned char>(5, 4, 1, number);
    wanted.insert(wanted.end(), pixels.begin(), pixels.end());
    Png("img" + std::to_string(number) + ".png", pixels, 5, 4, 1, 0, number % 2 == 0);
  }
  Put("notes.txt", "not an image");
  Put(".hidden", "neither");
  EXPECT_EQ(FormatOfContent(folder.string()), FileFormat::ImageStack);
  const auto source = OpenImageStack(folder.string());
  const VolumeContent& content = source->Content();
  EXPECT_EQ(content.geometry.dimensions, (std::array<int, 3>{5, 4, 6}));
  EXPECT_EQ(content.type, VoxelType::UInt8);
  EXPECT_EQ(content.geometry.spacing, Eigen::Vector3d(1, 1, 1));
  EXPECT_EQ(Read<unsigned char>(*source), wanted);
  EXPECT_TRUE(HasNote(content, "notes.txt"));
  EXPECT_TRUE(HasNote(content, "missing between img2.png and img9.png, and elsewhere"));
  EXPECT_TRUE(HasNote(content, "along x, y, z"));

  VolumeReadParameters parameters;
  parameters.stackSpacingMm = {0.1, 0.2, 0.3};
  const auto spaced = OpenImageStack(folder.string(), parameters);
  EXPECT_EQ(spaced->Content().geometry.spacing, parameters.stackSpacingMm);
  EXPECT_FALSE(HasNote(spaced->Content(), "spacing"));
  parameters.stackSpacingMm[1] = -1.0;
  ExpectRefused([&] { OpenVolume(folder.string(), parameters); }, Error::Kind::InvalidParameter, folder.string(),
                "StackSpacingMm is (0.1 -1 0.3) mm; it must be at least 0");
}

TEST_F(ImageStackFile, OneFileStandsForTheStackBesideIt)
{
  for (const char* name : {"a_08.png", "a_09.png", "a_10.png", "b_09.png", "a.png", "a_11.txt"})
    Png(name, Pattern<unsigned char>(5, 4), 5, 4);
  EXPECT_EQ(OpenImageStack(Path("a_09.png"))->Content().geometry.dimensions[2], 3);
  EXPECT_TRUE(HasNote(OpenImageStack(Path("a_09.png"))->Content(), "3 images"));
  EXPECT_EQ(OpenImageStack(Path("a.png"))->Content().geometry.dimensions[2], 1);
  EXPECT_EQ(OpenImageStack(Path("b_09.png"))->Content().geometry.dimensions[2], 1);
}

// Whatever the order is in which the folder gives them.
TEST_F(ImageStackFile, LinksToNowhere)
{
  for (int k = 1; k <= 3; ++k)
    Png<unsigned char>("img" + std::to_string(k) + ".png", Pattern<unsigned char>(5, 4), 5, 4);
  for (int i = 0; i < 60; ++i)
    std::filesystem::create_symlink("user@host.123:456", Path(".#" + std::to_string(i)));
  for (int k = 4; k < 40; ++k)
    std::filesystem::create_symlink("gone.png", Path("img" + std::to_string(k) + ".png"));
  const auto whole = OpenImageStack(folder.string());
  EXPECT_EQ(whole->Content().geometry.dimensions[2], 3);
  EXPECT_TRUE(HasNote(whole->Content(), "36 files of the folder")) << "a slice that is gone is told";
  EXPECT_EQ(OpenImageStack(Path("img2.png"))->Content().geometry.dimensions[2], 3);
}

TEST_F(ImageStackFile, EveryTypeOfImage)
{
  const auto eight = Pattern<unsigned char>(20, 18);
  const auto sixteen = Pattern<unsigned short>(20, 18);
  EXPECT_EQ(Read<unsigned char>(*OpenImageStack(Png("a.png", eight, 20, 18))), eight);
  EXPECT_EQ(Read<unsigned short>(*OpenImageStack(Png("b.png", sixteen, 20, 18))), sixteen);
  EXPECT_EQ(Read<unsigned short>(*OpenImageStack(Png("b.png", sixteen, 20, 18, 1, 0, true))), sixteen);
  std::vector<float> floats(360);
  for (std::size_t i = 0; i < floats.size(); ++i)
    floats[i] = static_cast<float>(i) * 0.37f - 20.f;
  for (const int compression : {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_PACKBITS})
    for (const int tile : {0, 16}) {
      Tiff t;
      t.width = 20;
      t.height = 18;
      t.compression = compression;
      t.tile = tile;
      SCOPED_TRACE(compression);
      EXPECT_EQ(Read<unsigned char>(*OpenImageStack(WriteTiff<unsigned char>("a.tif", {eight}, t))), eight);
      t.bits = 16;
      EXPECT_EQ(Read<unsigned short>(*OpenImageStack(WriteTiff<unsigned short>("a.tif", {sixteen}, t))), sixteen);
      t.bits = 32;
      t.format = SAMPLEFORMAT_IEEEFP;
      EXPECT_EQ(Read<float>(*OpenImageStack(WriteTiff<float>("a.tif", {floats}, t))), floats);
    }
  Tiff t;
  t.width = 20;
  t.height = 18;
  t.photometric = PHOTOMETRIC_MINISWHITE;
  const auto turned = OpenImageStack(WriteTiff<unsigned char>("a.tif", {eight}, t));
  EXPECT_EQ(Read<unsigned char>(*turned)[7], 255 - eight[7]);
  EXPECT_TRUE(HasNote(turned->Content(), "white"));
  t.format = SAMPLEFORMAT_INT; // the lowest becomes the highest
  const auto turnedSigned = Read<signed char>(*OpenImageStack(WriteTiff<unsigned char>("a.tif", {eight}, t)));
  for (std::size_t i = 0; i < eight.size(); ++i)
    EXPECT_EQ(turnedSigned[i], -1 - static_cast<signed char>(eight[i]));
  t.format = SAMPLEFORMAT_IEEEFP;
  t.bits = 32;
  const auto same = OpenImageStack(WriteTiff<float>("a.tif", {floats}, t));
  EXPECT_EQ(Read<float>(*same), floats);
  EXPECT_FALSE(HasNote(same->Content(), "white"));
  t.format = SAMPLEFORMAT_UINT;
  t.bits = 8;
  t.photometric = -1; // it does not say
  EXPECT_EQ(Read<unsigned char>(*OpenImageStack(WriteTiff<unsigned char>("a.tif", {eight}, t))), eight);

  // JPEG loses: a smooth picture comes back within two grey levels.
  std::vector<unsigned char> smooth(360);
  for (std::size_t i = 0; i < smooth.size(); ++i)
    smooth[i] = static_cast<unsigned char>(i / 2 + 30);
  const std::vector<unsigned char> back = Read<unsigned char>(*OpenImageStack(Jpeg("a.jpg", smooth, 20, 18)));
  for (std::size_t i = 0; i < smooth.size(); ++i)
    EXPECT_NEAR(back[i], smooth[i], 2);
}

TEST_F(ImageStackFile, ColoursBecomeGrey)
{
  std::vector<unsigned char> pixels;
  const auto grey = Pattern<unsigned char>(5, 4);
  for (const unsigned char value : grey)
    pixels.insert(pixels.end(), {value, value, value});
  const auto source = OpenImageStack(Png("a.png", pixels, 5, 4, 3));
  EXPECT_EQ(Read<unsigned char>(*source), grey);
  EXPECT_TRUE(HasNote(source->Content(), "grey"));
  pixels[0] = 200, pixels[1] = 100, pixels[2] = 50;
  EXPECT_EQ(Read<unsigned char>(*OpenImageStack(Png("a.png", pixels, 5, 4, 3)))[0], 124); // 59.8 + 58.7 + 5.7
  const auto alpha = OpenImageStack(Png("b.png", Pattern<unsigned short>(5, 4, 4), 5, 4, 4));
  EXPECT_EQ(alpha->Content().type, VoxelType::UInt16);
  EXPECT_TRUE(HasNote(alpha->Content(), "transparency"));
  EXPECT_EQ(Read<unsigned char>(*OpenImageStack(Png("c.png", Pattern<unsigned char>(5, 4, 2), 5, 4, 2)))[3],
            Pattern<unsigned char>(5, 4, 2)[6]);
  std::vector<unsigned char> uniform(20 * 18 * 3, 77);
  EXPECT_EQ(Read<unsigned char>(*OpenImageStack(Jpeg("a.jpg", uniform, 20, 18, 3))), std::vector<unsigned char>(360, 77));
}

TEST_F(ImageStackFile, ResolutionOfTheFiles)
{
  const auto pixels = Pattern<unsigned char>(20, 18);
  auto source = OpenImageStack(Png("a.png", pixels, 20, 18, 1, 5000));
  EXPECT_LT((source->Content().geometry.spacing - Eigen::Vector3d(0.2, 0.2, 1.0)).norm(), 1e-12);
  EXPECT_TRUE(HasNote(source->Content(), "along x, y is"));
  EXPECT_TRUE(HasNote(source->Content(), "along z: 1 mm"));
  for (const unsigned screen : {2834u, 2835u, 3780u}) // 72 and 96 dpi
    EXPECT_EQ(OpenImageStack(Png("a.png", pixels, 20, 18, 1, screen))->Content().geometry.spacing, Eigen::Vector3d(1, 1, 1));
  source = OpenImageStack(Jpeg("a.jpg", pixels, 20, 18));
  EXPECT_LT((source->Content().geometry.spacing - Eigen::Vector3d(0.5, 0.25, 1.0)).norm(), 1e-12);
  Tiff t;
  t.width = 20;
  t.height = 18;
  t.resolution = 254;
  t.unit = RESUNIT_INCH;
  source = OpenImageStack(WriteTiff<unsigned char>("a.tif", {pixels}, t));
  EXPECT_LT((source->Content().geometry.spacing - Eigen::Vector3d(0.1, 0.05, 1.0)).norm(), 1e-6);
  VolumeReadParameters parameters;
  parameters.stackSpacingMm = {0.0, 0.0, 3.0};
  source = OpenImageStack(Path("a.tif"), parameters);
  EXPECT_LT((source->Content().geometry.spacing - Eigen::Vector3d(0.1, 0.05, 3.0)).norm(), 1e-6);
}

TEST_F(ImageStackFile, PagesOfATiffAndWhatImageJWrote)
{
  const std::vector<std::vector<unsigned char>> pages{Pattern<unsigned char>(5, 4, 1, 1), Pattern<unsigned char>(5, 4, 1, 2),
                                                      Pattern<unsigned char>(5, 4, 1, 3)};
  std::vector<unsigned char> wanted;
  for (const auto& page : pages)
    wanted.insert(wanted.end(), page.begin(), page.end());
  Tiff t;
  t.resolution = 4.0; // pixels per unit
  t.description = "ImageJ=1.53t\nimages=3\nslices=3\nunit=mm\nspacing=0.7\nloop=false\n";
  auto source = OpenImageStack(WriteTiff("a.tif", pages, t));
  EXPECT_EQ(Read<unsigned char>(*source), wanted);
  EXPECT_LT((source->Content().geometry.spacing - Eigen::Vector3d(0.25, 0.125, 0.7)).norm(), 1e-12);
  t.description = "ImageJ=1.53t\nimages=3\nslices=3\nunit=micron\nspacing=500\n";
  source = OpenImageStack(WriteTiff("a.tif", pages, t));
  EXPECT_LT((source->Content().geometry.spacing - Eigen::Vector3d(0.00025, 0.000125, 0.5)).norm(), 1e-9);
  t.description = "ImageJ=1.53t\nimages=3\nframes=3\nunit=pixel\n";
  source = OpenImageStack(WriteTiff("a.tif", pages, t));
  EXPECT_EQ(source->Content().geometry.spacing, Eigen::Vector3d(1, 1, 1));
  EXPECT_TRUE(HasNote(source->Content(), "3 frames were taken as slices"));
  t.description = "ImageJ=1.53t\nimages=6\nslices=3\nframes=2\n";
  Refused(WriteTiff("a.tif", pages, t), "6 images");
  t.description = "ImageJ=1.53t\nimages=3\nchannels=2\n";
  Refused(WriteTiff("a.tif", pages, t), "2 channels");
  // Other programs use the same words for other things.
  t.description = "spacing=9\nunit=mm\n";
  EXPECT_EQ(OpenImageStack(WriteTiff("a.tif", pages, t))->Content().geometry.spacing, Eigen::Vector3d(1, 1, 1));
}

TEST_F(ImageStackFile, ATiffOfSeveralPagesIsAStackByItself)
{
  const auto page = Pattern<unsigned char>(5, 4);
  const std::string three = WriteTiff<unsigned char>("scan_1.tif", {page, page, page}, {}),
                    two = WriteTiff<unsigned char>("scan_2.tif", {page, page}, {});
  EXPECT_EQ(OpenImageStack(three)->Content().geometry.dimensions[2], 3);
  EXPECT_EQ(OpenImageStack(two)->Content().geometry.dimensions[2], 2);
  Refused(folder.string(), "3 pages", three);
  Refused(WriteTiff<unsigned char>("scan_0.tif", {page}, {}), "3 pages", three);
  WriteTiff<unsigned char>("scan_1.tif", {page}, {});
  WriteTiff<unsigned char>("scan_2.tif", {page}, {});
  EXPECT_EQ(OpenImageStack(three)->Content().geometry.dimensions[2], 3);
}

TEST_F(ImageStackFile, ChannelsAndTimesOfOmeAreNoSlices)
{
  const auto page = Pattern<unsigned char>(5, 4);
  Tiff t;
  const auto write = [&](const std::string& sizes) {
    t.description = "<?xml version=\"1.0\"?><OME><Image><Pixels DimensionOrder=\"XYCZT\" SizeX=\"5\" SizeY=\"4\" " + sizes +
                    "/></Image></OME>";
    return WriteTiff<unsigned char>("a.ome.tif", {page, page, page, page}, t);
  };
  EXPECT_EQ(OpenImageStack(write("SizeZ=\"4\" SizeC=\"1\" SizeT=\"1\""))->Content().geometry.dimensions[2], 4);
  Refused(write("SizeZ=\"2\" SizeC=\"2\" SizeT=\"1\""), "has 2 slices, and there are 4 images: several channels or times");
  Refused(write("SizeZ=\"2\" SizeC=\"1\" SizeT=\"2\""), "several channels or times");
}

TEST_F(ImageStackFile, SizesOfVoxelsThatOmeWrote)
{
  const auto page = Pattern<unsigned char>(5, 4);
  Tiff t;
  t.resolution = 100.0;
  t.unit = RESUNIT_CENTIMETER;
  const auto spacing = [&](const std::string& sizes, const Eigen::Vector3d& asked = Eigen::Vector3d::Zero()) -> Eigen::Vector3d {
    t.description = "<?xml version=\"1.0\"?>\n<OME><Image><Pixels\n" + sizes + " SizeC=\"1\" SizeZ=\"4\"/></Image></OME>";
    VolumeReadParameters parameters;
    parameters.stackSpacingMm = asked;
    return OpenImageStack(WriteTiff<unsigned char>("a.ome.tif", {page, page, page, page}, t), parameters)
        ->Content()
        .geometry.spacing;
  };
  const auto near = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return (a - b).norm() < 1e-8; };
  const std::string x = "PhysicalSizeX=\"250\" ", z = "PhysicalSizeZ=\"1\" PhysicalSizeZUnit=\"cm\"";
  EXPECT_TRUE(near(spacing(x + "PhysicalSizeY=\"0.5\" PhysicalSizeYUnit=\"mm\"\n" + z), {0.25, 0.5, 10.0}));
  EXPECT_TRUE(near(spacing(x + z), {0.25, 0.05, 10.0})) << "y: the resolution";
  EXPECT_TRUE(near(spacing(x + z, {0.0, 0.0, 3.0}), {0.25, 0.05, 3.0}));
  EXPECT_TRUE(near(spacing("PhysicalSizeX=\"2\" PhysicalSizeXUnit=\"pixel\""), {0.1, 0.05, 1.0}));
  for (const char* unit : {"\xC2\xB5m", "&#181;m", "um"})
    EXPECT_TRUE(near(spacing(x + "PhysicalSizeXUnit=\"" + unit + "\""), {0.25, 0.05, 1.0})) << unit;
}

TEST_F(ImageStackFile, BadImagesAreNamed)
{
  const auto good = [this](const std::string& name) { return Png(name, Pattern<unsigned char>(40, 30), 40, 30); };
  good("a1.png");
  good("a3.png");
  const std::string bad = Png("a2.png", Pattern<unsigned char>(30, 40), 30, 40);
  Refused(folder.string(), "30 x 40 pixels and the first image 40 x 30", bad);
  Png("a2.png", Pattern<unsigned short>(40, 30), 40, 30);
  Refused(folder.string(), "16-bit unsigned and the first image 8-bit", bad);
  const std::string file = Bytes(good("a2.png"));
  for (const std::size_t length : {std::size_t{9}, std::size_t{40}, file.size() / 2, file.size() - 20}) {
    Put("a2.png", file.substr(0, length));
    Refused(folder.string(), "cannot be read", bad);
  }
  std::string damaged = file;
  damaged[file.size() / 2] = static_cast<char>(damaged[file.size() / 2] ^ 0x55);
  Put("a2.png", damaged);
  Refused(folder.string(), "cannot be read", bad);

  Clear();
  const std::string jpeg = Bytes(Jpeg("a.jpg", Pattern<unsigned char>(40, 30), 40, 30));
  for (const std::size_t length : {std::size_t{10}, jpeg.size() / 2, jpeg.size() - 20})
    Refused(Put("a.jpg", jpeg.substr(0, length)), "cannot be read");
  Tiff t;
  t.width = 40;
  t.height = 30;
  for (const int compression : {COMPRESSION_NONE, COMPRESSION_LZW}) {
    t.compression = compression;
    const std::string tiff = Bytes(WriteTiff<unsigned char>("a.tif", {Pattern<unsigned char>(40, 30)}, t));
    for (const std::size_t length : {std::size_t{6}, tiff.size() / 2, tiff.size() - 10})
      Refused(Put("a.tif", tiff.substr(0, length)), "");
  }
}

TEST_F(ImageStackFile, WhatIsNoStackIsRefused)
{
  Refused(folder.string(), "no images");
  Put("a.txt", "text");
  Refused(folder.string(), "no images");
  Refused(Path("a.txt"), "none of PNG, JPEG and TIFF");
  Refused(Path("missing"), "no such file", "", Error::Kind::FileSystem);
  Tiff t;
  t.channels = 2;
  t.bits = 32;
  t.format = SAMPLEFORMAT_COMPLEXINT;
  Refused(WriteTiff<unsigned>("a.tif", {Pattern<unsigned>(5, 4, 2)}, t), "sample format 5");
  t = Tiff();
  t.channels = 5;
  Refused(WriteTiff<unsigned char>("a.tif", {Pattern<unsigned char>(5, 4, 5)}, t), "5 numbers");
  t = Tiff();
  t.photometric = PHOTOMETRIC_CIELAB;
  t.channels = 3;
  Refused(WriteTiff<unsigned char>("a.tif", {Pattern<unsigned char>(5, 4, 3)}, t), "photometric");
  t = Tiff();
  t.orientation = ORIENTATION_BOTLEFT;
  Refused(WriteTiff<unsigned char>("a.tif", {Pattern<unsigned char>(5, 4)}, t), "(orientation 4)");

  // A directory of two entries, the second the orientation, in both byte orders; cut short, it says nothing.
  const std::string little("Exif\0\0II*\0\10\0\0\0\2\0\0\1\4\0\1\0\0\0\24\0\0\0\22\1\3\0\1\0\0\0\6\0\0\0\0\0\0\0", 44),
      big("Exif\0\0MM\0*\0\0\0\10\0\1\1\22\0\3\0\0\0\1\0\3\0\0\0\0\0\0", 32);
  const auto grey = Pattern<unsigned char>(5, 4);
  Refused(Jpeg("a.jpg", grey, 5, 4, 1, little), "(orientation 6)");
  Refused(Jpeg("a.jpg", grey, 5, 4, 1, big), "(orientation 3)");
  for (const std::size_t length : {0, 6, 14, 20, 30, 36, 37})
    EXPECT_NO_THROW(OpenImageStack(Jpeg("a.jpg", grey, 5, 4, 1, little.substr(0, length)))) << length;
  EXPECT_NO_THROW(OpenImageStack(Jpeg("a.jpg", grey, 5, 4, 1, std::string(little).replace(36, 1, "\1"))));

  // Sizes out of all proportion: the width in the header of a PNG, with its checksum.
  std::string png = Bytes(Png("a.png", Pattern<unsigned char>(5, 4), 5, 4));
  png[16] = 0, png[17] = 0x0e, png[18] = 0, png[19] = 0;
  png[20] = 0, png[21] = 0x0e, png[22] = 0, png[23] = 0;
  const uLong sum = crc32(0, reinterpret_cast<const Bytef*>(png.data()) + 12, 17);
  for (int i = 0; i < 4; ++i)
    png[static_cast<std::size_t>(29 + i)] = static_cast<char>(sum >> (24 - 8 * i));
  Refused(Put("a.png", png), "more than a file of its size");
}

TEST_F(ImageStackFile, RandomDamageNeverCrashes)
{
  Tiff t;
  t.compression = COMPRESSION_LZW;
  const auto pixels = Pattern<unsigned char>(5, 4);
  const std::string files[] = {Bytes(Png("a.png", pixels, 5, 4)), Bytes(Jpeg("a.jpg", pixels, 5, 4)),
                               Bytes(WriteTiff<unsigned char>("a.tif", {pixels, pixels}, t))};
  Clear();
  Random random(7);
  for (const std::string& good : files)
    for (int i = 0; i < 300; ++i) {
      std::string bad = good;
      for (std::uint64_t flips = 1 + random.Below(3); flips > 0; --flips)
        bad[random.Below(bad.size())] = static_cast<char>(random.Bits());
      try {
        const auto source = OpenImageStack(Put("bad", bad));
        std::vector<double> voxels(source->Content().geometry.VoxelCount());
        source->Read(0, voxels.data(), nullptr);
      } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find(Path("bad")), std::string::npos) << error.what();
      }
    }
}
