// SPDX-License-Identifier: BSD-3-Clause
// Files of other programs are made here with OpenVDB itself.
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Readers/Testing/ObliqueVolume.h"
#include "Readers/VdbFile.h"
#include "Testing/TemporaryFolder.h"
#include <cstring>
#include <limits>
#include <numeric>

// Programs hide what they do not export; OpenVDB's static members must be one with those of its library.
#pragma GCC visibility push(default)
#include <openvdb/openvdb.h>
#pragma GCC visibility pop

// OpenVDB forgets the node that it is reading when damaged data make it stop.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions()
{
  return "leak:libopenvdb";
}

using namespace echorama;
using namespace echorama::testing;

namespace {

constexpr std::array<int, 3> NoMultiples{21, 9, 17}; // of the leaves' 8

class VdbFile : public TemporaryFolder {
protected:
  static void SetUpTestSuite() { openvdb::initialize(); }

  std::string Write(const std::string& name, const ImageHeader& header, const void* voxels, const unsigned char* valid,
                    bool compress = true) const
  {
    FileReplacement files;
    WriteVdb(Path(name), header, voxels, valid, compress, files);
    files.Commit();
    return Path(name);
  }
  std::string Foreign(const openvdb::GridPtrVec& grids, const std::string& name = "foreign.vdb") const
  {
    openvdb::io::File(Path(name)).write(grids);
    return Path(name);
  }
  std::string Bytes(const std::string& path) const
  {
    std::ifstream stream(path, std::ios::binary);
    return std::string((std::istreambuf_iterator<char>(stream)), {});
  }
  void Refused(const std::string& path, const std::string& words, Error::Kind kind = Error::Kind::BadFile) const
  {
    ExpectRefused([&] { OpenVdb(path); }, kind, path, words);
  }
};

template <class T>
struct Volume {
  std::vector<T> voxels;
  std::vector<unsigned char> valid;
};

template <class T>
Volume<T> Read(VolumeSource& source)
{
  EXPECT_EQ(sizeof(T), SizeOf(source.Content().type));
  EXPECT_TRUE(source.Content().holdsValidRegion);
  const std::size_t count = source.Content().geometry.VoxelCount();
  Volume<T> volume{std::vector<T>(count), std::vector<unsigned char>(count, 7)};
  source.Read(0, volume.voxels.data(), volume.valid.data());
  return volume;
}

bool HasNote(const VolumeContent& content, const std::string& words)
{
  for (const std::string& note : content.notes)
    if (note.find(words) != std::string::npos)
      return true;
  return false;
}

// The library makes the grid: a constructor called here would compile all that grids can do.
template <class Grid>
typename Grid::Ptr NewGrid()
{
  return openvdb::gridPtrCast<Grid>(openvdb::GridBase::createGrid(Grid::gridType()));
}

openvdb::FloatGrid::Ptr SmallGrid()
{
  const auto grid = NewGrid<openvdb::FloatGrid>();
  grid->setName("density");
  grid->tree().setValue(openvdb::Coord(-3, 5, 100), 1.5f);
  grid->tree().setValue(openvdb::Coord(4, 6, 101), 2.5f);
  return grid;
}

} // namespace

TEST_F(VdbFile, EveryTypeComesBackWithGeometryAndValidRegion)
{
  for (const VoxelType type : AllTypes)
    for (const bool compress : {true, false})
      DispatchVoxelType(type, [&](auto zero) {
        using T = decltype(zero);
        SCOPED_TRACE(static_cast<int>(type));
        const ImageHeader wanted = Oblique(type, NoMultiples);
        const std::size_t count = wanted.geometry.VoxelCount();
        const std::vector<T> voxels = Values<T>(count); // also where they are not valid
        std::vector<unsigned char> valid(count);
        Random random(8);
        for (unsigned char& v : valid)
          v = random.Bits() % 2;
        const std::string path = Write("a.vdb", wanted, voxels.data(), valid.data(), compress);
        EXPECT_EQ(FormatOfContent(path), FileFormat::Vdb);
        const auto source = OpenVdb(path);
        const VolumeContent& content = source->Content();
        EXPECT_EQ(content.type, type);
        EXPECT_TRUE(content.notes.empty()) << content.notes[0];
        EXPECT_EQ(content.fields, wanted.fields);
        EXPECT_EQ(content.geometry.dimensions, wanted.geometry.dimensions);
        EXPECT_EQ(content.geometry.origin, wanted.geometry.origin);
        EXPECT_LT((content.geometry.spacing - wanted.geometry.spacing).norm(), 1e-15);
        EXPECT_LT((content.geometry.direction - wanted.geometry.direction).norm(), 1e-15);
        const Volume<T> back = Read<T>(*source);
        EXPECT_EQ(std::memcmp(back.voxels.data(), voxels.data(), count * sizeof(T)), 0);
        EXPECT_EQ(back.valid, valid);
      });
}

