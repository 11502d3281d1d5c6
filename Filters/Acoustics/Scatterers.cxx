// SPDX-License-Identifier: BSD-3-Clause
// The lattice is cut into blocks of blockEdge^3 cells, and each block becomes a brick.
//
// 1. Which blocks: those whose box, moved by the displacement at its centre and widened by how much the displacement can
//    change within the block (a bound on its derivative there), meets the region and is
//    wanted. So only what is near a beam is ever hashed.
// 2. Scatterers: tasks of a fixed number of blocks. One hash (Philox) per cell gives place, rank and sign; where it lies is asked
// for the whole task at once. What is kept goes to the memory of the task, so that nothing is copied
//    and the order does not depend on the threads.
// 3. A grid of the centres of the bricks answers which lie beside a line; bricks are kept in its order.
//
// A block gives the same brick whoever asks for it: see ScattererCache.
//
// Cost: a hash per cell (in vectors), 64 control points per cell where it is displaced; 16 bytes per
// scatterer.
#include "Scatterers.h"
#include "Core/Base/Error.h"
#include "Core/Base/Memory.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "RandomBlocks.h"
#include "ScattererCache.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>

namespace echorama {
namespace {

constexpr double farthest = 1e7;         // mm
constexpr float outside = 1e9f;          // mm, of padding
constexpr double cellsPerTask = 32768.0; // asked for at once
constexpr double maxBlocks = 134217728.0;

std::uint32_t Padded(std::size_t count)
{
  constexpr std::size_t lanes = Scatterers::lanes;
  return static_cast<std::uint32_t>((count + lanes - 1) / lanes * lanes);
}

// Scatterers of one brick before they are stored.
struct Gathered {
  std::vector<Eigen::Vector3d> points;
  std::vector<float> amplitudes;

  void Clear()
  {
    points.clear();
    amplitudes.clear();
  }
};

// Stores them at the end of a part. Padding is silent and far from every beam.
Scatterers::Brick Store(const Gathered& gathered, std::uint32_t partIndex, std::vector<float>& part)
{
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& point : gathered.points)
    box.extend(point);
  Scatterers::Brick brick;
  brick.centre = box.center();
  brick.count = static_cast<std::uint32_t>(gathered.points.size());
  brick.stride = Padded(gathered.points.size());
  brick.part = partIndex;
  brick.first = part.size();
  part.resize(part.size() + 3 * static_cast<std::size_t>(brick.stride), outside);
  part.resize(part.size() + static_cast<std::size_t>(brick.stride), 0.0f);
  float* list = part.data() + brick.first;
  for (std::size_t i = 0; i < gathered.points.size(); ++i) {
    const Eigen::Vector3f local = (gathered.points[i] - brick.centre).cast<float>();
    for (int axis = 0; axis < 3; ++axis)
      list[static_cast<std::size_t>(axis) * brick.stride + i] = local[axis];
    list[3 * static_cast<std::size_t>(brick.stride) + i] = gathered.amplitudes[i];
    brick.halfSize = i == 0 ? local.cwiseAbs().eval() : brick.halfSize.cwiseMax(local.cwiseAbs()).eval();
  }
  return brick;
}

// How much a displacement changes at most per mm, cell by cell of its lattice: the derivative of a B-spline is a mean of the
// differences of neighbouring coefficients, and no larger than the largest of those that count in the cell. Compressed tissue
// beside a probe does not make the rest of the body as uncertain.
class Slopes {
public:
  explicit Slopes(const DisplacementField& field) : toIndex_(field.Lattice().WorldToIndex())
  {
    const std::vector<Eigen::Vector3d> values = field.Coefficients();
    const auto& lattice = field.Lattice().dimensions;
    for (std::size_t axis = 0; axis < 3; ++axis)
      size_[axis] = lattice[axis] + 2 * margin;
    const auto at = [&](std::array<int, 3> index) -> Eigen::Vector3d {
      for (std::size_t axis = 0; axis < 3; ++axis)
        if ((index[axis] -= margin) < 0 || index[axis] >= lattice[axis])
          return Eigen::Vector3d::Zero();
      return values[(static_cast<std::size_t>(index[2]) * static_cast<std::size_t>(lattice[1]) +
                     static_cast<std::size_t>(index[1])) *
                        static_cast<std::size_t>(lattice[0]) +
                    static_cast<std::size_t>(index[0])];
    };
    squares_.assign(Place({0, 0, size_[2]}), 0.0);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::vector<double> largest(squares_.size());
      ForAll([&](const std::array<int, 3>& index) {
        std::array<int, 3> next = index;
        ++next[axis];
        largest[Place(index)] = ((at(next) - at(index)) / field.Lattice().spacing[static_cast<Eigen::Index>(axis)]).squaredNorm();
      });
      // In cell c the coefficients c - 1 to c + 2 count.
      for (std::size_t along = 0; along < 3; ++along) {
        std::vector<double> wider(largest.size());
        ForAll([&](const std::array<int, 3>& index) {
          std::array<int, 3> there = index;
          for (int offset = -1; offset <= (along == axis ? 1 : 2); ++offset) {
            there[along] = std::clamp(index[along] + offset, 0, size_[along] - 1);
            wider[Place(index)] = std::max(wider[Place(index)], largest[Place(there)]);
          }
        });
        largest = std::move(wider);
      }
      for (std::size_t n = 0; n < squares_.size(); ++n)
        squares_[n] += largest[n];
    }
  }

