// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Filters/Live/BeamVolumes.h"
#include "Filters/Live/Needle.h"
#include <functional>

namespace echorama {

/// Whether a needle cannot pass a point of the world, mm: bone, by material, by a surface, or by how bright a volume is there.
using NeedleObstacle = std::function<bool(const Eigen::Vector3d&)>;

/// Of volumes, as they are seen: what is brighter than \a grey, averaged over a cube of \a overMm, so that grain does not stop
/// it. Where nothing is real nothing stops it. For as long as the volumes live. \throws Error(InvalidParameter) for a size that
/// is not in [0.1, 20] mm
NeedleObstacle BrighterThan(const BeamVolumes& volumes, double grey, const VolumeMix& mix = {}, double overMm = 1.5);

/// How far the tip comes on the straight way between two places.
struct NeedleAdvance {
  double freeMm = 0.0;  ///< from the start
  bool stopped = false; ///< by an obstacle, no more than \a stepMm before it
};

/// Tries the way in steps, then halves the last one down to 0.01 mm. An obstacle that is thinner than a step may be missed; the
/// shaft follows the tip and is not tried. From within an obstacle every way that leads out of it is free as soon as it is out.
/// \param obstacle empty: nothing stops the needle
/// \throws Error(BadInput) for places that are not finite, Error(InvalidParameter) for a step that is not in [0.01, 10] mm or a
/// way of more than a metre
NeedleAdvance AdvanceTip(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const NeedleObstacle& obstacle,
                         double stepMm = 0.25);

struct NeedleScoreRules {
  double redirectionDegrees = 5.0; ///< a turn of more than this within the body is a redirection
  double settleSeconds = 0.3;      ///< as long as the direction still changes it is the same one
  double longestGapSeconds = 0.5;  ///< longer pauses between moments are not counted
};

ParameterList Describe(NeedleScoreRules& rules);

/// What a needle did, from moment to moment.
struct NeedleScore {
  double targetMm = Unlimited; ///< of the tip from the target, at the last moment
  double nearestMm = Unlimited;
  int passes = 0; ///< how often it went in
  int redirections = 0;
  int stops = 0; ///< by obstacles
  double insideSeconds = 0.0, offPlaneSeconds = 0.0;
};

/// Keeps the score of one attempt with a needle.
class NeedleTrack {
public:
  struct Moment {
    double seconds = 0.0;
    Needle needle;
    bool inside = false;  ///< the tip is in the body
    bool inPlane = false; ///< NeedleSight::tipInPlane
    bool stopped = false; ///< NeedleAdvance::stopped
  };

  /// \throws Error(InvalidParameter) for rules out of range, Error(BadInput) for a target that is not finite
  NeedleTrack(const Eigen::Vector3d& target, const NeedleScoreRules& rules = {});

  /// \throws Error(BadInput), and nothing is counted, when the time is not finite or goes back, or the needle is none
  void Add(const Moment& moment);

  const NeedleScore& Score() const { return score_; }

private:
  Eigen::Vector3d target_;
  NeedleScoreRules rules_;
  NeedleScore score_;
  std::optional<Moment> last_;
  Eigen::Vector3d settled_ = Eigen::Vector3d::UnitZ(); // the direction that turns are measured from
  bool turning_ = false;
  double turnedAt_ = 0.0; // seconds, when the direction last changed while turning
};

} // namespace echorama
