// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Geometry/LandmarkFile.h"
#include "Testing/TemporaryFolder.h"

using namespace echorama;
using namespace echorama::testing;
using Eigen::Vector3d;

namespace {

class LandmarkFile : public TemporaryFolder {
protected:
  std::vector<Landmark> Read(const std::string& text) const { return ReadLandmarks(Put("landmarks", text)); }
  void Refused(const std::string& text, const std::string& words) const
  {
    const std::string path = Put("landmarks", text);
    ExpectRefused([&] { ReadLandmarks(path); }, Error::Kind::BadFile, path, words);
  }
  static std::string Markups(const std::string& points, const std::string& head = R"("coordinateSystem":"LPS")")
  {
    return R"({"@schema":"markups-schema-v1.0.3.json#","markups":[{"type":"Fiducial",)" + head + R"(,"controlPoints":[)" +
           points + "]}]}";
  }
};

const std::string Point = R"({"id":"1","label":"F-1","position":[1.5,-20,3e0]})";

// In the layout of a file of Slicer 4.11, with its own numbers.
const std::string Fcsv = "# Markups fiducial file version = 4.11\n"
                         "# CoordinateSystem = LPS\n"
                         "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
                         "vtkMRMLMarkupsFiducialNode_0,22.5,31.25,-4,0,0,0,1,1,1,0,apex,,vtkMRMLScalarVolumeNode1\n"
                         "vtkMRMLMarkupsFiducialNode_1,1,2,3,0,0,0,1,1,1,0,\"left, \"\"upper\"\"\",a vessel,\n";

void ExpectIs(const Landmark& landmark, const std::string& label, const Vector3d& position)
{
  EXPECT_EQ(landmark.label, label);
  EXPECT_EQ(landmark.position, position) << label;
}

std::string Replaced(std::string text, const std::string& from, const std::string& to)
{
  return text.replace(text.find(from), from.size(), to);
}

} // namespace

TEST_F(LandmarkFile, MarkupsInBothFrames)
{
  ExpectIs(Read(Markups(Point)).at(0), "F-1", {1.5, -20, 3});
  ExpectIs(Read(Markups(Point, R"("coordinateSystem":"RAS")")).at(0), "F-1", {-1.5, 20, 3});
  ExpectIs(Read(Markups(Point, R"("coordinateUnits":"mm")")).at(0), "F-1", {1.5, -20, 3});
  ExpectIs(Read(Markups(Point, R"("coordinateUnits":["mm","UCUM","millimeter"])")).at(0), "F-1", {1.5, -20, 3});
  const auto two =
      Read(Markups(Point + R"(,{"position":[1,2,3],"positionStatus":"undefined"},{"label":"b","position":[4,5,6]})"));
  ASSERT_EQ(two.size(), 2u);
  ExpectIs(two[1], "b", {4, 5, 6});
}

TEST_F(LandmarkFile, BadMarkups)
{
  Refused("{", "not JSON");
  Refused("{}", "\"markups\" is missing");
  Refused(R"({"markups":3})", "not a list");
  Refused(R"({"markups":[3]})", "markup 1: it is not a JSON object");
  Refused(Markups(""), "holds no landmarks");
  Refused(Markups(Point, R"("coordinateSystem":"IJK")"), "LPS or RAS is needed");
  Refused(Markups(Point, R"("coordinateUnits":"um")"), "the unit is \"um\"; mm is needed");
  Refused(Markups(Point + R"(,{"label":"x"})"), "control point 2: \"position\" is missing");
  Refused(Markups(R"({"position":[1,2]})"), "a list of 3 numbers is needed");
  Refused(Markups(R"({"position":[1,2,"3"]})"), "a number is needed");
  Refused(Markups(R"({"position":[1,2,1e8]})"), "not a number within 1e7 mm");
  Refused(Markups(R"({"label":3,"position":[1,2,3]})"), "a text is needed");
}

