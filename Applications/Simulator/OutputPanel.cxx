// SPDX-License-Identifier: BSD-3-Clause
#include "OutputPanel.h"
#include "Controls.h"
#include "Core/Base/Error.h"
#include "Job.h"
#include "Scan.h"
#include "ScanRecorder.h"
#include <atomic>
#include <QCheckBox>
#include <QDoubleSpinBox>
#include <QFileDialog>
#include <QFileInfo>
#include <QFormLayout>
#include <QLabel>
#include <QStandardPaths>
#include <QTimer>
#include <vtkImageData.h>
#include <vtkMatrix4x4.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {

namespace {

// For another thread: pipelines write into the objects that they hand on, though not into what these hold.
Subject OwnCopy(const Subject& subject)
{
  Subject copy;
  for (const auto& volume : subject.volumes) {
    copy.volumes.push_back(vtkSmartPointer<vtkImageData>::New());
    copy.volumes.back()->ShallowCopy(volume);
  }
  for (const auto& state : subject.pressed) {
    copy.pressed.push_back(vtkSmartPointer<vtkImageData>::New());
    copy.pressed.back()->ShallowCopy(state);
  }
  if (subject.tissue) {
    copy.tissue = vtkSmartPointer<vtkPolyData>::New();
    copy.tissue->ShallowCopy(subject.tissue);
  }
  return copy;
}

} // namespace

OutputPanel::OutputPanel(Scan* scan, QWidget* parent)
  : QWidget(parent), scan_(scan), folder_(QStandardPaths::writableLocation(QStandardPaths::PicturesLocation) + "/Echorama")
{
  setObjectName("outputPanel");
  record_ = Button(this, "record", tr("&Record"), tr("Records images and poses as a tracked sequence, until it is pressed again"),
                   [this] { RecordOrNot(); });
  replay_ = Button(this, "replay", tr("Re&play..."), tr("Shows a recorded scan (.scan.jsonl) of this body again"), [this] {
    const QString path = QFileDialog::getOpenFileName(this, tr("A recorded scan"), folder_.path(), "*.scan.jsonl");
    if (!path.isEmpty())
      Replay(path);
  });
  send_ = CheckField(this, "send", tr("Send by OpenIGTLink"),
                     tr("Gives image and pose to 3D Slicer and every other client that connects to the port"),
                     [this](bool on) { SendOrNot(on); });
  port_ = NumberField(this, {"sendPort", tr("The port that clients connect to; 0 takes one that is free"), 0, 65535, 0, 1, {}});
  port_->setValue(18944);
  state_ = TextField(this, "outputState");
  auto* form = new QFormLayout(this);
  form->addRow(record_);
  form->addRow(replay_);
  form->addRow(send_);
  form->addRow(tr("Port"), port_);
  form->addRow(tr("State"), state_);
  connect(scan, &Scan::FrameMade, this, &OutputPanel::Take);
  connect(scan, &Scan::SubjectChanged, this, &OutputPanel::Finish); // a recording is of one body
  connect(scan, &Scan::SubjectChanged, this, &OutputPanel::EndReplay);
  auto* timer = new QTimer(this); // a probe that rests makes no frames
  connect(timer, &QTimer::timeout, this, [this] {
    if (recorder_)
      TryRecording([this] { recorder_->FlushWhenDue(); });
  });
  timer->start(250);
  ShowState();
}

OutputPanel::~OutputPanel()
{
  End();
  sender_->Stop();
}

void OutputPanel::RecordOrNot()
{
  if (IsRecording()) {
    Finish();
    return;
  }
  vtkImageData* image = scan_->Scanner().Output();
  if (scan_->Body().IsEmpty() || image->GetNumberOfPoints() == 0) {
    emit scan_->Said({Message::Note, tr("There is no image to record"), {}});
    return;
  }
  try {
    int size[3];
    image->GetDimensions(size);
    recorder_ = std::make_unique<ScanRecorder>(folder_, scan_->Body(), std::array<int, 2>{size[0], size[1]});
  } catch (const Error& error) {
    emit scan_->Said({Message::Warning, QString::fromUtf8(error.what()), {}});
  }
  if (!scan_->IsFrozen())
    Take(); // from the image that is there
  ShowState();
}

void OutputPanel::TryRecording(const std::function<void()>& step)
{
  try {
    step();
  } catch (const Error& error) {
    emit scan_->Said({Message::Warning, QString::fromUtf8(error.what()), {}});
    End();
  }
}

// \returns the path of the sequence; empty when there is none.
QString OutputPanel::End()
{
  QString path;
  if (recorder_)
    try {
      path = recorder_->Path();
      recorder_->Finish();
    } catch (const Error& error) {
      path.clear();
      emit scan_->Said({Message::Warning, QString::fromUtf8(error.what()), {}});
    }
  recorder_.reset();
  ShowState();
  return path;
}

