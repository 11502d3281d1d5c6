// SPDX-License-Identifier: BSD-3-Clause
// The workbench as a person uses it: the real window on a screen, real mouse and key events. What is asked is what the session
// then holds, and what the window shows.
#include "AlignmentHandles.h"
#include "FileActions.h"
#include "SliceCanvas.h"
#include "SlicePane.h"
#include "ViewGrid.h"
#include "VolumePane.h"
#include "vtkUltrasoundAlignmentWidget.h"
#include "vtkUltrasoundSliceView.h"
#include "vtkUltrasoundVolumeView.h"
#include "WindowUnderTest.h"
#include "Workbench.h"
#include <csignal>
#include <cstdio>
#include <QApplication>
#include <QDoubleSpinBox>
#include <QLabel>
#include <QListWidget>
#include <QProcess>
#include <QTableView>
#include <QtTest>
#include <QVTKOpenGLNativeWidget.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkRenderer.h>
#include <vtkUltrasoundVolume.h>

using namespace echorama;

namespace {

QByteArray BytesOf(vtkDataArray* array)
{
  return {static_cast<const char*>(array->GetVoidPointer(0)),
          static_cast<int>(array->GetNumberOfValues() * array->GetDataTypeSize())};
}

QByteArray IntensitiesOf(WindowUnderTest& window, int id)
{
  return BytesOf(vtkUltrasoundVolume::GetIntensity(window.Session()->GetImage(id)));
}

int ValidVoxels(WindowUnderTest& window, int id)
{
  return BytesOf(vtkUltrasoundVolume::GetValidRegion(window.Session()->GetImage(id))).count('\1');
}

// How many pixels of a widget are brighter than the background, in percent.
double LitPercent(const QImage& picture, const QWidget* widget, const QWidget* window)
{
  const QRect place(widget->mapTo(window, QPoint(0, 0)), widget->size());
  int lit = 0;
  for (int y = place.top(); y <= place.bottom(); y++)
    for (int x = place.left(); x <= place.right(); x++)
      lit += qGray(picture.pixel(x, y)) > 60;
  return 100.0 * lit / (place.width() * place.height());
}

} // namespace

class TestWorkbench : public WindowTest {
  Q_OBJECT

private slots:
  void opensWhatIsDropped();
  void anUnreadableVolumeIsNamedAndTheOthersOpen();
  void theTableIsTheSelection();
  void aGroupIsSelectedTogether();
  void aDragMovesTheSelectedVolume();
  void aClickChangesNothing();
  void arrowKeysMoveByOneStep();
  void numbersPlaceVolumes();
  void hotKeysChangeWhatSlicesShow();
  void wheelAndMiddleButtonMoveTheSlice();
  void aViewBecomesLargeAndSmallAgain();
  void paintingIsOneEdit();
  void carvingIsOneEdit();
  void aProjectComesBack();
  void aProjectWhoseFilesMovedIsNotLost();
  void aBackupIsOneClickAway();
  void closingAsksOnlyForWork();
  void nothingIsLostWhenTheProgramIsKilled();
  void theLiverPair();
  void whateverHappensIsDrawnCoarselyFirst();
  void escapeTakesAStrokeBack();
  void escapeIsMeantOutsideTheViewToo();
  void aLostReleaseEndsTheDrag();
  void aDoubleClickKeepsTheSelection();
  void stepsAndConstraintsAreThoseOfAllViews();
  void aBatchIsSeenAsAWhole();

private:
  void ExpectDragged(SliceCanvas* slice, const std::array<double, 16>& before, const std::array<double, 16>& after,
                     const QPoint& by);
};

void TestWorkbench::opensWhatIsDropped()
{
  WindowUnderTest window;
  window.Drop({A(), B()});
  QTRY_COMPARE(window.Session()->GetNumberOfVolumes(), 2);
  window.Settle();
  QCOMPARE(window.Part<QTableView>("volumes")->model()->rowCount(), 2);
  QCOMPARE(window.Session()->GetName(1), std::string("left"));
  QVERIFY2(window.Messages().isEmpty(), qPrintable(window.Messages().join('\n')));
  QVERIFY(window.Session()->IsSelected(2));
  const QImage picture = window.Screenshot("two-volumes");
  for (int i = 0; i < 3; i++)
    QVERIFY(LitPercent(picture, window.Slice(i), &window.Window()) > 10.0);
  QVERIFY(LitPercent(picture, window.Window().Views()->Volume()->Canvas(), &window.Window()) > 3.0);
}

