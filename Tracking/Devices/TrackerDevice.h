// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Stream/ImageStream.h"
#include "Tracking/Stream/PoseStream.h"
#include <memory>
#include <string>
#include <vector>

namespace echorama {

/// Something that puts poses into a stream, from a thread of its own: transport and decoder together. Each kind lies in a
/// file of its own, with a page of its own.
class TrackerDevice {
public:
  virtual ~TrackerDevice() = default; // the kind's own destructor stops it

  /// Begins; returns at once. What goes wrong later (unplugged, closed, garbage) is told by the state and counts of \a poses.
  /// Images are dropped when \a images is nullptr. Both must outlive the device, or its Stop().
  /// \throws Error(FileSystem) when what it names cannot be opened at all, Error(InvalidParameter).
  virtual void Start(PoseStream& poses, ImageStream* images) = 0;
  /// Ends within a quarter of a second, whatever the device does. May be called twice. Then the state is Idle, but for a
  /// recording that has ended and a device that has failed, whose message stays.
  virtual void Stop() = 0;
};

/// The device behind an address; see TrackerAddress. \throws Error(InvalidParameter) that names address and reason: an
/// unknown scheme, or an option that the kind does not have or that is out of its range.
std::unique_ptr<TrackerDevice> MakeTracker(const std::string& address);

/// The schemes that MakeTracker knows.
std::vector<std::string> TrackerSchemes();

} // namespace echorama
