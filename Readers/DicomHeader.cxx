// SPDX-License-Identifier: BSD-3-Clause
// The elements are parsed here and not by gdcm, which allocates what a length promises before it reads, and whose assertions
// end the program on damaged files. One walk over the heads of all elements compares each length with what is left of the
// file, keeps the values of the few tags that we know how to use, and notes where the pixels are.
//
// Pixels that are not compressed are later read straight from the file, picture by picture. Compressed ones are given to
// gdcm's codecs, fragment by fragment; this is the one file that sees gdcm. They print, and damaged pixels can end them by an
// assertion or worse, so they run in a process of their own, which writes to memory shared with this one.
#include "Readers/DicomHeader.h"
#include "Core/Base/Error.h"
#include "Core/Base/IsolatedTask.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <gdcmImage.h>
#include <gdcmSequenceOfFragments.h>
#include <gdcmTrace.h>
#include <limits>
#include <map>
#include <new>
#include <sstream>
#include <sys/mman.h>
#include <zlib.h>

namespace fs = std::filesystem;

namespace echorama {
namespace {

using Tag = std::uint32_t; // group and element

constexpr std::uint32_t Undefined = 0xFFFFFFFF;
constexpr Tag ItemTag = 0xFFFEE000, ItemEnd = 0xFFFEE00D, SequenceEnd = 0xFFFEE0DD, PixelTag = 0x7FE00010;
constexpr int deepest = 16;           // sequences in sequences
constexpr std::uint64_t before = 132; // the preamble and "DICM"
constexpr std::uint64_t longestValue = 65536;
constexpr std::size_t mostPictures = 100000;

// No frame is compressed to less than this part of itself, but for empty ones.
constexpr double mostCompressed = 1e4;

constexpr const char* ImplicitLittleEndian = "1.2.840.10008.1.2";
constexpr const char* Deflated = "1.2.840.10008.1.2.1.99";
constexpr const char* BigEndian = "1.2.840.10008.1.2.2";

// The sequences and the values that are kept.
constexpr Tag SharedGroups = 0x52009229, PictureGroups = 0x52009230, Regions = 0x00186011;
constexpr Tag Sequences[] = {SharedGroups, PictureGroups, Regions,    0x0020930E, 0x0020930F, 0x00209310,
                             0x00209111,   0x00209113,    0x00209116, 0x00289110, 0x00289145, 0x00189807};
constexpr Tag Values[] = {0x00080060, 0x00080070, 0x00081090, 0x00180088, 0x00181060, 0x00181063, 0x00186014,
                          0x00186024, 0x00186026, 0x0018602C, 0x0018602E, 0x00186031, 0x00189808, 0x0020000E,
                          0x00200032, 0x00200037, 0x00200100, 0x00209128, 0x00209301, 0x00209302, 0x00209309,
                          0x0020930D, 0x00280002, 0x00280004, 0x00280006, 0x00280008, 0x00280009, 0x00280010,
                          0x00280011, 0x00280030, 0x00280100, 0x00280101, 0x00280102, 0x00280103, 0x00280301,
                          0x00281052, 0x00281053, 0x30011001, 0x30011003, 0x7FE10010, 0x7FE10011};

bool IsKeptSequence(Tag tag)
{
  return std::find(std::begin(Sequences), std::end(Sequences), tag) != std::end(Sequences);
}

bool IsKeptValue(Tag tag)
{
  // Philips' group has its creators in elements below 0x100 and the spacing in number 3 of the block of one of them.
  return std::binary_search(std::begin(Values), std::end(Values), tag) ||
         (tag >> 16 == 0x200D && ((tag & 0xFFFF) < 0x100 || (tag & 0xFF) == 0x03));
}

std::string TextOf(Tag tag)
{
  char text[16];
  std::snprintf(text, sizeof text, "(%04X,%04X)", tag >> 16, tag & 0xFFFF);
  return text;
}

std::string Trimmed(std::string text)
{
  const auto blank = [](char c) { return c == ' ' || c == '\0'; };
  while (!text.empty() && blank(text.back()))
    text.pop_back();
  text.erase(text.begin(), std::find_if_not(text.begin(), text.end(), blank));
  return text;
}

// Where the value of an element of the outermost data set lies.
struct Place {
  std::uint64_t offset = 0, bytes = 0;
};

// What is kept of a data set.
struct DataSet {
  std::map<Tag, std::string> values;
  std::map<Tag, std::vector<DataSet>> sequences;
};

class Parser {
public:
  Parser(std::istream& stream, std::uint64_t end, const std::string& path) : stream_(stream), end_(end), path_(path) {}

