// SPDX-License-Identifier: BSD-3-Clause
// echorama calibrate: how tracked things lie to each other, and what is needed to find out. One kind per file.
#include "Calibrate.h"
#include <vector>

namespace echorama {

void EchoramaCommand(CLI::App* options, Action& action)
{
  options->require_subcommand(1);
  const std::vector<CalibrateKind> kinds = {CalibrateHandEyeCommand(*options), CalibratePivotCommand(*options),
                                            CalibrateTemporalCommand(*options), CalibrateRigCommand(*options),
                                            CalibrateSurfaceCommand(*options)};
  for (const CalibrateKind& kind : kinds)
    kind.options->fallthrough(); // --json and --threads are ours
  action = [kinds](Session& session) {
    for (const CalibrateKind& kind : kinds)
      if (kind.options->parsed())
        kind.run(session);
  };
}

} // namespace echorama
