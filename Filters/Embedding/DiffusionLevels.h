// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"
#include <array>
#include <vector>

namespace echorama {

/// What is done about a node of a lattice.
enum class DiffusionNode : unsigned char {
  Unused, ///< nobody asks for it
  Source, ///< it has the value of the source there
  Summed, ///< too near to the sources to be interpolated
  Coarse, ///< read from the next coarser lattice: copied, or interpolated
};

/// A lattice of nodes, some voxels apart; level 0 are the voxels. A coarser lattice reaches beyond the finer one, by as many
/// nodes as interpolation needs: D is there in all of space.
struct DiffusionLevel {
  std::array<int, 3> size;                          ///< nodes
  std::array<int, 3> step{1, 1, 1};                 ///< voxels from node to node
  std::array<int, 3> first{0, 0, 0};                ///< the voxel of node 0, < 0 beyond the grid
  std::array<bool, 3> doubled{false, false, false}; ///< axes along which the next finer level has twice as many nodes
  double reach = 0.0;                ///< nodes of the next finer level this far from all sources are interpolated, mm
  Volume<unsigned char> nodes;       ///< DiffusionNode
  std::vector<Volume<float>> values; ///< per channel; none on level 0

  std::array<int, 3> Voxel(int i, int j, int k) const
  {
    return {first[0] + i * step[0], first[1] + j * step[1], first[2] + k * step[2]};
  }
};

/// The lattices for a grid: level 0, and coarser ones until the next would be of no use.
/// \param stepsPerNode nodes are interpolated at this many (coarse) steps from the sources
/// \param farthest the largest distance of a voxel to its nearest source, mm
std::vector<DiffusionLevel> MakeDiffusionLevels(const std::array<int, 3>& grid, const Eigen::Vector3d& spacing,
                                                double stepsPerNode, double farthest, int channels);

/// Says what is done about every node of every level. nodes of level 0 are Summed (wanted) or Unused when it begins.
/// \param squaredDistance of each voxel to the nearest source, mm^2
void PlanDiffusionLevels(std::vector<DiffusionLevel>& levels, const Eigen::Vector3d& spacing,
                         VolumeView<const float> squaredDistance, const Progress& progress);

/// Copies and interpolates the Coarse nodes of \a fine.
/// \param result of the fine level: value + \a offset, within [least, most]
void RefineDiffusionLevel(const DiffusionLevel& coarse, const DiffusionLevel& fine, std::size_t channel, VolumeView<float> result,
                          float offset, float least, float most, const Progress& progress);

} // namespace echorama
