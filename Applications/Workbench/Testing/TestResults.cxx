// SPDX-License-Identifier: BSD-3-Clause
// The stitched result as a volume of the session: linked to its sources, made again, compared, painted, saved with the project.
#include "FileActions.h"
#include "JobBar.h"
#include "Message.h"
#include "RegistrationPanel.h"
#include "ResultPanel.h"
#include "SliceCanvas.h"
#include "WindowUnderTest.h"
#include "Workbench.h"
#include <QAction>
#include <QCheckBox>
#include <QComboBox>
#include <QDockWidget>
#include <QDoubleSpinBox>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QTableView>
#include <QTableWidget>
#include <QToolButton>
#include <QtTest>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkUltrasoundSliceView.h>
#include <vtkUltrasoundVolume.h>

using namespace echorama;

namespace {

std::vector<double> Voxels(vtkImageData* image, const char* name = nullptr)
{
  vtkDataArray* array = name ? image->GetPointData()->GetArray(name) : vtkUltrasoundVolume::GetIntensity(image);
  std::vector<double> values;
  for (vtkIdType i = 0; i < array->GetNumberOfTuples(); ++i)
    values.push_back(array->GetTuple1(i));
  return values;
}

} // namespace

class TestResults : public WindowTest {
  Q_OBJECT

private slots:
  void aResultIsAVolumeLikeTheOthers();
  void changedSourcesAreSaidAndTheResultIsMadeAgain();
  void compareShowsTheResultOrItsSources();
  void alignersLeaveResultsAlone();
  void aProjectRemembersTheResult();
  void nothingIsSavedSilentlyWithoutTheResult();
  void aSaveThatWasLeftClosesNothingLater();
  void moreOptionsReachTheResult();
  void whatIsMadeDuringADragWaitsForItsEnd();
  void whatIsMadeOfAnotherProjectIsDiscarded();

private:
  void Open(WindowUnderTest& window)
  {
    QVERIFY(window.Open({A(), B()}));
    auto* dock = window.Part<QDockWidget>("resultPanelDock");
    dock->show();
    dock->raise();
    window.Settle();
  }
  // By a click, as a person does.
  void Press(WindowUnderTest& window, const char* button)
  {
    auto* part = window.Part<QPushButton>(button);
    QVERIFY2(part->isVisible() && part->isEnabled(), button);
    QTest::mouseClick(part, Qt::LeftButton);
    QVERIFY(window.Wait());
  }
  int Make(WindowUnderTest& window, const char* button = "stitchPreview")
  {
    Press(window, button);
    return window.Part<ResultPanel>("resultPanel")->Target();
  }
  // Drags with the brush through the middle of what a slice shows.
  void Brush(WindowUnderTest& window, Qt::Key tool)
  {
    SliceCanvas* slice = window.Slice(0);
    slice->setFocus();
    window.Key(tool);
    const QPoint middle = slice->rect().center();
    window.Drag(slice, middle - QPoint(20, 0), middle + QPoint(20, 0));
  }
};

