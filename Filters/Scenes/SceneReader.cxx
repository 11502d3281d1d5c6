// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/NumberText.h"
#include "Core/Base/TextFile.h"
#include "SceneKeys.h"
#include <filesystem>

namespace echorama {
namespace scene {
namespace {

using described::Json, described::Shown;
using Eigen::Vector3d;

bool IsAffine(const Eigen::Matrix4d& rows)
{
  return rows.allFinite() && rows.row(3) == Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0);
}

// Checks beyond the ranges; a message without its place.

template <class T>
void Validate(const T& value)
{
  if constexpr (std::is_same_v<T, AnatomyParameters> || std::is_same_v<T, CalibrationRigParameters> ||
                std::is_same_v<T, Receiver>)
    value.Check();
}

void Validate(const ScenePlace& place)
{
  if (!place.rows)
    return;
  if (!IsAffine(*place.rows))
    Refuse("the last row must be 0 0 0 1");
  const Eigen::Matrix3d linear = place.rows->topLeftCorner<3, 3>();
  if (!(linear.determinant() > 1e-12 * std::pow(linear.norm(), 3)))
    Refuse("the matrix mirrors or flattens what it moves");
}

void Validate(const ScenePose& pose)
{
  if (pose.rows) {
    if (!IsAffine(*pose.rows) || !IsRotation(pose.rows->topLeftCorner<3, 3>()))
      Refuse("the matrix is not rigid: a rotation and a translation, with 0 0 0 1 as its last row");
    return;
  }
  const Vector3d beam = pose.target - pose.face;
  if (!(beam.norm() > 1e-6))
    Refuse("face and target are the same point");
  if (!(pose.fan.cross(beam).norm() > 1e-6 * pose.fan.norm() * beam.norm()))
    Refuse("the fan lies along the beam");
}

void Validate(const SceneProbe& probe)
{
  probe.Resolve();
}

void Validate(const ScenePacking& packing)
{
  packing.tissue.packing.Check();
  if (std::none_of(packing.materials.begin(), packing.materials.end(), [](const auto& share) { return share.weight > 0.0; }))
    Refuse("no material has a weight above 0");
}

void Validate(const SceneCylinder& cylinder)
{
  if (!((cylinder.to - cylinder.from).norm() > 1e-6))
    Refuse("from and to are the same point");
}

void ValidateTimes(const std::vector<double>& times)
{
  if (std::adjacent_find(times.begin(), times.end(), [](double a, double b) { return !(a < b); }) != times.end())
    Refuse("times must rise");
}

void Validate(const SceneRecording& recording)
{
  const Eigen::Matrix4d matrix = recording.trackerToWorld.Matrix().matrix();
  if (!IsRotation(matrix.topLeftCorner<3, 3>()))
    Refuse("trackerToWorld is not rigid");
  ValidateTimes(recording.times);
}

void Validate(const SceneMotion& motion)
{
  std::vector<double> seconds;
  for (const SceneMotion::Key& key : motion.keys)
    seconds.push_back(key.seconds);
  ValidateTimes(seconds);
  ValidateTimes(motion.times);
  for (const double time : motion.times)
    if (!(time >= seconds.front() && time <= seconds.back()))
      Refuse("there is no pose for the view at " + NumberText(time) + " s");
}

void Validate(const ScenePhantom& phantom)
{
  phantom.listed.Check();
}

void Validate(const SceneItem& item)
{
  if (item.firstView > item.lastView)
    Refuse("it is there in no view: its first is " + std::to_string(item.firstView) + ", its last " +
           std::to_string(item.lastView));
}

// What an item has from its scene unless it says otherwise.
template <class T>
void Inherit(const SynthesisScene&, T&)
{
}

void Inherit(const SynthesisScene& scene, ScenePacking& packing)
{
  packing.tissue.packing.seed = scene.seed;
}

void Inherit(const SynthesisScene& scene, AnatomyParameters& anatomy)
{
  anatomy.seed = scene.seed;
}

} // namespace

// The context is the scene whose materials and seed are read so far. Not in a nameless namespace: the keys are found beside it.
class Reader : public described::Reader<Reader, const SynthesisScene> {
public:
  using Base = described::Reader<Reader, const SynthesisScene>;
  using Base::Base;
  template <class T>
  static constexpr bool mayBeList = mayBeRows<T>;
  template <class T>
  static void Validate(const T& value)
  {
    scene::Validate(value);
  }
  template <class T>
  static void Inherit(const SynthesisScene& scene, T& value)
  {
    scene::Inherit(scene, value);
  }

