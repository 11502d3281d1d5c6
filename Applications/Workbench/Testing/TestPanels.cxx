// SPDX-License-Identifier: BSD-3-Clause
// What the panels at the right do: alignment, stitching, export, training, trackers. With the pair of a liver it makes the
// pictures of the manual, and holds them against those in Documentation/pictures (ECHORAMA_UPDATE_PICTURES=1 replaces these).
#include "ExportActions.h"
#include "FileActions.h"
#include "Job.h"
#include "JobBar.h"
#include "RegistrationPanel.h"
#include "ResultPanel.h"
#include "SliceCanvas.h"
#include "TrainingPanel.h"
#include "ViewGrid.h"
#include "VolumePane.h"
#include "Widgets/Session/LiveScore.h"
#include "WindowUnderTest.h"
#include "Workbench.h"
#include <cmath>
#include <QAction>
#include <QApplication>
#include <QCheckBox>
#include <QDockWidget>
#include <QDoubleSpinBox>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QPushButton>
#include <QTableWidget>
#include <QToolButton>
#include <QtTest>
#include <QVTKOpenGLNativeWidget.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkUltrasoundAlignmentSession.h>
#include <vtkUltrasoundSliceView.h>
#include <vtkUltrasoundVolume.h>

using namespace echorama;

namespace {

const QDir Liver(ECHORAMA_SOURCE_DIR "/../shared/data/liver");

// How far two poses put a volume's points apart, about.
double Distance(const std::array<double, 16>& a, const std::array<double, 16>& b)
{
  double sum = 0.0;
  for (std::size_t i = 0; i < 16; ++i)
    sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum);
}

} // namespace

class TestPanels : public WindowTest {
  Q_OBJECT

private slots:
  void refineBringsAVolumeBack();
  void aSureAnswerIsTakenUnasked();
  void refiningOffersToSearchFarther();
  void landmarksTellWhatRepeatsApart();
  void aCancelledJobChangesNothing();
  void whatMovedMeanwhileStays();
  void anAlignmentWaitsForTheEndOfADrag();
  void aTrackerPlacesVolumesBesideTheFirst();
  void stitchingReadsThroughDisplacements();
  void aWindowMayCloseWhileAJobRuns();
  void stitchingMakesAndSavesOneVolume();
  void exportWritesAndNeverReplaces();
  void exportHoldsWhatWasPaintedOfWhatIsShown();
  void exportedFilesHaveNamesOfTheirOwn();
  void trainingHidesScoreAndKeepsAttempts();
  void aToolThatIsLetGoLeavesVolumes();
  void thePicturesOfTheManual();

private:
  // One anatomy, in which nothing repeats, twice.
  QString A() override { return WriteVolume("a.mha", 1, {0.0, 0.0, 0.0}, 64); }
  QString B() override { return WriteVolume("b.mha", 1, {0.0, 0.0, 0.0}, 64); }
  void Raise(WindowUnderTest& window, const char* panel)
  {
    auto* dock = window.Part<QDockWidget>((QByteArray(panel) + "Dock").constData());
    dock->show();
    dock->raise();
    window.Settle();
  }
  void Picture(WindowUnderTest& window, const QString& name)
  {
    window.Settle();
    ComparePicture(window.Screenshot(name), name);
  }
};

void TestPanels::refineBringsAVolumeBack()
{
  QStringList files;
  for (const char* name : {"a.mha", "b.mha"})
    files.append(WriteVolume(name, 1, {0.0, 0.0, 0.0}, 64, true));
  WindowUnderTest window;
  QVERIFY(window.Open(files));
  const auto belongs = window.Pose(2);
  window.Session()->Select(2, true, true);
  window.Session()->TranslateSelection(3.0, -2.0, 1.0);
  const int entries = window.Session()->GetUndoCount();
  const auto moved = window.Pose(2);
  Raise(window, "registrationPanel");
  QTest::mouseClick(window.Part<QPushButton>("refine"), Qt::LeftButton);
  QVERIFY(!window.Part<QPushButton>("refine")->isEnabled());
  QVERIFY(window.Wait());
  QVERIFY(window.Part<QPushButton>("refine")->isEnabled());
  auto* table = window.Part<QTableWidget>("alignResults");
  QCOMPARE(table->rowCount(), 2);
  // Shifted by what repeats they fit nearly as well, which is ambiguous: not taken unless one says so.
  QCOMPARE(table->item(1, 1)->text(), QString("ambiguous"));
  QVERIFY(!table->item(1, 1)->toolTip().isEmpty());
  QVERIFY(window.Pose(2) == moved);
  QCOMPARE(window.Session()->GetUndoCount(), entries);
  window.Part<QCheckBox>("alignDoubtful")->setChecked(true);
  QTest::mouseClick(window.Part<QPushButton>("refine"), Qt::LeftButton);
  QVERIFY(window.Wait());
  QVERIFY2(Distance(window.Pose(2), belongs) < 0.3, qPrintable(QString::number(Distance(window.Pose(2), belongs))));
  QCOMPARE(window.Session()->GetUndoCount(), entries + 1);
  window.Session()->Undo();
  QVERIFY(window.Pose(2) == moved);
}

