// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "BoxTree.h"
#include "VolumeOverlap.h"
#include "VolumeShape.h"
#include <functional>

namespace echorama {

/// What tells which others a volume overlaps: its coarsest resolution, some 10 to 100 KB whatever its size.
struct VolumeOutline {
  explicit VolumeOutline(const PlacedVolume& volume);

  PyramidLevel coarsest;
  VolumeShape shape;
  OverlapPoints points;
  TurnedBox box; ///< around its real voxels, where its geometry has them

  TurnedBox BoxAt(const Pose& volumeToWorld) const;
};

/// The share of the smaller of two volumes that both hold.
double OverlapOf(const VolumeOutline& a, const Pose& aToWorld, const VolumeOutline& b, const Pose& bToWorld);

/// Two volumes that overlap.
struct OverlappingPair {
  int a = 0, b = 0;
  double overlap = 0.0;
  bool isFar = false; ///< only if they were moved towards each other as far as they may be off
};

/// Pairs that overlap by at least \a minimumOverlap (above 0), or would if they were up to \a reachMm closer: a < b, in
/// ascending order.
/// \param isAsked whether a pair counts at all
/// Cost: a tree of boxes finds who may overlap whom; each of these then takes some ten microseconds, in parallel.
std::vector<OverlappingPair> OverlappingPairs(const std::vector<VolumeOutline>& volumes, const std::vector<Pose>& volumeToWorld,
                                              double reachMm, double minimumOverlap,
                                              const std::function<bool(int, int)>& isAsked);

/// For each volume the \a most that it overlaps most; where these are fewer than \a enough, those too that are far. In ascending
/// order, each once.
std::vector<std::pair<int, int>> MostOverlapping(const std::vector<OverlappingPair>& pairs, int volumes, int most, int enough);

} // namespace echorama
