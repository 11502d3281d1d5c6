// SPDX-License-Identifier: BSD-3-Clause
#include "MessageBar.h"
#include "Message.h"
#include "Theme.h"
#include <exception>
#include <QApplication>
#include <QEvent>
#include <QHBoxLayout>
#include <QLabel>
#include <QPushButton>
#include <QTimer>
#include <QToolButton>
#include <QVBoxLayout>

namespace echorama {

namespace {

constexpr int MostRows = 4, NoteMs = 6000;

// What it is: a colour, and a sign for those who do not see it.
struct Looks {
  const char *dark, *light, *sign;
};
const Looks& LooksOf(int kind)
{
  static const Looks looks[] = {
      {"#2f4a5f", "#cfe2f2", "i"}, {"#6b3a34", "#f6d3cd", "!"}, {"#62532a", "#f3e6bd", "?"}}; // as Message::Kind
  return looks[kind];
}

void ApplyLooks(QWidget* row)
{
  const Looks& looks = LooksOf(row->property("kind").toInt());
  row->setStyleSheet(QString("#messageRow { background: %1; border-radius: 3px; }")
                         .arg(IsDark(QApplication::palette()) ? looks.dark : looks.light));
}

} // namespace

MessageBar::MessageBar(QWidget* parent) : QWidget(parent)
{
  setObjectName("messageBar");
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(4, 0, 4, 0);
  layout->setSpacing(2);
}

QWidget* MessageBar::RowOf(const QString& text) const
{
  for (auto* label : findChildren<QLabel*>("messageText"))
    if (label->text() == text && !label->parentWidget()->isHidden())
      return label->parentWidget();
  return nullptr;
}

QStringList MessageBar::Texts() const
{
  QStringList texts;
  for (auto* label : findChildren<QLabel*>("messageText"))
    if (!label->parentWidget()->isHidden())
      texts.append(label->text());
  return texts;
}

void MessageBar::Clear()
{
  for (auto* row : findChildren<QFrame*>("messageRow")) {
    row->hide();
    row->deleteLater();
  }
}

void MessageBar::changeEvent(QEvent* event)
{
  QWidget::changeEvent(event);
  if (event->type() == QEvent::PaletteChange)
    for (auto* row : findChildren<QFrame*>("messageRow"))
      ApplyLooks(row);
}

void MessageBar::Show(const Message& message)
{
  if (!message.topic.isEmpty())
    for (auto* row : findChildren<QFrame*>("messageRow"))
      if (row->property("topic") == message.topic) {
        row->hide();
        row->deleteLater();
      }
  if (message.text.isEmpty() || RowOf(message.text))
    return; // it is there already
  auto* row = new QFrame(this);
  row->setObjectName("messageRow");
  row->setProperty("topic", message.topic);
  row->setProperty("kind", static_cast<int>(message.kind));
  ApplyLooks(row);
  auto* layout = new QHBoxLayout(row);
  layout->setContentsMargins(8, 3, 4, 3);
  layout->addWidget(new QLabel(QString("<b>%1</b>").arg(LooksOf(message.kind).sign), row));
  auto* text = new QLabel(message.text, row);
  text->setObjectName("messageText");
  text->setTextFormat(Qt::PlainText);
  text->setWordWrap(true);
  text->setTextInteractionFlags(Qt::TextSelectableByMouse);
  layout->addWidget(text, 1);
  const auto close = [row] {
    row->hide();
    row->deleteLater();
  };
  for (const Message::Answer& answer : message.answers) {
    auto* button = new QPushButton(answer.label, row);
    button->setObjectName("messageAnswer");
    button->setAutoDefault(true); // Return presses it
    layout->addWidget(button);
    connect(button, &QPushButton::clicked, row, [this, close, action = answer.action] {
      close(); // first: the action may end the window
      try {
        if (action)
          action();
      } catch (const std::exception& error) // Qt cannot pass it on
      {
        Show({Message::Warning, QString::fromUtf8(error.what()), {}});
      }
    });
    if (message.kind != Message::Note && &answer == &message.answers.first()) // keys go on where they were after good news
      QTimer::singleShot(0, button, [button] { button->setFocus(); });
  }
  if (message.kind != Message::Question) {
    auto* cross = new QToolButton(row);
    cross->setObjectName("messageClose");
    cross->setText(QString(QChar(0x00d7)));
    cross->setAutoRaise(true);
    cross->setToolTip(tr("Close this message"));
    layout->addWidget(cross);
    connect(cross, &QToolButton::clicked, row, close);
  }
  if (message.kind == Message::Note && message.answers.isEmpty())
    QTimer::singleShot(NoteMs, row, close);
  this->layout()->addWidget(row);
  row->show(); // now, not when the layout gets to it: it counts

  // The oldest notes make room; what went wrong and what is asked stays until somebody has read it.
  const auto rows = findChildren<QFrame*>("messageRow");
  int shown = 0;
  for (auto* other : rows)
    shown += !other->isHidden();
  for (auto* other : rows)
    if (shown > MostRows && !other->isHidden() && other != row && other->property("kind") == Message::Note) {
      other->hide();
      other->deleteLater();
      shown--;
    }
}

} // namespace echorama
