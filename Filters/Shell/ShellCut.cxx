// SPDX-License-Identifier: BSD-3-Clause
// A part that is too large for a printer is cut by planes. A wall of 2 mm holds no peg. So where a skin is cut, one of both sides
// carries a lap: a second layer, a wall thick, that reaches behind the wall of the other side, as the lip of the base does. It
// aligns both, holds the glue, and lets no direct light through the seam. Plates (the flange and the base) get flat pegs. Outer
// faces meet without a gap, so that the whole is as long as it was; what reaches into a neighbour has the clearance around it.
//
// As everything in the shell's design, cells, laps and pegs are functions that are negative inside, joined by minimum and
// maximum.
#include "ShellCut.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "ShellDesign.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace echorama {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double unlimited = std::numeric_limits<double>::infinity();

// How many laps cell number \a cell of \a count carries.
int CarriedLaps(const CutPlanes& planes, int axis, int cell)
{
  const auto& at = planes.at[static_cast<std::size_t>(axis)];
  int laps = 0;
  if (cell < static_cast<int>(at.size()))
    laps += planes.Direction(axis, static_cast<std::size_t>(cell)) > 0.0;
  if (cell > 0)
    laps += planes.Direction(axis, static_cast<std::size_t>(cell - 1)) < 0.0;
  return laps;
}

// Cells from \a first to \a last share what is between two places such that all are printed alike long.
double Share(CutPlanes& planes, int axis, int first, int last, double low, double high, double lapMm)
{
  int laps = 0;
  for (int cell = first; cell <= last; ++cell)
    laps += CarriedLaps(planes, axis, cell);
  const double each = (high - low + lapMm * laps) / (last - first + 1);
  double end = low;
  for (int cell = first; cell < last; ++cell) {
    end += each - lapMm * CarriedLaps(planes, axis, cell);
    planes.at[static_cast<std::size_t>(axis)][static_cast<std::size_t>(cell)] = end;
  }
  return each;
}

// Whether laps of two planes, and what holds them, would meet in a cell.
bool IsCrowded(const std::vector<double>& at, double low, double high, double lapMm)
{
  double last = low;
  for (const double plane : at) {
    if (plane - last < 3.0 * lapMm)
      return true;
    last = plane;
  }
  return high - last < 3.0 * lapMm;
}

// The planes across an axis; nothing when even many parts are too large.
std::optional<std::vector<double>> PlanAxis(int axis, double low, double high, double mostMm, double lapMm, double keepMm)
{
  if (high - low <= mostMm)
    return std::vector<double>();
  constexpr int mostParts = 20;
  for (int count = 2; count <= mostParts; ++count) {
    CutPlanes planes;
    auto& at = planes.at[static_cast<std::size_t>(axis)];
    at.assign(static_cast<std::size_t>(count - 1), 0.0);
    const double each = Share(planes, axis, 0, count - 1, low, high, lapMm);
    if (each > mostMm)
      continue;
    if (IsCrowded(at, low, high, lapMm))
      return std::nullopt;
    const auto isInTheWay = [keepMm](double plane) { return std::abs(plane) < keepMm; };
    const auto found = std::find_if(at.begin(), at.end(), isInTheWay);
    if (found == at.end())
      return at;
    if (std::count_if(at.begin(), at.end(), isInTheWay) > 1)
      return std::nullopt;
    const auto moved = static_cast<int>(found - at.begin());
    for (const double plane : {std::copysign(keepMm, *found), -std::copysign(keepMm, *found)}) {
      const double below = Share(planes, axis, 0, moved, low, plane, lapMm),
                   above = Share(planes, axis, moved + 1, count - 1, plane, high, lapMm);
      at[static_cast<std::size_t>(moved)] = plane;
      if (std::max(below, above) <= mostMm && !IsCrowded(at, low, high, lapMm))
        return at;
    }
  }
  return std::nullopt;
}

// A bar across a plane, negative inside; wider by \a more all around.
double Bar(const CutPeg& peg, const Vector3d& place, double more)
{
  const double along = peg.direction * (place[peg.axis] - peg.plane);
  const double beside = std::abs(place[1 - peg.axis] - peg.beside);
  return std::max({along - peg.lengthMm - more, -1.0 - more - along, beside - 0.5 * peg.widthMm - more});
}

} // namespace

double CutPlanes::Direction(int axis, std::size_t which) const
{
  if (axis == 2)
    return 1.0;
  const double middle = 0.5 * static_cast<double>(at[static_cast<std::size_t>(axis)].size());
  const auto below = static_cast<double>(which);
  return std::abs(below + 1.0 - middle) < std::abs(below - middle) ? -1.0 : 1.0;
}

