// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <functional>
#include <QTimer>

namespace echorama {

/// Redraws a view once, however often it was asked for since the last time: mouse and session tell more often than a screen
/// shows.
class Redraw : public QObject {
public:
  Redraw(QObject* parent, std::function<void()> draw) : QObject(parent), draw_(std::move(draw))
  {
    timer_.setSingleShot(true);
    timer_.setTimerType(Qt::PreciseTimer);
    connect(&timer_, &QTimer::timeout, this, [this] { draw_(); });
  }
  /// Within \a milliseconds; 0: as soon as the events that wait are done.
  void Ask(int milliseconds = 0)
  {
    if (!timer_.isActive() || timer_.remainingTime() > milliseconds)
      timer_.start(milliseconds);
  }
  /// Once nothing has asked anew for \a milliseconds.
  void AskAnew(int milliseconds) { timer_.start(milliseconds); }
  void Stop() { timer_.stop(); }

private:
  std::function<void()> draw_;
  QTimer timer_;
};

} // namespace echorama