void TestPanels::aSureAnswerIsTakenUnasked()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()})); // one anatomy, in which nothing repeats
  const auto first = window.Pose(1), belongs = window.Pose(2);
  Raise(window, "registrationPanel");
  for (const char* button : {"refine", "alignAll"}) {
    window.Session()->Select(2, true, true);
    window.Session()->TranslateSelection(3.0, -2.0, 1.0);
    window.Session()->RotateSelection(0.0, 0.0, 4.0);
    const int entries = window.Session()->GetUndoCount();
    QVERIFY(!window.Part<QCheckBox>("alignDoubtful")->isChecked());
    QTest::mouseClick(window.Part<QPushButton>(button), Qt::LeftButton);
    QVERIFY(window.Wait());
    auto* table = window.Part<QTableWidget>("alignResults");
    QCOMPARE(table->rowCount(), 2);
    QCOMPARE(table->item(0, 1)->text(), QString("stays"));
    QCOMPARE(table->item(1, 1)->text(), QString("aligned"));
    QCOMPARE(window.Pose(1), first);
    QVERIFY2(Distance(window.Pose(2), belongs) < 0.5, button);
    QCOMPARE(window.Session()->GetUndoCount(), entries + 1);
  }
}

// Farther away than refining looks: it says so, and one click goes on. What it said does not stay beside the better answer.
void TestPanels::refiningOffersToSearchFarther()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  const auto belongs = window.Pose(2);
  Raise(window, "registrationPanel");
  window.Session()->Select(2, true, true);
  window.Session()->TranslateSelection(34.0, 0.0, 0.0);
  const auto moved = window.Pose(2);
  QTest::mouseClick(window.Part<QPushButton>("refine"), Qt::LeftButton);
  QVERIFY(window.Wait());
  QVERIFY(window.Pose(2) == moved);
  QVERIFY2(window.HasMessage("within 20 mm and 12"), qPrintable(window.Messages().join('\n')));
  auto* answer = window.Part<QPushButton>("messageAnswer");
  QCOMPARE(answer->text(), QString("Search farther"));
  QTest::mouseClick(answer, Qt::LeftButton);
  QVERIFY(!window.HasMessage("Refine")); // as soon as it is of the past
  QVERIFY(window.Wait());
  QVERIFY2(Distance(window.Pose(2), belongs) < 0.5, qPrintable(window.Messages().join('\n')));
  QVERIFY(window.HasMessage("Search farther: done, 1 moved"));
}

