// SPDX-License-Identifier: BSD-3-Clause
#include "TissueLattice.h"
#include "Core/Base/NumberText.h"
#include "Filters/Tissue/TissueLabels.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>
#include <set>
#include <sstream>

namespace echorama {
namespace {

constexpr double SoftestKPa = 0.5, StiffestKPa = 1e4;
constexpr double MostNodes = 2e7; // of some 2 KB each

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
  ImageGeometry middles = body.nodes;
  for (int& count : middles.dimensions)
    --count;
  middles.origin += 0.5 * middles.spacing;
  for (const Material& material : surface.materials) {
    TissueMaterial tissue;
    tissue.youngKPa = std::clamp(material.youngsModulusKPa, SoftestKPa, StiffestKPa);
    tissue.poisson = parameters.poisson;
    tissue.densityGPerCm3 = 1e-3 * material.density;
    tissue.rigid = held.count(material.name) > 0;
    body.materials.push_back(tissue);
  }
  const std::vector<std::int32_t> bodies = BodiesOn(surface, middles, progress);
  body.cells.reserve(bodies.size());
  for (const std::int32_t at : bodies) {
    const int material = at < 0 ? -1 : surface.bodies[static_cast<std::size_t>(at)].material;
    const bool isNone = material < 0 || surface.materials[static_cast<std::size_t>(material)].IsGas();
    body.cells.push_back(isNone ? -1 : material);
  }
  return body;
}

} // namespace echorama
