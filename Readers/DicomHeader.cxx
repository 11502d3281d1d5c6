// SPDX-License-Identifier: BSD-3-Clause
// gdcm parses and decodes; this is the one file that sees its headers. Two passes over a file:
//
// 1. Lengths. gdcm allocates what an element says of its length before it reads. So all elements, down into sequences, are
//    walked first, only their heads, and each length must fit into what is left of the file. (A deflated data set is
//    inflated for that.) On the way the place of the pixels is noted.
// 2. Meaning. gdcm reads everything before the pixels, and the few tags that we know how to use are copied out.
//
// Pixels that are not compressed are later read straight from the file, picture by picture; all others go through gdcm.
#include "Readers/DicomHeader.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <gdcmImageReader.h>
#include <gdcmReader.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmTrace.h>
#include <limits>
#include <sstream>
#include <zlib.h>

namespace fs = std::filesystem;

namespace echorama {
namespace {

using gdcm::Tag;

constexpr std::uint32_t Undefined = 0xFFFFFFFF;
constexpr std::uint32_t ItemTag = 0xFFFEE000, ItemEnd = 0xFFFEE00D, SequenceEnd = 0xFFFEE0DD, PixelTag = 0x7FE00010;
constexpr int deepest = 16;           // sequences in sequences
constexpr std::uint64_t before = 132; // the preamble and "DICM"
constexpr std::size_t mostPictures = 100000;

// No frame is compressed to less than this part of itself, but for empty ones.
constexpr double mostCompressed = 1e4;

[[noreturn]] void Fail(const std::string& path, const std::string& reason)
{
  throw Error(Error::Kind::BadFile, path + ": " + reason);
}

std::string TextOf(std::uint32_t tag)
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

// Pass 1.
class LengthWalk {
public:
  LengthWalk(std::istream& stream, std::uint64_t end, const std::string& path) : stream_(stream), end_(end), path_(path) {}

  // The elements of group 2, which say how the others are written.
  void MetaInformation()
  {
    Seek(before);
    while (end_ - at_ >= 8) {
      const std::uint64_t start = at_;
      const std::uint32_t tag = ReadTag();
      if (tag >> 16 != 2) {
        Seek(start);
        break;
      }
      Seek(start);
      std::string value;
      Element(true, 0, tag == 0x00020010 ? &value : nullptr);
      if (tag == 0x00020010)
        transferSyntax = Trimmed(value);
    }
  }

  void DataSet(bool explicitTypes) { Elements(end_, explicitTypes, 0); }

  std::uint64_t At() const { return at_; }

  std::string transferSyntax;
  Place pixels, kretz, kretzCreator, movieCreator;
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

  void Take(unsigned char* bytes, std::size_t count)
  {
    if (end_ - at_ < count || !stream_.read(reinterpret_cast<char*>(bytes), static_cast<std::streamsize>(count)))
      Fail(path_, "the data end early, in the head of an element: the file is truncated");
    at_ += count;
  }

  std::uint32_t ReadTag()
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

  void CheckLength(std::uint32_t tag, std::uint64_t bytes, std::uint64_t end)
  {
    if (bytes > end - at_)
      Fail(path_, "the element " + TextOf(tag) + " says that it is " + std::to_string(bytes) + " bytes long, and only " +
                      std::to_string(end - at_) + " follow: the file is truncated or damaged");
  }

  // Elements up to \a end or a mark of the end of an item.
  void Elements(std::uint64_t end, bool explicitTypes, int depth)
  {
    if (depth > deepest)
      Fail(path_, "its sequences are nested more than " + std::to_string(deepest) + " deep");
    while (at_ < end) {
      if (depth == 0 && pixels.bytes > 0 && end - at_ < 8)
        return; // padding
      if (Element(explicitTypes, depth, nullptr, end))
        return;
    }
  }

