// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "ScanFrame.h"
#include <memory>
#include <QByteArray>
#include <QFile>
#include <QStringList>
#include <vector>

class vtkImageData;

namespace echorama {

struct Subject;

/// A scan as it was: what was scanned, and every frame with the sum of its image. From these the same images are made again, to
/// the last bit. Lines of JSON, so that a crash costs no more than the last one.
struct ScanLog {
  struct Entry {
    ScanFrame frame;
    QByteArray sum; ///< of the image (SumOf)
  };
  QStringList volumes; ///< by their paths
  QByteArray body;     ///< sum of their voxels and geometry
  std::vector<Entry> entries;

  /// \throws Error(BadFile), Error(FileSystem) that name the file, the line and the reason. A last line that was cut off is left
  /// out.
  static ScanLog Read(const QString& path);
};

/// Of the intensities of a volume or image, as text.
QByteArray SumOf(vtkImageData* image);
/// Of all volumes and where they lie.
QByteArray SumOf(const Subject& subject);

/// Writes such a log, line by line.
class ScanLogWriter {
public:
  /// \throws Error(FileSystem)
  ScanLogWriter(const QString& path, const Subject& subject);
  /// \throws Error(FileSystem) when the disk is full
  void Append(const ScanFrame& frame, vtkImageData* image);

private:
  void Write(const QByteArray& line);

  QFile file_;
  std::shared_ptr<const ScanSettings> settings_; ///< that were written last
};

} // namespace echorama
