// SPDX-License-Identifier: BSD-3-Clause
// An edit is a copy of the state from before it. Copies are cheap (no voxels; chains of strokes are shared), comparing two is
// cheap as well, and nothing can be forgotten: whatever a setter changes, undo brings back. So no setter has an inverse, and
// the state after undoing is the one that was there, to the last bit.
//
// What is selected is not part of the state. It is tidied after each change of the state: volumes that went leave it, and a
// group is in it as a whole.
#include "Widgets/Session/AlignmentSession.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <cmath>
#include <utility>

namespace echorama {
namespace {

constexpr std::array<double, 3> White{1.0, 1.0, 1.0};

// The tints of further volumes: far apart, and light enough that grey levels stay readable through them.
constexpr std::array<std::array<double, 3>, 7> Tints{{{1.0, 1.0, 1.0},
                                                      {1.0, 0.72, 0.38},
                                                      {0.45, 0.78, 1.0},
                                                      {0.60, 0.92, 0.50},
                                                      {1.0, 0.58, 0.80},
                                                      {0.92, 0.90, 0.42},
                                                      {0.70, 0.64, 1.0}}};

[[noreturn]] void Refuse(const std::string& reason)
{
  throw Error(Error::Kind::InvalidParameter, reason);
}

void CheckPose(const Pose& pose, const char* what)
{
  if (!IsRotation(pose.linear()) || !pose.translation().allFinite() || pose.matrix().row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    Refuse(std::string("the ") + what + " is not rigid (a rotation, a translation, and 0 0 0 1 below)");
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

bool Named(const SessionState& state, const std::string& name, int except = 0)
{
  return std::any_of(state.volumes.begin(), state.volumes.end(),
                     [&](const SessionVolume& volume) { return volume.id != except && volume.name == name; });
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

/// One setter: an edit by itself, or a part of the one that is open. Taken back when the setter throws.
class AlignmentSession::Edit {
public:
  Edit(AlignmentSession& session, const std::string& label) : session_(session), before_(session.state_)
  {
    session_.Begin(label);
  }
  ~Edit()
  {
    if (!finished_) {
      session_.state_ = std::move(before_);
      session_.End();
    }
  }
  Edit(const Edit&) = delete;
  Edit& operator=(const Edit&) = delete;
  void Finish()
  {
    finished_ = true;
    session_.TidySelection();
    session_.End();
  }

private:
  AlignmentSession& session_;
  SessionState before_;
  bool finished_ = false;
};

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

bool AlignmentSession::Undo()
{
  if (Editing())
    throw Error(Error::Kind::NotPossible, "nothing can be undone during an edit");
  if (done_.empty())
    return false;
  Entry entry = std::move(done_.back());
  done_.pop_back();
  std::swap(state_, entry.state);
  undone_.push_back(std::move(entry));
  ++version_;
  TidySelection();
  return true;
}

bool AlignmentSession::Redo()
{
  if (Editing())
    throw Error(Error::Kind::NotPossible, "nothing can be redone during an edit");
  if (undone_.empty())
    return false;
  Entry entry = std::move(undone_.back());
  undone_.pop_back();
  std::swap(state_, entry.state);
  done_.push_back(std::move(entry));
  ++version_;
  TidySelection();
  return true;
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

void AlignmentSession::CheckNew(const SessionVolume& volume) const
{
  volume.geometry.Check(volume.name.empty() ? "the volume" : volume.name);
  CheckPose(volume.volumeToWorld, "pose");
  CheckColour(volume.colour);
  CheckUnit(volume.opacity, "opacity");
}

int AlignmentSession::Add(SessionVolume volume)
{
  CheckNew(volume);
  for (const SessionVolume& other : state_.volumes)
    if (!volume.file.empty() && other.file == volume.file)
      Refuse(volume.file + ": it is open already, as " + other.name);

  Edit edit(*this, "");
  if (volume.name.empty())
    volume.name = "volume";
  const std::string wanted = volume.name;
  for (int copy = 2; Named(state_, volume.name); ++copy)
    volume.name = wanted + " (" + std::to_string(copy) + ")";
  if (volume.colour == White) {
    // The first tint that is the rarest among the others: white for the first volume.
    const auto uses = [this](const std::array<double, 3>& tint) {
      return std::count_if(state_.volumes.begin(), state_.volumes.end(),
                           [&](const SessionVolume& other) { return other.colour == tint; });
    };
    volume.colour =
        *std::min_element(Tints.begin(), Tints.end(), [&](const auto& a, const auto& b) { return uses(a) < uses(b); });
  }
  volume.id = nextId_++;
  volume.group = 0;
  if (depth_ == 1)
    label_ = "Add " + volume.name;
  state_.volumes.push_back(std::move(volume));
  edit.Finish();
  return nextId_ - 1;
}

void AlignmentSession::Remove(int id)
{
  const std::string name = Volume(id).name;
  Edit edit(*this, "Remove " + name);
  auto& volumes = state_.volumes;
  volumes.erase(std::find_if(volumes.begin(), volumes.end(), [id](const SessionVolume& volume) { return volume.id == id; }));
  edit.Finish();
}

void AlignmentSession::SetPose(int id, const Pose& volumeToWorld)
{
  CheckPose(volumeToWorld, "pose");
  const std::string name = Volume(id).name;
  Edit edit(*this, "Move " + name);
  Volume(id).volumeToWorld = volumeToWorld;
  edit.Finish();
}

void AlignmentSession::SetName(int id, const std::string& name)
{
  Volume(id);
  if (name.empty())
    Refuse("a volume needs a name");
  if (Named(state_, name, id))
    Refuse("another volume has the name " + name);
  Edit edit(*this, "Rename " + Volume(id).name);
  Volume(id).name = name;
  edit.Finish();
}

void AlignmentSession::SetColour(int id, const std::array<double, 3>& rgb)
{
  CheckColour(rgb);
  const std::string name = Volume(id).name;
  Edit edit(*this, "Colour of " + name);
  Volume(id).colour = rgb;
  edit.Finish();
}

void AlignmentSession::SetOpacity(int id, double opacity)
{
  CheckUnit(opacity, "opacity");
  const std::string name = Volume(id).name;
  Edit edit(*this, "Opacity of " + name);
  Volume(id).opacity = opacity;
  edit.Finish();
}

void AlignmentSession::SetVisible(int id, bool visible)
{
  const std::string name = Volume(id).name;
  Edit edit(*this, (visible ? "Show " : "Hide ") + name);
  Volume(id).visible = visible;
  edit.Finish();
}

void AlignmentSession::AddStroke(int id, Stroke stroke)
{
  const SessionVolume& volume = Volume(id);
  const char* verb = stroke.brush.mode == BrushMode::Paint   ? "Paint "
                     : stroke.brush.mode == BrushMode::Carve ? "Carve "
                                                             : "Restore ";
  StrokeChain longer = Append(volume.strokes, std::move(stroke));
  Edit edit(*this, verb + volume.name);
  Volume(id).strokes = std::move(longer);
  edit.Finish();
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
  CheckPose(motion, "motion");
  if (selection_.empty() || motion.matrix() == Eigen::Matrix4d::Identity())
    return;
  const std::string label = selection_.size() == 1 ? "Move " + Volume(*selection_.begin()).name
                                                   : "Move " + std::to_string(selection_.size()) + " volumes";
  Edit edit(*this, label);
  for (const int id : selection_) {
    Pose moved = Composed(motion, Volume(id).volumeToWorld);
    CheckPose(moved, "pose"); // too far away to be a number
    Volume(id).volumeToWorld = moved;
  }
  edit.Finish();
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
  int highest = 0;
  for (const SessionVolume& volume : state_.volumes)
    highest = std::max(highest, volume.group);
  Edit edit(*this, "Group " + std::to_string(selection_.size()) + " volumes");
  for (const int id : selection_)
    Volume(id).group = highest + 1;
  edit.Finish();
  return highest + 1;
}

void AlignmentSession::UngroupSelection()
{
  Edit edit(*this, "Ungroup");
  for (const int id : selection_)
    Volume(id).group = 0;
  edit.Finish();
}

Eigen::Vector3d AlignmentSession::CentreOfRotation() const
{
  if (centre_)
    return *centre_;
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
  if (centre && !centre->allFinite())
    Refuse("the centre of rotation is not finite");
  centre_ = centre;
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
  for (SessionVolume& volume : state.volumes)
    volume.id = nextId_++;
  depth_ = 0;
  start_ = {};
  done_.clear();
  undone_.clear();
  selection_.clear();
  centre_.reset();
  state_ = std::move(state);
  ++version_;
}

void AlignmentSession::Replace(SessionState state, const std::string& label)
{
  for (const SessionVolume& volume : state.volumes)
    CheckNew(volume);
  for (SessionVolume& volume : state.volumes) {
    if (volume.id == 0)
      volume.id = nextId_++;
    nextId_ = std::max(nextId_, volume.id + 1);
  }
  Edit edit(*this, label);
  state_ = std::move(state);
  edit.Finish();
}

bool AlignmentSession::Remembers(int id) const
{
  const auto within = [id](const Entry& entry) { return entry.state.Find(id) != nullptr; };
  return state_.Find(id) || start_.Find(id) || std::any_of(done_.begin(), done_.end(), within) ||
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
