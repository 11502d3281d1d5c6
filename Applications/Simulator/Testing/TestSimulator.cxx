// SPDX-License-Identifier: BSD-3-Clause
// The simulator as a person uses it: the real window on a screen, real mouse and key events. What is asked is where the probe
// then is and what it sees.
#include "Core/Base/Angles.h"
#include "OutputPanel.h"
#include "SimulatorUnderTest.h"
#include <algorithm>
#include <map>
#include <memory>
#include <QAction>
#include <QApplication>
#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QJsonArray>
#include <QJsonDocument>
#include <QJsonObject>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QSlider>
#include <QStandardPaths>
#include <QToolButton>
#include <QtTest>
#include <QVTKOpenGLNativeWidget.h>
#include <vtkCubeSource.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkSTLWriter.h>
#include <vtkTriangleFilter.h>
#include <vtkUltrasoundVolume.h>
#include <vtkUnsignedCharArray.h>
#include <vtkXMLImageDataWriter.h>

using namespace echorama;

namespace {

QString refinementOf(const ScanFrame& frame)
{
  for (const auto& [name, text] : *frame.settings)
    if (name == "Refinement")
      return QString::fromStdString(text);
  return {};
}

} // namespace

class TestSimulator : public FolderTest {
  Q_OBJECT

private slots:
  void aVolumeIsScannedFromTheTopOfItsSkin();
  void tenMillimetresOfSlidingAreTenMillimetresOfSkin();
  void theProbeStaysUnderTheMouse();
  void aDoubleClickPutsTheProbeThere();
  void tiltRockAndRotationTurnAboutTheirAxes();
  void offTheSkinThereIsNoImage();
  void controlsChangeTheImage();
  void aFrozenImageStaysAndTheCineIsWhatWasSeen();
  void callipersMeasure();
  void leftAndRightAreExchanged();
  void aSnapshotHoldsImageAndPose();
  void whatIsTheMatterIsShown();
  void posesThatAreNoneAreRefused();
  void aTrackerThatStoppedIsSeen();
  void aFileThatCannotBeReadIsNamed();
  void aSceneIsScanned();
  void aProbeInsideBoneIsSeen();
  void aSlowPictureIsGivenUpForANewPose();
  void whatIsInventedIsColouredOrHidden();
  void closingAsks();
  void aBodyStaysFittedUntilSomebodyZooms();
  void anImageThatFailsLeavesTheOneBefore();
  void thePicturesOfTheManual();
};

void TestSimulator::aVolumeIsScannedFromTheTopOfItsSkin()
{
  SimulatorUnderTest window;
  QVERIFY(window.Image().State().contains("Nothing is open"));
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  QVERIFY2(window.Messages().isEmpty(), qPrintable(window.Messages().join('\n')));
  QCOMPARE(window.Image().State(), QString());
  // On the front of the body, in its middle, looking back.
  QVERIFY((window.Place() - Eigen::Vector3d(0.0, -35.0, 0.0)).norm() < 1.5);
  QVERIFY(window.Axis(2).dot(Eigen::Vector3d::UnitY()) > 0.995);
  QVERIFY(window.Axis(0).dot(Eigen::Vector3d::UnitX()) > 0.995);
  const double depth = -window.Place()[1];
  QVERIFY(window.GreyAt(0.0, depth) > 220);                      // the ball
  QVERIFY(std::abs(window.GreyAt(0.0, 0.5 * depth) - 100) <= 4); // tissue
  QVERIFY(std::abs(window.GreyAt(12.0, depth) - 100) <= 4);
  QCOMPARE(window.GreyAt(0.0, 2.0 * depth + 8.0), -1); // behind the body nothing is invented
  QVERIFY(window.Part<QLabel>("readout")->text().contains("depth"));
}

void TestSimulator::tenMillimetresOfSlidingAreTenMillimetresOfSkin()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  const Eigen::Vector3d before = window.Place();
  window.Move(Qt::Key_Right, Qt::ShiftModifier);
  const Eigen::Vector3d by = window.Place() - before;
  // The chord of 10 mm of an arc whose radius is some 45 mm.
  QVERIFY2(by.norm() > 9.85 && by.norm() <= 10.001, qPrintable(QString::number(by.norm())));
  QVERIFY(by.dot(Eigen::Vector3d::UnitX()) > 9.7);
  QVERIFY(std::abs(body::Level(window.Place()) - 1.0) < 0.03);
  QVERIFY(window.Axis(2)[0] < -0.15); // it looks inwards, along the normal
  // The ball is where it was in the world, so elsewhere in the image.
  const Eigen::Vector3d ball = window.Scan().ProbeToWorld().inverse() * Eigen::Vector3d::Zero();
  QVERIFY(ball.norm() > 30.0 && std::abs(ball[1]) < 1.0);
  QVERIFY(window.GreyAt(ball[0], ball[2]) > 220);
  // Five small steps back are one long one.
  window.Move(Qt::Key_Left, Qt::NoModifier, 5);
  QVERIFY((window.Place() - before).norm() < 0.05);
  window.Move(Qt::Key_Up, Qt::ShiftModifier);
  const Eigen::Vector3d up = window.Place() - before;
  QVERIFY(up.norm() > 9.85 && std::abs(up[2]) > 9.7);
  window.Move(Qt::Key_Up, Qt::ShiftModifier, 2);
  QVERIFY(std::abs(window.GreyAt(0.0, 30.0) - 100) <= 4); // the ball is not in the plane any more
}

