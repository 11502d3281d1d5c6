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
  const std::string marked = "\xef\xbb\xbf" + vertices.substr(vertices.find("v 0")); // byte-order mark
  ExpectGood(ReadObj(Put("a.obj", marked + "f 1 2 3 4\nf 1 2\nf 1 3 5")));
  ExpectGood(ReadObj(Put("a.obj", vertices + "f -5/1 -4//1 3/1/1 \\\r\n 4\nl 1 2\ng x\nf -5 -3 -1\n")));
}

TEST_F(MeshFile, ObjGoesOnInTheNextLineWithinVerticesAndFacesAlone)
{
  const PolygonMesh mesh = ReadObj(Put("a.obj", "f 1 2 3\n# by D:\\scans\\\nv 0 0 0 # \\\ng a\\\nv 1 0 \\\n\\\n 0\nv 0 1 0\\"));
  EXPECT_EQ(mesh.points, (std::vector<Eigen::Vector3f>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_EQ(mesh.corners, (std::vector<std::uint32_t>{0, 1, 2})) << "in front of its points";
}

TEST_F(MeshFile, LargeObjTakesTimeByItsSize)
{
  std::string text;
  for (int i = 0; i < 300000; ++i)
    text += "v 0 0 1\n";
  EXPECT_EQ(ReadObj(Put("a.obj", text)).points.size(), 300000u); // each line alone is looked at: else it takes minutes
}

TEST_F(MeshFile, ObjThatIsDamagedIsRefusedWithItsLine)
{
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  ObjRefused(vertices + "f 1 2 4\n", "names point 4; there are 3");
  for (const char* corner : {"0", "-4", "x", "/1", "1.5", "99999999999999999999", "-9223372036854775808"})
    ObjRefused(vertices + "f 1 2 " + corner + "\n", "line 4: a face names point \"");
  ObjRefused("v 0 0\n", "line 1: a vertex");
  ObjRefused("v 0 \\\n 0 0\nf 1 1 \\\n 0\n", "line 4: a face");
  ObjRefused("v 0 0 x\n", "line 1: a vertex");
}

namespace {

class GltfFile : public TemporaryFolder {
protected:
  static std::string Bytes(std::uint32_t word)
  {
    std::string bytes;
    for (int i = 0; i < 4; ++i)
      bytes.push_back(static_cast<char>(word >> 8 * i & 0xFF));
    return bytes;
  }
  static std::string Glb(const std::string& json, const std::string& data)
  {
    const std::string chunks = Bytes(static_cast<std::uint32_t>(json.size())) + "JSON" + json +
                               Bytes(static_cast<std::uint32_t>(data.size())) + std::string("BIN\0", 4) + data;
    return "glTF" + Bytes(2) + Bytes(static_cast<std::uint32_t>(12 + chunks.size())) + chunks;
  }
  // Four points of 16 bytes each, and behind them the numbers 0 to 3, of one, two and four bytes.
  static std::string Data()
  {
    std::string data;
    for (const auto& point : points) {
      for (const float coordinate : point) {
        std::uint32_t bits;
        std::memcpy(&bits, &coordinate, 4);
        data += Bytes(bits);
      }
      data += "skip";
    }
    data += std::string("\0\1\2\3", 4) + std::string("\0\0\1\0\2\0\3\0", 8);
    for (std::uint32_t i = 0; i < 4; ++i)
      data += Bytes(i);
    return data;
  }
  // One node that shows one primitive, with \a from replaced.
  static std::string Json(const std::string& from = "", const std::string& to = "")
  {
    std::string text = R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
      "nodes": [{"mesh": 0}],
      "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 2, "mode": 4}]}],
      "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                    {"bufferView": 1, "componentType": 5121, "count": 4, "type": "SCALAR"},
                    {"bufferView": 1, "byteOffset": 4, "componentType": 5123, "count": 4, "type": "SCALAR"},
                    {"bufferView": 1, "byteOffset": 12, "componentType": 5125, "count": 4, "type": "SCALAR"}],
      "bufferViews": [{"buffer": 0, "byteLength": 64, "byteStride": 16}, {"buffer": 0, "byteOffset": 64, "byteLength": 28}],
      "buffers": [{"byteLength": 92}]})";
    if (!from.empty()) {
      const std::size_t at = text.find(from);
      EXPECT_NE(at, std::string::npos) << from;
      text.replace(at, from.size(), to);
    }
    return text;
  }
  PolygonMesh Read(const std::string& from = "", const std::string& to = "") const
  {
    return ReadGltf(Put("a.glb", Glb(Json(from, to), Data())));
  }
  void Refused(const std::string& from, const std::string& to, const std::string& words) const
  {
    const std::string path = Put("a.glb", Glb(Json(from, to), Data()));
    ExpectRefused([&] { ReadGltf(path); }, Error::Kind::BadFile, path, words);
  }

  using Corners = std::vector<std::uint32_t>;
  static inline const std::vector<Eigen::Vector3f> points{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
};

} // namespace

