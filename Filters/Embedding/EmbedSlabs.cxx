// SPDX-License-Identifier: BSD-3-Clause
//
// The grid is the coarse one with factor^3 voxels in the place of each. Noise and data have local statistics in windows that
// reach far beyond a slab, but these are made of sums over blocks of voxels: those of the data are kept as they are taken, and
// noise is made once for its sums, slices of blocks ahead of the slab, and once more for the bricks that the slab is made of.
// These need a halo no wider than the feather, and how the grid is cut makes no difference.
#include "EmbedSlabs.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/Memory.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/ScanConversion.h"
#include "Core/Imaging/VoxelTypes.h"
#include "EmbedGrid.h"
#include "FanNoise.h"
#include "Filters/Stitching/StitchSampler.h"
#include "ToneMapping.h"
#include <algorithm>
#include <cmath>
#include <deque>
#include <vector>

namespace echorama {

namespace {

constexpr int brickEdge = 256;   // voxels along x and y, without the halo
constexpr int aheadSlices = 128; // of noise, at a time, for its sums
constexpr int grainEdge = 160;   // of the brick on which the grain is measured
constexpr int leastSlices = 8;   // of a slab
constexpr int mostSlices = 256;

template <class T>
class SlabsOf : public EmbedSlabs {
public:
  SlabsOf(const Settings& settings, const ImageGeometry& data) : EmbedSlabs(settings, data)
  {
    EmbedParameters checked = settings.embed; // whose feather may be automatic
    checked.featherMm = std::max(checked.featherMm, 0.0);
    CheckRanges(checked);
    data.Check("the volume");
    if (*std::min_element(data.dimensions.begin(), data.dimensions.end()) < 2)
      throw Error(Error::Kind::BadInput, "embedding by slabs: it takes a volume of several slices");
    // As fine as the memory allows, and no coarser than the windows of local statistics can bear.
    const int most = static_cast<int>(settings.embed.smoothMm / 3.0 / data.spacing.maxCoeff());
    for (factor_ = 2; factor_ < most && CoarseBytes() > 0.5 * settings.bytes; ++factor_) {
    }
    const auto& n = data.dimensions;
    const double sliceBytes = static_cast<double>(SliceSize()) * (sizeof(T) + 1.0);
    slicesAtATime_ = std::clamp(static_cast<int>(0.1 * settings.bytes / sliceBytes), 1, std::min(64, n[2]));
    const double looking = CoarseBytes() + InputBytes();
    if (looking > settings.bytes)
      throw Error(Error::Kind::TooLarge, "embedding by slabs needs " + GigabytesText(looking) +
                                             " to look at all of the volume, and " + GigabytesText(settings.bytes) +
                                             " are allowed");
    coarse_ = data;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      coarse_.dimensions[axis] = (n[axis] + factor_ - 1) / factor_;
      first_[axis] = n[axis];
    }
    const int start = (factor_ - 1) / 2;
    coarse_.spacing *= factor_;
    coarse_.origin = data.IndexToWorld() * Eigen::Vector3d(start, start, start);
    sample_ = Volume<T>(coarse_.dimensions);
    isSampleReal_ = Volume<unsigned char>(coarse_.dimensions);
    isAnyReal_ = Volume<unsigned char>(coarse_.dimensions);
  }

