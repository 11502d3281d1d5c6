// SPDX-License-Identifier: BSD-3-Clause
#include "SceneJson.h"

namespace echorama {

nlohmann::ordered_json ToJson(const SceneScan& scan)
{
  nlohmann::ordered_json told = nlohmann::ordered_json::object();
  if (scan.pressed) {
    const PressedTissue& pressed = *scan.pressed;
    told["press"] = {{"force_n", {pressed.forceN.x(), pressed.forceN.y(), pressed.forceN.z()}},
                     {"relative_volume", {pressed.relativeVolume, pressed.leastVolume}},
                     {"seconds", scan.pressSeconds}};
  }
  if (scan.gel)
    told["gel"] = {{"coupled", scan.gel->coupled}, {"volume_mm3", scan.gel->volumeMm3}, {"seconds", scan.gelSeconds}};
  const SynthesisCost& cost = scan.cost;
  told["cost"] = {{"rays_seconds", cost.raysSeconds},
                  {"scatterers_seconds", cost.scatterersSeconds},
                  {"echoes_seconds", cost.echoesSeconds},
                  {"detection_seconds", cost.detectionSeconds},
                  {"rays", cost.rays},
                  {"segments", cost.segments},
                  {"surface_echoes", cost.surfaceEchoes},
                  {"scatterers", cost.scatterers},
                  {"held_mb", 1e-6 * static_cast<double>(cost.bytes)}};
  return told;
}

std::string ReportOf(const std::vector<const SceneScan*>& scans, int ranks, const Traffic& told)
{
  nlohmann::ordered_json volumes = nlohmann::ordered_json::array();
  for (const SceneScan* scan : scans)
    volumes.push_back(ToJson(*scan));
  return nlohmann::ordered_json{
      {"volumes", std::move(volumes)}, {"ranks", ranks}, {"messages", told.messages}, {"message_bytes", told.bytesSent}}
      .dump();
}

} // namespace echorama
