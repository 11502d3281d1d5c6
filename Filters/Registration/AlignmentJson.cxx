// SPDX-License-Identifier: BSD-3-Clause
#include "AlignmentJson.h"

namespace echorama {
namespace {

using Json = nlohmann::ordered_json;

Json ToJson(const VolumeAlignment& volume)
{
  Json rows = Json::array();
  for (const auto& row : volume.covariance.rowwise())
    rows.push_back(std::vector<double>(row.begin(), row.end()));
  return {{"name", volume.name},
          {"verdict", NameOf(volume.verdict)},
          {"reason", volume.reason},
          {"error_mm", volume.errorMm},
          {"similarity", volume.similarity},
          {"overlap", volume.overlap},
          {"centre", {volume.centre.x(), volume.centre.y(), volume.centre.z()}},
          {"covariance", rows}};
}

Json ToJson(const PairOfVolumes& pair, int first)
{
  const PairAlignment& a = pair.alignment;
  return {{"fixed", first + pair.fixed},
          {"moving", first + pair.moving},
          {"verdict", NameOf(pair.verdict)},
          {"reason", pair.reason},
          {"score", a.score},
          {"similarity", a.similarity},
          {"overlap", a.overlap},
          {"peak_ratio", a.peakRatio},
          {"split_mm", a.splitMm},
          {"error_mm", a.errorMm},
          {"voted_down", pair.votedDown},
          {"stands", pair.stands},
          {"attempts", pair.attempts},
          {"residual_mm", pair.residualMm},
          {"anywhere", a.anywhere},
          {"seconds", {{"global", a.globalSeconds}, {"local", a.localSeconds}, {"confidence", a.confidenceSeconds}}}};
}

} // namespace

Json ToJson(const AlignVolumesResult& result, int first)
{
  Json volumes = Json::array(), pairs = Json::array();
  for (const VolumeAlignment& volume : result.volumes)
    volumes.push_back(ToJson(volume));
  for (const PairOfVolumes& pair : result.pairs)
    pairs.push_back(ToJson(pair, first));
  return {{"volumes", volumes},
          {"pairs", pairs},
          {"seconds", {{"prepare", result.featureSeconds}, {"pairs", result.pairSeconds}, {"graph", result.graphSeconds}}},
          {"pairs_finished_before", result.pairsFinishedBefore},
          {"times_prepared", result.timesPrepared},
          {"prepared_bytes", result.preparedBytes},
          {"ranks", result.ranks},
          {"messages", result.traffic.messages},
          {"message_bytes", result.traffic.bytesSent}};
}

Json ToJson(const AlignVolumesPlan& plan, int first)
{
  Json pairs = Json::array();
  for (const auto& [fixed, moving] : plan.pairs)
    pairs.push_back({first + fixed, first + moving});
  return {{"pairs", pairs},
          {"pairs_finished_before", plan.pairsFinishedBefore},
          {"times_prepared", plan.timesPrepared},
          {"bytes_per_volume", plan.bytesPerVolume},
          {"bytes_of_all", plan.bytesOfAll},
          {"budget_bytes", plan.budgetBytes},
          {"seconds_per_pair", plan.secondsPerPair},
          {"seconds_per_volume", plan.secondsPerVolume},
          {"seconds", plan.seconds}};
}

std::string Report(const AlignVolumesPlan& plan)
{
  return ToJson(plan, 0).dump();
}

std::string Report(const AlignVolumesResult& result)
{
  return ToJson(result).dump();
}

} // namespace echorama
