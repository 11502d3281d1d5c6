// SPDX-License-Identifier: BSD-3-Clause
#include "TaskPanel.h"
#include "Controls.h"
#include "Core/Base/Checksum.h"
#include "Core/Base/Error.h"
#include "ImageView.h"
#include "NeedleTool.h"
#include "Scan.h"
#include "Solution.h"
#include "Widgets/Session/LiveScore.h"
#include <QCheckBox>
#include <QDateTime>
#include <QFile>
#include <QFileDialog>
#include <QFileInfo>
#include <QFormLayout>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QSettings>
#include <QStandardPaths>
#include <QTimer>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {

namespace {

constexpr double AtStartMm = 10.0;  ///< that near to it a tracked tool has been at the start
constexpr double MostApartMm = 0.5; ///< of the planes that the ends of a line were set in

TaskBody BodyOf(const Subject& subject)
{
  if (subject.IsEmpty())
    throw Error(Error::Kind::BadInput, "tasks are about a body, and nothing is open");
  TaskBody body;
  body.file = QFileInfo(subject.files.first()).fileName().toStdString();
  if (subject.volumes.empty()) {
    QFile scene(subject.files.first());
    if (!scene.open(QIODevice::ReadOnly))
      throw Error(Error::Kind::FileSystem, QString("%1: %2").arg(scene.fileName(), scene.errorString()).toStdString());
    const QByteArray text = scene.readAll();
    body.checksum = Checksum(text.constData(), static_cast<std::size_t>(text.size()));
  } else {
    vtkImageData* volume = subject.volumes.front();
    vtkDataArray* voxels = vtkUltrasoundVolume::GetIntensity(volume);
    body.checksum = Checksum(voxels->GetVoidPointer(0), static_cast<std::size_t>(voxels->GetNumberOfValues()) *
                                                            static_cast<std::size_t>(voxels->GetDataTypeSize()));
    body.geometry = vtkUltrasoundVolume::GeometryOf(volume);
  }
  return body;
}

/// \throws Error(BadInput) for a line from one picture to another, which measures nothing
const CalliperLine& OfOnePicture(const CalliperLine& line)
{
  if (line.Apart() > MostApartMm)
    throw Error(Error::Kind::BadInput, "the probe moved between the ends of the line: freeze the image, then measure");
  return line;
}

QString Counted(int count, const QString& one, const QString& many)
{
  return QString("%1 %2").arg(count).arg(count == 1 ? one : many);
}

QLineEdit* LineField(QWidget* parent, const char* name, const QString& help)
{
  auto* field = new QLineEdit(parent);
  field->setObjectName(name);
  field->setToolTip(help);
  return field;
}

} // namespace

