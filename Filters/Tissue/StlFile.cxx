// SPDX-License-Identifier: BSD-3-Clause
// Format: https://www.fabbers.com/tech/STL_Format. Binary: 80 bytes of anything, the number of triangles, then 50 bytes each:
// normal, three corners, two bytes of nothing.
#include "Filters/Tissue/StlFile.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Words.h"
#include <algorithm>
#include <cstring>
#include <limits>
#include <tuple>
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

std::string Lower(std::string_view word)
{
  std::string lower(word.substr(0, 20));
  std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return std::tolower(c); });
  return lower;
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
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(line.size() + 1, rest.size()));
    ++number;
    const auto words = SplitWords(line);
    if (words.empty())
      continue;
    const std::string key = Lower(words[0]);
    if (key == "vertex") {
      Eigen::Vector3d point;
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (words.size() != 4 || !ParseNumber(words[axis + 1], point[static_cast<Eigen::Index>(axis)]))
          fail("a vertex that is not three numbers");
      corners.emplace_back(point.cast<float>());
    } else if (key == "endloop") {
      if (corners.size() != ends + 3)
        fail("a facet that has " + std::to_string(corners.size() - ends) + " vertices, not 3");
      ends = corners.size();
    } else if (key == "solid" || key == "endsolid") {
      isOpen = key == "solid";
    } else if (key != "facet" && key != "outer" && key != "endfacet") {
      fail("\"" + key + "\" is no word of STL");
    }
  }
  if (isOpen || corners.size() != ends)
    FailFile(path, "it is truncated or no STL file: it ends within a solid");
  return corners;
}

} // namespace

TriangleSurface SurfaceOfStl(const std::string& path, std::string_view bytes)
{
  const bool isBinary = bytes.size() == BytesFor(bytes) || Lower(bytes.substr(0, 5)) != "solid";
  const std::vector<Eigen::Vector3f> corners = isBinary ? CornersOfBinary(path, bytes) : CornersOfText(path, bytes);
  if (corners.size() > std::numeric_limits<std::uint32_t>::max())
    FailFile(path, "it has too many triangles");

  // Those that are alike come together when they are sorted, the first of them first. By their bits: not even what is no number
  // upsets that order.
  struct Corner {
    std::array<std::uint32_t, 3> bits;
    std::uint32_t place;
    bool operator<(const Corner& other) const { return std::tie(bits, place) < std::tie(other.bits, other.place); }
  };
  std::vector<Corner> sorted(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector3f point = corners[i].array() + 0.0f; // -0 is 0
    std::memcpy(sorted[i].bits.data(), point.data(), 12);
    sorted[i].place = static_cast<std::uint32_t>(i);
  }
  std::sort(sorted.begin(), sorted.end());
  std::vector<std::uint32_t> first(corners.size()); // of the corners that lie here
  for (std::size_t i = 0; i < sorted.size(); ++i)
    first[sorted[i].place] = i > 0 && sorted[i].bits == sorted[i - 1].bits ? first[sorted[i - 1].place] : sorted[i].place;

  TriangleSurface surface;
  surface.triangles.resize(corners.size() / 3);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (first[i] == i) {
      first[i] = static_cast<std::uint32_t>(surface.points.size());
      surface.points.push_back(corners[i]);
    } else {
      first[i] = first[first[i]]; // an earlier one, which has its number
    }
    surface.triangles[i / 3][i % 3] = first[i];
  }
  return surface;
}

} // namespace echorama