  // The elements of group 2, which say how the others are written. \returns the transfer syntax
  std::string MetaInformation()
  {
    Seek(before);
    std::string syntax;
    while (end_ - at_ >= 8) {
      const std::uint64_t start = at_;
      const Tag tag = ReadTag();
      Seek(start);
      if (tag >> 16 != 2)
        break;
      std::string value;
      Element(nullptr, true, end_, 0, tag == 0x00020010 ? &value : nullptr);
      if (tag == 0x00020010)
        syntax = Trimmed(value);
    }
    return syntax;
  }

  DataSet Outermost(bool explicitTypes)
  {
    DataSet data;
    Elements(&data, explicitTypes, end_, 0);
    return data;
  }

  std::uint64_t At() const { return at_; }

  Place pixels, kretz;
  bool encapsulated = false;

private:
  void Seek(std::uint64_t at)
  {
    at_ = at;
    stream_.clear();
    stream_.seekg(static_cast<std::streamoff>(at));
  }

  void Skip(std::uint64_t bytes)
  {
    at_ += bytes;
    if (bytes > 4096)
      stream_.seekg(static_cast<std::streamoff>(at_));
    else
      stream_.ignore(static_cast<std::streamsize>(bytes));
  }

  void Take(void* bytes, std::size_t count)
  {
    if (end_ - at_ < count || !stream_.read(static_cast<char*>(bytes), static_cast<std::streamsize>(count)))
      FailFile(path_, "the data end early, in the head of an element: the file is truncated");
    at_ += count;
  }

  Tag ReadTag()
  {
    unsigned char b[4];
    Take(b, 4);
    return std::uint32_t{b[1]} << 24 | std::uint32_t{b[0]} << 16 | std::uint32_t{b[3]} << 8 | b[2];
  }

  std::uint32_t ReadLength()
  {
    unsigned char b[4];
    Take(b, 4);
    return std::uint32_t{b[3]} << 24 | std::uint32_t{b[2]} << 16 | std::uint32_t{b[1]} << 8 | b[0];
  }

  void CheckLength(Tag tag, std::uint64_t bytes, std::uint64_t end) const
  {
    if (at_ > end || bytes > end - at_)
      FailFile(path_, "the element " + TextOf(tag) + " says that it is " + std::to_string(bytes) + " bytes long, and only " +
                          std::to_string(at_ > end ? 0 : end - at_) + " follow: the file is truncated or damaged");
  }

  // Elements up to \a end or a mark of the end of an item. \a data may be null: then they are only walked over.
  void Elements(DataSet* data, bool explicitTypes, std::uint64_t end, int depth)
  {
    if (depth > deepest)
      FailFile(path_, "its sequences are nested more than " + std::to_string(deepest) + " deep");
    while (at_ < end) {
      if (depth == 0 && pixels.bytes > 0 && end - at_ < 8)
        return; // padding
      if (Element(data, explicitTypes, end, depth, nullptr))
        return;
    }
  }

  // \returns whether it was the mark of an end
  bool Element(DataSet* data, bool explicitTypes, std::uint64_t end, int depth, std::string* asked)
  {
    const Tag tag = ReadTag();
    if (tag == ItemEnd || tag == SequenceEnd) {
      ReadLength();
      return true;
    }
    std::string type;
    std::uint64_t bytes = 0;
    if (explicitTypes) {
      unsigned char b[4];
      Take(b, 4);
      type.assign(reinterpret_cast<const char*>(b), 2);
      const auto letter = [](char c) { return c >= 'A' && c <= 'Z'; };
      if (!letter(type[0]) || !letter(type[1]))
        FailFile(path_, "the element " + TextOf(tag) + " has no type: the file is damaged");
      static const std::string longTypes = "OB OW OF OD OL OV SQ UN UC UR UT SV UV ";
      bytes = longTypes.find(type + " ") != std::string::npos ? ReadLength() : std::uint64_t{b[2]} | std::uint64_t{b[3]} << 8;
    } else
      bytes = ReadLength();

    const std::uint64_t start = at_;
    const bool isPixels = tag == PixelTag || type == "OB" || type == "OW", isUndefined = bytes == Undefined;
    if (!isUndefined)
      CheckLength(tag, bytes, end);
    if (isUndefined && isPixels)
      Fragments(end);
    else if (isUndefined || (data && IsKeptSequence(tag))) {
      std::vector<DataSet>* items = data && IsKeptSequence(tag) ? &data->sequences[tag] : nullptr;
      Items(items, explicitTypes && type != "UN", isUndefined ? end : start + bytes, depth);
      if (!isUndefined)
        Seek(start + bytes);
    } else if (asked || (data && IsKeptValue(tag) && bytes <= longestValue)) {
      std::string& value = asked ? *asked : data->values[tag];
      value.resize(std::min(bytes, longestValue));
      Take(value.data(), value.size());
      Seek(start + bytes);
    } else
      Skip(bytes);
    if (data && depth == 0 && tag == PixelTag) {
      pixels = {start, at_ - start};
      encapsulated = isUndefined;
    } else if (data && depth == 0 && tag == 0x7FE11101)
      kretz = {start, at_ - start};
    return false;
  }

