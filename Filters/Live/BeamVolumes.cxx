// SPDX-License-Identifier: BSD-3-Clause
// In index coordinates of a volume a beam is a straight line with even steps, and a plane of the thickness runs beside it at a
// distance that varies with the depth: position = start + i step + distance(i) across (+ bend(i) where tissue is pressed). Runs
// of 128 samples go through three passes over short buffers, all planes one after the other, because they read nearly the same
// cache lines:
//
// 1. Locate (vector units): cell and fractions of each sample, and whether all corners of the cell exist.
// 2. Fetch: the four pairs of voxels along x around each sample. A sample whose brick of 8^3 cells is not real throughout, or
// that
//    lies in the half voxel of rim, is left to the Sampler, which looks at each corner.
// 3. Blend and accumulate (vector units): seven linear interpolations, and the sum over planes.
//
// Of several volumes, the next one is read only where those before have left something (the first counts), or all are (the mean;
// how far a place is from where each ends is then looked up only where there are two).
#include "Filters/Live/BeamVolumes.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/Sampling.h"
#include "Core/Imaging/VoxelTypes.h"
#include "Filters/Live/BorderDistance.h"
#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <optional>

namespace echorama {
namespace {

constexpr int runLength = 128;                             // samples that are worked on together
constexpr int brickShift = 3;                              // cells of a brick along each axis: 8
constexpr int beamsPerRange = 2;                           // of a parallel task
constexpr unsigned char lookCloser = 128, nothingReal = 0; // else the content of a brick

// One plane of one beam, in index coordinates.
struct IndexLine {
  float start[3], step[3], across[3];
};

// Samples of one plane of one beam that are worked on together, in index coordinates.
struct IndexRun {
  IndexLine line;
  int first, count;
  const float* distance; // of each sample
  const float* bend[3];  // of each sample, along the axes

