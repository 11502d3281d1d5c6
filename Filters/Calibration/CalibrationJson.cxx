// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Calibration/CalibrationJson.h"
#include "Core/Base/JsonPlace.h"

namespace echorama {

using Json = nlohmann::ordered_json;

Json ToJson(const HandEyeResult& result, const HandEyeParameters& parameters)
{
  Json scans = Json::array(), advice = Json::array();
  for (const HandEyeResidual& residual : result.residuals)
    scans.push_back({{"name", residual.name},
                     {"inlier", residual.inlier},
                     {"mm", residual.mm},
                     {"degrees", residual.degrees},
                     {"reason", residual.reason}});
  for (const HandEyeAdvice& one : result.advice)
    advice.push_back(
        {{"text", one.text}, {"axis", JsonPlace::ListOf(one.axis)}, {"degrees", one.degrees}, {"radius95_mm", one.radiusMm}});
  const double scale = result.noiseScale;
  return {{"kind", "hand-eye"},
          {"method", "maximum-likelihood"},
          {"VolumeToSensor", JsonPlace::RowsOf(result.solution.volumeToSensor.matrix())},
          {"WorldToTracker", JsonPlace::RowsOf(result.solution.worldToTracker.matrix())},
          {"target", JsonPlace::ListOf(parameters.target)},
          {"target_rms_mm", result.targetRmsMm},
          {"target_radius95_mm", result.targetRadius95Mm},
          {"target_covariance", JsonPlace::RowsOf(result.targetCovariance)},
          {"covariance", JsonPlace::RowsOf(result.covariance)},
          {"inliers", result.inliers},
          {"rms_mm", result.rmsMm},
          {"rms_degrees", result.rmsDegrees},
          {"noise",
           {{"sensor_degrees", parameters.sensorNoise.degrees * scale},
            {"sensor_mm", parameters.sensorNoise.mm * scale},
            {"volume_degrees", parameters.volumeNoise.degrees * scale},
            {"volume_mm", parameters.volumeNoise.mm * scale},
            {"estimated", result.noiseEstimated},
            {"scale", scale}}},
          {"scans", scans},
          {"advice", advice},
          {"notes", result.notes}};
}

Json ToJson(const PivotResult& result, const std::string& tool)
{
  Json outliers = Json::array();
  for (std::size_t i = 0; i < result.residuals.size(); ++i)
    if (!result.residuals[i].inlier)
      outliers.push_back(i);
  Json sphere;
  if (result.sphere.known)
    sphere = {{"centre", JsonPlace::ListOf(result.sphere.centre)},
              {"radius_mm", result.sphere.radiusMm},
              {"radius_error_mm", result.sphere.radiusErrorMm},
              {"rms_mm", result.sphere.rmsMm}};
  return {{"kind", "pivot"},
          {"tool", tool},
          {"tip", JsonPlace::ListOf(result.tip)},
          {"tip_rms_mm", result.tipRmsMm},
          {"tip_radius95_mm", result.tipRadius95Mm},
          {"tip_covariance", JsonPlace::RowsOf(result.covariance.topLeftCorner<3, 3>())},
          {"pivot", JsonPlace::ListOf(result.pivot)},
          {"poses", result.residuals.size()},
          {"inliers", result.inliers},
          {"outliers", outliers},
          {"rms_mm", result.rmsMm},
          {"noise_scale", result.noiseScale},
          {"swing_degrees", JsonPlace::ListOf(result.swingDegrees)},
          {"least_squares_tip", JsonPlace::ListOf(result.algebraicTip)},
          {"sphere", sphere},
          {"notes", result.notes}};
}

Json ToJson(const TemporalResult& result, const std::string& firstTool, const std::string& secondTool)
{
  Json curve = Json::array();
  for (std::size_t i = 0; i < result.offsets.size(); ++i)
    curve.push_back({result.offsets[i], result.correlations[i]});
  return {{"kind", "temporal"},
          {"first_tool", firstTool},
          {"second_tool", secondTool},
          {"offset_seconds", result.offsetSeconds},
          {"standard_error_seconds", result.standardErrorSeconds},
          {"signal", result.signal == SpeedSignal::Rotation ? "rotation" : "translation"},
          {"correlation", result.correlation},
          {"confidence", result.confidence},
          {"next_correlation", result.nextCorrelation},
          {"next_offset_seconds", result.nextOffsetSeconds},
          {"speed_ratio", result.speedRatio},
          {"overlap_seconds", result.overlapSeconds},
          {"middle_seconds", result.middleSeconds},
          {"drift_ppm", result.driftPpm},
          {"drift_error_ppm", result.driftErrorPpm},
          {"drifts", result.drifts},
          {"notes", result.notes},
          {"correlation_by_offset", curve}};
}

std::string Report(const HandEyeResult& result, const HandEyeParameters& parameters)
{
  return JsonPlace::Print(ToJson(result, parameters));
}

std::string Report(const PivotResult& result, const std::string& tool)
{
  return JsonPlace::Print(ToJson(result, tool));
}

std::string Report(const TemporalResult& result, const std::string& firstTool, const std::string& secondTool)
{
  return JsonPlace::Print(ToJson(result, firstTool, secondTool));
}

} // namespace echorama
