// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Json.h"
#include "Core/Sharing/SharedWork.h"
#include "SceneRun.h"

namespace echorama {

/// Classes of VTK take the text: in ParaView their JSON library is another copy. A heavy header, for .cxx files only.

/// {"press": {"force_n", "relative_volume", "seconds"}, "gel": {"coupled", "volume_mm3", "seconds"}, "cost": {...}}; without
/// press or gel where the scene has none.
nlohmann::ordered_json ToJson(const SceneScan& scan);

/// {"volumes": [...], "ranks", "messages", "message_bytes"} of several.
std::string ReportOf(const std::vector<const SceneScan*>& scans, int ranks, const Traffic& told);

} // namespace echorama
