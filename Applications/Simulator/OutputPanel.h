// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <functional>
#include <memory>
#include <QDir>
#include <QPointer>
#include <QPushButton>
#include <QWidget>
#include <vtkNew.h>
#include <vtkUltrasoundOpenIGTLinkSender.h>

class QCheckBox;
class QDoubleSpinBox;
class QLabel;

namespace echorama {

class Job;
class Scan;
class ScanRecorder;
struct ScanLog;

/// What becomes of the image: a recording, which can be replayed, and live images and poses for 3D Slicer and its like.
class OutputPanel : public QWidget {
  Q_OBJECT

public:
  explicit OutputPanel(Scan* scan, QWidget* parent = nullptr);
  ~OutputPanel() override;

  void SetFolder(const QDir& folder) { folder_ = folder; }
  bool IsRecording() const { return recorder_ != nullptr; }
  /// Ends what is being recorded, and puts it into one file in the background. \returns false when there is none of what was
  /// recorded, and has said why.
  bool Finish();
  /// Shows a recorded scan in place of the last seconds, frozen. Both, reading it and comparing its images with those that are
  /// made now, are done in the background; then it tells how many are the same.
  void Replay(const QString& path);
  /// While somebody is looking for what a recording may show.
  void ForbidReplay(bool forbidden);
  /// What it has read and compared by then stays.
  void EndReplay();
  vtkUltrasoundOpenIGTLinkSender* Sender() { return sender_; }

signals:
  void JobStarted(Job* job);

private:
  QString End();
  void TryRecording(const std::function<void()>& step);
  void Begin(Job* job);
  void Compare(const ScanLog& log, const QString& name);
  void RecordOrNot();
  void SendOrNot(bool send);
  void Take();
  void ShowState();

  Scan* scan_;
  QDir folder_;
  std::unique_ptr<ScanRecorder> recorder_;
  vtkNew<vtkUltrasoundOpenIGTLinkSender> sender_;
  QPointer<Job> replaying_;
  bool isSending_ = false;
  QPushButton *record_, *replay_;
  QCheckBox* send_;
  QDoubleSpinBox* port_;
  QLabel* state_;
};

} // namespace echorama
