// SPDX-License-Identifier: BSD-3-Clause
// Elements byte by byte, for what no library writes: lengths that lie, sequences without an end. Objects of all kinds are
// read in TestDicom.py.
#include "Core/Base/Random.h"
#include "Core/Sharing/IsolatedTask.h"
#include "Readers/DicomFile.h"
#include "Readers/DicomHeader.h"
#include "Testing/TemporaryFolder.h"
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmImageReader.h>
#include <gdcmImageWriter.h>
#include <jpeglib.h>
#include <sys/stat.h>
#include <zlib.h>

using namespace echorama;
using namespace echorama::testing;

namespace {

std::string Number(std::uint64_t value, int bytes)
{
  std::string text;
  for (int i = 0; i < bytes; ++i)
    text += static_cast<char>(value >> 8 * i & 0xFF);
  return text;
}

std::string Tag(int group, int element)
{
  return Number(static_cast<std::uint64_t>(group), 2) + Number(static_cast<std::uint64_t>(element), 2);
}

// An element in explicit little endian, of the length that is said.
std::string Element(int group, int element, const std::string& type, const std::string& value, std::uint32_t length)
{
  const bool isLong = std::string("OB OW SQ UN UT").find(type) != std::string::npos;
  return Tag(group, element) + type + (isLong ? std::string(2, '\0') + Number(length, 4) : Number(length, 2)) + value;
}

std::string Element(int group, int element, const std::string& type, std::string value)
{
  if (value.size() % 2)
    value += type == "UI" ? '\0' : ' ';
  return Element(group, element, type, value, static_cast<std::uint32_t>(value.size()));
}

std::string Item(const std::string& value, std::uint32_t length)
{
  return Tag(0xFFFE, 0xE000) + Number(length, 4) + value;
}

std::string StartOf(const std::string& syntax)
{
  const std::string element = Element(2, 0x10, "UI", syntax);
  return std::string(128, '\0') + "DICM" + Element(2, 0, "UL", Number(element.size(), 4)) + element;
}

const std::string Start = StartOf("1.2.840.10008.1.2.1");
constexpr std::uint32_t Undefined = 0xFFFFFFFF;
const std::string EndOfItem = Tag(0xFFFE, 0xE00D) + Number(0, 4), EndOfSequence = Tag(0xFFFE, 0xE0DD) + Number(0, 4);

// A slice of 8 x 6 pixels that count up from k.
std::string Slice(int k, int bits = 8, const std::string& along = "")
{
  std::string pixels;
  for (int i = 0; i < 48; ++i)
    pixels += Number(static_cast<std::uint64_t>(i * 5 + k), bits / 8);
  return Element(8, 0x16, "UI", "1.2.840.10008.5.1.4.1.1.6.1") + Element(8, 0x18, "UI", "1.2.3." + std::to_string(k)) +
         Element(8, 0x60, "CS", "US") + Element(0x20, 0xE, "UI", "1.2.3") +
         Element(0x20, 0x32, "DS", "1.5\\-2.5\\" + (along.empty() ? std::to_string(3 + 2 * k) : along)) +
         Element(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0") + Element(0x28, 2, "US", Number(1, 2)) +
         Element(0x28, 4, "CS", "MONOCHROME2") + Element(0x28, 0x10, "US", Number(6, 2)) +
         Element(0x28, 0x11, "US", Number(8, 2)) + Element(0x28, 0x30, "DS", "0.5\\0.25") +
         Element(0x28, 0x100, "US", Number(static_cast<unsigned>(bits), 2)) +
         Element(0x28, 0x101, "US", Number(static_cast<unsigned>(bits), 2)) +
         Element(0x28, 0x102, "US", Number(static_cast<unsigned>(bits - 1), 2)) + Element(0x28, 0x103, "US", Number(0, 2)) +
         Element(0x7FE0, 0x10, bits == 8 ? "OB" : "OW", pixels);
}

std::string Deflated(const std::string& elements)
{
  z_stream z{};
  deflateInit2(&z, 9, Z_DEFLATED, -MAX_WBITS, 9, Z_DEFAULT_STRATEGY);
  std::string packed(deflateBound(&z, elements.size()), '\0');
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(elements.data()));
  z.avail_in = static_cast<uInt>(elements.size());
  z.next_out = reinterpret_cast<Bytef*>(packed.data());
  z.avail_out = static_cast<uInt>(packed.size());
  EXPECT_EQ(deflate(&z, Z_FINISH), Z_STREAM_END);
  packed.resize(z.total_out);
  deflateEnd(&z);
  return StartOf("1.2.840.10008.1.2.1.99") + packed;
}

// A JPEG of 16 x 16 equal pixels, one number each or three (red, green, blue), which are stored as another space.
struct Jpeg {
  std::string colour = "\xC8\x32\x14"; // 200, 50, 20, whose luminance is 91
  J_COLOR_SPACE stored = JCS_YCbCr;
  bool jfif = false, adobe = false, coarse = false;

