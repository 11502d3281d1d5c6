// SPDX-License-Identifier: BSD-3-Clause
#include "TrainingPanel.h"
#include "Controls.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Core/Geometry/RigidTransform.h"
#include "JobBar.h"
#include "Widgets/Session/LiveScore.h"
#include "Workbench.h"
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

} // namespace

TrainingPanel::TrainingPanel(Workbench* bench, const JobBar* jobs, QWidget* parent) : QWidget(parent), bench_(bench), jobs_(jobs)
{
  setObjectName("trainingPanel");
  auto* layout = new QVBoxLayout(this);

  auto* evaluation = new QGroupBox(tr("Evaluation"), this);
  auto* form = new QFormLayout(evaluation);
  truth_ = new QLabel(tr("none"), evaluation);
  auto* choose = Button(evaluation, "loadTruth", tr("Load truth…"),
                        tr("A pose file that says where the volumes belong, such as truth.json of a synthetic set"),
                        [this] { ChooseTruth(); });
  score_ = new QLabel(evaluation);
  score_->setObjectName("score");
  score_->setToolTip(
      tr("Mean distance of points of the volumes from where they belong, seen from the first volume that has a truth"));
  live_ = CheckField(evaluation, "showScore", tr("Show the score"), {}, [this](bool) { ShowScore(); });
  vectors_ = CheckField(evaluation, "showErrors", tr("Show error arrows"),
                        tr("In the 3D view: arrows from where points are to where they belong"), [this](bool) { ShowState(); });
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
  scatterMm_ = NumberField(training, {"scatterMm", tr("How far volumes are moved"), 0.0, 500.0, 2, 1.0, tr(" mm")});
  scatterMm_->setValue(15.0);
  scatterDegrees_ = NumberField(training, {"scatterDegrees", tr("How far volumes are turned"), 0.0, 180.0, 2, 1.0, tr("°")});
  scatterDegrees_->setValue(15.0);
  seed_ = NumberField(
      training, {"scatterSeed", tr("The same number scatters the same volumes in the same way"), 1.0, 1000000.0, 0, 1.0, {}}, {});
  seed_->setMinimumWidth(seed_->minimumSizeHint().width()); // the largest is seen whole
  scatter_ = Button(training, "scatter", tr("Scatter volumes"),
                    tr("Moves every volume but the fixed one, in a random direction, by so much from where it belongs (or, "
                       "without truth, from where it is). Can be undone."),
                    [this] { Scatter(); });
  help_ = CheckField(training, "trainingHelp", tr("Aligner allowed"),
                     tr("During an attempt, volumes may be aligned or placed by the program; how often is kept with the attempt"),
                     {});
  start_ = Button(training, "trainingStart", {}, {}, [this] { StartOrGiveUp(); });
  submit_ = Button(training, "trainingSubmit", tr("Submit"), tr("Shows score and errors, and adds the attempt to the history"),
                   [this] { Submit(); });
  time_ = new QLabel(training);
  time_->setObjectName("trainingTime");
  history_ = new QLineEdit(training);
  history_->setObjectName("trainingHistory");
  history_->setReadOnly(true);
  history_->setToolTip(tr("The file of all attempts, CSV"));
  auto* chooseHistory = Button(training, "chooseHistory", tr("Keep attempts in…"),
                               tr("Adds attempts to another table from now on"), [this] { ChooseHistory(); });
  form->addRow(tr("Trainee"), trainee_);
  form->addRow(tr("Scatter by"), scatterMm_);
  form->addRow(tr("and"), scatterDegrees_);
  form->addRow(tr("Seed"), seed_);
  form->addRow(scatter_);
  form->addRow(help_);
  form->addRow(start_, submit_);
  form->addRow(tr("Time"), time_);
  form->addRow(tr("Attempts"), history_);
  form->addRow(chooseHistory);
  layout->addWidget(training);

  table_ = TableField(this, "attempts", tr("All attempts, the last one first"),
                      {tr("Score,\nmm"), tr("From,\nmm"), tr("Time"), tr("Help"), tr("Trainee"), tr("When")});
  table_->horizontalHeader()->setSectionResizeMode(QHeaderView::ResizeToContents);
  layout->addWidget(table_, 1);

  clock_ = new QTimer(this);
  clock_->setInterval(500);
  connect(clock_, &QTimer::timeout, this, [this] { time_->setText(TimeText(taken_.elapsed() * 1e-3)); });

  connect(bench, &Workbench::PosesChanged, this, &TrainingPanel::ShowScore);
  connect(bench, &Workbench::VolumesChanged, this, &TrainingPanel::ShowState); // a project brings its own truth

  historyPath_ = DefaultHistory();
  ShowHistory();
  live_->setChecked(true);
  ShowState();
}

void TrainingPanel::ChooseTruth()
{
  const QString path = QFileDialog::getOpenFileName(this, tr("Load truth"), {}, tr("Poses (*.json)"));
  if (!path.isEmpty())
    LoadTruth(path);
}

bool TrainingPanel::LoadTruth(const QString& path)
{
  if (!bench_->Try("truth", [&] { return bench_->Session()->ReadTruth(path.toUtf8()); },
                   {{tr("Load another truth..."), [this] { ChooseTruth(); }}}))
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
    WarnOfHistory(error.what());
    return false;
  }
  QSettings().setValue("training/history", path);
  ShowHistory();
  return true;
}

// For columns that are farther right than the panel is wide.
QString TrainingPanel::Told(const QStringList& row) const
{
  QStringList lines;
  for (int column = 0; column < row.size(); ++column)
    lines.append(QString("%1: %2").arg(table_->horizontalHeaderItem(column)->text().replace('\n', ' '), row[column]));
  return lines.join('\n');
}

