// SPDX-License-Identifier: BSD-3-Clause
// Where keys go after real clicks; and opening, leaving and coming back to work. No test here gives the focus to anything by
// itself.
#include "Core/Base/Error.h"
#include "Core/Base/Memory.h"
#include "FileActions.h"
#include "Job.h"
#include "JobBar.h"
#include "SliceCanvas.h"
#include "VolumePane.h"
#include "vtkUltrasoundSliceView.h"
#include "WindowUnderTest.h"
#include "Workbench.h"
#include <atomic>
#include <cmath>
#include <memory>
#include <QApplication>
#include <QComboBox>
#include <QDockWidget>
#include <QDoubleSpinBox>
#include <QLineEdit>
#include <QListWidget>
#include <QPushButton>
#include <QTableView>
#include <QThread>
#include <QtTest>
#include <QVTKOpenGLNativeWidget.h>
#include <vtkImageData.h>

using namespace echorama;

class TestFiles : public WindowTest {
  Q_OBJECT

private slots:
  void keysMoveVolumesAfterAClickInTheTable();
  void keysAreShortcutsAfterANumber();
  void keysMoveVolumesAfterAButton();
  void aNameIsTypedAfterADoubleClick();
  void theWheelChangesNoFieldInPassing();
  void spacePressesTheButtonOfTheFocus();
  void returnAnswers();
  void everyFileThatCannotBeReadIsNamed();
  void aVolumeTooLargeForTheMemoryIsShownCoarsely();
  void volumesWaitForTheEndOfADrag();
  void posesComeAfterTheirVolumes();
  void volumesComeAfterTheirProject();
  void anyEditIsWork();
  void closingWaitsForWorkThatRuns();
  void laterWorkOnAProjectIsOffered();
  void whatWasNotSavedOnPurposeIsNotOffered();
  void severalSessionsAreOffered();

private:
};

namespace {

// A click in the window, as a person makes it: the focus goes where Qt takes it.
void ClickInWindow(WindowUnderTest& window, QWidget* widget, const QPoint& at)
{
  QTest::mouseClick(window.Window().windowHandle(), Qt::LeftButton, {}, widget->mapTo(&window.Window(), at));
  window.Settle();
}

// How far an arrow to the right moves a volume in the first slice, mm.
double ArrowMoves(WindowUnderTest& window, int id)
{
  const auto before = window.Pose(id);
  window.Move(window.Slice(0), window.Slice(0)->rect().center() + QPoint(5, 50));
  window.Key(Qt::Key_Right);
  const auto after = window.Pose(id);
  return std::hypot(after[3] - before[3], after[7] - before[7], after[11] - before[11]);
}

} // namespace

void TestFiles::keysMoveVolumesAfterAClickInTheTable()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  auto* table = window.Part<QTableView>("volumes");
  ClickInWindow(window, table->viewport(), table->visualRect(table->model()->index(0, 2)).center());
  QVERIFY(window.Session()->IsSelected(1) && !window.Session()->IsSelected(2));
  QVERIFY(std::abs(ArrowMoves(window, 1) - 1.0) < 1e-9);
  QVERIFY(window.Session()->IsSelected(1) && !window.Session()->IsSelected(2));
  for (Qt::Key key : {Qt::Key_X, Qt::Key_Z, Qt::Key_Plus})
    window.Key(key);
  QVERIFY(!table->findChild<QLineEdit*>());
}

void TestFiles::keysAreShortcutsAfterANumber()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  const auto before = window.Pose(2);
  auto* field = window.Part<QDoubleSpinBox>("middleX");
  ClickInWindow(window, field, field->rect().center());
  QVERIFY(field->hasFocus());
  window.Key(Qt::Key_A, Qt::ControlModifier);
  QTest::keyClicks(field, "31");
  window.Key(Qt::Key_Return);
  QVERIFY(window.Pose(2) != before);
  window.Key(Qt::Key_3);
  QVERIFY(window.Window().Bench()->CurrentTool() == Tool::Paint);
  window.Key(Qt::Key_2);
  window.Key(Qt::Key_Z, Qt::ControlModifier);
  QCOMPARE(window.Pose(2), before);
}

