// SPDX-License-Identifier: BSD-3-Clause
// The three libraries report errors through callbacks: libpng and libjpeg want a longjmp, so their code stands in functions that
// hold nothing which needs a destructor; libtiff has handlers per file. Nobody prints.
#include "Readers/PictureFile.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <csetjmp>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <memory>

#include <jpeglib.h>
#include <png.h>
#include <sys/stat.h>
#include <tiffio.h>

namespace echorama {
namespace {

constexpr char PictureTurned[] = "it does not begin at its top left (orientation %d): turned or mirrored pictures are not read";

//------------------------------------------------------------------------------------------------ PNG
void PngError(png_structp png, png_const_charp message)
{
  PictureInfo* info = static_cast<PictureInfo*>(png_get_error_ptr(png));
  std::snprintf(info->message, sizeof info->message, "%s", message);
  png_longjmp(png, 1);
}

void PngWarning(png_structp, png_const_charp) {}

bool ReadPng(FILE* file, PictureInfo* info)
{
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, info, PngError, PngWarning);
  png_infop header = png ? png_create_info_struct(png) : nullptr;
  if (!header || setjmp(png_jmpbuf(png))) {
    png_destroy_read_struct(&png, &header, nullptr);
    return false;
  }
  png_init_io(png, file);
  png_read_info(png, header);
  const int color = png_get_color_type(png, header);
  png_uint_32 x = 0, y = 0;
  int unit = 0;
  if (png_get_pHYs(png, header, &x, &y, &unit) && unit == PNG_RESOLUTION_METER) {
    info->dotsPerMm[0] = x / 1000.0;
    info->dotsPerMm[1] = y / 1000.0;
  }
  if (color == PNG_COLOR_TYPE_PALETTE)
    png_set_palette_to_rgb(png);
  else if (png_get_bit_depth(png, header) < 8)
    png_set_expand_gray_1_2_4_to_8(png);
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
  png_set_swap(png);
#endif
  const int passes = png_set_interlace_handling(png);
  png_read_update_info(png, header);
  info->width = png_get_image_width(png, header);
  info->height = png_get_image_height(png, header);
  info->channels = png_get_channels(png, header);
  info->bytes = png_get_bit_depth(png, header) / 8;
  if (info->pixels) {
    if (info->Size() > info->room)
      png_error(png, PictureChanged);
    const std::size_t stride = info->Size() / info->height;
    for (int pass = 0; pass < passes; ++pass)
      for (std::uint32_t row = 0; row < info->height; ++row)
        png_read_row(png, info->pixels + row * stride, nullptr);
    png_read_end(png, nullptr);
  }
  png_destroy_read_struct(&png, &header, nullptr);
  return true;
}

//------------------------------------------------------------------------------------------------ JPEG
// Each scan passes over the whole picture, however few bytes it has; programs make about ten.
constexpr int MostScans = 500;

struct JpegErrors {
  jpeg_error_mgr manager; // first: libjpeg knows this part
  jmp_buf jump;
};

void JpegError(j_common_ptr jpeg)
{
  std::longjmp(reinterpret_cast<JpegErrors*>(jpeg->err)->jump, 1);
}

void JpegMessage(j_common_ptr) {}

void LimitScans(j_common_ptr jpeg)
{
  if (reinterpret_cast<j_decompress_ptr>(jpeg)->input_scan_number <= MostScans)
    return;
  PictureInfo* info = static_cast<PictureInfo*>(jpeg->client_data);
  std::snprintf(info->message, sizeof info->message, "it has more than %d scans", MostScans);
  JpegError(jpeg);
}

// The orientation that Exif gives a picture, in the directory of a TIFF after six bytes of its own; 1 where it does not.
unsigned ExifOrientation(const jpeg_marker_struct* marker)
{
  while (marker && (marker->data_length < 14 || std::memcmp(marker->data, "Exif\0", 6) != 0))
    marker = marker->next;
  const auto number = [marker](std::size_t at, unsigned bytes) {
    unsigned value = 0;
    for (unsigned i = 0; i < bytes && 6 + at + bytes <= marker->data_length; ++i)
      value |= unsigned{marker->data[6 + at + i]} << 8 * (marker->data[6] == 'M' ? bytes - 1 - i : i);
    return value;
  };
  const std::size_t directory = marker ? number(4, 4) : 0;
  for (unsigned i = 0, count = marker ? number(directory, 2) : 0; i < count; ++i)
    if (number(directory + 2 + 12 * i, 2) == TIFFTAG_ORIENTATION)
      return number(directory + 10 + 12 * i, 2);
  return 1;
}

bool ReadJpeg(FILE* file, PictureInfo* info)
{
  jpeg_decompress_struct jpeg;
  JpegErrors errors;
  jpeg.err = jpeg_std_error(&errors.manager);
  errors.manager.error_exit = JpegError;
  errors.manager.output_message = JpegMessage;
  jpeg_progress_mgr progress{};
  progress.progress_monitor = LimitScans;
  if (setjmp(errors.jump)) {
    char text[JMSG_LENGTH_MAX];
    errors.manager.format_message(reinterpret_cast<j_common_ptr>(&jpeg), text);
    if (info->message[0] == '\0') // else it says more
      std::snprintf(info->message, sizeof info->message, "%.190s", text);
    jpeg_destroy_decompress(&jpeg);
    return false;
  }
  jpeg_create_decompress(&jpeg);
  jpeg.progress = &progress;
  jpeg.client_data = info;
  jpeg_stdio_src(&jpeg, file);
  jpeg_save_markers(&jpeg, JPEG_APP0 + 1, 0xFFFF);
  jpeg_read_header(&jpeg, TRUE);
  const unsigned orientation = ExifOrientation(jpeg.marker_list);
  const bool grey = jpeg.num_components == 1, turned = orientation > 1 && orientation <= 8;
  bool good = !turned && (grey || jpeg.num_components == 3);
  if (turned)
    std::snprintf(info->message, sizeof info->message, PictureTurned, orientation);
  else if (!good)
    std::snprintf(info->message, sizeof info->message, "it has %d colour components; 1 or 3 are read", jpeg.num_components);
  else {
    jpeg.out_color_space = grey ? JCS_GRAYSCALE : JCS_RGB;
    info->width = jpeg.image_width;
    info->height = jpeg.image_height;
    info->channels = grey ? 1 : 3;
    info->bytes = 1;
    const double perMm = jpeg.density_unit == 1 ? 1.0 / 25.4 : jpeg.density_unit == 2 ? 0.1 : 0.0;
    info->dotsPerMm[0] = jpeg.X_density * perMm;
    info->dotsPerMm[1] = jpeg.Y_density * perMm;
    if (info->pixels && info->Size() > info->room) {
      std::snprintf(info->message, sizeof info->message, "%s", PictureChanged);
      good = false;
    } else if (info->pixels) {
      jpeg_start_decompress(&jpeg);
      const std::size_t stride = info->Size() / info->height;
      while (jpeg.output_scanline < jpeg.output_height) {
        JSAMPROW row = info->pixels + jpeg.output_scanline * stride;
        jpeg_read_scanlines(&jpeg, &row, 1);
      }
      jpeg_finish_decompress(&jpeg);
      // Damage and a missing end are warnings to libjpeg, which makes up the rest.
      if (errors.manager.num_warnings > 0) {
        errors.manager.format_message(reinterpret_cast<j_common_ptr>(&jpeg), info->message);
        good = false;
      }
    }
  }
  jpeg_destroy_decompress(&jpeg);
  return good;
}

//------------------------------------------------------------------------------------------------ TIFF
int TiffError(TIFF*, void* user, const char*, const char* format, va_list arguments)
{
  PictureInfo* info = static_cast<PictureInfo*>(user);
  if (info && info->message[0] == '\0') // the first says what went wrong
    std::vsnprintf(info->message, sizeof info->message, format, arguments);
  return 1; // told; nobody prints
}

int TiffWarning(TIFF*, void*, const char*, const char*, va_list)
{
  return 1;
}

using FilePointer = std::unique_ptr<FILE, int (*)(FILE*)>;

FilePointer OpenPicture(const std::string& path)
{
  FilePointer file(std::fopen(path.c_str(), "rb"), std::fclose);
  if (!file)
    throw Error(Error::Kind::FileSystem, path + ": it cannot be opened (is reading permitted?)");
  return file;
}

// A file as libtiff sees it. To find a page it would go through all pages, each time a file is opened anew; so the header names
// the page that is wanted as the first.
struct TiffFile {
  FILE* file;
  std::array<unsigned char, 16> header{}; // BigTIFF's, or the shorter one and what follows
  std::size_t length = 0;                 // of what is changed

