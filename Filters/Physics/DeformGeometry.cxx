// SPDX-License-Identifier: BSD-3-Clause
// Points forward and images backward need the map alone; points backward search in the deformed tetrahedra, images forward
// rasterise them. All of that is elsewhere (LatticeMap, DeformedCells, DeformedSources). Here lies what holds for all of them:
// what is refused, left out or kept, and how voxels are mixed.
#include "DeformGeometry.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/RoundedVoxel.h"
#include "Core/Imaging/VoxelTypes.h"
#include "DeformedCells.h"
#include "DeformedSources.h"
#include <cmath>
#include <cstring>

namespace echorama {

namespace {

using Deform = DeformGeometryParameters;

constexpr double voxelSlack = 1e-9; // so that a map that moves nothing changes no bit

std::string PlaceText(const Eigen::Vector3d& point)
{
  return "(" + NumberText(static_cast<float>(point[0])) + ", " + NumberText(static_cast<float>(point[1])) + ", " +
         NumberText(static_cast<float>(point[2])) + ")";
}

LatticeFolds CheckFolds(const Deform& p, const LatticeMap& map, const Progress& progress)
{
  const bool nearest = p.outside == Deform::Outside::Nearest;
  const LatticeFolds folds = DeformedCells(map, map.WorldToIndex(), nearest ? 1.0 : 0.0).Folds(progress);
  if (folds.tetrahedra == 0)
    throw Error(Error::Kind::BadInput, "the displacement is known nowhere: no tetrahedron of its lattice has all its corners");
  if (folds.folded > 0 && !p.maskFolds) {
    const auto& cell = folds.smallestCell;
    throw Error(Error::Kind::NotPossible,
                "the displacement folds " + std::to_string(folds.folded) + " of the " + std::to_string(folds.tetrahedra) +
                    " tetrahedra of its lattice, worst in cell (" + std::to_string(cell[0]) + ", " + std::to_string(cell[1]) +
                    ", " + std::to_string(cell[2]) + "), whose volume ratio is " +
                    NumberText(static_cast<float>(folds.smallestRatio)) + "; turn MaskFolds on to leave out what they hold");
  }
  return folds;
}

[[noreturn]] void FailAmbiguous(std::size_t count, const std::string& what)
{
  throw Error(Error::Kind::NotPossible, "the displacement brings several places to " + std::to_string(count) + " " + what +
                                            "; turn MaskFolds on to leave them out");
}

[[noreturn]] void FailOutside(std::size_t count, std::size_t all, const std::string& what, const Eigen::Vector3d& first)
{
  throw Error(Error::Kind::BadInput, std::to_string(count) + " of " + std::to_string(all) + " " + what +
                                         " outside of the lattice of the displacement, the first at " + PlaceText(first) +
                                         " mm; set Outside to mask, keep or nearest");
}

// How far points lie beyond a lattice, in its index units, once they are moved at most.
double PointsReach(const LatticeMap& map, const std::vector<Eigen::Vector3d>& points)
{
  double reach = 0.0;
  for (const auto& point : points) {
    const Eigen::Vector3d index = map.WorldToIndex() * point;
    for (int axis = 0; axis < 3; ++axis)
      reach = std::max({reach, -index[axis], index[axis] - (map.Lattice().dimensions[static_cast<std::size_t>(axis)] - 1)});
  }
  return reach + map.LongestMm() / map.Lattice().spacing.minCoeff() + 1.0;
}

enum class PointState : unsigned char { Good, Outside, Kept, Folded };

// Along one axis: the voxels on both sides of a position, and how far it is to the second.
struct MixAxis {
  std::ptrdiff_t first = 0, second = 0, nearest = 0;
  double t = 0.0;

  // \returns false outside of the voxels.
  bool Set(double x, int count)
  {
    if (!(x >= -0.5 - voxelSlack && x <= count - 0.5 + voxelSlack))
      return false;
    x = std::clamp(x, 0.0, count - 1.0);
    const double whole = std::floor(x);
    t = x - whole;
    first = static_cast<std::ptrdiff_t>(whole);
    if (t > 1.0 - voxelSlack) {
      ++first;
      t = 0.0;
    } else if (t < voxelSlack)
      t = 0.0;
    second = t > 0.0 ? first + 1 : first;
    nearest = t < 0.5 ? first : second;
    return true;
  }
};

class VoxelMixer {
public:
  VoxelMixer(const DeformedImage& image, const Deform& p)
    : real_(image.real), dimensions_(image.geometry.dimensions), isNearest_(p.nearestVoxel)
  {
  }

