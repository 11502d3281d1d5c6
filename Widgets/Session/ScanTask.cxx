// SPDX-License-Identifier: BSD-3-Clause
#include "Widgets/Session/ScanTask.h"
#include "Core/Base/Angles.h"
#include "Core/Base/CheckRange.h"
#include "Core/Base/Checksum.h"
#include "Core/Base/DescribedJson.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/TextFile.h"
#include <cmath>

namespace echorama {
namespace {

using described::Json;
using Eigen::Vector3d;

constexpr const char* taskSchema = "echorama-scan-task-1";
constexpr ParameterRange taskPlaces{-1e6, 1e6}, taskLengths{0, 1e4, true};

[[noreturn]] void RefuseTask(const std::string& reason)
{
  throw Error(Error::Kind::InvalidParameter, reason);
}

// Structs as their keys: poses and geometries as vectors that people can read.

struct PlaneKeys {
  FindPlane goal;
  Vector3d face = Vector3d::Zero(), array = Vector3d::UnitX(), beam = Vector3d::UnitZ();
};

struct GeometryKeys {
  Vector3d dimensions = Vector3d::Zero(), origin = Vector3d::Zero(), spacing = Vector3d::Ones();
  Vector3d directionI = Vector3d::UnitX(), directionJ = Vector3d::UnitY(), directionK = Vector3d::UnitZ();
};

struct BodyKeys {
  std::string file, checksum;
  std::optional<GeometryKeys> geometry;
};

struct TaskKeys {
  std::string name, instruction;
  bool hint = false;
  BodyKeys body;
  std::variant<PlaneKeys, MeasureLength, ReachTarget> goal;
};

template <class A>
void EachNeeded(A& a, const ParameterList& parameters)
{
  for (const Parameter& parameter : parameters)
    a.Value(parameter, Presence::Needed);
}

template <class A>
void Describe(A& a, PlaneKeys& plane)
{
  EachNeeded(a, {Parameter("Face", plane.face, taskPlaces, "mm", "Middle of the probe's face."),
                 Parameter("Array", plane.array, {-1, 1}, "", "Direction of the array, x of the probe."),
                 Parameter("Beam", plane.beam, {-1, 1}, "", "Direction of the middle beam, z of the probe."),
                 Parameter("DepthMm", plane.goal.depthMm, {0, 1e4}, "mm", "Of the point that distances are measured by."),
                 Parameter("DistanceMm", plane.goal.distanceMm, taskLengths, "mm", "Within this it is found."),
                 Parameter("Degrees", plane.goal.degrees, {0, 90, true}, "degrees", "Within this it is found.")});
}

template <class A>
void Describe(A& a, MeasureLength& goal)
{
  EachNeeded(a, {Parameter("LengthMm", goal.lengthMm, taskLengths, "mm", "What it measures."),
                 Parameter("ToleranceMm", goal.toleranceMm, taskLengths, "mm", "Within this it is right.")});
  Each(a, {Parameter("From", goal.from, taskPlaces, "mm", "One end of it."),
           Parameter("To", goal.to, taskPlaces, "mm", "The other end.")});
}

template <class A>
void Describe(A& a, ReachTarget& goal)
{
  EachNeeded(a, {Parameter("Target", goal.target, taskPlaces, "mm", "Where the tip shall be."),
                 Parameter("RadiusMm", goal.radiusMm, taskLengths, "mm", "Within this it is reached.")});
  Each(a, {Parameter("ShowTip", goal.showTip, "Whether the tip may be marked in the image.")});
}

template <class A>
void Describe(A& a, GeometryKeys& geometry)
{
  EachNeeded(a, {Parameter("Dimensions", geometry.dimensions, {1, 1e6}, "", "Voxels."),
                 Parameter("Origin", geometry.origin, {}, "mm", "Centre of the first voxel."),
                 Parameter("Spacing", geometry.spacing, {0, 1e6, true}, "mm", "Of voxels."),
                 Parameter("DirectionI", geometry.directionI, {}, "", "Unit vector of the first index."),
                 Parameter("DirectionJ", geometry.directionJ, {}, "", "Of the second."),
                 Parameter("DirectionK", geometry.directionK, {}, "", "Of the third.")});
}

template <class A>
void Describe(A& a, BodyKeys& body)
{
  EachNeeded(a, {Parameter("File", body.file, "Without its folder."), Parameter("Checksum", body.checksum, "Of its content.")});
  a.MaybeObject("geometry", body.geometry, "Where the volume lies; scenes have none.");
}

template <class A>
void Describe(A& a, TaskKeys& task)
{
  a.Constant("schema", taskSchema);
  a.Value(Parameter("Name", task.name, "What it is called."), Presence::Needed);
  a.Value(Parameter("Instruction", task.instruction, "What the learner is told."));
  a.Value(Parameter("Hint", task.hint, "Whether the distance may be shown during an attempt."));
  a.Object("body", task.body, "What it was made for.", Presence::Needed);
  a.OneOf(task.goal, Form<PlaneKeys>{"findPlane", "Bring the image to a plane."},
          Form<MeasureLength>{"measureLength", "Measure with callipers."},
          Form<ReachTarget>{"reachTarget", "Bring a needle's tip to a place."});
}

Pose PoseOf(const PlaneKeys& plane)
{
  Pose pose = Pose::Identity();
  pose.linear() << plane.array, plane.beam.cross(plane.array), plane.beam;
  pose.translation() = plane.face;
  return pose;
}

ImageGeometry GeometryOf(const GeometryKeys& keys)
{
  ImageGeometry geometry;
  for (int axis = 0; axis < 3; ++axis) {
    const double count = keys.dimensions[axis];
    if (count != std::floor(count))
      RefuseTask("dimensions must be whole numbers");
    geometry.dimensions[static_cast<std::size_t>(axis)] = static_cast<int>(count);
  }
  geometry.origin = keys.origin;
  geometry.spacing = keys.spacing;
  geometry.direction << keys.directionI, keys.directionJ, keys.directionK;
  return geometry;
}

struct NoTaskContext {};

class TaskReader : public described::Reader<TaskReader, NoTaskContext> {
public:
  using Reader::Reader;
  template <class T>
  static void Validate(const T&)
  {
  }
  static void Validate(const PlaneKeys& plane)
  {
    if (!IsRotation(PoseOf(plane).linear()))
      RefuseTask("array and beam must be unit vectors at right angles");
  }
  static void Validate(const GeometryKeys& geometry) { GeometryOf(geometry).Check("the geometry"); }
  static void Validate(const BodyKeys& body)
  {
    if (!IsChecksum(body.checksum))
      RefuseTask("the checksum must be of 16 hexadecimal digits");
  }
  template <class T>
  static void Inherit(NoTaskContext&, T&)
  {
  }
};

class TaskWriter : public described::Writer<TaskWriter> {};

TaskKeys KeysOf(const ScanTask& task)
{
  TaskKeys keys{task.name, task.instruction, task.hint, {task.body.file, task.body.checksum, {}}, {}};
  if (const auto& geometry = task.body.geometry) {
    GeometryKeys& g = keys.body.geometry.emplace();
    g.dimensions = Vector3d(geometry->dimensions[0], geometry->dimensions[1], geometry->dimensions[2]);
    g.origin = geometry->origin;
    g.spacing = geometry->spacing;
    g.directionI = geometry->direction.col(0);
    g.directionJ = geometry->direction.col(1);
    g.directionK = geometry->direction.col(2);
  }
  if (const auto* plane = std::get_if<FindPlane>(&task.goal)) {
    const Pose& pose = plane->probeToWorld;
    keys.goal = PlaneKeys{*plane, pose.translation(), pose.linear().col(0), pose.linear().col(2)};
  } else if (const auto* measure = std::get_if<MeasureLength>(&task.goal))
    keys.goal = *measure;
  else
    keys.goal = std::get<ReachTarget>(task.goal);
  return keys;
}

ScanTask TaskOf(const TaskKeys& keys)
{
  ScanTask task{keys.name, keys.instruction, {keys.body.file, keys.body.checksum, {}}, keys.hint, {}};
  if (keys.body.geometry)
    task.body.geometry = GeometryOf(*keys.body.geometry);
  if (const auto* plane = std::get_if<PlaneKeys>(&keys.goal)) {
    FindPlane goal = plane->goal;
    goal.probeToWorld = PoseOf(*plane);
    task.goal = goal;
  } else if (const auto* measure = std::get_if<MeasureLength>(&keys.goal))
    task.goal = *measure;
  else
    task.goal = std::get<ReachTarget>(keys.goal);
  return task;
}

std::string SizeOf(const TaskBody& body)
{
  if (!body.geometry)
    return body.file;
  const auto& n = body.geometry->dimensions;
  return body.file + Format(" (%d x %d x %d)", n[0], n[1], n[2]);
}

void CheckPose(const Pose& pose)
{
  if (!pose.matrix().allFinite() || !IsRotation(pose.linear()))
    throw Error(Error::Kind::BadInput, "the pose of the answer is not rigid and finite");
}

// How far a pose is from the goal.
ScanScore ScoreOf(const FindPlane& goal, const Pose& pose)
{
  const Vector3d middle(0.0, 0.0, goal.depthMm);
  ScanScore score;
  score.distanceMm = (pose * middle - goal.probeToWorld * middle).norm();
  // A plane has no front: seen from behind it is the same one, mirrored.
  const Vector3d a = pose.linear().col(1), b = goal.probeToWorld.linear().col(1);
  score.degrees = std::atan2(a.cross(b).norm(), std::abs(a.dot(b))) * DegreesPerRadian;
  score.passed = score.distanceMm <= goal.distanceMm && score.degrees <= goal.degrees;
  return score;
}

ScanScore ScoreOf(const ReachTarget& goal, const Pose& pose)
{
  ScanScore score;
  score.distanceMm = (pose.translation() - goal.target).norm();
  score.passed = score.distanceMm <= goal.radiusMm;
  return score;
}

std::optional<ScanScore> ScoreOf(const ScanTask& task, const Pose& pose)
{
  CheckPose(pose);
  if (const auto* plane = std::get_if<FindPlane>(&task.goal))
    return ScoreOf(*plane, pose);
  if (const auto* target = std::get_if<ReachTarget>(&task.goal))
    return ScoreOf(*target, pose);
  return {};
}

} // namespace

std::string TaskBody::Complaint(const TaskBody& shown) const
{
  const std::string both = "the task was made for " + SizeOf(*this) + ", and " + SizeOf(shown) + " is shown";
  if (geometry.has_value() != shown.geometry.has_value() || (geometry && geometry->dimensions != shown.geometry->dimensions))
    return both;
  if (checksum != shown.checksum)
    return both + (file == shown.file ? "; its content is not the same any more" : "");
  if (geometry && !geometry->AgreesWith(*shown.geometry))
    return both + "; it lies elsewhere, or has other spacings, than when the task was made";
  return {};
}

void ScanTask::Check() const
{
  try {
    ScanTaskOf(ScanTaskText(*this));
  } catch (const Error& error) {
    throw Error(Error::Kind::InvalidParameter, error.what());
  }
}

ScanTask ScanTaskOf(const std::string& text, const std::string& name)
{
  const Json json = JsonPlace(name).Parse(text);
  NoTaskContext none;
  TaskKeys keys;
  TaskReader::Read(name, none, json, "", keys);
  return TaskOf(keys);
}

std::string ScanTaskText(const ScanTask& task)
{
  TaskKeys keys = KeysOf(task);
  return TaskWriter::Write(keys).dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

ScanTask ReadScanTask(const std::string& path)
{
  return ScanTaskOf(ReadTextFile(path, 1 << 20), path);
}

void WriteScanTask(const std::string& path, const ScanTask& task)
{
  task.Check();
  WriteTextFile(path, ScanTaskText(task));
}

struct ScanAttempt::Parts {
  ScanTask task;
  std::optional<double> start; // seconds
  std::optional<double> startMm;
  std::optional<ScanScore> result;

  double Taken(double seconds) const
  {
    if (!start)
      throw Error(Error::Kind::InvalidParameter, "no attempt is running");
    if (!(seconds >= *start) || !std::isfinite(seconds))
      throw Error(Error::Kind::InvalidParameter, "the time of the answer is before the start, or not finite");
    return seconds - *start;
  }

  ScanScore End(ScanScore score, double seconds)
  {
    score.seconds = seconds;
    score.startMm = startMm;
    result = score;
    start.reset();
    return score;
  }
};

ScanAttempt::ScanAttempt(ScanTask task, const TaskBody& shown) : parts_(std::make_unique<Parts>())
{
  task.Check();
  if (const std::string complaint = task.body.Complaint(shown); !complaint.empty())
    throw Error(Error::Kind::BadInput, complaint);
  parts_->task = std::move(task);
}

ScanAttempt ScanAttempt::Open(const std::string& path, const TaskBody& shown)
{
  return ScanAttempt(ReadScanTask(path), shown);
}

ScanAttempt::~ScanAttempt() = default;
ScanAttempt::ScanAttempt(ScanAttempt&&) noexcept = default;
ScanAttempt& ScanAttempt::operator=(ScanAttempt&&) noexcept = default;

ScanAttempt::Kind ScanAttempt::What() const
{
  return static_cast<Kind>(parts_->task.goal.index());
}
const std::string& ScanAttempt::Name() const
{
  return parts_->task.name;
}
const std::string& ScanAttempt::Instruction() const
{
  return parts_->task.instruction;
}
bool ScanAttempt::GivesHints() const
{
  return parts_->task.hint;
}
bool ScanAttempt::ShowsTip() const
{
  const auto* goal = std::get_if<ReachTarget>(&parts_->task.goal);
  return goal && goal->showTip;
}
bool ScanAttempt::IsRunning() const
{
  return parts_->start.has_value();
}

void ScanAttempt::Start(double seconds, const std::optional<Pose>& pose)
{
  CheckRange("the time of the start", seconds, -1e12, 1e12);
  std::optional<double> startMm;
  if (pose)
    if (const auto score = ScoreOf(parts_->task, *pose))
      startMm = score->distanceMm;
  parts_->startMm = startMm;
  parts_->start = seconds;
  parts_->result.reset();
}

void ScanAttempt::Cancel()
{
  parts_->start.reset();
}

std::optional<ScanScore> ScanAttempt::Hint(double seconds, const Pose& pose) const
{
  CheckPose(pose);
  if (!IsRunning() || !GivesHints())
    return {};
  auto score = ScoreOf(parts_->task, pose);
  if (score) {
    score->seconds = parts_->Taken(seconds);
    score->startMm = parts_->startMm;
  }
  return score;
}

ScanScore ScanAttempt::SubmitPose(double seconds, const Pose& pose)
{
  const double taken = parts_->Taken(seconds);
  const auto score = ScoreOf(parts_->task, pose);
  if (!score)
    throw Error(Error::Kind::InvalidParameter, "the task asks for a length, not for a pose");
  return parts_->End(*score, taken);
}

ScanScore ScanAttempt::SubmitLength(double seconds, double mm)
{
  const double taken = parts_->Taken(seconds);
  const auto* goal = std::get_if<MeasureLength>(&parts_->task.goal);
  if (!goal)
    throw Error(Error::Kind::InvalidParameter, "the task asks for a pose, not for a length");
  if (!(mm >= 0.0) || !std::isfinite(mm))
    throw Error(Error::Kind::BadInput, "the length of the answer is negative, or not finite");
  ScanScore score;
  score.distanceMm = std::abs(mm - goal->lengthMm);
  score.passed = score.distanceMm <= goal->toleranceMm;
  return parts_->End(score, taken);
}

const ScanTask* ScanAttempt::Solution() const
{
  return parts_->result ? &parts_->task : nullptr;
}

Attempt ScanAttempt::HistoryLine(const std::string& time, const std::string& trainee) const
{
  if (!parts_->result)
    throw Error(Error::Kind::InvalidParameter, "there is no answer yet");
  const ScanScore& result = *parts_->result;
  Attempt line;
  line.time = time;
  line.trainee = trainee;
  line.project = parts_->task.name + " (" + parts_->task.body.file + ")";
  line.seconds = result.seconds;
  line.scoreMm = line.worstMm = result.distanceMm;
  line.degrees = result.degrees;
  line.startMm = result.startMm.value_or(0.0);
  return line;
}

} // namespace echorama
