// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Stream/PoseStream.h"
#include "Tracking/Stream/SequenceRecorder.h"
#include <cstdint>
#include <memory>
#include <string>

namespace echorama {

/// How a stream is being recorded.
struct RecordingState {
  std::uint64_t poses = 0;   ///< written
  std::uint64_t frames = 0;  ///< into which they went
  std::uint64_t safe = 0;    ///< frames that a crash cannot take away
  std::uint64_t lost = 0;    ///< poses that came faster than they could be written
  std::uint64_t leftOut = 0; ///< poses that the file cannot hold; the others go on
  std::string lastLeftOut;   ///< a sentence about the newest of these
  std::string problem;       ///< why it goes on no more (the disk is full); empty: it does
};

/// Records every pose of a stream to a sequence, in a thread of its own, crash-safe (see SequenceRecorder).
///
/// A frame holds the poses of one moment: those of several tools that come one after the other with the same time. Tools that say
/// nothing at that moment are not in the frame; those that were not seen are, as Missing. The time goes to Timestamp and
/// UnfilteredTimestamp, as Plus writes them, the arrival of each pose to ArrivalField. ReadPoseLog gives the same poses back, to
/// the last bit.
class StreamRecorder {
public:
  /// Begins. \param poses is taken from from now on; others need subscriptions of their own
  /// \throws what SequenceRecorder throws for the path and the options.
  StreamRecorder(const std::string& path, std::shared_ptr<PoseSubscription> poses, const SequenceRecorderOptions& options = {});
  /// Stops, whatever it says.
  ~StreamRecorder();
  StreamRecorder(const StreamRecorder&) = delete;
  StreamRecorder& operator=(const StreamRecorder&) = delete;

  RecordingState State() const;

  /// Writes what has come, and closes the file. May be called twice.
  /// \throws Error(FileSystem) when the disk is full, Error(BadInput) when no pose came; there is no file then.
  /// Error(NotPossible) when something else ended it, such as a lack of memory; what is safe stays.
  void Stop();
  /// The same, but that nothing came is no fault.
  void StopIfAnything();

private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

} // namespace echorama
