// SPDX-License-Identifier: BSD-3-Clause
#include "Readers/PoseLog.h"
#include "Readers/SequenceWriter.h"
#include "Readers/Testing/Effort.h"
#include "Testing/TemporaryFolder.h"
#include <cmath>

using namespace echorama;
using namespace echorama::testing;
using Eigen::Vector3d;

namespace {

class PoseLogFile : public TemporaryFolder {
protected:
  PoseLog Read(const std::string& text, const PoseLogOptions& options = {}) const
  {
    return ReadPoseLog(Put("log.csv", text), options);
  }
  void Refused(const std::string& text, const std::string& words) const
  {
    const std::string path = Put("log.csv", text);
    ExpectRefused([&] { ReadPoseLog(path); }, Error::Kind::BadFile, path, words);
  }
};

std::string Data(const std::string& name)
{
  const std::string path = std::string(ECHORAMA_SOURCE_DIR) + "/../shared/data/" + name;
  return std::filesystem::exists(path) ? path : "";
}

bool HasNote(const PoseLog& log, const std::string& words)
{
  for (const std::string& note : log.notes)
    if (note.find(words) != std::string::npos)
      return true;
  return false;
}

const std::string Head = "time,tool,tx,ty,tz,qw,qx,qy,qz,status\n";

// Two sensors, as the Aurora tools write them.
const std::string Ndi = "Test Date: \r\n"
                        "day, month, year, hour, minute, second, milliseconds\r\n"
                        "2, 2, 2021, 11, 59 , 59 , 821 \r\n\r\n"
                        "Sample:,Hour,Minutes,Seconds,ms,Xa,Ya,Za,qoa,qxa,qya,qza,Xb,Yb,Zb,qob,qxb,qyb,qzb\r\n"
                        "1, 11 , 59 , 59, 821,0, 0, 0, 0, 0, 0, 0, 1.5 , -2 , 3, 0.6 , 0.8 , 0, 0, \r\n"
                        "2, 12 , 0 , 0, 21,1,2,3,1,0,0,0, 1.5 , -2 , 3, 0.6 , 0.8 , 0, 0, \r\n"
                        "3, 1 , 0 , 0, 21,1,2,3,1,0,0,0, 1.5 , -2 , 3, 0.6 , 0.8 , 0, 0, \r\n";

std::string Identity(const std::string& x)
{
  return "1,0,0," + x + ",0,1,0,0,0,0,1,0,0,0,0,1";
}

} // namespace

// Files that are made to cost time: 16 times as much of them must not cost 256 times the effort.
TEST_F(PoseLogFile, EffortGrowsWithTheLengthOfTheFile)
{
  const auto columns = [this](int size) {
    std::string text;
    for (int i = 0; i < 1000 * size; ++i)
      text += "q0,";
    return Put("columns" + std::to_string(size), text + "time\n1\n");
  };
  const auto sensors = [this](int size) { // and rows that end before the second
    std::string text = "time", rows;
    for (int i = 0; i < 100 * size; ++i)
      for (const char* name : {"x", "y", "z", "qw", "qx", "qy", "qz"})
        text += std::string(",") + name + std::to_string(i);
    for (int i = 0; i < 1000 * size; ++i)
      rows += "\n" + std::to_string(i) + ",1,2,3,1,0,0,0";
    return Put("sensors" + std::to_string(size), text + rows + "\n");
  };
  const auto arrivals = [this](int size) {
    std::string text = "NDims = 3\nDimSize = 0 0 1\nElementType = MET_OTHER\nKinds = domain domain list\n";
    for (int i = 0; i < 500 * size; ++i) {
      const std::string key = "Seq_Frame0000_A" + std::to_string(i) + "ToB";
      text += key + "Transform = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n" + key + "Arrival = 3\n";
    }
    return Put("arrivals" + std::to_string(size), text + "Seq_Frame0000_Timestamp = 2\nElementDataFile = LOCAL\n");
  };
  const auto seconds = [](const std::string& path) {
    return ProcessorSeconds([&] {
      try {
        ReadPoseLog(path);
      } catch (const Error&) { // columns alone are no log
      }
    });
  };
  EXPECT_LT(seconds(columns(16)), 128 * seconds(columns(1)));
  EXPECT_LT(seconds(sensors(16)), 128 * seconds(sensors(1)));
  EXPECT_LT(seconds(arrivals(16)), 128 * seconds(arrivals(1)));
  EXPECT_EQ(ReadPoseLog(Path("sensors1")).poses.size(), 1000u);
  EXPECT_EQ(ReadPoseLog(Path("arrivals1")).poses.back().arrival, 3.0);
}

