// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "JobPanel.h"
#include "Message.h"
#include <vector>

class QCheckBox;
class QComboBox;
class QLineEdit;
class QPushButton;
class QTableWidget;

namespace echorama {

class LandmarkBox;
class PairBox;
class Workbench;

/// Automatic alignment of what is in the session: refining what is selected from where it is, aligning all volumes from scratch,
/// or placing them as a tracker saw them. It runs in the background, tells what each answer is worth, and its result is one edit.
/// Landmarks that volumes share are used.
/// Volumes that were moved meanwhile are left where they are, and doubtful answers are not taken unless the user says so.
class RegistrationPanel : public JobPanel {
  Q_OBJECT

public:
  explicit RegistrationPanel(Workbench* bench, QWidget* parent = nullptr);

  LandmarkBox* Landmarks() const { return landmarks_; }

public slots:
  void Refine();         ///< selected volumes onto the others, which stay; with all or none selected: all onto the first
  void AlignAll();       ///< all onto the first, with the start that is chosen
  void PlaceByTracker(); ///< all beside the first, by the recording and the calibration that are named

private:
  struct Result;
  std::vector<int> AllIds() const;
  /// What may begin: nothing runs, and there are two volumes; else says why not.
  bool MayRun(const QString& label, const std::vector<int>& ids) const;
  /// In the place of what was said last.
  void Tell(Message::Kind kind, const QString& text, const QVector<Message::Answer>& answers = {}) const;
  void Run(const QString& label, const std::vector<int>& ids, const std::vector<int>& held, const std::string& start);
  /// \param farther looks farther away, when some volumes did not find their places
  void Take(const QString& label, const Result& result, const std::function<void()>& farther);
  void ShowState() override;

  QComboBox *start_, *metric_;
  QCheckBox* doubtful_;
  QLineEdit *recording_, *tool_, *calibration_;
  QPushButton *refine_, *alignAll_, *place_;
  LandmarkBox* landmarks_;
  PairBox* pairs_;
  QTableWidget* table_;
};

} // namespace echorama
