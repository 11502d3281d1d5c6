// SPDX-License-Identifier: BSD-3-Clause
//
// Local mean and deviation vary slowly, so they spread on blocks of voxels: the surface is that of the blocks which hold data,
// its values are those measured in the data alone at the middle of each block, and both channels share their weights. Only blocks
// near voxels that show background are worked out. Between blocks values are interpolated. Where a window at the surface has more
// contrast than speckle has, single bright echoes are taken out of it before its values spread (SpeckleLevel).
//
// Cost: two passes over the volume for the distance map and the statistics of the data, three over the noise to flatten it, one
// where it shows to flatten it again and one to give it its new mean and contrast, one for the overlay, whose local means are
// known by then; the diffusion depends on the blocks alone.
#include "Embed.h"
#include "BlockRows.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/VoxelTypes.h"
#include "LocalStatistics.h"
#include "RegionSurface.h"
#include "SpeckleLevel.h"
#include "ToneMapping.h"
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

namespace echorama {

namespace {

// The deviation over the mean of fully developed speckle (Rayleigh): noise of more contrast would be cut off at black.
constexpr double mostContrast = 0.5227;

// Of a window at the surface: what deviates by so many times that may hold a wall, and holds one when the mean without single
// bright echoes is so much less.
constexpr double mayBeAWall = 1.15, isAWall = 0.8;

// Blocks of about a standard deviation, or as large as the limit on their number makes them.
Blocks BlocksFor(const EmbedParameters& parameters, const std::array<int, 3>& dimensions, const Eigen::Vector3d& spacing)
{
  double mm = parameters.smoothMm;
  for (;; mm *= 1.1) {
    const Blocks blocks(dimensions, spacing, mm);
    if (static_cast<double>(blocks.count[0]) * blocks.count[1] * blocks.count[2] <= parameters.diffusionVoxels)
      return blocks;
  }
}

// Blocks in which some voxel of each mask is not 0.
std::vector<Volume<unsigned char>> BlocksWith(const Blocks& blocks, const std::vector<VolumeView<const unsigned char>>& masks,
                                              const Progress& progress)
{
  std::vector<Volume<unsigned char>> some(masks.size(), Volume<unsigned char>(blocks.count));
  const auto& n = blocks.voxels;
  ParallelFor(blocks.count[2], progress, [&](std::ptrdiff_t block) {
    const int K = static_cast<int>(block), kEnd = std::min((K + 1) * blocks.size[2], n[2]);
    std::vector<unsigned char> row(static_cast<std::size_t>(n[0])); // all rows of a row of blocks
    for (std::size_t mask = 0; mask < masks.size(); ++mask)
      for (int J = 0; J < blocks.count[1]; ++J) {
        std::fill(row.begin(), row.end(), static_cast<unsigned char>(0));
        for (int k = K * blocks.size[2]; k < kEnd; ++k)
          for (int j = J * blocks.size[1]; j < std::min((J + 1) * blocks.size[1], n[1]); ++j) {
            const unsigned char* const at = masks[mask].Row(j, k);
            std::transform(at, at + n[0], row.begin(), row.begin(), std::bit_or<unsigned char>());
          }
        unsigned char* const to = some[mask].View().Row(J, K);
        for (int i = 0; i < n[0]; ++i)
          if (row[static_cast<std::size_t>(i)])
            to[i / blocks.size[0]] = 1;
      }
  });
  return some;
}

// What is not 0, and all that touches it.
Volume<unsigned char> Grown(VolumeView<const unsigned char> mask)
{
  const auto& n = mask.Dimensions();
  Volume<unsigned char> grown(n);
  ParallelFor(n[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        for (int dk = std::max(k - 1, 0); dk <= std::min(k + 1, n[2] - 1); ++dk)
          for (int dj = std::max(j - 1, 0); dj <= std::min(j + 1, n[1] - 1); ++dj)
            for (int di = std::max(i - 1, 0); di <= std::min(i + 1, n[0] - 1); ++di)
              if (mask(di, dj, dk))
                grown.View()(i, j, k) = 1;
  });
  return grown;
}

// Where background shows.
struct Masks {
  Masks(const EmbedParameters& parameters, VolumeView<const unsigned char> region, const Eigen::Vector3d& spacing,
        VolumeView<const unsigned char> form, const Progress& progress)
    : weights(region.Dimensions()), shown(region.Dimensions())
  {
    FeatherWeights(parameters, region, form, spacing, weights.View(), progress);
    ParallelRanges(region.Size(), 1 << 16, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
      for (std::ptrdiff_t at = begin; at < end; ++at)
        shown.View()[at] = (form.Empty() || form[at]) && weights.View()[at] < 1.0f;
    });
  }
  Volume<float> weights;
  Volume<unsigned char> shown;
};

template <class T>
EmbedLevels Spread(const EmbedParameters& parameters, const LocalStatistics& statistics, VolumeView<const T> intensity,
                   VolumeView<const unsigned char> region, const Eigen::Vector3d& spacing, VolumeView<const unsigned char> shown,
                   const Progress& progress)
{
  const double roundedVariance = std::is_integral_v<T> ? 1.0 / 12.0 : 0.0; // that rounding adds to data and result alike
  EmbedLevels spread;
  const Blocks& blocks = spread.blocks = BlocksFor(parameters, region.Dimensions(), spacing);
  Volume<unsigned char> bare(region.Dimensions()); // where nothing but background shows
  ParallelRanges(region.Size(), 1 << 16, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t at = begin; at < end; ++at)
      bare.View()[at] = shown[at] && !region[at];
  });
  std::vector<Volume<unsigned char>> some =
      BlocksWith(blocks, {region, shown, std::as_const(bare).View()}, progress.Part(0.0, 0.2));
  const Volume<unsigned char>&held = some[0], &showing = some[1];
  Volume<unsigned char>& border = some[2];
  // The surface of the blocks, and whatever block holds both: the walls of holes that are smaller than a block.
  const auto outer = SurfaceOf(held.View());
  for (const auto& at : outer)
    border.View()(at[0], at[1], at[2]) = 1;
  DiffusionSources sources;
  for (int K = 0; K < blocks.count[2]; ++K)
    for (int J = 0; J < blocks.count[1]; ++J)
      for (int I = 0; I < blocks.count[0]; ++I)
        if (held.View()(I, J, K) && border.View()(I, J, K))
          sources.voxels.push_back({I, J, K});
  if (sources.voxels.empty()) // all of it is data, in a single block
    sources.voxels = {{0, 0, 0}};
  sources.channels = 2;
  const std::size_t count = sources.voxels.size();
  sources.values.resize(2 * count);
  std::array<int, 3> reach{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    reach[axis] = static_cast<int>(1.5 * parameters.smoothMm / spacing[static_cast<Eigen::Index>(axis)]);
  ParallelRanges(static_cast<std::ptrdiff_t>(count), 64, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (auto s = static_cast<std::size_t>(begin); s < static_cast<std::size_t>(end); ++s) {
      std::array<int, 3> middle{};
      for (std::size_t axis = 0; axis < 3; ++axis)
        middle[axis] = std::min(sources.voxels[s][axis] * blocks.size[axis] + blocks.size[axis] / 2, blocks.voxels[axis] - 1);
      float &level = sources.values[s], &contrast = sources.values[count + s];
      statistics.Row(middle[1], middle[2], middle[0], middle[0] + 1, &level, &contrast);
      if (level > 0.0f && contrast > static_cast<float>(mayBeAWall * mostContrast) * level) {
        const SpeckleLevel speckle = SpeckleLevelAt(intensity, region, middle, reach);
        if (speckle.mean < isAWall * static_cast<double>(level)) {
          level = static_cast<float>(speckle.mean);
          contrast = std::min(contrast, static_cast<float>(speckle.deviation));
        }
      }
    }
  });
  const double whole = std::accumulate(sources.values.begin() + static_cast<std::ptrdiff_t>(count), sources.values.end(), 0.0);
  const float least = std::max(1e-30f, static_cast<float>(1e-3 * whole / static_cast<double>(count)));
  for (std::size_t s = count; s < 2 * count; ++s)
    sources.values[s] = std::log(std::max(sources.values[s], least));
  const Eigen::Vector3d step = spacing.cwiseProduct(Eigen::Vector3d(blocks.size[0], blocks.size[1], blocks.size[2]));
  Volume<float> mean(blocks.count), deviation(blocks.count);
  const Volume<unsigned char> wanted = Grown(showing.View());
  Diffuse(parameters.diffusion, sources, step, held.View(), wanted.View(), {mean.View(), deviation.View()},
          progress.Part(0.2, 1.0));
  spread.mean = Volume<double>(blocks.count);
  spread.deviation = Volume<double>(blocks.count);
  std::copy(mean.View().begin(), mean.View().end(), spread.mean.View().begin());
  const bool echoes = std::all_of(sources.values.begin(), sources.values.begin() + static_cast<std::ptrdiff_t>(count),
                                  [](float value) { return value >= 0.0f; });
  std::transform(deviation.View().begin(), deviation.View().end(), mean.View().begin(), spread.deviation.View().begin(),
                 [&](float logarithm, float level) {
                   const double square = std::exp(2.0 * static_cast<double>(logarithm));
                   const double limit = echoes ? mostContrast * static_cast<double>(level) : std::numeric_limits<double>::max();
                   return std::min(limit, std::sqrt(std::max(0.0, square - roundedVariance)));
                 });
  return spread;
}

} // namespace

