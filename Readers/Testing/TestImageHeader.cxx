// SPDX-License-Identifier: BSD-3-Clause
// Headers as other programs write them, and headers that lie.
#include "Readers/FileKind.h"
#include "Readers/ImageHeader.h"
#include "Readers/Testing/ObliqueVolume.h"
#include "Readers/VolumeFile.h"
#include "Testing/TemporaryFolder.h"
#include <clocale>
#include <map>
#include <sys/stat.h>

using namespace echorama;
using namespace echorama::testing;

namespace {

using Fields = std::map<std::string, std::string>;

class ImageHeaderTest : public TemporaryFolder {
protected:
  ImageHeader Read(const std::string& name, const std::string& content) const { return ReadImageHeader(Put(name, content)); }

  /// Reads the header and checks the volume, and expects a BadFile error that names the file.
  void Refused(const std::string& name, const std::string& content, const std::string& words) const
  {
    const std::string path = Put(name, content);
    ExpectRefused([&] { CheckVolume(ReadImageHeader(path)); }, Error::Kind::BadFile, path, words);
  }
};

/// A MetaImage of 2 x 3 x 4 bytes in which single lines are replaced ("" drops the line).
std::string Meta(const Fields& changes = {}, const std::string& data = std::string(24, 'x'))
{
  const std::vector<HeaderField> lines = {{"ObjectType", "Image"},          {"NDims", "3"},
                                          {"BinaryData", "True"},           {"BinaryDataByteOrderMSB", "False"},
                                          {"CompressedData", "False"},      {"TransformMatrix", "0 1 0 -1 0 0 0 0 1"},
                                          {"Offset", "10 20 -30.5"},        {"CenterOfRotation", "0 0 0"},
                                          {"ElementSpacing", "0.25 0.5 2"}, {"DimSize", "2 3 4"},
                                          {"ElementType", "MET_UCHAR"},     {"ElementDataFile", "LOCAL"}};
  return MetaImageLines(lines, changes) + data;
}

/// The same volume as NRRD.
std::string Nrrd(const Fields& changes = {}, const std::string& data = std::string(24, 'x'))
{
  Fields fields{{"type", "uchar"},
                {"dimension", "3"},
                {"space", "left-posterior-superior"},
                {"sizes", "2 3 4"},
                {"space directions", "(0,0.25,0) (-0.5,0,0) (0,0,2)"},
                {"kinds", "domain domain domain"},
                {"encoding", "raw"},
                {"space origin", "(10,20,-30.5)"}};
  for (const auto& [field, value] : changes)
    fields[field] = value;
  std::string text = "NRRD0004\n# a comment\n";
  for (const auto& [field, value] : fields)
    if (!value.empty())
      text += field + ": " + value + "\n";
  return text + "\n" + data;
}

void ExpectTheUsualGeometry(const ImageHeader& header)
{
  EXPECT_EQ(header.geometry.dimensions, (std::array<int, 3>{2, 3, 4}));
  EXPECT_EQ(header.geometry.spacing, Eigen::Vector3d(0.25, 0.5, 2.0));
  EXPECT_EQ(header.geometry.origin, Eigen::Vector3d(10.0, 20.0, -30.5));
  Eigen::Matrix3d direction; // the first index axis points along +y, the second along -x
  direction << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  EXPECT_EQ(header.geometry.direction, direction);
}

} // namespace

TEST_F(ImageHeaderTest, RowsOfTheTransformMatrixAreAxes)
{
  const ImageHeader header = Read("a.mha", Meta());
  ExpectTheUsualGeometry(header);
  EXPECT_EQ(header.geometry.IndexToWorld() * Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(10, 20.25, -30.5));
  EXPECT_EQ(header.type, VoxelType::UInt8);
  EXPECT_EQ(header.dataPath, Path("a.mha"));
  EXPECT_EQ(header.dataOffset, static_cast<std::int64_t>(Meta().size()) - 24);
  EXPECT_TRUE(header.notes.empty());
  CheckVolume(header);
}

