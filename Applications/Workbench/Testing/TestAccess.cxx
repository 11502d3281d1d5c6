// SPDX-License-Identifier: BSD-3-Clause
// The workbench for people who use no mouse, see colours in another way, need larger texts, or a light window.
#include "FileActions.h"
#include "FocusRing.h"
#include "GuideBar.h"
#include "Preferences.h"
#include "SliceCanvas.h"
#include "SlicePane.h"
#include "Theme.h"
#include "ViewGrid.h"
#include "VolumePane.h"
#include "Widgets/Session/Tints.h"
#include "WindowUnderTest.h"
#include "Workbench.h"
#include <QAbstractButton>
#include <QAbstractItemView>
#include <QAbstractSlider>
#include <QAbstractSpinBox>
#include <QAction>
#include <QApplication>
#include <QComboBox>
#include <QDialog>
#include <QDockWidget>
#include <QDoubleSpinBox>
#include <QLabel>
#include <QLineEdit>
#include <QMenu>
#include <QMenuBar>
#include <QPushButton>
#include <QScreen>
#include <QSettings>
#include <QTabBar>
#include <QToolBar>
#include <QToolButton>
#include <QtTest>
#include <QVTKOpenGLNativeWidget.h>

using namespace echorama;

namespace {

// Of WCAG 2.1: how well one colour is seen on another, from 1 to 21.
double Contrast(const QColor& a, const QColor& b)
{
  const auto luminance = [](const QColor& colour) {
    const auto part = [](double value) { return value <= 0.03928 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4); };
    return 0.2126 * part(colour.redF()) + 0.7152 * part(colour.greenF()) + 0.0722 * part(colour.blueF());
  };
  const double light = std::max(luminance(a), luminance(b)), dark = std::min(luminance(a), luminance(b));
  return (light + 0.05) / (dark + 0.05);
}

bool IsControl(const QWidget* widget)
{
  if (qobject_cast<const QTabBar*>(widget->parentWidget()) || qobject_cast<const QToolBar*>(widget->parentWidget()) ||
      qobject_cast<const QDockWidget*>(widget->parentWidget()) || qobject_cast<const QTabBar*>(widget))
    return false; // menus and keys do what these do
  return qobject_cast<const QAbstractButton*>(widget) || qobject_cast<const QAbstractSpinBox*>(widget) ||
         qobject_cast<const QComboBox*>(widget) ||
         (qobject_cast<const QAbstractSlider*>(widget) && !widget->inherits("QScrollBar")) ||
         (qobject_cast<const QLineEdit*>(widget) && !qobject_cast<const QAbstractSpinBox*>(widget->parentWidget())) ||
         (qobject_cast<const QAbstractItemView*>(widget) && !widget->inherits("QHeaderView")) ||
         widget->inherits("QVTKOpenGLNativeWidget");
}

QString NameOf(const QWidget* widget)
{
  return QString("%1 %2 in %3")
      .arg(widget->metaObject()->className(), widget->objectName(), widget->parentWidget()->objectName());
}

const char* const Panels[] = {"volumePanel",       "posePanel",  "viewPanel",   "brushPanel",    "historyPanel",
                              "registrationPanel", "checkPanel", "resultPanel", "trainingPanel", "trackerPanel"};

} // namespace

class TestAccess : public WindowTest {
  Q_OBJECT

private slots:
  void cleanup();
  void tabReachesEveryControl();
  void everyPanelHasAKey();
  void whatHasTheKeysIsSeen();
  void aClickedNumberIsReplaced();
  void everyMenuEntryHasAKey();
  void everyControlHasAName();
  void coloursAreChosenAndKept();
  void lightAndDark_data();
  void lightAndDark();
  void nothingIsCutOffInLargerTexts();
};

void TestAccess::cleanup()
{
  ApplyTheme(*qApp);
}

void TestAccess::tabReachesEveryControl()
{
  QSettings().remove("window/guide");
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  for (int panel = 0; panel < 10; panel++) {
    window.Key(static_cast<Qt::Key>(Qt::Key_0 + (panel + 1) % 10), Qt::ControlModifier);
    QSet<QWidget*> reached;
    for (int i = 0; i < 400 && !reached.contains(QApplication::focusWidget()); i++) {
      QVERIFY(QApplication::focusWidget());
      reached.insert(QApplication::focusWidget());
      QTest::keyClick(QApplication::focusWidget(), Qt::Key_Tab);
    }
    for (auto* widget : window.Window().findChildren<QWidget*>())
      if (IsControl(widget) && widget->isVisible() && widget->isEnabled() && widget->window() == &window.Window() &&
          !widget->visibleRegion().isEmpty())
        QVERIFY2(reached.contains(widget), qPrintable(QString("%1: %2").arg(Panels[panel], NameOf(widget))));
  }
}

