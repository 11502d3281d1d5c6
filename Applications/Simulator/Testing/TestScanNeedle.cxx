// SPDX-License-Identifier: BSD-3-Clause
// The needle: by keys and mouse, in guides, stopped by bone, led by a tracker, in a task; and a session of two minutes that is
// recorded and made again.
#include "Core/Base/Angles.h"
#include "LiveScanner.h"
#include "NeedleTool.h"
#include "OutputPanel.h"
#include "Readers/SequenceFile.h"
#include "ScanLog.h"
#include "SimulatorUnderTest.h"
#include "TaskPanel.h"
#include "Tracking/Stream/SequenceRecorder.h"
#include "Widgets/Session/LiveScore.h"
#include <QCheckBox>
#include <QComboBox>
#include <QDockWidget>
#include <QJsonArray>
#include <QJsonDocument>
#include <QJsonObject>
#include <QLabel>
#include <QLineEdit>
#include <QLineF>
#include <QPushButton>
#include <QSignalSpy>
#include <QTimer>
#include <QtTest>
#include <QVTKOpenGLNativeWidget.h>
#include <vtkImageData.h>
#include <vtkPointData.h>

using namespace echorama;
using Eigen::Vector3d;

class TestScanNeedle : public FolderTest {
  Q_OBJECT

private slots:
  void itGoesAlongItsAxisAndIsSeenThere();
  void aGuideGoesWithTheProbeAndAHandStays();
  void itCrossesThePlaneFromAGuideBeside();
  void oneThatComesIsSeenWholeUnlessTheViewWasTurned();
  void aMouseBringsTurnsAndAdvancesIt();
  void boneStopsIt();
  void aTrackedToolIsTheNeedle();
  void aTrackedToolThatRestsDisturbsNothing();
  void whatATrackerOrAFrozenImageHoldsKeepsItsGuide();
  void aTargetIsReachedAndScored();
  void aSessionOfTwoMinutesReplaysToTheLastBit();
  void thePictureOfTheManual();

private:
  /// In the plane of the image: across and down, and off it.
  static Vector3d InProbe(SimulatorUnderTest& window, const Vector3d& world)
  {
    return window.Scan().ProbeToWorld().inverse() * world;
  }
  static double Angle(const Vector3d& a, const Vector3d& b)
  {
    return std::acos(std::min(1.0, a.normalized().dot(b.normalized()))) * DegreesPerRadian;
  }
  /// With 1 or 5 mm a key, to a depth of the tip from the entry.
  static void AdvanceTo(SimulatorUnderTest& window, double mm)
  {
    NeedleTool& needle = *window.Window().TheNeedle();
    const auto isBefore = [&](double depth) { return needle.InsideMm() < depth && !needle.HasMetBone(); };
    QVERIFY(AdvanceWhile(
        window, [&] { return isBefore(mm - 2.5); }, Qt::ShiftModifier));
    QVERIFY(AdvanceWhile(window, [&] { return isBefore(mm - 0.5); }));
    window.Frame();
  }
  /// False where that has no end: a needle is shorter than so many keys.
  static bool AdvanceWhile(SimulatorUnderTest& window, const std::function<bool()>& goesOn, Qt::KeyboardModifiers keys = {})
  {
    for (int i = 0; i < 250; i++) {
      if (!goesOn())
        return true;
      window.Key(Qt::Key_W, keys);
    }
    return false;
  }
};

