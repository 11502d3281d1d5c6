// SPDX-License-Identifier: BSD-3-Clause
// Every triangle that has space outside of all bodies beside it tells its distance to the points of the grid around it; the sign
// is whether a body holds the point. Of the triangles near the outside, those count of which some place bounds it: for that,
// lines along z from both of its sides are followed to the outside. Slabs of the grid are worked on side by side. Cost: triangles
// times the points in the band.
#include "TissueDistance.h"
#include "Core/Base/CheckRange.h"
#include "Core/Base/Parallel.h"
#include "TissueLabels.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

using Eigen::Vector3d;

struct NearTriangle {
  std::array<Vector3d, 3> point; // mm, in the frame of the grid
  std::array<int, 3> low, high;  // points of the grid within the band
  std::int32_t index;
};

double SquaredToSegment(const Vector3d& p, const Vector3d& a, const Vector3d& b)
{
  const Vector3d along = b - a;
  const double length = along.squaredNorm();
  const double part = length > 0.0 ? std::clamp((p - a).dot(along) / length, 0.0, 1.0) : 0.0;
  return (p - a - part * along).squaredNorm();
}

double SquaredToTriangle(const Vector3d& p, const std::array<Vector3d, 3>& t)
{
  const Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
  bool within = true;
  for (std::size_t n = 0; n < 3 && within; ++n)
    within = (t[(n + 1) % 3] - t[n]).cross(p - t[n]).dot(normal) >= 0.0;
  if (within && normal.squaredNorm() > 0.0) {
    const double height = (p - t[0]).dot(normal);
    return height * height / normal.squaredNorm();
  }
  return std::min({SquaredToSegment(p, t[0], t[1]), SquaredToSegment(p, t[1], t[2]), SquaredToSegment(p, t[2], t[0])});
}

// The points of the grid within a distance of a triangle's box. \returns whether there are any.
bool SetBox(NearTriangle& corners, const ImageGeometry& grid, double distance)
{
  for (int axis = 0; axis < 3; ++axis) {
    const auto n = static_cast<std::size_t>(axis);
    const auto& p = corners.point;
    const double low = std::min({p[0][axis], p[1][axis], p[2][axis]}) - distance;
    const double high = std::max({p[0][axis], p[1][axis], p[2][axis]}) + distance;
    const double last = grid.dimensions[n] - 1.0;
    corners.low[n] = static_cast<int>(std::clamp(std::ceil(low / grid.spacing[axis]), 0.0, last + 1.0));
    corners.high[n] = static_cast<int>(std::clamp(std::floor(high / grid.spacing[axis]), -1.0, last));
    if (corners.low[n] > corners.high[n])
      return false;
  }
  return true;
}

// All triangles by the column of the grid, a spacing wide, that they lie in.
class Columns {
public:
  Columns(const TissueSurface& surface, const ImageGeometry& grid) : surface_(surface), grid_(grid)
  {
    const Eigen::Affine3d toIndex = grid.WorldToIndex();
    points_.reserve(surface.points.size());
    for (const Eigen::Vector3f& point : surface.points)
      points_.emplace_back(toIndex * point.cast<double>());
    start_.assign(static_cast<std::size_t>(grid.dimensions[0]) * static_cast<std::size_t>(grid.dimensions[1]) + 1, 0);
    ForAll([this](std::size_t column, std::int32_t) { ++start_[column + 1]; });
    for (std::size_t column = 1; column < start_.size(); ++column)
      start_[column] += start_[column - 1];
    triangles_.resize(start_.back());
    std::vector<std::size_t> next = start_;
    ForAll([&](std::size_t column, std::int32_t triangle) { triangles_[next[column]++] = triangle; });
  }

  /// Whether a triangle has space outside of all bodies on either side, somewhere above the grid.
  bool BoundsOutside(std::int32_t triangle) const
  {
    const Vector3d &a = At(triangle, 0), &b = At(triangle, 1), &c = At(triangle, 2);
    const Vector3d across = (b - a).cross(c - a);
    if (!(across.norm() > 0.0))
      return false;
    const Vector3d aside = 1e-3 * across.normalized();
    const int parts = std::clamp(static_cast<int>(std::ceil(std::max((b - a).norm(), (c - a).norm()))), 2, 256);
    bool isAbove = false;
    for (int i = 0; i < parts; ++i)
      for (int j = 0; i + j < parts; ++j) {
        const Vector3d place = a + (i + 0.31) / parts * (b - a) + (j + 0.36) / parts * (c - a);
        for (const double side : {1.0, -1.0}) {
          const Vector3d point = place + side * aside;
          const std::ptrdiff_t column = ColumnOf(std::floor(point.x()), std::floor(point.y()));
          if (column < 0)
            continue;
          isAbove = true;
          if (!IsInside(point, static_cast<std::size_t>(column)))
            return true;
        }
      }
    return !isAbove; // nobody knows
  }

private:
  const Vector3d& At(std::int32_t triangle, std::size_t corner) const
  {
    return points_[surface_.triangles[static_cast<std::size_t>(triangle)][corner]];
  }
  std::ptrdiff_t ColumnOf(double x, double y) const
  {
    const bool isThere = x >= 0.0 && y >= 0.0 && x < grid_.dimensions[0] && y < grid_.dimensions[1];
    return isThere ? static_cast<std::ptrdiff_t>(y) * grid_.dimensions[0] + static_cast<std::ptrdiff_t>(x) : -1;
  }
  template <class Function>
  void ForAll(const Function& function) const
  {
    for (std::int32_t triangle = 0; triangle < static_cast<std::int32_t>(surface_.triangles.size()); ++triangle) {
      Eigen::Vector2d low = At(triangle, 0).head<2>(), high = low;
      for (const std::size_t corner : {1, 2}) {
        low = low.cwiseMin(At(triangle, corner).head<2>());
        high = high.cwiseMax(At(triangle, corner).head<2>());
      }
      low = low.array().floor().max(0.0);
      high = high.array().floor().min(Eigen::Array2d(grid_.dimensions[0] - 1.0, grid_.dimensions[1] - 1.0));
      for (double y = low.y(); y <= high.y(); y += 1.0)
        for (double x = low.x(); x <= high.x(); x += 1.0)
          function(static_cast<std::size_t>(ColumnOf(x, y)), triangle);
    }
  }
  bool IsInside(const Vector3d& point, std::size_t column) const
  {
    std::vector<int> turns; // of bodies around the point, from there on
    for (std::size_t n = start_[column]; n < start_[column + 1]; ++n) {
      const Vector3d &a = At(triangles_[n], 0), &b = At(triangles_[n], 1), &c = At(triangles_[n], 2);
      const auto area = [&point](const Vector3d& p, const Vector3d& q) {
        return (q.x() - p.x()) * (point.y() - p.y()) - (q.y() - p.y()) * (point.x() - p.x());
      };
      const double u = area(b, c), v = area(c, a), w = area(a, b), all = u + v + w;
      if ((u > 0.0) != (v > 0.0) || (v > 0.0) != (w > 0.0) || all == 0.0 ||
          (u * a.z() + v * b.z() + w * c.z()) / all <= point.z())
        continue;
      const auto body = static_cast<std::size_t>(surface_.bodyOfTriangle[static_cast<std::size_t>(triangles_[n])]);
      turns.resize(std::max(turns.size(), body + 1));
      turns[body] += all > 0.0 ? 1 : -1;
    }
    return std::any_of(turns.begin(), turns.end(), [](int turn) { return turn != 0; });
  }

