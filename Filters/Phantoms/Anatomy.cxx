// SPDX-License-Identifier: BSD-3-Clause
// Everything is made in the frame of the trunk, from the skin inwards. First come the layers, as blocks that each contain the
// next; "depth" below is the z of a layer's upper side over (x, y). The organs hang below the deepest place of the wall, so
// that they never reach into it, whatever the layers' thickness. Shapes are ellipsoids bent by a few smooth waves and scaled
// so that they stay within their ellipsoid: extents are known, and Check() can say what trunk they need.
//
// Each part draws from a stream of its own, (seed, part), so that a change of one parameter leaves the other parts as they are.
// In the liver lesions take their places first, then the trees grow around them, the portal vein before the hepatic veins.
#include "Anatomy.h"
#include "BodyShapes.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Random.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace echorama {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

enum class Part : std::uint64_t {
  Layers = 1,
  Septa,
  Lumps,
  Liver,
  Kidney,
  Gallbladder,
  Stones,
  Lesions,
  Portal,
  Hepatic,
  Great,
  Ribs
};

Random StreamOf(const AnatomyParameters& p, Part part)
{
  return Random(p.seed, static_cast<std::uint64_t>(part));
}

// A few smooth waves over the plane, in [-1, 1].
class Ripple {
public:
  explicit Ripple(Random& random)
  {
    double sum = 0.0;
    for (Wave& wave : waves_) {
      const double angle = random.Uniform(0.0, 2.0 * Pi), length = random.Uniform(45.0, 160.0);
      wave.number = 2.0 * Pi / length * Vector2d(std::cos(angle), std::sin(angle));
      wave.phase = random.Uniform(0.0, 2.0 * Pi);
      wave.share = length;
      sum += length;
    }
    for (Wave& wave : waves_)
      wave.share /= sum;
  }
  double operator()(double x, double y) const
  {
    double value = 0.0;
    for (const Wave& wave : waves_)
      value += wave.share * std::sin(wave.number.dot(Vector2d(x, y)) + wave.phase);
    return value;
  }

private:
  struct Wave {
    Vector2d number;
    double phase, share;
  };
  std::array<Wave, 6> waves_;
};

// A few smooth waves over the sphere, in [-1, 1]: products of the coordinates up to the third order, as spherical harmonics of
// low order are, with random coefficients.
class Waviness {
public:
  explicit Waviness(Random& random)
  {
    for (double& c : coefficients_)
      c = random.Uniform(-1.0, 1.0);
    double largest = 0.0; // over a spiral of directions; the waves are so long that no other goes much beyond
    constexpr int directions = 600;
    for (int i = 0; i < directions; ++i) {
      const double z = (2.0 * i + 1.0) / directions - 1.0, r = std::sqrt(1.0 - z * z), angle = 2.399963229728653 * i;
      largest = std::max(largest, std::abs((*this)({r * std::cos(angle), r * std::sin(angle), z})));
    }
    for (double& c : coefficients_)
      c /= 1.04 * largest;
  }
  double operator()(const Vector3d& d) const
  {
    const double x = d.x(), y = d.y(), z = d.z();
    // Each is scaled to reach 1.
    const std::array<double, 12> waves{x,
                                       y,
                                       z,
                                       2.0 * x * y,
                                       2.0 * y * z,
                                       2.0 * z * x,
                                       x * x - y * y,
                                       1.5 * z * z - 0.5,
                                       x * (x * x - 3.0 * y * y),
                                       y * (3.0 * x * x - y * y),
                                       5.196152422706632 * x * y * z,
                                       0.5 * z * (5.0 * z * z - 3.0)};
    double value = 0.0;
    for (std::size_t i = 0; i < waves.size(); ++i)
      value += coefficients_[i] * waves[i];
    return value;
  }

private:
  std::array<double, 12> coefficients_;
};

// An ellipsoid bent by waves, nowhere outside of the ellipsoid.
RadiusOf Bent(const RadiusOf& ellipsoid, const Waviness& waviness, double share)
{
  return [ellipsoid, waviness, share](const Vector3d& d) { return ellipsoid(d) * (1.0 + share * waviness(d)) / (1.0 + share); };
}

Material Mixed(const char* of, const char* name, double backscatterDb)
{
  Material material = StandardMaterial(of);
  material.name = name;
  material.backscatterDb = backscatterDb;
  return material;
}

