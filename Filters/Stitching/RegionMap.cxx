// SPDX-License-Identifier: BSD-3-Clause
// All regions follow from one number per voxel, how many volumes cover it, and one bit per volume: with c the coverage and
// m the mask, pure is m and c = 1, overlap is m and c > 1, empty is not m and c > 0. So nothing else is stored, and that only
// where volumes are: a grid may be far larger than all of them.
//
// Distances are wanted in the overlap region of one volume only. Distance maps of the whole grid, two per volume, would
// cost n times the grid; instead the map is made in the smallest box that certainly holds the nearest voxel of the region
// for every voxel of the overlap (SearchBox): the same question is asked first on blocks of 4 x 4 x 4 voxels, a
// hundredth of the work, and each answer plus the size of a block bounds how far the true nearest voxel can be.
#include "RegionMap.h"
#include "Core/Base/Error.h"
#include "Core/Imaging/DistanceMap.h"
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

namespace echorama {

namespace {

constexpr int blockSize = 4;

std::vector<GridBox> BoxesOf(const std::vector<Boxed<unsigned char>>& masks)
{
  std::vector<GridBox> boxes;
  for (const auto& mask : masks)
    boxes.push_back(mask.box);
  return boxes;
}

// A box and so many voxels around it, of a grid.
GridBox Grown(const GridBox& box, const std::array<int, 3>& by, const std::array<int, 3>& grid)
{
  GridBox grown = box;
  for (int axis = 0; axis < 3; ++axis) {
    grown.first[axis] -= by[axis];
    grown.size[axis] += 2 * by[axis];
  }
  return grown.Intersected({{0, 0, 0}, grid});
}

} // namespace

RegionMap::RegionMap(std::vector<Boxed<unsigned char>> masks, const std::array<int, 3>& dimensions,
                     const Eigen::Vector3d& spacing, const Progress& progress)
  : masks_(std::move(masks)), counts_(masks_.size()), spacing_(spacing), coverage_(dimensions, BoxesOf(masks_))
{
  const auto& n = dimensions;
  // Pass 1: coverage, and how many overlap voxels each row has.
  overlapBefore_.assign(static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]) + 1, 0);
  ForRows({{0, 0, 0}, n}, progress.Part(0.0, 0.5), [&](int j, int k) {
    std::ptrdiff_t overlap = 0;
    bool any = false;
    coverage_.ForRuns(j, k, [&any](int, int, const unsigned char*) { any = true; });
    if (!any)
      return;
    for (const auto& mask : masks_)
      if (mask.box.HasRow(j, k)) {
        const unsigned char* inside = mask.Row(j, k);
        unsigned char* from = coverage_.At(mask.box.first[0], j, k);
        for (int i = 0; i < mask.box.size[0]; ++i)
          from[i] = static_cast<unsigned char>(from[i] + (inside[i] & (from[i] < 255)));
      }
    coverage_.ForRuns(j, k, [&overlap](int first, int end, const unsigned char* covered) {
      for (int i = 0; i < end - first; ++i)
        overlap += covered[i] > 1;
    });
    overlapBefore_[static_cast<std::size_t>(k) * static_cast<std::size_t>(n[1]) + static_cast<std::size_t>(j) + 1] = overlap;
  });
  for (std::size_t row = 1; row < overlapBefore_.size(); ++row)
    overlapBefore_[row] += overlapBefore_[row - 1];
  // Pass 2: what each volume has of it.
  ParallelFor(Count(), progress.Part(0.5, 1.0), [&](std::ptrdiff_t v) {
    const Boxed<unsigned char>& mask = masks_[v];
    if (mask.box.Empty())
      return;
    for (int k = 0; k < mask.box.size[2]; ++k)
      for (int j = 0; j < mask.box.size[1]; ++j) {
        const unsigned char* inside = mask.values.View().Row(j, k);
        const unsigned char* covered =
            std::as_const(coverage_).At(mask.box.first[0], j + mask.box.first[1], k + mask.box.first[2]);
        std::ptrdiff_t all = 0, pure = 0;
        for (int i = 0; i < mask.box.size[0]; ++i) {
          all += inside[i];
          pure += inside[i] & (covered[i] == 1);
        }
        counts_[v].inside += all;
        counts_[v].pure += pure;
      }
  });
}

std::ptrdiff_t RegionMap::OverlapBefore(int i, int j, int k) const
{
  std::ptrdiff_t count = overlapBefore_[static_cast<std::size_t>(k) * coverage_.Dimensions()[1] + j];
  coverage_.ForRuns(j, k, [&](int first, int end, const unsigned char* covered) {
    for (int x = first; x < std::min(i, end); ++x)
      count += covered[x - first] > 1;
  });
  return count;
}