  // The items of a sequence, up to \a end or a mark.
  void Items(std::vector<DataSet>* items, bool explicitTypes, std::uint64_t end, int depth)
  {
    while (at_ < end) {
      const Tag tag = ReadTag();
      const std::uint32_t bytes = ReadLength();
      if (tag == SequenceEnd)
        return;
      if (tag != ItemTag)
        FailFile(path_, "a sequence holds " + TextOf(tag) + " where an item should begin: the file is damaged");
      if (bytes != Undefined)
        CheckLength(tag, bytes, end);
      const std::uint64_t itemEnd = bytes == Undefined ? end : at_ + bytes;
      if (items)
        items->emplace_back();
      Elements(items ? &items->back() : nullptr, explicitTypes, itemEnd, depth + 1);
      if (bytes != Undefined)
        Seek(itemEnd);
    }
  }

  // Compressed pixels.
  void Fragments(std::uint64_t end)
  {
    while (at_ < end) {
      const Tag tag = ReadTag();
      const std::uint32_t bytes = ReadLength();
      if (tag == SequenceEnd)
        return;
      if (tag != ItemTag)
        FailFile(path_, "its compressed pixels are damaged");
      CheckLength(tag, bytes, end);
      Skip(bytes);
    }
    FailFile(path_, "its compressed pixels end early: the file is truncated");
  }

