// SPDX-License-Identifier: BSD-3-Clause
// The scene is a short list, so a look-up is a loop from the last body (which counts most) to the first, with a test
// against the body's box before the distance to it: some 20 comparisons for most points.
#include "PhantomScene.h"
#include "PhantomSceneKeys.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace echorama {
namespace {

using described::Json;
using Eigen::Vector3d;

constexpr const char* phantomSchema = "echorama-phantom-1";

std::string NameOf(const PhantomScene& scene, std::size_t index)
{
  const std::string& name = scene.inclusions[index].name;
  return "inclusion " + std::to_string(index + 1) + (name.empty() ? "" : " (" + name + ")");
}

// A smooth curve through the given points (Catmull-Rom), as a path of short pieces.
std::vector<Vector3d> Curve(const std::vector<Vector3d>& through)
{
  constexpr int pieces = 5;
  const auto at = [&through](std::ptrdiff_t i) {
    return through[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(i, 0, static_cast<std::ptrdiff_t>(through.size()) - 1))];
  };
  std::vector<Vector3d> path{through.front()};
  for (std::ptrdiff_t i = 0; i + 1 < static_cast<std::ptrdiff_t>(through.size()); ++i)
    for (int piece = 1; piece <= pieces; ++piece) {
      const double t = static_cast<double>(piece) / pieces;
      const Vector3d a = at(i - 1), b = at(i), c = at(i + 1), d = at(i + 2);
      path.push_back(b + 0.5 * t * (c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a))));
    }
  return path;
}

Inclusion Body(const char* name, const Ellipsoid& shape, double db, double wallMm = 0.0, double wallDb = 0.0)
{
  return {name, shape, db, wallMm, wallDb, 0.0};
}

Inclusion Vessel(const char* name, const std::vector<Vector3d>& through, double radius, double wallMm, double wallDb)
{
  return {name, Tube{Curve(through), radius}, Inclusion::anechoicDb, wallMm, wallDb, 0.0};
}

// The value of |scaled| - 1 over its own gradient; the centre has none.
double DistanceFromAxes(const Vector3d& radii, const Vector3d& local)
{
  const Vector3d scaled = local.cwiseQuotient(radii);
  const double slope = scaled.cwiseQuotient(radii).norm();
  return slope > 0.0 ? scaled.norm() * (scaled.norm() - 1.0) / slope : -radii.minCoeff();
}

// The bodies alone, or the whole text.
struct PhantomText {
  PhantomScene scene;
};

template <class A>
void Describe(A& a, PhantomText& text)
{
  a.Constant("schema", phantomSchema);
  echorama::Describe(a, text.scene);
}

struct NoContext {};

class PhantomReader : public described::Reader<PhantomReader, NoContext> {
public:
  using Reader::Reader;
  template <class T>
  static void Validate(const T&)
  {
  }
  template <class T>
  static void Inherit(NoContext&, T&)
  {
  }
};

class PhantomWriter : public described::Writer<PhantomWriter> {};

} // namespace

ParameterList Describe(Ellipsoid& ellipsoid)
{
  return {Parameter("Centre", ellipsoid.centre, {}, "mm", "In the world."),
          Parameter("Radii", ellipsoid.radii, {0, 1e6, true}, "mm", "Along its own axes."),
          Parameter("Rotation", ellipsoid.rotation, {}, "radians", "How its axes are turned: axis times angle.")};
}

ParameterList Describe(Tube& tube)
{
  return {Parameter("Radius", tube.radius, {0, 1e6, true}, "mm", "Of the tube, its wall included.")};
}

ParameterList Describe(Inclusion& inclusion)
{
  const ParameterRange levels{Inclusion::anechoicDb, 60};
  return {Parameter("EchogenicityDb", inclusion.echogenicityDb, levels, "dB", "How loud it echoes; -120: clear fluid."),
          Parameter("WallMm", inclusion.wallMm, {0, 1e6}, "mm", "Thickness of the wall, its outermost part; 0: none."),
          Parameter("WallDb", inclusion.wallDb, levels, "dB", "Echogenicity of the wall."),
          Parameter("AttenuationDbPerMm", inclusion.attenuationDbPerMm, {0, 1000}, "dB/mm",
                    "How much of the echo a mm of the body on its way takes, there and back; of ellipsoids alone.")};
}

