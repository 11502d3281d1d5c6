// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Shell/Benchmarks/InventedAbdomen.h"
#include <cmath>
#include <Eigen/Geometry>
#include <map>

namespace echorama {
namespace {

using Eigen::Vector3d;

Vector3d OnAbdomen(const Vector3d& direction, double foldMm)
{
  const Vector3d d = direction.normalized();
  const Vector3d axes = d.z() > 0.0 ? Vector3d(150.0, 120.0, 120.0) : Vector3d(150.0, 120.0, 70.0); // the back is flatter
  double radius = 1.0 / d.cwiseQuotient(axes).norm();
  const double aside = std::acos(std::min(1.0, d.dot(Vector3d(-0.08, 0.0, 1.0).normalized())));
  radius -= 5.0 * std::exp(-aside * aside / (2.0 * 0.05 * 0.05));                                              // the navel
  radius += 6.0 * std::exp(-std::pow((d.x() - 0.55) / 0.2, 2)) * std::max(0.0, d.z()) * (1.0 - d.y() * d.y()); // an uneven belly
  radius -= foldMm * std::exp(-std::pow(110.0 * (aside - 0.6) / 2.0, 2));
  return radius * d;
}

} // namespace

TriangleSurface InventedAbdomen(int divisions, double foldMm)
{
  TriangleSurface surface;
  std::map<std::array<int, 3>, std::uint32_t> numbers;
  const auto point = [&](const std::array<int, 3>& at) {
    const auto [found, isNew] = numbers.emplace(at, static_cast<std::uint32_t>(surface.points.size()));
    if (isNew) {
      Vector3d place;
      for (int axis = 0; axis < 3; ++axis) // tangents: cells of nearly one size
        place[axis] = std::tan(0.7853981633974483 * (2.0 * at[static_cast<std::size_t>(axis)] / divisions - 1.0));
      surface.points.push_back(OnAbdomen(place, foldMm).cast<float>());
    }
    return found->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const int side : {0, divisions})
      for (int v = 0; v < divisions; ++v)
        for (int u = 0; u < divisions; ++u) {
          const auto corner = [&](int du, int dv) {
            std::array<int, 3> at{};
            at[axis] = side;
            at[(axis + 1) % 3] = u + du;
            at[(axis + 2) % 3] = v + dv;
            return point(at);
          };
          const std::uint32_t a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
          if (side == 0) {
            surface.triangles.push_back({a, c, b});
            surface.triangles.push_back({a, d, c});
          } else {
            surface.triangles.push_back({a, b, c});
            surface.triangles.push_back({a, c, d});
          }
        }
  return surface;
}

} // namespace echorama