void TestSimulator::theProbeStaysUnderTheMouse()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  BodyView* body = window.Window().Body();
  const Eigen::Vector3d before = window.Place();
  const QPointF from = body->ToCanvas(before.data());
  window.Drag(body->Canvas(), from.toPoint(), from.toPoint() + QPoint(-40, 15));
  window.Frame();
  const Eigen::Vector3d after = window.Place();
  const QPointF now = body->ToCanvas(after.data());
  QVERIFY((after - before).norm() > 5.0);
  QVERIFY(std::abs(body::Level(after) - 1.0) < 0.03);
  const QPointF moved = now - from;
  QVERIFY2(QLineF(moved, {-40.0, 15.0}).length() < 3.0, qPrintable(QString("%1 %2").arg(moved.x()).arg(moved.y())));
  // With Shift it stays, and tilts.
  window.Drag(body->Canvas(), now.toPoint(), now.toPoint() + QPoint(0, 40), Qt::LeftButton, Qt::ShiftModifier);
  QCOMPARE(window.Place(), after);
  QVERIFY(std::abs(window.Scan().Held().tilt - 40 * 0.3 * RadiansPerDegree) < 0.02);
  // The right button turns the view.
  const QPointF still = body->ToCanvas(Eigen::Vector3d(20.0, 0.0, 20.0).eval().data());
  window.Drag(body->Canvas(), {100, 100}, {160, 100}, Qt::RightButton);
  QCOMPARE(window.Place(), after);
  QVERIFY(QLineF(still, body->ToCanvas(Eigen::Vector3d(20.0, 0.0, 20.0).eval().data())).length() > 5.0);
}

void TestSimulator::aDoubleClickPutsTheProbeThere()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  BodyView* view = window.Window().Body();
  // A place of the skin that is in sight: on the near side of the view.
  const Eigen::Vector3d start = window.Place();
  window.Move(Qt::Key_Down, Qt::ShiftModifier);
  const Eigen::Vector3d wanted = window.Place();
  const QPoint at = view->ToCanvas(wanted.data()).toPoint();
  window.Move(Qt::Key_Up, Qt::ShiftModifier);
  QVERIFY((window.Place() - start).norm() < 0.1);
  QTest::mouseDClick(window.Window().windowHandle(), Qt::LeftButton, {}, view->Canvas()->mapTo(&window.Window(), at));
  window.Frame();
  QVERIFY2((window.Place() - wanted).norm() < 1.0, qPrintable(QString::number((window.Place() - wanted).norm())));
}

void TestSimulator::tiltRockAndRotationTurnAboutTheirAxes()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  const Eigen::Matrix3d before = window.Scan().ProbeToWorld().linear();
  const Eigen::Vector3d place = window.Place();
  const auto turned = [&] {
    const Eigen::Vector3d turn = LogRotation(before.transpose() * window.Scan().ProbeToWorld().linear()) / RadiansPerDegree;
    return turn;
  };
  window.Move(Qt::Key_Down, Qt::ControlModifier, 3);
  QVERIFY((turned() - Eigen::Vector3d(-6.0, 0.0, 0.0)).norm() < 1e-6);
  QVERIFY(window.Axis(2).dot(before.col(1)) > 0.1); // towards who looks at the image: where Down slides to
  window.Move(Qt::Key_Home);
  QVERIFY(turned().norm() < 1e-9);
  window.Move(Qt::Key_Right, Qt::ControlModifier, 2);
  QVERIFY((turned() - Eigen::Vector3d(0.0, 4.0, 0.0)).norm() < 1e-6);
  QVERIFY(window.Axis(2).dot(before.col(0)) > 0.06); // to the right
  window.Move(Qt::Key_Home);
  window.Move(Qt::Key_E, Qt::NoModifier, 2);
  QVERIFY((turned() - Eigen::Vector3d(0.0, 0.0, 10.0)).norm() < 1e-6);
  window.Wheel(&window.Image(), -2);
  QVERIFY(turned().norm() < 1e-6);
  QVERIFY((window.Place() - place).norm() < 1e-9);
  window.Move(Qt::Key_PageDown, Qt::NoModifier, 3);
  QVERIFY((window.Place() - place - 3.0 * before.col(2)).norm() < 1e-6);
}

void TestSimulator::offTheSkinThereIsNoImage()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  const double depth = -window.Place()[1];
  window.Move(Qt::Key_PageUp, Qt::NoModifier, 2);
  QVERIFY(window.Image().State().contains("air"));
  QCOMPARE(window.GreyAt(0.0, depth), 0);
  window.Move(Qt::Key_PageDown, Qt::NoModifier, 2);
  QCOMPARE(window.Image().State(), QString());
  QVERIFY(window.GreyAt(0.0, depth) > 220);
}

void TestSimulator::controlsChangeTheImage()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  const double depth = window.Scan().Scanner().Probe().depthMax;
  window.Move(Qt::Key_BracketRight);
  QCOMPARE(window.Scan().Scanner().Probe().depthMax, depth + 10.0);
  QCOMPARE(window.Part<QDoubleSpinBox>("DepthMm")->value(), depth + 10.0);
  window.Type(window.Part<QDoubleSpinBox>("DepthMm"), "60");
  window.Frame();
  QCOMPARE(window.Scan().Scanner().Probe().depthMax, 60.0);
  const int before = window.GreyAt(0.0, 20.0);
  window.Image().setFocus();
  window.Move(Qt::Key_Plus, Qt::NoModifier, 3);
  // 6 dB of 60 dB that 255 levels span.
  QVERIFY2(std::abs(window.GreyAt(0.0, 20.0) - before - 25.5) <= 2.0, qPrintable(QString::number(window.GreyAt(0.0, 20.0))));
  window.Move(Qt::Key_Minus, Qt::NoModifier, 3);
  // A slider of the time-gain curve acts at its depth alone.
  window.Part<QSlider>("Tgc8DbSlider")->setValue(window.Part<QSlider>("Tgc8DbSlider")->maximum());
  window.Frame();
  QVERIFY(window.GreyAt(0.0, 59.0) > 200);
  QVERIFY(std::abs(window.GreyAt(0.0, 20.0) - before) <= 1);
  // Another probe, by keys alone: those of a choice that has the focus are not those of the probe.
  const Eigen::Vector3d place = window.Place();
  auto* probe = window.Part<QComboBox>("Probe");
  probe->setFocus(Qt::TabFocusReason);
  window.Move(Qt::Key_Down);
  QCOMPARE(window.Place(), place);
  QCOMPARE(probe->currentText(), QString("linear"));
  QCOMPARE(window.Scan().Scanner().Probe().fanAngle, 0.0);
}

