// SPDX-License-Identifier: BSD-3-Clause
// Format: https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html. An array's data follow its element as text or
// as base64, or lie behind AppendedData, as base64 or as they are. Binary data begin with a length, or, compressed, with the
// number of their blocks, the bytes of a block and of the last one, and the compressed bytes of each.
// Only the elements and those lengths are read here. What lies between them is skipped: it is most of the file.
#include "Readers/VtkXmlFile.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Words.h"
#include "Readers/ByteOrder.h"
#include "Readers/DataFile.h"
#include "Readers/HeaderLines.h"
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <tuple>

namespace echorama {
namespace {

constexpr std::size_t LongestElement = 1 << 20;
constexpr std::uint64_t LargestRatio = 10000; // of what compressed data can become
constexpr std::string_view AppendedMark = "<AppendedData";
constexpr std::string_view Base64Digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

struct XmlElement {
  std::string name; // "/name" at its end
  std::map<std::string, std::string> attributes;
  bool isWhole = false; // <name/>

  const std::string* Find(const std::string& key) const
  {
    const auto found = attributes.find(key);
    return found == attributes.end() ? nullptr : &found->second;
  }
};

class VtkXmlCheck {
public:
  VtkXmlCheck(const std::string& path, const std::string& type)
    : type_(type), lines_(path), stream_(path, std::ios::binary), bytes_(std::filesystem::file_size(path))
  {
  }

  std::vector<std::string> Run()
  {
    std::vector<std::string> notes;
    bool found = false, isOpen = false;
    int depth = 0;
    for (std::optional<XmlElement> element = Next(); element; element = Next()) {
      const std::string& name = element->name;
      if ((name == "VTKFile") == isOpen)
        lines_.Fail("it cannot be read as a VTK file: it does not begin with a VTKFile element, or has two");
      isOpen = true;
      depth += element->isWhole ? 0 : name[0] == '/' ? -1 : 1;
      if (depth > 100) // VTK would end
        lines_.Fail("it cannot be read as a VTK file: its elements are nested too deeply");
      if (name == "VTKFile")
        File(*element);
      else if (name.compare(0, AppendedMark.size() - 1, AppendedMark.substr(1)) == 0) {
        if (name.size() >= AppendedMark.size())
          FailAtMark();
        Appended(*element);
        break; // what follows is no XML
      } else if (name == type_) {
        if (found)
          lines_.Fail("it has two " + type_ + " elements");
        found = true;
        if (type_ == "ImageData")
          notes = Geometry(*element);
      } else if (name == "Piece") {
        if (isInPiece_)
          lines_.Fail("it has a piece within a piece");
        isInPiece_ = !element->isWhole;
        Piece(*element);
      } else if (name == "/Piece")
        isInPiece_ = false;
      else if (name == "vtkQuadratureSchemeDefinition") // of an InformationKey; VTK believes all that it says
        lines_.Fail("it cannot be read as a VTK file: it defines a " + name);
      else if (element->Find("type") || element->Find("Name") || element->Find("NumberOfTuples"))
        Array(*element); // VTK reads arrays of any name
      else if (name == "/VTKFile")
        break; // what follows is not of it
    }
    if (!found || !hasPiece_)
      lines_.Fail("it is no VTK file of this kind: it has no " + type_ + " element, or no piece of it");
    if (!later_.empty() && !appended_)
      lines_.Fail("its data are said to be appended, and there are none");
    const double tuple = std::max(tupleBytes_, type_ == "PolyData" ? 24.0 : 1.0);   // a point, a voxel
    if (fieldBytes_ + tuple * tuples_ > static_cast<double>(LargestRatio * bytes_)) // VTK asks for them before it reads
      lines_.Fail("its arrays need more memory than the file justifies");
    return notes;
  }

private:
  std::uint64_t Position() { return static_cast<std::uint64_t>(stream_.tellg()); }

