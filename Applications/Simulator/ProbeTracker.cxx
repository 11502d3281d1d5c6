// SPDX-License-Identifier: BSD-3-Clause
#include "ProbeTracker.h"
#include "Controls.h"
#include "Scan.h"
#include "TrackerState.h"
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

constexpr int PollMs = 8;
constexpr double StoppedSeconds = 0.5; ///< without a pose: what is shown is not what is

} // namespace

ProbeTracker::ProbeTracker(Scan* scan, QWidget* parent) : QWidget(parent), scan_(scan)
{
  setObjectName("trackerPanel");
  tracker_->SetActive(false); // until Connect
  tracker_->SetFreshSeconds(StoppedSeconds);
  address_ = new QLineEdit(QSettings().value("tracker/address", "igtl://localhost:18944").toString(), this);
  address_->setObjectName("trackerAddress");
  address_->setToolTip(tr("The tracker in one line: igtl://HOST:PORT, polhemus:/dev/ttyUSB0, replay:FILE or simulated:"));
  connect_ = Button(this, "trackerConnect", {}, tr("Begins to follow the tracker, and ends it"), [this] { ConnectOrNot(); });
  tool_ = ChoiceField(this, "trackerTool",
                      tr("The tool that is the probe: its origin is the middle of the face, z looks into the body"),
                      std::vector<std::string>());
  here_ = Button(this, "trackerHere", tr("It is &here"),
                 tr("Says that the tool is now where the probe was before it was connected, and moves all that follows likewise"),
                 [this] { PlaceHere(); });
  state_ = TextField(this, "trackerState");
  auto* form = new QFormLayout(this);
  form->addRow(tr("Tracker"), address_);
  form->addRow(connect_);
  form->addRow(tr("Tool"), tool_);
  form->addRow(here_);
  form->addRow(tr("State"), state_);
  timer_ = new QTimer(this);
  timer_->setTimerType(Qt::PreciseTimer);
  timer_->setInterval(PollMs);
  connect(timer_, &QTimer::timeout, this, &ProbeTracker::Step);
  Step();
}

ProbeTracker::~ProbeTracker()
{
  tracker_->Stop();
}

void ProbeTracker::ConnectOrNot()
{
  if (tracker_->GetActive()) {
    tracker_->Stop();
    timer_->stop();
    tool_->clear();
    scan_->StopFollowing();
  } else {
    tracker_->SetDevice(address_->text().trimmed().toUtf8());
    hasSeen_ = false;
    trackerToBody_ = Pose::Identity();
    sinceSeen_.start();
    if (tracker_->Start()) { // else it has said why
      QSettings().setValue("tracker/address", address_->text());
      timer_->start();
    } else {
      tracker_->Stop();
    }
  }
  Step();
}

// The place on the skin that keys and mouse left the probe at is where a person points to.
void ProbeTracker::PlaceHere()
{
  if (hasSeen_)
    trackerToBody_ = scan_->PoseOnSkin() * seen_.inverse();
}

void ProbeTracker::Step()
{
  const bool active = tracker_->GetActive();
  connect_->setText(active ? tr("Disconnect") : tr("&Connect"));
  address_->setEnabled(!active);
  here_->setEnabled(active && hasSeen_);
  if (!active) {
    state_->setText(tr("not connected"));
    return;
  }
  tracker_->Update();
  const std::string tool = ChosenTool(tool_, tracker_);
  QString state = StateOf(tracker_);
  const vtkNew<vtkMatrix4x4> matrix;
  const bool isSeen = !tool.empty() && tracker_->GetTransform(tool.c_str(), matrix) == 0;
  const Eigen::Matrix4d toTracker = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(matrix->GetData());
  // Of a recording at its end the last pose stays valid: it is no news.
  if (isSeen && (tracker_->GetState() == "running" || !hasSeen_ || toTracker != seen_.matrix())) {
    seen_.matrix() = toTracker;
    hasSeen_ = true;
    sinceSeen_.start();
    scan_->Follow((trackerToBody_.matrix() * toTracker).eval());
    state += tr("; %1 poses a second").arg(tracker_->GetRate(tool.c_str()), 0, 'f', 0);
  } else if (!hasSeen_) {
    state += tr("; the tool has not been seen yet");
  } else if (1e-3 * static_cast<double>(sinceSeen_.elapsed()) > StoppedSeconds) {
    scan_->SetStopped(1e-3 * static_cast<double>(sinceSeen_.elapsed()));
    state += tr("; the tool is not seen");
  }
  if (state_->text() != state)
    state_->setText(state);
}

} // namespace echorama
