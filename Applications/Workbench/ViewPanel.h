// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Settings.h"
#include <QWidget>

class QCheckBox;
class QComboBox;
class QDoubleSpinBox;

namespace echorama {

class ViewGrid;
class Workbench;

/// How slices and the 3D view show the volumes.
class ViewPanel : public QWidget {
  Q_OBJECT

public:
  /// \param views whose oblique slice is told in numbers
  ViewPanel(Workbench* bench, ViewGrid* views, QWidget* parent = nullptr);

private:
  QWidget* SliceControls();
  QWidget* VolumeControls();
  QWidget* ObliqueControls();
  void SetOblique();
  void ShowOblique();
  void ShowLook();
  void ShowWindow();

  Workbench* bench_;
  ViewGrid* views_;
  QComboBox* obliqueIn_;
  QDoubleSpinBox *normal_[3], *offset_;
  QComboBox *shown_, *mode_, *interpolation_, *style_;
  QDoubleSpinBox *squares_, *black_, *white_;
  QDoubleSpinBox *downsampling_, *particleSize_, *opacity_, *minimum_, *maximum_;
  QCheckBox *valueOpacity_, *slices_;
};

} // namespace echorama