  float At(int axis, int i) const
  {
    return line.start[axis] + line.step[axis] * static_cast<float>(first + i) + line.across[axis] * distance[i] + bend[axis][i];
  }
};

enum Whereabouts { Outside = 0, InRim = 1, InCell = 2 };

// Where the samples of a run lie.
struct RunPlaces {
  int inSlice[runLength], slice[runLength], brick[runLength], whereabouts[runLength];
  float x[runLength], y[runLength], z[runLength]; // fractions
};

struct GridCounts {
  int n[3];      // voxels
  int rowStride; // 0 where there are no cells
  int bricks[2]; // along x and y
};

void Locate(const IndexLine line, const GridCounts grid, int first, int count, const float* __restrict distance,
            const float* __restrict bendX, const float* __restrict bendY, const float* __restrict bendZ,
            RunPlaces* __restrict places)
{
  const float lastX = static_cast<float>(grid.n[0] - 1), lastY = static_cast<float>(grid.n[1] - 1),
              lastZ = static_cast<float>(grid.n[2] - 1);
  const auto clamped = [](float at, float last) __attribute__((always_inline))
  {
    at = at > 0.0f ? at : 0.0f; // NaN becomes 0
    return at < last ? at : last;
  };
  for (int i = 0; i < count; ++i) {
    const float s = static_cast<float>(first + i), d = distance[i];
    const float x = line.start[0] + line.step[0] * s + line.across[0] * d + bendX[i];
    const float y = line.start[1] + line.step[1] * s + line.across[1] * d + bendY[i];
    const float z = line.start[2] + line.step[2] * s + line.across[2] * d + bendZ[i];
    const float cx = clamped(x, lastX), cy = clamped(y, lastY), cz = clamped(z, lastZ);
    const int in = (cx == x) & (cy == y) & (cz == z);
    const int near = (x >= -0.5f) & (y >= -0.5f) & (z >= -0.5f) & (x < lastX + 0.5f) & (y < lastY + 0.5f) & (z < lastZ + 0.5f);
    places->whereabouts[i] = in + near; // what is in is near, too
    const int ix = static_cast<int>(cx < lastX - 1.0f ? cx : lastX - 1.0f),
              iy = static_cast<int>(cy < lastY - 1.0f ? cy : lastY - 1.0f),
              iz = static_cast<int>(cz < lastZ - 1.0f ? cz : lastZ - 1.0f);
    places->x[i] = cx - static_cast<float>(ix);
    places->y[i] = cy - static_cast<float>(iy);
    places->z[i] = cz - static_cast<float>(iz);
    places->inSlice[i] = iy * grid.rowStride + ix;
    places->slice[i] = iz;
    places->brick[i] = ((iz >> brickShift) * grid.bricks[1] + (iy >> brickShift)) * grid.bricks[0] + (ix >> brickShift);
  }
}

// The corners of the cells of a run: pairs along x, of this row and the next, in this slice and the next.
template <class T>
struct RunCorners {
  T pairs[4][2 * runLength] = {};
};

template <class T>
void BlendCorners(const RunCorners<T>* __restrict corners, const RunPlaces* __restrict places, int count, float* __restrict value)
{
  const auto mix = [](float a, float b, float t) __attribute__((always_inline))
  {
    return a + t * (b - a);
  };
  for (int i = 0; i < count; ++i) {
    float along[4];
    for (int row = 0; row < 4; ++row)
      along[row] =
          mix(static_cast<float>(corners->pairs[row][2 * i]), static_cast<float>(corners->pairs[row][2 * i + 1]), places->x[i]);
    value[i] = mix(mix(along[0], along[1], places->y[i]), mix(along[2], along[3], places->y[i]), places->z[i]);
  }
}

// The sums over planes.
struct RunSums {
  float value[runLength], weight[runLength];
  int content[runLength];
};

void Accumulate(const float* __restrict value, const unsigned char* __restrict content, float weight, int count,
                RunSums* __restrict sums)
{
  for (int i = 0; i < count; ++i) {
    const float w = content[i] ? weight : 0.0f;
    sums->value[i] += content[i] ? weight * value[i] : 0.0f; // what is not real may be NaN
    sums->weight[i] += w;
    sums->content[i] |= content[i];
  }
}

void Finish(const RunSums* __restrict sums, int count, float* __restrict value, unsigned char* __restrict content)
{
  for (int i = 0; i < count; ++i) {
    const bool real = sums->weight[i] >= 0.4999f; // half, and what rounding may take
    value[i] = real ? sums->value[i] / sums->weight[i] : 0.0f;
    content[i] = static_cast<unsigned char>(real ? sums->content[i] : 0);
  }
}

} // namespace

class BeamVolumes::Reader {
public:
  virtual ~Reader() = default;
  /// Fills value and content of \a count samples from \a first on; outside content is 0 and the value is of no meaning.
  virtual void Read(const IndexRun& run, float* value, unsigned char* content) const = 0;
  virtual bool HasDataAt(const Eigen::Vector3d& index) const = 0;
  /// Whether all voxels at the corners of cubes of cells are there, and data. \a cells divides the edge of a brick.
  virtual bool IsWhole(const std::array<int, 3>& first, int cells) const = 0;

  ImageGeometry geometry;
  Eigen::Affine3d worldToIndex;
  std::optional<BorderDistance> weight; // in a mean
};

namespace {

template <class T>
class ReaderOf : public BeamVolumes::Reader {
public:
  ReaderOf(const PosedVolume<T>& volume, VolumeView<const unsigned char> embedding)
    : intensity_(volume.intensity), embedding_(embedding), sampler_(volume.intensity, volume.valid)
  {
    geometry = volume.geometry;
    worldToIndex = volume.geometry.WorldToIndex();
    const auto& n = volume.intensity.Dimensions();
    for (int axis = 0; axis < 3; ++axis)
      grid_.n[axis] = n[static_cast<std::size_t>(axis)];
    hasCells_ = n[0] > 1 && n[1] > 1 && n[2] > 1 && intensity_.SliceStride() <= std::numeric_limits<int>::max();
    grid_.rowStride = hasCells_ ? grid_.n[0] : 0;
    const auto bricks = [](int voxels) { return ((voxels - 2) >> brickShift) + 1; };
    for (int axis = 0; axis < 2; ++axis)
      grid_.bricks[axis] = hasCells_ ? bricks(grid_.n[axis]) : 0;
    if (hasCells_ && (!volume.valid.Empty() || !embedding.Empty() || std::is_floating_point_v<T>))
      MakeBricks(bricks(grid_.n[2]));
  }

