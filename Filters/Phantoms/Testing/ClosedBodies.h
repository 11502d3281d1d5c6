// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Tissue/TissueSurface.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Dense>
#include <string>
#include <utility>
#include <vector>

/// What tests ask of the bodies of a tissue, by plain counting: no kernel is trusted.
struct BodyShape {
  std::string name;
  bool closed = false;     ///< every edge is there once in each direction
  int euler = 0;           ///< points - edges + triangles: 2 for a sphere
  double volume = 0.0;     ///< mm^3, positive when triangles are counter-clockwise as seen from outside
  bool starShaped = true;  ///< all triangles face away from the mean of the points
  double thinnest = 1e300; ///< smallest sine of an angle at a triangle's first corner: 0 for a needle
  Eigen::AlignedBox3d box;
};

inline std::vector<BodyShape> ShapesOf(const echorama::TissueSurface& tissue)
{
  std::vector<BodyShape> shapes(tissue.bodies.size());
  std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> edges(shapes.size());
  std::vector<std::vector<std::size_t>> triangles(shapes.size());
  for (std::size_t i = 0; i < tissue.triangles.size(); ++i)
    triangles[static_cast<std::size_t>(tissue.bodyOfTriangle[i])].push_back(i);
  for (std::size_t b = 0; b < shapes.size(); ++b) {
    BodyShape& shape = shapes[b];
    shape.name = tissue.bodies[b].name;
    std::vector<std::uint32_t> used;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> there, back;
    for (const std::size_t i : triangles[b])
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t from = tissue.triangles[i][static_cast<std::size_t>(k)];
        const std::uint32_t to = tissue.triangles[i][static_cast<std::size_t>((k + 1) % 3)];
        used.push_back(from);
        there.emplace_back(from, to);
        back.emplace_back(to, from);
      }
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    std::sort(there.begin(), there.end());
    std::sort(back.begin(), back.end());
    shape.closed = !there.empty() && there == back && std::adjacent_find(there.begin(), there.end()) == there.end();
    shape.euler = static_cast<int>(used.size()) - static_cast<int>(there.size() / 2) + static_cast<int>(triangles[b].size());
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const std::uint32_t id : used) {
      shape.box.extend(tissue.points[id].cast<double>());
      mean += tissue.points[id].cast<double>() / static_cast<double>(used.size());
    }
    for (const std::size_t i : triangles[b]) {
      const auto corner = [&](std::size_t k) {
        return Eigen::Vector3d(tissue.points[tissue.triangles[i][k]].cast<double>() - mean);
      };
      const Eigen::Vector3d a = corner(0), c = corner(1), d = corner(2), normal = (c - a).cross(d - a);
      const double part = a.dot(c.cross(d)) / 6.0;
      shape.volume += part;
      shape.starShaped = shape.starShaped && part > 0.0;
      shape.thinnest = std::min(shape.thinnest, normal.norm() / ((c - a).norm() * (d - a).norm()));
    }
  }
  return shapes;
}

/// How often the bodies wind about a point, by the solid angles of their triangles: the last body that holds it, or -1.
inline int BodyAt(const echorama::TissueSurface& tissue, const Eigen::Vector3d& p)
{
  std::vector<double> winding(tissue.bodies.size(), 0.0);
  for (std::size_t i = 0; i < tissue.triangles.size(); ++i) {
    const auto corner = [&](std::size_t k) { return Eigen::Vector3d(tissue.points[tissue.triangles[i][k]].cast<double>() - p); };
    const Eigen::Vector3d a = corner(0), b = corner(1), c = corner(2);
    const double x = a.norm(), y = b.norm(), z = c.norm();
    winding[static_cast<std::size_t>(tissue.bodyOfTriangle[i])] +=
        std::atan2(a.dot(b.cross(c)), x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y);
  }
  for (std::size_t body = winding.size(); body-- > 0;)
    if (winding[body] > 3.14159265)
      return static_cast<int>(body);
  return -1;
}