  VoxelMix At(const Eigen::Vector3d& index) const
  {
    VoxelMix mix;
    MixAxis x, y, z;
    if (!x.Set(index[0], dimensions_[0]) || !y.Set(index[1], dimensions_[1]) || !z.Set(index[2], dimensions_[2]))
      return mix;
    const auto at = [this](std::ptrdiff_t i, std::ptrdiff_t j, std::ptrdiff_t k) {
      return (k * dimensions_[1] + j) * dimensions_[0] + i;
    };
    mix.nearest = at(x.nearest, y.nearest, z.nearest);
    if (!IsReal(mix.nearest))
      return mix;
    if (isNearest_) {
      mix.count = 1;
      mix.voxels[0] = mix.nearest;
      mix.weights[0] = 1.0;
      return mix;
    }
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      const double weight = (corner & 1 ? x.t : 1.0 - x.t) * (corner & 2 ? y.t : 1.0 - y.t) * (corner & 4 ? z.t : 1.0 - z.t);
      const std::ptrdiff_t voxel =
          at(corner & 1 ? x.second : x.first, corner & 2 ? y.second : y.first, corner & 4 ? z.second : z.first);
      if (weight > 0.0 && IsReal(voxel)) {
        mix.voxels[static_cast<std::size_t>(mix.count)] = voxel;
        mix.weights[static_cast<std::size_t>(mix.count++)] = weight;
        sum += weight;
      }
    }
    for (int n = 0; n < mix.count; ++n)
      mix.weights[static_cast<std::size_t>(n)] /= sum;
    return mix;
  }

private:
  bool IsReal(std::ptrdiff_t voxel) const { return real_.Empty() || real_[voxel] != 0; }

  VolumeView<const unsigned char> real_;
  std::array<int, 3> dimensions_;
  bool isNearest_;
};

// With Outside::Refuse, forward: all real voxels of the input must lie in the lattice.
void CheckInside(const LatticeMap& map, const DeformedImage& image)
{
  const auto& n = image.geometry.dimensions;
  const Eigen::Affine3d toWorld = image.geometry.IndexToWorld(), toLattice = map.WorldToIndex() * toWorld;
  struct Count {
    std::size_t real = 0, outside = 0;
    Eigen::Vector3d first = Eigen::Vector3d::Zero();
  };
  std::vector<Count> counts(static_cast<std::size_t>(n[2]));
  ParallelFor(n[2], [&](std::ptrdiff_t k) {
    Count& count = counts[static_cast<std::size_t>(k)];
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const std::ptrdiff_t voxel = (k * n[1] + j) * n[0] + i;
        if (!image.real.Empty() && image.real[voxel] == 0)
          continue;
        ++count.real;
        const Eigen::Vector3d index(i, j, static_cast<double>(k));
        if (!map.Find(toLattice * index, false) && count.outside++ == 0)
          count.first = toWorld * index;
      }
  });
  Count all;
  for (const Count& count : counts) {
    if (all.outside == 0 && count.outside > 0)
      all.first = count.first;
    all.real += count.real;
    all.outside += count.outside;
  }
  if (all.outside > 0)
    FailOutside(all.outside, all.real, "real voxels of the image lie", all.first);
}

} // namespace

ParameterList Describe(DeformGeometryParameters& p)
{
  return {
      Parameter(
          "Direction", Choice(p.direction, {"forward", "backward"}),
          "Forward: what lies at x at rest goes to x + u(x), to where it is now. Backward: what is at x + u(x) now goes back "
          "to x."),
      Parameter(
          "Outside", Choice(p.outside, {"refuse", "mask", "keep", "nearest"}),
          "What lies outside of the lattice is refused with a message, is marked as not real, stays where it is, or moves as "
          "the nearest point of the lattice does."),
      Parameter("MaskFolds", p.maskFolds,
                "A displacement that turns tetrahedra inside out, or brings several places to one, is refused with a message. "
                "When on, what lies there is marked as not real instead."),
      Parameter("NearestVoxel", p.nearestVoxel,
                "Images are read linearly between their voxels. When on, at the nearest voxel, as labels always are.")
          .Advanced()};
}

