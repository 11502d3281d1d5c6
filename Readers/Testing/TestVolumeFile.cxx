// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/JoinedText.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Readers/ByteOrder.h"
#include "Readers/Compression.h"
#include "Readers/DataFile.h"
#include "Readers/Testing/Effort.h"
#include "Readers/Testing/ObliqueVolume.h"
#include "Readers/VolumeFile.h"
#include "Readers/VolumeSource.h"
#include "Readers/VolumeWriter.h"
#include "Testing/TemporaryFolder.h"
#include <algorithm>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>
#include <zlib.h>

using namespace echorama;
using namespace echorama::testing;

namespace {

class VolumeFile : public TemporaryFolder {
protected:
  void Write(const std::string& name, const ImageHeader& header, const void* voxels, bool compress = true) const
  {
    FileReplacement files;
    WriteVolume(Path(name), header, voxels, compress, files);
    files.Commit();
  }
  template <class T>
  std::vector<T> Read(const std::string& name) const
  {
    const ImageHeader header = ReadImageHeader(Path(name));
    CheckVolume(header);
    std::vector<T> voxels(header.geometry.VoxelCount());
    EXPECT_EQ(header.ByteCount(), voxels.size() * sizeof(T));
    ReadVoxels(header, voxels.data());
    return voxels;
  }
};

template <class T>
bool SameBits(const std::vector<T>& a, const std::vector<T>& b)
{
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

std::string Zlib(const std::string& plain)
{
  uLongf size = compressBound(static_cast<uLong>(plain.size()));
  std::string packed(size, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(plain.data()),
           static_cast<uLong>(plain.size()));
  packed.resize(size);
  return packed;
}

} // namespace

TEST_F(VolumeFile, EveryTypeFormatAndCompressionComesBack)
{
  for (const VoxelType type : AllTypes)
    for (const char* name : {"a.mha", "a.mhd", "a.nrrd", "a.nhdr"})
      for (const bool compressed : {true, false})
        DispatchVoxelType(type, [&](auto zero) {
          using T = decltype(zero);
          SCOPED_TRACE(std::string(name) + (compressed ? " compressed " : " plain ") + std::to_string(static_cast<int>(type)));
          const ImageHeader wanted = Oblique(type);
          const std::vector<T> voxels = Values<T>(60);
          Write(name, wanted, voxels.data(), compressed);
          EXPECT_TRUE(SameBits(Read<T>(name), voxels));
          const ImageHeader header = ReadImageHeader(Path(name));
          EXPECT_EQ(header.type, type);
          EXPECT_EQ(header.fields, wanted.fields);
          EXPECT_TRUE(header.notes.empty());
          EXPECT_EQ(header.geometry.dimensions, wanted.geometry.dimensions);
          EXPECT_EQ(header.geometry.origin, wanted.geometry.origin);
          if (header.format == FileFormat::MetaImage) {
            EXPECT_EQ(header.geometry.spacing, wanted.geometry.spacing);
            EXPECT_EQ(header.geometry.direction, wanted.geometry.direction);
          } else { // NRRD stores their product
            EXPECT_LT((header.geometry.spacing - wanted.geometry.spacing).norm(), 1e-15);
            EXPECT_LT((header.geometry.direction - wanted.geometry.direction).norm(), 1e-15);
          }
        });
}

TEST_F(VolumeFile, PosesOfAnotherGeometryAreLeftOut)
{
  ImageHeader header = Oblique(VoxelType::UInt8);
  const std::vector<HeaderField> others = header.fields;
  header.fields.emplace_back("Echorama_ProbeToWorld", "1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1");
  for (const auto& [name, origin] : {std::pair("a.mha", "Offset = "), std::pair("a.nrrd", "space origin: (")}) {
    Write(name, header, Values<unsigned char>(60).data(), false);
    VolumeReadParameters parameters;
    for (parameters.stride = 1; parameters.stride < 3; ++parameters.stride)
      EXPECT_EQ(OpenVolume(Path(name), parameters)->Content().fields, header.fields) << name;
    std::stringstream bytes;
    bytes << std::ifstream(Path(name), std::ios::binary).rdbuf();
    std::string moved = bytes.str();
    moved.insert(moved.find(origin) + std::string(origin).size(), "1"); // 1 mm and more
    Put(name, moved);
    const auto source = OpenVolume(Path(name));
    EXPECT_EQ(source->Content().fields, others) << name;
    ASSERT_EQ(source->Content().notes.size(), 1u);
    EXPECT_EQ(source->Content().notes[0].find("ProbeToWorld belonged to a geometry"), 0u);
  }
}

TEST_F(VolumeFile, BothByteOrdersOfEveryType)
{
  const char* metaNames[] = {"MET_CHAR", "MET_UCHAR",     "MET_SHORT",      "MET_USHORT", "MET_INT",
                             "MET_UINT", "MET_LONG_LONG", "MET_ULONG_LONG", "MET_FLOAT",  "MET_DOUBLE"};
  const char* nrrdNames[] = {"signed char", "uchar", "short", "unsigned short int", "int32_t", "uint", "long long int",
                             "uint64",      "float", "double"};
  for (const VoxelType type : AllTypes)
    for (const bool big : {true, false})
      DispatchVoxelType(type, [&](auto zero) {
        using T = decltype(zero);
        const std::vector<T> voxels = Values<T>(8);
        std::string bytes;
        for (const T value : voxels) {
          char one[sizeof(T)];
          std::memcpy(one, &value, sizeof(T));
          if (big == (__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__))
            std::reverse(one, one + sizeof(T));
          bytes.append(one, sizeof(T));
        }
        const int t = static_cast<int>(type);
        Put("a.mha", std::string("NDims = 3\nDimSize = 2 2 2\nElementType = ") + metaNames[t] +
                         "\nElementByteOrderMSB = " + (big ? "True" : "False") + "\nElementDataFile = LOCAL\n" + bytes);
        EXPECT_TRUE(SameBits(Read<T>("a.mha"), voxels)) << metaNames[t] << big;
        Put("a.nrrd", std::string("NRRD0001\ntype: ") + nrrdNames[t] +
                          "\ndimension: 3\nsizes: 2 2 2\nencoding: raw\nendian: " + (big ? "big" : "little") + "\n\n" + bytes);
        EXPECT_TRUE(SameBits(Read<T>("a.nrrd"), voxels)) << nrrdNames[t] << big;
      });
}

TEST_F(VolumeFile, VoxelsMayLieElsewhere)
{
  const std::string bytes = "abcdefgh", meta = "NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\n",
                    nrrd = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\n";
  const std::vector<char> wanted(bytes.begin(), bytes.end());
  std::filesystem::create_directories(folder / "sub");
  Put("sub/plain.raw", bytes);
  Put("sub/late.raw", "12345" + bytes);
  Put("sub/lines.raw", "one\ntwo\n12" + bytes);
  Put("sub/late.gz", Zlib("12345" + bytes));
  Put("a.mhd", meta + "ElementDataFile = sub/plain.raw\n");
  EXPECT_EQ(Read<char>("a.mhd"), wanted);
  Put("a.mhd", meta + "ElementDataFile = " + Path("sub/plain.raw"));
  EXPECT_EQ(Read<char>("a.mhd"), wanted) << "an absolute path, no end of line";
  Put("a.mhd", meta + "HeaderSize = 5\nElementDataFile = sub/late.raw\n");
  EXPECT_EQ(Read<char>("a.mhd"), wanted);
  Put("a.mhd", meta + "HeaderSize = -1\nElementDataFile = sub/late.raw\n");
  EXPECT_EQ(Read<char>("a.mhd"), wanted);
  Put("a.nhdr", nrrd + "encoding: raw\nline skip: 2\nbyte skip: 2\ndata file: sub/lines.raw\n");
  EXPECT_EQ(Read<char>("a.nhdr"), wanted);
  Put("a.nhdr", nrrd + "encoding: raw\nbyteskip: -1\ndatafile: sub/late.raw\n\n");
  EXPECT_EQ(Read<char>("a.nhdr"), wanted);
  Put("a.nhdr", nrrd + "encoding: gzip\nbyte skip: 5\ndata file: sub/late.gz\n");
  EXPECT_EQ(Read<char>("a.nhdr"), wanted) << "bytes are skipped after decompression";
}

TEST_F(VolumeFile, VoxelsAsText)
{
  const std::string start = "NDims = 3\nDimSize = 2 2 1\nBinaryData = False\nElementType = ",
                    local = "\nElementDataFile = LOCAL\n";
  Put("a.mha", start + "MET_SHORT" + local + "1 -32768\n32767 4.0\n");
  EXPECT_EQ(Read<short>("a.mha"), (std::vector<short>{1, -32768, 32767, 4}));
  Put("a.nrrd", "NRRD0001\ntype: float\ndimension: 2\nsizes: 2 2\nencoding: ascii\n\n0.5 -1e3\nnan 7");
  const std::vector<float> floats = Read<float>("a.nrrd");
  EXPECT_EQ(floats[0], 0.5f);
  EXPECT_EQ(floats[1], -1000.f);
  EXPECT_TRUE(std::isnan(floats[2]));

  const auto refused = [&](const std::string& type, const std::string& numbers, const std::string& words) {
    const std::string path = Put("b.mha", start + type + local + numbers);
    ExpectRefused([&] { Read<short>("b.mha"); }, Error::Kind::BadFile, path, words);
  };
  refused("MET_SHORT", "1 2 3", "characters can hold");
  refused("MET_SHORT", "1000 2000 3000", "after 3 of 4");
  refused("MET_SHORT", "1 2 3 4 5", "more numbers");
  refused("MET_SHORT", "1 2 3 32768", "32768");
  refused("MET_SHORT", "1 2 3 4.5", "4.5");
  refused("MET_SHORT", "1 2 3 four", "four");
}

TEST_F(VolumeFile, CompressionIsOrdinaryAndIndependentOfThreads)
{
  // Several blocks, the last one shorter; runs and noise, so that blocks refer to their predecessors.
  std::string plain;
  Random random(3);
  while (plain.size() < 5500000)
    plain += random.Bits() % 2 ? std::string(random.Bits() % 300, 'a') : NumberText(random.Uniform());
  for (const CompressedForm form : {CompressedForm::Zlib, CompressedForm::Gzip}) {
    std::string packed[2];
    for (const int threads : {1, 2}) {
      const ThreadLimit limit(threads);
      std::stringstream stream;
      const std::uint64_t size = Compress(stream, form, plain.data(), plain.size());
      packed[threads - 1] = stream.str();
      EXPECT_EQ(size, packed[threads - 1].size());
    }
    EXPECT_EQ(packed[0], packed[1]);
    EXPECT_LT(packed[0].size(), plain.size() / 2);
    // zlib itself reads it in one go, checksum and all.
    z_stream z{};
    ASSERT_EQ(inflateInit2(&z, form == CompressedForm::Gzip ? 31 : 15), Z_OK);
    std::string out(plain.size() + 1, '\0');
    z.next_in = reinterpret_cast<Bytef*>(packed[0].data());
    z.avail_in = static_cast<uInt>(packed[0].size());
    z.next_out = reinterpret_cast<Bytef*>(out.data());
    z.avail_out = static_cast<uInt>(out.size());
    EXPECT_EQ(inflate(&z, Z_FINISH), Z_STREAM_END);
    EXPECT_EQ(z.avail_in, 0u);
    EXPECT_EQ(out.substr(0, z.total_out), plain);
    inflateEnd(&z);
    std::stringstream stream(packed[0]);
    std::string back(plain.size(), '\0');
    Decompress(stream, "test", 0, back.data(), back.size());
    EXPECT_EQ(back, plain);
  }
  // A gzip file of two members.
  std::stringstream two;
  Compress(two, CompressedForm::Gzip, plain.data(), 1000);
  Compress(two, CompressedForm::Gzip, plain.data() + 1000, 500);
  std::string back(1500, '\0');
  Decompress(two, "test", 0, back.data(), back.size());
  EXPECT_EQ(back, plain.substr(0, 1500));
}

TEST_F(VolumeFile, DamagedCompressedDataAreRefused)
{
  const std::string start =
      "NDims = 3\nDimSize = 10 10 20\nElementType = MET_UCHAR\nCompressedData = True\nElementDataFile = LOCAL\n";
  std::string plain;
  Random random(11);
  for (int i = 0; i < 2000; ++i)
    plain.push_back(static_cast<char>(random.Bits()));
  const std::string packed = Zlib(plain);
  const auto refused = [&](const std::string& data, const std::string& words) {
    const std::string path = Put("a.mha", start + data);
    ExpectRefused([&] { Read<char>("a.mha"); }, Error::Kind::BadFile, path, words);
  };
  Put("a.mha", start + packed);
  EXPECT_EQ(Read<char>("a.mha"), std::vector<char>(plain.begin(), plain.end()));
  refused("", "compressed bytes can hold");
  refused(packed.substr(0, 1), "compressed bytes can hold");
  for (const std::size_t length : {std::size_t{2}, packed.size() / 2, packed.size() - 4, packed.size() - 1})
    refused(packed.substr(0, length), "end early");
  refused(Zlib(plain.substr(0, 1999)), "end early");
  refused(Zlib(plain + "x"), "more than the dimensions say");
  std::string damaged = packed;
  damaged[damaged.size() - 2] = static_cast<char>(damaged[damaged.size() - 2] ^ 1);
  refused(damaged, "damaged");
  refused(plain, "damaged");
  // Dimensions out of all proportion are refused before any memory is asked for.
  const std::string path = Put("b.mha", "NDims = 3\nDimSize = 100000 100000 100000\nElementType = MET_DOUBLE\n"
                                        "CompressedData = True\nElementDataFile = LOCAL\n" +
                                            packed);
  ExpectRefused([&] { CheckVolume(ReadImageHeader(path)); }, Error::Kind::BadFile, path, "compressed bytes can hold");
}

TEST_F(VolumeFile, MoreThanTheMemoryIsRefused)
{
  ExpectRefused([] { CheckMemory("big.mha", 1e17); }, Error::Kind::TooLarge, "big.mha", "memory");
  EXPECT_NO_THROW(CheckMemory("small.mha", 1e6));
  // A sparse file holds what its header says, and still would not fit.
  const std::string path =
      Put("a.mhd", "NDims = 3\nDimSize = 20000 20000 20000\nElementType = MET_UCHAR\nElementDataFile = a.raw\n");
  Put("a.raw", "");
  std::error_code error;
  std::filesystem::resize_file(Path("a.raw"), 8000000000000u, error);
  if (error)
    GTEST_SKIP() << "this file system holds no sparse files of 8 TB";
  ExpectRefused([&] { CheckVolume(ReadImageHeader(path)); }, Error::Kind::TooLarge, path, "memory");
}

TEST_F(VolumeFile, SlicesAreThoseOfTheWhole)
{
  ImageHeader header;
  header.type = VoxelType::UInt16;
  header.geometry.dimensions = {7, 5, 11};
  const std::size_t slice = 7 * 5;
  const std::vector<std::uint16_t> written = Values<std::uint16_t>(slice * 11);
  std::vector<std::string> files{"a.mha", "b.mha", "a.mhd", "b.nrrd", "a.nhdr"};
  for (const std::string& name : files)
    Write(name, header, written.data(), name[0] == 'a');
  // Left-handed, so that slices are taken in reverse, and of the other byte order; plain and compressed, before the end of the
  // file.
  std::string bytes(reinterpret_cast<const char*>(written.data()), written.size() * 2);
  for (std::size_t at = 0; at < bytes.size(); at += 2)
    std::swap(bytes[at], bytes[at + 1]);
  const std::string left = "NDims = 3\nTransformMatrix = 1 0 0 0 1 0 0 0 -1\nDimSize = 7 5 11\nElementType = MET_USHORT\n"
                           "BinaryDataByteOrderMSB = " +
                           std::string(HostIsBigEndian ? "False" : "True") + "\n";
  Put("left.mha", left + "ElementDataFile = LOCAL\n" + bytes);
  Put("packed.mha", left + "CompressedData = True\nElementDataFile = LOCAL\n" + Zlib(bytes));
  Put("left.mhd", left + "HeaderSize = -1\nElementDataFile = left.raw\n");
  Put("left.raw", "leading bytes" + bytes);
  for (const char* name : {"left.mha", "packed.mha", "left.mhd"})
    files.push_back(name);
  for (const std::string& name : files) {
    SCOPED_TRACE(name);
    const std::vector<std::uint16_t> whole = Read<std::uint16_t>(name);
    EXPECT_EQ(whole == written, name.substr(0, 4) != "left" && name[0] != 'p');
    const auto source = OpenVolume(Path(name));
    ASSERT_TRUE(source->ReadsSlices());
    for (const auto& [first, count] : {std::pair{0, 2}, {2, 3}, {5, 6}, {4, 1}, {10, 1}, {0, 11}, {3, 3}}) { // on, back, and over
      std::vector<std::uint16_t> part(slice * static_cast<std::size_t>(count) + 1, 4711);
      source->ReadSlices(0, first, count, part.data());
      EXPECT_TRUE(std::equal(part.begin(), part.end() - 1, whole.begin() + static_cast<std::ptrdiff_t>(slice) * first))
          << first << " " << count;
      EXPECT_EQ(part.back(), 4711);
    }
    // One of three along each axis: x 0, 3, 6; y 0, 3; z 0, 3, 6, 9.
    VolumeReadParameters coarsely;
    coarsely.stride = 3;
    const auto coarse = OpenVolume(Path(name), coarsely);
    const ImageGeometry& geometry = coarse->Content().geometry;
    EXPECT_EQ(geometry.dimensions, (std::array<int, 3>{3, 2, 4}));
    const Eigen::Vector3d last(2, 1, 3);
    EXPECT_LT((geometry.IndexToWorld() * last - source->Content().geometry.IndexToWorld() * (3.0 * last)).norm(), 1e-12);
    std::vector<std::uint16_t> wanted, found(24), some(12);
    for (std::size_t k = 0; k < 11; k += 3)
      for (std::size_t j = 0; j < 5; j += 3)
        for (std::size_t i = 0; i < 7; i += 3)
          wanted.push_back(whole[(k * 5 + j) * 7 + i]);
    coarse->Read(0, found.data(), nullptr);
    EXPECT_EQ(found, wanted);
    coarse->ReadSlices(0, 1, 2, some.data());
    EXPECT_TRUE(std::equal(some.begin(), some.end(), wanted.begin() + 6));
  }
  Put("text.nrrd", "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 1 1 2\nencoding: ascii\n\n1 2\n");
  const auto text = OpenVolume(Path("text.nrrd"));
  EXPECT_FALSE(text->ReadsSlices());
  EXPECT_THROW(text->ReadSlices(0, 0, 1, nullptr), Error);
  VolumeReadParameters coarsely;
  coarsely.stride = 2;
  ExpectRefused([&] { OpenVolume(Path("text.nrrd"), coarsely); }, Error::Kind::NotPossible, Path("text.nrrd"), "Stride");
  coarsely.stride = 0;
  EXPECT_EQ(OpenVolume(Path("text.nrrd"), coarsely)->Content().geometry.dimensions, (std::array<int, 3>{1, 1, 2}));
}

TEST_F(VolumeFile, ReadingCoarselyTakesOneWayThroughACompressedFile)
{
  std::string bytes(64 * 64 * 41, '\0');
  const std::vector<std::uint8_t> random = Values<std::uint8_t>(bytes.size()); // compressing makes them no fewer
  std::copy(random.begin(), random.end(), bytes.begin());
  VolumeReadParameters coarsely;
  coarsely.stride = 2;
  for (const std::string z : {"1", "-1"}) { // left-handed: slices are taken in reverse
    const std::string path = Put("a.mha", "NDims = 3\nTransformMatrix = 1 0 0 0 1 0 0 0 " + z +
                                              "\nDimSize = 64 64 41\nElementType = MET_UCHAR\nCompressedData = True\n"
                                              "ElementDataFile = LOCAL\n" +
                                              Zlib(bytes));
    const auto coarse = OpenVolume(path, coarsely);
    std::vector<std::uint8_t> found(32 * 32 * 21);
    EXPECT_LT(BytesRead([&] { coarse->Read(0, found.data(), nullptr); }), 2 * bytes.size()) << z;
    EXPECT_LT(BytesRead([&] { coarse->ReadSlices(0, 1, 20, found.data()); }), 2 * bytes.size()) << z;
  }
}

TEST_F(VolumeFile, StrideZeroLeavesAVolumeForAFirstLook)
{
  VolumeReadParameters coarsely;
  coarsely.stride = 0;
  const auto dimensionsOf = [&](int x) {
    const std::string size = std::to_string(x) + " 400 400";
    Put("large.mhd", "NDims = 3\nDimSize = " + size + "\nElementType = MET_UCHAR\nElementDataFile = large.raw\n");
    Put("large.raw", "");
    std::filesystem::resize_file(Path("large.raw"), static_cast<std::uintmax_t>(x) * 160000);
    const auto source = OpenVolume(Path("large.mhd"), coarsely);
    EXPECT_EQ(Joined(source->Content().notes, " ").find("one of") == std::string::npos, x == 800);
    return source->Content().geometry.dimensions;
  };
  EXPECT_EQ(dimensionsOf(800), (std::array<int, 3>{800, 400, 400})); // 128 million: as many as may be
  EXPECT_EQ(dimensionsOf(801), (std::array<int, 3>{401, 200, 200}));
  EXPECT_EQ(dimensionsOf(20000), (std::array<int, 3>{6667, 134, 134})); // a stride of 2 would leave 400 million
}

TEST_F(VolumeFile, AFullDiskLeavesWhatWasThere)
{
  ImageHeader header;
  header.geometry.dimensions = {100, 100, 100};
  const std::vector<unsigned char> old(1000000, 7);
  std::vector<unsigned char> fresh(1000000);
  Random random(1);
  for (unsigned char& value : fresh)
    value = static_cast<unsigned char>(random.Bits());
  for (const char* name : {"a.mha", "b.mhd", "c.nrrd", "d.nhdr"})
    for (const bool compressed : {true, false}) {
      SCOPED_TRACE(name);
      Write(name, header, old.data(), compressed);
      const int files = FileCount();
      {
        const FullDisk full(300000);
        ExpectRefused([&] { Write(name, header, fresh.data(), compressed); }, Error::Kind::FileSystem, Path(name), "full");
      }
      EXPECT_EQ(FileCount(), files);
      EXPECT_EQ(Read<unsigned char>(name), old);
    }
}

TEST_F(VolumeFile, WhatCannotBeWritten)
{
  const std::vector<unsigned char> voxels(60);
  const ImageHeader good = Oblique(VoxelType::UInt8);
  const auto refused = [&](const std::string& name, const ImageHeader& header, Error::Kind kind, const std::string& words) {
    ExpectRefused([&] { Write(name, header, voxels.data()); }, kind, Path(name), words);
    EXPECT_EQ(FileCount(), 0);
  };
  refused("a.png", good, Error::Kind::InvalidParameter, ".mha");
  refused("a", good, Error::Kind::InvalidParameter, ".mha");
  refused("missing/a.mha", good, Error::Kind::FileSystem, "folder");
  ImageHeader bad = good;
  bad.geometry.direction.col(0) *= 2.0;
  refused("a.mha", bad, Error::Kind::BadInput, "direction");
  bad = good;
  bad.fields.emplace_back("NDims", "2");
  refused("a.nrrd", bad, Error::Kind::BadInput, "NDims");
}

TEST_F(VolumeFile, NamesThatAHeaderCannotName)
{
  const std::vector<unsigned char> voxels(60, 7);
  const ImageHeader header = Oblique(VoxelType::UInt8);
  for (const std::string name : {"two\nlines", "two\rlines", " blank", "half\tblank", "100%", "%d", "LIST", "LISTS"}) {
    for (const std::string extension : {".mhd", ".nhdr"})
      for (const bool compress : {false, true}) {
        ExpectRefused([&] { Write(name + extension, header, voxels.data(), compress); }, Error::Kind::InvalidParameter,
                      extension + ": its header", "not found again"); // control characters of the name are told as numbers
        EXPECT_EQ(FileCount(), 0) << name;
      }
    for (const std::string extension : {".mha", ".nrrd"}) { // these hold their voxels
      Write(name + extension, header, voxels.data());
      EXPECT_TRUE(SameBits(Read<unsigned char>(name + extension), voxels)) << name << extension;
      std::filesystem::remove(Path(name + extension));
    }
  }
  for (const std::string name : {"in the middle", "at its end ", "a=b: c;#", "aLIST", "LOCAL", "\303\244"})
    for (const std::string extension : {".mhd", ".nhdr"}) {
      Write(name + extension, header, voxels.data(), false);
      EXPECT_TRUE(SameBits(Read<unsigned char>(name + extension), voxels)) << name << extension;
    }
}

TEST_F(VolumeFile, PiecesMakeTheSameFile)
{
  ImageHeader header = Oblique(VoxelType::UInt16);
  header.geometry.dimensions = {131, 97, 60};
  const std::vector<std::uint16_t> voxels = Values<std::uint16_t>(header.geometry.VoxelCount());
  const auto* bytes = reinterpret_cast<const char*>(voxels.data());
  const auto content = [this](const std::string& name) {
    std::stringstream text;
    text << std::ifstream(Path(name), std::ios::binary).rdbuf();
    return text.str();
  };
  for (const std::string extension : {".mha", ".mhd", ".nrrd", ".nhdr", ".nii", ".nii.gz"})
    for (const bool compress : {true, false}) {
      Write("a" + extension, header, voxels.data(), compress);
      const std::string data = extension == ".mhd"    ? (compress ? "a.zraw" : "a.raw")
                               : extension == ".nhdr" ? (compress ? "a.raw.gz" : "a.raw")
                                                      : "a" + extension;
      const std::string whole = content("a" + extension), wholeData = content(data);
      for (const std::uint64_t piece : {std::uint64_t{1000003}, std::uint64_t{131 * 97 * 2}}) {
        FileReplacement files;
        VolumeWriter writer(Path("a" + extension), header, compress, files);
        for (std::uint64_t done = 0; done < header.ByteCount(); done += piece)
          writer.Append(bytes + done, std::min(piece, header.ByteCount() - done));
        writer.Finish();
        files.Commit();
        EXPECT_TRUE(content("a" + extension) == whole) << extension;
        EXPECT_TRUE(content(data) == wholeData) << extension;
      }
    }
  const std::size_t count = FileCount();
  FileReplacement files;
  VolumeWriter writer(Path("b.mhd"), header, true, files);
  writer.Append(bytes, 1000);
  EXPECT_THROW(writer.Finish(), Error); // most of it is missing
  writer.Discard();
  EXPECT_EQ(FileCount(), count);
}

TEST_F(VolumeFile, StopsOnRequest)
{
  ImageHeader header;
  header.geometry.dimensions = {256, 256, 600};
  const std::vector<unsigned char> voxels(256 * 256 * 600, 3);
  Write("a.mha", header, voxels.data());
  const Progress stop([](double fraction) { return fraction < 0.4; });
  std::vector<unsigned char> back(voxels.size());
  EXPECT_THROW(ReadVoxels(ReadImageHeader(Path("a.mha")), back.data(), stop), Error);
  {
    FileReplacement files;
    EXPECT_THROW(WriteVolume(Path("b.mha"), header, voxels.data(), true, files, stop), Error);
    EXPECT_THROW(WriteVolume(Path("b.mha"), header, voxels.data(), false, files, stop), Error);
  }
  EXPECT_EQ(FileCount(), 1);
}

TEST_F(VolumeFile, CompanionsHaveTheNameInTheMiddle)
{
  EXPECT_EQ(CompanionPath("/x/a.b.mha", "ValidRegion"), "/x/a.b.ValidRegion.mha");
  EXPECT_EQ(CompanionPath("a.nrrd", "Provenance"), "a.Provenance.nrrd");
}
