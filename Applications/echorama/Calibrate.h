// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Commands.h"

namespace echorama {

// Each adds one subcommand to echorama calibrate; they lie in files of their own.
Command CalibrateHandEyeCommand(CLI::App& calibrate);
Command CalibratePivotCommand(CLI::App& calibrate);
Command CalibrateTemporalCommand(CLI::App& calibrate);
Command CalibrateRigCommand(CLI::App& calibrate);
Command CalibrateSurfaceCommand(CLI::App& calibrate);

} // namespace echorama