TEST_F(PoseLogFile, SensorsComeInTheOrderOfTheirFirstColumns)
{
  // Their columns lie among each other; the second row ends within both, and the third before the first's quaternion.
  const PoseLog log = Read("time,xb,yb,zb,xa,ya,za,qoa,qxa,qya,qza,qob,qxb,qyb,qzb\n"
                           "1,1,2,3,4,5,6,1,0,0,0,1,0,0,0\n"
                           "2,1,2,3,4,5,6,1,0,0,0,1\n"
                           "3,1,2,3\n");
  EXPECT_EQ(log.tools, (std::vector<std::string>{"SensorBToTracker", "SensorAToTracker"}));
  ASSERT_EQ(log.poses.size(), 3u);
  EXPECT_EQ(log.poses[0].name, "SensorBToTracker");
  EXPECT_EQ(log.poses[2].name, "SensorAToTracker");
  EXPECT_TRUE(HasNote(log, "line 3 and 1 more: the row ends early"));
  Refused("time,x,y,z,qw,qx,qy,qz\n1,1,no\n", "\"no\" is not a number"); // though it ends early
}

TEST_F(PoseLogFile, PlainTable)
{
  const PoseLog log = Read(Head + "1.5,Probe,1,2,3,0.6,0.8,0,0,OK\n"
                                  "1.25,ReferenceToTracker,-4,5e0,+6,1,0,0,0,OUT_OF_VIEW\n"
                                  "1.75,Probe,9,9,9,1,0,0,0,MISSING\n");
  ASSERT_EQ(log.tools, (std::vector<std::string>{"ProbeToTracker", "ReferenceToTracker"}));
  ASSERT_EQ(log.poses.size(), 3u);
  EXPECT_EQ(log.poses[0].time, 1.25); // sorted
  EXPECT_EQ(log.poses[0].status, TransformStatus::OutOfRange);
  EXPECT_EQ(log.poses[0].pose.translation(), Vector3d(-4, 5, 6));
  const std::vector<ToolPose> probe = log.Of("Probe");
  ASSERT_EQ(probe.size(), 2u);
  // (0.6, 0.8 x): y turns to 2 * 0.6 * 0.8 z and (0.36 - 0.64) y.
  EXPECT_LT((probe[0].pose.linear() * Vector3d::UnitY() - Vector3d(0, -0.28, 0.96)).norm(), 1e-12);
  EXPECT_EQ(probe[0].status, TransformStatus::Valid);
  EXPECT_EQ(probe[1].status, TransformStatus::Missing);
  ExpectRefused([&] { log.Of("Stylus"); }, Error::Kind::BadInput, log.path, "ProbeToTracker, ReferenceToTracker");
}

TEST_F(PoseLogFile, ColumnsByName)
{
  for (const std::string text :
       {"t, x, y, z, q_x, q_y, q_z, q_w\n2,1,2,3,0.8,0,0,0.6\n", "# timestamp tx ty tz qx qy qz qw\n2 1 2 3 .8 0 0 .6\n",
        "\xef\xbb\xbfQ0;Q1;Q2;Q3;X;Y;Z;\"Time\"\r\n0.6;0.8;0;0;1;2;3;2\r\n"}) {
    const PoseLog log = Read(text);
    ASSERT_EQ(log.poses.size(), 1u) << text;
    EXPECT_EQ(log.poses[0].name, "ToolToTracker");
    EXPECT_EQ(log.poses[0].time, 2.0);
    EXPECT_EQ(log.poses[0].pose.translation(), Vector3d(1, 2, 3));
    EXPECT_NEAR(log.poses[0].pose.linear()(2, 1), 0.96, 1e-12);
    EXPECT_TRUE(log.notes.empty());
  }
  EXPECT_EQ(Read("t,x,y,z,qw,qx,qy,qz\n0,1,2,3,1,0,0,0\n", {1000.0}).poses[0].pose.translation(), Vector3d(1000, 2000, 3000));
}

