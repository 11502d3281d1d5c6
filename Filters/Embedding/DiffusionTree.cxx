// SPDX-License-Identifier: BSD-3-Clause
//
// A binary tree: boxes are cut in the middle of their longest side until eight sources are left. Moments are gathered from the
// leaves upwards.
//
// The third term of the expansion is at most C (e / r)^3 of a cluster's weight, with C = d (d + 1) (d + 2) / 6 (the Gegenbauer
// polynomial at 1), e its radius and r its distance. That share counts in full where the cluster outweighs the nearest source;
// where it weighs less, in that proportion. A cluster that weighs next to nothing is left out. So one rule serves all d: for
// small ones the tree opens by angle, for large ones it forgets what is far.
#include "DiffusionTree.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace echorama {

namespace {

constexpr int LeafSize = 8;
constexpr int MomentCount = 10;
constexpr int SummedSources = 6; // an expansion costs about as much as this many

double SquaredGap(const Eigen::Vector3d& point, const Eigen::Vector3d& low, const Eigen::Vector3d& high)
{
  return (low - point).cwiseMax(point - high).cwiseMax(0.0).squaredNorm();
}

} // namespace

DiffusionTree::DiffusionTree(const std::vector<std::array<int, 3>>& voxels, const Eigen::Vector3d& spacing,
                             const std::vector<std::vector<float>>& rows, double exponent)
  : exponent_(exponent), rows_(static_cast<int>(rows.size())), values_(rows.size())
{
  for (const auto& voxel : voxels)
    places_.emplace_back(voxel[0] * spacing[0], voxel[1] * spacing[1], voxel[2] * spacing[2]);
  std::vector<int> order(voxels.size());
  std::iota(order.begin(), order.end(), 0);
  Divide(order);
  std::vector<Eigen::Vector3d> places;
  for (const int s : order)
    places.push_back(places_[static_cast<std::size_t>(s)]);
  places_.swap(places);
  for (std::size_t row = 0; row < rows.size(); ++row)
    for (const int s : order)
      values_[row].push_back(rows[row][static_cast<std::size_t>(s)]);
  moments_.assign(clusters_.size() * rows.size() * MomentCount, 0.0);
  terms_.assign(clusters_.size() * rows.size() * DiffusionFar::Terms, 0.0f);
  for (int number = static_cast<int>(clusters_.size()) - 1; number >= 0; --number) // children come after their parents
    Expand(number);
}

void DiffusionTree::Divide(std::vector<int>& order)
{
  clusters_.emplace_back();
  clusters_[0].count = static_cast<int>(order.size());
  for (std::size_t number = 0; number < clusters_.size(); ++number) {
    Cluster cluster = clusters_[number];
    const auto begin = order.begin() + cluster.first, end = begin + cluster.count;
    cluster.low = cluster.high = places_[static_cast<std::size_t>(*begin)];
    for (auto s = begin; s != end; ++s) {
      const Eigen::Vector3d& place = places_[static_cast<std::size_t>(*s)];
      cluster.low = cluster.low.cwiseMin(place);
      cluster.high = cluster.high.cwiseMax(place);
    }
    if (cluster.count > LeafSize) {
      Eigen::Index axis = 0;
      (cluster.high - cluster.low).maxCoeff(&axis);
      const double middle = 0.5 * (cluster.low[axis] + cluster.high[axis]);
      // Both sides have something: sources are on voxels of their own, so the longest side is not 0.
      const auto cut =
          std::stable_partition(begin, end, [&](int s) { return places_[static_cast<std::size_t>(s)][axis] <= middle; });
      cluster.child = static_cast<int>(clusters_.size());
      Cluster lower, upper;
      lower.first = cluster.first;
      lower.count = static_cast<int>(cut - begin);
      upper.first = cluster.first + lower.count;
      upper.count = cluster.count - lower.count;
      clusters_.push_back(lower);
      clusters_.push_back(upper);
    }
    clusters_[number] = cluster;
  }
}

void DiffusionTree::Expand(int number)
{
  Cluster& cluster = clusters_[static_cast<std::size_t>(number)];
  const auto rows = static_cast<std::size_t>(rows_);
  const auto momentsOf = [&](int of, std::size_t row) {
    return moments_.data() + (static_cast<std::size_t>(of) * rows + row) * MomentCount;
  };
  const auto add = [](double* m, const double* from, const Eigen::Vector3d& e) { // from: about a point that is off by e
    const double sum = from[0];
    const Eigen::Vector3d first(from[1], from[2], from[3]);
    m[0] += sum;
    for (int a = 0; a < 3; ++a)
      m[1 + a] += first[a] + sum * e[a];
    for (int a = 0, at = 4; a < 3; ++a)
      for (int b = a; b < 3; ++b, ++at)
        m[at] += from[at] + first[a] * e[b] + first[b] * e[a] + sum * e[a] * e[b];
  };

  cluster.centre.setZero();
  const Eigen::Vector3d widest = 0.5 * (cluster.high - cluster.low);
  if (cluster.child < 0) {
    for (int s = cluster.first; s < cluster.first + cluster.count; ++s)
      cluster.centre += places_[static_cast<std::size_t>(s)] / cluster.count;
    cluster.radius = 0.0;
    for (int s = cluster.first; s < cluster.first + cluster.count; ++s) {
      const Eigen::Vector3d e = places_[static_cast<std::size_t>(s)] - cluster.centre;
      cluster.radius = std::max(cluster.radius, e.norm());
      for (std::size_t row = 0; row < rows; ++row) {
        const double one[MomentCount] = {values_[row][static_cast<std::size_t>(s)]};
        add(momentsOf(number, row), one, e);
      }
    }
  } else {
    for (const int child : {cluster.child, cluster.child + 1}) {
      const Cluster& part = clusters_[static_cast<std::size_t>(child)];
      cluster.centre += part.centre * (static_cast<double>(part.count) / cluster.count);
    }
    double byParts = 0.0;
    for (const int child : {cluster.child, cluster.child + 1}) {
      const Cluster& part = clusters_[static_cast<std::size_t>(child)];
      const Eigen::Vector3d e = part.centre - cluster.centre;
      byParts = std::max(byParts, e.norm() + part.radius);
      for (std::size_t row = 0; row < rows; ++row)
        add(momentsOf(number, row), momentsOf(child, row), e);
    }
    const double byBox = (widest + (cluster.centre - 0.5 * (cluster.high + cluster.low)).cwiseAbs()).norm();
    cluster.radius = std::min(byParts, byBox);
  }

  const double d = exponent_, twice = d * (d + 2.0);
  for (std::size_t row = 0; row < rows; ++row) {
    const double* const m = momentsOf(number, row);
    float* const t = terms_.data() + (static_cast<std::size_t>(number) * rows + row) * DiffusionFar::Terms;
    const double factors[MomentCount] = {1.0, d, d, d, 0.5 * twice, twice, twice, 0.5 * twice, twice, 0.5 * twice};
    for (int a = 0; a < MomentCount; ++a)
      t[a] = static_cast<float>(factors[a] * m[a]);
    t[MomentCount] = static_cast<float>(-0.5 * d * (m[4] + m[7] + m[9]));
  }
}

