// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QWidget>

class QCheckBox;
class QComboBox;
class QDoubleSpinBox;
class QTableWidget;

namespace echorama {

class ProfilePlot;
class Workbench;

/// Where an alignment is checked: grey levels of all volumes under the mouse, measurements with the profile along one of them,
/// flicker between two sides.
class CheckPanel : public QWidget {
  Q_OBJECT

public:
  explicit CheckPanel(Workbench* bench, QWidget* parent = nullptr);

protected:
  void showEvent(QShowEvent* event) override;

private:
  QWidget* ReadoutBox();
  QWidget* MeasureBox();
  QWidget* FlickerBox();
  void ShowReadout();
  void ShowMeasurements();
  void ShowProfile();
  void ShowSides();
  void RemoveChosen();
  void PointAlong(double share);

  Workbench* bench_;
  QTableWidget *here_, *measures_;
  ProfilePlot* profile_;
  QComboBox *one_, *other_;
  QDoubleSpinBox* rate_;
  QCheckBox* flickers_;
};

} // namespace echorama
