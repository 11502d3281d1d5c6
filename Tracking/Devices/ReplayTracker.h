// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Worker.h"
#include "Readers/PoseLog.h"
#include "Tracking/Devices/TrackerAddress.h"
#include "Tracking/Devices/TrackerDevice.h"
#include <memory>
#include <string>
#include <vector>

namespace echorama {

struct ReplayParameters {
  std::string path;
  double speed = 1.0;
  bool loop = false, step = false;
  double from = 0.0, to = 1e300; ///< the part that is replayed, both included
  PoseLogOptions log;            ///< how the file is read

  void Check() const; ///< Throws Error(InvalidParameter): ranges, a file, a part that is one, a speed with loop.
  /// From the place and options of "replay:FILE?speed=2&loop=1&step=1&from=10&to=20&unitMm=1000".
  /// \throws Error(InvalidParameter)
  static ReplayParameters Of(const TrackerAddress& address);
};
ParameterList Describe(ReplayParameters& p);

/// A recording, as if it were a tracker: everything that ReadPoseLog reads, and the images of sequences.
///
/// All poses of one time come together. Their times are those of the file; when they come is told by the speed. At speed 0 it
/// waits for those who subscribed to the poses (ReaderPatience), so that recorders and servers lose none.
class ReplayTracker : public TrackerDevice {
public:
  /// \throws Error(InvalidParameter) as Check()
  explicit ReplayTracker(const ReplayParameters& parameters);
  ~ReplayTracker() override;

  /// Reads the file first, all of it but images. \throws also Error(BadFile) that names file and reason: damaged, without poses,
  /// or without any in the part that was asked for.
  void Start(PoseStream& poses, ImageStream* images) override;
  void Stop() override;

  /// The next poses of one time, and the image that goes with them, at once. \returns false when there are no more, or it was not
  /// started to be stepped.
  bool Step();

  /// All poses at once, for those who want to see a recording at any of its times; \a poses must remember enough of them. Its end
  /// is reached then. \throws as Start
  void ShowAll(PoseStream& poses, ImageStream* images);
  /// The times of the recording that was started, rising; empty when there is none.
  std::vector<double> Times() const;
  /// After ShowAll: puts the image nearest to \a time into the stream, unless it was the last one that was.
  /// \throws Error(BadFile) when its pixels are damaged.
  void ShowImage(double time);

private:
  struct Recording;
  ReplayParameters parameters_;
  std::unique_ptr<Recording> recording_; // of the thread while it runs
  Worker worker_;
};

} // namespace echorama