ParameterList Describe(EmbedParameters& p)
{
  ParameterList diffusion = Describe(p.diffusion);
  for (Parameter& each : diffusion)
    each.Advanced();
  return Join({Describe(static_cast<FeatherParameters&>(p)),
               {Parameter("MatchContrast", p.matchContrast,
                          "Give the background the local deviation of the data too, not their local mean alone.")},
               diffusion,
               {Parameter("DiffusionVoxels", p.diffusionVoxels, {1000, Unlimited}, "",
                          "Brightness and contrast spread on a grid of at most so many blocks.")
                    .Advanced()}});
}

double EmbedMemory(const EmbedParameters& parameters, const ImageGeometry& grid)
{
  const double voxels = static_cast<double>(grid.VoxelCount());
  const auto lattice = [&](double sigmaMm, double sums) { // see LocalStatistics
    const Blocks blocks(grid.dimensions, grid.spacing, sigmaMm / 1.5);
    return 8.0 * sums * blocks.count[0] * blocks.count[1] * blocks.count[2];
  };
  // Of the fine lattice no more than 90 slices of blocks are there at a time.
  const Blocks fine(grid.dimensions, grid.spacing, 0.5 * parameters.smoothMm / 1.5);
  const double part = std::min(1.0, 90.0 / fine.count[2]);
  // Noise and weights are floats; form, valid region, labels and two masks of what shows background a byte each. Of lattices
  // there are a coarse and a part of a fine one at a time, or two coarse ones. Made noise is held along its beams, in some 16
  // million samples at most.
  return 13.0 * voxels + lattice(parameters.smoothMm, 3.0) +
         std::max(lattice(parameters.smoothMm, 3.0), part * lattice(0.5 * parameters.smoothMm, 2.0)) +
         60.0 * std::min(voxels, static_cast<double>(parameters.diffusionVoxels)) + 0.3e9;
}

