// SPDX-License-Identifier: BSD-3-Clause
// NRRD: "field: value" lines that a blank line ends, and free "key:=value" lines. Positions are given per axis: a vector
// (direction times spacing) in a named space, or only a spacing. Axes without a vector ("none") do not lie in space: they
// are channels or time. Field names may be written with or without blanks, so blanks are dropped before comparing.
#include "Core/Base/Error.h"
#include "Core/Base/Words.h"
#include "Readers/DataFile.h"
#include "Readers/HeaderLines.h"
#include "Readers/ImageHeader.h"
#include <algorithm>
#include <cctype>
#include <fstream>
#include <limits>
#include <map>
#include <optional>

namespace echorama {
namespace {

// All names of each type, blanks dropped; the first is the one that we write.
const std::vector<std::pair<VoxelType, std::string>> NrrdTypeNames = {
    {VoxelType::Int8, "int8 int8_t signedchar"},
    {VoxelType::UInt8, "uint8 uint8_t uchar unsignedchar"},
    {VoxelType::Int16, "int16 int16_t short shortint signedshort signedshortint"},
    {VoxelType::UInt16, "uint16 uint16_t ushort unsignedshort unsignedshortint"},
    {VoxelType::Int32, "int32 int32_t int signedint"},
    {VoxelType::UInt32, "uint32 uint32_t uint unsignedint"},
    {VoxelType::Int64, "int64 int64_t longlong longlongint signedlonglong signedlonglongint"},
    {VoxelType::UInt64, "uint64 uint64_t ulonglong unsignedlonglong unsignedlonglongint"},
    {VoxelType::Float32, "float"},
    {VoxelType::Float64, "double"}};

std::optional<VoxelType> TypeNamed(const std::string& name)
{
  for (const auto& [type, names] : NrrdTypeNames)
    for (const std::string_view word : SplitWords(names))
      if (word == name)
        return type;
  return {};
}

// Lower case, without blanks.
std::string Plain(std::string_view text)
{
  std::string plain;
  for (const unsigned char c : text)
    if (!std::isspace(c))
      plain.push_back(static_cast<char>(std::tolower(c)));
  return plain;
}

// The strings of a list such as "mm" "mm" "mm".
std::vector<std::string> Quoted(const std::string& text)
{
  std::vector<std::string> strings;
  for (std::size_t open = text.find('"'); open != std::string::npos; open = text.find('"', open)) {
    const std::size_t close = std::min(text.find('"', open + 1), text.size());
    strings.push_back(text.substr(open + 1, close - open - 1));
    open = std::min(close + 1, text.size());
  }
  return strings;
}

std::string Unescaped(std::string_view text)
{
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\\' && i + 1 < text.size() && (text[i + 1] == 'n' || text[i + 1] == '\\'))
      plain.push_back(text[++i] == 'n' ? '\n' : '\\');
    else
      plain.push_back(text[i]);
  }
  return plain;
}

class Nrrd {
public:
  Nrrd(ImageHeader& header, FrameAxis* sequence) : header_(header), lines_(header.path), sequence_(sequence) {}

  void Parse()
  {
    ReadLines();
    ParseAxes();
    ParseType();
    ParseData();
    if (sequence_)
      sequence_->headerBytes = lines_.Position();
  }

private:
  using Vector = std::optional<Eigen::Vector3d>; // nothing: "none"

  const std::string* Find(const std::string& field) const
  {
    const auto found = fields_.find(field);
    return found == fields_.end() ? nullptr : &found->second;
  }
  const std::string& Need(const std::string& field) const
  {
    const std::string* value = Find(field);
    if (!value)
      lines_.Fail("the header has no \"" + field + "\"");
    return *value;
  }

