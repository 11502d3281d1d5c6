// SPDX-License-Identifier: BSD-3-Clause
// Offsets and the labels that they belong to are found on a grid of some 1.5 million voxels, as seams are.
#include "Filters/Stitching/Benchmarks/StitchContestants.h"
#include "Filters/Stitching/Benchmarks/Multiband.h"
#include "Filters/Stitching/Benchmarks/SeamCut.h"
#include "Filters/Stitching/Benchmarks/StitchOffsets.h"
#include "Filters/Stitching/LowPass.h"
#include "Filters/Stitching/StitchSampler.h"
#include "Filters/Stitching/StitchScales.h"
#include <cmath>
#include <limits>
#include <utility>

namespace echorama {

namespace {

constexpr double coarseVoxels = 1.5e6;

std::vector<StitchSampler> SamplersOf(const std::vector<StitchInput>& volumes, const ImageGeometry& grid)
{
  std::vector<StitchSampler> samplers;
  for (const StitchInput& volume : volumes)
    samplers.emplace_back(volume, grid, StitchParameters().reliabilityFloor);
  return samplers;
}

// All volumes on a grid, with their scales by distance; without smooth parts.
std::vector<CoarseVolume> Resampled(const std::vector<StitchSampler>& samplers, const ImageGeometry& grid, CoverageMap& coverage)
{
  RegionMap regions(MasksOf(samplers, {}), grid.dimensions, grid.spacing);
  regions.GiveCores();
  StitchParameters parameters;
  parameters.method = StitchMethod::Distance;
  double bound = 0.0;
  const std::vector<RowField<float>> scales = StitchScales(parameters, regions, grid.spacing, bound);
  coverage = regions.Coverage();
  std::vector<CoarseVolume> volumes(samplers.size());
  for (std::size_t v = 0; v < samplers.size(); ++v) {
    CoarseVolume& volume = volumes[v];
    const GridBox box = samplers[v].Box();
    volume.inside = {box, Volume<unsigned char>(box.size)};
    volume.value = {box, Volume<float>(box.size)};
    volume.scale = {box, Volume<float>(box.size, 1.0f)};
    ForRows(box, Progress(), [&](int j, int k) {
      unsigned char* inside = volume.inside.Row(j, k);
      samplers[v].Inside(j, k, inside);
      samplers[v].Values(j, k, inside, volume.value.Row(j, k));
      const float* scale = scales[v].Row(j, k);
      const int first = scales[v].spans->First(j, k);
      for (int i = first; scale && i < scales[v].spans->End(j, k); ++i)
        if (*std::as_const(coverage).At(i, j, k) > 1)
          volume.scale.Row(j, k)[i - box.first[0]] = scale[i - first];
      for (int i = 0; i < box.size[0]; ++i)
        if (!(inside[i] & 1))
          volume.scale.Row(j, k)[i] = volume.value.Row(j, k)[i] = 0.0f;
    });
  }
  return volumes;
}

// Whether a volume is the one that is shown.
Boxed<float> ShareOf(std::size_t volume, const GridBox& box, const Volume<unsigned short>& labels)
{
  Boxed<float> share{box, Volume<float>(box.size)};
  ForRows(box, Progress(), [&](int j, int k) {
    const unsigned short* label = labels.View().Row(j, k) + box.first[0];
    for (int i = 0; i < box.size[0]; ++i)
      share.Row(j, k)[i] = label[i] == volume;
  });
  return share;
}

using Labels = Volume<unsigned short>;

// One volume per voxel, as \a choose says, and offsets that make them meet.
template <class Choose>
ContestantStitch StitchByLabels(const std::vector<StitchInput>& volumes, const ImageGeometry& grid, const Choose& choose)
{
  int step = 1;
  while (static_cast<double>(Coarsened(grid, step).VoxelCount()) > coarseVoxels)
    ++step;
  const ImageGeometry coarse = Coarsened(grid, step);
  CoverageMap coverage;
  std::vector<CoarseVolume> sampled = Resampled(SamplersOf(volumes, coarse), coarse, coverage);
  const std::vector<StitchSampler> samplers = SamplersOf(volumes, grid);
  const BlockLattice blocks = BlocksOf(grid, StitchParameters().detailScale);
  for (std::size_t v = 0; v < sampled.size(); ++v) {
    const SmoothPart smooth = LowPass(samplers[v], blocks, coverage, step);
    const PosedVolume<float> lows{smooth.low.values.View(), {}, Cropped(blocks.geometry, smooth.low.box)};
    const CoarseSampler low(RowSampler<float>(lows, coarse));
    const GridBox& box = sampled[v].inside.box;
    sampled[v].low = {box, Volume<float>(box.size)};
    ForRows(box, Progress(), [&](int j, int k) {
      float* row = sampled[v].low.Row(j, k);
      low.Row(j, k, box.first[0], box.first[0] + box.size[0], sampled[v].inside.Row(j, k),
              std::numeric_limits<float>::quiet_NaN(), row);
      for (int i = 0; i < box.size[0]; ++i)
        row[i] = std::isnan(row[i]) ? sampled[v].value.Row(j, k)[i] : row[i];
    });
  }
  const Labels labels = choose(sampled, coarse.dimensions);
  std::vector<Boxed<float>> shares, offsets = OffsetFields(sampled, labels, coarse.spacing);
  for (std::size_t v = 0; v < sampled.size(); ++v)
    shares.push_back(ShareOf(v, sampled[v].inside.box, labels));

  ContestantStitch result{Volume<float>(grid.dimensions), Volume<unsigned char>(grid.dimensions)};
  Volume<float> total(grid.dimensions);
  for (std::size_t v = 0; v < sampled.size(); ++v) {
    const CoarseSampler offsetAt(offsets[v], sampled[v].inside, coarse, grid),
        shareAt(shares[v], sampled[v].inside, coarse, grid);
    const GridBox& box = samplers[v].Box();
    ForRows(box, Progress(), [&](int j, int k) {
      const auto n = static_cast<std::size_t>(box.size[0]);
      std::vector<unsigned char> inside(n);
      std::vector<float> value(n), offset(n), share(n);
      samplers[v].Inside(j, k, inside.data());
      samplers[v].Values(j, k, inside.data(), value.data());
      offsetAt.Row(j, k, box.first[0], box.first[0] + box.size[0], inside.data(), 0.0f, offset.data());
      shareAt.Row(j, k, box.first[0], box.first[0] + box.size[0], inside.data(), 0.0f, share.data());
      float *sum = result.values.View().Row(j, k) + box.first[0], *weight = total.View().Row(j, k) + box.first[0];
      unsigned char* count = result.coverage.View().Row(j, k) + box.first[0];
      for (std::size_t i = 0; i < n; ++i)
        if (inside[i] & 1) {
          const float least = std::max(share[i], 1e-6f); // somebody is shown wherever a volume is
          sum[i] += least * (value[i] + offset[i]);
          weight[i] += least;
          ++count[i];
        }
    });
  }
  for (std::ptrdiff_t at = 0; at < total.View().Size(); ++at)
    if (total.View()[at] > 0.0f)
      result.values.View()[at] /= total.View()[at];
  return result;
}

} // namespace

ContestantStitch StitchByMultiband(const std::vector<StitchInput>& volumes, const ImageGeometry& grid)
{
  ContestantStitch result{{}, Volume<unsigned char>(grid.dimensions)};
  CoverageMap coverage;
  std::vector<CoarseVolume> sampled = Resampled(SamplersOf(volumes, grid), grid, coverage);
  ForRows({{0, 0, 0}, grid.dimensions}, Progress(),
          [&](int j, int k) { coverage.Copy(0, j, k, grid.dimensions[0], result.coverage.View().Row(j, k)); });
  const Volume<unsigned short> labels = LargestScale(sampled, grid.dimensions);
  std::vector<ResampledVolume> resampled;
  for (std::size_t v = 0; v < sampled.size(); ++v)
    resampled.push_back({std::move(sampled[v].value), std::move(sampled[v].inside), ShareOf(v, sampled[v].scale.box, labels)});
  result.values = BlendMultiband(resampled, grid.dimensions);
  return result;
}

ContestantStitch StitchByOffsets(const std::vector<StitchInput>& volumes, const ImageGeometry& grid)
{
  return StitchByLabels(volumes, grid, LargestScale);
}

ContestantStitch StitchBySeams(const std::vector<StitchInput>& volumes, const ImageGeometry& grid)
{
  return StitchByLabels(volumes, grid, [](const auto& sampled, const auto& size) { return CutSeams(sampled, size); });
}

Volume<unsigned short> LargestScale(const std::vector<CoarseVolume>& volumes, const std::array<int, 3>& dimensions)
{
  Volume<unsigned short> labels(dimensions, noVolume);
  Volume<float> best(dimensions, -1.0f);
  for (std::size_t v = 0; v < volumes.size(); ++v) {
    const CoarseVolume& volume = volumes[v];
    const GridBox& box = volume.inside.box;
    ForRows(box, Progress(), [&](int j, int k) {
      unsigned short* label = labels.View().Row(j, k) + box.first[0];
      float* most = best.View().Row(j, k) + box.first[0];
      for (int i = 0; i < box.size[0]; ++i) {
        const float trust = volume.trust.box.Empty() ? 1.0f : volume.trust.Row(j, k)[i];
        const float scale = volume.scale.box.Empty() ? 1.0f : volume.scale.Row(j, k)[i];
        if ((volume.inside.Row(j, k)[i] & 1) && scale * trust > most[i]) {
          most[i] = scale * trust;
          label[i] = static_cast<unsigned short>(v);
        }
      }
    });
  }
  return labels;
}

} // namespace echorama
