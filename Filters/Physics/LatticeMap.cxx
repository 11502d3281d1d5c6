// SPDX-License-Identifier: BSD-3-Clause
// Only the order of a point's fractions decides which tetrahedron holds it, so there is nothing to search: a floor, three
// comparisons, four corners. A corner without weight is not looked at; so a point on the outermost face of what exists is found,
// from whichever side rounding puts it.
#include "LatticeMap.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <cmath>

namespace echorama {

namespace {

constexpr double latticeSlack = 1e-9; // index units, and weights
constexpr double longestDisplacement = 1e6;

std::string LatticePointText(const std::array<int, 3>& cell)
{
  return "(" + std::to_string(cell[0]) + ", " + std::to_string(cell[1]) + ", " + std::to_string(cell[2]) + ")";
}

std::array<double, 4> PlaceWeights(const LatticeMap::Place& place)
{
  const Eigen::Vector3d& f = place.fractions;
  return {1.0 - f[0], f[0] - f[1], f[1] - f[2], f[2]};
}

std::array<std::array<int, 3>, 4> PlaceCorners(const LatticeMap::Place& place)
{
  std::array<std::array<int, 3>, 4> corners;
  corners.fill(place.cell);
  for (std::size_t corner = 1; corner < 4; ++corner)
    for (std::size_t step = 0; step < corner; ++step)
      ++corners[corner][static_cast<std::size_t>(place.order[step])];
  return corners;
}

} // namespace

LatticeMap::LatticeMap(const ImageGeometry& lattice, std::vector<Eigen::Vector3d> displacements,
                       std::vector<unsigned char> exists)
  : lattice_(lattice), displacements_(std::move(displacements)), exists_(std::move(exists))
{
  const std::string name = "the lattice of the displacement";
  lattice.Check(name);
  const auto& n = lattice.dimensions;
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (n[axis] < 2)
      throw Error(Error::Kind::BadInput,
                  name + " has a single point along axis " + std::to_string(axis) + "; tetrahedra need two");
  if (displacements_.size() != lattice.VoxelCount() || (!exists_.empty() && exists_.size() != lattice.VoxelCount()))
    throw Error(Error::Kind::BadInput, name + " has " + std::to_string(lattice.VoxelCount()) + " points, and " +
                                           std::to_string(displacements_.size()) + " vectors");
  worldToIndex_ = lattice.WorldToIndex();
  indexToWorld_ = lattice.IndexToWorld();
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        if (!Exists(i, j, k))
          continue;
        const double length = Displacement(i, j, k).norm();
        if (!(length <= longestDisplacement))
          throw Error(Error::Kind::BadInput, "the displacement at lattice point " + LatticePointText({i, j, k}) +
                                                 " is not finite, or longer than 1e6 mm");
        longest_ = std::max(longest_, length);
      }
}

std::optional<LatticeMap::Place> LatticeMap::Find(const Eigen::Vector3d& index, bool nearest) const
{
  Place place;
  double fractions[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double last = lattice_.dimensions[axis] - 1;
    double x = index[static_cast<Eigen::Index>(axis)];
    if (!(x >= -latticeSlack && x <= last + latticeSlack)) {
      if (!nearest || !std::isfinite(x))
        return std::nullopt;
      place.beyond[axis] = true;
    }
    x = std::clamp(x, 0.0, last);
    place.cell[axis] = std::min(static_cast<int>(x), lattice_.dimensions[axis] - 2);
    fractions[axis] = x - place.cell[axis];
  }
  place.order = {0, 1, 2};
  const auto sort = [&](std::size_t a, std::size_t b) { // stable: of equal fractions the first axis comes first
    if (fractions[place.order[a]] < fractions[place.order[b]])
      std::swap(place.order[a], place.order[b]);
  };
  sort(0, 1);
  sort(1, 2);
  sort(0, 1);
  for (std::size_t step = 0; step < 3; ++step)
    place.fractions[static_cast<Eigen::Index>(step)] = fractions[place.order[step]];
  if (!exists_.empty()) {
    const auto weights = PlaceWeights(place);
    const auto corners = PlaceCorners(place);
    for (std::size_t c = 0; c < 4; ++c)
      if (weights[c] > latticeSlack && !Exists(corners[c][0], corners[c][1], corners[c][2]))
        return std::nullopt;
  }
  return place;
}

Eigen::Vector3d LatticeMap::DisplacementAt(const Place& place) const
{
  const auto weights = PlaceWeights(place);
  const auto corners = PlaceCorners(place);
  Eigen::Vector3d u = Eigen::Vector3d::Zero();
  for (std::size_t c = 0; c < 4; ++c)
    if (Exists(corners[c][0], corners[c][1], corners[c][2])) // what does not exist has no weight
      u += weights[c] * Displacement(corners[c][0], corners[c][1], corners[c][2]);
  return u;
}

bool LatticeMap::IsWhole(const Place& place) const
{
  for (const auto& corner : PlaceCorners(place))
    if (!Exists(corner[0], corner[1], corner[2]))
      return false;
  return true;
}

Eigen::Matrix3d LatticeMap::GradientAt(const Place& given) const
{
  Place place = given;
  if (!IsWhole(place)) {
    Eigen::Vector3d index;
    for (std::size_t step = 0; step < 3; ++step)
      index[given.order[step]] =
          given.cell[static_cast<std::size_t>(given.order[step])] + given.fractions[static_cast<Eigen::Index>(step)];
    bool found = false;
    // Towards the six tetrahedra of each of the eight cells that may touch the place.
    for (int octant = 0; octant < 8 && !found; ++octant)
      for (int order = 0; order < 6 && !found; ++order) {
        Eigen::Vector3d nudge;
        for (int step = 0; step < 3; ++step)
          nudge[latticeOrders[order][step]] = 1e-6 * (3 - step);
        for (int axis = 0; axis < 3; ++axis)
          if (octant >> axis & 1)
            nudge[axis] = -nudge[axis];
        if (const auto beside = Find(index + nudge, false); beside && IsWhole(*beside)) {
          place = *beside;
          found = true;
        }
      }
    if (!found)
      return Eigen::Matrix3d::Identity();
  }
  const auto corners = PlaceCorners(place);
  Eigen::Matrix3d slope = Eigen::Matrix3d::Zero(); // of u by the index
  for (std::size_t step = 0; step < 3; ++step) {
    const auto axis = static_cast<std::size_t>(place.order[step]);
    if (!given.beyond[axis])
      slope.col(static_cast<Eigen::Index>(axis)) =
          Displacement(corners[step + 1][0], corners[step + 1][1], corners[step + 1][2]) -
          Displacement(corners[step][0], corners[step][1], corners[step][2]);
  }
  return Eigen::Matrix3d::Identity() + slope * worldToIndex_.linear();
}

} // namespace echorama
