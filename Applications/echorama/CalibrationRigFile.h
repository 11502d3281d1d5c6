// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Calibration/RigFit.h"
#include <string>
#include <vector>

namespace echorama {

/// The balls of a calibration rig, in its own frame (z = 0 is the plate's upper side, -z is up to the probe; see
/// CalibrationRigParameters): \a rig is the size of the standard rig ("1"), or a table with the columns label, x, y, z and radius
/// in mm, in any rigid frame. Throws Error that names the file and line.
std::vector<RigBall> RigBallsOf(const std::string& rig);

} // namespace echorama
