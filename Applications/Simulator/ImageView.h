// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QImage>
#include <QLineF>
#include <QPolygonF>
#include <QVector>
#include <QWidget>

namespace echorama {

/// An image of the probe's plane: x across, y into the tissue, both in mm of the probe's frame.
struct PlanePicture {
  QImage image;
  QPointF topLeft;        ///< mm, the corner of the first pixel
  QSizeF pixel{1.0, 1.0}; ///< mm
  QPolygonF fan;          ///< mm, what the probe reaches

  QRectF Rect() const { return {topLeft, QSizeF(image.width() * pixel.width(), image.height() * pixel.height())}; }
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
  bool Flipped() const { return isFlipped_; }

  ///@{ Callipers: each click ends or begins a line; an end can be dragged. mm in the probe's plane; those that have both ends.
  bool Measuring() const { return isMeasuring_; }
  QVector<QLineF> Callipers() const { return isOpen_ ? callipers_.mid(0, callipers_.size() - 1) : callipers_; }
  void ClearCallipers();
  ///@}

  ///@{ Between the plane (mm) and the widget.
  QPointF ToWidget(const QPointF& mm) const;
  QPointF ToPlane(const QPointF& at) const;
  ///@}

public slots:
  void SetFlipped(bool flipped);
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
  void PaintRuler(QPainter& painter, const QRectF& frame) const;
  void PaintCallipers(QPainter& painter) const;
  void PaintState(QPainter& painter) const;

  PlanePicture picture_;
  QString state_, corner_;
  double focusMm_ = -1.0;
  bool isStale_ = false, isFlipped_ = false, isMeasuring_ = false;
  QVector<QLineF> callipers_;
  bool isOpen_ = false; ///< the last line waits for its other end
  int draggedLine_ = -1, draggedEnd_ = 0;
};

} // namespace echorama
