// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <functional>
#include <QString>
#include <QVector>

namespace echorama {

/// A sentence for the user, with what can be done about it.
struct Message {
  enum Kind { Note, Warning, Question };
  Kind kind = Note;
  QString text;
  struct Answer {
    QString label;
    std::function<void()> action;
  };
  using Answers = QVector<Answer>;
  Answers answers;    ///< one button each; a message without is closed by its cross, a note by itself
  QString topic = {}; ///< takes the place of what was said of it before; none: stays beside all others
};

} // namespace echorama