void TestScanNeedle::itGoesAlongItsAxisAndIsSeenThere()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::Write(Folder(), "body.mha", [](const Vector3d&) { return 90.0; })}));
  NeedleTool& needle = *window.Window().TheNeedle();
  QVERIFY(!window.Scan().Frame().needle);
  window.Key(Qt::Key_N);
  window.Frame();
  QVERIFY(needle.IsShown() && needle.Guide() == NeedleGuide::InPlane);
  QVERIFY2(window.Part<QLabel>("needleState")->text().contains("outside"), "it waits outside of the skin");
  const QImage before = window.Scan().Picture().image;
  const Vector3d direction = needle.Now().direction, start = needle.Now().tip;
  AdvanceTo(window, 35.0);
  const Needle now = needle.Now();
  QVERIFY(Angle(now.direction, direction) < 1e-6);
  QVERIFY((now.tip - start).cross(direction).norm() < 1e-9); // it bends not
  QVERIFY((window.Scan().Frame().needle->tip - now.tip).norm() < 1e-12);
  // Where it is the image is brighter, and nowhere else above it.
  const Vector3d tip = InProbe(window, now.tip), way = window.Scan().ProbeToWorld().linear().transpose() * now.direction;
  QVERIFY(std::fabs(tip[1]) < 1e-9);
  const PlanePicture& picture = window.Scan().Picture();
  int brighter = 0;
  for (int y = 0; y < picture.image.height(); y++)
    for (int x = 0; x < picture.image.width(); x++) {
      const int by = qGray(picture.image.pixel(x, y)) - qGray(before.pixel(x, y));
      if (by < 30)
        continue;
      const Vector3d at(picture.topLeft.x() + (x + 0.5) * picture.pixel.width(), 0.0,
                        picture.topLeft.y() + (y + 0.5) * picture.pixel.height());
      const double behind = (tip - at).dot(way), aside = (tip - at - behind * way).norm();
      const bool rings = at[2] > (tip - behind * way)[2]; // below it
      QVERIFY2(behind > -2.0 && (aside < 2.0 || rings), qPrintable(QString("%1 %2").arg(at[0]).arg(at[2])));
      brighter++;
    }
  QVERIFY2(brighter > 100, qPrintable(QString::number(brighter)));
  QVERIFY2(needle.State().contains("in the plane"), qPrintable(needle.State()));
  // Back out, all of the way, and nothing is left.
  for (int i = 0; i < 10; i++)
    window.Key(Qt::Key_X, Qt::ShiftModifier);
  window.Frame();
  QVERIFY(needle.InsideMm() < 0.0);
  QVERIFY(window.Scan().Picture().image == before);
  window.Key(Qt::Key_N);
  window.Frame();
  QVERIFY(!needle.IsShown() && !window.Scan().Frame().needle);
  // Frozen it stays where it was.
  window.Key(Qt::Key_N);
  window.Frame();
  window.Key(Qt::Key_Space);
  const Vector3d frozen = needle.Now().tip;
  window.Key(Qt::Key_W, Qt::ShiftModifier);
  QVERIFY(needle.Now().tip == frozen);
  // The snapshot says where it was.
  const QString png = window.Window().TakePicture();
  QFile json(png.left(png.size() - 3) + "json");
  QVERIFY(json.open(QIODevice::ReadOnly));
  const QJsonObject saved = QJsonDocument::fromJson(json.readAll()).object()["needle"].toObject();
  QCOMPARE(saved["tip"].toArray()[2].toDouble(), frozen[2]);
  QCOMPARE(saved["direction"].toArray().size(), 3);
}

void TestScanNeedle::aGuideGoesWithTheProbeAndAHandStays()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  NeedleTool& needle = *window.Window().TheNeedle();
  window.Key(Qt::Key_N);
  window.Frame();
  const Vector3d inProbe = InProbe(window, needle.Now().tip);
  window.Move(Qt::Key_Right, Qt::ShiftModifier);
  QVERIFY((InProbe(window, needle.Now().tip) - inProbe).norm() < 1e-9);
  // Its angle changes where it crosses the middle of the image: the more to the right the less deep.
  const auto crossing = [&] {
    const Vector3d tip = InProbe(window, needle.Now().tip);
    const Vector3d way = window.Scan().ProbeToWorld().linear().transpose() * needle.Now().direction;
    return tip[2] - tip[0] * way[2] / way[0];
  };
  const double first = crossing();
  window.Move(Qt::Key_D, Qt::NoModifier, 3);
  QVERIFY2(std::fabs(crossing() - (first - 6.0)) < 1e-6, qPrintable(QString::number(crossing() - first)));
  // In the body neither the guide nor its angle is changed.
  AdvanceTo(window, 10.0);
  window.Key(Qt::Key_G);
  QVERIFY(needle.Guide() == NeedleGuide::InPlane);
  QVERIFY(window.HasMessage("withdraw it first"));
  window.Move(Qt::Key_D);
  QVERIFY(std::fabs(crossing() - (first - 6.0)) < 1e-6);
  for (int i = 0; i < 4; i++)
    window.Key(Qt::Key_X, Qt::ShiftModifier);
  window.Key(Qt::Key_G);
  QVERIFY(needle.Guide() == NeedleGuide::OutOfPlane);
  window.Key(Qt::Key_G);
  QVERIFY(needle.Guide() == NeedleGuide::None);
  // In a hand it stays where it is, and turns about its entry.
  const Needle held = needle.Now();
  window.Move(Qt::Key_Left, Qt::ShiftModifier);
  QVERIFY((needle.Now().tip - held.tip).norm() < 1e-9);
  AdvanceTo(window, 12.0);
  const Vector3d entry = needle.Entry(), before = needle.Now().direction;
  window.Move(Qt::Key_A, Qt::NoModifier, 3);
  QVERIFY2(std::fabs(Angle(before, needle.Now().direction) - 6.0) < 0.7, "as seen in the image");
  QVERIFY((needle.Entry() - entry).norm() < 0.5);
  QVERIFY(needle.Now().direction.dot(window.Axis(0)) < before.dot(window.Axis(0))); // to the left
}