  void Read(const IndexRun& run, float* value, unsigned char* content) const override
  {
    RunPlaces places;
    RunCorners<T> corners;
    const int count = run.count;
    Locate(run.line, grid_, run.first, count, run.distance, run.bend[0], run.bend[1], run.bend[2], &places);
    int slow[runLength], slowCount = 0;
    const std::ptrdiff_t nextRow = intensity_.RowStride(), nextSlice = intensity_.SliceStride();
    for (int i = 0; i < count; ++i) {
      content[i] = ContentNothing;
      if (places.whereabouts[i] == Outside)
        continue;
      unsigned char brick = lookCloser;
      if (hasCells_ && places.whereabouts[i] == InCell)
        brick = bricks_.empty() ? static_cast<unsigned char>(ContentData) : bricks_[static_cast<std::size_t>(places.brick[i])];
      if (brick == lookCloser) {
        slow[slowCount++] = i;
        continue;
      }
      content[i] = brick;
      if (brick == nothingReal)
        continue;
      const T* at = intensity_.Data() + places.slice[i] * nextSlice + places.inSlice[i];
      std::memcpy(&corners.pairs[0][2 * i], at, 2 * sizeof(T));
      std::memcpy(&corners.pairs[1][2 * i], at + nextRow, 2 * sizeof(T));
      std::memcpy(&corners.pairs[2][2 * i], at + nextSlice, 2 * sizeof(T));
      std::memcpy(&corners.pairs[3][2 * i], at + nextSlice + nextRow, 2 * sizeof(T));
    }
    BlendCorners(&corners, &places, count, value);
    for (int s = 0; s < slowCount; ++s)
      ReadClosely(run, slow[s], value, content);
  }

  bool HasDataAt(const Eigen::Vector3d& index) const override
  {
    const std::ptrdiff_t nearest = sampler_.NearestIndex(index[0], index[1], index[2]);
    return nearest >= 0 && (ContentAt(nearest) & ContentData) != 0;
  }

  bool IsWhole(const std::array<int, 3>& first, int cells) const override
  {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (first[axis] < 0 || first[axis] + cells > grid_.n[axis] - 1)
        return false;
    unsigned char brick = lookCloser;
    if (hasCells_)
      brick = bricks_.empty()
                  ? static_cast<unsigned char>(ContentData)
                  : bricks_[static_cast<std::size_t>(
                        (static_cast<std::ptrdiff_t>(first[2] >> brickShift) * grid_.bricks[1] + (first[1] >> brickShift)) *
                            grid_.bricks[0] +
                        (first[0] >> brickShift))];
    if (brick != lookCloser)
      return (brick & ContentData) != 0;
    for (int k = first[2]; k <= first[2] + cells; ++k)
      for (int j = first[1]; j <= first[1] + cells; ++j)
        for (int i = first[0]; i <= first[0] + cells; ++i)
          if (!(ContentAt(intensity_.SliceStride() * k + intensity_.RowStride() * j + i) & ContentData))
            return false;
    return true;
  }

private:
  unsigned char ContentAt(std::ptrdiff_t voxel) const
  {
    if (!sampler_.IsReal(voxel))
      return ContentNothing;
    return embedding_.Empty() ? static_cast<unsigned char>(ContentData) : ContentOfLabel(embedding_[voxel]);
  }

  // As the fast way, by the corners that are real alone.
  void ReadClosely(const IndexRun& run, int i, float* value, unsigned char* content) const
  {
    double at[3], read = 0.0;
    for (int axis = 0; axis < 3; ++axis)
      at[axis] = run.At(axis, i);
    const std::ptrdiff_t nearest = sampler_.NearestIndex(at[0], at[1], at[2]);
    if (nearest >= 0 && sampler_.Linear(at[0], at[1], at[2], read)) {
      value[i] = static_cast<float>(read);
      content[i] = ContentAt(nearest);
    }
  }

