// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Scatterers.h"
#include <cstdint>
#include <map>
#include <memory>
#include <unordered_map>
#include <vector>

namespace echorama {

/// Scatterers of one tissue that are kept from one Scatterers::Make to the next, for a probe that moves on by little: only what
/// is new before it is made, and the result is the same to the last bit.
///
/// With other parameters or materials all that was kept is dropped. Where the materials lie, and the numbers in a displacement,
/// must stay the same. Not thread safe.
class ScattererCache {
public:
  /// \param maxBytes beyond it, what was not used for longest is dropped; what the last call needed stays
  explicit ScattererCache(double maxBytes = 1e9) : maxBytes_(maxBytes) {}

  std::size_t Bytes() const { return bytes_; }

private:
  friend class Scatterers;

  // What one task made, of consecutive blocks of the lattice.
  struct Part {
    Scatterers::Memory memory;
    std::vector<Eigen::Array3i> blocks;
    std::int64_t used = 0; // by which call, the last time
    std::size_t Bytes() const;
  };
  struct Kept {
    Scatterers::Brick brick; // count 0: the block has no scatterer
    std::int64_t part = 0;
  };
  struct Hash {
    std::size_t operator()(const Eigen::Array3i& block) const;
  };
  struct Equal {
    bool operator()(const Eigen::Array3i& a, const Eigen::Array3i& b) const { return (a == b).all(); }
  };

  /// What follows is of scatterers that depend on these numbers.
  void Begin(std::vector<std::uint64_t> key);
  std::vector<Eigen::Array3i> Missing(const std::vector<Eigen::Array3i>& blocks) const;
  /// One brick of every block, all in one memory.
  void Add(const Eigen::Array3i* blocks, const std::vector<Scatterers::Brick>& bricks, Scatterers::Memory memory);
  /// The bricks of blocks that are all kept, in the order of the blocks, and the memory that they lie in.
  void Use(const std::vector<Eigen::Array3i>& blocks, std::vector<Scatterers::Brick>& bricks,
           std::vector<Scatterers::Memory>& memory);

  std::vector<const Kept*> Find(const std::vector<Eigen::Array3i>& blocks) const;
  void Shrink();

  double maxBytes_;
  std::vector<std::uint64_t> key_;
  std::unordered_map<Eigen::Array3i, Kept, Hash, Equal> kept_;
  std::map<std::int64_t, Part> parts_;
  std::int64_t nextPart_ = 0, call_ = 0;
  std::size_t bytes_ = 0;
};

} // namespace echorama