TEST_F(ImageHeaderTest, VectorsOfSpaceDirectionsAreAxes)
{
  const ImageHeader header = Read("a.nrrd", Nrrd());
  ExpectTheUsualGeometry(header);
  EXPECT_TRUE(header.notes.empty());
  EXPECT_EQ(header.dataOffset, static_cast<std::int64_t>(Nrrd().size()) - 24);
  CheckVolume(header);
}

TEST_F(ImageHeaderTest, TheContentDecidesNotTheName)
{
  EXPECT_EQ(FormatOfContent(Put("a.nrrd", Meta())), FileFormat::MetaImage);
  EXPECT_EQ(FormatOfContent(Put("a.mha", Nrrd())), FileFormat::Nrrd);
  EXPECT_EQ(FormatOfContent(Put("b.mha", "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\">")), FileFormat::VtkXmlImage);
  EXPECT_EQ(FormatOfContent(Put("c.mha", "A letter about NDims and ObjectType.\n")), FileFormat::Unknown);
  EXPECT_EQ(FormatOfContent(Put("d.mha", std::string(5000, '\0'))), FileFormat::Unknown);
  EXPECT_EQ(FormatOfName("/x/A.MHA"), FileFormat::MetaImage);
  EXPECT_EQ(FormatOfName("a.nhdr"), FileFormat::Nrrd);
  EXPECT_EQ(FormatOfName("a.vti"), FileFormat::VtkXmlImage);
  EXPECT_EQ(FormatOfName("a.mha.gz"), FileFormat::Unknown);
}

TEST_F(ImageHeaderTest, MetaImageOlderNamesWindowsLinesAndLocales)
{
  const std::string text = "ObjectType = Image\r\nNDims = 3\r\nPosition = 10 20 -30.5\r\nRotation=0 1 0 -1 0 0 0 0 1\r\n"
                           "ElementByteOrderMSB = False\r\n\r\nElementSize = 0.25 0.5 +2\r\nDimSize = 2 3 4  \r\n"
                           "ElementType = MET_UCHAR\r\nElementDataFile = Local\r\n";
  const std::string saved = std::setlocale(LC_NUMERIC, nullptr);
  std::setlocale(LC_NUMERIC, "de_DE.UTF-8"); // where it is installed: a decimal comma must not matter
  ExpectTheUsualGeometry(Read("a.mha", text + std::string(24, 'x')));
  std::setlocale(LC_NUMERIC, saved.c_str());
}

TEST_F(ImageHeaderTest, MetaImageSaysWhatItAssumes)
{
  const ImageHeader header =
      Read("a.mha", Meta({{"TransformMatrix", ""}, {"Offset", ""}, {"ElementSpacing", ""}, {"ObjectType", ""}}));
  EXPECT_EQ(header.notes.size(), 3u);
  EXPECT_EQ(header.geometry.spacing, Eigen::Vector3d(1, 1, 1));
  EXPECT_EQ(header.geometry.direction, Eigen::Matrix3d(Eigen::Matrix3d::Identity()));
}

TEST_F(ImageHeaderTest, MetaImageUnits)
{
  const ImageHeader header = Read("a.mha", "DistanceUnits = cm\n" + Meta());
  EXPECT_EQ(header.geometry.spacing, Eigen::Vector3d(2.5, 5.0, 20.0));
  EXPECT_EQ(header.geometry.origin, Eigen::Vector3d(100, 200, -305));
}

TEST_F(ImageHeaderTest, OtherFieldsAreKept)
{
  EXPECT_EQ(Read("a.mha", "Modality = MET_MOD_US\nEchorama_TimeStamp = 12.5\n" + Meta()).fields,
            (std::vector<HeaderField>{{"Modality", "MET_MOD_US"}, {"Echorama_TimeStamp", "12.5"}}));
  std::string nrrd = Nrrd();
  nrrd.insert(9, "one:=first\\nsecond \\\\ line\ntwo:=a: b := c\n");
  EXPECT_EQ(Read("a.nrrd", nrrd).fields, (std::vector<HeaderField>{{"one", "first\nsecond \\ line"}, {"two", "a: b := c"}}));
  nrrd = Nrrd({{"content", "a:=b"}}); // a field
  nrrd.insert(9, "DICOM:Modality:=US\nDICOM:Maker:=X: y\n");
  EXPECT_EQ(Read("a.nrrd", nrrd).fields, (std::vector<HeaderField>{{"DICOM:Modality", "US"}, {"DICOM:Maker", "X: y"}}));
}

