// SPDX-License-Identifier: BSD-3-Clause
// The plan, in its order:
//   1. masks of the volumes on the plan's grid, from which RegionMap knows pure, overlap and empty regions; cores;
//   2. a scale per volume at the voxels of its overlap (StitchScales), kept in spans of rows;
//   3. where gains or textures are wanted: smooth parts of the volumes (LowPass, on their own lattices), and all volumes on a
//      coarse copy of the grid, on which gains and correlations are found.
// Masks and maps are gone when the plan stands. Rendering goes row by row: every volume that covers the row is sampled, and
// what belongs to a voxel is gathered and blended there. Nothing is kept per voxel but the output, and no voxel needs its
// neighbours, so boxes and threads do not change the result.
#include "Stitch.h"
#include "BlendWeights.h"
#include "Core/Base/Error.h"
#include "Core/Imaging/RoundedVoxel.h"
#include "Core/Imaging/VoxelTypes.h"
#include "LowPass.h"
#include "RegionMap.h"
#include "StitchGain.h"
#include "StitchMemory.h"
#include "StitchSampler.h"
#include "StitchScales.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace echorama {

namespace {

// What is decided for all voxels together is decided on a grid of about so many at most.
constexpr double coarseVoxels = 1.5e6;

// Details are made stronger or weaker by no more than this: a shadow holds nothing but noise.
constexpr float mostAmplified = 2.0f;

constexpr float noValue = std::numeric_limits<float>::quiet_NaN();

// Sums are kept in float, those of doubles in double.
template <class T>
using Accumulator = std::conditional_t<std::is_same_v<T, double>, double, float>;

void CheckRegions(const StitchParameters& parameters, const std::vector<StitchInput>& inputs, const RegionMap& regions)
{
  for (int v = 0; v < regions.Count(); ++v)
    if (regions.InsideCount(v) == 0)
      throw Error(Error::Kind::BadInput, inputs[v].name + ": no voxel is valid and finite at a voxel of the output grid");
  for (int v = 0; v < regions.Count() && !parameters.allowDisjoint; ++v)
    if (regions.OverlapCount(v) == 0)
      throw Error(Error::Kind::NotPossible,
                  inputs[v].name + " overlaps no other volume; check its pose, or set AllowDisjoint to put it where it is");
}

bool IsTextured(const StitchParameters& parameters)
{
  const bool weighted = parameters.method == StitchMethod::Distance || parameters.method == StitchMethod::Feather ||
                        parameters.method == StitchMethod::Membrane;
  return weighted && parameters.texture != StitchTexture::Mix;
}

} // namespace

ParameterList Describe(StitchParameters& p)
{
  return {
      Parameter(
          "Method", Choice(p.method, {"distance", "feather", "average", "maximum", "membrane"}),
          "What decides how much each volume counts. Membrane: the smoothest surface from where it is alone to where only "
          "others are; distance: the distances to these; feather: the distance to its own border; average: nothing, so that "
          "the plain mean is shown; maximum: the largest value is shown."),
      Parameter(
          "Texture", Choice(p.texture, {"mix", "split"}),
          "What becomes of speckle and edges where volumes overlap. Mix: their weighted mean, which washes them out; split: they "
          "change over in a narrow transition, amplified by what mixtures lose.")
          .When("Method", "distance")
          .When("Method", "feather")
          .When("Method", "membrane"),
      Parameter(
          "Sharpness", p.sharpness, {0, 1000}, "",
          "Exponent of the weights: 0 is the plain average, 1 a ramp across the whole overlap, 50 nearly a hard edge half-way.")
          .When("Method", "distance")
          .When("Method", "membrane"),
      Parameter("DetailSharpness", p.detailSharpness, {0, 1000}, "",
                "The same exponent for speckle and edges. With 32 about a sixteenth of the overlap is transition.")
          .When("Texture", "split")
          .Advanced(),
      Parameter("DetailScale", p.detailScale, {1, 100}, "voxels of the output",
                "What counts as smooth: the standard deviation of the filter that parts it from details.")
          .Advanced(),
      Parameter("EqualizeGain", p.equalizeGain,
                "Find a gain and an offset for each volume where volumes overlap, and apply them."),
      Parameter("ReliabilityFloor", p.reliabilityFloor, {0, 1, true}, "",
                "What cannot be trusted at all still counts by this: where nothing better is there it is shown.")
          .When("UseReliability", "on")
          .Advanced(),
      Parameter("AllowDisjoint", p.allowDisjoint,
                "Accept volumes that overlap no other, and put them in their place. Off, that is an error.")
          .Advanced(),
      Parameter("MaximumMemoryGb", p.maximumMemoryGb, {0, Unlimited}, "GB",
                "Refuse what needs more memory beside the volumes, in 10^9 bytes. 0: three quarters of the machine's memory.")
          .Advanced(),
      Parameter("MembraneTolerance", p.membraneTolerance, {0, 1, true}, "", "Largest error of the weights of two volumes."),
  };
}

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