void TestSimulator::aFrozenImageStaysAndTheCineIsWhatWasSeen()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  std::vector<QImage> seen;
  std::vector<std::int64_t> numbers;
  const int first = window.Scan().Cine().Count();
  for (int i = 0; i < 6; i++) {
    if (i == 3)
      window.Scan().SetControl("GainDb", "6");
    window.Move(Qt::Key_Right);
    seen.push_back(window.Scan().Picture().image);
    numbers.push_back(window.Scan().Frame().number);
  }
  QVERIFY(seen[0] != seen[5]);
  window.Key(Qt::Key_Space);
  QVERIFY(window.Scan().IsFrozen());
  window.Move(Qt::Key_Right, Qt::ShiftModifier);
  QCOMPARE(window.Scan().Picture().image, seen[5]); // the probe moved, the image did not
  // Every frame that was seen comes back to the last bit, whatever the controls are now: at each place the last one.
  const CineLoop& cine = window.Scan().Cine();
  std::size_t found = 0;
  for (int i = first; i < cine.Count(); i++) {
    if (i + 1 < cine.Count() && cine.At(i + 1).number != cine.At(i).number + 1)
      QFAIL("frames are missing");
    for (std::size_t k = 0; k < seen.size(); k++)
      if (cine.At(i).number == numbers[k]) {
        window.Part<QSlider>("cineSlider")->setValue(i);
        window.Settle();
        QCOMPARE(window.Scan().Picture().image, seen[k]);
        found++;
      }
  }
  QCOMPARE(found, seen.size());
  window.Key(Qt::Key_Left, Qt::AltModifier);
  QCOMPARE(window.Scan().CineIndex(), window.Scan().Cine().Count() - 2);
  window.Key(Qt::Key_Space);
  window.Frame();
  QVERIFY(!window.Scan().IsFrozen());
  QVERIFY(window.Scan().Picture().image != seen[5]);
  QCOMPARE(window.Part<QDoubleSpinBox>("GainDb")->value(), 6.0);

  // Ten minutes at 60 frames a second, with a control that is changed every second: of all that only the last 30 seconds are
  // kept.
  CineLoop loop(30.0, 4000);
  std::vector<std::weak_ptr<const ScanSettings>> controls;
  ScanFrame frame = window.Scan().Frame();
  for (int i = 0; i < 36000; i++) {
    if (i % 60 == 0) {
      frame.settings = std::make_shared<const ScanSettings>(*frame.settings);
      controls.emplace_back(frame.settings);
    }
    frame.number = i;
    frame.seconds = i / 60.0;
    frame.probeToWorld.translation()[0] = 0.01 * i;
    loop.Add(frame);
  }
  QVERIFY(loop.Count() >= 1800 && loop.Count() <= 1802);
  QCOMPARE(loop.At(loop.Count() - 1).number, std::int64_t(35999));
  const auto kept = std::count_if(controls.begin(), controls.end(), [](const auto& each) { return !each.expired(); });
  QVERIFY2(kept >= 30 && kept <= 32, qPrintable(QString::number(kept)));
}

void TestSimulator::callipersMeasure()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  window.Key(Qt::Key_C);
  const QPoint from = window.Image().ToWidget({-10.0, 30.0}).toPoint(), to = window.Image().ToWidget({10.0, 30.0}).toPoint();
  window.Click(&window.Image(), from);
  QVERIFY(window.Image().Callipers().empty()); // it has one end
  window.Click(&window.Image(), to);
  QCOMPARE(window.Image().Callipers().size(), std::size_t(1));
  const double pixelMm = std::abs(window.Image().ToPlane({1, 0}).x() - window.Image().ToPlane({0, 0}).x());
  QVERIFY(std::abs(window.Image().Callipers()[0].line.length() - 20.0) <= 1.5 * pixelMm);
  window.Drag(&window.Image(), to, window.Image().ToWidget({-10.0, 45.0}).toPoint());
  QVERIFY(std::abs(window.Image().Callipers()[0].line.length() - 15.0) <= 1.5 * pixelMm);
  window.Key(Qt::Key_C, Qt::ShiftModifier);
  QVERIFY(window.Image().Callipers().empty());
}

