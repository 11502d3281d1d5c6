// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Tissue/SurfaceCheck.h"
#include "Filters/Tissue/TriangleTree.h"
#include "Tracking/Optical/SeenSurface.h"
#include <vector>

namespace echorama {

/// The mesh that a camera inside looks at, and the skin that is touched: the same, or that outside of it by the thickness of the
/// wall. Questions may come from any number of threads.
class TrackedSkin : public SeenSurface {
public:
  /// \param skin what tools touch; closed or not; its triangles may face either side, but all the same one when \a wallMm is not
  /// 0: those of a body, or of its upper part, are then turned outwards \throws Error(BadInput) for no triangles, triangles of
  /// points that are not there, points that are not finite, or a wall whose triangles face different sides
  explicit TrackedSkin(TriangleSurface skin, double wallMm = 0.0);

  struct Place {
    Eigen::Vector3d point;  ///< of the skin, mm
    Eigen::Vector3d normal; ///< smoothed over the triangles, of length 1, as triangles face
    Eigen::Vector3d seen;   ///< what the camera sees of it
    double distanceMm;      ///< from where it was asked
  };
  /// Where a ray of the camera first meets what it sees.
  std::optional<Place> Along(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  /// The skin nearest to a point. Nothing when it is not finite.
  std::optional<Place> NearestTo(const Eigen::Vector3d& point) const;
  /// What SimulatedCamera asks: the triangle's own normal, against the ray.
  std::optional<Hit> FirstHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const override;

  const TriangleSurface& Surface() const { return skin_; }
  double WallMm() const { return wallMm_; }

private:
  Place PlaceOf(const SurfacePoint& at, double distanceMm) const;

  TriangleSurface skin_;
  double wallMm_;
  std::vector<Eigen::Vector3f> normals_, seen_;
  TriangleTree skinTree_, seenTree_;
};

} // namespace echorama
