// SPDX-License-Identifier: BSD-3-Clause
#include "RegistrationPanel.h"
#include "AlgorithmRun.h"
#include "Controls.h"
#include "Core/Base/Angles.h"
#include "Core/Geometry/MatrixRows.h"
#include "Core/Geometry/RigidTransform.h"
#include "Filters/Registration/AlignPair.h"
#include "LandmarkBox.h"
#include "PairBox.h"
#include "Workbench.h"
#include "Workspace.h"
#include <algorithm>
#include <QCheckBox>
#include <QComboBox>
#include <QFileDialog>
#include <QFormLayout>
#include <QGroupBox>
#include <QHBoxLayout>
#include <QHeaderView>
#include <QLineEdit>
#include <QPushButton>
#include <QTableWidget>
#include <QToolButton>
#include <QVBoxLayout>
#include <vtkCompositeDataSet.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkMatrix4x4.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkUltrasoundAligner.h>
#include <vtkUltrasoundTrackerPlacement.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {

namespace {

constexpr const char* Placed = "placed"; // by a tracker, which gives no verdict

QLineEdit* LineField(QFormLayout* form, const char* name, const QString& label, const QString& help)
{
  auto* field = new QLineEdit(form->parentWidget());
  field->setObjectName(name);
  field->setToolTip(help);
  form->addRow(label, field);
  return field;
}

// A path that is typed or chosen.
QLineEdit* FileField(QFormLayout* form, const char* name, const QString& label, const QString& help, const QString& filter)
{
  QWidget* parent = form->parentWidget();
  auto* field = new QLineEdit(parent);
  field->setObjectName(name);
  field->setToolTip(help);
  QToolButton* browse = SmallButton(parent, QString(name) + "Browse", "...", RegistrationPanel::tr("Chooses the file"));
  QObject::connect(browse, &QToolButton::clicked, field, [field, label, filter] {
    auto* dialog = new QFileDialog(field, label, field->text(), filter);
    dialog->setAttribute(Qt::WA_DeleteOnClose);
    dialog->setFileMode(QFileDialog::ExistingFile);
    QObject::connect(dialog, &QFileDialog::fileSelected, field, &QLineEdit::setText);
    dialog->open();
  });
  auto* row = new QHBoxLayout;
  row->addWidget(field);
  row->addWidget(browse);
  form->addRow(label, row);
  return field;
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

    void SetMotion(const Pose& motion)
    {
      degrees = RotationAngle(motion) * DegreesPerRadian;
      mm = (motion * middle - middle).norm();
    }
  };
  std::vector<Volume> volumes;
  QVector<PairGraph::Edge> pairs;

  void TakePairs(const AlignVolumesResult& found)
  {
    for (const PairOfVolumes& pair : found.pairs) {
      const Volume &a = volumes[static_cast<std::size_t>(pair.fixed)], &b = volumes[static_cast<std::size_t>(pair.moving)];
      const PairAlignment& its = pair.alignment;
      QStringList lines{tr("%1% of the smaller volume overlap, similarity %2")
                            .arg(100.0 * its.overlap, 0, 'f', 0)
                            .arg(its.similarity, 0, 'f', 2)};
      if (pair.verdict != Verdict::Failed)
        lines.append(tr("predicted error %1 mm; %2 mm from where the volumes were placed")
                         .arg(its.errorMm, 0, 'f', 2)
                         .arg(pair.residualMm, 0, 'f', 2));
      if (!pair.reason.empty())
        lines.append(QString::fromStdString(pair.reason));
      if (pair.votedDown)
        lines.append(tr("other pairs disagreed with it"));
      pairs.append({a.id, b.id, NameOf(pair.verdict), lines.join("\n"), pair.votedDown, pair.stands, its.errorMm});
    }
  }

