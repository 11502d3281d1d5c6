// SPDX-License-Identifier: BSD-3-Clause
// The grid is worked through in tiles of whole rows, each with as much margin as windows at its borders need. In a tile all that
// is asked for lies in small arrays: the result and the volumes as floats, with NaN where they are not, so that the sums over a
// window are NaN where it is not wholly covered and no mask has to be looked at. Which volume the result follows is known from
// box sums of the difference and its square. Then the faces and windows of the tile's core are measured one by one;
// sums of tiles are added in their order, so the number of threads does not matter.
#include "StitchQuality.h"
#include "Core/Base/Error.h"
#include "Core/Base/Random.h"
#include "Core/Imaging/VoxelTypes.h"
#include "RowSampler.h"
#include <algorithm>
#include <cmath>
#include <optional>

namespace echorama {

namespace {

constexpr double notMeasured = std::numeric_limits<double>::quiet_NaN();
constexpr float nowhere = std::numeric_limits<float>::quiet_NaN();
constexpr int tileRows = 32;
constexpr int aside = 1; // voxel off a cut at which the volumes on either side are told apart

using AnySampler =
    std::variant<RowSampler<unsigned char>, RowSampler<short>, RowSampler<unsigned short>, RowSampler<float>, RowSampler<double>>;

AnySampler SamplerOf(const AnyPosedVolume& any, const std::string& name, const ImageGeometry& grid,
                     const DisplacementField* displacement)
{
  return std::visit(
      [&](const auto& volume) -> AnySampler {
        volume.geometry.Check(name);
        if (volume.intensity.Dimensions() != volume.geometry.dimensions ||
            (!volume.valid.Empty() && volume.valid.Dimensions() != volume.geometry.dimensions))
          throw Error(Error::Kind::BadInput, name + ": its voxels are not of the size that its geometry says");
        return RowSampler(volume, grid, displacement);
      },
      any);
}

std::optional<RowSampler<float>> TrustOf(const StitchInput& input, const ImageGeometry& grid)
{
  if (input.reliability.Empty())
    return std::nullopt;
  return std::visit(
      [&](const auto& volume) -> std::optional<RowSampler<float>> {
        if (input.reliability.Dimensions() != volume.geometry.dimensions)
          throw Error(Error::Kind::BadInput, input.name + ": its reliability is not of the size that its geometry says");
        return RowSampler(PosedVolume<float>{input.reliability, volume.valid, volume.geometry}, grid, input.displacement);
      },
      input.volume);
}

// What all tiles share.
struct Shape {
  std::array<int, 3> grid{};
  std::array<int, 3> radius{};          // of windows
  std::array<double, 3> energyWeight{}; // of squared differences along an axis
  int stride = 1;

  int Width(int axis) const { return 2 * radius[axis] + 1; }
};

Shape ShapeOf(const ImageGeometry& grid, int stride)
{
  Shape shape;
  shape.grid = grid.dimensions;
  shape.stride = stride;
  for (int axis = 0; axis < 3; ++axis) {
    shape.radius[axis] = std::min(2, (grid.dimensions[axis] - 1) / 2);
    shape.energyWeight[axis] = std::pow(grid.spacing.minCoeff() / grid.spacing[axis], 2);
  }
  return shape;
}

// Jumps across faces of one kind, in the result and in the volumes there.
struct Jumps {
  double mean = 0.0, gradient = 0.0;
  std::ptrdiff_t faces = 0;

  void Add(double meanJump, double gradientJump)
  {
    mean += meanJump;
    gradient += gradientJump;
    ++faces;
  }
  Jumps& operator+=(const Jumps& other)
  {
    mean += other.mean;
    gradient += other.gradient;
    faces += other.faces;
    return *this;
  }
};

struct Sums {
  Jumps borders, bordersOfVolumes, cuts, cutsOfVolumes, within;
  std::vector<float> texture, snr, snrOfVolumes;
  double level = 0.0; // sum of absolute values of the result
  double errors[2] = {0.0, 0.0};
  std::ptrdiff_t voxels = 0, overlap = 0, known[2] = {0, 0};
  std::ptrdiff_t changes = 0; // faces in overlaps where another volume is followed, cuts or not