void TestFiles::keysMoveVolumesAfterAButton()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  for (const char* name : {"selectNone", "selectAll"}) {
    auto* button = window.Part<QPushButton>(name);
    ClickInWindow(window, button, button->rect().center());
  }
  QCOMPARE(window.Session()->GetNumberOfSelected(), 2);
  QVERIFY(std::abs(ArrowMoves(window, 1) - 1.0) < 1e-9);
}

void TestFiles::aNameIsTypedAfterADoubleClick()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  auto* table = window.Part<QTableView>("volumes");
  const QPoint at = table->visualRect(table->model()->index(0, 2)).center();
  ClickInWindow(window, table->viewport(), at);
  QTest::mouseDClick(window.Window().windowHandle(), Qt::LeftButton, {}, table->viewport()->mapTo(&window.Window(), at));
  window.Settle();
  auto* editor = qobject_cast<QLineEdit*>(QApplication::focusWidget());
  QVERIFY(editor);
  QTest::keyClicks(editor, "before d");
  window.Key(Qt::Key_Return);
  QCOMPARE(window.Session()->GetName(1), std::string("before d"));
  QCOMPARE(window.Slice(0)->View()->GetMode(), std::string("blend"));
  QVERIFY(std::abs(ArrowMoves(window, 1) - 1.0) < 1e-9);
}

void TestFiles::theWheelChangesNoFieldInPassing()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A()}));
  auto* field = window.Part<QDoubleSpinBox>("translationStep");
  const double value = field->value();
  window.Wheel(field, 1);
  QCOMPARE(field->value(), value);
  for (auto* choice : window.Window().findChildren<QComboBox*>()) {
    const int chosen = choice->currentIndex();
    window.Wheel(choice, -1);
    QCOMPARE(choice->currentIndex(), chosen);
  }
  ClickInWindow(window, field, field->rect().center());
  window.Wheel(field, 1);
  QVERIFY(field->value() > value);
}

void TestFiles::spacePressesTheButtonOfTheFocus()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  const std::string shown = window.Slice(0)->View()->GetShown();
  for (int i = 0; i < 100 && QApplication::focusWidget() != window.Part<QPushButton>("selectAll"); i++)
    window.Key(Qt::Key_Tab);
  QVERIFY(window.Part<QPushButton>("selectAll")->hasFocus());
  window.Key(Qt::Key_Space);
  QCOMPARE(window.Session()->GetNumberOfSelected(), 2);
  QCOMPARE(window.Slice(0)->View()->GetShown(), shown);
}

void TestFiles::returnAnswers()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  int answers = 0;
  for (Qt::Key key : {Qt::Key_Return, Qt::Key_Space}) {
    window.Window().Bench()->Ask(QString("Now, by %1?").arg(key), {{"Yes", [&answers] { answers++; }}, {"No", {}}});
    window.Settle();
    window.Key(key);
  }
  QCOMPARE(answers, 2);
  QVERIFY(window.Messages().isEmpty());
  QVERIFY(std::abs(ArrowMoves(window, 2) - 1.0) < 1e-9);
}

void TestFiles::everyFileThatCannotBeReadIsNamed()
{
  QStringList files;
  for (int i = 0; i < 8; i++)
    files.append(Folder().filePath(QString("missing%1.mha").arg(i)));
  WindowUnderTest window;
  QVERIFY(window.Open(files + QStringList(A())));
  QCOMPARE(window.Session()->GetNumberOfVolumes(), 1);
  for (int i = 0; i < 8; i++)
    QVERIFY(window.HasMessage(QString("missing%1.mha").arg(i)));
  window.Screenshot("eight-missing");
}

void TestFiles::aVolumeTooLargeForTheMemoryIsShownCoarsely()
{
  // A third of the free memory with its valid region, but hardly anything on the disk.
  const auto slices = static_cast<qint64>(FreeMemory() / 6e6) + 150;
  QFile header(Folder().filePath("large.mhd")), voxels(Folder().filePath("large.raw"));
  QVERIFY(header.open(QIODevice::WriteOnly) && voxels.open(QIODevice::WriteOnly));
  header.write(QString("NDims = 3\nDimSize = 1000 1000 %1\nElementSpacing = 0.2 0.2 0.2\nElementType = MET_UCHAR\n"
                       "ElementDataFile = large.raw\n")
                   .arg(slices)
                   .toUtf8());
  voxels.write(QByteArray(1000 * 1000, 100));
  QVERIFY(voxels.resize(1000000 * slices));
  header.close();
  voxels.close();
  const QString project = Folder().filePath("large.json");
  for (const QString& file : {header.fileName(), project}) {
    WindowUnderTest window;
    QVERIFY(window.Open({file}));
    QVERIFY2(window.HasMessage("large.mhd is large: one of"), qPrintable(window.Messages().join('\n')));
    vtkImageData* image = window.Session()->GetImage(1);
    const double stride = image->GetSpacing()[0] / 0.2;
    QVERIFY(stride > 1.5 && image->GetNumberOfPoints() <= 128000000);
    QCOMPARE(image->GetDimensions()[2], static_cast<int>((slices - 1) / std::lround(stride)) + 1);
    QVERIFY(window.Session()->SaveProject(project.toUtf8().constData()));
    window.Screenshot("large");
  }
}

