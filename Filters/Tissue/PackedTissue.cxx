// SPDX-License-Identifier: BSD-3-Clause
// Levels are chosen first, so that the count of triangles is known, and refused, before there is any. Then each sphere copies
// the mesh of its level, turned and scaled, to a place of its own, in parallel.
#include "PackedTissue.h"
#include "Core/Base/CheckRange.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Icosphere.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <Eigen/Geometry>
#include <string>

namespace echorama {
namespace {

using Eigen::Vector3d;

Icosphere MeshOf(int level, bool trueVolume)
{
  Icosphere mesh = Icosphere::Make(level);
  const double scale = trueVolume ? std::cbrt(4.1887902047863905 / mesh.Volume()) : 1.0;
  for (Vector3d& point : mesh.points)
    point *= scale;
  return mesh;
}

// Uniform over all rotations (Shoemake, Graphics Gems III, 1992).
Eigen::Matrix3d RandomRotation(Random& random)
{
  const double u = random.Uniform(), a = random.Uniform(0.0, 6.283185307179586), b = random.Uniform(0.0, 6.283185307179586);
  return Eigen::Quaterniond(std::sqrt(u) * std::cos(b), std::sqrt(1.0 - u) * std::sin(a), std::sqrt(1.0 - u) * std::cos(a),
                            std::sqrt(u) * std::sin(b))
      .toRotationMatrix();
}

} // namespace

std::vector<WeightedMaterial> PackedTissueParameters::DefaultMaterials()
{
  return {{StandardMaterial("lesion-dark"), 1.0},
          {StandardMaterial("liver"), 1.0},
          {StandardMaterial("lesion-bright"), 1.0},
          {StandardMaterial("cyst"), 0.5}};
}

ParameterList Describe(PackedTissueParameters& p)
{
  return {
      Parameter("CellMm", p.cell.mm, {0.01, 100}, "mm",
                "Resolution cell of the scan at the probe's face: it decides how fine meshes are."),
      Parameter("CellGrowth", p.cell.growth, {0, 1}, "", "How many mm the cell grows per mm of way from the probe.").Advanced(),
      Parameter("ProbePosition", p.cell.probe, {}, "mm", "Where the face of the probe is. It matters when the cell grows.")
          .Advanced(),
      Parameter("Deviation", p.deviation, {0.001, 10}, "",
                "How far triangles may leave their sphere, as a part of the cell there.")
          .Advanced(),
      Parameter(
          "TrueVolume", p.trueVolume,
          "Whether meshes have the volume of their spheres; corners then lie a bit outside, and spheres that touch overlap. "
          "Else corners lie on the spheres.")
          .Advanced(),
      Parameter("Turned", p.turned,
                "Whether each mesh is turned at random, so that not all have a triangle that faces the probe.")
          .Advanced(),
      Parameter("MaxTriangles", p.maxTriangles, {20, 1e8}, "", "More triangles are refused, with the count that it would take.")
          .Advanced(),
  };
}

void PackedTissueParameters::Check() const
{
  packing.Check();
  CheckRanges(*this);
  background.Check();
  double sum = 0.0;
  for (const WeightedMaterial& one : materials) {
    one.material.Check();
    CheckRange("the packed tissue's weight of \"" + one.material.name + "\"", one.weight, 0.0, 1e9);
    sum += one.weight;
  }
  if (!(sum > 0.0))
    throw Error(Error::Kind::InvalidParameter, "the packed tissue has no material with a weight above 0");
}

TissueSurface MeshSpheres(const PackedTissueParameters& parameters, const std::vector<Sphere>& spheres, const Progress& progress)
{
  parameters.Check();
  std::vector<int> levels(spheres.size());
  std::array<bool, Icosphere::maxLevel + 1> used{};
  std::vector<std::size_t> firstPoint(spheres.size() + 1), firstTriangle(spheres.size() + 1);
  for (std::size_t i = 0; i < spheres.size(); ++i) {
    levels[i] = Icosphere::LevelFor(spheres[i].radius, parameters.deviation * parameters.cell.At(spheres[i].centre));
    used[static_cast<std::size_t>(levels[i])] = true;
    const std::size_t faces = std::size_t{20} << 2 * levels[i];
    firstPoint[i + 1] = firstPoint[i] + faces / 2 + 2;
    firstTriangle[i + 1] = firstTriangle[i] + faces;
  }
  if (firstTriangle.back() > static_cast<std::size_t>(parameters.maxTriangles))
    throw Error(Error::Kind::TooLarge, std::to_string(spheres.size()) + " spheres take " + std::to_string(firstTriangle.back()) +
                                           " triangles, more than MaxTriangles (" + std::to_string(parameters.maxTriangles) +
                                           "); raise the cell or the deviation");

  TissueSurface surface;
  surface.MaterialIndex(parameters.background);
  std::vector<int> materialIndex;
  std::vector<double> upTo; // sums of the weights
  for (const WeightedMaterial& one : parameters.materials) {
    materialIndex.push_back(surface.MaterialIndex(one.material));
    upTo.push_back((upTo.empty() ? 0.0 : upTo.back()) + one.weight);
  }
  std::array<Icosphere, Icosphere::maxLevel + 1> models;
  for (int level = 0; level <= Icosphere::maxLevel; ++level)
    if (used[static_cast<std::size_t>(level)])
      models[static_cast<std::size_t>(level)] = MeshOf(level, parameters.trueVolume);

  surface.points.resize(firstPoint.back());
  surface.triangles.resize(firstTriangle.back());
  surface.bodyOfTriangle.resize(firstTriangle.back());
  surface.bodies.resize(spheres.size());
  ParallelRanges(static_cast<std::ptrdiff_t>(spheres.size()), 256, progress, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      Random random(parameters.packing.seed, 2 + i); // 0 and 1 are the packing's
      const double drawn = random.Uniform(0.0, upTo.back());
      const auto which = static_cast<std::size_t>(std::upper_bound(upTo.begin(), upTo.end(), drawn) - upTo.begin());
      surface.bodies[i].material = materialIndex[std::min(which, materialIndex.size() - 1)];
      const Icosphere& model = models[static_cast<std::size_t>(levels[i])];
      Eigen::Matrix3d linear = parameters.turned ? RandomRotation(random) : Eigen::Matrix3d::Identity();
      linear *= spheres[i].radius;
      for (std::size_t j = 0; j < model.points.size(); ++j)
        surface.points[firstPoint[i] + j] = (spheres[i].centre + linear * model.points[j]).cast<float>();
      const auto offset = static_cast<std::uint32_t>(firstPoint[i]);
      for (std::size_t j = 0; j < model.triangles.size(); ++j) {
        const auto& [a, b, c] = model.triangles[j];
        surface.triangles[firstTriangle[i] + j] = {a + offset, b + offset, c + offset};
        surface.bodyOfTriangle[firstTriangle[i] + j] = static_cast<std::int32_t>(i);
      }
    }
  });
  return surface;
}

PackedTissue MakePackedTissue(const PackedTissueParameters& parameters, const Progress& progress)
{
  parameters.Check();
  PackedTissue tissue;
  tissue.packing = PackSpheres(parameters.packing, progress.Part(0.0, 0.8));
  tissue.surface = MeshSpheres(parameters, tissue.packing.spheres, progress.Part(0.8, 1.0));
  return tissue;
}

} // namespace echorama
