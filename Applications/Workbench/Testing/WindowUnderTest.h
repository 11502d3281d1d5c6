// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "MainWindow.h"
#include "Workspace.h"
#include <array>
#include <functional>
#include <memory>
#include <QDir>
#include <QPoint>
#include <QString>
#include <QStringList>
#include <QTemporaryDir>
#include <vtkNew.h>

class vtkMatrix4x4;

namespace echorama {
class SliceCanvas;
}

/// A workbench on the screen, and hands to use it with.
class WindowUnderTest {
public:
  WindowUnderTest();
  ~WindowUnderTest();

  echorama::MainWindow& Window() { return *window_; }
  vtkUltrasoundAlignmentSession* Session() const { return workspace_.session; }
  echorama::SliceCanvas* Slice(int i);
  /// A part by its object name; the test fails when there is none.
  template <class T>
  T* Part(const char* name)
  {
    T* part = window_->findChild<T*>(name);
    if (!part)
      qFatal("there is no %s", name);
    return part;
  }

  ///@{ Real events, through the window.
  void Drop(const QStringList& paths);
  void Press(QWidget* widget, const QPoint& at, Qt::MouseButton button = Qt::LeftButton, Qt::KeyboardModifiers keys = {});
  void Move(QWidget* widget, const QPoint& to, Qt::KeyboardModifiers keys = {});
  void Release(QWidget* widget, const QPoint& at, Qt::MouseButton button = Qt::LeftButton, Qt::KeyboardModifiers keys = {});
  void Drag(QWidget* widget, const QPoint& from, const QPoint& to, Qt::MouseButton button = Qt::LeftButton,
            Qt::KeyboardModifiers keys = {});
  void Click(QWidget* widget, const QPoint& at);
  void Wheel(QWidget* widget, int steps, Qt::KeyboardModifiers keys = {});
  void Key(Qt::Key key, Qt::KeyboardModifiers keys = {});
  void Type(QWidget* field, const QString& text);
  /// Presses the button of a message.
  bool Answer(const QString& label);
  ///@}

  /// Opens files and waits until they are there.
  bool Open(const QStringList& paths);
  /// Until nothing runs in the background.
  bool Wait(int milliseconds = 120000);
  /// Draws what waits to be drawn.
  void Settle();
  QStringList Messages();
  bool HasMessage(const QString& part);
  std::array<double, 16> Pose(int id) const;
  /// Into ECHORAMA_BUILD_DIR/screenshots; returns the picture.
  QImage Screenshot(const QString& name);

private:
  echorama::Workspace workspace_;
  std::unique_ptr<echorama::MainWindow> window_;
};

/// What tests of windows begin with: a folder of their own, with no remembered layout and no session that another test left, and
/// two volumes in it that overlap.
class WindowTest : public QObject {
  Q_OBJECT

public:
  /// The main() of a test program. \a test is made when the application is there.
  static int Run(int argc, char** argv, const std::function<int()>& test);

protected slots:
  virtual void init();

protected:
  QDir Folder() const { return QDir(folder_->path()); }
  virtual QString A() { return WriteVolume("left.mha", 1, {0, 0, 0}); }
  virtual QString B() { return WriteVolume("right.mha", 2, {12, 4, 0}); }
  QString WriteVolume(const QString& name, int seed, std::array<double, 3> middle, int side = 48, bool repeats = false);

private:
  std::unique_ptr<QTemporaryDir> folder_;
};

/// Writes a MetaImage of bytes: a bright shell and some blobs in speckle, with a border that is not real. \a seed makes
/// different ones. Spacing 1 mm, the middle at \a middle. With \a repeats, the same every 16 mm instead, without speckle.
QString WriteVolume(const QDir& folder, const QString& name, int seed, std::array<double, 3> middle, int side = 48,
                    bool repeats = false);