  double Within(const Eigen::AlignedBox3d& box) const
  {
    const Eigen::Vector3d middle = toIndex_ * box.center(), half = toIndex_.linear().cwiseAbs() * (0.5 * box.sizes());
    std::array<int, 3> first, last;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<Eigen::Index>(axis);
      const double end = size_[axis] - 1.0;
      first[axis] = static_cast<int>(std::clamp(std::floor(middle[i] - half[i]) + margin, 0.0, end));
      last[axis] = static_cast<int>(std::clamp(std::floor(middle[i] + half[i]) + margin, 0.0, end));
    }
    double square = 0.0;
    for (int k = first[2]; k <= last[2]; ++k)
      for (int j = first[1]; j <= last[1]; ++j)
        for (int i = first[0]; i <= last[0]; ++i)
          square = std::max(square, squares_[Place({i, j, k})]);
    return std::sqrt(square);
  }

private:
  static constexpr int margin = 4; // beyond it nothing changes

  std::size_t Place(const std::array<int, 3>& index) const
  {
    return (static_cast<std::size_t>(index[2]) * static_cast<std::size_t>(size_[1]) + static_cast<std::size_t>(index[1])) *
               static_cast<std::size_t>(size_[0]) +
           static_cast<std::size_t>(index[0]);
  }
  template <class Use>
  void ForAll(const Use& use) const
  {
    ParallelFor(size_[2], [&](std::ptrdiff_t k) {
      for (int j = 0; j < size_[1]; ++j)
        for (int i = 0; i < size_[0]; ++i)
          use({i, j, static_cast<int>(k)});
    });
  }

  Eigen::Affine3d toIndex_;
  std::array<int, 3> size_;
  std::vector<double> squares_;
};

// What is hashed from a cell.
struct CellHash {
  Eigen::Array3d place; // in the cell, [0, 1)
  double rank;          // [0, 1)
  float sign;
};

constexpr int hashedAtOnce = 64;

// Bits of cells: words begin as the cells' indices.
void HashCells(std::uint32_t (&words)[4][hashedAtOnce], std::uint32_t seedLow, std::uint32_t seedHigh)
{
  for (int i = 0; i < hashedAtOnce; ++i)
    words[3][i] = 0x5ca7u;
  RandomBlocks(words, {seedLow, seedHigh});
}

