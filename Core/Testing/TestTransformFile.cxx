// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Random.h"
#include "Core/Geometry/RigidTransform.h"
#include "Core/Geometry/TransformFile.h"
#include "Testing/TemporaryFolder.h"
#include <clocale>

using namespace echorama;
using namespace echorama::testing;

namespace {

const std::string Unit = "1 0 0 0  0 1 0 0  0 0 1 0  0 0 0 1";
const std::string UnitRows = "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]";

class TransformFile : public TemporaryFolder {
protected:
  static std::string Plus(const std::string& elements)
  {
    return "<PlusConfiguration version=\"2.1\"><DataCollection/><CoordinateDefinitions>" + elements +
           "</CoordinateDefinitions></PlusConfiguration>";
  }
  static std::string Element(const std::string& from, const std::string& to, const std::string& matrix = Unit,
                             const std::string& more = "")
  {
    return "<Transform From=\"" + from + "\" To=\"" + to + "\" Matrix=\"" + matrix + "\" " + more + "/>";
  }
  static std::string Ours(const std::string& transforms,
                          const std::string& head = R"("schema":"echorama-transforms-1","unit":"mm")")
  {
    return "{" + head + ",\"transforms\":[" + transforms + "]}";
  }
  static std::string Object(const std::string& matrix = UnitRows, const std::string& more = "")
  {
    return R"({"from":"A","to":"B","matrix":)" + matrix + more + "}";
  }
  std::vector<NamedTransform> Read(const std::string& text) const { return ReadTransforms(Put("t", text)); }
  void Refused(const std::string& text, const std::string& words, Error::Kind kind = Error::Kind::BadFile) const
  {
    const std::string path = Put("t", text);
    ExpectRefused([&] { ReadTransforms(path); }, kind, path, words);
  }
};

NamedTransform SomeTransform(std::uint64_t seed)
{
  Random random(5, seed);
  NamedTransform t;
  t.from = "Frame" + std::to_string(seed);
  t.to = "Frame" + std::to_string(seed + 1);
  t.matrix.linear() = 0.08 * ExpRotation(2.0 * random.Direction());
  t.matrix.translation() = 50.0 * random.Direction();
  t.matrix.makeAffine();
  return t;
}

} // namespace

TEST_F(TransformFile, EveryBitComesBack)
{
  std::vector<NamedTransform> written;
  for (std::uint64_t i = 0; i < 6; ++i)
    written.push_back(SomeTransform(i));
  written[1].status = TransformStatus::Missing;
  written[2].status = TransformStatus::OutOfRange;
  written[3].errorMm = 0.1 + 0.2;
  written[4].date = "2011.12.06 17:57:00";
  written[5].to = "Pr\xc3\xbc"
                  "fk\xc3\xb6rper\"1";
  written[5].matrix.linear().col(2).setZero();
  written[5].matrix.translation() << -0.0, 5e-324, 1.7976931348623157e308;
  WriteTransforms(Path("t.json"), written);
  EXPECT_EQ(FileCount(), 1) << "no temporary file stays";
  const auto back = ReadTransforms(Path("t.json"));
  ASSERT_EQ(back.size(), written.size());
  for (std::size_t i = 0; i < back.size(); ++i) {
    EXPECT_EQ(back[i].from, written[i].from);
    EXPECT_EQ(back[i].to, written[i].to);
    EXPECT_EQ(std::memcmp(back[i].matrix.data(), written[i].matrix.data(), 16 * sizeof(double)), 0) << i;
    EXPECT_EQ(back[i].status, written[i].status);
    EXPECT_EQ(back[i].errorMm, written[i].errorMm);
    EXPECT_EQ(back[i].date, written[i].date);
  }
}

TEST_F(TransformFile, KeepsAReport)
{
  const std::string path = Path("t.json");
  WriteTransforms(path, {SomeTransform(1)}, R"({"kind": "hand-eye", "inliers": 7})");
  EXPECT_EQ(ReadTransforms(path).size(), 1u);
  EXPECT_EQ(ReadTransformReport(path), R"({"kind":"hand-eye","inliers":7})");
  EXPECT_THROW(WriteTransforms(path, {SomeTransform(1)}, "{"), Error);
  EXPECT_THROW(WriteTransforms(path, {SomeTransform(1)}, "[1]"), Error);
  EXPECT_FALSE(ReadTransformReport(path).empty()) << "a refused report leaves the file";
  WriteTransforms(path, {SomeTransform(1)});
  EXPECT_EQ(ReadTransformReport(path), "");
}