// Thin tissue that shows by its density: were sound much faster in it than beside it, it would be thrown back whole where it
// grazes a sheet, and each sheet would cast shadows.
Material Sheet(const char* name, double backscatterDb, double soundSpeed)
{
  Material material = Mixed("capsule", name, backscatterDb);
  material.soundSpeed = soundSpeed;
  material.density = 1180.0;
  return material;
}

// The wall of the trunk: at which depth each of its layers begins.
class Wall {
public:
  explicit Wall(const AnatomyParameters& p) : standoff_(p.standoffMm)
  {
    Random random = StreamOf(p, Part::Layers);
    const std::array<double, layers> thickness{p.skinMm, p.fatMm, p.fasciaMm, p.muscleMm, p.fasciaMm};
    for (int i = 0; i < layers; ++i) {
      const bool even = i == 2 || i == 4; // sheets of fascia
      const double mean = thickness[static_cast<std::size_t>(i)];
      layers_.push_back(
          {mean, even ? 0.0 : std::min(i == 0 ? 0.25 * p.undulationMm : p.undulationMm, 0.5 * mean), Ripple(random)});
    }
  }
  /// z where the layer begins: 0 skin, 1 fat, 2 fascia, 3 muscle, 4 fascia, 5 what lies behind the wall.
  double Depth(int layer, double x, double y) const
  {
    double z = standoff_;
    for (int i = 0; i < layer; ++i) {
      const Layer& one = layers_[static_cast<std::size_t>(i)];
      z += one.mean + one.swing * one.ripple(x, y);
    }
    return z;
  }
  /// No place of the wall reaches deeper.
  double Deepest() const
  {
    double z = standoff_;
    for (const Layer& layer : layers_)
      z += layer.mean + layer.swing;
    return z;
  }

  static constexpr int layers = 5;

private:
  struct Layer {
    double mean, swing;
    Ripple ripple;
  };
  double standoff_;
  std::vector<Layer> layers_;
};

// What the organs need, in mm at organScale 1: half the width and length, and the depth behind the wall. How far an individual
// moves them is added.
constexpr double halfWidth = 104.0, halfLength = 66.0, depthOfOrgans = 118.0, depthOfSpine = 148.0, edge = 4.0;
constexpr double shiftMm = 3.0; // of an organ, at most, at variation 1

struct Organ {
  Vector3d centre;
  RadiusOf radius; // of its outside
  RadiusOf inner;  // within its capsule
};

class AnatomyMaker {
public:
  AnatomyMaker(const AnatomyParameters& p, const Progress& progress) : p_(p), progress_(progress), wall_(p), scale_(p.organScale)
  {
  }

  TissueSurface Make()
  {
    tissue_.MaterialIndex(StandardMaterial("gel"));
    AddWall();
    progress_(0.3);
    AddSepta();
    AddLumps();
    AddBones();
    AddGreatVessels();
    progress_(0.5);
    if (p_.liver)
      AddLiver();
    progress_(0.8);
    if (p_.kidney)
      AddKidney();
    if (p_.gallbladder)
      AddGallbladder();
    progress_(1.0);
    return std::move(tissue_);
  }

private:
  // A place of the organs, given at scale 1 and relative to the back of the wall.
  Vector3d Place(double x, double y, double z) const { return {scale_ * x, scale_ * y, wall_.Deepest() + 1.0 + scale_ * z}; }

  Vector3d Shift(Random& random) const
  {
    const double most = shiftMm * scale_ * p_.variation;
    const double x = random.Uniform(-most, most), y = random.Uniform(-most, most), z = random.Uniform(0.0, most);
    return {x, y, z};
  }

  // Individuals are smaller than the ellipsoid that is kept free for the organ, never larger.
  Vector3d Size(Random& random, double x, double y, double z) const
  {
    const double smaller = scale_ * (1.0 - 0.06 * p_.variation * random.Uniform());
    return {smaller * x, smaller * y, smaller * z};
  }

  // Small bodies get smaller triangles.
  double DetailFor(double radius) const { return std::min(p_.detailMm, std::max(0.15, radius / 6.0)); }

  int Blob(const std::string& name, const Material& material, const Vector3d& centre, const RadiusOf& radius, double detailMm)
  {
    return AddBlob(tissue_, name, material, centre, radius, detailMm);
  }

