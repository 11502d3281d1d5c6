// SPDX-License-Identifier: BSD-3-Clause
// Whether a point is inside is told by the normal at the place nearest to it: of a triangle, of the two that share an edge, or of
// all about a corner, weighted by their angles there. The triangle alone would be wrong beyond edges.
#include "BodySurface.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/JoinedText.h"
#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace echorama {
namespace {

using Eigen::Vector3d;

// Under another licence than this: Modules/AlphaWrap.
const std::string wrappingText = "the program echorama-alpha-wrap (under the GPL; Documentation/shell.md)";

struct SurfaceEdge {
  std::uint32_t low, high;
  std::uint32_t triangle;
  std::uint32_t opposite; // corner of the triangle
};

std::vector<SurfaceEdge> EdgesOf(const TriangleSurface& surface)
{
  std::vector<SurfaceEdge> edges;
  edges.reserve(3 * surface.triangles.size());
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t)
    for (std::uint32_t n = 0; n < 3; ++n) {
      const std::uint32_t a = surface.triangles[t][(n + 1) % 3], b = surface.triangles[t][(n + 2) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), t, n});
    }
  std::sort(edges.begin(), edges.end(), [](const SurfaceEdge& a, const SurfaceEdge& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });
  return edges;
}

std::string HoleText(const SurfaceHole& hole)
{
  return Format("one of %.1f mm around (%zu edges) at (%.1f, %.1f, %.1f)", hole.lengthMm, hole.edges, hole.middle.x(),
                hole.middle.y(), hole.middle.z());
}

void CheckPoints(const TriangleSurface& surface)
{
  if (surface.triangles.empty())
    throw Error(Error::Kind::BadInput, "the body has no triangle");
  for (std::size_t i = 0; i < surface.points.size(); ++i)
    if (!surface.points[i].allFinite() || surface.points[i].norm() > 1e5f)
      throw Error(Error::Kind::BadInput,
                  "point " + std::to_string(i) + " of the body is " +
                      (surface.points[i].allFinite() ? "further than 100 m from the origin; the unit is mm" : "not finite"));
}

} // namespace

std::vector<SurfaceHole> HolesOf(const TriangleSurface& surface)
{
  // Open edges that hang together are one hole.
  const std::vector<SurfaceEdge> edges = EdgesOf(surface);
  std::map<std::uint32_t, std::vector<std::uint32_t>> neighbours; // of points on borders
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const auto same = [&](std::size_t j) {
      return j < edges.size() && edges[j].low == edges[i].low && edges[j].high == edges[i].high;
    };
    if (!same(i + 1) && !(i > 0 && same(i - 1))) {
      neighbours[edges[i].low].push_back(edges[i].high);
      neighbours[edges[i].high].push_back(edges[i].low);
    }
  }
  std::vector<SurfaceHole> holes;
  std::map<std::uint32_t, bool> isSeen;
  for (const auto& [seed, unused] : neighbours) {
    static_cast<void>(unused);
    if (isSeen[seed])
      continue;
    isSeen[seed] = true;
    SurfaceHole hole;
    std::vector<std::uint32_t> waiting{seed};
    std::size_t points = 0, ends = 0;
    while (!waiting.empty()) {
      const std::uint32_t from = waiting.back();
      waiting.pop_back();
      hole.middle += surface.points[from].cast<double>();
      ++points;
      for (const std::uint32_t to : neighbours[from]) {
        hole.lengthMm += 0.5 * (surface.points[to] - surface.points[from]).cast<double>().norm();
        ++ends;
        if (!isSeen[to]) {
          isSeen[to] = true;
          waiting.push_back(to);
        }
      }
    }
    hole.edges = ends / 2;
    hole.middle /= static_cast<double>(points);
    holes.push_back(hole);
  }
  std::stable_sort(holes.begin(), holes.end(),
                   [](const SurfaceHole& a, const SurfaceHole& b) { return a.lengthMm > b.lengthMm; });
  return holes;
}