void DiffusionTree::List(const DiffusionExponent& exponent, const DiffusionTolerance& tolerance, const Eigen::Vector3d& low,
                         const Eigen::Vector3d& high, double nearest, const Eigen::Vector3d& origin, DiffusionNear& near,
                         DiffusionFar& far) const
{
  const auto rows = static_cast<std::size_t>(rows_);
  const double third = exponent.d * (exponent.d + 1.0) * (exponent.d + 2.0) / 6.0;
  const double nearest2 = nearest * nearest;
  near.Clear(rows_);
  far.x.clear();
  far.y.clear();
  far.z.clear();
  far.moments.clear();
  std::array<int, 128> stack;
  std::size_t waiting = 0;
  stack[waiting++] = 0;
  while (waiting > 0) {
    const int number = stack[--waiting];
    const Cluster& cluster = clusters_[static_cast<std::size_t>(number)];
    // Its weight against that of a nearest source: at most
    const double gap2 = (cluster.low - high).cwiseMax(low - cluster.high).cwiseMax(0.0).squaredNorm();
    const double share = gap2 > nearest2
                             ? cluster.count * static_cast<double>(exponent.Weight(static_cast<float>(nearest2 / gap2)))
                             : cluster.count;
    if (share < tolerance.left)
      continue;
    const double distance2 = SquaredGap(cluster.centre, low, high);
    const bool few = cluster.count <= SummedSources;
    if (!few && distance2 > cluster.radius * cluster.radius) {
      const double ratio2 = cluster.radius * cluster.radius / distance2;
      if (third * ratio2 * std::sqrt(ratio2) * std::min(1.0, share) <= tolerance.expansion) {
        far.x.push_back(static_cast<float>(cluster.centre[0] - origin[0]));
        far.y.push_back(static_cast<float>(cluster.centre[1] - origin[1]));
        far.z.push_back(static_cast<float>(cluster.centre[2] - origin[2]));
        const float* const terms = terms_.data() + static_cast<std::size_t>(number) * rows * DiffusionFar::Terms;
        far.moments.insert(far.moments.end(), terms, terms + rows * DiffusionFar::Terms);
        continue;
      }
    }
    if (few || cluster.child < 0) {
      for (auto s = static_cast<std::size_t>(cluster.first); s < static_cast<std::size_t>(cluster.first + cluster.count); ++s) {
        near.x.push_back(static_cast<float>(places_[s][0] - origin[0]));
        near.y.push_back(static_cast<float>(places_[s][1] - origin[1]));
        near.z.push_back(static_cast<float>(places_[s][2] - origin[2]));
        for (std::size_t row = 0; row < rows; ++row)
          near.values[row].push_back(values_[row][s]);
      }
      continue;
    }
    stack[waiting++] = cluster.child;
    stack[waiting++] = cluster.child + 1;
  }
  near.Pad(rows_);
}

double DiffusionTree::SquaredDistance(const Eigen::Vector3d& point) const
{
  double best = std::numeric_limits<double>::infinity();
  std::array<int, 128> stack;
  std::size_t waiting = 0;
  stack[waiting++] = 0;
  while (waiting > 0) {
    const Cluster& cluster = clusters_[static_cast<std::size_t>(stack[--waiting])];
    if (SquaredGap(point, cluster.low, cluster.high) >= best)
      continue;
    if (cluster.child < 0) {
      for (int s = cluster.first; s < cluster.first + cluster.count; ++s)
        best = std::min(best, (places_[static_cast<std::size_t>(s)] - point).squaredNorm());
      continue;
    }
    const Cluster& lower = clusters_[static_cast<std::size_t>(cluster.child)];
    const Cluster& upper = clusters_[static_cast<std::size_t>(cluster.child + 1)];
    const bool lowerFirst = SquaredGap(point, lower.low, lower.high) < SquaredGap(point, upper.low, upper.high);
    stack[waiting++] = lowerFirst ? cluster.child + 1 : cluster.child; // the nearer one comes off first
    stack[waiting++] = lowerFirst ? cluster.child : cluster.child + 1;
  }
  return best;
}

} // namespace echorama