void TestAccess::everyPanelHasAKey()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  window.Part<QDockWidget>("trackerPanelDock")->close(); // also from there
  for (int panel = 0; panel < 10; panel++) {
    window.Key(static_cast<Qt::Key>(Qt::Key_0 + (panel + 1) % 10), Qt::ControlModifier);
    auto* part = window.Part<QWidget>(Panels[panel]);
    QVERIFY2(part->isVisible() && !part->visibleRegion().isEmpty(), Panels[panel]);
    QVERIFY2(part->isAncestorOf(QApplication::focusWidget()), Panels[panel]);
  }
}

void TestAccess::whatHasTheKeysIsSeen()
{
  for (const char* theme : {"dark", "light"}) {
    ApplyTheme(*qApp, theme);
    WindowUnderTest window;
    QVERIFY(window.Open({A(), B()}));
    auto* ring = window.Part<QWidget>("focusRing");
    QVERIFY(!ring->isVisible()); // the mouse is enough for who uses it
    for (int i = 0; i < 30; i++) {
      window.Key(Qt::Key_Tab);
      QVERIFY(ring->isVisible());
      const QWidget* focused = QApplication::focusWidget();
      const auto isAround = [&] { // as soon as what moves has come to rest
        const QRect place(focused->mapTo(&window.Window(), QPoint(0, 0)), focused->size());
        return ring->geometry().intersects(place) && ring->geometry().contains(place.center());
      };
      QTRY_VERIFY2(isAround(), qPrintable(NameOf(focused)));
    }
    // Its line is there, and differs from the window.
    for (int i = 0; i < 300 && QApplication::focusWidget()->objectName() != "selectAll"; i++)
      window.Key(Qt::Key_Tab);
    const QImage picture = window.Screenshot(QString("focus-ring-%1").arg(theme));
    const QColor line = picture.pixelColor(ring->geometry().center().x(), ring->geometry().top()),
                 around = picture.pixelColor(ring->geometry().center().x(), ring->geometry().top() - 3);
    QVERIFY2(Contrast(line, around) > 3.0, qPrintable(QString("%1: %2").arg(theme).arg(Contrast(line, around))));
    // Also around a picture.
    for (int i = 0; i < 300 && QApplication::focusWidget() != window.Slice(0); i++)
      window.Key(Qt::Key_Tab);
    QCOMPARE(QApplication::focusWidget(), static_cast<QWidget*>(window.Slice(0)));
    QVERIFY(ring->geometry().contains(QRect(window.Slice(0)->mapTo(&window.Window(), QPoint(0, 0)), window.Slice(0)->size())));
    // And the picture is still seen on the screen, where views are windows of their own: nothing lies over it.
    window.Settle();
    const QRect slice(window.Slice(0)->mapToGlobal(QPoint(0, 0)), window.Slice(0)->size());
    const auto onScreen = [&] {
      return QApplication::primaryScreen()->grabWindow(0, slice.x(), slice.y(), slice.width(), slice.height()).toImage();
    };
    const auto brightness = [](const QImage& image) {
      return image.scaled(1, 1, {}, Qt::SmoothTransformation).pixelColor(0, 0).value();
    };
    QTRY_VERIFY(brightness(onScreen()) > 10);
    window.Click(window.Part<QPushButton>("selectAll"), {5, 5});
    QVERIFY(!ring->isVisible());
  }
}

// As everywhere: who clicks into a number and types means the new number.
void TestAccess::aClickedNumberIsReplaced()
{
  WindowUnderTest window;
  QVERIFY(window.Open({A()}));
  auto* field = window.Part<QDoubleSpinBox>("translationStep");
  auto* text = field->findChild<QLineEdit*>();
  window.Click(text, {3, text->height() / 2}); // at the left of it, where digits would be put before
  QTest::keyClicks(QApplication::focusWidget(), "8");
  QTest::keyClick(QApplication::focusWidget(), Qt::Key_Return);
  QCOMPARE(field->value(), 8.0);
  window.Click(text, {text->width() - 12, text->height() / 2}); // a second click, beside digits that stay
  QCOMPARE(field->value(), 8.0);
}

