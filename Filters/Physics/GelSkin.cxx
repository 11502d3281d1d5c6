// SPDX-License-Identifier: BSD-3-Clause
// Distances are made anew where the box has left what is known, and where tissue moves; of a whole body only the triangles
// above and below the box are looked at. What is known reaches some cells further, so that short parts of a motion share it.
#include "GelSkin.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include "Filters/Tissue/TissueDistance.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

using Eigen::Vector3d;

constexpr double bandCells = 4.0; // of distances; the solver asks within 2.7
constexpr int tileCells = 8;      // boxes are whole tiles
constexpr double spareCells = 6.0;

ImageGeometry GridOf(const Eigen::AlignedBox3d& box, double cell)
{
  ImageGeometry grid;
  grid.spacing.setConstant(cell);
  grid.origin = box.min();
  for (std::size_t axis = 0; axis < 3; ++axis)
    grid.dimensions[axis] = static_cast<int>(std::lround(box.sizes()[static_cast<int>(axis)] / cell)) + 1;
  return grid;
}

// Tissue above and below a box.
struct NearTissue {
  TissueSurface from, to; ///< the latter has the points alone
  double longestWay = 0.0;
};

NearTissue NearTissueOf(const TissueSurface& from, const TissueSurface* to, const Pose& toFrame, const Eigen::AlignedBox3d& box)
{
  std::vector<Eigen::AlignedBox2d> places(from.points.size()); // of the way of each point, across the box
  ParallelRanges(static_cast<std::ptrdiff_t>(places.size()), 4096, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (auto n = static_cast<std::size_t>(begin); n < static_cast<std::size_t>(end); ++n)
      for (const TissueSurface* surface : {&from, to})
        if (surface)
          places[n].extend((toFrame * surface->points[n].cast<double>()).head<2>());
  });
  const Eigen::AlignedBox2d across(box.min().head<2>(), box.max().head<2>());
  NearTissue near;
  near.from.bodies = from.bodies;
  near.from.materials = from.materials;
  std::vector<std::uint32_t> number(places.size(), UINT32_MAX);
  for (std::size_t n = 0; n < from.triangles.size(); ++n) {
    std::array<std::uint32_t, 3> corners = from.triangles[n];
    Eigen::AlignedBox2d place;
    for (const std::uint32_t corner : corners)
      place.extend(places[corner]);
    if (!place.intersects(across))
      continue;
    for (std::uint32_t& corner : corners) {
      const std::size_t old = corner;
      if (number[old] == UINT32_MAX) {
        number[old] = static_cast<std::uint32_t>(near.from.points.size());
        near.from.points.push_back(from.points[old]);
        if (to) {
          near.to.points.push_back(to->points[old]);
          near.longestWay = std::max(near.longestWay, (to->points[old] - from.points[old]).cast<double>().norm());
        }
      }
      corner = number[old];
    }
    near.from.triangles.push_back(corners);
    near.from.bodyOfTriangle.push_back(from.bodyOfTriangle[n]);
  }
  return near;
}

// How far the point of a triangle that is nearest to a place goes.
Eigen::Vector3f ShiftAt(const Vector3d& place, const NearTissue& near, const std::array<std::uint32_t, 3>& corners)
{
  std::array<Vector3d, 3> p;
  for (std::size_t n = 0; n < 3; ++n)
    p[n] = near.from.points[corners[n]].cast<double>();
  const Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]);
  Vector3d weight = Vector3d::Ones();
  if (normal.squaredNorm() > 0.0) {
    for (std::size_t n = 0; n < 3; ++n) {
      const Vector3d &a = p[(n + 1) % 3], &b = p[(n + 2) % 3];
      weight[static_cast<int>(n)] = std::max((b - a).cross(place - a).dot(normal), 0.0); // 0 at the other side
    }
  }
  weight /= weight.sum();
  Vector3d shift = Vector3d::Zero();
  for (std::size_t n = 0; n < 3; ++n)
    shift += weight[static_cast<int>(n)] * (near.to.points[corners[n]] - near.from.points[corners[n]]).cast<double>();
  return shift.cast<float>();
}

} // namespace

GelSkin::GelSkin(const TissueSurface& tissue, const Pose& frame, double cellMm) : tissue_(tissue), frame_(frame), cellMm_(cellMm)
{
  tissue_.Check();
}

void GelSkin::Move(const TissueSurface* next, Eigen::AlignedBox3d box, const Progress& progress)
{
  if (next) {
    next->Check();
    if (next->points.size() != tissue_.points.size() || next->triangles != tissue_.triangles)
      throw Error(Error::Kind::BadInput, "the tissue that is pressed has " + NumberText(next->points.size()) + " points and " +
                                             NumberText(next->triangles.size()) + " triangles; at rest it has " +
                                             NumberText(tissue_.points.size()) + " and " + NumberText(tissue_.triangles.size()) +
                                             ", and they must be the same");
    if (next->points == tissue_.points)
      next = nullptr;
  }
  const bool isKnown = now_ && known_.contains(box);
  before_ = now_;
  moving_ = nullptr;
  if (isKnown && !next)
    return;

  if (!isKnown) {
    const double tile = tileCells * cellMm_, spare = spareCells * cellMm_;
    known_.min() = ((box.min().array() - spare) / tile).floor() * tile;
    known_.max() = ((box.max().array() + spare) / tile).ceil() * tile;
  }
  const ImageGeometry grid = GridOf(known_, cellMm_), inWorld = grid.Moved(frame_);
  NearTissue near = NearTissueOf(tissue_, next, frame_.inverse(), known_);
  const double band = bandCells * cellMm_ + near.longestWay; // or what lies between begin and end would be wrong
  std::vector<std::int32_t> nearest;
  std::vector<float> distances = DistancesOn(near.from, inWorld, band, progress.Part(0.0, 0.5), &nearest);
  before_ = now_ = std::make_shared<const GelDistanceGrid>(grid, distances);
  if (next) {
    std::vector<Eigen::Vector3f> shifts(nearest.size(), Eigen::Vector3f::Zero());
    const Eigen::Affine3d toWorld = inWorld.IndexToWorld();
    const Eigen::Matrix3f turn = frame_.linear().transpose().cast<float>();
    ParallelFor(grid.dimensions[2], [&](std::ptrdiff_t k) {
      auto n = static_cast<std::size_t>(k) * static_cast<std::size_t>(grid.dimensions[0] * grid.dimensions[1]);
      for (int j = 0; j < grid.dimensions[1]; ++j)
        for (int i = 0; i < grid.dimensions[0]; ++i, ++n)
          if (nearest[n] >= 0)
            shifts[n] = turn * ShiftAt(toWorld * Vector3d(i, j, static_cast<double>(k)), near,
                                       near.from.triangles[static_cast<std::size_t>(nearest[n])]);
    });
    near.from.points = std::move(near.to.points);
    std::vector<float> after = DistancesOn(near.from, inWorld, band, progress.Part(0.5, 1.0));
    now_ = std::make_shared<const GelDistanceGrid>(grid, after);
    moving_ = std::make_shared<const GelDistanceGrid>(grid, std::move(distances), std::move(after), std::move(shifts));
    tissue_.points = next->points;
  }
}

} // namespace echorama
