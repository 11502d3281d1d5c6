// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "AlignVolumes.h"
#include "Core/Base/Json.h"

namespace echorama {

/// Classes of VTK take the text (Report): in ParaView their JSON library is another copy. A heavy header, for .cxx files only.

/// {"volumes": [{"name", "verdict", "reason", "error_mm", "similarity", "overlap", "centre", "covariance"}, ...], "pairs":
/// [{"fixed", "moving" (from \a first), "verdict", "reason", "score", "similarity", "overlap", "peak_ratio", "split_mm",
/// "error_mm", "voted_down", "stands", "attempts", "residual_mm", "anywhere", "seconds": {"global", "local", "confidence"}},
/// ...], "seconds":
/// {"prepare", "pairs", "graph"}, "pairs_finished_before", "times_prepared", "prepared_bytes"}
nlohmann::ordered_json ToJson(const AlignVolumesResult& result, int first = 0);
std::string Report(const AlignVolumesResult& result);

/// {"pairs": [[fixed, moving], ...] (from \a first), "pairs_finished_before", "times_prepared", "bytes_per_volume",
/// "bytes_of_all", "budget_bytes", "seconds_per_pair", "seconds_per_volume", "seconds"}
nlohmann::ordered_json ToJson(const AlignVolumesPlan& plan, int first);
std::string Report(const AlignVolumesPlan& plan);

} // namespace echorama
