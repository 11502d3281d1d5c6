// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "BodySet.h"
#include "Core/Base/Progress.h"
#include "SceneShells.h"
#include <atomic>
#include <limits>

namespace echorama {

class AcousticScene;

/// Cells that know the shells at their middle, and whether a surface may pass through them.
class SceneLattice {
public:
  SceneLattice() = default; ///< of an empty scene
  SceneLattice(const AcousticScene& scene, const SceneShells& parts, const Progress& progress);

  /// As in AcousticScene, of the same scene.
  void MediumAt(const AcousticScene& scene, const Eigen::Vector3f* points, std::size_t count, std::int32_t* materials) const;

  std::size_t Bytes() const;

private:
  static constexpr std::int32_t unknown = -1;

  // A medium that is found out when it is asked for first, by any thread.
  struct LazyMedium : std::atomic<std::int32_t> {
    LazyMedium() : std::atomic<std::int32_t>(unknown) {}
    LazyMedium(const LazyMedium& other) : std::atomic<std::int32_t>(other.load()) {}
  };

  // A cell that surfaces may pass through: all triangles in it lie between two planes.
  struct Pass {
    Eigen::Vector3f normal;                                                                             // of the planes
    float low = std::numeric_limits<float>::infinity(), high = -std::numeric_limits<float>::infinity(); // from the middle
    std::int32_t set = 0;                                                                               // in the middle
    mutable LazyMedium below, above;
  };

  void FindPasses(const AcousticScene& scene, const SceneShells& parts);
  std::int32_t MediumBehind(const AcousticScene& scene, const Pass& pass, const Eigen::Vector3d& middle, bool above) const;
  std::int32_t MediumByRay(const AcousticScene& scene, const Pass& pass, const Eigen::Vector3d& from,
                           const Eigen::Vector3d& local) const;

  Eigen::Vector3d Middle(int i, int j, int k) const
  {
    return low_ + size_.cwiseProduct(Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5));
  }

  std::array<int, 3> cells_{0, 0, 0};
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();                               // of the scene, world
  Eigen::Vector3d low_ = Eigen::Vector3d::Zero(), size_ = Eigen::Vector3d::Ones(); // of a cell, about the centre
  std::vector<std::int32_t> setOf_; // twice the index of the set in the middle, or of the pass and one more
  std::vector<BodySet> sets_;
  std::vector<std::int32_t> media_; // of the sets
  std::vector<Pass> passes_;
};

} // namespace echorama
