// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QWidget>

class QComboBox;
class QDoubleSpinBox;
class QSlider;

namespace echorama {

class SliceCanvas;
class Workbench;

/// A slice with its row of controls: the axis that it is cut across, where, and how large it is shown.
class SlicePane : public QWidget {
  Q_OBJECT

public:
  /// \a axis "x", "y" or "z". \a name of the pane and the beginning of the names of its parts.
  SlicePane(Workbench* bench, const QString& name, const QString& axis, QWidget* parent = nullptr);

  SliceCanvas* Canvas() const { return canvas_; }
  void SetAxis(const QString& axis);
  QString Axis() const { return axis_; }
  void NextAxis();
  void Fit();
  /// Brings the controls to where the view is.
  void ShowPlane();

signals:
  void LargeAsked();

protected:
  void changeEvent(QEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;

private:
  int WidthOf(const QString& text) const; ///< in the field of the position
  void FitPosition();
  void SetPosition(double mm);

  SliceCanvas* canvas_;
  QComboBox* axes_;
  QSlider* slider_;
  QDoubleSpinBox* position_;
  QString axis_;
};

} // namespace echorama
