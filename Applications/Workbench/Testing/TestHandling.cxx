// SPDX-License-Identifier: BSD-3-Clause
// What somebody met who worked through the clinical tasks for the first time: keys that stay in a field, brightness that does not
// come back, texts that are cut off.
#include "Flicker.h"
#include "SliceCanvas.h"
#include "vtkUltrasoundSliceView.h"
#include "Widgets/Session/LiveScore.h"
#include "WindowUnderTest.h"
#include "Workbench.h"
#include <cmath>
#include <QAction>
#include <QApplication>
#include <QDockWidget>
#include <QDoubleSpinBox>
#include <QHeaderView>
#include <QLineEdit>
#include <QListWidget>
#include <QMenu>
#include <QPushButton>
#include <QTableView>
#include <QTableWidget>
#include <QtTest>

using namespace echorama;

class TestHandling : public WindowTest {
  Q_OBJECT

private slots:
  void escapeBringsANumberBackAndGivesTheKeysBack();
  void returnOrAClickInAViewTakesTheNumber();
  void escapeInOtherFieldsBringsTheirTextBack();
  void escapeLeavesTheNameInTheTable();
  void greyLevelsComeBack();
  void namesOfBackupsAreReadWhole();
  void theScoreOfAnAttemptIsSeenAtOnce();
  void flickerEndsWhenThePictureIsDragged();
};

namespace {

std::array<double, 2> GreysOf(const WindowUnderTest& window)
{
  std::array<double, 2> greys;
  window.Session()->GetGreyWindow(greys.data());
  return greys;
}

double Moved(const std::array<double, 16>& a, const std::array<double, 16>& b)
{
  return std::hypot(a[3] - b[3], a[7] - b[7], a[11] - b[11]);
}

bool IsView(const QWidget* widget)
{
  return widget && widget->inherits("QVTKOpenGLNativeWidget");
}

// A click as a person makes it: the focus goes where Qt takes it.
void ClickInWindow(WindowUnderTest& window, QWidget* widget, const QPoint& at)
{
  QTest::mouseClick(window.Window().windowHandle(), Qt::LeftButton, {}, widget->mapTo(&window.Window(), at));
  window.Settle();
}

void TypeInto(WindowUnderTest& window, QWidget* field, const QString& text)
{
  ClickInWindow(window, field, field->rect().center());
  window.Key(Qt::Key_A, Qt::ControlModifier);
  QTest::keyClicks(QApplication::focusWidget(), text);
  window.Settle();
}

} // namespace

void TestHandling::escapeBringsANumberBackAndGivesTheKeysBack()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  const QPoint middle = window.Slice(1)->rect().center() + QPoint(5, 50);
  window.Move(window.Slice(1), middle); // keys are this view's
  QVERIFY(window.Slice(1)->hasFocus());
  auto* field = window.Part<QDoubleSpinBox>("middleX");
  const auto before = window.Pose(2);
  const QString text = field->text();
  TypeInto(window, field, "31");
  QVERIFY(field->hasFocus() && field->text() != text);
  window.Move(window.Slice(0), window.Slice(0)->rect().center()); // passing a view does not end the typing
  QVERIFY(field->hasFocus());
  window.Key(Qt::Key_Escape);
  QVERIFY(window.Slice(1)->hasFocus());
  QCOMPARE(field->text(), text);
  QCOMPARE(window.Pose(2), before);
  window.Move(window.Slice(1), middle);
  window.Key(Qt::Key_Right); // an arrow moves the volume, and a letter is a shortcut
  QVERIFY(std::abs(Moved(window.Pose(2), before) - 1.0) < 1e-9);
  window.Key(Qt::Key_3);
  QVERIFY(window.Window().Bench()->CurrentTool() == Tool::Paint);
  // Nor does the number come later, when the field is left once more.
  const auto after = window.Pose(2);
  ClickInWindow(window, field, field->rect().center());
  window.Key(Qt::Key_Escape);
  QVERIFY(window.Slice(1)->hasFocus());
  QCOMPARE(window.Pose(2), after);
}