  void MakeBricks(int bricksAlongZ)
  {
    bricks_.resize(static_cast<std::size_t>(grid_.bricks[0]) * static_cast<std::size_t>(grid_.bricks[1]) *
                   static_cast<std::size_t>(bricksAlongZ));
    // A brick of cells has one layer of voxels more than cells.
    const auto last = [this](int axis, int brick) { return std::min(((brick + 1) << brickShift), grid_.n[axis] - 1); };
    ParallelFor(bricksAlongZ, [&](std::ptrdiff_t z) {
      const int bz = static_cast<int>(z);
      for (int by = 0; by < grid_.bricks[1]; ++by)
        for (int bx = 0; bx < grid_.bricks[0]; ++bx) {
          bool seen[4] = {false, false, false, false};
          for (int k = bz << brickShift; k <= last(2, bz); ++k)
            for (int j = by << brickShift; j <= last(1, by); ++j) {
              const std::ptrdiff_t row = intensity_.SliceStride() * k + intensity_.RowStride() * j;
              for (int i = bx << brickShift; i <= last(0, bx); ++i)
                seen[ContentAt(row + i)] = true;
            }
          unsigned char brick = lookCloser;
          if (seen[0] + seen[1] + seen[2] + seen[3] == 1)
            brick = static_cast<unsigned char>(std::find(seen, seen + 4, true) - seen);
          bricks_[(static_cast<std::size_t>(bz) * static_cast<std::size_t>(grid_.bricks[1]) + static_cast<std::size_t>(by)) *
                      static_cast<std::size_t>(grid_.bricks[0]) +
                  static_cast<std::size_t>(bx)] = brick;
        }
    });
  }

  VolumeView<const T> intensity_;
  VolumeView<const unsigned char> embedding_;
  Sampler<T> sampler_;
  GridCounts grid_{};
  bool hasCells_ = false;             // else a 2D image, or one whose slices are too large for the fast way
  std::vector<unsigned char> bricks_; // none: all is real and data
};

// The beams of a probe, for all volumes.
struct BeamSet {
  const PlacedProbe& probe;
  std::vector<ThicknessPlane> planes;
  std::vector<float> distances; // of each plane in turn, at each sample, mm
  int samples, beams;

  double FanOf(int beam) const { return static_cast<double>(beam) / (beams - 1) - 0.5; }
  double DepthOf(int sample) const
  {
    const ProbeGeometry& g = probe.geometry;
    return g.depthMin + (g.depthMax - g.depthMin) * sample / (samples - 1);
  }

  IndexLine Line(const BeamVolumes::Reader& reader, int beam) const
  {
    const ProbeGeometry& g = probe.geometry;
    const double fan = FanOf(beam);
    const double step = (g.depthMax - g.depthMin) / (samples - 1);
    const Eigen::Affine3d toIndex = reader.worldToIndex * probe.probeToWorld;
    const Eigen::Vector3f start = (toIndex * PointOf(g, {g.depthMin, fan, 0.0})).cast<float>();
    const Eigen::Vector3f along = (toIndex.linear() * DirectionOf(g, {g.depthMin, fan, 0.0}) * step).cast<float>();
    const Eigen::Vector3f across = toIndex.linear().col(1).cast<float>();
    return {{start[0], start[1], start[2]}, {along[0], along[1], along[2]}, {across[0], across[1], across[2]}};
  }
};

// How far the samples of a run are moved, in index coordinates of a volume.
struct RunBend {
  float along[3][runLength] = {};

