// SPDX-License-Identifier: BSD-3-Clause
// A tetrahedron that goes over its corners m0 ... m3 holds y = m0 + f1 (m1 - m0) + f2 (m2 - m1) + f3 (m3 - m2): one 3x3 inverse
// turns y into the sorted fractions of where it was, exactly. Neighbours agree on their common face to rounding, so within a
// tolerance that covers it a point may belong to either; inside of two it is ambiguous, since space overlaps there.
#include "DeformedCells.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include <cmath>

namespace echorama {

DeformedCells::DeformedCells(const LatticeMap& map, const Eigen::Affine3d& worldToTarget, double reach) : map_(map)
{
  constexpr int mostLayers = 48; // beyond them layers become thicker
  if (reach > 0.0) {
    if (!(reach < 1e6))
      throw Error(Error::Kind::TooLarge, "what is deformed lies too far from the lattice of the displacement");
    layers_ = std::min(mostLayers, static_cast<int>(std::ceil(reach)));
    step_ = std::max(1.0, reach / layers_);
  }
  const auto& n = map.Lattice().dimensions;
  double count = 1.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    cells_[axis] = n[axis] - 1 + 2 * layers_;
    count *= cells_[axis] + 1;
  }
  if (count > static_cast<double>(1 << 28))
    throw Error(Error::Kind::TooLarge, "the lattice of the displacement has more than 2^28 points");
  points_.resize(static_cast<std::size_t>(count));
  const Eigen::Affine3d indexToTarget = worldToTarget * map.IndexToWorld();
  volume_ = indexToTarget.linear().determinant();
  const std::ptrdiff_t row = cells_[0] + 1, slice = row * (cells_[1] + 1);
  ParallelFor(cells_[2] + 1, [&](std::ptrdiff_t slab) {
    const int k = static_cast<int>(slab);
    Eigen::Vector3d* point = points_.data() + slab * slice;
    for (int j = 0; j <= cells_[1]; ++j)
      for (int i = 0; i <= cells_[0]; ++i, ++point) {
        const int c[3] = {Clamped(i, 0), Clamped(j, 1), Clamped(k, 2)};
        *point = indexToTarget * Eigen::Vector3d(RestAt(i, 0), RestAt(j, 1), RestAt(k, 2));
        if (map_.Exists(c[0], c[1], c[2]))
          *point += worldToTarget.linear() * map_.Displacement(c[0], c[1], c[2]);
      }
  });
  for (const auto& point : points_)
    largest_ = std::max(largest_, point.cwiseAbs().maxCoeff());
}

double DeformedCells::Ratio(int i, int j, int k, int order) const
{
  int at[3] = {i, j, k};
  if (!Exists(i, j, k))
    return std::numeric_limits<double>::quiet_NaN();
  Eigen::Vector3d before = Point(i, j, k);
  Eigen::Matrix3d edges;
  double size = volume_;
  for (int step = 0; step < 3; ++step) {
    const int axis = latticeOrders[order][step];
    size *= RestAt(at[axis] + 1, axis) - RestAt(at[axis], axis);
    ++at[axis];
    if (!Exists(at[0], at[1], at[2]))
      return std::numeric_limits<double>::quiet_NaN();
    const Eigen::Vector3d& corner = Point(at[0], at[1], at[2]);
    edges.col(axis) = corner - before;
    before = corner;
  }
  return edges.determinant() / size;
}

bool DeformedCells::Tetrahedron(int i, int j, int k, int order, DeformedTetrahedron& t) const
{
  const double ratio = Ratio(i, j, k, order);
  if (!(std::abs(ratio) > latticeFoldedRatio)) // not there, or flat
    return false;
  t.isFolded = ratio < 0.0;
  t.order = latticeOrders[order];
  t.origin = Point(i, j, k);
  t.rest = {RestAt(i, 0), RestAt(j, 1), RestAt(k, 2)};
  int at[3] = {i, j, k};
  Eigen::Vector3d before = t.origin;
  Eigen::Matrix3d edges;
  for (int step = 0; step < 3; ++step) {
    const int axis = t.order[step];
    t.size[axis] = RestAt(at[axis] + 1, axis) - RestAt(at[axis], axis);
    ++at[axis];
    const Eigen::Vector3d& corner = Point(at[0], at[1], at[2]);
    edges.col(step) = corner - before;
    before = corner;
  }
  t.toFractions = edges.inverse();
  t.tolerance =
      1e-9 + 32.0 * std::numeric_limits<double>::epsilon() * largest_ * t.toFractions.cwiseAbs().rowwise().sum().maxCoeff();
  return true;
}

LatticeFolds DeformedCells::Folds(const Progress& progress) const
{
  std::vector<LatticeFolds> slices(static_cast<std::size_t>(cells_[2]));
  ParallelFor(cells_[2], progress, [&](std::ptrdiff_t slice) {
    LatticeFolds& sum = slices[static_cast<std::size_t>(slice)];
    sum.smallestRatio = std::numeric_limits<double>::infinity();
    const int k = static_cast<int>(slice);
    for (int j = 0; j < cells_[1]; ++j)
      for (int i = 0; i < cells_[0]; ++i)
        for (int order = 0; order < 6; ++order) {
          const double ratio = Ratio(i, j, k, order);
          if (std::isnan(ratio))
            continue;
          ++sum.tetrahedra;
          sum.folded += ratio <= latticeFoldedRatio ? 1 : 0;
          if (ratio < sum.smallestRatio) {
            sum.smallestRatio = ratio;
            sum.smallestCell = {i - layers_, j - layers_, k - layers_};
          }
        }
  });
  LatticeFolds all;
  all.smallestRatio = std::numeric_limits<double>::infinity();
  for (const LatticeFolds& slice : slices) {
    all.tetrahedra += slice.tetrahedra;
    all.folded += slice.folded;
    if (slice.smallestRatio < all.smallestRatio) {
      all.smallestRatio = slice.smallestRatio;
      all.smallestCell = slice.smallestCell;
    }
  }
  if (all.tetrahedra == 0)
    all.smallestRatio = 1.0;
  return all;
}

