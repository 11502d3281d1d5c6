// SPDX-License-Identifier: BSD-3-Clause
#include "WindowUnderTest.h"
#include "FileActions.h"
#include "JobBar.h"
#include "MessageBar.h"
#include "SliceCanvas.h"
#include "SlicePane.h"
#include "Theme.h"
#include "ViewGrid.h"
#include "VolumePane.h"
#include <cmath>
#include <QApplication>
#include <QDropEvent>
#include <QFile>
#include <QMimeData>
#include <QPushButton>
#include <QSettings>
#include <QSurfaceFormat>
#include <QtTest>
#include <QUrl>
#include <QVTKOpenGLNativeWidget.h>
#include <QWheelEvent>
#include <QWindow>
#include <vtkMatrix4x4.h>

using namespace echorama;

WindowUnderTest::WindowUnderTest() : window_(std::make_unique<MainWindow>(workspace_))
{
  window_->resize(1280, 800);
  window_->move(0, 0);
  window_->show();
  if (!QTest::qWaitForWindowExposed(window_.get()))
    qFatal("the window does not come");
  QApplication::setActiveWindow(window_.get());
  Settle();
}

WindowUnderTest::~WindowUnderTest() = default;

SliceCanvas* WindowUnderTest::Slice(int i)
{
  return window_->Views()->Slices()[static_cast<std::size_t>(i)]->Canvas();
}

