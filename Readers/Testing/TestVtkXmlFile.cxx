// SPDX-License-Identifier: BSD-3-Clause
// That VTK reads the good ones is checked in TestUltrasoundReader.py, and by the fuzzer, which reads with VTK.
#include "Readers/VtkXmlFile.h"
#include "Testing/TemporaryFolder.h"

using namespace echorama;
using namespace echorama::testing;

namespace {

class VtkXmlFile : public TemporaryFolder {
protected:
  // A file in which \a from, which must be there, is replaced.
  std::string File(const std::string& from = "", const std::string& to = "") const
  {
    std::string text =
        "<?xml version=\"1.0\"?>\n<!-- a > b <DataArray type=\"x\"/> -->\n"
        "<VTKFile type='ImageData' version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt32\">\n"
        "<ImageData WholeExtent=\"2 3 0 1 0 0\" Origin=\"0 0 0\" Spacing=\"1 1 1\" Direction=\"1 0 0 0 1 0 0 0 1\">\n"
        "<Piece Extent=\"2 3 0 1 0 0\"><PointData>\n"
        "<DataArray type=\"UInt8\" Name=\"a 'b'\" format=\"binary\">BAAAAAECAwQ=</DataArray>\n" // 4 bytes: 1 2 3 4
        "</PointData></Piece></ImageData>\n</VTKFile>\n";
    if (!from.empty()) {
      const std::size_t at = text.find(from);
      EXPECT_NE(at, std::string::npos) << from;
      text.replace(at, from.size(), to);
    }
    return Put("a.vti", text);
  }
  void Refused(const std::string& from, const std::string& to, const std::string& words) const
  {
    const std::string path = File(from, to);
    ExpectRefused([&] { CheckVtkXmlFile(path); }, Error::Kind::BadFile, path, words);
  }
  // Compressed, with these base64 lengths in front of 8 bytes.
  void Blocks(const std::string& lengths, const std::string& words) const
  {
    std::string text = "BAAAAAECAwQ=";
    const std::string path = File("header_type=\"UInt32\"", "compressor=\"vtkZLibDataCompressor\"");
    std::ifstream stream(path);
    std::string whole((std::istreambuf_iterator<char>(stream)), {});
    whole.replace(whole.find(text), text.size(), lengths + "AAAAAAAAAAA=");
    Put("a.vti", whole);
    if (words.empty())
      EXPECT_NO_THROW(CheckVtkXmlFile(path));
    else
      ExpectRefused([&] { CheckVtkXmlFile(path); }, Error::Kind::BadFile, path, words);
  }
};

} // namespace

TEST_F(VtkXmlFile, GoodFilesPassAndMissingGeometryIsNoted)
{
  EXPECT_TRUE(CheckVtkXmlFile(File()).empty());
  EXPECT_EQ(CheckVtkXmlFile(File("Origin=\"0 0 0\" Spacing=\"1 1 1\" ")).size(), 2u);
  EXPECT_TRUE(CheckVtkXmlFile(File("binary", "ascii")).empty());
  EXPECT_TRUE(CheckVtkXmlFile(File("</VTKFile>", "</VTKFile><DataArray/>")).empty()) << "what follows is not of it";
}

