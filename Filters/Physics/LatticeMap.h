// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ImageGeometry.h"
#include <array>
#include <optional>
#include <vector>

namespace echorama {

/// The corners of a cell are joined to six tetrahedra (Kuhn's split, the same in every cell, so that neighbours share the
/// diagonals of their faces): each goes from the first corner to the last, one axis after the other, in one of these orders.
inline constexpr int latticeOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};

/// A map of the world that is linear on every tetrahedron of a regular lattice: what lies at x at rest is now at x + u(x).
///
/// u is known at the points of the lattice. A point with the fractions f1 >= f2 >= f3 in its cell lies in the tetrahedron that
/// takes the axes in this order, over corners c0 ... c3, with the barycentric coordinates 1 - f1, f1 - f2, f2 - f3, f3. So u is
/// continuous, affine fields are exact, and so is whatever a finite-element solver on these tetrahedra computed.
class LatticeMap {
public:
  /// \param displacements u, mm, along the axes of the world; one per point, x fastest
  /// \param exists 1 or 0 per point: whether u is known there; none: everywhere. A tetrahedron is there when its corners are.
  /// \throws Error(BadInput) for a lattice that is no geometry or has a single point along an axis, other numbers of vectors, and
  /// a displacement that is not finite or beyond 1e6 mm at a point that exists: its index is named.
  LatticeMap(const ImageGeometry& lattice, std::vector<Eigen::Vector3d> displacements, std::vector<unsigned char> exists = {});

  const ImageGeometry& Lattice() const { return lattice_; }
  const Eigen::Affine3d& WorldToIndex() const { return worldToIndex_; }
  const Eigen::Affine3d& IndexToWorld() const { return indexToWorld_; }

  bool Exists(int i, int j, int k) const { return exists_.empty() || exists_[At(i, j, k)] != 0; }
  const Eigen::Vector3d& Displacement(int i, int j, int k) const { return displacements_[At(i, j, k)]; }
  double LongestMm() const { return longest_; }

  /// Where in the lattice a point lies.
  struct Place {
    std::array<int, 3> cell;
    std::array<int, 3> order;     ///< of the axes, largest fraction first
    Eigen::Vector3d fractions;    ///< in this order
    std::array<bool, 3> beyond{}; ///< along these axes it was outside, and is the nearest point instead
    bool IsBeyond() const { return beyond[0] || beyond[1] || beyond[2]; }
  };

  /// \param index in index coordinates of the lattice; beyond it by less than 1e-9 is inside.
  /// \param nearest take the nearest point of the lattice for one that lies beyond it
  /// \returns nothing outside, for what is not finite, and where a corner that counts (by more than 1e-9) does not exist
  std::optional<Place> Find(const Eigen::Vector3d& index, bool nearest) const;

  /// u there, mm.
  Eigen::Vector3d DisplacementAt(const Place& place) const;

  /// The derivative of x + u(x) in the tetrahedron, row by component, column by axis of the world; beyond the lattice u does not
  /// change with the distance. Beside points that do not exist: that of a whole tetrahedron that touches the place, if there is
  /// one, else the identity.
  Eigen::Matrix3d GradientAt(const Place& place) const;

private:
  std::size_t At(int i, int j, int k) const
  {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(lattice_.dimensions[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(lattice_.dimensions[0]) +
           static_cast<std::size_t>(i);
  }
  bool IsWhole(const Place& place) const;

  ImageGeometry lattice_;
  Eigen::Affine3d worldToIndex_, indexToWorld_;
  std::vector<Eigen::Vector3d> displacements_;
  std::vector<unsigned char> exists_;
  double longest_ = 0.0;
};

/// What folds: tetrahedra whose volume changes its sign, or vanishes (a ratio of at most 1e-9).
struct LatticeFolds {
  std::size_t tetrahedra = 0;               ///< that there are
  std::size_t folded = 0;                   ///< of them
  double smallestRatio = 1.0;               ///< of their volumes now and at rest: the smallest determinant of the gradient
  std::array<int, 3> smallestCell{0, 0, 0}; ///< where it is
};

inline constexpr double latticeFoldedRatio = 1e-9;

} // namespace echorama
