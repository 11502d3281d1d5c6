// SPDX-License-Identifier: BSD-3-Clause
// echorama calibrate: how tracked things lie to each other, and what is needed to find out. One kind per file.
#include "Calibrate.h"
#include <vector>

namespace echorama {

Command CalibrateCommand(CLI::App& program)
{
  CLI::App* options = program.add_subcommand(
      "calibrate", "Find how sensor, volume, tip and clocks of a tracked probe belong together, or a camera and a skin");
  options->require_subcommand(1);
  const std::vector<Command> kinds = {CalibrateHandEyeCommand(*options), CalibratePivotCommand(*options),
                                      CalibrateTemporalCommand(*options), CalibrateRigCommand(*options),
                                      CalibrateSurfaceCommand(*options)};
  for (const Command& kind : kinds)
    kind.options->fallthrough(); // --json and --threads are ours
  return {options, [kinds](Session& session) {
            for (const Command& kind : kinds)
              if (kind.options->parsed())
                kind.run(session);
          }};
}

} // namespace echorama
