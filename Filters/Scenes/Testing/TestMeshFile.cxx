// SPDX-License-Identifier: BSD-3-Clause
// What VTK writes is read in TestUltrasoundSceneSource.py.
#include "Filters/Scenes/MeshFile.h"
#include "Readers/ByteOrder.h"
#include "Testing/TemporaryFolder.h"
#include <cstring>

using namespace echorama;
using namespace echorama::testing;

namespace {

class MeshFile : public TemporaryFolder {
protected:
  // A square and a triangle on its diagonal, over two elements that nobody asked for.
  static std::string Ply(const std::string& format)
  {
    std::string text =
        "ply\r\nformat " + format +
        " 1.0\ncomment a\nelement camera 1\nproperty list uchar short views\nelement vertex 5\n"
        "property uchar red\nproperty double z\nproperty float x\nproperty float32 y\nobj_info b\nelement face 3\n"
        "property list ushort int vertex_indices\nproperty int8 flags\nelement edge 1\nproperty uint a\nend_header\n";
    const bool isText = format == "ascii", swap = format == (HostIsBigEndian ? "binary_little_endian" : "binary_big_endian");
    const auto put = [&](auto number) {
      if (isText) {
        text += std::to_string(number) + (text.size() % 3 == 0 ? "\n" : " ");
        return;
      }
      char bytes[sizeof number];
      std::memcpy(bytes, &number, sizeof number);
      if (swap)
        SwapBytes(bytes, sizeof number, 1);
      text.append(bytes, sizeof number);
    };
    const auto polygon = [&](std::initializer_list<int> corners) {
      put(static_cast<std::uint16_t>(corners.size()));
      for (const int corner : corners)
        put(corner);
      put(std::int8_t{-1});
    };
    put(std::uint8_t{2});
    put(std::int16_t{-300});
    put(std::int16_t{7});
    for (const auto& point : points) {
      put(std::uint8_t{9});
      put(static_cast<double>(point.z()));
      put(point.x());
      put(point.y());
    }
    polygon({0, 1, 2, 3});
    polygon({0, 1}); // no polygon
    polygon({0, 2, 4});
    put(std::uint32_t{1});
    return text;
  }
  static void ExpectGood(const PolygonMesh& mesh)
  {
    EXPECT_EQ(mesh.points, points);
    EXPECT_EQ(mesh.corners, (std::vector<std::uint32_t>{0, 1, 2, 3, 0, 2, 4}));
    EXPECT_EQ(mesh.ends, (std::vector<std::size_t>{4, 7}));
  }
  void PlyRefused(const std::string& from, const std::string& to, const std::string& words) const
  {
    std::string text = Ply("ascii");
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    const std::string path = Put("a.ply", text.replace(at, from.size(), to));
    ExpectRefused([&] { ReadPly(path); }, Error::Kind::BadFile, path, words);
  }
  void ObjRefused(const std::string& text, const std::string& words) const
  {
    const std::string path = Put("a.obj", text);
    ExpectRefused([&] { ReadObj(path); }, Error::Kind::BadFile, path, words);
  }

  static inline const std::vector<Eigen::Vector3f> points{{0, 0, 0}, {1, 0, 0.5f}, {1, -1, 0}, {0, 1, 0}, {0, 0, 1e3f}};
};

} // namespace

TEST_F(MeshFile, PlyIsTheSameAsTextAndInBothByteOrders)
{
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    SCOPED_TRACE(format);
    ExpectGood(ReadPly(Put("a.ply", Ply(format))));
  }
}

TEST_F(MeshFile, PlyThatIsTruncatedAnywhereIsRefused)
{
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    const std::string whole = Ply(format);
    const std::size_t last = format[0] == 'a' ? whole.find_last_not_of(" \n") : whole.size(); // of the last number
    for (std::size_t size = 0; size < last; size += 2) {
      const std::string path = Put("a.ply", whole.substr(0, size));
      ExpectRefused([&] { ReadPly(path); }, Error::Kind::BadFile, path, "");
    }
  }
}