void TestScanNeedle::itCrossesThePlaneFromAGuideBeside()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::Write(Folder(), "body.mha", [](const Vector3d&) { return 90.0; })}));
  window.Scan().SetControl("DepthMm", "60");
  window.Frame();
  NeedleTool& needle = *window.Window().TheNeedle();
  window.Key(Qt::Key_N);
  window.Key(Qt::Key_G);
  window.Frame();
  QVERIFY(needle.Guide() == NeedleGuide::OutOfPlane);
  AdvanceTo(window, 10.0);
  const QImage off = window.Scan().Picture().image;
  QVERIFY2(needle.State().contains("out of the plane"), qPrintable(needle.State()));
  QVERIFY(needle.Now().direction.dot(window.Axis(1)) < 0.0); // from the side of who looks
  window.Key(Qt::Key_N);
  window.Frame();
  QVERIFY2(off == window.Scan().Picture().image, "out of the plane nothing of it is shown");
  window.Key(Qt::Key_N);
  QVERIFY(AdvanceWhile(window, [&] { return InProbe(window, needle.Now().tip)[1] > 0.0; }));
  window.Frame();
  QVERIFY2(needle.State().contains("in the plane"), qPrintable(needle.State()));
  QVERIFY(std::fabs(InProbe(window, needle.Now().tip)[2] - 0.45 * 60.0) < 2.0); // where the guide aims
  QVERIFY(!window.Scan().Scanner().MarkedTip());
  window.Scan().SetControl("NeedleShowTip", "on");
  window.Frame();
  const auto mark = window.Scan().Scanner().MarkedTip();
  QVERIFY(mark &&
          std::hypot(mark->x() - InProbe(window, needle.Now().tip)[0], mark->y() - InProbe(window, needle.Now().tip)[2]) < 1e-6);
}

void TestScanNeedle::oneThatComesIsSeenWholeUnlessTheViewWasTurned()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  NeedleTool& needle = *window.Window().TheNeedle();
  BodyView& view = *window.Window().Body();
  view.Fit();
  for (const double length : {200.0, 1000.0}) { // the second time as the first
    window.Scan().SetControl("NeedleLengthMm", QString::number(length).toStdString());
    window.Key(Qt::Key_N);
    window.Frame();
    QVERIFY(needle.IsShown());
    const Vector3d hub = needle.Now().tip - length * needle.Now().direction;
    const QPoint there = view.ToCanvas(hub.data()).toPoint();
    QVERIFY2(view.Canvas()->rect().contains(there), qPrintable(QString("%1, %2").arg(there.x()).arg(there.y())));
    window.Key(Qt::Key_N);
    window.Frame();
  }
  view.Fit();
  window.Wheel(view.Canvas(), 2);
  window.Frame();
  const Vector3d middle = Vector3d::Zero(), side(20.0, 0.0, 0.0);
  const auto scale = [&] { return QLineF(view.ToCanvas(middle.data()), view.ToCanvas(side.data())).length(); };
  const double before = scale();
  window.Key(Qt::Key_N);
  window.Frame();
  QVERIFY(needle.IsShown());
  QCOMPARE(scale(), before);
}

void TestScanNeedle::aMouseBringsTurnsAndAdvancesIt()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  NeedleTool& needle = *window.Window().TheNeedle();
  auto* canvas = window.Window().Body()->Canvas();
  window.Key(Qt::Key_N);
  window.Frame();
  const Pose probe = window.Scan().ProbeToWorld();
  // Beside the probe on its skin, as it is seen from the side.
  const Vector3d place = probe * Vector3d(-12.0, 14.0, 3.0);
  const auto nearest = window.Scan().Body().mesh->NearestTo(place);
  const Vector3d skin = window.Scan().Body().mesh->PointAt(nearest->place);
  const QPoint there = window.Window().Body()->ToCanvas(skin.data()).toPoint();
  window.Press(canvas, there, Qt::LeftButton, Qt::ControlModifier | Qt::ShiftModifier);
  window.Release(canvas, there, Qt::LeftButton, Qt::ControlModifier | Qt::ShiftModifier);
  window.Frame();
  QVERIFY(needle.Guide() == NeedleGuide::None);
  QVERIFY2((needle.Entry() - skin).norm() < 2.0, qPrintable(QString::number((needle.Entry() - skin).norm())));
  QVERIFY(window.Scan().ProbeToWorld().matrix() == probe.matrix()); // the probe was not taken
  // It is taken by its shaft: dragged, turned, advanced.
  const auto shaft = [&] {
    const Vector3d at = needle.Now().tip - 60.0 * needle.Now().direction;
    return window.Window().Body()->ToCanvas(at.data()).toPoint();
  };
  const Vector3d entry = needle.Entry(), direction = needle.Now().direction;
  const QPoint taken = shaft();
  window.Drag(canvas, taken, taken + QPoint(20, 0));
  window.Frame();
  QVERIFY2((needle.Entry() - entry).norm() > 1.0,
           qPrintable(QString("the needle came %1 mm far; it was taken at %2, %3 of a view of %4 x %5, and lies at %6, %7 now")
                          .arg((needle.Entry() - entry).norm())
                          .arg(taken.x())
                          .arg(taken.y())
                          .arg(canvas->width())
                          .arg(canvas->height())
                          .arg(shaft().x())
                          .arg(shaft().y())));
  QVERIFY(Angle(needle.Now().direction, direction) < 1e-6);
  window.Drag(canvas, shaft(), shaft() + QPoint(20, 0), Qt::LeftButton, Qt::ShiftModifier);
  window.Frame();
  QVERIFY(Angle(needle.Now().direction, direction) > 3.0);
  const double out = needle.InsideMm();
  window.Drag(canvas, shaft(), shaft() + QPoint(0, 60), Qt::LeftButton, Qt::ControlModifier);
  window.Frame();
  QVERIFY2(needle.InsideMm() > out + 8.0, qPrintable(QString("%1 %2").arg(out).arg(needle.InsideMm())));
  QVERIFY(window.Scan().ProbeToWorld().matrix() == probe.matrix());
  // In the body it does not go sideways.
  const Vector3d inside = needle.Now().tip;
  QVERIFY(needle.InsideMm() > 0.0);
  window.Drag(canvas, shaft(), shaft() + QPoint(20, 0));
  QVERIFY(needle.Now().tip == inside);
  QVERIFY(window.HasMessage("withdraw it first"));
  window.Grab("simulator-needle-in-hand");
}

