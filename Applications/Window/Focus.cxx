// SPDX-License-Identifier: BSD-3-Clause
// Qt gives the focus to whatever was clicked, and lets it stay there. A filter of the application's events sees every click,
// key and wheel of the window, also those of panels that are written later.
#include "Focus.h"
#include "MessageBar.h"
#include <algorithm>
#include <QAbstractButton>
#include <QAbstractItemView>
#include <QAbstractSlider>
#include <QAbstractSpinBox>
#include <QApplication>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QKeyEvent>
#include <QLineEdit>
#include <QPlainTextEdit>
#include <QTextEdit>
#include <QTimer>

namespace echorama {

namespace {

bool IsView(const QWidget* widget)
{
  return widget->inherits("QVTKOpenGLNativeWidget") || widget->property("isView").toBool();
}

bool IsText(const QWidget* widget) // in which Return is a new line
{
  return qobject_cast<const QTextEdit*>(widget) || qobject_cast<const QPlainTextEdit*>(widget);
}

bool IsTypedIn(const QWidget* widget)
{
  const auto* choice = qobject_cast<const QComboBox*>(widget);
  return qobject_cast<const QLineEdit*>(widget) || qobject_cast<const QAbstractSpinBox*>(widget) || IsText(widget) ||
         (choice && choice->isEditable());
}

bool IsPressedByKeys(const QWidget* widget)
{
  return qobject_cast<const QAbstractButton*>(widget) || qobject_cast<const QAbstractItemView*>(widget) ||
         qobject_cast<const QComboBox*>(widget);
}

bool IsSetByArrows(const QWidget* widget)
{
  return qobject_cast<const QAbstractSlider*>(widget) || qobject_cast<const QComboBox*>(widget);
}

bool IsArrow(const QKeyEvent* event)
{
  const int key = event->key();
  return key == Qt::Key_Left || key == Qt::Key_Right || key == Qt::Key_Up || key == Qt::Key_Down;
}

bool IsInMessage(const QWidget* widget)
{
  for (; widget; widget = widget->parentWidget())
    if (qobject_cast<const MessageBar*>(widget))
      return true;
  return false;
}

bool IsInTable(const QWidget* field)
{
  const QWidget* viewport = field->parentWidget();
  return viewport && qobject_cast<const QAbstractItemView*>(viewport->parentWidget());
}

// A number is what it was when it was last taken over; \a before: the text of any other field.
void BringBack(QWidget* field, const QString& before)
{
  if (auto* number = qobject_cast<QDoubleSpinBox*>(field))
    number->setValue(number->value());
  else if (auto* line = qobject_cast<QLineEdit*>(field))
    line->setText(before);
}

bool IsReturn(const QKeyEvent* event)
{
  return event->key() == Qt::Key_Return || event->key() == Qt::Key_Enter;
}

} // namespace

Focus::Focus(QWidget* window, QWidget* view) : QObject(window), window_(window), view_(view)
{
  connect(qApp, &QApplication::focusChanged, this, [this](QWidget*, QWidget* now) {
    if (now && IsHere(now) && IsView(now))
      view_ = now;
    if (const auto* line = qobject_cast<QLineEdit*>(now))
      before_ = line->text();
  });
  qApp->installEventFilter(this);
  view->setFocus();
}

bool Focus::IsHere(const QWidget* widget) const
{
  return widget == window_ || window_->isAncestorOf(widget);
}

bool Focus::IsInPopup(const QWidget* widget) const
{
  const QWidget* popup = widget->window();
  return popup->windowType() == Qt::Popup && popup->parentWidget() && IsHere(popup->parentWidget());
}

void Focus::GiveBack()
{
  if (!view_ || !view_->isVisible()) { // another one is large now
    const QList<QWidget*> all = window_->findChildren<QWidget*>();
    const auto shown =
        std::find_if(all.begin(), all.end(), [](const QWidget* each) { return IsView(each) && each->isVisible(); });
    if (shown != all.end())
      view_ = *shown;
  }
  if (view_ && view_->isVisible())
    view_->setFocus(Qt::OtherFocusReason);
}

void Focus::AfterRelease(QWidget* clicked)
{
  QWidget* focused = window_->focusWidget();
  if (!focused || IsView(focused) || QApplication::activePopupWidget() || QApplication::activeModalWidget())
    return;
  const bool isAbout = clicked && (clicked == focused || clicked->isAncestorOf(focused) || focused->isAncestorOf(clicked));
  if ((isAbout && IsTypedIn(focused)) || (IsInMessage(focused) && focused->isVisible()))
    return;
  GiveBack();
}

bool Focus::eventFilter(QObject* object, QEvent* event)
{
  auto* widget = qobject_cast<QWidget*>(object);
  if (!widget)
    return false;
  switch (event->type()) {
  case QEvent::MouseButtonRelease:
    // What the click does comes first.
    if ((IsHere(widget) || IsInPopup(widget)) && !IsView(widget))
      QTimer::singleShot(0, this, [this, clicked = QPointer<QWidget>(widget)] { AfterRelease(clicked); });
    break;
  case QEvent::KeyPress:
    if (IsHere(widget) && IsTypedIn(widget) && static_cast<QKeyEvent*>(event)->key() == Qt::Key_Escape) {
      if (IsInTable(widget)) { // the table knows what to do
        QTimer::singleShot(0, this, [this] { GiveBack(); });
        break;
      }
      BringBack(widget, before_);
      GiveBack();
      return true;
    }
    if (IsHere(widget) && IsReturn(static_cast<QKeyEvent*>(event)) && (IsTypedIn(widget) || IsInMessage(widget)) &&
        !IsText(widget))
      QTimer::singleShot(0, this, [this] { GiveBack(); });
    break;
  case QEvent::KeyRelease:
    if (IsHere(widget) && IsInMessage(widget) && static_cast<QKeyEvent*>(event)->key() == Qt::Key_Space)
      QTimer::singleShot(0, this, [this] { GiveBack(); });
    break;
  case QEvent::ShortcutOverride:
    if (auto* key = static_cast<QKeyEvent*>(event);
        key->modifiers() == Qt::NoModifier && IsHere(widget) &&
        ((key->key() == Qt::Key_Space && IsPressedByKeys(widget)) || (IsArrow(key) && IsSetByArrows(widget)))) {
      event->accept();
      return true;
    }
    break;
  case QEvent::Wheel:
    if (IsHere(widget) && (qobject_cast<QAbstractSpinBox*>(widget) || qobject_cast<QComboBox*>(widget)) && !widget->hasFocus()) {
      event->ignore(); // it goes on to the panel
      return true;
    }
    break;
  default:
    break;
  }
  return false;
}

} // namespace echorama