  // The next element, or nothing at the end of the file. Comments and declarations are passed over.
  std::optional<XmlElement> Next()
  {
    while (stream_.ignore(std::numeric_limits<std::streamsize>::max(), '<') && !stream_.eof()) {
      std::string text;
      char quote = 0; // what the next > must wait for; an instruction, <? ?>, has none
      for (int c = stream_.get(); c != '>' || quote != 0 || (text[0] == '?' && (text.size() < 2 || text.back() != '?'));
           c = stream_.get()) {
        if (c == std::char_traits<char>::eof() || text.size() > LongestElement)
          lines_.Fail("it cannot be read as a VTK file: an element has no end");
        text.push_back(static_cast<char>(c));
        if (text == "!--") {
          SkipComment();
          text.clear();
          break;
        }
        if (text[0] != '?' && (c == quote || (quote == 0 && (c == '"' || c == '\''))))
          quote = quote == 0 ? static_cast<char>(c) : '\0';
      }
      if (text.find(AppendedMark) != std::string::npos)
        FailAtMark();
      if (text.empty() || text[0] == '?')
        continue;
      if (text[0] == '!')
        lines_.Fail("it cannot be read as a VTK file: it holds a declaration <" + text.substr(0, 40) + ">");
      return Parsed(text);
    }
    return std::nullopt;
  }

  void SkipComment()
  {
    std::string part; // up to a >
    do {
      if (!std::getline(stream_, part, '>') || stream_.eof())
        lines_.Fail("it cannot be read as a VTK file: a comment has no end");
      if (part.find(AppendedMark) != std::string::npos)
        FailAtMark();
    } while (part.size() < 2 || part.compare(part.size() - 2, 2, "--") != 0);
  }

  // VTK looks for the mark in the bytes, whatever it is part of.
  [[noreturn]] void FailAtMark() const
  {
    lines_.Fail("it cannot be read as a VTK file: it names appended data within a comment or another element");
  }

  // name key="value" key='value' /
  XmlElement Parsed(std::string_view text) const
  {
    constexpr const char* blanks = " \t\r\n";
    XmlElement element;
    std::size_t at = std::min(text.find_first_of(blanks, 1), text.size());
    element.name = text.substr(0, at);
    element.isWhole = text.back() == '/';
    if (element.name.back() == '/' && element.name.size() > 1) // <name/>
      element.name.pop_back();
    for (at = text.find_first_not_of(blanks, at); at < text.size(); at = text.find_first_not_of(blanks, at)) {
      if (text[at] == '/')
        break;
      const std::size_t equals = text.find('=', at);
      const std::size_t open = equals == std::string_view::npos ? equals : text.find_first_not_of(blanks, equals + 1);
      const std::size_t close = open == std::string_view::npos || (text[open] != '"' && text[open] != '\'')
                                    ? std::string_view::npos
                                    : text.find(text[open], open + 1);
      if (close == std::string_view::npos)
        lines_.Fail("it cannot be read as a VTK file: the attributes of " + element.name + " are damaged");
      const std::string key(text.substr(at, std::min(equals, text.find_first_of(" \t\r\n=", at)) - at));
      if (!element.attributes.emplace(key, text.substr(open + 1, close - open - 1)).second)
        lines_.Fail(element.name + " says " + key + " twice");
      at = close + 1;
    }
    return element;
  }

  void Need(const XmlElement& element, const std::string& key, std::initializer_list<const char*> words, bool mayBeMissing) const
  {
    const std::string* value = element.Find(key);
    if (value ? std::find(words.begin(), words.end(), *value) == words.end() : !mayBeMissing)
      lines_.Fail(element.name + (value ? " has the " + key + " \"" + *value + "\", which is not known" : " has no " + key));
  }

  // A whole number from least to most, or \a missing.
  std::int64_t Number(const XmlElement& element, const std::string& key, std::int64_t least, std::int64_t most,
                      std::int64_t missing) const
  {
    const std::string* value = element.Find(key);
    const std::int64_t number = value ? lines_.Numbers<std::int64_t>(key, *value, 1)[0] : missing;
    if (number < least || number > most)
      lines_.Fail(key + " of " + element.name + " is " + std::to_string(number) + ", which cannot be");
    return number;
  }

  std::vector<int> Extent(const XmlElement& element, const std::string& key) const
  {
    const std::string* text = element.Find(key);
    if (!text)
      lines_.Fail("it cannot be read as a VTK file: " + element.name + " has no " + key);
    const std::vector<int> extent = lines_.Numbers<int>(key, *text, 6);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t size = std::int64_t{extent[2 * axis + 1]} - extent[2 * axis] + 1;
      if (size < 1 || size > std::numeric_limits<int>::max())
        lines_.Fail("its " + key + " is empty or overflows");
    }
    return extent;
  }

