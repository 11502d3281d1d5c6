// SPDX-License-Identifier: BSD-3-Clause
#include "SceneTissue.h"
#include "Core/Base/NumberText.h"
#include "Filters/Phantoms/BodyShapes.h"
#include "Filters/Phantoms/Phantom.h"
#include "Filters/Tissue/SurfaceRefinement.h"
#include <algorithm>

namespace echorama {
namespace {

using Eigen::Vector3d;

// Makes bodies of one item after the other.
class SceneTissueMaker {
public:
  SceneTissueMaker(const SynthesisScene& scene, const MeshReader& readMesh, std::vector<std::string>& notes)
    : scene_(scene), readMesh_(readMesh), notes_(notes), background_(scene.MaterialOf(scene.background))
  {
  }

  TissueSurface Make(const SceneItem& item, const Progress& progress)
  {
    tissue_ = {};
    tissue_.materials = {background_};
    name_ = item.name;
    progress_ = progress;
    std::visit([this](const auto& what) { Add(what); }, item.what);
    return std::move(tissue_);
  }

  const Material& Background() const { return background_; }

private:
  void Add(const ScenePacking& packing)
  {
    const PackedTissue packed = MakePackedTissue(scene_.ParametersOf(packing), progress_);
    if (packed.packing.saturated)
      notes_.push_back("the packing is full: " + std::to_string(packed.packing.spheres.size()) + " spheres fill " +
                       NumberText(packed.packing.fillFraction) + " of their region, " +
                       NumberText(packing.tissue.packing.fillFraction) + " was asked for");
    tissue_.Append(packed.surface);
  }

  void Add(const AnatomyParameters& anatomy) { tissue_.Append(MakeAnatomy(anatomy, progress_)); }

  void Add(const CalibrationRigParameters& rig)
  {
    const TissueSurface made = MakeCalibrationRig(rig, progress_);
    if (scene_.background == "water")
      background_ = tissue_.materials.front() = made.materials.front();
    tissue_.Append(made);
  }

  // A wall is the outermost part of its body: a body around what it holds.
  void Add(const ScenePhantom& phantom)
  {
    const Material& reference = scene_.MaterialOf(phantom.background);
    const double frequency = scene_.transducer.frequencyMHz;
    for (const Inclusion& inclusion : phantom.Scene().inclusions) {
      const auto material = [&](const char* suffix, double db) {
        Material made = reference;
        made.name = (inclusion.name.empty() ? "inclusion" : inclusion.name) + suffix;
        made.backscatterDb =
            db <= Inclusion::anechoicDb ? Material::clearDb : std::clamp(reference.backscatterDb + db, -120.0, 60.0);
        if (inclusion.attenuationDbPerMm > 0.0) // there and back, per mm
          made.attenuation += 5.0 * inclusion.attenuationDbPerMm / std::pow(frequency, made.attenuationPower);
        return made;
      };
      const bool hasWall = inclusion.wallMm > 0.0;
      if (hasWall)
        AddInclusion(inclusion, 0.0, material(" wall", inclusion.wallDb));
      AddInclusion(inclusion, hasWall ? inclusion.wallMm : 0.0, material("", inclusion.echogenicityDb));
    }
  }

  // \a inset: how far within its surface, mm; a body that is thinner is all wall.
  void AddInclusion(const Inclusion& inclusion, double inset, const Material& material)
  {
    constexpr double detail = 12.0; // pieces of a radius
    if (const auto* ellipsoid = std::get_if<Ellipsoid>(&inclusion.shape)) {
      const Vector3d radii = ellipsoid->radii.array() - inset;
      if (radii.minCoeff() > 0.0)
        AddBlob(tissue_, inclusion.name, material, ellipsoid->centre, EllipsoidRadius(radii, ExpRotation(ellipsoid->rotation)),
                std::max(0.02, radii.minCoeff() / detail));
      return;
    }
    const auto& tube = std::get<Tube>(inclusion.shape);
    if (tube.radius > inset)
      AddTube(tissue_, inclusion.name, material, tube.path, std::vector<double>(tube.path.size(), tube.radius - inset),
              std::max(0.02, (tube.radius - inset) / 4.0));
  }

  void Add(const SceneMesh& mesh)
  {
    TriangleSurface surface = readMesh_(scene_.PathOf(mesh.file));
    const Eigen::Affine3d toWorld = mesh.ToWorld();
    for (Eigen::Vector3f& point : surface.points)
      point = (toWorld * point.cast<double>()).cast<float>();
    MendSurface(surface, {}, progress_.Part(0.0, 0.5));
    const std::string faults = CheckSurface(surface, {}, progress_.Part(0.5, 1.0)).Faults();
    if (!faults.empty())
      notes_.push_back(mesh.file + ": " + faults);
    AddSurface(surface.points, surface.triangles, mesh.material);
  }

  void Add(const SceneSphere& sphere)
  {
    AddBlob(
        tissue_, name_, scene_.MaterialOf(sphere.material), sphere.centre, [&sphere](const Vector3d&) { return sphere.radius; },
        std::max(0.02, sphere.radius / 12.0));
  }