TEST_F(ImageHeaderTest, NrrdSpacesBecomeLps)
{
  // One anatomical place in three spaces.
  ExpectTheUsualGeometry(Read("ras.nrrd", Nrrd({{"space", "right-anterior-superior"},
                                                {"space directions", "(0,-0.25,0) (0.5,0,0) (0,0,2)"},
                                                {"space origin", "(-10,-20,-30.5)"}})));
  const ImageHeader las = Read(
      "las.nrrd",
      Nrrd({{"space", "LAS"}, {"space directions", "( 0, -0.25 ,0) (-0.5,0,0)  (0,0,2)"}, {"space origin", "(10,-20,-30.5)"}}));
  ExpectTheUsualGeometry(las);
  EXPECT_TRUE(las.notes.empty());
  ExpectTheUsualGeometry(Read(
      "tabs.nrrd", Nrrd({{"space directions", "\t(0,0.25,0)\t( -0.5,0,0) \t(0,0,2)\t"}, {"space origin", "\t(10,20,-30.5)"}})));
  const ImageHeader none = Read("none.nrrd", Nrrd({{"space", ""}, {"space dimension", "3"}}));
  ExpectTheUsualGeometry(none);
  EXPECT_EQ(none.notes.size(), 1u);
}

TEST_F(ImageHeaderTest, NrrdUnitsSpacingsAndCells)
{
  const ImageHeader metres = Read("m.nrrd", Nrrd({{"space units", "\"m\" \"m\" \"m\""}}));
  EXPECT_EQ(metres.geometry.spacing, Eigen::Vector3d(250, 500, 2000));
  EXPECT_EQ(metres.geometry.origin, Eigen::Vector3d(10000, 20000, -30500));

  const Fields plain{
      {"space", ""}, {"space directions", ""}, {"space origin", ""}, {"spacings", "0.25 0.5 2"}, {"axis mins", "10 20 -30.5"}};
  const ImageHeader nodes = Read("n.nrrd", Nrrd(plain));
  EXPECT_EQ(nodes.geometry.spacing, Eigen::Vector3d(0.25, 0.5, 2));
  EXPECT_EQ(nodes.geometry.origin, Eigen::Vector3d(10, 20, -30.5));
  EXPECT_EQ(nodes.notes.size(), 1u) << "no direction";
  Fields cells = plain;
  cells["centers"] = "cell cell cell";
  EXPECT_EQ(Read("c.nrrd", Nrrd(cells)).geometry.origin, Eigen::Vector3d(10.125, 20.25, -29.5));

  cells["units"] = "\"cm\" \"mm\" \"m\"";
  const ImageHeader each = Read("u.nrrd", Nrrd(cells));
  EXPECT_EQ(each.geometry.spacing, Eigen::Vector3d(2.5, 0.5, 2000));
  EXPECT_EQ(each.geometry.origin, Eigen::Vector3d(101.25, 20.25, -29500));
  EXPECT_EQ(each.notes.size(), 1u) << "no direction";
  for (const char* units : {"\"mm\" \"parsec\" \"mm\"", "\"cm\""}) {
    cells["units"] = units;
    const ImageHeader unknown = Read("u.nrrd", Nrrd(cells));
    EXPECT_EQ(unknown.geometry.spacing, nodes.geometry.spacing);
    EXPECT_EQ(unknown.notes.size(), 2u) << units;
  }
}

