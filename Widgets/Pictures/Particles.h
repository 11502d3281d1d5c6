// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"
#include <cstdint>
#include <vector>

namespace echorama {

/// How a volume becomes particles (dissertation 4.3).
struct ParticleParameters {
  int downsampling = 2;                  ///< one particle per block of so many voxels along each axis, [1, 64]
  int block = 0;                         ///< level of detail: voxels along each axis of coarser blocks, >= downsampling; 0: none
  double opacity = 0.3;                  ///< of a particle of one block of `downsampling` voxels, [0, 1]
  bool valueOpacity = true;              ///< opacity times grey level: dark regions become transparent
  double minimum = 1.0, maximum = 1e300; ///< grey levels that are shown, both included
  double black = 0.0, white = 255.0;     ///< grey levels that are drawn black and white; black < white
  int budget = 2000000;                  ///< at most so many particles, >= 1: beyond, blocks grow
  /// Throws Error(InvalidParameter) that names the parameter and its range.
  void Check() const;
};

/// A volume as small cubes, in the order of their blocks (x fastest).
struct Particles {
  std::vector<float> positions;     ///< x y z: middles of the blocks in the space of the given geometry, mm
  std::vector<std::uint8_t> values; ///< grey level through the window, 0 to 255
  std::vector<std::uint8_t> alphas; ///< opacity, 1 to 255
  float sizeMm = 0.0f;              ///< side of a cube as large as a block: at this size particles touch
  int block = 1;                    ///< voxels along a block's side that were used
  std::size_t Count() const { return values.size(); }
};

/// The grey level of a particle is the mean of the real voxels of its block; a block without any gives no particle, nor does one
/// that would be invisible. Blocks at the far faces may be smaller. A block that is larger than asked for, by the coarsening or
/// by the budget, takes the opacity of as many layers, and one of which only a share is real takes the opacity of so much:
/// 1 - (1 - opacity)^(share * block / downsampling). Cost: one reading of the voxels.
/// Independent of the number of threads. \throws Error(InvalidParameter), Error(BadInput) for a geometry that is none or not the
/// voxels'.
template <class T>
Particles MakeParticles(const PosedVolume<T>& volume, const ParticleParameters& parameters, const Progress& progress = {});

/// A volume for volume rendering, of one byte per block.
struct DisplayVolume {
  Volume<unsigned char> values;                    ///< 0: nothing to show; 1 to 255: grey level through the window
  Eigen::Vector3d first = Eigen::Vector3d::Zero(); ///< index, in the voxels of the volume, of the middle of the first block
};

/// Of `parameters`, block, minimum, maximum, black and white are used. Blocks are whole ones, also at the far faces: the first
/// is centred on (block - 1) / 2 and the next lie `block` voxels apart. Cost, threads and errors as MakeParticles.
template <class T>
DisplayVolume MakeDisplayVolume(const PosedVolume<T>& volume, const ParticleParameters& parameters,
                                const Progress& progress = {});

/// The least box of indices that holds all real voxels; empty when there are none. Cost: one reading of the valid region.
template <class T>
Eigen::AlignedBox3i RealBox(const PosedVolume<T>& volume);

/// Some particles, and how far each lies towards the viewer: direction . position + offset.
struct ParticleDepths {
  const std::vector<float>* positions = nullptr;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double offset = 0.0;
};

/// The order of the particles of several sets, counted through, from back to front: a stable counting sort of 16-bit depths.
/// Sets that were moved need no moved copy of their positions: for a pose (R, t) and a direction d towards the viewer, the
/// direction is R^T d and the offset d . t. Independent of the number of threads.
std::vector<std::uint32_t> BackToFront(const std::vector<ParticleDepths>& sets);

} // namespace echorama