// A field on a box of a coarse grid, and where it is known.
struct CoarseField {
  Boxed<float> values;
  Boxed<unsigned char> known;
};

struct StitchPlan::Parts {
  StitchParameters parameters;
  std::vector<StitchInput> inputs;
  ImageGeometry grid;
  std::vector<StitchSampler> samplers;
  int factor = 1;
  double bound = 0.0;
  bool textured = false;
  std::vector<RowField<float>> scales;   // on the grid (factor 1); an empty one: 1 everywhere
  std::vector<CoarseField> coarseScales; // or on the coarser grid of the plan
  BlockLattice blocks;                   // of the smooth parts
  std::vector<SmoothPart> lows;
  StitchGains gains;
  std::vector<CoarseSampler> scaleSamplers, lowSamplers, deviationSamplers;

  bool NeedsLows() const { return textured || parameters.equalizeGain; }
  CoarseSampler BlockSampler(const Boxed<float>& field, const ImageGeometry& where) const
  {
    const PosedVolume<float> blockwise{field.values.View(), {}, Cropped(blocks.geometry, field.box)};
    return CoarseSampler(RowSampler<float>(blockwise, where));
  }
  void FindScales(const Progress& progress);
  std::vector<CoarseVolume> CoarseVolumes(const ImageGeometry& coarse, int step) const;
  void FindWhatIsCoarse(const Progress& progress);
  void ScaleRow(int volume, int j, int k, int first, int end, const unsigned char* wanted, float* scale) const;
  template <class T>
  class RowBlender;
};

// The scales of a volume at wanted voxels of a row of the grid.
void StitchPlan::Parts::ScaleRow(int volume, int j, int k, int first, int end, const unsigned char* wanted, float* scale) const
{
  if (!scaleSamplers.empty()) {
    scaleSamplers[volume].Row(j, k, first, end, wanted, 1.0f, scale);
    return;
  }
  const RowField<float>& field = scales[volume];
  const float* row = field.Row(j, k);
  if (!row) {
    std::fill(scale, scale + (end - first), 1.0f);
    return;
  }
  const int from = std::max(first, field.spans->First(j, k)), to = std::min(end, field.spans->End(j, k));
  if (from < to)
    std::copy(row + (from - field.spans->First(j, k)), row + (to - field.spans->First(j, k)), scale + (from - first));
}