TEST_F(VdbFile, ATurnedGridIsTurnedForOthersToo)
{
  const ImageHeader header = Oblique(VoxelType::UInt8, NoMultiples);
  const std::vector<unsigned char> voxels(header.geometry.VoxelCount(), 1);
  openvdb::io::File file(Write("a.vdb", header, voxels.data(), nullptr));
  file.open();
  const openvdb::GridBase::Ptr grid = file.readGrid("Intensity");
  for (const Eigen::Vector3d& index : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(20, 0, 0), Eigen::Vector3d(3, 5, 16)}) {
    const openvdb::Vec3d at = grid->indexToWorld(openvdb::Vec3d(index.x(), index.y(), index.z()));
    EXPECT_LT((header.geometry.IndexToWorld() * index - Eigen::Vector3d(at.x(), at.y(), at.z())).norm(), 1e-9);
  }
}

TEST_F(VdbFile, APoseStaysBehindWhenAnotherProgramMovesTheGrid)
{
  ImageHeader header = Oblique(VoxelType::UInt8, NoMultiples);
  const std::vector<HeaderField> others = header.fields;
  header.fields.insert(header.fields.begin(), {"Echorama_ProbeToWorld", "1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1"});
  const std::vector<unsigned char> voxels(header.geometry.VoxelCount(), 1);
  const std::string path = Write("a.vdb", header, voxels.data(), nullptr);
  EXPECT_EQ(OpenVolume(path)->Content().fields, header.fields);
  openvdb::io::File file(path);
  file.open();
  const openvdb::GridBase::Ptr grid = file.readGrid("Intensity");
  file.close();
  grid->transform().postTranslate(openvdb::Vec3d(0, 0, 1));
  const auto source = OpenVolume(Foreign({grid}));
  EXPECT_NEAR(source->Content().geometry.origin.z(), header.geometry.origin.z() + 1, 1e-12);
  EXPECT_EQ(source->Content().fields, others);
  EXPECT_TRUE(HasNote(source->Content(), "ProbeToWorld belonged to a geometry"));
}

TEST_F(VdbFile, ASparseVolumeIsASmallFileThatOthersRead)
{
  ImageHeader header;
  header.geometry.dimensions = {100, 100, 100};
  header.geometry.spacing = {0.5, 0.5, 2.0};
  header.geometry.origin = {7, 8, 9};
  std::vector<unsigned char> voxels(1000000), valid(1000000);
  for (std::size_t i = 500000; i < 501000; ++i)
    voxels[i] = valid[i] = static_cast<unsigned char>(i % 2 + 1);
  const std::string path = Write("a.vdb", header, voxels.data(), valid.data());
  EXPECT_LT(std::filesystem::file_size(path), 50000u);

  openvdb::io::File file(path);
  file.open();
  const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("Intensity"));
  ASSERT_TRUE(grid);
  EXPECT_EQ(grid->activeVoxelCount(), 1000u);
  EXPECT_EQ(grid->background(), 0.f);
  EXPECT_EQ(grid->tree().getValue(openvdb::Coord(1, 0, 50)), 2.f);
  const openvdb::Vec3d world = grid->indexToWorld(openvdb::Coord(10, 0, 50));
  EXPECT_TRUE(world.eq(openvdb::Vec3d(12, 8, 109), 1e-12));

  for (unsigned char& v : valid)
    v = v != 0;
  for (const int threads : {1, 2}) {
    const ThreadLimit limit(threads);
    const Volume<unsigned char> back = Read<unsigned char>(*OpenVdb(path));
    EXPECT_EQ(back.voxels, voxels);
    EXPECT_EQ(back.valid, valid);
  }
}