void TestFiles::volumesWaitForTheEndOfADrag()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A()}));
  auto* session = window.Session();
  session->BeginEdit("a drag");
  QVERIFY(window.Open({B()}));
  QCOMPARE(session->GetNumberOfVolumes(), 1);
  session->CancelEdit();
  QTRY_COMPARE(session->GetNumberOfVolumes(), 2);
}

void TestFiles::posesComeAfterTheirVolumes()
{
  const QString poses = Folder().filePath("poses.json");
  std::array<double, 16> pose{};
  {
    WindowUnderTest window;
    QVERIFY(window.Open({A(), B()}));
    window.Session()->SetPlacement(2, 10, -3, 5, 10, 20, 30);
    QVERIFY(window.Session()->WritePoses(poses.toUtf8().constData()));
    pose = window.Pose(2);
  }
  WindowUnderTest window;
  window.Drop({poses, A(), B()});
  QTRY_COMPARE(window.Session()->GetNumberOfVolumes(), 2);
  window.Settle();
  QVERIFY2(window.Messages().isEmpty(), qPrintable(window.Messages().join('\n')));
  for (std::size_t i = 0; i < pose.size(); i++)
    QVERIFY(std::abs(window.Pose(2)[i] - pose[i]) < 1e-9);
}

void TestFiles::volumesComeAfterTheirProject()
{
  const QString project = Folder().filePath("pair.json");
  {
    WindowUnderTest window;
    QVERIFY(window.Open({A(), B()}));
    QVERIFY(window.Window().Files()->SaveTo(project));
  }
  const QString third = WriteVolume("third.mha", 3, {0, 9, 4});
  WindowUnderTest window;
  window.Drop({third, project});
  QTRY_COMPARE(window.Session()->GetNumberOfVolumes(), 3);
  QCOMPARE(window.Session()->GetProjectPath(), project.toStdString());
  QVERIFY2(window.Messages().isEmpty(), qPrintable(window.Messages().join('\n')));
}

void TestFiles::anyEditIsWork()
{
  using Edit = std::function<bool(vtkUltrasoundAlignmentSession*)>;
  const Edit edits[] = {[](auto* session) { return session->SetName(1, "liver"); },
                        [](auto* session) { return session->SetColour(1, 0.1, 0.2, 0.3); },
                        [](auto* session) { return session->SetOpacity(1, 0.5); },
                        [](auto* session) { return session->SetVisible(1, false); },
                        [](auto* session) { return session->RemoveVolume(1); }};
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  for (const Edit& edit : edits) {
    QVERIFY(!window.Window().Files()->HasUnsavedWork());
    QVERIFY(edit(window.Session()));
    QVERIFY(window.Window().Files()->HasUnsavedWork());
    QVERIFY(window.Session()->Undo());
  }
}