// The volumes of the first test, which the images alone leave ambiguous: the same three places are clicked on in both.
void TestPanels::landmarksTellWhatRepeatsApart()
{
  QStringList files;
  for (const char* name : {"a.mha", "b.mha"})
    files.append(WriteVolume(name, 1, {0.0, 0.0, 0.0}, 64, true));
  WindowUnderTest window;
  QVERIFY(window.Open(files));
  vtkUltrasoundAlignmentSession* session = window.Session();
  const auto belongs = window.Pose(2);
  session->Select(2, true, true);
  session->TranslateSelection(3.0, -2.0, 0.0);
  Raise(window, "registrationPanel");
  auto* table = window.Part<QTableWidget>("landmarkTable");
  QCOMPARE(table->rowCount(), 0);

  SliceCanvas* slice = window.Slice(0);
  const auto at = [slice](double x, double y) {
    double pixel[2], focus[3];
    slice->View()->GetFocus(focus);
    slice->View()->WorldToPixel(x, y, focus[2], pixel);
    return slice->PositionOf({pixel[0], pixel[1]}).toPoint();
  };
  slice->setFocus();
  window.Key(Qt::Key_6);
  session->SelectNone();
  window.Click(slice, at(0, 0));
  QVERIFY(window.HasMessage("Select the one volume"));
  QCOMPARE(session->GetNumberOfLandmarks(1) + session->GetNumberOfLandmarks(2), 0);
  const int entries = session->GetUndoCount();
  const double places[3][2] = {{-15.0, -10.0}, {12.0, -8.0}, {2.0, 16.0}};
  session->Select(1, true, true);
  for (const auto& place : places)
    window.Click(slice, at(place[0], place[1]));
  session->Select(2, true, true);
  for (const auto& place : places)
    window.Click(slice, at(place[0] + 3.0, place[1] - 2.0));
  QCOMPARE(session->GetUndoCount(), entries + 6);
  QCOMPARE(session->GetNumberOfLandmarks(2), 3);
  QCOMPARE(session->GetLandmarkLabel(2, 2), std::string("3"));
  double marked[3];
  QVERIFY(session->GetLandmark(2, "3", marked));
  const double pixelMm = slice->View()->GetMillimetresPerPixel();
  QVERIFY(std::hypot(marked[0] - 5.0, marked[1] - 14.0) < 1.5 * pixelMm);
  QCOMPARE(table->rowCount(), 3);
  QCOMPARE(table->item(0, 0)->text(), QString("1"));
  QCOMPARE(table->item(0, 1)->text(), QString("a, b"));
  const double apart = table->item(0, 2)->text().section(' ', 0, 0).toDouble();
  QVERIFY2(std::abs(apart - std::hypot(3.0, 2.0)) < 2.0 * pixelMm, qPrintable(table->item(0, 2)->text()));
  const QImage picture = window.Screenshot("landmarks");

  // One that is dragged is the same one, and it is one edit; Escape takes it back.
  window.Drag(slice, at(5.0, 14.0), at(9.0, 14.0));
  QCOMPARE(session->GetUndoCount(), entries + 7);
  QCOMPARE(session->GetNumberOfLandmarks(2), 3);
  QVERIFY(session->GetLandmark(2, "3", marked) && std::abs(marked[0] - 9.0) < 1.5 * pixelMm);
  window.Press(slice, at(9.0, 14.0));
  window.Move(slice, at(20.0, 20.0));
  window.Key(Qt::Key_Escape);
  window.Release(slice, at(20.0, 20.0));
  QVERIFY(session->GetLandmark(2, "3", marked) && std::abs(marked[0] - 9.0) < 1.5 * pixelMm);
  QVERIFY(window.Screenshot("landmarks") != picture);
  QVERIFY(session->Undo());
  QVERIFY(session->GetLandmark(2, "3", marked) && std::abs(marked[0] - 5.0) < 1.5 * pixelMm);

  const int before = session->GetUndoCount();
  QVERIFY(!window.Part<QCheckBox>("alignDoubtful")->isChecked());
  QTest::mouseClick(window.Part<QPushButton>("refine"), Qt::LeftButton);
  QVERIFY(window.Wait());
  auto* results = window.Part<QTableWidget>("alignResults");
  QVERIFY2(results->item(1, 1)->text() == "aligned", qPrintable(results->item(1, 1)->toolTip()));
  QVERIFY2(Distance(window.Pose(2), belongs) < 0.3, qPrintable(QString::number(Distance(window.Pose(2), belongs))));
  QCOMPARE(session->GetUndoCount(), before + 1);
  QVERIFY(table->item(0, 2)->text().section(' ', 0, 0).toDouble() < 3.0 * pixelMm);

  // What is selected in the list goes, then all; undo brings them back.
  table->selectRow(1);
  QTest::mouseClick(window.Part<QPushButton>("landmarkRemove"), Qt::LeftButton);
  QCOMPARE(table->rowCount(), 2);
  QCOMPARE(session->GetNextLandmarkLabel(1), std::string("2"));
  QTest::mouseClick(window.Part<QPushButton>("landmarkClear"), Qt::LeftButton);
  QCOMPARE(table->rowCount(), 0);
  QVERIFY(session->Undo() && session->Undo());
  QCOMPARE(table->rowCount(), 3);
}

void TestPanels::aCancelledJobChangesNothing()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  window.Session()->Select(2, true, true);
  window.Session()->TranslateSelection(5.0, 0.0, 0.0);
  const auto before = window.Pose(2);
  const int entries = window.Session()->GetUndoCount();
  window.Part<RegistrationPanel>("registrationPanel")->AlignAll();
  QCOMPARE(window.Window().Jobs()->Count(), 1);
  QTest::mouseClick(window.Part<QToolButton>("jobCancel"), Qt::LeftButton);
  QVERIFY(window.Wait());
  QVERIFY(window.Pose(2) == before);
  QCOMPARE(window.Session()->GetUndoCount(), entries);
  QCOMPARE(window.Part<QTableWidget>("alignResults")->rowCount(), 0);
}

void TestPanels::whatMovedMeanwhileStays()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  window.Session()->Select(2, true, true);
  window.Session()->TranslateSelection(3.0, 0.0, 0.0);
  window.Part<QCheckBox>("alignDoubtful")->setChecked(true);
  window.Part<RegistrationPanel>("registrationPanel")->Refine();
  window.Session()->TranslateSelection(0.0, 1.0, 0.0);
  auto put = window.Pose(2);
  QVERIFY(window.Wait());
  QVERIFY(window.Pose(2) == put);
  QVERIFY(window.HasMessage("moved during the alignment"));
  // And when the volume that stays is moved, nothing is taken.
  window.Part<RegistrationPanel>("registrationPanel")->Refine();
  window.Session()->Select(1, true, true);
  window.Session()->TranslateSelection(0.0, 0.0, 2.0);
  put = window.Pose(2);
  QVERIFY(window.Wait());
  QVERIFY(window.Pose(2) == put);
}

void TestPanels::anAlignmentWaitsForTheEndOfADrag()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  auto* session = window.Session();
  const auto belongs = window.Pose(2);
  session->Select(2, true, true);
  session->TranslateSelection(3.0, -2.0, 1.0);
  const auto moved = window.Pose(2);
  const int entries = session->GetUndoCount();
  window.Part<RegistrationPanel>("registrationPanel")->Refine();
  session->BeginEdit("a drag");
  QVERIFY(window.Wait());
  QVERIFY(window.Pose(2) == moved);
  session->CancelEdit(); // takes back what is its own
  QTRY_VERIFY(Distance(window.Pose(2), belongs) < 0.5);
  QCOMPARE(session->GetUndoCount(), entries + 1);
}

