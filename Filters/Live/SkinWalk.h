// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/RigidTransform.h"
#include "Filters/Live/SkinMesh.h"
#include <memory>

namespace echorama {

/// How a probe is held on its place on the skin: about the middle of its face. Radians.
struct ProbeHold {
  double tilt = 0.0;    ///< about the array (x): fanning
  double rock = 0.0;    ///< about the elevation (y), within the image plane: heel and toe
  double rotate = 0.0;  ///< about the probe's own axis (z), before the other two
  double pressMm = 0.0; ///< into the body along the skin's normal; negative: lifted off
};

/// A place on the skin and a direction there, moved along straight lines of the surface.
///
/// A step is a geodesic by unfolding: over every edge the next triangle is laid flat beside the last, so the way is straight and
/// its length is kept, whatever the mesh. A way through a point of the mesh passes it on one side. Place and direction belong to
/// the triangles; what is shown of them (Normal, Heading, PoseOf) has no jumps at edges, but at points of the mesh only as far as
/// the surface itself is smooth there: ways to both sides of a corner do differ in direction behind it.
class SkinWalk {
public:
  enum class Stop {
    None,   ///< all of the way was gone
    Border, ///< the surface ends here
    Knot,   ///< a point of the mesh where triangles turn without end
  };
  struct Moved {
    double mm = 0.0; ///< gone
    Stop stop = Stop::None;
  };

  /// On the first triangle that is not flat. \throws Error(BadInput) without a mesh
  explicit SkinWalk(std::shared_ptr<const SkinMesh> mesh);

  const SkinMesh& Mesh() const { return *mesh_; }
  const SurfacePoint& Place() const { return place_; }

  /// Puts it somewhere, with that direction along the surface that is nearest to \a heading; the one it has, if there is none.
  /// \throws Error(InvalidParameter) when there is no such triangle, it is flat, or weights are not those of a place on it
  void Put(const SurfacePoint& place, const Eigen::Vector3d& heading);
  /// To the nearest place, with its direction kept as far as may be. \throws Error(InvalidParameter) when it is not finite
  void PutNearest(const Eigen::Vector3d& point);
  /// To the first place that a ray meets. \returns false, and stays, when it meets none
  bool PutWhereHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction);

  /// Moves along the array (its direction) and across it (along the elevation, y of the probe), in a straight line.
  /// \throws Error(InvalidParameter) for what is not finite, or more than 1e4 mm
  Moved Step(double alongMm, double acrossMm);
  /// Turns the direction, counter-clockwise as the probe sees it: about its z, into the body. Radians.
  /// \throws Error(InvalidParameter)
  void Turn(double angle);

  Eigen::Vector3d Point() const { return mesh_->PointAt(place_); }
  Eigen::Vector3d Normal() const { return mesh_->NormalAt(place_); }
  /// Unit, perpendicular to Normal().
  Eigen::Vector3d Heading() const;
  /// ProbeToWorld: x along the direction, z into the body, and as it is held.
  Pose PoseOf(const ProbeHold& hold = {}) const;

private:
  int Cross(SkinMesh::Face& face, int edge, Eigen::Vector3d& direction);

  std::shared_ptr<const SkinMesh> mesh_;
  SurfacePoint place_;
  Eigen::Vector3d heading_; ///< unit, within the triangle
};

} // namespace echorama