TEST_F(LandmarkFile, FiducialsInBothFrames)
{
  const auto lps = Read(Fcsv);
  ASSERT_EQ(lps.size(), 2u);
  ExpectIs(lps[0], "apex", {22.5, 31.25, -4});
  ExpectIs(lps[1], "left, \"upper\"", {1, 2, 3});
  ExpectIs(Read(Replaced(Fcsv, "LPS", "1")).at(0), "apex", {22.5, 31.25, -4});
  for (const std::string ras : {"0", "RAS"})
    ExpectIs(Read(Replaced(Fcsv, "LPS", ras)).at(0), "apex", {-22.5, -31.25, -4});
  ExpectIs(Read(Replaced(Fcsv, "# CoordinateSystem = LPS\n", "")).at(0), "apex", {-22.5, -31.25, -4}); // as old files are meant
  ExpectIs(Read("# CoordinateSystem = 1\nid,1,2,3,0,0,0,1,1,1,0,x\r\n").at(0), "x", {1, 2, 3});
  ExpectIs(Read("# Markups fiducial file version = 4.11\n# CoordinateSystem = 1\n# columns = label,z,y,x\na,3,2,1\n").at(0), "a",
           {1, 2, 3});
}

TEST_F(LandmarkFile, Slicer5AddsTwoCellsThatItDoesNotName)
{
  const auto row = [](const std::string& label, const std::string& end) {
    return "1,22.5,31.25,-4,0,0,0,1,1,1,0," + label + ",,," + end + "\n";
  };
  const std::string head = Fcsv.substr(0, Fcsv.find("vtkMRML"));
  const std::vector<Landmark> landmarks =
      Read(head + row("defined", "2,0") + row("undefined", "0,0") + row("missing", "3,1") + row("last", "2,1"));
  ASSERT_EQ(landmarks.size(), 2u);
  ExpectIs(landmarks[0], "defined", {22.5, 31.25, -4});
  EXPECT_EQ(landmarks[1].label, "last");
  Refused(head + row("a", "5,0"), "it has 16 cells"); // two decimal commas
  Refused(head + row("a", "2,25"), "it has 16 cells");
}

TEST_F(LandmarkFile, BadFiducials)
{
  Refused(Replaced(Fcsv, "LPS", "2"), "line 2: the coordinate system is \"2\"; 0 (RAS) or 1 (LPS) is needed, not voxel indices");
  Refused(Replaced(Fcsv, "LPS", "scanner"), "\"scanner\"");
  Refused(Replaced(Fcsv, ",label", ",title"), "line 3: columns label, x, y and z are needed");
  Refused(Replaced(Fcsv, "31.25", "31,25"), "line 4: it has 15 cells, and there are 14 columns; a decimal point is needed");
}

TEST_F(LandmarkFile, PlainTables)
{
  const auto plain = Read("a,1,2,3\n\n# a comment\n b b , 4 ,+5,-6e1\n");
  ASSERT_EQ(plain.size(), 2u);
  ExpectIs(plain[0], "a", {1, 2, 3});
  ExpectIs(plain[1], "b b", {4, 5, -60});
  ExpectIs(Read("\xef\xbb\xbfName,X,Y,Z\r\na,1,2,3").at(0), "a", {1, 2, 3});
  ExpectIs(Read("z,y,x,label\n3,2,1,a").at(0), "a", {1, 2, 3});
  const auto slicer = Read("label,r,a,s,defined,selected\na,1,2,3,1,1\nb,4,5,6,0,1\n");
  ASSERT_EQ(slicer.size(), 1u);
  ExpectIs(slicer[0], "a", {-1, -2, 3});
  ExpectIs(Read("label,l,p,s,defined\na,1,2,3,1\n").at(0), "a", {1, 2, 3});
  ExpectIs(Read("1,2,3,4\n").at(0), "1", {2, 3, 4}); // labels may be numbers
}

TEST_F(LandmarkFile, BadTables)
{
  Refused("", "holds no landmarks");
  Refused("label,x,y,z\n", "holds no landmarks");
  Refused("a,1,2\n", "line 1: a coordinate is missing; it has only 3 cells");
  Refused("a,1,2,3\nb,1,two,3\n", "line 2: \"two\" is not a number");
  Refused("a,1,5,2,5,3,5\n", "it has 7 cells, and there are 4 columns");
  Refused("a,1,2,nan\n", "not a number within 1e7 mm");
  Refused("a,1,2,inf\n", "not a number within 1e7 mm");
  Refused("label,x,y\na,1,2\n", "names of columns");
  Refused("\"a,1,2,3\n", "a quotation mark is not closed");
  Refused(std::string("a,1,2,3\nb\0c,1,2,3\n", 18), "binary data");
}