namespace {

void CheckSizes(const std::vector<std::array<int, 3>>& sizes, const std::array<int, 3>& n)
{
  if (std::any_of(sizes.begin(), sizes.end(), [&n](const std::array<int, 3>& size) { return size != n; }))
    throw Error(Error::Kind::BadInput, "embedding: data, region, noise, form and labels do not have one size");
}

void CheckSomeData(VolumeView<const unsigned char> region)
{
  if (std::none_of(region.begin(), region.end(), [](unsigned char real) { return real != 0; }))
    throw Error(Error::Kind::BadInput, "embedding: no voxel of the data is valid");
}

// Gives grain the levels where background shows. \a first: where this part begins on the grid of the levels.
void ApplyLevels(const EmbedParameters& parameters, const EmbedLevels& levels, const std::array<int, 3>& first,
                 VolumeView<const unsigned char> shown, VolumeView<float> noise, const Progress& progress)
{
  const auto& n = noise.Dimensions();
  const BlockRows rows(levels.blocks, {levels.mean.View(), levels.deviation.View()});
  ParallelFor(n[2], progress, [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    std::vector<double> values(2 * static_cast<std::size_t>(n[0]));
    double* const local[2] = {values.data(), values.data() + n[0]};
    for (int j = 0; j < n[1]; ++j) {
      const unsigned char* const shows = shown.Row(j, k);
      float* const grain = noise.Row(j, k);
      int begin = 0, end = n[0];
      while (begin < end && !shows[begin])
        ++begin;
      while (begin < end && !shows[end - 1])
        --end;
      rows.Row(j + first[1], k + first[2], begin + first[0], end + first[0], local);
      std::fill(grain, grain + begin, std::numeric_limits<float>::quiet_NaN()); // nobody sees it, and it was not worked out
      std::fill(grain + end, grain + n[0], std::numeric_limits<float>::quiet_NaN());
      for (int i = begin; i < end; ++i)
        grain[i] = shows[i] ? ApplyGrain(parameters.matchContrast, grain[i], static_cast<float>(local[0][i - begin]),
                                         static_cast<float>(local[1][i - begin]))
                            : std::numeric_limits<float>::quiet_NaN();
    }
  });
}

ToneMappingParameters ToneOf(const EmbedParameters& parameters)
{
  return {parameters.smoothMm, parameters.matchContrast};
}

} // namespace