void TestScanNeedle::boneStopsIt()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())})); // white, of 5 mm radius, at the origin
  NeedleTool& needle = *window.Window().TheNeedle();
  window.Key(Qt::Key_N);
  window.Key(Qt::Key_G);
  window.Key(Qt::Key_G);
  window.Scan().SetControl("NeedleStops", "on");
  // From the top straight to the middle.
  const Vector3d top(0.0, -body::HalfAxes[1], 0.0);
  needle.PutEntry(top);
  for (int i = 0; i < 60 && Angle(needle.Now().direction, -needle.Entry()) > 1.5; i++)
    needle.Steer(needle.Now().direction.dot(window.Axis(0)) > 0.01    ? -1.0
                 : needle.Now().direction.dot(window.Axis(0)) < -0.01 ? 1.0
                                                                      : 0.0,
                 needle.Now().direction.dot(window.Axis(1)) > 0.01    ? -1.0
                 : needle.Now().direction.dot(window.Axis(1)) < -0.01 ? 1.0
                                                                      : 0.0);
  QVERIFY(Angle(needle.Now().direction, -needle.Entry()) < 1.6);
  AdvanceTo(window, 60.0);
  QVERIFY(needle.HasMetBone());
  QVERIFY2(needle.State().contains("has met bone"), qPrintable(needle.State()));
  // 250 within 5 mm, 100 outside, voxels of 1.5 mm: 217 a little within.
  QVERIFY2(std::fabs(needle.Now().tip.norm() - 5.0) < 1.5, qPrintable(QString::number(needle.Now().tip.norm())));
  const Vector3d stopped = needle.Now().tip;
  window.Key(Qt::Key_W, Qt::ShiftModifier);
  QVERIFY((needle.Now().tip - stopped).norm() < 0.02);
  window.Key(Qt::Key_X);
  QVERIFY(!needle.HasMetBone());
  QVERIFY(std::fabs((needle.Now().tip - stopped).norm() - 1.0) < 0.02);
  // It cannot be turned into it either: back, aside, down beside the ball, and then towards it.
  for (int i = 0; i < 20; i++)
    window.Key(Qt::Key_X);
  window.Key(Qt::Key_A);
  for (int i = 0; i < 5; i++)
    window.Key(Qt::Key_A);
  QVERIFY(AdvanceWhile(window, [&] { return needle.InsideMm() < 36.0 && !needle.HasMetBone(); }));
  QVERIFY(!needle.HasMetBone());
  for (int i = 0; i < 8; i++)
    window.Key(Qt::Key_D);
  QVERIFY(needle.HasMetBone());
  QVERIFY2(needle.Now().tip.norm() > 4.0, qPrintable(QString::number(needle.Now().tip.norm())));
  window.Scan().SetControl("NeedleStops", "off");
  for (int i = 0; i < 30; i++)
    window.Key(Qt::Key_X);
  needle.PutEntry(top);
  double nearest = 100.0;
  for (int i = 0; i < 45; i++) {
    window.Key(Qt::Key_W);
    nearest = std::min(nearest, needle.Now().tip.norm());
  }
  QVERIFY2(nearest < 4.0, "nobody asked for a stop");
}

