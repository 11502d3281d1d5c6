// SPDX-License-Identifier: BSD-3-Clause
#include "TrackerPanel.h"
#include "Controls.h"
#include "Job.h"
#include "TrackerState.h"
#include <QComboBox>
#include <QFormLayout>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QSettings>
#include <QTimer>

namespace echorama {

TrackerPanel::TrackerPanel(Workspace& workspace, QWidget* parent) : QWidget(parent), workspace_(workspace)
{
  setObjectName("trackerPanel");
  tracker_->SetActive(false); // until Connect
  address_ = new QLineEdit(QSettings().value("tracker/address", "igtl://localhost:18944").toString(), this);
  address_->setObjectName("trackerAddress");
  address_->setToolTip(tr("The tracker in one line: igtl://HOST:PORT, polhemus:/dev/ttyUSB0, replay:FILE or simulated:"));
  tool_ = ChoiceField(this, "trackerTool", tr("The tool that moves volumes"), std::vector<std::string>());
  connect_ = Button(this, "trackerConnect", {}, tr("Begins to read the tracker, and ends it"), [this] { ConnectOrNot(); });
  grasp_ =
      Button(this, "trackerGrasp", tr("&Grasp (hold)"), tr("While it is held down, the selected volumes follow the tool"), {});
  state_ = TextField(this, "trackerState");
  auto* form = new QFormLayout(this);
  form->addRow(tr("Tracker"), address_);
  form->addRow(connect_);
  form->addRow(tr("Tool"), tool_);
  form->addRow(grasp_);
  form->addRow(tr("State"), state_);

  timer_ = new QTimer(this);
  timer_->setInterval(16);
  connect(timer_, &QTimer::timeout, this, &TrackerPanel::Step);
  connect(grasp_, &QPushButton::pressed, this, [this] { SetGrasping(true); });
  connect(grasp_, &QPushButton::released, this, [this] { SetGrasping(false); });
  Step();
}

TrackerPanel::~TrackerPanel()
{
  delete job_;
  tracker_->Stop();
}

// A long log may have to be read for it, or a name to be looked up.
void TrackerPanel::ConnectOrNot()
{
  SetGrasping(false);
  if (job_) {
    job_->Cancel();
  } else if (timer_->isActive()) {
    tracker_->Stop();
    timer_->stop();
    tool_->clear();
  } else {
    tracker_->SetDevice(address_->text().trimmed().toUtf8());
    workspace_.show({Message::Note, {}, {}, objectName()}); // what the last try said
    job_ = workspace_.Run(
        this, tr("Connecting the tracker"), [tracker = tracker_.Get()](const Progress&) { tracker->Start(); }, [] {});
    connect(job_, &Job::Ended, this, &TrackerPanel::Connected);
  }
  Step();
}

void TrackerPanel::Connected(bool done)
{
  job_ = nullptr;
  if (done) {
    QSettings().setValue("tracker/address", address_->text());
    timer_->start();
  } else {
    tracker_->Stop();
  }
  Step();
}

void TrackerPanel::SetGrasping(bool grasping)
{
  const bool letsGo = isGrasping_ && !grasping;
  isGrasping_ = grasping && timer_->isActive();
  if (letsGo)
    workspace_.moveByTool(seen_, false);
}

void TrackerPanel::Step()
{
  const bool active = timer_->isActive();
  connect_->setText(active ? tr("Disconnect") : job_ ? tr("Cancel") : tr("&Connect"));
  address_->setEnabled(!active && !job_);
  grasp_->setEnabled(active && tool_->count() > 0);
  if (!active) {
    state_->setText(job_ ? tr("connecting") : tr("not connected"));
    return;
  }
  tracker_->Update();
  const std::string tool = ChosenTool(tool_, tracker_);
  QString state = StateOf(tracker_);
  if (!tool.empty()) {
    const vtkNew<vtkMatrix4x4> toolToTracker;
    // 0 is valid: a tool that is out of sight must not fling volumes about.
    isSeen_ = tracker_->GetTransform(tool.c_str(), toolToTracker) == 0;
    if (isGrasping_ && isSeen_) {
      seen_->DeepCopy(toolToTracker);
      workspace_.moveByTool(toolToTracker, true);
    }
    state += isSeen_ ? tr("; %1 poses a second").arg(tracker_->GetRate(tool.c_str()), 0, 'f', 0) : tr("; the tool is not seen");
  }
  if (state_->text() != state)
    state_->setText(state);
}

} // namespace echorama
