// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QWidget>
#include <vtkNew.h>
#include <vtkUltrasoundTrackerSource.h>

class QComboBox;
class QLabel;
class QLineEdit;
class QPushButton;
class QTimer;
class vtkMatrix4x4;

namespace echorama {

/// Moves what is selected with a tracked tool, as if it were held in the hand (dissertation 4.3): while the button (or the key
/// G) is held down, the selected volumes follow the tool. One grasp is one edit.
class TrackerPanel : public QWidget {
  Q_OBJECT

public:
  explicit TrackerPanel(QWidget* parent = nullptr);
  ~TrackerPanel() override;

public slots:
  void SetGrasping(bool grasping);

signals:
  /// Where the tool is, while it grasps; once with false when it lets go (the matrix is then of no meaning).
  void ToolMoved(vtkMatrix4x4* toolToTracker, bool grasping);

private:
  void ConnectOrNot();
  void Step();

  vtkNew<vtkUltrasoundTrackerSource> tracker_;
  QLineEdit* address_;
  QComboBox* tool_;
  QPushButton *connect_, *grasp_;
  QLabel* state_;
  QTimer* timer_;
  bool isGrasping_ = false, isSeen_ = false;
};

} // namespace echorama
