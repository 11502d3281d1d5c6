// SPDX-License-Identifier: BSD-3-Clause
// A probe whose place comes from one tracker and whose orientation comes from an IMU, or from an IMU alone.
#include "Core/Base/Angles.h"
#include "Core/Base/Random.h"
#include "ProbeTracker.h"
#include "SimulatorUnderTest.h"
#include "Tracking/Stream/SequenceRecorder.h"
#include <atomic>
#include <memory>
#include <QDockWidget>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QtTest>

using namespace echorama;

class TestScanFusion : public FolderTest {
  Q_OBJECT

private slots:
  void placeAndOrientationMakeOneProbe();
  void anImuAloneTurnsTheProbeWhereKeysPutIt();
  void oneThatIsTurnedStaysTurned();
  void normalsOfTheToolAreThoseOfTheLine();
  void whatStopsIsSaidWithTheSeconds();
  void linesThatAreNoneAreNamed();
  void theWindowGoesOnWhileATrackerIsConnected();

private:
  static void Connect(SimulatorUnderTest& window, const QString& place, const QString& orientation, const QString& options = {})
  {
    window.Part<QDockWidget>("trackerPanelDock")->raise();
    for (const auto& [name, text] : {std::pair<const char*, QString>{"trackerAddress", place},
                                     {"trackerOrientation", orientation},
                                     {"trackerOptions", options}}) {
      window.Part<QLineEdit>(name)->clear();
      window.Type(window.Part<QLineEdit>(name), text);
    }
    window.Part<QPushButton>("trackerConnect")->click();
    QVERIFY(window.Wait());
  }
  static double DegreesBetween(const Pose& a, const Pose& b) { return RotationAngle(a.inverse() * b) * DegreesPerRadian; }
};

// A probe that rests, slides from the front of a patient to its side, and rests. The surface tracker has noise and is late, the
// IMU has noise, is late, knows nothing of where north is, and drifts by 12 degrees from the alignment to the end: only the
// normals of the skin can take that away.
void TestScanFusion::placeAndOrientationMakeOneProbe()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  SkinWalk walk(window.Scan().Body().mesh);
  const Pose start = window.Scan().ProbeToWorld();
  walk.PutNearest(start.translation());
  walk.Put(walk.Place(), start.linear().col(0));
  constexpr double restS = 2.5, moveS = 2.0, endS = 4.0 + restS, driftDegreesPerS = 3.0, surfaceLate = 0.04, imuLate = 0.015;
  const Eigen::Vector3d up(0, -1, 0);
  const Eigen::Quaterniond level = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), up);
  Random random(1);
  SequenceRecorder places(Folder().filePath("places.igs.mha").toStdString()),
      turns(Folder().filePath("turns.igs.mha").toStdString());
  const auto noise = [&random](double sigma) -> Eigen::Vector3d {
    const double x = random.Normal(), y = random.Normal(), z = random.Normal();
    return sigma * Eigen::Vector3d(x, y, z);
  };
  Pose last = start;
  for (int i = 0; i < static_cast<int>(endS * 100.0); i++) {
    const double time = 0.01 * i;
    if (time > restS && time <= restS + moveS)
      walk.Step(35.0 / (moveS * 100.0), 0.0);
    last = walk.PoseOf();
    const auto append = [](SequenceRecorder& recorder, double at, const Pose& pose, const char* name) {
      SequenceFrame frame;
      frame.time = at;
      frame.transforms.push_back({name, Eigen::Affine3d(pose.matrix())});
      recorder.Append(frame);
    };
    Pose place = Pose::Identity();
    place.translation() = last.translation() + noise(0.2);
    append(places, time + surfaceLate, place, "ProbeToSkin");
    const Eigen::AngleAxisd bias((70.0 + driftDegreesPerS * time) * RadiansPerDegree, up);
    append(turns, time + imuLate, Pose(level.inverse() * (bias * last.linear()) * ExpRotation(noise(0.3 * RadiansPerDegree))),
           "ImuToLevel");
  }
  places.Finish();
  turns.Finish();
  Connect(window, "replay:" + Folder().filePath("places.igs.mha"), "replay:" + Folder().filePath("turns.igs.mha"),
          "imuDelay=0.015&surfaceDelay=0.04&driftDegreesPerMinute=180&heldDegrees=3");
  // Nothing moves until somebody has said where the array points: it is now as on the screen.
  QTRY_COMPARE(window.Part<QLabel>("trackerHeading")->text(), QString("not known: Align"));
  QTRY_VERIFY(window.Part<QLabel>("trackerState")->text().contains("heading is not known"));
  QVERIFY(!window.Scan().IsFollowing());
  QTRY_VERIFY(window.Part<QPushButton>("trackerAlign")->isEnabled());
  window.Part<QPushButton>("trackerAlign")->click();
  QTRY_VERIFY(window.Scan().IsFollowing());
  QTRY_VERIFY(window.Part<QLabel>("trackerHeading")->text().startsWith("known to "));
  QTRY_VERIFY(DegreesBetween(window.Scan().ProbeToWorld(), start) < 8.0); // and not 70
  window.Grab("simulator-fusion");
  QTRY_VERIFY_WITH_TIMEOUT(window.Part<QLabel>("trackerState")->text().startsWith("ended"), 20000);
  const Pose pose = window.Scan().ProbeToWorld();
  const double mm = (pose.translation() - last.translation()).norm(), degrees = DegreesBetween(pose, last);
  qInfo("at the end: %.2f mm, %.2f degrees from the truth; %s", mm, degrees,
        qPrintable(window.Part<QLabel>("trackerHeading")->text()));
  QVERIFY((last.translation() - start.translation()).norm() > 25.0);
  QVERIFY(mm < 1.0);
  QVERIFY(degrees < 5.0);
  QVERIFY(window.Scan().Cine().Count() > 20);
}

