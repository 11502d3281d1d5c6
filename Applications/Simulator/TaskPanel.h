// SPDX-License-Identifier: BSD-3-Clause
#pragma once
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

namespace echorama {

class ImageView;
class Scan;

/// Tasks: a teacher saves what is seen as one, a learner opens it and is scored.
class TaskPanel : public QWidget {
  Q_OBJECT

public:
  TaskPanel(Scan* scan, ImageView* image, QWidget* parent = nullptr);

  void SetFolder(const QDir& folder) { folder_ = folder; }
  void OpenTask(const QString& path);
  bool IsRunning() const { return attempt_ && attempt_->IsRunning(); }

signals:
  /// While an attempt runs, nothing may be shown that leads to the solution.
  void RunningChanged(bool running);

private:
  void Save(std::variant<FindPlane, MeasureLength, ReachTarget> goal);
  void SavePlane();
  void SaveLength();
  void StartOrCancel();
  void Submit();
  void Forget();
  void ShowState();
  double Seconds() const { return 1e-3 * static_cast<double>(clock_.elapsed()); }
  /// Says what is wrong instead of throwing it.
  void Try(const std::function<void()>& action);

  Scan* scan_;
  ImageView* image_;
  QDir folder_;
  std::optional<ScanAttempt> attempt_;
  QElapsedTimer clock_;
  double started_ = 0.0;
  QLineEdit *name_, *trainee_;
  QCheckBox* hint_;
  QPushButton *start_, *submit_;
  QLabel *task_, *state_, *score_;
  QTimer* timer_;
};

} // namespace echorama