  const TissueSurface& surface_;
  const ImageGeometry& grid_;
  std::vector<Vector3d> points_; // in spacings
  std::vector<std::size_t> start_;
  std::vector<std::int32_t> triangles_;
};

} // namespace

std::vector<float> DistancesOn(const TissueSurface& surface, const ImageGeometry& grid, double band, const Progress& progress,
                               std::vector<std::int32_t>* nearest)
{
  CheckRange("the band of distances", band, 1e-9, 1e9);
  const std::vector<std::int32_t> bodies = BodiesOn(surface, grid, progress.Part(0.0, 0.3));
  const auto at = [&grid](int i, int j, int k) {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(grid.dimensions[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(grid.dimensions[0]) +
           static_cast<std::size_t>(i);
  };
  const auto anyOutside = [&](const NearTriangle& box) {
    for (int k = box.low[2]; k <= box.high[2]; ++k)
      for (int j = box.low[1]; j <= box.high[1]; ++j)
        for (int i = box.low[0]; i <= box.high[0]; ++i)
          if (bodies[at(i, j, k)] < 0)
            return true;
    return false;
  };

  const Eigen::Affine3d toIndex = grid.WorldToIndex();
  const Columns columns(surface, grid);
  constexpr std::ptrdiff_t atOnce = 1024;
  const auto all = static_cast<std::ptrdiff_t>(surface.triangles.size());
  std::vector<std::vector<NearTriangle>> parts(static_cast<std::size_t>((all + atOnce - 1) / atOnce));
  ParallelRanges(all, atOnce, progress.Part(0.3, 0.5), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t triangle = begin; triangle < end; ++triangle) {
      NearTriangle corners;
      corners.index = static_cast<std::int32_t>(triangle);
      for (std::size_t n = 0; n < 3; ++n) {
        const std::uint32_t point = surface.triangles[static_cast<std::size_t>(triangle)][n];
        corners.point[n] = (toIndex * surface.points[point].cast<double>()).cwiseProduct(grid.spacing);
      }
      if (SetBox(corners, grid, grid.spacing.maxCoeff()) && anyOutside(corners) && columns.BoundsOutside(corners.index) &&
          SetBox(corners, grid, band))
        parts[static_cast<std::size_t>(begin / atOnce)].push_back(corners);
    }
  });
  std::vector<NearTriangle> triangles; // in their order
  for (const std::vector<NearTriangle>& part : parts)
    triangles.insert(triangles.end(), part.begin(), part.end());

  std::vector<float> distances(bodies.size());
  if (nearest)
    nearest->assign(bodies.size(), -1);
  ParallelFor(grid.dimensions[2], progress.Part(0.5, 1.0), [&](std::ptrdiff_t slab) {
    const int k = static_cast<int>(slab);
    const std::size_t count = at(0, 0, 1);
    std::vector<double> squared(count, band * band);
    for (const NearTriangle& corners : triangles) {
      if (k < corners.low[2] || k > corners.high[2])
        continue;
      for (int j = corners.low[1]; j <= corners.high[1]; ++j)
        for (int i = corners.low[0]; i <= corners.high[0]; ++i) {
          const double own = SquaredToTriangle(Vector3d(i, j, k).cwiseProduct(grid.spacing), corners.point);
          double& least = squared[at(i, j, 0)];
          if (own >= least)
            continue;
          least = own;
          if (nearest)
            (*nearest)[at(i, j, k)] = corners.index;
        }
    }
    for (std::size_t n = 0; n < count; ++n) {
      const double distance = std::sqrt(squared[n]);
      distances[at(0, 0, k) + n] = static_cast<float>(bodies[at(0, 0, k) + n] < 0 ? distance : -distance);
    }
  });
  return distances;
}

} // namespace echorama
