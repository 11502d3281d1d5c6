// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Workspace.h"
#include <QWidget>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkUltrasoundTrackerSource.h>

class QComboBox;
class QLabel;
class QLineEdit;
class QPushButton;
class QTimer;

namespace echorama {

class Job;

/// Moves what is selected with a tracked tool, as if it were held in the hand (dissertation 4.3): while the button (or the key
/// G) is held down, the selected volumes follow the tool. One grasp is one edit.
class TrackerPanel : public QWidget {
  Q_OBJECT

public:
  explicit TrackerPanel(Workspace& workspace, QWidget* parent = nullptr);
  ~TrackerPanel() override;

public slots:
  void SetGrasping(bool grasping);

private:
  void ConnectOrNot();
  void Connected(bool done);
  void Step();

  Workspace& workspace_;
  vtkNew<vtkUltrasoundTrackerSource> tracker_; ///< while it is connected, that job's alone
  Job* job_ = nullptr;                         ///< that connects it
  vtkNew<vtkMatrix4x4> seen_;                  ///< where the tool was seen last while it grasped
  QLineEdit* address_;
  QComboBox* tool_;
  QPushButton *connect_, *grasp_;
  QLabel* state_;
  QTimer* timer_;
  bool isGrasping_ = false, isSeen_ = false;
};

} // namespace echorama