  // An organ in its capsule, which is left out at a thickness of 0.
  Organ AddOrgan(const std::string& name, const Material& material, const Vector3d& centre, const RadiusOf& radius)
  {
    Organ organ{centre, radius, p_.capsuleMm > 0.0 ? Shell(radius, -p_.capsuleMm) : radius};
    if (p_.capsuleMm > 0.0)
      Blob(name + " capsule", Sheet("capsule", 9.0, 1560.0), centre, organ.radius, p_.detailMm);
    Blob(name, material, centre, organ.inner, p_.detailMm);
    return organ;
  }

  void AddWall()
  {
    static const std::array<const char*, Wall::layers + 1> names{"skin",   "fat",          "outer fascia",
                                                                 "muscle", "inner fascia", "trunk"};
    const Material fascia = Sheet("fascia", 10.0, 1520.0);
    const std::array<Material, Wall::layers + 1> materials{StandardMaterial("skin"),
                                                           Mixed("fat", "subcutaneous-fat", -11.0),
                                                           fascia,
                                                           Mixed("muscle", "muscle-wall", -6.0),
                                                           fascia,
                                                           Mixed("tissue", "mesentery", 3.0)};
    const Vector2d high(0.5 * p_.trunkWidthMm, 0.5 * p_.trunkLengthMm);
    double inset = 0.0;
    for (int i = 0; i <= Wall::layers; ++i) {
      if ((i == 2 || i == 4) && p_.fasciaMm == 0.0)
        continue;
      const Vector2d corner = high - Vector2d::Constant(inset);
      AddBlock(
          tissue_, names[static_cast<std::size_t>(i)], materials[static_cast<std::size_t>(i)], -corner, corner,
          [this, i](double x, double y) { return wall_.Depth(i, x, y); }, p_.standoffMm + p_.trunkDepthMm - inset,
          i == 0 ? 20.0 : 1.4 * p_.detailMm);
      inset += 0.5;
    }
  }

  // Leaves that lie nearly flat: broad ones in the fat, narrow ones along the fibres of the muscle.
  void AddSepta()
  {
    const Material ofFat = Sheet("fat-septum", 6.0, 1465.0), ofMuscle = Sheet("muscle-septum", 5.0, 1575.0);
    for (int i = 0; i < p_.septa; ++i) {
      Random random(p_.seed, static_cast<std::uint64_t>(Part::Septa) + (static_cast<std::uint64_t>(i + 1) << 8));
      const bool inFat = i % 3 != 0;
      const int layer = inFat ? 1 : 3;
      for (int attempt = 0; attempt < 20; ++attempt) {
        const double length = random.Uniform(7.0, 16.0), width = inFat ? random.Uniform(5.0, 10.0) : random.Uniform(2.5, 5.0);
        const double x = random.Uniform(-0.5, 0.5) * (p_.trunkWidthMm - 50.0);
        const double y = random.Uniform(-0.5, 0.5) * (p_.trunkLengthMm - 50.0);
        const double from = wall_.Depth(layer, x, y), to = wall_.Depth(layer + 1, x, y);
        const double z = random.Uniform(from, to), tilt = random.Uniform(-0.12, 0.12);
        const double turn = inFat ? random.Uniform(0.0, Pi) : 0.6 + random.Uniform(-0.1, 0.1);
        const Eigen::Matrix3d axes =
            (Eigen::AngleAxisd(turn, Vector3d::UnitZ()) * Eigen::AngleAxisd(tilt, Vector3d::UnitY())).toRotationMatrix();
        const auto inside = [&](double along, double across) {
          const Vector3d at = Vector3d(x, y, z) + axes * Vector3d(along, across, 0.0);
          return at.z() > wall_.Depth(layer, at.x(), at.y()) + 0.6 && at.z() < wall_.Depth(layer + 1, at.x(), at.y()) - 0.6;
        };
        if (inside(0, 0) && inside(length, 0) && inside(-length, 0) && inside(0, width) && inside(0, -width)) {
          Blob(inFat ? "septum of fat" : "septum of muscle", inFat ? ofFat : ofMuscle, {x, y, z},
               EllipsoidRadius({length, width, random.Uniform(0.3, 0.5)}, axes), length / 2.5);
          break;
        }
      }
    }
  }