CutPlanes PlanCuts(const Eigen::AlignedBox3d& box, const Vector3d& printerMm, double lapMm, const Vector2d& keepMm)
{
  CutPlanes best;
  std::size_t fewest = std::numeric_limits<std::size_t>::max();
  for (const bool isTurned : {false, true}) {
    const Vector3d most = isTurned ? Vector3d(printerMm.y(), printerMm.x(), printerMm.z()) : printerMm;
    CutPlanes planes;
    bool isPossible = true;
    std::size_t parts = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const auto at = PlanAxis(axis, box.min()[axis], box.max()[axis], most[axis], lapMm, axis < 2 ? keepMm[axis] : 0.0);
      isPossible = isPossible && at.has_value();
      planes.at[static_cast<std::size_t>(axis)] = at.value_or(std::vector<double>());
      parts *= planes.at[static_cast<std::size_t>(axis)].size() + 1;
    }
    if (isPossible && parts < fewest) {
      fewest = parts;
      best = planes;
    }
  }
  if (fewest == std::numeric_limits<std::size_t>::max())
    throw Error(Error::Kind::NotPossible,
                Format("what is %.1f x %.1f x %.1f mm cannot be cut for a printer (PrinterMm) that makes %g x %g x %g mm, with "
                       "laps (SeamMm) of %g mm",
                       box.sizes().x(), box.sizes().y(), box.sizes().z(), printerMm.x(), printerMm.y(), printerMm.z(), lapMm));
  return best;
}

std::vector<Eigen::Array3i> CellsOf(const CutPlanes& planes)
{
  std::vector<Eigen::Array3i> cells;
  const auto count = [&planes](std::size_t axis) { return static_cast<int>(planes.at[axis].size()) + 1; };
  for (int k = 0; k < count(2); ++k)
    for (int j = 0; j < count(1); ++j)
      for (int i = 0; i < count(0); ++i)
        cells.emplace_back(i, j, k);
  return cells;
}

CutCell::CutCell(const CutPlanes& planes, const Eigen::Array3i& which, const std::vector<CutPeg>& pegs, const ShellParameters& p)
  : thicknessMm_(p.thicknessMm), clearanceMm_(p.clearanceMm), lapMm_(p.seamMm), floorMm_(p.baffleMm + p.clearanceMm + 0.5)
{
  for (int axis = 0; axis < 3; ++axis) {
    const auto& at = planes.at[static_cast<std::size_t>(axis)];
    const auto cell = static_cast<std::size_t>(which[axis]);
    box_.min()[axis] = cell > 0 ? at[cell - 1] : -unlimited;
    box_.max()[axis] = cell < at.size() ? at[cell] : unlimited;
    if (cell > 0 && planes.Direction(axis, cell - 1) < 0.0)
      laps_.push_back({axis, at[cell - 1], -1.0});
    if (cell < at.size() && planes.Direction(axis, cell) > 0.0)
      laps_.push_back({axis, at[cell], 1.0});
  }
  reach_ = box_;
  reach_.min() -= Vector3d::Constant(lapMm_ + 1.0);
  reach_.max() += Vector3d::Constant(lapMm_ + 1.0);
  for (const CutPeg& peg : pegs) {
    const double low = box_.min()[peg.axis], high = box_.max()[peg.axis];
    if (which.z() > 0 || peg.beside < box_.min()[1 - peg.axis] || peg.beside > box_.max()[1 - peg.axis])
      continue;
    if (peg.plane == (peg.direction > 0.0 ? high : low))
      pegs_.push_back(peg);
    else if (peg.plane == (peg.direction > 0.0 ? low : high))
      sockets_.push_back(peg);
  }
}

double CutCell::Within(const Vector3d& place) const
{
  double value = std::max((box_.min() - place).maxCoeff(), (place - box_.max()).maxCoeff());
  for (const CutPeg& peg : pegs_)
    value = std::min(value, std::max(Bar(peg, place, 0.0), place.z() - peg.topMm + clearanceMm_));
  for (const CutPeg& peg : sockets_)
    value = std::max(value, -std::max(Bar(peg, place, clearanceMm_), place.z() - peg.topMm));
  return value;
}

double CutCell::Laps(const Vector3d& place, double distance) const
{
  const double behind = thicknessMm_ + clearanceMm_, deepest = -distance - behind - thicknessMm_;
  double value = unlimited;
  for (const Lap& lap : laps_) {
    const double along = lap.direction * (place[lap.axis] - lap.plane);
    double beside = floorMm_ - place.z();
    for (int axis = 0; axis < 3; ++axis) // off the laps of other planes, which begin where the others end
      if (axis != lap.axis)
        beside = std::max({beside, box_.min()[axis] + lapMm_ + clearanceMm_ - place[axis],
                           place[axis] - box_.max()[axis] + lapMm_ + clearanceMm_});
    const double tongue = std::max({std::abs(along) - lapMm_, behind + distance});
    const double holder = std::max({along, -along - lapMm_, distance});
    value = std::min(value, std::max({std::min(tongue, holder), beside, deepest}));
  }
  return value;
}

double CutCell::PlaneDistance(const Vector3d& place) const
{
  return std::min((box_.min() - place).cwiseAbs().minCoeff(), (place - box_.max()).cwiseAbs().minCoeff());
}

} // namespace echorama
