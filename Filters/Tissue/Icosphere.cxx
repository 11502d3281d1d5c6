// SPDX-License-Identifier: BSD-3-Clause
// Each level cuts every triangle into four at the middles of its edges, which are pushed out to the sphere. The triangle in the
// middle of a face of the icosahedron stays the largest, so that the deviation of a level is found on its way alone, without
// a mesh.
#include "Icosphere.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include <cmath>
#include <Eigen/Geometry>
#include <string>
#include <unordered_map>
#include <utility>

namespace echorama {
namespace {

using Eigen::Vector3d;

// Corners in the order of cyclic permutations of (0, +-1, +-golden ratio); faces are the triples of neighbours.
Icosphere Icosahedron()
{
  Icosphere mesh;
  const double golden = 0.5 * (1.0 + std::sqrt(5.0));
  for (int axis = 0; axis < 3; ++axis)
    for (const double one : {-1.0, 1.0})
      for (const double longer : {-golden, golden}) {
        Vector3d corner = Vector3d::Zero();
        corner[(axis + 1) % 3] = one;
        corner[(axis + 2) % 3] = longer;
        mesh.points.push_back(corner.normalized());
      }
  const auto near = [&mesh](std::uint32_t a, std::uint32_t b) { return (mesh.points[a] - mesh.points[b]).norm() < 1.2; };
  for (std::uint32_t a = 0; a < 12; ++a)
    for (std::uint32_t b = a + 1; b < 12; ++b)
      for (std::uint32_t c = b + 1; c < 12; ++c)
        if (near(a, b) && near(b, c) && near(c, a)) {
          const bool outward = mesh.points[a].dot(mesh.points[b].cross(mesh.points[c])) > 0.0;
          mesh.triangles.push_back(outward ? std::array<std::uint32_t, 3>{a, b, c} : std::array<std::uint32_t, 3>{a, c, b});
        }
  return mesh;
}

void Subdivide(Icosphere& mesh)
{
  std::unordered_map<std::uint64_t, std::uint32_t> middles;
  middles.reserve(mesh.triangles.size() * 3 / 2);
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    if (a > b)
      std::swap(a, b);
    const auto [found, isNew] = middles.try_emplace(std::uint64_t{a} << 32 | b, static_cast<std::uint32_t>(mesh.points.size()));
    if (isNew)
      mesh.points.push_back((mesh.points[a] + mesh.points[b]).normalized());
    return found->second;
  };
  std::vector<std::array<std::uint32_t, 3>> finer;
  finer.reserve(4 * mesh.triangles.size());
  mesh.points.reserve(mesh.points.size() + mesh.triangles.size() * 3 / 2);
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  mesh.triangles.swap(finer);
}

} // namespace

Icosphere Icosphere::Make(int level)
{
  if (level < 0 || level > maxLevel)
    throw Error(Error::Kind::InvalidParameter, "the level of an icosphere is " + std::to_string(level) + "; it must be in [0, " +
                                                   std::to_string(maxLevel) + "]");
  Icosphere mesh = Icosahedron();
  for (int done = 0; done < level; ++done)
    Subdivide(mesh);
  return mesh;
}

double Icosphere::Volume() const
{
  double sixfold = 0.0;
  for (const auto& [a, b, c] : triangles)
    sixfold += points[a].dot(points[b].cross(points[c]));
  return sixfold / 6.0;
}

double Icosphere::Deviation(int level)
{
  static const Icosphere start = Icosahedron();
  Vector3d a = start.points[start.triangles[0][0]], b = start.points[start.triangles[0][1]],
           c = start.points[start.triangles[0][2]];
  for (int done = 0; done < level; ++done) {
    const Vector3d ab = (a + b).normalized(), bc = (b + c).normalized(), ca = (c + a).normalized();
    a = ab, b = bc, c = ca;
  }
  return 1.0 - (b - a).cross(c - a).normalized().dot(a);
}

int Icosphere::LevelFor(double radiusMm, double deviationMm)
{
  if (!(radiusMm > 0.0) || !(deviationMm > 0.0))
    throw Error(Error::Kind::InvalidParameter, "an icosphere of radius " + NumberText(radiusMm) + " mm that deviates by " +
                                                   NumberText(deviationMm) + " mm; both must be above 0");
  int level = 0;
  while (level < maxLevel && radiusMm * Deviation(level) > deviationMm)
    ++level;
  return level;
}

} // namespace echorama