TEST_F(TransformFile, ReadsWhatPlusWrites)
{
  const std::string plus = std::string(ECHORAMA_SOURCE_DIR) + "/../shared/data/plus/";
  if (!std::filesystem::exists(plus))
    GTEST_SKIP() << plus << " is not there";
  const auto spine = ReadTransforms(plus + "PlusDeviceSet_SpinePhantomFreehandReconstructionOnly.xml");
  ASSERT_EQ(spine.size(), 2u);
  EXPECT_EQ(spine[0].Name(), "ImageToProbe");
  EXPECT_EQ(spine[0].matrix(0, 0), -0.00157821);
  EXPECT_EQ(spine[0].matrix(0, 3), 15.3978);
  EXPECT_EQ(spine[0].matrix(2, 2), 0.0803604);
  EXPECT_EQ(spine[0].errorMm, 1.68149);
  EXPECT_EQ(spine[0].date, "022312_110631");
  EXPECT_EQ(spine[0].status, TransformStatus::Valid);
  EXPECT_EQ(spine[1].Name(), "PhantomToReference");

  const auto calibration = ReadTransforms(plus + "PlusDeviceSet_fCal_Sim_SpatialCalibration_2.0.xml");
  ASSERT_EQ(calibration.size(), 4u);
  EXPECT_FALSE(calibration[0].errorMm);
  const ComposedTransform found = TransformGraph(calibration).Find("Image", "TransducerOrigin");
  EXPECT_EQ(found.PathText(), "ImageToTransducerOriginPixel, TransducerOriginPixelToTransducerOrigin");
  EXPECT_DOUBLE_EQ(found.matrix(0, 3), -410.0 * 0.0796446);
  EXPECT_FALSE(found.errorMm);
  EXPECT_EQ(TransformGraph(calibration).Find("StylusTip", "Stylus").errorMm, 0.450335);
}

TEST_F(TransformFile, NumbersAndNamesOfPlus)
{
  const char* comma = std::setlocale(LC_ALL, "de_DE.UTF-8"); // where it is installed
  const auto read = Read("\xef\xbb\xbf <?xml version='1.0'?><!DOCTYPE a [<!ENTITY b 'x'>]>\n" +
                         Plus(Element("image", "probe", "+1e-005\t.5\r\n0 1. 0 1E2 0 0  0 0 -1 0  0 0 1e-17 1",
                                      "Error='-1' Status='out_of_view' Date='&lt;today&gt;' Persistent='FALSE'") +
                              "<Other From='1'/>"));
  if (comma)
    std::setlocale(LC_ALL, "C");
  ASSERT_EQ(read.size(), 1u);
  EXPECT_EQ(read[0].Name(), "ImageToProbe");
  EXPECT_EQ(read[0].matrix(0, 0), 1e-5);
  EXPECT_EQ(read[0].matrix(0, 1), 0.5);
  EXPECT_EQ(read[0].matrix(1, 1), 100.0);
  EXPECT_EQ(read[0].matrix(3, 2), 0.0);
  EXPECT_FALSE(read[0].errorMm) << "negative: not known";
  EXPECT_EQ(read[0].status, TransformStatus::OutOfRange);
  EXPECT_EQ(read[0].date, "<today>");
  EXPECT_TRUE(Read(Plus("")).empty()) << "no transforms are no error";
}

