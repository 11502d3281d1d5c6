// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Core>
#include <QObject>
#include <QPointF>
#include <vector>

class vtkUltrasoundSliceView;

namespace echorama {

class Workbench;

/// Callipers and angles in the slices: clicks set the points one after the other, also in different slices; a distance can be
/// drawn with one drag. A point of an old measurement is dragged. What is finished belongs to the session: undo, backups and
/// projects have it.
class MeasureTool : public QObject {
  Q_OBJECT

public:
  explicit MeasureTool(Workbench* bench);

  ///@{ The left button at a pixel of a view, and the mouse, also while no button is down. \a reach: of a point, pixels.
  void Press(const vtkUltrasoundSliceView* view, const QPointF& pixel, double reach);
  void Move(const vtkUltrasoundSliceView* view, const QPointF& pixel);
  void Release(const vtkUltrasoundSliceView* view, const QPointF& pixel);
  ///@}
  /// Drops what is not finished, takes a drag back; false: there is neither.
  bool Cancel();
  /// What is being made, its last point at the mouse; none: nothing is.
  const std::vector<Eigen::Vector3d>& Draft() const { return draft_; }

  ///@{ The number of the one whose profile is shown; 0: none. The last that was made, or the one that somebody chose.
  void Choose(int number);
  int Chosen() const { return chosen_; }
  ///@}

signals:
  void Changed(); ///< what is being made, or what is chosen

private:
  void Place();
  bool TakePointAt(const vtkUltrasoundSliceView* view, const QPointF& pixel, double reach);

  Workbench* bench_;
  std::vector<Eigen::Vector3d> draft_;
  QPointF pressed_;
  bool isClick_ = false; ///< the press that began the draft is not released yet
  int dragged_ = 0, chosen_ = 0;
  std::size_t point_ = 0; ///< of the dragged one
};

} // namespace echorama
