// SPDX-License-Identifier: BSD-3-Clause
// Every column of the grid along z is a line. It enters and leaves a body where it crosses its triangles; the points between are
// inside while the crossings in one direction outnumber those in the other. Which of two triangles a line through their common
// edge crosses is decided alike for both, so that none slips through. Cost: triangles times the columns that they cover.
#include "TissueLabels.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

struct Crossing {
  std::size_t column;
  double z; // in spacings
  int turn; // +1 where it enters, -1 where it leaves
  bool operator<(const Crossing& other) const { return column != other.column ? column < other.column : z < other.z; }
};

// Twice the signed area of a, b and p: the same number for b, a and p, but for its sign, to the last bit.
double Area(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double x, double y)
{
  const bool swap = b.x() < a.x() || (b.x() == a.x() && b.y() < a.y());
  const Eigen::Vector3d &from = swap ? b : a, &to = swap ? a : b;
  const double area = (to.x() - from.x()) * (y - from.y()) - (to.y() - from.y()) * (x - from.x());
  const double decided = area == 0.0 ? 1e-300 : area;
  return swap ? -decided : decided;
}

void AddCrossings(const std::array<Eigen::Vector3d, 3>& p, const std::array<int, 3>& size, std::vector<Crossing>& crossings)
{
  const auto first = [&p](int axis) { return std::ceil(std::min({p[0][axis], p[1][axis], p[2][axis]})); };
  const auto last = [&p](int axis) { return std::floor(std::max({p[0][axis], p[1][axis], p[2][axis]})); };
  const int left = static_cast<int>(std::clamp(first(0), 0.0, static_cast<double>(size[0])));
  const int right = static_cast<int>(std::clamp(last(0), -1.0, size[0] - 1.0));
  const int low = static_cast<int>(std::clamp(first(1), 0.0, static_cast<double>(size[1])));
  const int high = static_cast<int>(std::clamp(last(1), -1.0, size[1] - 1.0));
  for (int j = low; j <= high; ++j)
    for (int i = left; i <= right; ++i) {
      const double a = Area(p[1], p[2], i, j), b = Area(p[2], p[0], i, j), c = Area(p[0], p[1], i, j), all = a + b + c;
      if ((a > 0.0) != (b > 0.0) || (b > 0.0) != (c > 0.0))
        continue;
      const double z = std::abs(all) > 1e-200 ? (a * p[0].z() + b * p[1].z() + c * p[2].z()) / all : p[0].z();
      const auto column = static_cast<std::size_t>(j) * static_cast<std::size_t>(size[0]) + static_cast<std::size_t>(i);
      crossings.push_back({column, z, a > 0.0 ? -1 : 1});
    }
}

} // namespace

std::vector<std::int32_t> BodiesOn(const TissueSurface& surface, const ImageGeometry& grid, const Progress& progress)
{
  surface.Check();
  grid.Check("the grid of the labels");
  const Eigen::Affine3d toIndex = grid.WorldToIndex();
  std::vector<Eigen::Vector3d> points;
  points.reserve(surface.points.size());
  for (const Eigen::Vector3f& point : surface.points)
    points.emplace_back(toIndex * point.cast<double>());
  std::vector<std::vector<std::size_t>> trianglesOf(surface.bodies.size());
  for (std::size_t n = 0; n < surface.triangles.size(); ++n)
    trianglesOf[static_cast<std::size_t>(surface.bodyOfTriangle[n])].push_back(n);

  std::vector<std::int32_t> labels(grid.VoxelCount(), -1);
  const std::size_t columns = static_cast<std::size_t>(grid.dimensions[0]) * static_cast<std::size_t>(grid.dimensions[1]);
  std::vector<Crossing> crossings;
  for (std::size_t body = 0; body < surface.bodies.size(); ++body) {
    progress(static_cast<double>(body) / static_cast<double>(surface.bodies.size()));
    crossings.clear();
    for (const std::size_t n : trianglesOf[body]) {
      const auto& corners = surface.triangles[n];
      AddCrossings({points[corners[0]], points[corners[1]], points[corners[2]]}, grid.dimensions, crossings);
    }
    std::sort(crossings.begin(), crossings.end());
    int inside = 0;
    for (std::size_t n = 0; n + 1 < crossings.size(); ++n) {
      const Crossing &from = crossings[n], &to = crossings[n + 1];
      inside = n > 0 && crossings[n - 1].column == from.column ? inside + from.turn : from.turn;
      if (to.column != from.column || inside == 0)
        continue;
      const int begin = static_cast<int>(std::clamp(std::ceil(from.z), 0.0, static_cast<double>(grid.dimensions[2])));
      const int end = static_cast<int>(std::clamp(std::ceil(to.z), 0.0, static_cast<double>(grid.dimensions[2])));
      for (int k = begin; k < end; ++k)
        labels[from.column + static_cast<std::size_t>(k) * columns] = static_cast<std::int32_t>(body);
    }
  }
  return labels;
}

} // namespace echorama