TEST_F(ImageHeaderTest, NrrdSpacingsOfExtremes)
{
  Fields fields{{"space", ""},
                {"space directions", ""},
                {"space origin", ""},
                {"axis mins", "10 20 -30.5"},
                {"axis maxs", "10.5 21 -22.5"},
                {"centers", "cell node cell"}};
  const ImageHeader header = Read("e.nrrd", Nrrd(fields));
  EXPECT_EQ(header.geometry.spacing, Eigen::Vector3d(0.25, 0.5, 2));
  EXPECT_EQ(header.geometry.origin, Eigen::Vector3d(10.125, 20, -29.5));
  EXPECT_EQ(header.notes.size(), 1u) << "no direction";
  fields["spacings"] = "1 2 3";
  EXPECT_EQ(Read("s.nrrd", Nrrd(fields)).geometry.spacing, Eigen::Vector3d(1, 2, 3));
  fields["spacings"] = "";
  fields["units"] = "\"cm\" \"mm\" \"mm\"";
  EXPECT_EQ(Read("u.nrrd", Nrrd(fields)).geometry.spacing, Eigen::Vector3d(2.5, 0.5, 2));
  fields["centers"] = "cell ??? cell";
  Refused("e.nrrd", Nrrd(fields), "its spacing is not known");
  fields["axis mins"] = "";
  EXPECT_EQ(Read("e.nrrd", Nrrd(fields)).geometry.spacing, Eigen::Vector3d(1, 1, 1));
  // A single node has no spacing.
  EXPECT_EQ(Read("o.nrrd", Nrrd({{"space", ""},
                                 {"space directions", ""},
                                 {"space origin", ""},
                                 {"sizes", "2 3 1"},
                                 {"axis mins", "0 0 7"},
                                 {"axis maxs", "1 1 7"},
                                 {"centerings", "node node node"}}))
                .geometry.spacing,
            Eigen::Vector3d(1, 0.5, 1));
}

TEST_F(ImageHeaderTest, ASpaceWithoutDirectionsIsRefused)
{
  const Fields plain{{"space directions", ""}, {"spacings", "0.25 0.5 2"}};
  for (const char* other : {"space", "space origin"}) {
    Fields fields = plain;
    fields[other] = "";
    Refused("s.nrrd", Nrrd(fields), "without \"space directions\"");
  }
}

TEST_F(ImageHeaderTest, APipeIsNotWaitedFor)
{
  const std::string path = Path("pipe.mha");
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  ExpectRefused([&] { FormatOfContent(path); }, Error::Kind::FileSystem, path, "not a plain file");
  EXPECT_EQ(KindOf(path), FileKind::Volume);
  const std::string header = Put("a.nhdr", Nrrd({{"data file", "pipe.mha"}, {"line skip", "1"}}));
  ExpectRefused([&] { ReadImageHeader(header); }, Error::Kind::FileSystem, path, "not a plain file");
}

TEST_F(ImageHeaderTest, LeftHandedAxesAreTakenInReverse)
{
  std::string data;
  for (char c = 0; c < 24; ++c)
    data.push_back(c);
  const ImageHeader header = Read("a.mha", Meta({{"TransformMatrix", "0 1 0 -1 0 0 0 0 -1"}}, data));
  EXPECT_TRUE(header.reverseSlices);
  EXPECT_EQ(header.notes.size(), 1u);
  EXPECT_EQ(header.geometry.origin, Eigen::Vector3d(10, 20, -30.5 - 2.0 * 3));
  CheckVolume(header);
  std::vector<unsigned char> voxels(24);
  ReadVoxels(header, voxels.data());
  for (int k = 0; k < 4; ++k)
    for (int i = 0; i < 6; ++i)
      EXPECT_EQ(voxels[static_cast<std::size_t>(6 * k + i)], 6 * (3 - k) + i);
}

