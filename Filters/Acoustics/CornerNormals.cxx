// SPDX-License-Identifier: BSD-3-Clause
#include "CornerNormals.h"
#include "Core/Base/Angles.h"
#include <cmath>
#include <Eigen/Geometry>

namespace echorama {
namespace {

using Corners = std::array<std::uint32_t, 3>;

constexpr std::uint32_t flatCorner = 0xffffffffu; // stands for the normal of the triangle itself
constexpr CornerNormals flatTriangle{flatCorner, flatCorner, flatCorner};

// A unit vector in 32 bits, right to 4e-5: the octahedron unfolded into a square.
constexpr float packSteps = 65534.0f;

std::uint32_t Packed(const Eigen::Vector3f& normal)
{
  const Eigen::Vector3f n = normal / normal.lpNorm<1>();
  float u = n[0], v = n[1];
  if (n[2] < 0.0f) {
    u = std::copysign(1.0f - std::abs(n[1]), n[0]);
    v = std::copysign(1.0f - std::abs(n[0]), n[1]);
  }
  const auto bits = [](float x) { return static_cast<std::uint32_t>(std::lround((0.5f * x + 0.5f) * packSteps)); };
  return bits(u) << 16 | bits(v);
}

Eigen::Vector3f Unpacked(std::uint32_t bits)
{
  const auto number = [](std::uint32_t x) { return 2.0f / packSteps * static_cast<float>(x) - 1.0f; };
  const float u = number(bits >> 16), v = number(bits & 0xffffu), w = 1.0f - std::abs(u) - std::abs(v);
  const float fold = std::max(-w, 0.0f);
  return Eigen::Vector3f(u - std::copysign(fold, u), v - std::copysign(fold, v), w).normalized();
}

} // namespace

std::vector<CornerNormals> MakeCornerNormals(const std::vector<Eigen::Vector3f>& points, const std::vector<Corners>& triangles,
                                             const std::vector<std::uint32_t>& kept, double creaseDegrees)
{
  std::vector<CornerNormals> result(kept.size(), flatTriangle);
  if (!(creaseDegrees > 0.0))
    return result;
  std::vector<Eigen::Vector3f> normals(points.size(), Eigen::Vector3f::Zero());
  const auto normalOf = [&points](const Corners& t) -> Eigen::Vector3f {
    return (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]);
  };
  for (const Corners& triangle : triangles) {
    const Eigen::Vector3f normal = normalOf(triangle);
    for (const std::uint32_t corner : triangle)
      normals[corner] += normal;
  }
  for (Eigen::Vector3f& normal : normals)
    normal.normalize();
  const auto least = static_cast<float>(std::cos(RadiansPerDegree * creaseDegrees));
  std::vector<bool> edged(normals.size(), false);
  for (const Corners& triangle : triangles) {
    const Eigen::Vector3f normal = normalOf(triangle).normalized();
    for (const std::uint32_t corner : triangle)
      if (normals[corner].dot(normal) < least && normal.squaredNorm() > 0.5f)
        edged[corner] = true;
  }
  constexpr float plane = 1.0f - 1e-6f; // so flat that the triangle's own normal is more exact
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const Corners& triangle = triangles[kept[i]];
    const Eigen::Vector3f normal = normalOf(triangle).normalized();
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::uint32_t point = triangle[corner];
      const bool curved = !edged[point] && normals[point].squaredNorm() > 0.5f && normals[point].dot(normal) < plane;
      result[i][corner] = curved ? Packed(normals[point]) : flatCorner;
    }
  }
  return result;
}

std::pair<Eigen::Vector3d, Eigen::Vector3d> NormalsAt(const CornerNormals& corners, const Eigen::Vector3d& flat, float u, float v,
                                                      const Eigen::Vector3d& direction)
{
  const double side = flat.dot(direction) > 0.0 ? -1.0 : 1.0;
  const Eigen::Vector3d facet = side * flat;
  if (corners == flatTriangle)
    return {facet, facet};
  const float weights[] = {1.0f - u - v, u, v};
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < 3; ++i)
    sum += static_cast<double>(weights[i]) *
           (corners[i] == flatCorner ? flat : Eigen::Vector3d(Unpacked(corners[i]).cast<double>()));
  const Eigen::Vector3d curved = side * sum.normalized();
  // At grazing angles a ray may come from behind the curved normal, or be mirrored into the triangle: flat, then.
  const double cosine = -curved.dot(direction);
  return {facet, cosine > 0.0 && (direction + 2.0 * cosine * curved).dot(facet) > 0.0 ? curved : facet};
}

} // namespace echorama
