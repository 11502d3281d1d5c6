// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QStringList>
#include <QWidget>

namespace echorama {

struct Message;

/// Messages at the top of the window, one row each: notes go by themselves, warnings when they are closed, questions when they
/// are answered. Work goes on meanwhile: no message stops the window.
class MessageBar : public QWidget {
  Q_OBJECT

public:
  explicit MessageBar(QWidget* parent = nullptr);

  /// Without a text it only takes away what was said of its topic.
  void Show(const Message& message);
  QStringList Texts() const; ///< from the oldest to the newest
  void Clear();

protected:
  void changeEvent(QEvent* event) override;

private:
  QWidget* RowOf(const QString& text) const;
};

} // namespace echorama
