// SPDX-License-Identifier: BSD-3-Clause
// Three passes over the volumes, each parallel over rows of the output:
//   1. where each lies in the grid (a mask in its own box), from which RegionMap knows pure, overlap and empty regions;
//   2. volumes that others cover wholly get a core;
//   3. one volume after the other is resampled; where it is alone its value is final, where it overlaps it goes into a
//      running blend (BlendSum) with the scale that its two distance maps give, and how far it can be trusted there. The maps
//      live for one volume only, and the blend is kept for voxels of the overlap only, in the dense numbering that RegionMap
//      gives them.
// Volumes come in their order and every voxel is worked on by one thread, so threads do not change the result.
#include "Stitch.h"
#include "BlendWeights.h"
#include "Core/Base/Error.h"
#include "Core/Imaging/VoxelTypes.h"
#include "RegionMap.h"
#include "RowSampler.h"
#include "StitchGrid.h"
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <unistd.h>

namespace echorama {

namespace {

// Blends are kept in float, those of doubles in double.
template <class T>
using Accumulator = std::conditional_t<std::is_same_v<T, double>, double, float>;

using AnySampler =
    std::variant<RowSampler<unsigned char>, RowSampler<short>, RowSampler<unsigned short>, RowSampler<float>, RowSampler<double>>;

const ImageGeometry& GeometryOf(const StitchInput& input)
{
  return std::visit([](const auto& volume) -> const ImageGeometry& { return volume.geometry; }, input.volume);
}

std::vector<ImageGeometry> GeometriesOf(const std::vector<StitchInput>& inputs)
{
  std::vector<ImageGeometry> geometries;
  for (const StitchInput& input : inputs)
    geometries.push_back(GeometryOf(input));
  return geometries;
}

AnySampler SamplerOf(const StitchInput& input, const ImageGeometry& grid)
{
  return std::visit(
      [&](const auto& volume) -> AnySampler {
        if (volume.intensity.Dimensions() != volume.geometry.dimensions ||
            (!volume.valid.Empty() && volume.valid.Dimensions() != volume.geometry.dimensions))
          throw Error(Error::Kind::BadInput, input.name + ": its voxels are not of the size that its geometry says");
        return RowSampler(volume, grid, input.displacement);
      },
      input.volume);
}

// How far the voxels of a volume can be trusted, row by row of its box in the grid; 1 where it does not say.
class Trust {
public:
  Trust(const StitchInput& input, const ImageGeometry& grid, double floor) : floor_(static_cast<float>(floor))
  {
    if (input.reliability.Empty())
      return;
    std::visit(
        [&](const auto& volume) {
          if (input.reliability.Dimensions() != volume.geometry.dimensions)
            throw Error(Error::Kind::BadInput, input.name + ": its reliability is not of the size that its geometry says");
          sampler_.emplace(PosedVolume<float>{input.reliability, volume.valid, volume.geometry}, grid, input.displacement);
        },
        input.volume);
  }

  explicit operator bool() const { return sampler_.has_value(); }