  std::istream& stream_;
  std::uint64_t at_ = 0, end_;
  const std::string& path_;
};

// A deflated data set (without zlib's head), at most as long as such a stream can be.
std::string Inflated(std::ifstream& stream, std::uint64_t at, std::uint64_t bytes, const std::string& path)
{
  std::string packed(bytes, '\0'), out;
  stream.clear();
  stream.seekg(static_cast<std::streamoff>(at));
  if (!stream.read(packed.data(), static_cast<std::streamsize>(bytes)))
    FailFile(path, "it cannot be read");
  z_stream z{};
  inflateInit2(&z, -MAX_WBITS);
  z.next_in = reinterpret_cast<Bytef*>(packed.data());
  z.avail_in = static_cast<uInt>(std::min<std::uint64_t>(bytes, std::numeric_limits<uInt>::max()));
  int status = Z_OK;
  while (status == Z_OK) {
    const std::size_t done = out.size();
    out.resize(done + (std::size_t{1} << 20));
    z.next_out = reinterpret_cast<Bytef*>(out.data() + done);
    z.avail_out = 1u << 20;
    status = inflate(&z, Z_NO_FLUSH);
    out.resize(out.size() - z.avail_out);
    if (status == Z_OK && z.avail_in == 0 && z.avail_out > 0)
      break;
  }
  inflateEnd(&z);
  if (status != Z_STREAM_END)
    FailFile(path, "its deflated data are damaged or end early");
  return out;
}

// Values of a data set. What is missing or of another form is empty.
std::string Text(const DataSet& data, Tag tag)
{
  const auto found = data.values.find(tag);
  return found == data.values.end() ? std::string() : Trimmed(found->second);
}

// Numbers written as text, separated by backslashes (DS, IS).
std::vector<double> Decimals(const DataSet& data, Tag tag, std::size_t count)
{
  std::vector<double> numbers;
  std::istringstream parts(Text(data, tag));
  for (std::string part; std::getline(parts, part, '\\');) {
    double number = 0.0;
    if (!ParseNumber(Trimmed(part), number) || !std::isfinite(number))
      return {};
    numbers.push_back(number);
  }
  return numbers.size() == count ? numbers : std::vector<double>();
}

// Numbers in binary, little endian as this machine.
template <class T>
std::vector<T> Binary(const DataSet& data, Tag tag, std::size_t count)
{
  const auto found = data.values.find(tag);
  if (found == data.values.end() || found->second.size() != count * sizeof(T))
    return {};
  std::vector<T> numbers(count);
  std::memcpy(numbers.data(), found->second.data(), count * sizeof(T));
  if constexpr (std::is_floating_point_v<T>)
    if (std::any_of(numbers.begin(), numbers.end(), [](T n) { return !std::isfinite(n); }))
      return {};
  return numbers;
}

std::optional<double> Double(const DataSet& data, Tag tag)
{
  const auto numbers = Binary<double>(data, tag, 1);
  return numbers.empty() ? std::nullopt : std::optional<double>(numbers[0]);
}

int Short(const DataSet& data, Tag tag, int otherwise)
{
  const auto numbers = Binary<std::uint16_t>(data, tag, 1);
  return numbers.empty() ? otherwise : numbers[0];
}

const std::vector<DataSet>* Sequence(const DataSet& data, Tag tag)
{
  const auto found = data.sequences.find(tag);
  return found == data.sequences.end() ? nullptr : &found->second;
}

// Calls functor with the first item of a sequence, if there is one.
template <class Functor>
bool WithItem(const DataSet& data, Tag tag, const Functor& functor)
{
  const std::vector<DataSet>* items = Sequence(data, tag);
  if (!items || items->empty())
    return false;
  functor(items->front());
  return true;
}

void SetPosition(DicomPlane& plane, const std::vector<double>& n)
{
  if (n.size() == 3)
    plane.position = Eigen::Vector3d(n[0], n[1], n[2]);
}

void SetDirections(DicomPlane& plane, const std::vector<double>& n)
{
  if (n.size() == 6) {
    plane.directions.emplace();
    *plane.directions << n[0], n[3], n[1], n[4], n[2], n[5];
  }
}

void SetSpacing(DicomPicture& picture, const DataSet& data)
{
  if (const auto n = Decimals(data, 0x00280030, 2); !n.empty())
    picture.spacing = {n[1], n[0]}; // the file gives that of rows, then that of columns
  if (const auto n = Decimals(data, 0x00180088, 1); !n.empty())
    picture.sliceSpacing = n[0];
}

void SetRescale(DicomPicture& picture, const DataSet& data)
{
  if (const auto n = Decimals(data, 0x00281053, 1); !n.empty())
    picture.slope = n[0];
  if (const auto n = Decimals(data, 0x00281052, 1); !n.empty())
    picture.intercept = n[0];
}

// The one spacing of the calibrated regions of an ultrasound picture; nothing where they disagree or are no lengths.
void SetRegionSpacing(DicomPicture& picture, const DataSet& data)
{
  constexpr int centimetres = 3, tissue = 1;
  constexpr double mmPerCm = 10.0;
  const std::vector<DataSet>* regions = Sequence(data, Regions);
  Eigen::Vector2d found = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; regions && i < regions->size(); ++i) {
    const DataSet& region = (*regions)[i];
    if (Short(region, 0x00186014, tissue) != tissue || Short(region, 0x00186024, 0) != centimetres ||
        Short(region, 0x00186026, 0) != centimetres)
      continue;
    const Eigen::Vector2d spacing =
        mmPerCm * Eigen::Vector2d(Double(region, 0x0018602C).value_or(0.0), Double(region, 0x0018602E).value_or(0.0)).cwiseAbs();
    if (!found.isZero() && !found.isApprox(spacing, 1e-6))
      return;
    found = spacing;
  }
  picture.spacing = found;
}

// What an object without functional groups says of all its pictures.
DicomPicture PlainPicture(const DataSet& data)
{
  DicomPicture picture;
  SetPosition(picture.patient, Decimals(data, 0x00200032, 3));
  SetDirections(picture.patient, Decimals(data, 0x00200037, 6));
  SetSpacing(picture, data);
  if (picture.spacing.isZero())
    SetRegionSpacing(picture, data);
  SetRescale(picture, data);
  if (const auto n = Decimals(data, 0x00200100, 1); !n.empty())
    picture.timeIndex = static_cast<int>(n[0]);
  if (const auto n = Decimals(data, 0x00181060, 1); !n.empty() && picture.timeIndex)
    picture.time = n[0] * 1e-3;
  return picture;
}

// One functional group is in the item of the picture or, for all, in the shared one.
DicomPicture GroupedPicture(const DataSet& shared, const DataSet& own)
{
  DicomPicture picture;
  const auto group = [&shared, &own](Tag tag, const auto& functor) {
    WithItem(own, tag, functor) || WithItem(shared, tag, functor);
  };
  using Data = const DataSet&;
  group(0x00209113, [&](Data d) { SetPosition(picture.patient, Decimals(d, 0x00200032, 3)); });
  group(0x00209116, [&](Data d) { SetDirections(picture.patient, Decimals(d, 0x00200037, 6)); });
  group(0x0020930E, [&](Data d) { SetPosition(picture.volume, Binary<double>(d, 0x00209301, 3)); });
  group(0x0020930F, [&](Data d) { SetDirections(picture.volume, Binary<double>(d, 0x00209302, 6)); });
  group(0x00289110, [&](Data d) { SetSpacing(picture, d); });
  group(0x00289145, [&](Data d) { SetRescale(picture, d); });
  group(0x00189807, [&](Data d) { picture.dataType = Text(d, 0x00189808); });
  group(0x00209310, [&](Data d) { picture.time = Double(d, 0x0020930D); });
  group(0x00209111, [&](Data d) {
    if (const auto n = Binary<std::uint32_t>(d, 0x00209128, 1); !n.empty())
      picture.timeIndex = static_cast<int>(n[0] & 0x7FFFFFFF);
  });
  return picture;
}

// The element with this number that a private creator has reserved, by the creator's name.
std::string PrivateText(const DataSet& data, std::uint32_t group, std::uint32_t element, const std::string& creator)
{
  for (std::uint32_t block = 0x10; block <= 0xFF; ++block)
    if (Text(data, group << 16 | block) == creator)
      return Text(data, group << 16 | block << 8 | element);
  return {};
}

class HeaderReader {
public:
  explicit HeaderReader(const std::string& path) : path_(path) { header_.path = path; }

