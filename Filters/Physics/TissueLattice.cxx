// SPDX-License-Identifier: BSD-3-Clause
#include "TissueLattice.h"
#include "Core/Base/NumberText.h"
#include "Filters/Physics/LatticeField.h"
#include "Filters/Tissue/TissueLabels.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>
#include <map>
#include <set>
#include <sstream>
#include <tuple>

namespace echorama {
namespace {

constexpr double SoftestKPa = 0.5, StiffestKPa = 1e4;
constexpr int PointsAlongEdge = 4; // of a cell
constexpr double MostNodes = 2e7;  // of some 2 KB each

// What lies in a cell, by its points: sums of theirs.
struct CellContent {
  int filled = 0, held = 0;
  double stiffness = 0.0, density = 0.0; // kPa, g/cm^3
  CellContent& operator+=(const CellContent& other)
  {
    filled += other.filled;
    held += other.held;
    stiffness += other.stiffness;
    density += other.density;
    return *this;
  }
};

std::set<std::string> HeldMaterials(const TissueSurface& surface, const std::string& names)
{
  std::set<std::string> held;
  std::istringstream text(names);
  for (std::string name; text >> name;) {
    if (std::none_of(surface.materials.begin(), surface.materials.end(), [&name](const Material& m) { return m.name == name; }))
      StandardMaterial(name); // throws when nobody knows it
    held.insert(name);
  }
  return held;
}

} // namespace

ParameterList Describe(TissueLatticeParameters& p)
{
  return {
      Parameter("SpacingMm", p.spacingMm, {0.1, 100.0}, "mm",
                "Edge of the cells that tissue is divided into. Half of it makes eight times as many."),
      Parameter("Poisson", p.poisson, {0.0, 0.499}, "", "Poisson's ratio of all tissue: 0.5 would keep its volume."),
      Parameter("HeldMaterials", p.heldMaterials, "Names of materials that do not move at all, with blanks between them."),
  };
}

ImageGeometry TissueLatticeOf(const TissueSurface& surface, const TissueLatticeParameters& parameters)
{
  CheckRanges(parameters);
  Eigen::AlignedBox3d box;
  for (const auto& triangle : surface.triangles)
    for (const std::uint32_t corner : triangle)
      box.extend(surface.points[corner].cast<double>());
  if (box.isEmpty())
    throw Error(Error::Kind::BadInput, "there is no tissue: it has no triangles");
  const double h = parameters.spacingMm;
  const Eigen::Vector3d cells = ((box.sizes() / h).array() - 1e-6).ceil().max(1.0);
  if ((cells.array() + 1.0).prod() > MostNodes)
    throw Error(Error::Kind::InvalidParameter, "SpacingMm: cells of " + NumberText(h) + " mm are too many for tissue of " +
                                                   NumberText(std::round(box.sizes().maxCoeff())) + " mm");
  ImageGeometry nodes;
  for (int axis = 0; axis < 3; ++axis)
    nodes.dimensions[static_cast<std::size_t>(axis)] = static_cast<int>(cells[axis]) + 1;
  nodes.spacing.setConstant(h);
  nodes.origin = box.center() - 0.5 * h * cells;
  return nodes;
}

TissueBody TissueBodyOf(const TissueSurface& surface, const TissueLatticeParameters& parameters, const Progress& progress)
{
  surface.Check();
  const std::set<std::string> held = HeldMaterials(surface, parameters.heldMaterials);
  TissueBody body;
  body.nodes = TissueLatticeOf(surface, parameters);
  ImageGeometry points = body.nodes;
  std::array<int, 3> size{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    size[axis] = points.dimensions[axis] - 1;
    points.dimensions[axis] = PointsAlongEdge * size[axis];
  }
  points.spacing /= PointsAlongEdge;
  points.origin += 0.5 * points.spacing;
  std::vector<CellContent> contentOf; // of a point in a body
  for (const auto& each : surface.bodies) {
    const Material& material = surface.materials[static_cast<std::size_t>(each.material)];
    CellContent content;
    if (!material.IsGas())
      content = {1, held.count(material.name) > 0 ? 1 : 0, std::clamp(material.youngsModulusKPa, SoftestKPa, StiffestKPa),
                 1e-3 * material.density};
    contentOf.push_back(content);
  }
  std::vector<CellContent> cells(static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
                                 static_cast<std::size_t>(size[2]));
  const auto at = [&size](int i, int j, int k) {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(size[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(size[0]) +
           static_cast<std::size_t>(i);
  };
  {
    const std::vector<std::int32_t> bodies = BodiesOn(surface, points, progress);
    std::size_t next = 0;
    ForNodes(points.dimensions, [&](int i, int j, int k) {
      const std::int32_t here = bodies[next++];
      if (here >= 0)
        cells[at(i / PointsAlongEdge, j / PointsAlongEdge, k / PointsAlongEdge)] += contentOf[static_cast<std::size_t>(here)];
    });
  }
  constexpr int All = PointsAlongEdge * PointsAlongEdge * PointsAlongEdge;
  // What lies in cells that stay empty goes to the fullest cell beside them: skin is thinner than a cell.
  std::vector<CellContent> whole = cells;
  ForNodes(size, [&](int i, int j, int k) {
    const CellContent& part = cells[at(i, j, k)];
    if (part.filled == 0 || 2 * part.filled >= All)
      return;
    const std::array<int, 3> index{i, j, k};
    std::size_t fullest = 0;
    int filled = 0;
    for (std::size_t side = 0; side < 6; ++side) {
      std::array<int, 3> there = index;
      there[side / 2] += side % 2 ? 1 : -1;
      if (there[side / 2] < 0 || there[side / 2] >= size[side / 2])
        continue;
      const std::size_t other = at(there[0], there[1], there[2]);
      if (2 * cells[other].filled >= All && cells[other].filled > filled) {
        filled = cells[other].filled;
        fullest = other;
      }
    }
    if (filled > 0)
      whole[fullest] += part;
  });
  std::map<std::tuple<double, double, bool>, int> numbers;
  body.cells.reserve(cells.size());
  for (std::size_t n = 0; n < cells.size(); ++n) {
    if (2 * cells[n].filled < All) {
      body.cells.push_back(-1);
      continue;
    }
    TissueMaterial tissue;
    tissue.youngKPa = whole[n].stiffness / All;
    tissue.poisson = parameters.poisson;
    tissue.densityGPerCm3 = whole[n].density / All;
    tissue.rigid = 2 * cells[n].held >= All;
    const auto [place, isNew] =
        numbers.try_emplace({tissue.youngKPa, tissue.densityGPerCm3, tissue.rigid}, static_cast<int>(body.materials.size()));
    if (isNew)
      body.materials.push_back(tissue);
    body.cells.push_back(place->second);
  }
  return body;
}

} // namespace echorama