  // The volumes as they are now, as blocks with their names; the first one is held.
  vtkSmartPointer<vtkMultiBlockDataSet> Take(vtkUltrasoundAlignmentSession* session, const std::vector<int>& ids)
  {
    auto blocks = vtkSmartPointer<vtkMultiBlockDataSet>::New();
    for (const int id : ids) {
      const SessionVolume& volume = *session->GetKernel().State().Find(id);
      const Pose& pose = volume.volumeToWorld;
      const vtkNew<vtkImageData> image; // it stays as it is, whatever the session does
      session->GetSnapshot(id, image);
      const auto block = static_cast<unsigned int>(volumes.size());
      blocks->SetBlock(block, image);
      blocks->GetMetaData(block)->Set(vtkCompositeDataSet::NAME(), volume.name.c_str());
      volumes.push_back({id, pose, pose, pose * volume.geometry.Centre(), block == 0, {}, {}});
    }
    return blocks;
  }
};

RegistrationPanel::RegistrationPanel(Workbench* bench, QWidget* parent) : JobPanel(bench->Shared(), parent)
{
  setObjectName("registrationPanel");
  refine_ =
      Button(this, "refine", tr("&Refine selected"),
             tr("Moves the selected volumes from where they are to where they agree with the others, which stay. Looks within "
                "20 mm and 12 degrees, and farther when that is not enough and you say so"),
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
  auto* byTracker = new QGroupBox(tr("Tracker"), this);
  auto* trackerForm = new QFormLayout(byTracker);
  recording_ =
      FileField(trackerForm, "placeRecording", tr("Recording"), tr("The poses of the probe: a tracked sequence or a table"),
                tr("Recordings (*.mha *.mhd *.nrrd *.csv *.txt);;All files (*)"));
  tool_ = LineField(trackerForm, "placeTool", tr("Tool"),
                    tr("The tool that is fixed to the probe, as the recording names it; empty: the only one"));
  calibration_ = FileField(trackerForm, "placeCalibration", tr("Calibration"),
                           tr("From the volume to the tool, as echorama calibrate hand-eye writes it"),
                           tr("Calibrations (*.json);;All files (*)"));
  place_ = Button(this, "placeByTracker", tr("&Place by tracker"),
                  tr("Puts all volumes beside the first as the tracker saw them"), [this] { PlaceByTracker(); });
  trackerForm->addRow(place_);
  landmarks_ = new LandmarkBox(workspace_, this);
  pairs_ = new PairBox(bench, this);
  table_ = TableField(this, "alignResults", tr("What came out last; rest the mouse on an answer for its reason"),
                      {tr("Volume"), tr("Answer"), tr("Moved"), tr("Overlap")});
  table_->setSelectionMode(QAbstractItemView::NoSelection);
  table_->horizontalHeader()->setStretchLastSection(true);
  table_->setMinimumHeight(130);

  auto* layout = new QVBoxLayout(this);
  auto* form = new QFormLayout;
  layout->addWidget(refine_);
  layout->addWidget(alignAll_);
  form->addRow(tr("Start"), start_);
  form->addRow(tr("Metric"), metric_);
  layout->addLayout(form);
  layout->addWidget(doubtful_);
  layout->addWidget(table_);
  layout->addWidget(pairs_);
  layout->addWidget(landmarks_);
  layout->addWidget(byTracker);
  layout->addStretch(1);
}

void RegistrationPanel::ShowState()
{
  for (QPushButton* button : {refine_, alignAll_, place_})
    button->setEnabled(!IsRunning());
}

std::vector<int> RegistrationPanel::AllIds() const
{
  std::vector<int> ids;
  for (int i = 0; i < workspace_.session->GetNumberOfVolumes(); ++i)
    if (const int id = workspace_.session->GetVolumeId(i); !workspace_.session->IsResult(id)) // it lies where its sources lie
      ids.push_back(id);
  return ids;
}

void RegistrationPanel::Refine()
{
  vtkUltrasoundAlignmentSession* session = workspace_.session;
  std::vector<int> ids, held;
  const std::vector<int> all = AllIds();
  const auto selected =
      static_cast<std::size_t>(std::count_if(all.begin(), all.end(), [session](int id) { return session->IsSelected(id); }));
  if (selected == 0 && session->GetNumberOfSelected() > 0) {
    Tell(Message::Warning, tr("Refine: what is selected was made of other volumes and lies where they lie; select one of those"));
    return;
  }
  const bool some = selected > 0 && selected < all.size();
  // Those that stay come first: the first one is the fixed volume.
  for (const bool moves : {false, true})
    for (const int id : all) {
      if ((some ? session->IsSelected(id) : id != all.front()) == moves) {
        if (!moves && !ids.empty())
          held.push_back(static_cast<int>(ids.size()));
        ids.push_back(id);
      }
    }
  Run(tr("Refine"), ids, held, "tracked");
}

void RegistrationPanel::Tell(Message::Kind kind, const QString& text, const QVector<Message::Answer>& answers) const
{
  workspace_.show({kind, text, answers, objectName()});
}

void RegistrationPanel::AlignAll()
{
  Run(tr("Align all"), AllIds(), {}, start_->currentText().toStdString());
}

bool RegistrationPanel::MayRun(const QString& label, const std::vector<int>& ids) const
{
  if (!IsRunning() && ids.size() < 2)
    Tell(Message::Warning, tr("%1: two volumes are needed; open another one").arg(label));
  return !IsRunning() && ids.size() >= 2 && workspace_.mayHelp(label);
}

void RegistrationPanel::Run(const QString& label, const std::vector<int>& ids, const std::vector<int>& held,
                            const std::string& start)
{
  if (!MayRun(label, ids))
    return;
  const auto result = std::make_shared<Result>();
  const auto blocks = result->Take(workspace_.session, ids);
  const auto aligner = vtkSmartPointer<vtkUltrasoundAligner>::New();
  aligner->SetInputDataObject(blocks);
  aligner->SetStart(start.c_str());
  aligner->SetMetric(metric_->currentText().toStdString().c_str());
  for (const int number : held) {
    aligner->AddHeldVolume(number);
    result->volumes[static_cast<std::size_t>(number)].held = true;
  }
  aligner->SetLandmarkSigmaMm(landmarks_->SigmaMm());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const SessionVolume& volume = *workspace_.session->GetKernel().State().Find(ids[i]);
    for (const Landmark& landmark : volume.landmarks) {
      const Eigen::Vector3d place = volume.volumeToWorld * landmark.position;
      aligner->AddLandmark(static_cast<int>(i), landmark.label.c_str(), place.x(), place.y(), place.z());
    }
  }
  const auto work = [aligner, result](const Progress& progress) {
    Update(aligner, progress);
    for (std::size_t i = 0; i < result->volumes.size(); ++i) {
      Result::Volume& volume = result->volumes[i];
      const int number = static_cast<int>(i);
      const vtkNew<vtkMatrix4x4> matrix;
      aligner->GetPose(number, matrix);
      const Pose motion = FromRows<Pose>(matrix->GetData());
      if (!volume.held)
        volume.after = motion * volume.before;
      volume.verdict = aligner->GetVerdict(number);
      volume.reason = aligner->GetReason(number);
      volume.overlap = aligner->GetOverlap(number);
      volume.SetMotion(motion);
    }
    result->TakePairs(aligner->Result());
  };
  // Refining looks near where volumes are: what is farther away takes longer, and more of it looks alike.
  std::function<void()> farther;
  if (start == "tracked")
    farther = [this, ids, held] {
      const bool areThere = std::all_of(ids.begin(), ids.end(), [this](int id) { return workspace_.session->HasVolume(id); });
      if (areThere)
        Run(tr("Search farther"), ids, held, "automatic");
      else
        Tell(Message::Warning, tr("Search farther: a volume of before has been removed"));
    };
  Start(label, work, [this, label, result, farther] {
    workspace_.BetweenEdits(this, [this, label, result, farther] { Take(label, *result, farther); });
  });
}

