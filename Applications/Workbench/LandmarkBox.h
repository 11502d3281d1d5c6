// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QGroupBox>

class QDoubleSpinBox;
class QTableWidget;

namespace echorama {

struct Workspace;

/// The landmarks of the session: in which volumes each is, how far apart these put it, and how exactly they were marked. The tool
/// Mark makes them; aligning uses them.
class LandmarkBox : public QGroupBox {
  Q_OBJECT

public:
  explicit LandmarkBox(Workspace& workspace, QWidget* parent = nullptr);
  double SigmaMm() const; ///< of how far apart two of one label may lie, along each axis

public slots:
  void ShowLandmarks();

signals:
  void PlaceAsked(double x, double y, double z); ///< somebody chose a landmark: the middle of where its volumes put it

private:
  void ShowPlace();
  void RemoveSelected();

  Workspace& workspace_;
  QTableWidget* table_;
  QDoubleSpinBox* sigma_;
};

} // namespace echorama
