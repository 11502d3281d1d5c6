// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Widgets/Session/SessionState.h"
#include <map>
#include <vector>

namespace echorama {

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
