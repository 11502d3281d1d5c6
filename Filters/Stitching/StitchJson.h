// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Json.h"
#include "StitchMemory.h"
#include "StitchQuality.h"

namespace echorama {

/// What is told of a stitching, as JSON, for --json, reports and people alike. Keys are in snake_case; numbers that are not
/// finite become null. Classes of VTK take the text (Report): in ParaView their JSON library is another copy.

/// {"volumes", "dimensions", "spacing", "plan_factor", "plan_bytes", "output_bytes", "allowed_bytes", "slabs"}
nlohmann::ordered_json ToJson(const StitchCost& cost);
std::string Report(const StitchCost& cost);

/// {"seam_mean", "seam_gradient", "borders": {"mean", "gradient", "faces"}, "cuts": {the same}, "texture_kept", "snr",
/// "snr_sources", "overlap_windows", "overlap_voxels", "error_overlap", "error_outside"}
nlohmann::ordered_json ToJson(const StitchQualityReport& quality);
std::string Report(const StitchQualityReport& quality);

} // namespace echorama
