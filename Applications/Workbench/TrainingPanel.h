// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QElapsedTimer>
#include <QWidget>

class QCheckBox;
class QDoubleSpinBox;
class QLabel;
class QLineEdit;
class QPushButton;
class QTableWidget;
class QTimer;

namespace echorama {

class JobBar;
class Workbench;

/// Evaluation and training (dissertation 4.4). With a truth loaded the score is shown while volumes move, with the errors as
/// arrows in the 3D view. In training both are hidden from the start of an attempt until it is submitted; then score, errors and
/// time taken are shown and added to a history, a CSV file that goes on across attempts and trainees.
class TrainingPanel : public QWidget {
  Q_OBJECT

public:
  TrainingPanel(Workbench* bench, const JobBar* jobs, QWidget* parent = nullptr);

  /// The pose file of the truth; a failure goes to the message bar.
  bool LoadTruth(const QString& path);
  /// Where attempts are kept; shows those that are there.
  bool SetHistory(const QString& path);
  bool IsTraining() const { return isTraining_; }

signals:
  void ScoreShown(const QString& text); ///< for the status bar; empty while it is hidden or there is none

private:
  void ChooseTruth();
  void ChooseHistory();
  void Scatter();
  void StartOrGiveUp();
  void Submit();
  void ShowScore();
  void ShowState();
  QString Told(const QStringList& row) const;
  void ShowHistory();
  void WarnOfHistory(const QString& why);

  Workbench* bench_;
  const JobBar* jobs_;
  QLabel *truth_, *score_, *time_;
  QCheckBox *live_, *vectors_, *help_;
  QLineEdit *trainee_, *history_;
  QDoubleSpinBox *scatterMm_, *scatterDegrees_, *seed_;
  QPushButton *scatter_, *start_, *submit_;
  QTableWidget* table_;
  QTimer* clock_;
  QElapsedTimer taken_;
  QString historyPath_;
  double startScore_ = 0.0;
  bool isTraining_ = false;
};

} // namespace echorama
