// SPDX-License-Identifier: BSD-3-Clause
// Points are drawn once per level, at random places in random voxels of both volumes, one in each stratum of voxels in the
// order of memory: neighbouring points read neighbouring voxels. They lie between voxels on purpose: then both volumes are
// read with the same blur, and no pose is better only because the grids fall together. At a pose each point is read in the other
// volume, value, weight and gradient from the same eight voxels; the gradient is that of the interpolation itself. For the
// metrics that explain patches, what is drawn are their centres.
//
// Loss of a difference r: 2 d^2 (sqrt(1 + r^2 / d^2) - 1), which is r^2 for small and 2 d |r| for large differences. What points
// differ by chance is measured on random pairs of points; similarity is 1 less loss over chance.
//
// Cost: per point and pose 8 reads and some 100 multiplications.
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Metric.h"
#include "MetricBlock.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

namespace echorama {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr std::ptrdiff_t Grain = 8 * BlockSize; // points of one task
constexpr int ChancePairs = 30000, PatchEdge = 5;

// Points of one volume: where (mm, from the middle of its grid, as its geometry stands), what it shows there, how much that
// counts, and in which block of tissue it lies.
struct Points {
  std::vector<float> x, y, z, value, second, descriptor, weight;
  std::vector<int> block;             // its number, once asked for
  std::vector<Eigen::Vector3f> drawn; // index coordinates; of patches the centres
  double mm3 = 0.0;                   // that one of them stands for
  double weights = 0.0, squares = 0.0;

  std::ptrdiff_t Count() const { return static_cast<std::ptrdiff_t>(x.size()); }
  BlockOfPoints Block(std::ptrdiff_t begin, std::ptrdiff_t end) const
  {
    return {&x[begin],
            &y[begin],
            &z[begin],
            value.empty() ? nullptr : &value[begin],
            &weight[begin],
            second.empty() ? nullptr : &second[begin],
            descriptor.empty() ? nullptr : &descriptor[ChannelStride * begin],
            static_cast<int>(std::min<std::ptrdiff_t>(BlockSize, end - begin))};
  }
};

double Uniform(std::uint32_t bits)
{
  return static_cast<double>(bits) * (1.0 / 4294967296.0);
}

// Where points fall, in continuous index coordinates: one in each stratum of real voxels.
std::vector<Eigen::Vector3f> Draw(const MetricLevel& level, int points, std::uint64_t seed)
{
  const auto& n = level.geometry.dimensions;
  const std::ptrdiff_t eligible = level.RealVoxels(), count = std::min<std::ptrdiff_t>(points, eligible);
  std::vector<Eigen::Vector3f> drawn(static_cast<std::size_t>(count));
  const auto first = [&](std::ptrdiff_t s) { return eligible / count * s + eligible % count * s / count; };
  ParallelRanges(count, 1 << 12, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    auto run = level.realBefore.begin();
    for (std::ptrdiff_t s = begin; s < end; ++s) {
      Random random(seed, static_cast<std::uint64_t>(s));
      std::array<std::uint32_t, 4> bits{};
      for (auto& b : bits)
        b = random.Bits();
      const std::ptrdiff_t wanted =
          first(s) + static_cast<std::ptrdiff_t>(Uniform(bits[0]) * static_cast<double>(first(s + 1) - first(s)));
      if (s == begin)
        run = std::upper_bound(run, level.realBefore.end(), wanted) - 1;
      while (run[1] <= wanted)
        ++run;
      std::ptrdiff_t voxel = (run - level.realBefore.begin()) * MetricLevel::RunLength;
      for (std::ptrdiff_t before = *run; !level.IsReal(voxel) || before++ < wanted;)
        ++voxel;
      const std::ptrdiff_t inSlice = voxel % (static_cast<std::ptrdiff_t>(n[0]) * n[1]);
      drawn[static_cast<std::size_t>(s)] = {
          static_cast<float>(static_cast<double>(inSlice % n[0]) + Uniform(bits[1]) - 0.5),
          static_cast<float>(static_cast<double>(inSlice / n[0]) + Uniform(bits[2]) - 0.5),
          static_cast<float>(static_cast<double>(voxel / (static_cast<std::ptrdiff_t>(n[0]) * n[1])) + Uniform(bits[3]) - 0.5)};
    }
  });
  return drawn;
}

