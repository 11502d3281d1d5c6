// SPDX-License-Identifier: BSD-3-Clause
// An image is made when something has changed that it depends on, and no more often than a screen shows.
#include "Scan.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Redraw.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <vtkPolyData.h>

namespace echorama {

namespace {

constexpr double FrameSeconds = 1.0 / 60.0, LeastContact = 0.02;
constexpr double LiftedMm = -0.5, FarMm = 2.0;     ///< off the skin: held there, or by what a tracker says
constexpr double JumpMm = 40.0, JumpWithin = 0.25; ///< faster than a hand
constexpr double JumpShownSeconds = 1.5;
constexpr int RestMs = 30; ///< for what a hand wants meanwhile
constexpr double MostTilt = 60.0, MostPressMm = 20.0, MostLiftMm = -50.0;

} // namespace

Scan::Scan(QObject* parent) : QObject(parent), latencyMs_(std::numeric_limits<double>::quiet_NaN())
{
  redraw_ = new Redraw(this, [this] { MakeNow(); });
  clock_.start();
}

Scan::~Scan() = default;

void Scan::SetSubject(Subject subject)
{
  SetFrozen(false); // while the controls are still those of the body that was there
  subject_ = std::move(subject);
  scanner_.SetInputs(subject_.volumes, subject_.tissue);
  cine_.Clear();
  cineIndex_ = -1;
  number_ = 0;
  failure_.clear();
  badPose_.clear();
  walk_ = subject_.mesh ? std::make_unique<SkinWalk>(subject_.mesh) : nullptr;
  emit SubjectChanged();
  emit ControlsChanged(); // what an image is made from goes with it
  if (!subject_.IsEmpty())
    PlaceAtTop();
}

// Where it was scanned from, if that is known; else in the middle of the side that is asked for, of a patient who lies on the
// back the front.
void Scan::PlaceAtTop()
{
  const bool isKnown = subject_.start && subject_.up.isZero();
  up_ = isKnown                 ? Eigen::Vector3d(-subject_.start->linear().col(2))
        : !subject_.up.isZero() ? subject_.up.normalized()
                                : Eigen::Vector3d(-Eigen::Vector3d::UnitY());
  const Eigen::Vector3d across = isKnown                   ? Eigen::Vector3d(subject_.start->linear().col(0))
                                 : std::fabs(up_[0]) > 0.9 ? Eigen::Vector3d::UnitY()
                                                           : Eigen::Vector3d::UnitX();
  hold_ = {};
  if (!walk_) {
    TakePose(subject_.start.value_or(Pose::Identity()));
    return;
  }
  if (isFollowing_)
    return;
  double box[6];
  subject_.skin->GetBounds(box);
  const Eigen::Vector3d middle(0.5 * (box[0] + box[1]), 0.5 * (box[2] + box[3]), 0.5 * (box[4] + box[5]));
  const double away = Eigen::Vector3d(box[1] - box[0], box[3] - box[2], box[5] - box[4]).norm() + 1.0;
  const auto hit = isKnown ? std::nullopt : subject_.mesh->FirstHit(middle + away * up_, -up_);
  walk_->PutNearest(isKnown ? subject_.start->translation() : (middle + away * up_).eval());
  walk_->Put(hit ? hit->place : walk_->Place(), across);
  Moved();
}

void Scan::Restart()
{
  SetFrozen(false);
  cine_.Clear();
  PlaceAtTop();
  MakeNow();
}

void Scan::Moved()
{
  Pose pose = walk_->PoseOf(hold_);
  if (turned_)
    pose.linear() = *turned_;
  TakePose(pose);
}

void Scan::TakePose(const Pose& pose)
{
  probeToWorld_ = pose;
  emit ProbeMoved();
  refinement_ = 0;
  if (!isFrozen_)
    Ask();
}

void Scan::Slide(double alongMm, double acrossMm)
{
  if (!CanWalk())
    return;
  walk_->Step(alongMm, acrossMm);
  Moved();
}

void Scan::SlideInWorld(const Eigen::Vector3d& by)
{
  if (!CanWalk())
    return;
  const Eigen::Vector3d x = walk_->Heading(), y = -walk_->Normal().cross(x);
  Slide(by.dot(x), by.dot(y));
}

void Scan::PlaceWhereHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction)
{
  if (CanWalk() && walk_->PutWhereHit(origin, direction))
    Moved();
}

void Scan::Hold(double tiltDegrees, double rockDegrees)
{
  if (!CanWalk())
    return;
  const double most = (RadiansPerDegree * MostTilt);
  hold_.tilt = std::clamp(hold_.tilt + (RadiansPerDegree * tiltDegrees), -most, most);
  hold_.rock = std::clamp(hold_.rock + (RadiansPerDegree * rockDegrees), -most, most);
  Moved();
}