  // \returns whether it was the mark of an end
  bool Element(bool explicitTypes, int depth, std::string* value, std::uint64_t end)
  {
    const std::uint32_t tag = ReadTag();
    if (tag == ItemEnd || tag == SequenceEnd) {
      ReadLength();
      return true;
    }
    std::string type;
    std::uint64_t bytes = 0;
    if (explicitTypes && tag >> 16 != 0xFFFE) {
      unsigned char b[4];
      Take(b, 4);
      type.assign(reinterpret_cast<const char*>(b), 2);
      const auto letter = [](char c) { return c >= 'A' && c <= 'Z'; };
      if (!letter(type[0]) || !letter(type[1]))
        Fail(path_, "the element " + TextOf(tag) + " has no type: the file is damaged");
      static const std::string longTypes = "OB OW OF OD OL OV SQ UN UC UR UT SV UV ";
      bytes = longTypes.find(type + " ") != std::string::npos ? ReadLength() : std::uint64_t{b[2]} | std::uint64_t{b[3]} << 8;
    } else
      bytes = ReadLength();

    const std::uint64_t start = at_;
    const bool ofPixels = tag == PixelTag || type == "OB" || type == "OW";
    if (bytes == Undefined) {
      if (ofPixels)
        Fragments(end);
      else
        Items(end, explicitTypes && type != "UN", depth);
    } else {
      CheckLength(tag, bytes, end);
      if (value && bytes <= 256) {
        value->resize(bytes);
        Take(reinterpret_cast<unsigned char*>(value->data()), bytes);
      } else if (type == "SQ" || (!ofPixels && bytes >= 8 && (type.empty() || type == "UN") && ItemFollows()))
        Items(start + bytes, explicitTypes && type != "UN", depth);
      if (at_ > start + bytes)
        Fail(path_, "the items of " + TextOf(tag) + " are longer than it is: the file is damaged");
      Skip(start + bytes - at_);
    }
    if (depth == 0) {
      const Place place{start, at_ - start};
      if (tag == PixelTag) {
        pixels = place;
        encapsulated = bytes == Undefined;
      } else if (tag == 0x7FE11101)
        kretz = place;
      else if (tag == 0x7FE10011)
        kretzCreator = place;
      else if (tag == 0x7FE10010)
        movieCreator = place;
    }
    return false;
  }
  bool Element(bool explicitTypes, int depth, std::string* value) { return Element(explicitTypes, depth, value, end_); }

  bool ItemFollows()
  {
    const std::uint64_t start = at_;
    const std::uint32_t tag = ReadTag();
    Seek(start);
    return tag == ItemTag;
  }

  // The items of a sequence, up to \a end or a mark.
  void Items(std::uint64_t end, bool explicitTypes, int depth)
  {
    while (at_ < end) {
      const std::uint32_t tag = ReadTag();
      const std::uint32_t bytes = ReadLength();
      if (tag == SequenceEnd)
        return;
      if (tag != ItemTag)
        Fail(path_, "a sequence holds " + TextOf(tag) + " where an item should begin: the file is damaged");
      if (bytes != Undefined)
        CheckLength(tag, bytes, end);
      Elements(bytes == Undefined ? end : at_ + bytes, explicitTypes, depth + 1);
    }
  }

