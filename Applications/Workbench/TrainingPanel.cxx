// SPDX-License-Identifier: BSD-3-Clause
#include "TrainingPanel.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Core/Geometry/RigidTransform.h"
#include "Widgets/Session/LiveScore.h"
#include <cmath>
#include <QCheckBox>
#include <QDateTime>
#include <QDir>
#include <QDoubleSpinBox>
#include <QFileDialog>
#include <QFileInfo>
#include <QFormLayout>
#include <QGroupBox>
#include <QHeaderView>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QSettings>
#include <QStandardPaths>
#include <QTableWidget>
#include <QTimer>
#include <QVBoxLayout>
#include <vtkCallbackCommand.h>
#include <vtkImageData.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>

namespace echorama {

namespace {

QString DefaultHistory()
{
  const QString folder = QStandardPaths::writableLocation(QStandardPaths::GenericDataLocation) + "/echorama";
  return QSettings().value("training/history", folder + "/attempts.csv").toString();
}

QString TimeText(double seconds)
{
  const int whole = static_cast<int>(seconds);
  return QStringLiteral("%1:%2").arg(whole / 60).arg(whole % 60, 2, 10, QLatin1Char('0'));
}

Pose PoseOf(vtkMatrix4x4* matrix)
{
  Pose pose;
  pose.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(matrix->GetData());
  return pose;
}

Eigen::Vector3d MiddleOf(vtkImageData* image)
{
  double index[3];
  Eigen::Vector3d middle;
  const int* extent = image->GetExtent();
  for (int axis = 0; axis < 3; ++axis)
    index[axis] = 0.5 * (extent[2 * axis] + extent[2 * axis + 1]);
  image->TransformContinuousIndexToPhysicalPoint(index, middle.data());
  return middle;
}

} // namespace

TrainingPanel::TrainingPanel(Workspace& workspace, QWidget* parent) : QWidget(parent), workspace_(workspace)
{
  setObjectName("trainingPanel");
  auto* layout = new QVBoxLayout(this);

  auto* evaluation = new QGroupBox(tr("Evaluation"), this);
  auto* form = new QFormLayout(evaluation);
  truth_ = new QLabel(tr("none"), evaluation);
  auto* choose = new QPushButton(tr("Load truth…"), evaluation);
  choose->setObjectName("loadTruth");
  choose->setToolTip(tr("A pose file that says where the volumes belong, such as truth.json of a synthetic set"));
  score_ = new QLabel(evaluation);
  score_->setObjectName("score");
  score_->setToolTip(
      tr("Mean distance of points of the volumes from where they belong, seen from the first volume that has a truth"));
  live_ = new QCheckBox(tr("Show the score"), evaluation);
  live_->setObjectName("showScore");
  live_->setChecked(true);
  vectors_ = new QCheckBox(tr("Show the errors as arrows"), evaluation);
  vectors_->setObjectName("showErrors");
  vectors_->setToolTip(tr("In the 3D view: arrows from where points are to where they belong"));
  form->addRow(tr("Truth"), truth_);
  form->addRow(choose);
  form->addRow(tr("Score"), score_);
  form->addRow(live_);
  form->addRow(vectors_);
  layout->addWidget(evaluation);

  auto* training = new QGroupBox(tr("Training"), this);
  form = new QFormLayout(training);
  trainee_ = new QLineEdit(QSettings().value("training/trainee").toString(), training);
  trainee_->setObjectName("trainee");
  trainee_->setPlaceholderText(tr("name, may be empty"));
  scatterMm_ = new QDoubleSpinBox(training);
  scatterMm_->setObjectName("scatterMm");
  scatterMm_->setRange(0.0, 500.0);
  scatterMm_->setValue(15.0);
  scatterMm_->setSuffix(tr(" mm"));
  scatterDegrees_ = new QDoubleSpinBox(training);
  scatterDegrees_->setObjectName("scatterDegrees");
  scatterDegrees_->setRange(0.0, 180.0);
  scatterDegrees_->setValue(15.0);
  scatterDegrees_->setSuffix(tr("°"));
  seed_ = new QSpinBox(training);
  seed_->setObjectName("scatterSeed");
  seed_->setRange(1, 1000000);
  seed_->setToolTip(tr("The same number scatters the same volumes in the same way"));
  auto* scatter = new QPushButton(tr("Scatter volumes"), training);
  scatter->setObjectName("scatter");
  scatter->setToolTip(
      tr("Moves every volume but the fixed one, in a random direction, by so much from where it belongs (or, without "
         "truth, from where it is). Can be undone."));
  start_ = new QPushButton(training);
  start_->setObjectName("trainingStart");
  submit_ = new QPushButton(tr("Submit"), training);
  submit_->setObjectName("trainingSubmit");
  time_ = new QLabel(training);
  time_->setObjectName("trainingTime");
  history_ = new QLineEdit(training);
  history_->setObjectName("trainingHistory");
  history_->setReadOnly(true);
  history_->setToolTip(tr("The file of all attempts, CSV"));
  auto* chooseHistory = new QPushButton(tr("Keep attempts in…"), training);
  chooseHistory->setObjectName("chooseHistory");
  form->addRow(tr("Trainee"), trainee_);
  form->addRow(tr("Scatter by"), scatterMm_);
  form->addRow(tr("and"), scatterDegrees_);
  form->addRow(tr("Seed"), seed_);
  form->addRow(scatter);
  form->addRow(start_, submit_);
  form->addRow(tr("Time"), time_);
  form->addRow(tr("Attempts"), history_);
  form->addRow(chooseHistory);
  layout->addWidget(training);

  table_ = new QTableWidget(0, 5, this);
  table_->setObjectName("attempts");
  table_->setHorizontalHeaderLabels({tr("When"), tr("Trainee"), tr("Score, mm"), tr("From, mm"), tr("Time")});
  table_->setEditTriggers(QAbstractItemView::NoEditTriggers);
  table_->verticalHeader()->hide();
  table_->setToolTip(tr("All attempts, the last one first"));
  layout->addWidget(table_, 1);

  clock_ = new QTimer(this);
  clock_->setInterval(500);
  connect(clock_, &QTimer::timeout, this, [this] { time_->setText(TimeText(taken_.elapsed() * 1e-3)); });
  connect(choose, &QPushButton::clicked, this, &TrainingPanel::ChooseTruth);
  connect(chooseHistory, &QPushButton::clicked, this, &TrainingPanel::ChooseHistory);
  connect(live_, &QCheckBox::toggled, this, &TrainingPanel::ShowScore);
  connect(vectors_, &QCheckBox::toggled, this, &TrainingPanel::ShowState);
  connect(scatter, &QPushButton::clicked, this, &TrainingPanel::Scatter);
  connect(start_, &QPushButton::clicked, this, &TrainingPanel::StartOrGiveUp);
  connect(submit_, &QPushButton::clicked, this, &TrainingPanel::Submit);

  observer_ = vtkSmartPointer<vtkCallbackCommand>::New();
  observer_->SetClientData(this);
  observer_->SetCallback([](vtkObject*, unsigned long event, void* self, void*) {
    auto* panel = static_cast<TrainingPanel*>(self);
    if (event == vtkUltrasoundAlignmentSession::PosesChangedEvent)
      panel->ShowScore();
    else
      panel->ShowState(); // a project brings its own truth
  });
  for (const unsigned long event :
       {vtkUltrasoundAlignmentSession::PosesChangedEvent, vtkUltrasoundAlignmentSession::VolumesChangedEvent})
    workspace_.session->AddObserver(event, observer_);

  historyPath_ = DefaultHistory();
  ShowHistory();
  ShowState();
}

TrainingPanel::~TrainingPanel()
{
  workspace_.session->RemoveObserver(observer_);
}

void TrainingPanel::ChooseTruth()
{
  const QString path = QFileDialog::getOpenFileName(this, tr("Load truth"), {}, tr("Poses (*.json)"));
  if (!path.isEmpty())
    LoadTruth(path);
}

bool TrainingPanel::LoadTruth(const QString& path)
{
  // The session reports what is wrong, and that goes to the message bar.
  if (!workspace_.session->ReadTruth(path.toUtf8()))
    return false;
  truth_->setText(QFileInfo(path).fileName());
  truth_->setToolTip(path);
  ShowState();
  return true;
}

void TrainingPanel::ChooseHistory()
{
  const QString path = QFileDialog::getSaveFileName(this, tr("Keep attempts in"), historyPath_, tr("Tables (*.csv)"), nullptr,
                                                    QFileDialog::DontConfirmOverwrite); // lines are added, nothing is replaced
  if (!path.isEmpty())
    SetHistory(path);
}

bool TrainingPanel::SetHistory(const QString& path)
{
  const QString before = historyPath_;
  historyPath_ = path;
  try {
    if (QFileInfo::exists(path))
      ReadAttempts(path.toStdString());
  } catch (const Error& error) {
    historyPath_ = before;
    workspace_.say(QString::fromUtf8(error.what()), true);
    return false;
  }
  QSettings().setValue("training/history", path);
  ShowHistory();
  return true;
}

void TrainingPanel::ShowHistory()
{
  history_->setText(historyPath_);
  table_->setRowCount(0);
  if (!QFileInfo::exists(historyPath_))
    return;
  try {
    for (const Attempt& attempt : ReadAttempts(historyPath_.toStdString())) {
      table_->insertRow(0);
      const QStringList texts{QString::fromStdString(attempt.time), QString::fromStdString(attempt.trainee),
                              QString::number(attempt.scoreMm, 'f', 2), QString::number(attempt.startMm, 'f', 2),
                              TimeText(attempt.seconds)};
      for (int column = 0; column < texts.size(); ++column)
        table_->setItem(0, column, new QTableWidgetItem(texts[column]));
    }
  } catch (const Error& error) {
    workspace_.say(QString::fromUtf8(error.what()), true);
  }
}

void TrainingPanel::Scatter()
{
  vtkUltrasoundAlignmentSession* session = workspace_.session;
  if (session->GetNumberOfVolumes() < 2) {
    workspace_.say(tr("Scatter: two volumes are needed"), true);
    return;
  }
  session->BeginEdit("Scatter volumes");
  for (int i = 0; i < session->GetNumberOfVolumes(); ++i) {
    const int id = session->GetVolumeId(i);
    if (id == (session->GetFixedVolume() > 0 ? session->GetFixedVolume() : session->GetVolumeId(0)))
      continue;
    Random random(static_cast<std::uint64_t>(seed_->value()), static_cast<std::uint64_t>(i));
    vtkNew<vtkMatrix4x4> pose;
    session->GetVolumeToWorld(id, pose);
    const Pose now = PoseOf(pose);
    session->GetTruth(id, pose); // else from where it is
    const Pose before = PoseOf(pose);
    const Eigen::Vector3d middle = before * now.inverse(Eigen::Isometry) * MiddleOf(session->GetImage(id));
    const Eigen::Vector3d turn = random.Direction() * (scatterDegrees_->value() / DegreesPerRadian);
    const Eigen::Vector3d shift = random.Direction() * scatterMm_->value();
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> after = (MotionAbout(middle, turn, shift) * before).matrix();
    pose->DeepCopy(after.data());
    session->SetVolumeToWorld(id, pose);
  }
  session->EndEdit();
}

void TrainingPanel::StartOrGiveUp()
{
  if (!isTraining_) {
    workspace_.session->ForgetHistory(); // undo would lead to the solution
    startScore_ = workspace_.session->GetScore();
    taken_.start();
    clock_->start();
  } else {
    clock_->stop();
  }
  isTraining_ = !isTraining_;
  time_->setText(isTraining_ ? TimeText(0.0) : QString());
  ShowState();
}

void TrainingPanel::Submit()
{
  vtkUltrasoundAlignmentSession* session = workspace_.session;
  clock_->stop();
  Attempt attempt;
  attempt.seconds = taken_.elapsed() * 1e-3;
  attempt.time = QDateTime::currentDateTimeUtc().toString(Qt::ISODate).toStdString();
  attempt.trainee = trainee_->text().toStdString();
  attempt.project = QFileInfo(QString::fromStdString(session->GetProjectPath())).fileName().toStdString();
  attempt.startMm = startScore_;
  attempt.scoreMm = session->GetScore();
  attempt.edits = session->GetUndoCount();
  int count = 0;
  for (int i = 0; i < session->GetNumberOfVolumes(); ++i) {
    const int id = session->GetVolumeId(i);
    const double score = session->GetVolumeScore(id), degrees = session->GetRotationError(id);
    if (id == session->GetFixedVolume() || !std::isfinite(score))
      continue;
    attempt.worstMm = std::max(attempt.worstMm, score);
    attempt.degrees += degrees;
    ++count;
  }
  attempt.degrees /= std::max(1, count);
  isTraining_ = false;
  live_->setChecked(true);
  vectors_->setChecked(true);
  time_->setText(TimeText(attempt.seconds));
  ShowState();
  QSettings().setValue("training/trainee", trainee_->text());
  try {
    QDir().mkpath(QFileInfo(historyPath_).path());
    AppendAttempt(historyPath_.toStdString(), attempt);
    workspace_.say(tr("Submitted: %1 mm after %2, from %3 mm at the start")
                       .arg(attempt.scoreMm, 0, 'f', 2)
                       .arg(TimeText(attempt.seconds))
                       .arg(attempt.startMm, 0, 'f', 2),
                   false);
  } catch (const Error& error) {
    workspace_.say(tr("The attempt (%1 mm) was not kept: %2").arg(attempt.scoreMm, 0, 'f', 2).arg(error.what()), true);
  }
  ShowHistory();
}

void TrainingPanel::ShowScore()
{
  vtkUltrasoundAlignmentSession* session = workspace_.session;
  const double score = session->HasTruth() ? session->GetScore() : std::nan("");
  const bool shown = !isTraining_ && live_->isChecked() && std::isfinite(score);
  const QString text = shown ? tr("%1 mm").arg(score, 0, 'f', 2) : QString();
  score_->setText(isTraining_ ? tr("hidden until you submit") : !session->HasTruth() ? tr("needs a truth") : text);
  emit ScoreShown(text);
}

void TrainingPanel::ShowState()
{
  const bool hasTruth = workspace_.session->HasTruth();
  if (isTraining_ && !hasTruth) { // another project was opened
    isTraining_ = false;
    clock_->stop();
  }
  if (!hasTruth)
    truth_->setText(tr("none"));
  else if (truth_->text() == tr("none"))
    truth_->setText(tr("the project's"));
  live_->setEnabled(hasTruth && !isTraining_);
  vectors_->setEnabled(hasTruth && !isTraining_);
  start_->setText(isTraining_ ? tr("Give up") : tr("Start"));
  start_->setToolTip(isTraining_
                         ? tr("Ends the attempt; nothing is kept")
                         : tr("Hides score and errors, and starts the clock; what was done before can no longer be undone"));
  start_->setEnabled(hasTruth);
  submit_->setEnabled(isTraining_);
  submit_->setToolTip(tr("Shows score and errors, and adds the attempt to the history"));
  workspace_.showErrorVectors(hasTruth && !isTraining_ && vectors_->isChecked());
  ShowScore();
}

} // namespace echorama
