// SPDX-License-Identifier: BSD-3-Clause
// Format: https://www.fabbers.com/tech/STL_Format. Binary: 80 bytes of anything, the number of triangles, then 50 bytes each:
// normal, three corners, two bytes of nothing.
#include "Filters/Tissue/StlFile.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <unordered_map>
#include <vector>

namespace echorama {
namespace {

constexpr std::size_t Head = 84, BytesOfTriangle = 50;

// Little-endian, on any machine.
std::uint32_t WordAt(std::string_view bytes, std::size_t at)
{
  std::uint32_t word = 0;
  for (std::size_t i = 4; i-- > 0;)
    word = word << 8 | static_cast<unsigned char>(bytes[at + i]);
  return word;
}

std::size_t BytesFor(std::string_view bytes)
{
  return bytes.size() < Head ? Head : Head + BytesOfTriangle * WordAt(bytes, Head - 4);
}

using PointBits = std::array<std::uint32_t, 3>;
struct PointHash {
  std::uint64_t salt; // which no file can know: points that would all come together cannot be chosen
  std::size_t operator()(const PointBits& bits) const
  {
    std::uint64_t hash = salt ^ bits[0];
    for (const std::uint32_t next : {bits[1], bits[2]})
      hash = ((hash ^ hash >> 29) * 0x9E3779B97F4A7C15u) ^ next;
    return hash ^ hash >> 32;
  }
};

// Whatever its case.
bool Is(std::string_view word, std::string_view lower)
{
  return std::equal(word.begin(), word.end(), lower.begin(), lower.end(),
                    [](char a, char b) { return (a >= 'A' && a <= 'Z' ? a - 'A' + 'a' : a) == b; });
}

// Takes the next one off a line; empty at its end.
std::string_view Word(std::string_view& line)
{
  const auto isBlank = [](char c) { return c == ' ' || (c >= '\t' && c <= '\r'); };
  const auto begin = std::find_if_not(line.begin(), line.end(), isBlank), end = std::find_if(begin, line.end(), isBlank);
  const std::string_view word =
      line.substr(static_cast<std::size_t>(begin - line.begin()), static_cast<std::size_t>(end - begin));
  line.remove_prefix(static_cast<std::size_t>(end - line.begin()));
  return word;
}

// Of one triangle after the other.
std::vector<Eigen::Vector3f> CornersOfBinary(const std::string& path, std::string_view bytes)
{
  if (bytes.size() < BytesFor(bytes))
    FailFile(path, "it is truncated or no STL file: it has " + std::to_string(bytes.size()) + " bytes; its triangles take " +
                       std::to_string(BytesFor(bytes)));
  std::vector<Eigen::Vector3f> corners(3 * std::size_t{WordAt(bytes, Head - 4)});
  for (std::size_t i = 0; i < corners.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::uint32_t word = WordAt(bytes, Head + BytesOfTriangle * (i / 3) + 12 * (1 + i % 3) + 4 * axis);
      std::memcpy(corners[i].data() + axis, &word, 4);
    }
  return corners;
}

std::vector<Eigen::Vector3f> CornersOfText(const std::string& path, std::string_view rest)
{
  std::size_t number = 0; // of the line
  const auto fail = [&](const std::string& what) { FailFile(path, "line " + std::to_string(number) + ": " + what); };
  std::vector<Eigen::Vector3f> corners;
  bool isOpen = false;  // a solid
  std::size_t ends = 0; // of the last triangle, in corners
  while (!rest.empty()) {
    std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(line.size() + 1, rest.size()));
    ++number;
    const std::string_view key = Word(line);
    if (Is(key, "vertex")) {
      Eigen::Vector3d point;
      bool isGood = true;
      for (int axis = 0; axis < 3; ++axis)
        isGood = isGood && ParseNumber(Word(line), point[axis]);
      if (!isGood || !Word(line).empty())
        fail("a vertex that is not three numbers");
      corners.emplace_back(point.cast<float>());
    } else if (Is(key, "endloop")) {
      if (corners.size() != ends + 3)
        fail("a facet that has " + std::to_string(corners.size() - ends) + " vertices, not 3");
      ends = corners.size();
    } else if (Is(key, "solid") || Is(key, "endsolid")) {
      isOpen = Is(key, "solid");
    } else if (!key.empty() && !Is(key, "facet") && !Is(key, "outer") && !Is(key, "endfacet")) {
      fail("\"" + std::string(key.substr(0, 20)) + "\" is no word of STL");
    }
  }
  if (isOpen || corners.size() != ends)
    FailFile(path, "it is truncated or no STL file: it ends within a solid");
  return corners;
}

} // namespace

TriangleSurface SurfaceOfStl(const std::string& path, std::string_view bytes)
{
  const bool isBinary = bytes.size() == BytesFor(bytes) || !Is(bytes.substr(0, 5), "solid");
  const std::vector<Eigen::Vector3f> corners = isBinary ? CornersOfBinary(path, bytes) : CornersOfText(path, bytes);
  if (corners.size() > std::numeric_limits<std::uint32_t>::max())
    FailFile(path, "it has too many triangles");

  TriangleSurface surface;
  surface.triangles.resize(corners.size() / 3);
  // A closed surface has half as many points as triangles.
  const PointHash hash{reinterpret_cast<std::uintptr_t>(corners.data())};
  std::unordered_map<PointBits, std::uint32_t, PointHash> numbers(corners.size() / 5, hash);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector3f point = corners[i].array() + 0.0f; // -0 is 0
    PointBits bits;
    std::memcpy(bits.data(), point.data(), sizeof bits);
    const auto [found, isNew] = numbers.emplace(bits, static_cast<std::uint32_t>(surface.points.size()));
    if (isNew)
      surface.points.push_back(corners[i]);
    surface.triangles[i / 3][i % 3] = found->second;
  }
  return surface;
}

} // namespace echorama