void RegistrationPanel::PlaceByTracker()
{
  const QString label = tr("Place by tracker");
  const std::vector<int> ids = AllIds();
  if (!MayRun(label, ids))
    return;
  const auto result = std::make_shared<Result>();
  const auto blocks = result->Take(workspace_.session, ids);
  // Calibrations may be of volumes as they were acquired, so each goes back to where its file has it.
  for (unsigned int i = 0; i < blocks->GetNumberOfBlocks(); ++i)
    vtkUltrasoundVolume::Move(vtkImageData::SafeDownCast(blocks->GetBlock(i)), result->volumes[i].before.inverse());
  const auto placement = vtkSmartPointer<vtkUltrasoundTrackerPlacement>::New();
  placement->SetInputDataObject(blocks);
  placement->SetRecording(recording_->text().trimmed().toUtf8());
  placement->SetTool(tool_->text().trimmed().toUtf8());
  placement->SetCalibrationFile(calibration_->text().trimmed().toUtf8());
  const auto work = [placement, result](const Progress& progress) {
    Update(placement, progress);
    for (std::size_t i = 1; i < result->volumes.size(); ++i) {
      Result::Volume& volume = result->volumes[i];
      const vtkNew<vtkMatrix4x4> matrix;
      placement->GetPose(static_cast<int>(i), matrix);
      volume.after = result->volumes.front().before * FromRows<Pose>(matrix->GetData()); // beside the first one, wherever that is
      volume.verdict = Placed;
      volume.SetMotion(volume.after * volume.before.inverse());
    }
  };
  Start(label, work,
        [this, label, result] { workspace_.BetweenEdits(this, [this, label, result] { Take(label, *result, {}); }); });
}

