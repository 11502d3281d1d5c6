// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <QPointF>
#include <QVector>
#include <QWidget>
#include <vtkSmartPointer.h>
#include <vtkType.h>

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
/// wheel and the right one zoom. A click selects the volume there (Ctrl: beside the others), a second one that behind it.
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
  /// Redraws soon, as coarsely as it takes to keep up; the fine picture follows when nothing happens any more.
  void Ask();
  void DrawNow();

signals:
  void LargeAsked();

protected:
  bool eventFilter(QObject* object, QEvent* event) override;

private:
  void Look();
  void FitToNew();
  void SelectAt(const QPointF& position, bool add);
  void OnTurning(vtkObject* style, unsigned long event, void* data);
  void Refine();

  Workbench* bench_;
  QVTKOpenGLNativeWidget* canvas_;
  vtkSmartPointer<vtkUltrasoundVolumeView> view_;
  /// A slice, and when what is seen of it here was drawn.
  struct Plane {
    vtkUltrasoundSliceView* view;
    std::array<double, 12> corners{};
    vtkMTimeType drawn = 0;
  };
  bool TakePlane(int i);
  QVector<Plane> slices_;
  AlignmentHandles* handles_;
  QComboBox* style_;
  Redraw* redraw_;
  Redraw* refine_;
  bool turning_ = false;
  QPointF pressed_; ///< where the left button went down beside all handles
  bool isClick_ = false;
  bool isPlaced_ = false; ///< the camera was moved by hand
  int volumes_ = 0;
};

} // namespace echorama