  void Look(int first, int count, const void* intensity, const unsigned char* region) override
  {
    const auto& n = data_.dimensions;
    const VolumeView<const T> voxels(static_cast<const T*>(intensity), {n[0], n[1], count});
    const VolumeView<const unsigned char> real(region, {n[0], n[1], count});
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double all = 0.0;
    for (int k = 0; k < count; ++k) {
      const int K = (first + k) / factor_;
      const bool isSampled = first + k == SampleIn(K, 2);
      for (int j = 0; j < n[1]; ++j) {
        const unsigned char* const row = real.Row(j, k);
        const auto begin = std::find_if(row, row + n[0], [](unsigned char each) { return each != 0; });
        if (begin == row + n[0])
          continue;
        unsigned char* const any = isAnyReal_.View().Row(j / factor_, K);
        int last = 0, inRow = 0;
        for (int i = static_cast<int>(begin - row); i < n[0]; ++i)
          if (row[i]) {
            any[i / factor_] = 1;
            last = i;
            ++inRow;
          }
        first_ = {std::min(first_[0], static_cast<int>(begin - row)), std::min(first_[1], j), std::min(first_[2], first + k)};
        last_ = {std::max(last_[0], last), std::max(last_[1], j), std::max(last_[2], first + k)};
        sum += inRow * Eigen::Vector3d(0.5 * (static_cast<double>(begin - row) + last), j, k);
        all += inRow;
        if (isSampled && j == SampleIn(j / factor_, 1))
          for (int I = 0; I < coarse_.dimensions[0]; ++I) {
            sample_.View()(I, j / factor_, K) = voxels(SampleIn(I, 0), j, k);
            isSampleReal_.View()(I, j / factor_, K) = row[SampleIn(I, 0)];
          }
      }
    }
    if (all > mostReal_) {
      mostReal_ = all;
      KeepGrain(first, voxels, real, sum / all);
    }
  }

  void Plan(const Progress& progress) override
  {
    form_ = EncloseRegion(std::as_const(isAnyReal_).View(), coarse_, settings_.enclosing, progress.Part(0.0, 0.2));
    isAnyReal_ = Volume<unsigned char>();
    std::array<int, 3> first{}, last{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      first[axis] = first_[axis] / factor_;
      last[axis] = last_[axis] / factor_;
    }
    const EmbedGrid grid = EmbedGridOf(coarse_, first, last, form_);
    grid_ = data_;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      offset_[axis] = factor_ * grid.offset[axis];
      grid_.dimensions[axis] = factor_ * grid.geometry.dimensions[axis];
    }
    grid_.origin = data_.IndexToWorld() * Eigen::Vector3d(-offset_[0], -offset_[1], -offset_[2]);
    blocks_ = Blocks(grid_.dimensions, grid_.spacing, settings_.embed.smoothMm / 1.5);
    noiseSums_ = dataSums_ = BlockSums(blocks_, 0);
    reach_ = LocalStatistics::Reach(blocks_, grid_.spacing, settings_.embed.smoothMm);
    MeasureGrain(progress.Part(0.2, 0.4)); // and with it the feather
    int slices = mostSlices;
    while (slices > leastSlices && SlabBytes(slices) > settings_.bytes)
      slices = std::max(leastSlices, slices * 3 / 4);
    if (SlabBytes(slices) > settings_.bytes)
      throw Error(Error::Kind::TooLarge, "embedding by slabs needs " + GigabytesText(SlabBytes(slices)) + " on a grid of " +
                                             SizeText(grid_.dimensions) + " voxels, and " + GigabytesText(settings_.bytes) +
                                             " are allowed");
    slabs_ = (grid_.dimensions[2] + slices - 1) / slices;
    FindLevels(grid, progress.Part(0.4, 1.0));
  }

  std::pair<int, int> Missing(int first, int end) const override
  {
    const auto [from, to] = Needed(first, end);
    return IsKept(first, from) ? std::pair(std::max(from, taken_.second), std::max(to, taken_.second)) : std::pair(from, to);
  }

  void Take(int first, int count, const void* intensity, const unsigned char* region) override
  {
    if (first != taken_.second) { // what is there is of no use beside it
      held_.clear();
      taken_ = {first, first};
    }
    if (taken_.first == taken_.second)
      dataSums_ = BlockSums(blocks_, std::max(0, first + offset_[2]) / blocks_.size[2]);
    const auto size = static_cast<std::ptrdiff_t>(SliceSize());
    for (int k = 0; k < count; ++k) {
      const T* const voxels = static_cast<const T*>(intensity) + size * k;
      held_.push_back({{voxels, voxels + size}, {region + size * k, region + size * (k + 1)}});
    }
    taken_.second = first + count;
    AddData(first, count);
  }

