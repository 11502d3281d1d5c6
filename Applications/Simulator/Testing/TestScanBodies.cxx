// SPDX-License-Identifier: BSD-3-Clause
// What bodies bring along that decides how they are shown: how thick they are, and how they give way.
#include "PressedStates.h"
#include "SimulatorUnderTest.h"
#include <QDoubleSpinBox>
#include <QtTest>
#include <vtkDoubleArray.h>
#include <vtkMatrix4x4.h>
#include <vtkPointData.h>
#include <vtkUltrasoundDisplacement.h>
#include <vtkUltrasoundVolume.h>
#include <vtkXMLImageDataWriter.h>

using namespace echorama;
using Eigen::Vector3d;

class TestScanBodies : public FolderTest {
  Q_OBJECT

private slots:
  void aThinBodyIsShownAsDeepAsItIs();
  void aBodyGivesWayAsItsStatesSay();
  void theAcousticModelIsNotBegunAnewForAPressure();
  void statesThatAreNoneOrOfAnotherBodyAreRefused();

private:
  /// Of a body whose front is pressed in by a probe that is at \a rest before, and whose back lies on a table 70 mm behind: it
  /// gives way ever less. \param beside what else is put between probe and body
  QString WriteState(const QString& name, const Pose& rest, double mm, const Vector3d& beside = Vector3d::Zero(),
                     bool saysHow = true)
  {
    const vtkNew<vtkImageData> state;
    state->SetDimensions(25, 21, 29);
    state->SetSpacing(4.0, 4.0, 4.0);
    state->SetOrigin(-48.0 + beside[0], -40.0 + beside[1], -56.0 + beside[2]);
    const vtkNew<vtkDoubleArray> displacement;
    displacement->SetName(vtkUltrasoundDisplacement::DisplacementName());
    displacement->SetNumberOfComponents(3);
    for (vtkIdType i = 0; i < state->GetNumberOfPoints(); i++) {
      const Vector3d at = Eigen::Map<const Vector3d>(state->GetPoint(i)) - beside, into = rest.linear().col(2);
      const double depth = std::clamp((at - rest.translation()).dot(into), 0.0, 70.0);
      const Vector3d u = mm * (1.0 - depth / 70.0) * into;
      displacement->InsertNextTuple(u.data());
    }
    state->GetPointData()->AddArray(displacement);
    Pose pressed = rest;
    pressed.translation() += mm * rest.linear().col(2) + beside;
    const vtkNew<vtkMatrix4x4> matrix;
    vtkUltrasoundVolume::SetMatrix(matrix, pressed);
    if (saysHow)
      vtkUltrasoundLiveImage::SetPressState(state, mm, matrix);
    const QString path = Folder().filePath(name);
    const vtkNew<vtkXMLImageDataWriter> writer;
    writer->SetInputData(state);
    writer->SetFileName(path.toUtf8());
    writer->Write();
    return path;
  }
  /// How deep below the face the middle of the white ball is seen.
  static double BallDepth(SimulatorUnderTest& window)
  {
    double sum = 0.0;
    int count = 0;
    for (double depth = 5.0; depth < 65.0; depth += 0.25)
      if (window.GreyAt(0.0, depth) > 180) {
        sum += depth;
        count++;
      }
    return count > 0 ? sum / count : -1.0;
  }
};

