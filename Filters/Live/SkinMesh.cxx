// SPDX-License-Identifier: BSD-3-Clause
// Edges are found by buckets: one per point, with the edges of which it is the lower end, sorted by the other end. That is done
// twice, before triangles are turned and after. All is linear but the sorting of points and the tree.
#include "Filters/Live/SkinMesh.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <cmath>
#include <numeric>

namespace echorama {
namespace {

using Eigen::Vector3d;

constexpr double flatness = 1e-6; // height of a flat triangle, relative to its longest edge
constexpr float furthestMm = 1e6f;

std::uint32_t From(const SkinMesh::Triangle& triangle, std::uint32_t edge)
{
  return triangle[(edge + 1) % 3];
}
std::uint32_t To(const SkinMesh::Triangle& triangle, std::uint32_t edge)
{
  return triangle[(edge + 2) % 3];
}

} // namespace

Vector3d SkinMesh::Face::Edge(int k) const
{
  const auto n = static_cast<std::size_t>(k);
  return (corner[(n + 2) % 3] - corner[(n + 1) % 3]).normalized();
}

Vector3d SkinMesh::Face::At(const Vector3d& weights) const
{
  return weights[0] * corner[0] + weights[1] * corner[1] + weights[2] * corner[2];
}

// All edges, those between the same two points together.
struct SkinMesh::EdgeGroups {
  std::vector<std::uint32_t> edges; ///< 3 * triangle + edge
  std::vector<std::size_t> begins;  ///< of groups, and the end of the last

  EdgeGroups(const std::vector<Triangle>& triangles, std::size_t pointCount)
  {
    std::vector<std::uint32_t> ends(pointCount + 1, 0);
    const auto low = [&triangles](std::uint32_t e) {
      return std::min(From(triangles[e / 3], e % 3), To(triangles[e / 3], e % 3));
    };
    const auto high = [&triangles](std::uint32_t e) {
      return std::max(From(triangles[e / 3], e % 3), To(triangles[e / 3], e % 3));
    };
    const auto count = static_cast<std::uint32_t>(3 * triangles.size());
    for (std::uint32_t e = 0; e < count; ++e)
      ++ends[low(e) + 1];
    std::partial_sum(ends.begin(), ends.end(), ends.begin());
    edges.resize(count);
    std::vector<std::uint32_t> next(ends.begin(), ends.end() - 1);
    for (std::uint32_t e = 0; e < count; ++e)
      edges[next[low(e)]++] = e;
    for (std::size_t p = 0; p < pointCount; ++p)
      std::sort(edges.begin() + ends[p], edges.begin() + ends[p + 1], [&high](std::uint32_t a, std::uint32_t b) {
        const std::uint32_t highA = high(a), highB = high(b);
        return highA != highB ? highA < highB : a < b;
      });
    for (std::size_t n = 0; n < edges.size(); ++n)
      if (n == 0 || low(edges[n]) != low(edges[n - 1]) || high(edges[n]) != high(edges[n - 1]))
        begins.push_back(n);
    begins.push_back(edges.size());
  }

