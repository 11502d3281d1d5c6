// SPDX-License-Identifier: BSD-3-Clause
// Sorting is one pass that counts and one that writes numbers of particles. The
// particles themselves are put in order now and then only (GelSolver), so that those of a block lie near each other.
#include "GelGrid.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr double mostGelBlocks = 1 << 24;

} // namespace

void GelDomain::Check() const
{
  const auto fail = [](const std::string& reason) {
    throw Error(Error::Kind::InvalidParameter, "the domain of the gel: " + reason);
  };
  if (!(cellMm > 0.0) || !std::isfinite(cellMm))
    fail("the size of a cell is " + NumberText(cellMm) + " mm; it must be above 0");
  if (!origin.allFinite())
    fail("its origin is not finite");
  double blocks = 1.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string name = std::string("along ") + "xyz"[axis];
    if (cells[axis] < GelGrid::BlockSize)
      fail("it has " + std::to_string(cells[axis]) + " cells " + name + "; it needs 4");
    if (from[axis] % GelGrid::BlockSize != 0 || (periodic[axis] && from[axis] != 0))
      fail("its first cell " + name + " is " + std::to_string(from[axis]) +
           "; it must be a multiple of 4, and 0 along a periodic axis");
    if (periodic[axis] && cells[axis] % GelGrid::BlockSize != 0)
      fail("it has " + std::to_string(cells[axis]) + " cells " + name + "; along a periodic axis it must be a multiple of 4");
    blocks *= std::ceil(cells[axis] / static_cast<double>(GelGrid::BlockSize));
  }
  if (blocks > mostGelBlocks)
    throw Error(Error::Kind::TooLarge,
                "the domain of the gel has " + NumberText(blocks) +
                    " blocks of 4 x 4 x 4 cells; it may have 16777216. Make it smaller, or its cells larger");
}

GelDomain GelDomain::With(const Eigen::AlignedBox3d& box) const
{
  GelDomain domain = *this;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (periodic[axis] || box.isEmpty())
      continue;
    const int n = static_cast<int>(axis);
    const double block = GelGrid::BlockSize * cellMm;
    const double low = std::floor((box.min()[n] - origin[n]) / block), high = std::ceil((box.max()[n] - origin[n]) / block);
    if (!(std::max(std::abs(low), std::abs(high)) < mostGelBlocks))
      throw Error(Error::Kind::TooLarge,
                  "the domain of the gel would reach further than it can be counted; make its cells larger");
    const int first = std::min(from[axis], static_cast<int>(low) * GelGrid::BlockSize);
    const int end = std::max(from[axis] + cells[axis], static_cast<int>(high) * GelGrid::BlockSize);
    domain.from[axis] = first;
    domain.cells[axis] = end - first;
  }
  return domain;
}

GelGrid::GelGrid(const GelDomain& domain) : domain_(domain)
{
  domain_.Check();
  std::size_t all = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    size_[axis] = (domain_.cells[axis] + BlockSize - 1) / BlockSize;
    all *= static_cast<std::size_t>(size_[axis]);
  }
  perCell_ = 1.0 / domain_.cellMm;
  count_.assign(all, 0);
  homeOf_.assign(all, -1);
  nodesOf_.assign(all, -1);
}

std::int32_t GelGrid::BlockOf(double* position) const
{
  int block[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int cells = domain_.cells[axis];
    double at = (position[axis] - domain_.origin[static_cast<int>(axis)]) * perCell_;
    if (domain_.periodic[axis] && !(at >= 0.5 && at < cells + 0.5)) {
      const double turns = std::floor((at - 0.5) / cells);
      position[axis] -= turns * cells * domain_.cellMm;
      at = (position[axis] - domain_.origin[static_cast<int>(axis)]) * perCell_;
      at = std::min(std::max(at, 0.5), std::nextafter(cells + 0.5, 0.0));
    }
    const int highest = domain_.periodic[axis] ? cells - 1 : cells - 3;
    const double lowest = std::floor(at - 0.5) - domain_.from[axis];
    if (!(lowest >= 0.0 && lowest <= highest)) // also what is not finite
      return -1;
    block[axis] = static_cast<int>(lowest) / BlockSize;
  }
  return (block[2] * size_[1] + block[1]) * size_[0] + block[0];
}