void TestResults::aResultIsAVolumeLikeTheOthers()
{
  WindowUnderTest window;
  Open(window);
  auto* session = window.Session();
  const int entries = session->GetUndoCount();
  const int result = Make(window);
  QVERIFY(session->IsResult(result));
  QCOMPARE(session->GetNumberOfVolumes(), 3);
  QCOMPARE(session->GetUndoCount(), entries + 1); // with its sources hidden, one edit
  QVERIFY(session->GetVisible(result) && !session->GetVisible(1) && !session->GetVisible(2));
  QVERIFY(session->IsSelected(result) && session->GetNumberOfSelected() == 1);
  double own[3], other[3];
  session->GetColour(result, own);
  for (const int id : {1, 2}) {
    session->GetColour(id, other);
    QVERIFY(!std::equal(own, own + 3, other));
  }
  // It is in the table, and can be renamed there.
  auto* table = window.Part<QTableView>("volumes");
  QCOMPARE(table->model()->rowCount(), 3);
  QVERIFY(table->model()->setData(table->model()->index(2, 2), "whole", Qt::EditRole));
  QCOMPARE(session->GetName(result), std::string("whole"));
  QVERIFY(table->model()->index(2, 2).data(Qt::ToolTipRole).toString().contains("Made of left, right"));

  // Full resolution takes the place of the preview.
  const auto coarse = Voxels(session->GetImage(result)).size();
  QCOMPARE(Make(window, "stitchMake"), result);
  QCOMPARE(session->GetNumberOfVolumes(), 3);
  QVERIFY(Voxels(session->GetImage(result)).size() > 6 * coarse);
  QCOMPARE(session->GetName(result), std::string("whole"));

  // Painted, carved, marked; and it does not become another because of that.
  const std::vector<double> before = Voxels(session->GetImage(result));
  const std::vector<double> valid = Voxels(session->GetImage(result), "ValidRegion");
  window.Window().Bench()->Set(&BrushSettings::intensity, 250.0);
  Brush(window, Qt::Key_3);
  QVERIFY(Voxels(session->GetImage(result)) != before);
  Brush(window, Qt::Key_4);
  QVERIFY(Voxels(session->GetImage(result), "ValidRegion") != valid);
  window.Slice(0)->setFocus();
  window.Key(Qt::Key_6);
  window.Click(window.Slice(0), window.Slice(0)->rect().center() + QPoint(0, 25));
  QCOMPARE(session->GetNumberOfLandmarks(result), 1);
  QCOMPARE(session->GetNumberOfLandmarks(1) + session->GetNumberOfLandmarks(2), 0);
  QCOMPARE(session->GetSourcesChanged(result), std::string());
  while (session->GetUndoCount() > entries + 3) // with the name, and the full resolution
    window.Key(Qt::Key_Z, Qt::ControlModifier);
  QVERIFY(Voxels(session->GetImage(result)) == before);
  while (session->GetUndoCount() > entries)
    window.Key(Qt::Key_Z, Qt::ControlModifier);
  QCOMPARE(session->GetNumberOfVolumes(), 2);
  QVERIFY(session->GetVisible(1) && session->GetVisible(2));
  window.Key(Qt::Key_Y, Qt::ControlModifier);
  QCOMPARE(Voxels(session->GetImage(result)).size(), coarse);
}

void TestResults::changedSourcesAreSaidAndTheResultIsMadeAgain()
{
  WindowUnderTest window;
  Open(window);
  auto* session = window.Session();
  auto* panelSays = window.Part<QLabel>("stitchChanged");
  auto* tableSays = window.Part<QLabel>("sourcesChanged");
  const auto says = [&](const QString& words) {
    window.Settle();
    return words.isEmpty()
               ? !panelSays->isVisible() && !tableSays->isVisible() && !window.Part<QPushButton>("makeAgain")->isVisible()
               : panelSays->text().contains(words) && panelSays->isVisible() && tableSays->isVisible();
  };
  const int result = Make(window);
  QVERIFY2(says({}), qPrintable(panelSays->text() + '\n' + window.Messages().join('\n')));
  session->SetColour(result, 1.0, 0.0, 0.0);
  const std::vector<double> first = Voxels(session->GetImage(result));

  // A source is dragged, with the mouse.
  QTest::mouseClick(window.Part<QPushButton>("stitchCompare"), Qt::LeftButton);
  window.Settle();
  session->Select(2, true, true);
  window.Slice(0)->setFocus();
  window.Key(Qt::Key_2);
  window.Key(Qt::Key_Right);
  window.Key(Qt::Key_Right);
  QVERIFY2(says("right was moved"), qPrintable(panelSays->text()));
  QVERIFY(!window.Part<QTableView>("volumes")->model()->index(2, 2).data(Qt::DecorationRole).isNull());
  window.Key(Qt::Key_Z, Qt::ControlModifier);
  window.Key(Qt::Key_Z, Qt::ControlModifier);
  QVERIFY2(says({}), qPrintable(panelSays->text() + '\n' + window.Messages().join('\n')));
  window.Key(Qt::Key_Y, Qt::ControlModifier);
  QVERIFY(says("right was moved"));
  Press(window, "makeAgain");
  QVERIFY2(says({}), qPrintable(panelSays->text() + '\n' + window.Messages().join('\n')));
  QVERIFY(Voxels(session->GetImage(result)) != first);
  QCOMPARE(session->GetNumberOfVolumes(), 3);
  double colour[3];
  session->GetColour(result, colour);
  QCOMPARE(colour[0] + colour[1] + colour[2], 1.0); // looks stay
  QCOMPARE(session->GetResultOption(result, "Preview"), std::string("on"));

  // Painted, carved, removed. Of one volume alone nothing is stitched, and of none nothing is made.
  Brush(window, Qt::Key_4);
  QVERIFY2(says("right was painted or carved"), qPrintable(panelSays->text()));
  session->RemoveVolume(1);
  QVERIFY2(says("left is gone"), qPrintable(panelSays->text()));
  const std::vector<double> last = Voxels(session->GetImage(result));
  Press(window, "stitchAgain");
  QVERIFY2(window.HasMessage("two volumes are needed, and there is right alone"), qPrintable(window.Messages().join('\n')));
  QCOMPARE(session->GetNumberOfSources(result), 2);
  session->RemoveVolume(2);
  Press(window, "stitchAgain");
  QVERIFY2(window.HasMessage("the sources of result are gone"), qPrintable(window.Messages().join('\n')));
  QVERIFY(Voxels(session->GetImage(result)) == last);
}

