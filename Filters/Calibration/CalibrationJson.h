// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Json.h"
#include "Filters/Calibration/HandEye.h"
#include "Filters/Calibration/PivotCalibration.h"
#include "Filters/Calibration/TemporalCalibration.h"

namespace echorama {

/// Results of calibrations as JSON, for files, programs and people alike. Keys are in snake_case and end in their unit;
/// transforms are called by their names ("VolumeToSensor"), a list of rows in mm. Numbers that are not finite become null.
/// Classes of VTK take the text (Report): in ParaView their JSON library is another copy. A heavy header, for .cxx files only.

/// {"kind": "hand-eye", "method", "VolumeToSensor", "WorldToTracker", "target", "target_rms_mm", "target_radius95_mm",
/// "target_covariance", "covariance", "inliers", "rms_mm", "rms_degrees", "noise": {"sensor_degrees", "sensor_mm",
/// "volume_degrees", "volume_mm" (as used), "estimated", "scale"}, "scans": [{"name", "inlier", "mm", "degrees", "reason"}, ...],
/// "advice": [{"text", "axis", "degrees", "radius95_mm"}, ...], "notes"}
nlohmann::ordered_json ToJson(const HandEyeResult& result, const HandEyeParameters& parameters);
std::string Report(const HandEyeResult& result, const HandEyeParameters& parameters);

/// {"kind": "pivot", "tool", "tip", "tip_rms_mm", "tip_radius95_mm", "tip_covariance", "pivot", "poses", "inliers", "outliers"
/// (numbers of poses, from 0), "rms_mm", "noise_scale", "swing_degrees", "least_squares_tip", "sphere": {"centre", "radius_mm",
/// "radius_error_mm", "rms_mm"} or null, "notes"}
nlohmann::ordered_json ToJson(const PivotResult& result, const std::string& tool);
std::string Report(const PivotResult& result, const std::string& tool);

/// {"kind": "temporal", "first_tool", "second_tool", "offset_seconds", "standard_error_seconds", "signal", "correlation",
/// "confidence", "next_correlation", "next_offset_seconds", "speed_ratio", "overlap_seconds", "middle_seconds", "drift_ppm",
/// "drift_error_ppm", "drifts", "notes", "correlation_by_offset": [[seconds, correlation], ...]}
nlohmann::ordered_json ToJson(const TemporalResult& result, const std::string& firstTool, const std::string& secondTool);
std::string Report(const TemporalResult& result, const std::string& firstTool, const std::string& secondTool);

} // namespace echorama