void RegionMap::RegionRow(Region region, int volume, int first, int j, int k, int count, unsigned char* out) const
{
  const Boxed<unsigned char>& mask = masks_[volume];
  // The piece of the row that lies in the box of the volume.
  const GridBox row = GridBox{{first, j, k}, {count, 1, 1}}.Intersected(mask.box);
  const int begin = row.Empty() ? count : row.first[0] - first, end = row.Empty() ? count : begin + row.size[0];
  const unsigned char* inside = row.Empty() ? nullptr : mask.Row(j, k) + (row.first[0] - mask.box.first[0]) - begin;
  if (region == Region::Empty) {
    coverage_.Copy(first, j, k, count, out);
    for (int i = 0; i < count; ++i)
      out[i] = out[i] > 0;
    for (int i = begin; i < end; ++i)
      out[i] = static_cast<unsigned char>(out[i] & ~inside[i]);
    return;
  }
  std::fill_n(out, count, static_cast<unsigned char>(0));
  if (row.Empty())
    return;
  const unsigned char* covered = coverage_.At(row.first[0], j, k) - begin;
  if (region == Region::Overlap)
    for (int i = begin; i < end; ++i)
      out[i] = inside[i] & (covered[i] > 1);
  else if (counts_[volume].core)
    for (int i = begin; i < end; ++i)
      out[i] = static_cast<unsigned char>(inside[i] >> 1);
  else
    for (int i = begin; i < end; ++i)
      out[i] = inside[i] & (covered[i] == 1);
}

GridBox RegionMap::SearchBox(Region region, int volume, const Progress& progress) const
{
  // Pure regions lie in the volume's own box, empty ones anywhere: they are looked for around it first, and farther away where
  // one that is nearer than the nearest so far could lie beyond.
  GridBox scan = Box(volume), found;
  if (region != Region::Empty) {
    SearchWithin(scan, region, volume, found, progress);
    return found;
  }
  const std::array<int, 3>& grid = coverage_.Dimensions();
  double done = 0.0;
  for (int reach = 2 * blockSize;; reach *= 2) {
    scan = Grown(scan, {reach, reach, reach}, grid);
    const double next = 0.5 * (done + 1.0); // how many rounds there will be is not known
    if (SearchWithin(scan, region, volume, found, progress.Part(done, next)) || scan.size == grid)
      return found;
    done = next;
  }
}

// Finds the box of SearchBox from what lies in \a scan. \returns whether nothing beyond matters.
bool RegionMap::SearchWithin(const GridBox& scan, Region region, int volume, GridBox& found, const Progress& progress) const
{
  std::array<int, 3> blocks;
  Eigen::Vector3d slack;
  for (int axis = 0; axis < 3; ++axis) {
    blocks[axis] = (scan.size[axis] + blockSize - 1) / blockSize;
    slack[axis] = spacing_[axis] * (std::min(scan.size[axis], blockSize) - 1);
  }
  Volume<unsigned char> targets(blocks), queries(blocks);
  // One row of blocks per task: the voxel rows of it are joined, then read four by four.
  ParallelRanges(static_cast<std::ptrdiff_t>(blocks[1]) * blocks[2], rowsOfOneTask, progress.Part(0.0, 0.6),
                 [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
                   std::vector<unsigned char> row(scan.size[0]), joined(static_cast<std::size_t>(blocks[0]) * blockSize);
                   const auto mark = [&](Region which, int bj, int bk, VolumeView<unsigned char> marks) {
                     std::fill(joined.begin(), joined.end(), static_cast<unsigned char>(0));
                     for (int k = bk * blockSize; k < std::min((bk + 1) * blockSize, scan.size[2]); ++k)
                       for (int j = bj * blockSize; j < std::min((bj + 1) * blockSize, scan.size[1]); ++j) {
                         RegionRow(which, volume, scan.first[0], scan.first[1] + j, scan.first[2] + k, scan.size[0], row.data());
                         for (std::size_t i = 0; i < row.size(); ++i)
                           joined[i] |= row[i];
                       }
                     for (int b = 0; b < blocks[0]; ++b)
                       marks(b, bj, bk) = joined[4 * b] | joined[4 * b + 1] | joined[4 * b + 2] | joined[4 * b + 3];
                   };
                   for (std::ptrdiff_t r = begin; r < end; ++r) {
                     const int bj = static_cast<int>(r % blocks[1]), bk = static_cast<int>(r / blocks[1]);
                     mark(region, bj, bk, targets.View());
                     mark(Region::Overlap, bj, bk, queries.View());
                   }
                 });
  Volume<float> squared(blocks);
  SquaredDistanceMap(targets.View(), blockSize * spacing_, squared.View(), progress.Part(0.6, 1.0));
  // The hull of where the answers can be, and of all that is of interest.
  Eigen::Array3d lower = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity()), upper = -lower;
  Eigen::Array3d first = lower, last = upper;
  for (int bk = 0; bk < blocks[2]; ++bk)
    for (int bj = 0; bj < blocks[1]; ++bj)
      for (int bi = 0; bi < blocks[0]; ++bi) {
        const bool query = queries.View()(bi, bj, bk) != 0;
        if (!query && !targets.View()(bi, bj, bk))
          continue;
        const Eigen::Array3d from = blockSize * Eigen::Array3d(bi, bj, bk), to = from + (blockSize - 1);
        first = first.min(from);
        last = last.max(to);
        if (query) {
          const double reach = std::sqrt(static_cast<double>(squared.View()(bi, bj, bk))) * (1.0 + 1e-5) + slack.norm();
          lower = lower.min(from - reach / spacing_.array());
          upper = upper.max(to + reach / spacing_.array());
        }
      }
  found = {};
  bool enough = true; // where the scan does not end with the grid
  for (int axis = 0; axis < 3; ++axis) {
    enough = enough && (scan.first[axis] == 0 || lower[axis] >= 0.0);
    enough = enough && (scan.first[axis] + scan.size[axis] == coverage_.Dimensions()[axis] || upper[axis] < scan.size[axis]);
  }
  lower = lower.max(first).floor();
  upper = upper.min(last).ceil();
  if (!(lower <= upper).all())
    return enough;
  for (int axis = 0; axis < 3; ++axis) {
    found.first[axis] = scan.first[axis] + static_cast<int>(lower[axis]);
    found.size[axis] = static_cast<int>(upper[axis] - lower[axis]) + 1;
  }
  found = found.Intersected(scan);
  return enough;
}

