// SPDX-License-Identifier: BSD-3-Clause
#include "WindowHands.h"
#include "JobBar.h"
#include "MessageBar.h"
#include "Theme.h"
#include <cmath>
#include <QApplication>
#include <QDropEvent>
#include <QMimeData>
#include <QPushButton>
#include <QSettings>
#include <QSurfaceFormat>
#include <QtTest>
#include <QUrl>
#include <QVTKOpenGLNativeWidget.h>
#include <QWheelEvent>
#include <QWindow>

using namespace echorama;

void WindowHands::ShowWindow(QMainWindow* window)
{
  window_ = window;
  window_->resize(1280, 800);
  window_->move(0, 0);
  window_->show();
  if (!QTest::qWaitForWindowExposed(window_))
    qFatal("the window does not come");
  QApplication::setActiveWindow(window_);
  Settle();
}

MessageBar* WindowHands::Bar() const
{
  return window_->findChild<MessageBar*>("messageBar");
}

int WindowHands::JobsRunning() const
{
  return window_->findChild<JobBar*>("jobBar")->Count();
}

void WindowHands::Drop(const QStringList& paths)
{
  QMimeData data;
  QList<QUrl> urls;
  for (const QString& path : paths)
    urls.append(QUrl::fromLocalFile(path));
  data.setUrls(urls);
  QDragEnterEvent enter({100, 100}, Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
  QApplication::sendEvent(window_, &enter);
  QVERIFY(enter.isAccepted());
  QDropEvent drop(QPointF(100, 100), Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
  QApplication::sendEvent(window_, &drop);
}

void WindowHands::Press(QWidget* widget, const QPoint& at, Qt::MouseButton button, Qt::KeyboardModifiers keys)
{
  Move(widget, at, keys);
  QTest::mousePress(window_->windowHandle(), button, keys, widget->mapTo(window_, at));
}

void WindowHands::Move(QWidget* widget, const QPoint& to, Qt::KeyboardModifiers)
{
  QTest::mouseMove(window_->windowHandle(), widget->mapTo(window_, to));
  QCoreApplication::processEvents();
}

void WindowHands::Release(QWidget* widget, const QPoint& at, Qt::MouseButton button, Qt::KeyboardModifiers keys)
{
  QTest::mouseRelease(window_->windowHandle(), button, keys, widget->mapTo(window_, at));
}

void WindowHands::Drag(QWidget* widget, const QPoint& from, const QPoint& to, Qt::MouseButton button, Qt::KeyboardModifiers keys)
{
  constexpr int steps = 10;
  Press(widget, from, button, keys);
  for (int i = 1; i <= steps; i++)
    Move(widget, from + (to - from) * i / steps, keys);
  Release(widget, to, button, keys);
  Settle();
}

void WindowHands::Click(QWidget* widget, const QPoint& at)
{
  QTest::mouseClick(widget, Qt::LeftButton, {}, at);
  Settle();
}

void WindowHands::Wheel(QWidget* widget, int steps, Qt::KeyboardModifiers keys)
{
  const QPointF at = widget->rect().center();
  QWheelEvent event(at, widget->mapToGlobal(at.toPoint()), {}, {0, 120 * steps}, Qt::NoButton, keys, Qt::NoScrollPhase, false);
  QApplication::sendEvent(widget, &event);
  Settle();
}

void WindowHands::Key(Qt::Key key, Qt::KeyboardModifiers keys)
{
  QWidget* focused = QApplication::focusWidget();
  QTest::keyClick(focused ? focused : window_, key, keys);
  Settle();
}

void WindowHands::Type(QWidget* field, const QString& text)
{
  field->setFocus();
  QTest::keyClick(field, Qt::Key_A, Qt::ControlModifier);
  QTest::keyClicks(field, text);
  QTest::keyClick(field, Qt::Key_Return);
  Settle();
}

bool WindowHands::Answer(const QString& label)
{
  for (auto* button : Bar()->findChildren<QPushButton*>())
    if (button->text() == label && button->isVisible()) {
      QTest::mouseClick(button, Qt::LeftButton);
      Settle();
      return true;
    }
  return false;
}

bool WindowHands::Wait(int milliseconds)
{
  const bool done = QTest::qWaitFor([this] { return JobsRunning() == 0; }, milliseconds);
  Settle();
  return done;
}

void WindowHands::Settle()
{
  for (int i = 0; i < 3; i++)
    QCoreApplication::processEvents(QEventLoop::AllEvents, 50);
}

QStringList WindowHands::Messages()
{
  return Bar()->Texts();
}

bool WindowHands::HasMessage(const QString& part)
{
  for (const QString& text : Messages())
    if (text.contains(part, Qt::CaseInsensitive))
      return true;
  return false;
}

QImage WindowHands::Grab(const QString& name)
{
  const QDir folder(QString::fromLocal8Bit(qgetenv("ECHORAMA_BUILD_DIR")) + "/screenshots");
  folder.mkpath(".");
  const QImage picture = window_->grab().toImage();
  picture.save(folder.filePath(name + ".png"));
  return picture;
}

int RunWindowTest(const char* application, int argc, char** argv, const std::function<int()>& test)
{
  qputenv("QT_FONT_DPI", "96"); // whatever the screen claims, of which Qt's versions think differently: texts have one size
  QSurfaceFormat format = QVTKOpenGLNativeWidget::defaultFormat();
  format.setSamples(0);
  QSurfaceFormat::setDefaultFormat(format);
  QApplication program(argc, argv);
  QApplication::setOrganizationName("Echorama");
  QApplication::setApplicationName(application);
  ApplyTheme(program);
  return test();
}

void FolderTest::init()
{
  folder_ = std::make_unique<QTemporaryDir>();
  qputenv("XDG_DATA_HOME", folder_->filePath("data").toLocal8Bit());
  QSettings::setPath(QSettings::NativeFormat, QSettings::UserScope, folder_->filePath("settings"));
}

void ComparePicture(const QImage& picture, const QString& name)
{
  const QString path = QString(ECHORAMA_SOURCE_DIR "/Documentation/pictures/%1.png").arg(name);
  if (qEnvironmentVariableIsSet("ECHORAMA_UPDATE_PICTURES")) {
    QVERIFY(picture.convertToFormat(QImage::Format_RGB888).save(path));
    return;
  }
  const QSize size(picture.width() / 4, picture.height() / 4);
  const auto small = [&size](const QImage& image) {
    return image.scaled(size, Qt::IgnoreAspectRatio, Qt::SmoothTransformation).convertToFormat(QImage::Format_RGB888);
  };
  const QImage wanted(path);
  QVERIFY2(!wanted.isNull(), qPrintable(path));
  QCOMPARE(picture.size(), wanted.size());
  const QImage a = small(picture), b = small(wanted);
  double sum = 0.0, worst = 0.0;
  QPoint where;
  constexpr int Block = 8;
  for (int top = 0; top < size.height(); top += Block)
    for (int left = 0; left < size.width(); left += Block) {
      double block = 0.0;
      for (int y = top; y < std::min(top + Block, size.height()); ++y)
        for (int x = 3 * left; x < 3 * std::min(left + Block, size.width()); ++x)
          block += std::abs(static_cast<int>(a.constScanLine(y)[x]) - static_cast<int>(b.constScanLine(y)[x]));
      sum += block;
      if (block > worst) {
        worst = block;
        where = QPoint(4 * left, 4 * top);
      }
    }
  const double mean = sum / (3.0 * size.width() * size.height()), square = worst / (3.0 * Block * Block);
  const QString told = QString("%1 differs by %2 grey levels, and by %3 in the square of 32 pixels at %4, %5")
                           .arg(name)
                           .arg(mean)
                           .arg(square)
                           .arg(where.x())
                           .arg(where.y());
  qInfo("%s", qPrintable(told));
  QVERIFY2(mean < 1.0 && square < 20.0, qPrintable(told));
}
