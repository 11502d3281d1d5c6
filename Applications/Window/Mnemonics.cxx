// SPDX-License-Identifier: BSD-3-Clause
#include "Mnemonics.h"
#include <QAction>
#include <QMenu>
#include <QSet>

namespace echorama {

namespace {

QChar LetterOf(const QString& text)
{
  for (int i = 0; i + 1 < text.size(); i++)
    if (text[i] == '&') {
      if (text[i + 1] != '&')
        return text[i + 1].toLower();
      i++;
    }
  return {};
}

} // namespace

void AddMnemonics(QMenu* menu)
{
  QSet<QChar> taken;
  QList<QAction*> without;
  for (QAction* action : menu->actions()) {
    if (action->isSeparator())
      continue;
    if (action->menu())
      AddMnemonics(action->menu());
    const QChar letter = LetterOf(action->text());
    if (letter.isNull() || taken.contains(letter))
      without.append(action);
    else
      taken.insert(letter);
  }
  for (QAction* action : without) {
    QString text = action->text();
    text.remove('&');
    for (int i = 0; i < text.size(); i++)
      if (const QChar letter = text[i].toLower(); letter.isLetterOrNumber() && !taken.contains(letter)) {
        taken.insert(letter);
        text.insert(i, '&');
        break;
      }
    action->setText(text);
  }
}

} // namespace echorama
