// SPDX-License-Identifier: BSD-3-Clause
// The inverse is rasterised: every deformed tetrahedron fills the voxels that it holds with where they were, which its own affine
// map says. Nothing is iterated, and a voxel costs a few multiplications.
//
// The grid is cut into slabs of a few slices. Runs of eight cells are sorted into the slabs that they may touch, in their order;
// a slab is filled by one thread, run after run, so the result does not depend on their number. In each row of voxels the
// interval that a tetrahedron holds follows from its four planes.
#include "DeformedSources.h"
#include "Core/Base/Parallel.h"
#include "DeformedCells.h"
#include <cmath>

namespace echorama {

namespace {

constexpr int runLength = 8;

using DeformedState = DeformedClaim::State;

int SlicesPerSlab(const ImageGeometry& grid)
{
  const double slice = static_cast<double>(grid.dimensions[0]) * grid.dimensions[1];
  return static_cast<int>(std::clamp(200000.0 / slice, 1.0, 8.0));
}

// How far the corners of a grid lie beyond a lattice, in its index units.
double GridReach(const LatticeMap& map, const ImageGeometry& grid)
{
  const Eigen::Affine3d toIndex = map.WorldToIndex() * grid.IndexToWorld();
  double reach = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d index =
        toIndex * Eigen::Vector3d(corner & 1 ? grid.dimensions[0] - 1 : 0, corner & 2 ? grid.dimensions[1] - 1 : 0,
                                  corner & 4 ? grid.dimensions[2] - 1 : 0);
    for (int axis = 0; axis < 3; ++axis)
      reach = std::max({reach, -index[axis], index[axis] - (map.Lattice().dimensions[static_cast<std::size_t>(axis)] - 1)});
  }
  return reach + map.LongestMm() / map.Lattice().spacing.minCoeff() + 1.0;
}

struct CellRun {
  int i, j, k;     // its first cell
  float low, high; // slices that it may touch, widened by more than the rounding
};

class SlabFill {
public:
  SlabFill(const DeformedCells& cells, const ImageGeometry& grid, int first, int count)
    : cells_(cells), dimensions_(grid.dimensions), first_(first), last_(first + count - 1),
      sources_(static_cast<std::size_t>(count) * static_cast<std::size_t>(grid.dimensions[0]) *
               static_cast<std::size_t>(grid.dimensions[1])),
      claims_(sources_.size(), DeformedState::None)
  {
  }

  void Fill(const CellRun& run)
  {
    const int end = std::min(run.i + runLength, cells_.Cells()[0]);
    for (int i = run.i; i < end; ++i)
      FillCell(i, run.j, run.k);
  }

  std::vector<Eigen::Vector3d>& Sources() { return sources_; }
  const std::vector<DeformedState>& Claims() const { return claims_; }

private:
  // The whole numbers in an interval, cut to [first, last]. \returns whether there are any.
  static bool Whole(double low, double high, int first, int last, int range[2])
  {
    if (!(low <= last && high >= first))
      return false;
    range[0] = low <= first ? first : static_cast<int>(std::ceil(low));
    range[1] = high >= last ? last : static_cast<int>(std::floor(high));
    return range[0] <= range[1];
  }

  bool RangesOf(const Eigen::Vector3d& low, const Eigen::Vector3d& high, int ranges[3][2]) const
  {
    constexpr double slack = 1e-6;
    return Whole(low[2] - slack, high[2] + slack, first_, last_, ranges[2]) &&
           Whole(low[1] - slack, high[1] + slack, 0, dimensions_[1] - 1, ranges[1]) &&
           Whole(low[0] - slack, high[0] + slack, 0, dimensions_[0] - 1, ranges[0]);
  }

  void FillCell(int i, int j, int k)
  {
    Eigen::Vector3d low = cells_.Point(i, j, k), high = low;
    for (int corner = 1; corner < 8; ++corner) {
      const Eigen::Vector3d& point = cells_.Point(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2));
      low = low.cwiseMin(point);
      high = high.cwiseMax(point);
    }
    int ranges[3][2];
    if (!RangesOf(low, high, ranges))
      return;
    for (int order = 0; order < 6; ++order) {
      int at[3] = {i, j, k};
      low = high = cells_.Point(i, j, k);
      for (int step = 0; step < 3; ++step) {
        ++at[latticeOrders[order][step]];
        const Eigen::Vector3d& point = cells_.Point(at[0], at[1], at[2]);
        low = low.cwiseMin(point);
        high = high.cwiseMax(point);
      }
      DeformedTetrahedron t;
      if (RangesOf(low, high, ranges) && cells_.Tetrahedron(i, j, k, order, t))
        FillTetrahedron(t, ranges);
    }
  }