  void File(const XmlElement& element)
  {
    Need(element, "type", {type_.c_str()}, false);
    Need(element, "byte_order", {"LittleEndian", "BigEndian"}, true);
    Need(element, "header_type", {"UInt32", "UInt64"}, true);
    const std::string* order = element.Find("byte_order");
    const std::string* header = element.Find("header_type");
    isBigEndian_ = order ? *order == "BigEndian" : HostIsBigEndian;
    wordBytes_ = header && *header == "UInt64" ? 8 : 4;
    compressed_ = element.Find("compressor") && !element.Find("compressor")->empty();
    if (compressed_)
      Need(element, "compressor", {"vtkZLibDataCompressor", "vtkLZ4DataCompressor", "vtkLZMADataCompressor"}, false);
  }

  std::vector<std::string> Geometry(const XmlElement& element)
  {
    whole_ = Extent(element, "WholeExtent");
    tuples_ = 1.0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      tuples_ *= 1.0 + whole_[2 * axis + 1] - whole_[2 * axis];
    std::vector<std::string> notes;
    for (const auto& [name, count, missing] :
         {std::tuple("Origin", 3, "the file has no origin: 0 0 0 was assumed"),
          {"Spacing", 3, "the file has no spacing: 1 mm was assumed"},
          {"Direction", 9, "the file has no direction: its axes were taken as those of the world"}})
      if (const std::string* value = element.Find(name))
        lines_.Numbers<double>(name, *value, count);
      else
        notes.push_back(missing);
    return notes;
  }

  void Piece(const XmlElement& element)
  {
    hasPiece_ = true;
    tupleBytesHere_ = 0.0;
    if (type_ == "PolyData") {
      for (const char* count : {"NumberOfPoints", "NumberOfVerts", "NumberOfLines", "NumberOfStrips", "NumberOfPolys"})
        tuples_ += static_cast<double>(Number(element, count, 0, static_cast<std::int64_t>(LargestRatio * bytes_), 0));
      return;
    }
    if (whole_.empty())
      lines_.Fail("it cannot be read as a VTK file: a piece lies in no image");
    const std::vector<int> piece = Extent(element, "Extent");
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (piece[2 * axis] < whole_[2 * axis] || piece[2 * axis + 1] > whole_[2 * axis + 1])
        lines_.Fail("the Extent of a piece lies beyond the WholeExtent");
  }

  void Array(const XmlElement& element)
  {
    Need(element, "type",
         {"Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64", "Float32", "Float64", "String"}, false);
    Need(element, "format", {"ascii", "binary", "appended"}, true);
    const std::string& type = *element.Find("type");
    if (type == "String" && isInPiece_ && type_ == "ImageData") // VTK ends where there are fewer than voxels
      lines_.Fail("its voxels have texts, which are not read");
    const std::size_t digits = type.find_first_of("1368");
    const int bits = digits == std::string::npos ? 256 : std::stoi(type.substr(digits)); // a string has some
    const double bytes = bits / 8.0 * static_cast<double>(Number(element, "NumberOfComponents", 1, 1000000, 1));
    tupleBytesHere_ += hasPiece_ ? bytes : 0.0; // else of the field
    tupleBytes_ = std::max(tupleBytes_, tupleBytesHere_);
    fieldBytes_ += bytes * static_cast<double>(Number(element, "NumberOfTuples", 0, std::int64_t{1} << 40, 0));
    const std::string* format = element.Find("format");
    if (element.Find("offset")) { // VTK looks there whatever the format
      later_.insert(static_cast<std::uint64_t>(Number(element, "offset", 0, static_cast<std::int64_t>(bytes_), 0)));
      return;
    }
    if (format && *format == "appended")
      lines_.Fail(element.name + " has no offset of its appended data");
    for (const auto& [key, value] : element.attributes)
      if (value.find('>') != std::string::npos) // XML allows it
        lines_.Fail("the " + key + " of a " + element.name + " has a >, behind which VTK would look for the data");
    if (format && *format == "binary") {
      const std::uint64_t begin = Position();
      stream_.ignore(std::numeric_limits<std::streamsize>::max(), '<');
      const std::uint64_t end = stream_.eof() ? bytes_ : Position() - 1;
      Lengths(begin, end, false);
      stream_.clear();
      stream_.seekg(static_cast<std::streamoff>(end));
    }
  }