  Sums& operator+=(const Sums& other)
  {
    borders += other.borders;
    bordersOfVolumes += other.bordersOfVolumes;
    cuts += other.cuts;
    cutsOfVolumes += other.cutsOfVolumes;
    within += other.within;
    texture.insert(texture.end(), other.texture.begin(), other.texture.end());
    snr.insert(snr.end(), other.snr.begin(), other.snr.end());
    snrOfVolumes.insert(snrOfVolumes.end(), other.snrOfVolumes.begin(), other.snrOfVolumes.end());
    level += other.level;
    voxels += other.voxels;
    overlap += other.overlap;
    changes += other.changes;
    for (int side = 0; side < 2; ++side) {
      errors[side] += other.errors[side];
      known[side] += other.known[side];
    }
    return *this;
  }
};

using Floats = std::vector<float>;

// A volume in a tile: NaN where it is not.
struct TileVolume {
  int number = 0;
  Floats values, trust; // trust may be empty
};

// Sums over the window around each voxel, as much of it as lies in the tile.
void BoxSum(Floats& field, const std::array<int, 3>& size, const std::array<int, 3>& radius)
{
  Floats sum(field.size());
  const std::ptrdiff_t strides[3] = {1, size[0], static_cast<std::ptrdiff_t>(size[0]) * size[1]};
  for (int axis = 0; axis < 3; ++axis) {
    if (radius[axis] == 0)
      continue;
    std::fill(sum.begin(), sum.end(), 0.0f);
    for (int step = -radius[axis]; step <= radius[axis]; ++step)
      for (int k = 0; k < size[2]; ++k)
        for (int j = 0; j < size[1]; ++j) {
          const int at[3] = {0, j, k};
          if (axis > 0 && (at[axis] + step < 0 || at[axis] + step >= size[axis]))
            continue;
          float* out = sum.data() + k * strides[2] + j * strides[1];
          const float* in = field.data() + k * strides[2] + j * strides[1] + step * strides[axis];
          const int begin = axis == 0 ? std::max(0, -step) : 0, end = axis == 0 ? size[0] - std::max(0, step) : size[0];
          for (int i = begin; i < end; ++i)
            out[i] += in[i];
        }
    field.swap(sum);
  }
}

// From variance and mean of the difference of the result to a volume.
template <class A>
A Unlike(A variance, A mean)
{
  return variance + A(0.01) * mean * mean;
}

template <class T>
class Tile {
public:
  // The core is in indices of the grid.
  Tile(const Shape& shape, const GridBox& core) : shape_(shape), core_(core)
  {
    for (int axis = 0; axis < 3; ++axis) {
      const int margin = shape.Width(axis) + aside;
      box_.first[axis] = std::max(0, core.first[axis] - margin);
      box_.size[axis] = std::min(shape.grid[axis], core.first[axis] + core.size[axis] + margin) - box_.first[axis];
    }
    strides_ = {1, box_.size[0], static_cast<std::ptrdiff_t>(box_.size[0]) * box_.size[1]};
  }