TEST_F(VdbFile, NothingValidComesBackToo)
{
  ImageHeader header;
  header.geometry.dimensions = {3, 4, 5};
  const std::vector<unsigned char> voxels(60, 9), none(60, 0);
  const Volume<unsigned char> back = Read<unsigned char>(*OpenVdb(Write("a.vdb", header, voxels.data(), none.data())));
  EXPECT_EQ(back.voxels, voxels);
  EXPECT_EQ(back.valid, none);
  const Volume<unsigned char> all = Read<unsigned char>(*OpenVdb(Write("a.vdb", header, none.data(), nullptr)));
  EXPECT_EQ(all.voxels, none);
  EXPECT_EQ(all.valid, std::vector<unsigned char>(60, 1));
}

TEST_F(VdbFile, GridsOfOtherProgramsAreTheirActiveBox)
{
  const auto grid = SmallGrid();
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.25));
  const auto source = OpenVdb(Foreign({grid}));
  const VolumeContent& content = source->Content();
  EXPECT_EQ(content.type, VoxelType::Float32);
  EXPECT_EQ(content.geometry.dimensions, (std::array<int, 3>{8, 2, 2}));
  EXPECT_LT((content.geometry.origin - Eigen::Vector3d(-0.75, 1.25, 25.0)).norm(), 1e-12);
  EXPECT_LT((content.geometry.spacing - Eigen::Vector3d(0.25, 0.25, 0.25)).norm(), 1e-12);
  EXPECT_TRUE(HasNote(content, "unit"));
  Volume<float> volume = Read<float>(*source);
  std::vector<float> wanted(32);
  wanted.front() = 1.5f;
  wanted.back() = 2.5f;
  EXPECT_EQ(volume.voxels, wanted);
  EXPECT_EQ(volume.valid.front() + volume.valid.back(), 2);
  EXPECT_EQ(std::count(volume.valid.begin(), volume.valid.end(), 1), 2);

  // A tile: a constant region without leaves, larger than one.
  grid->fill(openvdb::CoordBBox(openvdb::Coord(-8, 0, 96), openvdb::Coord(23, 31, 127)), 4.f);
  const auto tiled = OpenVdb(Foreign({grid}));
  EXPECT_EQ(tiled->Content().geometry.dimensions, (std::array<int, 3>{32, 32, 32}));
  EXPECT_EQ(Read<float>(*tiled).voxels, std::vector<float>(32768, 4.f));
}

TEST_F(VdbFile, LeftHandedTransformsAreReversed)
{
  const auto grid = SmallGrid();
  openvdb::math::Mat4d mirror = openvdb::math::Mat4d::identity();
  mirror(2, 2) = -1.0;
  grid->setTransform(openvdb::math::Transform::createLinearTransform(mirror));
  const auto source = OpenVdb(Foreign({grid}));
  EXPECT_LT((source->Content().geometry.origin - Eigen::Vector3d(-3, 5, -101)).norm(), 1e-12);
  const Volume<float> volume = Read<float>(*source);
  EXPECT_EQ(volume.voxels[15], 2.5f);
  EXPECT_EQ(volume.voxels[16], 1.5f);
  EXPECT_EQ(volume.valid[16], 1);
}

TEST_F(VdbFile, WhichGridIsTaken)
{
  const auto vector = NewGrid<openvdb::Vec3SGrid>();
  vector->setName("velocity");
  const auto first = SmallGrid(), second = SmallGrid(), named = SmallGrid();
  named->setName("Intensity");
  named->tree().setValue(openvdb::Coord(0, 0, 0), 7.f);
  auto source = OpenVdb(Foreign({vector, first}));
  EXPECT_TRUE(HasNote(source->Content(), "density was taken; left out: velocity"));
  source = OpenVdb(Foreign({first, vector, named}));
  EXPECT_TRUE(HasNote(source->Content(), "Intensity was taken"));
  const auto doubles = NewGrid<openvdb::DoubleGrid>();
  doubles->tree().setValue(openvdb::Coord(0, 0, 0), 0.1);
  source = OpenVdb(Foreign({doubles}));
  EXPECT_EQ(Read<double>(*source).voxels, std::vector<double>{0.1});
}