void TestHandling::returnOrAClickInAViewTakesTheNumber()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  window.Move(window.Slice(2), window.Slice(2)->rect().center());
  auto* field = window.Part<QDoubleSpinBox>("middleX");
  TypeInto(window, field, "31");
  window.Key(Qt::Key_Return);
  QCOMPARE(field->value(), 31.0);
  QVERIFY(window.Slice(2)->hasFocus());
  window.Key(Qt::Key_1); // Look, so that a click changes nothing else
  QVERIFY(window.Window().Bench()->CurrentTool() == Tool::Look);
  TypeInto(window, field, "-7");
  QVERIFY(field->hasFocus());
  ClickInWindow(window, window.Slice(0), window.Slice(0)->rect().center());
  QVERIFY(window.Slice(0)->hasFocus());
  double middle[3], degrees[3];
  QVERIFY(window.Session()->GetPlacement(2, middle, degrees));
  QVERIFY(std::abs(middle[0] + 7.0) < 1e-9);
}

void TestHandling::escapeInOtherFieldsBringsTheirTextBack()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  window.Part<QDockWidget>("trainingPanelDock")->raise();
  window.Settle();
  const QWidget* view = QApplication::focusWidget();
  QVERIFY(IsView(view));
  auto* trainee = window.Part<QLineEdit>("trainee");
  TypeInto(window, trainee, "Anna");
  window.Key(Qt::Key_Return);
  QVERIFY(view->hasFocus());
  TypeInto(window, trainee, "Berta");
  window.Key(Qt::Key_Escape);
  QCOMPARE(trainee->text(), QString("Anna"));
  QVERIFY(view->hasFocus());
  auto* seed = window.Part<QDoubleSpinBox>("scatterSeed");
  ClickInWindow(window, seed, seed->rect().center());
  QTest::keyClicks(QApplication::focusWidget(), "3"); // takes the place of what was there
  window.Key(Qt::Key_Return);
  QCOMPARE(seed->text(), QString("3"));
  TypeInto(window, seed, "42");
  QCOMPARE(seed->text(), QString("42"));
  window.Key(Qt::Key_Escape);
  QCOMPARE(seed->text(), QString("3"));
  QCOMPARE(seed->value(), 3.0);
  QVERIFY(view->hasFocus());
}

void TestHandling::escapeLeavesTheNameInTheTable()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  auto* table = window.Part<QTableView>("volumes");
  const QPoint at = table->visualRect(table->model()->index(0, 2)).center();
  ClickInWindow(window, table->viewport(), at);
  QTest::mouseDClick(window.Window().windowHandle(), Qt::LeftButton, {}, table->viewport()->mapTo(&window.Window(), at));
  window.Settle();
  QVERIFY(qobject_cast<QLineEdit*>(QApplication::focusWidget()));
  QTest::keyClicks(QApplication::focusWidget(), "another");
  window.Key(Qt::Key_Escape);
  QCOMPARE(window.Session()->GetName(1), std::string("left"));
  QTRY_VERIFY(!table->findChild<QLineEdit*>());
  QVERIFY(IsView(QApplication::focusWidget()));
}

// The key, the menu and a double click of the button that changed them. Fitting the view is something else.
void TestHandling::greyLevelsComeBack()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A()}));
  SliceCanvas* slice = window.Slice(0);
  const QPoint middle = slice->rect().center();
  const auto first = GreysOf(window);
  const auto darken = [&] { window.Drag(slice, middle, middle + QPoint(40, 60), Qt::RightButton); };
  darken();
  const auto changed = GreysOf(window);
  QVERIFY(changed != first);
  window.Key(Qt::Key_F);
  QCOMPARE(GreysOf(window), changed);
  window.Key(Qt::Key_G);
  QCOMPARE(GreysOf(window), first);
  QCOMPARE(window.Part<QDoubleSpinBox>("white")->value(), std::round(first[1]));
  darken();
  QVERIFY(GreysOf(window) != first);
  auto* action = window.Part<QAction>("resetGreys");
  bool isInAMenu = false;
  for (auto* menu : window.Window().findChildren<QMenu*>())
    isInAMenu |= menu->actions().contains(action);
  QVERIFY(isInAMenu);
  action->trigger();
  QCOMPARE(GreysOf(window), first);
  darken();
  QVERIFY(GreysOf(window) != first);
  window.Move(slice, middle);
  QTest::mouseDClick(slice, Qt::RightButton, {}, middle);
  window.Settle();
  QCOMPARE(GreysOf(window), first);
  window.Drag(slice, middle, middle + QPoint(0, 30), Qt::RightButton); // the button is not stuck
  QVERIFY(GreysOf(window) != first);
  window.Key(Qt::Key_G);
  // From here on they are those of what is open, as if nobody had ever changed them.
  QVERIFY(window.Open({WriteVolume("dark.mha", 3, {5, 0, 0}, 48, true)}));
  QVERIFY(GreysOf(window) != first);
}

