// SPDX-License-Identifier: BSD-3-Clause
// A printed skin with a camera in it, both simulated: the skin is calibrated by the program, and a hand that moves over it leads
// the probe of the window.
#include "Core/Base/Angles.h"
#include "NeedleTool.h"
#include "ProbeTracker.h"
#include "SimulatorUnderTest.h"
#include <algorithm>
#include <optional>
#include <QComboBox>
#include <QDockWidget>
#include <QJsonDocument>
#include <QJsonObject>
#include <QLabel>
#include <QLineEdit>
#include <QProcess>
#include <QPushButton>
#include <QRegularExpression>
#include <QtTest>
#include <vtkMatrix4x4.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSphereSource.h>
#include <vtkSTLWriter.h>
#include <vtkUltrasoundTrackerSource.h>

using namespace echorama;

namespace {

constexpr double Scale = 2.4; // of the body of all tests: as large as a belly
// The camera looks at the front, which is -y. Neither it nor its lens are quite as they should be.
const QString Camera =
    "width=320&height=240&cameraMm=2 16 -3&cameraTurn=91 2 1&focal=75&centreX=161&centreY=118&k1=-0.026&k2=0.002";

double Grey(const Eigen::Vector3d& at)
{
  return 128.0 + 3.0 * at.x() + 1.5 * at.z();
}

Eigen::Vector3d Outwards(const Eigen::Vector3d& ofSkin)
{
  return ofSkin.cwiseQuotient(body::HalfAxes.cwiseAbs2()).normalized();
}

double Quantile(std::vector<double> values, double share)
{
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

} // namespace

class TestScanSurface : public FolderTest {
  Q_OBJECT

private slots:
  void initTestCase();
  void theProbeFollowsAHandOnThePrintedSkin();
  void whatTheCameraDoesNotSeeIsSaid();

private:
  QString At(const QString& name) const { return made_.filePath(name); }
  void Connect(SimulatorUnderTest& window, const QString& options) const
  {
    window.Part<QDockWidget>("trackerPanelDock")->raise();
    auto* line = window.Part<QLineEdit>("trackerAddress");
    line->clear();
    window.Type(line, "optical:simulated:?shell=" + At("belly.json") + "&calibrated=off&" + Camera + options);
    window.Part<QPushButton>("trackerConnect")->click();
  }

