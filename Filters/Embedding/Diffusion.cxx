// SPDX-License-Identifier: BSD-3-Clause
//
// Voxels near the sources are summed, the others interpolated between nodes of coarser and coarser lattices (DiffusionLevels).
// Sums are made for tiles of 8^3 nodes: one list for all of a tile's points, of single sources near it and of clusters of
// sources, ever larger with distance, expanded to second order (DiffusionTree, DiffusionSums).
//
// The exponent jumps at the border of the region, and there the lattices must not mix the two: each exponent has lattices of its
// own, which know D on both sides but are read on one.
//
// Values are taken relative to the middle of their range, so that a constant is 0 in all sums.
//
// Cost: with n source voxels on a surface, some ten n points are summed over a few hundred sources and clusters each.
// Memory beyond the result: five bytes per voxel for distances and nodes, and coarser lattices of some bytes per voxel in all.
#include "Diffusion.h"
#include "Core/Base/CheckRange.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/DistanceMap.h"
#include "DiffusionLevels.h"
#include "DiffusionTree.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>

namespace echorama {

namespace {

constexpr int TileSide = 8;
constexpr std::size_t FewSources = 512;  // their sums cost no more than lattices, which are at their worst with them
constexpr std::size_t ExactChunk = 1024; // sources whose sums are floats, before they are added to doubles

struct ChannelRange { // of one channel
  float middle = 0.0f, least = 0.0f, most = 0.0f;
};

struct Problem {
  const DiffusionParameters& parameters;
  const DiffusionSources& sources;
  const Eigen::Vector3d& spacing;
  VolumeView<const float> squaredDistance;
  std::vector<std::vector<float>> rows; // ones, then channels relative to their middle
  std::vector<ChannelRange> spreads;
  const std::vector<VolumeView<float>>& result;
};

void Check(const DiffusionParameters& parameters, const DiffusionSources& sources, const Eigen::Vector3d& spacing,
           VolumeView<const unsigned char> region, VolumeView<const unsigned char> wanted,
           const std::vector<VolumeView<float>>& result)
{
  CheckRanges(parameters);
  CheckRange("the number of channels", sources.channels, 1, DiffusionRows - 1);
  if (sources.voxels.empty())
    throw Error(Error::Kind::BadInput, "there is nothing to spread: no source voxel was given");
  if (sources.values.size() != sources.voxels.size() * static_cast<std::size_t>(sources.channels))
    throw Error(Error::Kind::BadInput, "the sources have " + std::to_string(sources.voxels.size()) + " voxels and " +
                                           std::to_string(sources.channels) + " channels, but " +
                                           std::to_string(sources.values.size()) + " values");
  if (!std::all_of(sources.values.begin(), sources.values.end(), [](float value) { return std::isfinite(value); }))
    throw Error(Error::Kind::BadInput, "the values to be spread are not all finite");
  if (result.size() != static_cast<std::size_t>(sources.channels))
    throw Error(Error::Kind::BadInput, "diffusion needs one result for each channel");
  for (const auto& view : result)
    if (view.Empty() || view.Dimensions() != result[0].Dimensions())
      throw Error(Error::Kind::BadInput, "the results of diffusion differ in size");
  for (const auto& view : {region, wanted})
    if (!view.Empty() && view.Dimensions() != result[0].Dimensions())
      throw Error(Error::Kind::BadInput, "the masks of diffusion and its results differ in size");
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    if (!(spacing[axis] > 0.0 && std::isfinite(spacing[axis])))
      throw Error(Error::Kind::InvalidParameter, "the spacing must be positive and finite");
}

Volume<unsigned char> MaskOf(const DiffusionSources& sources, const std::array<int, 3>& grid)
{
  Volume<unsigned char> mask(grid, 0);
  for (const auto& voxel : sources.voxels) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (voxel[axis] < 0 || voxel[axis] >= grid[axis])
        throw Error(Error::Kind::BadInput, "a source voxel lies outside of the grid");
    unsigned char& at = mask.View()(voxel[0], voxel[1], voxel[2]);
    if (at)
      throw Error(Error::Kind::BadInput, "two sources lie on one voxel");
    at = 1;
  }
  return mask;
}

float Finished(const Problem& problem, std::size_t channel, float value, bool voxels)
{
  if (!voxels)
    return value;
  const ChannelRange& spread = problem.spreads[channel];
  return std::min(std::max(value + spread.middle, spread.least), spread.most);
}

// Sums at the nodes of one tile.
class TileSum {
public:
  TileSum(const Problem& problem, const DiffusionExponent& exponent, const DiffusionTree* tree,
          const DiffusionTolerance& tolerance)
    : problem_(problem), exponent_(exponent), tree_(tree), tolerance_(tolerance)
  {
  }