CellHash HashOf(const std::uint32_t (&words)[4][hashedAtOnce], int i)
{
  constexpr double part32 = 1.0 / 4294967296.0;
  CellHash hash;
  for (int axis = 0; axis < 3; ++axis)
    hash.place[axis] = (words[axis][i] + 0.5) * part32;
  hash.rank = (words[3][i] & ~1u) * part32;
  hash.sign = (words[3][i] & 1u) != 0 ? 1.0f : -1.0f;
  return hash;
}

// Which scatterers have changed, and the signs that they then have.
class Change {
public:
  explicit Change(const ScattererParameters& p)
    : key_{static_cast<std::uint32_t>(p.changeSeed), static_cast<std::uint32_t>(p.changeSeed >> 32)},
      share_(1.0 - std::sqrt(1.0 - p.decorrelation))
  {
  }
  void Apply(const Eigen::Array3i& cell, CellHash& hash) const
  {
    if (share_ == 0.0)
      return;
    const auto bits = Random::Block({static_cast<std::uint32_t>(cell.x()), static_cast<std::uint32_t>(cell.y()),
                                     static_cast<std::uint32_t>(cell.z()), 0xc4a6u},
                                    key_);
    if ((bits[0] + 0.5) / 4294967296.0 < share_)
      hash.sign = (bits[1] & 1u) != 0 ? 1.0f : -1.0f;
  }

private:
  std::array<std::uint32_t, 2> key_;
  double share_;
};

// The lattice, its blocks and where they go.
class Lattice {
public:
  Lattice(const ScattererParameters& parameters, double density, const Eigen::AlignedBox3d& region, const BoxPredicate& wanted)
    : key_{static_cast<std::uint32_t>(parameters.seed), static_cast<std::uint32_t>(parameters.seed >> 32)}, change_(parameters),
      cell_(std::cbrt(1.0 / density)), edge_(std::clamp(static_cast<int>(std::lround(1.6 / cell_)), 4, 16)), region_(region),
      wanted_(wanted)
  {
    if (parameters.displacement && !parameters.displacement->IsZero()) {
      displacement_ = parameters.displacement;
      slopes_.emplace(*displacement_);
    }
    const double block = BlockMm(), bound = displacement_ ? displacement_->Bound() : 0.0;
    const Eigen::Array3d first = ((region.min().array() - bound) / block).floor(),
                         last = ((region.max().array() + bound) / block).floor();
    if (!((last - first + 1.0).prod() <= maxBlocks))
      throw Error(Error::Kind::TooLarge, "scatterers: the region of " + NumberText((region.max() - region.min()).x()) + " x " +
                                             NumberText((region.max() - region.min()).y()) + " x " +
                                             NumberText((region.max() - region.min()).z()) +
                                             " mm is too large for densityPerMm3 = " + NumberText(density) +
                                             "; choose a smaller region or fewer scatterers");
    first_ = first.cast<int>();
    count_ = (last - first).cast<int>() + 1;
  }

  double BlockMm() const { return edge_ * cell_; }
  int CellsPerBlock() const { return edge_ * edge_ * edge_; }

  // The blocks that are needed, in the order of the lattice.
  std::vector<Eigen::Array3i> Needed(const Progress& progress) const
  {
    std::vector<std::vector<Eigen::Array3i>> layers(static_cast<std::size_t>(count_.z()));
    ParallelFor(count_.z(), progress, [&](std::ptrdiff_t k) {
      for (int j = 0; j < count_.y(); ++j)
        for (int i = 0; i < count_.x(); ++i) {
          const Eigen::Array3i block = first_ + Eigen::Array3i(i, j, static_cast<int>(k));
          const Eigen::AlignedBox3d box = BoxOf(block);
          if (box.intersects(region_) && (!wanted_ || wanted_(box)))
            layers[static_cast<std::size_t>(k)].push_back(block);
        }
    });
    std::vector<Eigen::Array3i> all;
    for (const auto& layer : layers)
      all.insert(all.end(), layer.begin(), layer.end());
    return all;
  }