void TestWorkbench::anUnreadableVolumeIsNamedAndTheOthersOpen()
{
  QFile bad(Folder().filePath("bad.mha"));
  QVERIFY(bad.open(QIODevice::WriteOnly));
  bad.write("ObjectType = Image\nNDims = 3\nDimSize = 9 9 9\nElementType = MET_UCHAR\nElementDataFile = LOCAL\nshort");
  bad.close();
  WindowUnderTest window;
  QVERIFY(window.Open({bad.fileName(), Folder().filePath("missing.mha"), A()}));
  QCOMPARE(window.Session()->GetNumberOfVolumes(), 1);
  QVERIFY(window.HasMessage("bad.mha"));
  QVERIFY(window.HasMessage("missing.mha"));
  window.Screenshot("unreadable");
}

void TestWorkbench::theTableIsTheSelection()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  auto* table = window.Part<QTableView>("volumes");
  const auto row = [&](int i) { return table->visualRect(table->model()->index(i, 2)).center(); };
  window.Click(table->viewport(), row(0));
  QVERIFY(window.Session()->IsSelected(1) && !window.Session()->IsSelected(2));
  window.Key(Qt::Key_I, Qt::ControlModifier);
  QVERIFY(!window.Session()->IsSelected(1) && window.Session()->IsSelected(2));
  QVERIFY(table->selectionModel()->isRowSelected(1, {}) && !table->selectionModel()->isRowSelected(0, {}));
  window.Key(Qt::Key_A, Qt::ControlModifier);
  QCOMPARE(window.Session()->GetNumberOfSelected(), 2);
  window.Key(Qt::Key_D, Qt::ControlModifier);
  QCOMPARE(window.Session()->GetNumberOfSelected(), 0);
  // The box in front hides a volume; that is an edit.
  const QRect box = table->visualRect(table->model()->index(1, 0));
  QVERIFY(table->model()->setData(table->model()->index(1, 0), Qt::Unchecked, Qt::CheckStateRole));
  QVERIFY(box.isValid() && !window.Session()->GetVisible(2));
  window.Key(Qt::Key_Z, Qt::ControlModifier);
  QVERIFY(window.Session()->GetVisible(2));
}

void TestWorkbench::aGroupIsSelectedTogether()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B(), WriteVolume("third.mha", 3, {0, 9, 4})}));
  window.Session()->Select(1, true, true);
  window.Session()->Select(2);
  window.Key(Qt::Key_G, Qt::ControlModifier);
  QVERIFY(window.Session()->GetGroup(1) > 0);
  auto* table = window.Part<QTableView>("volumes");
  const auto row = [&](int i) { return table->visualRect(table->model()->index(i, 2)).center(); };
  window.Click(table->viewport(), row(2));
  QCOMPARE(window.Session()->GetNumberOfSelected(), 1);
  window.Click(table->viewport(), row(0));
  QVERIFY(window.Session()->IsSelected(1) && window.Session()->IsSelected(2) && !window.Session()->IsSelected(3));
  window.Click(table->viewport(), row(0)); // again: still the group
  QCOMPARE(window.Session()->GetNumberOfSelected(), 2);
}

// A volume follows the mouse by as many millimetres as it went over the slice, to a pixel, and does not turn.
void TestWorkbench::ExpectDragged(SliceCanvas* slice, const std::array<double, 16>& before, const std::array<double, 16>& after,
                                  const QPoint& by)
{
  const double mm = slice->View()->GetMillimetresPerPixel();
  double right[3], up[3];
  slice->View()->GetRight(right);
  slice->View()->GetUp(up);
  for (std::size_t axis = 0; axis < 3; axis++) {
    const double expected = mm * (right[axis] * by.x() - up[axis] * by.y());
    QVERIFY2(
        std::abs(after[4 * axis + 3] - before[4 * axis + 3] - expected) < 1.01 * mm,
        qPrintable(QString("axis %1: %2 mm for %3").arg(axis).arg(after[4 * axis + 3] - before[4 * axis + 3]).arg(expected)));
    for (std::size_t column = 0; column < 3; column++)
      QVERIFY(std::abs(after[4 * axis + column] - before[4 * axis + column]) < 1e-12);
  }
}