void TestSimulator::leftAndRightAreExchanged()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  window.Move(Qt::Key_Right, Qt::ShiftModifier);
  const Eigen::Vector3d ball = window.Scan().ProbeToWorld().inverse() * Eigen::Vector3d::Zero();
  const auto shownAt = [&](const QPointF& mm) {
    const QPoint at = window.Image().mapTo(&window.Window(), window.Image().ToWidget(mm).toPoint());
    return qGray(window.Window().grab().toImage().pixel(at));
  };
  const double x = window.Image().ToWidget({ball[0], ball[2]}).x(), middle = window.Image().ToWidget({0.0, ball[2]}).x();
  QVERIFY(shownAt({ball[0], ball[2]}) > 200);
  window.Key(Qt::Key_F);
  QVERIFY(std::abs(window.Image().ToWidget({ball[0], ball[2]}).x() - (2.0 * middle - x)) < 1.0);
  QVERIFY(shownAt({ball[0], ball[2]}) > 200);
  // So is what is recorded, sent and saved: its first column lies on the side of the mark.
  const ImageGeometry geometry = vtkUltrasoundVolume::GeometryOf(window.Scan().Scanner().Output());
  QVERIFY(geometry.direction.col(0).dot(window.Axis(0)) < -0.999);
  QVERIFY(geometry.direction.determinant() > 0.999);
  QVERIFY((window.Scan().ProbeToWorld().inverse() * geometry.origin)[0] > 10.0);
  // The arrows go as the image does, and so does rocking: the ball goes to the other side of the screen.
  const auto ballOnScreen = [&window] {
    const Eigen::Vector3d now = window.Scan().ProbeToWorld().inverse() * Eigen::Vector3d::Zero();
    return window.Image().ToWidget({now[0], now[2]}).x();
  };
  for (const bool flipped : {true, false}) {
    QCOMPARE(window.Scan().IsFlipped(), flipped);
    for (Qt::KeyboardModifier key : {Qt::ShiftModifier, Qt::ControlModifier}) {
      const double left = ballOnScreen();
      const Eigen::Vector3d before = window.Place();
      window.Move(Qt::Key_Right, key);
      QVERIFY(ballOnScreen() < left - 2.0);
      if (key == Qt::ShiftModifier)
        QVERIFY((window.Place() - before)[0] * (flipped ? -1.0 : 1.0) > 9.0);
    }
    const double left = ballOnScreen();
    window.Wheel(&window.Image(), 2, Qt::AltModifier);
    window.Frame();
    QVERIFY(ballOnScreen() < left - 2.0);
    window.Key(Qt::Key_F);
  }
  // Also what is frozen.
  window.Key(Qt::Key_F);
  window.Key(Qt::Key_Space);
  const QImage one = window.Scan().Picture().image, other = one.mirrored(true, false);
  window.Key(Qt::Key_F);
  QVERIFY(one != other);
  QVERIFY(window.Scan().Picture().image == other);
}

void TestSimulator::aSnapshotHoldsImageAndPose()
{
  qputenv("HOME", Folder().path().toLocal8Bit());
  SimulatorUnderTest window;
  const QString file = body::WriteWithBall(Folder());
  QVERIFY(window.Open({file}));
  window.Move(Qt::Key_Right, Qt::ShiftModifier);
  window.Key(Qt::Key_S);
  QVERIFY(window.HasMessage("Saved as"));
  const QDir folder(QStandardPaths::writableLocation(QStandardPaths::PicturesLocation) + "/Echorama");
  const QStringList pictures = folder.entryList({"*.png"}), texts = folder.entryList({"*.json"});
  QCOMPARE(pictures.size(), 1);
  QCOMPARE(texts.size(), 1);
  const QImage picture(folder.filePath(pictures[0]));
  const QImage& shown = window.Scan().Picture().image;
  QCOMPARE(picture.size(), shown.size());
  for (int y = 0; y < shown.height(); y += 7)
    for (int x = 0; x < shown.width(); x += 7)
      QCOMPARE(qGray(picture.pixel(x, y)), qAlpha(shown.pixel(x, y)) ? qGray(shown.pixel(x, y)) : 0);
  QFile text(folder.filePath(texts[0]));
  QVERIFY(text.open(QIODevice::ReadOnly));
  const QJsonObject all = QJsonDocument::fromJson(text.readAll()).object();
  QCOMPARE(all["volumes"].toArray()[0].toString(), file);
  for (int i = 0; i < 4; i++)
    for (int j = 0; j < 4; j++)
      QCOMPARE(all["ProbeToWorld"].toArray()[i].toArray()[j].toDouble(), window.Scan().ProbeToWorld().matrix()(i, j));
  QCOMPARE(all["controls"].toObject()["GainDb"].toString(), QString("0"));
  QCOMPARE(all["flipped"].toBool(), false);
  // With left and right exchanged the picture is, and says so.
  window.Key(Qt::Key_F);
  window.Key(Qt::Key_S);
  QStringList now = folder.entryList({"*.png"}, QDir::Files, QDir::Name);
  QCOMPARE(now.size(), 2);
  QVERIFY(QImage(folder.filePath(now[1])) != picture);
  QVERIFY(QImage(folder.filePath(now[1])) == picture.mirrored(true, false));
  QFile other(folder.filePath(now[1].replace(".png", ".json")));
  QVERIFY(other.open(QIODevice::ReadOnly));
  QCOMPARE(QJsonDocument::fromJson(other.readAll()).object()["flipped"].toBool(), true);
}

