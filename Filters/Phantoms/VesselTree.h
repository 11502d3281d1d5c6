// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include <cstdint>
#include <Eigen/Core>
#include <functional>
#include <vector>

namespace echorama {

/// How a tree of vessels grows from its root into an organ.
struct VesselTreeParameters {
  std::uint64_t seed = 1;
  Eigen::Vector3d root = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double rootRadiusMm = 5.0;
  double rootLengthMm = 30.0;
  double smallestRadiusMm = 0.9;
  int generations = 6;
  double lengthOverRadius = 6.0;
  double asymmetry = 0.25; ///< children's radii are as 1 - a to 1, a uniform from 0 to twice this, or 0.75
};

/// All but the seed.
ParameterList Describe(VesselTreeParameters& p);

/// A straight piece of a tree between two branchings.
struct VesselBranch {
  Eigen::Vector3d from, to;
  double radius = 0.0; ///< mm, of the lumen
  int generation = 0;  ///< of the root: 0
  int parent = -1;     ///< index of the branch it comes from; -1: the root
  bool main = true;    ///< whether it goes on where its parent ends as the wider of the two; the root is
};

/// Room for a vessel at a point: mm to the nearest thing that it must not reach, its own radius not counted; negative: there is
/// none.
using VesselRoom = std::function<double(const Eigen::Vector3d&)>;

/// Grows a tree by Murray's law: a branch of radius r0 parts into r1 and r2 with r0^3 = r1^3 + r2^3, at the angles that cost
/// least, cos(angle 1) = (r0^4 + r1^4 - r2^4) / (2 r0^2 r1^2), planes turned by about a right angle from one branching to the
/// next (Murray, PNAS 12, 1926; J. Gen. Physiol. 9, 1926). Branches come in order: parents before children.
///
/// Of several ways to go on the one with most room is taken, also from the tree's own branches. Both children or none: where
/// there is no room for both, or the smaller would be too narrow, the branch ends. The root needs no room.
/// \throws Error(InvalidParameter) for numbers out of their range.
std::vector<VesselBranch> GrowVessels(const VesselTreeParameters& parameters, const VesselRoom& room);

/// A smooth path along branches that continue each other, from a branching to a tip: what is swept to a tube.
struct VesselStem {
  std::vector<Eigen::Vector3d> path; ///< mm, points about half a radius apart
  std::vector<double> radius;        ///< mm, of the lumen, at each; changes smoothly behind a branching
};

/// The stems of a tree: each branch belongs to one of them. A side stem starts on the middle line of the vessel it leaves.
std::vector<VesselStem> StemsOf(const std::vector<VesselBranch>& tree);

} // namespace echorama