  // Calls use(world, hash) for every cell of a block.
  template <class Use>
  void ForEach(const Eigen::Array3i& block, const Use& use) const
  {
    const int all = CellsPerBlock();
    Eigen::Array3i cells[hashedAtOnce], local(0, 0, 0);
    std::uint32_t words[4][hashedAtOnce] = {};
    for (int begin = 0; begin < all; begin += hashedAtOnce) {
      const int count = std::min(hashedAtOnce, all - begin);
      for (int n = 0; n < count; ++n) {
        cells[n] = edge_ * block + local;
        for (int axis = 0; axis < 3; ++axis)
          words[axis][n] = static_cast<std::uint32_t>(cells[n][axis]);
        for (int axis = 0; axis < 3 && ++local[axis] == edge_; ++axis)
          local[axis] = 0;
      }
      HashCells(words, key_[0], key_[1]);
      for (int n = 0; n < count; ++n) {
        CellHash hash = HashOf(words, n);
        change_.Apply(cells[n], hash);
        Eigen::Vector3d point = (cell_ * (cells[n].cast<double>() + hash.place)).matrix();
        if (displacement_)
          point += displacement_->At(point);
        use(point, hash);
      }
    }
  }

private:
  // A box of the world that holds the block wherever it went.
  Eigen::AlignedBox3d BoxOf(const Eigen::Array3i& block) const
  {
    const double size = BlockMm();
    Eigen::AlignedBox3d box((size * block.cast<double>()).matrix(), (size * (block + 1).cast<double>()).matrix());
    if (displacement_) {
      const Eigen::Vector3d shift = displacement_->At(box.center());
      const double slack = std::min(slopes_->Within(box) * 0.5 * std::sqrt(3.0) * size, 2.0 * displacement_->Bound());
      box.translate(shift);
      box.min().array() -= slack;
      box.max().array() += slack;
    }
    return box;
  }

  std::array<std::uint32_t, 2> key_;
  Change change_;
  double cell_; // mm
  int edge_;    // cells along a block
  const Eigen::AlignedBox3d& region_;
  const BoxPredicate& wanted_;
  const DisplacementField* displacement_ = nullptr;
  std::optional<Slopes> slopes_;
  Eigen::Array3i first_, count_; // blocks
};

// Of every material: which rank it keeps, and the amplitude of a scatterer of strength 1.
struct Share {
  double keep = 0.0, amplitude = 0.0;
};

std::vector<Share> Shares(const std::vector<Material>& materials, double density)
{
  std::vector<Share> shares;
  for (const Material& material : materials) {
    Share share;
    if (material.scattererDensity > 0.0 && material.backscatterDb > Material::clearDb) {
      share.keep = std::min(1.0, material.scattererDensity / density);
      share.amplitude = std::sqrt(std::pow(10.0, 0.1 * material.backscatterDb) / (share.keep * density));
    }
    shares.push_back(share);
  }
  return shares;
}

// What scatterers depend on besides where materials lie: numbers, bit by bit, of a displacement a hash.
std::vector<std::uint64_t> KeyOf(const ScattererParameters& p, double density, const std::vector<Share>& shares)
{
  const auto bitsOf = [](double number) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &number, sizeof bits);
    return bits;
  };
  std::vector<std::uint64_t> key{p.seed, p.changeSeed, bitsOf(p.decorrelation), bitsOf(density)};
  for (const Share& share : shares) {
    key.push_back(bitsOf(share.keep));
    key.push_back(bitsOf(share.amplitude));
  }
  if (p.displacement && !p.displacement->IsZero()) {
    std::uint64_t hash = 14695981039346656037u; // FNV-1a, a number at a time
    const auto add = [&](const double* numbers, std::size_t count) {
      for (std::size_t i = 0; i < count; ++i)
        hash = (hash ^ bitsOf(numbers[i])) * 1099511628211u, hash ^= hash >> 32;
    };
    const ImageGeometry& lattice = p.displacement->Lattice();
    const Eigen::Matrix4d place = lattice.IndexToWorld().matrix();
    add(place.data(), 16);
    for (const Eigen::Vector3d& coefficient : p.displacement->Coefficients())
      add(coefficient.data(), 3);
    key.push_back(hash);
    for (const int count : lattice.dimensions)
      key.push_back(static_cast<std::uint64_t>(count));
  }
  return key;
}

