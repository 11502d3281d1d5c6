// SPDX-License-Identifier: BSD-3-Clause
// Faces are sorted into bins of the space where they are now, so that a node finds those around it in a few steps. One that lies
// behind a node of its own body at rest does not count: so nothing meets its own back, however thin it is. Normals run evenly
// over faces that were in a plane at rest, so that a node which slides from face to face is pushed evenly also; steps of the
// staircase stay sharp.
#include "BodyContact.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <limits>
#include <map>

namespace echorama {
namespace {

constexpr double BodyStiffness = 100.0;  // in shear moduli of the softer side
constexpr double FarthestFace = 2.5;     // cells
constexpr double Opposite = -0.3;        // of the normals of a node and a face that may meet
constexpr double BesideFace = 0.3;       // how far beside of a face a node may be, of how far before it
constexpr double BesideRim = 0.02;       // and in cells; not to and fro: one that is pushed may be
constexpr double LeaveRim = 0.25;        // farther out
constexpr double EnteredFraction = 0.05; // of a cell
constexpr std::ptrdiff_t PointsOfATask = 64;

// The bins of a regular grid that points lie in, sorted.
class Bins {
public:
  Bins(const std::vector<Eigen::Vector3d>& places, double width) : width_(width)
  {
    for (std::size_t n = 0; n < places.size(); ++n)
      entries_.emplace_back(Of(places[n]), n);
    std::sort(entries_.begin(), entries_.end());
  }
  /// Calls body(number) for all that lie in bins between those of two places.
  template <class Body>
  void ForAll(const Eigen::Vector3d& low, const Eigen::Vector3d& high, const Body& body) const
  {
    const Bin from = Of(low), to = Of(high);
    for (std::int64_t k = from[0]; k <= to[0]; ++k)
      for (std::int64_t j = from[1]; j <= to[1]; ++j) {
        auto entry = std::lower_bound(entries_.begin(), entries_.end(), std::make_pair(Bin{k, j, from[2]}, std::size_t(0)));
        for (; entry != entries_.end() && entry->first <= Bin{k, j, to[2]}; ++entry)
          body(entry->second);
      }
  }

private:
  using Bin = std::array<std::int64_t, 3>;
  Bin Of(const Eigen::Vector3d& place) const
  {
    Bin bin;
    for (std::size_t axis = 0; axis < 3; ++axis)
      bin[axis] = static_cast<std::int64_t>(std::floor(std::clamp(place[2 - static_cast<int>(axis)] / width_, -1e9, 1e9)));
    return bin;
  }
  double width_;
  std::vector<std::pair<Bin, std::size_t>> entries_;
};

// Whether any line of the lattice leads from tissue to tissue across empty cells.
bool HasGap(const TissueCells& cells)
{
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t across = (axis + 1) % 3, along = (axis + 2) % 3;
    std::array<int, 3> cell{};
    for (cell[along] = 0; cell[along] < cells.cells[along]; ++cell[along])
      for (cell[across] = 0; cell[across] < cells.cells[across]; ++cell[across]) {
        int last = -1;
        for (cell[axis] = 0; cell[axis] < cells.cells[axis]; ++cell[axis])
          if (cells.IsTissue(cell[0], cell[1], cell[2])) {
            if (last >= 0 && cell[axis] > last + 1)
              return true;
            last = cell[axis];
          }
      }
  }
  return false;
}

// Where on a face, p(s, t) = sum of weights * corners, the point nearest to a place is.
struct OnFace {
  double weights[4];
  Eigen::Vector3d place, normal; // not of unit length, and of either sign
};
OnFace Nearest(const Eigen::Vector3d (&corners)[4], const Eigen::Vector3d& to)
{
  Eigen::Vector2d at(0.5, 0.5);
  OnFace found;
  Eigen::Vector3d slopes[2];
  const auto look = [&] {
    const double s = at[0], t = at[1];
    const double weights[4] = {(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t};
    found.place.setZero();
    for (int n = 0; n < 4; ++n) {
      found.weights[n] = weights[n];
      found.place += weights[n] * corners[n];
    }
    slopes[0] = (1.0 - t) * (corners[1] - corners[0]) + t * (corners[3] - corners[2]);
    slopes[1] = (1.0 - s) * (corners[2] - corners[0]) + s * (corners[3] - corners[1]);
  };
  for (int step = 0; step < 8; ++step) {
    look();
    const Eigen::Vector2d before = at;
    // One parameter after the other stays within the face, whatever the angle between the two.
    const Eigen::Vector3d off = to - found.place;
    Eigen::Matrix2d normalMatrix;
    normalMatrix << slopes[0].squaredNorm(), slopes[0].dot(slopes[1]), slopes[0].dot(slopes[1]), slopes[1].squaredNorm();
    const Eigen::Vector2d right(slopes[0].dot(off), slopes[1].dot(off));
    normalMatrix.diagonal().array() += 1e-12 * normalMatrix.trace() + 1e-300;
    Eigen::Vector2d next = at + normalMatrix.inverse() * right;
    for (int n = 0; n < 2; ++n)
      if (next[n] < 0.0 || next[n] > 1.0) {
        next[n] = std::clamp(next[n], 0.0, 1.0);
        next[1 - n] = at[1 - n] + (right[1 - n] - normalMatrix(0, 1) * (next[n] - at[n])) / normalMatrix(1 - n, 1 - n);
      }
    at = next.cwiseMax(0.0).cwiseMin(1.0);
    if ((at - before).cwiseAbs().maxCoeff() < 1e-9)
      break;
  }
  look();
  found.normal = slopes[0].cross(slopes[1]);
  return found;
}

// Whether a place lies in a cell, deeper than a fraction of it below each face.
bool IsInCell(const Eigen::Vector3d (&corners)[8], const Eigen::Vector3d& place)
{
  Eigen::Vector3d at(0.5, 0.5, 0.5);
  for (int step = 0; step < 12; ++step) {
    Eigen::Vector3d off = place;
    Eigen::Matrix3d slopes = Eigen::Matrix3d::Zero();
    for (int corner = 0; corner < 8; ++corner) {
      double value[3], slope[3];
      for (int axis = 0; axis < 3; ++axis) {
        const bool isHigh = (corner >> axis & 1) != 0;
        value[axis] = isHigh ? at[axis] : 1.0 - at[axis];
        slope[axis] = isHigh ? 1.0 : -1.0;
      }
      off -= value[0] * value[1] * value[2] * corners[corner];
      slopes.col(0) += slope[0] * value[1] * value[2] * corners[corner];
      slopes.col(1) += value[0] * slope[1] * value[2] * corners[corner];
      slopes.col(2) += value[0] * value[1] * slope[2] * corners[corner];
    }
    const Eigen::Vector3d change = slopes.partialPivLu().solve(off);
    if (!change.allFinite())
      return false;
    at += change;
    if (change.cwiseAbs().maxCoeff() < 1e-6)
      return at.minCoeff() > EnteredFraction && at.maxCoeff() < 1.0 - EnteredFraction;
    at = at.cwiseMax(-1.0).cwiseMin(2.0);
  }
  return false;
}

} // namespace

BodyContact::BodyContact(const TissueCells& cells, const LatticeShape& shape, const Eigen::Vector3d& spacing) : spacing_(spacing)
{
  if (!HasGap(cells))
    return;
  std::map<std::pair<std::ptrdiff_t, int>, std::ptrdiff_t> numbers;
  ForNodes(cells.cells, [&](int i, int j, int k) {
    if (!cells.IsTissue(i, j, k))
      return;
    for (int side = 0; side < 6; ++side) {
      const auto axis = static_cast<std::size_t>(side / 2);
      std::array<int, 3> front{i, j, k};
      front[axis] += side % 2 ? 1 : -1;
      if (cells.IsTissue(front[0], front[1], front[2]))
        continue;
      Face face;
      face.side = side;
      face.shear = static_cast<double>(cells.shear[cells.At(i, j, k)]);
      std::array<std::ptrdiff_t, 4> points{};
      for (std::size_t corner = 0; corner < 4; ++corner) {
        std::array<int, 3> index{i, j, k};
        index[axis] += side % 2;
        index[(axis + 1) % 3] += static_cast<int>(corner & 1);
        index[(axis + 2) % 3] += static_cast<int>(corner >> 1);
        face.corners[corner] = index;
        face.at[corner] = shape.At(index[0], index[1], index[2]);
        const auto [number, isNew] =
            numbers.emplace(std::make_pair(face.at[corner], side), static_cast<std::ptrdiff_t>(points_.size()));
        if (isNew) {
          points_.emplace_back();
          points_.back().index = index;
          points_.back().at = face.at[corner];
          points_.back().side = side;
          points_.back().front = front;
        }
        Point& point = points_[static_cast<std::size_t>(number->second)];
        point.area += 0.25 * spacing.prod() / spacing[static_cast<int>(axis)];
        point.shear = std::max(point.shear, face.shear);
        points[corner] = number->second;
      }
      faces_.push_back(face);
      pointsOf_.push_back(points);
    }
  });
  forces_.assign(points_.size(), 0.0);
}

void BodyContact::Find(const LatticeField<double>& displacement)
{
  // Where faces are, and which way they and the points look.
  std::vector<Eigen::Vector3d> middles(faces_.size()), normals(points_.size(), Eigen::Vector3d::Zero());
  for (std::size_t n = 0; n < faces_.size(); ++n) {
    Eigen::Vector3d corners[4];
    for (std::size_t corner = 0; corner < 4; ++corner)
      corners[corner] = Place(faces_[n].corners[corner], faces_[n].at[corner], displacement);
    middles[n] = 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
    const Eigen::Vector3d area = (faces_[n].side % 2 ? 0.5 : -0.5) * (corners[3] - corners[0]).cross(corners[2] - corners[1]);
    for (const std::ptrdiff_t point : pointsOf_[n])
      normals[static_cast<std::size_t>(point)] += area;
  }
  for (Eigen::Vector3d& normal : normals)
    normal.normalize();
  const double width = spacing_.maxCoeff(), reach = FarthestFace * width;
  const Bins bins(middles, reach);
  ParallelRanges(static_cast<std::ptrdiff_t>(points_.size()), PointsOfATask, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t n = begin; n < end; ++n) {
      Point& point = points_[static_cast<std::size_t>(n)];
      const Eigen::Vector3d place = Place(point.index, point.at, displacement), &looks = normals[static_cast<std::size_t>(n)];
      const auto axis = static_cast<std::size_t>(point.side / 2);
      const double rim = (point.face >= 0 && point.pushed ? LeaveRim : BesideRim) * width;
      point.face = -1;
      double nearest = reach * reach;
      const Eigen::Vector3d around = Eigen::Vector3d::Constant(reach);
      bins.ForAll(place - around, place + around, [&](std::size_t m) {
        const Face& face = faces_[m];
        if ((middles[m] - place).squaredNorm() > 4.0 * reach * reach)
          return;
        // At rest each was before the other.
        const auto faceAxis = static_cast<std::size_t>(face.side / 2);
        const int before = point.index[faceAxis] - face.corners[0][faceAxis],
                  ahead = face.corners[0][axis] + face.corners[3][axis] - 2 * point.index[axis];
        if ((face.side % 2 ? before : -before) <= 0 || (point.side % 2 ? ahead : -ahead) <= 0)
          return;
        Eigen::Vector3d corners[4];
        for (std::size_t corner = 0; corner < 4; ++corner) {
          if (face.at[corner] == point.at)
            return;
          corners[corner] = Place(face.corners[corner], face.at[corner], displacement);
        }
        const OnFace on = Nearest(corners, place);
        const Eigen::Vector3d off = place - on.place, normal = (face.side % 2 ? 1.0 : -1.0) * on.normal.normalized();
        const double height = std::abs(off.dot(normal));
        if (!(off.squaredNorm() < nearest) || !(normal.dot(looks) < Opposite) ||
            (off - off.dot(normal) * normal).norm() > BesideFace * height + rim)
          return;
        nearest = off.squaredNorm();
        point.face = static_cast<std::ptrdiff_t>(m);
        point.normal.setZero();
        for (std::size_t corner = 0; corner < 4; ++corner) {
          point.weights[corner] = on.weights[corner];
          point.normal += on.weights[corner] * normals[static_cast<std::size_t>(pointsOf_[m][corner])];
        }
        point.normal.normalize();
        point.isSoft = point.shear < face.shear || (point.shear == face.shear && point.side < face.side);
        point.stiffness =
            (point.isSoft ? 1.0 : 4.0) * BodyStiffness * std::min(point.shear, face.shear) * point.area / spacing_.minCoeff();
      });
    }
  });
}

