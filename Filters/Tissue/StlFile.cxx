// SPDX-License-Identifier: BSD-3-Clause
// Format: https://www.fabbers.com/tech/STL_Format. Binary: 80 bytes of anything, the number of triangles, then 50 bytes each:
// normal, three corners, two bytes of nothing.
#include "Filters/Tissue/StlFile.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <array>
#include <cstring>
#include <Eigen/Geometry>
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

void PutWord(std::string& bytes, std::size_t at, std::uint32_t word)
{
  for (std::size_t i = 0; i < 4; ++i, word >>= 8)
    bytes[at + i] = static_cast<char>(word & 0xFF);
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

// Of one triangle after the other. All that are there: some programs write too small a count, or none.
std::vector<Eigen::Vector3f> CornersOfBinary(const std::string& path, std::string_view bytes)
{
  const std::size_t there = bytes.size() < Head ? 0 : (bytes.size() - Head) / BytesOfTriangle;
  if (bytes.size() < Head || WordAt(bytes, Head - 4) > there)
    FailFile(path, "it is truncated or no STL file: it has " + std::to_string(there) + " triangles" +
                       (bytes.size() < Head ? "" : ", and says " + std::to_string(WordAt(bytes, Head - 4))));
  std::vector<Eigen::Vector3f> corners(3 * there);
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
    } else if (!key.empty() && !Is(key, "facet") && !Is(key, "outer") && !Is(key, "endfacet") && !Is(key, "color")) {
      fail("it does not begin with a word of STL");
    }
  }
  if (isOpen || corners.size() != ends)
    FailFile(path, "it is truncated or no STL file: it ends within a solid");
  return corners;
}

} // namespace

TriangleSurface SurfaceOfStl(const std::string& path, std::string_view bytes)
{
  const std::string_view head = bytes.substr(0, Head),
                         text = head.substr(std::min(head.find_first_not_of(" \t\r\n"), head.size()));
  const bool isWhole = head.size() == Head && bytes.size() == Head + BytesOfTriangle * WordAt(bytes, Head - 4);
  const bool isBinary = isWhole || !Is(text.substr(0, 5), "solid") || head.find('\0') != std::string_view::npos;
  const std::vector<Eigen::Vector3f> corners = isBinary ? CornersOfBinary(path, bytes) : CornersOfText(path, bytes);
  if (corners.size() > std::numeric_limits<std::uint32_t>::max())
    FailFile(path, "it has too many triangles");

  TriangleSurface surface;
  surface.triangles.reserve(corners.size() / 3);
  std::array<std::uint32_t, 3> triangle;
  // A closed surface has half as many points as triangles.
  const PointHash hash{reinterpret_cast<std::uintptr_t>(corners.data())};
  std::unordered_map<PointBits, std::uint32_t, PointHash> numbers(corners.size() / 5, hash);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector3f point = corners[i].array() + 0.0f; // -0 is 0
    PointBits bits;
    std::memcpy(bits.data(), point.data(), sizeof bits);
    const auto [found, isNew] = numbers.try_emplace(bits, static_cast<std::uint32_t>(surface.points.size()));
    if (isNew)
      surface.points.push_back(corners[i]);
    triangle[i % 3] = found->second;
    if (i % 3 == 2 && triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0])
      surface.triangles.push_back(triangle);
  }
  return surface;
}

std::string StlOf(const TriangleSurface& surface)
{
  std::string bytes(Head + BytesOfTriangle * surface.triangles.size(), '\0');
  std::string_view("binary STL, mm").copy(bytes.data(), Head - 4);
  PutWord(bytes, Head - 4, static_cast<std::uint32_t>(surface.triangles.size()));
  std::size_t at = Head;
  for (const auto& triangle : surface.triangles) {
    const Eigen::Vector3f &a = surface.points[triangle[0]], &b = surface.points[triangle[1]], &c = surface.points[triangle[2]];
    const Eigen::Vector3f cross = (b - a).cross(c - a);
    const Eigen::Vector3f normal = cross.norm() > 0.0f ? Eigen::Vector3f(cross.normalized()) : Eigen::Vector3f::Zero();
    for (const Eigen::Vector3f* part : {&normal, &a, &b, &c})
      for (const float number : *part) {
        std::uint32_t word = 0;
        std::memcpy(&word, &number, 4);
        PutWord(bytes, at, word);
        at += 4;
      }
    at += 2;
  }
  return bytes;
}

} // namespace echorama
