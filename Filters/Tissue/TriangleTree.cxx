// SPDX-License-Identifier: BSD-3-Clause
// Boxes are halved at the median of their triangles' middles, so the tree is as deep as it must be and no deeper, whatever the
// mesh. Both questions go to the nearer child first and leave out boxes that are further than the best found.
#include "Filters/Tissue/TriangleTree.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace echorama {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t leafTriangles = 4;
constexpr double infinite = std::numeric_limits<double>::infinity();

std::array<Vector3d, 3> CornersOf(const std::vector<Eigen::Vector3f>& points, const TriangleTree::Triangle& triangle)
{
  return {points[triangle[0]].cast<double>(), points[triangle[1]].cast<double>(), points[triangle[2]].cast<double>()};
}

// The place of the segment from corner a to corner b that is nearest to a point.
Vector3d WeightsOnEdge(const std::array<Vector3d, 3>& corners, std::size_t a, std::size_t b, const Vector3d& point)
{
  const Vector3d along = corners[b] - corners[a];
  const double squared = along.squaredNorm();
  const double part = squared > 0.0 ? std::clamp((point - corners[a]).dot(along) / squared, 0.0, 1.0) : 0.0;
  Vector3d weights = Vector3d::Zero();
  weights[static_cast<Eigen::Index>(a)] = 1.0 - part;
  weights[static_cast<Eigen::Index>(b)] = part;
  return weights;
}

Vector3d At(const std::array<Vector3d, 3>& corners, const Vector3d& weights)
{
  return weights[0] * corners[0] + weights[1] * corners[1] + weights[2] * corners[2];
}

// The nearest place of a triangle: below the point where that lies within it, else on one of its edges.
Vector3d NearestWeights(const std::array<Vector3d, 3>& corners, const Vector3d& point)
{
  const Vector3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  const double squared = normal.squaredNorm();
  Vector3d weights = Vector3d::Constant(-1.0);
  if (squared > 0.0)
    for (std::size_t n = 0; n < 3; ++n)
      weights[static_cast<Eigen::Index>(n)] =
          (corners[(n + 2) % 3] - corners[(n + 1) % 3]).cross(point - corners[(n + 1) % 3]).dot(normal) / squared;
  if (weights.minCoeff() >= 0.0)
    return weights / weights.sum();
  double best = infinite;
  for (std::size_t n = 0; n < 3; ++n) {
    const Vector3d candidate = WeightsOnEdge(corners, n, (n + 1) % 3, point);
    const double distance = (At(corners, candidate) - point).squaredNorm();
    if (distance < best) {
      best = distance;
      weights = candidate;
    }
  }
  return weights;
}

// Where a ray meets a triangle, as its parameter and weights; the parameter is infinite when it does not. Edges belong to both
// of their triangles, so that no ray slips through between them.
double Meet(const std::array<Vector3d, 3>& corners, const Vector3d& origin, const Vector3d& direction, Vector3d& weights)
{
  const Vector3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  const double slope = normal.dot(direction), squared = normal.squaredNorm();
  if (!(std::abs(slope) > 1e-12 * std::sqrt(squared)))
    return infinite;
  const double at = normal.dot(corners[0] - origin) / slope;
  if (!(at >= 0.0))
    return infinite;
  const Vector3d point = origin + at * direction;
  for (std::size_t n = 0; n < 3; ++n)
    weights[static_cast<Eigen::Index>(n)] =
        (corners[(n + 2) % 3] - corners[(n + 1) % 3]).cross(point - corners[(n + 1) % 3]).dot(normal) / squared;
  if (!(weights.minCoeff() >= -1e-9))
    return infinite;
  weights = weights.cwiseMax(0.0);
  weights /= weights.sum();
  return at;
}

// Where a ray enters a box, or infinity; inverse is 1 / direction.
double Enter(const Eigen::AlignedBox3f& box, const Vector3d& origin, const Vector3d& inverse)
{
  double near = 0.0, far = infinite;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (static_cast<double>(box.min()[axis]) - origin[axis]) * inverse[axis];
    const double b = (static_cast<double>(box.max()[axis]) - origin[axis]) * inverse[axis];
    near = std::fmax(near, std::fmin(a, b)); // these pass over the NaN of a ray within a face
    far = std::fmin(far, std::fmax(a, b));
  }
  const double slack = 1e-6 * (1.0 + std::abs(near)); // a flat box has no inside
  return near <= far + slack ? near : infinite;
}

std::vector<std::uint32_t> NumbersUpTo(std::size_t count)
{
  std::vector<std::uint32_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 0u);
  return numbers;
}

// Children to visit, with the bound that each had when it was put there; the depth of a tree halved at the median is bounded.
struct Visit {
  std::uint32_t node;
  double bound;
};

} // namespace