void Scan::Rotate(double degrees)
{
  if (!CanWalk())
    return;
  walk_->Turn((RadiansPerDegree * degrees));
  Moved();
}

void Scan::Press(double mm)
{
  if (!CanWalk())
    return;
  hold_.pressMm = std::clamp(hold_.pressMm + mm, MostLiftMm, MostPressMm);
  Moved();
}

void Scan::Straighten()
{
  if (!CanWalk())
    return;
  hold_ = {};
  Moved();
}

void Scan::Follow(const Eigen::Matrix4d& matrix)
{
  const double now = 1e-9 * static_cast<double>(clock_.nsecsElapsed());
  isFollowing_ = true;
  Pose pose;
  pose.matrix() = matrix;
  const bool isPose = matrix.allFinite() && matrix.row(3) == Eigen::RowVector4d(0, 0, 0, 1) && IsRotation(pose.linear());
  const QString before = badPose_;
  badPose_ = isPose
                 ? QString()
                 : tr("The pose that came is %1: it is not shown").arg(matrix.allFinite() ? tr("not rigid") : tr("not finite"));
  if (badPose_ != before)
    emit StateChanged();
  if (!isPose)
    return;
  stoppedSeconds_ = -1.0;
  const double moved = (pose.translation() - probeToWorld_.translation()).norm();
  if (moved > JumpMm && now - followedAt_ < JumpWithin) {
    jumpMm_ = moved;
    jumpAt_ = now;
  }
  followedAt_ = now;
  if (pose.matrix() != probeToWorld_.matrix() || before != badPose_)
    TakePose(pose);
}

void Scan::Turn(const Eigen::Matrix3d& probeToWorld)
{
  if (!CanWalk() || !probeToWorld.allFinite() || !IsRotation(probeToWorld))
    return;
  SetStopped(-1.0);
  if (turned_ == probeToWorld)
    return;
  turned_ = probeToWorld;
  walk_->Put(walk_->Place(), probeToWorld.col(0)); // so that it slides along its array
  Moved();
}

void Scan::StopFollowing()
{
  if (!isFollowing_ && !turned_)
    return;
  isFollowing_ = false;
  turned_.reset();
  stoppedSeconds_ = -1.0;
  badPose_.clear();
  followedAt_ = jumpAt_ = -1e9;
  if (walk_) {
    const Eigen::Vector3d across = probeToWorld_.linear().col(0);
    walk_->PutNearest(probeToWorld_.translation());
    walk_->Put(walk_->Place(), across);
    hold_ = {};
    Moved();
  }
  emit StateChanged();
}

void Scan::SetStopped(double seconds)
{
  const bool changed = (seconds >= 0.0) != (stoppedSeconds_ >= 0.0) || std::fabs(seconds - stoppedSeconds_) > 0.05;
  stoppedSeconds_ = seconds;
  if (changed)
    emit StateChanged();
}

void Scan::SetControl(const char* name, const std::string& text)
{
  if (isFrozen_)
    return; // the image is of then
  try {
    scanner_.Set(name, text);
  } catch (const Error& error) {
    emit Said({Message::Warning, QString::fromUtf8(error.what()), {}});
    return;
  }
  emit ControlsChanged();
  refinement_ = 0;
  Ask();
}

void Scan::SetShowInvented(bool shown)
{
  showsInvented_ = shown;
  isFrozen_ ? ShowCine(cineIndex_) : Ask();
}

void Scan::SetFrozen(bool frozen)
{
  if (frozen == isFrozen_)
    return;
  isFrozen_ = frozen;
  if (frozen && !isReplay_)
    settingsBefore_ = scanner_.Settings();
  cineIndex_ = frozen ? cine_.Count() - 1 : -1;
  emit FrozenChanged(frozen);
  if (!frozen && !subject_.IsEmpty()) {
    if (isReplay_)
      cine_ = CineLoop();
    isReplay_ = false;
    scanner_.Take(*settingsBefore_); // a look back may have brought others
    emit ControlsChanged();
    Ask();
  }
}

void Scan::ShowCine(int index)
{
  if (!isFrozen_ || index < 0 || index >= cine_.Count())
    return;
  cineIndex_ = index;
  Make(cine_.At(index), false);
}

void Scan::Replay(const std::vector<ScanFrame>& frames)
{
  SetFrozen(false);
  settingsBefore_ = scanner_.Settings();
  cine_ = CineLoop(Unlimited, frames.size());
  for (const ScanFrame& frame : frames)
    cine_.Add(frame);
  isReplay_ = true;
  SetFrozen(true);
}