TEST_F(TransformFile, RefusesBadXml)
{
  ASSERT_EQ(Read(Plus(Element("A", "B"))).size(), 1u);
  Refused("", "neither");
  Refused("   \n", "neither");
  Refused("ObjectType = Image", "neither");
  Refused(std::string(100, '\0'), "neither");
  Refused("<PlusConfiguration><CoordinateDefinitions>", "not XML");
  Refused("<", "not XML");
  Refused("<PlusConfiguration/>", "no CoordinateDefinitions");
  Refused("<?xml version='1.0'?>", "XML");
  Refused("<a><b><CoordinateDefinitions/></b></a>", "no CoordinateDefinitions");
  Refused(Plus("<Transform To='B' Matrix='" + Unit + "'/>"), "transform 1: From is missing");
  Refused(Plus(Element("A", "B") + "<Transform From='B' Matrix='" + Unit + "'/>"), "transform 2: To is missing");
  Refused(Plus("<Transform From='A' To='B'/>"), "Matrix is missing");
  Refused(Plus(Element("", "B")), "names");
  Refused(Plus(Element("A", "B C")), "blanks");
  Refused(Plus(Element("A", "A")), "itself");
  Refused(Plus(Element("a", "A")), "itself");
  Refused(Plus(Element("A", "B", Unit.substr(2))), "AToB: Matrix holds 15 values");
  Refused(Plus(Element("A", "B", Unit + " 1")), "17 values");
  Refused(Plus(Element("A", "B", "")), "0 values");
  Refused(Plus(Element("A", "B", "x" + Unit.substr(1))), "\"x\", which is not a number");
  Refused(Plus(Element("A", "B", "1,0" + Unit.substr(1))), "\"1,0\"");
  Refused(Plus(Element("A", "B", "nan" + Unit.substr(1))), "not finite");
  Refused(Plus(Element("A", "B", "inf" + Unit.substr(1))), "not finite");
  Refused(Plus(Element("A", "B", "1e999" + Unit.substr(1))), "not a number");
  Refused(Plus(Element("A", "B", "1.#QNAN" + Unit.substr(1))), "not a number");
  Refused(Plus(Element("A", "B", Unit.substr(0, Unit.size() - 1) + "2")), "last row");
  for (const char* error : {"", "x", "nan", "1 2"})
    Refused(Plus(Element("A", "B", Unit, std::string("Error='") + error + "'")), "Error is");
  Refused(Plus(Element("A", "B") + Element("A", "B", "2" + Unit.substr(1))), "AToB is given twice");
  EXPECT_EQ(Read(Plus(Element("A", "B") + Element("A", "B"))).size(), 1u) << "twice the same is no contradiction";
  ExpectRefused([&] { ReadTransforms(Path("missing.xml")); }, Error::Kind::FileSystem, Path("missing.xml"), "cannot be read");
  ExpectRefused([&] { ReadTransforms(folder.string()); }, Error::Kind::FileSystem, folder.string(), "cannot be read");
}

TEST_F(TransformFile, RefusesBadJson)
{
  ASSERT_EQ(Read(Ours(Object())).size(), 1u);
  Refused("[1,2]", "neither");
  Refused("{", "not JSON");
  Refused(Ours(Object()) + "x", "not JSON");
  Refused("{}", "\"schema\" is missing");
  Refused(Ours(Object(), R"("schema":"echorama-poses-1","unit":"mm")"), "\"schema\" is \"echorama-poses-1\"");
  Refused(Ours(Object(), R"("schema":"echorama-transforms-1","unit":"cm")"), "unit");
  Refused(Ours(Object(), R"("schema":"echorama-transforms-1")"), "unit");
  Refused(R"({"schema":"echorama-transforms-1","unit":"mm"})", "\"transforms\" is missing");
  Refused(R"({"schema":"echorama-transforms-1","unit":"mm","transforms":{}})", "not a list");
  Refused(Ours("7"), "\"from\" is missing");
  Refused(Ours(R"({"from":"A","matrix":)" + UnitRows + "}"), "transform 1: \"to\" is missing");
  Refused(Ours(R"({"from":3,"to":"B","matrix":)" + UnitRows + "}"), "from: a text is needed, not 3");
  Refused(Ours(R"({"from":"A","to":"A","matrix":)" + UnitRows + "}"), "itself");
  Refused(Ours(R"({"from":"A","to":"B"})"), "AToB: \"matrix\" is missing");
  for (const char* matrix :
       {"[[1,0,0,0],[0,1,0,0],[0,0,1,0]]", "[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]", "7", "[[1,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]",
        "[[null,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]", "[[\"1\",0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"})
    Refused(Ours(Object(matrix)), "AToB, matrix");
  Refused(Ours(Object("[[1e999,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]")), "JSON");
  Refused(Ours(Object("[[NaN,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]")), "JSON");
  Refused(Ours(Object("[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0.1,1]]")), "last row");
  Refused(Ours(Object(UnitRows, R"(,"errorMm":-1)")), "error is negative");
  Refused(Ours(Object(UnitRows, R"(,"errorMm":"1")")), "errorMm: a number is needed");
  Refused(Ours(Object(UnitRows, R"(,"status":true)")), "status: a text");
  Refused(Ours(Object(UnitRows, R"(,"date":[])")), "date: a text");
  Refused(Ours(Object() + "," + Object("[[1,0,0,1],[0,1,0,0],[0,0,1,0],[0,0,0,1]]")), "given twice");
}

TEST_F(TransformFile, SingularMatricesAreOneWay)
{
  const TransformGraph graph(Read(Plus(Element("Image", "Probe", "1 0 0 0  0 1 0 0  0 0 0 0  0 0 0 1"))));
  EXPECT_NO_THROW(graph.Find("Image", "Probe"));
  EXPECT_THROW(graph.Find("Probe", "Image"), Error);
}