void TestScanNeedle::aTrackedToolIsTheNeedle()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  NeedleTool& needle = *window.Window().TheNeedle();
  const Pose probe = window.Scan().ProbeToWorld();
  Pose tool = probe; // 20 mm below the face, along the array
  tool.linear().col(2) = probe.linear().col(0);
  tool.linear().col(0) = -probe.linear().col(2);
  const QString log = Folder().filePath("log.igs.mha");
  {
    SequenceRecorder recorder(log.toStdString());
    for (int i = 0; i < 60; i++) {
      tool.translation() = probe * Vector3d(-5.0 + 0.1 * i, 0.0, 20.0);
      SequenceFrame frame;
      frame.time = 10.0 + i / 60.0;
      frame.transforms.push_back({"ProbeToTracker", Eigen::Affine3d(probe.matrix())});
      frame.transforms.push_back({"NeedleToTracker", Eigen::Affine3d(tool.matrix())});
      recorder.Append(frame);
    }
    recorder.Finish();
  }
  window.Type(window.Part<QLineEdit>("trackerAddress"), "replay:" + log);
  window.Part<QPushButton>("trackerConnect")->click();
  auto* tools = window.Part<QComboBox>("trackerNeedle");
  QTRY_VERIFY(tools->count() == 3);
  QVERIFY(!needle.IsShown()); // until a person says which
  const int which = tools->findText("Needle", Qt::MatchContains);
  QVERIFY(which > 0);
  window.Part<QComboBox>("trackerTool")
      ->setCurrentIndex(window.Part<QComboBox>("trackerTool")->findText("Probe", Qt::MatchContains));
  tools->setCurrentIndex(which);
  QTRY_VERIFY(needle.IsFollowing());
  QTRY_VERIFY((needle.Now().tip - tool.translation()).norm() < 1e-6);
  QVERIFY(Angle(needle.Now().direction, probe.linear().col(0)) < 1e-4);
  window.Frame();
  QVERIFY2(needle.State().contains("in the plane"), qPrintable(needle.State()));
  const Vector3d there = needle.Now().tip;
  window.Key(Qt::Key_W, Qt::ShiftModifier);
  QVERIFY(needle.Now().tip == there); // the tracker has it
  needle.Follow(Eigen::Matrix4d::Constant(std::nan("")));
  QVERIFY(needle.Now().tip == there);
  window.Part<QPushButton>("trackerConnect")->click();
  QVERIFY(!needle.IsFollowing());
  QVERIFY((needle.Now().tip - there).norm() < 1e-6); // and goes on from there by hand
  window.Key(Qt::Key_X);
  QVERIFY((needle.Now().tip - there).norm() > 0.5);
}

void TestScanNeedle::aTrackedToolThatRestsDisturbsNothing()
{
  Pose tool = Pose::Identity();
  QStringList said;
  {
    SimulatorUnderTest window;
    QVERIFY(window.Open({body::WriteWithBall(Folder())})); // white, of 5 mm radius, at the origin
    NeedleTool& needle = *window.Window().TheNeedle();
    tool.linear() = Eigen::AngleAxisd(-0.5 * Pi, Vector3d::UnitX()).toRotationMatrix(); // z looks down, along y
    tool.translation() = Vector3d(0.0, -2.0, 0.0);
    needle.Follow(tool.matrix());
    QVERIFY(needle.IsFollowing() && (needle.Now().tip - tool.translation()).norm() < 1e-12);
    QVERIFY(!needle.HasMetBone()); // nobody asks for it
    const QSignalSpy changes(&needle, &NeedleTool::Changed);
    for (int i = 0; i < 5; i++)
      needle.Follow(tool.matrix());
    QCOMPARE(changes.count(), 0);
    needle.SetLost();
    needle.Follow(tool.matrix()); // it is seen again
    QCOMPARE(changes.count(), 2);
    QVERIFY2(!needle.State().contains("does not see"), qPrintable(needle.State()));
    needle.SetShown(false);
    needle.Follow(tool.matrix());
    QVERIFY(needle.IsShown());
    // It rests, but what bone is was changed.
    window.Scan().SetControl("NeedleStops", "on");
    needle.Follow(tool.matrix());
    QVERIFY(needle.HasMetBone());
    // Where bone cannot be told the needle is followed all the same, and that is said once.
    connect(&window.Scan(), &Scan::Said, &needle, [&said](const Message& message) { said.append(message.text); });
    vtkImageData* volume = window.Scan().Body().volumes.front();
    volume->GetPointData()->Initialize();
    volume->Modified();
    for (int i = 0; i < 5; i++) {
      tool.translation()[0] += 1.0;
      needle.Follow(tool.matrix());
      QVERIFY((needle.Now().tip - tool.translation()).norm() < 1e-12);
    }
    QVERIFY(!needle.HasMetBone());
    QCOMPARE(said.filter("meets bone is not known").size(), 1);
  }
  // A picture in the background goes on to its best, whether or not bone stops needles.
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteScene(Folder())}));
  NeedleTool& needle = *window.Window().TheNeedle();
  tool.translation() = Vector3d(0.0, 0.0, 10.0);
  QTimer poll;
  connect(&poll, &QTimer::timeout, &needle, [&] { needle.Follow(tool.matrix()); });
  poll.start(8);
  window.Scan().SetControl("Source", "acoustic");
  const auto refinement = [&window] {
    for (const auto& [name, text] : *window.Scan().Frame().settings)
      if (name == "Refinement")
        return QString::fromStdString(text);
    return QString();
  };
  for (const char* stops : {"off", "on"}) {
    const std::int64_t before = window.Scan().Frame().number;
    window.Scan().SetControl("NeedleStops", stops);
    QTRY_VERIFY_WITH_TIMEOUT(window.Scan().Frame().number > before && refinement() == "3", 60000);
  }
  // Nor is it given up because the tool moves: whether that met bone (of 6 mm about 0, 0, 30) is told with the picture.
  poll.stop();
  tool.translation()[0] += 1.0;
  needle.Follow(tool.matrix());
  window.Scan().MakeNow();
  QVERIFY(window.Scan().IsMaking() && !needle.HasMetBone());
  tool.translation() = Vector3d(0.0, 0.0, 30.0);
  needle.Follow(tool.matrix());
  QVERIFY(window.Scan().IsMaking() && needle.Now().tip == tool.translation());
  QTRY_VERIFY_WITH_TIMEOUT(needle.HasMetBone(), 60000);
}