TEST_F(PoseLogFile, MetresAreSuspected)
{
  const std::string names = "t,x,y,z,qw,qx,qy,qz\n", metres = names + "0,0.1,0.2,0,1,0,0,0\n1,0.1,-0.17,0,1,0,0,0\n";
  EXPECT_TRUE(HasNote(Read(metres), "all positions lie within 0.224 mm; if they are metres, give the unit 1000"));
  EXPECT_TRUE(Read(metres, {1000.0}).notes.empty());
  EXPECT_TRUE(Read(metres, {1.0}).notes.empty());                                // they are mm: it has been said
  EXPECT_TRUE(Read(metres + "2,0,0,10,1,0,0,0\n").notes.empty());                // a field of a tracker
  EXPECT_TRUE(Read(names + "0,0,0,0,1,0,0,0\n1,0,0,0,1,0,0,0\n").notes.empty()); // nothing that moves
}

TEST_F(PoseLogFile, NdiTable)
{
  const PoseLog log = Read(Ndi);
  ASSERT_EQ(log.tools, (std::vector<std::string>{"SensorAToTracker", "SensorBToTracker"}));
  const std::vector<ToolPose> a = log.Of("SensorA"), b = log.Of("SensorBToTracker");
  ASSERT_EQ(a.size(), 3u);
  ASSERT_EQ(b.size(), 3u);
  EXPECT_EQ(a[0].status, TransformStatus::Missing);
  EXPECT_EQ(a[1].status, TransformStatus::Valid);
  EXPECT_EQ(b[0].pose.translation(), Vector3d(1.5, -2, 3));
  EXPECT_NEAR(b[0].time, 11 * 3600 + 59 * 60 + 59.821, 1e-9);
  EXPECT_NEAR(b[1].time - b[0].time, 0.2, 1e-9);
  EXPECT_NEAR(b[2].time - b[1].time, 3600.0, 1e-9); // one o'clock, by a clock of twelve hours
  EXPECT_TRUE(HasNote(log, "day 2, month 2, year 2021"));
}

TEST_F(PoseLogFile, PairsAreMetres)
{
  const std::string text =
      "# t, A(4x4 row-major hand->base), B(4x4 row-major target->camera)\n0.5," + Identity("0.25") + "," + Identity("-1") + "\n";
  const PoseLog log = Read(text);
  ASSERT_EQ(log.tools, (std::vector<std::string>{"HandToBase", "TargetToCamera"}));
  ASSERT_EQ(log.poses.size(), 2u);
  EXPECT_EQ(log.poses[0].pose.translation(), Vector3d(250, 0, 0));
  EXPECT_EQ(log.poses[1].pose.translation(), Vector3d(-1000, 0, 0));
  EXPECT_TRUE(HasNote(log, "metres"));
  const PoseLog mm = Read(text, {1.0});
  EXPECT_EQ(mm.poses[0].pose.translation(), Vector3d(0.25, 0, 0));
  EXPECT_TRUE(mm.notes.empty());
}

TEST_F(PoseLogFile, WhatIsNoMeasurementIsMissing)
{
  struct Case {
    std::string row, note;
  };
  for (const Case& c : {Case{"1,Probe,0,0,0,0,0,0,0,OK", ""}, Case{"1,Probe,,,,,,,,OK", ""},
                        Case{"1,Probe,nan,2,3,1,0,0,0,OK", "line 2: a number is not finite"},
                        Case{"1,Probe,1,nan,3,1,0,0,0,OK", "line 2: a number is not finite"},
                        Case{"1,Probe,1,2,nan,1,0,0,0,OK", "line 2: a number is not finite"},
                        Case{"1,Probe,1,2,3,1,nan,0,0,OK", "line 2: a number is not finite"},
                        Case{"1,Probe,1,2,MISSING,1,0,0,0,OK", "line 2: a number is not finite"},
                        Case{"1,Probe,1,2,inf,1,0,0,0,OK", "line 2: a number is not finite"},
                        Case{"1,Probe,1,2,3,0.5,0,0,0,OK", "the length of the quaternion is not 1"},
                        Case{"1,Probe,1,2,3,0,0,0,0,OK", "the length of the quaternion is not 1"},
                        Case{"1,Probe,1,2,-3.697314E28,1,0,0,0,OK", "beyond 1e7 mm"}}) {
    const PoseLog log = Read(Head + c.row + "\n");
    ASSERT_EQ(log.poses.size(), 1u) << c.row;
    EXPECT_EQ(log.poses[0].status, TransformStatus::Missing) << c.row;
    EXPECT_EQ(log.poses[0].pose.matrix(), Pose::Identity().matrix()) << c.row;
    EXPECT_EQ(log.notes.size(), c.note.empty() ? 0u : 1u) << c.row;
    EXPECT_TRUE(c.note.empty() || HasNote(log, c.note)) << c.row;
  }
  const PoseLog rounded = Read(Head + "1,Probe,1,2,3,0.602,0.801,0,0,OK\n"); // as rounding leaves it
  EXPECT_EQ(rounded.poses[0].status, TransformStatus::Valid);
  EXPECT_TRUE(IsRotation(rounded.poses[0].pose.linear(), 1e-12));
  const PoseLog bent = Read("0," + Identity("1") + ",2,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1\n");
  EXPECT_EQ(bent.poses[0].status, TransformStatus::Valid);
  EXPECT_EQ(bent.poses[1].status, TransformStatus::Missing);
  EXPECT_TRUE(HasNote(bent, "the matrix is not a rigid transform"));
}