TaskPanel::TaskPanel(Scan* scan, NeedleTool* needle, ImageView* image, QWidget* parent)
  : QWidget(parent), scan_(scan), needle_(needle), image_(image),
    folder_(QStandardPaths::writableLocation(QStandardPaths::PicturesLocation) + "/Echorama")
{
  setObjectName("taskPanel");
  clock_.start();
  auto* open = Button(this, "openTask", tr("&Open a task..."), tr("Opens a task that was saved for this body"), [this] {
    const QString path = QFileDialog::getOpenFileName(this, tr("A task"), folder_.path(), "*.task.json");
    if (!path.isEmpty())
      OpenTask(path);
  });
  task_ = TextField(this, "task");
  trainee_ = LineField(this, "trainee", tr("Goes into the table of attempts"));
  trainee_->setText(QSettings().value("task/trainee").toString());
  start_ = Button(this, "startTask", {},
                  tr("Puts the probe at the top, forgets what was seen, and starts the clock; a tool that a tracker follows "
                     "has to be brought there first. Or ends without an answer"),
                  [this] { StartOrCancel(); });
  submit_ = Button(this, "submitTask", tr("S&ubmit"),
                   tr("The image as it is, the needle, or the last line of the callipers, is the answer"), [this] { Submit(); });
  solution_ =
      Button(this, "showSolution", tr("Show the so&lution"), tr("After the answer: what was asked for, beside what was found"),
             [this] { ShowSolution(solution_->isChecked()); });
  solution_->setCheckable(true);
  state_ = TextField(this, "taskState");
  score_ = TextField(this, "taskScore");
  name_ = LineField(this, "taskName", tr("What the task is called, and its file"));
  hint_ = CheckField(this, "taskHint", tr("Tell how far it is"), tr("Whether the distance is shown during the attempt"));
  showTip_ = CheckField(this, "taskShowTip", tr("Mark the needle's tip"),
                        tr("Whether the tip is marked during an attempt to reach a place with the needle"));
  auto* plane = Button(this, "savePlane", tr("Save: find this &plane"), tr("Makes a task of the image that is shown"),
                       [this] { SavePlane(); });
  auto* length = Button(this, "saveLength", tr("Save: &measure this"), tr("Makes a task of the last line of the callipers"),
                        [this] { SaveLength(); });
  auto* target =
      Button(this, "saveTarget", tr("Save: &reach this"),
             tr("Makes a task of the end of the last line of the callipers, or of the needle's tip"), [this] { SaveTarget(); });
  auto* form = new QFormLayout(this);
  form->addRow(new QLabel("<b>" + tr("Learn") + "</b>", this));
  form->addRow(open);
  form->addRow(tr("Task"), task_);
  form->addRow(tr("Your name"), trainee_);
  form->addRow(start_);
  form->addRow(submit_);
  form->addRow(tr("State"), state_);
  form->addRow(tr("Score"), score_);
  form->addRow(solution_);
  form->addRow(new QLabel("<b>" + tr("Teach") + "</b>", this));
  form->addRow(tr("Name"), name_);
  form->addRow(hint_);
  form->addRow(showTip_);
  form->addRow(plane);
  form->addRow(length);
  form->addRow(target);
  connect(this, &TaskPanel::RunningChanged, target, &QWidget::setDisabled);
  connect(this, &TaskPanel::RunningChanged, this, [this](bool running) {
    if (!running) {
      track_.reset();
      needle_->EndAttempt();
    }
  });
  connect(scan, &Scan::FrameMade, this, &TaskPanel::Watch);
  connect(needle, &NeedleTool::Changed, this, &TaskPanel::Watch); // also what is too quick for an image
  connect(this, &TaskPanel::RunningChanged, plane, &QWidget::setDisabled);
  connect(this, &TaskPanel::RunningChanged, length, &QWidget::setDisabled);
  connect(this, &TaskPanel::RunningChanged, open, &QWidget::setDisabled);
  connect(scan, &Scan::SubjectChanged, this, &TaskPanel::Forget);
  connect(scan, &Scan::ProbeMoved, this, &TaskPanel::BeginWhenAtStart);
  connect(needle, &NeedleTool::Changed, this, &TaskPanel::BeginWhenAtStart);
  timer_ = new QTimer(this);
  connect(timer_, &QTimer::timeout, this, &TaskPanel::ShowState);
  connect(timer_, &QTimer::timeout, this, &TaskPanel::Watch);
  timer_->setInterval(200);
  ShowState();
}

void TaskPanel::Try(const std::function<void()>& action)
{
  try {
    action();
  } catch (const Error& error) {
    emit scan_->Said({Message::Warning, QString::fromUtf8(error.what()), {}});
  }
  ShowState();
}

void TaskPanel::Save(std::variant<FindPlane, MeasureLength, ReachTarget> goal)
{
  Try([&] {
    ScanTask task;
    task.name = name_->text().trimmed().toStdString();
    if (task.name.empty())
      throw Error(Error::Kind::InvalidParameter, "a task needs a name");
    const QString instructions[] = {tr("Find the plane \"%1\"."), tr("Measure \"%1\"."), tr("Reach \"%1\" with the needle.")};
    task.instruction = instructions[goal.index()].arg(name_->text().trimmed()).toStdString();
    task.hint = hint_->isChecked();
    task.body = BodyOf(scan_->Body());
    task.goal = std::move(goal);
    const QString file = name_->text().trimmed().replace("/", "-");
    const QString path = folder_.filePath(file + ".task.json");
    if (QFileInfo::exists(path))
      throw Error(Error::Kind::FileSystem, tr("%1 is there already: take another name").arg(path).toStdString());
    if (!folder_.mkpath("."))
      throw Error(Error::Kind::FileSystem, folder_.path().toStdString() + ": the folder cannot be made");
    WriteScanTask(path.toStdString(), task);
    emit scan_->Said({Message::Note, tr("Saved as %1").arg(path), {}});
  });
}

void TaskPanel::SavePlane()
{
  if (scan_->Picture().image.isNull()) {
    emit scan_->Said({Message::Note, tr("There is no image to make a task of"), {}});
    return;
  }
  FindPlane plane;
  plane.probeToWorld = scan_->Frame().probeToWorld;
  plane.depthMm = 0.5 * scan_->Scanner().Probe().depthMax;
  Save(plane);
}

