// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QString>
#include <QVector>

class QWidget;

namespace echorama {

/// Keys and mouse buttons that no menu knows of.
struct KeysOf {
  QString title;
  struct Row {
    QString keys, what;
  };
  QVector<Row> rows;
};

/// What keys and mouse buttons do, in a window that can stay open: \a sections, then what the menus of \a parent say.
void ShowKeysPage(QWidget* parent, const QVector<KeysOf>& sections);

} // namespace echorama
