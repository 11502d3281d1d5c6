// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <Eigen/Geometry>
#include <vector>

namespace echorama {

struct ShellParameters;

/// The planes across x, y and z, ascending, that cut something for a printer.
struct CutPlanes {
  std::array<std::vector<double>, 3> at;

  bool IsCut() const { return !at[0].empty() || !at[1].empty() || !at[2].empty(); }
  /// The cell below plane \a which of an axis, or the one above, reaches across it: that which is nearer to the middle, where a
  /// body is wider, so that it slides in; the lower one where skins are stacked. \returns 1: from below, -1: from above
  double Direction(int axis, std::size_t which) const;
};

/// The fewest parts of alike size along each axis that the printer makes, as they stand or turned by a quarter, when each reaches
/// \a lapMm into those beside it that are further out. No plane comes within \a keepMm of the axis z.
/// \throws Error(NotPossible) when the printer is too small for that
CutPlanes PlanCuts(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& printerMm, double lapMm,
                   const Eigen::Vector2d& keepMm = Eigen::Vector2d::Zero());

/// A peg of a plate: a flat bar that reaches across a plane into the neighbour.
struct CutPeg {
  int axis = 0;
  double plane = 0.0, direction = 1.0;
  double beside = 0.0; ///< its middle along the other axis of the plate
  double lengthMm = 0.0, widthMm = 0.0;
  double topMm = 0.0; ///< of its socket; the peg ends a clearance below
};

/// What lies between planes, with what reaches across them: a function that is negative inside, to be joined with those of the
/// whole.
class CutCell {
public:
  /// \param which the cell's number along each axis \param pegs of all planes
  CutCell(const CutPlanes& planes, const Eigen::Array3i& which, const std::vector<CutPeg>& pegs,
          const ShellParameters& parameters);

  /// All of it lies in there.
  const Eigen::AlignedBox3d& Reach() const { return reach_; }
  /// The cell itself, with its pegs and without its sockets.
  double Within(const Eigen::Vector3d& place) const;
  /// The laps that it carries behind the wall, \a distance from the body: beyond each plane a tongue that lies a clearance behind
  /// the neighbour's wall, before it the wall made thick enough to hold the tongue.
  double Laps(const Eigen::Vector3d& place, double distance) const;
  /// How far the nearest plane is that bounds it.
  double PlaneDistance(const Eigen::Vector3d& place) const;

private:
  struct Lap {
    int axis;
    double plane, direction;
  };

  Eigen::AlignedBox3d box_, reach_;
  std::vector<Lap> laps_;
  std::vector<CutPeg> pegs_, sockets_;
  double thicknessMm_, clearanceMm_, lapMm_, floorMm_;
};

/// All cells between planes, x fastest.
std::vector<Eigen::Array3i> CellsOf(const CutPlanes& planes);

} // namespace echorama
