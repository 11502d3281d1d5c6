// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Readers/Compression.h"
#include "Readers/NiftiFile.h"
#include "Readers/Testing/Effort.h"
#include "Readers/Testing/ObliqueVolume.h"
#include "Readers/VolumeFile.h"
#include "Readers/VolumeWriter.h"
#include "Testing/TemporaryFolder.h"
#include <algorithm>
#include <cstring>
#include <limits>
#include <numeric>

using namespace echorama;
using namespace echorama::testing;

namespace {

constexpr float NaN = std::numeric_limits<float>::quiet_NaN();

// A NIfTI-1 file by hand, after the standard's table, in either byte order.
struct ByHand {
  bool big = false;
  std::array<short, 8> dim{3, 2, 2, 2, 1, 1, 1, 1};
  std::array<float, 8> pixdim{1, 1, 1, 1, 0, 0, 0, 0};
  short datatype = 2, qform = 0, sform = 1;
  float offset = 352, slope = 0, intercept = 0, toffset = 0;
  unsigned char units = 2;
  std::array<float, 6> quaternion{};
  std::array<float, 12> srow{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  std::string magic = std::string("n+1\0", 4), extensions = std::string(4, '\0'), data = "abcdefgh";

  template <class T>
  std::string Number(T value) const
  {
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    if (big == (__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__))
      std::reverse(bytes, bytes + sizeof(T));
    return std::string(bytes, sizeof(T));
  }
  std::string File() const
  {
    std::string h(348, '\0');
    const auto put = [&](std::size_t at, auto value) { h.replace(at, sizeof value, Number(value)); };
    put(0, 348);
    for (std::size_t i = 0; i < 8; ++i) {
      put(40 + 2 * i, dim[i]);
      put(76 + 4 * i, pixdim[i]);
    }
    put(70, datatype);
    put(108, offset);
    put(112, slope);
    put(116, intercept);
    h[123] = static_cast<char>(units);
    put(136, toffset);
    put(252, qform);
    put(254, sform);
    for (std::size_t i = 0; i < 6; ++i)
      put(256 + 4 * i, quaternion[i]);
    for (std::size_t i = 0; i < 12; ++i)
      put(280 + 4 * i, srow[i]);
    h.replace(344, 4, magic);
    return h + extensions + data;
  }
};

class NiftiFile : public TemporaryFolder {
protected:
  std::string Put(const std::string& name, const std::string& content) const { return TemporaryFolder::Put(name, content); }
  std::string Put(const ByHand& file, const std::string& name = "a.nii") const { return TemporaryFolder::Put(name, file.File()); }
  template <class T>
  std::vector<T> Voxels(VolumeSource& source, std::size_t index = 0) const
  {
    std::vector<T> voxels(source.Content().geometry.VoxelCount());
    EXPECT_EQ(sizeof(T), SizeOf(source.Content().type));
    source.Read(index, voxels.data(), nullptr);
    return voxels;
  }
  void Refused(const ByHand& file, const std::string& words, Error::Kind kind = Error::Kind::BadFile) const
  {
    const std::string path = Put(file, "bad.nii");
    ExpectRefused([&] { Voxels<unsigned char>(*OpenNifti(path)); }, kind, path, words);
  }
  double Write(const std::string& name, const ImageHeader& header, const void* voxels) const
  {
    FileReplacement files;
    const double loss = WriteVolume(Path(name), header, voxels, true, files);
    files.Commit();
    return loss;
  }
};

std::string Gzip(const std::string& plain)
{
  std::stringstream stream;
  Compress(stream, CompressedForm::Gzip, plain.data(), plain.size());
  return stream.str();
}

bool HasNote(const VolumeContent& content, const std::string& words)
{
  return std::any_of(content.notes.begin(), content.notes.end(),
                     [&](const std::string& note) { return note.find(words) != std::string::npos; });
}

const short CodeOfType[] = {256, 2, 4, 512, 8, 768, 1024, 1280, 16, 64};

} // namespace

TEST_F(NiftiFile, EveryTypeComesBackExactlyWithItsGeometry)
{
  for (const VoxelType type : AllTypes)
    for (const char* name : {"a.nii", "a.nii.gz", "A.NII.GZ"})
      DispatchVoxelType(type, [&](auto zero) {
        using T = decltype(zero);
        SCOPED_TRACE(name + std::to_string(static_cast<int>(type)));
        const ImageHeader wanted = Oblique(type);
        const std::vector<T> voxels = Values<T>(60);
        const double loss = Write(name, wanted, voxels.data());
        EXPECT_GT(loss, 1e-6); // floats near 14286 mm are 1 um apart
        EXPECT_LT(loss, 1e-3);
        EXPECT_EQ(FormatOfContent(Path(name)), FileFormat::Nifti);
        const auto source = OpenNifti(Path(name));
        const VolumeContent& content = source->Content();
        EXPECT_EQ(content.type, type);
        EXPECT_TRUE(content.notes.empty()) << content.notes[0];
        EXPECT_EQ(content.geometry.dimensions, wanted.geometry.dimensions);
        EXPECT_EQ(content.geometry.origin, wanted.geometry.origin);
        EXPECT_EQ(content.geometry.spacing, wanted.geometry.spacing);
        EXPECT_EQ(content.geometry.direction, wanted.geometry.direction);
        EXPECT_EQ(content.fields, wanted.fields);
        const std::vector<T> back = Voxels<T>(*source);
        EXPECT_EQ(std::memcmp(back.data(), voxels.data(), 60 * sizeof(T)), 0);
      });
}

TEST_F(NiftiFile, TheHeaderAloneHoldsTheGeometryAsFloats)
{
  // As every other program sees it: our extension removed, and with the qform alone.
  const ImageHeader wanted = Oblique(VoxelType::UInt8);
  const double loss = Write("a.nii", wanted, Values<unsigned char>(60).data());
  std::ifstream stream(Path("a.nii"), std::ios::binary);
  std::string file((std::istreambuf_iterator<char>(stream)), {});
  file[348] = 0;
  for (const bool qformAlone : {false, true}) {
    if (qformAlone)
      file[254] = 0; // sform_code
    const auto source = OpenNifti(Put("b.nii", file));
    const Eigen::Affine3d here = source->Content().geometry.IndexToWorld(), there = wanted.geometry.IndexToWorld();
    const Eigen::Vector3d far(4, 3, 2);
    EXPECT_LE((here * far - there * far).norm(), loss * (qformAlone ? 4.0 : 1.0));
    EXPECT_LE((here.translation() - there.translation()).norm(), loss);
    EXPECT_TRUE(source->Content().notes.empty());
  }
}

TEST_F(NiftiFile, ManySlicesNeedVersionTwo)
{
  ImageHeader header;
  header.geometry.dimensions = {40000, 1, 2};
  header.geometry.spacing = {0.1, 0.2, 0.3};
  const std::vector<unsigned char> voxels = Values<unsigned char>(80000);
  EXPECT_LT(Write("a.nii.gz", header, voxels.data()), 1e-9) << "version 2 stores doubles";
  const auto source = OpenNifti(Path("a.nii.gz"));
  EXPECT_EQ(source->Content().geometry.dimensions, header.geometry.dimensions);
  EXPECT_EQ(source->Content().geometry.spacing, header.geometry.spacing);
  EXPECT_EQ(Voxels<unsigned char>(*source), voxels);
}

TEST_F(NiftiFile, WhatAnotherProgramMovedStaysMoved)
{
  ImageHeader wanted = Oblique(VoxelType::UInt8);
  const std::vector<HeaderField> others = wanted.fields;
  wanted.fields.emplace_back("Echorama_ImageToWorld", "1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1");
  Write("a.nii", wanted, Values<unsigned char>(60).data());
  EXPECT_EQ(OpenVolume(Path("a.nii"))->Content().fields, wanted.fields);
  std::fstream stream(Path("a.nii"), std::ios::binary | std::ios::in | std::ios::out);
  const float x = 7.f; // srow_x, last
  stream.seekp(292);
  stream.write(reinterpret_cast<const char*>(&x), sizeof x);
  stream.close();
  const auto source = OpenVolume(Path("a.nii"));
  EXPECT_EQ(source->Content().fields, others);
  EXPECT_TRUE(HasNote(source->Content(), "ImageToWorld belonged to a geometry"));
  EXPECT_NEAR(source->Content().geometry.origin[0], -7.0, 1e-6);
  EXPECT_NEAR(source->Content().geometry.origin[1], wanted.geometry.origin[1], 1e-3);
  EXPECT_TRUE(HasNote(source->Content(), "another program"));
}

TEST_F(NiftiFile, BothByteOrdersOfEveryType)
{
  for (const VoxelType type : AllTypes)
    for (const bool big : {true, false})
      DispatchVoxelType(type, [&](auto zero) {
        using T = decltype(zero);
        ByHand file;
        file.big = big;
        file.datatype = CodeOfType[static_cast<int>(type)];
        const std::vector<T> voxels = Values<T>(8);
        file.data.clear();
        for (const T value : voxels)
          file.data += file.Number(value);
        const auto source = OpenNifti(Put(file));
        ASSERT_EQ(source->Content().type, type);
        const std::vector<T> back = Voxels<T>(*source);
        EXPECT_EQ(std::memcmp(back.data(), voxels.data(), 8 * sizeof(T)), 0) << file.datatype << big;
      });
}

TEST_F(NiftiFile, RasBecomesLpsAndLeftHandedAxesAreReversed)
{
  ByHand file;
  file.srow = {2, 0, 0, 10, 0, 3, 0, 20, 0, 0, 4, 30};
  auto source = OpenNifti(Put(file));
  const ImageGeometry& g = source->Content().geometry;
  EXPECT_EQ(g.origin, Eigen::Vector3d(-10, -20, 30));
  EXPECT_EQ(g.spacing, Eigen::Vector3d(2, 3, 4));
  EXPECT_EQ(g.direction, Eigen::Matrix3d(Eigen::Vector3d(-1, -1, 1).asDiagonal()));
  EXPECT_EQ(Voxels<char>(*source), (std::vector<char>{'a', 'b', 'c', 'd', 'e', 'f', 'g', 'h'}));

  // The usual storage of scanners: x runs to the left, so the axes are left-handed. The voxel at the RAS point stays there.
  file.srow = {-2, 0, 0, 10, 0, 3, 0, 20, 0, 0, 4, 30};
  source = OpenNifti(Put(file));
  const ImageGeometry& h = source->Content().geometry;
  EXPECT_GT(h.direction.determinant(), 0.99);
  EXPECT_EQ(h.origin, Eigen::Vector3d(-10, -20, 34));
  EXPECT_EQ(Voxels<char>(*source), (std::vector<char>{'e', 'f', 'g', 'h', 'a', 'b', 'c', 'd'}));
  EXPECT_TRUE(HasNote(source->Content(), "left-handed"));
}

TEST_F(NiftiFile, TheQformIsAQuaternionWithAMirror)
{
  ByHand file;
  file.sform = 0;
  file.qform = 1;
  const Eigen::Quaterniond q = Eigen::Quaterniond(0.5, 0.1, -0.7, 0.3).normalized();
  file.quaternion = {static_cast<float>(q.x()), static_cast<float>(q.y()), static_cast<float>(q.z()), 1, 2, 3};
  file.pixdim = {1, 2, 3, 4, 0, 0, 0, 0};
  auto source = OpenNifti(Put(file));
  Eigen::Matrix3d lps = q.toRotationMatrix();
  lps.topRows<2>() = -lps.topRows<2>().eval();
  EXPECT_LT((source->Content().geometry.direction - lps).norm(), 1e-6);
  EXPECT_LT((source->Content().geometry.spacing - Eigen::Vector3d(2, 3, 4)).norm(), 1e-9);
  EXPECT_LT((source->Content().geometry.origin - Eigen::Vector3d(-1, -2, 3)).norm(), 1e-9);

  file.pixdim[0] = -1; // the third axis of the file runs the other way: reversed, its origin is at its other end
  source = OpenNifti(Put(file));
  EXPECT_LT((source->Content().geometry.direction - lps).norm(), 1e-6);
  EXPECT_LT((source->Content().geometry.origin - (Eigen::Vector3d(-1, -2, 3) - 4.0 * lps.col(2))).norm(), 1e-5);
  EXPECT_EQ(Voxels<char>(*source)[0], 'e');

  file.sform = 2; // preferred
  EXPECT_EQ(OpenNifti(Put(file))->Content().geometry.spacing, Eigen::Vector3d(1, 1, 1));

  file.sform = file.qform = 0;
  source = OpenNifti(Put(file));
  EXPECT_TRUE(HasNote(source->Content(), "no pose"));
  EXPECT_EQ(source->Content().geometry.spacing, Eigen::Vector3d(2, 3, 4));
  EXPECT_EQ(source->Content().geometry.origin, Eigen::Vector3d(0, 0, 0));
}

TEST_F(NiftiFile, UnitsOfLength)
{
  ByHand file;
  for (const auto& [unit, factor] : {std::pair{1, 1000.0}, {2, 1.0}, {3, 0.001}}) {
    file.units = static_cast<unsigned char>(unit);
    file.srow[3] = 5;
    const auto source = OpenNifti(Put(file));
    EXPECT_NEAR(source->Content().geometry.spacing[1], factor, 1e-12);
    EXPECT_NEAR(source->Content().geometry.origin[0], -5.0 * factor, 1e-12);
  }
  file.units = 0;
  EXPECT_TRUE(HasNote(OpenNifti(Put(file))->Content(), "unit of length"));
  file.units = 5;
  Refused(file, "unit of length");
}

TEST_F(NiftiFile, SlicesAreThoseOfTheWhole)
{
  ByHand file;
  file.dim = {3, 3, 2, 9, 1, 1, 1, 1};
  file.datatype = 512; // unsigned short
  for (const bool big : {false, true})
    for (const float z : {1.0f, -1.0f}) // left-handed: slices are taken in reverse
      for (const float slope : {0.0f, 0.5f}) {
        file.big = big;
        file.slope = slope;
        file.srow[10] = z;
        file.data.clear();
        for (int i = 0; i < 54; ++i)
          file.data += file.Number(static_cast<unsigned short>(1000 + 7 * i));
        DispatchVoxelType(slope > 0.0f ? VoxelType::Float32 : VoxelType::UInt16, [&](auto zero) {
          using T = decltype(zero);
          const auto source = OpenNifti(Put(file));
          const std::vector<T> whole = Voxels<T>(*source);
          ASSERT_TRUE(source->ReadsSlices());
          for (const auto& [first, count] : {std::pair{0, 2}, {2, 3}, {8, 1}, {5, 4}, {0, 9}}) {
            std::vector<T> part(6 * static_cast<std::size_t>(count) + 1, T(4711));
            source->ReadSlices(0, first, count, part.data(), {});
            EXPECT_TRUE(std::equal(part.begin(), part.end() - 1, whole.begin() + 6 * first)) << first << " " << count;
            EXPECT_EQ(part.back(), T(4711));
          }
        });
      }
}

TEST_F(NiftiFile, StoredNumbersAreScaled)
{
  ByHand file;
  file.slope = 0.5f;
  file.intercept = -10.f;
  auto source = OpenNifti(Put(file));
  ASSERT_EQ(source->Content().type, VoxelType::Float32);
  const std::vector<float> floats = Voxels<float>(*source);
  for (std::size_t i = 0; i < 8; ++i)
    EXPECT_EQ(floats[i], 0.5f * static_cast<float>(file.data[i]) - 10.f);
  EXPECT_TRUE(HasNote(source->Content(), "times 0.5 plus -10"));

  for (const VoxelType type : AllTypes) // every width, in place
    DispatchVoxelType(type, [&](auto zero) {
      using T = decltype(zero);
      file.datatype = CodeOfType[static_cast<int>(type)];
      file.data.clear();
      for (int i = 0; i < 8; ++i)
        file.data += file.Number(static_cast<T>(i * 7));
      const auto scaled = OpenNifti(Put(file));
      const bool wide = scaled->Content().type == VoxelType::Float64;
      EXPECT_EQ(wide, sizeof(T) > 2 && type != VoxelType::Float32);
      const std::vector<double> doubles = wide ? Voxels<double>(*scaled) : std::vector<double>();
      const std::vector<float> singles = wide ? std::vector<float>() : Voxels<float>(*scaled);
      for (int i = 0; i < 8; ++i)
        EXPECT_EQ(wide ? doubles[static_cast<std::size_t>(i)] : singles[static_cast<std::size_t>(i)], 3.5 * i - 10.0);
    });

  file = ByHand();
  for (const float none : {0.f, NaN}) {
    file.slope = none;
    file.intercept = 3.f;
    EXPECT_EQ(OpenNifti(Put(file))->Content().type, VoxelType::UInt8);
  }
  file.slope = std::numeric_limits<float>::infinity();
  Refused(file, "not finite");
}

TEST_F(NiftiFile, TimeSeries)
{
  ByHand file;
  file.dim = {4, 2, 2, 2, 3, 1, 1, 1};
  file.pixdim[4] = 250;
  file.units = 2 | 16; // ms
  file.toffset = 500;
  file.data = "abcdefghijklmnopqrstuvwx";
  for (const bool compressed : {false, true}) {
    const auto source = OpenNifti(Put("a.nii", compressed ? Gzip(file.File()) : file.File()));
    EXPECT_EQ(source->Content().times, (std::vector<double>{0.5, 0.75, 1.0}));
    for (const std::size_t index : {2, 0, 1, 1, 2}) // also backwards
      EXPECT_EQ(Voxels<char>(*source, index)[0], "aiq"[index]);
  }
  file.units = 2;
  EXPECT_TRUE(HasNote(OpenNifti(Put(file))->Content(), "seconds"));
  file.pixdim[4] = 0;
  EXPECT_TRUE(HasNote(OpenNifti(Put(file))->Content(), "1 s was assumed"));
  EXPECT_EQ(OpenNifti(Put(file))->Content().times[2], 502.0);
  file.units = 2 | 32;
  Refused(file, "not time");
  file.units = 2 | 8;
  file.pixdim[4] = 1e-30f;
  Refused(file, "do not increase");
}

TEST_F(NiftiFile, EveryVolumeOfASeriesCanBeReadCoarsely)
{
  ByHand file;
  file.dim = {4, 3, 1, 5, 3, 1, 1, 1};
  file.pixdim[4] = 1;
  file.data.resize(45);
  std::iota(file.data.begin(), file.data.end(), '\0');
  VolumeReadParameters coarsely;
  coarsely.stride = 2;
  for (const float z : {1.0f, -1.0f}) // left-handed: slices are taken in reverse
    for (const bool compressed : {false, true}) {
      file.srow[10] = z;
      const std::string path = Put("a.nii", compressed ? Gzip(file.File()) : file.File());
      const auto whole = OpenVolume(path), coarse = OpenVolume(path, coarsely);
      for (const std::size_t index : {1, 2, 0, 2}) {
        const std::vector<char> all = Voxels<char>(*whole, index), wanted{all[0], all[2], all[6], all[8], all[12], all[14]};
        EXPECT_EQ(Voxels<char>(*coarse, index), wanted) << index;
        std::vector<char> slices(4);
        coarse->ReadSlices(index, 1, 2, slices.data());
        EXPECT_TRUE(std::equal(slices.begin(), slices.end(), wanted.begin() + 2)) << index;
        whole->ReadSlices(index, 2, 1, slices.data());
        EXPECT_EQ(slices[0], all[6]) << index;
      }
    }
}

TEST_F(NiftiFile, VolumesAreNoMoreThanTheFileCanHold)
{
  ByHand file;
  file.dim = {4, 1, 1, 1, 30000, 1, 1, 1};
  file.pixdim[4] = 1;
  file.data.assign(30000, '\0');
  const std::string packed = Gzip(file.File());
  ASSERT_LT(packed.size(), 1000u);
  EXPECT_EQ(OpenNifti(Put("few.nii.gz", packed))->Content().Volumes(), 30000u); // a few may always be

  // NIfTI-2: a million voxels would fit into so many compressed bytes, but their times would not.
  std::string h(544, '\0');
  const auto put = [&](std::size_t at, auto value) { h.replace(at, sizeof value, file.Number(value)); };
  put(0, 540);
  h.replace(4, 8, std::string("n+2\0\r\n\x1a\n", 8));
  put(12, short{2});
  put(14, short{8});
  const std::array<std::int64_t, 8> dim{4, 1, 1, 1, 1000000, 1, 1, 1};
  for (std::size_t i = 0; i < 8; ++i) {
    put(16 + 8 * i, dim[i]);
    put(104 + 8 * i, 1.0);
  }
  put(168, std::int64_t{544});
  put(500, 10);
  const std::string many = Put("many.nii.gz", Gzip(h + std::string(1000000, '\0')));
  ExpectRefused([&] { OpenNifti(many); }, Error::Kind::BadFile, many, "1000000 volumes, more than the bytes of the file");
  std::vector<std::uint8_t> random = Values<std::uint8_t>(1000000);
  EXPECT_EQ(OpenNifti(Put("real.nii.gz", Gzip(h + std::string(random.begin(), random.end()))))->Content().Volumes(), 1000000u);
}

TEST_F(NiftiFile, ReadingCoarselyTakesOneWayThroughACompressedFile)
{
  ByHand file;
  file.dim = {4, 64, 64, 41, 2, 1, 1, 1};
  file.pixdim[4] = 1;
  const std::vector<std::uint8_t> random = Values<std::uint8_t>(2 * 64 * 64 * 41); // compressing makes them no fewer
  file.data.assign(random.begin(), random.end());
  VolumeReadParameters coarsely;
  coarsely.stride = 2;
  for (const float z : {1.0f, -1.0f}) { // left-handed: slices are taken in reverse
    file.srow[10] = z;
    const auto coarse = OpenVolume(Put("a.nii.gz", Gzip(file.File())), coarsely);
    std::vector<std::uint8_t> found(32 * 32 * 21);
    const std::uint64_t read = BytesRead([&] {
      for (const std::size_t index : {0, 1})
        coarse->Read(index, found.data(), nullptr);
    });
    EXPECT_LT(read, 2 * file.data.size()) << z;
  }
}

TEST_F(NiftiFile, PairsOfHeaderAndImage)
{
  ByHand file;
  file.magic = std::string("ni1\0", 4);
  file.offset = 0;
  const std::string data = file.data;
  file.data.clear();
  const std::string path = Put(file, "a.hdr");
  ExpectRefused([&] { OpenNifti(path); }, Error::Kind::FileSystem, Path("a.img"), "no such file");
  Put("a.img", data);
  EXPECT_EQ(Voxels<char>(*OpenNifti(path))[7], 'h');
  std::filesystem::remove(Path("a.img"));
  Put("a.img.gz", Gzip(data));
  EXPECT_EQ(Voxels<char>(*OpenNifti(path))[7], 'h');
  Put("a.img", data.substr(1));
  ExpectRefused([&] { OpenNifti(path); }, Error::Kind::BadFile, Path("a.img"), "truncated");
  const std::string wrong = Put(file, "b.nii");
  ExpectRefused([&] { OpenNifti(wrong); }, Error::Kind::BadFile, wrong, ".hdr");
}

TEST_F(NiftiFile, ImagesAreVolumesOfOneSlice)
{
  ByHand file;
  file.dim = {2, 2, 2, 0, 0, 0, 0, 0};
  file.data = "abcd";
  EXPECT_EQ(OpenNifti(Put(file))->Content().geometry.dimensions, (std::array<int, 3>{2, 2, 1}));
  file.srow[10] = 0; // no thickness
  EXPECT_EQ(OpenNifti(Put(file))->Content().geometry.spacing, Eigen::Vector3d(1, 1, 1));
}

TEST_F(NiftiFile, ShearIsTakenWhenItIsRoundingAndRefusedWhenItIsNot)
{
  ByHand file;
  file.dim = {3, 100, 100, 1, 1, 1, 1, 1};
  file.data.assign(10000, 'x');
  file.srow[1] = 1e-6f;
  EXPECT_TRUE(OpenNifti(Put(file))->Content().notes.empty());
  file.srow[1] = 1e-3f; // 0.05 voxels between the nearest pose and the corner
  const auto source = OpenNifti(Put(file));
  EXPECT_TRUE(HasNote(source->Content(), "sheared"));
  const ImageGeometry& g = source->Content().geometry;
  EXPECT_TRUE(IsRotation(g.direction, 1e-12));
  EXPECT_LT((g.Centre() - Eigen::Vector3d(-49.5 * (1 + 1e-3), -49.5, 0.0)).norm(), 1e-5) << "the centre stays";
  file.srow[1] = 0.1f;
  Refused(file, "5.7");
  Refused(file, "sheared");
}

TEST_F(NiftiFile, Extensions)
{
  const auto extension = [](std::int32_t size, std::int32_t code, std::string text) {
    std::string bytes(8, '\0');
    std::memcpy(bytes.data(), &size, 4);
    std::memcpy(bytes.data() + 4, &code, 4);
    text.resize(static_cast<std::size_t>(std::max(8, std::min(size, 4096) - 8)), '\0');
    return bytes + text;
  };
  const auto with = [](const std::string& extensions) {
    ByHand file;
    file.extensions = std::string("\1\0\0\0", 4) + extensions;
    file.offset = 352.f + static_cast<float>(extensions.size());
    return file;
  };
  auto source = OpenNifti(Put(with(extension(32, 4, "<AFNI/>") + extension(16, 6, "note"))));
  EXPECT_TRUE(HasNote(source->Content(), "2 extensions"));
  EXPECT_EQ(Voxels<char>(*source)[0], 'a');
  Refused(with(extension(2000000000, 4, "")), "do not fit");
  Refused(with(extension(2000000000, 6, "Echorama volume")), "do not fit");
  Refused(with(extension(-16, 6, "")), "do not fit");
  Refused(with(extension(48, 6, "Echorama volume 1 2 three\n")), "damaged");
}

TEST_F(NiftiFile, BadFilesAreRefused)
{
  const ByHand good;
  Voxels<char>(*OpenNifti(Put(good)));
  ByHand bad = good;
  bad.data.pop_back();
  Refused(bad, "truncated");
  bad.data = good.data + "x";
  Refused(bad, "holds 361");
  const auto refuse = [&](auto change, const std::string& words) {
    ByHand file = good;
    change(file);
    Refused(file, words);
  };
  refuse([](ByHand& f) { f.dim[0] = 0; }, "dim[0]");
  refuse([](ByHand& f) { f.dim[0] = 8; }, "dim[0]");
  refuse([](ByHand& f) { f.dim[2] = -2; }, "dim[2]");
  refuse([](ByHand& f) { f.dim[2] = 0; }, "dim[2]");
  refuse([](ByHand& f) { f.dim = {3, 32767, 32767, 32767, 1, 1, 1, 1}; }, "truncated");
  refuse([](ByHand& f) { f.dim = {4, 2, 2, 2, 32767, 1, 1, 1}; }, "truncated");
  refuse([](ByHand& f) { f.dim = {5, 2, 2, 2, 1, 3, 1, 1}; }, "several numbers");
  refuse([](ByHand& f) { f.datatype = 128; }, "colours");
  refuse([](ByHand& f) { f.datatype = 32; }, "complex");
  refuse([](ByHand& f) { f.datatype = 1; }, "bits");
  refuse([](ByHand& f) { f.datatype = 1536; }, "128-bit");
  refuse([](ByHand& f) { f.datatype = 999; }, "unknown type");
  refuse([](ByHand& f) { f.magic = std::string(4, '\0'); }, "ANALYZE");
  refuse([](ByHand& f) { f.offset = 100; }, "inside the header");
  refuse([](ByHand& f) { f.offset = NaN; }, "vox_offset");
  refuse([](ByHand& f) { f.offset = 352.5f; }, "vox_offset");
  refuse([](ByHand& f) { f.offset = 2e9f; }, "truncated");
  refuse([](ByHand& f) { f.srow[0] = NaN; }, "not finite");
  refuse([](ByHand& f) { f.srow = {}; }, "singular");
  refuse([](ByHand& f) { f.srow = {1, 0, 1, 0, 0, 1, 0, 0, 1, 0, 1, 0}; }, "singular");
  refuse([](ByHand& f) { f.sform = 0, f.pixdim[2] = 0; }, "pixdim[2]");
  refuse([](ByHand& f) { f.sform = 0, f.pixdim[2] = NaN; }, "pixdim[2]");
  refuse([](ByHand& f) { f.sform = 0, f.qform = 1, f.quaternion = {NaN, 0, 0, 0, 0, 0}; }, "not finite");
  refuse([](ByHand& f) { f.sform = 0, f.qform = 1, f.quaternion = {2, 0, 0, 0, 0, 0}; }, "longer than 1");

  const std::string file = good.File();
  for (const std::size_t length : {4u, 100u, 347u}) {
    const std::string path = Put("short.nii", file.substr(0, length));
    ExpectRefused([&] { OpenNifti(path); }, Error::Kind::BadFile, path, "end early");
  }
  const std::string other = Put("other.nii", "this is text, and long enough");
  ExpectRefused([&] { OpenNifti(other); }, Error::Kind::BadFile, other, "not NIfTI");
  ExpectRefused([&] { OpenNifti(Path("missing.nii")); }, Error::Kind::FileSystem, Path("missing.nii"), "opened");
}

TEST_F(NiftiFile, DamagedCompressedFilesAreRefused)
{
  ByHand file;
  file.dim = {3, 20, 20, 20, 1, 1, 1, 1};
  Random random(2);
  file.data.clear();
  for (int i = 0; i < 8000; ++i)
    file.data.push_back(static_cast<char>(random.Bits()));
  const std::string packed = Gzip(file.File());
  const auto refused = [&](const std::string& content, const std::string& words) {
    const std::string path = Put("a.nii.gz", content);
    ExpectRefused([&] { Voxels<char>(*OpenNifti(path)); }, Error::Kind::BadFile, path, words);
  };
  for (const std::size_t length : {packed.size() / 2, packed.size() - 9, packed.size() - 1})
    refused(packed.substr(0, length), "end");
  std::string damaged = packed;
  damaged[damaged.size() - 6] = static_cast<char>(damaged[damaged.size() - 6] ^ 1);
  refused(damaged, "damaged");
  refused(Gzip(file.File() + "x"), "more than");
  file.dim = {3, 30000, 30000, 30000, 1, 1, 1, 1};
  refused(Gzip(file.File()), "compressed bytes can hold");
}

TEST_F(NiftiFile, RandomDamageNeverCrashes)
{
  ByHand file;
  file.extensions = std::string("\1\0\0\0", 4) + std::string("\40\0\0\0\6\0\0\0Echorama volume 1 2 3\n\0", 32);
  file.offset = 384;
  const std::string good = file.File();
  Random random(7);
  int opened = 0;
  for (int i = 0; i < 800; ++i) {
    std::string bad = good;
    for (std::uint64_t flips = 1 + random.Below(4); flips > 0; --flips)
      bad[random.Below(392)] = static_cast<char>(random.Bits());
    try {
      const auto source = OpenNifti(Put("a.nii", bad));
      std::vector<double> voxels(source->Content().geometry.VoxelCount());
      source->Read(0, voxels.data(), nullptr);
      ++opened;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(Path("a.")), std::string::npos) << error.what();
    }
  }
  EXPECT_GT(opened, 10);
}

