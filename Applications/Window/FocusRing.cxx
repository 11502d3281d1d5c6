// SPDX-License-Identifier: BSD-3-Clause
#include "FocusRing.h"
#include <QAbstractItemView>
#include <QAbstractSpinBox>
#include <QApplication>
#include <QKeyEvent>
#include <QPainter>
#include <QTimer>

namespace echorama {

namespace {
constexpr int Width = 2, Gap = 1; ///< pixels of the screen's scale
}

FocusRing::FocusRing(QWidget* window) : QWidget(window)
{
  setObjectName("focusRing");
  setAttribute(Qt::WA_TransparentForMouseEvents);
  setAttribute(Qt::WA_NoSystemBackground);
  setFocusPolicy(Qt::NoFocus);
  hide();
  qApp->installEventFilter(this);
  connect(qApp, &QApplication::focusChanged, this, [this](QWidget*, QWidget* now) {
    focused_ = now;
    Follow();
  });
}

void FocusRing::Follow()
{
  QWidget* part = focused_;
  // A field has its arrows, a list its frame.
  if (part && (qobject_cast<QAbstractSpinBox*>(part->parentWidget()) || qobject_cast<QAbstractScrollArea*>(part->parentWidget())))
    part = part->parentWidget();
  const bool isShown = isByKeys_ && part && part->isVisible() && parentWidget()->isAncestorOf(part);
  if (isShown) {
    const int around = Width + Gap;
    setGeometry(QRect(part->mapTo(parentWidget(), QPoint(0, 0)), part->size())
                    .adjusted(-around, -around, around, around)
                    .intersected(parentWidget()->rect()));
    // Views are windows of their own, so this becomes one over them: what is within the frame must be no part of it.
    setMask(QRegion(rect()).subtracted(rect().adjusted(Width, Width, -Width, -Width)));
    raise();
  }
  setVisible(isShown);
}

bool FocusRing::eventFilter(QObject* object, QEvent* event)
{
  switch (event->type()) {
  case QEvent::KeyPress: {
    const int key = static_cast<QKeyEvent*>(event)->key();
    if (key == Qt::Key_Tab || key == Qt::Key_Backtab)
      isByKeys_ = true;
    break;
  }
  case QEvent::Shortcut:
    isByKeys_ = true;
    break;
  case QEvent::MouseButtonPress:
    isByKeys_ = false;
    Follow();
    break;
  case QEvent::Move:
  case QEvent::Resize:
  case QEvent::Show:
  case QEvent::Hide:
    // Layouts and scrolling move what has the focus.
    if (focused_ && object != this && object->isWidgetType() &&
        (object == focused_ || static_cast<QWidget*>(object)->isAncestorOf(focused_)))
      QTimer::singleShot(0, this, [this] { Follow(); });
    break;
  default:
    break;
  }
  return false;
}

void FocusRing::paintEvent(QPaintEvent*)
{
  QPainter painter(this);
  painter.setPen(QPen(palette().color(QPalette::Link), Width, Qt::SolidLine, Qt::SquareCap, Qt::MiterJoin));
  const int half = Width / 2;
  painter.drawRect(rect().adjusted(half, half, -half, -half));
}

} // namespace echorama