  void Load(const std::vector<AnySampler>& samplers, const std::vector<std::optional<RowSampler<float>>>& trusts,
            VolumeView<const T> stitched, VolumeView<const unsigned char> valid)
  {
    count_.assign(box_.VoxelCount(), 0);
    sets_.assign(box_.VoxelCount(), 0);
    for (std::size_t v = 0; v < samplers.size(); ++v) {
      TileVolume volume;
      volume.number = static_cast<int>(v);
      // A sum of random numbers stands for the set of volumes.
      Random random(1, v);
      const std::uint64_t high = random.Bits(), mark = high << 32 | random.Bits();
      std::visit([&](const auto& sampler) { Read(sampler, mark, volume.values); }, samplers[v]);
      if (volume.values.empty())
        continue;
      if (trusts[v])
        Read(*trusts[v], 0, volume.trust);
      volumes_.push_back(std::move(volume));
    }
    result_.assign(box_.VoxelCount(), nowhere);
    for (int k = 0; k < box_.size[2]; ++k)
      for (int j = 0; j < box_.size[1]; ++j) {
        const T* row = stitched.Row(box_.first[1] + j, box_.first[2] + k);
        const unsigned char* validRow = valid.Empty() ? nullptr : valid.Row(box_.first[1] + j, box_.first[2] + k);
        const std::ptrdiff_t at = At(0, j, k);
        for (int i = 0; i < box_.size[0]; ++i)
          if (count_[at + i] && (!validRow || validRow[i]))
            result_[at + i] = static_cast<float>(row[i]);
      }
    for (float& value : result_)
      if (!std::isfinite(value))
        value = nowhere;
  }

  void Measure(const AnySampler* reference, Sums& sums)
  {
    FindFollowed();
    const int s = shape_.stride;
    Floats truth;
    if (reference)
      std::visit([&](const auto& sampler) { Read(sampler, 0, truth, false); }, *reference);
    for (int k = core_.first[2]; k < core_.first[2] + core_.size[2]; ++k)
      for (int j = core_.first[1]; j < core_.first[1] + core_.size[1]; ++j)
        for (int i = 0; i < core_.size[0]; ++i) {
          const std::array<int, 3> p{i - box_.first[0], j - box_.first[1], k - box_.first[2]};
          const std::ptrdiff_t at = At(p[0], p[1], p[2]);
          if (std::isnan(result_[at]))
            continue;
          const bool overlap = count_[at] > 1;
          sums.level += std::abs(result_[at]);
          ++sums.voxels;
          sums.overlap += overlap;
          if (!truth.empty() && !std::isnan(truth[at])) {
            sums.errors[overlap] += std::abs(result_[at] - truth[at]);
            ++sums.known[overlap];
          }
          if (overlap && i % s == 0 && j % s == 0 && k % s == 0)
            MeasureTexture(p, sums);
          // Another phase in every row, so that no plane of faces is left out.
          const std::ptrdiff_t phase = i + 41 * static_cast<std::ptrdiff_t>(j) + 1009 * static_cast<std::ptrdiff_t>(k);
          if (phase % (static_cast<std::ptrdiff_t>(s) * s) == 0)
            for (int axis = 0; axis < 3; ++axis)
              MeasureFace(p, axis, phase % (static_cast<std::ptrdiff_t>(s) * s * s * s) == 0, sums);
        }
  }

private:
  struct Window {
    std::array<int, 3> first, size; // in the tile
  };
  struct Moments {
    double mean = 0.0, deviation = 0.0, energy = 0.0;
    bool whole = false;
  };

  std::ptrdiff_t At(int i, int j, int k) const { return i + j * strides_[1] + k * strides_[2]; }

  template <class Sampler>
  void Read(const Sampler& sampler, std::uint64_t mark, Floats& values, bool count = true)
  {
    const GridBox there = sampler.Box().Intersected(box_);
    if (there.Empty())
      return;
    values.assign(box_.VoxelCount(), nowhere);
    std::vector<unsigned char> inside(static_cast<std::size_t>(sampler.Box().size[0]));
    std::vector<float> row(inside.size());
    std::vector<double> rowOfDoubles(inside.size());
    for (int k = there.first[2]; k < there.first[2] + there.size[2]; ++k)
      for (int j = there.first[1]; j < there.first[1] + there.size[1]; ++j) {
        sampler.Inside(j, k, inside.data());
        if constexpr (std::is_same_v<Sampler, RowSampler<double>>) {
          sampler.Values(j, k, inside.data(), rowOfDoubles.data());
          std::copy(rowOfDoubles.begin(), rowOfDoubles.end(), row.begin());
        } else {
          sampler.Values(j, k, inside.data(), row.data());
        }
        const std::ptrdiff_t at = At(0, j - box_.first[1], k - box_.first[2]) + sampler.Box().first[0];
        for (std::size_t i = 0; i < inside.size(); ++i)
          if (inside[i] & 1) {
            values[at + i] = row[i];
            if (mark && count) {
              sets_[at + i] += mark;
              ++count_[at + i];
            }
          }
      }
  }