void TestPanels::aTrackerPlacesVolumesBesideTheFirst()
{
  // A pose for each volume. The sensor was turned by 90 degrees about z and moved; the calibration is a translation, so that
  // C^-1 S1^-1 S2 C is neither of the two nor its inverse.
  const auto write = [this](const char* name, const QByteArray& text) {
    QFile file(Folder().filePath(name));
    return file.open(QIODevice::WriteOnly) && file.write(text) == text.size() ? file.fileName() : QString();
  };
  QByteArray frames("ObjectType = Image\nNDims = 3\nDimSize = 1 1 2\nElementType = MET_UCHAR\nElementSpacing = 1 1 1\n");
  for (const char* pose : {"1 0 0 7 0 1 0 0 0 0 1 0 0 0 0 1", "0 -1 0 7 1 0 0 30 0 0 1 4 0 0 0 1"}) {
    const QByteArray frame = QByteArray("Seq_Frame000") + (frames.contains("Seq_") ? "1" : "0");
    frames += frame + "_ProbeToTrackerTransform = " + pose + "\n" + frame + "_ProbeToTrackerTransformStatus = OK\n";
  }
  const QString recording = write("recording.igs.mha", frames + "ElementDataFile = LOCAL\n" + QByteArray(2, '\0'));
  const QString calibration = write("calibration.json", R"({"schema": "echorama-transforms-1", "unit": "mm", "transforms": [
    {"from": "Volume", "to": "Probe", "matrix": [[1, 0, 0, 10], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}]})");
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  // The first is not where its file has it, and the others follow it; where the second one was does not matter.
  window.Session()->Select(1, true, true);
  window.Session()->TranslateSelection(0.0, 0.0, 100.0);
  window.Session()->Select(2, true, true);
  window.Session()->TranslateSelection(3.0, 0.0, 0.0);
  window.Session()->RotateSelection(0.0, 20.0, 0.0);
  const auto first = window.Pose(1), before = window.Pose(2);
  const int entries = window.Session()->GetUndoCount();
  Raise(window, "registrationPanel");
  QTest::mouseClick(window.Part<QPushButton>("placeByTracker"), Qt::LeftButton);
  QVERIFY(window.Wait());
  QVERIFY(window.Pose(2) == before && window.HasMessage("recording")); // none was named
  window.Type(window.Part<QLineEdit>("placeRecording"), recording);
  window.Type(window.Part<QLineEdit>("placeCalibration"), calibration);
  QTest::mouseClick(window.Part<QPushButton>("placeByTracker"), Qt::LeftButton);
  QVERIFY(window.Wait());
  const std::array<double, 16> expected{0, -1, 0, -10, 1, 0, 0, 40, 0, 0, 1, 104, 0, 0, 0, 1};
  QVERIFY2(Distance(window.Pose(2), expected) < 1e-9, qPrintable(window.Messages().join("; ")));
  QVERIFY(window.Pose(1) == first);
  QCOMPARE(window.Part<QTableWidget>("alignResults")->item(1, 1)->text(), QString("placed"));
  QCOMPARE(window.Session()->GetUndoCount(), entries + 1);
  window.Session()->Undo();
  QVERIFY(window.Pose(2) == before);
}

void TestPanels::stitchingReadsThroughDisplacements()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  window.Session()->Select(2, true, true);
  window.Session()->TranslateSelection(2.0, 0.0, 0.0); // what is left of a rigid motion becomes part of the displacement
  Raise(window, "resultPanel");
  auto* panel = window.Part<ResultPanel>("resultPanel");
  std::vector<double> sums;
  for (const bool deformable : {false, true}) {
    window.Part<QCheckBox>("stitchDeformable")->setChecked(deformable);
    panel->Make(true);
    QVERIFY(window.Wait());
    QVERIFY(window.Session()->IsResult(panel->Target()));
    vtkDataArray* values = vtkUltrasoundVolume::GetIntensity(window.Session()->GetImage(panel->Target()));
    double sum = 0.0;
    for (vtkIdType i = 0; i < values->GetNumberOfTuples(); ++i)
      sum += values->GetTuple1(i) * static_cast<double>(i % 1009);
    sums.push_back(sum);
  }
  QVERIFY(sums[0] != sums[1]);
}

void TestPanels::aWindowMayCloseWhileAJobRuns()
{
  for (int i = 0; i < 2; ++i) {
    WindowUnderTest window;
    QVERIFY(window.Open({A(), B()}));
    if (i == 0)
      window.Part<RegistrationPanel>("registrationPanel")->AlignAll();
    else
      window.Part<ResultPanel>("resultPanel")->Make(false);
    QCOMPARE(window.Window().Jobs()->Count(), 1);
  }
}