void TestScanNeedle::whatATrackerOrAFrozenImageHoldsKeepsItsGuide()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  NeedleTool& needle = *window.Window().TheNeedle();
  auto* combo = window.Part<QComboBox>("needleGuide");
  window.Key(Qt::Key_N);
  window.Frame();
  QVERIFY(needle.Guide() == NeedleGuide::InPlane);
  const QString shown = combo->currentText();
  const auto staysAsItIs = [&] {
    const Needle before = needle.Now();
    const QSignalSpy changes(&needle, &NeedleTool::Changed);
    window.Key(Qt::Key_G);
    combo->setCurrentIndex(combo->findText("a hand"));
    needle.SetGuide(NeedleGuide::None);
    return changes.count() >= 2 && combo->currentText() == shown && needle.Guide() == NeedleGuide::InPlane &&
           needle.Now().tip == before.tip && needle.Now().direction == before.direction;
  };
  window.Key(Qt::Key_Space);
  QVERIFY(window.Scan().IsFrozen());
  QVERIFY(staysAsItIs());
  window.Key(Qt::Key_Space);
  Pose tool = window.Scan().ProbeToWorld();
  tool.translation() += 12.0 * window.Axis(2);
  needle.Follow(tool.matrix());
  QVERIFY(needle.IsFollowing());
  QVERIFY(staysAsItIs());
  QVERIFY(needle.IsFollowing());
}

