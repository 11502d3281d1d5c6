// SPDX-License-Identifier: BSD-3-Clause
// The grid of a volume is cut into blocks of 8^3 voxels. A stroke in the making holds, for each block that its brush has come
// near, the old voxels and each voxel's least squared distance from the path so far; a new piece of path looks at the blocks
// around it alone, lowers distances, and where one is lowered makes the voxel anew from its old value. So a stroke is the same
// however it is cut into pieces, and a piece costs what lies under the brush.
//
// Finished, a stroke keeps its old blocks and forgets the distances. To go back is to copy them. A block's first stroke holds
// what the file had there: that is what Restore reads.
#include "VoxelEdits.h"

#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/VoxelTypes.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>
#include <unordered_map>

namespace echorama {
namespace {

constexpr int Side = 8; // voxels of a block along each axis
constexpr int BlockSize = Side * Side * Side;
constexpr std::ptrdiff_t BlocksPerTask = 16;

// Squared distances (mm^2) of eight voxels in a row from the path a + t ab, t in [0, 1]; perSquare = 1 / |ab|^2, or 0 for a
// point. first: from a to the first voxel; spacing: to the next, along x.
void DistancesOfRow(const double* first, double spacing, const double* ab, double perSquare, double* squared)
{
  for (int i = 0; i < Side; ++i) {
    const double x = first[0] + i * spacing, y = first[1], z = first[2];
    double t = (x * ab[0] + y * ab[1] + z * ab[2]) * perSquare;
    t = t > 0.0 ? t : 0.0;
    t = t < 1.0 ? t : 1.0;
    const double dx = x - t * ab[0], dy = y - t * ab[1], dz = z - t * ab[2];
    squared[i] = dx * dx + dy * dy + dz * dz;
  }
}

template <class T>
T RoundedTo(double value)
{
  if constexpr (std::is_integral_v<T>)
    return static_cast<T>(std::lround(std::clamp(value, static_cast<double>(std::numeric_limits<T>::min()),
                                                 static_cast<double>(std::numeric_limits<T>::max()))));
  else
    return static_cast<T>(std::clamp(value, static_cast<double>(std::numeric_limits<T>::lowest()),
                                     static_cast<double>(std::numeric_limits<T>::max())));
}

double WeightAt(double distance, const Brush& brush)
{
  const double full = brush.hardness * brush.radiusMm;
  if (distance <= full)
    return 1.0;
  const double s = (distance - full) / (brush.radiusMm - full); // above 0, so the radius is above full
  return s < 1.0 ? 1.0 - s * s * (3.0 - 2.0 * s) : 0.0;
}

} // namespace

template <class T>
struct VoxelEdits<T>::Parts {
  // Voxels as they were. Those beyond the volume's rim are not used.
  struct Old {
    std::array<T, BlockSize> intensity;
    std::array<unsigned char, BlockSize> valid;
  };
  using OldBlocks = std::unordered_map<std::ptrdiff_t, std::shared_ptr<const Old>>;

  struct Applied {
    StrokeChain node;
    OldBlocks old;
  };

  // A block under the stroke in the making.
  struct Live {
    std::shared_ptr<Old> old;
    std::array<float, BlockSize> squared; // distances, mm^2
    bool changed = false;                 // at all
    bool changedNow = false;              // by the piece in work
  };

  VolumeView<T> intensity;
  VolumeView<unsigned char> valid;
  ImageGeometry geometry;
  Eigen::Affine3d toIndex;
  std::array<int, 3> blocks;

  std::vector<Applied> applied;
  OldBlocks originals; // of blocks that applied strokes touch: as the file has them

  bool drawing = false;
  Stroke stroke;
  std::unordered_map<std::ptrdiff_t, Live> live;

  std::array<int, 3> BlockAt(std::ptrdiff_t id) const
  {
    const std::ptrdiff_t row = id / blocks[0];
    return {static_cast<int>(id % blocks[0]), static_cast<int>(row % blocks[1]), static_cast<int>(row / blocks[1])};
  }

