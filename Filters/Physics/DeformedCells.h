// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "LatticeMap.h"
#include <algorithm>
#include <limits>

namespace echorama {

/// A tetrahedron of a lattice, where it has gone.
struct DeformedTetrahedron {
  Eigen::Vector3d origin;      ///< where its first corner has gone
  Eigen::Matrix3d toFractions; ///< what lies at y now had the fractions toFractions (y - origin), largest first
  Eigen::Vector3d rest;        ///< where its first corner was, in index coordinates of the lattice
  Eigen::Vector3d size;        ///< of its cell: 1, or more beyond the lattice
  const int* order;            ///< of the axes
  double tolerance;            ///< of the fractions: within it a point may as well be a neighbour's
  bool isFolded;

  /// The smallest barycentric coordinate: negative outside.
  static double Depth(const Eigen::Vector3d& f)
  {
    return std::min(std::min(1.0 - f[0], f[0] - f[1]), std::min(f[1] - f[2], f[2]));
  }

  Eigen::Vector3d RestOf(const Eigen::Vector3d& fractions) const
  {
    Eigen::Vector3d index = rest;
    for (int step = 0; step < 3; ++step)
      index[order[step]] += size[order[step]] * fractions[step];
    return index;
  }
};

/// What the tetrahedra that hold one place, taken in any fixed order, say of where it was.
struct DeformedClaim {
  /// Border: on a face, to rounding, where neighbours say the same. FoldedBorder: only folded ones said it so far. Ambiguous:
  /// inside of one that is folded, inside of two, or two say something else.
  enum class State : unsigned char { None, Border, Inside, FoldedBorder, Ambiguous };

  /// \returns whether the tetrahedron holds what has these fractions in it, and what it says counts.
  static bool Take(const DeformedTetrahedron& t, const Eigen::Vector3d& fractions, State& state, Eigen::Vector3d& rest)
  {
    const double depth = DeformedTetrahedron::Depth(fractions);
    if (!(depth >= -t.tolerance) || state == State::Ambiguous)
      return false;
    const bool isInside = depth > t.tolerance, isFirst = state == State::None;
    const Eigen::Vector3d said = t.RestOf(fractions);
    const bool disagrees = !isFirst && (said - rest).cwiseAbs().maxCoeff() > 1e-3 * t.size.maxCoeff();
    if (disagrees || (isInside && (t.isFolded || state == State::Inside)))
      state = State::Ambiguous;
    else if (t.isFolded)
      state = isFirst ? State::FoldedBorder : state;
    else if (isFirst || isInside || state == State::FoldedBorder)
      state = isInside ? State::Inside : State::Border;
    else
      return false;
    if (!isFirst && (t.isFolded || state == State::Ambiguous))
      return false;
    rest = said;
    return true;
  }

  static bool IsFolded(State state) { return state == State::FoldedBorder || state == State::Ambiguous; }
};

/// The points of a lattice where a LatticeMap has moved them, in coordinates of a target, and the tetrahedra between them.
///
/// With layers around it the lattice reaches further: its outermost displacements hold there as well, which is what
/// LatticeMap::Find(.., nearest) says. Cells and points are then counted from -layers.
class DeformedCells {
public:
  /// \param worldToTarget coordinates that the points are given in
  /// \param reach how far to go beyond the lattice, in index units; 0: not at all
  /// \throws Error(TooLarge) beyond 2^28 points
  DeformedCells(const LatticeMap& map, const Eigen::Affine3d& worldToTarget, double reach);

  const std::array<int, 3>& Cells() const { return cells_; } ///< how many along each axis, with the layers

  /// Cells are counted from the first layer here.
  const Eigen::Vector3d& Point(int i, int j, int k) const
  {
    return points_[(static_cast<std::size_t>(k) * static_cast<std::size_t>(cells_[1] + 1) + static_cast<std::size_t>(j)) *
                       static_cast<std::size_t>(cells_[0] + 1) +
                   static_cast<std::size_t>(i)];
  }

  /// \returns false when it is not there, or has no volume that could hold anything.
  bool Tetrahedron(int i, int j, int k, int order, DeformedTetrahedron& tetrahedron) const;

  /// Looks at all tetrahedra. The cell is counted from that of the lattice.
  LatticeFolds Folds(const Progress& progress = {}) const;

private:
  double Ratio(int i, int j, int k, int order) const; // of the volumes; NaN: it is not there

  // The coordinate of a point along an axis at rest, and the point of the lattice whose displacement it has.
  double RestAt(int i, int axis) const
  {
    const int n = map_.Lattice().dimensions[static_cast<std::size_t>(axis)], at = i - layers_;
    return at < 0 ? step_ * at : at >= n ? n - 1 + step_ * (at - n + 1) : at;
  }
  int Clamped(int i, int axis) const
  {
    return std::clamp(i - layers_, 0, map_.Lattice().dimensions[static_cast<std::size_t>(axis)] - 1);
  }
  bool Exists(int i, int j, int k) const { return map_.Exists(Clamped(i, 0), Clamped(j, 1), Clamped(k, 2)); }

  const LatticeMap& map_;
  int layers_ = 0;
  double step_ = 1.0;
  double volume_ = 1.0; // of a cell at rest in the target's coordinates
  double largest_ = 0.0;
  std::array<int, 3> cells_;
  std::vector<Eigen::Vector3d> points_;
};

/// Finds where what lies somewhere now lay at rest: a tree of boxes around the deformed cells.
class DeformedSearch {
public:
  /// \a cells in index coordinates of the lattice; they must outlive the search.
  explicit DeformedSearch(const DeformedCells& cells);

  struct Found {
    Eigen::Vector3d rest;     ///< in index coordinates of the lattice
    bool isAmbiguous = false; ///< in a tetrahedron that is folded, or in several
    DeformedTetrahedron tetrahedron;
  };
  std::optional<Found> Find(const Eigen::Vector3d& index) const;

private:
  struct Box {
    Eigen::Vector3d low, high;
  };
  struct Level {
    std::array<int, 3> size;
    std::vector<Box> boxes; // of 2^3 of those below, x fastest; the lowest level of 2^3 cells
  };
  bool IsNearCell(int i, int j, int k, const Eigen::Vector3d& index) const;
  bool IsNearTetrahedron(int i, int j, int k, int order, const Eigen::Vector3d& index) const;
  void Visit(std::size_t level, int i, int j, int k, const Eigen::Vector3d& index, Found& found,
             DeformedClaim::State& state) const;

  const DeformedCells& cells_;
  std::vector<Level> levels_;
};

} // namespace echorama