  void Render(int first, int count, void* intensity, unsigned char* region, unsigned char* labels,
              const Progress& progress) override
  {
    const auto [from, to] = Needed(first, first + count);
    if (from < to && (!IsKept(first, from) || taken_.second < to))
      throw Error(Error::Kind::InvalidParameter, "embedding by slabs: slices of the data are missing");
    const auto around = BlocksFor(first, first + count, reach_), farther = BlocksFor(first, first + count, 2 * reach_);
    while (!held_.empty() && FirstOfHeld() < FirstNeeded(first))
      held_.pop_front();
    dataSums_.Forget(around.first);
    taken_.first = std::clamp(from, taken_.first, taken_.second);
    const double ahead = LookAhead(farther, count, progress);
    const ToneMappingParameters tone{settings_.embed.smoothMm, settings_.embed.matchContrast};
    const auto statistics = [&](const BlockSums& sums, const std::pair<int, int>& slices) {
      return LocalStatistics(sums, slices.first, slices.second, grid_.spacing, tone.smoothMm);
    };
    const LocalStatistics noise = statistics(noiseSums_, farther);
    const EmbedStatistics all{noise, statistics(SumsOfFirstRound(tone, noiseSums_, noise, around.first, around.second), around),
                              statistics(dataSums_, around), LocalStatistics(levels_.blocks, levels_.mean.View())};
    const auto& n = grid_.dimensions;
    const std::array<int, 3> size{n[0], n[1], count};
    const VolumeView<T> out(static_cast<T*>(intensity), size);
    const VolumeView<unsigned char> real(region, size), what(labels, size);
    const int across = (n[0] + brickEdge - 1) / brickEdge, bricks = across * ((n[1] + brickEdge - 1) / brickEdge);
    const Progress last = progress.Part(ahead, 1.0);
    for (int b = 0; b < bricks; ++b) {
      const std::array<int, 3> at{b % across * brickEdge, b / across * brickEdge, first};
      const std::array<int, 3> edge{std::min(brickEdge, n[0] - at[0]), std::min(brickEdge, n[1] - at[1]), count};
      RenderBrick(at, edge, all, out, real, what, last.Part(static_cast<double>(b) / bricks, (b + 1.0) / bricks));
    }
    progress(1.0);
  }

private:
  struct Slice {
    std::vector<T> voxels;
    std::vector<unsigned char> isReal;
  };

  std::size_t SliceSize() const
  {
    return static_cast<std::size_t>(data_.dimensions[0]) * static_cast<std::size_t>(data_.dimensions[1]);
  }
  int SampleIn(int cell, std::size_t axis) const
  {
    return std::min(factor_ * cell + (factor_ - 1) / 2, data_.dimensions[axis] - 1);
  }
  int Halo(std::size_t axis) const // of a brick
  {
    return static_cast<int>(std::ceil(settings_.embed.featherMm / data_.spacing[static_cast<Eigen::Index>(axis)])) + 1;
  }

  // What looking takes; a grid around the data is taken to be up to twice as large.
  double CoarseBytes() const
  {
    ImageGeometry grid = data_;
    grid.spacing *= factor_;
    for (std::size_t axis = 0; axis < 3; ++axis)
      grid.dimensions[axis] = (data_.dimensions[axis] + factor_ - 1) / factor_ * 5 / 4 + 1;
    return EmbedMemory(settings_.embed, grid) + static_cast<double>(grid.VoxelCount()) * (2.0 * sizeof(T) + 4.0);
  }

  // What the input holds of the slices that are looked at, or taken: voxels, its own region, and ours of it.
  double InputBytes() const { return static_cast<double>(SliceSize()) * slicesAtATime_ * (sizeof(T) + 2.0); }