void TestSimulator::whatIsTheMatterIsShown()
{
  SimulatorUnderTest window;
  // A skin that has no volume below it.
  vtkNew<vtkCubeSource> cube;
  cube->SetCenter(0.0, 500.0, 0.0);
  cube->SetXLength(50.0);
  cube->SetYLength(50.0);
  cube->SetZLength(50.0);
  vtkNew<vtkTriangleFilter> triangles;
  triangles->SetInputConnection(cube->GetOutputPort());
  vtkNew<vtkSTLWriter> writer;
  const QString skin = Folder().filePath("skin.stl");
  writer->SetFileName(skin.toUtf8());
  writer->SetInputConnection(triangles->GetOutputPort());
  writer->Write();
  const QString file = body::WriteWithBall(Folder());
  QVERIFY(window.Open({file}, skin));
  QVERIFY((window.Place() - Eigen::Vector3d(0.0, 475.0, 0.0)).norm() < 1e-3);
  QVERIFY(window.Image().State().contains("No volume under the probe"));
  window.Grab("simulator-outside");
  // A volume in which nothing is real has no skin, and says so.
  QVERIFY(window.Open({body::Write(Folder(), "nothing.mha", [](const Eigen::Vector3d&) { return 0.0; })}));
  QVERIFY2(window.Image().State().contains("no skin"), qPrintable(window.Image().State()));
  window.Move(Qt::Key_Right); // and nothing to slide on
  QVERIFY(window.Open({file}));
  QCOMPARE(window.Image().State(), QString());
}

void TestSimulator::posesThatAreNoneAreRefused()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  Eigen::Matrix4d pose = window.Scan().ProbeToWorld().matrix();
  const Pose before = window.Scan().ProbeToWorld();
  for (const auto& [word, row, column, value] : {std::tuple<const char*, int, int, double>{"not finite", 0, 3, std::nan("")},
                                                 {"not finite", 1, 1, INFINITY},
                                                 {"not rigid", 0, 0, 3.0}}) {
    Eigen::Matrix4d bad = pose;
    bad(row, column) = value;
    window.Scan().Follow(bad);
    window.Frame();
    QVERIFY2(window.Image().State().contains(word), qPrintable(window.Image().State()));
    QVERIFY(window.Image().IsStale());
    QCOMPARE(window.Scan().ProbeToWorld().matrix(), before.matrix());
  }
  window.Scan().Follow(pose);
  window.Frame();
  QCOMPARE(window.Image().State(), QString());
  window.Scan().Follow(pose);
  pose(0, 3) += 60.0; // within milliseconds
  window.Scan().Follow(pose);
  window.Frame();
  QVERIFY(window.Image().State().contains("jumped by 60 mm"));
  QVERIFY(!window.Image().IsStale());
  QTRY_VERIFY_WITH_TIMEOUT(window.Image().State().contains("air"), 4000); // 60 mm beside: off the skin
  // Keys do not pull at what a tracker leads.
  const Eigen::Vector3d place = window.Place();
  window.Move(Qt::Key_Right);
  QCOMPARE(window.Place(), place);
  window.Scan().StopFollowing();
  window.Frame();
  QVERIFY(std::abs(body::Level(window.Place()) - 1.0) < 0.03); // back on the skin
}

void TestSimulator::aTrackerThatStoppedIsSeen()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  const auto brightness = [&window] {
    const QPoint at = window.Image().mapTo(&window.Window(), window.Image().ToWidget({0.0, 12.0}).toPoint());
    return qGray(window.Window().grab().toImage().pixel(at));
  };
  const int before = brightness();
  window.Scan().Follow(window.Scan().ProbeToWorld().matrix());
  window.Scan().SetStopped(3.2);
  window.Settle();
  QVERIFY(window.Image().State().contains("3.2 s"));
  QVERIFY2(brightness() < before / 2, "the image is dimmed");
  window.Grab("simulator-stopped");
  window.Scan().Follow(window.Scan().ProbeToWorld().matrix());
  window.Frame();
  QCOMPARE(brightness(), before);
}

void TestSimulator::aFileThatCannotBeReadIsNamed()
{
  SimulatorUnderTest window;
  const QString good = body::WriteWithBall(Folder());
  QVERIFY(window.Open({good}));
  QFile broken(Folder().filePath("broken.mha"));
  QVERIFY(broken.open(QIODevice::WriteOnly));
  broken.write("ObjectType = Image\nNDims = 3\nDimSize = 9 9 9\nElementType = MET_UCHAR\nElementDataFile = LOCAL\nx");
  broken.close();
  QVERIFY(window.Open({broken.fileName()}));
  QVERIFY2(window.HasMessage("broken.mha"), qPrintable(window.Messages().join('\n')));
  QCOMPARE(window.Scan().Body().files, QStringList{good}); // what was open stays
  QVERIFY(window.Open({good}, Folder().filePath("nowhere.stl")));
  QVERIFY2(window.HasMessage("nowhere.stl"), qPrintable(window.Messages().join('\n')));
}

