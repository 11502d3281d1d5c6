// SPDX-License-Identifier: BSD-3-Clause
// Every shape is a grid of known topology that is bent into place, so that it is closed by construction: an icosphere for
// blobs, rings with poles for tubes, a sheet with walls and a floor for
// blocks. Edges of a few degrees of curvature keep the normals, which decide how a wall mirrors sound, close to the true ones.
// Cost: one evaluation of the shape per point.
#include "BodyShapes.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Filters/Tissue/Icosphere.h"
#include <algorithm>
#include <cmath>
#include <utility>

namespace echorama {
namespace {

using Eigen::Vector3d;

[[noreturn]] void Refuse(const std::string& name, const std::string& reason)
{
  throw Error(Error::Kind::InvalidParameter, "body \"" + name + "\": " + reason);
}

// Begins a body; adds its points and triangles with indices that count from its own first point.
class NewBody {
public:
  NewBody(TissueSurface& tissue, const std::string& name, const Material& material, double detailMm)
    : tissue_(tissue), name_(name), first_(static_cast<std::uint32_t>(tissue.points.size())),
      index_(static_cast<int>(tissue.bodies.size()))
  {
    if (!(detailMm > 0.0))
      Refuse(name, "the edge of its triangles is " + NumberText(detailMm) + " mm; it must be above 0");
    tissue.bodies.push_back({name, tissue.MaterialIndex(material)});
  }

  std::uint32_t Point(const Vector3d& p)
  {
    if (!p.allFinite())
      Refuse(name_, "its shape is not finite");
    tissue_.points.push_back(p.cast<float>());
    return static_cast<std::uint32_t>(tissue_.points.size()) - 1 - first_;
  }
  void Triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c)
  {
    tissue_.triangles.push_back({a + first_, b + first_, c + first_});
    tissue_.bodyOfTriangle.push_back(index_);
  }
  /// A quadrilateral, its corners in turn.
  void Quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d)
  {
    Triangle(a, b, c);
    Triangle(a, c, d);
  }
  int Index() const { return index_; }

private:
  TissueSurface& tissue_;
  const std::string& name_;
  std::uint32_t first_;
  int index_;
};

// Two unit vectors that make a right-handed frame with a direction.
std::pair<Vector3d, Vector3d> Across(const Vector3d& direction)
{
  const Vector3d u = direction.unitOrthogonal();
  return {u, direction.cross(u)};
}

} // namespace

int AddBlob(TissueSurface& tissue, const std::string& name, const Material& material, const Vector3d& centre,
            const RadiusOf& radius, double detailMm)
{
  NewBody body(tissue, name, material, detailMm);
  double largest = 0.0;
  for (int axis = 0; axis < 3; ++axis)
    largest = std::max({largest, radius(Vector3d::Unit(axis)), radius(-Vector3d::Unit(axis))});
  if (!(largest > 0.0))
    Refuse(name, "its radius is " + NumberText(largest) + " mm; it must be above 0");
  // Each level halves the edges, which are 1.05 radii long at first: the one that comes nearest, rather too fine than too coarse.
  const double halvings = std::log2(1.05 * largest / detailMm);
  const int level = static_cast<int>(std::clamp(std::ceil(halvings - 0.35), 2.0, static_cast<double>(Icosphere::maxLevel)));
  const Icosphere sphere = Icosphere::Make(level);
  for (const Vector3d& direction : sphere.points) {
    const double r = radius(direction);
    if (!(r > 0.0))
      Refuse(name, "its radius is " + NumberText(r) + " mm; it must be above 0");
    body.Point(centre + r * direction);
  }
  for (const auto& [a, b, c] : sphere.triangles)
    body.Triangle(a, b, c);
  return body.Index();
}

RadiusOf Shell(const RadiusOf& radius, double thickness)
{
  return [radius, thickness](const Vector3d& direction) {
    constexpr double step = 1e-3; // radians
    const auto [u, v] = Across(direction);
    const auto slope = [&](const Vector3d& along) {
      return (radius((direction + step * along).normalized()) - radius((direction - step * along).normalized())) / (2.0 * step);
    };
    const double r = radius(direction);
    // The normal leans away from the direction by the angle whose tangent is the slope over the radius.
    const double lean = std::hypot(slope(u), slope(v)) / r;
    return std::max(r + thickness * std::sqrt(1.0 + lean * lean), 0.05 * r);
  };
}

RadiusOf EllipsoidRadius(const Vector3d& radii, const Eigen::Matrix3d& axes)
{
  return [radii, axes](const Vector3d& direction) { return 1.0 / (axes.transpose() * direction).cwiseQuotient(radii).norm(); };
}

