// SPDX-License-Identifier: BSD-3-Clause
#include "ProfilePlot.h"
#include <algorithm>
#include <cmath>
#include <QKeyEvent>
#include <QMouseEvent>
#include <QPainter>

namespace echorama {

namespace {

// 1, 2 or 5 times a power of ten, so that some four steps fit.
double TickOf(double range)
{
  const double rough = range / 4.0, ten = std::pow(10.0, std::floor(std::log10(rough)));
  return (rough >= 5.0 * ten ? 5.0 : rough >= 2.0 * ten ? 2.0 : 1.0) * ten;
}

} // namespace

ProfilePlot::ProfilePlot(QWidget* parent) : QWidget(parent)
{
  setObjectName("profile");
  setAccessibleName(tr("Profile: grey levels along the distance that was measured"));
  setToolTip(tr("Grey levels of each volume along the distance that was measured (tool Measure, key 7), over mm from its first "
                "end. Edges of the same tissue at different places are a shift. The mouse, or arrow keys, point at a place."));
  setMouseTracking(true);
  setFocusPolicy(Qt::TabFocus);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
}

void ProfilePlot::SetCurves(QVector<Curve> curves, double lengthMm, double lowest, double highest)
{
  curves_ = std::move(curves);
  lengthMm_ = lengthMm;
  lowest_ = lowest;
  highest_ = highest > lowest ? highest : lowest + 1.0;
  update();
}

QRectF ProfilePlot::Frame() const
{
  return QRectF(rect()).adjusted(34.0, 6.0, -8.0, -20.0);
}

void ProfilePlot::paintEvent(QPaintEvent*)
{
  QPainter painter(this);
  const QRectF frame = Frame();
  painter.fillRect(rect(), QColor(24, 24, 24));
  painter.setPen(QColor(150, 150, 150));
  if (!(lengthMm_ > 0.0)) {
    painter.drawText(rect().adjusted(8, 0, -8, 0), Qt::AlignCenter | Qt::TextWordWrap,
                     tr("Measure a distance: grey levels along it are shown here."));
    return;
  }
  const auto x = [&](double mm) { return frame.left() + frame.width() * mm / lengthMm_; };
  const auto y = [&](double grey) { return frame.bottom() - frame.height() * (grey - lowest_) / (highest_ - lowest_); };
  const double acrossTick = TickOf(lengthMm_), upTick = TickOf(highest_ - lowest_);
  for (double mm = 0.0; mm <= lengthMm_ * 1.0001; mm += acrossTick) {
    painter.setPen(QColor(60, 60, 60));
    painter.drawLine(QPointF(x(mm), frame.top()), QPointF(x(mm), frame.bottom()));
    painter.setPen(QColor(170, 170, 170));
    painter.drawText(QRectF(x(mm) - 30.0, frame.bottom() + 2.0, 60.0, 16.0), Qt::AlignCenter, QString::number(mm, 'g', 3));
  }
  for (double grey = std::ceil(lowest_ / upTick) * upTick; grey <= highest_; grey += upTick) {
    painter.setPen(QColor(60, 60, 60));
    painter.drawLine(QPointF(frame.left(), y(grey)), QPointF(frame.right(), y(grey)));
    painter.setPen(QColor(170, 170, 170));
    painter.drawText(QRectF(0.0, y(grey) - 8.0, frame.left() - 4.0, 16.0), Qt::AlignRight | Qt::AlignVCenter,
                     QString::number(grey, 'g', 4));
  }
  painter.drawText(QRectF(frame.right() - 40.0, frame.top() + 2.0, 38.0, 16.0), Qt::AlignRight, tr("mm"));
  painter.setRenderHint(QPainter::Antialiasing);
  painter.setClipRect(frame);
  for (const Curve& curve : curves_) {
    painter.setPen(QPen(curve.colour, 1.5));
    QPolygonF path;
    const auto draw = [&] {
      if (path.size() > 1)
        painter.drawPolyline(path);
      path.clear();
    };
    for (std::size_t i = 0; i < curve.values.size(); ++i) {
      if (std::isfinite(curve.values[i]))
        path.append({x(lengthMm_ * static_cast<double>(i) / static_cast<double>(curve.values.size() - 1)), y(curve.values[i])});
      else
        draw(); // a gap: no data
    }
    draw();
  }
  if (pointed_) {
    painter.setPen(QPen(QColor(90, 240, 240), 1.0, Qt::DashLine));
    painter.drawLine(QPointF(x(*pointed_ * lengthMm_), frame.top()), QPointF(x(*pointed_ * lengthMm_), frame.bottom()));
  }
  if (hasFocus()) {
    painter.setClipping(false);
    painter.setPen(palette().color(QPalette::Highlight));
    painter.drawRect(rect().adjusted(0, 0, -1, -1));
  }
}

void ProfilePlot::Point(std::optional<double> share)
{
  if (share == pointed_)
    return;
  pointed_ = share;
  update();
  if (share)
    emit PointedAt(*share);
  else
    emit Left();
}

void ProfilePlot::mouseMoveEvent(QMouseEvent* event)
{
  const QRectF frame = Frame();
  if (lengthMm_ > 0.0)
    Point(std::clamp((event->localPos().x() - frame.left()) / frame.width(), 0.0, 1.0));
}

void ProfilePlot::leaveEvent(QEvent*)
{
  Point({});
}

void ProfilePlot::focusOutEvent(QFocusEvent* event)
{
  QWidget::focusOutEvent(event);
  Point({});
}

void ProfilePlot::keyPressEvent(QKeyEvent* event)
{
  if (lengthMm_ > 0.0 && (event->key() == Qt::Key_Left || event->key() == Qt::Key_Right))
    Point(std::clamp(pointed_.value_or(0.5) + (event->key() == Qt::Key_Left ? -0.01 : 0.01), 0.0, 1.0));
  else
    QWidget::keyPressEvent(event);
}

} // namespace echorama
