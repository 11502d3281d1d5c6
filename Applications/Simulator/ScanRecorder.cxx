// SPDX-License-Identifier: BSD-3-Clause
#include "ScanRecorder.h"
#include "Core/Base/Error.h"
#include "Core/Base/FileReplacement.h"
#include "Readers/SequenceText.h"
#include "Readers/SequenceWriter.h"
#include "Scan.h"
#include "Tracking/Stream/SequenceRecorder.h"
#include "Widgets/Session/ProjectFile.h"
#include <algorithm>
#include <QDateTime>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {

namespace {

QString NewPath(const QDir& folder)
{
  if (!folder.mkpath("."))
    throw Error(Error::Kind::FileSystem, folder.path().toStdString() + ": the folder cannot be made");
  return folder.filePath("scan-" + QDateTime::currentDateTime().toString("yyyyMMdd-HHmmss-zzz"));
}

} // namespace

ScanRecorder::ScanRecorder(const QDir& folder, const Subject& subject, const std::array<int, 2>& size)
{
  const QString name = NewPath(folder);
  path_ = name + ".igs.mhd";
  SequenceContent content;
  content.dimensions = {size[0], size[1], 1};
  content.imageType = "BRIGHTNESS";
  SequenceRecorderOptions options;
  options.syncToDisk = false; // the window does not wait for the disk; what a failure of power takes is in the page
  sequence_ = std::make_unique<SequenceRecorder>(path_.toStdString(), content, options);
  log_ = std::make_unique<ScanLogWriter>(name + ".scan.jsonl", subject);
}

ScanRecorder::~ScanRecorder() = default; // without Finish() it is as after a crash

void ScanRecorder::Append(const ScanFrame& frame, vtkImageData* image)
{
  SequenceFrame written;
  written.time = frame.seconds;
  written.transforms.push_back({"ImageToReference", vtkUltrasoundVolume::GeometryOf(image).IndexToWorld()});
  written.transforms.push_back({"ProbeToReference", Eigen::Affine3d(frame.probeToWorld.matrix())});
  if (frame.needle)
    written.transforms.push_back({"NeedleToReference", Eigen::Affine3d(frame.needle->ToWorld().matrix())});
  sequence_->Append(written, frame.isInAir ? nullptr : vtkUltrasoundVolume::GetIntensity(image)->GetVoidPointer(0));
  log_->Append(frame, image);
  log_->Release(sequence_->SafeFrames());
}

void ScanRecorder::FlushWhenDue()
{
  sequence_->FlushWhenDue();
  log_->Release(sequence_->SafeFrames());
}

void ScanRecorder::Finish()
{
  sequence_->Finish();
  log_->Release(sequence_->SafeFrames());
}

QString ScanRecorder::Join(const QString& path, const Progress& progress)
{
  const QString joined = path.left(path.size() - 1) + "a"; // .mhd, .mha
  {
    SequenceFile parts(path.toStdString());
    SequenceContent content = parts.Content();
    content.fields.erase(std::remove(content.fields.begin(), content.fields.end(), RecorderField), content.fields.end());
    FileReplacement files;
    SequenceWriter writer(joined.toStdString(), content, false, files);
    std::vector<char> pixels(content.FrameBytes());
    for (int i = 0; i < content.frames; i++) {
      progress(static_cast<double>(i) / content.frames);
      parts.ReadFrame(i, pixels.data());
      writer.Append(parts.Frame(i), pixels.data());
    }
    writer.Finish();
    files.Commit();
  }
  BringToDisk({joined.toStdString()}); // before what it was made of goes
  QFile::remove(path);
  QFile::remove(path.left(path.size() - 3) + "raw");
  return joined;
}

int ScanRecorder::Frames() const
{
  return sequence_->Frames();
}

} // namespace echorama