void PhantomScene::Check() const
{
  for (std::size_t i = 0; i < inclusions.size(); ++i) {
    const Inclusion& inclusion = inclusions[i];
    const std::string place = "phantom scene: " + NameOf(*this, i);
    const auto require = [&place](bool good, const char* what) {
      if (!good)
        throw Error(Error::Kind::InvalidParameter, place + ": " + what);
    };
    CheckRanges(inclusion, place);
    std::visit([&place](const auto& shape) { CheckRanges(shape, place); }, inclusion.shape);
    if (const auto* tube = std::get_if<Tube>(&inclusion.shape)) {
      require(tube->path.size() >= 2, "a tube needs at least two points");
      require(std::all_of(tube->path.begin(), tube->path.end(), [](const Vector3d& p) { return p.allFinite(); }),
              "a point of the path is not finite");
      require(inclusion.attenuationDbPerMm == 0.0, "only ellipsoids can attenuate");
    }
  }
}

PhantomScene DefaultScene()
{
  PhantomScene scene;
  auto& add = scene.inclusions;
  add.push_back(Body("muscle", {{0, 0, 2}, {190, 150, 13}, {0.02, 0.03, 0}}, -4, 1.2, 9));
  add.push_back(Body("organ", {{-10, 3, 64}, {92, 54, 41}, {0.05, 0.12, 0.15}}, 5, 1.6, 13));
  add.push_back(Body("kidney", {{66, 18, 84}, {28, 18, 17}, {0.2, -0.35, 0.5}}, -6, 1.4, 12));
  add.push_back(Body("kidney sinus", {{65, 18, 84}, {14, 7, 7}, {0.2, -0.35, 0.5}}, 10));
  add.push_back(Body("dark lesion", {{-18, -17, 76}, {15, 13, 11}, {0.3, 0.2, 0.1}}, -8));
  add.push_back(Body("bright lesion", {{29, -15, 36}, {12, 10, 9}, {0, 0.4, 0.2}}, 13));
  add.push_back(Body("small bright lesion", {{-46, 6, 84}, {7, 6, 6}, {0, 0, 0}}, 14));
  add.push_back(Vessel("portal vein", {{-105, -14, 84}, {-60, -4, 70}, {-14, 4, 60}, {26, 2, 56}, {60, -8, 52}, {105, -26, 58}},
                       6.5, 1.4, 11));
  add.push_back(Vessel("portal branch", {{-14, 4, 60}, {-8, 20, 50}, {2, 38, 40}, {6, 62, 34}}, 4.5, 0, 0));
  add.push_back(Vessel("left vein", {{-54, -56, 30}, {-42, -24, 42}, {-36, 8, 50}, {-26, 40, 78}, {-24, 66, 100}}, 5.0, 0, 0));
  add.push_back(Vessel("right vein", {{50, -62, 92}, {44, -22, 80}, {50, 14, 66}, {74, 56, 52}}, 4.0, 0, 0));
  add.push_back(Vessel("caval vein", {{22, -80, 84}, {16, -30, 88}, {4, 20, 86}, {-2, 80, 92}}, 8.0, 1.4, 10));
  add.push_back(Body("gall bladder", {{-80, -16, 56}, {17, 9, 10}, {0, 0.5, 0.3}}, Inclusion::anechoicDb, 1.4, 10));
  add.push_back(Body("cyst", {{-60, 22, 42}, {11, 10, 9}, {0, 0, 0}}, Inclusion::anechoicDb));
  add.push_back(Body("deep cyst", {{34, 32, 82}, {9, 12, 8}, {0, 0.3, 0}}, Inclusion::anechoicDb));
  add.push_back(Body("small cyst", {{72, -16, 32}, {8, 7, 6}, {0, 0, 0}}, Inclusion::anechoicDb));
  add.push_back(Body("cyst beneath the capsule", {{-10, -10, 35}, {7, 8, 6}, {0, 0, 0}}, Inclusion::anechoicDb));
  for (const Vector3d& place : {Vector3d(-6, -34, 56), Vector3d(46, 8, 34), Vector3d(-74, 8, 92), Vector3d(-4, 22, 70),
                                Vector3d(-30, 30, 32), Vector3d(88, -2, 70)})
    add.push_back(Body("grain", {place, {1.5, 1.5, 1.5}, {0, 0, 0}}, 24));
  add.push_back(Body("stone", {{8, 10, 32}, {4.5, 3.6, 2.8}, {0, 0.2, 0.4}}, 22));
  add.back().attenuationDbPerMm = 7.0;
  return scene;
}