TEST_F(VtkXmlFile, ElementsThatVtkWouldNotSurviveAreRefused)
{
  Refused("UInt8", "Floatnan", "type \"Floatnan\"");
  Refused("type=\"UInt8\" ", "", "no type");
  Refused("a 'b'", "a > b", "the Name of a DataArray has a >");
  Refused("binary", "binarx", "binarx");
  Refused("LittleEndian", "MiddleEndian", "MiddleEndian");
  Refused("UInt32", "UInt31", "UInt31");
  Refused("Name", "NumberOfComponents=\"-3\" Name", "NumberOfComponents");
  Refused("Name", "NumberOfTuples=\"100000000000\" Name", "more memory than the file justifies");
  Refused("Piece Extent=\"2 3", "Piece Extent=\"1 3", "beyond the WholeExtent");
  Refused("Piece Extent=\"2 3", "Piece Extent=\"3 2", "empty");
  Refused("Piece Extent=\"2 3 0 1 0 0\"", "Piece", "no Extent");
  Refused("2 3 0 1 0 0", "2 3 0 1 0", "6 are needed");
  Refused("2 3 0 1 0 0", "-2147483648 2147483647 0 1 0 0", "overflows");
  Refused("2 3 0 1 0 0", "0 99999 0 99999 0 99999", "more memory than the file justifies");
  Refused("Spacing=\"1 1 1\"", "Spacing=\"1 x 1\"", "Spacing");
  Refused("type='ImageData'", "type='PolyData'", "PolyData");
  Refused("<ImageData", "<ImageDatum", "lies in no image");
  Refused("<VTKFile", "<!DOCTYPE x><VTKFile", "declaration");
  Refused(" -->", "", "comment has no end");
  Refused("Name=\"a 'b'\"", "Name=\"a 'b'", "has no end");
  Refused("Name", "type=\"UInt8\" Name", "twice");
  Refused("Name", "NumberOfComponents\n=\"-3\" Name", "NumberOfComponents");
  Refused("<DataArray type=\"UInt8\"", "<Foo type=\"x\"/><DataArray type=\"UInt8\"", "Foo has the type \"x\"");
  Refused("<ImageData", "<VTKFile type=\"ImageData\"/><ImageData", "or has two");
  Refused("<VTKFile", "<x/><VTKFile", "does not begin with a VTKFile");
  Refused("<Piece", "<Pieces", "no piece");
  Refused("<Piece", "<FieldData><Foo NumberOfTuples=\"3\" Name=\"b\"/></FieldData><Piece", "Foo has no type");
  Refused("<Piece", "<FieldData><Foo Name=\"b\"/></FieldData><Piece", "Foo has no type");
  Refused("<PointData>", "<PointData><DataArray type=\"String\" Name=\"s\" format=\"ascii\">65 0</DataArray>",
          "voxels have texts");
  Refused("<Piece", "<InformationKey><vtkQuadratureSchemeDefinition/></InformationKey><Piece", "vtkQuadratureSchemeDefinition");
  Refused("<Piece", "<vtkQuadratureSchemeDefinition type=\"Int8\"/><Piece", "it defines a vtkQuadratureSchemeDefinition");
  Refused("<Piece", "<?a \"?><DataArray type=\"x\"/><?b \"?><Piece", "\"x\"");       // not within quotes
  Refused("<Piece", "<?a ><!-- ?><DataArray type=\"x\"/><?b --> ?><Piece", "\"x\""); // nor in a comment
}

TEST_F(VtkXmlFile, ArraysThatAskForMoreThanTheFileCanHoldAreRefused)
{
  const std::string array = "<DataArray type=\"UInt8\"", million = array + " NumberOfComponents=\"1000000\"";
  EXPECT_NO_THROW(CheckVtkXmlFile(File(array, million))); // of 4 points; the file has some 500 bytes
  const std::string words = "more memory than the file justifies", second = array + " Name=\"b\" ";
  Refused(array, million + " Name=\"b\"/>" + million, words);
  Refused(array, array + " NumberOfTuples=\"0\" NumberOfComponents=\"1000000\" Name=\"b\"/>" + million,
          words);                                                                                           // VTK does not ask it
  Refused(array, "<DataArray type=\"Float64\" Name=\"b\" NumberOfComponents=\"1000000\"/>" + array, words); // 8 bytes each
  Refused("<Piece", "<FieldData>" + second + "NumberOfTuples=\"9000000\"/></FieldData><Piece", words);
  const std::string path = File(array, million), whole = "WholeExtent=\"2 3"; // for all of it, not for the piece
  std::ifstream stream(path);
  std::string text((std::istreambuf_iterator<char>(stream)), {});
  Put("a.vti", text.replace(text.find(whole), whole.size(), "WholeExtent=\"2 9"));
  ExpectRefused([&] { CheckVtkXmlFile(path); }, Error::Kind::BadFile, path, words);
  EXPECT_NO_THROW(CheckVtkXmlFile(File("<Piece", "<FieldData>" + second + "NumberOfComponents=\"1000000\"/></FieldData><Piece")));
  Refused("<PointData>", "<Piece Extent=\"2 3 0 1 0 0\"/><PointData>", "a piece within a piece");
}