// The bricks of consecutive blocks, and the memory that holds them.
struct Made {
  std::shared_ptr<const std::vector<float>> memory;
  std::vector<Scatterers::Brick> bricks; // one of every block, without scatterers (count 0) where there are none
};

std::vector<Made> MakeBlocks(const Lattice& lattice, const std::vector<Eigen::Array3i>& blocks, const std::vector<Share>& shares,
                             const MediumLookup& mediumAt, const Progress& progress)
{
  const auto perTask =
      std::max<std::size_t>(1, static_cast<std::size_t>(cellsPerTask) / static_cast<std::size_t>(lattice.CellsPerBlock()));
  const std::size_t tasks = (blocks.size() + perTask - 1) / perTask;
  std::vector<Made> all(tasks);
  ParallelFor(static_cast<std::ptrdiff_t>(tasks), progress, [&](std::ptrdiff_t task) {
    const std::size_t begin = static_cast<std::size_t>(task) * perTask, end = std::min(blocks.size(), begin + perTask);
    std::vector<Eigen::Vector3d> places;
    std::vector<Eigen::Vector3f> points;
    std::vector<float> ranks, signs;
    const std::size_t cells = (end - begin) * static_cast<std::size_t>(lattice.CellsPerBlock());
    places.reserve(cells);
    points.reserve(cells);
    ranks.reserve(cells);
    signs.reserve(cells);
    for (std::size_t block = begin; block < end; ++block)
      lattice.ForEach(blocks[block], [&](const Eigen::Vector3d& place, const CellHash& hash) {
        places.push_back(place);
        points.push_back(place.cast<float>());
        ranks.push_back(static_cast<float>(hash.rank));
        signs.push_back(hash.sign);
      });
    std::vector<std::int32_t> media(points.size(), -1);
    mediumAt(points.data(), points.size(), media.data());

    Gathered gathered;
    std::vector<float> part;
    Made& made = all[static_cast<std::size_t>(task)];
    std::size_t i = 0;
    for (std::size_t block = begin; block < end; ++block) {
      gathered.Clear();
      for (const std::size_t next = i + static_cast<std::size_t>(lattice.CellsPerBlock()); i < next; ++i) {
        const std::int32_t medium = media[i];
        if (medium < 0 || static_cast<std::size_t>(medium) >= shares.size())
          continue;
        const Share& share = shares[static_cast<std::size_t>(medium)];
        if (!(ranks[i] < share.keep))
          continue;
        gathered.points.push_back(places[i]);
        gathered.amplitudes.push_back(static_cast<float>(share.amplitude) * signs[i]);
      }
      made.bricks.push_back(gathered.points.empty() ? Scatterers::Brick() : Store(gathered, 0, part));
    }
    part.shrink_to_fit();
    made.memory = std::make_shared<const std::vector<float>>(std::move(part));
  });
  return all;
}

} // namespace