  TiffFile(FILE* opened, std::uint64_t page) : file(opened)
  {
    std::setvbuf(file, nullptr, _IONBF, 0); // libtiff reads what it needs, here and there
    if (page == 0)
      return;
    length = std::fread(header.data(), 1, header.size(), file);
    std::rewind(file);
    const bool bigEndian = header[0] == 'M';
    const std::size_t bytes = header[bigEndian ? 3 : 2] == 43 ? 8 : 4; // 43: BigTIFF
    for (std::size_t i = 0; i < bytes; ++i)
      header[bytes + i] = static_cast<unsigned char>(page >> 8 * (bigEndian ? bytes - 1 - i : i));
  }
};

tmsize_t ReadTiffBytes(thandle_t handle, void* out, tmsize_t size)
{
  const TiffFile& tiff = *static_cast<TiffFile*>(handle);
  const std::size_t at = static_cast<std::size_t>(ftello(tiff.file)),
                    there = std::fread(out, 1, static_cast<std::size_t>(size), tiff.file);
  if (at < tiff.length)
    std::memcpy(out, &tiff.header[at], std::min(there, tiff.length - at));
  return static_cast<tmsize_t>(there);
}

toff_t SeekTiff(thandle_t handle, toff_t offset, int from)
{
  FILE* const file = static_cast<TiffFile*>(handle)->file;
  return fseeko(file, static_cast<off_t>(offset), from) == 0 ? static_cast<toff_t>(ftello(file)) : static_cast<toff_t>(-1);
}

toff_t SizeOfTiff(thandle_t handle)
{
  struct stat status {};
  return fstat(fileno(static_cast<TiffFile*>(handle)->file), &status) == 0 ? static_cast<toff_t>(status.st_size) : 0;
}

using TiffPointer = std::unique_ptr<TIFF, void (*)(TIFF*)>;

// Both \a file and \a info must outlive it.
TiffPointer OpenTiff(const std::string& path, TiffFile& file, PictureInfo* info)
{
  TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
  TIFFOpenOptionsSetErrorHandlerExtR(options, TiffError, info);
  TIFFOpenOptionsSetWarningHandlerExtR(options, TiffWarning, nullptr);
  const auto write = [](thandle_t, void*, tmsize_t) { return tmsize_t{0}; };
  const auto close = [](thandle_t) { return 0; };
  TiffPointer tiff(TIFFClientOpenExt(path.c_str(), "rm", &file, ReadTiffBytes, write, SeekTiff, close, SizeOfTiff, nullptr,
                                     nullptr, options), // m: not mapped, so that a shrinking file is no crash
                   TIFFClose);
  TIFFOpenOptionsFree(options);
  return tiff;
}

template <class T>
T TiffTag(TIFF* tiff, std::uint32_t tag, T otherwise = {})
{
  T value = otherwise;
  TIFFGetFieldDefaulted(tiff, tag, &value);
  return value;
}

// The current page. \returns false with a message.
bool ReadTiffPage(TIFF* tiff, PictureInfo* info)
{
  const auto refuse = [info](const char* format, int number) {
    std::snprintf(info->message, sizeof info->message, format, number);
    return false;
  };
  info->width = TiffTag<std::uint32_t>(tiff, TIFFTAG_IMAGEWIDTH);
  info->height = TiffTag<std::uint32_t>(tiff, TIFFTAG_IMAGELENGTH);
  const int bits = TiffTag<std::uint16_t>(tiff, TIFFTAG_BITSPERSAMPLE),
            format = TiffTag<std::uint16_t>(tiff, TIFFTAG_SAMPLEFORMAT),
            photometric = TiffTag<std::uint16_t>(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK),
            orientation = TiffTag<std::uint16_t>(tiff, TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT),
            compression = TiffTag<std::uint16_t>(tiff, TIFFTAG_COMPRESSION);
  info->channels = TiffTag<std::uint16_t>(tiff, TIFFTAG_SAMPLESPERPIXEL);
  if (info->channels < 1 || info->channels > 4)
    return refuse("it has %d numbers per pixel; 1 to 4 are read", info->channels);
  if (info->channels > 1 && TiffTag<std::uint16_t>(tiff, TIFFTAG_PLANARCONFIG) != PLANARCONFIG_CONTIG)
    return refuse("its %d colours are stored apart, which is not supported", info->channels);
  if (bits != 8 && bits != 16 && bits != 32)
    return refuse("it has %d bits per number; 8, 16 and 32 are read", bits);
  if (orientation != ORIENTATION_TOPLEFT)
    return refuse(PictureTurned, orientation);
  info->isFloat = format == SAMPLEFORMAT_IEEEFP;
  info->isSigned = format == SAMPLEFORMAT_INT;
  if ((info->isFloat && bits != 32) || format > SAMPLEFORMAT_VOID)
    return refuse("its sample format %d is not supported", format);
  if (photometric == PHOTOMETRIC_YCBCR && compression == COMPRESSION_JPEG)
    TIFFSetField(tiff, TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
  else if (photometric != PHOTOMETRIC_MINISBLACK && photometric != PHOTOMETRIC_MINISWHITE && photometric != PHOTOMETRIC_RGB)
    return refuse("its colours are stored in a way that is not supported (photometric interpretation %d)", photometric);
  info->inverted = photometric == PHOTOMETRIC_MINISWHITE && !info->isFloat; // floats have no largest number
  info->bytes = bits / 8;
  const int unit = TiffTag<std::uint16_t>(tiff, TIFFTAG_RESOLUTIONUNIT);
  const double perMm = unit == RESUNIT_INCH ? 1.0 / 25.4 : unit == RESUNIT_CENTIMETER ? 0.1 : 0.0;
  info->dotsPerMm[0] = static_cast<double>(TiffTag<float>(tiff, TIFFTAG_XRESOLUTION)) * perMm;
  info->dotsPerMm[1] = static_cast<double>(TiffTag<float>(tiff, TIFFTAG_YRESOLUTION)) * perMm;
  if (!info->pixels)
    return true;
  if (info->Size() > info->room)
    return refuse(PictureChanged, 0);

  const std::size_t sample = static_cast<std::size_t>(info->channels) * static_cast<std::size_t>(info->bytes),
                    stride = info->width * sample;
  const auto damaged = [&] { return info->message[0] != '\0' ? false : refuse("its data end early or are damaged", 0); };
  if (!TIFFIsTiled(tiff)) {
    if (TIFFScanlineSize64(tiff) != stride)
      return refuse("its rows have not the length of its %d numbers per pixel", info->channels);
    for (std::uint32_t row = 0; row < info->height; ++row)
      if (TIFFReadScanline(tiff, info->pixels + row * stride, row) != 1)
        return damaged();
    return true;
  }
  const std::uint32_t across = TiffTag<std::uint32_t>(tiff, TIFFTAG_TILEWIDTH),
                      down = TiffTag<std::uint32_t>(tiff, TIFFTAG_TILELENGTH);
  const std::uint64_t size = TIFFTileSize64(tiff);
  if (across == 0 || down == 0 || size != across * sample * down || size > (std::uint64_t{1} << 28))
    return refuse("its tiles have not the size of their %d numbers per pixel", info->channels);
  std::vector<unsigned char> tile(size);
  for (std::uint32_t y = 0; y < info->height; y += down)
    for (std::uint32_t x = 0; x < info->width; x += across) {
      if (TIFFReadTile(tiff, tile.data(), x, y, 0, 0) < 0)
        return damaged();
      const std::size_t length = std::min(across, info->width - x) * sample;
      for (std::uint32_t row = 0; row < std::min(down, info->height - y); ++row)
        std::memcpy(info->pixels + (y + row) * stride + x * sample, tile.data() + row * across * sample, length);
    }
  return true;
}

} // namespace

PictureKind PictureKindOf(std::string_view start)
{
  if (start.substr(0, 8) == "\x89PNG\r\n\x1a\n")
    return PictureKind::Png;
  if (start.substr(0, 3) == "\xff\xd8\xff")
    return PictureKind::Jpeg;
  const std::string_view four = start.substr(0, 4);
  for (const std::string_view magic :
       {std::string_view("II*\0", 4), std::string_view("MM\0*", 4), std::string_view("II+\0", 4), std::string_view("MM\0+", 4)})
    if (four == magic)
      return PictureKind::Tiff;
  return PictureKind::None;
}

void ReadPicture(Picture& picture)
{
  bool good = false;
  picture.info.message[0] = '\0';
  const FilePointer file = OpenPicture(picture.path);
  if (picture.kind == PictureKind::Tiff) {
    TiffFile source(file.get(), picture.page);
    const TiffPointer tiff = OpenTiff(picture.path, source, &picture.info);
    good = tiff && ReadTiffPage(tiff.get(), &picture.info);
  } else {
    good = picture.kind == PictureKind::Png ? ReadPng(file.get(), &picture.info) : ReadJpeg(file.get(), &picture.info);
  }
  if (!good)
    FailFile(picture.path,
             "the image cannot be read (" + std::string(picture.info.message[0] ? picture.info.message : "damaged") + ")");
}

TiffPages ReadTiffPages(const std::string& path)
{
  PictureInfo info{};
  const FilePointer file = OpenPicture(path);
  TiffFile source(file.get(), 0);
  const TiffPointer tiff = OpenTiff(path, source, &info);
  if (!tiff)
    FailFile(path, "the image cannot be read (" + std::string(info.message) + ")");
  TiffPages found;
  if (const char* text = nullptr; TIFFGetField(tiff.get(), TIFFTAG_IMAGEDESCRIPTION, &text) == 1 && text)
    found.description = text;
  found.resolution = {TiffTag<float>(tiff.get(), TIFFTAG_XRESOLUTION), TiffTag<float>(tiff.get(), TIFFTAG_YRESOLUTION)};
  bool more = true;
  for (; more; more = TIFFReadDirectory(tiff.get()) == 1)
    if ((TiffTag<std::uint32_t>(tiff.get(), TIFFTAG_SUBFILETYPE) & FILETYPE_REDUCEDIMAGE) == 0) // else a thumbnail
      found.pages.push_back(TIFFCurrentDirOffset(tiff.get()));
  if (info.message[0] != '\0')
    FailFile(path, "its pages are damaged (" + std::string(info.message) + ")");
  return found;
}

} // namespace echorama