  // What fills the room around the organs: lobules of fat and loops of bowel, brighter and darker than the rest.
  void AddLumps()
  {
    const std::array<Material, 4> stuff{Mixed("tissue", "lobule-bright", 8.0), Mixed("tissue", "lobule-dark", -5.0),
                                        Mixed("tissue", "bowel-wall", -10.0), Mixed("tissue", "bowel", 1.0)};
    const double from = wall_.Deepest() + 4.0, to = p_.standoffMm + p_.trunkDepthMm - 10.0;
    for (int i = 0; i < p_.lumps; ++i) {
      Random random(p_.seed, static_cast<std::uint64_t>(Part::Lumps) + (static_cast<std::uint64_t>(i + 1) << 8));
      const Vector3d radii(random.Uniform(5.0, 16.0), random.Uniform(5.0, 22.0), random.Uniform(3.5, 10.0));
      const Eigen::Matrix3d axes = Eigen::AngleAxisd(random.Uniform(-0.4, 0.4), random.Direction()).toRotationMatrix();
      const double most = radii.maxCoeff();
      const double x = random.Uniform(-1.0, 1.0) * (0.5 * p_.trunkWidthMm - most - edge);
      const double y = random.Uniform(-1.0, 1.0) * (0.5 * p_.trunkLengthMm - most - edge);
      const double z = random.Uniform(from + most, std::max(from + most, to - most));
      if (z + most > to)
        continue;
      const RadiusOf shape = Bent(EllipsoidRadius(radii, axes), Waviness(random), 0.2);
      const bool loop = i % 3 == 2;
      Blob(loop ? "bowel wall" : "lobule", stuff[loop ? 2 : static_cast<std::size_t>(i % 3)], {x, y, z}, shape, most / 2.5);
      if (loop)
        Blob("bowel", stuff[3], {x, y, z}, Shell(shape, -0.25 * radii.minCoeff()), most / 2.5);
    }
  }

  void AddBones()
  {
    const Material& bone = StandardMaterial("bone");
    const double half = 0.5 * p_.trunkLengthMm - 12.0;
    const double swing = std::min(p_.undulationMm, 0.5 * p_.muscleMm);
    const double radius = std::min(4.5, 0.38 * (p_.muscleMm - swing));
    for (int i = 0; i < p_.ribs; ++i) {
      const double x0 = -0.5 * p_.trunkWidthMm + 55.0 + 24.0 * i;
      std::vector<Vector3d> path;
      for (double y = -half; y <= half; y += 2.0) {
        const double x = x0 + 0.2 * y - 0.0008 * y * y;
        if (std::abs(x) < 0.5 * p_.trunkWidthMm - 12.0)
          path.emplace_back(x, y, 0.5 * (wall_.Depth(3, x, y) + wall_.Depth(4, x, y)));
      }
      if (path.size() > 1)
        AddTube(tissue_, "rib", bone, path, std::vector<double>(path.size(), radius), DetailFor(1.5 * radius));
    }
    if (!p_.spine)
      return;
    const double pitch = 31.0 * scale_;
    const int most = static_cast<int>((half - 13.0 * scale_) / pitch);
    for (int i = -most; i <= most; ++i) {
      // A rounded cylinder: an ellipsoid to the fourth power.
      const Vector3d radii = scale_ * Vector3d(20.0, 13.0, 17.0);
      const auto shape = [radii](const Vector3d& d) {
        const Vector3d q = d.cwiseQuotient(radii);
        return std::pow(std::pow(std::hypot(q.x(), q.z()), 4) + std::pow(q.y(), 4), -0.25);
      };
      Blob("vertebra", bone, Place(0.0, 0.0, 130.0) + Vector3d(0.0, i * pitch, 0.0), shape, p_.detailMm);
    }
  }

  // One vessel along the whole trunk.
  void AddPipe(const std::string& name, double x, double z, double radius, Random& random)
  {
    const double half = 0.5 * p_.trunkLengthMm - 8.0 - 1.5 * radius;
    const double sway = 2.5 * p_.variation * scale_, phase = random.Uniform(0.0, 2.0 * Pi);
    std::vector<Vector3d> path;
    for (double y = -half; y <= half; y += 2.0)
      path.push_back(Place(x, 0.0, z) + Vector3d(sway * std::sin(y / 35.0 + phase), y, 0.3 * sway * std::cos(y / 28.0 + phase)));
    const double wall = std::min(0.12, p_.wallShare) * radius;
    AddTube(tissue_, name + " wall", Sheet("vessel-wall", 8.0, 1572.0), path, std::vector<double>(path.size(), radius + wall),
            DetailFor(2.0 * radius));
    AddTube(tissue_, name, StandardMaterial("blood"), path, std::vector<double>(path.size(), radius), DetailFor(2.0 * radius));
  }

