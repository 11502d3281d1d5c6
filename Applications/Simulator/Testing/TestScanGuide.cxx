// SPDX-License-Identifier: BSD-3-Clause
// What a guide on the probe does with the needle in it when the probe moves: it takes it along, but not through bone.
#include "NeedleTool.h"
#include "SimulatorUnderTest.h"
#include "TaskPanel.h"
#include <algorithm>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QRegularExpression>
#include <QtTest>

using namespace echorama;
using Eigen::Vector3d;

class TestScanGuide : public FolderTest {
  Q_OBJECT

private slots:
  void itIsTakenAlongButNotThroughBone();
  void howFarTheProbeGoesAtOnceDoesNotMatter();
  void whatIsFrozenOrSlowIsMadeUpFor();
  void meetingBoneIsScored();
  void ofATrackedNeedleTheShaftMeetsBoneToo();

private:
  static constexpr double AboveLevelMm = 3.5; // of a ball of 5 mm, white, in voxels of 1.5 mm: a little within it is 217

  /// Of what of it is in the body, from the middle of the bone, which is at the origin.
  static double FromBone(const NeedleTool& needle)
  {
    const Vector3d entry = needle.Entry(), direction = needle.Now().direction;
    return (entry + std::clamp(-entry.dot(direction), 0.0, needle.InsideMm()) * direction).norm();
  }
  /// A needle in its guide, in the plane of the image, so deep that where the probe is at first it would go through the bone and
  /// on. Now it is 14 mm beside it.
  static void PutBesideBone(SimulatorUnderTest& window, const char* stops)
  {
    window.Scan().SetControl("DepthMm", "78"); // a guide aims at 0.45 of it, which is where the bone is
    window.Scan().SetControl("NeedleStops", stops);
    window.Frame();
    window.Key(Qt::Key_N);
    window.Move(Qt::Key_Up, Qt::NoModifier, 7);
    NeedleTool& needle = *window.Window().TheNeedle();
    for (int i = 0; i < 100 && needle.InsideMm() < 60.0; i++)
      window.Key(Qt::Key_W);
    window.Frame();
    QVERIFY(!needle.HasMetBone());
    QVERIFY2(needle.InsideMm() >= 60.0 && FromBone(needle) > 7.0, qPrintable(QString::number(FromBone(needle))));
  }
};

void TestScanGuide::itIsTakenAlongButNotThroughBone()
{
  for (const bool stops : {true, false}) {
    SimulatorUnderTest window;
    QVERIFY(window.Open({body::WriteWithBall(Folder())}));
    NeedleTool& needle = *window.Window().TheNeedle();
    PutBesideBone(window, stops ? "on" : "off");
    const double before = needle.InsideMm();
    double nearest = 100.0, shallowest = before;
    int met = 0;
    for (int i = 0; i < 14; i++) {
      window.Move(Qt::Key_Down);
      nearest = std::min(nearest, FromBone(needle));
      shallowest = std::min(shallowest, needle.InsideMm());
      met += needle.HasMetBone();
      QCOMPARE(needle.HasMetBone(), window.Window().TheNeedle()->State().contains("it has met bone"));
      QVERIFY(needle.Guide() == NeedleGuide::InPlane);
      QVERIFY((window.Scan().Frame().needle->tip - needle.Now().tip).norm() < 1e-9); // what is seen is what is
    }
    qInfo("nearest %.2f mm, from %.1f to %.1f mm deep, %d times at bone", nearest, before, shallowest, met);
    if (!stops) { // nobody asked for it
      QVERIFY2(nearest < 2.0, qPrintable(QString::number(nearest)));
      QCOMPARE(met, 0);
      QVERIFY(shallowest > before - 10.0); // as far as the skin is curved
      continue;
    }
    QVERIFY2(nearest > AboveLevelMm && nearest < 6.0, qPrintable(QString::number(nearest)));
    QVERIFY(met >= 2 && met < 12);
    QVERIFY(!needle.HasMetBone()); // beyond the bone it is free, and as deep as it was left
    QVERIFY(needle.InsideMm() < before - 10.0 && std::fabs(needle.InsideMm() - shallowest) < 10.0);
    const Vector3d tip = needle.Now().tip;
    window.Key(Qt::Key_W, Qt::ShiftModifier);
    QVERIFY(std::fabs((needle.Now().tip - tip).norm() - 5.0) < 1e-6);
  }
}

// From one side of the bone to the other with one key: a needle has to go past it all the same.
void TestScanGuide::howFarTheProbeGoesAtOnceDoesNotMatter()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  NeedleTool& needle = *window.Window().TheNeedle();
  PutBesideBone(window, "on");
  const double before = needle.InsideMm();
  const Vector3d across = window.Axis(1), from = window.Place();
  window.Scan().Slide(0.0, 28.0);
  window.Frame();
  QVERIFY((window.Place() - from).dot(across) > 25.0);
  QVERIFY2(FromBone(needle) > 7.0, "the bone is between");
  QVERIFY2(needle.InsideMm() < before - 10.0, qPrintable(QString::number(needle.InsideMm())));
}

