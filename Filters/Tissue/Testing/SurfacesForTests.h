// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Bodies of a few triangles.
#include "Filters/Tissue/TissueSurface.h"
#include <array>
#include <cmath>
#include <Eigen/Core>
#include <map>
#include <string>
#include <utility>

namespace echorama::testing {

/// A tissue of one background.
inline TissueSurface Background(const Material& material)
{
  TissueSurface surface;
  surface.materials = {material};
  return surface;
}

inline int AddBody(TissueSurface& surface, const Material& material)
{
  surface.bodies.push_back({"", surface.MaterialIndex(material)});
  return static_cast<int>(surface.bodies.size()) - 1;
}

inline void AddTriangle(TissueSurface& surface, int body, std::uint32_t a, std::uint32_t b, std::uint32_t c,
                        bool insideOut = false)
{
  surface.triangles.push_back(insideOut ? std::array<std::uint32_t, 3>{a, c, b} : std::array<std::uint32_t, 3>{a, b, c});
  surface.bodyOfTriangle.push_back(body);
}

/// Twelve triangles of an existing body.
inline void AddBox(TissueSurface& surface, int body, const Eigen::Vector3f& low, const Eigen::Vector3f& high,
                   bool insideOut = false)
{
  const auto first = static_cast<std::uint32_t>(surface.points.size());
  for (int corner = 0; corner < 8; ++corner)
    surface.points.emplace_back(corner & 1 ? high[0] : low[0], corner & 2 ? high[1] : low[1], corner & 4 ? high[2] : low[2]);
  static constexpr std::uint32_t faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                                {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& face : faces) {
    AddTriangle(surface, body, first + face[0], first + face[1], first + face[2], insideOut);
    AddTriangle(surface, body, first + face[0], first + face[2], first + face[3], insideOut);
  }
}

inline int AddBox(TissueSurface& surface, const Material& material, const Eigen::Vector3f& low, const Eigen::Vector3f& high)
{
  const int body = AddBody(surface, material);
  AddBox(surface, body, low, high);
  return body;
}

/// 8 * 4^level triangles of an existing body, with corners on the sphere.
inline void AddSphere(TissueSurface& surface, int body, const Eigen::Vector3d& centre, double radius, int level = 4,
                      bool insideOut = false)
{
  std::vector<Eigen::Vector3d> points{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  std::vector<std::array<std::uint32_t, 3>> triangles{{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                                      {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int i = 0; i < level; ++i) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [found, isNew] = middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(points.size()));
      if (isNew) {
        const Eigen::Vector3d point = (points[a] + points[b]).normalized();
        points.push_back(point);
      }
      return found->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& [a, b, c] : triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    triangles = std::move(finer);
  }
  const auto first = static_cast<std::uint32_t>(surface.points.size());
  for (const Eigen::Vector3d& point : points)
    surface.points.push_back((centre + radius * point).cast<float>());
  for (const auto& [a, b, c] : triangles)
    AddTriangle(surface, body, first + a, first + b, first + c, insideOut);
}

inline int AddSphere(TissueSurface& surface, const Material& material, const Eigen::Vector3d& centre, double radius,
                     int level = 4)
{
  const int body = AddBody(surface, material);
  AddSphere(surface, body, centre, radius, level);
  return body;
}

/// A material of a name, a speed of sound and a density, clear and smooth, without attenuation.
inline Material Clear(const std::string& name, double soundSpeed, double density)
{
  Material material;
  material.name = name;
  material.soundSpeed = soundSpeed;
  material.density = density;
  material.attenuation = 0.0;
  material.scattererDensity = 0.0;
  material.scatterProbability = 0.0;
  return material;
}

} // namespace echorama::testing
