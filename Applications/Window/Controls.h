// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <functional>
#include <QString>
#include <QStringList>
#include <QVector>
#include <string>
#include <vector>

class QAction;
class QCheckBox;
class QComboBox;
class QDoubleSpinBox;
class QLabel;
class QObject;
class QPushButton;
class QTableWidget;
class QToolButton;
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

/// A field for it. `edited`, if any, is called with the new value when a person changed it: on Return, when the field is left,
/// and at each step of its arrows; never for what Show() writes. Typing in between does nothing, so that "12" is not first 1.
QDoubleSpinBox* NumberField(QWidget* parent, const Number& number, const std::function<void(double)>& edited = {});

/// Writes a value into a field without calling anybody, and not while a person types in it.
void Show(QDoubleSpinBox* field, double value);

/// One of several words: the word, and what people read.
struct WordChoice {
  QString word, label;
};
QComboBox* ChoiceField(QWidget* parent, const char* name, const QString& help, const QVector<WordChoice>& choices,
                       const std::function<void(const QString&)>& chosen);
void Show(QComboBox* field, const QString& word);
/// The same for words that people read as they are.
QComboBox* ChoiceField(QWidget* parent, const char* name, const QString& help, const std::vector<std::string>& words);

QCheckBox* CheckField(QWidget* parent, const char* name, const QString& label, const QString& help,
                      const std::function<void(bool)>& toggled = {});
void Show(QCheckBox* field, bool on);

/// A choice among volumes: their names may be long, and make neither it nor its window wide.
void MayBeLong(QComboBox* field);

/// A text in which lines may also end inside long names of volumes and files, after _ . - and /.
QString Breakable(const QString& text);

/// Text that is shown; long lines are broken.
QLabel* TextField(QWidget* parent, const char* name, const QString& help = {});

/// Rows to read, which grow with what they hold.
QTableWidget* TableField(QWidget* parent, const char* name, const QString& help, const QStringList& headers);
/// \a help: of all cells of the row.
void InsertRow(QTableWidget* table, int row, const QStringList& texts, const QString& help = {});

/// A small one for the row of controls of a view.
QToolButton* SmallButton(QWidget* parent, const QString& name, const QString& label, const QString& help);

QPushButton* Button(QWidget* parent, const char* name, const QString& label, const QString& help,
                    const std::function<void()>& pressed);

/// A widget with a view drawn by OpenGL becomes a window of the system, inside of the other. Else Qt joins all of the outer
/// window by OpenGL whenever anything in it changes.
void MakeOwnWindow(QWidget* widget);

/// A menu entry with a shortcut ("" for none); the help is its tool tip and status tip.
QAction* MakeAction(QObject* parent, const char* name, const QString& label, const QString& shortcut, const QString& help,
                    const std::function<void()>& triggered);

} // namespace echorama
