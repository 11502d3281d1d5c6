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

class Scan;

/// A tracked tool as the probe.
class ProbeTracker : public QWidget {
  Q_OBJECT

public:
  explicit ProbeTracker(Scan* scan, QWidget* parent = nullptr);
  ~ProbeTracker() override;

private:
  void ConnectOrNot();
  void PlaceHere();
  void Step();

  Scan* scan_;
  vtkNew<vtkUltrasoundTrackerSource> tracker_;
  Pose trackerToBody_ = Pose::Identity();
  Pose seen_ = Pose::Identity();
  bool hasSeen_ = false;
  QElapsedTimer sinceSeen_;
  QLineEdit* address_;
  QComboBox* tool_;
  QPushButton *connect_, *here_;
  QLabel* state_;
  QTimer* timer_;
};

} // namespace echorama