TEST_F(TransformFile, CyclesMustClose)
{
  const std::string moved = "1 0 0 0  0 1 0 0.5  0 0 1 0  0 0 0 1";
  EXPECT_EQ(Read(Plus(Element("A", "B") + Element("B", "C", moved) + Element("A", "C", moved))).size(), 3u);
  const std::string open = Plus(Element("A", "B") + Element("B", "C", moved) + Element("A", "C"));
  Refused(open, "the cycle");
  Refused(open, "off by 0.5 mm");
  Refused(Plus(Element("A", "B", moved) + Element("B", "A", moved)), "off by 1 mm");
  EXPECT_EQ(ReadTransforms(Put("t", open), {0.6, 0.1, 100.0}).size(), 3u);
}

TEST_F(TransformFile, AttacksAreRefusedQuickly)
{
  const std::size_t million = 1000000;
  std::string deep(million, '[');
  Refused("{\"a\":" + deep, "nested");
  std::string elements;
  for (std::size_t i = 0; i < million; ++i)
    elements += "<a>";
  Refused(elements, "not XML");
  for (std::size_t i = 0; i < million; ++i)
    elements += "</a>";
  Refused(elements, "no CoordinateDefinitions");
  const std::string matrix = "&b;" + Unit.substr(1);
  Refused("<!DOCTYPE a [<!ENTITY a '1'><!ENTITY b '&a;&a;&a;'>]>" + Plus(Element("A", "B", matrix)), "&b;");
  Refused("<!DOCTYPE a [<!ENTITY b SYSTEM 'file:///etc/passwd'>]>" + Plus(Element("A", "B", matrix)), "&b;");
  Refused("{\"" + std::string(17 * million, 'x') + "\":1}", "16777216 bytes");
  Refused("{\"schema\":\"" + std::string(million, 'x') + "\"}", "...");
}

TEST_F(TransformFile, TooManyAreRefused)
{
  const auto ladder = [](int count) { // of two rails, whose rungs close cycles of up to all of them
    std::string text;
    for (int i = 0; i < count; ++i)
      text += Element("F" + std::to_string(i / 2), "F" + std::to_string(i / 2 + 1 + i % 2));
    return Plus(text);
  };
  EXPECT_EQ(Read(ladder(1000)).size(), 1000u);
  Refused(ladder(1001), "it holds 1001 transforms");
  std::string same = Object();
  for (int i = 0; i < 1000; ++i)
    same += "," + Object();
  Refused(Ours(same), "it holds 1001 transforms");
}

TEST_F(TransformFile, AFailedWriteLeavesWhatWasThere)
{
  std::vector<NamedTransform> transforms{SomeTransform(1)};
  const auto refused = [&](NamedTransform bad, const std::string& words) {
    ExpectRefused([&] { WriteTransforms(Path("t.json"), {bad}); }, Error::Kind::InvalidParameter, Path("t.json"), words);
  };
  NamedTransform bad = transforms[0];
  bad.to = bad.from;
  refused(bad, "itself");
  bad = transforms[0];
  bad.matrix.translation()[0] = std::numeric_limits<double>::infinity();
  refused(bad, "finite");
  bad.status = TransformStatus::Missing;
  refused(bad, "finite");
  bad = transforms[0];
  bad.date = "\xff";
  refused(bad, "UTF-8");
  ExpectRefused(
      [&] {
        WriteTransforms(Path("t.json"), {transforms[0], transforms[0]});
      },
      Error::Kind::InvalidParameter, Path("t.json"), "given twice");
  EXPECT_THROW(WriteTransforms(Path("missing/t.json"), transforms), Error);
  EXPECT_EQ(FileCount(), 0);

  WriteTransforms(Path("t.json"), transforms);
  for (std::uint64_t i = 2; i < 100; ++i)
    transforms.push_back(SomeTransform(i));
  {
    const FullDisk full(1000);
    EXPECT_THROW(WriteTransforms(Path("t.json"), transforms), Error);
  }
  EXPECT_EQ(ReadTransforms(Path("t.json")).size(), 1u);
  EXPECT_EQ(FileCount(), 1);
}

TEST_F(TransformFile, IsRecognisedByItsContent)
{
  WriteTransforms(Path("t"), {SomeTransform(1)});
  std::stringstream text;
  text << std::ifstream(Path("t")).rdbuf();
  EXPECT_TRUE(LooksLikeTransforms(text.str()));
  EXPECT_TRUE(LooksLikeTransforms("\xef\xbb\xbf\n<?xml version='1.0'?><!-- a -->\n<PlusConfiguration version=\"2.1\">"));
  for (const char* other : {"", " ", "<VTKFile type=\"ImageData\">", "{\"schema\": \"echorama-poses-1\"", "ObjectType = Image",
                            "echorama-transforms-1", "x<PlusConfiguration"})
    EXPECT_FALSE(LooksLikeTransforms(other)) << other;
}
