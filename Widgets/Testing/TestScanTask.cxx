// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/TextFile.h"
#include "Widgets/Session/ScanTask.h"
#include <filesystem>
#include <gtest/gtest.h>
#include <limits>
#include <unistd.h>

using namespace echorama;
using Eigen::Vector3d;

namespace {

constexpr double notANumber = std::numeric_limits<double>::quiet_NaN();

TaskBody SomeBody()
{
  ImageGeometry geometry;
  geometry.dimensions = {300, 200, 100};
  geometry.origin = {-10.1, 20.2, 0.3};
  geometry.spacing = {0.4, 0.5, 0.6};
  geometry.direction = ExpRotation({0.1, 0.2, 0.3});
  return {"body.mha", "0123456789abcdef", geometry};
}

ScanTask PlaneTask(bool hint = false)
{
  FindPlane goal;
  goal.probeToWorld = MotionAbout({0, 0, 0}, {0.3, -1.0, 0.7}, {12.3, -4.5, 60.7});
  goal.depthMm = 50.0;
  goal.distanceMm = 8.0;
  goal.degrees = 6.0;
  return {"Gallbladder", "Show the gallbladder \"lengthwise\".", SomeBody(), hint, goal};
}

ScanTask LengthTask()
{
  return {"Kidney", "", SomeBody(), true, MeasureLength{98.5, 4.0, {1, 2, 3}, {1, 2, 101.5}}};
}

ScanTask NeedleTask(bool hint = false)
{
  return {"Cyst", "Puncture the cyst.", SomeBody(), hint, ReachTarget{{10, 20, 30}, 4.0}};
}

template <class F>
std::string ReasonOf(F&& f)
{
  try {
    f();
  } catch (const Error& error) {
    return error.what();
  }
  return "none";
}

std::string Replaced(std::string text, const std::string& from, const std::string& to)
{
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

} // namespace

TEST(ScanTask, ComesBackToTheLastBit)
{
  for (const ScanTask& task : {PlaneTask(true), LengthTask(), NeedleTask()}) {
    const ScanTask again = ScanTaskOf(ScanTaskText(task));
    EXPECT_EQ(again.name, task.name);
    EXPECT_EQ(again.instruction, task.instruction);
    EXPECT_EQ(again.hint, task.hint);
    EXPECT_EQ(again.body.file, task.body.file);
    EXPECT_EQ(again.body.checksum, task.body.checksum);
    EXPECT_EQ(again.body.geometry->dimensions, task.body.geometry->dimensions);
    EXPECT_EQ(again.body.geometry->direction, task.body.geometry->direction);
    EXPECT_EQ(again.body.geometry->origin, task.body.geometry->origin);
    EXPECT_EQ(again.body.geometry->spacing, task.body.geometry->spacing);
    EXPECT_EQ(again.goal.index(), task.goal.index());
    EXPECT_EQ(ScanTaskText(again), ScanTaskText(task));
  }
  // Whether the tip is marked; tasks from before that was asked do not.
  ScanTask open = NeedleTask();
  std::get<ReachTarget>(open.goal).showTip = true;
  EXPECT_TRUE(std::get<ReachTarget>(ScanTaskOf(ScanTaskText(open)).goal).showTip);
  const std::string old = Replaced(ScanTaskText(NeedleTask()), "\"radiusMm\": 4.0,", "\"radiusMm\": 4.0");
  EXPECT_FALSE(std::get<ReachTarget>(ScanTaskOf(Replaced(old, "\"showTip\": false", "")).goal).showTip);
  EXPECT_TRUE(ScanAttempt(open, SomeBody()).ShowsTip());
  EXPECT_FALSE(ScanAttempt(NeedleTask(true), SomeBody()).ShowsTip());
  const auto plane = std::get<FindPlane>(ScanTaskOf(ScanTaskText(PlaneTask())).goal);
  EXPECT_LT((plane.probeToWorld.matrix() - std::get<FindPlane>(PlaneTask().goal).probeToWorld.matrix()).norm(), 1e-12);
  EXPECT_EQ(plane.degrees, 6.0);
  const auto length = std::get<MeasureLength>(ScanTaskOf(ScanTaskText(LengthTask())).goal);
  EXPECT_EQ(length.lengthMm, 98.5);
  EXPECT_EQ(length.to, Vector3d(1, 2, 101.5));
  EXPECT_EQ(std::get<ReachTarget>(ScanTaskOf(ScanTaskText(NeedleTask())).goal).target, Vector3d(10, 20, 30));
}

TEST(ScanTask, IsAFile)
{
  const std::string folder = ::testing::TempDir() + "scan-task-" + std::to_string(getpid());
  std::filesystem::create_directories(folder);
  const std::string path = folder + "/task.json";
  WriteScanTask(path, NeedleTask());
  EXPECT_EQ(ScanTaskText(ReadScanTask(path)), ScanTaskText(NeedleTask()));
  EXPECT_EQ(ScanAttempt::Open(path, SomeBody()).Name(), "Cyst");
  ScanTask bad = NeedleTask();
  bad.name.clear();
  EXPECT_THROW(WriteScanTask(path, bad), Error);
  EXPECT_EQ(ReadScanTask(path).name, "Cyst"); // what was there stays
  WriteTextFile(path, "{}");
  EXPECT_EQ(ReasonOf([&] { ReadScanTask(path); }), path + ": \"schema\" is missing");
  EXPECT_THROW(ReadScanTask(folder + "/none.json"), Error);
  std::filesystem::remove_all(folder);
}

TEST(ScanTask, BadFilesAreToldWhatIsWrong)
{
  const std::string plane = ScanTaskText(PlaneTask()), needle = ScanTaskText(NeedleTask()), length = ScanTaskText(LengthTask());
  const auto reason = [](const std::string& text) { return ReasonOf([&text] { ScanTaskOf(text, "t.json"); }); };
  EXPECT_EQ(reason(plane), "none");
  EXPECT_NE(reason("[1]").find("t.json: an object is needed"), std::string::npos);
  EXPECT_NE(reason("{").find("t.json"), std::string::npos);
  EXPECT_NE(reason(Replaced(plane, "task-1", "task-2")).find("schema"), std::string::npos);
  EXPECT_NE(
      reason(Replaced(needle, "\"radiusMm\": 4.0", "\"radiusMm\": -4.0")).find("reachTarget.radiusMm: -4.0 is out of range"),
      std::string::npos);
  EXPECT_NE(reason(Replaced(needle, "\"radiusMm\"", "\"radius\"")).find("reachTarget"), std::string::npos);
  EXPECT_NE(reason(Replaced(needle, "reachTarget", "reach")).find("one of findPlane, measureLength, reachTarget is needed"),
            std::string::npos)
      << reason(Replaced(needle, "reachTarget", "reach"));
  EXPECT_NE(reason(Replaced(plane, "\"array\": [", "\"array\": [1, 1, 1], \"x\": [")).find("findPlane"), std::string::npos);
  EXPECT_NE(reason(Replaced(plane, "\"checksum\": \"0", "\"checksum\": \"g")).find("body: the checksum must be of 16"),
            std::string::npos);
  EXPECT_NE(reason(Replaced(plane, "300.0", "300.5")).find("dimensions must be whole"), std::string::npos);
  EXPECT_NE(reason(Replaced(plane, "\"name\": \"Gallbladder\"", "\"name\": \"\"")).find("name"), std::string::npos);
  EXPECT_NE(reason(Replaced(length, "98.5", "\"long\"")).find("measureLength.lengthMm: a number is needed"), std::string::npos);

  ScanTask skewed = PlaneTask();
  std::get<FindPlane>(skewed.goal).probeToWorld.matrix()(0, 0) += 0.1;
  EXPECT_NE(ReasonOf([&] { skewed.Check(); }).find("unit vectors at right angles"), std::string::npos);
  for (std::size_t cut = 0; cut + 2 < plane.size(); cut += 7)
    EXPECT_NE(reason(plane.substr(0, cut)), "none");
}

TEST(ScanTask, IsRefusedForAnotherBody)
{
  const TaskBody body = SomeBody();
  EXPECT_EQ(body.Complaint(body), "");
  TaskBody other = body;
  other.file = "renamed.mha";
  EXPECT_EQ(body.Complaint(other), "");
  other.checksum = "0123456789abcdee";
  EXPECT_EQ(body.Complaint(other),
            "the task was made for body.mha (300 x 200 x 100), and renamed.mha (300 x 200 x 100) is shown");
  other.file = "body.mha";
  EXPECT_NE(body.Complaint(other).find("its content is not the same any more"), std::string::npos);
  other = body;
  other.geometry->dimensions[2] = 101;
  EXPECT_EQ(body.Complaint(other), "the task was made for body.mha (300 x 200 x 100), and body.mha (300 x 200 x 101) is shown");
  other = body;
  other.geometry->origin[0] += 1.0;
  EXPECT_NE(body.Complaint(other).find("it lies elsewhere"), std::string::npos);
  other.geometry.reset();
  EXPECT_EQ(body.Complaint(other), "the task was made for body.mha (300 x 200 x 100), and body.mha is shown");
  EXPECT_THROW(ScanAttempt(PlaneTask(), other), Error);
}

TEST(ScanAttempt, ScoresAPlane)
{
  ScanAttempt attempt(PlaneTask(), SomeBody());
  EXPECT_EQ(attempt.What(), ScanAttempt::Kind::FindPlane);
  const Pose target = std::get<FindPlane>(PlaneTask().goal).probeToWorld;
  Pose start = target;
  start.translation() += 40.0 * target.linear().col(0);
  attempt.Start(100.0, start);
  // Turned by 5 degrees about x of the probe, about the middle of the image: the middle stays.
  Pose answer = target * MotionAbout({0, 0, 50}, {5.0 * RadiansPerDegree, 0, 0}, {0, 3, 4});
  const ScanScore score = attempt.SubmitPose(112.5, answer);
  EXPECT_NEAR(score.distanceMm, 5.0, 1e-9);
  EXPECT_NEAR(score.degrees, 5.0, 1e-9);
  EXPECT_EQ(score.seconds, 12.5);
  EXPECT_NEAR(*score.startMm, 40.0, 1e-9);
  EXPECT_TRUE(score.passed);

  attempt.Start(0.0);
  EXPECT_FALSE(attempt.SubmitPose(1.0, target * MotionAbout({0, 0, 50}, {7.0 * RadiansPerDegree, 0, 0}, {0, 0, 0})).passed);
  attempt.Start(0.0);
  EXPECT_FALSE(attempt.SubmitPose(1.0, target * MotionAbout({0, 0, 0}, {0, 0, 0}, {9, 0, 0})).passed);
  // Turned within the plane, and seen from behind: the same plane.
  attempt.Start(0.0);
  const ScanScore behind = attempt.SubmitPose(1.0, target * MotionAbout({0, 0, 50}, {0, 0.4, 0}, {0, 0, 0}) *
                                                       MotionAbout({0, 0, 50}, {0, 0, Pi}, {0, 0, 0}));
  EXPECT_NEAR(behind.degrees, 0.0, 1e-6);
  EXPECT_NEAR(behind.distanceMm, 0.0, 1e-9);
}

TEST(ScanAttempt, ScoresALengthAndATarget)
{
  ScanAttempt length(LengthTask(), SomeBody());
  EXPECT_EQ(length.What(), ScanAttempt::Kind::MeasureLength);
  length.Start(0.0);
  const ScanScore measured = length.SubmitLength(3.0, 95.0);
  EXPECT_DOUBLE_EQ(measured.distanceMm, 3.5);
  EXPECT_TRUE(measured.passed);
  EXPECT_FALSE(measured.startMm);
  length.Start(0.0);
  EXPECT_FALSE(length.SubmitLength(3.0, 103.0).passed);

  ScanAttempt needle(NeedleTask(), SomeBody());
  EXPECT_EQ(needle.What(), ScanAttempt::Kind::ReachTarget);
  Pose tip = Pose::Identity();
  needle.Start(5.0, tip);
  tip.translation() = Vector3d(10, 20, 33);
  const ScanScore reached = needle.SubmitPose(6.0, tip);
  EXPECT_DOUBLE_EQ(reached.distanceMm, 3.0);
  EXPECT_NEAR(*reached.startMm, std::sqrt(1400.0), 1e-9);
  EXPECT_TRUE(reached.passed);
}

TEST(ScanAttempt, TellsNothingUnlessItMay)
{
  for (const bool hint : {false, true}) {
    ScanAttempt attempt(NeedleTask(hint), SomeBody());
    EXPECT_EQ(attempt.Solution(), nullptr);
    EXPECT_FALSE(attempt.Hint(0.0, Pose::Identity())); // it has not begun
    attempt.Start(1.0);
    EXPECT_EQ(attempt.Solution(), nullptr);
    const auto told = attempt.Hint(3.0, Pose::Identity());
    EXPECT_EQ(told.has_value(), hint);
    if (told) {
      EXPECT_NEAR(told->distanceMm, std::sqrt(1400.0), 1e-9);
      EXPECT_EQ(told->seconds, 2.0);
    }
    attempt.SubmitPose(4.0, Pose::Identity());
    ASSERT_NE(attempt.Solution(), nullptr);
    EXPECT_EQ(std::get<ReachTarget>(attempt.Solution()->goal).target, Vector3d(10, 20, 30));
    attempt.Start(5.0); // again
    EXPECT_EQ(attempt.Solution(), nullptr);
    attempt.Cancel();
    EXPECT_EQ(attempt.Solution(), nullptr);
    EXPECT_FALSE(attempt.IsRunning());
  }
  ScanAttempt length(LengthTask(), SomeBody()); // a hint would be the answer
  length.Start(0.0);
  EXPECT_FALSE(length.Hint(1.0, Pose::Identity()));
}

TEST(ScanAttempt, RefusesAnswersThatAreNone)
{
  ScanAttempt attempt(PlaneTask(), SomeBody());
  const Pose pose = Pose::Identity();
  Pose bad = pose;
  bad.translation()[1] = notANumber;
  EXPECT_EQ(ReasonOf([&] { attempt.SubmitPose(1.0, pose); }), "no attempt is running");
  EXPECT_THROW(attempt.Start(notANumber), Error);
  EXPECT_THROW(attempt.Start(0.0, bad), Error);
  EXPECT_FALSE(attempt.IsRunning());
  attempt.Start(10.0);
  EXPECT_THROW(attempt.SubmitPose(9.0, pose), Error);
  EXPECT_THROW(attempt.SubmitPose(notANumber, pose), Error);
  EXPECT_THROW(attempt.SubmitPose(11.0, bad), Error);
  EXPECT_EQ(ReasonOf([&] { attempt.SubmitLength(11.0, 4.0); }), "the task asks for a pose, not for a length");
  EXPECT_TRUE(attempt.IsRunning());
  EXPECT_THROW(attempt.HistoryLine("", ""), Error);
  ScanAttempt length(LengthTask(), SomeBody());
  length.Start(0.0);
  EXPECT_EQ(ReasonOf([&] { length.SubmitPose(1.0, pose); }), "the task asks for a length, not for a pose");
  for (const double mm : {-1.0, notANumber, std::numeric_limits<double>::infinity()})
    EXPECT_THROW(length.SubmitLength(1.0, mm), Error);
}

TEST(ScanAttempt, GoesToTheHistoryOfTraining)
{
  ScanAttempt attempt(NeedleTask(), SomeBody());
  Pose tip = Pose::Identity();
  tip.translation() = Vector3d(10, 20, 25);
  attempt.Start(0.0, tip);
  tip.translation()[2] = 28.0;
  attempt.SubmitPose(7.5, tip);
  const std::string path = ::testing::TempDir() + "scan-attempts-" + std::to_string(getpid()) + ".csv";
  AppendAttempt(path, attempt.HistoryLine("2026-01-02T03:04:05Z", "Doe, J"));
  const std::vector<Attempt> attempts = ReadAttempts(path);
  std::filesystem::remove(path);
  ASSERT_EQ(attempts.size(), 1u);
  EXPECT_EQ(attempts[0].trainee, "Doe, J");
  EXPECT_EQ(attempts[0].project, "Cyst (body.mha)");
  EXPECT_EQ(attempts[0].seconds, 7.5);
  EXPECT_EQ(attempts[0].scoreMm, 2.0);
  EXPECT_EQ(attempts[0].startMm, 5.0);
}
