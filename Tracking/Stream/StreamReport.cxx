// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Stream/StreamReport.h"
#include "Core/Base/JsonPlace.h"
#include <cmath>

namespace echorama {
namespace {

nlohmann::ordered_json Known(double value)
{
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
}

} // namespace

nlohmann::ordered_json ToJson(const StreamStatistics& statistics)
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
                               {"out_of_range", tool.outOfRange},
                               {"dropout_share", Known(tool.DropoutShare())},
                               {"clock_jumps", tool.clockJumps},
                               {"remembered", tool.remembered},
                               {"gaps", tool.gaps},
                               {"longest_gap_seconds", Known(tool.longestGapSeconds)},
                               {"rate_hz", Known(tool.rateHz)},
                               {"jitter_seconds", Known(tool.jitterSeconds)},
                               {"median_latency_seconds", Known(tool.medianLatencySeconds)},
                               {"latency_spread_seconds", Known(tool.latencySpreadSeconds)},
                               {"seconds_since_last", Known(tool.secondsSinceLast)}});
  report["rejected"] = nlohmann::ordered_json::object();
  for (int i = 0; i < RejectionCount; ++i)
    if (const std::uint64_t count = statistics.Rejected(static_cast<Rejection>(i)); count > 0)
      report["rejected"][RejectionText(static_cast<Rejection>(i))] = count;
  report["last_rejection"] = statistics.lastRejection;
  return report;
}

std::string StreamReport(const StreamStatistics& statistics)
{
  return JsonPlace::Print(ToJson(statistics));
}

} // namespace echorama