  void Run(DiffusionLevel& level, bool voxels, const std::array<int, 3>& begin)
  {
    std::array<int, 3> end;
    for (std::size_t axis = 0; axis < 3; ++axis)
      end[axis] = std::min(begin[axis] + TileSide, level.size[axis]);
    Gather(level, begin, end);
    if (points_.empty())
      return;
    ListSources();
    const auto rows = problem_.rows.size();
    for (std::size_t start = 0; start < points_.size(); start += DiffusionBlock::Most) {
      block_.count = static_cast<int>(std::min<std::size_t>(DiffusionBlock::Most, points_.size() - start));
      for (int t = 0; t < block_.count; ++t) {
        const Point& point = points_[start + static_cast<std::size_t>(t)];
        block_.x[t] = static_cast<float>(point.place[0] - origin_[0]);
        block_.y[t] = static_cast<float>(point.place[1] - origin_[1]);
        block_.z[t] = static_cast<float>(point.place[2] - origin_[2]);
        block_.nearest[t] = static_cast<float>(point.nearest2);
      }
      double sums[DiffusionRows][DiffusionBlock::Most] = {};
      const auto keep = [&]() {
        for (std::size_t row = 0; row < rows; ++row)
          for (int t = 0; t < block_.count; ++t)
            sums[row][t] += static_cast<double>(block_.sums[row][t]);
      };
      for (std::size_t s = 0; s < near_.x.size(); s += ExactChunk) {
        block_.Start();
        AddNear(exponent_, near_, static_cast<int>(rows), s, std::min(s + ExactChunk, near_.x.size()), block_);
        keep();
      }
      if (!far_.x.empty()) {
        block_.Start();
        AddFar(exponent_, far_, static_cast<int>(rows), block_);
        keep();
      }
      for (int t = 0; t < block_.count; ++t) {
        const auto& node = points_[start + static_cast<std::size_t>(t)].node;
        for (std::size_t channel = 0; channel + 1 < rows; ++channel) {
          const auto value = static_cast<float>(sums[channel + 1][t] / sums[0][t]);
          (voxels ? problem_.result[channel] : level.values[channel].View())(node[0], node[1], node[2]) =
              Finished(problem_, channel, value, voxels);
        }
      }
    }
  }

private:
  struct Point {
    std::array<int, 3> node;
    Eigen::Vector3d place;
    double nearest2;
  };

  void Gather(const DiffusionLevel& level, const std::array<int, 3>& begin, const std::array<int, 3>& end)
  {
    points_.clear();
    const auto& grid = problem_.squaredDistance.Dimensions();
    const auto nodes = level.nodes.View();
    for (int k = begin[2]; k < end[2]; ++k)
      for (int j = begin[1]; j < end[1]; ++j) {
        const unsigned char* const row = nodes.Row(j, k);
        for (int i = begin[0]; i < end[0]; ++i) {
          if (row[i] != static_cast<unsigned char>(DiffusionNode::Summed))
            continue;
          const auto v = level.Voxel(i, j, k);
          Point point{{i, j, k}, Eigen::Vector3d(v[0], v[1], v[2]).cwiseProduct(problem_.spacing), 0.0};
          const bool inside = v[0] >= 0 && v[0] < grid[0] && v[1] >= 0 && v[1] < grid[1] && v[2] >= 0 && v[2] < grid[2];
          point.nearest2 =
              inside ? static_cast<double>(problem_.squaredDistance(v[0], v[1], v[2])) : tree_->SquaredDistance(point.place);
          points_.push_back(point);
        }
      }
  }

