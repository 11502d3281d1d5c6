// SPDX-License-Identifier: BSD-3-Clause
#include "RegistrationPanel.h"
#include "AlgorithmRun.h"
#include "Core/Geometry/RigidTransform.h"
#include "Filters/Registration/AlignPair.h"
#include "Job.h"
#include "JobBar.h"
#include <array>
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

using Elements = std::array<double, 16>;

Elements ElementsOf(vtkMatrix4x4* matrix)
{
  Elements elements;
  std::copy_n(matrix->GetData(), 16, elements.begin());
  return elements;
}

QComboBox* ChoiceOfNames(const std::vector<std::string>& names, const char* objectName, const QString& tip, QWidget* parent)
{
  auto* box = new QComboBox(parent);
  box->setObjectName(objectName);
  box->setToolTip(tip);
  for (const std::string& name : names)
    box->addItem(QString::fromStdString(name));
  return box;
}

} // namespace

struct RegistrationPanel::Result {
  struct Volume {
    int id = 0;
    Elements before{}, after{};
    bool held = false;
    std::string verdict, reason;
    double overlap = 0.0, degrees = 0.0, mm = 0.0;
  };
  std::vector<Volume> volumes;
};

RegistrationPanel::RegistrationPanel(Workspace& workspace, QWidget* parent) : QWidget(parent), workspace_(workspace)
{
  setObjectName("registrationPanel");
  refine_ = new QPushButton(tr("&Refine selected"), this);
  refine_->setObjectName("refine");
  refine_->setToolTip(tr("Moves the selected volumes from where they are to where they agree with the others, which stay"));
  alignAll_ = new QPushButton(tr("&Align all"), this);
  alignAll_->setObjectName("alignAll");
  alignAll_->setToolTip(tr("Looks for the place of every volume beside the first"));
  start_ = ChoiceOfNames(
      AlignStartNames(), "alignStart",
      tr("Where all volumes are before: tracked, within 12 degrees and 20 mm of their places; hand-made, within 35 "
         "degrees and a third of a volume; unknown, anywhere; automatic, one after the other while it is not clear"),
      this);
  metric_ = ChoiceOfNames(MetricNames(), "alignMetric", tr("The likeness by which places are compared"), this);
  doubtful_ = new QCheckBox(tr("Accept ambiguous results"), this);
  doubtful_->setObjectName("alignDoubtful");
  doubtful_->setToolTip(tr("Also moves volumes whose result is ambiguous. Failed volumes never move."));
  table_ = new QTableWidget(0, 4, this);
  table_->setObjectName("alignResults");
  table_->setHorizontalHeaderLabels({tr("Volume"), tr("Answer"), tr("Moved"), tr("Overlap")});
  table_->setEditTriggers(QAbstractItemView::NoEditTriggers);
  table_->setSelectionMode(QAbstractItemView::NoSelection);
  table_->verticalHeader()->hide();
  table_->horizontalHeader()->setStretchLastSection(true);
  table_->setToolTip(tr("What came out last; rest the mouse on an answer for its reason"));

  auto* layout = new QVBoxLayout(this);
  auto* form = new QFormLayout;
  layout->addWidget(refine_);
  layout->addWidget(alignAll_);
  form->addRow(tr("Start"), start_);
  form->addRow(tr("Metric"), metric_);
  layout->addLayout(form);
  layout->addWidget(doubtful_);
  layout->addWidget(table_, 1);
  connect(refine_, &QPushButton::clicked, this, &RegistrationPanel::Refine);
  connect(alignAll_, &QPushButton::clicked, this, &RegistrationPanel::AlignAll);
}

RegistrationPanel::~RegistrationPanel()
{
  delete job_; // before the buttons
}