void TestPanels::stitchingMakesAndSavesOneVolume()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  window.Session()->Select(2, true, true);
  window.Session()->TranslateSelection(20.0, 0.0, 0.0);
  Raise(window, "resultPanel");
  auto* panel = window.Part<ResultPanel>("resultPanel");
  QTest::mouseClick(window.Part<QPushButton>("stitchPreview"), Qt::LeftButton);
  QVERIFY(window.Wait());
  QCOMPARE(window.Session()->GetNumberOfVolumes(), 3);
  const int result = window.Session()->GetVolumeId(2);
  QCOMPARE(panel->Target(), result);
  double coarse[3], fine[3];
  window.Session()->GetImage(result)->GetSpacing(coarse);
  QTest::mouseClick(window.Part<QPushButton>("stitchMake"), Qt::LeftButton);
  QVERIFY(window.Wait());
  QCOMPARE(window.Session()->GetNumberOfVolumes(), 3); // it took the place of the preview
  window.Session()->GetImage(result)->GetSpacing(fine);
  QCOMPARE(coarse[0], 2.0 * fine[0]);
  QVERIFY(window.Session()->GetImage(result)->GetDimensions()[0] > 64);
  const QString path = Folder().filePath("stitched.mha");
  panel->Save(path);
  QVERIFY(window.Wait());
  QVERIFY(QFileInfo(path).size() > 1000);
  QVERIFY(window.HasMessage("Saved"));
  panel->Save("/nowhere/stitched.mha");
  QVERIFY(window.Wait());
  QVERIFY(window.HasMessage("/nowhere"));
}

void TestPanels::exportWritesAndNeverReplaces()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  window.Session()->Select(2, true, true);
  window.Session()->TranslateSelection(20.0, 0.0, 0.0);
  QVERIFY(window.Part<QAction>("exportVolumes")->isEnabled());
  ExportActions& actions = *window.Window().findChild<ExportActions*>();
  const QDir out(Folder().filePath("out"));
  QVERIFY(QDir().mkpath(out.path()));
  actions.ExportVolumes(out.path());
  actions.ExportTransforms(out.path());
  actions.ExportPoses(out.filePath("poses.json"));
  QVERIFY(window.Wait());
  for (const char* name : {"a.mha", "b.mha", "a.tfm", "b.tfm", "poses.json"})
    QVERIFY2(out.exists(name), name);
  QFile transform(out.filePath("b.tfm"));
  QVERIFY(transform.open(QIODevice::ReadOnly));
  QVERIFY(transform.readAll().contains("Parameters: 1 0 0 0 1 0 0 0 1 -20 "));
  // What was exported lies where it was put.
  WindowUnderTest other;
  QVERIFY(other.Open({out.filePath("b.mha")}));
  double here[3], there[3], degrees[3];
  window.Session()->GetPlacement(2, here, degrees);
  other.Session()->GetPlacement(1, there, degrees);
  QVERIFY(std::fabs(here[0] - there[0]) < 1e-6);
  // A second time nothing is replaced.
  const QDateTime before = QFileInfo(out.filePath("b.mha")).lastModified();
  actions.ExportVolumes(out.path());
  QVERIFY(window.Wait());
  QVERIFY(window.HasMessage("it is there already"));
  QCOMPARE(QFileInfo(out.filePath("b.mha")).lastModified(), before);
}