void TestSimulator::aSceneIsScanned()
{
  const QString scene = body::WriteScene(Folder());
  SimulatorUnderTest window;
  // From a frozen image of a volume, whose controls are not to come along.
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  const auto canPress = [&window] { return window.Part<QSlider>("PressMmSlider")->isEnabled(); };
  QVERIFY2(!canPress(), "a volume does not give way");
  window.Key(Qt::Key_Space);
  QVERIFY(window.Scan().IsFrozen());
  QVERIFY(window.Open({scene}));
  QVERIFY(canPress());
  QVERIFY(!window.Scan().IsFrozen());
  QVERIFY2(window.Messages().isEmpty(), qPrintable(window.Messages().join('\n')));
  QCOMPARE(window.Image().State(), QString());
  QVERIFY2(window.Place().norm() < 2.0 && window.Axis(2)[2] > 0.99, "on top of the outer body, where the view looks from");
  window.Grab("simulator-ball");
  // A shadow below the bone. Beside it are the beams that touch the body, and farther out those that do not.
  const double top = 24.0 - window.Place()[2];
  const auto meanOf = [&window](double x, double from, double to) {
    double sum = 0.0;
    int count = 0;
    for (double z = from; z < to; z += 0.3, count++)
      for (double dx : {-1.0, 0.0, 1.0})
        sum += window.GreyAt(x + dx, z) / 3.0;
    return sum / count;
  };
  QVERIFY2(meanOf(0.0, top + 16.0, top + 30.0) < 0.6 * meanOf(10.0, top + 16.0, top + 30.0),
           qPrintable(QString("%1 %2").arg(meanOf(0.0, top + 16.0, top + 30.0)).arg(meanOf(10.0, top + 16.0, top + 30.0))));
  QVERIFY(meanOf(30.0, top + 16.0, top + 30.0) < 1.0);
  QCOMPARE(window.Part<QComboBox>("Source")->currentText(), QString("scene"));
  const QImage before = window.Scan().Picture().image;
  window.Move(Qt::Key_Right, Qt::ShiftModifier);
  QVERIFY(window.Scan().Picture().image != before);
  // The acoustic model: coarse first, then better from frame to frame while the probe rests.
  std::map<std::int64_t, QImage> seen;
  window.Scan().SetControl("Source", "acoustic");
  QVERIFY(!canPress());
  QTRY_COMPARE_WITH_TIMEOUT(refinementOf(window.Scan().Frame()), QString("3"), 30000);
  connect(&window.Scan(), &Scan::FrameMade, this, [&] { seen[window.Scan().Frame().number] = window.Scan().Picture().image; });
  const std::int64_t last = window.Scan().Frame().number;
  window.Key(Qt::Key_Left);
  QTRY_VERIFY_WITH_TIMEOUT(window.Scan().Frame().number > last && refinementOf(window.Scan().Frame()) == "3", 30000);
  disconnect(&window.Scan(), nullptr, this, nullptr);
  QCOMPARE(seen.size(), std::size_t(4));
  window.Key(Qt::Key_Space);
  const CineLoop& cine = window.Scan().Cine();
  for (int level = 0; level < 4; level++) {
    const int i = cine.Count() - 4 + level;
    QCOMPARE(refinementOf(cine.At(i)), QString::number(level));
    window.Scan().ShowCine(i);
    QVERIFY(window.Scan().Picture().image == seen[cine.At(i).number]); // to the last bit, whatever was made in between
  }
  QVERIFY(seen.begin()->second != seen.rbegin()->second);
  window.Key(Qt::Key_Space);
  window.Scan().SetControl("Source", "scene");
  window.Move(Qt::Key_PageUp, Qt::NoModifier, 20);
  QVERIFY2(window.Image().State().contains("air"), qPrintable(window.Image().State()));
  // What is no scene.
  QFile bad(Folder().filePath("bad.json"));
  QVERIFY(bad.open(QIODevice::WriteOnly));
  bad.write("{\"schema\": \"echorama-scene-1\", \"tissue\": 5}");
  bad.close();
  QVERIFY(window.Open({bad.fileName()}));
  QVERIFY2(window.HasMessage("bad.json"), qPrintable(window.Messages().join('\n')));
}

void TestSimulator::aProbeInsideBoneIsSeen()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteScene(Folder())}));
  Eigen::Matrix4d pose = window.Scan().ProbeToWorld().matrix();
  for (const auto& [depth, inside] : {std::pair<double, bool>{1.0, false}, {20.0, false}, {30.0, true}, {40.0, false}}) {
    pose(2, 3) = depth; // the bone is from 24 to 36 mm
    window.Scan().Follow(pose);
    window.Frame();
    QVERIFY2(window.Image().State().contains("inside bone") == inside, qPrintable(window.Image().State()));
  }
  // The acoustic model says the same.
  window.Scan().SetControl("Source", "acoustic");
  pose(2, 3) = 30.0;
  window.Scan().Follow(pose);
  QTRY_VERIFY_WITH_TIMEOUT(window.Image().State().contains("inside bone"), 30000);
}

void TestSimulator::aSlowPictureIsGivenUpForANewPose()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteScene(Folder())}));
  Scan& scan = window.Scan();
  scan.SetControl("Samples", "4096");
  QElapsedTimer clock;
  qint64 third = 0, fourth = 0; // when they came
  const auto timing = connect(&scan, &Scan::FrameMade, this, [&] {
    const QString level = refinementOf(scan.Frame());
    if (level == "2")
      third = clock.elapsed();
    else if (level == "3")
      fourth = clock.elapsed();
  });
  clock.start();
  constexpr int whileMs = 100; // else there is nothing to give up
  int took = 0;
  for (const char* beams : {"512", "1024", "2048", "4096"}) { // until the last picture takes a while
    third = fourth = 0;
    scan.SetControl("Beams", beams);
    scan.SetControl("Source", "acoustic");
    QTRY_VERIFY_WITH_TIMEOUT(fourth > 0, 60000);
    took = static_cast<int>(fourth - third);
    qInfo("with %s beams the last refinement takes %d ms", beams, took);
    if (took > whileMs)
      break;
  }
  disconnect(timing);
  if (took <= whileMs)
    QSKIP("no picture takes long enough on this machine to be given up");

  // The probe moves while the best picture of where it was is being made.
  struct Made {
    Eigen::Vector3d place;
    QString level;
  };
  std::vector<Made> made;
  Eigen::Vector3d moved = Eigen::Vector3d::Zero();
  qint64 movedAt = 0, shownAt = 0;
  connect(&scan, &Scan::FrameMade, this, [&] {
    made.push_back({scan.Frame().probeToWorld.translation(), refinementOf(scan.Frame())});
    if (made.size() == 3)
      QTimer::singleShot(40 + took / 4, this, [&] {
        movedAt = clock.elapsed();
        scan.Slide(4.0, 0.0);
        moved = window.Place();
      });
    if (movedAt > 0 && shownAt == 0)
      shownAt = clock.elapsed();
  });
  window.Key(Qt::Key_Left);
  QTRY_VERIFY_WITH_TIMEOUT(made.size() > 3 && made.back().level == "3" && made.back().place == moved, 60000);
  disconnect(&scan, nullptr, this, nullptr);
  QCOMPARE(made[2].level, QString("2"));
  // The first that comes after it is of the new pose, and coarse: none of the old one comes late.
  for (std::size_t i = 3; i < made.size(); i++) {
    QCOMPARE(made[i].place, moved);
    QCOMPARE(made[i].level, QString::number(i - 3));
  }
  QCOMPARE(made.size(), std::size_t(7));
  qInfo("the first picture of the new pose came after %d ms", static_cast<int>(shownAt - movedAt));
  // One that moves all the time is seen all the same, no frame more than one behind.
  const auto coarse = connect(&scan, &Scan::FrameMade, this, [&] { made.push_back({window.Place(), {}}); });
  made.clear();
  QElapsedTimer moving;
  moving.start();
  for (int i = 0; made.size() < 3 && moving.elapsed() < 60000; i++) {
    scan.Slide(i % 2 ? 0.5 : -0.5, 0.0);
    QTest::qWait(5);
  }
  disconnect(coarse);
  QCOMPARE(made.size(), std::size_t(3));
  // A frozen image is what was seen, and what waits is dropped.
  scan.Slide(1.0, 0.0);
  QTest::qWait(30);
  window.Key(Qt::Key_Space);
  const std::int64_t number = scan.Frame().number;
  QTest::qWait(200);
  QCOMPARE(scan.Frame().number, number);
}

