// SPDX-License-Identifier: BSD-3-Clause
// Opening looks at the header of every image (they must agree); reading decodes slices in parallel, each straight into memory
// of its own size and from there, as grey, into the volume. The three libraries report errors through callbacks: libpng and
// libjpeg want a longjmp, so their code stands in functions that hold nothing which needs a destructor; libtiff has handlers
// per file. Nobody prints.
#include "Readers/ImageStackFile.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include "Readers/VolumeFile.h"
#include <algorithm>
#include <cctype>
#include <cmath>
#include <csetjmp>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>

#include <jpeglib.h>
#include <png.h>
#include <tiffio.h>

namespace fs = std::filesystem;

namespace echorama {
namespace {

enum class Kind { None, Png, Jpeg, Tiff };

// No image holds more than this many bytes per byte of its file (progressive JPEG of one colour comes near).
constexpr double LargestRatio = 2e4;
constexpr const char* Changed = "it has changed since it was opened";

Kind KindOf(std::string_view start)
{
  if (start.substr(0, 8) == "\x89PNG\r\n\x1a\n")
    return Kind::Png;
  if (start.substr(0, 3) == "\xff\xd8\xff")
    return Kind::Jpeg;
  const std::string_view four = start.substr(0, 4);
  for (const std::string_view magic :
       {std::string_view("II*\0", 4), std::string_view("MM\0*", 4), std::string_view("II+\0", 4), std::string_view("MM\0+", 4)})
    if (four == magic)
      return Kind::Tiff;
  return Kind::None;
}

Kind KindOfFile(const fs::path& path)
{
  std::error_code error;
  if (!fs::is_regular_file(path, error))
    return Kind::None;
  char start[8] = {};
  std::ifstream(path, std::ios::binary).read(start, sizeof start);
  return KindOf({start, sizeof start});
}

// What the header of an image says. Plain data: it is filled in between setjmp and longjmp.
struct Info {
  std::uint32_t width, height;
  int channels; // 1 grey, 2 grey with alpha, 3 colour, 4 colour with alpha
  int bytes;    // of a sample
  bool isFloat, isSigned, inverted;
  double dotsPerMm[2];   // 0: not said
  unsigned char* pixels; // where they go; nullptr: the header alone
  std::size_t room;      // bytes there
  char message[200];