void TaskPanel::SaveLength()
{
  const std::vector<CalliperLine> lines = image_->Callipers();
  if (lines.empty()) {
    emit scan_->Said({Message::Note, tr("Measure first what is to be measured: key C"), {}});
    return;
  }
  Try([&] {
    const CalliperLine& line = OfOnePicture(lines.back());
    MeasureLength length;
    length.lengthMm = line.line.length();
    length.from = line.From(); // where the line was drawn, wherever the probe is now
    length.to = line.To();
    length.toleranceMm = std::max(1.0, 0.1 * length.lengthMm);
    Save(length);
  });
}

void TaskPanel::SaveTarget()
{
  ReachTarget target;
  const std::vector<CalliperLine> lines = image_->Callipers();
  if (!lines.empty()) {
    target.target = lines.back().To(); // where it was drawn
  } else if (needle_->IsShown() && needle_->InsideMm() > 0.0) {
    target.target = needle_->Now().tip;
  } else {
    emit scan_->Said({Message::Note, tr("Bring the needle's tip there first, or end a line of the callipers there: key C"), {}});
    return;
  }
  target.showTip = showTip_->isChecked();
  Save(target);
}

void TaskPanel::Watch()
{
  if (!IsRunning() || !track_)
    return;
  track_->Add({Seconds(), needle_->Now(), needle_->InsideMm() > 0.0, scan_->Scanner().TipInPlane(), needle_->HasMetBone()});
}

void TaskPanel::OpenTask(const QString& path)
{
  ShowSolution(false);
  Try([&] {
    attempt_.reset();
    attempt_ = ScanAttempt::Open(path.toStdString(), BodyOf(scan_->Body()));
    score_->clear();
  });
}

void TaskPanel::Forget()
{
  const bool wasRunning = IsRunning() || IsWaiting();
  isWaiting_ = false;
  attempt_.reset();
  ShowSolution(false);
  if (wasRunning)
    emit RunningChanged(false);
  ShowState();
}

void TaskPanel::StartOrCancel()
{
  if (IsRunning() || IsWaiting()) {
    GiveUp();
    return;
  }
  ShowSolution(false);
  image_->ClearCallipers();
  score_->clear();
  scan_->Restart();
  if (IsForNeedle())
    needle_->BeginAttempt(attempt_->ShowsTip());
  isWaiting_ = true;
  emit RunningChanged(true);
  BeginWhenAtStart();
  if (isWaiting_)
    emit MarksChanged(RingAt(scan_->StartPose(), AtStartMm));
  ShowState();
}

// Keys and mouse have the probe at the start. A tracked tool may be held anywhere, also at the solution: it has to be brought
// there first, and a tracked needle out of the body. How far it is from the start tells nothing of where the solution is.
void TaskPanel::BeginWhenAtStart()
{
  if (!isWaiting_ || (scan_->ProbeToWorld().translation() - scan_->StartPose().translation()).norm() > AtStartMm ||
      (IsForNeedle() && needle_->InsideMm() > 0.0))
    return;
  isWaiting_ = false;
  emit MarksChanged(nullptr);
  Try([&] {
    started_ = Seconds();
    attempt_->Start(started_, IsForNeedle() ? needle_->Now().ToWorld() : scan_->ProbeToWorld());
    if (IsForNeedle())
      track_.emplace(Eigen::Vector3d::Zero()); // which knows nothing of the target
  });
  if (!IsRunning())
    emit RunningChanged(false);
}

void TaskPanel::GiveUp()
{
  isWaiting_ = false;
  if (attempt_)
    attempt_->Cancel();
  emit MarksChanged(nullptr);
  emit RunningChanged(false);
  ShowState();
}

void TaskPanel::ShowSolution(bool shown)
{
  solution_->setChecked(shown);
  if (!shown) {
    emit MarksChanged(nullptr);
    emit SolutionChanged(nullptr);
    return;
  }
  Try([&] {
    const ScanTask* task = attempt_ ? attempt_->Solution() : nullptr;
    if (!task)
      throw Error(Error::Kind::InvalidParameter, "the solution is shown after the answer");
    const ShownSolution solution = SolutionOf(*task, *scan_);
    emit MarksChanged(solution.marks);
    emit SolutionChanged(solution.picture.image.isNull() ? nullptr : &solution.picture);
    emit scan_->Said({Message::Note, solution.text, {}});
  });
}

