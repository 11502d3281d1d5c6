// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <optional>
#include <QColor>
#include <QString>
#include <QVector>
#include <QWidget>
#include <vector>

namespace echorama {

/// Grey levels along a line, one curve per volume in its colour, over the way along it in mm. The mouse over it, or the arrow
/// keys, point at a place of the line.
class ProfilePlot : public QWidget {
  Q_OBJECT

public:
  struct Curve {
    QString name;
    QColor colour;
    std::vector<double> values; ///< at equal distances from end to end; NaN: no data
  };

  explicit ProfilePlot(QWidget* parent = nullptr);
  /// \param lowest \param highest grey levels of the axis
  void SetCurves(QVector<Curve> curves, double lengthMm, double lowest, double highest);
  const QVector<Curve>& Curves() const { return curves_; }
  double LengthMm() const { return lengthMm_; }
  QSize sizeHint() const override { return {200, 170}; }
  QSize minimumSizeHint() const override { return {120, 120}; }

signals:
  void PointedAt(double share); ///< of the way from the first end
  void Left();

protected:
  void paintEvent(QPaintEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void leaveEvent(QEvent* event) override;
  void focusOutEvent(QFocusEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;

private:
  QRectF Frame() const;
  void Point(std::optional<double> share);

  QVector<Curve> curves_;
  double lengthMm_ = 0.0, lowest_ = 0.0, highest_ = 255.0;
  std::optional<double> pointed_;
};

} // namespace echorama
