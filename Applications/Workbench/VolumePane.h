// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QVector>
#include <QWidget>
#include <vtkSmartPointer.h>

class QComboBox;
class QVTKOpenGLNativeWidget;
class vtkObject;
class vtkUltrasoundSliceView;
class vtkUltrasoundVolumeView;

namespace echorama {

class AlignmentHandles;
class Redraw;
class SliceCanvas;
class Workbench;

/// The 3D view with its row of controls. The left button turns (on a handle of a volume: moves that), the middle one pans, the
/// wheel and the right one zoom.
class VolumePane : public QWidget {
  Q_OBJECT

public:
  explicit VolumePane(Workbench* bench, QWidget* parent = nullptr);
  ~VolumePane() override;

  vtkUltrasoundVolumeView* View() const;
  AlignmentHandles* Handles() const { return handles_; }
  QVTKOpenGLNativeWidget* Canvas() const { return canvas_; }
  /// Shows the plane of a slice, with its picture.
  void AddSlice(SliceCanvas* slice);
  void Fit();
  void Ask();
  void DrawNow();

signals:
  void LargeAsked();

protected:
  bool eventFilter(QObject* object, QEvent* event) override;

private:
  void Look();
  void OnTurning(vtkObject* style, unsigned long event, void* data);
  void SetCoarse(bool coarse);

  Workbench* bench_;
  QVTKOpenGLNativeWidget* canvas_;
  vtkSmartPointer<vtkUltrasoundVolumeView> view_;
  QVector<vtkUltrasoundSliceView*> slices_;
  AlignmentHandles* handles_;
  QComboBox* style_;
  Redraw* redraw_;
  Redraw* refine_;
};

} // namespace echorama