DeformReport DeformPoints(const DeformGeometryParameters& p, const LatticeMap& map, std::vector<Eigen::Vector3d>& points,
                          std::vector<unsigned char>& valid, std::vector<Eigen::Matrix3d>* gradients, const Progress& progress)
{
  CheckRanges(p);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (!points[i].allFinite())
      throw Error(Error::Kind::BadInput, "point " + std::to_string(i) + " is not finite");
  DeformReport report;
  report.folds = CheckFolds(p, map, progress.Part(0.0, 0.2));
  report.count = points.size();
  valid.assign(points.size(), 1);
  if (gradients)
    gradients->assign(points.size(), Eigen::Matrix3d::Identity());
  if (points.empty())
    return report;
  const bool nearest = p.outside == Deform::Outside::Nearest, keep = p.outside == Deform::Outside::Keep;
  std::vector<PointState> states(points.size(), PointState::Good);
  std::vector<Eigen::Vector3d> moved = points;
  constexpr std::ptrdiff_t grain = 4096;
  const auto forPoints = [&](const auto& move) {
    ParallelRanges(static_cast<std::ptrdiff_t>(points.size()), grain, progress.Part(0.2, 1.0),
                   [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
                     for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
                       states[i] = move(i);
                   });
  };
  if (p.direction == Deform::Direction::Forward) {
    forPoints([&](std::size_t i) {
      const auto place = map.Find(map.WorldToIndex() * points[i], nearest);
      if (!place)
        return keep ? PointState::Kept : PointState::Outside;
      moved[i] += map.DisplacementAt(*place);
      const Eigen::Matrix3d gradient = map.GradientAt(*place);
      if (gradients)
        (*gradients)[i] = gradient;
      return gradient.determinant() > latticeFoldedRatio ? PointState::Good : PointState::Folded;
    });
  } else {
    const DeformedCells cells(map, map.WorldToIndex(), nearest ? PointsReach(map, points) : 0.0);
    const DeformedSearch search(cells);
    forPoints([&](std::size_t i) {
      const Eigen::Vector3d index = map.WorldToIndex() * points[i];
      const auto found = search.Find(index);
      if (!found) // what is empty now, but lay in the lattice, has not been kept: it went elsewhere
        return keep && !map.Find(index, false) ? PointState::Kept : PointState::Outside;
      // From where it is by how far it moved, so that what does not move keeps every bit.
      moved[i] += map.IndexToWorld().linear() * (found->rest - index);
      if (gradients) {
        const DeformedTetrahedron& t = found->tetrahedron; // d rest / d now, in index coordinates
        Eigen::Matrix3d slope;
        for (int step = 0; step < 3; ++step)
          slope.row(t.order[step]) = t.size[t.order[step]] * t.toFractions.row(step);
        (*gradients)[i] = map.IndexToWorld().linear() * slope * map.WorldToIndex().linear();
      }
      return found->isAmbiguous ? PointState::Folded : PointState::Good;
    });
  }
  std::size_t first = points.size();
  for (std::size_t i = 0; i < points.size(); ++i) {
    report.outside += states[i] == PointState::Outside || states[i] == PointState::Kept ? 1 : 0;
    report.folded += states[i] == PointState::Folded ? 1 : 0;
    valid[i] = states[i] == PointState::Good || states[i] == PointState::Kept ? 1 : 0;
    if (states[i] == PointState::Outside)
      first = std::min(first, i);
  }
  if (first < points.size() && p.outside == Deform::Outside::Refuse)
    FailOutside(report.outside, points.size(), "points lie", points[first]);
  if (report.folded > 0 && !p.maskFolds)
    FailAmbiguous(report.folded, "points");
  points = std::move(moved);
  return report;
}

template <class T>
VoxelWriter MixedArray(const T* from, T* to, int components)
{
  return [from, to, components](std::ptrdiff_t voxel, const VoxelMix& mix) {
    T* out = to + voxel * components;
    const T* nearest = from + mix.nearest * components;
    for (int c = 0; c < components; ++c) {
      if (mix.count == 0) {
        out[c] = T(0);
        continue;
      }
      const auto base = static_cast<double>(nearest[c]);
      double sum = 0.0; // of differences, so that a constant stays what it is
      for (int n = 0; n < mix.count; ++n)
        sum += mix.weights[static_cast<std::size_t>(n)] *
               (static_cast<double>(from[mix.voxels[static_cast<std::size_t>(n)] * components + c]) - base);
      out[c] = RoundedVoxel<T>(base + sum);
    }
  };
}

