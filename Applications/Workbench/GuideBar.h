// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Widgets/Session/SessionState.h"
#include <array>
#include <functional>
#include <QToolBar>

class QLabel;
class QPushButton;
class QToolButton;

namespace echorama {

class Workbench;

/// The way from volumes to one volume, in six steps. A step is ticked when the session shows that it was done, and no longer
/// when what was done has been overtaken: a result of poses that are no more is none. Nothing has to be done in this order.
class GuideBar : public QToolBar {
  Q_OBJECT

public:
  enum Step { Open, Align, Check, Stitch, Embed, Save, Steps };
  /// What a step's button does, in the order of the steps.
  using Actions = std::array<std::function<void()>, Steps>;

  GuideBar(Workbench* bench, Actions actions, QWidget* parent = nullptr);

  bool IsDone(Step step) const { return done_[step]; }

protected:
  void changeEvent(QEvent* event) override;

private:
  void FitText();
  void Follow();
  void NoteLook();
  void ShowStep(int step);

  Workbench* bench_;
  Actions actions_;
  std::array<QToolButton*, Steps> steps_{};
  std::array<bool, Steps> done_{};
  QLabel* text_ = nullptr;
  QPushButton* do_;
  int shown_ = Open;
  SessionState checked_; ///< for which it was done
};

} // namespace echorama
