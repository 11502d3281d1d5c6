// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Stream/PoseStream.h"
#include <string>

namespace echorama {

/// Statistics as JSON, for programs and scripts: {"state", "message", "live", "tools": [{"name", "valid", "missing",
/// "outOfRange", "dropoutShare", "clockJumps", "remembered", "gaps", "longestGapSeconds", "rateHz", "jitterSeconds",
/// "medianLatencySeconds", "latencySpreadSeconds", "secondsSinceLast"}], "rejected": {"malformed": 3, ...}, "lastRejection"}.
/// What is not known is null, reasons that have not occurred are left out. Texts of a peer that are not UTF-8 are mended.
std::string StreamReport(const StreamStatistics& statistics);

} // namespace echorama