void TestPanels::exportHoldsWhatWasPaintedOfWhatIsShown()
{
  const QString third = WriteVolume("c.mha", 1, {0.0, 0.0, 0.0}, 64);
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B(), third}));
  auto* session = window.Session();
  const vtkNew<vtkImageData> before;
  QVERIFY(session->GetSnapshot(1, before));
  const auto stroke = [session](const char* mode, double x) { // a ball of 4 mm beside the middle
    return session->BeginStroke(1, mode, 4.0, 250.0, 1.0, 1.0, true) && session->ExtendStroke(x, 0.0, 0.0) &&
           session->EndStroke();
  };
  QVERIFY(stroke("paint", 12.0) && stroke("carve", -12.0));
  session->Select(1, true, true);
  session->TranslateSelection(20.0, 0.0, 0.0);
  session->Select(2, true, true);
  session->TranslateSelection(400.0, 0.0, 0.0);
  QVERIFY(session->SetVisible(2, false));
  ExportActions& actions = *window.Window().findChild<ExportActions*>();
  const QDir out(Folder().filePath("out"));
  QVERIFY(QDir().mkpath(out.path()));
  actions.ExportVolumes(out.path());
  actions.ExportTransforms(out.path());
  QVERIFY(window.Wait());
  QVERIFY2(window.HasMessage("Exported 2 volumes"), qPrintable(window.Messages().join('\n')));
  QVERIFY(out.exists("a.mha") && out.exists("a.tfm") && out.exists("c.mha"));
  QVERIFY(!out.exists("b.mha") && !out.exists("b.tfm"));
  // Grey levels and valid region are those of the file but for the two balls, which moved along.
  WindowUnderTest other;
  QVERIFY(other.Open({out.filePath("a.mha")}));
  const vtkNew<vtkImageData> after;
  QVERIFY(other.Session()->GetSnapshot(1, after));
  QCOMPARE(after->GetNumberOfPoints(), before->GetNumberOfPoints());
  const auto value = [](vtkImageData* image, const char* name, vtkIdType i) {
    return image->GetPointData()->GetArray(name)->GetTuple1(i);
  };
  int wrong = 0, painted = 0, carved = 0;
  for (vtkIdType i = 0; i < before->GetNumberOfPoints(); ++i) {
    double was[3], is[3];
    before->GetPoint(i, was);
    after->GetPoint(i, is);
    const bool inPaint = std::hypot(was[0] - 12.0, was[1], was[2]) <= 4.0;
    const bool inCarve = std::hypot(was[0] + 12.0, was[1], was[2]) <= 4.0;
    painted += inPaint;
    carved += inCarve;
    wrong += std::abs(is[0] - was[0] - 20.0) > 1e-6;
    wrong += value(after, "ValidRegion", i) != (inCarve ? 0.0 : value(before, "ValidRegion", i));
    wrong += !inCarve && value(after, "Intensity", i) != (inPaint ? 250.0 : value(before, "Intensity", i));
  }
  QCOMPARE(wrong, 0);
  QVERIFY(painted > 200 && carved > 200);
  // Nor is what is hidden stitched: it would make the result 400 mm longer.
  Raise(window, "resultPanel");
  QTest::mouseClick(window.Part<QPushButton>("stitchPreview"), Qt::LeftButton);
  QVERIFY(window.Wait());
  double bounds[6];
  window.Session()->GetImage(window.Part<ResultPanel>("resultPanel")->Target())->GetBounds(bounds);
  QVERIFY2(std::abs(bounds[1] - bounds[0] - (60.0 + 20.0)) < 6.0, qPrintable(QString::number(bounds[1] - bounds[0])));
}

void TestPanels::exportedFilesHaveNamesOfTheirOwn()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  ExportActions& actions = *window.Window().findChild<ExportActions*>();
  const QDir out(Folder().filePath("out"));
  QVERIFY(QDir().mkpath(out.path()));
  // What lies beside a volume is part of it.
  QFile mask(out.filePath("a.ValidRegion.mha"));
  QVERIFY(mask.open(QIODevice::WriteOnly) && mask.write("somebody's") > 0);
  mask.close();
  actions.ExportVolumes(out.path());
  QVERIFY(window.Wait());
  QVERIFY2(window.HasMessage("a.ValidRegion.mha: it is there already"), qPrintable(window.Messages().join('\n')));
  QCOMPARE(out.entryList(QDir::Files), QStringList("a.ValidRegion.mha"));
  QCOMPARE(QFileInfo(mask).size(), 10);
  // Two names that would be one file.
  QVERIFY(window.Session()->SetName(1, "left/right") && window.Session()->SetName(2, "left_right"));
  actions.ExportVolumes(out.path());
  QVERIFY(window.Wait());
  QVERIFY2(window.HasMessage("left_right.mha: two volumes"), qPrintable(window.Messages().join('\n')));
  QCOMPARE(out.entryList(QDir::Files), QStringList("a.ValidRegion.mha"));
}