void TestResults::compareShowsTheResultOrItsSources()
{
  WindowUnderTest window;
  Open(window);
  auto* session = window.Session();
  QVERIFY(!window.Part<QPushButton>("stitchCompare")->isEnabled());
  const int result = Make(window);
  const auto shown = [&](int id) { return session->GetVisible(id); };
  const auto picture = [&] {
    window.Slice(0)->DrawNow();
    return window.Slice(0)->grab().toImage();
  };
  const QImage whole = picture();
  window.Slice(0)->setFocus();
  for (int round = 0; round < 2; ++round) {
    window.Key(Qt::Key_T);
    QVERIFY(!shown(result) && shown(1) && shown(2));
    QVERIFY(picture() != whole);
    window.Key(Qt::Key_T);
    QVERIFY(shown(result) && !shown(1) && !shown(2));
  }
  // A source that a person shows beside it: the result alone first.
  session->SetVisible(1, true);
  window.Key(Qt::Key_T);
  QVERIFY(shown(result) && !shown(1) && !shown(2));
  QCOMPARE(session->GetSourcesChanged(result), std::string());
}

void TestResults::alignersLeaveResultsAlone()
{
  WindowUnderTest window;
  Open(window);
  auto* session = window.Session();
  const int result = Make(window);
  const auto before = window.Pose(result);
  auto* aligner = window.Part<RegistrationPanel>("registrationPanel");
  QVERIFY(session->IsSelected(result));
  aligner->Refine();
  QVERIFY(window.HasMessage("made of other volumes"));
  QCOMPARE(window.Window().Jobs()->Count(), 0);
  session->SelectAll();
  aligner->AlignAll();
  QVERIFY(window.Wait());
  QVERIFY(window.Pose(result) == before);
  auto* table = window.Part<QTableWidget>("alignResults");
  QCOMPARE(table->rowCount(), 2);
  QTest::mouseClick(window.Part<QPushButton>("scatter"), Qt::LeftButton);
  QVERIFY(window.Pose(result) == before);
  // Nor is it a source of the next one, unless asked.
  session->SetVisible(1, true);
  auto* of = window.Part<QLabel>("stitchOf");
  auto* into = window.Part<QComboBox>("stitchInto");
  into->setCurrentIndex(0);
  emit into->activated(0);
  QCOMPARE(of->text(), QString("Of left"));
  QTest::mouseClick(window.Part<QToolButton>("stitchMore"), Qt::LeftButton);
  window.Part<QCheckBox>("stitchResults")->setChecked(true);
  QCOMPARE(of->text(), QString("Of left, result"));
}