TEST_F(ImageHeaderTest, ImagesAreOneSlice)
{
  const ImageHeader meta = Read("a.mha", Meta({{"NDims", "2"},
                                               {"TransformMatrix", "0 1 1 0"},
                                               {"Offset", "5 6"},
                                               {"CenterOfRotation", ""},
                                               {"ElementSpacing", "0.5 2"},
                                               {"DimSize", "4 6"}}));
  EXPECT_EQ(meta.geometry.dimensions, (std::array<int, 3>{4, 6, 1}));
  EXPECT_EQ(meta.geometry.spacing, Eigen::Vector3d(0.5, 2, 1));
  EXPECT_EQ(meta.geometry.direction.col(2), Eigen::Vector3d(0, 0, -1)) << "right-handed";
  CheckVolume(meta);
  // A slice that lies obliquely in space.
  const ImageHeader nrrd =
      Read("a.nrrd",
           Nrrd({{"dimension", "2"}, {"sizes", "4 6"}, {"kinds", "domain domain"}, {"space directions", "(0,0,0.5) (0,2,0)"}}));
  EXPECT_EQ(nrrd.geometry.dimensions, (std::array<int, 3>{4, 6, 1}));
  EXPECT_EQ(nrrd.geometry.spacing, Eigen::Vector3d(0.5, 2, 1));
  EXPECT_EQ(nrrd.geometry.direction.col(0), Eigen::Vector3d(0, 0, 1));
  EXPECT_EQ(nrrd.geometry.direction.col(2), Eigen::Vector3d(-1, 0, 0));
  CheckVolume(nrrd);
  // A fourth axis of one sample is no axis.
  CheckVolume(Read("b.nrrd", Nrrd({{"dimension", "4"},
                                   {"sizes", "1 2 3 4"},
                                   {"kinds", "vector domain domain domain"},
                                   {"space directions", "none (0,0.25,0) (-0.5,0,0) (0,0,2)"}})));
}

TEST_F(ImageHeaderTest, SequencesAreRefusedAsVolumes)
{
  const std::string text = "Seq_Frame0000_Timestamp = 1.5\nSeq_Frame0001_Timestamp = 2.5\n" +
                           Meta({{"DimSize", "0 0 2"}, {"ElementType", "MET_OTHER"}}, "");
  Refused("a.mha", text, "vtkUltrasoundSequenceReader");
  FrameAxis axis;
  std::vector<std::string> taken;
  axis.field = [&](std::int64_t frame, std::string_view key, std::string_view value) {
    taken.push_back(std::to_string(frame) + " " + std::string(key) + " " + std::string(value));
  };
  const ImageHeader header = ReadSequenceHeader(Path("a.mha"), axis);
  EXPECT_EQ(header.geometry.dimensions, (std::array<int, 3>{0, 0, 1}));
  EXPECT_EQ(axis.frames, 2);
  EXPECT_TRUE(header.fields.empty());
  EXPECT_EQ(taken, (std::vector<std::string>{"0 Timestamp 1.5", "1 Timestamp 2.5"}));
}

