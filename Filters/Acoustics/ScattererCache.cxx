// SPDX-License-Identifier: BSD-3-Clause
// A table from blocks of the lattice to bricks. Memory is held by the parts that tasks made at once, and given back part by part.
// Cost: one look-up (some 50 ns) for each block that a call needs, of about 2 mm.
#include "ScattererCache.h"
#include "Core/Base/Parallel.h"
#include <algorithm>

namespace echorama {

std::size_t ScattererCache::Part::Bytes() const
{
  constexpr std::size_t perBlock = sizeof(Eigen::Array3i) + sizeof(std::pair<Eigen::Array3i, Kept>) + 4 * sizeof(void*); // about
  return memory->capacity() * sizeof(float) + blocks.size() * perBlock;
}

std::size_t ScattererCache::Hash::operator()(const Eigen::Array3i& block) const
{
  std::uint64_t hash = 0;
  for (int axis = 0; axis < 3; ++axis)
    hash = (hash ^ static_cast<std::uint32_t>(block[axis])) * 0x9E3779B97F4A7C15u;
  return static_cast<std::size_t>(hash ^ hash >> 29);
}

void ScattererCache::Begin(std::vector<std::uint64_t> key)
{
  if (key == key_)
    return;
  key_ = std::move(key);
  kept_.clear();
  parts_.clear();
  bytes_ = 0;
}

std::vector<const ScattererCache::Kept*> ScattererCache::Find(const std::vector<Eigen::Array3i>& blocks) const
{
  std::vector<const Kept*> found(blocks.size());
  ParallelRanges(static_cast<std::ptrdiff_t>(blocks.size()), 4096, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      const auto place = kept_.find(blocks[i]);
      found[i] = place == kept_.end() ? nullptr : &place->second;
    }
  });
  return found;
}

std::vector<Eigen::Array3i> ScattererCache::Missing(const std::vector<Eigen::Array3i>& blocks) const
{
  const std::vector<const Kept*> found = Find(blocks);
  std::vector<Eigen::Array3i> missing;
  for (std::size_t i = 0; i < blocks.size(); ++i)
    if (!found[i])
      missing.push_back(blocks[i]);
  return missing;
}

void ScattererCache::Add(const Eigen::Array3i* blocks, const std::vector<Scatterers::Brick>& bricks, Scatterers::Memory memory)
{
  Part& part = parts_[nextPart_];
  part.memory = std::move(memory);
  part.blocks.assign(blocks, blocks + bricks.size());
  for (std::size_t i = 0; i < bricks.size(); ++i)
    kept_[blocks[i]] = {bricks[i], nextPart_};
  bytes_ += part.Bytes();
  ++nextPart_;
}

void ScattererCache::Use(const std::vector<Eigen::Array3i>& blocks, std::vector<Scatterers::Brick>& bricks,
                         std::vector<Scatterers::Memory>& memory)
{
  ++call_;
  std::unordered_map<std::int64_t, std::uint32_t> indexOf;
  for (const Kept* one : Find(blocks)) {
    const auto [place, isNew] = indexOf.try_emplace(one->part, static_cast<std::uint32_t>(memory.size()));
    if (isNew) {
      Part& part = parts_.at(one->part);
      part.used = call_;
      memory.push_back(part.memory);
    }
    if (one->brick.count > 0) {
      bricks.push_back(one->brick);
      bricks.back().part = place->second;
    }
  }
  Shrink();
}

void ScattererCache::Shrink()
{
  while (static_cast<double>(bytes_) > maxBytes_ && !parts_.empty()) {
    const auto oldest = std::min_element(parts_.begin(), parts_.end(),
                                         [](const auto& a, const auto& b) { return a.second.used < b.second.used; });
    if (oldest->second.used == call_)
      return;
    for (const Eigen::Array3i& block : oldest->second.blocks)
      kept_.erase(block);
    bytes_ -= oldest->second.Bytes();
    parts_.erase(oldest);
  }
}

} // namespace echorama