TEST_F(GltfFile, TrianglesStripsAndFansOfAllIndices)
{
  EXPECT_EQ(Read().points, points);
  for (const char* accessor : {"\"indices\": 1", "\"indices\": 2", "\"indices\": 3", "\"extras\": {}"})
    EXPECT_EQ(Read("\"indices\": 2", accessor).corners, (Corners{0, 1, 2})) << accessor; // a fourth corner is none of a triangle
  EXPECT_EQ(Read("\"mode\": 4", "\"mode\": 5").corners, (Corners{0, 1, 2, 1, 3, 2}));
  EXPECT_EQ(Read("\"mode\": 4", "\"mode\": 6").corners, (Corners{0, 1, 2, 0, 2, 3}));
  EXPECT_TRUE(Read("\"mode\": 4", "\"mode\": 1").points.empty()) << "lines are no surface";
  EXPECT_TRUE(Read("\"POSITION\"", "\"NORMAL\"").points.empty());
  EXPECT_EQ(
      Read("\"componentType\": 5126, \"count\": 4", "\"componentType\": 5126, \"byteOffset\": 4, \"count\": 4").points[3].x(),
      0.0f);
  EXPECT_EQ(Read(", \"mode\": 4", "").ends, (std::vector<std::size_t>{3}));
}

TEST_F(GltfFile, NodesPlaceAndMirrorTheirMeshes)
{
  // A quarter turn about z of twice the size, beside a mirrored one below a node without a mesh, which is turned about x and
  // moved.
  const PolygonMesh mesh = Read(R"([{"mesh": 0}])", R"([
    {"mesh": 0, "translation": [10, 0, 0], "rotation": [0, 0, 0.70710678118654757, 0.70710678118654757], "scale": [2, 2, 2], "children": [1]},
    {"matrix": [1,0,0,0, 0,0,1,0, 0,-1,0,0, 0,0,5,1], "children": [2]}, {"mesh": 0, "scale": [1, 1, -1]}])");
  ASSERT_EQ(mesh.points.size(), 8u);
  EXPECT_LT((mesh.points[1] - Eigen::Vector3f(10, 2, 0)).norm(), 1e-5);
  EXPECT_LT((mesh.points[2] - Eigen::Vector3f(6, 0, 0)).norm(), 1e-5);
  EXPECT_LT((mesh.points[7] - Eigen::Vector3f(4, 0, 10)).norm(), 1e-5); // from (0, 0, -3) by (0, 3, 5)
  EXPECT_EQ(mesh.corners, (Corners{0, 1, 2, 4, 6, 5}));
  std::string strip = Json("\"mode\": 4", "\"mode\": 5");
  strip.replace(strip.find("{\"mesh\": 0}"), 11, "{\"mesh\": 0, \"scale\": [-1, 1, 1]}");
  EXPECT_EQ(ReadGltf(Put("a.glb", Glb(strip, Data()))).corners, (Corners{0, 2, 1, 1, 2, 3}));
}

