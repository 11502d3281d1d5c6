// SPDX-License-Identifier: GPL-3.0-or-later
// CGAL does it; here are its types, and what it does not check.
#include "AlphaWrap.h"
#include "Core/Base/Error.h"
#include <CGAL/alpha_wrap_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <string>

namespace echorama {

ParameterList Describe(AlphaWrapParameters& p)
{
  return {
      Parameter("AlphaMm", p.alphaMm, {0, 1000, true}, "mm",
                "Radius of the ball that must not get in: holes that are narrower are closed. Smaller follows hollows better."),
      Parameter("OffsetMm", p.offsetMm, {0, 100, true}, "mm", "How far from the triangles the closed surface lies."),
  };
}

TriangleSurface AlphaWrap(const TriangleSurface& surface, const AlphaWrapParameters& parameters)
{
  CheckRanges(parameters);
  if (surface.triangles.empty())
    throw Error(Error::Kind::BadInput, "there is no triangle to wrap");
  using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;
  std::vector<Point> points;
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    const Eigen::Vector3d point = surface.points[i].cast<double>();
    if (!point.allFinite())
      throw Error(Error::Kind::BadInput, "point " + std::to_string(i) + " is not finite");
    points.emplace_back(point.x(), point.y(), point.z());
  }
  std::vector<std::array<std::size_t, 3>> faces;
  for (const auto& [a, b, c] : surface.triangles) {
    if (std::max({a, b, c}) >= points.size())
      throw Error(Error::Kind::BadInput, "a triangle names a point that is not there");
    faces.push_back({a, b, c});
  }
  CGAL::Surface_mesh<Point> wrap;
  CGAL::alpha_wrap_3(points, faces, parameters.alphaMm, parameters.offsetMm, wrap);
  TriangleSurface closed;
  std::vector<std::uint32_t> numbers(wrap.num_vertices());
  for (const auto vertex : wrap.vertices()) {
    const Point& point = wrap.point(vertex);
    numbers.at(vertex.idx()) = static_cast<std::uint32_t>(closed.points.size());
    closed.points.push_back(Eigen::Vector3d(point.x(), point.y(), point.z()).cast<float>());
  }
  for (const auto face : wrap.faces()) {
    std::array<std::uint32_t, 3> triangle{};
    std::size_t corner = 0;
    for (const auto vertex : wrap.vertices_around_face(wrap.halfedge(face)))
      triangle.at(corner++) = numbers.at(vertex.idx());
    closed.triangles.push_back(triangle);
  }
  return closed;
}

} // namespace echorama