  DicomHeader Read()
  {
    const DataSet data = Parse();
    ReadImage(data);
    if (header_.kretzBytes == 0 && header_.pixelBytes > 0) {
      ReadPictures(data);
      CheckPixels();
    }
    return header_;
  }

private:
  DataSet Parse()
  {
    std::error_code error;
    const std::uint64_t bytes = fs::is_regular_file(path_, error) ? fs::file_size(path_, error) : 0;
    std::ifstream stream(path_, std::ios::binary);
    if (error || !stream || !fs::is_regular_file(path_, error))
      throw Error(Error::Kind::FileSystem, path_ + ": it cannot be opened (is it there, and is reading permitted?)");
    std::string start(before, '\0');
    stream.read(start.data(), static_cast<std::streamsize>(start.size()));
    if (!stream || !LooksLikeDicom(start))
      FailFile(path_, "it is not DICOM: DICM is missing after its first 128 bytes");
    Parser parser(stream, bytes, path_);
    header_.transferSyntax = parser.MetaInformation();
    if (header_.transferSyntax.empty())
      FailFile(path_, "its transfer syntax is missing");
    if (header_.transferSyntax == BigEndian)
      FailFile(path_, "its numbers are big-endian, a retired way to write DICOM that is not supported");
    if (header_.transferSyntax == Deflated) {
      const std::string plain = Inflated(stream, parser.At(), bytes - parser.At(), path_);
      std::istringstream inflated(plain);
      Parser inside(inflated, plain.size(), path_);
      DataSet data = inside.Outermost(true);
      Note(inside, data);
      header_.storage = DicomStorage::Deflated;
      header_.kretzBytes = 0; // its offset is not one of the file
      return data;
    }
    DataSet data = parser.Outermost(header_.transferSyntax != ImplicitLittleEndian);
    Note(parser, data);
    return data;
  }

  void Note(const Parser& parser, const DataSet& data)
  {
    header_.storage = parser.encapsulated ? DicomStorage::Encapsulated : DicomStorage::Plain;
    header_.pixelOffset = parser.pixels.offset;
    header_.pixelBytes = parser.pixels.bytes;
    if (Text(data, 0x7FE10011) == "KRETZ_US") {
      header_.kretzOffset = parser.kretz.offset;
      header_.kretzBytes = parser.kretz.bytes;
    }
    header_.holdsMovieGroup = Text(data, 0x7FE10010) == "GEMS_Ultrasound_MovieGroup_001";
  }