void StitchPlan::Parts::FindScales(const Progress& progress)
{
  const ImageGeometry planGrid = Coarsened(grid, factor);
  std::vector<StitchSampler> coarser;
  if (factor > 1)
    for (const StitchInput& input : inputs)
      coarser.emplace_back(input, planGrid, parameters.reliabilityFloor);
  Volume<unsigned char> coverage(planGrid.dimensions);
  RegionMap regions(MasksOf(factor > 1 ? coarser : samplers, progress.Part(0.0, 0.15)), planGrid.spacing, coverage.View(),
                    progress.Part(0.15, 0.2));
  if (factor == 1)
    CheckRegions(parameters, inputs, regions);
  const StitchMethod method = parameters.method;
  if (method == StitchMethod::Distance || method == StitchMethod::Membrane)
    regions.GiveCores(progress.Part(0.2, 0.3));
  const VolumeView<const unsigned char> covered = coverage.View();
  scales = StitchScales(parameters, regions, covered, planGrid.spacing, bound, progress.Part(0.3, 0.85));
  if (NeedsLows()) {
    blocks = BlocksOf(grid, parameters.detailScale);
    const double n = static_cast<double>(inputs.size());
    for (std::size_t v = 0; v < inputs.size(); ++v)
      lows.push_back(
          LowPass(samplers[v], blocks, covered, factor,
                  progress.Part(0.85 + 0.15 * static_cast<double>(v) / n, 0.85 + 0.15 * static_cast<double>(v + 1) / n),
                  factor == 1 ? &regions.Mask(static_cast<int>(v)) : nullptr));
  }
  if (factor == 1 || method == StitchMethod::Average || method == StitchMethod::Maximum)
    return;
  // Interpolation needs to know 1 and 0 beyond the overlap as well.
  for (int v = 0; v < regions.Count(); ++v) {
    CoarseField field;
    const GridBox& own = regions.Box(v);
    for (int axis = 0; axis < 3 && !own.Empty(); ++axis) {
      field.values.box.first[axis] = std::max(0, own.first[axis] - 1);
      field.values.box.size[axis] =
          std::min(planGrid.dimensions[axis], own.first[axis] + own.size[axis] + 1) - field.values.box.first[axis];
    }
    field.known.box = field.values.box;
    field.values.values = Volume<float>(field.values.box.size);
    field.known.values = Volume<unsigned char>(field.known.box.size);
    ForRows(field.values.box, Progress(), [&](int j, int k) {
      float* value = field.values.Row(j, k);
      unsigned char* known = field.known.Row(j, k);
      const unsigned char* inside = own.HasRow(j, k) ? regions.MaskRow(v, j, k) : nullptr;
      const float* scale = scales[v].Row(j, k);
      for (int x = 0; x < field.values.box.size[0]; ++x) {
        const int i = field.values.box.first[0] + x;
        known[x] = covered(i, j, k) > 0;
        const bool here = inside && i >= own.first[0] && i < own.first[0] + own.size[0] && (inside[i - own.first[0]] & 1);
        if (here)
          value[x] = covered(i, j, k) == 1 || !scale ? 1.0f : scale[i - scales[v].spans->First(j, k)];
      }
    });
    coarseScales.push_back(std::move(field));
  }
  scales.clear();
  for (const CoarseField& field : coarseScales)
    scaleSamplers.emplace_back(field.values, field.known, planGrid, grid);
}

// All volumes on a coarse copy of the grid, every step-th voxel of it.
std::vector<CoarseVolume> StitchPlan::Parts::CoarseVolumes(const ImageGeometry& coarse, int step) const
{
  std::vector<CoarseVolume> volumes(inputs.size());
  Volume<unsigned char> coverage(coarse.dimensions);
  for (std::size_t v = 0; v < inputs.size(); ++v) {
    CoarseVolume& volume = volumes[v];
    const StitchSampler sampler(inputs[v], coarse, parameters.reliabilityFloor);
    const GridBox box = sampler.Box();
    volume.inside = {box, Volume<unsigned char>(box.size)};
    volume.value = {box, Volume<float>(box.size)};
    volume.low = {box, Volume<float>(box.size)};
    if (sampler.HasTrust())
      volume.trust = {box, Volume<float>(box.size)};
    const CoarseSampler low = BlockSampler(lows[v].low, coarse);
    ForRows(box, Progress(), [&](int j, int k) {
      unsigned char* inside = volume.inside.Row(j, k);
      sampler.Inside(j, k, inside);
      sampler.Values(j, k, inside, volume.value.Row(j, k));
      // Outside of the overlap there is no smooth part, and no use for one.
      low.Row(j, k, box.first[0], box.first[0] + box.size[0], inside, noValue, volume.low.Row(j, k));
      for (int i = 0; i < box.size[0]; ++i)
        if (std::isnan(volume.low.Row(j, k)[i]))
          volume.low.Row(j, k)[i] = volume.value.Row(j, k)[i];
      if (sampler.HasTrust())
        sampler.Trust(j, k, inside, volume.trust.Row(j, k));
      unsigned char* covered = coverage.View().Row(j, k) + box.first[0];
      for (int i = 0; i < box.size[0]; ++i)
        covered[i] = static_cast<unsigned char>(covered[i] + (inside[i] & (covered[i] < 255)));
    });
  }
  if (scales.empty() && scaleSamplers.empty())
    return volumes;
  const auto& n = grid.dimensions;
  const bool depths = parameters.method == StitchMethod::Feather; // in mm: 1 says nothing of being alone
  const auto bounded = [depths](float scale) { return depths ? scale / (scale + 1.0f) : scale; };
  const std::array<int, 3> start{CoarseStart(n[0], step), CoarseStart(n[1], step), CoarseStart(n[2], step)};
  for (std::size_t v = 0; v < inputs.size(); ++v) {
    CoarseVolume& volume = volumes[v];
    const GridBox box = volume.inside.box;
    volume.scale = {box, Volume<float>(box.size)};
    ForRows(box, Progress(), [&](int j, int k) {
      const int first = start[0] + step * box.first[0], end = std::min(n[0], first + step * box.size[0]);
      std::vector<float> row(static_cast<std::size_t>(end - first), 1.0f);
      const std::vector<unsigned char> wanted(row.size(), 1);
      ScaleRow(static_cast<int>(v), start[1] + step * j, start[2] + step * k, first, end, wanted.data(), row.data());
      const unsigned char *covered = coverage.View().Row(j, k) + box.first[0], *inside = volume.inside.Row(j, k);
      float* scale = volume.scale.Row(j, k);
      for (int i = 0; i < box.size[0]; ++i)
        scale[i] = !(inside[i] & 1) ? 0.0f : covered[i] == 1 ? 1.0f : bounded(row[static_cast<std::size_t>(step) * i]);
    });
  }
  return volumes;
}