void TestScanNeedle::aTargetIsReachedAndScored()
{
  const QString body = body::WriteWithBall(Folder());
  Vector3d target;
  {
    SimulatorUnderTest teacher;
    QVERIFY(teacher.Open({body}));
    teacher.Part<TaskPanel>("taskPanel")->SetFolder(Folder());
    teacher.Part<QLineEdit>("taskName")->setText("cyst");
    teacher.Part<QPushButton>("saveTarget")->click();
    QVERIFY(teacher.HasMessage("Bring the needle's tip there"));
    teacher.Key(Qt::Key_N);
    teacher.Frame();
    AdvanceTo(teacher, 30.0);
    target = teacher.Window().TheNeedle()->Now().tip;
    teacher.Part<QPushButton>("saveTarget")->click();
    QVERIFY2(teacher.HasMessage("cyst.task.json"), qPrintable(teacher.Messages().join('\n')));
    // With hints, and the tip; by the callipers' end.
    teacher.Part<QLineEdit>("taskName")->setText("open");
    teacher.Part<QCheckBox>("taskHint")->setChecked(true);
    teacher.Part<QCheckBox>("taskShowTip")->setChecked(true);
    teacher.Key(Qt::Key_C);
    for (const QPointF& mm : {QPointF(0.0, 20.0), QPointF(6.0, 25.0)})
      teacher.Click(&teacher.Image(), teacher.Image().ToWidget(mm).toPoint());
    teacher.Part<QPushButton>("saveTarget")->click();
    const ScanTask open = ReadScanTask(Folder().filePath("open.task.json").toStdString());
    const auto& goal = std::get<ReachTarget>(open.goal);
    QVERIFY((InProbe(teacher, goal.target) - Vector3d(6.0, 0.0, 25.0)).norm() < 0.3); // to a pixel
    QVERIFY(goal.showTip && open.hint);
    QVERIFY((std::get<ReachTarget>(ReadScanTask(Folder().filePath("cyst.task.json").toStdString()).goal).target - target).norm() <
            1e-9);
  }
  SimulatorUnderTest window;
  QVERIFY(window.Open({body}));
  NeedleTool& needle = *window.Window().TheNeedle();
  auto* panel = window.Part<TaskPanel>("taskPanel");
  panel->SetFolder(Folder());
  window.Part<QLineEdit>("trainee")->setText("B. Learner");
  window.Key(Qt::Key_N);
  window.Scan().SetControl("NeedleShowTip", "on"); // which the task does not allow
  window.Frame();
  AdvanceTo(window, 20.0);
  QVERIFY(window.Scan().Scanner().MarkedTip());
  panel->OpenTask(Folder().filePath("cyst.task.json"));
  QVERIFY2(!window.HasMessage("window has not"), qPrintable(window.Messages().join('\n')));
  window.Part<QPushButton>("startTask")->click();
  window.Frame();
  QVERIFY(panel->IsRunning());
  // It begins outside, nothing tells of the tip, and no recording helps.
  QVERIFY(needle.IsShown() && needle.InsideMm() < 0.0);
  QVERIFY(!window.Part<QPushButton>("replay")->isEnabled());
  AdvanceTo(window, 20.0);
  QVERIFY(!window.Scan().Scanner().ShowsTip() && !window.Scan().Scanner().MarkedTip());
  QVERIFY(!window.Part<QCheckBox>("NeedleShowTip")->isVisibleTo(window.Part<QWidget>("needlePanel")));
  QVERIFY2(!needle.State().contains("plane"), qPrintable(needle.State()));
  QVERIFY(!window.Part<QLabel>("taskState")->text().contains("mm"));
  // A detour: out, elsewhere, turned within the body; then to the target.
  for (int i = 0; i < 6; i++)
    window.Key(Qt::Key_X, Qt::ShiftModifier);
  window.Key(Qt::Key_G);
  window.Key(Qt::Key_G);
  QVERIFY(needle.Guide() == NeedleGuide::None);
  AdvanceTo(window, 10.0);
  QTest::qWait(300);
  for (int i = 0; i < 5; i++)
    window.Key(Qt::Key_A);
  window.Frame();
  QTest::qWait(300);
  window.Part<QPushButton>("submitTask")->click();
  QString score = window.Part<QLabel>("taskScore")->text();
  QVERIFY2(score.startsWith("Not passed"), qPrintable(score));
  QVERIFY2(score.contains(" off, 1 redirection, 2 times in, "), qPrintable(score));
  // What was chosen before the attempt is back.
  window.Frame();
  QVERIFY(window.Scan().Scanner().ShowsTip());
  window.Part<QPushButton>("startTask")->click();
  window.Frame();
  QVERIFY(needle.Guide() == NeedleGuide::InPlane);
  const double start = (needle.Now().tip - target).norm();
  AdvanceTo(window, 30.0);
  window.Part<QPushButton>("submitTask")->click();
  score = window.Part<QLabel>("taskScore")->text();
  QVERIFY2(score.startsWith("Passed: ") && score.contains(" off, 0 redirections, 1 time in, "), qPrintable(score));
  const auto attempts = ReadAttempts(Folder().filePath("attempts.csv").toStdString());
  QCOMPARE(attempts.size(), std::size_t(2));
  QCOMPARE(attempts[0].edits, 1);
  QCOMPARE(attempts[1].edits, 0);
  const auto offPlane = [](const QString& told) {
    return told.section(", ", -2, -2).section(' ', 0, 0).toDouble();
  }; // "1.2 s of 3.4 s"
  QVERIFY2(std::fabs(attempts[1].outOfPlaneSeconds - offPlane(score)) < 0.051, qPrintable(score));
  QVERIFY(attempts[1].scoreMm < 1.5 && attempts[0].scoreMm > 5.0);
  QVERIFY2(start > 30.0 && std::fabs(attempts[1].startMm - start) < 1e-6, qPrintable(QString::number(attempts[1].startMm)));
  // A frozen image at the end keeps nothing from coming back.
  window.Part<QPushButton>("startTask")->click();
  window.Frame();
  window.Key(Qt::Key_Space);
  window.Part<QPushButton>("submitTask")->click();
  window.Key(Qt::Key_Space);
  window.Frame();
  QVERIFY(window.Scan().Scanner().ShowsTip());
  // A task that allows it tells the distance, and marks the tip.
  panel->OpenTask(Folder().filePath("open.task.json"));
  window.Part<QPushButton>("startTask")->click();
  window.Frame();
  AdvanceTo(window, 25.0);
  QVERIFY(window.Scan().Scanner().MarkedTip());
  QTRY_VERIFY(window.Part<QLabel>("taskState")->text().contains("the tip is"));
}