  void ListSources()
  {
    Eigen::Vector3d low = points_[0].place, high = low;
    double nearest2 = 0.0;
    for (const Point& point : points_) {
      low = low.cwiseMin(point.place);
      high = high.cwiseMax(point.place);
      nearest2 = std::max(nearest2, point.nearest2);
    }
    origin_ = 0.5 * (low + high);
    if (tree_) {
      tree_->List(exponent_, tolerance_, low, high, std::sqrt(nearest2), origin_, near_, far_);
      return;
    }
    const auto rows = static_cast<int>(problem_.rows.size());
    near_.Clear(rows);
    for (const auto& voxel : problem_.sources.voxels) {
      near_.x.push_back(static_cast<float>(voxel[0] * problem_.spacing[0] - origin_[0]));
      near_.y.push_back(static_cast<float>(voxel[1] * problem_.spacing[1] - origin_[1]));
      near_.z.push_back(static_cast<float>(voxel[2] * problem_.spacing[2] - origin_[2]));
    }
    for (int row = 0; row < rows; ++row)
      near_.values[static_cast<std::size_t>(row)] = problem_.rows[static_cast<std::size_t>(row)];
    near_.Pad(rows);
  }

  const Problem& problem_;
  const DiffusionExponent& exponent_;
  const DiffusionTree* tree_;
  DiffusionTolerance tolerance_;
  std::vector<Point> points_;
  Eigen::Vector3d origin_;
  DiffusionNear near_;
  DiffusionFar far_;
  DiffusionBlock block_;
};

// What an accuracy takes: measured with white noise on the surface, the worst there is, for d from 1 to 64.
double StepsFor(double accuracy, double d)
{
  return std::max(2.5, std::max(3.0, std::sqrt(d) * (1.8 + 0.01 * d)) * std::pow(0.002 / accuracy, 1.0 / 9.0));
}

DiffusionTolerance ToleranceFor(double accuracy)
{
  return {std::min(1.0, 0.15 * std::pow(accuracy / 0.002, 0.7)), 0.05 * accuracy};
}

// Source nodes of a level get the values of their sources.
void PutSources(const Problem& problem, const DiffusionLevel& level, bool voxels, std::size_t channel, VolumeView<float> values)
{
  const std::size_t count = problem.sources.voxels.size();
  const float* const own = voxels ? problem.sources.values.data() + channel * count : problem.rows[channel + 1].data();
  for (std::size_t s = 0; s < count; ++s) {
    std::array<int, 3> node;
    bool there = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int from = problem.sources.voxels[s][axis] - level.first[axis];
      node[axis] = from / level.step[axis];
      there = there && from % level.step[axis] == 0;
    }
    if (there && level.nodes.View()(node[0], node[1], node[2]) == static_cast<unsigned char>(DiffusionNode::Source))
      values(node[0], node[1], node[2]) = own[s];
  }
}

// All voxels of one exponent: those with wanted(i, j, k).
template <class Wanted>
void DiffuseWith(const Problem& problem, double d, const Wanted& wanted, const Progress& progress)
{
  const auto& grid = problem.squaredDistance.Dimensions();
  const auto channels = static_cast<std::size_t>(problem.sources.channels);
  const double accuracy = problem.parameters.accuracy;
  const bool exact = problem.parameters.exact;
  const double farthest =
      std::sqrt(static_cast<double>(*std::max_element(problem.squaredDistance.begin(), problem.squaredDistance.end())));
  const bool lattices = !exact && problem.sources.voxels.size() > FewSources;
  const double steps = lattices ? StepsFor(accuracy, d) : std::numeric_limits<double>::infinity();
  std::vector<DiffusionLevel> levels = MakeDiffusionLevels(grid, problem.spacing, steps, farthest, problem.sources.channels);
  ParallelFor(grid[2], progress.Part(0.0, 0.02), [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < grid[1]; ++j) {
      unsigned char* const row = levels[0].nodes.View().Row(j, k);
      for (int i = 0; i < grid[0]; ++i)
        if (wanted(i, j, k))
          row[i] = static_cast<unsigned char>(DiffusionNode::Summed);
    }
  });
  PlanDiffusionLevels(levels, problem.spacing, problem.squaredDistance, progress.Part(0.02, 0.1));
  std::unique_ptr<const DiffusionTree> tree;
  if (!exact)
    tree = std::make_unique<const DiffusionTree>(problem.sources.voxels, problem.spacing, problem.rows, d);

  const DiffusionExponent exponent(d);
  for (std::size_t number = levels.size(); number-- > 0;) {
    DiffusionLevel& level = levels[number];
    const bool voxels = number == 0;
    const auto done = static_cast<double>(levels.size() - 1 - number), all = static_cast<double>(levels.size());
    const Progress part = progress.Part(voxels ? 0.3 : 0.1 + 0.2 * done / all, voxels ? 1.0 : 0.1 + 0.2 * (done + 1.0) / all);
    for (std::size_t channel = 0; channel < channels; ++channel) {
      const VolumeView<float> values = voxels ? problem.result[channel] : level.values[channel].View();
      const ChannelRange& spread = problem.spreads[channel];
      if (number + 1 < levels.size())
        RefineDiffusionLevel(levels[number + 1], level, channel, values, voxels ? spread.middle : 0.0f,
                             voxels ? spread.least : spread.least - spread.middle,
                             voxels ? spread.most : spread.most - spread.middle,
                             part.Part(0.02 * static_cast<double>(channel), 0.02 * static_cast<double>(channel + 1)));
      PutSources(problem, level, voxels, channel, values);
    }
    std::array<int, 3> tiles;
    for (std::size_t axis = 0; axis < 3; ++axis)
      tiles[axis] = (level.size[axis] + TileSide - 1) / TileSide;
    ParallelRanges(
        static_cast<std::ptrdiff_t>(tiles[0]) * tiles[1] * tiles[2], exact ? 1 : 16, part.Part(0.1, 1.0),
        [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
          TileSum sum(problem, exponent, tree.get(), ToleranceFor(accuracy));
          for (auto tile = static_cast<int>(begin); tile < static_cast<int>(end); ++tile)
            sum.Run(level, voxels,
                    {tile % tiles[0] * TileSide, tile / tiles[0] % tiles[1] * TileSide, tile / (tiles[0] * tiles[1]) * TileSide});
        });
  }
}

} // namespace