TEST_F(VdbFile, WhatOtherProgramsChanged)
{
  ImageHeader header;
  header.geometry.dimensions = {8, 8, 8};
  const std::vector<unsigned char> voxels(512, 9);
  const std::string path = Write("a.vdb", header, voxels.data(), nullptr);
  const auto load = [&] {
    openvdb::io::File file(path);
    file.open();
    return openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("Intensity"));
  };
  auto grid = load();
  grid->tree().setValue(openvdb::Coord(1, 1, 1), 0.5f);
  auto source = OpenVdb(Foreign({grid}));
  EXPECT_TRUE(HasNote(source->Content(), "no longer fit"));
  EXPECT_EQ(Read<float>(*source).voxels[73], 0.5f);
  grid = load();
  grid->tree().setValue(openvdb::Coord(9, 1, 1), 5.f);
  source = OpenVdb(Foreign({grid}));
  EXPECT_TRUE(HasNote(source->Content(), "larger"));
  EXPECT_EQ(source->Content().geometry.dimensions[0], 10);
}

TEST_F(VdbFile, WhatIsNoVolumeIsRefused)
{
  const auto vector = NewGrid<openvdb::Vec3SGrid>();
  Refused(Foreign({vector}), "no grid of single numbers");
  Refused(Foreign({NewGrid<openvdb::FloatGrid>()}), "no active voxels");
  auto grid = SmallGrid();
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  Refused(Foreign({grid}), "level set");
  grid = SmallGrid();
  grid->setTransform(openvdb::math::Transform::createFrustumTransform(
      openvdb::BBoxd(openvdb::Vec3d(0, 0, 0), openvdb::Vec3d(100, 100, 100)), 0.5, 100.0, 1.0));
  Refused(Foreign({grid}), "frustum");
  grid = SmallGrid();
  openvdb::math::Mat4d shear = openvdb::math::Mat4d::identity();
  shear(1, 0) = 0.5;
  grid->setTransform(openvdb::math::Transform::createLinearTransform(shear));
  Refused(Foreign({grid}), "sheared");
  grid = SmallGrid();
  grid->tree().setValue(openvdb::Coord(2000000, 2000000, 2000000), 1.f); // two voxels far apart
  Refused(Foreign({grid}), "memory", Error::Kind::TooLarge);
  grid->tree().setValue(openvdb::Coord(-2000000000, 0, 0), 1.f);
  grid->tree().setValue(openvdb::Coord(2000000000, 0, 0), 1.f);
  Refused(Foreign({grid}), "too far");
  openvdb::GridPtrVec none;
  Refused(Foreign(none), "no grids");
  Refused(Put("text.vdb", "this is not OpenVDB, though its name says so"), "not OpenVDB");
  Refused(Path("missing.vdb"), "opened", Error::Kind::FileSystem);
}

TEST_F(VdbFile, TruncatedFilesAreRefused)
{
  const ImageHeader header = Oblique(VoxelType::UInt8, NoMultiples);
  const std::vector<unsigned char> voxels = Values<unsigned char>(header.geometry.VoxelCount());
  const std::string file = Bytes(Write("a.vdb", header, voxels.data(), nullptr));
  for (std::size_t length = 8; length < file.size(); length += 1 + length / 10)
    EXPECT_THROW(OpenVdb(Put("short.vdb", file.substr(0, length))), Error) << length;
  Refused(Put("short.vdb", file.substr(0, file.size() - 1)), "truncated");
}

TEST_F(VdbFile, LengthsBeyondTheFileAreRefused)
{
  const std::string file = Bytes(Foreign({SmallGrid()}));
  const auto with = [&](std::size_t at, std::uint32_t length) {
    std::string bad = file;
    std::memcpy(bad.data() + at, &length, sizeof length);
    return Put("bad.vdb", bad);
  };
  // Behind the magic, versions, flag and name: the count of metadata, the count of grids, the length of the first name.
  Refused(with(21, 7), "header is damaged");
  Refused(with(57, 1), "more than the file");
  Refused(with(65, 2000000000), "more than the file");
  Refused(with(61, 0), "no grids");
  Refused(with(8, 100), "file version");
}

TEST_F(VdbFile, LengthsOfVoxelsAreChecked)
{
  // Values that are not compressed carry a negative length, which OpenVDB would read into a leaf whatever it is.
  ImageHeader header;
  header.geometry.dimensions = {8, 8, 8};
  const std::vector<unsigned char> voxels = Values<unsigned char>(512);
  std::string bad = Bytes(Write("a.vdb", header, voxels.data(), nullptr));
  // The one leaf is the end of the file: its mask, the byte that tells its form, the length.
  const std::size_t form = bad.rfind(std::string(64, '\xff')) + 64;
  for (const std::int64_t length : {std::int64_t{-100000}, std::int64_t{1} << 40, std::int64_t{0}}) {
    std::memcpy(bad.data() + form + 1, &length, sizeof length);
    Refused(Put("bad.vdb", bad), "damaged");
  }
}