void TrainingPanel::ShowHistory()
{
  history_->setText(historyPath_);
  table_->setRowCount(0);
  if (!QFileInfo::exists(historyPath_))
    return;
  try {
    for (const Attempt& attempt : ReadAttempts(historyPath_.toStdString())) {
      const QStringList row{QString::number(attempt.scoreMm, 'f', 2),
                            QString::number(attempt.startMm, 'f', 2),
                            TimeText(attempt.seconds),
                            QString::number(attempt.help),
                            QString::fromStdString(attempt.trainee),
                            QString::fromStdString(attempt.time)};
      InsertRow(table_, 0, row, Told(row));
    }
  } catch (const Error& error) {
    WarnOfHistory(error.what());
  }
}

void TrainingPanel::WarnOfHistory(const QString& why)
{
  bench_->Warn(why, {{tr("Keep attempts elsewhere..."), [this] { ChooseHistory(); }}}, "attempts");
}

void TrainingPanel::Scatter()
{
  auto* session = bench_->Session();
  if (session->GetNumberOfVolumes() < 2) {
    bench_->Warn(tr("Scatter: two volumes are needed; open another one"), {}, objectName());
    return;
  }
  session->BeginEdit("Scatter volumes");
  for (int i = 0; i < session->GetNumberOfVolumes(); ++i) {
    const int id = session->GetVolumeId(i);
    if (session->IsResult(id) || id == (session->GetFixedVolume() > 0 ? session->GetFixedVolume() : session->GetVolumeId(0)))
      continue;
    Random random(static_cast<std::uint64_t>(seed_->value()), static_cast<std::uint64_t>(i));
    const SessionVolume& volume = *session->GetKernel().State().Find(id);
    const Pose before = session->GetTruthOf(id).value_or(volume.volumeToWorld);
    const Eigen::Vector3d turn = random.Direction() * (scatterDegrees_->value() / DegreesPerRadian);
    const Eigen::Vector3d shift = random.Direction() * scatterMm_->value();
    session->SetVolumeToWorld(id, MotionAbout(before * volume.geometry.Centre(), turn, shift) * before);
  }
  session->EndEdit();
}

void TrainingPanel::StartOrGiveUp()
{
  if (!isTraining_ && jobs_->Count() > 0) { // what it finds would help, and is not counted
    bench_->Warn(tr("Start: %1 is still running; wait for it, or stop it").arg(jobs_->Labels().join(", ")), {}, objectName());
    return;
  }
  bench_->Forget(objectName());
  if (!isTraining_) {
    bench_->Session()->ForgetHistory(); // undo would lead to the solution
    startScore_ = bench_->Session()->GetScore();
    taken_.start();
    clock_->start();
    bench_->BeginAttempt(help_->isChecked());
  } else {
    clock_->stop();
    bench_->EndAttempt();
  }
  isTraining_ = !isTraining_;
  time_->setText(isTraining_ ? TimeText(0.0) : QString());
  ShowState();
}

void TrainingPanel::Submit()
{
  auto* session = bench_->Session();
  clock_->stop();
  Attempt attempt;
  attempt.seconds = taken_.elapsed() * 1e-3;
  attempt.time = QDateTime::currentDateTimeUtc().toString(Qt::ISODate).toStdString();
  attempt.trainee = trainee_->text().toStdString();
  attempt.project = QFileInfo(QString::fromStdString(session->GetProjectPath())).fileName().toStdString();
  attempt.startMm = startScore_;
  attempt.scoreMm = session->GetScore();
  attempt.edits = session->GetUndoCount();
  attempt.help = bench_->HelpTaken();
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
  bench_->EndAttempt();
  live_->setChecked(true);
  vectors_->setChecked(true);
  time_->setText(TimeText(attempt.seconds));
  ShowState();
  QSettings().setValue("training/trainee", trainee_->text());
  try {
    QDir().mkpath(QFileInfo(historyPath_).path());
    AppendAttempt(historyPath_.toStdString(), attempt);
    bench_->Note(tr("Submitted: %1 mm after %2, from %3 mm at the start")
                     .arg(attempt.scoreMm, 0, 'f', 2)
                     .arg(TimeText(attempt.seconds))
                     .arg(attempt.startMm, 0, 'f', 2));
  } catch (const Error& error) {
    WarnOfHistory(tr("The attempt (%1 mm) was not kept: %2").arg(attempt.scoreMm, 0, 'f', 2).arg(error.what()));
  }
  ShowHistory();
}

void TrainingPanel::ShowScore()
{
  auto* session = bench_->Session();
  const double score = session->HasTruth() ? session->GetScore() : std::nan("");
  const bool shown = !isTraining_ && live_->isChecked() && std::isfinite(score);
  const QString text = shown ? tr("%1 mm").arg(score, 0, 'f', 2) : QString();
  score_->setText(isTraining_ ? tr("hidden until you submit") : !session->HasTruth() ? tr("needs a truth") : text);
  emit ScoreShown(text);
}

void TrainingPanel::ShowState()
{
  const bool hasTruth = bench_->Session()->HasTruth();
  if (isTraining_ && !hasTruth) { // another project was opened
    isTraining_ = false;
    bench_->EndAttempt();
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
  scatter_->setEnabled(!isTraining_);
  help_->setEnabled(!isTraining_);
  submit_->setEnabled(isTraining_);
  bench_->Set(&VolumeLook::errorVectors, hasTruth && !isTraining_ && vectors_->isChecked());
  ShowScore();
}

} // namespace echorama