  void ReadLines()
  {
    std::string line;
    if (!lines_.Next(line) || line.size() != 8 || line.compare(0, 7, "NRRD000") != 0 || line[7] < '1' || line[7] > '5')
      lines_.FailHere("the magic word is \"" + line.substr(0, 20) + "\"; NRRD0001 to NRRD0005 are known");
    while (lines_.Next(line) && !line.empty()) {
      if (line[0] == '#')
        continue;
      const std::size_t assigns = line.find(":="); // keys may hold colons: DICOM:Modality:=US
      const bool isKey = assigns < line.find(": ");
      const std::size_t colon = isKey ? assigns : line.find(':');
      if (colon == std::string::npos)
        lines_.FailHere("\"field: value\" or \"key:=value\" is needed");
      const std::string_view before = std::string_view(line).substr(0, colon),
                             after = std::string_view(line).substr(colon + (isKey ? 2 : 1));
      if (isKey) {
        if (sequence_ && TakeFrameField(lines_, *sequence_, TrimBlanks(before), Unescaped(TrimBlanks(after))))
          continue;
        header_.fields.emplace_back(Unescaped(TrimBlanks(before)), Unescaped(after));
      } else if (const auto [place, fresh] = fields_.emplace(Plain(before), TrimBlanks(after)); !fresh)
        lines_.FailHere("\"" + place->first + "\" is given twice");
    }
  }

  // "(1,0,0) (0,1,0) none" and the like; 2 numbers are a vector in a plane.
  std::vector<Vector> Vectors(const char* field, const std::string& text) const
  {
    std::vector<Vector> vectors;
    for (std::size_t at = text.find_first_not_of(" \t"); at != std::string::npos;) {
      std::size_t end;
      if (text[at] == '(') {
        end = text.find(')', at);
        if (end == std::string::npos)
          lines_.Fail(std::string(field) + " has an open bracket");
        std::string inside = text.substr(at + 1, end - at - 1);
        const std::size_t count = 1 + static_cast<std::size_t>(std::count(inside.begin(), inside.end(), ','));
        std::replace(inside.begin(), inside.end(), ',', ' ');
        if (count != 2 && count != 3)
          lines_.Fail(std::string(field) + " holds a vector of " + std::to_string(count) + " numbers");
        const auto numbers = lines_.Numbers<double>(field, inside, count);
        vectors.emplace_back(Eigen::Vector3d(numbers[0], numbers[1], count == 3 ? numbers[2] : 0.0));
        ++end;
      } else {
        end = std::min(text.find_first_of(" \t", at), text.size());
        if (text.compare(at, end - at, "none") != 0)
          lines_.Fail(std::string(field) + " holds \"" + text.substr(at, end - at) + "\"; a vector or none is needed");
        vectors.emplace_back();
      }
      at = text.find_first_not_of(" \t", end);
    }
    return vectors;
  }

  // +1 or -1 per component: from the space of the file to LPS.
  Eigen::Vector3d ToLps()
  {
    const std::string* name = Find("space");
    const std::string space = name ? Plain(*name) : "";
    if (space == "left-posterior-superior" || space == "lps")
      return {1, 1, 1};
    if (space == "right-anterior-superior" || space == "ras")
      return {-1, -1, 1};
    if (space == "left-anterior-superior" || space == "las")
      return {1, -1, 1};
    if (name && (space.find("time") != std::string::npos || space == "last" || space == "rast" || space == "lpst"))
      lines_.Fail("its space has a time axis; one volume is needed");
    header_.notes.push_back("the file does not name an anatomical space" + (name ? " (" + *name + ")" : std::string()) +
                            ": its axes were taken as left, posterior, superior");
    return {1, 1, 1};
  }

  // The axis along which a sequence has its frames; beyond the last when it is none.
  std::size_t FindFrames(const std::vector<int>& sizes)
  {
    const std::string* kinds = Find("kinds");
    const auto words = kinds ? SplitWords(*kinds) : std::vector<std::string_view>();
    const auto found = std::find_if(words.begin(), words.end(), [](auto kind) { return kind == "list" || kind == "time"; });
    const std::size_t axis = static_cast<std::size_t>(found - words.begin());
    if (!sequence_) {
      if (std::any_of(header_.fields.begin(), header_.fields.end(), [](const auto& f) { return IsFrameField(f.first); }))
        lines_.Fail(NotAVolume);
      return sizes.size();
    }
    if (found == words.end())
      return sizes.size();
    if (words.size() != sizes.size() || (axis != 0 && axis + 1 != sizes.size()))
      lines_.Fail("kinds is \"" + *kinds + "\"; the frames must be along the first or the last of " +
                  std::to_string(sizes.size()) + " axes");
    sequence_->frames = sizes[axis];
    sequence_->fastest = axis == 0;
    return axis;
  }

