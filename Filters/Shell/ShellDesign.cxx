// SPDX-License-Identifier: BSD-3-Clause
// The skin is what lies between the body's surface and the same moved inwards, above the plane of the opening. A flange around
// its foot is screwed to the base: a plate with the camera's hole and, from below, a pocket for its board. A lip on the base
// follows the skin's inside: no straight way is left for light under the skin.
#include "ShellDesign.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <cmath>
#include <cstring>

namespace echorama {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double turn = 6.283185307179586, unlimitedMm = 1e9;

[[noreturn]] void RefuseShell(const std::string& reason)
{
  throw Error(Error::Kind::InvalidParameter, reason);
}

std::string Mm(double number)
{
  return NumberText(std::round(1000.0 * number) / 1000.0) + " mm";
}

} // namespace

ParameterList Describe(ShellParameters& p)
{
  return {
      Parameter("ThicknessMm", p.thicknessMm, {0.4, 20}, "mm", "Thickness of the skin."),
      Parameter("Measured", Choice(p.measured, {"surface", "camera"}),
                "How thickness is measured: to the nearest place of the surface, or along the ray to the camera."),
      Parameter("ResolutionMm", p.resolutionMm, {0.1, 5}, "mm",
                "Edge of the cells of the level set, at most half of ThicknessMm. Sharp edges are broken by up to half of it."),
      Parameter("Up", p.up, {-1e6, 1e6}, "", "The direction from the opening to the skin."),
      Parameter("OpeningMm", p.openingMm, {0, 1e4, true}, "mm",
                "Height of the plane of the opening above the body's lowest point. What lies below is not printed."),
      Parameter("FlangeMm", p.flangeMm, {0, 100}, "mm", "How far the flange and the base reach beyond the skin. 0: no flange."),
      Parameter("FlangeThicknessMm", p.flangeThicknessMm, {0.5, 30}, "mm", "Thickness of the flange."),
      Parameter("Screws", p.screws, {0, 64}, "", "Number of screw holes in flange and base."),
      Parameter("ScrewMm", p.screwMm, {1, 20}, "mm", "Diameter of the screw holes."),
      Parameter("BaseMm", p.baseMm, {1, 50}, "mm", "Thickness of the base."),
      Parameter("BaffleMm", p.baffleMm, {0, 100}, "mm",
                "Height of the base's lip along the skin's inside, which keeps light out. 0: none."),
      Parameter("ClearanceMm", p.clearanceMm, {0, 3}, "mm", "Between parts that fit into each other."),
      Parameter("LensHoleMm", p.lensHoleMm, {1, 100}, "mm", "Diameter of the camera's hole, in the middle of the base."),
      Parameter("BoardMm", p.boardMm, {1, 100}, "mm",
                "The camera's board: its edges, with the lens in its middle, and the depth of its pocket in the base."),
      Parameter("LensMm", p.lensMm, {0, 100}, "mm", "How far the lens's optical centre lies above the board."),
      Parameter("Marks", Choice(p.marks, {"none", "holes", "bumps"}),
                "What is made of calibration points: holes that an LED fits in, or bumps that are removed later."),
      Parameter("MarkMm", p.markMm, {0.5, 20}, "mm", "Diameter of holes or bumps."),
      Parameter("Marker", p.marker, "Whether raised cells inside the skin's foot tell the camera which shell it is in."),
      Parameter("PrinterMm", p.printerMm, {1, 1e4}, "mm", "What the printer can make: its width, depth and height."),
      Parameter("CutToFit", p.cutToFit, "Whether what does not fit the printer is cut into parts that do."),
      Parameter("SeamMm", p.seamMm, {2, 50}, "mm", "How far parts that were cut reach behind, or into, the next one."),
  };
}

