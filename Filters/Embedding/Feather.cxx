// SPDX-License-Identifier: BSD-3-Clause
//
// The depth of a voxel in its region is a distance map, as far as the ramp is long (NearDistance); the ramp is the weight. The
// overlay is one pass, row by row; with keepTexture the local means of both sides are measured before (LocalStatistics), which is
// one pass over each.
#include "Feather.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/RoundedVoxel.h"
#include "Core/Imaging/VoxelTypes.h"
#include "LocalStatistics.h"
#include "NearDistance.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

namespace echorama {

namespace {

void CheckShape(const std::array<int, 3>& wanted, const std::array<int, 3>& given, const char* name)
{
  if (given != wanted)
    throw Error(Error::Kind::BadInput, std::string("feathering: the ") + name + " does not have the size of the volume");
}

} // namespace

ParameterList Describe(FeatherParameters& p)
{
  return {
      Parameter(
          "FeatherMm", p.featherMm, {0, Unlimited}, "mm",
          "The depth in the data at which no background shows any more; from the border to there their share grows linearly. "
          "0: a hard border."),
      Parameter(
          "KeepTexture", p.keepTexture,
          "Give back what a mean of two textures loses: that of two independent speckle patterns has 0.71 of their deviation.")
          .Advanced(),
      Parameter("SmoothMm", p.smoothMm, {0, Unlimited, true}, "mm",
                "Standard deviation of the blur that parts local brightness and contrast from texture."),
  };
}

double FeatherDepth(double grainMm, const Eigen::Vector3d& spacing)
{
  const double voxel = spacing.minCoeff();
  return std::min(std::max(grainMm > 0.0 ? 2.0 * grainMm : 4.0 * voxel, 3.0 * voxel), FeatherParameters().featherMm);
}

void FeatherWeights(const FeatherParameters& parameters, VolumeView<const unsigned char> region,
                    VolumeView<const unsigned char> backgroundRegion, const Eigen::Vector3d& spacing, VolumeView<float> weights,
                    const Progress& progress)
{
  CheckRanges(parameters);
  CheckShape(region.Dimensions(), weights.Dimensions(), "array of weights");
  if (!backgroundRegion.Empty())
    CheckShape(region.Dimensions(), backgroundRegion.Dimensions(), "background's region");
  const float radius = static_cast<float>(parameters.featherMm);
  if (radius > 0.0f) {
    Volume<unsigned char> shown(region.Dimensions());
    ParallelRanges(region.Size(), 1 << 16, progress.Part(0.0, 0.1), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
      for (std::ptrdiff_t at = begin; at < end; ++at)
        shown.View()[at] = !region[at] && (backgroundRegion.Empty() || backgroundRegion[at]);
    });
    NearSquaredDistances(shown.View(), spacing, parameters.featherMm, weights, progress.Part(0.1, 0.9));
  }
  ParallelRanges(region.Size(), 1 << 16, progress.Part(0.9, 1.0), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t at = begin; at < end; ++at)
      weights[at] = !region[at] ? 0.0f : radius > 0.0f ? std::min(1.0f, std::sqrt(weights[at]) / radius) : 1.0f;
  });
}

template <class T>
void Feather(const FeatherParameters& parameters, VolumeView<const float> weights, VolumeView<const unsigned char> region,
             VolumeView<const float> background, VolumeView<const unsigned char> backgroundRegion, const Eigen::Vector3d& spacing,
             VolumeView<T> intensity, VolumeView<unsigned char> labels, const Progress& progress, const LocalStatistics* own,
             const LocalStatistics* others)
{
  CheckRanges(parameters);
  const auto& n = intensity.Dimensions();
  CheckShape(n, weights.Dimensions(), "array of weights");
  CheckShape(n, region.Dimensions(), "region");
  CheckShape(n, background.Dimensions(), "background");
  CheckShape(n, labels.Dimensions(), "array of labels");
  if (!backgroundRegion.Empty())
    CheckShape(n, backgroundRegion.Dimensions(), "background's region");

  const bool mixes = parameters.keepTexture && parameters.featherMm > 0.0;
  std::optional<LocalStatistics> measured, measuredOthers;
  if (mixes && !own)
    own = &measured.emplace(VolumeView<const T>(intensity), region, spacing, parameters.smoothMm, progress.Part(0.0, 0.3), 0.0,
                            true);
  if (mixes && !others)
    others =
        &measuredOthers.emplace(background, backgroundRegion, spacing, parameters.smoothMm, progress.Part(0.3, 0.6), 0.0, true);
  ParallelFor(n[2], progress.Part(mixes ? 0.6 : 0.0, 1.0), [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    std::vector<float> rows(2 * static_cast<std::size_t>(n[0]));
    float *mean = rows.data(), *otherMean = mean + n[0];
    for (int j = 0; j < n[1]; ++j) {
      const std::ptrdiff_t row = intensity.SliceStride() * k + intensity.RowStride() * j;
      // 1. labels, and where this row blends
      int first = n[0], end = 0;
      for (int i = 0; i < n[0]; ++i) {
        const std::ptrdiff_t at = row + i;
        const bool there = (backgroundRegion.Empty() || backgroundRegion[at]) && std::isfinite(background[at]);
        EmbeddedVoxel label = region[at] ? EmbeddedVoxel::Data : there ? EmbeddedVoxel::Invented : EmbeddedVoxel::Outside;
        if (label == EmbeddedVoxel::Data && there && weights[at] < 1.0f) {
          label = EmbeddedVoxel::Blend;
          first = std::min(first, i);
          end = i + 1;
        } else if (label != EmbeddedVoxel::Data)
          intensity[at] = label == EmbeddedVoxel::Invented ? RoundedVoxel<T>(static_cast<double>(background[at])) : T(0);
        labels[at] = static_cast<unsigned char>(label);
      }
      // 2. the blend
      if (mixes && first < end) {
        own->Row(j, k, first, end, mean + first, nullptr);
        others->Row(j, k, first, end, otherMean + first, nullptr);
      }
      for (int i = first; i < end; ++i) {
        const std::ptrdiff_t at = row + i;
        if (labels[at] != static_cast<unsigned char>(EmbeddedVoxel::Blend))
          continue;
        const double w = static_cast<double>(weights[at]), a = static_cast<double>(intensity[at]),
                     b = static_cast<double>(background[at]);
        double value = b + w * (a - b);
        if (mixes) {
          const double base =
              static_cast<double>(otherMean[i]) + w * (static_cast<double>(mean[i]) - static_cast<double>(otherMean[i]));
          value = base + (value - base) / std::sqrt(w * w + (1.0 - w) * (1.0 - w));
        }
        intensity[at] = RoundedVoxel<T>(value);
      }
    }
  });
}

#define EchoramaInstantiate(T)                                                                                                   \
  template void Feather(const FeatherParameters&, VolumeView<const float>, VolumeView<const unsigned char>,                      \
                        VolumeView<const float>, VolumeView<const unsigned char>, const Eigen::Vector3d&, VolumeView<T>,         \
                        VolumeView<unsigned char>, const Progress&, const LocalStatistics*, const LocalStatistics*);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