  void AddGreatVessels()
  {
    if (!p_.greatVessels)
      return;
    Random random = StreamOf(p_, Part::Great);
    AddPipe("vena cava", -16.0, 97.0, 10.0 * scale_, random);
    AddPipe("aorta", 15.0, 99.0, 9.0 * scale_, random);
  }

  void AddLiver()
  {
    Random random = StreamOf(p_, Part::Liver);
    Vector3d centre = Place(-28.0, 0.0, 41.0) + Shift(random);
    const Vector3d radii = Size(random, 72.0, 62.0, 40.0);
    const Waviness waviness(random);
    // Where the portal vein enters (the hilum, a hollow of the hind side), and where the hepatic veins leave.
    const Vector3d hilum = Vector3d(0.3, -0.2, 0.93).normalized(), dome = Vector3d(0.1, 0.72, 0.69).normalized();
    const RadiusOf bent = Bent(EllipsoidRadius(radii), waviness, 0.12 * p_.variation);
    const RadiusOf radius = [bent, hilum](const Vector3d& d) {
      // Thin towards the left lobe (+x), hollow at the hilum.
      return bent(d) * (1.0 - 0.22 * (1.0 + d.x()) * std::pow(std::max(0.0, d.z()), 1.5)) *
             (1.0 - 0.22 * std::exp(-(d - hilum).squaredNorm() / 0.35));
    };
    // It lies against the wall: where its surface comes nearest to the probe.
    double nearest = 0.0;
    for (int i = 0; i < 400; ++i) {
      const double z = -1.0 + 0.5 * i / 400.0, across = std::sqrt(1.0 - z * z), angle = 2.399963229728653 * i;
      const Vector3d d(across * std::cos(angle), across * std::sin(angle), z);
      nearest = std::min(nearest, radius(d) * z);
    }
    centre.z() = Place(0.0, 0.0, 1.0).z() - nearest;
    const Organ liver = AddOrgan("liver", StandardMaterial("liver"), centre, radius);

    const double root = p_.vesselRadiusMm;
    const auto tree = [&](const Vector3d& at, const Vector3d& target, double rootRadius, Part part, double outside) {
      VesselTreeParameters t;
      t.seed = p_.seed * 16 + static_cast<std::uint64_t>(part);
      t.rootRadiusMm = rootRadius;
      t.smallestRadiusMm = p_.smallestVesselMm;
      t.generations = p_.generations;
      t.asymmetry = p_.branchAsymmetry;
      t.lengthOverRadius = 4.5;
      t.rootLengthMm = (outside + 10.0) * scale_ + rootRadius;
      t.root = centre + (liver.radius(at) + outside * scale_) * at;
      t.direction = centre + scale_ * target - t.root;
      return t;
    };
    const VesselTreeParameters portal = tree(hilum, {-18.0, -12.0, 4.0}, root, Part::Portal, 7.0);
    const VesselTreeParameters hepatic = tree(dome, {-8.0, 16.0, -10.0}, 0.9 * root, Part::Hepatic, 5.0);

    // Lesions first: as many as find room between the surface and the roots of the trees.
    struct Lesion {
      Vector3d centre;
      double radius;
    };
    std::vector<Lesion> lesions;
    const auto toSurface = [&liver](const Vector3d& p) {
      const Vector3d out = p - liver.centre;
      const double far = out.norm();
      return far > 0.0 ? 0.8 * (liver.inner(out / far) - far) : liver.inner(Vector3d::UnitX());
    };
    const auto toRoot = [&](const VesselTreeParameters& t, const Vector3d& p) {
      const Vector3d along = t.direction.normalized();
      const double s = std::clamp((p - t.root).dot(along), 0.0, 1.3 * t.rootLengthMm); // and a little of what follows
      return (p - t.root - s * along).norm() - (1.0 + p_.wallShare) * t.rootRadiusMm;
    };
    const auto toLesions = [&lesions](const Vector3d& p) {
      double least = std::numeric_limits<double>::infinity();
      for (const Lesion& lesion : lesions)
        least = std::min(least, (p - lesion.centre).norm() - lesion.radius);
      return least;
    };
    const std::array<int, 3> counts{p_.cysts, p_.darkLesions, p_.brightLesions};
    const std::array<const char*, 3> names{"cyst", "dark lesion", "bright lesion"}, stuff{"cyst", "lesion-dark", "lesion-bright"};
    Random draw = StreamOf(p_, Part::Lesions);
    for (int i = 0; i < *std::max_element(counts.begin(), counts.end()); ++i)
      for (std::size_t kind = 0; kind < counts.size(); ++kind) {
        if (i >= counts[kind])
          continue;
        double size = p_.lesionRadiusMm * (i == 0 ? 1.0 : draw.Uniform(0.5, 1.0));
        for (int attempt = 0; attempt < 200; ++attempt, size *= 0.985) {
          const Vector3d unit(draw.Uniform(-1.0, 1.0), draw.Uniform(-1.0, 1.0), draw.Uniform(-1.0, 1.0));
          const Vector3d at = centre + unit.cwiseProduct(radii);
          double room = std::min(toSurface(at), toLesions(at));
          if (p_.generations > 0)
            room = std::min({room, toRoot(portal, at), toRoot(hepatic, at)});
          if (room < size + 2.0)
            continue;
          lesions.push_back({at, size});
          const Waviness shape(draw);
          const Vector3d squash(1.0, draw.Uniform(0.8, 1.0), draw.Uniform(0.8, 1.0));
          Blob(names[kind], StandardMaterial(stuff[kind]), at,
               Bent(EllipsoidRadius(size * squash), shape, kind == 0 ? 0.05 : 0.15), DetailFor(size));
          break;
        }
      }
    if (p_.generations == 0)
      return;

    const double gap = 1.0;
    const std::vector<VesselBranch> portalTree = GrowVessels(portal, [&](const Vector3d& p) {
      return std::min({toSurface(p) - gap, toLesions(p) - gap, toRoot(hepatic, p) - gap});
    });
    const std::vector<VesselBranch> hepaticTree = GrowVessels(hepatic, [&](const Vector3d& p) {
      double least = std::min(toSurface(p), toLesions(p));
      for (const VesselBranch& branch : portalTree) {
        const Vector3d along = branch.to - branch.from;
        const double t = std::clamp((p - branch.from).dot(along) / along.squaredNorm(), 0.0, 1.0);
        least = std::min(least, (p - branch.from - t * along).norm() - (1.0 + p_.wallShare) * branch.radius);
      }
      return least - gap;
    });
    AddTree("portal vein", portalTree, true);
    AddTree("hepatic vein", hepaticTree, false);
  }