  // Calls body(row of the block, flat index of its first voxel, voxels in it) for each row of a block inside the volume.
  template <class Body>
  void ForRows(std::ptrdiff_t id, const Body& body) const
  {
    const auto& n = intensity.Dimensions();
    const auto block = BlockAt(id);
    const int x = block[0] * Side, count = std::min(Side, n[0] - x);
    for (int k = 0; k < Side && block[2] * Side + k < n[2]; ++k)
      for (int j = 0; j < Side && block[1] * Side + j < n[1]; ++j)
        body((k * Side + j) * Side, intensity.Row(block[1] * Side + j, block[2] * Side + k) + x - intensity.Data(), count);
  }

  std::shared_ptr<Old> Save(std::ptrdiff_t id) const
  {
    auto old = std::make_shared<Old>();
    ForRows(id, [&](int row, std::ptrdiff_t first, int count) {
      std::memcpy(&old->intensity[row], &intensity[first], sizeof(T) * count);
      std::memcpy(&old->valid[row], &valid[first], count);
    });
    return old;
  }

  void GiveBack(std::ptrdiff_t id, const Old& old)
  {
    ForRows(id, [&](int row, std::ptrdiff_t first, int count) {
      std::memcpy(&intensity[first], &old.intensity[row], sizeof(T) * count);
      std::memcpy(&valid[first], &old.valid[row], count);
    });
  }

  void Add(Box& box, std::ptrdiff_t id) const
  {
    const auto block = BlockAt(id);
    const bool first = box.Empty();
    for (int axis = 0; axis < 3; ++axis) {
      const int begin = block[axis] * Side, end = std::min(begin + Side, intensity.Dimensions()[axis]);
      box.begin[axis] = first ? begin : std::min(box.begin[axis], begin);
      box.end[axis] = first ? end : std::max(box.end[axis], end);
    }
  }