  // Of each voxel, the number of the volume whose difference to the result varies least in the window around it; among those
  // that vary alike the one that is nearest.
  void FindFollowed()
  {
    followed_.assign(box_.VoxelCount(), -1);
    Floats least(box_.VoxelCount(), std::numeric_limits<float>::infinity());
    for (const TileVolume& volume : volumes_) {
      Floats counts(box_.VoxelCount(), 0.0f), differences = counts, squares = counts;
      bool overlaps = false;
      for (std::size_t at = 0; at < counts.size(); ++at) {
        const float difference = result_[at] - volume.values[at];
        if (std::isnan(difference))
          continue;
        counts[at] = 1.0f;
        differences[at] = difference;
        squares[at] = difference * difference;
        overlaps = overlaps || count_[at] > 1;
        if (count_[at] == 1)
          followed_[at] = volume.number;
      }
      if (!overlaps)
        continue;
      for (Floats* field : {&counts, &differences, &squares})
        BoxSum(*field, box_.size, shape_.radius);
      for (std::size_t at = 0; at < counts.size(); ++at) {
        if (count_[at] < 2 || std::isnan(volume.values[at]) || std::isnan(result_[at]))
          continue;
        const float mean = differences[at] / counts[at], variance = squares[at] / counts[at] - mean * mean;
        const float unlikeness = Unlike(std::max(0.0f, variance), mean);
        if (unlikeness < least[at]) {
          least[at] = unlikeness;
          followed_[at] = volume.number;
        }
      }
    }
  }

  Moments MomentsOf(const Floats& field, const Window& window) const
  {
    Moments m;
    double sum = 0.0, energy = 0.0;
    const auto& n = window.size;
    const float* origin = field.data() + At(window.first[0], window.first[1], window.first[2]);
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i)
          sum += origin[At(i, j, k)];
    if (std::isnan(sum))
      return m;
    const double count = static_cast<double>(n[0]) * n[1] * n[2];
    m.whole = true;
    m.mean = sum / count;
    double squares = 0.0;
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i) {
          const double difference = origin[At(i, j, k)] - m.mean;
          squares += difference * difference;
        }
    m.deviation = std::sqrt(squares / count);
    // Of voxels whose next neighbours along all axes are in the window too.
    std::ptrdiff_t counted = 0;
    const int end[3] = {std::max(1, n[0] - 1), std::max(1, n[1] - 1), std::max(1, n[2] - 1)};
    for (int k = 0; k < end[2]; ++k)
      for (int j = 0; j < end[1]; ++j)
        for (int i = 0; i < end[0]; ++i) {
          const float* here = origin + At(i, j, k);
          for (int axis = 0; axis < 3; ++axis)
            if (n[axis] > 1) {
              const double difference = here[strides_[axis]] - *here;
              energy += shape_.energyWeight[axis] * difference * difference;
            }
          ++counted;
        }
    m.energy = energy / static_cast<double>(counted);
    return m;
  }

  // The windows on either side of the face between p and its next neighbour; false where they do not fit.
  bool WindowsOf(const std::array<int, 3>& p, int axis, Window windows[2]) const
  {
    for (int side = 0; side < 2; ++side)
      for (int a = 0; a < 3; ++a) {
        windows[side].size[a] = shape_.Width(a);
        windows[side].first[a] = a != axis ? p[a] - shape_.radius[a] : side == 0 ? p[a] - shape_.Width(a) + 1 : p[a] + 1;
        if (windows[side].first[a] < 0 || windows[side].first[a] + windows[side].size[a] > box_.size[a])
          return false;
      }
    return true;
  }

