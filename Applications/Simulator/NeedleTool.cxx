// SPDX-License-Identifier: BSD-3-Clause
#include "NeedleTool.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Scan.h"
#include <algorithm>
#include <cmath>
#include <utility>

namespace echorama {

namespace {

using Eigen::Vector3d;

constexpr double OutMm = -5.0, MostOutMm = -40.0; ///< where it waits; how far it is drawn back
constexpr double HubMm = 10.0;                    ///< that stays outside
constexpr double GuideMm = 8.0;                   ///< of a guide from the array
constexpr double AimShare = 0.45, LeastAimMm = 10.0, AimMmPerDegree = 1.0;
constexpr double MostOblique = 80.0; ///< degrees from the skin's normal
constexpr double SweepMm =
    1.0; ///< of all that a moving needle meets, what is thinner may be missed: it is asked for with each pose
constexpr int MostTries = 60;
constexpr double OffBoneMm = 2.0; ///< when it no longer meets it

Vector3d Turned(const Vector3d& direction, const Vector3d& axis, double degrees)
{
  return Eigen::AngleAxisd(degrees * RadiansPerDegree, axis) * direction;
}

} // namespace

NeedleTool::NeedleTool(Scan* scan) : QObject(scan), scan_(scan)
{
  connect(scan, &Scan::SubjectChanged, this, [this] {
    guide_ = NeedleGuide::InPlane;
    isFollowing_ = hasMetBone_ = isLost_ = isBoneKnown_ = hasSaidWhy_ = false;
    depthMm_ = OutMm;
    aimMm_ = 0.0;
    SetShown(false);
  });
  // What a guide holds goes where the probe goes.
  connect(scan, &Scan::ProbeMoved, this, [this] {
    if (isShown_ && guide_ != NeedleGuide::None && !isFollowing_)
      Give();
  });
  connect(scan, &Scan::FrameMade, this, [this] {
    if (isShown_ && guide_ != NeedleGuide::None && !isFollowing_ &&
        (!(scan_->Scanner().Probe() == guided_) || heldBy_.matrix() != scan_->ProbeToWorld().matrix()))
      Give(); // another probe has another end; or bone could not be asked for while the image was made
    if (isFollowing_ && !isBoneKnown_) {
      FindBone();
      emit Changed();
    }
  });
  connect(scan, &Scan::ControlsChanged, this, [this] {
    isBoneKnown_ = hasSaidWhy_ = false; // what stops it may be another
    if (!isScored_ && tipBefore_ && !scan_->IsFrozen())
      EndAttempt(); // it ended while the image was frozen
  });
}

void NeedleTool::Say(const QString& text)
{
  emit scan_->Said({Message::Note, text, {}});
}

bool NeedleTool::CanMove() const
{
  return isShown_ && !isFollowing_ && !scan_->IsFrozen();
}

bool NeedleTool::IsInBody(const QString& why)
{
  if (insideMm_ > 0.0)
    Say(why);
  return insideMm_ > 0.0;
}

void NeedleTool::SetShown(bool shown)
{
  if (shown && scan_->Body().IsEmpty())
    return;
  if (shown && !isShown_ && !isFollowing_) {
    depthMm_ = OutMm;
    hasMetBone_ = false;
  }
  isShown_ = shown;
  Give();
}

double NeedleTool::AimMm() const
{
  return aimMm_ > 0.0 ? aimMm_ : AimShare * scan_->Scanner().Probe().depthMax;
}

// In the frame of the probe: from beside the array to the middle of the image.
void NeedleTool::ToGuide()
{
  const ProbeGeometry& probe = guided_ = scan_->Scanner().Probe();
  if (guide_ == NeedleGuide::InPlane) {
    // All round there is no end of the array: as if it looked ahead.
    entry_ = probe.fanAngle > Pi ? Vector3d::Zero() : PointOf(probe, {0.0, -0.5, 0.0});
    entry_[0] -= GuideMm;
  } else {
    entry_ = Vector3d(0.0, GuideMm, 0.0);
  }
  direction_ = (Vector3d(0.0, 0.0, AimMm()) - entry_).normalized();
}

Eigen::Vector3d NeedleTool::Entry() const
{
  const Needle now = Now();
  return now.tip - insideMm_ * now.direction;
}

Needle NeedleTool::Now() const
{
  const bool isHeld = guide_ != NeedleGuide::None && !isFollowing_;
  const Pose frame = isHeld ? scan_->ProbeToWorld() : Pose::Identity();
  return {frame * Vector3d(entry_ + depthMm_ * direction_), (frame.linear() * direction_).normalized()};
}

void NeedleTool::Give()
{
  if (!isShown_ || scan_->Body().IsEmpty()) {
    scan_->SetNeedle({});
    emit Changed();
    return;
  }
  if (guide_ != NeedleGuide::None && !isFollowing_) {
    ToGuide();
    SlideBack();
  }
  const Needle now = Now();
  insideMm_ = InsideOf(now);
  scan_->SetNeedle(now);
  emit Changed();
}

// How much of it is in the body: a guide or a tracker does not touch the skin, or not where it says.
double NeedleTool::InsideOf(const Needle& needle) const
{
  if (!scan_->HasSkin())
    return depthMm_;
  constexpr double far = 400.0;
  const auto hit = scan_->Body().mesh->FirstHit(needle.tip - far * needle.direction, needle.direction);
  return hit ? far - hit->distanceMm : OutMm;
}

// A guide takes the needle along, and bone does not let it through. Neither bends: where bone is in the way of the needle, from
// the guide to the tip, it slides back in its guide. That is tried all along the way of the probe, however far it went.
void NeedleTool::SlideBack()
{
  const bool isOut = depthMm_ <= 0.0;
  if (!isOut && (scan_->IsFrozen() || scan_->IsMaking())) // with the next image
    return;
  const Pose to = scan_->ProbeToWorld(), from = std::exchange(heldBy_, to);
  if (isOut || from.matrix() == to.matrix())
    return;
  const Vector3d tip = entry_ + depthMm_ * direction_;
  const double way = std::max((to * tip - from * tip).norm(), (to * entry_ - from * entry_).norm());
  const int tries = std::clamp(static_cast<int>(std::ceil(way / SweepMm)), 1, MostTries);
  try {
    for (int i = 1; i <= tries; i++) {
      const Pose probe = i < tries ? Interpolate(from, to, static_cast<double>(i) / tries) : to;
      const double freeMm =
          scan_->Scanner().AdvanceNeedle({probe * entry_, probe.linear() * direction_}, depthMm_ + OffBoneMm, SweepMm);
      if (freeMm < depthMm_) {
        depthMm_ = freeMm;
        hasMetBone_ = true;
      } else if (freeMm > depthMm_ + OffBoneMm - 1e-6) {
        hasMetBone_ = false;
      }
    }
  } catch (const Error& error) {
    SayWhyBoneIsNotKnown(error);
  }
}

void NeedleTool::SayWhyBoneIsNotKnown(const Error& error)
{
  if (!std::exchange(hasSaidWhy_, true)) // and not with each pose
    Say(tr("Whether the needle meets bone is not known: %1").arg(QString::fromUtf8(error.what())));
}

void NeedleTool::SetGuide(NeedleGuide guide)
{
  if (guide != guide_ && CanMove() && !IsInBody(tr("The needle is in the body: withdraw it first"))) {
    if (guide == NeedleGuide::None) { // it stays where it is
      const Needle now = Now();
      entry_ = Entry();
      direction_ = now.direction;
      depthMm_ = (now.tip - entry_).dot(direction_);
    } else {
      depthMm_ = OutMm;
    }
    guide_ = guide;
    hasMetBone_ = false;
  }
  Give(); // also when it was refused: whoever asked shows what is
}

// Into the body, not along it.
bool NeedleTool::PointsInto(const Vector3d& place, const Vector3d& direction) const
{
  const auto nearest = scan_->HasSkin() ? scan_->Body().mesh->NearestTo(place) : std::nullopt;
  const Vector3d normal = nearest ? scan_->Body().mesh->NormalAt(nearest->place) : scan_->SkinNormal();
  return -normal.dot(direction) > std::cos(MostOblique * RadiansPerDegree);
}

void NeedleTool::PutEntry(const Vector3d& place)
{
  if (!CanMove() || IsInBody(tr("The needle is in the body: withdraw it first")))
    return;
  const Vector3d direction = Now().direction;
  if (!PointsInto(place, direction))
    return;
  guide_ = NeedleGuide::None;
  entry_ = place;
  direction_ = direction;
  depthMm_ = OutMm;
  hasMetBone_ = false;
  Give();
}

void NeedleTool::Steer(double within, double across)
{
  if (!CanMove())
    return;
  if (guide_ != NeedleGuide::None) {
    if (IsInBody(tr("A guide does not turn while the needle is in the body: withdraw it first")))
      return;
    aimMm_ = std::clamp(AimMm() - AimMmPerDegree * within, LeastAimMm, scan_->Scanner().Probe().depthMax);
  } else {
    const Eigen::Matrix3d probe = scan_->ProbeToWorld().linear();
    const Vector3d turned = Turned(Turned(direction_, probe.col(1), within), probe.col(0), -across).normalized();
    if (!PointsInto(Entry(), turned))
      return;
    if (!IsFree(entry_ + depthMm_ * turned)) {
      hasMetBone_ = true;
    } else {
      direction_ = turned;
      hasMetBone_ = false;
    }
  }
  Give();
}

// The straight way of the tip to a place.
bool NeedleTool::IsFree(const Vector3d& place)
{
  const Vector3d tip = Now().tip, way = place - tip;
  try {
    return way.norm() == 0.0 || scan_->Scanner().AdvanceNeedle({tip, way.normalized()}, way.norm()) >= way.norm() - 1e-6;
  } catch (const Error& error) {
    emit scan_->Said({Message::Warning, QString::fromUtf8(error.what()), {}});
    return false;
  }
}

void NeedleTool::Advance(double mm)
{
  if (!CanMove())
    return;
  const double wanted = std::clamp(depthMm_ + mm, MostOutMm, scan_->Scanner().NeedleLengthMm() - HubMm) - depthMm_;
  try {
    const double moved = scan_->Scanner().AdvanceNeedle(Now(), wanted);
    hasMetBone_ = wanted > 0.0 && moved < wanted - 1e-6;
    depthMm_ += moved;
  } catch (const Error& error) {
    emit scan_->Said({Message::Warning, QString::fromUtf8(error.what()), {}});
  }
  Give();
}

void NeedleTool::Follow(const Eigen::Matrix4d& matrix)
{
  Pose pose;
  pose.matrix() = matrix;
  Needle needle;
  try {
    needle = Needle::Of(pose);
  } catch (const Error&) {
    return; // the tracker's own state says what it sends
  }
  const bool isSame = needle.tip == entry_ && needle.direction == direction_;
  if (isSame && isFollowing_ && isShown_ && !isLost_ && (isBoneKnown_ || scan_->IsMaking()))
    return;
  hasMetBone_ = hasMetBone_ && isFollowing_;
  isFollowing_ = isShown_ = true;
  isLost_ = isBoneKnown_ = false;
  entry_ = needle.tip;
  direction_ = needle.direction;
  depthMm_ = 0.0;
  if (!scan_->IsMaking()) // else with the next image
    FindBone();
  Give();
}

// Nobody can stop a hand: that a tracked one meets bone is told, and counted.
void NeedleTool::FindBone()
{
  isBoneKnown_ = true;
  hasMetBone_ = false;
  try {
    const double way = std::max(InsideOf({entry_, direction_}), 0.0) + 1.0; // the tip may be beyond bone
    hasMetBone_ = scan_->Scanner().AdvanceNeedle({entry_ - way * direction_, direction_}, way, SweepMm) < way - 1e-3;
  } catch (const Error& error) {
    SayWhyBoneIsNotKnown(error);
  }
}

void NeedleTool::SetLost()
{
  if (!isFollowing_ || isLost_)
    return;
  isLost_ = true;
  emit Changed();
}

void NeedleTool::StopFollowing()
{
  if (!isFollowing_)
    return;
  const Vector3d entry = Entry();
  const double inside = insideMm_;
  isFollowing_ = isLost_ = isBoneKnown_ = hasSaidWhy_ = false;
  guide_ = NeedleGuide::None;
  entry_ = entry;
  depthMm_ = inside;
  Give();
}

void NeedleTool::BeginAttempt(bool tipIsShown)
{
  if (!tipBefore_) // else an attempt that ended while the image was frozen has left it
    tipBefore_ = scan_->Scanner().ShowsTip();
  isScored_ = true;
  scan_->SetControl("NeedleShowTip", tipIsShown ? "on" : "off");
  isBlind_ = !tipIsShown;
  if (!isFollowing_) {
    isShown_ = true;
    guide_ = NeedleGuide::InPlane;
    depthMm_ = OutMm;
    aimMm_ = 0.0;
    hasMetBone_ = false;
  }
  emit BlindChanged(isBlind_);
  Give();
}

void NeedleTool::EndAttempt()
{
  if (!tipBefore_)
    return;
  isBlind_ = isScored_ = false;
  emit BlindChanged(false);
  if (!scan_->IsFrozen()) { // else when it goes on
    const bool before = *tipBefore_;
    tipBefore_.reset();
    scan_->SetControl("NeedleShowTip", before ? "on" : "off");
  }
  Give();
}

QString NeedleTool::State() const
{
  if (!isShown_)
    return {};
  QString text = insideMm_ > 0.0 ? tr("Needle %1 mm in the body").arg(insideMm_, 0, 'f', 0) : tr("Needle outside of the body");
  if (isLost_)
    text += tr("; its tracker does not see it");
  if (hasMetBone_)
    text += tr("; it has met bone");
  if (!isBlind_ && insideMm_ > 0.0 && scan_->Frame().needle) {
    const LiveScanner& scanner = scan_->Scanner();
    if (scanner.NeedleState() == vtkUltrasoundLiveImage::NEEDLE_OUT_OF_PLANE)
      text += tr("; out of the plane");
    else if (!scanner.ShowsTip())
      text += tr("; in the plane");
    else if (scanner.TipInPlane())
      text += tr("; the tip is in the plane");
    else
      text += tr("; the tip is %1 mm off the plane").arg(std::fabs(scanner.TipOffPlaneMm()), 0, 'f', 1);
  }
  return text;
}

} // namespace echorama