  // Blocks whose middle is within the brush's radius and half their diagonal of the piece of path from a to b (index space
  // times spacing, mm).
  std::vector<std::ptrdiff_t> BlocksNear(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const
  {
    const Eigen::Vector3d size = Side * geometry.spacing;
    const double reach = stroke.brush.radiusMm + 0.5 * size.norm();
    std::array<int, 3> begin, end;
    for (int axis = 0; axis < 3; ++axis) {
      // Block c holds the voxels from c size to (c + 1) size - spacing.
      const double low = (std::min(a[axis], b[axis]) - stroke.brush.radiusMm) / size[axis],
                   high = (std::max(a[axis], b[axis]) + stroke.brush.radiusMm) / size[axis];
      const double count = blocks[axis];
      begin[axis] = static_cast<int>(std::clamp(std::floor(low), 0.0, count));
      end[axis] = static_cast<int>(std::clamp(std::floor(high) + 1.0, 0.0, count));
    }
    std::vector<std::ptrdiff_t> near;
    const Eigen::Vector3d ab = b - a;
    const double perSquare = ab.squaredNorm() > 0.0 ? 1.0 / ab.squaredNorm() : 0.0;
    for (int z = begin[2]; z < end[2]; ++z)
      for (int y = begin[1]; y < end[1]; ++y)
        for (int x = begin[0]; x < end[0]; ++x) {
          const Eigen::Vector3d fromA = Eigen::Vector3d(x, y, z).cwiseProduct(size) + 0.5 * (size - geometry.spacing) - a;
          const double t = std::clamp(fromA.dot(ab) * perSquare, 0.0, 1.0);
          if ((fromA - t * ab).norm() <= reach)
            near.push_back((static_cast<std::ptrdiff_t>(z) * blocks[1] + y) * blocks[0] + x);
        }
    return near;
  }

  // Makes one voxel anew from what it was; returns whether it is now another than it was before this call.
  bool Make(std::ptrdiff_t at, T old, unsigned char oldValid, const Old* original, int inBlock, double distance)
  {
    const Brush& brush = stroke.brush;
    T value = old;
    unsigned char real = oldValid;
    if (brush.mode == BrushMode::Carve) {
      real = 0;
    } else if (brush.mode == BrushMode::Restore) {
      if (original) {
        value = original->intensity[static_cast<std::size_t>(inBlock)];
        real = original->valid[static_cast<std::size_t>(inBlock)];
      }
    } else {
      bool finite = true;
      if constexpr (std::is_floating_point_v<T>)
        finite = std::isfinite(old);
      const double weight = brush.opacity * WeightAt(distance, brush);
      if (weight > 0.0 && (!brush.insideValid || (finite && oldValid != 0))) {
        const double before = finite ? static_cast<double>(old) : 0.0;
        value = RoundedTo<T>(before + weight * (brush.intensity - before));
        real = oldValid != 0 ? oldValid : 1;
      }
    }
    const bool changed = valid[at] != real || std::memcmp(&intensity[at], &value, sizeof(T)) != 0;
    intensity[at] = value;
    valid[at] = real;
    return changed;
  }

  void PaintBlock(std::ptrdiff_t id, Live& block, const Eigen::Vector3d& a, const Eigen::Vector3d& ab, double perSquare)
  {
    const auto place = BlockAt(id);
    const double reach = stroke.brush.radiusMm * stroke.brush.radiusMm;
    const auto known = originals.find(id);
    const Old* original = known == originals.end() ? nullptr : known->second.get();
    block.changedNow = false;
    ForRows(id, [&](int row, std::ptrdiff_t first, int count) {
      const Eigen::Vector3d index(place[0] * Side, place[1] * Side + row / Side % Side, place[2] * Side + row / (Side * Side));
      const Eigen::Vector3d fromA = index.cwiseProduct(geometry.spacing) - a;
      double squared[Side];
      DistancesOfRow(fromA.data(), geometry.spacing[0], ab.data(), perSquare, squared);
      for (int i = 0; i < count; ++i) {
        const std::size_t at = static_cast<std::size_t>(row + i);
        const float least = static_cast<float>(squared[i]);
        if (squared[i] > reach || least >= block.squared[at])
          continue;
        block.squared[at] = least;
        if (Make(first + i, block.old->intensity[at], block.old->valid[at], original, row + i,
                 std::sqrt(static_cast<double>(least))))
          block.changedNow = true;
      }
    });
    block.changed |= block.changedNow;
  }

  void Begin(const Brush& brush)
  {
    CheckRanges(brush);
    drawing = true;
    stroke = Stroke{brush, {}};
    live.clear();
  }

  Box Extend(const Eigen::Vector3d& point)
  {
    if (!point.allFinite())
      throw Error(Error::Kind::InvalidParameter, "a point of the stroke is not finite");
    const auto toMm = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d { return (toIndex * p).cwiseProduct(geometry.spacing); };
    const Eigen::Vector3d b = toMm(point), a = stroke.pathMm.empty() ? b : toMm(stroke.pathMm.back());
    stroke.pathMm.push_back(point);
    const Eigen::Vector3d ab = b - a;
    const double perSquare = ab.squaredNorm() > 0.0 ? 1.0 / ab.squaredNorm() : 0.0;

    const std::vector<std::ptrdiff_t> near = BlocksNear(a, b);
    std::vector<Live*> touched;
    for (const std::ptrdiff_t id : near) {
      Live& block = live[id];
      if (!block.old) {
        block.old = Save(id);
        block.squared.fill(std::numeric_limits<float>::infinity());
      }
      touched.push_back(&block);
    }
    ParallelRanges(static_cast<std::ptrdiff_t>(near.size()), BlocksPerTask, Progress(),
                   [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
                     for (std::ptrdiff_t n = begin; n < end; ++n)
                       PaintBlock(near[static_cast<std::size_t>(n)], *touched[static_cast<std::size_t>(n)], a, ab, perSquare);
                   });
    Box box;
    for (std::size_t n = 0; n < near.size(); ++n)
      if (touched[n]->changedNow)
        Add(box, near[n]);
    return box;
  }

  void TakeBack(Box& box)
  {
    for (const auto& [id, block] : live)
      if (block.changed) {
        GiveBack(id, *block.old);
        Add(box, id);
      }
    live.clear();
    drawing = false;
  }

  // What is painted stays, as the stroke of \a node.
  void Keep(const StrokeChain& node)
  {
    Applied done{node, {}};
    for (auto& [id, block] : live)
      if (block.changed) {
        originals.emplace(id, block.old);
        done.old.emplace(id, std::move(block.old));
      }
    applied.push_back(std::move(done));
    live.clear();
    drawing = false;
  }

  void GoBack(Box& box)
  {
    for (const auto& [id, old] : applied.back().old) {
      GiveBack(id, *old);
      Add(box, id);
      const auto original = originals.find(id);
      if (original->second == old)
        originals.erase(original);
    }
    applied.pop_back();
  }

  // The strokes of a chain that are not the same as those applied, the last first; applied strokes beyond are undone.
  std::vector<StrokeChain> GoBackTo(const StrokeChain& chain, Box& box)
  {
    std::vector<StrokeChain> rest;
    StrokeChain node = chain;
    while (node && (static_cast<std::size_t>(node->count) > applied.size() ||
                    applied[static_cast<std::size_t>(node->count) - 1].node != node)) {
      rest.push_back(node);
      node = node->before;
    }
    // Strokes that were read from a file again are others in memory, yet the same.
    std::size_t same = node ? static_cast<std::size_t>(node->count) : 0;
    while (!rest.empty() && same < applied.size() && applied[same].node->stroke == rest.back()->stroke) {
      applied[same++].node = rest.back();
      rest.pop_back();
    }
    while (applied.size() > same)
      GoBack(box);
    return rest;
  }

  void Join(Box& box, const Box& other) const
  {
    if (other.Empty())
      return;
    const bool first = box.Empty();
    for (int axis = 0; axis < 3; ++axis) {
      box.begin[axis] = first ? other.begin[axis] : std::min(box.begin[axis], other.begin[axis]);
      box.end[axis] = first ? other.end[axis] : std::max(box.end[axis], other.end[axis]);
    }
  }

  Box GoTo(const StrokeChain& chain)
  {
    Box box;
    if (drawing)
      TakeBack(box);
    std::vector<StrokeChain> rest = GoBackTo(chain, box);
    for (; !rest.empty(); rest.pop_back()) {
      const Stroke& next = rest.back()->stroke;
      Begin(next.brush);
      for (const Eigen::Vector3d& point : next.pathMm)
        Join(box, Extend(point));
      Keep(rest.back());
    }
    return box;
  }

  Box End(const StrokeChain& chain)
  {
    if (drawing && chain && static_cast<std::size_t>(chain->count) == applied.size() + 1 &&
        (applied.empty() || applied.back().node == chain->before) && chain->stroke == stroke) {
      Keep(chain);
      return {};
    }
    return GoTo(chain);
  }
};

template <class T>
VoxelEdits<T>::VoxelEdits(VolumeView<T> intensity, VolumeView<unsigned char> valid, const ImageGeometry& geometry)
  : parts_(std::make_unique<Parts>())
{
  geometry.Check("the volume to paint on");
  if (intensity.Empty() || valid.Empty() || intensity.Dimensions() != geometry.dimensions ||
      valid.Dimensions() != geometry.dimensions)
    throw Error(Error::Kind::BadInput, "the volume to paint on needs intensities and a valid region of its own size");
  parts_->intensity = intensity;
  parts_->valid = valid;
  parts_->geometry = geometry;
  parts_->toIndex = geometry.WorldToIndex();
  for (std::size_t axis = 0; axis < 3; ++axis)
    parts_->blocks[axis] = (geometry.dimensions[axis] + Side - 1) / Side;
}

template <class T>
VoxelEdits<T>::~VoxelEdits() = default;

template <class T>
typename VoxelEdits<T>::Box VoxelEdits<T>::GoTo(const StrokeChain& chain)
{
  return parts_->GoTo(chain);
}

template <class T>
void VoxelEdits<T>::Begin(const Brush& brush)
{
  if (parts_->drawing)
    throw Error(Error::Kind::NotPossible, "a stroke has begun and not ended");
  parts_->Begin(brush);
}

template <class T>
typename VoxelEdits<T>::Box VoxelEdits<T>::Extend(const Eigen::Vector3d& pointMm)
{
  if (!parts_->drawing)
    throw Error(Error::Kind::NotPossible, "no stroke has begun");
  return parts_->Extend(pointMm);
}

template <class T>
typename VoxelEdits<T>::Box VoxelEdits<T>::End(const StrokeChain& chain)
{
  return parts_->End(chain);
}

template <class T>
std::size_t VoxelEdits<T>::MemoryBytes() const
{
  std::size_t blocks = 0;
  for (const auto& stroke : parts_->applied)
    blocks += stroke.old.size();
  return blocks * sizeof(typename Parts::Old) +
         parts_->live.size() * (sizeof(typename Parts::Live) + sizeof(typename Parts::Old));
}

#define EchoramaInstantiate(T) template class VoxelEdits<T>;
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