class PointComparison : public LevelComparison {
public:
  explicit PointComparison(const ComparisonSetup& setup)
    : setup_(setup), scale2_(static_cast<float>(setup.metric->lossScale * setup.metric->lossScale)),
      isFitted_(setup.metric->fitsOverlap), isDescriptor_(!setup.fixed->descriptors.empty()),
      isPatches_(!setup.fixed->edges.empty())
  {
    for (int side = 0; side < 2; ++side) {
      const MetricLevel& level = side == 0 ? *setup.fixed : *setup.moving;
      const auto& n = level.geometry.dimensions;
      centres_[side] = level.geometry.Centre();
      worldToIndex_[side] = level.geometry.WorldToIndex();
      const Eigen::Affine3d toFixed(side == 0 ? Pose::Identity()
                                              : setup.fixedToWorld.inverse(Eigen::Isometry) * setup.startToWorld);
      toBlocks_[side] = Eigen::Scaling(1.0 / setup.blockMm) * toFixed * level.geometry.IndexToWorld();
      fields_[side] = {level.seen.data(), level.descriptors.data(), n[0], n[1], n[2]};
      points_[side] = Take(level, side);
    }
    smallerWeight_ = std::min(points_[0].mm3 * points_[0].squares, points_[1].mm3 * points_[1].squares);
    if (isPatches_)
      smallerWeight_ = std::min(PatchWeight(0), PatchWeight(1));
    chance_ = isFitted_ ? 2.0 : isPatches_ ? PatchChance() : Chance();
  }

  MetricSums At(const Pose& movingToWorld, const Eigen::Vector3d& centre, BlockGradients* blocks) const override
  {
    MetricSums sums;
    if (blocks)
      blocks->assign(NumberBlocks(), Vector6::Zero());
    for (int side = 0; side < 2; ++side) {
      const Points& points = points_[side];
      if (points.Count() == 0)
        continue;
      View view;
      view.field = &fields_[1 - side];
      const Pose& from = side == 0 ? setup_.fixedToWorld : movingToWorld;
      const Pose to = (side == 0 ? movingToWorld : setup_.fixedToWorld).inverse(Eigen::Isometry);
      Eigen::Affine3d pointToWorld = Eigen::Affine3d(from) * Eigen::Translation3d(centres_[side]);
      const Eigen::Affine3d worldToIndex = worldToIndex_[1 - side] * to;
      view.toIndex = MapOf(worldToIndex * pointToWorld);
      pointToWorld.translation() -= centre;
      view.toCentre = MapOf(pointToWorld);
      view.worldGradient = MapOf(Eigen::Affine3d(worldToIndex.linear().transpose()));
      if (isFitted_)
        view.fit = FitOf(view, points);
      const RawSums raw = ParallelSum<RawSums>(points.Count(), Grain, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
        RawSums part;
        for (std::ptrdiff_t b = begin; b < end; b += BlockSize)
          CompareWith(view, points.Block(b, end), &part, [](const Terms&) {});
        return part;
      });
      const double share = 0.5 * points.mm3, sign = side == 0 ? -1.0 : 1.0;
      AddTo(sums, raw, share, sign);
      sums.moment += share * raw.weight * centre;
      if (points_[side].mm3 * points_[side].weights <= points_[1 - side].mm3 * points_[1 - side].weights)
        sums.share = points.weights > 0.0 ? raw.covered / points.weights : 0.0;
      if (blocks)
        AddBlocks(view, raw, points, share * sign, *blocks);
    }
    sums.similar = sums.weight - sums.loss / chance_;
    return sums;
  }