void TestWorkbench::aDragMovesTheSelectedVolume()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  SliceCanvas* slice = window.Slice(0);
  const auto before = window.Pose(2), other = window.Pose(1);
  const int entries = window.Session()->GetUndoCount();
  // Off the middle, where the handles of the widget are.
  const QPoint from = slice->rect().center() + QPoint(18, 34), by(30, -20);
  window.Drag(slice, from, from + by);
  QCOMPARE(window.Session()->GetUndoCount(), entries + 1);
  const auto after = window.Pose(2);
  ExpectDragged(slice, before, after, by);
  QCOMPARE(window.Pose(1), other);
  QVERIFY(window.Window().isWindowModified());
  window.Screenshot("dragged");
  window.Key(Qt::Key_Z, Qt::ControlModifier);
  QCOMPARE(window.Pose(2), before);
  window.Key(Qt::Key_Z, Qt::ControlModifier | Qt::ShiftModifier);
  QCOMPARE(window.Pose(2), after);
}

void TestWorkbench::aClickChangesNothing()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  const auto before = window.Pose(2);
  const int entries = window.Session()->GetUndoCount();
  const QPoint at = window.Slice(1)->rect().center() + QPoint(25, 31);
  window.Press(window.Slice(1), at);
  window.Release(window.Slice(1), at);
  window.Settle();
  QCOMPARE(window.Session()->GetUndoCount(), entries);
  QCOMPARE(window.Pose(2), before);
}

void TestWorkbench::arrowKeysMoveByOneStep()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  window.Type(window.Part<QDoubleSpinBox>("translationStep"), "0.5");
  window.Slice(0)->setFocus();
  window.Move(window.Slice(0), window.Slice(0)->rect().center());
  const auto before = window.Pose(2);
  window.Key(Qt::Key_Right);
  double right[3];
  window.Slice(0)->View()->GetRight(right);
  const auto after = window.Pose(2);
  for (std::size_t axis = 0; axis < 3; axis++)
    QVERIFY(std::abs(after[4 * axis + 3] - before[4 * axis + 3] - 0.5 * right[axis]) < 1e-9);
  window.Key(Qt::Key_Z, Qt::ControlModifier);
  QCOMPARE(window.Pose(2), before);
}

void TestWorkbench::numbersPlaceVolumes()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  double middle[3], degrees[3];
  window.Session()->GetPlacement(2, middle, degrees);
  const double y = middle[1];
  window.Type(window.Part<QDoubleSpinBox>("middleX"), "25.5");
  window.Session()->GetPlacement(2, middle, degrees);
  QVERIFY(std::abs(middle[0] - 25.5) < 1e-9 && middle[1] == y);
  window.Type(window.Part<QDoubleSpinBox>("degreesZ"), "-30");
  window.Session()->GetPlacement(2, middle, degrees);
  QVERIFY(std::abs(degrees[2] + 30.0) < 1e-9 && std::abs(middle[0] - 25.5) < 1e-9);
  // With both selected the other makes the same motion.
  const auto other = window.Pose(1);
  window.Session()->SelectAll();
  const int entries = window.Session()->GetUndoCount();
  double first[3];
  window.Session()->GetPlacement(1, first, degrees);
  window.Type(window.Part<QDoubleSpinBox>("middleZ"), QString::number(first[2] + 7.0));
  QCOMPARE(window.Session()->GetUndoCount(), entries + 1);
  QVERIFY(std::abs(window.Pose(1)[11] - other[11] - 7.0) < 1e-9);
  double second[3];
  window.Session()->GetPlacement(2, second, degrees);
  QVERIFY(std::abs(second[2] - middle[2] - 7.0) < 1e-9);
  window.Session()->Undo();
  QCOMPARE(window.Pose(1), other);
}

void TestWorkbench::hotKeysChangeWhatSlicesShow()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  vtkUltrasoundSliceView* view = window.Slice(0)->View();
  window.Slice(0)->setFocus();
  window.Key(Qt::Key_S);
  QCOMPARE(view->GetShown(), std::string("selected"));
  window.Key(Qt::Key_Space);
  QCOMPARE(view->GetShown(), std::string("others"));
  window.Key(Qt::Key_Space);
  QCOMPARE(view->GetShown(), std::string("selected"));
  window.Key(Qt::Key_O);
  QCOMPARE(view->GetShown(), std::string("others"));
  window.Key(Qt::Key_A);
  QCOMPARE(view->GetShown(), std::string("all"));
  window.Key(Qt::Key_D);
  QCOMPARE(view->GetMode(), std::string("difference"));
  window.Screenshot("difference");
  window.Key(Qt::Key_K);
  QCOMPARE(view->GetMode(), std::string("checkerboard"));
  window.Screenshot("checkerboard");
  window.Key(Qt::Key_B);
  QCOMPARE(view->GetMode(), std::string("blend"));
  window.Key(Qt::Key_N);
  QVERIFY(!view->GetLinear());
  window.Key(Qt::Key_N);
  QVERIFY(view->GetLinear());
  window.Key(Qt::Key_3);
  QVERIFY(window.Window().Bench()->CurrentTool() == Tool::Paint);
  window.Key(Qt::Key_2);
  QVERIFY(window.Window().Bench()->CurrentTool() == Tool::Align);
  window.Move(window.Slice(1), window.Slice(1)->rect().center());
  QCOMPARE(window.Slice(1)->View()->GetAxis(), std::string("y"));
  window.Key(Qt::Key_V);
  QCOMPARE(window.Slice(1)->View()->GetAxis(), std::string("x"));
}