  void ReadImage(const DataSet& data)
  {
    header_.series = Text(data, 0x0020000E);
    header_.photometric = Text(data, 0x00280004);
    header_.rows = Short(data, 0x00280010, 0);
    header_.columns = Short(data, 0x00280011, 0);
    header_.samples = Short(data, 0x00280002, 1);
    header_.planar = Short(data, 0x00280006, 0) == 1;
    header_.bitsAllocated = Short(data, 0x00280100, 0);
    header_.bitsStored = Short(data, 0x00280101, header_.bitsAllocated);
    highBit_ = Short(data, 0x00280102, header_.bitsStored - 1);
    header_.isSigned = Short(data, 0x00280103, 0) == 1;
    header_.burnedIn = Text(data, 0x00280301) == "YES";
    if (const auto n = Decimals(data, 0x00181063, 1); !n.empty())
      header_.frameTime = n[0] * 1e-3;
    if (const auto n = Binary<std::uint16_t>(data, 0x00280009, 2); !n.empty())
      header_.frameIncrement = n[0] == 0x0018 && (n[1] == 0x1063 || n[1] == 0x1065) ? "time"
                               : (n[0] == 0x0018 && n[1] == 0x0088) || (n[0] == 0x0020 && (n[1] == 0x1041 || n[1] == 0x0032))
                                   ? "space"
                                   : "";
    if (const auto n = Binary<double>(data, 0x00209309, 16); !n.empty())
      header_.volumeToTransducer = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(n.data());
    for (const auto& [key, tag] :
         {std::pair("Modality", Tag(0x00080060)), std::pair("Manufacturer", Tag(0x00080070)),
          std::pair("ManufacturerModelName", Tag(0x00081090)), std::pair("TransducerType", Tag(0x00186031))}) {
      std::string text = Text(data, tag).substr(0, 256);
      std::replace_if(
          text.begin(), text.end(), [](char c) { return c < 32 || c > 126; }, '?');
      if (!text.empty())
        header_.fields.emplace_back(key, text);
    }
  }

  void ReadPictures(const DataSet& data)
  {
    std::size_t count = 1;
    if (const std::string text = Text(data, 0x00280008); !text.empty()) {
      const auto n = Decimals(data, 0x00280008, 1);
      if (n.empty() || !(n[0] >= 1.0 && n[0] <= static_cast<double>(mostPictures)) || n[0] != std::floor(n[0]))
        FailFile(path_,
                 "its number of frames is \"" + text.substr(0, 40) + "\"; it must be from 1 to " + std::to_string(mostPictures));
      count = static_cast<std::size_t>(n[0]);
    }
    if (count > header_.pixelBytes)
      FailFile(path_, "it says that it holds " + std::to_string(count) + " frames, more than it has bytes for");

    const std::vector<DataSet>* groups = Sequence(data, PictureGroups);
    if (!groups) {
      const DicomPicture picture = PlainPicture(data);
      header_.pictures.assign(count, picture);
      ReadPhilips(data);
      return;
    }
    if (groups->size() != count)
      FailFile(path_,
               "it holds " + std::to_string(count) + " frames and functional groups for " + std::to_string(groups->size()));
    header_.grouped = true;
    const std::vector<DataSet>* shared = Sequence(data, SharedGroups);
    for (const DataSet& own : *groups)
      header_.pictures.push_back(GroupedPicture(shared && !shared->empty() ? shared->front() : DataSet(), own));
  }

  void ReadPhilips(const DataSet& data)
  {
    // QLAB's Cartesian export: depth of the volume and its third spacing in private elements, lengths in cm.
    constexpr double mmPerCm = 10.0;
    if (const auto slices = Binary<std::uint32_t>(data, 0x30011001, 1); !slices.empty()) {
      const auto x = Double(data, 0x0018602C), y = Double(data, 0x0018602E), z = Double(data, 0x30011003);
      if (slices[0] >= 1 && slices[0] <= 65535 && x && y && z) {
        header_.volumeSlices = static_cast<int>(slices[0]);
        header_.volumeSpacing = mmPerCm * Eigen::Vector3d(*x, *y, *z);
      }
    }
    // Affiniti: the pictures of the file are the slices of one volume, its three spacings a private text.
    const std::string spacing = PrivateText(data, 0x200D, 0x03, "Philips US Imaging DD 036");
    double x = 0.0, y = 0.0, z = 0.0;
    std::istringstream parts(spacing);
    std::string a, b, c;
    if (!spacing.empty() && std::getline(parts, a, '\\') && std::getline(parts, b, '\\') && std::getline(parts, c) &&
        ParseNumber(Trimmed(a), x) && ParseNumber(Trimmed(b), y) && ParseNumber(Trimmed(c), z)) {
      for (DicomPicture& picture : header_.pictures) {
        picture.spacing = {x, y};
        picture.sliceSpacing = z;
      }
      header_.frameIncrement = "space";
    }
  }