  // \returns false where the windows are not wholly covered
  bool JumpOf(const Floats& field, const Window windows[2], double& mean, double& gradient) const
  {
    const Moments a = MomentsOf(field, windows[0]), b = MomentsOf(field, windows[1]);
    if (!a.whole || !b.whole)
      return false;
    mean = std::abs(a.mean - b.mean);
    // A thousandth of the level is no texture.
    const double rounding = 1e-6 * 0.5 * (a.mean * a.mean + b.mean * b.mean) + 1e-30;
    gradient = std::abs(std::log((a.energy + rounding) / (b.energy + rounding)));
    return true;
  }

  void MeasureFace(const std::array<int, 3>& p, int axis, bool alsoWithin, Sums& sums) const
  {
    if (p[axis] + 1 >= box_.size[axis])
      return;
    const std::ptrdiff_t here = At(p[0], p[1], p[2]), next = here + strides_[axis];
    if (std::isnan(result_[next]))
      return;
    const bool border = sets_[here] != sets_[next], changes = !border && followed_[here] != followed_[next];
    const bool within = !border && alsoWithin && count_[here] == 1;
    Window windows[2];
    double mean = 0.0, gradient = 0.0;
    if (!(border || changes || within) || !WindowsOf(p, axis, windows) || (!border && !Alike(windows, sets_[here])) ||
        !JumpOf(result_, windows, mean, gradient))
      return;
    if (changes) {
      ++sums.changes;
      if (!IsCut(windows, axis, followed_[here], followed_[next]))
        return;
    }
    (border ? sums.borders : changes ? sums.cuts : sums.within).Add(mean, gradient);
    if (within)
      return;
    // The same in the volumes that are shown here; in any others that reach across where those do not.
    Jumps shown, others;
    for (const TileVolume& volume : volumes_)
      if (JumpOf(volume.values, windows, mean, gradient))
        (volume.number == followed_[here] || volume.number == followed_[next] ? shown : others).Add(mean, gradient);
    const Jumps& jumps = shown.faces ? shown : others;
    if (jumps.faces)
      (border ? sums.bordersOfVolumes : sums.cutsOfVolumes)
          .Add(jumps.mean / static_cast<double>(jumps.faces), jumps.gradient / static_cast<double>(jumps.faces));
  }

  // How little the result resembles a volume: how its difference varies; among those that vary alike, which is nearer.
  double Unlikeness(int number, const Window& window) const
  {
    const Floats& values =
        std::find_if(volumes_.begin(), volumes_.end(), [number](const TileVolume& v) { return v.number == number; })->values;
    double sum = 0.0, squares = 0.0;
    const std::ptrdiff_t origin = At(window.first[0], window.first[1], window.first[2]);
    for (int k = 0; k < window.size[2]; ++k)
      for (int j = 0; j < window.size[1]; ++j)
        for (int i = 0; i < window.size[0]; ++i) {
          const double difference = double{result_[origin + At(i, j, k)]} - values[origin + At(i, j, k)];
          sum += difference;
          squares += difference * difference;
        }
    const double count = static_cast<double>(window.size[0]) * window.size[1] * window.size[2], mean = sum / count;
    return Unlike(std::max(0.0, squares / count - mean * mean), mean);
  }

  // Whether the result is clearly the one volume on this side and the other on that, a little off the face: which voxel a cut
  // is at is not known so exactly. Where a smooth blend is half-way it resembles now this, now that volume a little more: there
  // is a change, but no cut.
  bool IsCut(const Window windows[2], int axis, int one, int other) const
  {
    const auto clearly = [&](Window window, int shift, int shown, int hidden) {
      window.first[axis] += shift;
      return window.first[axis] >= 0 && window.first[axis] + window.size[axis] <= box_.size[axis] &&
             Unlikeness(shown, window) <= 0.25 * Unlikeness(hidden, window);
    };
    return clearly(windows[0], -aside, one, other) && clearly(windows[1], aside, other, one);
  }

