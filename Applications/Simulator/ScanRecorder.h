// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "ScanLog.h"
#include <array>
#include <QDir>
#include <QString>

namespace echorama {

class SequenceRecorder;

/// Records a scan: images and poses as a tracked sequence (NAME.igs.mhd, pixels in NAME.igs.raw), which every reader of such
/// takes, and what they were made from (NAME.scan.jsonl), to be replayed.
class ScanRecorder {
public:
  /// \param size of the images, pixels
  /// \throws Error(FileSystem) that names the file
  ScanRecorder(const QDir& folder, const Subject& subject, const std::array<int, 2>& size);
  ~ScanRecorder();

  /// \throws Error(FileSystem) when the disk is full: what was written stays
  void Append(const ScanFrame& frame, vtkImageData* image);
  /// \throws Error(FileSystem), Error(BadInput) when there is no frame: there is no sequence then
  void Finish();
  int Frames() const;
  const QString& Path() const { return path_; } ///< of the sequence

private:
  QString path_;
  std::unique_ptr<SequenceRecorder> sequence_;
  std::unique_ptr<ScanLogWriter> log_;
};

} // namespace echorama
