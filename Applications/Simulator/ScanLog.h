// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "ScanFrame.h"
#include <deque>
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
  static constexpr int Version = 2; ///< of the file: those of version 1 have another sum of the body
  int version = Version;
  QStringList volumes; ///< by their paths
  QByteArray body;     ///< sum of what they hold (SumOf)
  std::vector<Entry> entries;

  /// \throws Error(BadFile), Error(FileSystem) that name the file, the line and the reason. A last line that was cut off is left
  /// out.
  static ScanLog Read(const QString& path);
};

/// Of the intensities of a volume or image, as text.
QByteArray SumOf(vtkImageData* image);
/// Of all that an image is made from: of volumes all arrays and where they lie, of a scene the surfaces with all their arrays and
/// materials. \param version of the log. In the first it was that of intensities and where they lie, and of points alone.
QByteArray SumOf(const Subject& subject, int version = ScanLog::Version);

/// Writes such a log. A line is in the file once Release() has let it out.
class ScanLogWriter {
public:
  /// \param subject as ReadSubject gave it \throws Error(FileSystem)
  ScanLogWriter(const QString& path, const Subject& subject);
  void Append(const ScanFrame& frame, vtkImageData* image);
  /// Writes the lines of the first \a frames: of those whose images are safe. \throws Error(FileSystem) when the disk is full
  void Release(int frames);

private:
  void Write(const QByteArray& line);

  QFile file_;
  int released_ = 0;
  std::deque<QByteArray> waiting_;               ///< lines of the frames after those
  std::shared_ptr<const ScanSettings> settings_; ///< that were written last
};

} // namespace echorama
