// SPDX-License-Identifier: BSD-3-Clause
#include "TissueSurface.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <tuple>

namespace echorama {
namespace {

auto Numbers(const Material& m)
{
  return std::tie(m.name, m.soundSpeed, m.density, m.attenuation, m.attenuationPower, m.scattererDensity, m.backscatterDb,
                  m.roughness, m.scatterProbability, m.youngsModulusKPa);
}

[[noreturn]] void RefuseSurface(const std::string& reason)
{
  throw Error(Error::Kind::BadInput, "the tissue surface " + reason);
}

} // namespace

void TissueSurface::Check() const
{
  if (materials.empty())
    RefuseSurface("has no material; the first is that of the background");
  for (const Material& material : materials)
    material.Check();
  for (const Body& body : bodies)
    if (body.material < 0 || static_cast<std::size_t>(body.material) >= materials.size())
      RefuseSurface("has a body \"" + body.name + "\" whose material (" + std::to_string(body.material) + ") is none of its " +
                    std::to_string(materials.size()));
  if (bodyOfTriangle.size() != triangles.size())
    RefuseSurface("has " + std::to_string(triangles.size()) + " triangles, but names the body of " +
                  std::to_string(bodyOfTriangle.size()));
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (bodyOfTriangle[i] < 0 || static_cast<std::size_t>(bodyOfTriangle[i]) >= bodies.size())
      RefuseSurface("has a triangle (" + std::to_string(i) + ") whose body (" + std::to_string(bodyOfTriangle[i]) +
                    ") is none of its " + std::to_string(bodies.size()));
    for (const std::uint32_t corner : triangles[i])
      if (corner >= points.size())
        RefuseSurface("has a triangle (" + std::to_string(i) + ") with a corner (" + std::to_string(corner) +
                      ") that is none of its " + std::to_string(points.size()) + " points");
  }
  for (std::size_t i = 0; i < points.size(); ++i)
    if (!points[i].allFinite())
      RefuseSurface("has a point (" + std::to_string(i) + ") that is not finite");
}

int TissueSurface::MaterialIndex(const Material& material)
{
  const auto found = std::find_if(materials.begin(), materials.end(),
                                  [&](const Material& other) { return Numbers(other) == Numbers(material); });
  if (found != materials.end())
    return static_cast<int>(found - materials.begin());
  materials.push_back(material);
  return static_cast<int>(materials.size()) - 1;
}

void TissueSurface::Append(const TissueSurface& other)
{
  const auto firstPoint = static_cast<std::uint32_t>(points.size());
  const auto firstBody = static_cast<std::int32_t>(bodies.size());
  points.insert(points.end(), other.points.begin(), other.points.end());
  for (const auto& [a, b, c] : other.triangles)
    triangles.push_back({a + firstPoint, b + firstPoint, c + firstPoint});
  for (const std::int32_t body : other.bodyOfTriangle)
    bodyOfTriangle.push_back(body + firstBody);
  for (const Body& body : other.bodies)
    bodies.push_back({body.name, MaterialIndex(other.materials[static_cast<std::size_t>(body.material)])});
}

TissueSurface TissueSurface::Only(int body) const
{
  TissueSurface only;
  only.materials = materials;
  if (body < 0)
    return only;
  only.bodies = {bodies[static_cast<std::size_t>(body)]};
  std::vector<std::uint32_t> place(points.size(), 0); // and 0 before it is taken
  for (std::size_t n = 0; n < triangles.size(); ++n) {
    if (bodyOfTriangle[n] != body)
      continue;
    auto& triangle = only.triangles.emplace_back(triangles[n]);
    for (std::uint32_t& corner : triangle) {
      if (place[corner] == 0) {
        only.points.push_back(points[corner]);
        place[corner] = static_cast<std::uint32_t>(only.points.size());
      }
      corner = place[corner] - 1;
    }
  }
  only.bodyOfTriangle.assign(only.triangles.size(), 0);
  return only;
}

} // namespace echorama