TEST_F(NiftiFile, WhatCannotBeWritten)
{
  const std::vector<unsigned char> voxels(1000000, 9);
  const ImageHeader good = Oblique(VoxelType::UInt8);
  const auto refused = [&](const std::string& name, const ImageHeader& header, Error::Kind kind, const std::string& words) {
    ExpectRefused([&] { Write(name, header, voxels.data()); }, kind, Path(name), words);
    EXPECT_EQ(FileCount(), 0);
  };
  refused("a.img", good, Error::Kind::InvalidParameter, ".nii");
  refused("a.gz", good, Error::Kind::InvalidParameter, ".nii");
  refused("missing/a.nii", good, Error::Kind::FileSystem, "folder");
  ImageHeader bad = good;
  bad.geometry.direction.col(0) *= 2.0;
  refused("a.nii", bad, Error::Kind::BadInput, "direction");
  bad = good;
  bad.geometry.origin[0] = 1e200;
  refused("a.nii", bad, Error::Kind::BadInput, "32-bit");
  bad = good;
  bad.fields.emplace_back("two words", "2");
  refused("a.nii", bad, Error::Kind::BadInput, "two words");
  ImageHeader large = good;
  large.geometry.dimensions = {100, 100, 100};
  {
    const FullDisk full(100000);
    refused("a.nii", large, Error::Kind::FileSystem, "full");
  }
  const Progress stop([](double) { return false; });
  FileReplacement files;
  for (const char* name : {"b.nii", "b.nii.gz"})
    EXPECT_THROW(WriteVolume(Path(name), large, voxels.data(), true, files, stop), Error);
}

TEST_F(NiftiFile, CompanionsOfTwoExtensions)
{
  EXPECT_EQ(CompanionPath("/x/a.b.nii.gz", "ValidRegion"), "/x/a.b.ValidRegion.nii.gz");
  EXPECT_EQ(CompanionPath("a.nii", "ValidRegion"), "a.ValidRegion.nii");
  EXPECT_EQ(CompanionPath("A.NII.GZ", "ValidRegion"), "A.ValidRegion.NII.GZ");
}