template <class T>
void Embed(const EmbedParameters& parameters, VolumeView<const unsigned char> region, const Eigen::Vector3d& spacing,
           VolumeView<float> noise, VolumeView<const unsigned char> form, VolumeView<T> intensity,
           VolumeView<unsigned char> labels, const Progress& progress)
{
  CheckRanges(parameters);
  const auto& n = intensity.Dimensions();
  CheckSizes({region.Dimensions(), noise.Dimensions(), labels.Dimensions(), form.Empty() ? n : form.Dimensions()}, n);
  CheckSomeData(region);
  const Masks masks(parameters, region, spacing, form, progress.Part(0.0, 0.15));
  const LocalStatistics statistics =
      GrainStatistics(VolumeView<const T>(intensity), region, spacing, parameters.smoothMm, progress.Part(0.15, 0.25));
  const EmbedLevels levels =
      Spread<T>(parameters, statistics, intensity, region, spacing, masks.shown.View(), progress.Part(0.25, 0.5));
  const VolumeView<const unsigned char> shown = masks.shown.View();
  ExtractGrain(ToneOf(parameters), noise, form, spacing, noise, progress.Part(0.5, 0.75), shown);
  ApplyLevels(parameters, levels, {0, 0, 0}, shown, noise, progress.Part(0.75, 0.8));
  const LocalStatistics background(levels.blocks, levels.mean.View());
  Feather<T>(parameters, masks.weights.View(), region, noise, form, spacing, intensity, labels, progress.Part(0.8, 1.0),
             &statistics, &background);
}

template <class T>
EmbedLevels LevelsAround(const EmbedParameters& parameters, VolumeView<const unsigned char> region,
                         const Eigen::Vector3d& spacing, VolumeView<const unsigned char> form, VolumeView<const T> intensity,
                         const Progress& progress)
{
  CheckRanges(parameters);
  const auto& n = intensity.Dimensions();
  CheckSizes({region.Dimensions(), form.Empty() ? n : form.Dimensions()}, n);
  CheckSomeData(region);
  const Masks masks(parameters, region, spacing, form, progress.Part(0.0, 0.3));
  const LocalStatistics statistics = GrainStatistics(intensity, region, spacing, parameters.smoothMm, progress.Part(0.3, 0.6));
  return Spread<T>(parameters, statistics, intensity, region, spacing, masks.shown.View(), progress.Part(0.6, 1.0));
}

template <class T>
void EmbedPart(const EmbedParameters& parameters, const EmbedLevels& levels, const EmbedStatistics& statistics,
               const std::array<int, 3>& first, const GridBox& wanted, VolumeView<const unsigned char> region,
               const Eigen::Vector3d& spacing, VolumeView<float> noise, VolumeView<const unsigned char> form,
               VolumeView<T> intensity, VolumeView<unsigned char> labels, const Progress& progress)
{
  CheckRanges(parameters);
  const auto& n = intensity.Dimensions();
  CheckSizes({region.Dimensions(), noise.Dimensions(), labels.Dimensions(), form.Empty() ? n : form.Dimensions()}, n);
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (first[axis] < 0 || first[axis] > levels.blocks.voxels[axis] - n[axis])
      throw Error(Error::Kind::BadInput, "embedding: the part is not one of the grid");
  Masks masks(parameters, region, spacing, form, progress.Part(0.0, 0.4));
  ParallelFor(n[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < n[1]; ++j) {
      unsigned char* const row = masks.shown.View().Row(j, k);
      const bool isAny = wanted.HasRow(j, k);
      std::fill(row, row + (isAny ? wanted.first[0] : n[0]), static_cast<unsigned char>(0));
      std::fill(row + (isAny ? wanted.first[0] + wanted.size[0] : n[0]), row + n[0], static_cast<unsigned char>(0));
    }
  });
  const VolumeView<const unsigned char> shown = masks.shown.View();
  ExtractGrain(ToneOf(parameters), statistics.noise.From(first), statistics.grain.From(first), noise, shown,
               progress.Part(0.4, 0.7));
  ApplyLevels(parameters, levels, first, shown, noise, progress.Part(0.7, 0.8));
  const LocalStatistics own = statistics.data.From(first), others = statistics.background.From(first);
  Feather<T>(parameters, masks.weights.View(), region, noise, form, spacing, intensity, labels, progress.Part(0.8, 1.0), &own,
             &others);
}

#define EchoramaInstantiate(T)                                                                                                   \
  template void Embed(const EmbedParameters&, VolumeView<const unsigned char>, const Eigen::Vector3d&, VolumeView<float>,        \
                      VolumeView<const unsigned char>, VolumeView<T>, VolumeView<unsigned char>, const Progress&);               \
  template EmbedLevels LevelsAround(const EmbedParameters&, VolumeView<const unsigned char>, const Eigen::Vector3d&,             \
                                    VolumeView<const unsigned char>, VolumeView<const T>, const Progress&);                      \
  template void EmbedPart(const EmbedParameters&, const EmbedLevels&, const EmbedStatistics&, const std::array<int, 3>&,         \
                          const GridBox&, VolumeView<const unsigned char>, const Eigen::Vector3d&, VolumeView<float>,            \
                          VolumeView<const unsigned char>, VolumeView<T>, VolumeView<unsigned char>, const Progress&);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