  template <class F>
  void Each(F&& f) const
  {
    for (std::size_t g = 0; g + 1 < begins.size(); ++g)
      f(edges.data() + begins[g], edges.data() + begins[g + 1]);
  }
};

SkinMesh::SkinMesh(const std::vector<Eigen::Vector3f>& points, const std::vector<Triangle>& triangles, const std::string& name)
{
  if (triangles.empty())
    throw Error(Error::Kind::BadInput, name + ": it has no triangles");
  if (triangles.size() > 1000000000)
    throw Error(Error::Kind::TooLarge, name + ": it has more than a thousand million triangles");
  JoinPoints(points, triangles, name);
  LeaveOut();
  std::vector<std::uint32_t> members;
  for (std::uint32_t t = 0; t < triangles_.size(); ++t)
    if (!FaceOf(t).flat)
      members.push_back(t);
  if (members.empty())
    throw Error(Error::Kind::BadInput, name + ": all its triangles are flat; there is no area to stand on");
  Orient();
  Link();
  FindNormals();
  tree_ = TriangleTree(points_, triangles_, std::move(members));
}

SkinMesh::Face SkinMesh::FaceOf(std::uint32_t triangle) const
{
  Face face;
  for (std::size_t n = 0; n < 3; ++n)
    face.corner[n] = points_[triangles_[triangle][n]].cast<double>();
  const Vector3d a = face.corner[1] - face.corner[0], b = face.corner[2] - face.corner[0];
  const Vector3d cross = a.cross(b);
  face.twiceArea = cross.norm();
  face.flat = !(face.twiceArea > flatness * std::max({a.squaredNorm(), b.squaredNorm(), (b - a).squaredNorm()}));
  face.normal = face.twiceArea > 0.0 ? Vector3d(cross / face.twiceArea) : Vector3d::Zero();
  return face;
}

void SkinMesh::JoinPoints(const std::vector<Eigen::Vector3f>& points, const std::vector<Triangle>& triangles,
                          const std::string& name)
{
  std::vector<bool> used(points.size(), false);
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (const std::uint32_t corner : triangles[t]) {
      if (corner >= points.size())
        throw Error(Error::Kind::BadInput, name + ": triangle " + std::to_string(t) + " has corner " + std::to_string(corner) +
                                               ", but there are " + std::to_string(points.size()) + " points");
      if (!(points[corner].cwiseAbs().maxCoeff() <= furthestMm) || !points[corner].allFinite())
        throw Error(Error::Kind::BadInput,
                    name + ": point " + std::to_string(corner) + " is not finite, or further than 1e6 mm from the origin");
      used[corner] = true;
    }
  std::vector<std::uint32_t> order;
  for (std::uint32_t p = 0; p < points.size(); ++p)
    if (used[p])
      order.push_back(p);
  std::sort(order.begin(), order.end(), [&points](std::uint32_t a, std::uint32_t b) {
    const auto &p = points[a], &q = points[b];
    return p[0] != q[0] ? p[0] < q[0] : p[1] != q[1] ? p[1] < q[1] : p[2] != q[2] ? p[2] < q[2] : a < b;
  });
  std::vector<std::uint32_t> first(points.size(), none), number(points.size(), none);
  for (std::size_t n = 0; n < order.size(); ++n) {
    const bool joined = n > 0 && points[order[n]] == points[order[n - 1]];
    first[order[n]] = joined ? first[order[n - 1]] : order[n];
    repairs_.joinedPoints += joined ? 1 : 0;
  }
  for (std::uint32_t p = 0; p < points.size(); ++p) // in the order of the input, near in memory where it was
    if (first[p] == p) {
      number[p] = static_cast<std::uint32_t>(points_.size());
      points_.push_back(points[p]);
    }
  triangles_ = triangles;
  for (Triangle& triangle : triangles_)
    for (std::uint32_t& corner : triangle)
      corner = number[first[corner]];
}

void SkinMesh::LeaveOut()
{
  const auto key = [](Triangle triangle) {
    std::sort(triangle.begin(), triangle.end());
    return triangle;
  };
  const std::size_t before = triangles_.size();
  triangles_.erase(std::remove_if(triangles_.begin(), triangles_.end(),
                                  [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }),
                   triangles_.end());
  // Those that are there twice share their lowest corner.
  std::vector<std::uint32_t> ends(points_.size() + 1, 0), members(triangles_.size());
  for (const Triangle& triangle : triangles_)
    ++ends[key(triangle)[0] + 1];
  std::partial_sum(ends.begin(), ends.end(), ends.begin());
  std::vector<std::uint32_t> next(ends.begin(), ends.end() - 1);
  for (std::uint32_t t = 0; t < triangles_.size(); ++t)
    members[next[key(triangles_[t])[0]]++] = t;
  std::vector<bool> again(triangles_.size(), false);
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const auto begin = members.begin() + ends[p], end = members.begin() + ends[p + 1];
    std::sort(begin, end, [&](std::uint32_t a, std::uint32_t b) {
      const Triangle keyA = key(triangles_[a]), keyB = key(triangles_[b]);
      return keyA != keyB ? keyA < keyB : a < b;
    });
    for (auto m = begin; m != end; ++m)
      again[*m] = m != begin && key(triangles_[*m]) == key(triangles_[*(m - 1)]);
  }
  std::size_t kept = 0;
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    if (!again[t])
      triangles_[kept++] = triangles_[t];
  triangles_.resize(kept);
  repairs_.leftOut = before - kept;
}