BodySurface::BodySurface(TriangleSurface surface, const Progress& progress) : surface_(std::move(surface))
{
  CheckPoints(surface_);
  MendSurface(surface_, {}, progress.Part(0.0, 0.2));
  const SurfaceReport report = CheckSurface(surface_, {}, progress.Part(0.2, 0.9));
  if (report.openEdges.count > 0) {
    const std::vector<SurfaceHole> holes = HolesOf(surface_);
    std::vector<std::string> texts;
    for (std::size_t i = 0; i < std::min<std::size_t>(holes.size(), 5); ++i)
      texts.push_back(HoleText(holes[i]));
    throw Error(Error::Kind::BadInput, "the body is not closed: it has " + std::to_string(holes.size()) +
                                           (holes.size() == 1 ? " hole, " : " holes, ") + Joined(texts) +
                                           (holes.size() > 5 ? " ..." : "") +
                                           "; close them where the surface was made, or with " + wrappingText);
  }
  if (!report.IsSound())
    throw Error(Error::Kind::BadInput,
                "the surface is not that of a body: " + report.Faults() + "; mend it where it was made, or with " + wrappingText);
  for (const Eigen::Vector3f& point : surface_.points)
    bounds_.extend(point.cast<double>());
  tree_ = TriangleTree(surface_.points, surface_.triangles);
  FindNormals();
  progress(1.0);
}

void BodySurface::FindNormals()
{
  pointNormals_.assign(surface_.points.size(), Eigen::Vector3f::Zero());
  edgeNormals_.resize(surface_.triangles.size());
  std::vector<Eigen::Vector3f> normals;
  for (const auto& triangle : surface_.triangles) {
    std::array<Vector3d, 3> p;
    for (std::size_t n = 0; n < 3; ++n)
      p[n] = surface_.points[triangle[n]].cast<double>();
    const Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]).normalized();
    normals.push_back(normal.cast<float>());
    for (std::size_t n = 0; n < 3; ++n) {
      const Vector3d a = p[(n + 1) % 3] - p[n], b = p[(n + 2) % 3] - p[n];
      pointNormals_[triangle[n]] += (std::atan2(a.cross(b).norm(), a.dot(b)) * normal).cast<float>();
    }
  }
  const std::vector<SurfaceEdge> edges = EdgesOf(surface_);
  for (std::size_t i = 0; i + 1 < edges.size(); i += 2) { // two and two: the surface is closed
    const Eigen::Vector3f both = normals[edges[i].triangle] + normals[edges[i + 1].triangle];
    for (const SurfaceEdge& edge : {edges[i], edges[i + 1]})
      edgeNormals_[edge.triangle][edge.opposite] = both;
  }
}

BodySurface::Place BodySurface::PlaceOf(const Vector3d& point) const
{
  const auto found = tree_.NearestTo(surface_.points, surface_.triangles, point);
  if (!found)
    throw Error(Error::Kind::BadInput, "a point that is not finite has no distance from the body");
  const auto& [triangle, weights] = found->place;
  const auto& corners = surface_.triangles[triangle];
  Vector3d nearest = Vector3d::Zero();
  std::array<Vector3d, 3> p;
  for (std::size_t n = 0; n < 3; ++n) {
    p[n] = surface_.points[corners[n]].cast<double>();
    nearest += weights[static_cast<Eigen::Index>(n)] * p[n];
  }
  Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]).normalized();
  const auto zeros = (weights.array() == 0.0).count();
  for (std::size_t n = 0; n < 3; ++n) {
    if (zeros == 2 && weights[static_cast<Eigen::Index>(n)] > 0.0)
      normal = pointNormals_[corners[n]].cast<double>();
    else if (zeros == 1 && weights[static_cast<Eigen::Index>(n)] == 0.0)
      normal = edgeNormals_[triangle][n].cast<double>();
  }
  const Vector3d difference = point - nearest;
  const bool isInside = difference.dot(normal) < 0.0;
  Place place{nearest, isInside ? -found->distanceMm : found->distanceMm, normal.normalized()};
  if (found->distanceMm > 1e-6) // nearer, rounding says where it points
    place.away = (isInside ? -difference : difference) / found->distanceMm;
  return place;
}

std::optional<double> BodySurface::Along(const Vector3d& origin, const Vector3d& direction) const
{
  const auto hit = tree_.FirstHit(surface_.points, surface_.triangles, origin, direction);
  return hit ? std::optional<double>(hit->distanceMm) : std::nullopt;
}

} // namespace echorama