void TestScanBodies::aThinBodyIsShownAsDeepAsItIs()
{
  const auto grey = [](const Vector3d&) { return 100.0; };
  const QString usual = body::Write(Folder(), "usual.mha", grey), thin = body::Write(Folder(), "thin.mha", grey, 0.43),
                thinner = body::Write(Folder(), "thinner.mha", grey, 0.25);
  SimulatorUnderTest window;
  const auto depth = [&] { return window.Scan().Scanner().Probe().depthMax; };
  QVERIFY(window.Open({usual})); // 70 mm: half of the image, and so it stays
  QCOMPARE(depth(), 150.0);
  QVERIFY(window.Open({thin})); // 30 mm
  QCOMPARE(depth(), 40.0);
  QCOMPARE(window.Part<QDoubleSpinBox>("DepthMm")->value(), 40.0);
  QVERIFY(window.GreyAt(0.0, 25.0) > 80);
  QCOMPARE(window.GreyAt(0.0, 35.0), -1);
  QVERIFY(window.Open({thinner})); // 17 mm
  QCOMPARE(depth(), 20.0);
  QVERIFY(window.Open({usual}));
  QCOMPARE(depth(), 150.0);
  // What a person chose stays.
  window.Key(Qt::Key_BracketLeft);
  QVERIFY(window.Open({thin}));
  QCOMPARE(depth(), 140.0);
}

void TestScanBodies::aBodyGivesWayAsItsStatesSay()
{
  SimulatorUnderTest window;
  const QString body = body::WriteWithBall(Folder());
  QVERIFY(window.Open({body}));
  const Pose rest = window.Scan().ProbeToWorld();
  const double before = BallDepth(window);
  QVERIFY2(std::fabs(before - 35.0) < 1.5, qPrintable(QString::number(before)));
  // Without states the face comes nearer to all that it is pressed to.
  window.Move(Qt::Key_PageDown, Qt::NoModifier, 6);
  QVERIFY2(std::fabs(before - BallDepth(window) - 6.0) < 0.5, qPrintable(QString::number(BallDepth(window))));
  window.Move(Qt::Key_Home);
  // With them, the ball, which is in the middle, gives way half as far.
  const QString three = WriteState("three.vti", rest, 3.0), nine = WriteState("nine.vti", rest, 9.0);
  window.Drop({nine, three});
  QVERIFY(window.Wait());
  QVERIFY2(window.HasMessage("gives way to a probe that is pressed in (Page Down), by up to 9 mm"),
           qPrintable(window.Messages().join('\n')));
  QCOMPARE(window.Scan().Body().files, QStringList(body));
  window.Frame();
  QVERIFY(std::fabs(BallDepth(window) - before) < 0.3);
  for (const double mm : {3.0, 6.0, 9.0}) {
    window.Move(Qt::Key_PageDown, Qt::NoModifier, 3);
    const double depth = BallDepth(window), expected = before - mm + 0.5 * mm;
    QVERIFY2(std::fabs(depth - expected) < 0.6, qPrintable(QString("%1 mm, %2 expected").arg(depth).arg(expected)));
    QCOMPARE(window.Scan().Held().pressMm, mm);
  }
  window.Move(Qt::Key_PageDown, Qt::NoModifier, 3); // how it would give way further nobody knows
  QCOMPARE(window.Scan().Held().pressMm, 9.0);
  QVERIFY(!window.Scan().HasFailed());
  // Frames of the last seconds are made again as they were.
  const QImage seen = window.Scan().Picture().image;
  window.Key(Qt::Key_Space);
  window.Scan().ShowCine(0);
  window.Scan().ShowCine(window.Scan().Cine().Count() - 1);
  QCOMPARE(window.Scan().Picture().image, seen);
  window.Key(Qt::Key_Space);
  // A tracked probe presses by how deep it is.
  Pose deeper = rest;
  deeper.translation() += 6.0 * rest.linear().col(2);
  window.Scan().Follow(deeper.matrix());
  window.Frame();
  QVERIFY2(std::fabs(BallDepth(window) - (before - 3.0)) < 0.8, qPrintable(QString::number(BallDepth(window))));
  window.Scan().StopFollowing();
  // Another body, or the same without them, is as firm as ever.
  QVERIFY(window.Open({body}));
  window.Move(Qt::Key_PageDown, Qt::NoModifier, 6);
  QVERIFY(std::fabs(before - BallDepth(window) - 6.0) < 0.5);
  // And both together.
  QVERIFY(window.Open({three, body, nine}));
  window.Move(Qt::Key_PageDown, Qt::NoModifier, 6);
  QVERIFY(std::fabs(before - BallDepth(window) - 3.0) < 0.6);
}