  std::string Bytes() const
  {
    jpeg_compress_struct jpeg;
    jpeg_error_mgr errors;
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    unsigned char* bytes = nullptr;
    unsigned long count = 0;
    jpeg_mem_dest(&jpeg, &bytes, &count);
    jpeg.image_width = jpeg.image_height = 16;
    jpeg.input_components = static_cast<int>(colour.size());
    jpeg.in_color_space = colour.size() == 1 ? JCS_GRAYSCALE : JCS_RGB;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, 100, TRUE);
    jpeg_set_colorspace(&jpeg, colour.size() == 1 ? JCS_GRAYSCALE : stored);
    jpeg.write_JFIF_header = jfif ? TRUE : FALSE;
    jpeg.write_Adobe_marker = adobe ? TRUE : FALSE;
    jpeg.comp_info[0].h_samp_factor = jpeg.comp_info[0].v_samp_factor = coarse ? 2 : 1;
    jpeg_start_compress(&jpeg, TRUE);
    std::vector<unsigned char> row;
    for (int i = 0; i < 16; ++i)
      row.insert(row.end(), colour.begin(), colour.end());
    for (int i = 0; i < 16; ++i) {
      JSAMPROW pixels = row.data();
      jpeg_write_scanlines(&jpeg, &pixels, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    std::string text(reinterpret_cast<char*>(bytes), count);
    std::free(bytes);
    return text + std::string(text.size() % 2, '\0');
  }
};

// A file of compressed frames of 16 x 16 pixels: a table of offsets, and fragments.
std::string Compressed(const std::string& colours, int samples, const std::vector<std::string>& fragments, int frames = 1,
                       const std::string& table = "", int bits = 8, const std::string& syntax = "1.2.840.10008.1.2.4.50")
{
  const auto number = [](int element, int value) {
    return Element(0x28, element, "US", Number(static_cast<std::uint64_t>(value), 2));
  };
  std::string items = Item(table, static_cast<std::uint32_t>(table.size()));
  for (const std::string& fragment : fragments)
    items += Item(fragment, static_cast<std::uint32_t>(fragment.size()));
  return StartOf(syntax) + Element(0x18, 0x88, "DS", "1") + number(2, samples) + Element(0x28, 4, "CS", colours) +
         (samples == 3 ? number(6, 0) : "") + Element(0x28, 8, "IS", std::to_string(frames)) + number(0x10, 16) +
         number(0x11, 16) + Element(0x28, 0x30, "DS", "1\\1") + number(0x100, bits) + number(0x101, bits) +
         number(0x102, bits - 1) + number(0x103, 0) + Element(0x7FE0, 0x10, "OB", items + EndOfSequence, Undefined);
}

class DicomFile : public TemporaryFolder {
protected:
  void ExpectBad(const std::string& elements, const std::string& words) const
  {
    const std::string path = Put("bad.dcm", Start + elements);
    ExpectRefused([&] { OpenVolume(path); }, Error::Kind::BadFile, path, words);
  }