void TestSimulator::whatIsInventedIsColouredOrHidden()
{
  // A block of grey tissue, whose half towards +x was invented.
  constexpr int side = 60;
  const vtkNew<vtkImageData> volume;
  volume->SetDimensions(side, side, side);
  volume->SetOrigin(-side / 2.0, -side / 2.0, -side / 2.0);
  for (const auto& [name, inside] : {std::pair(std::string(vtkUltrasoundVolume::IntensityName()), 120),
                                     std::pair(std::string(vtkUltrasoundVolume::ValidRegionName()), 1),
                                     std::pair(std::string(vtkUltrasoundVolume::EmbeddingName()), 1)}) {
    const vtkNew<vtkUnsignedCharArray> values;
    values->SetName(name.c_str());
    values->SetNumberOfValues(side * side * side);
    for (vtkIdType i = 0; i < values->GetNumberOfValues(); i++)
      values->SetValue(
          i, static_cast<unsigned char>(name == vtkUltrasoundVolume::EmbeddingName() && i % side >= side / 2 + 4 ? 3 : inside));
    volume->GetPointData()->AddArray(values);
  }
  volume->GetPointData()->SetActiveScalars(vtkUltrasoundVolume::IntensityName());
  const QString path = Folder().filePath("embedded.vti");
  const vtkNew<vtkXMLImageDataWriter> writer;
  writer->SetInputData(volume);
  writer->SetFileName(path.toUtf8());
  QVERIFY(writer->Write());

  SimulatorUnderTest window;
  QVERIFY(window.Open({path}));
  const auto colourAt = [&](double across, double depth) {
    const PlanePicture& picture = window.Scan().Picture();
    return picture.image.pixel(picture.PixelAt({across, depth}));
  };
  const double real = window.Axis(0)[0] > 0.0 ? -10.0 : 10.0;
  QVERIFY(window.GreyAt(real, 20.0) > 100);
  QCOMPARE(qRed(colourAt(real, 20.0)), qBlue(colourAt(real, 20.0)));
  QVERIFY(qRed(colourAt(-real, 20.0)) > 2 * qBlue(colourAt(-real, 20.0)));
  window.Move(Qt::Key_I);
  QCOMPARE(window.GreyAt(-real, 20.0), -1);
  QVERIFY(window.GreyAt(real, 20.0) > 100);
  QVERIFY(!window.Part<QCheckBox>("ShowInvented")->isChecked()); // the panel and the menu say the same
  window.Part<QCheckBox>("ShowInvented")->click();
  window.Frame();
  QVERIFY(window.GreyAt(-real, 20.0) > 0);
  QVERIFY(window.Part<QAction>("invented")->isChecked());
}

void TestSimulator::closingAsks()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  window.Part<OutputPanel>("outputPanel")->SetFolder(Folder());
  window.Part<QPushButton>("record")->click();
  window.Move(Qt::Key_Right, Qt::NoModifier, 3);
  for (int i = 0; i < 2; i++) {
    QVERIFY(!window.Window().close());
    QVERIFY(window.Window().isVisible());
    QCOMPARE(window.Messages().filter("recording is running").size(), 1);
  }
  QVERIFY(window.Answer("Stay"));
  QVERIFY(!window.HasMessage("recording is running"));
  QVERIFY(window.Part<OutputPanel>("outputPanel")->IsRecording());
  window.Move(Qt::Key_Right);
  QVERIFY(!window.Window().close());
  QVERIFY(window.Answer("End it and close"));
  QTRY_VERIFY(!window.Window().isVisible());
  QCOMPARE(Folder().entryList({"*.igs.mha"}).size(), 1); // all of it
  QVERIFY(Folder().entryList({"*.igs.mhd", "*.igs.raw"}).isEmpty());
  SimulatorUnderTest other;
  QVERIFY(other.Open({Folder().filePath("body.mha")}));
  other.Part<OutputPanel>("outputPanel")->SetFolder(Folder());
  // What could not be put into one file is told before the window goes; so is that nothing was recorded.
  other.Part<QPushButton>("record")->click();
  other.Move(Qt::Key_Right);
  QVERIFY(QFile::remove(Folder().filePath(Folder().entryList({"*.igs.raw"}).value(0))));
  QVERIFY(!other.Window().close());
  QVERIFY(other.Answer("End it and close"));
  QVERIFY(other.Wait());
  other.Settle();
  QVERIFY(other.Window().isVisible());
  QVERIFY2(other.HasMessage(".igs.raw"), qPrintable(other.Messages().join('\n')));
  other.Key(Qt::Key_Space);
  other.Part<QPushButton>("record")->click();
  QVERIFY(!other.Window().close());
  QVERIFY(other.Answer("End it and close"));
  other.Settle();
  QVERIFY(other.Window().isVisible());
  // With nothing at stake it closes at once.
  QVERIFY(other.Window().close());
}

