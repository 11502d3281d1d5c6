// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Samples.h"
#include <functional>
#include <QWidget>

class QAction;

namespace echorama {

/// Lies over the views while there is nothing to see in them, and says how to begin.
class EmptyPage : public QWidget {
  Q_OBJECT

public:
  /// \a views: what it covers. \a open, openProject: what its first buttons do. \a openSample: is called with the one chosen.
  EmptyPage(QWidget* views, QAction* open, QAction* openProject, const std::function<void(const Sample&)>& openSample);

protected:
  bool eventFilter(QObject* object, QEvent* event) override;
};

} // namespace echorama