  // All walls before all lumens, so that blood flows through where branches meet.
  void AddTree(const std::string& name, const std::vector<VesselBranch>& tree, bool walled)
  {
    const std::vector<VesselStem> stems = StemsOf(tree);
    for (const bool wall : {true, false}) {
      if (wall && !walled)
        continue;
      for (const VesselStem& stem : stems) {
        std::vector<double> radius = stem.radius;
        if (wall)
          for (double& r : radius)
            r *= 1.0 + p_.wallShare;
        AddTube(tissue_, wall ? name + " wall" : name, wall ? Sheet("vessel-wall", 8.0, 1572.0) : StandardMaterial("blood"),
                stem.path, radius, std::min(p_.detailMm, 0.45 * stem.radius.front()));
      }
    }
  }

  void AddKidney()
  {
    Random random = StreamOf(p_, Part::Kidney);
    const Vector3d centre = Place(74.0, 4.0, 63.0) + Shift(random);
    const Vector3d radii = Size(random, 23.0, 50.0, 20.0);
    const Eigen::Matrix3d axes =
        (Eigen::AngleAxisd(0.10, Vector3d::UnitZ()) * Eigen::AngleAxisd(-0.25, Vector3d::UnitY())).toRotationMatrix();
    const Vector3d hilum = axes * -Vector3d::UnitX();
    const RadiusOf bent = Bent(EllipsoidRadius(radii, axes), Waviness(random), 0.05 * p_.variation);
    const Organ kidney = AddOrgan("kidney", StandardMaterial("kidney"), centre, [bent, hilum](const Vector3d& d) {
      return bent(d) * (1.0 - 0.3 * std::exp(-(d - hilum).squaredNorm() / 0.25));
    });
    // Pyramids in two rows around the sinus, away from the hilum.
    const Material medulla = Mixed("kidney", "kidney-medulla", -9.0);
    constexpr int pyramids = 9;
    for (int i = 0; i < pyramids; ++i) {
      const double angle = Pi * (0.22 + 1.56 * i / (pyramids - 1)), tilt = i % 2 == 0 ? 0.35 : -0.35;
      const Vector3d d = axes * Vector3d(-std::cos(angle) * std::cos(tilt), std::sin(angle) * std::cos(tilt), std::sin(tilt));
      const double r = kidney.inner(d);
      const auto [u, v] = std::pair(d.unitOrthogonal(), d.cross(d.unitOrthogonal()));
      Eigen::Matrix3d own;
      own << d, u, v;
      const double across = scale_ * (4.4 + 0.5 * random.Uniform(-1.0, 1.0) * std::min(1.0, p_.variation));
      Blob("pyramid", medulla, centre + 0.62 * r * d, EllipsoidRadius({0.2 * r, across, across}, own), DetailFor(across));
    }
    const RadiusOf sinus = Bent(EllipsoidRadius(Vector3d(10.0, 27.0, 8.0) * (radii.y() / 50.0), axes), Waviness(random), 0.35);
    Blob("sinus", Mixed("fat", "renal-sinus", 9.0), centre + 4.0 * scale_ * hilum, sinus, DetailFor(6.0 * scale_));
  }