  std::size_t Size() const
  {
    return static_cast<std::size_t>(width) * height * static_cast<std::size_t>(channels) * static_cast<std::size_t>(bytes);
  }
  bool SameShape(const Info& other) const
  {
    return width == other.width && height == other.height && channels == other.channels && bytes == other.bytes &&
           isFloat == other.isFloat && isSigned == other.isSigned;
  }
};

//------------------------------------------------------------------------------------------------ PNG
void PngError(png_structp png, png_const_charp message)
{
  Info* info = static_cast<Info*>(png_get_error_ptr(png));
  std::snprintf(info->message, sizeof info->message, "%s", message);
  png_longjmp(png, 1);
}

void PngWarning(png_structp, png_const_charp) {}

bool ReadPng(FILE* file, Info* info)
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
      png_error(png, Changed);
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
struct JpegErrors {
  jpeg_error_mgr manager; // first: libjpeg knows this part
  jmp_buf jump;
};

void JpegError(j_common_ptr jpeg)
{
  std::longjmp(reinterpret_cast<JpegErrors*>(jpeg->err)->jump, 1);
}

void JpegMessage(j_common_ptr) {}

bool ReadJpeg(FILE* file, Info* info)
{
  jpeg_decompress_struct jpeg;
  JpegErrors errors;
  jpeg.err = jpeg_std_error(&errors.manager);
  errors.manager.error_exit = JpegError;
  errors.manager.output_message = JpegMessage;
  if (setjmp(errors.jump)) {
    char text[JMSG_LENGTH_MAX];
    errors.manager.format_message(reinterpret_cast<j_common_ptr>(&jpeg), text);
    std::snprintf(info->message, sizeof info->message, "%.190s", text);
    jpeg_destroy_decompress(&jpeg);
    return false;
  }
  jpeg_create_decompress(&jpeg);
  jpeg_stdio_src(&jpeg, file);
  jpeg_read_header(&jpeg, TRUE);
  const bool grey = jpeg.num_components == 1;
  bool good = grey || jpeg.num_components == 3;
  if (!good)
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
      std::snprintf(info->message, sizeof info->message, "%s", Changed);
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
  Info* info = static_cast<Info*>(user);
  if (info && info->message[0] == '\0') // the first says what went wrong
    std::vsnprintf(info->message, sizeof info->message, format, arguments);
  return 1; // told; nobody prints
}

int TiffWarning(TIFF*, void*, const char*, const char*, va_list)
{
  return 1;
}

using TiffPointer = std::unique_ptr<TIFF, void (*)(TIFF*)>;

TiffPointer OpenTiff(const std::string& path, Info* info)
{
  TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
  TIFFOpenOptionsSetErrorHandlerExtR(options, TiffError, info);
  TIFFOpenOptionsSetWarningHandlerExtR(options, TiffWarning, nullptr);
  TiffPointer tiff(TIFFOpenExt(path.c_str(), "rm", options), TIFFClose); // m: not mapped, so that a shrinking file is no crash
  TIFFOpenOptionsFree(options);
  return tiff;
}

template <class T>
T TiffTag(TIFF* tiff, std::uint32_t tag)
{
  T value{};
  TIFFGetFieldDefaulted(tiff, tag, &value);
  return value;
}

// The current page. \returns false with a message.
bool ReadTiffPage(TIFF* tiff, Info* info)
{
  const auto refuse = [info](const char* format, int number) {
    std::snprintf(info->message, sizeof info->message, format, number);
    return false;
  };
  info->width = TiffTag<std::uint32_t>(tiff, TIFFTAG_IMAGEWIDTH);
  info->height = TiffTag<std::uint32_t>(tiff, TIFFTAG_IMAGELENGTH);
  const int bits = TiffTag<std::uint16_t>(tiff, TIFFTAG_BITSPERSAMPLE),
            format = TiffTag<std::uint16_t>(tiff, TIFFTAG_SAMPLEFORMAT),
            photometric = TiffTag<std::uint16_t>(tiff, TIFFTAG_PHOTOMETRIC),
            compression = TiffTag<std::uint16_t>(tiff, TIFFTAG_COMPRESSION);
  info->channels = TiffTag<std::uint16_t>(tiff, TIFFTAG_SAMPLESPERPIXEL);
  if (info->channels < 1 || info->channels > 4)
    return refuse("it has %d numbers per pixel; 1 to 4 are read", info->channels);
  if (info->channels > 1 && TiffTag<std::uint16_t>(tiff, TIFFTAG_PLANARCONFIG) != PLANARCONFIG_CONTIG)
    return refuse("its %d colours are stored apart, which is not supported", info->channels);
  if (bits != 8 && bits != 16 && bits != 32)
    return refuse("it has %d bits per number; 8, 16 and 32 are read", bits);
  info->isFloat = format == SAMPLEFORMAT_IEEEFP;
  info->isSigned = format == SAMPLEFORMAT_INT;
  if ((info->isFloat && bits != 32) || format > SAMPLEFORMAT_VOID)
    return refuse("its sample format %d is not supported", format);
  if (photometric == PHOTOMETRIC_YCBCR && compression == COMPRESSION_JPEG)
    TIFFSetField(tiff, TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
  else if (photometric != PHOTOMETRIC_MINISBLACK && photometric != PHOTOMETRIC_MINISWHITE && photometric != PHOTOMETRIC_RGB)
    return refuse("its colours are stored in a way that is not supported (photometric interpretation %d)", photometric);
  info->inverted = photometric == PHOTOMETRIC_MINISWHITE;
  info->bytes = bits / 8;
  const int unit = TiffTag<std::uint16_t>(tiff, TIFFTAG_RESOLUTIONUNIT);
  const double perMm = unit == RESUNIT_INCH ? 1.0 / 25.4 : unit == RESUNIT_CENTIMETER ? 0.1 : 0.0;
  info->dotsPerMm[0] = static_cast<double>(TiffTag<float>(tiff, TIFFTAG_XRESOLUTION)) * perMm;
  info->dotsPerMm[1] = static_cast<double>(TiffTag<float>(tiff, TIFFTAG_YRESOLUTION)) * perMm;
  if (!info->pixels)
    return true;
  if (info->Size() > info->room)
    return refuse(Changed, 0);

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

//------------------------------------------------------------------------------------------------ the stack
struct Picture {
  std::string path;
  Kind kind = Kind::None;
  std::uint64_t page = 0; // TIFF: where its directory is, 0 for the first
  Info info{};
};

// Reads the header of a slice into its info, and the pixels where they are wanted.
void ReadSlice(Picture& slice)
{
  bool good = false;
  slice.info.message[0] = '\0';
  if (slice.kind == Kind::Tiff) {
    const TiffPointer tiff = OpenTiff(slice.path, &slice.info);
    good = tiff && (slice.page == 0 || TIFFSetSubDirectory(tiff.get(), slice.page)) && ReadTiffPage(tiff.get(), &slice.info);
  } else {
    const std::unique_ptr<FILE, int (*)(FILE*)> file(std::fopen(slice.path.c_str(), "rb"), std::fclose);
    if (!file)
      throw Error(Error::Kind::FileSystem, slice.path + ": it cannot be opened (is reading permitted?)");
    good = slice.kind == Kind::Png ? ReadPng(file.get(), &slice.info) : ReadJpeg(file.get(), &slice.info);
  }
  if (!good)
    FailFile(slice.path,
             "the image cannot be read (" + std::string(slice.info.message[0] ? slice.info.message : "damaged") + ")");
}

// img2 before img10: digits are compared as numbers. Equal numbers: the shorter text, then the order of characters.
bool NaturallyBefore(const std::string& a, const std::string& b)
{
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (digit(a[i]) && digit(b[j])) {
      std::size_t endA = i, endB = j;
      while (endA < a.size() && digit(a[endA]))
        ++endA;
      while (endB < b.size() && digit(b[endB]))
        ++endB;
      while (i + 1 < endA && a[i] == '0')
        ++i;
      while (j + 1 < endB && b[j] == '0')
        ++j;
      const int order = endA - i != endB - j ? (endA - i < endB - j ? -1 : 1) : a.compare(i, endA - i, b, j, endB - j);
      if (order != 0)
        return order < 0;
      i = endA;
      j = endB;
    } else if (a[i] != b[j])
      return a[i] < b[j];
    else {
      ++i;
      ++j;
    }
  }
  if ((i < a.size()) != (j < b.size()))
    return j < b.size();
  return a.size() != b.size() ? a.size() < b.size() : a < b;
}

// A name without its last number (of the stem), and that number, -1 for none.
std::pair<std::string, std::int64_t> SplitNumber(const std::string& name)
{
  const std::size_t stem = std::min(name.rfind('.'), name.size());
  std::size_t end = stem;
  while (end > 0 && !std::isdigit(static_cast<unsigned char>(name[end - 1])))
    --end;
  std::size_t begin = end;
  while (begin > 0 && std::isdigit(static_cast<unsigned char>(name[begin - 1])))
    --begin;
  std::int64_t number = -1;
  if (begin == end || !ParseNumber(std::string_view(name).substr(begin, end - begin), number))
    return {name, -1};
  return {name.substr(0, begin) + "#" + name.substr(end), number};
}

// The value of "key=value" in the lines of ImageJ's description, empty when it is not there.
std::string ImageJValue(const std::string& description, const std::string& key)
{
  const std::size_t at = ("\n" + description).find("\n" + key + "=");
  if (at == std::string::npos)
    return {};
  const std::size_t begin = at + key.size() + 1;
  return description.substr(begin, description.find_first_of("\r\n", begin) - begin);
}

// mm of a unit of length as ImageJ writes it.
std::optional<double> MmOfUnit(const std::string& unit)
{
  if (unit == "mm" || unit == "millimeter")
    return 1.0;
  if (unit == "cm")
    return 10.0;
  if (unit == "m")
    return 1000.0;
  if (unit == "um" || unit == "micron" || unit == "microns" || unit == "\\u00B5m" || unit == "\xc2\xb5m" || unit == "\xb5m")
    return 0.001;
  if (unit == "inch")
    return 25.4;
  return std::nullopt;
}

class ImageStack : public VolumeSource {
public:
  ImageStack(const std::string& path, const VolumeReadParameters& parameters)
  {
    content_.path = path;
    content_.format = FileFormat::ImageStack;
    Collect();
    CheckSlices();
    FindSpacing(parameters);
  }
  void Read(std::size_t, void* voxels, unsigned char*, const Progress& progress) override;

private:
  void Note(const std::string& note) { content_.notes.push_back(note); }
  void Collect();
  void CollectPages(std::string path);
  void NoteGaps();
  void CheckSlices();
  void FindSpacing(const VolumeReadParameters& parameters);
  double ImageJSpacing(Eigen::Vector3d& spacing) const;

  std::vector<Picture> slices_;
  std::string description_; // of a TIFF
  float resolution_[2] = {0.f, 0.f};
};

void ImageStack::Collect()
{
  const std::string& path = content_.path;
  std::error_code error;
  std::vector<fs::path> others;
  if (!fs::exists(path, error))
    throw Error(Error::Kind::FileSystem, path + ": there is no such file");
  if (fs::is_directory(path, error)) {
    std::string ignored;
    int ignoredCount = 0;
    for (const auto& entry : fs::directory_iterator(path, error)) {
      const std::string name = entry.path().filename().string();
      if (name[0] == '.' || entry.is_directory(error))
        continue;
      if (const Kind kind = KindOfFile(entry.path()); kind != Kind::None)
        slices_.push_back({entry.path().string(), kind});
      else if (++ignoredCount == 1 || name < ignored)
        ignored = name;
    }
    if (error)
      throw Error(Error::Kind::FileSystem, path + ": the folder cannot be read (" + error.message() + ")");
    if (slices_.empty())
      FailFile(path, "the folder holds no images (PNG, JPEG or TIFF)");
    if (ignoredCount > 0)
      Note(std::to_string(ignoredCount) + (ignoredCount > 1 ? " files of the folder are" : " file of the folder is") +
           " no image and was left out: " + ignored + (ignoredCount > 1 ? ", ..." : ""));
  } else {
    const Kind kind = KindOfFile(path);
    if (kind == Kind::None)
      FailFile(path, "the content is none of PNG, JPEG and TIFF");
    slices_.push_back({path, kind});
    const auto [pattern, number] = SplitNumber(fs::path(path).filename().string());
    fs::path folder = fs::path(path).parent_path();
    for (const auto& entry :
         number < 0 ? fs::directory_iterator() : fs::directory_iterator(folder.empty() ? "." : folder, error)) {
      const auto [otherPattern, otherNumber] = SplitNumber(entry.path().filename().string());
      if (otherPattern == pattern && otherNumber >= 0 && entry.path().filename() != fs::path(path).filename())
        if (const Kind otherKind = KindOfFile(entry.path()); otherKind != Kind::None)
          slices_.push_back({(folder / entry.path().filename()).string(), otherKind});
    }
  }
  std::sort(slices_.begin(), slices_.end(), [](const Picture& a, const Picture& b) {
    return NaturallyBefore(fs::path(a.path).filename().string(), fs::path(b.path).filename().string());
  });
  if (slices_.size() == 1 && slices_[0].kind == Kind::Tiff)
    CollectPages(slices_[0].path);
  else if (!fs::is_directory(path, error) && slices_.size() > 1)
    Note("the " + std::to_string(slices_.size()) + " images beside it that differ by their number were taken as the slices");
  NoteGaps();
}

void ImageStack::CollectPages(std::string path) // a copy: the slices are made anew
{
  Picture first{path, Kind::Tiff};
  const TiffPointer tiff = OpenTiff(path, &first.info);
  if (!tiff)
    FailFile(path, "the image cannot be read (" + std::string(first.info.message) + ")");
  if (const char* text = nullptr; TIFFGetField(tiff.get(), TIFFTAG_IMAGEDESCRIPTION, &text) == 1 && text)
    description_ = text;
  resolution_[0] = TiffTag<float>(tiff.get(), TIFFTAG_XRESOLUTION);
  resolution_[1] = TiffTag<float>(tiff.get(), TIFFTAG_YRESOLUTION);
  slices_.clear();
  bool more = true;
  for (; more; more = TIFFReadDirectory(tiff.get()) == 1) {
    if ((TiffTag<std::uint32_t>(tiff.get(), TIFFTAG_SUBFILETYPE) & FILETYPE_REDUCEDIMAGE) != 0)
      continue; // a thumbnail
    first.page = TIFFCurrentDirOffset(tiff.get());
    slices_.push_back(first);
  }
  if (first.info.message[0] != '\0')
    FailFile(path, "its pages are damaged (" + std::string(first.info.message) + ")");
  if (slices_.empty())
    FailFile(path, "it holds thumbnails alone");
  if (description_.compare(0, 7, "ImageJ=") != 0)
    description_.clear();
  std::uint64_t images = 0;
  if (ParseNumber(ImageJValue(description_, "images"), images) && images > slices_.size())
    FailFile(path, "ImageJ says that it holds " + std::to_string(images) + " images, and " + std::to_string(slices_.size()) +
                       " can be found: it is truncated, or larger than TIFF allows; save it as an image sequence");
  for (const char* axis : {"channels", "frames"})
    if (int count = 1; ParseNumber(ImageJValue(description_, axis), count) && count > 1) {
      if (static_cast<std::size_t>(count) != slices_.size())
        FailFile(path, "it holds " + std::to_string(count) + " " + axis + " of a volume; one is needed");
      Note("its " + std::to_string(count) + " " + axis + " were taken as slices");
    }
}

void ImageStack::NoteGaps()
{
  int missing = 0;
  std::string before, after;
  for (std::size_t i = 1; i < slices_.size(); ++i) {
    const std::string a = fs::path(slices_[i - 1].path).filename().string(), b = fs::path(slices_[i].path).filename().string();
    const auto [patternA, numberA] = SplitNumber(a);
    const auto [patternB, numberB] = SplitNumber(b);
    if (patternA == patternB && numberA >= 0 && numberB > numberA + 1 && ++missing == 1) {
      before = a;
      after = b;
    }
  }
  if (missing > 0)
    Note("numbers are missing between " + before + " and " + after + (missing > 1 ? ", and elsewhere" : "") +
         ": the slices were taken as neighbours all the same");
}

void ImageStack::CheckSlices()
{
  bool colours = false, alpha = false, inverted = false;
  double fileBytes = 0.0, needed = 0.0;
  std::string last;
  for (Picture& slice : slices_) {
    ReadSlice(slice);
    const Info &info = slice.info, &first = slices_[0].info;
    const auto size = [](const Info& i) { return std::to_string(i.width) + " x " + std::to_string(i.height); };
    const auto type = [](const Info& i) {
      return std::to_string(8 * i.bytes) + "-bit " + (i.isFloat ? "float" : i.isSigned ? "signed" : "unsigned");
    };
    if (info.width < 1 || info.height < 1 || info.width > 0x7fffffffu || info.height > 0x7fffffffu)
      FailFile(slice.path, "the image has no pixels, or too many");
    const std::string page =
        slice.page != 0 && slices_.size() > 1 ? "page " + std::to_string(&slice - slices_.data() + 1) + " is " : "it is ";
    if (size(info) != size(first))
      FailFile(slice.path, page + size(info) + " pixels and the first image " + size(first) + "; slices must have one size");
    if (type(info) != type(first))
      FailFile(slice.path, page + type(info) + " and the first image " + type(first) + "; slices must have one type");
    colours = colours || info.channels > 2;
    alpha = alpha || info.channels % 2 == 0;
    inverted = inverted || info.inverted;
    if (slice.path != last) {
      std::error_code error;
      const std::uintmax_t bytes = fs::file_size(slice.path, error);
      fileBytes += error ? 0.0 : static_cast<double>(bytes);
      last = slice.path;
    }
    needed += static_cast<double>(info.width) * info.height * info.bytes;
    if (needed > LargestRatio * fileBytes)
      FailFile(slice.path, "its " + size(info) + " pixels are more than a file of its size can hold");
  }
  const Info& first = slices_[0].info;
  content_.geometry.dimensions = {static_cast<int>(first.width), static_cast<int>(first.height),
                                  static_cast<int>(slices_.size())};
  content_.type = first.isFloat      ? VoxelType::Float32
                  : first.bytes == 1 ? (first.isSigned ? VoxelType::Int8 : VoxelType::UInt8)
                  : first.bytes == 2 ? (first.isSigned ? VoxelType::Int16 : VoxelType::UInt16)
                                     : (first.isSigned ? VoxelType::Int32 : VoxelType::UInt32);
  CheckMemory(content_.path, needed);
  if (colours)
    Note("colours were turned to grey (luminance; equal channels stay as they are)");
  if (alpha)
    Note("transparency was dropped");
  if (inverted)
    Note("zero is white in the file: the numbers were turned round");
}

// The spacing that ImageJ wrote, 0 where it did not. \returns the mm of its unit, 0 when there is none.
double ImageStack::ImageJSpacing(Eigen::Vector3d& spacing) const
{
  std::string unit = ImageJValue(description_, "unit");
  const std::optional<double> mm = MmOfUnit(unit);
  if (!mm)
    return 0.0;
  for (int axis = 0; axis < 2; ++axis)
    if (resolution_[axis] > 0.f && std::isfinite(resolution_[axis]))
      spacing[axis] = *mm / static_cast<double>(resolution_[axis]);
  if (double between = 0.0; ParseNumber(ImageJValue(description_, "spacing"), between) && between > 0.0 && std::isfinite(between))
    spacing[2] = *mm * between;
  return *mm;
}

void ImageStack::FindSpacing(const VolumeReadParameters& parameters)
{
  const Eigen::Vector3d& asked = parameters.stackSpacingMm;
  for (int axis = 0; axis < 3; ++axis)
    if (!(asked[axis] >= 0.0) || !std::isfinite(asked[axis]))
      throw Error(Error::Kind::InvalidParameter,
                  "stackSpacingMm is " + NumberText(asked[axis]) + "; it must be positive, or 0 for what the files say");
  Eigen::Vector3d imageJ = Eigen::Vector3d::Zero();
  ImageJSpacing(imageJ);
  Eigen::Vector3d spacing = asked;
  std::string said, assumed;
  for (int axis = 0; axis < 3; ++axis) {
    if (spacing[axis] > 0.0)
      continue;
    const std::string name(1, "xyz"[axis]);
    const double dots = axis < 2 ? slices_[0].info.dotsPerMm[axis] : 0.0, dpi = dots * 25.4;
    if (imageJ[axis] > 0.0)
      spacing[axis] = imageJ[axis];
    else if (dots > 0.0 && std::isfinite(dots) && std::fabs(dpi - 72.0) > 0.5 && std::fabs(dpi - 96.0) > 0.5)
      spacing[axis] = 1.0 / dots;
    (spacing[axis] > 0.0 ? said : assumed) += (spacing[axis] > 0.0 ? said : assumed).empty() ? name : ", " + name;
    if (!(spacing[axis] > 0.0))
      spacing[axis] = 1.0;
  }
  if (!said.empty())
    Note("the spacing along " + said + " is that of the images' own resolution");
  if (!assumed.empty())
    Note("the images do not say their spacing along " + assumed + ": 1 mm was assumed");
  content_.geometry.spacing = spacing;
  Note("images hold no pose: the first pixel is the origin, and the axes are those of the world");
  try {
    content_.geometry.Check(content_.path);
  } catch (const Error& error) {
    throw Error(Error::Kind::BadFile, error.what());
  }
}

// One number per pixel of several.
template <class T>
void ToGrey(const T* pixels, std::size_t count, const Info& info, T* grey)
{
  const std::size_t channels = static_cast<std::size_t>(info.channels);
  for (std::size_t i = 0; i < count; ++i, pixels += channels) {
    if (channels < 3)
      grey[i] = pixels[0];
    else if (pixels[0] == pixels[1] && pixels[1] == pixels[2])
      grey[i] = pixels[0];
    else {
      const double luminance = 0.299 * static_cast<double>(pixels[0]) + 0.587 * static_cast<double>(pixels[1]) +
                               0.114 * static_cast<double>(pixels[2]);
      grey[i] = static_cast<T>(std::is_integral_v<T> ? std::floor(luminance + 0.5) : luminance);
    }
    if constexpr (std::is_integral_v<T>)
      if (info.inverted)
        grey[i] = static_cast<T>(std::numeric_limits<T>::max() - grey[i]);
  }
}

void ImageStack::Read(std::size_t, void* voxels, unsigned char*, const Progress& progress)
{
  const std::size_t count = static_cast<std::size_t>(slices_[0].info.width) * slices_[0].info.height;
  ParallelFor(static_cast<std::ptrdiff_t>(slices_.size()), progress, [&](std::ptrdiff_t k) {
    Picture slice = slices_[static_cast<std::size_t>(k)];
    const Info expected = slice.info;
    std::vector<std::uint32_t> memory((expected.Size() + 3) / 4); // aligned for every type
    slice.info.pixels = reinterpret_cast<unsigned char*>(memory.data());
    slice.info.room = 4 * memory.size();
    ReadSlice(slice);
    if (!slice.info.SameShape(expected))
      FailFile(slice.path, Changed);
    DispatchVoxelType(content_.type, [&](auto zero) {
      using T = decltype(zero);
      if constexpr (sizeof(T) <= 4)
        ToGrey(reinterpret_cast<const T*>(memory.data()), count, expected,
               static_cast<T*>(voxels) + static_cast<std::size_t>(k) * count);
    });
  });
}

} // namespace

bool LooksLikeImage(std::string_view start)
{
  return KindOf(start) != Kind::None;
}

bool HoldsImages(const std::string& folder)
{
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().filename().string()[0] != '.' && KindOfFile(entry.path()) != Kind::None)
      return true;
  return false;
}

std::unique_ptr<VolumeSource> OpenImageStack(const std::string& path, const VolumeReadParameters& parameters)
{
  return std::make_unique<ImageStack>(path, parameters);
}

} // namespace echorama