  void Appended(const XmlElement& element)
  {
    appended_ = true;
    Need(element, "encoding", {"raw", "base64"}, true);
    const std::string* encoding = element.Find("encoding");
    if (char mark = 0; !(stream_ >> mark) || mark != '_') // behind blanks; VTK takes whatever is there for it
      lines_.Fail("it cannot be read as a VTK file: its appended data have no beginning");
    const std::uint64_t begin = Position();
    for (const std::uint64_t offset : later_)
      Lengths(begin + offset, bytes_, encoding && *encoding == "raw");
  }

  // The lengths in front of an array's data, which lie within [begin, end) of the file.
  void Lengths(std::uint64_t begin, std::uint64_t end, bool isRaw)
  {
    const std::uint64_t room = end - std::min(begin, end);
    const auto fail = [this] { lines_.Fail("the data are truncated or damaged (a length in them is not possible)"); };
    if (!compressed_) {
      if (Words(begin, end, 1, isRaw)[0] > room)
        fail();
      return;
    }
    const std::vector<std::uint64_t> first = Words(begin, end, 3, isRaw);
    const std::uint64_t blocks = first[0], block = first[1], last = first[2];
    if (blocks > room / wordBytes_ || (blocks > 0 && block == 0) || last > block ||
        (blocks > (last > 0 ? 1 : 0) ? block : last) > LargestRatio * bytes_)
      fail();
    std::uint64_t sum = 0;
    const std::vector<std::uint64_t> all = Words(begin, end, 3 + blocks, isRaw);
    for (std::size_t i = 3; i < all.size(); ++i) {
      if (all[i] > room - std::min(sum, room))
        fail();
      sum += all[i];
    }
  }

  std::vector<std::uint64_t> Words(std::uint64_t begin, std::uint64_t end, std::size_t count, bool isRaw)
  {
    const std::size_t wanted = count * wordBytes_;
    std::string bytes;
    stream_.clear();
    stream_.seekg(static_cast<std::streamoff>(begin));
    if (isRaw) {
      bytes.resize(std::min<std::uint64_t>(wanted, end - std::min(begin, end)));
      bytes.resize(ReadPieces(stream_, bytes.data(), bytes.size()));
    } else {
      std::uint32_t bits = 0;
      int held = 0;
      for (std::uint64_t at = begin; at < end && bytes.size() < wanted; ++at) {
        const int c = stream_.get();
        if (c == ' ' || c == '\n' || c == '\r' || c == '\t')
          continue;
        const std::size_t value = Base64Digits.find(static_cast<char>(c));
        if (value == std::string_view::npos)
          break;
        bits = bits << 6 | static_cast<std::uint32_t>(value);
        held += 6;
        if (held >= 8) {
          held -= 8;
          bytes.push_back(static_cast<char>(bits >> held & 0xFF));
        }
      }
    }
    if (bytes.size() != wanted)
      lines_.Fail("the data are truncated or damaged (they end early)");
    std::vector<std::uint64_t> words(count);
    for (std::size_t i = 0; i < wanted; ++i) {
      const std::size_t place = isBigEndian_ ? wordBytes_ - 1 - i % wordBytes_ : i % wordBytes_;
      words[i / wordBytes_] |= std::uint64_t{static_cast<unsigned char>(bytes[i])} << 8 * place;
    }
    return words;
  }

  const std::string type_;
  HeaderLines lines_; // says what is wrong
  std::ifstream stream_;
  std::uint64_t bytes_;
  bool isBigEndian_ = false, compressed_ = false, appended_ = false, hasPiece_ = false, isInPiece_ = false;
  std::size_t wordBytes_ = 4;
  std::vector<int> whole_;                         // extent
  double tuples_ = 0.0;                            // voxels, or points and cells of all pieces
  double tupleBytes_ = 0.0, tupleBytesHere_ = 0.0; // of all arrays, for a voxel: of the piece with most of them, of this one
  double fieldBytes_ = 0.0;                        // of what says its number of tuples, as arrays of no piece do
  std::set<std::uint64_t> later_;                  // offsets of appended arrays
};

} // namespace

std::vector<std::string> CheckVtkXmlFile(const std::string& path, const std::string& type)
{
  return VtkXmlCheck(path, type).Run();
}

} // namespace echorama