  void AddGallbladder()
  {
    Random random = StreamOf(p_, Part::Gallbladder);
    const Vector3d centre = Place(22.0, -24.0, 70.0) + Shift(random);
    const Vector3d radii = Size(random, 11.5, 27.0, 11.0);
    const Eigen::Matrix3d axes =
        (Eigen::AngleAxisd(0.35, Vector3d::UnitZ()) * Eigen::AngleAxisd(0.25, Vector3d::UnitX())).toRotationMatrix();
    const RadiusOf bent = Bent(EllipsoidRadius(radii, axes), Waviness(random), 0.05 * p_.variation);
    const RadiusOf pear = [bent, axes](const Vector3d& d) {
      const double along = d.dot(axes.col(1));
      return bent(d) * (1.0 - 0.14 * (1.0 + along) * (1.0 - along * along));
    };
    const RadiusOf inner = p_.capsuleMm > 0.0 ? Shell(pear, -p_.capsuleMm) : pear;
    if (p_.capsuleMm > 0.0)
      Blob("gallbladder wall", Sheet("capsule", 9.0, 1560.0), centre, pear, 0.7 * p_.detailMm);
    Blob("gallbladder", Mixed("cyst", "bile", Material::clearDb), centre, inner, 0.7 * p_.detailMm);

    // Stones lie on the wall that is farthest from the probe, side by side along the gallbladder.
    Random draw = StreamOf(p_, Part::Stones);
    for (int i = 0; i < p_.stones; ++i) {
      const double size = std::min(p_.stoneMm, 5.0 * scale_) * (i == 0 ? 1.0 : draw.Uniform(0.5, 0.8));
      const double along = -0.35 + (i % 2 == 0 ? 1.0 : -1.0) * 0.45 * ((i + 1) / 2);
      const Vector3d d = (Vector3d::UnitZ() + along * 1.6 * axes.col(1)).normalized();
      const Waviness shape(draw);
      Blob("stone", StandardMaterial("stone"), centre + (inner(d) - 1.25 * size) * d,
           Bent([size](const Vector3d&) { return size; }, shape, 0.15), DetailFor(size));
    }
  }

  const AnatomyParameters& p_;
  const Progress& progress_;
  Wall wall_;
  double scale_;
  TissueSurface tissue_;
};

} // namespace