void TestScanBodies::theAcousticModelIsNotBegunAnewForAPressure()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteScene(Folder())}));
  const Pose rest = window.Scan().ProbeToWorld();
  QVERIFY(window.Open({WriteState("three.vti", rest, 3.0)})); // of the scene that is open
  const auto pressed = [&window] {
    ParameterList parameters = window.Scan().Scanner().Parameters();
    return Named(parameters, "PressMm").Number();
  };
  const auto pressBy = [&](double mm) {
    Pose deeper = rest;
    deeper.translation() += mm * rest.linear().col(2);
    window.Scan().Follow(deeper.matrix());
  };
  pressBy(1.0);
  QCOMPARE(pressed(), 1.0);
  window.Scan().SetControl("Source", "acoustic");
  window.Scan().MakeNow();
  QVERIFY(window.Scan().IsMaking());
  pressBy(2.0);
  QVERIFY(window.Scan().IsMaking());
  // What shows it knows it.
  window.Scan().SetControl("Source", "scene");
  QCOMPARE(pressed(), 2.0);
}

void TestScanBodies::statesThatAreNoneOrOfAnotherBodyAreRefused()
{
  SimulatorUnderTest window;
  const QString body = body::WriteWithBall(Folder());
  QVERIFY(window.Open({body}));
  const Pose rest = window.Scan().ProbeToWorld();
  const QString right = WriteState("right.vti", rest, 5.0), damaged = WriteState("damaged.vti", rest, 5.0);
  QFile file(damaged);
  QVERIFY(file.open(QIODevice::ReadWrite));
  const QByteArray text = file.readAll().replace("type=\"Float64\"", "type=\"Float99\"");
  QVERIFY(file.seek(0) && file.write(text) == text.size());
  file.close();
  for (const auto& [files, words] : std::vector<std::pair<QStringList, QString>>{
           {{WriteState("far.vti", rest, 5.0, Vector3d(0.0, -60.0, 0.0))},
            "far.vti: the probe that was pressed in by 5 mm lies 5"},
           {{WriteState("mute.vti", rest, 5.0, Vector3d::Zero(), false)}, "mute.vti: it does not say how deep"},
           {{WriteState("none.vti", rest, 0.0)}, "none.vti: the probe was pressed in by 0 mm"},
           {{right, WriteState("again.vti", rest, 5.0)}, "again.vti: it is as deep as"},
           {{damaged}, "damaged.vti: DataArray has the type"}}) {
    window.Window().Open(files);
    QVERIFY(window.Wait());
    QVERIFY2(window.HasMessage(words), qPrintable(words + " is not among\n" + window.Messages().join('\n')));
    QVERIFY(window.Scan().Body().pressed.empty());
    QCOMPARE(window.Scan().Body().files, QStringList(body));
  }
  QVERIFY(window.HasMessage("it is of another body than " + body));
  // States are of the body that was there when they were opened.
  window.Window().Open({right});
  Subject other = window.Scan().Body();
  const vtkNew<vtkImageData> copy;
  copy->ShallowCopy(other.volumes[0]);
  other.volumes[0] = copy;
  window.Scan().SetSubject(std::move(other));
  QVERIFY(window.Wait());
  QVERIFY2(window.HasMessage("Another body was opened"), qPrintable(window.Messages().join('\n')));
  QVERIFY(window.Scan().Body().pressed.empty());
  SimulatorUnderTest empty;
  empty.Window().Open({right});
  QVERIFY(empty.Wait());
  QVERIFY2(empty.HasMessage("open that first, or with them"), qPrintable(empty.Messages().join('\n')));
}

int main(int argc, char** argv)
{
  return RunWindowTest("SimulatorTest", argc, argv, [argc, argv] {
    TestScanBodies test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestScanBodies.moc"