void TestScanNeedle::aSessionOfTwoMinutesReplaysToTheLastBit()
{
  const QString file = body::WriteWithBall(Folder());
  constexpr int rate = 10, count = 120 * rate;
  {
    SimulatorUnderTest window;
    QVERIFY(window.Open({file}));
    auto* output = window.Part<OutputPanel>("outputPanel");
    output->SetFolder(Folder());
    for (const auto& [name, value] :
         {std::pair<const char*, const char*>{"Width", "160"}, {"Height", "120"}, {"NoiseDb", "-30"}, {"NoiseMoves", "on"}})
      window.Scan().SetControl(name, value);
    window.Key(Qt::Key_N);
    window.Frame();
    Scan& scan = window.Scan();
    NeedleTool& needle = *window.Window().TheNeedle();
    window.Part<QPushButton>("record")->click();
    QVERIFY(output->IsRecording());
    // Two minutes at 10 frames a second, faster than they would go by: a hand that slides, tilts and rotates the probe, and a
    // needle that goes in and out, is turned, and put away in between.
    for (int i = 1; i < count; i++) {
      const double t = static_cast<double>(i) / rate;
      scan.Slide(0.3 * std::cos(0.5 * t), 0.2 * std::sin(0.8 * t));
      scan.Hold(0.2 * std::cos(0.7 * t), 0.3 * std::sin(0.9 * t));
      scan.Rotate(0.3 * std::cos(0.3 * t));
      if (i == 30 * rate) {
        needle.SetShown(false);
      } else if (i == 35 * rate) {
        needle.SetShown(true);
        needle.SetGuide(NeedleGuide::None);
        window.Scan().SetControl("NeedleShowTip", "on");
      } else if (i == 70 * rate) {
        needle.Advance(-60.0);
        needle.SetGuide(NeedleGuide::OutOfPlane);
        window.Scan().SetControl("GainDb", "3.3");
      }
      needle.Advance(std::fmod(t, 10.0) < 5.0 ? 0.8 : -0.8);
      if (i % 20 == 0)
        needle.Steer(1.5 * std::cos(t), 1.0);
      scan.MakeNow();
    }
    window.Part<QPushButton>("record")->click();
    QVERIFY(window.Wait());
    QVERIFY(window.HasMessage("Recorded as"));
  }
  const QString path = Folder().filePath(Folder().entryList({"*.scan.jsonl"}).value(0));
  const ScanLog log = ScanLog::Read(path);
  QVERIFY2(static_cast<int>(log.entries.size()) >= count, qPrintable(QString::number(log.entries.size())));
  int withNeedle = 0;
  for (const ScanLog::Entry& entry : log.entries)
    withNeedle += entry.frame.needle.has_value();
  QVERIFY(withNeedle > count / 2 && withNeedle < static_cast<int>(log.entries.size()) - 4 * rate);
  // Other readers find the needle among the transforms of the sequence.
  const SequenceFile sequence(Folder().filePath(Folder().entryList({"*.igs.mha"}).value(0)).toStdString());
  QCOMPARE(sequence.Content().frames, static_cast<int>(log.entries.size()));
  int needles = 0;
  for (int i = 0; i < sequence.Content().frames; i++) {
    needles += sequence.Frame(i).Find("NeedleToReference") != nullptr;
    QVERIFY(sequence.Frame(i).Find("ProbeToReference"));
  }
  QCOMPARE(needles, withNeedle);
  SimulatorUnderTest window; // another day
  QVERIFY(window.Open({file}));
  window.Part<OutputPanel>("outputPanel")->Replay(path);
  const QString all = QString::number(log.entries.size());
  QTRY_VERIFY2_WITH_TIMEOUT(window.HasMessage(all + " of " + all), qPrintable(window.Messages().join('\n')), 120000);
  // The needle counts: without it other images come out.
  int other = 0;
  for (std::size_t i = 0; i < log.entries.size(); i += 10) {
    ScanFrame frame = log.entries[i].frame;
    frame.needle.reset();
    window.Scan().Scanner().Make(frame);
    other += SumOf(window.Scan().Scanner().Output()) != log.entries[i].sum;
  }
  QVERIFY2(other > 20, qPrintable(QString::number(other)));
  // What is no needle is named by its line.
  QFile recorded(path);
  QVERIFY(recorded.open(QIODevice::ReadOnly));
  QList<QByteArray> lines = recorded.readAll().split('\n').mid(0, 3);
  lines[1].replace("\"Needle\":[", "\"Needle\":[5,");
  QFile damaged(Folder().filePath("damaged.scan.jsonl"));
  QVERIFY(damaged.open(QIODevice::WriteOnly));
  damaged.write(lines.join('\n') + "\n");
  damaged.close();
  window.Part<OutputPanel>("outputPanel")->Replay(damaged.fileName());
  QVERIFY(window.Wait());
  QVERIFY2(window.HasMessage("line 2") && window.HasMessage("Needle"), qPrintable(window.Messages().join('\n')));
}

void TestScanNeedle::thePictureOfTheManual()
{
  const QDir liver(ECHORAMA_SOURCE_DIR "/../shared/data/liver");
  if (!liver.exists("liver_volume_full.mha"))
    QSKIP("the liver is not there");
  SimulatorUnderTest window;
  QVERIFY(window.Open({liver.filePath("liver_volume_full.mha")}));
  window.Scan().SetControl("DepthMm", "90");
  window.Scan().SetControl("GainDb", "6");
  window.Scan().SetControl("NeedleShowTip", "on");
  window.Key(Qt::Key_N);
  window.Frame();
  for (int i = 0; i < 6; i++)
    window.Key(Qt::Key_D); // less deep
  AdvanceTo(window, 52.0);
  window.Part<QDockWidget>("needlePanelDock")->raise();
  window.Window().Body()->Fit();
  QTest::qWait(1200); // until no frame is of the last second
  window.Frame();
  ComparePicture(window.Grab("simulator-needle"), "simulator-needle");
}

int main(int argc, char** argv)
{
  return RunWindowTest("SimulatorTest", argc, argv, [argc, argv] {
    TestScanNeedle test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestScanNeedle.moc"