std::array<int, 3> GelGrid::CornerOfBlock(std::int32_t block) const
{
  const int x = block % size_[0], y = block / size_[0] % size_[1], z = block / size_[0] / size_[1];
  return {domain_.from[0] + x * BlockSize, domain_.from[1] + y * BlockSize, domain_.from[2] + z * BlockSize};
}

std::int32_t GelGrid::Beside(std::int32_t block, const std::array<int, 3>& by) const
{
  int at[3] = {block % size_[0], block / size_[0] % size_[1], block / size_[0] / size_[1]};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    at[axis] += by[axis];
    if (domain_.periodic[axis])
      at[axis] = (at[axis] + size_[axis]) % size_[axis];
    if (at[axis] < 0 || at[axis] >= size_[axis])
      return -1;
  }
  return (at[2] * size_[1] + at[1]) * size_[0] + at[0];
}

void GelGrid::Sort(const std::vector<GelParticle>& particles)
{
  for (const std::int32_t block : homes_)
    homeOf_[static_cast<std::size_t>(block)] = -1;
  for (const std::int32_t block : blocks_)
    nodesOf_[static_cast<std::size_t>(block)] = -1;
  homes_.clear();
  blocks_.clear();
  for (const GelParticle& particle : particles)
    if (particle.block >= 0 && count_[static_cast<std::size_t>(particle.block)]++ == 0)
      homes_.push_back(particle.block);
  std::sort(homes_.begin(), homes_.end());
  start_.assign(homes_.size() + 1, 0);
  std::int32_t sum = 0;
  for (std::size_t home = 0; home < homes_.size(); ++home) {
    const auto block = static_cast<std::size_t>(homes_[home]);
    homeOf_[block] = static_cast<std::int32_t>(home);
    start_[home] = sum;
    sum += count_[block];
    count_[block] = start_[home]; // where its next particle goes
  }
  start_.back() = sum;
  order_.resize(static_cast<std::size_t>(sum));
  for (std::size_t p = 0; p < particles.size(); ++p)
    if (particles[p].block >= 0)
      order_[static_cast<std::size_t>(count_[static_cast<std::size_t>(particles[p].block)]++)] = static_cast<std::int32_t>(p);
  for (const std::int32_t block : homes_)
    count_[static_cast<std::size_t>(block)] = 0;

  // The nodes of a tile lie in its own block and those above it; a block's nodes in the tiles of its own and those below it.
  nodesAround_.resize(homes_.size() * 8);
  for (std::size_t home = 0; home < homes_.size(); ++home)
    for (int n = 0; n < 8; ++n) {
      const std::int32_t block = Beside(homes_[home], {n & 1, n >> 1 & 1, n >> 2});
      std::int32_t number = -1;
      if (block >= 0) {
        std::int32_t& place = nodesOf_[static_cast<std::size_t>(block)];
        if (place < 0) {
          place = static_cast<std::int32_t>(blocks_.size());
          blocks_.push_back(block);
        }
        number = place;
      }
      nodesAround_[home * 8 + static_cast<std::size_t>(n)] = number;
    }
  homesAround_.resize(blocks_.size() * 8);
  for (std::size_t block = 0; block < blocks_.size(); ++block)
    for (int n = 0; n < 8; ++n) {
      const std::int32_t below = Beside(blocks_[block], {-(n & 1), -(n >> 1 & 1), -(n >> 2)});
      homesAround_[block * 8 + static_cast<std::size_t>(n)] = below < 0 ? -1 : homeOf_[static_cast<std::size_t>(below)];
    }
  tiles_.resize(homes_.size() * TileNodes);
  nodes_.resize(blocks_.size() * BlockNodes);
}

