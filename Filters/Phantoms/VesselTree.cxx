// SPDX-License-Identifier: BSD-3-Clause
// The tree grows breadth first, so that wide vessels find their place before narrow ones. At each branching Murray's law fixes
// radii and angles; what is free is the plane. Some planes are tried, and the one whose two children keep
// furthest from everything is taken; with shorter children where long ones find no room.
// Cost: candidates x samples x (branches so far + one look-up of room); below a millisecond for a hundred branches.
#include "VesselTree.h"
#include "Core/Base/Angles.h"
#include "Core/Base/CheckRange.h"
#include "Core/Base/Random.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <Eigen/Geometry>
#include <limits>

namespace echorama {
namespace {

using Eigen::Vector3d;

double DistanceToSegment(const Vector3d& p, const Vector3d& a, const Vector3d& b)
{
  const Vector3d along = b - a;
  const double t = std::clamp((p - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (p - a - t * along).norm();
}

// Least room along a branch that is not there yet. Its beginning lies in its parent and counts only past it.
double RoomAlong(const std::vector<VesselBranch>& tree, int parent, const Vector3d& from, const Vector3d& to, double radius,
                 const VesselRoom& room)
{
  double least = std::numeric_limits<double>::infinity();
  const VesselBranch& last = tree[static_cast<std::size_t>(parent)];
  for (const double t : {0.4, 0.6, 0.8, 1.0}) {
    const Vector3d p = from + t * (to - from);
    least = std::min(least, room(p));
    for (std::size_t i = 0; i < tree.size(); ++i) {
      const VesselBranch& other = tree[i];
      const bool sibling = other.parent == parent || other.parent == last.parent || static_cast<int>(i) == last.parent;
      if (static_cast<int>(i) != parent && !sibling)
        least = std::min(least, DistanceToSegment(p, other.from, other.to) - other.radius);
    }
  }
  return least - radius;
}

} // namespace

ParameterList Describe(VesselTreeParameters& p)
{
  return {
      Parameter("Root", p.root, {-1e6, 1e6}, "mm", "Where the tree begins, in the world."),
      Parameter("Direction", p.direction, {}, "", "Of the first branch; any length above 0."),
      Parameter("RootRadiusMm", p.rootRadiusMm, {0.01, 100}, "mm", "Lumen of the first branch."),
      Parameter("RootLengthMm", p.rootLengthMm, {0.01, 1000}, "mm", "Length of the first branch."),
      Parameter("SmallestRadiusMm", p.smallestRadiusMm, {0.01, 100}, "mm", "No branch is narrower."),
      Parameter("Generations", p.generations, {0, 16}, "", "Branchings from the root to a tip at most."),
      Parameter("LengthOverRadius", p.lengthOverRadius, {3, 100}, "", "Length of the other branches, about."),
      Parameter("Asymmetry", p.asymmetry, {0, 0.6}, "", "By which share the smaller of two branches is narrower, on average."),
  };
}

std::vector<VesselBranch> GrowVessels(const VesselTreeParameters& p, const VesselRoom& room)
{
  CheckRanges(p);
  CheckRange("the length of Direction", p.direction.norm(), 1e-9, 1e9);
  std::vector<VesselBranch> tree;
  std::vector<double> planes{0.0}; // the angle of the plane in which each branch parted from its sibling
  tree.push_back({p.root, p.root + p.rootLengthMm * p.direction.normalized(), p.rootRadiusMm, 0, -1, true});
  for (std::size_t at = 0; at < tree.size(); ++at) {
    const VesselBranch parent = tree[at];
    if (parent.generation == p.generations)
      continue;
    Random random(p.seed, at);
    const double ratio = 1.0 - random.Uniform(0.0, std::min(2.0 * p.asymmetry, 0.75));
    const double r0 = parent.radius, r1 = r0 / std::cbrt(1.0 + ratio * ratio * ratio), r2 = ratio * r1;
    if (r2 < p.smallestRadiusMm)
      continue;
    const auto square = [](double x) { return x * x; };
    const auto angle = [&](double own, double other) {
      const double cosine = (std::pow(r0, 4) + std::pow(own, 4) - std::pow(other, 4)) / (2.0 * square(r0) * square(own));
      return std::acos(std::clamp(cosine, -1.0, 1.0));
    };
    const double angle1 = angle(r1, r2), angle2 = angle(r2, r1);
    const double stretch1 = random.Uniform(0.8, 1.2), stretch2 = random.Uniform(0.8, 1.2);
    const double turn = planes[at] + 0.5 * Pi + random.Uniform(-0.3, 0.3);
    const Vector3d axis = (parent.to - parent.from).normalized(), u = axis.unitOrthogonal(), v = axis.cross(u);

    constexpr int candidates = 16;
    std::array<VesselBranch, 2> best;
    double bestRoom = 0.0, bestPlane = 0.0;
    for (const double length : {1.0, 0.75, 0.55, 0.4}) {
      for (int k = 0; k < candidates; ++k) {
        const double plane = turn + 2.0 * Pi * k / candidates;
        const Vector3d side = std::cos(plane) * u + std::sin(plane) * v;
        const std::array<VesselBranch, 2> children{
            {{parent.to,
              parent.to + length * stretch1 * p.lengthOverRadius * r1 * (std::cos(angle1) * axis + std::sin(angle1) * side), r1,
              parent.generation + 1, static_cast<int>(at), true},
             {parent.to,
              parent.to + length * stretch2 * p.lengthOverRadius * r2 * (std::cos(angle2) * axis - std::sin(angle2) * side), r2,
              parent.generation + 1, static_cast<int>(at), false}}};
        double least = std::numeric_limits<double>::infinity();
        for (const VesselBranch& child : children)
          least = std::min(least, RoomAlong(tree, static_cast<int>(at), child.from, child.to, child.radius, room));
        // Room beyond the vessel's own width is no gain; then planes at right angles to the last are preferred.
        least = std::min(least, r0) * (0.7 + 0.3 * square(std::cos(plane - turn)));
        if (least > bestRoom) {
          bestRoom = least;
          bestPlane = plane;
          best = children;
        }
      }
      if (bestRoom > 0.0)
        break;
    }
    if (bestRoom > 0.0)
      for (const VesselBranch& child : best) {
        tree.push_back(child);
        planes.push_back(bestPlane);
      }
  }
  return tree;
}

std::vector<VesselStem> StemsOf(const std::vector<VesselBranch>& tree)
{
  std::vector<int> next(tree.size(), -1); // the branch that goes on behind each
  for (std::size_t i = 0; i < tree.size(); ++i)
    if (tree[i].parent >= 0 && tree[i].main)
      next[static_cast<std::size_t>(tree[i].parent)] = static_cast<int>(i);
  std::vector<VesselStem> stems;
  for (std::size_t start = 0; start < tree.size(); ++start) {
    if (tree[start].parent >= 0 && tree[start].main)
      continue; // within another's stem
    VesselStem stem;
    const auto direction = [&](int i) {
      const VesselBranch& b = tree[static_cast<std::size_t>(i)];
      return Vector3d((b.to - b.from).normalized());
    };
    Vector3d tangent = direction(static_cast<int>(start));
    double before = tree[start].radius;
    stem.path.push_back(tree[start].from);
    stem.radius.push_back(before);
    for (int i = static_cast<int>(start); i >= 0; i = next[static_cast<std::size_t>(i)]) {
      const VesselBranch& branch = tree[static_cast<std::size_t>(i)];
      const double length = (branch.to - branch.from).norm();
      const int follower = next[static_cast<std::size_t>(i)];
      const Vector3d end = follower >= 0 ? Vector3d((direction(i) + direction(follower)).normalized()) : direction(i);
      const int pieces = std::max(4, static_cast<int>(std::ceil(2.0 * length / branch.radius)));
      for (int k = 1; k <= pieces; ++k) {
        // Hermite's cubic; the radius changes within the first third.
        const double t = static_cast<double>(k) / pieces, s = 1.0 - t;
        stem.path.push_back(s * s * (1.0 + 2.0 * t) * branch.from + t * t * (3.0 - 2.0 * t) * branch.to +
                            length * (t * s * s * tangent - t * t * s * end));
        const double x = std::min(1.0, 3.0 * t);
        stem.radius.push_back(before + (branch.radius - before) * x * x * (3.0 - 2.0 * x));
      }
      tangent = end;
      before = branch.radius;
    }
    stems.push_back(std::move(stem));
  }
  return stems;
}

} // namespace echorama