TEST_F(ImageHeaderTest, MetaImagesThatAreRefused)
{
  Refused("a.mha", "", "empty");
  Refused("a.mha", "NRRX", "neither MetaImage nor NRRD");
  Refused("a.mha", "Dear reader,\nthis is a letter.\n", "neither MetaImage nor NRRD");
  Refused("a.mha", "ObjectType = Image\nNDims = 3\n", "truncated");
  Refused("a.mha", Meta().substr(0, 100), "truncated");
  Refused("a.mha", "ObjectType = Image\nNDims = 3\nDimSize = \x01\x02\x03", "line 3");
  Refused("a.mha", "ObjectType = Image\nsome words\n", "line 2");
  Refused("a.mha", Meta({{"ObjectType", "Tube"}}), "Tube");
  Refused("a.mha", Meta({{"DimSize", ""}}), "no DimSize");
  Refused("a.mha", Meta({{"ElementType", ""}}), "no ElementType");
  Refused("a.mha", Meta({{"ElementType", "MET_WORD"}}), "type");
  Refused("a.mha", Meta({{"BinaryData", "perhaps"}}), "perhaps");
  Refused("a.mha", Meta({{"NDims", "4"}}), "4 dimensions");
  Refused("a.mha", Meta({{"NDims", "2"}}), "2 are needed");
  Refused("a.mha", Meta({{"DimSize", "2 3"}}), "3 are needed");
  Refused("a.mha", Meta({{"DimSize", "2 3 x"}}), "\"x\"");
  Refused("a.mha", Meta({{"DimSize", "2 3 -4"}}), "-4");
  Refused("a.mha", Meta({{"DimSize", "2 3 0"}}), "dimension 2 is 0");
  Refused("a.mha", Meta({{"DimSize", "2 3 4.5"}}), "4.5");
  Refused("a.mha", Meta({{"DimSize", "2 3 99999999999999999999"}}), "99999999999999999999");
  Refused("a.mha", Meta({{"DimSize", "2147483647 2147483647 2147483647"}}), "overflows");
  Refused("a.mha", Meta({{"DimSize", "2147483647 100000000 1"}}), "truncated or the dimensions are wrong");
  Refused("a.mha", Meta({{"DimSize", "2 3 5"}}), "30 bytes, and it holds 24");
  Refused("a.mha", Meta({{"DimSize", "2 3 3"}}), "18 bytes, and it holds 24");
  Refused("a.mha", Meta({{"ElementType", "MET_FLOAT"}}), "96 bytes, and it holds 24");
  Refused("a.mha", Meta({{"ElementSpacing", "0.25 0 2"}}), "spacing 1");
  Refused("a.mha", Meta({{"ElementSpacing", "0.25 0.5 -2"}}), "spacing 2");
  Refused("a.mha", Meta({{"ElementSpacing", "0.25 nan 2"}}), "nan");
  Refused("a.mha", Meta({{"Offset", "1 inf 2"}}), "inf");
  Refused("a.mha", Meta({{"Offset", "1 1e999 2"}}), "1e999");
  Refused("a.mha", Meta({{"Offset", "1,5 2 3"}}), "1,5");
  Refused("a.mha", Meta({{"TransformMatrix", "1 0 0 0 1 0 nan 0 1"}}), "nan");
  Refused("a.mha", Meta({{"TransformMatrix", "1 0 0 1 0 0 0 0 1"}}), "direction");
  Refused("a.mha", Meta({{"TransformMatrix", "0 0 0 0 0 0 0 0 0"}}), "direction");
  Refused("a.mha", Meta({{"TransformMatrix", "1 0.2 0 0 1 0 0 0 1"}}), "direction");
  Refused("a.mha", Meta({{"TransformMatrix", "2 0 0 0 2 0 0 0 2"}}), "direction");
  Refused("a.mha", Meta({{"TransformMatrix", "1 0 0 1"}}), "9 are needed");
  Refused("a.mha", Meta({{"ElementDataFile", "LIST"}}), "one file per slice");
  Refused("a.mha", "ElementNumberOfChannels = 3\n" + Meta(), "3 numbers per voxel");
  Refused("a.mha", "NDims = 2\n" + Meta(), "given twice");
  const std::string path = Put("b.mhd", Meta({{"ElementDataFile", "b.raw"}}, ""));
  ExpectRefused([&] { CheckVolume(ReadImageHeader(path)); }, Error::Kind::FileSystem, Path("b.raw"), "no such file");
}

