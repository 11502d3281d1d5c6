// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parallel.h"
#include "Filters/Physics/GelMaterial.h"
#include <array>
#include <cstdint>
#include <Eigen/Geometry>
#include <memory>
#include <vector>

namespace echorama {

/// Where gel may be: a box of cubic cells. Gel that leaves it is gone, except across a periodic face.
struct GelDomain {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero(); ///< mm, the lowest corner of cell 0
  std::array<int, 3> cells{0, 0, 0};                ///< a multiple of 4 along periodic axes
  std::array<int, 3> from{0, 0, 0};                 ///< the lowest cell: a multiple of 4, 0 along periodic axes
  double cellMm = 1.0;
  std::array<bool, 3> periodic{false, false, false};
  /// \throws Error(InvalidParameter), Error(TooLarge) beyond some 16 million blocks of 4^3 cells
  void Check() const;
  /// This one and, by whole blocks along axes that are not periodic, what more a box needs. Cells stay where they are.
  GelDomain With(const Eigen::AlignedBox3d& box) const;
};

/// A piece of gel. Its size is that of three cache lines.
struct GelParticle {
  double position[3]; ///< mm
  double velocity[3]; ///< mm/s
  double gradient[9]; ///< of the velocity, 1/s, row by row
  GelStrain strain;
  double volume;           ///< mm^3 at rest
  std::int32_t block = -1; ///< where it is found; -1 once it has left the domain
  std::int32_t id = 0;     ///< the number that it was made with
};

/// Velocities at the nodes of one block: x, y, z, and the mass in g.
struct alignas(32) GelNode {
  double value[4];
};

/// The grid of one step: nodes in blocks of 4^3, only where there are particles.
///
/// A particle touches 3^3 nodes (quadratic B-splines). Particles are worked on by the block of the lowest of them, so that all
/// nodes of a block's particles lie in a tile of 6^3. Each block adds into a tile of its own; a node then is the sum over the at
/// most eight tiles that hold it, in a fixed order: no colours, no atomics, one result for any number of threads.
class GelGrid {
public:
  static constexpr int BlockSize = 4, BlockNodes = 64, TileSize = 6, TileNodes = 216;

  explicit GelGrid(const GelDomain& domain);

  const GelDomain& Domain() const { return domain_; }

  /// The block of a position, which is wrapped along periodic axes first; -1 outside.
  std::int32_t BlockOf(double* position) const;

  /// Lays out blocks for particles that know theirs, and sorts these.
  void Sort(const std::vector<GelParticle>& particles);

  ///@{
  /// Blocks with particles, and the particles of each.
  int Homes() const { return static_cast<int>(homes_.size()); }
  const std::int32_t* ParticlesOf(int home) const { return order_.data() + start_[static_cast<std::size_t>(home)]; }
  int CountOf(int home) const { return start_[static_cast<std::size_t>(home) + 1] - start_[static_cast<std::size_t>(home)]; }
  /// The lowest node of its tile, in cells.
  std::array<int, 3> CornerOf(int home) const { return CornerOfBlock(homes_[static_cast<std::size_t>(home)]); }
  GelNode* TileOf(int home) { return tiles_.data() + static_cast<std::size_t>(home) * TileNodes; }
  ///@}

  ///@{
  /// Blocks with nodes.
  int Blocks() const { return static_cast<int>(blocks_.size()); }
  std::array<int, 3> CornerOfNodes(int block) const { return CornerOfBlock(blocks_[static_cast<std::size_t>(block)]); }
  GelNode* NodesOf(int block) { return nodes_.data() + static_cast<std::size_t>(block) * BlockNodes; }
  /// The node at a place in cells, wrapped along periodic axes; nullptr where there are no nodes.
  GelNode* NodeAt(const std::array<int, 3>& place);
  /// Adds up the tiles: NodesOf(block) is all momenta and masses.
  void SumTiles(int block);
  /// The other way: TileOf(home) is what its nodes hold.
  void FillTile(int home);
  /// The same of other values of nodes, GelGrid::BlockNodes for each block. \returns whether any is below \a limit
  bool FillTileOf(int home, const std::vector<double>& values, double limit, double* tile) const;
  ///@}

  /// The particles in the order in which their blocks lie in memory; those that are gone are left out.
  std::vector<GelParticle> InOrder(const std::vector<GelParticle>& particles) const;

private:
  std::array<int, 3> CornerOfBlock(std::int32_t block) const;
  // The block that lies \a by blocks beside another, -1 beyond the domain.
  std::int32_t Beside(std::int32_t block, const std::array<int, 3>& by) const;

  GelDomain domain_;
  std::array<int, 3> size_; // in blocks
  double perCell_;
  std::vector<std::int32_t> homes_, blocks_, start_, order_;
  std::vector<std::int32_t> count_, homeOf_, nodesOf_;  // for every block of the domain
  std::vector<std::int32_t> homesAround_, nodesAround_; // eight each: of blocks, of homes
  std::vector<GelNode> tiles_, nodes_;
};

} // namespace echorama