void TestPanels::trainingHidesScoreAndKeepsAttempts()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  const QString truth = Folder().filePath("truth.json");
  QVERIFY(window.Session()->WritePoses(truth.toUtf8()));
  auto* panel = window.Part<TrainingPanel>("trainingPanel");
  Raise(window, "trainingPanel");
  QVERIFY(panel->SetHistory(Folder().filePath("attempts.csv")));
  QVERIFY(panel->LoadTruth(truth));
  QCOMPARE(window.Part<QLabel>("score")->text(), QString("0.00 mm"));
  // As far as was asked for, the fixed volume not at all; twice the same exercise, and another one for another seed.
  window.Part<QDoubleSpinBox>("scatterMm")->setValue(9.0);
  window.Part<QDoubleSpinBox>("scatterDegrees")->setValue(4.0);
  window.Part<QLineEdit>("trainee")->setText("Ada");
  const auto fixed = window.Pose(1);
  double at[3], put[3], angles[3];
  window.Session()->GetPlacement(2, at, angles);
  QTest::mouseClick(window.Part<QPushButton>("scatter"), Qt::LeftButton);
  const auto scattered = window.Pose(2);
  QTest::mouseClick(window.Part<QPushButton>("scatter"), Qt::LeftButton);
  QVERIFY(Distance(window.Pose(2), scattered) < 1e-9);
  window.Session()->GetPlacement(2, put, angles);
  QVERIFY(std::abs(std::hypot(put[0] - at[0], put[1] - at[1], put[2] - at[2]) - 9.0) < 1e-6);
  QVERIFY(std::abs(window.Session()->GetRotationError(2) - 4.0) < 1e-4);
  QCOMPARE(window.Pose(1), fixed);
  window.Part<QDoubleSpinBox>("scatterSeed")->setValue(2);
  QTest::mouseClick(window.Part<QPushButton>("scatter"), Qt::LeftButton);
  QVERIFY(Distance(window.Pose(2), scattered) > 0.1);
  const double start = window.Session()->GetScore(); // the mean over both volumes
  QVERIFY(start > 3.0);
  window.Settle();
  QCOMPARE(window.Part<QLabel>("score")->text(), QString::number(start, 'f', 2) + " mm");

  QTest::mouseClick(window.Part<QPushButton>("trainingStart"), Qt::LeftButton);
  QVERIFY(panel->IsTraining());
  QCOMPARE(window.Part<QLabel>("score")->text(), QString("hidden until you submit"));
  QCOMPARE(window.Part<QLabel>("scoreReadout")->text(), QString());
  QCOMPARE(window.Session()->GetUndoCount(), 0); // it would lead to the solution
  window.Session()->Select(2, true, true);
  window.Session()->TranslateSelection(1.0, 0.0, 0.0);
  QCOMPARE(window.Part<QLabel>("score")->text(), QString("hidden until you submit"));
  // Nothing that leads to the solution: neither the numbers, nor what was there before, nor the aligner.
  QCOMPARE(window.Part<QDoubleSpinBox>("middleX")->text(), QString());
  QCOMPARE(window.Part<QDoubleSpinBox>("centreX")->text(), QString());
  QVERIFY(!window.Part<QDoubleSpinBox>("degreesZ")->isEnabled());
  QVERIFY(!window.Part<QListWidget>("backups")->isEnabled());
  QVERIFY(!window.Part<QPushButton>("scatter")->isEnabled());
  QTest::mouseClick(window.Part<QPushButton>("refine"), Qt::LeftButton);
  QVERIFY(window.Part<QPushButton>("refine")->isEnabled()); // nothing runs
  QVERIFY2(window.HasMessage("not during an attempt"), qPrintable(window.Messages().join('\n')));
  const auto moved = window.Pose(2);
  window.Window().Files()->Open({truth}); // nor a file of poses
  window.Settle();
  QCOMPARE(window.Pose(2), moved);
  QTest::qWait(300);
  QTest::mouseClick(window.Part<QPushButton>("trainingSubmit"), Qt::LeftButton);
  QVERIFY(!panel->IsTraining());
  const std::vector<Attempt> attempts = ReadAttempts(Folder().filePath("attempts.csv").toStdString());
  QCOMPARE(attempts.size(), std::size_t(1));
  QCOMPARE(attempts[0].scoreMm, window.Session()->GetScore());
  QCOMPARE(attempts[0].startMm, start);
  QCOMPARE(attempts[0].edits, 1);
  QCOMPARE(attempts[0].help, 0);
  QVERIFY(attempts[0].seconds >= 0.3);
  QCOMPARE(attempts[0].trainee, std::string("Ada"));
  QCOMPARE(attempts[0].worstMm, window.Session()->GetVolumeScore(2));
  QCOMPARE(window.Part<QTableWidget>("attempts")->rowCount(), 1);
  QCOMPARE(window.Part<QLabel>("score")->text(), QString::number(window.Session()->GetScore(), 'f', 2) + " mm");
  QVERIFY(window.Part<QDoubleSpinBox>("middleX")->text() != QString() && window.Part<QListWidget>("backups")->isEnabled());
  // Help that is allowed is counted.
  window.Part<QCheckBox>("trainingHelp")->setChecked(true);
  QTest::mouseClick(window.Part<QPushButton>("trainingStart"), Qt::LeftButton);
  QTest::mouseClick(window.Part<QPushButton>("refine"), Qt::LeftButton);
  QVERIFY(window.Wait());
  QTest::mouseClick(window.Part<QPushButton>("trainingSubmit"), Qt::LeftButton);
  QCOMPARE(ReadAttempts(Folder().filePath("attempts.csv").toStdString()).at(1).help, 1);
  // Nor is it to be had by asking for it before.
  QTest::mouseClick(window.Part<QPushButton>("refine"), Qt::LeftButton);
  QTest::mouseClick(window.Part<QPushButton>("trainingStart"), Qt::LeftButton);
  QVERIFY(!panel->IsTraining());
  QVERIFY2(window.HasMessage("still running"), qPrintable(window.Messages().join('\n')));
  QVERIFY(window.Wait());
  QTest::mouseClick(window.Part<QPushButton>("trainingStart"), Qt::LeftButton);
  QVERIFY(panel->IsTraining() && !window.HasMessage("still running"));
  window.Window().Files()->Open({truth});
  window.Settle();
  QTest::mouseClick(window.Part<QPushButton>("trainingSubmit"), Qt::LeftButton);
  QCOMPARE(ReadAttempts(Folder().filePath("attempts.csv").toStdString()).at(2).help, 1);
  // A file that is something else is refused, and stays.
  QVERIFY(!panel->SetHistory(truth));
  QVERIFY(QFile(truth).size() > 0);
}