  QTemporaryDir made_;
  double calibratedMm_ = 0.0; // what the calibration says of itself, in 95%
};

void TestScanSurface::initTestCase()
{
#ifndef ECHORAMA_PROGRAM
  QSKIP("the program that calibrates a skin is not built");
#else
  body::Write(QDir(made_.path()), "body.mha", Grey, Scale);
  vtkNew<vtkSphereSource> ball;
  ball->SetRadius(1.0);
  ball->SetThetaResolution(120);
  ball->SetPhiResolution(120);
  ball->Update();
  vtkPoints* points = ball->GetOutput()->GetPoints();
  for (vtkIdType i = 0; i < points->GetNumberOfPoints(); i++) {
    const Eigen::Vector3d at = Scale * Eigen::Map<const Eigen::Vector3d>(points->GetPoint(i)).cwiseProduct(body::HalfAxes);
    points->SetPoint(i, at.data());
  }
  vtkNew<vtkSTLWriter> writer;
  writer->SetInputData(ball->GetOutput());
  writer->SetFileTypeToBinary();
  writer->SetFileName(At("belly.stl").toUtf8());
  writer->Write();
  QFile marks(At("points.csv"));
  QVERIFY(marks.open(QIODevice::WriteOnly));
  marks.write("label,x,y,z\n");
  constexpr int count = 60;
  for (int i = 0; i < count; i++) { // along a spiral from the middle of the front outwards
    const double height = 1.0 - 0.85 * (i + 0.5) / count, across = std::sqrt(1.0 - height * height), angle = 2.399963 * i;
    const Eigen::Vector3d at =
        Scale * Eigen::Vector3d(across * std::cos(angle), -height, across * std::sin(angle)).cwiseProduct(body::HalfAxes);
    marks.write(QString("%1,%2,%3,%4\n").arg(i + 1).arg(at.x()).arg(at.y()).arg(at.z()).toUtf8());
  }
  marks.close();
  QProcess program;
  program.start(ECHORAMA_PROGRAM, {"calibrate",
                                   "surface",
                                   "simulated:?speed=0&placementMm=0.1&moveSeconds=0.3&liftMm=8&" + Camera,
                                   "--mesh",
                                   At("belly.stl"),
                                   "--marks",
                                   At("points.csv"),
                                   "-o",
                                   At("belly.json"),
                                   "--up",
                                   "0",
                                   "-1",
                                   "0",
                                   "--camera-position",
                                   "0",
                                   "20",
                                   "0",
                                   "--focal",
                                   "72",
                                   "--rest-frames",
                                   "12"});
  QVERIFY(program.waitForFinished(120000));
  QVERIFY2(program.exitStatus() == QProcess::NormalExit && program.exitCode() == 0, program.readAllStandardError());
  QFile calibration(At("belly.json"));
  QVERIFY(calibration.open(QIODevice::ReadOnly));
  calibratedMm_ = QJsonDocument::fromJson(calibration.readAll())["accuracy"]["mm95"].toDouble();
  QVERIFY(calibratedMm_ > 0.0 && calibratedMm_ < 0.5);
#endif
}

// Both tools are on the body where the hand has them, and the image is that of there. What the tracker says of itself is true.
void TestScanSurface::theProbeFollowsAHandOnThePrintedSkin()
{
  for (const bool onMesh : {true, false}) { // the skin is the mesh that was printed, or the outline of the volume
    SimulatorUnderTest window;
    QVERIFY(window.Open({At("body.mha")}, onMesh ? At("belly.stl") : QString()));
    Connect(window, "&truth=on&path=wander&radiusMm=40&speedMmPerS=60");
    QTRY_VERIFY2(window.Scan().IsFollowing(), qPrintable(window.Part<QLabel>("trackerState")->text()));
    QCOMPARE(window.Part<QComboBox>("trackerTool")->currentText(), QString("ProbeToTracker"));
    window.Part<QComboBox>("trackerNeedle")->setCurrentText("NeedleToTracker");
    QTRY_VERIFY(window.Window().TheNeedle()->IsFollowing());
    vtkUltrasoundTrackerSource* tracker = window.Part<ProbeTracker>("trackerPanel")->Tracker();
    // The truth is asked for as soon as the window has a pose, lest there be a newer one.
    struct Moment {
      Eigen::Vector3d probe, needle;
    };
    std::optional<Moment> truth;
    const auto placeOf = [tracker](const char* name) -> std::optional<Eigen::Vector3d> {
      vtkNew<vtkMatrix4x4> matrix;
      if (tracker->GetTransform(name, matrix) != 0)
        return std::nullopt;
      return Eigen::Vector3d(matrix->GetElement(0, 3), matrix->GetElement(1, 3), matrix->GetElement(2, 3));
    };
    connect(&window.Scan(), &Scan::ProbeMoved, &window.Scan(), [&] {
      const auto probe = placeOf("ProbeTruthToTracker"), needle = placeOf("NeedleTruthToTracker"),
                 told = placeOf("ProbeToTracker");
      truth.reset();
      if (probe && needle && told && *told == window.Place())
        truth = Moment{*probe, *needle};
    });
    std::vector<double> probe, needle, tilted, grey;
    double travelled = 0.0;
    Eigen::Vector3d before = window.Place();
    int dark = 0;
    QElapsedTimer since;
    since.start();
    while (probe.size() < 150) {
      QVERIFY2(since.elapsed() < 60000, "too few poses have come");
      QTest::qWait(10);
      window.Scan().MakeNow(); // of the newest pose
      if (!truth)
        continue;
      const Eigen::Vector3d place = window.Place(), outwards = Outwards(truth->probe);
      QCOMPARE((window.Scan().Frame().probeToWorld.translation() - place).norm(), 0.0);
      travelled += (place - std::exchange(before, place)).norm();
      probe.push_back((place - truth->probe).norm());
      tilted.push_back(std::acos(std::clamp(-outwards.dot(window.Axis(2)), -1.0, 1.0)) / RadiansPerDegree);
      const Needle held = window.Window().TheNeedle()->Now();
      needle.push_back((held.tip - truth->needle).norm());
      QVERIFY(Outwards(truth->needle).dot(held.direction) < -0.99); // into the body
      QVERIFY(std::fabs(window.Window().TheNeedle()->InsideMm()) < 2.0);
      const int seen = window.GreyAt(0.0, 20.0);
      dark += seen < 0;
      grey.push_back(std::fabs(seen - Grey((truth->probe - 20.0 * outwards) / Scale)));
      truth.reset();
    }
    const QString state = window.Part<QLabel>("trackerState")->text();
    const auto predictions = QRegularExpression("Probe \\w+ \\(predictions ([\\d.]+) mm off\\)").match(state);
    QVERIFY2(predictions.hasMatch(), qPrintable(state));
    const double predictedMm = predictions.captured(1).toDouble();
    qInfo("%d poses, %.0f mm: probe %.2f mm off in the median, %.2f mm in 95%%; needle %.2f, %.2f mm; axis %.2f degrees "
          "in 95%%; grey levels %.1f in the median, %.1f in 95%%; the calibration says %.2f mm in 95%%, the tracker: %s",
          static_cast<int>(probe.size()), travelled, Quantile(probe, 0.5), Quantile(probe, 0.95), Quantile(needle, 0.5),
          Quantile(needle, 0.95), Quantile(tilted, 0.95), Quantile(grey, 0.5), Quantile(grey, 0.95), calibratedMm_,
          qPrintable(state));
    // What both say of themselves: the calibration in 95%, the predictions as their root mean square.
    const double statedMm = calibratedMm_ + 2.0 * predictedMm;
    QVERIFY(predictedMm > 0.0 && statedMm < 3.0);
    QVERIFY(Quantile(probe, 0.95) < statedMm);
    QVERIFY(Quantile(needle, 0.95) < statedMm);
    QVERIFY(Quantile(tilted, 0.95) < 2.0);
    QVERIFY(Quantile(grey, 0.95) < 3.0);
    QCOMPARE(dark, 0);
    QVERIFY(travelled > 100.0);
    if (onMesh)
      window.Grab("simulator-surface");
    window.Part<QPushButton>("trackerConnect")->click();
    QVERIFY(!window.Scan().IsFollowing());
  }
}

void TestScanSurface::whatTheCameraDoesNotSeeIsSaid()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({At("body.mha")}, At("belly.stl")));
  const auto state = [&] { return window.Part<QLabel>("trackerState")->text(); };
  auto* connection = window.Part<QPushButton>("trackerConnect");
  Connect(window, "&path=still&deadLight=1"); // the other is not taken for it
  QTRY_VERIFY(window.Part<QComboBox>("trackerTool")->count() == 2);
  QTRY_VERIFY2(state().contains("Needle touches") && state().endsWith("the tool has not been seen yet"), qPrintable(state()));
  QVERIFY(!window.Scan().IsFollowing());
  window.Part<QComboBox>("trackerTool")->setFocus(); // until a person says so
  QTest::keyClick(window.Part<QComboBox>("trackerTool"), Qt::Key_Up);
  QCOMPARE(window.Part<QComboBox>("trackerTool")->currentText(), QString("NeedleToTracker"));
  QTRY_VERIFY(window.Scan().IsFollowing());
  connection->click();
  Connect(window, "&path=still&peak=70");
  QTRY_VERIFY2(state().contains("Probe hovers") && state().endsWith("the tool is off the skin, or out of reach"),
               qPrintable(state()));
  QVERIFY(!window.Scan().IsFollowing());
  connection->click();

  // One that is lifted off for a while, and then the end of the frames.
  QStringList said;
  connect(&window.Scan(), &Scan::StateChanged, this, [&] {
    const QString now = window.Scan().State();
    if (window.Scan().IsStale() && (said.isEmpty() || said.last() != now.section(':', 0, 0)))
      said.append(now.section(':', 0, 0));
  });
  Connect(window, "&path=still&liftEverySeconds=2&frames=400");
  QTRY_VERIFY(window.Scan().IsFollowing());
  QTRY_VERIFY_WITH_TIMEOUT(said.contains("The tracker has stopped"), 20000);
  QCOMPARE(said.first(), QString("The tracker does not see the probe"));
}

int main(int argc, char** argv)
{
  return RunWindowTest("SimulatorTest", argc, argv, [argc, argv] {
    TestScanSurface test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestScanSurface.moc"