  template <class T>
  void ReadBody(T& value)
  {
    if constexpr (mayBeRows<T>)
      value.rows = Rows();
    if (object_.is_object())
      Base::ReadBody(value);
  }

  void MaterialName(const char* key, std::string& value, Presence presence = {})
  {
    Value(Parameter(key, value, ""), presence);
    Try(At(key), [this, &value] { context_.MaterialOf(value); });
  }

  void Shares(const char* key, std::vector<ScenePacking::Share>& shares, const char*)
  {
    const Json* found = Find(key);
    if (!found)
      return;
    if (!found->is_object())
      Fail(At(key), "an object of weights by material is needed, not " + Shown(*found));
    shares.clear();
    for (const auto& [name, weight] : found->items()) {
      Try(At(key), [this, &name = name] { context_.MaterialOf(name); });
      shares.push_back({name, NumberFrom<double>(weight, At(key) + "." + name, weights)});
    }
  }

  template <class Variant>
  void Views(const char* key, Variant& value, const char*)
  {
    const Json* found = Find(key);
    if (!found)
      return;
    if (found->is_object() && found->contains("recording")) {
      RecordingKey recording{value.template emplace<SceneRecording>()};
      Read(name_, context_, *found, At(key), recording);
    } else if (found->is_object() && found->contains("poses"))
      Read(name_, context_, *found, At(key), value.template emplace<SceneViews>());
    else if (found->is_object() && found->contains("keys"))
      Read(name_, context_, *found, At(key), value.template emplace<SceneMotion>());
    else
      Read(name_, context_, *found, At(key), value.template emplace<SceneRow>());
  }

  void Materials(const char* key, std::vector<Material>& materials, const char*)
  {
    const Json* found = Find(key);
    if (!found)
      return;
    if (!found->is_object())
      Fail(At(key), "an object of materials by name is needed, not " + Shown(*found));
    materials.clear();
    for (const auto& [name, json] : found->items()) {
      const std::string place = At(key) + "." + name;
      if (name.empty() || name.size() > 100)
        Fail(At(key), "the name of a material must be of 1 to 100 characters");
      Reader reader(name_, context_, json, place);
      std::string like;
      reader.Value(Parameter("Like", like, ""));
      Material material;
      if (!like.empty())
        reader.Try(place + ".like", [this, &like, &material] { material = context_.MaterialOf(like); });
      material.name = name;
      Describe(reader, material);
      reader.Finish();
      materials.push_back(material);
    }
  }

private:
  /// When it is the rows of a matrix instead of an object.
  std::optional<Eigen::Matrix4d> Rows() const
  {
    if (!object_.is_array())
      return {};
    const auto wrong = [this] { Fail(path_, "4 rows of 4 numbers are needed, not " + Shown(object_)); };
    if (object_.size() != 4)
      wrong();
    Eigen::Matrix4d rows;
    for (std::size_t i = 0; i < 4; ++i) {
      if (!object_[i].is_array() || object_[i].size() != 4)
        wrong();
      for (std::size_t j = 0; j < 4; ++j)
        rows(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
            NumberFrom<double>(object_[i][j], path_ + "[" + std::to_string(i) + "][" + std::to_string(j) + "]", {-1e9, 1e9});
    }
    return rows;
  }
};

} // namespace scene

SynthesisScene SceneFromJson(const std::string& text, const std::string& name, const std::optional<std::uint64_t>& seed)
{
  SynthesisScene scene;
  auto json = JsonPlace(name).Parse(text);
  if (json.is_object())
    json.erase("$schema"); // a hint for editors
  if (seed && json.is_object())
    json["seed"] = *seed;
  scene::Reader::Read(name, scene, json, "", scene);
  if (scene.sweep.alongRecording && !scene.PathViews())
    throw Error(Error::Kind::BadFile, name + ": sweep.alongRecording: the views are neither those of a recording nor of keys");
  if (scene.gel && !scene.MaterialOf(scene.background).IsGas())
    throw Error(Error::Kind::BadFile, name + ": background: around gel there is air, not \"" + scene.background + "\"");
  return scene;
}

SynthesisScene ReadScene(const std::string& path, const std::optional<std::uint64_t>& seed)
{
  SynthesisScene scene = SceneFromJson(ReadTextFile(path), path, seed);
  scene.folder = std::filesystem::path(path).parent_path().string();
  return scene;
}

} // namespace echorama
