// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Optical/SurfaceMap.h"

namespace echorama {

/// The map of the dissertation, 7.6: marks are the corners of a coarse mesh, the proxy. A pixel lies in one of its triangles in
/// the picture; the same place of that triangle in space (barycentric weights), seen from the camera, is on the skin. It needs no
/// lens, but weights in the picture are not those in space: it is there to compare with. Questions may come from any thread.
class ProxyMap {
public:
  /// \param proxy whose point i was seen at \a pixels[i]; not finite: not seen, and none of its triangles are
  /// \param eye where the camera is: the "origin" of 7.6
  /// \throws Error(BadInput) when numbers do not agree, or no triangle was seen
  ProxyMap(TriangleSurface proxy, std::vector<Eigen::Vector2d> pixels, const Eigen::Vector3d& eye,
           std::shared_ptr<const TrackedSkin> skin);

  /// As SurfaceMap::Map(); the covariance is that of the pixel alone. Not covered: in no triangle. Where several triangles hold
  /// the pixel, that nearest to the eye counts.
  MappedPoint Map(const Eigen::Vector2d& pixel, const Eigen::Matrix2d& covariance = Eigen::Matrix2d::Zero()) const;

private:
  TriangleSurface proxy_;
  std::vector<Eigen::Vector2d> pixels_;
  Eigen::Vector3d eye_;
  std::shared_ptr<const TrackedSkin> skin_;
};

} // namespace echorama
