// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QObject>
#include <vtkSmartPointer.h>

class QWidget;
class vtkObject;
class vtkRenderer;
class vtkRenderWindowInteractor;
class vtkUltrasoundAlignmentWidget;

namespace echorama {

class Workbench;

/// Keys go to the view under the mouse, unless somebody types elsewhere.
void FocusUnlessTyping(QWidget* view);

/// The alignment widget of one view: there while volumes are moved by hand (the tool Align), with the sensitivity and the steps
/// that the pose panel sets.
class AlignmentHandles : public QObject {
  Q_OBJECT

public:
  AlignmentHandles(Workbench* bench, vtkRenderWindowInteractor* interactor, vtkRenderer* renderer, QObject* parent);
  ~AlignmentHandles() override;
  vtkUltrasoundAlignmentWidget* Widget() const;

private:
  void Follow();
  void OnKey(vtkObject* widget, unsigned long event, void* data);
  void OnWidgetEvent(vtkObject* widget, unsigned long event, void* data);

  Workbench* bench_;
  vtkSmartPointer<vtkUltrasoundAlignmentWidget> widget_;
  bool isFollowing_ = false;
};

} // namespace echorama
