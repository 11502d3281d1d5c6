// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Json.h"
#include "Tracking/Stream/PoseStream.h"
#include <string>

namespace echorama {

/// Statistics as JSON, for programs and scripts: {"state", "message", "live", "tools": [{"name", "valid", "missing",
/// "out_of_range", "dropout_share", "clock_jumps", "remembered", "gaps", "longest_gap_seconds", "rate_hz", "jitter_seconds",
/// "median_latency_seconds", "latency_spread_seconds", "seconds_since_last"}], "rejected": {"malformed": 3, ...},
/// "last_rejection"}. What is not known is null, reasons that have not occurred are left out.
/// Classes of VTK take the text, in which texts of a peer that are not UTF-8 are mended: in ParaView their JSON library is
/// another copy.
nlohmann::ordered_json ToJson(const StreamStatistics& statistics);
std::string StreamReport(const StreamStatistics& statistics);

} // namespace echorama