void TestHandling::namesOfBackupsAreReadWhole()
{
  const QString name = "liver_right_lobe_intercostal_deep_inspiration_2021-11-03_scan-04";
  WindowUnderTest window;
  QVERIFY(window.Open({A(), WriteVolume(name + ".mha", 2, {12, 4, 0})}));
  window.Session()->SetAutomaticBackups(true);
  window.Part<QDockWidget>("historyPanelDock")->raise();
  window.Move(window.Slice(0), window.Slice(0)->rect().center() + QPoint(5, 50));
  window.Key(Qt::Key_Right);
  QVERIFY(window.Session()->BackUp());
  auto* list = window.Part<QListWidget>("backups");
  QTRY_VERIFY(list->count() > 0);
  window.Screenshot("backups-of-long-names");
  QCOMPARE(window.Window().size(), QSize(1280, 800)); // no panel is so wide that it takes the window's or the views' place
  QVERIFY(window.Slice(0)->width() > 300);
  const QListWidgetItem* item = list->item(0);
  QString shown = item->text();
  QVERIFY2(shown.remove(QChar(0x200b)).contains(name), qPrintable(shown));
  QVERIFY(item->toolTip().contains(name));
  // All of it is inside the line of the list, which is inside the list.
  const QRect line = list->visualItemRect(item);
  QVERIFY(line.left() >= 0 && line.right() < list->viewport()->width());
  constexpr int margins = 8;
  const QRect text = list->fontMetrics().boundingRect(QRect(0, 0, line.width() - margins, 1000), Qt::TextWordWrap, item->text());
  QVERIFY2(text.width() <= line.width() && text.height() <= line.height(),
           qPrintable(QString("%1 x %2 in %3 x %4").arg(text.width()).arg(text.height()).arg(line.width()).arg(line.height())));
  QVERIFY(text.height() > list->fontMetrics().height() * 3 / 2); // it does not fit into one
  QVERIFY(window.Part<QPushButton>("undo")->toolTip().contains(name));
}

void TestHandling::theScoreOfAnAttemptIsSeenAtOnce()
{
  QVERIFY(Folder().mkpath("data/echorama"));
  Attempt attempt;
  attempt.time = "2026-11-26T12:00:00Z";
  attempt.trainee = "Anna-Katharina Meier";
  attempt.startMm = 25.0;
  attempt.scoreMm = 1.99;
  attempt.seconds = 754.0;
  AppendAttempt(Folder().filePath("data/echorama/attempts.csv").toStdString(), attempt);
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  window.Part<QDockWidget>("trainingPanelDock")->raise();
  window.Settle();
  window.Screenshot("attempts");
  auto* table = window.Part<QTableWidget>("attempts");
  QCOMPARE(table->rowCount(), 1);
  const QRegion seen = table->viewport()->visibleRegion();
  const QStringList wanted{"1.99", "25.00", "12:34", "0"};
  for (int column = 0; column < wanted.size(); column++) {
    const QTableWidgetItem* item = table->item(0, column);
    QCOMPARE(item->text(), wanted[column]);
    const QRect cell = table->visualItemRect(item);
    QVERIFY2(seen.contains(cell) && (seen & cell) == QRegion(cell), qPrintable(wanted[column]));
    QVERIFY(table->fontMetrics().horizontalAdvance(item->text()) < cell.width());
  }
  for (int column = 0; column < table->columnCount(); column++) // what is farther right is told here, too
    QVERIFY(table->item(0, 0)->toolTip().contains(table->item(0, column)->text()));
}

void TestHandling::flickerEndsWhenThePictureIsDragged()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  const auto* flicker = window.Window().Bench()->Flickering();
  SliceCanvas* slice = window.Slice(0);
  const QPoint middle = slice->rect().center();
  for (const Qt::KeyboardModifier key : {Qt::NoModifier, Qt::ShiftModifier}) { // moved, turned
    window.Move(slice, middle);
    window.Key(Qt::Key_Space, Qt::ShiftModifier);
    QVERIFY(flicker->IsOn());
    window.Wheel(slice, 1); // to look elsewhere is no reason
    QVERIFY(flicker->IsOn());
    window.Drag(slice, middle, middle + QPoint(30, 10), Qt::MiddleButton, key);
    QVERIFY(!flicker->IsOn());
    QVERIFY(window.Window().Bench()->OnlyInSlices().isEmpty());
  }
}

int main(int argc, char** argv)
{
  return WindowTest::Run(argc, argv, [argc, argv] {
    TestHandling test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestHandling.moc"