void WindowUnderTest::Drop(const QStringList& paths)
{
  QMimeData data;
  QList<QUrl> urls;
  for (const QString& path : paths)
    urls.append(QUrl::fromLocalFile(path));
  data.setUrls(urls);
  QDragEnterEvent enter({100, 100}, Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
  QApplication::sendEvent(window_.get(), &enter);
  QVERIFY(enter.isAccepted());
  QDropEvent drop(QPointF(100, 100), Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
  QApplication::sendEvent(window_.get(), &drop);
}

void WindowUnderTest::Press(QWidget* widget, const QPoint& at, Qt::MouseButton button, Qt::KeyboardModifiers keys)
{
  Move(widget, at, keys);
  QTest::mousePress(window_->windowHandle(), button, keys, widget->mapTo(window_.get(), at));
}

void WindowUnderTest::Move(QWidget* widget, const QPoint& to, Qt::KeyboardModifiers)
{
  QTest::mouseMove(window_->windowHandle(), widget->mapTo(window_.get(), to));
  QCoreApplication::processEvents();
}

void WindowUnderTest::Release(QWidget* widget, const QPoint& at, Qt::MouseButton button, Qt::KeyboardModifiers keys)
{
  QTest::mouseRelease(window_->windowHandle(), button, keys, widget->mapTo(window_.get(), at));
}

void WindowUnderTest::Drag(QWidget* widget, const QPoint& from, const QPoint& to, Qt::MouseButton button,
                           Qt::KeyboardModifiers keys)
{
  constexpr int steps = 10;
  Press(widget, from, button, keys);
  for (int i = 1; i <= steps; i++)
    Move(widget, from + (to - from) * i / steps, keys);
  Release(widget, to, button, keys);
  Settle();
}

void WindowUnderTest::Click(QWidget* widget, const QPoint& at)
{
  QTest::mouseClick(widget, Qt::LeftButton, {}, at);
  Settle();
}

void WindowUnderTest::Wheel(QWidget* widget, int steps, Qt::KeyboardModifiers keys)
{
  const QPointF at = widget->rect().center();
  QWheelEvent event(at, widget->mapToGlobal(at.toPoint()), {}, {0, 120 * steps}, Qt::NoButton, keys, Qt::NoScrollPhase, false);
  QApplication::sendEvent(widget, &event);
  Settle();
}

void WindowUnderTest::Key(Qt::Key key, Qt::KeyboardModifiers keys)
{
  QWidget* focused = QApplication::focusWidget();
  QTest::keyClick(focused ? focused : window_.get(), key, keys);
  Settle();
}

void WindowUnderTest::Type(QWidget* field, const QString& text)
{
  field->setFocus();
  QTest::keyClick(field, Qt::Key_A, Qt::ControlModifier);
  QTest::keyClicks(field, text);
  QTest::keyClick(field, Qt::Key_Return);
  Settle();
}

bool WindowUnderTest::Answer(const QString& label)
{
  for (auto* button : window_->Said()->findChildren<QPushButton*>())
    if (button->text() == label && button->isVisible()) {
      QTest::mouseClick(button, Qt::LeftButton);
      Settle();
      return true;
    }
  return false;
}

bool WindowUnderTest::Open(const QStringList& paths)
{
  window_->Files()->Open(paths);
  return Wait(30000);
}

bool WindowUnderTest::Wait(int milliseconds)
{
  const bool done = QTest::qWaitFor([this] { return window_->Jobs()->Count() == 0; }, milliseconds);
  Settle();
  return done;
}

void WindowUnderTest::Settle()
{
  for (int i = 0; i < 3; i++)
    QCoreApplication::processEvents(QEventLoop::AllEvents, 50);
}

QStringList WindowUnderTest::Messages()
{
  return window_->Said()->Texts();
}

bool WindowUnderTest::HasMessage(const QString& part)
{
  for (const QString& text : Messages())
    if (text.contains(part, Qt::CaseInsensitive))
      return true;
  return false;
}

std::array<double, 16> WindowUnderTest::Pose(int id) const
{
  vtkNew<vtkMatrix4x4> matrix;
  Session()->GetVolumeToWorld(id, matrix);
  std::array<double, 16> pose;
  std::copy_n(matrix->GetData(), 16, pose.begin());
  return pose;
}

QImage WindowUnderTest::Screenshot(const QString& name)
{
  QTest::qWait(400); // full quality comes a moment after the last motion
  for (SlicePane* pane : window_->Views()->Slices())
    pane->Canvas()->DrawNow();
  window_->Views()->Volume()->DrawNow();
  Settle();
  const QDir folder(QString::fromLocal8Bit(qgetenv("ECHORAMA_BUILD_DIR")) + "/screenshots");
  folder.mkpath(".");
  const QImage picture = window_->grab().toImage();
  picture.save(folder.filePath(name + ".png"));
  return picture;
}

int WindowTest::Run(int argc, char** argv, const std::function<int()>& test)
{
  qputenv("QT_FONT_DPI", "96"); // whatever the screen claims, of which Qt's versions think differently: texts have one size
  QSurfaceFormat format = QVTKOpenGLNativeWidget::defaultFormat();
  format.setSamples(0);
  QSurfaceFormat::setDefaultFormat(format);
  QApplication application(argc, argv);
  QApplication::setOrganizationName("Echorama");
  QApplication::setApplicationName("WorkbenchTest");
  ApplyTheme(application);
  return test();
}

void WindowTest::init()
{
  folder_ = std::make_unique<QTemporaryDir>();
  qputenv("XDG_DATA_HOME", folder_->filePath("data").toLocal8Bit());
  QSettings::setPath(QSettings::NativeFormat, QSettings::UserScope, folder_->filePath("settings"));
}

QString WindowTest::WriteVolume(const QString& name, int seed, std::array<double, 3> middle, int side, bool repeats)
{
  return ::WriteVolume(Folder(), name, seed, middle, side, repeats);
}

QString WriteVolume(const QDir& folder, const QString& name, int seed, std::array<double, 3> middle, int side, bool repeats)
{
  QByteArray voxels(side * side * side, '\0');
  unsigned int state = 12345u + static_cast<unsigned int>(seed);
  const auto random = [&state] { return (state = state * 1664525u + 1013904223u) >> 8; };
  for (int k = 2; k < side - 2; k++)
    for (int j = 2; j < side - 2; j++)
      for (int i = 2; i < side - 2; i++) {
        // The anatomy belongs to the world, so that volumes of different middles overlap in it.
        const double x = i - side / 2 + middle[0], y = j - side / 2 + middle[1], z = k - side / 2 + middle[2];
        const double wave = std::sin(0.21 * x + 0.5) * std::cos(0.17 * y) * std::sin(0.19 * z + 1.0);
        const double shell = std::exp(-std::pow(std::sqrt(x * x + y * y + 0.6 * z * z) - 17.0, 2) / 6.0);
        const double anatomy = (70.0 + 60.0 * wave + 90.0 * shell) * (0.7 + 0.6 * (random() % 1000) / 1000.0);
        const double turn = 2.0 * M_PI / 16.0; // per voxel
        const double grey = repeats ? 100.0 + 60.0 * std::sin(turn * x) * std::sin(turn * y) * std::sin(turn * z) : anatomy;
        voxels[(k * side + j) * side + i] = static_cast<char>(static_cast<unsigned char>(std::fmin(std::fmax(grey, 1.0), 255.0)));
      }
  const QString path = folder.filePath(name);
  QFile file(path);
  if (!file.open(QIODevice::WriteOnly))
    qFatal("cannot write %s", qPrintable(path));
  const auto corner = [&](int axis) { return QByteArray::number(middle[static_cast<std::size_t>(axis)] - side / 2); };
  const QByteArray size = QByteArray::number(side);
  file.write("ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
             "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = " +
             corner(0) + " " + corner(1) + " " + corner(2) + "\nElementSpacing = 1 1 1\nDimSize = " + size + " " + size + " " +
             size + "\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n" + voxels);
  return path;
}
