// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Tissue/TriangleTree.h"
#include <cstdint>
#include <string>

namespace echorama {

/// A surface of triangles that something walks on: who lies beside whom, and which way is out.
///
/// Points at one place are joined (files of loose triangles, normals that split points). Triangles that are a line by their
/// corners, or are there twice, are left out. Every connected part is turned to one orientation: outwards when it is closed,
/// else that of most of its area. Where more than two triangles meet at an edge, each goes on to the one that it sees across the
/// air outside. An edge without a partner is a border, and so is one that cannot be oriented (a strip of Moebius).
class SkinMesh {
public:
  using Triangle = TriangleTree::Triangle;
  static constexpr std::uint32_t none = 0xffffffffu;

  /// Of what was given, for a message.
  struct Repairs {
    std::size_t joinedPoints = 0, leftOut = 0, turned = 0; ///< triangles left out and turned over
    std::size_t crowdedEdges = 0;                          ///< of more than two triangles
    std::size_t borderEdges = 0;
  };

  /// A triangle in numbers. Edge k lies opposite corner k, from corner k + 1 to corner k + 2.
  struct Face {
    std::array<Eigen::Vector3d, 3> corner;
    Eigen::Vector3d normal;            ///< unit, outwards; of no meaning for a flat one
    double twiceArea = 0.0;            ///< mm^2
    bool flat = false;                 ///< no more than a line: it passes on what comes, and nothing stays there
    Eigen::Vector3d Edge(int k) const; ///< unit, counter-clockwise
    Eigen::Vector3d At(const Eigen::Vector3d& weights) const;
  };

  /// \param name for messages
  /// \throws Error(BadInput) that begins with \a name when there is no triangle, a corner does not exist, a point in use is not
  /// finite or further than 1e6 mm from the origin, or all triangles are flat
  SkinMesh(const std::vector<Eigen::Vector3f>& points, const std::vector<Triangle>& triangles,
           const std::string& name = "the skin");

  std::size_t TriangleCount() const { return triangles_.size(); }
  const Repairs& Repaired() const { return repairs_; }
  Face FaceOf(std::uint32_t triangle) const;
  /// The edge beyond edge k of a triangle, as 3 * triangle + edge, or none.
  std::uint32_t Beyond(std::uint32_t triangle, int edge) const { return beyond_[triangle][static_cast<std::size_t>(edge)]; }

  Eigen::Vector3d PointAt(const SurfacePoint& place) const { return FaceOf(place.triangle).At(place.weights); }
  /// Unit, outwards: the normals of the corners (of the triangles around them, by area), interpolated. So it has no jumps at
  /// edges. The triangle's own normal where these cancel.
  Eigen::Vector3d NormalAt(const SurfacePoint& place) const;

  std::optional<TriangleTree::Nearest> NearestTo(const Eigen::Vector3d& point) const
  {
    return tree_.NearestTo(points_, triangles_, point);
  }
  /// The first place that a ray meets (a click).
  std::optional<TriangleTree::Hit> FirstHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const
  {
    return tree_.FirstHit(points_, triangles_, origin, direction);
  }

private:
  struct EdgeGroups;
  void JoinPoints(const std::vector<Eigen::Vector3f>& points, const std::vector<Triangle>& triangles, const std::string& name);
  void LeaveOut();
  void Orient();
  void Link();
  void PairCrowded(const std::uint32_t* begin, const std::uint32_t* end);
  void FindNormals();

  std::vector<Eigen::Vector3f> points_, normals_;
  std::vector<Triangle> triangles_;
  std::vector<std::array<std::uint32_t, 3>> beyond_;
  TriangleTree tree_;
  Repairs repairs_;
};

} // namespace echorama
