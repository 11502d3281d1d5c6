// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QPointer>
#include <QWidget>

namespace echorama {

/// Shows which part of a window has the keys, once a key has moved them there: a frame around it, over everything, in the
/// palette's colour of what is marked. Styles show it too faintly, and not at all on pictures. The mouse makes it go: who points
/// sees where.
class FocusRing : public QWidget {
public:
  explicit FocusRing(QWidget* window);

protected:
  bool eventFilter(QObject* object, QEvent* event) override;
  void paintEvent(QPaintEvent* event) override;

private:
  void Follow();

  QPointer<QWidget> focused_;
  bool isByKeys_ = false;
};

} // namespace echorama
