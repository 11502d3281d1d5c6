// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Filters/Physics/GelColliders.h"
#include "Filters/Tissue/TissueSurface.h"
#include <memory>

namespace echorama {

/// The surface of tissue as a solid that gel meets, in a frame of its own: known as far as a box that follows the gel.
class GelSkin {
public:
  /// \param frame to world. \throws Error(BadInput) as TissueSurface::Check
  GelSkin(const TissueSurface& tissue, const Pose& frame, double cellMm);

  /// The next part of a motion, in which tissue goes to \a next (nullptr: stays). Skin is known in \a box afterwards.
  /// \throws Error(BadInput) when \a next has other points or triangles, Error(Cancelled)
  void Move(const TissueSurface* next, Eigen::AlignedBox3d box, const Progress& progress = {});

  bool Yields() const { return moving_ != nullptr; } ///< in this part of the motion
  const std::shared_ptr<const GelShape>& Before() const { return before_; }
  const std::shared_ptr<const GelShape>& Moving() const { return moving_; }
  const std::shared_ptr<const GelShape>& Now() const { return now_; }
  const TissueSurface& Tissue() const { return tissue_; } ///< as it is now

private:
  TissueSurface tissue_;
  Pose frame_;
  double cellMm_;
  Eigen::AlignedBox3d known_;
  std::shared_ptr<const GelShape> before_, moving_, now_;
};

} // namespace echorama