  void Compress(int k, gdcm::TransferSyntax::TSType syntax) const
  {
    const std::string from = Path("s" + std::to_string(k)), to = Path("t" + std::to_string(k));
    gdcm::ImageReader reader;
    reader.SetFileName(from.c_str());
    ASSERT_TRUE(reader.Read());
    gdcm::ImageChangeTransferSyntax change;
    change.SetTransferSyntax(syntax);
    change.SetInput(reader.GetImage());
    ASSERT_TRUE(change.Change());
    gdcm::ImageWriter writer;
    writer.SetFile(reader.GetFile());
    writer.SetImage(change.GetOutput());
    writer.SetFileName(to.c_str());
    ASSERT_TRUE(writer.Write());
    std::filesystem::rename(to, from);
  }

  // The first pixel of each slice, and the notes.
  std::pair<std::vector<int>, std::string> Greys(const std::string& file) const
  {
    const auto source = OpenVolume(Put("grey.dcm", file));
    const auto& n = source->Content().geometry.dimensions;
    std::vector<unsigned char> voxels(source->Content().geometry.VoxelCount());
    source->Read(0, voxels.data(), nullptr);
    std::vector<int> greys;
    for (int k = 0; k < n[2]; ++k)
      greys.push_back(voxels[static_cast<std::size_t>(k * n[0] * n[1])]);
    std::string notes;
    for (const std::string& note : source->Content().notes)
      notes += note + "\n";
    return {greys, notes};
  }

  void ExpectBadPixels(const std::string& file, const std::string& words) const
  {
    ExpectRefused([&] { Greys(file); }, Error::Kind::BadFile, Path("grey.dcm"), words);
  }