void ShellParameters::Check() const
{
  CheckRanges(*this);
  if (resolutionMm > 0.5 * thicknessMm)
    RefuseShell("ResolutionMm is " + Mm(resolutionMm) + "; it must be at most half of ThicknessMm, which is " + Mm(thicknessMm));
  if (!(up.norm() > 1e-9))
    RefuseShell("Up has no length");
  if (flangeMm > 0.0 && screws > 0 && screwMm > 0.7 * flangeMm)
    RefuseShell("ScrewMm is " + Mm(screwMm) + "; it must be at most 0.7 of FlangeMm, which is " + Mm(flangeMm));
  if (boardMm.z() > baseMm - 1.0)
    RefuseShell("BoardMm's pocket is " + Mm(boardMm.z()) + " deep; it must leave at least 1 mm of BaseMm, which is " +
                Mm(baseMm));
  if (lensHoleMm > boardMm.head<2>().minCoeff() - 2.0)
    RefuseShell("LensHoleMm is " + Mm(lensHoleMm) + "; the board would fall through: BoardMm is " + Mm(boardMm.x()) + " by " +
                Mm(boardMm.y()));
  if (marks == MarkKind::Bumps && markMm > 2.0 * thicknessMm)
    RefuseShell("MarkMm is " + Mm(markMm) + "; bumps must be at most twice as wide as ThicknessMm, which is " + Mm(thicknessMm));
}

Pose BodyToShell(const ShellParameters& p, const TriangleSurface& body)
{
  const Eigen::Quaterniond upright = Eigen::Quaterniond::FromTwoVectors(p.up, Vector3d::UnitZ());
  Eigen::AlignedBox3d bounds;
  for (const Eigen::Vector3f& point : body.points)
    bounds.extend(upright * point.cast<double>());
  if (bounds.isEmpty())
    throw Error(Error::Kind::BadInput, "the body has no points");
  const double level = bounds.min().z() + p.openingMm;
  if (level > bounds.max().z() - p.thicknessMm)
    RefuseShell("OpeningMm is " + Mm(p.openingMm) + "; the body is only " + Mm(bounds.sizes().z()) + " high along Up");
  Eigen::AlignedBox2d section;
  for (const auto& triangle : body.triangles)
    for (std::size_t n = 0; n < 3; ++n) {
      const Vector3d a = upright * body.points[triangle[n]].cast<double>(),
                     b = upright * body.points[triangle[(n + 1) % 3]].cast<double>();
      if ((a.z() < level) != (b.z() < level))
        section.extend((a + (level - a.z()) / (b.z() - a.z()) * (b - a)).head<2>());
    }
  if (section.isEmpty())
    throw Error(Error::Kind::NotPossible, "the body has a gap where the plane of the opening is");
  return Pose(Eigen::Translation3d(-section.center().x(), -section.center().y(), -level) * upright);
}

std::uint32_t MarkerIdOf(const ShellParameters& p, const TriangleSurface& body)
{
  std::string bytes;
  const auto add = [&bytes](const auto& number) {
    char raw[sizeof number];
    std::memcpy(raw, &number, sizeof number);
    bytes.append(raw, sizeof number);
  };
  for (const Eigen::Vector3f& point : body.points)
    for (const float coordinate : point)
      add(coordinate);
  for (const double number : {p.thicknessMm, p.openingMm, p.up.x(), p.up.y(), p.up.z(), static_cast<double>(p.measured)})
    add(number);
  return Crc24(bytes);
}

double MarkRod(const Vector3d& p, const ShellMark& mark, double radius, double low, double high)
{
  const Vector3d from = p - mark.place;
  const double along = from.dot(mark.normal);
  return std::max({(from - along * mark.normal).norm() - radius, along - high, low - along});
}

double LowestMark(const ShellParameters& p)
{
  return (p.flangeMm > 0.0 ? p.flangeThicknessMm : 0.0) + 0.5 * p.markMm + 1.0;
}

ShellDesign::ShellDesign(const ShellParameters& parameters, const BodySurface& body, std::vector<ShellMark> marks,
                         std::uint32_t markerId)
  : p_(parameters), body_(body),
    marks_(p_.marks == ShellParameters::MarkKind::None ? std::vector<ShellMark>() : std::move(marks)),
    marker_(MarkerPattern::Of(markerId))
{
  PlanSkinAndBase();
}