double BodyContact::Distance(const Point& point, const LatticeField<double>& displacement) const
{
  const Face& face = faces_[static_cast<std::size_t>(point.face)];
  Eigen::Vector3d off = Place(point.index, point.at, displacement);
  for (std::size_t corner = 0; corner < 4; ++corner)
    off -= point.weights[corner] * Place(face.corners[corner], face.at[corner], displacement);
  return off.dot(point.normal);
}

double BodyContact::Energy(const LatticeField<double>& displacement) const
{
  double energy = 0.0;
  for (std::size_t n = 0; n < points_.size(); ++n)
    if (points_[n].face >= 0) {
      const double s = points_[n].stiffness, push = std::max(0.0, forces_[n] - s * Distance(points_[n], displacement));
      energy += (push * push - forces_[n] * forces_[n]) / (2.0 * s);
    }
  return energy;
}

double BodyContact::AddForce(const LatticeField<double>& displacement, LatticeField<double>& force) const
{
  for (std::size_t n = 0; n < points_.size(); ++n)
    if (const Point& point = points_[n]; point.face >= 0) {
      const double push = std::max(0.0, forces_[n] - point.stiffness * Distance(point, displacement));
      if (push == 0.0)
        continue;
      const Face& face = faces_[static_cast<std::size_t>(point.face)];
      force.Set(point.at, force.Get(point.at) - push * point.normal);
      for (std::size_t corner = 0; corner < 4; ++corner)
        force.Set(face.at[corner], force.Get(face.at[corner]) + push * point.weights[corner] * point.normal);
    }
  return Energy(displacement);
}

