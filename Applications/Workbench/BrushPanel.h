// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QWidget>

class QCheckBox;
class QDoubleSpinBox;
class QLabel;
class QSlider;

namespace echorama {

class Workbench;

/// The brush of Paint, Carve and Restore.
class BrushPanel : public QWidget {
  Q_OBJECT

public:
  explicit BrushPanel(Workbench* bench, QWidget* parent = nullptr);

private:
  void ShowBrush();

  Workbench* bench_;
  QLabel* help_;
  QSlider* size_;
  QDoubleSpinBox *radius_, *intensity_, *opacity_, *hardness_;
  QCheckBox* insideValid_;
};

} // namespace echorama
