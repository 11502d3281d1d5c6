// SPDX-License-Identifier: BSD-3-Clause
#include "LandmarkBox.h"
#include "Controls.h"
#include "Filters/Registration/AlignPair.h"
#include "Workspace.h"
#include <algorithm>
#include <QDoubleSpinBox>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QHeaderView>
#include <QPushButton>
#include <QTableWidget>
#include <QVBoxLayout>

namespace echorama {

LandmarkBox::LandmarkBox(Workspace& workspace, QWidget* parent) : QGroupBox(parent), workspace_(workspace)
{
  setObjectName("landmarks");
  setTitle(tr("Landmarks"));
  table_ =
      TableField(this, "landmarkTable",
                 tr("Places that were marked (tool Mark, key 6), and how far apart the volumes put those of one label. Two or "
                    "three in both volumes tell places apart that look alike. Choosing one brings the slices there."),
                 {tr("Label"), tr("In"), tr("Apart")});
  table_->setSelectionBehavior(QAbstractItemView::SelectRows);
  table_->horizontalHeader()->setSectionResizeMode(QHeaderView::ResizeToContents);
  table_->horizontalHeader()->setSectionResizeMode(1, QHeaderView::Stretch);
  table_->setFixedHeight(120);
  connect(table_, &QTableWidget::itemSelectionChanged, this, &LandmarkBox::ShowPlace);
  AlignPairParameters defaults;
  ParameterList parameters = Describe(defaults);
  const Parameter& sigma = Named(parameters, "LandmarkSigmaMm");
  sigma_ = NumberField(this, {"landmarkSigma",
                              tr("How exactly they are marked: the standard deviation of how far apart two of one "
                                 "label lie, along each axis"),
                              std::max(sigma.range.low, 0.1), sigma.range.high, 1, 0.5, tr(" mm")});
  sigma_->setValue(sigma.Number());
  auto* form = new QFormLayout;
  form->addRow(tr("Exact to"), sigma_);
  auto* buttons = new QHBoxLayout;
  buttons->addWidget(Button(this, "landmarkRemove", tr("Remove"), tr("Removes the landmarks that are selected in the list"),
                            [this] { RemoveSelected(); }));
  buttons->addWidget(Button(this, "landmarkClear", tr("Clear"), tr("Removes all landmarks of all volumes"),
                            [this] { workspace_.session->ClearLandmarks(); }));
  auto* layout = new QVBoxLayout(this);
  layout->addWidget(table_);
  layout->addLayout(form);
  layout->addLayout(buttons);
}

double LandmarkBox::SigmaMm() const
{
  return sigma_->value();
}

void LandmarkBox::ShowLandmarks()
{
  struct Row {
    QString label;
    QStringList volumes;
    std::vector<Eigen::Vector3d> places;
  };
  std::vector<Row> rows;
  for (const SessionVolume& volume : workspace_.session->GetKernel().State().volumes)
    for (const Landmark& landmark : volume.landmarks) {
      const QString label = QString::fromStdString(landmark.label);
      auto row = std::find_if(rows.begin(), rows.end(), [&](const Row& each) { return each.label == label; });
      if (row == rows.end())
        row = rows.insert(rows.end(), Row{label, {}, {}});
      row->volumes.append(QString::fromStdString(volume.name));
      row->places.push_back(volume.volumeToWorld * landmark.position);
    }
  table_->setRowCount(0);
  for (const Row& row : rows) {
    double apart = 0.0;
    for (const Eigen::Vector3d& a : row.places)
      for (const Eigen::Vector3d& b : row.places)
        apart = std::max(apart, (a - b).norm());
    InsertRow(table_, table_->rowCount(),
              {row.label, row.volumes.join(", "), row.places.size() > 1 ? tr("%1 mm").arg(apart, 0, 'f', 2) : QString()});
  }
}

void LandmarkBox::ShowPlace()
{
  const QTableWidgetItem* item = table_->item(table_->currentRow(), 0);
  if (!item || !item->isSelected())
    return;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (const SessionVolume& volume : workspace_.session->GetKernel().State().volumes)
    for (const Landmark& landmark : volume.landmarks)
      if (QString::fromStdString(landmark.label) == item->text()) {
        sum += volume.volumeToWorld * landmark.position;
        ++count;
      }
  if (count > 0)
    emit PlaceAsked(sum.x() / count, sum.y() / count, sum.z() / count);
}

void LandmarkBox::RemoveSelected()
{
  QStringList labels;
  for (int row = 0; row < table_->rowCount(); ++row)
    if (table_->item(row, 0)->isSelected())
      labels.append(table_->item(row, 0)->text());
  if (labels.isEmpty())
    return;
  vtkUltrasoundAlignmentSession* session = workspace_.session;
  session->BeginEdit(tr("Remove landmarks").toUtf8());
  for (const QString& label : labels)
    session->RemoveLandmark(label.toUtf8());
  session->EndEdit();
}

} // namespace echorama