void TestWorkbench::wheelAndMiddleButtonMoveTheSlice()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A()}));
  vtkUltrasoundSliceView* view = window.Slice(0)->View();
  const double position = view->GetPosition(), mm = view->GetMillimetresPerPixel();
  window.Wheel(window.Slice(0), 2);
  QVERIFY(std::abs(view->GetPosition() - position - 2.0) < 1e-6); // voxels of 1 mm
  window.Wheel(window.Slice(0), 1, Qt::ControlModifier);
  QVERIFY(view->GetMillimetresPerPixel() < 0.95 * mm);
  double focus[3], panned[3];
  view->GetFocus(focus);
  const QPoint centre = window.Slice(0)->rect().center();
  window.Drag(window.Slice(0), centre, centre + QPoint(40, 0), Qt::MiddleButton);
  view->GetFocus(panned);
  QVERIFY(std::abs(std::abs(panned[0] - focus[0]) - 40.0 * view->GetMillimetresPerPixel()) < 1e-6);
  double grey[2], changed[2];
  window.Session()->GetGreyWindow(grey);
  window.Drag(window.Slice(0), centre, centre + QPoint(50, 0), Qt::RightButton);
  window.Session()->GetGreyWindow(changed);
  QVERIFY(changed[1] - changed[0] > 1.1 * (grey[1] - grey[0]));
  window.Session()->GetGreyWindow(grey);
  window.Drag(window.Slice(0), centre, centre - QPoint(0, 50), Qt::RightButton); // up: brighter
  window.Session()->GetGreyWindow(changed);
  QVERIFY(changed[0] + changed[1] < grey[0] + grey[1]);
  QVERIFY(std::abs((changed[1] - changed[0]) - (grey[1] - grey[0])) < 1e-6);
  const double before = view->GetPosition();
  window.Wheel(window.Slice(0), 1, Qt::ShiftModifier);
  QVERIFY(std::abs(view->GetPosition() - before - 10.0) < 1e-6);
  // Look: a click takes the other slices there.
  window.Key(Qt::Key_1);
  window.Click(window.Slice(0), centre + QPoint(30, 10));
  double point[3];
  const QPointF pixel = window.Slice(0)->PixelOf(centre + QPoint(30, 10));
  view->PixelToWorld(pixel.x(), pixel.y(), point);
  QVERIFY(std::abs(window.Slice(2)->View()->GetPosition() - point[0]) < 1.0);
}

void TestWorkbench::aViewBecomesLargeAndSmallAgain()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A()}));
  const int width = window.Slice(1)->width();
  QTest::mouseDClick(window.Slice(1), Qt::LeftButton, {}, {40, 40});
  window.Settle();
  QVERIFY(window.Slice(1)->width() > 1.7 * width && !window.Slice(0)->isVisible());
  window.Screenshot("large-slice");
  window.Key(Qt::Key_M);
  QVERIFY(window.Slice(0)->isVisible() && window.Slice(2)->isVisible());
  for (const bool large : {true, false}) {
    QTest::mouseDClick(window.Slice(1), Qt::LeftButton, {}, {40, 40});
    window.Settle();
    QCOMPARE(window.Slice(0)->isVisible(), !large);
  }
}

