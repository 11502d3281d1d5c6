// SPDX-License-Identifier: BSD-3-Clause
// Opening looks at the header of every image (they must agree); reading decodes slices in parallel, each straight into memory
// of its own size and from there, as grey, into the volume.
#include "Readers/ImageStackFile.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include "Readers/DataFile.h"
#include "Readers/PictureFile.h"
#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>

namespace fs = std::filesystem;

namespace echorama {
namespace {

// No image holds more than this many bytes per byte of its file (progressive JPEG of one colour comes near).
constexpr double LargestRatio = 2e4;

PictureKind KindOfFile(const fs::path& path)
{
  std::error_code error;
  if (!fs::is_regular_file(path, error))
    return PictureKind::None;
  char start[8] = {};
  std::ifstream(path, std::ios::binary).read(start, sizeof start);
  return PictureKindOf({start, sizeof start});
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

// What stands in a text between \a before and one of \a ends, empty when it is not there.
std::string Between(const std::string& text, const std::string& before, const char* ends)
{
  const std::size_t at = text.find(before), begin = at + before.size();
  return at == std::string::npos ? std::string() : text.substr(begin, text.find_first_of(ends, begin) - begin);
}

// The value of "key=value" in the lines of ImageJ's description.
std::string ImageJValue(const std::string& description, const std::string& key)
{
  return Between("\n" + description, "\n" + key + "=", "\r\n");
}

// The value of an attribute in the XML of OME's.
std::string OmeValue(std::string description, const std::string& key)
{
  std::replace_if(
      description.begin(), description.end(), [](unsigned char c) { return std::isspace(c) != 0; }, ' ');
  return Between(description, " " + key + "=\"", "\"");
}

// 0 for what is no length.
double LengthOf(const std::string& text)
{
  double length = 0.0;
  return ParseNumber(text, length) && length > 0.0 && std::isfinite(length) ? length : 0.0;
}

class ImageStack : public VolumeSource {
public:
  ImageStack(const std::string& path, const VolumeReadParameters& parameters) : VolumeSource(path, FileFormat::ImageStack)
  {
    Collect();
    CheckSlices();
    FindSpacing(parameters);
  }
  void Read(std::size_t, void* voxels, unsigned char*, const Progress& progress) override;

private:
  void Collect();
  void CollectPages(std::string path);
  void NoteGaps();
  void CheckSlices();
  void FindSpacing(const VolumeReadParameters& parameters);

  std::vector<Picture> slices_;
  Eigen::Vector3d described_ = Eigen::Vector3d::Zero(); // the spacing that a program wrote into a TIFF, 0: it did not
};

void ImageStack::Collect()
{
  const std::string& path = content_.path;
  std::error_code error, ofEntry; // such as that of a link to nowhere, which is no fault of the folder
  const fs::directory_iterator end;
  if (!fs::exists(path, error))
    throw Error(Error::Kind::FileSystem, path + ": there is no such file");
  if (fs::is_directory(path, error)) {
    std::string ignored;
    int ignoredCount = 0;
    for (fs::directory_iterator entry(path, error); entry != end; entry.increment(error)) {
      const std::string name = entry->path().filename().string();
      if (name[0] == '.' || entry->is_directory(ofEntry))
        continue;
      if (const PictureKind kind = KindOfFile(entry->path()); kind != PictureKind::None)
        slices_.push_back({entry->path().string(), kind});
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
    const PictureKind kind = KindOfFile(path);
    if (kind == PictureKind::None)
      FailFile(path, "the content is none of PNG, JPEG and TIFF");
    slices_.push_back({path, kind});
    const auto [pattern, number] = SplitNumber(fs::path(path).filename().string());
    const bool alone = number < 0 || (kind == PictureKind::Tiff && ReadTiffPages(path).pages.size() > 1);
    fs::path folder = fs::path(path).parent_path();
    for (auto entry = alone ? end : fs::directory_iterator(folder.empty() ? "." : folder, error); entry != end;
         entry.increment(error)) {
      const auto [otherPattern, otherNumber] = SplitNumber(entry->path().filename().string());
      if (otherPattern == pattern && otherNumber >= 0 && entry->path().filename() != fs::path(path).filename())
        if (const PictureKind otherKind = KindOfFile(entry->path()); otherKind != PictureKind::None)
          slices_.push_back({(folder / entry->path().filename()).string(), otherKind});
    }
  }
  std::sort(slices_.begin(), slices_.end(), [](const Picture& a, const Picture& b) {
    return NaturallyBefore(fs::path(a.path).filename().string(), fs::path(b.path).filename().string());
  });
  for (const Picture& slice : slices_)
    if (slices_.size() > 1 && slice.kind == PictureKind::Tiff)
      if (const std::size_t pages = ReadTiffPages(slice.path).pages.size(); pages > 1)
        FailFile(slice.path,
                 "it holds " + std::to_string(pages) + " pages among images that are one slice each; open it by itself");
  if (slices_.size() == 1 && slices_[0].kind == PictureKind::Tiff)
    CollectPages(slices_[0].path);
  else if (!fs::is_directory(path, error) && slices_.size() > 1)
    Note("the " + std::to_string(slices_.size()) + " images beside it that differ by their number were taken as the slices");
  NoteGaps();
}

void ImageStack::CollectPages(std::string path) // a copy: the slices are made anew
{
  const TiffPages tiff = ReadTiffPages(path);
  const std::string& text = tiff.description;
  slices_.clear();
  for (const std::uint64_t page : tiff.pages)
    slices_.push_back({path, PictureKind::Tiff, page});
  if (slices_.empty())
    FailFile(path, "it holds thumbnails alone");
  if (text.find("<OME") != std::string::npos) {
    // Its images are those of all channels and times, in any order.
    if (std::size_t count = 0; ParseNumber(OmeValue(text, "SizeZ"), count) && count < slices_.size())
      FailFile(path, "OME says that it has " + std::to_string(count) + " slices, and there are " +
                         std::to_string(slices_.size()) + " images: several channels or times of a volume; one is needed");
    for (int axis = 0; axis < 3; ++axis) {
      const std::string size = std::string("PhysicalSize") + "XYZ"[axis], unit = OmeValue(text, size + "Unit");
      described_[axis] = LengthOf(OmeValue(text, size)) * Millimetres(unit.empty() ? "um" : unit).value_or(0.0);
    }
  }
  if (text.compare(0, 7, "ImageJ=") != 0)
    return;
  const auto perDot = [](float dots) { return dots > 0.f && std::isfinite(dots) ? 1.0 / static_cast<double>(dots) : 0.0; };
  const std::string unit = ImageJValue(text, "unit");
  if (const auto mm = Millimetres(unit); mm && !unit.empty())
    described_ =
        *mm * Eigen::Vector3d(perDot(tiff.resolution[0]), perDot(tiff.resolution[1]), LengthOf(ImageJValue(text, "spacing")));
  std::uint64_t images = 0;
  if (ParseNumber(ImageJValue(text, "images"), images) && images > slices_.size())
    FailFile(path, "ImageJ says that it holds " + std::to_string(images) + " images, and " + std::to_string(slices_.size()) +
                       " can be found: it is truncated, or larger than TIFF allows; save it as an image sequence");
  for (const char* axis : {"channels", "frames"})
    if (int count = 1; ParseNumber(ImageJValue(text, axis), count) && count > 1) {
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
    ReadPicture(slice);
    const PictureInfo &info = slice.info, &first = slices_[0].info;
    const auto size = [](const PictureInfo& i) { return SizeText(i.width, i.height); };
    const auto type = [](const PictureInfo& i) {
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
  const PictureInfo& first = slices_[0].info;
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

void ImageStack::FindSpacing(const VolumeReadParameters& parameters)
{
  Eigen::Vector3d spacing = parameters.stackSpacingMm;
  std::string said, assumed;
  for (int axis = 0; axis < 3; ++axis) {
    if (spacing[axis] > 0.0)
      continue;
    const std::string name(1, "xyz"[axis]);
    const double dots = axis < 2 ? slices_[0].info.dotsPerMm[axis] : 0.0, dpi = dots * 25.4;
    if (described_[axis] > 0.0)
      spacing[axis] = described_[axis];
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
  CheckGeometry(content_.path, content_.geometry);
}

// One number per pixel of several.
template <class T>
void ToGrey(const T* pixels, std::size_t count, const PictureInfo& info, T* grey)
{
  const std::size_t channels = static_cast<std::size_t>(info.channels);
  for (std::size_t i = 0; i < count; ++i, pixels += channels) {
    if (channels < 3)
      grey[i] = pixels[0];
    else if (pixels[0] == pixels[1] && pixels[1] == pixels[2])
      grey[i] = pixels[0];
    else
      grey[i] = Luminance(pixels);
    if constexpr (std::is_integral_v<T>)
      if (info.inverted)
        grey[i] = static_cast<T>(~grey[i]); // the highest for the lowest
  }
}

void ImageStack::Read(std::size_t, void* voxels, unsigned char*, const Progress& progress)
{
  const std::size_t count = static_cast<std::size_t>(slices_[0].info.width) * slices_[0].info.height;
  ParallelFor(static_cast<std::ptrdiff_t>(slices_.size()), progress, [&](std::ptrdiff_t k) {
    Picture slice = slices_[static_cast<std::size_t>(k)];
    const PictureInfo expected = slice.info;
    std::vector<std::uint32_t> memory((expected.Size() + 3) / 4); // aligned for every type
    slice.info.pixels = reinterpret_cast<unsigned char*>(memory.data());
    slice.info.room = 4 * memory.size();
    ReadPicture(slice);
    if (!slice.info.SameShape(expected))
      FailFile(slice.path, PictureChanged);
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
  return PictureKindOf(start) != PictureKind::None;
}

bool HoldsImages(const std::string& folder)
{
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; entry != end; entry.increment(error))
    if (entry->path().filename().string()[0] != '.' && KindOfFile(entry->path()) != PictureKind::None)
      return true;
  return false;
}

std::unique_ptr<VolumeSource> OpenImageStack(const std::string& path, const VolumeReadParameters& parameters)
{
  return std::make_unique<ImageStack>(path, parameters);
}

} // namespace echorama