int AddTube(TissueSurface& tissue, const std::string& name, const Material& material, const std::vector<Vector3d>& path,
            const std::vector<double>& radius, double detailMm)
{
  NewBody body(tissue, name, material, detailMm);
  if (path.size() < 2 || path.size() != radius.size())
    Refuse(name, "a tube needs two points at least, and a radius at each");
  for (std::size_t i = 0; i < path.size(); ++i)
    if (!(radius[i] > 0.0) || (i > 0 && !((path[i] - path[i - 1]).norm() > 0.0)))
      Refuse(name, "a radius of the tube is not above 0, or two of its points are one");
  const double largest = *std::max_element(radius.begin(), radius.end());
  const int quarter = static_cast<int>(std::clamp(std::ceil(0.5 * Pi * largest / detailMm), 3.0, 64.0));
  const auto sides = static_cast<std::uint32_t>(4 * quarter);

  // Frames are carried along the path with as little turning as may be, so that the sides run straight.
  Vector3d u = Vector3d::Zero();
  std::uint32_t before = 0;
  const auto ring = [&](const Vector3d& centre, const Vector3d& axis, double r) {
    const Vector3d w = axis.cross(u);
    std::uint32_t first = 0;
    for (std::uint32_t k = 0; k < sides; ++k) {
      const double angle = 2.0 * Pi * k / sides;
      const std::uint32_t id = body.Point(centre + r * (std::cos(angle) * u + std::sin(angle) * w));
      if (k == 0)
        first = id;
    }
    return first;
  };
  const auto join = [&](std::uint32_t a, std::uint32_t b) { // two rings, b further along
    for (std::uint32_t k = 0; k < sides; ++k) {
      const std::uint32_t l = (k + 1) % sides;
      body.Quad(a + k, a + l, b + l, b + k);
    }
  };
  std::uint32_t pole = 0;
  Vector3d axis = Vector3d::UnitZ();
  for (std::size_t i = 0; i < path.size(); ++i) {
    axis = (path[std::min(i + 1, path.size() - 1)] - path[i > 0 ? i - 1 : 0]).normalized();
    if (i == 0) {
      u = axis.unitOrthogonal();
      pole = body.Point(path[0] - radius[0] * axis);
      for (int k = 1; k < quarter; ++k) {
        const double angle = 0.5 * Pi * k / quarter;
        const std::uint32_t now = ring(path[0] - radius[0] * std::cos(angle) * axis, axis, radius[0] * std::sin(angle));
        if (k > 1)
          join(before, now);
        else
          for (std::uint32_t s = 0; s < sides; ++s)
            body.Triangle(pole, now + (s + 1) % sides, now + s);
        before = now;
      }
    }
    u = (u - axis.dot(u) * axis).normalized();
    const std::uint32_t now = ring(path[i], axis, radius[i]);
    join(before, now);
    before = now;
  }
  for (int k = quarter - 1; k > 0; --k) {
    const double angle = 0.5 * Pi * k / quarter, r = radius.back();
    const std::uint32_t now = ring(path.back() + r * std::cos(angle) * axis, axis, r * std::sin(angle));
    join(before, now);
    before = now;
  }
  pole = body.Point(path.back() + radius.back() * axis);
  for (std::uint32_t s = 0; s < sides; ++s)
    body.Triangle(pole, before + s, before + (s + 1) % sides);
  return body.Index();
}

int AddBlock(TissueSurface& tissue, const std::string& name, const Material& material, const Eigen::Vector2d& low,
             const Eigen::Vector2d& high, const HeightOf& upperSide, double lowerSide, double detailMm)
{
  NewBody body(tissue, name, material, detailMm);
  const Eigen::Vector2d size = high - low;
  if (!(size.minCoeff() > 0.0))
    Refuse(name, "a block must be wider than 0");
  const auto steps = [&](double length) {
    return static_cast<std::uint32_t>(std::clamp(std::ceil(length / detailMm), 1.0, 4000.0));
  };
  const std::uint32_t nx = steps(size.x()), ny = steps(size.y());
  const auto id = [nx](std::uint32_t i, std::uint32_t j) { return j * (nx + 1) + i; };
  std::vector<Vector3d> rim; // its points in turn, counter-clockwise in the xy plane
  std::vector<std::uint32_t> rimIds;
  const auto place = [&](std::uint32_t i, std::uint32_t j) {
    const double x = i == nx ? high.x() : low.x() + size.x() * i / nx, y = j == ny ? high.y() : low.y() + size.y() * j / ny;
    const double z = upperSide(x, y);
    if (!(z < lowerSide))
      Refuse(name, "its upper side is not above its lower one");
    return Vector3d(x, y, z);
  };
  for (std::uint32_t j = 0; j <= ny; ++j)
    for (std::uint32_t i = 0; i <= nx; ++i)
      body.Point(place(i, j));
  for (std::uint32_t j = 0; j < ny; ++j)
    for (std::uint32_t i = 0; i < nx; ++i)
      body.Quad(id(i, j), id(i, j + 1), id(i + 1, j + 1), id(i + 1, j)); // seen from above, where z is smaller
  const auto onRim = [&](std::uint32_t i, std::uint32_t j) {
    rim.push_back(place(i, j));
    rimIds.push_back(id(i, j));
  };
  for (std::uint32_t i = 0; i < nx; ++i)
    onRim(i, 0);
  for (std::uint32_t j = 0; j < ny; ++j)
    onRim(nx, j);
  for (std::uint32_t i = nx; i > 0; --i)
    onRim(i, ny);
  for (std::uint32_t j = ny; j > 0; --j)
    onRim(0, j);
  const std::uint32_t middle = body.Point(Vector3d(0.5 * (low.x() + high.x()), 0.5 * (low.y() + high.y()), lowerSide));
  const auto count = static_cast<std::uint32_t>(rim.size());
  for (const Vector3d& p : rim)
    body.Point(Vector3d(p.x(), p.y(), lowerSide));
  for (std::uint32_t k = 0; k < count; ++k) {
    const std::uint32_t l = (k + 1) % count;
    body.Quad(rimIds[k], rimIds[l], middle + 1 + l, middle + 1 + k);
    body.Triangle(middle, middle + 1 + k, middle + 1 + l);
  }
  return body.Index();
}

} // namespace echorama