  void FillTetrahedron(const DeformedTetrahedron& t, const int ranges[3][2])
  {
    const Eigen::Vector3d along = t.toFractions.col(0);
    const double slopes[4] = {-along[0], along[0] - along[1], along[1] - along[2], along[2]};
    for (int k = ranges[2][0]; k <= ranges[2][1]; ++k)
      for (int j = ranges[1][0]; j <= ranges[1][1]; ++j) {
        const Eigen::Vector3d start = t.toFractions * (Eigen::Vector3d(ranges[0][0], j, k) - t.origin);
        const double values[4] = {1.0 - start[0], start[0] - start[1], start[1] - start[2], start[2]};
        // Where all four barycentric coordinates are at least -2 tolerances; the exact test follows voxel by voxel.
        double low = 0.0, high = ranges[0][1] - ranges[0][0];
        for (int plane = 0; plane < 4; ++plane) {
          const double room = values[plane] + 2.0 * t.tolerance;
          if (slopes[plane] > 0.0)
            low = std::max(low, -room / slopes[plane]);
          else if (slopes[plane] < 0.0)
            high = std::min(high, -room / slopes[plane]);
          else if (room < 0.0)
            high = -1.0;
        }
        int range[2];
        if (!Whole(low - 1e-9, high + 1e-9, 0, ranges[0][1] - ranges[0][0], range))
          continue;
        const std::ptrdiff_t row = (static_cast<std::ptrdiff_t>(k - first_) * dimensions_[1] + j) * dimensions_[0] + ranges[0][0];
        for (int step = range[0]; step <= range[1]; ++step) {
          const auto voxel = static_cast<std::size_t>(row + step);
          DeformedClaim::Take(t, start + step * along, claims_[voxel], sources_[voxel]);
        }
      }
  }

  const DeformedCells& cells_;
  std::array<int, 3> dimensions_;
  int first_, last_;
  std::vector<Eigen::Vector3d> sources_;
  std::vector<DeformedState> claims_;
};

// Runs of cells, and for each slab of the grid those that may touch it.
struct RunsOfSlabs {
  std::vector<CellRun> runs;
  std::vector<std::size_t> first; // a slab each, and the end
  std::vector<std::uint32_t> numbers;
};

RunsOfSlabs RunsFor(const DeformedCells& cells, int slices, int perSlab)
{
  const auto& n = cells.Cells();
  const int perRow = (n[0] + runLength - 1) / runLength;
  RunsOfSlabs sorted;
  sorted.runs.resize(static_cast<std::size_t>(perRow) * static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]));
  ParallelFor(n[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    CellRun* run = sorted.runs.data() + slice * n[1] * perRow;
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; i += runLength) {
        double low = std::numeric_limits<double>::infinity(), high = -low;
        for (int a = i; a <= std::min(i + runLength, n[0]); ++a)
          for (int corner = 0; corner < 4; ++corner) {
            const double z = cells.Point(a, j + (corner & 1), k + (corner >> 1))[2];
            low = std::min(low, z);
            high = std::max(high, z);
          }
        const double slack = 1e-3 + 1e-6 * std::max(std::abs(low), std::abs(high)); // of floats
        *run++ = {i, j, k, static_cast<float>(low - slack), static_cast<float>(high + slack)};
      }
  });
  const int slabs = (slices + perSlab - 1) / perSlab;
  const auto slabsOf = [&](const CellRun& run, const auto& use) {
    if (run.high < 0.0f || run.low > static_cast<float>(slices - 1))
      return;
    const int begin = static_cast<int>(std::max(run.low, 0.0f)) / perSlab;
    const int end = static_cast<int>(std::min(run.high, static_cast<float>(slices - 1))) / perSlab;
    for (int slab = begin; slab <= end; ++slab)
      use(static_cast<std::size_t>(slab));
  };
  sorted.first.assign(static_cast<std::size_t>(slabs) + 1, 0);
  for (const CellRun& run : sorted.runs)
    slabsOf(run, [&](std::size_t slab) { ++sorted.first[slab + 1]; });
  for (std::size_t slab = 0; slab < static_cast<std::size_t>(slabs); ++slab)
    sorted.first[slab + 1] += sorted.first[slab];
  sorted.numbers.resize(sorted.first.back());
  std::vector<std::size_t> next(sorted.first.begin(), sorted.first.end() - 1);
  for (std::size_t number = 0; number < sorted.runs.size(); ++number)
    slabsOf(sorted.runs[number], [&](std::size_t slab) { sorted.numbers[next[slab]++] = static_cast<std::uint32_t>(number); });
  return sorted;
}

