// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Tissue/SurfaceCheck.h"
#include "Filters/Tissue/TriangleTree.h"
#include <optional>
#include <vector>

namespace echorama {

/// A border of a surface that is not closed.
struct SurfaceHole {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero(); ///< of its points
  double lengthMm = 0.0;                            ///< all around
  std::size_t edges = 0;
};

/// The holes of a surface, longest first. Those that touch in a point count as one.
std::vector<SurfaceHole> HolesOf(const TriangleSurface& surface);

/// The surface of a body that can be asked how far anything is from it.
class BodySurface {
public:
  /// Points that files repeat are welded, and triangles turned to one side; nothing else is mended.
  /// \throws Error(BadInput) when there is no triangle, a point is not finite or further than 1e5 mm from the origin, or the
  /// surface is not that of a body: holes are named with their number, places and lengths, and so is everything else that is
  /// wrong
  explicit BodySurface(TriangleSurface surface, const Progress& progress = {});

  struct Place {
    Eigen::Vector3d nearest; ///< on the surface
    double distanceMm;       ///< negative inside
    Eigen::Vector3d away;    ///< unit: which way the distance grows fastest
  };
  /// Exact, by the normals about the nearest point (Baerentzen and Aanaes, IEEE TVCG 2005).
  Place PlaceOf(const Eigen::Vector3d& point) const;
  double Distance(const Eigen::Vector3d& point) const { return PlaceOf(point).distanceMm; }

  /// How far a ray goes before it meets the surface.
  std::optional<double> Along(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

  const TriangleSurface& Surface() const { return surface_; }
  const Eigen::AlignedBox3d& Bounds() const { return bounds_; }

private:
  void FindNormals();

  TriangleSurface surface_;
  TriangleTree tree_;
  Eigen::AlignedBox3d bounds_;
  std::vector<Eigen::Vector3f> pointNormals_;
  std::vector<std::array<Eigen::Vector3f, 3>> edgeNormals_; ///< of each triangle, by the corner that is not on the edge
};

} // namespace echorama