  // Numbers in [floor, 1], where bit 0 of inside is set. What is not a number is not trusted.
  void Row(int j, int k, const unsigned char* inside, std::vector<float>& trust) const
  {
    sampler_->Values(j, k, inside, trust.data());
    for (float& value : trust)
      value = value > floor_ ? std::min(value, 1.0f) : floor_;
  }

private:
  float floor_;
  std::optional<RowSampler<float>> sampler_;
};

template <class T, class A>
T Rounded(A value)
{
  if constexpr (std::is_integral_v<T>)
    return static_cast<T>(std::clamp(std::floor(value + A(0.5)), static_cast<A>(std::numeric_limits<T>::min()),
                                     static_cast<A>(std::numeric_limits<T>::max())));
  else
    return static_cast<T>(value);
}

std::string Gigabytes(double bytes)
{
  char text[32];
  std::snprintf(text, sizeof text, bytes < 1e8 ? "%.3g GB" : "%.1f GB", bytes * 1e-9);
  return text;
}

double AllowedMemory(const StitchParameters& parameters)
{
  if (parameters.maximumMemoryGb > 0.0)
    return parameters.maximumMemoryGb * 1e9;
  return 0.75 * static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

std::vector<Boxed<unsigned char>> MasksOf(const std::vector<AnySampler>& samplers, const Progress& progress)
{
  std::vector<Boxed<unsigned char>> masks(samplers.size());
  for (std::size_t v = 0; v < samplers.size(); ++v)
    std::visit(
        [&](const auto& sampler) {
          masks[v].box = sampler.Box();
          if (masks[v].box.Empty())
            return;
          masks[v].values = Volume<unsigned char>(sampler.Box().size);
          const double n = static_cast<double>(samplers.size());
          ForRows(sampler.Box(), progress.Part(static_cast<double>(v) / n, static_cast<double>(v + 1) / n),
                  [&](int j, int k) { sampler.Inside(j, k, masks[v].Row(j, k)); });
        },
        samplers[v]);
  return masks;
}

void CheckRegions(const StitchParameters& parameters, const std::vector<StitchInput>& inputs, const RegionMap& regions)
{
  for (int v = 0; v < regions.Count(); ++v)
    if (regions.InsideCount(v) == 0)
      throw Error(Error::Kind::BadInput,
                  inputs[v].name + ": none of its voxels is real (inside its valid region and finite) at a voxel of the output");
  for (int v = 0; v < regions.Count() && !parameters.allowDisjoint; ++v)
    if (regions.OverlapCount(v) == 0)
      throw Error(Error::Kind::NotPossible,
                  inputs[v].name + " overlaps no other volume; check its pose, or set AllowDisjoint to put it where it is");
}

// The scales of one volume in its overlap region.
class Scales {
public:
  Scales(StitchMethod method, const RegionMap& regions, int volume, const Progress& progress) : method_(method)
  {
    if (regions.OverlapCount(volume) == 0)
      return;
    if (method == StitchMethod::Distance) {
      pure_ = regions.SquaredDistanceTo(Region::Pure, volume, progress.Part(0.0, 0.5));
      empty_ = regions.SquaredDistanceTo(Region::Empty, volume, progress.Part(0.5, 1.0));
    } else if (method == StitchMethod::Feather) {
      depth_ = regions.SquaredDepth(volume, progress);
    }
  }

  // For one row of the grid: at(i) is the scale of an overlap voxel of this volume.
  class Row {
  public:
    Row(const Scales& scales, int j, int k)
      : method_(scales.method_), pure_(scales.pure_, j, k), empty_(scales.empty_, j, k), depth_(scales.depth_, j, k)
    {
    }
    float operator()(int i) const
    {
      if (method_ == StitchMethod::Distance)
        return BlendScale(pure_(i), empty_(i));
      return method_ == StitchMethod::Feather ? depth_(i) : 1.0f;
    }

  private:
    struct Distance {
      Distance(const Boxed<float>& map, int j, int k) : squared(map.box.HasRow(j, k) ? map.Row(j, k) - map.box.first[0] : nullptr)
      {
      }
      float operator()(int i) const { return squared ? std::sqrt(squared[i]) : std::numeric_limits<float>::infinity(); }
      const float* squared;
    };
    StitchMethod method_;
    Distance pure_, empty_, depth_;
  };

private:
  StitchMethod method_;
  Boxed<float> pure_, empty_, depth_;
};

} // namespace

ImageGeometry ReachOf(const StitchInput& input)
{
  ImageGeometry reach = GeometryOf(input);
  if (!input.displacement)
    return reach;
  Eigen::Vector3d first;
  for (int axis = 0; axis < 3; ++axis) {
    const double voxels = std::ceil(input.displacement->Bound() / reach.spacing[axis]);
    if (!(reach.dimensions[axis] + 2.0 * voxels <= std::numeric_limits<int>::max()))
      throw Error(Error::Kind::BadInput, input.name + ": its displacement is too long");
    reach.dimensions[axis] += 2 * static_cast<int>(voxels);
    first[axis] = -voxels;
  }
  reach.origin = reach.IndexToWorld() * first;
  return reach;
}

double StitchMemory(const StitchParameters& parameters, const std::vector<ImageGeometry>& volumes, const ImageGeometry& grid,
                    std::size_t voxelBytes, bool weights)
{
  const double voxels = static_cast<double>(grid.VoxelCount());
  double boxes = 0.0, largestBox = 0.0;
  for (const ImageGeometry& volume : volumes) {
    const double box = static_cast<double>(BoxOf(volume, grid).VoxelCount());
    boxes += box;
    largestBox = std::max(largestBox, box);
  }
  const double overlap = std::min(voxels, boxes / 2.0); // every voxel of it lies in two boxes
  const double blend =
      overlap * static_cast<double>(voxelBytes == sizeof(double) ? sizeof(BlendSum<double>) : sizeof(BlendSum<float>));
  const double output =
      voxels * (static_cast<double>(voxelBytes) + 2.0 + (weights ? 4.0 * static_cast<double>(volumes.size()) : 0.0));
  double maps = 0.0;
  if (parameters.method == StitchMethod::Distance)
    maps = 4.0 * largestBox + 5.0 * voxels;
  else if (parameters.method == StitchMethod::Feather)
    maps = 5.0 * largestBox;
  return output + boxes + blend + maps;
}

void CheckStitch(const StitchParameters& parameters, const std::vector<ImageGeometry>& volumes, const ImageGeometry& grid,
                 std::size_t voxelBytes, bool weights)
{
  if (!(parameters.sharpness >= 0.0 && parameters.sharpness <= 1000.0))
    throw Error(Error::Kind::InvalidParameter,
                "Sharpness is " + std::to_string(parameters.sharpness) + "; it must be in [0, 1000]");
  if (!(parameters.reliabilityFloor > 0.0 && parameters.reliabilityFloor <= 1.0))
    throw Error(Error::Kind::InvalidParameter,
                "ReliabilityFloor is " + std::to_string(parameters.reliabilityFloor) + "; it must be in (0, 1]");
  if (!(parameters.maximumMemoryGb >= 0.0))
    throw Error(Error::Kind::InvalidParameter,
                "MaximumMemoryGb is " + std::to_string(parameters.maximumMemoryGb) + "; it must not be negative");
  grid.Check("the output grid");
  const double needed = StitchMemory(parameters, volumes, grid, voxelBytes, weights), allowed = AllowedMemory(parameters);
  if (needed <= allowed)
    return;
  double spacing = std::cbrt(grid.spacing.prod());
  for (double bytes = needed; bytes > allowed;) {
    spacing *= std::max(1.01, std::cbrt(bytes / allowed));
    const double digit = std::pow(10.0, std::floor(std::log10(spacing)) - 1.0);
    spacing = std::ceil(spacing / digit) * digit; // two digits, rounded up
    bytes = StitchMemory(parameters, volumes, StitchGrid(volumes, spacing), voxelBytes, weights);
  }
  char suggestion[32];
  std::snprintf(suggestion, sizeof suggestion, "%.2g", spacing);
  const auto& n = grid.dimensions;
  throw Error(Error::Kind::TooLarge, "stitching " + std::to_string(volumes.size()) + " volumes onto " + std::to_string(n[0]) +
                                         " x " + std::to_string(n[1]) + " x " + std::to_string(n[2]) + " voxels needs " +
                                         Gigabytes(needed) + ", more than the " + Gigabytes(allowed) +
                                         " allowed (MaximumMemoryGb); SpacingMm = " + suggestion + " would fit");
}

template <class T>
void Stitch(const StitchParameters& parameters, const std::vector<StitchInput>& inputs, const ImageGeometry& grid,
            const StitchOutput<T>& output, const Progress& progress)
{
  using A = Accumulator<T>;
  const std::vector<ImageGeometry> geometries = GeometriesOf(inputs);
  if (inputs.size() < 2)
    throw Error(Error::Kind::BadInput, "stitching needs at least two volumes; " + std::to_string(inputs.size()) + " came in");
  for (std::size_t v = 0; v < inputs.size(); ++v)
    geometries[v].Check(inputs[v].name);
  std::vector<ImageGeometry> reaches;
  for (const StitchInput& input : inputs)
    reaches.push_back(ReachOf(input));
  CheckStitch(parameters, reaches, grid, sizeof(T), !output.weights.empty());

  // 1. regions
  std::vector<AnySampler> samplers;
  for (const StitchInput& input : inputs)
    samplers.push_back(SamplerOf(input, grid));
  std::vector<Trust> trusts;
  for (const StitchInput& input : inputs)
    trusts.emplace_back(input, grid, parameters.reliabilityFloor);
  RegionMap regions(MasksOf(samplers, progress.Part(0.0, 0.15)), grid.spacing, output.coverage, progress.Part(0.15, 0.2));
  CheckRegions(parameters, inputs, regions);

  // 2. cores
  const bool distance = parameters.method == StitchMethod::Distance, maximum = parameters.method == StitchMethod::Maximum;
  if (distance)
    regions.GiveCores(progress.Part(0.2, 0.3));

  // 3. blend
  const BlendPower power(distance ? parameters.sharpness : parameters.method == StitchMethod::Feather ? 1.0 : 0.0);
  std::vector<BlendSum<A>> blend(static_cast<std::size_t>(regions.OverlapCount()));
  std::fill(output.intensity.begin(), output.intensity.end(), T(0));
  for (const auto& weights : output.weights)
    std::fill(weights.begin(), weights.end(), 0.0f);
  for (int v = 0; v < regions.Count(); ++v) {
    const Progress part = progress.Part(0.3 + 0.6 * v / regions.Count(), 0.3 + 0.6 * (v + 1) / regions.Count());
    const Scales scales(parameters.method, regions, v, part.Part(0.0, 0.6));
    const GridBox& box = regions.Box(v);
    const Trust& trust = trusts[v];
    const auto blendRows = [&](const auto& sampler, std::ptrdiff_t begin, std::ptrdiff_t end) {
      std::vector<A> values(box.size[0]);
      std::vector<float> factors(box.size[0], 1.0f);
      for (std::ptrdiff_t row = begin; row < end; ++row) {
        const int j = box.first[1] + static_cast<int>(row % box.size[1]), k = box.first[2] + static_cast<int>(row / box.size[1]);
        const unsigned char* inside = regions.MaskRow(v, j, k);
        const unsigned char* covered = output.coverage.Row(j, k) + box.first[0];
        T* result = output.intensity.Row(j, k) + box.first[0];
        float* weight = output.weights.empty() ? nullptr : output.weights[v].Row(j, k) + box.first[0];
        const Scales::Row scale(scales, j, k);
        sampler.Values(j, k, inside, values.data());
        if (trust)
          trust.Row(j, k, inside, factors);
        std::ptrdiff_t number = regions.OverlapBefore(box.first[0], j, k);
        for (int i = 0; i < box.size[0]; ++i) {
          const bool overlap = covered[i] > 1;
          const std::ptrdiff_t here = number;
          number += overlap;
          if (!(inside[i] & 1))
            continue;
          if (!overlap) {
            result[i] = Rounded<T>(values[i]);
            if (weight)
              weight[i] = 1.0f;
            continue;
          }
          BlendSum<A>& sum = blend[here];
          if (maximum) {
            // The scale says which volume is shown: the first is number 1.
            if (sum.total == 0.0f || values[i] > sum.mean)
              sum = {values[i], static_cast<float>(v + 1), 1.0f};
            continue;
          }
          const float s = scale(box.first[0] + i);
          sum.Add(values[i], s, power, factors[i]);
          if (weight)
            weight[i] = s; // becomes the weight once all volumes came
        }
      }
    };
    std::visit(
        [&](const auto& sampler) {
          ParallelRanges(static_cast<std::ptrdiff_t>(box.size[1]) * box.size[2], rowsOfOneTask, part.Part(0.6, 1.0),
                         [&](std::ptrdiff_t begin, std::ptrdiff_t end) { blendRows(sampler, begin, end); });
        },
        samplers[v]);
  }

  // The blend of the overlap, and what follows from the coverage.
  const GridBox all{{0, 0, 0}, grid.dimensions};
  ForRows(all, progress.Part(0.9, 1.0), [&](int j, int k) {
    const unsigned char* covered = output.coverage.Row(j, k);
    T* result = output.intensity.Row(j, k);
    unsigned char* valid = output.valid.Row(j, k);
    std::ptrdiff_t number = regions.OverlapBefore(0, j, k);
    for (int i = 0; i < grid.dimensions[0]; ++i) {
      valid[i] = covered[i] > 0;
      if (covered[i] > 1)
        result[i] = Rounded<T>(blend[number++].mean);
    }
  });
  for (std::size_t v = 0; v < output.weights.size(); ++v) {
    const GridBox& box = regions.Box(static_cast<int>(v));
    ForRows(box, Progress(), [&](int j, int k) {
      const unsigned char* inside = regions.MaskRow(static_cast<int>(v), j, k);
      std::vector<float> factors(box.size[0], 1.0f);
      if (trusts[v])
        trusts[v].Row(j, k, inside, factors);
      const unsigned char* covered = output.coverage.Row(j, k) + box.first[0];
      float* weight = output.weights[v].Row(j, k) + box.first[0];
      std::ptrdiff_t number = regions.OverlapBefore(box.first[0], j, k);
      for (int i = 0; i < box.size[0]; ++i)
        if (covered[i] > 1) {
          const BlendSum<A>& sum = blend[number++];
          if (inside[i] & 1)
            weight[i] =
                maximum ? static_cast<float>(sum.largest == static_cast<float>(v + 1)) : sum.Weight(weight[i], power, factors[i]);
        }
    });
  }
}

#define EchoramaInstantiate(T)                                                                                                   \
  template void Stitch<T>(const StitchParameters&, const std::vector<StitchInput>&, const ImageGeometry&,                        \
                          const StitchOutput<T>&, const Progress&);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