  // What making a slab takes: slices of the data, those of the input, the slab, a brick, and the sums and statistics of blocks.
  double SlabBytes(int slices) const
  {
    const auto& n = grid_.dimensions;
    const double held = std::min(data_.dimensions[2], slices + Halo(2) + (reach_ + 2) * blocks_.size[2] + slicesAtATime_);
    double brick = 1.0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      brick *= std::min(n[axis], (axis < 2 ? brickEdge : slices) + 2 * Halo(axis));
    const double ahead = 5.0 * AheadEdge(0) * AheadEdge(1) * AheadEdge(2);
    const double blocks = static_cast<double>(blocks_.count[0]) * blocks_.count[1] *
                          std::min(blocks_.count[2], slices / blocks_.size[2] + 4 * reach_ + 3);
    const double levels = std::min(static_cast<double>(grid_.VoxelCount()), 1.0 * settings_.embed.diffusionVoxels);
    // Noise and weights are floats; form, valid region, labels and masks a byte each. Of sums and statistics there are three of
    // either, of three numbers. Made noise is held along its beams, in some 16 million samples at most.
    return static_cast<double>(SliceSize()) * held * (sizeof(T) + 1.0) + InputBytes() +
           static_cast<double>(n[0]) * n[1] * slices * (sizeof(T) + 2.0) + std::max(brick * (sizeof(T) + 14.0), ahead) +
           6.0 * 24.0 * blocks + 32.0 * levels + 0.3e9;
  }

  int AheadEdge(std::size_t axis) const // voxels of a part that noise is made in for its sums: whole blocks
  {
    const int most = axis < 2 ? brickEdge : aheadSlices;
    return std::min(std::max(1, most / blocks_.size[axis]) * blocks_.size[axis], grid_.dimensions[axis]);
  }

  // The slices of blocks that slices [first, end) of the grid lie between, and so many more on either side.
  std::pair<int, int> BlocksFor(int first, int end, int beyond) const
  {
    return {std::max(0, static_cast<int>(blocks_.PositionOf(first, 2)) - beyond),
            std::min(blocks_.count[2], static_cast<int>(blocks_.PositionOf(end - 1, 2)) + 2 + beyond)};
  }

  // Slices of the data that slices of the grid are made of: of the first of them the sums alone.
  std::pair<int, int> Needed(int first, int end) const
  {
    const auto [from, to] = BlocksFor(first, end, reach_);
    const auto clamped = [this](int slice) { return std::clamp(slice - offset_[2], 0, data_.dimensions[2]); };
    const int begin = clamped(std::min(first - Halo(2), from * blocks_.size[2]));
    return {begin, std::max(begin, clamped(std::max(end + Halo(2), to * blocks_.size[2])))};
  }

  int FirstOfHeld() const { return taken_.second - static_cast<int>(held_.size()); }
  // The first slice of the data that is needed itself for slices of the grid from \a first on.
  int FirstNeeded(int first) const { return std::clamp(first - Halo(2) - offset_[2], 0, data_.dimensions[2]); }

  // Whether those that were taken go on with what is needed for slices of the grid from \a first on.
  bool IsKept(int first, int from) const
  {
    return taken_.first <= from && from <= taken_.second && FirstOfHeld() <= FirstNeeded(first);
  }

  void AddData(int first, int count)
  {
    const auto& n = grid_.dimensions;
    const int begin = std::max(0, first + offset_[2]), end = std::min(first + count + offset_[2], n[2]);
    const int skip = std::max(0, -offset_[0]), size = std::min(data_.dimensions[0], n[0] - offset_[0]) - skip;
    if (begin >= end || size <= 0)
      return;
    dataSums_.Grow((end + blocks_.size[2] - 1) / blocks_.size[2]);
    ParallelFor(blocks_.count[1], [&](std::ptrdiff_t J) {
      for (int k = begin; k < end; ++k) {
        const Slice& slice = held_[held_.size() - static_cast<std::size_t>(taken_.second + offset_[2] - k)];
        for (int j = static_cast<int>(J) * blocks_.size[1]; j < std::min((static_cast<int>(J) + 1) * blocks_.size[1], n[1]); ++j)
          if (const int y = j - offset_[1]; y >= 0 && y < data_.dimensions[1]) {
            const auto at = static_cast<std::ptrdiff_t>(data_.dimensions[0]) * y + skip;
            dataSums_.AddRow(skip + offset_[0], j, k, slice.voxels.data() + at, slice.isReal.data() + at, size);
          }
      }
    });
  }

