// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <functional>
#include <QObject>
#include <QStringList>

class QWidget;

namespace echorama {

/// Takes files that are dropped anywhere on a window: on panels, also those that float, on views, and on fields, which would
/// write the address of a file among their text. A field for the path of a file (one with a button NAMEBrowse) takes the path.
class DropAnywhere : public QObject {
public:
  DropAnywhere(QWidget* window, std::function<void(const QStringList&)> dropped);

protected:
  bool eventFilter(QObject* object, QEvent* event) override;

private:
  bool IsHere(const QWidget* widget) const;

  QWidget* window_;
  std::function<void(const QStringList&)> dropped_;
};

} // namespace echorama
