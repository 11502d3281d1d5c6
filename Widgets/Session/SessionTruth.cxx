// SPDX-License-Identifier: BSD-3-Clause
// Points are drawn when a truth comes, and the score is computed when somebody asks for it after a change: a drag that nobody
// scores costs nothing.
#include "Widgets/Session/SessionTruth.h"
#include "Core/Base/Error.h"
#include "Widgets/Session/AlignmentSession.h"
#include "Widgets/Session/ProjectFile.h"
#include "Widgets/Session/ProjectVolumes.h"
#include <limits>

namespace echorama {

void SessionTruth::Read(const std::string& path, const SessionState& state, const PointsOf& pointsOf)
{
  SessionTruth read;
  read.poses_ = ReadPoses(path);
  read.fixed_ = fixed_;
  for (const SessionVolume& volume : state.volumes)
    read.Match(volume, pointsOf);
  if (read.Empty())
    throw Error(Error::Kind::BadInput, path + ": it names none of the volumes");
  read.file_ = ResolvedPath(path);
  *this = std::move(read);
}

void SessionTruth::Match(const SessionVolume& volume, const PointsOf& pointsOf)
{
  if (const std::optional<Pose> truth = PoseAmong(poses_, volume))
    Set(volume, *truth, pointsOf);
}

void SessionTruth::Set(const SessionVolume& volume, const Pose& volumeToWorld, const PointsOf& pointsOf)
{
  CheckRigid(volumeToWorld, "truth");
  score_.Set(volume.id, volume.name, volume.geometry.Moved(volumeToWorld), pointsOf(volume.id));
  truths_[volume.id] = volumeToWorld;
  Outdate();
}

void SessionTruth::SetByHand(const SessionVolume& volume, const Pose& volumeToWorld, const PointsOf& pointsOf)
{
  Set(volume, volumeToWorld, pointsOf);
  byHand_.insert(volume.id);
}

std::map<std::string, Pose> SessionTruth::ByHand(const SessionState& state) const
{
  std::map<std::string, Pose> truths;
  for (const SessionVolume& volume : state.volumes)
    if (byHand_.count(volume.id) != 0)
      truths[volume.name] = *Find(volume.id);
  return truths;
}

void SessionTruth::Clear()
{
  const int fixed = fixed_;
  *this = {};
  fixed_ = fixed;
}

const Pose* SessionTruth::Find(int id) const
{
  const auto truth = truths_.find(id);
  return truth == truths_.end() ? nullptr : &truth->second;
}

void SessionTruth::SetFixed(int id)
{
  if (id > 0 && !Find(id))
    throw Error(Error::Kind::InvalidParameter, "volume " + std::to_string(id) + " has no truth and cannot be the fixed one");
  fixed_ = id;
  Outdate();
}

int SessionTruth::Fixed(const SessionState& state) const
{
  if (fixed_ > 0 && state.Find(fixed_) && Find(fixed_))
    return fixed_;
  for (const SessionVolume& volume : state.volumes)
    if (Find(volume.id))
      return volume.id;
  return -1;
}

std::string SessionTruth::FixedName(const SessionState& state) const
{
  const SessionVolume* fixed = state.Find(fixed_);
  return fixed ? fixed->name : std::string();
}

void SessionTruth::SetFixedName(const std::string& name, const SessionState& state)
{
  fixed_ = -1;
  for (const SessionVolume& volume : state.volumes)
    if (volume.name == name)
      fixed_ = volume.id;
  Outdate();
}

const LiveScoreResult* SessionTruth::Score(const SessionState& state) const
{
  if (!isCurrent_) {
    result_.reset();
    isCurrent_ = true;
    std::map<int, ImageGeometry> aligned;
    for (const SessionVolume& volume : state.volumes)
      if (Find(volume.id))
        aligned[volume.id] = volume.geometry.Moved(volume.volumeToWorld);
    if (aligned.size() >= 2)
      result_ = score_.Update(aligned, Fixed(state));
  }
  return result_ ? &*result_ : nullptr;
}

double SessionTruth::Mean(const SessionState& state) const
{
  const LiveScoreResult* score = Score(state);
  return score ? score->mean : std::numeric_limits<double>::quiet_NaN();
}

double SessionTruth::MeanOf(int id, const SessionState& state) const
{
  const LiveScoreResult* score = Score(state);
  const int index = score ? score->IndexOf(id) : -1;
  return index >= 0 ? score->volumes[static_cast<std::size_t>(index)].mean : std::numeric_limits<double>::quiet_NaN();
}

double SessionTruth::DegreesOf(int id, const SessionState& state) const
{
  const LiveScoreResult* score = Score(state);
  const int index = score ? score->IndexOf(id) : -1;
  return index >= 0 ? score->degrees[static_cast<std::size_t>(index)] : std::numeric_limits<double>::quiet_NaN();
}

} // namespace echorama
