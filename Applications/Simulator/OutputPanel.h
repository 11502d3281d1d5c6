// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <memory>
#include <QDir>
#include <QPushButton>
#include <QWidget>
#include <vtkNew.h>
#include <vtkUltrasoundOpenIGTLinkSender.h>

class QCheckBox;
class QDoubleSpinBox;
class QLabel;

namespace echorama {

class Scan;
class ScanRecorder;

/// What becomes of the image: a recording, which can be replayed, and live images and poses for 3D Slicer and its like.
class OutputPanel : public QWidget {
  Q_OBJECT

public:
  explicit OutputPanel(Scan* scan, QWidget* parent = nullptr);
  ~OutputPanel() override;

  void SetFolder(const QDir& folder) { folder_ = folder; }
  bool IsRecording() const { return recorder_ != nullptr; }
  /// Ends what is being recorded. \returns its path; empty when there was none, or nothing came.
  QString Finish();
  /// Shows a recorded scan in place of the last seconds, frozen, and tells whether its images are still the same.
  void Replay(const QString& path);
  /// While somebody is looking for what a recording may show.
  void ForbidReplay(bool forbidden) { replay_->setDisabled(forbidden); }
  vtkUltrasoundOpenIGTLinkSender* Sender() { return sender_; }

private:
  void RecordOrNot();
  void SendOrNot(bool send);
  void Take();
  void ShowState();

  Scan* scan_;
  QDir folder_;
  std::unique_ptr<ScanRecorder> recorder_;
  vtkNew<vtkUltrasoundOpenIGTLinkSender> sender_;
  bool isSending_ = false;
  QPushButton *record_, *replay_;
  QCheckBox* send_;
  QDoubleSpinBox* port_;
  QLabel* state_;
};

} // namespace echorama