bool OutputPanel::Finish()
{
  if (!recorder_)
    return true;
  const QString path = End();
  if (path.isEmpty())
    return false;
  const auto joined = std::make_shared<QString>();
  Job* job = Job::Start(
      this, tr("Putting the recording into one file"),
      [path, joined](const Progress& progress) { *joined = ScanRecorder::Join(path, progress); }, [] {},
      [this](const QString& error) {
        emit scan_->Said({Message::Warning, error, {}});
      });
  connect(job, &Job::Ended, this, [this, path, joined](bool done) {
    emit scan_->Said({Message::Note, tr("Recorded as %1").arg(done ? *joined : path), {}});
  });
  emit JobStarted(job);
  return true;
}

void OutputPanel::SendOrNot(bool send)
{
  isSending_ = send;
  if (send) {
    sender_->SetPort(static_cast<int>(port_->value()));
    sender_->SetDeviceName("Image");
    isSending_ = sender_->Start(); // else it has said why
    Show(send_, isSending_);
    if (isSending_)
      Take();
  } else {
    sender_->Stop();
  }
  port_->setEnabled(!isSending_);
  ShowState();
}

void OutputPanel::Take()
{
  vtkImageData* image = scan_->Scanner().Output();
  if (scan_->IsFrozen() || scan_->HasFailed() || image->GetNumberOfPoints() == 0)
    return;
  if (recorder_)
    TryRecording([&] { recorder_->Append(scan_->Frame(), image); });
  if (isSending_ && !scan_->Frame().isInAir) {
    vtkNew<vtkMatrix4x4> pose;
    vtkUltrasoundVolume::SetMatrix(pose, scan_->Frame().probeToWorld);
    sender_->SendTransform("ProbeToReference", pose);
    if (scan_->Frame().needle) {
      vtkUltrasoundVolume::SetMatrix(pose, scan_->Frame().needle->ToWorld());
      sender_->SendTransform("NeedleToReference", pose);
    }
    vtkNew<vtkImageData> sent; // the next image has arrays of its own, but goes into the same object
    sent->ShallowCopy(image);
    sender_->SetInputData(sent);
    sender_->Update();
  }
  ShowState();
}

void OutputPanel::ShowState()
{
  record_->setText(IsRecording() ? tr("Stop &recording") : tr("&Record"));
  QString text = IsRecording() ? tr("recording: %1 frames").arg(recorder_->Frames()) : tr("not recording");
  if (isSending_)
    text += tr("; port %1, %2 clients").arg(sender_->GetListeningPort()).arg(sender_->GetNumberOfClients());
  if (state_->text() != text)
    state_->setText(text);
}

void OutputPanel::EndReplay()
{
  delete replaying_;
}

void OutputPanel::ForbidReplay(bool forbidden)
{
  replay_->setDisabled(forbidden);
  if (forbidden)
    EndReplay();
}

void OutputPanel::Begin(Job* job)
{
  replaying_ = job;
  emit JobStarted(job);
}

void OutputPanel::Replay(const QString& path)
{
  delete replaying_;
  const auto log = std::make_shared<ScanLog>();
  const auto fail = [this](const QString& error) { emit scan_->Said({Message::Warning, error, {}}); };
  Begin(Job::Start(
      this, tr("Reading the recording"),
      [log, path, body = OwnCopy(scan_->Body())](const Progress& progress) {
        *log = ScanLog::Read(path);
        progress(0.5);
        if (body.IsEmpty() || log->body != SumOf(body, log->version))
          throw Error(Error::Kind::BadInput,
                      tr("%1 is of another body: open %2 first").arg(path, log->volumes.join(", ")).toStdString());
      },
      [this, log, path] {
        std::vector<ScanFrame> frames;
        for (const ScanLog::Entry& entry : log->entries)
          frames.push_back(entry.frame);
        scan_->Replay(frames);
        scan_->ShowCine(0);
        Compare(*log, QFileInfo(path).fileName());
      },
      fail));
}

// With a scanner of its own, so that what is shown can be gone through meanwhile.
void OutputPanel::Compare(const ScanLog& log, const QString& name)
{
  struct Count {
    std::atomic<int> made{0}, same{0};
  };
  const auto count = std::make_shared<Count>();
  const auto all = static_cast<int>(log.entries.size());
  Job* job = Job::Start(
      this, tr("Comparing the images of %1").arg(name),
      [count, entries = log.entries, body = OwnCopy(scan_->Body())](const Progress& progress) {
        LiveScanner scanner;
        scanner.SetInputs(body.volumes, body.tissue);
        scanner.SetPressed(body.pressed);
        for (std::size_t i = 0; i < entries.size(); i++) {
          const auto size = static_cast<double>(entries.size());
          const auto at = static_cast<double>(i);
          scanner.Prepare(entries[i].frame);
          scanner.Work(progress.Part(at / size, (at + 1.0) / size));
          scanner.Keep();
          count->same += SumOf(scanner.Output()) == entries[i].sum;
          count->made++;
        }
      },
      [] {},
      [this](const QString& error) {
        emit scan_->Said({Message::Warning, error, {}});
      });
  connect(job, &Job::Ended, this, [this, count, all](bool done) {
    const int made = count->made, same = count->same;
    QString text = tr("%1 of %2 images are the same to the last bit as when they were recorded").arg(same).arg(made);
    if (!done)
      text += tr("; %1 were not compared").arg(all - made);
    emit scan_->Said({same == made ? Message::Note : Message::Warning, text, {}});
  });
  Begin(job);
}

} // namespace echorama