void StitchPlan::Parts::FindWhatIsCoarse(const Progress& progress)
{
  gains.gain.assign(inputs.size(), 1.0);
  gains.offset.assign(inputs.size(), 0.0);
  if (!NeedsLows())
    return;
  int step = factor;
  while (static_cast<double>(Coarsened(grid, step).VoxelCount()) > coarseVoxels)
    ++step;
  const ImageGeometry coarse = Coarsened(grid, step);
  std::vector<CoarseVolume> volumes = CoarseVolumes(coarse, step);
  progress(0.5);
  gains = EstimateStitchGains(volumes, parameters.equalizeGain);
  for (std::size_t v = 0; v < inputs.size(); ++v) {
    lowSamplers.push_back(BlockSampler(lows[v].low, grid));
    deviationSamplers.push_back(BlockSampler(lows[v].deviation, grid));
  }
}

StitchPlan::StitchPlan(const StitchParameters& parameters, const std::vector<StitchInput>& inputs, const ImageGeometry& grid,
                       const StitchOutputs& outputs, const Progress& progress)
  : parts_(std::make_unique<Parts>())
{
  if (inputs.size() < 2)
    throw Error(Error::Kind::BadInput, "stitching needs at least two volumes, got " + std::to_string(inputs.size()));
  for (const StitchInput& input : inputs)
    GeometryOf(input).Check(input.name);
  std::vector<ImageGeometry> reaches;
  for (const StitchInput& input : inputs)
    reaches.push_back(ReachOf(input));
  CheckStitch(parameters, reaches, grid, outputs, GridBox{});
  parts_->parameters = parameters;
  parts_->inputs = inputs;
  parts_->grid = grid;
  parts_->textured = IsTextured(parameters);
  parts_->factor = CostOfStitch(parameters, reaches, grid, outputs).planFactor;
  for (const StitchInput& input : inputs)
    parts_->samplers.emplace_back(input, grid, parameters.reliabilityFloor);
  parts_->FindScales(progress.Part(0.0, 0.6));
  parts_->FindWhatIsCoarse(progress.Part(0.6, 1.0));
}

StitchPlan::~StitchPlan() = default;
StitchPlan::StitchPlan(StitchPlan&&) noexcept = default;
StitchPlan& StitchPlan::operator=(StitchPlan&&) noexcept = default;

const ImageGeometry& StitchPlan::Grid() const
{
  return parts_->grid;
}
int StitchPlan::Factor() const
{
  return parts_->factor;
}
double StitchPlan::MembraneBound() const
{
  return parts_->bound;
}
const std::vector<double>& StitchPlan::Gain() const
{
  return parts_->gains.gain;
}
const std::vector<double>& StitchPlan::Offset() const
{
  return parts_->gains.offset;
}

