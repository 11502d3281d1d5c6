// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QEvent>
#include <QScrollArea>
#include <QScrollBar>
#include <QStyle>

namespace echorama {

/// Shows a panel that may be longer than the window: it scrolls upright, and is never so narrow that the panel is cut off.
class PanelScroll : public QScrollArea {
public:
  explicit PanelScroll(QWidget* panel, QWidget* parent = nullptr) : QScrollArea(parent)
  {
    setWidgetResizable(true);
    setFocusPolicy(Qt::NoFocus); // keys are for the views
    setFrameShape(QFrame::NoFrame);
    setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
    setWidget(panel);
  }
  QSize minimumSizeHint() const override
  {
    const int bar = style()->pixelMetric(QStyle::PM_ScrollBarExtent, nullptr, verticalScrollBar());
    return {widget()->minimumSizeHint().width() + bar, QScrollArea::minimumSizeHint().height()};
  }

protected:
  bool eventFilter(QObject* object, QEvent* event) override
  {
    if (object == widget() && event->type() == QEvent::LayoutRequest)
      updateGeometry(); // a longer text, a larger font
    return QScrollArea::eventFilter(object, event);
  }
};

} // namespace echorama
