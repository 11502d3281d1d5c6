// SPDX-License-Identifier: BSD-3-Clause
// Every panel can be read and used as a whole: on a small and on a large screen, with the usual and with larger text.
#include "SliceCanvas.h"
#include "SlicePane.h"
#include "ViewGrid.h"
#include "vtkUltrasoundSliceView.h"
#include "WindowUnderTest.h"
#include <QAbstractButton>
#include <QAbstractSpinBox>
#include <QApplication>
#include <QCheckBox>
#include <QComboBox>
#include <QDockWidget>
#include <QHeaderView>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QScrollBar>
#include <QStyleOptionComboBox>
#include <QTabBar>
#include <QToolButton>
#include <QtTest>

using namespace echorama;

namespace {

// What shows a part: the nearest area that scrolls, or the panel's dock.
QWidget* WindowOf(QWidget* part, QDockWidget* dock)
{
  for (QWidget* above = part->parentWidget(); above && above != dock; above = above->parentWidget())
    if (auto* area = qobject_cast<QAbstractScrollArea*>(above))
      if (area->viewport()->isAncestorOf(part))
        return area->viewport();
  return dock;
}

bool IsWithinATable(QWidget* part)
{
  for (QWidget* above = part->parentWidget(); above; above = above->parentWidget())
    if (qobject_cast<QAbstractItemView*>(above))
      return true;
  return false;
}

// How wide the text of a part is, and how much room it has; -1: it has none that matters.
std::pair<int, int> TextOf(QWidget* part)
{
  const auto width = [part](const QString& text) { return part->fontMetrics().horizontalAdvance(text); };
  if (auto* label = qobject_cast<QLabel*>(part))
    return label->wordWrap() || label->text().isEmpty() ? std::pair(-1, 0) : std::pair(label->sizeHint().width(), label->width());
  if (auto* button = qobject_cast<QAbstractButton*>(part)) {
    if (qobject_cast<QPushButton*>(part) || qobject_cast<QToolButton*>(part))
      return {width(QString(button->text()).remove('&')), part->width() - 4};
    return {button->sizeHint().width(), button->width()};
  }
  if (auto* number = qobject_cast<QAbstractSpinBox*>(part)) {
    const QLineEdit* edit = number->findChild<QLineEdit*>();
    return {width(number->text()), edit->width() - 2};
  }
  if (auto* combo = qobject_cast<QComboBox*>(part)) {
    QStyleOptionComboBox option;
    option.initFrom(combo);
    option.editable = combo->isEditable();
    const QRect room = combo->style()->subControlRect(QStyle::CC_ComboBox, &option, QStyle::SC_ComboBoxEditField, combo);
    return {width(combo->currentText()), room.width()};
  }
  return {-1, 0};
}

QString NameOf(QWidget* part)
{
  QString name = part->objectName();
  if (auto* label = qobject_cast<QLabel*>(part); label && name.isEmpty())
    name = '"' + label->text() + '"';
  return QString("%1 %2").arg(part->metaObject()->className(), name);
}

QStringList Complaints(QDockWidget* dock)
{
  QStringList complaints;
  const auto complain = [&](QWidget* part, const QString& what) {
    complaints.append(QString("%1: %2 %3").arg(dock->objectName(), NameOf(part), what));
  };
  for (QWidget* part : dock->widget()->findChildren<QWidget*>()) {
    if (!part->isVisible() || qobject_cast<QScrollBar*>(part))
      continue;
    if (auto* header = qobject_cast<QHeaderView*>(part); header && header->orientation() == Qt::Horizontal)
      for (int column = 0; column < header->count(); ++column) {
        int text = 0;
        for (const QString& line : header->model()->headerData(column, Qt::Horizontal).toString().split('\n'))
          text = std::max(text, header->fontMetrics().horizontalAdvance(line));
        if (text > header->sectionSize(column) - 2)
          complain(part, QString("column %1: %2 pixels in %3").arg(column).arg(text).arg(header->sectionSize(column)));
      }
    if (IsWithinATable(part))
      continue;
    QWidget* window = WindowOf(part, dock);
    const QRect place(part->mapTo(window, QPoint(0, 0)), part->size());
    const bool scrolls = window != dock;
    if (place.left() < 0 || place.right() >= window->width() || (!scrolls && place.bottom() >= window->height()))
      complain(part, QString("from %1 to %2 of %3").arg(place.left()).arg(place.right()).arg(window->width()));
    if (const auto [text, room] = TextOf(part); text > room)
      complain(part, QString("has a text of %1 pixels in %2").arg(text).arg(room));
  }
  return complaints;
}

} // namespace