ParameterList Describe(ScattererParameters& p)
{
  return {
      Parameter("Seed", p.seed, {0, 9223372036854775807.0}, "", "Seed of places and signs."),
      Parameter("DensityPerMm3", p.densityPerMm3, {0, 1000}, "per mm^3",
                "Scatterers of the lattice; 0: those of the densest material. Materials that have more get this many, as loud as "
                "before."),
      Parameter("Decorrelation", p.decorrelation, {0, 1}, "", "How far the tissue has changed."),
      Parameter("ChangeSeed", p.changeSeed, {0, 9223372036854775807.0}, "", "Seed of the change."),
      Parameter("MaxBytes", p.maxBytes, {0, Unlimited, true}, "bytes", "No more memory than this is taken."),
  };
}

Scatterers Scatterers::Make(const ScattererParameters& parameters, const std::vector<Material>& materials,
                            const MediumLookup& mediumAt, const Eigen::AlignedBox3d& region, const BoxPredicate& wanted,
                            const Progress& progress, ScattererCache* cache)
{
  CheckRanges(parameters);
  double density = 0.0;
  for (const Material& material : materials) {
    material.Check();
    if (material.backscatterDb > Material::clearDb)
      density = std::max(density, material.scattererDensity);
  }
  if (parameters.densityPerMm3 > 0.0)
    density = parameters.densityPerMm3;
  Scatterers all;
  if (density == 0.0 || region.isEmpty())
    return all;
  const auto isNear = [](const Eigen::Vector3d& point) { return (point.array().abs() <= farthest).all(); }; // nor NaN
  if (!isNear(region.min()) || !isNear(region.max()))
    throw Error(Error::Kind::InvalidParameter, "scatterers: the region is not finite or lies more than 1e7 mm away");

  const Lattice lattice(parameters, density, region, wanted);
  const std::vector<Eigen::Array3i> blocks = lattice.Needed(progress.Part(0.0, 0.1));
  const double bytes = static_cast<double>(blocks.size()) * (lattice.CellsPerBlock() * 16.0 + sizeof(Brick));
  if (bytes > std::min(parameters.maxBytes, FreeMemory()))
    throw Error(Error::Kind::TooLarge, "scatterers: " + NumberText(std::round(bytes / 1e6)) + " MB would be needed and " +
                                           NumberText(std::round(std::min(parameters.maxBytes, FreeMemory()) / 1e6)) +
                                           " MB are allowed (maxBytes) or free; choose fewer scatterers (densityPerMm3, "
                                           "scattererDensity of the materials) or fewer and shorter beams");

  const std::vector<Share> shares = Shares(materials, density);
  if (!cache) {
    std::uint32_t part = 0;
    for (Made& made : MakeBlocks(lattice, blocks, shares, mediumAt, progress.Part(0.1, 1.0))) {
      for (Brick& brick : made.bricks)
        if (brick.count > 0) {
          brick.part = part;
          all.bricks_.push_back(brick);
        }
      all.parts_.push_back(std::move(made.memory));
      ++part;
    }
  } else {
    cache->Begin(KeyOf(parameters, density, shares));
    const std::vector<Eigen::Array3i> missing = cache->Missing(blocks);
    auto block = missing.begin();
    for (const Made& made : MakeBlocks(lattice, missing, shares, mediumAt, progress.Part(0.1, 1.0))) {
      cache->Add(&*block, made.bricks, made.memory);
      block += static_cast<std::ptrdiff_t>(made.bricks.size());
    }
    cache->Use(blocks, all.bricks_, all.parts_);
  }
  all.MakeGrid(lattice.BlockMm());
  return all;
}