void SkinMesh::Orient()
{
  beyond_.assign(triangles_.size(), {none, none, none});
  EdgeGroups(triangles_, points_.size()).Each([this](const std::uint32_t* begin, const std::uint32_t* end) {
    if (end - begin != 2)
      return;
    beyond_[begin[0] / 3][begin[0] % 3] = begin[1];
    beyond_[begin[1] / 3][begin[1] % 3] = begin[0];
  });
  std::vector<bool> found(triangles_.size(), false), turn(triangles_.size(), false);
  std::vector<std::uint32_t> part;
  for (std::uint32_t seed = 0; seed < triangles_.size(); ++seed) {
    if (found[seed])
      continue;
    part.assign(1, seed);
    found[seed] = true;
    bool closed = true;
    for (std::size_t n = 0; n < part.size(); ++n) {
      const std::uint32_t t = part[n];
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t other = beyond_[t][k];
        closed = closed && other != none;
        if (other == none || found[other / 3])
          continue;
        // Neighbours of one orientation run along their edge in opposite directions.
        const bool same = From(triangles_[t], k) == From(triangles_[other / 3], other % 3);
        turn[other / 3] = turn[t] != same;
        found[other / 3] = true;
        part.push_back(other / 3);
      }
    }
    // A part that meets others at crowded edges counts as open here: only some of its edges are its own.
    double volume = 0.0, area = 0.0;
    const Vector3d middle = points_[triangles_[seed][0]].cast<double>();
    for (const std::uint32_t t : part) {
      const Face face = FaceOf(t);
      const double sign = turn[t] ? -1.0 : 1.0;
      area += sign * face.twiceArea;
      volume += sign * face.twiceArea * face.normal.dot(face.corner[0] - middle);
    }
    if (closed ? volume < 0.0 : area < 0.0)
      for (const std::uint32_t t : part)
        turn[t] = !turn[t];
  }
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    if (turn[t]) {
      std::swap(triangles_[t][1], triangles_[t][2]);
      ++repairs_.turned;
    }
}

void SkinMesh::Link()
{
  beyond_.assign(triangles_.size(), {none, none, none});
  EdgeGroups(triangles_, points_.size()).Each([this](const std::uint32_t* begin, const std::uint32_t* end) {
    if (end - begin > 2) {
      ++repairs_.crowdedEdges;
      PairCrowded(begin, end);
    } else if (end - begin == 2 && From(triangles_[begin[0] / 3], begin[0] % 3) == To(triangles_[begin[1] / 3], begin[1] % 3)) {
      beyond_[begin[0] / 3][begin[0] % 3] = begin[1];
      beyond_[begin[1] / 3][begin[1] % 3] = begin[0];
    }
  });
  for (const auto& edges : beyond_)
    repairs_.borderEdges += static_cast<std::size_t>(std::count(edges.begin(), edges.end(), none));
}

// Each triangle, turned about the edge towards its outside, meets first the one across the air. Two that choose each other, with
// opposite directions, are a pair.
void SkinMesh::PairCrowded(const std::uint32_t* begin, const std::uint32_t* end)
{
  const auto count = static_cast<std::size_t>(end - begin);
  const auto chosenBy = [&](std::size_t n) {
    const Face face = FaceOf(begin[n] / 3);
    const Vector3d edge = face.Edge(static_cast<int>(begin[n] % 3)), inward = face.normal.cross(edge);
    std::size_t best = count;
    double smallest = 4.0 * Pi;
    for (std::size_t m = 0; m < count; ++m) {
      const Face other = FaceOf(begin[m] / 3);
      if (m == n || face.flat || other.flat)
        continue;
      const Vector3d across = other.corner[begin[m] % 3] - other.corner[(begin[m] % 3 + 1) % 3];
      double angle = std::atan2(across.dot(face.normal), across.dot(inward));
      angle += angle < 0.0 ? 2.0 * Pi : 0.0;
      if (angle < smallest) {
        smallest = angle;
        best = m;
      }
    }
    return best;
  };
  for (std::size_t n = 0; n < count; ++n) {
    const std::size_t m = chosenBy(n);
    if (m < count && chosenBy(m) == n &&
        From(triangles_[begin[n] / 3], begin[n] % 3) == To(triangles_[begin[m] / 3], begin[m] % 3))
      beyond_[begin[n] / 3][begin[n] % 3] = begin[m];
  }
}

void SkinMesh::FindNormals()
{
  std::vector<Vector3d> sums(points_.size(), Vector3d::Zero());
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    const Face face = FaceOf(t);
    for (const std::uint32_t corner : triangles_[t])
      sums[corner] += face.twiceArea * face.normal;
  }
  normals_.reserve(points_.size());
  for (const Vector3d& sum : sums)
    normals_.push_back(sum.normalized().cast<float>()); // zero stays zero
}

Vector3d SkinMesh::NormalAt(const SurfacePoint& place) const
{
  const Triangle& triangle = triangles_[place.triangle];
  Vector3d normal = Vector3d::Zero();
  for (std::size_t n = 0; n < 3; ++n)
    normal += place.weights[static_cast<Eigen::Index>(n)] * normals_[triangle[n]].cast<double>();
  const double length = normal.norm();
  return length > 1e-3 ? Vector3d(normal / length) : FaceOf(place.triangle).normal;
}

} // namespace echorama
