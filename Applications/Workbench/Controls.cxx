// SPDX-License-Identifier: BSD-3-Clause
#include "Controls.h"
#include <QAction>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QLineEdit>
#include <QPushButton>
#include <QSignalBlocker>

namespace echorama {

namespace {

// A name for tests and screen readers, and a tool tip: every control has them.
void Describe(QWidget* widget, const char* name, const QString& help)
{
  widget->setObjectName(name);
  widget->setAccessibleName(name);
  widget->setAccessibleDescription(help);
  widget->setToolTip(help);
}

} // namespace

QDoubleSpinBox* NumberField(QWidget* parent, const Number& number, const std::function<void(double)>& edited)
{
  auto* field = new QDoubleSpinBox(parent);
  Describe(field, number.name, number.help);
  field->setRange(number.least, number.most);
  field->setDecimals(number.digits);
  field->setSingleStep(number.step);
  field->setSuffix(number.unit);
  field->setKeyboardTracking(false);
  field->setAlignment(Qt::AlignRight);
  field->setLocale(QLocale::c()); // a point, as in every file and report
  field->setFocusPolicy(Qt::StrongFocus);
  field->setMinimumWidth(52);
  QObject::connect(field, qOverload<double>(&QDoubleSpinBox::valueChanged), field, edited);
  return field;
}

void Show(QDoubleSpinBox* field, double value)
{
  const QString typed = field->text();
  if (field->hasFocus() && typed != field->textFromValue(field->value()) + field->suffix())
    return;
  const QSignalBlocker quiet(field);
  field->setValue(value);
}

QComboBox* ChoiceField(QWidget* parent, const char* name, const QString& help, const QVector<Choice>& choices,
                       const std::function<void(const QString&)>& chosen)
{
  auto* field = new QComboBox(parent);
  Describe(field, name, help);
  for (const Choice& choice : choices)
    field->addItem(choice.label, choice.word);
  QObject::connect(field, qOverload<int>(&QComboBox::activated), field,
                   [field, chosen](int i) { chosen(field->itemData(i).toString()); });
  return field;
}

void Show(QComboBox* field, const QString& word)
{
  const QSignalBlocker quiet(field);
  field->setCurrentIndex(field->findData(word));
}

QPushButton* Button(QWidget* parent, const char* name, const QString& label, const QString& help,
                    const std::function<void()>& pressed)
{
  auto* button = new QPushButton(label, parent);
  Describe(button, name, help);
  button->setAccessibleName(label);
  QObject::connect(button, &QPushButton::clicked, button, pressed);
  return button;
}

QAction* MakeAction(QObject* parent, const char* name, const QString& label, const QString& shortcut, const QString& help,
                    const std::function<void()>& triggered)
{
  auto* action = new QAction(label, parent);
  action->setObjectName(name);
  if (!shortcut.isEmpty())
    action->setShortcut(QKeySequence(shortcut));
  action->setToolTip(shortcut.isEmpty() ? help
                                        : QString("%1 (%2)").arg(help, action->shortcut().toString(QKeySequence::NativeText)));
  action->setStatusTip(help);
  QObject::connect(action, &QAction::triggered, parent, triggered);
  return action;
}

} // namespace echorama