Scatterers Scatterers::At(const std::vector<Eigen::Vector3d>& points, const std::vector<float>& amplitudes)
{
  if (points.size() != amplitudes.size())
    throw Error(Error::Kind::BadInput, "scatterers: " + std::to_string(points.size()) + " points and " +
                                           std::to_string(amplitudes.size()) + " amplitudes do not go together");
  constexpr double cell = 2.0; // mm
  // By cell, then in the order given.
  std::vector<std::pair<std::array<double, 3>, std::size_t>> order;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!(points[i].array().abs() <= farthest).all() || !std::isfinite(amplitudes[i]))
      throw Error(Error::Kind::BadInput,
                  "scatterers: point " + std::to_string(i) + " or its amplitude is not finite or lies more than 1e7 mm away");
    const Eigen::Array3d place = (points[i].array() / cell).floor();
    order.push_back({{place.z(), place.y(), place.x()}, i});
  }
  std::sort(order.begin(), order.end());

  Scatterers all;
  std::vector<float> part;
  Gathered gathered;
  for (std::size_t i = 0; i < order.size(); ++i) {
    gathered.points.push_back(points[order[i].second]);
    gathered.amplitudes.push_back(amplitudes[order[i].second]);
    if (i + 1 == order.size() || order[i + 1].first != order[i].first) {
      all.bricks_.push_back(Store(gathered, 0, part));
      gathered.Clear();
    }
  }
  all.parts_.push_back(std::make_shared<const std::vector<float>>(std::move(part)));
  all.MakeGrid(cell);
  return all;
}

std::size_t Scatterers::MemoryBytes() const
{
  std::size_t bytes = bricks_.capacity() * sizeof(Brick) + starts_.capacity() * sizeof(std::uint32_t) +
                      centres_.capacity() * sizeof(Eigen::Vector3f);
  for (const auto& part : parts_)
    bytes += part->capacity() * sizeof(float) + sizeof(*part);
  return bytes;
}

void Scatterers::MakeGrid(double cell)
{
  count_ = 0;
  largestRadius_ = 0.0;
  Eigen::AlignedBox3d box;
  for (const Brick& brick : bricks_) {
    count_ += brick.count;
    largestRadius_ = std::max(largestRadius_, static_cast<double>(brick.halfSize.norm()));
    box.extend(brick.centre);
  }
  gridSize_.setZero();
  if (bricks_.empty())
    return;
  // Scattered heaps of bricks get a coarser grid.
  while (!(((box.sizes().array() / cell).floor() + 1.0).prod() <= std::max(4096.0, 64.0 * static_cast<double>(bricks_.size()))))
    cell *= 2.0;
  gridCell_ = cell;
  gridFirst_ = box.min();
  gridSize_ = (box.sizes().array() / cell).floor().cast<int>() + 1;
  const auto cellOf = [&](const Brick& brick) {
    const Eigen::Array3i at = ((brick.centre - gridFirst_).array() / cell).floor().cast<int>().min(gridSize_ - 1);
    return (static_cast<std::size_t>(at.z()) * static_cast<std::size_t>(gridSize_.y()) + static_cast<std::size_t>(at.y())) *
               static_cast<std::size_t>(gridSize_.x()) +
           static_cast<std::size_t>(at.x());
  };
  const std::size_t cells =
      static_cast<std::size_t>(gridSize_.x()) * static_cast<std::size_t>(gridSize_.y()) * static_cast<std::size_t>(gridSize_.z());
  starts_.assign(cells + 1, 0);
  for (const Brick& brick : bricks_)
    ++starts_[cellOf(brick) + 1];
  for (std::size_t i = 0; i < cells; ++i)
    starts_[i + 1] += starts_[i];
  std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
  std::vector<Brick> sorted(bricks_.size());
  centres_.resize(bricks_.size());
  for (const Brick& brick : bricks_) {
    const std::uint32_t place = next[cellOf(brick)]++;
    sorted[place] = brick;
    centres_[place] = (brick.centre - gridFirst_).cast<float>();
  }
  bricks_ = std::move(sorted);
}