std::vector<Inclusion> Jets()
{
  const auto plume = [](const char* name, const std::vector<Vector3d>& through, double radius, double db) {
    return Inclusion{name, Tube{Curve(through), radius}, db, 0.0, 0.0, 0.0};
  };
  return {plume("jet in the caval vein", {{16, -30, 88}, {10, -5, 87}, {4, 20, 86}}, 5.0, 8.0),
          plume("jet in the gall bladder", {{-90, -16, 60}, {-80, -16, 57}, {-72, -16, 52}}, 4.0, 6.0),
          plume("jet in the portal vein", {{-14, 4, 60}, {6, 3, 58}, {26, 2, 56}}, 4.0, 10.0),
          Body("jet in a cyst", {{-60, 22, 42}, {6, 5, 7}, {0, 0, 0}}, 6.0),
          Body("puff", {{12, -24, 58}, {9, 5, 5}, {0.3, 0.2, 0}}, 14.0),
          Body("shallow puff", {{-24, 16, 44}, {6, 8, 4}, {0, 0.3, 0.4}}, 12.0)};
}

std::string PhantomToJson(const PhantomScene& scene)
{
  PhantomText text{scene};
  return PhantomWriter::Write(text).dump();
}

PhantomScene PhantomFromJson(const std::string& text)
{
  const std::string name = "phantom scene";
  const Json whole = JsonPlace(name).Parse(text);
  // What describes a phantom says more than its bodies.
  Json bodies = Json::object();
  for (const char* key : {"schema", "inclusions"})
    if (whole.is_object() && whole.contains(key))
      bodies[key] = whole[key];
  if (bodies.contains("schema") && !bodies.contains("inclusions"))
    throw Error(Error::Kind::BadFile, name + ": \"inclusions\" is missing");
  PhantomText read;
  NoContext none;
  PhantomReader::Read(name, none, whole.is_object() ? bodies : whole, "", read);
  read.scene.Check();
  return read.scene;
}

double SignedDistance(const Ellipsoid& ellipsoid, const Vector3d& point)
{
  return DistanceFromAxes(ellipsoid.radii, ExpRotation(-ellipsoid.rotation) * (point - ellipsoid.centre));
}

double SignedDistance(const Tube& tube, const Vector3d& point)
{
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < tube.path.size(); ++i) {
    const Vector3d along = tube.path[i + 1] - tube.path[i], from = point - tube.path[i];
    const double length = along.squaredNorm();
    const double t = length > 0.0 ? std::clamp(from.dot(along) / length, 0.0, 1.0) : 0.0;
    nearest = std::min(nearest, (from - t * along).squaredNorm());
  }
  return std::sqrt(nearest) - tube.radius;
}

SceneLookup::SceneLookup(const PhantomScene& scene)
{
  for (auto inclusion = scene.inclusions.rbegin(); inclusion != scene.inclusions.rend(); ++inclusion) {
    Body body{{},
              inclusion->shape,
              Eigen::Matrix3d::Identity(),
              inclusion->wallMm,
              inclusion->echogenicityDb,
              inclusion->wallDb,
              std::pow(10.0, inclusion->echogenicityDb / 20.0),
              std::pow(10.0, inclusion->wallDb / 20.0)};
    if (const auto* ellipsoid = std::get_if<Ellipsoid>(&body.shape)) {
      body.worldToAxes = ExpRotation(-ellipsoid->rotation);
      // Half the box of a turned ellipsoid: the length of each row of (axes times radii).
      const Vector3d half = (body.worldToAxes.transpose() * ellipsoid->radii.asDiagonal()).rowwise().norm();
      body.box = Eigen::AlignedBox3d(ellipsoid->centre - half, ellipsoid->centre + half);
    } else {
      const Tube& tube = std::get<Tube>(body.shape);
      for (const Vector3d& point : tube.path)
        body.box.extend(point);
      body.box.min().array() -= tube.radius;
      body.box.max().array() += tube.radius;
    }
    bodies_.push_back(std::move(body));
  }
}

const SceneLookup::Body* SceneLookup::BodyAt(const Vector3d& point, bool& inWall) const
{
  for (const Body& body : bodies_) {
    if (!body.box.contains(point))
      continue;
    const auto* ellipsoid = std::get_if<Ellipsoid>(&body.shape);
    const double distance = ellipsoid ? DistanceFromAxes(ellipsoid->radii, body.worldToAxes * (point - ellipsoid->centre))
                                      : SignedDistance(std::get<Tube>(body.shape), point);
    if (distance < 0.0) {
      inWall = distance > -body.wallMm;
      return &body;
    }
  }
  return nullptr;
}

double SceneLookup::EchogenicityAt(const Vector3d& point) const
{
  bool inWall = false;
  const Body* body = BodyAt(point, inWall);
  return !body ? 0.0 : inWall ? body->wallDb : body->db;
}

double SceneLookup::AmplitudeAt(const Vector3d& point) const
{
  bool inWall = false;
  const Body* body = BodyAt(point, inWall);
  return !body ? 1.0 : inWall ? body->wallAmplitude : body->amplitude;
}

} // namespace echorama