void TestWorkbench::paintingIsOneEdit()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  window.Slice(0)->setFocus();
  window.Key(Qt::Key_3);
  QVERIFY(window.Window().Bench()->CurrentTool() == Tool::Paint);
  const QByteArray before = IntensitiesOf(window, 2), other = IntensitiesOf(window, 1);
  const int entries = window.Session()->GetUndoCount(), valid = ValidVoxels(window, 2);
  const QPoint centre = window.Slice(0)->rect().center();
  window.Drag(window.Slice(0), centre - QPoint(40, 10), centre + QPoint(40, 10));
  QCOMPARE(window.Session()->GetUndoCount(), entries + 1);
  QVERIFY(IntensitiesOf(window, 2) != before);
  QCOMPARE(IntensitiesOf(window, 1), other);
  QCOMPARE(ValidVoxels(window, 2), valid); // kept inside the data
  window.Screenshot("painted");
  window.Key(Qt::Key_Z, Qt::ControlModifier);
  QCOMPARE(IntensitiesOf(window, 2), before);
  // Nothing selected: a hint, and no edit.
  window.Session()->SelectNone();
  window.Drag(window.Slice(0), centre, centre + QPoint(10, 10));
  QVERIFY(window.HasMessage("Select the one volume"));
  QCOMPARE(window.Session()->GetUndoCount(), entries);
}

void TestWorkbench::carvingIsOneEdit()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A()}));
  window.Slice(0)->setFocus();
  window.Key(Qt::Key_4);
  const QByteArray before = IntensitiesOf(window, 1);
  const int valid = ValidVoxels(window, 1), entries = window.Session()->GetUndoCount();
  const QPoint centre = window.Slice(0)->rect().center();
  window.Type(window.Part<QDoubleSpinBox>("brushRadius"), "6");
  window.Drag(window.Slice(0), centre - QPoint(30, 30), centre + QPoint(30, 30));
  QVERIFY(ValidVoxels(window, 1) < valid - 500);
  QCOMPARE(IntensitiesOf(window, 1), before);
  QCOMPARE(window.Session()->GetUndoCount(), entries + 1);
  window.Screenshot("carved");
  // Restore brings all of it back.
  window.Slice(0)->setFocus();
  window.Key(Qt::Key_5);
  window.Type(window.Part<QDoubleSpinBox>("brushRadius"), "9");
  window.Drag(window.Slice(0), centre - QPoint(30, 30), centre + QPoint(30, 30));
  QCOMPARE(ValidVoxels(window, 1), valid);
  window.Session()->Undo();
  window.Session()->Undo();
  QCOMPARE(ValidVoxels(window, 1), valid);
}

void TestWorkbench::aProjectComesBack()
{
  const QString project = Folder().filePath("pair.json");
  std::array<double, 16> pose{};
  QByteArray painted;
  {
    WindowUnderTest window;
    QVERIFY(window.Open({A(), B()}));
    window.Session()->SetPlacement(2, 10, -3, 5, 10, 20, 30);
    window.Slice(0)->setFocus();
    window.Key(Qt::Key_3);
    const QPoint centre = window.Slice(0)->rect().center();
    window.Drag(window.Slice(0), centre, centre + QPoint(20, 5));
    QVERIFY(window.Window().isWindowModified());
    QVERIFY(window.Window().Files()->SaveTo(project));
    QVERIFY(!window.Window().isWindowModified());
    QVERIFY(window.Window().windowTitle().contains("pair.json"));
    pose = window.Pose(2);
    painted = IntensitiesOf(window, 2);
  }
  WindowUnderTest window;
  QVERIFY(window.Open({project}));
  QVERIFY2(window.Messages().isEmpty(), qPrintable(window.Messages().join('\n')));
  QCOMPARE(window.Session()->GetNumberOfVolumes(), 2);
  const int second = window.Session()->GetVolumeId(1);
  QCOMPARE(window.Pose(second), pose);
  QCOMPARE(IntensitiesOf(window, second), painted);
  QVERIFY(!window.Window().isWindowModified());
  QCOMPARE(window.Session()->GetProjectPath(), project.toStdString());
}

void TestWorkbench::aProjectWhoseFilesMovedIsNotLost()
{
  const QString project = Folder().filePath("pair.json");
  {
    WindowUnderTest window;
    QVERIFY(window.Open({A(), B()}));
    QVERIFY(window.Window().Files()->SaveTo(project));
  }
  QVERIFY(Folder().mkpath("away"));
  QVERIFY(QFile::rename(Folder().filePath("right.mha"), Folder().filePath("away/right.mha")));
  WindowUnderTest window;
  QVERIFY(window.Open({project}));
  QCOMPARE(window.Session()->GetNumberOfVolumes(), 0);
  QVERIFY2(window.HasMessage("right.mha"), qPrintable(window.Messages().join('\n')));
  QVERIFY(window.HasMessage("have moved"));
  window.Screenshot("moved-files");
  window.Session()->AddSearchFolder(Folder().filePath("away").toUtf8().constData());
  QVERIFY(window.Open({project}));
  QCOMPARE(window.Session()->GetNumberOfVolumes(), 2);
}