bool Scan::IsInAir() const
{
  if (!walk_ || subject_.tissue) // a scene says itself what touches the probe
    return false;
  if (!isFollowing_)
    return hold_.pressMm < LiftedMm;
  const auto nearest = subject_.mesh->NearestTo(probeToWorld_.translation());
  if (!nearest)
    return false;
  const Eigen::Vector3d away = probeToWorld_.translation() - subject_.mesh->PointAt(nearest->place);
  return nearest->distanceMm > FarMm && away.dot(subject_.mesh->NormalAt(nearest->place)) > 0.0;
}

void Scan::Ask()
{
  if (subject_.IsEmpty())
    return;
  const double now = 1e-9 * static_cast<double>(clock_.nsecsElapsed());
  if (askedAt_ == 0.0)
    askedAt_ = now;
  redraw_->Ask(static_cast<int>(1000.0 * std::max(0.0, frame_.seconds + FrameSeconds - now)));
}

void Scan::MakeNow()
{
  redraw_->Stop();
  if (subject_.IsEmpty() || isFrozen_)
    return;
  ScanFrame frame;
  frame.seconds = 1e-9 * static_cast<double>(clock_.nsecsElapsed());
  frame.probeToWorld = probeToWorld_;
  frame.number = ++number_;
  frame.isInAir = IsInAir();
  if (scanner_.IsAcoustic())
    Refine();
  frame.settings = scanner_.Settings();
  Make(frame, true);
}

// The acoustic model is slow: while the probe moves its picture is coarse, and gets better from frame to frame when it rests.
void Scan::Refine()
{
  scanner_.Set("Refinement", std::to_string(refinement_));
  if (refinement_ + 1 < LiveScanner::Refinements) {
    refinement_++;
    redraw_->Ask(RestMs);
  }
}

void Scan::Make(ScanFrame frame, bool isNew)
{
  const QString before = State();
  failure_.clear();
  try {
    scanner_.Make(frame);
    picture_ = scanner_.Picture(showsInvented_);
    if (frame.isInAir)
      picture_.image.fill(Qt::black); // all of the sound comes back from the air
  } catch (const Error& error) {
    failure_ = QString::fromUtf8(error.what());
  }
  frame_ = frame;
  if (isNew) {
    if (!HasFailed())
      cine_.Add(frame);
    madeAt_.push_back(frame.seconds);
    while (madeAt_.front() < frame.seconds - 1.0)
      madeAt_.pop_front();
  }
  emit FrameMade();
  if (isNew && askedAt_ > 0.0)
    latencyMs_ = 1e3 * (1e-9 * static_cast<double>(clock_.nsecsElapsed()) - askedAt_);
  askedAt_ = 0.0;
  if (State() != before)
    emit StateChanged();
}

double Scan::FramesPerSecond() const
{
  const double now = 1e-9 * static_cast<double>(clock_.nsecsElapsed());
  int count = 0;
  for (double at : madeAt_)
    count += at > now - 1.0;
  return count;
}

bool Scan::IsStale() const
{
  return !isFrozen_ && (stoppedSeconds_ >= 0.0 || !badPose_.isEmpty() || !failure_.isEmpty());
}

QString Scan::State() const
{
  if (subject_.IsEmpty())
    return tr("Nothing is open");
  if (!failure_.isEmpty())
    return failure_;
  if (!isFrozen_) {
    if (stoppedSeconds_ >= 0.0)
      return tr("The tracker has stopped: this was %1 s ago").arg(stoppedSeconds_, 0, 'f', 1);
    if (!badPose_.isEmpty())
      return badPose_;
    if (1e-9 * static_cast<double>(clock_.nsecsElapsed()) - jumpAt_ < JumpShownSeconds)
      return tr("The pose jumped by %1 mm: faster than a hand").arg(jumpMm_, 0, 'f', 0);
    if (!walk_ && !isFollowing_)
      return tr("There is no skin to scan on: %1").arg(subject_.whyNoSkin);
  }
  if (frame_.isInAir || scanner_.ContactShare() < LeastContact)
    return tr("No contact: air between probe and skin");
  if (scanner_.State() == vtkUltrasoundLiveImage::NO_VOLUME)
    return subject_.tissue ? tr("This is a scene: there are no volumes to make the image from")
                           : tr("These are volumes: there is no scene to make the image from");
  if (scanner_.State() == vtkUltrasoundLiveImage::OUTSIDE)
    return subject_.tissue ? tr("No body under the probe") : tr("No volume under the probe");
  return {};
}

} // namespace echorama