  // Sums of the noise for these slices of blocks. \returns the share of progress that it was, beside so many slices of a slab
  double LookAhead(const std::pair<int, int>& slices, int rendered, const Progress& progress)
  {
    noiseSums_.Forget(slices.first);
    if (noiseSums_.First() != slices.first)
      noiseSums_ = BlockSums(blocks_, slices.first);
    const auto& n = grid_.dimensions;
    const int begin = noiseSums_.End() * blocks_.size[2], end = std::min(slices.second * blocks_.size[2], n[2]);
    if (begin >= end)
      return 0.0;
    const double share = static_cast<double>(end - begin) / (end - begin + 2.0 * rendered);
    const Progress own = progress.Part(0.0, share);
    const std::array<int, 3> edge{AheadEdge(0), AheadEdge(1), AheadEdge(2)}, size = blocks_.size;
    double done = 0.0;
    GridBox part{{0, 0, begin}, {}};
    for (; part.first[2] < end; part.first[2] += edge[2]) {
      BlockSums sums(blocks_, part.first[2] / size[2]); // a whole slice of them, or none when this is cancelled
      part.size[2] = std::min(edge[2], end - part.first[2]);
      sums.Grow((part.first[2] + part.size[2] + size[2] - 1) / size[2]);
      for (part.first[1] = 0; part.first[1] < n[1]; part.first[1] += edge[1])
        for (part.first[0] = 0; part.first[0] < n[0]; part.first[0] += edge[0]) {
          for (std::size_t axis = 0; axis < 2; ++axis)
            part.size[axis] = std::min(edge[axis], n[axis] - part.first[axis]);
          AddNoise(part, sums);
          done += static_cast<double>(part.VoxelCount());
          own(done / (static_cast<double>(n[0]) * n[1] * (end - begin)));
        }
      noiseSums_.Append(std::move(sums));
    }
    return share;
  }

  // Of a part that consists of whole blocks.
  void AddNoise(const GridBox& part, BlockSums& sums) const
  {
    Volume<float> noise(part.size);
    Volume<unsigned char> form(part.size);
    FillFanWithNoise(noise_.parameters, form_, Cropped(grid_, part), noise.View(), form.View());
    const int height = blocks_.size[1], depth = blocks_.size[2], rows = (part.size[1] + height - 1) / height;
    ParallelFor(rows * ((part.size[2] + depth - 1) / depth), [&](std::ptrdiff_t row) {
      const int J = static_cast<int>(row) % rows, K = static_cast<int>(row) / rows;
      for (int k = K * depth; k < std::min((K + 1) * depth, part.size[2]); ++k)
        for (int j = J * height; j < std::min((J + 1) * height, part.size[1]); ++j)
          sums.AddRow(part.first[0], j + part.first[1], k + part.first[2], std::as_const(noise).View().Row(j, k),
                      std::as_const(form).View().Row(j, k), part.size[0]);
    });
  }

  void KeepGrain(int first, VolumeView<const T> voxels, VolumeView<const unsigned char> real, const Eigen::Vector3d& middle)
  {
    std::array<int, 3> at{}, size{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int all = voxels.Dimensions()[axis];
      size[axis] = std::min(grainEdge, all);
      at[axis] = std::clamp(static_cast<int>(middle[static_cast<Eigen::Index>(axis)]) - size[axis] / 2, 0, all - size[axis]);
    }
    grain_ = Volume<T>(size);
    isGrainReal_ = Volume<unsigned char>(size);
    for (int k = 0; k < size[2]; ++k)
      for (int j = 0; j < size[1]; ++j) {
        std::copy_n(voxels.Row(j + at[1], k + at[2]) + at[0], size[0], grain_.View().Row(j, k));
        std::copy_n(real.Row(j + at[1], k + at[2]) + at[0], size[0], isGrainReal_.View().Row(j, k));
      }
    grainPlace_ = Cropped(data_, {{at[0], at[1], first + at[2]}, size});
  }

