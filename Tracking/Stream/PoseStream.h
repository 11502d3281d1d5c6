// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Geometry/ToolPose.h"
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace echorama {

/// What a stream of poses remembers.
struct StreamLimits {
  std::size_t posesPerTool = 4096; ///< 16 s at 250 Hz, 0.7 MB a tool
  std::size_t tools = 64;          ///< a peer may make up names
  double longestGapSeconds = 0.5, jumpSeconds = 1.0;
};
ParameterList Describe(StreamLimits& p);

/// What a device is doing.
enum class DeviceState {
  Idle,       ///< not started
  Connecting, ///< started, nothing there yet
  Running,
  Lost,  ///< it was there and is gone (unplugged, closed); the device goes on trying where that can help
  Ended, ///< a recording has come to its end
  Failed ///< it cannot go on; the message says why
};
const char* DeviceStateText(DeviceState state); ///< "idle", "connecting" ...

/// Why something that came was not taken.
enum class Rejection {
  Malformed,    ///< not what the format says: lengths, checks, words
  TooLarge,     ///< a length beyond what a tracker sends
  Foreign,      ///< from a sender beyond those that are listened to, or of a tool that another one sends
  NotRigid,     ///< a matrix that is no pose; the tool counts as Missing at that moment
  Duplicate,    ///< the same tool and time again
  OutOfOrder,   ///< older than the newest of its tool, but by less than a jump of the clock
  TooManyTools, ///< beyond StreamLimits::tools
};
inline constexpr int RejectionCount = 7;
const char* RejectionText(Rejection reason); ///< "malformed", "too large" ...

/// How one tool has come so far. Counts are of all time; the rest is of the poses that are remembered (StreamLimits), and 0 when
/// there are fewer than two of them.
struct ToolStatistics {
  std::string name;
  std::uint64_t valid = 0, missing = 0, outOfRange = 0; ///< poses taken, by status
  std::uint64_t clockJumps = 0;                         ///< of the sender's clock
  std::uint64_t remembered = 0;                         ///< poses
  std::uint64_t gaps = 0;                               ///< intervals of more than twice the median, on the sender's clock
  double longestGapSeconds = 0.0;                       ///< the longest interval on the sender's clock
  double rateHz = 0.0;                                  ///< poses of any status per second of ours; of the recording's
  double jitterSeconds = 0.0;                           ///< standard deviation of the intervals of arrival; of the recording's
  /// Arrival minus time of measurement; of meaning when both clocks agree. NaN in recordings, and of a sender without times.
  double medianLatencySeconds = 0.0;
  /// 95% of the latencies are below the smallest plus this, whatever the clocks. NaN as above.
  double latencySpreadSeconds = 0.0;
  double secondsSinceLast = 0.0; ///< on our clock; of a recording since it was replayed

  std::uint64_t Taken() const { return valid + missing + outOfRange; }
  /// Share of poses without a valid measurement, in [0, 1].
  double DropoutShare() const;
};

struct StreamStatistics {
  DeviceState state = DeviceState::Idle;
  std::string message;               ///< of the state: whom it is connected to, what went wrong
  bool live = true;                  ///< as SetLive
  std::vector<ToolStatistics> tools; ///< in the order of bytes
  std::array<std::uint64_t, RejectionCount> rejected{};
  std::string lastRejection; ///< a sentence about the newest
  std::uint64_t Rejected(Rejection reason) const { return rejected[static_cast<std::size_t>(reason)]; }
  std::uint64_t Rejected() const; ///< for any reason
  /// A tool by its name or that of its frame ("Probe"), or nullptr.
  const ToolStatistics* Find(const std::string& tool) const;
};

/// Every pose once, in the order in which they came: for recorders and servers. Bounded: what is not taken in time is lost,
/// the oldest first, and counted.
class PoseSubscription {
public:
  explicit PoseSubscription(std::size_t bound);
  ~PoseSubscription();
  PoseSubscription(const PoseSubscription&) = delete;
  PoseSubscription& operator=(const PoseSubscription&) = delete;

  /// What has come since the last call; waits for up to \a seconds (at most an hour) for the first.
  std::vector<ToolPose> Take(double seconds = 0.0);
  std::uint64_t Lost() const;

private:
  friend class PoseStream;
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Timed poses of named tools: what devices write and everybody reads. Safe for use by several threads. Nothing in it blocks for
/// longer than a copy takes, unless it is asked to wait; memory is bounded by StreamLimits.
class PoseStream {
public:
  explicit PoseStream(const StreamLimits& limits = {});
  ~PoseStream();
  PoseStream(const PoseStream&) = delete;
  PoseStream& operator=(const PoseStream&) = delete;

  // Devices write.

  /// Takes a pose, or counts why not. Poses that are not finite or not rigid become Missing, with the pose of nothing. One that
  /// has no time is as old as its arrival. Names are at most 256 bytes, and not empty.
  void Add(ToolPose pose);
  void Reject(Rejection reason, const std::string& what);
  void SetState(DeviceState state, const std::string& message = "");
  /// Whether the sender's clock runs on with ours, as it does unless this says otherwise. That of a recording does not: it may
  /// go faster, or stand still. There, latencies mean nothing, and only a clock that goes back has jumped.
  void SetLive(bool live);

  // Everybody reads.

  bool Live() const;                      ///< as SetLive
  std::vector<std::string> Tools() const; ///< in the order of bytes
  /// The newest of a tool; Missing, with a time that is NaN, when none has come.
  ToolPose Latest(const std::string& name) const;
  /// At a moment on the sender's clock: interpolated between its valid neighbours when they are not further apart than
  /// StreamLimits::longestGapSeconds. Missing in gaps, before the oldest that is remembered, and after the newest; OutOfRange
  /// when a neighbour is.
  ToolPose At(const std::string& name, double time) const;
  /// Whether a moment on the sender's clock lies between the oldest that is remembered of a tool and the newest, both included.
  bool Covers(const std::string& name, double time) const;
  /// All tools under one lock, in the order of bytes: as At, or as Latest when \a time is NaN.
  std::vector<ToolPose> Poses(double time) const;
  /// Those that are remembered, in the order of time.
  std::vector<ToolPose> History(const std::string& name) const;
  StreamStatistics Statistics() const;
  /// What the device is doing and its message, as SetState said; cheap, where Statistics() sorts.
  std::pair<DeviceState, std::string> State() const;
  /// Counts up with every pose and change of state, so that a reader knows whether there is something new.
  std::uint64_t Version() const;
  /// Waits for up to \a seconds (at most an hour) until the version is not \a seen any more. \returns the version
  std::uint64_t WaitBeyond(std::uint64_t seen, double seconds) const;

  /// Waits until so many poses, of all tools together, have been taken. \returns false when they have not after \a seconds, or
  /// the device is at its end or has failed
  bool WaitForPoses(std::uint64_t count, double seconds) const;

  /// From now on. It goes when the last copy of the pointer goes. \a bound: poses it holds.
  std::shared_ptr<PoseSubscription> Subscribe(std::size_t bound = 65536);
  /// How full the fullest subscription is, in [0, 1]: at 1, the next pose costs its oldest. Writers that can wait look at it.
  double Backlog() const;

private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

} // namespace echorama
