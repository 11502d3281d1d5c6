// SPDX-License-Identifier: BSD-3-Clause
#include "OutputPanel.h"
#include "Controls.h"
#include "Core/Base/Error.h"
#include "Scan.h"
#include "ScanRecorder.h"
#include <QCheckBox>
#include <QDoubleSpinBox>
#include <QFileDialog>
#include <QFormLayout>
#include <QLabel>
#include <QStandardPaths>
#include <vtkImageData.h>
#include <vtkMatrix4x4.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {

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
  ShowState();
}

OutputPanel::~OutputPanel()
{
  Finish();
  sender_->Stop();
}

void OutputPanel::RecordOrNot()
{
  if (IsRecording()) {
    const QString path = Finish();
    if (!path.isEmpty())
      emit scan_->Said({Message::Note, tr("Recorded as %1").arg(path), {}});
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

QString OutputPanel::Finish()
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
    try {
      recorder_->Append(scan_->Frame(), image);
    } catch (const Error& error) {
      emit scan_->Said({Message::Warning, QString::fromUtf8(error.what()), {}});
      Finish();
    }
  if (isSending_ && !scan_->Frame().isInAir) {
    vtkNew<vtkMatrix4x4> pose;
    vtkUltrasoundVolume::SetMatrix(pose, scan_->Frame().probeToWorld);
    sender_->SendTransform("ProbeToReference", pose);
    vtkNew<vtkImageData> sent; // the next image is made in place
    sent->DeepCopy(image);
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

void OutputPanel::Replay(const QString& path)
{
  try {
    const ScanLog log = ScanLog::Read(path);
    if (scan_->Body().IsEmpty() || log.body != SumOf(scan_->Body()))
      throw Error(Error::Kind::BadInput,
                  tr("%1 is of another body: open %2 first").arg(path, log.volumes.join(", ")).toStdString());
    std::vector<ScanFrame> frames;
    for (const ScanLog::Entry& entry : log.entries)
      frames.push_back(entry.frame);
    scan_->Replay(frames);
    int same = 0;
    for (const ScanLog::Entry& entry : log.entries) {
      scan_->Scanner().Make(entry.frame);
      same += SumOf(scan_->Scanner().Output()) == entry.sum;
    }
    scan_->ShowCine(0);
    const auto count = static_cast<int>(log.entries.size());
    emit scan_->Said({same == count ? Message::Note : Message::Warning,
                      tr("%1 of %2 images are the same to the last bit as when they were recorded").arg(same).arg(count),
                      {}});
  } catch (const Error& error) {
    emit scan_->Said({Message::Warning, QString::fromUtf8(error.what()), {}});
  }
}

} // namespace echorama