Boxed<float> RegionMap::SquaredDistanceTo(Region region, int volume, const Progress& progress) const
{
  Boxed<float> distance;
  const std::ptrdiff_t covered = region == Region::Empty ? 1 : (counts_[volume].core ? 1 : counts_[volume].pure);
  if (OverlapCount(volume) == 0 || covered == 0)
    return distance;
  distance.box = SearchBox(region, volume, progress.Part(0.0, 0.2));
  if (distance.box.Empty())
    return distance;
  Volume<unsigned char> mask(distance.box.size);
  ForRows(distance.box, progress.Part(0.2, 0.3), [&](int j, int k) {
    RegionRow(region, volume, distance.box.first[0], j, k, distance.box.size[0],
              mask.View().Row(j - distance.box.first[1], k - distance.box.first[2]));
  });
  if (std::none_of(mask.View().begin(), mask.View().end(), [](unsigned char m) { return m != 0; }))
    return {};
  distance.values = Volume<float>(distance.box.size);
  SquaredDistanceMap(mask.View(), spacing_, distance.values.View(), progress.Part(0.3, 1.0));
  return distance;
}

Boxed<float> RegionMap::SquaredDepth(int volume, const Progress& progress) const
{
  const GridBox& own = Box(volume);
  Boxed<float> depth;
  for (int axis = 0; axis < 3; ++axis) {
    const int rim = coverage_.Dimensions()[axis] > 1 ? 1 : 0; // a 2D image has no border in front and behind
    depth.box.first[axis] = own.first[axis] - rim;
    depth.box.size[axis] = own.size[axis] + 2 * rim;
  }
  Volume<unsigned char> outside(depth.box.size, 1);
  ForRows(own, progress.Part(0.0, 0.1), [&](int j, int k) {
    const unsigned char* inside = MaskRow(volume, j, k);
    unsigned char* out = outside.View().Row(j - depth.box.first[1], k - depth.box.first[2]) + (own.first[0] - depth.box.first[0]);
    for (int i = 0; i < own.size[0]; ++i)
      out[i] = !(inside[i] & 1);
  });
  depth.values = Volume<float>(depth.box.size);
  SquaredDistanceMap(outside.View(), spacing_, depth.values.View(), progress.Part(0.1, 1.0));
  return depth;
}

