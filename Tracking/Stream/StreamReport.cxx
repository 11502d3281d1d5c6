// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Stream/StreamReport.h"
#include <cmath>
#include <nlohmann/json.hpp>

namespace echorama {
namespace {

nlohmann::ordered_json Known(double value)
{
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
}

} // namespace

std::string StreamReport(const StreamStatistics& statistics)
{
  nlohmann::ordered_json report;
  report["state"] = DeviceStateText(statistics.state);
  report["message"] = statistics.message;
  report["live"] = statistics.live;
  report["tools"] = nlohmann::ordered_json::array();
  for (const ToolStatistics& tool : statistics.tools)
    report["tools"].push_back({{"name", tool.name},
                               {"valid", tool.valid},
                               {"missing", tool.missing},
                               {"outOfRange", tool.outOfRange},
                               {"dropoutShare", Known(tool.DropoutShare())},
                               {"clockJumps", tool.clockJumps},
                               {"remembered", tool.remembered},
                               {"gaps", tool.gaps},
                               {"longestGapSeconds", Known(tool.longestGapSeconds)},
                               {"rateHz", Known(tool.rateHz)},
                               {"jitterSeconds", Known(tool.jitterSeconds)},
                               {"medianLatencySeconds", Known(tool.medianLatencySeconds)},
                               {"latencySpreadSeconds", Known(tool.latencySpreadSeconds)},
                               {"secondsSinceLast", Known(tool.secondsSinceLast)}});
  report["rejected"] = nlohmann::ordered_json::object();
  for (int i = 0; i < RejectionCount; ++i)
    if (const std::uint64_t count = statistics.Rejected(static_cast<Rejection>(i)); count > 0)
      report["rejected"][RejectionText(static_cast<Rejection>(i))] = count;
  report["lastRejection"] = statistics.lastRejection;
  return report.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

} // namespace echorama