  // Along parallel beams that go as those of the form do in the middle of the part.
  void MeasureGrain(const Progress& progress)
  {
    if (settings_.matchGrain) {
      const Eigen::Vector3d centre = grainPlace_.Centre();
      const auto beam = BeamPointAt(form_.geometry, form_.probeToWorld.inverse() * centre);
      const Eigen::Vector3d along =
          form_.probeToWorld.linear() * (beam ? DirectionOf(form_.geometry, *beam) : Eigen::Vector3d(Eigen::Vector3d::UnitZ()));
      const Eigen::Vector3d aside = along.cross(form_.probeToWorld.linear().col(0)).normalized();
      PlacedProbe box;
      box.probeToWorld.linear() << aside.cross(along), aside, along;
      const Eigen::Matrix3d edges =
          box.probeToWorld.linear().transpose() * grainPlace_.direction * grainPlace_.spacing.asDiagonal();
      const Eigen::Vector3d extent =
          edges.cwiseAbs() * Eigen::Vector3d(grainPlace_.dimensions[0], grainPlace_.dimensions[1], grainPlace_.dimensions[2]);
      box.geometry = ProbeGeometry::Linear(extent[0], extent[1], 0.0, extent[2]);
      box.probeToWorld.translation() = centre - 0.5 * extent[2] * along;
      noise_ =
          NoiseBehind<T>({std::as_const(grain_).View(), std::as_const(isGrainReal_).View(), grainPlace_}, form_, progress, &box);
    }
    noise_.parameters = ForGrid(noise_.parameters, form_, grid_, settings_.seed);
    if (settings_.embed.featherMm < 0.0)
      settings_.embed.featherMm = FeatherDepth(noise_.grainMm, data_.spacing);
    grain_ = Volume<T>();
    isGrainReal_ = Volume<unsigned char>();
  }

  void FindLevels(const EmbedGrid& grid, const Progress& progress)
  {
    const auto& n = grid.geometry.dimensions;
    Volume<T> intensity(n);
    Volume<unsigned char> region(n), form(n);
    CopyToGrid(grid, coarse_.dimensions, sizeof(T), sample_.View().Data(), intensity.View().Data());
    CopyToGrid(grid, coarse_.dimensions, 1, isSampleReal_.View().Data(), region.View().Data());
    sample_ = Volume<T>();
    isSampleReal_ = Volume<unsigned char>();
    {
      const Volume<float> corners({2, 2, form_.geometry.IsPlane() ? 1 : 2}); // for what lies between them
      Volume<float> nothing(n);
      ScanConvert<float>(corners.View(), form_.geometry, form_.probeToWorld, grid.geometry, nothing.View(), form.View(),
                         progress.Part(0.0, 0.2));
    }
    levels_ = LevelsAround<T>(settings_.embed, std::as_const(region).View(), grid.geometry.spacing, std::as_const(form).View(),
                              std::as_const(intensity).View(), progress.Part(0.2, 1.0));
    for (std::size_t axis = 0; axis < 3; ++axis)
      levels_.blocks.size[axis] *= factor_;
    levels_.blocks.voxels = grid_.dimensions;
  }

