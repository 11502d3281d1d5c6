// SPDX-License-Identifier: BSD-3-Clause
#include "StitchJson.h"

namespace echorama {

using Json = nlohmann::ordered_json;

namespace {
Json ToJson(const SeamVisibility& seam)
{
  return {{"mean", seam.mean}, {"gradient", seam.gradient}, {"faces", seam.faces}};
}
} // namespace

Json ToJson(const StitchCost& cost)
{
  const Eigen::Vector3d& spacing = cost.grid.spacing;
  return {{"volumes", cost.volumes},
          {"dimensions", cost.grid.dimensions},
          {"spacing", {spacing.x(), spacing.y(), spacing.z()}},
          {"plan_factor", cost.planFactor},
          {"plan_bytes", cost.planBytes},
          {"output_bytes", cost.outputBytes},
          {"allowed_bytes", cost.allowedBytes},
          {"slabs", cost.slabs}};
}

Json ToJson(const StitchQualityReport& quality)
{
  return {{"seam_mean", quality.seamMean},           {"seam_gradient", quality.seamGradient},
          {"borders", ToJson(quality.borders)},      {"cuts", ToJson(quality.cuts)},
          {"texture_kept", quality.textureKept},     {"snr", quality.snr},
          {"snr_sources", quality.snrSources},       {"overlap_windows", quality.overlapWindows},
          {"overlap_voxels", quality.overlapVoxels}, {"error_overlap", quality.errorOverlap},
          {"error_outside", quality.errorOutside}};
}

std::string Report(const StitchCost& cost)
{
  return ToJson(cost).dump();
}

std::string Report(const StitchQualityReport& quality)
{
  return ToJson(quality).dump();
}

} // namespace echorama