void TestWorkbench::aBackupIsOneClickAway()
{
  WindowUnderTest window;
  window.Window().Start({}, {A(), B()});
  QTRY_COMPARE(window.Session()->GetNumberOfVolumes(), 2);
  window.Session()->TranslateSelection(5, 0, 0);
  const auto moved = window.Pose(2);
  QVERIFY(window.Session()->BackUp());
  QTest::qWait(1100); // edits within a second may share a backup
  window.Session()->RotateSelection(0, 0, 90);
  QVERIFY(window.Session()->BackUp());
  const auto turned = window.Pose(2);
  auto* panel = window.Part<QWidget>("historyPanelDock");
  panel->raise();
  auto* list = window.Part<QListWidget>("backups");
  QTRY_VERIFY(list->isVisible() && list->count() >= 2);
  window.Screenshot("backups");
  int row = -1;
  for (int i = 1; i < list->count() && row < 0; i++)
    if (list->item(i)->flags().testFlag(Qt::ItemIsEnabled))
      row = i;
  QVERIFY(row > 0);
  list->scrollToItem(list->item(row));
  window.Click(list->viewport(), list->visualItemRect(list->item(row)).center());
  QTRY_COMPARE(window.Pose(2), moved);
  window.Key(Qt::Key_Z, Qt::ControlModifier);
  QCOMPARE(window.Pose(2), turned);
}

void TestWorkbench::closingAsksOnlyForWork()
{
  {
    WindowUnderTest window;
    QVERIFY(window.Open({A()}));
    window.Window().close();
    QVERIFY(!window.Window().isVisible()); // opening alone is not work
  }
  WindowUnderTest window;
  QVERIFY(window.Open({A()}));
  window.Session()->SelectAll();
  window.Session()->TranslateSelection(1, 0, 0);
  window.Window().close();
  QVERIFY(window.Window().isVisible());
  QVERIFY(window.HasMessage("Save what you did"));
  window.Screenshot("closing");
  QVERIFY(window.Answer("Cancel"));
  QVERIFY(window.Window().isVisible() && window.Messages().isEmpty());
  window.Window().close();
  QVERIFY(window.Answer("Do not save"));
  QTRY_VERIFY(!window.Window().isVisible());
}

// A child drags a volume on and on and says where it is; it is killed in the middle of it. What is offered afterwards is at most
// a second older than what it said last.
void TestWorkbench::nothingIsLostWhenTheProgramIsKilled()
{
  QProcess child;
  child.start(QCoreApplication::applicationFilePath(), {"--drag-until-killed", A(), B()});
  QVERIFY(child.waitForStarted());
  QStringList said;
  QElapsedTimer clock;
  clock.start();
  while (clock.elapsed() < 60000 && said.size() < 40) {
    child.waitForReadyRead(1000);
    while (child.canReadLine())
      said.append(QString::fromUtf8(child.readLine()).trimmed());
  }
  ::kill(static_cast<pid_t>(child.processId()), SIGKILL);
  child.waitForFinished();
  while (child.canReadLine())
    said.append(QString::fromUtf8(child.readLine()).trimmed());
  QVERIFY2(said.size() >= 40, "the child did not drag");
  const QStringList last = said.last().split(' ');
  const double lastTime = last[0].toDouble();

  WindowUnderTest window;
  window.Window().Start({}, {});
  QVERIFY2(window.HasMessage("without being saved"), qPrintable(window.Messages().join('\n')));
  window.Screenshot("recovery");
  QVERIFY(window.Answer("Open it"));
  QTRY_COMPARE(window.Session()->GetNumberOfVolumes(), 2);
  double middle[3], degrees[3];
  window.Session()->GetPlacement(window.Session()->GetVolumeId(1), middle, degrees);
  double keptTime = -1.0;
  for (const QString& line : said)
    if (const QStringList fields = line.split(' '); std::abs(fields.value(1).toDouble() - middle[0]) < 1e-6)
      keptTime = fields[0].toDouble();
  QVERIFY2(keptTime >= 0.0, qPrintable(QString("%1 mm was never said").arg(middle[0])));
  QVERIFY2(lastTime - keptTime <= 1.0, qPrintable(QString("%1 s are lost").arg(lastTime - keptTime)));
}

