// SPDX-License-Identifier: BSD-3-Clause
#include "Theme.h"
#include <QApplication>
#include <QPalette>
#include <QStyleFactory>

namespace echorama {

void ApplyTheme(QApplication& application)
{
  application.setStyle(QStyleFactory::create("Fusion"));
  const QColor window(52, 52, 54), base(38, 38, 40), text(225, 225, 225), dim(130, 130, 130), accent(74, 127, 168);
  QPalette palette;
  palette.setColor(QPalette::Window, window);
  palette.setColor(QPalette::WindowText, text);
  palette.setColor(QPalette::Base, base);
  palette.setColor(QPalette::AlternateBase, QColor(44, 44, 46));
  palette.setColor(QPalette::Text, text);
  palette.setColor(QPalette::PlaceholderText, dim);
  palette.setColor(QPalette::Button, QColor(64, 64, 67));
  palette.setColor(QPalette::ButtonText, text);
  palette.setColor(QPalette::BrightText, Qt::white);
  palette.setColor(QPalette::ToolTipBase, QColor(70, 70, 72));
  palette.setColor(QPalette::ToolTipText, text);
  palette.setColor(QPalette::Highlight, accent);
  palette.setColor(QPalette::HighlightedText, Qt::white);
  palette.setColor(QPalette::Link, QColor(130, 180, 220));
  for (QPalette::ColorRole role : {QPalette::WindowText, QPalette::Text, QPalette::ButtonText, QPalette::HighlightedText})
    palette.setColor(QPalette::Disabled, role, dim);
  application.setPalette(palette);
  application.setStyleSheet("QDockWidget::title { padding: 3px 6px; background: #3e3e41; }"
                            "QToolTip { border: 1px solid #888; padding: 2px; }"
                            "QGroupBox { font-weight: bold; margin-top: 14px; }"
                            "QGroupBox::title { subcontrol-origin: margin; left: 2px; }");
}

} // namespace echorama