// The rows of one task: buffers, and how a row is made.
template <class T>
class StitchPlan::Parts::RowBlender {
  using A = Accumulator<T>;

public:
  RowBlender(const Parts& parts, const GridBox& box, const StitchOutput<T>& output)
    : parts_(parts), box_(box), output_(output), layers_(parts.inputs.size()),
      power_(parts.parameters.method == StitchMethod::Distance || parts.parameters.method == StitchMethod::Membrane
                 ? parts.parameters.sharpness
             : parts.parameters.method == StitchMethod::Feather ? 1.0
                                                                : 0.0),
      detailPower_(parts.parameters.detailSharpness), count_(static_cast<std::size_t>(box.size[0])), here_(parts.inputs.size()),
      voxel_(parts.inputs.size())
  {
    const std::size_t n = parts.inputs.size();
    correlation_.assign(n * n, 0.0f);
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t b = 0; b < n; ++b)
        correlation_[a * n + b] =
            parts.gains.detailCorrelation.size() ? static_cast<float>(parts.gains.detailCorrelation(a, b)) : 0.0f;
  }

  void Row(int j, int k)
  {
    const int y = j - box_.first[1], z = k - box_.first[2];
    Sample(j, k);
    T* result = output_.intensity.Row(y, z);
    unsigned char *valid = output_.valid.Row(y, z), *coverage = output_.coverage.Row(y, z);
    float* spread = output_.spread.Empty() ? nullptr : output_.spread.Row(y, z);
    for (std::size_t v = 0; v < output_.weights.size(); ++v)
      std::fill_n(output_.weights[v].Row(y, z), box_.size[0], 0.0f);
    bool overlap = false;
    for (int i = 0; i < box_.size[0]; ++i) {
      result[i] = T(0);
      valid[i] = count_[i] > 0;
      coverage[i] = static_cast<unsigned char>(std::min<int>(count_[i], 255));
      overlap = overlap || count_[i] > 1;
      if (spread)
        spread[i] = 0.0f;
    }
    for (const int v : rows_) {
      const Layer& layer = layers_[v];
      float* weight = output_.weights.empty() ? nullptr : output_.weights[v].Row(y, z);
      const A gain = static_cast<A>(parts_.gains.gain[v]), offset = static_cast<A>(parts_.gains.offset[v]);
      for (int i = layer.first; i < layer.end; ++i)
        if (count_[i] == 1 && (layer.Inside(i) & 1)) {
          result[i] = RoundedVoxel<T>(gain * layer.values[i - layer.start] + offset);
          if (weight)
            weight[i] = 1.0f;
        }
    }
    if (overlap) {
      SampleOverlap(j, k);
      for (int i = 0; i < box_.size[0]; ++i)
        if (count_[i] > 1)
          result[i] = RoundedVoxel<T>(Blend(i, y, z, spread));
    }
  }

