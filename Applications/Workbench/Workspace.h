// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <functional>
#include <QString>
#include <vtkSmartPointer.h>
#include <vtkUltrasoundAlignmentSession.h>

class vtkMatrix4x4;

namespace echorama {

class JobBar;

/// What the panels of a window share. The window owns it and outlives them.
struct Workspace {
  vtkSmartPointer<vtkUltrasoundAlignmentSession> session = vtkSmartPointer<vtkUltrasoundAlignmentSession>::New();
  JobBar* jobs = nullptr;
  std::function<void(const QString& message, bool isError)> say = [](const QString&, bool) {}; ///< in the window's message bar
  std::function<void(vtkMatrix4x4* toolToWorld, bool grasping)> moveByTool = [](vtkMatrix4x4*, bool) {}; ///< alignment widget
  std::function<void(bool shown)> showErrorVectors = [](bool) {};                                        ///< 3D view
};

} // namespace echorama