void TestSimulator::aBodyStaysFittedUntilSomebodyZooms()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  BodyView& view = *window.Window().Body();
  const auto isSeen = [&] {
    for (const double x : {-1.0, 1.0})
      for (const double y : {-1.0, 1.0})
        for (const double z : {-1.0, 1.0}) {
          const Eigen::Vector3d corner = body::HalfAxes.cwiseProduct(Eigen::Vector3d(x, y, z));
          if (!view.Canvas()->rect().contains(view.ToCanvas(corner.data()).toPoint()))
            return false;
        }
    return true;
  };
  QVERIFY(isSeen());
  for (const QSize& size : {QSize(700, 1000), QSize(1500, 700), QSize(1280, 800)}) {
    window.Window().resize(size);
    window.Frame();
    QVERIFY2(isSeen(), qPrintable(QString("%1 x %2").arg(size.width()).arg(size.height())));
  }
  for (int i = 0; i < 10; i++)
    window.Wheel(view.Canvas(), 1);
  window.Frame();
  QVERIFY(!isSeen());
  window.Window().resize(1500, 900);
  window.Frame();
  QVERIFY(!isSeen());
}

void TestSimulator::anImageThatFailsLeavesTheOneBefore()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  const ScanFrame before = window.Scan().Frame();
  const QImage image = window.Scan().Picture().image;
  vtkImageData* volume = window.Scan().Body().volumes.front();
  volume->GetPointData()->Initialize();
  volume->Modified();
  window.Move(Qt::Key_Right);
  QVERIFY(window.Scan().HasFailed());
  QVERIFY((window.Place() - before.probeToWorld.translation()).norm() > 1.0);
  // Image and pose stay together: what is saved, asked for or answered is what is seen.
  QCOMPARE(window.Scan().Picture().image, image);
  QCOMPARE(window.Scan().Frame().number, before.number);
  QVERIFY(window.Scan().Frame().probeToWorld.matrix() == before.probeToWorld.matrix());
  // Of a body whose first image fails there is none, least of all of the body before.
  Subject other = window.Scan().Body();
  window.Scan().SetSubject(other);
  window.Frame();
  QVERIFY(window.Scan().HasFailed() && window.Scan().Picture().image.isNull());
  window.Part<QLineEdit>("taskName")->setText("nothing");
  window.Part<QPushButton>("savePlane")->click();
  QVERIFY2(window.HasMessage("no image to make a task of"), qPrintable(window.Messages().join('\n')));
}

void TestSimulator::thePicturesOfTheManual()
{
  const QDir liver(ECHORAMA_SOURCE_DIR "/../shared/data/liver");
  if (!liver.exists("liver_volume_full.mha"))
    QSKIP("the liver is not there");
  SimulatorUnderTest window;
  QElapsedTimer clock;
  clock.start();
  QVERIFY(window.Open({liver.filePath("liver_volume_full.mha")}));
  qInfo("read, and the first image shown, after %lld ms", clock.elapsed());
  window.Scan().SetControl("DepthMm", "90");
  window.Scan().SetControl("GainDb", "6");
  // What a hand that slides waits for, with both views on the screen.
  QVector<double> waited;
  clock.restart();
  for (int i = 0; i < 40; i++) {
    window.Key(i < 25 ? Qt::Key_Left : Qt::Key_Right);
    QTest::qWait(20);
    waited.append(window.Scan().LatencyMs());
  }
  std::sort(waited.begin(), waited.end());
  qInfo("from the key to the image: %.1f ms in the median, %.1f ms at most", waited[20], waited.last());
  window.Window().Body()->Fit();
  QTest::qWait(1200); // until no frame is of the last second
  window.Frame();
  ComparePicture(window.Grab("simulator"), "simulator");

  // A scene, with a line of the callipers.
  clock.restart();
  QVERIFY(window.Open({ECHORAMA_SOURCE_DIR "/Examples/scenes/anatomy.json"}));
  qInfo("the scene of an abdomen, after %lld ms", clock.elapsed());
  window.Scan().SetControl("DepthMm", "0");
  window.Scan().SetControl("GainDb", "0");
  window.Frame();
  window.Key(Qt::Key_C);
  window.Click(&window.Image(), window.Image().ToWidget({-12.0, 40.0}).toPoint());
  window.Click(&window.Image(), window.Image().ToWidget({14.0, 52.0}).toPoint());
  QTest::qWait(1200);
  window.Frame();
  ComparePicture(window.Grab("simulator-scene"), "simulator-scene");
}

int main(int argc, char** argv)
{
  return RunWindowTest("SimulatorTest", argc, argv, [argc, argv] {
    TestSimulator test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestSimulator.moc"
