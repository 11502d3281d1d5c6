// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <QWidget>

class QDoubleSpinBox;
class QLabel;

namespace echorama {

class Workbench;

/// Poses in numbers: where the selected volume is, steps from there, what it turns about, and how fast it follows the mouse.
class PosePanel : public QWidget {
  Q_OBJECT

public:
  explicit PosePanel(Workbench* bench, QWidget* parent = nullptr);

protected:
  void changeEvent(QEvent* event) override;

private:
  void FitNumbers();
  void ShowPose();
  void ShowCentre();
  void ShowHand();
  void TakePose();
  void Move(int axis, double steps);
  void Turn(int axis, double steps);

  Workbench* bench_;
  QLabel* of_;
  std::array<QDoubleSpinBox*, 3> middle_, degrees_, centre_;
  QDoubleSpinBox *mmStep_, *degreeStep_, *mmSensitivity_, *degreeSensitivity_;
};

} // namespace echorama
