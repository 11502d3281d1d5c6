// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/RigidTransform.h"
#include <cmath>
#include <optional>
#include <QImage>
#include <QLineF>
#include <QPolygonF>
#include <QWidget>
#include <vector>

namespace echorama {

/// An image of the probe's plane: x across, y into the tissue, both in mm of the probe's frame.
struct PlanePicture {
  QImage image;
  QPointF topLeft;        ///< mm, the corner of the first pixel
  QSizeF pixel{1.0, 1.0}; ///< mm
  QPolygonF fan;          ///< mm, what the probe reaches
  bool isFlipped = false; ///< the first column of pixels is that of the greatest x
  Pose probeToWorld = Pose::Identity();

  QRectF Rect() const { return {topLeft, QSizeF(image.width() * pixel.width(), image.height() * pixel.height())}; }
  /// Of a place in the plane, mm; it may lie outside of the image.
  QPoint PixelAt(const QPointF& mm) const
  {
    const int across = static_cast<int>(std::floor((mm.x() - topLeft.x()) / pixel.width()));
    return {isFlipped ? image.width() - 1 - across : across,
            static_cast<int>(std::floor((mm.y() - topLeft.y()) / pixel.height()))};
  }
};

/// A line that somebody measured, and in which plane.
struct CalliperLine {
  QLineF line;                                         ///< mm
  Pose from = Pose::Identity(), to = Pose::Identity(); ///< of the probe, in the pictures that its ends were set in
  Eigen::Vector3d From() const { return from * Eigen::Vector3d(line.x1(), 0.0, line.y1()); } ///< in the world
  Eigen::Vector3d To() const { return to * Eigen::Vector3d(line.x2(), 0.0, line.y2()); }
  /// How far the one plane's ends are from where the other has them, mm: 0 for a line of one picture.
  double Apart() const
  {
    const Pose between = from.inverse() * to;
    const Eigen::Vector3d a(line.x1(), 0.0, line.y1()), b(line.x2(), 0.0, line.y2());
    return std::fmax((between * a - a).norm(), (between * b - b).norm());
  }
};

/// The live image as a scanner shows it: depth ruler, the mark of the probe's side, callipers, and what is the matter with it.
class ImageView : public QWidget {
  Q_OBJECT

public:
  explicit ImageView(QWidget* parent = nullptr);

  void SetPicture(const PlanePicture& picture);
  const PlanePicture& Picture() const { return picture_; }
  /// A sentence over the image ("" for none); \a stale: the image is dimmed, because it shows what was, not what is.
  void SetState(const QString& sentence, bool stale);
  const QString& State() const { return state_; }
  bool IsStale() const { return isStale_; }
  /// Named in the corner, such as "frozen".
  void SetCorner(const QString& text);
  void SetFocusDepth(double mm);
  /// Of a needle, mm in the plane: marked.
  void SetTip(const std::optional<QPointF>& mm);

  ///@{ Callipers: each click ends or begins a line; an end can be dragged. mm in the probe's plane; those that have both ends.
  bool Measuring() const { return isMeasuring_; }
  std::vector<CalliperLine> Callipers() const { return {callipers_.begin(), callipers_.end() - (isOpen_ ? 1 : 0)}; }
  void ClearCallipers();
  ///@}

  ///@{ Between the plane (mm) and the widget.
  QPointF ToWidget(const QPointF& mm) const;
  QPointF ToPlane(const QPointF& at) const;
  ///@}

public slots:
  void SetMeasuring(bool measuring);

signals:
  void WheelTurned(double notches, Qt::KeyboardModifiers keys);
  void CallipersChanged();

protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;

private:
  QRectF Frame() const; ///< where the picture is, in the widget
  bool TakeEndAt(const QPointF& at);
  void SetEnd(CalliperLine& calliper, int end, const QPointF& mm) const;
  void PaintRuler(QPainter& painter, const QRectF& frame) const;
  void PaintCallipers(QPainter& painter) const;
  void PaintTip(QPainter& painter) const;
  void PaintState(QPainter& painter) const;

  PlanePicture picture_;
  QString state_, corner_;
  double focusMm_ = -1.0;
  std::optional<QPointF> tip_;
  bool isStale_ = false, isMeasuring_ = false;
  std::vector<CalliperLine> callipers_;
  bool isOpen_ = false; ///< the last line waits for its other end
  int draggedLine_ = -1, draggedEnd_ = 0;
};

} // namespace echorama