  void CheckPixels()
  {
    if (header_.rows < 1 || header_.columns < 1)
      FailFile(path_, "its pictures have " + std::to_string(header_.columns) + " x " + std::to_string(header_.rows) + " pixels");
    if (header_.bitsAllocated != 8 && header_.bitsAllocated != 16 && header_.bitsAllocated != 32)
      FailFile(path_, "its pixels have " + std::to_string(header_.bitsAllocated) + " bits; 8, 16 or 32 are supported");
    if (header_.bitsStored < 1 || header_.bitsStored > header_.bitsAllocated || highBit_ != header_.bitsStored - 1)
      FailFile(path_, "its pixels use " + std::to_string(header_.bitsStored) + " bits up to bit " + std::to_string(highBit_) +
                          " of " + std::to_string(header_.bitsAllocated) + ", which is not supported");
    const std::string& colour = header_.photometric;
    const bool grey = colour == "MONOCHROME1" || colour == "MONOCHROME2";
    const bool coloured = colour == "RGB" || colour.compare(0, 4, "YBR_") == 0;
    if (!(grey && header_.samples == 1) && !(coloured && header_.samples == 3 && header_.bitsAllocated == 8))
      FailFile(path_, "its pixels are " + std::to_string(header_.samples) + " numbers of " +
                          std::to_string(header_.bitsAllocated) + " bits that mean " +
                          (colour.empty() ? "nothing known" : colour) + ", which is not supported");
    const double decoded = static_cast<double>(header_.PictureBytes()) * static_cast<double>(header_.pictures.size()) *
                           std::max(1, header_.volumeSlices);
    const double there = static_cast<double>(header_.pixelBytes);
    const bool encapsulated = header_.storage == DicomStorage::Encapsulated;
    if (encapsulated ? decoded > mostCompressed * there : decoded > there)
      FailFile(path_, "its " + std::to_string(header_.pictures.size()) + " frames of " + std::to_string(header_.columns) + " x " +
                          std::to_string(header_.rows) + " pixels need " + NumberText(decoded) + " bytes, " +
                          (encapsulated ? "more than can be compressed to the " : "and it holds ") + NumberText(there) +
                          ": it is truncated or its sizes are wrong");
  }

  std::string path_;
  DicomHeader header_;
  int highBit_ = 7;
};

[[noreturn]] void FailPixels(const DicomHeader& header)
{
  FailFile(header.path, "its pixels cannot be decoded: they are damaged or of a kind that is not supported");
}

bool Decode(const DicomHeader& header, const std::vector<std::string>& fragments, std::uint64_t bytes, char* out)
{
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();
  gdcm::Trace::DebugOff();
  gdcm::DataElement element(gdcm::Tag(0x7FE0, 0x0010));
  element.SetVR(gdcm::VR::OB);
  const auto sequence = gdcm::SequenceOfFragments::New();
  for (const std::string& bytesOfOne : fragments) {
    gdcm::Fragment fragment;
    fragment.SetByteValue(bytesOfOne.data(), static_cast<std::uint32_t>(bytesOfOne.size()));
    sequence->AddFragment(fragment);
  }
  element.SetValue(*sequence);
  gdcm::Image image;
  const auto pictures = static_cast<unsigned>(header.pictures.size());
  image.SetNumberOfDimensions(pictures > 1 ? 3 : 2);
  image.SetDimension(0, static_cast<unsigned>(header.columns));
  image.SetDimension(1, static_cast<unsigned>(header.rows));
  if (pictures > 1)
    image.SetDimension(2, pictures);
  const auto stored = static_cast<unsigned short>(header.bitsStored);
  image.SetPixelFormat(gdcm::PixelFormat(static_cast<unsigned short>(header.samples),
                                         static_cast<unsigned short>(header.bitsAllocated), stored,
                                         static_cast<unsigned short>(stored - 1), header.isSigned ? 1 : 0));
  image.SetPhotometricInterpretation(gdcm::PhotometricInterpretation::GetPIType(header.photometric.c_str()));
  image.SetPlanarConfiguration(0);
  image.SetTransferSyntax(gdcm::TransferSyntax::GetTSType(header.transferSyntax.c_str()));
  image.SetDataElement(element);
  return image.GetBufferLength() == bytes && image.GetBuffer(out);
}

// Memory that this process shares with those that it starts.
class SharedMemory {
public:
  explicit SharedMemory(std::size_t bytes)
    : bytes_(bytes), data_(mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0))
  {
    if (data_ == MAP_FAILED)
      throw std::bad_alloc();
  }
  ~SharedMemory() { munmap(data_, bytes_); }
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

  char* Data() const { return static_cast<char*>(data_); }

private:
  std::size_t bytes_;
  void* data_;
};

} // namespace

