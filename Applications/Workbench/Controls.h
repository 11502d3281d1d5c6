// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <functional>
#include <QString>
#include <QVector>

class QAction;
class QComboBox;
class QDoubleSpinBox;
class QObject;
class QPushButton;
class QWidget;

namespace echorama {

/// A number that a person types: its name (for tests and screen readers), what it means, range, digits and unit.
struct Number {
  const char* name;
  QString help;
  double least, most;
  int digits = 1;
  double step = 1.0;
  QString unit; ///< " mm"
};

/// A field for it. `edited` is called with the new value when a person changed it: on Return, when the field is left, and at
/// each step of its arrows; never for what Show() writes. Typing in between does nothing, so that "12" is not first 1.
QDoubleSpinBox* NumberField(QWidget* parent, const Number& number, const std::function<void(double)>& edited);

/// Writes a value into a field without calling anybody, and not while a person types in it.
void Show(QDoubleSpinBox* field, double value);

/// One of several words: the word, and what people read.
struct Choice {
  QString word, label;
};
QComboBox* ChoiceField(QWidget* parent, const char* name, const QString& help, const QVector<Choice>& choices,
                       const std::function<void(const QString&)>& chosen);
void Show(QComboBox* field, const QString& word);

QPushButton* Button(QWidget* parent, const char* name, const QString& label, const QString& help,
                    const std::function<void()>& pressed);

/// A menu entry with a shortcut ("" for none); the help is its tool tip and status tip.
QAction* MakeAction(QObject* parent, const char* name, const QString& label, const QString& shortcut, const QString& help,
                    const std::function<void()>& triggered);

} // namespace echorama
