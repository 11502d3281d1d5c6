// SPDX-License-Identifier: BSD-3-Clause
#include "SlicePane.h"
#include "Controls.h"
#include "SliceCanvas.h"
#include "vtkUltrasoundSliceView.h"
#include "Workbench.h"
#include <algorithm>
#include <cmath>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QEvent>
#include <QHBoxLayout>
#include <QSignalBlocker>
#include <QSlider>
#include <QToolButton>
#include <QVBoxLayout>

namespace echorama {

namespace {

constexpr int SliderSteps = 1000;

} // namespace

SlicePane::SlicePane(Workbench* bench, const QString& name, const QString& axis, QWidget* parent)
  : QWidget(parent), canvas_(new SliceCanvas(bench, this)), slider_(new QSlider(Qt::Horizontal, this))
{
  setObjectName(name);
  MakeOwnWindow(this);
  canvas_->setObjectName(name + "Canvas");
  canvas_->setAccessibleName(tr("Slice"));
  axes_ = ChoiceField(this, "axis", tr("What the slice is cut across (V: the next)"),
                      {{"z", tr("Axial")}, {"y", tr("Coronal")}, {"x", tr("Sagittal")}, {"oblique", tr("Oblique")}},
                      [this](const QString& chosen) { SetAxis(chosen); });
  slider_->setObjectName(name + "Slider");
  slider_->setRange(0, SliderSteps);
  slider_->setToolTip(tr("Where the slice is; the wheel over the picture goes by single voxels"));
  slider_->setMinimumWidth(1); // before anything is cut off
  position_ = NumberField(this, {"position", tr("Where the slice is, along its axis, mm"), -1e5, 1e5, 1, 1.0, " mm"},
                          [this](double mm) { SetPosition(mm); });
  position_->setButtonSymbols(QAbstractSpinBox::NoButtons);
  auto* fit = SmallButton(this, name + "Fit", tr("Fit"), tr("Show everything (F)"));
  auto* large =
      SmallButton(this, name + "Large", QString(QChar(0x2922)), tr("Make this view large, and back (M, or a double click)"));

  auto* row = new QHBoxLayout;
  row->setContentsMargins(1, 0, 1, 0);
  row->setSpacing(2);
  row->addWidget(axes_);
  row->addWidget(slider_, 1);
  row->addWidget(position_);
  row->addWidget(fit);
  row->addWidget(large);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->setSpacing(1);
  layout->addLayout(row);
  layout->addWidget(canvas_, 1);

  connect(slider_, &QSlider::valueChanged, this, [this](int step) {
    double range[2];
    canvas_->View()->GetPositionRange(range);
    SetPosition(range[0] + (range[1] - range[0]) * step / SliderSteps);
  });
  connect(fit, &QToolButton::clicked, this, &SlicePane::Fit);
  connect(large, &QToolButton::clicked, this, &SlicePane::LargeAsked);
  connect(canvas_, &SliceCanvas::LargeAsked, this, &SlicePane::LargeAsked);
  connect(canvas_, &SliceCanvas::PlaneChanged, this, &SlicePane::ShowPlane);
  connect(canvas_, &SliceCanvas::Drawn, this, &SlicePane::ShowPlane); // a view fits itself when the first volumes come
  FitPosition();
  SetAxis(axis);
}

void SlicePane::SetAxis(const QString& axis)
{
  axis_ = axis;
  canvas_->View()->SetAxis(axis.toUtf8().constData());
  canvas_->Ask();
  emit canvas_->PlaneChanged();
}

void SlicePane::NextAxis()
{
  SetAxis(axis_ == "z" ? "y" : axis_ == "y" ? "x" : "z");
}

void SlicePane::Fit()
{
  canvas_->View()->Fit();
  canvas_->SetPlaced(false);
  canvas_->Ask();
  emit canvas_->PlaneChanged();
}

void SlicePane::SetPosition(double mm)
{
  canvas_->View()->SetPosition(mm);
  canvas_->SetPlaced(true);
  canvas_->Ask();
  emit canvas_->PlaneChanged();
}

int SlicePane::WidthOf(const QString& text) const
{
  const QString longest = position_->textFromValue(position_->minimum()) + position_->suffix();
  return position_->minimumSizeHint().width() + position_->fontMetrics().horizontalAdvance(text) -
         position_->fontMetrics().horizontalAdvance(longest);
}

// A position in a body is shown whole (that of any number would take the slider's place): with its unit where there is room.
void SlicePane::FitPosition()
{
  const QString number = position_->textFromValue(-888.8), unit = QStringLiteral(" mm");
  position_->setMinimumWidth(WidthOf(number));
  const bool hasRoom = width() >= layout()->totalMinimumSize().width() + WidthOf(number + unit) - WidthOf(number);
  if (hasRoom == position_->suffix().isEmpty())
    position_->setSuffix(hasRoom ? unit : QString());
}

void SlicePane::resizeEvent(QResizeEvent* event)
{
  QWidget::resizeEvent(event);
  FitPosition();
}

void SlicePane::changeEvent(QEvent* event)
{
  QWidget::changeEvent(event);
  if (event->type() == QEvent::FontChange && layout())
    FitPosition();
}

// From the view, which others move too: what is linked to it, and a plane that was turned.
void SlicePane::ShowPlane()
{
  vtkUltrasoundSliceView* view = canvas_->View();
  axis_ = QString::fromStdString(view->GetAxis());
  Show(axes_, axis_);
  double range[2];
  view->GetPositionRange(range);
  const double position = view->GetPosition(), length = range[1] - range[0];
  Show(position_, position);
  const QSignalBlocker quiet(slider_);
  slider_->setEnabled(length > 0.0);
  slider_->setValue(
      length > 0.0 ? static_cast<int>(std::lround(SliderSteps * std::clamp((position - range[0]) / length, 0.0, 1.0))) : 0);
}

} // namespace echorama
