// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QVector>
#include <QVTKOpenGLNativeWidget.h>
#include <string>
#include <utility>
#include <vtkSmartPointer.h>

class vtkUltrasoundSliceView;

namespace echorama {

class AlignmentHandles;
class Redraw;
class Workbench;

/// The picture of one slice, and what mouse and keys do in it.
///
/// | mouse                 | does                                                                            |
/// | --------------------- | ------------------------------------------------------------------------------- |
/// | left                  | what the tool in hand does: moves volumes, paints, carves, restores, marks, measures, points |
/// | wheel                 | goes through the slices, by one voxel (Shift: ten)                              |
/// | Ctrl + wheel          | zooms at the mouse                                                              |
/// | middle drag           | moves the picture; with Shift: turns the plane, which becomes oblique           |
/// | right drag            | grey levels: contrast to the sides, brightness up and down                      |
/// | double click          | makes the view large, and back                                                  |
/// | Escape                | takes a drag back: a stroke, a landmark, a measurement; else brings back all volumes |
class SliceCanvas : public QVTKOpenGLNativeWidget {
  Q_OBJECT

public:
  SliceCanvas(Workbench* bench, QWidget* parent = nullptr);
  ~SliceCanvas() override;

  vtkUltrasoundSliceView* View() const;
  void Ask();     ///< redraw soon
  void DrawNow(); ///< for tests and screenshots
  /// A widget position as a pixel of the view (from the lower left, device pixels).
  QPointF PixelOf(const QPointF& position) const;
  QPointF PositionOf(const QPointF& pixel) const;
  /// Whether somebody has chosen what is seen here, so that it is not to be fitted again.
  bool IsPlaced() const { return isPlaced_; }
  void SetPlaced(bool placed) { isPlaced_ = placed; }

signals:
  void PlaneChanged();
  void Drawn();
  void LargeAsked();

protected:
  bool event(QEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void mouseDoubleClickEvent(QMouseEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  void enterEvent(QEvent* event) override;
  void leaveEvent(QEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;

private:
  enum class Drag { None, Widget, Cursor, Stroke, Landmark, Measure, Pan, Turn, Window };

  bool IsForHandles(QEvent* event) const;
  bool HandleEvent(QEvent* event);
  void OnRenderAsked();
  bool IsWatching() const; ///< something is dragged in another view
  void Look();
  /// The volume that a tool changes; 0, and says so, when it is not clear which.
  int VolumeToChange(const QString& toSelectOne);
  void BeginStroke(const double point[3]);
  void BeginLandmark(const QPointF& pixel, const double point[3]);
  void DragLandmark(const double point[3]);
  void CancelStroke();
  void ShowPointer();
  void ShowDraft();
  Qt::MouseButton ButtonOfDrag() const;
  void EndDrag();
  void ShowBrush(const double point[3]);
  void Scroll(double steps);
  void ChangeWindow(const QPointF& by);
  void ChangePlane();

  Workbench* bench_;
  vtkSmartPointer<vtkUltrasoundSliceView> view_;
  AlignmentHandles* handles_;
  Redraw* redraw_;
  Drag drag_ = Drag::None;
  QPointF last_;
  QVector<int> selected_;                ///< before the last press
  std::pair<int, std::string> landmark_; ///< that is dragged: volume and label
  bool isPlaced_ = false, isPointed_ = false;
};

} // namespace echorama
