// SPDX-License-Identifier: BSD-3-Clause
// An edit is a copy of the state from before it. Copies are cheap (no voxels; chains of strokes are shared), comparing two is
// cheap as well, and nothing can be forgotten: whatever a setter changes, undo brings back. So no setter has an inverse, and
// the state after undoing is the one that was there, to the last bit.
//
// What is selected is not part of the state. It is tidied after each change of the state: volumes that went leave it, and a
// group is in it as a whole.
#include "Widgets/Session/AlignmentSession.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Widgets/Session/Tints.h"
#include <algorithm>
#include <cmath>
#include <utility>

namespace echorama {
namespace {

constexpr std::array<double, 3> White{1.0, 1.0, 1.0};

// Of results: another one than any of the tints, and as light.
constexpr std::array<double, 3> ResultTint{0.62, 1.0, 0.88};

[[noreturn]] void Refuse(const std::string& reason)
{
  throw Error(Error::Kind::InvalidParameter, reason);
}

void CheckUnit(double value, const char* what)
{
  if (!(value >= 0.0 && value <= 1.0))
    Refuse(std::string("the ") + what + " is " + std::to_string(value) + "; it must be in [0, 1]");
}

void CheckColour(const std::array<double, 3>& rgb)
{
  for (const double part : rgb)
    CheckUnit(part, "colour");
}

void CheckNew(const SessionVolume& volume)
{
  volume.geometry.Check(volume.name.empty() ? "the volume" : volume.name);
  CheckRigid(volume.volumeToWorld, "pose");
  CheckColour(volume.colour);
  CheckUnit(volume.opacity, "opacity");
}

bool Named(const SessionState& state, const std::string& name, int except = 0)
{
  return std::any_of(state.volumes.begin(), state.volumes.end(),
                     [&](const SessionVolume& volume) { return volume.id != except && volume.name == name; });
}

void CheckCentre(const std::optional<Eigen::Vector3d>& centre)
{
  if (centre && !centre->allFinite())
    Refuse("the centre of rotation is not finite");
}

// Strokes of one physical space in another.
StrokeChain Moved(const StrokeChain& chain, const Pose& motion)
{
  StrokeChain moved;
  for (Stroke& stroke : StrokesOf(chain)) {
    for (Eigen::Vector3d& point : stroke.pathMm)
      point = motion * point;
    moved = Append(moved, std::move(stroke));
  }
  return moved;
}

// Products of many rotations drift; long before anybody sees it they are made orthonormal again.
Pose Composed(const Pose& motion, const Pose& pose)
{
  Pose product = motion * pose;
  product.makeAffine();
  if (!IsRotation(product.linear(), 1e-12))
    product.linear() = Eigen::Quaterniond(product.linear()).normalized().toRotationMatrix();
  return product;
}

} // namespace

void CheckRigid(const Pose& pose, const char* what)
{
  if (!IsRotation(pose.linear()) || !pose.translation().allFinite() || pose.matrix().row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    Refuse(std::string("the ") + what + " is not rigid (a rotation, a translation, and 0 0 0 1 below)");
}

std::string VerbOf(BrushMode mode)
{
  std::string verb = NameOf(mode);
  if (!verb.empty())
    verb.front() = static_cast<char>(verb.front() - 'a' + 'A');
  return verb;
}

Placement PlacementOf(const SessionVolume& volume)
{
  const Eigen::Matrix3d R = volume.volumeToWorld.linear();
  Eigen::Vector3d angle;
  const double across = std::hypot(R(0, 0), R(0, 1));
  angle.y() = std::atan2(R(0, 2), across);
  if (across > 1e-9) {
    angle.x() = std::atan2(-R(1, 2), R(2, 2));
    angle.z() = std::atan2(-R(0, 1), R(0, 0));
  } else { // x and z turn about the same line: all of it is told as x
    angle.x() = std::atan2(R(2, 1), R(1, 1));
    angle.z() = 0.0;
  }
  return {volume.volumeToWorld * volume.geometry.Centre(), angle / RadiansPerDegree};
}

// One setter: an edit by itself, or a part of the one that is open. Taken back when it throws.
void AlignmentSession::Edit(const std::string& label, const std::function<void()>& change)
{
  SessionState before = state_;
  Begin(label);
  try {
    change();
  } catch (...) {
    state_ = std::move(before);
    End();
    throw;
  }
  TidySelection();
  End();
}

void AlignmentSession::EditOne(const std::string& verb, int id, const std::function<void(SessionVolume&)>& change)
{
  Edit(verb + " " + Volume(id).name, [&] { change(Volume(id)); });
}

void AlignmentSession::Begin(const std::string& label)
{
  if (depth_ == 0) {
    label_ = label;
    start_ = state_;
  }
  ++depth_;
}

bool AlignmentSession::End()
{
  if (depth_ == 0 || --depth_ > 0)
    return false;
  SessionState before = std::exchange(start_, {});
  if (before == state_)
    return false;
  done_.push_back({label_, std::move(before)});
  undone_.clear();
  ++version_;
  return true;
}

void AlignmentSession::Cancel()
{
  if (depth_ == 0)
    return;
  depth_ = 0;
  state_ = std::exchange(start_, {});
  TidySelection();
}

bool AlignmentSession::Step(std::vector<Entry>& from, std::vector<Entry>& to)
{
  if (Editing())
    throw Error(Error::Kind::NotPossible,
                std::string("nothing can be ") + (&from == &done_ ? "un" : "re") + "done during an edit");
  if (from.empty())
    return false;
  Entry entry = std::move(from.back());
  from.pop_back();
  std::swap(state_, entry.state);
  to.push_back(std::move(entry));
  ++version_;
  TidySelection();
  return true;
}

bool AlignmentSession::Undo()
{
  return Step(done_, undone_);
}

bool AlignmentSession::Redo()
{
  return Step(undone_, done_);
}

std::string AlignmentSession::UndoLabel() const
{
  return done_.empty() ? std::string() : done_.back().label;
}

std::string AlignmentSession::RedoLabel() const
{
  return undone_.empty() ? std::string() : undone_.back().label;
}

SessionVolume& AlignmentSession::Volume(int id)
{
  SessionVolume* volume = state_.Find(id);
  if (!volume)
    Refuse("there is no volume " + std::to_string(id));
  return *volume;
}

int AlignmentSession::Add(SessionVolume volume)
{
  CheckNew(volume);
  for (const SessionVolume& other : state_.volumes)
    if (!volume.file.empty() && other.file == volume.file)
      Refuse(volume.file + ": it is open already, as " + other.name);

  Edit("", [&] {
    if (volume.name.empty())
      volume.name = "volume";
    const std::string wanted = volume.name;
    for (int copy = 2; Named(state_, volume.name); ++copy)
      volume.name = wanted + " (" + std::to_string(copy) + ")";
    if (volume.colour == White && volume.madeOf) {
      volume.colour = ResultTint;
    } else if (volume.colour == White) {
      // The first tint that is the rarest among the others.
      const std::vector<Tint>& tints = TintSetOf(tints_).tints;
      const auto uses = [this](const std::array<double, 3>& tint) {
        return std::count_if(state_.volumes.begin(), state_.volumes.end(),
                             [&](const SessionVolume& other) { return other.colour == tint; });
      };
      volume.colour =
          *std::min_element(tints.begin(), tints.end(), [&](const auto& a, const auto& b) { return uses(a) < uses(b); });
    }
    volume.id = nextId_++;
    volume.edition = 0;
    volume.group = 0;
    if (depth_ == 1)
      label_ = "Add " + volume.name;
    state_.volumes.push_back(std::move(volume));
  });
  return nextId_ - 1;
}

void AlignmentSession::Remove(int id)
{
  EditOne("Remove", id,
          [this](SessionVolume& volume) { state_.volumes.erase(state_.volumes.begin() + (&volume - state_.volumes.data())); });
}

void AlignmentSession::Remake(int id, const ImageGeometry& geometry, MadeOf madeOf,
                              const std::function<void(const SessionVolume&)>& hold)
{
  const SessionVolume& before = Volume(id);
  if (!before.madeOf)
    Refuse(before.name + ": it was not made of other volumes");
  geometry.Check(before.name);
  for (const MadeOf::Source& source : madeOf.sources)
    if (source.name == before.name)
      Refuse(before.name + ": it cannot be made of itself");
  EditOne("Make", id, [&](SessionVolume& volume) {
    const Pose motion = std::exchange(volume.volumeToWorld, Pose::Identity());
    if (motion.matrix() != Eigen::Matrix4d::Identity()) {
      volume.strokes = Moved(volume.strokes, motion);
      for (Landmark& landmark : volume.landmarks)
        landmark.position = motion * landmark.position;
    }
    volume.geometry = geometry;
    volume.file.clear();
    volume.madeOf = std::make_shared<const MadeOf>(std::move(madeOf));
    volume.edition = ++lastEdition_;
    if (hold)
      hold(volume);
  });
}

void AlignmentSession::SetFile(int id, const std::string& file)
{
  const int edition = Volume(id).edition;
  for (const SessionVolume& other : state_.volumes)
    if (other.id != id && !file.empty() && other.file == file)
      Refuse(file + ": it is the file of " + other.name);
  const auto tell = [&](SessionState& state) {
    if (SessionVolume* volume = state.Find(id); volume && volume->edition == edition)
      volume->file = file;
  };
  tell(state_);
  tell(start_);
  for (std::vector<Entry>* entries : {&done_, &undone_})
    for (Entry& entry : *entries)
      tell(entry.state);
}

void AlignmentSession::SetPose(int id, const Pose& volumeToWorld)
{
  CheckRigid(volumeToWorld, "pose");
  EditOne("Move", id, [&](SessionVolume& volume) { volume.volumeToWorld = volumeToWorld; });
}

void AlignmentSession::SetPlacement(int id, const Placement& placement)
{
  const SessionVolume& volume = Volume(id);
  const Placement now = PlacementOf(volume);
  if (now.middle == placement.middle && now.degrees == placement.degrees)
    return;
  Pose pose = volume.volumeToWorld;
  if (now.degrees != placement.degrees) {
    const Eigen::Vector3d angle = placement.degrees * RadiansPerDegree;
    pose.linear() =
        (Eigen::AngleAxisd(angle.x(), Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(angle.y(), Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(angle.z(), Eigen::Vector3d::UnitZ()))
            .toRotationMatrix();
  }
  pose.translation() = placement.middle - pose.linear() * volume.geometry.Centre();
  SetPose(id, pose);
}

void AlignmentSession::SetName(int id, const std::string& name)
{
  Volume(id);
  if (name.empty())
    Refuse("a volume needs a name");
  if (Named(state_, name, id))
    Refuse("another volume has the name " + name);
  EditOne("Rename", id, [&](SessionVolume& volume) {
    const std::string before = std::exchange(volume.name, name);
    for (SessionVolume& result : state_.volumes) { // results know their sources by name
      const auto isIt = [&before](const MadeOf::Source& source) { return source.name == before; };
      if (!result.madeOf || std::none_of(result.madeOf->sources.begin(), result.madeOf->sources.end(), isIt))
        continue;
      MadeOf renamed = *result.madeOf;
      std::find_if(renamed.sources.begin(), renamed.sources.end(), isIt)->name = name;
      result.madeOf = std::make_shared<const MadeOf>(std::move(renamed));
    }
  });
}

void AlignmentSession::SetColour(int id, const std::array<double, 3>& rgb)
{
  CheckColour(rgb);
  EditOne("Colour of", id, [&](SessionVolume& volume) { volume.colour = rgb; });
}

void AlignmentSession::SetTints(const std::string& set)
{
  const std::vector<Tint>&before = TintSetOf(tints_).tints, &after = TintSetOf(set).tints;
  Edit("Colours", [&] {
    for (SessionVolume& volume : state_.volumes)
      if (const auto worn = std::find(before.begin(), before.end(), volume.colour); worn != before.end())
        volume.colour = after[static_cast<std::size_t>(worn - before.begin()) % after.size()];
  });
  tints_ = set;
}

void AlignmentSession::SetOpacity(int id, double opacity)
{
  CheckUnit(opacity, "opacity");
  EditOne("Opacity of", id, [&](SessionVolume& volume) { volume.opacity = opacity; });
}

void AlignmentSession::SetVisible(int id, bool visible)
{
  EditOne(visible ? "Show" : "Hide", id, [&](SessionVolume& volume) { volume.visible = visible; });
}

void AlignmentSession::AddStroke(int id, Stroke stroke)
{
  const std::string verb = VerbOf(stroke.brush.mode);
  const StrokeChain longer = Append(Volume(id).strokes, std::move(stroke));
  EditOne(verb, id, [&](SessionVolume& volume) { volume.strokes = longer; });
}

void AlignmentSession::Select(int id, bool on, bool alone)
{
  const SessionVolume& chosen = Volume(id);
  if (alone)
    selection_.clear();
  for (const SessionVolume& volume : state_.volumes)
    if (volume.id == id || (chosen.group != 0 && volume.group == chosen.group)) {
      if (on)
        selection_.insert(volume.id);
      else
        selection_.erase(volume.id);
    }
}

void AlignmentSession::SelectAll()
{
  for (const SessionVolume& volume : state_.volumes)
    selection_.insert(volume.id);
}

void AlignmentSession::SelectNone()
{
  selection_.clear();
}

void AlignmentSession::InvertSelection()
{
  std::set<int> others;
  for (const SessionVolume& volume : state_.volumes)
    if (selection_.count(volume.id) == 0)
      others.insert(volume.id);
  selection_ = std::move(others);
}

void AlignmentSession::MoveSelection(const Pose& motion)
{
  CheckRigid(motion, "motion");
  if (selection_.empty() || motion.matrix() == Eigen::Matrix4d::Identity())
    return;
  Edit(LabelOf("Move"), [&] {
    for (const int id : selection_) {
      const Pose moved = Composed(motion, Volume(id).volumeToWorld);
      CheckRigid(moved, "pose"); // too far away to be a number
      Volume(id).volumeToWorld = moved;
    }
  });
}

std::string AlignmentSession::LabelOf(const char* verb) const
{
  return std::string(verb) + " " +
         (selection_.size() == 1 ? state_.Find(*selection_.begin())->name : std::to_string(selection_.size()) + " volumes");
}

AlignmentSession::Grip AlignmentSession::TakeHold() const
{
  Grip grip{{}, CentreOfRotation(), state_.centre.has_value()};
  for (const SessionVolume& volume : state_.volumes)
    if (selection_.count(volume.id) != 0)
      grip.volumes.emplace_back(volume.id, volume.volumeToWorld);
  return grip;
}

void AlignmentSession::MoveHeld(const Grip& grip, const Pose& motion)
{
  Edit(LabelOf("Move"), [&] {
    for (const auto& [id, start] : grip.volumes)
      if (SessionVolume* volume = state_.Find(id)) {
        volume->volumeToWorld = Composed(motion, start);
        CheckRigid(volume->volumeToWorld, "pose");
      }
    if (grip.isCentreChosen)
      SetCentreOfRotation(motion * grip.centre);
  });
}

void AlignmentSession::RotateSelection(const Eigen::Vector3d& degrees)
{
  if (!degrees.isZero(0.0))
    MoveSelection(MotionAbout(CentreOfRotation(), degrees * RadiansPerDegree, Eigen::Vector3d::Zero()));
}

int AlignmentSession::GroupSelection()
{
  if (selection_.size() < 2)
    throw Error(Error::Kind::NotPossible, "a group needs at least two selected volumes");
  int group = 0;
  bool one = true; // are they a group already?
  for (const SessionVolume& volume : state_.volumes)
    if (selection_.count(volume.id)) {
      group = group == 0 ? volume.group : group;
      one = one && volume.group != 0 && volume.group == group;
    }
  if (one)
    return group;
  std::set<int> taken;
  for (const SessionVolume& volume : state_.volumes)
    taken.insert(volume.group);
  group = NextNumber(taken);
  Edit("Group " + std::to_string(selection_.size()) + " volumes", [&] {
    for (const int id : selection_)
      Volume(id).group = group;
  });
  return group;
}

void AlignmentSession::UngroupSelection()
{
  Edit("Ungroup", [this] {
    for (const int id : selection_)
      Volume(id).group = 0;
  });
}

Eigen::Vector3d AlignmentSession::CentreOfRotation() const
{
  if (state_.centre)
    return *state_.centre;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (const SessionVolume& volume : state_.volumes)
    if (selection_.empty() || selection_.count(volume.id)) {
      sum += volume.volumeToWorld * volume.geometry.Centre();
      ++count;
    }
  return count > 0 ? Eigen::Vector3d(sum / count) : sum;
}

void AlignmentSession::SetCentreOfRotation(const std::optional<Eigen::Vector3d>& centre)
{
  CheckCentre(centre);
  Edit("Choose the centre of rotation", [&] { state_.centre = centre; });
}

void AlignmentSession::ForgetHistory()
{
  if (Editing())
    throw Error(Error::Kind::NotPossible, "an edit has not ended yet");
  if (done_.empty() && undone_.empty())
    return;
  done_.clear();
  undone_.clear();
  ++version_;
}

void AlignmentSession::Reset(SessionState state)
{
  for (const SessionVolume& volume : state.volumes)
    CheckNew(volume);
  CheckCentre(state.centre);
  for (SessionVolume& volume : state.volumes) {
    volume.id = nextId_++;
    volume.edition = 0;
  }
  depth_ = 0;
  start_ = {};
  done_.clear();
  undone_.clear();
  selection_.clear();
  state_ = std::move(state);
  ++version_;
}

void AlignmentSession::Replace(SessionState state, const std::string& label)
{
  for (const SessionVolume& volume : state.volumes)
    CheckNew(volume);
  CheckCentre(state.centre);
  for (SessionVolume& volume : state.volumes) {
    if (volume.id == 0) {
      volume.id = nextId_++;
      volume.edition = 0;
    }
    nextId_ = std::max(nextId_, volume.id + 1);
    lastEdition_ = std::max(lastEdition_, volume.edition);
  }
  Edit(label, [&] { state_ = std::move(state); });
}

bool AlignmentSession::Remembers(int id, int edition) const
{
  const auto has = [id, edition](const SessionState& state) {
    const SessionVolume* volume = state.Find(id);
    return volume && volume->edition == edition;
  };
  const auto within = [&has](const Entry& entry) { return has(entry.state); };
  return has(state_) || has(start_) || std::any_of(done_.begin(), done_.end(), within) ||
         std::any_of(undone_.begin(), undone_.end(), within);
}

void AlignmentSession::TidySelection()
{
  std::set<int> kept, groups;
  for (const SessionVolume& volume : state_.volumes)
    if (selection_.count(volume.id)) {
      kept.insert(volume.id);
      if (volume.group != 0)
        groups.insert(volume.group);
    }
  for (const SessionVolume& volume : state_.volumes)
    if (groups.count(volume.group))
      kept.insert(volume.id);
  selection_ = std::move(kept);
}

} // namespace echorama