TEST_F(VtkXmlFile, PolygonsThatAskForMoreThanTheFileCanHoldAreRefused)
{
  const auto file = [&](int pieces, int points, int components, const std::string& count = "NumberOfPoints") {
    std::string text = "<VTKFile type=\"PolyData\"><PolyData>";
    for (int i = 0; i < pieces; ++i)
      text += "<Piece " + count + "=\"" + std::to_string(points) + "\">" +
              (components == 0
                   ? ""
                   : "<Points><DataArray type=\"UInt8\" NumberOfComponents=\"" + std::to_string(components) + "\"/></Points>") +
              "</Piece>";
    return Put("a.vtp", text + "</PolyData></VTKFile>");
  };
  EXPECT_NO_THROW(CheckVtkXmlFile(file(1, 50000, 3), "PolyData"));
  for (const auto& [pieces, points, components, count] : {std::tuple(1, 50000, 300, "NumberOfPoints"),
                                                          {40, 50000, 0, "NumberOfPoints"},
                                                          {40, 50000, 0, "NumberOfPolys"},
                                                          {40, 50000, 0, "NumberOfStrips"},
                                                          {40, 50000, 0, "NumberOfLines"},
                                                          {40, 50000, 0, "NumberOfVerts"}}) {
    const std::string path = file(pieces, points, components, count);
    ExpectRefused([&] { CheckVtkXmlFile(path, "PolyData"); }, Error::Kind::BadFile, path, "more memory");
  }
}

TEST_F(VtkXmlFile, ElementsThatAreNestedTooDeeplyAreRefused)
{
  std::string open, empty;
  for (int i = 0; i < 200; ++i) {
    open += "<a>";
    empty += "<a b=\"\"c=\"\"/><a/><a></a>";
  }
  Refused("<Piece", open + "<Piece", "nested too deeply");
  EXPECT_NO_THROW(CheckVtkXmlFile(File("<Piece", empty + "<Piece")));
}

TEST_F(VtkXmlFile, AppendedDataAreNamedByTheirElementAlone)
{
  for (const char* before : {"<!-- <AppendedData -->", "<!--- <<AppendedData>-->", "<?a <AppendedData?>",
                             "<x y=\"<AppendedData\"/>", "<AppendedDataOfX/>", "<<AppendedData/>"})
    Refused("<Piece", before + std::string("<Piece"), "names appended data within");
  // Of two, VTK takes the first, whatever it says.
  Refused("</VTKFile>",
          "<AppendedData type=\"Int8\" encoding=\"x\">_</AppendedData><AppendedData encoding=\"raw\">_</AppendedData></VTKFile>",
          "encoding");
  EXPECT_NO_THROW(CheckVtkXmlFile(File("<Piece", "<!-- AppendedData <appendedData --><x y=\"AppendedData\"/><Piece")));
}