void TestWorkbench::theLiverPair()
{
  const QDir data(ECHORAMA_SOURCE_DIR "/../shared/data/liver");
  if (!data.exists("liver_volume_A.mha"))
    QSKIP("the liver pair is not there");
  WindowUnderTest window;
  QVERIFY(window.Open({data.filePath("liver_volume_A.mha"), data.filePath("liver_volume_B.mha")}));
  QCOMPARE(window.Session()->GetNumberOfVolumes(), 2);
  QVERIFY2(window.Messages().isEmpty(), qPrintable(window.Messages().join('\n')));
  window.Screenshot("liver");
  window.Slice(0)->setFocus();
  window.Key(Qt::Key_D);
  window.Screenshot("liver-difference");
  window.Key(Qt::Key_K);
  window.Screenshot("liver-checkerboard");
  window.Key(Qt::Key_B);
  const QPoint from = window.Slice(0)->rect().center() - QPoint(40, 30); // in B, off the handles
  const int entries = window.Session()->GetUndoCount();
  const auto before = window.Pose(2), other = window.Pose(1);
  window.Drag(window.Slice(0), from, from + QPoint(25, 10));
  QCOMPARE(window.Session()->GetUndoCount(), entries + 1);
  ExpectDragged(window.Slice(0), before, window.Pose(2), QPoint(25, 10));
  QCOMPARE(window.Pose(1), other);
  window.Screenshot("liver-dragged");
}

void TestWorkbench::whateverHappensIsDrawnCoarselyFirst()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  vtkUltrasoundVolumeView* view = window.Window().Views()->Volume()->View();
  QTRY_VERIFY(!view->GetInteractive()); // small volumes are drawn in full everywhere
  window.Window().Views()->Volume()->Ask();
  QVERIFY(view->GetInteractive());
  QTRY_VERIFY(!view->GetInteractive());
  // A drag that begins when the fine picture is about to come, and that rests.
  SliceCanvas* slice = window.Slice(0);
  window.Wheel(slice, 1);
  QTest::qWait(200);
  const QPoint from = slice->rect().center() + QPoint(18, 34);
  window.Press(slice, from);
  window.Move(slice, from + QPoint(20, 0));
  QTest::qWait(600);
  QVERIFY(view->GetInteractive());
  window.Release(slice, from + QPoint(20, 0));
  QTRY_VERIFY(!view->GetInteractive());
  QCOMPARE(view->GetDetailLevel(), 0);
}

void TestWorkbench::escapeTakesAStrokeBack()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  SliceCanvas* slice = window.Slice(0);
  slice->setFocus();
  window.Key(Qt::Key_3);
  const QByteArray before = IntensitiesOf(window, 2);
  const int entries = window.Session()->GetUndoCount();
  const QPoint centre = slice->rect().center();
  window.Press(slice, centre - QPoint(30, 0));
  window.Move(slice, centre);
  window.Settle();
  QVERIFY(IntensitiesOf(window, 2) != before);
  window.Key(Qt::Key_Escape);
  QCOMPARE(IntensitiesOf(window, 2), before);
  window.Move(slice, centre + QPoint(20, 0));
  window.Release(slice, centre + QPoint(20, 0));
  window.Settle();
  QCOMPARE(IntensitiesOf(window, 2), before);
  QCOMPARE(window.Session()->GetUndoCount(), entries);
  QVERIFY(!window.Window().Bench()->Interacting());
}

void TestWorkbench::escapeIsMeantOutsideTheViewToo()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  SliceCanvas* slice = window.Slice(0);
  slice->setFocus();
  const auto before = window.Pose(2);
  const QPoint from = slice->rect().center() + QPoint(18, 34), outside(-30, 60);
  window.Press(slice, from);
  window.Move(slice, from + QPoint(20, 0));
  window.Move(slice, outside);
  QVERIFY(window.Pose(2) != before);
  QTest::keyClick(slice, Qt::Key_Escape);
  QCOMPARE(window.Pose(2), before);
  window.Release(slice, outside);
  QCOMPARE(window.Pose(2), before);
}

void TestWorkbench::aLostReleaseEndsTheDrag()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  SliceCanvas* slice = window.Slice(0);
  const int entries = window.Session()->GetUndoCount();
  const QPoint from = slice->rect().center() + QPoint(18, 34);
  for (int i = 0; i < 2; i++) {
    window.Press(slice, from);
    window.Move(slice, from + QPoint(20, 0));
    QVERIFY(window.Window().Bench()->Interacting());
    if (i == 0) {
      QEvent blocked(QEvent::WindowBlocked); // a question came up
      QApplication::sendEvent(slice, &blocked);
    } else {
      const QPointF at = from;
      QMouseEvent moved(QEvent::MouseMove, at, at, slice->mapToGlobal(from), Qt::NoButton, Qt::NoButton, Qt::NoModifier);
      QApplication::sendEvent(slice, &moved);
    }
    QVERIFY(!window.Window().Bench()->Interacting());
    const auto pose = window.Pose(2);
    window.Move(slice, from + QPoint(40, 0));
    QCOMPARE(window.Pose(2), pose);
    window.Release(slice, from + QPoint(40, 0));
    QCOMPARE(window.Session()->GetUndoCount(), entries + 1 + i);
  }
}