std::uint64_t DicomHeader::PictureBytes() const
{
  const std::uint64_t pixels = static_cast<std::uint64_t>(rows) * static_cast<std::uint64_t>(columns);
  if (storage != DicomStorage::Encapsulated && photometric == "YBR_FULL_422")
    return (static_cast<std::uint64_t>(columns) + 1) / 2 * 4 * static_cast<std::uint64_t>(rows);
  return pixels * static_cast<std::uint64_t>(samples) * static_cast<std::uint64_t>(bitsAllocated / 8);
}

bool LooksLikeDicom(std::string_view start)
{
  return start.size() >= before && start.substr(128, 4) == "DICM";
}

DicomHeader ReadDicomHeader(const std::string& path)
{
  return HeaderReader(path).Read();
}

std::vector<std::string> ReadDicomFragments(const DicomHeader& header)
{
  std::ifstream stream(header.path, std::ios::binary);
  const gdcm::TransferSyntax::TSType syntax = gdcm::TransferSyntax::GetTSType(header.transferSyntax.c_str());
  std::vector<std::string> fragments;
  std::uint64_t at = header.pixelOffset;
  const std::uint64_t end = at + header.pixelBytes;
  stream.seekg(static_cast<std::streamoff>(at));
  for (bool table = true; at < end; table = false) {
    unsigned char b[8];
    if (end - at < 8 || !stream.read(reinterpret_cast<char*>(b), 8))
      FailPixels(header);
    at += 8;
    const std::uint32_t bytes = std::uint32_t{b[7]} << 24 | std::uint32_t{b[6]} << 16 | std::uint32_t{b[5]} << 8 | b[4];
    if (b[2] == 0xDD) // the end of the sequence
      break;
    if (bytes > end - at)
      FailPixels(header);
    std::string fragment(bytes, '\0');
    if (!stream.read(fragment.data(), static_cast<std::streamsize>(bytes)))
      FailPixels(header);
    at += bytes;
    if (!table) // the first item is a table of offsets
      fragments.push_back(std::move(fragment));
  }
  const std::size_t pictures = header.pictures.size();
  if (syntax == gdcm::TransferSyntax::TS_END || fragments.size() < pictures || (pictures > 1 && fragments.size() != pictures))
    FailPixels(header);
  const bool isRle = syntax == gdcm::TransferSyntax::RLELossless;
  for (std::size_t i = 0; i < fragments.size(); ++i) {
    const std::string& f = fragments[i];
    const auto begins = [&f](const char* mark, std::size_t count) { return f.compare(0, count, mark, count) == 0; };
    const bool first = pictures > 1 || i == 0;
    if (first && (isRle ? f.size() < 64 : !begins("\xFF\xD8", 2) && !begins("\xFF\x4F\xFF\x51", 4) && !begins("\0\0\0\x0CjP", 6)))
      FailPixels(header);
  }
  return fragments;
}

std::vector<char> DecodeDicomPixels(const DicomHeader& header, const Progress& progress, double fraction)
{
  const std::uint64_t wanted = header.PictureBytes() * header.pictures.size();
  if (header.storage == DicomStorage::Deflated) {
    std::ifstream stream(header.path, std::ios::binary);
    const std::uint64_t bytes = fs::file_size(header.path);
    Parser parser(stream, bytes, header.path);
    parser.MetaInformation();
    const std::string plain = Inflated(stream, parser.At(), bytes - parser.At(), header.path);
    if (plain.size() < header.pixelOffset || plain.size() - header.pixelOffset < wanted)
      FailPixels(header);
    const auto first = plain.begin() + static_cast<std::ptrdiff_t>(header.pixelOffset);
    return {first, first + static_cast<std::ptrdiff_t>(wanted)};
  }

  const std::vector<std::string> fragments = ReadDicomFragments(header);
  const SharedMemory memory(wanted);
  char* const out = memory.Data();
  // The slowest codec, JPEG 2000, makes some 10 MB in a second, and holds several copies of what it makes.
  const double megabytes = 1e-6 * static_cast<double>(wanted);
  const TaskLimits limits{30.0 + megabytes, (std::uint64_t{1} << 28) + 16 * wanted};
  switch (RunIsolated([&] { return Decode(header, fragments, wanted, out); }, limits, progress, fraction)) {
  case TaskOutcome::Succeeded:
    break;
  case TaskOutcome::Failed:
    FailPixels(header);
  case TaskOutcome::TimedOut:
    FailFile(header.path, "its pixels are damaged: decoding them did not come to an end");
  }
  return {out, out + wanted};
}

} // namespace echorama
