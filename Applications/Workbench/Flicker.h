// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QObject>
#include <QString>
#include <QTimer>
#include <QVector>

namespace echorama {

class Workbench;

/// Shows one side and the other in the slices by turns: what does not agree jumps. A side is "selected", "others", or a volume by
/// its id. It ends by itself when something is dragged or painted, the picture too, another tool is taken, or nothing of a side
/// is left.
class Flicker : public QObject {
  Q_OBJECT

public:
  static constexpr double SlowestHz = 0.5, FastestHz = 10.0;

  explicit Flicker(Workbench* bench);

  void SetSides(const QString& one, const QString& other);
  void SetRate(double changesPerSecond);
  void Start(); ///< else says why not
  void Stop();
  void Toggle() { IsOn() ? Stop() : Start(); }
  bool IsOn() const { return timer_.isActive(); }

signals:
  void Changed();

private:
  QVector<int> VolumesOf(const QString& side) const;
  void Switch();

  Workbench* bench_;
  QTimer timer_;
  QString sides_[2] = {"selected", "others"};
  int now_ = 0;
};

} // namespace echorama