TriangleTree::TriangleTree(const std::vector<Eigen::Vector3f>& points, const std::vector<Triangle>& triangles,
                           std::vector<std::uint32_t> members)
  : members_(std::move(members))
{
  std::vector<Eigen::AlignedBox3f> boxes(triangles.size());
  for (const std::uint32_t t : members_)
    for (const std::uint32_t corner : triangles[t])
      boxes[t].extend(points[corner]);
  nodes_.reserve(members_.size());
  if (!members_.empty())
    Build(boxes, 0, static_cast<std::uint32_t>(members_.size()));
}

TriangleTree::TriangleTree(const std::vector<Eigen::Vector3f>& points, const std::vector<Triangle>& triangles)
  : TriangleTree(points, triangles, NumbersUpTo(triangles.size()))
{
}

void TriangleTree::Build(const std::vector<Eigen::AlignedBox3f>& boxes, std::uint32_t begin, std::uint32_t end)
{
  const std::size_t self = nodes_.size();
  nodes_.emplace_back();
  Eigen::AlignedBox3f box, middles;
  for (std::uint32_t n = begin; n < end; ++n) {
    box.extend(boxes[members_[n]]);
    middles.extend(boxes[members_[n]].center());
  }
  nodes_[self].box = box;
  if (end - begin <= leafTriangles) {
    nodes_[self].first = begin;
    nodes_[self].count = end - begin;
    return;
  }
  Eigen::Index axis = 0;
  middles.sizes().maxCoeff(&axis);
  const std::uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(members_.begin() + begin, members_.begin() + middle, members_.begin() + end,
                   [&boxes, axis](std::uint32_t a, std::uint32_t b) {
                     const float atA = boxes[a].center()[axis], atB = boxes[b].center()[axis];
                     return atA != atB ? atA < atB : a < b;
                   });
  Build(boxes, begin, middle);
  nodes_[self].first = static_cast<std::uint32_t>(nodes_.size());
  Build(boxes, middle, end);
}

std::optional<TriangleTree::Nearest> TriangleTree::NearestTo(const std::vector<Eigen::Vector3f>& points,
                                                             const std::vector<Triangle>& triangles, const Vector3d& point) const
{
  if (nodes_.empty() || !point.allFinite())
    return std::nullopt;
  const auto squaredTo = [this, &point](std::uint32_t node) {
    const Eigen::AlignedBox3f& box = nodes_[node].box;
    return (point - point.cwiseMax(box.min().cast<double>()).cwiseMin(box.max().cast<double>())).squaredNorm();
  };
  Nearest best;
  double squared = infinite;
  std::array<Visit, 64> stack;
  std::size_t size = 0;
  stack[size++] = {0, squaredTo(0)};
  while (size > 0) {
    const Visit visit = stack[--size];
    if (visit.bound >= squared)
      continue;
    const Node& node = nodes_[visit.node];
    for (std::uint32_t n = node.first; n < node.first + node.count; ++n) {
      const auto corners = CornersOf(points, triangles[members_[n]]);
      const Vector3d weights = NearestWeights(corners, point);
      const double distance = (At(corners, weights) - point).squaredNorm();
      if (distance < squared) {
        squared = distance;
        best.place = {members_[n], weights};
      }
    }
    if (node.count == 0) {
      Visit near{visit.node + 1, squaredTo(visit.node + 1)}, far{node.first, squaredTo(node.first)};
      if (far.bound < near.bound)
        std::swap(near, far);
      stack[size++] = far;
      stack[size++] = near;
    }
  }
  if (!(squared < infinite))
    return std::nullopt; // so far away that its square is no number
  best.distanceMm = std::sqrt(squared);
  return best;
}

std::optional<TriangleTree::Hit> TriangleTree::FirstHit(const std::vector<Eigen::Vector3f>& points,
                                                        const std::vector<Triangle>& triangles, const Vector3d& origin,
                                                        const Vector3d& direction) const
{
  const double length = direction.norm();
  if (nodes_.empty() || !origin.allFinite() || !(length > 0.0) || !std::isfinite(length))
    return std::nullopt;
  const Vector3d unit = direction / length, inverse = unit.cwiseInverse();
  std::optional<Hit> best;
  double reached = infinite;
  std::array<Visit, 64> stack;
  std::size_t size = 0;
  stack[size++] = {0, Enter(nodes_[0].box, origin, inverse)};
  while (size > 0) {
    const Visit visit = stack[--size];
    if (!(visit.bound < reached))
      continue;
    const Node& node = nodes_[visit.node];
    for (std::uint32_t n = node.first; n < node.first + node.count; ++n) {
      Vector3d weights;
      const double at = Meet(CornersOf(points, triangles[members_[n]]), origin, unit, weights);
      if (at < reached) {
        reached = at;
        best = Hit{{members_[n], weights}, at};
      }
    }
    if (node.count == 0) {
      Visit near{visit.node + 1, Enter(nodes_[visit.node + 1].box, origin, inverse)},
          far{node.first, Enter(nodes_[node.first].box, origin, inverse)};
      if (far.bound < near.bound)
        std::swap(near, far);
      stack[size++] = far;
      stack[size++] = near;
    }
  }
  return best;
}

} // namespace echorama