void TestResults::aProjectRemembersTheResult()
{
  const QString project = Folder().filePath("p.json"), file = Folder().filePath("result.mha");
  std::vector<double> seen;
  {
    WindowUnderTest window;
    Open(window);
    auto* session = window.Session();
    const int result = Make(window);
    window.Window().Bench()->Set(&BrushSettings::intensity, 250.0);
    Brush(window, Qt::Key_3);
    seen = Voxels(session->GetImage(result));
    // Ctrl+S says that the result is in no file, and saves it when asked to.
    QVERIFY(!window.Window().Files()->SaveTo(project));
    QVERIFY2(window.HasMessage("result is in no file yet"), qPrintable(window.Messages().join('\n')));
    QVERIFY(!QFileInfo::exists(project));
    QVERIFY(window.Answer("Save it there"));
    QVERIFY(window.Wait());
    QVERIFY(QTest::qWaitFor([&] { return QFileInfo::exists(project); }, 5000));
    QVERIFY(QFileInfo::exists(file));
    QVERIFY(!session->GetModifiedSinceSave());
    QCOMPARE(session->GetFile(result), file.toStdString());
  }
  {
    WindowUnderTest window;
    QVERIFY(window.Open({project}));
    auto* session = window.Session();
    QCOMPARE(session->GetNumberOfVolumes(), 3);
    const int result = session->GetVolumeId(2);
    QVERIFY(session->IsResult(result));
    QVERIFY(Voxels(session->GetImage(result)) == seen); // painted once, not twice
    QVERIFY(!session->GetVisible(session->GetVolumeId(0)));
    QCOMPARE(session->GetSourcesChanged(result), std::string());
    session->Select(session->GetVolumeId(1), true, true);
    session->TranslateSelection(3.0, 0.0, 0.0);
    auto* dock = window.Part<QDockWidget>("resultPanelDock");
    dock->raise();
    window.Settle();
    Press(window, "stitchAgain");
    QCOMPARE(session->GetSourcesChanged(result), std::string());
    QCOMPARE(session->GetFile(result), std::string()); // the file is what it was, under another name it is saved anew
    QVERIFY(!window.Window().Files()->Save());
    QVERIFY(window.Answer("Save it there"));
    QVERIFY(window.Wait());
    QVERIFY(QTest::qWaitFor([&] { return !session->GetModifiedSinceSave(); }, 5000));
    QCOMPARE(session->GetFile(result), Folder().filePath("result-2.mha").toStdString());
  }
}

void TestResults::nothingIsSavedSilentlyWithoutTheResult()
{
  WindowUnderTest window;
  Open(window);
  auto* session = window.Session();
  const QString project = Folder().filePath("p.json");
  Make(window);
  QVERIFY(!window.Window().Files()->SaveTo(project));
  QVERIFY(window.Answer("Cancel"));
  QVERIFY(!QFileInfo::exists(project));
  QVERIFY(!window.Window().Files()->SaveTo(project));
  QVERIFY(window.Answer("Leave it out"));
  QVERIFY(QFileInfo::exists(project));
  QVERIFY(session->GetModifiedSinceSave()); // and the window asks before it closes
  window.Window().close();
  QVERIFY(window.Window().isVisible());
  QVERIFY2(window.HasMessage("Save what you did"), qPrintable(window.Messages().join('\n')));
  QVERIFY(window.Answer("Save"));
  QVERIFY(window.Answer("Save it there"));
  QVERIFY(window.Wait());
  QVERIFY(QTest::qWaitFor([&] { return !window.Window().isVisible(); }, 5000)); // it goes on where it was asked
  QVERIFY(!session->GetModifiedSinceSave());
}

void TestResults::aSaveThatWasLeftClosesNothingLater()
{
  WindowUnderTest window;
  Open(window);
  QVERIFY(window.Window().Files()->SaveTo(Folder().filePath("p.json")));
  Make(window);
  window.Window().close();
  QVERIFY(window.Answer("Save"));
  QVERIFY(window.HasMessage("result is in no file yet")); // and stays without an answer
  window.Part<QAction>("save")->trigger();
  QVERIFY(window.Answer("Save it there"));
  QVERIFY(window.Wait());
  QTRY_VERIFY(!window.Session()->GetModifiedSinceSave());
  QVERIFY(window.Window().isVisible());
}

