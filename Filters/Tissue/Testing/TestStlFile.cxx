// SPDX-License-Identifier: BSD-3-Clause
// What VTK writes is read in TestUltrasoundSceneSource.py.
#include "Filters/Tissue/StlFile.h"
#include "Testing/TemporaryFolder.h"
#include <cmath>
#include <cstring>
#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <limits>

using namespace echorama;
using namespace echorama::testing;

namespace {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

// Little-endian, whatever this machine is.
std::string Binary(const std::vector<Eigen::Vector3f>& corners, std::uint32_t count, const std::string& name = "binary")
{
  std::string bytes(84, '\0');
  name.copy(bytes.data(), 80);
  const auto put = [](char* at, std::uint32_t word) {
    for (int i = 0; i < 4; ++i)
      at[i] = static_cast<char>(word >> 8 * i & 0xFF);
  };
  put(bytes.data() + 80, count);
  for (std::size_t i = 0; i < corners.size(); i += 3) {
    bytes.append(50, '\x7F');
    for (std::size_t n = 0; n < 9; ++n) {
      std::uint32_t word = 0;
      std::memcpy(&word, corners[i + n / 3].data() + n % 3, 4);
      put(bytes.data() + bytes.size() - 50 + 12 + 4 * n, word);
    }
  }
  return bytes;
}

std::string Text(const std::string& vertices, const std::string& name = "a")
{
  return "solid " + name + "\n  facet normal 0 0 1\r\n outer loop\n" + vertices + "endloop\nendfacet\n\nendsolid " + name + "\n";
}

void ExpectRefusal(const std::string& bytes, const std::string& words)
{
  ExpectRefused([&] { SurfaceOfStl("a.stl", bytes); }, Error::Kind::BadFile, "a.stl", words);
}

const std::vector<Eigen::Vector3f> Square{{0, 0, 0}, {1, 0, 0.5f}, {1, 1, 0}, {1, 1, -0.0f}, {-0.0f, 1e3f, 0}, {0, -0.0f, 0}};
const std::string SquareText = Text("vertex 0 0 0\nVERTEX 1 0 5e-1\n\tvertex +1 1 0\n", "vertex 9 9 9") +
                               Text("vertex 1 1 -0\nvertex 0 1000 0\nvertex 0 0 0\n");

} // namespace

TEST(StlFile, TextAndBinaryJoinPointsThatAreAlike)
{
  for (const std::string& bytes : {SquareText, Binary(Square, 2), Binary(Square, 2, "solid a\n") /* many programs write so */}) {
    const TriangleSurface surface = SurfaceOfStl("a.stl", bytes);
    EXPECT_EQ(surface.points, (std::vector<Eigen::Vector3f>{Square[0], Square[1], Square[2], Square[4]}));
    EXPECT_EQ(surface.triangles, (Triangles{{0, 1, 2}, {2, 3, 0}}));
  }
}

TEST(StlFile, WhatIsNoNumberIsKeptForTheCheckOfTheSurface)
{
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const TriangleSurface surface =
      SurfaceOfStl("a.stl", Binary({{nan, 0, 0}, {0, nan, 0}, {1, 0, 0}, {nan, 0, 0}, {0, nan, 0}, {nan, 0, 0}}, 2));
  EXPECT_EQ(surface.triangles, (Triangles{{0, 1, 2}})) << "the other has two corners alike";
  EXPECT_TRUE(std::isnan(surface.points[1].y()));
}

TEST(StlFile, AllTrianglesThatAreThereAreReadWhateverTheirCount)
{
  for (const char* name : {"binary", "solid a"})
    for (const std::uint32_t count : {0u, 1u, 2u})
      for (const char* behind : {"", "more"})
        EXPECT_EQ(SurfaceOfStl("a.stl", Binary(Square, count, name) + behind).triangles.size(), 2u) << name << count << behind;
  ExpectRefusal(Binary(Square, 3), "it has 2 triangles, and says 3");
}

TEST(StlFile, TextMayBeginWithBlanksAndHaveColours)
{
  std::string text = "\r\n  " + SquareText;
  text.insert(text.find("endsolid"), "color 1 0 0\n");
  EXPECT_EQ(SurfaceOfStl("a.stl", text).triangles.size(), 2u);
}

TEST(StlFile, WhatIsWrittenIsReadAgain)
{
  const TriangleSurface surface = SurfaceOfStl("a.stl", SquareText);
  const std::string bytes = StlOf(surface);
  const TriangleSurface again = SurfaceOfStl("a.stl", bytes);
  EXPECT_EQ(again.points, surface.points);
  EXPECT_EQ(again.triangles, surface.triangles);
  const Eigen::Vector3f normal = (Square[1] - Square[0]).cross(Square[2] - Square[0]).normalized();
  std::uint32_t word = 0; // of the first normal
  for (std::size_t i = 0; i < 4; ++i)
    word |= std::uint32_t{static_cast<unsigned char>(bytes[84 + 8 + i])} << 8 * i;
  float z = 0.0f;
  std::memcpy(&z, &word, 4);
  EXPECT_FLOAT_EQ(z, normal.z());
}

TEST(StlFile, TruncatedAnywhereIsRefused)
{
  const std::string binary = Binary(Square, 2), text = Text("vertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\n");
  for (std::size_t size = 0; size < binary.size(); ++size)
    ExpectRefusal(binary.substr(0, size), "truncated or no STL file");
  for (std::size_t size = 0; size < text.find("endsolid"); ++size)
    ExpectRefusal(text.substr(0, size), "");
}

TEST(StlFile, DamagedIsRefusedWithTheReason)
{
  ExpectRefusal(Binary(Square, 0xFFFFFFFF), "it has 2 triangles, and says 4294967295");
  ExpectRefusal(Text("vertex 0 0 0\nvertex 1 0 0\n"), "line 6: a facet that has 2 vertices");
  ExpectRefusal(Text("vertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 1 2 0\n"), "4 vertices");
  ExpectRefusal(Text("vertex 0 0 0\nvertex 1 0\nvertex 1 1 0\n"), "line 5: a vertex that is not three numbers");
  ExpectRefusal(Text("vertex 0 0 0\nvertex 1 0 0 0\nvertex 1 1 0\n"), "line 5");
  ExpectRefusal(Text("vertex 0 0 0\nvertex 1 0 0,5\nvertex 1 1 0\n"), "line 5");
  ExpectRefusal(Text("vertex 0 0 0\nvortex 1 0 0\nvertex 1 1 0\n"), "line 5: it does not begin with a word of STL");
  ExpectRefusal("solid a\nfacet\nvertex 0 0 0\nendsolid a\n", "ends within a solid");
}
