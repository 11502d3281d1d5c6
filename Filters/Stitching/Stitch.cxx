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
#include "SmoothRows.h"
#include "StitchGain.h"
#include "StitchMemory.h"
#include "StitchSampler.h"
#include "StitchScales.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace echorama {

namespace {

// What is decided for all voxels together is decided on a grid that has about so many at most where volumes are.
constexpr double coarseVoxels = 1.5e6;

// Details are made stronger or weaker by no more than this: a shadow holds nothing but noise.
constexpr float mostAmplified = 2.0f;

constexpr float noValue = std::numeric_limits<float>::quiet_NaN();

// Sums are kept in float, those of doubles in double.
template <class T>
using Accumulator = std::conditional_t<std::is_same_v<T, double>, double, float>;

// Overlaps of so many voxels are thick: membranes in them are told by every other voxel.
constexpr double thickOverlap = 12.0;

// The regions may be those of a coarser grid, which can miss what is thin.
void CheckRegions(const StitchParameters& parameters, const std::vector<StitchInput>& inputs, const RegionMap& regions,
                  const std::vector<StitchSampler>& samplers)
{
  // Of two volumes one of which is empty it is that one which is told of, not the other, which then overlaps nothing.
  int alone = -1;
  for (int v = 0; v < regions.Count(); ++v) {
    if (regions.OverlapCount(v) > 0 || (parameters.allowDisjoint && regions.InsideCount(v) > 0))
      continue;
    const Presence presence = PresenceOf(samplers, static_cast<std::size_t>(v));
    if (!presence.isInside)
      throw Error(Error::Kind::BadInput, inputs[v].name + ": no voxel is valid and finite at a voxel of the output grid");
    if (!presence.isShared && !parameters.allowDisjoint && alone < 0)
      alone = v;
  }
  if (alone >= 0)
    throw Error(Error::Kind::NotPossible,
                inputs[alone].name + " overlaps no other volume; check its pose, or set AllowDisjoint to put it where it is");
}

bool AreOverlapsThick(const RegionMap& regions, double voxels)
{
  for (int v = 0; v < regions.Count(); ++v)
    if (!(regions.OverlapThickness(v) >= voxels))
      return false;
  return true;
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
      Parameter("PlanStep", p.planStep, {0, 64}, "voxels of the output",
                "Membranes are found on a grid whose voxels are so much larger, and interpolated. 1: at every voxel; 0: 2 where "
                "overlaps are 12 voxels thick or more, where it makes no difference that can be seen, else 1.")
          .When("Method", "membrane")
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
  std::vector<CoarseVolume> CoarseVolumes(const ImageGeometry& coarse) const;
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
  if (from > first || to < end)
    std::fill(scale, scale + (end - first), 1.0f);
  if (from < to)
    std::copy(row + (from - field.spans->First(j, k)), row + (to - field.spans->First(j, k)), scale + (from - first));
}

void StitchPlan::Parts::FindScales(const Progress& progress)
{
  const StitchMethod method = parameters.method;
  const auto regionsOf = [&](int step, const Progress& part) {
    const ImageGeometry where = Coarsened(grid, step);
    std::vector<StitchSampler> coarser;
    for (std::size_t v = 0; v < inputs.size() && step > 1; ++v)
      coarser.emplace_back(inputs[v], where, parameters.reliabilityFloor);
    return RegionMap(MasksOf(step > 1 ? coarser : samplers, part.Part(0.0, 0.75)), where.dimensions, where.spacing,
                     part.Part(0.75, 1.0));
  };
  const bool isTried = method == StitchMethod::Membrane && parameters.planStep == 0 && factor == 1;
  if (isTried)
    factor = 2;
  RegionMap regions = regionsOf(factor, progress.Part(0.0, isTried ? 0.03 : 0.2));
  if (isTried && !AreOverlapsThick(regions, thickOverlap / 2.0)) {
    factor = 1;
    regions = regionsOf(1, progress.Part(0.03, 0.2));
  }
  CheckRegions(parameters, inputs, regions, samplers);
  const ImageGeometry planGrid = Coarsened(grid, factor);
  if (method == StitchMethod::Distance || method == StitchMethod::Membrane)
    regions.GiveCores(progress.Part(0.2, 0.3));
  scales = StitchScales(parameters, regions, planGrid.spacing, bound, progress.Part(0.3, 0.85));
  if (NeedsLows()) {
    blocks = BlocksOf(grid, parameters.detailScale);
    const double n = static_cast<double>(inputs.size());
    for (std::size_t v = 0; v < inputs.size(); ++v)
      lows.push_back(
          LowPass(samplers[v], blocks, regions.Coverage(), factor,
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
      const int count = field.values.box.size[0];
      std::vector<unsigned char> covered(static_cast<std::size_t>(count));
      regions.Coverage().Copy(field.values.box.first[0], j, k, count, covered.data());
      for (int x = 0; x < count; ++x) {
        const int i = field.values.box.first[0] + x;
        known[x] = covered[static_cast<std::size_t>(x)] > 0;
        const bool here = inside && i >= own.first[0] && i < own.first[0] + own.size[0] && (inside[i - own.first[0]] & 1);
        if (here)
          value[x] = covered[static_cast<std::size_t>(x)] == 1 || !scale ? 1.0f : scale[i - scales[v].spans->First(j, k)];
      }
    });
    coarseScales.push_back(std::move(field));
  }
  scales.clear();
  for (const CoarseField& field : coarseScales)
    scaleSamplers.emplace_back(field.values, field.known, planGrid, grid);
}

// All volumes on a coarse copy of the grid, where gains and correlations are to be found.
std::vector<CoarseVolume> StitchPlan::Parts::CoarseVolumes(const ImageGeometry& coarse) const
{
  std::vector<CoarseVolume> volumes(inputs.size());
  std::vector<StitchSampler> coarser;
  for (const StitchInput& input : inputs)
    coarser.emplace_back(input, coarse, parameters.reliabilityFloor);
  for (std::size_t v = 0; v < inputs.size(); ++v) {
    volumes[v].inside = {coarser[v].Box(), Volume<unsigned char>(coarser[v].Box().size)};
    ForRows(coarser[v].Box(), Progress(), [&](int j, int k) { coarser[v].Inside(j, k, volumes[v].inside.Row(j, k)); });
  }
  MarkStitchSamples(volumes);
  for (std::size_t v = 0; v < inputs.size(); ++v) {
    CoarseVolume& volume = volumes[v];
    const GridBox& box = volume.inside.box;
    volume.value = {box, Volume<float>(box.size)};
    volume.low = {box, Volume<float>(box.size)};
    if (coarser[v].HasTrust())
      volume.trust = {box, Volume<float>(box.size)};
    const CoarseSampler low = BlockSampler(lows[v].low, coarse);
    ForRows(box, Progress(), [&](int j, int k) {
      const unsigned char* wanted = volume.wanted.Row(j, k);
      float* const value = volume.value.Row(j, k);
      float* const smooth = volume.low.Row(j, k);
      coarser[v].Values(j, k, wanted, value);
      low.Row(j, k, box.first[0], box.first[0] + box.size[0], wanted, noValue, smooth);
      // Outside of the overlap there is no smooth part, and no use for one.
      for (int i = 0; i < box.size[0]; ++i)
        smooth[i] = std::isnan(smooth[i]) ? value[i] : smooth[i];
      if (coarser[v].HasTrust())
        coarser[v].Trust(j, k, wanted, volume.trust.Row(j, k));
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
  double reached = 0.0; // of the grid, at most
  for (const StitchSampler& sampler : samplers)
    reached += static_cast<double>(sampler.Box().VoxelCount());
  const double share = std::min(1.0, reached / static_cast<double>(grid.VoxelCount()));
  int step = factor;
  while (share * static_cast<double>(Coarsened(grid, step).VoxelCount()) > coarseVoxels)
    ++step;
  const std::vector<CoarseVolume> volumes = CoarseVolumes(Coarsened(grid, step));
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

// The rows of one task: buffers, and how a row is made. Where several volumes are, a row falls into runs with the same volumes
// at all their voxels, and each is blended as a whole.
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
      detailPower_(parts.parameters.detailSharpness), width_(static_cast<std::size_t>(box.size[0])), changes_(width_ + 1),
      shown_(width_), sum_(width_), scratch_(2 * width_), values_(layers_.size()), lows_(layers_.size()), scales_(layers_.size()),
      weights_(layers_.size()), shares_(layers_.size()), trusts_(layers_.size()), deviations_(layers_.size())
  {
  }

  void Row(int j, int k)
  {
    const int y = j - box_.first[1], z = k - box_.first[2], n = box_.size[0];
    unsigned char* const coverage = output_.coverage.Row(y, z);
    Sample(j, k, coverage);
    for (std::size_t v = 0; v < output_.weights.size(); ++v)
      std::fill_n(output_.weights[v].Row(y, z), n, 0.0f);
    if (!output_.spread.Empty())
      std::fill_n(output_.spread.Row(y, z), n, 0.0f);
    if (rows_.empty()) { // most of a large grid is empty
      std::fill_n(output_.valid.Row(y, z), n, static_cast<unsigned char>(0));
      std::fill_n(output_.intensity.Row(y, z), n, T(0));
      return;
    }
    std::fill(shown_.begin(), shown_.end(), A(0));
    for (const int v : rows_) {
      const Layer& layer = layers_[v];
      ShowAlone(layer.Value(layer.first), layer.Inside(layer.first), coverage + layer.first, static_cast<A>(parts_.gains.gain[v]),
                static_cast<A>(parts_.gains.offset[v]), static_cast<std::size_t>(layer.end - layer.first),
                shown_.data() + layer.first);
      for (int i = layer.first; i < layer.end && !output_.weights.empty(); ++i)
        if (coverage[i] == 1 && (*layer.Inside(i) & 1))
          output_.weights[v].Row(y, z)[i] = 1.0f;
    }
    if (std::any_of(coverage, coverage + n, [](unsigned char count) { return count > 1; })) {
      SampleOverlap(j, k, coverage);
      for (int i = 0, end = 0; i < n; i = end) {
        end = static_cast<int>(
            static_cast<const unsigned char*>(std::memchr(&changes_[static_cast<std::size_t>(i) + 1], 1, width_ - i)) -
            changes_.data());
        if (coverage[i] > 1)
          Blend(i, end, y, z);
      }
    }
    unsigned char* const valid = output_.valid.Row(y, z);
    T* const result = output_.intensity.Row(y, z);
    for (int i = 0; i < n; ++i) {
      valid[i] = coverage[i] > 0;
      result[i] = RoundedVoxel<T>(shown_[i]);
    }
  }

private:
  // What a volume has on the row. Indices are those of the box that is made; start is where the volume's own box begins.
  struct Layer {
    int start = 0, first = 0, end = 0;
    std::vector<unsigned char> inside;
    std::vector<A> values;
    std::vector<float> trust;
    // Where it meets others, of the box that is made:
    std::vector<unsigned char> shared; // whether it does
    std::vector<A> shown, low;         // with the gain
    std::vector<float> scale, deviation, weight, share;
    std::unique_ptr<SmoothRows<A>> lows;
    std::unique_ptr<SmoothRows<float>> deviations;
    const unsigned char* Inside(int i) const { return inside.data() + (i - start); }
    const A* Value(int i) const { return values.data() + (i - start); }
  };

  // Values and coverage of the row, and where the volumes that are there change.
  void Sample(int j, int k, unsigned char* coverage)
  {
    rows_.clear();
    std::fill_n(coverage, width_, static_cast<unsigned char>(0));
    std::fill(changes_.begin(), changes_.end(), static_cast<unsigned char>(0));
    changes_.back() = 1;
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
      sampler.Read(j, k, layer.inside.data(), layer.values.data());
      const unsigned char* const inside = layer.inside.data() - layer.start;
      for (int i = layer.first; i < layer.end; ++i)
        coverage[i] = static_cast<unsigned char>(coverage[i] + (inside[i] & 1 & (coverage[i] < 255)));
      changes_[static_cast<std::size_t>(layer.first)] = changes_[static_cast<std::size_t>(layer.end)] = 1;
      for (int i = layer.first + 1; i < layer.end; ++i)
        changes_[static_cast<std::size_t>(i)] |= (inside[i] ^ inside[i - 1]) & 1;
    }
  }

  void SampleOverlap(int j, int k, const unsigned char* coverage)
  {
    for (const int v : rows_) {
      Layer& layer = layers_[v];
      layer.shared.assign(width_, 0);
      const unsigned char* const inside = layer.inside.data() - layer.start;
      for (int i = layer.first; i < layer.end; ++i)
        layer.shared[i] = (inside[i] & 1) & (coverage[i] > 1);
      int first = layer.first, end = layer.end; // where it meets others
      while (first < end && !layer.shared[first])
        ++first;
      while (first < end && !layer.shared[end - 1])
        --end;
      if (first == end)
        continue;
      const std::size_t count = static_cast<std::size_t>(end - first);
      const A gain = static_cast<A>(parts_.gains.gain[v]), offset = static_cast<A>(parts_.gains.offset[v]);
      layer.shown.resize(width_);
      layer.weight.resize(width_);
      ApplyGain(layer.Value(first), gain, offset, count, layer.shown.data() + first);
      layer.scale.resize(width_);
      const int x = box_.first[0];
      if (!parts_.scales.empty() || !parts_.scaleSamplers.empty())
        parts_.ScaleRow(v, j, k, x + first, x + end, layer.shared.data() + first, layer.scale.data() + first);
      else
        std::fill_n(layer.scale.data() + first, count, 1.0f);
      if (parts_.samplers[v].HasTrust()) {
        layer.trust.resize(layer.inside.size());
        parts_.samplers[v].Trust(j, k, layer.inside.data(), layer.trust.data());
      }
      if (!parts_.textured)
        continue;
      layer.share.resize(width_);
      layer.low.resize(width_);
      layer.deviation.resize(width_);
      A* const low = layer.low.data();
      float* const deviation = layer.deviation.data();
      const unsigned char* const wanted = layer.shared.data();
      if (!layer.lows) {
        layer.lows = std::make_unique<SmoothRows<A>>(parts_.blocks, parts_.lows[v].low);
        layer.deviations = std::make_unique<SmoothRows<float>>(parts_.blocks, parts_.lows[v].deviation);
      }
      if (!layer.lows->Row(j, k, x + first, x + end, wanted + first, low + first))
        parts_.lowSamplers[v].Row(j, k, x + first, x + end, wanted + first, noValue, low + first);
      if (!layer.deviations->Row(j, k, x + first, x + end, wanted + first, deviation + first))
        parts_.deviationSamplers[v].Row(j, k, x + first, x + end, wanted + first, 0.0f, deviation + first);
      ApplyGain(low + first, gain, offset, count, low + first);
      ApplyGain(deviation + first, static_cast<float>(gain), 0.0f, count, deviation + first);
      for (int i = first; i < end; ++i) // without a smooth part (an overlap thinner than the plan's voxels) all is smooth
        low[i] = std::isnan(low[i]) ? layer.shown[i] : low[i];
    }
  }

  // A run of voxels at which the same volumes are.
  void Blend(int first, int end, int y, int z)
  {
    const std::size_t count = static_cast<std::size_t>(end - first);
    here_.clear();
    for (const int v : rows_)
      if (first >= layers_[v].first && first < layers_[v].end && layers_[v].shared[first])
        here_.push_back(v);
    const std::size_t n = here_.size();
    bool trusted = false;
    for (std::size_t a = 0; a < n; ++a) {
      Layer& layer = layers_[here_[a]];
      const bool trust = parts_.samplers[here_[a]].HasTrust();
      trusted = trusted || trust;
      values_[a] = layer.shown.data() + first;
      scales_[a] = layer.scale.data() + first;
      trusts_[a] = trust ? layer.trust.data() + (first - layer.start) : nullptr;
      weights_[a] = layer.weight.data() + first;
    }
    Weigh(n, count, trusted);
    for (std::size_t a = 0; a < n && !output_.weights.empty(); ++a)
      std::copy_n(weights_[a], count, output_.weights[here_[a]].Row(y, z) + first);
    if (!output_.spread.Empty())
      Spread(n, count, output_.spread.Row(y, z) + first);
    BlendRow<A> row;
    row.volumes = n;
    row.count = count;
    row.value = values_.data();
    row.weight = weights_.data();
    if (!parts_.textured) {
      BlendMean(row, shown_.data() + first);
      return;
    }
    correlation_.resize(n * n);
    for (std::size_t a = 0; a < n; ++a) {
      Layer& layer = layers_[here_[a]];
      lows_[a] = layer.low.data() + first;
      deviations_[a] = layer.deviation.data() + first;
      shares_[a] = layer.share.data() + first;
      for (std::size_t i = 0; i < count && trusts_[a]; ++i)
        scales_[a][i] *= trusts_[a][i];
      for (std::size_t b = 0; b < n; ++b)
        correlation_[a * n + b] = static_cast<float>(parts_.gains.detailCorrelation(here_[a], here_[b]));
    }
    BlendWeights(scales_.data(), nullptr, n, count, detailPower_, shares_.data(), scratch_.data());
    row.low = lows_.data();
    row.share = shares_.data();
    row.deviation = deviations_.data();
    row.correlation = correlation_.data();
    row.mostAmplified = mostAmplified;
    row.scratch = scratch_.data();
    BlendSplit(row, sum_.data(), shown_.data() + first);
  }

  // The weights of the run's volumes, from their scales and how far they can be trusted.
  void Weigh(std::size_t n, std::size_t count, bool trusted)
  {
    if (parts_.parameters.method != StitchMethod::Maximum) {
      BlendWeights(scales_.data(), trusted ? trusts_.data() : nullptr, n, count, power_, weights_.data(), scratch_.data());
      return;
    }
    for (std::size_t i = 0; i < count; ++i) {
      std::size_t largest = 0;
      for (std::size_t a = 1; a < n; ++a)
        if (values_[a][i] > values_[largest][i])
          largest = a;
      for (std::size_t a = 0; a < n; ++a)
        weights_[a][i] = a == largest;
    }
  }

  void Spread(std::size_t n, std::size_t count, float* spread) const
  {
    for (std::size_t i = 0; i < count; ++i) {
      A least = values_[0][i], most = least;
      for (std::size_t a = 1; a < n; ++a) {
        least = std::min(least, values_[a][i]);
        most = std::max(most, values_[a][i]);
      }
      spread[i] = static_cast<float>(most - least);
    }
  }

  const Parts& parts_;
  const GridBox box_;
  const StitchOutput<T>& output_;
  std::vector<Layer> layers_;
  BlendPower power_, detailPower_;
  const std::size_t width_;
  std::vector<unsigned char> changes_; // 1 where other volumes are than at the voxel before, and behind the last
  std::vector<A> shown_, sum_;
  std::vector<float> scratch_, correlation_;
  std::vector<int> rows_; // the volumes of the row
  // Those of the run, and what they have there:
  std::vector<int> here_;
  std::vector<const A*> values_, lows_;
  std::vector<float*> scales_, weights_, shares_;
  std::vector<const float*> trusts_, deviations_;
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