TEST_F(GltfFile, DataMayLieInTheFileAsTextOrBesideIt)
{
  std::ofstream(Path("a b.bin"), std::ios::binary) << Data();
  EXPECT_EQ(ReadGltf(Put("a.gltf", Json("\"byteLength\": 92", "\"uri\": \"a%20b.bin\""))).points, points);
  const std::string base64 =
      "AAAAAAAAAAAAAAAAc2tpcAAAgD8AAAAAAAAAAHNraXAAAAAAAAAAQAAAAABza2lwAAAAAAAAAAAAAEBAc2tpcAABAgMAAAEAAgAD"
      "AAAAAAABAAAAAgAAAAMAAAA=";
  const PolygonMesh inside =
      ReadGltf(Put("a.gltf", Json("\"byteLength\": 92", "\"uri\": \"data:application/octet-stream;base64," + base64 + "\"")));
  EXPECT_EQ(inside.points, points);
  EXPECT_EQ(inside.corners, (Corners{0, 1, 2}));
  const std::string path = Put("a.gltf", Json("\"byteLength\": 92", "\"uri\": \"none.bin\""));
  ExpectRefused([&] { ReadGltf(path); }, Error::Kind::FileSystem, Path("none.bin"), "cannot be read");
}

TEST_F(GltfFile, WhatIsDamagedIsRefusedWithTheReason)
{
  Refused("\"scenes\"", "\"scene_\"", "no scene");
  Refused("\"scene\": 0", "\"scene\": 1", "scenes 1");
  Refused("\"nodes\": [0]", "\"nodes\": [1]", "nodes 1");
  Refused("\"nodes\": [0]", "\"nodes\": [0, 0]", "occurs twice");
  Refused("{\"mesh\": 0}", "{\"mesh\": 0, \"children\": [0]}", "occurs twice");
  Refused("{\"mesh\": 0}", "{\"mesh\": -1}", "no count");
  Refused("{\"mesh\": 0}", "{\"mesh\": 0, \"rotation\": [0, 0, 0, 0]}", "rotation");
  Refused("{\"mesh\": 0}", "{\"mesh\": 0, \"matrix\": [1]}", "16 numbers");
  Refused("{\"mesh\": 0}", "3", "no object");
  Refused("{\"mesh\": 0}", "{\"mesh\": 0, \"skin\": 0}", "skin");
  Refused("{\"mesh\": 0}", "{\"mesh\": 0, \"weights\": [0, 0.5]}", "morph targets");
  Refused("\"primitives\"", "\"weights\": [1], \"primitives\"", "morph targets");
  Refused("\"POSITION\": 0", "\"POSITION\": 1", "no VEC3");
  Refused("\"POSITION\": 0", "\"POSITION\": \"0\"", "number");
  Refused("5126", "5122", "no floats");
  Refused("5123", "5122", "no whole numbers");
  Refused("\"count\": 4", "\"count\": 5", "beyond its buffer");
  Refused("\"count\": 4", "\"count\": 3", "names point 3");
  Refused("\"count\": 4", "\"count\": 1e15", "beyond its buffer");
  Refused("\"count\": 4", "\"sparse\": {}, \"count\": 4", "sparse");
  Refused("\"byteOffset\": 4", "\"byteOffset\": 21", "beyond its buffer");
  Refused("\"byteOffset\": 64", "\"byteOffset\": 65", "beyond its buffer");
  Refused("\"byteStride\": 16", "\"byteStride\": 8", "byteStride");
  Refused("\"byteStride\": 16", "\"byteStride\": 253", "byteStride");
  Refused("\"buffer\": 0", "\"buffer\": 1", "buffers 1");
  Refused("\"byteLength\": 92", "\"uri\": 3", "no text");
  Refused("\"byteLength\": 92", "\"uri\": \"https://a/b\"", "no file beside it");
  Refused("\"asset\"", "\"extensionsRequired\": [\"KHR_draco_mesh_compression\"], \"asset\"", "KHR_draco_mesh_compression");
}

