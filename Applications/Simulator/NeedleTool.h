// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Live/Needle.h"
#include <Eigen/Core>
#include <optional>
#include <QObject>
#include <QString>

namespace echorama {

class Error;
class Scan;

/// What holds a needle.
enum class NeedleGuide {
  None,       ///< a hand: it stays where it is in the body
  InPlane,    ///< a guide at the end of the array: it moves with the probe, in the plane of the image
  OutOfPlane, ///< a guide beside the array: it crosses the plane at a depth
};

/// A needle as a hand has it: through a place on the skin, along its axis and no other way, turned about that place. Gives it to
/// the Scan, whose frames carry it.
class NeedleTool : public QObject {
  Q_OBJECT

public:
  explicit NeedleTool(Scan* scan);

  void SetShown(bool shown);
  bool IsShown() const { return isShown_; }
  /// Where it is now, in the world.
  Needle Now() const;
  /// Where it goes through the skin, or would.
  Eigen::Vector3d Entry() const;
  /// How much of it is in the body; below 0: how far the tip is from the skin, along the axis.
  double InsideMm() const { return insideMm_; }

  ///@{ Keys and mouse; nothing while a tracker leads, or the image is frozen.
  /// Not while it is in the body, as nobody takes a needle out of a guide there.
  void SetGuide(NeedleGuide guide);
  NeedleGuide Guide() const { return guide_; }
  /// Of a needle that is not in the body: to a place on the skin. Out of a guide, as it is in a hand then.
  void PutEntry(const Eigen::Vector3d& place);
  /// About the entry, degrees: within the image, towards +x of the probe; and across it, towards +y. In a guide the first alone
  /// counts, and changes the depth at which the needle crosses the middle of the image.
  void Steer(double within, double across);
  /// Below 0: back.
  void Advance(double mm);
  ///@}

  ///@{ A pose that comes from outside: the tip is its origin, z the direction. One that is not rigid and finite is not taken.
  void Follow(const Eigen::Matrix4d& needleToWorld);
  /// The tracker does not see it: where it is shown it was.
  void SetLost();
  void StopFollowing();
  bool IsFollowing() const { return isFollowing_; }
  ///@}

  ///@{ While somebody is scored: out of the body to begin with, and nothing is told of the tip unless it is allowed.
  void BeginAttempt(bool tipIsShown);
  void EndAttempt();
  bool IsBlind() const { return isBlind_; }
  ///@}

  bool HasMetBone() const { return hasMetBone_; }
  /// What is known of it, a sentence; "" when there is none.
  QString State() const;

signals:
  void Changed();
  void BlindChanged(bool blind);

private:
  bool CanMove() const;
  bool PointsInto(const Eigen::Vector3d& place, const Eigen::Vector3d& direction) const;
  bool IsInBody(const QString& why);
  bool IsFree(const Eigen::Vector3d& place);
  void ToGuide();
  void SlideBack();
  void FindBone();
  double InsideOf(const Needle& needle) const;
  void SayWhyBoneIsNotKnown(const Error& error);
  double AimMm() const;
  void Give();
  void Say(const QString& text);

  Scan* scan_;
  bool isShown_ = false, isFollowing_ = false, isBlind_ = false, isScored_ = false, hasMetBone_ = false, isLost_ = false;
  bool isBoneKnown_ = false; ///< of a tracked one: hasMetBone_ is of where it is, with the controls of now
  bool hasSaidWhy_ = false;  ///< why bone cannot be told
  NeedleGuide guide_ = NeedleGuide::InPlane;
  Eigen::Vector3d entry_ = Eigen::Vector3d::Zero(),
                  direction_ = Eigen::Vector3d::UnitZ(); ///< of the world; in a guide, of the probe
  double depthMm_ = 0.0;                                 ///< of the tip, from the entry
  double aimMm_ = 0.0;                                   ///< of a guide: where it crosses the middle of the image; 0: as usual
  double insideMm_ = 0.0;
  Pose heldBy_ = Pose::Identity(); ///< a guide: where the probe was when bone was last asked for
  ProbeGeometry guided_;           ///< the probe that the guide was made for
  std::optional<bool> tipBefore_;  ///< an attempt: whether it was marked, as it shall be again
};

} // namespace echorama