void TestAccess::everyMenuEntryHasAKey()
{
  WindowUnderTest window;
  int entries = 0;
  const std::function<void(const QList<QAction*>&)> check = [&](const QList<QAction*>& actions) {
    QSet<QChar> letters;
    for (QAction* action : actions) {
      if (action->isSeparator())
        continue;
      entries++;
      const int at = action->text().indexOf('&');
      QVERIFY2(at >= 0 && at + 1 < action->text().size(), qPrintable(action->text()));
      const QChar letter = action->text()[at + 1].toLower();
      QVERIFY2(!letters.contains(letter), qPrintable(action->text()));
      letters.insert(letter);
      if (action->menu())
        check(action->menu()->actions());
      else
        QVERIFY2(!action->statusTip().isEmpty() || action->isCheckable(), qPrintable(action->text()));
    }
  };
  check(window.Window().menuBar()->actions());
  QVERIFY(entries > 60);
  // No key means two things.
  QMap<QKeySequence, QString> keys;
  for (QAction* action : window.Window().findChildren<QAction*>())
    for (const QKeySequence& key : action->shortcuts()) {
      QVERIFY2(!keys.contains(key), qPrintable(key.toString() + ": " + keys[key] + " and " + action->text()));
      keys[key] = action->text();
    }
}

void TestAccess::everyControlHasAName()
{
  WindowUnderTest window;
  for (auto* widget : window.Window().findChildren<QWidget*>()) {
    if (!IsControl(widget) || widget->inherits("QComboBoxListView") || widget->inherits("QTableCornerButton"))
      continue;
    const auto* button = qobject_cast<QAbstractButton*>(widget);
    const bool isNamed =
        !widget->accessibleName().isEmpty() || !widget->objectName().isEmpty() || (button && !button->text().isEmpty());
    QVERIFY2(isNamed, qPrintable(NameOf(widget)));
  }
}

void TestAccess::coloursAreChosenAndKept()
{
  const auto colours = [](WindowUnderTest& window) {
    std::vector<Tint> all;
    for (const SessionVolume& volume : window.Session()->GetKernel().State().volumes)
      all.push_back(volume.colour);
    return all;
  };
  const auto& many = TintSetOf("many").tints;
  const auto& few = TintSetOf("blue-orange").tints;
  {
    WindowUnderTest window;
    QVERIFY(window.Open({A(), B()}));
    QCOMPARE(colours(window), std::vector<Tint>({many[0], many[1]}));
    QTest::keyClick(&window.Window(), Qt::Key_Comma, Qt::ControlModifier);
    QTRY_VERIFY(window.Window().findChild<QDialog*>("preferences"));
    auto* dialog = window.Part<QDialog>("preferences");
    QVERIFY(QTest::qWaitForWindowExposed(dialog));
    auto* choice = dialog->findChild<QComboBox*>("preferredColours");
    choice->setFocus();
    QTest::keyClick(choice, Qt::Key_End);
    window.Settle();
    dialog->grab().save(QString::fromLocal8Bit(qgetenv("ECHORAMA_BUILD_DIR")) + "/screenshots/preferences.png");
    QCOMPARE(colours(window), std::vector<Tint>({few[0], few[1]}));
    // Pictures show it: the slice is blue where the first volume is alone.
    QTest::keyClick(dialog, Qt::Key_Escape);
    QTRY_VERIFY(!window.Window().findChild<QDialog*>("preferences"));
    const QImage picture = window.Screenshot("blue-orange");
    for (const QWidget* view :
         {static_cast<QWidget*>(window.Slice(0)), static_cast<QWidget*>(window.Window().Views()->Volume()->Canvas())}) {
      const QRect place(view->mapTo(&window.Window(), QPoint(0, 0)), view->size());
      double red = 0.0, blue = 0.0; // of the left edge of what is lit, where the first volume is alone
      for (int y = place.top(); y <= place.bottom(); y++)
        for (int x = place.left(); x < place.left() + place.width() / 2; x++) {
          const QColor pixel = picture.pixelColor(x, y);
          if (pixel.saturation() > 60 && pixel.value() > 30) {
            red += pixel.redF() > pixel.blueF();
            blue += pixel.blueF() > pixel.redF();
          }
        }
      QVERIFY2(blue > 50, qPrintable(view->objectName()));
    }
  }
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  QCOMPARE(colours(window), std::vector<Tint>({few[0], few[1]}));
}

void TestAccess::lightAndDark_data()
{
  QTest::addColumn<QString>("theme");
  QTest::addColumn<bool>("dark");
  QTest::newRow("dark") << "dark" << true;
  QTest::newRow("light") << "light" << false;
  QTest::newRow("system") << "system" << false; // that of the screen of tests
}

