// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "SpherePacking.h"
#include "TissueSurface.h"
#include <cstdint>
#include <Eigen/Core>
#include <vector>

namespace echorama {

/// The size of what a scan can tell apart, as it grows with the way from the probe.
struct ResolutionCell {
  double mm = 1.0;                                 ///< at the probe's face, in [0.01, 100]
  double growth = 0.0;                             ///< mm more per mm of way, in [0, 1]
  Eigen::Vector3d probe = Eigen::Vector3d::Zero(); ///< where the face is, mm

  double At(const Eigen::Vector3d& point) const { return mm + growth * (point - probe).norm(); }
};

struct WeightedMaterial {
  Material material;
  double weight = 1.0; ///< its share beside the others', >= 0
};

/// Tissue of packed spheres, each a body of a random material. Source: dissertation 3.1.2.
struct PackedTissueParameters {
  SpherePackingParameters packing;
  Material background = StandardMaterial("tissue");
  std::vector<WeightedMaterial> materials = DefaultMaterials(); ///< at least one with a weight above 0
  ResolutionCell cell;
  double deviation = 0.25; ///< a mesh leaves its sphere by at most this part of the resolution cell there, in [0.001, 10]
  /// Corners lie on their spheres, so that bodies never overlap; or a bit outside, so that each mesh has its sphere's
  /// volume, and spheres that touch overlap by up to twice two thirds of the deviation allowed.
  bool trueVolume = false;
  bool turned = true;                   ///< each mesh is turned at random, so that triangles do not face the probe all at once
  std::int64_t maxTriangles = 10000000; ///< more are refused, in [20, 100 million]

  /// lesion-dark, liver and lesion-bright alike, and half as many cysts.
  static std::vector<WeightedMaterial> DefaultMaterials();

  /// Throws Error(InvalidParameter) that names the number which is out of its range.
  void Check() const;
};

struct PackedTissue {
  TissueSurface surface; ///< a body per sphere, in the order of the packing
  SpherePacking packing;
};

/// Packs spheres and meshes them. \throws what PackSpheres throws; Error(TooLarge) with the count that it would take when
/// there are more than maxTriangles.
PackedTissue MakePackedTissue(const PackedTissueParameters& parameters, const Progress& progress = {});

/// The meshing alone.
TissueSurface MeshSpheres(const PackedTissueParameters& parameters, const std::vector<Sphere>& spheres,
                          const Progress& progress = {});

} // namespace echorama