  void Add(const SceneBox& box)
  {
    Eigen::Affine3d toWorld = Eigen::Affine3d::Identity();
    toWorld.linear() = ExpRotation(box.rotationDegrees / 57.29577951308232) * box.size.asDiagonal();
    toWorld.translation() = box.centre;
    std::vector<Eigen::Vector3f> points;
    for (int i = 0; i < 8; ++i)
      points.push_back((toWorld * Vector3d(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5)).cast<float>());
    AddSurface(points,
               {{0, 2, 1},
                {1, 2, 3},
                {4, 5, 6},
                {5, 7, 6},
                {0, 1, 4},
                {1, 5, 4},
                {2, 6, 3},
                {3, 6, 7},
                {0, 4, 2},
                {2, 4, 6},
                {1, 3, 5},
                {3, 7, 5}},
               box.material);
  }

  // Flat ends: a fan of triangles each.
  void Add(const SceneCylinder& cylinder)
  {
    constexpr std::uint32_t around = 96;
    const Vector3d axis = (cylinder.to - cylinder.from).normalized(), u = axis.unitOrthogonal(), v = axis.cross(u);
    std::vector<Eigen::Vector3f> points{cylinder.from.cast<float>(), cylinder.to.cast<float>()};
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (std::uint32_t i = 0; i < around; ++i) {
      const double angle = 6.283185307179586 * i / around;
      const Vector3d out = cylinder.radius * (std::cos(angle) * u + std::sin(angle) * v);
      points.push_back((cylinder.from + out).cast<float>());
      points.push_back((cylinder.to + out).cast<float>());
      const std::uint32_t a = 2 + 2 * i, b = 2 + 2 * ((i + 1) % around);
      triangles.insert(triangles.end(), {{0, b, a}, {1, a + 1, b + 1}, {a, b, a + 1}, {b, b + 1, a + 1}});
    }
    AddSurface(points, triangles, cylinder.material);
  }

  void AddSurface(const std::vector<Eigen::Vector3f>& points, const std::vector<std::array<std::uint32_t, 3>>& triangles,
                  const std::string& material)
  {
    const auto first = static_cast<std::uint32_t>(tissue_.points.size());
    const auto body = static_cast<std::int32_t>(tissue_.bodies.size());
    tissue_.bodies.push_back({name_, tissue_.MaterialIndex(scene_.MaterialOf(material))});
    tissue_.points.insert(tissue_.points.end(), points.begin(), points.end());
    for (const auto& [a, b, c] : triangles)
      tissue_.triangles.push_back({first + a, first + b, first + c});
    tissue_.bodyOfTriangle.insert(tissue_.bodyOfTriangle.end(), triangles.size(), body);
  }

  const SynthesisScene& scene_;
  const MeshReader& readMesh_;
  std::vector<std::string>& notes_;
  Material background_;
  TissueSurface tissue_;
  std::string name_;
  Progress progress_;
};

} // namespace

SceneTissue::SceneTissue(const SynthesisScene& scene, const Eigen::AlignedBox3d& pressed, const MeshReader& readMesh,
                         std::vector<std::string>& notes, const Progress& progress)
{
  SceneTissueMaker maker(scene, readMesh, notes);
  const double count = static_cast<double>(scene.tissue.size());
  for (std::size_t i = 0; i < scene.tissue.size(); ++i) {
    const SceneItem& item = scene.tissue[i];
    TissueSurface surface = maker.Make(item, progress.Part(static_cast<double>(i) / count, static_cast<double>(i + 1) / count));
    if (scene.press)
      RefineSurface(surface, scene.press->lattice.spacingMm, pressed); // a box of twelve triangles could not be bent
    items_.push_back({std::move(surface), item.firstView, item.lastView});
  }
  background_ = maker.Background();
}

template <class Condition>
TissueSurface SceneTissue::Where(const Condition& condition) const
{
  TissueSurface tissue;
  tissue.materials = {background_};
  for (const Item& item : items_)
    if (condition(item))
      tissue.Append(item.surface);
  return tissue;
}

TissueSurface SceneTissue::All() const
{
  return Where([](const Item&) { return true; });
}

TissueSurface SceneTissue::In(int view) const
{
  return Where([view](const Item& item) { return item.firstView <= view && view <= item.lastView; });
}

TissueSurface SceneTissue::InAll(int views) const
{
  return Where([views](const Item& item) { return item.firstView == 1 && item.lastView >= views; });
}

void AddRib(TissueSurface& tissue, const ProbeGeometry& probe, const Pose& probeToWorld, double share)
{
  const auto rib = std::get<Ellipsoid>(RibBelow(probe, probeToWorld, share).shape);
  // A rod of an elliptic cross-section: in the middle of so long a body the ellipsoid is one, and triangles stay well shaped.
  constexpr double halfLength = 100.0; // mm
  TissueSurface rod;
  Material cortical = StandardMaterial("bone");
  cortical.name = "rib";
  cortical.attenuation = 20.0; // dB/cm/MHz, the upper end of what is published: nothing passes 5 mm of it
  rod.materials = {cortical};
  std::vector<Vector3d> path;
  for (double along = -halfLength; along <= halfLength; along += 2.0)
    path.push_back({0.0, along / rib.radii.x(), 0.0});
  AddTube(rod, "rib", cortical, path, std::vector<double>(path.size(), 1.0), 0.2);
  Eigen::Affine3d toWorld(ExpRotation(rib.rotation));
  toWorld.pretranslate(rib.centre);
  const Vector3d scale(rib.radii.x(), rib.radii.x(), rib.radii.z());
  for (Eigen::Vector3f& point : rod.points)
    point = (toWorld * scale.cwiseProduct(point.cast<double>())).cast<float>();
  tissue.Append(rod);
}

} // namespace echorama