void TestAccess::lightAndDark()
{
  QFETCH(QString, theme);
  QFETCH(bool, dark);
  WindowUnderTest window;
  QVERIFY(window.Open({A(), B()}));
  window.Window().Bench()->Warn("a warning that was there before", {{"Mend", {}}});
  ShowPreferences(&window.Window(), window.Window().Bench());
  auto* choice = window.Part<QDialog>("preferences")->findChild<QComboBox*>("preferredTheme");
  choice->setCurrentIndex(choice->findData(theme));
  emit choice->activated(choice->currentIndex());
  QCOMPARE(Preferences::Kept().theme, theme);
  window.Part<QDialog>("preferences")->close();
  window.Settle();
  QCOMPARE(IsDark(qApp->palette()), dark);
  const QImage picture = window.Screenshot("theme-" + theme);
  const QPalette palette = qApp->palette();
  for (const auto& [text, ground] : {std::pair{QPalette::WindowText, QPalette::Window},
                                     {QPalette::Text, QPalette::Base},
                                     {QPalette::ButtonText, QPalette::Button},
                                     {QPalette::HighlightedText, QPalette::Highlight},
                                     {QPalette::ToolTipText, QPalette::ToolTipBase}})
    QVERIFY2(Contrast(palette.color(text), palette.color(ground)) > (text == QPalette::HighlightedText ? 3.0 : 7.0),
             qPrintable(QString("role %1 %2").arg(text).arg(Contrast(palette.color(text), palette.color(ground)))));
  // Messages, also one that was there before the theme.
  const auto* label = window.Part<QLabel>("messageText");
  const QPoint corner = label->parentWidget()->mapTo(&window.Window(), QPoint(label->parentWidget()->width() / 2, 3));
  QVERIFY2(Contrast(picture.pixelColor(corner), palette.color(QPalette::WindowText)) > 4.5,
           qPrintable(picture.pixelColor(corner).name()));
  // Ultrasound stays on black.
  const QPoint black = window.Slice(0)->mapTo(&window.Window(), QPoint(3, window.Slice(0)->height() / 4));
  QCOMPARE(picture.pixelColor(black), QColor(Qt::black));
}

// Texts of 14 points: what menus, the tool bar, the guide, messages and dialogs say is there whole.
void TestAccess::nothingIsCutOffInLargerTexts()
{
  const QFont before = QApplication::font();
  QFont large = before;
  large.setPointSizeF(14.0);
  QApplication::setFont(large);
  QSettings().remove("window/guide");
  {
    WindowUnderTest window;
    QVERIFY(window.Open({A(), B()}));
    window.Window().Bench()->Warn(
        QString("A warning that is as long as warnings get, %1, with a path in it").arg(Folder().path()),
        {{"Open other files...", {}}, {"Try again", {}}});
    window.Settle();
    window.Screenshot("large-texts");
    int seen = 0;
    const auto isWhole = [&seen](const QWidget* part) {
      seen++;
      return part->isVisible() && part->width() >= part->minimumSizeHint().width() &&
             part->height() >= part->fontMetrics().height() && part->visibleRegion().boundingRect().size() == part->size();
    };
    for (auto* bar : window.Window().findChildren<QToolBar*>())
      for (auto* button : bar->findChildren<QToolButton*>()) {
        if (button->objectName() == "qt_toolbar_ext_button")
          QVERIFY2(!button->isVisible(), qPrintable(bar->objectName()));
        else
          QVERIFY2(isWhole(button) && button->width() >= button->fontMetrics().horizontalAdvance(button->text()),
                   qPrintable(bar->objectName() + " " + button->text()));
      }
    for (QWidget* bar : {window.Part<QWidget>("messageBar"), window.Part<QWidget>("guideBar")}) {
      for (auto* button : bar->findChildren<QPushButton*>())
        QVERIFY2(isWhole(button) && button->width() > button->fontMetrics().horizontalAdvance(button->text()),
                 qPrintable(button->text()));
      for (auto* label : bar->findChildren<QLabel*>())
        QVERIFY2(label->height() >= label->heightForWidth(label->width()), qPrintable(label->text()));
    }
    QVERIFY(seen > 20);
    ShowPreferences(&window.Window(), window.Window().Bench());
    auto* dialog = window.Part<QDialog>("preferences");
    QVERIFY(QTest::qWaitForWindowExposed(dialog));
    for (auto* part : dialog->findChildren<QWidget*>())
      if (qobject_cast<QLabel*>(part) || qobject_cast<QPushButton*>(part) || qobject_cast<QComboBox*>(part))
        QVERIFY2(part->width() >= part->minimumSizeHint().width(), qPrintable(NameOf(part)));
    QVERIFY(window.Window().width() <= 1280);
  }
  QApplication::setFont(before);
}

int main(int argc, char** argv)
{
  return WindowTest::Run(argc, argv, [argc, argv] {
    TestAccess test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestAccess.moc"
