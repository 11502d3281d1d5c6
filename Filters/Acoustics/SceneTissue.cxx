// SPDX-License-Identifier: BSD-3-Clause
#include "SceneTissue.h"
#include "Core/Base/NumberText.h"
#include "Filters/Phantoms/BodyShapes.h"

namespace echorama {
namespace {

using Eigen::Vector3d;

// Makes bodies of one item after the other.
class SceneTissueMaker {
public:
  SceneTissueMaker(const SynthesisScene& scene, const MeshReader& readMesh, std::vector<std::string>& notes,
                   TissueSurface& tissue)
    : scene_(scene), readMesh_(readMesh), notes_(notes), tissue_(tissue)
  {
  }

  void Make(const SceneItem& item, const Progress& progress)
  {
    name_ = item.name;
    progress_ = progress;
    std::visit([this](const auto& what) { Add(what); }, item.what);
  }

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
      tissue_.materials.front() = made.materials.front();
    tissue_.Append(made);
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
  TissueSurface& tissue_;
  std::string name_;
  Progress progress_;
};

} // namespace

TissueSurface TissueOf(const SynthesisScene& scene, const MeshReader& readMesh, std::vector<std::string>& notes,
                       const Progress& progress)
{
  TissueSurface tissue;
  tissue.materials = {scene.MaterialOf(scene.background)};
  SceneTissueMaker maker(scene, readMesh, notes, tissue);
  const double count = static_cast<double>(scene.tissue.size());
  for (std::size_t i = 0; i < scene.tissue.size(); ++i)
    maker.Make(scene.tissue[i], progress.Part(static_cast<double>(i) / count, static_cast<double>(i + 1) / count));
  return tissue;
}

std::vector<Pose> StepPoses(const SynthesisScene& scene, const Pose& middle)
{
  const int steps = scene.Parameters().BeamDimensions()[2];
  std::vector<Pose> poses;
  if (scene.sweep.seconds > 0.0 && steps > 1)
    for (int step = 0; step < steps; ++step)
      poses.push_back(scene.sweep.ProbeToWorldAt(middle, scene.sweep.seconds * (static_cast<double>(step) / (steps - 1) - 0.5)));
  return poses;
}

} // namespace echorama