void RegistrationPanel::Take(const QString& label, const Result& result, const std::function<void()>& farther)
{
  vtkUltrasoundAlignmentSession* session = workspace_.session;
  const bool takesDoubtful = doubtful_->isChecked();
  // The answer holds beside the volumes that stayed, where they were.
  for (const Result::Volume& volume : result.volumes) {
    const SessionVolume* now = session->GetKernel().State().Find(volume.id);
    if (volume.held && (!now || now->volumeToWorld.matrix() != volume.before.matrix())) {
      Tell(Message::Warning,
           tr("%1: result discarded, because a volume that the others were aligned with was moved in the meantime").arg(label));
      return;
    }
  }
  pairs_->SetPairs(result.pairs);
  int moved = 0, left = 0, unsure = 0;
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
      taken = volume.verdict == Placed || volume.verdict == NameOf(Verdict::Aligned) ||
              (takesDoubtful && volume.verdict == NameOf(Verdict::Ambiguous));
      unsure += !taken;
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
    const QStringList texts{QString::fromStdString(session->GetName(volume.id)), answer, way,
                            volume.held || volume.verdict == Placed || volume.verdict == NameOf(Verdict::Failed)
                                ? QString()
                                : tr("%1%").arg(100.0 * volume.overlap, 0, 'f', 0)};
    InsertRow(table_, table_->rowCount(), texts, reason);
  }
  session->EndEdit();
  if (left == 0)
    return Tell(Message::Note, tr("%1: done, %2 moved").arg(label).arg(moved));
  const QString text =
      tr("%1: %2 of %3 volumes aligned; the others were not moved. %4").arg(label).arg(moved).arg(moved + left).arg(why);
  if (unsure > 0 && farther)
    Tell(Message::Warning, tr("%1. Only places within %2 mm and %3\u00b0 were looked at").arg(text).arg(20).arg(12),
         {{tr("Search farther"), farther}});
  else
    Tell(Message::Warning, text);
}

} // namespace echorama
