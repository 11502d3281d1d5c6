// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Widgets/Session/SessionState.h"
#include <algorithm>
#include <map>
#include <vector>

namespace echorama {

/// How far two poses put that corner of a volume apart that they put apart most, mm.
inline double FarthestCornerMm(const ImageGeometry& geometry, const Pose& a, const Pose& b)
{
  double farthest = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d index;
    for (int axis = 0; axis < 3; ++axis)
      index[axis] = (corner >> axis & 1) * (geometry.dimensions[static_cast<std::size_t>(axis)] - 1);
    const Eigen::Vector3d place = geometry.IndexToWorld() * index;
    farthest = std::max(farthest, (a * place - b * place).norm());
  }
  return farthest;
}

/// How differently two sessions place a volume.
struct PoseDifference {
  int id = 0;
  bool isKnown = false;                ///< to the other session; else the numbers are 0
  double middleMm = 0.0, mostMm = 0.0; ///< how far its middle, and that of its corners that is farthest, are apart
  double degrees = 0.0;
};

/// The volumes of \a state beside the poses that another session has for them, in order. \a besideFirst: the other session is
/// moved as a whole so that the first volume that both know agrees: all volumes moved together is no difference.
std::vector<PoseDifference> ComparePoses(const SessionState& state, const std::map<int, Pose>& other, bool besideFirst);

} // namespace echorama