DeformedSearch::DeformedSearch(const DeformedCells& cells) : cells_(cells)
{
  const auto half = [](const std::array<int, 3>& size) {
    return std::array<int, 3>{(size[0] + 1) / 2, (size[1] + 1) / 2, (size[2] + 1) / 2};
  };
  const auto make = [&](const std::array<int, 3>& size, const auto& boxOf) {
    Level level{size, std::vector<Box>(static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
                                       static_cast<std::size_t>(size[2]))};
    ParallelFor(size[2], [&](std::ptrdiff_t slice) {
      Box* box = level.boxes.data() + slice * size[1] * size[0];
      for (int j = 0; j < size[1]; ++j)
        for (int i = 0; i < size[0]; ++i)
          *box++ = boxOf(2 * i, 2 * j, 2 * static_cast<int>(slice));
    });
    return level;
  };
  const auto empty = Box{Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()),
                         Eigen::Vector3d::Constant(-std::numeric_limits<double>::infinity())};
  const auto& n = cells.Cells();
  levels_.push_back(make(half(n), [&](int i, int j, int k) {
    Box box = empty;
    for (int c = k; c <= std::min(k + 2, n[2]); ++c)
      for (int b = j; b <= std::min(j + 2, n[1]); ++b)
        for (int a = i; a <= std::min(i + 2, n[0]); ++a) {
          box.low = box.low.cwiseMin(cells.Point(a, b, c));
          box.high = box.high.cwiseMax(cells.Point(a, b, c));
        }
    const Eigen::Vector3d slack = 1e-8 * (Eigen::Vector3d::Ones() + (box.high - box.low));
    return Box{box.low - slack, box.high + slack};
  }));
  while (std::max({levels_.back().size[0], levels_.back().size[1], levels_.back().size[2]}) > 1) {
    const Level& below = levels_.back();
    const auto s = below.size;
    Level above = make(half(s), [&](int i, int j, int k) {
      Box box = empty;
      for (int c = k; c < std::min(k + 2, s[2]); ++c)
        for (int b = j; b < std::min(j + 2, s[1]); ++b)
          for (int a = i; a < std::min(i + 2, s[0]); ++a) {
            const Box& one = below.boxes[static_cast<std::size_t>((c * s[1] + b) * s[0] + a)];
            box.low = box.low.cwiseMin(one.low);
            box.high = box.high.cwiseMax(one.high);
          }
      return box;
    });
    levels_.push_back(std::move(above));
  }
}

bool DeformedSearch::IsNearCell(int i, int j, int k, const Eigen::Vector3d& index) const
{
  Eigen::Vector3d low = cells_.Point(i, j, k), high = low;
  for (int corner = 1; corner < 8; ++corner) {
    const Eigen::Vector3d& point = cells_.Point(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2));
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const Eigen::Array3d slack = 1e-8 * (1.0 + (high - low).array());
  return (index.array() >= low.array() - slack).all() && (index.array() <= high.array() + slack).all();
}

bool DeformedSearch::IsNearTetrahedron(int i, int j, int k, int order, const Eigen::Vector3d& index) const
{
  int at[3] = {i, j, k};
  Eigen::Vector3d low = cells_.Point(i, j, k), high = low;
  for (int step = 0; step < 3; ++step) {
    ++at[latticeOrders[order][step]];
    const Eigen::Vector3d& point = cells_.Point(at[0], at[1], at[2]);
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const Eigen::Array3d slack = 1e-8 * (1.0 + (high - low).array());
  return (index.array() >= low.array() - slack).all() && (index.array() <= high.array() + slack).all();
}

void DeformedSearch::Visit(std::size_t number, int i, int j, int k, const Eigen::Vector3d& index, Found& found,
                           DeformedClaim::State& state) const
{
  const Level& level = levels_[number];
  const Box& box = level.boxes[static_cast<std::size_t>((k * level.size[1] + j) * level.size[0] + i)];
  if (!((index.array() >= box.low.array()).all() && (index.array() <= box.high.array()).all()))
    return;
  const auto limit = number > 0 ? levels_[number - 1].size : cells_.Cells();
  for (int c = 2 * k; c < std::min(2 * k + 2, limit[2]); ++c)
    for (int b = 2 * j; b < std::min(2 * j + 2, limit[1]); ++b)
      for (int a = 2 * i; a < std::min(2 * i + 2, limit[0]); ++a) {
        if (number > 0) {
          Visit(number - 1, a, b, c, index, found, state);
          continue;
        }
        if (!IsNearCell(a, b, c, index))
          continue;
        for (int order = 0; order < 6; ++order) {
          DeformedTetrahedron t;
          if (IsNearTetrahedron(a, b, c, order, index) && cells_.Tetrahedron(a, b, c, order, t) &&
              DeformedClaim::Take(t, t.toFractions * (index - t.origin), state, found.rest))
            found.tetrahedron = t;
        }
      }
}

std::optional<DeformedSearch::Found> DeformedSearch::Find(const Eigen::Vector3d& index) const
{
  Found found;
  auto state = DeformedClaim::State::None;
  if (index.allFinite())
    Visit(levels_.size() - 1, 0, 0, 0, index, found, state);
  if (state == DeformedClaim::State::None)
    return std::nullopt;
  found.isAmbiguous = DeformedClaim::IsFolded(state);
  return found;
}

} // namespace echorama