TEST_F(MeshFile, PlyThatIsDamagedIsRefusedWithTheReason)
{
  PlyRefused("ply", "plx", "its first line");
  PlyRefused("ascii", "text", "its format is neither");
  PlyRefused("format ascii 1.0\n", "", "its format is neither");
  PlyRefused("element vertex 5", "element vertex 4000000000", "truncated or damaged");
  PlyRefused("element vertex 5", "element vertex -5", "element");
  PlyRefused("element vertex 5", "element vertex 99999999999999999999999", "element");
  PlyRefused("element edge 1\nproperty uint a", "element edge 1", "truncated or damaged"); // 1 of nothing
  PlyRefused("property float x", "property half x", "\"half\"");
  PlyRefused("property float x", "property float w", "one x");
  PlyRefused("property uchar red", "property uchar x", "one x");
  PlyRefused("property float x", "property list uchar float x", "one x");
  PlyRefused("obj_info", "object", "object");
  PlyRefused("1000.0", "1000,0", "\"1000,000000\"");
}

TEST_F(MeshFile, FacesOfPlyNameNoPointsBeyondTheLast)
{
  const std::string head = "ply\nformat ascii 1.0\nelement face 1\nproperty list int double vertex_index\nelement vertex 1\n"
                           "property float x\nproperty float y\nproperty float z\nend_header\n";
  EXPECT_EQ(ReadPly(Put("a.ply", head + "3 0 0 0 1 2 3")).ends.size(), 1u); // before the points
  EXPECT_TRUE(ReadPly(Put("a.ply", head + "0 1 2 3")).ends.empty());
  for (const auto& [faces, words] : {std::pair{"3 0 0 1", "names point 1"},
                                     {"3 0 0 -1", "names point -1"},
                                     {"3 0 0 0.5", "0.5"},
                                     {"3 0 0 5e9", "names point 5"},
                                     {"3 0 0 nan", "nan"},
                                     {"-1", "damaged"},
                                     {"900 0", "damaged"}}) {
    const std::string path = Put("a.ply", head + faces + " 1 2 3");
    ExpectRefused([&] { ReadPly(path); }, Error::Kind::BadFile, path, words);
  }
}

TEST_F(MeshFile, ObjCountsFromOneAndBackFromTheLast)
{
  const std::string vertices =
      "# a\r\nmtllib x.mtl\nv 0 0 0\r\nv 1 0 0.5 # b\nv 1 -1 0 1.0 0.5\n  v\t0 1 0\nv 0 0 +1e3\nvt 0 0\nvn 0 0 1\n";
  ExpectGood(ReadObj(Put("a.obj", vertices + "f 1 2 3 4\nf 1 2\nf 1 3 5")));
  ExpectGood(ReadObj(Put("a.obj", vertices + "f -5/1 -4//1 3/1/1 \\\r\n 4\nl 1 2\ng x\nf -5 -3 -1\n")));
}

TEST_F(MeshFile, ObjThatIsDamagedIsRefusedWithItsLine)
{
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  for (const char* corner : {"4", "0", "-4", "x", "/1", "1.5", "99999999999999999999", "-9223372036854775808"})
    ObjRefused(vertices + "f 1 2 " + corner + "\n", "line 4: a face names point \"");
  ObjRefused("v 0 0\n", "line 1: a vertex");
  ObjRefused("v 0 0 x\n", "line 1: a vertex");
}

TEST_F(MeshFile, WhatIsNoFileOrTooLargeIsRefused)
{
  for (const auto read : {ReadPly, ReadObj}) {
    ExpectRefused([&] { read(Path("none")); }, Error::Kind::FileSystem, Path("none"), "cannot be read");
    ExpectRefused([&] { read(folder.string()); }, Error::Kind::FileSystem, folder.string(), "cannot be read");
    const std::string large = Put("large", "ply");
    std::filesystem::resize_file(large, std::uintmax_t{100} << 30); // a hole: it takes no room
    ExpectRefused([&] { read(large); }, Error::Kind::BadFile, large, "2 GiB");
  }
}
