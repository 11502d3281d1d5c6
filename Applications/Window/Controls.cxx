// SPDX-License-Identifier: BSD-3-Clause
#include "Controls.h"
#include <QAction>
#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QFocusEvent>
#include <QHeaderView>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QRegularExpression>
#include <QSignalBlocker>
#include <QTableWidget>
#include <QTimer>
#include <QToolButton>

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

/// A click into a number selects it, as Tab does: what is typed next takes its place. A second click sets the cursor.
class ClickedNumber : public QDoubleSpinBox {
public:
  using QDoubleSpinBox::QDoubleSpinBox;

protected:
  void focusInEvent(QFocusEvent* event) override
  {
    QDoubleSpinBox::focusInEvent(event);
    if (event->reason() == Qt::MouseFocusReason)
      QTimer::singleShot(0, this, &QAbstractSpinBox::selectAll); // the press comes after the focus, and sets the cursor
  }
};
} // namespace

QDoubleSpinBox* NumberField(QWidget* parent, const Number& number, const std::function<void(double)>& edited)
{
  auto* field = new ClickedNumber(parent);
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
  if (edited)
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

QComboBox* ChoiceField(QWidget* parent, const char* name, const QString& help, const QVector<WordChoice>& choices,
                       const std::function<void(const QString&)>& chosen)
{
  auto* field = new QComboBox(parent);
  Describe(field, name, help);
  for (const WordChoice& choice : choices)
    field->addItem(choice.label, choice.word);
  QObject::connect(field, qOverload<int>(&QComboBox::activated), field,
                   [field, chosen](int i) { chosen(field->itemData(i).toString()); });
  return field;
}

QComboBox* ChoiceField(QWidget* parent, const char* name, const QString& help, const std::vector<std::string>& words)
{
  QVector<WordChoice> choices;
  for (const std::string& word : words)
    choices.append({QString::fromStdString(word), QString::fromStdString(word)});
  return ChoiceField(parent, name, help, choices, [](const QString&) {});
}

void Show(QComboBox* field, const QString& word)
{
  const QSignalBlocker quiet(field);
  field->setCurrentIndex(field->findData(word));
}

void MayBeLong(QComboBox* field)
{
  field->setSizeAdjustPolicy(QComboBox::AdjustToMinimumContentsLengthWithIcon);
  field->setMinimumContentsLength(8);
  for (int i = 0; i < field->count(); ++i)
    field->setItemData(i, field->itemText(i), Qt::ToolTipRole);
}

QString Breakable(const QString& text)
{
  constexpr int longest = 16; // letters of a word that stays whole
  static const QRegularExpression joints("([_./\\\\-])");
  QStringList words = text.split(' ');
  for (QString& word : words)
    if (word.size() > longest)
      word.replace(joints, QString("\\1") + QChar(0x200b));
  return words.join(' ');
}

QCheckBox* CheckField(QWidget* parent, const char* name, const QString& label, const QString& help,
                      const std::function<void(bool)>& toggled)
{
  auto* field = new QCheckBox(label, parent);
  Describe(field, name, help);
  field->setAccessibleName(label);
  if (toggled)
    QObject::connect(field, &QCheckBox::toggled, field, toggled);
  return field;
}

void Show(QCheckBox* field, bool on)
{
  const QSignalBlocker quiet(field);
  field->setChecked(on);
}

QLabel* TextField(QWidget* parent, const char* name, const QString& help)
{
  auto* field = new QLabel(parent);
  field->setObjectName(name);
  field->setToolTip(help);
  field->setWordWrap(true);
  return field;
}

QTableWidget* TableField(QWidget* parent, const char* name, const QString& help, const QStringList& headers)
{
  auto* table = new QTableWidget(0, headers.size(), parent);
  Describe(table, name, help);
  table->setHorizontalHeaderLabels(headers);
  table->setEditTriggers(QAbstractItemView::NoEditTriggers);
  table->verticalHeader()->hide();
  table->setTabKeyNavigation(false); // Tab leaves it
  return table;
}

void InsertRow(QTableWidget* table, int row, const QStringList& texts, const QString& help)
{
  table->insertRow(row);
  for (int column = 0; column < texts.size(); ++column) {
    auto* item = new QTableWidgetItem(texts[column]);
    item->setToolTip(help);
    table->setItem(row, column, item);
  }
}

QToolButton* SmallButton(QWidget* parent, const QString& name, const QString& label, const QString& help)
{
  auto* button = new QToolButton(parent);
  button->setObjectName(name);
  button->setText(label);
  button->setToolTip(help);
  button->setAutoRaise(true);
  return button;
}

QPushButton* Button(QWidget* parent, const char* name, const QString& label, const QString& help,
                    const std::function<void()>& pressed)
{
  auto* button = new QPushButton(label, parent);
  Describe(button, name, help);
  button->setAccessibleName(label);
  if (pressed)
    QObject::connect(button, &QPushButton::clicked, button, pressed);
  return button;
}

void MakeOwnWindow(QWidget* widget)
{
  widget->setAttribute(Qt::WA_DontCreateNativeAncestors);
  widget->setAttribute(Qt::WA_NativeWindow);
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
