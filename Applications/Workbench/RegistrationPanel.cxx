// SPDX-License-Identifier: BSD-3-Clause
#include "RegistrationPanel.h"
#include "AlgorithmRun.h"
#include "Controls.h"
#include "Core/Base/Angles.h"
#include "Core/Geometry/RigidTransform.h"
#include "Filters/Registration/AlignPair.h"
#include "Workspace.h"
#include <QCheckBox>
#include <QComboBox>
#include <QFormLayout>
#include <QHeaderView>
#include <QPushButton>
#include <QTableWidget>
#include <QVBoxLayout>
#include <vtkCompositeDataSet.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkMatrix4x4.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkUltrasoundAligner.h>

namespace echorama {

namespace {

Pose PoseOf(vtkMatrix4x4* matrix)
{
  Pose pose;
  pose.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(matrix->GetData());
  return pose;
}

} // namespace

struct RegistrationPanel::Result {
  struct Volume {
    int id = 0;
    Pose before, after;
    Eigen::Vector3d middle; ///< as it lay before
    bool held = false;
    std::string verdict, reason;
    double overlap = 0.0, degrees = 0.0, mm = 0.0;
  };
  std::vector<Volume> volumes;
};

RegistrationPanel::RegistrationPanel(Workspace& workspace, QWidget* parent) : JobPanel(workspace, parent)
{
  setObjectName("registrationPanel");
  refine_ = Button(this, "refine", tr("&Refine selected"),
                   tr("Moves the selected volumes from where they are to where they agree with the others, which stay"),
                   [this] { Refine(); });
  alignAll_ = Button(this, "alignAll", tr("&Align all"), tr("Looks for the place of every volume beside the first"),
                     [this] { AlignAll(); });
  start_ =
      ChoiceField(this, "alignStart",
                  tr("Where all volumes are before: tracked, within 12 degrees and 20 mm of their places; hand-made, within 35 "
                     "degrees and a third of a volume; unknown, anywhere; automatic, one after the other while it is not clear"),
                  AlignStartNames());
  metric_ = ChoiceField(this, "alignMetric", tr("The likeness by which places are compared"), MetricNames());
  doubtful_ = CheckField(this, "alignDoubtful", tr("Accept ambiguous results"),
                         tr("Also moves volumes whose result is ambiguous. Failed volumes never move."));
  table_ = TableField(this, "alignResults", tr("What came out last; rest the mouse on an answer for its reason"),
                      {tr("Volume"), tr("Answer"), tr("Moved"), tr("Overlap")});
  table_->setSelectionMode(QAbstractItemView::NoSelection);
  table_->horizontalHeader()->setStretchLastSection(true);

  auto* layout = new QVBoxLayout(this);
  auto* form = new QFormLayout;
  layout->addWidget(refine_);
  layout->addWidget(alignAll_);
  form->addRow(tr("Start"), start_);
  form->addRow(tr("Metric"), metric_);
  layout->addLayout(form);
  layout->addWidget(doubtful_);
  layout->addWidget(table_, 1);
}

void RegistrationPanel::ShowState()
{
  refine_->setEnabled(!IsRunning());
  alignAll_->setEnabled(!IsRunning());
}

void RegistrationPanel::Refine()
{
  vtkUltrasoundAlignmentSession* session = workspace_.session;
  std::vector<int> ids, held;
  const int selected = session->GetNumberOfSelected(), count = session->GetNumberOfVolumes();
  const bool some = selected > 0 && selected < count;
  // Those that stay come first: the first one is the fixed volume.
  for (const bool moves : {false, true})
    for (int i = 0; i < count; ++i) {
      const int id = session->GetVolumeId(i);
      if ((some ? session->IsSelected(id) : i > 0) == moves) {
        if (!moves && !ids.empty())
          held.push_back(static_cast<int>(ids.size()));
        ids.push_back(id);
      }
    }
  Run(tr("Refine"), ids, held, NameOf(AlignStart::Tracked));
}

void RegistrationPanel::AlignAll()
{
  std::vector<int> ids;
  for (int i = 0; i < workspace_.session->GetNumberOfVolumes(); ++i)
    ids.push_back(workspace_.session->GetVolumeId(i));
  Run(tr("Align all"), ids, {}, start_->currentText().toStdString().c_str());
}

void RegistrationPanel::Run(const QString& label, const std::vector<int>& ids, const std::vector<int>& held, const char* start)
{
  if (IsRunning())
    return;
  if (ids.size() < 2) {
    workspace_.say(tr("%1: two volumes are needed; open another one").arg(label), true);
    return;
  }
  const auto result = std::make_shared<Result>();
  const vtkNew<vtkMultiBlockDataSet> blocks;
  for (const int id : ids) {
    const SessionVolume& volume = *workspace_.session->GetKernel().State().Find(id);
    const Pose& pose = volume.volumeToWorld;
    const vtkNew<vtkImageData> image; // it stays as it is, whatever the session does
    workspace_.session->GetSnapshot(id, image);
    const auto block = static_cast<unsigned int>(result->volumes.size());
    blocks->SetBlock(block, image);
    blocks->GetMetaData(block)->Set(vtkCompositeDataSet::NAME(), volume.name.c_str());
    result->volumes.push_back({id, pose, pose, pose * volume.geometry.Centre(), block == 0, {}, {}});
  }
  const auto aligner = vtkSmartPointer<vtkUltrasoundAligner>::New();
  aligner->SetInputDataObject(blocks);
  aligner->SetStart(start);
  aligner->SetMetric(metric_->currentText().toStdString().c_str());
  for (const int number : held) {
    aligner->AddHeldVolume(number);
    result->volumes[static_cast<std::size_t>(number)].held = true;
  }
  const auto work = [aligner, result](const Progress& progress) {
    Update(aligner, progress);
    for (std::size_t i = 0; i < result->volumes.size(); ++i) {
      Result::Volume& volume = result->volumes[i];
      const int number = static_cast<int>(i);
      const vtkNew<vtkMatrix4x4> matrix;
      aligner->GetPose(number, matrix);
      const Pose motion = PoseOf(matrix);
      if (!volume.held)
        volume.after = motion * volume.before;
      volume.verdict = aligner->GetVerdict(number);
      volume.reason = aligner->GetReason(number);
      volume.overlap = aligner->GetOverlap(number);
      volume.degrees = RotationAngle(motion) * DegreesPerRadian;
      volume.mm = (motion * volume.middle - volume.middle).norm();
    }
  };
  Start(label, work, [this, label, result] { Take(label, *result); });
}

void RegistrationPanel::Take(const QString& label, const Result& result)
{
  vtkUltrasoundAlignmentSession* session = workspace_.session;
  const bool takesDoubtful = doubtful_->isChecked();
  // The answer holds beside the volumes that stayed, where they were.
  for (const Result::Volume& volume : result.volumes) {
    const SessionVolume* now = session->GetKernel().State().Find(volume.id);
    if (volume.held && (!now || now->volumeToWorld.matrix() != volume.before.matrix())) {
      workspace_.say(
          tr("%1: result discarded, because a volume that the others were aligned with was moved in the meantime").arg(label),
          true);
      return;
    }
  }
  int moved = 0, left = 0;
  QString why;
  table_->setRowCount(0);
  session->BeginEdit(label.toUtf8());
  for (const Result::Volume& volume : result.volumes) {
    if (!session->HasVolume(volume.id))
      continue;
    QString answer = QString::fromStdString(volume.verdict), reason = QString::fromStdString(volume.reason);
    bool taken = false;
    if (volume.held) {
      answer = tr("stays");
      reason.clear();
    } else {
      const Pose now = session->GetKernel().State().Find(volume.id)->volumeToWorld;
      taken = volume.verdict == NameOf(Verdict::Aligned) || (takesDoubtful && volume.verdict == NameOf(Verdict::Ambiguous));
      if (taken && now.matrix() != volume.before.matrix()) {
        taken = false;
        reason = tr("it was moved during the alignment and was left where it is");
        answer = tr("not taken");
      }
      if (taken)
        session->SetVolumeToWorld(volume.id, volume.after);
      ++(taken ? moved : left);
      if (!taken)
        why += (why.isEmpty() ? QString() : QStringLiteral("; ")) +
               tr("%1: %2, %3").arg(QString::fromStdString(session->GetName(volume.id)), answer, reason);
    }
    const QString way = volume.held ? QString() : tr("%1 mm, %2°").arg(volume.mm, 0, 'f', 2).arg(volume.degrees, 0, 'f', 2);
    const QStringList texts{
        QString::fromStdString(session->GetName(volume.id)), answer, way,
        volume.held || volume.verdict == NameOf(Verdict::Failed) ? QString() : tr("%1%").arg(100.0 * volume.overlap, 0, 'f', 0)};
    InsertRow(table_, table_->rowCount(), texts, reason);
  }
  session->EndEdit();
  if (left == 0)
    workspace_.say(tr("%1: done, %2 moved").arg(label).arg(moved), false);
  else
    workspace_.say(
        tr("%1: %2 of %3 volumes aligned; the others were not moved. %4").arg(label).arg(moved).arg(moved + left).arg(why), true);
}

} // namespace echorama