double RegionMap::OverlapThickness(int volume) const
{
  if (OverlapCount(volume) == 0)
    return 0.0;
  // What voxels of a row are, from one before the box to one behind it: 0 nothing, 1 someone alone or others, 2 the overlap.
  const GridBox& own = Box(volume);
  const auto& n = coverage_.Dimensions();
  const int before = own.first[0] > 0 ? 1 : 0, behind = own.first[0] + own.size[0] < n[0] ? 1 : 0;
  const std::size_t width = static_cast<std::size_t>(own.size[0] + 2);
  const auto read = [&](int j, int k, unsigned char* row) {
    std::fill_n(row, width, static_cast<unsigned char>(0));
    if (j < 0 || k < 0 || j >= n[1] || k >= n[2])
      return;
    coverage_.Copy(own.first[0] - before, j, k, before + own.size[0] + behind, row + 1 - before);
    const unsigned char* const mask = own.HasRow(j, k) ? MaskRow(volume, j, k) - 1 : nullptr;
    for (std::size_t i = 0; i < width; ++i) {
      const bool isOwn = mask && i > 0 && i + 1 < width && (mask[i] & 1) != 0;
      row[i] = static_cast<unsigned char>(isOwn && row[i] > 1 ? 2 : row[i] > 0 ? 1 : 0);
    }
  };
  const GridBox rows{{0, own.first[1] - 1, own.first[2] - 1}, {1, own.size[1] + 1, own.size[2] + 1}};
  std::atomic<std::ptrdiff_t> faces = 0;
  ForRows(rows, Progress(), [&](int j, int k) {
    std::vector<unsigned char> here(width), above(width), next(width);
    read(j, k, here.data());
    read(j + 1, k, above.data());
    read(j, k + 1, next.data());
    std::ptrdiff_t found = 0;
    for (std::size_t i = 0; i < width; ++i)
      found += ((here[i] * above[i]) == 2) + ((here[i] * next[i]) == 2) + (i + 1 < width && here[i] * here[i + 1] == 2);
    faces += found;
  });
  return 2.0 * static_cast<double>(OverlapCount(volume)) / static_cast<double>(faces.load());
}

void RegionMap::GiveCores(const Progress& progress)
{
  std::vector<int> covered;
  for (int v = 0; v < Count(); ++v)
    if (counts_[v].inside > 0 && counts_[v].pure == 0)
      covered.push_back(v);
  if (covered.empty())
    return;
  const double steps = static_cast<double>(Count()) + static_cast<double>(covered.size());
  double step = 0.0;
  const auto depthOf = [&](int v) {
    const Progress part = progress.Part(step / steps, (step + 1.0) / steps);
    ++step;
    return SquaredDistanceTo(Region::Empty, v, part);
  };
  // body(voxel of the mask, number of the voxel in the overlap, squared depth) for the overlap of one volume.
  const auto forOverlap = [&](int v, const Boxed<float>& depth, const auto& body) {
    const GridBox& own = Box(v);
    ForRows(own, Progress(), [&](int j, int k) {
      const unsigned char* count = std::as_const(coverage_).At(own.first[0], j, k);
      unsigned char* inside = masks_[v].Row(j, k);
      const float* squared = depth.box.HasRow(j, k) ? depth.Row(j, k) + (own.first[0] - depth.box.first[0]) : nullptr;
      std::ptrdiff_t number = OverlapBefore(own.first[0], j, k);
      for (int i = 0; i < own.size[0]; ++i)
        if (count[i] > 1) {
          if (inside[i] & 1)
            body(inside[i], number, squared ? squared[i] : std::numeric_limits<float>::infinity());
          ++number;
        }
    });
  };
  // How deep the deepest volume lies at each voxel of the overlap.
  std::vector<float> deepest(static_cast<std::size_t>(OverlapCount()), 0.0f);
  const auto meetsCovered = [&](int v) {
    return std::any_of(covered.begin(), covered.end(), [&](int w) { return !Box(v).Intersected(Box(w)).Empty(); });
  };
  for (int v = 0; v < Count(); ++v)
    if (meetsCovered(v)) // elsewhere nobody asks
      forOverlap(v, depthOf(v), [&](unsigned char&, std::ptrdiff_t number, float squared) {
        deepest[number] = std::max(deepest[number], squared);
      });
  for (const int v : covered) {
    const Boxed<float> depth = depthOf(v);
    forOverlap(v, depth, [&](unsigned char& inside, std::ptrdiff_t number, float squared) {
      if (squared >= deepest[number])
        inside |= 2;
    });
    counts_[v].core = true;
    const auto mask = masks_[v].values.View();
    if (std::any_of(mask.begin(), mask.end(), [](unsigned char m) { return (m & 2) != 0; }))
      continue;
    std::vector<float> own(deepest.size(), 0.0f);
    forOverlap(v, depth, [&](unsigned char&, std::ptrdiff_t number, float squared) { own[number] = squared; });
    const float most = *std::max_element(own.begin(), own.end());
    forOverlap(v, depth, [most](unsigned char& inside, std::ptrdiff_t, float squared) {
      if (squared >= most)
        inside |= 2;
    });
  }
}

} // namespace echorama