private:
  // How one volume is read at the other's points.
  struct View {
    const Field* field = nullptr;
    Map toIndex{}, toCentre{}, worldGradient{};
    Fit fit;
  };

  // Reads a block and adds up; \a each, if given, sees each set of differences with its Jacobian.
  template <class Each>
  void CompareWith(const View& view, const BlockOfPoints& points, RawSums* sums, const Each& each) const
  {
    Terms t;
    if (points.count < BlockSize)
      t = Terms{};
    if (isDescriptor_) {
      Condensed condensed;
      if (points.count < BlockSize)
        condensed = Condensed{};
      ReadDescriptors(*view.field, view.toIndex, points, t, condensed);
      Place(view.toCentre, scale2_, points, t);
      if (sums)
        SumLoss(t, scale2_, *sums);
      for (int c = 0; c < 3; ++c) {
        std::copy_n(condensed.r[c], BlockSize, t.r);
        for (int d = 0; d < 3; ++d)
          std::copy_n(condensed.gradient[c][d], BlockSize, t.jacobian[d]);
        Turn(view.worldGradient, t);
        RawSums unused;
        SumSlopes(t, sums ? *sums : unused);
        each(t);
      }
      return;
    }
    Fit fit = view.fit;
    if (isPatches_)
      fit.valueScale = 0.0f; // bare values
    ReadValues(*view.field, view.toIndex, fit, points, t);
    Place(view.toCentre, scale2_, points, t);
    Turn(view.worldGradient, t);
    if (isPatches_)
      ExplainPatches(points, PatchFloor, true, t);
    RawSums unused;
    RawSums& to = sums ? *sums : unused;
    SumLoss(t, scale2_, to);
    SumSlopes(t, to);
    if (isFitted_) {
      float theirs[BlockSize] = {};
      for (int p = 0; p < points.count; ++p)
        theirs[p] = t.r[p] + fit.valueScale * points.value[p] + fit.valueOffset;
      SumFit(t, theirs, to);
    }
    each(t);
  }
  // Scales both sides to mean 0 and deviation 1 over the overlap.
  static Fit FitOf(const View& view, const Points& points)
  {
    const RawSums raw = ParallelSum<RawSums>(points.Count(), Grain, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
      RawSums part;
      for (std::ptrdiff_t b = begin; b < end; b += BlockSize) {
        const BlockOfPoints block = points.Block(b, end);
        Terms t;
        if (block.count < BlockSize)
          t = Terms{};
        ReadValues(*view.field, view.toIndex, {1.0f, 0.0f, 0.0f, 0.0f}, block, t);
        float ours[BlockSize] = {};
        std::copy_n(block.value, block.count, ours);
        SumValues(t, ours, part);
      }
      return part;
    });
    Fit fit;
    if (!(raw.weight > 0.0))
      return fit;
    const double w = raw.weight, t = raw.values[0] / w, o = raw.values[1] / w;
    const double tt = std::fmax(raw.values[2] / w - t * t, 1e-12), oo = std::fmax(raw.values[3] / w - o * o, 1e-12);
    fit.readScale = static_cast<float>(1.0 / std::sqrt(tt));
    fit.readOffset = static_cast<float>(-t / std::sqrt(tt));
    fit.valueScale = static_cast<float>(1.0 / std::sqrt(oo));
    fit.valueOffset = static_cast<float>(-o / std::sqrt(oo));
    return fit;
  }

  void AddTo(MetricSums& sums, const RawSums& raw, double share, double sign) const
  {
    Vector6 gradient = Eigen::Map<const Vector6>(raw.gradient);
    Matrix6 hessian;
    int k = 0;
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j <= i; ++j)
        hessian(i, j) = hessian(j, i) = raw.hessian[k++];
    if (isFitted_ && raw.weight > 0.0) {
      const Vector6 slopes = Eigen::Map<const Vector6>(raw.slopes), theirs = Eigen::Map<const Vector6>(raw.theirSlopes);
      gradient -= raw.residualTheirs / raw.weight * theirs;
      hessian -= (slopes * slopes.transpose() + theirs * theirs.transpose()) / raw.weight;
    }
    sums.weight += share * raw.weight;
    sums.loss += share * raw.loss;
    sums.moment += share * Eigen::Map<const Eigen::Vector3d>(raw.moment);
    sums.gradient += share * sign * gradient;
    sums.hessian += share * hessian;
  }

  // The gradient's parts by blocks of tissue: a few ranges of points, each with sums of its own.
  void AddBlocks(const View& view, const RawSums& raw, const Points& points, double factor, BlockGradients& blocks) const
  {
    Vector6 slopes = Vector6::Zero(), theirSlopes = Vector6::Zero();
    if (isFitted_ && raw.weight > 0.0) {
      slopes = Eigen::Map<const Vector6>(raw.slopes) / raw.weight;
      theirSlopes = Eigen::Map<const Vector6>(raw.theirSlopes) / raw.weight;
    }
    constexpr std::ptrdiff_t ranges = 16;
    const std::ptrdiff_t grain = ((points.Count() + ranges - 1) / ranges + BlockSize - 1) / BlockSize * BlockSize;
    std::vector<BlockGradients> parts(ranges);
    ParallelRanges(points.Count(), grain, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
      BlockGradients& part = parts[static_cast<std::size_t>(begin / grain)];
      part.assign(blocks.size(), Vector6::Zero());
      for (std::ptrdiff_t b = begin; b < end; b += BlockSize) {
        const BlockOfPoints block = points.Block(b, end);
        CompareWith(view, block, nullptr, [&](const Terms& t) {
          for (int p = 0; p < block.count; ++p) {
            const double r = factor * static_cast<double>(t.r[p]), w = static_cast<double>(t.curved[p]);
            if (w == 0.0)
              continue;
            const double theirs =
                isFitted_ ? static_cast<double>(t.r[p] + view.fit.valueScale * block.value[p] + view.fit.valueOffset) : 0.0;
            Vector6& sum = part[static_cast<std::size_t>(points.block[static_cast<std::size_t>(b + p)])];
            for (int d = 0; d < 6; ++d)
              sum[d] += r * (static_cast<double>(t.curvedJ[d][p]) - w * (slopes[d] + theirs * theirSlopes[d]));
          }
        });
      }
    });
    for (const BlockGradients& part : parts)
      for (std::size_t i = 0; i < part.size(); ++i)
        blocks[i] += part[i];
  }

  Points Take(const MetricLevel& level, int side)
  {
    const int wanted = isPatches_ ? std::max(setup_.points / PatchSize, 16) : setup_.points;
    const std::vector<Eigen::Vector3f> drawn = Draw(level, wanted, setup_.seed);
    Points points;
    if (drawn.empty())
      return points;
    const std::size_t each = isPatches_ ? PatchSize : 1;
    points.mm3 =
        level.geometry.spacing.prod() * static_cast<double>(level.RealVoxels()) / static_cast<double>(drawn.size() * each);
    const Eigen::Affine3d toWorld = level.geometry.IndexToWorld();
    const Eigen::Vector3d stepInIndex = (std::exp2(level.octave) / level.geometry.spacing.array()).matrix();

    // Where, in index coordinates, and which block.
    std::vector<float> x, y, z;
    points.drawn.reserve(drawn.size());
    for (std::vector<float>* axis : {&x, &y, &z})
      axis->reserve(drawn.size() * each);
    for (const Eigen::Vector3f& at : drawn) {
      if (setup_.part != 0 && ((BlockAt(at, side).sum() % 2 + 2) % 2) + 1 != setup_.part)
        continue;
      points.drawn.push_back(at);
      for (std::size_t n = 0; n < each; ++n) {
        Eigen::Vector3d offset = Eigen::Vector3d::Zero();
        if (isPatches_) {
          const int i = static_cast<int>(n), reach = PatchEdge / 2;
          if (i < PatchEdge * PatchEdge * PatchEdge)
            offset = stepInIndex.cwiseProduct(
                Eigen::Vector3d(i % PatchEdge - reach, i / PatchEdge % PatchEdge - reach, i / (PatchEdge * PatchEdge) - reach));
          else
            offset.setConstant(-1e6); // far outside: weighs nothing
        }
        const Eigen::Vector3f p = (at.cast<double>() + offset).cast<float>();
        x.push_back(p.x());
        y.push_back(p.y());
        z.push_back(p.z());
      }
    }
    if (x.empty())
      return points;

    // What the volume shows there: read as the other volume is.
    const std::size_t count = x.size();
    const Map same = MapOf(Eigen::Affine3d::Identity());
    const std::vector<float> zero(count, 0.0f), one(count, 1.0f);
    points.weight.resize(count);
    if (isDescriptor_)
      points.descriptor.resize(ChannelStride * count);
    else
      points.value.resize(count);
    if (isPatches_)
      points.second.resize(count);
    ParallelRanges(static_cast<std::ptrdiff_t>(count), BlockSize, {}, [&](std::ptrdiff_t b, std::ptrdiff_t e) {
      const BlockOfPoints block{&x[b], &y[b], &z[b], &zero[b], &one[b], nullptr, nullptr, static_cast<int>(e - b)};
      if (isDescriptor_) {
        for (std::ptrdiff_t p = b; p < e; ++p)
          ReadDescriptor(fields_[side], x[p], y[p], z[p], &points.descriptor[ChannelStride * p], points.weight[p]);
        return;
      }
      Terms t;
      if (isPatches_) {
        Field edges = fields_[side];
        edges.seen = level.edges.data();
        ReadValues(edges, same, {}, block, t);
        std::copy_n(t.r, block.count, &points.second[b]);
      }
      ReadValues(fields_[side], same, {}, block, t);
      std::copy_n(t.r, block.count, &points.value[b]);
      std::copy_n(t.w, block.count, &points.weight[b]);
    });
    points.x.resize(count);
    points.y.resize(count);
    points.z.resize(count);
    for (std::size_t p = 0; p < count; ++p) {
      const Eigen::Vector3d inIndex(static_cast<double>(x[p]), static_cast<double>(y[p]), static_cast<double>(z[p]));
      const Eigen::Vector3f own = (toWorld * inIndex - centres_[side]).cast<float>();
      points.x[p] = own.x();
      points.y[p] = own.y();
      points.z[p] = own.z();
      points.weights += static_cast<double>(points.weight[p]);
      points.squares += static_cast<double>(points.weight[p]) * static_cast<double>(points.weight[p]);
    }
    return points;
  }

  // The block of tissue that a point (index coordinates) of a volume lies in, as the volumes lay at the start.
  Eigen::Vector3i BlockAt(const Eigen::Vector3f& at, int side) const
  {
    return (toBlocks_[side] * at.cast<double>()).array().floor().cast<int>();
  }

  // Numbers the blocks that hold points, and says how many there are. Seldom asked for, so done only then (by one caller at a
  // time).
  std::size_t NumberBlocks() const
  {
    if (blockCount_ > 0)
      return blockCount_;
    std::unordered_map<std::uint64_t, int> numbers;
    for (int side = 0; side < 2; ++side) {
      Points& points = points_[side];
      const std::size_t each = points.drawn.empty() ? 1 : points.x.size() / points.drawn.size();
      points.block.clear();
      for (const Eigen::Vector3f& at : points.drawn) {
        std::uint64_t key = 0;
        for (const int along : BlockAt(at, side))
          key = key << 21 | (static_cast<std::uint64_t>(along) & 0x1fffff);
        points.block.insert(points.block.end(), each, numbers.try_emplace(key, static_cast<int>(numbers.size())).first->second);
      }
    }
    return blockCount_ = numbers.size();
  }

  // The mean loss of points that have nothing to do with each other.
  double Chance() const
  {
    const Points &a = points_[0], &b = points_[1];
    if (a.Count() == 0 || b.Count() == 0)
      return 1.0;
    double loss = 0.0, weight = 0.0;
    for (std::uint64_t pair = 0; pair < ChancePairs; ++pair) {
      Random random(setup_.seed ^ 0x5bd1e995u, pair);
      const std::size_t i = random.Below(static_cast<std::uint64_t>(a.Count())),
                        j = random.Below(static_cast<std::uint64_t>(b.Count()));
      const double w = static_cast<double>(a.weight[i]) * static_cast<double>(b.weight[j]);
      float r2 = 0.0f;
      if (isDescriptor_) {
        for (std::size_t c = 0; c < Channels; ++c) {
          const float d = a.descriptor[ChannelStride * i + c] - b.descriptor[ChannelStride * j + c];
          r2 += d * d / static_cast<float>(Channels);
        }
      } else {
        const float d = a.value[i] - b.value[j];
        r2 = d * d;
      }
      loss += w * static_cast<double>(Loss(r2, scale2_));
      weight += w;
    }
    return loss > 0.0 ? loss / weight : 1.0;
  }

  // Patches of one volume explained by patches of the other somewhere else; and by themselves, for the weight.
  RawSums ExplainedBy(const Points& a, const Points& b, bool isItself) const
  {
    RawSums sums;
    const std::uint64_t patches = static_cast<std::uint64_t>(a.Count() / PatchSize),
                        others = static_cast<std::uint64_t>(b.Count() / PatchSize);
    for (std::uint64_t n = 0; n + 1 < patches && others > 0; n += 2) {
      Terms t{};
      for (std::uint64_t half = 0; half < 2; ++half) {
        Random random(setup_.seed ^ 0x5bd1e995u, n + half);
        const std::size_t other = isItself ? n + half : random.Below(others);
        for (std::size_t p = 0; p < PatchSize; ++p) {
          t.r[half * PatchSize + p] = b.value[other * PatchSize + p];
          t.w[half * PatchSize + p] = a.weight[(n + half) * PatchSize + p] * b.weight[other * PatchSize + p];
        }
      }
      ExplainPatches(a.Block(static_cast<std::ptrdiff_t>(n * PatchSize), a.Count()), PatchFloor, false, t);
      SumLoss(t, scale2_, sums);
    }
    return sums;
  }
  double PatchWeight(int side) const { return points_[side].mm3 * ExplainedBy(points_[side], points_[side], true).weight; }
  double PatchChance() const
  {
    RawSums sums = ExplainedBy(points_[0], points_[1], false);
    sums += ExplainedBy(points_[1], points_[0], false);
    return sums.loss > 0.0 ? sums.loss / sums.weight : 1.0;
  }

  static constexpr float PatchFloor = 0.0625f; // variance of a patch, in that of the volume, that counts half

  const ComparisonSetup setup_;
  const float scale2_;
  const bool isFitted_, isDescriptor_, isPatches_;
  std::array<Eigen::Vector3d, 2> centres_;
  std::array<Eigen::Affine3d, 2> worldToIndex_;
  std::array<Field, 2> fields_;
  std::array<Eigen::Affine3d, 2> toBlocks_; // from index coordinates
  mutable std::array<Points, 2> points_;    // their blocks are numbered when first asked for
  mutable std::size_t blockCount_ = 0;
  double chance_ = 2.0;
};

} // namespace

std::unique_ptr<LevelComparison> ComparePoints(const ComparisonSetup& setup)
{
  return std::make_unique<PointComparison>(setup);
}

} // namespace echorama
