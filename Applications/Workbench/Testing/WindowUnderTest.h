// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "MainWindow.h"
#include "WindowHands.h"
#include "Workspace.h"
#include <array>
#include <functional>
#include <memory>
#include <vtkNew.h>

class vtkMatrix4x4;

namespace echorama {
class SliceCanvas;
}

/// A workbench on the screen.
class WindowUnderTest : public WindowHands {
public:
  WindowUnderTest();
  ~WindowUnderTest();

  echorama::MainWindow& Window() { return *window_; }
  vtkUltrasoundAlignmentSession* Session() const { return workspace_.session; }
  echorama::SliceCanvas* Slice(int i);
  /// Opens files and waits until they are there.
  bool Open(const QStringList& paths);
  std::array<double, 16> Pose(int id) const;
  /// Into ECHORAMA_BUILD_DIR/screenshots; returns the picture.
  QImage Screenshot(const QString& name);

private:
  echorama::Workspace workspace_;
  std::unique_ptr<echorama::MainWindow> window_;
};

/// Its tests, with two volumes that overlap.
class WindowTest : public FolderTest {
  Q_OBJECT

public:
  static int Run(int argc, char** argv, const std::function<int()>& test)
  {
    return RunWindowTest("WorkbenchTest", argc, argv, test);
  }

protected:
  void init() override;
  virtual QString A() { return WriteVolume("left.mha", 1, {0, 0, 0}); }
  virtual QString B() { return WriteVolume("right.mha", 2, {12, 4, 0}); }
  QString WriteVolume(const QString& name, int seed, std::array<double, 3> middle, int side = 48, bool repeats = false);
};

/// Writes a MetaImage of bytes: a bright shell and some blobs in speckle, with a border that is not real. \a seed makes
/// different ones. Spacing 1 mm, the middle at \a middle. With \a repeats, the same every 16 mm instead, without speckle.
QString WriteVolume(const QDir& folder, const QString& name, int seed, std::array<double, 3> middle, int side = 48,
                    bool repeats = false);