  void PutSlices(int count, int bits = 8) const
  {
    for (int k = 0; k < count; ++k)
      Put("s" + std::to_string(k), Start + Slice(k, bits));
  }
};

TEST_F(DicomFile, SlicesOfASeries)
{
  PutSlices(4);
  for (const std::string& path : {folder.string(), Path("s2")}) {
    EXPECT_EQ(FormatOfContent(path), FileFormat::Dicom);
    const auto source = OpenVolume(path);
    const ImageGeometry& geometry = source->Content().geometry;
    EXPECT_EQ(geometry.dimensions, (std::array<int, 3>{8, 6, 4}));
    EXPECT_EQ(geometry.origin, Eigen::Vector3d(1.5, -2.5, 3));
    EXPECT_EQ(geometry.spacing, Eigen::Vector3d(0.25, 0.5, 2));
    EXPECT_EQ(source->Content().fields, std::vector<HeaderField>({{"Modality", "US"}}));
    EXPECT_TRUE(source->Content().notes.empty());
    std::vector<unsigned char> voxels(8 * 6 * 4);
    source->Read(0, voxels.data(), nullptr);
    for (int k = 0; k < 4; ++k)
      for (int i = 0; i < 48; ++i)
        ASSERT_EQ(voxels[static_cast<std::size_t>(48 * k + i)], i * 5 + k);
    EXPECT_THROW(source->Read(0, voxels.data(), nullptr, Progress([](double) { return false; })), Error);
  }
}

// Volumes of three slices by their numbers; trigger times may be those of volumes or of slices.
TEST_F(DicomFile, TimesOfVolumesAndOfSlices)
{
  const auto times = [this](int volumes, int volumeNumber, int sliceNumber, int volumeTime, int sliceTime) {
    for (int t = 0; t < volumes; ++t)
      for (int k = 0; k < 3; ++k)
        Put("s" + std::to_string(3 * t + k),
            Start + Element(0x18, 0x1060, "DS", std::to_string(t * volumeTime + k * sliceTime)) +
                Element(0x20, 0x100, "IS", std::to_string(1 + t * volumeNumber + k * sliceNumber)) + Slice(k));
    const auto source = OpenVolume(folder.string());
    EXPECT_EQ(source->Content().geometry.dimensions, (std::array<int, 3>{8, 6, 3}));
    EXPECT_EQ(source->Content().geometry.spacing[2], 2.0);
    return source->Content().times;
  };
  EXPECT_EQ(times(1, 1, 0, 0, 10), std::vector<double>{});
  EXPECT_EQ(times(1, 1, 1, 0, 10), std::vector<double>{});
  EXPECT_EQ(times(2, 1, 0, 100, 0), (std::vector<double>{0.0, 0.1}));
  EXPECT_EQ(times(2, 1, 0, 100, 10), (std::vector<double>{0.0, 0.1}));
  EXPECT_EQ(times(2, 1, 0, 0, 0), (std::vector<double>{1, 2})) << "their numbers";
  EXPECT_EQ(times(2, 0, 0, 100, 0), (std::vector<double>{0.0, 0.1})) << "no numbers of volumes";
  EXPECT_EQ(times(2, 0, 1, 100, 0), (std::vector<double>{0.0, 0.1})) << "numbers of slices";
  ExpectRefused([&] { times(2, 0, 1, 100, 10); }, Error::Kind::BadFile, folder.string(), "same place");
}

// What gdcm writes, it reads. (JPEG 2000 is in TestDicom.py: gdcm's own encoder writes beyond its buffer for small pictures.)
TEST_F(DicomFile, LosslessCompressions)
{
  using gdcm::TransferSyntax;
  const TransferSyntax::TSType syntaxes[] = {TransferSyntax::RLELossless, TransferSyntax::JPEGLosslessProcess14_1,
                                             TransferSyntax::JPEGLSLossless};
  for (const int bits : {8, 16})
    for (const auto syntax : syntaxes) {
      PutSlices(3, bits);
      for (int k = 0; k < 3; ++k)
        Compress(k, syntax);
      const DicomHeader header = ReadDicomHeader(Path("s1"));
      EXPECT_EQ(header.storage, DicomStorage::Encapsulated);
      const auto source = OpenVolume(folder.string());
      std::vector<char> voxels(8 * 6 * 3 * SizeOf(source->Content().type));
      source->Read(0, voxels.data(), nullptr);
      std::string wanted;
      for (int k = 0; k < 3; ++k)
        for (int i = 0; i < 48; ++i)
          wanted += Number(static_cast<std::uint64_t>(i * 5 + k), bits / 8);
      EXPECT_EQ(std::string(voxels.begin(), voxels.end()), wanted) << bits << " bits, " << TransferSyntax::GetTSString(syntax);
    }
}

// Whatever a damaged compression does to a codec, the reader refuses it or reads something.
TEST_F(DicomFile, DamagedCompressions)
{
  using gdcm::TransferSyntax;
  Random random(7);
  int refused = 0, tried = 0;
  for (const auto syntax :
       {TransferSyntax::RLELossless, TransferSyntax::JPEGLosslessProcess14_1, TransferSyntax::JPEGLSLossless}) {
    PutSlices(1);
    Compress(0, syntax);
    const DicomHeader header = ReadDicomHeader(Path("s0"));
    std::stringstream whole;
    whole << std::ifstream(Path("s0"), std::ios::binary).rdbuf();
    for (int i = 0; i < 25; ++i) {
      std::string damaged = whole.str();
      for (int changes = 1 + i % 5; changes > 0; --changes)
        damaged[header.pixelOffset + 16 + random.Bits() % (header.pixelBytes - 24)] = static_cast<char>(random.Bits());
      const std::string path = Put("s0", damaged);
      ++tried;
      try {
        const auto source = OpenVolume(path);
        std::vector<unsigned char> voxels(48);
        source->Read(0, voxels.data(), nullptr);
      } catch (const Error& error) {
        EXPECT_EQ(error.GetKind(), Error::Kind::BadFile) << error.what();
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, tried / 10);
}

TEST_F(DicomFile, LengthsThatLie)
{
  // 2 GB and more are promised, at the top and inside sequences; nothing is allocated for them.
  for (const std::uint32_t length : {0x7FFFFFFFu, 0xFFFFFFFEu}) {
    ExpectBad(Element(8, 0x60, "UT", "US", length), "(0008,0060)");
    ExpectBad(Slice(0) + Element(0x7FE1, 0x1101, "OB", "US", length), "(7FE1,1101)");
    const std::string inner = Element(0x20, 0x9301, "UN", "12", length);
    for (const std::string& sequence :
         {Element(0x5200, 0x9229, "SQ", Item(inner, static_cast<std::uint32_t>(inner.size()))),
          Element(0x5200, 0x9229, "SQ", Item(inner + EndOfItem, Undefined) + EndOfSequence, Undefined),
          Element(0x5200, 0x9229, "UN", Item(Tag(0x20, 0x9301) + Number(length, 4) + "12", Undefined) + EndOfSequence, Undefined),
          Element(0x5200, 0x9229, "UN", Item(Tag(0x20, 0x9301) + Number(length, 4) + "12", 10))})
      ExpectBad(sequence, "(0020,9301)");
    ExpectBad(Element(0x5200, 0x9229, "SQ", Item("12345678", length) + EndOfSequence, Undefined), "(FFFE,E000)");
    ExpectBad(Element(0x7FE0, 0x10, "OB", Item("", 0) + Item("12345678", length) + EndOfSequence, Undefined), "(FFFE,E000)");
  }
}

TEST_F(DicomFile, DamagedStructure)
{
  ExpectBad(Element(0x7FE0, 0x10, "OB", Item("", 0) + Item("12", 2), Undefined), "end early");
  ExpectBad(Element(0x7FE0, 0x10, "OB", "12345678", Undefined), "compressed pixels are damaged");
  ExpectBad(Element(0x5200, 0x9229, "SQ", "12345678"), "where an item should begin");
  ExpectBad(Tag(8, 0x60) + Number(0, 4), "has no type");
  ExpectBad(Tag(8, 0x60) + "CS", "end early");
  std::string nested;
  for (int i = 0; i < 40; ++i)
    nested += Tag(0x20, 0x9301) + "SQ" + Number(0, 2) + Number(Undefined, 4) + Tag(0xFFFE, 0xE000) + Number(Undefined, 4);
  ExpectBad(nested, "nested");
  ExpectBad("", "");
}

// Colours of JPEG are what its marks say, or its sampling; without these, what the header says.
TEST_F(DicomFile, ColoursOfJpeg)
{
  Jpeg jfif, adobe, coarse, plain, rgb, plainRgb, jfifRgb; // the components of RGB are called R, G and B
  jfif.jfif = adobe.adobe = rgb.adobe = coarse.coarse = jfifRgb.jfif = true;
  rgb.stored = plainRgb.stored = jfifRgb.stored = JCS_RGB;
  std::string filled = jfif.Bytes(); // any number of bytes 0xFF may stand before a mark
  filled.insert(2, "\xFF\xFF");
  const std::string aProfile = std::string("\xFF\xE2\xFF\xFF", 4) + std::string(65533, 'p');
  std::string far = adobe.Bytes(); // beyond the first 64 kB
  far.insert(2, aProfile + aProfile);
  const struct {
    const char* header;
    std::string jpeg, noted;
  } cases[] = {{"RGB", jfif.Bytes(), "YBR_FULL"},
               {"RGB", adobe.Bytes(), "YBR_FULL"},
               {"RGB", coarse.Bytes(), "YBR_FULL"},
               {"RGB", filled, "YBR_FULL"},
               {"RGB", far, "YBR_FULL"},
               {"YBR_FULL_422", rgb.Bytes(), "JPEG that they are RGB"},
               {"YBR_FULL_422", jfif.Bytes(), ""},
               {"YBR_FULL_422", coarse.Bytes(), ""},
               {"YBR_FULL", plain.Bytes(), ""},
               {"RGB", rgb.Bytes(), ""},
               {"RGB", plainRgb.Bytes(), ""},
               {"RGB", jfifRgb.Bytes(), ""},
               {"YBR_FULL_422", plainRgb.Bytes(), "JPEG that they are RGB"}};
  for (const auto& [header, jpeg, noted] : cases) {
    const auto [greys, notes] = Greys(Compressed(header, 3, {jpeg}));
    EXPECT_NEAR(greys.at(0), 91, 2) << header << noted;
    EXPECT_EQ(notes.find("JPEG") != std::string::npos, !noted.empty()) << header << notes;
    EXPECT_NE(notes.find(noted), std::string::npos) << header << notes;
  }
  ExpectBadPixels(Compressed("RGB", 3, {rgb.Bytes(), jfif.Bytes()}, 2), "the colours of frame 2 are YBR_FULL");
  const std::string whole = adobe.Bytes(); // the marks may lie in several fragments
  EXPECT_NEAR(Greys(Compressed("RGB", 3, {whole.substr(0, 10), whole.substr(10)})).first.at(0), 91, 2);
}

TEST_F(DicomFile, CompressedPixelsOfAnotherTypeThanTheHeaders)
{
  Jpeg grey, colours;
  grey.colour = "M"; // 77
  colours.jfif = true;
  EXPECT_NEAR(Greys(Compressed("MONOCHROME2", 1, {grey.Bytes()})).first.at(0), 77, 1);
  ExpectBadPixels(Compressed("MONOCHROME2", 1, {colours.Bytes()}), "3 x 8 bits per pixel, and the header says 1 x 8");
  ExpectBadPixels(Compressed("RGB", 3, {grey.Bytes()}), "1 x 8 bits per pixel, and the header says 3 x 8");
  ExpectBadPixels(Compressed("MONOCHROME2", 1, {grey.Bytes(), colours.Bytes()}, 2), "frame 2");
  ExpectBadPixels(Compressed("MONOCHROME2", 1, {grey.Bytes()}, 1, "", 16), "1 x 8 bits per pixel, and the header says 1 x 16");
  const std::string jpeg2000 = std::string("\xFF\x4F\xFF\x51", 4) + std::string(36, '\0') + std::string("\0\1\x07\1\1\0", 6);
  ExpectBadPixels(Compressed("MONOCHROME2", 1, {jpeg2000}, 1, "", 16, "1.2.840.10008.1.2.4.90"), "1 x 8 bits per pixel");

  // Lossless JPEG of 8 bits is widened to the 16 that are allocated.
  PutSlices(1);
  Compress(0, gdcm::TransferSyntax::JPEGLosslessProcess14_1);
  std::stringstream whole;
  whole << std::ifstream(Path("s0"), std::ios::binary).rdbuf();
  std::string wide = whole.str();
  const std::string allocated = Element(0x28, 0x100, "US", Number(8, 2));
  wide.replace(wide.find(allocated), allocated.size(), Element(0x28, 0x100, "US", Number(16, 2)));
  const auto source = OpenVolume(Put("s0", wide));
  std::vector<std::uint16_t> voxels(48);
  source->Read(0, voxels.data(), nullptr);
  for (int i = 0; i < 48; ++i)
    EXPECT_EQ(voxels[static_cast<std::size_t>(i)], i * 5);
}

// Three frames in one, two and three fragments.
TEST_F(DicomFile, FragmentsAreJoinedByTheirTable)
{
  std::vector<std::string> fragments, frames;
  std::string table;
  std::size_t at = 0;
  for (int k = 0; k < 3; ++k) {
    Jpeg jpeg;
    jpeg.colour = std::string(1, static_cast<char>(20 + 70 * k));
    frames.push_back(jpeg.Bytes());
    table += Number(at, 4);
    const std::size_t part = frames[static_cast<std::size_t>(k)].size() / static_cast<std::size_t>(k + 1) / 2 * 2;
    for (int i = 0; i <= k; ++i) {
      fragments.push_back(frames.back().substr(static_cast<std::size_t>(i) * part, i == k ? std::string::npos : part));
      at += 8 + fragments.back().size();
    }
  }
  const auto expectFrames = [this](const std::string& file) {
    const std::vector<int> greys = Greys(file).first;
    ASSERT_EQ(greys.size(), 3u);
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(greys[static_cast<std::size_t>(k)], 20 + 70 * k, 1) << k;
  };
  expectFrames(Compressed("MONOCHROME2", 1, fragments, 3, table));
  expectFrames(Compressed("MONOCHROME2", 1, frames, 3, table)); // one each: whatever the table says
  expectFrames(Compressed("MONOCHROME2", 1, frames, 3));
  EXPECT_NEAR(Greys(Compressed("MONOCHROME2", 1, {fragments.end() - 3, fragments.end()}, 1)).first.at(0), 160, 1);
  ExpectBadPixels(Compressed("MONOCHROME2", 1, fragments, 3), "3 frames lie in 6 fragments, and no table");
  std::string wrong = table;
  wrong[8] = static_cast<char>(wrong[8] + 2);
  for (const std::string& other : {wrong, table.substr(4), table.substr(0, 8), table.substr(0, 10)})
    ExpectBadPixels(Compressed("MONOCHROME2", 1, fragments, 3, other), "its table of offsets does not say");
}

// To open it, no more than its head; to read it, up to the end of its pixels.
TEST_F(DicomFile, DeflatedFilesAreInflatedPieceByPiece)
{
  Random random(3);
  std::string noise;
  for (int i = 0; i < 100000; ++i)
    noise += Number(random.Bits(), 2);
  const std::string path =
      Put("deflated", Deflated(Element(9, 0x1010, "UN", noise) + Slice(2) + Element(0x7FE1, 0x10, "LO", "A")));
  std::vector<unsigned char> voxels(48);
  OpenVolume(path)->Read(0, voxels.data(), nullptr);
  for (int i = 0; i < 48; ++i)
    EXPECT_EQ(voxels[static_cast<std::size_t>(i)], 2 + i * 5);

  const std::size_t bytes = std::filesystem::file_size(path);
  std::filesystem::resize_file(path, bytes / 2);
  ExpectRefused([&] { OpenVolume(path); }, Error::Kind::BadFile, path, "");
  Put("deflated", Deflated(Slice(2) + Element(9, 0x1010, "UN", "12", 20000)));
  EXPECT_EQ(ReadDicomHeader(path).pictures.size(), 1u) << "what follows the pixels is not looked at";
  Put("deflated", Deflated(Element(8, 0x60, "CS", "US") + Element(9, 0x1010, "UN", "12", 20000)));
  ExpectRefused([&] { OpenVolume(path); }, Error::Kind::BadFile, path, "end early");
  Put("deflated", Deflated(Element(9, 0x1010, "UN", "12", 0xFFFFFFF0u)));
  ExpectRefused([&] { OpenVolume(path); }, Error::Kind::BadFile, path, "(0009,1010)");

  // Pixels of noise, so that a part of the file is a part of them.
  std::string large = Slice(0);
  const std::string rows = Element(0x28, 0x10, "US", Number(6, 2)), pixels = large.substr(large.size() - 48 - 12);
  large.replace(large.find(rows), rows.size(), Element(0x28, 0x10, "US", Number(25000, 2)));
  large.replace(large.find(pixels), pixels.size(), Element(0x7FE0, 0x10, "OB", noise));
  Put("deflated", Deflated(large));
  std::filesystem::resize_file(path, 150000);
  EXPECT_EQ(ReadDicomHeader(path).rows, 25000) << "its pixels are not looked at yet";
  const auto source = OpenVolume(path);
  voxels.resize(200000);
  ExpectRefused([&] { source->Read(0, voxels.data(), nullptr); }, Error::Kind::BadFile, path, "end early");
}

TEST_F(DicomFile, DeflatedFilesTakeLittleMemory)
{
  constexpr std::size_t bomb = 128 << 20;
  const std::string path = Put("deflated", Deflated(Element(9, 0x1010, "UN", std::string(bomb, '\0')) + Slice(2)));
  EXPECT_EQ(RunIsolated([&] { return ReadDicomHeader(path).columns == 8; }, {60.0, bomb / 4}), TaskOutcome::Succeeded);
}

TEST_F(DicomFile, DeflatedDataAreChecked)
{
  const std::string path = Put("deflated", StartOf("1.2.840.10008.1.2.1.99") + "not deflated");
  ExpectRefused([&] { OpenVolume(path); }, Error::Kind::BadFile, path, "deflated");
}

// The time is that of the frames and that of what they share, not their product.
TEST_F(DicomFile, WhatFramesShareIsReadOnce)
{
  const auto seconds = [this](std::size_t frames, std::size_t shared) {
    std::string own, inner, pixels(frames, 'p');
    for (std::size_t i = 0; i < frames; ++i)
      own += Item("", 0);
    for (std::size_t i = 0; i < shared; ++i)
      inner += Item("", 0);
    inner = Element(0x20, 0x9113, "SQ", inner);
    const std::string path =
        Put("shared", Start + Element(0x28, 4, "CS", "MONOCHROME2") + Element(0x28, 8, "IS", std::to_string(frames)) +
                          Element(0x28, 0x10, "US", Number(1, 2)) + Element(0x28, 0x11, "US", Number(1, 2)) +
                          Element(0x28, 0x100, "US", Number(8, 2)) +
                          Element(0x5200, 0x9229, "SQ", Item(inner, static_cast<std::uint32_t>(inner.size()))) +
                          Element(0x5200, 0x9230, "SQ", own) + Element(0x7FE0, 0x10, "OB", pixels));
    const std::clock_t begin = std::clock(); // of this process alone
    EXPECT_EQ(ReadDicomHeader(path).pictures.size(), frames);
    return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  };
  const double apart = seconds(2000, 1) + seconds(1, 20000);
  EXPECT_LT(seconds(2000, 20000), 8.0 * apart);
}

TEST_F(DicomFile, AGapIsToldInShort)
{
  const char* const places[] = {"0.1", "1.4", "2.7", "4.0", "6.6"}; // whose differences are not quite 1.3
  for (int k = 0; k < 5; ++k)
    Put("s" + std::to_string(k), Start + Slice(k, 8, places[k]));
  ExpectRefused([&] { OpenVolume(folder.string()); }, Error::Kind::BadFile, folder.string(),
                "2.6 mm between s3 and s4, 1.3 mm elsewhere");
}

// Of a folder, whatever the order is in which it gives them: editors leave such links beside what they have open.
TEST_F(DicomFile, LinksToNowhere)
{
  PutSlices(3);
  for (int i = 0; i < 60; ++i)
    std::filesystem::create_symlink("user@host.123:456", Path(".#" + std::to_string(i)));
  std::filesystem::create_symlink("round", Path("round"));
  for (const std::string& path : {folder.string(), Path("s1")}) {
    EXPECT_EQ(FormatOfContent(path), FileFormat::Dicom);
    const auto source = OpenVolume(path);
    EXPECT_EQ(source->Content().geometry.dimensions[2], 3);
    EXPECT_TRUE(source->Content().notes.empty());
  }
}

TEST_F(DicomFile, APipeIsNotWaitedFor)
{
  const std::string path = Path("pipe.dcm");
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  ExpectRefused([&] { ReadDicomHeader(path); }, Error::Kind::FileSystem, path, "not a plain one");
}

TEST_F(DicomFile, OtherFilesOfAFolder)
{
  PutSlices(3);
  Put("readme.txt", "nothing");
  Put("report", Start + Element(8, 0x60, "CS", "SR") + Element(0x20, 0xE, "UI", "9.9"));
  EXPECT_EQ(OpenVolume(folder.string())->Content().geometry.dimensions[2], 3);
  const std::string cut = Put("cut", (Start + Slice(3)).substr(0, Start.size() + Slice(3).size() - 20));
  ExpectRefused([&] { OpenVolume(folder.string()); }, Error::Kind::BadFile, cut, "truncated");
  EXPECT_NE(OpenVolume(Path("s0"))->Content().notes.at(0).find("1 files"), std::string::npos);
  std::filesystem::remove(cut);
  std::filesystem::remove(Path("s0"));
  std::filesystem::remove(Path("s1"));
  std::filesystem::remove(Path("s2"));
  ExpectRefused([&] { OpenVolume(folder.string()); }, Error::Kind::BadFile, folder.string(), "no DICOM pictures");
  ExpectRefused([&] { OpenVolume(Path("report")); }, Error::Kind::BadFile, "report", "no pictures");
}

} // namespace
