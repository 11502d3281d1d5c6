// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QWidget>

class QLabel;
class QSlider;
class QTimer;
class QToolButton;

namespace echorama {

class Scan;

/// What was seen in the last seconds, while the image is frozen: to go through, and to play.
class CineBar : public QWidget {
  Q_OBJECT

public:
  explicit CineBar(Scan* scan, QWidget* parent = nullptr);

public slots:
  void Step(int frames);
  void SetPlaying(bool playing);

private:
  void ShowFrozen(bool frozen);
  void ShowIndex();
  void PlayOn();

  Scan* scan_;
  QToolButton* play_;
  QSlider* slider_;
  QLabel* time_;
  QTimer* timer_;
};

} // namespace echorama