void TestScanFusion::anImuAloneTurnsTheProbeWhereKeysPutIt()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  const Eigen::Vector3d place = window.Place();
  Connect(window, "", "simulated:?tools=1&rate=100&motion=sweep");
  QTRY_VERIFY(window.Part<QPushButton>("trackerAlign")->isEnabled());
  QVERIFY(!window.Part<QPushButton>("trackerHere")->isEnabled());
  QVERIFY(!window.Scan().IsTurned());
  window.Part<QPushButton>("trackerAlign")->click();
  QTRY_VERIFY(window.Scan().IsTurned());
  QVERIFY(!window.Scan().IsFollowing());
  // It turns as the IMU does, about its place.
  const Pose before = window.Scan().ProbeToWorld();
  QTRY_VERIFY(DegreesBetween(before, window.Scan().ProbeToWorld()) > 8.0);
  QCOMPARE((window.Place() - place).norm(), 0.0);
  // Keys slide it along the skin all the while, as far as they say; it keeps the skin under it.
  window.Move(Qt::Key_Right, Qt::ShiftModifier);
  QVERIFY(std::abs((window.Place() - place).norm() - 10.0) < 0.5);
  QVERIFY(std::abs(body::Level(window.Place()) - 1.0) < 0.06);
  window.Part<QPushButton>("trackerConnect")->click();
  QVERIFY(!window.Scan().IsTurned());
  QVERIFY(window.Axis(2).dot(-window.Scan().SkinNormal()) > 0.999); // upright again
}

// Wherever the probe is put, it is shown as it is held: an IMU that rests says nothing new.
void TestScanFusion::oneThatIsTurnedStaysTurned()
{
  SimulatorUnderTest window;
  const QString file = body::WriteWithBall(Folder());
  QVERIFY(window.Open({file}));
  Scan& scan = window.Scan();
  const Eigen::Vector3d top = window.Place();
  const Eigen::Matrix3d turned = scan.ProbeToWorld().linear() * ExpRotation(Eigen::Vector3d(0.2, -0.1, 0.7));
  scan.Turn(turned);
  QVERIFY(scan.IsTurned());
  const auto isAsHeld = [&] {
    scan.Turn(turned); // says the same again
    window.Frame();
    return scan.ProbeToWorld().linear() == turned && (window.Place() - top).norm() < 1e-6;
  };
  QVERIFY(isAsHeld());
  window.Move(Qt::Key_Right, Qt::ShiftModifier);
  QVERIFY(!isAsHeld()); // it is elsewhere
  window.Move(Qt::Key_Home, Qt::ShiftModifier);
  QVERIFY(isAsHeld());
  const Eigen::Vector3d array = turned.col(0);
  window.Move(Qt::Key_Right); // along its array, as far as that lies in the skin
  QVERIFY((window.Place() - top).dot(array) > 1.8);
  scan.Restart();
  QVERIFY(isAsHeld());
  QVERIFY(window.Open({file}));
  QVERIFY(isAsHeld());
  scan.StopFollowing();
  QVERIFY(window.Axis(2).dot(-scan.SkinNormal()) > 0.999); // upright again
}

void TestScanFusion::normalsOfTheToolAreThoseOfTheLine()
{
  for (const bool byTool : {false, true}) {
    SimulatorUnderTest window;
    QVERIFY(window.Open({body::WriteWithBall(Folder())}));
    Connect(window, "simulated:?tools=1", "simulated:?tools=1", byTool ? "alignTo=1 0 0&normals=tool" : "alignTo=1 0 0");
    const auto asked = std::make_shared<std::atomic<int>>(0); // by another thread
    vtkUltrasoundTrackerSource* tracker = window.Part<ProbeTracker>("trackerPanel")->Tracker();
    tracker->SetNormals([asked](const Eigen::Vector3d&) -> std::optional<Eigen::Vector3d> {
      ++*asked;
      return std::nullopt;
    });
    QTRY_VERIFY(window.Scan().IsFollowing());
    if (!byTool)
      QTRY_VERIFY(*asked > 0);
    QTest::qWait(200); // of many poses
    QCOMPARE(*asked > 0, !byTool);
  }
}

