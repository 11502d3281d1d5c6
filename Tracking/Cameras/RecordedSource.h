// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Readers/SequenceFile.h"
#include "Tracking/Cameras/CameraSource.h"
#include "Tracking/Devices/TrackerAddress.h"
#include <cstddef>
#include <memory>
#include <vector>

namespace echorama {

class SequenceRecorder;

/// Frames of a camera into a tracked sequence, NAME.igs.mhd with the pixels, one byte each, beside it in NAME.igs.raw: it opens
/// in all that opens sequences, and a crash leaves what was written up to half a second before. Time is the begin of an exposure;
/// FrameNumber and Arrival are fields of each frame, CameraRate, CameraExposureMs and CameraRowUs of the whole.
class CameraRecorder {
public:
  /// \throws as SequenceRecorder: a file that is there already, another extension than .mhd
  CameraRecorder(const std::string& path, const CameraFormat& format);
  ~CameraRecorder();

  /// \throws Error(BadInput) for a frame of another size, Error(FileSystem) when the disk is full
  void Add(const CameraFrame& frame);
  /// \throws Error(BadInput) when there are no frames, Error(FileSystem)
  void Finish();

private:
  CameraFormat format_;
  std::unique_ptr<SequenceRecorder> recorder_;
  std::vector<std::uint8_t> pixels_;
};

struct RecordedSourceParameters {
  std::string path;
  double speed = 1.0;
  double frameRate = 0.0, exposureMs = 0.0, rowUs = 0.0;

  /// From "recording:FILE?speed=0". \throws Error(InvalidParameter)
  static RecordedSourceParameters Of(const TrackerAddress& address);
};
ParameterList Describe(RecordedSourceParameters& p);

/// What CameraRecorder wrote, or any sequence of grey or coloured pictures with time stamps. Frames whose image is said to be
/// invalid are lost ones.
class RecordedSource : public CameraSource {
public:
  explicit RecordedSource(const RecordedSourceParameters& parameters);

  /// \throws Error(FileSystem), Error(BadFile): missing, truncated, without pictures or of another type of voxels, without time
  /// stamps, or with some that do not go on
  CameraFormat Open() override;
  Outcome Next(CameraFrame& frame, double seconds) override;
  void Close() override { file_.reset(); }
  bool IsLive() const override { return false; }
  std::int64_t Lost() const override { return lost_; }

private:
  double TimeOf(int index) const;

  RecordedSourceParameters parameters_;
  std::unique_ptr<SequenceFile> file_;
  std::vector<std::uint8_t> pixels_;
  int index_ = 0;
  std::int64_t number_ = -1, lost_ = 0;
  double start_ = 0.0;
};

} // namespace echorama