#define EchoramaMixedArray(T) template VoxelWriter MixedArray<T>(const T*, T*, int);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaMixedArray)
#undef EchoramaMixedArray

VoxelWriter NearestArray(const void* from, void* to, std::size_t bytes)
{
  return [from = static_cast<const char*>(from), to = static_cast<char*>(to), bytes](std::ptrdiff_t voxel, const VoxelMix& mix) {
    char* out = to + voxel * static_cast<std::ptrdiff_t>(bytes);
    if (mix.count == 0)
      std::memset(out, 0, bytes);
    else
      std::memcpy(out, from + mix.nearest * static_cast<std::ptrdiff_t>(bytes), bytes);
  };
}

DeformReport DeformImage(const DeformGeometryParameters& p, const LatticeMap& map, const DeformedImage& image,
                         const Progress& progress)
{
  CheckRanges(p);
  image.geometry.Check("the image");
  image.grid.Check("the grid");
  DeformReport report;
  report.folds = CheckFolds(p, map, progress.Part(0.0, 0.1));
  report.count = image.grid.VoxelCount();
  const bool forward = p.direction == Deform::Direction::Forward, nearest = p.outside == Deform::Outside::Nearest;
  if (forward && p.outside == Deform::Outside::Refuse)
    CheckInside(map, image);

  const VoxelMixer mixer(image, p);
  const Eigen::Affine3d latticeToImage = image.geometry.WorldToIndex() * map.IndexToWorld();
  const Eigen::Affine3d gridToLattice = map.WorldToIndex() * image.grid.IndexToWorld();
  const std::ptrdiff_t slice = static_cast<std::ptrdiff_t>(image.grid.dimensions[0]) * image.grid.dimensions[1];
  const SourceVisitor visitor = [&](const SourceSlab& slab) {
    std::ptrdiff_t voxel = slab.firstSlice * slice, at = 0;
    for (int k = slab.firstSlice; k < slab.firstSlice + slab.slices; ++k)
      for (int j = 0; j < image.grid.dimensions[1]; ++j)
        for (int i = 0; i < image.grid.dimensions[0]; ++i, ++voxel, ++at) {
          const Eigen::Vector3d& source = slab.sources[at];
          const bool isKept = slab.kinds[at] == SourceKind::Outside && p.outside == Deform::Outside::Keep &&
                              (!forward || !map.Find(source, false)); // else it lay in the lattice, and has gone
          const bool isFound = slab.kinds[at] == SourceKind::Found || isKept;
          if (!image.displacements.Empty()) { // it need not lie in the image
            image.valid[voxel] = isFound ? 1 : 0;
            image.displacements[voxel].setZero();
            if (isFound)
              image.displacements[voxel] = map.IndexToWorld().linear() * (source - gridToLattice * Eigen::Vector3d(i, j, k));
            continue;
          }
          const VoxelMix mix = isFound ? mixer.At(latticeToImage * source) : VoxelMix();
          image.valid[voxel] = mix.count > 0 ? 1 : 0;
          for (const VoxelWriter& write : image.writers)
            write(voxel, mix);
        }
  };
  const SourceCounts counts = forward ? VisitRestPlaces(map, nearest, image.grid, visitor, progress.Part(0.1, 1.0))
                                      : VisitDeformedPlaces(map, nearest, image.grid, visitor, progress.Part(0.1, 1.0));
  report.outside = counts.outside;
  report.folded = counts.folded;
  if (!forward && counts.outside > 0 && p.outside == Deform::Outside::Refuse)
    throw Error(Error::Kind::BadInput,
                std::to_string(counts.outside) + " of " + std::to_string(report.count) +
                    " voxels lie outside of the lattice of the displacement; set Outside to mask, keep or nearest");
  if (counts.folded > 0 && !p.maskFolds)
    FailAmbiguous(counts.folded, "voxels");
  return report;
}

} // namespace echorama