private:
  // What a volume has on the row. Indices are those of the box that is made; start is where the volume's own box begins.
  struct Layer {
    int start = 0, first = 0, end = 0;
    std::vector<unsigned char> inside;
    std::vector<A> values, low;
    std::vector<float> trust, scale, deviation;
    std::vector<unsigned char> shared; // of the box that is made: 1 where it meets others
    unsigned char Inside(int i) const { return inside[static_cast<std::size_t>(i - start)]; }
  };
  // A volume at one voxel.
  struct Here {
    int volume;
    A value, low;
    float deviation; // of the details around here
  };
  struct Voxel {
    explicit Voxel(std::size_t n) : scale(n), trust(n), weight(n), detail(n) {}
    std::vector<float> scale, trust, weight, detail;
  };

  void Sample(int j, int k)
  {
    rows_.clear();
    std::fill(count_.begin(), count_.end(), 0);
    for (int v = 0; v < static_cast<int>(layers_.size()); ++v) {
      const StitchSampler& sampler = parts_.samplers[v];
      const GridBox& own = sampler.Box();
      if (!own.HasRow(j, k))
        continue;
      Layer& layer = layers_[v];
      layer.start = own.first[0] - box_.first[0];
      layer.first = std::max(0, layer.start);
      layer.end = std::min(box_.size[0], layer.start + own.size[0]);
      if (layer.first >= layer.end)
        continue;
      rows_.push_back(v);
      layer.inside.resize(static_cast<std::size_t>(own.size[0]));
      layer.values.resize(static_cast<std::size_t>(own.size[0]));
      sampler.Inside(j, k, layer.inside.data());
      sampler.Values(j, k, layer.inside.data(), layer.values.data());
      for (int i = layer.first; i < layer.end; ++i)
        count_[i] += layer.Inside(i) & 1;
    }
  }

  void SampleOverlap(int j, int k)
  {
    const int n = box_.size[0], first = box_.first[0];
    for (const int v : rows_) {
      Layer& layer = layers_[v];
      layer.shared.assign(static_cast<std::size_t>(n), 0);
      for (int i = layer.first; i < layer.end; ++i)
        layer.shared[i] = (layer.Inside(i) & 1) & (count_[i] > 1);
      layer.scale.assign(static_cast<std::size_t>(n), 1.0f);
      if (!parts_.scales.empty() || !parts_.scaleSamplers.empty())
        parts_.ScaleRow(v, j, k, first, first + n, layer.shared.data(), layer.scale.data());
      if (parts_.samplers[v].HasTrust()) {
        layer.trust.resize(layer.inside.size());
        parts_.samplers[v].Trust(j, k, layer.inside.data(), layer.trust.data());
      }
      if (parts_.textured) {
        layer.low.resize(static_cast<std::size_t>(n));
        layer.deviation.resize(static_cast<std::size_t>(n));
        parts_.lowSamplers[v].Row(j, k, first, first + n, layer.shared.data(), noValue, layer.low.data());
        parts_.deviationSamplers[v].Row(j, k, first, first + n, layer.shared.data(), 0.0f, layer.deviation.data());
      }
    }
  }

  A Blend(int i, int y, int z, float* spread)
  {
    std::size_t n = 0;
    bool trusted = false;
    for (const int v : rows_) {
      const Layer& layer = layers_[v];
      if (!layer.shared[i])
        continue;
      const A gain = static_cast<A>(parts_.gains.gain[v]), offset = static_cast<A>(parts_.gains.offset[v]);
      here_[n] = {v, gain * layer.values[i - layer.start] + offset, A(0), 0.0f};
      if (parts_.textured) // without a smooth part (an overlap thinner than the plan's voxels) the voxel is taken as smooth
        here_[n].low = std::isnan(layer.low[i]) ? here_[n].value : gain * layer.low[i] + offset;
      if (parts_.textured)
        here_[n].deviation = static_cast<float>(gain) * layer.deviation[i];
      voxel_.scale[n] = layer.scale[i];
      const bool trust = parts_.samplers[v].HasTrust();
      voxel_.trust[n] = trust ? layer.trust[i - layer.start] : 1.0f;
      trusted = trusted || trust;
      ++n;
    }
    Weigh(n, trusted);
    if (spread) {
      A least = here_[0].value, most = least;
      for (std::size_t a = 1; a < n; ++a) {
        least = std::min(least, here_[a].value);
        most = std::max(most, here_[a].value);
      }
      spread[i] = static_cast<float>(most - least);
    }
    for (std::size_t a = 0; a < n && !output_.weights.empty(); ++a)
      output_.weights[here_[a].volume].Row(y, z)[i] = voxel_.weight[a];
    if (!parts_.textured) {
      A mean = here_[0].value;
      for (std::size_t a = 1; a < n; ++a)
        mean += static_cast<A>(voxel_.weight[a]) * (here_[a].value - here_[0].value);
      return mean;
    }
    A smooth = here_[0].low;
    for (std::size_t a = 1; a < n; ++a)
      smooth += static_cast<A>(voxel_.weight[a]) * (here_[a].low - here_[0].low);
    return smooth + Detail(n);
  }

  // The weights of the voxel's volumes, from their scales and how far they can be trusted.
  void Weigh(std::size_t n, bool trusted)
  {
    const float* trust = trusted ? voxel_.trust.data() : nullptr;
    if (parts_.parameters.method != StitchMethod::Maximum) {
      BlendWeights(voxel_.scale.data(), trust, n, power_, voxel_.weight.data());
      return;
    }
    std::size_t largest = 0;
    for (std::size_t a = 1; a < n; ++a)
      if (here_[a].value > here_[largest].value)
        largest = a;
    for (std::size_t a = 0; a < n; ++a)
      voxel_.weight[a] = a == largest;
  }

  // The blend of the details, with the variance that they would have one by one.
  A Detail(std::size_t n)
  {
    float* h = voxel_.detail.data();
    for (std::size_t a = 0; a < n; ++a)
      voxel_.scale[a] *= voxel_.trust[a];
    BlendWeights(voxel_.scale.data(), nullptr, n, detailPower_, h);
    // Details change over as narrowly as their weights, how strong they are as widely as the smooth part does: a texture that
    // ends abruptly at a stronger one is a seam as well.
    float strength = here_[0].deviation;
    for (std::size_t a = 1; a < n; ++a)
      strength += voxel_.weight[a] * (here_[a].deviation - here_[0].deviation);
    A sum = 0;
    float variance = 0.0f;
    for (std::size_t a = 0; a < n; ++a) {
      const float own = here_[a].deviation;
      const float amplified = own > 0.0f ? std::clamp(strength / own, 1.0f / mostAmplified, mostAmplified) : 1.0f;
      sum += static_cast<A>(h[a] * amplified) * (here_[a].value - here_[a].low);
      const float* correlation = correlation_.data() + static_cast<std::size_t>(here_[a].volume) * layers_.size();
      variance += h[a] * h[a];
      for (std::size_t b = 0; b < a; ++b)
        variance += 2.0f * h[a] * h[b] * correlation[here_[b].volume];
    }
    return sum / static_cast<A>(std::sqrt(variance));
  }

  const Parts& parts_;
  const GridBox box_;
  const StitchOutput<T>& output_;
  std::vector<Layer> layers_;
  BlendPower power_, detailPower_;
  std::vector<int> count_, rows_;
  std::vector<Here> here_;
  Voxel voxel_;
  std::vector<float> correlation_;
};

