// SPDX-License-Identifier: BSD-3-Clause
#include "ScanRecorder.h"
#include "Core/Base/Error.h"
#include "Readers/SequenceRecorder.h"
#include "Scan.h"
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

ScanRecorder::~ScanRecorder() = default;

void ScanRecorder::Append(const ScanFrame& frame, vtkImageData* image)
{
  log_->Append(frame, image);
  SequenceFrame written;
  written.time = frame.seconds;
  written.transforms.push_back({"ImageToReference", vtkUltrasoundVolume::GeometryOf(image).IndexToWorld()});
  written.transforms.push_back({"ProbeToReference", Eigen::Affine3d(frame.probeToWorld.matrix())});
  sequence_->Append(written, frame.isInAir ? nullptr : vtkUltrasoundVolume::GetIntensity(image)->GetVoidPointer(0));
}

void ScanRecorder::Finish()
{
  sequence_->Finish();
}

int ScanRecorder::Frames() const
{
  return sequence_->Frames();
}

} // namespace echorama