  // Whether both windows lie where the set of volumes is this one.
  bool Alike(const Window windows[2], std::uint64_t set) const
  {
    for (int side = 0; side < 2; ++side) {
      const Window& w = windows[side];
      for (int k = 0; k < w.size[2]; ++k)
        for (int j = 0; j < w.size[1]; ++j)
          for (int i = 0; i < w.size[0]; ++i)
            if (sets_[At(w.first[0] + i, w.first[1] + j, w.first[2] + k)] != set)
              return false;
    }
    return true;
  }

  void MeasureTexture(const std::array<int, 3>& p, Sums& sums) const
  {
    Window window;
    for (int axis = 0; axis < 3; ++axis) {
      window.size[axis] = shape_.Width(axis);
      window.first[axis] = p[axis] - shape_.radius[axis];
      if (window.first[axis] < 0 || window.first[axis] + window.size[axis] > box_.size[axis])
        return;
    }
    const Moments result = MomentsOf(result_, window);
    if (!result.whole)
      return;
    int covers = 0;
    double weights = 0.0, deviation = 0.0, level = 0.0;
    for (const TileVolume& volume : volumes_) {
      const Moments source = MomentsOf(volume.values, window);
      if (!source.whole)
        continue;
      ++covers;
      double weight = 1.0;
      if (!volume.trust.empty()) {
        weight = volume.trust[At(p[0], p[1], p[2])];
        weight = weight > 0.01 ? std::min(weight, 1.0) : 0.01;
      }
      weights += weight;
      deviation += weight * source.deviation;
      level += weight * std::abs(source.mean);
    }
    deviation /= weights;
    level /= weights;
    if (covers < 2 || deviation <= 1e-3 * level || deviation <= 0.0)
      return;
    sums.texture.push_back(static_cast<float>(result.deviation / deviation));
    sums.snr.push_back(static_cast<float>(std::abs(result.mean) / std::max(result.deviation, 1e-6 * std::abs(result.mean))));
    sums.snrOfVolumes.push_back(static_cast<float>(level / deviation));
  }

  const Shape& shape_;
  GridBox core_, box_;
  std::array<std::ptrdiff_t, 3> strides_{};
  std::vector<TileVolume> volumes_;
  Floats result_;
  std::vector<int> count_, followed_;
  std::vector<std::uint64_t> sets_;
};

double Median(std::vector<float>& values)
{
  if (values.empty())
    return notMeasured;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

SeamVisibility VisibilityOf(const Jumps& result, const Jumps& volumes, const Jumps& within, double level)
{
  SeamVisibility seam;
  seam.faces = result.faces;
  const Jumps& same = 10 * volumes.faces >= result.faces ? volumes : within;
  if (result.faces == 0 || same.faces == 0)
    return seam;
  // Where nothing varies, a thousandth of the level is the least that counts.
  const auto ratio = [&](double Jumps::*sum, double least) {
    const double jump = result.*sum / static_cast<double>(result.faces), usual = same.*sum / static_cast<double>(same.faces);
    return (jump + least) / (usual + least);
  };
  seam.mean = ratio(&Jumps::mean, 1e-3 * level + 1e-30);
  seam.gradient = ratio(&Jumps::gradient, 1e-3);
  return seam;
}

double Larger(double a, double b)
{
  return std::isnan(a) ? b : std::isnan(b) ? a : std::max(a, b);
}

} // namespace

ParameterList Describe(StitchQualityParameters& p)
{
  return {Parameter("Stride", p.stride, {1, 1000}, "", "One of Stride^3 windows and one of Stride^2 faces is measured.")};
}