  void ParseAxes()
  {
    const int count = lines_.Sizes("dimension", Need("dimension"), 1)[0];
    if (count < 1 || count > 16)
      lines_.Fail("\"dimension\" is " + std::to_string(count) + "; 1 to 16 are possible");
    const std::size_t all = static_cast<std::size_t>(count);
    const std::vector<int> sizes = lines_.Sizes("sizes", Need("sizes"), all);

    const std::size_t frames = FindFrames(sizes);

    // Which axes lie in space.
    std::vector<Vector> vectors(all, Eigen::Vector3d::Zero());
    const std::string* directions = Find("spacedirections");
    if (directions) {
      vectors = Vectors("space directions", *directions);
      if (vectors.size() != all)
        lines_.Fail("space directions are not one per axis");
    } else if (const std::string* kinds = Find("kinds")) {
      const auto words = SplitWords(*kinds);
      for (std::size_t axis = 0; axis < all && axis < words.size(); ++axis)
        if (words[axis] != "domain" && words[axis] != "space" && words[axis] != "???" && words[axis] != "none")
          vectors[axis].reset();
    }
    if (frames < all)
      vectors[frames].reset();
    for (std::size_t axis = all;
         axis-- > 0 && all - static_cast<std::size_t>(std::count(vectors.begin(), vectors.end(), Vector())) > 3;)
      if (sizes[axis] == 1)
        vectors[axis].reset(); // a fourth axis of one sample adds nothing

    std::vector<std::size_t> axes;
    for (std::size_t axis = 0; axis < all; ++axis) {
      if (axis == frames)
        continue;
      if (vectors[axis])
        axes.push_back(axis);
      else if (axes.empty() && header_.components == 1)
        header_.components = static_cast<std::uint64_t>(sizes[axis]);
      else if (sizes[axis] != 1)
        lines_.Fail("axis " + std::to_string(axis + 1) + " does not lie in space and has " + std::to_string(sizes[axis]) +
                    " samples; one volume is needed");
    }
    if (axes.size() != 2 && axes.size() != 3)
      lines_.Fail("it has " + std::to_string(axes.size()) + " axes in space; 2 or 3 are needed");
    for (std::size_t i = 0; i < axes.size(); ++i)
      header_.geometry.dimensions[i] = sizes[axes[i]];

    if (directions)
      ParseSpace(vectors, axes);
    else
      ParseSpacings(all, axes);
    PlaceAxes(header_, static_cast<int>(axes.size()));
  }

  void NoteUnknownUnit(const std::string& text)
  {
    header_.notes.push_back("the unit of length is not known (" + text + "): millimetres were assumed");
  }

  void ParseSpace(const std::vector<Vector>& vectors, const std::vector<std::size_t>& axes)
  {
    ImageGeometry& g = header_.geometry;
    const Eigen::Vector3d toLps = ToLps();
    double unit = 1.0;
    if (const std::string* text = Find("spaceunits")) {
      const std::vector<std::string> names = Quoted(*text);
      const auto known = names.empty() ? std::nullopt : Millimetres(names[0]);
      if (std::adjacent_find(names.begin(), names.end(), std::not_equal_to<>()) != names.end())
        lines_.Fail("the axes of its space have different units");
      unit = known.value_or(1.0);
      if (!known)
        NoteUnknownUnit(*text);
    }
    for (std::size_t i = 0; i < axes.size(); ++i) {
      const Eigen::Vector3d step = toLps.cwiseProduct(*vectors[axes[i]]);
      const Eigen::Index column = static_cast<Eigen::Index>(i);
      const double length = step.stableNorm();
      g.spacing[column] = length * unit;
      g.direction.col(column) = length > 0.0 ? Eigen::Vector3d(step / length) : step;
    }
    if (const std::string* text = Find("spaceorigin")) {
      const std::vector<Vector> origin = Vectors("space origin", *text);
      if (origin.size() != 1 || !origin[0])
        lines_.Fail("space origin is not one vector");
      g.origin = unit * toLps.cwiseProduct(*origin[0]);
    } else
      header_.notes.push_back("the file has no origin: 0 0 0 was assumed");
  }

