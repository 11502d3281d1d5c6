// SPDX-License-Identifier: BSD-3-Clause
#include "ImageView.h"
#include <cmath>
#include <QMouseEvent>
#include <QPainter>
#include <QWheelEvent>

namespace echorama {

namespace {

constexpr int Margin = 44;         ///< for ruler and mark
constexpr double GripPixels = 9.0; ///< how near to an end of a line a press takes it

} // namespace

ImageView::ImageView(QWidget* parent) : QWidget(parent)
{
  setObjectName("imageView");
  setProperty("isView", true);
  setAccessibleName(tr("Live image"));
  setFocusPolicy(Qt::StrongFocus);
  setMinimumSize(240, 200);
  setAutoFillBackground(true);
  QPalette black = palette();
  black.setColor(QPalette::Window, Qt::black);
  setPalette(black);
}

void ImageView::SetPicture(const PlanePicture& picture)
{
  picture_ = picture;
  update();
}

void ImageView::SetState(const QString& sentence, bool stale)
{
  if (state_ == sentence && isStale_ == stale)
    return;
  state_ = sentence;
  isStale_ = stale;
  update();
}

void ImageView::SetCorner(const QString& text)
{
  if (corner_ == text)
    return;
  corner_ = text;
  update();
}

void ImageView::SetFocusDepth(double mm)
{
  focusMm_ = mm;
  update();
}

void ImageView::SetTip(const std::optional<QPointF>& mm)
{
  tip_ = mm;
  update();
}

void ImageView::SetMeasuring(bool measuring)
{
  isMeasuring_ = measuring;
  if (!measuring && isOpen_) {
    callipers_.pop_back(); // it never got its other end
    isOpen_ = false;
    emit CallipersChanged();
  }
  setCursor(measuring ? Qt::CrossCursor : Qt::ArrowCursor);
  update();
}

void ImageView::ClearCallipers()
{
  callipers_.clear();
  isOpen_ = false;
  draggedLine_ = -1;
  emit CallipersChanged();
  update();
}

QRectF ImageView::Frame() const
{
  const QRectF room = QRectF(rect()).adjusted(Margin, Margin / 2.0, -Margin, -Margin / 2.0);
  const QRectF mm = picture_.Rect();
  if (mm.isEmpty() || room.isEmpty())
    return room;
  const double scale = std::min(room.width() / mm.width(), room.height() / mm.height());
  QRectF frame(QPointF(), mm.size() * scale);
  frame.moveCenter(room.center());
  frame.moveTop(room.top());
  return frame;
}

QPointF ImageView::ToWidget(const QPointF& mm) const
{
  const QRectF plane = picture_.Rect(), frame = Frame();
  if (plane.isEmpty())
    return frame.center();
  const double across = (mm.x() - plane.left()) / plane.width(), down = (mm.y() - plane.top()) / plane.height();
  return {frame.left() + (picture_.isFlipped ? 1.0 - across : across) * frame.width(), frame.top() + down * frame.height()};
}

QPointF ImageView::ToPlane(const QPointF& at) const
{
  const QRectF plane = picture_.Rect(), frame = Frame();
  if (plane.isEmpty())
    return {};
  const double across = (at.x() - frame.left()) / frame.width(), down = (at.y() - frame.top()) / frame.height();
  return {plane.left() + (picture_.isFlipped ? 1.0 - across : across) * plane.width(), plane.top() + down * plane.height()};
}

void ImageView::paintEvent(QPaintEvent*)
{
  QPainter painter(this);
  painter.setRenderHints(QPainter::Antialiasing | QPainter::SmoothPixmapTransform);
  const QRectF frame = Frame();
  if (!picture_.image.isNull()) {
    painter.setOpacity(isStale_ ? 0.3 : 1.0);
    painter.drawImage(frame, picture_.image);
    painter.setOpacity(1.0);
    QPolygonF fan; // where it is dark inside, nothing is known
    for (const QPointF& mm : picture_.fan)
      fan.append(ToWidget(mm));
    painter.setPen(QColor(70, 70, 74));
    painter.setBrush(Qt::NoBrush);
    painter.drawPolygon(fan);
    PaintRuler(painter, frame);
    PaintCallipers(painter);
    PaintTip(painter);
  }
  PaintState(painter);
}

void ImageView::PaintRuler(QPainter& painter, const QRectF& frame) const
{
  painter.setPen(QColor(150, 150, 150));
  const double right = frame.right() + 6.0;
  const QRectF plane = picture_.Rect();
  for (int mm = 0; mm <= plane.bottom(); mm += 10) {
    const double y = ToWidget({0.0, static_cast<double>(mm)}).y();
    const bool isLong = mm % 50 == 0;
    painter.drawLine(QPointF(right, y), QPointF(right + (isLong ? 8.0 : 4.0), y));
    if (isLong)
      painter.drawText(QPointF(right + 10.0, y + 4.0), QString::number(mm));
  }
  if (focusMm_ > 0.0 && focusMm_ < plane.bottom()) {
    const double y = ToWidget({0.0, focusMm_}).y();
    painter.setBrush(QColor(220, 190, 90));
    painter.drawPolygon(QPolygonF({{right, y}, {right + 8.0, y - 4.0}, {right + 8.0, y + 4.0}}));
  }
  // The side of the probe that carries its mark: +x of its frame.
  painter.setBrush(QColor(90, 160, 220));
  painter.setPen(Qt::NoPen);
  painter.drawEllipse(QPointF(picture_.isFlipped ? frame.left() - 14.0 : frame.right() + 14.0, frame.top() - 6.0), 5.0, 5.0);
}

void ImageView::PaintCallipers(QPainter& painter) const
{
  painter.setPen(QPen(QColor(250, 220, 90), 1.5));
  for (std::size_t i = 0; i < callipers_.size(); i++) {
    const QLineF& line = callipers_[i].line;
    const QPointF a = ToWidget(line.p1()), b = ToWidget(line.p2());
    const bool isOpen = isOpen_ && i + 1 == callipers_.size();
    for (const QPointF& at : isOpen ? QVector<QPointF>{a} : QVector<QPointF>{a, b}) {
      painter.drawLine(at - QPointF(6.0, 0.0), at + QPointF(6.0, 0.0));
      painter.drawLine(at - QPointF(0.0, 6.0), at + QPointF(0.0, 6.0));
    }
    if (isOpen)
      continue;
    QPen dotted = painter.pen();
    dotted.setStyle(Qt::DotLine);
    painter.save();
    painter.setPen(dotted);
    painter.drawLine(a, b);
    painter.restore();
    painter.drawText((a.x() > b.x() ? a : b) + QPointF(9.0, -6.0), tr("%1 mm").arg(line.length(), 0, 'f', 1));
  }
}

// Two strokes beside it, so that the echo itself is not covered.
void ImageView::PaintTip(QPainter& painter) const
{
  if (!tip_)
    return;
  const QPointF at = ToWidget(*tip_);
  painter.setPen(QPen(QColor(110, 230, 140), 1.5));
  for (double side : {-1.0, 1.0})
    painter.drawLine(at + QPointF(side * 7.0, 0.0), at + QPointF(side * 13.0, 0.0));
}

void ImageView::PaintState(QPainter& painter) const
{
  painter.setPen(QColor(220, 190, 90));
  painter.drawText(QPointF(10.0, 20.0), corner_);
  if (state_.isEmpty())
    return;
  QFont font = painter.font();
  font.setPointSizeF(1.25 * font.pointSizeF());
  painter.setFont(font);
  const QRectF room = QRectF(rect()).adjusted(30, 30, -30, -30);
  QRectF text = painter.boundingRect(room, Qt::AlignCenter | Qt::TextWordWrap, state_);
  painter.setPen(Qt::NoPen);
  painter.setBrush(QColor(60, 40, 36, 225));
  painter.drawRoundedRect(text.adjusted(-12, -8, 12, 8), 4, 4);
  painter.setPen(QColor(240, 225, 215));
  painter.drawText(room, Qt::AlignCenter | Qt::TextWordWrap, state_);
}

bool ImageView::TakeEndAt(const QPointF& at)
{
  const auto count = static_cast<int>(callipers_.size());
  for (int i = count - 1; i >= 0; i--)
    for (int end : {0, 1}) {
      const QLineF& line = callipers_[static_cast<std::size_t>(i)].line;
      if (QLineF(ToWidget(end == 0 ? line.p1() : line.p2()), at).length() <= GripPixels && !(isOpen_ && i + 1 == count)) {
        draggedLine_ = i;
        draggedEnd_ = end;
        return true;
      }
    }
  return false;
}

void ImageView::SetEnd(CalliperLine& calliper, int end, const QPointF& mm) const
{
  end == 0 ? calliper.line.setP1(mm) : calliper.line.setP2(mm);
  (end == 0 ? calliper.from : calliper.to) = picture_.probeToWorld;
}

void ImageView::mousePressEvent(QMouseEvent* event)
{
  if (!isMeasuring_ || event->button() != Qt::LeftButton || picture_.image.isNull() || TakeEndAt(event->localPos()))
    return;
  const QPointF mm = ToPlane(event->localPos());
  if (!isOpen_) {
    callipers_.emplace_back();
    SetEnd(callipers_.back(), 0, mm);
  }
  SetEnd(callipers_.back(), 1, mm);
  isOpen_ = !isOpen_;
  emit CallipersChanged();
  update();
}

void ImageView::mouseMoveEvent(QMouseEvent* event)
{
  if (draggedLine_ < 0 || draggedLine_ >= static_cast<int>(callipers_.size()))
    return;
  SetEnd(callipers_[static_cast<std::size_t>(draggedLine_)], draggedEnd_, ToPlane(event->localPos()));
  emit CallipersChanged();
  update();
}

void ImageView::mouseReleaseEvent(QMouseEvent*)
{
  draggedLine_ = -1;
}

void ImageView::wheelEvent(QWheelEvent* event)
{
  // With Alt the wheel counts across.
  const QPoint delta = event->angleDelta();
  emit WheelTurned((delta.y() != 0 ? delta.y() : delta.x()) / 120.0, event->modifiers());
  event->accept();
}

} // namespace echorama