TEST_F(PoseLogFile, RowsThatEndEarlyAndTimesThatDoNotRise)
{
  const PoseLog cut = Read(Ndi + "4, 1 , 0 , 0, 61,1,2,3,1,0,0,0, 1.5 , -2 , 3, 0.");
  EXPECT_EQ(cut.Of("SensorA").size(), 4u);
  EXPECT_EQ(cut.Of("SensorB").size(), 3u);
  EXPECT_TRUE(HasNote(cut, "line 9: the row ends early"));

  const PoseLog back = Read(Head + "2,Probe,1,0,0,1,0,0,0,OK\n1,Probe,2,0,0,1,0,0,0,OK\n1,Probe,3,0,0,1,0,0,0,OK\n"
                                   "nan,Probe,4,0,0,1,0,0,0,OK\n3,Probe,5,0,0,1,0,0,0,OK\n");
  std::vector<double> order;
  for (const ToolPose& pose : back.poses)
    order.push_back(pose.pose.translation().x());
  EXPECT_EQ(order, (std::vector<double>{2, 3, 1, 5}));
  EXPECT_TRUE(HasNote(back, "the times do not increase at 2 rows, first at 1 s"));
  EXPECT_TRUE(HasNote(back, "line 5: the row has no time"));
}

TEST_F(PoseLogFile, RowsPerSecond)
{
  const PoseLog log = Read("t,x,y,z,qw,qx,qy,qz\n7,10,0,0,1,0,0,0\n7,20,0,0,1,0,0,0\n7,30,0,0,1,0,0,0\n", {0.0, 4.0});
  ASSERT_EQ(log.poses.size(), 3u);
  EXPECT_EQ(log.poses[2].time, 0.5);
  EXPECT_TRUE(log.notes.empty());
  EXPECT_EQ(Read("x,y,z,qw,qx,qy,qz\n1,0,0,1,0,0,0\n2,0,0,1,0,0,0\n", {0.0, 10.0}).poses[1].time, 0.1);
}

TEST_F(PoseLogFile, Refused)
{
  Refused("", "the file is empty");
  Refused("1,2,3\n", "not a log of poses");
  Refused("t,x,y,z,qx,qy,qz\n1,2,3,4,5,6,7\n", "not a log of poses");
  Refused("x,y,z,qw,qx,qy,qz\n1,2,3,4,5,6,7\n", ", line 1: no column holds the time");
  Refused("time,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Port 2,Q0,Qx,Qy,Qz,Tx,Ty,Tz\n1,1,0,0,0,1,2,3,2,1,0,0,0,4,5,6\n",
          ", line 1: the column \"q0\" is there several times");
  Refused(Head, "it holds no poses");
  Refused(Head + "1,Probe,one,2,3,1,0,0,0,OK\n", ", line 2: \"one\" is not a number");
  Refused(Head + "1,\"Probe,1,2,3,1,0,0,0,OK\n", ", line 2: a quotation mark is not closed");
  Refused(Head + "\n1,Probe,1,2,3," + std::string(1, '\0') + "\n", ", line 3: this is not text");
  ExpectRefused([&] { ReadPoseLog(Path("none.csv")); }, Error::Kind::FileSystem, "none.csv", "no such file");
  ExpectRefused([&] { Read(Head, {-1.0}); }, Error::Kind::InvalidParameter, "", "UnitMm is -1 mm");
  ExpectRefused([&] { Read(Head, {0.0, NAN}); }, Error::Kind::InvalidParameter, "", "RowsPerSecond is nan");
}