  void Set(const Eigen::Matrix3f& toIndex, const Eigen::Vector3f* moves, int count)
  {
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3f move = toIndex * moves[i];
      for (int axis = 0; axis < 3; ++axis)
        along[axis][i] = move[axis];
    }
  }
};

// What one volume has of a run.
struct RunRead {
  float value[runLength];
  unsigned char content[runLength] = {};
};

// The mean of several volumes, by how far the place is from where each ends.
void TakeMean(const std::vector<std::unique_ptr<BeamVolumes::Reader>>& readers, const std::vector<IndexRun>& runs,
              const std::vector<RunRead>& reads, RunRead& mean)
{
  for (int i = 0; i < runs.front().count; ++i) {
    std::size_t only = 0;
    int real = 0;
    for (std::size_t r = 0; r < reads.size(); ++r)
      if (reads[r].content[i]) {
        ++real;
        only = r;
      }
    mean.value[i] = reads[only].value[i];
    mean.content[i] = reads[only].content[i];
    if (real < 2)
      continue;
    float sum = 0.0f, weights = 0.0f;
    int content = 0;
    for (const bool isWeighted : {true, false}) {
      for (std::size_t r = 0; r < reads.size(); ++r) {
        if (!reads[r].content[i])
          continue;
        const IndexRun& run = runs[r];
        const float weight = isWeighted ? readers[r]->weight->At(run.At(0, i), run.At(1, i), run.At(2, i)) : 1.0f;
        if (!(weight > 0.0f))
          continue;
        sum += weight * reads[r].value[i];
        weights += weight;
        content |= reads[r].content[i];
      }
      if (weights > 0.0f)
        break; // else all end there
    }
    mean.value[i] = sum / weights;
    mean.content[i] = static_cast<unsigned char>(content);
  }
}

} // namespace

ParameterList Describe(VolumeMix& m)
{
  return {
      Parameter(
          "Overlap", Choice(m.overlap, {"first", "mean"}),
          "Where several volumes are real: the first counts, or the mean, each by how far the place is from where it ends and "
          "others go on: no seams."),
      Parameter("ShowInvented", m.showInvented,
                "Whether background that embedding invented is shown; else it is as where no volume reaches.")};
}

BeamVolumes::BeamVolumes() = default;
BeamVolumes::~BeamVolumes() = default;
BeamVolumes::BeamVolumes(BeamVolumes&&) noexcept = default;
BeamVolumes& BeamVolumes::operator=(BeamVolumes&&) noexcept = default;

template <class T>
void BeamVolumes::Add(const PosedVolume<T>& volume, VolumeView<const unsigned char> embedding)
{
  const std::string name = "volume " + std::to_string(readers_.size() + 1);
  volume.geometry.Check(name);
  const auto agrees = [&volume](const auto& view) { return view.Dimensions() == volume.geometry.dimensions; };
  if (!agrees(volume.intensity) || (!volume.valid.Empty() && !agrees(volume.valid)) || (!embedding.Empty() && !agrees(embedding)))
    throw Error(Error::Kind::BadInput,
                name + ": intensities, valid region and labels do not have the dimensions of its geometry");
  readers_.push_back(std::make_unique<ReaderOf<T>>(volume, embedding));
  for (const auto& reader : readers_)
    reader->weight.reset();
}

void BeamVolumes::PrepareMean()
{
  for (const auto& reader : readers_) {
    const Eigen::Affine3d indexToWorld = reader->geometry.IndexToWorld();
    reader->weight.emplace(reader->geometry, [&](int i, int j, int k) {
      constexpr int edge = BorderDistance::blockEdge;
      if (reader->IsWhole({i * edge, j * edge, k * edge}, edge))
        return false;
      const Eigen::Vector3d middle = indexToWorld * (edge * Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5));
      return std::any_of(readers_.begin(), readers_.end(),
                         [&](const auto& other) { return other != reader && other->HasDataAt(other->worldToIndex * middle); });
    });
  }
}