void TaskPanel::Submit()
{
  Try([&] {
    const bool isLength = attempt_->What() == ScanAttempt::Kind::MeasureLength;
    const std::vector<CalliperLine> lines = image_->Callipers();
    if (isLength && lines.empty())
      throw Error(Error::Kind::BadInput, "measure first: key C, then a click on both ends");
    if (scan_->Picture().image.isNull())
      throw Error(Error::Kind::BadInput, "there is no image to answer with");
    if (IsForNeedle() && !needle_->IsShown())
      throw Error(Error::Kind::BadInput, "there is no needle: key N");
    Watch();
    const ScanScore score = isLength        ? attempt_->SubmitLength(Seconds(), OfOnePicture(lines.back()).line.length())
                            : IsForNeedle() ? attempt_->SubmitPose(Seconds(), needle_->Now().ToWorld())
                                            : attempt_->SubmitPose(Seconds(), scan_->Frame().probeToWorld);
    score_->setText(TellSubmitted(score));
    Attempt line = attempt_->HistoryLine(QDateTime::currentDateTimeUtc().toString(Qt::ISODate).toStdString(),
                                         trainee_->text().toStdString());
    if (track_) {
      line.edits = track_->Score().redirections;
      line.outOfPlaneSeconds = track_->Score().offPlaneSeconds;
    }
    emit RunningChanged(false);
    scan_->SetFrozen(true); // the image is the answer, and stays for comparison
    QSettings().setValue("task/trainee", trainee_->text());
    if (!folder_.mkpath("."))
      throw Error(Error::Kind::FileSystem, folder_.path().toStdString() + ": the folder cannot be made");
    AppendAttempt(folder_.filePath("attempts.csv").toStdString(), line);
  });
}

QString TaskPanel::TellSubmitted(const ScanScore& score) const
{
  QString more;
  if (attempt_->What() == ScanAttempt::Kind::FindPlane)
    more = tr(" and %1\u00b0").arg(score.degrees, 0, 'f', 1);
  else if (track_)
    more = tr(", %1, %2, %3%4 s of %5 s with the tip out of the plane")
               .arg(Counted(track_->Score().redirections, tr("redirection"), tr("redirections")))
               .arg(Counted(track_->Score().passes, tr("time in"), tr("times in")))
               .arg(track_->Score().stops > 0 ? Counted(track_->Score().stops, tr("time at bone"), tr("times at bone")) + ", "
                                              : QString())
               .arg(track_->Score().offPlaneSeconds, 0, 'f', 1)
               .arg(track_->Score().insideSeconds, 0, 'f', 1);
  return tr("%1: %2 mm off%3, after %4 s")
      .arg(score.passed ? tr("Passed") : tr("Not passed"))
      .arg(score.distanceMm, 0, 'f', 1)
      .arg(more)
      .arg(score.seconds, 0, 'f', 0);
}

void TaskPanel::ShowState()
{
  const bool running = IsRunning(), busy = running || IsWaiting();
  start_->setEnabled(attempt_.has_value());
  start_->setText(busy ? tr("Give up") : tr("&Start"));
  submit_->setEnabled(running);
  solution_->setEnabled(attempt_ && attempt_->Solution());
  task_->setText(attempt_ ? QString::fromStdString(attempt_->Instruction()) : tr("none"));
  busy ? timer_->start() : timer_->stop();
  if (!busy) {
    state_->clear();
    return;
  }
  if (!running) {
    const double away = (scan_->ProbeToWorld().translation() - scan_->StartPose().translation()).norm();
    state_->setText(tr("bring the tool to the start, the ring on the body: %1 mm away").arg(away, 0, 'f', 0) +
                    (IsForNeedle() ? tr("; and the needle out of the body") : QString()));
    return;
  }
  QString text = tr("%1 s").arg(Seconds() - started_, 0, 'f', 0);
  const auto hint = attempt_->Hint(Seconds(), IsForNeedle() ? needle_->Now().ToWorld() : scan_->ProbeToWorld());
  if (hint && IsForNeedle())
    text += tr(", the tip is %1 mm from it").arg(hint->distanceMm, 0, 'f', 1);
  else if (hint)
    text += tr(", %1 mm and %2\u00b0 from it").arg(hint->distanceMm, 0, 'f', 1).arg(hint->degrees, 0, 'f', 0);
  state_->setText(text);
}

} // namespace echorama