TEST_F(GltfFile, WhatChangesNoTriangleIsPassedOver)
{
  EXPECT_EQ(Read("\"asset\"", "\"extensionsRequired\": [\"KHR_texture_transform\", \"KHR_materials_unlit\"], \"asset\"").points,
            points);
  EXPECT_EQ(Read("\"primitives\"", "\"weights\": [0], \"primitives\"").points, points);
  EXPECT_EQ(ReadGltf(Put("a.glb", Glb(Json(), Data()) + "something more")).points, points);
  std::string former = Glb(Json(), Data());
  former[4] = 1;
  const std::string path = Put("a.glb", former);
  ExpectRefused([&] { ReadGltf(path); }, Error::Kind::BadFile, path, "binary glTF 2");
}

TEST_F(GltfFile, FewBytesDoNotBecomeManyPoints)
{
  const std::string large(std::size_t{12} << 12, '\0');
  std::string nodes = "{\"mesh\": 0}", shown = "0";
  for (int i = 1; i < 2000; ++i) {
    nodes += ", {\"mesh\": 0}";
    shown += ", " + std::to_string(i);
  }
  std::string json = Json("\"nodes\": [0]", "\"nodes\": [" + shown + "]");
  const auto replace = [&json](const std::string& from, const std::string& to) {
    json.replace(json.find(from), from.size(), to);
  };
  replace("{\"mesh\": 0}", nodes);
  replace("\"count\": 4", "\"count\": 4096");
  replace("\"byteLength\": 64, \"byteStride\": 16", "\"byteLength\": 49152");
  replace(", \"indices\": 2", "");
  const std::string path = Put("a.glb", Glb(json, large));
  ExpectRefused([&] { ReadGltf(path); }, Error::Kind::BadFile, path, "far more than its size can hold");
  // Nothing but weights, and primitives that are no surface.
  std::string weights = "0", lines;
  for (int i = 0; i < 500; ++i) {
    weights += ", 0";
    lines += "{\"attributes\": {}}, ";
  }
  for (const auto& [from, to] : {std::pair{std::string("\"primitives\": ["), "\"weights\": [" + weights + "], \"primitives\": ["},
                                 {"\"primitives\": [", "\"primitives\": [" + lines}}) {
    std::string other = Json("\"nodes\": [0]", "\"nodes\": [" + shown + "]");
    other.replace(other.find("{\"mesh\": 0}"), 11, nodes);
    other.replace(other.find(from), from.size(), to);
    const std::string again = Put("b.glb", Glb(other, Data()));
    ExpectRefused([&] { ReadGltf(again); }, Error::Kind::BadFile, again, "far more than its size can hold");
  }
}

TEST_F(GltfFile, TruncatedAnywhereIsRefused)
{
  const std::string whole = Glb(Json(), Data());
  for (std::size_t size = 0; size < whole.size(); size += 3) {
    const std::string path = Put("a.glb", whole.substr(0, size));
    ExpectRefused([&] { ReadGltf(path); }, Error::Kind::BadFile, path, "");
  }
}

TEST_F(MeshFile, WhatIsNoFileOrTooLargeIsRefused)
{
  for (const auto read : {ReadPly, ReadObj, ReadGltf}) {
    ExpectRefused([&] { read(Path("none")); }, Error::Kind::FileSystem, Path("none"), "cannot be read");
    ExpectRefused([&] { read(folder.string()); }, Error::Kind::FileSystem, folder.string(), "cannot be read");
    const std::string large = Put("large", "ply");
    std::filesystem::resize_file(large, std::uintmax_t{100} << 30); // a hole: it takes no room
    ExpectRefused([&] { read(large); }, Error::Kind::BadFile, large, "2 GiB");
  }
}
