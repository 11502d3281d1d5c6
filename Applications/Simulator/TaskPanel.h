// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Live/NeedlePath.h"
#include "Widgets/Session/ScanTask.h"
#include <optional>
#include <QDir>
#include <QElapsedTimer>
#include <QWidget>

class QCheckBox;
class QLabel;
class QLineEdit;
class QPushButton;
class QTimer;
class vtkPolyData;

namespace echorama {

class ImageView;
class NeedleTool;
class Scan;
struct PlanePicture;

/// Tasks: a teacher saves what is seen as one, a learner opens it and is scored.
class TaskPanel : public QWidget {
  Q_OBJECT

public:
  TaskPanel(Scan* scan, NeedleTool* needle, ImageView* image, QWidget* parent = nullptr);

  void SetFolder(const QDir& folder) { folder_ = folder; }
  void OpenTask(const QString& path);
  bool IsRunning() const { return attempt_ && attempt_->IsRunning(); }
  /// It has been started, but the tool that leads the probe has not been at the start yet.
  bool IsWaiting() const { return isWaiting_; }
  /// Ends an attempt without an answer.
  void GiveUp();

signals:
  /// While an attempt runs or waits, nothing may be shown that leads to the solution.
  void RunningChanged(bool running);
  ///@{ To be shown on the body, and beside the image; nullptr: nothing.
  void MarksChanged(vtkPolyData* lines);
  void SolutionChanged(const PlanePicture* picture);
  ///@}

private:
  void Save(std::variant<FindPlane, MeasureLength, ReachTarget> goal);
  void SavePlane();
  void SaveLength();
  void SaveTarget();
  void StartOrCancel();
  void BeginWhenAtStart();
  void Submit();
  void ShowSolution(bool shown);
  void Forget();
  bool IsForNeedle() const { return attempt_ && attempt_->What() == ScanAttempt::Kind::ReachTarget; }
  /// What the needle does is counted: between images, too, as they are made only when something moves.
  void Watch();
  QString TellSubmitted(const ScanScore& score) const;
  void ShowState();
  double Seconds() const { return 1e-3 * static_cast<double>(clock_.elapsed()); }
  /// Says what is wrong instead of throwing it.
  void Try(const std::function<void()>& action);

  Scan* scan_;
  NeedleTool* needle_;
  ImageView* image_;
  QDir folder_;
  std::optional<ScanAttempt> attempt_;
  std::optional<NeedleTrack> track_; ///< of an attempt with a needle
  QElapsedTimer clock_;
  double started_ = 0.0;
  bool isWaiting_ = false;
  QLineEdit *name_, *trainee_;
  QCheckBox *hint_, *showTip_;
  QPushButton *start_, *submit_, *solution_;
  QLabel *task_, *state_, *score_;
  QTimer* timer_;
};

} // namespace echorama