GelNode* GelGrid::NodeAt(const std::array<int, 3>& place)
{
  std::size_t block = 0, node = 0;
  for (std::size_t axis = 3; axis-- > 0;) {
    const int cells = size_[axis] * BlockSize;
    const int at = domain_.periodic[axis] ? (place[axis] % cells + cells) % cells : place[axis] - domain_.from[axis];
    if (at < 0 || at >= cells)
      return nullptr;
    block = block * static_cast<std::size_t>(size_[axis]) + static_cast<std::size_t>(at / BlockSize);
    node = node * BlockSize + static_cast<std::size_t>(at % BlockSize);
  }
  const std::int32_t number = nodesOf_[block];
  return number < 0 ? nullptr : nodes_.data() + static_cast<std::size_t>(number) * BlockNodes + node;
}

void GelGrid::SumTiles(int block)
{
  GelNode* nodes = NodesOf(block);
  std::fill(nodes, nodes + BlockNodes, GelNode{});
  for (int n = 0; n < 8; ++n) {
    const std::int32_t home = homesAround_[static_cast<std::size_t>(block) * 8 + static_cast<std::size_t>(n)];
    if (home < 0)
      continue;
    const GelNode* tile = TileOf(home);
    const int x = n & 1, y = n >> 1 & 1, z = n >> 2;
    for (int k = 0; k < (z ? 2 : 4); ++k)
      for (int j = 0; j < (y ? 2 : 4); ++j) {
        const double* from = tile[((k + 4 * z) * TileSize + j + 4 * y) * TileSize + 4 * x].value;
        double* to = nodes[(k * BlockSize + j) * BlockSize].value;
        for (int i = 0; i < (x ? 8 : 16); ++i)
          to[i] += from[i];
      }
  }
}

void GelGrid::FillTile(int home)
{
  GelNode* tile = TileOf(home);
  for (int n = 0; n < 8; ++n) {
    const std::int32_t block = nodesAround_[static_cast<std::size_t>(home) * 8 + static_cast<std::size_t>(n)];
    const int x = n & 1, y = n >> 1 & 1, z = n >> 2;
    for (int k = 0; k < (z ? 2 : 4); ++k)
      for (int j = 0; j < (y ? 2 : 4); ++j) {
        GelNode* to = tile + ((k + 4 * z) * TileSize + j + 4 * y) * TileSize + 4 * x;
        if (block < 0)
          std::fill(to, to + (x ? 2 : 4), GelNode{});
        else
          std::copy_n(NodesOf(block) + (k * BlockSize + j) * BlockSize, x ? 2 : 4, to);
      }
  }
}

bool GelGrid::FillTileOf(int home, const std::vector<double>& values, double limit, double* tile) const
{
  double least = limit;
  for (int n = 0; n < 8; ++n) {
    const std::int32_t block = nodesAround_[static_cast<std::size_t>(home) * 8 + static_cast<std::size_t>(n)];
    const int x = n & 1, y = n >> 1 & 1, z = n >> 2;
    for (int k = 0; k < (z ? 2 : 4); ++k)
      for (int j = 0; j < (y ? 2 : 4); ++j) {
        double* to = tile + ((k + 4 * z) * TileSize + j + 4 * y) * TileSize + 4 * x;
        const double* from = block < 0 ? nullptr : values.data() + block * BlockNodes + (k * BlockSize + j) * BlockSize;
        for (int i = 0; i < (x ? 2 : 4); ++i) {
          to[i] = from ? from[i] : limit;
          least = std::min(least, to[i]);
        }
      }
  }
  return least < limit;
}

std::vector<GelParticle> GelGrid::InOrder(const std::vector<GelParticle>& particles) const
{
  std::vector<GelParticle> sorted;
  sorted.reserve(order_.size());
  for (const std::int32_t particle : order_)
    sorted.push_back(particles[static_cast<std::size_t>(particle)]);
  return sorted;
}

} // namespace echorama
