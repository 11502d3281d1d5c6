// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <cstdint>
#include <Eigen/Core>
#include <utility>
#include <vector>

namespace echorama {

/// The normals of the curved surface at the corners of a triangle, packed.
using CornerNormals = std::array<std::uint32_t, 3>;

/// Of those triangles that are \a kept: the mean of the triangles around each point, by their area. Where one of them differs
/// from it by more than \a creaseDegrees the point lies on an edge, and its triangles are flat there; with 0 all are.
std::vector<CornerNormals> MakeCornerNormals(const std::vector<Eigen::Vector3f>& points,
                                             const std::vector<std::array<std::uint32_t, 3>>& triangles,
                                             const std::vector<std::uint32_t>& kept, double creaseDegrees);

/// Of the triangle and of the curved surface, both against a ray that meets it: unit vectors.
/// \param flat the triangle's normal, to either side \param u, v where in the triangle
std::pair<Eigen::Vector3d, Eigen::Vector3d> NormalsAt(const CornerNormals& corners, const Eigen::Vector3d& flat, float u, float v,
                                                      const Eigen::Vector3d& direction);

} // namespace echorama