void Scatterers::FindBeside(const Eigen::Vector3d& from, const Eigen::Vector3d& direction, double length,
                            const RadiusAlong& radius, std::vector<std::uint32_t>& found) const
{
  if (bricks_.empty() || !(length >= 0.0))
    return;
  // Layer by layer across the axis along which the line runs most. There, what is within reach of the line is an ellipse about
  // where the line passes. Cells that follow each other along the first of the other axes follow each other in memory, but
  // where that axis is the second.
  int main = 0;
  direction.cwiseAbs().maxCoeff(&main);
  const int axes[2] = {main == 0 ? 1 : 0, main == 2 ? 1 : 2};
  const bool together = axes[0] == 0;
  const Eigen::Vector3d start = from - gridFirst_;
  const Eigen::Vector3f startFloat = start.cast<float>(), directionFloat = direction.cast<float>();
  const double slope = direction[main], widest = radius(0.0, length) + largestRadius_;
  const double sine = std::sqrt(std::max(0.0, 1.0 - slope * slope)), slant = sine / std::abs(slope);
  const auto cellOf = [&](double x, int axis) {
    return static_cast<int>(std::clamp(std::floor(x / gridCell_), -1.0, static_cast<double>(gridSize_[axis])));
  };
  const double a = start[main], b = start[main] + length * slope, pad = sine * widest + std::abs(slope) * largestRadius_;
  const int firstLayer = std::max(0, cellOf(std::min(a, b) - pad, main));
  const int lastLayer = std::min(gridSize_[main] - 1, cellOf(std::max(a, b) + pad, main));
  const std::size_t strides[3] = {1, static_cast<std::size_t>(gridSize_.x()),
                                  static_cast<std::size_t>(gridSize_.x()) * static_cast<std::size_t>(gridSize_.y())};
  // Single precision must not lose one.
  const double slack = 1e-6 * ((gridSize_.cast<double>() * gridCell_).matrix().norm() + start.norm()) + largestRadius_;
  const auto least = static_cast<float>(-slack), most = static_cast<float>(length + slack);
  for (int layer = firstLayer; layer <= lastLayer; ++layer) {
    const double enter = (layer * gridCell_ - start[main]) / slope, leave = ((layer + 1) * gridCell_ - start[main]) / slope;
    const double begin = std::min(enter, leave) - slant * widest, end = std::max(enter, leave) + slant * widest;
    const double reach = radius(std::clamp(begin, 0.0, length), std::clamp(end, 0.0, length)) + largestRadius_;
    int low[2], high[2];
    for (int n = 0; n < 2; ++n) {
      const int axis = axes[n];
      const double p = start[axis] + enter * direction[axis], q = start[axis] + leave * direction[axis];
      const double wide = reach * std::sqrt(1.0 + std::pow(direction[axis] / slope, 2));
      low[n] = std::max(0, cellOf(std::min(p, q) - wide, axis));
      high[n] = std::min(gridSize_[axis] - 1, cellOf(std::max(p, q) + wide, axis));
    }
    if (low[0] > high[0])
      continue;
    const auto reachSquared = static_cast<float>(reach * reach);
    const auto look = [&](std::size_t firstCell, std::size_t lastCell) {
      const std::uint32_t first = starts_[firstCell], last = starts_[lastCell + 1];
      std::size_t count = found.size();
      found.resize(count + (last - first));
      for (std::uint32_t i = first; i < last; ++i) {
        const Eigen::Vector3f place = centres_[i] - startFloat;
        const float along = place.dot(directionFloat), all = place.squaredNorm();
        found[count] = i;
        count += (all - along * along <= reachSquared + 1e-6f * all) & (along >= least) & (along <= most);
      }
      found.resize(count);
    };
    for (int i = low[1]; i <= high[1]; ++i) {
      const std::size_t row = static_cast<std::size_t>(layer) * strides[main] + static_cast<std::size_t>(i) * strides[axes[1]];
      if (together)
        look(row + static_cast<std::size_t>(low[0]), row + static_cast<std::size_t>(high[0]));
      else
        for (int j = low[0]; j <= high[0]; ++j)
          look(row + static_cast<std::size_t>(j) * strides[1], row + static_cast<std::size_t>(j) * strides[1]);
    }
  }
}

} // namespace echorama