void TestScanFusion::whatStopsIsSaidWithTheSeconds()
{
  for (const bool alone : {true, false}) {
    SimulatorUnderTest window;
    QVERIFY(window.Open({body::WriteWithBall(Folder())}));
    Connect(window, alone ? "" : "simulated:?tools=1", "simulated:?tools=1&unplugAfter=1", "alignTo=1 0 0");
    QTRY_VERIFY(alone ? window.Scan().IsTurned() : window.Scan().IsFollowing());
    QTRY_VERIFY_WITH_TIMEOUT(window.Image().IsStale(), 20000);
    QVERIFY2(window.Image().State().contains("The tracker has stopped: this was"), qPrintable(window.Image().State()));
    const auto state = [&] { return window.Part<QLabel>("trackerState")->text(); };
    QTRY_VERIFY2(state().contains("the orientation: simulated: unplugged after 1 s, silent for "), qPrintable(state()));
    const QString before = state();
    QTRY_VERIFY(state() != before); // the seconds go on
    window.Part<QPushButton>("trackerConnect")->click();
    window.Frame();
    QVERIFY(!window.Image().IsStale());
  }
}

void TestScanFusion::linesThatAreNoneAreNamed()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  const auto* connect = window.Part<QPushButton>("trackerConnect");
  for (const auto& [place, orientation, options, reason] : std::vector<std::array<QString, 4>>{
           {"simulated:", "replay:" + Folder().filePath("nowhere.igs.mha"), "", "nowhere.igs.mha"},
           {"nothing", "simulated:", "", "nothing: a tracker is named as SCHEME:PLACE"},
           {"simulated:", "imu", "", "imu: a tracker is named as SCHEME:PLACE"},
           {"simulated:", "simulated:", "imuDelays=1", "there is no option imuDelays"},
           {"simulated:", "simulated:", "up=0 0 0", "Up has no length"}}) {
    Connect(window, place, orientation, options);
    const QString why = reason;
    QTRY_VERIFY2(window.HasMessage(why), qPrintable(window.Messages().join('\n')));
    QCOMPARE(connect->text().remove('&'), QString("Connect"));
  }
  // What only a pair can be told is not offered for one.
  Connect(window, "simulated:", "");
  QVERIFY(!window.Part<QPushButton>("trackerAlign")->isEnabled());
  QVERIFY(!window.Part<QPushButton>("trackerSlide")->isEnabled());
  window.Part<QPushButton>("trackerConnect")->click();
  // A slide that was none is an error, and changes nothing.
  Connect(window, "simulated:?motion=still", "simulated:?motion=still", "alignTo=1 0 0");
  QTRY_VERIFY(window.Scan().IsFollowing());
  auto* slide = window.Part<QPushButton>("trackerSlide");
  slide->click();
  QTRY_COMPARE(slide->text().remove('&'), QString("It was slid"));
  slide->click();
  QTRY_VERIFY(window.HasMessage("was not slid by 10 mm"));
  QTRY_COMPARE(slide->text().remove('&'), QString("Align by a slide"));
}

void TestScanFusion::theWindowGoesOnWhileATrackerIsConnected()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  Connect(window, "simulated:", "simulated:");
  auto* connect = window.Part<QPushButton>("trackerConnect");
  const auto* address = window.Part<QLineEdit>("trackerAddress");
  const auto text = [connect] { return connect->text().remove('&'); };
  QCOMPARE(text(), QString("Disconnect"));
  connect->click();
  connect->click(); // once more: it goes on at once, and is connected later
  QCOMPARE(text(), QString("Cancel"));
  QVERIFY(!address->isEnabled());
  emit window.Scan().SubjectChanged(); // what has normals is not for it yet
  QTRY_COMPARE(text(), QString("Disconnect"));
  connect->click();
  connect->click();
  connect->click(); // no, not this one
  QVERIFY(window.Wait());
  QCOMPARE(text(), QString("Connect"));
  QVERIFY(address->isEnabled());
  QVERIFY(!window.Part<ProbeTracker>("trackerPanel")->Tracker()->GetActive());
  connect->click(); // and a window that is closed meanwhile waits for it
}

int main(int argc, char** argv)
{
  return RunWindowTest("SimulatorTest", argc, argv, [argc, argv] {
    TestScanFusion test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestScanFusion.moc"
