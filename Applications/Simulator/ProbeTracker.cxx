// SPDX-License-Identifier: BSD-3-Clause
#include "ProbeTracker.h"
#include "Controls.h"
#include "Core/Geometry/TransformGraph.h"
#include "Job.h"
#include "NeedleTool.h"
#include "Scan.h"
#include "TrackerState.h"
#include <cmath>
#include <QComboBox>
#include <QFormLayout>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QSettings>
#include <QTimer>
#include <vtkMatrix4x4.h>

namespace echorama {

namespace {

constexpr int PollMs = 4;
constexpr double NearMm = 10.0;                          ///< of the skin whose normal is that of a place
constexpr double AlignDegrees = 3.0, SlideDegrees = 5.0; ///< by eye and hand
constexpr double StoppedSeconds = 0.5;                   ///< without a pose: what is shown is not what is

Eigen::Matrix4d MatrixOf(vtkMatrix4x4* matrix)
{
  return Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(matrix->GetData());
}

} // namespace

ProbeTracker::ProbeTracker(Scan* scan, NeedleTool* needle, QWidget* parent) : QWidget(parent), scan_(scan), needle_(needle)
{
  setObjectName("trackerPanel");
  tracker_->SetActive(false); // until Connect
  tracker_->SetFreshSeconds(StoppedSeconds);
  address_ = new QLineEdit(QSettings().value("tracker/address", "igtl://localhost:18944").toString(), this);
  address_->setObjectName("trackerAddress");
  address_->setToolTip(tr("The tracker in one line: igtl://HOST:PORT, polhemus:/dev/ttyUSB0, replay:FILE or simulated:"));
  orientation_ = new QLineEdit(QSettings().value("tracker/orientation").toString(), this);
  orientation_->setObjectName("trackerOrientation");
  orientation_->setPlaceholderText(tr("of the same tracker"));
  orientation_->setToolTip(
      tr("An IMU, in one line as above, when the tracker knows no more than a place. With no tracker above, it turns the "
         "probe where keys and mouse put it"));
  options_ = new QLineEdit(QSettings().value("tracker/options").toString(), this);
  options_->setObjectName("trackerOptions");
  options_->setPlaceholderText("imuDelay=0.015&surfaceDelay=0.04");
  options_->setToolTip(tr("Of both together: OPTION=VALUE&OPTION=VALUE, as of the tracker fused:LINE|LINE|OPTIONS"));
  connect_ = Button(this, "trackerConnect", {}, tr("Begins to follow the tracker, and ends it"), [this] { ConnectOrNot(); });
  tool_ = ChoiceField(this, "trackerTool",
                      tr("The tool that is the probe: its origin is the middle of the face, z looks into the body"),
                      std::vector<std::string>());
  connect(tool_, QOverload<int>::of(&QComboBox::activated), this, [this] { isToolChosen_ = true; });
  needleTool_ = ChoiceField(this, "trackerNeedle",
                            tr("The tool that is the needle, if there is one: its origin is the tip, z the way it goes in"),
                            std::vector<std::string>());
  here_ = Button(this, "trackerHere", tr("It is &here"),
                 tr("Says that the tool is now where the probe was before it was connected, and moves all that follows likewise"),
                 [this] { PlaceHere(); });
  align_ = Button(this, "trackerAlign", tr("&Align"),
                  tr("Says that the array points now as that of the probe on the skin, where keys and mouse had it: what an IMU "
                     "does not know"),
                  [this] { Align(); });
  slideButton_ = Button(
      this, "trackerSlide", {},
      tr("The same by a slide along the array, towards the probe's mark, by 10 mm or more and within 10 s: press, slide, press"),
      [this] { Slide(); });
  heading_ = TextField(this, "trackerHeading", tr("How well it is known where the array points, standard deviation"));
  state_ = TextField(this, "trackerState");
  auto* form = new QFormLayout(this);
  form->addRow(tr("Tracker"), address_);
  form->addRow(tr("Orientation"), orientation_);
  form->addRow(tr("Options"), options_);
  form->addRow(connect_);
  form->addRow(tr("Tool"), tool_);
  form->addRow(tr("Needle"), needleTool_);
  form->addRow(here_);
  form->addRow(align_, slideButton_);
  form->addRow(tr("Heading"), heading_);
  form->addRow(tr("State"), state_);
  timer_ = new QTimer(this);
  timer_->setTimerType(Qt::PreciseTimer);
  timer_->setInterval(PollMs);
  connect(timer_, &QTimer::timeout, this, &ProbeTracker::Step);
  connect(scan, &Scan::PoseWanted, this, [this] {
    if (timer_->isActive())
      Step();
  });
  connect(scan_, &Scan::SubjectChanged, this, &ProbeTracker::GiveNormals);
  Step();
}

ProbeTracker::~ProbeTracker()
{
  delete job_;
  tracker_->Stop();
}

// What the two lines say together.
QString ProbeTracker::Device() const
{
  const QString place = address_->text().trimmed(), orientation = orientation_->text().trimmed();
  QString options = options_->text().trimmed();
  if (orientation.isEmpty())
    return place;
  if (!("&" + options).contains("&up=")) {
    // A patient lies on the back, unless it was said where the top is.
    const Eigen::Vector3d& said = scan_->Body().up;
    const Eigen::Vector3d up = said.isZero() ? Eigen::Vector3d(-Eigen::Vector3d::UnitY()) : said;
    options += QString("%1up=%2 %3 %4").arg(options.isEmpty() ? "" : "&").arg(up[0]).arg(up[1]).arg(up[2]);
  }
  return "fused:" + place + "|" + orientation + "|" + options;
}

// A long log may have to be read for it, or a name to be looked up.
void ProbeTracker::ConnectOrNot()
{
  if (job_) {
    job_->Cancel();
  } else if (timer_->isActive()) {
    tracker_->Stop();
    timer_->stop();
    tool_->clear();
    needleTool_->clear();
    needle_->StopFollowing();
    scan_->StopFollowing();
  } else {
    tracker_->SetDevice(Device().toUtf8());
    hasSeen_ = isToolChosen_ = false;
    trackerToBody_ = Pose::Identity();
    slide_.invalidate();
    sinceSeen_.start();
    job_ = Job::Start(
        this, tr("Connecting the tracker"), [tracker = tracker_.Get()](const Progress&) { tracker->Start(); }, [] {},
        [this](const QString& error) {
          emit scan_->Said({Message::Warning, error, {}});
        });
    connect(job_, &Job::Ended, this, &ProbeTracker::Connected);
    emit JobStarted(job_);
  }
  Step();
}

void ProbeTracker::Connected(bool done)
{
  job_ = nullptr;
  if (done && isEnabled()) { // a task that has begun since then keeps the probe that it began with
    isFused_ = !std::isnan(tracker_->GetHeadingSigma());
    isAlone_ = isFused_ && Device().startsWith("fused:|");
    GiveNormals();
    QSettings().setValue("tracker/address", address_->text());
    QSettings().setValue("tracker/orientation", orientation_->text());
    QSettings().setValue("tracker/options", options_->text());
    timer_->start();
  } else {
    tracker_->Stop();
  }
  Step();
}

// The place on the skin that keys and mouse left the probe at is where a person points to.
void ProbeTracker::PlaceHere()
{
  if (!hasSeen_)
    return;
  if (isFused_) // how it is turned, Align says
    trackerToBody_ = Eigen::Translation3d(scan_->PoseOnSkin().translation() - seen_.translation());
  else
    trackerToBody_ = scan_->PoseOnSkin() * seen_.inverse();
  GiveNormals();
}

// With an orientation alone the probe is where keys and mouse have it, and shown as it is; else they had it there before.
void ProbeTracker::Align()
{
  const Pose shown = isAlone_ ? scan_->ProbeToWorld() : scan_->PoseOnSkin();
  const Eigen::Vector3d array = trackerToBody_.linear().transpose() * shown.linear().col(0);
  tracker_->Align(array[0], array[1], array[2], AlignDegrees);
}

void ProbeTracker::Slide()
{
  if (slide_.isValid()) {
    tracker_->AlignBySlide(1e-3 * static_cast<double>(slide_.elapsed()), SlideDegrees);
    slide_.invalidate();
  } else {
    slide_.start();
  }
}

// A tracker without normals gets those of the skin.
void ProbeTracker::GiveNormals()
{
  if (job_) // it gets them once it is connected
    return;
  const std::shared_ptr<const SkinMesh> mesh = scan_->Body().mesh;
  if (!mesh) {
    tracker_->SetNormals(nullptr);
    return;
  }
  tracker_->SetNormals([mesh, toBody = trackerToBody_](const Eigen::Vector3d& place) -> std::optional<Eigen::Vector3d> {
    const auto nearest = mesh->NearestTo(toBody * place);
    if (!nearest || nearest->distanceMm > NearMm)
      return std::nullopt;
    return toBody.linear().transpose() * mesh->NormalAt(nearest->place);
  });
}

void ProbeTracker::ShowHeading()
{
  const bool can = timer_->isActive() && isFused_;
  const bool hasCome = can && tracker_->GetNumberOfTools() > 0;
  align_->setEnabled(hasCome);
  slideButton_->setEnabled(hasCome && !isAlone_);
  slideButton_->setText(slide_.isValid() ? tr("It was &slid") : tr("Align by a &slide"));
  const double sigma = can ? tracker_->GetHeadingSigma() : 0.0;
  const QString text = !can           ? tr("of the tracker")
                       : sigma > 90.0 ? tr("not known: Align")
                                      : tr("known to %1 degrees").arg(sigma, 0, 'f', sigma < 9.95 ? 1 : 0);
  if (heading_->text() != text)
    heading_->setText(text);
}

void ProbeTracker::Step()
{
  const bool active = timer_->isActive();
  connect_->setText(active ? tr("Disconnect") : job_ ? tr("Cancel") : tr("&Connect"));
  address_->setEnabled(!active && !job_);
  orientation_->setEnabled(!active && !job_);
  options_->setEnabled(!active && !job_);
  here_->setEnabled(active && hasSeen_ && !isAlone_);
  ShowHeading();
  if (!active) {
    state_->setText(job_ ? tr("connecting") : tr("not connected"));
    return;
  }
  if (isAlone_) {
    const Eigen::Vector3d at = scan_->ProbeToWorld().translation(), normal = scan_->SkinNormal();
    tracker_->SetPlace(at[0], at[1], at[2], normal[0], normal[1], normal[2]);
  }
  tracker_->Update();
  const std::string tool = ProbeTool();
  StepNeedle();
  QString state = StateOf(tracker_);
  const vtkNew<vtkMatrix4x4> matrix;
  const auto status =
      tool.empty() ? TransformStatus::Missing : static_cast<TransformStatus>(tracker_->GetTransform(tool.c_str(), matrix));
  const bool isSeen = status == TransformStatus::Valid, isAway = status == TransformStatus::OutOfRange,
             isRunning = tracker_->GetState() == "running";
  const Eigen::Matrix4d toTracker = MatrixOf(matrix);
  // Of a recording at its end the last pose stays valid: it is no news.
  if (isSeen && (isRunning || !hasSeen_ || toTracker != seen_.matrix())) {
    seen_.matrix() = toTracker;
    hasSeen_ = true;
    sinceSeen_.start();
    if (isAlone_)
      scan_->Turn(seen_.linear());
    else
      scan_->Follow((trackerToBody_.matrix() * toTracker).eval());
    state += tr("; %1 poses a second").arg(tracker_->GetRate(tool.c_str()), 0, 'f', 0);
  } else if (!hasSeen_) {
    if (!isFused_)
      state += isAway ? tr("; the tool is off the skin, or out of reach") : tr("; the tool has not been seen yet");
  } else if (1e-3 * static_cast<double>(sinceSeen_.elapsed()) > StoppedSeconds) {
    scan_->SetStopped(1e-3 * static_cast<double>(sinceSeen_.elapsed()),
                      !isRunning ? QString()
                      : isAway   ? tr("The probe is off the skin, or out of the tracker's reach")
                                 : tr("The tracker does not see the probe"));
    state += isAway ? tr("; the tool is off the skin, or out of reach") : tr("; the tool is not seen");
  }
  if (state_->text() != state)
    state_->setText(state);
}

// The one that a person chose; until then one that is called so, wherever it is in the list.
std::string ProbeTracker::ProbeTool()
{
  const std::string tool = ChosenTool(tool_, tracker_);
  const int named = isToolChosen_ ? -1 : tool_->findText("Probe", Qt::MatchStartsWith);
  if (named < 0 || named == tool_->currentIndex())
    return tool;
  tool_->setCurrentIndex(named);
  return tool_->currentText().toStdString();
}

// Another tool of the same tracker; nobody, until a person says which.
void ProbeTracker::StepNeedle()
{
  const std::string tool = ChosenTool(needleTool_, tracker_, tr("none"));
  if (tool.empty()) {
    needle_->StopFollowing();
    return;
  }
  const vtkNew<vtkMatrix4x4> matrix;
  if (tracker_->GetTransform(tool.c_str(), matrix) == 0)
    needle_->Follow((trackerToBody_.matrix() * MatrixOf(matrix)).eval());
  else
    needle_->SetLost();
}

} // namespace echorama