ParameterList Describe(DiffusionParameters& p)
{
  const std::string text = " the data: the larger, the more the nearest surface counts alone.";
  return {
      Parameter("InsideExponent", p.insideExponent, {1, 64}, "",
                "Exponent of distance by which values at the surface spread inside" + text),
      Parameter("OutsideExponent", p.outsideExponent, {1, 64}, "",
                "Exponent of distance by which values at the surface spread outside of" + text),
      Parameter("Exact", p.exact, "Sum over the whole surface for every voxel: slow, to compare with.").Advanced(),
      Parameter("Accuracy", p.accuracy, {0.0001, 0.1}, "",
                "The largest error that is aimed at, as a share of the range of the values at the surface.")
          .When("Exact", "off")
          .Advanced(),
  };
}

void Diffuse(const DiffusionParameters& parameters, const DiffusionSources& sources, const Eigen::Vector3d& spacing,
             VolumeView<const unsigned char> region, VolumeView<const unsigned char> wanted,
             const std::vector<VolumeView<float>>& result, const Progress& progress)
{
  Check(parameters, sources, spacing, region, wanted, result);
  const auto& grid = result[0].Dimensions();
  Volume<float> squaredDistance(grid);
  SquaredDistanceMap(MaskOf(sources, grid).View(), spacing, squaredDistance.View(), progress.Part(0.0, 0.05));

  Problem problem{parameters, sources, spacing, squaredDistance.View(), {}, {}, result};
  const std::size_t count = sources.voxels.size();
  problem.rows.emplace_back(count, 1.0f);
  for (std::size_t channel = 0; channel < static_cast<std::size_t>(sources.channels); ++channel) {
    const float* const values = sources.values.data() + channel * count;
    const auto [least, most] = std::minmax_element(values, values + count);
    const ChannelRange spread{0.5f * *least + 0.5f * *most, *least, *most};
    problem.spreads.push_back(spread);
    problem.rows.emplace_back(values, values + count);
    for (float& value : problem.rows.back())
      value -= spread.middle;
  }

  const auto isWanted = [&](int i, int j, int k) { return wanted.Empty() || wanted(i, j, k) != 0; };
  if (region.Empty() || parameters.insideExponent == parameters.outsideExponent) {
    DiffuseWith(problem, parameters.outsideExponent, isWanted, progress.Part(0.05, 1.0));
    return;
  }
  DiffuseWith(
      problem, parameters.insideExponent, [&](int i, int j, int k) { return region(i, j, k) != 0 && isWanted(i, j, k); },
      progress.Part(0.05, 0.5));
  DiffuseWith(
      problem, parameters.outsideExponent, [&](int i, int j, int k) { return region(i, j, k) == 0 && isWanted(i, j, k); },
      progress.Part(0.5, 1.0));
}

} // namespace echorama