void TestScanGuide::whatIsFrozenOrSlowIsMadeUpFor()
{
  {
    SimulatorUnderTest window;
    QVERIFY(window.Open({body::WriteWithBall(Folder())}));
    NeedleTool& needle = *window.Window().TheNeedle();
    PutBesideBone(window, "on");
    window.Key(Qt::Key_Space);
    window.Move(Qt::Key_Down, Qt::NoModifier, 7);
    window.Key(Qt::Key_Space);
    window.Frame();
    QVERIFY(needle.HasMetBone());
    QVERIFY2(FromBone(needle) > AboveLevelMm, qPrintable(QString::number(FromBone(needle))));
  }
  // The acoustic model: its picture is neither given up for it, nor is the needle left in bone once it is done.
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteScene(Folder())})); // a stone of 6 mm, 30 mm below the top
  NeedleTool& needle = *window.Window().TheNeedle();
  const Vector3d stone(0.0, 0.0, 30.0);
  window.Scan().SetControl("DepthMm", "67");
  window.Scan().SetControl("NeedleStops", "on");
  window.Frame();
  window.Key(Qt::Key_N);
  window.Move(Qt::Key_Up, Qt::NoModifier, 7);
  for (int i = 0; i < 100 && needle.InsideMm() < 60.0; i++)
    window.Key(Qt::Key_W);
  QVERIFY(needle.InsideMm() >= 60.0 && !needle.HasMetBone());
  window.Scan().SetControl("Source", "acoustic");
  window.Scan().MakeNow();
  QVERIFY(window.Scan().IsMaking());
  for (int i = 0; i < 7; i++)
    window.Scan().Slide(0.0, 2.0);
  QVERIFY(window.Scan().IsMaking());
  QTRY_VERIFY_WITH_TIMEOUT(needle.HasMetBone(), 60000);
  const auto fromStone = [&] {
    const Vector3d entry = needle.Entry() - stone, direction = needle.Now().direction;
    return (entry + std::clamp(-entry.dot(direction), 0.0, needle.InsideMm()) * direction).norm();
  };
  QVERIFY2(fromStone() > 5.8 && fromStone() < 8.0, qPrintable(QString::number(fromStone())));
}

void TestScanGuide::meetingBoneIsScored()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  NeedleTool& needle = *window.Window().TheNeedle();
  auto* panel = window.Part<TaskPanel>("taskPanel");
  panel->SetFolder(Folder());
  window.Key(Qt::Key_N);
  window.Frame();
  for (int i = 0; i < 40; i++)
    window.Key(Qt::Key_W);
  window.Part<QLineEdit>("taskName")->setText("target");
  window.Part<QPushButton>("saveTarget")->click();
  window.Key(Qt::Key_N);
  for (const bool meets : {true, false}) {
    panel->OpenTask(Folder().filePath("target.task.json"));
    window.Part<QPushButton>("startTask")->click();
    QVERIFY2(panel->IsRunning(), qPrintable(window.Messages().join('\n')));
    window.Key(Qt::Key_N); // away, so that it is put in anew
    PutBesideBone(window, "on");
    window.Move(meets ? Qt::Key_Down : Qt::Key_Up, Qt::NoModifier, meets ? 7 : 1);
    QCOMPARE(needle.HasMetBone(), meets);
    window.Part<QPushButton>("submitTask")->click();
    const QString score = window.Part<QLabel>("taskScore")->text();
    QVERIFY2(score.contains(QRegularExpression(", [1-3] times? at bone, ")) == meets && score.contains("bone") == meets,
             qPrintable(score));
    window.Key(Qt::Key_Space);
  }
}

void TestScanGuide::ofATrackedNeedleTheShaftMeetsBoneToo()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  window.Scan().SetControl("NeedleStops", "on");
  NeedleTool& needle = *window.Window().TheNeedle();
  const auto follow = [&](const Vector3d& tip) {
    Pose pose = Pose::Identity(); // from the top straight down, which is y
    pose.linear() = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), Vector3d::UnitY()).toRotationMatrix();
    pose.translation() = tip;
    needle.Follow(pose.matrix());
    return needle.HasMetBone();
  };
  QVERIFY(!follow(Vector3d(0.0, -20.0, 0.0)));
  QVERIFY(follow(Vector3d(0.0, 0.0, 0.0)));
  QVERIFY2(follow(Vector3d(0.0, 15.0, 0.0)), "its tip is beyond the bone");
  QVERIFY(needle.Now().tip == Vector3d(0.0, 15.0, 0.0)); // nothing stops a hand
  QVERIFY(needle.State().contains("it has met bone"));
  QVERIFY(!follow(Vector3d(9.0, 15.0, 0.0)));
  QVERIFY(!follow(Vector3d(0.0, -40.0, 0.0))); // outside
}

int main(int argc, char** argv)
{
  return RunWindowTest("SimulatorTest", argc, argv, [argc, argv] {
    TestScanGuide test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestScanGuide.moc"
