// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ImageGeometry.h"
#include "Core/Geometry/RigidTransform.h"
#include "Widgets/Session/LiveScore.h"
#include <memory>
#include <optional>
#include <string>
#include <variant>

namespace echorama {

/// What a task was made for: a volume, or a scene, which has no geometry.
struct TaskBody {
  std::string file;                      ///< without its folder
  std::string checksum;                  ///< Checksum of the voxels, or of the scene's text
  std::optional<ImageGeometry> geometry; ///< as it lies in the world

  /// Why a task for this body cannot be done on another one, as a sentence that names both; empty when it can. A file of another
  /// name with the same content is the same body.
  std::string Complaint(const TaskBody& shown) const;
};

/// Find a plane: bring the image to where it was when the task was made.
struct FindPlane {
  Pose probeToWorld = Pose::Identity();
  double depthMm = 60.0;                    ///< of the point in the middle of the image by which the distance is measured
  double distanceMm = 10.0, degrees = 10.0; ///< within these it is found
};

/// Measure a length with callipers.
struct MeasureLength {
  double lengthMm = 10.0;
  double toleranceMm = 1.0;
  Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = Eigen::Vector3d::Zero(); ///< for the solution; the same: not known
};

/// Bring the tip of a needle to a place.
struct ReachTarget {
  Eigen::Vector3d target = Eigen::Vector3d::Zero(); ///< mm, world
  double radiusMm = 5.0;
  bool showTip = false; ///< the tip may be marked in the image
};

/// What a teacher asks for. It holds the solution: a window hands it to nobody but the editor of tasks, and opens attempts by
/// ScanAttempt::Open().
struct ScanTask {
  std::string name, instruction;
  TaskBody body;
  bool hint = false; ///< how far it is may be shown during an attempt
  std::variant<FindPlane, MeasureLength, ReachTarget> goal;

  /// \throws Error(InvalidParameter) for what a file could not hold
  void Check() const;
};

/// {"schema": "echorama-scan-task-1", "name", "instruction", "hint", "body": {"file", "checksum", "geometry"}} and one of
/// "findPlane", "measureLength", "reachTarget". All lengths in mm, in the world. Numbers come back to the last bit.
/// \param name for messages. \throws Error(BadFile) that names the way to the key
ScanTask ScanTaskOf(const std::string& text, const std::string& name = "the task");
std::string ScanTaskText(const ScanTask& task);
/// \throws Error(FileSystem), Error(BadFile); Error(InvalidParameter) as ScanTask::Check
ScanTask ReadScanTask(const std::string& path);
void WriteScanTask(const std::string& path, const ScanTask& task);

/// How good an answer was.
struct ScanScore {
  double distanceMm = 0.0;       ///< of the planes' middles, of the lengths, of the tip from the target
  double degrees = 0.0;          ///< between the planes, [0, 90]; of other tasks 0
  double seconds = 0.0;          ///< from the start
  std::optional<double> startMm; ///< the distance at the start
  bool passed = false;           ///< within what was asked for
};

/// One attempt at a task, and all that a window may know of it. Nothing that leads to the solution can be asked for while it
/// lasts: distances only when the task allows hints, the solution only after the answer.
class ScanAttempt {
public:
  enum class Kind { FindPlane, MeasureLength, ReachTarget };

  /// \param shown what is on the screen. \throws Error(BadInput) with TaskBody::Complaint; as ScanTask::Check
  ScanAttempt(ScanTask task, const TaskBody& shown);
  /// From a file, so that nobody holds the task. \throws also as ReadScanTask
  static ScanAttempt Open(const std::string& path, const TaskBody& shown);
  ~ScanAttempt();
  ScanAttempt(ScanAttempt&&) noexcept;
  ScanAttempt& operator=(ScanAttempt&&) noexcept;

  Kind What() const;
  const std::string& Name() const;
  const std::string& Instruction() const;
  bool GivesHints() const;
  /// Of a needle: whether its tip may be marked.
  bool ShowsTip() const;
  bool IsRunning() const;

  /// \param seconds on any clock that rises. \param pose of the probe, or of the needle (its tip at the origin), by which the
  /// distance at the start is known. A running attempt starts again. \throws Error(InvalidParameter), Error(BadInput) for what is
  /// not finite or not rigid
  void Start(double seconds, const std::optional<Pose>& pose = {});
  void Cancel();

  /// How far a pose is from what is asked for; nothing unless the attempt is running, the task gives hints, and it is no
  /// measurement. \throws Error(BadInput) for a pose that is not rigid
  std::optional<ScanScore> Hint(double seconds, const Pose& pose) const;

  /// The answer; the attempt has ended then. \throws Error(InvalidParameter), and it goes on, when it is not running, for a time
  /// before the start, and for an answer of another kind; Error(BadInput) for what is not finite or not rigid
  ScanScore SubmitPose(double seconds, const Pose& pose); ///< of the probe (FindPlane) or the needle (ReachTarget)
  ScanScore SubmitLength(double seconds, double mm);

  /// The task with its solution: only after an answer, nullptr before and during an attempt.
  const ScanTask* Solution() const;

  /// As a line of the history (AppendAttempt): score and worst score are the distance, the project is the task's name and file.
  /// \throws Error(InvalidParameter) before an answer
  Attempt HistoryLine(const std::string& time, const std::string& trainee) const;

private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

} // namespace echorama