void TestPanels::aToolThatIsLetGoLeavesVolumes()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  Raise(window, "trackerPanel");
  QVERIFY2(window.Messages().isEmpty(), qPrintable(window.Messages().join('\n')));
  auto* address = window.Part<QLineEdit>("trackerAddress");
  address->setText("nonsense:");
  QTest::mouseClick(window.Part<QPushButton>("trackerConnect"), Qt::LeftButton);
  QTRY_VERIFY(!window.Messages().isEmpty());
  address->setText("simulated:");
  auto* connect = window.Part<QPushButton>("trackerConnect");
  const auto text = [connect] { return connect->text().remove('&'); };
  QTRY_COMPARE(text(), QString("Connect"));
  connect->click();
  QCOMPARE(text(), QString("Cancel")); // the window does not wait for it
  QVERIFY(!address->isEnabled());
  connect->click();
  QVERIFY(window.Wait());
  QCOMPARE(text(), QString("Connect"));
  connect->click();
  QTRY_VERIFY_WITH_TIMEOUT(window.Part<QPushButton>("trackerGrasp")->isEnabled(), 10000);
  window.Session()->Select(2, true, true);
  const int entries = window.Session()->GetUndoCount();
  const auto before = window.Pose(2);
  auto* grasp = window.Part<QPushButton>("trackerGrasp");
  QTest::mousePress(grasp, Qt::LeftButton);
  QTRY_VERIFY_WITH_TIMEOUT(Distance(window.Pose(2), before) > 0.01, 10000);
  QTest::qWait(300);
  const auto held = window.Pose(2);
  QTest::mouseRelease(grasp, Qt::LeftButton);
  // It may have been moved once more on the way to the release, and never back.
  QVERIFY2(Distance(window.Pose(2), held) < 0.5 * Distance(held, before) + 1e-6, "the volume jumped when it was let go");
  QCOMPARE(window.Session()->GetUndoCount(), entries + 1);
  const auto left = window.Pose(2);
  QTest::qWait(200);
  QVERIFY(window.Pose(2) == left);
  QTest::mouseClick(window.Part<QPushButton>("trackerConnect"), Qt::LeftButton);
  QVERIFY(window.Pose(2) == left);
}

// The picture must be that of the manual, as a whole and in every square of 32 pixels, but for some grey levels: fonts and
// drivers differ. A stroke of the brush that is missing is a square that differs.
void TestPanels::thePicturesOfTheManual()
{
  if (!Liver.exists("liver_volume_A.mha"))
    QSKIP("the liver pair is not there");
  WindowUnderTest window;
  QVERIFY(window.Open({Liver.filePath("liver_volume_A.mha"), Liver.filePath("liver_volume_B.mha")}));
  const QString truth = Folder().filePath("truth.json");
  QVERIFY(window.Session()->WritePoses(truth.toUtf8())); // both are from one sweep: they lie where they belong
  window.Session()->Select(2, true, true);
  Raise(window, "registrationPanel");
  Picture(window, "workbench");

  // A bright stroke across one volume, and a hole in the other.
  Raise(window, "brushPanel");
  window.Slice(0)->setFocus();
  window.Key(Qt::Key_3);
  const QPoint middle = window.Slice(0)->rect().center();
  window.Drag(window.Slice(0), middle + QPoint(-60, 20), middle + QPoint(50, 45));
  window.Key(Qt::Key_4);
  window.Drag(window.Slice(1), window.Slice(1)->rect().center(), window.Slice(1)->rect().center() + QPoint(30, 20));
  Picture(window, "workbench-paint");
  window.Session()->Undo();
  window.Session()->Undo();
  window.Key(Qt::Key_2);

  Raise(window, "viewPanel");
  VolumeLook look = window.Window().Bench()->Volume();
  look.minimum = 75.0;
  look.slices = false;
  window.Window().Bench()->Set(look);
  window.Window().Views()->ToggleLarge(window.Window().Views()->Volume());
  Picture(window, "workbench-3d");
  window.Window().Views()->ToggleLarge(window.Window().Views()->Volume());
  look.minimum = 1.0;
  look.slices = true;
  window.Window().Bench()->Set(look);

  Raise(window, "resultPanel");
  window.Part<QCheckBox>("embed")->setChecked(true);
  window.Part<ResultPanel>("resultPanel")->Make(true);
  QVERIFY(window.Wait());
  Picture(window, "workbench-stitch");
  window.Session()->Undo(); // so that the pair is shown again, and alone

  Raise(window, "trainingPanel");
  auto* training = window.Part<TrainingPanel>("trainingPanel");
  QVERIFY(training->SetHistory(Folder().filePath("attempts.csv")));
  QVERIFY(training->LoadTruth(truth));
  QTest::mouseClick(window.Part<QPushButton>("scatter"), Qt::LeftButton);
  window.Part<QCheckBox>("showErrors")->setChecked(true);
  Picture(window, "workbench-train");
}

int main(int argc, char** argv)
{
  return WindowTest::Run(argc, argv, [argc, argv] {
    TestPanels test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestPanels.moc"