void TestWorkbench::aDoubleClickKeepsTheSelection()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  SliceCanvas* slice = window.Slice(1);
  const int selected = window.Window().Bench()->ActiveVolume();
  const QPoint at = slice->rect().center() + QPoint(25, 31);
  window.Move(slice, at);
  QTest::mouseDClick(window.Window().windowHandle(), Qt::LeftButton, {}, slice->mapTo(&window.Window(), at));
  window.Settle();
  QVERIFY(!window.Slice(0)->isVisible()); // it was a double click
  QCOMPARE(window.Session()->GetNumberOfSelected(), 1);
  QCOMPARE(window.Window().Bench()->ActiveVolume(), selected);
}

void TestWorkbench::stepsAndConstraintsAreThoseOfAllViews()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  SliceCanvas* slice = window.Slice(0);
  auto* step = window.Part<QDoubleSpinBox>("translationStep");
  vtkUltrasoundAlignmentWidget* other = window.Window().Views()->Volume()->Handles()->Widget();
  slice->setFocus();
  window.Move(slice, slice->rect().center());
  const double before = step->value();
  window.Key(Qt::Key_Plus);
  QCOMPARE(step->value(), 2.0 * before);
  QCOMPARE(other->GetTranslationStep(), 2.0 * before);
  window.Key(Qt::Key_X);
  QCOMPARE(std::string(other->GetConstraint()), std::string("x"));
  window.Screenshot("constraint");
  window.Key(Qt::Key_X);
  window.Key(Qt::Key_X);
  QCOMPARE(std::string(other->GetConstraint()), std::string("free"));
  window.Key(Qt::Key_Minus);
  QCOMPARE(step->value(), before);
}

void TestWorkbench::aBatchIsSeenAsAWhole()
{
  WindowUnderTest window;
  const double far = 90.0;
  QVERIFY(window.Open({A(), WriteVolume("far.mha", 3, {far, 0, 0})}));
  QTest::qWait(100);
  double pixel[2];
  SliceCanvas* slice = window.Slice(0);
  slice->View()->WorldToPixel(far + 20.0, 0.0, 0.0, pixel);
  QVERIFY(pixel[0] > 0 && pixel[0] < slice->width());
  vtkRenderer* renderer = window.Window().Views()->Volume()->View()->GetRenderer();
  for (const double x : {-20.0, far + 20.0}) {
    renderer->SetWorldPoint(x, 0.0, 0.0, 1.0);
    renderer->WorldToDisplay();
    const double* at = renderer->GetDisplayPoint();
    QVERIFY(renderer->IsInViewport(static_cast<int>(at[0]), static_cast<int>(at[1])));
  }
  window.Screenshot("batch");
}

// The child of nothingIsLostWhenTheProgramIsKilled: says "seconds x" at each step of a drag that never ends.
static int DragUntilKilled(const QStringList& files)
{
  WindowUnderTest window;
  window.Window().Start({}, files);
  if (!QTest::qWaitFor([&] { return window.Session()->GetNumberOfVolumes() == 2; }, 30000))
    return 1;
  window.Settle();
  SliceCanvas* slice = window.Slice(0);
  const QPoint from = slice->rect().center() + QPoint(18, 34);
  QElapsedTimer clock;
  clock.start();
  window.Press(slice, from);
  for (int i = 0;; i++) {
    window.Move(slice, from + QPoint(i % 60, (i / 60) % 40));
    double middle[3], degrees[3];
    window.Session()->GetPlacement(2, middle, degrees);
    std::printf("%.3f %.9f\n", 0.001 * static_cast<double>(clock.elapsed()), middle[0]);
    std::fflush(stdout);
    QTest::qWait(50);
  }
}

int main(int argc, char** argv)
{
  return WindowTest::Run(argc, argv, [argc, argv] {
    const QStringList arguments = QApplication::arguments();
    if (arguments.value(1) == "--drag-until-killed")
      return DragUntilKilled(arguments.mid(2));
    TestWorkbench test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestWorkbench.moc"
