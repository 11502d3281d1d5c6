// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "JobBar.h"
#include <vector>

class QCheckBox;
class QComboBox;
class QPushButton;
class QTableWidget;

namespace echorama {

/// Automatic alignment of what is in the session: refining what is selected from where it is, or all volumes from scratch. It
/// runs in the background, tells what each answer is worth, and its result is one edit. What was moved meanwhile stays where it
/// was put, and doubtful answers are not taken unless the user says so.
class RegistrationPanel : public JobPanel {
  Q_OBJECT

public:
  explicit RegistrationPanel(Workspace& workspace, QWidget* parent = nullptr);

public slots:
  void Refine();   ///< selected volumes onto the others, which stay; with all or none selected: all onto the first
  void AlignAll(); ///< all onto the first, with the start that is chosen

private:
  struct Result;
  void Run(const QString& label, const std::vector<int>& ids, const std::vector<int>& held, const char* start);
  void Take(const QString& label, const Result& result);
  void ShowState() override;

  QComboBox *start_, *metric_;
  QCheckBox* doubtful_;
  QPushButton *refine_, *alignAll_;
  QTableWidget* table_;
};

} // namespace echorama