TEST_F(VtkXmlFile, LengthsInFrontOfDataAreChecked)
{
  Refused("BAAAAAECAwQ=", "BAAA", "end early");
  Refused("BAAAAAECAwQ=", "////fwECAwQ=", "length");
  Refused("\"binary\"", "\"appended\"", "no offset of its appended data");
  Refused("\"binary\"", "\"appended\" offset=\"0\"", "appended, and there are none");
  for (const char* format : {"", "format=\"ascii\" ", "format=\"binary\" "}) // VTK goes by the offset alone
    Refused("format=\"binary\"", format + std::string("offset=\"0\""), "appended, and there are none");
  Blocks("AQAAAAgAAAAAAAAACAAAAA==", "");       // one block of 8 bytes, none of them in a last one, 8 compressed
  Blocks("AQAAAAAAAEAEAAAACAAAAA==", "");       // blocks of a gigabyte, of which there is only a last one, of 4 bytes
  Blocks("AQAAAAAAAAAAAAAACAAAAA==", "length"); // blocks of no bytes
  Blocks("AQAAAAgAAAAAAAAA////fw==", "length"); // more compressed bytes than the file has
  Blocks("AQAAAAgAAAAJAAAACAAAAA==", "length"); // the last is larger than the others
  Blocks("////fwgAAAAAAAAACAAAAA==", "length"); // more blocks than the file has bytes
  Blocks("AQAAAP///38AAAAACAAAAA==", "length"); // a block larger than could be
}

TEST_F(VtkXmlFile, AppendedDataAreCheckedWhereTheyLie)
{
  const auto appended = [&](const std::string& data, const std::string& encoding, const std::string& offset = "0",
                            const std::string& format = "appended") {
    std::string text = "<VTKFile type=\"ImageData\" byte_order=\"BigEndian\">\n<ImageData WholeExtent=\"0 1 0 1 0 0\">"
                       "<Piece Extent=\"0 1 0 1 0 0\"><PointData><DataArray type=\"UInt8\" format=\"" +
                       format + "\" offset=\"" + offset + "\"/></PointData></Piece></ImageData><AppendedData encoding=\"" +
                       encoding + "\">\n _";
    return Put("a.vti", text + data + "</AppendedData></VTKFile>");
  };
  const std::string good("\0\0\0\4\1\2\3\4", 8), bad("\4\0\0\0\1\2\3\4", 8);
  EXPECT_EQ(CheckVtkXmlFile(appended(good, "raw")).size(), 3u);
  EXPECT_EQ(CheckVtkXmlFile(appended("AAAABAECAwQ=", "base64")).size(), 3u);
  const auto refused = [&](const std::string& path) {
    ExpectRefused([&] { CheckVtkXmlFile(path); }, Error::Kind::BadFile, path, "");
  };
  refused(appended(bad, "raw"));
  refused(appended("BAAAAAECAwQ=", "base64"));
  refused(appended(good, "raw", "400"));
  refused(appended(good, "raw", "-1"));
  refused(appended(good, "raw\">x"));              // _ is not the first
  for (const char* format : {"ascii", "binary"}) { // of which VTK takes no notice, where there is an offset
    EXPECT_EQ(CheckVtkXmlFile(appended(good, "raw", "0", format)).size(), 3u);
    refused(appended(bad, "raw", "0", format));
  }
}

TEST_F(VtkXmlFile, CountsOfPolygonsAreChecked)
{
  const auto file = [&](const std::string& counts) {
    return Put("a.vtp", "<VTKFile type=\"PolyData\"><PolyData><Piece " + counts + "/></PolyData></VTKFile>");
  };
  EXPECT_TRUE(CheckVtkXmlFile(file("NumberOfPoints=\"3\" NumberOfPolys=\"1\""), "PolyData").empty());
  for (const char* counts :
       {"NumberOfPoints=\"-3\"", "NumberOfStrips=\"4000000000\"", "NumberOfPolys=\"1.5\"", "NumberOfLines=\"\""}) {
    const std::string path = file(counts);
    ExpectRefused([&] { CheckVtkXmlFile(path, "PolyData"); }, Error::Kind::BadFile, path, "NumberOf");
  }
  const std::string path = file("");
  ExpectRefused([&] { CheckVtkXmlFile(path); }, Error::Kind::BadFile, path, "PolyData");
  const std::string image = File();
  ExpectRefused([&] { CheckVtkXmlFile(image, "PolyData"); }, Error::Kind::BadFile, image, "ImageData");
}