TEST_F(ImageHeaderTest, NrrdsThatAreRefused)
{
  Refused("a.nrrd", "NRRD", "magic");
  Refused("a.nrrd", "NRRD0009\ntype: uchar\n\n", "magic");
  Refused("a.nrrd", Nrrd({{"sizes", ""}}), "\"sizes\"");
  Refused("a.nrrd", Nrrd({{"type", ""}}), "\"type\"");
  Refused("a.nrrd", Nrrd({{"type", "block"}}), "type");
  Refused("a.nrrd", Nrrd({{"type", "short"}}), "endian");
  Refused("a.nrrd", Nrrd({{"endian", "middle"}}), "middle");
  Refused("a.nrrd", Nrrd({{"encoding", "bzip2"}}), "bzip2");
  Refused("a.nrrd", Nrrd({{"dimension", "0"}}), "dimension");
  Refused("a.nrrd", Nrrd({{"sizes", "2 3"}}), "3 are needed");
  Refused("a.nrrd", Nrrd({{"sizes", "2147483647 2147483647 2147483647"}}), "overflows");
  Refused("a.nrrd", Nrrd({{"sizes", "2 3 5"}}), "30 bytes, and it holds 24");
  Refused("a.nrrd", Nrrd({{"space directions", "(0,0.25,0) (-0.5,0,0) (0,0,0)"}}), "spacing 2");
  Refused("a.nrrd", Nrrd({{"space directions", "(1,0,0) (1,0,0) (0,0,1)"}}), "direction");
  Refused("a.nrrd", Nrrd({{"space directions", "(1,0,0) (0.1,1,0) (0,0,1)"}}), "direction");
  Refused("a.nrrd", Nrrd({{"space directions", "(1,0,0) (0,nan,0) (0,0,1)"}}), "nan");
  Refused("a.nrrd", Nrrd({{"space directions", "(1,0,0) (0,1,0"}}), "bracket");
  Refused("a.nrrd", Nrrd({{"space directions", "(1,0,0) (0,1,0)"}}), "one per axis");
  Refused("a.nrrd", Nrrd({{"space directions", "1 0 0"}}), "vector");
  Refused("a.nrrd", Nrrd({{"space origin", "none"}}), "one vector");
  Refused("a.nrrd", Nrrd({{"space", "left-posterior-superior-time"}}), "time");
  Refused("a.nrrd", Nrrd({{"space units", "\"mm\" \"cm\" \"mm\""}}), "units");
  Refused("a.nrrd", Nrrd({{"data file", "slice%03d.raw 1 4 1"}}), "several files");
  Refused("a.nrrd", Nrrd({{"byte skip", "-2"}}), "byte skip");
  Refused("a.nrrd", Nrrd({{"byte skip", "9223372036854775807"}}), "byte skip");
  Refused("a.nrrd", Nrrd({{"line skip", "5"}}), "line skip");
  Refused("a.nrrd",
          Nrrd({{"dimension", "4"},
                {"sizes", "3 2 3 4"},
                {"kinds", "vector domain domain domain"},
                {"space directions", "none (0,0.25,0) (-0.5,0,0) (0,0,2)"}}),
          "3 numbers per voxel");
  Refused("a.nrrd",
          Nrrd({{"dimension", "4"},
                {"sizes", "2 3 4 5"},
                {"kinds", "domain domain domain time"},
                {"space directions", "(0,0.25,0) (-0.5,0,0) (0,0,2) none"}}),
          "axis 4");
  std::string twice = Nrrd();
  twice.insert(9, "type: uchar\n");
  Refused("a.nrrd", twice, "given twice");
}

TEST_F(ImageHeaderTest, PathsThatAreRefused)
{
  ExpectRefused([] { ReadImageHeader(""); }, Error::Kind::FileSystem, "", "no file name");
  ExpectRefused([&] { ReadImageHeader(Path("missing.mha")); }, Error::Kind::FileSystem, Path("missing.mha"), "no such file");
  ExpectRefused([&] { ReadImageHeader(folder.string()); }, Error::Kind::FileSystem, folder.string(), "folder");
}

TEST_F(ImageHeaderTest, AFileWithoutPermissionIsRefused)
{
  if (geteuid() == 0)
    GTEST_SKIP() << "root may read everything";
  const std::string path = Put("secret.mha", Meta());
  std::filesystem::permissions(path, std::filesystem::perms::none);
  ExpectRefused([&] { ReadImageHeader(path); }, Error::Kind::FileSystem, path, "permitted");
}

TEST_F(ImageHeaderTest, FieldsThatHeadersCanHold)
{
  EXPECT_TRUE(CanHold({"Echorama_Scene", "\"a b\""}));
  EXPECT_FALSE(CanHold({"DimSize", "1 1 1"}));
  EXPECT_FALSE(CanHold({"a key", "x"}));
  EXPECT_FALSE(CanHold({"", "x"}));
  EXPECT_FALSE(CanHold({"key", "two\nlines"}));
  EXPECT_FALSE(CanHold({"key", " blank first"}));
  EXPECT_FALSE(CanHold({"key", std::string(1000000, 'x')}));
}
