// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Optical/GreyFrame.h"
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace echorama {

/// What a camera delivers.
struct CameraFormat {
  int width = 0, height = 0;
  double frameRate = 0.0;  ///< Hz
  double exposureMs = 0.0; ///< how long a row takes light; 0: nobody knows
  double rowUs = 0.0;      ///< how much later each row begins; 0: a global shutter, or nobody knows
  std::string pixels;      ///< as they come: "GREY", "YUYV", "BGR3"
  std::string name;        ///< for people: "/dev/video0 (USB 2.0 Camera)"
};

/// One picture, and when it was taken.
struct CameraFrame {
  GreyFrame grey;       ///< lies in the source until its next call
  double begin = 0.0;   ///< of the exposure of the first row, s: on our clock (ClockNow) if the source is live, else on its own
  double arrival = 0.0; ///< when the host had it, on the same clock
  std::int64_t number = 0; ///< counts the camera's frames, also those that were lost
};

/// Where frames come from: a camera, a recording, or a camera that does not exist. Named in one line, as trackers are
/// (TrackerAddress): camera:0?exposureMs=8, recording:FILE, simulated:?lights=2. For use by one thread at a time.
class CameraSource {
public:
  enum class Outcome {
    Frame,
    Nothing, ///< none came in time; ask again
    Ended,   ///< none will come any more: a recording has been read
  };

  virtual ~CameraSource() = default;

  /// Begins, anew if it was open. \throws Error(FileSystem), Error(BadFile), Error(NotPossible), each of which names what cannot
  /// be used, why, and what helps
  virtual CameraFormat Open() = 0;
  /// The next frame; waits for up to \a seconds, of which implementations may take a tenth of a second more.
  /// \throws Error(FileSystem) when a camera is gone (unplugged), Error(BadFile) for a recording that is damaged
  virtual Outcome Next(CameraFrame& frame, double seconds) = 0;
  virtual void Close() = 0;
  /// Whether its clock is ours and frames are lost by whoever is slow. Recordings can wait.
  virtual bool IsLive() const = 0;
  /// Frames that never came, since Open().
  virtual std::int64_t Lost() const = 0;
};

/// \throws Error(InvalidParameter) that names line and reason: no such kind of source, no such option, or one out of its range
std::unique_ptr<CameraSource> MakeCamera(const std::string& line);
struct TrackerAddress;
std::unique_ptr<CameraSource> MakeCamera(const TrackerAddress& address);

/// "camera", "recording", "simulated".
std::vector<std::string> CameraSchemes();

} // namespace echorama
