// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <functional>
#include <memory>
#include <QDir>
#include <QImage>
#include <QMainWindow>
#include <QPoint>
#include <QString>
#include <QStringList>
#include <QTemporaryDir>

namespace echorama {
class MessageBar;
}

/// Hands to use a window on the screen with.
class WindowHands {
public:
  /// With 1280 x 800 pixels; before anything else.
  void ShowWindow(QMainWindow* window);

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

  /// Until nothing runs in the background.
  bool Wait(int milliseconds = 120000);
  /// Draws what waits to be drawn.
  void Settle();
  QStringList Messages();
  bool HasMessage(const QString& part);
  /// The window as it is, also into ECHORAMA_BUILD_DIR/screenshots.
  QImage Grab(const QString& name);

private:
  echorama::MessageBar* Bar() const;
  int JobsRunning() const;

  QMainWindow* window_ = nullptr;
};

/// What tests of windows begin with: a folder of their own, with no remembered layout and no session that another test left.
class FolderTest : public QObject {
  Q_OBJECT

protected slots:
  virtual void init();

protected:
  QDir Folder() const { return QDir(folder_->path()); }

private:
  std::unique_ptr<QTemporaryDir> folder_;
};

/// The main() of a test program. \a test is made when the application is there.
int RunWindowTest(const char* application, int argc, char** argv, const std::function<int()>& test);

/// Holds a picture of the manual against Documentation/pictures/NAME.png, but for what font versions do;
/// ECHORAMA_UPDATE_PICTURES=1 replaces that.
void ComparePicture(const QImage& picture, const QString& name);