// The first place that far from the body on the way in from outside: distances tell how far it is at least.
std::optional<Vector3d> ShellDesign::FromOutside(const Vector3d& place, const Vector3d& away, double distanceMm) const
{
  double radius = body_.Bounds().sizes().norm() + body_.Bounds().center().norm() + place.norm() + p_.flangeMm;
  for (const double start = radius; radius > -start;) {
    const double step = body_.Distance(place + radius * away) - distanceMm;
    if (step < 1e-4)
      return place + radius * away;
    radius -= step;
  }
  return std::nullopt;
}

Eigen::AlignedBox3d ShellDesign::FlangeBox() const
{
  Eigen::AlignedBox3d box;
  if (p_.flangeMm > 0.0)
    for (const double height : {0.0, p_.flangeThicknessMm})
      for (int i = 0; i < 720; ++i) {
        const double angle = turn * i / 720.0;
        if (const auto place = FromOutside({0.0, 0.0, height}, {std::cos(angle), std::sin(angle), 0.0}, p_.flangeMm))
          box.extend(*place);
      }
  return box;
}

void ShellDesign::PlanSkinAndBase()
{
  CutPlanes skin, base;
  const Vector3d printer = p_.printerMm - Vector3d::Constant(0.2); // what rounding, and an outline in steps, may miss
  const auto fits = [&printer](const Vector3d& size) {
    return (size.array() <= printer.array()).all() || (Vector3d(size.y(), size.x(), size.z()).array() <= printer.array()).all();
  };
  if (p_.cutToFit && !(fits(Bounds(Part::Skin).sizes()) && fits(Bounds(Part::Base).sizes()))) {
    Eigen::AlignedBox3d box = FlangeBox();
    const auto& surface = body_.Surface();
    for (const auto& triangle : surface.triangles)
      for (std::size_t n = 0; n < 3; ++n) {
        const Vector3d a = surface.points[triangle[n]].cast<double>(), b = surface.points[triangle[(n + 1) % 3]].cast<double>();
        if (a.z() >= 0.0)
          box.extend(a);
        if ((a.z() < 0.0) != (b.z() < 0.0))
          box.extend(a - a.z() / (b.z() - a.z()) * (b - a));
      }
    Eigen::AlignedBox3d plate = box;
    plate.min().z() = -p_.baseMm;
    plate.max().z() = p_.baffleMm;
    if (p_.marks == ShellParameters::MarkKind::Bumps) {
      box.min().head<2>() -= Vector2d::Constant(0.5 * p_.markMm);
      box.max() += Vector3d::Constant(0.5 * p_.markMm);
    }
    if (!fits(box.sizes()))
      skin = PlanCuts(box, printer, p_.seamMm);
    // The camera's place stays in one part.
    const Vector2d keep = (0.5 * p_.boardMm.head<2>()).array() + p_.clearanceMm + p_.seamMm + 3.0;
    if (!fits(plate.sizes()) && plate.sizes().z() <= printer.z())
      base = PlanCuts(plate, printer, p_.seamMm, keep);
    const double lowest = std::max(p_.baffleMm + p_.clearanceMm, p_.flangeThicknessMm) + p_.seamMm + 2.0;
    if (!skin.at[2].empty() && skin.at[2].front() < lowest)
      throw Error(Error::Kind::NotPossible, "the skin would have to be cut " + Mm(skin.at[2].front()) +
                                                " above its foot; a printer (PrinterMm) of more height is needed");
  }
  PlaceScrews({&skin, &base});
  const auto makeCells = [this](const CutPlanes& planes, const std::vector<CutPeg>& pegs, std::vector<CutCell>& cells) {
    if (planes.IsCut())
      for (const Eigen::Array3i& which : CellsOf(planes))
        cells.emplace_back(planes, which, pegs, p_);
  };
  if (p_.marker)
    PlaceMarker(skin);
  makeCells(skin, FlangePegs(skin), skinCells_);
  makeCells(base, BasePegs(base), baseCells_);
  makeCells(base, FlangePegs(base), domeCells_);
}

