// SPDX-License-Identifier: BSD-3-Clause
#include "DropAnywhere.h"
#include "DroppedFiles.h"
#include <QAbstractButton>
#include <QApplication>
#include <QDialog>
#include <QLineEdit>

namespace echorama {

DropAnywhere::DropAnywhere(QWidget* window, std::function<void(const QStringList&)> dropped)
  : QObject(window), window_(window), dropped_(std::move(dropped))
{
  window->setAcceptDrops(true);
  qApp->installEventFilter(this);
}

// A panel that floats is a window, too; a dialog has drops of its own.
bool DropAnywhere::IsHere(const QWidget* widget) const
{
  while (widget && widget != window_ && !qobject_cast<const QDialog*>(widget))
    widget = widget->parentWidget();
  return widget == window_;
}

bool DropAnywhere::eventFilter(QObject* object, QEvent* event)
{
  auto* widget = qobject_cast<QWidget*>(object);
  if (!widget || (event->type() != QEvent::DragEnter && event->type() != QEvent::DragMove && event->type() != QEvent::Drop) ||
      !IsHere(widget))
    return false;
  auto* drop = static_cast<QDropEvent*>(event); // the others are its children
  const QStringList paths = DroppedFiles(drop);
  if (paths.isEmpty())
    return false;
  if (event->type() != QEvent::Drop)
    return true;
  auto* field = qobject_cast<QLineEdit*>(widget);
  if (field && field->parentWidget()->findChild<QAbstractButton*>(field->objectName() + "Browse")) {
    field->setText(paths.first());
    return true;
  }
  window_->activateWindow();
  dropped_(paths);
  return true;
}

} // namespace echorama
