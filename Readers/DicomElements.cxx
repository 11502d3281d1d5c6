// SPDX-License-Identifier: BSD-3-Clause
// The elements are parsed here and not by gdcm, which allocates what a length promises before it reads, and whose assertions
// end the program on damaged files. One walk over the heads of all elements compares each length with what is left of the
// file, keeps the values of the few tags that we know how to use, and notes where the pixels are.
#include "Readers/DicomElements.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/NumberText.h"
#include "Readers/DataFile.h"
#include <algorithm>
#include <sstream>
#include <zlib.h>

namespace echorama {
namespace {

constexpr std::uint32_t Undefined = 0xFFFFFFFF;
constexpr DicomTag ItemTag = 0xFFFEE000, ItemEnd = 0xFFFEE00D, SequenceEnd = 0xFFFEE0DD, PixelTag = 0x7FE00010;
constexpr int deepest = 16; // sequences in sequences
constexpr std::uint64_t longestValue = 65536;
constexpr std::uint64_t mostInflated = 1032; // bytes of one that is deflated
constexpr const char* damagedDeflation = "its deflated data are damaged or end early";

constexpr const char* ImplicitLittleEndian = "1.2.840.10008.1.2";
constexpr const char* Deflated = "1.2.840.10008.1.2.1.99";
constexpr const char* BigEndian = "1.2.840.10008.1.2.2";

// The sequences and the values that are kept.
constexpr DicomTag Sequences[] = {DicomSharedGroups, DicomPictureGroups, DicomRegions, 0x0020930E, 0x0020930F, 0x00209310,
                                  0x00209111,        0x00209113,         0x00209116,   0x00289110, 0x00289145, 0x00189807};
constexpr DicomTag Values[] = {0x00080060, 0x00080070, 0x00081090, 0x00180088, 0x00181060, 0x00181063, 0x00186014,
                               0x00186024, 0x00186026, 0x0018602C, 0x0018602E, 0x00186031, 0x00189808, 0x0020000E,
                               0x00200032, 0x00200037, 0x00200100, 0x00209128, 0x00209301, 0x00209302, 0x00209309,
                               0x0020930D, 0x00280002, 0x00280004, 0x00280006, 0x00280008, 0x00280009, 0x00280010,
                               0x00280011, 0x00280030, 0x00280100, 0x00280101, 0x00280102, 0x00280103, 0x00280301,
                               0x00281052, 0x00281053, 0x30011001, 0x30011003, 0x7FE10010, 0x7FE10011};

bool IsKeptSequence(DicomTag tag)
{
  return std::find(std::begin(Sequences), std::end(Sequences), tag) != std::end(Sequences);
}

bool IsKeptValue(DicomTag tag)
{
  // Philips' group has its creators in elements below 0x100 and the spacing in number 3 of the block of one of them.
  return std::binary_search(std::begin(Values), std::end(Values), tag) ||
         (tag >> 16 == 0x200D && ((tag & 0xFFFF) < 0x100 || (tag & 0xFF) == 0x03));
}

std::string Trimmed(std::string text)
{
  const auto blank = [](char c) { return c == ' ' || c == '\0'; };
  while (!text.empty() && blank(text.back()))
    text.pop_back();
  text.erase(text.begin(), std::find_if_not(text.begin(), text.end(), blank));
  return text;
}

class Parser {
public:
  Parser(std::istream& stream, std::uint64_t end, const std::string& path) : stream_(stream), end_(end), path_(path) {}

