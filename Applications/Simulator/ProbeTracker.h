// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/RigidTransform.h"
#include <QElapsedTimer>
#include <QWidget>
#include <vtkNew.h>
#include <vtkUltrasoundTrackerSource.h>

class QComboBox;
class QLabel;
class QLineEdit;
class QPushButton;
class QTimer;

namespace echorama {

class Job;
class NeedleTool;
class Scan;

/// Tracked tools as the probe and, if there is one, the needle. The probe: by one tracker, by one for its place and one for its
/// orientation, or by an orientation alone.
class ProbeTracker : public QWidget {
  Q_OBJECT

public:
  ProbeTracker(Scan* scan, NeedleTool* needle, QWidget* parent = nullptr);
  ~ProbeTracker() override;

  vtkUltrasoundTrackerSource* Tracker() { return tracker_; }

signals:
  void JobStarted(Job* job);

private:
  void ConnectOrNot();
  void Connected(bool done);
  QString Device() const;
  void PlaceHere();
  void Align();
  void Slide();
  void GiveNormals();
  void ShowHeading();
  void Step();
  std::string ProbeTool();
  void StepNeedle();

  Scan* scan_;
  NeedleTool* needle_;
  vtkNew<vtkUltrasoundTrackerSource> tracker_; ///< while it is connected, that job's alone
  Job* job_ = nullptr;                         ///< that connects it
  Pose trackerToBody_ = Pose::Identity();
  Pose seen_ = Pose::Identity();
  bool hasSeen_ = false, isToolChosen_ = false; ///< since it was connected
  QElapsedTimer sinceSeen_;
  bool isFused_ = false, isAlone_ = false; ///< with an orientation of its own; with no more than that
  QElapsedTimer slide_;
  QLineEdit *address_, *orientation_, *options_;
  QComboBox *tool_, *needleTool_;
  QPushButton *connect_, *here_, *align_, *slideButton_;
  QLabel *heading_, *state_;
  QTimer* timer_;
};

} // namespace echorama
