// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QObject>
#include <QPointer>

class QWidget;

namespace echorama {

/// Keys belong to the views: arrows move volumes, letters choose tools. A click on a button, a row of a table or a panel does not
/// take them away, nor does a number that was typed and ended by Return, or by Escape, which brings back what was there; only a
/// field in which somebody types has them, and what was reached by Tab. Space and Return press the button that has the focus, and
/// arrows move the slider or the choice that has it, rather than be shortcuts. And the wheel turns a number or a choice only
/// where a person works in it: over any other it scrolls the panel.
class Focus : public QObject {
public:
  /// \a view: which has keys at first, a view of \a window. Watches the whole window as long as it lives.
  Focus(QWidget* window, QWidget* view);
  /// To the view that had them last.
  void GiveBack();

protected:
  bool eventFilter(QObject* object, QEvent* event) override;

private:
  bool IsHere(const QWidget* widget) const;
  bool IsInPopup(const QWidget* widget) const; ///< menus, and the lists of choices
  void AfterRelease(QWidget* clicked);

  QWidget* window_;
  QPointer<QWidget> view_;
  QString before_; ///< what the line that is typed in held at first
};

} // namespace echorama
