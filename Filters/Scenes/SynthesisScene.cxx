// SPDX-License-Identifier: BSD-3-Clause
#include "SynthesisScene.h"
#include "Core/Base/Angles.h"
#include "SceneKeys.h"
#include <filesystem>

namespace echorama {

ParameterList Describe(ScenePress& press)
{
  return Join({Describe(press.lattice), Describe(press.tissue), Describe(press.head)});
}

ParameterList Describe(SceneGel& gel)
{
  return Join({Describe(gel.coat), Describe(gel.material)});
}

ParameterList Describe(ScenePathViews& views)
{
  return {Parameter("Count", views.count, {1, SceneItem::mostViews}, "", "Views, evenly from the first pose to the last."),
          Parameter("StepMm", views.stepMm, {0.1, 1000}, "mm",
                    "The farthest that any part of the probe's head goes between two states of tissue and gel.")};
}

ParameterList Describe(SceneChange& change)
{
  return {
      Parameter("Decorrelation", change.decorrelation, {0, 1}, "",
                "How far the speckle has changed between any two views: echoes that are seen alike correlate by 1 less this."),
      Parameter("RibShare", change.ribShare, {0, 0.6}, "",
                "Share of the fan in the shadow of a rib close below the face, in every view but the first; 0: no rib."),
      Parameter("GainDb", change.gainDb, {-40, 40}, "dB", "Gain of every second view, beside the others.")};
}

PhantomScene ScenePhantom::Scene() const
{
  if (!listed.inclusions.empty())
    return listed;
  PhantomScene scene;
  if (bodies == Bodies::Jets)
    scene.inclusions = Jets();
  else
    scene = DefaultScene();
  return scene;
}

ParameterList Describe(SceneVolume& volume)
{
  return {Parameter("SpacingMm", volume.spacingMm, {0.05, 20}, "mm", "Edge of the cubic voxels."),
          Parameter("KnockMm", volume.knockMm, {0, 1000}, "mm", "How far every volume but the first is put out of place."),
          Parameter("KnockDegrees", volume.knockDegrees, {0, 180}, "degrees", "How far every volume but the first is turned.")};
}

Eigen::Affine3d ScenePlace::Matrix() const
{
  if (rows)
    return Eigen::Affine3d(*rows);
  Eigen::Affine3d matrix = Eigen::Affine3d::Identity();
  matrix.linear() = scale * ExpRotation(RadiansPerDegree * rotationDegrees);
  matrix.translation() = translation;
  return matrix;
}

Pose ScenePose::ProbeToWorld() const
{
  Pose pose = Pose::Identity();
  if (rows) {
    pose.matrix() = *rows;
    // Rows that were rounded for a file are made a rotation again.
    const Eigen::Matrix3d rotation = pose.linear();
    if (!IsRotation(rotation, 1e-12))
      pose.linear() = Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
    return pose;
  }
  const Eigen::Vector3d z = (target - face).normalized(), x = (fan - fan.dot(z) * z).normalized();
  pose.linear().col(0) = x;
  pose.linear().col(1) = z.cross(x);
  pose.linear().col(2) = z;
  pose.translation() = face;
  return pose;
}

ProbePreset SceneProbe::Resolve() const
{
  ProbePreset probe = ProbePresetOf(preset);
  ProbeGeometry& head = probe.probe;
  const auto bend = [](const char* what, const std::optional<double>& angleDegrees, const std::optional<double>& radius,
                       const std::optional<double>& newWidth, double& angle, double& width) {
    if (radius && newWidth)
      scene::Refuse(std::string(what) + "RadiusMm and " + what + "WidthMm say the same; give one of them");
    const double oldRadius = angle > 0.0 ? width / angle : 0.0;
    const bool bent = angle > 0.0;
    if (angleDegrees)
      angle = RadiansPerDegree * *angleDegrees;
    if (newWidth)
      width = *newWidth;
    else if (radius)
      width = angle * *radius;
    else if (angleDegrees && bent)
      width = angle * oldRadius;
  };
  bend("fan", fanAngleDegrees, fanRadiusMm, fanWidthMm, head.fanAngle, head.fanWidth);
  bend("sweep", sweepAngleDegrees, sweepRadiusMm, sweepWidthMm, head.sweepAngle, head.sweepWidth);
  head.depthMin = depthMinMm.value_or(head.depthMin);
  head.depthMax = depthMaxMm.value_or(head.depthMax);
  probe.elements = elements.value_or(probe.elements);
  probe.samples = samples.value_or(probe.samples);
  probe.sweepSteps = sweepSteps.value_or(probe.sweepSteps);
  if (!sweepSteps && probe.sweepSteps == 1 && !head.IsPlane())
    scene::Refuse("the preset is of a single plane; say sweepSteps to sweep it");
  if (probe.sweepSteps > 1 && head.IsPlane())
    scene::Refuse("sweepSteps is " + std::to_string(probe.sweepSteps) + ", but the sweep has neither angle nor width");
  head.Check();
  if (probe.sweepSteps == 1)
    head.sweepAngle = head.sweepWidth = 0.0;
  return probe;
}

Eigen::Affine3d SceneMesh::ToWorld() const
{
  Eigen::Matrix3d linear = Eigen::Matrix3d::Identity();
  if (axes == Axes::YUp)
    linear << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return transform.Matrix() * Eigen::Affine3d((unit == Unit::Metres ? 1000.0 : 1.0) * linear);
}

Pose SceneSweep::ProbeToWorldAt(const Pose& middle, double secondsFromMiddle) const
{
  Pose motion(ExpRotation(secondsFromMiddle * RadiansPerDegree * turnDegreesPerSecond));
  motion.translation() = secondsFromMiddle * velocityMmPerSecond;
  return middle * motion;
}

const Material& SynthesisScene::MaterialOf(const std::string& wanted) const
{
  const auto lists = {&materials, &StandardMaterials()};
  for (const std::vector<Material>* list : lists)
    for (const Material& material : *list)
      if (material.name == wanted)
        return material;
  std::string names;
  for (const std::vector<Material>* list : lists)
    for (const Material& material : *list)
      names += (names.empty() ? "" : ", ") + material.name;
  throw Error(Error::Kind::InvalidParameter, "there is no material " + described::Shown(wanted) + "; there are " + names);
}

const ScenePathViews* SynthesisScene::PathViews() const
{
  if (const auto* recording = std::get_if<SceneRecording>(&views))
    return recording;
  return std::get_if<SceneMotion>(&views);
}

SynthesisParameters SynthesisScene::Parameters() const
{
  const ProbePreset resolved = probe.Resolve();
  SynthesisParameters parameters;
  static_cast<EchoModel&>(parameters) = echoes;
  parameters.probe = resolved.probe;
  parameters.elements = resolved.elements;
  parameters.steps = resolved.sweepSteps;
  parameters.samples = resolved.samples;
  parameters.transducer = transducer;
  parameters.counting.assumedSoundSpeed = transducer.assumedSoundSpeed;
  parameters.counting.seed = seed;
  parameters.receiver = receiver;
  parameters.seed = seed;
  return parameters;
}

PackedTissueParameters SynthesisScene::ParametersOf(const ScenePacking& packing) const
{
  PackedTissueParameters parameters = packing.tissue;
  parameters.background = MaterialOf(background);
  parameters.materials.clear();
  for (const ScenePacking::Share& share : packing.materials)
    parameters.materials.push_back({MaterialOf(share.material), share.weight});
  return parameters;
}

std::string SynthesisScene::PathOf(const std::string& file) const
{
  const std::filesystem::path path(file);
  if (!dataFolder.empty())
    return (std::filesystem::path(dataFolder) / path.filename()).string();
  return path.is_absolute() || folder.empty() ? file : (std::filesystem::path(folder) / path).lexically_normal().string();
}

std::vector<std::string> SynthesisScene::MakeFilesAbsolute()
{
  std::vector<std::string> files;
  const auto resolve = [this, &files](std::string& file) {
    file = std::filesystem::absolute(PathOf(file)).lexically_normal().string();
    files.push_back(file);
  };
  for (SceneItem& item : tissue)
    if (auto* mesh = std::get_if<SceneMesh>(&item.what))
      resolve(mesh->file);
  if (auto* recording = std::get_if<SceneRecording>(&views))
    resolve(recording->file);
  dataFolder.clear();
  return files;
}

std::string SynthesisScene::TimesOfFiles() const
{
  SynthesisScene copy = *this;
  std::string text;
  for (const std::string& file : copy.MakeFilesAbsolute()) {
    std::error_code unknown;
    const auto time = std::filesystem::last_write_time(file, unknown);
    if (!unknown)
      text += file + " " + std::to_string(time.time_since_epoch().count()) + "\n";
  }
  return text;
}

} // namespace echorama
