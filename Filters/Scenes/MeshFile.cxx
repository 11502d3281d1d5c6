// SPDX-License-Identifier: BSD-3-Clause
// Formats: http://paulbourke.net/dataformats/ply/ and http://paulbourke.net/dataformats/obj/.
//
// Counts in a file are believed only as far as its bytes go: every number takes at least one.
#include "MeshFile.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/TextFile.h"
#include "Core/Base/Words.h"
#include "Readers/ByteOrder.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <optional>

namespace echorama {
namespace {

class PlyDecoder {
public:
  explicit PlyDecoder(const std::string& path) : path_(path), content_(ReadMeshContent(path)), rest_(content_) {}

  PolygonMesh Run()
  {
    Header();
    PolygonMesh mesh;
    for (const Element& element : elements_)
      Read(element, mesh);
    for (const std::uint32_t corner : mesh.corners)
      if (corner >= mesh.points.size())
        Fail("a face names point " + std::to_string(corner) + " (from 0); there are " + std::to_string(mesh.points.size()));
    return mesh;
  }

private:
  enum class Type { Int8, UInt8, Int16, UInt16, Int32, UInt32, Float32, Float64 };
  struct Property {
    std::string_view name;
    Type type;
    std::optional<Type> count; // of a list
  };
  struct Element {
    std::string_view name;
    std::size_t count;
    std::vector<Property> properties;
  };

  [[noreturn]] void Fail(const std::string& reason) const { FailFile(path_, reason); }

  std::vector<std::string_view> Words()
  {
    if (rest_.empty())
      Fail("its header has no end");
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    const std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    return SplitWords(line);
  }

  void Header()
  {
    if (const auto first = Words(); first.size() != 1 || first[0] != "ply")
      Fail("it is no PLY file: its first line is not \"ply\"");
    bool hasFormat = false;
    for (auto words = Words(); words.size() != 1 || words[0] != "end_header"; words = Words()) {
      const std::string_view key = words.empty() ? std::string_view("comment") : words[0];
      if (key == "comment" || key == "obj_info")
        continue;
      if (key == "format" && words.size() == 3) {
        isText_ = words[1] == "ascii";
        swap_ = words[1] == (HostIsBigEndian ? "binary_little_endian" : "binary_big_endian");
        hasFormat = isText_ || swap_ || words[1] == (HostIsBigEndian ? "binary_big_endian" : "binary_little_endian");
      } else if (std::size_t count = 0; key == "element" && words.size() == 3 && ParseNumber(words[2], count)) {
        elements_.push_back({words[1], count, {}});
      } else if (key == "property" && !elements_.empty() && words.size() == 3) {
        elements_.back().properties.push_back({words[2], TypeOf(words[1]), {}});
      } else if (key == "property" && !elements_.empty() && words.size() == 5 && words[1] == "list") {
        elements_.back().properties.push_back({words[4], TypeOf(words[3]), TypeOf(words[2])});
      } else {
        Fail("its header has a line of PLY that is not known: " + std::string(key));
      }
    }
    if (!hasFormat)
      Fail("its format is neither ascii nor binary_little_endian nor binary_big_endian");
  }

  Type TypeOf(std::string_view name) const
  {
    constexpr std::array<std::array<std::string_view, 2>, 8> names{{{"char", "int8"},
                                                                    {"uchar", "uint8"},
                                                                    {"short", "int16"},
                                                                    {"ushort", "uint16"},
                                                                    {"int", "int32"},
                                                                    {"uint", "uint32"},
                                                                    {"float", "float32"},
                                                                    {"double", "float64"}}};
    for (std::size_t type = 0; type < names.size(); ++type)
      if (name == names[type][0] || name == names[type][1])
        return static_cast<Type>(type);
    Fail("its header has the type \"" + std::string(name) + "\", which is not known");
  }

  void Read(const Element& element, PolygonMesh& mesh)
  {
    if (element.count > rest_.size() || (element.count > 0 && element.properties.empty()))
      FailShort();
    const bool isVertex = element.name == "vertex", isFace = element.name == "face";
    const std::array<std::string_view, 3> axes{"x", "y", "z"};
    std::vector<int> axisOf; // of each property; -1: of no axis
    for (const Property& property : element.properties) {
      const auto found = std::find(axes.begin(), axes.end(), property.name);
      axisOf.push_back(isVertex && !property.count && found != axes.end() ? static_cast<int>(found - axes.begin()) : -1);
    }
    for (int axis = 0; axis < 3; ++axis)
      if (isVertex && std::count(axisOf.begin(), axisOf.end(), axis) != 1)
        Fail("its vertices do not have exactly one x, one y and one z");
    for (std::size_t n = 0; n < element.count; ++n) {
      Eigen::Vector3d point = Eigen::Vector3d::Zero();
      for (std::size_t i = 0; i < element.properties.size(); ++i) {
        const Property& property = element.properties[i];
        if (property.count)
          List(property, isFace && (property.name == "vertex_indices" || property.name == "vertex_index") ? &mesh : nullptr);
        else if (const double number = Number(property.type); axisOf[i] >= 0)
          point[axisOf[i]] = number;
      }
      if (isVertex)
        mesh.points.emplace_back(point.cast<float>());
    }
  }