std::vector<LatticeLink> BodyContact::Stiffness(const LatticeField<double>& displacement, double grip)
{
  std::vector<LatticeLink> links;
  for (std::size_t n = 0; n < points_.size(); ++n) {
    Point& point = points_[n];
    const double push = point.face < 0 ? 0.0 : forces_[n] - point.stiffness * Distance(point, displacement);
    point.pushed = push > 0.0;
    if (!point.pushed)
      continue;
    const Face& face = faces_[static_cast<std::size_t>(point.face)];
    LatticeLink link;
    link.nodes.emplace_back(point.index, 1.0);
    for (std::size_t corner = 0; corner < 4; ++corner)
      link.nodes.emplace_back(face.corners[corner], -point.weights[corner]);
    const Eigen::Matrix3d across = point.normal * point.normal.transpose();
    link.stiffness = point.stiffness * across + grip * push / spacing_.minCoeff() * (Eigen::Matrix3d::Identity() - across);
    links.push_back(std::move(link));
  }
  return links;
}

BodyContact::Open BodyContact::Update(const LatticeField<double>& displacement)
{
  Open open;
  for (std::size_t n = 0; n < points_.size(); ++n) {
    const Point& point = points_[n];
    const double push = point.face < 0 ? 0.0 : std::max(0.0, forces_[n] - point.stiffness * Distance(point, displacement));
    if (push == forces_[n])
      continue;
    if (!point.isSoft) {
      forces_[n] = 0.0;
      continue;
    }
    const double change = (push - forces_[n]) / point.stiffness;
    open.entered = std::max(open.entered, change);
    open.apart = std::max(open.apart, -change);
    if (point.pushed || push < forces_[n])
      forces_[n] = push;
  }
  return open;
}

