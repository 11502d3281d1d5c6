// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Geometry/RigidTransform.h"
#include <cstdint>
#include <vector>

namespace echorama {

/// An inverse covariance of (translation mm, rotation vector radians).
using Information = Eigen::Matrix<double, 6, 6>;

/// A motion's information in other axes.
Information Turned(const Information& information, const Eigen::Matrix3d& rotation);

/// How one volume was measured to lie against another.
struct PoseEdge {
  int from = 0, to = 0;             ///< volumes, not the same
  Pose toInFrom = Pose::Identity(); ///< the pose of volume `to` seen from volume `from`: fromToWorld^-1 * toToWorld
  /// In the frame of `from`: the information speaks of MotionAbout(centre, rotation, translation) * toInFrom.
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Information information = Information::Identity(); ///< symmetric; directions without information are allowed
  bool verified = true; ///< false: the pair itself was ambiguous; it is believed only as far as other edges agree
};

/// When edges disagree so much that one of them must be wrong.
struct PoseGraphParameters {
  double radiusMm = 50.0;
  double floorMm = 0.3; ///< Hessians are optimistic
  double outlierMm = 2.0, outlierSigmas = 6.0;
  double lossSigmas = 2.0;
  double undeterminedMm = 10.0;
  int trees = 100;
  std::uint64_t seed = 1; ///< of the spanning trees
};

ParameterList Describe(PoseGraphParameters& p);

struct PoseGraphResult {
  std::vector<Pose> volumeToWorld; ///< per volume; the fixed one keeps its own, those not placed their start

  std::vector<bool> isWrong;          ///< per edge: the others voted it down
  std::vector<bool> isContested;      ///< per edge: wrong, but as many edges speak for it as against it
  std::vector<bool> isBridge;         ///< per edge: it stands, but in no cycle of edges that stand: nothing can vote on it
  std::vector<double> residualMm;     ///< per edge: how far it disagrees with the result, root mean square at the radius
  std::vector<double> residualSigmas; ///< per edge: the same in its standard deviations (Mahalanobis)

  std::vector<bool> isPlaced;   ///< per volume: joined to the fixed one by edges that stand
  std::vector<bool> isDoubtful; ///< per volume: placed, but only through edges that are unverified or contested
  std::vector<bool>
      isDetermined; ///< per volume: placed, and no direction of its pose is left open (a long way of sure edges leaves none)
  /// Per volume: inverse covariance of MotionAbout(centre, rotation, translation) * volumeToWorld relative to the fixed volume.
  std::vector<Information> information;
  std::vector<Eigen::Vector3d> centre; ///< per volume, world: about which its information speaks
  double consistency = 0.0; ///< root of chi^2 per degree of freedom of what stands: 1 as claimed; 0: nothing to compare
};

/// Places volumes by all measurements between pairs of them, of which some may be wrong.
///
/// Spanning trees are drawn at random, those of edges that close short cycles before others; the one with which most edges
/// agree is where a robust solution (Cauchy loss) starts. Edges that then disagree by more than their covariance explains
/// are dropped, and the rest is solved again by plain least squares. If edges that were dropped agree with each other about
/// where a part of the volumes should be, and outnumber the edges that hold this part where it is, they win; if they are as
/// many, both are contested and that part is doubtful. So one wrong edge among three or more is named, one among two cannot be.
/// Unverified edges have no vote. They join afterwards: where they agree with what stands or with each other they count as
/// the others; else they place only volumes that nothing better joins, which are then doubtful.
///
/// The result does not depend on the order of edges and volumes, unless the votes are tied.
/// Cost: the trees times the edges, then a sparse Cholesky factor per step of the solver. One thread.
/// \param start per volume; only the fixed volume's matters, and those of volumes that no edge joins to it
/// \throws Error(InvalidParameter) for a fixed volume or an edge between volumes that are not there, poses that are not rigid,
/// numbers that are not finite; Error(Cancelled).
PoseGraphResult SolvePoseGraph(const std::vector<Pose>& start, const std::vector<PoseEdge>& edges, int fixed,
                               const PoseGraphParameters& parameters = {}, const Progress& progress = {});

} // namespace echorama
