// SPDX-License-Identifier: BSD-3-Clause
#include "BrushPanel.h"
#include "Controls.h"
#include "Workbench.h"
#include <cmath>
#include <QCheckBox>
#include <QDoubleSpinBox>
#include <QFormLayout>
#include <QLabel>
#include <QSignalBlocker>
#include <QSlider>

namespace echorama {

namespace {

// The slider is logarithmic: 0.2 mm to 50 mm.
constexpr double Least = 0.2, Most = 50.0;
constexpr int Steps = 200;

int StepOf(double radiusMm)
{
  return static_cast<int>(std::lround(Steps * std::log(radiusMm / Least) / std::log(Most / Least)));
}

double RadiusOf(int step)
{
  const double radius = Least * std::pow(Most / Least, static_cast<double>(step) / Steps);
  return std::round(radius * 100.0) / 100.0;
}

} // namespace

BrushPanel::BrushPanel(Workbench* bench, QWidget* parent) : QWidget(parent), bench_(bench)
{
  setObjectName("brushPanel");
  const auto radius = bench->Setter(&BrushSettings::radiusMm);
  const QString radiusHelp = tr("Radius of the brush ([ smaller, ] larger)");
  help_ = TextField(this, "brushHelp");
  size_ = new QSlider(Qt::Horizontal, this);
  size_->setObjectName("brushSize");
  size_->setRange(0, Steps);
  size_->setToolTip(radiusHelp);
  connect(size_, &QSlider::valueChanged, this, [radius](int step) { radius(RadiusOf(step)); });
  radius_ = NumberField(this, {"brushRadius", radiusHelp, 0.1, 100.0, 2, 0.5, " mm"}, radius);
  intensity_ = NumberField(this, {"brushIntensity", tr("Grey level that is painted"), -1e6, 1e6, 0, 10.0, {}},
                           bench->Setter(&BrushSettings::intensity));
  opacity_ =
      NumberField(this, {"brushOpacity", tr("How much of the grey level covers what is there, 0 to 1"), 0.0, 1.0, 2, 0.1, {}},
                  bench->Setter(&BrushSettings::opacity));
  hardness_ = NumberField(
      this, {"brushHardness", tr("Share of the radius that is painted in full; outside it fades, 0 to 1"), 0.0, 1.0, 2, 0.1, {}},
      bench->Setter(&BrushSettings::hardness));
  insideValid_ = CheckField(this, "brushInsideValid", tr("Only where there are data"),
                            tr("The brush does not reach beyond the borders of the volume's data"),
                            bench->Setter(&BrushSettings::insideValid));
  auto* layout = new QFormLayout(this);
  layout->setContentsMargins(6, 4, 6, 4);
  layout->addRow(help_);
  layout->addRow(tr("Radius"), radius_);
  layout->addRow(size_);
  layout->addRow(tr("Grey level"), intensity_);
  layout->addRow(tr("Opacity"), opacity_);
  layout->addRow(tr("Hardness"), hardness_);
  layout->addRow(insideValid_);
  connect(bench, &Workbench::BrushChanged, this, &BrushPanel::ShowBrush);
  connect(bench, &Workbench::ToolChanged, this, &BrushPanel::ShowBrush);
  ShowBrush();
}

void BrushPanel::ShowBrush()
{
  const BrushSettings& brush = bench_->Brush();
  Show(radius_, brush.radiusMm);
  Show(intensity_, brush.intensity);
  Show(opacity_, brush.opacity);
  Show(hardness_, brush.hardness);
  Show(insideValid_, brush.insideValid);
  const QSignalBlocker quiet(size_);
  size_->setValue(StepOf(brush.radiusMm));

  const Tool tool = bench_->CurrentTool();
  for (QWidget* field : {static_cast<QWidget*>(intensity_), static_cast<QWidget*>(opacity_), static_cast<QWidget*>(hardness_),
                         static_cast<QWidget*>(insideValid_)})
    field->setEnabled(tool != Tool::Carve && tool != Tool::Restore);
  help_->setText(tool == Tool::Paint     ? tr("Paint: drag in a slice of the selected volume.")
                 : tool == Tool::Carve   ? tr("Carve: what the brush touches is taken away. Restore brings it back.")
                 : tool == Tool::Restore ? tr("Restore: what the brush touches becomes as it was in the file.")
                                         : tr("Pick Paint (3), Carve (4) or Restore (5), then drag in a slice."));
}

} // namespace echorama
