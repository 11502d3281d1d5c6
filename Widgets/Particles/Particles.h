// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Imaging/VolumeView.h"
#include <array>
#include <cstdint>
#include <vector>

namespace echorama {

/// How a volume becomes particles (dissertation 4.3).
struct ParticleParameters {
  int downsampling = 2;      ///< one particle per block of so many voxels along each axis, [1, 64]
  double opacity = 0.3;      ///< of each particle, [0, 1]
  bool valueOpacity = true;  ///< opacity times grey level: dark regions become transparent
  double minimum = 1.0, maximum = 1e300; ///< grey levels that are shown
  double black = 0.0, white = 255.0;     ///< of the display
  int budget = 2000000; ///< at most so many: beyond, downsampling grows
  void Check() const;
};

struct Particles {
  std::vector<float> positions;     ///< x y z in the physical space of the volume's file, mm
  std::vector<std::uint8_t> values; ///< grey level through the window, 0 to 255
  std::vector<std::uint8_t> alphas; ///< opacity, 0 to 255
  float sizeMm = 0.0f;              ///< side of a block: the size at which particles touch
  int downsampling = 1;             ///< what was used
};

template <class T>
Particles MakeParticles(const PosedVolume<T>& volume, const ParticleParameters& parameters, const Progress& progress = {});

/// The order of particles from back to front along a viewing direction: a counting sort of 16-bit depths.
std::vector<std::uint32_t> BackToFront(const std::vector<float>& positions, const Eigen::Vector3d& towardsViewer);

} // namespace echorama