void BeamVolumes::Read(const PlacedProbe& probe, const BeamThickness& thickness, VolumeView<float> value,
                       VolumeView<unsigned char> content, const VolumeMix& mix, const BeamBend* bend) const
{
  const ProbeGeometry& g = probe.geometry;
  g.Check();
  if (!g.IsPlane())
    throw Error(Error::Kind::InvalidParameter, "live image: the probe sweeps; it must image a single plane");
  if (!IsRotation(probe.probeToWorld.linear()) || !probe.probeToWorld.translation().allFinite())
    throw Error(Error::Kind::BadInput, "live image: the pose of the probe is not rigid and finite");
  const auto& n = value.Dimensions();
  if (n[0] < 2 || n[1] < 2 || n[2] != 1 || content.Dimensions() != n)
    throw Error(Error::Kind::BadInput, "live image: the beams must be a plane of at least 2 samples and 2 beams");

  BeamSet set{probe, PlanesOf(thickness), {}, n[0], n[1]};
  for (const ThicknessPlane& plane : set.planes)
    for (int i = 0; i < set.samples; ++i)
      set.distances.push_back(plane.offset == 0.0f ? 0.0f : static_cast<float>(plane.offset * thickness.SigmaMm(set.DepthOf(i))));
  const bool isMean = mix.overlap == VolumeMix::Overlap::Mean && readers_.size() > 1;
  if (isMean && !readers_.front()->weight)
    throw Error(Error::Kind::InvalidParameter, "live image: Overlap is mean, and PrepareMean() was not called");
  std::vector<Eigen::Matrix3f> toIndex;
  for (const auto& reader : readers_)
    toIndex.push_back((reader->worldToIndex.linear() * probe.probeToWorld.linear()).cast<float>());

  ParallelRanges(set.beams, beamsPerRange, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::vector<IndexRun> runs(readers_.size());
    std::vector<RunBend> bends(bend ? readers_.size() : 1);
    std::vector<RunRead> reads(isMean ? readers_.size() : 2);
    BeamBend::Line bendLine;
    std::array<Eigen::Vector3f, runLength> moves; // of a run, in the probe's frame
    RunRead mean;
    for (int beam = static_cast<int>(begin); beam < end; ++beam) {
      if (bend)
        bendLine = bend->Along(set.FanOf(beam));
      for (std::size_t r = 0; r < readers_.size(); ++r) {
        runs[r].line = set.Line(*readers_[r], beam);
        for (int axis = 0; axis < 3; ++axis)
          runs[r].bend[axis] = bends[bend ? r : 0].along[axis];
      }
      for (int first = 0; first < set.samples; first += runLength) {
        const int count = std::min(runLength, set.samples - first);
        RunSums sums{};
        for (std::size_t p = 0; p < set.planes.size(); ++p) {
          const float* distance = set.distances.data() + p * static_cast<std::size_t>(set.samples) + first;
          for (int i = 0; bend && i < count; ++i)
            moves[static_cast<std::size_t>(i)] = bendLine.At(static_cast<float>(set.DepthOf(first + i)), distance[i]);
          const auto readOf = [&](std::size_t r, RunRead& into) {
            runs[r].first = first;
            runs[r].count = count;
            runs[r].distance = distance;
            if (bend)
              bends[r].Set(toIndex[r], moves.data(), count);
            readers_[r]->Read(runs[r], into.value, into.content);
            for (int i = 0; i < count && !mix.showInvented; ++i)
              if (into.content[i] == ContentInvented)
                into.content[i] = ContentNothing;
          };
          if (isMean) {
            for (std::size_t r = 0; r < readers_.size(); ++r)
              readOf(r, reads[r]);
            TakeMean(readers_, runs, reads, mean);
            Accumulate(mean.value, mean.content, set.planes[p].weight, count, &sums);
            continue;
          }
          RunRead &read = reads[0], &other = reads[1];
          for (std::size_t r = 0; r < readers_.size(); ++r) {
            const bool isFirst = r == 0;
            if (!isFirst && std::find(read.content, read.content + count, ContentNothing) == read.content + count)
              break; // all is there
            readOf(r, isFirst ? read : other);
            for (int i = 0; i < count && !isFirst; ++i)
              if (!read.content[i]) {
                read.value[i] = other.value[i];
                read.content[i] = other.content[i];
              }
          }
          if (!readers_.empty())
            Accumulate(read.value, read.content, set.planes[p].weight, count, &sums);
        }
        Finish(&sums, count, value.Row(beam, 0) + first, content.Row(beam, 0) + first);
      }
    }
  });
}

#define EchoramaInstantiate(T) template void BeamVolumes::Add<T>(const PosedVolume<T>&, VolumeView<const unsigned char>);
ECHORAMA_FOR_EACH_VOXEL_TYPE(EchoramaInstantiate)
#undef EchoramaInstantiate

} // namespace echorama
