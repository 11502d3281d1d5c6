// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/TransformGraph.h"
#include "Tracking/Stream/PoseStream.h"
#include <limits>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace echorama {

/// What a stream and fixed transforms say of a transform at one moment.
struct LiveTransform {
  ComposedTransform transform; ///< its matrix means nothing when the status is Missing
  /// Of the poses on the way, on the sender's clock; NaN when none of them moves, none is there, or they have none in common.
  double time = std::numeric_limits<double>::quiet_NaN();
  /// Why the status is not Valid: a sentence; empty when it is, but for "poses of different moments" (LiveTransforms::Find).
  std::string message;

  TransformStatus Status() const { return transform.status; }
};

/// Any FrameAToFrameB, at any time: the poses of a stream together with fixed transforms, such as a calibration.
///
/// A tool "ProbeToTracker" is an edge of a TransformGraph. One that is fixed as well is that of the stream. Names that are not of
/// this form (FramesOf) lead nowhere. Nothing throws once it is made: what is not known is Missing, with a sentence that says
/// why. Safe for use by several threads. Cost: some microseconds per tool.
class LiveTransforms {
public:
  static constexpr double defaultFreshSeconds = 1.0;

  /// \param stream must outlive this
  /// \param freshSeconds of a live stream, a newest pose that came longer ago counts as Missing: a frozen picture is not shown as
  /// if it were live. In (0, 3600].
  /// \throws Error(BadInput) when a fixed transform is none (NamedTransform::Complaint), Error(InvalidParameter)
  explicit LiveTransforms(const PoseStream& stream, const std::vector<NamedTransform>& fixed = {},
                          double freshSeconds = defaultFreshSeconds);

  /// From a frame to another. When \a time is NaN, at the newest moment that all the tools on the way have reached; else at that
  /// time on the sender's clock, as PoseStream::At. Tools that have no moment in common at all, as those of senders whose clocks
  /// do not agree, give their newest poses, the time NaN and the message "poses of different moments".
  LiveTransform Find(const std::string& from, const std::string& to,
                     double time = std::numeric_limits<double>::quiet_NaN()) const;
  /// The same by a name, "ImageToReference" (FramesOf).
  LiveTransform Find(const std::string& name, double time = std::numeric_limits<double>::quiet_NaN()) const;

  /// Everything that is known at a moment, for questions in a row: edges of tools that are not there are Missing.
  TransformGraph Graph(double time = std::numeric_limits<double>::quiet_NaN()) const;

private:
  void MoveTo(const std::vector<ToolPose>& poses, bool onlyFresh) const;
  LiveTransform Ask(const std::string& from, const std::string& to) const;

  const PoseStream& stream_;
  double freshSeconds_;
  // Kept from question to question, so that one only changes matrices; guarded by the mutex.
  mutable std::mutex mutex_;
  mutable TransformGraph graph_;
  mutable std::map<std::string, ToolPose> tools_; // by the name of the edge
  mutable std::map<std::string, double> stale_;   // seconds
};

} // namespace echorama