template <class T>
StitchQualityReport MeasureStitch(const std::vector<StitchInput>& volumes, const ImageGeometry& grid,
                                  VolumeView<const T> stitched, VolumeView<const unsigned char> valid,
                                  const AnyPosedVolume* reference, const StitchQualityParameters& parameters,
                                  const Progress& progress)
{
  CheckRanges(parameters);
  if (volumes.empty())
    throw Error(Error::Kind::BadInput, "there are no volumes to measure the result against");
  grid.Check("the stitched volume");
  if (stitched.Dimensions() != grid.dimensions || (!valid.Empty() && valid.Dimensions() != grid.dimensions))
    throw Error(Error::Kind::BadInput, "the stitched volume: its voxels are not of the size that its geometry says");
  std::vector<AnySampler> samplers;
  std::vector<std::optional<RowSampler<float>>> trusts;
  for (const StitchInput& input : volumes) {
    samplers.push_back(SamplerOf(input.volume, input.name, grid, input.displacement));
    trusts.push_back(TrustOf(input, grid));
  }
  std::optional<AnySampler> truth;
  if (reference)
    truth.emplace(SamplerOf(*reference, "the reference", grid, nullptr));

  const Shape shape = ShapeOf(grid, parameters.stride);
  const auto& n = grid.dimensions;
  const int tilesJ = (n[1] + tileRows - 1) / tileRows, tilesK = (n[2] + tileRows - 1) / tileRows;
  std::vector<Sums> parts(static_cast<std::size_t>(tilesJ) * static_cast<std::size_t>(tilesK));
  ParallelFor(static_cast<std::ptrdiff_t>(parts.size()), progress, [&](std::ptrdiff_t number) {
    GridBox core{{0, static_cast<int>(number % tilesJ) * tileRows, static_cast<int>(number / tilesJ) * tileRows}, n};
    for (int axis = 1; axis < 3; ++axis)
      core.size[axis] = std::min(tileRows, n[axis] - core.first[axis]);
    Tile<T> tile(shape, core);
    tile.Load(samplers, trusts, stitched, valid);
    tile.Measure(truth ? &*truth : nullptr, parts[number]);
  });
  Sums sums;
  for (const Sums& part : parts)
    sums += part;

  StitchQualityReport report;
  const double level = sums.voxels ? sums.level / static_cast<double>(sums.voxels) : 0.0;
  report.borders = VisibilityOf(sums.borders, sums.bordersOfVolumes, sums.within, level);
  // A smooth blend too comes close to one volume here and to another there, by chance.
  if (3 * sums.cuts.faces < sums.changes)
    sums.cuts = {};
  report.cuts = VisibilityOf(sums.cuts, sums.cutsOfVolumes, sums.within, level);
  report.seamMean = Larger(report.borders.mean, report.cuts.mean);
  report.seamGradient = Larger(report.borders.gradient, report.cuts.gradient);
  report.overlapWindows = static_cast<std::ptrdiff_t>(sums.texture.size());
  report.textureKept = Median(sums.texture);
  report.snr = Median(sums.snr);
  report.snrSources = Median(sums.snrOfVolumes);
  report.overlapVoxels = sums.overlap;
  if (sums.known[1])
    report.errorOverlap = sums.errors[1] / static_cast<double>(sums.known[1]);
  if (sums.known[0])
    report.errorOutside = sums.errors[0] / static_cast<double>(sums.known[0]);
  return report;
}

#define ECHORAMA_INSTANTIATE(T)                                                                                                  \
  template StitchQualityReport MeasureStitch<T>(const std::vector<StitchInput>&, const ImageGeometry&, VolumeView<const T>,      \
                                                VolumeView<const unsigned char>, const AnyPosedVolume*,                          \
                                                const StitchQualityParameters&, const Progress&);
ECHORAMA_FOR_EACH_VOXEL_TYPE(ECHORAMA_INSTANTIATE)
#undef ECHORAMA_INSTANTIATE

} // namespace echorama
