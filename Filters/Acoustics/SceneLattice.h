// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "BodySet.h"
#include "Core/Base/Progress.h"
#include "SceneShells.h"

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
  Eigen::Vector3d Middle(int i, int j, int k) const
  {
    return low_ + size_.cwiseProduct(Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5));
  }

  std::array<int, 3> cells_{0, 0, 0};
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();                               // of the scene, world
  Eigen::Vector3d low_ = Eigen::Vector3d::Zero(), size_ = Eigen::Vector3d::Ones(); // of a cell, about the centre
  std::vector<std::int32_t> setOf_; // twice the index of the set in the middle, plus one where a surface may pass
  std::vector<BodySet> sets_;
  std::vector<std::int32_t> media_; // of the sets
};

} // namespace echorama
