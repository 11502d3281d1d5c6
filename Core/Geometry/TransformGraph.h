// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace echorama {

/// What is known of a transform at one moment.
enum class TransformStatus { Valid, Missing, OutOfRange };

/// An edge: maps coordinates of the frame \a from to those of the frame \a to. Affine: a frame "Image" counts pixels.
struct NamedTransform {
  std::string from, to;
  Eigen::Affine3d matrix = Eigen::Affine3d::Identity();
  TransformStatus status = TransformStatus::Valid;
  std::optional<double> errorMm; ///< of the calibration, as its maker stated it
  std::string date;              ///< as its maker stated it
};

/// "ImageToProbe" or "ImageToProbeTransform" as its two frames; nothing when the text is not such a name. A name with several
/// "To" is cut where both parts begin with a capital letter, at the last such place.
std::optional<std::pair<std::string, std::string>> FramesOf(std::string_view name);

} // namespace echorama