  // Without directions: spacings, and where the axes begin.
  void ParseSpacings(std::size_t all, const std::vector<std::size_t>& axes)
  {
    ImageGeometry& g = header_.geometry;
    for (const auto& [field, name] : {std::pair{"space", "space"}, std::pair{"spaceorigin", "space origin"}})
      if (Find(field))
        lines_.Fail(std::string("it has \"") + name + "\" without \"space directions\": where its axes point is not known");
    header_.notes.push_back("the file has no direction: its axes were taken as those of the world");
    Eigen::Vector3d unit = Eigen::Vector3d::Ones();
    if (const std::string* text = Find("units")) {
      const std::vector<std::string> names = Quoted(*text);
      bool known = true;
      for (std::size_t i = 0; i < axes.size(); ++i) {
        const auto mm = names.size() == all ? Millimetres(names[axes[i]]) : std::nullopt;
        unit[static_cast<Eigen::Index>(i)] = mm.value_or(1.0);
        known = known && mm;
      }
      if (!known)
        NoteUnknownUnit(*text);
    }
    const auto perAxis = [&](const char* field, const char* name, const auto& use) {
      const std::string* text = Find(field);
      if (!text)
        return false;
      const auto words = SplitWords(*text);
      if (words.size() != all)
        lines_.Fail(std::string(name) + " are not one per axis");
      for (std::size_t i = 0; i < axes.size(); ++i)
        use(static_cast<Eigen::Index>(i), words[axes[i]]);
      return true;
    };
    const auto lengths = [&](const char* field, const char* name, Eigen::Vector3d& target) {
      return perAxis(field, name, [&](Eigen::Index i, std::string_view word) {
        target[i] = unit[i] * lines_.Numbers<double>(name, word, 1)[0];
      });
    };
    std::array<std::string_view, 3> centers;
    for (const char* field : {"centers", "centerings"})
      perAxis(field, field, [&](Eigen::Index i, std::string_view word) { centers[static_cast<std::size_t>(i)] = word; });
    const bool begins = lengths("axismins", "axis mins", g.origin);
    Eigen::Vector3d ends;
    const bool spaced = lengths("spacings", "spacings", g.spacing);
    const bool ended = begins && !spaced && lengths("axismaxs", "axis maxs", ends);
    for (std::size_t i = 0; begins && i < axes.size(); ++i) {
      const bool cell = centers[i] == "cell"; // then the extremes are edges of samples, not their centres
      if (ended && !cell && centers[i] != "node")
        lines_.Fail("it has \"axis maxs\" without \"spacings\" or \"centerings\": its spacing is not known");
      const Eigen::Index axis = static_cast<Eigen::Index>(i);
      if (const int steps = g.dimensions[i] - (cell ? 0 : 1); ended && steps > 0)
        g.spacing[axis] = (ends[axis] - g.origin[axis]) / steps;
      if (cell)
        g.origin[axis] += 0.5 * g.spacing[axis];
    }
    if (!spaced && !ended)
      header_.notes.push_back("the file has no spacing: 1 mm was assumed");
    if (!begins)
      header_.notes.push_back("the file has no origin: 0 0 0 was assumed");
  }

  void ParseType()
  {
    const std::optional<VoxelType> type = TypeNamed(Plain(Need("type")));
    header_.typeIsKnown = type.has_value();
    header_.type = type.value_or(VoxelType::UInt8);
    const std::string encoding = Plain(Need("encoding"));
    if (encoding == "raw")
      header_.encoding = ImageHeader::Encoding::Raw;
    else if (encoding == "gzip" || encoding == "gz")
      header_.encoding = ImageHeader::Encoding::Zlib;
    else if (encoding == "ascii" || encoding == "text" || encoding == "txt")
      header_.encoding = ImageHeader::Encoding::Text;
    else
      lines_.Fail("the encoding " + encoding + " is not supported; raw, gzip and ascii are");
    if (const std::string* endian = Find("endian")) {
      header_.bigEndian = Plain(*endian) == "big";
      if (!header_.bigEndian && Plain(*endian) != "little")
        lines_.Fail("\"endian\" is " + *endian + "; little or big is needed");
    } else if (header_.encoding != ImageHeader::Encoding::Text && SizeOf(header_.type) > 1)
      lines_.Fail("the header has no \"endian\"");
  }