ParameterList Describe(AnatomyParameters& p)
{
  return {
      Parameter("Seed", p.seed, {0, 9223372036854775807.0}, "", "Which individual: shapes, places, vessels and lesions."),
      Parameter("Variation", p.variation, {0, 2}, "",
                "How far individuals (seeds) differ in shape and place; 0: they are alike but for their vessels and lesions."),
      Parameter("DetailMm", p.detailMm, {0.5, 10}, "mm", "Edge of the triangles of large bodies; small bodies are finer."),
      Parameter("OrganScale", p.organScale, {0.5, 1.2}, "", "Size of all organs and of the spine beside an adult's."),
      Parameter("TrunkWidthMm", p.trunkWidthMm, {150, 600}, "mm", "Size of the trunk along x."),
      Parameter("TrunkLengthMm", p.trunkLengthMm, {120, 600}, "mm", "Size of the trunk along y."),
      Parameter("TrunkDepthMm", p.trunkDepthMm, {60, 400}, "mm", "Size of the trunk along z, from the skin."),
      Parameter("StandoffMm", p.standoffMm, {-10, 20}, "mm",
                "Gel between the middle of the probe's face (z = 0) and the skin; below 0 the face lies inside the body, which "
                "is not deformed."),
      Parameter("UndulationMm", p.undulationMm, {0, 4}, "mm",
                "How far a layer's thickness deviates from its mean, never by more than half of it."),
      Parameter("SkinMm", p.skinMm, {0.5, 5}, "mm", "Thickness of the skin."),
      Parameter("FatMm", p.fatMm, {2, 60}, "mm", "Thickness of the fat."),
      Parameter("MuscleMm", p.muscleMm, {2, 30}, "mm", "Thickness of the muscle."),
      Parameter("FasciaMm", p.fasciaMm, {0, 2}, "mm", "Thickness of the bright sheets on both sides of the muscle; 0: none."),
      Parameter("Septa", p.septa, {0, 2000}, "", "Number of thin bright leaves in fat and muscle."),
      Parameter("Lumps", p.lumps, {0, 1000}, "", "Number of lobules of fat and loops of bowel around the organs."),
      Parameter("Liver", p.liver, "Whether there is a liver, with its vessels and what is found in it."),
      Parameter("Kidney", p.kidney, "Whether there is a kidney, with pyramids and a bright sinus."),
      Parameter("Gallbladder", p.gallbladder, "Whether there is a gallbladder, with its stones."),
      Parameter("CapsuleMm", p.capsuleMm, {0, 3}, "mm",
                "Thickness of the capsules of liver and kidney and of the wall of the gallbladder; 0: none."),
      Parameter("Stones", p.stones, {0, 5}, "", "Number of stones in the gallbladder."),
      Parameter("StoneMm", p.stoneMm, {1, 7}, "mm", "Radius of the largest stone."),
      Parameter("GreatVessels", p.greatVessels, "Whether aorta and vena cava run along the spine."),
      Parameter("Generations", p.generations, {0, 9}, "",
                "Branchings from the root of the liver's vessels to a tip at most; 0: no trees."),
      Parameter("VesselRadiusMm", p.vesselRadiusMm, {1, 8}, "mm", "Radius of the portal vein."),
      Parameter("SmallestVesselMm", p.smallestVesselMm, {0.4, 8}, "mm", "Radius of the narrowest vessels."),
      Parameter("BranchAsymmetry", p.branchAsymmetry, {0, 0.6}, "",
                "By which share the smaller of two branches is narrower, on average."),
      Parameter("WallShare", p.wallShare, {0.02, 0.5}, "", "Thickness of a vessel's wall beside its radius."),
      Parameter("Cysts", p.cysts, {0, 20}, "", "Number of cysts in the liver, as far as there is room."),
      Parameter("DarkLesions", p.darkLesions, {0, 20}, "", "Number of dark lesions in the liver, as far as there is room."),
      Parameter("BrightLesions", p.brightLesions, {0, 20}, "", "Number of bright lesions in the liver, as far as there is room."),
      Parameter("LesionRadiusMm", p.lesionRadiusMm, {1, 20}, "mm",
                "Radius of the largest cyst and lesions; the others are down to half of it."),
      Parameter("Ribs", p.ribs, {0, 6}, "", "Number of ribs across the muscle on the -x side."),
      Parameter("Spine", p.spine, "Whether there are vertebrae behind the great vessels."),
  };
}

void AnatomyParameters::Check() const
{
  CheckRanges(*this);
  const double shift = shiftMm * variation;
  const auto atLeast = [](const char* what, double value, double least) {
    if (value < least)
      throw Error(Error::Kind::InvalidParameter, std::string(what) + " is " + NumberText(value) + " mm; the organs need " +
                                                     NumberText(std::ceil(least)) + " at least");
  };
  atLeast("TrunkWidthMm", trunkWidthMm, 2.0 * (organScale * (halfWidth + shift) + edge));
  atLeast("TrunkLengthMm", trunkLengthMm, 2.0 * (organScale * (halfLength + shift) + edge));
  atLeast("TrunkDepthMm", trunkDepthMm,
          Wall(*this).Deepest() - standoffMm + 1.0 + organScale * ((spine ? depthOfSpine : depthOfOrgans) + shift) + edge);
}

TissueSurface MakeAnatomy(const AnatomyParameters& parameters, const Progress& progress)
{
  parameters.Check();
  progress(0.0);
  return AnatomyMaker(parameters, progress).Make();
}

} // namespace echorama
