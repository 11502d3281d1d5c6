// SPDX-License-Identifier: BSD-3-Clause
#include "CheckPanel.h"
#include "Controls.h"
#include "DisagreementBox.h"
#include "Flicker.h"
#include "GreyLevels.h"
#include "MeasureTool.h"
#include "ProfilePlot.h"
#include "vtkUltrasoundSliceInput.h"
#include "Widgets/Pictures/LineProfile.h"
#include "Workbench.h"
#include <algorithm>
#include <cmath>
#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QFormLayout>
#include <QGroupBox>
#include <QHBoxLayout>
#include <QHeaderView>
#include <QPushButton>
#include <QShortcut>
#include <QSignalBlocker>
#include <QTableWidget>
#include <QVBoxLayout>

namespace echorama {

namespace {

// The line whose profile is shown: what is being measured, else the chosen distance; none.
std::vector<Eigen::Vector3d> LineOf(const Workbench& bench)
{
  std::vector<Eigen::Vector3d> line = bench.Measuring()->Draft();
  if (line.empty())
    for (const Measurement& each : bench.Session()->GetKernel().State().measurements)
      if (each.number == bench.Measuring()->Chosen())
        line = each.points;
  if (line.size() != 2 || line[0] == line[1])
    line.clear();
  return line;
}

} // namespace

CheckPanel::CheckPanel(Workbench* bench, QWidget* parent) : QWidget(parent), bench_(bench)
{
  setObjectName("checkPanel");
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(6, 0, 6, 4);
  layout->addWidget(MeasureBox());
  layout->addWidget(FlickerBox());
  auto* disagreement = new QGroupBox(tr("Disagreement"), this);
  auto* inside = new QVBoxLayout(disagreement);
  inside->setContentsMargins(0, 0, 0, 0);
  inside->addWidget(new DisagreementBox(bench, disagreement));
  layout->addWidget(disagreement);
  layout->addWidget(ReadoutBox());
  layout->addStretch(1);
  connect(bench, &Workbench::PointerChanged, this, &CheckPanel::ShowReadout);
  connect(bench, &Workbench::MeasurementsChanged, this, &CheckPanel::ShowMeasurements);
  connect(bench->Measuring(), &MeasureTool::Changed, this, &CheckPanel::ShowMeasurements);
  for (auto changed : {&Workbench::VolumesChanged, &Workbench::PosesChanged, &Workbench::VoxelsChanged})
    connect(bench, changed, this, &CheckPanel::ShowProfile);
  connect(bench, &Workbench::VolumesChanged, this, &CheckPanel::ShowSides);
  connect(bench->Flickering(), &Flicker::Changed, this, [this] { Show(flickers_, bench_->Flickering()->IsOn()); });
  ShowSides();
  ShowMeasurements();
}

QWidget* CheckPanel::ReadoutBox()
{
  auto* box = new QGroupBox(tr("Under the mouse"), this);
  here_ = TableField(box, "greyLevels", tr("Grey level of each volume where the mouse points"), {tr("Volume"), tr("Grey level")});
  here_->setSelectionMode(QAbstractItemView::NoSelection);
  here_->horizontalHeader()->setSectionResizeMode(0, QHeaderView::Stretch);
  auto* layout = new QVBoxLayout(box);
  layout->setContentsMargins(2, 2, 2, 2);
  layout->addWidget(here_);
  return box;
}

QWidget* CheckPanel::MeasureBox()
{
  auto* box = new QGroupBox(tr("Measurements"), this);
  measures_ = TableField(box, "measurements",
                         tr("Distances (tool Measure, key 7) and angles (tool Angle, key 8). Their points can be dragged in the "
                            "slices. The profile is that of the selected distance."),
                         {tr("No."), tr("What"), tr("Value")});
  measures_->setSelectionBehavior(QAbstractItemView::SelectRows);
  measures_->horizontalHeader()->setSectionResizeMode(QHeaderView::ResizeToContents);
  measures_->horizontalHeader()->setSectionResizeMode(1, QHeaderView::Stretch);
  measures_->setFixedHeight(110);
  connect(measures_, &QTableWidget::itemSelectionChanged, this, [this] {
    const auto* item = measures_->item(measures_->currentRow(), 0);
    if (item && item->isSelected())
      bench_->Measuring()->Choose(item->text().toInt());
  });
  connect(new QShortcut(Qt::Key_Delete, measures_, nullptr, nullptr, Qt::WidgetShortcut), &QShortcut::activated, this,
          &CheckPanel::RemoveChosen);
  profile_ = new ProfilePlot(box);
  connect(profile_, &ProfilePlot::PointedAt, this, &CheckPanel::PointAlong);
  connect(profile_, &ProfilePlot::Left, this, [this] { bench_->SetPointer(std::nullopt, profile_); });
  auto* buttons = new QHBoxLayout;
  buttons->addWidget(Button(box, "measureRemove", tr("Remove"),
                            tr("Removes the measurements that are selected in the list (Delete)"), [this] { RemoveChosen(); }));
  buttons->addWidget(Button(box, "measureClear", tr("Clear"), tr("Removes all measurements; can be undone"),
                            [this] { bench_->Session()->ClearMeasurements(); }));
  auto* layout = new QVBoxLayout(box);
  layout->setContentsMargins(2, 2, 2, 2);
  layout->addWidget(measures_);
  layout->addLayout(buttons);
  layout->addWidget(profile_);
  return box;
}

QWidget* CheckPanel::FlickerBox()
{
  auto* box = new QGroupBox(tr("Flicker"), this);
  const auto chosen = [this](const QString&) {
    bench_->Flickering()->SetSides(one_->currentData().toString(), other_->currentData().toString());
  };
  one_ = ChoiceField(box, "flickerOne", tr("What is shown by turns with the other"), {}, chosen);
  other_ = ChoiceField(box, "flickerOther", tr("What is shown by turns with the first"), {}, chosen);
  rate_ = NumberField(box, {"flickerRate", tr("Changes per second"), Flicker::SlowestHz, Flicker::FastestHz, 1, 0.5, tr(" /s")},
                      [this](double rate) { bench_->Flickering()->SetRate(rate); });
  Show(rate_, 2.0);
  flickers_ =
      CheckField(box, "flickers", tr("Flicker (Shift+Space)"),
                 tr("Shows both by turns in the slices: what does not agree jumps. Ends by itself when something is dragged"),
                 [this](bool on) {
                   on ? bench_->Flickering()->Start() : bench_->Flickering()->Stop();
                   Show(flickers_, bench_->Flickering()->IsOn());
                 });
  auto* form = new QFormLayout(box);
  form->setContentsMargins(2, 2, 2, 2);
  form->addRow(tr("Between"), one_);
  form->addRow(tr("and"), other_);
  form->addRow(tr("Rate"), rate_);
  form->addRow(flickers_);
  return box;
}

void CheckPanel::ShowSides()
{
  for (QComboBox* side : {one_, other_}) {
    const QSignalBlocker quiet(side);
    const QString before = side->currentData().toString();
    side->clear();
    side->addItem(tr("Selected"), "selected");
    side->addItem(tr("Others"), "others");
    for (int id : bench_->Volumes())
      side->addItem(bench_->NameOf(id), QString::number(id));
    MayBeLong(side);
    const int place = side->findData(before);
    side->setCurrentIndex(place >= 0 ? place : side == one_ ? 0 : 1);
  }
  bench_->Flickering()->SetSides(one_->currentData().toString(), other_->currentData().toString());
}

void CheckPanel::ShowReadout()
{
  if (!isVisible() || !bench_->Pointer() || bench_->Interacting())
    return;
  const std::vector<GreyLevel> levels = GreyLevelsAt(*bench_, *bench_->Pointer());
  here_->setRowCount(static_cast<int>(levels.size()));
  for (int row = 0; row < here_->rowCount(); ++row) {
    const GreyLevel& level = levels[static_cast<std::size_t>(row)];
    for (int column : {0, 1})
      if (!here_->item(row, column))
        here_->setItem(row, column, new QTableWidgetItem);
    here_->item(row, 0)->setText(level.name);
    here_->item(row, 0)->setForeground(level.colour);
    here_->item(row, 1)->setText(level.Text());
  }
}

void CheckPanel::ShowMeasurements()
{
  const QSignalBlocker quiet(measures_);
  const auto& all = bench_->Session()->GetKernel().State().measurements;
  measures_->setRowCount(0);
  for (const Measurement& each : all) {
    const QString value =
        QString("%1%2").arg(each.Value(), 0, 'f', each.IsAngle() ? 1 : 2).arg(each.IsAngle() ? tr("°") : tr(" mm"));
    const int row = measures_->rowCount();
    InsertRow(measures_, row, {QString::number(each.number), each.IsAngle() ? tr("Angle") : tr("Distance"), value});
    if (each.number == bench_->Measuring()->Chosen())
      measures_->setCurrentCell(row, 0, QItemSelectionModel::ClearAndSelect | QItemSelectionModel::Rows);
  }
  ShowProfile();
}

void CheckPanel::ShowProfile()
{
  if (!isVisible())
    return;
  const std::vector<Eigen::Vector3d> line = LineOf(*bench_);
  if (line.empty())
    return profile_->SetCurves({}, 0.0, 0.0, 1.0);
  constexpr double most = 2000.0;
  const double length = (line[1] - line[0]).norm();
  const int count = static_cast<int>(std::clamp(std::ceil(2.0 * length / bench_->SmallestSpacing()), 1.0, most)) + 1;
  QVector<ProfilePlot::Curve> curves;
  auto* session = bench_->Session();
  for (int id : bench_->Volumes())
    if (session->GetVisible(id))
      curves.append(
          {bench_->NameOf(id), ColourOf(*bench_, id), LineProfile(PosedVolumeOf(session, id), line[0], line[1], count)});
  double window[2];
  session->GetGreyWindow(window);
  profile_->SetCurves(std::move(curves), length, window[0], window[1]);
}

void CheckPanel::PointAlong(double share)
{
  const std::vector<Eigen::Vector3d> line = LineOf(*bench_);
  if (!line.empty())
    bench_->SetPointer(Eigen::Vector3d(line[0] + share * (line[1] - line[0])), profile_);
}

void CheckPanel::RemoveChosen()
{
  QVector<int> numbers;
  for (int row = 0; row < measures_->rowCount(); ++row)
    if (measures_->item(row, 0)->isSelected())
      numbers.append(measures_->item(row, 0)->text().toInt());
  if (numbers.isEmpty())
    return;
  auto* session = bench_->Session();
  session->BeginEdit(tr("Remove measurements").toUtf8());
  for (int number : numbers)
    session->RemoveMeasurement(number);
  session->EndEdit();
}

void CheckPanel::showEvent(QShowEvent* event)
{
  QWidget::showEvent(event);
  ShowProfile();
}

} // namespace echorama
