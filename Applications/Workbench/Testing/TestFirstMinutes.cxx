// SPDX-License-Identifier: BSD-3-Clause
// What a person meets who starts the workbench for the first time: an empty window that says how to begin, samples, files that
// are dropped anywhere, and the guide.
#include "EmptyPage.h"
#include "FileActions.h"
#include "GuideBar.h"
#include "Samples.h"
#include "SliceCanvas.h"
#include "ViewGrid.h"
#include "VolumePane.h"
#include "WindowUnderTest.h"
#include "Workbench.h"
#include <QAction>
#include <QApplication>
#include <QCheckBox>
#include <QDockWidget>
#include <QDragEnterEvent>
#include <QDragMoveEvent>
#include <QDropEvent>
#include <QFileDialog>
#include <QLabel>
#include <QLineEdit>
#include <QMenu>
#include <QMimeData>
#include <QPushButton>
#include <QScrollArea>
#include <QSettings>
#include <QTableView>
#include <QToolButton>
#include <QtTest>
#include <QUrl>
#include <QVTKOpenGLNativeWidget.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkUltrasoundVolume.h>

using namespace echorama;

namespace {

// Over a place of a window, as the desktop does it: Qt itself finds out whose it is.
bool DropOver(QWidget* widget, const QStringList& paths)
{
  QMimeData data;
  QList<QUrl> urls;
  for (const QString& path : paths)
    urls.append(QUrl::fromLocalFile(path));
  data.setUrls(urls);
  data.setText(paths.join('\n')); // desktops send both
  QWidget* window = widget->window();
  const QPoint at = widget->mapTo(window, widget->rect().center());
  QDragEnterEvent enter(at, Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
  QApplication::sendEvent(window->windowHandle(), &enter);
  QDragMoveEvent move(at, Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
  QApplication::sendEvent(window->windowHandle(), &move);
  if (!move.isAccepted())
    return false;
  QDropEvent drop(at, Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
  QApplication::sendEvent(window->windowHandle(), &drop);
  return drop.isAccepted();
}

void ClickIn(WindowUnderTest& window, QAbstractButton* button)
{
  QTest::mouseClick(window.Window().windowHandle(), Qt::LeftButton, {}, button->mapTo(&window.Window(), button->rect().center()));
  window.Settle();
}

} // namespace

class TestFirstMinutes : public WindowTest {
  Q_OBJECT

private slots:
  void anEmptyWindowSaysHowToBegin();
  void aSampleIsOneClickAway();
  void aSampleThatIsStoppedIsMadeAgain();
  void aSampleThatCannotBeMadeIsTriedAgain();
  void filesAreDroppedAnywhere();
  void aPathIsDroppedOnItsField();
  void theGuideTicksWhatHappened();
  void theGuideIsClosedAndBroughtBack();
};

void TestFirstMinutes::anEmptyWindowSaysHowToBegin()
{
  QSettings().remove("window/guide");
  WindowUnderTest window;
  auto* page = window.Part<EmptyPage>("emptyPage");
  QVERIFY(page->isVisible() && window.Part<GuideBar>("guideBar")->isVisible());
  QCOMPARE(page->geometry(), window.Window().Views()->rect());
  ComparePicture(window.Screenshot("workbench-empty"), "workbench-empty");
  // By mouse and by keys: both come to the dialog.
  for (int way = 0; way < 2; way++) {
    QApplication::setActiveWindow(&window.Window()); // no window manager does it when a dialog goes
    auto* open = window.Part<QPushButton>("emptyOpen");
    if (way == 0) {
      ClickIn(window, open);
    } else {
      for (int i = 0; i < 300 && QApplication::focusWidget() != open; i++)
        window.Key(Qt::Key_Tab);
      QCOMPARE(QApplication::focusWidget(), open);
      QTest::keyClick(open, Qt::Key_Return);
    }
    QTRY_VERIFY(window.Window().findChild<QFileDialog*>("openDialog"));
    window.Part<QFileDialog>("openDialog")->reject();
    QTRY_VERIFY(!window.Window().findChild<QFileDialog*>("openDialog"));
  }
  // It goes with the first volume, and comes back with the last; and keys are the views' again.
  QVERIFY(window.Open({A()}));
  QVERIFY(!page->isVisible());
  window.Key(Qt::Key_Z, Qt::ControlModifier);
  QCOMPARE(window.Session()->GetNumberOfVolumes(), 0);
  QVERIFY(page->isVisible());
}

void TestFirstMinutes::aSampleIsOneClickAway()
{
  for (int times = 0; times < 2; times++) { // made, and then only opened
    WindowUnderTest window;
    QVERIFY(IsThere(Samples()[0]) == (times == 1));
    ClickIn(window, window.Part<QPushButton>("phantom-2"));
    QVERIFY(window.Wait());
    QTRY_COMPARE(window.Session()->GetNumberOfVolumes(), 2);
    QVERIFY2(window.Messages().isEmpty(), qPrintable(window.Messages().join('\n')));
    QVERIFY(QApplication::focusWidget() && QApplication::focusWidget()->inherits("QVTKOpenGLNativeWidget"));
    // It is of use: the second volume lies wrong by what it says, and the program finds where it belongs.
    QVERIFY(window.Session()->HasTruth());
    const double before = window.Session()->GetScore();
    QVERIFY2(before > 5.0 && before < 15.0, qPrintable(QString::number(before)));
    if (times == 0)
      continue;
    window.Screenshot("sample");
    window.Key(Qt::Key_R);
    QVERIFY(window.Wait());
    QVERIFY2(window.Session()->GetScore() < 1.0, qPrintable(QString::number(window.Session()->GetScore())));
  }
}

void TestFirstMinutes::aSampleThatIsStoppedIsMadeAgain()
{
  WindowUnderTest window;
  ClickIn(window, window.Part<QPushButton>("phantom-4"));
  QTRY_VERIFY(window.Part<QToolButton>("jobCancel")->isVisible());
  ClickIn(window, window.Part<QToolButton>("jobCancel"));
  QVERIFY(window.Wait());
  QCOMPARE(window.Session()->GetNumberOfVolumes(), 0);
  QVERIFY(!IsThere(Samples()[1]) && window.Part<EmptyPage>("emptyPage")->isVisible());
  ClickIn(window, window.Part<QPushButton>("phantom-4"));
  QVERIFY(window.Wait());
  QTRY_COMPARE(window.Session()->GetNumberOfVolumes(), 4);
}

void TestFirstMinutes::aSampleThatCannotBeMadeIsTriedAgain()
{
  WindowUnderTest window;
  QFile inTheWay(Folder().filePath("data"));
  QVERIFY(inTheWay.open(QIODevice::WriteOnly)); // where the folder for samples would be
  ClickIn(window, window.Part<QPushButton>("phantom-2"));
  QVERIFY(window.Wait());
  QVERIFY2(window.HasMessage("folder for samples cannot be made"), qPrintable(window.Messages().join('\n')));
  QVERIFY(inTheWay.remove());
  QVERIFY(window.Answer("Try again"));
  QVERIFY(window.Wait());
  QTRY_COMPARE(window.Session()->GetNumberOfVolumes(), 2);
  QVERIFY2(window.Messages().isEmpty(), qPrintable(window.Messages().join('\n')));
}

void TestFirstMinutes::filesAreDroppedAnywhere()
{
  WindowUnderTest window;
  int count = 0;
  const auto open = [&](QWidget* over) {
    const QString file = WriteVolume(QString("volume%1.mha").arg(count), count, {1.0 * count, 0, 0}, 24);
    if (!DropOver(over, {file}))
      return false;
    count++;
    return window.Wait() && window.Session()->GetNumberOfVolumes() == count;
  };
  QVERIFY(open(window.Part<EmptyPage>("emptyPage")));
  QVERIFY(open(window.Slice(1)));
  QVERIFY(open(window.Window().Views()->Volume()->Canvas()));
  QVERIFY(open(window.Part<QTableView>("volumes")->viewport()));
  auto* number = window.Part<QWidget>("translationStep")->findChild<QLineEdit*>();
  const QString typed = number->text();
  QVERIFY(open(number)); // which would take text
  QCOMPARE(number->text(), typed);
  auto* dock = window.Part<QDockWidget>("volumePanelDock");
  dock->setFloating(true);
  QVERIFY(QTest::qWaitForWindowExposed(dock));
  QVERIFY(open(window.Part<QPushButton>("selectAll")));
  // What is no file of this machine is not taken.
  QMimeData text;
  text.setText("nothing");
  QDragEnterEvent enter(QPoint(300, 300), Qt::CopyAction, &text, Qt::LeftButton, Qt::NoModifier);
  QApplication::sendEvent(window.Window().windowHandle(), &enter);
  QVERIFY(!enter.isAccepted());
}

void TestFirstMinutes::aPathIsDroppedOnItsField()
{
  WindowUnderTest window;
  auto* dock = window.Part<QDockWidget>("registrationPanelDock");
  dock->raise();
  window.Settle();
  const QString file = Folder().filePath("recording.csv");
  auto* field = window.Part<QLineEdit>("placeRecording");
  dock->findChild<QScrollArea*>()->ensureWidgetVisible(field);
  QVERIFY(DropOver(field, {file}));
  QCOMPARE(field->text(), file);
  QVERIFY(window.Wait() && window.Messages().isEmpty());
}

void TestFirstMinutes::theGuideTicksWhatHappened()
{
  QSettings().remove("window/guide");
  WindowUnderTest window;
  auto* guide = window.Part<GuideBar>("guideBar");
  auto* button = window.Part<QPushButton>("guideDo");
  const auto done = [guide] {
    QString all;
    for (int step = 0; step < GuideBar::Steps; step++)
      all += guide->IsDone(static_cast<GuideBar::Step>(step)) ? 'x' : '.';
    return all;
  };
  QCOMPARE(done(), QString("......"));
  QCOMPARE(button->text(), QString("Open..."));
  QVERIFY(window.Open({A()}));
  QCOMPARE(done(), QString("......")); // one volume is not two
  QVERIFY(window.Open({B()}));
  QCOMPARE(done(), QString("x....."));
  QCOMPARE(button->text(), QString("Refine"));
  window.Session()->TranslateSelection(2, 0, 0);
  QCOMPARE(done(), QString("xx...."));
  window.Key(Qt::Key_Z, Qt::ControlModifier);
  QCOMPARE(done(), QString("x....."));
  ClickIn(window, button);
  QVERIFY(window.Wait());
  QCOMPARE(done(), QString("xx...."));
  QCOMPARE(button->text(), QString("Difference"));
  ClickIn(window, button);
  QCOMPARE(window.Window().Bench()->Slices().mode, QString("difference"));
  QCOMPARE(done(), QString("xxx..."));
  ClickIn(window, button);
  QVERIFY(window.Wait());
  QCOMPARE(done(), QString("xxxx.."));
  ClickIn(window, button);
  QVERIFY(window.Wait());
  QCOMPARE(done(), QString("xxxxx."));
  QVERIFY(window.Part<QCheckBox>("embed")->isChecked());
  QVERIFY(!window.Window().Files()->SaveTo(Folder().filePath("guided.json"))); // it asks about the result
  QVERIFY(window.Answer("Save it there"));
  QVERIFY(window.Wait());
  QCOMPARE(done(), QString("xxxxxx"));
  QCOMPARE(window.Part<QLabel>("guideText")->text(), QString("All is done and saved."));
  window.Screenshot("guide");
  // What was overtaken is open again.
  window.Session()->Select(2, true, true);
  window.Session()->TranslateSelection(1, 0, 0);
  QCOMPARE(done(), QString("xx...."));
  window.Key(Qt::Key_Z, Qt::ControlModifier);
  QCOMPARE(done(), QString("xxxxxx"));
  // Any step can be read about, and done in any order.
  ClickIn(window, window.Part<QToolButton>("guideSave"));
  QCOMPARE(button->text(), QString("Save..."));
}

void TestFirstMinutes::theGuideIsClosedAndBroughtBack()
{
  QSettings().remove("window/guide");
  for (const bool isShown : {true, false, true}) {
    WindowUnderTest window;
    auto* guide = window.Part<GuideBar>("guideBar");
    QCOMPARE(guide->isVisible(), isShown);
    if (isShown) {
      ClickIn(window, window.Part<QToolButton>("guideClose"));
    } else {
      QTest::keyClick(&window.Window(), Qt::Key_H, Qt::AltModifier); // the menu Help
      QTRY_VERIFY(QApplication::activePopupWidget());
      QTest::keyClick(QApplication::activePopupWidget(), Qt::Key_G);
      window.Settle();
    }
    QCOMPARE(guide->isVisible(), !isShown);
    window.Window().close();
    QVERIFY(!window.Window().isVisible());
  }
}

int main(int argc, char** argv)
{
  return WindowTest::Run(argc, argv, [argc, argv] {
    TestFirstMinutes test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestFirstMinutes.moc"