void TestResults::moreOptionsReachTheResult()
{
  WindowUnderTest window;
  Open(window);
  auto* session = window.Session();
  window.Part<QCheckBox>("embed")->setChecked(true);
  QVERIFY(!window.Part<QWidget>("FeatherMm")->isVisible());
  QTest::mouseClick(window.Part<QToolButton>("stitchMore"), Qt::LeftButton);
  window.Settle();
  QVERIFY(window.Part<QWidget>("FeatherMm")->isVisible());
  const int result = Make(window);
  const std::vector<double> first = Voxels(session->GetImage(result));
  QCOMPARE(session->GetResultOption(result, "Embed.FeatherMm"), std::string("-1"));
  QCOMPARE(session->GetResultOption(result, "Embed.MarginMm"), std::string("-1"));
  // The background is seen, though it is no data.
  const std::vector<double> real = Voxels(session->GetImage(result), "ValidRegion");
  const std::vector<double> shown = Voxels(session->GetShownImage(result), "ValidRegion");
  const std::vector<double> labels = Voxels(session->GetImage(result), "Embedding");
  QVERIFY(real != shown);
  for (std::size_t i = 0; i < real.size(); ++i)
    QVERIFY((shown[i] != 0.0) == (real[i] != 0.0 || labels[i] == 3.0));
  // The seed alone makes other noise around the same data.
  window.Type(window.Part<QDoubleSpinBox>("Seed"), "7");
  QCOMPARE(Make(window), result);
  QCOMPARE(session->GetResultOption(result, "Embed.Seed"), std::string("7"));
  const std::vector<double> other = Voxels(session->GetImage(result));
  QCOMPARE(other.size(), first.size());
  QVERIFY(other != first);
  // Made again it is what it was, to the bit.
  session->Select(2, true, true);
  session->TranslateSelection(1.0, 0.0, 0.0);
  session->TranslateSelection(-1.0, 0.0, 0.0);
  window.Part<ResultPanel>("resultPanel")->MakeAgain(result);
  QVERIFY(window.Wait());
  QVERIFY(Voxels(session->GetImage(result)) == other);
  // Noise of a file, and the outline of a source; what cannot be read is named, and nothing has changed.
  window.Part<QLineEdit>("embedNoise")->setText("/nowhere/noise.mha");
  const int entries = session->GetUndoCount();
  Make(window);
  QVERIFY2(window.HasMessage("/nowhere/noise.mha"), qPrintable(window.Messages().join('\n')));
  QCOMPARE(session->GetUndoCount(), entries);
  window.Part<QLineEdit>("embedNoise")->clear();
  // These volumes are boxes. Another kind of outline makes another background; that of a source comes before it.
  auto* outline = window.Part<QComboBox>("Outline");
  outline->setFocus();
  QTest::keyClick(outline, Qt::Key_End);
  Make(window);
  QCOMPARE(session->GetResultOption(result, "Embed.Outline"), std::string("curved"));
  const std::vector<double> curved = Voxels(session->GetImage(result));
  QVERIFY(curved != other);
  auto* form = window.Part<QComboBox>("embedForm");
  QCOMPARE(form->count(), 3);
  form->setCurrentIndex(2);
  Make(window);
  QCOMPARE(session->GetResultOption(result, "Form"), std::string("2"));
  QVERIFY(Voxels(session->GetImage(result)) != curved);
}

void TestResults::whatIsMadeDuringADragWaitsForItsEnd()
{
  WindowUnderTest window;
  Open(window);
  auto* session = window.Session();
  window.Part<ResultPanel>("resultPanel")->Make(true);
  session->BeginEdit("a drag");
  QVERIFY(window.Wait());
  QCOMPARE(session->GetNumberOfVolumes(), 2);
  session->Select(2, true, true);
  session->TranslateSelection(5.0, 0.0, 0.0);
  session->EndEdit();
  QVERIFY(QTest::qWaitFor([&] { return session->GetNumberOfVolumes() == 3; }, 5000));
  QCOMPARE(session->GetSourcesChanged(session->GetVolumeId(2)), std::string("right was moved")); // it is of what was there before
}

void TestResults::whatIsMadeOfAnotherProjectIsDiscarded()
{
  const QString project = Folder().filePath("p.json");
  WindowUnderTest window;
  Open(window);
  auto* session = window.Session();
  QVERIFY(window.Window().Files()->SaveTo(project));
  window.Part<ResultPanel>("resultPanel")->Make(true);
  QVERIFY(session->OpenProject(project.toUtf8().constData()));
  QVERIFY(window.Wait());
  QVERIFY2(window.HasMessage("its sources were closed"), qPrintable(window.Messages().join('\n')));
  QCOMPARE(session->GetNumberOfVolumes(), 2);
}

int main(int argc, char** argv)
{
  return WindowTest::Run(argc, argv, [argc, argv] {
    TestResults test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestResults.moc"