TEST_F(PoseLogFile, Sequence)
{
  const std::string path = Path("poses.igs.mha");
  SequenceContent content;
  content.dimensions = {0, 0, 1};
  FileReplacement files;
  SequenceWriter writer(path, content, false, files);
  std::vector<Pose> truth;
  for (int i = 0; i < 3; ++i) {
    Twist twist;
    twist << i, 2.0, 3.0, 0.1 * i, 0.2, -0.3;
    truth.push_back(Exp(twist));
    SequenceFrame frame;
    frame.time = 0.1 * i;
    frame.transforms.push_back({"ProbeToTracker", Eigen::Affine3d(truth.back().matrix()), TransformStatus::Valid, "OK"});
    frame.transforms.push_back({"ImageToProbe", Eigen::Affine3d(Eigen::Scaling(0.2)), TransformStatus::Valid, "OK"});
    if (i > 0)
      frame.transforms.push_back({"StylusToTracker", Eigen::Affine3d::Identity(), TransformStatus::Missing, "MISSING"});
    writer.Append(frame, nullptr);
  }
  writer.Finish();
  files.Commit();
  const PoseLog log = ReadPoseLog(path);
  EXPECT_EQ(log.tools, (std::vector<std::string>{"ProbeToTracker", "StylusToTracker"}));
  EXPECT_TRUE(HasNote(log, "ImageToProbe is not a rigid transform"));
  const std::vector<ToolPose> probe = log.Of("Probe");
  ASSERT_EQ(probe.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_EQ(probe[i].pose.matrix(), truth[i].matrix()); // to the last bit
  EXPECT_EQ(log.Of("Stylus").size(), 2u);
}

TEST_F(PoseLogFile, Aurora)
{
  const std::string path = Data("aurora/NDIdata_snakeravenTest_2_2_21.csv");
  if (path.empty())
    GTEST_SKIP() << "the recordings are not there";
  const PoseLog log = ReadPoseLog(path);
  EXPECT_EQ(log.tools.size(), 4u);
  const std::vector<ToolPose> a = log.Of("SensorA");
  ASSERT_EQ(a.size(), 158u);
  EXPECT_EQ(a[0].status, TransformStatus::Missing);
  EXPECT_EQ(a[2].status, TransformStatus::Valid);
  EXPECT_EQ(a[2].pose.translation(), Vector3d(102.84, -60.0, -158.25));
  EXPECT_NEAR(a[0].time, 4 * 3600 + 15 * 60 + 52.821, 1e-9);
  EXPECT_TRUE(HasNote(log, "the row ends early")); // the last one: the program was ended while it wrote
  EXPECT_FALSE(HasNote(log, "do not increase"));
}

TEST_F(PoseLogFile, HandEyePairs)
{
  const std::string arm = Data("handeye_ethz/paired_robot_arm_sim.csv"), vicon = Data("handeye_ethz/paired_vicon_1.csv");
  if (arm.empty() || vicon.empty())
    GTEST_SKIP() << "the recordings are not there";
  const PoseLog log = ReadPoseLog(arm);
  ASSERT_EQ(log.poses.size(), 2u * 524u);
  EXPECT_EQ(log.poses[0].time, 87.095);
  EXPECT_NEAR(log.poses[0].pose.translation().x(), 692.35007, 1e-9);
  EXPECT_FALSE(HasNote(log, "do not increase"));
  for (const ToolPose& pose : log.poses)
    EXPECT_EQ(pose.status, TransformStatus::Valid);
  const PoseLog coarse = ReadPoseLog(vicon);
  EXPECT_EQ(coarse.poses.size(), 2u * 511u);
  EXPECT_TRUE(HasNote(coarse, "they have too few digits"));
}

TEST_F(PoseLogFile, PlusSequences)
{
  const std::string path = Data("plus/SpinePhantomFreehand.igs.mha");
  if (path.empty())
    GTEST_SKIP() << "the recordings are not there";
  const PoseLog log = ReadPoseLog(path);
  EXPECT_GT(log.Of("ProbeToTracker").size(), 10u);
  EXPECT_TRUE(std::isfinite(log.poses.front().time));
}
