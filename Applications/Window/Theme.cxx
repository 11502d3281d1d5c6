// SPDX-License-Identifier: BSD-3-Clause
#include "Theme.h"
#include <QApplication>
#include <QPalette>
#include <QStyleFactory>

namespace echorama {

namespace {

struct Colours {
  QColor window, base, alternate, text, dim, button, toolTip, accent, link, title;
};

} // namespace

bool IsDark(const QPalette& palette)
{
  return palette.color(QPalette::Window).lightness() < palette.color(QPalette::WindowText).lightness();
}

void ApplyTheme(QApplication& application, const QString& theme)
{
  static const bool isSystemDark = IsDark(application.palette()); // as it was before the first
  const Colours dark{{52, 52, 54}, {38, 38, 40}, {44, 44, 46},   {225, 225, 225}, {130, 130, 130},
                     {64, 64, 67}, {70, 70, 72}, {74, 127, 168}, {130, 180, 220}, {62, 62, 65}},
      light{{236, 236, 238}, {252, 252, 252}, {243, 243, 245}, {28, 28, 30},  {120, 120, 124},
            {224, 224, 227}, {255, 255, 240}, {48, 108, 156},  {20, 84, 140}, {214, 214, 218}};
  const Colours& colours = theme == "light" || (theme == "system" && !isSystemDark) ? light : dark;
  const QColor &text = colours.text, &dim = colours.dim;
  application.setStyle(QStyleFactory::create("Fusion"));
  // From one of its own: a system's may be of any contrast.
  QPalette palette(colours.button, colours.window);
  palette.setColor(QPalette::Window, colours.window);
  palette.setColor(QPalette::WindowText, text);
  palette.setColor(QPalette::Base, colours.base);
  palette.setColor(QPalette::AlternateBase, colours.alternate);
  palette.setColor(QPalette::Text, text);
  palette.setColor(QPalette::PlaceholderText, dim);
  palette.setColor(QPalette::Button, colours.button);
  palette.setColor(QPalette::ButtonText, text);
  palette.setColor(QPalette::BrightText, Qt::white);
  palette.setColor(QPalette::ToolTipBase, colours.toolTip);
  palette.setColor(QPalette::ToolTipText, text);
  palette.setColor(QPalette::Highlight, colours.accent);
  palette.setColor(QPalette::HighlightedText, Qt::white);
  palette.setColor(QPalette::Link, colours.link);
  for (QPalette::ColorRole role : {QPalette::WindowText, QPalette::Text, QPalette::ButtonText, QPalette::HighlightedText})
    palette.setColor(QPalette::Disabled, role, dim);
  application.setPalette(palette);
  application.setStyleSheet("QDockWidget::title { padding: 3px 6px; background: " + colours.title.name() +
                            "; }"
                            "QToolTip { border: 1px solid #888; padding: 2px; }"
                            "QGroupBox { font-weight: bold; margin-top: 14px; }"
                            "QGroupBox::title { subcontrol-origin: margin; left: 2px; }");
}

} // namespace echorama