  void ParseData()
  {
    const std::string* file = Find("datafile");
    if (file && (file->compare(0, 4, "LIST") == 0 || file->find('%') != std::string::npos))
      lines_.Fail("the voxels lie in several files, which is not supported; join them with another program first");
    header_.dataPath = file ? DetachedPath(header_.path, *file) : header_.path;
    header_.dataOffset = file ? 0 : lines_.Position();

    if (const std::string* text = Find("lineskip")) {
      const int skip = lines_.Sizes("line skip", *text, 1)[0];
      std::ifstream stream = OpenToRead(header_.dataPath);
      stream.seekg(header_.dataOffset);
      for (int line = 0; line < skip && stream; ++line)
        stream.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
      if (!stream)
        throw Error(Error::Kind::BadFile, header_.dataPath + ": it has fewer lines than \"line skip\" says");
      header_.dataOffset = stream.tellg();
    }
    if (const std::string* text = Find("byteskip")) {
      const std::int64_t skip = lines_.Numbers<std::int64_t>("byte skip", *text, 1)[0];
      if (skip < -1 || (skip == -1 && header_.encoding != ImageHeader::Encoding::Raw))
        lines_.Fail("\"byte skip\" is " + *text);
      if (skip == -1)
        header_.dataOffset = -1;
      else if (header_.encoding == ImageHeader::Encoding::Zlib)
        header_.skipDecoded = static_cast<std::uint64_t>(skip);
      else if (skip > std::numeric_limits<std::int64_t>::max() - header_.dataOffset)
        lines_.Fail("\"byte skip\" is " + *text);
      else
        header_.dataOffset += skip;
    }
  }

  ImageHeader& header_;
  HeaderLines lines_;
  FrameAxis* const sequence_;
  std::map<std::string, std::string> fields_;
};

} // namespace

std::string VectorText(const Eigen::Vector3d& v)
{
  return "(" + NumberText(v[0]) + "," + NumberText(v[1]) + "," + NumberText(v[2]) + ")";
}

std::string EscapedNrrd(const std::string& text)
{
  std::string escaped;
  for (const char c : text)
    escaped += c == '\n' ? "\\n" : c == '\\' ? "\\\\" : std::string(1, c);
  return escaped;
}

std::string NrrdTypeName(VoxelType type)
{
  const std::string& names = NrrdTypeNames[static_cast<std::size_t>(type)].second;
  return names.substr(0, names.find(' '));
}

void ParseNrrd(ImageHeader& header, FrameAxis* axis)
{
  Nrrd(header, axis).Parse();
}

std::string NrrdHeaderText(const ImageHeader& header, const std::string& dataFile)
{
  const ImageGeometry& g = header.geometry;
  std::string text = std::string("NRRD0004\ntype: ") + NrrdTypeName(header.type) +
                     "\ndimension: 3\nspace: left-posterior-superior\nsizes: " + NumberText(g.dimensions[0]) + " " +
                     NumberText(g.dimensions[1]) + " " + NumberText(g.dimensions[2]) + "\nspace directions:";
  for (int axis = 0; axis < 3; ++axis)
    text += " " + VectorText(g.direction.col(axis) * g.spacing[axis]);
  text +=
      "\nkinds: domain domain domain\nspace units: \"mm\" \"mm\" \"mm\"\nspace origin: " + VectorText(g.origin) + "\nencoding: ";
  text += header.encoding == ImageHeader::Encoding::Zlib ? "gzip" : "raw";
  text += header.bigEndian ? "\nendian: big\n" : "\nendian: little\n";
  for (const auto& [key, value] : FieldsInFile(header))
    text += key + ":=" + EscapedNrrd(value) + "\n";
  return text + (dataFile.empty() ? "\n" : "data file: " + dataFile + "\n");
}

} // namespace echorama
