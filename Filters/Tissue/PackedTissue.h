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
  double mm = 1.0;
  double growth = 0.0;
  Eigen::Vector3d probe = Eigen::Vector3d::Zero();

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
  double deviation = 0.25;
  bool trueVolume = false; ///< spheres that touch then overlap by up to twice two thirds of the deviation allowed
  bool turned = true;
  std::int64_t maxTriangles = 10000000;

  /// lesion-dark, liver and lesion-bright alike, and half as many cysts.
  static std::vector<WeightedMaterial> DefaultMaterials();

  /// Throws Error(InvalidParameter) that names the number which is out of its range, and what SpherePackingParameters::Check
  /// throws; also when no material has a weight.
  void Check() const;
};

/// What decides the meshes; not the packing and the materials.
ParameterList Describe(PackedTissueParameters& p);

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
