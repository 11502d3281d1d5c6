// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <memory>
#include <QPoint>
#include <QWidget>
#include <vtkNew.h>
#include <vtkSmartPointer.h>

class QVTKOpenGLNativeWidget;
class vtkActor;
class vtkImageSlice;
class vtkImageSliceMapper;
class vtkPolyData;
class vtkPolyDataMapper;
class vtkRenderer;

namespace echorama {

class NeedleTool;
class NeedleView;
class Redraw;
class Scan;

/// The body with the probe on its skin, and the image in its place. The left button slides the probe (with Shift it tilts and
/// rocks, with Ctrl it rotates), a double click puts it there; the right one turns the view, the middle one moves it, the wheel
/// zooms. A press on the needle, or with Ctrl and Shift, takes the needle instead: drawn over the skin it enters elsewhere; with
/// Shift it is steered, with Ctrl it goes in and out, as by the wheel over it.
class BodyView : public QWidget {
  Q_OBJECT

public:
  BodyView(Scan* scan, NeedleTool* needle, QWidget* parent = nullptr);
  ~BodyView() override;

  QVTKOpenGLNativeWidget* Canvas() const { return canvas_; }
  void Fit();
  void DrawNow();
  /// Lines that are seen through the body; nullptr: none.
  void ShowMarks(vtkPolyData* lines);
  /// Where a point of the world is on the canvas, in pixels of the window system.
  QPointF ToCanvas(const double world[3]) const;

protected:
  bool eventFilter(QObject* object, QEvent* event) override;

private:
  void ShowSubject();
  void FitToSize();
  void ShowProbe();
  void ShowImage();
  void ShowNeedle();
  void Drag(const QPoint& to);
  void DragNeedle(const QPoint& to);
  bool IsOnNeedle(const QPointF& at) const;
  void RayAt(const QPointF& at, double origin[3], double direction[3]) const;

  Scan* scan_;
  NeedleTool* needle_;
  QVTKOpenGLNativeWidget* canvas_;
  vtkNew<vtkRenderer> renderer_;
  vtkNew<vtkPolyDataMapper> skinMapper_, probeMapper_, marksMapper_;
  vtkNew<vtkActor> skin_, probe_, marks_;
  vtkNew<vtkImageSliceMapper> imageMapper_;
  vtkNew<vtkImageSlice> image_;
  Redraw* redraw_;
  int waitMs_;                         ///< until what has changed is drawn
  std::array<double, 3> fittedFrom_{}; ///< where the camera was put; and for a view of so many pixels
  std::array<int, 2> fittedSize_{};
  bool isNeedleFitted_ = false;
  QString shownProbe_; ///< what the probe's surface was made for
  QPoint last_;
  QPointF grabbed_; ///< from the probe to where it was taken
  Qt::KeyboardModifiers dragKeys_;
  bool isDragging_ = false, isDraggingNeedle_ = false;
  std::unique_ptr<NeedleView> needleView_;
};

} // namespace echorama