void TestFiles::closingWaitsForWorkThatRuns()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A()}));
  const auto goesOn = std::make_shared<std::atomic<bool>>(true);
  const auto start = [&window, goesOn](bool fails) {
    *goesOn = true;
    window.Window().Jobs()->Watch(Job::Start(
        &window.Window(), "Something long",
        [goesOn, fails](const Progress& progress) {
          while (*goesOn) {
            progress(0.5);
            QThread::msleep(10);
          }
          if (fails)
            throw Error(Error::Kind::FileSystem, "the disk is full");
        },
        [] {}, [&window](const QString& error) { window.Window().Bench()->Warn(error); }));
  };
  start(true);
  window.Window().close();
  QVERIFY(window.Window().isVisible() && window.HasMessage("Something long is still running"));
  window.Screenshot("closing-while-running");
  QVERIFY(window.Answer("Stay"));
  QVERIFY(window.Window().isVisible() && window.Messages().isEmpty());
  // What fails meanwhile is read before the window goes.
  window.Window().close();
  QVERIFY(window.Answer("Close when it is done"));
  *goesOn = false;
  QVERIFY(window.Wait());
  window.Settle();
  QVERIFY(window.Window().isVisible() && window.HasMessage("the disk is full"));
  start(false);
  window.Window().close();
  QVERIFY(window.Answer("Close when it is done"));
  window.Settle();
  QVERIFY(window.Window().isVisible());
  *goesOn = false;
  QTRY_VERIFY(!window.Window().isVisible());
  window.Window().show();
  start(true);
  window.Window().close();
  QVERIFY(window.Answer("Stop it and close"));
  QTRY_VERIFY(!window.Window().isVisible());
}

void TestFiles::laterWorkOnAProjectIsOffered()
{
  const QString project = Folder().filePath("pair.json");
  std::array<double, 16> moved{};
  {
    WindowUnderTest window;
    QVERIFY(window.Open({A(), B()}));
    QVERIFY(window.Window().Files()->SaveTo(project));
  }
  {
    WindowUnderTest window;
    window.Window().Start(project, {});
    QTRY_COMPARE(window.Session()->GetNumberOfVolumes(), 2);
    window.Settle();
    QVERIFY2(window.Messages().isEmpty(), qPrintable(window.Messages().join('\n'))); // there is none
    QTest::qWait(1100);                                                              // times of files are whole seconds
    window.Session()->SetPlacement(window.Session()->GetVolumeId(1), 10, -3, 5, 10, 20, 30);
    QVERIFY(window.Session()->BackUp());
    moved = window.Pose(window.Session()->GetVolumeId(1));
  } // it ends without being asked, as in a crash
  WindowUnderTest window;
  window.Window().Start(project, {});
  QTRY_VERIFY(window.HasMessage("unsaved changes"));
  QVERIFY(window.Answer("Restore them"));
  QTRY_COMPARE(window.Pose(window.Session()->GetVolumeId(1)), moved);
}

void TestFiles::whatWasNotSavedOnPurposeIsNotOffered()
{
  {
    WindowUnderTest window;
    window.Window().Start({}, {A(), B()}); // only looked at
    QTRY_COMPARE(window.Session()->GetNumberOfVolumes(), 2);
    window.Window().close();
    QVERIFY(!window.Window().isVisible());
  }
  {
    WindowUnderTest window;
    window.Window().Start({}, {A(), B()});
    QTRY_COMPARE(window.Session()->GetNumberOfVolumes(), 2);
    QVERIFY2(window.Messages().isEmpty(), qPrintable(window.Messages().join('\n')));
    window.Session()->TranslateSelection(5, 0, 0);
    QVERIFY(window.Session()->BackUp());
    window.Window().close();
    QVERIFY(window.Answer("Do not save"));
    QTRY_VERIFY(!window.Window().isVisible());
  }
  WindowUnderTest window;
  window.Window().Start({}, {});
  QVERIFY2(window.Messages().isEmpty(), qPrintable(window.Messages().join('\n')));
}

void TestFiles::severalSessionsAreOffered()
{
  for (int i = 0; i < 2; i++) {
    WindowUnderTest window;
    window.Window().Start({}, {A(), B()});
    QTRY_COMPARE(window.Session()->GetNumberOfVolumes(), 2);
    window.Session()->TranslateSelection(5, 0, 0);
    QVERIFY(window.Session()->BackUp());
  }
  WindowUnderTest window;
  window.Window().Start({}, {});
  QVERIFY(window.HasMessage("Earlier ones: 1"));
  window.Screenshot("abandoned");
  QVERIFY(window.Answer("Delete it"));
  QVERIFY(window.HasMessage("without being saved") && !window.HasMessage("Earlier ones"));
  QVERIFY(window.Answer("Open it"));
  QTRY_COMPARE(window.Session()->GetNumberOfVolumes(), 2);
  QVERIFY(window.Window().Files()->HasUnsavedWork());
}

int main(int argc, char** argv)
{
  return WindowTest::Run(argc, argv, [argc, argv] {
    TestFiles test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestFiles.moc"
