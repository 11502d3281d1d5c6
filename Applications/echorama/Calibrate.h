// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Commands.h"

namespace echorama {

/// A subcommand of echorama calibrate.
struct CalibrateKind {
  CLI::App* options = nullptr;
  Action run;
};

// Each adds one; they lie in files of their own.
CalibrateKind CalibrateHandEyeCommand(CLI::App& calibrate);
CalibrateKind CalibratePivotCommand(CLI::App& calibrate);
CalibrateKind CalibrateTemporalCommand(CLI::App& calibrate);
CalibrateKind CalibrateRigCommand(CLI::App& calibrate);
CalibrateKind CalibrateSurfaceCommand(CLI::App& calibrate);

} // namespace echorama