TEST_F(VdbFile, SizesInBloscChunksAreChecked)
{
  // Blosc reads as many bytes as the header of a chunk says.
  ASSERT_TRUE(openvdb::io::Archive::hasBloscCompression());
  ImageHeader header;
  header.geometry.dimensions = {8, 8, 8};
  header.type = VoxelType::Float32;
  std::vector<float> ramp(512);
  std::iota(ramp.begin(), ramp.end(), 0.0f);
  const std::string good = Bytes(Write("a.vdb", header, ramp.data(), nullptr));
  // The one leaf is the end of the file: its mask, the byte that tells its form, the length, the chunk.
  const std::size_t chunk = good.rfind(std::string(64, '\xff')) + 64 + 1 + 8;
  ASSERT_LT(chunk + 16, good.size());
  const auto number = [&](std::size_t at) {
    std::int32_t value;
    std::memcpy(&value, good.data() + chunk + at, sizeof value);
    return value;
  };
  ASSERT_EQ(number(4), 2048); // bytes of voxels: this is the header of a chunk
  ASSERT_EQ(static_cast<std::size_t>(number(12)), good.size() - chunk);
  for (const std::size_t at : {4, 8, 12}) // bytes of voxels, of a block, of the chunk
    for (const std::int32_t value : {-1, 0, 1 << 30}) {
      std::string bad = good;
      std::memcpy(bad.data() + chunk + at, &value, sizeof value);
      Refused(Put("bad.vdb", bad), "damaged");
    }
}

TEST_F(VdbFile, RandomDamageNeverCrashes)
{
  ImageHeader header = Oblique(VoxelType::UInt8, NoMultiples);
  const std::vector<unsigned char> voxels = Values<unsigned char>(header.geometry.VoxelCount());
  for (const bool compress : {true, false}) {
    const std::string good = Bytes(Write("a.vdb", header, voxels.data(), nullptr, compress));
    Random random(7);
    for (int i = 0; i < 200; ++i) {
      std::string bad = good;
      for (std::uint64_t flips = 1 + random.Below(4); flips > 0; --flips)
        bad[random.Below(i % 2 ? bad.size() : 2000)] = static_cast<char>(random.Bits());
      try {
        const auto source = OpenVdb(Put("bad.vdb", bad));
        if (source->Content().geometry.VoxelCount() > 1000000) // damaged dimensions of a sparse volume: large, but possible
          continue;
        std::vector<double> values(source->Content().geometry.VoxelCount());
        std::vector<unsigned char> valid(values.size());
        source->Read(0, values.data(), valid.data());
      } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find(Path("bad.vdb")), std::string::npos) << error.what();
      }
    }
  }
}

TEST_F(VdbFile, WhatCannotBeWritten)
{
  const std::vector<unsigned char> voxels = Values<unsigned char>(1000000);
  const auto refused = [&](const std::string& name, const ImageHeader& header, Error::Kind kind, const std::string& words) {
    ExpectRefused([&] { Write(name, header, voxels.data(), nullptr); }, kind, Path(name), words);
    EXPECT_EQ(FileCount(), 0);
  };
  const ImageHeader good = Oblique(VoxelType::UInt8, NoMultiples);
  refused("a.vd", good, Error::Kind::InvalidParameter, ".vdb");
  refused("missing/a.vdb", good, Error::Kind::FileSystem, "folder");
  ImageHeader bad = good;
  bad.geometry.spacing[1] = 0.0;
  refused("a.vdb", bad, Error::Kind::BadInput, "spacing");
  ImageHeader large = good;
  large.geometry.dimensions = {100, 100, 100};
  {
    const FullDisk full(100000);
    refused("a.vdb", large, Error::Kind::FileSystem, "written");
  }
  const Progress stop([](double fraction) { return fraction < 0.3; });
  FileReplacement files;
  EXPECT_THROW(WriteVdb(Path("b.vdb"), large, voxels.data(), nullptr, true, files, stop), Error);
}