std::optional<std::array<int, 3>> BodyContact::EnteredCell(const TissueCells& cells,
                                                           const LatticeField<double>& displacement) const
{
  const LatticeShape& shape = displacement.Shape();
  std::vector<Eigen::Vector3d> places;
  for (const Point& point : points_)
    places.push_back(Place(point.index, point.at, displacement));
  const Bins bins(places, spacing_.maxCoeff());
  std::size_t first = places.size();
  if (IsPossible())
    ForNodes(cells.cells, [&](int i, int j, int k) {
      if (!cells.IsTissue(i, j, k))
        return;
      Eigen::Vector3d corners[8];
      std::ptrdiff_t at[8];
      Eigen::AlignedBox3d box;
      for (int corner = 0; corner < 8; ++corner) {
        const std::array<int, 3> index{i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2)};
        at[corner] = shape.At(index[0], index[1], index[2]);
        corners[corner] = Place(index, at[corner], displacement);
        box.extend(corners[corner]);
      }
      bins.ForAll(box.min(), box.max(), [&](std::size_t n) {
        const std::array<int, 3>& front = points_[n].front;
        bool isInside = n < first && box.contains(places[n]) && std::find(at, at + 8, points_[n].at) == at + 8;
        for (std::size_t axis = 0; axis < 3; ++axis)
          isInside = isInside && front[axis] >= 0 && front[axis] < cells.cells[axis];
        if (isInside && IsInCell(corners, places[n]))
          first = n;
      });
    });
  if (first == places.size())
    return {};
  return points_[first].front;
}

} // namespace echorama
