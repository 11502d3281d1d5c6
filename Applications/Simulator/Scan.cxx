// SPDX-License-Identifier: BSD-3-Clause
// An image is made when something has changed that it depends on, and no more often than a screen shows.
#include "Scan.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Filters/Live/LiveProbe.h"
#include "Job.h"
#include "PressedStates.h"
#include "Redraw.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>
#include <vtkPolyData.h>

namespace echorama {

namespace {

constexpr double FrameSeconds =
    1.0 / 120.0; ///< from image to image, at least: half of what a tracker of 60 Hz needs, whose poses come unevenly
constexpr double LeastContact = 0.02;
constexpr double LiftedMm = -0.5, FarMm = 2.0;     ///< off the skin: held there, or by what a tracker says
constexpr double JumpMm = 40.0, JumpWithin = 0.25; ///< faster than a hand
constexpr double JumpShownSeconds = 1.5;
constexpr int RestMs = 30;                                                                   ///< for what a hand wants meanwhile
constexpr double DepthStepMm = 10.0, LeastDepthMm = 20.0, BelowMm = 1.0, FarAwayMm = 2000.0; ///< of a depth that is chosen
constexpr double TrackedPressMm = 0.1;                                                       ///< each is another set of controls
constexpr double MostTilt = 60.0, MostPressMm = 20.0, MostLiftMm = -50.0;

} // namespace

Scan::Scan(QObject* parent) : QObject(parent), latencyMs_(std::numeric_limits<double>::quiet_NaN())
{
  redraw_ = new Redraw(this, [this] { MakeNow(); });
  clock_.start();
  scanner_.BeforeUse([this] {
    if (!slow_)
      return;
    StopSlow(); // it is begun anew
    refinement_ = 0;
    Ask();
  });
}

Scan::~Scan()
{
  StopSlow(); // before the scanner that it works with
}

void Scan::SetSubject(Subject subject)
{
  StopSlow();
  SetFrozen(false); // while the controls are still those of the body that was there
  if (!subject_.pressed.empty())
    scanner_.Set("PressMm", "0"); // what a hand pressed, and no person chose
  subject_ = std::move(subject);
  scanner_.SetInputs(subject_.volumes, subject_.tissue);
  scanner_.SetPressed(subject_.pressed);
  cine_.Clear();
  cineIndex_ = -1;
  number_ = 0;
  frame_ = {};
  picture_ = {};
  failure_.clear();
  badPose_.clear();
  walk_ = subject_.mesh ? std::make_unique<SkinWalk>(subject_.mesh) : nullptr;
  emit SubjectChanged();
  emit ControlsChanged(); // what an image is made from goes with it
  if (subject_.IsEmpty())
    return;
  PutAtTop();
  ChooseDepth();
  TakeTop();
}

void Scan::SetPressed(std::vector<vtkSmartPointer<vtkImageData>> states)
{
  StopSlow();
  SetFrozen(false);
  scanner_.Set("PressMm", "0");
  subject_.pressed = std::move(states);
  scanner_.SetPressed(subject_.pressed);
  cine_.Clear(); // what was seen is not made again by other states
  Straighten();
  emit ControlsChanged();
  Ask();
}

// The tissue follows the face: how deep that is below the skin is how far it is pressed, up to the deepest state.
void Scan::PressTissue()
{
  if (subject_.pressed.empty() || scanner_.IsAcoustic()) // which knows nothing of it, and would be begun anew
    return;
  double mm = hold_.pressMm;
  if (isFollowing_) {
    const auto nearest = walk_ ? subject_.mesh->NearestTo(probeToWorld_.translation()) : std::nullopt;
    const Eigen::Vector3d away =
        nearest ? Eigen::Vector3d(probeToWorld_.translation() - subject_.mesh->PointAt(nearest->place)) : Eigen::Vector3d::Zero();
    mm = nearest && away.dot(subject_.mesh->NormalAt(nearest->place)) < 0.0 ? away.norm() : 0.0;
    mm = TrackedPressMm * std::round(mm / TrackedPressMm);
  }
  mm = std::clamp(mm, 0.0, PressMmOf(subject_.pressed.back()));
  ParameterList parameters = scanner_.Parameters();
  if (Named(parameters, "PressMm").Number() != mm)
    SetControl("PressMm", NumberText(mm));
}

// Where less than half of the usual image would show body, it begins just below the body; unless a person has said how deep.
void Scan::ChooseDepth()
{
  ParameterList parameters = scanner_.Parameters();
  const double now = Named(parameters, "DepthMm").Number();
  if (now != 0.0 && now != chosenDepthMm_)
    return;
  LiveProbeSettings probe;
  probe.kind = static_cast<LiveProbe>(static_cast<int>(Named(parameters, "Probe").Number()));
  const ProbeGeometry usual = GeometryOf(probe, 64);
  double deepest = 0.0;
  for (const double across : {-0.4, -0.2, 0.0, 0.2, 0.4}) {
    if (!walk_)
      break;
    const Eigen::Vector3d face = StartPose() * PointOf(usual, {usual.depthMin, across, 0.0}),
                          end = StartPose() * PointOf(usual, {usual.depthMax, across, 0.0}), beam = (end - face).normalized();
    if (const auto hit = subject_.mesh->FirstHit(face + FarAwayMm * beam, -beam)) // where it leaves the body at last
      deepest = std::max(deepest, FarAwayMm - hit->distanceMm);
  }
  const double wanted = std::max(LeastDepthMm, DepthStepMm * std::ceil((deepest + BelowMm) / DepthStepMm));
  chosenDepthMm_ = deepest > 0.0 && wanted <= 0.5 * usual.depthMax && probe.kind != LiveProbe::Custom ? wanted : 0.0;
  if (chosenDepthMm_ != now)
    SetControl("DepthMm", NumberText(chosenDepthMm_));
}

// Where it was scanned from, if that is known; else in the middle of the side that is asked for, of a patient who lies on the
// back the front.
void Scan::PutAtTop()
{
  const bool isKnown = subject_.start && subject_.up.isZero();
  up_ = isKnown                 ? Eigen::Vector3d(-subject_.start->linear().col(2))
        : !subject_.up.isZero() ? subject_.up.normalized()
                                : Eigen::Vector3d(-Eigen::Vector3d::UnitY());
  const Eigen::Vector3d across = isKnown                   ? Eigen::Vector3d(subject_.start->linear().col(0))
                                 : std::fabs(up_[0]) > 0.9 ? Eigen::Vector3d::UnitY()
                                                           : Eigen::Vector3d::UnitX();
  hold_ = {};
  if (!walk_)
    return;
  double box[6];
  subject_.skin->GetBounds(box);
  const Eigen::Vector3d middle(0.5 * (box[0] + box[1]), 0.5 * (box[2] + box[3]), 0.5 * (box[4] + box[5]));
  const double away = Eigen::Vector3d(box[1] - box[0], box[3] - box[2], box[5] - box[4]).norm() + 1.0;
  const auto hit = isKnown ? std::nullopt : subject_.mesh->FirstHit(middle + away * up_, -up_);
  walk_->PutNearest(isKnown ? subject_.start->translation() : (middle + away * up_).eval());
  walk_->Put(hit ? hit->place : walk_->Place(), across);
}

Pose Scan::StartPose() const
{
  return walk_ ? walk_->PoseOf({}) : subject_.start.value_or(Pose::Identity());
}

void Scan::PlaceAtTop()
{
  if (isFollowing_)
    return;
  PutAtTop();
  TakeTop();
}

// One that is led stays as it is led: all of its pose, or how it is turned.
void Scan::TakeTop()
{
  if (isFollowing_) {
    TakePose(probeToWorld_);
  } else if (walk_ && turned_) {
    walk_->Put(walk_->Place(), turned_->col(0)); // as Turn does
    Moved();
  } else {
    TakePose(StartPose());
  }
}

void Scan::Restart()
{
  SetFrozen(false);
  cine_.Clear();
  PutAtTop(); // also under a probe that a tracker moves, for StartPose()
  TakeTop();
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
  if (!isFrozen_)
    PressTissue();
  emit ProbeMoved();
  refinement_ = 0;
  if (!isFrozen_)
    Ask();
}

void Scan::SetNeedle(const std::optional<Needle>& needle)
{
  const bool isSame = needle && needle_ ? needle->tip == needle_->tip && needle->direction == needle_->direction
                                        : needle.has_value() == needle_.has_value();
  if (isSame)
    return;
  needle_ = needle;
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
  // Where tissue gives way, no deeper than is known how.
  const double most = subject_.pressed.empty() ? MostPressMm : PressMmOf(subject_.pressed.back());
  hold_.pressMm = std::clamp(hold_.pressMm + mm, MostLiftMm, most);
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
  const double now = Now();
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

void Scan::SetStopped(double seconds, const QString& why)
{
  const bool changed =
      why != whyStopped_ || (seconds >= 0.0) != (stoppedSeconds_ >= 0.0) || std::fabs(seconds - stoppedSeconds_) > 0.05;
  stoppedSeconds_ = seconds;
  whyStopped_ = why;
  if (changed)
    emit StateChanged();
}

void Scan::SetControl(const char* name, const std::string& text)
{
  if (isFrozen_)
    return; // the image is of then
  StopSlow();
  try {
    scanner_.Set(name, text);
  } catch (const Error& error) {
    emit Said({Message::Warning, QString::fromUtf8(error.what()), {}});
    return;
  }
  if (std::string_view(name) == "Source")
    PressTissue();
  emit ControlsChanged();
  refinement_ = 0;
  Ask();
}

void Scan::SetFlipped(bool flipped)
{
  isFlipped_ = flipped;
  refinement_ = 0;
  isFrozen_ ? ShowCine(cineIndex_) : MakeNow();
}

void Scan::SetFrozen(bool frozen)
{
  if (frozen == isFrozen_)
    return;
  StopSlow();
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
  ScanFrame frame = cine_.At(index);
  frame.isFlipped = isFlipped_;
  Make(frame, false);
}

PlanePicture Scan::PictureFrom(const Pose& probeToWorld)
{
  StopSlow();
  ScanFrame frame = frame_;
  frame.probeToWorld = probeToWorld;
  frame.isInAir = false;
  scanner_.Make(frame);
  PlanePicture picture = scanner_.Picture();
  scanner_.Make(frame_); // what is shown is what is recorded and sent
  return picture;
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
  const double now = Now();
  if (askedAt_ == 0.0)
    askedAt_ = now;
  redraw_->Ask(static_cast<int>(1000.0 * std::max(0.0, triedAt_ + FrameSeconds - now)));
}

void Scan::MakeNow()
{
  emit PoseWanted();
  redraw_->Stop();
  if (subject_.IsEmpty() || isFrozen_)
    return;
  if (slow_) {
    if (refinement_ == 0) { // it is of what was: given up, but for the first, lest one that moves all the time sees nothing
      isAskedAgain_ = true;
      if (!slowIsCoarse_)
        slow_->Cancel();
    }
    return;
  }
  ScanFrame frame;
  frame.seconds = Now();
  frame.probeToWorld = probeToWorld_;
  frame.number = ++number_;
  frame.isInAir = IsInAir();
  frame.isFlipped = isFlipped_;
  frame.needle = needle_;
  if (scanner_.IsAcoustic())
    return MakeSlowly(frame);
  frame.settings = scanner_.Settings();
  Make(frame, true);
}

// The acoustic model is slow. Its pictures are made in the background; while the probe moves they are coarse, and they get better
// from one to the next when it rests. None waits in a line: the next one is of the pose that is then the newest.
void Scan::MakeSlowly(ScanFrame frame)
{
  const int level = std::min(refinement_, LiveScanner::Refinements - 1);
  refinement_ = level + 1;
  slowIsCoarse_ = level == 0;
  isAskedAgain_ = false;
  const double askedAt = std::exchange(askedAt_, 0.0);
  try {
    scanner_.Set("Refinement", std::to_string(level));
    frame.settings = scanner_.Settings();
    scanner_.Prepare(frame);
  } catch (const Error& error) {
    Show(frame, true, QString::fromUtf8(error.what()), askedAt);
    return;
  }
  const auto finish = [this, frame, askedAt](const QString& failure) {
    slow_ = nullptr; // its work has ended: the scanner is free
    if (failure.isEmpty())
      scanner_.Keep();
    Show(frame, true, failure, askedAt);
  };
  slow_ = Job::Start(
      this, tr("Acoustic picture"), [this](const Progress& progress) { scanner_.Work(progress); }, [finish] { finish({}); },
      finish);
  connect(slow_, &Job::Ended, this, [this, job = slow_.data()] {
    if (slow_ == job) // cancelled
      slow_ = nullptr;
    if (slow_ || isFrozen_)
      return; // it is on its way already
    if (std::exchange(isAskedAgain_, false))
      MakeNow();
    else if (refinement_ < LiveScanner::Refinements && scanner_.IsAcoustic())
      redraw_->Ask(RestMs);
  });
}

bool Scan::IsMaking() const
{
  return slow_ != nullptr;
}

void Scan::StopSlow()
{
  delete slow_; // waits until it has noticed
  isAskedAgain_ = false;
}

void Scan::Make(const ScanFrame& frame, bool isNew)
{
  QString failure;
  try {
    scanner_.Make(frame);
  } catch (const Error& error) {
    failure = QString::fromUtf8(error.what());
  }
  Show(frame, isNew, failure, std::exchange(askedAt_, 0.0));
}

void Scan::Show(const ScanFrame& frame, bool isNew, const QString& failure, double askedAt)
{
  const QString before = shownState_;
  failure_ = failure;
  triedAt_ = frame.seconds;
  if (!HasFailed()) {
    frame_ = frame;
    picture_ = scanner_.Picture();
    if (frame.isInAir)
      picture_.image.fill(Qt::black); // all of the sound comes back from the air
  }
  if (isNew) {
    if (!HasFailed())
      cine_.Add(frame);
    madeAt_.push_back(frame.seconds);
    while (madeAt_.front() < frame.seconds - 1.0)
      madeAt_.pop_front();
  }
  emit FrameMade();
  if (isNew && askedAt > 0.0)
    latencyMs_ = 1e3 * (Now() - askedAt);
  shownState_ = State();
  if (shownState_ != before)
    emit StateChanged();
}

double Scan::FramesPerSecond() const
{
  const double now = Now();
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
      return tr("%1: this was %2 s ago")
          .arg(whyStopped_.isEmpty() ? tr("The tracker has stopped") : whyStopped_)
          .arg(stoppedSeconds_, 0, 'f', 1);
    if (!badPose_.isEmpty())
      return badPose_;
    if (Now() - jumpAt_ < JumpShownSeconds)
      return tr("The pose jumped by %1 mm: faster than a hand").arg(jumpMm_, 0, 'f', 0);
    if (!walk_ && !isFollowing_)
      return tr("There is no skin to scan on: %1").arg(subject_.whyNoSkin);
  }
  if (!scanner_.HardMaterial().empty())
    return tr("The probe is inside %1, where none can be").arg(QString::fromStdString(scanner_.HardMaterial()));
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