  // Compressed pixels.
  void Fragments(std::uint64_t end)
  {
    while (at_ < end) {
      const std::uint32_t tag = ReadTag();
      const std::uint32_t bytes = ReadLength();
      if (tag == SequenceEnd)
        return;
      if (tag != ItemTag)
        Fail(path_, "its compressed pixels are damaged");
      CheckLength(tag, bytes, end);
      Skip(bytes);
    }
    Fail(path_, "its compressed pixels end early: the file is truncated");
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
    Fail(path, "it cannot be read");
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
    Fail(path, "its deflated data are damaged or end early");
  return out;
}

// Pass 2: values of a gdcm data set. What is missing or of another form is empty.
std::string Text(const gdcm::DataSet& data, const Tag& tag)
{
  if (!data.FindDataElement(tag))
    return {};
  const gdcm::ByteValue* value = data.GetDataElement(tag).GetByteValue();
  if (!value || value->GetLength() > 4096 * 16)
    return {};
  return Trimmed(std::string(value->GetPointer(), value->GetLength()));
}

// Numbers written as text, separated by backslashes (DS, IS).
std::vector<double> Decimals(const gdcm::DataSet& data, const Tag& tag, std::size_t count)
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

template <class T>
std::vector<T> Binary(const gdcm::DataSet& data, const Tag& tag, std::size_t count)
{
  if (!data.FindDataElement(tag))
    return {};
  const gdcm::ByteValue* value = data.GetDataElement(tag).GetByteValue();
  if (!value || value->GetLength() != count * sizeof(T))
    return {};
  std::vector<T> numbers(count);
  std::memcpy(numbers.data(), value->GetPointer(), count * sizeof(T));
  if constexpr (std::is_floating_point_v<T>)
    if (std::any_of(numbers.begin(), numbers.end(), [](T n) { return !std::isfinite(n); }))
      return {};
  return numbers;
}

std::optional<double> Double(const gdcm::DataSet& data, const Tag& tag)
{
  const auto numbers = Binary<double>(data, tag, 1);
  return numbers.empty() ? std::nullopt : std::optional<double>(numbers[0]);
}

int Short(const gdcm::DataSet& data, const Tag& tag, int otherwise)
{
  const auto numbers = Binary<std::uint16_t>(data, tag, 1);
  return numbers.empty() ? otherwise : numbers[0];
}

gdcm::SmartPointer<gdcm::SequenceOfItems> Sequence(const gdcm::DataSet& data, const Tag& tag)
{
  return data.FindDataElement(tag) ? data.GetDataElement(tag).GetValueAsSQ() : nullptr;
}

// Calls functor with the first item of a sequence, if there is one.
template <class Functor>
bool WithItem(const gdcm::DataSet* data, const Tag& tag, const Functor& functor)
{
  if (!data)
    return false;
  const auto sequence = Sequence(*data, tag);
  if (!sequence || sequence->GetNumberOfItems() < 1)
    return false;
  functor(sequence->GetItem(1).GetNestedDataSet());
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

void SetSpacing(DicomPicture& picture, const gdcm::DataSet& data)
{
  if (const auto n = Decimals(data, {0x0028, 0x0030}, 2); !n.empty())
    picture.spacing = {n[1], n[0]}; // the file gives that of rows, then that of columns
  if (const auto n = Decimals(data, {0x0018, 0x0088}, 1); !n.empty())
    picture.sliceSpacing = n[0];
}

void SetRescale(DicomPicture& picture, const gdcm::DataSet& data)
{
  if (const auto n = Decimals(data, {0x0028, 0x1053}, 1); !n.empty())
    picture.slope = n[0];
  if (const auto n = Decimals(data, {0x0028, 0x1052}, 1); !n.empty())
    picture.intercept = n[0];
}

// The one spacing of the calibrated regions of an ultrasound picture; nothing where they disagree or are no lengths.
void SetRegionSpacing(DicomPicture& picture, const gdcm::DataSet& data)
{
  constexpr int centimetres = 3, tissue = 1;
  constexpr double mmPerCm = 10.0;
  const auto regions = Sequence(data, {0x0018, 0x6011});
  Eigen::Vector2d found = Eigen::Vector2d::Zero();
  for (std::size_t i = 1; regions && i <= regions->GetNumberOfItems(); ++i) {
    const gdcm::DataSet& region = regions->GetItem(i).GetNestedDataSet();
    if (Short(region, {0x0018, 0x6014}, tissue) != tissue || Short(region, {0x0018, 0x6024}, 0) != centimetres ||
        Short(region, {0x0018, 0x6026}, 0) != centimetres)
      continue;
    const Eigen::Vector2d spacing =
        mmPerCm * Eigen::Vector2d(Double(region, {0x0018, 0x602C}).value_or(0.0), Double(region, {0x0018, 0x602E}).value_or(0.0))
                      .cwiseAbs();
    if (!found.isZero() && !found.isApprox(spacing, 1e-6))
      return;
    found = spacing;
  }
  picture.spacing = found;
}

// What an object without functional groups says of all its pictures.
DicomPicture PlainPicture(const gdcm::DataSet& data)
{
  DicomPicture picture;
  SetPosition(picture.patient, Decimals(data, {0x0020, 0x0032}, 3));
  SetDirections(picture.patient, Decimals(data, {0x0020, 0x0037}, 6));
  SetSpacing(picture, data);
  if (picture.spacing.isZero())
    SetRegionSpacing(picture, data);
  SetRescale(picture, data);
  if (const auto n = Decimals(data, {0x0020, 0x0100}, 1); !n.empty())
    picture.timeIndex = static_cast<int>(n[0]);
  if (const auto n = Decimals(data, {0x0018, 0x1060}, 1); !n.empty() && picture.timeIndex)
    picture.time = n[0] * 1e-3;
  return picture;
}

// One functional group is in the item of the picture or, for all, in the shared one.
DicomPicture GroupedPicture(const gdcm::DataSet& shared, const gdcm::DataSet& own)
{
  DicomPicture picture;
  const auto group = [&shared, &own](const Tag& tag, const auto& functor) {
    WithItem(&own, tag, functor) || WithItem(&shared, tag, functor);
  };
  using Data = const gdcm::DataSet&;
  group({0x0020, 0x9113}, [&](Data d) { SetPosition(picture.patient, Decimals(d, {0x0020, 0x0032}, 3)); });
  group({0x0020, 0x9116}, [&](Data d) { SetDirections(picture.patient, Decimals(d, {0x0020, 0x0037}, 6)); });
  group({0x0020, 0x930E}, [&](Data d) { SetPosition(picture.volume, Binary<double>(d, {0x0020, 0x9301}, 3)); });
  group({0x0020, 0x930F}, [&](Data d) { SetDirections(picture.volume, Binary<double>(d, {0x0020, 0x9302}, 6)); });
  group({0x0028, 0x9110}, [&](Data d) { SetSpacing(picture, d); });
  group({0x0028, 0x9145}, [&](Data d) { SetRescale(picture, d); });
  group({0x0018, 0x9807}, [&](Data d) { picture.dataType = Text(d, {0x0018, 0x9808}); });
  group({0x0020, 0x9310}, [&](Data d) { picture.time = Double(d, {0x0020, 0x930D}); });
  group({0x0020, 0x9111}, [&](Data d) {
    if (const auto n = Binary<std::uint32_t>(d, {0x0020, 0x9128}, 1); !n.empty())
      picture.timeIndex = static_cast<int>(n[0] & 0x7FFFFFFF);
  });
  return picture;
}

// The element with this number that a private creator has reserved, by the creator's name.
std::string PrivateText(const gdcm::DataSet& data, std::uint16_t group, std::uint8_t element, const std::string& creator)
{
  for (std::uint16_t block = 0x10; block <= 0xFF; ++block)
    if (Text(data, {group, block}) == creator)
      return Text(data, {group, static_cast<std::uint16_t>(block << 8 | element)});
  return {};
}

class HeaderReader {
public:
  explicit HeaderReader(const std::string& path) : path_(path) { header_.path = path; }

  DicomHeader Read()
  {
    Walk();
    gdcm::Trace::WarningOff();
    gdcm::Trace::ErrorOff();
    gdcm::Trace::DebugOff();
    gdcm::Reader reader;
    std::ifstream stream(path_, std::ios::binary);
    reader.SetStream(stream);
    bool read = false;
    try {
      read = reader.ReadUpToTag({0x7FE0, 0x0010}, {});
    } catch (const std::exception&) {
    }
    if (!read)
      Fail(path_, "it cannot be parsed as DICOM");
    const gdcm::DataSet& data = reader.GetFile().GetDataSet();
    ReadImage(data);
    if (header_.kretzBytes == 0 && walked_ && pixelsSeen_) {
      ReadPictures(data);
      CheckPixels();
    }
    return header_;
  }

private:
  void Walk()
  {
    std::error_code error;
    const std::uint64_t bytes = fs::is_regular_file(path_, error) ? fs::file_size(path_, error) : 0;
    std::ifstream stream(path_, std::ios::binary);
    if (error || !stream || !fs::is_regular_file(path_, error))
      throw Error(Error::Kind::FileSystem, path_ + ": it cannot be opened (is it there, and is reading permitted?)");
    std::string start(before, '\0');
    stream.read(start.data(), static_cast<std::streamsize>(start.size()));
    if (!stream || !LooksLikeDicom(start))
      Fail(path_, "it is not DICOM: DICM is missing after its first 128 bytes");
    LengthWalk walk(stream, bytes, path_);
    walk.MetaInformation();
    const std::string& syntax = walk.transferSyntax;
    if (syntax == "1.2.840.10008.1.2.2")
      Fail(path_, "its numbers are big-endian, a retired way to write DICOM that is not supported");
    if (syntax == "1.2.840.10008.1.2.1.99") {
      // Offsets in a deflated data set are not those of the file: gdcm reads the pixels too.
      const std::string plain = Inflated(stream, walk.At(), bytes - walk.At(), path_);
      std::istringstream inflated(std::string(before, '\0') + plain);
      LengthWalk inside(inflated, before + plain.size(), path_);
      inside.MetaInformation(); // finds none, and stands behind the preamble
      inside.DataSet(true);
      inside.encapsulated = true;
      Note(inside, stream, false);
      return;
    }
    walk.DataSet(syntax != "1.2.840.10008.1.2" && !syntax.empty());
    Note(walk, stream, true);
  }

  void Note(const LengthWalk& walk, std::ifstream& stream, bool inFile)
  {
    walked_ = true;
    pixelsSeen_ = walk.pixels.bytes > 0;
    header_.encoded = walk.encapsulated;
    header_.pixelOffset = walk.pixels.offset;
    header_.pixelBytes = walk.pixels.bytes;
    const auto text = [&stream, inFile](const Place& place) {
      std::string value(std::min<std::uint64_t>(place.bytes, 64), '\0');
      stream.clear();
      stream.seekg(static_cast<std::streamoff>(place.offset));
      if (!inFile || !stream.read(value.data(), static_cast<std::streamsize>(value.size())))
        return std::string();
      return Trimmed(value);
    };
    if (text(walk.kretzCreator) == "KRETZ_US") {
      header_.kretzOffset = walk.kretz.offset;
      header_.kretzBytes = walk.kretz.bytes;
    }
    header_.holdsMovieGroup = text(walk.movieCreator) == "GEMS_Ultrasound_MovieGroup_001";
  }

  void ReadImage(const gdcm::DataSet& data)
  {
    header_.series = Text(data, {0x0020, 0x000E});
    header_.photometric = Text(data, {0x0028, 0x0004});
    header_.rows = Short(data, {0x0028, 0x0010}, 0);
    header_.columns = Short(data, {0x0028, 0x0011}, 0);
    header_.samples = Short(data, {0x0028, 0x0002}, 1);
    header_.planar = Short(data, {0x0028, 0x0006}, 0) == 1;
    header_.bitsAllocated = Short(data, {0x0028, 0x0100}, 0);
    header_.bitsStored = Short(data, {0x0028, 0x0101}, header_.bitsAllocated);
    highBit_ = Short(data, {0x0028, 0x0102}, header_.bitsStored - 1);
    header_.isSigned = Short(data, {0x0028, 0x0103}, 0) == 1;
    header_.burnedIn = Text(data, {0x0028, 0x0301}) == "YES";
    if (const auto n = Decimals(data, {0x0018, 0x1063}, 1); !n.empty())
      header_.frameTime = n[0] * 1e-3;
    if (const auto n = Binary<std::uint16_t>(data, {0x0028, 0x0009}, 2); !n.empty())
      header_.frameIncrement = n[0] == 0x0018 && (n[1] == 0x1063 || n[1] == 0x1065) ? "time"
                               : (n[0] == 0x0018 && n[1] == 0x0088) || (n[0] == 0x0020 && (n[1] == 0x1041 || n[1] == 0x0032))
                                   ? "space"
                                   : "";
    if (const auto n = Binary<double>(data, {0x0020, 0x9309}, 16); !n.empty())
      header_.volumeToTransducer = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(n.data());
    for (const auto& [key, tag] :
         {std::pair("Modality", Tag(0x0008, 0x0060)), std::pair("Manufacturer", Tag(0x0008, 0x0070)),
          std::pair("ManufacturerModelName", Tag(0x0008, 0x1090)), std::pair("TransducerType", Tag(0x0018, 0x6031))}) {
      std::string text = Text(data, tag).substr(0, 256);
      std::replace_if(
          text.begin(), text.end(), [](char c) { return c < 32 || c > 126; }, '?');
      if (!text.empty())
        header_.fields.emplace_back(key, text);
    }
  }

  void ReadPictures(const gdcm::DataSet& data)
  {
    std::size_t count = 1;
    if (const std::string text = Text(data, {0x0028, 0x0008}); !text.empty()) {
      const auto n = Decimals(data, {0x0028, 0x0008}, 1);
      if (n.empty() || !(n[0] >= 1.0 && n[0] <= static_cast<double>(mostPictures)) || n[0] != std::floor(n[0]))
        Fail(path_,
             "its number of frames is \"" + text.substr(0, 40) + "\"; it must be from 1 to " + std::to_string(mostPictures));
      count = static_cast<std::size_t>(n[0]);
    }
    if (count > header_.pixelBytes)
      Fail(path_, "it says that it holds " + std::to_string(count) + " frames, more than it has bytes for");

    const auto groups = Sequence(data, {0x5200, 0x9230});
    if (!groups) {
      const DicomPicture picture = PlainPicture(data);
      header_.pictures.assign(count, picture);
      ReadPhilips(data);
      return;
    }
    if (groups->GetNumberOfItems() != count)
      Fail(path_, "it holds " + std::to_string(count) + " frames and functional groups for " +
                      std::to_string(groups->GetNumberOfItems()));
    header_.grouped = true;
    const gdcm::DataSet nothing;
    const auto sharedItems = Sequence(data, {0x5200, 0x9229});
    const gdcm::DataSet& shared =
        sharedItems && sharedItems->GetNumberOfItems() > 0 ? sharedItems->GetItem(1).GetNestedDataSet() : nothing;
    for (std::size_t i = 1; i <= count; ++i)
      header_.pictures.push_back(GroupedPicture(shared, groups->GetItem(i).GetNestedDataSet()));
  }

  void ReadPhilips(const gdcm::DataSet& data)
  {
    // QLAB's Cartesian export: depth of the volume and its third spacing in private elements, lengths in cm.
    constexpr double mmPerCm = 10.0;
    if (const auto slices = Binary<std::uint32_t>(data, {0x3001, 0x1001}, 1); !slices.empty()) {
      const auto x = Double(data, {0x0018, 0x602C}), y = Double(data, {0x0018, 0x602E}), z = Double(data, {0x3001, 0x1003});
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
      Fail(path_, "its pictures have " + std::to_string(header_.columns) + " x " + std::to_string(header_.rows) + " pixels");
    if (header_.bitsAllocated != 8 && header_.bitsAllocated != 16 && header_.bitsAllocated != 32)
      Fail(path_, "its pixels have " + std::to_string(header_.bitsAllocated) + " bits; 8, 16 or 32 are supported");
    if (header_.bitsStored < 1 || header_.bitsStored > header_.bitsAllocated || highBit_ != header_.bitsStored - 1)
      Fail(path_, "its pixels use " + std::to_string(header_.bitsStored) + " bits up to bit " + std::to_string(highBit_) +
                      " of " + std::to_string(header_.bitsAllocated) + ", which is not supported");
    const std::string& colour = header_.photometric;
    const bool grey = colour == "MONOCHROME1" || colour == "MONOCHROME2";
    const bool coloured = colour == "RGB" || colour.compare(0, 4, "YBR_") == 0;
    if (!(grey && header_.samples == 1) && !(coloured && header_.samples == 3 && header_.bitsAllocated == 8))
      Fail(path_, "its pixels are " + std::to_string(header_.samples) + " numbers of " + std::to_string(header_.bitsAllocated) +
                      " bits that mean " + (colour.empty() ? "nothing known" : colour) + ", which is not supported");
    const double decoded = static_cast<double>(header_.PictureBytes()) * static_cast<double>(header_.pictures.size()) *
                           std::max(1, header_.volumeSlices);
    const double there = static_cast<double>(header_.pixelBytes);
    if (header_.encoded ? decoded > mostCompressed * there : decoded > there)
      Fail(path_, "its " + std::to_string(header_.pictures.size()) + " frames of " + std::to_string(header_.columns) + " x " +
                      std::to_string(header_.rows) + " pixels need " + NumberText(decoded) + " bytes, " +
                      (header_.encoded ? "more than can be compressed to the " : "and it holds ") + NumberText(there) +
                      ": it is truncated or its sizes are wrong");
  }

  std::string path_;
  DicomHeader header_;
  bool walked_ = false, pixelsSeen_ = false;
  int highBit_ = 7;
};

} // namespace

std::uint64_t DicomHeader::PictureBytes() const
{
  const std::uint64_t pixels = static_cast<std::uint64_t>(rows) * static_cast<std::uint64_t>(columns);
  if (!encoded && photometric == "YBR_FULL_422")
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

std::vector<char> DecodeDicomPixels(const DicomHeader& header)
{
  const auto fail = [&header]() {
    Fail(header.path, "its pixels cannot be decoded: they are damaged or of a kind that is not supported");
  };
  std::vector<char> pixels;
  try {
    gdcm::ImageReader reader;
    reader.SetFileName(header.path.c_str());
    if (!reader.Read())
      fail();
    const gdcm::Image& image = reader.GetImage();
    const std::uint64_t wanted = header.PictureBytes() * header.pictures.size();
    if (image.GetBufferLength() != wanted)
      fail();
    pixels.resize(wanted);
    if (!image.GetBuffer(pixels.data()))
      fail();
  } catch (const Error&) {
    throw;
  } catch (const std::exception&) {
    fail();
  }
  return pixels;
}

} // namespace echorama
