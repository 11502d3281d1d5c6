// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Tissue/TissueSurface.h"
#include <array>
#include <cstdint>
#include <Eigen/Core>
#include <vector>

namespace echorama {

/// The surface of a scene taken apart into shells, mended where it can be: see Notes.
class SceneShells {
public:
  using Corners = std::array<std::uint32_t, 3>;

  struct Notes {
    std::int64_t degenerateTriangles = 0; ///< without area; left out
    int shells = 0;                       ///< connected pieces of surfaces
    int turnedShells = 0;                 ///< were inside out, or had triangles that disagree, and are taken the right way round
    int cavities = 0;                     ///< shells that bound a hole within their body
    /// Have holes of up to a tenth of their area: they keep their inside, and what enters by a hole is put right where it
    /// leaves.
    int leakyShells = 0;
    int sheets = 0; ///< open, without an inside: see Crossing::sheet
  };

  struct Shell {
    std::int32_t body = 0;
    double volume = 0.0; ///< with the order of corners
    double area = 0.0;
    std::uint64_t balance = 0; ///< of directed edges
    std::uint32_t first = 0;   ///< a triangle of it
    int facing = 1;            ///< -1: the corners are clockwise as seen from outside
    int sign = 1;              ///< -1: bounds a cavity
    bool sheet = false;
  };

  explicit SceneShells(const TissueSurface& surface);

  Eigen::Vector3d Point(std::uint32_t i) const { return points[i].cast<double>(); }

  std::vector<Eigen::Vector3f> points; ///< about the centre
  std::vector<Corners> triangles;
  std::vector<std::int32_t> shellOf; ///< of each triangle
  std::vector<Shell> shells;         ///< in the order of their bodies
  Notes notes;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();                              ///< of the box, world
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero(); ///< of the box, about the centre
  double tolerance = 1e-9;                                                       ///< see AcousticScene::Tolerance()

private:
  void Split(const TissueSurface& surface);
  void Weld(const TissueSurface& surface);
  void Mend(std::int32_t shell, const std::vector<std::uint32_t>& members);
  void Measure();
};

} // namespace echorama