class TestLayout : public WindowTest {
  Q_OBJECT

private slots:
  void everyPanelFits_data();
  void everyPanelFits();
};

void TestLayout::everyPanelFits_data()
{
  QTest::addColumn<QSize>("size");
  QTest::addColumn<int>("points");
  for (const QSize size : {QSize(1280, 800), QSize(2560, 1440)})
    for (const int points : {0, 14})
      QTest::addRow("%d x %d, %d points", size.width(), size.height(), points) << size << points;
}

void TestLayout::everyPanelFits()
{
  QFETCH(QSize, size);
  QFETCH(int, points);
  const QFont usual = QApplication::font();
  const auto restore = qScopeGuard([usual] { QApplication::setFont(usual); }); // when the window has gone
  QFont font = usual;
  if (points > 0)
    font.setPointSize(points);
  QApplication::setFont(font);
  WindowUnderTest window;
  window.Window().resize(size);
  QVERIFY(window.Open({A(), B()}));
  window.Session()->Select(2, true, true);
  window.Session()->TranslateSelection(-123.456, 2.25, 0.0);
  window.Settle();
  QStringList complaints;
  const QList<QDockWidget*> docks = window.Window().findChildren<QDockWidget*>();
  QString widths = QString("the window has %1 x %2").arg(window.Window().width()).arg(window.Window().height());
  for (QDockWidget* dock : docks)
    widths += QString("; %1 needs %2").arg(dock->objectName()).arg(dock->widget()->minimumSizeHint().width());
  QVERIFY2(window.Window().width() <= size.width() && window.Window().height() <= size.height(),
           qPrintable(QString("%1; the views %2").arg(widths).arg(window.Window().centralWidget()->minimumSizeHint().width())));
  QCOMPARE(docks.size(), 10);
  for (QDockWidget* dock : docks) {
    dock->show();
    dock->raise();
    if (auto* more = dock->findChild<QToolButton*>("stitchMore"))
      window.Click(more, more->rect().center());
    window.Settle();
    QVERIFY(dock->isVisible());
    complaints += Complaints(dock);
    if (!window.Window().rect().contains(dock->geometry()))
      complaints.append(dock->objectName() + ": it reaches beyond the window");
    for (auto* tabs : window.Window().findChildren<QTabBar*>())
      if (tabs->isVisible() && tabs->parentWidget() == &window.Window() && tabs->geometry().intersects(dock->geometry()))
        complaints.append(dock->objectName() + ": it lies under the tabs");
    window.Grab(QString("layout-%1-%2-%3").arg(dock->objectName()).arg(size.width()).arg(points));
  }
  // The row above each slice, when it is far from the origin.
  for (SlicePane* pane : window.Window().Views()->Slices()) {
    pane->Canvas()->View()->SetPosition(-123.4);
    pane->ShowPlane();
    for (QWidget* part : pane->findChildren<QWidget*>())
      if (const auto [text, room] = TextOf(part); part->isVisible() && text > room)
        complaints.append(
            QString("%1: %2 has a text of %3 pixels in %4").arg(pane->objectName(), NameOf(part)).arg(text).arg(room));
  }
  window.Grab(QString("layout-slices-%1-%2").arg(size.width()).arg(points));
  QVERIFY2(complaints.isEmpty(), qPrintable(complaints.join('\n')));
}

int main(int argc, char** argv)
{
  return WindowTest::Run(argc, argv, [argc, argv] {
    TestLayout test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestLayout.moc"