  // Into \a mesh, or past it.
  void List(const Property& property, PolygonMesh* mesh)
  {
    const double count = Number(*property.count);
    if (!(count >= 0.0 && count <= static_cast<double>(rest_.size()) && count == std::floor(count)))
      FailShort();
    const bool isPolygon = mesh && count >= 3.0;
    for (double i = 0.0; i < count; ++i) {
      const double corner = Number(property.type);
      if (!isPolygon)
        continue;
      if (!(corner >= 0.0 && corner <= 4294967295.0 && corner == std::floor(corner)))
        Fail("a face names point " + NumberText(corner));
      mesh->corners.push_back(static_cast<std::uint32_t>(corner));
    }
    if (isPolygon)
      mesh->ends.push_back(mesh->corners.size());
  }

  double Number(Type type)
  {
    if (isText_)
      return Word();
    switch (type) {
    case Type::Int8:
      return Binary<std::int8_t>();
    case Type::UInt8:
      return Binary<std::uint8_t>();
    case Type::Int16:
      return Binary<std::int16_t>();
    case Type::UInt16:
      return Binary<std::uint16_t>();
    case Type::Int32:
      return Binary<std::int32_t>();
    case Type::UInt32:
      return Binary<std::uint32_t>();
    case Type::Float32:
      return static_cast<double>(Binary<float>());
    default:
      return Binary<double>();
    }
  }

  double Word()
  {
    constexpr const char* blanks = " \t\r\n\v\f";
    rest_.remove_prefix(std::min(rest_.find_first_not_of(blanks), rest_.size()));
    const std::string_view word = rest_.substr(0, rest_.find_first_of(blanks));
    if (word.empty())
      FailShort();
    rest_.remove_prefix(word.size());
    double number = 0.0;
    if (!ParseNumber(word, number))
      Fail("it has \"" + std::string(word.substr(0, 40)) + "\" in the place of a number");
    return number;
  }

  template <class T>
  T Binary()
  {
    char bytes[sizeof(T)];
    if (rest_.size() < sizeof bytes)
      FailShort();
    std::memcpy(bytes, rest_.data(), sizeof bytes);
    rest_.remove_prefix(sizeof bytes);
    if (swap_)
      SwapBytes(bytes, sizeof bytes, 1);
    T number;
    std::memcpy(&number, bytes, sizeof bytes);
    return number;
  }

  [[noreturn]] void FailShort() const { Fail("it is truncated or damaged: it ends before its vertices and faces do"); }

  const std::string& path_;
  std::string content_;
  std::string_view rest_;
  std::vector<Element> elements_;
  bool isText_ = false, swap_ = false;
};

} // namespace

std::string ReadMeshContent(const std::string& path)
{
  std::error_code unknown; // then reading says why
  const std::uintmax_t size = std::filesystem::file_size(path, unknown);
  if (!unknown && size > LargestMeshFile)
    FailFile(path, "it has " + std::to_string(size) + " bytes; a mesh of its format may have 2 GiB");
  return ReadTextFile(path, LargestMeshFile);
}

PolygonMesh ReadPly(const std::string& path)
{
  return PlyDecoder(path).Run();
}

PolygonMesh ReadObj(const std::string& path)
{
  const std::string content = ReadMeshContent(path);
  std::string_view rest = SkipByteOrderMark(content);
  std::size_t number = 0;
  const auto fail = [&](const std::string& what) { FailFile(path, "line " + std::to_string(number) + ": " + what); };
  const auto next = [&] { // without a comment
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(line.size() + 1, rest.size()));
    ++number;
    return TrimBlanks(line.substr(0, line.find('#')));
  };
  PolygonMesh mesh;
  while (!rest.empty()) {
    std::string_view line = next();
    if (line.empty() || (line[0] != 'v' && line[0] != 'f'))
      continue;
    std::string joined; // with the lines that it goes on in
    while (line.back() == '\\') {
      if (joined.empty())
        joined = line;
      joined.back() = ' ';
      joined += next();
      line = joined;
    }
    const auto words = SplitWords(line);
    if (words.empty())
      continue;
    if (words[0] == "v") {
      Eigen::Vector3d point;
      for (int axis = 0; axis < 3; ++axis)
        if (words.size() < 4 || !ParseNumber(words[static_cast<std::size_t>(axis) + 1], point[axis]))
          fail("a vertex that is not three numbers");
      mesh.points.emplace_back(point.cast<float>());
    } else if (words[0] == "f" && words.size() > 3) {
      const auto points = static_cast<std::int64_t>(mesh.points.size());
      for (std::size_t i = 1; i < words.size(); ++i) {
        std::int64_t corner = 0; // from 1, or back from the last
        if (!ParseNumber(words[i].substr(0, words[i].find('/')), corner) || corner == 0 || corner < -points ||
            corner > 4294967295)
          fail("a face names point \"" + std::string(words[i].substr(0, 40)) + "\"");
        mesh.corners.push_back(static_cast<std::uint32_t>(corner > 0 ? corner - 1 : points + corner));
      }
      mesh.ends.push_back(mesh.corners.size());
    }
  }
  for (const std::uint32_t corner : mesh.corners) // which may come before their points
    if (corner >= mesh.points.size())
      FailFile(path, "a face names point " + std::to_string(std::size_t{corner} + 1) + "; there are " +
                         std::to_string(mesh.points.size()));
  return mesh;
}

} // namespace echorama