void RegistrationPanel::ShowState()
{
  refine_->setEnabled(!job_);
  alignAll_->setEnabled(!job_);
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
  if (job_)
    return;
  if (ids.size() < 2) {
    workspace_.say(tr("%1: two volumes are needed; open another one").arg(label), true);
    return;
  }
  const auto result = std::make_shared<Result>();
  vtkNew<vtkMultiBlockDataSet> all, blocks; // what stays as it is, whatever the session does
  workspace_.session->GetVolumes(all);
  for (const int id : ids) {
    Result::Volume volume;
    volume.id = id;
    vtkNew<vtkMatrix4x4> pose;
    workspace_.session->GetVolumeToWorld(id, pose);
    volume.before = volume.after = ElementsOf(pose);
    const auto block = static_cast<unsigned int>(result->volumes.size());
    int index = 0;
    while (workspace_.session->GetVolumeId(index) != id)
      ++index;
    blocks->SetBlock(block, all->GetBlock(static_cast<unsigned int>(index)));
    blocks->GetMetaData(block)->Set(vtkCompositeDataSet::NAME(), workspace_.session->GetName(id).c_str());
    result->volumes.push_back(volume);
  }
  vtkNew<vtkUltrasoundAligner> aligner;
  aligner->SetInputDataObject(blocks);
  aligner->SetStart(start);
  aligner->SetMetric(metric_->currentText().toStdString().c_str());
  for (const int number : held) {
    aligner->AddHeldVolume(number);
    result->volumes[static_cast<std::size_t>(number)].held = true;
  }
  result->volumes.front().held = true;

  const vtkSmartPointer<vtkUltrasoundAligner> kept(aligner);
  job_ = Job::Start(
      this, label,
      [kept, result](const Progress& progress) {
        Update(kept, progress);
        for (std::size_t i = 0; i < result->volumes.size(); ++i) {
          Result::Volume& volume = result->volumes[i];
          const int number = static_cast<int>(i);
          vtkNew<vtkMatrix4x4> motion, before, after;
          kept->GetPose(number, motion);
          before->DeepCopy(volume.before.data());
          vtkMatrix4x4::Multiply4x4(motion, before, after);
          if (!volume.held)
            volume.after = ElementsOf(after);
          volume.verdict = kept->GetVerdict(number);
          volume.reason = kept->GetReason(number);
          volume.overlap = kept->GetOverlap(number);
          Pose pose;
          pose.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(motion->GetData());
          volume.degrees = RotationAngle(pose) * 57.29577951308232;
          // The middle of the volume as it lay before.
          auto* image = vtkImageData::SafeDownCast(
              vtkMultiBlockDataSet::SafeDownCast(kept->GetInputDataObject(0, 0))->GetBlock(static_cast<unsigned int>(i)));
          double index[3], middle[3];
          const int* extent = image->GetExtent();
          for (int axis = 0; axis < 3; ++axis)
            index[axis] = 0.5 * (extent[2 * axis] + extent[2 * axis + 1]);
          image->TransformContinuousIndexToPhysicalPoint(index, middle);
          const Eigen::Vector3d from(middle);
          volume.mm = (pose * from - from).norm();
        }
      },
      [this, label, result] { Take(label, *result); },
      [this, label](const QString& error) { workspace_.say(tr("%1: %2").arg(label, error), true); });
  connect(job_, &Job::Ended, this, [this] {
    job_ = nullptr;
    ShowState();
  });
  workspace_.jobs->Watch(job_);
  ShowState();
}

void RegistrationPanel::Take(const QString& label, const Result& result)
{
  vtkUltrasoundAlignmentSession* session = workspace_.session;
  const bool takesDoubtful = doubtful_->isChecked();
  // The answer holds beside the volumes that stayed, where they were.
  for (const Result::Volume& volume : result.volumes) {
    vtkNew<vtkMatrix4x4> now;
    if (volume.held && (!session->GetVolumeToWorld(volume.id, now) || ElementsOf(now) != volume.before)) {
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
      vtkNew<vtkMatrix4x4> now, after;
      session->GetVolumeToWorld(volume.id, now);
      after->DeepCopy(volume.after.data());
      taken = volume.verdict == NameOf(Verdict::Aligned) || (takesDoubtful && volume.verdict == NameOf(Verdict::Ambiguous));
      if (taken && ElementsOf(now) != volume.before) {
        taken = false;
        reason = tr("it was moved during the alignment and was left where it is");
        answer = tr("not taken");
      }
      if (taken)
        session->SetVolumeToWorld(volume.id, after);
      ++(taken ? moved : left);
      if (!taken)
        why += (why.isEmpty() ? QString() : QStringLiteral("; ")) +
               tr("%1: %2, %3").arg(QString::fromStdString(session->GetName(volume.id)), answer, reason);
    }
    const int row = table_->rowCount();
    table_->insertRow(row);
    const QString way = volume.held ? QString() : tr("%1 mm, %2°").arg(volume.mm, 0, 'f', 2).arg(volume.degrees, 0, 'f', 2);
    const QStringList texts{
        QString::fromStdString(session->GetName(volume.id)), answer, way,
        volume.held || volume.verdict == NameOf(Verdict::Failed) ? QString() : tr("%1%").arg(100.0 * volume.overlap, 0, 'f', 0)};
    for (int column = 0; column < texts.size(); ++column) {
      auto* item = new QTableWidgetItem(texts[column]);
      item->setToolTip(reason);
      table_->setItem(row, column, item);
    }
  }
  session->EndEdit();
  if (left == 0)
    workspace_.say(tr("%1: done, %2 moved").arg(label).arg(moved), false);
  else
    workspace_.say(
        tr("%1: %2 of %3 volumes aligned; the others were not moved. %4").arg(label).arg(moved).arg(moved + left).arg(why), true);
}

} // namespace echorama