  void RenderBrick(const std::array<int, 3>& at, const std::array<int, 3>& edge, const EmbedStatistics& statistics,
                   VolumeView<T> out, VolumeView<unsigned char> real, VolumeView<unsigned char> what, const Progress& progress)
  {
    std::array<int, 3> begin{}, size{};
    GridBox wanted{{}, edge};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      begin[axis] = std::max(0, at[axis] - Halo(axis));
      size[axis] = std::min(grid_.dimensions[axis], at[axis] + edge[axis] + Halo(axis)) - begin[axis];
      wanted.first[axis] = at[axis] - begin[axis];
    }
    Volume<T> intensity(size);
    Volume<unsigned char> region(size), labels(size), form(size);
    ParallelFor(size[2], [&](std::ptrdiff_t slice) {
      const int k = static_cast<int>(slice), z = k + begin[2] - offset_[2];
      const int x = begin[0] - offset_[0], skip = std::max(0, -x), count = std::min(size[0], data_.dimensions[0] - x) - skip;
      for (int j = 0; j < size[1]; ++j) {
        const int y = j + begin[1] - offset_[1];
        if (z < 0 || z >= data_.dimensions[2] || y < 0 || y >= data_.dimensions[1] || count <= 0)
          continue;
        const Slice& held = held_[held_.size() - static_cast<std::size_t>(taken_.second - z)];
        const auto from = static_cast<std::ptrdiff_t>(data_.dimensions[0]) * y + x + skip;
        const auto isReal = held.isReal.begin() + from;
        std::copy_n(isReal, count, region.View().Row(j, k) + skip);
        std::transform(held.voxels.begin() + from, held.voxels.begin() + from + count, isReal, intensity.View().Row(j, k) + skip,
                       [](T value, unsigned char counts) { return counts ? value : T(0); });
      }
    });
    {
      Volume<float> noise(size);
      FillFanWithNoise(noise_.parameters, form_, Cropped(grid_, {begin, size}), noise.View(), form.View(),
                       progress.Part(0.0, 0.5));
      EmbedPart<T>(settings_.embed, levels_, statistics, begin, wanted, std::as_const(region).View(), data_.spacing, noise.View(),
                   std::as_const(form).View(), intensity.View(), labels.View(), progress.Part(0.5, 1.0));
    }
    ParallelFor(edge[2], [&](std::ptrdiff_t slice) {
      const int to = static_cast<int>(slice), from = to + wanted.first[2], i = wanted.first[0];
      for (int row = 0; row < edge[1]; ++row) {
        const int j = row + wanted.first[1];
        std::copy_n(intensity.View().Row(j, from) + i, edge[0], out.Row(row + at[1], to) + at[0]);
        std::copy_n(region.View().Row(j, from) + i, edge[0], real.Row(row + at[1], to) + at[0]);
        std::copy_n(labels.View().Row(j, from) + i, edge[0], what.Row(row + at[1], to) + at[0]);
      }
    });
  }

  int factor_ = 2;
  ImageGeometry coarse_;
  Volume<T> sample_;
  Volume<unsigned char> isSampleReal_, isAnyReal_; // of each cell: the sample, and whether any voxel is real
  std::array<int, 3> first_{}, last_{-1, -1, -1};  // voxels of the data that are real
  Volume<T> grain_;
  Volume<unsigned char> isGrainReal_;
  ImageGeometry grainPlace_;
  double mostReal_ = 0.0;
  std::array<int, 3> offset_{}; // where the data begin on the grid
  EmbedLevels levels_;
  Blocks blocks_; // of local statistics
  int reach_ = 0; // of their windows, in slices of blocks
  BlockSums noiseSums_, dataSums_;
  std::pair<int, int> taken_{0, 0}; // slices of the data that were taken one after the other, [first, second)
  std::deque<Slice> held_;          // the last of these
};

} // namespace

template <class T>
std::unique_ptr<EmbedSlabs> EmbedSlabs::Make(const Settings& settings, const ImageGeometry& data)
{
  return std::make_unique<SlabsOf<T>>(settings, data);
}

#define EchoramaInstantiate(T)                                                                                                   \
  template std::unique_ptr<EmbedSlabs> EmbedSlabs::Make<T>(const EmbedSlabs::Settings&, const ImageGeometry&);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