// Where a sensor that is wider than high sees it, off the seams, above the lip of the base.
void ShellDesign::PlaceMarker(const CutPlanes& skin)
{
  const double lowest = p_.baffleMm + p_.clearanceMm + 0.5, room = p_.seamMm + p_.clearanceMm + 1.0;
  constexpr double width = MarkerPattern::columns * MarkerPattern::cellDegrees;
  std::string reason;
  double narrowest = unlimitedMm;
  for (const double middle : {25.0, 155.0, 205.0, 335.0}) {
    markerAzimuth_ = middle - 0.5 * width;
    reason.clear();
    for (int row = 0; row <= MarkerPattern::rows && reason.empty(); ++row)
      for (int column = 0; column <= MarkerPattern::columns && reason.empty(); ++column) {
        const double azimuth = (markerAzimuth_ + column * MarkerPattern::cellDegrees) / DegreesPerRadian,
                     elevation = (MarkerPattern::lowestDegrees + row * MarkerPattern::cellDegrees) / DegreesPerRadian;
        const Vector3d ray(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
        const auto way = body_.Along(Camera(), ray);
        const Vector3d place = Camera() + way.value_or(0.0) * ray;
        narrowest = std::min(narrowest, way.value_or(0.0) * MarkerPattern::cellDegrees / DegreesPerRadian);
        if (place.z() < lowest + p_.thicknessMm)
          reason = "it would lie behind the lip of the base (BaffleMm)";
        for (int axis = 0; axis < 3; ++axis)
          for (const double plane : skin.at[static_cast<std::size_t>(axis)])
            if (std::abs(place[axis] - plane) < room)
              reason = "seams go through wherever it might be";
      }
    if (narrowest < 3.0 * p_.resolutionMm)
      RefuseShell("ResolutionMm is " + Mm(p_.resolutionMm) + "; it must be at most a third of the marker's cells, which are " +
                  Mm(narrowest) + " wide");
    if (reason.empty())
      return;
  }
  throw Error(Error::Kind::NotPossible, "there is no place for the marker (Marker): " + reason);
}

bool ShellDesign::IsNearMarker(const Vector3d& place, double distanceMm) const
{
  if (!p_.marker)
    return false;
  const Vector3d from = place - Camera();
  const double across = from.head<2>().norm(), reach = std::max(from.norm(), 1e-6) / DegreesPerRadian;
  const double azimuth = std::remainder(std::atan2(from.y(), from.x()) * DegreesPerRadian - markerAzimuth_ -
                                            0.5 * MarkerPattern::columns * MarkerPattern::cellDegrees,
                                        360.0),
               elevation = std::atan2(from.z(), across) * DegreesPerRadian - MarkerPattern::lowestDegrees -
                           0.5 * MarkerPattern::rows * MarkerPattern::cellDegrees;
  return (std::abs(azimuth) - 0.5 * MarkerPattern::columns * MarkerPattern::cellDegrees) * reach < distanceMm &&
         (std::abs(elevation) - 0.5 * MarkerPattern::rows * MarkerPattern::cellDegrees) * reach < distanceMm;
}

// How far it is to the nearest border between light and dark, at most a cell; negative within dark cells.
double ShellDesign::MarkerCells(const Vector3d& place) const
{
  const Vector3d from = place - Camera();
  const double azimuth =
      std::remainder(std::atan2(from.y(), from.x()) * DegreesPerRadian - markerAzimuth_ - 180.0, 360.0) + 180.0;
  const double u = azimuth / MarkerPattern::cellDegrees,
               v = (std::atan2(from.z(), from.head<2>().norm()) * DegreesPerRadian - MarkerPattern::lowestDegrees) /
                   MarkerPattern::cellDegrees;
  const int column = static_cast<int>(std::floor(u)), row = static_cast<int>(std::floor(v));
  const bool isDark = marker_.IsDark(row, column);
  double nearest = 1.0;
  for (int r = row - 1; r <= row + 1; ++r)
    for (int c = column - 1; c <= column + 1; ++c)
      if (marker_.IsDark(r, c) != isDark)
        nearest = std::min(nearest, std::hypot(std::max({c - u, u - c - 1.0, 0.0}), std::max({r - v, v - r - 1.0, 0.0})));
  // A little larger than they are: cells that meet in a corner hang together, and corners leave no crumbs between nodes.
  return (isDark ? -nearest : nearest) * from.norm() * MarkerPattern::cellDegrees / DegreesPerRadian - 0.6 * p_.resolutionMm;
}

// In the middle of the flange, turned such that no plane goes through one.
void ShellDesign::PlaceScrews(const std::vector<const CutPlanes*>& planes)
{
  if (p_.flangeMm <= 0.0)
    return;
  double best = -1.0;
  for (int turned = 0; turned < 16 && best < p_.screwMm + p_.seamMm; ++turned) {
    std::vector<Vector2d> screws;
    double nearest = unlimitedMm;
    for (int i = 0; i < p_.screws; ++i) {
      const double angle = turn * (i + turned / 16.0) / p_.screws;
      const auto place = FromOutside(Vector3d::Zero(), {std::cos(angle), std::sin(angle), 0.0}, 0.5 * p_.flangeMm);
      if (!place)
        continue;
      screws.emplace_back(place->head<2>());
      for (const CutPlanes* cut : planes)
        for (int axis = 0; axis < 2; ++axis)
          for (const double plane : cut->at[static_cast<std::size_t>(axis)])
            nearest = std::min(nearest, std::abs((*place)[axis] - plane));
    }
    if (nearest > best) {
      best = nearest;
      screws_ = screws;
    }
  }
}

// Where planes cross the middle of the flange.
std::vector<CutPeg> ShellDesign::FlangePegs(const CutPlanes& planes) const
{
  std::vector<CutPeg> pegs;
  const double width = 0.4 * p_.flangeMm;
  if (width < 2.0)
    return pegs;
  for (int axis = 0; axis < 2; ++axis)
    for (std::size_t which = 0; which < planes.at[static_cast<std::size_t>(axis)].size(); ++which)
      for (const double side : {-1.0, 1.0}) {
        const double plane = planes.at[static_cast<std::size_t>(axis)][which];
        if (const auto place = FromOutside(plane * Vector3d::Unit(axis), side * Vector3d::Unit(1 - axis), 0.5 * p_.flangeMm))
          pegs.push_back(
              {axis, plane, planes.Direction(axis, which), (*place)[1 - axis], p_.seamMm, width, p_.flangeThicknessMm});
      }
  return pegs;
}

// All along the seams of the base, every 40 mm, where nothing else is.
std::vector<CutPeg> ShellDesign::BasePegs(const CutPlanes& planes) const
{
  std::vector<CutPeg> pegs;
  constexpr double width = 8.0, every = 40.0;
  for (int axis = 0; axis < 2; ++axis)
    for (std::size_t which = 0; which < planes.at[static_cast<std::size_t>(axis)].size(); ++which) {
      const double plane = planes.at[static_cast<std::size_t>(axis)][which];
      const auto end = [&](double side) {
        return FromOutside(plane * Vector3d::Unit(axis), side * Vector3d::Unit(1 - axis), p_.flangeMm);
      };
      const auto first = end(-1.0), last = end(1.0);
      if (!first || !last)
        continue;
      const double low = (*first)[1 - axis] + width, high = (*last)[1 - axis] - width;
      const int gaps = std::max(1, static_cast<int>((high - low) / every));
      for (int i = 0; i <= gaps; ++i) {
        const double beside = low + (high - low) * i / gaps;
        Vector3d place = plane * Vector3d::Unit(axis);
        place[1 - axis] = beside;
        const auto& others = planes.at[static_cast<std::size_t>(1 - axis)];
        const bool isFree = Screws(place) > width + p_.seamMm && std::none_of(others.begin(), others.end(), [&](double other) {
                              return std::abs(other - beside) < width + p_.seamMm;
                            });
        if (isFree)
          pegs.push_back({axis, plane, planes.Direction(axis, which), beside, p_.seamMm, width, 0.0});
      }
    }
  return pegs;
}

Vector3d ShellDesign::Camera() const
{
  return {0.0, 0.0, -p_.baseMm + p_.boardMm.z() + p_.lensMm};
}

Eigen::AlignedBox3d ShellDesign::Bounds(Part part) const
{
  Eigen::AlignedBox3d box = body_.Bounds();
  const double bump = p_.marks == ShellParameters::MarkKind::Bumps ? 0.5 * p_.markMm : 0.0;
  const double wider = std::max(p_.flangeMm, bump);
  box.min() -= Vector3d(wider, wider, 0.0);
  box.max() += Vector3d(wider, wider, bump);
  box.min().z() = part == Part::Skin ? 0.0 : -p_.baseMm;
  if (part == Part::Base)
    box.max().z() = p_.baffleMm;
  return box;
}

std::vector<std::uint32_t> ShellDesign::MarksNear(const Vector3d& middle, double distanceMm) const
{
  const double reach = distanceMm + p_.markMm + 2.0 * p_.thicknessMm + 4.0;
  std::vector<std::uint32_t> near;
  for (std::uint32_t i = 0; i < marks_.size(); ++i)
    if ((marks_[i].place - middle).squaredNorm() < reach * reach)
      near.push_back(i);
  return near;
}

double ShellDesign::Depth(const Vector3d& place, double distance) const
{
  // Beyond the wall the way along a ray is longer still, and nobody asks how long.
  if (p_.measured == ShellParameters::Thickness::Surface || distance >= 0.0 || -distance > p_.thicknessMm + 2.0 * p_.resolutionMm)
    return -distance;
  return body_.Along(place, place - Camera()).value_or(-distance);
}

double ShellDesign::Screws(const Vector3d& place) const
{
  double nearest = 1e9;
  for (const Vector2d& screw : screws_)
    nearest = std::min(nearest, (place.head<2>() - screw).norm() - 0.5 * p_.screwMm);
  return nearest;
}

double ShellDesign::ScrewHoles(const Vector3d& place) const
{
  return std::max(Screws(place), place.z() - p_.flangeThicknessMm - 4.0); // no higher: walls may lean over them
}

double ShellDesign::DeepestAt(const Vector3d& place, const CutCell* cell) const
{
  const bool isNearSeam = cell && cell->PlaneDistance(place) < p_.seamMm + 4.0 * p_.resolutionMm;
  if (isNearSeam)
    return 2.0 * p_.thicknessMm + p_.clearanceMm;
  return IsNearMarker(place, 4.0 * p_.resolutionMm) ? 2.0 * p_.thicknessMm : p_.thicknessMm;
}

double ShellDesign::Skin(const Vector3d& place, double distance, const std::vector<std::uint32_t>& marks,
                         const CutCell* cell) const
{
  const double inner = Depth(place, distance) - p_.thicknessMm;
  double skin = std::max({distance, inner, -place.z()});
  if (p_.flangeMm > 0.0) {
    const double flange = std::max({distance - p_.flangeMm, inner, place.z() - p_.flangeThicknessMm, -place.z()});
    skin = std::min(skin, flange);
    skin = std::max(skin, -ScrewHoles(place));
  }
  if (IsNearMarker(place, 4.0 * p_.resolutionMm))
    skin = std::min(skin, std::max({MarkerCells(place), distance, -distance - 2.0 * p_.thicknessMm, -place.z()}));
  const bool isHoles = p_.marks == ShellParameters::MarkKind::Holes;
  if (!isHoles)
    for (const std::uint32_t i : marks)
      skin = std::min(skin, std::max((place - marks_[i].place).norm() - 0.5 * p_.markMm, inner));
  if (cell)
    skin = std::min(std::max(skin, cell->Within(place)), cell->Laps(place, distance));
  if (isHoles) // through laps, too
    for (const std::uint32_t i : marks)
      skin = std::max(skin, -MarkRod(place, marks_[i], 0.5 * p_.markMm, -2.0 * p_.thicknessMm - 2.0, 2.0));
  return skin;
}

double ShellDesign::Base(const Vector3d& place, double distance, double foot, const CutCell* cell) const
{
  double base = std::max({foot - p_.flangeMm, place.z(), -place.z() - p_.baseMm});
  if (p_.baffleMm > 0.0) {
    const double inside = distance + p_.thicknessMm + p_.clearanceMm;
    base = std::min(base, std::max({inside, -inside - p_.thicknessMm, place.z() - p_.baffleMm, -place.z() - 0.5}));
  }
  const Vector2d aside = place.head<2>().cwiseAbs() - 0.5 * p_.boardMm.head<2>();
  const double pocket = std::max(aside.maxCoeff() - p_.clearanceMm, place.z() + p_.baseMm - p_.boardMm.z());
  const double lens = place.head<2>().norm() - 0.5 * p_.lensHoleMm;
  const double whole = std::max({base, -pocket, -lens, -Screws(place)});
  return cell ? std::max(whole, cell->Within(place)) : whole;
}

Vector3d ShellDesign::Refined(const Vector3d& place, const CutCell* cell) const
{
  const bool isPlain = IsPlainWall(place, p_.resolutionMm, cell);
  const double limit = (isPlain ? 0.5 : 0.12) * p_.resolutionMm; // elsewhere it may belong on a plane or in a hole
  const double plane = std::min(
      {std::abs(place.z()), std::abs(place.z() - p_.flangeThicknessMm), cell ? cell->PlaneDistance(place) : unlimitedMm});
  const bool isOnPlane = plane < 0.021 * p_.resolutionMm;
  // Cells of a marker meet in corners, and laps are a clearance off walls: a point that moves there may end in its neighbour.
  const bool isCrowded =
      IsNearMarker(place, 2.0 * p_.resolutionMm) || (cell && cell->PlaneDistance(place) < p_.seamMm + 2.0 * p_.resolutionMm);
  if (isOnPlane || (isCrowded && !isPlain))
    return place;
  Vector3d moved = place;
  for (int step = 0; step < 3; ++step) {
    const BodySurface::Place at = body_.PlaceOf(moved);
    if (std::abs(at.distanceMm) < limit) {
      moved = at.nearest;
      break;
    }
    const double beyond = Depth(moved, at.distanceMm) - p_.thicknessMm;
    if (at.distanceMm > 0.0 || std::abs(beyond) > limit)
      break;
    if (p_.measured == ShellParameters::Thickness::Camera)
      moved += beyond * (moved - Camera()).normalized();
    else
      moved += beyond * at.away;
    if (std::abs(beyond) < 1e-5)
      break;
  }
  return (moved - place).norm() <= limit ? moved : place;
}

bool ShellDesign::IsPlainWall(const Vector3d& place, double distanceMm, const CutCell* cell) const
{
  const double rim = p_.flangeMm > 0.0 ? p_.flangeThicknessMm : 0.0;
  if (place.z() < rim + distanceMm + p_.resolutionMm)
    return false;
  if (cell && cell->PlaneDistance(place) < p_.seamMm + distanceMm + p_.resolutionMm)
    return false;
  if (IsNearMarker(place, distanceMm + p_.resolutionMm))
    return false;
  return std::none_of(marks_.begin(), marks_.end(), [&](const ShellMark& mark) {
    const double reach = 0.5 * p_.markMm + p_.thicknessMm + p_.resolutionMm + distanceMm;
    return (mark.place - place).squaredNorm() < reach * reach;
  });
}

} // namespace echorama