template <class T>
void StitchPlan::Render(const GridBox& box, const StitchOutput<T>& output, const Progress& progress) const
{
  const GridBox whole{{0, 0, 0}, parts_->grid.dimensions};
  const GridBox within = box.Intersected(whole);
  if (box.Empty())
    return;
  if (within.first != box.first || within.size != box.size)
    throw Error(Error::Kind::InvalidParameter, "the requested extent is not within the output grid");
  ParallelRanges(static_cast<std::ptrdiff_t>(box.size[1]) * box.size[2], rowsOfOneTask, progress,
                 [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
                   typename Parts::RowBlender<T> blender(*parts_, box, output);
                   for (std::ptrdiff_t row = begin; row < end; ++row)
                     blender.Row(box.first[1] + static_cast<int>(row % box.size[1]),
                                 box.first[2] + static_cast<int>(row / box.size[1]));
                 });
}

template <class T>
void Stitch(const StitchParameters& parameters, const std::vector<StitchInput>& inputs, const ImageGeometry& grid,
            const StitchOutput<T>& output, const Progress& progress)
{
  std::vector<ImageGeometry> reaches;
  for (const StitchInput& input : inputs)
    reaches.push_back(ReachOf(input));
  const GridBox whole{{0, 0, 0}, grid.dimensions};
  const StitchOutputs outputs{sizeof(T), !output.weights.empty(), !output.spread.Empty()};
  CheckStitch(parameters, reaches, grid, outputs, whole);
  StitchPlan(parameters, inputs, grid, outputs, progress.Part(0.0, 0.6)).Render(whole, output, progress.Part(0.6, 1.0));
}

#define EchoramaInstantiate(T)                                                                                                   \
  template void StitchPlan::Render<T>(const GridBox&, const StitchOutput<T>&, const Progress&) const;                            \
  template void Stitch<T>(const StitchParameters&, const std::vector<StitchInput>&, const ImageGeometry&,                        \
                          const StitchOutput<T>&, const Progress&);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