  // The elements of group 2, which say how the others are written. \returns the transfer syntax
  std::string MetaInformation()
  {
    Seek(DicomPreamble);
    std::string syntax;
    while (end_ - at_ >= 8) {
      const std::uint64_t start = at_;
      const DicomTag tag = ReadTag();
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

  DicomData Outermost(bool explicitTypes)
  {
    DicomData data;
    Elements(&data, explicitTypes, end_, 0);
    return data;
  }

  std::uint64_t At() const { return at_; }

  DicomPlace pixels, kretz;
  bool encapsulated = false;
  bool inflating = false; // then the end is where the data end at the latest, and what follows the pixels is not looked at

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

  DicomTag ReadTag()
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

  void CheckLength(DicomTag tag, std::uint64_t bytes, std::uint64_t end) const
  {
    if (at_ > end || bytes > end - at_)
      FailFile(path_, "the element " + Format("(%04X,%04X)", tag >> 16, tag & 0xFFFF) + " says that it is " +
                          std::to_string(bytes) + " bytes long, and only " + std::to_string(at_ > end ? 0 : end - at_) +
                          " follow: the file is truncated or damaged");
  }

  // Elements up to \a end or a mark of the end of an item. \a data may be null: then they are only walked over.
  void Elements(DicomData* data, bool explicitTypes, std::uint64_t end, int depth)
  {
    if (depth > deepest)
      FailFile(path_, "its sequences are nested more than " + std::to_string(deepest) + " deep");
    while (at_ < end) {
      if (depth == 0 && (pixels.bytes > 0 ? inflating || end - at_ < 8 : inflating && stream_.peek() == EOF))
        return; // what follows is padding, if anything
      if (Element(data, explicitTypes, end, depth, nullptr))
        return;
    }
  }

  // \returns whether it was the mark of an end
  bool Element(DicomData* data, bool explicitTypes, std::uint64_t end, int depth, std::string* asked)
  {
    const DicomTag tag = ReadTag();
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
        FailFile(path_, "the element " + Format("(%04X,%04X)", tag >> 16, tag & 0xFFFF) + " has no type: the file is damaged");
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
      std::vector<DicomData>* items = data && IsKeptSequence(tag) ? &data->sequences[tag] : nullptr;
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
  void Items(std::vector<DicomData>* items, bool explicitTypes, std::uint64_t end, int depth)
  {
    while (at_ < end) {
      const DicomTag tag = ReadTag();
      const std::uint32_t bytes = ReadLength();
      if (tag == SequenceEnd)
        return;
      if (tag != ItemTag)
        FailFile(path_, "a sequence holds " + Format("(%04X,%04X)", tag >> 16, tag & 0xFFFF) +
                            " where an item should begin: the file is damaged");
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
      const DicomTag tag = ReadTag();
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

// The deflated data set (without zlib's head) from where \a packed stands, to be read forwards. A small file may inflate to a
// thousand times as much, so nothing is kept, and what is skipped at the end, such as pixels, is not even inflated.
class InflatingBuffer : public std::streambuf {
public:
  explicit InflatingBuffer(std::istream& packed) : packed_(packed) { inflateInit2(&z_, -MAX_WBITS); }
  ~InflatingBuffer() override { inflateEnd(&z_); }

  // Or it has come to its end before what was last sought.
  bool IsDamaged() const { return status_ != Z_OK && (status_ != Z_STREAM_END || skipped_ > 0); }

protected:
  int_type underflow() override
  {
    const std::uint64_t wanted = At();
    while (End() <= wanted && status_ == Z_OK) {
      begin_ = End();
      z_.next_out = reinterpret_cast<Bytef*>(plain_);
      z_.avail_out = sizeof plain_;
      while (z_.avail_out > 0 && status_ == Z_OK) {
        if (z_.avail_in == 0) {
          packed_.read(read_, sizeof read_);
          z_.next_in = reinterpret_cast<Bytef*>(read_);
          z_.avail_in = static_cast<uInt>(packed_.gcount());
        }
        status_ = inflate(&z_, Z_NO_FLUSH); // without input: Z_BUF_ERROR
      }
      count_ = sizeof plain_ - z_.avail_out;
    }
    Place(wanted);
    return gptr() < egptr() ? traits_type::to_int_type(*gptr()) : traits_type::eof();
  }

  pos_type seekpos(pos_type position, std::ios_base::openmode) override
  {
    const auto wanted = static_cast<std::uint64_t>(std::streamoff(position));
    if (wanted < begin_)
      return pos_type(off_type(-1));
    Place(wanted);
    return position;
  }

private:
  void Place(std::uint64_t at) // not before begin_
  {
    skipped_ = at > End() ? at - End() : 0;
    setg(plain_, plain_ + (at - skipped_ - begin_), plain_ + count_);
  }

  std::uint64_t At() const { return begin_ + static_cast<std::uint64_t>(gptr() - eback()) + skipped_; }
  std::uint64_t End() const { return begin_ + count_; }

  std::istream& packed_;
  z_stream z_{};
  int status_ = Z_OK;
  std::uint64_t begin_ = 0, count_ = 0, skipped_ = 0; // of what is in plain_; what a seek has yet to leave out
  char read_[1 << 14], plain_[1 << 16];
};

} // namespace

std::string DicomData::Text(DicomTag tag) const
{
  const auto found = values.find(tag);
  return found == values.end() ? std::string() : Trimmed(found->second);
}

std::vector<double> DicomData::Decimals(DicomTag tag, std::size_t count) const
{
  std::vector<double> numbers;
  std::istringstream parts(Text(tag));
  for (std::string part; std::getline(parts, part, '\\');) {
    double number = 0.0;
    if (!ParseNumber(Trimmed(part), number) || !std::isfinite(number))
      return {};
    numbers.push_back(number);
  }
  return numbers.size() == count ? numbers : std::vector<double>();
}

std::optional<double> DicomData::Decimal(DicomTag tag) const
{
  const auto numbers = Decimals(tag, 1);
  return numbers.empty() ? std::nullopt : std::optional<double>(numbers[0]);
}

std::vector<double> DicomData::PrivateDecimals(std::uint32_t group, std::uint32_t element, const std::string& creator,
                                               std::size_t count) const
{
  for (std::uint32_t block = 0x10; block <= 0xFF; ++block)
    if (Text(group << 16 | block) == creator)
      return Decimals(group << 16 | block << 8 | element, count);
  return {};
}

std::optional<double> DicomData::Double(DicomTag tag) const
{
  const auto numbers = Binary<double>(tag, 1);
  return numbers.empty() ? std::nullopt : std::optional<double>(numbers[0]);
}

int DicomData::Short(DicomTag tag, int otherwise) const
{
  const auto numbers = Binary<std::uint16_t>(tag, 1);
  return numbers.empty() ? otherwise : numbers[0];
}

const std::vector<DicomData>* DicomData::Sequence(DicomTag tag) const
{
  const auto found = sequences.find(tag);
  return found == sequences.end() ? nullptr : &found->second;
}

DicomElements ReadDicomElements(std::istream& stream, std::uint64_t bytes, const std::string& path)
{
  Parser parser(stream, bytes, path);
  DicomElements elements;
  elements.transferSyntax = parser.MetaInformation();
  if (elements.transferSyntax.empty())
    FailFile(path, "its transfer syntax is missing");
  if (elements.transferSyntax == BigEndian)
    FailFile(path, "its numbers are big-endian, a retired way to write DICOM that is not supported");
  const auto take = [&elements](Parser& from, bool explicitTypes) {
    elements.data = from.Outermost(explicitTypes);
    elements.pixels = from.pixels;
    elements.kretz = from.kretz;
    elements.encapsulated = from.encapsulated;
  };
  elements.deflated = elements.transferSyntax == Deflated;
  if (elements.deflated) {
    InflatingBuffer buffer(stream);
    std::istream inflated(&buffer);
    Parser inside(inflated, mostInflated * (bytes - parser.At()), path);
    inside.inflating = true;
    take(inside, true);
    if (buffer.IsDamaged())
      FailFile(path, damagedDeflation);
  } else
    take(parser, elements.transferSyntax != ImplicitLittleEndian);
  return elements;
}

void ReadInflatedDicom(const std::string& path, std::uint64_t offset, char* out, std::uint64_t bytes)
{
  std::ifstream stream = OpenToRead(path);
  Parser(stream, FileSize(path), path).MetaInformation();
  InflatingBuffer buffer(stream);
  std::istream inflated(&buffer);
  inflated.seekg(static_cast<std::streamoff>(offset));
  if (!inflated.read(out, static_cast<std::streamsize>(bytes)))
    FailFile(path, damagedDeflation);
}

} // namespace echorama