// Calls fill(first slice, slices, sources, kinds) and then the visitor for each slab, and counts.
template <class Fill>
SourceCounts ForSlabs(const ImageGeometry& grid, int perSlab, const SourceVisitor& visitor, const Progress& progress,
                      const Fill& fill)
{
  const int slices = grid.dimensions[2], slabs = (slices + perSlab - 1) / perSlab;
  std::vector<SourceCounts> counts(static_cast<std::size_t>(slabs));
  ParallelFor(slabs, progress, [&](std::ptrdiff_t slab) {
    const int first = static_cast<int>(slab) * perSlab, count = std::min(perSlab, slices - first);
    std::vector<SourceKind> kinds;
    const std::vector<Eigen::Vector3d> sources = fill(first, count, kinds);
    SourceCounts& sum = counts[static_cast<std::size_t>(slab)];
    for (const SourceKind kind : kinds) {
      sum.outside += kind == SourceKind::Outside ? 1 : 0;
      sum.folded += kind == SourceKind::Folded ? 1 : 0;
    }
    visitor({first, count, sources.data(), kinds.data()});
  });
  SourceCounts all;
  for (const SourceCounts& sum : counts) {
    all.outside += sum.outside;
    all.folded += sum.folded;
  }
  return all;
}

} // namespace

SourceCounts VisitRestPlaces(const LatticeMap& map, bool nearest, const ImageGeometry& grid, const SourceVisitor& visitor,
                             const Progress& progress)
{
  const DeformedCells cells(map, grid.WorldToIndex(), nearest ? GridReach(map, grid) : 0.0);
  const int perSlab = SlicesPerSlab(grid);
  const RunsOfSlabs sorted = RunsFor(cells, grid.dimensions[2], perSlab);
  const Eigen::Affine3d toLattice = map.WorldToIndex() * grid.IndexToWorld();
  return ForSlabs(grid, perSlab, visitor, progress, [&](int first, int count, std::vector<SourceKind>& kinds) {
    SlabFill slab(cells, grid, first, count);
    const auto number = static_cast<std::size_t>(first / perSlab);
    for (std::size_t at = sorted.first[number]; at < sorted.first[number + 1]; ++at)
      slab.Fill(sorted.runs[sorted.numbers[at]]);
    std::size_t voxel = 0;
    kinds.reserve(slab.Claims().size());
    for (int k = first; k < first + count; ++k)
      for (int j = 0; j < grid.dimensions[1]; ++j)
        for (int i = 0; i < grid.dimensions[0]; ++i, ++voxel) {
          const DeformedState claim = slab.Claims()[voxel];
          kinds.push_back(claim == DeformedState::None     ? SourceKind::Outside
                          : DeformedClaim::IsFolded(claim) ? SourceKind::Folded
                                                           : SourceKind::Found);
          if (kinds.back() != SourceKind::Found)
            slab.Sources()[voxel] = toLattice * Eigen::Vector3d(i, j, k);
        }
    return std::move(slab.Sources());
  });
}

SourceCounts VisitDeformedPlaces(const LatticeMap& map, bool nearest, const ImageGeometry& grid, const SourceVisitor& visitor,
                                 const Progress& progress)
{
  const Eigen::Affine3d toLattice = map.WorldToIndex() * grid.IndexToWorld();
  return ForSlabs(grid, SlicesPerSlab(grid), visitor, progress, [&](int first, int count, std::vector<SourceKind>& kinds) {
    std::vector<Eigen::Vector3d> sources;
    const auto voxels = static_cast<std::size_t>(count) * static_cast<std::size_t>(grid.dimensions[0]) *
                        static_cast<std::size_t>(grid.dimensions[1]);
    sources.reserve(voxels);
    kinds.reserve(voxels);
    for (int k = first; k < first + count; ++k)
      for (int j = 0; j < grid.dimensions[1]; ++j)
        for (int i = 0; i < grid.dimensions[0]; ++i) {
          const Eigen::Vector3d index = toLattice * Eigen::Vector3d(i, j, k);
          sources.push_back(index);
          kinds.push_back(SourceKind::Outside);
          if (const auto place = map.Find(index, nearest)) {
            kinds.back() = map.GradientAt(*place).determinant() > latticeFoldedRatio ? SourceKind::Found : SourceKind::Folded;
            if (kinds.back() == SourceKind::Found)
              sources.back() += map.WorldToIndex().linear() * map.DisplacementAt(*place);
          }
        }
    return sources;
  });
}

} // namespace echorama
